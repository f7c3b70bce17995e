//! What a ray meets first: hits, shadows, lines of sight and viewsheds against the exact surface.

mod profile;
mod section;
mod sight;
mod slope;
mod viewshed;

pub use profile::{ProfilePoint, ProfilePoints, ProfileSummary};
pub use sight::{Curvature, GRAZE, Obstacle, Sight, SightError, Station};
pub use viewshed::{Viewshed, ViewshedCount};

use crate::field::Land;
use crate::space::Ray;
use glam::{DVec3, Vec3};

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
    /// The first point at which `ray` meets the surface, from above or below.
    pub fn first_hit(&self, ray: &Ray) -> Option<Hit> {
        // Marching half a sample at a time: a placeholder of the right shape until the pyramid walk lands.
        let step = 0.5 * self.raster().spacing().min_element() / ray.direction.truncate().length().max(1e-9);
        let below = |t: f64| {
            let p = ray.at(t);
            self.height_at(p.truncate()).map(|h| p.z - f64::from(h))
        };
        let extent = self.extent().length() * 4.0 / ray.direction.length();
        let end = ray.reach.min(extent);
        let (mut t, mut last) = (0.0, below(0.0));
        while t < end {
            let next = (t + step).min(end);
            let here = below(next);
            if let (Some(a), Some(b)) = (last, here)
                && (a > 0.0) != (b > 0.0)
            {
                let distance = t + (next - t) * a / (a - b);
                let position = ray.at(distance);
                let normal = self.normal_at(position.truncate()).unwrap_or(Vec3::Z);
                return Some(Hit { distance, position, normal });
            }
            (t, last) = (next, here);
        }
        None
    }

    /// Whether anything lies between the ends of `ray`.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.first_hit(ray).is_some()
    }
}
