//! Lines of sight, profiles and slopes against dense sampling and closed forms.

use glam::DVec2;
use littoral::field::{Land, Raster};
use littoral::raycast::{Curvature, GRAZE, ProfilePoints, SightError, Station};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn rough(columns: usize, rows: usize, seed: u64, voids: bool) -> Vec<f32> {
    let mut state = seed | 1;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / 16_777_216.0
    };
    (0..columns * rows)
        .map(|k| if voids && random() < 0.05 { f32::NAN } else { 10.0 * random() + (k % columns) as f32 * 0.3 })
        .collect()
}

fn land(columns: usize, rows: usize, seed: u64, voids: bool, spacing: (f64, f64)) -> Land {
    let spacing = DVec2::new(spacing.0, spacing.1);
    let raster = Raster::new(columns, rows, spacing, rough(columns, rows, seed, voids)).expect("valid");
    Land::at(raster, DVec2::new(-70.0, 300.0))
}

/// The bilinear surface by its definition; `None` in voids and outside.
fn height(land: &Land, xy: DVec2) -> Option<f64> {
    let raster = land.raster();
    let lattice = (xy - land.origin()) / raster.spacing();
    let last = DVec2::new((raster.columns() - 2) as f64, (raster.rows() - 2) as f64);
    if lattice.min_element() < 0.0 || (lattice - last).max_element() > 1.0 {
        return None;
    }
    let base = lattice.floor().min(last);
    let [a, b, c, d] = land.corners(base.x as usize, base.y as usize)?.map(f64::from);
    let f = lattice - base;
    Some((a * (1.0 - f.x) + b * f.x) * (1.0 - f.y) + (c * (1.0 - f.x) + d * f.x) * f.y)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn clearance_and_obstacle_agree_with_dense_sampling(
        columns in 2usize..60, rows in 2usize..60, seed: u64, voids: bool,
        spacing in (0.5f64..20.0, 0.5f64..20.0),
        a in (0.0f64..=1.0, 0.0f64..=1.0), b in (0.0f64..=1.0, 0.0f64..=1.0),
        high in (0.0f64..20.0, 0.0f64..20.0),
        curved in prop_oneof![Just(None), Just(Some(Curvature { radius: 5_000.0, refraction: 0.13 }))],
    ) {
        let land = land(columns, rows, seed, voids, spacing);
        let at = |p: (f64, f64), above_ground| Station { position: land.origin() + land.extent() * DVec2::new(p.0, p.1), above_ground };
        let (from, to) = (at(a, high.0), at(b, high.1));
        let Ok(sight) = land.sight(from, to, curved) else { return Ok(()) };
        let start = height(&land, from.position).unwrap_or(f64::NAN) + high.0;
        let end = height(&land, to.position).unwrap_or(f64::NAN) + high.1;
        let distance = (to.position - from.position).length();
        let bend = curved.map_or(0.0, |c| (1.0 - c.refraction) / (2.0 * c.radius));
        let (mut least, mut unknown) = (high.0.min(high.1), 0);
        let count = 20_000;
        for k in 0..=count {
            let s = k as f64 / count as f64;
            let line = start + (end - start) * s - bend * distance * distance * s * (1.0 - s);
            match height(&land, from.position + (to.position - from.position) * s) {
                Some(ground) => {
                    least = least.min(line - ground);
                    if let Some(obstacle) = sight.blocked_at {
                        prop_assert!(s * distance >= obstacle.distance - 1e-6 || line - ground >= -GRAZE - 1e-6, "an earlier obstacle at {s}");
                    }
                }
                None => unknown += 1,
            }
        }
        // Sampling misses the exact minimum by at most half a step along the steepest slope.
        let slack = 60.0 / spacing.0.min(spacing.1) * distance / count as f64 + 1e-6;
        prop_assert!(sight.clearance <= least + 1e-6, "{sight:?}, sampled {least}");
        prop_assert!(sight.clearance >= least - slack, "{sight:?}, sampled {least}");
        prop_assert_eq!(sight.visible(), sight.clearance >= -GRAZE);
        let over_void = unknown as f64 / count as f64 * distance;
        prop_assert!((sight.over_void - over_void).abs() <= 1e-2 * distance + 1e-6, "{} m over voids, sampled {over_void}", sight.over_void);
        if let Some(obstacle) = sight.blocked_at {
            let position = from.position + (to.position - from.position) * (obstacle.distance / distance.max(1e-300));
            prop_assert!((obstacle.position.truncate() - position).length() < 1e-6);
        }
    }

    #[test]
    fn profiles_are_exact(
        columns in 2usize..40, rows in 2usize..40, seed: u64, voids: bool,
        a in (-0.3f64..=1.3, -0.3f64..=1.3), b in (-0.3f64..=1.3, -0.3f64..=1.3),
    ) {
        let land = land(columns, rows, seed, voids, (3.0, 2.0));
        let at = |p: (f64, f64)| land.origin() + land.extent() * DVec2::new(p.0, p.1);
        let (from, to) = (at(a), at(b));
        let (mut even, mut crossings) = (Vec::new(), Vec::new());
        let summary = land.profile(from, to, ProfilePoints::Even(5_000), &mut even);
        let again = land.profile(from, to, ProfilePoints::Crossings, &mut crossings);
        prop_assert_eq!(summary, again);
        prop_assert_eq!(even.len(), 5_000);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for point in &even {
            prop_assert!((point.position - (from + (to - from) * (point.distance / summary.distance))).length() < 1e-6);
            if let (Some(got), Some(expected)) = (point.height, height(&land, point.position)) {
                prop_assert!((got - expected).abs() < 1e-6);
                (low, high) = (low.min(got), high.max(got));
            }
        }
        for pair in crossings.windows(2) {
            prop_assert!(pair[0].distance <= pair[1].distance);
        }
        if low.is_finite() {
            let (lowest, highest) = (summary.lowest.expect("ground"), summary.highest.expect("ground"));
            let (lowest_at, highest_at) = (lowest.height.expect("known"), highest.height.expect("known"));
            let slack = 20.0 * summary.distance / 5_000.0 + 1e-6;
            prop_assert!(lowest_at <= low + 1e-6 && lowest_at >= low - slack, "lowest {lowest_at}, sampled {low}");
            prop_assert!(highest_at >= high - 1e-6 && highest_at <= high + slack, "highest {highest_at}, sampled {high}");
            for point in [lowest, highest] {
                let inside = point.position.clamp(land.origin(), land.origin() + land.extent());
                if let (Some(expected), Some(got)) = (height(&land, inside), point.height) {
                    prop_assert!((got - expected).abs() < 1e-5, "an extreme of {got} m where the ground is {expected} m");
                }
            }
        }
    }
}

#[test]
fn a_plane_has_one_slope_and_one_aspect() {
    let plane = |rise: DVec2| {
        let (columns, rows, spacing) = (6, 5, DVec2::new(2.0, 4.0));
        let heights = (0..columns * rows)
            .map(|k| (rise.x * 2.0 * (k % columns) as f64 + rise.y * 4.0 * (k / columns) as f64) as f32)
            .collect();
        Land::new(Raster::new(columns, rows, spacing, heights).expect("valid"))
    };
    // Rising eastward, the ground falls to the west: bearing 270°.
    for (rise, bearing) in [
        (DVec2::new(1.0, 0.0), 1.5 * PI),
        (DVec2::new(-1.0, 0.0), FRAC_PI_2),
        (DVec2::new(0.0, -0.5), 0.0),
        (DVec2::new(0.0, 0.5), PI),
        (DVec2::new(-1.0, -1.0), 0.25 * PI),
    ] {
        let land = plane(rise);
        for at in [DVec2::ZERO, DVec2::new(1.3, -2.2), land.origin(), -land.origin()] {
            assert!((land.slope_at(at).expect("ground") - rise.length().atan()).abs() < 1e-6);
            let aspect = land.aspect_at(at).expect("not level");
            let off = (aspect - bearing).rem_euclid(TAU);
            assert!(off.min(TAU - off) < 1e-6, "{aspect} for {rise}");
        }
    }
    let level = plane(DVec2::ZERO);
    assert_eq!((level.slope_at(DVec2::ZERO), level.aspect_at(DVec2::ZERO)), (Some(0.0), None));
    assert_eq!(level.slope_at(DVec2::splat(1e3)), None);
}

#[test]
fn gradients_are_derivatives() {
    let land = land(8, 7, 5, false, (3.0, 2.0));
    for k in 0..200 {
        let at = land.origin() + land.extent() * DVec2::new((k as f64 * 0.618).fract(), (k as f64 * 0.414).fract());
        let step = 1e-5;
        let difference = |by: DVec2| Some((height(&land, at + by)? - height(&land, at - by)?) / (2.0 * step));
        let (Some(x), Some(y)) = (difference(DVec2::X * step), difference(DVec2::Y * step)) else { continue };
        let gradient = land.gradient_at(at).expect("ground");
        assert!((gradient - DVec2::new(x, y)).length() < 1e-3, "{gradient} against ({x}, {y})");
    }
}

/// Two ships of eye heights a and b see each other as far as the sum of their horizons, √(2Ra/(1 − k)) + √(2Rb/(1 − k)).
#[test]
fn ships_sink_below_the_horizon() {
    let land = Land::at(Raster::new(2001, 2, DVec2::splat(50.0), vec![0.0; 4002]).expect("valid"), DVec2::ZERO);
    let at = |x: f64, above_ground| Station { position: DVec2::new(x, 10.0), above_ground };
    for (a, b, refraction) in [(2.0, 10.0, 0.13), (30.0, 5.0, 0.0), (20.0, 20.0, 0.2)] {
        let curvature = Curvature { refraction, ..Curvature::EARTH };
        let horizon = |h: f64| (2.0 * curvature.radius * h / (1.0 - refraction)).sqrt();
        let reach = horizon(a) + horizon(b);
        for (distance, visible) in [(0.999 * reach, true), (1.003 * reach, false)] {
            let sight = land.sight(at(0.0, a), at(distance, b), Some(curvature)).expect("at sea");
            assert_eq!(sight.visible(), visible, "{distance} m of {reach} m: {sight:?}");
            assert!(
                land.sight(at(0.0, a), at(distance, b), None).expect("at sea").visible(),
                "a flat sea hides nothing"
            );
        }
    }
    assert!((Curvature::EARTH.drop(10_000.0) - 6.8276).abs() < 1e-3, "8 cm a kilometre squared, less refraction");
}

#[test]
fn touching_is_not_blocking_and_a_wall_is() {
    let (columns, rows) = (11, 3);
    let mut heights = vec![0.0f32; columns * rows];
    (0..rows).for_each(|row| heights[row * columns + 5] = 10.0);
    let land = Land::at(Raster::new(columns, rows, DVec2::splat(1.0), heights).expect("valid"), DVec2::ZERO);
    let at = |x: f64, above_ground| Station { position: DVec2::new(x, 1.3), above_ground };
    let touching = land.sight(at(0.0, 10.0), at(10.0, 10.0), None).expect("on the land");
    assert!(touching.visible() && touching.clearance.abs() < 1e-9 && (touching.clearance_distance - 5.0).abs() < 1e-9);
    let below = land.sight(at(0.0, 9.0), at(10.0, 9.0), None).expect("on the land");
    assert!((below.clearance + 1.0).abs() < 1e-9);
    let obstacle = below.blocked_at.expect("the wall");
    assert!((obstacle.distance - 4.9).abs() < 1e-3 && (obstacle.position.z - 9.0).abs() < 1e-9, "{obstacle:?}");
    let here = land.sight(at(3.0, 2.0), at(3.0, 1.0), None).expect("on the land");
    assert!(here.visible() && here.distance == 0.0 && here.clearance == 1.0);
    let outside = Station { position: DVec2::new(-1.0, 0.0), above_ground: 1.0 };
    assert!(matches!(land.sight(outside, at(3.0, 1.0), None), Err(SightError::Outside(_))));
    assert!(matches!(land.sight(at(3.0, f64::NAN), at(3.0, 1.0), None), Err(SightError::Number(..))));
    let bad = Curvature { radius: 6e6, refraction: 1.0 };
    assert!(matches!(land.sight(at(3.0, 1.0), at(4.0, 1.0), Some(bad)), Err(SightError::Number(..))));
}
