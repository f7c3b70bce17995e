//! The waves of a tile, told one by one: for those who sum them elsewhere, say on a GPU.

use super::clock::Clock;
use super::foam::{self, Breaking};
use super::patch::Patch;
use super::{Cascades, Tile};
use crate::waves::fft::steps::motion_stride;

/// Two waves that run against each other over a tile, k and −k.
///
/// Their height at a time t is h e^(ik·x) with h = S cos φ − i D sin φ, φ = 2π `turns` t; that of a whole tile is the sum over all k, and is
/// real because S(−k) = S*(k) and D(−k) = −D*(k).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wave {
    /// Turns of the phase in in a unit of [`Breakers::time`], at least 0.
    pub turns: f64,
    /// S = h₀(k) + h₀*(−k) (m): real and imaginary part.
    pub sum: [f32; 2],
    /// D = h₀(k) − h₀*(−k) (m).
    pub difference: [f32; 2],
    /// How far sideways the water goes, over its height and the wave number (m): displacements are those of i k `reach` h.
    pub reach: f32,
    /// How many levels of detail have it: the first ones.
    pub levels: u32,
}

/// The waves of a tile where its sea stands, on a lattice of wave numbers (m, n) · `step` in the tile's own axes.
#[derive(Clone, Copy)]
pub struct Spectrum<'a> {
    patch: &'a Patch,
}

/// Samples of a tile: see [`Spectrum::samples`].
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// Along a side.
    pub side: usize,
    /// Numbers from row to row.
    pub stride: usize,
    /// All of them.
    pub numbers: &'a [f32],
}

/// How the foam of a tile comes and goes at a tick: what was there is multiplied by `decay`; where the Jacobian J of the sideways motion gives more, that takes
/// its place, min(1, (`threshold` − J) `steepness`); and what is fainter than [`FoamTick::LEAST`] is dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoamTick {
    /// Time as the waves count it.
    pub time: f64,
    /// What is left after a tick.
    pub decay: f32,
    /// Jacobian below which foam comes.
    pub threshold: f32,
    /// Foam for each unit of the Jacobian below the threshold.
    pub steepness: f32,
}

impl FoamTick {
    /// Least foam there is.
    pub const LEAST: f32 = crate::waves::fft::steps::LEAST_FOAM;
}

/// Where an instant lies among the ticks of foam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoamInstant {
    /// The tick before.
    pub tick: i64,
    /// The part of the way from there to the next, in [0, 1].
    pub part: f32,
    /// After how many ticks all starts again.
    pub ticks: Option<i64>,
    /// After how many ticks nothing is left of what was.
    pub memory: i64,
}

/// When the waves of a sea break, for those who follow its foam elsewhere.
#[derive(Clone, Debug)]
pub struct Breakers {
    clock: Clock,
    tiles: Vec<Option<Breaking>>,
}

impl Breakers {
    /// Time as waves count it at an instant (s): seconds, or loops from 0 to 1 where the sea repeats itself.
    pub fn time(&self, seconds: f64) -> f64 {
        self.clock.instant(seconds).time
    }

    /// Where an instant (s) lies among the ticks of foam.
    pub fn instant(&self, seconds: f64) -> FoamInstant {
        let instant = self.clock.instant(seconds);
        let memory = foam::memory(foam::decay(&instant));
        FoamInstant { tick: instant.tick, part: instant.part, ticks: instant.ticks, memory }
    }

    /// Whether a tile makes foam.
    pub fn makes_foam(&self, tile: usize) -> bool {
        self.tiles.get(tile).is_some_and(Option::is_some)
    }

    /// What the foam of a tile does at a tick, if it makes any.
    pub fn tick(&self, tile: usize, tick: i64) -> Option<FoamTick> {
        let breaking = self.tiles.get(tile)?.as_ref()?;
        let instant = self.clock.instant(0.0);
        let moment = instant.at_tick(tick);
        let foaming = breaking.foaming(&moment, foam::decay(&instant));
        let (decay, threshold, steepness) = (foaming.decay, foaming.threshold, foaming.steepness);
        Some(FoamTick { time: moment.time, decay, threshold, steepness })
    }
}

impl Spectrum<'_> {
    /// The tile.
    pub fn tile(&self) -> Tile {
        self.patch.tile
    }

    /// Highest magnitude of m and n.
    pub fn rows(&self) -> i32 {
        self.patch.waves.rows
    }

    /// Between neighbouring wave numbers (rad/m).
    pub fn step(&self) -> f64 {
        self.patch.waves.step
    }

    /// Levels of detail: each leaves out the upper half of the wave numbers of the one before, so that half as many samples a side carry it.
    pub fn levels(&self) -> usize {
        self.patch.grids.len()
    }

    /// Variances to be expected of the slopes of a level's waves, in the world's axes (xx, xy, yy). 0 after the last level.
    pub fn slopes(&self, level: usize) -> [f64; 3] {
        self.patch.present.get(level).map_or([0.0; 3], |all| [all[0], all[1], all[2]])
    }

    /// Variance to be expected of the heights of all its waves (m²).
    pub fn variance(&self) -> f64 {
        self.patch.present[0][3]
    }

    /// Samples of a level of detail at the instant where the sea stands: rows from south to north of `side` samples each, and one more, the first of the row again; eight
    /// numbers to a sample, (z, x, ∂x/∂x, y, ∂y/∂y, ∂z/∂x, ∂x/∂y, ∂z/∂y) in the tile's own axes. Levels are made when they are first asked for; none after
    /// the last.
    pub fn samples(&self, level: usize) -> Option<Samples<'_>> {
        let grid = self.patch.grids.get(level)?;
        let stride = 16 * motion_stride(grid.samples());
        Some(Samples { side: grid.samples(), stride, numbers: self.patch.level(level) })
    }

    /// Foam at the instant where the sea stands, at a column and row of samples of the finest level, or on the mean over 2^`level` of them along each
    /// side; 0 for tiles without.
    pub fn foam(&self, level: usize, column: usize, row: usize) -> f32 {
        self.patch.foam.as_ref().map_or(0.0, |foam| foam.mean(level, column, row))
    }

    /// The waves of a place in the lattice; still water beyond its borders.
    pub fn wave(&self, m: i32, n: i32) -> Wave {
        let waves = &self.patch.waves;
        let (group, lane) = (m.div_euclid(16), m.rem_euclid(16) as usize);
        if m.abs() > waves.rows || n.abs() > waves.rows {
            return Wave::default();
        }
        let column = &waves.group(group)[(n + waves.rows) as usize];
        let (kx, ky) = ((f64::from(m) * waves.step) as f32, (f64::from(n) * waves.step) as f32);
        let square = kx.mul_add(kx, ky * ky);
        Wave {
            turns: column.turns[lane],
            sum: [column.sum.re[lane], column.sum.im[lane]],
            difference: [column.difference.re[lane], column.difference.im[lane]],
            reach: column.reach[lane],
            levels: self.patch.grids.iter().take_while(|grid| square < grid.limit).count() as u32,
        }
    }
}

impl Cascades {
    /// The waves of its tiles, as strong as they are at the instant where it stands.
    pub fn spectra(&self) -> impl ExactSizeIterator<Item = Spectrum<'_>> {
        self.patches.iter().map(|patch| Spectrum { patch })
    }

    /// When its waves break.
    pub fn breakers(&self) -> Breakers {
        let tiles = self.patches.iter().map(|patch| patch.foam.as_ref().map(|foam| foam.breaking.clone())).collect();
        Breakers { clock: self.clock.clone(), tiles }
    }
}
