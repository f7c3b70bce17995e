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

/// A plane beach that rises towards +y from a flat bed, wide enough that its ends do not matter.
fn beach(slope: f64, depth: f64) -> Bed {
    let rows = ((depth / slope + 160.0) / 2.0) as usize;
    Bed::of(DVec2::ZERO, DVec2::new(8.0, 2.0), 450, rows, |p| depth - slope * (p.y - 100.0).max(0.0)).expect("a bed")
}

const MIDDLE: f64 = 1800.0;

fn unsmoothed() -> Settings {
    Settings { smoothing: Some(0.0), ..Settings::default() }
}

#[test]
fn a_plane_beach_refracts_by_snell_and_shoals_by_green() {
    let (depth, slope) = (12.0, 0.03);
    let bed = beach(slope, depth);
    for degrees in [0.0f64, 20.0, 40.0] {
        let incoming = wave(9.0, 0.01, (90.0 - degrees).to_radians(), depth);
        let sea = sea(&bed, &[incoming], depth, &Settings { apron: Some(400.0), ..unsmoothed() });
        let water = |h: f64| StillWater::of_depth(h).expect("wet");
        let (omega, across) = (incoming.angular_frequency, incoming.wavenumber.x);
        let flux = |h: f64| {
            let k = water(h).wavenumber(omega);
            water(h).group_speed(k) * (1.0 - (across / k).powi(2)).sqrt()
        };
        let (mut worst_turn, mut worst_length, mut worst_rise) = (0.0f64, 0.0f64, 0.0f64);
        for step in 0..100 {
            let y = 111.0 + f64::from(step) * 4.0;
            let h = depth - slope * (y - 100.0);
            if h < 0.5 {
                break;
            }
            let (amplitude, direction) = sea.component(0, MIDDLE + 3.0, y);
            let k = water(h).wavenumber(omega);
            worst_turn = worst_turn.max((direction.x / direction.length() - across / k).abs() / (across / k).abs().max(0.1));
            worst_length = worst_length.max((direction.length() / k - 1.0).abs());
            worst_rise = worst_rise.max((amplitude / (0.01 * (flux(depth) / flux(h)).sqrt()) - 1.0).abs());
        }
        println!("{degrees}°: Snell {worst_turn:.5}, wave number {worst_length:.5}, shoaling {worst_rise:.5}");
        assert!(worst_turn < 0.01 && worst_length < 0.01 && worst_rise < 0.02);
    }
}

#[test]
fn waves_break_where_the_depth_bears_no_more() {
    let (depth, slope) = (12.0, 0.03);
    let bed = beach(slope, depth);
    // In three directions of march at once, so that the limit holds for all of them together.
    let waves = [wave(9.0, 0.5, 1.57, depth), wave(8.0, 0.3, 0.7, depth), wave(7.0, 0.3, 2.5, depth)];
    let sea = sea(&bed, &waves, depth, &unsmoothed());
    let (mut broken, mut lowest) = (0, f32::INFINITY);
    for step in 0..420 {
        let y = 100.0 + f64::from(step);
        let h = (depth - slope * (y - 100.0)) as f32;
        if h < 0.3 {
            break;
        }
        let climate = sea.climate(MIDDLE, y);
        assert!((climate.depth - h).abs() < 0.04);
        let index = climate.significant_height / h;
        assert!(index < BREAKING * 1.03, "{index} at {h} m");
        if h < 2.0 {
            broken += 1;
            lowest = lowest.min(index);
        }
    }
    println!("index in the surf down to {lowest}");
    assert!(broken > 40 && lowest > 0.95 * BREAKING, "the surf is as high as the depth bears: {lowest}");
    let outside = sea.climate(MIDDLE, 120.0).significant_height;
    assert!((outside / (4.0 * (0.5f32 * (0.25 + 0.09 + 0.09)).sqrt()) - 1.0).abs() < 0.04, "{outside}");
}

#[test]
fn the_flux_of_energy_is_kept_over_an_uneven_bed() {
    let depth = 15.0;
    let bed = Bed::of(DVec2::ZERO, DVec2::new(6.0, 4.0), 400, 200, |p| {
        let shoal = |x: f64, y: f64, r: f64| (-((p.x - x).powi(2) + (p.y - y).powi(2)) / (r * r)).exp();
        depth - 8.0 * shoal(1200.0, 350.0, 130.0) - 3.0 * shoal(1000.0, 500.0, 90.0)
    })
    .expect("a bed");
    let incoming = wave(8.0, 0.05, 1.5, depth);
    let sea = sea(&bed, &[incoming], depth, &unsmoothed());
    let flux = |y: f64| -> f64 {
        (40..360)
            .map(|i| {
                let x = f64::from(i) * 6.0 + 3.0;
                let (amplitude, k) = sea.component(0, x, y);
                let water = StillWater::of_depth(f64::from(sea.climate(x, y).depth)).expect("wet");
                let own = water.wavenumber(incoming.angular_frequency);
                amplitude * amplitude * water.group_speed(own) * k.y / own
            })
            .sum()
    };
    let first = flux(22.0);
    let worst = (1..38).map(|i| (flux(22.0 + 20.0 * f64::from(i)) / first - 1.0).abs()).fold(0.0, f64::max);
    let (highest, _) = (0..40).map(|i| sea.component(0, 1200.0, 350.0 + 8.0 * f64::from(i))).fold((0.0f64, ()), |m, c| (m.0.max(c.0), ()));
    println!("flux changes by {worst:.4}; behind the shoal waves grow by {:.2}", highest / 0.05);
    assert!(worst < 0.02, "{worst}");
    assert!(highest > 0.05 * 1.3, "the shoal focuses");
}

/// ∫ e^{iτ²} dτ from −∞ to x, by Simpson's rule from 0.
fn fresnel(x: f64) -> (f64, f64) {
    let half = (std::f64::consts::PI / 8.0).sqrt();
    let n = 2 * (20 + (x * x * 8.0) as usize);
    let step = x / n as f64;
    let (mut c, mut s) = (0.0, 0.0);
    for i in 0..=n {
        let w = if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
        let t = i as f64 * step;
        c += w * (t * t).cos();
        s += w * (t * t).sin();
    }
    (half + c * step / 3.0, half + s * step / 3.0)
}

/// Amplitude behind a half-plane x < 0 at y = 0 for waves that come straight on (A. Sommerfeld 1896): of a screen on which waves are 0,
/// of one that throws them back whole, and the mean of both.
fn sommerfeld(k: f64, x: f64, y: f64) -> [f64; 3] {
    let r = x.hypot(y);
    let angle = (-y).atan2(-x).rem_euclid(TAU);
    let start = 0.25 * TAU;
    let term = |off: f64| {
        let (c, s) = fresnel((2.0 * k * r).sqrt() * (off / 2.0).cos());
        let phase = -k * r * off.cos() - TAU / 8.0;
        let (pc, ps) = (phase.cos(), phase.sin());
        ((c * pc - s * ps) / std::f64::consts::PI.sqrt(), (c * ps + s * pc) / std::f64::consts::PI.sqrt())
    };
    let (a, b) = (term(angle - start), term(angle + start));
    [(a.0 - b.0).hypot(a.1 - b.1), (a.0 + b.0).hypot(a.1 + b.1), a.0.hypot(a.1)]
}

#[test]
fn waves_bend_round_a_breakwater_as_sommerfeld_says() {
    let depth = 20.0;
    let incoming = wave(6.0, 0.1, 0.25 * TAU, depth);
    let k = incoming.wavenumber.length();
    let wavelength = TAU / k;
    let bed = Bed::of(DVec2::new(-1800.0, -100.0), DVec2::new(5.0, 5.0), 600, 120, |p| {
        if p.x <= 0.0 && p.y.abs() < 6.0 { -1.0 } else { depth }
    })
    .expect("a bed");
    let sea = sea(&bed, &[incoming], depth, &unsmoothed());
    let (mut worst, mut square, mut count) = ([0.0f64; 3], [0.0f64; 3], 0.0);
    for j in 1..=8 {
        let y = f64::from(j) * wavelength;
        for i in -12..=12 {
            // From 45° within the shadow to 45° outside it.
            let x = y * f64::from(i) / 12.0;
            let ours = sea.component(0, x, y).0 / 0.1;
            let exact = sommerfeld(k, x - 2.5, y);
            for n in 0..3 {
                let off = (ours - exact[n]).abs();
                worst[n] = worst[n].max(off);
                square[n] += off * off;
            }
            count += 1.0;
            if i % 4 == 0 && j % 4 == 0 {
                println!("  y {j} λ, x {:5.2} y: {ours:.3}, exact {:.3} {:.3} {:.3}", f64::from(i) / 12.0, exact[0], exact[1], exact[2]);
            }
        }
    }
    let rms = square.map(|s| (s / count).sqrt());
    println!("against Sommerfeld (soft, hard, their mean): largest {worst:.3?}, rms {rms:.3?} of the incoming amplitude");
    // The march has no waves on the screen, as a soft one.
    assert!(worst[0] < 0.10 && rms[0] < 0.04);
}
