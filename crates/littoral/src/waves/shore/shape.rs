//! What the sum of the waves makes of the water near a shore: sharp crests and steep fronts, surf and swash.
//!
//! *Profile.* With ζ the sum of A cos θ and ξ that of A sin θ over all waves, E = √(ζ² + ξ²) is the height of the wave that passes, and
//! (ζ, ξ)/E tells where in it a point is. The surface is T. Abreu, P. Silva, F. Sancho, A. Temperville 2010's wave of that height and phase,
//!
//! η = f (ζ + E r sin φ / (1 + f)) / (1 − r (ξ cos φ − ζ sin φ) / E),  f = √(1 − r²),
//!
//! with r and φ by B. Ruessink, G. Ramaekers, L. van Rijn 2012 from the Ursell number ¾ (Hs/2) k / (kh)³: r = 0 leaves sines, φ = −90°
//! sharpens crests, φ = 0° steepens fronts. Its mean over a wave is 0 and its height that of the sine. E is kept off 0, so that the surface
//! stays smooth where no wave passes.
//!
//! *Broken waves.* A wave of height 2E is broken where that is near what the depth bears; their part on the average is J. Battjes and
//! J. Janssen's of 1978. The front of a broken wave carries a roller; behind it is left a lace of foam that dissolves with the time since the
//! crest went by, which its phase tells; told is how much of the water it covers, not its threads and holes.
//!
//! *Swash.* H. Stockdon, R. Holman, P. Howd, A. Sallenger 2006: set-up 1.1 · 0.35 β √(H₀L₀) and a swing of 1.1 · ½ √(H₀L₀ (0.563 β² + 0.004))
//! about it, reached by 2 % of the waves; H₀ is the height that the waves at the place would have in deep water, had none broken.

use super::lanes::{LANES, angle, decay, smooth};
use super::solve::quick;
use libm::{exp, log10, sqrt, tanh};
use std::f64::consts::TAU;

/// Greatest height of a profile in amplitudes of its sine.
pub(super) const HIGHEST: f32 = 1.4;
/// What keeps E off 0, in significant heights.
pub(super) const SOFT: f32 = 1.0 / 16.0;
/// How fast the lace dissolves (s).
const FADE: f32 = 5.0;

/// What is known of a place besides its waves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Place(pub(super) [f32; 8]);

impl Place {
    /// Depth (m).
    pub(super) const DEPTH: usize = 0;
    /// Significant height (m).
    pub(super) const HEIGHT: usize = 1;
    /// r cos φ.
    pub(super) const COSINE: usize = 2;
    /// r sin φ.
    pub(super) const SINE: usize = 3;
    /// How much of the sideways motion of deep water is let be.
    pub(super) const SIDEWAYS: usize = 4;
    /// Part of the waves that is broken.
    pub(super) const BROKEN: usize = 5;
    /// Mean height of the waterline over still water (m).
    pub(super) const SETUP: usize = 6;
    /// How far it swings about that (m).
    pub(super) const SWING: usize = 7;

    /// r.
    pub(super) fn sharpness(&self) -> f32 {
        let (c, s) = (self.0[Place::COSINE], self.0[Place::SINE]);
        (c * c + s * s).sqrt()
    }
}

/// Greatest height of a profile of sharpness `r` over that of its sine.
pub(super) fn highest(r: f32) -> f32 {
    1.0 + r / (1.0 + (1.0 - r * r).max(0.0).sqrt())
}

/// Greatest slope of a profile of sharpness `r` over that of its sine.
pub(super) fn steepest(r: f32) -> f32 {
    if r > 1e-3 { 1.1 * (1.0 - r * r).max(0.0).sqrt() / (1.0 - r) } else { 1.0 + r }
}

const STEPS: usize = 512;

/// What makes [`Place`]s.
pub(super) struct Ground {
    energy: f64,
    steep: f64,
    open: f64,
    breaking: f32,
    fetch: f64,
    /// k over √(h/(h+10)).
    wavenumbers: Vec<f32>,
    /// r cos φ and r sin φ over Ur / (1 + Ur).
    profiles: Vec<[f32; 2]>,
    /// Part of broken waves over (Hrms / Hm)².
    broken: Vec<f32>,
}

impl Ground {
    /// For waves of a mean angular frequency, a mean wave number in the open, a sum of steepnesses and an energy (m²).
    pub(super) fn new(frequency: f64, wavenumber: f64, steep: f64, energy: f64, breaking: f32) -> Ground {
        let step = |i: usize| i as f64 / STEPS as f64;
        let frequency = if frequency > 0.0 { frequency } else { 1.0 };
        let wavenumbers = (0..=STEPS)
            .map(|i| {
                let s = step(i).max(1e-3);
                let h = if s >= 1.0 { 1e9 } else { 10.0 * s * s / (1.0 - s * s) };
                (quick(frequency, h) * s) as f32
            })
            .collect();
        let profiles = (0..=STEPS)
            .map(|i| {
                let t = step(i).clamp(1e-6, 1.0 - 1e-6);
                let ursell = t / (1.0 - t);
                let nonlinear = 0.857 / (1.0 + exp((-0.471 - log10(ursell)) / 0.297));
                let b = std::f64::consts::SQRT_2 * nonlinear / sqrt(9.0 + 2.0 * nonlinear * nonlinear);
                let r = 2.0 * b / (1.0 + b * b);
                let lean = 0.25 * TAU * (tanh(0.815 / libm::pow(ursell, 0.672)) - 1.0);
                let phase = -lean - 0.25 * TAU;
                [(r * libm::cos(phase)) as f32, (r * libm::sin(phase)) as f32]
            })
            .collect();
        let broken = (0..=STEPS)
            .map(|i| {
                let x = step(i);
                // (1 − Q) / −ln Q = x grows with Q.
                let (mut low, mut high) = (0.0f64, 1.0f64);
                for _ in 0..60 {
                    let q = 0.5 * (low + high);
                    if (1.0 - q) / -libm::log(q) < x { low = q } else { high = q }
                }
                low as f32
            })
            .collect();
        // A length of deep water, by the mean period.
        let fetch = TAU * super::super::STANDARD_GRAVITY / (frequency * frequency);
        Ground { energy, steep, open: wavenumber, breaking, fetch, wavenumbers, profiles, broken }
    }

    /// A place of a depth (m) and energy (m²); with the slope of the bed and the height (m) in deep water had none broken, if it has a shore.
    pub(super) fn place(&self, depth: f64, energy: f32, shore: Option<(f32, f32)>) -> Place {
        let h = depth as f32;
        let height = 4.0 * energy.max(0.0).sqrt();
        let s = (h / (h + 10.0)).sqrt();
        let k = read(&self.wavenumbers, s) / s.max(1e-3);
        let kh = (k * h).max(1e-3);
        let ursell = 0.375 * height * k / (kh * kh * kh);
        let t = ursell / (1.0 + ursell) * STEPS as f32;
        let i = (t as usize).min(STEPS - 1);
        let f = t - i as f32;
        let mix = |n: usize| self.profiles[i][n] + f * (self.profiles[i + 1][n] - self.profiles[i][n]);
        // Waters without waves have no profile; nor does the open sea beyond what is told apart.
        let (cosine, sine) = if height > 1e-4 && ursell > 2e-3 { (mix(0), mix(1)) } else { (0.0, 0.0) };
        let relative = (energy as f64 / self.energy.max(1e-12)).sqrt();
        let sum = self.steep * relative * (f64::from(k) / self.open.max(1e-9)).max(1.0);
        let loops = (0.85 / sum.max(0.85)) as f32;
        let most = (self.breaking * h).max(1e-3);
        let x = 0.5 * (height / most) * (height / most);
        let broken = if depth > 1e4 { 0.0 } else { read(&self.broken, x.min(1.0)) };
        let (mut setup, mut swing) = (0.0, 0.0);
        if let Some((slope, unbroken)) = shore {
            let slope = slope.clamp(0.005, 0.2);
            let length = unbroken * self.fetch as f32;
            setup = 1.1 * 0.35 * slope * length.sqrt();
            swing = 1.1 * 0.5 * (length * (0.563 * slope * slope + 0.004)).sqrt();
            let reach = (setup + swing).max(1e-3);
            let near = 1.0 - smooth(0.5 * reach, 2.0 * reach, h);
            (setup, swing) = (setup * near, swing * near);
        }
        Place([h, height, cosine, sine, loops * smooth(0.4, 1.4, k * h), broken, setup, swing])
    }
}

fn read(table: &[f32], at: f32) -> f32 {
    let t = at.clamp(0.0, 1.0) * STEPS as f32;
    let i = (t as usize).min(STEPS - 1);
    table[i] + (t - i as f32) * (table[i + 1] - table[i])
}

/// Sums over the waves at sixteen points, and what is known of their places.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Sums {
    /// Σ A cos θ, with its derivatives along x and y.
    pub(super) zeta: [f32; LANES],
    pub(super) zeta_x: [f32; LANES],
    pub(super) zeta_y: [f32; LANES],
    /// Σ A sin θ, with its derivatives.
    pub(super) xi: [f32; LANES],
    pub(super) xi_x: [f32; LANES],
    pub(super) xi_y: [f32; LANES],
    /// Σ A sin θ times the directions, which is against the sideways motion of deep water; and its derivatives xx, xy, yy.
    pub(super) side_x: [f32; LANES],
    pub(super) side_y: [f32; LANES],
    pub(super) stretch: [[f32; LANES]; 3],
    /// Covariances of the slopes left out.
    pub(super) hidden: [[f32; LANES]; 3],
    /// The places.
    pub(super) place: [[f32; LANES]; 8],
    /// Derivatives along x and y of their height, profile and sideways motion.
    pub(super) place_x: [[f32; LANES]; 8],
    pub(super) place_y: [[f32; LANES]; 8],
}

impl Sums {
    pub(super) const NONE: Sums = Sums {
        zeta: [0.0; LANES],
        zeta_x: [0.0; LANES],
        zeta_y: [0.0; LANES],
        xi: [0.0; LANES],
        xi_x: [0.0; LANES],
        xi_y: [0.0; LANES],
        side_x: [0.0; LANES],
        side_y: [0.0; LANES],
        stretch: [[0.0; LANES]; 3],
        hidden: [[0.0; LANES]; 3],
        place: [[0.0; LANES]; 8],
        place_x: [[0.0; LANES]; 8],
        place_y: [[0.0; LANES]; 8],
    };
}

/// Height of the profile at lane `l`, and the parts it is made of: numerator, denominator, E.
#[inline(always)]
pub(super) fn profile(sums: &Sums, l: usize) -> (f32, f32, f32, f32, f32, f32) {
    let (zeta, xi) = (sums.zeta[l], sums.xi[l]);
    let (rc, rs) = (sums.place[Place::COSINE][l], sums.place[Place::SINE][l]);
    let soft = SOFT * sums.place[Place::HEIGHT][l];
    let e = soft.mul_add(soft, zeta.mul_add(zeta, xi.mul_add(xi, 1e-12))).sqrt();
    let f = (1.0 - rc.mul_add(rc, rs * rs)).max(0.0).sqrt();
    let beta = rs / (1.0 + f);
    let numerator = beta.mul_add(e, zeta);
    let lean = rc.mul_add(xi, -(rs * zeta));
    let denominator = 1.0 - lean / e;
    (f * numerator / denominator, numerator, denominator, e, f, lean)
}

/// Slope of the profile at lane `l`, given the derivatives of ζ, ξ and the places along one axis.
#[inline(always)]
pub(super) fn profile_slope(
    sums: &Sums,
    l: usize,
    parts: (f32, f32, f32, f32, f32, f32),
    (zeta_d, xi_d): (f32, f32),
    place: &[[f32; LANES]; 8],
) -> f32 {
    let (_, numerator, denominator, e, f, lean) = parts;
    let (zeta, xi) = (sums.zeta[l], sums.xi[l]);
    let (rc, rs) = (sums.place[Place::COSINE][l], sums.place[Place::SINE][l]);
    let (rc_d, rs_d) = (place[Place::COSINE][l], place[Place::SINE][l]);
    let soft = SOFT * SOFT * sums.place[Place::HEIGHT][l] * place[Place::HEIGHT][l];
    let e_d = (zeta * zeta_d + xi * xi_d + soft) / e;
    let f_d = -(rc * rc_d + rs * rs_d) / f.max(0.1);
    let beta = rs / (1.0 + f);
    let beta_d = (rs_d - beta * f_d) / (1.0 + f);
    let numerator_d = zeta_d + beta * e_d + beta_d * e;
    let lean_d = rc * xi_d - rs * zeta_d + rc_d * xi - rs_d * zeta;
    let denominator_d = -(lean_d - lean * e_d / e) / e;
    (f_d * numerator + f * numerator_d - f * numerator * denominator_d / denominator) / denominator
}

/// Greatest swing of the swash in those that 2 % of the waves reach.
pub(super) const FARTHEST: f32 = 1.3;
/// The wave (m per m of significant height) that 2 % are higher than: 2.8 √m₀.
const USUAL: f32 = 0.7;

/// How far (m) set-up and swash have raised the water at lane `l`.
#[inline(always)]
pub(super) fn swash(sums: &Sums, l: usize) -> f32 {
    let usual = USUAL.mul_add(sums.place[Place::HEIGHT][l], 1e-5);
    let (held, _) = held(sums.zeta[l] / usual);
    sums.place[Place::SWING][l].mul_add(held, sums.place[Place::SETUP][l])
}

/// A wave as the swash follows it, smoothly held between -1 and [`FARTHEST`], and the derivative of that.
#[inline(always)]
fn held(wave: f32) -> (f32, f32) {
    let most = if wave < 0.0 { 1.0 } else { FARTHEST };
    let t = (wave.abs() / (1.5 * most)).min(1.0);
    ((most * t * (1.5 - 0.5 * t * t)).copysign(wave), 1.0 - t * t)
}

/// Slope of [`swash`] along an axis, given the derivatives of ζ and the places.
#[inline(always)]
pub(super) fn swash_slope(sums: &Sums, l: usize, zeta_d: f32, place: &[[f32; LANES]; 8]) -> f32 {
    let usual = USUAL.mul_add(sums.place[Place::HEIGHT][l], 1e-5);
    let wave = sums.zeta[l] / usual;
    let (held, share) = held(wave);
    let wave_d = share * (zeta_d - wave * USUAL * place[Place::HEIGHT][l]) / usual;
    place[Place::SWING][l].mul_add(held, sums.place[Place::SWING][l].mul_add(wave_d, place[Place::SETUP][l]))
}

/// Which part of the water about lane `l` is foam.
pub(super) fn foam(sums: &Sums, l: usize, frequency: f32, breaking: f32) -> f32 {
    let broken = sums.place[Place::BROKEN][l];
    if broken < 2e-3 {
        return 0.0;
    }
    let (zeta, xi) = (sums.zeta[l], sums.xi[l]);
    let most = breaking * sums.place[Place::DEPTH][l];
    let e = zeta.mul_add(zeta, xi * xi).sqrt();
    let often = smooth(2e-3, 0.05, broken);
    // This wave, against what the depth bears.
    let here = often * smooth(0.55, 1.0, 2.0 * e / most.max(1e-3));
    // Time since its crest went by.
    let behind = -angle(zeta, xi);
    let age = (if behind < -0.12 { behind + 1.0 } else { behind.max(0.0) }) * std::f32::consts::TAU / frequency;
    let (cosine, sine) = (zeta / e.max(1e-6), xi / e.max(1e-6));
    let front = cosine.mul_add(0.88, 0.47 * sine);
    let roller = here * smooth(0.55, 0.85, front);
    let period = std::f32::consts::TAU / frequency;
    // What this wave has left, and what those before it did, on the average.
    let fresh = 0.85 * here * decay(-age / FADE);
    let old = 0.8 * often * broken.sqrt() * decay(-(age + period) / (2.0 * FADE));
    let cover = fresh.max(old).min(0.9);
    roller.max(cover).clamp(0.0, 1.0)
}
