//! A mesh as it leaves the engine: places, normals, a waterline kept as edges, a base to stand on.
//!
//! A [`Triangulation`] names samples; a [`Model`] has coordinates. In between, in this order: the waterline is cut in
//! ([`Form::shoreline`]), which changes no height anywhere; the mesh is closed by walls and a bottom ([`Form::base`]);
//! heights are stretched; and columns and rows become the coordinates that are wanted ([`Form::place`]), last of all, so that
//! everything before is decided on the lattice of the samples.

use super::{Edges, Pieces, Triangulation};
use crate::field::{Raster, Window};
use glam::{DVec2, DVec3, Vec3};

/// Triangles in space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Where each vertex is: x and y as [`Form::place`] says, z the height (m, stretched). Those of the ground come first.
    pub positions: Vec<DVec3>,
    /// Unit normals of the ground's vertices, from all samples round them rather than from the triangles, however few
    /// these are. A base has none: its edges are sharp.
    pub normals: Vec<Vec3>,
    /// Three vertices each, counter-clockwise seen from outside, those of the ground first.
    pub triangles: Vec<[u32; 3]>,
    /// How many triangles are ground; the others are the walls and the bottom of a base.
    pub ground_triangles: usize,
    /// The waterline: edges of triangles, with higher ground on their left, one after the other along each line.
    pub shoreline: Vec<[u32; 2]>,
}

/// What becomes of a triangulation.
#[derive(Clone, Copy)]
pub struct Form<'a> {
    /// Keep the line of this height (m) as edges of the mesh.
    pub shoreline: Option<f64>,
    /// Close the mesh by walls down to a flat bottom at this height (m).
    pub base: Option<f64>,
    /// By how much heights are stretched; those above are given unstretched.
    pub exaggeration: f64,
    /// x and y from column and row, which need not be whole numbers and count from the south-western sample.
    pub place: &'a (dyn Fn(DVec2) -> DVec2 + Sync),
    /// By how much (rad) [`Form::place`] turns directions, counter-clockwise: normals are turned along.
    pub turn: f64,
}

/// Why there is no model.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The base is not below all ground.
    #[error("expected a base below the lowest ground, {lowest} m, got {base} m; choose a lower one")]
    Base {
        /// Height asked for (m).
        base: f64,
        /// Height of the lowest vertex (m).
        lowest: f64,
    },
    /// More vertices or triangles than indices can name.
    #[error("expected at most {} vertices and triangles, got more; allow a larger error or take a part", u32::MAX)]
    TooLarge,
    /// There is nothing to make a model of.
    #[error("expected ground, got none: no four neighbouring samples are all known; choose another part")]
    Empty,
}

impl Model {
    /// A triangulation of a raster, given places. [`Pieces`] does the same for tiles of a larger one.
    ///
    /// With a base the model is closed: each edge lies between two triangles that run through it in opposite directions.
    /// Where voids touch in a single sample, that sample is pulled apart by a hundredth of a cell, so that this is
    /// so for programs, too, that know vertices by their places.
    ///
    /// # Errors
    /// If the base is not below the ground, or there is too much of it, or none.
    pub fn new(triangulation: &Triangulation, raster: &Raster, form: &Form) -> Result<Model, ModelError> {
        let window = Window { column: 0, row: 0, columns: raster.columns(), rows: raster.rows() };
        let mut pieces = Pieces::new(form.shoreline);
        pieces.add(triangulation, window, raster, [0, 0])?;
        pieces.finish(form)
    }

    /// Whether each edge lies between exactly two triangles that run through it in opposite directions.
    pub fn is_closed(&self) -> bool {
        let edges = Edges::new(self.positions.len(), &self.triangles);
        (0..self.positions.len() as u32).all(|from| {
            let out = edges.from(from);
            let once = |to: u32| out.iter().filter(|edge| edge[0] == to).count() == 1;
            out.iter().all(|edge| once(edge[0]) && edges.left_of(edge[0], from).is_some())
        })
    }

    /// The volume within a closed model, in its units.
    pub fn volume(&self) -> f64 {
        // Six times the volume of the tetrahedra over all triangles; from a point nearby, which keeps the digits.
        let near = self.positions.first().copied().unwrap_or_default();
        let at = |vertex: u32| self.positions[vertex as usize] - near;
        self.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c)))).sum::<f64>() / 6.0
    }

    /// Lowest and highest coordinates.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (low, high) = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
        self.positions.iter().fold((low, high), |(low, high), at| (low.min(*at), high.max(*at)))
    }
}
