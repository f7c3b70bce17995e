//! What Peachey's waves answer, sixteen points at a time.
//!
//! A quadratic B-spline at a point is a sum over the nine nodes around. Points may lie anywhere, so each has its own nodes, and what one of these
//! tells lies along lanes: amplitude, profile, wave number and depth are summed together in `f32`, and beside them its phase in `f64`, for it may
//! be hundreds of cycles. Rows of three come first: slopes share them with heights. The sums are turned, and what follows from them has points
//! along lanes.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are told apart by their number")]

use super::{Node, Peachey, Train};
use crate::waves::fft::kernel::transpose;
use crate::waves::sum::{circle, power_of_two};
use crate::waves::{BLOCK, Motion, Points, Velocity};
use multiversion::multiversion;
use std::f32::consts::{LOG2_E, PI, TAU};
use std::slice::from_ref;

type Lanes = [f32; BLOCK];

/// Points among the nodes of a bed.
#[repr(C, align(64))]
struct Taps {
    /// The first of the nodes around each, among those with a border.
    first: [u32; BLOCK],
    across: Weights,
    up: Weights,
    /// From the first node of the bed (m).
    x: [f64; BLOCK],
    y: [f64; BLOCK],
    footprint: Lanes,
    /// From one row of nodes to the next.
    stride: usize,
    /// Whether any footprint is above 0.
    wide: bool,
}

/// Weights of the nodes before, at and after points along one axis, and their derivatives (1/m).
#[repr(C, align(64))]
struct Weights {
    of: [[f64; BLOCK]; 3],
    by: [[f64; BLOCK]; 3],
    of_short: [Lanes; 3],
    by_short: [Lanes; 3],
}

/// Four sums over the nodes around points: for up to four trains, or for one its values and their derivatives eastward and northward (1/m).
#[repr(C, align(64))]
struct Sums {
    /// Phases (cycles) less those of the deep.
    cycles: [[f64; BLOCK]; 4],
    /// Four numbers of each: see [`Sums::others`].
    others: [Lanes; BLOCK],
}

impl Sums {
    /// Amplitude, profile, wave number and depth.
    #[inline(always)]
    fn others(&self, n: usize) -> [Lanes; 4] {
        [0, 1, 2, 3].map(|i| self.others[4 * n + i])
    }
}

/// Weights of points (m from the first node), and the nodes before them among those with a border.
#[inline(always)]
fn weigh<const JETS: usize>(from: &[f64; BLOCK], spacing: f64, count: usize) -> (Weights, [f64; BLOCK]) {
    let none = [[0.0; BLOCK]; 3];
    let none_short = [[0.0; BLOCK]; 3];
    let mut weights = Weights { of: none, by: none, of_short: none_short, by_short: none_short };
    let mut before = [0.0; BLOCK];
    let per_metre = 1.0 / spacing;
    for lane in 0..BLOCK {
        // Half a spacing beyond the border the spline is constant outward.
        let place = (from[lane] * per_metre).max(-0.5).min(count as f64 - 0.5);
        let nearest = (place + 0.5).floor().min(count as f64 - 1.0);
        let t = place - nearest;
        let (left, right) = (0.5 - t, 0.5 + t);
        let of = [0.5 * left * left, 0.75 - t * t, 0.5 * right * right];
        for i in 0..3 {
            weights.of[i][lane] = of[i];
            weights.of_short[i][lane] = of[i] as f32;
        }
        if JETS > 1 {
            let by = [-left * per_metre, -2.0 * t * per_metre, right * per_metre];
            for i in 0..3 {
                weights.by[i][lane] = by[i];
                weights.by_short[i][lane] = by[i] as f32;
            }
        }
        before[lane] = nearest;
    }
    (weights, before)
}

/// Finds points among the nodes, with derivatives of weights if there are three jets.
#[inline(always)]
fn taps<const JETS: usize>(waves: &Peachey, points: &Points) -> Taps {
    let (mut x, mut y) = ([0.0; BLOCK], [0.0; BLOCK]);
    let (mut footprint, mut wide) = ([0.0; BLOCK], false);
    for lane in 0..BLOCK {
        // What is not a number or too far for phases to mean anything counts as 0.
        let (at_x, at_y) = (points.x[lane], points.y[lane]);
        x[lane] = if at_x.abs() <= 1e12 { at_x } else { 0.0 } - waves.origin.x;
        y[lane] = if at_y.abs() <= 1e12 { at_y } else { 0.0 } - waves.origin.y;
        footprint[lane] = points.footprint[lane].max(0.0);
        wide |= footprint[lane] > 0.0;
    }
    let (across, columns) = weigh::<JETS>(&x, waves.spacing, waves.columns);
    let (up, rows) = weigh::<JETS>(&y, waves.spacing, waves.rows);
    let stride = waves.columns + 2;
    let mut first = [0; BLOCK];
    for lane in 0..BLOCK {
        // Exact, and whole numbers lie in the low bits after that.
        let whole = rows[lane].mul_add(stride as f64, columns[lane]) + 4_503_599_627_370_496.0;
        first[lane] = whole.to_bits() as u32;
    }
    Taps { first, stride, across, up, x, y, footprint, wide }
}

/// Sums over the nodes around each point: with one jet for up to four trains, with three for one.
#[inline(always)]
fn sum<const JETS: usize>(trains: &[Train], taps: &Taps) -> Sums {
    let mut sums = Sums { cycles: [[0.0; BLOCK]; 4], others: [[0.0; BLOCK]; BLOCK] };
    for lane in 0..BLOCK {
        for (train, first) in trains.iter().zip((0..4).step_by(JETS)) {
            let mut long = [0f64; JETS];
            let mut short = [[0f32; 4]; JETS];
            for j in 0..3 {
                let nodes = &train.nodes[taps.first[lane] as usize + j * taps.stride..][..3];
                let (mut row, mut row_by) = (0f64, 0f64);
                let (mut others, mut others_by) = ([0f32; 4], [0f32; 4]);
                for i in 0..3 {
                    let Node { cycles, amplitude, shore, wavenumber, depth } = nodes[i];
                    let numbers = [amplitude, shore, wavenumber, depth];
                    row = taps.across.of[i][lane].mul_add(cycles, row);
                    for n in 0..4 {
                        others[n] = taps.across.of_short[i][lane].mul_add(numbers[n], others[n]);
                    }
                    if JETS > 1 {
                        row_by = taps.across.by[i][lane].mul_add(cycles, row_by);
                        for n in 0..4 {
                            others_by[n] = taps.across.by_short[i][lane].mul_add(numbers[n], others_by[n]);
                        }
                    }
                }
                let (up, up_by) = (taps.up.of[j][lane], taps.up.by[j][lane]);
                let (up_short, up_by_short) = (taps.up.of_short[j][lane], taps.up.by_short[j][lane]);
                long[0] = up.mul_add(row, long[0]);
                for n in 0..4 {
                    short[0][n] = up_short.mul_add(others[n], short[0][n]);
                }
                if JETS > 1 {
                    long[1 % JETS] = up.mul_add(row_by, long[1 % JETS]);
                    long[2 % JETS] = up_by.mul_add(row, long[2 % JETS]);
                    for n in 0..4 {
                        short[1 % JETS][n] = up_short.mul_add(others_by[n], short[1 % JETS][n]);
                        short[2 % JETS][n] = up_by_short.mul_add(others[n], short[2 % JETS][n]);
                    }
                }
            }
            for jet in 0..JETS {
                sums.cycles[first + jet][lane] = long[jet];
                for n in 0..4 {
                    sums.others[lane][4 * (first + jet) + n] = short[jet][n];
                }
            }
        }
    }
    // Till now each point had its row.
    transpose(&mut sums.others);
    sums
}

/// Phases (cycles within ±½).
#[inline(always)]
fn phases(train: &Train, taps: &Taps, cycles: &[f64; BLOCK]) -> Lanes {
    let mut phases = [0f32; BLOCK];
    for lane in 0..BLOCK {
        let deep = train.far.x.mul_add(taps.x[lane], train.far.y.mul_add(taps.y[lane], train.cycles));
        let all = deep + cycles[lane];
        phases[lane] = (all - all.round_ties_even()) as f32;
    }
    phases
}

/// How much of waves of a wave number is left in a footprint, before it is clamped to [0, 1]: none of those shorter than twice the footprint, all of
/// those twice as long again.
#[inline(always)]
fn left(wavenumber: f32, footprint: f32) -> f32 {
    PI / (wavenumber * footprint) - 1.0
}

/// Peachey's profile and its derivatives by phase and by shore, at a phase (cycles within ±½): a cosine in the deep, 8 (|phase| − ½)² − 1 at the shore.
#[inline(always)]
pub(super) fn profile(phase: f32, shore: f32) -> (f32, f32, f32) {
    let (cosine, sine) = circle(phase);
    let beside = phase - 0.5f32.copysign(phase);
    let apart = (8.0 * beside).mul_add(beside, -1.0) - cosine;
    let by_cycles = -TAU * sine;
    (shore.mul_add(apart, cosine), shore.mul_add(16.0 * beside - by_cycles, by_cycles), apart)
}

/// Mean of the square of the profile's derivative by phase.
#[inline(always)]
pub(super) fn profile_steepness(shore: f32) -> f32 {
    let deep = 1.0 - shore;
    deep * deep * (2.0 * PI * PI) + 2.0 * deep * shore * 16.0 + shore * shore * (64.0 / 3.0)
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn add_displacement(waves: &Peachey, points: &Points, motion: &mut Motion) {
    add_displacement_body(waves, points, motion);
}

#[inline(always)]
pub(super) fn add_displacement_body(waves: &Peachey, points: &Points, motion: &mut Motion) {
    let taps = taps::<1>(waves, points);
    let mut up = [0f32; BLOCK];
    for trains in waves.trains.chunks(4) {
        let sums = sum::<1>(trains, &taps);
        for (train, n) in trains.iter().zip(0..4) {
            let phases = phases(train, &taps, &sums.cycles[n]);
            let [mut amplitude, shore, wavenumber, _] = sums.others(n);
            if taps.wide {
                for lane in 0..BLOCK {
                    amplitude[lane] *= left(wavenumber[lane], taps.footprint[lane]).clamp(0.0, 1.0);
                }
            }
            for lane in 0..BLOCK {
                let (w, ..) = profile(phases[lane], shore[lane]);
                up[lane] = amplitude[lane].mul_add(w, up[lane]);
            }
        }
    }
    for lane in 0..BLOCK {
        motion.dz[lane] += up[lane];
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn add_motion(waves: &Peachey, points: &Points, motion: &mut Motion) {
    add_motion_body(waves, points, motion);
}

#[inline(always)]
pub(super) fn add_motion_body(waves: &Peachey, points: &Points, motion: &mut Motion) {
    let taps = taps::<3>(waves, points);
    let (mut up, mut tilt_x, mut tilt_y) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    for train in &waves.trains {
        let sums = sum::<3>(from_ref(train), &taps);
        let phases = phases(train, &taps, &sums.cycles[0]);
        let [mut amplitude, shore, wavenumber, _] = sums.others(0);
        let [mut amplitude_x, shore_x, wavenumber_x, _] = sums.others(1);
        let [mut amplitude_y, shore_y, wavenumber_y, _] = sums.others(2);
        let (mut x, mut y) = ([0f32; BLOCK], [0f32; BLOCK]);
        for lane in 0..BLOCK {
            x[lane] = (train.far.x + sums.cycles[1][lane]) as f32;
            y[lane] = (train.far.y + sums.cycles[2][lane]) as f32;
        }
        if taps.wide {
            for lane in 0..BLOCK {
                let whole = left(wavenumber[lane], taps.footprint[lane]);
                let left = whole.clamp(0.0, 1.0);
                let lost = (1.0 - left * left) * amplitude[lane] * amplitude[lane] * profile_steepness(shore[lane]);
                motion.hidden_xx[lane] = lost.mul_add(x[lane] * x[lane], motion.hidden_xx[lane]);
                motion.hidden_xy[lane] = lost.mul_add(x[lane] * y[lane], motion.hidden_xy[lane]);
                motion.hidden_yy[lane] = lost.mul_add(y[lane] * y[lane], motion.hidden_yy[lane]);
                // ∂left/∂k = −(left + 1) / k.
                let fading = if whole > 0.0 && whole < 1.0 { -(whole + 1.0) / wavenumber[lane] } else { 0.0 };
                amplitude_x[lane] = left.mul_add(amplitude_x[lane], amplitude[lane] * fading * wavenumber_x[lane]);
                amplitude_y[lane] = left.mul_add(amplitude_y[lane], amplitude[lane] * fading * wavenumber_y[lane]);
                amplitude[lane] *= left;
            }
        }
        for lane in 0..BLOCK {
            let (w, by_cycles, by_shore) = profile(phases[lane], shore[lane]);
            up[lane] = amplitude[lane].mul_add(w, up[lane]);
            let profile_x = by_cycles.mul_add(x[lane], by_shore * shore_x[lane]);
            let profile_y = by_cycles.mul_add(y[lane], by_shore * shore_y[lane]);
            tilt_x[lane] = amplitude_x[lane].mul_add(w, amplitude[lane].mul_add(profile_x, tilt_x[lane]));
            tilt_y[lane] = amplitude_y[lane].mul_add(w, amplitude[lane].mul_add(profile_y, tilt_y[lane]));
        }
    }
    for lane in 0..BLOCK {
        motion.dz[lane] += up[lane];
        motion.slope_x[lane] += tilt_x[lane];
        motion.slope_y[lane] += tilt_y[lane];
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn add_velocity(waves: &Peachey, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
    add_velocity_body(waves, points, depths, velocity);
}

#[inline(always)]
pub(super) fn add_velocity_body(waves: &Peachey, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
    let taps = taps::<3>(waves, points);
    let (mut across, mut up, mut down) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    for train in &waves.trains {
        let sums = sum::<3>(from_ref(train), &taps);
        let phases = phases(train, &taps, &sums.cycles[0]);
        let [amplitude, shore, wavenumber, bed] = sums.others(0);
        let frequency = (1.0 / train.swell.period) as f32;
        for lane in 0..BLOCK {
            let left = left(wavenumber[lane], taps.footprint[lane]).clamp(0.0, 1.0);
            let (w, by_cycles, _) = profile(phases[lane], shore[lane]);
            let bed = bed[lane].max(0.01);
            let deep = if depths[lane] > 0.0 { depths[lane] } else { 0.0 };
            let wet = if deep <= bed { 1.0 } else { 0.0 };
            let deep = deep.min(bed);
            // cosh k(h − d) / sinh kh and sinh k(h − d) / sinh kh.
            let decay = -wavenumber[lane] * LOG2_E;
            let (fallen, mirrored) = (power_of_two(decay * deep), power_of_two(decay * (bed - deep + bed)));
            let rate = amplitude[lane] * left * wet * frequency / (1.0 - power_of_two(2.0 * decay * bed));
            let (x, y) = ((train.far.x + sums.cycles[1][lane]) as f32, (train.far.y + sums.cycles[2][lane]) as f32);
            let length = x.mul_add(x, y * y).sqrt().max(f32::MIN_POSITIVE);
            // The profile's mean is no motion.
            let forward = TAU * rate * (fallen + mirrored) * shore[lane].mul_add(1.0 / 3.0, w) / length;
            across[lane] = forward.mul_add(x, across[lane]);
            up[lane] = forward.mul_add(y, up[lane]);
            down[lane] = (rate * (fallen - mirrored)).mul_add(by_cycles, down[lane]);
        }
    }
    for lane in 0..BLOCK {
        velocity.x[lane] += across[lane];
        velocity.y[lane] += up[lane];
        velocity.z[lane] -= down[lane];
    }
}
