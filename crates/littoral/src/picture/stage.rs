//! A scene made ready for pictures, and what its rays meet.

use super::atmosphere::{Atmosphere, EARTH, Sky};
use super::block::{MIST, Wall};
use super::cartography::Tints;
use super::drawn::Drawn;
use super::ground::Ground;
use super::rim::Rim;
use super::sampler::Patterns;
use super::sea::Depths;
use super::shade::Ahead;
use super::skylight::{Skylight, irradiance};
use super::things::Things;
use super::tile::{Mosaic, Pixel, TILE};
use super::waves::Wet;
use super::{Medium, Picture, Scene, Settings, Style};
use crate::field::{Beach, Sea};
use crate::raycast::{LocalRay, RayCaster};
use crate::space::View;
use glam::{DVec2, DVec3, UVec2, Vec3};
use rayon::prelude::*;
use std::sync::OnceLock;
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
    /// The land's border, where water goes on beyond it.
    pub(super) rim: Option<Rim>,
    /// The height (m) of which `sky` is the sky.
    pub(super) middle: f32,
    /// Where swash may run, from the first picture with waves on.
    beach: OnceLock<Option<Beach>>,
}

/// Casts many rays whose origins count from the eye. There is one for pictures, and one for tests that shows it right.
pub(super) trait Caster: Sync {
    /// Distances (m) to the first hits, infinity for none.
    fn first_hits(&self, rays: &[LocalRay], distances: &mut [f32]);
    /// Whether anything is hit.
    fn any_hits(&self, rays: &[LocalRay], hits: &mut [bool]);
    /// Whether rays from the eye meet the exact ground, and not a mesh that may lie below it.
    fn is_exact(&self) -> bool {
        true
    }
}

impl Caster for RayCaster<'_> {
    fn first_hits(&self, rays: &[LocalRay], distances: &mut [f32]) {
        RayCaster::first_hits(self, rays, distances);
    }

    fn any_hits(&self, rays: &[LocalRay], hits: &mut [bool]) {
        RayCaster::any_hits(self, rays, hits);
    }
}

/// What a view adds to a stage.
pub(super) struct Lens<'a> {
    /// The sky and its veil as the eye sees them.
    pub sky: Sky,
    pub eye: DVec3,
    /// Angle that a pixel covers (rad).
    pub pixel: f32,
    /// Casts rays whose origins count from the eye.
    pub caster: &'a dyn Caster,
    /// The waves on the water.
    pub sea: Option<&'a Sea>,
    /// A mesh that stands for their surface.
    pub water: Option<&'a Drawn>,
    /// The objects that are seen.
    pub things: Option<Things>,
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
        let rim = scene.water.map(|water| Rim::new(scene.land, &ground.land, water));
        Stage {
            scene: *scene,
            tints,
            ground,
            air,
            sky,
            skylight,
            depths: Depths::new(),
            sun,
            mist,
            rim,
            middle: middle.max(2.0),
            beach: OnceLock::new(),
        }
    }

    /// Whether waves may wet a place within the raster or beyond: it lies in still water, or on a shore that rises from it.
    pub(super) fn may_be_wet(&self, at: DVec2) -> bool {
        let Some(water) = self.scene.water else { return false };
        let beach = || self.beach.get().and_then(Option::as_ref);
        water.covers(at) || beach().is_some_and(|beach| beach.covers(self.scene.land, at))
    }

    /// The shore that waves may wet. Not to be asked for the first time from within a parallel loop: the flood is parallel, too.
    pub(super) fn beach(&self) -> Option<&Beach> {
        let find = || self.scene.water.and_then(|water| Beach::of(self.scene.land, water));
        self.beach.get_or_init(find).as_ref()
    }

    /// Whether the style is that of a map, on which water is a colour.
    pub(super) fn is_map(&self) -> bool {
        matches!(self.scene.style, Style::Tint | Style::Relief)
    }

    /// What kind of picture it makes.
    pub(super) fn medium(&self) -> Medium {
        match self.scene.style {
            Style::Natural | Style::Image => Medium::Photograph,
            Style::Tint => Medium::Model,
            Style::Relief => Medium::Paper,
        }
    }

    /// What is shown as white (kcd/m²).
    pub(super) fn white(&self) -> [f32; 3] {
        let studio = self.ground.block.is_some() || self.medium() == Medium::Model;
        if studio { (self.mist / MIST).to_array() } else { [1.0; 3] }
    }

    /// Whether waves are seen at all: there is water, and the style is not that of a map.
    pub fn shows_waves(&self) -> bool {
        self.scene.water.is_some() && !self.is_map()
    }

    /// What `view` sees. `progress` is told the fraction done, now and then, from any thread.
    pub fn render(&self, view: &View, settings: &Settings, progress: &(dyn Fn(f32) + Sync)) -> Picture {
        self.render_with(&self.ground.land.caster(view.eye), None, self.scene.sea, view, settings, progress)
    }

    /// What `view` sees with other waves than the scene's: a film takes the sea of each moment.
    pub fn render_sea(
        &self,
        sea: Option<&Sea>,
        view: &View,
        settings: &Settings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Picture {
        self.render_with(&self.ground.land.caster(view.eye), None, sea, view, settings, progress)
    }

    /// What `view` sees by the rays of some caster, and by a mesh of the sea.
    pub(super) fn render_with(
        &self,
        caster: &dyn Caster,
        water: Option<&Drawn>,
        sea: Option<&Sea>,
        view: &View,
        settings: &Settings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Picture {
        let lens = Lens {
            sky: Sky::new(&self.air, &self.scene.sun, self.sun, view.eye.z.clamp(2.0, HIGHEST_EYE) as f32),
            eye: view.eye,
            pixel: 1.0 / view.pixels_per_radian,
            caster,
            sea: sea.filter(|_| self.shows_waves()),
            water,
            things: self.things(sea, view),
        };
        // Not by whoever of the tiles asks first: a tile that the flood lets in meanwhile would wait for itself.
        if lens.sea.is_some() {
            self.beach();
        }
        let tiles = UVec2::new(view.size.x.div_ceil(TILE), view.size.y.div_ceil(TILE));
        let count = tiles.x as usize * tiles.y as usize;
        let patterns = Patterns::new(settings.samples.max(1), settings.seed);
        let mosaic = Mosaic { lens: &lens, view, settings, patterns: &patterns };
        let done = AtomicUsize::new(0);
        let rendered: Vec<Vec<Pixel>> = (0..count)
            .into_par_iter()
            .map(|i| {
                let corner = UVec2::new(i as u32 % tiles.x, i as u32 / tiles.x) * TILE;
                let pixels = self.tile(&mosaic, corner);
                progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / count as f32);
                pixels
            })
            .collect();
        let mut picture = Picture::empty(view.size, view.eye);
        picture.medium = self.medium();
        picture.white = self.white();
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

    /// What a ray from the eye meets, where `ground` is its distance to the ground (m) and `wet` the sea before that.
    pub(super) fn ahead(&self, lens: &Lens, direction: Vec3, ground: f32, wet: Option<Wet>) -> Ahead {
        let eye = lens.eye;
        let direction = direction.as_dvec3();
        let ground = f64::from(ground);
        if let Some(block) = &self.ground.block {
            let wet = |at| self.is_in_water(lens, at);
            if let Some(wall) = block.wall(&self.ground.land, eye, direction, &wet) {
                return Ahead::Wall(wall);
            }
        }
        if let Some(wet) = wet {
            return Ahead::Water { position: wet.position, wet: Some(wet) };
        }
        if let Some(water) = self.scene.water.filter(|_| lens.sea.is_none() && !self.is_map()) {
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
                    let position = (eye + direction * t).truncate().extend(water.level);
                    return Ahead::Water { position, wet: None };
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
            return self.lake_over(eye, direction, ground).unwrap_or(Ahead::Ground { position });
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

    /// The lake that a ray from the eye meets before the ground at some distance (m).
    fn lake_over(&self, eye: DVec3, direction: DVec3, ground: f64) -> Option<Ahead> {
        let (lakes, land) = (self.scene.lakes.filter(|_| !self.is_map())?, self.scene.land);
        let at = (eye + direction * ground).truncate();
        let lake = lakes.at(land, at)?;
        if !lake.is_sounded {
            // Its ground, as it was measured, is its surface.
            return Some(Ahead::Water { position: at.extend(lake.level), wet: None });
        }
        let rise = eye.z - lake.level;
        if rise <= 0.0 {
            return None;
        }
        // From where it comes down to the level to its bed a ray stays within the lake.
        let distance = -rise / direction.z;
        if !(distance > 0.0 && distance <= ground * (1.0 + 1e-6)) {
            // A mesh may lie above water.
            return Some(Ahead::Water { position: at.extend(lake.level), wet: None });
        }
        let position = eye + direction * distance;
        match lakes.at(land, position.truncate()) {
            Some(lake) => Some(Ahead::Water { position: position.truncate().extend(lake.level), wet: None }),
            // A mesh that cuts off the shore, or the side of a void.
            None => land.height_at(position.truncate()).map(|_| Ahead::Ground { position }),
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
