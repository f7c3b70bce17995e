//! The waves of a tile, told one by one: for those who sum them elsewhere, say on a GPU.

use super::patch::Patch;
use super::{Cascades, Tile};

/// Two waves that run against each other over a tile, k and −k.
///
/// Their height at a time t is h e^(ik·x) with h = S cos φ − i D sin φ, φ = 2π `turns` t; that of a whole tile is the sum over all k, and is
/// real because S(−k) = S*(k) and D(−k) = −D*(k).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wave {
    /// Turns of the phase in in a second, or in a whole loop ([`Cascades::period`]), at least 0.
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

    /// Variances to be expected of all waves from a level on: of their slopes in the world's axes (xx, xy, yy). 0 after the last.
    pub fn slopes(&self, level: usize) -> [f64; 3] {
        self.patch.present.get(level).map_or([0.0; 3], |all| [all[0], all[1], all[2]])
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

    /// After how many seconds it repeats itself; its waves then count loops from 0 to 1.
    pub fn period(&self) -> Option<f64> {
        self.clock.period
    }
}
