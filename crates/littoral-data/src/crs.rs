//! Coordinate systems: what a file names, and what little the engine needs to know of it.
//!
//! The engine places a raster in metres about its middle, so it needs a coordinate system's kind and unit, and PROJ's
//! words for it where degrees have to be turned into its coordinates. EPSG codes are looked up in the `crs-definitions`
//! table; UTM's zones are also built by rule.

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

/// Metres in a foot of the United States' old surveys.
pub(crate) const US_SURVEY_FOOT: f64 = 1200.0 / 3937.0;

impl Crs {
    /// What the file calls it; `unknown` where it says nothing.
    pub fn name(&self) -> &str {
        match self {
            Crs::Unknown => "unknown",
            Crs::Geographic { name } | Crs::Projected { name, .. } => name,
        }
    }

    /// What its coordinates are counted in: `degree`, `metre`, `foot`, `US survey foot`, `unknown`, or so many metres.
    pub fn unit(&self) -> String {
        match self {
            Crs::Unknown => "unknown".into(),
            Crs::Geographic { .. } => "degree".into(),
            Crs::Projected { metres, .. } => name_of_unit(*metres),
        }
    }

    /// The system of an EPSG code; `None` for a code that is not known.
    pub fn from_epsg(code: u32) -> Option<Crs> {
        let name = format!("EPSG:{code}");
        let words = u16::try_from(code).ok().and_then(crs_definitions::from_code)?.proj4;
        match Crs::from_proj(words) {
            Crs::Unknown => None,
            Crs::Geographic { .. } => Some(Crs::Geographic { name }),
            Crs::Projected { metres, definition, .. } => Some(Crs::Projected { name, metres, definition }),
        }
    }

    /// The system that a WKT text describes (OGC's WKT 1 and 2, ESRI's `.prj`); [`Crs::Unknown`] if it is not understood.
    pub fn from_wkt(_wkt: &str) -> Crs {
        Crs::Unknown
    }

    /// The system that a PROJ string (`+proj=utm +zone=5 +datum=WGS84`) describes; [`Crs::Unknown`] if not understood.
    pub fn from_proj(text: &str) -> Crs {
        let word = |name: &str| {
            text.split_whitespace().find_map(|word| word.trim_start_matches('+').strip_prefix(name)?.strip_prefix('='))
        };
        let metres = match (word("to_meter").and_then(|n| n.parse().ok()), word("units")) {
            (Some(metres), _) if metres > 0.0 => metres,
            (_, Some("ft")) => 0.3048,
            (_, Some("us-ft")) => US_SURVEY_FOOT,
            (_, Some("km")) => 1000.0,
            _ => 1.0,
        };
        match word("proj") {
            None | Some("geocent") => Crs::Unknown,
            Some("longlat" | "latlong" | "latlon" | "lonlat") => Crs::Geographic { name: text.trim().to_owned() },
            Some(_) => {
                Crs::Projected { name: text.trim().to_owned(), metres, definition: Some(text.trim().to_owned()) }
            }
        }
    }
}

/// Metres in a unit of length by its EPSG code.
pub(crate) fn metres_of_unit(code: u32) -> Option<f64> {
    Some(match code {
        9001 => 1.0,
        9002 => 0.3048,
        9003 => US_SURVEY_FOOT,
        9005 => 0.304_797_265_4,
        9014 => 1.8288,
        9030 => 1852.0,
        9036 => 1000.0,
        9037 => 0.914_391_795_4,
        9039 => 0.201_166_195_164,
        9040 => 0.914_398_414_616_028_7,
        9041 => 0.304_799_471_538_676_2,
        9080 => 0.304_799_510_248_146_94,
        9084 => 0.914_398_530_744_440_8,
        9093 => 1609.344,
        9094 => 0.304_799_710_181_508_8,
        9096 => 0.9144,
        1025 => 0.001,
        1033 => 0.01,
        _ => return None,
    })
}

/// Metres in a vertical unit as files spell it; `None` for words that name no length.
pub fn metres_of_unit_name(name: &str) -> Option<f64> {
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    Some(match plain.as_str() {
        "m" | "metre" | "metres" | "meter" | "meters" => 1.0,
        "ft" | "foot" | "feet" | "internationalfoot" | "internationalfeet" | "footinternational" => 0.3048,
        "usft" | "ftus" | "ussurveyfoot" | "ussurveyfeet" | "footus" | "surveyfoot" => US_SURVEY_FOOT,
        "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => 0.01,
        "dm" | "decimetre" | "decimetres" | "decimeter" | "decimeters" => 0.1,
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => 0.001,
        "km" | "kilometre" | "kilometres" | "kilometer" | "kilometers" => 1000.0,
        "fathom" | "fathoms" => 1.8288,
        "yd" | "yard" | "yards" => 0.9144,
        _ => return None,
    })
}

/// What a unit of so many metres is called.
pub fn name_of_unit(metres: f64) -> String {
    match metres {
        1.0 => "metre".into(),
        0.3048 => "foot".into(),
        m if (m - US_SURVEY_FOOT).abs() < 1e-9 => "US survey foot".into(),
        1000.0 => "kilometre".into(),
        m => format!("{m} m"),
    }
}

/// The part of a geographic system's PROJ words that speaks of its figure of the Earth.
pub(crate) fn ellipsoid_words(code: u32) -> Option<String> {
    let words = u16::try_from(code).ok().and_then(crs_definitions::from_code)?.proj4;
    let kept = words.split_whitespace().filter(|word| !word.starts_with("+proj=") && *word != "+no_defs");
    Some(kept.collect::<Vec<_>>().join(" "))
}

/// Turns WGS84 degrees into a projected system's coordinates and back.
pub(crate) struct Projector {
    degrees: proj4rs::Proj,
    map: proj4rs::Proj,
    metres: f64,
    name: String,
}

impl Projector {
    /// The error is a sentence that says why there is no way.
    pub(crate) fn new(crs: &Crs) -> Result<Projector, String> {
        let (name, metres, words) = match crs {
            Crs::Projected { name, metres, definition: Some(words) } => (name, *metres, words),
            Crs::Unknown => {
                return Err(
                    "expected a file that states its coordinate system, got none; give its own coordinates".into()
                );
            }
            crs => {
                return Err(format!(
                    "expected a coordinate system that can be computed, got {}; give the file's own coordinates",
                    crs.name()
                ));
            }
        };
        let proj = |words: &str| proj4rs::Proj::from_proj_string(words);
        // Grids of datum shifts are files of their own; without them the shift is left out.
        let kept: Vec<&str> = words.split_whitespace().filter(|word| !word.starts_with("+nadgrids")).collect();
        let map = proj(words).or_else(|_| proj(&kept.join(" ")));
        let map = map.map_err(|error| format!("expected a projection that can be computed, got {name} ({error})"))?;
        let degrees = proj("+proj=longlat +datum=WGS84 +no_defs").map_err(|error| error.to_string())?;
        Ok(Projector { degrees, map, metres, name: name.clone() })
    }

    /// Coordinates from longitude and latitude (degrees).
    pub(crate) fn forward(&self, lonlat: glam::DVec2) -> Result<glam::DVec2, String> {
        let mut point = (lonlat.x.to_radians(), lonlat.y.to_radians(), 0.0);
        let done = proj4rs::transform::transform(&self.degrees, &self.map, &mut point);
        self.finite(done, glam::DVec2::new(point.0, point.1), lonlat)
    }

    /// Longitude and latitude (degrees) from coordinates.
    pub(crate) fn inverse(&self, at: glam::DVec2) -> Result<glam::DVec2, String> {
        let mut point = (at.x, at.y, 0.0);
        let done = proj4rs::transform::transform(&self.map, &self.degrees, &mut point);
        self.finite(done, glam::DVec2::new(point.0.to_degrees(), point.1.to_degrees()), at)
    }

    fn finite(
        &self,
        done: Result<(), proj4rs::errors::Error>,
        result: glam::DVec2,
        from: glam::DVec2,
    ) -> Result<glam::DVec2, String> {
        let _ = self.metres;
        match done {
            Ok(()) if result.is_finite() => Ok(result),
            Ok(()) => Err(format!("expected a place that {} reaches, got {}, {}", self.name, from.x, from.y)),
            Err(error) => {
                Err(format!("expected a place that {} reaches, got {}, {} ({error})", self.name, from.x, from.y))
            }
        }
    }
}
