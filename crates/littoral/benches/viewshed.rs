//! Viewsheds and lines of sight on one thread, in processor seconds.
//!
//! On an invented map by default; `LITTORAL_MAP=path` takes a square of little-endian `f32` heights instead, spread over
//! 30 km. Medians of several runs; `cargo bench -p littoral --bench viewshed`, with a part of a
//! line's name for only those.

use glam::DVec2;
use littoral::field::{Land, Raster, noise::Fbm};
use littoral::memory::collected;
use littoral::raycast::{Curvature, Simd, Station, Viewshed};

const EXTENT: f64 = 30_000.0;

/// Seconds that this thread has run on a processor; where the system does not tell, seconds since the program began.
fn processor_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    let start = START.get_or_init(std::time::Instant::now);
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |n| n * 1e-9)
}

fn median(mut runs: Vec<f64>) -> f64 {
    runs.sort_by(f64::total_cmp);
    runs[runs.len() / 2]
}

fn map() -> Raster {
    let heights: Vec<f32> = match std::env::var("LITTORAL_MAP") {
        Ok(path) => {
            let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
            collected(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
        }
        Err(_) => {
            let side = 2049;
            let noise = Fbm::new(8_000.0, 1_000.0, 11, 7);
            let step = EXTENT / (side - 1) as f64;
            let at = |k: usize| noise.at(DVec2::new((k % side) as f64, (k / side) as f64) * step).value as f32;
            collected((0..side * side).map(at))
        }
    };
    let side = heights.len().isqrt();
    Raster::new(side, side, DVec2::splat(EXTENT / (side - 1) as f64), heights).expect("a square map")
}

fn main() {
    let land = Land::new(map());
    let raster = land.raster();
    let side = raster.columns();
    let top = (0..side * side).max_by(|&a, &b| raster.heights()[a].total_cmp(&raster.heights()[b])).unwrap_or(0);
    let at = |column: usize, row: usize| land.origin() + DVec2::new(column as f64, row as f64) * raster.spacing();
    let (middle, summit) = (at(side / 2, side / 2), at(top % side, top / side));
    let mut seen = vec![0; side * side];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    println!("{side} × {side} samples, {:.2} m apart; one thread, processor seconds", raster.spacing().x);
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let flat = None;
    let earth = Some(Curvature::EARTH);
    for (name, position, above_ground, curvature) in [
        ("middle, 2 m above ground", middle, 2.0, flat),
        ("middle, 100 m above ground", middle, 100.0, flat),
        ("middle, 1000 m above ground", middle, 1000.0, flat),
        ("summit, 2 m above ground", summit, 2.0, flat),
        ("summit, 1000 m above ground", summit, 1000.0, flat),
        ("summit, 1000 m above ground, curved Earth", summit, 1000.0, earth),
    ] {
        for simd in [Simd::Avx512, Simd::Avx2, Simd::Portable].into_iter().filter(|simd| simd.available()) {
            if wanted.as_ref().is_some_and(|wanted| !format!("{name} {simd:?}").contains(wanted)) {
                continue;
            }
            let asked = Viewshed { curvature, ..Viewshed::default() };
            let station = Station { position, above_ground };
            let mut run = || {
                pool.install(|| {
                    let start = processor_seconds();
                    let count = land.viewshed_with(station, &asked, &mut seen, simd).expect("on the land");
                    (processor_seconds() - start, count)
                })
            };
            let (_, count) = run();
            let runs = if simd == Simd::Portable { 3 } else { 7 };
            let seconds = median((0..runs).map(|_| run().0).collect());
            let samples = (side * side) as f64;
            println!(
                "{name:42} {:8} {seconds:.4} s  {:6.1} Msamples/s  seen {:5.2} %  own lines {:.3} % (whole {:.4} %)",
                format!("{simd:?}"),
                samples / seconds * 1e-6,
                100.0 * count.seen as f64 / samples,
                100.0 * count.lines as f64 / samples,
                100.0 * count.whole_lines as f64 / samples,
            );
        }
    }
    let mut random = 1u64;
    // The last viewshed against the definition, at random samples.
    let (mut checked, mut differ) = (0, 0);
    let observer = Station { position: summit, above_ground: 1000.0 };
    if wanted.is_none() {
        for curvature in [None, Some(Curvature::EARTH)] {
            land.viewshed(observer, &Viewshed { curvature, ..Viewshed::default() }, &mut seen).expect("on the land");
            for k in 0..10_000 {
                let index = k * 7_919_317 % (side * side);
                let target = Station { position: at(index % side, index / side), above_ground: 0.0 };
                let free = land.sight(observer, target, curvature).expect("on the land").visible();
                checked += 1;
                differ += usize::from(free != (seen[index] == 255));
            }
        }
        println!("{checked} random samples against their own lines of sight: {differ} differ");
    }
    let mut next = || {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        at(0, 0) + DVec2::new((random >> 40) as f64, (random >> 16 & 0xFF_FFFF) as f64) / 16_777_216.0 * land.extent()
    };
    for above_ground in if wanted.is_none() { &[2.0, 600.0][..] } else { &[] } {
        let above_ground = *above_ground;
        let pairs: Vec<_> =
            (0..4000).map(|_| [next(), next()].map(|position| Station { position, above_ground })).collect();
        let start = processor_seconds();
        let free = pairs.iter().filter(|[a, b]| land.sight(*a, *b, None).is_ok_and(|sight| sight.visible())).count();
        let seconds = processor_seconds() - start;
        println!(
            "sight with clearance, both {above_ground} m above ground: {:.1} µs a line, {free} of {} free",
            seconds * 1e6 / pairs.len() as f64,
            pairs.len()
        );
    }
}
