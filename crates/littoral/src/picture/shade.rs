//! From what a ray meets to the light it brings.

use super::grain::step;
use super::natural::{Material, natural};
use super::sampler::Sampler;
use super::sea::{fresnel, glitter, refract, ripples};
use super::skylight::irradiance;
use super::stage::{HIGHEST_EYE, Lens, Stage, purpose};
use super::Style;
use crate::raycast::Hit;
use crate::space::Ray;
use glam::{DVec2, DVec3, Vec3};
use std::f32::consts::PI;

/// What lies ahead on a ray.
pub enum Ahead {
    /// Nothing.
    Sky,
    /// Mist beyond the land.
    Mist {
        /// Where (m).
        position: DVec3,
    },
    /// The water's surface.
    Water {
        /// Where (m).
        position: DVec3,
    },
    /// The ground.
    Ground {
        /// Where (m).
        position: DVec3,
        /// Upward unit normal of the exact surface.
        normal: Vec3,
    },
}

/// The light of one ray, but for what shadow and mirror rays will find.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shaded {
    /// Light that needs no further ray (kcd/m²).
    pub light: Vec3,
    /// Light of the sun, if `shadow` meets nothing.
    pub sunlit: Vec3,
    /// Towards the sun.
    pub shadow: Option<Ray>,
    /// What is seen in the water, and how much of it comes back.
    pub mirror: Option<Ray>,
    /// Share of the mirrored light that comes back.
    pub mirror_share: f32,
    /// Added by the air on the way to the eye.
    pub veil: Vec3,
    /// Let through by it.
    pub through: Vec3,
    /// Whether nothing but sky is seen.
    pub sky: bool,
}

impl Stage<'_> {
    /// The light that comes from `ahead` along `direction` (unit, away from the eye).
    pub(super) fn shade(&self, lens: &Lens, direction: Vec3, ahead: &Ahead, sampler: Sampler, index: u32) -> Shaded {
        let (mut shaded, position) = match ahead {
            Ahead::Sky => {
                let light = lens.sky.radiance(direction) + lens.sky.sun_disc(direction);
                return Shaded { light, through: Vec3::ONE, sky: true, ..Shaded::default() };
            }
            Ahead::Mist { position } => (Shaded { light: self.mist, ..Shaded::default() }, *position),
            Ahead::Water { position } => (self.water(lens, direction, *position, sampler, index), *position),
            Ahead::Ground { position, normal } => {
                (self.ground(lens, direction, *position, *normal, sampler, index), *position)
            }
        };
        shaded.through = Vec3::ONE;
        if self.scene.air.veils_distance {
            let mut distance = (position - lens.eye).length();
            if lens.eye.z > HIGHEST_EYE {
                distance = distance.min((HIGHEST_EYE - position.z) / f64::from(-direction.z).max(1e-3));
            }
            let veil = lens.sky.veil(direction, distance as f32);
            (shaded.veil, shaded.through) = (veil.light, veil.through);
        }
        shaded
    }

    /// Width of a pixel on something at `position` whose normal makes this cosine with the eye (m). Slanted pixels are long;
    /// the samples within them see to that in part.
    fn footprint(&self, lens: &Lens, position: DVec3, cosine: f32) -> f32 {
        let across = (position - lens.eye).length() as f32 * lens.pixel;
        (across * (1.0 / cosine.max(0.02)).sqrt() * 0.8).max(1e-4)
    }

    /// A direction to a random point of the sun's disc.
    fn to_sun(&self, sampler: Sampler, index: u32) -> Vec3 {
        let across = self.sun.any_orthonormal_vector();
        let disc = sampler.disc(index, purpose::SUN) * self.scene.sun.angular_radius as f32;
        (self.sun + across * disc.x + self.sun.cross(across) * disc.y).normalize()
    }

    fn ground(&self, lens: &Lens, direction: Vec3, position: DVec3, exact: Vec3, sampler: Sampler, index: u32) -> Shaded {
        let at = position.truncate();
        let known = self.ground.known(at);
        if known == 0.0 {
            return Shaded { light: self.mist, ..Shaded::default() };
        }
        let footprint = self.footprint(lens, position, -direction.dot(exact));
        let surface = self.ground.surface(at, footprint);
        let material = self.material(position, &surface, footprint);
        let smooth = Vec3::new(-surface.slope.x, -surface.slope.y, 1.0).normalize();
        let light = self.skylight.at(at);
        let sky = irradiance(&light, material.normal) * material.openness;
        let mut shaded = Shaded { light: material.albedo / PI * sky, ..Shaded::default() };
        let to_sun = self.to_sun(sampler, index);
        // Slopes that turn from the sun hide their own relief from it.
        let facing = material.normal.dot(to_sun).max(0.0) * step(-0.02, 0.12, smooth.dot(to_sun));
        if facing > 0.0 {
            let sunlight = self.air.sunlight(position.z as f32) * facing;
            let spacing = f64::from(self.ground.spacing());
            let lift = 0.015 * spacing + 1e-4 * (position - lens.eye).length();
            shaded.sunlit = material.albedo / PI * sunlight * (0.4 + 0.6 * material.openness);
            shaded.shadow = Some(Ray::new(position + exact.as_dvec3() * lift, to_sun.as_dvec3()));
        }
        if material.wet > 0.0 {
            let mirrored = direction - 2.0 * direction.dot(smooth) * smooth;
            let share = fresnel(-direction.dot(smooth)) * material.wet * 0.6;
            shaded.light += share * self.sky.radiance(Vec3::new(mirrored.x, mirrored.y, mirrored.z.max(0.02)).normalize());
        }
        if known < 1.0 {
            shaded.light = self.mist.lerp(shaded.light, known);
            shaded.sunlit *= known;
        }
        shaded
    }

    fn material(&self, position: DVec3, surface: &super::ground::Surface, footprint: f32) -> Material {
        let water = self.scene.water.filter(|w| w.covers(position.truncate()) || position.z < w.level + 15.0);
        match self.scene.style {
            Style::Natural | Style::Image | Style::Tint | Style::Relief => {
                let level = water.map(|w| w.level as f32);
                natural(position, surface, self.ground.spacing(), footprint, level, &self.scene.climate)
            }
        }
    }

    fn water(&self, lens: &Lens, direction: Vec3, position: DVec3, sampler: Sampler, index: u32) -> Shaded {
        let at = position.truncate();
        let eye = -direction;
        let footprint = self.footprint(lens, position, eye.z);
        let ripples = ripples(at, footprint);
        let normal_of = |slope: glam::Vec2| Vec3::new(-slope.x, -slope.y, 1.0).normalize();
        let shown = normal_of(ripples.slope);
        let facet = normal_of(ripples.slope + ripples.variance.sqrt() * sampler.normal(index, purpose::RIPPLE));
        let facet = if facet.dot(eye) > 0.02 { facet } else { Vec3::Z };
        let share = fresnel(facet.dot(eye));
        let mut mirrored = 2.0 * facet.dot(eye) * facet - eye;
        // A ray thrown down into the next ripple comes up again, a little higher.
        mirrored.z = if mirrored.z < 0.0 { 0.02 - 0.5 * mirrored.z } else { mirrored.z.max(0.004) };
        let mirror = Ray::new(position + DVec3::Z * 0.02, mirrored.normalize().as_dvec3());

        // Into the water, to where the bent ray meets the bed.
        let within = if shown.dot(eye) > 0.02 { refract(direction, shown) } else { refract(direction, Vec3::Z) };
        let down = (-within.z).max(0.3);
        let aside = within.truncate() / down;
        let mut below = at;
        let mut depth = self.depth(at);
        for _ in 0..3 {
            below = at + aside.as_dvec2() * f64::from(depth.min(60.0));
            depth = 0.5 * (depth + self.depth(below));
        }
        let sun_within = -refract(-self.sun, Vec3::Z);
        let open = irradiance(&self.skylight.open, Vec3::Z);
        let sky_below = open * 0.93;
        let sun_below = self.air.sunlight(0.0) * (self.sun.z.max(0.0) * (1.0 - fresnel(self.sun.z)));
        let bed = if depth < 45.0 {
            let surface = self.ground.surface(below, footprint);
            let bed_at = below.extend(position.z - f64::from(depth));
            let material = self.material(bed_at, &surface, footprint);
            let facing = (material.normal.dot(sun_within) / sun_within.z.max(0.2)).clamp(0.3, 1.5);
            material.albedo * facing
        } else {
            Vec3::splat(0.1)
        };
        let leaves = (1.0 - share) / 0.98;
        let known = self.ground.known(below);
        let bed = Vec3::splat(0.1).lerp(bed, known);
        let radiance = |irradiance: Vec3| self.depths.radiance(depth, sun_within.z.max(0.5), down, irradiance, bed) * leaves;
        // The last film of water mirrors no more than wet sand.
        let film = step(0.0, 0.05, depth);
        let mut shaded = Shaded {
            light: radiance(sky_below),
            mirror: Some(mirror),
            mirror_share: share * (0.5 + 0.5 * film),
            ..Shaded::default()
        };
        if self.sun.z > 0.0 {
            let sunlight = self.air.sunlight(0.0);
            shaded.sunlit = radiance(sun_below) + sunlight * glitter(eye, self.sun, &ripples) * film;
            let to_sun = self.to_sun(sampler, index);
            shaded.shadow = Some(Ray::new(position + DVec3::Z * 0.02, to_sun.as_dvec3()));
        }
        shaded
    }

    /// Depth of the water at a world position (m). Beyond the raster the bed sinks on.
    fn depth(&self, at: DVec2) -> f32 {
        let Some(water) = self.scene.water else { return 0.0 };
        let land = &self.ground.land;
        let inside = at.clamp(land.origin(), land.origin() + land.extent());
        let bed = land.height_at(inside).unwrap_or(f32::NEG_INFINITY);
        let beyond = (at - inside).length() as f32;
        (water.level as f32 - bed + 0.03 * beyond).clamp(0.0, 1e4)
    }

    /// What water mirrors along a ray: sky, or the land as it looks from afar.
    pub(super) fn mirrored(&self, ray: &Ray, hit: Option<&Hit>) -> Vec3 {
        let direction = ray.direction.as_vec3();
        let Some(hit) = hit else { return self.sky.radiance(direction) };
        let at = hit.position.truncate();
        let known = self.ground.known(at);
        let spacing = self.ground.spacing();
        let surface = self.ground.surface(at, 2.0 * spacing);
        let material = self.material(hit.position, &surface, 2.0 * spacing);
        let sun = self.air.sunlight(hit.position.z as f32) * (material.normal.dot(self.sun).max(0.0) * self.skylight.sunny(at));
        let sky = irradiance(&self.skylight.at(at), material.normal) * material.openness;
        let light = self.mist.lerp(material.albedo / PI * (sun + sky), known);
        if !self.scene.air.veils_distance {
            return light;
        }
        let veil = self.sky.veil(direction, hit.distance as f32);
        light * veil.through + veil.light
    }
}

