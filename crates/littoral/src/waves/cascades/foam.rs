//! Whitecaps: where waves have broken, and for how long that is seen.
//!
//! Water that sideways motion presses together too much (the Jacobian of the motion falls below a threshold) becomes foam at once, and foam
//! fades. It is reckoned at ticks counted from time 0 and shown in between by straight lines, and what is fainter than
//! a 512th is dropped: after enough ticks nothing is left of where it began, to the last bit, so that foam depends on the instant alone.
//!
//! The threshold makes the cover that of E. Monahan and I. O'Muircheartaigh, "Optimal power-law description of oceanic whitecap coverage
//! dependence on wind speed", J. Phys. Oceanography 10, 1980: W = 3.84·10⁻⁶ U^3.41.

use super::super::SeaState;
use super::super::fft::steps::{Foaming, LEAST_FOAM};
use super::super::fft::{LANES, Lane};
use super::clock::{Instant, Moment};
use super::patch::Lazy;
use super::plan::Tile;
use libm::{exp, log, log1p, pow, sqrt};
use std::f64::consts::TAU;

/// In which foam fades to 1/e (s); Monahan and others found 3 to 4 s in sea water.
const FADING: f64 = 3.0;
/// Longest waves (m) of the smallest tile that makes foam: shorter ones break without air.
const LEAST_BREAKER: f64 = 3.0;
/// Foam is full where the Jacobian is this many standard deviations below the threshold.
const FULL: f64 = 0.5;
/// Mean cover over the chance of a Jacobian below the threshold at an instant: foam outlives its breaker. Found by experiment with seas of 3
/// to 10 Beaufort.
const PERSISTENCE: f64 = 2.3;
/// The part of the cover that is made by the first tile with foam, if there are others.
pub(super) const FIRST_SHARE: f64 = 0.7;

/// The foam of a tile.
pub(super) struct Foam {
    /// At a tick and at the next; by blocks of 16 rows, then by x.
    before: Vec<Lane>,
    after: Vec<Lane>,
    /// At the instant.
    pub shown: Vec<Lane>,
    /// Means over ever larger squares, from 2 × 2 samples on.
    pub coarser: Lazy<f32>,
    samples: usize,
    /// The tick that `before` stands at.
    tick: Option<i64>,
    pub breaking: Breaking,
}

/// When a tile's waves break.
#[derive(Clone, Debug)]
pub(super) struct Breaking {
    /// Variance of the stretch, by state.
    stretches: Vec<f64>,
    /// Its part of the whole cover.
    pub share: f64,
}

/// The share of the sea that foam covers at a wind speed (m/s).
pub(super) fn cover(wind: f64) -> f64 {
    (3.84e-6 * pow(wind.max(0.0), 3.41)).min(0.5)
}

/// By how much more or less foam there is where the longer waves stand this many standard deviations high: short waves break upon the crests
/// of long ones. The mean is 1. It also keeps one tile's foam from showing its period.
#[inline(always)]
pub(super) fn upon(height: f32) -> f32 {
    (1.0 + 0.8 * height).clamp(0.0, 2.6)
}

/// Foam that finer waves gather where they press the water together by this many standard deviations, and part where they stretch it: neither
/// full foam nor clear water, but their borders and what fades. It leaves the mean nearly as it is.
#[inline(always)]
pub(super) fn torn(foam: f32, pressed: f32) -> f32 {
    (foam + 1.5 * foam * (1.0 - foam) * pressed.clamp(-2.0, 2.0)).clamp(0.0, 1.0)
}

/// What is left of foam after a tick.
pub(super) fn decay(instant: &Instant) -> f32 {
    exp(-instant.length / FADING) as f32
}

/// After how many ticks nothing is left of what was.
pub(super) fn memory(decay: f32) -> i64 {
    let (mut memory, mut left) = (1, 1.0);
    while left >= LEAST_FOAM {
        left *= decay;
        memory += 1;
    }
    memory
}

impl Foam {
    /// For a tile whose stretches have variances by state; `None` where its waves are too short to make any, or too long.
    pub fn new(tile: &Tile, stretches: &[f64], states: &[SeaState]) -> Option<Foam> {
        let breaking = tile.lowest > 0.0 && TAU / tile.lowest > LEAST_BREAKER;
        let windy = states.iter().any(|state| cover(state.wind.speed) > 1e-6);
        let blank = || vec![[0.0; LANES]; tile.samples * tile.samples / LANES];
        (breaking && windy).then(|| Foam {
            before: blank(),
            after: blank(),
            shown: blank(),
            coarser: Lazy::new(),
            samples: tile.samples,
            tick: None,
            breaking: Breaking { stretches: stretches.to_vec(), share: 1.0 },
        })
    }

    /// Goes to an instant. `advance` makes the foam after a tick of that before.
    pub fn set(&mut self, instant: &Instant, mut advance: impl FnMut(Moment, Foaming, &[Lane], &mut [Lane])) {
        self.coarser.forget();
        let decay = decay(instant);
        let memory = memory(decay);
        // `before` is to come to the instant's tick and `after` to the next.
        let behind = self.tick.map(|tick| match instant.ticks {
            Some(ticks) => (instant.tick - tick).rem_euclid(ticks),
            None => instant.tick - tick,
        });
        let missing = match behind {
            Some(behind) if (0..=memory).contains(&behind) => behind,
            _ => {
                self.after.fill([0.0; LANES]);
                memory + 1
            }
        };
        for tick in instant.tick + 2 - missing..=instant.tick + 1 {
            std::mem::swap(&mut self.before, &mut self.after);
            let moment = instant.at_tick(tick);
            let foaming = self.breaking.foaming(&moment, decay);
            advance(moment, foaming, &self.before, &mut self.after);
        }
        self.tick = Some(instant.tick);
        let part = instant.part;
        for ((shown, before), after) in self.shown.iter_mut().zip(&self.before).zip(&self.after) {
            for l in 0..LANES {
                shown[l] = before[l] + (after[l] - before[l]) * part;
            }
        }
    }

    /// Where a sample stands.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.shown[(y / LANES) * self.samples + x][y % LANES]
    }

    /// The mean over 2^`level` samples along each side; over all of them from the last level on.
    pub fn mean(&self, level: usize, x: usize, y: usize) -> f32 {
        let level = level.min(self.levels());
        let size = self.samples >> level;
        let (x, y) = (x % size, y % size);
        if level == 0 {
            return self.at(x, y);
        }
        // n²/4 (1 + 1/4 + …) numbers come before a level.
        self.means()[(self.samples * self.samples - 4 * size * size) / 3 + y * size + x]
    }

    /// Number of coarser levels.
    pub fn levels(&self) -> usize {
        self.samples.ilog2() as usize
    }

    /// All coarser levels one after the other, row by row.
    pub fn means(&self) -> &[f32] {
        self.coarser.get(|means| {
            means.clear();
            let mut size = self.samples / 2;
            let mut above = 0;
            while size >= 1 {
                let start = means.len();
                for y in 0..size {
                    for x in 0..size {
                        let of = |i: usize, j: usize| {
                            let (x, y) = (2 * x + i, 2 * y + j);
                            if start == 0 { self.at(x, y) } else { means[above + y * 2 * size + x] }
                        };
                        let mean = 0.25 * ((of(0, 0) + of(1, 0)) + (of(0, 1) + of(1, 1)));
                        means.push(mean);
                    }
                }
                above = start;
                size /= 2;
            }
        })
    }

    pub fn bytes(&self) -> usize {
        3 * size_of_val(&self.shown[..])
    }
}

impl Breaking {
    pub fn foaming(&self, moment: &Moment, decay: f32) -> Foaming {
        let (state, share) = moment.blend;
        let next = self.stretches[(state + 1).min(self.stretches.len() - 1)];
        let deviation = sqrt(self.stretches[state] + (next - self.stretches[state]) * share);
        // Tiles with foam overlap by chance, and so do whitecaps of different times.
        let cover = cover(moment.wind).max(1e-6);
        let chance = -log1p(-cover) * self.share / PERSISTENCE;
        if cover <= 1e-6 || deviation < 1e-4 {
            return Foaming { decay, threshold: -1e3, steepness: 1.0 };
        }
        let threshold = 1.0 - deviation * deviations(chance);
        Foaming { decay, threshold: threshold as f32, steepness: (1.0 / (FULL * deviation)) as f32 }
    }
}

/// How many standard deviations below its mean a normal number is with a small chance (below ½), to 5e-4: M. Abramowitz and I. Stegun 1964,
/// 26.2.23.
fn deviations(chance: f64) -> f64 {
    let t = sqrt(-2.0 * log(chance));
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    t - above / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)))
}
