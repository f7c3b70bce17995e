//! Strips made on the fly: triangles a second, and what they need of memory.
//!
//! The scene is that of `benches/roam.rs`: 30 km in 4097² samples of fractal noise, or the raw `f32` heights that the environment variable `LITTORAL_MAP`
//! names; from 300 m above the ground, 60° vertically, 1920 × 1080 pixels, at several tolerances; and a sea of 128 waves. One thread, processor time.

mod clock;

use clock::{median, processor_time};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::Fbm;
use littoral::field::{HeightField, Land, Raster};
use littoral::lod::{Drawing, Limits, Lod, Strips};
use littoral::space::View;
use std::hint::black_box;

const EXTENT: f64 = 30_000.0;
const SAMPLES: usize = 4097;

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let land = match std::env::var("LITTORAL_MAP") {
        Ok(path) => measured(&path),
        Err(_) => invented(SAMPLES),
    };
    let begin = processor_time();
    land.error(littoral::space::Cell::face(0));
    println!("errors of the land's cells measured once in {:.2} s", processor_time() - begin);
    one.install(|| {
        for tolerance in [4.0, 2.0, 1.0, 0.5, 0.25] {
            frame(&land, &land, tolerance);
        }
    });
}

fn frame(field: &dyn HeightField, land: &Land, tolerance: f32) {
    let at = land.origin() + land.extent() * 0.25;
    let eye = at.extend(f64::from(land.height_at(at).unwrap_or(0.0)) + 300.0);
    let pitch = -8f64.to_radians();
    let way = DVec2::ONE.normalize() * pitch.cos();
    let mut view =
        View::looking_at(eye, eye + DVec3::new(way.x, way.y, pitch.sin()), 60f32.to_radians(), UVec2::new(1920, 1080));
    view.tolerance_pixels = tolerance;
    let mut strips = Strips::new(Limits { finest: land.finest_level(), triangles: 50_000_000 });
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

fn measured(path: &str) -> Land {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("cannot read {path}: {e}"));
    assert_eq!(bytes.len(), SAMPLES * SAMPLES * 4, "expected {SAMPLES}² raw f32 heights in {path}");
    let heights = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    placed(SAMPLES, heights.collect())
}

fn invented(samples: usize) -> Land {
    let fbm = Fbm::new(8000.0, 1200.0, 12, 7);
    let step = EXTENT / (samples - 1) as f64;
    let at = |i: usize| DVec2::new((i % samples) as f64, (i / samples) as f64) * step;
    placed(samples, (0..samples * samples).map(|i| fbm.at(at(i)).value as f32).collect())
}

fn placed(samples: usize, heights: Vec<f32>) -> Land {
    Land::new(
        Raster::new(samples, samples, DVec2::splat(EXTENT / (samples - 1) as f64), heights).expect("sizes are valid"),
    )
}
