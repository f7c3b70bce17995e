//! A sea state in a few numbers.

use glam::DVec2;
use littoral::waves::{Measured, SeaState, Train, bearing_from_heading};
use serde::Serialize;
use std::f64::consts::TAU;

/// The numbers by which a sea is known. Those of formulas are integrals over all frequencies (up to 200 peaks), those of a buoy over the
/// frequencies that it measured.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Significant wave height 4 √m₀ (m).
    pub hs: f64,
    /// Period of the frequency that holds most (s); `None` for a flat sea, as below.
    pub tp: Option<f64>,
    /// m₀ / m₁ (s).
    pub tm01: Option<f64>,
    /// √(m₀ / m₂) (s).
    pub tm02: Option<f64>,
    /// Energy period m₋₁ / m₀ (s).
    pub te: Option<f64>,
    /// Bearing (degrees) from which the energy comes in the mean; `None` if from all round.
    pub mean_direction: Option<f64>,
    /// Bearing (degrees) from which the waves of the peak come.
    pub peak_direction: Option<f64>,
    /// Directional spread √(2 (1 − |m|)) (degrees), m the mean of all unit vectors weighted by energy (A. Kuik et al. 1988).
    pub spread: Option<f64>,
}

/// Directions are told where at least this part of the energy has one.
const DIRECTED: f64 = 1e-3;
/// Steps of sums around the circle.
const STEPS: usize = 360;

/// Bearing from which waves of a frequency (Hz) come, and their spread (both degrees).
pub fn directions(state: &SeaState, frequency: f64) -> (Option<f64>, Option<f64>) {
    told(resultant(state, frequency), state.density(frequency))
}

/// Sum of the headings of a frequency, each as long as its energy density (m²/Hz).
fn resultant(state: &SeaState, frequency: f64) -> DVec2 {
    let slice = state.slice(frequency);
    let part = |i: usize| {
        let heading = TAU * i as f64 / STEPS as f64;
        DVec2::from_angle(heading) * slice.density(heading)
    };
    (0..STEPS).map(part).sum::<DVec2>() * (TAU / STEPS as f64)
}

fn told(resultant: DVec2, energy: f64) -> (Option<f64>, Option<f64>) {
    if energy.is_nan() || energy <= 0.0 {
        return (None, None);
    }
    let strength = (resultant.length() / energy).min(1.0);
    // Sums leave noise in the last digits.
    let round = |degrees: f64| (degrees * 1e8).round() / 1e8;
    let bearing = (strength > DIRECTED).then(|| round(bearing_from_heading(resultant.to_angle())));
    (bearing, Some(round((2.0 * (1.0 - strength)).sqrt().to_degrees())))
}

/// ∫ fⁿ S df and the sum of headings of what a buoy measured: straight lines between its frequencies.
fn measured(sea: &Measured, n: i32) -> (f64, DVec2) {
    let mut sum = (0.0, DVec2::ZERO);
    for pair in sea.bands().windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let width = b.frequency - a.frequency;
        let (middle, between) = (0.5 * (a.frequency + b.frequency), 0.5 * (a.density + b.density));
        let weigh = |f: f64, density: f64| f.powi(n) * density;
        sum.0 += width / 6.0
            * (weigh(a.frequency, a.density) + 4.0 * weigh(middle, between) + weigh(b.frequency, b.density));
        sum.1 += (DVec2::from(a.first) * a.density + DVec2::from(b.first) * b.density) * (0.5 * width);
    }
    sum
}

impl Summary {
    /// That of a state.
    pub fn of(state: &SeaState) -> Summary {
        let moment = |n: i32| -> f64 {
            let part = |train: &Train| match train {
                Train::Formula { spectrum, .. } => spectrum.moment(n),
                Train::Measured(sea) => measured(sea, n).0,
            };
            state.trains.iter().map(part).sum()
        };
        let [before, m0, m1, m2] = [-1, 0, 1, 2].map(moment);
        let period = |value: f64| (m0 > 0.0 && value.is_finite() && value > 0.0).then_some(value);
        let peak = peak(state);
        let headings = state.trains.iter().map(|train| match train {
            Train::Formula { spectrum, .. } => {
                // Midpoints over ln f; direction changes slowly.
                let alone = SeaState { trains: vec![train.clone()], ..SeaState::CALM };
                let (low, high, steps) = (0.4 * spectrum.peak, 20.0 * spectrum.peak, 240);
                let step = (high / low).ln() / f64::from(steps);
                let part = |i: i32| {
                    let f = low * ((f64::from(i) + 0.5) * step).exp();
                    resultant(&alone, f) * f * step
                };
                (0..steps).map(part).sum::<DVec2>()
            }
            Train::Measured(sea) => measured(sea, 0).1,
        });
        let (mean_direction, spread) = told(headings.sum(), m0);
        Summary {
            hs: 4.0 * m0.sqrt(),
            tp: peak.map(|f| 1.0 / f),
            tm01: period(m0 / m1),
            tm02: period((m0 / m2).sqrt()),
            te: period(before / m0),
            mean_direction,
            peak_direction: peak.and_then(|f| directions(state, f).0),
            spread,
        }
    }
}

/// The frequency that holds most (Hz): near a train's own peak, or where sums and shallow water move it.
pub fn peak(state: &SeaState) -> Option<f64> {
    let own = state.peak().filter(|f| state.density(*f) > 0.0)?;
    if let [Train::Measured(_)] = state.trains[..] {
        return Some(own);
    }
    // Golden section within a tenth of an octave or so; several trains may share a hump.
    let (mut low, mut high) = (0.75 * own, 1.35 * own);
    let density = |f: f64| state.density(f);
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..80 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if density(a) < density(b) { low = a } else { high = b }
    }
    let found = 0.5 * (low + high);
    Some(if density(found) > density(own) * (1.0 + 1e-9) { found } else { own })
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::waves::Band;

    fn sea(line: &str) -> Summary {
        Summary::of(&line.parse().unwrap_or_else(|e| panic!("{line}: {e}")))
    }

    #[test]
    fn winds_come_from_where_they_were_said_to() {
        let sea = sea("wind=12,from=240");
        assert!((sea.mean_direction.expect("a direction") - 240.0).abs() < 1e-6);
        assert!((20.0..50.0).contains(&sea.spread.expect("a spread")), "{:?}", sea.spread);
        assert!((sea.tm02.expect("waves") / sea.tp.expect("waves") - 0.76).abs() < 0.04);
    }

    #[test]
    fn widths_are_those_of_the_spreading() {
        // cos²ˢ: |m| = s / (s + 1).
        let spread = sea("wind=12,spread=cos2s:10").spread.expect("a spread");
        assert!((spread - (2.0f64 / 11.0).sqrt().to_degrees()).abs() < 0.01, "{spread}");
    }

    #[test]
    fn peaks_are_the_highest_point() {
        let jonswap = sea("hs=2,tp=8").tp.expect("waves");
        assert_eq!(jonswap, 8.0);
        let state: SeaState = "hs=2,tp=8,model=tma,depth=5,gamma=1".parse().expect("a sea");
        let peak = peak(&state).expect("waves");
        assert!(peak > 1.01 / 8.0, "depth takes more of longer waves: {peak}");
        assert!((1..2000).all(|i| state.density(f64::from(i) * 1e-3) <= state.density(peak)));
        assert!(sea("calm").tp.is_none() && sea("calm").hs == 0.0 && sea("calm").mean_direction.is_none());
    }

    #[test]
    fn measured_moments_are_those_of_straight_lines() {
        // A triangle of height 2 over 0.1 … 0.3 Hz.
        let band = |frequency, density| Band { frequency, density, first: [0.0, 0.5], second: [0.0; 2] };
        let sea = Measured::new(vec![band(0.1, 0.0), band(0.2, 2.0), band(0.3, 0.0)]).expect("bands");
        let summary = Summary::of(&SeaState { trains: vec![Train::Measured(sea)], ..SeaState::CALM });
        assert!((summary.hs - 4.0 * 0.2f64.sqrt()).abs() < 1e-12);
        assert!((summary.tm01.expect("waves") - 5.0).abs() < 1e-12 && summary.tp == Some(5.0));
        // ∫ f² of a triangle: its middle squared plus a sixth of half its width squared.
        let expected = 1.0 / (0.04f64 + 0.01 / 6.0).sqrt();
        assert!((summary.tm02.expect("waves") - expected).abs() < 1e-12);
        assert!((summary.mean_direction.expect("a direction") - 180.0).abs() < 1e-9);
        assert!((summary.spread.expect("a spread") - 1f64.to_degrees()).abs() < 1e-8);
    }
}
