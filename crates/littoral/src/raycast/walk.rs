//! One ray through the range pyramid, in `f64`: the exact walk that the faster kernels are held against.
//!
//! The ray moves from cell to cell, never back. Wherever it passes over the highest or under the lowest point of a node
//! it leaves the node in one step and tries the next coarser one; otherwise it looks at the next finer one, down to single
//! patches. There its height over the bilinear surface is a quadratic along the ray, solved in closed form.
//!
//! No ray slips through between two patches: cells are integers; the distance at which a line between cells is crossed
//! is one expression, so that both neighbours get the same bits; positions on such a line are exactly 0 or 1 within a
//! patch; and the bilinear form below then gives both the same height. So a sign that differs on the two sides of a
//! patch is a hit, and no sign can change between patches. Axes along which the ray runs backward are mirrored, which
//! leaves one direction to think about.
//!
//! Works this rests on: J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing", Eurographics 1987;
//! A. Tevs et al., "Maximum mipmaps", I3D 2008; the stable quadratic of W. H. Press et al., *Numerical Recipes*, §5.6.

use crate::field::{HeightRange, Land, Raster};
use crate::space::Ray;
use glam::DVec2;

/// Where along the ray, and in which patch at which position, the surface was met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// In lengths of the ray's direction.
    pub distance: f64,
    /// Patch, counted from the south-west.
    pub column: usize,
    pub row: usize,
    /// Position within the patch, each coordinate in [0, 1].
    pub at: DVec2,
}

/// One horizontal axis of a ray in lattice units, mirrored so that it runs forward.
#[derive(Clone, Copy, Debug)]
struct Axis {
    origin: f64,
    direction: f64,
    /// 1 / direction; meaningless where `still`.
    inverse: f64,
    still: bool,
    mirrored: bool,
    /// What turns a mirrored cell into one of the raster by exclusive or.
    mirror: u32,
    /// Positions this near a line between cells may have been rounded across it.
    hair: f64,
    /// First cell that exists, and one past the last.
    first: u32,
    end: u32,
}

impl Axis {
    /// `cells` patches from 0; the lattice is mirrored about the middle of `side` patches, a power of two.
    fn new(origin: f64, direction: f64, cells: u32, side: u32) -> Axis {
        // Slower than this the ray would need 10¹⁸ of its lengths to cross a cell: it stands still.
        let still = direction.abs() < 1e-18;
        let hair = 1e-14 * (origin.abs() + f64::from(side));
        let mirrored = direction < 0.0;
        let (origin, direction) = if mirrored { (f64::from(side) - origin, -direction) } else { (origin, direction) };
        let (mirror, first, end) = if mirrored { (side - 1, side - cells, side) } else { (0, 0, cells) };
        Axis { origin, direction, inverse: 1.0 / direction, still, mirrored, mirror, hair, first, end }
    }

    /// Where the ray crosses the line between two cells, `f64::INFINITY` if never. Every crossing is this expression.
    #[inline(always)]
    fn crossing(&self, line: u32) -> f64 {
        if self.still { f64::INFINITY } else { (f64::from(line) - self.origin) * self.inverse }
    }

    /// Distances at which the ray enters and leaves the raster; an empty interval if it misses.
    fn span(&self) -> (f64, f64) {
        if !self.still {
            return (self.crossing(self.first), self.crossing(self.end));
        }
        let inside = self.origin >= f64::from(self.first) && self.origin <= f64::from(self.end);
        if inside { (f64::NEG_INFINITY, f64::INFINITY) } else { (f64::INFINITY, f64::NEG_INFINITY) }
    }

    /// The cell that the ray is in at distance `t`, among `least..=most`.
    #[inline(always)]
    fn cell(&self, t: f64, least: u32, most: u32) -> u32 {
        let position = self.origin + t * self.direction;
        let mut cell = (position as i64).clamp(i64::from(least), i64::from(most)) as u32;
        let fraction = position - f64::from(cell);
        if fraction > self.hair && fraction < 1.0 - self.hair {
            return cell;
        }
        // Rounding may have put the position on the other side of a line: what counts is the crossing.
        while cell > least && !self.still && self.crossing(cell) > t {
            cell -= 1;
        }
        while cell < most && self.crossing(cell + 1) <= t {
            cell += 1;
        }
        cell
    }

    /// Position within a cell at distance `t`, exactly 0 or 1 on its borders.
    #[inline(always)]
    fn within(&self, cell: u32, t: f64) -> f64 {
        if !self.still && self.crossing(cell) >= t {
            0.0
        } else if self.crossing(cell + 1) <= t {
            1.0
        } else {
            (self.origin + t * self.direction - f64::from(cell)).clamp(0.0, 1.0)
        }
    }
}

/// The first crossing of a ray and the surface of `land`; with `pyramid` off it looks at every patch on the way, which
/// must not change the answer.
pub(super) fn first_crossing(land: &Land, ray: &Ray, pyramid: bool) -> Option<Crossing> {
    let (raster, ranges) = (land.raster(), land.ranges());
    let length = ray.direction.length();
    let bounds = land.height_range();
    if !(ray.origin.is_finite() && length.is_finite() && length > 0.0 && ray.reach >= 0.0) || bounds.is_empty() {
        return None;
    }
    // Distances in metres from here on, so that no direction is too short or too long.
    let direction = ray.direction / length;
    let origin = (ray.origin.truncate() - land.origin()) / raster.spacing();
    let slope = direction.truncate() / raster.spacing();
    let (z, dz) = (ray.origin.z, direction.z);
    let side = 1u32 << land.finest_level();
    let x = Axis::new(origin.x, slope.x, raster.columns() as u32 - 1, side);
    let y = Axis::new(origin.y, slope.y, raster.rows() as u32 - 1, side);

    // The part of the ray over the raster and between its lowest and highest height.
    let slack = 1e-6 * f64::from(bounds.high - bounds.low) + 1e-3;
    let (low, high) = (f64::from(bounds.low) - slack, f64::from(bounds.high) + slack);
    let (x_span, y_span) = (x.span(), y.span());
    let (mut start, mut end) = (x_span.0.max(y_span.0).max(0.0), x_span.1.min(y_span.1).min(ray.reach * length));
    if dz != 0.0 {
        let (a, b) = ((low - z) / dz, (high - z) / dz);
        (start, end) = (start.max(a.min(b)), end.min(a.max(b)));
    } else if z < low || z > high {
        return None;
    }
    if start.is_nan() || end.is_nan() || start > end {
        return None;
    }

    let top = if pyramid { ranges.top() } else { 0 };
    // A start in the middle: rays near the ground need not come down from the top, others are soon up there.
    let middle = top.min(5);
    let voids = raster.voids().any();
    let (mut i, mut j) = (x.cell(start, x.first, x.end - 1), y.cell(start, y.first, y.end - 1));
    let (mut t, mut level) = (start, middle);
    loop {
        let (next_i, next_j) = (((i >> level) + 1) << level, ((j >> level) + 1) << level);
        let (tx, ty) = (x.crossing(next_i), y.crossing(next_j));
        let leave = tx.min(ty).min(end).max(t);
        if level > 0 {
            let (column, row) = ((i ^ x.mirror) >> level, (j ^ y.mirror) >> level);
            let HeightRange { low, high } = ranges.node(level, column as usize, row as usize);
            let (z0, z1) = (z + t * dz, z + leave * dz);
            // An empty node has low = ∞ and is skipped too. A hair of slack keeps what the patches round away.
            let slack = 1e-12 * (z0.abs() + z1.abs());
            if z0.min(z1) <= f64::from(high) + slack && z0.max(z1) >= f64::from(low) - slack {
                level -= 1;
                continue;
            }
        } else {
            let (column, row) = ((i ^ x.mirror) as usize, (j ^ y.mirror) as usize);
            if let Some(corners) = patch_corners(raster, voids, column, row) {
                let begin = x.crossing_or_start(i).max(y.crossing_or_start(j)).max(start);
                let finish = tx.min(ty).min(end).max(begin);
                let (from, to) = (
                    DVec2::new(x.within(i, begin), y.within(j, begin)),
                    DVec2::new(x.within(i, finish), y.within(j, finish)),
                );
                let heights = mirrored(corners.map(f64::from), x.mirrored, y.mirrored);
                if let Some(s) = patch_root(heights, from, to, z + begin * dz, z + finish * dz) {
                    let distance = begin + s * (finish - begin);
                    let at = from + (to - from) * s;
                    let unmirror = |at: f64, mirrored: bool| if mirrored { 1.0 - at } else { at };
                    let at = DVec2::new(unmirror(at.x, x.mirrored), unmirror(at.y, y.mirrored));
                    return Some(Crossing { distance: distance / length, column, row, at });
                }
            }
        }
        if leave >= end {
            return None;
        }
        // Across the nearer line, and up a level where that line ends the coarser node as well.
        let line = if tx <= ty {
            j = y.cell(leave, j, (next_j - 1).min(y.end - 1));
            i = next_i;
            next_i
        } else {
            i = x.cell(leave, i, (next_i - 1).min(x.end - 1));
            j = next_j;
            next_j
        };
        t = leave;
        if level < top && line & (1 << level) == 0 {
            level += 1;
        }
    }
}

impl Axis {
    /// Where the ray enters a cell along this axis; minus infinity if it is always inside.
    #[inline(always)]
    fn crossing_or_start(&self, cell: u32) -> f64 {
        if self.still { f64::NEG_INFINITY } else { self.crossing(cell) }
    }
}

/// The heights at the corners of a patch of the raster; `None` if any is void.
#[inline(always)]
fn patch_corners(raster: &Raster, voids: bool, column: usize, row: usize) -> Option<[f32; 4]> {
    let at = row * raster.columns() + column;
    let (south, north) = (raster.heights().get(at..at + 2)?, raster.heights().get(at + raster.columns()..)?.get(..2)?);
    let void = |index| raster.voids().is_void(index);
    if voids && (void(at) || void(at + 1) || void(at + raster.columns()) || void(at + raster.columns() + 1)) {
        return None;
    }
    Some([south[0], south[1], north[0], north[1]])
}

/// Corner heights as seen with one or both axes mirrored.
fn mirrored([a, b, c, d]: [f64; 4], x: bool, y: bool) -> [f64; 4] {
    let [a, b, c, d] = if x { [b, a, d, c] } else { [a, b, c, d] };
    if y { [c, d, a, b] } else { [a, b, c, d] }
}

/// The bilinear height at (u, v). In this form it is exactly the neighbour's at u or v of 0 and 1.
#[inline(always)]
fn bilinear([a, b, c, d]: [f64; 4], at: DVec2) -> f64 {
    let (u, v) = (at.x, at.y);
    (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v
}

/// How far along the straight line `from`..`to` through a patch, in [0, 1], a ray whose height runs from `z0` to `z1`
/// first meets it.
fn patch_root(heights: [f64; 4], from: DVec2, to: DVec2, z0: f64, z1: f64) -> Option<f64> {
    let (f0, f1) = (z0 - bilinear(heights, from), z1 - bilinear(heights, to));
    if f0 == 0.0 {
        return Some(0.0);
    }
    // From above; a ray below the surface is the mirror image.
    let sign = f0.signum();
    let (f0, f1) = (f0 * sign, f1 * sign);
    let [a, b, c, d] = heights;
    // f(s) = f0 + slope·s + bend·s²: the bilinear term is all the curvature there is.
    let along = to - from;
    let bend = -sign * (a - b - c + d) * along.x * along.y;
    let slope = f1 - f0 - bend;
    let disc = slope * slope - 4.0 * bend * f0;
    let dips = bend > 0.0 && slope < 0.0 && slope + 2.0 * bend > 0.0 && disc >= 0.0;
    if !(f1 <= 0.0 || dips) {
        return None;
    }
    // The smaller positive root, without a difference of nearly equal numbers.
    let root = disc.max(0.0).sqrt();
    let s = if slope < 0.0 { 2.0 * f0 / (root - slope) } else { (slope + root) / (-2.0 * bend) };
    Some(s.clamp(0.0, 1.0))
}
