//! Priorities of many diamonds at once.
//!
//! Those that may be split or merged lie in plain arrays, one number each, and all are measured anew for every view: sixteen bytes of reading
//! in a row cost less than any queue that would know which of them to skip. The formula is that of
//! [`ScreenMetric`] for boxes in lattice coordinates, so that far from the origin nothing is lost. Each of its steps is monotone
//! under rounding, too: a box within another never gets the larger number, not by a bit.

use super::super::ScreenMetric;
use super::bounds::prefetch;
use super::factors::{Factors, Slopes, Weights};
use super::ground::Ground;
use crate::space::{Datum, View};
use glam::DVec3;
use multiversion::multiversion;

/// How the detail of a drawing is distributed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Priority {
    /// What is drawn farthest from its place comes first (pixels).
    #[default]
    ScreenError,
    /// What is nearest comes first, whatever its shape (1/m): the sea of 1999. Only the limits end it.
    InverseDistance,
}

impl Priority {
    /// What priority refinement ends at.
    pub(super) fn tolerance(self, metric: &ScreenMetric) -> f32 {
        match self {
            Priority::ScreenError => metric.tolerance(),
            Priority::InverseDistance => 0.0,
        }
    }
}

/// A view, in the coordinates of the lists.
#[derive(Clone, Debug)]
pub(super) struct Lens {
    /// The eye's place, in whole steps, and what is left of it (m).
    eye: [i32; 2],
    rest: [f32; 2],
    height: f32,
    /// Height of step 0 and of one step (m).
    pub(super) base: f32,
    pub(super) step: f32,
    /// Metres a step.
    scale: [f32; 2],
    forward: [f32; 3],
    sides: [[f32; 3]; 4],
    focal: f32,
    stretch: f32,
    pub(super) priority: Priority,
    /// Whether anything may be void.
    voids: bool,
    pub(super) weights: Option<Weights>,
}

impl Lens {
    /// The lens of a view of a face cut into `steps` steps a side.
    pub(super) fn new(
        metric: &ScreenMetric,
        datum: Datum,
        steps: f64,
        heights: (f32, f32),
        priority: Priority,
        voids: bool,
        factors: &Factors,
    ) -> Lens {
        let (forward, sides, focal, stretch) = metric.lens();
        let (origin, size) = match datum {
            Datum::Plane { origin, size } => (origin, size),
            Datum::Ellipsoid { .. } => (glam::DVec2::ZERO, glam::DVec2::ONE),
        };
        let eye: DVec3 = metric.eye();
        let at = (eye.truncate() - origin) / size * steps;
        let whole = at.floor().clamp(glam::DVec2::splat(-1e9), glam::DVec2::splat(1e9));
        let rest = (at - whole) / steps * size;
        Lens {
            eye: [whole.x as i32, whole.y as i32],
            rest: rest.as_vec2().to_array(),
            height: eye.z as f32,
            base: heights.0,
            step: heights.1,
            scale: (size / steps).as_vec2().to_array(),
            forward: forward.to_array(),
            sides: sides.map(|side| side.to_array()),
            focal,
            stretch,
            priority,
            voids,
            weights: Weights::new(factors, eye.truncate()),
        }
    }

    /// The box round all that needs a diamond.
    pub(super) fn extent(&self, item: &Item) -> Extent {
        extent(self, item.at, item.heights, item.word)
    }

    /// The priorities of four, where neither factors nor voids have a say.
    #[inline]
    pub(super) fn priorities(&self, items: &[Item; 4]) -> Option<[f32; 4]> {
        let plain = self.priority == Priority::ScreenError && !self.voids && self.weights.is_none();
        plain.then(|| four_errors(self, items))
    }

    /// The priority of one.
    pub(super) fn priority(&self, item: &Item, slopes: Option<Slopes>) -> f32 {
        let Item { at, heights, deviation, word } = *item;
        let number = match self.priority {
            Priority::ScreenError => priority::<true, true>(self, at, heights, deviation, word),
            Priority::InverseDistance => priority::<false, true>(self, at, heights, deviation, word),
        };
        match &self.weights {
            Some(weights) if number > 0.0 => number * weights.of(&self.extent(item), slopes.unwrap_or(Slopes::EMPTY)),
            _ => number,
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn four_errors(lens: &Lens, items: &[Item; 4]) -> [f32; 4] {
    let mut out = [0.0; 4];
    for (out, &Item { at, heights, deviation, word }) in out.iter_mut().zip(items) {
        *out = priority::<true, false>(lens, at, heights, deviation, word);
    }
    out
}

/// What the priority of a diamond is computed from, and who it is: sixteen bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
pub(super) struct Item {
    /// Its middle (steps), x in the lower half.
    pub at: u32,
    /// Lowest and highest height within (steps of height), the lowest in the lower half.
    pub heights: u32,
    /// Greatest vertical distance to the surface (m); infinite where partly void.
    pub deviation: f32,
    /// From the lowest bit: two for the kind of entry, one for whether the square that holds all that needs the diamond is three units wide instead
    /// of two, four for the binary logarithm of the unit (steps), the rest for the record.
    pub word: u32,
}

impl Item {
    /// None in particular.
    pub(super) const NOTHING: Item = Item { at: 0, heights: 0, deviation: 0.0, word: 0 };

    /// Bits of a record's number.
    pub(super) const RECORD_BITS: u32 = 25;

    #[inline]
    pub(super) fn word(kind: u8, square: bool, unit: u32, record: u32) -> u32 {
        u32::from(kind) | u32::from(square) << 2 | unit.trailing_zeros() << 3 | record << (32 - Item::RECORD_BITS)
    }
}

/// Entries of a list: what may be split, what may be merged, what would be split if that were allowed, and what is not there. An item says only whether it
/// may ever be split; the others are told by the sign of its number, and by whether that is one.
pub(super) const SPLIT: u8 = 0;
pub(super) const MERGE: u8 = 1;
pub(super) const STUCK: u8 = 2;
pub(super) const NOWHERE: u8 = 3;

/// Diamonds in a row, with their priorities. Places stay; those left are taken again, the last left first, while its memory is near.
#[derive(Clone, Debug, Default)]
pub(super) struct List {
    items: Vec<Item>,
    /// None, or as many.
    slopes: Vec<Slopes>,
    /// Priorities, as last measured, with the sign bit set for what may be merged; NaN where there is no entry.
    numbers: Vec<f32>,
    left: Vec<u32>,
}

impl List {
    pub(super) fn len(&self) -> usize {
        self.items.len()
    }

    pub(super) fn clear(&mut self) {
        self.items.clear();
        self.slopes.clear();
        self.left.clear();
        self.numbers.clear();
    }

    /// Adds one; returns where.
    pub(super) fn add(&mut self, item: Item, slopes: Option<Slopes>, priority: f32, kind: u8) -> u32 {
        let number = marked(priority, kind);
        let Some(place) = self.left.pop() else {
            self.items.push(item);
            self.slopes.extend(slopes);
            self.numbers.push(number);
            return self.items.len() as u32 - 1;
        };
        self.items[place as usize] = item;
        if let Some(slopes) = slopes {
            self.slopes[place as usize] = slopes;
        }
        self.numbers[place as usize] = number;
        place
    }

    /// Makes an entry one of another kind.
    pub(super) fn turn(&mut self, place: u32, priority: f32, kind: u8) {
        self.numbers[place as usize] = marked(priority, kind);
    }

    /// Removes one.
    pub(super) fn remove(&mut self, place: u32) {
        // Nothing that is compared with NaN is true, and it stays so when it is measured.
        self.numbers[place as usize] = f32::NAN;
        self.left.push(place);
    }

    /// The priority of an entry.
    #[inline]
    pub(super) fn priority(&self, place: u32) -> f32 {
        self.numbers[place as usize].abs()
    }

    /// The record of an entry.
    pub(super) fn record(&self, place: u32) -> u32 {
        self.items[place as usize].word >> (32 - Item::RECORD_BITS)
    }

    /// An entry.
    #[inline]
    pub(super) fn item(&self, place: u32) -> &Item {
        &self.items[place as usize]
    }

    /// Begins to load what turning or removing an entry asks for.
    #[inline]
    pub(super) fn expect(&self, place: u32) {
        if let Some(number) = self.numbers.get(place as usize) {
            prefetch(number);
        }
    }

    /// Begins to load places that entries will soon be added at.
    #[inline]
    pub(super) fn expect_room(&self) {
        for depth in 3..6 {
            if let Some(&place) = self.left.iter().nth_back(depth) {
                self.expect(place);
                prefetch(&self.items[place as usize]);
            }
        }
    }

    /// Records of all places, left ones included.
    #[cfg(test)]
    pub(super) fn word_records(&self) -> impl Iterator<Item = u32> + '_ {
        self.items.iter().map(|item| item.word >> (32 - Item::RECORD_BITS))
    }

    /// Measures those whose place lies in `part`, and finds the places of what may be split and of what may be merged whose priority is then above one
    /// number and not above another.
    pub(super) fn measure(
        &mut self,
        ground: &impl Ground,
        lens: &Lens,
        part: std::ops::Range<usize>,
        within: [Between; 2],
        found: [&mut Vec<u32>; 2],
    ) {
        let [splits, merges] = found;
        splits.clear();
        merges.clear();
        // A few at a time: they are looked at while they are near.
        for first in (0..self.items.len()).step_by(1024) {
            let end = (first + 1024).min(self.items.len());
            let due = first.max(part.start)..end.min(part.end);
            if !due.is_empty() {
                let slopes = self.slopes.get(due.clone()).unwrap_or_default();
                ground.measure(lens, &self.items[due.clone()], slopes, &mut self.numbers[due]);
            }
            find(&self.numbers[first..end], first as u32, within, [&mut *splits, &mut *merges]);
        }
        splits.retain(|&place| self.items[place as usize].word & 3 == u32::from(SPLIT));
    }

    /// The same, as they were measured last.
    pub(super) fn find(&self, within: [Between; 2], found: [&mut Vec<u32>; 2]) {
        let [splits, merges] = found;
        splits.clear();
        merges.clear();
        find(&self.numbers, 0, within, [&mut *splits, &mut *merges]);
        splits.retain(|&place| self.items[place as usize].word & 3 == u32::from(SPLIT));
    }

    /// Greatest priority of what is not split.
    pub(super) fn worst(&self) -> f32 {
        greatest(&self.numbers, f32::INFINITY)
    }

    /// Whether anything above `tolerance` that is not split is partly void.
    pub(super) fn any_void(&self, tolerance: f32) -> bool {
        let void = |(number, item): (&f32, &Item)| *number > tolerance && item.deviation == f32::INFINITY;
        self.numbers.iter().zip(&self.items).any(void)
    }
}

/// Measures many anew: numbers keep their signs, and what is none stays so.
pub(super) fn measure(lens: &Lens, items: &[Item], slopes: &[Slopes], out: &mut [f32]) {
    match lens.priority {
        #[cfg(target_arch = "x86_64")]
        priority if wide() => {
            // SAFETY: the processor has just been asked.
            unsafe {
                match priority {
                    Priority::ScreenError if lens.voids => measure_wide::<true, true>(lens, items, out),
                    Priority::ScreenError => measure_wide::<true, false>(lens, items, out),
                    Priority::InverseDistance => measure_wide::<false, false>(lens, items, out),
                }
            }
        }
        Priority::ScreenError if lens.voids => measure_errors_and_voids(lens, items, out),
        Priority::ScreenError => measure_errors(lens, items, out),
        Priority::InverseDistance => measure_distances(lens, items, out),
    }
    if let Some(weights) = &lens.weights {
        weights.weigh(|item| lens.extent(item), items, slopes, out);
    }
}

const LANES: usize = 16;

/// Whether the processor has what [`measure_wide`] is compiled for.
#[cfg(target_arch = "x86_64")]
fn wide() -> bool {
    use std::arch::is_x86_feature_detected as has;
    has!("avx512f") && has!("avx512dq") && has!("avx512vl") && has!("avx512bw") && has!("fma")
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn measure_errors(lens: &Lens, items: &[Item], out: &mut [f32]) {
    measure_one_by_one::<true, false>(lens, items, out);
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn measure_errors_and_voids(lens: &Lens, items: &[Item], out: &mut [f32]) {
    measure_one_by_one::<true, true>(lens, items, out);
}

#[multiversion(targets("x86_64+avx2+fma"))]
fn measure_distances(lens: &Lens, items: &[Item], out: &mut [f32]) {
    measure_one_by_one::<false, false>(lens, items, out);
}

/// Measures many that have the same word, and no sign.
pub(super) fn measure_alike(lens: &Lens, word: u32, at: &[u32], heights: &[u32], deviations: &[f32], out: &mut [f32]) {
    match lens.priority {
        Priority::ScreenError if lens.voids => alike_errors_and_voids(lens, word, at, heights, deviations, out),
        Priority::ScreenError => alike_errors(lens, word, at, heights, deviations, out),
        Priority::InverseDistance => alike_distances(lens, word, at, heights, deviations, out),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn alike_errors(lens: &Lens, word: u32, at: &[u32], heights: &[u32], deviations: &[f32], out: &mut [f32]) {
    alike::<true, false>(lens, word, at, heights, deviations, out);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn alike_errors_and_voids(lens: &Lens, word: u32, at: &[u32], heights: &[u32], deviations: &[f32], out: &mut [f32]) {
    alike::<true, true>(lens, word, at, heights, deviations, out);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn alike_distances(lens: &Lens, word: u32, at: &[u32], heights: &[u32], deviations: &[f32], out: &mut [f32]) {
    alike::<false, false>(lens, word, at, heights, deviations, out);
}

#[inline(always)]
fn alike<const ERRORS: bool, const VOIDS: bool>(
    lens: &Lens,
    word: u32,
    at: &[u32],
    heights: &[u32],
    deviations: &[f32],
    out: &mut [f32],
) {
    for (((out, &at), &heights), &deviation) in out.iter_mut().zip(at).zip(heights).zip(deviations) {
        *out = priority::<ERRORS, VOIDS>(lens, at, heights, deviation, word);
    }
}

#[inline(always)]
fn measure_one_by_one<const ERRORS: bool, const VOIDS: bool>(lens: &Lens, items: &[Item], out: &mut [f32]) {
    for (out, &Item { at, heights, deviation, word }) in out.iter_mut().zip(items) {
        *out = renewed(priority::<ERRORS, VOIDS>(lens, at, heights, deviation, word), *out);
    }
}

/// The same, sixteen at a time: compilers gather each number of an item by itself, which takes longer than all that is computed from them.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,fma,avx2")]
fn measure_wide<const ERRORS: bool, const VOIDS: bool>(lens: &Lens, items: &[Item], out: &mut [f32]) {
    let (sixteens, rest) = items.as_chunks::<LANES>();
    let (outs, last) = out.as_chunks_mut::<LANES>();
    for (items, out) in sixteens.iter().zip(outs) {
        let [at, heights, deviations, words] = turned(items);
        for lane in 0..LANES {
            let deviation = f32::from_bits(deviations[lane]);
            let number = priority::<ERRORS, VOIDS>(lens, at[lane], heights[lane], deviation, words[lane]);
            out[lane] = renewed(number, out[lane]);
        }
    }
    measure_one_by_one::<ERRORS, VOIDS>(lens, rest, last);
}

/// The first numbers of sixteen items, the second, the third and the fourth.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn turned(items: &[Item; LANES]) -> [[u32; LANES]; 4] {
    use std::arch::x86_64::*;
    let from = items.as_ptr().cast::<__m512i>();
    // SAFETY: sixteen items of sixteen bytes, which are aligned to as many.
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| unsafe { _mm512_loadu_si512(from.add(i)) });
    // Four by four in each quarter of a register, then the quarters' entries into their order.
    let [low, high] = [_mm512_unpacklo_epi32(a, b), _mm512_unpackhi_epi32(a, b)];
    let [lower, higher] = [_mm512_unpacklo_epi32(c, d), _mm512_unpackhi_epi32(c, d)];
    let order = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
    let fields = [
        _mm512_unpacklo_epi64(low, lower),
        _mm512_unpackhi_epi64(low, lower),
        _mm512_unpacklo_epi64(high, higher),
        _mm512_unpackhi_epi64(high, higher),
    ];
    let mut out = [[0; LANES]; 4];
    for (out, field) in out.iter_mut().zip(fields) {
        // SAFETY: sixteen numbers of four bytes.
        unsafe { _mm512_storeu_si512(out.as_mut_ptr().cast(), _mm512_permutexvar_epi32(order, field)) };
    }
    out
}

/// The number kept of a priority that is not negative.
#[inline(always)]
fn marked(priority: f32, kind: u8) -> f32 {
    f32::from_bits(priority.to_bits() | u32::from(kind == MERGE) << 31)
}

/// The number kept of a priority in the place of one that was.
#[inline(always)]
pub(super) fn renewed(priority: f32, number: f32) -> f32 {
    if number.is_nan() { number } else { f32::from_bits(priority.to_bits() | number.to_bits() & 1 << 31) }
}

#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A box, from the eye (m): least and greatest eastward, northward and upward.
pub(super) struct Extent(pub [[f32; 2]; 3]);

/// The box round all that needs a diamond.
#[inline(always)]
fn extent(lens: &Lens, at: u32, heights: u32, word: u32) -> Extent {
    let (x, y) = ((at & 0xffff) as i32, (at >> 16) as i32);
    let half = ((2 + (word >> 2 & 1)) << (word >> 3 & 15)) as i32;
    let (low, high) = ((heights & 0xffff) as i32, (heights >> 16) as i32);
    around(lens, [x, y], half, [lens.base + low as f32 * lens.step, lens.base + high as f32 * lens.step])
}

/// The box round a square, its middle and half its side in steps, between two heights (m).
#[inline(always)]
pub(super) fn around(lens: &Lens, [x, y]: [i32; 2], half: i32, [low, high]: [f32; 2]) -> Extent {
    let along = |x: i32, axis: usize| (x - lens.eye[axis]) as f32 * lens.scale[axis] - lens.rest[axis];
    Extent([
        [along(x - half, 0), along(x + half, 0)],
        [along(y - half, 1), along(y + half, 1)],
        [low - lens.height, high - lens.height],
    ])
}

/// The priority of an [`Item`], but for the factors.
#[inline(always)]
fn priority<const ERRORS: bool, const VOIDS: bool>(
    lens: &Lens,
    at: u32,
    heights: u32,
    deviation: f32,
    word: u32,
) -> f32 {
    let there = heights & 0xffff <= heights >> 16;
    priority_of_box::<ERRORS, VOIDS>(lens, extent(lens, at, heights, word), there, deviation)
}

/// The priority of what is in a box, if anything is there.
#[inline(always)]
pub(super) fn priority_of_box<const ERRORS: bool, const VOIDS: bool>(
    lens: &Lens,
    extent: Extent,
    there: bool,
    deviation: f32,
) -> f32 {
    let Extent([[x0, x1], [y0, y1], [z0, z1]]) = extent;
    let far_x = most(x0.abs(), x1.abs());
    let far_y = most(y0.abs(), y1.abs());
    let far_z = most(z0.abs(), z1.abs());
    let slack = -2e-6 * (far_x + far_y + far_z);
    let reach = |n: [f32; 3]| {
        // The farther of two products is that of the corner which the factor's sign points to.
        let corner = |n: f32, low: f32, high: f32| n * if n >= 0.0 { high } else { low };
        corner(n[0], x0, x1) + corner(n[1], y0, y1) + corner(n[2], z0, z1)
    };
    let side = |i: usize| reach(lens.sides[i]);
    let inside = least(least(side(0), side(1)), least(side(2), side(3)));
    // A bit more than nothing, since it is the nearest that counts and boxes are not empty.
    let seen = (inside >= slack) & (reach(lens.forward) >= View::NEAR) & there;
    let number = if ERRORS {
        let [fx, fy, fz] = lens.forward;
        let corner = |n: f32, low: f32, high: f32| n * if n >= 0.0 { low } else { high };
        let depth = most(corner(fx, x0, x1) + corner(fy, y0, y1) + corner(fz, z0, z1), View::NEAR);
        let flat = far_x * far_x + far_y * far_y;
        let (wrong, distance) = if VOIDS && deviation == f32::INFINITY {
            let (dx, dy, dz) = (x1 - x0, y1 - y0, z1 - z0);
            ((dx * dx + dy * dy + dz * dz).sqrt() * 1.0001, (flat + far_z * far_z).sqrt())
        } else {
            (deviation, flat.sqrt())
        };
        let near = 1.0 / depth;
        wrong * (lens.focal * 1.00002) * least(distance * near * near, lens.stretch * near)
    } else {
        let gap = |a: f32, b: f32| most(most(a, -b), 0.0);
        let (gx, gy, gz) = (gap(x0, x1), gap(y0, y1), gap(z0, z1));
        1.0 / (most(View::NEAR, (gx * gx + gy * gy + gz * gz).sqrt()))
    };
    if seen { number } else { 0.0 }
}

/// The greatest of the numbers that are no greater than `limit`; 0 if none of them is positive.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn greatest(numbers: &[f32], limit: f32) -> f32 {
    let mut greatest = [0.0f32; LANES];
    let chunks = numbers.chunks_exact(LANES);
    let rest = chunks.remainder();
    for numbers in chunks {
        for lane in 0..LANES {
            let number = if numbers[lane] <= limit { numbers[lane] } else { 0.0 };
            greatest[lane] = most(number, greatest[lane]);
        }
    }
    rest.iter().filter(|number| **number <= limit).chain(&greatest).fold(0.0, |a, &b| most(b, a))
}

/// Priorities above one number and not above another, by their bits: those of numbers that are not negative sort like them, and before all others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between {
    low: u32,
    span: u32,
}

impl Between {
    pub(super) const NONE: Between = Between { low: u32::MAX >> 1, span: 0 };

    pub(super) fn new(above: f32, most: f32) -> Between {
        let low = if above >= 0.0 { above.to_bits() + 1 } else { 0 };
        let span = if most >= 0.0 { most.to_bits().checked_sub(low) } else { None };
        span.map_or(Between::NONE, |span| Between { low, span })
    }
}

/// Tells where numbers are whose priority is among those asked for: of those without the sign bit, and of those with it. The first is at `first`.
fn find(numbers: &[f32], first: u32, within: [Between; 2], found: [&mut Vec<u32>; 2]) {
    let [positive, negative] = within;
    let within = [positive, Between { low: negative.low ^ 1 << 31, ..negative }];
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has what the function was compiled for.
        return unsafe { find_wide(numbers, first, within, found) };
    }
    find_portable(numbers, first, within, found);
}

/// Compilers make of such masks five times as many instructions.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn find_wide(numbers: &[f32], first: u32, within: [Between; 2], found: [&mut Vec<u32>; 2]) {
    use std::arch::x86_64::{_mm512_cmple_epu32_mask, _mm512_loadu_epi32, _mm512_set1_epi32, _mm512_sub_epi32};
    let number = |bits: u32| _mm512_set1_epi32(bits.cast_signed());
    let [[low, span], [other, other_span]] = within.map(|within| [number(within.low), number(within.span)]);
    let [splits, merges] = found;
    let chunks = numbers.chunks_exact(LANES);
    let (rest, mut first) = (chunks.remainder(), first);
    for numbers in chunks {
        // SAFETY: it reads the sixteen numbers of the chunk, wherever they lie.
        let bits = unsafe { _mm512_loadu_epi32(numbers.as_ptr().cast()) };
        let mut split = _mm512_cmple_epu32_mask(_mm512_sub_epi32(bits, low), span);
        let mut merge = _mm512_cmple_epu32_mask(_mm512_sub_epi32(bits, other), other_span);
        while split != 0 {
            splits.push(first + split.trailing_zeros());
            split &= split - 1;
        }
        while merge != 0 {
            merges.push(first + merge.trailing_zeros());
            merge &= merge - 1;
        }
        first += LANES as u32;
    }
    find_portable(rest, first, within, [splits, merges]);
}

fn find_portable(numbers: &[f32], first: u32, within: [Between; 2], mut found: [&mut Vec<u32>; 2]) {
    for (number, place) in numbers.iter().zip(first..) {
        let bits = number.to_bits();
        for (within, found) in within.iter().zip(&mut found) {
            if bits.wrapping_sub(within.low) <= within.span {
                found.push(place);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is found is what was asked for, by both kernels.
    #[test]
    fn numbers_between_two_are_found() {
        let some = [0.0, -0.0, f32::MIN_POSITIVE, 1.0, 1.5, 2.0, 3.0, f32::INFINITY, f32::NAN];
        let numbers: Vec<f32> = (0..75).map(|i| if i % 7 < 4 { some[i % 9] } else { -some[i % 9] }).collect();
        for above in [-1.0, 0.0, 1.0, 1.5, 2.0, f32::INFINITY] {
            for most in [-1.0, 0.0, 1.0, 2.0, 3.0, f32::INFINITY] {
                let expected = |negative: bool| -> Vec<u32> {
                    let fits = |n: f32| n.is_sign_negative() == negative && n.abs() > above && n.abs() <= most;
                    (0..).zip(&numbers).filter(|(_, n)| fits(**n)).map(|(i, _)| i + 5).collect()
                };
                let between = Between::new(above, most);
                for (one, other) in [(between, Between::NONE), (Between::NONE, between), (between, between)] {
                    let (mut splits, mut merges) = (Vec::new(), Vec::new());
                    find(&numbers, 5, [one, other], [&mut splits, &mut merges]);
                    let wanted = |part: Between, negative| {
                        if part.span == 0 && part.low == Between::NONE.low { Vec::new() } else { expected(negative) }
                    };
                    assert_eq!((&splits, &merges), (&wanted(one, false), &wanted(other, true)), "{above} {most}");
                    let (mut portable, mut portable_merges) = (Vec::new(), Vec::new());
                    let flipped = Between { low: other.low ^ 1 << 31, ..other };
                    find_portable(&numbers, 5, [one, flipped], [&mut portable, &mut portable_merges]);
                    assert_eq!((splits, merges), (portable, portable_merges), "{above} {most}");
                }
            }
        }
    }
}
