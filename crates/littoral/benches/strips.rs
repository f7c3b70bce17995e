//! Strips made on the fly: triangles a second, and what they need of memory.
//!
//! From 300 m above mountains, 60° vertically, 1920 × 1080 pixels, at several tolerances. One thread, processor time.

mod clock;
mod scene;

use clock::{median, processor_time};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::{HeightField, Land};
use littoral::lod::{Drawing, Limits, Lod, Strips};
use littoral::space::View;
use std::hint::black_box;

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let land = scene::mountains();
    let begin = processor_time();
    land.error(littoral::space::Cell::face(0));
    println!("errors of the land's cells measured once in {:.2} s", processor_time() - begin);
    one.install(|| {
        for tolerance in [4.0, 2.0, 1.0, 0.5, 0.25, 0.1] {
            frame(&land, &land, tolerance, 50_000_000);
        }
        println!("at most a million triangles:");
        for tolerance in [0.5, 0.25, 0.1] {
            frame(&land, &land, tolerance, 1_000_000);
        }
    });
}

fn frame(field: &dyn HeightField, land: &Land, tolerance: f32, triangles: usize) {
    let at = land.origin() + land.extent() * 0.25;
    let eye = at.extend(f64::from(land.height_at(at).unwrap_or(0.0)) + 300.0);
    let pitch = -8f64.to_radians();
    let way = DVec2::ONE.normalize() * pitch.cos();
    let mut view =
        View::looking_at(eye, eye + DVec3::new(way.x, way.y, pitch.sin()), 60f32.to_radians(), UVec2::new(1920, 1080));
    view.tolerance_pixels = tolerance;
    let mut strips = Strips::new(Limits { finest: land.finest_level(), triangles });
    let mut drawing = Drawing::default();
    let mut reached = None;
    let seconds = median(15, || {
        reached = Some(strips.select(field, &view, &mut drawing).expect("a view"));
        black_box(&drawing.mesh.vertices);
    });
    let (vertices, count) = (drawing.mesh.vertices.len(), drawing.strips.len());
    drawing.expand(field);
    let triangles = drawing.mesh.triangles.len();
    println!(
        "{tolerance} pixels: {triangles} triangles in {:.2} ms, {:.0} M/s; {count} strips of {:.1} triangles, {:.2} vertices a triangle; reached {:.2} pixels",
        seconds * 1e3,
        triangles as f64 / seconds * 1e-6,
        triangles as f64 / count as f64,
        vertices as f64 / triangles as f64,
        reached.map_or(f32::NAN, |r| r.pixels),
    );
}
