//! How far a tile goes: bounds of the patches between its samples, and of its waves below a length.
//!
//! A bicubic patch lies within the hull of its sixteen Bézier points, and its derivatives within those of the differences of neighbouring
//! ones. For a side h = 3t, values and slopes at the ends of a line make the points f₀, f₀ + t x₀, f₁ − t x₁, f₁; the mixed derivatives are 0,
//! so that lines of points a third further up differ by t y₀ and t y₁ at their ends.

use super::super::STANDARD_GRAVITY;
use super::super::fft::kernel::transpose;
use super::super::fft::steps::{field, motion_stride};
use super::super::fft::{LANES, Lane};
use super::super::model::Bounds;
use super::patch::Patch;
use super::query::{Corners, at_corners};
use multiversion::multiversion;
use std::f64::consts::TAU;

/// Greatest magnitudes within a patch of a field and its derivatives: value, ∂x, ∂y, ∂xx, ∂xy, ∂yy.
#[inline(always)]
fn extents(corners: [[f32; 3]; 4], side: f32) -> [f32; 6] {
    let [a, b, c, d] = corners;
    let t = side / 3.0;
    let most = |p: f32, q: f32| if p > q { p } else { q };
    let value = |p: [f32; 3]| p[0].abs() + t * (p[1].abs() + p[2].abs());
    let value = most(most(value(a), value(b)), most(value(c), value(d)));
    // What the slope between the two inner points of a line adds to those at its ends.
    let along = |p: [f32; 3], q: [f32; 3], k: usize| (q[0] - p[0]) - t * (p[k] + q[k]);
    // By how much lines a third further up differ in that.
    let across = |p: [f32; 3], q: [f32; 3], k: usize| t * (q[3 - k] - p[3 - k]).abs();
    let (low, high) = (along(a, b, 1), along(c, d, 1));
    let (low_more, high_more) = (across(a, b, 1), across(c, d, 1));
    let (left, right) = (along(a, c, 2), along(b, d, 2));
    let (left_more, right_more) = (across(a, c, 2), across(b, d, 2));
    let ends = |k: usize| t * most(most(a[k].abs(), b[k].abs()), most(c[k].abs(), d[k].abs()));
    let x = most(ends(1), most(low.abs() + low_more, high.abs() + high_more));
    let y = most(ends(2), most(left.abs() + left_more, right.abs() + right_more));
    let bend = |inner: f32, more: f32, p: [f32; 3], q: [f32; 3], k: usize| {
        most((inner - t * p[k]).abs(), (inner - t * q[k]).abs()) + more
    };
    let xx = most(bend(low, low_more, a, b, 1), bend(high, high_more, c, d, 1));
    let yy = most(bend(left, left_more, a, c, 2), bend(right, right_more, b, d, 2));
    // Differences of differences: 0 at corners, t Δ along sides, and in the middle.
    let (below, above) = (t * (b[2] - a[2]), t * (d[2] - c[2]));
    let (before, after) = (t * (c[1] - a[1]), t * (d[1] - b[1]));
    let middle = (high - low) - (below + above);
    let xy = most(middle.abs(), most(most(below.abs(), above.abs()), most(before.abs(), after.abs())));
    let (first, second) = (3.0 / side, 1.0 / (side * side));
    [value, x * first, y * first, 6.0 * xx * second, 9.0 * xy * second, 6.0 * yy * second]
}

/// Greatest spectral norm of a symmetric matrix whose entries have these magnitudes.
#[inline(always)]
fn norm(xx: f32, xy: f32, yy: f32) -> f32 {
    0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt()
}

/// Height, sideways, slope, stretch, curvature and bend, of each lane.
type Most = [Lane; 6];

/// Grows `most` to the extents of patches.
#[inline(always)]
fn grow(corners: &Corners, most: &mut Most) {
    use field::{X, XX, XY, Y, YY, Z, ZX, ZY};
    for l in 0..LANES {
        let side = corners.side[l];
        let z = extents(at_corners(corners, l, Z, ZX, ZY), side);
        let x = extents(at_corners(corners, l, X, XX, XY), side);
        let y = extents(at_corners(corners, l, Y, XY, YY), side);
        let (bend_x, bend_y) = (norm(x[3], x[4], x[5]), norm(y[3], y[4], y[5]));
        let here = [
            z[0],
            (x[0] * x[0] + y[0] * y[0]).sqrt(),
            (z[1] * z[1] + z[2] * z[2]).sqrt(),
            norm(x[1], 0.5 * (x[2] + y[1]), y[2]),
            norm(z[3], z[4], z[5]),
            (bend_x * bend_x + bend_y * bend_y).sqrt(),
        ];
        for k in 0..6 {
            most[k][l] = if here[k] > most[k][l] { here[k] } else { most[k][l] };
        }
    }
}

/// The greatest of all patches between two rows of samples.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn rows(low: &[f32], high: &[f32], corners: &mut Corners, most: &mut Most) {
    for first in (0..low.len() / 8 - 2).step_by(LANES) {
        for l in 0..LANES {
            let at = 8 * (first + l);
            corners.low[l].copy_from_slice(&low[at..at + 16]);
            corners.high[l].copy_from_slice(&high[at..at + 16]);
        }
        transpose(&mut corners.low);
        transpose(&mut corners.high);
        grow(corners, most);
    }
}

impl Patch {
    /// How far its motion goes at this instant.
    pub fn bounds(&self) -> Bounds {
        let n = self.tile.samples;
        let (samples, stride) = (self.level(0), 16 * motion_stride(n));
        let mut corners = Corners::zero();
        corners.side = [(self.tile.length / n as f64) as f32; LANES];
        let mut most = [[0.0; LANES]; 6];
        for j in 0..n {
            let above = (j + 1) & (n - 1);
            rows(&samples[j * stride..][..stride], &samples[above * stride..][..stride], &mut corners, &mut most);
        }
        // A little more than rounding can add.
        let [height, sideways, slope, stretch, curvature, bend] =
            most.map(|lane| lane.iter().fold(0.0, |a: f32, b| a.max(*b)) * 1.000_01);
        Bounds { height, sideways, slope, stretch, curvature, bend }
    }

    /// Variance (m²/s²) that is to be expected, at most, of how fast water rises: of waves with ω² = g k that of ω a, which by the inequality of Cauchy
    /// and Schwarz is no more than g times the deviations of heights, a, and slopes, k a. Shallow water is slower.
    pub fn variance_of_rising(&self) -> f64 {
        let [xx, _, yy, height, _] = self.present[0];
        STANDARD_GRAVITY * libm::sqrt(height.max(0.0) * (xx + yy).max(0.0))
    }

    /// Variance that is to be expected of heights, or of sideways displacements if that is more, of waves shorter than a length (m).
    pub fn variance_below(&self, wavelength: f64) -> f64 {
        let above = |level: usize| {
            let (all, present) = (&self.present[0], &self.present[level]);
            (all[3] - present[3]).max(all[4] - present[4]).max(0.0)
        };
        let ratio = wavelength * self.tile.highest / TAU;
        if ratio.is_nan() || ratio <= 1.0 {
            return 0.0;
        }
        let last = self.present.len() - 1;
        let level = (libm::log2(ratio) as usize).min(last);
        let share = ratio / (1_u64 << level) as f64 - 1.0;
        if level == last { above(last) } else { above(level) + (above(level + 1) - above(level)) * share }
    }
}
