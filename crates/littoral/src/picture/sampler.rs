//! Well spread random numbers: the same for the same pixel, sample and purpose, in any order and on any thread.
//!
//! Pairs of Sobol's sequence, scrambled by Owen's method with a hash in place of a tree, and shuffled anew for each purpose
//! (B. Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020).

use super::grain::hash;
use glam::{UVec2, Vec2};

/// The random numbers of a picture: a few hundred patterns, each the numbers of one pixel for all its samples. Neighbours have different
/// ones, and which has which follows no order.
pub struct Patterns {
    samples: usize,
    seed: u32,
    sets: Vec<Sample>,
}

/// The random numbers of one sample.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Where in the pixel, from its middle (pixels).
    lens: Vec2,
    /// Where on the sun's disc, in the unit disc.
    disc: Vec2,
    /// How the water leans: two normal numbers.
    ripple: Vec2,
}

/// The random numbers of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Pattern<'a>(&'a [Sample]);

/// Spread of the reconstruction filter (pixels): a Gaussian about as sharp as a good lens.
const FILTER: f32 = 0.42;

impl Patterns {
    /// Patterns for so many samples a pixel.
    pub fn new(samples: u32, seed: u32) -> Patterns {
        let count = (16_384 / samples.max(1)).clamp(16, 256);
        let set = |i: u32| {
            let (sampler, index) = (Sampler::new(i / samples, 0, seed), i % samples);
            Sample {
                lens: (FILTER * sampler.normal(index, 0)).clamp(Vec2::splat(-1.4), Vec2::splat(1.4)),
                disc: sampler.disc(index, 1),
                ripple: sampler.normal(index, 2),
            }
        };
        Patterns { samples: samples as usize, seed, sets: (0..count * samples).map(set).collect() }
    }

    /// The pattern of a pixel.
    pub fn of(&self, pixel: UVec2) -> Pattern<'_> {
        let count = self.sets.len() / self.samples;
        let which = hash(pixel.x, pixel.y, self.seed, 0x51ED_270B) as usize % count;
        Pattern(&self.sets[which * self.samples..][..self.samples])
    }
}

impl Pattern<'_> {
    /// Where in the pixel a sample lies, from its middle (pixels).
    pub fn lens(self, sample: u32) -> Vec2 {
        self.0[sample as usize].lens
    }

    /// Where on the sun's disc, in the unit disc.
    pub fn disc(self, sample: u32) -> Vec2 {
        self.0[sample as usize].disc
    }

    /// Two independent numbers of a normal distribution.
    pub fn ripple(self, sample: u32) -> Vec2 {
        self.0[sample as usize].ripple
    }
}

/// A source of well spread random numbers.
#[derive(Clone, Copy, Debug)]
struct Sampler {
    seed: u32,
}

impl Sampler {
    /// The numbers of a pattern.
    fn new(x: u32, y: u32, seed: u32) -> Sampler {
        Sampler { seed: hash(x, y, seed, 0x51ED_270B) }
    }

    /// A point of the unit square: the `index`th for a purpose. Any 2ⁿ successive ones are well spread.
    fn pair(self, index: u32, purpose: u32) -> Vec2 {
        let seed = hash(self.seed, purpose, 0, 0x68BC_21EB);
        let index = scramble(index, seed);
        let x = scramble(index.reverse_bits(), hash(seed, 1, 0, 0));
        let y = scramble(second_sobol(index), hash(seed, 2, 0, 0));
        // The upper 24 bits are exact in f32 and stay below one.
        Vec2::new((x >> 8) as f32, (y >> 8) as f32) * (1.0 / (1u32 << 24) as f32)
    }

    /// Two independent numbers of a normal distribution.
    fn normal(self, index: u32, purpose: u32) -> Vec2 {
        let u = self.pair(index, purpose);
        let radius = (-2.0 * (1.0 - u.x).max(1e-7).ln()).sqrt();
        let (s, c) = (std::f32::consts::TAU * u.y).sin_cos();
        radius * Vec2::new(c, s)
    }

    /// A point of the unit disc.
    fn disc(self, index: u32, purpose: u32) -> Vec2 {
        let u = self.pair(index, purpose);
        let (s, c) = (std::f32::consts::TAU * u.y).sin_cos();
        u.x.sqrt() * Vec2::new(c, s)
    }
}

fn second_sobol(mut index: u32) -> u32 {
    let (mut sum, mut direction) = (0, 1u32 << 31);
    while index != 0 {
        if index & 1 == 1 {
            sum ^= direction;
        }
        index >>= 1;
        direction ^= direction >> 1;
    }
    sum
}

/// Owen's nested uniform scrambling, with Laine and Karras's hash.
fn scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits().wrapping_add(seed);
    for factor in [0x6C50_B47Cu32, 0xB82F_1E52, 0xC7AF_E638, 0x8D22_F6E6] {
        x ^= x.wrapping_mul(factor);
    }
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_points_fill_sixteen_cells_of_every_shape() {
        for purpose in 0..5 {
            let points: Vec<Vec2> = (0..16).map(|i| Sampler::new(7, 9, 3).pair(i, purpose)).collect();
            for columns in [1usize, 2, 4, 8, 16] {
                let rows = 16 / columns;
                let mut seen = [false; 16];
                for p in &points {
                    seen[(p.y * rows as f32) as usize * columns + (p.x * columns as f32) as usize] = true;
                }
                assert!(seen.iter().all(|s| *s), "{columns} × {rows}");
            }
        }
    }
}
