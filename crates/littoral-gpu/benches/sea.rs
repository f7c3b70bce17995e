//! Milliseconds that a step of the sea takes on the GPU, and on the processor beside it.
//!
//! `cargo bench -p littoral-gpu --bench sea`. Three tiles of 256² and of 512² samples, all levels of detail on the GPU, which the processor makes on demand
//! (those it makes here too); wall time from before the work is submitted until it is done; medians; both alternate within one process.
//! The bytes are what the passes read and write as they are built: over the time and the memory's speed they are the part of what is possible.

mod timer;

use littoral::waves::cascades::{Cascades, Options, Tile};
use littoral::waves::{Motion, Points, SeaState, WaveModel};
use littoral_gpu::sea::Transform;
use littoral_gpu::{Gpu, GpuSea};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu.timed(),
        Err(error) => return println!("{error}"),
    };
    println!("{} ({:?})", gpu.adapter.name, gpu.adapter.backend);
    for samples in [256, 512] {
        for foam in [false, true] {
            steps(&gpu, samples, foam);
        }
    }
}

fn steps(gpu: &Gpu, samples: usize, foam: bool) {
    let state = SeaState::beaufort(6.0, 0.6).expect("a state");
    // Waves of four samples and longer.
    let carried = (samples / 4) as f64 - 0.5;
    let mut lowest = 0.05;
    let tiles = [0.2, 0.9, 1.4].map(|turn| {
        let length = 7.7 * TAU / lowest;
        let tile = Tile { length, turn, samples, lowest, highest: carried * TAU / length };
        lowest = tile.highest;
        tile
    });
    let options = Options { foam, ..Options::default() };
    let mut sea = Cascades::with_tiles(&state, &tiles, &options).expect("a sea");
    let mut on_gpu =
        [Transform::Passes, Transform::Lines].map(|of| GpuSea::with_transform(gpu, &sea, of).expect("a sea"));
    let wait = || timer::wait(gpu);
    wait();
    let mut times = [const { Vec::new() }; 8];
    // The first frames warm up. A tick of foam comes every 15 frames.
    for frame in 0..34 {
        let now = 100.0 + f64::from(frame) / 60.0;
        let mut taken = [0.0; 8];
        for (number, sea) in on_gpu.iter_mut().enumerate() {
            taken[number] = milliseconds(|| {
                sea.set_time(now);
                wait();
            });
            taken[6 + number] = timer::read(gpu).unwrap_or(0.0);
        }
        // Until the next is submitted the processor is free.
        taken[2] = milliseconds(|| on_gpu[1].set_time(now + 1e-3));
        wait();
        taken[3] = milliseconds(|| sea.set_time(now));
        taken[4] = taken[3]
            + milliseconds(|| {
                let mut motion = Motion::STILL;
                for width in 0..8 {
                    let footprint = [0.05 * f32::from(1u16 << (2 * width)); 16];
                    sea.add_displacement(&Points { footprint, ..Points::at(1.0, 2.0) }, &mut motion);
                }
                black_box(&motion);
            });
        taken[5] = milliseconds(|| {
            on_gpu[0].copy(&sea);
            gpu.queue.submit([]);
            wait();
        });
        if frame >= 4 {
            times.iter_mut().zip(taken).for_each(|(times, taken)| times.push(taken));
        }
    }
    let [passes, lines, recording, alone, with_levels, copied, passes_alone, lines_alone] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    println!("3 × {samples}²{}", if foam { ", foam" } else { "" });
    let ways = [("passes", &on_gpu[0], passes, passes_alone), ("lines", &on_gpu[1], lines, lines_alone)];
    for (name, sea, time, alone) in ways {
        let bytes = sea.bytes_moved() as f64;
        let clock = if alone > 0.0 { format!("{alone:.3} ms by the adapter's clock, ") } else { String::new() };
        println!("  by {name}: {time:.2} ms for {:.1} MB, {clock}{:.2} GB/s", 1e-6 * bytes, 1e-6 * bytes / time);
    }
    println!(
        "  to record and submit {recording:.2} ms; on the processor {alone:.2} ms, with levels {with_levels:.2} ms, and {copied:.2} ms to copy its samples"
    );
}

fn milliseconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64() * 1e3
}
