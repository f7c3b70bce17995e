//! Light on and in still water.
//!
//! The surface mirrors by Fresnel's law. Its ripples are noise as far as a pixel can show them and a distribution of slopes
//! below that, which spreads the sun into glitter and blurs what is mirrored. Into the water, the semi-analytical
//! reflectance of Z. Lee et al. gives what comes back from the water itself and from the bed, with the absorption of R. Pope
//! and E. Fry, the scattering of R. Smith and K. Baker, and the dissolved matter and plankton of clear coastal water.
//!
//! Works this rests on: C. Cox, W. Munk, "Measurement of the roughness of the sea surface from photographs of the sun's
//! glitter", 1954; R. Smith, K. Baker, Applied Optics 20, 1981; R. Pope, E. Fry, Applied Optics 36, 1997; Z. Lee et al.,
//! "Hyperspectral remote sensing for shallow waters: 1", Applied Optics 37, 1998.

use super::grain::{grain, patch, resolved};
use super::spectrum::{SUNLIGHT, Spectrum};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// Refractive index of sea water.
pub const INDEX: f32 = 1.34;

/// Absorption of pure water (1/m): Pope and Fry 1997.
const PURE: [f32; 8] = [0.006_63, 0.006_35, 0.0127, 0.0409, 0.0619, 0.2224, 0.3108, 0.465];
/// Scattering of sea water (1/m): Smith and Baker 1981; half goes back.
const SCATTER: [f32; 8] = [0.0076, 0.0050, 0.0034, 0.0024, 0.0018, 0.0013, 0.0010, 0.0008];
/// Absorption of phytoplankton relative to that at 440 nm.
const PLANKTON: [f32; 8] = [0.70, 1.00, 0.72, 0.36, 0.15, 0.12, 0.14, 0.42];

/// Length of the table, and the longest path in it (m).
const STEPS: usize = 256;
const LONGEST: f32 = 160.0;

/// What the water does to light over a path down and up.
pub struct Depths {
    /// For each path: radiance from the water itself, per irradiance below the surface; share left of the bed's light.
    table: Vec<(Vec3, Vec3)>,
}

impl Depths {
    /// Clear coastal water.
    pub fn new() -> Depths {
        let mut absorb = Spectrum(PURE);
        let mut back = Spectrum(SCATTER) * 0.5;
        let dissolved = Spectrum::of(|nm| 0.030 * (-0.015 * (nm - 440.0)).exp());
        let particles = Spectrum::of(|nm| 0.0022 * 550.0 / nm);
        absorb += dissolved + Spectrum(PLANKTON) * 0.022;
        back += particles;
        let white = SUNLIGHT.rgb();
        let table = (0..=STEPS)
            .map(|i| {
                let path = path_at(i as f32);
                let own = Spectrum(std::array::from_fn(|b| {
                    let extinction = absorb.0[b] + back.0[b];
                    let u = back.0[b] / extinction;
                    // Lee 1998, equations 9 and 12: what an endless depth sends back, less what this one lacks.
                    (0.084 + 0.170 * u) * u * (1.0 - (-extinction * path).exp())
                }));
                let left = Spectrum(std::array::from_fn(|b| (-(absorb.0[b] + back.0[b]) * path).exp()));
                ((own * SUNLIGHT).rgb().max(Vec3::ZERO) / white, (left * SUNLIGHT).rgb().max(Vec3::ZERO) / white)
            })
            .collect();
        Depths { table }
    }

    /// For each path: radiance from the water itself, per irradiance below the surface; share left of the bed's light.
    pub fn table(&self) -> &[(Vec3, Vec3)] {
        &self.table
    }

    /// Radiance leaving the surface (kcd/m²) for irradiance `below` (klx) just under it, over a bed of this depth (m) that
    /// throws back `bed` of it. Cosines are those of sun and eye within the water.
    pub fn radiance(&self, depth: f32, sun_cosine: f32, eye_cosine: f32, below: Vec3, bed: Vec3) -> Vec3 {
        let path = depth.max(0.0) * (1.0 / sun_cosine + 1.05 / eye_cosine);
        let at = step_of(path).min(STEPS as f32 - 1e-3);
        let (i, f) = (at as usize, at.fract());
        let own = self.table[i].0.lerp(self.table[i + 1].0, f);
        let left = self.table[i].1.lerp(self.table[i + 1].1, f);
        // Through the surface a beam widens by the index squared; a little is turned back within (Lee 1998, equation 8).
        (own + left * bed / std::f32::consts::PI) * below * 0.54
    }
}

fn path_at(step: f32) -> f32 {
    LONGEST * (step / STEPS as f32).powi(2)
}

fn step_of(path: f32) -> f32 {
    (path / LONGEST).sqrt() * STEPS as f32
}

/// Share of unpolarised light that water mirrors, for the cosine of incidence in air.
pub fn fresnel(cosine: f32) -> f32 {
    let c = cosine.clamp(0.0, 1.0);
    let t = (1.0 - (1.0 - c * c) / (INDEX * INDEX)).max(0.0).sqrt();
    let (s, p) = ((c - INDEX * t) / (c + INDEX * t), (INDEX * c - t) / (INDEX * c + t));
    0.5 * (s * s + p * p)
}

/// Direction of a ray within the water, for a unit direction that meets a surface of unit normal from above.
pub fn refract(direction: Vec3, normal: Vec3) -> Vec3 {
    let cosine = -direction.dot(normal);
    let k = 1.0 - (1.0 - cosine * cosine) / (INDEX * INDEX);
    direction / INDEX + normal * (cosine / INDEX - k.max(0.0).sqrt())
}

/// Ripples and waves at a place.
#[derive(Clone, Copy, Debug)]
pub struct Ripples {
    /// Slope of those a pixel can show.
    pub slope: Vec2,
    /// Covariances (xx, xy, yy) of the slopes of those it cannot: normally distributed (C. Cox and W. Munk 1954).
    pub hidden: Vec3,
}

impl Ripples {
    /// The distribution of slopes along a horizontal unit direction: mean and standard deviation.
    fn along(&self, direction: Vec2) -> (f32, f32) {
        let Vec3 { x: xx, y: xy, z: yy } = self.hidden;
        let square =
            xx * direction.x * direction.x + 2.0 * xy * direction.x * direction.y + yy * direction.y * direction.y;
        (self.slope.dot(direction), square.max(1e-8).sqrt())
    }

    /// Area of the facets turned towards a unit direction, as seen from there, per area of still water: ∫ (v·n / n_z)⁺ over the slopes.
    pub fn seen_from(&self, eye: Vec3) -> f32 {
        let (flat, along) = flat_of(eye);
        let (mean, deviation) = self.along(along);
        let above = eye.z - flat * mean;
        let spread = (flat * deviation).max(1e-6);
        above * below(above / spread) + spread * bell(above / spread)
    }

    /// A slope drawn from those turned towards a unit direction, each as often as its area is seen from there (E. Heitz and E. d'Eon,
    /// "Importance sampling microfacet-based BSDFs using the distribution of visible normals", 2014), for two normal numbers.
    pub fn seen_slope(&self, eye: Vec3, random: Vec2) -> Vec2 {
        let (flat, along) = flat_of(eye);
        let across = along.perp();
        let (mean, deviation) = self.along(along);
        // In deviations: facets with p < edge face the eye, and their area goes with edge - p.
        let edge = ((eye.z - flat * mean) / (flat * deviation).max(1e-6)).clamp(-6.0, 1e4);
        let whole = edge * below(edge) + bell(edge);
        let wanted = below(random.x) * whole;
        let (mut low, mut high) = (-7.0f32, edge.min(7.0));
        let mut p = random.x.clamp(low, high);
        for _ in 0..8 {
            let off = edge * below(p) + bell(p) - wanted;
            if off > 0.0 {
                high = p
            } else {
                low = p
            }
            let slope = (edge - p) * bell(p);
            let next = p - off / slope.max(1e-9);
            p = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        // The other component follows the first where they are correlated.
        let Vec3 { x: xx, y: xy, z: yy } = self.hidden;
        let covariance = along.x * (xx * across.x + xy * across.y) + along.y * (xy * across.x + yy * across.y);
        let (across_mean, across_deviation) = self.along(across);
        let follow = covariance / deviation;
        let left = (across_deviation * across_deviation - follow * follow).max(0.0).sqrt();
        along * (mean + deviation * p) + across * (across_mean + follow * p + left * random.y)
    }

    /// Density of a slope.
    fn density(&self, slope: Vec2) -> f32 {
        let Vec3 { x: xx, y: xy, z: yy } = self.hidden;
        let area = (xx * yy - xy * xy).max(1e-12);
        let d = slope - self.slope;
        let exponent = (yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y) / area;
        (-0.5 * exponent).exp() / (2.0 * std::f32::consts::PI * area.sqrt())
    }
}

/// Length and direction of the horizontal part.
fn flat_of(v: Vec3) -> (f32, Vec2) {
    let flat = v.truncate();
    (flat.length(), flat.normalize_or(Vec2::X))
}

/// The normal distribution's density.
fn bell(x: f32) -> f32 {
    0.398_942_3 * (-0.5 * x * x).exp()
}

/// The x with a share of the normal distribution below it: the inverse of [`below`], to 5e-4 (Abramowitz and Stegun 26.2.23).
fn quantile(share: f32) -> f32 {
    let p = share.clamp(1e-6, 1.0 - 1e-6);
    let t = (-2.0 * p.min(1.0 - p).ln()).sqrt();
    let x =
        t - (2.515_517 + t * (0.802_853 + t * 0.010_328)) / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
    if p < 0.5 { -x } else { x }
}

/// How wind draws foam out into streaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Streaks {
    /// Unit vector along the wind.
    pub along: DVec2,
    /// How many times longer than wide they are, at least 1.
    pub stretch: f64,
}

impl Streaks {
    /// Those of a wind towards a heading (rad) with a speed (m/s): none in a breeze; in a gale foam "is blown in well-marked streaks along
    /// the direction of the wind" (the Beaufort scale's words for 8).
    pub fn of_wind(heading: f64, speed: f64) -> Streaks {
        Streaks { along: DVec2::from_angle(heading), stretch: 1.0 + 3.5 * (speed / 20.0).clamp(0.0, 1.5).powi(2) }
    }
}

/// How much of a pixel of a footprint (m) is white where `cover` of the water about it is foam: a lace of threads and holes, carried by the water
/// that rests at a place (m). In the mean over places it is `cover`.
pub fn lace(rest: DVec2, footprint: f32, cover: f32, streaks: Streaks) -> f32 {
    if cover <= 0.002 {
        return 0.0;
    }
    // Octaves of noise: wavelengths, shares of the variance, and whether they are threads, being white where the noise is near 0. What a pixel
    // cannot show is normally distributed.
    const OCTAVES: [(f32, f32, bool); 7] = [
        (6.1, 0.20, false),
        (2.3, 0.14, false),
        (2.9, 0.18, true),
        (1.1, 0.18, true),
        (0.47, 0.14, true),
        (0.17, 0.09, false),
        (0.07, 0.07, false),
    ];
    // Mean square of the noise.
    const NOISE: f32 = 0.074;
    // Edges are thin foam.
    const SOFT: f32 = 0.05;
    let place = DVec2::new(rest.dot(streaks.along) / streaks.stretch, streaks.along.perp_dot(rest));
    let (mut sum, mut left) = (0.0, 1.0f32);
    for (i, (wavelength, share, thread)) in OCTAVES.into_iter().enumerate() {
        let shown = resolved(wavelength, footprint);
        if shown == 0.0 {
            continue;
        }
        let turned = DVec2::from_angle(1.1 * i as f64).rotate(place);
        let noise = patch(turned.extend(0.31), wavelength, 0.0, 70 + i as u32) / NOISE.sqrt();
        let score = if thread { quantile(2.0 - 2.0 * below(noise.abs())) } else { noise };
        sum += score * shown * share.sqrt();
        left -= share * shown * shown;
    }
    let soft = left.max(SOFT);
    below((sum * ((1.0 - soft) / (1.0 - left).max(1e-3)).min(1.0).sqrt() - quantile(1.0 - cover)) / soft.sqrt())
}

/// Share of the normal distribution below x, to 1e-7 (M. Abramowitz and I. Stegun, *Handbook of mathematical functions*, 1964, 26.2.17).
fn below(x: f32) -> f32 {
    let tail = |x: f32| {
        let t = 1.0 / (1.0 + 0.231_641_9 * x);
        bell(x) * t * (0.319_381_53 + t * (-0.356_563_78 + t * (1.781_477_9 + t * (-1.821_255_9 + t * 1.330_274_4))))
    };
    if x < 0.0 { tail(-x) } else { 1.0 - tail(x) }
}

/// The ripples of a light air at a world position (m), for a pixel of this footprint (m).
pub fn ripples(at: DVec2, footprint: f32) -> Ripples {
    // Gusts and lanes: the same breeze does not touch all of the water.
    let plane = at.extend(0.0);
    let along = DVec3::new(plane.x * 0.8 + plane.y * 0.6, (plane.y * 0.8 - plane.x * 0.6) * 2.6, 0.0);
    let lanes = patch(along, 700.0, footprint, 40)
        + 0.7 * patch(along, 190.0, footprint, 41)
        + 0.4 * patch(along, 47.0, footprint, 44);
    let strength = (0.85 + 1.1 * lanes).clamp(0.25, 1.8);
    let mut slope = Vec2::ZERO;
    let mut variance = 4.0e-4;
    let mut wavelength = 17.0f32;
    for octave in 0..9u32 {
        // Mean square slope of one octave of unit amplitude is about 0.5 in each direction of the noise.
        let amplitude = 0.020 * strength * if octave < 2 { 0.45 } else { 1.0 };
        let share = resolved(wavelength, footprint);
        if share > 0.0 {
            // Each octave turned a little, and longer along its crests.
            let (s, c) = (0.35 + 0.9 * f64::from(octave)).sin_cos();
            let turned = DVec3::new(at.x * c + at.y * s, (at.y * c - at.x * s) * 0.55, 0.0) / f64::from(wavelength);
            let g = grain(turned + DVec3::Z * 0.37, 50 + octave).gradient;
            let (s, c) = (s as f32, c as f32);
            let g = Vec2::new(g.x, 0.55 * g.y);
            slope += Vec2::new(g.x * c - g.y * s, g.x * s + g.y * c) * (amplitude * share);
        }
        variance += 0.45 * (amplitude * amplitude) * (1.0 - share * share);
        wavelength *= 0.53;
    }
    Ripples { slope, hidden: Vec3::new(variance, 0.0, variance) }
}

/// Radiance of the sun's glitter per unit of sunlight on a facing surface (1/sr): Cox and Munk. All vectors unit, `eye` and `sun`
/// pointing away from the water.
pub fn glitter(eye: Vec3, sun: Vec3, ripples: &Ripples) -> f32 {
    let half = (eye + sun).normalize_or(Vec3::Z);
    if half.z < 0.05 {
        return 0.0;
    }
    let density = ripples.density(Vec2::new(-half.x, -half.y) / half.z);
    // Of the facets turned to the eye, those the sun sees too.
    let lit = (sun.z / ripples.seen_from(sun).max(1e-4)).clamp(0.0, 1.0);
    fresnel(eye.dot(half)) * density * lit / (4.0 * ripples.seen_from(eye).max(1e-3) * half.z.powi(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnel_has_its_known_values() {
        let upright = ((INDEX - 1.0) / (INDEX + 1.0)).powi(2);
        assert!((fresnel(1.0) - upright).abs() < 1e-6);
        assert!((fresnel(0.0) - 1.0).abs() < 1e-6);
        // At Brewster's angle half of the s-polarised light is all that returns.
        let brewster = (1.0f32 / (1.0 + INDEX * INDEX)).sqrt();
        let s = ((INDEX * INDEX - 1.0) / (INDEX * INDEX + 1.0)).powi(2);
        assert!((fresnel(brewster) - 0.5 * s).abs() < 1e-5);
    }

    #[test]
    fn refraction_follows_snell() {
        let direction = Vec3::new(0.6, 0.0, -0.8);
        let within = refract(direction, Vec3::Z);
        assert!((within.length() - 1.0).abs() < 1e-6);
        assert!((within.x * INDEX - 0.6).abs() < 1e-6 && within.z < 0.0);
    }

    #[test]
    fn shallow_water_shows_its_bed_and_deep_water_is_blue() {
        let depths = Depths::new();
        let seen = |depth| depths.radiance(depth, 0.9, 0.9, Vec3::ONE, Vec3::splat(0.4));
        assert!((seen(0.0) - Vec3::splat(0.54 * 0.4 / std::f32::consts::PI)).abs().max_element() < 1e-4);
        let (three, deep) = (seen(3.0), seen(200.0));
        assert!(three.y > three.x * 2.0 && three.y > 0.7 * three.z, "turquoise: {three}");
        assert!(deep.z > deep.y && deep.y > 3.0 * deep.x, "blue: {deep}");
        // Irradiance reflectance of clear coastal water: one to four per cent.
        assert!((0.004..0.04).contains(&(deep.z * std::f32::consts::PI)), "{deep}");
        let mut last = seen(0.0).element_sum();
        for depth in 1..60 {
            let here = seen(depth as f32).element_sum();
            assert!(here <= last);
            last = here;
        }
    }

    #[test]
    fn glitter_sends_back_what_fresnel_mirrors() {
        // Smooth water, sun and eye high: ∫ L cosθ dω over all eyes = Fresnel's share of the sunlight, at its incidence.
        let sun = Vec3::new(0.3, 0.0, (1.0f32 - 0.09).sqrt());
        let calm = Ripples { slope: Vec2::ZERO, hidden: Vec3::new(0.002, 0.0, 0.002) };
        let (n, mut sum) = (900, 0.0);
        for i in 0..n {
            for j in 0..n {
                let (x, y) = ((i as f32 + 0.5) / n as f32 * 2.0 - 1.0, (j as f32 + 0.5) / n as f32 * 2.0 - 1.0);
                let square = 1.0 - x * x - y * y;
                if square > 0.01 {
                    // dω cosθ = dx dy.
                    sum += glitter(Vec3::new(x, y, square.sqrt()), sun, &calm) * 4.0 / (n * n) as f32;
                }
            }
        }
        let expected = fresnel(sun.z) * sun.z;
        assert!((sum / expected - 1.0).abs() < 0.03, "{sum} for {expected}");
    }

    #[test]
    fn slopes_are_drawn_as_their_facets_are_seen() {
        let ripples = Ripples { slope: Vec2::new(0.05, -0.1), hidden: Vec3::new(0.03, 0.01, 0.02) };
        for eye in [Vec3::new(0.99, 0.1, 0.08), Vec3::new(-0.3, 0.7, 0.4), Vec3::new(0.01, 0.0, 1.0)] {
            let eye = eye.normalize();
            // By brute force over a lattice of slopes.
            let (n, mut area, mut mean) = (400, 0.0f64, glam::DVec2::ZERO);
            for i in 0..n * n {
                let s = Vec2::new((i % n) as f32, (i / n) as f32) / n as f32 * 2.4 - 1.2;
                let facing = (eye.z - eye.truncate().dot(s)).max(0.0) * ripples.density(s) * (2.4 / n as f32).powi(2);
                area += f64::from(facing);
                mean += s.as_dvec2() * f64::from(facing);
            }
            mean /= area;
            assert!((f64::from(ripples.seen_from(eye)) / area - 1.0).abs() < 5e-3, "{eye}");
            // The sampled mean, over a lattice of quantiles.
            let quantile = |i: i32| {
                let (mut low, mut high) = (-6.0f32, 6.0f32);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if below(middle) < (i as f32 + 0.5) / 60.0 { low = middle } else { high = middle }
                }
                low
            };
            let points: Vec<f32> = (0..60).map(quantile).collect();
            let mut drawn = glam::DVec2::ZERO;
            for x in &points {
                for y in &points {
                    let s = ripples.seen_slope(eye, Vec2::new(*x, *y));
                    assert!(eye.z - eye.truncate().dot(s) > -1e-3, "{s} is turned away");
                    drawn += s.as_dvec2() / 3600.0;
                }
            }
            assert!((drawn - mean).length() < 4e-3, "{eye}: {drawn} for {mean}");
        }
    }

    #[test]
    fn lace_covers_as_much_as_it_should() {
        for cover in [0.03, 0.2, 0.6] {
            for footprint in [0.01, 0.3, 3.0] {
                let n = 160;
                let place = |i: i32| DVec2::new(f64::from(i % n) * 0.731, f64::from(i / n) * 0.593);
                let streaks = Streaks::of_wind(0.7, 15.0);
                let sum: f32 = (0..n * n).map(|i| lace(place(i), footprint, cover, streaks)).sum();
                let mean = sum / (n * n) as f32;
                assert!((mean - cover).abs() < 0.015 + 0.06 * cover, "{cover} at {footprint}: {mean}");
            }
        }
        for share in [0.001, 0.1, 0.5, 0.93] {
            assert!((below(quantile(share)) - share).abs() < 5e-4);
        }
    }
}
