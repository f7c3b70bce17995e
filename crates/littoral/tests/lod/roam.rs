//! ROAM over prepared land, held against the same promises from frame to frame.

use super::check::{Case, check, sorted};
use super::{Random, cases, random_terrain, random_view, surface_of};
use glam::{DVec2, UVec2};
use littoral::field::HeightField;
use littoral::lod::{Drawing, Limits, Lod, NestedBounds, Reached, RoamFlight, Vertex, ViewError};
use littoral::space::View;

/// A flight as a method: over its own land, whatever it is shown.
struct Fixed<'a>(RoamFlight<'a>);

impl Lod for Fixed<'_> {
    fn select(&mut self, _: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let reached = self.0.update(view, &mut || false)?;
        drawing.clear();
        drawing.mesh.clone_from(self.0.mesh());
        Ok(reached)
    }
}

#[test]
fn flights_over_prepared_land_keep_every_promise() {
    use rayon::prelude::*;
    cases().into_par_iter().for_each(|seed| {
        let mut random = Random::new(seed + 1_000_000);
        let small = random.below(4) == 0;
        let mut side = || 2 + random.below(if small { 3 } else { 70 }) as usize;
        let (columns, rows) = (side(), side());
        let land = random_terrain(columns, rows, &mut random);
        let bounds = NestedBounds::of(&land).expect("few samples");
        let finest = land.finest_level() - random.below(u32::from(land.finest_level()).min(2) + 1) as u8;
        let limits = Limits { finest, triangles: [300, 4_000, 20_000][random.below(3) as usize] };
        let surface = surface_of(land.clone());
        let mut lod = Fixed(RoamFlight::over(&bounds, limits));
        for turn in 0..3 {
            let view = random_view(&surface, &mut random);
            let label = format!("flight seed {seed} view {turn}");
            check(&mut lod, &Case { surface: &surface, view: &view, limits, label: &label }, &mut random);
            // What was seen before leaves no trace.
            let mut anew = Fixed(RoamFlight::over(&bounds, limits));
            let (mut one, mut other) = (Drawing::default(), Drawing::default());
            let first = lod.select(&land, &view, &mut one).expect("a view");
            let second = anew.select(&land, &view, &mut other).expect("a view");
            assert_eq!(first, second, "{label}");
            assert!(sorted(&one) == sorted(&other), "{label}: another mesh from scratch");
        }
    });
}

/// What a GPU that is sent only what changed holds is what there is.
#[test]
fn changes_are_all_told() {
    let mut random = Random::new(12);
    let land = random_terrain(129, 129, &mut random);
    let (bounds, surface) = (NestedBounds::of(&land).expect("few samples"), surface_of(land.clone()));
    let limits = Limits { finest: land.finest_level(), triangles: 3_000 };
    let mut flight = RoamFlight::over(&bounds, limits);
    let (mut triangles, mut vertices) = (Vec::new(), Vec::new());
    let (mut told, mut all) = (0, 0);
    for step in 0..60 {
        let at = surface.origin + surface.extent * DVec2::new(0.1 + 0.01 * f64::from(step), 0.5);
        let mut view =
            View::looking_at(at.extend(80.0), (at + DVec2::new(50.0, 20.0)).extend(40.0), 1.0, UVec2::new(640, 360));
        view.tolerance_pixels = 0.01;
        if step == 30 {
            view = random_view(&surface, &mut random);
        }
        // More merges than splits in every other step: triangles move to where others were.
        flight.limits.triangles = if step % 2 == 1 { 11_940 } else { 12_000 };
        flight.update(&view, &mut || false).expect("a view");
        let mesh = flight.mesh();
        triangles.resize(mesh.triangles.len(), [9; 3]);
        vertices.resize(mesh.vertices.len(), mesh.vertices[0]);
        for range in flight.changed_triangles() {
            triangles[range.clone()].copy_from_slice(&mesh.triangles[range.clone()]);
            told += range.len();
        }
        for range in flight.changed_vertices() {
            vertices[range.clone()].copy_from_slice(&mesh.vertices[range]);
        }
        all += mesh.triangles.len();
        // Heights by their bits: voids are no numbers.
        let bits = |all: &[Vertex]| all.iter().map(|v| (v.x, v.y, v.height.to_bits())).collect::<Vec<_>>();
        assert!(triangles == mesh.triangles && bits(&vertices) == bits(&mesh.vertices), "step {step}");
    }
    assert!(told < all, "{told} of {all} triangles told");
}
