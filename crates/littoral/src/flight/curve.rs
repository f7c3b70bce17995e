//! The curve behind a flight: piecewise cubics, the lift over the ground, and arc length. See [`super`] for the works
//! they rest on.

use super::{Ground, Interpolation};
use glam::DVec3;

/// A piecewise cubic over increasing knots.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    pub(super) knots: Vec<f64>,
    /// For each piece the powers of (t − its first knot).
    pub(super) pieces: Vec<[DVec3; 4]>,
}

impl Curve {
    /// Through all `points`; for a closed curve the last is the first again.
    pub(super) fn through(points: &[DVec3], interpolation: Interpolation, closed: bool) -> Curve {
        let mut knots = vec![0.0];
        for (i, pair) in points.windows(2).enumerate() {
            knots.push(knots[i] + (pair[1] - pair[0]).length().sqrt()); // centripetal
        }
        let spans: Vec<f64> = knots.windows(2).map(|k| k[1] - k[0]).collect();
        let slopes: Vec<DVec3> = points.windows(2).zip(&spans).map(|(p, h)| (p[1] - p[0]) / h).collect();
        let hermite = |tangents: &[DVec3]| {
            let piece = |i: usize| {
                let (h, s, a, b) = (spans[i], slopes[i], tangents[i], tangents[i + 1]);
                [points[i], a, (3.0 * s - 2.0 * a - b) / h, (a + b - 2.0 * s) / (h * h)]
            };
            (0..spans.len()).map(piece).collect()
        };
        let pieces = match interpolation {
            Interpolation::Straight => {
                points.iter().zip(&slopes).map(|(&p, &s)| [p, s, DVec3::ZERO, DVec3::ZERO]).collect()
            }
            Interpolation::CatmullRom => hermite(&catmull_rom_tangents(&spans, &slopes, closed)),
            Interpolation::Smooth => hermite(&spline_tangents(&spans, &slopes, closed)),
        };
        Curve { knots, pieces }
    }

    pub(super) fn end(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// The piece a parameter falls into, and how far through it (0 to 1).
    pub(super) fn segment(&self, at: f64) -> (usize, f64) {
        let segment = self.knots.partition_point(|&k| k <= at).clamp(1, self.pieces.len()) - 1;
        let (from, to) = (self.knots[segment], self.knots[segment + 1]);
        (segment, ((at - from) / (to - from)).clamp(0.0, 1.0))
    }

    pub(super) fn position(&self, at: f64) -> DVec3 {
        let (segment, _) = self.segment(at);
        let ([a, b, c, d], t) = (self.pieces[segment], at - self.knots[segment]);
        a + t * (b + t * (c + t * d))
    }

    pub(super) fn derivative(&self, at: f64) -> DVec3 {
        let (segment, _) = self.segment(at);
        let ([_, b, c, d], t) = (self.pieces[segment], at - self.knots[segment]);
        b + t * (2.0 * c + t * 3.0 * d)
    }
}

/// The derivative at each point of the parabola through it and its neighbours; at open ends as if the curve went on
/// mirrored.
fn catmull_rom_tangents(spans: &[f64], slopes: &[DVec3], closed: bool) -> Vec<DVec3> {
    let pieces = spans.len();
    let tangent = |before: usize, after: usize| {
        let (g, h) = (spans[before], spans[after]);
        (h * slopes[before] + g * slopes[after]) / (g + h)
    };
    let mut tangents: Vec<DVec3> = (1..pieces).map(|i| tangent(i - 1, i)).collect();
    let (first, last) = match closed {
        true => (tangent(pieces - 1, 0), tangent(pieces - 1, 0)),
        false => (slopes[0], slopes[pieces - 1]),
    };
    tangents.insert(0, first);
    tangents.push(last);
    tangents
}

/// The derivatives that make curvature continuous: h₁ m₀ + 2(h₀+h₁) m₁ + h₀ m₂ = 3(h₁ s₀ + h₀ s₁) at each inner point,
/// and no curvature at open ends.
fn spline_tangents(spans: &[f64], slopes: &[DVec3], closed: bool) -> Vec<DVec3> {
    let pieces = spans.len();
    let inner = |before: usize, after: usize| {
        let (g, h) = (spans[before], spans[after]);
        (h, 2.0 * (g + h), g, 3.0 * (h * slopes[before] + g * slopes[after]))
    };
    if !closed {
        let mut rows = vec![(0.0, 2.0, 1.0, 3.0 * slopes[0])];
        rows.extend((1..pieces).map(|i| inner(i - 1, i)));
        rows.push((1.0, 2.0, 0.0, 3.0 * slopes[pieces - 1]));
        return tridiagonal(&rows);
    }
    // Sherman–Morrison: the two corner entries are a rank-one change of a tridiagonal matrix.
    let mut rows: Vec<_> = (0..pieces).map(|i| inner((i + pieces - 1) % pieces, i)).collect();
    let (top_right, bottom_left) = (rows[0].0, rows[pieces - 1].2);
    let gamma = -rows[0].1;
    rows[0].1 -= gamma;
    rows[pieces - 1].1 -= top_right * bottom_left / gamma;
    let plain = tridiagonal(&rows);
    for (i, row) in rows.iter_mut().enumerate() {
        row.3 = DVec3::splat(match i {
            0 => gamma,
            i if i == pieces - 1 => bottom_left,
            _ => 0.0,
        });
    }
    let correction = tridiagonal(&rows);
    let along = |x: &[DVec3]| x[0] + x[pieces - 1] * (top_right / gamma);
    let factor = along(&plain) / (DVec3::ONE + along(&correction));
    let mut tangents: Vec<DVec3> = plain.iter().zip(&correction).map(|(x, z)| x - factor * z).collect();
    tangents.push(tangents[0]);
    tangents
}

/// Solves a diagonally dominant tridiagonal system; each row: below, on and above the diagonal, right-hand side.
fn tridiagonal(rows: &[(f64, f64, f64, DVec3)]) -> Vec<DVec3> {
    let mut above = Vec::with_capacity(rows.len());
    let mut solution: Vec<DVec3> = Vec::with_capacity(rows.len());
    for (i, &(a, b, c, r)) in rows.iter().enumerate() {
        let (pivot, rest) = match i {
            0 => (b, r),
            _ => (b - a * above[i - 1], r - a * solution[i - 1]),
        };
        above.push(c / pivot);
        solution.push(rest / pivot);
    }
    for i in (0..rows.len() - 1).rev() {
        let next = solution[i + 1];
        solution[i] -= above[i] * next;
    }
    solution
}

/// How much a curve is raised to clear the ground: a uniform cubic B-spline over its parameter.
#[derive(Clone, Debug)]
pub(super) struct Lift {
    pub(super) step: f64,
    /// Control points, one before the first sample to one beyond the last; empty for no lift at all.
    pub(super) controls: Vec<f64>,
}

impl Lift {
    pub(super) fn none(curve: &Curve) -> Lift {
        Lift { step: curve.end(), controls: Vec::new() }
    }

    pub(super) fn any(&self) -> bool {
        !self.controls.is_empty()
    }

    pub(super) fn over(curve: &Curve, ground: Ground<'_>, clearance: f64, closed: bool, duration: f64) -> Lift {
        let samples = (64 * curve.pieces.len()).clamp(1 << 12, 1 << 16);
        let step = curve.end() / samples as f64;
        let missing = |i: usize| {
            let p = curve.position(i as f64 * step);
            ground(p.truncate()).map_or(0.0, |ground| (ground + clearance - p.z).max(0.0))
        };
        let missing: Vec<f64> = (0..=samples).map(missing).collect();
        if missing.iter().all(|&m| m == 0.0) {
            return Lift::none(curve);
        }
        // Start to climb about a second and a half ahead, however fast the path is flown, but not over a tenth of it.
        let reach = ((1.5 / duration * samples as f64) as usize).clamp(6, samples / 10) / 3 * 3;
        // Indices beyond the ends: round again, or as at the end.
        let pad = 2 * reach + 4;
        let index = |i: isize| match closed {
            true => i.rem_euclid(samples as isize) as usize,
            false => i.clamp(0, samples as isize) as usize,
        };
        let padded: Vec<f64> = (-(pad as isize)..=(samples + pad) as isize).map(|i| missing[index(i)]).collect();
        // A control point is felt two samples away: widen by two more than the averages will narrow.
        let mut controls = running_maximum(&padded, reach + 2);
        for _ in 0..3 {
            controls = running_mean(&controls, reach / 3);
        }
        Lift { step, controls: controls[pad - 1..=pad + samples + 1].to_vec() }
    }

    /// Value and derivative.
    pub(super) fn value(&self, at: f64) -> (f64, f64) {
        if self.controls.is_empty() {
            return (0.0, 0.0);
        }
        let x = (at / self.step).max(0.0);
        let index = (x as usize).min(self.controls.len() - 4);
        let t = (x - index as f64).clamp(0.0, 1.0);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| self.controls[index + i]);
        let s = 1.0 - t;
        let value = (s * s * s * a
            + (4.0 - 6.0 * t * t + 3.0 * t * t * t) * b
            + (4.0 - 6.0 * s * s + 3.0 * s * s * s) * c
            + t * t * t * d)
            / 6.0;
        let slope = (s * s * (b - a) + (1.0 + 2.0 * t * s) * (c - b) + t * t * (d - c)) / 2.0;
        (value, slope / self.step)
    }
}

/// The greatest number within `reach` places of each.
fn running_maximum(numbers: &[f64], reach: usize) -> Vec<f64> {
    let mut falling = std::collections::VecDeque::new();
    let mut result = Vec::with_capacity(numbers.len());
    for i in 0..numbers.len() + reach {
        if i < numbers.len() {
            while falling.back().is_some_and(|&j: &usize| numbers[j] <= numbers[i]) {
                falling.pop_back();
            }
            falling.push_back(i);
        }
        if i >= reach {
            while falling.front().is_some_and(|&j| j + reach < i - reach) {
                falling.pop_front();
            }
            result.push(falling.front().map_or(0.0, |&j| numbers[j]));
        }
    }
    result
}

/// The mean within `reach` places of each number, fewer at the ends.
fn running_mean(numbers: &[f64], reach: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    for (i, number) in numbers.iter().enumerate() {
        sums.push(sums[i] + number);
    }
    let mean = |i: usize| {
        let (from, to) = (i.saturating_sub(reach), (i + reach + 1).min(numbers.len()));
        ((sums[to] - sums[from]) / (to - from) as f64).max(0.0)
    };
    (0..numbers.len()).map(mean).collect()
}

/// Arc length over the parameter.
#[derive(Clone, Debug)]
pub(super) struct Lengths {
    /// Parameter and length so far, both increasing.
    pub(super) table: Vec<(f64, f64)>,
}

impl Lengths {
    pub(super) fn of(curve: &Curve, lift: &Lift) -> Lengths {
        // Intervals end at every knot of the curve and of the lift, so that the integrand is smooth within each.
        let mut marks = Vec::new();
        for pair in curve.knots.windows(2) {
            marks.extend((0..32).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / 32.0));
        }
        marks.extend((0..lift.controls.len().saturating_sub(3)).map(|i| i as f64 * lift.step));
        marks.push(curve.end());
        marks.sort_by(f64::total_cmp);
        marks.dedup();
        let mut table = vec![(0.0, 0.0)];
        for pair in marks.windows(2) {
            let so_far = table[table.len() - 1].1;
            table.push((pair[1], so_far + arc(curve, lift, pair[0], pair[1])));
        }
        Lengths { table }
    }

    pub(super) fn total(&self) -> f64 {
        self.table[self.table.len() - 1].1
    }

    /// The parameter at a distance from the start.
    pub(super) fn parameter(&self, distance: f64, curve: &Curve, lift: &Lift) -> f64 {
        let index = self.table.partition_point(|&(_, s)| s <= distance).clamp(1, self.table.len() - 1);
        let ((t0, s0), (t1, s1)) = (self.table[index - 1], self.table[index]);
        let wanted = (distance - s0).clamp(0.0, s1 - s0);
        let mut at = if s1 > s0 { t0 + (t1 - t0) * wanted / (s1 - s0) } else { t0 };
        // Newton: the intervals are short, two steps reach rounding.
        for _ in 0..3 {
            let speed = speed(curve, lift, at);
            if speed > 1e-9 {
                at = (at - (arc(curve, lift, t0, at) - wanted) / speed).clamp(t0, t1);
            }
        }
        at
    }
}

fn speed(curve: &Curve, lift: &Lift, at: f64) -> f64 {
    (curve.derivative(at) + DVec3::Z * lift.value(at).1).length()
}

/// Length between two parameters within one interval: Gauss–Legendre of five points.
fn arc(curve: &Curve, lift: &Lift, from: f64, to: f64) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    half * NODES.iter().map(|(x, w)| w * speed(curve, lift, middle + half * x)).sum::<f64>()
}
