//! Deviations row by row: taken from blocks, and raised to those of their children.

use super::blocks::{self, Blocks};
use super::{Level, Rtin};
use multiversion::multiversion;

/// The greatest errors of a square: of its halves, and of its southern, eastern, northern and western quarter (m).
pub(super) type Errors = [f32; 5];

/// The deviations of a strip's squares of one size.
pub(super) struct Rows<'a> {
    /// Columns of squares, and rows of them in this strip.
    pub columns: usize,
    pub rows: usize,
    pub centres: &'a mut [f32],
    /// Lines of sides from the southern one on; the northernmost is the next strip's, except at the raster's border.
    flat: &'a mut [f32],
    upright: &'a mut [f32],
    /// What this strip finds for the next one's first line.
    pub seam: Vec<f32>,
}

impl Rows<'_> {
    fn line(&mut self, line: usize) -> &mut [f32] {
        let columns = self.columns;
        match self.flat.len() > line * columns {
            true => &mut self.flat[line * columns..][..columns],
            false => &mut self.seam,
        }
    }

    /// Notes what was found of a square.
    pub fn raise(&mut self, x: usize, y: usize, [centre, south, east, north, west]: Errors) {
        let columns = self.columns;
        raise(&mut self.centres[y * columns + x], centre);
        raise(&mut self.line(y)[x], south);
        raise(&mut self.line(y + 1)[x], north);
        raise(&mut self.upright[y * (columns + 1) + x], west);
        raise(&mut self.upright[y * (columns + 1) + x + 1], east);
    }

    /// Raises sides to the centres of the next finer size, and centres to their sides.
    pub fn nest(&mut self, finer: Option<(&[f32], usize)>) {
        for y in 0..self.rows {
            if let Some((centres, wide)) = finer {
                for (j, centres) in centres.chunks_exact(wide).skip(2 * y).take(2).enumerate() {
                    raise_flat(self.line(y + j), centres);
                    raise_upright(&mut self.upright[y * (self.columns + 1)..][..self.columns + 1], centres);
                }
            }
        }
        for y in 0..self.rows {
            let columns = self.columns;
            let (south, north) = (y * columns, (y + 1) * columns);
            let north: &[f32] = if self.flat.len() > north { &self.flat[north..][..columns] } else { &self.seam };
            let upright = &self.upright[y * (columns + 1)..][..columns + 1];
            raise_centres(&mut self.centres[south..][..columns], &self.flat[south..][..columns], north, upright);
        }
    }
}

pub(super) fn raise(kept: &mut f32, found: f32) {
    if found > *kept {
        *kept = found;
    }
}

#[inline(always)]
pub(super) fn greater(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn raise_flat(sides: &mut [f32], centres: &[f32]) {
    let (pairs, last) = centres.as_chunks::<2>();
    for (side, [a, b]) in sides.iter_mut().zip(pairs) {
        *side = greater(*side, greater(*a, *b));
    }
    if let [last] = last {
        sides[pairs.len()] = greater(sides[pairs.len()], *last);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn raise_upright(sides: &mut [f32], centres: &[f32]) {
    sides[0] = greater(sides[0], centres[0]);
    let (pairs, last) = centres[1..].as_chunks::<2>();
    for (side, [a, b]) in sides[1..].iter_mut().zip(pairs) {
        *side = greater(*side, greater(*a, *b));
    }
    if let [last] = last {
        sides[1 + pairs.len()] = greater(sides[1 + pairs.len()], *last);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn raise_centres(centres: &mut [f32], south: &[f32], north: &[f32], upright: &[f32]) {
    let n = centres.len();
    let (centres, south, north) = (&mut centres[..n], &south[..n], &north[..n]);
    let (west, east) = (&upright[..n], &upright[1..][..n]);
    for x in 0..n {
        let sides = greater(greater(south[x], north[x]), greater(west[x], east[x]));
        centres[x] = greater(centres[x], sides);
    }
}

/// The deviations of small squares, strip by strip.
pub(super) fn split<'a>(mut deviations: &'a mut [f32], levels: &[Level], strips: usize) -> Vec<Vec<Rows<'a>>> {
    let mut sizes: Vec<Vec<Rows>> = (0..strips).map(|_| Vec::new()).collect();
    for (k, level) in levels.iter().enumerate() {
        let (centres, rest) = deviations.split_at_mut(level.columns * level.rows);
        let (flat, rest) = rest.split_at_mut(level.columns * (level.rows + 1));
        let (upright, rest) = rest.split_at_mut((level.columns + 1) * level.rows);
        deviations = rest;
        let (columns, across) = (level.columns, blocks::across(k));
        let chunks = centres.chunks_mut(columns * across).zip(flat.chunks_mut(columns * across));
        let chunks = chunks.zip(upright.chunks_mut((columns + 1) * across));
        for (strip, ((centres, flat), upright)) in sizes.iter_mut().zip(chunks) {
            let rows = centres.len() / columns;
            strip.push(Rows { columns, rows, centres, flat, upright, seam: vec![0.0; columns] });
        }
    }
    sizes
}

/// Takes over what was found in blocks side by side.
pub(super) fn collect(blocks: &Blocks, k: usize, list: &[usize], rows: &mut Rows) {
    let (across, columns) = (blocks::across(k), rows.columns);
    for y in 0..across {
        let row = blocks.row(k, 0, y);
        for (lane, block) in list.iter().enumerate() {
            let centres = &mut rows.centres[y * columns + block * across..][..across];
            centres.iter_mut().zip(row).for_each(|(centre, found)| *centre = found[lane]);
        }
        let row = blocks.row(k, 2, y);
        for (lane, block) in list.iter().enumerate() {
            let sides = &mut rows.upright[y * (columns + 1) + block * across..][..across + 1];
            sides.iter_mut().zip(row).for_each(|(side, found)| raise(side, found[lane]));
        }
    }
    for y in 0..=across {
        let (row, line) = (blocks.row(k, 1, y), rows.line(y));
        for (lane, block) in list.iter().enumerate() {
            let sides = &mut line[block * across..][..across];
            sides.iter_mut().zip(row).for_each(|(side, found)| *side = found[lane]);
        }
    }
}

/// Raises the sides of some rows of squares to the centres of the finer squares that they are a part of.
pub(super) fn nest_sides(rtin: &mut Rtin, k: usize, rows: std::ops::Range<usize>) {
    if k == 0 {
        return;
    }
    let (level, finer) = (rtin.levels[k], rtin.levels[k - 1]);
    // Finer sizes lie before coarser ones.
    let (before, here) = rtin.deviations.split_at_mut(level.centres);
    let (flat, upright) = here[level.flat - level.centres..].split_at_mut(level.upright - level.flat);
    let columns = level.columns;
    for y in rows {
        for j in 0..2.min(finer.rows - 2 * y) {
            let centres = &before[finer.centre(0, 2 * y + j)..][..finer.columns];
            raise_flat(&mut flat[(y + j) * columns..][..columns], centres);
            raise_upright(&mut upright[y * (columns + 1)..][..columns + 1], centres);
        }
    }
}

/// Raises the centres of some rows of squares to their sides.
pub(super) fn nest_centres(rtin: &mut Rtin, k: usize, rows: std::ops::Range<usize>) {
    let level = rtin.levels[k];
    let (centres, sides) = rtin.deviations[level.centres..].split_at_mut(level.flat - level.centres);
    let (flat, upright) = sides.split_at(level.upright - level.flat);
    let columns = level.columns;
    for y in rows {
        let (south, north) = (&flat[y * columns..][..columns], &flat[(y + 1) * columns..][..columns]);
        let upright = &upright[y * (columns + 1)..][..columns + 1];
        raise_centres(&mut centres[y * columns..][..columns], south, north, upright);
    }
}
