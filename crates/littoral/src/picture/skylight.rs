//! Light from the sky and from the land around, at every place.
//!
//! What lights a shaded slope is the part of the sky that it sees and the sunlit ground that it faces. Both vary slowly
//! over the land, so they are found once on a grid: the horizon in sixteen directions, marched over a pyramid of mean heights in
//! growing steps; then the light arriving from everywhere, sky above the horizon and ground below it, as nine spherical
//! harmonics, whose irradiance on any normal is a short polynomial. Sunlight sent on by the ground takes one bounce.
//!
//! Works this rests on: N. Max, "Horizon mapping", The Visual Computer 4, 1988; R. Ramamoorthi, P. Hanrahan, "An efficient
//! representation for irradiance environment maps", SIGGRAPH 2001.

use super::atmosphere::{Atmosphere, Sky};
use super::grain::step;
use super::ground::Ground;
use super::tables::Lattice;
use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

const DIRECTIONS: usize = 16;
/// Steps of elevation in the tables, from straight down to straight up.
const STEPS: usize = 96;
/// Most grid points along a side.
const MOST: usize = 256;

/// Light arriving from all sides: nine spherical harmonics of radiance (kcd/m²), ready for [`irradiance`].
pub type Light = [Vec3; 9];

/// Light over the land.
pub struct Skylight {
    origin: DVec2,
    step: DVec2,
    columns: usize,
    rows: usize,
    lights: Vec<Light>,
    /// How much of the sun's disc each grid point sees.
    sunny: Vec<f32>,
    /// Light over an open plain, for the mist and the sea.
    pub open: Light,
}

/// The horizon at a grid point.
struct Horizon {
    /// In each direction: elevation as a step of the tables, and the distance it lies at (m).
    ring: [(f32, f32); DIRECTIONS],
    sunny: f32,
    normal: Vec3,
    height: f32,
}

impl Skylight {
    /// Finds the light over `ground`, which throws back `albedo` on average.
    pub fn new(ground: &Ground, air: &Atmosphere, sky: &Sky, sun: Vec3, albedo: Vec3) -> Skylight {
        let land = &ground.land;
        let raster = land.raster();
        let most = raster.columns().max(raster.rows()).min(MOST);
        let step = DVec2::splat(land.extent().max_element() / (most - 1) as f64).max(raster.spacing());
        let columns = (land.extent().x / step.x).ceil() as usize + 1;
        let rows = (land.extent().y / step.y).ceil() as usize + 1;
        let origin = land.origin();
        let place = |i: usize| origin + step * DVec2::new((i % columns) as f64, (i / columns) as f64);
        let (around, towards) = (Steps::new(ground, 1.0, 1.55), Steps::new(ground, 1.5, 1.22));
        let fineness = step.min_element() as f32;
        let horizons: Vec<Horizon> = (0..columns * rows)
            .into_par_iter()
            .map(|i| horizon(ground, place(i), fineness, sun, &around, &towards))
            .collect();
        let tables = Tables::new(sky);
        let open = tables.open(albedo, air.sunlight(0.0) * sun.z.max(0.0));
        let sky_up = tables.sky_up;
        // What the ground at each point throws back, before its albedo.
        let sent: Vec<Vec3> = horizons
            .iter()
            .map(|h| {
                let seen =
                    h.ring.iter().map(|r| 1.0 - step_elevation(r.0).max(0.0).sin()).sum::<f32>() / DIRECTIONS as f32;
                air.sunlight(h.height) * (h.normal.dot(sun).max(0.0) * h.sunny) + sky_up * seen
            })
            .collect();
        let mut grid = Skylight {
            origin,
            step,
            columns,
            rows,
            lights: Vec::new(),
            sunny: horizons.iter().map(|h| h.sunny).collect(),
            open,
        };
        grid.lights = (0..columns * rows)
            .into_par_iter()
            .map(|i| {
                let h = &horizons[i];
                let mut light = Light::default();
                for (k, &(top, distance)) in h.ring.iter().enumerate() {
                    let far = place(i) + direction(k).as_dvec2() * f64::from(distance);
                    let bounce = (grid.blend(&sent, far) * 0.5 + sent[i] * 0.5) * albedo / PI;
                    tables.add(&mut light, k, top, bounce);
                }
                light
            })
            .collect();
        grid
    }

    /// The light at the grid's points.
    pub fn lattice(&self) -> Lattice<Light> {
        let Skylight { origin, step, columns, rows, .. } = *self;
        Lattice { columns, rows, origin, spacing: step, values: self.lights.clone() }
    }

    /// Light arriving at a world position (m).
    pub fn at(&self, at: DVec2) -> Light {
        let ([a, b, c, d], f) = self.corners(at);
        let (wa, wb, wc, wd) = ((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
        let (a, b, c, d) = (&self.lights[a], &self.lights[b], &self.lights[c], &self.lights[d]);
        std::array::from_fn(|i| a[i] * wa + b[i] * wb + c[i] * wc + d[i] * wd)
    }

    /// Light arriving at a height (m) above the ground there. The grid knows the ground's horizon; what rises over the ground by a good part of the grid's step sees
    /// past the relief that hides the sky from it.
    pub fn above(&self, at: DVec2, height: f32) -> Light {
        let free = step(0.0, Skylight::CLEAR * self.step.max_element() as f32, height);
        let low = self.at(at);
        std::array::from_fn(|i| low[i].lerp(self.open[i], free))
    }

    /// Height from which on nothing near hides the sky, in steps of the grid.
    const CLEAR: f32 = 0.3;

    /// How much of the sun's disc is seen from the ground at a world position (m), as far as the grid knows.
    pub fn sunny(&self, at: DVec2) -> f32 {
        let ([a, b, c, d], f) = self.corners(at);
        let s = &self.sunny;
        let (south, north) = (s[a] + (s[b] - s[a]) * f.x, s[c] + (s[d] - s[c]) * f.x);
        south + (north - south) * f.y
    }

    fn blend(&self, values: &[Vec3], at: DVec2) -> Vec3 {
        let ([a, b, c, d], f) = self.corners(at);
        values[a].lerp(values[b], f.x).lerp(values[c].lerp(values[d], f.x), f.y)
    }

    fn corners(&self, at: DVec2) -> ([usize; 4], Vec2) {
        let last = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64);
        let p = ((at - self.origin) / self.step).clamp(DVec2::ZERO, last);
        let (i, j) = ((p.x as usize).min(self.columns - 2), (p.y as usize).min(self.rows - 2));
        let base = j * self.columns + i;
        let f = Vec2::new((p.x - i as f64) as f32, (p.y - j as f64) as f32);
        ([base, base + 1, base + self.columns, base + self.columns + 1], f)
    }
}

fn direction(k: usize) -> Vec2 {
    let (s, c) = (2.0 * PI * (k as f32 + 0.5) / DIRECTIONS as f32).sin_cos();
    Vec2::new(c, s)
}

/// How far a march looks, step by step: distance (m) and the level of the pyramid to look at.
struct Steps(Vec<(f32, usize)>);

impl Steps {
    fn new(ground: &Ground, start: f32, growth: f32) -> Steps {
        let reach = ground.land.extent().length() as f32;
        let first = start * ground.spacing();
        let distances = std::iter::successors(Some(first), |t| Some(t * growth)).take_while(|t| *t < reach);
        Steps(distances.map(|t| (t, ground.level_of(0.35 * t))).collect())
    }
}

fn horizon(ground: &Ground, at: DVec2, fineness: f32, sun: Vec3, around: &Steps, towards: &Steps) -> Horizon {
    let surface = ground.surface(at, fineness);
    // The greatest tangent of elevation along a direction, and where.
    let raster = ground.land.raster();
    let place = ((at - ground.land.origin()) / raster.spacing()).as_vec2();
    let per_metre = (1.0 / raster.spacing()).as_vec2();
    let march = |along: Vec2, steps: &Steps| {
        let stride = along * per_metre;
        let (mut tangent, mut far) = (surface.slope.dot(along), ground.spacing());
        for &(t, level) in &steps.0 {
            let rise = (ground.mean(place + stride * t, level) - surface.height) / t;
            if rise > tangent {
                (tangent, far) = (rise, t);
            }
        }
        (tangent, far)
    };
    let ring = std::array::from_fn(|k| {
        let (tangent, far) = march(direction(k), around);
        (elevation_step(tangent.atan()), far)
    });
    let (tangent, _) = march(sun.truncate().normalize_or(Vec2::X), towards);
    let elevation = sun.z.clamp(-1.0, 1.0).asin();
    let sunny = ((elevation - tangent.atan()) / 0.03 + 0.5).clamp(0.0, 1.0);
    let normal = Vec3::new(-surface.slope.x, -surface.slope.y, 1.0).normalize();
    Horizon { ring, sunny, normal, height: surface.height }
}

fn step_elevation(step: f32) -> f32 {
    (step / STEPS as f32 - 0.5) * PI
}

fn elevation_step(elevation: f32) -> f32 {
    (elevation / PI + 0.5) * STEPS as f32
}

/// Harmonics of the sky, and of light of one everywhere, summed from straight down up to each step of elevation.
struct Tables {
    sky: Vec<[Light; STEPS + 1]>,
    one: Vec<[[f32; 9]; STEPS + 1]>,
    sky_up: Vec3,
}

impl Tables {
    fn new(sky: &Sky) -> Tables {
        let mut sky_up = Vec3::ZERO;
        let (mut light, mut one) = (Vec::new(), Vec::new());
        for k in 0..DIRECTIONS {
            let flat = direction(k);
            let mut lights = [Light::default(); STEPS + 1];
            let mut ones = [[0.0; 9]; STEPS + 1];
            for s in 0..STEPS {
                let middle = step_elevation(s as f32 + 0.5);
                let (z, c) = middle.sin_cos();
                let toward = Vec3::new(flat.x * c, flat.y * c, z);
                let solid = (2.0 * PI / DIRECTIONS as f32)
                    * (step_elevation((s + 1) as f32).sin() - step_elevation(s as f32).sin());
                // Below the level horizon and yet unhidden lies far land or sea under haze: darker than the sky above it.
                let radiance = match middle > 0.0 {
                    true => sky.radiance(toward),
                    false => sky.radiance(Vec3::new(flat.x, flat.y, 0.02).normalize()) * 0.5,
                };
                sky_up += radiance * (z.max(0.0) * solid);
                let basis = harmonics(toward);
                for i in 0..9 {
                    lights[s + 1][i] = lights[s][i] + radiance * (basis[i] * solid);
                    ones[s + 1][i] = ones[s][i] + basis[i] * solid;
                }
            }
            light.push(lights);
            one.push(ones);
        }
        Tables { sky: light, one, sky_up }
    }

    /// Adds the light of direction `k`: the sky above step `top`, `bounce` below it.
    fn add(&self, light: &mut Light, k: usize, top: f32, bounce: Vec3) {
        let top = top.clamp(0.0, STEPS as f32 - 0.001);
        let (s, f) = (top as usize, top.fract());
        let (sky, one) = (&self.sky[k], &self.one[k]);
        for i in 0..9 {
            let below = sky[s][i].lerp(sky[s + 1][i], f);
            let ground = one[s][i] + (one[s + 1][i] - one[s][i]) * f;
            light[i] += sky[STEPS][i] - below + bounce * ground;
        }
    }

    /// Light over a plain under the whole sky.
    fn open(&self, albedo: Vec3, sunlight: Vec3) -> Light {
        let mut light = Light::default();
        for k in 0..DIRECTIONS {
            self.add(&mut light, k, elevation_step(0.0), (sunlight + self.sky_up) * albedo / PI);
        }
        light
    }
}

/// The nine real spherical harmonics of degree 0 to 2.
fn harmonics(d: Vec3) -> [f32; 9] {
    [
        0.282_095,
        0.488_603 * d.y,
        0.488_603 * d.z,
        0.488_603 * d.x,
        1.092_548 * d.x * d.y,
        1.092_548 * d.y * d.z,
        0.315_392 * (3.0 * d.z * d.z - 1.0),
        1.092_548 * d.x * d.z,
        0.546_274 * (d.x * d.x - d.y * d.y),
    ]
}

/// Irradiance (klx) of a light on a surface of this normal: each degree weighed by the cosine lobe's own harmonic.
pub fn irradiance(light: &Light, normal: Vec3) -> Vec3 {
    const WEIGHTS: [f32; 9] = {
        let (a, b, c) = (PI, 2.0 * PI / 3.0, PI / 4.0);
        [a, b, b, b, c, c, c, c, c]
    };
    let basis = harmonics(normal);
    let mut sum = Vec3::ZERO;
    for i in 0..9 {
        sum += light[i] * (basis[i] * WEIGHTS[i]);
    }
    sum.max(Vec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_gives_pi_times_its_radiance_everywhere() {
        let mut light = Light::default();
        let count = 20_000;
        for i in 0..count {
            // A spiral that covers the sphere evenly.
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let azimuth = i as f32 * 2.399_963;
            let flat = (1.0 - z * z).sqrt();
            let basis = harmonics(Vec3::new(flat * azimuth.cos(), flat * azimuth.sin(), z));
            for (sum, b) in light.iter_mut().zip(basis) {
                *sum += Vec3::splat(b * 4.0 * PI / count as f32);
            }
        }
        for normal in [Vec3::Z, Vec3::X, Vec3::new(0.6, -0.48, 0.64)] {
            assert!((irradiance(&light, normal) - PI).abs().max_element() < 2e-2);
        }
    }
}
