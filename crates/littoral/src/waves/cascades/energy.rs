//! The energy of a sea state by wave number, tabulated, so that a tile's hundred thousand waves are set up in a few milliseconds.

use super::super::SeaState;
use libm::{atan2, cos, exp, log, sin};
use std::f64::consts::TAU;

const DIRECTIONS: usize = 240;
/// Steps of the table for each e-fold of the wave number: the narrowest peak of a spectrum is seven wide.
const FINENESS: f64 = 64.0;

/// Energy density by wave number vector, between two wave numbers.
pub(super) struct Energy {
    /// ln of the lowest wave number.
    low: f64,
    rows: usize,
    /// F(k) k⁴, which is nearly the same for all short waves: by wave number, then by direction, the first one again at the end.
    values: Vec<f32>,
}

impl Energy {
    /// The energy of a state up to a wave number (rad/m).
    pub fn new(state: &SeaState, highest: f64) -> Energy {
        let none = Energy { low: 0.0, rows: 0, values: Vec::new() };
        let Some((low, _)) = state.band() else { return none };
        let water = state.water();
        let low = log(0.5 * water.wavenumber(TAU * low));
        if !low.is_finite() || log(highest) <= low {
            return none;
        }
        let rows = ((log(highest) - low) * FINENESS).ceil() as usize + 2;
        let mut values = Vec::with_capacity(rows * (DIRECTIONS + 1));
        for row in 0..rows {
            let k = exp(low + row as f64 / FINENESS);
            let slice = state.slice(water.angular_frequency(k) / TAU);
            let by_wavenumber = water.group_speed(k) / TAU * k * k * k;
            let start = values.len();
            for direction in 0..DIRECTIONS {
                let heading = TAU * direction as f64 / DIRECTIONS as f64;
                values.push((slice.density(heading) * by_wavenumber) as f32);
            }
            values.push(values[start]);
        }
        Energy { low, rows, values }
    }

    /// Energy density (m² per (rad/m)²) of the waves of a wave number vector (rad/m).
    pub fn density(&self, kx: f64, ky: f64) -> f64 {
        let square = kx * kx + ky * ky;
        let row = (0.5 * log(square) - self.low) * FINENESS;
        if square <= 0.0 || row < 0.0 || row >= self.rows as f64 - 1.0 {
            return 0.0;
        }
        let column = (atan2(ky, kx) / TAU).rem_euclid(1.0) * DIRECTIONS as f64;
        let (i, j) = (row as usize, (column as usize).min(DIRECTIONS - 1));
        let (u, v) = (row - i as f64, column - j as f64);
        let value = |i: usize, j: usize| f64::from(self.values[i * (DIRECTIONS + 1) + j]);
        let below = value(i, j) * (1.0 - v) + value(i, j + 1) * v;
        let above = value(i + 1, j) * (1.0 - v) + value(i + 1, j + 1) * v;
        (below * (1.0 - u) + above * u) / (square * square)
    }

    /// The same on the mean over a square `side` (rad/m) wide.
    pub fn mean_density(&self, kx: f64, ky: f64, side: f64) -> f64 {
        let third = side / 3.0;
        let at = |i: i32| self.density(kx + third * f64::from(i % 3 - 1), ky + third * f64::from(i / 3 - 1));
        (0..9).map(at).sum::<f64>() / 9.0
    }
}

/// A direction as a unit vector.
pub(super) fn unit(angle: f64) -> (f64, f64) {
    (cos(angle), sin(angle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn the_table_is_the_spectrum() {
        let wind = SeaState::of_wind(13.0, 1.1, 2e5).expect("a wind");
        let swell = wind.with_swell(2.0, 13.0, -0.4).expect("a swell");
        let shallow = SeaState { depth: 9.0, ..swell.clone() };
        for state in [swell, shallow] {
            let energy = Energy::new(&state, 90.0);
            let peak = state.water().wavenumber(TAU * state.peak().expect("waves"));
            for i in 0..400 {
                let k = peak * libm::pow(1.035, f64::from(i) - 40.0);
                let heading = 0.37 * f64::from(i);
                let exact = state.wavenumber_density(DVec2::from_angle(heading) * k);
                let most = [1.1, -0.4].map(|mean| state.wavenumber_density(DVec2::from_angle(mean) * k));
                let most = most[0].max(most[1]);
                let table = energy.density(k * cos(heading), k * sin(heading));
                if k < 89.0 {
                    assert!((table - exact).abs() < 0.02 * most + 1e-9, "{k} {heading}: {table} {exact}");
                }
            }
        }
    }
}
