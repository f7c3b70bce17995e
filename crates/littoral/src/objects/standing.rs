//! Where an object stands.

use super::Object;
use crate::field::{Lakes, Land, Sea, Water};
use crate::space::View;
use glam::{DVec2, DVec3, Mat3, Quat, Vec2, Vec3};
use std::sync::Arc;

/// What a thing stands on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Footing {
    /// The water where there is any, on which it floats, rises and leans with the waves; else the ground.
    #[default]
    Surface,
    /// The ground, be it under water.
    Ground,
}

/// An object somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// What stands there.
    pub object: Arc<Object>,
    /// Where its origin is (m).
    pub place: DVec2,
    /// By how much it is turned clockwise, seen from above (rad).
    pub heading: f64,
    /// By how much it is enlarged, over 0.
    pub scale: f64,
    /// What it stands on.
    pub footing: Footing,
}

/// How an object lies in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where its origin is (m).
    pub origin: DVec3,
    /// Where its axes point, each as long as a metre of it is here.
    pub axes: Mat3,
}

impl Standing {
    /// An object upon ground or water at a place (m), as it was modelled.
    pub fn at(object: &Arc<Object>, place: DVec2) -> Standing {
        Standing { object: object.clone(), place, heading: 0.0, scale: 1.0, footing: Footing::Surface }
    }

    /// How it lies: on the ground of the full data, or afloat on a lake, on still water, or on that of a sea at its instant. `None` where there is nothing to stand on.
    pub fn pose(&self, land: &Land, water: Option<&Water>, lakes: Option<&Lakes>, sea: Option<&Sea>) -> Option<Pose> {
        let floats = self.footing == Footing::Surface;
        let afloat = water.filter(|water| floats && water.covers(self.place));
        let lake = || lakes.filter(|_| floats)?.at(land, self.place);
        let (height, slope) = match (afloat, sea) {
            (Some(_), Some(sea)) => {
                // Waves narrower than it is do not lift it.
                let (low, high) = self.object.bounds();
                let width = (high - low).truncate().max_element() * self.scale as f32;
                let surface = sea.surface_at(self.place, width);
                (surface.height, surface.slope)
            }
            (Some(water), None) => (water.level, Vec2::ZERO),
            (None, _) => {
                let height = lake().map_or_else(|| land.height_at(self.place).map(f64::from), |lake| Some(lake.level));
                (height?, Vec2::ZERO)
            }
        };
        let leaning = Quat::from_rotation_arc(Vec3::Z, Vec3::new(-slope.x, -slope.y, 1.0).normalize());
        let turned = Quat::from_rotation_z(-self.heading as f32);
        let axes = Mat3::from_quat(leaning * turned) * self.scale as f32;
        Some(Pose { origin: self.place.extend(height), axes })
    }
}

impl Pose {
    /// Where a point of the object is (m).
    pub fn world(&self, position: Vec3) -> DVec3 {
        self.origin + (self.axes * position).as_dvec3()
    }

    /// The form of an object that a view is worth: the coarsest whose error is within the view's tolerance from wherever it stands nearest to the eye. `None` where nothing of
    /// it is in the frame.
    pub fn form(&self, object: &Object, view: &View) -> Option<usize> {
        let (middle, radius) = object.ball();
        let scale = self.axes.z_axis.length();
        let (middle, radius) = ((self.world(middle) - view.eye).as_vec3(), radius * scale);
        let seen = view.may_see(middle, radius);
        let distance = (middle.length() - radius).max(View::NEAR);
        // Error · focal length / distance, in pixels.
        let error = view.tolerance_pixels * distance / (view.pixels_per_radian * scale);
        seen.then(|| object.form_within(error))
    }
}
