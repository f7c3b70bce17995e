//! `littoral bench`: how fast this version is on this machine.

mod gpu;
mod lod;

use crate::talk::{Failure, Talk, progress, tidy};
use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use littoral::field::{Land, RangePyramid, Raster, noise::Fbm};
use littoral::raycast::{LocalRay, Simd, Station, Viewshed};
use littoral::space::View;
use rayon::prelude::*;
use serde::Serialize;
use std::hint::black_box;
use std::time::Instant;

/// Measure the speed of this machine and this version.
///
/// One fixed scene, made by noise, and one thread unless a line says otherwise. Numbers are the medians of several runs;
/// on a busy machine they say little.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral bench rays
  littoral bench rays --size 1025 --json
  littoral bench lod --tolerance 2
  littoral bench gpu
  littoral bench gpu dem.tif --size 1920x1080 --out sheet.png")]
pub struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    /// Rays, lines of sight, heights and a viewshed against mountains of 30 × 30 km
    Rays(Rays),
    /// All methods of detail along the same flights: triangles, true error in pixels, popping, time
    Lod(lod::Lod),
    /// The same views by the processor and by the graphics adapter: time, and what differs
    Gpu(gpu::GpuBench),
}

#[derive(clap::Args)]
struct Rays {
    /// Samples along a side of the map
    #[arg(long, default_value = "4097", value_parser = clap::value_parser!(u32).range(65..=16_385))]
    size: u32,
}

impl Bench {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        match self.what {
            What::Rays(rays) => rays.run(talk),
            What::Lod(lod) => lod.run(talk),
            What::Gpu(gpu) => gpu.run(talk),
        }
    }
}

/// Side of the map (m).
const SIDE: f64 = 30_000.0;
/// The frame whose rays are counted.
const FRAME: UVec2 = UVec2::new(1920, 1080);
/// Runs of which the median is taken.
const RUNS: usize = 5;

#[derive(Serialize)]
struct Answer {
    map: u32,
    simd: String,
    threads: usize,
    build_ms: f64,
    bytes_per_sample: f64,
    low: Camera,
    high: Camera,
    lines_of_sight_m_per_s: f64,
    lines_of_sight_visible: f64,
    heights_single_m_per_s: f64,
    heights_bulk_m_per_s: f64,
    viewshed_ms: f64,
    frames: Vec<Frame>,
}

/// Millions of rays a second of one camera.
#[derive(Serialize)]
struct Camera {
    single: f64,
    stream: f64,
    coherent: f64,
    shadows: f64,
    hit: f64,
}

/// Primary rays of a whole frame on a map.
#[derive(Serialize)]
struct Frame {
    map: u32,
    ms: f64,
    ms_all_threads: f64,
}

impl Rays {
    fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let bar = progress(9, "measuring");
        let land = mountains(self.size);
        bar.inc(1);
        let samples = land.raster().heights().len() as f64;
        let build = median(3, || drop(black_box(RangePyramid::new(land.raster()))));
        bar.inc(1);
        let low = camera(&land, DVec2::splat(0.1), 50.0, -5.0);
        bar.inc(1);
        let high = camera(&land, DVec2::splat(0.2), 3000.0, -45.0);
        bar.inc(1);
        let (sights, visible) = lines_of_sight(&land);
        bar.inc(1);
        let (single, bulk) = heights(&land);
        bar.inc(1);
        let mut seen = vec![0; land.raster().heights().len()];
        let observer = Station { position: DVec2::ZERO, above_ground: 10.0 };
        let viewshed = median(3, || {
            // The middle of the map is land: this cannot fail, and a failure would only time nothing.
            let _ = black_box(land.viewshed(observer, &Viewshed::default(), &mut seen));
        });
        bar.inc(1);
        let frames = [257, 1025, 4097].into_iter().map(frame).collect();
        bar.finish_and_clear();
        let answer = Answer {
            map: self.size,
            simd: format!("{:?}", Simd::best()).to_lowercase(),
            threads: rayon::current_num_threads(),
            build_ms: build * 1e3,
            bytes_per_sample: land.bytes() as f64 / samples,
            low,
            high,
            lines_of_sight_m_per_s: sights,
            lines_of_sight_visible: visible,
            heights_single_m_per_s: single,
            heights_bulk_m_per_s: bulk,
            viewshed_ms: viewshed * 1e3,
            frames,
        };
        if talk.json() { talk.print_json(answer) } else { talk.print(answer.table()) }
    }
}

impl Answer {
    fn table(&self) -> String {
        let mut text = format!(
            "map of {0} × {0} samples, {1} km a side, {2}, one thread; millions a second, medians of {RUNS} runs\n\n\
             primary rays              low camera   high camera\n",
            self.map,
            SIDE / 1000.0,
            self.simd
        );
        let mut pair = |name: &str, low: f64, high: f64| {
            text += &format!("  {name:<22} {low:>11.2} {high:>13.2}\n");
        };
        pair("one by one", self.low.single, self.high.single);
        pair("independent, streamed", self.low.stream, self.high.stream);
        pair("of one view", self.low.coherent, self.high.coherent);
        pair("shadows, streamed", self.low.shadows, self.high.shadows);
        let percent = |share: f64| format!("{} %", tidy(100.0 * share, 1));
        let mut line = |name: &str, value: String| text += &format!("{name:<24} {value:>12}\n");
        line("\nlines of sight", format!("{:.2}", self.lines_of_sight_m_per_s));
        line("  of which visible", percent(self.lines_of_sight_visible));
        line("heights, one by one", format!("{:.1}", self.heights_single_m_per_s));
        line("heights in bulk", format!("{:.1}", self.heights_bulk_m_per_s));
        line("viewshed, all threads", format!("{:.0} ms", self.viewshed_ms));
        line("building the pyramid", format!("{:.1} ms", self.build_ms));
        line("memory", format!("{:.2} B a sample", self.bytes_per_sample));
        text += &format!("\nprimary rays of a frame of {}x{}, high camera\n", FRAME.x, FRAME.y);
        for frame in &self.frames {
            text += &format!(
                "  map of {0:>4} × {0:<4}  {1:>8.1} ms, on {2} threads {3:.1} ms\n",
                frame.map, frame.ms, self.threads, frame.ms_all_threads
            );
        }
        text
    }
}

/// Seconds of the median run.
fn median(runs: usize, mut work: impl FnMut()) -> f64 {
    let mut seconds: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[runs / 2]
}

/// Mountains of two kilometres, the same at every resolution but for detail that a coarse one cannot hold.
fn mountains(side: u32) -> Land {
    let step = SIDE / f64::from(side - 1);
    let noise = Fbm::new(8000.0, 900.0, 10, 5);
    let heights = (0..side)
        .into_par_iter()
        .flat_map_iter(|row| {
            (0..side).map(move |column| noise.at(DVec2::new(f64::from(column), f64::from(row)) * step).value as f32)
        })
        .collect();
    match Raster::new(side as usize, side as usize, DVec2::splat(step), heights) {
        Ok(raster) => Land::new(raster),
        Err(error) => unreachable!("{error}"),
    }
}

/// A view from a fraction of the map, so many metres above the ground, looking north-east.
fn view(land: &Land, at: DVec2, above: f64, pitch: f64) -> View {
    let position = land.origin() + at * land.extent();
    let eye = position.extend(f64::from(land.height_at(position).unwrap_or(0.0)) + above);
    let (bearing, pitch) = (45f64.to_radians(), pitch.to_radians());
    let ahead = DVec3::new(bearing.sin() * pitch.cos(), bearing.cos() * pitch.cos(), pitch.sin());
    View::looking_at(eye, eye + ahead * 1000.0, 60f32.to_radians(), FRAME)
}

fn camera(land: &Land, at: DVec2, above: f64, pitch: f64) -> Camera {
    let view = view(land, at, above, pitch);
    let (corner, right, down) = view.frame();
    let direction = |i: u32| corner + right * ((i % FRAME.x) as f32 + 0.5) + down * ((i / FRAME.x) as f32 + 0.5);
    let rays: Vec<LocalRay> = (0..FRAME.x * FRAME.y).map(|i| LocalRay::new(Vec3::ZERO, direction(i))).collect();
    let millions = rays.len() as f64 / 1e6;
    let caster = land.caster(view.eye);

    let single = median(RUNS, || {
        for ray in &rays {
            black_box(caster.first_hit(ray));
        }
    });
    let mut distances = vec![0.0; rays.len()];
    let stream = median(RUNS, || caster.first_hits(&rays, &mut distances));
    let towards_sun = Vec3::new(0.8, -0.5, 0.343);
    let seen = rays.iter().zip(&distances).filter(|(_, distance)| distance.is_finite());
    let shadow_rays: Vec<LocalRay> =
        seen.map(|(ray, &distance)| LocalRay::new(ray.direction * distance + Vec3::Z * 0.05, towards_sun)).collect();
    let mut shaded = vec![false; shadow_rays.len()];
    let shadows = median(RUNS, || caster.any_hits(&shadow_rays, &mut shaded));
    let coherent = median(RUNS, || caster.view_hits(&view, Vec2::splat(0.5), 0..FRAME.y, &mut distances));
    Camera {
        single: millions / single,
        stream: millions / stream,
        coherent: millions / coherent,
        shadows: shadow_rays.len() as f64 / 1e6 / shadows.max(1e-9),
        hit: shadow_rays.len() as f64 / rays.len() as f64,
    }
}

/// The n-th point of a sequence that fills the unit square evenly (R2: M. Roberts, 2018), folded to look random in order.
fn scattered(n: u32) -> DVec2 {
    let n = f64::from(n.reverse_bits() >> 8);
    DVec2::new((n * 0.754_877_666_246_692_8).fract(), (n * 0.569_840_290_998_053_2).fract())
}

/// Lines between points 10 m above the ground: millions a second, and the share that is visible.
fn lines_of_sight(land: &Land) -> (f64, f64) {
    let caster = land.caster(DVec3::ZERO);
    let stand = |n: u32| {
        let at = land.origin() + scattered(n) * land.extent();
        at.extend(f64::from(land.height_at(at).unwrap_or(0.0)) + 10.0).as_vec3()
    };
    let lines: Vec<[Vec3; 2]> = (0..200_000).map(|i| [stand(2 * i), stand(2 * i + 1)]).collect();
    let mut visible = vec![false; lines.len()];
    let seconds = median(RUNS, || caster.lines_of_sight(&lines, &mut visible));
    let share = visible.iter().filter(|v| **v).count() as f64 / lines.len() as f64;
    (lines.len() as f64 / 1e6 / seconds, share)
}

/// Heights at scattered points: millions a second one by one, and in bulk.
fn heights(land: &Land) -> (f64, f64) {
    let places: Vec<DVec2> = (0..1 << 20).map(|n| land.origin() + scattered(n) * land.extent()).collect();
    let single = median(RUNS, || {
        for &place in &places {
            black_box(land.height_at(place));
        }
    });
    let mut found = vec![0.0; places.len()];
    let bulk = median(RUNS, || land.heights_at(&places, &mut found));
    let millions = places.len() as f64 / 1e6;
    (millions / single, millions / bulk)
}

fn frame(map: u32) -> Frame {
    let land = mountains(map);
    let view = view(&land, DVec2::splat(0.2), 3000.0, -45.0);
    let caster = land.caster(view.eye);
    let mut distances = vec![0.0; (FRAME.x * FRAME.y) as usize];
    let one = median(RUNS, || caster.view_hits(&view, Vec2::splat(0.5), 0..FRAME.y, &mut distances));
    let all = median(RUNS, || caster.par_view_hits(&view, Vec2::splat(0.5), &mut distances));
    Frame { map, ms: one * 1e3, ms_all_threads: all * 1e3 }
}
