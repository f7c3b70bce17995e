//! A directional spectrum that a buoy measured.
//!
//! A buoy that heaves, pitches and rolls gives, besides the energy of each frequency, the first two Fourier coefficients of its
//! directions. The directions themselves follow by the maximum entropy method (A. Lygre and H. Krogstad, "Maximum entropy estimation of the directional
//! distribution in ocean wave spectra", J. Phys. Oceanography 16, 1986): never negative, and with exactly those coefficients.

use super::OutOfRange;
use libm::{cos, sin};
use std::f64::consts::TAU;

/// Energy by frequency, each with its directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    bands: Vec<Band>,
}

/// What a buoy tells about one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// The frequency (Hz).
    pub frequency: f64,
    /// Energy density (m²/Hz).
    pub density: f64,
    /// First Fourier coefficient of the directions: cosine and sine part, of length at most 1. Directions are those *towards* which waves run
    /// (rad, counter-clockwise from x).
    pub first: [f64; 2],
    /// Second Fourier coefficient.
    pub second: [f64; 2],
}

impl Band {
    /// A band from NDBC's numbers: mean and principal direction *from* which waves come (rad, clockwise from north) and their
    /// strengths r₁, r₂ in [0, 1].
    pub fn of_bearings(frequency: f64, density: f64, mean: f64, principal: f64, r1: f64, r2: f64) -> Band {
        let heading = |bearing: f64| -0.25 * TAU - bearing;
        let (one, two) = (heading(mean), 2.0 * heading(principal));
        Band { frequency, density, first: [r1 * cos(one), r1 * sin(one)], second: [r2 * cos(two), r2 * sin(two)] }
    }
}

impl Measured {
    /// A spectrum of bands.
    ///
    /// # Errors
    /// If there are fewer than two bands, frequencies are not above 0 and rising, or a density is negative or not a number.
    pub fn new(bands: Vec<Band>) -> Result<Measured, OutOfRange> {
        let count = bands.len() as f64;
        OutOfRange::unless(bands.len() >= 2, "measured spectrum", "at least 2 frequencies", count)?;
        let mut before = 0.0;
        for band in &bands {
            let rises = band.frequency > before && band.frequency < 1e3;
            OutOfRange::unless(rises, "frequency", "rising frequencies (Hz) above 0", band.frequency)?;
            before = band.frequency;
            let fine = band.density >= 0.0 && band.density < 1e6;
            OutOfRange::unless(fine, "energy density", "m²/Hz, at least 0", band.density)?;
            let finite = band.first.iter().chain(&band.second).all(|c| c.is_finite());
            OutOfRange::unless(finite, "direction", "finite Fourier coefficients", f64::NAN)?;
        }
        Ok(Measured { bands })
    }

    /// The same with all directions turned counter-clockwise by an angle (rad).
    pub fn turned(&self, angle: f64) -> Measured {
        let turn = |c: [f64; 2], by: f64| times(c, [cos(by), sin(by)]);
        let turned = |b: &Band| Band { first: turn(b.first, angle), second: turn(b.second, 2.0 * angle), ..*b };
        Measured { bands: self.bands.iter().map(turned).collect() }
    }

    /// The bands, by rising frequency.
    pub fn bands(&self) -> &[Band] {
        &self.bands
    }

    /// Energy density (m²/Hz) at a frequency (Hz): straight lines between the bands, 0 below them, and above a tail that falls with f⁻⁵.
    pub fn density(&self, frequency: f64) -> f64 {
        let (first, last) = (&self.bands[0], &self.bands[self.bands.len() - 1]);
        if frequency.is_nan() || frequency < first.frequency {
            return 0.0;
        }
        if frequency >= last.frequency {
            let ratio = last.frequency / frequency;
            return last.density * ratio * ratio * ratio * ratio * ratio;
        }
        let above = self.bands.partition_point(|b| b.frequency <= frequency);
        let (a, b) = (&self.bands[above - 1], &self.bands[above]);
        let share = (frequency - a.frequency) / (b.frequency - a.frequency);
        a.density + (b.density - a.density) * share
    }

    /// The directions of a frequency (Hz): those of the band next to it.
    pub fn directions(&self, frequency: f64) -> Entropy {
        let above = self.bands.partition_point(|b| b.frequency <= frequency).min(self.bands.len() - 1);
        let below = above.saturating_sub(1);
        let middle = 0.5 * (self.bands[below].frequency + self.bands[above].frequency);
        let band = &self.bands[if frequency < middle { below } else { above }];
        Entropy::new(band.first, band.second)
    }

    /// The frequency that holds most (Hz).
    pub fn peak(&self) -> f64 {
        let most = |a: &&Band, b: &&Band| a.density.total_cmp(&b.density);
        self.bands.iter().max_by(most).map_or(0.1, |b| b.frequency)
    }
}

/// A distribution over directions of greatest entropy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entropy {
    numerator: f64,
    one: [f64; 2],
    two: [f64; 2],
}

/// Product of two complex numbers.
fn times(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn conjugate(a: [f64; 2]) -> [f64; 2] {
    [a[0], -a[1]]
}

fn square(a: [f64; 2]) -> f64 {
    a[0] * a[0] + a[1] * a[1]
}

impl Entropy {
    /// From the first two Fourier coefficients ∫ D e^{inθ} dθ. Coefficients that no distribution has (buoys round them) are drawn in to the
    /// nearest that one may have.
    pub fn new(first: [f64; 2], second: [f64; 2]) -> Entropy {
        let strength = libm::sqrt(square(first));
        let c1 = if strength > 0.98 { first.map(|c| c * 0.98 / strength) } else { first };
        // A distribution exists where |c₂ − c₁²| ≤ 1 − |c₁|².
        let (free, own) = (1.0 - square(c1), times(c1, c1));
        let off = [second[0] - own[0], second[1] - own[1]];
        let length = libm::sqrt(square(off));
        let keep = if length > 0.95 * free { 0.95 * free / length } else { 1.0 };
        let c2 = [own[0] + off[0] * keep, own[1] + off[1] * keep];
        let back = times(c2, conjugate(c1));
        let one = [(c1[0] - back[0]) / free, (c1[1] - back[1]) / free];
        let forth = times(c1, one);
        let two = [c2[0] - forth[0], c2[1] - forth[1]];
        let numerator = 1.0 - times(one, conjugate(c1))[0] - times(two, conjugate(c2))[0];
        Entropy { numerator: numerator / TAU, one, two }
    }

    /// Density (1/rad) in a direction (rad).
    pub fn density(&self, direction: f64) -> f64 {
        let (c, s) = (cos(direction), sin(direction));
        let (once, twice) = (times(self.one, [c, -s]), times(self.two, [c * c - s * s, -2.0 * s * c]));
        self.numerator / square([1.0 - once[0] - twice[0], -once[1] - twice[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_the_measured_coefficients() {
        for (first, second) in
            [([0.0, 0.0], [0.0, 0.0]), ([0.5, 0.2], [0.3, 0.1]), ([-0.7, 0.5], [0.2, -0.6]), ([0.3, 0.0], [-0.4, 0.3])]
        {
            let directions = Entropy::new(first, second);
            let steps = 4000;
            let angle = |i: i32| TAU * f64::from(i) / f64::from(steps);
            let mean = |n: f64, part: fn(f64) -> f64| {
                (0..steps).map(|i| directions.density(angle(i)) * part(n * angle(i))).sum::<f64>() * TAU
                    / f64::from(steps)
            };
            assert!((mean(0.0, cos) - 1.0).abs() < 1e-9);
            assert!((mean(1.0, cos) - first[0]).abs() < 1e-9 && (mean(1.0, sin) - first[1]).abs() < 1e-9);
            assert!((mean(2.0, cos) - second[0]).abs() < 1e-9 && (mean(2.0, sin) - second[1]).abs() < 1e-9);
            assert!((0..steps).all(|i| directions.density(angle(i)) > 0.0));
        }
    }

    #[test]
    fn impossible_coefficients_still_give_a_distribution() {
        for (first, second) in [([1.0, 0.0], [1.0, 0.0]), ([0.9, 0.0], [-1.0, 0.0]), ([1.3, 1.0], [0.0, 5.0])] {
            let directions = Entropy::new(first, second);
            let sum: f64 = (0..20_000).map(|i| directions.density(f64::from(i) * TAU / 2e4)).sum::<f64>() * TAU / 2e4;
            assert!((sum - 1.0).abs() < 1e-3, "{sum}");
        }
    }

    #[test]
    fn bearings_become_headings() {
        // From the west: towards x.
        let band = Band::of_bearings(0.1, 1.0, 1.5 * TAU / 2.0, 1.5 * TAU / 2.0, 0.9, 0.6);
        assert!((band.first[0] - 0.9).abs() < 1e-12 && band.first[1].abs() < 1e-12);
        assert!((band.second[0] - 0.6).abs() < 1e-12);
    }

    #[test]
    fn turning_turns_directions() {
        let band = |frequency| Band { frequency, density: 1.0, first: [0.6, 0.1], second: [0.3, -0.2] };
        let sea = Measured::new(vec![band(0.1), band(0.2)]).expect("fine");
        let turned = sea.turned(0.8);
        for direction in [0.0, 1.0, 4.0] {
            let (a, b) = (sea.directions(0.1).density(direction), turned.directions(0.1).density(direction + 0.8));
            assert!((a / b - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn broken_measurements_are_refused() {
        let band = |frequency, density| Band { frequency, density, first: [0.0; 2], second: [0.0; 2] };
        assert!(Measured::new(vec![band(0.1, 1.0)]).is_err());
        assert!(Measured::new(vec![band(0.1, 1.0), band(0.1, 1.0)]).is_err());
        assert!(Measured::new(vec![band(0.1, 1.0), band(0.2, -1.0)]).is_err());
        assert!(Measured::new(vec![band(0.1, 1.0), band(0.2, f64::NAN)]).is_err());
        let sea = Measured::new(vec![band(0.1, 1.0), band(0.2, 3.0)]).expect("fine");
        assert_eq!((sea.density(0.05), sea.density(0.4)), (0.0, 3.0 / 32.0));
        assert!((sea.density(0.15) - 2.0).abs() < 1e-12);
        assert_eq!(sea.peak(), 0.2);
    }
}
