//! Motion at arbitrary points: bicubic Hermite patches through the samples.
//!
//! Each sample holds heights, displacements and their first derivatives, which make a surface with continuous slopes between four samples (the
//! mixed derivatives at the corners are taken as 0: J. Ferguson, "Multivariable curve interpolation", 1964). Slopes and stretches are the exact derivatives
//! of that surface. With s samples to a wave it errs by at most (2π/s)⁴/384 + 0.0047 (2π/s)² of the wave's height: 2.8 % for four samples,
//! 0.4 % for eight, 0.08 % for sixteen; its slopes by 0.008 (2π/s)³ + 0.05 (2π/s).
//!
//! The eight numbers of a sample and those of its neighbour in x are 64 bytes in a row, so that a query reads two rows; those of 16
//! points are turned by two transpositions into fields by lanes.

use super::super::fft::kernel::transpose;
use super::super::fft::steps::{field, motion_stride};
use super::super::fft::{LANES, Lane};
use super::super::model::{BLOCK, Motion, Points};
use super::foam::{Foam, upon};
use super::patch::Patch;
use multiversion::multiversion;

/// Where points lie within a tile, as parts of its sides, in [0, 1).
pub(super) struct Place {
    pub x: [f64; BLOCK],
    pub y: [f64; BLOCK],
}

/// The part of a number above the whole one below it, in [0, 1); 0 for what is no number or above 2⁵¹.
#[inline(always)]
fn part(t: f64) -> f64 {
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    let off = t - ((t + ROUNDER) - ROUNDER);
    let part = if off < 0.0 { off + 1.0 } else { off };
    // Also false for NaN.
    if (0.0..1.0).contains(&part) { part } else { 0.0 }
}

/// Finds points in a tile.
#[inline(always)]
pub(super) fn place(patch: &Patch, points: &Points) -> Place {
    let mut place = Place { x: [0.0; BLOCK], y: [0.0; BLOCK] };
    let (cosine, sine) = patch.turn;
    let scale = 1.0 / patch.tile.length;
    for l in 0..LANES {
        let (x, y) = (points.x[l], points.y[l]);
        place.x[l] = part((x * cosine + y * sine) * scale);
        place.y[l] = part((y * cosine - x * sine) * scale);
    }
    place
}

/// Levels of detail asked for at some points.
struct Levels {
    /// The finer of the two that are mixed.
    finer: [u32; BLOCK],
    /// The share of the coarser one.
    share: Lane,
    /// Whether everything is asked for at all points.
    all: bool,
}

/// From which level the waves come that are at least twice a footprint long. Levels count halvings of the highest wave number; between two
/// of them the mixture goes by straight lines over the footprint.
#[inline(always)]
fn levels(patch: &Patch, points: &Points) -> Levels {
    let scale = (patch.tile.highest / std::f64::consts::PI) as f32;
    let mut levels = Levels { finer: [0; BLOCK], share: [0.0; BLOCK], all: true };
    let mut wide = 0;
    for footprint in points.footprint {
        wide += u32::from(footprint * scale > 1.0);
    }
    if wide == 0 {
        return levels;
    }
    for l in 0..LANES {
        let ratio = points.footprint[l] * scale;
        // Also 1 for NaN.
        let ratio = if ratio > 1.0 { ratio.min(1e9) } else { 1.0 };
        levels.all &= ratio == 1.0;
        // Exponent and fraction: a logarithm to base 2 with straight pieces.
        let bits = ratio.to_bits();
        levels.finer[l] = (bits >> 23) - 127;
        levels.share[l] = f32::from_bits((bits & 0x007F_FFFF) | 0x3F80_0000) - 1.0;
    }
    levels
}

/// The samples at the corners of the patches in which points lie: those of the lower row, then those of the upper row; eight fields of the left
/// one, then of the right one.
pub(super) struct Corners {
    pub low: [Lane; 16],
    pub high: [Lane; 16],
    /// Where in the patch, from 0 to 1.
    pub u: Lane,
    pub v: Lane,
    /// Length of the patch's sides (m).
    pub side: Lane,
}

impl Corners {
    #[inline(always)]
    pub fn zero() -> Corners {
        let none = [[0.0; LANES]; 16];
        Corners { low: none, high: none, u: [0.0; LANES], v: [0.0; LANES], side: [1.0; LANES] }
    }
}

/// Where points lie among the samples of the finest level.
struct Cells {
    place: Place,
    /// Where the pairs of samples begin.
    low: [u32; LANES],
    high: [u32; LANES],
    u: Lane,
    v: Lane,
}

/// Finds points among the samples of the finest level, and calls for those.
#[inline(always)]
fn locate(patch: &Patch, points: &Points) -> Cells {
    let place = place(patch, points);
    let n = patch.tile.samples;
    let size = n as f64;
    let (last, stride) = (n as u32 - 1, 16 * motion_stride(n) as u32);
    let (mut low, mut high) = ([0u32; LANES], [0u32; LANES]);
    let (mut u, mut v) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let (x, y) = (place.x[l] * size, place.y[l] * size);
        let (i, j) = (x as i32, y as i32);
        u[l] = (x - f64::from(i)) as f32;
        v[l] = (y - f64::from(j)) as f32;
        // A part can round up to the whole side.
        let (i, j) = (i as u32 & last, j as u32 & last);
        low[l] = j * stride + 8 * i;
        high[l] = ((j + 1) & last) * stride + 8 * i;
    }
    let samples = patch.level(0);
    for l in 0..LANES {
        prefetch(samples, low[l]);
        prefetch(samples, high[l]);
    }
    Cells { place, low, high, u, v }
}

/// Calls for sixteen numbers, which may lie in two lines of the cache.
#[inline(always)]
fn prefetch(samples: &[f32], at: u32) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let start = samples.as_ptr().wrapping_add(at as usize);
        // SAFETY: fetching ahead reads nothing, wherever it points.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(start.cast());
            _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(15).cast());
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (samples, at);
}

/// Corners in the finest level.
#[inline(always)]
fn finest(patch: &Patch, cells: &Cells, corners: &mut Corners) {
    let samples = patch.level(0);
    for l in 0..LANES {
        let (low, high) = (cells.low[l] as usize, cells.high[l] as usize);
        corners.low[l].copy_from_slice(&samples[low..low + 16]);
        corners.high[l].copy_from_slice(&samples[high..high + 16]);
    }
    (corners.u, corners.v) = (cells.u, cells.v);
    corners.side = [(patch.tile.length / patch.tile.samples as f64) as f32; LANES];
    transpose(&mut corners.low);
    transpose(&mut corners.high);
}

/// Corners in a level of each point's own; zeros where there is none. `weights` become 0 there.
#[inline(always)]
fn leveled(patch: &Patch, place: &Place, levels: &[u32; BLOCK], weights: &mut Lane, corners: &mut Corners) {
    for l in 0..LANES {
        let level = levels[l] as usize;
        if level >= patch.grids.len() || weights[l] == 0.0 {
            weights[l] = 0.0;
            corners.low[l] = [0.0; 16];
            corners.high[l] = [0.0; 16];
            continue;
        }
        let samples = patch.level(level);
        let n = patch.grids[level].samples();
        let stride = 16 * motion_stride(n);
        let (x, y) = (place.x[l] * n as f64, place.y[l] * n as f64);
        let (i, j) = (x as usize, y as usize);
        corners.u[l] = (x - i as f64) as f32;
        corners.v[l] = (y - j as f64) as f32;
        let (i, j) = (i & (n - 1), j & (n - 1));
        let (low, high) = (j * stride + 8 * i, ((j + 1) & (n - 1)) * stride + 8 * i);
        corners.low[l].copy_from_slice(&samples[low..low + 16]);
        corners.high[l].copy_from_slice(&samples[high..high + 16]);
        corners.side[l] = (patch.tile.length / n as f64) as f32;
    }
    transpose(&mut corners.low);
    transpose(&mut corners.high);
}

/// Cubic Hermite weights of two values and two slopes over a side.
#[inline(always)]
fn values(t: f32, side: f32) -> [f32; 4] {
    let s = 1.0 - t;
    let rise = t * t * (3.0 - 2.0 * t);
    [1.0 - rise, rise, t * s * s * side, -(t * t * s * side)]
}

/// Derivatives of those weights.
#[inline(always)]
fn rises(t: f32, side: f32) -> [f32; 4] {
    let s = 1.0 - t;
    let rise = 6.0 * t * s / side;
    [-rise, rise, s * (1.0 - 3.0 * t), t * (3.0 * t - 2.0)]
}

/// Σ of weights a (in x) and b (in y) over a value and its two derivatives at four corners.
#[inline(always)]
fn patched(c: [[f32; 3]; 4], a: [f32; 4], b: [f32; 4]) -> f32 {
    let [[f0, x0, y0], [f1, x1, y1], [f2, x2, y2], [f3, x3, y3]] = c;
    let low = x1.mul_add(a[3], x0.mul_add(a[2], f1.mul_add(a[1], f0 * a[0])));
    let high = x3.mul_add(a[3], x2.mul_add(a[2], f3.mul_add(a[1], f2 * a[0])));
    let low_rise = y1.mul_add(a[1], y0 * a[0]);
    let high_rise = y3.mul_add(a[1], y2 * a[0]);
    high_rise.mul_add(b[3], low_rise.mul_add(b[2], high.mul_add(b[1], low * b[0])))
}

/// A field and its derivatives at the corners, for one lane.
#[inline(always)]
pub(super) fn at_corners(c: &Corners, l: usize, f: usize, x: usize, y: usize) -> [[f32; 3]; 4] {
    [
        [c.low[f][l], c.low[x][l], c.low[y][l]],
        [c.low[8 + f][l], c.low[8 + x][l], c.low[8 + y][l]],
        [c.high[f][l], c.high[x][l], c.high[y][l]],
        [c.high[8 + f][l], c.high[8 + x][l], c.high[8 + y][l]],
    ]
}

/// Adds displacements in the world's axes.
#[inline(always)]
fn displace(c: &Corners, turn: (f32, f32), weights: &Lane, motion: &mut Motion) {
    use field::{X, XX, XY, Y, YY, Z, ZX, ZY};
    let (cosine, sine) = turn;
    for l in 0..LANES {
        let (a, b) = (values(c.u[l], c.side[l]), values(c.v[l], c.side[l]));
        let z = patched(at_corners(c, l, Z, ZX, ZY), a, b);
        let x = patched(at_corners(c, l, X, XX, XY), a, b);
        let y = patched(at_corners(c, l, Y, XY, YY), a, b);
        let weight = weights[l];
        motion.dz[l] = weight.mul_add(z, motion.dz[l]);
        motion.dx[l] = weight.mul_add(x * cosine - y * sine, motion.dx[l]);
        motion.dy[l] = weight.mul_add(x * sine + y * cosine, motion.dy[l]);
    }
}

/// Adds slopes and stretches in the world's axes.
#[inline(always)]
fn incline(c: &Corners, turn: (f32, f32), weights: &Lane, motion: &mut Motion) {
    use field::{X, XX, XY, Y, YY, Z, ZX, ZY};
    let (cosine, sine) = turn;
    for l in 0..LANES {
        let (a, b) = (values(c.u[l], c.side[l]), values(c.v[l], c.side[l]));
        let (da, db) = (rises(c.u[l], c.side[l]), rises(c.v[l], c.side[l]));
        let weight = weights[l];
        let corners = at_corners(c, l, Z, ZX, ZY);
        let (x, y) = (patched(corners, da, b), patched(corners, a, db));
        motion.slope_x[l] = weight.mul_add(x * cosine - y * sine, motion.slope_x[l]);
        motion.slope_y[l] = weight.mul_add(x * sine + y * cosine, motion.slope_y[l]);
        let (of_x, of_y) = (at_corners(c, l, X, XX, XY), at_corners(c, l, Y, XY, YY));
        let (xx, yy) = (patched(of_x, da, b), patched(of_y, a, db));
        // The patches of the two parts have derivatives across that differ by the error of interpolation.
        let xy = 0.5 * (patched(of_x, a, db) + patched(of_y, da, b));
        let (cc, cs, ss) = (cosine * cosine, cosine * sine, sine * sine);
        let turned_xx = cc * xx - 2.0 * cs * xy + ss * yy;
        let turned_xy = cs * (xx - yy) + (cc - ss) * xy;
        let turned_yy = ss * xx + 2.0 * cs * xy + cc * yy;
        motion.dxx[l] = weight.mul_add(turned_xx, motion.dxx[l]);
        motion.dxy[l] = weight.mul_add(turned_xy, motion.dxy[l]);
        motion.dyy[l] = weight.mul_add(turned_yy, motion.dyy[l]);
    }
}

/// Adds the motion of all tiles; displacements only unless `whole`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn add(patches: &[Patch], points: &Points, whole: bool, motion: &mut Motion) {
    add_body(patches, points, whole, motion);
}

#[inline(always)]
pub(super) fn add_body(patches: &[Patch], points: &Points, whole: bool, motion: &mut Motion) {
    let Some(first) = patches.first() else { return };
    // Samples of the next tile are on their way while those of this one are summed.
    let mut next = locate(first, points);
    let mut corners = Corners::zero();
    let before = motion.dz;
    let mut variance = 0.0;
    for (index, patch) in patches.iter().enumerate() {
        let cells = next;
        next = locate(&patches[(index + 1).min(patches.len() - 1)], points);
        let levels = levels(patch, points);
        let turn = (patch.turn.0 as f32, patch.turn.1 as f32);
        if let (Some(foam), true) = (&patch.foam, whole) {
            // What has been summed so far are the longer waves.
            let scale = if variance > 0.0 { 1.0 / libm::sqrt(variance) as f32 } else { 0.0 };
            for l in 0..LANES {
                let width = f64::from(points.footprint[l]) * patch.tile.samples as f64 / patch.tile.length;
                let covered = foam_at(foam, patch.tile.samples, cells.place.x[l], cells.place.y[l], width as f32);
                let covered = (covered * upon((motion.dz[l] - before[l]) * scale)).min(1.0);
                motion.foam[l] += covered - motion.foam[l] * covered;
            }
        }
        variance += patch.present[0][3];
        if levels.all {
            finest(patch, &cells, &mut corners);
            let weights = [1.0; LANES];
            displace(&corners, turn, &weights, motion);
            if whole {
                incline(&corners, turn, &weights, motion);
            }
        } else {
            for step in 0..2 {
                let (mut of, mut weights) = (levels.finer, levels.share);
                for l in 0..LANES {
                    of[l] += step;
                    weights[l] = if step == 0 { 1.0 - weights[l] } else { weights[l] };
                }
                leveled(patch, &cells.place, &of, &mut weights, &mut corners);
                displace(&corners, turn, &weights, motion);
                if whole {
                    incline(&corners, turn, &weights, motion);
                }
            }
            if whole {
                hide(patch, &levels, motion);
            }
        }
    }
}

/// Adds the slopes of the waves that were left out.
#[inline(always)]
fn hide(patch: &Patch, levels: &Levels, motion: &mut Motion) {
    let last = patch.present.len() - 1;
    let all = patch.present[0];
    for l in 0..LANES {
        let finer = (levels.finer[l] as usize).min(last);
        let (of_finer, of_coarser) = (patch.present[finer], patch.present[(finer + 1).min(last)]);
        // Waves between the two levels keep 1 − share of their height.
        let kept = f64::from((1.0 - levels.share[l]) * (1.0 - levels.share[l]));
        let hidden: [f32; 3] =
            std::array::from_fn(|i| (all[i] - of_finer[i] + (1.0 - kept) * (of_finer[i] - of_coarser[i])) as f32);
        motion.hidden_xx[l] += hidden[0].max(0.0);
        motion.hidden_xy[l] += hidden[1];
        motion.hidden_yy[l] += hidden[2].max(0.0);
    }
}

/// Foam at a place, on the mean over `width` samples.
fn foam_at(foam: &Foam, samples: usize, x: f64, y: f64, width: f32) -> f32 {
    if width.is_nan() || width <= 1.0 {
        return between(samples, x, y, 0.0, |i, j| foam.at(i, j));
    }
    let bits = width.min(1e9).to_bits();
    let level = (bits >> 23) as usize - 127;
    let share = f32::from_bits((bits & 0x007F_FFFF) | 0x3F80_0000) - 1.0;
    let means = foam.means();
    let at = |level: usize| {
        let level = level.min(foam.levels());
        if level == 0 {
            return between(samples, x, y, 0.0, |i, j| foam.at(i, j));
        }
        let size = samples >> level;
        // n²/4 (1 + 1/4 + …) numbers come before a level.
        let start = (samples * samples - 4 * size * size) / 3;
        // A mean stands in the middle of its samples.
        let back = 0.5 - 0.5 * size as f64 / samples as f64;
        between(size, x, y, back, |i, j| means[start + j * size + i])
    };
    let (finer, coarser) = (at(level), at(level + 1));
    finer + (coarser - finer) * share
}

/// Bilinear interpolation between samples that stand `1 / size` apart, the first of them `forward` of these from the origin.
#[inline(always)]
fn between(size: usize, x: f64, y: f64, forward: f64, at: impl Fn(usize, usize) -> f32) -> f32 {
    let off = size as f64 - forward;
    let (x, y) = (x * size as f64 + off, y * size as f64 + off);
    let (i, j) = (x as usize, y as usize);
    let (u, v) = ((x - i as f64) as f32, (y - j as f64) as f32);
    let (i, j) = (i & (size - 1), j & (size - 1));
    let (right, up) = ((i + 1) & (size - 1), (j + 1) & (size - 1));
    let low = at(i, j) + (at(right, j) - at(i, j)) * u;
    let high = at(i, up) + (at(right, up) - at(i, up)) * u;
    low + (high - low) * v
}
