//! Priorities of many diamonds at once.
//!
//! Those that may be split or merged lie in plain arrays, one number each, and all are measured anew for every view: 28 bytes of reading
//! in a row cost less than any queue that would know which of them to skip. The formula is that of
//! [`ScreenMetric`] for boxes in lattice coordinates, so that far from the origin nothing is lost. Each of its steps is monotone
//! under rounding, too: a box within another never gets the larger number, not by a bit.

use super::super::ScreenMetric;
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

/// A view, in the coordinates of the lists.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// The eye's place, in whole steps, and what is left of it (m).
    eye: [i32; 2],
    rest: [f32; 2],
    height: f32,
    /// Metres a step.
    scale: [f32; 2],
    forward: [f32; 3],
    sides: [[f32; 3]; 4],
    focal: f32,
    stretch: f32,
    priority: Priority,
}

impl Lens {
    /// The lens of a view of a face cut into `steps` steps a side.
    pub(super) fn new(metric: &ScreenMetric, datum: Datum, steps: f64, priority: Priority) -> Lens {
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
            scale: (size / steps).as_vec2().to_array(),
            forward: forward.to_array(),
            sides: sides.map(|side| side.to_array()),
            focal,
            stretch,
            priority,
        }
    }

    /// The priority of one.
    pub(super) fn priority(&self, item: &Item) -> f32 {
        let Item { x, y, half, low, high, deviation } = *item;
        match self.priority {
            Priority::ScreenError => priority::<true>(self, x, y, half, low, high, deviation),
            Priority::InverseDistance => priority::<false>(self, x, y, half, low, high, deviation),
        }
    }
}

/// What the priority of a diamond is computed from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Item {
    /// Its middle and the half side of the square that holds all that needs it (steps).
    pub x: i32,
    pub y: i32,
    pub half: i32,
    /// Lowest and highest height within (m).
    pub low: f32,
    pub high: f32,
    /// Greatest vertical distance to the surface (m); infinite where partly void.
    pub deviation: f32,
}

/// Diamonds in arrays, with their priorities.
#[derive(Clone, Debug, Default)]
pub(super) struct List {
    x: Vec<i32>,
    y: Vec<i32>,
    half: Vec<i32>,
    low: Vec<f32>,
    high: Vec<f32>,
    deviation: Vec<f32>,
    /// Priorities, as last measured.
    pub priority: Vec<f32>,
    /// Who they are.
    pub record: Vec<u32>,
}

impl List {
    pub(super) fn len(&self) -> usize {
        self.record.len()
    }

    pub(super) fn clear(&mut self) {
        for numbers in [&mut self.x, &mut self.y, &mut self.half] {
            numbers.clear();
        }
        for numbers in [&mut self.low, &mut self.high, &mut self.deviation, &mut self.priority] {
            numbers.clear();
        }
        self.record.clear();
    }

    /// Appends one; returns where.
    pub(super) fn push(&mut self, item: Item, priority: f32, record: u32) -> u32 {
        self.x.push(item.x);
        self.y.push(item.y);
        self.half.push(item.half);
        self.low.push(item.low);
        self.high.push(item.high);
        self.deviation.push(item.deviation);
        self.priority.push(priority);
        self.record.push(record);
        self.record.len() as u32 - 1
    }

    /// The item and its priority at a place.
    pub(super) fn item(&self, at: u32) -> (Item, f32) {
        let at = at as usize;
        let (low, high, deviation) = (self.low[at], self.high[at], self.deviation[at]);
        (Item { x: self.x[at], y: self.y[at], half: self.half[at], low, high, deviation }, self.priority[at])
    }

    /// Removes one and puts the last in its place; returns which that is, if any.
    pub(super) fn remove(&mut self, at: u32) -> Option<u32> {
        let at = at as usize;
        self.x.swap_remove(at);
        self.y.swap_remove(at);
        self.half.swap_remove(at);
        self.low.swap_remove(at);
        self.high.swap_remove(at);
        self.deviation.swap_remove(at);
        self.priority.swap_remove(at);
        self.record.swap_remove(at);
        self.record.get(at).copied()
    }

    /// Measures all whose number lies in `part`.
    pub(super) fn measure(&mut self, lens: &Lens, part: std::ops::Range<usize>) {
        let arrays = Arrays {
            x: &self.x[part.clone()],
            y: &self.y[part.clone()],
            half: &self.half[part.clone()],
            low: &self.low[part.clone()],
            high: &self.high[part.clone()],
            deviation: &self.deviation[part.clone()],
        };
        match lens.priority {
            Priority::ScreenError => measure_errors(lens, arrays, &mut self.priority[part]),
            Priority::InverseDistance => measure_distances(lens, arrays, &mut self.priority[part]),
        }
    }

    /// Greatest priority, and whether any above `tolerance` is of something partly void.
    pub(super) fn worst(&self, tolerance: f32) -> (f32, bool) {
        worst(&self.priority, &self.deviation, tolerance)
    }

    /// Calls `found` with the numbers of those whose priority is above `above` and not above `most`.
    pub(super) fn within(&self, above: f32, most: f32, found: &mut Vec<u32>) {
        found.clear();
        within(&self.priority, above, most, found);
    }
}

#[derive(Clone, Copy)]
struct Arrays<'a> {
    x: &'a [i32],
    y: &'a [i32],
    half: &'a [i32],
    low: &'a [f32],
    high: &'a [f32],
    deviation: &'a [f32],
}

const LANES: usize = 16;

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_errors(lens: &Lens, arrays: Arrays, out: &mut [f32]) {
    measure::<true>(lens, arrays, out);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_distances(lens: &Lens, arrays: Arrays, out: &mut [f32]) {
    measure::<false>(lens, arrays, out);
}

#[inline(always)]
fn measure<const ERRORS: bool>(lens: &Lens, a: Arrays, out: &mut [f32]) {
    let lens = *lens;
    let n = out.len();
    let (x, y, half) = (&a.x[..n], &a.y[..n], &a.half[..n]);
    let (low, high, deviation) = (&a.low[..n], &a.high[..n], &a.deviation[..n]);
    for i in 0..n {
        out[i] = priority::<ERRORS>(&lens, x[i], y[i], half[i], low[i], high[i], deviation[i]);
    }
}

#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The priority of the box `x ± half`, `y ± half`, `low … high`.
#[inline(always)]
fn priority<const ERRORS: bool>(lens: &Lens, x: i32, y: i32, half: i32, low: f32, high: f32, deviation: f32) -> f32 {
    let x0 = (x - half - lens.eye[0]) as f32 * lens.scale[0] - lens.rest[0];
    let x1 = (x + half - lens.eye[0]) as f32 * lens.scale[0] - lens.rest[0];
    let y0 = (y - half - lens.eye[1]) as f32 * lens.scale[1] - lens.rest[1];
    let y1 = (y + half - lens.eye[1]) as f32 * lens.scale[1] - lens.rest[1];
    let (z0, z1) = (low - lens.height, high - lens.height);
    let far_x = most(x0.abs(), x1.abs());
    let far_y = most(y0.abs(), y1.abs());
    let far_z = most(z0.abs(), z1.abs());
    let slack = -2e-6 * (far_x + far_y + far_z);
    let reach = |n: [f32; 3]| most(n[0] * x0, n[0] * x1) + most(n[1] * y0, n[1] * y1) + most(n[2] * z0, n[2] * z1);
    let side = |i: usize| reach(lens.sides[i]);
    let inside = least(least(side(0), side(1)), least(side(2), side(3)));
    // A bit more than nothing, since it is the nearest that counts and boxes are not empty.
    let seen = (inside >= slack) & (reach(lens.forward) >= View::NEAR) & (low <= high);
    let number = if ERRORS {
        let f = lens.forward;
        let depth = least(f[0] * x0, f[0] * x1) + least(f[1] * y0, f[1] * y1) + least(f[2] * z0, f[2] * z1);
        let depth = most(depth, View::NEAR);
        let across = (far_x * far_x + far_y * far_y).sqrt();
        let away = (far_x * far_x + far_y * far_y + far_z * far_z).sqrt();
        let (dx, dy, dz) = (x1 - x0, y1 - y0, z1 - z0);
        let size = (dx * dx + dy * dy + dz * dz).sqrt() * 1.0001;
        let void = deviation == f32::INFINITY;
        let wrong = if void { size } else { deviation };
        let distance = if void { away } else { across };
        let spread = least(distance / (depth * depth), lens.stretch / depth);
        wrong * (lens.focal * 1.00002) * spread
    } else {
        let gap = |a: f32, b: f32| most(most(a, -b), 0.0);
        let (gx, gy, gz) = (gap(x0, x1), gap(y0, y1), gap(z0, z1));
        1.0 / (most(View::NEAR, (gx * gx + gy * gy + gz * gz).sqrt()))
    };
    if seen { number } else { 0.0 }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn worst(priority: &[f32], deviation: &[f32], tolerance: f32) -> (f32, bool) {
    let mut greatest = [0.0f32; LANES];
    let mut void = 0u32;
    let (whole, rest) = priority.split_at(priority.len() / LANES * LANES);
    for (p, d) in whole.chunks_exact(LANES).zip(deviation.chunks_exact(LANES)) {
        for lane in 0..LANES {
            greatest[lane] = most(greatest[lane], p[lane]);
            void |= u32::from((p[lane] > tolerance) & (d[lane] == f32::INFINITY));
        }
    }
    let mut all = 0.0;
    for (&p, &d) in rest.iter().zip(&deviation[whole.len()..]) {
        all = most(all, p);
        void |= u32::from((p > tolerance) & (d == f32::INFINITY));
    }
    (greatest.into_iter().fold(all, most), void > 0)
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn within(priority: &[f32], above: f32, most: f32, found: &mut Vec<u32>) {
    const BLOCK: usize = 64;
    for (block, numbers) in priority.chunks(BLOCK).enumerate() {
        let mut any = 0u32;
        for &p in numbers {
            any |= u32::from((p > above) & (p <= most));
        }
        if any > 0 {
            for (i, &p) in numbers.iter().enumerate() {
                if (p > above) & (p <= most) {
                    found.push((block * BLOCK + i) as u32);
                }
            }
        }
    }
}
