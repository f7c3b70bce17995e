//! Where a file's samples lie: in its own coordinate system, in degrees, and in the engine's local metres.

use crate::Crs;
use glam::{DAffine2, DMat2, DVec2};

/// Whether a file's samples stand for areas (pixel centres) or for points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Registration {
    /// Pixels are areas; samples stand for their middles.
    Area,
    /// Samples are points.
    Point,
}

/// From samples to coordinates to local metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Georeference {
    /// GDAL's six numbers: x = g₀ + g₁ c + g₂ r, y = g₃ + g₄ c + g₅ r at pixel *corners*, so that the sample of column c
    /// and row r lies at (c + ½, r + ½). Rows count from the file's first.
    pub geotransform: [f64; 6],
    /// What the file says its pixels are; the geotransform has it settled already.
    pub registration: Registration,
    /// The coordinate system.
    pub crs: Crs,
    /// Columns and rows of the full raster.
    pub size: [usize; 2],
}

impl Georeference {
    /// For a file that says nothing: one metre a pixel, the first row in the north.
    pub fn none(columns: usize, rows: usize) -> Georeference {
        Georeference {
            geotransform: [0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            registration: Registration::Area,
            crs: Crs::Unknown,
            size: [columns, rows],
        }
    }

    /// Coordinates in the file's system from (column, row), where whole numbers are samples.
    pub fn crs_from_sample(&self) -> DAffine2 {
        let g = self.geotransform;
        let linear = DMat2::from_cols(DVec2::new(g[1], g[4]), DVec2::new(g[2], g[5]));
        DAffine2::from_mat2_translation(linear, DVec2::new(g[0], g[3]) + linear * DVec2::splat(0.5))
    }

    /// The six numbers of a world file's text (`.tfw`, `.wld` …), which speaks of pixel centres, as a geotransform of
    /// corners; `None` if the text is not six finite numbers that span an area.
    pub fn geotransform_of_world_file(text: &str) -> Option<[f64; 6]> {
        let mut numbers = text.split_whitespace().map(|word| word.replace(',', ".").parse::<f64>());
        let mut next = || numbers.next()?.ok().filter(|n| n.is_finite());
        // The order is A D B E C F: x steps first, then y, then the middle of the first pixel.
        let [a, d, b, e, c, f] = [next()?, next()?, next()?, next()?, next()?, next()?];
        (a * e - b * d != 0.0).then_some([c - 0.5 * (a + b), a, b, f - 0.5 * (d + e), d, e])
    }
}
