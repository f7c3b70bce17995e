//! The set-up of 2016 on a plane: relief as large and rough as a globe's, seen from 300 km up.

use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::Fbm;
use littoral::field::{Land, Raster};
use littoral::space::View;

/// Samples of the paper's map from west to east; half as many from south to north.
pub const COLUMNS: usize = 16_384;

/// The land in so many columns, a power of two from 1024 up.
pub fn land(columns: usize) -> Land {
    let rows = columns / 2;
    let step = 2_446.0 * (COLUMNS / columns) as f64;
    // Continents, and mountains that repeat sixteen times: what counts is how rough it is.
    let (continents, mountains) = (Fbm::new(8e6, 3000.0, 5, 1), Fbm::new(4e5, 900.0, 7, 2));
    let tile = |side: usize, step: f64, noise: &Fbm| -> Vec<f32> {
        let at = |i: usize| DVec2::new((i % side) as f64, (i / side) as f64) * step;
        (0..side * side).map(|i| noise.at(at(i)).value as f32).collect()
    };
    let (side, period) = (columns / 16 + 1, columns / 16);
    let (coarse, fine) = (tile(side, 16.0 * step, &continents), tile(period, step, &mountains));
    let mut heights = Vec::with_capacity(columns * rows);
    for j in 0..rows {
        for i in 0..columns {
            let (x, y) = (i / 16, j / 16);
            let (u, v) = ((i % 16) as f32 / 16.0, (j % 16) as f32 / 16.0);
            let at = |x: usize, y: usize| coarse[y * side + x];
            let south = at(x, y) + (at(x + 1, y) - at(x, y)) * u;
            let north = at(x, y + 1) + (at(x + 1, y + 1) - at(x, y + 1)) * u;
            heights.push(south + (north - south) * v + fine[(j % period) * period + i % period]);
        }
    }
    Land::new(Raster::new(columns, rows, DVec2::splat(step), heights).expect("sizes are valid"))
}

/// From 300 km up, a picture of 1920 × 1080 pixels.
pub fn view(tolerance_pixels: f32) -> View {
    let eye = DVec3::new(0.0, -3e5, 3e5);
    let view = View::looking_at(eye, DVec3::new(0.0, 8e5, 0.0), 50f32.to_radians(), UVec2::new(1920, 1080));
    View { tolerance_pixels, ..view }
}
