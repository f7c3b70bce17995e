//! Invented heights: gradient noise and its fractal sums, in two dimensions, with exact derivatives and true bounds.
//!
//! Gradient noise places a random unit gradient on every point of the integer lattice and blends the four planes around a
//! point with a quintic whose first and second derivatives vanish on the lattice, so that slopes and curvatures are
//! continuous. A hash of the lattice point picks the gradient: nothing repeats and no table is needed. Fractal sums add
//! octaves of rising frequency and falling amplitude; *eroded* sums damp octaves where the slope gathered so far is steep,
//! which leaves smooth valleys under rough crests.
//!
//! Works this rests on: K. Perlin, "Improving noise", SIGGRAPH 2002; B. Mandelbrot, *The fractal geometry of nature*, 1982;
//! F. K. Musgrave et al., "The synthesis and rendering of eroded fractal terrains", SIGGRAPH 1989.

use super::{HeightField, HeightRange};
use crate::space::{Cell, Datum, Place};
use glam::DVec2;
use std::f64::consts::FRAC_PI_4;

/// A value and its gradient at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// The value.
    pub value: f64,
    /// Its derivatives along x and y.
    pub gradient: DVec2,
}

/// The greatest absolute value that [`gradient`] takes: 1/√2, reached in the middle of a cell whose four gradients all
/// point at it.
pub const PEAK: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Gradient noise of unit frequency at `at`: values in [−[`PEAK`], [`PEAK`]], zero on lattice points, with its exact
/// derivatives. Equal seeds give equal bits on every platform.
pub fn gradient(at: DVec2, seed: u32) -> Sample {
    let floor = at.floor();
    let cell = (floor.x as i64, floor.y as i64);
    let f = at - floor;
    // The quintic 6t⁵ − 15t⁴ + 10t³ and its derivative.
    let u = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let du = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    let corner = |i: i64, j: i64| {
        let g = lattice_gradient(cell.0.wrapping_add(i), cell.1.wrapping_add(j), seed);
        (g, g.dot(f - DVec2::new(i as f64, j as f64)))
    };
    let ((ga, a), (gb, b), (gc, c), (gd, d)) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
    let twist = a - b - c + d;
    let value = a + u.x * (b - a) + u.y * (c - a) + u.x * u.y * twist;
    let planes = ga + u.x * (gb - ga) + u.y * (gc - ga) + u.x * u.y * (ga - gb - gc + gd);
    let blend = du * DVec2::new(b - a + u.y * twist, c - a + u.x * twist);
    Sample { value, gradient: planes + blend }
}

/// A pseudo-random unit vector for a lattice point.
fn lattice_gradient(x: i64, y: i64, seed: u32) -> DVec2 {
    // Two rounds of a 64-bit multiply-xorshift mix (the constants of Stafford's thirteenth mixer).
    let mut h = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ u64::from(seed).wrapping_mul(0x1656_67B1_9E37_79F9);
    h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    h ^= h >> 31;
    // A point of the circle without trigonometry, so that every platform agrees: rational parametrisation by quarters.
    let t = (h >> 34) as f64 / (1u64 << 30) as f64 * 2.0 - 1.0;
    // Equal steps of t bunch up angles by at most 2:1; a cubic evens them out to a few per cent.
    let t = t * (FRAC_PI_4 + (1.0 - FRAC_PI_4) * t * t);
    let (c, s) = ((1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t));
    match h & 1 {
        0 => DVec2::new(c, s),
        _ => DVec2::new(-c, s),
    }
}

/// A fractal sum of gradient noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fbm {
    /// Wavelength of the first octave (m).
    pub wavelength: f64,
    /// Amplitude of the first octave (m); its values reach [`PEAK`] times this.
    pub amplitude: f64,
    /// Number of octaves.
    pub octaves: u32,
    /// Ratio of frequencies of neighbouring octaves, at least 1; not an integer, lest lattice zeros line up.
    pub lacunarity: f64,
    /// Ratio of amplitudes of neighbouring octaves, in [0, 1].
    pub gain: f64,
    /// Which noise.
    pub seed: u32,
}

impl Fbm {
    /// A sum with the usual ratios: frequencies about doubling, amplitudes halving.
    pub const fn new(wavelength: f64, amplitude: f64, octaves: u32, seed: u32) -> Fbm {
        Fbm { wavelength, amplitude, octaves, lacunarity: 1.97, gain: 0.5, seed }
    }

    /// Value (m) and gradient at `at` (m).
    pub fn at(&self, at: DVec2) -> Sample {
        let mut sum = Sample::default();
        for (octave, frequency, amplitude) in self.bands() {
            let noise = gradient(octave_position(at, octave, frequency), self.seed.wrapping_add(octave));
            sum.value += amplitude * noise.value;
            sum.gradient += amplitude * frequency * unrotate(noise.gradient, octave);
        }
        sum
    }

    /// Octave number, frequency (1/m) and amplitude (m) of each octave.
    fn bands(&self) -> impl Iterator<Item = (u32, f64, f64)> {
        let first = (1.0 / self.wavelength, self.amplitude);
        let (lacunarity, gain) = (self.lacunarity, self.gain);
        (0..self.octaves).scan(first, move |(frequency, amplitude), octave| {
            let band = (octave, *frequency, *amplitude);
            *frequency *= lacunarity;
            *amplitude *= gain;
            Some(band)
        })
    }

    /// A bound on the absolute value (m).
    pub fn peak(&self) -> f64 {
        self.bands().map(|(_, _, amplitude)| amplitude.abs() * PEAK).sum()
    }

    /// A bound on the length of the gradient.
    pub fn steepest(&self) -> f64 {
        self.bands().map(|(_, frequency, amplitude)| amplitude.abs() * frequency * STEEPEST).sum()
    }

    /// A bound on the second derivative along any direction (1/m).
    fn most_curved(&self) -> f64 {
        self.bands().map(|(_, frequency, amplitude)| amplitude.abs() * frequency * frequency * MOST_CURVED).sum()
    }
}

/// A bound on the gradient's length of [`gradient`], and on its second derivatives: twice what a dense search over
/// random cells finds (2.04 and 7.98), since the worst arrangement of four gradients may not be among those searched.
const STEEPEST: f64 = 4.0;
const MOST_CURVED: f64 = 20.0;

/// Octaves are turned against each other by the angle whose cosine is 0.8, so that their lattices do not line up.
fn octave_position(at: DVec2, octave: u32, frequency: f64) -> DVec2 {
    let mut p = at * frequency;
    for _ in 0..octave % 8 {
        p = DVec2::new(0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y);
    }
    p + f64::from(octave) * DVec2::new(17.31, 5.77)
}

fn unrotate(gradient: DVec2, octave: u32) -> DVec2 {
    let mut g = gradient;
    for _ in 0..octave % 8 {
        g = DVec2::new(0.8 * g.x + 0.6 * g.y, -0.6 * g.x + 0.8 * g.y);
    }
    g
}

/// Fractal noise as ground: a height field on a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseField {
    /// The heights.
    pub fbm: Fbm,
    /// South-west corner of the plane (m).
    pub origin: DVec2,
    /// Side lengths of the plane (m).
    pub size: DVec2,
}

impl NoiseField {
    fn position(&self, at: Place) -> DVec2 {
        self.origin + at.uv * self.size
    }
}

impl HeightField for NoiseField {
    fn datum(&self) -> Datum {
        Datum::Plane { origin: self.origin, size: self.size }
    }

    fn height(&self, at: Place) -> Option<f32> {
        Some(self.fbm.at(self.position(at)).value as f32)
    }

    /// From the middle's value each octave can rise by its slope bound over half the cell's diagonal, and never beyond its peak.
    fn range(&self, cell: Cell) -> HeightRange {
        let reach = 0.5 * (cell.side() * self.size).length();
        let middle = self.position(cell.centre());
        let (mut low, mut high) = (0.0, 0.0);
        for (octave, frequency, amplitude) in self.fbm.bands() {
            let value = gradient(octave_position(middle, octave, frequency), self.fbm.seed.wrapping_add(octave)).value;
            let rise = STEEPEST * frequency * reach;
            let (a, b) = ((value - rise).max(-PEAK) * amplitude, (value + rise).min(PEAK) * amplitude);
            low += a.min(b);
            high += a.max(b);
        }
        // One f32 step outward pays for the rounding of `height`.
        HeightRange { low: (low as f32).next_down(), high: (high as f32).next_up() }
    }

    /// The error of linear interpolation is at most curvature × diagonal² / 8, and at most twice the field's peak.
    fn error(&self, cell: Cell) -> f32 {
        let diagonal = (cell.side() * self.size).length();
        let smooth = self.fbm.most_curved() * diagonal * diagonal / 8.0;
        (smooth.min(2.0 * self.fbm.peak()) as f32).next_up()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn constants_hold_over_a_dense_search() {
        let (mut peak, mut steepest, mut curved) = (0.0f64, 0.0f64, 0.0f64);
        for i in 0..400_000u32 {
            let at = DVec2::new(f64::from(i) * 0.754_877_666, f64::from(i) * 0.569_840_29);
            let s = gradient(at, i >> 10);
            peak = peak.max(s.value.abs());
            steepest = steepest.max(s.gradient.length());
            let step = 1e-4;
            let along = gradient(at + DVec2::X * step, i >> 10).gradient - s.gradient;
            curved = curved.max(along.length() / step);
        }
        assert!(peak <= PEAK && peak > 0.6, "peak {peak}");
        assert!(steepest * 1.5 < STEEPEST, "steepest {steepest}");
        assert!(curved * 1.5 < MOST_CURVED, "curved {curved}");
    }

    #[test]
    fn noise_is_the_same_on_every_platform() {
        // Only +, −, ×, ÷ and floor are used, which IEEE 754 fixes to the bit.
        let s = gradient(DVec2::new(12.34, -56.78), 9);
        assert_eq!(s, gradient(DVec2::new(12.34, -56.78), 9));
        assert_ne!(s, gradient(DVec2::new(12.34, -56.78), 10));
        assert_eq!(gradient(DVec2::new(3.0, -7.0), 1).value, 0.0);
    }

    proptest! {
        #[test]
        fn derivatives_match_differences(x in -1e4..1e4, y in -1e4..1e4, seed: u32) {
            let (fbm, at) = (Fbm::new(100.0, 30.0, 7, seed), DVec2::new(x, y));
            let (s, step) = (fbm.at(at), 1e-5);
            let difference = |by: DVec2| (fbm.at(at + by * step).value - fbm.at(at - by * step).value) / (2.0 * step);
            prop_assert!((difference(DVec2::X) - s.gradient.x).abs() < 1e-4);
            prop_assert!((difference(DVec2::Y) - s.gradient.y).abs() < 1e-4);
            prop_assert!(s.value.abs() <= fbm.peak() && s.gradient.length() <= fbm.steepest());
        }
    }
}
