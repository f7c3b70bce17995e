//! Meshes for other programs: PLY, OBJ, STL and GLB.
//!
//! PLY and OBJ hold coordinates in full. STL and GLB hold single precision, in which a coordinate of five million metres
//! is good to half a metre: there coordinates count from an origin near the model wherever they would lose digits. GLB
//! tells it in a way that puts the model back in its place (a node's translation), STL in its header; [`mesh`] answers
//! with it.

mod glb;
mod obj;
mod ply;
mod stl;

pub(super) use glb::begin as begin_glb;

use super::whole;
use crate::Error;
use glam::{DVec2, DVec3};
use littoral::mesh::Model;
use std::path::Path;

/// A format of meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Polygon File Format, binary: coordinates in double precision, the waterline as edges.
    Ply,
    /// Wavefront OBJ: text, the waterline as lines.
    Obj,
    /// Stereolithography, binary: bare triangles.
    Stl,
    /// glTF 2.0 in one file: y up, as that standard has it, the waterline as lines.
    Glb,
}

impl MeshFormat {
    /// By the ending of a file's name.
    pub fn of_name(file: &Path) -> Option<MeshFormat> {
        match file.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "ply" => Some(MeshFormat::Ply),
            "obj" => Some(MeshFormat::Obj),
            "stl" => Some(MeshFormat::Stl),
            "glb" => Some(MeshFormat::Glb),
            _ => None,
        }
    }

    /// The place that this format's coordinates of a model count from: zero but for STL and GLB.
    pub fn origin(self, model: &Model) -> DVec3 {
        match self {
            MeshFormat::Ply | MeshFormat::Obj => DVec3::ZERO,
            MeshFormat::Stl | MeshFormat::Glb => origin_nearby(model),
        }
    }

    /// Whether a mesh of this size can be told in this format.
    ///
    /// # Errors
    /// A sentence that says what the format allows and what to do.
    pub fn fits(self, vertices: usize, triangles: usize, lines: usize) -> Result<(), String> {
        let (name, most, got) = match self {
            MeshFormat::Ply => ("vertices in a PLY file", i32::MAX as u64, vertices as u64),
            MeshFormat::Obj => return Ok(()),
            MeshFormat::Stl => ("triangles in an STL file", u64::from(u32::MAX), triangles as u64),
            MeshFormat::Glb => ("bytes in a GLB file", u64::from(u32::MAX), glb::length(vertices, triangles, lines)),
        };
        if got <= most {
            return Ok(());
        }
        let other = if self == MeshFormat::Ply { ".obj" } else { ".ply" };
        Err(format!("expected at most {most} {name}, got {got}; write {other}, allow a larger error or take a part"))
    }
}

/// Zero, or for coordinates that lie far from it a round place in the middle of the model.
fn origin_nearby(model: &Model) -> DVec3 {
    let (low, high) = model.bounds();
    let (low, high) = (low.truncate(), high.truncate());
    let extent = (high - low).max_element();
    let farthest = low.abs().max(high.abs()).max_element();
    if extent.is_nan() || extent <= 0.0 || farthest <= 2.0 * extent {
        return DVec3::ZERO;
    }
    // Round to a hundredth of the extent's power of ten; by its inverse where that is a whole number.
    let digits = 2 - extent.log10().floor() as i32;
    let rounded = |x: f64| match digits {
        0.. => (x * 10f64.powi(digits)).round() / 10f64.powi(digits),
        _ => (x / 10f64.powi(-digits)).round() * 10f64.powi(-digits),
    };
    let middle = 0.5 * (low + high);
    DVec2::new(rounded(middle.x), rounded(middle.y)).extend(0.0)
}

/// Writes a model. `notes`, a name and what there is to say about it each, are kept in the file where the format has a
/// place for them. Answers with the place that the file's coordinates count from: [`MeshFormat::origin`].
///
/// # Errors
/// If the system refuses, or the mesh is too large for the format; then no file is begun.
pub fn mesh(file: &Path, format: MeshFormat, model: &Model, notes: &[(&str, String)]) -> Result<DVec3, Error> {
    format
        .fits(model.positions.len(), model.triangles.len(), model.shoreline.len())
        .map_err(|problem| Error::content(file, problem))?;
    let origin = format.origin(model);
    whole(file, |sink| match format {
        MeshFormat::Ply => ply::write(sink, model, notes),
        MeshFormat::Obj => obj::write(sink, model, notes),
        MeshFormat::Stl => stl::write(sink, model, origin),
        MeshFormat::Glb => glb::write(sink, model, origin, notes),
    })?;
    Ok(origin)
}

/// A note on one line: file names may hold anything.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Whether every vertex has a normal: a base's have none, and half of them would be worse than none.
fn all_normals(model: &Model) -> bool {
    model.normals.len() == model.positions.len()
}

#[cfg(test)]
mod tests;
