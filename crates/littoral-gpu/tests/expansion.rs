//! Patches become the processor's triangles on the device.

#![allow(missing_docs)]

#[path = "../../littoral/tests/lod/surfaces.rs"]
#[expect(dead_code, reason = "the suite of the processor's methods asks for more surfaces")]
mod surfaces;

use glam::UVec2;
use littoral::field::coast;
use littoral::lod::{Drawing, Limits, Mesh, Method, Patch, Stencil};
use littoral::picture::{Scene, Stage, coast_shot};
use littoral::space::Cell;
use littoral_gpu::{Expander, Gpu, Painter};
pub use surfaces::Random;
use surfaces::{random_terrain, random_view, surface_of};

/// The corners of a triangle, and their heights.
type Triangle = ([(u32, u32); 3], [f32; 3]);

/// Triangles in an order of their own.
fn sorted(mesh: &Mesh) -> Vec<Triangle> {
    let of = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| mesh.vertices[i as usize]);
        [[a, b, c], [b, c, a], [c, a, b]]
            .map(|turned| (turned.map(|v| (v.x, v.y)), turned.map(|v| v.height)))
            .into_iter()
            .min_by_key(|turned| turned.0)
            .expect("three")
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(of).collect();
    all.sort_by_key(|triangle| triangle.0);
    all
}

#[test]
fn patches_become_the_processors_triangles() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return eprintln!("not tested: {e}"),
    };
    let (mut triangles, mut upright) = (0, 0);
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let (columns, rows) = (2 + random.below(90) as usize, 2 + random.below(90) as usize);
        let land = random_terrain(columns, rows, &mut random);
        let surface = surface_of(land.clone());
        let mut expander = Expander::new(&gpu, &land).expect("a small land");
        // As fine as the samples, or finer.
        let limits = Limits { finest: land.finest_level() + random.below(2) as u8, triangles: 20_000 };
        for method in [Method::Quadtree, Method::Whole, Method::Patches, Method::Nested, Method::Strips] {
            let view = random_view(&surface, &mut random);
            let mut drawing = Drawing::default();
            method.within(limits).select(&land, &view, &mut drawing).expect("a view");
            let mut twin = drawing.clone();
            twin.expand(&land);
            expander.expand(&gpu, &mut drawing).expect("few triangles");
            let got = expander.mesh(&gpu).expect("a device");
            let (expected, got) = (sorted(&twin.mesh), sorted(&got));
            let label = format!("seed {seed} {method}");
            assert_eq!(got.len(), expected.len(), "{label}");
            for (got, expected) in got.iter().zip(&expected) {
                assert_eq!(got.0, expected.0, "{label}");
                for (got, expected) in got.1.iter().zip(expected.1) {
                    assert!((got - expected).abs() <= 1e-6 * expected.abs() + 1e-4, "{label}: {got} for {expected}");
                }
                let [a, b, c] = got.0.map(|(x, y)| (i64::from(x), i64::from(y)));
                upright += usize::from((b.0 - a.0) * (c.1 - a.1) == (b.1 - a.1) * (c.0 - a.0));
            }
            triangles += got.len();
        }
    }
    eprintln!("{triangles} triangles, {upright} of them upright");
    assert!(triangles > 20_000 && upright > 100);
}

#[test]
fn a_picture_of_a_drawing_is_that_of_its_mesh() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return eprintln!("not tested: {e}"),
    };
    let land = coast::coast();
    let shot = coast_shot(UVec2::new(96, 54));
    let stage = Stage::new(&Scene::for_shot(&land, None, &shot));
    let limits = Limits { finest: land.finest_level(), triangles: 60_000 };
    let mut painter = Painter::new(gpu, &stage).expect("a natural scene");
    for method in [Method::Quadtree, Method::Strips] {
        let mut drawing = Drawing::default();
        method.within(limits).select(&land, &shot.view, &mut drawing).expect("a view");
        let mut twin = drawing.clone();
        twin.expand(&land);
        let count = painter.expand(&land, &mut drawing).expect("few triangles");
        assert_eq!(count, twin.mesh.triangles.len());
        let made = painter.picture_of_made(&stage, &shot.view, 1, &|_| {}).expect("a picture");
        let mesh = painter.picture(&stage, Some(&twin.mesh), &shot.view, 1, &|_| {}).expect("a picture");
        let apart = made.depth.iter().zip(&mesh.depth).filter(|(a, b)| (*a - *b).abs() > 1e-3 * **b).count();
        assert!(apart <= 2, "{apart} pixels of {method} differ");
        assert!(mesh.depth.iter().filter(|depth| **depth > 0.0).count() > 2000, "hardly any ground");
    }
}

#[test]
fn drawings_that_are_too_large_are_refused() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return eprintln!("not tested: {e}"),
    };
    let land = random_terrain(9, 9, &mut Random::new(1));
    let mut expander = Expander::new(&gpu, &land).expect("a small land");
    let patch = Patch::of(Cell::face(0));
    for (cells, number) in [(64, 1), (32, 300_000)] {
        let mut drawing = Drawing::default();
        (drawing.stencil, drawing.patches) = (Stencil::Square(cells), vec![patch; number]);
        let refused = expander.expand(&gpu, &mut drawing).expect_err("too large").to_string();
        assert!(refused.contains("allow fewer"), "{refused}");
    }
    expander.expand(&gpu, &mut Drawing::default()).expect("nothing");
    assert_eq!(expander.count(&gpu).expect("a device"), 0);
    assert!(gpu.check().is_ok(), "{:?}", gpu.check());
}
