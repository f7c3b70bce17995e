//! A sea as a sum of single waves.
//!
//! Two ways to choose them: over a regular lattice of frequencies and directions, as S. Liu, X. Xu and C. Chen 2009 do; or each with the same
//! energy, drawn from the spectrum in strata, so that few waves serve and no two of them beat in step.

use super::SeaState;
use super::random::uniform;
use glam::DVec2;
use libm::{cos, pow, sin, sqrt};
use std::f64::consts::TAU;

/// A long-crested wave: η = amplitude · cos(wavenumber · x − ω t + phase) over water of one depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneWave {
    /// Half its height (m).
    pub amplitude: f64,
    /// Radians per metre, in the direction in which it runs.
    pub wavenumber: DVec2,
    /// ω (rad/s).
    pub angular_frequency: f64,
    /// Phase at the origin at time 0 (rad).
    pub phase: f64,
}

impl PlaneWave {
    fn new(state: &SeaState, amplitude: f64, frequency: f64, heading: f64, phase: f64) -> PlaneWave {
        let angular_frequency = TAU * frequency;
        let k = state.water().wavenumber(angular_frequency);
        PlaneWave { amplitude, wavenumber: DVec2::new(cos(heading), sin(heading)) * k, angular_frequency, phase }
    }
}

/// `frequencies` × `directions` waves on a regular lattice of angular frequencies and of headings within 90° of the mean:
/// amplitudes √(2 S(ω,θ) Δω Δθ) of Liu, Xu and Chen 2009, scaled together to hold the state's whole energy. Empty for a calm.
pub fn lattice(state: &SeaState, frequencies: usize, directions: usize) -> Vec<PlaneWave> {
    let Some(peak) = state.peak() else { return Vec::new() };
    let (low, high) = (0.5 * peak, 3.0 * peak);
    let mean = state.mean_heading();
    let mut waves = Vec::with_capacity(frequencies * directions);
    for i in 0..frequencies {
        let frequency = low + (high - low) * (i as f64 + 0.5) / frequencies as f64;
        let slice = state.slice(frequency);
        for j in 0..directions {
            let heading = mean + 0.5 * TAU * ((j as f64 + 0.5) / directions as f64 - 0.5);
            let energy = slice.density(heading) * (high - low) / frequencies as f64 * 0.5 * TAU / directions as f64;
            let phase = TAU * uniform(state.seed, i as i64, j as i64, 1);
            waves.push(PlaneWave::new(state, sqrt(2.0 * energy), frequency, heading, phase));
        }
    }
    let energy: f64 = waves.iter().map(|w| 0.5 * w.amplitude * w.amplitude).sum();
    let height = state.significant_height();
    let scale = if energy > 0.0 { sqrt(height * height / 16.0 / energy) } else { 0.0 };
    waves.iter_mut().for_each(|w| w.amplitude *= scale);
    waves
}

/// `count` waves of equal energy that together hold the state's energy between two frequencies (Hz, above 0): each drawn from its own share of
/// the spectrum. Empty for a calm.
pub fn drawn(state: &SeaState, count: usize, low: f64, high: f64) -> Vec<PlaneWave> {
    const STEPS: usize = 2048;
    const ROSE: usize = 360;
    if state.trains.is_empty() || count == 0 || high.is_nan() || low.is_nan() || high <= low || low <= 0.0 {
        return Vec::new();
    }
    // Energy below each frequency, over ln f.
    let frequency = |i: f64| low * pow(high / low, i / STEPS as f64);
    let step = libm::log(high / low) / STEPS as f64;
    let mut below = vec![0.0; STEPS + 1];
    for i in 0..STEPS {
        let f = frequency(i as f64 + 0.5);
        below[i + 1] = below[i] + state.density(f) * f * step;
    }
    let total = below[STEPS];
    if total <= 0.0 {
        return Vec::new();
    }
    let amplitude = sqrt(2.0 * total / count as f64);
    let draw = |n: usize| {
        let key = n as i64;
        let wanted = total * (n as f64 + 0.15 + 0.7 * uniform(state.seed, key, 0, 2)) / count as f64;
        let i = below.partition_point(|b| *b < wanted).clamp(1, STEPS);
        let within = (wanted - below[i - 1]) / (below[i] - below[i - 1]).max(f64::MIN_POSITIVE);
        let f = frequency((i - 1) as f64 + within.clamp(0.0, 1.0));
        // Neighbours in frequency take far-off shares of the directions (van der Corput's sequence).
        let share = (f64::from((n as u32).reverse_bits()) * f64::exp2(-32.0) + uniform(state.seed, 0, 0, 3)).fract();
        let slice = state.slice(f);
        let angle = |j: usize| TAU * j as f64 / ROSE as f64;
        // Counted from opposite the mean direction, so that shares rise across it.
        let start = slice.mean_heading() - 0.5 * TAU;
        let mut sum = [0.0; ROSE + 1];
        for j in 0..ROSE {
            sum[j + 1] = sum[j] + slice.density(start + angle(j) + 0.5 * TAU / ROSE as f64);
        }
        let wanted = share * sum[ROSE];
        let j = sum.partition_point(|b| *b <= wanted).clamp(1, ROSE);
        let within = (wanted - sum[j - 1]) / (sum[j] - sum[j - 1]).max(f64::MIN_POSITIVE);
        let heading = start + angle(j - 1) + within.clamp(0.0, 1.0) * TAU / ROSE as f64;
        PlaneWave::new(state, amplitude, f, heading, TAU * uniform(state.seed, key, 0, 4))
    };
    (0..count).map(draw).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_hold_the_energy_and_run_with_the_wind() {
        let state = SeaState { seed: 3, ..SeaState::of_wind(14.0, 0.7, 3e5).expect("a wind") };
        let height = state.significant_height();
        let (low, high) = state.band().expect("waves");
        for (waves, scatter) in [(lattice(&state, 16, 8), 0.02), (drawn(&state, 64, low, high), 0.08)] {
            let energy: f64 = waves.iter().map(|w| 0.5 * w.amplitude * w.amplitude).sum();
            assert!((4.0 * sqrt(energy) / height - 1.0).abs() < 0.01, "{} waves", waves.len());
            let mean: DVec2 = waves.iter().map(|w| w.wavenumber.normalize() * w.amplitude * w.amplitude).sum();
            assert!((mean.to_angle() - 0.7).abs() < scatter, "towards {}", mean.to_angle());
        }
    }

    #[test]
    fn drawn_waves_follow_the_spectrum() {
        let state = SeaState::of_wind(14.0, 0.0, 3e5).expect("a wind");
        let (low, high) = state.band().expect("waves");
        let waves = drawn(&state, 400, low, high);
        let middle = 1.3 * state.peak().expect("waves");
        let share = waves.iter().filter(|w| w.angular_frequency < TAU * middle).count() as f64 / 400.0;
        let expected = state.moment(0, low, middle) / state.moment(0, low, high);
        assert!((share - expected).abs() < 0.005, "{share} for {expected}");
        // First Fourier coefficient of the directions.
        let cosine = waves.iter().map(|w| w.wavenumber.normalize().x).sum::<f64>() / 400.0;
        let fine: f64 = {
            let f = |i: i32| low * pow(high / low, (f64::from(i) + 0.5) / 400.0);
            let weigh = |i: i32| {
                let slice = state.slice(f(i));
                (0..180)
                    .map(|j| slice.density(f64::from(j) * TAU / 180.0) * cos(f64::from(j) * TAU / 180.0))
                    .sum::<f64>()
                    * TAU
                    / 180.0
                    * f(i)
            };
            let all: f64 = (0..400).map(|i| state.density(f(i)) * f(i)).sum();
            (0..400).map(weigh).sum::<f64>() / all
        };
        assert!((cosine - fine).abs() < 0.01, "{cosine} for {fine}");
    }

    #[test]
    fn calms_have_no_waves() {
        assert!(lattice(&SeaState::CALM, 4, 4).is_empty() && drawn(&SeaState::CALM, 4, 0.1, 1.0).is_empty());
    }
}
