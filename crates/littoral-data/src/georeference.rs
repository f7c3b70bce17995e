//! Where a file's samples lie: in its own coordinate system, in degrees, and in the engine's local metres.

use glam::{DAffine2, DMat2, DVec2};

/// Whether a file's samples stand for areas (pixel centres) or for points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Registration {
    /// Pixels are areas; samples stand for their middles.
    Area,
    /// Samples are points.
    Point,
}

/// The coordinate system of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Crs {
    /// Not stated.
    Unknown,
    /// Longitude and latitude in degrees.
    Geographic {
        /// What the file calls it, such as `EPSG:4326`.
        name: String,
    },
    /// Eastings and northings.
    Projected {
        /// What the file calls it, such as `EPSG:32610`.
        name: String,
        /// Metres in one unit of its coordinates.
        metres: f64,
    },
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
}
