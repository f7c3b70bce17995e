//! Waves per second, on one thread: tiles of the spectral sea beside the transforms of rustfft, and queries.
//!
//! `cargo bench -p littoral --bench waves`. Ours and the peer alternate within one process; medians of elapsed time.

use littoral::waves::cascades::{Cascades, Options, Tile};
use littoral::waves::{BLOCK, Motion, Points, SeaState, Velocity, WaveModel, random};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the only pool");
    for samples in [256, 512, 1024] {
        steps(samples);
    }
    queries();
}

/// Milliseconds that some work takes.
fn time(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64() * 1e3
}

fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    of[of.len() / 2]
}

/// One step of one tile (evolution, four transforms, eight fields put together), beside rustfft's four complex transforms of its size.
fn steps(samples: usize) {
    let state = SeaState::beaufort(8.0, 0.6).expect("a state");
    let length = 600.0;
    let sea = |part: f64, foam: bool| {
        let highest = part * 0.5 * TAU / length * (samples as f64 - 1.0);
        let tile = Tile { length, turn: 0.3, samples, lowest: 0.06, highest };
        Cascades::with_tiles(&state, &[tile], &Options { foam, ..Options::default() }).expect("a sea")
    };
    // Waves of at least four samples, as seas are made of; with foam; and all that the samples can carry.
    let mut seas = [sea(0.5, false), sea(0.5, true), sea(0.995, false), sea(0.995, true)];
    let mut jumping = sea(0.5, true);
    let plan = FftPlanner::new().plan_fft_inverse(samples);
    let mut scratch = vec![Complex::new(0.0, 0.0); plan.get_inplace_scratch_len()];
    let spectrum: Vec<Complex<f32>> =
        (0..4 * samples * samples).map(|i| Complex::new((i % 17) as f32 - 8.0, (i % 13) as f32 - 6.0)).collect();
    let (mut buffer, mut turned) = (spectrum.clone(), spectrum.clone());
    let mut times = vec![Vec::new(); 6];
    for round in 0..31 {
        let now = f64::from(round) / 60.0;
        for (sea, times) in seas.iter_mut().zip(&mut times) {
            times.push(time(|| black_box(&mut *sea).set_time(now)));
        }
        times[4].push(time(|| black_box(&mut jumping).set_time(0.25 * f64::from(round))));
        buffer.copy_from_slice(&spectrum);
        times[5].push(time(|| {
            for (field, turned) in
                buffer.chunks_exact_mut(samples * samples).zip(turned.chunks_exact_mut(samples * samples))
            {
                plan.process_with_scratch(field, &mut scratch);
                transpose(field, turned, samples);
                plan.process_with_scratch(turned, &mut scratch);
            }
            black_box((&mut buffer, &mut turned));
        }));
    }
    let [narrow, foaming, full, full_foaming, ticking, peer] =
        times.try_into().map(|t: [_; 6]| t.map(median)).expect("6");
    println!(
        "{samples}²: rustfft {peer:.2} ms; step {narrow:.2} ({:.2} of it), with foam at 60 frames/s {foaming:.2} ({:.2}), with a tick of \
         foam each frame {ticking:.2} ({:.2}); all wave numbers {full:.2} ({:.2}), with foam {full_foaming:.2} ({:.2})",
        narrow / peer,
        foaming / peer,
        ticking / peer,
        full / peer,
        full_foaming / peer,
    );
}

/// By blocks, so that the peer is not slowed by its caller.
fn transpose(from: &[Complex<f32>], to: &mut [Complex<f32>], samples: usize) {
    for top in (0..samples).step_by(16) {
        for left in (0..samples).step_by(16) {
            for y in top..top + 16 {
                for x in left..left + 16 {
                    to[x * samples + y] = from[y * samples + x];
                }
            }
        }
    }
}

/// Points asked about, at random over 5 km and next to each other.
fn queries() {
    let state = SeaState::beaufort(8.0, 0.6).expect("a state");
    let whole = Options::default();
    let three = Options { highest: 2.5, ..whole };
    for (name, options) in [("all waves down to 7 cm", whole), ("waves from 2.5 m", three)] {
        let mut sea = Cascades::new(&state, &options).expect("a sea");
        let setting_up = median((0..3).map(|_| time(|| drop(black_box(Cascades::new(&state, &options))))).collect());
        let mut frame = 0.0;
        let step = median(
            (0..21)
                .map(|_| {
                    time(|| {
                        frame += 1.0 / 60.0;
                        sea.set_time(frame)
                    })
                })
                .collect(),
        );
        let mut jumps = 0.0;
        let jump = median(
            (0..3)
                .map(|_| {
                    time(|| {
                        jumps += 100.0;
                        sea.set_time(jumps)
                    })
                })
                .collect(),
        );
        let bounds = time(|| drop(black_box(sea.bounds())));
        println!(
            "{name}: {} tiles, {:.0} MB, set up in {setting_up:.0} ms, a frame {step:.1} ms, a jump in time {jump:.0} ms, bounds {bounds:.1} ms",
            sea.tiles().len(),
            sea.bytes() as f64 / 1e6,
        );
        let random: Vec<Points> = (0..4096)
            .map(|i| {
                let place = |l: usize, axis: i64| 5e3 * random::uniform(1, i, l as i64, axis);
                let (x, y) = (std::array::from_fn(|l| place(l, 0)), std::array::from_fn(|l| place(l, 1)));
                Points { x, y, footprint: [0.0; BLOCK] }
            })
            .collect();
        let near: Vec<Points> = (0..4096)
            .map(|i| {
                let x = std::array::from_fn(|l| 0.25 * (f64::from(i % 64) * BLOCK as f64 + l as f64));
                Points { x, y: [0.25 * f64::from(i / 64); BLOCK], footprint: [0.0; BLOCK] }
            })
            .collect();
        for (kind, points) in [("at random", &random), ("0.25 m apart", &near)] {
            let mut times = vec![Vec::new(); 4];
            for _ in 0..15 {
                times[0].push(time(|| {
                    points.iter().for_each(|p| {
                        let mut motion = Motion::STILL;
                        sea.add_displacement(p, &mut motion);
                        black_box(motion);
                    })
                }));
                times[1].push(time(|| {
                    points.iter().for_each(|p| {
                        let mut motion = Motion::STILL;
                        sea.add_motion(p, &mut motion);
                        black_box(motion);
                    })
                }));
                times[2].push(time(|| {
                    points.iter().for_each(|p| {
                        let mut motion = Motion::STILL;
                        sea.add_motion(&Points { footprint: [1.5; BLOCK], ..*p }, &mut motion);
                        black_box(motion);
                    })
                }));
                times[3].push(time(|| {
                    points.iter().for_each(|p| {
                        let mut velocity = Velocity::STILL;
                        sea.add_velocity(p, &[0.4; BLOCK], &mut velocity);
                        black_box(velocity);
                    })
                }));
            }
            let count = (points.len() * BLOCK) as f64;
            let [displacement, motion, wide, velocity] =
                times.try_into().map(|t: [_; 4]| t.map(|t| median(t) * 1e6 / count)).expect("4");
            println!(
                "  points {kind}, ns each: displacement {displacement:.0}, all of the motion {motion:.0}, with a footprint of 1.5 m \
                 {wide:.0}, velocity below the surface {velocity:.0}"
            );
        }
    }
}
