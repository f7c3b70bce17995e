//! Land over a raster: the exact bilinear surface through its samples, with what lets others skip most of it.
//!
//! Between four samples the surface is the bilinear patch through them; a patch with a void corner does not exist. The
//! face of the land's datum is the raster padded to 2ᵏ × 2ᵏ patches, so that cells of level k are exactly the patches and
//! every cell's corners lie on samples; the padding is void and never shows.

use super::deviation::{quarter_twist, quarter_twists};
use super::lattice::{Samples, Vertex};
use super::pyramid::window_range;
use super::{ErrorPyramid, HeightField, HeightRange, RangePyramid, Raster, Window};
use crate::space::{Cell, Datum, Place};
use glam::{DVec2, DVec3, Vec3};
use std::sync::OnceLock;

/// Ground known by samples: a raster placed in the world.
#[derive(Clone, Debug)]
pub struct Land {
    raster: Raster,
    ranges: RangePyramid,
    origin: DVec2,
    /// The quadtree level at which cells are patches between four neighbouring samples.
    finest: u8,
    /// Built when first asked for: pictures and queries never need it.
    errors: OnceLock<ErrorPyramid>,
}

impl Land {
    /// Land over `raster`, centred on the world's origin.
    pub fn new(raster: Raster) -> Land {
        let extent = DVec2::new((raster.columns() - 1) as f64, (raster.rows() - 1) as f64) * raster.spacing();
        Land::at(raster, -0.5 * extent)
    }

    /// Land over `raster`, whose south-western sample lies at `origin` (m).
    pub fn at(raster: Raster, origin: DVec2) -> Land {
        let patches = (raster.columns().max(raster.rows()) - 1).next_power_of_two();
        let finest = patches.trailing_zeros() as u8;
        let ranges = RangePyramid::new(&raster);
        Land { raster, ranges, origin, finest, errors: OnceLock::new() }
    }

    /// How low and high the surface reaches over every aligned square of patches.
    pub fn ranges(&self) -> &RangePyramid {
        &self.ranges
    }

    /// Bytes of memory held: heights, void mask and pyramids.
    pub fn bytes(&self) -> usize {
        size_of_val(self.raster.heights()) + self.raster.voids().bytes() + self.ranges.bytes()
    }

    /// The samples.
    pub fn raster(&self) -> &Raster {
        &self.raster
    }

    /// World position of the south-western sample (m).
    pub fn origin(&self) -> DVec2 {
        self.origin
    }

    /// Width and height of the land between its outermost samples (m).
    pub fn extent(&self) -> DVec2 {
        DVec2::new((self.raster.columns() - 1) as f64, (self.raster.rows() - 1) as f64) * self.raster.spacing()
    }

    /// The quadtree level at which cells are the patches between four neighbouring samples.
    pub fn finest_level(&self) -> u8 {
        self.finest
    }

    /// Position in units of samples: (0, 0) is the south-western one.
    fn lattice(&self, xy: DVec2) -> DVec2 {
        (xy - self.origin) / self.raster.spacing()
    }

    /// The four heights round the patch that holds a world position, and the position within it; `None` where void or
    /// outside. Corners: south-west, south-east, north-west, north-east.
    fn patch(&self, xy: DVec2) -> Option<([f32; 4], DVec2)> {
        self.patch_at(self.lattice(xy))
    }

    /// [`Land::height_at`] for a position in units of samples.
    pub(crate) fn height_at_lattice(&self, at: DVec2) -> Option<f32> {
        self.patch_at(at).map(interpolate)
    }

    /// The same for a position in units of samples.
    fn patch_at(&self, lattice: DVec2) -> Option<([f32; 4], DVec2)> {
        let last = DVec2::new((self.raster.columns() - 1) as f64, (self.raster.rows() - 1) as f64);
        if !(lattice.cmpge(DVec2::ZERO).all() && lattice.cmple(last).all()) {
            return None;
        }
        let base = lattice.floor().min(last - 1.0);
        let (column, row) = (base.x as usize, base.y as usize);
        if let Some(corners) = self.corners(column, row) {
            return Some((corners, lattice - base));
        }
        // On a line between patches the one before may exist where the one after does not.
        let back = |at: f64, base: f64| if at == base && base > 0.0 { &[0.0, 1.0][..] } else { &[0.0] };
        let (backs_x, backs_y) = (back(lattice.x, base.x), back(lattice.y, base.y));
        let mut steps = backs_y.iter().flat_map(|&j| backs_x.iter().map(move |&i| DVec2::new(i, j)));
        steps.find_map(|step| {
            let base = base - step;
            Some((self.corners(base.x as usize, base.y as usize)?, lattice - base))
        })
    }

    /// The heights at the corners of the patch north-east of a sample; `None` if any is void.
    pub fn corners(&self, column: usize, row: usize) -> Option<[f32; 4]> {
        let at = |i, j| self.raster.sample(column + i, row + j);
        Some([at(0, 0)?, at(1, 0)?, at(0, 1)?, at(1, 1)?])
    }

    /// Which samples are void in one piece with the raster's edge; empty if none.
    pub(crate) fn voids_from_the_edge(&self) -> Vec<bool> {
        let raster = &self.raster;
        let (columns, rows, voids) = (raster.columns(), raster.rows(), raster.voids());
        let mut away = vec![false; columns * rows];
        let ends = (0..columns).flat_map(|c| [c, (rows - 1) * columns + c]);
        let sides = (0..rows).flat_map(|r| [r * columns, (r + 1) * columns - 1]);
        let mut queue: Vec<usize> = ends.chain(sides).filter(|&i| voids.is_void(i)).collect();
        if queue.is_empty() {
            return Vec::new();
        }
        queue.iter().for_each(|&i| away[i] = true);
        while let Some(i) = queue.pop() {
            let (column, row) = (i % columns, i / columns);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                for c in column.saturating_sub(1)..(column + 2).min(columns) {
                    let j = r * columns + c;
                    if voids.is_void(j) && !away[j] {
                        away[j] = true;
                        queue.push(j);
                    }
                }
            }
        }
        away
    }

    /// Exact height (m) of the surface below a world position (m); `None` where void or outside.
    pub fn height_at(&self, xy: DVec2) -> Option<f32> {
        self.patch(xy).map(interpolate)
    }

    /// The upward unit normal of the surface below a world position (m).
    pub fn normal_at(&self, xy: DVec2) -> Option<Vec3> {
        let ([a, b, c, d], f) = self.patch(xy)?;
        let [a, b, c, d] = [a, b, c, d].map(f64::from);
        let slope = DVec2::new((b - a) * (1.0 - f.y) + (d - c) * f.y, (c - a) * (1.0 - f.x) + (d - b) * f.x);
        let slope = slope / self.raster.spacing();
        Some(DVec3::new(-slope.x, -slope.y, 1.0).normalize().as_vec3())
    }

    /// Lowest and highest height of all valid samples.
    pub fn height_range(&self) -> HeightRange {
        self.ranges.range()
    }

    /// Replaces the samples of `window` (row by row from the south; not finite = void) and rebuilds only what depends on
    /// them.
    ///
    /// # Panics
    /// If the window leaves the raster or the number of heights is not its size.
    pub fn edit(&mut self, window: Window, heights: &[f32]) {
        let inside =
            window.column + window.columns <= self.raster.columns() && window.row + window.rows <= self.raster.rows();
        assert!(inside, "{window:?} leaves a raster of {} × {}", self.raster.columns(), self.raster.rows());
        let before = window_range(&self.raster, window);
        self.raster.replace(window, heights);
        if let Some(errors) = self.errors.get_mut() {
            errors.update(&self.raster, window);
        }
        self.ranges.edited(&self.raster, window, before);
    }

    /// Ranges and errors of patches in a row, of land without voids.
    fn patches(&self, column: usize, row: usize, ranges: &mut [HeightRange], errors: &mut [f32]) {
        let (columns, rows) = (self.raster.columns(), self.raster.rows());
        let inside = if row + 1 < rows { (columns - 1).saturating_sub(column).min(ranges.len()) } else { 0 };
        ranges[inside..].fill(HeightRange::EMPTY);
        errors[inside..].fill(0.0);
        if inside == 0 {
            return;
        }
        let south = &self.raster.heights()[row * columns + column..][..inside + 1];
        let north = &self.raster.heights()[(row + 1) * columns + column..][..inside + 1];
        let corners = south.windows(2).zip(north.windows(2));
        for ((range, error), (south, north)) in ranges.iter_mut().zip(errors).zip(corners) {
            let [a, b, c, d] = [south[0], south[1], north[0], north[1]];
            let size = a.abs().max(b.abs()).max(c.abs().max(d.abs()));
            let slack = 1e-6 * f64::from(size);
            let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
            *range = HeightRange { low: (f64::from(low) - slack) as f32, high: (f64::from(high) + slack) as f32 };
            *error = quarter_twist([a, b, c, d]);
        }
    }

    /// Errors of patches in a row, of land without voids.
    fn patch_errors(&self, column: usize, row: usize, errors: &mut [f32]) {
        let (columns, rows) = (self.raster.columns(), self.raster.rows());
        let inside = if row + 1 < rows { (columns - 1).saturating_sub(column).min(errors.len()) } else { 0 };
        let (within, beyond) = errors.split_at_mut(inside);
        beyond.fill(0.0);
        if inside > 0 {
            let line = |row: usize| &self.raster.heights()[row * columns + column..][..inside + 1];
            quarter_twists(line(row), line(row + 1), within);
        }
    }

    /// Range of the surface over a part of one patch, `from` and `to` being positions within it. Over a rectangle a
    /// bilinear function takes its extremes in the corners.
    fn part_range(&self, column: usize, row: usize, from: DVec2, to: DVec2) -> HeightRange {
        if column + 1 >= self.raster.columns() || row + 1 >= self.raster.rows() {
            return HeightRange::EMPTY;
        }
        let Some(corners) = self.corners(column, row) else { return HeightRange::EMPTY };
        let [a, b, c, d] = corners.map(f64::from);
        let at = |u: f64, v: f64| (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v;
        let ends = [at(from.x, from.y), at(to.x, from.y), at(from.x, to.y), at(to.x, to.y)];
        let (low, high) =
            (ends.into_iter().fold(f64::INFINITY, f64::min), ends.into_iter().fold(f64::NEG_INFINITY, f64::max));
        // What rounding may add to a height asked for in `f32`.
        let slack = 1e-6 * (a.abs().max(b.abs()).max(c.abs()).max(d.abs()));
        HeightRange { low: (low - slack) as f32, high: (high + slack) as f32 }
    }
}

/// The bilinear height at a position within a patch.
fn interpolate(([a, b, c, d], at): ([f32; 4], DVec2)) -> f32 {
    let (u, v) = (at.x as f32, at.y as f32);
    let south = a * (1.0 - u) + b * u;
    let north = c * (1.0 - u) + d * u;
    south * (1.0 - v) + north * v
}

impl HeightField for Land {
    fn datum(&self) -> Datum {
        Datum::Plane { origin: self.origin, size: self.raster.spacing() * f64::from(1u32 << self.finest) }
    }

    fn height(&self, at: Place) -> Option<f32> {
        // Straight in lattice units: by way of the world a place on the line between two cells would move off it.
        self.height_at_lattice(at.uv * f64::from(1u32 << self.finest))
    }

    fn range(&self, cell: Cell) -> HeightRange {
        if cell.level < self.finest {
            return self.ranges.node(u32::from(self.finest - cell.level), cell.x as usize, cell.y as usize);
        }
        let deeper = cell.level - self.finest;
        let (column, row) = ((cell.x >> deeper) as usize, (cell.y >> deeper) as usize);
        if deeper == 0 {
            return self.part_range(column, row, DVec2::ZERO, DVec2::ONE);
        }
        let mask = (1u32 << deeper) - 1;
        let step = f64::exp2(-f64::from(deeper));
        let from = DVec2::new(f64::from(cell.x & mask), f64::from(cell.y & mask)) * step;
        self.part_range(column, row, from, from + step)
    }

    fn error(&self, cell: Cell) -> f32 {
        self.errors.get_or_init(|| ErrorPyramid::build(&self.raster, self.finest)).error(&self.raster, cell)
    }

    fn row(&self, first: Cell, ranges: &mut [HeightRange], errors: &mut [f32]) {
        assert_eq!(ranges.len(), errors.len(), "expected as many ranges as errors");
        let pyramid = self.errors.get_or_init(|| ErrorPyramid::build(&self.raster, self.finest));
        if pyramid.row(first, errors) {
            self.ranges.nodes(u32::from(self.finest - first.level), first.x as usize, first.y as usize, ranges);
        } else if first.level == self.finest && !self.raster.voids().any() {
            self.patches(first.x as usize, first.y as usize, ranges, errors);
        } else {
            for (i, (range, error)) in ranges.iter_mut().zip(errors).enumerate() {
                let cell = Cell { x: first.x + i as u32, ..first };
                (*range, *error) = (self.range(cell), pyramid.error(&self.raster, cell));
            }
        }
    }

    fn errors(&self, first: Cell, columns: usize, errors: &mut [f32]) {
        let pyramid = self.errors.get_or_init(|| ErrorPyramid::build(&self.raster, self.finest));
        if pyramid.rows(first, columns, errors) {
            return;
        }
        let patches = first.level == self.finest && !self.raster.voids().any();
        for (j, errors) in errors.chunks_mut(columns).enumerate() {
            let first = Cell { y: first.y + j as u32, ..first };
            if patches {
                self.patch_errors(first.x as usize, first.y as usize, errors);
                continue;
            }
            for (i, error) in errors.iter_mut().enumerate() {
                *error = pyramid.error(&self.raster, Cell { x: first.x + i as u32, ..first });
            }
        }
    }

    fn raise(&self, face: u8, points: &[[u32; 2]], vertices: &mut Vec<Vertex>) {
        let samples = Samples {
            heights: self.raster.heights(),
            columns: self.raster.columns(),
            rows: self.raster.rows(),
            shift: u32::from(Cell::MAX_LEVEL - self.finest),
        };
        if !self.raster.voids().any() && samples.raise(face.into(), points, vertices) {
            return;
        }
        let steps = f64::exp2(-f64::from(Cell::MAX_LEVEL - self.finest));
        vertices.extend(points.iter().map(|&[x, y]| {
            let at = DVec2::new(f64::from(x), f64::from(y)) * steps;
            Vertex { x, y, face: face.into(), height: self.height_at_lattice(at).unwrap_or(f32::NAN) }
        }));
    }

    fn heights(&self, places: &[Place], heights: &mut [f32]) {
        assert_eq!(places.len(), heights.len(), "expected as many heights as places");
        let steps = f64::from(1u32 << self.finest);
        let (columns, rows) = (self.raster.columns() as u32, self.raster.rows() as u32);
        let (samples, voids) = (self.raster.heights(), self.raster.voids().any());
        for (place, height) in places.iter().zip(heights) {
            let at = place.uv * steps;
            let (column, row) = (at.x as u32, at.y as u32);
            // Vertices lie on samples: nothing to be interpolated there.
            let on_sample = f64::from(column) == at.x && f64::from(row) == at.y && column < columns && row < rows;
            *height = if on_sample && !voids {
                samples[row as usize * columns as usize + column as usize]
            } else {
                self.height(*place).unwrap_or(f32::NAN)
            };
        }
    }

    fn stencil_error(&self, cell: Cell, depth: u8) -> f32 {
        self.errors.get_or_init(|| ErrorPyramid::build(&self.raster, self.finest)).finer(&self.raster, cell, depth)
    }
}
