//! How wrong a coarse drawing of sampled land is: a bound for every cell of the quadtree.
//!
//! A cell drawn as two triangles over its corners differs from the exact surface most at a sample, or, along the diagonal,
//! inside a patch that the diagonal cuts: there the surface is a parabola that leaves its chord by a quarter of the patch's
//! twist. So each cell's bound is the greatest difference at its samples (for both diagonals), plus the greatest quarter
//! twist along its diagonals; and never less than its children's, which makes the bounds nested. Differences are taken at
//! every sample for every level, not accumulated from level to level: accumulated bounds are cheaper to build, and
//! several times too large.
//!
//! Works this rests on: M. Duchaineau et al., "ROAMing terrain", 1997 (nested bounds); P. Lindstrom and V. Pascucci,
//! "Terrain simplification simplified", 2002 (bounds that nest are all that refinement needs).

use super::{Raster, Window};
use crate::memory::in_large_pages;
use crate::space::Cell;
use multiversion::multiversion;
use rayon::prelude::*;

/// Error bounds of every cell above the patches; patches answer from their own corners.
#[derive(Clone, Debug)]
pub struct ErrorPyramid {
    /// Level of the patches in the quadtree.
    finest: u8,
    /// For k = 1, 2, …: the bounds of cells of 2ᵏ × 2ᵏ patches, row by row, as many as touch the raster.
    levels: Vec<CellBounds>,
}

#[derive(Clone, Debug)]
struct CellBounds {
    columns: usize,
    rows: usize,
    bounds: Vec<f32>,
}

impl CellBounds {
    /// Copies rows of so many bounds, from the first of `bounds` on.
    fn copy<const COLUMNS: usize>(&self, bounds: &[f32], errors: &mut [f32]) -> bool {
        for (errors, bounds) in errors.as_chunks_mut::<COLUMNS>().0.iter_mut().zip(bounds.chunks(self.columns)) {
            if let Some((row, next)) = bounds.split_first_chunk() {
                *errors = *row;
                ask_for(next, COLUMNS);
            }
        }
        true
    }
}

/// Up to this many patches a side an edited cell is measured anew; larger ones only grow, unless a corner moved or there
/// are voids.
const REMEASURED_SIDE: usize = 64;

impl ErrorPyramid {
    /// Measures `raster`, whose patches are the cells of level `finest`.
    pub fn build(raster: &Raster, finest: u8) -> ErrorPyramid {
        let mut pyramid = ErrorPyramid { finest, levels: Vec::with_capacity(finest.into()) };
        for k in 1..=u32::from(finest) {
            let columns = (raster.columns() - 1).div_ceil(1 << k);
            let rows = (raster.rows() - 1).div_ceil(1 << k);
            let mut bounds = in_large_pages(vec![0.0; columns * rows]);
            bounds.par_chunks_mut(columns).enumerate().for_each(|(y, line)| {
                for (x, bound) in line.iter_mut().enumerate() {
                    *bound = pyramid.bound(raster, k, x, y);
                }
            });
            pyramid.levels.push(CellBounds { columns, rows, bounds });
        }
        pyramid
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| level.bounds.len() * size_of::<f32>()).sum()
    }

    /// The bound (m) for a cell: see [`HeightField::error`](super::HeightField::error).
    pub fn error(&self, raster: &Raster, cell: Cell) -> f32 {
        match self.finest.checked_sub(cell.level) {
            Some(k) if k > 0 => self.stored(u32::from(k), cell.x as usize, cell.y as usize),
            // A patch, or a part of one: triangles leave a bilinear surface by a quarter of its twist, and a part of a
            // patch has a fraction of its twist.
            _ => {
                let finer = u32::from(cell.level - self.finest);
                let twist = patch_twist(raster, (cell.x >> finer) as usize, (cell.y >> finer) as usize).unwrap_or(0.0);
                twist * f32::exp2(-2.0 * finer as f32)
            }
        }
    }

    /// The same for cells in rows of so many `columns`, `first` being the south-western one, each a square of several patches; `false` if they are smaller.
    pub(super) fn rows(&self, first: Cell, columns: usize, errors: &mut [f32]) -> bool {
        let Some(k) = self.finest.checked_sub(first.level).filter(|&k| k > 0) else { return false };
        let level = &self.levels[usize::from(k) - 1];
        let (column, row) = (first.x as usize, first.y as usize);
        if column + columns <= level.columns && row + errors.len() / columns <= level.rows {
            let bounds = &level.bounds[row * level.columns + column..];
            // Rows of these lengths are copied without a call for each.
            match columns {
                2 => return level.copy::<2>(bounds, errors),
                4 => return level.copy::<4>(bounds, errors),
                8 => return level.copy::<8>(bounds, errors),
                16 => return level.copy::<16>(bounds, errors),
                32 => return level.copy::<32>(bounds, errors),
                _ => (),
            }
        }
        for (j, errors) in errors.chunks_mut(columns).enumerate() {
            self.row(Cell { y: first.y + j as u32, ..first }, errors);
        }
        true
    }

    /// The same for cells in a row, `first` being the westernmost, each a square of several patches; `false` if they are smaller.
    pub(super) fn row(&self, first: Cell, errors: &mut [f32]) -> bool {
        let Some(k) = self.finest.checked_sub(first.level).filter(|&k| k > 0) else { return false };
        let level = &self.levels[usize::from(k) - 1];
        let (column, row) = (first.x as usize, first.y as usize);
        let inside = if row < level.rows { level.columns.saturating_sub(column).min(errors.len()) } else { 0 };
        let (within, beyond) = errors.split_at_mut(inside);
        if inside > 0 {
            let bounds = &level.bounds[row * level.columns + column..];
            within.copy_from_slice(&bounds[..inside]);
            ask_for(&bounds[inside..], inside);
        }
        beyond.fill(0.0);
        true
    }

    /// The greatest bound (m) of the cells `depth` levels below `cell`: see [`HeightField::stencil_error`](super::HeightField::stencil_error).
    pub fn finer(&self, raster: &Raster, cell: Cell, depth: u8) -> f32 {
        let Some(k) = self.finest.checked_sub(cell.level + depth).filter(|&k| k > 0) else {
            // Patches, or parts of them.
            let depth = depth.min(Cell::MAX_LEVEL - cell.level);
            let patches = depth.min(self.finest.saturating_sub(cell.level));
            let (side, scale) = (1u32 << patches, 1u32 << (depth - patches));
            let level = cell.level + depth;
            let indices = (0..side * side).map(|i| (i % side, i / side));
            let finer = indices.map(|(i, j)| Cell {
                level,
                x: ((cell.x << patches) + i) * scale,
                y: ((cell.y << patches) + j) * scale,
                ..cell
            });
            return finer.fold(0.0, |most, cell| self.error(raster, cell).max(most));
        };
        let level = &self.levels[usize::from(k) - 1];
        let (left, bottom) = ((cell.x as usize) << depth, (cell.y as usize) << depth);
        let (right, top) = ((left + (1 << depth)).min(level.columns), (bottom + (1 << depth)).min(level.rows));
        let lines = (bottom..top).filter(|_| left < right).map(|y| &level.bounds[y * level.columns..][left..right]);
        lines.flatten().fold(0.0f32, |most, &bound| if bound > most { bound } else { most })
    }

    /// Brings the bounds up to date after the samples of `window` changed. Cells too large to be measured anew keep a
    /// bound that holds but may be higher than a fresh build's.
    pub fn update(&mut self, raster: &Raster, window: Window) {
        for k in 1..=u32::from(self.finest) {
            let side = 1usize << k;
            let (columns, rows) = (self.levels[k as usize - 1].columns, self.levels[k as usize - 1].rows);
            let touched = |first: usize, count: usize, cells: usize| {
                let low = first.saturating_sub(1) >> k;
                low..((first + count - 1) >> k).min(cells - 1) + 1
            };
            for y in touched(window.row, window.rows, rows) {
                for x in touched(window.column, window.columns, columns) {
                    let (left, bottom) = (x << k, y << k);
                    let moved = |c: usize, r: usize| {
                        (window.column..window.column + window.columns).contains(&c)
                            && (window.row..window.row + window.rows).contains(&r)
                    };
                    let corner_moved = [(0, 0), (side, 0), (0, side), (side, side)]
                        .into_iter()
                        .any(|(i, j)| moved(left + i, bottom + j));
                    let old = self.levels[k as usize - 1].bounds[y * columns + x];
                    let new = if side <= REMEASURED_SIDE || corner_moved || old.is_infinite() || raster.voids().any() {
                        self.bound(raster, k, x, y)
                    } else {
                        let part = self.children(raster, k, x, y);
                        part.max(old).max(cell_deviation(raster, left, bottom, side, Some(window)))
                    };
                    self.levels[k as usize - 1].bounds[y * columns + x] = new;
                }
            }
        }
    }

    fn stored(&self, k: u32, x: usize, y: usize) -> f32 {
        let level = &self.levels[k as usize - 1];
        if x < level.columns && y < level.rows { level.bounds[y * level.columns + x] } else { 0.0 }
    }

    /// The greatest bound among the four children of a cell; infinite if some have a surface and some have none.
    fn children(&self, raster: &Raster, k: u32, x: usize, y: usize) -> f32 {
        [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().fold(0.0, |worst: f32, (i, j)| {
            let (x, y) = (2 * x + i, 2 * y + j);
            let bound = match k {
                1 => patch_twist(raster, x, y).unwrap_or(0.0),
                _ => self.stored(k - 1, x, y),
            };
            worst.max(bound)
        })
    }

    /// The bound of the cell of 2ᵏ patches a side in column `x` and row `y`, its children's being known.
    fn bound(&self, raster: &Raster, k: u32, x: usize, y: usize) -> f32 {
        let side = 1usize << k;
        let (left, bottom) = (x << k, y << k);
        let own = match surface(raster, left, bottom, side) {
            Coverage::Empty => return 0.0,
            Coverage::Partial => return f32::INFINITY,
            Coverage::Whole => match k {
                1 => small_cell_deviation::<2>(raster, left, bottom),
                2 => small_cell_deviation::<4>(raster, left, bottom),
                3 => small_cell_deviation::<8>(raster, left, bottom),
                _ => cell_deviation(raster, left, bottom, side, None),
            },
        };
        own.max(self.children(raster, k, x, y))
    }
}

/// Asks for the next numbers of a row, which who looked at those before looks at next.
fn ask_for(next: &[f32], count: usize) {
    #[cfg(target_arch = "x86_64")]
    for number in next[..count.min(next.len())].chunks(16).filter_map(|line| line.last()) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: neither reads nor writes.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(number).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (next, count);
}

enum Coverage {
    Empty,
    Partial,
    Whole,
}

/// Whether the patches of a cell exist: all, some, or none.
fn surface(raster: &Raster, left: usize, bottom: usize, side: usize) -> Coverage {
    let whole = left + side < raster.columns() && bottom + side < raster.rows();
    if whole && !raster.voids().any() {
        return Coverage::Whole;
    }
    let (right, top) = ((left + side).min(raster.columns() - 1), (bottom + side).min(raster.rows() - 1));
    let exists = |c: usize, r: usize| patch_twist(raster, c, r).is_some();
    let mut patches = (bottom..top).flat_map(|r| (left..right).map(move |c| (c, r)));
    if !raster.voids().any() {
        return if patches.next().is_some() { Coverage::Partial } else { Coverage::Empty };
    }
    let first = patches.next().map(|(c, r)| exists(c, r));
    match first {
        None => Coverage::Empty,
        Some(first) if patches.any(|(c, r)| exists(c, r) != first) => Coverage::Partial,
        Some(false) => Coverage::Empty,
        Some(true) if whole => Coverage::Whole,
        Some(true) => Coverage::Partial,
    }
}

/// A quarter of the twist of a patch: how far two triangles over its corners leave it. `None` where it does not exist.
fn patch_twist(raster: &Raster, column: usize, row: usize) -> Option<f32> {
    if column + 1 >= raster.columns() || row + 1 >= raster.rows() {
        return None;
    }
    let at = |i, j| raster.sample(column + i, row + j);
    Some(quarter_twist([at(0, 0)?, at(1, 0)?, at(0, 1)?, at(1, 1)?]))
}

#[inline(always)]
pub(super) fn quarter_twist([a, b, c, d]: [f32; 4]) -> f32 {
    // Three roundings of differences, paid for by one part in two million of the heights.
    let size = a.abs().max(b.abs()).max(c.abs().max(d.abs()));
    0.25 * ((a - b) - (c - d)).abs() + size * f32::EPSILON
}

/// The same for patches in a row, between their samples to the south and to the north.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn quarter_twists(south: &[f32], north: &[f32], twists: &mut [f32]) {
    let count = twists.len();
    let (south, north) = (&south[..count + 1], &north[..count + 1]);
    for i in 0..count {
        twists[i] = quarter_twist([south[i], south[i + 1], north[i], north[i + 1]]);
    }
}

/// The greatest vertical distance between the surface of a whole cell and two triangles over its corners, whichever
/// diagonal: at all its samples, or at those in `window` only.
fn cell_deviation(raster: &Raster, left: usize, bottom: usize, side: usize, window: Option<Window>) -> f32 {
    let heights = raster.heights();
    let columns = raster.columns();
    let at = |i: usize, j: usize| heights[(bottom + j) * columns + left + i];
    let (a, b, c, d) = (at(0, 0), at(side, 0), at(0, side), at(side, side));
    let size = [a, b, c, d].into_iter().fold(0.0f32, |m, h| m.max(h.abs()));
    let scale = 1.0 / side as f32; // exact: a power of two

    let (mut first, mut last, mut low_row, mut high_row) = (0, side, 0, side);
    if let Some(w) = window {
        // One more sample on each side: the patches that touch a changed sample change their twist.
        first = (w.column.max(left + 1) - left - 1).min(side);
        last = (w.column + w.columns).saturating_sub(left).min(side);
        low_row = (w.row.max(bottom + 1) - bottom - 1).min(side);
        high_row = (w.row + w.rows).saturating_sub(bottom).min(side);
    }
    let (mut worst, mut steepest_twist) = (0.0f32, 0.0f32);
    for j in low_row..=high_row {
        let v = j as f32 * scale;
        let line = &heights[(bottom + j) * columns + left..][..=side];
        // Diagonal from south-west to north-east: the row lies in the upper triangle up to i = j, then in the lower.
        let (upper, upper_step) = (a + (c - a) * v, (d - c) * scale);
        let (lower, lower_step) = (a + (d - b) * v, (b - a) * scale);
        // Diagonal from south-east to north-west: in the lower triangle up to i = side − j, then in the upper.
        let (west, west_step) = (a + (c - a) * v, (b - a) * scale);
        let (east, east_step) = (d + (b - d) * (1.0 - v) - (d - c), (d - c) * scale);
        let segments = [
            (first, j.min(last), upper, upper_step),
            (j.max(first), last, lower, lower_step),
            (first, (side - j).min(last), west, west_step),
            ((side - j).max(first), last, east, east_step),
        ];
        for (from, to, start, step) in segments {
            if from <= to {
                worst = worst.max(line_deviation(&line[from..=to], from as f32, start, step));
            }
        }
        if j < high_row.min(side) {
            for i in [j, side - 1 - j] {
                if (first..last).contains(&i) {
                    steepest_twist =
                        steepest_twist.max(quarter_twist([at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]));
                }
            }
        }
    }
    bound_of(worst, steepest_twist, size)
}

/// The same as [`cell_deviation`] for cells of few patches, in which whole rows are too short to be worth their overhead.
fn small_cell_deviation<const SIDE: usize>(raster: &Raster, left: usize, bottom: usize) -> f32 {
    let columns = raster.columns();
    let base = bottom * columns + left;
    let heights = &raster.heights()[base..base + SIDE * columns + SIDE + 1];
    let (a, b, c, d) = (heights[0], heights[SIDE], heights[SIDE * columns], heights[SIDE * columns + SIDE]);
    let (mut worst, mut steepest_twist) = (0.0f32, 0.0f32);
    for j in 0..=SIDE {
        let line = &heights[j * columns..][..SIDE + 1];
        for (i, &height) in line.iter().enumerate() {
            let (u, v) = (i as f32 / SIDE as f32, j as f32 / SIDE as f32);
            let rising = if i >= j { a + (b - a) * u + (d - b) * v } else { a + (d - c) * u + (c - a) * v };
            let falling =
                if i + j <= SIDE { a + (b - a) * u + (c - a) * v } else { c + (d - c) * u + (b - d) * (1.0 - v) };
            let (rising, falling) = ((height - rising).abs(), (height - falling).abs());
            worst = if rising > worst { rising } else { worst };
            worst = if falling > worst { falling } else { worst };
        }
        if j < SIDE {
            let above = &heights[(j + 1) * columns..][..SIDE + 1];
            for i in [j, SIDE - 1 - j] {
                steepest_twist = steepest_twist.max(quarter_twist([line[i], line[i + 1], above[i], above[i + 1]]));
            }
        }
    }
    let size = [a, b, c, d].into_iter().fold(0.0f32, |m, h| m.max(h.abs()));
    bound_of(worst, steepest_twist, size)
}

/// What holds for the true surface when `worst` and `twist` were computed in `f32` from heights about as large as `size`.
fn bound_of(worst: f32, twist: f32, size: f32) -> f32 {
    // A dozen roundings of numbers no larger than a few times the corners' size, and of the difference itself.
    (worst + twist + (4.0 * size + worst) * 4.0 * f32::EPSILON).next_up()
}

/// The greatest distance of `heights` from the line `start + (from + i) · step`.
fn line_deviation(heights: &[f32], from: f32, start: f32, step: f32) -> f32 {
    const LANES: usize = 16;
    let mut worst = [0.0f32; LANES];
    let mut chunks = heights.chunks_exact(LANES);
    let mut base = from;
    for chunk in &mut chunks {
        for lane in 0..LANES {
            let difference = (chunk[lane] - (start + (base + lane as f32) * step)).abs();
            worst[lane] = if difference > worst[lane] { difference } else { worst[lane] };
        }
        base += LANES as f32;
    }
    let tail = chunks.remainder().iter().enumerate();
    let tail = tail.fold(0.0f32, |w, (i, h)| w.max((h - (start + (base + i as f32) * step)).abs()));
    worst.into_iter().fold(tail, f32::max)
}
