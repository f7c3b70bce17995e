//! ROAM in flight: milliseconds a frame, splits and merges a second, work against speed; from scratch, over a sea, and with a clock.
//!
//! The flight is at 60 frames/s, 300 m above the ground ahead, 60° vertically, 1920 × 1080 pixels. Processor time.
//!
//! `cargo bench -p littoral --bench roam -- [scratch] [flight] [clock] [csv] [sea] [1999]`: all of them but `csv` if none is named; `csv` prints a table of
//! work against speed.

mod clock;
mod scene;

use clock::{median, processor_time};
use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use littoral::field::{Land, Raster, Sea, coast};
use littoral::lod::{Drawing, Limits, Lod, Mesh, NestedBounds, Priority, Roam, RoamFlight, RoamOnce, RoamSea};
use littoral::space::{Datum, View};
use littoral::waves::{Depths, Length, Path, Peachey, Sine, Sines, StillWater, Superposition, Surf, Swell};
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with('-')).collect();
    let wanted = |part: &str| asked.iter().any(|arg| arg == part) || asked.is_empty() && part != "csv";
    if wanted("1999") {
        sea_of_1999();
    }
    if wanted("sea") {
        sea();
    }
    if !["scratch", "flight", "clock", "csv"].into_iter().any(wanted) {
        return;
    }
    let land = scene::mountains();
    let begin = processor_time();
    let bounds = NestedBounds::of(&land).expect("few samples");
    eprintln!(
        "prepared in {:.2} s of processor time, {:.1} bytes a sample, heights included",
        processor_time() - begin,
        bounds.bytes() as f64 / land.raster().heights().len() as f64
    );
    let scene = Scene { land: &land, bounds: &bounds };
    if wanted("scratch") {
        scene.scratch();
    }
    if wanted("flight") {
        scene.flights();
    }
    if wanted("clock") {
        scene.clock();
    }
    if wanted("csv") {
        scene.table();
    }
}

#[derive(Clone, Copy)]
struct Scene<'a> {
    land: &'a Land,
    bounds: &'a NestedBounds,
}

/// What a flight cost.
struct Flown {
    /// Milliseconds a frame, in rising order.
    ms: Vec<f64>,
    /// Diamonds split and merged a frame.
    changed: f64,
    /// Millions of bisections and merges a second, the rest of the frames included.
    rate: f64,
    triangles: usize,
    pixels: f32,
    sent: f64,
}

impl Flown {
    fn median(&self) -> f64 {
        self.ms[self.ms.len() / 2]
    }

    fn most(&self) -> f64 {
        self.ms[self.ms.len() * 99 / 100]
    }
}

impl Scene<'_> {
    /// The view at a time of a flight.
    fn view(&self, (speed, yaw): (f64, f64), time: f64) -> View {
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
        let at = self.land.origin() + self.land.extent() * 0.25 + way;
        let ground = f64::from(self.land.height_at(at).unwrap_or(0.0));
        let pitch = -8f64.to_radians();
        let forward = DVec3::new(turned.cos() * pitch.cos(), turned.sin() * pitch.cos(), pitch.sin());
        let eye = at.extend(ground + 300.0);
        let mut view = View::looking_at(eye, eye + forward, 60f32.to_radians(), UVec2::new(1920, 1080));
        view.tolerance_pixels = 0.01;
        view
    }

    fn fly(&self, triangles: usize, way: (f64, f64), frames: usize) -> Flown {
        let mut flight = RoamFlight::over(self.bounds, Limits { finest: 12, triangles });
        flight.update(&self.view(way, 0.0), &mut || false).expect("a view");
        let before = flight.operations();
        let mut ms = Vec::with_capacity(frames);
        let (mut told, mut pixels) = (0, 0.0f32);
        for frame in 1..=frames {
            let view = self.view(way, frame as f64 / 60.0);
            let begin = processor_time();
            let reached = flight.update(&view, &mut || false).expect("a view");
            black_box(flight.mesh());
            ms.push((processor_time() - begin) * 1e3);
            pixels = reached.pixels;
            told += flight.changed_triangles().map(|range| range.len()).sum::<usize>();
        }
        let (splits, merges) = flight.operations();
        let operations = (splits - before.0 + merges - before.1) as f64;
        let rate = 2e-3 * operations / ms.iter().sum::<f64>();
        ms.sort_by(f64::total_cmp);
        let (changed, sent) = (operations / frames as f64, told as f64 / frames as f64);
        Flown { ms, changed, rate, triangles: flight.mesh().triangles.len(), pixels, sent }
    }

    fn flights(&self) {
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
                ("6000 m/s", 6000.0, 0.0),
                ("10°/s", 0.0, 10.0),
                ("100 m/s, 10°/s", 100.0, 10.0),
                ("1000 m/s, 10°/s", 1000.0, 10.0),
            ] {
                // The fastest stay over the land.
                let frames = (900_000.0 / f64::max(speed, 1.0)) as usize;
                let flown = self.fly(triangles, (speed, yaw), frames.min(if triangles > 500_000 { 150 } else { 400 }));
                println!(
                    "{name:>16}: {:.3} / {:.3}; {:.0}; {:.1} M/s; {} triangles, {:.2} pixels reached; {:.0} triangles sent",
                    flown.median(),
                    flown.most(),
                    flown.changed,
                    flown.rate,
                    flown.triangles,
                    flown.pixels,
                    flown.sent,
                );
            }
        }
    }

    /// Work against speed.
    fn table(&self) {
        println!("triangles,metres_per_second,diamonds_per_frame,ms_median,ms_99");
        for (triangles, frames) in [(100_000, 240), (1_000_000, 60)] {
            for speed in [0, 10, 30, 100, 200, 300, 500, 700, 1000, 1500, 2000, 2500, 3000] {
                let flown = self.fly(triangles, (f64::from(speed), 0.0), frames);
                println!("{triangles},{speed},{:.1},{:.4},{:.4}", flown.changed, flown.median(), flown.most());
            }
        }
    }

    /// Frames that are stopped by the clock, beside those that are not.
    fn clock(&self) {
        const BUDGET: f64 = 0.2e-3;
        println!(
            "100000 triangles, stopped after 0.2 ms: ms a frame, median / 99 %; greatest priority over that of unstopped frames, median / 99 %"
        );
        for (name, speed, yaw) in [
            ("100 m/s", 100.0, 0.0),
            ("300 m/s", 300.0, 0.0),
            ("1000 m/s", 1000.0, 0.0),
            ("5°/s", 0.0, 5.0),
            ("10°/s", 0.0, 10.0),
        ] {
            let over = || RoamFlight::over(self.bounds, Limits { finest: 12, triangles: 100_000 });
            let (mut stopped, mut whole) = (over(), over());
            for flight in [&mut stopped, &mut whole] {
                flight.update(&self.view((speed, yaw), 0.0), &mut || false).expect("a view");
            }
            let (mut ms, mut ratios, mut late) = (Vec::new(), Vec::new(), 0);
            // What frames took after they were stopped, of which the next are to leave room for the most.
            let mut rests = [0.0f64; 8];
            for frame in 1..=400 {
                let view = self.view((speed, yaw), f64::from(frame) / 60.0);
                let most = BUDGET - rests.iter().fold(0.0, |a: f64, &b| a.max(b));
                let begin = processor_time();
                let mut end = None;
                let mut stop = || {
                    let now = processor_time();
                    end = (now - begin > most).then_some(now);
                    end.is_some()
                };
                let reached = stopped.update(&view, &mut stop).expect("a view");
                let done = processor_time();
                ms.push((done - begin) * 1e3);
                if let Some(end) = end {
                    late += 1;
                    rests[frame as usize % 8] = (done - end).min(0.25 * BUDGET);
                }
                let best = whole.update(&view, &mut || false).expect("a view");
                ratios.push(f64::from(reached.pixels / best.pixels));
            }
            ms.sort_by(f64::total_cmp);
            ratios.sort_by(f64::total_cmp);
            let (mid, most) = (ms.len() / 2, ms.len() * 99 / 100);
            println!(
                "{name:>16}: {:.3} / {:.3}, {:.1} % of frames within 10 %; {:.3} / {:.3}; {late} of {} frames stopped",
                ms[mid],
                ms[most],
                100.0 * ms.iter().filter(|&&ms| ms <= 1.1e3 * BUDGET).count() as f64 / ms.len() as f64,
                ratios[mid],
                ratios[most],
                ms.len()
            );
        }
    }

    /// A mesh from nothing.
    fn scratch(&self) {
        for triangles in [100_000, 1_000_000] {
            let limits = Limits { finest: 12, triangles };
            let view = self.view((0.0, 0.0), 0.0);
            let (mut once, mut mesh) = (RoamOnce::over(self.bounds, limits), Mesh::default());
            let seconds = median(7, || {
                once.draw(&view, &mut mesh).expect("a view");
            });
            let rate = |seconds: f64| triangles as f64 / seconds * 1e-6;
            println!("{triangles} triangles at once: {:.2} ms, {:.1} M bisections/s", seconds * 1e3, rate(seconds));
            let mut flight = RoamFlight::over(self.bounds, limits);
            let seconds = median(5, || {
                flight.restart();
                flight.update(&view, &mut || false).expect("a view");
            });
            println!(
                "{triangles} triangles for a flight: {:.2} ms, {:.1} M bisections/s",
                seconds * 1e3,
                rate(seconds)
            );
        }
    }
}

/// Seas that move: the 128 waves of `littoral bench lod`, and tiles.
fn sea() {
    let datum = Datum::Plane { origin: DVec2::splat(-1500.0), size: DVec2::splat(3000.0) };
    let waves = Superposition::of_state(&coast::sea_state(), 16, 8).expect("a sea");
    over_sea("128 waves", Sea::new(datum, 0.0).with(Box::new(waves)));
    over_sea("tiles", Sea::of_state(datum, 0.0, &coast::sea_state()).expect("a sea"));
}

/// The view of a flight over the sea at 20 m/s.
fn over_waves(time: f64) -> View {
    let eye = DVec3::new(-500.0 + 20.0 * time, -800.0, 25.0);
    let target = eye + DVec3::new(300.0, 900.0, -120.0);
    let mut view = View::looking_at(eye, target, 60f32.to_radians(), UVec2::new(1280, 720));
    view.tolerance_pixels = 1.0;
    view
}

fn over_sea(name: &str, mut sea: Sea) {
    let view = over_waves(0.0);
    for triangles in [100_000, 1_000_000] {
        for lateness in [0.0, 0.25] {
            let mut flight = RoamSea::new(Limits { finest: 12, triangles }).with_lateness(lateness);
            let (mut ms, mut waited, mut asked) = (Vec::new(), Vec::new(), Vec::new());
            let mut pixels = 0.0f32;
            for frame in 0..90 {
                let time = f64::from(frame) / 60.0;
                sea.set_time(time);
                let begin = Instant::now();
                let mut chosen = begin;
                let mut stop = || {
                    chosen = Instant::now();
                    false
                };
                let reached = flight.update(&sea, &over_waves(time), &mut stop).expect("a view");
                // The first frames come from nothing, and all at once.
                if frame >= 30 {
                    ms.push((chosen - begin).as_secs_f64() * 1e3);
                    waited.push(chosen.elapsed().as_secs_f64() * 1e3);
                    asked.push(flight.heights_asked() as f64);
                    pixels = pixels.max(reached.pixels);
                }
            }
            [&mut ms, &mut waited, &mut asked].into_iter().for_each(|all| all.sort_by(f64::total_cmp));
            println!(
                "{name}, {} triangles from frame to frame, lateness {lateness}: choice {:.2} / {:.2} ms, heights {:.2} / {:.2} ms (median / 99 %, by the \
                 wall), {:.0} of {} asked a frame, {pixels:.2} pixels reached",
                flight.mesh().triangles.len(),
                ms[30],
                ms[59],
                waited[30],
                waited[59],
                asked[30],
                flight.mesh().vertices.len()
            );
        }
        let mut roam = Roam::new(Limits { finest: 12, triangles });
        let mut drawing = Drawing::default();
        let mut time = 0.0;
        let seconds = median(3, || {
            time += 1.0;
            sea.set_time(time);
            roam.select(&sea, &view, &mut drawing).expect("a view");
        });
        println!(
            "{name}, {} triangles from scratch: {:.0} ms of processor time, heights included",
            drawing.mesh.triangles.len(),
            seconds * 1e3
        );
    }
}

/// The set-up of 1999: 1500 triangles over 3000 × 2000 m of sea, the nearest first; heights, normals and texture coordinates in each frame. The sea is
/// four waves of 4 to 11 s: sines over deep water, or Peachey's along straight rays over a bed that falls from 5 to 45 m.
fn sea_of_1999() {
    let size = DVec2::new(3000.0, 2000.0);
    let waves = [(0.8, 11.0, -1.6), (0.4, 7.0, -1.2), (0.2, 5.0, -2.0), (0.1, 4.0, -1.4)];
    let calm = || Sea::new(Datum::Plane { origin: DVec2::ZERO, size }, 0.0);
    let sine = |(amplitude, period, heading): (f64, f64, f64)| Sine {
        amplitude,
        length: Length::Period(period),
        heading,
        phase: heading,
        steepness: 0.0,
    };
    let sines = Sines::new(&waves.map(sine), StillWater::DEEP).expect("waves");
    frames_of_1999("four sines", calm().with(Box::new(sines)), size);
    let (columns, rows) = (61, 41);
    let depths = (0..columns * rows).map(|i| 5.0 + 40.0 * (i / columns) as f32 / (rows - 1) as f32).collect();
    let bed = Depths { origin: DVec2::ZERO, spacing: 50.0, columns, rows, depths };
    let swell = |(amplitude, period, heading): (f64, f64, f64)| Swell { amplitude, period, heading, phase: heading };
    let peachey = Peachey::new(&bed, &waves.map(swell), Path::Straight, Surf::default()).expect("waves");
    frames_of_1999("Peachey's four", calm().with(Box::new(peachey)), size);
}

fn frames_of_1999(name: &str, mut sea: Sea, size: DVec2) {
    const SIDE: usize = 1025;
    // The mesh knows how high the water may stand, not how high it stands.
    let most = sea.bounds().height;
    let heights = (0..SIDE * SIDE).map(|i| if i % 2 == 0 { most } else { -most }).collect();
    let raster = Raster::new(SIDE, SIDE, size / (SIDE - 1) as f64, heights).expect("sizes are valid");
    let bounds = NestedBounds::of(&Land::new(raster)).expect("few samples");
    let mut flight = RoamFlight::over(&bounds, Limits { finest: 10, triangles: 1500 });
    flight.priority = Priority::InverseDistance;
    let (mut places, mut waters) = (Vec::new(), Vec::new());
    let (mut positions, mut normals, mut coordinates) = (Vec::new(), Vec::new(), Vec::new());
    let (mut ms, mut selection) = (Vec::new(), Vec::new());
    for frame in 0..600 {
        let time = f64::from(frame) / 60.0;
        let at = size * DVec2::new(0.2, 0.3) + DVec2::new(20.0, 8.0) * time;
        let (yaw, eye) = (0.5 + 0.1 * time, at.extend(12.0));
        let target = eye + DVec3::new(yaw.cos(), yaw.sin(), -0.1);
        let view = View::looking_at(eye, target, 60f32.to_radians(), UVec2::new(800, 600));
        let begin = processor_time();
        flight.update(&view, &mut || false).expect("a view");
        selection.push((processor_time() - begin) * 1e3);
        sea.set_time(time);
        let mesh = flight.mesh();
        places.clear();
        places.extend(mesh.vertices.iter().map(|vertex| vertex.place().uv * size));
        waters.resize(places.len(), 0.0);
        sea.heights_at(&places, &mut waters);
        positions.clear();
        positions.extend(places.iter().zip(&waters).map(|(at, &z)| Vec3::new(at.x as f32, at.y as f32, z as f32)));
        normals.clear();
        normals.resize(positions.len(), Vec3::ZERO);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| positions[i as usize]);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|&i| normals[i as usize] += normal);
        }
        normals.iter_mut().for_each(|normal| *normal = normal.normalize_or(Vec3::Z));
        coordinates.clear();
        coordinates.extend(positions.iter().map(|at| Vec2::new(at.x, at.y) / 16.0));
        black_box((&positions, &normals, &coordinates));
        ms.push((processor_time() - begin) * 1e3);
    }
    for times in [&mut ms, &mut selection] {
        times.sort_by(f64::total_cmp);
    }
    println!(
        "1999, {name}: {} triangles, {} vertices over 3 × 2 km: {:.3} / {:.3} ms a frame (median / 99 %), of which {:.3} / {:.3} the choice of triangles",
        flight.mesh().triangles.len(),
        flight.mesh().vertices.len(),
        ms[300],
        ms[594],
        selection[300],
        selection[594]
    );
}
