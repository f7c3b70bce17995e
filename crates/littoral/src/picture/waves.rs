//! Where rays meet water that waves move.
//!
//! Still water bent with the Earth is a plane to a ray; waves stay within a slab about it. A ray steps through that slab, never farther than
//! the steepest waves could rise to meet it, until it is below the surface, and the crossing is closed in on. Sixteen rays step together. Waves
//! narrower than what a pixel covers are left to the shading, as slopes.

use super::atmosphere::EARTH;
use super::drawn::Drawn;
use super::grain::{grain, resolved};
use super::sea::Ripples;
use super::stage::{Lens, Stage};
use crate::field::{HeightField, Sea, Surface};
use crate::raycast::LocalRay;
use crate::waves::{BLOCK, Motion, Points};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// The surface of moving water where a ray meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wet {
    /// Where (m).
    pub position: DVec3,
    /// Slope of the waves that a pixel can show.
    pub slope: Vec2,
    /// Covariances (xx, xy, yy) of the slopes of those it cannot.
    pub hidden: Vec3,
    /// How much of it is foam, in [0, 1].
    pub foam: f32,
    /// Where this water rests (m): foam drifts with it.
    pub rest: DVec2,
}

impl Wet {
    /// This piece of surface, level with its slope, as another ray of the same pixel meets it before the ground at `end` (m).
    pub fn lent(&self, eye: DVec3, ray: &LocalRay, end: f32) -> Option<Wet> {
        let (origin, ahead) = (eye + ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let slope = self.slope.as_dvec2();
        let away = self.position - origin;
        let near = away.length();
        let t = (away.z - slope.dot(away.truncate())) / (ahead.z - slope.dot(ahead.truncate()));
        let t = if t.is_finite() { t.clamp(0.8 * near, 1.25 * near) } else { near };
        let position = origin + ahead * t;
        let rest = self.rest + (position - self.position).truncate();
        (t <= f64::from(end)).then_some(Wet { position, rest, ..*self })
    }

    /// As ripples.
    pub fn ripples(&self) -> Ripples {
        Ripples { slope: self.slope, hidden: self.hidden + Vec3::new(FINEST, 0.0, FINEST) }
    }
}

/// Variance of the slopes that water has in the stillest air.
const FINEST: f32 = 3e-4;

/// Slopes that steps allow for: waves steeper than this are breaking, and no wider than a step where they do.
const STEEP: f32 = 0.7;
/// How near water must be found to where it is looked for, in footprints.
const FINE: f32 = 0.01;
/// Steps through the slab before a ray is given up.
const STEPS: usize = 160;
/// Steps of closing in on a crossing.
const CLOSE: usize = 5;

/// One ray on its way.
#[derive(Clone, Copy)]
struct Lane {
    direction: DVec3,
    /// Where the ground ends it (m).
    end: f64,
    /// Above the surface there (m), and how far.
    above: (f64, f64),
    /// Below it, once that was found.
    below: Option<(f64, f64)>,
    /// Where it is looked at now.
    at: f64,
    /// How far water is displaced there, by the last look.
    offset: DVec2,
    walking: bool,
}

impl Stage<'_> {
    /// How far the sea has bent down (m) below a place beyond the land.
    pub(super) fn drop_at(&self, at: DVec2) -> f64 {
        let (low, high) = (self.scene.land.origin(), self.scene.land.origin() + self.scene.land.extent());
        (at - at.clamp(low, high)).length_squared() / (2.0 * f64::from(EARTH))
    }

    /// Where rays from the eye meet the sea, if they do so before the ground at `grounds` (m).
    pub(super) fn wet(&self, lens: &Lens, sea: &Sea, rays: &[LocalRay], grounds: &[f32]) -> Vec<Option<Wet>> {
        let blocks = rays.chunks(BLOCK).zip(grounds.chunks(BLOCK));
        blocks.flat_map(|(rays, grounds)| self.wet_block(lens, sea, rays, grounds)).collect()
    }

    fn wet_block(&self, lens: &Lens, sea: &Sea, rays: &[LocalRay], grounds: &[f32]) -> Vec<Option<Wet>> {
        let reach = f64::from(sea.bounds().height) + 1e-3;
        let steep = f64::from(sea.bounds().slope.min(STEEP));
        let origin = |ray: &LocalRay| lens.eye + ray.origin.as_dvec3();
        let mut lanes: [Lane; BLOCK] = std::array::from_fn(|i| {
            let i = i.min(rays.len() - 1);
            let direction = rays[i].direction.as_dvec3();
            let rise = origin(&rays[i]).z - sea.level();
            // From within the slab at once, from above where it begins.
            let walking = rise <= reach || direction.z < 0.0;
            let mut at = if rise > reach && walking { (rise - reach) / -direction.z } else { 0.0 };
            let mut end = f64::from(grounds[i]) * (1.0 + 1e-7);
            if let Some(block) = &self.ground.block {
                // No water beyond the cut.
                let (enter, leave, _) = block.span(origin(&rays[i]), direction).unwrap_or((0.0, 0.0, Vec3::ZERO));
                let enter = enter.max(0.0);
                (at, end) = (at.max(enter), end.min(leave));
                if origin(&rays[i]).z + direction.z * enter < block.floor {
                    end = 0.0;
                }
            }
            Lane {
                direction,
                end,
                above: (at, f64::INFINITY),
                below: None,
                at,
                offset: DVec2::ZERO,
                walking: walking && at < end,
            }
        });
        let place = |lane: usize, t: f64| origin(&rays[lane.min(rays.len() - 1)]) + lanes_direction(rays, lane) * t;
        for step in 0..STEPS {
            if !lanes.iter().any(|l| l.walking) {
                break;
            }
            let heights = self.look(lens, sea, &mut lanes, &place);
            for (i, lane) in lanes.iter_mut().enumerate().filter(|(_, l)| l.walking) {
                let here = place(i, lane.at);
                let drop = self.drop_at(here.truncate());
                let gap = here.z - (sea.level() - drop);
                let flat = lane.direction.truncate().length();
                if gap > reach {
                    // Above all waves: down to where they begin, unless the sea falls away as fast as the ray.
                    let away = (2.0 * drop / f64::from(EARTH)).sqrt() * flat;
                    lane.walking = -lane.direction.z > away;
                    lane.above = (lane.at, gap);
                    lane.at += (gap - reach) / (-lane.direction.z).max(1e-12) + 1e-3;
                } else {
                    let clear = gap - heights[i];
                    if clear <= 0.0 {
                        lane.below = Some((lane.at, clear));
                        lane.walking = false;
                        continue;
                    }
                    lane.above = (lane.at, clear);
                    let footprint = f64::from(self.footprint(lens, lane.at as f32, -lane.direction.z as f32));
                    // As far as no waves can be expected to rise; those no longer than two footprints are not there.
                    let steep = steep.min(std::f64::consts::PI * reach / footprint);
                    let safe = |jump: f64, slope: f64| (clear - jump) / (slope * flat - lane.direction.z).max(1e-3);
                    let rises = sea.rises().iter();
                    let far = rises.fold(safe(0.0, steep), |d, r| d.max(safe(f64::from(r.jump), f64::from(r.slope))));
                    let least = footprint * (0.3 + 0.02 * step as f64) + 0.004;
                    lane.at += far.max(least);
                }
                if lane.above.0 >= lane.end {
                    lane.walking = false;
                } else {
                    lane.at = lane.at.min(lane.end);
                }
            }
        }
        // One that goes on and on between the waves, far away, has all but met them.
        for lane in lanes.iter_mut().filter(|l| l.walking) {
            lane.below = Some((lane.at, 0.0));
        }
        for _ in 0..CLOSE {
            // Near enough, for what a pixel can show.
            let open = |l: &Lane| match l.below {
                Some((t, depth)) => {
                    let (s, clear) = l.above;
                    let fine = 0.02 * f64::from(self.footprint(lens, t as f32, -l.direction.z as f32));
                    !(clear.min(-depth) <= fine * (steep + 0.05) || t - s <= fine)
                }
                None => false,
            };
            if !lanes.iter().any(open) {
                break;
            }
            for lane in &mut lanes {
                if let Some((t, depth)) = lane.below {
                    let (s, clear) = lane.above;
                    let share = if clear.is_finite() { clear / (clear - depth).max(1e-12) } else { 0.0 };
                    lane.at = s + (t - s) * share.clamp(0.02, 0.98);
                }
            }
            let heights = self.look(lens, sea, &mut lanes, &place);
            for (i, lane) in lanes.iter_mut().enumerate().filter(|(_, l)| l.below.is_some()) {
                let here = place(i, lane.at);
                let clear = here.z + self.drop_at(here.truncate()) - sea.level() - heights[i];
                if clear > 0.0 {
                    lane.above = (lane.at, clear);
                } else {
                    lane.below = Some((lane.at, clear));
                }
            }
        }
        for lane in &mut lanes {
            if let Some((t, depth)) = lane.below {
                let (s, clear) = lane.above;
                lane.at = if clear.is_finite() { s + (t - s) * clear / (clear - depth).max(1e-12) } else { t };
            }
        }
        let mut points = Points::at(0.0, 0.0);
        let mut guess = points;
        for (i, lane) in lanes.iter().enumerate() {
            let at = place(i, lane.at);
            (points.x[i], points.y[i]) = (at.x, at.y);
            points.footprint[i] = self.footprint(lens, lane.at as f32, -lane.direction.z as f32);
            (guess.x[i], guess.y[i]) = (at.x - lane.offset.x, at.y - lane.offset.y);
        }
        let found = sea.find(&points, Some(&guess), FINE);
        let wet = |i: usize| {
            lanes[i].below?;
            let at = DVec2::new(points.x[i], points.y[i]);
            let surface = sea.surface(&found, i);
            let position = at.extend(surface.height - self.drop_at(at));
            let mut wet =
                Wet { position, slope: surface.slope, hidden: surface.hidden, foam: surface.foam, rest: surface.rest };
            shiver(sea, &mut wet, points.footprint[i]);
            Some(wet)
        };
        (0..rays.len()).map(wet).collect()
    }

    /// Replaces what rays met of the sea, where a mesh stands for it, by the mesh with the slopes of the water there.
    pub(super) fn wet_mesh(
        &self,
        lens: &Lens,
        sea: &Sea,
        mesh: &Drawn,
        rays: &[LocalRay],
        grounds: &[f32],
        found: &mut [Option<Wet>],
    ) {
        let mut distances = vec![f32::INFINITY; rays.len()];
        mesh.first_hits(rays, &mut distances);
        let datum = sea.datum();
        let covered = |at: DVec2| {
            let uv = datum.place(at.extend(0.0)).0.uv;
            uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all()
        };
        for (k, wet) in found.iter_mut().enumerate() {
            let (direction, distance) = (rays[k].direction, distances[k]);
            if distance <= grounds[k] * (1.0 + 1e-6) && distance.is_finite() {
                let position = lens.eye + direction.as_dvec3() * f64::from(distance);
                let mut points = Points::at(position.x, position.y);
                points.footprint.fill(self.footprint(lens, distance, -direction.z));
                let surface = sea.surface(&sea.find(&points, None, FINE), 0);
                let Surface { slope, hidden, foam, rest, .. } = surface;
                let mut there = Wet { position, slope, hidden, foam, rest };
                shiver(sea, &mut there, points.footprint[0]);
                *wet = Some(there);
            } else if wet.is_some_and(|w| covered(w.position.truncate())) {
                *wet = None;
            }
        }
    }

    /// Heights of the waves above still water where lanes are, by one step of the search for the water that is there.
    fn look(
        &self,
        lens: &Lens,
        sea: &Sea,
        lanes: &mut [Lane; BLOCK],
        place: &dyn Fn(usize, f64) -> DVec3,
    ) -> [f64; BLOCK] {
        let mut points = Points::at(0.0, 0.0);
        for (i, lane) in lanes.iter().enumerate() {
            let at = place(i, lane.at).truncate() - lane.offset;
            (points.x[i], points.y[i]) = (at.x, at.y);
            points.footprint[i] = self.footprint(lens, lane.at as f32, -lane.direction.z as f32);
        }
        let mut motion = Motion::STILL;
        sea.displacement(&points, &mut motion);
        for (i, lane) in lanes.iter_mut().enumerate() {
            lane.offset = DVec2::new(f64::from(motion.dx[i]), f64::from(motion.dy[i]));
        }
        motion.dz.map(f64::from)
    }
}

/// Ripples finer than the sea's models hold, as far as a pixel of a footprint (m) shows them: noise that runs with the wind and changes as it runs
/// (K. Perlin's animated noise on the slopes of the water, as in the module of 1999).
fn shiver(sea: &Sea, wet: &mut Wet, footprint: f32) {
    /// Lengths (m), and how fast they run (m/s): gravity and tension together.
    const RIPPLES: [(f32, f64); 3] = [(0.083, 0.37), (0.037, 0.26), (0.016, 0.23)];
    /// Mean square slope of the noise, per direction.
    const NOISE: f32 = 0.5;
    let finest = sea.finest();
    let along = DVec2::from_angle(finest.heading);
    for (i, (wavelength, speed)) in RIPPLES.into_iter().enumerate() {
        let share = resolved(wavelength, footprint);
        if share == 0.0 || finest.variance == 0.0 {
            break;
        }
        let turn = DVec2::from_angle(0.6 * i as f64 - 0.5).rotate(along);
        let place = (wet.rest - turn * speed * sea.time()) / f64::from(wavelength);
        let seen = grain(place.extend(sea.time() * 0.35 * speed / f64::from(wavelength)), 90 + i as u32).gradient;
        let variance = finest.variance / RIPPLES.len() as f32;
        wet.slope += Vec2::new(seen.x, seen.y) * ((variance / NOISE).sqrt() * share);
        let shown = variance * share * share;
        wet.hidden -= Vec3::new(shown, 0.0, shown);
    }
}

fn lanes_direction(rays: &[LocalRay], lane: usize) -> DVec3 {
    rays[lane.min(rays.len() - 1)].direction.as_dvec3()
}
