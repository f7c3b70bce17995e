//! How far a sea over a bed can go anywhere: the sum of what each wave can at the worst phase, cell by cell.

use super::lanes::LANES;
use super::march::UNITS;
use super::shape::{self, Place};
use super::{BINS, Bounds, ShoreSea};
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

/// Finds the bounds of a sea.
pub(super) fn measure(sea: &mut ShoreSea) {
    let none = Most { bounds: Bounds::default(), by_length: vec![[0.0; BINS]; sea.components.len()] };
    let most = (0..sea.rows)
        .into_par_iter()
        .fold(
            || none.clone(),
            |mut most, row| {
                (0..sea.columns).for_each(|column| cell(sea, column, row, &mut most));
                most
            },
        )
        .reduce(|| none.clone(), Most::join);
    (sea.bounds, sea.by_length) = (most.bounds, most.by_length);
}

/// One cell; those beyond the last node are the open sea's.
fn cell(sea: &ShoreSea, column: usize, row: usize, most: &mut Most) {
    let (dx, dy) = (sea.spacing.x as f32, sea.spacing.y as f32);
    let corners = [(column, row), (column + 1, row), (column, row + 1), (column + 1, row + 1)]
        .map(|(c, r)| (c < sea.columns && r < sea.rows).then_some(r * sea.columns + c));
    let (mut height, mut slope, mut curvature) = (0.0f32, 0.0f32, 0.0f32);
    for (n, component) in sea.components.iter().enumerate() {
        let [a, b, d, e] = corners.map(|i| {
            i.map_or((0i16, UNITS as u16), |i| {
                let record = &sea.records[i * sea.blocks + n / LANES];
                (record.phase[n % LANES], record.amplitude[n % LANES])
            })
        });
        let units = a.1.max(b.1).max(d.1).max(e.1);
        if units == 0 {
            continue;
        }
        let scale = component.amplitude / UNITS;
        let amplitude = f32::from(units) * scale;
        let turn = |a: i16, b: i16| f32::from(b.wrapping_sub(a)) / 65_536.0;
        let greatest = |p: f32, q: f32, open: f64, step: f32| {
            let open = open as f32;
            (open + p / step).abs().max((open + q / step).abs()) * TAU
        };
        let kx = greatest(turn(a.0, b.0), turn(d.0, e.0), component.turns.x, dx);
        let ky = greatest(turn(a.0, d.0), turn(b.0, e.0), component.turns.y, dy);
        let k = (kx * kx + ky * ky).sqrt();
        let fall = |p: u16, q: u16| (f32::from(p) - f32::from(q)).abs() * scale;
        let changes = fall(a.1, b.1).max(fall(d.1, e.1)) / dx + fall(a.1, d.1).max(fall(b.1, e.1)) / dy;
        height += amplitude;
        slope += amplitude * k + changes;
        curvature += amplitude * k * k + 2.0 * changes * k;
        let bin = octave(TAU / k.max(1e-6));
        let seen = &mut most.by_length[n][bin];
        *seen = seen.max(amplitude);
    }
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
    let own = Bounds {
        height: height * shape::highest(r) + 0.25 * greatest(Place::HEIGHT) * r,
        sideways: height * sideways,
        slope: slope * bend + changing + spread(Place::HEIGHT),
        stretch: slope * sideways + height * spread(Place::SIDEWAYS),
        bend: curvature * sideways + 2.0 * slope * spread(Place::SIDEWAYS),
        curvature: curvature * bend + if r > 1e-3 { 6.0 * r * slope * slope / soft.max(1e-3) } else { 0.0 },
    };
    let b = &mut most.bounds;
    b.height = b.height.max(own.height);
    b.sideways = b.sideways.max(own.sideways);
    b.slope = b.slope.max(own.slope);
    b.stretch = b.stretch.max(own.stretch);
    b.curvature = b.curvature.max(own.curvature);
    b.bend = b.bend.max(own.bend);
}

/// The bin of a wavelength (m).
fn octave(wavelength: f32) -> usize {
    // The exponent of a float is the integral part of its binary logarithm.
    let exponent = ((wavelength.to_bits() >> 23) & 0xFF) as i32 - 127;
    (exponent + 1).clamp(0, BINS as i32 - 1) as usize
}
