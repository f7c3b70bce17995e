//! Pictures of meshes: which method of detail, how fine, and what it drew.

use crate::input;
use crate::render::Render;
use crate::subject::Subject;
use crate::talk::{Failure, Talk, tidy};
use clap::ValueEnum;
use glam::DVec3;
use littoral::field::{HeightField, Sea};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Nested, Patches, Quadtree, Reached, Roam, Strips, Whole};
use littoral::space::View;
use std::time::Instant;

/// How a mesh is chosen.
#[derive(clap::Args, Clone, Debug)]
pub struct Detail {
    /// Draw a mesh that this method of detail chooses, instead of the exact surface; the same light falls on it
    #[arg(long, value_enum, value_name = "METHOD", conflicts_with = "path", help_heading = "Mesh")]
    pub lod: Option<Method>,
    /// How far from its place the mesh may be drawn, in pixels
    #[arg(long, value_name = "PIXELS", value_parser = input::tolerance, default_value = "1", requires = "lod", help_heading = "Mesh")]
    pub tolerance: f64,
    /// The most triangles of the ground, and as many of the sea; where they do not do, the tolerance gives way
    #[arg(long, value_name = "N", default_value = "2000000", value_parser = clap::value_parser!(u32).range(1..=50_000_000), requires = "lod", help_heading = "Mesh")]
    pub triangles: u32,
    /// Draw the mesh's edges, too
    #[arg(long, requires = "lod", help_heading = "Mesh")]
    pub wireframe: bool,
    /// Choose the mesh for an eye at this place that looks at the same point, and look at it from --eye
    #[arg(long, value_name = "X,Y,Z", value_parser = input::xyz, requires = "lod", help_heading = "Mesh")]
    pub lod_from: Option<DVec3>,
}

/// A method of detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Everything equally fine: what the others are measured by
    Whole,
    /// Nested square windows, joined by upright strips: for seas
    Nested,
    /// A restricted quadtree whose patches morph
    Quadtree,
    /// Triangles cut level by level, edges deciding
    Patches,
    /// Strips along rows whose cells change size on the way
    Strips,
    /// A bintree of right triangles, the worst split first
    Roam,
}

impl Method {
    /// The method within limits.
    pub fn within(self, limits: Limits) -> Box<dyn Lod> {
        match self {
            Method::Whole => Box::new(Whole::new(limits)),
            Method::Nested => Box::new(Nested::new(limits)),
            Method::Quadtree => Box::new(Quadtree::new(limits)),
            Method::Patches => Box::new(Patches::new(limits)),
            Method::Strips => Box::new(Strips::new(limits)),
            Method::Roam => Box::new(Roam::new(limits)),
        }
    }
}

/// What was drawn.
pub struct Chosen {
    /// The ground.
    pub ground: Mesh,
    /// The sea, if there is one.
    pub water: Option<Mesh>,
    /// What is told about it.
    pub told: Told,
}

/// What is told about a mesh.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Told {
    /// Triangles of ground and sea.
    pub triangles: usize,
    /// No point that is seen is farther from its place than this (pixels).
    pub bound_pixels: f32,
    /// Whether the number of triangles, not the tolerance, ended the refinement.
    pub limited: bool,
    /// How long the choice took, without heights and picture.
    pub select_seconds: f64,
}

impl Detail {
    /// The meshes for a view, if any are wanted.
    pub fn choose(
        &self,
        ground: &littoral::field::Land,
        sea: Option<&Sea>,
        view: &View,
    ) -> Result<Option<Chosen>, Failure> {
        let Some(method) = self.lod else { return Ok(None) };
        let view = View { tolerance_pixels: self.tolerance as f32, ..*view };
        let mut told = Told { triangles: 0, bound_pixels: 0.0, limited: false, select_seconds: 0.0 };
        let mut choose = |field: &dyn HeightField, finest: u8| -> Result<Mesh, Failure> {
            let limits = Limits { finest, triangles: self.triangles as usize };
            let mut drawing = Drawing::default();
            let started = Instant::now();
            let Reached { pixels, limited } = method
                .within(limits)
                .select(field, &view, &mut drawing)
                .map_err(|e| Failure::Work(format!("--lod: {e}")))?;
            told.select_seconds += started.elapsed().as_secs_f64();
            drawing.expand(field);
            told.triangles += drawing.mesh.triangles.len();
            told.bound_pixels = told.bound_pixels.max(pixels);
            told.limited |= limited;
            Ok(drawing.mesh)
        };
        let ground = choose(ground, ground.finest_level())?;
        let water = match sea {
            Some(sea) => {
                // No cell of water is smaller than this (m).
                const SMALLEST: f64 = 0.25;
                let littoral::space::Datum::Plane { size, .. } = sea.datum() else {
                    return Err(Failure::Work("expected a sea on a plane, got one on an ellipsoid".into()));
                };
                Some(choose(sea, (size.max_element() / SMALLEST).log2().ceil().clamp(0.0, 30.0) as u8)?)
            }
            None => None,
        };
        Ok(Some(Chosen { ground, water, told }))
    }

    /// The view that the mesh is chosen for: the picture's, or another eye's on the same point.
    pub fn view(
        &self,
        render: &Render,
        subject: &Subject,
        view: &View,
        look: DVec3,
        talk: &mut Talk,
    ) -> Result<View, Failure> {
        let Some(from) = self.lod_from else { return Ok(*view) };
        let eye = render.eye_position(subject, from, talk)?;
        let field = 2.0 * (0.5 * view.size.y as f32 / view.pixels_per_radian).atan();
        Ok(View::looking_at(eye, look, field, view.size))
    }
}

impl Told {
    /// For people.
    pub fn line(&self) -> String {
        let limited = if self.limited { ", the most allowed" } else { "" };
        format!("; {} triangles{limited}, within {} pixels", self.triangles, tidy(f64::from(self.bound_pixels), 2))
    }
}
