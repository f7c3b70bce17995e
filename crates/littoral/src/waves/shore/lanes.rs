//! Sixteen numbers at a time, and elementary functions of them whose bits are the same on every processor.
//!
//! Plain arrays and plain loops: compiled for wide registers where there are some, and giving the same bits where there are none, for
//! every operation is one that IEEE 754 defines exactly.

use super::super::sum::circle;

/// How many.
pub(super) const LANES: usize = 16;

/// Sixteen numbers, placed as vector registers like them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Lanes(pub [f32; LANES]);

impl Lanes {
    pub(super) const ZERO: Lanes = Lanes([0.0; LANES]);
    pub(super) const ONE: Lanes = Lanes([1.0; LANES]);
}

/// Complex numbers, sixteen at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Complex {
    pub(super) re: [f32; LANES],
    pub(super) im: [f32; LANES],
}

impl Complex {
    pub(super) const ZERO: Complex = Complex { re: [0.0; LANES], im: [0.0; LANES] };
    pub(super) const ONE: Complex = Complex { re: [1.0; LANES], im: [0.0; LANES] };
}

/// Adding and subtracting this rounds to whole numbers (ties to even) as long as they are below 2²².
const ROUNDER: f32 = 12_582_912.0;

/// The nearest whole number, for magnitudes below 2²².
#[inline(always)]
pub(super) fn nearest(x: f32) -> f32 {
    (x + ROUNDER) - ROUNDER
}

/// One over a number from 10⁻³⁰ to 10³⁰, to a relative error of 2·10⁻⁷: the exponent's sign turned round is a guess to 5 %, which a step of
/// Newton's and one of E. Halley's method better. Sixteen such cost a third of what as many divisions do.
#[inline(always)]
pub(super) fn inverse(x: f32) -> f32 {
    let guess = f32::from_bits(0x7EF1_27EA_u32.wrapping_sub(x.to_bits()));
    let off = (-x).mul_add(guess, 1.0);
    let better = off.mul_add(guess, guess);
    let off = (-x).mul_add(better, 1.0);
    off.mul_add(off, off).mul_add(better, better)
}

/// Sine and cosine of an angle in turns, of magnitude below 10⁶; to 7·10⁻⁷.
#[inline(always)]
pub(super) fn sine_cosine(turns: f32) -> (f32, f32) {
    let (cosine, sine) = circle(turns);
    (sine, cosine)
}

/// Angle of a complex number in turns, within [−½, ½]; to 10⁻⁷. 0 for 0. The arc tangent is M. Abramowitz and I. Stegun's formula 4.4.49.
#[inline(always)]
pub(super) fn angle(re: f32, im: f32) -> f32 {
    let (a, b) = (re.abs(), im.abs());
    let high = a.max(b);
    let low = a.min(b);
    let t = low / high.max(1e-30);
    let y = t * t;
    let p = y.mul_add(0.002_866_225_7, -0.016_165_737);
    let p = y.mul_add(p, 0.042_909_615);
    let p = y.mul_add(p, -0.075_289_64);
    let p = y.mul_add(p, 0.106_562_64);
    let p = y.mul_add(p, -0.142_089);
    let p = y.mul_add(p, 0.199_935_51);
    let p = y.mul_add(p, -0.333_331_45);
    let first = t * y.mul_add(p, 1.0) * 0.159_154_94;
    let second = if b > a { 0.25 - first } else { first };
    let third = if re < 0.0 { 0.5 - second } else { second };
    if im < 0.0 { -third } else { third }
}

/// eˣ for x ≤ 0, to a relative error of 3·10⁻⁷; 0 below −80.
#[inline(always)]
pub(super) fn decay(x: f32) -> f32 {
    let y = x.max(-80.0) * std::f32::consts::LOG2_E;
    let n = nearest(y);
    let t = y - n;
    let p = t.mul_add(1.540_353e-4, 1.333_355_8e-3);
    let p = t.mul_add(p, 9.618_129e-3);
    let p = t.mul_add(p, 0.055_504_11);
    let p = t.mul_add(p, 0.240_226_5);
    let p = t.mul_add(p, std::f32::consts::LN_2);
    let p = t.mul_add(p, 1.0);
    let power = f32::from_bits(((n as i32 + 127) as u32) << 23);
    if x < -80.0 { 0.0 } else { p * power }
}

/// A smooth step from 0 at `from` to 1 at `to`.
#[inline(always)]
pub(super) fn smooth(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_as_exact_as_they_say() {
        for i in -4000..=4000 {
            let t = i as f32 * 7.3e-4;
            let (s, c) = sine_cosine(t);
            let exact = f64::from(t) * std::f64::consts::TAU;
            assert!((f64::from(s) - exact.sin()).abs() < 1.0e-6 && (f64::from(c) - exact.cos()).abs() < 1.0e-6, "{t}");
            let turns = angle(3.0 * c, 3.0 * s);
            assert!((turns - t - (turns - t).round()).abs() < 6e-7, "{t}: {turns}");
            let x = -(i + 4000) as f32 * 0.01;
            assert!((f64::from(decay(x)) / f64::from(x).exp() - 1.0).abs() < 4e-6, "{x}");
            let x = 10f32.powf(i as f32 / 134.0);
            assert!((f64::from(inverse(x)) * f64::from(x) - 1.0).abs() < 2e-7, "{x}");
        }
        assert_eq!(angle(0.0, 0.0), 0.0);
        assert_eq!(decay(-1e9), 0.0);
    }
}
