//! Linear superposition: the sea as a sum of plane waves at any point and instant.
//!
//! η(x, y, t) = Σᵢ Σⱼ √(2 S(ωᵢ, θⱼ) Δω Δθ) cos(kᵢ·x − ωᵢ t + εᵢⱼ) of S. Liu, X. Xu and C. Chen (*Real-time simulation of large-scale ocean
//! scene based on wave spectrum*, 2009), with the exact dispersion of the water's depth. There is no tile and no period; water moves up and
//! down only, and each wave is the linear one of G. Airy, 1845.

use super::sum::{Grid, GridScratch, Pushing, Sum};
use super::{
    BLOCK, Bounds, Motion, OutOfRange, PlaneWave, Points, SeaState, StillWater, Velocity, WaveModel, components,
};
use glam::DVec2;
use std::f64::consts::TAU;

/// A sea of plane waves, each on its own way.
#[derive(Clone, Debug)]
pub struct Superposition {
    sum: Sum,
    /// After how long it starts anew (s), if ever.
    period: f64,
    time: f64,
}

impl Superposition {
    /// Any waves (at most 65 536) over water of one depth, which tells how their motion dies out downward.
    ///
    /// # Errors
    /// If a wave's numbers make no sense: wave numbers from 1e-6 to 1e4 rad/m, amplitudes from 0 to 1e4 m, angular frequencies from 0 to
    /// 1e4 rad/s, phases within ±1e6 rad.
    pub fn new(waves: &[PlaneWave], water: StillWater) -> Result<Superposition, OutOfRange> {
        let plain = |wave: &PlaneWave| Pushing { wave: *wave, push: 0.0 };
        Ok(Superposition { sum: Sum::new(waves.iter().map(plain), water)?, period: f64::INFINITY, time: 0.0 })
    }

    /// `frequencies` × `directions` waves of a sea state (16 × 8 in the paper; see [`components::lattice`]); without waves for a calm.
    ///
    /// # Errors
    /// If the state's numbers make no sense, or there would be more than 65 536 waves.
    pub fn of_state(state: &SeaState, frequencies: usize, directions: usize) -> Result<Superposition, OutOfRange> {
        let state = state.clone().checked()?;
        let count = frequencies as f64 * directions as f64;
        OutOfRange::unless(count <= super::sum::MOST_WAVES as f64, "waves", "at most 65 536 waves", count)?;
        Superposition::new(&components::lattice(&state, frequencies, directions), state.water())
    }

    /// The same sea, but returning to the same bits every `period` (s): each angular frequency goes to the nearest multiple of 2π / period
    /// (but 0), and the wave number with it, so that every wave keeps the speed that is its own. Best several of the longest waves' periods.
    ///
    /// # Errors
    /// If the period is not from 1 ms to 1e9 s, or makes waves too short or long.
    pub fn looping(&self, period: f64) -> Result<Superposition, OutOfRange> {
        OutOfRange::unless((1e-3..=1e9).contains(&period), "loop", "s, from 0.001 to 1e9", period)?;
        let water = self.sum.water();
        let rounded = |pushing: &Pushing| {
            let wave = pushing.wave;
            let cycles = (wave.angular_frequency * period / TAU).round().max(1.0);
            let angular_frequency = TAU * cycles / period;
            let ratio = water.wavenumber(angular_frequency) / water.wavenumber(wave.angular_frequency);
            let wavenumber = if ratio.is_finite() { wave.wavenumber * ratio } else { wave.wavenumber };
            Pushing { wave: PlaneWave { wavenumber, angular_frequency, ..wave }, ..*pushing }
        };
        let sum = Sum::new(self.sum.waves().iter().map(rounded), water)?;
        let mut looping = Superposition { sum, period, time: 0.0 };
        looping.set_time(self.time);
        Ok(looping)
    }

    /// Heights (m) at places (m), to the bit those of [`WaveModel::add_displacement`]: fastest where places that follow each other are near each
    /// other. As many are answered as the shorter slice has.
    pub fn heights_at(&self, places: &[DVec2], heights: &mut [f32]) {
        self.sum.heights_at(places, heights);
    }

    /// Heights (m) at all points of a regular grid, row by row northward: those of [`WaveModel::add_displacement`] but for some 10⁻⁶ of the
    /// waves' amplitudes, several times as fast. Allocates only what `scratch` lacks.
    ///
    /// # Panics
    /// If `heights` are not as many as the grid has points.
    pub fn fill(&self, grid: &Grid, scratch: &mut GridScratch, heights: &mut [f32]) {
        self.sum.fill(grid, scratch, heights);
    }

    /// Its waves, in the order in which they are summed.
    pub fn waves(&self) -> impl Iterator<Item = &PlaneWave> {
        self.sum.waves().iter().map(|pushing| &pushing.wave)
    }
}

impl WaveModel for Superposition {
    fn set_time(&mut self, seconds: f64) {
        self.time = if seconds.is_finite() { seconds } else { 0.0 };
        // The remainder is exact.
        self.sum.set_time(if self.period.is_finite() { self.time.rem_euclid(self.period) } else { self.time });
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
