//! The range pyramid: how low and how high the bilinear surface reaches over every aligned square of patches.
//!
//! A *patch* is the bilinear surface between four neighbouring samples. A node of level n covers 2ⁿ × 2ⁿ patches, the
//! samples on its border included, so that its range bounds the surface itself and not just the samples inside (a
//! bilinear patch never leaves the range of its corners). Level 0, the patches, is not stored: their corners say it.
//! Patches with a void corner have no surface and count for nothing; a node without any surface is empty. Ranges are
//! kept as 16-bit steps rounded outward, low and high apart because most rays only ask for one: 1.33 bytes a sample, and
//! 0.17 for the blocks and windows that single rays and lines of sight go by.
//!
//! Works this rests on: A. Tevs, I. Ihrke, H.-P. Seidel, "Maximum mipmaps for fast, accurate, and scalable dynamic height
//! field rendering", I3D 2008; spec page 004, "The height map as a shape texture", for the pyramid by itself.

use super::blocks::Blocks;
use super::windows::Windows;
use super::{HeightRange, Raster, Window};
use crate::memory::in_large_pages;
use rayon::prelude::*;

/// Where the nodes of one level lie in the flat arrays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Level {
    /// Index of the first node.
    pub offset: usize,
    /// Nodes along x.
    pub columns: usize,
    /// Nodes along y.
    pub rows: usize,
}

/// Ranges of all aligned squares of 2 × 2, 4 × 4, … patches of a raster.
#[derive(Clone, Debug)]
pub struct RangePyramid {
    /// Height (m) that step 0 stands for.
    pub(crate) base: f32,
    /// Height (m) of one step.
    pub(crate) step: f32,
    /// Lowest and highest valid sample.
    pub(crate) range: HeightRange,
    /// `levels[n - 1]` is level n.
    pub(crate) levels: Vec<Level>,
    /// Steps, level after level, rounded down; [`EMPTY_LOW`] without surface. One number of padding at the end, so that
    /// pairs may be read at any node.
    pub(crate) lows: Vec<u16>,
    /// Steps rounded up; [`EMPTY_HIGH`] without surface.
    pub(crate) highs: Vec<u16>,
    /// The same highs in blocks.
    pub(crate) blocks: Blocks,
    /// The same highs over windows of nodes.
    pub(crate) windows: Windows,
}

/// What an empty node holds: a low above every high …
pub(crate) const EMPTY_LOW: u16 = u16::MAX;
/// … and a high below every low.
pub(crate) const EMPTY_HIGH: u16 = 0;

/// Steps are dealt out from 1 to this, so that the empty marks stay apart and rounding has room.
const STEPS: f32 = 65_500.0;

impl RangePyramid {
    /// Builds the pyramid of a raster: one pass for the range of all samples, one for everything else.
    pub fn new(raster: &Raster) -> RangePyramid {
        let range = raster_range(raster);
        let (base, step) = scale(range);
        let (mut columns, mut rows) = (raster.columns() - 1, raster.rows() - 1);
        let (mut levels, mut offset) = (Vec::new(), 0);
        loop {
            (columns, rows) = (columns.div_ceil(2), rows.div_ceil(2));
            levels.push(Level { offset, columns, rows });
            offset += columns * rows;
            if columns == 1 && rows == 1 {
                break;
            }
        }
        let (lows, highs) = (in_large_pages(vec![0; offset + 1]), in_large_pages(vec![0; offset + 1]));
        let (blocks, windows) = (Blocks::default(), Windows::default());
        let mut pyramid = RangePyramid { base, step, range, levels, lows, highs, blocks, windows };
        let first = pyramid.levels[0];
        let (lows, highs) = (&mut pyramid.lows[..first.columns * first.rows], &mut pyramid.highs[..]);
        let kernel = Kernel { base, step };
        // Bands of rows rather than single ones, so that their shared sample rows come from cache.
        let band = 16 * first.columns;
        let bands = lows.par_chunks_mut(band).zip(highs[..first.columns * first.rows].par_chunks_mut(band)).enumerate();
        bands.for_each(|(index, (lows, highs))| {
            let mut scratch = Scratch::default();
            let lines = lows.chunks_mut(first.columns).zip(highs.chunks_mut(first.columns)).enumerate();
            for (line, (low, high)) in lines {
                kernel.patches_row(raster, index * 16 + line, 0, &mut scratch, low, high);
            }
        });
        for n in 1..pyramid.levels.len() {
            let Level { columns, rows, .. } = pyramid.levels[n];
            pyramid.reduce(n, Window { column: 0, row: 0, columns, rows });
        }
        pyramid.blocks = Blocks::new(raster, &pyramid.levels, &pyramid.highs);
        pyramid.windows = Windows::new(&pyramid.levels, &pyramid.highs);
        pyramid
    }

    /// Number of the coarsest level, that of a single node.
    pub fn top(&self) -> u32 {
        self.levels.len() as u32
    }

    /// Nodes along x and y of a level, 1 to [`RangePyramid::top`].
    ///
    /// # Panics
    /// If there is no such level.
    pub fn size(&self, level: u32) -> (usize, usize) {
        let Level { columns, rows, .. } = self.levels[level as usize - 1];
        (columns, rows)
    }

    /// Lowest and highest height over a node: patches `column << level .. (column + 1) << level`, likewise rows. Empty
    /// outside the raster and where there is no surface.
    ///
    /// # Panics
    /// If there is no such level.
    #[inline]
    pub fn node(&self, level: u32, column: usize, row: usize) -> HeightRange {
        let here = self.levels[level as usize - 1];
        if column >= here.columns || row >= here.rows {
            return HeightRange::EMPTY;
        }
        let index = here.offset + row * here.columns + column;
        let (low, high) = (self.lows[index], self.highs[index]);
        if low > high {
            return HeightRange::EMPTY;
        }
        HeightRange { low: self.height(low), high: self.height(high) }
    }

    /// The same for nodes in a row, from `column` on.
    ///
    /// # Panics
    /// If there is no such level.
    pub(crate) fn nodes(&self, level: u32, column: usize, row: usize, ranges: &mut [HeightRange]) {
        let here = self.levels[level as usize - 1];
        let inside = if row < here.rows { here.columns.saturating_sub(column).min(ranges.len()) } else { 0 };
        let (within, beyond) = ranges.split_at_mut(inside);
        beyond.fill(HeightRange::EMPTY);
        let first = here.offset + if inside > 0 { row * here.columns + column } else { 0 };
        let steps = self.lows[first..][..inside].iter().zip(&self.highs[first..][..inside]);
        for (range, (&low, &high)) in within.iter_mut().zip(steps) {
            let some = HeightRange { low: self.height(low), high: self.height(high) };
            *range = if low > high { HeightRange::EMPTY } else { some };
        }
    }

    /// All nodes of a level as steps, row by row from the south: lows and highs. A node whose low is above its high has no surface; n steps
    /// stand for `base + n · step` of [`RangePyramid::scale`] (m).
    ///
    /// # Panics
    /// If there is no such level.
    pub fn steps(&self, level: u32) -> (&[u16], &[u16]) {
        let Level { offset, columns, rows } = self.levels[level as usize - 1];
        let nodes = offset..offset + columns * rows;
        (&self.lows[nodes.clone()], &self.highs[nodes])
    }

    /// The height (m) that step 0 stands for, and that of one step (m).
    pub fn scale(&self) -> (f32, f32) {
        (self.base, self.step)
    }

    /// The height (m) that a number of steps stands for.
    #[inline]
    pub(crate) fn height(&self, steps: u16) -> f32 {
        self.base + f32::from(steps) * self.step
    }

    /// Lowest and highest valid sample of the whole raster, exactly.
    pub fn range(&self) -> HeightRange {
        self.range
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        2 * (self.lows.len() + self.highs.len()) + self.blocks.bytes() + self.windows.bytes()
    }

    /// Brings up to date what depends on the samples of `window`, which held values of the range `before`.
    pub(crate) fn edited(&mut self, raster: &Raster, window: Window, before: HeightRange) {
        if window.columns == 0 || window.rows == 0 {
            return;
        }
        let now = window_range(raster, window);
        let held_extreme = before.low <= self.range.low || before.high >= self.range.high;
        let range = if held_extreme { raster_range(raster) } else { self.range.union(now) };
        let fits = |h: f32| h >= self.height(1) && h <= self.height(STEPS as u16);
        let outgrown = !(range.is_empty() || fits(range.low) && fits(range.high));
        if outgrown || (self.range.is_empty() && !range.is_empty()) {
            *self = RangePyramid::new(raster);
            return;
        }
        self.range = range;
        // A sample touches the patches on all its sides, so nodes from one patch before it to the one that starts at it.
        let span = |start: usize, count: usize, patches: usize| {
            let (first, last) = (start.saturating_sub(1), (start + count - 1).min(patches - 1));
            (first.min(patches - 1), last)
        };
        let (x0, x1) = span(window.column, window.columns, raster.columns() - 1);
        let (y0, y1) = span(window.row, window.rows, raster.rows() - 1);
        let nodes = |n: usize| {
            let (column, row) = (x0 >> n, y0 >> n);
            Window { column, row, columns: (x1 >> n) - column + 1, rows: (y1 >> n) - row + 1 }
        };
        let (kernel, at) = (Kernel { base: self.base, step: self.step }, nodes(1));
        let (columns, mut scratch) = (self.levels[0].columns, Scratch::default());
        for row in at.row..at.row + at.rows {
            let here = row * columns + at.column..row * columns + at.column + at.columns;
            let (low, high) = (&mut self.lows[here.clone()], &mut self.highs[here]);
            kernel.patches_row(raster, row, at.column, &mut scratch, low, high);
        }
        for n in 1..self.levels.len() {
            self.reduce(n, nodes(n + 1));
        }
        self.blocks.edited(nodes(0), &self.levels, &self.highs);
        self.windows.edited(nodes(0), &self.levels, &self.highs);
    }

    /// Recomputes the nodes `window` of `levels[n]` from those of `levels[n - 1]`.
    fn reduce(&mut self, n: usize, window: Window) {
        let (fine, coarse) = (self.levels[n - 1], self.levels[n]);
        #[inline(always)]
        fn run(fine: Level, coarse: Level, window: Window, values: &mut [u16], merge: impl Fn(u16, u16) -> u16) {
            let (below, above) = values.split_at_mut(coarse.offset);
            let fines = &below[fine.offset..];
            for row in window.row..window.row + window.rows {
                let south = &fines[2 * row * fine.columns..][..fine.columns];
                let north = &fines[(2 * row + 1).min(fine.rows - 1) * fine.columns..][..fine.columns];
                let out = &mut above[row * coarse.columns + window.column..][..window.columns];
                let (south, north) = (&south[2 * window.column..], &north[2 * window.column..]);
                // Whole pairs first, in a form that compiles to vectors; the last node of a row may have one column only.
                let whole = (south.len() / 2).min(out.len());
                let (pairs, rest) = out.split_at_mut(whole);
                for (out, (s, n)) in pairs.iter_mut().zip(south.chunks_exact(2).zip(north.chunks_exact(2))) {
                    *out = merge(merge(s[0], s[1]), merge(n[0], n[1]));
                }
                if let [out] = rest {
                    *out = merge(south[2 * whole], north[2 * whole]);
                }
            }
        }
        run(fine, coarse, window, &mut self.lows, |a, b| a.min(b));
        run(fine, coarse, window, &mut self.highs, |a, b| a.max(b));
    }
}

/// Height of step 0 and of one step, such that every height of `range` decodes to within one step.
fn scale(range: HeightRange) -> (f32, f32) {
    if range.is_empty() {
        return (0.0, 1.0);
    }
    // A step of at least a few units in the last place, lest decoding round past its neighbour; the division before the
    // subtraction keeps the span of ±f32::MAX finite.
    let largest = range.low.abs().max(range.high.abs());
    let step = (range.high / STEPS - range.low / STEPS).max(largest * 1e-6).max(1e-30);
    ((range.low - 2.0 * step).max(f32::MIN), step)
}

/// Range of all valid samples.
fn raster_range(raster: &Raster) -> HeightRange {
    if raster.voids().any() {
        return raster.range();
    }
    let range_of = |heights: &[f32]| {
        let (low, high) = multiversion_range(heights);
        HeightRange { low, high }
    };
    raster.heights().par_chunks(1 << 18).map(range_of).reduce(|| HeightRange::EMPTY, HeightRange::union)
}

/// Range of the valid samples of a window.
pub(crate) fn window_range(raster: &Raster, window: Window) -> HeightRange {
    let mut range = HeightRange::EMPTY;
    for row in window.row..window.row + window.rows {
        for column in window.column..window.column + window.columns {
            if let Some(height) = raster.sample(column, row) {
                range = range.union(HeightRange { low: height, high: height });
            }
        }
    }
    range
}

/// Lowest and highest of finite numbers.
fn multiversion_range(heights: &[f32]) -> (f32, f32) {
    #[inline(always)]
    fn scan(heights: &[f32]) -> (f32, f32) {
        let (mut low, mut high) = ([f32::INFINITY; 64], [f32::NEG_INFINITY; 64]);
        let chunks = heights.chunks_exact(64);
        let rest = chunks.remainder();
        for chunk in chunks {
            for lane in 0..64 {
                low[lane] = if chunk[lane] < low[lane] { chunk[lane] } else { low[lane] };
                high[lane] = if chunk[lane] > high[lane] { chunk[lane] } else { high[lane] };
            }
        }
        let rest = (
            rest.iter().copied().fold(f32::INFINITY, f32::min),
            rest.iter().copied().fold(f32::NEG_INFINITY, f32::max),
        );
        (low.into_iter().fold(rest.0, f32::min), high.into_iter().fold(rest.1, f32::max))
    }
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn wide(heights: &[f32]) -> (f32, f32) {
            scan(heights)
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just been asked.
            return unsafe { wide(heights) };
        }
    }
    scan(heights)
}

/// Lowest and highest of three sample rows, column by column.
#[derive(Default)]
struct Scratch {
    low: Vec<f32>,
    high: Vec<f32>,
}

/// Turns samples into the nodes of level 1.
#[derive(Clone, Copy)]
struct Kernel {
    base: f32,
    step: f32,
}

impl Kernel {
    /// Fills nodes `column..` of one row of level 1.
    fn patches_row(
        self,
        raster: &Raster,
        row: usize,
        column: usize,
        scratch: &mut Scratch,
        low: &mut [u16],
        high: &mut [u16],
    ) {
        let (columns, rows) = (raster.columns(), raster.rows());
        let line = |row: usize| row.min(rows - 1) * columns..(row.min(rows - 1) + 1) * columns;
        let (first, last) = (line(2 * row), line(2 * row + 2));
        if raster.voids().any_in(first.start..last.end) {
            return self.patches_row_with_voids(raster, row, column, low, high);
        }
        let samples = 2 * column..(2 * (column + low.len()) + 1).min(columns);
        let part = |line: std::ops::Range<usize>| &raster.heights()[line][samples.clone()];
        let rows = [part(first), part(line(2 * row + 1)), part(last)];
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2")]
            fn wide(kernel: Kernel, rows: [&[f32]; 3], scratch: &mut Scratch, low: &mut [u16], high: &mut [u16]) {
                kernel.row(rows, scratch, low, high);
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has just been asked.
                return unsafe { wide(self, rows, scratch, low, high) };
            }
        }
        self.row(rows, scratch, low, high);
    }

    /// The kernel proper: three sample rows to one row of nodes.
    #[inline(always)]
    fn row(self, [a, b, c]: [&[f32]; 3], scratch: &mut Scratch, low: &mut [u16], high: &mut [u16]) {
        let (n, nodes) = (a.len(), low.len());
        let (b, c, high) = (&b[..n], &c[..n], &mut high[..nodes]);
        // Two numbers more than the row: the last node may have one patch only.
        scratch.low.resize(2 * nodes + 2, 0.0);
        scratch.high.resize(2 * nodes + 2, 0.0);
        let less = |a: f32, b: f32| if a < b { a } else { b };
        let more = |a: f32, b: f32| if a > b { a } else { b };
        let (lows, highs) = (&mut scratch.low[..2 * nodes + 2], &mut scratch.high[..2 * nodes + 2]);
        for i in 0..n {
            lows[i] = less(less(a[i], b[i]), c[i]);
            highs[i] = more(more(a[i], b[i]), c[i]);
        }
        for i in n..2 * nodes + 2 {
            (lows[i], highs[i]) = (lows[n - 1], highs[n - 1]);
        }
        let inverse = 1.0 / self.step;
        let offset = self.base * inverse;
        // Rounded to nearest, then one step outward if decoding shows it is needed: exactly conservative.
        for i in 0..nodes {
            let height = less(less(lows[2 * i], lows[2 * i + 1]), lows[2 * i + 2]);
            let steps = (height * inverse - offset + 0.5) as i32;
            low[i] = (steps - i32::from(self.base + steps as f32 * self.step > height)) as u16;
        }
        for i in 0..nodes {
            let height = more(more(highs[2 * i], highs[2 * i + 1]), highs[2 * i + 2]);
            let steps = (height * inverse - offset + 0.5) as i32;
            high[i] = (steps + i32::from(self.base + (steps as f32) * self.step < height)) as u16;
        }
    }

    /// The same where samples may be void: patch by patch.
    fn patches_row_with_voids(self, raster: &Raster, row: usize, column: usize, low: &mut [u16], high: &mut [u16]) {
        let valid = |column: usize, row: usize| !raster.voids().is_void(row * raster.columns() + column);
        let height = |column: usize, row: usize| raster.heights()[row * raster.columns() + column];
        for (index, (low, high)) in low.iter_mut().zip(high).enumerate() {
            let mut range = HeightRange::EMPTY;
            for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (x, y) = (2 * (column + index) + i, 2 * row + j);
                if x + 1 >= raster.columns() || y + 1 >= raster.rows() {
                    continue;
                }
                let corners = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                if corners.iter().all(|&(x, y)| valid(x, y)) {
                    for (x, y) in corners {
                        let height = height(x, y);
                        range = range.union(HeightRange { low: height, high: height });
                    }
                }
            }
            if range.is_empty() {
                (*low, *high) = (EMPTY_LOW, EMPTY_HIGH);
            } else {
                let inverse = 1.0 / self.step;
                let steps = |height: f32| (height * inverse - self.base * inverse + 0.5) as i32;
                let decoded = |steps: i32| self.base + steps as f32 * self.step;
                let (l, h) = (steps(range.low), steps(range.high));
                *low = (l - i32::from(decoded(l) > range.low)) as u16;
                *high = (h + i32::from(decoded(h) < range.high)) as u16;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn blocks_follow_edits() {
        let (columns, rows) = (301, 77);
        let mut raster = Raster::new(columns, rows, DVec2::ONE, vec![1.0; columns * rows]).expect("valid");
        let mut pyramid = RangePyramid::new(&raster);
        for (n, (column, row)) in [(0, 0), (299, 70), (130, 40), (64, 3)].into_iter().enumerate() {
            let window = Window { column, row, columns: 2, rows: 5 };
            let before = window_range(&raster, window);
            // The first edit outgrows the range, the others stay within.
            raster.replace(window, &[900.0 - n as f32; 10]);
            pyramid.edited(&raster, window, before);
            assert_eq!(pyramid.blocks.blocks, Blocks::new(&raster, &pyramid.levels, &pyramid.highs).blocks);
            let node = |k: usize| {
                let (level, shift) = (pyramid.blocks.levels[k], 2 + 3 * k);
                let (x, y) = (column >> shift, row >> shift);
                pyramid.blocks.blocks[level.offset + (y >> 3) * level.columns + (x >> 3)].0[(y & 7) * 8 + (x & 7)]
            };
            assert!((0..pyramid.blocks.levels.len()).all(|k| pyramid.height(node(k)) >= 900.0 - n as f32));
        }
    }
}
