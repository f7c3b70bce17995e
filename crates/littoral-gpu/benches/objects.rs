//! Milliseconds that a picture takes on the GPU with objects and without: about a million triangles of lighthouses and buoys on the built-in coast.
//!
//! `cargo bench -p littoral-gpu --bench objects`. Wall time from before the work is recorded until it is done; medians; the cases alternate within one process. All in
//! full is what a million triangles cost; within a pixel is what they are drawn with.

use glam::{DVec2, UVec2};
use littoral::field::{Water, coast};
use littoral::objects::{Standing, buoy, lighthouse};
use littoral::picture::{Scene, Stage, coast_shot};
use littoral::space::View;
use littoral_gpu::{Gpu, Ground, Look, Renderer, Scenery, ShapeTexture};
use std::sync::Arc;
use std::time::Instant;

fn main() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(error) => return println!("{error}"),
    };
    println!("{} ({:?})", gpu.adapter.name, gpu.adapter.backend);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let shot = coast_shot(UVec2::new(1280, 720));
    let view = shot.view;
    let objects = field(&water, &view);
    let scene = Scene { objects: &objects, ..Scene::for_shot(&land, Some(&water), &shot) };
    let stage = Stage::new(&scene);
    let tables = stage.tables();
    let sky = (view.eye.z, &stage.sky_table(view.eye.z));
    let datum = (stage.land().origin(), stage.land().extent());
    let scenery = || Scenery::new(&gpu, &tables, datum, sky).expect("it fits");
    let (bare, mut full) = (scenery(), scenery());
    full.set_objects(&gpu, &stage.placed(None)).expect("they fit");
    let shape = ShapeTexture::new(&gpu, stage.land()).expect("it fits");
    let mut renderer = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
    let cases = [("without", &bare, 1.0), ("all in full", &full, 1e-9), ("within a pixel", &full, 1.0)];
    let mut times = [const { Vec::new() }; 3];
    let mut triangles = [0; 3];
    // The first frames warm up.
    for frame in 0..11 {
        for (i, (_, scenery, tolerance_pixels)) in cases.into_iter().enumerate() {
            let view = View { tolerance_pixels, ..view };
            let start = Instant::now();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let ground = Ground::Rays { shape: &shape, pixels: 0.0 };
            renderer.draw(&gpu, &mut encoder, scenery, ground, &view, Look::default());
            gpu.queue.submit([encoder.finish()]);
            drop(gpu.device.poll(wgpu::PollType::wait_indefinitely()));
            triangles[i] = renderer.object_triangles();
            if frame > 1 {
                times[i].push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    let total: usize = objects.iter().map(|object| object.object.forms()[0].triangles.len()).sum();
    println!("{} objects of {total} triangles, 1280 × 720", objects.len());
    for (((name, ..), mut times), triangles) in cases.into_iter().zip(times).zip(triangles) {
        times.sort_by(f64::total_cmp);
        println!("  {name}: {:.1} ms, {triangles} triangles drawn", times[times.len() / 2]);
    }
}

/// As many objects on land and water before the eye as are a million triangles.
fn field(water: &Water, view: &View) -> Vec<Standing> {
    let (tower, float) = (Arc::new(lighthouse()), Arc::new(buoy()));
    let ahead = view.direction(0.5 * view.size.as_vec2()).as_dvec3().truncate().normalize();
    let (mut objects, mut triangles) = (Vec::new(), 0);
    for i in 0.. {
        // A fan of places that opens as the view does.
        let (row, column) = (i / 24, i % 24);
        let away = 300.0 + 70.0 * f64::from(row);
        let aside = (f64::from(column) / 23.0 - 0.5) * 1.1 * away;
        let place = view.eye.truncate() + ahead * away + DVec2::new(ahead.y, -ahead.x) * aside;
        let object = if water.covers(place) { &float } else { &tower };
        triangles += object.forms()[0].triangles.len();
        objects.push(Standing::at(object, place));
        if triangles >= 1_000_000 {
            return objects;
        }
    }
    objects
}
