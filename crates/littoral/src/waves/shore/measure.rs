//! How far a sea over a bed can go anywhere: the sum of what each wave can at the worst phase, cell by cell.

use super::lanes::LANES;
use super::march::{Record, sum};
use super::shape::{self, Place};
use super::{BINS, Bounds, ShoreSea};
use multiversion::multiversion;
use rayon::prelude::*;
use std::f32::consts::TAU;

#[derive(Clone)]
struct Most {
    bounds: Bounds,
    by_length: Vec<[f32; BINS]>,
}

impl Most {
    fn join(mut self, other: Most) -> Most {
        let (a, b) = (&mut self.bounds, other.bounds);
        a.height = a.height.max(b.height);
        a.sideways = a.sideways.max(b.sideways);
        a.slope = a.slope.max(b.slope);
        a.stretch = a.stretch.max(b.stretch);
        a.curvature = a.curvature.max(b.curvature);
        a.bend = a.bend.max(b.bend);
        for (a, b) in self.by_length.iter_mut().zip(&other.by_length) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(*b));
        }
        self
    }
}

/// Most that water may be stretched sideways: 1 would make the first loop.
const STRETCH: f32 = 0.75;

/// Finds the bounds of a sea, after lowering its sideways motion to where no loop can form.
pub(super) fn measure(sea: &mut ShoreSea) {
    let none = Most { bounds: Bounds::default(), by_length: vec![[0.0; BINS]; sea.components.len()] };
    // One more cell at every side, the open sea's.
    let (columns, rows) = (sea.columns + 1, sea.rows + 1);
    let mut steepness = std::mem::take(&mut sea.steepness);
    steepness.resize(columns * rows, 0.0);
    steepness.par_chunks_exact_mut(columns).enumerate().for_each(|(row, out)| steepnesses(sea, row, out));
    tame(sea, &steepness);
    sea.places[(columns - 1) * (rows - 1)] = sea.open;
    sea.steepness = steepness;
    let most = (0..rows)
        .into_par_iter()
        .fold(
            || none.clone(),
            |mut most, row| {
                cells(sea, row, &mut most);
                most
            },
        )
        .reduce(|| none.clone(), Most::join);
    (sea.bounds, sea.by_length) = (most.bounds, most.by_length);
}

/// Lowers the sideways motion at the corners of cells that are too steep, and towards them no faster than is smooth.
fn tame(sea: &mut ShoreSea, steepness: &[f32]) {
    let (columns, rows) = (sea.columns, sea.rows);
    let height: f32 = sea.components.iter().map(|c| c.amplitude).sum();
    let n = Place::SIDEWAYS;
    let wide = columns + 1;
    for i in 0..columns * rows {
        let (c, r) = (i % columns, i / columns);
        let around = [(c, r), (c + 1, r), (c, r + 1), (c + 1, r + 1)].map(|(c, r)| steepness[r * wide + c]);
        let steepest = around.into_iter().fold(0.0, f32::max);
        let most = STRETCH / steepest.max(STRETCH);
        sea.places[i].0[n] = sea.places[i].0[n].min(most);
    }
    // The open sea's is the least of all along the rim, so that there is no step.
    let rim = steepness[0].max(steepness[wide * (rows + 1) - 1]);
    sea.open.0[n] = sea.open.0[n].min(STRETCH / rim.max(STRETCH));
    let (slow_x, slow_y) = {
        let most = 0.04 / height.max(0.04);
        (most * sea.spacing.x as f32, most * sea.spacing.y as f32)
    };
    let edge = |c: usize, r: usize| c == 0 || r == 0 || c == columns - 1 || r == rows - 1;
    // The second time from the rim, where it is made the open sea's all round.
    for _ in 0..2 {
        let lowest = |open: f32, i: usize| {
            if edge(i % columns, i / columns) { open.min(sea.places[i].0[n]) } else { open }
        };
        let open = (0..columns * rows).fold(sea.open.0[n], lowest);
        sea.open.0[n] = open;
        for backward in [false, true] {
            for step in 0..columns * rows {
                let i = if backward { columns * rows - 1 - step } else { step };
                let (c, r) = (i % columns, i / columns);
                let mut most = sea.places[i].0[n];
                if edge(c, r) {
                    most = most.min(open);
                }
                if backward {
                    if c + 1 < columns {
                        most = most.min(sea.places[i + 1].0[n] + slow_x);
                    }
                    if r + 1 < rows {
                        most = most.min(sea.places[i + columns].0[n] + slow_y);
                    }
                } else {
                    if c > 0 {
                        most = most.min(sea.places[i - 1].0[n] + slow_x);
                    }
                    if r > 0 {
                        most = most.min(sea.places[i - columns].0[n] + slow_y);
                    }
                }
                sea.places[i].0[n] = most;
            }
        }
    }
}

/// Indices of the corners of a cell, where they are on the grid; cells are counted from the one before the first node.
#[inline(always)]
fn corners(sea: &ShoreSea, column: usize, row: usize) -> [Option<usize>; 4] {
    [(column, row), (column + 1, row), (column, row + 1), (column + 1, row + 1)].map(|(c, r)| {
        let inside = c > 0 && r > 0 && c <= sea.columns && r <= sea.rows;
        inside.then(|| (r - 1) * sea.columns + c - 1)
    })
}

/// Sums over the waves of what they can be in a cell at most: height, slope, curvature; handing each wave's to `each`.
#[inline(always)]
fn sums(
    sea: &ShoreSea,
    corners: [Option<usize>; 4],
    mut each: impl FnMut(usize, &[f32; LANES], &[f32; LANES]),
) -> [f32; 3] {
    let (over_x, over_y) = ((1.0 / sea.spacing.x) as f32, (1.0 / sea.spacing.y) as f32);
    let open = Record::OPEN;
    let mut all = [0.0f32; 3];
    for (block, waves) in sea.lanes.iter().enumerate() {
        let [a, b, d, e] = corners.map(|i| *i.map_or(&open, |i| &sea.records[i * sea.blocks + block]));
        let (mut heights, mut slopes, mut curvatures) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
        let mut numbers = [0.0f32; LANES];
        for l in 0..LANES {
            let [pa, pb, pd, pe] = [a.phase[l], b.phase[l], d.phase[l], e.phase[l]];
            let [aa, ab, ad, ae] = [a.amplitude[l], b.amplitude[l], d.amplitude[l], e.amplitude[l]];
            let turn = |from: i16, to: i16| f32::from(to.wrapping_sub(from)) * (1.0 / 65_536.0);
            // Beside a cell's first edge the phase may go round the other way; the kernel takes the one from the first corner.
            let greatest = |p: f32, q: f32, open: f32| (open + p).abs().max((open + q).abs()) * TAU;
            let kx = greatest(turn(pa, pb), turn(pd, pe), waves.step_x[l]) * over_x;
            let twist = turn(pd, pe) - turn(pa, pb);
            let ky = greatest(turn(pa, pd), turn(pa, pd) + twist, waves.step_y[l]) * over_y;
            let square = kx * kx + ky * ky;
            let k = square.sqrt();
            let unit = waves.unit[l];
            let amplitude = f32::from(aa.max(ab).max(ad).max(ae)) * unit;
            let fall = |p: u16, q: u16| (f32::from(p) - f32::from(q)).abs() * unit;
            let changes = fall(aa, ab).max(fall(ad, ae)) * over_x + fall(aa, ad).max(fall(ab, ae)) * over_y;
            heights[l] = amplitude;
            slopes[l] = amplitude * k + changes;
            curvatures[l] = amplitude * square + 2.0 * changes * k;
            numbers[l] = k;
        }
        all[0] += sum(&heights);
        all[1] += sum(&slopes);
        all[2] += sum(&curvatures);
        each(block, &heights, &numbers);
    }
    all
}

/// Sums of slopes over a row of cells.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn steepnesses(sea: &ShoreSea, row: usize, out: &mut [f32]) {
    for (column, out) in out.iter_mut().enumerate() {
        *out = sums(sea, corners(sea, column, row), |_, _, _| {})[1];
    }
}

/// A row of cells.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn cells(sea: &ShoreSea, row: usize, most: &mut Most) {
    for column in 0..sea.columns + 1 {
        let at = corners(sea, column, row);
        let by_length = &mut most.by_length;
        let [height, slope, curvature] = sums(sea, at, |block, heights, numbers| {
            let first = block * LANES;
            let last = (first + LANES).min(by_length.len());
            for (l, bins) in by_length[first..last].iter_mut().enumerate() {
                let seen = &mut bins[octave(TAU / numbers[l].max(1e-6))];
                *seen = seen.max(heights[l]);
            }
        });
        cell(sea, at, [height, slope, curvature], &mut most.bounds);
    }
}

/// Bounds of a cell, from what the waves can be there.
#[inline(always)]
fn cell(sea: &ShoreSea, corners: [Option<usize>; 4], [height, slope, curvature]: [f32; 3], b: &mut Bounds) {
    let (dx, dy) = (sea.spacing.x as f32, sea.spacing.y as f32);
    let places = corners.map(|i| i.map_or(&sea.open, |i| &sea.places[i]));
    let greatest = |n: usize| places.iter().map(|p| p.0[n]).fold(0.0, f32::max);
    let spread = |n: usize| {
        let least = places.iter().map(|p| p.0[n]).fold(f32::INFINITY, f32::min);
        (places.iter().map(|p| p.0[n]).fold(f32::NEG_INFINITY, f32::max) - least) * (1.0 / dx + 1.0 / dy)
    };
    let r = places.iter().map(|p| p.sharpness()).fold(0.0, f32::max);
    let soft = shape::SOFT * places.iter().map(|p| p.0[Place::HEIGHT]).fold(f32::INFINITY, f32::min);
    let bend = shape::steepest(r);
    let sideways = greatest(Place::SIDEWAYS);
    let changing = 3.0 * height * (spread(Place::COSINE) + spread(Place::SINE));
    // Where waves are lower than at other corners their sum is lower, too.
    let least_height = places.iter().map(|p| p.0[Place::HEIGHT]).fold(f32::INFINITY, f32::min);
    let least_height = least_height.max(0.25 * greatest(Place::HEIGHT));
    let swing = greatest(Place::SWING);
    // As high as it is told to run and no steeper than waves that much higher would be.
    let swash = greatest(Place::SETUP) + shape::FARTHEST * swing;
    let climbing = spread(Place::SETUP)
        + shape::FARTHEST * spread(Place::SWING)
        + swing / (0.7 * least_height + 1e-5) * (slope + spread(Place::HEIGHT));
    let own = Bounds {
        height: height * shape::highest(r) + 0.25 * greatest(Place::HEIGHT) * r + swash,
        sideways: height * sideways,
        slope: slope * bend + changing + spread(Place::HEIGHT) + if swash > 0.0 { climbing } else { 0.0 },
        stretch: slope * sideways + height * spread(Place::SIDEWAYS),
        bend: curvature * sideways + 2.0 * slope * spread(Place::SIDEWAYS),
        curvature: curvature * bend + if r > 1e-3 { 6.0 * r * slope * slope / soft.max(1e-3) } else { 0.0 },
    };
    b.height = b.height.max(own.height);
    b.sideways = b.sideways.max(own.sideways);
    b.slope = b.slope.max(own.slope);
    b.stretch = b.stretch.max(own.stretch);
    b.curvature = b.curvature.max(own.curvature);
    b.bend = b.bend.max(own.bend);
}

/// The bin of a wavelength (m).
pub(super) fn octave(wavelength: f32) -> usize {
    // The exponent of a float is the integral part of its binary logarithm.
    let exponent = ((wavelength.to_bits() >> 23) & 0xFF) as i32 - 127;
    (exponent + 1).clamp(0, BINS as i32 - 1) as usize
}
