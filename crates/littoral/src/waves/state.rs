//! Sea states: which waves run over the sea, by wind, by name, or as a buoy measured them.
//!
//! A state is a sum of *trains*: the sea that the wind here has raised, and swells from elsewhere. It can be written in a line:
//! `wind=15,from=240,swell=2@12/300`, `beaufort=6`, `douglas=4`, `calm`.

use super::dispersion::{STANDARD_GRAVITY, StillWater};
use super::measured::Measured;
use super::spectrum::Spectrum;
use super::spreading::{Fan, Spreading};
use super::{OutOfRange, measured};
use glam::DVec2;
use libm::{pow, sqrt};
use std::f64::consts::TAU;

/// Which waves run over the sea.
#[derive(Clone, Debug, PartialEq)]
pub struct SeaState {
    /// The seas and swells it is made of; none for a calm.
    pub trains: Vec<Train>,
    /// The wind now.
    pub wind: Wind,
    /// Depth of the water where there is no bed (m, above 0); infinity for deep water.
    pub depth: f64,
    /// Significant height over depth at which waves break over a bed, from 0.1 to 2: the width of the surf follows from it.
    pub breaking: f64,
    /// Which of the seas of this state: the same seed gives the same bits everywhere.
    pub seed: u64,
}

/// Wind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wind {
    /// Speed 10 m above the sea (m/s), at least 0.
    pub speed: f64,
    /// Where it blows *to* (rad, counter-clockwise from x).
    pub heading: f64,
}

/// One sea or swell.
#[derive(Clone, Debug, PartialEq)]
pub enum Train {
    /// Described by a few numbers.
    Formula {
        /// Energy by frequency.
        spectrum: Spectrum,
        /// Energy by direction.
        spreading: Spreading,
        /// Where it runs to in the mean (rad, counter-clockwise from x).
        heading: f64,
    },
    /// As a buoy measured it.
    Measured(Measured),
}

/// The energy of one frequency by direction.
enum Rose {
    Fan(Fan, f64),
    Entropy(measured::Entropy),
}

impl Train {
    /// Energy density (m²/Hz) at a frequency (Hz).
    pub fn density(&self, frequency: f64) -> f64 {
        match self {
            Train::Formula { spectrum, .. } => spectrum.density(frequency),
            Train::Measured(measured) => measured.density(frequency),
        }
    }

    /// The frequency of its peak (Hz).
    pub fn peak(&self) -> f64 {
        match self {
            Train::Formula { spectrum, .. } => spectrum.peak,
            Train::Measured(measured) => measured.peak(),
        }
    }

    fn rose(&self, frequency: f64) -> Rose {
        match self {
            Train::Formula { spectrum, spreading, heading } => {
                Rose::Fan(spreading.at(frequency / spectrum.peak), *heading)
            }
            Train::Measured(measured) => Rose::Entropy(measured.directions(frequency)),
        }
    }
}

impl Rose {
    fn density(&self, heading: f64) -> f64 {
        match self {
            Rose::Fan(fan, mean) => fan.density(heading - mean),
            Rose::Entropy(entropy) => entropy.density(heading),
        }
    }
}

/// The energy of a sea state at one frequency.
pub struct Slice(Vec<(f64, Rose)>);

impl Slice {
    /// Energy density by direction (m²/Hz/rad), for waves that run towards `heading` (rad, counter-clockwise from x).
    pub fn density(&self, heading: f64) -> f64 {
        self.0.iter().map(|(density, rose)| density * rose.density(heading)).sum()
    }

    /// Mean heading (rad) of the energy.
    pub fn mean_heading(&self) -> f64 {
        let sum = self.resultant();
        libm::atan2(sum.y, sum.x)
    }

    /// Sum of the directions, each as long as its energy.
    fn resultant(&self) -> DVec2 {
        let part = |j: i32| {
            let heading = TAU * f64::from(j) / 72.0;
            DVec2::new(libm::cos(heading), libm::sin(heading)) * self.density(heading)
        };
        (0..72).map(part).sum()
    }
}

/// Direction towards which runs what comes *from* a compass bearing: degrees clockwise from north in, radians counter-clockwise from
/// x (east) out.
pub fn heading_from_bearing(from: f64) -> f64 {
    (270.0 - from).rem_euclid(360.0).to_radians()
}

/// The compass bearing (degrees clockwise from north, in [0, 360)) *from* which comes what runs towards a heading (rad).
pub fn bearing_from_heading(heading: f64) -> f64 {
    (270.0 - heading.to_degrees()).rem_euclid(360.0)
}

/// Wind speeds (m/s at 10 m) in the middle of each Beaufort number: 0.836 B^(3/2), the scale's definition of 1946.
fn beaufort_speed(number: f64) -> f64 {
    0.836 * pow(number, 1.5)
}

/// Probable height of waves in the open sea at each Beaufort number (m): WMO, *Manual on codes*, table 1100 appendix.
const BEAUFORT_HEIGHTS: [f64; 13] = [0.0, 0.1, 0.2, 0.6, 1.0, 2.0, 3.0, 4.0, 5.5, 7.0, 9.0, 11.5, 14.0];

/// Significant heights (m) in the middle of each degree of the Douglas scale of the sea (WMO code table 3700).
const DOUGLAS_HEIGHTS: [f64; 10] = [0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0, 7.5, 11.5, 14.0];

impl SeaState {
    /// No wind, no waves.
    pub const CALM: SeaState = SeaState {
        trains: Vec::new(),
        wind: Wind { speed: 0.0, heading: 0.0 },
        depth: f64::INFINITY,
        breaking: 0.78,
        seed: 0,
    };

    /// The sea that a wind (m/s at 10 m, towards `heading`) raises over a fetch (m): JONSWAP with Hasselmann's spreading.
    ///
    /// # Errors
    /// As [`Spectrum::jonswap`].
    pub fn of_wind(speed: f64, heading: f64, fetch: f64) -> Result<SeaState, OutOfRange> {
        let spectrum = Spectrum::jonswap(speed, fetch, 3.3)?;
        let train = Train::Formula { spectrum, spreading: Spreading::Hasselmann, heading };
        Ok(SeaState { trains: vec![train], wind: Wind { speed, heading }, ..SeaState::CALM })
    }

    /// The sea of a Beaufort number from 0 to 12 (fractions allowed), with the wind and the probable wave height of the scale.
    ///
    /// # Errors
    /// If the number is not from 0 to 12.
    pub fn beaufort(number: f64, heading: f64) -> Result<SeaState, OutOfRange> {
        OutOfRange::unless((0.0..=12.0).contains(&number), "beaufort", "a number from 0 to 12", number)?;
        Ok(SeaState::grown(beaufort_speed(number), between(&BEAUFORT_HEIGHTS, number), heading))
    }

    /// The sea of a degree of the Douglas scale from 0 to 9 (fractions allowed), with a wind that raises such waves.
    ///
    /// # Errors
    /// If the degree is not from 0 to 9.
    pub fn douglas(degree: f64, heading: f64) -> Result<SeaState, OutOfRange> {
        OutOfRange::unless((0.0..=9.0).contains(&degree), "douglas", "a degree from 0 to 9", degree)?;
        let height = between(&DOUGLAS_HEIGHTS, degree);
        let number = (0..12).find(|&n| BEAUFORT_HEIGHTS[n + 1] >= height).map_or(12.0, |n| {
            let (low, high) = (BEAUFORT_HEIGHTS[n], BEAUFORT_HEIGHTS[n + 1]);
            n as f64 + (height - low) / (high - low)
        });
        Ok(SeaState::grown(beaufort_speed(number), height, heading))
    }

    /// The sea of a significant height (m) under a wind (m/s): as old as the height tells, by the growth law of the JONSWAP experiment,
    /// ε = 1.6·10⁻⁷ x̃ and ν = 3.5 x̃^−⅓ (K. Hasselmann et al. 1973), and no older than full-grown.
    fn grown(speed: f64, height: f64, heading: f64) -> SeaState {
        let wind = Wind { speed, heading };
        if height < 1e-3 || speed < 0.05 {
            return SeaState { wind, ..SeaState::CALM };
        }
        let g = STANDARD_GRAVITY;
        let energy = g * g * height * height / 16.0 / pow(speed, 4.0);
        let peak = (3.5 / libm::cbrt(energy / 1.6e-7)).max(0.13) * g / speed;
        let gamma = Spectrum::usual_gamma(height, 1.0 / peak);
        let plain = Spectrum { alpha: 0.0081, peak, gamma, depth: f64::INFINITY };
        let train = Train::Formula { spectrum: plain.of_height(height), spreading: Spreading::Hasselmann, heading };
        SeaState { trains: vec![train], wind, ..SeaState::CALM }
    }

    /// The same with a swell: long waves of a significant height (m) and peak period (s) from far away, all nearly of one length and
    /// direction (rad, towards).
    ///
    /// # Errors
    /// As [`Spectrum::of_height_and_period`].
    pub fn with_swell(mut self, height: f64, period: f64, heading: f64) -> Result<SeaState, OutOfRange> {
        let spectrum = Spectrum::of_height_and_period(height, period, 6.0)?.of_height(height);
        self.trains.push(Train::Formula { spectrum, spreading: Spreading::HalfAngle { s: 60.0 }, heading });
        Ok(self)
    }

    /// The same with wind and waves turned counter-clockwise by an angle (rad): for axes of which y is not north.
    pub fn turned(mut self, angle: f64) -> SeaState {
        self.wind.heading += angle;
        for train in &mut self.trains {
            match train {
                Train::Formula { heading, .. } => *heading += angle,
                Train::Measured(measured) => *measured = measured.turned(angle),
            }
        }
        self
    }

    /// The same if all of its numbers make sense.
    ///
    /// # Errors
    /// If the depth is not above 0, or breaking, a wind, direction or spectrum is not a number in range.
    pub fn checked(self) -> Result<SeaState, OutOfRange> {
        StillWater::of_depth(self.depth)?;
        let (wind, breaking) = (self.wind, self.breaking);
        OutOfRange::unless((0.1..=2.0).contains(&breaking), "breaking", "a height over depth from 0.1 to 2", breaking)?;
        OutOfRange::unless((0.0..=120.0).contains(&wind.speed), "wind", "m/s, from 0 to 120", wind.speed)?;
        OutOfRange::unless(wind.heading.is_finite(), "wind's heading", "a finite angle", wind.heading)?;
        for train in &self.trains {
            if let Train::Formula { spectrum, heading, .. } = train {
                OutOfRange::unless(heading.is_finite(), "heading", "a finite angle", *heading)?;
                let peak = spectrum.peak;
                OutOfRange::unless(peak > 1e-3 && peak < 1e3, "peak frequency", "Hz, from 0.001 to 1000", peak)?;
                let alpha = spectrum.alpha;
                OutOfRange::unless(
                    (0.0..1e3).contains(&alpha),
                    "alpha",
                    "a number from 0 to 1000 (lower or longer waves)",
                    alpha,
                )?;
            }
        }
        Ok(self)
    }

    /// The water the waves run over where there is no bed.
    pub fn water(&self) -> StillWater {
        StillWater { depth: self.depth, ..StillWater::DEEP }
    }

    /// Energy density (m²/Hz) at a frequency (Hz), all directions together.
    pub fn density(&self, frequency: f64) -> f64 {
        self.trains.iter().map(|t| t.density(frequency)).sum()
    }

    /// The energy of a frequency (Hz), for asking about its directions.
    pub fn slice(&self, frequency: f64) -> Slice {
        let part = |t: &Train| (t.density(frequency), t.rose(frequency));
        Slice(self.trains.iter().map(part).filter(|(density, _)| *density > 0.0).collect())
    }

    /// Lowest and highest frequency (Hz) between which all but a ten-thousandth of the energy lies; `None` for a calm.
    pub fn band(&self) -> Option<(f64, f64)> {
        let highest = self.trains.iter().map(Train::peak).fold(0.0, f64::max);
        // A buoy's peak may be that of the sea, with a swell far below.
        let lowest = |train: &Train| match train {
            Train::Formula { spectrum, .. } => 0.4 * spectrum.peak,
            Train::Measured(measured) => measured.lowest(),
        };
        let lowest = self.trains.iter().map(lowest).fold(f64::INFINITY, f64::min);
        (highest > 0.0).then_some((lowest, 10.0 * highest))
    }

    /// The n-th moment ∫ fⁿ S df (m² Hzⁿ) between two frequencies (Hz, both above 0).
    pub fn moment(&self, n: i32, low: f64, high: f64) -> f64 {
        super::spectrum::integrate(|f| pow(f, f64::from(n)) * self.density(f), low, high)
    }

    /// Significant wave height 4 √m₀ (m); 0 for a calm.
    pub fn significant_height(&self) -> f64 {
        self.band().map_or(0.0, |(low, high)| 4.0 * sqrt(self.moment(0, low, 20.0 * high)))
    }

    /// The frequency with the most energy (Hz); `None` for a calm.
    pub fn peak(&self) -> Option<f64> {
        let most = |a: &f64, b: &f64| self.density(*a).total_cmp(&self.density(*b));
        self.trains.iter().map(Train::peak).max_by(most)
    }

    /// Mean direction (rad, counter-clockwise from x) in which the energy runs, weighted by it.
    pub fn mean_heading(&self) -> f64 {
        let Some((low, high)) = self.band() else { return self.wind.heading };
        let frequency = |i: i32| low * pow(high / low, (f64::from(i) + 0.5) / 64.0);
        let sum: DVec2 = (0..64).map(|i| self.slice(frequency(i)).resultant() * frequency(i)).sum();
        libm::atan2(sum.y, sum.x)
    }
}

impl SeaState {
    /// Energy density by wave number (m² per (rad/m)²) of the waves of a wave number vector (rad/m, not 0) on the state's water:
    /// F(k_x, k_y) = E(f, θ) (df/dk) / k, whose integral is the variance of the surface.
    pub fn wavenumber_density(&self, wavenumber: DVec2) -> f64 {
        let (k, water) = (wavenumber.length(), self.water());
        let frequency = water.angular_frequency(k) / TAU;
        let heading = libm::atan2(wavenumber.y, wavenumber.x);
        self.slice(frequency).density(heading) * water.group_speed(k) / (TAU * k)
    }
}

/// Value of a table at a fractional index within it.
fn between(table: &[f64], at: f64) -> f64 {
    let below = (at as usize).min(table.len() - 2);
    table[below] + (table[below + 1] - table[below]) * (at - below as f64)
}
