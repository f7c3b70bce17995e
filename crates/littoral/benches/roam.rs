//! ROAM in flight: milliseconds a frame, splits and merges a second, work against speed.
//!
//! The scene is that of `benches/rays.rs`: 30 km in 4097² samples of fractal noise, or the raw `f32` heights that the environment variable `LITTORAL_MAP`
//! names. The flight is at 60 frames/s, 300 m above the ground ahead, 60° vertically, 1920 × 1080 pixels. Processor time.

mod clock;

use clock::{median, processor_time};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::Fbm;
use littoral::field::{Land, Raster};
use littoral::lod::{Limits, Mesh, NestedBounds, RoamFlight, RoamOnce};
use littoral::space::View;
use std::hint::black_box;

const EXTENT: f64 = 30_000.0;
const SAMPLES: usize = 4097;

fn main() {
    let land = match std::env::var("LITTORAL_MAP") {
        Ok(path) => measured(&path),
        Err(_) => invented(SAMPLES),
    };
    let begin = processor_time();
    let bounds = NestedBounds::of(&land).expect("few samples");
    println!(
        "prepared in {:.2} s of processor time, {:.1} bytes a sample, heights included",
        processor_time() - begin,
        bounds.bytes() as f64 / land.raster().heights().len() as f64
    );
    if std::env::var("DEV").is_ok() {
        if std::env::var("SCR").is_ok() { scratch(&bounds, &land); return; }
        if let Ok(case) = std::env::var("CASE") {
            let v: Vec<f64> = case.split(',').map(|x| x.parse().unwrap()).collect();
            flight(&bounds, &land, v[0] as usize, &case, (v[1], v[2]), v[3] as usize, f64::INFINITY);
            return;
        }
        for (n,f) in [(5000,2000),(20000,1000),(100_000,600), (1_000_000, 60)] {
            for s in [0.0, 1000.0, 3000.0] {
            flight(&bounds, &land, n, &format!("{n} {s} m/s"), (s, 0.0), f, f64::INFINITY);
            }
        }
        return;
    }
    scratch(&bounds, &land);
    for triangles in [100_000, 1_000_000] {
        println!(
            "{triangles} triangles: ms a frame, median / 99 %; diamonds split and merged a frame; millions of bisections and merges a second"
        );
        for (name, speed, yaw) in [
            ("still", 0.0, 0.0),
            ("10 m/s", 10.0, 0.0),
            ("100 m/s", 100.0, 0.0),
            ("300 m/s", 300.0, 0.0),
            ("1000 m/s", 1000.0, 0.0),
            ("3000 m/s", 3000.0, 0.0),
            ("10°/s", 0.0, 10.0),
            ("100 m/s, 10°/s", 100.0, 10.0),
            ("1000 m/s, 10°/s", 1000.0, 10.0),
        ] {
            let frames = if triangles > 500_000 { 150 } else { 400 };
            flight(&bounds, &land, triangles, name, (speed, yaw), frames, f64::INFINITY);
        }
    }
    println!("100000 triangles, stopped after 0.2 ms:");
    for (name, speed, yaw) in [("100 m/s", 100.0, 0.0), ("300 m/s", 300.0, 0.0), ("10°/s", 0.0, 10.0)] {
        flight(&bounds, &land, 100_000, name, (speed, yaw), 400, 2e-4);
    }
}

/// The view at a time of a flight.
fn view(land: &Land, speed: f64, yaw: f64, time: f64) -> View {
    let turned = (45.0 + yaw * time).to_radians();
    let way = if yaw == 0.0 || speed == 0.0 {
        DVec2::ONE.normalize() * speed * time
    } else {
        // A curve.
        let rate = yaw.to_radians();
        let radius = speed / rate;
        let start = 45f64.to_radians();
        DVec2::new(turned.sin() - start.sin(), start.cos() - turned.cos()) * radius
    };
    let at = land.origin() + land.extent() * 0.25 + way;
    let ground = f64::from(land.height_at(at).unwrap_or(0.0));
    let pitch = -8f64.to_radians();
    let forward = DVec3::new(turned.cos() * pitch.cos(), turned.sin() * pitch.cos(), pitch.sin());
    let eye = at.extend(ground + 300.0);
    let mut view = View::looking_at(eye, eye + forward, 60f32.to_radians(), UVec2::new(1920, 1080));
    view.tolerance_pixels = 0.01;
    view
}

fn flight(
    bounds: &NestedBounds,
    land: &Land,
    triangles: usize,
    name: &str,
    (speed, yaw): (f64, f64),
    frames: usize,
    budget: f64,
) {
    let limits = Limits { finest: 12, triangles };
    let mut flight = RoamFlight::over(bounds, limits);
    flight.update(&view(land, speed, yaw, 0.0), &mut || false).expect("a view");
    let before = flight.operations();
    let mut seconds = Vec::with_capacity(frames);
    let (mut told, mut pixels) = (0, 0.0f32);
    for frame in 1..=frames {
        let view = view(land, speed, yaw, frame as f64 / 60.0);
        let begin = processor_time();
        let reached = flight.update(&view, &mut || processor_time() - begin > budget).expect("a view");
        black_box(flight.mesh());
        seconds.push(processor_time() - begin);
        pixels = reached.pixels;
        told += flight.changed_triangles().map(|range| range.len()).sum::<usize>();
    }
    let (splits, merges) = flight.operations();
    let operations = (splits - before.0 + merges - before.1) as f64;
    let total: f64 = seconds.iter().sum();
    seconds.sort_by(f64::total_cmp);
    println!(
        "{name:>16}: {:.3} / {:.3}; {:.0}; {:.1} M/s; {} triangles, {pixels:.2} pixels reached; {:.0} triangles sent",
        seconds[frames / 2] * 1e3,
        seconds[frames * 99 / 100] * 1e3,
        operations / frames as f64,
        2e-6 * operations / total,
        flight.mesh().triangles.len(),
        told as f64 / frames as f64,
    );
}

/// A mesh from nothing.
fn scratch(bounds: &NestedBounds, land: &Land) {
    for triangles in [100_000, 1_000_000] {
        let mut once = RoamOnce::over(bounds, Limits { finest: 12, triangles });
        let mut mesh = Mesh::default();
        let seconds = median(7, || {
            once.draw(&view(land, 0.0, 0.0, 0.0), &mut mesh).expect("a view");
        });
        println!(
            "{triangles} triangles from scratch, nothing kept: {:.2} ms, {:.1} M bisections/s",
            seconds * 1e3,
            mesh.triangles.len() as f64 / seconds * 1e-6
        );
        let mut flight = RoamFlight::over(bounds, Limits { finest: 12, triangles });
        let view = view(land, 0.0, 0.0, 0.0);
        flight.update(&view, &mut || false).expect("a view");
        let before = flight.operations();
        let mut runs = 0;
        let seconds = median(5, || {
            flight.restart();
            flight.update(&view, &mut || false).expect("a view");
            runs += 1;
        });
        let (splits, merges) = flight.operations();
        let operations = (splits - before.0 + merges - before.1) as f64 / f64::from(runs);
        println!(
            "{triangles} triangles from scratch: {:.2} ms, {:.1} M bisections/s ({operations:.0} splits and merges)",
            seconds * 1e3,
            triangles as f64 / seconds * 1e-6
        );
    }
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
