//! The ground below a straight line, exactly: pieces on which its height is a quadratic.
//!
//! A straight line crosses the patches between samples one after the other, and a bilinear patch along a straight line is
//! a parabola: `h(v) = (1 − v)·start + v·end + bulge·v·(1 − v)` for v from 0 to 1. Nothing is sampled, so nothing is
//! missed. The line is cut first at the lattice lines of its *major* axis, the one along which it crosses more of them; a
//! strip between two such lines holds at most one crossing with the other family. Every strip is computed from the line's
//! equation alone, never from the strip before, so that walking a line from either end, or only parts of it, gives the
//! same bits.

use crate::field::Land;
use glam::DVec2;

/// The pyramid's highest step of a node without ground.
const EMPTY: u16 = 0;

/// One parabola of a vertical section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Where it starts and ends, in fractions of the line.
    pub from: f64,
    pub to: f64,
    /// Heights (m) at the ends and of the bulge between them; `None` where the ground is void.
    pub ground: Option<Parabola>,
}

/// `h(v) = (1 − v)·start + v·end + bulge·v·(1 − v)`, for v in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parabola {
    pub start: f64,
    pub end: f64,
    pub bulge: f64,
}

impl Parabola {
    /// Its value at `v`.
    pub fn at(&self, v: f64) -> f64 {
        self.start + (self.end - self.start) * v + self.bulge * v * (1.0 - v)
    }

    /// Where its derivative vanishes, if within (0, 1).
    pub fn vertex(&self) -> Option<f64> {
        let v = 0.5 + 0.5 * (self.end - self.start) / self.bulge;
        (v > 0.0 && v < 1.0).then_some(v)
    }

    /// Its lowest value, and where.
    pub fn lowest(&self) -> (f64, f64) {
        let ends = if self.end < self.start { (self.end, 1.0) } else { (self.start, 0.0) };
        match self.vertex() {
            Some(v) if self.bulge < 0.0 => (self.at(v).min(ends.0), v),
            _ => ends,
        }
    }

    /// Its highest value, and where.
    pub fn highest(&self) -> (f64, f64) {
        let (value, v) = Parabola { start: -self.start, end: -self.end, bulge: -self.bulge }.lowest();
        (-value, v)
    }

    /// The first v in [0, 1] at which its value is at most `level`.
    pub fn first_at_most(&self, level: f64) -> Option<f64> {
        let (start, end) = (self.start - level, self.end - level);
        if start <= 0.0 {
            return Some(0.0);
        }
        if self.lowest().0 > level {
            return None;
        }
        // start + b·v − bulge·v² = 0 with start > 0: its smallest positive root, in the form that does not cancel.
        let b = end - start + self.bulge;
        let root = (b * b + 4.0 * self.bulge * start).max(0.0).sqrt();
        let v = if b < 0.0 { 2.0 * start / (root - b) } else { (b + root) / (2.0 * self.bulge) };
        Some(if v.is_finite() { v.clamp(0.0, 1.0) } else { 1.0 })
    }
}

/// A straight line over land, in lattice coordinates: (0, 0) is the south-western sample, (1, 0) its eastern neighbour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    to: DVec2,
    /// Whether the line crosses more columns (lines of constant x) than rows.
    eastward: bool,
    /// Along the major axis: where it starts and how far it runs; along the minor one: where it starts and its slope.
    major: f64,
    run: f64,
    per_run: f64,
    minor: f64,
    slope: f64,
}

impl Line {
    /// The line between two points of the lattice, both on the land.
    pub fn new(from: DVec2, to: DVec2) -> Line {
        let by = to - from;
        let eastward = by.x.abs() >= by.y.abs();
        let (major, run, minor, rise) =
            if eastward { (from.x, by.x, from.y, by.y) } else { (from.y, by.y, from.x, by.x) };
        Line { to, eastward, major, run, per_run: 1.0 / run, minor, slope: if run == 0.0 { 0.0 } else { rise / run } }
    }

    /// The strips between neighbouring lattice lines of the major axis that the line touches: the half-open range of
    /// their lower lattice lines.
    pub fn strips(&self) -> std::ops::Range<i64> {
        let end = self.major + self.run;
        let (low, high) = (self.major.min(end), self.major.max(end));
        let first = low.floor() as i64;
        first..(high.ceil() as i64).max(first + 1)
    }

    /// Whether the strips follow the line in rising order.
    pub fn forward(&self) -> bool {
        self.run >= 0.0
    }

    /// Visits the strips from `first` up to `last` (not included) one by one, beginning at the line's start or at its end,
    /// and passing over blocks of 2^level strips that `skip(level, block)` lets it: neighbouring blocks are tried ever
    /// larger, and halved when refused. Stops when `visit` says so; returns whether it did.
    #[inline]
    pub fn walk(
        &self,
        land: &Land,
        (first, last): (i64, i64),
        from_start: bool,
        mut skip: impl FnMut(u32, i64) -> bool,
        mut visit: impl FnMut(i64) -> bool,
    ) -> bool {
        let upward = self.forward() == from_start;
        let top = land.ranges().top();
        let mut strip = if upward { first } else { last - 1 };
        let mut level = 0;
        while strip >= first && strip < last {
            let block = strip >> level;
            if level == 0 {
                if visit(strip) {
                    return true;
                }
            } else if !skip(level, block) {
                level -= 1;
                continue;
            }
            let border = if upward { (block + 1) << level } else { block << level };
            strip = if upward { border } else { border - 1 };
            if level < top && border & ((2 << level) - 1) == 0 {
                level += 1;
            }
        }
        false
    }

    /// Position on the minor axis above one on the major axis.
    fn minor_at(&self, major: f64) -> f64 {
        if major == self.major + self.run {
            let end = if self.eastward { self.to.y } else { self.to.x };
            return end;
        }
        self.minor + self.slope * (major - self.major)
    }

    /// Fractions of the line, to rounding, between which it lies in the strips from `first` up to `last` (not included): the smaller
    /// one first.
    pub fn fractions(&self, first: i64, last: i64) -> (f64, f64) {
        if self.run == 0.0 {
            return (0.0, 1.0);
        }
        let (a, b) = ((first as f64 - self.major) * self.per_run, (last as f64 - self.major) * self.per_run);
        (a.min(b).clamp(0.0, 1.0), a.max(b).clamp(0.0, 1.0))
    }

    /// The highest ground anywhere below the line within a block of 2^`level` strips, the `block`-th of its size; from the
    /// pyramid, so never too low. Level 1 or more.
    pub fn highest(&self, land: &Land, level: u32, block: i64) -> f64 {
        let (low, high) = (self.major.min(self.major + self.run), self.major.max(self.major + self.run));
        let (a, b) = ((block << level) as f64, ((block + 1) << level) as f64);
        let (a, b) = (self.minor_at(a.max(low)), self.minor_at(b.min(high)));
        // A line on the border of two nodes, or within rounding of it, counts for both.
        let scale = 1.0 / (1u64 << level) as f64;
        let (first, last) = (((a.min(b) - 1e-6) * scale) as usize, ((a.max(b) + 1e-6) * scale) as usize);
        let pyramid = land.ranges();
        let nodes = pyramid.levels[level as usize - 1];
        let steps = |minor: usize| {
            let (column, row) = if self.eastward { (block as usize, minor) } else { (minor, block as usize) };
            if column < nodes.columns && row < nodes.rows {
                pyramid.highs[nodes.offset + row * nodes.columns + column]
            } else {
                EMPTY
            }
        };
        let highest = (first..=last).map(steps).fold(EMPTY, u16::max);
        if highest == EMPTY { f64::NEG_INFINITY } else { f64::from(pyramid.height(highest)) }
    }

    /// The pieces within one strip, at most three, in order of the line; calls `visit` for each.
    #[inline]
    pub fn pieces(&self, land: &Land, strip: i64, mut visit: impl FnMut(Piece)) {
        let end = self.major + self.run;
        let (low, high) = (self.major.min(end), self.major.max(end));
        let (strip_low, strip_high) = ((strip as f64).max(low), ((strip + 1) as f64).min(high));
        let (a, b) = if self.run >= 0.0 { (strip_low, strip_high) } else { (strip_high, strip_low) };
        let (minor_a, minor_b) = (self.minor_at(a), self.minor_at(b));
        let fraction = |major: f64| if self.run == 0.0 { 0.0 } else { (major - self.major) / self.run };

        let raster = land.raster();
        let (majors, minors) =
            if self.eastward { (raster.columns(), raster.rows()) } else { (raster.rows(), raster.columns()) };
        let column = strip.clamp(0, majors as i64 - 2) as usize;
        let (first, last) = rows_between(minor_a, minor_b, minors);
        let rising = minor_b >= minor_a;
        let count = last - first + 1;
        let mut start = (a, minor_a);
        for step in 0..count {
            let row = if rising { first + step } else { last - step };
            let stop = if step + 1 == count {
                (b, minor_b)
            } else {
                let border = if rising { row + 1 } else { row } as f64;
                let major = self.major + (border - self.minor) / self.slope;
                (if self.run >= 0.0 { major.clamp(start.0, b) } else { major.clamp(b, start.0) }, border)
            };
            let ground = self.parabola(land, column, row as usize, start, stop);
            visit(Piece { from: fraction(start.0), to: fraction(stop.0), ground });
            start = stop;
        }
    }

    /// The highest sample round the patches of one strip: nothing of the ground there is higher.
    #[inline]
    pub fn highest_sample(&self, land: &Land, strip: i64) -> f64 {
        let (low, high) = (self.major.min(self.major + self.run), self.major.max(self.major + self.run));
        let raster = land.raster();
        let columns = raster.columns();
        let (majors, minors, along, across) = if self.eastward {
            (raster.columns(), raster.rows(), 1, columns)
        } else {
            (raster.rows(), raster.columns(), columns, 1)
        };
        let (a, b) = (self.minor_at((strip as f64).max(low)), self.minor_at(((strip + 1) as f64).min(high)));
        let (first, last) = rows_between(a, b, minors);
        let column = strip.clamp(0, majors as i64 - 2) as usize;
        let heights = raster.heights();
        let mut highest = f32::NEG_INFINITY;
        for row in first..=last + 1 {
            let index = row as usize * across + column * along;
            highest = highest.max(heights[index]).max(heights[index + along]);
        }
        f64::from(highest)
    }

    /// The ground between two points (major, minor) of one patch.
    #[inline]
    fn parabola(
        &self,
        land: &Land,
        major: usize,
        minor: usize,
        (a, minor_a): (f64, f64),
        (b, minor_b): (f64, f64),
    ) -> Option<Parabola> {
        let raster = land.raster();
        let columns = raster.columns();
        let (index, along, across) =
            if self.eastward { (minor * columns + major, 1, columns) } else { (major * columns + minor, columns, 1) };
        let (heights, voids) = (raster.heights(), raster.voids());
        let (u0, u1) = (a - major as f64, b - major as f64);
        let (v0, v1) = (minor_a - minor as f64, minor_b - minor as f64);
        let height = |index: usize| f64::from(heights[index]);
        let known = |index: usize| {
            !voids.any() || [0, along, across, along + across].iter().all(|corner| !voids.is_void(index + corner))
        };
        // A line along the border of a patch needs only one of the two patches that share it.
        if v0 == v1 && (v0 == 0.0 || v0 == 1.0) {
            if !(known(index) || v0 == 0.0 && minor > 0 && known(index - across)) {
                return None;
            }
            let index = if v0 == 0.0 { index } else { index + across };
            let (c0, c1) = (height(index), height(index + along));
            return Some(Parabola { start: c0 + (c1 - c0) * u0, end: c0 + (c1 - c0) * u1, bulge: 0.0 });
        }
        if !known(index) {
            return None;
        }
        let [c00, c10, c01, c11] = [index, index + along, index + across, index + along + across].map(height);
        let bilinear = |u: f64, v: f64| {
            let near = c00 + (c10 - c00) * u;
            let far = c01 + (c11 - c01) * u;
            near + (far - near) * v
        };
        let twist = (c00 - c10) + (c11 - c01);
        Some(Parabola { start: bilinear(u0, v0), end: bilinear(u1, v1), bulge: -twist * (u1 - u0) * (v1 - v0) })
    }
}

/// The first and last patch of a strip that a line from `a` to `b` on the minor axis touches. A line that ends on a lattice
/// line does not reach beyond it.
#[inline]
fn rows_between(a: f64, b: f64, minors: usize) -> (i64, i64) {
    let end = minors as i64 - 2;
    // Positions on the land are not negative but for rounding, so that cutting off is rounding down.
    let first = (a.min(b) as i64).clamp(0, end);
    let high = a.max(b);
    let last = high as i64;
    let last = if last as f64 == high { last - 1 } else { last };
    (first, last.clamp(first, end))
}

impl Land {
    /// Position in units of samples, (0, 0) being the south-western one; `None` outside the land. Positions that are a
    /// sample's but for rounding (10⁻⁹ of a sample) are taken as that sample's, so that a line along a row of samples
    /// runs along it.
    pub(super) fn lattice_of(&self, xy: DVec2) -> Option<DVec2> {
        let raster = self.raster();
        let last = DVec2::new((raster.columns() - 1) as f64, (raster.rows() - 1) as f64);
        let lattice = (xy - self.origin()) / raster.spacing();
        let nearest = lattice.round();
        let snap = |at: f64, nearest: f64| if (at - nearest).abs() < 1e-9 { nearest } else { at };
        let lattice = DVec2::new(snap(lattice.x, nearest.x), snap(lattice.y, nearest.y));
        (lattice.cmpge(DVec2::ZERO).all() && lattice.cmple(last).all()).then_some(lattice)
    }

    /// Height (m) of the surface at a point of the lattice, in double precision; `None` where void. Patches hold their
    /// borders: on a border only its two samples count, on a sample only that one.
    pub(super) fn ground_at(&self, lattice: DVec2) -> Option<f64> {
        let raster = self.raster();
        let base = lattice.floor();
        let f = lattice - base;
        let (column, row) = (base.x as usize, base.y as usize);
        let mut height = 0.0;
        for (i, j, weight) in
            [(0, 0, (1.0 - f.x) * (1.0 - f.y)), (1, 0, f.x * (1.0 - f.y)), (0, 1, (1.0 - f.x) * f.y), (1, 1, f.x * f.y)]
        {
            if weight > 0.0 {
                height += weight * f64::from(raster.sample(column + i, row + j)?);
            }
        }
        Some(height)
    }
}
