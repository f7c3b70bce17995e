//! Heights over regular grids, by angle addition.
//!
//! Around the middle of a stretch of columns, cos(θ ± kδ) = cos θ cos kδ ∓ sin θ sin kδ: the cosines and sines of kδ are the same in all rows
//! and stretches, those of θ the same in a whole row of a stretch. What is left is a product of matrices, and as the two signs share it, one
//! multiplication a wave and point.

use super::kernel::{FARTHEST, Lanes, circle};
use super::{BLOCK, Sum};
use glam::DVec2;
use multiversion::multiversion;

/// A regular grid of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The first point (m).
    pub origin: DVec2,
    /// From column to column and from row to row (m).
    pub step: DVec2,
    /// Points eastward.
    pub columns: usize,
    /// Points northward.
    pub rows: usize,
}

/// What filling a grid needs room for: nothing is allocated when it has been used for as much before.
#[derive(Clone, Debug, Default)]
pub struct GridScratch {
    /// cos kδ and sin kδ of each wave, by sixteens of columns.
    columns: Vec<[Lanes; 2]>,
    /// Amplitude × cos θ and sin θ of each wave in sixteen rows.
    rows: Vec<[Lanes; 2]>,
}

/// Most columns on either side of a middle: these tables and the rows' stay in the second cache.
const HALF: usize = 128;

/// Most waves at once, for the same reason.
const WAVES: usize = 256;

/// Rows that are summed at once: as many as the registers hold.
const ROWS: usize = 8;

impl Sum {
    /// Heights (m) at all points of a grid, row by row.
    pub(crate) fn fill(&self, grid: &Grid, scratch: &mut GridScratch, heights: &mut [f32]) {
        assert_eq!(heights.len(), grid.columns * grid.rows, "as many heights as points");
        heights.fill(0.0);
        if heights.is_empty() {
            return;
        }
        let fine = |number: f64| if number.abs() <= FARTHEST { number } else { 0.0 };
        let [origin, step] = [grid.origin, grid.step].map(|v| DVec2::new(fine(v.x), fine(v.y)));
        let grid = Grid { origin, step, ..*grid };
        let stretches = grid.columns.div_ceil(2 * HALF);
        let half = grid.columns.div_ceil(2 * stretches);
        for first in (0..self.hot.len()).step_by(WAVES) {
            let waves = first..self.hot.len().min(first + WAVES);
            scratch.columns.clear();
            scratch.columns.resize(half.div_ceil(BLOCK) * waves.len(), [[0.0; BLOCK]; 2]);
            scratch.rows.clear();
            scratch.rows.resize(waves.len(), [[0.0; BLOCK]; 2]);
            turn_columns(self, waves.clone(), step.x, &mut scratch.columns);
            for stretch in 0..stretches {
                // Its first column, and its middle between two.
                let start = 2 * half * stretch;
                let middle = origin.x + step.x * ((start + half) as f64 - 0.5);
                for row in (0..grid.rows).step_by(BLOCK) {
                    turn_rows(self, waves.clone(), middle, origin.y + step.y * row as f64, step.y, &mut scratch.rows);
                    for rows in (row..grid.rows.min(row + BLOCK)).step_by(ROWS) {
                        add_rows(&grid, scratch, rows, rows - row, start, half, heights);
                    }
                }
            }
        }
    }
}

/// Cosines and sines at the columns beside a middle, from half a step on.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn turn_columns(sum: &Sum, waves: std::ops::Range<usize>, step: f64, columns: &mut [[Lanes; 2]]) {
    for (block, columns) in columns.chunks_exact_mut(waves.len()).enumerate() {
        for (kx, table) in sum.kx[waves.clone()].iter().zip(columns) {
            for lane in 0..BLOCK {
                let all = kx * step * ((block * BLOCK + lane) as f64 + 0.5);
                let (cosine, sine) = circle((all - all.round_ties_even()) as f32);
                table[0][lane] = cosine;
                table[1][lane] = sine;
            }
        }
    }
}

/// The waves at a place and northward of it.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn turn_rows(sum: &Sum, waves: std::ops::Range<usize>, x: f64, y: f64, step: f64, rows: &mut [[Lanes; 2]]) {
    for (number, table) in waves.zip(rows) {
        let amplitude = sum.waves[number].wave.amplitude as f32;
        let (kx, ky, turns) = (sum.kx[number], sum.ky[number], sum.turns[number]);
        let start = kx.mul_add(x, ky.mul_add(y, turns));
        for lane in 0..BLOCK {
            let all = (ky * step).mul_add(lane as f64, start);
            let (cosine, sine) = circle((all - all.round_ties_even()) as f32);
            table[0][lane] = amplitude * cosine;
            table[1][lane] = amplitude * sine;
        }
    }
}

/// Adds the waves in rows `row..row + ROWS`, which are those from `turned` on in the tables, to the columns of a stretch.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_rows(
    grid: &Grid,
    scratch: &GridScratch,
    row: usize,
    turned: usize,
    start: usize,
    half: usize,
    heights: &mut [f32],
) {
    let waves = scratch.rows.len();
    for (block, columns) in scratch.columns.chunks_exact(waves).enumerate() {
        // Sixteen accumulators by name, so that each is seen to be a register.
        let ([mut e0, mut e1, mut e2, mut e3], [mut e4, mut e5, mut e6, mut e7]) =
            ([[0f32; BLOCK]; 4], [[0f32; BLOCK]; 4]);
        let ([mut o0, mut o1, mut o2, mut o3], [mut o4, mut o5, mut o6, mut o7]) =
            ([[0f32; BLOCK]; 4], [[0f32; BLOCK]; 4]);
        for (rows, [cosines, sines]) in scratch.rows.iter().zip(columns) {
            let across: &[f32; ROWS] = rows[0][turned..turned + ROWS].try_into().expect("as many");
            let up: &[f32; ROWS] = rows[1][turned..turned + ROWS].try_into().expect("as many");
            for lane in 0..BLOCK {
                let (cosine, sine) = (cosines[lane], sines[lane]);
                e0[lane] = across[0].mul_add(cosine, e0[lane]);
                e1[lane] = across[1].mul_add(cosine, e1[lane]);
                e2[lane] = across[2].mul_add(cosine, e2[lane]);
                e3[lane] = across[3].mul_add(cosine, e3[lane]);
                e4[lane] = across[4].mul_add(cosine, e4[lane]);
                e5[lane] = across[5].mul_add(cosine, e5[lane]);
                e6[lane] = across[6].mul_add(cosine, e6[lane]);
                e7[lane] = across[7].mul_add(cosine, e7[lane]);
                o0[lane] = up[0].mul_add(sine, o0[lane]);
                o1[lane] = up[1].mul_add(sine, o1[lane]);
                o2[lane] = up[2].mul_add(sine, o2[lane]);
                o3[lane] = up[3].mul_add(sine, o3[lane]);
                o4[lane] = up[4].mul_add(sine, o4[lane]);
                o5[lane] = up[5].mul_add(sine, o5[lane]);
                o6[lane] = up[6].mul_add(sine, o6[lane]);
                o7[lane] = up[7].mul_add(sine, o7[lane]);
            }
        }
        let (even, odd) = ([e0, e1, e2, e3, e4, e5, e6, e7], [o0, o1, o2, o3, o4, o5, o6, o7]);
        let beside = (half - block * BLOCK).min(BLOCK);
        let (right, left) = (start + half + block * BLOCK, start + half - block * BLOCK);
        for r in 0..ROWS.min(grid.rows - row) {
            let line = &mut heights[(row + r) * grid.columns..][..grid.columns];
            let (mut after, mut before) = ([0f32; BLOCK], [0f32; BLOCK]);
            for lane in 0..BLOCK {
                after[lane] = even[r][lane] - odd[r][lane];
                before[BLOCK - 1 - lane] = even[r][lane] + odd[r][lane];
            }
            // In the last stretch the columns may end before its right side does.
            let end = (right + beside).min(grid.columns);
            if right < end {
                line[right..end].iter_mut().zip(&after).for_each(|(height, part)| *height += part);
            }
            let (from, to) = (left - beside, left.min(grid.columns));
            if from < to {
                let before = &before[BLOCK - beside..];
                line[from..to].iter_mut().zip(before).for_each(|(height, part)| *height += part);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Motion, PlaneWave, Points, StillWater, Superposition, WaveModel};
    use super::*;

    #[test]
    fn grids_are_what_points_are() {
        let wave = |i: i32| {
            let i = f64::from(i);
            let wavenumber = DVec2::new(libm::cos(i), libm::sin(i)) * (0.02 + 0.005 * i);
            PlaneWave { amplitude: 0.02, wavenumber, angular_frequency: 1.0 + 0.01 * i, phase: i }
        };
        let waves: Vec<PlaneWave> = (0..300).map(wave).collect();
        let mut scratch = GridScratch::default();
        for (count, columns, rows) in [(300, 1, 1), (3, 17, 3), (40, 200, 19), (300, 257, 40), (17, 600, 8), (2, 0, 5)]
        {
            let mut sea = Superposition::new(&waves[..count], StillWater::DEEP).expect("a sea");
            sea.set_time(3e4);
            let grid = Grid { origin: DVec2::new(-5e4, 7e4), step: DVec2::new(0.7, -1.3), columns, rows };
            let mut heights = vec![f32::NAN; columns * rows];
            sea.fill(&grid, &mut scratch, &mut heights);
            for (number, height) in heights.iter().enumerate() {
                let place = DVec2::new((number % columns) as f64, (number / columns) as f64) * grid.step + grid.origin;
                let mut motion = Motion::STILL;
                sea.add_displacement(&Points::at(place.x, place.y), &mut motion);
                assert!(
                    (motion.dz[0] - height).abs() < 2e-5,
                    "{number} of {columns} × {rows}: {height}, {}",
                    motion.dz[0]
                );
            }
        }
        let mut sea = Superposition::new(&waves, StillWater::DEEP).expect("a sea");
        sea.set_time(1.0);
        let odd = Grid { origin: DVec2::NAN, step: DVec2::INFINITY, columns: 20, rows: 3 };
        let mut heights = [f32::NAN; 60];
        sea.fill(&odd, &mut scratch, &mut heights);
        assert!(heights.iter().all(|height| height.is_finite()));
    }
}
