//! Objects in pictures: their triangles are met by the rays through the pixels, and lie before or behind all else by distance.
//!
//! The sun, the sky over the place and the air light them as they light the ground, and the land's shadow falls on them. What they lack so far: they cast no
//! shadow, are not mirrored in water, and are not seen through it.

use super::drawn::Drawn;
use super::shade::{Ahead, Look, Shaded};
use super::skylight::irradiance;
use super::stage::{Lens, Stage};
use super::{Scene, Style};
use crate::field::Sea;
use crate::objects::{Object, Pose};
use crate::raycast::LocalRay;
use crate::space::View;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;

/// An object as it stands at an instant.
#[derive(Clone, Debug)]
pub struct Placed {
    /// What stands there.
    pub object: Arc<Object>,
    /// How it lies.
    pub pose: Pose,
    /// Whether the land lets the sun through to it: 1 or 0 at its lowest point, at a third and two thirds of its height and at its top.
    pub sunny: [f32; 4],
}

/// The piece of an object that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thing {
    /// Where (m).
    pub position: DVec3,
    /// Unit normal, towards the eye's side.
    pub normal: Vec3,
    /// Share of light that is thrown back.
    pub albedo: Vec3,
}

/// All objects that a view sees, as it sees them.
pub(super) struct Things {
    drawn: Drawn,
    /// Normal and albedo of each vertex.
    looks: Vec<(Vec3, Vec3)>,
}

impl Things {
    /// `None` if none is seen.
    fn new(standing: impl Iterator<Item = (Arc<Object>, Pose)>, view: &View) -> Option<Things> {
        let (mut vertices, mut looks, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for (object, pose) in standing {
            let Some(form) = pose.form(&object, view).map(|form| &object.forms()[form]) else { continue };
            let base = vertices.len() as u32;
            vertices.extend(form.corners.iter().map(|corner| pose.world(corner.position) - view.eye));
            looks.extend(form.corners.iter().map(|c| ((pose.axes * c.normal).normalize_or(Vec3::Z), c.albedo)));
            triangles.extend(form.triangles.iter().map(|triangle| triangle.map(|corner| base + corner)));
        }
        (!triangles.is_empty()).then(|| Things { drawn: Drawn::of(vertices, triangles, view), looks })
    }

    /// What rays from the eye meet of objects, nearer than what lies `ahead`.
    fn before(&self, eye: DVec3, rays: &[LocalRay], ahead: &mut [Ahead]) {
        let directions: Vec<Vec3> = rays.iter().map(|ray| ray.direction).collect();
        self.drawn.hits(&directions, |k, distance, triangle| {
            let nearer = ahead[k].position().is_none_or(|at| f64::from(distance) < at.distance(eye));
            if !nearer {
                return;
            }
            let (corners, shares) = self.drawn.shares(triangle, directions[k]);
            let blend =
                |of: &dyn Fn(usize) -> Vec3| corners.into_iter().zip(shares).map(|(v, s)| of(v as usize) * s).sum();
            let normal: Vec3 = blend(&|v| self.looks[v].0);
            // Seen from behind, it is the other side's.
            let normal = if self.drawn.faces(triangle) { normal } else { -normal };
            ahead[k] = Ahead::Object(Thing {
                position: eye + directions[k].as_dvec3() * f64::from(distance),
                normal: normal.normalize_or(-directions[k]),
                albedo: blend(&|v| self.looks[v].1),
            });
        });
    }
}

impl Scene<'_> {
    /// Whether objects are seen at all: they are not on a shaded relief, which is a map.
    fn shows_objects(&self) -> bool {
        self.style != Style::Relief
    }
}

impl Stage<'_> {
    /// The poses of the objects that have somewhere to stand.
    fn standing(&self, sea: Option<&Sea>) -> impl Iterator<Item = (Arc<Object>, Pose)> {
        let sea = sea.filter(|_| self.shows_waves());
        let objects = self.scene.objects.iter().filter(|_| self.scene.shows_objects());
        objects.filter_map(move |standing| {
            let pose = standing.pose(self.scene.land, self.scene.water, self.scene.lakes, sea)?;
            Some((standing.object.clone(), pose))
        })
    }

    /// The scene's objects, as they stand on the ground and on a sea at its instant; without those that have nowhere to stand.
    pub fn placed(&self, sea: Option<&Sea>) -> Vec<Placed> {
        let mut placed: Vec<Placed> =
            self.standing(sea).map(|(object, pose)| Placed { object, pose, sunny: [1.0; 4] }).collect();
        let Some(first) = placed.first().map(|placed| placed.pose.origin) else { return placed };
        let rays: Vec<LocalRay> = placed
            .iter()
            .flat_map(|placed| {
                let (low, high) = placed.object.bounds();
                let foot = (placed.pose.origin - first).as_vec3();
                [0.0, 1.0, 2.0, 3.0].map(|third| {
                    let height = low.z + (high.z - low.z) * third / 3.0;
                    // What is in the ground is as sunny as the ground.
                    let up =
                        (placed.pose.axes.z_axis * height).max(Vec3::new(-1e6, -1e6, 0.05 * self.ground.spacing()));
                    LocalRay::new(foot + up, self.sun)
                })
            })
            .collect();
        let mut hidden = vec![false; rays.len()];
        self.ground.land.caster(first).any_hits(&rays, &mut hidden);
        for (placed, hidden) in placed.iter_mut().zip(hidden.as_chunks::<4>().0) {
            placed.sunny = hidden.map(|hidden| f32::from(u8::from(!hidden)));
        }
        placed
    }

    /// The objects that a view sees.
    pub(super) fn things(&self, sea: Option<&Sea>, view: &View) -> Option<Things> {
        Things::new(self.standing(sea), view)
    }

    /// What rays from the eye meet, each given its distance to the ground (m) and the sea before that: the land, its water or an object before them.
    pub(super) fn objects_before(&self, lens: &Lens, rays: &[LocalRay], ahead: &mut [Ahead]) {
        if let Some(things) = &lens.things {
            things.before(lens.eye, rays, ahead);
        }
    }

    /// An object's light.
    pub(super) fn object(&self, lens: &Lens, look: &Look, thing: &Thing) -> Shaded {
        let Thing { position, normal, albedo } = *thing;
        let at = position.truncate();
        let over = self.ground.land.height_at(at).map_or(f32::INFINITY, |ground| position.z as f32 - ground);
        let sky = irradiance(&self.skylight.above(at, over), normal);
        let mut shaded = Shaded { light: albedo / PI * sky, ..Shaded::default() };
        let facing = normal.dot(self.sun);
        if facing > 0.0 {
            shaded.sunlit = albedo / PI * self.air.sunlight(position.z as f32) * facing;
            let lift = 0.02 * self.ground.spacing() + 1.5e-4 * look.distance;
            let origin = (position - lens.eye).as_vec3() + Vec3::Z * lift;
            shaded.shadow = Some(LocalRay::new(origin, self.to_sun(look.pattern, look.index)));
        }
        shaded
    }
}
