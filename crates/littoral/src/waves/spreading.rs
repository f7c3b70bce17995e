//! Directional spreading: how the energy of a frequency is shared out over the directions.
//!
//! Every function integrates to 1 over the circle. Angles are counted from the mean direction; frequencies as f / f_p, in peaks.
//!
//! Works this rests on: M. Longuet-Higgins, D. Cartwright, N. Smith 1963 (cos²ˢ of the half angle); H. Mitsuyasu et al. 1975; D. Hasselmann,
//! M. Dunckel, J. Ewing 1980, as quoted by G. Mastin, P. Watterberg, J. Mareda 1987; M. Donelan, J. Hamilton, W. Hui 1985 with
//! M. Banner 1990 at high frequencies.

use super::OutOfRange;
use libm::{cos, cosh, exp, fabs, lgamma, log, pow, tanh};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// How energy is shared out over directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spreading {
    /// cos²ˢ(θ/2), the same at all frequencies; s from 0 (all round) upwards.
    HalfAngle {
        /// The exponent's half.
        s: f64,
    },
    /// cos²ˢ θ within 90°, the same at all frequencies.
    FullAngle {
        /// The exponent's half.
        s: f64,
    },
    /// Mitsuyasu: cos²ˢ(θ/2), with s = s_p (f/f_p)⁵ below the peak and s_p (f/f_p)^−2.5 above.
    Mitsuyasu {
        /// s at the peak: 11.5 (U/c_p)^−2.5, some 10 for wind seas.
        s: f64,
    },
    /// Hasselmann: cos²ᵖ(θ/2), with p = 9.77 (f/f_p)^4.06 below the peak and 9.77 (f/f_p)^−2.34 above.
    Hasselmann,
    /// Donelan and Banner: sech²(βθ).
    DonelanBanner,
}

impl Spreading {
    /// cos²ˢ of the half angle whose directions have a standard deviation (rad, above 0): σ² = 2 / (s + 1).
    ///
    /// # Errors
    /// If the width is not above 0 and at most √2 (all round).
    pub fn of_width(width: f64) -> Result<Spreading, OutOfRange> {
        let fine = width > 0.0 && width <= std::f64::consts::SQRT_2;
        OutOfRange::unless(fine, "directional width", "radians, above 0 and at most 1.414", width)?;
        Ok(Spreading::HalfAngle { s: 2.0 / (width * width) - 1.0 })
    }

    /// Mitsuyasu's spreading for a wind of `speed` (m/s) over a sea that peaks at `peak` (Hz).
    pub fn mitsuyasu(speed: f64, peak: f64) -> Spreading {
        let age = TAU * peak * speed / super::STANDARD_GRAVITY;
        Spreading::Mitsuyasu { s: 11.5 * pow(age, -2.5) }
    }

    /// Density (1/rad) at `frequency` (in peaks, above 0) in a direction `angle` (rad, any) off the mean one. Never below 0; its integral over
    /// the circle is 1.
    pub fn density(&self, frequency: f64, angle: f64) -> f64 {
        self.at(frequency).density(angle)
    }

    /// The spreading at one frequency (in peaks), for many directions.
    pub fn at(&self, frequency: f64) -> Fan {
        let r = frequency.max(1e-9);
        match *self {
            Spreading::HalfAngle { s } => Fan::half_angle(s),
            Spreading::FullAngle { s } => {
                let norm = exp(lgamma(s + 1.0) - lgamma(s + 0.5)) / PI.sqrt();
                Fan::FullAngle { s, norm }
            }
            Spreading::Mitsuyasu { s } => Fan::half_angle(s * pow(r, if r < 1.0 { 5.0 } else { -2.5 })),
            Spreading::Hasselmann => Fan::half_angle(9.77 * pow(r, if r < 1.0 { 4.06 } else { -2.34 })),
            Spreading::DonelanBanner => {
                let beta = if r < 0.56 {
                    2.61 * pow(0.56, 1.3)
                } else if r < 0.95 {
                    2.61 * pow(r, 1.3)
                } else if r < 1.6 {
                    2.28 * pow(r, -1.3)
                } else {
                    pow(10.0, -0.4 + 0.8393 * exp(-0.567 * 2.0 * log(r)))
                };
                Fan::Sech { beta, norm: 0.5 * beta / tanh(beta * PI) }
            }
        }
    }
}

/// A spreading at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fan {
    /// norm · cos²ˢ(θ/2)
    HalfAngle {
        /// The exponent's half.
        s: f64,
        /// What makes the integral 1 (1/rad).
        norm: f64,
    },
    /// norm · cos²ˢ θ within 90°.
    FullAngle {
        /// The exponent's half.
        s: f64,
        /// What makes the integral 1 (1/rad).
        norm: f64,
    },
    /// norm · sech²(βθ)
    Sech {
        /// How narrow.
        beta: f64,
        /// What makes the integral 1 (1/rad).
        norm: f64,
    },
}

impl Fan {
    fn half_angle(s: f64) -> Fan {
        // Beyond s = 20 000 a fan is narrower than a degree.
        let s = s.clamp(0.0, 2e4);
        Fan::HalfAngle { s, norm: exp(lgamma(s + 1.0) - lgamma(s + 0.5)) / (2.0 * PI.sqrt()) }
    }

    /// Density (1/rad) in a direction `angle` (rad, any) off the mean one.
    pub fn density(&self, angle: f64) -> f64 {
        let angle = angle - TAU * libm::round(angle / TAU);
        match *self {
            Fan::HalfAngle { s, norm } => norm * pow(fabs(cos(0.5 * angle)), 2.0 * s),
            Fan::FullAngle { s, norm } => {
                if fabs(angle) < FRAC_PI_2 {
                    norm * pow(cos(angle), 2.0 * s)
                } else {
                    0.0
                }
            }
            Fan::Sech { beta, norm } => {
                let c = cosh((beta * angle).clamp(-300.0, 300.0));
                norm / (c * c)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spreading_integrates_to_one() {
        let spreadings = [
            Spreading::HalfAngle { s: 0.0 },
            Spreading::HalfAngle { s: 37.0 },
            Spreading::FullAngle { s: 1.0 },
            Spreading::FullAngle { s: 20.0 },
            Spreading::Mitsuyasu { s: 10.0 },
            Spreading::Hasselmann,
            Spreading::DonelanBanner,
            Spreading::of_width(0.2).expect("narrow"),
        ];
        let steps = 20_000;
        for spreading in spreadings {
            for frequency in [0.05, 0.5, 0.9, 0.999, 1.001, 1.3, 1.7, 4.0, 30.0] {
                let angle = |i: i32| PI * (f64::from(2 * i + 1) / f64::from(steps) - 1.0);
                let sum: f64 = (0..steps).map(|i| spreading.density(frequency, angle(i))).sum();
                let integral = sum * TAU / f64::from(steps);
                assert!((integral - 1.0).abs() < 1e-6, "{spreading:?} at {frequency}: {integral}");
                assert!((0..steps).all(|i| spreading.density(frequency, angle(i)) >= 0.0));
            }
        }
    }

    #[test]
    fn widths_are_standard_deviations() {
        // In the sense of Kuik, van Vledder and Holthuijsen 1988: σ² = 2 (1 − first Fourier coefficient).
        let width = 0.35;
        let spreading = Spreading::of_width(width).expect("a width");
        let steps = 20_000;
        let angle = |i: i32| PI * (f64::from(2 * i + 1) / f64::from(steps) - 1.0);
        let first: f64 =
            (0..steps).map(|i| spreading.density(1.0, angle(i)) * cos(angle(i))).sum::<f64>() * TAU / f64::from(steps);
        assert!((2.0 * (1.0 - first) / (width * width) - 1.0).abs() < 1e-9);
    }
}
