//! A method at work over one land, frame after frame.

use crate::detail::Detail;
use littoral::field::{HeightField, Land, Sea};
use littoral::lod::{
    Drawing, Factors, Limits, Lod, Mesh, Method, Nested, NestedBounds, Priority, Quadtree, Reached, RoamFlight, Seams,
    ViewError,
};
use littoral::space::{Datum, View};
use std::cell::OnceCell;
use std::time::{Duration, Instant};

/// What ROAM needs of a land to go on from frame to frame, made when it is first wanted; nothing if the land is too large.
#[derive(Default)]
pub struct Prepared {
    bounds: OnceCell<Option<NestedBounds>>,
    /// With slopes, which some factors ask for.
    sloped: OnceCell<Option<NestedBounds>>,
}

impl Prepared {
    /// Whether a method can begin at once.
    pub fn is_for(&self, detail: &Detail) -> bool {
        let bounds = if detail.roam.weighs() { &self.sloped } else { &self.bounds };
        detail.method != Method::Roam || bounds.get().is_some()
    }

    fn bounds(&self, land: &Land, detail: &Detail) -> Option<&NestedBounds> {
        let bounds = self.bounds.get_or_init(|| NestedBounds::of(land).ok());
        match detail.roam.weighs() {
            false => bounds.as_ref(),
            true => self.sloped.get_or_init(|| bounds.clone().map(NestedBounds::with_slopes)).as_ref(),
        }
    }
}

/// A method of detail, and what it keeps from frame to frame.
pub struct Chooser<'a> {
    land: &'a Land,
    prepared: &'a Prepared,
    detail: Detail,
    ground: Box<dyn Lod>,
    flight: Option<RoamFlight<'a>>,
    water: Option<Box<dyn Lod>>,
    ground_drawing: Drawing,
    water_drawing: Drawing,
}

/// What ended a refinement before its tolerance did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// The most triangles.
    Triangles,
    /// There are no finer cells.
    Finest,
    /// The number of windows.
    Windows,
    /// The most time: the next frame goes on.
    Time,
}

/// A mesh, and how well it draws.
#[derive(Debug)]
pub struct Chosen {
    /// The triangles.
    pub mesh: Mesh,
    /// The bound.
    pub reached: Reached,
    /// What ended the refinement, if it was not the tolerance.
    pub limit: Option<Limit>,
}

/// No cell of water is smaller than this (m).
const SMALLEST: f64 = 0.25;

/// Contrast falls by this power of e along the visibility: to 2 %.
const VISIBLE: f64 = 3.912;

impl<'a> Chooser<'a> {
    /// A method over a land, with nothing chosen yet.
    pub fn new(land: &'a Land, prepared: &'a Prepared, detail: Detail) -> Chooser<'a> {
        let finest = land.finest_level().saturating_sub(detail.coarser);
        let limits = Limits { finest, triangles: detail.triangles as usize };
        let flight = match detail.method {
            // Land that is too large for a flight is served by ROAM anew for each frame.
            Method::Roam => prepared.bounds(land, &detail).map(|bounds| RoamFlight::over(bounds, limits)),
            _ => None,
        };
        Chooser {
            land,
            prepared,
            detail,
            ground: method(&detail, limits),
            flight,
            water: None,
            ground_drawing: Drawing::default(),
            water_drawing: Drawing::default(),
        }
    }

    /// Goes on as wished: other settings begin anew, another tolerance does not.
    pub fn follow(&mut self, detail: Detail) {
        if !detail.goes_on(&self.detail) {
            *self = Chooser::new(self.land, self.prepared, detail);
        }
        self.detail = detail;
    }

    /// How it chooses.
    pub fn detail(&self) -> Detail {
        self.detail
    }

    /// The triangles of the ground for a view, in which one sees so far (m).
    pub fn ground(&mut self, view: &View, visibility: f64) -> Result<Chosen, ViewError> {
        let detail = self.detail;
        let Some(flight) = &mut self.flight else {
            return choose(&mut *self.ground, self.land, view, &mut self.ground_drawing, &detail);
        };
        let roam = detail.roam;
        flight.priority = if roam.nearest_first { Priority::InverseDistance } else { Priority::ScreenError };
        flight.factors = Factors {
            fog: if roam.fog { (visibility / VISIBLE) as f32 } else { f32::INFINITY },
            back_faces: roam.back_faces as f32,
            silhouettes: roam.silhouettes as f32,
            lighting: roam.lighting as f32,
            objects: Vec::new(),
        };
        let (begun, mut stopped) = (Instant::now(), false);
        let most = (roam.milliseconds > 0.0).then(|| Duration::from_secs_f64(roam.milliseconds * 1e-3));
        let reached = flight.update(view, &mut || {
            stopped = most.is_some_and(|most| begun.elapsed() > most);
            stopped
        })?;
        let mesh = flight.mesh().clone();
        let limit = if stopped { Some(Limit::Time) } else { limit(reached, &mesh, &detail) };
        Ok(Chosen { mesh, reached, limit })
    }

    /// The triangles of a sea for a view.
    pub fn water(&mut self, sea: &Sea, view: &View) -> Result<Chosen, ViewError> {
        let detail = self.detail;
        let lod = self.water.get_or_insert_with(|| {
            let side = match sea.datum() {
                Datum::Plane { size, .. } => size.max_element(),
                Datum::Ellipsoid { equatorial_radius, .. } => equatorial_radius,
            };
            let finest = (side / SMALLEST).log2().ceil().clamp(0.0, 30.0) as u8;
            method(&detail, Limits { finest, triangles: detail.triangles as usize })
        });
        choose(&mut **lod, sea, view, &mut self.water_drawing, &detail)
    }
}

/// A method with its settings.
fn method(detail: &Detail, limits: Limits) -> Box<dyn Lod> {
    match detail.method {
        Method::Nested => {
            let mut nested = Nested::new(limits);
            nested.cells = detail.window_cells;
            nested.windows = (detail.windows > 0).then_some(detail.windows);
            nested.seams = if detail.morphing_seams { Seams::Morphing } else { Seams::Strips };
            Box::new(nested)
        }
        Method::Quadtree => {
            let mut quadtree = Quadtree::new(limits);
            quadtree.morphs = detail.morphs;
            Box::new(quadtree)
        }
        other => other.within(limits),
    }
}

fn choose(
    lod: &mut dyn Lod,
    field: &dyn HeightField,
    view: &View,
    drawing: &mut Drawing,
    detail: &Detail,
) -> Result<Chosen, ViewError> {
    let reached = lod.select(field, view, drawing)?;
    drawing.expand(field);
    let mesh = std::mem::take(&mut drawing.mesh);
    Ok(Chosen { limit: limit(reached, &mesh, detail), mesh, reached })
}

/// What ended a refinement: methods that are short of triangles use most of those they may.
fn limit(reached: Reached, mesh: &Mesh, detail: &Detail) -> Option<Limit> {
    // Of one level everywhere the next one has four times as many.
    let share = if detail.method == Method::Whole { 4 } else { 2 };
    let short = mesh.triangles.len().saturating_mul(share) > detail.triangles as usize;
    reached.limited.then_some(match () {
        () if detail.method == Method::Nested && detail.windows > 0 => Limit::Windows,
        () if short => Limit::Triangles,
        () => Limit::Finest,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detail::Roam;
    use glam::{DVec2, DVec3, UVec2};
    use littoral::field::Raster;

    /// Hills of 129 × 129 samples, 10 m apart.
    fn hills() -> Land {
        let height = |i: usize| {
            let (x, y) = ((i % 129) as f32, (i / 129) as f32);
            40.0 * ((0.21 * x).sin() * (0.17 * y).cos() + 0.2 * (1.3 * x + 0.7 * y).sin())
        };
        Land::new(Raster::new(129, 129, DVec2::splat(10.0), (0..129 * 129).map(height).collect()).expect("a raster"))
    }

    fn view(tolerance: f32) -> View {
        let eye = DVec3::new(-300.0, -500.0, 90.0);
        let view = View::looking_at(eye, DVec3::new(640.0, 640.0, 0.0), 0.9, UVec2::new(640, 360));
        View { tolerance_pixels: tolerance, ..view }
    }

    fn chosen(detail: Detail, tolerance: f32) -> Chosen {
        let (land, prepared) = (hills(), Prepared::default());
        Chooser::new(&land, &prepared, detail).ground(&view(tolerance), 40e3).expect("a view")
    }

    #[test]
    fn what_ended_a_refinement_is_told() {
        for method in Method::ALL {
            let ended =
                |tolerance, triangles| chosen(Detail { method, triangles, ..Detail::default() }, tolerance).limit;
            assert_eq!(ended(100.0, 4_000_000), None, "{method}: the tolerance");
            assert_eq!(ended(0.001, 4_000_000), Some(Limit::Finest), "{method}: the samples");
            assert_eq!(ended(0.001, 2_000), Some(Limit::Triangles), "{method}: the triangles");
        }
    }

    #[test]
    fn each_method_s_own_settings_change_what_it_draws() {
        let usual = Detail { triangles: 4_000_000, ..Detail::default() };
        let roam = |roam| Detail { method: Method::Roam, roam, ..usual };
        let own = Roam::default();
        let few = Detail { triangles: 8_000, ..roam(own) };
        let nested = Detail { method: Method::Nested, triangles: 6_000, ..usual };
        let windows = Detail { windows: 3, ..nested };
        let pairs = [
            (usual, Detail { morphs: false, ..usual }),
            (nested, Detail { morphing_seams: true, ..nested }),
            (nested, windows),
            (windows, Detail { window_cells: 16, ..windows }),
            (few, Detail { roam: Roam { nearest_first: true, ..own }, ..few }),
            (few, Detail { roam: Roam { back_faces: 0.0, ..own }, ..few }),
            (few, Detail { roam: Roam { silhouettes: 8.0, ..own }, ..few }),
            (few, Detail { roam: Roam { lighting: 4.0, ..own }, ..few }),
            (few, Detail { roam: Roam { fog: true, ..own }, ..few }),
        ];
        for (one, other) in pairs {
            assert!(chosen(one, 2.0).mesh.vertices != chosen(other, 2.0).mesh.vertices, "{other:?}");
        }
        assert_eq!(chosen(windows, 2.0).limit, Some(Limit::Windows));
        for method in Method::ALL {
            let coarser = Detail { method, coarser: 3, ..usual };
            let finest = |detail| {
                let mesh = chosen(detail, 0.001).mesh;
                let place = |v: u32| mesh.vertices[v as usize];
                // The shortest side of any triangle, as a share of the face.
                let side = |t: &[u32; 3]| {
                    (0..3)
                        .map(|i| {
                            let (a, b) = (place(t[i]), place(t[(i + 1) % 3]));
                            a.x.abs_diff(b.x).max(a.y.abs_diff(b.y))
                        })
                        .min()
                };
                mesh.triangles.iter().filter_map(side).min()
            };
            let (own, other) = (finest(Detail { method, ..usual }), finest(coarser));
            assert_eq!(other, own.map(|side| 8 * side), "{method}: cells of eight samples");
        }
    }

    #[test]
    fn roam_that_is_stopped_by_its_time_goes_on_until_it_is_done() {
        let (land, prepared) = (hills(), Prepared::default());
        let roam = Roam { milliseconds: 1e-6, ..Roam::default() };
        let detail = Detail { method: Method::Roam, triangles: 50_000, roam, ..Detail::default() };
        let mut chooser = Chooser::new(&land, &prepared, detail);
        let first = chooser.ground(&view(0.5), 40e3).expect("a view");
        let turned = View {
            ..View::looking_at(
                DVec3::new(1500.0, -300.0, 200.0),
                DVec3::new(500.0, 640.0, 0.0),
                0.9,
                UVec2::new(640, 360),
            )
        };
        let turned = View { tolerance_pixels: 0.5, ..turned };
        let mut frames = 0;
        let last = loop {
            frames += 1;
            let chosen = chooser.ground(&turned, 40e3).expect("a view");
            match chosen.limit {
                Some(Limit::Time) => assert!(frames < 1_000_000, "never done"),
                _ => break chosen,
            }
        };
        assert!(frames > 1, "never stopped; the first frame had {} triangles", first.mesh.triangles.len());
        let unhurried = Detail { roam: Roam::default(), ..detail };
        let at_once = Chooser::new(&land, &prepared, unhurried).ground(&turned, 40e3).expect("a view");
        assert_eq!(last.mesh.triangles.len(), at_once.mesh.triangles.len());
    }
}
