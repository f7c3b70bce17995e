//! Pages before the eye: which of their cells may be seen, and how far off they would be drawn.
//!
//! How near and how visible a cell is is a matter of its place and of the slab of heights about it. Columns are worked out once for a level, slabs once for
//! a page, and what is left are a few products for sixteen cells at once: bounds are compared by their squares, without roots and quotients.

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

/// Judges cells by their errors (m) and how near they and half a cell about them are at most; those that cannot be cut,
/// which have no finer ones beside them, by themselves and what coarser ones may add. Bounds are those of [`ScreenMetric`](super::super::ScreenMetric) for boxes as high
/// as the blocks about them. Overwrites what is above.
pub(super) fn judge(lens: &Lens, stage: &Stage, rows: &mut Rows) -> Judged {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has just been asked.
        return unsafe { wide::judge(lens, stage, rows) };
    }
    judge_rows(lens, stage, rows)
}

/// The same, row by row.
#[multiversion(targets("x86_64+avx2+fma"))]
fn judge_rows(lens: &Lens, stage: &Stage, rows: &mut Rows) -> Judged {
    let side = 1usize << lens.level;
    let mut judge = Judge::new(lens);
    let mut columns = [Reach::default(); SIDE];
    for (i, columns) in columns[..side].iter_mut().enumerate() {
        let [west, east] = lens.columns(i as i32);
        columns.ahead = lesser(lens.forward[0], west, east) - stage.slack;
        columns.far = square(farther(west, east) + stage.slack);
    }
    for y in 0..side {
        rows.above[y] = 0;
        let [south, north] = lens.rows(y as i32);
        let ahead = lesser(lens.forward[1], south, north);
        let far = square(farther(south, north) + stage.slack);
        let mut asked = rows.cells[y] & rows.whole[y] & rows.seen[y];
        while asked != 0 {
            let x = asked.trailing_zeros() as usize;
            asked &= asked - 1;
            let down = stage.down[stage.block(lens.level, x, y)];
            let reach = Reach { ahead: columns[x].ahead + down + ahead, far: columns[x].far + far };
            rows.above[y] |= u64::from(judge.look(reach, rows.errors[rows.index(x, y)])) << x;
        }
    }
    judge.judged()
}

#[inline(always)]
fn square(x: f32) -> f32 {
    x * x
}

/// How far the farther of two ends is.
#[inline(always)]
fn farther(low: f32, high: f32) -> f32 {
    if -low > high { -low } else { high }
}

/// How far a cell is ahead at least (m), and how far from the plumb line through the eye at most (square of m).
#[derive(Clone, Copy, Default)]
struct Reach {
    ahead: f32,
    far: f32,
}

/// The bound is f·ρ·dz/w²: whether it is above the tolerance is told by squares, without a root or a quotient. The greatest one asks for a quotient
/// where it may grow, which is seldom.
struct Judge {
    /// Square of a bound (pixels) to that of ρ·dz/w².
    scale: f32,
    stretch: f32,
    /// The square that is too much.
    limit: f32,
    /// The greatest squares of what is not too much, and of what is.
    worst: f32,
    most: f32,
    apart: f32,
}

/// What rounding may take from a product that a quotient has.
const LESS: f32 = 1.0 - 1e-6;

impl Judge {
    fn new(lens: &Lens) -> Judge {
        let (seams, apart) = if lens.cuts { (SEAMS, 0.0) } else { (1.0, lens.tolerance / SEAMS) };
        let scale = square(seams * lens.focal * (1.0 + 1e-5));
        let limit = if lens.cuts { square(lens.tolerance) / scale } else { f32::INFINITY };
        Judge { scale, stretch: square(lens.stretch), limit, worst: 0.0, most: 0.0, apart }
    }

    /// Looks at a cell with an error (m): whether its bound is above the tolerance.
    #[inline(always)]
    fn look(&mut self, reach: Reach, error: f32) -> bool {
        let depth = square(if reach.ahead > View::NEAR { reach.ahead } else { View::NEAR });
        let widest = self.stretch * depth;
        let across = if reach.far < widest { reach.far } else { widest };
        let (moved, depth) = (error * error * across, depth * depth);
        let is_above = moved > self.limit * depth;
        let greatest = if is_above { &mut self.most } else { &mut self.worst };
        if moved > *greatest * LESS * depth {
            *greatest = greatest.max(moved / depth);
        }
        is_above
    }

    fn judged(&self) -> Judged {
        let pixels =
            |square: f32| if square > 0.0 { (square * self.scale).sqrt() * (1.0 + 1e-5) + self.apart } else { 0.0 };
        Judged { worst: pixels(self.worst), most: pixels(self.most) }
    }
}

/// Sixteen cells at once: where rows are shorter, several of them.
#[cfg(target_arch = "x86_64")]
mod wide {
    use super::*;
    use std::arch::x86_64::*;

    /// How far cells are ahead, and how far off, along one axis.
    #[target_feature(enable = "avx512f")]
    #[inline]
    fn reach(lens: &Lens, axis: usize, cells: __m512i, slack: f32) -> (__m512, __m512) {
        let [size, rest, beyond] = [lens.size[axis], lens.rest[axis], lens.beyond[axis]].map(|x| _mm512_set1_ps(x));
        let first = _mm512_add_epi32(cells, _mm512_set1_epi32(lens.cells[axis]));
        let last = _mm512_add_epi32(first, _mm512_set1_epi32(1));
        let low = _mm512_sub_ps(_mm512_sub_ps(_mm512_mul_ps(_mm512_cvtepi32_ps(first), size), rest), beyond);
        let high = _mm512_add_ps(_mm512_sub_ps(_mm512_mul_ps(_mm512_cvtepi32_ps(last), size), rest), beyond);
        let normal = lens.forward[axis];
        let ahead = _mm512_mul_ps(_mm512_set1_ps(normal), if normal > 0.0 { low } else { high });
        let far = _mm512_max_ps(_mm512_sub_ps(_mm512_set1_ps(-0.0), low), high);
        let far = _mm512_add_ps(far, _mm512_set1_ps(slack));
        (ahead, _mm512_mul_ps(far, far))
    }

    /// [`Judge::look`] for sixteen cells, of which those that are `asked` count among the greatest.
    #[target_feature(enable = "avx512f")]
    #[inline]
    fn look(judge: &mut Judge, ahead: __m512, far: __m512, errors: __m512, asked: u16) -> u16 {
        let depth = _mm512_max_ps(ahead, _mm512_set1_ps(View::NEAR));
        let depth = _mm512_mul_ps(depth, depth);
        let across = _mm512_min_ps(far, _mm512_mul_ps(_mm512_set1_ps(judge.stretch), depth));
        let moved = _mm512_mul_ps(_mm512_mul_ps(errors, errors), across);
        let depth = _mm512_mul_ps(depth, depth);
        let than = |square: f32| _mm512_mul_ps(_mm512_set1_ps(square), depth);
        let above = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(moved, than(judge.limit)) & asked;
        let below = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(moved, than(judge.worst * LESS)) & asked & !above;
        let beyond = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(above, moved, than(judge.most * LESS));
        if below | beyond != 0 {
            let bounds = _mm512_div_ps(moved, depth);
            judge.worst = judge.worst.max(_mm512_reduce_max_ps(_mm512_maskz_mov_ps(below, bounds)));
            judge.most = judge.most.max(_mm512_reduce_max_ps(_mm512_maskz_mov_ps(beyond, bounds)));
        }
        above
    }

    /// [`judge_rows`](super::judge_rows) where the processor has AVX-512: twice to four times as fast.
    #[target_feature(enable = "avx512f")]
    pub fn judge(lens: &Lens, stage: &Stage, rows: &mut Rows) -> Judged {
        let (level, side, slack) = (lens.level, 1usize << lens.level, stage.slack);
        let mut judge = Judge::new(lens);
        let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        // SAFETY: sixteen numbers are sixty-four bytes.
        let down = unsafe { _mm512_loadu_ps(stage.down.as_ptr()) };
        // Cells along a block; where there are no blocks in the level, all of them are the first.
        let block = _mm_cvtsi64_si128(if level < BLOCKS { 31 } else { i64::from(level - BLOCKS) });
        let down = if level < BLOCKS { _mm512_set1_ps(stage.down[ACROSS * ACROSS]) } else { down };
        if side < LANES {
            let mut cells = 0u64;
            for y in 0..side {
                cells |= (rows.cells[y] & rows.whole[y] & rows.seen[y]) << (y * side);
            }
            let columns = _mm512_and_si512(lanes, _mm512_set1_epi32(side as i32 - 1));
            let (x_ahead, x_far) = reach(lens, 0, columns, slack);
            let x_ahead = _mm512_sub_ps(x_ahead, _mm512_set1_ps(slack));
            let mut above = 0u64;
            for (part, errors) in rows.errors.as_chunks::<LANES>().0[..(side * side).div_ceil(LANES)].iter().enumerate()
            {
                let at = part * LANES;
                let y = _mm512_add_epi32(lanes, _mm512_set1_epi32(at as i32));
                let y = _mm512_srl_epi32(y, _mm_cvtsi64_si128(level.into()));
                let (y_ahead, y_far) = reach(lens, 1, y, slack);
                let blocks = _mm512_slli_epi32::<{ BLOCKS as u32 }>(_mm512_srl_epi32(y, block));
                let blocks = _mm512_add_epi32(blocks, _mm512_srl_epi32(columns, block));
                let ahead = _mm512_add_ps(x_ahead, _mm512_permutexvar_ps(blocks, down));
                // SAFETY: sixteen numbers are sixty-four bytes.
                let errors = unsafe { _mm512_loadu_ps(errors.as_ptr()) };
                let (ahead, far) = (_mm512_add_ps(ahead, y_ahead), _mm512_add_ps(x_far, y_far));
                above |= u64::from(look(&mut judge, ahead, far, errors, (cells >> at) as u16)) << at;
            }
            for y in 0..side {
                rows.above[y] = above >> (y * side) & ((1 << side) - 1);
            }
            return judge.judged();
        }
        let mut columns = [(_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_si512()); SIDE / LANES];
        for (part, columns) in columns[..side / LANES].iter_mut().enumerate() {
            let x = _mm512_add_epi32(lanes, _mm512_set1_epi32((part * LANES) as i32));
            let (ahead, far) = reach(lens, 0, x, slack);
            *columns = (_mm512_sub_ps(ahead, _mm512_set1_ps(slack)), far, _mm512_srl_epi32(x, block));
        }
        let (mut sixteen_ahead, mut sixteen_far) = (_mm512_setzero_ps(), _mm512_setzero_ps());
        for y in 0..side {
            if y % LANES == 0 {
                let y = _mm512_add_epi32(lanes, _mm512_set1_epi32(y as i32));
                (sixteen_ahead, sixteen_far) = reach(lens, 1, y, slack);
            }
            let asked = rows.cells[y] & rows.whole[y] & rows.seen[y];
            rows.above[y] = 0;
            if asked == 0 {
                continue;
            }
            let lane = _mm512_set1_epi32((y % LANES) as i32);
            let y_ahead = _mm512_permutexvar_ps(lane, sixteen_ahead);
            let y_far = _mm512_permutexvar_ps(lane, sixteen_far);
            let blocks = _mm512_set1_epi32(((y >> (level - BLOCKS)) << BLOCKS) as i32);
            let mut above = 0;
            for (part, &(ahead, far, block)) in columns[..side / LANES].iter().enumerate() {
                let (at, cells) = (part * LANES, (asked >> (part * LANES)) as u16);
                if cells == 0 {
                    continue;
                }
                let down = _mm512_permutexvar_ps(_mm512_add_epi32(blocks, block), down);
                let ahead = _mm512_add_ps(_mm512_add_ps(ahead, down), y_ahead);
                let errors = rows.errors[rows.index(at, y)..][..LANES].as_ptr();
                // SAFETY: sixteen numbers are sixty-four bytes.
                let errors = unsafe { _mm512_loadu_ps(errors) };
                above |= u64::from(look(&mut judge, ahead, _mm512_add_ps(far, y_far), errors, cells)) << at;
            }
            rows.above[y] = above;
        }
        judge.judged()
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Land, Raster};
    use crate::lod::ScreenMetric;
    use glam::{DVec3, UVec2};

    /// Sixteen cells at once are judged as single ones are.
    #[test]
    #[cfg(target_arch = "x86_64")]
    fn cells_are_judged_alike_by_all_processors() {
        if !std::arch::is_x86_feature_detected!("avx512f") {
            println!("this processor has no AVX-512: not tested");
            return;
        }
        let bumps = (0..129 * 129).map(|i| ((i * 7919) % 101) as f32 * 0.1).collect();
        let land = Land::new(Raster::new(129, 129, DVec2::new(3.0, 5.0), bumps).expect("valid"));
        let (mut state, mut above) = (7u64, 0);
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            state ^ state >> 29
        };
        for (eye, tolerance) in [((-40.0, 60.0, 130.0), 9.0), ((-900.0, 90.0, 20.0), 4.0), ((0.0, 0.0, 400.0), 0.5)] {
            let view = View::looking_at(DVec3::from(eye), DVec3::Z, 0.8, UVec2::new(320, 200));
            let metric = ScreenMetric::new(&view, crate::field::HeightField::datum(&land)).expect("a view");
            let page = Cell { level: 1, x: 1, y: 0, face: 0 };
            let asked = Asked::new(&land, &metric, tolerance, 9);
            let stage = Stage::new(&asked, page, 6);
            for (level, cuts) in (1..=6).flat_map(|level| [(level, true), (level, false)]) {
                let lens = Lens::new(&asked, Cell { level: 1 + level, x: 1 << level, y: 0, face: 0 }, level, cuts);
                let rows = |random: &mut dyn FnMut() -> u64| {
                    let mut rows = Rows::default();
                    rows.room(level);
                    let side = 1usize << level;
                    let all = u64::MAX >> (64 - side);
                    rows.cells[..side].fill_with(|| random() & all);
                    rows.whole[..side].fill_with(|| random() | random());
                    rows.seen[..side].fill_with(|| random() | random());
                    rows.errors.fill_with(|| (random() >> 40) as f32 * 3e-7);
                    rows
                };
                let mut rows = rows(&mut random);
                let one = judge_rows(&lens, &stage, &mut rows);
                let said = rows.above;
                // SAFETY: the processor has just been asked.
                let other = unsafe { wide::judge(&lens, &stage, &mut rows) };
                assert_eq!(said, rows.above, "level {level}");
                assert_eq!((one.worst, one.most), (other.worst, other.most), "level {level}");
                above += said.iter().map(|bits| bits.count_ones()).sum::<u32>();
            }
        }
        assert!((1000..10_000).contains(&above), "{above} above");
    }
}
