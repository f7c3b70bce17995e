//! The land as a block: a clean cut where the data ends, on the floor of a studio.
//!
//! Land seen from outside is a thing that ends. Its sides are cut straight down, the water in it too, and it stands on a level floor
//! of the tone of mist: nothing is invented about what lies beyond or below, and nothing hides where the data ends. Sides
//! and floor are met in closed form; only the ground between them needs the pyramid.

use super::display::luminance;
use super::sea::fresnel;
use super::shade::Shaded;
use super::skylight::irradiance;
use super::stage::{Lens, Stage};
use super::tables::Slab;
use crate::field::Land;
use crate::raycast::LocalRay;
use glam::{DVec2, DVec3, Vec3};
use std::f32::consts::PI;

/// Reflectance of the cut: plaster, a little warm.
const PLASTER: Vec3 = Vec3::new(0.300, 0.275, 0.245);

/// The sides and the floor of a land that is shown as a block.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    low: DVec2,
    high: DVec2,
    /// Height of the floor (m).
    pub floor: f64,
    /// From there to the lowest ground (m).
    thickness: f64,
}

/// Where a ray meets the cut.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    /// Where (m).
    pub position: DVec3,
    /// Unit vector out of the block.
    pub normal: Vec3,
    /// Height of the ground above (m).
    pub ground: f64,
}

impl Block {
    /// The block of `land`, as thick as it looks well: thin, but never a sheet.
    pub fn of(land: &Land) -> Block {
        let range = land.height_range();
        let (low, high) = if range.is_empty() { (0.0, 0.0) } else { (f64::from(range.low), f64::from(range.high)) };
        let thickness = 0.018 * land.extent().max_element() + 0.06 * (high - low);
        Block { low: land.origin(), high: land.origin() + land.extent(), floor: low - thickness, thickness }
    }

    /// In numbers.
    pub fn slab(&self) -> Slab {
        let Block { low, high, floor, thickness } = *self;
        Slab { low, high, floor, thickness }
    }

    /// Where a ray crosses into the block's column of space and out of it: two distances, of which the first is negative for a ray that begins
    /// within, and the normal of the side by which it comes in.
    pub fn span(&self, eye: DVec3, direction: DVec3) -> Option<(f64, f64, Vec3)> {
        let (at, along) = (eye.truncate(), direction.truncate());
        let (a, b) = ((self.low - at) / along, (self.high - at) / along);
        let (near, far) = (a.min(b), a.max(b));
        // Along an axis that the ray does not follow it is either always within or never.
        let within = at.cmpge(self.low) & at.cmple(self.high);
        let bounds = |axis: usize| match along[axis] != 0.0 {
            true => (near[axis], far[axis]),
            false if within.test(axis) => (f64::NEG_INFINITY, f64::INFINITY),
            false => (f64::INFINITY, f64::NEG_INFINITY),
        };
        let (x, y) = (bounds(0), bounds(1));
        let axis = usize::from(y.0 > x.0);
        let (enter, leave) = (x.0.max(y.0), x.1.min(y.1));
        let mut normal = Vec3::ZERO;
        normal[axis] = -along[axis].signum() as f32;
        (leave > 0.0 && enter <= leave).then_some((enter, leave, normal))
    }

    /// Whether a place (m) lies within the sides.
    pub fn holds(&self, at: DVec2) -> bool {
        at.cmpge(self.low).all() && at.cmple(self.high).all()
    }

    /// The cut that a ray from outside meets, before any ground. `water` tells whether a point above the ground lies in water.
    pub fn wall(&self, land: &Land, eye: DVec3, direction: DVec3, water: &dyn Fn(DVec3) -> bool) -> Option<Wall> {
        let (distance, _, normal) = self.span(eye, direction).filter(|(enter, ..)| *enter > 0.0)?;
        let position = eye + direction * distance;
        let at = position.truncate().clamp(self.low, self.high);
        let ground = f64::from(land.height_at(at)?);
        let position = at.extend(position.z);
        let solid = position.z > self.floor && (position.z <= ground || water(position));
        solid.then_some(Wall { position, normal, ground })
    }

    /// Where a ray meets the floor, if nothing is in the way.
    pub fn floor(&self, eye: DVec3, direction: DVec3) -> Option<DVec3> {
        let distance = (self.floor - eye.z) / direction.z;
        (distance > 0.0 && direction.z < 0.0).then(|| eye + direction * distance)
    }
}

impl Stage<'_> {
    /// Whether a point within the block and above the ground lies in the water, waves and all.
    pub(super) fn is_in_water(&self, lens: &Lens, at: DVec3) -> bool {
        self.scene.water.filter(|_| !self.is_map() && self.may_be_wet(at.truncate())).is_some_and(|water| {
            match lens.sea {
                // Above or below all waves there is no need to ask for them.
                Some(sea) if (at.z - water.level).abs() < f64::from(sea.bounds().height) => {
                    at.z <= sea.height_at(at.truncate())
                }
                _ => at.z <= water.level,
            }
        })
    }

    /// The cut.
    pub(super) fn cut(&self, lens: &Lens, direction: Vec3, wall: &Wall, to_sun: Vec3) -> Shaded {
        let at = wall.position.truncate();
        let sky = irradiance(&self.skylight.open, wall.normal);
        let facing = wall.normal.dot(self.sun).max(0.0);
        let water = self.scene.water.filter(|_| wall.position.z > wall.ground);
        let level = water.map(|w| lens.sea.map_or(w.level, |sea| sea.height_at(at)));
        let mut shaded = Shaded::default();
        shaded.light = match level {
            Some(level) => {
                // Looking into water through its side: it glows as deep water does, less the deeper the less light comes down.
                let down = irradiance(&self.skylight.open, Vec3::Z) + self.air.sunlight(0.0) * self.sun.z.max(0.0);
                let depth = (level - wall.position.z) as f32;
                let column = (level - wall.ground).max(1e-3) as f32;
                let dim = 0.45 + 0.55 * (-1.6 * depth / column).exp();
                let share = fresnel(-direction.dot(wall.normal));
                let mirrored = direction - 2.0 * direction.dot(wall.normal) * wall.normal;
                let sheen = self.sky.radiance(Vec3::new(mirrored.x, mirrored.y, mirrored.z.max(0.02)).normalize());
                self.depths.radiance(60.0, 0.8, 0.8, down, Vec3::ZERO) * (2.2 * dim) + sheen * (0.5 * share)
            }
            None => {
                let distance = (wall.position - lens.eye).as_vec3();
                let lift = 0.02 * self.ground.spacing() + 1.5e-4 * distance.length();
                shaded.sunlit = PLASTER / PI * self.air.sunlight(0.0) * facing;
                shaded.shadow = (facing > 0.0).then(|| LocalRay::new(distance + wall.normal * lift, to_sun));
                PLASTER / PI * sky
            }
        };
        let known = self.ground.known(at);
        shaded.light = self.mist.lerp(shaded.light, known);
        shaded.sunlit *= known;
        shaded
    }

    /// The floor, in the block's shadow or out of it.
    pub(super) fn floor(&self, lens: &Lens, position: DVec3, to_sun: Vec3) -> Shaded {
        let Some(block) = &self.ground.block else { return Shaded { light: self.mist, ..Shaded::default() } };
        let at = position.truncate();
        let beside = at.clamp(block.low, block.high);
        // What a long wall as high as the block is thick hides of an even sky (and throws back a part of).
        let away = (at - beside).length();
        let openness = 1.0 - 0.4 * (1.0 - away / away.hypot(block.thickness)) as f32;
        let openness = if self.ground.is_cut_away(beside) { 1.0 } else { openness };
        // A studio is lit evenly: half of the sky's blue is left.
        let sky = irradiance(&self.skylight.open, Vec3::Z) * openness;
        let sky = sky.lerp(Vec3::splat(luminance(sky.to_array())), 0.5);
        let albedo = if self.is_map() { PAPER } else { MIST };
        let mut shaded = Shaded { light: albedo / PI * sky, ..Shaded::default() };
        if self.sun.z > 0.0 {
            let towards = to_sun.as_dvec3();
            let wall = block.wall(&self.ground.land, position, towards, &|at| self.is_in_water(lens, at));
            if wall.is_none() {
                shaded.sunlit = albedo / PI * self.air.sunlight(0.0) * self.sun.z;
                let distance = (position - lens.eye).as_vec3();
                let lift = Vec3::Z * (0.02 * self.ground.spacing() + 1.5e-4 * distance.length());
                shaded.shadow = Some(LocalRay::new(distance + lift, to_sun));
            }
        }
        shaded
    }
}

/// Reflectance of mist and of the floor.
pub const MIST: f32 = 0.42;
/// Reflectance of the floor below maps.
pub const PAPER: f32 = 0.80;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Raster;

    #[test]
    fn sides_are_met_below_their_edge_and_nowhere_else() {
        // A slope of 1 eastward, from 0 to 40 m, on a block of 40 m × 20 m.
        let heights = (0..5 * 3).map(|i| 10.0 * (i % 5) as f32).collect();
        let land = Land::at(Raster::new(5, 3, DVec2::splat(10.0), heights).expect("valid"), DVec2::new(100.0, 200.0));
        let block = Block::of(&land);
        assert!(block.floor < -1.0);
        let dry = |_: DVec3| false;
        let wall = |eye, to: DVec3| block.wall(&land, eye, (to - eye).normalize(), &dry);
        let east = DVec3::new(300.0, 210.0, 30.0);
        let hit = wall(east, DVec3::new(140.0, 212.0, 39.0)).expect("below the edge");
        assert!((hit.position - DVec3::new(140.0, 212.0, 39.0)).length() < 1e-9 && hit.normal == Vec3::X);
        assert_eq!(hit.ground, 40.0);
        assert!(wall(east, DVec3::new(140.0, 212.0, 41.0)).is_none(), "over the edge");
        assert!(wall(east, DVec3::new(140.0, 230.0, 5.0)).is_none(), "past the corner");
        let south = wall(DVec3::new(125.0, 0.0, 10.0), DVec3::new(125.0, 200.0, 24.0)).expect("the slope's side");
        assert_eq!((south.normal, south.ground), (Vec3::NEG_Y, 25.0));
        assert!(wall(DVec3::new(125.0, 0.0, 10.0), DVec3::new(125.0, 200.0, 26.0)).is_none());
        assert!(wall(DVec3::new(120.0, 210.0, 90.0), DVec3::new(300.0, 210.0, 0.0)).is_none(), "from within");
        // Water fills the low end up to its level.
        let wet = |at: DVec3| at.z <= 18.0;
        let west = DVec3::new(0.0, 210.0, 10.0);
        assert!(block.wall(&land, west, DVec3::X, &wet).is_some_and(|w| w.ground == 0.0));
        assert!(block.wall(&land, west, DVec3::X, &dry).is_none());
    }
}
