//! A land as the `f32` kernels see it: flat arrays, lattice units, positions counted from the cell below an anchor.

use crate::field::Land;
use glam::{DVec3, Vec2};

/// Everything a kernel reads. Horizontal positions are in units of samples from the anchor's cell, heights in metres.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a> {
    pub heights: &'a [f32],
    pub columns: i32,
    /// One bit a sample, empty if none is void.
    pub voids: &'a [u64],
    pub lows: &'a [u16],
    pub highs: &'a [u16],
    /// Where level n begins, and nodes in its rows; level 0 is not stored.
    pub offsets: [i32; 16],
    pub strides: [i32; 16],
    /// Coarsest level that rays use.
    pub top: i32,
    pub step: f32,
    pub per_step: f32,
    /// Height of step 0, a hair further out than the pyramid's own, for what kernels round away.
    pub low_base: f32,
    pub high_base: f32,
    /// Patches along x and y, and the power of two that both fit into.
    pub cells: [i32; 2],
    pub side: i32,
    /// The anchor's cell, the anchor's position from its corner, and lattice units per metre.
    pub cell: [i32; 2],
    pub offset: Vec2,
    pub per_metre: Vec2,
    /// Height of the anchor (m).
    pub height: f32,
    /// No surface is lower or higher (m).
    pub low: f32,
    pub high: f32,
}

impl<'a> Scene<'a> {
    /// `None` if there is no surface, if the anchor is not finite, or if the raster has too many samples for 32-bit
    /// indices (2³¹); such lands are left to the `f64` walk.
    pub fn new(land: &'a Land, anchor: DVec3) -> Option<Scene<'a>> {
        let (raster, ranges, range) = (land.raster(), land.ranges(), land.height_range());
        if range.is_empty() || !anchor.is_finite() || raster.heights().len() > i32::MAX as usize {
            return None;
        }
        let side = 1i32 << land.finest_level();
        let position = (anchor.truncate() - land.origin()) / raster.spacing();
        let cell =
            position.floor().clamp(glam::DVec2::splat(-f64::from(side)), glam::DVec2::splat(2.0 * f64::from(side)));
        let (mut offsets, mut strides) = ([0; 16], [0; 16]);
        for (n, level) in ranges.levels.iter().enumerate().take(15) {
            (offsets[n + 1], strides[n + 1]) = (level.offset as i32, level.columns as i32);
        }
        let hair = 1e-6 * range.low.abs().max(range.high.abs());
        Some(Scene {
            heights: raster.heights(),
            columns: raster.columns() as i32,
            voids: if raster.voids().any() { raster.voids().words() } else { &[] },
            lows: &ranges.lows,
            highs: &ranges.highs,
            offsets,
            strides,
            top: ranges.top().min(15) as i32,
            step: ranges.step,
            per_step: 1.0 / ranges.step,
            low_base: ranges.base - hair,
            high_base: ranges.base + hair,
            cells: [raster.columns() as i32 - 1, raster.rows() as i32 - 1],
            side,
            cell: [cell.x as i32, cell.y as i32],
            offset: (position - cell).as_vec2(),
            per_metre: (1.0 / raster.spacing()).as_vec2(),
            height: anchor.z as f32,
            low: range.low - hair - 1e-3,
            high: range.high + hair + 1e-3,
        })
    }

    /// Whether a patch has a void corner.
    #[inline]
    pub fn is_void(&self, column: i32, row: i32) -> bool {
        let at = |i: i32, j: i32| {
            let index = (row + j) as usize * self.columns as usize + (column + i) as usize;
            self.voids[index >> 6] >> (index & 63) & 1 == 1
        };
        !self.voids.is_empty() && (at(0, 0) || at(1, 0) || at(0, 1) || at(1, 1))
    }
}
