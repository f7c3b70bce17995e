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
    pub fn from_wkt(wkt: &str) -> Crs {
        crate::wkt::horizontal(wkt).unwrap_or(Crs::Unknown)
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
    name: String,
}

impl Projector {
    /// The error is a sentence that says why there is no way.
    pub(crate) fn new(crs: &Crs) -> Result<Projector, String> {
        let (name, words) = match crs {
            Crs::Projected { name, definition: Some(words), .. } => (name, words),
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
        // Grids of datum shifts are files of their own. Without them NAD27 is shifted by the mean of the contiguous United
        // States (−8, 160, 176 m, good to about 10 m there: NIMA TR8350.2, 2000, appendix B); other grids are left out.
        let kept = words.split_whitespace().filter(|word| !word.starts_with("+nadgrids")).map(|word| match word {
            "+datum=NAD27" => "+ellps=clrk66 +towgs84=-8,160,176",
            word => word,
        });
        let kept: Vec<&str> = kept.collect();
        let map = proj(&kept.join(" "));
        let map = map.map_err(|error| format!("expected a projection that can be computed, got {name} ({error})"))?;
        let degrees = proj("+proj=longlat +datum=WGS84 +no_defs").map_err(|error| error.to_string())?;
        Ok(Projector { degrees, map, name: name.clone() })
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
        match done {
            Ok(()) if result.is_finite() => Ok(result),
            Ok(()) => Err(format!("expected a place that {} reaches, got {}, {}", self.name, from.x, from.y)),
            Err(error) => {
                Err(format!("expected a place that {} reaches, got {}, {} ({error})", self.name, from.x, from.y))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    /// Texts as `gdalsrsinfo` writes them, and what `gdaltransform` (PROJ 9.1) makes of a place in each
    /// (for Washington from EPSG:4152, since its shift from WGS84 is not in PROJ strings).
    #[test]
    fn nad27_is_shifted_without_a_grid() {
        // The summit of Mount St. Helens: 46.1912° N, 122.1956° W on WGS84; UTM 10 N on NAD27 about 562.2 km, 5 115.4 km.
        let projector = Projector::new(&Crs::from_epsg(26710).expect("known")).expect("computable");
        let at = projector.forward(glam::DVec2::new(-122.1956, 46.1912)).expect("computable");
        let nad83 = Projector::new(&Crs::from_epsg(26910).expect("known")).expect("computable");
        let shift = nad83.forward(glam::DVec2::new(-122.1956, 46.1912)).expect("computable") - at;
        // Between the two systems UTM coordinates differ by about (−94, +202) m there.
        assert!((shift - glam::DVec2::new(-94.0, 202.0)).length() < 15.0, "{shift}");
    }

    const WASHINGTON_OGC: &str = r#"PROJCS["NAD83(HARN) / Washington South (ftUS)",GEOGCS["NAD83(HARN)",DATUM["NAD83_High_Accuracy_Reference_Network",SPHEROID["GRS 1980",6378137,298.257222101,AUTHORITY["EPSG","7019"]],AUTHORITY["EPSG","6152"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4152"]],PROJECTION["Lambert_Conformal_Conic_2SP"],PARAMETER["latitude_of_origin",45.3333333333333],PARAMETER["central_meridian",-120.5],PARAMETER["standard_parallel_1",47.3333333333333],PARAMETER["standard_parallel_2",45.8333333333333],PARAMETER["false_easting",1640416.667],PARAMETER["false_northing",0],UNIT["US survey foot",0.304800609601219,AUTHORITY["EPSG","9003"]],AXIS["Easting",EAST],AXIS["Northing",NORTH],AUTHORITY["EPSG","2927"]]"#;
    const WASHINGTON_ESRI: &str = r#"PROJCS["NAD_1983_HARN_StatePlane_Washington_South_FIPS_4602_Feet",GEOGCS["GCS_North_American_1983_HARN",DATUM["D_North_American_1983_HARN",SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Lambert_Conformal_Conic"],PARAMETER["False_Easting",1640416.667],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",-120.5],PARAMETER["Standard_Parallel_1",47.3333333333333],PARAMETER["Standard_Parallel_2",45.8333333333333],PARAMETER["Latitude_Of_Origin",45.3333333333333],UNIT["US survey foot",0.304800609601219]]"#;
    const EUROPE_WKT2: &str = r#"PROJCRS["ETRS89-extended / LAEA Europe",BASEGEOGCRS["ETRS89",ENSEMBLE["European Terrestrial Reference System 1989 ensemble",MEMBER["European Terrestrial Reference Frame 1989"],ELLIPSOID["GRS 1980",6378137,298.257222101,LENGTHUNIT["metre",1]],ENSEMBLEACCURACY[0.1]],PRIMEM["Greenwich",0,ANGLEUNIT["degree",0.0174532925199433]],ID["EPSG",4258]],CONVERSION["Europe Equal Area 2001",METHOD["Lambert Azimuthal Equal Area",ID["EPSG",9820]],PARAMETER["Latitude of natural origin",52,ANGLEUNIT["degree",0.0174532925199433]],PARAMETER["Longitude of natural origin",10,ANGLEUNIT["degree",0.0174532925199433]],PARAMETER["False easting",4321000,LENGTHUNIT["metre",1]],PARAMETER["False northing",3210000,LENGTHUNIT["metre",1]]],CS[Cartesian,2],AXIS["northing (Y)",north,ORDER[1],LENGTHUNIT["metre",1]],AXIS["easting (X)",east,ORDER[2],LENGTHUNIT["metre",1]]]"#;
    const NETHERLANDS: &str = r#"COMPD_CS["Amersfoort / RD New + NAP height",PROJCS["Amersfoort / RD New",GEOGCS["Amersfoort",DATUM["Amersfoort",SPHEROID["Bessel 1841",6377397.155,299.1528128]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Oblique_Stereographic"],PARAMETER["latitude_of_origin",52.1561605555556],PARAMETER["central_meridian",5.38763888888889],PARAMETER["scale_factor",0.9999079],PARAMETER["false_easting",155000],PARAMETER["false_northing",463000],UNIT["metre",1],AUTHORITY["EPSG","28992"]],VERT_CS["NAP height",VERT_DATUM["Normaal Amsterdams Peil",2005],UNIT["metre",1],AXIS["Gravity-related height",UP],AUTHORITY["EPSG","5709"]],AUTHORITY["EPSG","7415"]]"#;
    const ARCTIC: &str = r#"PROJCS["WGS_1984_Arctic_Polar_Stereographic",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Stereographic_North_Pole"],PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",0.0],PARAMETER["Standard_Parallel_1",71.0],UNIT["Meter",1.0]]"#;

    #[test]
    fn known_systems_project_as_proj_does() {
        let epsg = |code| Crs::from_epsg(code).expect("known");
        for (crs, unit, lonlat, map, tolerance) in [
            (epsg(32610), "metre", [-122.19, 46.2], [562_493.727139249, 5_116_588.09656897], 1e-3),
            (epsg(2927), "US survey foot", [-122.19, 46.2], [1_212_522.80948872, 320_625.568930253], 0.01),
            (
                Crs::from_wkt(WASHINGTON_OGC),
                "US survey foot",
                [-122.19, 46.2],
                [1_212_522.80948872, 320_625.568930253],
                0.01,
            ),
            (
                Crs::from_wkt(WASHINGTON_ESRI),
                "US survey foot",
                [-122.19, 46.2],
                [1_212_522.80948872, 320_625.568930253],
                0.01,
            ),
            (epsg(3035), "metre", [10.5, 47.1], [4_358_987.8490721, 2_665_289.43000956], 1e-3),
            (Crs::from_wkt(EUROPE_WKT2), "metre", [10.5, 47.1], [4_358_987.8490721, 2_665_289.43000956], 1e-3),
            (epsg(3857), "metre", [-122.19, 46.2], [-13_602_128.5800301, 5_812_457.49134197], 1e-3),
            (Crs::from_wkt(ARCTIC), "metre", [-40.0, 72.0], [-1_267_152.61527067, -1_510_133.68161397], 1e-3),
            // Here PROJ knows a shift of the datum that differs by decimetres from the table's.
            (Crs::from_wkt(NETHERLANDS), "metre", [5.4, 52.1], [155_876.81394941, 456_861.618269537], 1.0),
        ] {
            let projector = Projector::new(&crs).unwrap_or_else(|error| panic!("{crs:?}: {error}"));
            let (lonlat, map) = (DVec2::from(lonlat), DVec2::from(map));
            let got = projector.forward(lonlat).expect("within reach");
            assert!((got - map).abs().max_element() < tolerance, "{crs:?}: expected {map}, got {got}");
            let back = projector.inverse(got).expect("within reach");
            assert!((back - lonlat).abs().max_element() < 1e-8, "{crs:?}: {lonlat} came back as {back}");
            assert_eq!(crs.unit(), unit);
        }
    }

    #[test]
    fn texts_say_what_they_name() {
        assert_eq!(Crs::from_wkt(WASHINGTON_OGC).name(), "EPSG:2927");
        assert!(Crs::from_wkt(WASHINGTON_ESRI).name().starts_with("NAD_1983_HARN"));
        assert_eq!(Crs::from_wkt(NETHERLANDS).name(), "EPSG:28992");
        let geographic =
            r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],AUTHORITY["EPSG","4326"]]"#;
        assert_eq!(Crs::from_wkt(geographic), Crs::Geographic { name: "EPSG:4326".into() });
        assert_eq!(Crs::from_wkt(geographic).unit(), "degree");
        let (datum, metres) = crate::VerticalDatum::from_wkt(NETHERLANDS).expect("it has one");
        assert_eq!((datum, metres), (crate::VerticalDatum::Named("EPSG:5709 (NAP height)".into()), 1.0));
        assert_eq!(crate::VerticalDatum::from_wkt(WASHINGTON_OGC), None);
        for (code, metres) in [(26710, 1.0), (2263, US_SURVEY_FOOT), (2222, 0.3048)] {
            let Some(Crs::Projected { metres: got, .. }) = Crs::from_epsg(code) else { panic!("{code}") };
            assert!((got - metres).abs() < 1e-12);
        }
        assert_eq!([Crs::from_epsg(0), Crs::from_epsg(99_999), Crs::from_epsg(u32::MAX)], [None, None, None]);
        assert_eq!(metres_of_unit_name("US survey foot"), Some(US_SURVEY_FOOT));
        assert_eq!([metres_of_unit_name("ft"), metres_of_unit_name("kelvin")], [Some(0.3048), None]);
    }

    #[test]
    fn broken_texts_are_unknown() {
        for cut in 0..NETHERLANDS.len() {
            let _ = (Crs::from_wkt(&NETHERLANDS[..cut]), crate::VerticalDatum::from_wkt(&NETHERLANDS[..cut]));
        }
        let deep = "PROJCS[".repeat(100_000);
        for text in ["", "[", "PROJCS", "PROJCS[", "PROJCS[\"", "PROJCS[]", "a[b[c", &deep, "GEOGCS[\u{e9}\u{e9}"] {
            assert_eq!(Crs::from_wkt(text), Crs::Unknown, "{:.20}", text);
        }
    }
}
