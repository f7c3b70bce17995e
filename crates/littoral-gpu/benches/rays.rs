//! Milliseconds that a picture's rays take on the GPU, by themselves, and the pyramid that they go by.
//!
//! `cargo bench -p littoral-gpu --bench rays`. Mountains of 30 × 30 km, 3 km below the eye, which looks 45° down: every ray hits. 1920 × 1080 pixels on a graphics
//! card (the paper of 2015 took 31 ms; the goal is 1 ms), 480 × 270 on a processor that stands for one. Wall time from before the work is submitted until it is done,
//! and what the adapter's own clock says where it has one; medians. The bytes are what must be moved at least: each sample read once, each pixel's depth
//! written, and for the pyramid each node written and read once. Over the time and the memory's speed they are the part of what is possible.

mod timer;

use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use littoral::field::noise::Fbm;
use littoral::field::{HeightField, Land, Raster};
use littoral::picture::{Scene, Stage};
use littoral::raycast::LocalRay;
use littoral::space::{Datum, View};
use littoral_gpu::{Gpu, Ground, Look, Renderer, Scenery, ShapeTexture};
use std::time::Instant;

/// Side of the map (m).
const SIDE: f64 = 30_000.0;
/// Runs of which the median is taken, after two that warm up.
const RUNS: usize = 15;

fn main() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu.timed(),
        Err(error) => return println!("{error}"),
    };
    let (size, sides) = match gpu.is_software() {
        true => (UVec2::new(480, 270), &[257, 1025][..]),
        false => (UVec2::new(1920, 1080), &[257, 513, 1025, 4097][..]),
    };
    println!("{} ({:?}), {} × {} pixels", gpu.adapter.name, gpu.adapter.backend, size.x, size.y);
    for &side in sides {
        map(&gpu, side, size);
    }
}

fn map(gpu: &Gpu, side: usize, size: UVec2) {
    let noise = Fbm::new(8000.0, 900.0, 10, 5);
    let step = SIDE / (side - 1) as f64;
    let height = |i: usize| noise.at(DVec2::new((i % side) as f64, (i / side) as f64) * step).value as f32;
    let raster = Raster::new(side, side, DVec2::splat(step), (0..side * side).map(height).collect());
    let land = Land::new(raster.expect("a square map"));
    let at = land.origin() + 0.2 * land.extent();
    let eye = at.extend(f64::from(land.height_at(at).unwrap_or(0.0)) + 3000.0);
    let view = View::looking_at(eye, eye + DVec3::new(1.0, 1.0, -2f64.sqrt()), 1.0, size);
    let shape = ShapeTexture::new(gpu, &land).expect("a map that fits");
    let samples = (side * side) as f64;
    println!("map of {side} × {side}");

    let wait = || timer::wait(gpu);
    let built = median(|| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        shape.build(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        wait();
        0.0
    });
    let bytes = shape.bytes_built() as f64;
    println!("  pyramid: {:.3} ms for {:.1} MB, {:.2} GB/s", built.0, 1e-6 * bytes, 1e-6 * bytes / built.0);

    let stage = Stage::new(&Scene::new(&land, None));
    let tables = stage.tables();
    let Datum::Plane { origin, size: extent } = land.datum() else { return };
    let sky = stage.sky_table(eye.z);
    let scenery = Scenery::new(gpu, &tables, (origin, extent), (eye.z, &sky)).expect("a map that fits");
    let mut renderer = Renderer::new(gpu, wgpu::TextureFormat::Rgba8Unorm);
    for (name, pixels) in [("exact", 0.0), ("by cones of a pixel", 1.0)] {
        let (wall, pass) = median(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let ground = Ground::Rays { shape: &shape, pixels };
            renderer.distances(gpu, &mut encoder, &scenery, ground, &view, Look::default());
            gpu.queue.submit([encoder.finish()]);
            wait();
            timer::read(gpu).unwrap_or(0.0)
        });
        let rays = f64::from(size.x * size.y);
        let bytes = 4.0 * (samples.min(4.0 * rays) + rays);
        let best = if pass > 0.0 { pass } else { wall };
        let clock = if pass > 0.0 { format!(", {pass:.3} ms by the adapter's clock") } else { String::new() };
        println!(
            "  rays, {name}: {wall:.2} ms{clock}; {:.1} million a second, {:.1} MB, {:.2} GB/s",
            1e-3 * rays / best,
            1e-6 * bytes,
            1e-6 * bytes / best
        );
    }

    // The same rays as questions, on both processors.
    let (corner, right, down) = view.frame();
    let pixel = |i: u32| Vec2::new((i % size.x) as f32 + 0.5, (i / size.x) as f32 + 0.5);
    let ray = |i: u32| LocalRay::new(Vec3::ZERO, corner + right * pixel(i).x + down * pixel(i).y);
    let rays: Vec<LocalRay> = (0..size.x * size.y).map(ray).collect();
    let (asked, _) = median(|| {
        drop(shape.first_hits(gpu, eye, &rays));
        0.0
    });
    let mut distances = vec![0.0; rays.len()];
    let caster = land.caster(eye);
    let (alone, _) = median(|| {
        caster.par_view_hits(&view, Vec2::splat(0.5), &mut distances);
        0.0
    });
    println!(
        "  the same as questions, brought there and back: {asked:.2} ms; by the engine on this processor: {alone:.2} ms"
    );
}

/// The median of wall times (ms), and of what the work says.
fn median(mut work: impl FnMut() -> f64) -> (f64, f64) {
    let mut times: Vec<[f64; 2]> = (0..RUNS + 2)
        .map(|_| {
            let start = Instant::now();
            let told = work();
            [start.elapsed().as_secs_f64() * 1e3, told]
        })
        .skip(2)
        .collect();
    let mut of = |which: usize| {
        times.sort_by(|a, b| a[which].total_cmp(&b[which]));
        times[RUNS / 2][which]
    };
    (of(0), of(1))
}
