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
//!
//! Which case it is cannot be foreseen, and most runs of like cells are short: a branch that depends on it costs more than what it spares. So
//! pairs are written whether they are needed or not, what is too much is overwritten, and two cells are one instruction where processors have it.

use super::page::{DEPTH, Page, SIDE, double, row};
use multiversion::multiversion;
use std::ops::Range;

/// Rows of all levels with the one before the page.
const ROWS: usize = (2 << DEPTH) + DEPTH as usize;

/// A page as it is walked: rows and columns in the order of the walk, and what is beyond its sides.
#[derive(Clone, Debug)]
pub(super) struct Way {
    depth: u8,
    /// What is cut: row −1 is that of the page above.
    cut: [u64; ROWS],
    /// What is drawn, likewise.
    drawn: [u64; ROWS],
    /// What is drawn just before and just after the rows of each level, a bit for each row.
    before: [u64; DEPTH as usize + 1],
    after: [u64; DEPTH as usize + 1],
}

/// What lies beyond a side of a page.
#[derive(Clone, Copy, Default)]
pub(super) struct Beyond<'a> {
    /// A page as large as this one …
    pub page: Option<&'a Page>,
    /// … or a cell as large that is drawn whole.
    pub cell: bool,
}

impl Beyond<'_> {
    /// What is drawn in a column of a level, a bit for each row.
    #[inline(always)]
    fn column(&self, level: u8, x: u32) -> u64 {
        match self.page {
            Some(page) if level <= page.deepest() => column(&page.drawn[row(level, 0)..][..1 << level], x),
            Some(_) => 0,
            None => u64::from(level == 0 && self.cell),
        }
    }

    /// What is cut and what is drawn in a row of a level.
    fn row(&self, level: u8, y: u32) -> [u64; 2] {
        match self.page {
            Some(page) => [page.cut[row(level, y)], page.drawn[row(level, y)]],
            None => [0, u64::from(level == 0 && self.cell)],
        }
    }
}

/// A column of bits as a row.
#[inline(always)]
fn column(rows: &[u64], x: u32) -> u64 {
    let mut bits = 0;
    for (y, row) in rows.iter().enumerate() {
        bits |= (row >> x & 1) << y;
    }
    bits
}

/// Where the row `y`, from −1 on, of a level is.
fn index(level: u8, y: i64) -> usize {
    ((1i64 << level) + i64::from(level) + y) as usize
}

/// [`Way::load`].
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn load(way: &mut Way, page: &Page, beyond: &[Beyond; 4], turned: bool) {
    way.depth = page.depth;
    let [south, east, north, west] = beyond;
    for level in 0..=page.deepest() {
        let side = 1usize << level;
        let (at, above) = (index(level, 0), index(level, -1));
        let rows = row(level, 0)..row(level, 0) + side;
        let both = page.cut[rows.clone()].iter().zip(&page.drawn[rows]);
        let ways = way.cut[at..at + side].iter_mut().zip(&mut way.drawn[at..at + side]);
        let columns = [east.column(level, 0), west.column(level, side as u32 - 1)];
        let slot = usize::from(level);
        if turned {
            for (to, from) in ways.zip(both.rev()) {
                (*to.0, *to.1) = (turn(*from.0, side), turn(*from.1, side));
            }
            [way.before[slot], way.after[slot]] = columns.map(|bits| turn(bits, side));
            [way.cut[above], way.drawn[above]] = north.row(level, 0).map(|bits| turn(bits, side));
        } else {
            for (to, from) in ways.zip(both) {
                (*to.0, *to.1) = (*from.0, *from.1);
            }
            [way.after[slot], way.before[slot]] = columns;
            [way.cut[above], way.drawn[above]] = south.row(level, side as u32 - 1);
        }
    }
}

/// The bits of a row from its other end.
#[inline(always)]
fn turn(bits: u64, side: usize) -> u64 {
    bits.reverse_bits() >> (64 - side)
}

impl Default for Way {
    fn default() -> Way {
        let beside = [0; DEPTH as usize + 1];
        Way { depth: 0, cut: [0; ROWS], drawn: [0; ROWS], before: beside, after: beside }
    }
}

impl Way {
    /// A page between its neighbours to the south, east, north and west, to be walked north- and eastward, or, if `turned`, south- and westward.
    pub fn load(&mut self, page: &Page, beyond: &[Beyond; 4], turned: bool) {
        load(self, page, beyond, turned);
    }

    fn cut(&self, level: u8, y: i64) -> u64 {
        self.cut[index(level, y)]
    }

    fn drawn(&self, level: u8, y: i64) -> u64 {
        self.drawn[index(level, y)]
    }

    /// What is drawn a column before and a column after the cells of a row.
    #[inline(always)]
    fn beside(&self, level: u8, y: i64) -> [u64; 2] {
        let (row, slot) = (self.drawn(level, y), usize::from(level));
        let [before, after] = [self.before[slot], self.after[slot]].map(|bits| bits >> y & 1);
        [row << 1 | before, row >> 1 | after << ((1 << level) - 1)]
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

/// Points that are worth being raised together.
const ENOUGH: usize = 4096;

/// What walks over pages leave behind.
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
        let (points, ends) = (vec![[0; 2]; ENOUGH + POINTS], vec![0; ENOUGH + ENDS]);
        Trail { points, length: 0, ends, strips: 0, slivers: Vec::new(), begun: 0, pen: NONE }
    }
}

impl Trail {
    pub fn clear(&mut self) {
        (self.length, self.strips, self.begun, self.pen) = (0, 0, 0, NONE);
        self.slivers.clear();
    }

    /// Whether this is enough to be raised: if not there is room for another page.
    pub fn is_enough(&self) -> bool {
        self.length >= ENOUGH || !self.slivers.is_empty()
    }

    /// The vertices of all strips, and where each ends.
    pub fn strips(&self) -> (&[Point], &[u32]) {
        (&self.points[..self.length], &self.ends[..self.strips])
    }

    /// The upright triangles.
    pub fn slivers(&self) -> &[[Point; 3]] {
        &self.slivers
    }

    /// Ends the last strip.
    fn lift(&mut self) {
        self.end(true);
        self.pen = NONE;
    }

    /// Goes on from a pair, with a new strip unless it is the last one.
    #[inline(always)]
    fn go_on(&mut self, pair: Pair) {
        let new = bytemuck::cast::<Pair, u128>(self.pen) != bytemuck::cast::<Pair, u128>(pair);
        self.end(new);
        self.points[self.length..][..2].copy_from_slice(&pair);
        self.length += 2 * usize::from(new);
    }

    /// Ends the strip, if it is to end and there is one; without a branch, since which it is could not be foreseen.
    #[inline(always)]
    fn end(&mut self, ends: bool) {
        let some = ends & (self.length > self.begun);
        self.ends[self.strips] = self.length as u32;
        self.strips += usize::from(some);
        self.begun = if some { self.length } else { self.begun };
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

/// How runs of cells are put into points.
trait Hand {
    /// Walks along a row: see [`Walk::along`].
    fn row(walk: &mut Walk, level: u8, y: u32, from: u32, to: u32);

    /// Writes the pairs of a run of cells (see [`Walk::cells`]) and something after them.
    fn write(points: &mut [Point], run: &Run);

    /// [`double`].
    fn double(bits: u64) -> u64;
}

/// A run of cells: how many, where the first begins, their rows and sides, and bits for those below two finer and those below a coarser one.
struct Run {
    cells: u32,
    west: u32,
    width: u32,
    above: u32,
    below: u32,
    finer: u64,
    over: u64,
}

/// Four cells at a time.
struct Plain;

impl Hand for Plain {
    fn row(walk: &mut Walk, level: u8, y: u32, from: u32, to: u32) {
        walk.along::<Plain>(level, y, from, to);
    }

    fn write(points: &mut [Point], run: &Run) {
        let &Run { cells, mut west, width, above, below, finer, over } = run;
        let half = (width as i32 / 2) as u32;
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
    }

    fn double(bits: u64) -> u64 {
        double(bits)
    }
}

/// Several cells at once, without branches that could not be foreseen.
#[cfg(target_arch = "x86_64")]
struct Wide;

#[cfg(target_arch = "x86_64")]
impl Hand for Wide {
    #[inline(always)]
    fn row(walk: &mut Walk, level: u8, y: u32, from: u32, to: u32) {
        // SAFETY: only who has asked the processor for these features walks with this hand.
        unsafe { wide_row(walk, level, y, from, to) }
    }

    #[inline(always)]
    fn write(points: &mut [Point], run: &Run) {
        // SAFETY: as above.
        unsafe { wide_write(points, run) }
    }

    #[inline(always)]
    fn double(bits: u64) -> u64 {
        // SAFETY: as above.
        unsafe { wide_double(bits) }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,bmi1,bmi2,lzcnt,popcnt")]
#[inline]
fn wide_double(bits: u64) -> u64 {
    3 * std::arch::x86_64::_pdep_u64(bits, EVEN)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,bmi1,bmi2,lzcnt,popcnt")]
fn wide_row(walk: &mut Walk, level: u8, y: u32, from: u32, to: u32) {
    walk.along::<Wide>(level, y, from, to);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,bmi1,bmi2,lzcnt,popcnt")]
#[inline]
fn wide_write(points: &mut [Point], run: &Run) {
    use std::arch::x86_64::*;
    let &Run { cells, west, width, above, below, finer, over } = run;
    let (w, half, two) = (width as i32, width as i32 / 2, (width as i32).wrapping_mul(2));
    // Two pairs for each of two cells: sides and halves of sides that their points are ahead, and which are above and below.
    let sides = _mm512_setr_epi32(1, 0, 0, 0, 1, 0, 1, 0, 2, 0, 1, 0, 2, 0, 2, 0);
    let halves = _mm512_setr_epi32(0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0);
    let ahead = _mm512_mullo_epi32(_mm512_set1_epi32(w), sides);
    let ahead = _mm512_add_epi32(ahead, _mm512_mullo_epi32(_mm512_set1_epi32(half), halves));
    let pairs = _mm512_mask_set1_epi32(_mm512_set1_epi32(west as i32), 0x2222, below as i32);
    let mut pairs = _mm512_add_epi32(_mm512_mask_set1_epi32(pairs, 0x8888, above as i32), ahead);
    let (width, step) = (_mm512_set1_epi32(w), _mm512_maskz_set1_epi32(0x5555, two));
    // Mostly there are four cells or fewer: so many are written whether they are there or not.
    let (mut length, mut x) = (0, 0);
    while x < 4 || x < cells {
        let (finer, over) = (finer >> x & 3, over >> x & 3);
        // Both pairs of a cell below finer ones, the second of others; ahead by two cells below a coarser one.
        let said = 0xcc | (3 * _pdep_u64(finer, 0x11) as u8);
        let ahead = _mm512_mask_add_epi32(pairs, _pdep_u64(over, 0x4040) as u16, pairs, width);
        let Some(points) = points[length..].first_chunk_mut::<8>() else { return };
        // SAFETY: as above.
        unsafe { _mm512_storeu_si512(points.as_mut_ptr().cast(), _mm512_maskz_compress_epi64(said, ahead)) };
        length += 4 + 2 * finer.count_ones() as usize;
        pairs = _mm512_add_epi32(pairs, step);
        x += 2;
    }
}

/// Whether the processor has what [`Wide`] needs.
#[cfg(target_arch = "x86_64")]
fn is_wide() -> bool {
    std::arch::is_x86_feature_detected!("avx512f")
        && std::arch::is_x86_feature_detected!("bmi1")
        && std::arch::is_x86_feature_detected!("bmi2")
        && std::arch::is_x86_feature_detected!("lzcnt")
        && std::arch::is_x86_feature_detected!("popcnt")
}

impl Walk<'_> {
    /// Walks over the page.
    pub fn run(&mut self) {
        #[cfg(target_arch = "x86_64")]
        if is_wide() {
            return self.with::<Wide>();
        }
        self.with::<Plain>();
    }

    fn with<H: Hand>(&mut self) {
        H::row(self, 0, 0, 0, 1);
        self.trail.lift();
    }

    /// Walks along row `y` of a level, from column `from` to before column `to`; all cells there exist.
    #[inline(always)]
    fn along<H: Hand>(&mut self, level: u8, y: u32, from: u32, to: u32) {
        let cut = self.way.cut(level, y.into());
        let row = self.sides::<H>(level, y, from..to);
        let run = |bits: u64, x: u32| bits.unbounded_shr(x).trailing_ones().min(to - x);
        let mut x = from;
        while x < to {
            let drawn = run(row.drawn, x);
            if drawn > 0 {
                self.cells::<H>(x, x + drawn, &row);
                x += drawn;
            }
            let finer = run(cut, x);
            if finer > 0 {
                // (d): the upper row goes on, the lower begins, and goes on after (e). Those of the last level are pages.
                if level < self.way.depth {
                    H::row(self, level + 1, 2 * y, 2 * x, 2 * (x + finer));
                    H::row(self, level + 1, 2 * y + 1, 2 * x, 2 * (x + finer));
                }
                x += finer;
            }
            x += run(!(row.drawn | cut), x);
        }
    }

    /// A row's sides and neighbours. Where only half of a coarser cell's side has a surface an upright triangle closes the gap.
    #[inline(always)]
    fn sides<H: Hand>(&mut self, level: u8, y: u32, part: Range<u32>) -> Row {
        let width = (self.side as i32 >> level) as u32;
        let above = self.corner[1].wrapping_add(y.wrapping_mul(width));
        let y = i64::from(y);
        let (drawn, finer, upper) = (self.way.drawn(level, y), self.way.cut(level, y - 1), y & 1 == 0);
        let mut row =
            Row { width, above, below: above.wrapping_add(width), upper, drawn, before: 0, after: 0, over: 0, finer };
        if level == 0 {
            return row;
        }
        let [before, after] = self.way.beside(level - 1, y >> 1);
        let (before, after) = (drawn & H::double(before) & EVEN, drawn & H::double(after) & !EVEN);
        let over = if upper { drawn & H::double(self.way.drawn(level - 1, (y >> 1) - 1)) } else { 0 };
        // A side leaves out its middle if both of its cells are drawn.
        let column = self.way.drawn(level, y ^ 1);
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
    #[inline(always)]
    fn cells<H: Hand>(&mut self, from: u32, to: u32, row: &Row) {
        let &Row { width, above, below, upper, .. } = row;
        let trail = &mut *self.trail;
        let west = self.corner[0].wrapping_add(from.wrapping_mul(width));
        // After a coarser cell the upper strip begins with all of its side, the lower at its corner.
        let is = |bit: u64| (bit as u32 & 1).wrapping_neg();
        let [upper, before] = [is(upper.into()), is(row.before >> from)];
        let first =
            [[west, below.wrapping_add(width & before & upper)], [west, above.wrapping_add(width & before & !upper)]];
        trail.go_on(first);
        // (b): above finer cells the upper vertex advances by halves; (c): below a coarser one by both cells at once; else (a).
        let cells = to - from;
        let all = u64::MAX >> (64 - cells);
        let (finer, over) = (row.finer >> from & all, (row.over & EVEN) >> from & all);
        let points = &mut trail.points[trail.length..];
        H::write(points, &Run { cells, west, width, above, below, finer, over });
        let length = 2 * (cells + finer.count_ones()) as usize;
        let west = self.corner[0].wrapping_add(to.wrapping_mul(width));
        trail.length += length;
        // (e): the upper strip ends at the coarser cell's corner, unless it is there already; the lower goes on with its side.
        let [after, finer, over] = [row.after, row.finer, row.over].map(|bits| is(bits >> (to - 1)));
        let said = trail.length;
        let points = &mut trail.points[said - 4..said];
        let (lower, upper) = (after & !upper, after & upper);
        let last = [west, above.wrapping_sub(width & lower)];
        points[0][0] = points[0][0].wrapping_sub(width & upper & finer);
        points[2..].copy_from_slice(&[[west.wrapping_sub(width & upper), below], last]);
        trail.pen = if upper != 0 { NONE } else { [[west, below], last] };
        trail.length -= (2 & upper & over) as usize;
        trail.end(upper != 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Cell;

    /// Several cells at once come out as single ones do.
    #[test]
    #[cfg(target_arch = "x86_64")]
    fn strips_are_alike_on_all_processors() {
        if !is_wide() {
            println!("this processor has no AVX-512: not tested");
            return;
        }
        let mut state = 3u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            state ^ state >> 29
        };
        let (mut strips, mut slivers) = (0, 0);
        for round in 0..60 {
            // What is cut need not be balanced, nor drawn be whole.
            let level = if round % 3 == 0 { 24 } else { 5 };
            let mut page = Page::of(Cell { level, x: 2, y: 1, face: 0 }, DEPTH);
            for level in 1..=DEPTH {
                for y in 0..1u32 << level {
                    let cells = double(page.cut[row(level - 1, y >> 1)]);
                    let cut = if level < DEPTH { cells & (random() | random()) } else { 0 };
                    page.mark(level, y, cut);
                    page.drawn[row(level, y)] =
                        cells & !cut & if round % 2 == 0 { u64::MAX } else { random() | random() };
                }
            }
            let beyond =
                [(); 4].map(|()| Beyond { page: (random() & 1 == 0).then_some(&page), cell: random() & 1 == 0 });
            let turned = round % 4 > 1;
            let mut way = Way::default();
            way.load(&page, &beyond, turned);
            let walked = |wide: bool| {
                let mut trail = Trail::default();
                let side = (super::super::super::drawing::STEPS >> level) as i32 * if turned { -1 } else { 1 };
                let mut walk = Walk { way: &way, trail: &mut trail, corner: [1 << 29, 1 << 28], side: side as u32 };
                if wide {
                    walk.with::<Wide>()
                } else {
                    walk.with::<Plain>()
                }
                let (points, ends) = trail.strips();
                (points.to_vec(), ends.to_vec(), trail.slivers().to_vec())
            };
            let wide = walked(true);
            assert!(wide == walked(false), "round {round}");
            (strips, slivers) = (strips + wide.1.len(), slivers + wide.2.len());
        }
        assert!(strips > 10_000 && slivers > 1000, "{strips} strips, {slivers} upright triangles");
    }
}
