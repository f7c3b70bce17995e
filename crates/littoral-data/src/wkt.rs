//! Well-known text, as far as it is needed: OGC's WKT 1 (GDAL, ESRI's `.prj`) and WKT 2 share one grammar of nested lists.
//!
//! From a text come a name, a kind, a unit, and for the projections met in practice PROJ's words; from a compound system
//! also what heights are counted from.
//!
//! Based on: OGC 01-009, Coordinate transformation services. 2001; OGC 18-010r7, Well-known text representation of
//! coordinate reference systems. 2019; ESRI's names as in GDAL's `morphFromESRI`.

use crate::{Crs, VerticalDatum};

/// `NAME["text", 1.0, WORD, CHILD[…]]`
#[derive(Debug, Default)]
struct Node {
    name: String,
    texts: Vec<String>,
    numbers: Vec<f64>,
    children: Vec<Node>,
}

/// Deeper nesting is a forgery: the deepest true ones have about eight levels.
const DEEPEST: usize = 32;
/// The longest text that is looked at (bytes); true ones have a few thousand.
const LONGEST: usize = 1 << 16;

impl Node {
    /// The first child of one of these names.
    fn child(&self, names: &[&str]) -> Option<&Node> {
        self.children.iter().find(|child| names.contains(&child.name.as_str()))
    }

    /// The first node of one of these names anywhere below.
    fn below(&self, names: &[&str]) -> Option<&Node> {
        self.child(names).or_else(|| self.children.iter().find_map(|child| child.below(names)))
    }

    /// The EPSG code that the node itself carries.
    fn epsg(&self) -> Option<u32> {
        let authority = self.child(&["AUTHORITY", "ID"])?;
        if !authority.texts.first()?.eq_ignore_ascii_case("EPSG") {
            return None;
        }
        match authority.numbers.first() {
            Some(&code) => Some(code as u32),
            None => authority.texts.get(1)?.parse().ok(),
        }
    }

    /// The first text: the name that the node gives to what it describes.
    fn title(&self) -> &str {
        self.texts.first().map_or("", |text| text.as_str())
    }

    /// The factor of the node's own unit of length.
    fn length_unit(&self) -> Option<f64> {
        let unit = self.child(&["UNIT", "LENGTHUNIT"]).or_else(|| self.child(&["CS"])?.child(&["LENGTHUNIT"]));
        let axis = || self.child(&["AXIS"])?.child(&["UNIT", "LENGTHUNIT"]);
        unit.or_else(axis)?.numbers.first().copied().filter(|&factor| factor > 0.0 && factor.is_finite())
    }
}

/// Reads one node from the start of `text`; what is left of it.
fn parse(text: &str, depth: usize) -> Option<(Node, &str)> {
    let text = text.trim_start();
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_'))?;
    let mut node = Node { name: text[..end].to_uppercase(), ..Node::default() };
    let mut rest = text[end..].trim_start().strip_prefix(['[', '('])?;
    if node.name.is_empty() || depth > DEEPEST {
        return None;
    }
    loop {
        rest = rest.trim_start();
        if let Some(quoted) = rest.strip_prefix('"') {
            let end = quoted.find('"')?;
            node.texts.push(quoted[..end].to_owned());
            rest = &quoted[end + 1..];
        } else {
            let end = rest.find([',', ']', ')', '[', '('])?;
            let word = rest[..end].trim();
            if rest[end..].starts_with(['[', '(']) {
                let (child, after) = parse(rest, depth + 1)?;
                node.children.push(child);
                rest = after;
            } else {
                // Bare words (axis directions and kinds) are of no use here.
                node.numbers.extend(word.parse::<f64>().ok());
                rest = &rest[end..];
            }
        }
        rest = rest.trim_start();
        match rest.chars().next()? {
            ',' => rest = &rest[1..],
            ']' | ')' => return Some((node, &rest[1..])),
            _ => return None,
        }
    }
}

const PROJECTED: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const GEOGRAPHIC: [&str; 6] = ["GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS", "BASEGEOGCRS"];
const VERTICAL: [&str; 3] = ["VERT_CS", "VERTCRS", "VERTICALCRS"];

fn root(text: &str) -> Option<Node> {
    let root = parse(text.get(..LONGEST.min(text.len()))?.trim_start_matches('\u{feff}'), 0)?.0;
    // A bound system wraps the one that is meant.
    Some(if root.name == "BOUNDCRS" { root.children.into_iter().next()?.children.into_iter().next()? } else { root })
}

/// The horizontal system of a text.
pub(crate) fn horizontal(text: &str) -> Option<Crs> {
    let root = root(text)?;
    let within = |names: &[&str]| if names.contains(&root.name.as_str()) { Some(&root) } else { root.below(names) };
    let described = |node: &&Node| !node.title().is_empty() || node.epsg().is_some();
    if let Some(node) = within(&PROJECTED).filter(described) {
        let metres = node.length_unit().unwrap_or(1.0);
        let named = node.epsg().and_then(Crs::from_epsg);
        if let Some(Crs::Projected { name, definition, .. }) = named {
            return Some(Crs::Projected { name, metres, definition });
        }
        let name = node.epsg().map_or_else(|| node.title().to_owned(), |code| format!("EPSG:{code}"));
        return Some(Crs::Projected { name, metres, definition: definition(node, metres) });
    }
    let node = within(&GEOGRAPHIC).filter(described)?;
    let name = node.epsg().map_or_else(|| node.title().to_owned(), |code| format!("EPSG:{code}"));
    Some(Crs::Geographic { name })
}

/// What the heights of a text's vertical system are counted from, and metres in one of its units.
pub(crate) fn vertical(text: &str) -> Option<(VerticalDatum, f64)> {
    let root = root(text)?;
    let node = if VERTICAL.contains(&root.name.as_str()) { &root } else { root.below(&VERTICAL)? };
    let name = match node.epsg() {
        Some(code) => format!("EPSG:{code} ({})", node.title()),
        None => node.title().to_owned(),
    };
    Some((VerticalDatum::Named(name), node.length_unit().unwrap_or(1.0)))
}

/// Letters and digits only, in lower case: the spellings of WKT 1, WKT 2 and ESRI differ in the rest.
fn plain(name: &str) -> String {
    name.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect()
}

/// PROJ's words for a projected system.
fn definition(node: &Node, metres: f64) -> Option<String> {
    let method = plain(node.below(&["PROJECTION", "METHOD"])?.title());
    let holder = node.child(&["CONVERSION"]).unwrap_or(node);
    let parameters: Vec<(String, f64)> = (holder.children.iter())
        .filter(|child| child.name == "PARAMETER")
        .filter_map(|child| {
            // Lengths are in the map's unit, or in their own.
            let own = child.child(&["LENGTHUNIT"]).and_then(|unit| unit.numbers.first().copied());
            let name = plain(child.title());
            let factor =
                if name.contains("easting") || name.contains("northing") { own.unwrap_or(metres) } else { 1.0 };
            Some((name, child.numbers.first()? * factor))
        })
        .filter(|(_, value)| value.is_finite())
        .collect();
    let get =
        |names: &[&str]| parameters.iter().find(|(name, _)| names.contains(&name.as_str())).map(|(_, value)| *value);
    let or = |names: &[&str], default: f64| get(names).unwrap_or(default);

    let longitude = or(
        &[
            "centralmeridian",
            "longitudeoforigin",
            "longitudeofcenter",
            "longitudeofnaturalorigin",
            "longitudeoffalseorigin",
            "straightverticallongitudefrompole",
        ],
        0.0,
    );
    let latitude_given = get(&[
        "latitudeoforigin",
        "latitudeofcenter",
        "latitudeofnaturalorigin",
        "latitudeoffalseorigin",
        "centralparallel",
    ]);
    let latitude = latitude_given.unwrap_or(0.0);
    let scale = or(&["scalefactor", "scalefactoratnaturalorigin"], 1.0);
    let first = get(&["standardparallel1", "latitudeof1ststandardparallel", "latitudeofstandardparallel"]);
    let second = get(&["standardparallel2", "latitudeof2ndstandardparallel"]);
    let words = match method.as_str() {
        "transversemercator" | "gausskruger" => {
            format!("+proj=tmerc +lat_0={latitude} +lon_0={longitude} +k={scale}")
        }
        "lambertconformalconic" | "lambertconformalconic2sp" | "lambertconicconformal2sp" if second.is_some() => {
            format!("+proj=lcc +lat_1={} +lat_2={} +lat_0={latitude} +lon_0={longitude}", first?, second?)
        }
        "lambertconformalconic" | "lambertconformalconic1sp" | "lambertconicconformal1sp" => {
            let parallel = first.unwrap_or(latitude);
            format!("+proj=lcc +lat_1={parallel} +lat_0={latitude} +lon_0={longitude} +k_0={scale}")
        }
        "mercatorauxiliarysphere" | "popularvisualisationpseudomercator" => {
            format!("+proj=merc +lon_0={longitude} +k=1")
        }
        "mercator" | "mercator1sp" | "mercator2sp" | "mercatorvarianta" | "mercatorvariantb" => match first {
            Some(parallel) => format!("+proj=merc +lat_ts={parallel} +lon_0={longitude}"),
            None => format!("+proj=merc +lon_0={longitude} +k={scale}"),
        },
        "albers" | "albersconicequalarea" | "albersequalarea" => {
            format!("+proj=aea +lat_1={} +lat_2={} +lat_0={latitude} +lon_0={longitude}", first?, second?)
        }
        "lambertazimuthalequalarea" => format!("+proj=laea +lat_0={latitude} +lon_0={longitude}"),
        "stereographicnorthpole" | "stereographicsouthpole" => {
            let true_at = first.or(latitude_given)?;
            let pole = if method.contains("south") { -90 } else { 90 };
            format!("+proj=stere +lat_0={pole} +lat_ts={true_at} +lon_0={longitude}")
        }
        "polarstereographic" | "polarstereographicvarianta" | "polarstereographicvariantb" => {
            let true_at = first.or(latitude_given)?;
            let pole = if true_at < 0.0 { -90 } else { 90 };
            format!("+proj=stere +lat_0={pole} +lat_ts={true_at} +lon_0={longitude} +k={scale}")
        }
        "obliquestereographic" | "doublestereographic" => {
            format!("+proj=sterea +lat_0={latitude} +lon_0={longitude} +k={scale}")
        }
        "equirectangular" | "equidistantcylindrical" | "platecarree" => {
            format!("+proj=eqc +lat_ts={} +lon_0={longitude}", first.unwrap_or(0.0))
        }
        "sinusoidal" => format!("+proj=sinu +lon_0={longitude}"),
        "cassinisoldner" | "cassini" => format!("+proj=cass +lat_0={latitude} +lon_0={longitude}"),
        "polyconic" | "americanpolyconic" => format!("+proj=poly +lat_0={latitude} +lon_0={longitude}"),
        _ => return None,
    };
    let figure = node.below(&["SPHEROID", "ELLIPSOID"])?;
    let &[radius, inverse, ..] = &figure.numbers[..] else { return None };
    let figure = match inverse {
        _ if method == "mercatorauxiliarysphere" || method.starts_with("popular") => format!("+a={radius} +b={radius}"),
        0.0 => format!("+a={radius} +b={radius}"),
        inverse => format!("+a={radius} +rf={inverse}"),
    };
    let shift = match node.below(&["TOWGS84"]) {
        Some(shift) if [3, 7].contains(&shift.numbers.len()) => {
            let numbers: Vec<String> = shift.numbers.iter().map(f64::to_string).collect();
            format!(" +towgs84={}", numbers.join(","))
        }
        _ => " +towgs84=0,0,0".into(),
    };
    let meridian = node.below(&["PRIMEM"]).and_then(|node| node.numbers.first().copied()).filter(|&angle| angle != 0.0);
    let meridian = meridian.map_or(String::new(), |angle| format!(" +pm={angle}"));
    let units = if metres == 1.0 { "+units=m".to_owned() } else { format!("+to_meter={metres}") };
    let (east, north) =
        (or(&["falseeasting", "eastingatfalseorigin"], 0.0), or(&["falsenorthing", "northingatfalseorigin"], 0.0));
    Some(format!("{words} +x_0={east} +y_0={north} {figure}{shift}{meridian} {units} +no_defs"))
}
