//! Viewsheds against a line of sight to every sample, and against closed forms.

use glam::DVec2;
use littoral::field::{Land, Raster};
use littoral::raycast::{Curvature, SightError, Simd, Station, Viewshed, ViewshedCount};
use proptest::prelude::*;

/// The definition: a sample is seen if the line of sight to it is free.
fn by_definition(land: &Land, observer: Station, asked: &Viewshed) -> Vec<u8> {
    let raster = land.raster();
    let mut seen = Vec::new();
    for row in 0..raster.rows() {
        for column in 0..raster.columns() {
            let position = land.origin() + DVec2::new(column as f64, row as f64) * raster.spacing();
            let target = Station { position, above_ground: asked.target_height };
            let near = (position - observer.position).length() <= asked.radius;
            let free = land.sight(observer, target, asked.curvature).is_ok_and(|sight| sight.visible());
            seen.push(if near && free && raster.sample(column, row).is_some() { 255 } else { 0 });
        }
    }
    seen
}

fn viewshed(land: &Land, observer: Station, asked: &Viewshed) -> (Vec<u8>, ViewshedCount) {
    let mut results =
        [Simd::Avx512, Simd::Avx2, Simd::Portable].into_iter().filter(|simd| simd.available()).map(|simd| {
            let mut seen = vec![7; land.raster().heights().len()];
            let count = land.viewshed_with(observer, asked, &mut seen, simd).expect("an observer on the land");
            (seen, count)
        });
    let first = results.next().expect("portable");
    for other in results {
        assert!(first == other, "vector and portable lanes differ");
    }
    first
}

fn assert_equal(land: &Land, observer: Station, asked: &Viewshed) {
    let (seen, count) = viewshed(land, observer, asked);
    let expected = by_definition(land, observer, asked);
    let columns = land.raster().columns();
    let wrong: Vec<_> = (0..seen.len()).filter(|&k| seen[k] != expected[k]).collect();
    assert!(
        wrong.is_empty(),
        "{} of {} samples differ, the first at ({}, {}): got {}, expected {}; {observer:?} {asked:?}",
        wrong.len(),
        seen.len(),
        wrong[0] % columns,
        wrong[0] / columns,
        seen[wrong[0]],
        expected[wrong[0]],
    );
    assert_eq!(count.seen, seen.iter().filter(|&&mark| mark == 255).count());
}

/// Rough or smooth ground with flats, cliffs and voids.
fn ground(columns: usize, rows: usize, seed: u64, kind: u8, voids: bool) -> Vec<f32> {
    let mut state = seed | 1;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / 16_777_216.0
    };
    let (a, b) = (random() * 0.3, random() * 0.3);
    (0..columns * rows)
        .map(|k| {
            let (x, y) = ((k % columns) as f32, (k / columns) as f32);
            let smooth = 8.0 * (a * x + 1.0).sin() * (b * y + 2.0).cos();
            let height = match kind {
                0 => 0.0,
                1 => 20.0 * random(),
                2 => smooth,
                3 => smooth + 2.0 * random(),
                4 => {
                    if random() < 0.02 {
                        60.0
                    } else {
                        0.1 * random()
                    }
                }
                5 => (smooth + 3.0 * random()).floor(),
                _ => 0.5 * x - 0.25 * y,
            };
            if voids && random() < 0.03 { f32::NAN } else { 300.0 + height }
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn equals_a_line_of_sight_to_every_sample(
        columns in 2usize..70,
        rows in 2usize..70,
        seed: u64,
        kind in 0u8..7,
        voids: bool,
        spacing in (0.5f64..40.0, 0.5f64..40.0),
        place in (0.0f64..=1.0, 0.0f64..=1.0),
        on_sample: bool,
        above_ground in prop_oneof![Just(0.0), 0.0f64..3.0, 0.0f64..60.0],
        target_height in prop_oneof![Just(0.0), 0.0f64..10.0],
        curved in prop_oneof![Just(None), Just(Some(Curvature::EARTH)), Just(Some(Curvature { radius: 3_000.0, refraction: 0.2 }))],
        radius in prop_oneof![Just(f64::INFINITY), 0.0f64..500.0],
    ) {
        let spacing = DVec2::new(spacing.0, spacing.1);
        let raster = Raster::new(columns, rows, spacing, ground(columns, rows, seed, kind, voids)).expect("valid");
        let land = Land::at(raster, DVec2::new(1000.0, -500.0));
        let mut lattice = DVec2::new(place.0 * (columns - 1) as f64, place.1 * (rows - 1) as f64);
        if on_sample {
            lattice = lattice.round();
        }
        let observer = Station { position: land.origin() + lattice * spacing, above_ground };
        let asked = Viewshed { target_height, radius, curvature: curved };
        if land.viewshed(observer, &asked, &mut vec![0; columns * rows]).is_ok() {
            assert_equal(&land, observer, &asked);
        }
    }
}

/// Larger maps, so that bins are halved and batches follow each other.
#[test]
fn equals_a_line_of_sight_to_every_sample_on_larger_maps() {
    for (seed, kind) in (1..=7u64).zip([1, 2, 3, 4, 5, 3, 0]) {
        let (columns, rows) = (230 + 13 * seed as usize, 300 - 11 * seed as usize);
        let raster =
            Raster::new(columns, rows, DVec2::new(10.0, 7.0), ground(columns, rows, seed * 77, kind, seed % 2 == 1));
        let land = Land::new(raster.expect("valid"));
        for (u, v, above_ground, curvature) in
            [(0.5, 0.5, 2.0, None), (0.02, 0.9, 30.0, Some(Curvature::EARTH)), (1.0, 0.0, 200.0, None)]
        {
            let position = land.origin() + land.extent() * DVec2::new(u, v);
            let observer = Station { position, above_ground };
            let asked = Viewshed { curvature, ..Viewshed::default() };
            if land.viewshed(observer, &asked, &mut vec![0; columns * rows]).is_ok() {
                assert_equal(&land, observer, &asked);
            }
        }
    }
}

#[test]
fn heights_beyond_reason_are_no_special_case() {
    let mut heights = ground(60, 50, 9, 3, true);
    heights[777] = 3e38;
    heights[1500] = -3e38;
    let land = Land::new(Raster::new(60, 50, DVec2::splat(5.0), heights).expect("valid"));
    let observer = Station { position: DVec2::new(11.0, 12.0), above_ground: 5.0 };
    assert_equal(&land, observer, &Viewshed::default());
    let land = Land::new(Raster::new(40, 30, DVec2::splat(5.0), ground(40, 30, 3, 3, false)).expect("valid"));
    assert_equal(&land, Station { above_ground: 1e9, ..observer }, &Viewshed::default());
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let raster = Raster::new(400, 300, DVec2::splat(5.0), ground(400, 300, 5, 3, true)).expect("valid");
    let land = Land::new(raster);
    let observer = Station { position: DVec2::new(10.0, 20.0), above_ground: 15.0 };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let mut seen = vec![0; 400 * 300];
        let count = pool.install(|| land.viewshed(observer, &Viewshed::default(), &mut seen));
        (seen, count)
    };
    let alone = with(1);
    assert!(alone.1.is_ok_and(|count| count.seen > 1000));
    for threads in [2, 5] {
        assert!(alone == with(threads), "{threads} threads differ from one");
    }
}

#[test]
fn level_ground_is_seen_whole() {
    let land = Land::new(Raster::new(150, 90, DVec2::new(30.0, 20.0), vec![12.5; 150 * 90]).expect("valid"));
    for above_ground in [0.0, 0.001, 2.0, 1e4] {
        let observer = Station { position: DVec2::new(123.4, -56.7), above_ground };
        let (seen, count) = viewshed(&land, observer, &Viewshed::default());
        assert_eq!(count.seen, seen.len(), "{above_ground} m above ground");
    }
}

/// A wall of height w at distance d hides, from an eye of height e < w, all ground beyond; from e > w, a shadow that ends
/// at distance d·e/(e − w).
#[test]
fn a_wall_throws_its_shadow() {
    let (columns, rows, wall) = (201, 21, 50);
    let mut heights = vec![0.0; columns * rows];
    (0..rows).for_each(|row| heights[row * columns + wall] = 10.0);
    let land = Land::at(Raster::new(columns, rows, DVec2::splat(1.0), heights).expect("valid"), DVec2::ZERO);
    let (eye, row) = (15.0, 10);
    let observer = Station { position: DVec2::new(0.0, row as f64), above_ground: eye };
    let (seen, _) = viewshed(&land, observer, &Viewshed::default());
    let end = wall as f64 * eye / (eye - 10.0);
    for column in 0..columns {
        let hidden = column > wall && (column as f64) < end;
        assert_eq!(seen[row * columns + column] == 0, hidden, "column {column}, the shadow ends at {end}");
    }
    let observer = Station { above_ground: 9.0, ..observer };
    let (seen, _) = viewshed(&land, observer, &Viewshed::default());
    for column in 0..columns {
        assert_eq!(seen[row * columns + column] == 0, column > wall, "column {column} behind a wall above the eye");
    }
}

/// On a sphere of radius R the sea's horizon lies at √(2Rh/(1 − k)).
#[test]
fn the_horizon_of_a_round_earth() {
    let (columns, step) = (401, 100.0);
    let raster = Raster::new(columns, 5, DVec2::splat(step), vec![0.0; columns * 5]).expect("valid");
    let land = Land::at(raster, DVec2::ZERO);
    for (height, refraction) in [(2.0, 0.13), (30.0, 0.13), (50.0, 0.0), (10.0, 0.25)] {
        let curvature = Curvature { refraction, ..Curvature::EARTH };
        let asked = Viewshed { curvature: Some(curvature), ..Viewshed::default() };
        let observer = Station { position: DVec2::new(0.0, 2.0 * step), above_ground: height };
        let (seen, _) = viewshed(&land, observer, &asked);
        let horizon = (2.0 * curvature.radius * height / (1.0 - refraction)).sqrt();
        // The ground between samples is straight, and lines may graze by a millimetre: the last sample seen is the
        // horizon's to within a step and the √(2R·1 mm/(1 − k)) by which a millimetre shifts it.
        let slack = step + (2.0 * curvature.radius * 1e-3 / (1.0 - refraction)).sqrt();
        let last =
            (0..columns).rev().find(|&column| seen[2 * columns + column] != 0).expect("the eye's own") as f64 * step;
        assert!((last - horizon.min(40_000.0)).abs() <= slack, "{last} m against {horizon} m");
    }
}

#[test]
fn voids_are_not_seen_and_hide_nothing() {
    let mut heights = vec![0.0; 40 * 40];
    for row in 0..40 {
        heights[row * 40 + 20] = 50.0;
    }
    let wall = Land::new(Raster::new(40, 40, DVec2::splat(10.0), heights.clone()).expect("valid"));
    for row in 0..40 {
        heights[row * 40 + 20] = f32::NAN;
    }
    let gap = Land::new(Raster::new(40, 40, DVec2::splat(10.0), heights).expect("valid"));
    let observer = Station { position: DVec2::new(-150.0, 3.0), above_ground: 2.0 };
    assert_eq!(viewshed(&wall, observer, &Viewshed::default()).1.seen, 40 * 21);
    assert_eq!(viewshed(&gap, observer, &Viewshed::default()).1.seen, 40 * 39);
    let outside = Station { position: DVec2::new(1e5, 0.0), above_ground: 2.0 };
    let void = Station { position: DVec2::new(5.0, 0.0), above_ground: 2.0 };
    let mut seen = vec![0; 1600];
    assert!(matches!(gap.viewshed(outside, &Viewshed::default(), &mut seen), Err(SightError::Outside(_))));
    assert!(matches!(gap.viewshed(void, &Viewshed::default(), &mut seen), Err(SightError::Void(_))));
    let bad = Viewshed { radius: f64::NAN, ..Viewshed::default() };
    assert!(matches!(gap.viewshed(observer, &bad, &mut seen), Err(SightError::Number(..))));
}
