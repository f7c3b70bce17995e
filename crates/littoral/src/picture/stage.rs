//! A scene made ready for pictures, and the tiles that pictures are made of.

use super::atmosphere::{Atmosphere, EARTH, Sky};
use super::block::{MIST, Wall};
use super::cartography::Tints;
use super::ground::Ground;
use super::sampler::Sampler;
use super::sea::Depths;
use super::shade::{Ahead, Near, Shaded};
use super::skylight::{Skylight, irradiance};
use super::{Medium, Picture, Scene, Settings, Style};
use crate::raycast::{LocalRay, RayCaster};
use crate::space::View;
use glam::{DVec3, UVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A scene made ready: built once, good for any number of views.
pub struct Stage<'a> {
    pub(super) scene: Scene<'a>,
    pub(super) ground: Ground<'a>,
    pub(super) air: Atmosphere,
    /// The sky as the land sees it.
    pub(super) sky: Sky,
    pub(super) skylight: Skylight,
    pub(super) depths: Depths,
    /// Towards the sun.
    pub(super) sun: Vec3,
    /// Radiance of mist (kcd/m²).
    pub(super) mist: Vec3,
    pub(super) tints: Tints,
}

/// What a view adds to a stage.
pub(super) struct Lens<'a> {
    /// The sky and its veil as the eye sees them.
    pub sky: Sky,
    pub eye: DVec3,
    /// Angle that a pixel covers (rad).
    pub pixel: f32,
    /// Casts rays whose origins count from the eye.
    caster: RayCaster<'a>,
}

/// Side of the squares of pixels that one thread works on (pixels).
const TILE: u32 = 16;
/// Spread of the reconstruction filter (pixels): a Gaussian about as sharp as a good lens.
const FILTER: f32 = 0.42;

/// What each purpose of random numbers is called.
pub(super) mod purpose {
    pub const PIXEL: u32 = 0;
    pub const SUN: u32 = 1;
    pub const RIPPLE: u32 = 2;
}

impl<'a> Stage<'a> {
    /// Makes `scene` ready.
    pub fn new(scene: &Scene<'a>) -> Stage<'a> {
        let sun = scene.sun.direction(scene.north).as_vec3();
        // On maps the bed is ground like any other, and water only a colour.
        let map = matches!(scene.style, Style::Tint | Style::Relief);
        let ground = Ground::new(scene.land, scene.water.filter(|_| !map), scene.border);
        let air = Atmosphere::new(&scene.air, &scene.sun);
        let range = scene.land.height_range();
        let level = scene.water.map_or(f32::NEG_INFINITY, |w| w.level as f32);
        let middle = if range.is_empty() { 0.0 } else { 0.5 * (range.low.max(level) + range.high) };
        let sky = Sky::new(&air, &scene.sun, sun, middle.max(2.0));
        let skylight = Skylight::new(&ground, &air, &sky, sun, Vec3::new(0.150, 0.130, 0.090));
        let open = irradiance(&skylight.open, Vec3::Z);
        let mist = MIST / std::f32::consts::PI * (air.sunlight(middle.max(0.0)) * sun.z.max(0.0) + open);
        let tints = Tints::of(&ground, range, level);
        Stage { scene: *scene, tints, ground, air, sky, skylight, depths: Depths::new(), sun, mist }
    }

    /// Whether the style is that of a map, on which water is a colour.
    pub(super) fn is_map(&self) -> bool {
        matches!(self.scene.style, Style::Tint | Style::Relief)
    }

    /// What `view` sees. `progress` is told the fraction done, now and then, from any thread.
    pub fn render(&self, view: &View, settings: &Settings, progress: &(dyn Fn(f32) + Sync)) -> Picture {
        let lens = Lens {
            sky: Sky::new(&self.air, &self.scene.sun, self.sun, view.eye.z.clamp(2.0, HIGHEST_EYE) as f32),
            eye: view.eye,
            pixel: 1.0 / view.pixels_per_radian,
            caster: self.ground.land.caster(view.eye),
        };
        let tiles = UVec2::new(view.size.x.div_ceil(TILE), view.size.y.div_ceil(TILE));
        let count = tiles.x as usize * tiles.y as usize;
        let done = AtomicUsize::new(0);
        let rendered: Vec<Vec<Pixel>> = (0..count)
            .into_par_iter()
            .map(|i| {
                let corner = UVec2::new(i as u32 % tiles.x, i as u32 / tiles.x) * TILE;
                let pixels = self.tile(&lens, view, settings, corner, (corner + TILE).min(view.size));
                progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / count as f32);
                pixels
            })
            .collect();
        let mut picture = Picture::empty(view.size, view.eye);
        picture.medium = match self.scene.style {
            Style::Natural | Style::Image => Medium::Photograph,
            Style::Tint => Medium::Model,
            Style::Relief => Medium::Paper,
        };
        if self.ground.block.is_some() || picture.medium == Medium::Model {
            picture.white = (self.mist / MIST).to_array();
        }
        for (i, pixels) in rendered.iter().enumerate() {
            let corner = UVec2::new(i as u32 % tiles.x, i as u32 / tiles.x) * TILE;
            let width = (view.size.x - corner.x).min(TILE) as usize;
            for (k, pixel) in pixels.iter().enumerate() {
                let at = (corner.y as usize + k / width) * view.size.x as usize + corner.x as usize + k % width;
                picture.radiance[at] = pixel.radiance.to_array();
                picture.coverage[at] = pixel.coverage;
                if let Some((position, normal)) = pixel.middle {
                    let relative = (position - view.eye).as_vec3();
                    picture.depth[at] = (position - view.eye).length() as f32;
                    picture.position[at] = relative.to_array();
                    picture.normal[at] = normal.to_array();
                    picture.height[at] = position.z as f32;
                }
            }
        }
        picture
    }

    /// The pixels of one tile, row by row: all primary rays at once, then all rays that what they meet asks for.
    fn tile(&self, lens: &Lens, view: &View, settings: &Settings, from: UVec2, to: UVec2) -> Vec<Pixel> {
        let samples = settings.samples.max(1);
        let (corner, right, down) = view.frame();
        let width = to.x - from.x;
        let pixels = (width * (to.y - from.y)) as usize;
        // The last ray of each pixel goes through its middle and carries the passes, not the picture.
        let per_pixel = samples as usize + 1;
        let mut rays = Vec::with_capacity(pixels * per_pixel);
        let mut samplers = Vec::with_capacity(pixels);
        for i in 0..pixels as u32 {
            let (x, y) = (from.x + i % width, from.y + i / width);
            let sampler = Sampler::new(x, y, settings.seed);
            samplers.push(sampler);
            for s in 0..per_pixel as u32 {
                let jitter = match s < samples {
                    true => (FILTER * sampler.normal(s, purpose::PIXEL)).clamp(Vec2::splat(-1.4), Vec2::splat(1.4)),
                    false => Vec2::ZERO,
                };
                let (px, py) = (x as f32 + 0.5 + jitter.x, y as f32 + 0.5 + jitter.y);
                rays.push(LocalRay::new(Vec3::ZERO, (corner + right * px + down * py).normalize()));
            }
        }
        let mut distances = vec![f32::INFINITY; rays.len()];
        lens.caster.first_hits(&rays, &mut distances);
        let mut shaded: Vec<Shaded> = Vec::with_capacity(rays.len());
        let (mut shadow_rays, mut shadow_of) = (Vec::new(), Vec::new());
        let (mut mirror_rays, mut mirror_of) = (Vec::new(), Vec::new());
        let mut middles = vec![None; pixels];
        for (pixel, middle) in middles.iter_mut().enumerate() {
            let mut near = Near::default();
            for s in 0..per_pixel {
                let k = pixel * per_pixel + s;
                let ahead = self.ahead(lens.eye, rays[k].direction, distances[k]);
                if s == samples as usize {
                    *middle = match ahead {
                        Ahead::Sky => None,
                        Ahead::Mist { position } | Ahead::Water { position } | Ahead::Floor { position } => {
                            Some((position, Vec3::Z))
                        }
                        Ahead::Wall(wall) => Some((wall.position, wall.normal)),
                        Ahead::Ground { position } => {
                            Some((position, self.ground.land.normal_at(position.truncate()).unwrap_or(Vec3::Z)))
                        }
                    };
                    shaded.push(Shaded::default());
                    continue;
                }
                let sample = self.shade(lens, rays[k].direction, &ahead, samplers[pixel], s as u32, &mut near);
                if let Some(ray) = sample.shadow {
                    shadow_rays.push(ray);
                    shadow_of.push(k);
                }
                if let Some(ray) = sample.mirror {
                    mirror_rays.push(ray);
                    mirror_of.push(k);
                }
                shaded.push(sample);
            }
        }
        let mut blocked = vec![false; shadow_rays.len()];
        lens.caster.any_hits(&shadow_rays, &mut blocked);
        for (&k, &blocked) in shadow_of.iter().zip(&blocked) {
            if !blocked {
                let sample = &mut shaded[k];
                sample.light += sample.sunlit;
            }
        }
        distances.clear();
        distances.resize(mirror_rays.len(), f32::INFINITY);
        lens.caster.first_hits(&mirror_rays, &mut distances);
        for ((&k, ray), &distance) in mirror_of.iter().zip(&mirror_rays).zip(&distances) {
            let mirrored = self.mirrored(lens, ray, distance);
            let sample = &mut shaded[k];
            sample.light += mirrored * sample.mirror_share;
        }
        let brightest = self.mist.max_element().max(1.0) * 30.0;
        (0..pixels)
            .map(|i| {
                let (mut radiance, mut coverage) = (Vec3::ZERO, 0.0);
                for sample in &shaded[i * per_pixel..i * per_pixel + samples as usize] {
                    radiance += (sample.light * sample.through + sample.veil).min(Vec3::splat(brightest));
                    coverage += f32::from(u8::from(!sample.sky));
                }
                let share = 1.0 / samples as f32;
                Pixel { radiance: radiance * share, coverage: coverage * share, middle: middles[i] }
            })
            .collect()
    }

    /// What a ray from the eye meets, where `ground` is its distance to the ground (m).
    fn ahead(&self, eye: DVec3, direction: Vec3, ground: f32) -> Ahead {
        let direction = direction.as_dvec3();
        let ground = f64::from(ground);
        if let Some(block) = &self.ground.block {
            let level = |at| self.level_within(at);
            if let Some(wall) = block.wall(&self.ground.land, eye, direction, &level) {
                return Ahead::Wall(wall);
            }
        }
        if let Some(water) = self.scene.water.filter(|_| !self.is_map()) {
            // Still water is level; beyond the raster it bends with the Earth, which sets the horizon.
            let rise = eye.z - water.level;
            if rise > 0.0 {
                let flat = -rise / direction.z;
                let within = flat > 0.0 && {
                    let at = (eye + direction * flat).truncate();
                    let origin = self.scene.land.origin();
                    at.cmpge(origin).all() && at.cmple(origin + self.scene.land.extent()).all()
                };
                let distance = match within {
                    true => Some(flat),
                    false if self.ground.block.is_some() => None,
                    false => curved(rise, direction),
                };
                if let Some(t) = distance
                    && t <= ground * (1.0 + 1e-7)
                    && water.covers((eye + direction * t).truncate())
                {
                    return Ahead::Water { position: (eye + direction * t).truncate().extend(water.level) };
                }
            }
        }
        if ground.is_finite() {
            let position = eye + direction * ground;
            let at = position.truncate();
            if let Some(block) = self.ground.block.filter(|_| self.ground.is_side(at)) {
                let tall = self.ground.land.height_range();
                // What was cut away lies on the floor, but for rounding.
                if position.z < block.floor + 1e-4 * f64::from(tall.high - tall.low) {
                    return Ahead::Floor { position };
                }
                return Ahead::Wall(Wall { position, normal: self.ground.outward(at), ground: position.z });
            }
            return Ahead::Ground { position };
        }
        if let Some(block) = &self.ground.block {
            return block.floor(eye, direction).map_or(Ahead::Sky, |position| Ahead::Floor { position });
        }
        let rise = eye.z - self.ground.mist;
        match curved(rise, direction) {
            Some(t) if rise > 0.0 => Ahead::Mist { position: eye + direction * t },
            _ => Ahead::Sky,
        }
    }
}

/// The greatest height for which the air's tables are made (m); from higher up, the way to the air adds nothing.
pub(super) const HIGHEST_EYE: f64 = 60_000.0;

/// Distance along a unit direction to a level surface `rise` (m) below, bent with the Earth: z + t² / 2R.
fn curved(rise: f64, direction: DVec3) -> Option<f64> {
    if direction.z >= 0.0 {
        return None;
    }
    let bend = direction.truncate().length_squared() / (2.0 * f64::from(EARTH));
    let square = direction.z * direction.z - 4.0 * bend * rise;
    (square >= 0.0).then(|| 2.0 * rise / (-direction.z + square.sqrt()))
}

/// One finished pixel.
struct Pixel {
    radiance: Vec3,
    coverage: f32,
    /// Position and normal of what is seen through its middle.
    middle: Option<(DVec3, Vec3)>,
}
