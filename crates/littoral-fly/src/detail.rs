//! A method of detail, and its settings.

use crate::settings::{Show, Style};
use littoral::lod::Method;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// A method of detail, and how finely it draws.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Detail {
    /// How triangles are chosen.
    #[serde(with = "by_name")]
    pub method: Method,
    /// How far from its place the mesh may be drawn (pixels).
    pub tolerance_pixels: f64,
    /// The most triangles of the ground, and as many of the sea.
    pub triangles: u32,
    /// Whether lit pictures show the exact ground by rays in place of the mesh.
    pub rays: bool,
    /// So many levels of the quadtree, from the samples' on, are not drawn: 1 for cells of two samples' spacings.
    pub coarser: u8,
    /// Whether the quadtree's vertices move before they vanish.
    pub morphs: bool,
    /// Whether those of nested grids do, at the borders of windows, in place of upright strips.
    pub morphing_seams: bool,
    /// So many windows of nested grids, whatever the tolerance; 0 for as many as that asks for.
    pub windows: u8,
    /// Cells along their sides: at least so many.
    pub window_cells: u32,
    /// Of ROAM.
    pub roam: Roam,
}

/// What decides over ROAM's triangles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Roam {
    /// Whether what is nearest comes first, whatever its shape, not what is drawn farthest from its place.
    pub nearest_first: bool,
    /// Whether what lies in the haze matters less.
    pub fog: bool,
    /// What faces away from the eye counts so much, from 0 to 1.
    pub back_faces: f64,
    /// What may be a silhouette counts so much, from 1.
    pub silhouettes: f64,
    /// How much more what is lit unevenly counts, from 0.
    pub lighting: f64,
    /// How long a change of the mesh may take (ms), after which it goes on with the next picture; 0 for as long as it takes.
    pub milliseconds: f64,
}

impl Roam {
    /// Whether anything counts more or less than its error.
    pub fn weighs(&self) -> bool {
        let Roam { fog, back_faces, silhouettes, lighting, .. } = *self;
        fog || (back_faces, silhouettes, lighting) != (1.0, 1.0, 0.0)
    }
}

impl Default for Roam {
    fn default() -> Roam {
        Roam { nearest_first: false, fog: false, back_faces: 1.0, silhouettes: 1.0, lighting: 0.0, milliseconds: 0.0 }
    }
}

impl Detail {
    /// What its pictures are called in a style.
    pub fn name(&self, style: Style, show: Show) -> &'static str {
        if self.shows_rays(style, show) { "rays" } else { self.method.name() }
    }

    /// Whether pictures of a style show the ground by rays: edges belong to triangles.
    pub fn shows_rays(&self, style: Style, show: Show) -> bool {
        self.rays && style != Style::Plain && show == Show::Textured
    }

    /// What its bound over land is counted in: pixels, unless ROAM counts something else.
    pub fn unit(&self) -> &'static str {
        match (self.method, self.roam.nearest_first, self.roam.weighs()) {
            (Method::Roam, true, _) => "/m",
            (Method::Roam, false, true) => "px, weighed",
            _ => "px",
        }
    }

    /// Puts right what is out of range, and tells what was.
    pub fn put_right(&mut self, name: &str, wrong: &mut Vec<String>) {
        let usual = Detail::default();
        let Detail { tolerance_pixels, triangles, coarser, windows, window_cells, roam, .. } = self;
        let mut number = |of: &str, value: &mut f64, usual: f64, low: f64, high: f64| {
            within(&format!("{name}.{of}"), value, usual, low..=high, wrong);
        };
        number("tolerance_pixels", tolerance_pixels, usual.tolerance_pixels, 0.05, 100.0);
        number("roam.back_faces", &mut roam.back_faces, usual.roam.back_faces, 0.0, 1.0);
        number("roam.silhouettes", &mut roam.silhouettes, usual.roam.silhouettes, 1.0, 100.0);
        number("roam.lighting", &mut roam.lighting, usual.roam.lighting, 0.0, 100.0);
        number("roam.milliseconds", &mut roam.milliseconds, usual.roam.milliseconds, 0.0, 10_000.0);
        within(&format!("{name}.triangles"), triangles, usual.triangles, 1000..=20_000_000, wrong);
        within(&format!("{name}.coarser"), coarser, usual.coarser, 0..=30, wrong);
        within(&format!("{name}.windows"), windows, usual.windows, 0..=16, wrong);
        within(&format!("{name}.window_cells"), window_cells, usual.window_cells, 4..=512, wrong);
    }

    /// Whether a mesh for another one goes on as a mesh for this one: only how finely, and how long, may differ.
    pub fn goes_on(&self, other: &Detail) -> bool {
        let roam = Roam { milliseconds: other.roam.milliseconds, ..self.roam };
        Detail { tolerance_pixels: other.tolerance_pixels, rays: other.rays, roam, ..*self } == *other
    }
}

impl Default for Detail {
    fn default() -> Detail {
        Detail {
            method: Method::Quadtree,
            tolerance_pixels: 1.0,
            triangles: 150_000,
            rays: false,
            coarser: 0,
            morphs: true,
            morphing_seams: false,
            windows: 0,
            window_cells: 32,
            roam: Roam::default(),
        }
    }
}

/// Takes what is usual for a value that is out of range, and tells which was.
pub fn within<T: PartialOrd>(name: &str, value: &mut T, usual: T, range: RangeInclusive<T>, wrong: &mut Vec<String>) {
    if !range.contains(value) {
        *value = usual;
        wrong.push(name.to_owned());
    }
}

/// Methods are saved by their names.
mod by_name {
    use littoral::lod::Method;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(method: &Method, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(method.name())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Method, D::Error> {
        String::deserialize(from)?.parse().map_err(D::Error::custom)
    }
}
