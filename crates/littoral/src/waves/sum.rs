//! Sums of plane waves at any points.
//!
//! Waves that run one way make a fan, along whose way points lie at one distance for all of them: that spares a part of each phase, and sums
//! of slopes and displacements stay one number until the fan is done. Waves of a fan are sorted from short to long: a footprint hides the first of
//! them, whose slopes are known beforehand, and fades the next few. `kernel` has the inner loops, `grid` those for regular grids.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays are told apart by their number")]

use super::{BLOCK, Bounds, Motion, OutOfRange, PlaneWave, Points, StillWater, Velocity};
use glam::DVec2;
use std::f64::consts::TAU;

mod grid;
mod kernel;

pub use grid::{Grid, GridScratch};
pub(crate) use kernel::{COSINE, SINE, circle, power_of_two, small_circle};

/// Most waves in a sum.
pub(crate) const MOST_WAVES: usize = 1 << 16;

/// What the inner loops read of a wave, in turns and scaled to the polynomials.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Hot {
    /// Turns per metre along its way.
    k: f32,
    /// Height (m).
    height: f32,
    /// Slope, sideways displacement (m) and its derivative, along its way.
    tilt: f32,
    push: f32,
    stretch: f32,
    /// Turns per metre.
    kx: f32,
    ky: f32,
    /// ∂/∂X and ∂/∂Y of the height.
    tilt_x: f32,
    tilt_y: f32,
    /// Sideways displacement (m).
    push_x: f32,
    push_y: f32,
    /// Its derivatives.
    stretch_xx: f32,
    stretch_xy: f32,
    stretch_yy: f32,
    /// Wavelength (m).
    length: f32,
    /// Velocities at the surface (m/s), scaled for the depth: see [`Wave::flow`].
    flow_x: f32,
    flow_y: f32,
    flow_z: f32,
    /// Binary orders by which motion dies out in a metre of depth, at most 0.
    decay: f32,
}

/// A wave of a sum: a plane wave and how far it pushes water sideways, in parts of its height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pushing {
    pub wave: PlaneWave,
    pub push: f64,
}

/// A sum of plane waves over water of one depth at an instant.
#[derive(Clone, Debug)]
pub(crate) struct Sum {
    water: StillWater,
    /// Fan by fan, in each short waves first.
    waves: Vec<Pushing>,
    hot: Vec<Hot>,
    fans: Vec<Fan>,
    /// Whether the waves of a fan run one way; otherwise there is one fan, and each wave has its own way.
    fanned: bool,
    /// Turns per metre, and turns at the origin at the instant, within ±½; filled up to whole eights.
    kx: Vec<f64>,
    ky: Vec<f64>,
    turns: Vec<f64>,
    /// Covariances of each wave's slopes, xx, xy, yy, and of those of its fan up to it.
    slopes: Vec<[f32; 3]>,
    hidden: Vec<[f32; 3]>,
    /// All wavelengths (m), short ones first, and the greatest height or push (m) of all waves up to each.
    rough: Vec<[f32; 2]>,
    bounds: Bounds,
    pushes: bool,
}

/// Waves `from..to`, which run one way.
#[derive(Clone, Copy, Debug)]
struct Fan {
    /// That way, of length 1.
    along: DVec2,
    from: usize,
    to: usize,
}

/// Fewest waves in a fan, on average, for which fans pay.
const FAN: usize = 4;

impl Sum {
    pub(crate) fn new(waves: impl IntoIterator<Item = Pushing>, water: StillWater) -> Result<Sum, OutOfRange> {
        let water = water.checked()?;
        let mut waves: Vec<Pushing> = waves.into_iter().collect();
        let count = waves.len();
        OutOfRange::unless(count <= MOST_WAVES, "waves", "at most 65 536 waves", count as f64)?;
        waves.iter().try_for_each(Pushing::check)?;
        let (fans, fanned) = fans(&mut waves);
        let (mut slopes, mut hidden) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for fan in &fans {
            let mut sum = [0f32; 3];
            for Pushing { wave, .. } in &waves[fan.from..fan.to] {
                let (half, k) = (0.5 * wave.amplitude * wave.amplitude, wave.wavenumber);
                let own = [half * k.x * k.x, half * k.x * k.y, half * k.y * k.y].map(|number| number as f32);
                sum = [0, 1, 2].map(|i| sum[i] + own[i]);
                slopes.push(own);
                hidden.push(sum);
            }
        }
        let mut bounds = [0.0; 6];
        for Pushing { wave, push } in &waves {
            let (a, k) = (wave.amplitude, wave.wavenumber.length());
            for (sum, part) in bounds.iter_mut().zip([a, push * a, k * a, push * k * a, k * k * a, push * k * k * a]) {
                *sum += part;
            }
        }
        // A little above the sums, for what `f32` rounds.
        let [height, sideways, slope, stretch, curvature, bend] = bounds.map(|sum| (sum * (1.0 + 1e-5)) as f32);
        let hot: Vec<Hot> = waves.iter().map(|wave| Hot::new(wave, water)).collect();
        let mut sum = Sum {
            water,
            rough: rough(&waves, &hot),
            hot,
            fans,
            fanned,
            kx: padded(&waves, |wave| wave.wavenumber.x / TAU),
            ky: padded(&waves, |wave| wave.wavenumber.y / TAU),
            turns: padded(&waves, |_| 0.0),
            pushes: waves.iter().any(|w| w.push > 0.0),
            waves,
            slopes,
            hidden,
            bounds: Bounds { height, sideways, slope, stretch, curvature, bend },
        };
        sum.set_time(0.0);
        Ok(sum)
    }
}

/// Sorts waves into fans, and tells whether these run one way each.
fn fans(waves: &mut [Pushing]) -> (Vec<Fan>, bool) {
    let shorter =
        |a: &Pushing, b: &Pushing| b.wave.wavenumber.length_squared().total_cmp(&a.wave.wavenumber.length_squared());
    let heading = |w: &Pushing| libm::atan2(w.wave.wavenumber.y, w.wave.wavenumber.x);
    waves.sort_by(|a, b| heading(a).total_cmp(&heading(b)));
    // Closer than this, a point within a cell is no farther along the one than along the other than `f32` tells.
    let same = |a: &Pushing, b: &Pushing| (heading(a) - heading(b)).abs() < 1e-9;
    let mut fans = Vec::new();
    let mut from = 0;
    for fan in waves.chunk_by_mut(same) {
        fan.sort_by(shorter);
        let to = from + fan.len();
        fans.push(Fan { along: fan[0].wave.wavenumber.normalize(), from, to });
        from = to;
    }
    if FAN * fans.len() <= from {
        return (fans, true);
    }
    waves.sort_by(shorter);
    (vec![Fan { along: DVec2::ZERO, from: 0, to: from }], false)
}

/// All wavelengths, short ones first, and the greatest height or push of all waves up to each.
fn rough(waves: &[Pushing], hot: &[Hot]) -> Vec<[f32; 2]> {
    let own = |(w, hot): (&Pushing, &Hot)| [hot.length, (w.wave.amplitude * w.push.max(1.0)) as f32];
    let mut rough: Vec<[f32; 2]> = waves.iter().zip(hot).map(own).collect();
    rough.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut sum = 0.0;
    for [_, own] in &mut rough {
        sum += *own;
        *own = sum;
    }
    rough
}

impl Pushing {
    fn check(&self) -> Result<(), OutOfRange> {
        let Pushing { wave, push } = self;
        let k = wave.wavenumber.length();
        OutOfRange::unless((1e-6..=1e4).contains(&k), "wave number", "rad/m, from 1e-6 to 1e4", k)?;
        let fits = (0.0..=1e4).contains(&wave.amplitude);
        OutOfRange::unless(fits, "amplitude", "m, from 0 to 10 000", wave.amplitude)?;
        let fits = (0.0..=1e4).contains(&wave.angular_frequency);
        OutOfRange::unless(fits, "angular frequency", "rad/s, from 0 to 10 000", wave.angular_frequency)?;
        OutOfRange::unless(wave.phase.abs() <= 1e6, "phase", "rad, within ±1e6", wave.phase)?;
        OutOfRange::unless((0.0..=1e4).contains(push), "steepness", "a number from 0 to 10 000", *push)
    }
}

/// A number of each wave, filled up to whole eights.
fn padded(waves: &[Pushing], number: impl Fn(&PlaneWave) -> f64) -> Vec<f64> {
    let mut numbers: Vec<f64> = waves.iter().map(|pushing| number(&pushing.wave)).collect();
    numbers.resize(waves.len().next_multiple_of(8), 0.0);
    numbers
}

impl Hot {
    fn new(pushing: &Pushing, water: StillWater) -> Hot {
        let Pushing { wave, push } = pushing;
        let (a, k) = (wave.amplitude, wave.wavenumber);
        let (length, along) = (k.length(), k / k.length());
        // Of cosh(k(h−d)) / sinh(kh) = (e^−kd + e^−k(2h−d)) / (1 − e^−2kh), and likewise with sinh and a difference.
        let flow = a * wave.angular_frequency / -libm::expm1(-2.0 * length * water.depth);
        Hot {
            k: (length / TAU) as f32,
            kx: (k.x / TAU) as f32,
            ky: (k.y / TAU) as f32,
            height: (a * COSINE) as f32,
            tilt: (-a * length * SINE) as f32,
            push: (-push * a * SINE) as f32,
            stretch: (-push * a * length * COSINE) as f32,
            tilt_x: (-a * k.x * SINE) as f32,
            tilt_y: (-a * k.y * SINE) as f32,
            push_x: (-push * a * along.x * SINE) as f32,
            push_y: (-push * a * along.y * SINE) as f32,
            stretch_xx: (-push * a * along.x * k.x * COSINE) as f32,
            stretch_xy: (-push * a * along.x * k.y * COSINE) as f32,
            stretch_yy: (-push * a * along.y * k.y * COSINE) as f32,
            length: (TAU / length) as f32,
            flow_x: (flow * along.x * COSINE) as f32,
            flow_y: (flow * along.y * COSINE) as f32,
            flow_z: (flow * SINE) as f32,
            decay: (-length * std::f64::consts::LOG2_E) as f32,
        }
    }
}

impl Sum {
    pub(crate) fn waves(&self) -> &[Pushing] {
        &self.waves
    }

    pub(crate) fn water(&self) -> StillWater {
        self.water
    }

    /// Goes to an instant (s).
    pub(crate) fn set_time(&mut self, seconds: f64) {
        for (turns, Pushing { wave, .. }) in self.turns.iter_mut().zip(&self.waves) {
            let all = wave.phase / TAU - wave.angular_frequency / TAU * seconds;
            *turns = all - all.round_ties_even();
        }
    }

    /// Displacements of many blocks: to the bit those of each.
    pub(crate) fn add_displacements(&self, points: &[Points], motions: &mut [Motion]) {
        kernel::add_displacements(self, points, motions);
    }

    /// Motions of many blocks: to the bit those of each.
    pub(crate) fn add_motions(&self, points: &[Points], motions: &mut [Motion]) {
        kernel::add_motions(self, points, motions);
    }

    /// Heights (m) at places; they must not be pushed sideways.
    pub(crate) fn heights_at(&self, places: &[DVec2], heights: &mut [f32]) {
        kernel::heights_at(self, places, heights);
    }

    pub(crate) fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        kernel::add_displacement(self, points, motion);
    }

    pub(crate) fn add_motion(&self, points: &Points, motion: &mut Motion) {
        kernel::add_motion(self, points, motion);
    }

    pub(crate) fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        kernel::add_velocity(self, points, depths, velocity);
    }

    pub(crate) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// How fast the surface goes up or down at a place that stays, at most: as fast as its water does, and as its slopes are pushed by.
    pub(crate) fn rise_speed(&self) -> f32 {
        let (up, aside) = self.waves.iter().fold((0.0, 0.0), |(up, aside), Pushing { wave, push }| {
            let speed = wave.amplitude * wave.angular_frequency;
            (up + speed, aside + push * speed)
        });
        let b = &self.bounds;
        match aside {
            0.0 => (up * (1.0 + 1e-5)) as f32,
            _ if b.stretch < 1.0 => ((up + aside * f64::from(b.slope / (1.0 - b.stretch))) * (1.0 + 1e-5)) as f32,
            _ => f32::INFINITY,
        }
    }

    /// Greatest height or push of the waves shorter than `wavelength` (m).
    pub(crate) fn roughness(&self, wavelength: f32) -> f32 {
        match self.rough.partition_point(|[length, _]| *length < wavelength) {
            0 => 0.0,
            shorter => self.rough[shorter - 1][1],
        }
    }
}
