//! What the bintree's priorities rest on, prepared: for every diamond how far its triangles are off, and how low and high they reach.
//!
//! Both are *nested*: a diamond's numbers hold for all diamonds that need it, through any chain of parents, too. So no priority computed from them
//! grows when a triangle is split, and the diamonds above any priority are a mesh without forced splits. What needs a diamond lies within one
//! cell's side of the middle: for the middle of a cell of side s, s/2 of its own, then s/2 + s/4 + … of ever smaller cells beyond its sides.
//!
//! Deviations are measured at every sample of every triangle. Over the patches that a triangle holds whole the bilinear surface is farthest from
//! it at a sample; those that its diagonal base cuts bulge by a quarter of their twist, which is added. Legs are bases of smaller triangles.

use super::diamond::{Base, Diamond, Point, STEPS};
use super::factors::{Factors, Slopes};
use super::scan::{Item, Lens, Priority, SPLIT};
use crate::field::{HeightField, Land};
use crate::lod::ScreenMetric;
use crate::memory::{filled, in_large_pages};
use crate::space::{Cell, Datum};
use multiversion::multiversion;
use rayon::prelude::*;

/// Deviation and extent of a diamond, nested; and what its own triangles cover.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bound {
    /// The deviation's bits, rounded up to a multiple of sixteen, and four marks: whether the triangles are whole, and whether they are void.
    bits: u32,
    /// Lowest and highest height of the surface (steps); low > high where there is none.
    pub low: u16,
    pub high: u16,
}

impl Bound {
    const EMPTY: Bound = Bound { bits: 0b1100, low: u16::MAX, high: 0 };

    /// Of a diamond that is whole, and all else of which is known from its level.
    pub(super) const WATER: Bound = Bound { bits: 0b0011, low: 0, high: 0 };

    pub(super) fn new(deviation: f32, low: u16, high: u16, cover: [Cover; 2]) -> Bound {
        let mark = |side: usize| match cover[side] {
            Cover::Whole => 1 << side,
            Cover::Void => 4 << side,
            Cover::Partial => 0,
        };
        Bound { bits: ((deviation.to_bits() + 15) & !15) | mark(0) | mark(1), low, high }
    }

    /// Greatest vertical distance to the surface (m); infinite where partly void.
    #[inline]
    pub(super) fn deviation(self) -> f32 {
        f32::from_bits(self.bits & !15)
    }

    /// Lowest and highest height in one number, the lowest in the lower half.
    #[inline]
    pub(super) fn heights(self) -> u32 {
        u32::from(self.low) | u32::from(self.high) << 16
    }

    /// Whether there is surface under all of a triangle.
    #[inline]
    pub(super) fn whole(self, side: usize) -> bool {
        self.bits >> side & 1 == 1
    }

    fn cover(self, side: usize) -> Cover {
        match (self.bits >> side & 1, self.bits >> side & 4) {
            (1, _) => Cover::Whole,
            (_, 4) => Cover::Void,
            _ => Cover::Partial,
        }
    }
}

/// How much of a triangle there is surface under.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cover {
    Whole,
    Partial,
    Void,
}

/// Nested bounds of every diamond over land: eight bytes a sample, and the heights' own four.
#[derive(Clone, Debug)]
pub struct NestedBounds {
    datum: Datum,
    finest: u8,
    /// Height of step 0 and of one step (m).
    pub(super) base: f32,
    pub(super) step: f32,
    /// Samples a side: 2ᵏ + 1.
    side: usize,
    /// Samples of the land, eastward and northward.
    samples: [u32; 2],
    /// Heights (m), row by row; NaN where void.
    heights: Vec<f32>,
    voids: bool,
    levels: Vec<Level>,
    /// As `levels`, if asked for.
    slopes: Vec<Level<Slopes>>,
}

/// The diamonds of the cells of one level and of their sides.
#[derive(Clone, Debug)]
struct Level<T = Bound> {
    /// By [`Kind`], all in tiles: cells; cells a side × (cells a side + 1) sides that run east; (cells a side + 1) × cells a side that run north.
    kinds: [Vec<T>; 3],
}

impl<T> Default for Level<T> {
    fn default() -> Level<T> {
        Level { kinds: [const { Vec::new() }; 3] }
    }
}

impl<T: Copy + Send + Sync> Level<T> {
    /// Something of each side of the level's cells, asked for by its middle in halves of a cell.
    fn sides(level: u8, empty: T, of: &(dyn Fn(u32, u32) -> T + Sync)) -> Level<T> {
        let n = 1u32 << level;
        let east = tiled([n, n + 1], empty, &|[i, j]| of(2 * i + 1, 2 * j));
        let north = tiled([n + 1, n], empty, &|[i, j]| of(2 * i, 2 * j + 1));
        Level { kinds: [Vec::new(), east, north] }
    }

    /// The same of each cell.
    fn squares(level: u8, empty: T, of: &(dyn Fn(u32, u32) -> T + Sync)) -> Vec<T> {
        tiled([1 << level; 2], empty, &|[i, j]| of(2 * i + 1, 2 * j + 1))
    }
}

/// Something of each place of a grid, in parallel. Neighbours in both directions lie together: 4 × 2 in a line of memory, if of eight bytes, and
/// 32 × 16 in a page.
fn tiled<T: Copy + Send + Sync>(size: [u32; 2], empty: T, of: &(dyn Fn([u32; 2]) -> T + Sync)) -> Vec<T> {
    let pages = [size[0].div_ceil(32), size[1].div_ceil(16)];
    let one = |at: u32| {
        let (page, tile) = (at >> 9, at >> 3 & 63);
        let i = (page % pages[0]) << 5 | (tile & 7) << 2 | at & 3;
        let j = (page / pages[0]) << 4 | (tile >> 3) << 1 | at >> 2 & 1;
        if i < size[0] && j < size[1] { of([i, j]) } else { empty }
    };
    let places = pages[0] * pages[1] * 512;
    let mut all = in_large_pages(Vec::with_capacity(places as usize));
    (0..places).into_par_iter().with_min_len(64).map(one).collect_into_vec(&mut all);
    all
}

/// Where the place (i, j) of a grid of so many columns is kept.
#[inline]
fn tile(i: u32, j: u32, columns: u32) -> usize {
    let page = (j >> 4) * columns.div_ceil(32) + (i >> 5);
    (page << 9 | (j >> 1 & 7) << 6 | (i >> 2 & 7) << 3 | (j & 1) << 2 | i & 3) as usize
}

impl<T> Level<T> {
    /// What is kept of a diamond of cells of this level.
    #[inline(always)]
    fn slot(&self, diamond: Diamond, level: u8) -> &T {
        let n = 1u32 << level;
        let [i, j] = [0, 1].map(|i| diamond.at[i] >> (Cell::MAX_LEVEL - level));
        let kind = Kind::of(diamond.base);
        &self.kinds[kind][tile(i, j, n + u32::from(kind == Kind::North as usize))]
    }
}

/// Which diamonds of a level of cells: those over diagonals, sides that run east, and sides that run north.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Square,
    East,
    North,
}

impl Kind {
    pub(super) const ALL: [Kind; 3] = [Kind::Square, Kind::East, Kind::North];

    /// The number of the kind of the diamonds with a base.
    #[inline(always)]
    fn of(base: Base) -> usize {
        (base as usize).saturating_sub(1)
    }
}

/// The bounds of all diamonds of one level and kind.
pub(super) struct Table<'a> {
    pub bounds: &'a [Bound],
    columns: u32,
    /// Binary logarithm of a cell's side (steps).
    unit: u32,
}

impl Table<'_> {
    /// The bound of one, its middle in steps.
    pub(super) fn bound(&self, at: u32) -> Bound {
        self.bounds[tile((at & 0xffff) >> self.unit, (at >> 16) >> self.unit, self.columns)]
    }

    /// Puts where the bounds of many are into `slots`.
    pub(super) fn slots(&self, at: &[u32], slots: &mut Vec<u32>) {
        slots.clear();
        slots.resize(at.len(), 0);
        places(at, self.columns, self.unit, slots);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn places(at: &[u32], columns: u32, unit: u32, slots: &mut [u32]) {
    for (slot, at) in slots.iter_mut().zip(at) {
        *slot = tile((at & 0xffff) >> unit, (at >> 16) >> unit, columns) as u32;
    }
}

/// The land has more samples than a flight can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected land of at most {} samples a side, got {columns} × {rows}; load it coarser, or use ROAM from scratch",
    NestedBounds::MOST
)]
pub struct TooManySamples {
    /// Columns of the raster.
    pub columns: usize,
    /// Its rows.
    pub rows: usize,
}

impl NestedBounds {
    /// The most samples a side: a flight packs places into 16 bits each.
    pub const MOST: usize = (1 << 14) + 1;

    /// Measures `land`.
    ///
    /// # Errors
    /// If it has more than [`NestedBounds::MOST`] samples a side.
    pub fn of(land: &Land) -> Result<NestedBounds, TooManySamples> {
        let finest = land.finest_level();
        let (columns, rows) = (land.raster().columns(), land.raster().rows());
        if columns.max(rows) > NestedBounds::MOST {
            return Err(TooManySamples { columns, rows });
        }
        let side = (1usize << finest) + 1;
        let raster = land.raster();
        let mut heights = filled(f32::NAN, side * side);
        heights.par_chunks_mut(side).take(raster.rows()).enumerate().for_each(|(row, line)| {
            let own = &raster.heights()[row * raster.columns()..(row + 1) * raster.columns()];
            line[..own.len()].copy_from_slice(own);
            if raster.voids().any() {
                let voids = (0..own.len()).filter(|&column| raster.sample(column, row).is_none());
                voids.for_each(|column| line[column] = f32::NAN);
            }
        });
        let range = land.height_range();
        let (low, high) = if range.is_empty() { (0.0, 0.0) } else { (range.low, range.high) };
        let step = (high / 65_000.0 - low / 65_000.0).max(low.abs().max(high.abs()) * 1e-6).max(1e-30);
        let base = low - 2.0 * step;
        let voids = heights.iter().any(|height| height.is_nan());
        let levels = vec![Level::default(); usize::from(finest) + 1];
        let samples = [columns as u32, rows as u32];
        let (datum, slopes) = (land.datum(), Vec::new());
        let mut bounds = NestedBounds { datum, finest, base, step, side, samples, heights, voids, levels, slopes };
        for level in (0..finest).rev() {
            let half = Diamond::ROOT.half >> level;
            let of = |bounds: &NestedBounds, i, j| bounds.measure(land, Diamond::at([i * half, j * half]));
            let sides = Level::sides(level, Bound::EMPTY, &|i, j| of(&bounds, i, j));
            bounds.levels[usize::from(level)] = sides;
            let squares = Level::squares(level, Bound::EMPTY, &|i, j| of(&bounds, i, j));
            bounds.levels[usize::from(level)].kinds[Kind::Square as usize] = squares;
        }
        Ok(bounds)
    }

    /// Bytes of memory held, heights included.
    pub fn bytes(&self) -> usize {
        fn bytes<T>(levels: &[Level<T>]) -> usize {
            let count = |level: &Level<T>| level.kinds.iter().map(Vec::len).sum::<usize>();
            levels.iter().map(count).sum::<usize>() * size_of::<T>()
        }
        self.heights.len() * size_of::<f32>() + bytes(&self.levels) + bytes(&self.slopes)
    }

    /// What the heights are counted from.
    pub fn datum(&self) -> Datum {
        self.datum
    }

    /// The level of the samples.
    pub fn finest(&self) -> u8 {
        self.finest
    }

    /// Samples of the land, eastward and northward.
    pub fn samples(&self) -> [u32; 2] {
        self.samples
    }

    /// Height of step 0 and of one step (m), in which [`NestedBounds::packed`] counts.
    pub fn scale(&self) -> (f32, f32) {
        (self.base, self.step)
    }

    /// Height (m) of a sample, column and row from the south-west; NaN where void.
    ///
    /// # Panics
    /// If it is not one of the face's 2ᵏ + 1 a side.
    pub fn sample_height(&self, column: u32, row: u32) -> f32 {
        self.heights[row as usize * self.side + column as usize]
    }

    /// What is known of the diamond whose middle is a sample, as devices keep it: the bits of its deviation (m), rounded up to a multiple of sixteen, with two marks for which of its
    /// triangles have surface under all of them and two for which have none; and its lowest and highest height (steps), the lowest in the
    /// lower half, which is the greater of the two where there is none. The face's corners have no diamonds.
    ///
    /// # Panics
    /// If it is a corner, or not one of the face's 2ᵏ + 1 samples a side.
    pub fn packed(&self, column: u32, row: u32) -> [u32; 2] {
        let bound = *self.slot(Diamond::at([column, row].map(|c| c << (Cell::MAX_LEVEL - self.finest))));
        [bound.bits, u32::from(bound.low) | u32::from(bound.high) << 16]
    }

    /// Whether any of it is void.
    pub(super) fn voids(&self) -> bool {
        self.voids
    }

    /// Height (m) of a lattice point that is a sample; NaN where void.
    #[inline]
    pub(super) fn height(&self, at: Point) -> f32 {
        let [x, y] = self.sample(at);
        self.heights[y * self.side + x]
    }

    /// Begins to load a height.
    #[inline]
    pub(super) fn expect_height(&self, at: Point) {
        let [x, y] = self.sample(at);
        prefetch(&self.heights[y * self.side + x]);
    }

    #[inline]
    fn sample(&self, at: Point) -> [usize; 2] {
        at.map(|c| (c >> (Cell::MAX_LEVEL - self.finest)) as usize)
    }

    /// Where the bound of a diamond above the level of the samples is kept.
    #[inline(always)]
    fn slot(&self, diamond: Diamond) -> &Bound {
        let level = diamond.cell_level();
        self.levels[usize::from(level)].slot(diamond, level)
    }

    /// Keeps slopes, too, which some [`Factors`] ask for: four bytes a sample.
    pub fn with_slopes(mut self) -> NestedBounds {
        self.slopes = vec![Level::default(); usize::from(self.finest)];
        for level in (0..self.finest).rev() {
            let half = Diamond::ROOT.half >> level;
            let of = |bounds: &NestedBounds, i, j| {
                let children = Diamond::at([i * half, j * half]).children().into_iter().flatten();
                children.fold(Slopes::EMPTY, |all, child| all.union(bounds.slopes(child)))
            };
            let sides = Level::sides(level, Slopes::EMPTY, &|i, j| of(&self, i, j));
            self.slopes[usize::from(level)] = sides;
            let squares = Level::squares(level, Slopes::EMPTY, &|i, j| of(&self, i, j));
            self.slopes[usize::from(level)].kinds[Kind::Square as usize] = squares;
        }
        self
    }

    /// Whether slopes are kept.
    pub(super) fn keeps_slopes(&self) -> bool {
        !self.slopes.is_empty()
    }

    /// The slopes of all that needs a diamond; none if they were not asked for.
    #[inline]
    pub(super) fn slopes(&self, diamond: Diamond) -> Slopes {
        if self.slopes.is_empty() {
            return Slopes::EMPTY;
        }
        let level = diamond.cell_level();
        if level < self.finest {
            return *self.slopes[usize::from(level)].slot(diamond, level);
        }
        let Datum::Plane { size, .. } = self.datum else { return Slopes::EMPTY };
        let [x, y] = diamond.at.map(|c| (c >> (Cell::MAX_LEVEL - self.finest)) as usize);
        let corners = if level == self.finest && diamond.is_square() { self.corners(x, y) } else { None };
        let Some([a, b, c, d]) = corners else { return Slopes::EMPTY };
        let [dx, dy] = (size / f64::from(1u32 << self.finest)).as_vec2().to_array();
        Slopes::of([(b - a) / dx, (d - c) / dx], [(c - a) / dy, (d - b) / dy])
    }

    /// Bits of lattice coordinates below a step: half a sample.
    #[inline]
    pub(super) fn shift(&self) -> u8 {
        Cell::MAX_LEVEL - self.finest - 1
    }

    /// The lattice point of one in steps, x in the lower half.
    #[inline]
    pub(super) fn point(&self, at: u32) -> Point {
        [(at & 0xffff) << self.shift(), (at >> 16) << self.shift()]
    }

    /// How many triangles the split of a diamond adds; its middle in steps.
    #[inline]
    pub(super) fn cost(&self, at: u32) -> usize {
        let (x, y, end) = (at & 0xffff, at >> 16, 2 << self.finest);
        if x == 0 || y == 0 || x == end || y == end { 1 } else { 2 }
    }

    /// What the priority of a diamond is computed from.
    #[inline]
    pub(super) fn item_of(&self, bound: Bound, diamond: Diamond, kind: u8, record: u32) -> Item {
        let shift = self.shift();
        Item {
            at: diamond.at[0] >> shift | diamond.at[1] >> shift << 16,
            heights: bound.heights(),
            deviation: bound.deviation(),
            word: Item::word(kind, diamond.is_square(), diamond.half >> shift, record),
        }
    }

    /// The same, its bound looked up.
    #[inline]
    pub(super) fn item(&self, diamond: Diamond, kind: u8, record: u32) -> Item {
        self.item_of(self.bound(diamond), diamond, kind, record)
    }

    /// The bounds of the diamonds of a level above that of the samples.
    pub(super) fn table(&self, level: u8, kind: Kind) -> Table<'_> {
        let (all, n) = (&self.levels[usize::from(level)], 1 << level);
        let columns = n + u32::from(kind == Kind::North);
        Table { bounds: &all.kinds[kind as usize], columns, unit: u32::from(self.finest + 1 - level) }
    }

    /// What is the same in the items of a level and kind.
    pub(super) fn word(&self, level: u8, kind: Kind) -> u32 {
        Item::word(SPLIT, kind == Kind::Square, (1 << self.finest) >> level, 0)
    }

    /// Whether there is surface under all of a triangle: the middle of its base and its apex, in steps.
    pub(super) fn whole(&self, middle: Point, apex: Point) -> bool {
        let [middle, apex] = [middle, apex].map(|at| at.map(|c| c << self.shift()));
        let diamond = Diamond::at(middle);
        self.bound(diamond).whole(usize::from(diamond.apexes()[0] != Some(apex)))
    }

    /// The lens of a view of this land.
    pub(super) fn lens(&self, metric: &ScreenMetric, priority: Priority, factors: &Factors) -> Lens {
        let steps = f64::from(STEPS >> self.shift());
        Lens::new(metric, self.datum, steps, (self.base, self.step), priority, self.voids, factors)
    }

    /// Begins to load the bound of a diamond.
    #[inline]
    pub(super) fn expect_bound(&self, diamond: Diamond) {
        if diamond.cell_level() < self.finest {
            prefetch(self.slot(diamond));
        }
    }

    /// The bound of a diamond; empty below the level of the samples, save for the patches themselves.
    #[inline]
    pub(super) fn bound(&self, diamond: Diamond) -> Bound {
        if diamond.cell_level() >= self.finest { self.patch(diamond) } else { *self.slot(diamond) }
    }

    fn corners(&self, x: usize, y: usize) -> Option<[f32; 4]> {
        if x + 1 >= self.side || y + 1 >= self.side {
            return None;
        }
        let at = y * self.side + x;
        let all =
            [self.heights[at], self.heights[at + 1], self.heights[at + self.side], self.heights[at + self.side + 1]];
        all.iter().all(|h| !h.is_nan()).then_some(all)
    }

    /// The bound of a patch between four samples.
    fn patch(&self, diamond: Diamond) -> Bound {
        if diamond.cell_level() > self.finest || !diamond.is_square() {
            return Bound::EMPTY;
        }
        let [x, y] = diamond.at.map(|c| (c >> (Cell::MAX_LEVEL - self.finest)) as usize);
        let Some([a, b, c, d]) = self.corners(x, y) else { return Bound::EMPTY };
        let size = a.abs().max(b.abs()).max(c.abs().max(d.abs()));
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        let twist = 0.25 * ((a - b) - (c - d)).abs() + size * f32::EPSILON;
        Bound::new(twist, self.down(low), self.up(high), [Cover::Whole; 2])
    }

    fn decoded(&self, steps: u16) -> f32 {
        self.base + f32::from(steps) * self.step
    }

    fn down(&self, height: f32) -> u16 {
        let steps = ((height - self.base) / self.step) as u16;
        steps - u16::from(self.decoded(steps) > height && steps > 0)
    }

    fn up(&self, height: f32) -> u16 {
        let steps = ((height - self.base) / self.step) as u16;
        steps + u16::from(self.decoded(steps) < height)
    }

    /// Measures a diamond whose children are known.
    fn measure(&self, land: &Land, diamond: Diamond) -> Bound {
        let apexes = diamond.apexes();
        let mut parts: [Option<Cover>; 2] = [None; 2];
        let (mut deviation, mut low, mut high) = (0.0f32, u16::MAX, 0);
        for child in diamond.children().into_iter().flatten() {
            let bound = self.bound(child);
            (deviation, low, high) = (deviation.max(bound.deviation()), low.min(bound.low), high.max(bound.high));
            let own = child.apexes().iter().position(|apex| *apex == Some(diamond.at)).expect("this is its parent");
            let side = usize::from(apexes[0].is_none_or(|apex| !child.ends().contains(&apex)));
            let cover = bound.cover(own);
            parts[side] = Some(if parts[side].is_none_or(|other| other == cover) { cover } else { Cover::Partial });
        }
        let cover = parts.map(|part| part.unwrap_or(Cover::Void));
        for (apex, cover) in apexes.into_iter().zip(cover) {
            let Some(apex) = apex else { continue };
            match cover {
                Cover::Partial => {
                    deviation = f32::INFINITY;
                    // What is partly void is as far off as its whole cell is large.
                    let range = land.range(diamond.cell(apex));
                    (low, high) = (low.min(self.down(range.low)), high.max(self.up(range.high)));
                }
                Cover::Void => {}
                // No triangle over heights of a range leaves it.
                Cover::Whole if deviation.is_finite() => {
                    let most = self.decoded(high) - self.decoded(low);
                    deviation = deviation.max(self.triangle(diamond, apex).min(most.next_up()));
                }
                Cover::Whole => {}
            }
        }
        Bound::new(deviation, low, high, cover)
    }

    /// The deviation of the triangle towards `apex`, which is whole.
    fn triangle(&self, diamond: Diamond, apex: Point) -> f32 {
        let corners = diamond.triangle(apex).map(|p| self.sample(p));
        let [a, b, c] = corners.map(|[x, y]| self.heights[y * self.side + x]);
        let [pa, pb, pc] = corners.map(|p| p.map(|c| c as i64));
        let (low_y, high_y) = (pa[1].min(pb[1]).min(pc[1]), pa[1].max(pb[1]).max(pc[1]));
        let low_x = pa[0].min(pb[0]).min(pc[0]);
        let high_x = pa[0].max(pb[0]).max(pc[0]);
        // Height = a + gx (x − ax) + gy (y − ay). Legs or base lie along the axes, so slopes are divided by powers of two.
        let area = ((pb[0] - pa[0]) * (pc[1] - pa[1]) - (pb[1] - pa[1]) * (pc[0] - pa[0])) as f32;
        let gx = ((b - a) * (pc[1] - pa[1]) as f32 - (c - a) * (pb[1] - pa[1]) as f32) / area;
        let gy = ((c - a) * (pb[0] - pa[0]) as f32 - (b - a) * (pc[0] - pa[0]) as f32) / area;
        let size = a.abs().max(b.abs()).max(c.abs());
        let mut worst = 0.0f32;
        let s = high_y - low_y;
        for row in low_y..=high_y {
            let j = row - low_y;
            // First and last column of the row.
            let (from, to) = match diamond.base {
                Base::Rising if apex[0] > diamond.at[0] => (low_x + j, high_x),
                Base::Rising => (low_x, low_x + j),
                Base::Falling if apex[0] > diamond.at[0] => (high_x - j, high_x),
                Base::Falling => (low_x, high_x - j),
                Base::East if apex[1] > diamond.at[1] => (low_x + j, high_x - j),
                Base::East => (low_x + s - j, high_x - s + j),
                Base::North if apex[0] > diamond.at[0] => (low_x, low_x + j.min(s - j)),
                Base::North => (high_x - j.min(s - j), high_x),
            };
            let line = &self.heights[row as usize * self.side + from as usize..=row as usize * self.side + to as usize];
            let start = a + gy * (row - pa[1]) as f32 + gx * (from - pa[0]) as f32;
            worst = worst.max(line_deviation(line, start, gx));
        }
        let mut twist = 0.0f32;
        if diamond.is_square() {
            for j in 0..s {
                let x = if diamond.base == Base::Rising { low_x + j } else { high_x - 1 - j };
                if let Some([a, b, c, d]) = self.corners(x as usize, (low_y + j) as usize) {
                    twist = twist.max(((a - b) - (c - d)).abs());
                }
            }
        }
        worst + 0.25 * twist + (8.0 * size + worst) * 8.0 * f32::EPSILON
    }
}

/// Begins to load a line of memory.
#[inline]
pub(super) fn prefetch<T>(what: &T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint; it reads nothing that the program can see.
    unsafe {
        std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(std::ptr::from_ref(what).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = what;
}

/// The greatest distance of `heights` from the line `start + i · step`.
#[inline]
fn line_deviation(heights: &[f32], start: f32, step: f32) -> f32 {
    const LANES: usize = 16;
    let mut worst = [0.0f32; LANES];
    let mut chunks = heights.chunks_exact(LANES);
    let mut base = 0.0;
    for chunk in &mut chunks {
        for lane in 0..LANES {
            let difference = (chunk[lane] - (start + (base + lane as f32) * step)).abs();
            worst[lane] = if difference > worst[lane] { difference } else { worst[lane] };
        }
        base += LANES as f32;
    }
    let mut most = 0.0f32;
    for (i, height) in chunks.remainder().iter().enumerate() {
        let difference = (height - (start + (base + i as f32) * step)).abs();
        most = if difference > most { difference } else { most };
    }
    worst.into_iter().fold(most, f32::max)
}
