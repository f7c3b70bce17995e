//! How steep the ground is, and which way it falls: exact derivatives of the bilinear surface.

use crate::field::Land;
use glam::DVec2;
use std::f64::consts::TAU;

impl Land {
    /// Rise of the surface per metre eastward and northward at a world position (m); `None` where void or outside. On the
    /// border between patches, where the surface has a crease, that of the patch to the north-east (on the northern and
    /// eastern edge of the land: of the last patch).
    pub fn gradient_at(&self, xy: DVec2) -> Option<DVec2> {
        let lattice = self.lattice_of(xy)?;
        let raster = self.raster();
        let last = DVec2::new((raster.columns() - 2) as f64, (raster.rows() - 2) as f64);
        let base = lattice.floor().min(last);
        let [a, b, c, d] = self.corners(base.x as usize, base.y as usize)?.map(f64::from);
        let f = lattice - base;
        let per_sample = DVec2::new((b - a) * (1.0 - f.y) + (d - c) * f.y, (c - a) * (1.0 - f.x) + (d - b) * f.x);
        Some(per_sample / raster.spacing())
    }

    /// Steepness of the surface at a world position (m): the angle (rad) between it and the level, in [0, π/2). `None`
    /// where void or outside; on creases as [`Land::gradient_at`].
    pub fn slope_at(&self, xy: DVec2) -> Option<f64> {
        self.gradient_at(xy).map(|gradient| gradient.length().atan())
    }

    /// The direction in which the surface falls most steeply at a world position (m): the bearing (rad), clockwise from
    /// north, in [0, 2π). `None` where the surface is level, void or outside; on creases as [`Land::gradient_at`].
    pub fn aspect_at(&self, xy: DVec2) -> Option<f64> {
        let downhill = -self.gradient_at(xy)?;
        let bearing = downhill.x.atan2(downhill.y).rem_euclid(TAU);
        (downhill != DVec2::ZERO).then_some(if bearing < TAU { bearing } else { 0.0 })
    }
}
