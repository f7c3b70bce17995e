//! The sea over a bed, against closed forms and against solutions found in other ways.

use glam::DVec2;
use littoral::waves::shore::{BREAKING, Bed, Settings, ShoreSea};
use littoral::waves::{Motion, PlaneWave, Points, StillWater, WaveModel};
use std::f64::consts::TAU;

fn wave(period: f64, amplitude: f64, heading: f64, depth: f64) -> PlaneWave {
    let omega = TAU / period;
    let k = StillWater::of_depth(depth).expect("wet").wavenumber(omega);
    PlaneWave { amplitude, wavenumber: DVec2::from_angle(heading) * k, angular_frequency: omega, phase: 0.0 }
}

fn sea(bed: &Bed, waves: &[PlaneWave], depth: f64, settings: &Settings) -> ShoreSea {
    ShoreSea::of_waves(bed, waves, depth, settings, &|_| true).expect("a sea")
}

/// A plane beach that rises towards +y from a flat bed.
fn beach(slope: f64, depth: f64, spacing: f64) -> Bed {
    let length = depth / slope;
    let (columns, rows) = (200, ((length + 160.0) / spacing) as usize);
    Bed::of(DVec2::ZERO, DVec2::splat(spacing), columns, rows, |p| (depth - slope * (p.y - 100.0).max(0.0)).min(depth))
        .expect("a bed")
}

#[test]
fn plane_beach_refracts_by_snell_and_shoals_by_green() {
    let (depth, slope) = (12.0, 0.03);
    let bed = beach(slope, depth, 2.0);
    for degrees in [0.0f64, 20.0, 40.0] {
        let incoming = wave(9.0, 0.01, (90.0 - degrees).to_radians(), depth);
        let sea = sea(&bed, &[incoming], depth, &Settings { smoothing: Some(0.0), ..Settings::default() });
        let water = |h: f64| StillWater::of_depth(h).expect("wet");
        let (omega, across) = (incoming.angular_frequency, incoming.wavenumber.x);
        let flux = |h: f64| {
            let k = water(h).wavenumber(omega);
            water(h).group_speed(k) * (1.0 - (across / k).powi(2)).sqrt()
        };
        let (mut worst_turn, mut worst_rise) = (0.0f64, 0.0f64);
        for step in 0..50 {
            let y = 110.0 + f64::from(step) * 6.0;
            let h = depth - slope * (y - 100.0);
            if h < 0.8 {
                break;
            }
            let (amplitude, direction) = sea.component(0, 200.0, y);
            let k = water(h).wavenumber(omega);
            let exact = (across / k).asin();
            let turned = direction.x.atan2(direction.y);
            worst_turn = worst_turn.max((turned.sin() - exact.sin()).abs() / exact.sin().abs().max(0.05));
            assert!((direction.length() / k - 1.0).abs() < 0.01, "wave number at {h}");
            let expected = 0.01 * (flux(depth) / flux(h)).sqrt();
            worst_rise = worst_rise.max((amplitude / expected - 1.0).abs());
        }
        println!("{degrees}°: Snell {worst_turn:.5}, shoaling {worst_rise:.5}");
        assert!(worst_turn < 0.01 && worst_rise < 0.02);
    }
}
