//! The sea over a bed, on one thread: solving for it, and asking for it near land; and asking a whole sea where the water is.
//!
//! The scene is fixed: a bed of 400 × 600 nodes, 4 m apart, that rises to a wavy beach with an island before it, and the 32 waves of 7 Beaufort that
//! carry most of its energy. Points lie on rows across the surf, 25 cm, 1 m or 4 m apart, or at random over the bed. Medians of processor
//! time; `LITTORAL_BENCH=points` leaves out all but the points.

mod clock;

use clock::median;
use glam::{DVec2, DVec3, Vec3};
use littoral::field::Sea;
use littoral::space::Datum;
use littoral::waves::cascades::{Cascades, Options, Tile};
use littoral::waves::shore::{Bed, ShoreSea};
use littoral::waves::{BLOCK, Motion, Points, SeaState, Superposition, Velocity, WaveModel, random};
use std::hint::black_box;

const BLOCKS: usize = 4096;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the only pool");
    let only_points = std::env::var("LITTORAL_BENCH").is_ok_and(|what| what == "points");
    let state: SeaState = "beaufort=7,from=190,depth=14".parse().expect("a state");
    let bed = bed(400, 600);
    if !only_points {
        println!("solving for the waves (ms; nodes × waves in millions a second):");
        for (columns, rows, count) in [(200, 300, 32), (400, 600, 16), (400, 600, 32), (400, 600, 64), (800, 600, 32)] {
            let bed = self::bed(columns, rows);
            let seconds = median(5, || drop(black_box(ShoreSea::new(&bed, &state, count))));
            let nodes = (columns * rows) as f64;
            println!(
                "  {columns} × {rows}, {count} waves: {:.0}; {:.1}",
                seconds * 1e3,
                nodes * count as f64 / seconds * 1e-6
            );
        }
    }
    for count in [32, 64] {
        let mut sea = ShoreSea::new(&bed, &state, count).expect("a sea");
        sea.set_time(123.4);
        println!("{count} waves over 400 × 600 nodes, million points a second:");
        for (name, points) in
            [("25 cm", rows(0.25)), ("1 m", rows(1.0)), ("4 m", rows(4.0)), ("random", scattered(1580.0, 2380.0))]
        {
            queries(&sea, name, &points);
        }
    }
    if !only_points {
        seas();
        growth(&state);
    }
}

/// A beach with a point, bays and an island.
fn bed(columns: usize, rows: usize) -> Bed {
    let spacing = DVec2::new(1600.0 / columns as f64, 2400.0 / rows as f64);
    Bed::of(DVec2::ZERO, spacing, columns, rows, |p| {
        let beach =
            0.012 * (1900.0 + 150.0 * (p.x * 0.004).sin() - p.y) + 0.4 * (p.x * 0.03).sin() * (p.y * 0.02).cos();
        let island = 0.04 * ((p.x - 700.0).hypot(p.y - 1100.0) - 120.0);
        beach.min(island).min(14.0)
    })
    .expect("a bed")
}

/// Blocks along rows in the shallows.
fn rows(step: f64) -> Vec<Points> {
    let blocks = (1200.0 / (step * BLOCK as f64)) as usize;
    (0..BLOCKS)
        .map(|i| {
            let x = std::array::from_fn(|l| 200.0 + step * ((i % blocks) * BLOCK + l) as f64);
            Points { x, y: [1300.0 + step * (i / blocks) as f64; BLOCK], footprint: [0.0; BLOCK] }
        })
        .collect()
}

fn scattered(width: f64, height: f64) -> Vec<Points> {
    (0..BLOCKS)
        .map(|i| {
            let place = |l: usize, axis: i64| random::uniform(1, i as i64, l as i64, axis);
            let (x, y) = (std::array::from_fn(|l| width * place(l, 0)), std::array::from_fn(|l| height * place(l, 1)));
            Points { x, y, footprint: [0.0; BLOCK] }
        })
        .collect()
}

fn queries(sea: &dyn WaveModel, name: &str, points: &[Points]) {
    let rate = |work: &mut dyn FnMut()| (points.len() * BLOCK) as f64 * 1e-6 / median(15, work);
    let single = rate(&mut || {
        for points in points {
            let mut motion = Motion::STILL;
            sea.add_displacement(points, &mut motion);
            black_box(motion);
        }
    });
    let mut motions = vec![Motion::STILL; 64];
    let bulk = rate(&mut || {
        for points in points.chunks(64) {
            sea.add_displacements(points, &mut motions);
            black_box(&mut motions);
        }
    });
    let whole = rate(&mut || {
        for points in points {
            let mut motion = Motion::STILL;
            sea.add_motion(points, &mut motion);
            black_box(motion);
        }
    });
    let seen = rate(&mut || {
        for points in points {
            let mut motion = Motion::STILL;
            sea.add_motion(&Points { footprint: [1.5; BLOCK], ..*points }, &mut motion);
            black_box(motion);
        }
    });
    let velocity = rate(&mut || {
        for points in points {
            let mut velocity = Velocity::STILL;
            sea.add_velocity(points, &[0.4; BLOCK], &mut velocity);
            black_box(velocity);
        }
    });
    println!(
        "  {name}: displacement {single:.1}, in bulk {bulk:.1}; all of the motion {whole:.1}, with a footprint {seen:.1}; velocity {velocity:.2}"
    );
}

/// Whole seas asked where the water is, which inverts its sideways motion.
fn seas() {
    let state = SeaState::beaufort(8.0, 0.6).expect("a state");
    let datum = Datum::Plane { origin: DVec2::ZERO, size: DVec2::splat(5e3) };
    for (name, highest) in [("three tiles", 2.5), ("five tiles", Options::default().highest)] {
        let options = Options { highest, ..Options::default() };
        let mut sea = Sea::new(datum, 0.0).with(Box::new(Cascades::new(&state, &options).expect("a sea")));
        sea.set_time(100.0);
        println!("the open sea at 8 Beaufort, {name}, with its sideways motion inverted:");
        for (kind, points) in [("25 cm", rows(0.25)), ("random", scattered(5e3, 5e3))] {
            let places: Vec<DVec2> =
                points.iter().flat_map(|p| (0..BLOCK).map(|l| DVec2::new(p.x[l], p.y[l]))).collect();
            let at = |depth: f64| -> Vec<DVec3> { places.iter().map(|p| p.extend(-depth)).collect() };
            let count = places.len() as f64;
            let mut heights = vec![0.0; places.len()];
            let height = count * 1e-6 / median(9, || sea.heights_at(&places, &mut heights));
            let mut surfaces = vec![sea.surface_at(DVec2::ZERO, 0.0); places.len()];
            let surface = count * 1e-6 / median(9, || sea.surfaces_at(&places, 0.0, &mut surfaces));
            let (below, mut velocities) = (at(2.0), vec![Vec3::ZERO; places.len()]);
            let velocity = median(5, || sea.velocities_at(&below, &mut velocities)) / count * 1e6;
            let worst = surfaces.iter().map(|s| s.residual).fold(0.0, f32::max);
            println!(
                "  {kind}: heights {height:.2} M/s, surfaces {surface:.2} M/s (off by at most {worst:.1e} m), velocities {velocity:.2} µs each"
            );
        }
    }
}

/// What a frame of 256 × 256 points a metre apart takes (ms): going to an instant, and everything about the motion there.
fn growth(state: &SeaState) {
    let points: Vec<Points> = (0..4096)
        .map(|i| Points {
            x: std::array::from_fn(|l| 600.0 + f64::from(i % 16 * 16 + l as i32)),
            y: [1300.0 + f64::from(i / 16); BLOCK],
            footprint: [0.0; BLOCK],
        })
        .collect();
    let mut motions = vec![Motion::STILL; 64];
    let mut frame = |model: &mut dyn WaveModel| {
        let mut now = 0.0;
        let step = median(9, || {
            now += 1.0 / 60.0;
            model.set_time(now);
        });
        let asked = median(9, || {
            for points in points.chunks(64) {
                model.add_motions(points, &mut motions);
                black_box(&mut motions);
            }
        });
        format!("{:.2} + {:.1}", step * 1e3, asked * 1e3)
    };
    println!("a frame of 256 × 256 points, ms to go to an instant + ms to ask:");
    for samples in [128, 256, 512, 1024] {
        let tile = Tile { length: 600.0, turn: 0.3, samples, lowest: 0.02, highest: 0.5 * 0.0052 * samples as f64 };
        let mut sea = Cascades::with_tiles(state, &[tile], &Options::default()).expect("a sea");
        println!("  one tile of {samples}²: {}", frame(&mut sea));
    }
    for (frequencies, directions) in [(8, 4), (16, 8), (32, 16)] {
        let mut sea = Superposition::of_state(state, frequencies, directions).expect("a sea");
        println!("  {} waves summed: {}", frequencies * directions, frame(&mut sea));
    }
    for (columns, rows, count) in
        [(400, 600, 16), (400, 600, 32), (400, 600, 64), (400, 600, 128), (200, 300, 32), (800, 1200, 32)]
    {
        let mut sea = ShoreSea::new(&bed(columns, rows), state, count).expect("a sea");
        println!("  {count} waves over {columns} × {rows} nodes: {}", frame(&mut sea));
    }
}
