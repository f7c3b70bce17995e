//! Frequency spectra of the sea: how much energy waves of each frequency hold.
//!
//! One family serves: `S(f) = α g² (2π)⁻⁴ f⁻⁵ exp(−5/4 (f_p/f)⁴) γ^b φ(f)`, with `b = exp(−(f−f_p)² / (2σ²f_p²))`. With γ = 1 it is
//! W. Pierson and L. Moskowitz's spectrum of a full-grown sea (1964), with γ > 1 that of the JONSWAP experiment for a growing one
//! (K. Hasselmann et al., 1973), and with φ, S. Kitaigorodskii's factor of finite depth, the TMA spectrum (E. Bouws et al., 1985).

use super::OutOfRange;
use super::dispersion::{STANDARD_GRAVITY, StillWater};
use libm::{exp, log, pow, sinh, sqrt, tanh};
use std::f64::consts::TAU;

/// A frequency spectrum of the JONSWAP family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum {
    /// Level of the tail, α.
    pub alpha: f64,
    /// Frequency of the peak (Hz).
    pub peak: f64,
    /// How much the peak stands out, γ: 1 for a full-grown sea, 3.3 for a growing one.
    pub gamma: f64,
    /// Water in which waves break by depth (m): TMA; infinity for none.
    pub depth: f64,
}

/// M. Phillips' constant, the level of the tail of a full-grown sea.
const PHILLIPS: f64 = 0.0081;
/// Gravity in all spectra that are given by wind (m/s²).
const G: f64 = STANDARD_GRAVITY;
/// Strongest wind (m/s at 10 m) a spectrum is made for; the strongest gust ever measured is 113.
const STRONGEST_WIND: f64 = 120.0;

impl Spectrum {
    /// The full-grown sea under a wind of `speed` (m/s, 10 m above the sea): Pierson and Moskowitz, with f_p = 0.13 g / U₁₀.
    ///
    /// # Errors
    /// If the speed is not above 0 and at most 120.
    pub fn pierson_moskowitz(speed: f64) -> Result<Spectrum, OutOfRange> {
        check_wind(speed)?;
        Ok(Spectrum { alpha: PHILLIPS, peak: 0.13 * G / speed, gamma: 1.0, depth: f64::INFINITY })
    }

    /// The full-grown sea of a significant height (m): `S(ω) = 0.78/ω⁵ exp(−3.11 / (ω⁴ H²))`, as in S. Liu, X. Xu and C. Chen 2009.
    ///
    /// # Errors
    /// If the height is not above 0 and at most 100.
    pub fn pierson_moskowitz_of_height(height: f64) -> Result<Spectrum, OutOfRange> {
        check_height(height)?;
        let peak = sqrt(sqrt(4.0 * 3.11 / 5.0) / height) / TAU;
        Ok(Spectrum { alpha: 0.78 / (G * G), peak, gamma: 1.0, depth: f64::INFINITY })
    }

    /// A sea that has grown over `fetch` (m) under a wind of `speed` (m/s, 10 m above the sea): JONSWAP, with α = 0.076 (U²/gF)^0.22 and
    /// f_p = 3.5 (g/U) (U²/gF)^⅓, and never beyond the full-grown sea.
    ///
    /// # Errors
    /// If the speed is not above 0 and at most 120, or the fetch not above 0.
    pub fn jonswap(speed: f64, fetch: f64, gamma: f64) -> Result<Spectrum, OutOfRange> {
        check_wind(speed)?;
        OutOfRange::unless(fetch > 0.0, "fetch", "a number of metres above 0", fetch)?;
        check_gamma(gamma)?;
        let youth = speed * speed / (G * fetch);
        let peak = (22.0 / TAU * libm::cbrt(youth)).max(0.13) * G / speed;
        Ok(Spectrum { alpha: (0.076 * pow(youth, 0.22)).max(PHILLIPS), peak, gamma, depth: f64::INFINITY })
    }

    /// A sea of a significant height (m) and peak period (s), normalised by 1 − 0.287 ln γ as in DNV-RP-C205 (2010, § 3.5.5) and
    /// IEC 62600-2: the height it really has differs by up to 0.3 %. [`Spectrum::of_height`] makes it exact.
    ///
    /// # Errors
    /// If the height is not above 0 and at most 100, the period not above 0 and at most 100, or γ not from 1 to 20.
    pub fn of_height_and_period(height: f64, period: f64, gamma: f64) -> Result<Spectrum, OutOfRange> {
        check_height(height)?;
        OutOfRange::unless(period > 0.0 && period <= 100.0, "peak period", "seconds, above 0 and at most 100", period)?;
        check_gamma(gamma)?;
        let peak = 1.0 / period;
        let shape = G * G * pow(TAU, -4.0) * pow(peak, -4.0) / 5.0;
        let alpha = height * height / 16.0 / shape * (1.0 - 0.287 * log(gamma));
        Ok(Spectrum { alpha, peak, gamma, depth: f64::INFINITY })
    }

    /// The peak's γ that DNV-RP-C205 (2010, § 3.5.5.5) gives to a sea of a height (m) and peak period (s): from 1, full-grown, to 5.
    pub fn usual_gamma(height: f64, period: f64) -> f64 {
        exp(5.75 - 1.15 * period / sqrt(height)).clamp(1.0, 5.0)
    }

    /// The wind (m/s, 10 m above the sea) under which a growing sea has this tail and peak: α = 0.033 (f_p U/g)^⅔ (Hasselmann et al. 1973). Swell, lower than
    /// any sea of its period, has next to none.
    pub fn raising_wind(&self) -> f64 {
        G / self.peak * pow(self.alpha / 0.033, 1.5)
    }

    /// The same spectrum in water of a depth (m, above 0): TMA.
    pub fn in_depth(self, depth: f64) -> Spectrum {
        Spectrum { depth, ..self }
    }

    /// The same shape, scaled to have exactly a significant height (m).
    pub fn of_height(self, height: f64) -> Spectrum {
        let ratio = height / self.significant_height();
        Spectrum { alpha: self.alpha * ratio * ratio, ..self }
    }

    /// Energy density S(f) (m²/Hz) at a frequency (Hz): the variance of the surface per unit of frequency. 0 for frequencies not above 0.
    pub fn density(&self, frequency: f64) -> f64 {
        let f = frequency;
        if f.is_nan() || f <= 0.0 || f == f64::INFINITY {
            return 0.0;
        }
        let ratio = self.peak / f;
        let fall = -1.25 * ratio * ratio * ratio * ratio;
        if fall < -700.0 {
            return 0.0;
        }
        let mut density = self.alpha * G * G / (TAU * TAU * TAU * TAU * f * f * f * f * f) * exp(fall);
        if self.gamma != 1.0 {
            let width = if f <= self.peak { 0.07 } else { 0.09 };
            let off = (f - self.peak) / (width * self.peak);
            density *= pow(self.gamma, exp(-0.5 * off * off));
        }
        if self.depth.is_finite() {
            density *= kitaigorodskii(f, self.depth);
        }
        density
    }

    /// The n-th moment ∫ fⁿ S df (m² Hzⁿ) over all frequencies up to 200 times the peak's. Moments above the third
    /// grow without end with that limit.
    pub fn moment(&self, n: i32) -> f64 {
        integrate(|f| pow(f, f64::from(n)) * self.density(f), self.peak / 6.0, self.peak * 200.0)
    }

    /// Significant wave height H_m0 = 4 √m₀ (m).
    pub fn significant_height(&self) -> f64 {
        4.0 * sqrt(self.moment(0))
    }

    /// Period of the peak (s).
    pub fn peak_period(&self) -> f64 {
        1.0 / self.peak
    }

    /// Mean period m₀ / m₁ (s).
    pub fn mean_period(&self) -> f64 {
        self.moment(0) / self.moment(1)
    }

    /// Mean period between upward crossings of still water, √(m₀ / m₂) (s).
    pub fn crossing_period(&self) -> f64 {
        sqrt(self.moment(0) / self.moment(2))
    }
}

/// Kitaigorodskii's factor: what is left of a deep sea's energy at a frequency (Hz) in water of a depth (m), in [0, 1]:
/// tanh²(kh) / (1 + 2kh / sinh 2kh) with the exact wave number (E. Bouws et al. 1985, equation 5).
pub fn kitaigorodskii(frequency: f64, depth: f64) -> f64 {
    let water = StillWater { depth, ..StillWater::DEEP };
    let kh = water.wavenumber(TAU * frequency) * depth;
    if kh > 300.0 {
        return 1.0;
    }
    let t = tanh(kh);
    t * t / (1.0 + 2.0 * kh / sinh(2.0 * kh))
}

/// ∫ y df over [low, high], both above 0, by Simpson's rule over ln f.
pub(super) fn integrate(y: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    const STEPS: usize = 2000;
    let width = log(high / low) / STEPS as f64;
    let sum: f64 = (0..=STEPS)
        .map(|i| {
            let f = low * exp(width * i as f64);
            let weight = if i == 0 || i == STEPS { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
            weight * f * y(f)
        })
        .sum();
    sum * width / 3.0
}

fn check_wind(speed: f64) -> Result<(), OutOfRange> {
    OutOfRange::unless(speed > 0.0 && speed <= STRONGEST_WIND, "wind", "m/s, above 0 and at most 120", speed)
}

fn check_height(height: f64) -> Result<(), OutOfRange> {
    OutOfRange::unless(height > 0.0 && height <= 100.0, "significant height", "metres, above 0 and at most 100", height)
}

fn check_gamma(gamma: f64) -> Result<(), OutOfRange> {
    OutOfRange::unless((1.0..=20.0).contains(&gamma), "gamma", "a number from 1 to 20", gamma)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_have_their_closed_forms() {
        let sea = Spectrum::pierson_moskowitz(12.0).expect("a wind");
        let closed = sea.alpha * G * G / (5.0 * pow(TAU * sea.peak, 4.0));
        assert!((sea.moment(0) / closed - 1.0).abs() < 1e-6);
        // T_m01 and T_m02 of a Pierson–Moskowitz sea are 0.7718 and 0.7104 peak periods.
        assert!((sea.mean_period() / sea.peak_period() - 0.7718).abs() < 1e-3);
        assert!((sea.crossing_period() / sea.peak_period() - 0.7104).abs() < 1e-3);
    }

    #[test]
    fn the_wind_that_raised_a_sea_is_found_again() {
        for (speed, fetch) in [(5.0, 20e3), (12.0, 100e3), (25.0, 200e3)] {
            let sea = Spectrum::jonswap(speed, fetch, 3.3).expect("a wind");
            // The law between tail and peak rounds the two laws of fetch.
            assert!((sea.raising_wind() / speed - 1.0).abs() < 0.06, "{speed}: {}", sea.raising_wind());
        }
        let swell = Spectrum::of_height_and_period(1.0, 14.0, 3.3).expect("a swell");
        assert!(swell.raising_wind() < 0.1);
    }

    #[test]
    fn the_form_by_height_has_that_height() {
        // Liu, Xu and Chen's constants agree with their height to 0.2 %.
        for height in [0.3, 2.0, 9.0] {
            let sea = Spectrum::pierson_moskowitz_of_height(height).expect("a height");
            assert!((sea.significant_height() / height - 1.0).abs() < 2.5e-3);
            let omega = 1.7 / sqrt(height);
            let direct = 0.78 / pow(omega, 5.0) * exp(-3.11 / (pow(omega, 4.0) * height * height));
            assert!((sea.density(omega / TAU) / TAU / direct - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn heights_can_be_exact() {
        let sea = Spectrum::of_height_and_period(3.0, 9.0, 3.3).expect("a sea");
        assert!((sea.significant_height() / 3.0 - 1.0).abs() < 3e-3);
        assert!((sea.of_height(3.0).significant_height() / 3.0 - 1.0).abs() < 1e-12);
        assert!(sea.in_depth(8.0).significant_height() < 2.6, "depth takes its share");
        assert!((sea.in_depth(1e4).density(0.2) / sea.density(0.2) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_sea_grows_with_fetch_until_it_is_full_grown() {
        let height = |fetch| Spectrum::jonswap(15.0, fetch, 3.3).expect("a sea").significant_height();
        assert!(height(1e4) < height(1e5) && height(1e5) < height(4e5));
        let endless = Spectrum::jonswap(15.0, 1e9, 1.0).expect("a sea");
        assert_eq!(endless, Spectrum::pierson_moskowitz(15.0).expect("a sea"));
    }

    #[test]
    fn nonsense_is_refused_and_named() {
        for wind in [0.0, -3.0, f64::NAN, 1e9] {
            let error = Spectrum::pierson_moskowitz(wind).expect_err("nonsense");
            assert!(error.to_string().starts_with("wind: expected m/s, above 0 and at most 120, got "), "{error}");
        }
        assert!(Spectrum::jonswap(10.0, 0.0, 3.3).is_err());
        assert!(Spectrum::jonswap(10.0, 1e5, 0.5).is_err());
        assert!(Spectrum::of_height_and_period(1.0, f64::INFINITY, 3.3).is_err());
        let sea = Spectrum::pierson_moskowitz(10.0).expect("a wind");
        for f in [f64::NAN, -1.0, 0.0, f64::INFINITY, 1e-300, 1e300] {
            assert_eq!(sea.density(f), 0.0, "{f}");
        }
    }
}
