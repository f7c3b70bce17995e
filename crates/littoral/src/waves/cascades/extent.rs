//! How far a tile goes: bounds of the patches between its samples, and of its waves below a length.
//!
//! A bicubic patch lies within the hull of its sixteen Bézier points, and its derivatives within those of the differences of neighbouring
//! ones: for a side h, values and slopes at the ends make the points f₀, f₀ + h x₀/3, f₁ − h x₁/3, f₁, and the mixed derivatives are 0.

use super::super::fft::steps::{field, motion_stride};
use super::super::model::Bounds;
use super::patch::Patch;
use std::f64::consts::TAU;

/// Greatest magnitudes of a field of a patch and of its derivatives: value, ∂x, ∂y, ∂xx, ∂xy, ∂yy.
#[derive(Clone, Copy, Default)]
struct Extents([f32; 6]);

/// Bézier points of a patch, by row.
#[inline(always)]
fn bezier(corners: &[[f32; 3]; 4], side: f32) -> [[f32; 4]; 4] {
    let third = side / 3.0;
    let line = |a: &[f32; 3], b: &[f32; 3], up: f32| {
        let (a0, b0) = (a[0] + up * a[2], b[0] + up * b[2]);
        [a0, a0 + third * a[1], b0 - third * b[1], b0]
    };
    let [a, b, c, d] = corners;
    [line(a, b, 0.0), line(a, b, third), line(c, d, -third), line(c, d, 0.0)]
}

impl Extents {
    #[inline(always)]
    fn grow(&mut self, corners: &[[f32; 3]; 4], side: f32) {
        let p = bezier(corners, side);
        let m = &mut self.0;
        for j in 0..4 {
            for i in 0..4 {
                m[0] = m[0].max(p[j][i].abs());
            }
            for i in 0..3 {
                m[1] = m[1].max((p[j][i + 1] - p[j][i]).abs());
                m[2] = m[2].max((p[i + 1][j] - p[i][j]).abs());
            }
            for i in 0..2 {
                m[3] = m[3].max((p[j][i + 2] - 2.0 * p[j][i + 1] + p[j][i]).abs());
                m[5] = m[5].max((p[i + 2][j] - 2.0 * p[i + 1][j] + p[i][j]).abs());
            }
        }
        for j in 0..3 {
            for i in 0..3 {
                m[4] = m[4].max((p[j + 1][i + 1] - p[j + 1][i] - p[j][i + 1] + p[j][i]).abs());
            }
        }
    }

    fn scaled(self, side: f32) -> [f32; 6] {
        let [value, x, y, xx, xy, yy] = self.0;
        let (first, second) = (3.0 / side, 1.0 / (side * side));
        [value, x * first, y * first, 6.0 * xx * second, 9.0 * xy * second, 6.0 * yy * second]
    }
}

/// More than rounding can add.
const SLACK: f32 = 1.000_01;

/// Greatest spectral norm of a symmetric matrix whose entries have these magnitudes.
fn norm(xx: f32, xy: f32, yy: f32) -> f32 {
    let mean = 0.5 * (xx + yy);
    mean + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt()
}

impl Patch {
    /// How far its motion goes at this instant.
    pub fn bounds(&self) -> Bounds {
        use field::{X, XX, XY, Y, YY, Z, ZX, ZY};
        let n = self.tile.samples;
        let (samples, stride) = (self.level(0), 16 * motion_stride(n));
        let side = (self.tile.length / n as f64) as f32;
        let mut all = Bounds::default();
        for j in 0..n {
            // One row of patches at a time, so that the greatest slope is that of one place, nearly.
            let (low, high) = (&samples[j * stride..][..stride], &samples[((j + 1) & (n - 1)) * stride..][..stride]);
            for i in 0..n {
                let (low, high) = (&low[8 * i..8 * i + 16], &high[8 * i..8 * i + 16]);
                let corners = |f: usize, x: usize, y: usize| {
                    [
                        [low[f], low[x], low[y]],
                        [low[8 + f], low[8 + x], low[8 + y]],
                        [high[f], high[x], high[y]],
                        [high[8 + f], high[8 + x], high[8 + y]],
                    ]
                };
                let mut extents = [Extents::default(); 3];
                extents[0].grow(&corners(Z, ZX, ZY), side);
                extents[1].grow(&corners(X, XX, XY), side);
                extents[2].grow(&corners(Y, XY, YY), side);
                let [z, x, y] = extents.map(|e| e.scaled(side));
                all.height = all.height.max(z[0]);
                all.sideways = all.sideways.max((x[0] * x[0] + y[0] * y[0]).sqrt());
                all.slope = all.slope.max((z[1] * z[1] + z[2] * z[2]).sqrt());
                all.stretch = all.stretch.max(norm(x[1], 0.5 * (x[2] + y[1]), y[2]));
                all.curvature = all.curvature.max(norm(z[3], z[4], z[5]));
            }
        }
        Bounds {
            height: all.height * SLACK,
            sideways: all.sideways * SLACK,
            slope: all.slope * SLACK,
            stretch: all.stretch * SLACK,
            curvature: all.curvature * SLACK,
        }
    }

    /// Variance that is to be expected of heights, or of sideways displacements if that is more, of waves shorter than a length (m).
    pub fn variance_below(&self, wavelength: f64) -> f64 {
        let above = |level: usize| {
            let (all, present) = (&self.present[0], &self.present[level]);
            (all[3] - present[3]).max(all[4] - present[4]).max(0.0)
        };
        let ratio = wavelength * self.tile.highest / TAU;
        // Also false for NaN.
        if !(ratio > 1.0) {
            return 0.0;
        }
        let last = self.present.len() - 1;
        let level = (libm::log2(ratio) as usize).min(last);
        let share = ratio / (1_u64 << level) as f64 - 1.0;
        if level == last { above(last) } else { above(level) + (above(level + 1) - above(level)) * share }
    }
}
