//! A sea of periodic tiles that are summed by fast Fourier transform: G. Mastin, P. Watterberg and J. Mareda's filtered noise of 1987, exact at any
//! instant.
//!
//! Several tiles (*cascades*) share the wave numbers, so that a few hundred samples a side carry waves from kilometres down to
//! centimetres. Their sizes do not line up and their axes are turned against each other: what is seen never repeats. A wave's amplitude and phase
//! are drawn by its place in the tile from the seed: the same seed keeps its crests when the wind changes.
//!
//! ```
//! use littoral::waves::cascades::{Cascades, Options};
//! use littoral::waves::{Motion, Points, SeaState, WaveModel};
//!
//! let state = SeaState::beaufort(5.0, 0.6)?;
//! let mut sea = Cascades::new(&state, &Options { samples: 64, ..Options::default() })?;
//! sea.set_time(12.5);
//! let mut motion = Motion::STILL;
//! sea.add_motion(&Points::at(100.0, -250.0), &mut motion);
//! assert!(motion.dz[0].abs() < sea.bounds().height);
//! # Ok::<(), littoral::waves::OutOfRange>(())
//! ```

#![allow(clippy::needless_range_loop, reason = "loops over lanes become vector instructions in this form")]

mod clock;
mod energy;
mod extent;
mod foam;
mod patch;
mod plan;
mod query;
mod spectrum;
#[cfg(test)]
mod tests;
mod velocity;

pub use plan::Tile;
pub use spectrum::{Breakers, FoamInstant, FoamTick, Samples, Spectrum, Wave};

use super::fft::steps::Run;
use super::model::{BLOCK, Bounds, Motion, Points, Velocity, WaveModel};
use super::{OutOfRange, SeaState};
use clock::{Clock, sane};
use energy::Energy;
use patch::Patch;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// How a sea is made of tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Samples along a side of each tile: a power of two from 64 to 1024. More of them need fewer tiles.
    pub samples: usize,
    /// Lowest wave number (rad/m): longer waves are left to others.
    pub lowest: f64,
    /// Wave number (rad/m) from which on shorter waves are left out.
    pub highest: f64,
    /// Sideways motion over that of the waves of theory, from 0 to 2: it makes crests sharp and troughs flat.
    pub choppiness: f64,
    /// After how many seconds the sea repeats itself to the bit; waves slower than that stand still. `None` for never.
    pub period: Option<f64>,
    /// Whether there is foam. It costs two transforms a tick (¼ s) for each of two tiles, and some fifty ticks after a jump in time.
    pub foam: bool,
}

impl Default for Options {
    /// Tiles of 256 samples with all waves down to 7 cm, choppiness 1, foam.
    fn default() -> Options {
        Options { samples: 256, lowest: 0.0, highest: TAU / 0.07, choppiness: 1.0, period: None, foam: true }
    }
}

impl Options {
    fn check(&self) -> Result<(), OutOfRange> {
        let n = self.samples;
        let samples = n.is_power_of_two() && (64..=1024).contains(&n);
        OutOfRange::unless(samples, "samples", "a power of two from 64 to 1024", n as f64)?;
        let lowest = (0.0..1e4).contains(&self.lowest);
        OutOfRange::unless(lowest, "lowest wave number", "rad/m, from 0 to 10 000", self.lowest)?;
        let highest = self.highest > self.lowest && self.highest <= 1e4;
        OutOfRange::unless(highest, "highest wave number", "rad/m, above the lowest, to 10 000", self.highest)?;
        let choppiness = (0.0..=2.0).contains(&self.choppiness);
        OutOfRange::unless(choppiness, "choppiness", "a number from 0 to 2", self.choppiness)?;
        let period = self.period.unwrap_or(1.0);
        OutOfRange::unless((0.1..=1e6).contains(&period), "period", "seconds, from 0.1 to a million", period)
    }
}

/// A sea of tiles.
///
/// Heights and displacements at a point are those of the sum of all waves to within the error of interpolation: at most 2.8 % of the shortest
/// waves of each tile, 0.1 % of those four times as long. Positions are reduced to the tile in `f64`: a thousand
/// kilometres from the origin they are right to 10⁻⁹ m. Waves that a footprint leaves out fade over an octave below it.
pub struct Cascades {
    patches: Vec<Patch>,
    clock: Clock,
    time: f64,
    bounds: OnceLock<Bounds>,
    run: Run,
}

impl Cascades {
    /// The sea of a state.
    ///
    /// # Errors
    /// If the state or an option is out of its range.
    pub fn new(state: &SeaState, options: &Options) -> Result<Cascades, OutOfRange> {
        Cascades::changing(&[(0.0, state.clone())], options)
    }

    /// A sea that has given states at given seconds, and between them goes from one to the next by straight lines in the energy of each wave;
    /// before the first and after the last it stays as it is. In a loop seconds count from its beginning. Trains that turn should be given
    /// at steps no larger than the width of their directions.
    ///
    /// # Errors
    /// If there is no state, the seconds do not rise, states differ in depth or seed, or a number is out of its range.
    pub fn changing(states: &[(f64, SeaState)], options: &Options) -> Result<Cascades, OutOfRange> {
        options.check()?;
        let (clock, states) = check(states, options)?;
        Ok(Cascades::of_tiles(&plan::tiles(&states, options), clock, &states, options))
    }

    /// The sea of a state on tiles of one's own: their limits replace those of the options, and their samples those too. No wave
    /// number should be in two tiles.
    ///
    /// # Errors
    /// If the state, a tile or an option is out of its range.
    pub fn with_tiles(state: &SeaState, tiles: &[Tile], options: &Options) -> Result<Cascades, OutOfRange> {
        options.check()?;
        let (clock, states) = check(&[(0.0, state.clone())], options)?;
        tiles.iter().try_for_each(|tile| tile.checked().map(drop))?;
        Ok(Cascades::of_tiles(tiles, clock, &states, options))
    }

    fn of_tiles(tiles: &[Tile], clock: Clock, states: &[SeaState], options: &Options) -> Cascades {
        let highest = tiles.iter().map(|tile| tile.highest).fold(0.0, f64::max);
        let energies: Vec<Energy> = states.iter().map(|state| Energy::new(state, 1.1 * highest)).collect();
        let patch = |(index, tile): (usize, &Tile)| Patch::new(*tile, index, states, &energies, options);
        let mut patches: Vec<Patch> = tiles.par_iter().enumerate().map(patch).collect();
        let sharing = patches.iter().filter(|patch| patch.foam.is_some()).count();
        for (index, foam) in patches.iter_mut().filter_map(|patch| patch.foam.as_mut()).enumerate() {
            foam.breaking.share = match (index, sharing) {
                (0, 1) => 1.0,
                (0, _) => foam::FIRST_SHARE,
                _ => (1.0 - foam::FIRST_SHARE) / (sharing - 1) as f64,
            };
        }
        let mut sea = Cascades { patches, clock, time: 0.0, bounds: OnceLock::new(), run: Run::TOGETHER };
        sea.set_time(0.0);
        sea
    }

    /// Its tiles.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = &Tile> {
        self.patches.iter().map(|patch| &patch.tile)
    }

    /// Memory it takes (bytes), without levels of detail and velocities, which are made on demand (half as much again).
    pub fn bytes(&self) -> usize {
        self.patches.iter().map(Patch::bytes).sum()
    }
}

/// What must hold for states, and how time goes on through them.
fn check(states: &[(f64, SeaState)], options: &Options) -> Result<(Clock, Vec<SeaState>), OutOfRange> {
    let Some((_, first)) = states.first() else {
        return Err(OutOfRange { what: "states", expected: "at least one", got: 0.0 });
    };
    let mut before = f64::NEG_INFINITY;
    for (seconds, state) in states {
        OutOfRange::unless(*seconds > before && seconds.is_finite(), "time of a state", "rising seconds", *seconds)?;
        before = *seconds;
        let state = state.clone().checked()?;
        OutOfRange::unless(state.depth == first.depth, "depth", "the same for all states", state.depth)?;
        OutOfRange::unless(state.seed == first.seed, "seed", "the same for all states", state.seed as f64)?;
    }
    let clock = Clock {
        times: states.iter().map(|(seconds, _)| *seconds).collect(),
        winds: states.iter().map(|(_, state)| state.wind.speed).collect(),
        period: options.period,
    };
    Ok((clock, states.iter().map(|(_, state)| state.clone()).collect()))
}

impl WaveModel for Cascades {
    fn set_time(&mut self, seconds: f64) {
        self.time = sane(seconds);
        self.bounds = OnceLock::new();
        let (run, clock, time) = (self.run, &self.clock, self.time);
        if run.threads && rayon::current_num_threads() > 1 {
            self.patches.par_iter_mut().for_each(|patch| patch.set(run, &clock.instant(time)));
        } else {
            self.patches.iter_mut().for_each(|patch| patch.set(run, &clock.instant(time)));
        }
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        query::add(&self.patches, points, false, motion);
    }

    fn add_motion(&self, points: &Points, motion: &mut Motion) {
        query::add(&self.patches, points, true, motion);
    }

    fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        self.patches.iter().for_each(|patch| patch.add_velocity(points, depths, velocity));
    }

    fn bounds(&self) -> Bounds {
        *self.bounds.get_or_init(|| {
            let mut sum = Bounds::default();
            for bounds in self.patches.iter().map(Patch::bounds) {
                sum.height += bounds.height;
                sum.sideways += bounds.sideways;
                sum.slope += bounds.slope;
                sum.stretch += bounds.stretch;
                sum.curvature += bounds.curvature;
                sum.bend += bounds.bend;
            }
            sum
        })
    }

    fn roughness(&self, wavelength: f32) -> f32 {
        let variance: f64 = self.patches.iter().map(|patch| patch.variance_below(f64::from(wavelength))).sum();
        let bounds = self.bounds();
        ((6.0 * libm::sqrt(variance)) as f32).min(bounds.height.max(bounds.sideways))
    }

    fn rise_speed(&self) -> f32 {
        (6.0 * libm::sqrt(self.patches.iter().map(Patch::variance_of_rising).sum::<f64>())) as f32
    }
}
