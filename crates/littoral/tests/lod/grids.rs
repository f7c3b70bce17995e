//! What grids promise beside what all methods do.

use super::{METHODS, Random, random_land};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::{Fbm, NoiseField};
use littoral::field::{Land, Raster};
use littoral::lod::{Drawing, Limits, Lod, Nested, Strips};
use littoral::space::View;

fn hills() -> NoiseField {
    NoiseField { fbm: Fbm::new(300.0, 90.0, 7, 3), origin: DVec2::splat(-500.0), size: DVec2::splat(1000.0) }
}

fn over_hills(tolerance_pixels: f32) -> View {
    let eye = DVec3::new(-300.0, -350.0, 150.0);
    View { tolerance_pixels, ..View::looking_at(eye, DVec3::ZERO, 0.9, UVec2::new(640, 360)) }
}

/// Where the limit of triangles binds, most of them are drawn.
#[test]
fn budgets_are_used() {
    let field = hills();
    for (name, share) in [("nested", 0.8), ("quadtree", 0.85), ("patches", 0.95), ("strips", 0.8)] {
        let method = METHODS.iter().find(|method| method.name == name).expect("a method");
        for triangles in [20_000, 70_000] {
            let mut drawing = Drawing::default();
            let mut lod = (method.make)(Limits { finest: 12, triangles });
            let reached = lod.select(&field, &over_hills(0.01), &mut drawing).expect("a view");
            let drawn = drawing.triangles();
            assert!(reached.limited, "{name}: {reached:?}");
            assert!(
                drawn <= triangles && drawn as f64 >= share * triangles as f64,
                "{name}: {drawn} triangles of {triangles}"
            );
        }
    }
}

/// So many windows of so many cells, whatever the view tolerates.
#[test]
fn windows_are_as_many_as_is_said() {
    let field = hills();
    for (windows, cells, tolerance) in [(6, 32, 1e5), (3, 8, 1e-3), (2, 4, 1.0), (1, 16, 1.0)] {
        let mut lod = Nested::new(Limits { finest: 30, triangles: 1 });
        (lod.windows, lod.cells) = (Some(windows), cells);
        let mut drawing = Drawing::default();
        let eye = DVec3::new(-300.0, -350.0, 150.0);
        let mut view = View::looking_at(eye, DVec3::new(-300.0, -345.0, 0.0), 0.9, UVec2::new(640, 360));
        view.tolerance_pixels = tolerance;
        let reached = lod.select(&field, &view, &mut drawing).expect("a view");
        assert!(reached.pixels > 0.0);
        let mesh = &drawing.mesh;
        let widths = mesh.triangles.iter().map(|t| {
            let x = t.map(|v| mesh.vertices[v as usize].x);
            x.into_iter().max().expect("three") - x.into_iter().min().expect("three")
        });
        let mut widths: Vec<u32> = widths.filter(|width| *width > 0).collect();
        widths.sort_unstable();
        widths.dedup();
        let finest = ((1u32 << 30) / cells) >> (windows - 1);
        assert_eq!(widths.first(), Some(&finest), "{windows} windows of {cells} cells");
        assert!(mesh.vertices.len() <= usize::from(windows) * ((cells + 1) * (cells + 1)) as usize);
    }
}

/// Blocks of cells are judged like the cells: behind the eye nothing is asked for.
#[test]
fn only_what_is_seen_is_evaluated() {
    let mut random = Random::new(2);
    let surface = random_land(65, 65, &mut random);
    let middle = surface.origin + 0.5 * surface.extent;
    // Straight ahead over the northern half, from the middle.
    let eye = middle.extend(5000.0);
    let view = View::looking_at(eye, eye + DVec3::new(0.0, 1.0, -0.05), 0.2, UVec2::new(64, 64));
    let mut lod = Nested::new(Limits { finest: 6, triangles: 100_000 });
    let mut drawing = Drawing::default();
    lod.select(&*surface.field, &view, &mut drawing).expect("a view");
    let south = drawing.mesh.vertices.iter().filter(|v| v.y < 1 << 28).count();
    assert_eq!(south, 0, "heights behind the eye");
}

/// Many pages are walked by many threads, and come out in the same order.
#[test]
fn strips_are_the_same_on_any_number_of_threads() {
    let surface = random_land(1025, 1025, &mut Random::new(4));
    let middle = surface.origin + 0.5 * surface.extent;
    let eye = middle.extend(surface.extent.x);
    let view = View::looking_at(eye, (middle + 1.0).extend(0.0), 1.0, UVec2::new(640, 640));
    let drawn = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let (mut drawing, mut lod) = (Drawing::default(), Strips::new(Limits::default()));
            lod.limits.finest = surface.finest;
            lod.select(&*surface.field, &view, &mut drawing).expect("a view");
            (drawing.mesh.vertices, drawing.strips)
        })
    };
    let alone = drawn(1);
    // More than sixty-four pages of equal cells hold.
    assert!(alone.0.len() > 64 * 64 * 130, "{} vertices", alone.0.len());
    for threads in [2, 5] {
        assert!(drawn(threads) == alone, "on {threads} threads");
    }
}

/// Heights of blocks of cells reach up to an eye that stands low among hills; the cells' own do not.
#[test]
fn strips_keep_their_tolerance_about_a_low_eye() {
    let height = |i: usize| {
        let (x, y) = ((i % 65) as f32 * 0.21, (i / 65) as f32 * 0.17);
        400.0 + 150.0 * x.sin() * y.cos() + 20.0 * (3.0 * x + y).sin()
    };
    let raster = Raster::new(65, 65, DVec2::splat(30.0), (0..65 * 65).map(height).collect()).expect("valid");
    let land = Land::at(raster, DVec2::ZERO);
    let (eye, look) = (DVec3::new(514.2, 744.6, 484.97), DVec3::new(965.2, 1005.0, 430.2));
    let mut view = View::looking_at(eye, look, 0.62, UVec2::new(96, 54));
    let mut lod = Strips::new(Limits { finest: 6, ..Limits::default() });
    for tolerance in [2.0, 8.0] {
        view.tolerance_pixels = tolerance;
        let reached = lod.select(&land, &view, &mut Drawing::default()).expect("a view");
        assert!(!reached.limited && reached.pixels <= tolerance, "{tolerance} pixels asked: {reached:?}");
    }
}
