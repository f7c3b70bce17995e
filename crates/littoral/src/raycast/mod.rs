//! What a ray meets first: hits, shadows, lines of sight and viewsheds against the exact surface.
//!
//! The surface is a sheet: the bilinear patches between samples, none where a corner is void, none outside the raster. A
//! ray hits it from above and from below alike, at the first point of the sheet at a distance in [0, reach]; a ray that
//! starts on the sheet hits it at 0. Through holes and under the sheet's edges rays pass.

mod bulk;
mod camera;
mod heights;
mod lanes;
mod profile;
mod scene;
mod section;
mod segments;
mod sight;
mod single;
mod slope;
mod stream;
mod tile;
mod viewshed;
mod walk;

pub use bulk::{RayCaster, Simd};
pub use profile::{ProfilePoint, ProfilePoints, ProfileSummary};
pub use sight::{Curvature, GRAZE, Obstacle, Sight, SightError, Station};
pub use stream::LocalRay;
pub use viewshed::{Viewshed, ViewshedCount};

use crate::field::Land;
use crate::space::Ray;
use glam::{DVec2, DVec3, Vec3};

/// Where a ray meets the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of its direction.
    pub distance: f64,
    /// The point, in world coordinates (m).
    pub position: DVec3,
    /// Upward unit normal of the surface there.
    pub normal: Vec3,
}

impl Land {
    /// The first point at which `ray` meets the surface, from above or below, in full `f64`. Rays whose numbers are not
    /// finite or whose direction is zero meet nothing; the reach may be infinite.
    pub fn first_hit(&self, ray: &Ray) -> Option<Hit> {
        walk::first_crossing(self, ray, true).map(|crossing| self.hit(ray, crossing))
    }

    /// [`Land::first_hit`] without the pyramid: every patch under the ray is looked at, one by one. The yardstick for
    /// tests; slow.
    pub fn first_hit_patch_by_patch(&self, ray: &Ray) -> Option<Hit> {
        walk::first_crossing(self, ray, false).map(|crossing| self.hit(ray, crossing))
    }

    /// Whether `ray` meets the surface anywhere from its origin to its reach.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        walk::first_crossing(self, ray, true).is_some()
    }

    fn hit(&self, ray: &Ray, crossing: walk::Crossing) -> Hit {
        let normal = self.patch_normal(crossing.column, crossing.row, crossing.at);
        Hit { distance: crossing.distance, position: ray.at(crossing.distance), normal }
    }

    /// The upward unit normal within a patch without a void corner.
    fn patch_normal(&self, column: usize, row: usize, at: DVec2) -> Vec3 {
        let (heights, columns) = (self.raster().heights(), self.raster().columns());
        let sample = |i, j| f64::from(heights[(row + j) * columns + column + i]);
        let [a, b, c, d] = [sample(0, 0), sample(1, 0), sample(0, 1), sample(1, 1)];
        let slope = DVec2::new((b - a) * (1.0 - at.y) + (d - c) * at.y, (c - a) * (1.0 - at.x) + (d - b) * at.x);
        let slope = slope / self.raster().spacing();
        DVec3::new(-slope.x, -slope.y, 1.0).normalize().as_vec3()
    }
}
