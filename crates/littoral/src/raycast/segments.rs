//! Lines of sight in bulk: sixteen pieces of a segment at once against the range pyramid, coarse nodes first.
//!
//! A segment is cut into sixteen equal pieces, and one number bounds the ground under each: the highest point of the window
//! of nodes that begins at the piece's south-western corner, of the level at which a piece is one to two nodes long. Most
//! segments that see far are clear of all sixteen, and coarse windows stay in the nearest caches. Where pieces are not
//! clear, points under the *low* of a node are looked for: they lie under the surface, so that a segment which starts or
//! ends above it is blocked. That decides most of the others. Pieces still open are cut into sixteen again, and what that
//! leaves, a few in a hundred segments, is walked as any ray, from the first open piece to the last. Segments go through
//! these steps by the hundred, one step after the other, so that no step waits for what the one before it decides.

use super::bulk::{PART, RayCaster, Simd, dispatch};
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{Lanes, Portable};
use super::scene::Scene;
use super::stream::{BLOCK, LocalRay, Prepared, Rays, absolute, blend};
use crate::field::{FINEST_WINDOWS, RangePyramid};
use glam::Vec3;
use rayon::prelude::*;

impl RayCaster<'_> {
    /// Whether nothing lies between the two ends of each segment (m, counted from the anchor): the negation of
    /// [`RayCaster::any_hits`], and faster where many segments are long.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn lines_of_sight(&self, segments: &[[Vec3; 2]], visible: &mut [bool]) {
        assert_eq!(segments.len(), visible.len(), "expected as many answers as segments");
        let mut doubt = Doubt::default();
        let (mut rays, mut hits) = (Vec::new(), Vec::new());
        for (segments, visible) in segments.chunks(PART).zip(visible.chunks_mut(PART)) {
            doubt.open.clear();
            doubt.sheet.clear();
            match &self.scene {
                // Through a hole a ray may get under the surface without meeting it.
                Some(scene) if scene.voids.is_empty() => {
                    self.look(scene, segments, visible, &mut doubt);
                    let Doubt { open, sheet } = &mut doubt;
                    if !open.is_empty() {
                        let mut rest = Rest { segments, open, next: 0, visible, below: sheet };
                        dispatch::<_, false, true>(self.simd, scene, &mut rest);
                    }
                }
                _ => doubt.sheet.extend(0..segments.len() as i32),
            }
            let between = |&index: &i32| LocalRay::between(segments[index as usize][0], segments[index as usize][1]);
            rays.clear();
            rays.extend(doubt.sheet.iter().map(between));
            hits.resize(rays.len(), false);
            self.any_hits(&rays, &mut hits);
            for (&index, hit) in doubt.sheet.iter().zip(&hits) {
                visible[index as usize] = !hit;
            }
        }
    }

    /// [`RayCaster::lines_of_sight`] on all threads, with the same answers.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn par_lines_of_sight(&self, segments: &[[Vec3; 2]], visible: &mut [bool]) {
        assert_eq!(segments.len(), visible.len(), "expected as many answers as segments");
        let parts = segments.par_chunks(PART).zip(visible.par_chunks_mut(PART));
        parts.for_each(|(segments, visible)| self.lines_of_sight(segments, visible));
    }

    /// Decides the segments that looks decide, and lists the others.
    fn look(&self, scene: &Scene, segments: &[[Vec3; 2]], visible: &mut [bool], doubt: &mut Doubt) {
        let Some(tops) = Tops::new(self.land.ranges(), scene) else {
            visible.fill(true);
            doubt.open.extend((0..segments.len() as i32).map(|index| Open { index, from: 0.0, to: 1.0, level: FAR }));
            return;
        };
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx512f,avx512dq,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
            fn avx512(scene: &Scene, tops: &Tops, segments: &[[Vec3; 2]], visible: &mut [bool], doubt: &mut Doubt) {
                // SAFETY: this function is compiled for it and only called where it is available.
                looks(unsafe { Avx512::new() }, scene, tops, segments, visible, doubt);
            }
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
            fn avx2(scene: &Scene, tops: &Tops, segments: &[[Vec3; 2]], visible: &mut [bool], doubt: &mut Doubt) {
                // SAFETY: as above.
                looks(unsafe { Avx2::new() }, scene, tops, segments, visible, doubt);
            }
            match self.simd {
                // SAFETY: `RayCaster` holds only instructions that are available.
                Simd::Avx512 => return unsafe { avx512(scene, &tops, segments, visible, doubt) },
                // SAFETY: as above.
                Simd::Avx2 => return unsafe { avx2(scene, &tops, segments, visible, doubt) },
                Simd::Portable => {}
            }
        }
        looks(Portable, scene, &tops, segments, visible, doubt);
    }
}

/// Levels at which walks begin, by how long they may be.
const FAR: i32 = 5;
const NEAR: i32 = 2;

/// What looks leave open.
#[derive(Default)]
struct Doubt {
    /// Open parts of segments.
    open: Vec<Open>,
    /// Segments to be walked by the sheet.
    sheet: Vec<i32>,
}

/// An open part of a segment, from fraction to fraction: the rest of it is clear, or another part. Above the surface at
/// its begin, unless the segment begins there. Then the level to begin with.
#[derive(Clone, Copy, Debug)]
struct Open {
    index: i32,
    from: f32,
    to: f32,
    level: i32,
}

/// The open segments as rays over the surface.
struct Rest<'a> {
    segments: &'a [[Vec3; 2]],
    open: &'a [Open],
    next: usize,
    visible: &'a mut [bool],
    below: &'a mut Vec<i32>,
}

impl Rays for Rest<'_> {
    const REFILL: u32 = 12;
    const RISE: i32 = 1;
    const FOOTPRINT: bool = false;

    #[inline(always)]
    fn next<L: Lanes>(&mut self, l: L, scene: &Scene, block: &mut Prepared) {
        block.count = (self.open.len() - self.next).min(BLOCK);
        for at in (0..block.count).step_by(L::COUNT) {
            let (mut id, mut level, mut numbers) = ([0; 16], [0; 16], [[0.0; 16]; 8]);
            for lane in 0..L::COUNT {
                // The last vector repeats the last ray.
                let open = self.open[self.next + (at + lane).min(block.count - 1)];
                let [from, to] = self.segments[open.index as usize];
                (id[lane], level[lane]) = (open.index, open.level.min(scene.top));
                let by = to - from;
                let from = [from.x, from.y, from.z, by.x, by.y, by.z, open.from, open.to];
                for (number, from) in numbers.iter_mut().zip(from) {
                    number[lane] = from;
                }
            }
            let origin = [l.load(&numbers[0]), l.load(&numbers[1]), l.load(&numbers[2])];
            let direction = [l.load(&numbers[3]), l.load(&numbers[4]), l.load(&numbers[5])];
            let (from, to) = (l.load(&numbers[6]), l.load(&numbers[7]));
            block.set(l, scene, at, l.load_int(&id), origin, direction, to, from, l.load_int(&level));
        }
        self.next += block.count;
    }

    #[inline(always)]
    fn done(&mut self, id: i32, distance: f32) {
        self.visible[id as usize] &= distance == f32::INFINITY;
    }

    #[inline(always)]
    fn below(&mut self, id: i32) {
        self.below.push(id);
    }
}

/// The windows of all levels, see [`crate::field`].
struct Tops<'a> {
    highs: &'a [u16],
    /// The coarsest level, and whether it is a single node.
    top: i32,
    single: bool,
    /// For each level where it begins and its last column and row.
    offsets: [i32; 16],
    last_columns: [i32; 16],
    last_rows: [i32; 16],
    /// Steps a metre, and the height of step 0 (m).
    per_step: f32,
    base: f32,
}

impl<'a> Tops<'a> {
    /// `None` on lands too small for windows.
    fn new(pyramid: &'a RangePyramid, scene: &Scene) -> Option<Tops<'a>> {
        let windows = &pyramid.windows;
        let mut tops = Tops {
            highs: &windows.highs,
            top: 0,
            single: false,
            offsets: [0; 16],
            last_columns: [0; 16],
            last_rows: [0; 16],
            per_step: 1.0 / scene.step,
            base: scene.high_base,
        };
        for (n, level) in (FINEST_WINDOWS..16).zip(&windows.levels) {
            tops.top = n as i32;
            tops.single = level.columns * level.rows == 1;
            tops.offsets[n] = level.offset as i32;
            (tops.last_columns[n], tops.last_rows[n]) = (level.columns as i32 - 1, level.rows as i32 - 1);
        }
        (tops.top > 0).then_some(tops)
    }
}

/// Segments that are looked at together.
const GROUP: usize = 128;
/// Room behind them, so that a whole vector can be written anywhere.
const ROOM: usize = GROUP + 16;

/// The numbers of the pieces.
const PIECES: [f32; 16] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// Segments, as arrays: samples from the anchor's cell and metres.
struct Group {
    from: [[f32; ROOM]; 3],
    by: [[f32; ROOM]; 3],
    /// Sixteenths and their sixteenths.
    coarse: Cut,
    fine: Cut,
}

/// Pieces of equal length: what begins the first, and what leads from each to the next.
struct Cut {
    /// South-western corner (nodes) and lowest height (steps) of each piece, and what is more than rounding can come to.
    corner: [[f32; ROOM]; 3],
    step: [[f32; ROOM]; 3],
    /// The last column and row of the level, and where it begins.
    last: [[f32; ROOM]; 2],
    columns: [i32; ROOM],
    offset: [i32; ROOM],
}

impl Cut {
    fn new() -> Cut {
        Cut {
            corner: [[0.0; ROOM]; 3],
            step: [[0.0; ROOM]; 3],
            last: [[0.0; ROOM]; 2],
            columns: [0; ROOM],
            offset: [0; ROOM],
        }
    }

    /// Cuts segments into pieces of `width`, a power of two. `from` and `by` in samples of the raster and metres; `slack` is more than
    /// rounding can come to, in both.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the numbers of a segment, each once")]
    fn set<L: Lanes>(
        &mut self,
        l: L,
        tops: &Tops,
        at: usize,
        from: [L::F; 3],
        by: [L::F; 3],
        slack: (L::F, L::F),
        width: f32,
    ) {
        let (zero, wide) = (l.splat(0.0), l.splat(width));
        let step = by.map(
            #[inline(always)]
            |by| l.mul(by, wide),
        );
        let reach = l.add(l.max(absolute(l, step[0]), absolute(l, step[1])), l.add(slack.0, slack.0));
        // Twice as long as a node of the level is longer than the reach.
        let wanted = l.isub(l.shr(l.to_bits(reach), l.int(23)), l.int(127));
        let level = l.imin(l.imax(wanted, l.int(FINEST_WINDOWS as i32)), l.int(tops.top));
        let scale = l.flip(zero, l.shl(l.isub(l.int(127), level), l.int(23)));
        for axis in 0..2 {
            let corner = l.sub(l.add(from[axis], l.min(step[axis], zero)), slack.0);
            l.store(l.mul(corner, scale), &mut self.corner[axis][at..]);
            l.store(l.mul(step[axis], scale), &mut self.step[axis][at..]);
        }
        let (column, row) = (l.lookup(&tops.last_columns, level), l.lookup(&tops.last_rows, level));
        l.store(l.float(column), &mut self.last[0][at..]);
        l.store(l.float(row), &mut self.last[1][at..]);
        l.store_int(l.iadd(column, l.int(1)), &mut self.columns[at..]);
        l.store_int(l.lookup(&tops.offsets, level), &mut self.offset[at..]);
        let per_step = l.splat(tops.per_step);
        let height = l.sub(l.sub(from[2], l.splat(tops.base)), slack.1);
        let lowest = l.mul(l.add(height, l.min(step[2], zero)), per_step);
        // Pieces longer than the coarsest window are clear of nothing, unless that is the whole map.
        let short = if tops.single { l.int(i32::MAX) } else { l.int(tops.top) };
        let lowest = l.select(l.igt(wanted, short), l.splat(f32::NEG_INFINITY), lowest);
        l.store(lowest, &mut self.corner[2][at..]);
        l.store(l.mul(step[2], per_step), &mut self.step[2][at..]);
    }

    /// Which of sixteen pieces of a segment, from the `first` on, are not surely above the ground; lowest bit first.
    #[inline(always)]
    fn open<L: Lanes>(&self, l: L, tops: &Tops, segment: usize, first: f32) -> u32 {
        let i = segment;
        let zero = l.splat(0.0);
        let mut clear = 0;
        for at in (0..16).step_by(L::COUNT) {
            let k = l.add(l.load(&PIECES[at..]), l.splat(first));
            let x = l.add(l.mul(k, l.splat(self.step[0][i])), l.splat(self.corner[0][i]));
            let y = l.add(l.mul(k, l.splat(self.step[1][i])), l.splat(self.corner[1][i]));
            let z = l.add(l.mul(k, l.splat(self.step[2][i])), l.splat(self.corner[2][i]));
            let column = l.floor(l.min(l.max(x, zero), l.splat(self.last[0][i])));
            let row = l.floor(l.min(l.max(y, zero), l.splat(self.last[1][i])));
            let window = l.iadd(l.iadd(l.imul(row, l.int(self.columns[i])), column), l.int(self.offset[i]));
            // SAFETY: clamped to the windows of the level; the array ends with one number of padding.
            let high = unsafe { l.gather_u16(l.mask(u32::MAX), tops.highs, window) };
            clear |= l.bits(l.lt(l.float(high), z)) << at;
        }
        !clear & 0xFFFF
    }
}

/// The looks at lows: level of the nodes, and where in the sixteenths of what is open the points lie.
const LOOKS: [(i32, f32); 2] = [(4, 0.5), (3, 0.0)];
/// How many open pieces are cut again at most.
const MOST_OPEN: u32 = 8;

#[inline(always)]
fn looks<L: Lanes>(l: L, scene: &Scene, tops: &Tops, segments: &[[Vec3; 2]], visible: &mut [bool], doubt: &mut Doubt) {
    let zeros = [[0.0; ROOM]; 3];
    let mut group = Group { from: zeros, by: zeros, coarse: Cut::new(), fine: Cut::new() };
    let (mut masks, mut doubtful) = ([0u32; GROUP], [0u32; GROUP]);
    let mut fine = [0u32; GROUP];
    // What is yet to be decided, what has open pieces to be looked at for lows, what is blocked if it starts above the surface.
    let (mut list, mut under, mut candidates) = ([0u16; ROOM], [0u16; ROOM], [0u16; ROOM]);
    let mut mostly_blocked = false;
    for (base, (segments, visible)) in
        segments.chunks(GROUP).zip(visible.chunks_mut(GROUP)).enumerate().map(|(n, both)| (n * GROUP, both))
    {
        let index = |i: u16| (base + i as usize) as i32;
        let (mut count, mut blocked) = (0, 0);
        for at in (0..segments.len()).step_by(L::COUNT) {
            let (finite, inside) = group.set(l, scene, tops, segments, at);
            for i in at..(at + L::COUNT).min(segments.len()) {
                if finite >> (i - at) & 1 == 0 {
                    doubt.sheet.push(index(i as u16));
                    continue;
                }
                if mostly_blocked && group.lies_under(l, scene, i, LOOKS[0].0, 1.0 / 32.0, 1.0 / 16.0) {
                    visible[i] = false;
                    candidates[blocked] = i as u16;
                    blocked += 1;
                    continue;
                }
                let open = group.coarse.open(l, tops, i, 0.0);
                masks[i] = open;
                // If its first piece is clear, it starts above the surface, or beside the map.
                doubtful[i] = open & 1 | !(inside >> (i - at)) & 1;
                visible[i] = true;
                list[count] = i as u16;
                count += (open != 0) as usize;
            }
        }
        for (level, shift) in LOOKS {
            let mut left = 0;
            for n in 0..count {
                let i = list[n];
                let open = masks[i as usize];
                let (from, to) = (open.trailing_zeros() as f32 / 16.0, (32 - open.leading_zeros()) as f32 / 16.0);
                let pitch = (to - from) / 16.0;
                let found = group.lies_under(l, scene, i as usize, level, from + shift * pitch, pitch);
                visible[i as usize] = !found;
                candidates[blocked] = i;
                list[left] = i;
                blocked += (found & (doubtful[i as usize] != 0)) as usize;
                left += !found as usize;
            }
            count = left;
        }
        // Where most are blocked, the next ones are looked at for that first. It changes nothing but the time.
        mostly_blocked = 4 * visible.iter().filter(|visible| !**visible).count() > 3 * segments.len();
        let mut left = 0;
        for n in 0..count {
            let i = list[n];
            let open = masks[i as usize];
            list[left] = i;
            left += (open.count_ones() <= MOST_OPEN) as usize;
            if open.count_ones() > MOST_OPEN {
                let (from, to) = (open.trailing_zeros() as f32 / 16.0, (32 - open.leading_zeros()) as f32 / 16.0);
                let pitch = (to - from) / 16.0;
                let found = group.lies_under(l, scene, i as usize, 2, from + 0.25 * pitch, pitch)
                    || group.lies_under(l, scene, i as usize, 2, from + 0.75 * pitch, pitch);
                visible[i as usize] = !found;
                candidates[blocked] = i;
                blocked += (found & (doubtful[i as usize] != 0)) as usize;
                if found {
                    continue;
                }
                doubt.open.push(Open { index: index(i), from, to, level: FAR });
            }
        }
        count = left;
        // One open piece of each segment after the other.
        while count > 0 {
            let (mut left, mut unders) = (0, 0);
            for &i in &list[..count] {
                let i = i as usize;
                fine[i] = group.fine.open(l, tops, i, 16.0 * masks[i].trailing_zeros() as f32);
                under[unders] = i as u16;
                unders += (fine[i] != 0) as usize;
            }
            for i in &under[..unders] {
                let i = *i as usize;
                let piece = masks[i].trailing_zeros() as f32 / 16.0;
                if group.lies_under(l, scene, i, 3, piece + 1.0 / 512.0, 1.0 / 256.0) {
                    masks[i] = 0;
                    visible[i] = false;
                    candidates[blocked] = i as u16;
                    blocked += doubtful[i] as usize;
                } else {
                    let from = piece + fine[i].trailing_zeros() as f32 / 256.0;
                    let to = piece + (32 - fine[i].leading_zeros()) as f32 / 256.0;
                    doubt.open.push(Open { index: index(i as u16), from, to, level: NEAR });
                }
            }
            for n in 0..count {
                let i = list[n] as usize;
                masks[i] &= masks[i].wrapping_sub(1);
                list[left] = i as u16;
                left += (masks[i] != 0) as usize;
            }
            count = left;
        }
        // These are surely blocked if they start above the surface, or end there. Their heights come last and together,
        // since each is far from the others in memory.
        for end in 0..2 {
            let mut left = 0;
            for at in (0..blocked).step_by(L::COUNT) {
                let mut place = [[0.0; 16]; 3];
                for lane in 0..L::COUNT {
                    let i = candidates[(at + lane).min(blocked - 1)] as usize;
                    for (axis, place) in place.iter_mut().enumerate() {
                        place[lane] = group.from[axis][i] + if end == 1 { group.by[axis][i] } else { 0.0 };
                    }
                }
                let above = l.bits(is_above(l, scene, l.load(&place[0]), l.load(&place[1]), l.load(&place[2])));
                for lane in 0..L::COUNT.min(blocked - at) {
                    candidates[left] = candidates[at + lane];
                    left += (above >> lane & 1 == 0) as usize;
                }
            }
            blocked = left;
        }
        doubt.sheet.extend(candidates[..blocked].iter().map(|&i| index(i)));
    }
}

impl Group {
    /// Takes over a vector of segments, the last one repeated behind the end. Returns which of them are
    /// finite, and which surely start over the map.
    #[inline(always)]
    fn set<L: Lanes>(&mut self, l: L, scene: &Scene, tops: &Tops, segments: &[[Vec3; 2]], at: usize) -> (u32, u32) {
        let mut ends = [[0.0; 16]; 6];
        for lane in 0..L::COUNT {
            let [from, to] = segments[(at + lane).min(segments.len() - 1)];
            for (numbers, number) in ends.iter_mut().zip([from.x, from.y, from.z, to.x, to.y, to.z]) {
                numbers[lane] = number;
            }
        }
        let scale = [scene.per_metre.x, scene.per_metre.y, 1.0];
        let offset = [scene.offset.x, scene.offset.y, scene.height];
        let (mut from, mut by) = ([l.splat(0.0); 3], [l.splat(0.0); 3]);
        for axis in 0..3 {
            let (a, b) = (l.load(&ends[axis]), l.load(&ends[axis + 3]));
            by[axis] = l.mul(l.sub(b, a), l.splat(scale[axis]));
            from[axis] = l.add(l.mul(a, l.splat(scale[axis])), l.splat(offset[axis]));
            l.store(by[axis], &mut self.by[axis][at..]);
            l.store(from[axis], &mut self.from[axis][at..]);
        }
        // Ten times what single precision rounds off.
        let cell = (scene.cell[0].abs() + scene.cell[1].abs()) as f32;
        let size =
            l.add(l.add(absolute(l, from[0]), absolute(l, by[0])), l.add(absolute(l, from[1]), absolute(l, by[1])));
        let slack = l.mul(l.add(size, l.splat(cell)), l.splat(1e-6));
        let size = l.add(l.add(absolute(l, from[2]), absolute(l, by[2])), l.splat(tops.base.abs()));
        let slack = (slack, l.mul(size, l.splat(1e-6)));
        let mut inside = l.lt(l.add(slack.0, slack.1), l.splat(f32::INFINITY));
        let finite = l.bits(inside);
        for (axis, from) in from.iter_mut().enumerate().take(2) {
            *from = l.add(*from, l.splat(scene.cell[axis] as f32));
            inside = l.and(inside, l.lt(slack.0, *from));
            inside = l.and(inside, l.lt(l.add(*from, slack.0), l.splat(scene.cells[axis] as f32)));
        }
        self.coarse.set(l, tops, at, from, by, slack, 1.0 / 16.0);
        self.fine.set(l, tops, at, from, by, slack, 1.0 / 256.0);
        (finite, l.bits(inside))
    }

    /// Whether any of sixteen points of a segment lies under the low of its node.
    #[inline(always)]
    fn lies_under<L: Lanes>(&self, l: L, scene: &Scene, segment: usize, level: i32, first: f32, step: f32) -> bool {
        let i = segment;
        let level = level.min(scene.top);
        let (offset, stride) = (scene.offsets[level as usize], scene.strides[level as usize]);
        let mut any = 0;
        for at in (0..16).step_by(L::COUNT) {
            let t = l.add(l.splat(first), l.mul(l.load(&PIECES[at..]), l.splat(step)));
            let x = l.add(l.splat(self.from[0][i]), l.mul(l.splat(self.by[0][i]), t));
            let y = l.add(l.splat(self.from[1][i]), l.mul(l.splat(self.by[1][i]), t));
            let z = l.add(l.splat(self.from[2][i]), l.mul(l.splat(self.by[2][i]), t));
            let (column, row) = (l.iadd(l.floor(x), l.int(scene.cell[0])), l.iadd(l.floor(y), l.int(scene.cell[1])));
            let inner_column = l.imax(l.imin(column, l.int(scene.cells[0] - 1)), l.int(0));
            let inner_row = l.imax(l.imin(row, l.int(scene.cells[1] - 1)), l.int(0));
            let inside = l.and(l.ieq(column, inner_column), l.ieq(row, inner_row));
            let line = l.imul(l.shr(inner_row, l.int(level)), l.int(stride));
            let node = l.iadd(l.iadd(line, l.shr(inner_column, l.int(level))), l.int(offset));
            // SAFETY: the cell was clamped to the raster's.
            let low = l.float(unsafe { l.gather_u16(inside, scene.lows, node) });
            let low = l.add(l.mul(low, l.splat(scene.step)), l.splat(scene.low_base));
            any |= l.bits(l.and(inside, l.lt(z, low)));
        }
        any != 0
    }
}

/// Whether points of the lattice lie over the surface (not merely beside the map).
#[inline(always)]
fn is_above<L: Lanes>(l: L, scene: &Scene, x: L::F, y: L::F, z: L::F) -> L::M {
    let (column, row) = (l.floor(x), l.floor(y));
    let (i, j) = (l.iadd(column, l.int(scene.cell[0])), l.iadd(row, l.int(scene.cell[1])));
    let (inner_i, inner_j) = (
        l.imax(l.imin(i, l.int(scene.cells[0] - 1)), l.int(0)),
        l.imax(l.imin(j, l.int(scene.cells[1] - 1)), l.int(0)),
    );
    let inside = l.and(l.ieq(i, inner_i), l.ieq(j, inner_j));
    let at = l.iadd(l.imul(inner_j, l.int(scene.columns)), inner_i);
    // SAFETY: the patch was clamped to the raster's; it has samples east, north and north-east.
    let ((a, b), (c, d)) = unsafe {
        (
            l.gather_pair(inside, scene.heights, at),
            l.gather_pair(inside, scene.heights, l.iadd(at, l.int(scene.columns))),
        )
    };
    let height = blend(l, [a, b, c, d], l.sub(x, l.float(column)), l.sub(y, l.float(row)));
    l.and(inside, l.lt(height, z))
}
