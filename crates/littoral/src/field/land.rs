//! Land over a raster: the exact bilinear surface through its samples, with what lets others skip most of it.
//!
//! Between four samples the surface is the bilinear patch through them; a patch with a void corner does not exist. The
//! face of the land's datum is the raster padded to 2ᵏ × 2ᵏ patches, so that cells of level k are exactly the patches and
//! every cell's corners lie on samples; the padding is void and never shows.

use super::{ErrorPyramid, HeightField, HeightRange, Raster, Window};
use crate::space::{Cell, Datum, Place};
use glam::{DVec2, DVec3, Vec3};
use std::sync::OnceLock;

/// Ground known by samples: a raster placed in the world.
#[derive(Clone, Debug)]
pub struct Land {
    raster: Raster,
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
        Land { raster, origin, finest, errors: OnceLock::new() }
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
        let lattice = self.lattice(xy);
        let last = DVec2::new((self.raster.columns() - 1) as f64, (self.raster.rows() - 1) as f64);
        if !(lattice.cmpge(DVec2::ZERO).all() && lattice.cmple(last).all()) {
            return None;
        }
        let base = lattice.floor().min(last - 1.0);
        let (column, row) = (base.x as usize, base.y as usize);
        Some((self.corners(column, row)?, lattice - base))
    }

    /// The heights at the corners of the patch north-east of a sample; `None` if any is void.
    pub fn corners(&self, column: usize, row: usize) -> Option<[f32; 4]> {
        let at = |i, j| self.raster.sample(column + i, row + j);
        Some([at(0, 0)?, at(1, 0)?, at(0, 1)?, at(1, 1)?])
    }

    /// Exact height (m) of the surface below a world position (m); `None` where void or outside.
    pub fn height_at(&self, xy: DVec2) -> Option<f32> {
        let ([a, b, c, d], f) = self.patch(xy)?;
        let (u, v) = (f.x as f32, f.y as f32);
        let south = a + (b - a) * u;
        let north = c + (d - c) * u;
        Some(south + (north - south) * v)
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
        self.raster.range()
    }

    /// Replaces the samples of `window` (row by row from the south; not finite = void) and rebuilds only what depends on
    /// them.
    ///
    /// # Panics
    /// If the window leaves the raster or the number of heights is not its size.
    pub fn edit(&mut self, window: Window, heights: &[f32]) {
        self.raster.replace(window, heights);
        if let Some(errors) = self.errors.get_mut() {
            errors.update(&self.raster, window);
        }
    }
}

impl HeightField for Land {
    fn datum(&self) -> Datum {
        Datum::Plane { origin: self.origin, size: self.raster.spacing() * f64::from(1u32 << self.finest) }
    }

    fn height(&self, at: Place) -> Option<f32> {
        let count = f64::from(1u32 << self.finest);
        self.height_at(self.origin + at.uv * count * self.raster.spacing())
    }

    fn range(&self, _cell: Cell) -> HeightRange {
        self.raster.range()
    }

    fn error(&self, cell: Cell) -> f32 {
        self.errors.get_or_init(|| ErrorPyramid::build(&self.raster, self.finest)).error(&self.raster, cell)
    }
}
