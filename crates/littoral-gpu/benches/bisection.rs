//! Milliseconds that a bisection takes on the GPU, along a flight at 60 frames/s over 30 km of mountains in 4097² samples, 300 m above the ground, 1920 × 1080 pixels, beside the
//! processor's flight and its search from scratch over the same views.
//!
//! `cargo bench -p littoral-gpu --bench bisection`. `first` is the first view, from nothing; `alone` the time by the wall from a frame's submission until it is done, `by its clock`
//! what the device's own timestamps say, medians of the flight's frames; on the processor, its own time, medians as well. The bytes are the least that any way to do it moves: the list of
//! what is split, read and written, what is known of each diamond of it and of its two children, bits and sums, and heights, vertices and triangles that are drawn. `LITTORAL_MAP` names
//! other heights. Indirect dispatches are checked by wgpu with passes of its own; `WGPU_VALIDATION_INDIRECT_CALL=0` leaves them out.

#[path = "../../littoral/benches/clock/mod.rs"]
#[expect(dead_code, reason = "the medians of a flight are of its frames")]
mod clock;
#[path = "../../littoral/benches/scene/mod.rs"]
mod scene;
mod timer;

use clock::processor_time;
use glam::{DVec2, DVec3, UVec2};
use littoral::field::Land;
use littoral::lod::{Limits, Mesh, NestedBounds, RoamFlight, RoamOnce};
use littoral::space::View;
use littoral_gpu::{Bisector, Gpu};
use std::hint::black_box;
use std::time::Instant;
use timer::wait;

/// Frames that are measured.
const FRAMES: usize = 61;

fn main() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu.timed(),
        Err(error) => return println!("{error}"),
    };
    println!("{} ({:?})", gpu.adapter.name, gpu.adapter.backend);
    let land = scene::mountains();
    let bounds = match NestedBounds::of(&land) {
        Ok(bounds) => bounds,
        Err(error) => return println!("{error}"),
    };
    for triangles in [100_000, 1_000_000] {
        let limits = Limits { finest: land.finest_level(), triangles };
        for speed in [0.0, 100.0, 1000.0] {
            fly(&gpu, &land, &bounds, limits, speed);
        }
    }
}

/// The view at a frame of a flight north-eastward (m/s).
fn view(land: &Land, speed: f64, frame: usize) -> View {
    let at = land.origin() + land.extent() * 0.25 + DVec2::ONE.normalize() * speed * frame as f64 / 60.0;
    let eye = at.extend(f64::from(land.height_at(at).unwrap_or(0.0)) + 300.0);
    let mut view = View::looking_at(eye, eye + DVec3::new(0.7, 0.7, -0.14), 60f32.to_radians(), UVec2::new(1920, 1080));
    view.tolerance_pixels = 0.5;
    view
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn fly(gpu: &Gpu, land: &Land, bounds: &NestedBounds, limits: Limits, speed: f64) {
    let mut bisector = match Bisector::new(gpu, bounds, limits) {
        Ok(bisector) => bisector,
        Err(error) => return println!("{error}"),
    };
    wait(gpu);
    let (mut alone, mut ticks) = (Vec::new(), Vec::new());
    for frame in 0..=FRAMES {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = view(land, speed, frame);
        let refused = bisector.bisect(gpu, &mut encoder, &view, timer::writes(gpu));
        refused.expect("a view that is one");
        let commands = encoder.finish();
        let start = Instant::now();
        gpu.queue.submit([commands]);
        wait(gpu);
        alone.push(start.elapsed().as_secs_f64() * 1e3);
        ticks.push(timer::read(gpu).unwrap_or(0.0));
    }
    let told = match bisector.read(gpu) {
        Ok(told) => told,
        Err(error) => return println!("{error}"),
    };

    let mut flight = RoamFlight::over(bounds, limits);
    let (mut flown, mut scratch, mut mesh) = (Vec::new(), Vec::new(), Mesh::default());
    let mut once = RoamOnce::over(bounds, limits);
    for frame in 0..=FRAMES {
        let view = view(land, speed, frame);
        let start = processor_time();
        flight.update(&view, &mut || false).expect("a view that is one");
        black_box(flight.mesh());
        flown.push((processor_time() - start) * 1e3);
        let start = processor_time();
        once.draw(&view, &mut mesh).expect("a view that is one");
        scratch.push((processor_time() - start) * 1e3);
    }
    let split = u64::from(told.vertices);
    let bytes = split * (8 * 2 + 8 * 3 + 4 + 16) + split / 4 + 12 * u64::from(told.triangles);
    println!(
        "{} triangles, {speed} m/s: {} -> {} triangles, {} on the processor; {:.2} pixels reached",
        limits.triangles,
        2u64 << (2 * limits.finest),
        told.triangles,
        mesh.triangles.len(),
        told.reached.pixels
    );
    let first = (alone.remove(0), flown.remove(0));
    ticks.remove(0);
    let alone = median(alone);
    let clock =
        if gpu.times.is_some() { format!("{:.3} ms by its clock", median(ticks)) } else { "no clock".to_owned() };
    println!(
        "  first {:.2} ms, then {alone:.3} ms alone, {clock}; on the processor {:.2} ms, then {:.3} ms, from scratch {:.2} ms; {:.2} MB at least: {:.1} GB/s",
        first.0,
        first.1,
        median(flown),
        median(scratch),
        1e-6 * bytes as f64,
        1e-6 * bytes as f64 / alone
    );
}
