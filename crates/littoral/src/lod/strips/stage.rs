//! Pages before the eye: which of their cells may be seen, and how far off they would be drawn.
//!
//! How near and how visible a cell is is a matter of its place and of the slab of heights about it. Columns are worked out once for a level, slabs once for its
//! rows within a block, and what is left for each row are a root and a quotient for sixteen cells at once.

use super::super::metric::Bounds;
use super::page::{Asked, SEAMS, SIDE};
use crate::field::HeightRange;
use crate::space::{Cell, Datum, View};
use glam::{DVec2, Vec3};
use multiversion::multiversion;

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
    pub errors: [[f32; SIDE]; SIDE],
    /// What may be seen, and what has a bound above what was asked.
    pub seen: [u64; SIDE],
    pub above: [u64; SIDE],
}

impl Default for Rows {
    fn default() -> Rows {
        let (cells, errors) = ([0; SIDE], [[0.0; SIDE]; SIDE]);
        Rows { cells, whole: cells, errors, seen: cells, above: cells }
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
    /// Whether no part of it is void.
    pub whole: bool,
    /// Whether all of it lies within the frame.
    pub inside: bool,
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
        let mut slabs = [[HeightRange::EMPTY; ACROSS]; ACROSS];
        let mut slab = HeightRange::EMPTY;
        let eye = asked.metric.eye().z;
        let blur = eye.abs() as f32 * f32::EPSILON;
        for (y, slabs) in slabs[..across].iter_mut().enumerate() {
            for (x, here) in slabs[..across].iter_mut().enumerate() {
                let rows = ranges[y..y + 3].iter().flat_map(|row| &row[x..x + 3]);
                let range = rows.fold(HeightRange::EMPTY, |all, range| all.union(*range));
                *here = HeightRange { low: range.low - eye as f32 - blur, high: range.high - eye as f32 + blur };
                slab = slab.union(*here);
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
        let inside = lens.sides.iter().all(|&side| least(side) >= slack) && least(lens.forward) >= View::NEAR + slack;
        let whole = asked.field.error(page).is_finite() && !asked.field.range(page).is_empty();
        let apart = |[low, high]: [f32; 2]| low.max(-high).max(0.0);
        let away = apart(columns).hypot(apart(rows)).hypot(apart([slab.low, slab.high]));
        let near = away < slab.high - slab.low;
        Stage { slabs, slab, whole, inside, near, slack }
    }
}

/// What rounding may take from a sum of coordinates, a few units in the last place.
const SLACK: f32 = 4e-6;

/// The lesser product of a normal's component with a coordinate between two.
#[inline(always)]
fn lesser(normal: f32, low: f32, high: f32) -> f32 {
    normal * if normal > 0.0 { low } else { high }
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
        let (origin, size) = match asked.field.datum() {
            Datum::Plane { origin, size } => (origin, size),
            Datum::Ellipsoid { .. } => (DVec2::ZERO, DVec2::ONE),
        };
        let (forward, sides, focal, stretch) = asked.metric.lens();
        let cell = size * first.side();
        let at = (asked.metric.eye().truncate() - origin) / cell;
        let whole = at.floor().clamp(DVec2::splat(-1e9), DVec2::splat(1e9));
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

/// Judges cells by their errors (m) and how near they and half a cell about them are at most; those that cannot be cut,
/// which have no finer ones beside them, by themselves and what coarser ones may add. Bounds are those of [`ScreenMetric`](super::super::ScreenMetric) for boxes as high
/// as the blocks about them. Overwrites what is above.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn judge(lens: &Lens, stage: &Stage, rows: &mut Rows) -> Judged {
    let side = 1usize << lens.level;
    let lanes = side.max(LANES);
    let (blocks, block) = if lens.level < BLOCKS { (1, side) } else { (ACROSS, side >> BLOCKS) };
    let (mut ahead, mut far) = ([0.0f32; SIDE], [0.0f32; SIDE]);
    for i in 0..lanes {
        let [west, east] = lens.columns(i as i32);
        ahead[i] = lesser(lens.forward[0], west, east) - stage.slack;
        let most = if -west > east { -west } else { east };
        far[i] = most * most;
    }
    let (seams, apart) = if lens.cuts { (SEAMS, 0.0) } else { (1.0, lens.tolerance / SEAMS) };
    let (mut worst, mut most_above) = ([0.0f32; LANES], [0.0f32; LANES]);
    rows.above[..side].fill(0);
    for j in 0..blocks {
        if rows.cells[j * block..(j + 1) * block].iter().all(|&bits| bits == 0) {
            continue;
        }
        let mut depth = [0.0f32; SIDE];
        for i in 0..blocks {
            let slab = if blocks == 1 { stage.slab } else { stage.slabs[j][i] };
            let part = i * block..(i + 1) * block;
            depth[part].fill(lesser(lens.forward[2], slab.low, slab.high));
        }
        for i in 0..lanes {
            depth[i] += ahead[i];
        }
        for y in j * block..(j + 1) * block {
            let bits = rows.cells[y];
            if bits == 0 {
                continue;
            }
            let [south, north] = lens.rows(y as i32);
            let ahead = lesser(lens.forward[1], south, north);
            let most = if -south > north { -south } else { north };
            let far_y = most * most;
            let errors = &rows.errors[y];
            let (from, to) = (bits.trailing_zeros() as usize / LANES, (63 - bits.leading_zeros() as usize) / LANES);
            let mut above = 0u64;
            for at in (from * LANES..=to * LANES).step_by(LANES) {
                let (depth, far, errors) = (&depth[at..at + LANES], &far[at..at + LANES], &errors[at..at + LANES]);
                let asked = ((bits & rows.whole[y] & rows.seen[y]) >> at) as u32;
                let mut flags = [0u32; LANES];
                for i in 0..LANES {
                    let nearest = depth[i] + ahead;
                    let depth = if nearest > View::NEAR { nearest } else { View::NEAR };
                    let across = (far[i] + far_y).sqrt() + stage.slack;
                    let widest = lens.stretch * depth;
                    let within = if across < widest { across } else { widest };
                    let scale = lens.focal * within / (depth * depth) * (1.0 + 1e-5);
                    let bound = seams * errors[i] * scale + apart;
                    let is_above = lens.cuts & (bound > lens.tolerance);
                    flags[i] = u32::from(is_above) << i;
                    let bound = if asked >> i & 1 == 1 { bound } else { 0.0 };
                    let (below, beyond) = if is_above { (0.0, bound) } else { (bound, 0.0) };
                    worst[i] = if below > worst[i] { below } else { worst[i] };
                    most_above[i] = if beyond > most_above[i] { beyond } else { most_above[i] };
                }
                above |= u64::from(flags.iter().fold(0, |bits, flag| bits | flag)) << at;
            }
            rows.above[y] = above;
        }
    }
    Judged { worst: worst.into_iter().fold(0.0, f32::max), most: most_above.into_iter().fold(0.0, f32::max) }
}

/// Says which cells near the eye may lie within the frame, of those of which `seen` says so, and, if asked to, judges them, each by its own heights and those of
/// the cells beside it; `first` is the level's first cell.
pub(super) fn look_near(asked: &Asked, lens: &Lens, first: Cell, judges: bool, rows: &mut Rows) -> Judged {
    let mut judged = Judged::default();
    let (seams, apart) = if lens.cuts { (SEAMS, 0.0) } else { (1.0, lens.tolerance / SEAMS) };
    let cells = 1i64 << first.level;
    let beyond = Vec3::new(lens.beyond[0], lens.beyond[1], 0.0);
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
            let cell = Cell { x: first.x + x, y: first.y + y as u32, ..first };
            let own = asked.metric.bounds(cell, range);
            let bounds = Bounds { low: own.low - beyond, high: own.high + beyond };
            if !asked.metric.sees(&bounds) {
                rows.seen[y] &= !(1 << x);
                continue;
            }
            if !judges || rows.whole[y] >> x & 1 == 0 {
                continue;
            }
            let bound = seams * asked.metric.pixels(&bounds, rows.errors[y][x as usize]) * (1.0 + 1e-5) + apart;
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
    // The nearest plane counts like the sides.
    let [a, b, c, d] = lens.sides;
    let planes = [a, b, c, d, lens.forward];
    let least = [0.0, 0.0, 0.0, 0.0, View::NEAR].map(|least| least - stage.slack);
    for j in 0..blocks {
        if rows.cells[j * block..(j + 1) * block].iter().all(|&bits| bits == 0) {
            continue;
        }
        let mut reach = [[0.0f32; SIDE]; 5];
        for (plane, reach) in planes.iter().zip(&mut reach) {
            for i in 0..blocks {
                let slab = if blocks == 1 { stage.slab } else { stage.slabs[j][i] };
                reach[i * block..(i + 1) * block].fill(greater(plane[2], slab.low, slab.high));
            }
            for (i, reach) in reach[..lanes].iter_mut().enumerate() {
                let [west, east] = lens.columns(i as i32);
                *reach += greater(plane[0], west, east);
            }
        }
        for y in j * block..(j + 1) * block {
            let bits = rows.cells[y];
            if bits == 0 {
                continue;
            }
            let [south, north] = lens.rows(y as i32);
            let mut limits = [0.0f32; 5];
            for (k, limit) in limits.iter_mut().enumerate() {
                *limit = least[k] - greater(planes[k][1], south, north);
            }
            let (from, to) = (bits.trailing_zeros() as usize / LANES, (63 - bits.leading_zeros() as usize) / LANES);
            let mut seen = 0u64;
            for at in (from * LANES..=to * LANES).step_by(LANES) {
                let mut flags = [0u32; LANES];
                for i in 0..LANES {
                    let mut sees = true;
                    for k in 0..5 {
                        sees &= reach[k][at + i] >= limits[k];
                    }
                    flags[i] = u32::from(sees) << i;
                }
                seen |= u64::from(flags.iter().fold(0, |bits, flag| bits | flag)) << at;
            }
            rows.seen[y] = seen;
        }
    }
}
