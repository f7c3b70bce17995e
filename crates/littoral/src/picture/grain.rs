//! Noise for what is finer than the samples: relief, patches of plants, ripples.
//!
//! Gradient noise in three dimensions (K. Perlin, "Improving noise", SIGGRAPH 2002), so that nothing stretches on cliffs,
//! with its exact gradient. Positions are `f64` so that noise is as fine far from the origin as near it; what is left
//! after the integer lattice point is `f32`. Each octave fades out before it becomes finer than a pixel.

use glam::{DVec3, Vec3};

/// A value, in [−1, 1] and about 0.27 in the mean, and its gradient.
#[derive(Clone, Copy, Debug, Default)]
pub struct Grain {
    /// The value.
    pub value: f32,
    /// Its gradient, per unit of the noise's own coordinates.
    pub gradient: Vec3,
}

/// The corners of the lattice cell about a place: where in the cell it is, the gradients, and what each says there.
#[inline(always)]
fn corners(at: DVec3, seed: u32) -> (Vec3, [Vec3; 8], [f32; 8]) {
    let floor = |v: f64| {
        let i = v as i64;
        i - i64::from((i as f64) > v)
    };
    let (i, j, k) = (floor(at.x), floor(at.y), floor(at.z));
    let f = Vec3::new((at.x - i as f64) as f32, (at.y - j as f64) as f32, (at.z - k as f64) as f32);
    let (i, j, k) = (i as u32, j as u32, k as u32);
    let mut g = [Vec3::ZERO; 8];
    let mut d = [0.0f32; 8];
    for c in 0..8u32 {
        let (x, y, z) = (c & 1, c >> 1 & 1, c >> 2);
        let h = hash(i.wrapping_add(x), j.wrapping_add(y), k.wrapping_add(z), seed);
        g[c as usize] = GRADIENTS[(h >> 28) as usize];
        d[c as usize] = g[c as usize].dot(f - Vec3::new(x as f32, y as f32, z as f32));
    }
    (f, g, d)
}

/// The blend between corners: 0 to 1 with no slope and no curvature at either end.
#[inline(always)]
fn fade(f: Vec3) -> Vec3 {
    f * f * f * (f * (f * 6.0 - 15.0) + 10.0)
}

#[inline(always)]
fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// The value of [`grain`], to the bit, at half the cost.
fn value(at: DVec3, seed: u32) -> f32 {
    let (f, _, d) = corners(at, seed);
    let u = fade(f);
    let x = [mix(d[0], d[1], u.x), mix(d[2], d[3], u.x), mix(d[4], d[5], u.x), mix(d[6], d[7], u.x)];
    mix(mix(x[0], x[1], u.y), mix(x[2], x[3], u.y), u.z)
}

/// Gradient noise of unit wavelength.
pub fn grain(at: DVec3, seed: u32) -> Grain {
    let (f, g, d) = corners(at, seed);
    let u = fade(f);
    let du = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    let mix3 = |a: Vec3, b: Vec3, t: f32| a + (b - a) * t;
    let x = [mix(d[0], d[1], u.x), mix(d[2], d[3], u.x), mix(d[4], d[5], u.x), mix(d[6], d[7], u.x)];
    let y = [mix(x[0], x[1], u.y), mix(x[2], x[3], u.y)];
    let gx = [mix3(g[0], g[1], u.x), mix3(g[2], g[3], u.x), mix3(g[4], g[5], u.x), mix3(g[6], g[7], u.x)];
    let gy = [mix3(gx[0], gx[1], u.y), mix3(gx[2], gx[3], u.y)];
    let along_x = mix(mix(d[1] - d[0], d[3] - d[2], u.y), mix(d[5] - d[4], d[7] - d[6], u.y), u.z);
    let along_y = mix(x[1] - x[0], x[3] - x[2], u.z);
    Grain {
        value: mix(y[0], y[1], u.z),
        gradient: mix3(gy[0], gy[1], u.z) + du * Vec3::new(along_x, along_y, y[1] - y[0]),
    }
}

/// The value of noise of a wavelength (m), fading out where it is finer than `footprint` (m).
pub fn patch(at: DVec3, wavelength: f32, footprint: f32, seed: u32) -> f32 {
    let share = resolved(wavelength, footprint);
    if share == 0.0 { 0.0 } else { value(at / f64::from(wavelength), seed) * share }
}

/// How much of a wave of this length a pixel of this footprint can show, in [0, 1].
#[inline]
pub fn resolved(wavelength: f32, footprint: f32) -> f32 {
    let t = ((wavelength / footprint - 2.0) * 0.5).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Twelve edge directions of a cube and four of them again.
const GRADIENTS: [Vec3; 16] = [
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(-1.0, 1.0, 0.0),
    Vec3::new(1.0, -1.0, 0.0),
    Vec3::new(-1.0, -1.0, 0.0),
    Vec3::new(1.0, 0.0, 1.0),
    Vec3::new(-1.0, 0.0, 1.0),
    Vec3::new(1.0, 0.0, -1.0),
    Vec3::new(-1.0, 0.0, -1.0),
    Vec3::new(0.0, 1.0, 1.0),
    Vec3::new(0.0, -1.0, 1.0),
    Vec3::new(0.0, 1.0, -1.0),
    Vec3::new(0.0, -1.0, -1.0),
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(-1.0, 1.0, 0.0),
    Vec3::new(0.0, -1.0, 1.0),
    Vec3::new(0.0, -1.0, -1.0),
];

/// A well mixed number for a lattice point.
#[inline]
pub fn hash(x: u32, y: u32, z: u32, seed: u32) -> u32 {
    let mut h = x.wrapping_mul(0x8DA6_B343) ^ y.wrapping_mul(0xD816_3841) ^ z.wrapping_mul(0xCB1A_B31F);
    h ^= seed.wrapping_mul(0x9E37_79B9);
    h = (h ^ (h >> 16)).wrapping_mul(0x7FEB_352D);
    h = (h ^ (h >> 15)).wrapping_mul(0x846C_A68B);
    h ^ (h >> 16)
}

/// A smooth step from 0 at `from` to 1 at `to`.
#[inline]
pub fn step(from: f32, to: f32, at: f32) -> f32 {
    let t = ((at - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_match_differences_and_values_stay_within_one() {
        let (mut most, mut squares) = (0.0f32, 0.0f32);
        for i in 0..20_000 {
            let t = f64::from(i);
            let at = DVec3::new(t * 0.754_877 - 7e3, t * 0.569_840, 13.0 - t * 0.3141);
            let here = grain(at, 3);
            let difference = |by: DVec3| (grain(at + by, 3).value - grain(at - by, 3).value) / 2e-2;
            let expected =
                Vec3::new(difference(DVec3::X * 1e-2), difference(DVec3::Y * 1e-2), difference(DVec3::Z * 1e-2));
            assert_eq!(value(at, 3), here.value);
            assert!((here.gradient - expected).length() < 0.02, "{} for {expected}", here.gradient);
            most = most.max(here.value.abs());
            squares += here.value * here.value;
        }
        assert!(most <= 1.05);
        assert!((0.2..0.35).contains(&(squares / 20_000.0).sqrt()));
    }

    #[test]
    fn far_from_the_origin_noise_is_as_fine() {
        let near = grain(DVec3::new(0.25, 0.5, 0.75), 1);
        assert!(near.value.is_finite());
        let far = DVec3::new(4.0e9, -3.0e9, 12.0);
        assert_ne!(grain(far + DVec3::X * 0.25, 1).value, grain(far + DVec3::X * 0.26, 1).value);
    }
}
