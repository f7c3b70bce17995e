//! Half-lines.

use glam::DVec3;

/// A half-line from `origin` along `direction`, cut off at `reach`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, in world coordinates (m).
    pub origin: DVec3,
    /// Where it goes. Need not be of unit length: distances along a ray are counted in lengths of this vector.
    pub direction: DVec3,
    /// How far it goes, in lengths of `direction`; infinity for no end.
    pub reach: f64,
}

impl Ray {
    /// A ray without an end.
    pub fn new(origin: DVec3, direction: DVec3) -> Ray {
        Ray { origin, direction, reach: f64::INFINITY }
    }

    /// The segment from `from` to `to`, so that distances along it run from 0 to 1.
    pub fn between(from: DVec3, to: DVec3) -> Ray {
        Ray { origin: from, direction: to - from, reach: 1.0 }
    }

    /// The point `distance` lengths of `direction` along the ray.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}
