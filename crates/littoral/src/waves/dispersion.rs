//! Dispersion: how fast waves of each length run over still water.
//!
//! ω² = (g k + τ k³) tanh(k h), with gravity g, depth h and kinematic surface tension τ (H. Lamb, *Hydrodynamics*, 6th edition,
//! 1932, §§ 228–229, 266–267). The inverse starts from k∞ / √tanh(k∞ h) (C. Eckart, 1952, in D. Peachey's form of 1986), which is at
//! most 5 % too small, and is polished by Newton's method to the last bits of an `f64`.

use super::OutOfRange;
use libm::{cosh, sinh, sqrt, tanh};

/// Standard gravity (m/s²).
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// Surface tension of clean sea water at 15 °C over its density (m³/s²): 0.0735 N/m over 1026 kg/m³.
pub const SURFACE_TENSION: f64 = 7.16e-5;

/// Still water, as waves feel it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillWater {
    /// Depth (m), above 0; infinity for deep water.
    pub depth: f64,
    /// Gravity (m/s²), above 0.
    pub gravity: f64,
    /// Surface tension over density (m³/s²), at least 0; matters below wavelengths of some 5 cm.
    pub surface_tension: f64,
}

impl StillWater {
    /// Endless depth, standard gravity, no surface tension.
    pub const DEEP: StillWater = StillWater { depth: f64::INFINITY, gravity: STANDARD_GRAVITY, surface_tension: 0.0 };

    /// Water of a depth (m) under standard gravity, without surface tension.
    ///
    /// # Errors
    /// If `depth` is not above 0.
    pub fn of_depth(depth: f64) -> Result<StillWater, OutOfRange> {
        StillWater { depth, ..StillWater::DEEP }.checked()
    }

    /// The same water if its numbers make sense.
    ///
    /// # Errors
    /// If depth or gravity are not above 0, gravity is endless, or surface tension is negative.
    pub fn checked(self) -> Result<StillWater, OutOfRange> {
        OutOfRange::unless(self.depth > 0.0, "depth", "a number of metres above 0", self.depth)?;
        let gravity = self.gravity > 0.0 && self.gravity < f64::INFINITY;
        OutOfRange::unless(gravity, "gravity", "a number of m/s² above 0", self.gravity)?;
        let tension = self.surface_tension >= 0.0 && self.surface_tension < f64::INFINITY;
        OutOfRange::unless(tension, "surface tension", "a number of m³/s², at least 0", self.surface_tension)?;
        Ok(self)
    }

    /// Angular frequency (rad/s) of waves of a wave number (rad/m, at least 0).
    pub fn angular_frequency(&self, wavenumber: f64) -> f64 {
        let k = wavenumber;
        sqrt(k * (self.gravity + self.surface_tension * k * k) * depth_factor(k * self.depth))
    }

    /// Wave number (rad/m) of waves of an angular frequency (rad/s, at least 0): the inverse of
    /// [`StillWater::angular_frequency`], to a relative error of 1e-14.
    pub fn wavenumber(&self, angular_frequency: f64) -> f64 {
        let square = angular_frequency * angular_frequency;
        let deep = square / self.gravity;
        if deep.is_nan() || deep <= 0.0 {
            return 0.0;
        }
        let mut k = if self.depth.is_finite() { deep / sqrt(tanh(deep * self.depth)) } else { deep };
        if self.surface_tension > 0.0 {
            // Tension quickens: the wave number lies below both the one without gravity and (nearly) the one without tension.
            k = k.min(1.1 * libm::cbrt(square / self.surface_tension));
        }
        // Newton's method on ln ω² over ln k, which is nearly straight at both ends.
        for _ in 0..40 {
            let excess = libm::log(self.angular_frequency(k) / angular_frequency);
            let steepness = self.group_speed(k) / self.phase_speed(k);
            let step = excess / steepness;
            k *= libm::exp(-step);
            if step.abs() < 1e-15 {
                break;
            }
        }
        k
    }

    /// Speed of the crests (m/s) of waves of a wave number (rad/m, above 0).
    pub fn phase_speed(&self, wavenumber: f64) -> f64 {
        self.angular_frequency(wavenumber) / wavenumber
    }

    /// Speed of the energy (m/s), dω/dk, of waves of a wave number (rad/m, above 0).
    pub fn group_speed(&self, wavenumber: f64) -> f64 {
        let (k, h) = (wavenumber, self.depth);
        let pull = self.gravity + self.surface_tension * k * k;
        let bend = 2.0 * self.surface_tension * k * k;
        // d ln(tanh kh) / d ln k, which fades out in deep water.
        let feels = if k * h < 300.0 { 2.0 * k * h / sinh(2.0 * k * h) } else { 0.0 };
        0.5 * self.phase_speed(k) * (1.0 + bend / pull + feels)
    }

    /// How much of the motion at the surface is left at a height (m, at most 0, counted from still water): of the sideways
    /// part, cosh(k(z+h)) / sinh(kh), and of the upright part, sinh(k(z+h)) / sinh(kh). Zero below the bed.
    pub fn motion_below(&self, wavenumber: f64, height: f64) -> (f64, f64) {
        let (k, h, z) = (wavenumber, self.depth, height.min(0.0));
        if z < -h {
            return (0.0, 0.0);
        }
        if k * h > 300.0 {
            let left = libm::exp(k * z);
            return (left, left);
        }
        let across = sinh(k * h);
        (cosh(k * (z + h)) / across, sinh(k * (z + h)) / across)
    }
}

/// tanh(kh), by which depth slows waves.
fn depth_factor(kh: f64) -> f64 {
    if kh > 20.0 { 1.0 } else { tanh(kh) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_is_exact_at_every_depth_and_length() {
        for tension in [0.0, SURFACE_TENSION] {
            for depth in [1e-3, 0.01, 0.3, 2.0, 17.0, 400.0, 1e5, f64::INFINITY] {
                let water = StillWater { depth, surface_tension: tension, ..StillWater::DEEP };
                for exponent in -60..60 {
                    let k = libm::pow(10.0, f64::from(exponent) / 15.0);
                    let back = water.wavenumber(water.angular_frequency(k));
                    assert!((back / k - 1.0).abs() < 1e-12, "h {depth}, k {k}: {back}");
                }
            }
        }
        assert_eq!(StillWater::DEEP.wavenumber(0.0), 0.0);
    }

    #[test]
    fn speeds_have_their_known_limits() {
        let deep = StillWater::DEEP;
        assert!((deep.group_speed(0.3) / deep.phase_speed(0.3) - 0.5).abs() < 1e-15);
        let shallow = StillWater::of_depth(0.5).expect("wet");
        assert!((shallow.phase_speed(1e-4) / libm::sqrt(0.5 * STANDARD_GRAVITY) - 1.0).abs() < 1e-8);
        assert!((shallow.group_speed(1e-4) / shallow.phase_speed(1e-4) - 1.0).abs() < 1e-8);
        // Group speed is the derivative of frequency.
        let water = StillWater { depth: 3.0, surface_tension: SURFACE_TENSION, ..StillWater::DEEP };
        for k in [0.05, 0.4, 2.0, 30.0, 900.0] {
            let d = 1e-5 * k;
            let slope = (water.angular_frequency(k + d) - water.angular_frequency(k - d)) / (2.0 * d);
            assert!((water.group_speed(k) / slope - 1.0).abs() < 1e-8, "k {k}");
        }
        // The slowest ripples run 23 cm/s and are 1.7 cm long (Lamb § 267).
        let ripples = StillWater { surface_tension: SURFACE_TENSION, ..StillWater::DEEP };
        let slowest = (200..800).map(|k| ripples.phase_speed(f64::from(k))).fold(f64::INFINITY, f64::min);
        assert!((slowest - 0.230).abs() < 0.003, "{slowest}");
    }

    #[test]
    fn nonsense_is_refused() {
        for depth in [0.0, -1.0, f64::NAN] {
            assert!(StillWater::of_depth(depth).is_err(), "{depth}");
        }
        assert!(StillWater { gravity: f64::NAN, ..StillWater::DEEP }.checked().is_err());
        assert!(StillWater { surface_tension: -1.0, ..StillWater::DEEP }.checked().is_err());
    }

    #[test]
    fn motion_dies_out_downward() {
        let water = StillWater::of_depth(10.0).expect("wet");
        let (sideways, upright) = water.motion_below(0.5, 0.0);
        assert!((upright - 1.0).abs() < 1e-15 && sideways > 1.0);
        assert_eq!(water.motion_below(0.5, -10.0).1, 0.0);
        assert_eq!(water.motion_below(0.5, -10.1), (0.0, 0.0));
        let (a, b) = StillWater::DEEP.motion_below(0.5, -2.0);
        assert!((a - libm::exp(-1.0)).abs() < 1e-15 && a == b);
    }
}
