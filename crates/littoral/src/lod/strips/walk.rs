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

use super::super::Vertex;
use super::super::drawing::STEPS;
use super::page::{DEPTH, Page, double, row};

/// Rows of all levels with the one before the page.
const ROWS: usize = (2 << DEPTH) + DEPTH as usize;

/// A page as it is walked: rows and columns in the order of the walk, and what is beyond its sides.
#[derive(Clone, Debug)]
pub(super) struct Rows {
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

impl Default for Rows {
    fn default() -> Rows {
        Rows { depth: 0, cut: [0; ROWS], drawn: [0; ROWS] }
    }
}

impl Rows {
    /// A page between its neighbours to the south, east, north and west, to be walked north- and eastward, or, if `turned`, south- and westward.
    pub fn load(&mut self, page: &Page, beyond: [Beyond; 4], turned: bool) {
        self.depth = page.depth;
        let [south, east, north, west] = beyond;
        let above = if turned { north } else { south };
        for level in 0..=page.depth {
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

/// A point of a page, in halves of the cells of its last level, columns and rows in the order of the walk.
type Point = [u32; 2];

/// One who walks over a page.
pub(super) struct Walk<'a> {
    pub rows: &'a Rows,
    /// What is said.
    pub vertices: &'a mut Vec<Vertex>,
    /// Where strips end.
    pub ends: &'a mut Vec<u32>,
    /// Lattice point where the walk begins, and whether coordinates fall.
    pub corner: [u32; 2],
    pub turned: bool,
    pub face: u32,
    /// Lattice steps along a cell of the last level.
    pub step: u32,
    /// The last pair, below and above, while a strip goes on.
    pub pen: Option<[Point; 2]>,
    /// Where it began.
    pub begun: usize,
    /// Upright triangles.
    pub slivers: &'a mut Vec<[Vertex; 3]>,
}

/// Rows of a level whose cells lie otherwise than beside their like.
struct Special {
    finer_above: u64,
    coarser_above: u64,
    coarser_before: u64,
    coarser_after: u64,
}

const EVEN: u64 = 0x5555_5555_5555_5555;

impl Walk<'_> {
    /// Walks over the page.
    pub fn run(&mut self) {
        self.row(0, 0, 0, 1);
        self.lift();
    }

    fn vertex(&self, [x, y]: Point) -> Vertex {
        // Halves: the level's step may be one.
        let along = |from: u32, way: u32| {
            let way = (u64::from(way) * u64::from(self.step) / 2) as u32;
            if self.turned { from - way } else { from + way }
        };
        Vertex { x: along(self.corner[0], x), y: along(self.corner[1], y), face: self.face, height: 0.0 }
    }

    fn push(&mut self, pair: [Point; 2]) {
        let [below, above] = pair.map(|point| self.vertex(point));
        self.vertices.push(below);
        self.vertices.push(above);
        self.pen = Some(pair);
    }

    /// Ends the strip.
    fn lift(&mut self) {
        if self.vertices.len() > self.begun {
            self.ends.push(self.vertices.len() as u32);
            self.begun = self.vertices.len();
        }
        self.pen = None;
    }

    /// Goes on from a pair, with a new strip unless it is the last one.
    fn go_on(&mut self, pair: [Point; 2]) {
        if self.pen != Some(pair) {
            self.lift();
            self.push(pair);
        }
    }

    /// Walks along row `y` of a level, from column `from` to before column `to`; all cells there exist.
    fn row(&mut self, level: u8, y: i64, from: u32, to: u32) {
        let (cut, drawn) = (self.rows.cut(level, y), self.rows.drawn(level, y, 0));
        let special = self.special(level, y);
        let plain =
            drawn & !(special.finer_above | special.coarser_above | special.coarser_before | special.coarser_after);
        let width = 2u32 << (self.rows.depth - level);
        let (above, below) = (y as u32 * width, (y as u32 + 1) * width);
        let run = |bits: u64, x: u32| (bits >> x).trailing_ones().min(to - x);
        let mut x = from;
        while x < to {
            let same = run(plain, x);
            if same > 0 {
                self.go_on([[x * width, below], [x * width, above]]);
                // Both advance by a cell: (a).
                let ends = [below, above].map(|y| self.vertex([(x + 1) * width, y]));
                let cell = self.step << (self.rows.depth - level);
                let cell = if self.turned { cell.wrapping_neg() } else { cell };
                self.vertices.extend((0..2 * same).map(|i| {
                    let end = ends[(i & 1) as usize];
                    Vertex { x: end.x.wrapping_add((i / 2).wrapping_mul(cell)), ..end }
                }));
                x += same;
                self.pen = Some([[x * width, below], [x * width, above]]);
                continue;
            }
            let finer = run(cut, x);
            if finer > 0 {
                // (d): the upper row goes on, the lower begins, and goes on after (e). Those of the last level are pages.
                if level < self.rows.depth {
                    self.row(level + 1, 2 * y, 2 * x, 2 * (x + finer));
                    self.row(level + 1, 2 * y + 1, 2 * x, 2 * (x + finer));
                }
                x += finer;
            } else if drawn >> x & 1 == 1 {
                self.special_cell(level, [x, y as u32], &special);
                x += 1;
            } else {
                x += run(!(drawn | cut), x).max(1);
            }
        }
    }

    /// Which cells of a row have finer or coarser ones beside them.
    fn special(&self, level: u8, y: i64) -> Special {
        let finer_above = self.rows.cut(level, y - 1);
        if level == 0 {
            return Special { finer_above, coarser_above: 0, coarser_before: 0, coarser_after: 0 };
        }
        let coarse = |y: i64, column: i32| double(self.rows.drawn(level - 1, y, column));
        let upper = y & 1 == 0;
        Special {
            finer_above,
            coarser_above: if upper { coarse((y >> 1) - 1, 0) } else { 0 },
            coarser_before: coarse(y >> 1, -1) & EVEN,
            coarser_after: coarse(y >> 1, 1) & !EVEN,
        }
    }

    /// A cell beside finer or coarser ones.
    fn special_cell(&mut self, level: u8, [x, y]: [u32; 2], special: &Special) {
        let width = 2u32 << (self.rows.depth - level);
        let (west, east, above, below) = (x * width, (x + 1) * width, y * width, (y + 1) * width);
        let upper = y & 1 == 0;
        let is = |bits: u64| bits >> x & 1 == 1;
        let drawn = |x: u32, y: u32| self.rows.drawn(level, i64::from(y), 0) >> x & 1 == 1;
        // A side leaves out its middle if both of its cells are drawn.
        let (column, line) = (drawn(x, y ^ 1), drawn(x ^ 1, y));
        let (before, after, over) = (is(special.coarser_before), is(special.coarser_after), is(special.coarser_above));
        // The ends of the parent's sides.
        let (parent_above, parent_below) = if upper { (above, below + width) } else { (above - width, below) };
        let parent_west = (x & !1) * width;
        if before && !column {
            let middle = if upper { below } else { above };
            self.sliver([[west, parent_below], [west, parent_above], [west, middle]]);
        }
        if after && !column {
            let middle = if upper { below } else { above };
            self.sliver([[east, middle], [east, parent_above], [east, parent_below]]);
        }
        if over && !line {
            let middle = if x & 1 == 0 { east } else { west };
            self.sliver([[middle, above], [parent_west, above], [parent_west + 2 * width, above]]);
        }
        let over = over && line;
        self.go_on(match (before && column, upper) {
            (true, true) => [[west, parent_below], [west, above]],
            (true, false) => [[west, below], [west, below]],
            // The second cell of (c): the upper vertex is there already.
            (false, true) if over && x & 1 == 1 => [[west, below], [east, above]],
            (false, _) => [[west, below], [west, above]],
        });
        let (mut last_below, mut last_above) = ([east, below], [east, above]);
        match (after && column, upper) {
            // (e): the upper strip ends at the coarser cell's corner, the lower goes on with its side.
            (true, true) => last_below = [west, below],
            (true, false) => last_above = [east, parent_above],
            (false, _) => {}
        }
        if over && x & 1 == 0 {
            // (c)
            last_above = [east + width, above];
        }
        if is(special.finer_above) {
            // (b)
            self.push([last_below, [west + width / 2, above]]);
        }
        if self.pen != Some([last_below, last_above]) {
            self.push([last_below, last_above]);
        }
        if after && column && upper {
            self.lift();
        }
    }

    fn sliver(&mut self, points: [Point; 3]) {
        let sliver = points.map(|point| self.vertex(point));
        self.slivers.push(sliver);
    }
}

/// Lattice steps along the cells of a page's last level.
pub(super) fn step(page: &Page) -> u32 {
    STEPS >> (page.cell.level + page.depth)
}
