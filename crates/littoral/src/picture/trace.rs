//! Rays in bulk.

use crate::field::Land;
use crate::raycast::Hit;
use crate::space::Ray;

/// The first hit of each ray.
pub fn first_hits(land: &Land, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
    hits.clear();
    hits.extend(rays.iter().map(|ray| land.first_hit(ray)));
}

/// Whether each ray meets anything.
pub fn any_hits(land: &Land, rays: &[Ray], hits: &mut Vec<bool>) {
    hits.clear();
    hits.extend(rays.iter().map(|ray| land.any_hit(ray)));
}
