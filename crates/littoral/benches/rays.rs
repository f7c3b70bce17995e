//! Rays, heights and lines of sight per second on one fixed scene, on one thread.
//!
//! The scene is 30 km of fractal noise in 4097² samples, or the raw `f32` heights of 4097² samples that the environment
//! variable `LITTORAL_MAP` names. Cameras: *low*, 50 m above the ground and looking 5° down; *high*, 3000 m above and 45°
//! down; both north-east, 60° vertically, 1920 × 1080 pixels. Medians of processor time.

mod clock;

use clock::median;
use glam::{DVec2, DVec3, Mat3, UVec2, Vec2, Vec3};
use littoral::field::noise::Fbm;
use littoral::field::{Land, RangePyramid, Raster};
use littoral::memory::collected;
use littoral::raycast::{LocalRay, Simd};
use littoral::space::{Ray, View};
use std::hint::black_box;

const EXTENT: f64 = 30_000.0;
const SIZE: UVec2 = UVec2::new(1920, 1080);
const QUERIES: usize = 1_000_000;

fn main() {
    let land = match std::env::var("LITTORAL_MAP") {
        Ok(path) => measured(&path),
        Err(_) => invented(4097),
    };
    println!("{} × {} samples, {:?}, one thread", land.raster().columns(), land.raster().rows(), Simd::best());
    let seconds = median(5, || drop(black_box(RangePyramid::new(land.raster()))));
    println!(
        "pyramid built in {:.1} ms; {:.2} bytes a sample",
        seconds * 1e3,
        land.bytes() as f64 / land.raster().heights().len() as f64
    );
    for (name, from, up, pitch) in [("low", 0.1, 50.0, -5.0), ("high", 0.2, 3000.0, -45.0)] {
        cameras(&land, name, view(&land, from, up, pitch));
    }
    queries(&land);
    drop(land);
    // The claim of the method: the time of a frame hardly depends on the map's size.
    for samples in [257, 1025, 4097] {
        let land = invented(samples);
        let view = view(&land, 0.1, 300.0, -8.0);
        let mut distances = vec![0.0; (SIZE.x * SIZE.y) as usize];
        let caster = land.caster(view.eye);
        let seconds = median(5, || caster.view_hits(&view, Vec2::splat(0.5), 0..SIZE.y, &mut distances));
        println!("frame of primary rays over {samples}² samples: {:.1} ms", seconds * 1e3);
    }
}

/// Primary rays one by one, as a stream and as a view, and shadow rays of what they hit.
fn cameras(land: &Land, name: &str, view: View) {
    let (corner, right, down) = view.frame();
    let direction = |index: usize| {
        let (x, y) = (index % SIZE.x as usize, index / SIZE.x as usize);
        corner + right * (x as f32 + 0.5) + down * (y as f32 + 0.5)
    };
    let rays: Vec<LocalRay> =
        (0..(SIZE.x * SIZE.y) as usize).map(|i| LocalRay::new(Vec3::ZERO, direction(i))).collect();
    let exact: Vec<Ray> = rays.iter().step_by(7).map(|ray| Ray::new(view.eye, ray.direction.as_dvec3())).collect();
    let seconds = median(3, || {
        exact.iter().for_each(|ray| {
            black_box(land.first_hit(ray));
        })
    });
    print!("{name}: exact {:.2}", exact.len() as f64 / seconds * 1e-6);
    let caster = land.caster(view.eye);
    let seconds = median(5, || {
        rays.iter().for_each(|ray| {
            black_box(caster.first_hit(ray));
        })
    });
    print!(", single {:.2}", rays.len() as f64 / seconds * 1e-6);
    let mut distances = vec![0.0; rays.len()];
    let seconds = median(5, || caster.first_hits(&rays, &mut distances));
    print!(", stream {:.2}", rays.len() as f64 / seconds * 1e-6);
    let lifted = |(ray, t): (&LocalRay, &f32)| {
        t.is_finite().then(|| LocalRay::new(ray.direction * *t + Vec3::Z * 0.05, Vec3::new(0.8, -0.5, 0.343)))
    };
    let shadows: Vec<LocalRay> = rays.iter().zip(&distances).filter_map(lifted).collect();
    let mut shaded = vec![false; shadows.len()];
    let seconds = median(5, || caster.any_hits(&shadows, &mut shaded));
    print!(", shadow {:.2}", shadows.len() as f64 / seconds * 1e-6);
    let seconds = median(5, || caster.view_hits(&view, Vec2::splat(0.5), 0..SIZE.y, &mut distances));
    print!(", view {:.2}", rays.len() as f64 / seconds * 1e-6);
    let seconds = median(5, || caster.view_hits_by_footprint(&view, Vec2::splat(0.5), 1.0, 0..SIZE.y, &mut distances));
    println!(", by footprint {:.2} million rays a second", rays.len() as f64 / seconds * 1e-6);
}

/// Heights at random places, and lines of sight between random places 2 m and 400 m above the ground.
fn queries(land: &Land) {
    let mut random = random(88_172_645_463_325_252);
    let places: Vec<DVec2> = (0..QUERIES).map(|_| DVec2::new(random(), random()) * (EXTENT * 0.9999)).collect();
    let mut heights = vec![0.0; QUERIES];
    let seconds = median(7, || land.heights_at(&places, &mut heights));
    println!("heights: {:.1} million a second", QUERIES as f64 / seconds * 1e-6);
    let middle = DVec2::splat(0.5 * EXTENT).extend(0.0);
    let caster = land.caster(middle);
    for up in [2.0, 400.0] {
        let mut end = |_| {
            let xy = DVec2::new(random(), random()) * (EXTENT * 0.9999);
            (xy.extend(ground(land, xy) + up) - middle).as_vec3()
        };
        let segments: Vec<[Vec3; 2]> = (0..QUERIES).map(|_| [0, 1].map(&mut end)).collect();
        let mut visible = vec![false; QUERIES];
        let seconds = median(5, || caster.lines_of_sight(&segments, &mut visible));
        let blocked = visible.iter().filter(|visible| !**visible).count() as f64 / QUERIES as f64;
        println!(
            "lines of sight {up} m up: {:.2} million a second, {:.1} % blocked",
            QUERIES as f64 / seconds * 1e-6,
            100.0 * blocked
        );
    }
}

/// The height of the sample south-west of a place.
fn ground(land: &Land, xy: DVec2) -> f64 {
    let at = (xy / land.raster().spacing()).as_usizevec2();
    f64::from(land.raster().heights()[at.y * land.raster().columns() + at.x])
}

fn view(land: &Land, from: f64, up: f64, pitch_degrees: f64) -> View {
    let xy = DVec2::splat(from * EXTENT);
    let eye = xy.extend(ground(land, xy) + up);
    let ((sin_yaw, cos_yaw), (sin, cos)) = (45f64.to_radians().sin_cos(), pitch_degrees.to_radians().sin_cos());
    let forward = DVec3::new(cos * cos_yaw, cos * sin_yaw, sin);
    let right = DVec3::new(sin_yaw, -cos_yaw, 0.0);
    let axes = Mat3::from_cols(right.as_vec3(), right.cross(forward).as_vec3(), -forward.as_vec3());
    View::oriented(eye, axes, 60f32.to_radians(), SIZE)
}

fn invented(samples: usize) -> Land {
    let noise = Fbm::new(9000.0, 1500.0, 11, 7);
    let step = EXTENT / (samples - 1) as f64;
    let height = |i: usize| noise.at(DVec2::new((i % samples) as f64, (i / samples) as f64) * step).value as f32;
    let heights = collected((0..samples * samples).map(height));
    Land::at(Raster::new(samples, samples, DVec2::splat(step), heights).expect("finite heights"), DVec2::ZERO)
}

fn measured(path: &str) -> Land {
    let bytes = std::fs::read(path).expect("LITTORAL_MAP names a readable file");
    let heights = collected(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    Land::at(Raster::new(4097, 4097, DVec2::splat(EXTENT / 4096.0), heights).expect("4097² heights"), DVec2::ZERO)
}

/// Uniform numbers in [0, 1) (xorshift).
fn random(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}
