//! Which tiles a sea is made of.
//!
//! The energetic waves are shared by two tiles of different sizes, so that neither shows its period; each further tile takes the next
//! shorter waves. Every wave number belongs to one tile. Sizes are out of proportion, and no two lattices lie parallel or across.

use super::super::{OutOfRange, SeaState};
use super::Options;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A square patch of waves that is repeated without end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Length of its sides (m), above 0.
    pub length: f64,
    /// By how much its sides are turned counter-clockwise from x and y (rad).
    pub turn: f64,
    /// Samples along a side: a power of two from 64 to 1024.
    pub samples: usize,
    /// Lowest wave number (rad/m) of its waves, at least 0.
    pub lowest: f64,
    /// Wave number (rad/m) below which its waves lie: at most half of what the samples could carry (four of them for the shortest wave) for
    /// good interpolation, and below π · samples / length in any case.
    pub highest: f64,
}

impl Tile {
    /// The tile if its numbers make sense.
    ///
    /// # Errors
    /// If they do not: see the fields.
    pub fn checked(self) -> Result<Tile, OutOfRange> {
        let length = self.length > 1e-3 && self.length < 1e7;
        OutOfRange::unless(length, "tile's length", "metres, from 0.001 to 10 000 000", self.length)?;
        OutOfRange::unless(self.turn.is_finite(), "tile's turn", "a finite angle", self.turn)?;
        let n = self.samples;
        let samples = n.is_power_of_two() && (64..=1024).contains(&n);
        OutOfRange::unless(samples, "samples", "a power of two from 64 to 1024", n as f64)?;
        OutOfRange::unless(self.lowest >= 0.0, "lowest wave number", "rad/m, at least 0", self.lowest)?;
        let carried = 0.5 * TAU * n as f64 / self.length;
        let highest = self.highest > self.lowest && self.highest < carried;
        OutOfRange::unless(highest, "highest wave number", "more than the lowest, less than carried", self.highest)?;
        Ok(self)
    }

    /// Between neighbouring wave numbers (rad/m).
    pub(super) fn step(&self) -> f64 {
        TAU / self.length
    }

    /// Highest index of a wave number along a side.
    pub(super) fn rows(&self) -> i32 {
        (self.highest / self.step()).ceil() as i32 - 1
    }
}

/// The tiles of a sea that goes through `states`; none if they hold no waves within the options' limits.
pub(super) fn tiles(states: &[SeaState], options: &Options) -> Vec<Tile> {
    let peak = |state: &SeaState| {
        let frequency = state.trains.iter().map(|train| train.peak()).min_by(f64::total_cmp)?;
        Some(state.water().wavenumber(TAU * frequency))
    };
    let Some(peak) = states.iter().filter_map(peak).min_by(f64::total_cmp) else { return Vec::new() };
    let turn = |i: usize| (0.27 + 0.618_034 * i as f64).fract() * FRAC_PI_2;
    let within = |low: f64, high: f64| (low.max(options.lowest), high.min(options.highest));
    let mut tiles = Vec::new();
    let mut push = |length: f64, samples: usize, (lowest, highest): (f64, f64)| {
        if highest > lowest * (1.0 + 1e-9) {
            let turn = turn(tiles.len());
            tiles.push(Tile { length, turn, samples, lowest, highest });
        }
    };
    // Where the energetic waves are cut in two, in peaks.
    let wavelength = TAU / peak;
    let cut = 1.25 * peak;
    let largest = (options.samples / 2).clamp(64, 128);
    let length = if largest == 64 { 11.71 } else { 17.31 } * wavelength;
    push(length, largest, within(0.0, cut));
    // Each tile carries waves from about eight to a side up to four samples a wave.
    let carried = (options.samples / 4) as f64 - 0.5;
    let mut low = cut;
    let mut lengths = [7.43, 8.19, 7.81].iter().cycle();
    while low < options.highest {
        let length = lengths.next().map_or(8.0, |l| *l) * TAU / low;
        let high = carried * TAU / length;
        push(length, options.samples, within(low, high));
        low = high;
    }
    tiles
}
