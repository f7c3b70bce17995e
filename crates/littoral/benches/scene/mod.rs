//! What benchmarks of level of detail fly over: 30 km in 4097² samples of fractal noise, or the raw `f32` heights that the environment variable `LITTORAL_MAP`
//! names.

use glam::DVec2;
use littoral::field::noise::Fbm;
use littoral::field::{Land, Raster};
use littoral::memory::collected;

const EXTENT: f64 = 30_000.0;
const SAMPLES: usize = 4097;

/// The land.
pub fn mountains() -> Land {
    match std::env::var("LITTORAL_MAP") {
        Ok(path) => measured(&path),
        Err(_) => invented(SAMPLES),
    }
}

/// Heights of a file.
fn measured(path: &str) -> Land {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("cannot read {path}: {e}"));
    assert_eq!(bytes.len(), SAMPLES * SAMPLES * 4, "expected {SAMPLES}² raw f32 heights in {path}");
    let heights = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    placed(SAMPLES, collected(heights))
}

/// Fractal noise.
fn invented(samples: usize) -> Land {
    let fbm = Fbm::new(8000.0, 1200.0, 12, 7);
    let step = EXTENT / (samples - 1) as f64;
    let at = |i: usize| DVec2::new((i % samples) as f64, (i / samples) as f64) * step;
    placed(samples, collected((0..samples * samples).map(|i| fbm.at(at(i)).value as f32)))
}

fn placed(samples: usize, heights: Vec<f32>) -> Land {
    Land::new(
        Raster::new(samples, samples, DVec2::splat(EXTENT / (samples - 1) as f64), heights).expect("sizes are valid"),
    )
}
