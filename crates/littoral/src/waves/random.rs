//! Random numbers by counting: the number of a (seed, place) is the same however many others are drawn, in whatever order, on any
//! platform.
//!
//! The mixing is D. Stafford's thirteenth variant of the murmur finaliser, as in G. Steele, D. Lea, C. Flood's SplitMix64 (2014).

use libm::{cos, log, sin, sqrt};
use std::f64::consts::TAU;

/// 64 mixed bits for a seed and three integers.
pub fn bits(seed: u64, a: i64, b: i64, c: i64) -> u64 {
    let mut state = mix(seed);
    for n in [a, b, c] {
        state = mix(state.wrapping_add(0x9E37_79B9_7F4A_7C15).wrapping_add(n as u64));
    }
    state
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A number in [0, 1).
pub fn uniform(seed: u64, a: i64, b: i64, c: i64) -> f64 {
    (bits(seed, a, b, c) >> 11) as f64 * f64::exp2(-53.0)
}

/// Two independent numbers of the normal distribution (G. Box and M. Muller 1958).
pub fn normal_pair(seed: u64, a: i64, b: i64, c: i64) -> (f64, f64) {
    let first = bits(seed, a, b, c);
    // Above 0, so that the logarithm is finite.
    let u = ((first >> 11) + 1) as f64 * f64::exp2(-53.0);
    let v = (mix(first ^ 0xD1B5_4A32_D192_ED03) >> 11) as f64 * f64::exp2(-53.0);
    let radius = sqrt(-2.0 * log(u));
    (radius * cos(TAU * v), radius * sin(TAU * v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_are_normal() {
        let n = 40_000;
        let pairs: Vec<(f64, f64)> = (0..n).map(|i| normal_pair(5, i % 200, i / 200, 0)).collect();
        let mean = |y: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(y).sum::<f64>() / n as f64;
        assert!(mean(&|p| p.0).abs() < 0.02 && mean(&|p| p.1).abs() < 0.02);
        assert!((mean(&|p| p.0 * p.0) - 1.0).abs() < 0.03 && (mean(&|p| p.1 * p.1) - 1.0).abs() < 0.03);
        assert!(mean(&|p| p.0 * p.1).abs() < 0.02, "the two are independent");
        assert!((mean(&|p| p.0.powi(4)) - 3.0).abs() < 0.2);
    }

    #[test]
    fn numbers_depend_on_every_argument() {
        let all = [bits(1, 2, 3, 4), bits(2, 2, 3, 4), bits(1, 3, 3, 4), bits(1, 2, 4, 4), bits(1, 2, 3, 5)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b));
        }
        assert_eq!(bits(1, 2, 3, 4), bits(1, 2, 3, 4));
        let mean = (0..10_000).map(|i| uniform(9, i, 0, 0)).sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.01);
    }
}
