//! From what a ray meets to the light it brings.

use super::Style;
use super::atmosphere::Veil;
use super::block::Wall;
use super::cartography::{LAKE_PAPER, LAKE_TINT, SHEET, relief};
use super::grain::step;
use super::ground::Surface;
use super::natural::{Material, Site, natural};
use super::sampler::Pattern;
use super::sea::{Ripples, Streaks, fresnel, glitter, lace, refract, ripples};
use super::skylight::irradiance;
use super::stage::{HIGHEST_EYE, Lens, Stage};
use super::things::Thing;
use super::tile::FIRST;
use super::waves::Wet;
use crate::field::{Beach, InLake, Sea};
use crate::raycast::LocalRay;
use glam::{DVec2, DVec3, Vec2, Vec3};
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
        /// Its waves, where it is not still.
        wet: Option<Wet>,
    },
    /// The ground.
    Ground {
        /// Where (m).
        position: DVec3,
    },
    /// An object on land or water.
    Object(Thing),
    /// The side of a block.
    Wall(Wall),
    /// What a block stands on.
    Floor {
        /// Where (m).
        position: DVec3,
    },
}

impl Ahead {
    /// Where it is (m); `None` for the sky.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Ahead::Sky => None,
            Ahead::Mist { position }
            | Ahead::Water { position, .. }
            | Ahead::Ground { position }
            | Ahead::Object(Thing { position, .. })
            | Ahead::Floor { position }
            | Ahead::Wall(Wall { position, .. }) => Some(position),
        }
    }
}

/// The light of one ray, but for what shadow and mirror rays will find.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shaded {
    /// Light that needs no further ray (kcd/m²).
    pub light: Vec3,
    /// Light of the sun, if `shadow` meets nothing.
    pub sunlit: Vec3,
    /// Towards the sun.
    pub shadow: Option<LocalRay>,
    /// What is seen in the water, and how much of it comes back.
    pub mirror: Option<LocalRay>,
    /// Share of the mirrored light that comes back.
    pub mirror_share: f32,
    /// Added by the air on the way to the eye.
    pub veil: Vec3,
    /// Let through by it.
    pub through: Vec3,
    /// Whether nothing but sky is seen.
    pub sky: bool,
}

/// What the samples of one pixel share. What lies there is looked up for some of them and lent to those that land close by: all of it is
/// already averaged over the pixel's footprint, while edges, shadows and mirrors keep every sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct Near {
    ground: Lent<Facet>,
    water: Lent<Pool>,
    veil: Lent<Veil>,
}

/// What was looked up last, at which distance (m), and how many samples have used it.
#[derive(Clone, Copy, Debug)]
struct Lent<T>(Option<(f32, u32, T)>);

impl<T> Default for Lent<T> {
    fn default() -> Lent<T> {
        Lent(None)
    }
}

impl<T: Copy> Lent<T> {
    /// What was looked up last, if that is within a share of the distance and not yet used `most` times; else `look_up`'s.
    fn take(&mut self, distance: f32, share: f32, most: u32, look_up: impl FnOnce() -> T) -> T {
        match &mut self.0 {
            Some((at, uses, thing)) if *uses < most && (*at - distance).abs() <= share * *at => {
                *uses += 1;
                *thing
            }
            _ => self.0.insert((distance, 1, look_up())).2,
        }
    }
}

/// One sample's look at something.
#[derive(Clone, Copy)]
pub(super) struct Look<'a> {
    /// Away from the eye, unit.
    direction: Vec3,
    /// What is looked at (m).
    position: DVec3,
    /// How far away it is (m).
    pub distance: f32,
    /// The pixel's random numbers, and which of them are the sample's.
    pub pattern: Pattern<'a>,
    pub index: u32,
}

/// Samples that share one look-up: two of the first few, so that these can disagree, and four of the others.
fn shared(index: u32) -> u32 {
    if index < FIRST { 2 } else { 4 }
}

/// A piece of ground, lit by the sky.
#[derive(Clone, Copy, Debug)]
struct Facet {
    smooth: Vec3,
    /// Light of the sky that it throws back (kcd/m²).
    skylit: Vec3,
    /// Light of the unshaded sun that it throws back.
    sunlit: Vec3,
}

/// A piece of water.
#[derive(Clone, Copy, Debug)]
struct Pool {
    ripples: Ripples,
    depth: f32,
    /// How much of it is water at all, and not unknown.
    open: f32,
    /// Light of the sky and of the unshaded sun that comes up through the surface, but for what that keeps.
    skylit: Vec3,
    sunlit: Vec3,
}

impl Stage<'_> {
    /// The light that comes from `ahead` along `direction` (unit, away from the eye).
    pub(super) fn shade(
        &self,
        lens: &Lens,
        direction: Vec3,
        ahead: &Ahead,
        pattern: Pattern,
        index: u32,
        near: &mut Near,
    ) -> Shaded {
        if self.scene.style == Style::Relief {
            return self.painted(lens, direction, ahead);
        }
        let Some(position) = ahead.position() else {
            let light = lens.sky.radiance(direction) + lens.sky.sun_disc(direction);
            return Shaded { light, through: Vec3::ONE, sky: true, ..Shaded::default() };
        };
        let distance = (position - lens.eye).length() as f32;
        let look = Look { direction, position, distance, pattern, index };
        let mut shaded = match ahead {
            Ahead::Water { wet, .. } => self.water(lens, &look, wet.as_ref(), near),
            Ahead::Ground { .. } => self.ground(lens, &look, near),
            Ahead::Object(thing) => self.object(lens, &look, thing),
            Ahead::Wall(wall) => self.cut(lens, direction, wall, self.to_sun(pattern, index)),
            Ahead::Floor { .. } => self.floor(lens, position, self.to_sun(pattern, index)),
            _ => Shaded { light: self.mist, ..Shaded::default() },
        };
        shaded.through = Vec3::ONE;
        if self.scene.air.veils_distance {
            let veil = near.veil.take(distance, 0.004, u32::MAX, || {
                let mut through = distance;
                if lens.eye.z > HIGHEST_EYE {
                    through = through.min((HIGHEST_EYE - position.z) as f32 / (-direction.z).max(1e-3));
                }
                lens.sky.veil(direction, through)
            });
            (shaded.veil, shaded.through) = (veil.light, veil.through);
        }
        shaded
    }

    /// Whether a place lies in a lake.
    fn in_lake(&self, at: DVec2) -> bool {
        self.scene.lakes.is_some_and(|lakes| lakes.at(self.scene.land, at).is_some())
    }

    /// A cartographer's paper: no sun, no air, only tones.
    fn painted(&self, lens: &Lens, direction: Vec3, ahead: &Ahead) -> Shaded {
        let light = match *ahead {
            Ahead::Ground { position } => {
                let at = position.truncate();
                let footprint = self.footprint(lens, (position - lens.eye).length() as f32, -direction.z);
                let wet = self.scene.water.is_some_and(|w| w.covers(at));
                let to_sun = self.sun.truncate().normalize_or(Vec2::new(-0.7, 0.7));
                let ground = relief(&self.ground, &self.tints, at, position.z as f32, footprint, to_sun, wet);
                let ground = if self.in_lake(at) { LAKE_PAPER } else { ground };
                SHEET.lerp(ground, self.ground.known(at))
            }
            Ahead::Wall(wall) => SHEET * (0.62 + 0.12 * wall.normal.dot(self.sun).max(0.0)),
            _ => SHEET,
        };
        Shaded { light, through: Vec3::ONE, sky: matches!(ahead, Ahead::Sky), ..Shaded::default() }
    }

    /// Width of a pixel at a distance on something whose normal makes this cosine with the eye (m). Slanted pixels are long; the samples
    /// within them see to that in part.
    pub(super) fn footprint(&self, lens: &Lens, distance: f32, cosine: f32) -> f32 {
        (distance * lens.pixel * (1.0 / cosine.max(0.02)).sqrt() * 0.65).max(1e-4)
    }

    /// A direction to a random point of the sun's disc.
    pub(super) fn to_sun(&self, pattern: Pattern, index: u32) -> Vec3 {
        let across = self.sun.any_orthonormal_vector();
        let disc = pattern.disc(index) * self.scene.sun.angular_radius as f32;
        (self.sun + across * disc.x + self.sun.cross(across) * disc.y).normalize()
    }

    fn ground(&self, lens: &Lens, look: &Look, near: &mut Near) -> Shaded {
        let Look { direction, position, distance, pattern, index } = *look;
        let known = self.ground.known(position.truncate());
        if known == 0.0 {
            return Shaded { light: self.mist, ..Shaded::default() };
        }
        // The lines of a map are finer than a footprint: where samples disagree every one looks for itself.
        let shared = if self.is_map() && index >= FIRST { 1 } else { shared(index) };
        let facet = near.ground.take(distance, 0.02, shared, || self.facet(lens, direction, position, distance));
        let mut shaded = Shaded { light: facet.skylit, ..Shaded::default() };
        if facet.sunlit != Vec3::ZERO {
            let lift = 0.02 * self.ground.spacing() + 1.5e-4 * distance;
            shaded.sunlit = facet.sunlit;
            let mut position = position;
            if !lens.caster.is_exact()
                && let Some(exact) = self.ground.land.height_at(position.truncate())
            {
                // The exact ground casts the shadows: a mesh that dips below it would lie in its own.
                position.z = position.z.max(f64::from(exact));
            }
            let origin = (position - lens.eye).as_vec3() + facet.smooth * lift;
            shaded.shadow = Some(LocalRay::new(origin, self.to_sun(pattern, index)));
        }
        if known < 1.0 {
            shaded.light = self.mist.lerp(shaded.light, known);
            shaded.sunlit *= known;
        }
        shaded
    }

    /// The ground at a place, as a pixel sees it.
    fn facet(&self, lens: &Lens, direction: Vec3, position: DVec3, distance: f32) -> Facet {
        let at = position.truncate();
        let cosine = match self.is_map() {
            true => -direction.z,
            false => {
                let rough = self.ground.surface(at, distance * lens.pixel);
                -direction.dot(normal_of_slope(rough.slope))
            }
        };
        let footprint = self.footprint(lens, distance, cosine);
        let surface = self.ground.surface(at, footprint);
        let smooth = normal_of_slope(surface.slope);
        let material = self.material(lens, position, &surface, footprint);
        let sky = irradiance(&self.skylight.at(at), material.normal) * material.openness;
        let mut skylit = material.albedo / PI * sky;
        if material.wet > 0.0 {
            let mirrored = direction - 2.0 * direction.dot(smooth) * smooth;
            let share = fresnel(-direction.dot(smooth)) * material.wet * 0.6;
            skylit += share * self.sky.radiance(Vec3::new(mirrored.x, mirrored.y, mirrored.z.max(0.02)).normalize());
        }
        // Slopes that turn from the sun hide their own relief from it.
        let facing = material.normal.dot(self.sun).max(0.0) * step(-0.02, 0.12, smooth.dot(self.sun));
        let sunlit = match facing > 0.0 {
            true => {
                material.albedo / PI * self.air.sunlight(position.z as f32) * (facing * (0.4 + 0.6 * material.openness))
            }
            false => Vec3::ZERO,
        };
        Facet { smooth, skylit, sunlit }
    }

    fn material(&self, lens: &Lens, position: DVec3, surface: &Surface, footprint: f32) -> Material {
        let at = position.truncate();
        let spacing = self.ground.spacing();
        let even = |albedo: Vec3| {
            let normal = normal_of_slope(surface.slope);
            let openness = (1.0 - 0.6 * surface.hollow * spacing.max(footprint)).clamp(0.75, 1.0);
            Material { albedo, normal, openness, wet: 0.0 }
        };
        if self.scene.style == Style::Tint {
            let wet = self.scene.water.is_some_and(|w| w.covers(at));
            let tint = if self.in_lake(at) { LAKE_TINT } else { self.tints.colour(position.z as f32, wet) };
            let Material { albedo, openness, .. } = even(tint);
            let normal = normal_of_slope(surface.slope * self.tints.steepening());
            return Material { albedo, normal, openness, wet: 0.0 };
        }
        if let (Style::Image, Some(drape)) = (self.scene.style, self.scene.drape) {
            let span = f64::from(footprint);
            return match drape.colour(at, DVec2::X * span, DVec2::Y * span) {
                // Cameras' pictures hold light, not albedo: what is white in them reflects about 0.6.
                Some(colour) => even(colour * 0.6),
                None => even(Vec3::splat(0.25)),
            };
        }
        // Dry ground below the sea's level is not by the sea.
        let shore = |level: f64| (level..level + 15.0).contains(&position.z);
        let water = self.scene.water.filter(|w| w.covers(at) || shore(w.level));
        let level = water.map(|w| w.level as f32);
        let broad = self.ground.surface(at, (4.0 * spacing).max(footprint));
        let beach = level.filter(|level| (-1.0..Beach::HIGHEST as f32).contains(&(position.z as f32 - level)));
        let run_up = lens.sea.filter(|_| beach.is_some()).map_or(0.0, |sea| sea.run_up(at));
        let standing = self.ground.standing(at);
        let site = Site { at: position, spacing, footprint, water: level, run_up, standing };
        natural(&site, surface, &broad, &self.scene.climate)
    }

    fn water(&self, lens: &Lens, look: &Look, wet: Option<&Wet>, near: &mut Near) -> Shaded {
        let Look { direction, position, distance, pattern, index } = *look;
        let eye = -direction;
        let pool =
            near.water.take(distance, 0.02, shared(index), || self.pool(lens, direction, position, distance, wet));
        let ripples = wet.map_or(pool.ripples, Wet::ripples);
        let facet = normal_of_slope(ripples.seen_slope(eye, pattern.ripple(index)));
        let facet = if facet.dot(eye) > 0.0 { facet } else { Vec3::Z };
        let share = fresnel(facet.dot(eye));
        let mut mirrored = 2.0 * facet.dot(eye) * facet - eye;
        // A ray thrown down into the next ripple comes up again, a little higher.
        mirrored.z = if mirrored.z < 0.0 { 0.02 - 0.5 * mirrored.z } else { mirrored.z.max(0.004) };
        let origin = (position - lens.eye).as_vec3() + Vec3::Z * (0.02 + 1e-6 * distance);
        // The last film of water mirrors no more than wet sand.
        let film = step(0.0, 0.05, pool.depth);
        let leaves = (1.0 - share) / 0.98;
        let mut shaded = Shaded {
            light: pool.skylit * leaves,
            mirror: Some(LocalRay::new(origin, mirrored.normalize())),
            mirror_share: share * (0.5 + 0.5 * film),
            ..Shaded::default()
        };
        if self.sun.z > 0.0 {
            shaded.sunlit = pool.sunlit * leaves + self.air.sunlight(0.0) * (glitter(eye, self.sun, &ripples) * film);
            shaded.shadow = Some(LocalRay::new(origin, self.to_sun(pattern, index)));
        }
        let wet = wet.map(|w| Wet { foam: w.foam.max(self.fringe(lens, &pool, w)), ..*w });
        if let Some(wet) = wet.as_ref().filter(|w| w.foam > 0.0) {
            let finest = lens.sea.map(Sea::finest).unwrap_or_default();
            let streaks = Streaks::of_wind(finest.heading, finest.wind);
            self.froth(&mut shaded, wet, self.footprint(lens, distance, eye.z), streaks);
        }
        if pool.open < 1.0 {
            shaded.light = self.mist.lerp(shaded.light, pool.open);
            shaded.sunlit *= pool.open;
            shaded.mirror_share *= pool.open;
        }
        shaded
    }

    /// How much of the water's edge is foam: what waves carry with them as they run up a beach.
    fn fringe(&self, lens: &Lens, pool: &Pool, wet: &Wet) -> f32 {
        let Some(sea) = lens.sea.filter(|_| pool.depth < 0.25) else { return 0.0 };
        0.7 * step(0.1, 0.8, sea.run_up(wet.position.truncate())) * (1.0 - step(0.0, 0.25, pool.depth))
    }

    /// Covers water with its foam.
    fn froth(&self, shaded: &mut Shaded, wet: &Wet, footprint: f32, streaks: Streaks) {
        /// What fresh foam throws back (C. Whitlock, D. Bartlett, E. Gurganus 1982, beyond the blue).
        const WHITE: Vec3 = Vec3::new(0.58, 0.60, 0.62);
        let white = lace(wet.rest, footprint, wet.foam, streaks);
        if white <= 0.0 {
            return;
        }
        let normal = normal_of_slope(wet.slope);
        let sky = irradiance(&self.skylight.open, normal);
        let sun = self.air.sunlight(0.0) * normal.dot(self.sun).max(0.0);
        shaded.light = shaded.light.lerp(WHITE / PI * sky, white);
        shaded.sunlit = shaded.sunlit.lerp(WHITE / PI * sun, white);
        shaded.mirror_share *= 1.0 - white;
    }

    /// How much of what lies at a place beyond the raster is sea, in [0, 1]: as much as of the border next to it.
    fn open_sea(&self, at: DVec2) -> f32 {
        let beyond = self.rim.as_ref().and_then(|rim| rim.beyond(at));
        beyond.map_or(1.0, |beyond| step(0.15, 0.85, beyond.wet))
    }

    /// The water at a place, as a pixel sees it.
    fn pool(&self, lens: &Lens, direction: Vec3, position: DVec3, distance: f32, wet: Option<&Wet>) -> Pool {
        let at = position.truncate();
        let eye = -direction;
        let footprint = self.footprint(lens, distance, eye.z);
        let ripples = wet.map_or_else(|| ripples(at, footprint), Wet::ripples);
        let raised = wet.map_or(0.0, |_| (position.z + self.drop_at(at) - self.level()) as f32);
        let shown = normal_of_slope(ripples.slope);
        let lake = self.scene.lakes.filter(|_| wet.is_none()).and_then(|lakes| lakes.at(self.scene.land, at));
        if let Some(lake) = lake.filter(|lake| !lake.is_sounded) {
            return Pool { open: self.ground.known(at), ..self.lake(ripples, &lake) };
        }
        let depth_at = |at: DVec2| match &lake {
            Some(lake) => self.ground.land.height_at(at).map_or(lake.depth, |bed| lake.level as f32 - bed),
            None => self.depth(at),
        };
        // Into the water, to where the bent ray meets the bed.
        let within = if shown.dot(eye) > 0.02 { refract(direction, shown) } else { refract(direction, Vec3::Z) };
        let down = (-within.z).max(0.3);
        let aside = within.truncate() / down;
        let mut below = at;
        let mut depth = (depth_at(at) + raised).max(0.0);
        for _ in 0..3 {
            below = at + aside.as_dvec2() * f64::from(depth.min(60.0));
            depth = 0.5 * (depth + (depth_at(below) + raised).max(0.0));
        }
        let sun_within = -refract(-self.sun, Vec3::Z);
        let bed = if depth < 45.0 {
            // Beyond the border the bed goes on as that is, the farther out the smoother.
            let (low, high) = (self.scene.land.origin(), self.scene.land.origin() + self.scene.land.extent());
            let inside = below.clamp(low, high);
            let away = below.distance(inside) as f32;
            let surface = self.ground.surface(inside, footprint.max(0.6 * away));
            let (albedo, normal) = match lake {
                Some(_) => (MUD, normal_of_slope(surface.slope)),
                None => {
                    let position = below.extend(self.level() - f64::from(depth));
                    let material = self.material(lens, position, &surface, footprint);
                    (material.albedo, material.normal)
                }
            };
            let facing = (normal.dot(sun_within) / sun_within.z.max(0.2)).clamp(0.3, 1.5);
            let known = if away > 0.0 { 1.0 } else { self.ground.known(below) };
            Vec3::splat(0.1).lerp(albedo * facing, known)
        } else {
            Vec3::splat(0.1)
        };
        let up = |irradiance: Vec3| self.depths.radiance(depth, sun_within.z.max(0.5), down, irradiance, bed);
        let sun = self.sun.z.max(0.0);
        Pool {
            ripples,
            depth,
            open: if lake.is_some() { self.ground.known(at) } else { self.open_sea(at) },
            skylit: up(irradiance(&self.skylight.open, Vec3::Z) * 0.93),
            sunlit: up(self.air.sunlight(lake.map_or(0.0, |lake| lake.level as f32)) * (sun * (1.0 - fresnel(sun)))),
        }
    }

    /// The water of a lake, of which only the surface is known: a bed of mud that falls off from the shore.
    fn lake(&self, ripples: Ripples, lake: &InLake) -> Pool {
        let depth = lake.depth;
        let down = (-refract(-self.sun, Vec3::Z)).z.max(0.5);
        let up = |irradiance: Vec3| self.depths.radiance(depth, down, 0.8, irradiance, MUD);
        let sun = self.sun.z.max(0.0);
        Pool {
            ripples,
            depth,
            open: 1.0,
            skylit: up(irradiance(&self.skylight.open, Vec3::Z) * 0.93),
            sunlit: up(self.air.sunlight(lake.level as f32) * (sun * (1.0 - fresnel(sun)))),
        }
    }

    /// Height of still water (m).
    fn level(&self) -> f64 {
        self.scene.water.map_or(0.0, |w| w.level)
    }

    /// Depth of still water at a world position (m), negative where the ground is higher. Beyond the raster the bed sinks on.
    fn depth(&self, at: DVec2) -> f32 {
        let (Some(water), Some(rim)) = (self.scene.water, &self.rim) else { return 0.0 };
        if let Some(beyond) = rim.beyond(at) {
            return beyond.depth + 0.03 * beyond.away as f32;
        }
        let bed = self.ground.land.height_at(at).unwrap_or(f32::NEG_INFINITY);
        (water.level as f32 - bed).min(1e4)
    }

    /// What water mirrors along a ray that meets the ground at `distance` (m): sky, or the land as it looks from afar.
    pub(super) fn mirrored(&self, lens: &Lens, ray: &LocalRay, distance: f32) -> Vec3 {
        if distance == f32::INFINITY {
            return self.sky.radiance(ray.direction);
        }
        let position = lens.eye + (ray.origin + ray.direction * distance).as_dvec3();
        let at = position.truncate();
        let known = self.ground.known(at);
        let spacing = self.ground.spacing();
        let surface = self.ground.surface(at, 2.0 * spacing);
        let material = self.material(lens, position, &surface, 2.0 * spacing);
        let sun =
            self.air.sunlight(position.z as f32) * (material.normal.dot(self.sun).max(0.0) * self.skylight.sunny(at));
        let sky = irradiance(&self.skylight.at(at), material.normal) * material.openness;
        let light = self.mist.lerp(material.albedo / PI * (sun + sky), known);
        if !self.scene.air.veils_distance {
            return light;
        }
        let veil = self.sky.veil(ray.direction, distance);
        light * veil.through + veil.light
    }
}

/// Reflectance of the beds of lakes.
const MUD: Vec3 = Vec3::new(0.09, 0.08, 0.055);

fn normal_of_slope(slope: Vec2) -> Vec3 {
    Vec3::new(-slope.x, -slope.y, 1.0).normalize()
}
