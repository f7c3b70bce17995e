//! One tile at an instant: its waves, its samples at several levels of detail, and its foam.

use super::super::fft::evolve::{Fields, Waves};
use super::super::fft::steps::{self, Run, Samples};
use super::super::fft::{Column, Grid, LANES, Lane, Wide};
use super::super::{SeaState, random};
use super::Options;
use super::clock::Instant;
use super::energy::{Energy, unit};
use super::foam::Foam;
use super::plan::Tile;
use super::velocity::Depths;
use libm::{sqrt, tanh};
use std::f64::consts::TAU;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// Something that is made when it is first asked for at an instant, in memory that is used again.
pub(super) struct Lazy<T> {
    made: OnceLock<Vec<T>>,
    spare: Mutex<Vec<T>>,
}

impl<T> Lazy<T> {
    pub fn new() -> Lazy<T> {
        Lazy { made: OnceLock::new(), spare: Mutex::new(Vec::new()) }
    }

    /// What `make` made of the memory, this time or before. `make` must not wait for other threads.
    pub fn get(&self, make: impl FnOnce(&mut Vec<T>)) -> &[T] {
        self.made.get_or_init(|| {
            let mut memory = std::mem::take(&mut *locked(&self.spare));
            make(&mut memory);
            memory
        })
    }

    pub fn forget(&mut self) {
        if let Some(memory) = self.made.take() {
            *self.spare.get_mut().unwrap_or_else(PoisonError::into_inner) = memory;
        }
    }
}

pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Energies of the waves of a column and of those against them (m²), for one of the states between which a sea changes.
type Energies = [Lane; 2];

/// What is needed to make waves of other amplitudes: only seas that change have it.
struct Changing {
    /// Random numbers of a column's waves and of those against them.
    draws: Vec<[Wide; 2]>,
    energies: Vec<Vec<Energies>>,
}

/// Variances that are to be expected: of slopes (xx, xy, yy in the world's axes), of heights and of the length of sideways displacements (m²).
pub(super) type Variances = [f64; 5];

/// A tile at an instant.
pub(super) struct Patch {
    pub tile: Tile,
    /// Cosine and sine of its turn.
    pub turn: (f64, f64),
    pub waves: Waves,
    changing: Option<Changing>,
    /// The instant's place between states, for which the waves stand.
    blend: (usize, f64),
    /// By level: each leaves out the upper half of the wave numbers of the one before.
    pub grids: Vec<Grid>,
    /// What the waves of each level amount to, by state.
    variances: Vec<Vec<Variances>>,
    /// The same now, and 0 for the level after the last.
    pub present: Vec<Variances>,
    between: Vec<Wide>,
    pub finest: Vec<Samples>,
    pub coarser: Vec<Lazy<Samples>>,
    pub spare_between: Mutex<Vec<Wide>>,
    /// Time as the waves count it.
    pub time: f64,
    pub foam: Option<Foam>,
    pub depths: Depths,
}

impl Patch {
    /// A tile of a sea that goes through `states`, all over water of one depth. `index` tells the tiles of a sea apart.
    pub fn new(tile: Tile, index: usize, states: &[SeaState], energies: &[Energy], options: &Options) -> Patch {
        let (water, seed) = (states[0].water(), states[0].seed);
        let (rows, step) = (tile.rows(), tile.step());
        let mut grids = Vec::new();
        let finest = Grid::new(tile.samples, rows, tile.highest);
        let groups = finest.groups;
        grids.push(finest);
        let mut limit = 0.5 * tile.highest;
        while limit > tile.lowest && limit > 4.0 * step {
            let rows = (limit / step).ceil() as i32 - 1;
            let samples = (tile.samples >> grids.len()).max(64);
            grids.push(Grid::new(samples, rows, limit));
            limit *= 0.5;
        }
        let turn = unit(tile.turn);
        let count = (2 * groups * (2 * rows + 1)) as usize;
        let mut columns = vec![Column::STILL; count];
        let mut draws = vec![[Wide::ZERO; 2]; count];
        let mut shares = vec![vec![[[0.0; LANES]; 2]; count]; states.len()];
        let mut variances = vec![vec![[0.0; 5]; grids.len() + 1]; states.len()];
        let mut stretches = vec![0.0; states.len()];
        let period = options.period;
        for (at, column) in columns.iter_mut().enumerate() {
            let group = at as i32 / (2 * rows + 1) - groups;
            let n = at as i32 % (2 * rows + 1) - rows;
            for l in 0..LANES {
                let m = 16 * group + l as i32;
                let (kx, ky) = (f64::from(m) * step, f64::from(n) * step);
                let k = sqrt(kx * kx + ky * ky);
                if m.abs() > rows || k < tile.lowest || k >= tile.highest || (m, n) == (0, 0) {
                    continue;
                }
                let frequency = water.angular_frequency(k) / TAU;
                column.turns[l] = match period {
                    Some(period) => (frequency * period).round_ties_even(),
                    None => frequency,
                };
                let kh = k * water.depth;
                column.reach[l] = (options.choppiness / (k * if kh > 20.0 { 1.0 } else { tanh(kh) })) as f32;
                let key = |sign: i32| (i64::from(sign * m), i64::from(sign * n), 16 + index as i64);
                let draw = |(m, n, tile): (i64, i64, i64)| random::normal_pair(seed, m, n, tile);
                let ((a, b), (c, d)) = (draw(key(1)), draw(key(-1)));
                (draws[at][0].re[l], draws[at][0].im[l]) = (a as f32, b as f32);
                (draws[at][1].re[l], draws[at][1].im[l]) = (c as f32, -d as f32);
                let (x, y) = (kx * turn.0 - ky * turn.1, kx * turn.1 + ky * turn.0);
                for (state, energy) in energies.iter().enumerate() {
                    let density = |x, y| {
                        if m.abs().max(n.abs()) < 24 { energy.mean_density(x, y, step) } else { energy.density(x, y) }
                    };
                    let (with, against) = (density(x, y) * step * step, density(-x, -y) * step * step);
                    // Both parts of a normal pair have variance 1, and h has both its own and the one against it.
                    shares[state][at][0][l] = (0.25 * with) as f32;
                    shares[state][at][1][l] = (0.25 * against) as f32;
                    for (grid, sum) in grids.iter().zip(&mut variances[state]) {
                        if ((k * k) as f32) < grid.limit {
                            let sideways = f64::from(column.reach[l]) * k;
                            let more = [x * x, x * y, y * y, 1.0, sideways * sideways];
                            *sum = std::array::from_fn(|i| sum[i] + with * more[i]);
                        }
                    }
                    let stretch = f64::from(column.reach[l]) * k * k;
                    stretches[state] += with * stretch * stretch;
                }
            }
        }
        // What a lattice gains or loses along the edges of the band (some percent) is evened out.
        for (state, sea) in states.iter().enumerate() {
            let frequency = |k: f64| water.angular_frequency(k) / TAU;
            let low = frequency(tile.lowest).max(sea.band().map_or(0.0, |(low, _)| 0.5 * low));
            let held = variances[state][0][3];
            if held <= 0.0 || low >= frequency(tile.highest) {
                continue;
            }
            let scale = (sea.moment(0, low, frequency(tile.highest)) / held).clamp(0.5, 2.0);
            shares[state].iter_mut().flatten().flatten().for_each(|share| *share = (f64::from(*share) * scale) as f32);
            variances[state].iter_mut().flatten().for_each(|variance| *variance *= scale);
            stretches[state] *= scale;
        }
        let coarser = grids[1..].iter().map(|_| Lazy::new()).collect();
        let rows_of_samples = tile.samples * steps::motion_stride(tile.samples);
        let mut patch = Patch {
            turn,
            waves: Waves { columns, groups, rows, step },
            changing: Some(Changing { draws, energies: shares }),
            blend: (usize::MAX, 0.0),
            present: vec![[0.0; 5]; grids.len() + 1],
            variances,
            between: vec![Wide::ZERO; grids[0].between(4)],
            finest: vec![Samples([0.0; 16]); rows_of_samples],
            coarser,
            spare_between: Mutex::new(Vec::new()),
            time: 0.0,
            foam: options.foam.then(|| Foam::new(&tile, &stretches, states)).flatten(),
            depths: Depths::new(&tile, &grids, water.depth, options),
            grids,
            tile,
        };
        patch.set_blend((0, 0.0));
        if states.len() == 1 {
            patch.changing = None;
        }
        patch
    }

    /// Goes to a place between states.
    fn set_blend(&mut self, blend: (usize, f64)) {
        let (Some(changing), true) = (&self.changing, self.blend != blend) else { return };
        self.blend = blend;
        let (state, share) = blend;
        let last = changing.energies.len() - 1;
        let (from, to) = (&changing.energies[state.min(last)], &changing.energies[(state + 1).min(last)]);
        let share_to = share as f32;
        let share_from = 1.0 - share_to;
        for (((column, draws), from), to) in self.waves.columns.iter_mut().zip(&changing.draws).zip(from).zip(to) {
            for l in 0..LANES {
                let with = (from[0][l] * share_from + to[0][l] * share_to).sqrt();
                let against = (from[1][l] * share_from + to[1][l] * share_to).sqrt();
                let (a, b) = (draws[0].re[l] * with, draws[1].re[l] * against);
                (column.sum.re[l], column.difference.re[l]) = (a + b, a - b);
                let (a, b) = (draws[0].im[l] * with, draws[1].im[l] * against);
                (column.sum.im[l], column.difference.im[l]) = (a + b, a - b);
            }
        }
        let (from, to) = (&self.variances[state.min(last)], &self.variances[(state + 1).min(last)]);
        for ((present, from), to) in self.present.iter_mut().zip(from).zip(to) {
            *present = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share);
        }
    }

    /// Goes to an instant.
    pub fn set(&mut self, run: Run, instant: &Instant) {
        let mut foam = self.foam.take();
        if let Some(foam) = &mut foam {
            foam.set(instant, |tick, foaming, before, after| {
                self.set_blend(tick.blend);
                steps::along_y(run, &self.waves, &self.grids[0], tick.time, Fields::Stretch, &mut self.between);
                steps::foam_along_x(run, &self.grids[0], &self.between, foaming, before, after);
            });
        }
        self.foam = foam;
        self.set_blend(instant.blend);
        self.time = instant.time;
        self.coarser.iter_mut().for_each(Lazy::forget);
        self.depths.forget();
        steps::along_y(run, &self.waves, &self.grids[0], self.time, Fields::Motion, &mut self.between);
        steps::motion_along_x(run, &self.grids[0], &self.between, &mut self.finest);
    }

    /// Samples of motion at a level of detail.
    pub fn level(&self, level: usize) -> &[f32] {
        if level == 0 {
            return flat(&self.finest);
        }
        let grid = &self.grids[level];
        flat(self.coarser[level - 1].get(|samples| {
            samples.resize(grid.samples() * steps::motion_stride(grid.samples()), Samples([0.0; 16]));
            let between = &mut *locked(&self.spare_between);
            if between.len() < grid.between(4) {
                between.resize(grid.between(4), Wide::ZERO);
            }
            steps::along_y(Run::ALONE, &self.waves, grid, self.time, Fields::Motion, between);
            steps::motion_along_x(Run::ALONE, grid, between, samples);
        }))
    }

    /// Memory it takes (bytes), without what is made on demand.
    pub fn bytes(&self) -> usize {
        let changing = self
            .changing
            .as_ref()
            .map_or(0, |c| size_of_val(&c.draws[..]) + c.energies.iter().map(|e| size_of_val(&e[..])).sum::<usize>());
        size_of_val(&self.waves.columns[..])
            + changing
            + size_of_val(&self.between[..])
            + size_of_val(&self.finest[..])
            + self.foam.as_ref().map_or(0, Foam::bytes)
    }
}

pub(super) fn flat(samples: &[Samples]) -> &[f32] {
    bytemuck::cast_slice(samples)
}
