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
use crate::space::{Cell, Datum, View};
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

    /// The priority of one.
    pub(super) fn priority(&self, item: &Item, slopes: Slopes) -> f32 {
        let Item { at, heights, deviation, word } = *item;
        let number = match self.priority {
            Priority::ScreenError => priority::<true, true>(self, at, heights, deviation, word),
            Priority::InverseDistance => priority::<false, true>(self, at, heights, deviation, word),
        };
        match &self.weights {
            Some(weights) if number > 0.0 => number * weights.of(&self.extent(item), slopes),
            _ => number,
        }
    }
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
    /// Level of the cell whose diagonal or side the base is; steps are half a sample.
    #[inline]
    pub(super) fn unit_level(&self, shift: u8) -> u8 {
        Cell::MAX_LEVEL - 1 - shift - (self.word >> 3 & 15) as u8
    }

    /// Bits of a record's number.
    pub(super) const RECORD_BITS: u32 = 25;

    #[inline]
    pub(super) fn word(kind: u8, square: bool, unit: u32, record: u32) -> u32 {
        u32::from(kind) | u32::from(square) << 2 | unit.trailing_zeros() << 3 | record << (32 - Item::RECORD_BITS)
    }
}

/// Entries of a list: what may be split, what may be merged, what would be split if that were allowed, and what is not there. What is not split is
/// even.
pub(super) const SPLIT: u8 = 0;
pub(super) const MERGE: u8 = 1;
pub(super) const STUCK: u8 = 2;
pub(super) const NOWHERE: u8 = 3;

/// Diamonds in a row, with their priorities. Places stay; those left are taken again, the last left first, while its memory is near.
#[derive(Clone, Debug, Default)]
pub(super) struct List {
    items: Vec<Item>,
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
    pub(super) fn add(&mut self, item: Item, slopes: Slopes, priority: f32) -> u32 {
        let number = marked(priority, item.word);
        let Some(place) = self.left.pop() else {
            self.items.push(item);
            self.slopes.push(slopes);
            self.numbers.push(number);
            return self.items.len() as u32 - 1;
        };
        self.items[place as usize] = item;
        self.slopes[place as usize] = slopes;
        self.numbers[place as usize] = number;
        place
    }

    /// Makes an entry one of another kind.
    pub(super) fn turn(&mut self, place: u32, kind: u8) {
        let word = &mut self.items[place as usize].word;
        *word = *word & !3 | u32::from(kind);
        let number = &mut self.numbers[place as usize];
        *number = marked(number.abs(), *word);
    }

    /// Removes one.
    pub(super) fn remove(&mut self, place: u32) {
        let i = place as usize;
        // Nothing that is compared with NaN is true, and what is computed from it stays so.
        self.items[i].deviation = f32::NAN;
        self.items[i].word |= u32::from(NOWHERE);
        self.numbers[i] = f32::NAN;
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

    /// Begins to load an entry.
    #[inline]
    pub(super) fn expect(&self, place: u32) {
        if let Some(item) = self.items.get(place as usize) {
            prefetch(item);
            prefetch(&self.numbers[place as usize]);
        }
    }

    /// Begins to load places that entries will soon be added at.
    #[inline]
    pub(super) fn expect_room(&self) {
        for depth in 3..6 {
            if let Some(&place) = self.left.iter().nth_back(depth) {
                self.expect(place);
            }
        }
    }

    /// Records of all places, left ones included.
    #[cfg(test)]
    pub(super) fn word_records(&self) -> impl Iterator<Item = u32> + '_ {
        self.items.iter().map(|item| item.word >> (32 - Item::RECORD_BITS))
    }

    /// Measures all whose number lies in `part`.
    pub(super) fn measure(&mut self, ground: &impl Ground, lens: &Lens, part: std::ops::Range<usize>) {
        ground.measure(lens, &self.items[part.clone()], &self.slopes[part.clone()], &mut self.numbers[part]);
    }

    /// Greatest priority of what is not split.
    pub(super) fn worst(&self) -> f32 {
        worst(&self.numbers)
    }

    /// Whether anything above `tolerance` that is not split is partly void.
    pub(super) fn any_void(&self, tolerance: f32) -> bool {
        let void = |(number, item): (&f32, &Item)| *number > tolerance && item.deviation == f32::INFINITY;
        self.numbers.iter().zip(&self.items).any(void)
    }

    /// Puts the places of those of a kind whose priority is above `above` and not above `most` into `found`.
    pub(super) fn within(&self, kind: u8, above: f32, most: f32, found: &mut Vec<u32>) {
        found.clear();
        within(&self.numbers, kind == MERGE, above, most, found);
        if kind == SPLIT {
            found.retain(|&place| self.items[place as usize].word & 3 == u32::from(SPLIT));
        }
    }
}

/// Measures many; the number of one that may be merged has its sign bit set.
pub(super) fn measure(lens: &Lens, items: &[Item], slopes: &[Slopes], out: &mut [f32]) {
    match lens.priority {
        Priority::ScreenError if lens.voids => measure_errors_and_voids(lens, items, out),
        Priority::ScreenError => measure_errors(lens, items, out),
        Priority::InverseDistance => measure_distances(lens, items, out),
    }
    if let Some(weights) = &lens.weights {
        weights.weigh(|item| lens.extent(item), items, slopes, out);
    }
}

const LANES: usize = 16;

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_errors(lens: &Lens, items: &[Item], out: &mut [f32]) {
    measure_one_by_one::<true, false>(lens, items, out);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_errors_and_voids(lens: &Lens, items: &[Item], out: &mut [f32]) {
    measure_one_by_one::<true, true>(lens, items, out);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_distances(lens: &Lens, items: &[Item], out: &mut [f32]) {
    measure_one_by_one::<false, false>(lens, items, out);
}

#[inline(always)]
fn measure_one_by_one<const ERRORS: bool, const VOIDS: bool>(lens: &Lens, items: &[Item], out: &mut [f32]) {
    for (out, &Item { at, heights, deviation, word }) in out.iter_mut().zip(items) {
        *out = marked(priority::<ERRORS, VOIDS>(lens, at, heights, deviation, word), word);
    }
}

/// The number kept of a priority that is not negative.
#[inline(always)]
pub(super) fn marked(priority: f32, word: u32) -> f32 {
    f32::from_bits(priority.to_bits() | word << 31)
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
    let number = if seen { number } else { 0.0 };
    // What is not there has none.
    if deviation.is_nan() { f32::NAN } else { number }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn worst(numbers: &[f32]) -> f32 {
    let mut greatest = [0.0f32; LANES];
    let chunks = numbers.chunks_exact(LANES);
    let rest = chunks.remainder();
    for numbers in chunks {
        for lane in 0..LANES {
            greatest[lane] = most(numbers[lane], greatest[lane]);
        }
    }
    rest.iter().chain(&greatest).fold(0.0, |a, &b| most(b, a))
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn within(numbers: &[f32], marked: bool, above: f32, most: f32, found: &mut Vec<u32>) {
    let chunks = numbers.chunks_exact(LANES);
    let (rest, mut first) = (chunks.remainder(), 0);
    let fits = |number: f32| {
        let p = number.abs();
        u32::from(p > above) & u32::from(p <= most) & u32::from((number.to_bits() >> 31 == 1) == marked)
    };
    for numbers in chunks {
        let mut mask = 0u32;
        for (lane, &number) in numbers.iter().enumerate() {
            mask |= fits(number) << lane;
        }
        while mask != 0 {
            found.push(first + mask.trailing_zeros());
            mask &= mask - 1;
        }
        first += LANES as u32;
    }
    found.extend(rest.iter().zip(first..).filter(|(number, _)| fits(**number) == 1).map(|(_, place)| place));
}
