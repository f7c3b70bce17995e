//! Pages before the eye: which of their cells may be seen, and how far off they would be drawn.
//!
//! How near and how visible a cell is is a matter of its place and of the slab of heights about it. Columns are worked out once for a level, slabs once for
//! a page, and what is left are a few products for sixteen cells at once: bounds are compared by their squares, without roots and quotients.

mod judge;

pub(super) use judge::judge;

use super::super::metric::Bounds;
use super::page::{Asked, SEAMS, SIDE};
use crate::field::HeightRange;
use crate::space::{Cell, View};
use glam::{DVec2, Vec3};
use multiversion::multiversion;
use std::ops::Range;

/// Bounds of seen and whole cells (pixels).
#[derive(Default)]
pub(super) struct Judged {
    /// The greatest of those that are not above the tolerance, or cannot be cut.
    pub worst: f32,
    /// The greatest of the others.
    pub most: f32,
}

/// The rows of a level while they are measured, a bit or a number for each cell.
pub(super) struct Rows {
    /// What is asked about.
    pub cells: [u64; SIDE],
    /// What has a finite error.
    pub whole: [u64; SIDE],
    /// Errors (m) row by row of a part of the level: its first column and row, and how many columns it has.
    errors: [f32; SIDE * SIDE],
    corner: [usize; 2],
    columns: usize,
    /// What may be seen, and what has a bound above what was asked.
    pub seen: [u64; SIDE],
    pub above: [u64; SIDE],
}

impl Default for Rows {
    fn default() -> Rows {
        let cells = [0; SIDE];
        Rows {
            cells,
            whole: cells,
            errors: [0.0; SIDE * SIDE],
            corner: [0; 2],
            columns: SIDE,
            seen: cells,
            above: cells,
        }
    }
}

impl Rows {
    /// Asks for the errors of all cells, of which `first` is the level's first: of more than are wanted, but at once.
    pub fn ask(&mut self, asked: &Asked, first: Cell, level: u8) {
        let side = 1usize << level;
        let all = self.cells[..side].iter().fold(0, |all, bits| all | bits);
        self.room(level);
        if all == 0 {
            return;
        }
        let mut rows = 0..side;
        if side > LANES {
            let (west, east) = (all.trailing_zeros() as usize / LANES, 64 - all.leading_zeros() as usize);
            rows = self.cells[..side].iter().position(|&bits| bits != 0).unwrap_or(0)
                ..self.cells[..side].iter().rposition(|&bits| bits != 0).map_or(0, |y| y + 1);
            self.corner = [west * LANES, rows.start];
            self.columns = (east.div_ceil(LANES) - west) * LANES;
        }
        let first = Cell { x: first.x + self.corner[0] as u32, y: first.y + self.corner[1] as u32, ..first };
        asked.field.errors(first, self.columns, &mut self.errors[..rows.len() * self.columns]);
    }

    /// Makes room for errors of all cells.
    pub fn room(&mut self, level: u8) {
        (self.corner, self.columns) = ([0; 2], 1 << level);
    }

    /// Where the errors of a row are from a column on.
    #[inline(always)]
    fn index(&self, x: usize, y: usize) -> usize {
        (y - self.corner[1]) * self.columns + x - self.corner[0]
    }

    /// The errors of a row's columns.
    pub fn errors(&mut self, columns: Range<usize>, y: usize) -> &mut [f32] {
        let at = self.index(columns.start, y);
        &mut self.errors[at..at + columns.len()]
    }
}

/// Levels of a page down to its blocks, whose heights are known while their cells are measured.
const BLOCKS: u8 = 2;
const ACROSS: usize = 1 << BLOCKS;

/// A page before the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    /// Heights of blocks and their neighbours from the eye (m).
    slabs: [[HeightRange; ACROSS]; ACROSS],
    /// Those of all.
    slab: HeightRange,
    /// How far the blocks' heights are ahead of the eye at least (m), and last those of all.
    down: [f32; ACROSS * ACROSS + 1],
    /// Whether no part of it is void.
    pub whole: bool,
    /// Whether all of it lies within the frame, and which of the frame's planes it crosses.
    pub inside: bool,
    crossed: [bool; 5],
    /// Whether the eye is nearer than its heights differ: then each cell is judged by its own heights, not by those of blocks.
    pub near: bool,
    /// What rounding may take from lengths (m).
    slack: f32,
}

impl Stage {
    /// Whether all of its cells are whole and within the frame.
    pub fn is_all_seen(&self) -> bool {
        self.whole && self.inside
    }

    /// Which of [`Stage::down`] is that of a cell.
    fn block(&self, level: u8, x: usize, y: usize) -> usize {
        match level.checked_sub(BLOCKS) {
            Some(block) => (y >> block) * ACROSS + (x >> block),
            None => ACROSS * ACROSS,
        }
    }

    pub fn new(asked: &Asked, page: Cell, depth: u8) -> Stage {
        let blocks = depth.min(BLOCKS);
        let across = 1usize << blocks;
        let level = page.level + blocks;
        let cells = 1i64 << level;
        let [west, south] = [page.x, page.y].map(|at| (i64::from(at) << blocks) - 1);
        let columns = west.max(0)..(west + 2 + across as i64).min(cells);
        let part = (columns.start - west) as usize..(columns.end - west) as usize;
        let mut ranges = [[HeightRange::EMPTY; ACROSS + 2]; ACROSS + 2];
        let mut errors = [0.0; ACROSS + 2];
        for (y, ranges) in ranges[..across + 2].iter_mut().enumerate() {
            let y = south + y as i64;
            if (0..cells).contains(&y) {
                let first = Cell { level, x: columns.start as u32, y: y as u32, ..page };
                asked.field.row(first, &mut ranges[part.clone()], &mut errors[part.clone()]);
            }
        }
        // Three in a row, then three of these in a column.
        let both = |a: HeightRange, b: HeightRange| HeightRange {
            low: if a.low < b.low { a.low } else { b.low },
            high: if a.high > b.high { a.high } else { b.high },
        };
        let mut threes = [[HeightRange::EMPTY; ACROSS]; ACROSS + 2];
        for (threes, ranges) in threes.iter_mut().zip(&ranges) {
            for (x, three) in threes.iter_mut().enumerate() {
                *three = both(both(ranges[x], ranges[x + 1]), ranges[x + 2]);
            }
        }
        let mut slabs = [[HeightRange::EMPTY; ACROSS]; ACROSS];
        let mut slab = HeightRange::EMPTY;
        let eye = asked.metric.eye().z;
        let blur = eye.abs() as f32 * f32::EPSILON;
        for (y, slabs) in slabs[..across].iter_mut().enumerate() {
            for (x, here) in slabs[..across].iter_mut().enumerate() {
                let range = both(both(threes[y][x], threes[y + 1][x]), threes[y + 2][x]);
                *here = HeightRange { low: range.low - eye as f32 - blur, high: range.high - eye as f32 + blur };
                slab = both(slab, *here);
            }
        }
        // The farthest corner, and a cell beyond.
        let lens = Lens::new(asked, page, 0, true);
        let far = |ends: [f32; 2]| ends[0].abs().max(ends[1].abs());
        let (columns, rows) = (lens.columns(0), lens.rows(0));
        let slack = SLACK * (far(columns) + far(rows) + far([slab.low, slab.high]));
        let least = |[x, y, z]: [f32; 3]| {
            lesser(x, columns[0], columns[1]) + lesser(y, rows[0], rows[1]) + lesser(z, slab.low, slab.high)
        };
        let crossed = lens.planes().map(|(plane, beyond)| least(plane) < beyond + slack);
        let inside = crossed == [false; 5];
        let whole = asked.field.error(page).is_finite() && !asked.field.range(page).is_empty();
        let apart = |[low, high]: [f32; 2]| low.max(-high).max(0.0);
        let away = (square(apart(columns)) + square(apart(rows)) + square(apart([slab.low, slab.high]))).sqrt();
        let near = away < slab.high - slab.low;
        let mut down = [0.0; ACROSS * ACROSS + 1];
        let all = slabs.as_flattened().iter().chain([&slab]);
        down.iter_mut().zip(all).for_each(|(down, slab)| *down = lesser(lens.forward[2], slab.low, slab.high));
        Stage { slabs, slab, down, whole, inside, crossed, near, slack }
    }
}

/// What rounding may take from a sum of coordinates, a few units in the last place.
const SLACK: f32 = 4e-6;

/// The lesser product of a normal's component with a coordinate between two.
#[inline(always)]
fn lesser(normal: f32, low: f32, high: f32) -> f32 {
    normal * if normal > 0.0 { low } else { high }
}

#[inline(always)]
fn square(x: f32) -> f32 {
    x * x
}

/// The greater one.
#[inline(always)]
fn greater(normal: f32, low: f32, high: f32) -> f32 {
    normal * if normal > 0.0 { high } else { low }
}

/// A view and a page's cells of one level.
pub(super) struct Lens {
    level: u8,
    /// Corner of the first cell from the eye: whole cells, and what is left (m), which keeps the numbers exact.
    cells: [i32; 2],
    rest: [f32; 2],
    /// Sides of a cell (m).
    size: [f32; 2],
    /// How far beyond a cell things count (m): where cells are cut, as far as a neighbour half as large reaches.
    beyond: [f32; 2],
    cuts: bool,
    tolerance: f32,
    forward: [f32; 3],
    sides: [[f32; 3]; 4],
    focal: f32,
    stretch: f32,
}

impl Lens {
    pub fn new(asked: &Asked, first: Cell, level: u8, cuts: bool) -> Lens {
        let (forward, sides, focal, stretch) = asked.metric.lens();
        let cell = asked.size * first.side();
        let at = asked.eye * f64::from(1u32 << first.level);
        let floor = |x: f64| {
            let whole = x.clamp(-1e9, 1e9) as i32;
            f64::from(whole - i32::from(f64::from(whole) > x))
        };
        let whole = DVec2::new(floor(at.x), floor(at.y));
        let rest = ((at - whole) * cell).as_vec2().to_array();
        let cells = [i64::from(first.x) - whole.x as i64, i64::from(first.y) - whole.y as i64].map(|cell| cell as i32);
        let size = cell.as_vec2().to_array();
        Lens {
            level,
            cells,
            rest,
            size,
            beyond: if cuts { size.map(|side| 0.5 * side) } else { [0.0; 2] },
            cuts,
            tolerance: asked.tolerance,
            forward: forward.to_array(),
            sides: sides.map(|side| side.to_array()),
            focal,
            stretch,
        }
    }

    /// Western and eastern end of what counts for a column, from the eye (m).
    #[inline(always)]
    fn columns(&self, i: i32) -> [f32; 2] {
        let cell = self.cells[0].wrapping_add(i);
        let (west, east) = (cell as f32 * self.size[0], cell.wrapping_add(1) as f32 * self.size[0]);
        [west - self.rest[0] - self.beyond[0], east - self.rest[0] + self.beyond[0]]
    }

    /// The frame's planes, and how far (m) beyond them things are seen: the nearest counts like the sides.
    fn planes(&self) -> [([f32; 3], f32); 5] {
        let [a, b, c, d] = self.sides.map(|side| (side, 0.0));
        [a, b, c, d, (self.forward, View::NEAR)]
    }

    /// Southern and northern end of what counts for a row, from the eye (m).
    #[inline(always)]
    fn rows(&self, j: i32) -> [f32; 2] {
        let cell = self.cells[1].wrapping_add(j);
        let (south, north) = (cell as f32 * self.size[1], cell.wrapping_add(1) as f32 * self.size[1]);
        [south - self.rest[1] - self.beyond[1], north - self.rest[1] + self.beyond[1]]
    }
}

/// Cells that are measured together.
const LANES: usize = 16;

/// Says which cells near the eye may lie within the frame, of those of which `seen` says so, and, if asked to, judges them, each by its own heights and those of
/// the cells beside it; `first` is the level's first cell.
pub(super) fn look_near(
    asked: &Asked,
    lens: &Lens,
    stage: &Stage,
    first: Cell,
    judges: bool,
    rows: &mut Rows,
) -> Judged {
    let mut judged = Judged::default();
    let (seams, apart) = if lens.cuts { (SEAMS, 0.0) } else { (1.0, lens.tolerance / SEAMS) };
    let cells = 1i64 << first.level;
    let eye = asked.metric.eye().z;
    for y in 0..1usize << lens.level {
        rows.above[y] = 0;
        let mut left = rows.cells[y] & rows.seen[y];
        if left == 0 {
            continue;
        }
        let start = left.trailing_zeros();
        let (west, count) = (i64::from(first.x + start) - 1, i64::from(64 - left.leading_zeros() - start) + 2);
        let (from, to) = (west.max(0), (west + count).min(cells));
        let part = (from - west) as usize..(to - west) as usize;
        let (mut ranges, mut errors) = ([[HeightRange::EMPTY; SIDE + 2]; 3], [0.0; SIDE + 2]);
        for (k, ranges) in ranges.iter_mut().enumerate() {
            let row = i64::from(first.y) + y as i64 + k as i64 - 1;
            if (lens.cuts || k == 1) && (0..cells).contains(&row) {
                let first = Cell { x: from as u32, y: row as u32, ..first };
                asked.field.row(first, &mut ranges[part.clone()], &mut errors[part.clone()]);
            }
        }
        while left != 0 {
            let x = left.trailing_zeros();
            left &= left - 1;
            let at = (x - start) as usize;
            let beside = ranges.iter().flat_map(|row| &row[at..at + 3]);
            let all = beside.fold(HeightRange::EMPTY, |all, range| all.union(*range));
            let range = if lens.cuts { all } else { ranges[1][at + 1] };
            let ([west, east], [south, north]) = (lens.columns(x as i32), lens.rows(y as i32));
            let [low, high] = [range.low, range.high].map(|height| (f64::from(height) - eye) as f32);
            let bounds = Bounds {
                low: Vec3::new(west, south, low) - stage.slack,
                high: Vec3::new(east, north, high) + stage.slack,
            };
            if !asked.metric.sees(&bounds) {
                rows.seen[y] &= !(1 << x);
                continue;
            }
            if !judges || rows.whole[y] >> x & 1 == 0 {
                continue;
            }
            let bound =
                seams * asked.metric.pixels(&bounds, rows.errors[rows.index(x as usize, y)]) * (1.0 + 1e-5) + apart;
            if lens.cuts && bound > lens.tolerance {
                rows.above[y] |= 1 << x;
                judged.most = judged.most.max(bound);
            } else {
                judged.worst = judged.worst.max(bound);
            }
        }
    }
    judged
}

/// Says which of the cells may lie within the frame.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn see(lens: &Lens, stage: &Stage, rows: &mut Rows) {
    let side = 1usize << lens.level;
    let lanes = side.max(LANES);
    let (blocks, block) = if lens.level < BLOCKS { (1, side) } else { (ACROSS, side >> BLOCKS) };
    let beyond = lens.planes();
    rows.seen[..side].fill(u64::MAX);
    for j in 0..blocks {
        if rows.cells[j * block..(j + 1) * block].iter().all(|&bits| bits == 0) {
            continue;
        }
        for (k, (plane, least)) in beyond.into_iter().enumerate() {
            if !stage.crossed[k] {
                continue;
            }
            let mut reach = [0.0f32; SIDE];
            for i in 0..blocks {
                let slab = if blocks == 1 { stage.slab } else { stage.slabs[j][i] };
                reach[i * block..(i + 1) * block].fill(greater(plane[2], slab.low, slab.high));
            }
            for (i, reach) in reach[..lanes].iter_mut().enumerate() {
                let [west, east] = lens.columns(i as i32);
                *reach += greater(plane[0], west, east);
            }
            for y in j * block..(j + 1) * block {
                let bits = rows.cells[y] & rows.seen[y];
                if bits == 0 {
                    continue;
                }
                let [south, north] = lens.rows(y as i32);
                let limit = least - stage.slack - greater(plane[1], south, north);
                let (from, to) = (bits.trailing_zeros() as usize / LANES, (63 - bits.leading_zeros() as usize) / LANES);
                let mut seen = 0u64;
                for at in (from * LANES..=to * LANES).step_by(LANES) {
                    let mut flags = [0u32; LANES];
                    for i in 0..LANES {
                        flags[i] = u32::from(reach[at + i] >= limit) << i;
                    }
                    seen |= u64::from(flags.iter().fold(0, |bits, flag| bits | flag)) << at;
                }
                rows.seen[y] &= seen;
            }
        }
    }
}
