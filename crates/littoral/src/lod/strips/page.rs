//! Pages: which cells of a square of the quadtree are cut and which are drawn, a bit for each.
//!
//! Rows of bits let the whole of a row be asked, grown by a cell or halved at once. What is cut follows from the bounds of the cells (measured a
//! row at a time, in lanes) and from the neighbours, which may be one level coarser and no more.

use super::super::ScreenMetric;
use crate::field::{HeightField, HeightRange};
use crate::space::{Cell, Datum, View};
use glam::DVec2;
use multiversion::multiversion;
use std::ops::Range;

/// Levels within a page, and its cells along a side.
pub(super) const DEPTH: u8 = 6;
const SIDE: usize = 1 << DEPTH;

/// Rows of all levels, the page itself being level 0.
const ROWS: usize = 2 * SIDE - 1;

/// The row of bits of a level.
pub(super) fn row(level: u8, y: u32) -> usize {
    (1usize << level) - 1 + y as usize
}

/// A square of the quadtree that is cut, and what becomes of its parts.
#[derive(Clone, Debug)]
pub(super) struct Page {
    /// The square.
    pub cell: Cell,
    /// Levels below it that belong to the page.
    pub depth: u8,
    /// What is cut; those of the last level are pages of their own.
    pub cut: [u64; ROWS],
    /// What is drawn: while the page is measured, what is whole and may be seen.
    pub drawn: [u64; ROWS],
}

/// What a view asks of cells.
pub(super) struct Asked<'a> {
    pub field: &'a dyn HeightField,
    pub metric: &'a ScreenMetric,
    /// How far off (pixels) a cell may be drawn.
    pub tolerance: f32,
    /// The level that is not cut.
    pub finest: u8,
}

/// Bits of the cells in a row, one for two: set where either is.
pub(super) fn halve(bits: u64) -> u64 {
    let mut x = (bits | bits >> 1) & 0x5555_5555_5555_5555;
    x = (x | x >> 1) & 0x3333_3333_3333_3333;
    x = (x | x >> 2) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | x >> 4) & 0x00ff_00ff_00ff_00ff;
    x = (x | x >> 8) & 0x0000_ffff_0000_ffff;
    (x | x >> 16) & 0xffff_ffff
}

/// Bits of the cells in a row, two for one. The upper half of `bits` is lost.
pub(super) fn double(bits: u64) -> u64 {
    let mut x = bits & 0xffff_ffff;
    x = (x | x << 16) & 0x0000_ffff_0000_ffff;
    x = (x | x << 8) & 0x00ff_00ff_00ff_00ff;
    x = (x | x << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | x << 2) & 0x3333_3333_3333_3333;
    x = (x | x << 1) & 0x5555_5555_5555_5555;
    x | x << 1
}

impl Page {
    /// A page of which only the square itself is cut.
    pub fn of(cell: Cell, depth: u8) -> Page {
        let mut page = Page { cell, depth, cut: [0; ROWS], drawn: [0; ROWS] };
        page.cut[0] = 1;
        page
    }

    /// The level's cells that exist: the quarters of those that are cut a level above.
    fn quarters(&self, level: u8, y: u32) -> u64 {
        double(self.cut[row(level - 1, y >> 1)])
    }

    /// Cuts what the bounds ask for; the greatest bound (pixels) of what is left whole.
    pub fn refine(&mut self, asked: &Asked) -> f32 {
        let (mut worst, mut lines) = (0.0f32, [Line::default(); 3]);
        for level in 1..=self.depth {
            let mut cells = [0; SIDE];
            for y in 0..1u32 << level {
                cells[y as usize] = self.quarters(level, y);
            }
            let cuts = self.cell.level + level < asked.finest;
            worst = self.measure(asked, &mut lines, level, &cells, cuts).max(worst);
        }
        worst
    }

    /// Says what is drawn, after neighbours cut what they had to.
    pub fn settle(&mut self, asked: &Asked) {
        let mut lines = [Line::default(); 3];
        for level in 1..=self.depth {
            let mut cells = [0; SIDE];
            for y in 0..1u32 << level {
                // What was measured and is not seen is measured again: that is little.
                let at = row(level, y);
                cells[y as usize] = self.quarters(level, y) & !self.cut[at] & !self.drawn[at];
            }
            self.measure(asked, &mut lines, level, &cells, false);
        }
        self.drawn.iter_mut().zip(&self.cut).for_each(|(drawn, cut)| *drawn &= !cut);
    }

    /// How many cells are drawn.
    pub fn count(&self) -> usize {
        self.drawn.iter().zip(&self.cut).map(|(drawn, cut)| (drawn & !cut).count_ones() as usize).sum()
    }

    /// How many of its cells are pages.
    pub fn below(&self) -> usize {
        self.cut[row(self.depth, 0)..].iter().take(1 << self.depth).map(|bits| bits.count_ones() as usize).sum()
    }

    /// Measures the cells of a level, rows of bits: notes which are whole and may be seen, and, if it `cuts`, cuts those with bounds above the
    /// tolerance. The greatest bound (pixels) of the others.
    fn measure(&mut self, asked: &Asked, lines: &mut [Line; 3], level: u8, cells: &[u64; SIDE], cuts: bool) -> f32 {
        let (mut worst, most) = (0.0f32, if cuts { asked.tolerance } else { f32::INFINITY });
        let side = 1usize << level;
        let Some(first) = cells[..side].iter().position(|&bits| bits != 0) else { return worst };
        let last = cells[..side].iter().rposition(|&bits| bits != 0).unwrap_or(first);
        // Row y is judged when the row beyond it is known: a cell's bound takes the nearest of its neighbours.
        for next in first..=last + 2 {
            // Rows are counted from the one before the page.
            let wanted = |y: usize| if (1..=side).contains(&y) { cells[y - 1] } else { 0 };
            let near = wanted(next) | wanted(next + 1) | if next > 0 { wanted(next - 1) } else { 0 };
            let line = &mut lines[next % 3];
            line.scale.fill(UNSEEN);
            if near != 0 {
                self.line(asked, level, next as i64 - 1, near.trailing_zeros()..64 - near.leading_zeros(), line);
            }
            let Some(y) = next.checked_sub(2).filter(|&y| y >= first) else { continue };
            let bits = cells[y];
            if bits == 0 {
                continue;
            }
            let [a, b, c] = [y, y + 1, y + 2].map(|line| &lines[line % 3]);
            let judged = judge([&a.scale, &b.scale, &c.scale], &b.error, bits, (asked.tolerance, cuts));
            let (seen, mut above) = (judged.seen & bits, judged.above & bits);
            worst = worst.max(judged.worst);
            // What is partly void is no farther off than it is large.
            let mut left = seen & !judged.whole;
            while left != 0 {
                let x = left.trailing_zeros() as usize;
                left &= left - 1;
                let cell = self.at(level, x as i64, y as i64);
                let pixels = SEAMS * asked.metric.pixels_across(&asked.metric.bounds(cell, b.range[x + 1]));
                if pixels > most {
                    above |= 1 << x;
                } else {
                    above &= !(1 << x);
                    worst = worst.max(pixels);
                }
            }
            self.drawn[row(level, y as u32)] |= seen & judged.whole;
            self.cut[row(level, y as u32)] |= above & seen;
        }
        worst
    }

    fn at(&self, level: u8, x: i64, y: i64) -> Cell {
        let x = (i64::from(self.cell.x) << level) + x;
        let y = (i64::from(self.cell.y) << level) + y;
        Cell { level: self.cell.level + level, x: x as u32, y: y as u32, ..self.cell }
    }

    /// How large things are in a row of cells and one more on both sides.
    fn line(&self, asked: &Asked, level: u8, y: i64, columns: Range<u32>, line: &mut Line) {
        let cells = 1i64 << (self.cell.level + level);
        let row = (i64::from(self.cell.y) << level) + y;
        let west = i64::from(self.cell.x) << level;
        let from = (west + i64::from(columns.start) - 1).max(0);
        let to = (west + i64::from(columns.end) + 1).min(cells);
        if !(0..cells).contains(&row) {
            return;
        }
        let first = Cell { level: self.cell.level + level, x: from as u32, y: row as u32, ..self.cell };
        let part = (from - west + 1) as usize..(to - west + 1) as usize;
        asked.field.row(first, &mut line.range[part.clone()], &mut line.error[part.clone()]);
        let lens = Lens::new(asked.metric, asked.field.datum(), first);
        let lanes = part.start..part.start + part.len().next_multiple_of(LANES);
        scales(&lens, &line.range[lanes.clone()], &mut line.scale[lanes.clone()]);
        line.scale[part.end..lanes.end].fill(UNSEEN);
    }
}

/// Where a side leaves out a vertex, that is off by no more than the coarser cell: twice a cell's own bound holds for it and its seams.
pub(super) const SEAMS: f32 = 2.0;

/// A row of cells and one more on both sides.
#[derive(Clone, Copy)]
struct Line {
    range: [HeightRange; LINE],
    error: [f32; LINE],
    /// Pixels a vertical metre covers at most; [`UNSEEN`] where nothing is seen.
    scale: [f32; LINE],
}

impl Default for Line {
    fn default() -> Line {
        Line { range: [HeightRange::EMPTY; LINE], error: [0.0; LINE], scale: [UNSEEN; LINE] }
    }
}

const UNSEEN: f32 = -1.0;

/// Cells that are measured together, and places in a line: whole lanes even from its second place on.
const LANES: usize = 16;
const LINE: usize = SIDE + 2 + LANES;

/// What is found out about a row of cells, a bit each.
struct Judged {
    seen: u64,
    /// What has a finite error.
    whole: u64,
    /// What has a finite bound above what was asked, or an infinite one.
    above: u64,
    /// The greatest bound (pixels) of what is seen, whole and not above.
    worst: f32,
}

/// Judges the cells `bits` of the middle line by their errors (m) and the scale of the largest of their neighbours; those that cannot be cut,
/// which have no finer ones beside them, by their own and what coarser ones may add.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn judge(
    [south, middle, north]: [&[f32; LINE]; 3],
    error: &[f32; LINE],
    bits: u64,
    (most, cuts): (f32, bool),
) -> Judged {
    let mut judged = Judged { seen: 0, whole: 0, above: 0, worst: 0.0 };
    let mut worst = [0.0f32; LANES];
    // Lanes that hold any of them.
    let (from, to) = (bits.trailing_zeros() as usize / LANES, (63 - bits.leading_zeros() as usize) / LANES);
    for block in from..=to {
        let at = block * LANES;
        let mut nearest = [0.0f32; LANES + 2];
        let [s, m, n] = [south, middle, north].map(|line| &line[at..at + LANES + 2]);
        for i in 0..LANES + 2 {
            let larger = if s[i] > n[i] { s[i] } else { n[i] };
            nearest[i] = if larger > m[i] { larger } else { m[i] };
        }
        let error = &error[at + 1..at + 1 + LANES];
        let asked = (bits >> at) as u32;
        let (mut seen, mut whole, mut above) = ([0u32; LANES], [0u32; LANES], [0u32; LANES]);
        for i in 0..LANES {
            let larger = if nearest[i] > nearest[i + 2] { nearest[i] } else { nearest[i + 2] };
            let scale = if larger > nearest[i + 1] { larger } else { nearest[i + 1] };
            let bound = if cuts { SEAMS * error[i] * scale } else { error[i] * m[i + 1] + most / SEAMS };
            seen[i] = u32::from(m[i + 1] >= 0.0);
            whole[i] = u32::from(error[i] < f32::INFINITY);
            above[i] = u32::from(cuts & (bound > most));
            let counts = seen[i] & whole[i] & !above[i] & asked >> i & 1;
            let bound = if counts == 1 { bound } else { 0.0 };
            worst[i] = if bound > worst[i] { bound } else { worst[i] };
        }
        judged.seen |= packed(&seen) << at;
        judged.whole |= packed(&whole) << at;
        judged.above |= packed(&above) << at;
    }
    judged.worst = worst.into_iter().fold(0.0, f32::max);
    judged
}

/// A bit for each number, which are 0 or 1.
#[inline(always)]
fn packed(flags: &[u32; LANES]) -> u64 {
    flags.iter().enumerate().fold(0u32, |bits, (i, flag)| bits | flag << i).into()
}

/// A view and a row of cells.
struct Lens {
    /// Western side of the first cell from the eye (m): whole cells, and what is left, which keeps the numbers exact.
    cells: i32,
    rest: f32,
    /// Width of a cell (m).
    width: f32,
    /// Southern and northern side from the eye (m).
    south: f32,
    north: f32,
    /// Height of the eye, and what its rounding may take (m).
    eye: f32,
    blur: f32,
    forward: [f32; 3],
    sides: [[f32; 3]; 4],
    focal: f32,
    stretch: f32,
}

impl Lens {
    fn new(metric: &ScreenMetric, datum: Datum, first: Cell) -> Lens {
        let (origin, size) = match datum {
            Datum::Plane { origin, size } => (origin, size),
            Datum::Ellipsoid { .. } => (DVec2::ZERO, DVec2::ONE),
        };
        let (forward, sides, focal, stretch) = metric.lens();
        let cell = size * first.side();
        let at = (metric.eye().truncate() - origin) / cell;
        let whole = at.floor().clamp(DVec2::splat(-1e9), DVec2::splat(1e9));
        let rest = (at - whole) * cell;
        let row = f64::from(first.y) - whole.y;
        Lens {
            cells: (i64::from(first.x) - whole.x as i64) as i32,
            rest: rest.x as f32,
            width: cell.x as f32,
            south: (row * cell.y - rest.y) as f32,
            north: ((row + 1.0) * cell.y - rest.y) as f32,
            eye: metric.eye().z as f32,
            blur: metric.eye().z.abs() as f32 * f32::EPSILON,
            forward: forward.to_array(),
            sides: sides.map(|side| side.to_array()),
            focal,
            stretch,
        }
    }
}

/// What [`ScreenMetric::pixels_per_metre`] says of each cell in a row, if [`ScreenMetric::sees`] it.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn scales(lens: &Lens, ranges: &[HeightRange], scales: &mut [f32]) {
    // Rounding may take a few units in the last place of the coordinates.
    const SLACK: f32 = 4e-6;
    let far_y = lens.south.abs().max(lens.north.abs());
    // The greater (or least) product of a normal's component with a side.
    let greater = |n: f32, low: f32, high: f32| n * if n > 0.0 { high } else { low };
    let reach_y = lens.sides.map(|side| greater(side[1], lens.south, lens.north));
    let most_y = greater(lens.forward[1], lens.south, lens.north);
    let least_y = -greater(-lens.forward[1], lens.south, lens.north);
    for (i, (range, scale)) in ranges.iter().zip(scales).enumerate() {
        let cell = lens.cells.wrapping_add(i as i32);
        let west = cell as f32 * lens.width - lens.rest;
        let east = cell.wrapping_add(1) as f32 * lens.width - lens.rest;
        let (low, high) = (range.low - lens.eye - lens.blur, range.high - lens.eye + lens.blur);
        let far_x = if west.abs() > east.abs() { west.abs() } else { east.abs() };
        let far_z = if low.abs() > high.abs() { low.abs() } else { high.abs() };
        let slack = SLACK * (far_x + far_y + far_z);
        let mut seen = range.low <= range.high;
        for (side, y) in lens.sides.iter().zip(reach_y) {
            let x = side[0] * if side[0] > 0.0 { east } else { west };
            let z = side[2] * if side[2] > 0.0 { high } else { low };
            seen &= x + y + z >= -slack;
        }
        let [fx, _, fz] = lens.forward;
        let most = fx * if fx > 0.0 { east } else { west } + most_y + fz * if fz > 0.0 { high } else { low };
        let least = fx * if fx > 0.0 { west } else { east } + least_y + fz * if fz > 0.0 { low } else { high };
        seen &= most + slack >= View::NEAR;
        let nearest = least - slack;
        let depth = if nearest > View::NEAR { nearest } else { View::NEAR };
        let across = (far_x * far_x + far_y * far_y).sqrt() + slack;
        let widest = lens.stretch * depth;
        let within = if across < widest { across } else { widest };
        let pixels = lens.focal * within / (depth * depth) * (1.0 + 1e-5);
        *scale = if seen { pixels } else { UNSEEN };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Land, Raster};
    use glam::{DVec3, UVec2};

    #[test]
    fn bits_are_halved_and_doubled() {
        for bits in [0u64, 1, 0b1010_0100, u64::MAX, 0x8000_0000_0000_0001] {
            for i in 0..32 {
                assert_eq!(halve(bits) >> i & 1 == 1, bits >> (2 * i) & 3 != 0);
                assert_eq!(double(bits) >> (2 * i) & 3, 3 * (bits >> i & 1));
            }
        }
    }

    #[test]
    fn rows_are_measured_as_single_cells_are() {
        let heights = (0..70 * 41).map(|i| ((i * 7919) % 101) as f32).collect();
        let land = Land::new(Raster::new(70, 41, DVec2::new(3.0, 5.0), heights).expect("valid"));
        for eye in [(40.0, 60.0, 130.0), (-500.0, 90.0, 20.0), (100.0, 100.0, 60.0)] {
            let view = View::looking_at(DVec3::from(eye), DVec3::new(90.0, 70.0, 20.0), 0.8, UVec2::new(320, 200));
            let metric = ScreenMetric::new(&view, land.datum()).expect("a view");
            for level in 3..=7u8 {
                for y in 0..1 << level {
                    let first = Cell { level, x: 1, y, ..Cell::face(0) };
                    let mut line = Line::default();
                    let count = (1usize << level).min(64) - 1;
                    land.row(first, &mut line.range[..count], &mut line.error[..count]);
                    scales(&Lens::new(&metric, land.datum(), first), &line.range[..count], &mut line.scale[..count]);
                    for (i, scale) in line.scale[..count].iter().enumerate() {
                        let cell = Cell { x: 1 + i as u32, ..first };
                        let range = land.range(cell);
                        let bounds = metric.bounds(cell, range);
                        if !range.is_empty() && metric.sees(&bounds) {
                            let exact = metric.pixels_per_metre(&bounds);
                            // Never less, and hardly more: rounding counts where the eye is near.
                            let ratio = scale / exact;
                            assert!((1.0 - 2e-5..1.01).contains(&ratio), "{cell:?}: {scale} for {exact}");
                        } else if *scale >= 0.0 {
                            // Only what touches the frame may differ.
                            assert!(!range.is_empty(), "from {eye:?}: {cell:?} is void and yet seen");
                        }
                    }
                }
            }
        }
    }
}
