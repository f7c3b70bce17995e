//! The walk over a page: strips of triangles along its rows.
//!
//! A strip is a chain of pairs of vertices, one on the side of the row walked before (above), one on the other (below); two pairs in a row make
//! two triangles, or one where they share a vertex. The five cases of the paper are five ways to say the next pair:
//!
//! - (a) a cell beside its like: both vertices advance by a cell;
//! - (b) above it cells are finer: the upper vertex advances by half a cell, then by another half;
//! - (c) above it a cell is coarser: over two cells the upper vertex advances once, by both;
//! - (d) the next cells are finer: the strip goes on in the upper of two rows, and a new one is begun in the lower;
//! - (e) the next cell is coarser: the upper strip ends at its corner, and the lower one goes on, twice as wide.
//!
//! A finer side leaves out what the coarser cell above, before or after it lacks. Where half of such a side has no surface the vertex stays, and
//! an upright triangle closes the gap.

use super::page::{DEPTH, Page, SIDE, double, row};
use std::ops::Range;

/// Rows of all levels with the one before the page.
const ROWS: usize = (2 << DEPTH) + DEPTH as usize;

/// A page as it is walked: rows and columns in the order of the walk, and what is beyond its sides.
#[derive(Clone, Debug)]
pub(super) struct Way {
    depth: u8,
    /// What is cut: row −1 is that of the page above.
    cut: [u64; ROWS],
    /// What is drawn: bit i + 1 is that of cell i.
    drawn: [u128; ROWS],
}

/// What lies beyond a side of a page.
#[derive(Clone, Copy, Default)]
pub(super) struct Beyond<'a> {
    /// A page as large as this one …
    pub page: Option<&'a Page>,
    /// … or a cell as large that is drawn whole.
    pub cell: bool,
}

/// Where the row `y`, from −1 on, of a level is.
fn index(level: u8, y: i64) -> usize {
    ((1i64 << level) + i64::from(level) + y) as usize
}

impl Default for Way {
    fn default() -> Way {
        Way { depth: 0, cut: [0; ROWS], drawn: [0; ROWS] }
    }
}

impl Way {
    /// A page between its neighbours to the south, east, north and west, to be walked north- and eastward, or, if `turned`, south- and westward.
    pub fn load(&mut self, page: &Page, beyond: [Beyond; 4], turned: bool) {
        self.depth = page.depth;
        let [south, east, north, west] = beyond;
        let above = if turned { north } else { south };
        for level in 0..=page.deepest() {
            let side = 1u32 << level;
            let order = |y: u32| if turned { side - 1 - y } else { y };
            let last = |of: Beyond, y: u32, x: u32| match of.page {
                Some(page) => u128::from(page.drawn[row(level, y)] >> x & 1),
                None => u128::from(level == 0 && of.cell),
            };
            for y in 0..side {
                let at = index(level, i64::from(order(y)));
                let (cut, drawn) = (page.cut[row(level, y)], page.drawn[row(level, y)]);
                let padded = u128::from(drawn) << 1 | last(west, y, side - 1) | last(east, y, 0) << (side + 1);
                if turned {
                    self.cut[at] = cut.reverse_bits() >> (64 - side);
                    self.drawn[at] = padded.reverse_bits() >> (126 - side);
                } else {
                    (self.cut[at], self.drawn[at]) = (cut, padded);
                }
            }
            let at = index(level, -1);
            let (cut, drawn) = match above.page {
                Some(above) => {
                    let at = row(level, if turned { 0 } else { side - 1 });
                    (above.cut[at], above.drawn[at])
                }
                None => (0, u64::from(level == 0 && above.cell)),
            };
            if turned {
                self.cut[at] = cut.reverse_bits() >> (64 - side);
                self.drawn[at] = u128::from(drawn.reverse_bits() >> (64 - side)) << 1;
            } else {
                (self.cut[at], self.drawn[at]) = (cut, u128::from(drawn) << 1);
            }
        }
    }

    fn cut(&self, level: u8, y: i64) -> u64 {
        self.cut[index(level, y)]
    }

    /// Bits of the cells a column further west (−1), here (0) or further east (1).
    fn drawn(&self, level: u8, y: i64, column: i32) -> u64 {
        (self.drawn[index(level, y)] >> (column + 1)) as u64
    }
}

/// A point of the face's lattice.
type Point = [u32; 2];

/// Two vertices, below and above.
type Pair = [Point; 2];

/// What no vertices are.
const NONE: Pair = [[u32::MAX; 2]; 2];

/// No cell says more than three pairs, and ends two strips.
const POINTS: usize = 6 * SIDE * SIDE + 16;
const ENDS: usize = 2 * SIDE * SIDE + 2;

/// What a walk over a page leaves behind.
#[derive(Clone, Debug)]
pub(super) struct Trail {
    points: Vec<Point>,
    length: usize,
    ends: Vec<u32>,
    strips: usize,
    /// Upright triangles.
    slivers: Vec<[Point; 3]>,
    /// Where the strip that goes on began.
    begun: usize,
    /// Its last pair.
    pen: Pair,
}

impl Default for Trail {
    fn default() -> Trail {
        let (points, ends) = (vec![[0; 2]; POINTS], vec![0; ENDS]);
        Trail { points, length: 0, ends, strips: 0, slivers: Vec::new(), begun: 0, pen: NONE }
    }
}

impl Trail {
    fn clear(&mut self) {
        (self.length, self.strips, self.begun, self.pen) = (0, 0, 0, NONE);
        self.slivers.clear();
    }

    /// The vertices of all strips, and where each ends.
    pub fn strips(&self) -> (&[Point], &[u32]) {
        (&self.points[..self.length], &self.ends[..self.strips])
    }

    /// The upright triangles.
    pub fn slivers(&self) -> &[[Point; 3]] {
        &self.slivers
    }

    /// Says a pair.
    fn say(&mut self, pair: Pair) {
        self.points[self.length..][..2].copy_from_slice(&pair);
        self.length += 2;
    }

    /// Ends the strip, if there is one.
    fn lift(&mut self) {
        if self.length > self.begun {
            self.ends[self.strips] = self.length as u32;
            self.strips += 1;
            self.begun = self.length;
        }
        self.pen = NONE;
    }

    /// Goes on from a pair, with a new strip unless it is the last one.
    fn go_on(&mut self, pair: Pair) {
        if self.pen != pair {
            self.lift();
            self.say(pair);
        }
    }
}

/// One who walks over a page.
pub(super) struct Walk<'a> {
    pub way: &'a Way,
    pub trail: &'a mut Trail,
    /// Lattice point where the walk begins.
    pub corner: Point,
    /// Lattice steps along the page, negative (two's complement) where coordinates fall.
    pub side: u32,
}

/// A row of cells: sides along it (lattice steps), and a bit for each cell whose neighbours are not its like.
struct Row {
    width: u32,
    above: u32,
    below: u32,
    upper: bool,
    drawn: u64,
    /// Beside a coarser cell: its side leaves out its middle with that of the other row.
    before: u64,
    after: u64,
    /// Both cells below a coarser one.
    over: u64,
    /// Below two finer ones.
    finer: u64,
}

const EVEN: u64 = 0x5555_5555_5555_5555;

impl Walk<'_> {
    /// Walks over the page.
    pub fn run(&mut self) {
        self.trail.clear();
        self.row(0, 0, 0, 1);
        self.trail.lift();
    }

    /// Walks along row `y` of a level, from column `from` to before column `to`; all cells there exist.
    fn row(&mut self, level: u8, y: u32, from: u32, to: u32) {
        let cut = self.way.cut(level, y.into());
        let row = self.sides(level, y, from..to);
        let run = |bits: u64, x: u32| bits.unbounded_shr(x).trailing_ones().min(to - x);
        let mut x = from;
        while x < to {
            let drawn = run(row.drawn, x);
            if drawn > 0 {
                self.cells(x, x + drawn, &row);
                x += drawn;
            }
            let finer = run(cut, x);
            if finer > 0 {
                // (d): the upper row goes on, the lower begins, and goes on after (e). Those of the last level are pages.
                if level < self.way.depth {
                    self.row(level + 1, 2 * y, 2 * x, 2 * (x + finer));
                    self.row(level + 1, 2 * y + 1, 2 * x, 2 * (x + finer));
                }
                x += finer;
            }
            x += run(!(row.drawn | cut), x);
        }
    }

    /// A row's sides and neighbours. Where only half of a coarser cell's side has a surface an upright triangle closes the gap.
    fn sides(&mut self, level: u8, y: u32, part: Range<u32>) -> Row {
        let width = (self.side as i32 >> level) as u32;
        let above = self.corner[1].wrapping_add(y.wrapping_mul(width));
        let y = i64::from(y);
        let (drawn, finer, upper) = (self.way.drawn(level, y, 0), self.way.cut(level, y - 1), y & 1 == 0);
        let mut row =
            Row { width, above, below: above.wrapping_add(width), upper, drawn, before: 0, after: 0, over: 0, finer };
        if level == 0 {
            return row;
        }
        let coarse = |y: i64, column: i32| double(self.way.drawn(level - 1, y, column));
        let before = drawn & coarse(y >> 1, -1) & EVEN;
        let after = drawn & coarse(y >> 1, 1) & !EVEN;
        let over = if upper { drawn & coarse((y >> 1) - 1, 0) } else { 0 };
        // A side leaves out its middle if both of its cells are drawn.
        let column = self.way.drawn(level, y ^ 1, 0);
        let line = drawn >> 1 & EVEN | (drawn & EVEN) << 1;
        (row.before, row.after, row.over) = (before & column, after & column, over & line);
        let alone = [before & !column, after & !column, over & !line];
        if alone.iter().any(|&bits| bits != 0) {
            self.close(&row, alone, part);
        }
        row
    }

    /// Upright triangles where half of a coarser cell's side before, after or above is alone.
    fn close(&mut self, row: &Row, [before, after, over]: [u64; 3], part: Range<u32>) {
        let &Row { width, above, below, upper, .. } = row;
        let middle = if upper { below } else { above };
        // The ends of the coarser cell's sides.
        let parent_above = if upper { above } else { above.wrapping_sub(width) };
        let parent_below = if upper { below.wrapping_add(width) } else { below };
        for x in part {
            let is = |bits: u64| bits >> x & 1 == 1;
            let west = self.corner[0].wrapping_add(x.wrapping_mul(width));
            let east = west.wrapping_add(width);
            if is(before) {
                self.trail.slivers.push([[west, parent_below], [west, parent_above], [west, middle]]);
            }
            if is(after) {
                self.trail.slivers.push([[east, middle], [east, parent_above], [east, parent_below]]);
            }
            if is(over) {
                let (middle, parent_west) = if x & 1 == 1 { (west, west.wrapping_sub(width)) } else { (east, west) };
                let parent_east = parent_west.wrapping_add(width.wrapping_mul(2));
                self.trail.slivers.push([[middle, above], [parent_west, above], [parent_east, above]]);
            }
        }
    }

    /// Cells of a row that are drawn, one beside the other.
    fn cells(&mut self, from: u32, to: u32, row: &Row) {
        let &Row { width, above, below, upper, .. } = row;
        let half = (width as i32 / 2) as u32;
        let trail = &mut *self.trail;
        let mut west = self.corner[0].wrapping_add(from.wrapping_mul(width));
        let mut first = [[west, below], [west, above]];
        if row.before >> from & 1 == 1 {
            // After a coarser cell the upper strip begins with all of its side, the lower at its corner.
            first = if upper { [[west, below.wrapping_add(width)], [west, above]] } else { [[west, below]; 2] };
        }
        trail.go_on(first);
        // (b): above finer cells the upper vertex advances by halves; (c): below a coarser one by both cells at once; else (a). Which it is, and how
        // many cells there are, is data and no branch, since it could not be foreseen: four are written together, and what is too much is overwritten.
        let cells = to - from;
        let (finer, over) = (row.finer >> from, (row.over & EVEN) >> from);
        let points = &mut trail.points[trail.length..];
        let mut length = 0;
        for x in (0..cells).step_by(4) {
            let Some(four) = points[length..].first_chunk_mut::<16>() else { break };
            let (finer, over, mut at) = (finer >> x, over >> x, 0);
            for i in 0..4 {
                let east = west.wrapping_add(width);
                let ahead = east.wrapping_add(width & (over >> i & 1).wrapping_neg() as u32);
                // `at` never exceeds 4 i: the mask spares the check.
                four[at & 14] = [east, below];
                four[(at & 14) + 1] = [west.wrapping_add(half), above];
                at += 2 * (finer >> i & 1) as usize;
                four[at & 14] = [east, below];
                four[(at & 14) + 1] = [ahead, above];
                at += 2;
                west = east;
            }
            length += at;
        }
        length = 2 * (cells + (finer & u64::MAX >> (64 - cells)).count_ones()) as usize;
        let west = self.corner[0].wrapping_add(to.wrapping_mul(width));
        trail.length += length;
        let mut last = [[west, below], points[length - 1]];
        let x = to - 1;
        if row.after >> x & 1 == 1 {
            // (e): the upper strip ends at the coarser cell's corner, the lower goes on with its side.
            if upper {
                let corner = west.wrapping_sub(width);
                let finer = row.finer >> x & 1 == 1;
                points[length - 2][0] = corner;
                if finer {
                    points[length - 4][0] = corner;
                } else if row.over >> x & 1 == 1 {
                    // It is there already.
                    trail.length -= 2;
                }
                trail.lift();
                return;
            }
            last[1][1] = above.wrapping_sub(width);
            points[length - 1] = last[1];
        }
        trail.pen = last;
    }
}
