//! Level of detail: which triangles are worth their cost in this view.
//!
//! A method ([`Lod`]) is shown a height field and a view and fills a [`Drawing`]. All methods keep the same promises, which one suite asks of
//! each (`tests/lod`): what the view sees of the surface is covered exactly once and without cracks, no sample of it is drawn farther from its
//! place than the view tolerates, and where a limit forbids that, the bound that was reached is told. They differ in what they spend on it.
//! Voids are never bridged: what is partly void is refined until it is whole or nothing, or too small to matter, and then left out.
//!
//! A drawing has three forms. Most methods put out *patches*: affine images of one stencil, which a GPU draws as instances. Others keep a mesh of
//! their own, and one puts out *strips* of triangles. [`Drawing::expand`] turns patches and strips into triangles of the mesh, so that whoever wants those finds one
//! thing.
//!
//! Vertices are named by integers on the lattice of a face, 2³⁰ steps a side: neighbours agree to the bit, and whether a drawing is
//! watertight is decided exactly.

mod drawing;
mod method;
mod metric;
mod nested;
mod patches;
mod quadtree;
mod roam;
mod strips;
mod whole;

pub use drawing::{Drawing, Edge, Mesh, Patch, Stencil, Vertex};
pub use method::{Method, UnknownMethod};
pub use metric::{Bounds, ScreenMetric, ViewError};
pub use nested::{Nested, Seams};
pub use patches::Patches;
pub use quadtree::Quadtree;
pub use roam::{Disc, Factors, NestedBounds, Priority, Roam, RoamFlight, RoamOnce, RoamSea, TooManySamples, Waves};
pub use strips::Strips;
pub use whole::Whole;

use crate::field::HeightField;
use crate::space::View;

/// A method that chooses triangles for a view.
pub trait Lod {
    /// Overwrites `drawing` with what is to be drawn of `field` in `view`: without cracks, within `view.tolerance_pixels` at every sample that is
    /// seen, or as near to that as the method's limits allow. What lies outside the view may be left out. The same question gets the same
    /// answer. Warm calls allocate nothing.
    ///
    /// # Errors
    /// If the view is not one that a picture can be drawn of.
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError>;
}

/// What a method attained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// No sample that is seen is drawn farther from its place than this (pixels). What is partly void and was
    /// left out counts with its size.
    pub pixels: f32,
    /// Whether a limit, not the tolerance, ended the refinement.
    pub limited: bool,
}

/// Where refinement ends though the tolerance is not met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// No cell finer than this level of the quadtree is drawn: the level of the samples for sampled land.
    pub finest: u8,
    /// No more triangles than this are drawn, if the method can do with as few.
    pub triangles: usize,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { finest: crate::space::Cell::MAX_LEVEL, triangles: 4_000_000 }
    }
}
