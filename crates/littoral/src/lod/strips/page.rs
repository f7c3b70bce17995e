//! Pages: which cells of a square of the quadtree are cut and which are drawn, a bit for each.
//!
//! Rows of bits let the whole of a row be asked, grown by a cell or halved at once. What is cut follows from the bounds of the cells (measured a
//! row at a time, in lanes) and from the neighbours, which may be one level coarser and no more. Where a page is whole, of its cells only the errors are
//! asked for; where it also lies within the frame, all of them are seen. The bounds of cells that cannot be cut change nothing but what is
//! told: their parents' say what they cannot exceed, and most are never asked for.

use super::super::ScreenMetric;
use super::stage::{Judged, Lens, Rows, Stage, judge, look_near, see};
use crate::field::{HeightField, HeightRange};
use crate::space::{Cell, Datum};
use glam::DVec2;
use multiversion::multiversion;
use std::ops::Range;

/// The number of no page.
pub(super) const UNKNOWN: u32 = u32::MAX;

/// Levels within a page, and its cells along a side.
pub(super) const DEPTH: u8 = 6;
pub(super) const SIDE: usize = 1 << DEPTH;

/// Rows of all levels, the page itself being level 0.
const ROWS: usize = 2 * SIDE - 1;

/// The row of bits of a level.
pub(super) fn row(level: u8, y: u32) -> usize {
    (1usize << level) - 1 + y as usize
}

/// A square of the quadtree that is cut, and what becomes of its parts.
#[repr(C)]
#[derive(Clone, Debug)]
pub(super) struct Page {
    /// The square.
    pub cell: Cell,
    /// Levels below it that belong to the page.
    pub depth: u8,
    /// The last level of which anything is cut.
    pub last: u8,
    /// Pages beside it to the south, east, north and west, once they were looked for.
    pub beside: [u32; 4],
    /// What is cut; those of the last level are pages of their own.
    pub cut: [u64; ROWS],
    /// What is drawn: while the page is measured, what is whole and may be seen.
    pub drawn: [u64; ROWS],
    /// How it lies before the eye, once it was asked for.
    stage: Option<Stage>,
    /// What the bounds (pixels) of its cells that cannot be cut do not exceed, if they were not asked for.
    pub doubt: f32,
}

/// What a view asks of cells.
pub(super) struct Asked<'a> {
    pub field: &'a dyn HeightField,
    pub metric: &'a ScreenMetric,
    /// How far off (pixels) a cell may be drawn.
    pub tolerance: f32,
    /// The level that is not cut.
    pub finest: u8,
    /// Sides of the face (m), and where the eye stands as a share of them.
    pub size: DVec2,
    pub eye: DVec2,
}

impl<'a> Asked<'a> {
    pub fn new(field: &'a dyn HeightField, metric: &'a ScreenMetric, tolerance: f32, finest: u8) -> Asked<'a> {
        let (origin, size) = match field.datum() {
            Datum::Plane { origin, size } => (origin, size),
            Datum::Ellipsoid { .. } => (DVec2::ZERO, DVec2::ONE),
        };
        Asked { field, metric, tolerance, finest, size, eye: (metric.eye().truncate() - origin) / size }
    }
}

/// Bits of the cells in a row, one for two: set where either is.
#[inline(always)]
pub(super) fn halve(bits: u64) -> u64 {
    let mut x = (bits | bits >> 1) & 0x5555_5555_5555_5555;
    x = (x | x >> 1) & 0x3333_3333_3333_3333;
    x = (x | x >> 2) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | x >> 4) & 0x00ff_00ff_00ff_00ff;
    x = (x | x >> 8) & 0x0000_ffff_0000_ffff;
    (x | x >> 16) & 0xffff_ffff
}

/// Bits of the cells in a row, two for one. The upper half of `bits` is lost.
#[inline(always)]
pub(super) fn double(bits: u64) -> u64 {
    let mut x = bits & 0xffff_ffff;
    x = (x | x << 16) & 0x0000_ffff_0000_ffff;
    x = (x | x << 8) & 0x00ff_00ff_00ff_00ff;
    x = (x | x << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | x << 2) & 0x3333_3333_3333_3333;
    x = (x | x << 1) & 0x5555_5555_5555_5555;
    x | x << 1
}

/// The quarters of cells that are cut, two rows for one.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn quarter(cut: &[u64], quarters: &mut [u64]) {
    for (&cut, quarters) in cut.iter().zip(quarters.as_chunks_mut::<2>().0) {
        *quarters = [double(cut); 2];
    }
}

/// How many bits are set in one and not in the other.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512vpopcntdq", "x86_64+popcnt"))]
fn count(drawn: &[u64], cut: &[u64]) -> usize {
    drawn.iter().zip(cut).map(|(drawn, cut)| (drawn & !cut).count_ones() as usize).sum()
}

impl Page {
    /// A page of which only the square itself is cut.
    pub fn of(cell: Cell, depth: u8) -> Page {
        let (rows, beside) = ([0; ROWS], [UNKNOWN; 4]);
        let mut page = Page { cell, depth, last: 0, cut: rows, drawn: rows, stage: None, beside, doubt: 0.0 };
        page.cut[0] = 1;
        page
    }

    /// Becomes [`Page::of`] another cell.
    pub fn turn(&mut self, cell: Cell, depth: u8) {
        let rows = self.rows();
        self.cut[rows.clone()].fill(0);
        self.drawn[rows].fill(0);
        self.cut[0] = 1;
        (self.cell, self.depth, self.last, self.stage, self.doubt) = (cell, depth, 0, None, 0.0);
        self.beside = [UNKNOWN; 4];
    }

    /// The deepest level there are cells of.
    pub fn deepest(&self) -> u8 {
        self.depth.min(self.last + 1)
    }

    /// The rows of the levels there are cells of.
    fn rows(&self) -> Range<usize> {
        0..row(self.deepest() + 1, 0)
    }

    /// Cuts cells of a level's row, a bit for each.
    pub fn mark(&mut self, level: u8, y: u32, bits: u64) {
        self.cut[row(level, y)] |= bits;
        self.last = if bits != 0 { self.last.max(level) } else { self.last };
    }

    /// The level's cells that exist: the quarters of those that are cut a level above.
    fn quarters(&self, level: u8, y: u32) -> u64 {
        double(self.cut[row(level - 1, y >> 1)])
    }

    /// Cuts what the bounds ask for; the greatest bound (pixels) of what is left whole, but for what is in doubt.
    pub fn refine(&mut self, asked: &Asked, rows: &mut Rows) -> f32 {
        let (mut worst, mut most) = (0.0f32, 0.0);
        for level in 1..=self.depth {
            if level > self.deepest() {
                break;
            }
            self.quarter(level, rows);
            let wanted = if self.cell.level + level < asked.finest {
                Wanted::Cuts
            } else if level > 1 && self.stage(asked).whole {
                // Bounds are nested: half of their parents' without what coarser neighbours may add.
                self.doubt = (most / SEAMS + asked.tolerance / SEAMS) * (1.0 + 1e-4);
                Wanted::Sight
            } else {
                Wanted::Bounds
            };
            let judged = self.measure(asked, rows, level, wanted);
            (worst, most) = (judged.worst.max(worst), judged.most);
        }
        worst
    }

    /// The greatest bound (pixels) of what was in doubt.
    pub fn resolve(&mut self, asked: &Asked, rows: &mut Rows) -> f32 {
        self.quarter(self.depth, rows);
        self.measure(asked, rows, self.depth, Wanted::Bounds).worst
    }

    fn quarter(&self, level: u8, rows: &mut Rows) {
        let side = 1usize << level;
        quarter(&self.cut[row(level - 1, 0)..][..side / 2], &mut rows.cells[..side]);
    }

    /// Says what is drawn, after neighbours cut what they had to.
    pub fn settle(&mut self, asked: &Asked, rows: &mut Rows) {
        if self.stage(asked).is_all_seen() {
            for level in 1..=self.deepest() {
                let side = 1usize << level;
                let at = row(level, 0);
                let (before, cut) = self.cut.split_at(at);
                quarter(&before[at - side / 2..], &mut self.drawn[at..at + side]);
                self.drawn[at..at + side].iter_mut().zip(cut).for_each(|(drawn, cut)| *drawn &= !cut);
            }
            return;
        }
        for level in 1..=self.deepest() {
            for y in 0..1u32 << level {
                // What was measured and is not seen is measured again: that is little.
                let at = row(level, y);
                rows.cells[y as usize] = self.quarters(level, y) & !self.cut[at] & !self.drawn[at];
            }
            self.measure(asked, rows, level, Wanted::Sight);
        }
        let rows = self.rows();
        self.drawn[rows.clone()].iter_mut().zip(&self.cut[rows]).for_each(|(drawn, cut)| *drawn &= !cut);
    }

    /// How many cells are drawn.
    pub fn count(&self) -> usize {
        let rows = self.rows();
        count(&self.drawn[rows.clone()], &self.cut[rows])
    }

    /// How many of its cells are pages.
    pub fn below(&self) -> usize {
        if self.last < self.depth {
            return 0;
        }
        self.cut[row(self.depth, 0)..].iter().take(1 << self.depth).map(|bits| bits.count_ones() as usize).sum()
    }

    /// Measures the cells of a level: notes which are whole and may be seen, and, if cuts are wanted, cuts those with bounds above the
    /// tolerance.
    fn measure(&mut self, asked: &Asked, rows: &mut Rows, level: u8, wanted: Wanted) -> Judged {
        let side = 1usize << level;
        let stage = self.stage(asked);
        rows.whole[..side].fill(u64::MAX);
        if !stage.whole {
            rows.room(level);
        } else if wanted != Wanted::Sight {
            rows.ask(asked, self.at(level, 0, 0), level);
        }
        for y in 0..if stage.whole { 0 } else { side } {
            let bits = rows.cells[y];
            if bits == 0 {
                continue;
            }
            let columns = bits.trailing_zeros() as usize..64 - bits.leading_zeros() as usize;
            let first = self.at(level, columns.start as u32, y as u32);
            let errors = rows.errors(columns.clone(), y);
            let mut ranges = [HeightRange::EMPTY; SIDE];
            asked.field.row(first, &mut ranges[..columns.len()], errors);
            let bit = |on: bool, i: usize| u64::from(on) << i;
            let whole = columns.clone().zip(&*errors).fold(0, |bits, (i, error)| bits | bit(error.is_finite(), i));
            rows.whole[y] = whole;
            rows.cells[y] &= columns.zip(ranges).fold(0, |bits, (i, range)| bits | bit(!range.is_empty(), i));
        }
        let lens = Lens::new(asked, self.at(level, 0, 0), level, wanted == Wanted::Cuts);
        if stage.inside {
            rows.seen.fill(u64::MAX);
        } else {
            see(&lens, &stage, rows);
        }
        let mut judged = if stage.near {
            look_near(asked, &lens, &stage, self.at(level, 0, 0), wanted != Wanted::Sight, rows)
        } else if wanted == Wanted::Sight {
            rows.above.fill(0);
            Judged::default()
        } else {
            judge(&lens, &stage, rows)
        };
        for y in 0..side {
            let seen = rows.cells[y] & rows.seen[y];
            let mut above = seen & rows.above[y];
            // What is partly void is no farther off than it is large.
            let mut left = if wanted == Wanted::Sight { 0 } else { seen & !rows.whole[y] };
            while left != 0 {
                let x = left.trailing_zeros();
                left &= left - 1;
                let cell = self.at(level, x, y as u32);
                let pixels = SEAMS * asked.metric.pixels_across(&asked.metric.bounds(cell, asked.field.range(cell)));
                if wanted == Wanted::Cuts && pixels > asked.tolerance {
                    above |= 1 << x;
                } else {
                    above &= !(1 << x);
                    judged.worst = judged.worst.max(pixels);
                }
            }
            self.drawn[row(level, y as u32)] |= seen & rows.whole[y];
            self.mark(level, y as u32, above);
        }
        judged
    }

    /// How it lies before the eye.
    fn stage(&mut self, asked: &Asked) -> Stage {
        *self.stage.get_or_insert_with(|| Stage::new(asked, self.cell, self.depth))
    }

    fn at(&self, level: u8, x: u32, y: u32) -> Cell {
        let (west, south) = (self.cell.x << level, self.cell.y << level);
        Cell { level: self.cell.level + level, x: west + x, y: south + y, ..self.cell }
    }
}

/// Where a side leaves out a vertex, that is off by no more than the coarser cell: twice a cell's own bound holds for it and its seams.
pub(super) const SEAMS: f32 = 2.0;

/// What is wanted of cells: what is seen, also their bounds, also to have them cut.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    Sight,
    Bounds,
    Cuts,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Land, Raster};
    use crate::space::View;
    use glam::{DVec2, DVec3, UVec2};

    #[test]
    fn bits_are_halved_and_doubled() {
        for bits in [0u64, 1, 0b1010_0100, u64::MAX, 0x8000_0000_0000_0001] {
            for i in 0..32 {
                assert_eq!(halve(bits) >> i & 1 == 1, bits >> (2 * i) & 3 != 0);
                assert_eq!(double(bits) >> (2 * i) & 3, 3 * (bits >> i & 1));
            }
        }
    }

    /// What is seen is seen by the page, what is off is cut, and the bound that is told holds for what is left.
    #[test]
    fn pages_are_measured_as_single_cells_are() {
        let heights = (0..129 * 129).map(|i| ((i * 7919) % 101) as f32 * 0.1).collect();
        let bumps = Land::new(Raster::new(129, 129, DVec2::new(3.0, 5.0), heights).expect("valid"));
        // The eye is lower than many of the hills about it.
        let hill = |i: usize| 400.0 + 150.0 * ((i % 129) as f32 * 0.105).sin() * ((i / 129) as f32 * 0.085).cos();
        let hills = Raster::new(129, 129, DVec2::splat(15.0), (0..129 * 129).map(hill).collect()).expect("valid");
        let hills = Land::new(hills);
        let (mut cut, mut left) = (0, 0);
        for (land, eye, tolerance) in [
            (&bumps, (-40.0, 60.0, 130.0), 30.0),
            (&bumps, (-900.0, 90.0, 20.0), 4.0),
            (&bumps, (-250.0, 60.0, 20.0), 60.0),
            (&bumps, (0.0, 0.0, 60.0), 90.0),
            (&bumps, (0.0, 0.0, 400.0), 0.5),
            (&hills, (500.0, 744.0, 480.0), 2.0),
            (&hills, (1200.0, 300.0, 500.0), 0.5),
        ] {
            let middle = land.origin() + 0.5 * land.extent();
            let eye = DVec3::from(eye);
            let view = View::looking_at(eye, middle.extend(2.0), 0.8, UVec2::new(320, 200));
            let metric = ScreenMetric::new(&view, land.datum()).expect("a view");
            for (cell, depth, finest) in [(Cell::face(0), 6, 7), (Cell { level: 1, x: 1, y: 0, face: 0 }, 6, 7)] {
                let asked = Asked::new(land, &metric, tolerance, finest);
                let mut rows = Rows::default();
                let mut page = Page::of(cell, depth);
                let worst = page.refine(&asked, &mut rows);
                let told = if page.doubt > worst { page.resolve(&asked, &mut rows).max(worst) } else { worst };
                let mut most = 0.0f32;
                for (level, y) in (1..=page.deepest()).flat_map(|level| (0..1 << level).map(move |y| (level, y))) {
                    for x in (0..1u32 << level).filter(|x| page.quarters(level, y) >> x & 1 == 1) {
                        let cell = page.at(level, x, y);
                        let error = land.error(cell);
                        let Some((_, pixels)) = metric.cell(land, cell, error) else { continue };
                        let is = |bits: &[u64; ROWS]| bits[row(level, y)] >> x & 1 == 1;
                        assert!(is(&page.drawn), "{cell:?} is seen");
                        if cell.level < finest && SEAMS * pixels > tolerance * (1.0 + 1e-4) {
                            assert!(is(&page.cut), "{cell:?} is {pixels} pixels off");
                        }
                        // Finer cells beside it leave out vertices of its sides.
                        let beside = [(-1i64, 0), (2, 1), (0, -1), (1, 2)].map(|(i, j)| {
                            let at = |from: u32, by: i64| (2 * i64::from(from) + by) as u32;
                            Cell { level: cell.level + 1, x: at(cell.x, i), y: at(cell.y, j), ..cell }
                        });
                        for fine in beside.into_iter().filter(|c| c.x >> c.level == 0 && c.y >> c.level == 0) {
                            let off = metric.cell(land, fine, error).map_or(0.0, |(_, pixels)| SEAMS * pixels);
                            let may = is(&page.cut) || cell.level == finest || off <= tolerance * (1.0 + 1e-4);
                            assert!(may, "{cell:?} is {off} pixels off at a finer neighbour");
                        }
                        if is(&page.cut) {
                            cut += 1;
                        } else {
                            let seams = if cell.level < finest { pixels } else { 0.5 * tolerance };
                            most = most.max(pixels + seams);
                            left += 1;
                        }
                    }
                }
                // Never less; and not much more, though heights are those of blocks.
                assert!(told >= most * (1.0 - 1e-4), "{told} told, {most} pixels off");
                assert!(told <= most * 2.0, "{told} told, {most} pixels off");
            }
        }
        assert!(cut > 1000 && left > 1000, "{cut} cut, {left} left");
    }
}
