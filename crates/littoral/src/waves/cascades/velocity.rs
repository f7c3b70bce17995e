//! Orbital velocities at and below the surface: tiles at a few depths, made when first asked for at an instant.
//!
//! Depths stand closer than the waves that reach them are long: straight lines between them err by at most 1.5 % of the velocity that a wave has
//! at the surface. Between samples velocities follow R. Keys' cubic convolution (1981): waves of four samples err by 12 %, of eight by 0.8 %.

use super::super::fft::evolve::Fields;
use super::super::fft::steps::{self, Run, Samples};
use super::super::fft::{Grid, LANES, Wide};
use super::super::model::{BLOCK, Points, Velocity};
use super::Options;
use super::patch::{Lazy, Patch, flat, locked};
use super::plan::Tile;
use super::query::place;
use multiversion::multiversion;
use std::f64::consts::TAU;

/// Ratio of depths that follow each other.
const RATIO: f64 = 1.45;
/// Waves that have faded to e to the minus this are left out.
const FADED: f64 = 7.0;

/// The depths at which a tile's velocities are known.
pub(super) struct Depths {
    levels: Vec<Depth>,
    /// Depth of the water (m).
    bed: f64,
    choppiness: f32,
    /// Angular frequency of a turn in a unit of time.
    angular: f32,
}

struct Depth {
    /// Metres below still water.
    depth: f32,
    /// The grid that carries the waves that are felt there.
    grid: usize,
    samples: Lazy<Samples>,
}

impl Depths {
    pub fn new(tile: &Tile, grids: &[Grid], bed: f64, options: &Options) -> Depths {
        let longest = tile.lowest.max(4.0 * tile.step());
        let mut levels = vec![Depth { depth: 0.0, grid: 0, samples: Lazy::new() }];
        let mut depth = 0.25 / tile.highest;
        while depth * longest < FADED * RATIO && depth < bed {
            let felt = (FADED / depth * (FADED / depth)) as f32;
            let grid = grids.iter().rposition(|g| g.limit >= felt).unwrap_or(0);
            levels.push(Depth { depth: depth as f32, grid, samples: Lazy::new() });
            depth *= RATIO;
        }
        if depth >= bed {
            let grid = levels[levels.len() - 1].grid;
            levels.push(Depth { depth: bed as f32, grid, samples: Lazy::new() });
        }
        let angular = (TAU / options.period.unwrap_or(1.0)) as f32;
        Depths { levels, bed, choppiness: options.choppiness as f32, angular }
    }

    pub fn forget(&mut self) {
        self.levels.iter_mut().for_each(|level| level.samples.forget());
    }
}

impl Patch {
    fn velocities<'a>(&'a self, level: &'a Depth) -> &'a [f32] {
        let grid = &self.grids[level.grid];
        let Depths { choppiness, angular, bed, .. } = self.depths;
        flat(level.samples.get(|samples| {
            samples.resize(grid.samples() * steps::velocity_stride(grid.samples()), Samples([0.0; 16]));
            let between = &mut *locked(&self.spare_between);
            if between.len() < grid.between(2) {
                between.resize(grid.between(2), Wide::ZERO);
            }
            let fields = Fields::Velocity { depth: level.depth, bed: bed as f32, angular, choppiness };
            steps::along_y(Run::ALONE, &self.waves, grid, self.time, fields, between);
            steps::velocity_along_x(Run::ALONE, grid, between, samples);
        }))
    }

    /// Adds the velocities of its waves.
    pub fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        let places = place(self, points);
        let levels = &self.depths.levels;
        let mut rows = [[[0.0f32; 16]; 4]; LANES];
        let (mut u, mut v) = ([0.0f32; LANES], [0.0f32; LANES]);
        let mut sums = [[0.0f32; LANES]; 4];
        // The depth above and the one below, each with its share.
        for part in 0..2 {
            let mut shares = [0.0f32; LANES];
            for l in 0..LANES {
                let depth = depths[l].max(0.0);
                let below = levels.partition_point(|level| level.depth <= depth);
                let (above, share) = match levels.get(below) {
                    _ if f64::from(depth) > self.depths.bed || below == 0 => (0, None),
                    Some(next) => {
                        let before = levels[below - 1].depth;
                        (below - 1, Some((depth - before) / (next.depth - before)))
                    }
                    // Below the last: fading out; upon the bed: all of it.
                    None if self.depths.bed.is_finite() => (below - 1, Some(0.0)),
                    None => (below - 1, Some((depth / levels[below - 1].depth - 1.0).min(1.0))),
                };
                shares[l] = match share {
                    None => 0.0,
                    Some(share) if part == 0 => 1.0 - share,
                    Some(share) => share,
                };
                let Some(level) = levels.get(above + part).filter(|_| shares[l] != 0.0) else {
                    shares[l] = 0.0;
                    continue;
                };
                let n = self.grids[level.grid].samples();
                let samples = self.velocities(level);
                let stride = 16 * steps::velocity_stride(n);
                let (x, y) = (places.x[l] * n as f64, places.y[l] * n as f64);
                let (i, j) = (x as usize & (n - 1), y as usize & (n - 1));
                (u[l], v[l]) = ((x - i as f64) as f32, (y - j as f64) as f32);
                let column = (i + n - 1) & (n - 1);
                for (k, row) in rows[l].iter_mut().enumerate() {
                    let at = ((j + n - 1 + k) & (n - 1)) * stride + 4 * column;
                    row.copy_from_slice(&samples[at..at + 16]);
                }
            }
            convolve(&rows, &u, &v, &shares, &mut sums);
        }
        let (cosine, sine) = (self.turn.0 as f32, self.turn.1 as f32);
        for l in 0..LANES {
            velocity.z[l] += sums[0][l];
            velocity.x[l] += sums[1][l] * cosine - sums[3][l] * sine;
            velocity.y[l] += sums[1][l] * sine + sums[3][l] * cosine;
        }
    }
}

/// Keys' weights of four neighbours, with a = −½.
#[inline(always)]
fn cubic(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [-0.5 * t * s * s, 1.0 + t * t * (1.5 * t - 2.5), 1.0 + s * s * (1.5 * s - 2.5), -0.5 * s * t * t]
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn convolve(
    rows: &[[[f32; 16]; 4]; LANES],
    u: &[f32; LANES],
    v: &[f32; LANES],
    shares: &[f32; LANES],
    sums: &mut [[f32; LANES]; 4],
) {
    for l in 0..LANES {
        let (a, b) = (cubic(u[l]), cubic(v[l]));
        let mut line = [0.0f32; 16];
        for (row, weight) in rows[l].iter().zip(b) {
            for i in 0..16 {
                line[i] = row[i].mul_add(weight, line[i]);
            }
        }
        for i in 0..4 {
            let sum = line[i] * a[0] + line[4 + i] * a[1] + line[8 + i] * a[2] + line[12 + i] * a[3];
            sums[i][l] = if shares[l] != 0.0 { sum.mul_add(shares[l], sums[i][l]) } else { sums[i][l] };
        }
    }
}
