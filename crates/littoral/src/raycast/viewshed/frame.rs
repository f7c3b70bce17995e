//! A quarter of the land as its observer sees it, and the rings of samples it is swept in.

use super::Scene;
use super::lanes::Lanes;

/// Height (m) that stands for "no ground here" in lower bounds: low enough to hide nothing, small enough not to overflow.
pub(super) const NOTHING: f32 = -1e30;

/// How many rings are swept at a time: a cache line of the raster's rows when they are crossed.
pub(super) const BATCH: usize = 16;

/// A quarter of the land: east or west of the observer (`eastward`: rings are columns), or north or south (rings are
/// rows). *Major* counts rings, *minor* the samples along one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub eastward: bool,
    pub forward: bool,
    pub eye_major: f64,
    pub eye_minor: f64,
    pub majors: i64,
    pub minors: i64,
    pub spacing_major: f64,
    pub spacing_minor: f64,
    /// How many rings there are, within the land and the radius asked for.
    pub rings: i64,
    columns: usize,
}

impl Frame {
    pub fn new(scene: &Scene, eastward: bool, forward: bool) -> Frame {
        let raster = scene.land.raster();
        let (columns, rows) = (raster.columns() as i64, raster.rows() as i64);
        let (eye, spacing) = (scene.eye, raster.spacing());
        let (eye_major, eye_minor, majors, minors, spacing_major, spacing_minor) = if eastward {
            (eye.x, eye.y, columns, rows, spacing.x, spacing.y)
        } else {
            (eye.y, eye.x, rows, columns, spacing.y, spacing.x)
        };
        let all = if forward { majors - 1 - eye_major.floor() as i64 } else { eye_major.ceil() as i64 };
        let rings = all.min((scene.radius / spacing_major).ceil().min(1e9) as i64 + 1).max(0);
        Frame {
            eastward,
            forward,
            eye_major,
            eye_minor,
            majors,
            minors,
            spacing_major,
            spacing_minor,
            rings,
            columns: columns as usize,
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

    /// Row-major index of a sample.
    pub fn index(&self, major: i64, minor: i64) -> usize {
        if self.eastward {
            minor as usize * self.columns + major as usize
        } else {
            major as usize * self.columns + minor as usize
        }
    }

    /// Index steps from one sample of a ring to the next.
    pub fn step(&self) -> usize {
        if self.eastward { self.columns } else { 1 }
    }

    /// The samples of a ring that belong to this quarter, as a half-open range: diagonals belong to east and west.
    pub fn belonging(&self, ring: i64) -> std::ops::Range<i64> {
        let distance = self.distance(ring);
        let belongs = |minor: i64| {
            let aside = (minor as f64 - self.eye_minor).abs();
            if self.eastward { aside <= distance } else { aside < distance }
        };
        let (mut low, mut high) =
            ((self.eye_minor - distance).ceil() as i64 - 1, (self.eye_minor + distance).floor() as i64 + 1);
        while low < high && !belongs(low) {
            low += 1;
        }
        while high >= low && !belongs(high) {
            high -= 1;
        }
        low.max(0)..(high + 1).min(self.minors)
    }
}

/// What the vector kernel needs to know about a ring.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ring {
    pub ring: i64,
    pub major: i64,
    /// Distance from the eye, in samples.
    pub distance: f64,
    pub belonging: (i64, i64),
}

/// A batch of rings: heights relative to the eye (m), less the drop of a curved Earth, each ring a row padded on both
/// sides by its outermost samples. Row 0 is the ring before the batch.
#[derive(Default)]
pub(super) struct Rings {
    pub rings: Vec<Ring>,
    /// Minor coordinate of the first number of a row.
    pub low: i64,
    pub stride: usize,
    pub heights: Vec<f32>,
    /// The same for lower bounds of the ground: [`NOTHING`] at and beside samples that are void on the same or the
    /// previous ring.
    /// Empty when the land has no voids.
    pub solid: Vec<f32>,
    /// Greatest height difference to the eye so far (m), and between neighbours along a ring.
    pub reach: f32,
    pub rough: f32,
}

impl Rings {
    /// Fetches the rings from `first` on for directions between `t0` and `t1` (minor over major); false when they lie
    /// outside the land.
    ///
    /// # Safety
    /// The processor must have the instructions of `V`.
    #[inline(always)]
    pub unsafe fn fetch<V: Lanes>(&mut self, scene: &Scene, frame: &Frame, first: i64, t0: f64, t1: f64) -> bool {
        let count = (frame.rings - first + 1).clamp(0, BATCH as i64);
        self.rings.clear();
        self.rings.extend((0..=count).map(|k| {
            let ring = first - 1 + k;
            // Only wedges at a diagonal have to share its samples out.
            let belonging = if t0 > -1.0 && t1 < 1.0 { 0..frame.minors } else { frame.belonging(ring) };
            let (major, distance) = (frame.major(ring), frame.distance(ring));
            Ring { ring, major, distance, belonging: (belonging.start, belonging.end) }
        }));
        let (near, far) = (frame.distance(first - 1), frame.distance(first - 1 + count));
        let low = (frame.eye_minor + (t0 * near).min(t0 * far)).floor() as i64 - 3;
        let high = (frame.eye_minor + (t1 * near).max(t1 * far)).floor() as i64 + 24;
        let (inside_low, inside_high) = (low.max(0), high.min(frame.minors - 1));
        if inside_low > inside_high || count == 0 {
            return false;
        }
        // Directions that have left the land need no room: nobody asks there.
        let (low, high) = (low.max(-24), high.min(frame.minors + 24));
        self.low = low;
        self.stride = (high - low + 1) as usize;
        self.stride = self.stride.next_multiple_of(16) + 16;
        let rows = count as usize + 1;
        self.heights.resize(rows * self.stride, 0.0);
        self.gather::<V>(scene, frame, inside_low, inside_high);
        for row in 0..rows {
            // SAFETY: the caller vouches for the instructions.
            unsafe { self.relate::<V>(scene, frame, row, inside_low, inside_high) };
        }
        if scene.land.raster().voids().any() {
            self.mark_voids(scene, frame, inside_low, inside_high);
        }
        true
    }

    /// Copies raw heights: rows as they are, columns turned.
    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    fn gather<V: Lanes>(&mut self, scene: &Scene, frame: &Frame, inside_low: i64, inside_high: i64) {
        let heights = scene.land.raster().heights();
        let columns = scene.land.raster().columns();
        let offset = (inside_low - self.low) as usize;
        let length = (inside_high - inside_low + 1) as usize;
        if !frame.eastward {
            for (row, ring) in self.rings.iter().enumerate() {
                let from = ring.major as usize * columns + inside_low as usize;
                let to = row * self.stride + offset;
                self.heights[to..to + length].copy_from_slice(&heights[from..from + length]);
            }
            return;
        }
        let count = self.rings.len();
        let first = self.rings[0].major.min(self.rings[count - 1].major) as usize;
        // Rows lie far apart in memory, where the processor does not foresee them: what the next batch will read is
        // asked for now.
        let ahead = if frame.forward { first + count + BATCH - 1 } else { first.saturating_sub(BATCH) };
        // Blocks of 16 rows: every cache line read is used whole, every line written is filled at once.
        let mut block = [[0.0f32; 16]; BATCH + 1];
        for start in (0..length).step_by(16) {
            let lines = (length - start).min(16);
            for line in 0..lines {
                let from = (inside_low as usize + start + line) * columns + first;
                let source = &heights[from..from + count];
                V::prefetch(heights.as_ptr().wrapping_add(from - first + ahead));
                if let Ok(source) = <&[f32; BATCH + 1]>::try_from(source) {
                    for k in 0..=BATCH {
                        block[k][line] = source[k];
                    }
                } else {
                    for (k, &height) in source.iter().enumerate() {
                        block[k][line] = height;
                    }
                }
            }
            for (row, ring) in self.rings.iter().enumerate() {
                let line = &block[ring.major as usize - first];
                let to = row * self.stride + offset + start;
                if lines == 16 {
                    self.heights[to..to + 16].copy_from_slice(line);
                } else {
                    self.heights[to..to + lines].copy_from_slice(&line[..lines]);
                }
            }
        }
    }

    /// Makes the heights of a row relative to the eye, pads it, and notes its extremes.
    #[inline(always)]
    unsafe fn relate<V: Lanes>(&mut self, scene: &Scene, frame: &Frame, row: usize, inside_low: i64, inside_high: i64) {
        let stride = self.stride;
        let low = self.low;
        let line = &mut self.heights[row * stride..(row + 1) * stride];
        let (from, to) = ((inside_low - low) as usize, (inside_high - low) as usize);
        let (first, last) = (line[from], line[to]);
        line[..from].fill(first);
        line[to + 1..].fill(last);
        let along = self.rings[row].distance * frame.spacing_major;
        let eye = V::splat(scene.eye_height as f32);
        if scene.drop_per_square > 0.0 {
            let constant = (scene.drop_per_square * along * along) as f32;
            let factor = (scene.drop_per_square * frame.spacing_minor * frame.spacing_minor) as f32;
            for (k, height) in line.iter_mut().enumerate() {
                // The padding sinks like its neighbour, so that it stays the surface's constant continuation.
                let minor = (low + k as i64).clamp(inside_low, inside_high);
                let aside = (minor as f64 - frame.eye_minor) as f32;
                *height -= constant + factor * aside * aside;
            }
        }
        let (mut reach, mut rough) = (V::splat(self.reach), V::splat(self.rough));
        let line = line.as_mut_ptr();
        // SAFETY: rows are a multiple of 16 long, with 16 more after the last that is compared with its neighbour.
        unsafe {
            for k in (0..stride).step_by(16) {
                let relative = V::load(line.add(k)).sub(eye);
                relative.store(line.add(k));
                reach = reach.max(relative.abs());
            }
            for k in (0..stride - 16).step_by(16) {
                let step = V::load(line.add(k + 1)).sub(V::load(line.add(k)));
                rough = rough.max(step.abs());
            }
            self.reach = reach.greatest();
            self.rough = rough.greatest();
        }
    }

    /// Lower bounds of the ground, see [`Rings::solid`].
    fn mark_voids(&mut self, scene: &Scene, frame: &Frame, inside_low: i64, inside_high: i64) {
        let voids = scene.land.raster().voids();
        self.solid.clear();
        self.solid.extend_from_slice(&self.heights);
        for (row, ring) in self.rings.iter().enumerate() {
            for minor in inside_low..=inside_high {
                if voids.is_void(frame.index(ring.major, minor)) {
                    // Its neighbours too: a border between two missing patches is no ground.
                    let at = (minor - self.low) as usize;
                    let around = at.saturating_sub(1)..at + 2;
                    for row in row..(row + 2).min(self.rings.len()) {
                        self.solid[row * self.stride..][around.clone()].fill(NOTHING);
                    }
                }
            }
            // The ring before the first row is not at hand: its voids were marked when it was in the batch, and row 0
            // serves only as the near side of a strip.
        }
    }
}
