//! A good view of any land, chosen by itself.

use super::{Air, Style, Sun, Water};
use crate::field::{Land, coast};
use crate::space::View;
use glam::{DVec2, UVec2};

/// A view with the light, air and style that suit it.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// The camera.
    pub view: View,
    /// The sun.
    pub sun: Sun,
    /// The air.
    pub air: Air,
    /// The style.
    pub style: Style,
}

/// A good view of `land` and `water`, with the light that suits it.
pub fn compose(land: &Land, _water: Option<&Water>, size: UVec2) -> Shot {
    let centre = land.origin() + 0.5 * land.extent();
    let reach = land.extent().max_element();
    let ground = f64::from(land.height_at(centre).unwrap_or(0.0));
    let target = centre.extend(ground);
    let eye = (centre - DVec2::Y * 0.9 * reach).extend(ground + 0.5 * reach);
    Shot {
        view: View::looking_at(eye, target, 0.7, size),
        sun: Sun::new(300f64.to_radians(), 25f64.to_radians()),
        air: Air::default(),
        style: Style::Natural,
    }
}

/// The picture of the [built-in coast](crate::field::coast).
pub fn coast_shot(size: UVec2) -> Shot {
    let (azimuth, elevation) = coast::sun();
    Shot {
        view: coast::view(size),
        sun: Sun::new(azimuth, elevation),
        air: Air { visibility: 40_000.0, ..Air::default() },
        style: Style::Natural,
    }
}
