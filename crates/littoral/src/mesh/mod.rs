//! Meshes of a whole raster within a bound of error: for printers, physics, web maps and whoever eats triangles once.
//!
//! A [`Triangulation`] names samples by integers, so that whether it covers the raster exactly once, without a crack or an
//! overlap, can be decided exactly. A [`Model`] gives it places, normals, a waterline and a base.

mod base;
mod edges;
mod model;
mod pieces;
mod shoreline;

use edges::Edges;
pub use model::{Form, Model, ModelError};
pub use pieces::Pieces;

pub mod measure;
pub mod rtin;
pub mod tiled;
pub mod tin;

/// Triangles over samples of a raster.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Triangulation {
    /// Column and row of the sample at each vertex; rows count northward.
    pub vertices: Vec<[u32; 2]>,
    /// Three vertices each, counter-clockwise seen from above.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangulation {
    /// Column and row of the corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: [u32; 3]) -> [[u32; 2]; 3] {
        triangle.map(|vertex| self.vertices[vertex as usize])
    }
}

/// Why there is no mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The greatest error asked for is no distance.
    #[error("expected a greatest error of 0 or more (m), got {0}")]
    Tolerance(f32),
    /// What was prepared for one raster does not fit another.
    #[error("expected the raster of {expected:?} samples that this was prepared for, got one of {got:?}")]
    OtherRaster {
        /// Columns and rows it was prepared for.
        expected: [usize; 2],
        /// Columns and rows given.
        got: [usize; 2],
    },
    /// A raster of fewer than two samples a side, or tiles whose side is no power of two.
    #[error("expected a raster of at least 2 samples a side and tiles of 2, 4, 8, … patches, got {size:?} and {side}")]
    Tiles {
        /// Samples of the raster.
        size: [usize; 2],
        /// Patches along the side of a tile.
        side: usize,
    },
    /// Vertices are numbered with 32 bits.
    #[error("expected at most 2³² − 1 vertices; ask for a greater error or for a part of the raster")]
    TooMany,
    /// Whoever was told of the progress said to stop.
    #[error("stopped when asked to")]
    Stopped,
}

/// A greatest error (m) that can be kept.
pub(crate) fn tolerance(max_error: f32) -> Result<f32, MeshError> {
    // No raster differs by more from anything than what is the greatest number.
    if max_error >= 0.0 { Ok(max_error.min(f32::MAX)) } else { Err(MeshError::Tolerance(max_error)) }
}

impl Triangulation {
    /// Takes away vertices that no triangle names; `names` is scratch.
    pub(crate) fn drop_unused(&mut self, names: &mut Vec<u32>) {
        names.clear();
        names.resize(self.vertices.len(), u32::MAX);
        self.triangles.iter().flatten().for_each(|&vertex| names[vertex as usize] = 0);
        let mut kept = 0;
        for (name, vertex) in names.iter_mut().zip(0..) {
            if *name == 0 {
                *name = kept;
                self.vertices[kept as usize] = self.vertices[vertex as usize];
                kept += 1;
            }
        }
        self.vertices.truncate(kept as usize);
        self.triangles.iter_mut().flatten().for_each(|vertex| *vertex = names[*vertex as usize]);
    }
}
