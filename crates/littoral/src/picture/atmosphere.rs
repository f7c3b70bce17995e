//! Sun, sky and haze from one model of the air.
//!
//! Light is scattered by molecules (Rayleigh) and aerosol (Mie) and absorbed by ozone in spherical shells over the Earth.
//! Single scattering is marched along each ray; all higher orders are taken as isotropic and summed as a geometric series
//! from a small table. The phase functions are kept out of the tables, so that even the glow round the sun needs only a few
//! azimuths. One [`Sky`] serves as the sky behind everything and as the veil in front of it.
//!
//! Works this rests on: S. Hillaire, "A scalable and production ready sky and atmosphere rendering technique", Computer
//! Graphics Forum 39(4), 2020; E. Bruneton, F. Neyret, "Precomputed atmospheric scattering", EGSR 2008, and Bruneton's
//! revision of 2017 (the tables' coordinates; ozone's cross sections after A. Serdyuchenko et al., 2014); J. Hansen,
//! L. Travis, "Light scattering in planetary atmospheres", 1974 (Rayleigh's optical depth).

use super::spectrum::{SUNLIGHT, Spectrum};
use super::{Air, Sun};
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI};

/// Radius of the Earth (m).
pub const EARTH: f32 = 6_371_000.0;
/// Height at which the air ends (m).
const TOP: f32 = 100_000.0;
/// Scale heights of molecules and aerosol (m).
const RAYLEIGH_SCALE: f32 = 8_000.0;
const MIE_SCALE: f32 = 1_200.0;
/// Share of light that aerosol scatters rather than absorbs: between sea salt (0.99) and continental haze (0.9).
const MIE_ALBEDO: f32 = 0.94;
/// Mean cosine of aerosol scattering.
const MIE_G: f32 = 0.76;
/// Mean reflectance of the Earth below the sky.
const GROUND_ALBEDO: f32 = 0.12;

/// The air over the Earth and the sun above it.
pub struct Atmosphere {
    rayleigh: Spectrum,
    mie: Spectrum,
    ozone: Spectrum,
    sun_sine: f32,
    transmittance: Vec<Spectrum>,
    many: Vec<Spectrum>,
    /// Sunlight on a facing surface, by height.
    sunlight: Vec<Vec3>,
}

const T_HEIGHTS: usize = 48;
const T_ANGLES: usize = 192;
const M_HEIGHTS: usize = 24;
const M_ANGLES: usize = 32;
const S_HEIGHTS: usize = 256;

/// The Ångström exponent of mixed aerosol; towards fog (m) the drops grow, until they veil all colours alike (I. Kim, B. McArthur and E. Korevaar, "Comparison of laser
/// beam propagation at 785 nm and 1550 nm in fog and haze for optical wireless communications", 2001).
fn angstrom_exponent(visibility: f32) -> f32 {
    let km = visibility * 1e-3;
    if km < 1.0 { (km - 0.5).max(0.0) } else { (0.16 * km + 0.34).min(1.2) }
}

impl Atmosphere {
    /// Air of some visibility under a sun of some elevation.
    pub fn new(air: &Air, sun: &Sun) -> Atmosphere {
        // Hansen and Travis's column, spread over the scale height.
        let rayleigh = Spectrum::of(|nm| {
            let l2 = (nm * 1e-3).powi(-2);
            0.008_569 * l2 * l2 * (1.0 + 0.0113 * l2 + 0.000_13 * l2 * l2) / RAYLEIGH_SCALE
        });
        // Koschmieder: contrast 0.02 at the visibility.
        let visibility = air.visibility.clamp(500.0, 300_000.0) as f32;
        let haze = (3.912 / visibility - 0.0122e-3).max(1e-6);
        let exponent = angstrom_exponent(visibility);
        let mie = Spectrum::of(|nm| haze * (nm / 550.0).powf(-exponent));
        // 300 Dobson units in a layer of triangular profile about 25 km: 5.37e18 molecules per m³ at its peak.
        let cross = [1.527e-27, 1.582e-26, 7.752e-26, 2.139e-25, 4.266e-25, 5.019e-25, 2.662e-25, 1.209e-25f32];
        let ozone = Spectrum(cross.map(|c| (f64::from(c) * 5.37e18) as f32));
        let mut atmosphere = Atmosphere {
            rayleigh,
            mie,
            ozone,
            sun_sine: sun.elevation.sin() as f32,
            transmittance: Vec::new(),
            many: Vec::new(),
            sunlight: Vec::new(),
        };
        atmosphere.transmittance = (0..T_HEIGHTS * T_ANGLES)
            .into_par_iter()
            .map(|i| {
                let (r, mu) = transmittance_place(i % T_ANGLES, i / T_ANGLES);
                atmosphere.march_out(r, mu)
            })
            .collect();
        atmosphere.many = (0..M_HEIGHTS * M_ANGLES)
            .into_par_iter()
            .map(|i| {
                let (x, y) = ((i % M_ANGLES) as f32, (i / M_ANGLES) as f32);
                let sine = 2.0 * x / (M_ANGLES - 1) as f32 - 1.0;
                let height = (y / (M_HEIGHTS - 1) as f32).powi(2) * (TOP - 1.0);
                atmosphere.series(EARTH + height, sine)
            })
            .collect();
        atmosphere.sunlight = (0..S_HEIGHTS)
            .map(|i| {
                let height = (i as f32 / (S_HEIGHTS - 1) as f32).powi(2) * TOP;
                (SUNLIGHT * atmosphere.to_sun(height, atmosphere.sun_sine)).rgb().max(Vec3::ZERO)
            })
            .collect();
        atmosphere
    }

    /// Share of molecules, aerosol and ozone at a height (m).
    fn densities(&self, height: f32) -> (f32, f32, f32) {
        let h = height.max(0.0);
        let ozone = (1.0 - (h - 25_000.0).abs() / 15_000.0).max(0.0);
        ((-h / RAYLEIGH_SCALE).exp(), (-h / MIE_SCALE).exp(), ozone)
    }

    fn extinction(&self, (rayleigh, mie, ozone): (f32, f32, f32)) -> Spectrum {
        self.rayleigh * rayleigh + self.mie * mie + self.ozone * ozone
    }

    /// Share of light that survives from a point to space, integrated by trapezia.
    fn march_out(&self, r: f32, mu: f32) -> Spectrum {
        const STEPS: usize = 48;
        let end = distance_to_shell(r, mu, EARTH + TOP);
        let mut depth = Spectrum::default();
        let mut last = (0.0, self.extinction(self.densities(r - EARTH)));
        for i in 1..=STEPS {
            // Finer near the start, where the air is densest for rays that rise.
            let t = end * (i as f32 / STEPS as f32).powi(2);
            let here = self.extinction(self.densities(height_along(r, mu, t)));
            depth += (last.1 + here) * (0.5 * (t - last.0));
            last = (t, here);
        }
        depth.through()
    }

    /// Share of sunlight that reaches height (m), where the sun's centre has elevation of this sine: 0 when the Earth is
    /// in the way, in between while its disc sets.
    pub fn to_sun(&self, height: f32, sine: f32) -> Spectrum {
        let r = EARTH + height.clamp(0.0, TOP);
        let dip = -(1.0 - (EARTH / r).powi(2)).max(0.0).sqrt();
        let risen = ((sine - dip) / 0.0093 + 0.5).clamp(0.0, 1.0);
        if risen == 0.0 {
            return Spectrum::default();
        }
        let (x, y) = transmittance_lattice(r, sine.max(dip));
        bilinear(&self.transmittance, T_ANGLES, T_HEIGHTS, x, y) * (risen * risen * (3.0 - 2.0 * risen))
    }

    /// Light of all orders beyond the first, per unit of sunlight, arriving at a height (m) from all sides on average.
    fn many_orders(&self, height: f32, sine: f32) -> Spectrum {
        let x = (sine * 0.5 + 0.5) * (M_ANGLES - 1) as f32;
        let y = (height.clamp(0.0, TOP) / TOP).sqrt() * (M_HEIGHTS - 1) as f32;
        bilinear(&self.many, M_ANGLES, M_HEIGHTS, x, y)
    }

    /// Hillaire's ψ: second-order light at a point, over one minus what each further order keeps.
    fn series(&self, r: f32, sun_sine: f32) -> Spectrum {
        const SIDE: usize = 8;
        const STEPS: usize = 20;
        let sun = Vec3::new((1.0 - sun_sine * sun_sine).max(0.0).sqrt(), 0.0, sun_sine);
        let (mut second, mut kept) = (Spectrum::default(), Spectrum::default());
        for i in 0..SIDE * SIDE {
            let mu = 1.0 - 2.0 * ((i / SIDE) as f32 + 0.5) / SIDE as f32;
            let azimuth = 2.0 * PI * ((i % SIDE) as f32 + 0.5) / SIDE as f32;
            let flat = (1.0 - mu * mu).sqrt();
            let direction = Vec3::new(flat * azimuth.cos(), flat * azimuth.sin(), mu);
            let ground = distance_to_ground(r, mu);
            let end = ground.unwrap_or_else(|| distance_to_shell(r, mu, EARTH + TOP));
            let mut through = Spectrum::splat(1.0);
            for step in 0..STEPS {
                let (t0, t1) =
                    (end * (step as f32 / STEPS as f32).powi(2), end * ((step + 1) as f32 / STEPS as f32).powi(2));
                let t = 0.5 * (t0 + t1);
                let height = height_along(r, mu, t);
                let up = (Vec3::Z * r + direction * t).normalize();
                let densities = self.densities(height);
                let extinction = self.extinction(densities);
                let scattering = self.rayleigh * densities.0 + self.mie * (MIE_ALBEDO * densities.1);
                let survives = (extinction * (t1 - t0)).through();
                let weight = through * slab(extinction, survives, t1 - t0);
                second += weight * scattering * self.to_sun(height, up.dot(sun)) * (1.0 / (4.0 * PI));
                kept += weight * scattering;
                through = through * survives;
            }
            if ground.is_some() {
                let up = (Vec3::Z * r + direction * end).normalize();
                let sine = up.dot(sun);
                second += through * self.to_sun(0.0, sine) * (sine.max(0.0) * GROUND_ALBEDO / PI);
            }
        }
        let mean = 1.0 / (SIDE * SIDE) as f32;
        let mut sum = second * mean;
        for (s, k) in sum.0.iter_mut().zip(kept.0) {
            *s /= 1.0 - (k * mean).min(0.98);
        }
        sum
    }

    /// Sunlight by height.
    pub fn sunlight_table(&self) -> &[Vec3] {
        &self.sunlight
    }

    /// Sunlight on a surface facing the sun at a height (m): linear Rec. 709 (klx).
    pub fn sunlight(&self, height: f32) -> Vec3 {
        let at = (height.clamp(0.0, TOP) / TOP).sqrt() * (S_HEIGHTS - 1) as f32;
        let i = (at as usize).min(S_HEIGHTS - 2);
        self.sunlight[i].lerp(self.sunlight[i + 1], at - i as f32)
    }
}

/// ∫ e^(−extinction·t) dt over a step, given what survives it.
#[inline]
fn slab(extinction: Spectrum, survives: Spectrum, step: f32) -> Spectrum {
    Spectrum(std::array::from_fn(|i| {
        let e = extinction.0[i];
        if e * step > 1e-4 { (1.0 - survives.0[i]) / e } else { step }
    }))
}

/// Height over the ground after distance `t` from radius `r` along a ray of zenith cosine `mu`.
#[inline]
fn height_along(r: f32, mu: f32, t: f32) -> f32 {
    // √(r² + 2rμt + t²) − R without the cancellation that f32 suffers near the ground.
    let h = r - EARTH;
    let excess = h * (2.0 * EARTH + h) + 2.0 * r * mu * t + t * t;
    excess / ((EARTH * EARTH + excess).max(0.0).sqrt() + EARTH)
}

/// Distance from inside a shell of radius `shell` to it.
fn distance_to_shell(r: f32, mu: f32, shell: f32) -> f32 {
    let root = ((shell - r) * (shell + r) + (r * mu).powi(2)).max(0.0).sqrt();
    if mu > 0.0 { (shell - r) * (shell + r) / (root + r * mu).max(1e-6) } else { root - r * mu }
}

/// Distance to the ground, `None` for rays that miss it.
fn distance_to_ground(r: f32, mu: f32) -> Option<f32> {
    let h = r - EARTH;
    let below = (r * mu).powi(2) - h * (r + EARTH);
    (mu < 0.0 && below >= 0.0).then(|| h * (r + EARTH) / (-r * mu + below.sqrt()))
}

/// Radius and zenith cosine that a texel of the transmittance table stands for (Bruneton's coordinates: by distance to
/// the top, between its least and its greatest).
fn transmittance_place(x: usize, y: usize) -> (f32, f32) {
    let (u, v) = (x as f32 / (T_ANGLES - 1) as f32, y as f32 / (T_HEIGHTS - 1) as f32);
    let horizon = ((TOP + 2.0 * EARTH) * TOP).sqrt();
    let rho = horizon * v;
    let r = (rho * rho + EARTH * EARTH).sqrt();
    let (least, most) = (EARTH + TOP - r, rho + horizon);
    let d = least + u * (most - least);
    let mu = if d <= 0.0 { 1.0 } else { (horizon * horizon - rho * rho - d * d) / (2.0 * r * d) };
    (r, mu.clamp(-1.0, 1.0))
}

/// The inverse of [`transmittance_place`], in texels.
fn transmittance_lattice(r: f32, mu: f32) -> (f32, f32) {
    let horizon = ((TOP + 2.0 * EARTH) * TOP).sqrt();
    let h = r - EARTH;
    let rho = (h * (r + EARTH)).max(0.0).sqrt();
    let d = distance_to_shell(r, mu, EARTH + TOP);
    let (least, most) = (EARTH + TOP - r, rho + horizon);
    let u = ((d - least) / (most - least)).clamp(0.0, 1.0);
    (u * (T_ANGLES - 1) as f32, rho / horizon * (T_HEIGHTS - 1) as f32)
}

fn bilinear(table: &[Spectrum], columns: usize, rows: usize, x: f32, y: f32) -> Spectrum {
    let (x, y) = (x.clamp(0.0, (columns - 1) as f32), y.clamp(0.0, (rows - 1) as f32));
    let (i, j) = ((x as usize).min(columns - 2), (y as usize).min(rows - 2));
    let (u, v) = (x - i as f32, y - j as f32);
    let at = |i: usize, j: usize| table[j * columns + i];
    (at(i, j) * (1.0 - u) + at(i + 1, j) * u) * (1.0 - v) + (at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u) * v
}

/// What the air adds along a ray and what it lets through.
#[derive(Clone, Copy, Debug, Default)]
pub struct Veil {
    /// Radiance added: linear Rec. 709 (kcd/m²).
    pub light: Vec3,
    /// Share of each of red, green and blue let through.
    pub through: Vec3,
}

/// The sky and the veil of distance, seen from one height.
pub struct Sky {
    sun: Vec3,
    sun_flat: Vec3,
    /// For each azimuth, elevation and distance: Rayleigh, Mie and higher orders' light, without phase functions.
    light: Vec<[Vec3; 3]>,
    /// For each elevation and distance: the share let through.
    through: Vec<Vec3>,
    /// Radiance of the sun's disc (kcd/m²) above the air, spread over a softened edge.
    disc: Vec3,
    disc_cosine: f32,
    disc_softness: f32,
}

pub(super) const AZIMUTHS: usize = 16;
pub(super) const ELEVATIONS: usize = 160;
pub(super) const DISTANCES: usize = 40;
/// Distances of the slices (m) grow from here exponentially…
const NEAR_SLICE: f32 = 150.0;
/// … to here, beyond which nothing changes.
const FAR_SLICE: f32 = 1_300_000.0;

impl Sky {
    /// The sky as seen from `height` (m).
    pub fn new(atmosphere: &Atmosphere, sun: &Sun, sun_direction: Vec3, height: f32) -> Sky {
        let r = EARTH + height.clamp(1.0, TOP - 1.0);
        let sine = sun_direction.z;
        let sun_local = Vec3::new((1.0 - sine * sine).max(0.0).sqrt(), 0.0, sine);
        let white = SUNLIGHT.rgb();
        let columns: Vec<_> = (0..AZIMUTHS * ELEVATIONS)
            .into_par_iter()
            .map(|i| {
                let azimuth = PI * (i / ELEVATIONS) as f32 / (AZIMUTHS - 1) as f32;
                let elevation = row_elevation(i % ELEVATIONS);
                let (mu, flat) = elevation.sin_cos();
                let direction = Vec3::new(flat * azimuth.cos(), flat * azimuth.sin(), mu);
                march(atmosphere, r, direction, sun_local, white)
            })
            .collect();
        let light = columns.iter().flat_map(|c| c.iter().map(|s| s.0)).collect();
        let through = columns[..ELEVATIONS].iter().flat_map(|c| c.iter().map(|s| s.1)).collect();
        let radius = sun.angular_radius.clamp(1e-3, 0.2) as f32;
        let disc = white / (PI * radius * radius);
        Sky {
            sun: sun_direction,
            sun_flat: Vec3::new(sun_direction.x, sun_direction.y, 0.0).normalize_or(Vec3::Y),
            light,
            through,
            disc,
            disc_cosine: radius.cos(),
            disc_softness: 0.1 * (1.0 - radius.cos()),
        }
    }

    /// What the air does along the unit vector `direction` over `distance` (m); infinite for the whole sky.
    pub fn veil(&self, direction: Vec3, distance: f32) -> Veil {
        let flat = direction.truncate().length();
        let cosine = if flat > 1e-6 { direction.truncate().dot(self.sun_flat.truncate()) / flat } else { 1.0 };
        let azimuth = cosine.clamp(-1.0, 1.0).acos() / PI * (AZIMUTHS - 1) as f32;
        let row = elevation_row(direction.z.clamp(-1.0, 1.0).asin());
        let slice = distance_slice(distance);
        let (a, e, d) = (
            (azimuth as usize).min(AZIMUTHS - 2),
            (row as usize).min(ELEVATIONS - 2),
            (slice as usize).min(DISTANCES - 1),
        );
        let (fa, fe, fd) = (azimuth - a as f32, row - e as f32, slice - d as f32);
        let d1 = (d + 1).min(DISTANCES);
        let mut light = [Vec3::ZERO; 3];
        let mut through = Vec3::ZERO;
        for (ee, we) in [(e, 1.0 - fe), (e + 1, fe)] {
            for (dd, wd) in [(d, 1.0 - fd), (d1, fd)] {
                for (aa, wa) in [(a, 1.0 - fa), (a + 1, fa)] {
                    let cell = &self.light[(aa * ELEVATIONS + ee) * (DISTANCES + 1) + dd];
                    for (sum, value) in light.iter_mut().zip(cell) {
                        *sum += *value * (wa * we * wd);
                    }
                }
                through += self.through[ee * (DISTANCES + 1) + dd] * (we * wd);
            }
        }
        let cosine = direction.dot(self.sun);
        let light = light[0] * rayleigh_phase(cosine) + light[1] * mie_phase(cosine) + light[2];
        Veil { light: light.max(Vec3::ZERO), through: through.max(Vec3::ZERO) }
    }

    /// The tables of light and of what is let through.
    pub fn into_tables(self) -> (Vec<[Vec3; 3]>, Vec<Vec3>) {
        (self.light, self.through)
    }

    /// Radiance of the sun's disc above the air (kcd/m²).
    pub fn disc_radiance(&self) -> Vec3 {
        self.disc
    }

    /// Radiance of the sky in a direction (kcd/m²), without the sun's disc.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.veil(direction, f32::INFINITY).light
    }

    /// Radiance of the sun's disc in a direction (kcd/m²), zero beside it.
    pub fn sun_disc(&self, direction: Vec3) -> Vec3 {
        let inside = (direction.dot(self.sun) - self.disc_cosine) / self.disc_softness;
        if inside <= 0.0 || direction.z < -0.02 {
            return Vec3::ZERO;
        }
        self.disc * self.veil(direction, f32::INFINITY).through * inside.min(1.0)
    }
}

/// Light and transmittance up to each slice along a ray.
fn march(air: &Atmosphere, r: f32, direction: Vec3, sun: Vec3, white: Vec3) -> Vec<([Vec3; 3], Vec3)> {
    let mut sums = [Spectrum::default(); 3];
    let mut through = Spectrum::splat(1.0);
    let mut slices = Vec::with_capacity(DISTANCES + 1);
    let leaves = distance_to_shell(r, direction.z, EARTH + TOP);
    let mut last = 0.0f32;
    let emit = |sums: &[Spectrum; 3], through: Spectrum| {
        (sums.map(|s| (s * SUNLIGHT).rgb()), (through * SUNLIGHT).rgb() / white)
    };
    slices.push(emit(&sums, through));
    for slice in 1..=DISTANCES {
        let end = slice_distance(slice).min(leaves);
        let parts = (((end - last) / 12_000.0).ceil() as usize).clamp(2, 6);
        let step = (end - last) / parts as f32;
        if step > 0.0 {
            for part in 0..parts {
                let t = last + step * (part as f32 + 0.5);
                let height = height_along(r, direction.z, t);
                let up = (Vec3::Z * r + direction * t).normalize();
                let densities = air.densities(height);
                let extinction = air.extinction(densities);
                let survives = (extinction * step).through();
                let weight = through * slab(extinction, survives, step);
                let sine = up.dot(sun);
                let lit = weight * air.to_sun(height, sine);
                let (rayleigh, mie) = (air.rayleigh * densities.0, air.mie * (MIE_ALBEDO * densities.1));
                sums[0] += lit * rayleigh;
                sums[1] += lit * mie;
                sums[2] += weight * (rayleigh + mie) * air.many_orders(height, sine);
                through = through * survives;
            }
            last = end;
        }
        slices.push(emit(&sums, through));
    }
    slices
}

fn slice_distance(slice: usize) -> f32 {
    let k = (FAR_SLICE / NEAR_SLICE + 1.0).ln() / DISTANCES as f32;
    NEAR_SLICE * ((k * slice as f32).exp() - 1.0)
}

fn distance_slice(distance: f32) -> f32 {
    let k = (FAR_SLICE / NEAR_SLICE + 1.0).ln() / DISTANCES as f32;
    ((distance.max(0.0) / NEAR_SLICE + 1.0).ln() / k).min(DISTANCES as f32)
}

/// Rows crowd about the horizon, where the sky changes fastest.
fn row_elevation(row: usize) -> f32 {
    let w = 2.0 * row as f32 / (ELEVATIONS - 1) as f32 - 1.0;
    w * w.abs() * FRAC_PI_2
}

fn elevation_row(elevation: f32) -> f32 {
    let w = (elevation.abs() / FRAC_PI_2).sqrt().copysign(elevation);
    (w * 0.5 + 0.5) * (ELEVATIONS - 1) as f32
}

fn rayleigh_phase(cosine: f32) -> f32 {
    3.0 / (16.0 * PI) * (1.0 + cosine * cosine)
}

/// Cornette and Shanks's phase function.
fn mie_phase(cosine: f32) -> f32 {
    let g2 = MIE_G * MIE_G;
    let base = (1.0 + g2 - 2.0 * MIE_G * cosine).max(1e-4);
    3.0 / (8.0 * PI) * (1.0 - g2) * (1.0 + cosine * cosine) / ((2.0 + g2) * base * base.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fog_veils_all_colours_alike_and_haze_the_blue_first() {
        let ratio = |visibility| {
            let rgb = noon(visibility).0.mie.rgb();
            rgb.z / rgb.x
        };
        let even = Spectrum::of(|_| 1.0).rgb();
        assert!((ratio(500.0) / (even.z / even.x) - 1.0).abs() < 1e-4, "{}", ratio(500.0));
        assert!(ratio(500.0) < ratio(2_000.0) && ratio(2_000.0) < ratio(10_000.0));
        let clear = ratio(10_000.0);
        assert!((ratio(100_000.0) / clear - 1.0).abs() < 1e-4, "clear days are as they were");
    }

    fn noon(visibility: f64) -> (Atmosphere, Sun) {
        let sun = Sun::new(0.0, FRAC_PI_2 as f64);
        (Atmosphere::new(&Air { visibility, ..Air::default() }, &sun), sun)
    }

    #[test]
    fn a_vertical_path_has_its_closed_form() {
        let (air, _) = noon(60_000.0);
        for height in [0.0f32, 1500.0, 8000.0] {
            let table = air.to_sun(height, 1.0);
            for band in 0..8 {
                let column = |scale: f32| scale * ((-height / scale).exp() - (-TOP / scale).exp());
                let depth = air.rayleigh.0[band] * column(RAYLEIGH_SCALE)
                    + air.mie.0[band] * column(MIE_SCALE)
                    + air.ozone.0[band] * 15_000.0;
                let expected = (-depth).exp();
                assert!((table.0[band] - expected).abs() < 4e-3, "{} for {expected} at {height}", table.0[band]);
            }
        }
    }

    #[test]
    fn table_coordinates_are_inverse() {
        for y in 0..T_HEIGHTS {
            for x in (0..T_ANGLES).step_by(7) {
                let (r, mu) = transmittance_place(x, y);
                let (u, v) = transmittance_lattice(r, mu);
                // At the top of the air the least and the greatest distance to it bracket little but rounding.
                assert!((v - y as f32).abs() < 0.1, "row {y} came back as {v}");
                assert!((u - x as f32).abs() < 1.0, "column {x} of row {y} came back as {u}");
            }
        }
        for row in 0..ELEVATIONS {
            assert!((elevation_row(row_elevation(row)) - row as f32).abs() < 1e-2);
        }
        for slice in 0..=DISTANCES {
            assert!((distance_slice(slice_distance(slice)) - slice as f32).abs() < 1e-2);
        }
    }

    #[test]
    fn phase_functions_are_normalised() {
        let mean = |phase: fn(f32) -> f32| -> f32 {
            (0..20_000).map(|i| phase(1.0 - (i as f32 + 0.5) * 1e-4) * 1e-4 * 2.0 * PI).sum()
        };
        assert!((mean(rayleigh_phase) - 1.0).abs() < 1e-3);
        assert!((mean(mie_phase) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_veil_grows_to_the_whole_sky_and_no_further() {
        let sun = Sun::new(0.0, 0.4);
        let air = Atmosphere::new(&Air::default(), &sun);
        let sky = Sky::new(&air, &sun, sun.direction(0.0).as_vec3(), 50.0);
        for elevation in [0.002f32, 0.05, 0.7] {
            let direction = Vec3::new(elevation.cos(), 0.0, elevation.sin());
            let mut last = Veil { light: Vec3::ZERO, through: Vec3::ONE };
            for distance in [0.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, f32::INFINITY] {
                let veil = sky.veil(direction, distance);
                assert!(veil.light.cmpge(last.light * 0.999).all(), "light at {distance}");
                assert!(veil.through.cmple(last.through * 1.001).all(), "share at {distance}");
                last = veil;
            }
        }
        // Koschmieder: along a level path of the visibility 2 % remain.
        let level = sky.veil(Vec3::X, 40_000.0).through.y;
        assert!((0.01..0.04).contains(&level), "{level}");
    }

    #[test]
    fn no_light_is_made_from_nothing() {
        // Sun in the zenith: what reaches the ground from sun and sky is less than what arrives, and not much less.
        let (air, sun) = noon(60_000.0);
        let sky = Sky::new(&air, &sun, Vec3::Z, 1.0);
        let mut irradiance = Vec3::ZERO;
        let (rings, spokes) = (64, 16);
        for i in 0..rings {
            let sine = (i as f32 + 0.5) / rings as f32;
            for j in 0..spokes {
                let azimuth = (j as f32 + 0.5) / spokes as f32 * 2.0 * PI;
                let flat = (1.0 - sine * sine).sqrt();
                let direction = Vec3::new(flat * azimuth.cos(), flat * azimuth.sin(), sine);
                irradiance += sky.radiance(direction) * sine * (2.0 * PI / (rings * spokes) as f32);
            }
        }
        let total = irradiance + air.sunlight(0.0);
        let arrives = SUNLIGHT.rgb();
        // Light reflected by the ground and scattered back adds a little to blue.
        assert!(total.cmple(arrives).all(), "{total} of {arrives}");
        assert!(total.cmpge(arrives * 0.75).all(), "{total} of {arrives}");
        // Clear-sky diffuse illuminance under a high sun: 8 to 25 klx, and blue.
        let klx = 0.2126 * irradiance.x + 0.7152 * irradiance.y + 0.0722 * irradiance.z;
        assert!((6.0..28.0).contains(&klx), "{klx} klx");
        assert!(irradiance.z > 1.3 * irradiance.x, "{irradiance}");
    }

    #[test]
    fn the_setting_sun_reddens() {
        let ratio = |degrees: f64| {
            let sun = Sun::new(0.0, degrees.to_radians());
            let light = Atmosphere::new(&Air::default(), &sun).sunlight(0.0);
            light.x / light.z.max(1e-6)
        };
        assert!(ratio(2.0) > 2.0 * ratio(10.0) && ratio(10.0) > 1.3 * ratio(60.0));
        let sun = Sun::new(0.0, -0.2);
        assert_eq!(Atmosphere::new(&Air::default(), &sun).sunlight(0.0), Vec3::ZERO);
    }
}
