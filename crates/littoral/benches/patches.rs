//! The set-up of 2016: relief as large and rough as a globe's in 16 384 × 8 192 samples, on a plane, from 300 km up, 1920 × 1080 pixels. Processor time of one thread.
//!
//! The paper draws 130 thousand triangles where without a choice there would be 2.5 million, and does not say how far they may be off. Here the choice
//! is made down to the samples and down to the level whose triangles in the frame are about as many as the paper's, at several tolerances. Two gigabytes.

mod clock;
mod globe;

use littoral::lod::{Drawing, Limits, Lod, Patches, Reached};
use std::hint::black_box;

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let land = globe::land(globe::COLUMNS);
    one.install(|| {
        for (name, finest, tolerances) in [
            ("of 9.8 km", land.finest_level() - 2, [1e-4, 1.0, 0.25, 0.05]),
            ("of a sample", land.finest_level(), [1.0, 0.25, 0.1, 0.05]),
        ] {
            for tolerance in tolerances {
                let view = globe::view(tolerance);
                let mut lod = Patches::new(Limits { finest, triangles: 10_000_000 });
                let mut drawing = Drawing::default();
                let mut reached = Reached { pixels: 0.0, limited: false };
                let mut look = || {
                    reached = lod.select(&land, &view, &mut drawing).expect("a view");
                    black_box(&drawing.patches);
                };
                look();
                let seconds = clock::median(11, look);
                println!(
                    "down to cells {name}, {tolerance} pixels asked, {:.2} reached: {} triangles in {:.2} ms",
                    reached.pixels,
                    drawing.triangles(),
                    seconds * 1e3
                );
            }
        }
    });
}
