//! What has a height: the [`HeightField`] trait and those who implement it.
//!
//! Everything downstream — meshes, rays, pictures — asks a height field two things about a square of surface: how low and
//! high it reaches, and how wrong a coarse drawing of it would be.

mod blocks;
pub mod coast;
mod deviation;
mod lakes;
mod land;
mod lattice;
pub mod noise;
mod pyramid;
mod raster;
mod sea;
mod water;
mod windows;

pub(crate) use blocks::{BLOCK_LEVELS, Block};
pub use deviation::ErrorPyramid;
pub use lakes::{Filled, InLake, LakeError, Lakes, Outlet};
pub use land::Land;
pub use lattice::Vertex;
pub use pyramid::RangePyramid;
pub use raster::{Raster, RasterError, VoidMask, Window};
pub use sea::{Finest, Sea, Surface};
pub use water::{Beach, Water};
pub(crate) use windows::FINEST_WINDOWS;

use crate::space::{Cell, Datum, Place};
use glam::DVec2;

/// The lowest and the highest height of something (m). Empty when `low > high`: there is no surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightRange {
    /// Nothing is lower (m).
    pub low: f32,
    /// Nothing is higher (m).
    pub high: f32,
}

impl HeightRange {
    /// The range of nothing: the neutral element of [`HeightRange::union`].
    pub const EMPTY: HeightRange = HeightRange { low: f32::INFINITY, high: f32::NEG_INFINITY };

    /// Whether there is no surface at all.
    pub fn is_empty(self) -> bool {
        self.low > self.high
    }

    /// The smallest range that holds both.
    pub fn union(self, other: HeightRange) -> HeightRange {
        HeightRange { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Whether `height` lies within.
    pub fn contains(self, height: f32) -> bool {
        self.low <= height && height <= self.high
    }
}

/// Heights (m) above a datum. Land is one; the sea, frozen at an instant, is another.
///
/// A field is a continuous surface except where it is *void*: unknown or absent. Voids are never bridged.
pub trait HeightField: Sync {
    /// What the heights are counted from.
    fn datum(&self) -> Datum;

    /// The height at a place (m); `None` where the field is void.
    fn height(&self, at: Place) -> Option<f32>;

    /// Lowest and highest height of the surface over `cell`, up to its border; empty where it is all void. May be loose,
    /// never too tight: culling and rays trust it.
    fn range(&self, cell: Cell) -> HeightRange;

    /// Greatest vertical distance (m) from the surface to `cell` drawn as two triangles over its corners, whichever
    /// diagonal is taken. Never below its children's: the bound that every LOD rests on. Infinite for a cell that is
    /// partly void, since no drawing of it is right; zero where there is no surface.
    fn error(&self, cell: Cell) -> f32;

    /// Greatest error of the cells `depth` levels below `cell`: how wrong it is drawn in 2^`depth` × 2^`depth` cells. No deeper than
    /// [`Cell::MAX_LEVEL`]. Overridden where bulk is faster.
    fn stencil_error(&self, cell: Cell, depth: u8) -> f32 {
        if depth == 0 || cell.level == Cell::MAX_LEVEL {
            return self.error(cell);
        }
        cell.children().into_iter().fold(0.0, |most, child| self.stencil_error(child, depth - 1).max(most))
    }

    /// Ranges and errors of cells in a row, `first` being the westernmost. Overridden where bulk is faster.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn row(&self, first: Cell, ranges: &mut [HeightRange], errors: &mut [f32]) {
        assert_eq!(ranges.len(), errors.len(), "expected as many ranges as errors");
        for (i, (range, error)) in ranges.iter_mut().zip(errors).enumerate() {
            let cell = Cell { x: first.x + i as u32, ..first };
            (*range, *error) = (self.range(cell), self.error(cell));
        }
    }

    /// Errors of cells in rows of so many `columns`, `first` being the south-western one, row by row northward. Overridden where bulk is faster.
    ///
    /// # Panics
    /// If `columns` is 0.
    fn errors(&self, first: Cell, columns: usize, errors: &mut [f32]) {
        for (j, row) in errors.chunks_mut(columns).enumerate() {
            for (i, error) in row.iter_mut().enumerate() {
                *error = self.error(Cell { x: first.x + i as u32, y: first.y + j as u32, ..first });
            }
        }
    }

    /// `side` × `side` heights over `cell`, its borders included, row by row from the south-west; NaN where void.
    ///
    /// # Panics
    /// If `side < 2` or `heights` does not hold `side * side` numbers.
    fn fill(&self, cell: Cell, side: usize, heights: &mut [f32]) {
        assert!(side >= 2, "expected at least 2 samples a side, got {side}");
        assert_eq!(heights.len(), side * side, "expected room for {side} × {side} heights");
        let (corner, step) = (cell.low_corner(), cell.side() / (side - 1) as f64);
        for (row, line) in heights.chunks_exact_mut(side).enumerate() {
            for (column, height) in line.iter_mut().enumerate() {
                let uv = corner.uv + DVec2::new(column as f64, row as f64) * step;
                *height = self.height(Place { uv, ..corner }).unwrap_or(f32::NAN);
            }
        }
    }

    /// Heights at many places at once; NaN where void. Overridden where bulk is faster.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn heights(&self, places: &[Place], heights: &mut [f32]) {
        assert_eq!(places.len(), heights.len(), "expected as many heights as places");
        for (place, height) in places.iter().zip(heights) {
            *height = self.height(*place).unwrap_or(f32::NAN);
        }
    }

    /// Adds vertices at points of a face's lattice, 2³⁰ steps a side, with the heights there. Overridden where bulk is faster.
    fn raise(&self, face: u8, points: &[[u32; 2]], vertices: &mut Vec<Vertex>) {
        // The same points come again, as strips have their neighbours' vertices, and heights are dear: the last ones are remembered.
        const SOME: usize = 64;
        const SLOTS: usize = 1024;
        let mut seen = [([u32::MAX; 2], 0); SLOTS];
        let (mut places, mut heights) = ([Place { face, uv: DVec2::ZERO }; SOME], [0.0; SOME]);
        let (mut asked, mut again) = ([0; SOME], [(0, 0); SOME]);
        let step = f64::exp2(-f64::from(Cell::MAX_LEVEL));
        for points in points.chunks(SOME) {
            let (mut new, mut known) = (0, 0);
            for &[x, y] in points {
                let at = vertices.len();
                vertices.push(Vertex { x, y, face: face.into(), height: f32::NAN });
                let key = (u64::from(x) << 32 | u64::from(y)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                let slot = &mut seen[(key >> 54) as usize % SLOTS];
                if slot.0 == [x, y] {
                    again[known] = (at, slot.1);
                    known += 1;
                    continue;
                }
                *slot = ([x, y], at);
                places[new].uv = DVec2::new(f64::from(x), f64::from(y)) * step;
                asked[new] = at;
                new += 1;
            }
            self.heights(&places[..new], &mut heights[..new]);
            asked[..new].iter().zip(&heights).for_each(|(&at, &height)| vertices[at].height = height);
            again[..known].iter().for_each(|&(at, before)| vertices[at].height = vertices[before].height);
        }
    }
}
