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
    let mut cells = std::mem::take(&mut sea.cells);
    cells.resize(columns * rows, [0.0; 3]);
    let empty = || (none.clone(), vec![Lengths::NONE; sea.blocks]);
    let (most, _) = cells
        .par_chunks_exact_mut(columns)
        .enumerate()
        .fold(empty, |(mut most, mut lengths), (row, out)| {
            sums(sea, row, out, &mut lengths, &mut most.by_length);
            (most, lengths)
        })
        .reduce(empty, |(a, lengths), (b, _)| (a.join(b), lengths));
    sea.by_length = most.by_length;
    tame(sea, &cells);
    sea.places[(columns - 1) * (rows - 1)] = sea.open;
    let most = cells
        .par_chunks_exact(columns)
        .enumerate()
        .fold(
            || none.clone(),
            |mut most, (row, cells)| {
                for (column, cell) in cells.iter().enumerate() {
                    bound(sea, corners(sea, column, row), *cell, &mut most.bounds);
                }
                most
            },
        )
        .reduce(|| none.clone(), Most::join);
    sea.bounds = most.bounds;
    sea.cells = cells;
}

/// Lowers the sideways motion at the corners of cells that are too steep, and towards them no faster than is smooth.
fn tame(sea: &mut ShoreSea, cells: &[[f32; 3]]) {
    let (columns, rows) = (sea.columns, sea.rows);
    let height: f32 = sea.components.iter().map(|c| c.amplitude).sum();
    let n = Place::SIDEWAYS;
    let wide = columns + 1;
    let slope = |c: usize, r: usize| cells[r * wide + c][1];
    // The open sea's is the least of all along the rim, so that there is no step.
    let rim = slope(0, 0).max(slope(columns, rows));
    let mut open = sea.open.0[n].min(STRETCH / rim.max(STRETCH));
    let mut held = std::mem::take(&mut sea.held);
    held.clear();
    for r in 0..rows {
        held.extend(sea.places[r * columns..][..columns].iter().enumerate().map(|(c, place)| {
            let steepest = slope(c, r).max(slope(c + 1, r)).max(slope(c, r + 1)).max(slope(c + 1, r + 1));
            place.0[n].min(STRETCH / steepest.max(STRETCH))
        }));
    }
    let slow = sea.spacing.as_vec2() * (0.04 / height.max(0.04));
    let edges = |held: &mut [f32], open: f32| {
        let rim = |row: &mut [f32]| {
            row.iter_mut().fold(open, |least, held| {
                *held = held.min(open);
                least.min(*held)
            })
        };
        let mut least = rim(&mut held[..columns]).min(rim(&mut held[(rows - 1) * columns..]));
        for row in held.chunks_exact_mut(columns) {
            for c in [0, columns - 1] {
                row[c] = row[c].min(open);
                least = least.min(row[c]);
            }
        }
        least
    };
    // The second time from the rim, where it is made the open sea's all round.
    for _ in 0..2 {
        open = edges(&mut held, open);
        edges(&mut held, open);
        for r in 0..rows {
            let (before, row) = held.split_at_mut(r * columns);
            let row = &mut row[..columns];
            if r > 0 {
                let below = &before[(r - 1) * columns..];
                row.iter_mut().zip(below).for_each(|(held, below)| *held = held.min(below + slow.y));
            }
            row.iter_mut().fold(f32::INFINITY, |last, held| {
                *held = held.min(last + slow.x);
                *held
            });
        }
        for r in (0..rows).rev() {
            let (row, after) = held[r * columns..].split_at_mut(columns);
            if r + 1 < rows {
                row.iter_mut().zip(after).for_each(|(held, above)| *held = held.min(*above + slow.y));
            }
            row.iter_mut().rev().fold(f32::INFINITY, |last, held| {
                *held = held.min(last + slow.x);
                *held
            });
        }
    }
    sea.open.0[n] = open;
    sea.places.iter_mut().zip(&held).for_each(|(place, held)| place.0[n] = *held);
    sea.held = held;
}

/// Indices of the corners of a cell, where they are on the grid; cells are counted from the one before the first node.
#[inline(always)]
fn corners(sea: &ShoreSea, column: usize, row: usize) -> [Option<usize>; 4] {
    [(column, row), (column + 1, row), (column, row + 1), (column + 1, row + 1)].map(|(c, r)| {
        let inside = c > 0 && r > 0 && c <= sea.columns && r <= sea.rows;
        inside.then(|| (r - 1) * sea.columns + c - 1)
    })
}

/// The octaves of wavelengths that sixteen waves were last seen in, and how high each has been since it came into its own.
#[derive(Clone, Copy)]
struct Lengths {
    octave: [i32; LANES],
    highest: [f32; LANES],
}

impl Lengths {
    const NONE: Lengths = Lengths { octave: [0; LANES], highest: [0.0; LANES] };

    fn note(&self, by_length: &mut [[f32; BINS]]) {
        for (l, bins) in by_length.iter_mut().take(LANES).enumerate() {
            let seen = &mut bins[self.octave[l] as usize];
            *seen = seen.max(self.highest[l]);
        }
    }
}

/// Sums over the waves of what they can be in the cells of a row at most: height, slope, curvature.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn sums(sea: &ShoreSea, row: usize, out: &mut [[f32; 3]], lengths: &mut [Lengths], by_length: &mut [[f32; BINS]]) {
    let (over_x, over_y) = ((1.0 / sea.spacing.x) as f32, (1.0 / sea.spacing.y) as f32);
    let open = Record::OPEN;
    for (column, out) in out.iter_mut().enumerate() {
        let corners = corners(sea, column, row);
        *out = [0.0; 3];
        for (block, (waves, seen)) in sea.lanes.iter().zip(&mut *lengths).enumerate() {
            let [a, b, d, e] = corners.map(|i| *i.map_or(&open, |i| &sea.records[i * sea.blocks + block]));
            let (mut heights, mut slopes, mut curvatures) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
            let (mut octaves, mut highest, mut others) = ([0i32; LANES], seen.highest, 0);
            for l in 0..LANES {
                let [pa, pb, pd, pe] = [a.phase[l], b.phase[l], d.phase[l], e.phase[l]];
                let [aa, ab, ad, ae] = [a.amplitude[l], b.amplitude[l], d.amplitude[l], e.amplitude[l]];
                let turn = |from: i16, to: i16| f32::from(to.wrapping_sub(from)) * (1.0 / 65_536.0);
                // Beside a cell's first edge the phase may go round the other way; the kernel takes the one from the first corner.
                let greatest = |p: f32, q: f32, open: f32| (open + p).abs().max((open + q).abs()) * TAU;
                let (first, second, up) = (turn(pa, pb), turn(pd, pe), turn(pa, pd));
                let kx = greatest(first, second, waves.step_x[l]) * over_x;
                let ky = greatest(up, up + (second - first), waves.step_y[l]) * over_y;
                let square = kx * kx + ky * ky;
                let k = square.sqrt();
                let unit = waves.unit[l];
                let amplitude = f32::from(aa.max(ab).max(ad).max(ae)) * unit;
                let fall_x = f32::from(aa.abs_diff(ab).max(ad.abs_diff(ae)));
                let fall_y = f32::from(aa.abs_diff(ad).max(ab.abs_diff(ae)));
                let changes = (fall_x * over_x + fall_y * over_y) * unit;
                heights[l] = amplitude;
                slopes[l] = amplitude * k + changes;
                curvatures[l] = amplitude * square + 2.0 * changes * k;
                octaves[l] = octave(TAU / k.max(1e-6)) as i32;
                highest[l] = highest[l].max(amplitude);
                others |= octaves[l] ^ seen.octave[l];
            }
            *out = [out[0] + sum(&heights), out[1] + sum(&slopes), out[2] + sum(&curvatures)];
            if others == 0 {
                seen.highest = highest;
            } else {
                // Seldom: waves keep their lengths from cell to cell.
                seen.note(&mut by_length[block * LANES..]);
                *seen = Lengths { octave: octaves, highest: heights };
            }
        }
    }
    for (block, seen) in lengths.iter_mut().enumerate() {
        seen.note(&mut by_length[block * LANES..]);
        *seen = Lengths::NONE;
    }
}

/// Bounds of a cell, from what the waves can be there.
#[inline(always)]
fn bound(sea: &ShoreSea, corners: [Option<usize>; 4], [height, slope, curvature]: [f32; 3], b: &mut Bounds) {
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
