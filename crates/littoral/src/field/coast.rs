//! The built-in coast: an invented headland, a bay with a beach, hills behind, sea bed in front.

use super::{Land, Raster, noise::Fbm};
use glam::DVec2;

/// The coast. Sea level is 0.
pub fn coast() -> Land {
    let side = 1025usize;
    let fbm = Fbm::new(1500.0, 300.0, 9, 7);
    let heights = (0..side * side)
        .map(|i| {
            let at = DVec2::new((i % side) as f64, (i / side) as f64) * 4.0;
            (fbm.at(at).value + (at.y - 1500.0) * 0.08) as f32
        })
        .collect();
    match Raster::new(side, side, DVec2::splat(4.0), heights) {
        Ok(raster) => Land::new(raster),
        Err(error) => unreachable!("{error}"),
    }
}
