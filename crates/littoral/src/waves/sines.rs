//! A designer's list of waves: sines, or F. Gerstner's trochoids.
//!
//! z = Σ Aᵢ sin(kᵢ·X − ωᵢ t + φᵢ) over points that move sideways by Σ Qᵢ Aᵢ k̂ᵢ cos(…): crests sharpen and troughs flatten with the steepness Q, 0 for
//! sines and 1 for Gerstner's wave (*Theorie der Wellen*, 1802), whose water runs in circles. No loop forms while Σ Qᵢ kᵢ Aᵢ ≤ 1
//! (M. Finch, *Effective water simulation from physical models*, GPU Gems, 2004).

use super::sum::{Pushing, Sum};
use super::{BLOCK, Bounds, Motion, OutOfRange, PlaneWave, Points, StillWater, Velocity, WaveModel};
use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, TAU};

/// How long a wave is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// From crest to crest (m).
    Wavelength(f64),
    /// How long a crest takes to the place of the one before (s); the water's depth makes a wavelength of it.
    Period(f64),
}

/// One wave as a designer sets it: A sin(k·X − ω t + φ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sine {
    /// Half its height (m), from 0 to 1e4.
    pub amplitude: f64,
    /// Wavelength (from 1 mm to 1000 km) or period.
    pub length: Length,
    /// Where it runs to (rad, counter-clockwise from x).
    pub heading: f64,
    /// Phase φ at the origin at time 0 (rad, within ±1e6).
    pub phase: f64,
    /// Steepness Q, at least 0: how far water moves sideways in parts of the amplitude.
    pub steepness: f64,
}

/// A sum of a designer's waves, each with its own frequency by the dispersion of the water's depth.
#[derive(Clone, Debug)]
pub struct Sines {
    sines: Vec<Sine>,
    water: StillWater,
    sum: Sum,
    kept: f64,
    time: f64,
}

impl Sines {
    /// Waves over water of one depth. Where Σ Q k A exceeds 1, all steepnesses are scaled down together to make it 1, so that the surface
    /// nowhere folds over: [`Sines::steepness_kept`] tells by how much.
    ///
    /// # Errors
    /// If a wave's numbers make no sense, or there are more than 65 536.
    pub fn new(sines: &[Sine], water: StillWater) -> Result<Sines, OutOfRange> {
        let water = water.checked()?;
        let waves = sines.iter().map(|sine| sine.wave(water)).collect::<Result<Vec<_>, _>>()?;
        let needed = |(sine, wave): (&Sine, &PlaneWave)| sine.steepness * sine.amplitude * wave.wavenumber.length();
        let sharpness: f64 = sines.iter().zip(&waves).map(needed).sum();
        let kept = if sharpness > 1.0 { 1.0 / sharpness } else { 1.0 };
        let pushing = |(sine, wave): (&Sine, &PlaneWave)| Pushing { wave: *wave, push: kept * sine.steepness };
        let sum = Sum::new(sines.iter().zip(&waves).map(pushing), water)?;
        Ok(Sines { sines: sines.to_vec(), water, sum, kept, time: 0.0 })
    }

    /// Its waves as they were set.
    pub fn sines(&self) -> &[Sine] {
        &self.sines
    }

    /// By what every steepness is multiplied so that no loop forms: in (0, 1].
    pub fn steepness_kept(&self) -> f64 {
        self.kept
    }

    /// Sets wave `index` anew, from the instant it stands at on, without a jump at `place` (m): `sine.phase` is replaced by the one with which
    /// the new wave has the old one's phase there and then. Elsewhere, wavelength and heading change what they must. Allocates.
    ///
    /// # Errors
    /// If there is no such wave, or the new one's numbers make no sense; nothing is changed then.
    pub fn change(&mut self, index: usize, sine: Sine, place: DVec2) -> Result<(), OutOfRange> {
        let Some(old) = self.sines.get(index) else {
            return Err(OutOfRange { what: "wave", expected: "an index of the list", got: index as f64 });
        };
        let (old, new) = (old.wave(self.water)?, sine.wave(self.water)?);
        let phase = |wave: &PlaneWave| wave.wavenumber.dot(place) - wave.angular_frequency * self.time;
        let shift = (phase(&old) + old.phase - phase(&new)).rem_euclid(TAU);
        let mut sines = self.sines.clone();
        // As a sine's phase, which is a quarter turn ahead of a cosine's.
        sines[index] = Sine { phase: shift + FRAC_PI_2, ..sine };
        let mut changed = Sines::new(&sines, self.water)?;
        changed.set_time(self.time);
        *self = changed;
        Ok(())
    }
}

impl Sine {
    fn wave(&self, water: StillWater) -> Result<PlaneWave, OutOfRange> {
        OutOfRange::unless(self.heading.abs() <= 1e6, "heading", "rad, within ±1e6", self.heading)?;
        let (wavenumber, angular_frequency) = match self.length {
            Length::Wavelength(length) => {
                let fits = (1e-3..=1e6).contains(&length);
                OutOfRange::unless(fits, "wavelength", "m, from 0.001 to 1 000 000", length)?;
                (TAU / length, water.angular_frequency(TAU / length))
            }
            Length::Period(period) => {
                OutOfRange::unless((1e-2..=1e4).contains(&period), "period", "s, from 0.01 to 10 000", period)?;
                (water.wavenumber(TAU / period), TAU / period)
            }
        };
        let along = DVec2::new(libm::cos(self.heading), libm::sin(self.heading));
        Ok(PlaneWave {
            amplitude: self.amplitude,
            wavenumber: along * wavenumber,
            angular_frequency,
            phase: self.phase - FRAC_PI_2,
        })
    }
}

impl WaveModel for Sines {
    fn set_time(&mut self, seconds: f64) {
        self.time = if seconds.is_finite() { seconds } else { 0.0 };
        self.sum.set_time(self.time);
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        self.sum.add_displacement(points, motion);
    }

    fn add_motion(&self, points: &Points, motion: &mut Motion) {
        self.sum.add_motion(points, motion);
    }

    fn add_displacements(&self, points: &[Points], motions: &mut [Motion]) {
        self.sum.add_displacements(points, motions);
    }

    fn add_motions(&self, points: &[Points], motions: &mut [Motion]) {
        self.sum.add_motions(points, motions);
    }

    fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        self.sum.add_velocity(points, depths, velocity);
    }

    fn bounds(&self) -> Bounds {
        self.sum.bounds()
    }

    fn roughness(&self, wavelength: f32) -> f32 {
        self.sum.roughness(wavelength)
    }

    fn rise_speed(&self) -> f32 {
        self.sum.rise_speed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAVE: Sine =
        Sine { amplitude: 0.5, length: Length::Wavelength(20.0), heading: 0.4, phase: 0.3, steepness: 1.0 };

    #[test]
    fn trochoids_do_not_fold() {
        let steep = Sine { amplitude: 3.0, steepness: 1.5, ..WAVE };
        let sines = Sines::new(&[steep, WAVE], StillWater::DEEP).expect("in range");
        let needed = TAU / 20.0 * (3.0 * 1.5 + 0.5);
        assert!((sines.steepness_kept() * needed - 1.0).abs() < 1e-12);
        assert!((sines.bounds().stretch - 1.0).abs() < 1e-4);
        assert_eq!(Sines::new(&[WAVE], StillWater::DEEP).expect("in range").steepness_kept(), 1.0);
    }

    #[test]
    fn a_wave_is_its_formula() {
        let water = StillWater::of_depth(4.0).expect("wet");
        let mut sines = Sines::new(&[WAVE], water).expect("in range");
        let omega = water.angular_frequency(TAU / 20.0);
        for (x, y, t) in [(0.0, 0.0, 0.0), (3.0, -7.0, 11.0), (-1234.0, 5000.5, -77.0)] {
            sines.set_time(t);
            let mut motion = Motion::STILL;
            sines.add_motion(&Points::at(x, y), &mut motion);
            let along = 0.4f64.cos() * x + 0.4f64.sin() * y;
            let theta = TAU / 20.0 * along - omega * t + 0.3;
            let expected = [0.5 * theta.sin(), 0.5 * 0.4f64.cos() * theta.cos(), 0.5 * 0.4f64.sin() * theta.cos()];
            for (got, expected) in [motion.dz[3], motion.dx[7], motion.dy[0]].into_iter().zip(expected) {
                assert!((f64::from(got) - expected).abs() < 3e-6, "{got} for {expected}");
            }
        }
    }

    #[test]
    fn changes_do_not_jump() {
        let mut sines = Sines::new(&[WAVE, Sine { phase: 1.0, ..WAVE }], StillWater::DEEP).expect("in range");
        sines.set_time(1234.5);
        let place = DVec2::new(70.0, -20.0);
        let height = |sines: &Sines| {
            let mut motion = Motion::STILL;
            sines.add_displacement(&Points::at(place.x, place.y), &mut motion);
            motion.dz[0]
        };
        let before = height(&sines);
        sines.change(1, Sine { length: Length::Period(7.0), heading: 2.0, ..WAVE }, place).expect("in range");
        assert!((height(&sines) - before).abs() < 1e-5, "{} after {before}", height(&sines));
        assert!(sines.change(2, WAVE, place).is_err());
    }

    #[test]
    fn nonsense_is_refused() {
        let wrong = [
            Sine { amplitude: f64::NAN, ..WAVE },
            Sine { amplitude: -1.0, ..WAVE },
            Sine { length: Length::Wavelength(0.0), ..WAVE },
            Sine { length: Length::Period(f64::INFINITY), ..WAVE },
            Sine { heading: f64::NAN, ..WAVE },
            Sine { phase: f64::INFINITY, ..WAVE },
            Sine { steepness: -0.1, ..WAVE },
        ];
        for sine in wrong {
            assert!(Sines::new(&[sine], StillWater::DEEP).is_err(), "{sine:?}");
        }
    }
}
