//! Meshes of a whole raster within a bound of error: for printers, physics, web maps and whoever eats triangles once.
//!
//! A [`Triangulation`] names samples by integers, so that whether it covers the raster exactly once, without a crack or an
//! overlap, can be decided exactly. A [`Model`] gives it places, normals, a waterline and a base.

mod base;
mod edges;
mod model;
mod shoreline;

use edges::Edges;
pub use model::{Form, Model, ModelError};

/// Triangles over samples of a raster.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Triangulation {
    /// Column and row of the sample at each vertex; rows count northward.
    pub vertices: Vec<[u32; 2]>,
    /// Three vertices each, counter-clockwise seen from above.
    pub triangles: Vec<[u32; 3]>,
}
