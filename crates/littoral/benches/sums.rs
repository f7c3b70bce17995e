//! Waves summed per second at points and over grids, on one thread.
//!
//! The sea is that of S. Liu, X. Xu and C. Chen 2009: 16 × 8 waves of 4 m significant height; the same number drawn from the spectrum, each with
//! its own heading; and trochoids. Points lie on 200 × 200 m, a metre apart, or all over 100 km. Medians of processor time.

mod clock;

use clock::median;
use glam::DVec2;
use littoral::waves::{
    BLOCK, Beach, Grid, GridScratch, Length, Motion, Path, Peachey, PlaneWave, Points, SeaState, Sine, Sines,
    StillWater, Superposition, Surf, Swell, Velocity, WaveModel, components,
};
use std::f64::consts::TAU;
use std::hint::black_box;

const EDGE: usize = 200;

fn main() {
    let state = SeaState::beaufort(6.6, 0.3).expect("a sea state");
    let lattice = Superposition::of_state(&state, 16, 8).expect("a sea");
    let (low, high) = state.band().expect("waves");
    let waves = components::drawn(&state, 128, low, high);
    let drawn = Superposition::new(&waves, StillWater::DEEP).expect("a sea");
    let sine = |wave: &PlaneWave| Sine {
        amplitude: wave.amplitude,
        length: Length::Wavelength(TAU / wave.wavenumber.length()),
        heading: wave.wavenumber.to_angle(),
        phase: wave.phase,
        steepness: 0.5,
    };
    let rows: Vec<Sine> = lattice.waves().map(sine).collect();
    let trochoids = Sines::new(&rows, StillWater::DEEP).expect("waves");

    let near: Vec<DVec2> = (0..EDGE * EDGE).map(|i| DVec2::new((i % EDGE) as f64, (i / EDGE) as f64)).collect();
    let scattered: Vec<DVec2> =
        near.iter().map(|p| DVec2::new(p.x * 7919.0 % 1e5, (p.y * 104_729.0 + p.x * 31.0) % 1e5)).collect();
    let mut heights = vec![0f32; EDGE * EDGE];
    println!("128 waves at 40 000 points, million points a second:");
    for (name, sea) in [("16 × 8", &lattice), ("drawn", &drawn)] {
        let at = rate(|| sea.heights_at(&near, &mut heights));
        let far = rate(|| sea.heights_at(&scattered, &mut heights));
        let mut scratch = GridScratch::default();
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, columns: EDGE, rows: EDGE };
        let filled = rate(|| sea.fill(&grid, &mut scratch, &mut heights));
        let slopes = rate(|| motions(sea, &near));
        println!("{name}: heights {at:.1}, scattered {far:.1}, as a grid {filled:.0}; with slopes {slopes:.1}");
    }
    println!("trochoids, with slopes, displacement and its derivatives {:.1}", rate(|| motions(&trochoids, &near)));

    let shore = vec![DVec2::new(3000.0, 0.0), DVec2::new(900.0, 0.0), DVec2::new(-1000.0, 400.0)];
    let beach = Beach { shore, slope: 0.02, surf_width: 50.0 };
    let bed = beach.depths(DVec2::new(0.0, -2900.0), 5.0, 400, 600).expect("a bed");
    let swell = Swell { amplitude: 0.7, period: 9.0, heading: 1.2, phase: 0.0 };
    for path in [Path::Refracted, Path::Straight] {
        let made = median(21, || drop(black_box(Peachey::new(&bed, &[swell], path, Surf::default()))));
        println!("Peachey's phases over 400 × 600 nodes, {path:?}: {:.0} ms a train", made * 1e3);
    }
    let waves = Peachey::new(&bed, &[swell], Path::Refracted, Surf::default()).expect("waves");
    let off: Vec<DVec2> = near.iter().map(|p| DVec2::new(700.0, -1500.0) + p).collect();
    let all: Vec<DVec2> = scattered.iter().map(|p| DVec2::new(p.x % 1995.0, -p.y % 2900.0)).collect();
    println!("Peachey's waves, one train, million points a second:");
    for (name, places) in [("near each other", &off), ("all over the bed", &all)] {
        let heights = rate(|| displacements(&waves, places));
        let slopes = rate(|| motions(&waves, places));
        let speeds = rate(|| velocities(&waves, places));
        println!("{name}: heights {heights:.1}; with slopes {slopes:.1}; velocities {speeds:.1}");
    }
}

/// Displacements of all places, block by block.
fn displacements(model: &dyn WaveModel, places: &[DVec2]) {
    for places in places.chunks_exact(BLOCK) {
        let mut motion = Motion::STILL;
        model.add_displacement(&block(places), &mut motion);
        black_box(&motion);
    }
}

/// Velocities half a metre below all places.
fn velocities(model: &dyn WaveModel, places: &[DVec2]) {
    for places in places.chunks_exact(BLOCK) {
        let mut velocity = Velocity::STILL;
        model.add_velocity(&block(places), &[0.5; BLOCK], &mut velocity);
        black_box(&velocity);
    }
}

fn block(places: &[DVec2]) -> Points {
    let mut points = Points::at(0.0, 0.0);
    for (lane, place) in places.iter().enumerate() {
        (points.x[lane], points.y[lane]) = (place.x, place.y);
    }
    points
}

/// Motions of all places, some blocks at a time.
fn motions(model: &dyn WaveModel, places: &[DVec2]) {
    const BLOCKS: usize = 8;
    let (mut points, mut motions) = ([Points::at(0.0, 0.0); BLOCKS], [Motion::STILL; BLOCKS]);
    for places in places.chunks_exact(BLOCK * BLOCKS) {
        for (points, places) in points.iter_mut().zip(places.chunks_exact(BLOCK)) {
            *points = block(places);
        }
        motions.fill(Motion::STILL);
        model.add_motions(&points, &mut motions);
        black_box(&motions);
    }
}

/// Million points a second of a function that does all of them.
fn rate(work: impl FnMut()) -> f64 {
    (EDGE * EDGE) as f64 * 1e-6 / median(21, work)
}
