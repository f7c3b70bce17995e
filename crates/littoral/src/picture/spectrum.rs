//! Light in eight bands of wavelength, and its colour.
//!
//! Three numbers are too few to carry sunlight through a long path of air: what is red, green and blue after it depends on
//! the wavelengths between. Eight bands of 40 nm follow Rayleigh's λ⁻⁴ and ozone's absorption closely and fit one SIMD
//! register. They become linear Rec. 709 only at the end, through the colour matching functions of C. Wyman, P.-P. Sloan and
//! P. Shirley, "Simple analytic approximations to the CIE XYZ color matching functions", JCGT 2(2), 2013.

use glam::Vec3;
use std::ops::{Add, AddAssign, Mul};
use std::sync::LazyLock;

/// Number of bands.
pub const BANDS: usize = 8;

/// Middle of each band (nm); each is 40 nm wide.
pub const WAVELENGTHS: [f32; BANDS] = [400.0, 440.0, 480.0, 520.0, 560.0, 600.0, 640.0, 680.0];

/// Sunlight outside the atmosphere, mean of each band (W m⁻² nm⁻¹): ASTM G173-03, extraterrestrial.
pub const SUNLIGHT: Spectrum = Spectrum([1.489, 1.853, 1.971, 1.869, 1.838, 1.745, 1.598, 1.479]);

/// One number for each band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spectrum(pub [f32; BANDS]);

impl Spectrum {
    /// The same number in each band.
    pub const fn splat(v: f32) -> Spectrum {
        Spectrum([v; BANDS])
    }

    /// A function of wavelength (nm).
    pub fn of(f: impl Fn(f32) -> f32) -> Spectrum {
        Spectrum(WAVELENGTHS.map(f))
    }

    /// `f` of each number.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Spectrum {
        Spectrum(self.0.map(f))
    }

    /// e to the power of minus each number, which has to be at least 0: what a path of that optical depth lets through. To within
    /// 3·10⁻⁷, all bands at once.
    #[inline]
    pub fn through(self) -> Spectrum {
        self.map(|depth| {
            // 2^t = 2^whole · 2^part; adding this number rounds to a whole one and leaves it in the lowest bits.
            const ROUND: f32 = 12_582_912.0;
            let t = (depth * -std::f32::consts::LOG2_E).max(-126.0);
            let rounded = t + ROUND;
            let part = (t - (rounded - ROUND)) * std::f32::consts::LN_2;
            // Taylor's series of e^part to the sixth power, |part| < 0.35.
            let series = 1.0
                + part
                    * (1.0
                        + part
                            * (0.5 + part * (1.0 / 6.0 + part * (1.0 / 24.0 + part * (1.0 / 120.0 + part / 720.0)))));
            let whole = rounded.to_bits().wrapping_sub(ROUND.to_bits()) << 23;
            f32::from_bits(series.to_bits().wrapping_add(whole))
        })
    }

    /// Linear Rec. 709 (kcd/m², or klx) of a spectral radiance (or irradiance) in W m⁻² nm⁻¹. Colours outside the gamut
    /// have negative parts.
    pub fn rgb(self) -> Vec3 {
        let weights = &*RGB_WEIGHTS;
        self.0.iter().zip(weights).map(|(&v, &w)| v * w).sum()
    }
}

/// What one W m⁻² nm⁻¹ in each band adds to linear Rec. 709 in kcd/m².
static RGB_WEIGHTS: LazyLock<[Vec3; BANDS]> = LazyLock::new(|| {
    WAVELENGTHS.map(|middle| {
        let xyz: Vec3 = (-20..20).map(|i| colour_matching(middle + i as f32 + 0.5)).sum();
        let (x, y, z) = (xyz.x, xyz.y, xyz.z);
        // IEC 61966-2-1; 683 lm/W.
        0.683
            * Vec3::new(
                3.240_97 * x - 1.537_383_2 * y - 0.498_610_8 * z,
                -0.969_243_64 * x + 1.875_967_5 * y + 0.041_555_06 * z,
                0.055_630_08 * x - 0.203_976_96 * y + 1.056_971_5 * z,
            )
    })
});

/// The CIE 1931 colour matching functions at a wavelength (nm).
fn colour_matching(wavelength: f32) -> Vec3 {
    let lobe = |middle: f32, below: f32, above: f32| {
        let t = (wavelength - middle) / if wavelength < middle { below } else { above };
        (-0.5 * t * t).exp()
    };
    Vec3::new(
        1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7) - 0.065 * lobe(501.1, 20.4, 26.2),
        0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
        1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8),
    )
}

impl Add for Spectrum {
    type Output = Spectrum;
    #[inline]
    fn add(self, other: Spectrum) -> Spectrum {
        Spectrum(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, other: Spectrum) {
        *self = *self + other;
    }
}

impl Mul for Spectrum {
    type Output = Spectrum;
    #[inline]
    fn mul(self, other: Spectrum) -> Spectrum {
        Spectrum(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }
}

impl Mul<f32> for Spectrum {
    type Output = Spectrum;
    #[inline]
    fn mul(self, by: f32) -> Spectrum {
        Spectrum(self.0.map(|v| v * by))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_passes_is_the_exponential() {
        for i in 0..4000 {
            let depth = 1e-4 * (i as f32).powi(2) * 0.05;
            let (got, expected) = (Spectrum::splat(depth).through().0[3], (-depth).exp());
            assert!((got - expected).abs() <= 3e-7 + 1e-6 * expected * depth, "{got} for {expected} at {depth}");
        }
        assert!(Spectrum::splat(1e9).through().0[0] < 1e-37);
    }

    #[test]
    fn sunlight_has_its_known_illuminance_and_colour() {
        // The solar illuminance constant is 128 to 133 klx; the sun outside the atmosphere is nearly white, a little warm.
        let rgb = SUNLIGHT.rgb();
        let klx = 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z;
        assert!((126.0..137.0).contains(&klx), "{klx} klx");
        assert!(rgb.x > rgb.y && rgb.y > 0.85 * rgb.x && rgb.z > 0.8 * rgb.x, "{rgb}");
    }
}
