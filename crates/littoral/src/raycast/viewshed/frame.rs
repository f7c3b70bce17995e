//! An eighth of the land as its observer sees it, and the rings of samples it is swept in.

use super::Scene;
use super::lanes::Lanes;
use crate::field::VoidMask;

/// Height (m) that stands for "no ground here" in lower bounds: low enough to hide nothing, small enough not to overflow.
pub(super) const NOTHING: f32 = -1e30;

/// How many rings are swept at a time: a cache line of the raster's rows when they are crossed.
pub(super) const BATCH: usize = 16;

/// How far outside the octant its first direction lies, so that samples straight ahead of the eye are inside a bin.
const OVERLAP: f64 = 1e-6;

/// An eighth of the land: east or west of the observer (`eastward`: rings are columns), or north or south (rings are
/// rows), and of these the half on one side of the axis. *Major* counts rings, *minor* the samples along one, turned round
/// where needed so that it grows away from the axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub eastward: bool,
    pub forward: bool,
    /// Whether minors run as the raster does.
    pub rising: bool,
    pub eye_major: f64,
    pub eye_minor: f64,
    pub majors: i64,
    pub minors: i64,
    pub spacing_major: f64,
    pub spacing_minor: f64,
    /// How many rings there are, within the land and the radius asked for.
    pub rings: i64,
    /// The eye's minor coordinate as the raster counts.
    eye_raw: f64,
    columns: usize,
}

impl Frame {
    pub fn new(scene: &Scene, eastward: bool, forward: bool, rising: bool) -> Frame {
        let raster = scene.land.raster();
        let (columns, rows) = (raster.columns() as i64, raster.rows() as i64);
        let (eye, spacing) = (scene.eye, raster.spacing());
        let (eye_major, eye_raw, majors, minors, spacing_major, spacing_minor) = if eastward {
            (eye.x, eye.y, columns, rows, spacing.x, spacing.y)
        } else {
            (eye.y, eye.x, rows, columns, spacing.y, spacing.x)
        };
        let all = if forward { majors - 1 - eye_major.floor() as i64 } else { eye_major.ceil() as i64 };
        let rings = all.min((scene.radius / spacing_major).ceil().min(1e9) as i64 + 1).max(0);
        let eye_minor = if rising { eye_raw } else { (minors - 1) as f64 - eye_raw };
        let columns = columns as usize;
        Frame {
            eastward,
            forward,
            rising,
            eye_major,
            eye_minor,
            majors,
            minors,
            spacing_major,
            spacing_minor,
            rings,
            eye_raw,
            columns,
        }
    }

    /// The lattice line of a ring; ring 0 is the one at or just behind the eye.
    pub fn major(&self, ring: i64) -> i64 {
        if self.forward { self.eye_major.floor() as i64 + ring } else { self.eye_major.ceil() as i64 - ring }
    }

    /// Distance of a ring from the eye, in samples.
    pub fn distance(&self, ring: i64) -> f64 {
        (self.major(ring) as f64 - self.eye_major).abs()
    }

    /// A minor coordinate as the raster counts.
    pub fn raw_minor(&self, minor: i64) -> i64 {
        if self.rising { minor } else { self.minors - 1 - minor }
    }

    /// Row-major index of a sample.
    pub fn index(&self, major: i64, minor: i64) -> usize {
        let minor = self.raw_minor(minor);
        if self.eastward {
            minor as usize * self.columns + major as usize
        } else {
            major as usize * self.columns + minor as usize
        }
    }

    /// Direction (minor over major) of the border `part` of `parts` equal parts of the octant. Every wedge, group and bin
    /// takes its borders from here, so that neighbours agree on them.
    pub fn border(part: usize, parts: usize) -> f64 {
        if part == parts { 1.0 } else { (1.0 + OVERLAP) * (part as f64 / parts as f64) - OVERLAP }
    }

    /// Nothing of the land between two rings and two minors, all included, is higher than this (m): from the pyramid, of
    /// lands without voids.
    pub fn highest(&self, scene: &Scene, rings: (i64, i64), minors: (i64, i64)) -> f32 {
        let pyramid = scene.land.ranges();
        let level = 3.min(pyramid.top());
        let (columns, rows) = pyramid.size(level);
        let span = |a: i64, b: i64, samples: i64, nodes: usize| {
            let clamped = [a.min(b), a.max(b) - 1].map(|sample| sample.clamp(0, samples - 2) as usize >> level);
            clamped[0]..=clamped[1].max(clamped[0]).min(nodes - 1)
        };
        let raw = [minors.0, minors.1].map(|minor| self.raw_minor(minor));
        let majors = [rings.0, rings.1].map(|ring| self.major(ring));
        let (across, along) = if self.eastward { (majors, raw) } else { (raw, majors) };
        let (wide, tall) = if self.eastward { (self.majors, self.minors) } else { (self.minors, self.majors) };
        let nodes = pyramid.levels[level as usize - 1];
        let mut highest = 0;
        for row in span(along[0], along[1], tall, rows) {
            for column in span(across[0], across[1], wide, columns) {
                highest = highest.max(pyramid.highs[nodes.offset + row * nodes.columns + column]);
            }
        }
        pyramid.height(highest)
    }

    /// The samples of a ring that belong to this octant, as a half-open range: those straight ahead belong to the rising
    /// one, diagonals to east and west.
    pub fn belonging(&self, ring: i64) -> (i64, i64) {
        let distance = self.distance(ring);
        let axis = self.eye_raw.ceil() as i64;
        let low = if self.rising { axis } else { self.minors - axis };
        let belongs = |minor: i64| {
            let aside = (self.raw_minor(minor) as f64 - self.eye_raw).abs();
            if self.eastward { aside <= distance } else { aside < distance }
        };
        let mut high = (self.eye_minor + distance).floor() as i64 + 1;
        while high >= low && !belongs(high) {
            high -= 1;
        }
        (low.max(0), (high + 1).min(self.minors))
    }
}

/// What the vector kernel needs to know about a ring.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ring {
    pub ring: i64,
    /// Distance from the eye, in samples.
    pub distance: f64,
    pub belonging: (i64, i64),
}

/// A batch of rings: heights relative to the eye (m), less the drop of a curved Earth, each ring a row. Beyond the land
/// its outermost samples are continued. Row 0 is the ring before the batch. Filled block by block, as asked for.
#[derive(Default)]
pub(super) struct Rings {
    pub rings: Vec<Ring>,
    /// Minor coordinate of the first number of a row.
    pub low: i64,
    pub stride: usize,
    pub heights: Vec<f32>,
    /// The same for lower bounds of the ground: [`NOTHING`] at and beside samples that are void on the same or the
    /// previous ring. Empty when the land has no voids.
    pub solid: Vec<f32>,
    /// Greatest height difference to the eye so far (m), and between neighbours along a ring.
    pub reach: f32,
    pub rough: f32,
    /// How many blocks of sixteen samples a row has, and which of them are filled.
    filled: Vec<bool>,
}

impl Rings {
    /// Turns to the rings from `first` on, for directions between `t0` and `t1` (minor over major); false when they lie
    /// outside the land.
    pub fn turn(&mut self, scene: &Scene, frame: &Frame, first: i64, t0: f64, t1: f64) -> bool {
        let count = (frame.rings - first + 1).clamp(0, BATCH as i64);
        self.rings.clear();
        self.rings.extend((0..=count).map(|k| {
            let ring = first - 1 + k;
            Ring { ring, distance: frame.distance(ring), belonging: frame.belonging(ring) }
        }));
        let (near, far) = (frame.distance(first - 1), frame.distance(first - 1 + count));
        let low = (frame.eye_minor + (t0 * near).min(t0 * far)).floor() as i64 - 3;
        let high = (frame.eye_minor + t1 * far).floor() as i64 + 24;
        if low.max(0) > high.min(frame.minors - 1) || count == 0 {
            return false;
        }
        // Directions that have left the land need no room: nobody asks there.
        self.low = low.max(-24);
        let blocks = (high.min(frame.minors + 24) - self.low) as usize / 16 + 2;
        self.stride = 16 * blocks;
        self.filled.clear();
        self.filled.resize(blocks, false);
        let rows = count as usize + 1;
        self.heights.resize(rows * self.stride, 0.0);
        if scene.land.raster().voids().any() {
            self.solid.resize(rows * self.stride, 0.0);
        }
        true
    }

    /// Fills the blocks that hold the numbers from `from` to `to` of each row.
    ///
    /// # Safety
    /// The processor must have the instructions of `V`.
    #[inline(always)]
    pub unsafe fn fill<V: Lanes>(&mut self, scene: &Scene, frame: &Frame, from: usize, to: usize) {
        for block in from / 16..=to / 16 {
            if !self.filled[block] {
                // SAFETY: the caller's.
                unsafe { self.fill_block::<V>(scene, frame, block) };
                self.filled[block] = true;
            }
        }
    }

    /// # Safety
    /// The processor must have the instructions of `V`.
    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    unsafe fn fill_block<V: Lanes>(&mut self, scene: &Scene, frame: &Frame, block: usize) {
        let heights = scene.land.raster().heights();
        let columns = frame.columns;
        let count = self.rings.len();
        let (start, low) = (16 * block, self.low + 16 * block as i64);
        let inside = |minor: i64| frame.raw_minor(minor.clamp(0, frame.minors - 1)) as usize;
        let majors = [frame.major(self.rings[0].ring), frame.major(self.rings[count - 1].ring)];
        let first = majors[0].min(majors[1]) as usize;
        let mut raw = [[0.0f32; 16]; BATCH + 1];
        if frame.eastward {
            // Rows lie far apart in memory, where the processor does not foresee them: what the next batch will read is
            // asked for now.
            let ahead = if frame.forward { first + count + BATCH - 1 } else { first.saturating_sub(BATCH) };
            if count == BATCH + 1 {
                // The ring before the batch, and the others as a block.
                let (odd, block) = if frame.forward { (first, first + 1) } else { (first + BATCH, first) };
                let mut rows = [V::splat(0.0); 16];
                for (line, row) in rows.iter_mut().enumerate() {
                    let from = inside(low + line as i64) * columns;
                    let source = &heights[from + first..from + first + BATCH + 1];
                    V::prefetch(heights.as_ptr().wrapping_add(from + ahead));
                    raw[0][line] = source[odd - first];
                    // SAFETY: `source` holds seventeen numbers; the caller vouches for the instructions.
                    *row = unsafe { V::load(source.as_ptr().add(block - first)) };
                }
                for (k, row) in V::turn(rows).into_iter().enumerate() {
                    let k = if frame.forward { 1 + k } else { BATCH - k };
                    // SAFETY: there is room for sixteen numbers.
                    unsafe { row.store(raw[k].as_mut_ptr()) };
                }
            } else {
                for line in 0..16 {
                    let from = inside(low + line as i64) * columns + first;
                    for k in 0..count {
                        raw[if frame.forward { k } else { count - 1 - k }][line] = heights[from + k];
                    }
                }
            }
        } else {
            let whole = low >= 0 && low + 16 <= frame.minors;
            let lowest = inside(low).min(inside(low + 15));
            for (row, raw) in raw.iter_mut().enumerate().take(count) {
                let from = if frame.forward { first + row } else { first + count - 1 - row } * columns;
                if whole {
                    // What the next batch will read, as above.
                    let ahead = if frame.forward { from + BATCH * columns } else { from.wrapping_sub(BATCH * columns) };
                    V::prefetch(heights.as_ptr().wrapping_add(ahead.wrapping_add(lowest)));
                    raw.copy_from_slice(&heights[from + lowest..from + lowest + 16]);
                    if !frame.rising {
                        raw.reverse();
                    }
                } else {
                    for line in 0..16 {
                        raw[line] = heights[from + inside(low + line as i64)];
                    }
                }
            }
        }
        let eye = V::splat(scene.eye_height as f32);
        let factor = (scene.drop_per_square * frame.spacing_minor * frame.spacing_minor) as f32;
        let mut aside = [0.0f32; 16];
        for line in 0..16 {
            // Beyond the land the last sample's drop counts, so that the surface continues level.
            let away = ((low + line as i64).clamp(0, frame.minors - 1) as f64 - frame.eye_minor) as f32;
            aside[line] = factor * away * away;
        }
        let lonely = block == 0 || !self.filled[block - 1];
        let (mut reach, mut rough) = (V::splat(self.reach), V::splat(self.rough));
        // SAFETY: each row is a whole number of blocks long; what stands before a row's first number is not compared.
        unsafe {
            let aside = V::load(aside.as_ptr());
            for (row, ring) in self.rings.iter().enumerate() {
                let to = self.heights.as_mut_ptr().add(row * self.stride + start);
                let mut relative = V::load(raw[row].as_ptr());
                if scene.drop_per_square > 0.0 {
                    let along = ring.distance * frame.spacing_major;
                    let drop = V::splat((scene.drop_per_square * along * along) as f32).add(aside);
                    relative = relative.sub(drop);
                }
                relative = relative.sub(eye);
                relative.store(to);
                reach = reach.max(relative.abs());
                rough = rough.max(relative.sub(relative.previous()).abs());
                if !lonely {
                    // One number by itself: a vector across both blocks would wait for what was just written.
                    rough = rough.max(V::splat((*to - *to.sub(1)).abs()));
                }
            }
        }
        (self.reach, self.rough) = (reach.greatest(), rough.greatest());
        if !self.solid.is_empty() {
            self.mark_voids(scene.land.raster().voids(), frame, block);
        }
    }

    /// Lower bounds of the ground in a block, see [`Rings::solid`].
    fn mark_voids(&mut self, voids: &VoidMask, frame: &Frame, block: usize) {
        let (start, low) = (16 * block, self.low + 16 * block as i64);
        // Bit k of number n: whether ring k is void at the sample before, at or after n.
        let mut around = [0u32; 16];
        for line in -1..17 {
            let minor = low + line;
            let mut void = 0;
            if (0..frame.minors).contains(&minor) {
                for (row, ring) in self.rings.iter().enumerate() {
                    void |= u32::from(voids.is_void(frame.index(frame.major(ring.ring), minor))) << row;
                }
            }
            // A border between two missing patches is no ground.
            for near in (line - 1).max(0)..=(line + 1).min(15) {
                around[near as usize] |= void | void << 1;
            }
        }
        for row in 0..self.rings.len() {
            let from = row * self.stride + start;
            for (line, around) in around.iter().enumerate() {
                let void = around >> row & 1 == 1;
                self.solid[from + line] = if void { NOTHING } else { self.heights[from + line] };
            }
        }
    }
}
