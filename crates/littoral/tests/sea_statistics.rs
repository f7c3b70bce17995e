//! Simulated seas are samples of their spectrum: significant height, mean period and mean direction of long records agree with it within the
//! statistical error of the records.

use glam::DVec2;
use littoral::waves::cascades::{Cascades, Options};
use littoral::waves::{BLOCK, Motion, Points, SeaState, StillWater, Superposition, Velocity, WaveModel};
use std::f64::consts::TAU;

/// What a record tells: variances of height (m²) and of its rate (m²/s²), and covariances of height with the velocity east and north.
#[derive(Clone, Copy, Default)]
struct Record {
    height: f64,
    rate: f64,
    east: f64,
    north: f64,
}

/// A record at points far from each other, over half an hour.
fn record(model: &mut dyn WaveModel, seed: u64) -> Record {
    let (mut sum, mut count) = (Record::default(), 0.0);
    for instant in 0..60 {
        model.set_time(3e4 * seed as f64 + 31.7 * f64::from(instant));
        for block in 0..4 {
            let place = |i: usize| {
                let n = (block * BLOCK + i) as f64;
                DVec2::new(3_700.0 * n + 911.0, (5_300.0 * n * 1.618).rem_euclid(97_000.0))
            };
            let points = Points {
                x: std::array::from_fn(|i| place(i).x),
                y: std::array::from_fn(|i| place(i).y),
                footprint: [0.0; BLOCK],
            };
            let (mut motion, mut velocity) = (Motion::STILL, Velocity::STILL);
            model.add_displacement(&points, &mut motion);
            model.add_velocity(&points, &[0.0; BLOCK], &mut velocity);
            for i in 0..BLOCK {
                let (z, w) = (f64::from(motion.dz[i]), f64::from(velocity.z[i]));
                sum.height += z * z;
                sum.rate += w * w;
                sum.east += z * f64::from(velocity.x[i]);
                sum.north += z * f64::from(velocity.y[i]);
                count += 1.0;
            }
        }
    }
    Record { height: sum.height / count, rate: sum.rate / count, east: sum.east / count, north: sum.north / count }
}

/// Records of many seeds agree with the state whose waves of frequencies from `low` to `high` (Hz) the models carry.
fn agrees(name: &str, state: &SeaState, low: f64, high: f64, model: &dyn Fn(&SeaState) -> Box<dyn WaveModel>) {
    let records: Vec<Record> = (0..16u64)
        .map(|seed| {
            let mut model = model(&SeaState { seed: 100 + seed, ..state.clone() });
            record(&mut *model, seed)
        })
        .collect();
    let check = |what: &str, of: &dyn Fn(&Record) -> f64, expected: f64, least: f64| {
        let values: Vec<f64> = records.iter().map(of).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n).sqrt();
        println!("{name}: {what} {mean:.4} ± {error:.4}, of the spectrum {expected:.4}");
        assert!(error < 0.05 * expected.abs().max(1.0), "{name}: records of {what} scatter by {error}");
        // One in some thousand would lie beyond; `least` is what bands of frequencies and interpolation take.
        assert!((mean - expected).abs() < 3.5 * error + least * expected.abs().max(0.2), "{name}: {what}");
    };
    let moment = |n: i32| state.moment(n, low, high);
    check("significant height", &|r| 4.0 * r.height.sqrt(), 4.0 * moment(0).sqrt(), 0.01);
    let period = (moment(0) / moment(2)).sqrt();
    check("mean period", &|r| TAU * (r.height / r.rate).sqrt(), period, 0.02);
    check("mean direction", &|r| r.north.atan2(r.east), 0.6, 0.01);
}

#[test]
fn records_of_a_sum_of_waves_are_those_of_its_spectrum() {
    let state = SeaState::of_wind(11.0, 0.6, 2e5).expect("a wind");
    // The lattice reaches from half the peak's frequency to three times that.
    let peak = state.peak().expect("waves");
    agrees("16 × 8 waves", &state, 0.5 * peak, 3.0 * peak, &|state| {
        Box::new(Superposition::of_state(state, 16, 8).expect("a sea"))
    });
}

#[test]
fn records_of_tiles_are_those_of_their_spectrum() {
    let state = SeaState::of_wind(11.0, 0.6, 2e5).expect("a wind");
    let options = Options { samples: 128, foam: false, highest: 2.0, ..Options::default() };
    let (low, _) = state.band().expect("waves");
    let high = StillWater::DEEP.angular_frequency(options.highest) / TAU;
    agrees("tiles", &state, low, high, &|state| Box::new(Cascades::new(state, &options).expect("a sea")));
}
