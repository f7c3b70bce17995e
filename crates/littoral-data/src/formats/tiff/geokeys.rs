//! Where a GeoTIFF's samples lie and what they are counted in: GeoKeys and tie points.
//!
//! Based on: OGC 19-008r4. GeoTIFF standard 1.1. 2019.

use super::directory::{Container, Directory};
use super::image::tag;
use crate::crs::{Crs, metres_of_unit};
use crate::{Registration, VerticalDatum};
use std::collections::HashMap;

/// What the georeferencing tags say, each as far as it says something.
pub(super) struct Placement {
    pub geotransform: Option<[f64; 6]>,
    pub registration: Registration,
    pub crs: Crs,
    pub vertical_metres: Option<f64>,
    pub vertical_datum: VerticalDatum,
    pub warnings: Vec<String>,
}

/// One GeoKey's value.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Code(u16),
    Number(f64),
    Text(String),
}

/// A directory's keys by their numbers.
struct Keys(HashMap<u16, Value>);

/// The code that says "not one of the list: see the other keys".
const USER_DEFINED: u16 = 32767;

/// Reads the georeferencing tags of a directory.
pub(super) fn placement(file: &Container, directory: &Directory) -> Placement {
    let keys = Keys::read(file, directory);
    let mut warnings = Vec::new();
    let registration = if keys.code(1025) == Some(2) { Registration::Point } else { Registration::Area };
    let crs = crs(&keys, &mut warnings);

    let geotransform = geotransform(file, directory, registration, &mut warnings);
    let vertical = keys.code(4096).filter(|&code| code != USER_DEFINED);
    let datum_name = vertical.and_then(vertical_name).map(str::to_owned);
    let vertical_datum = match (vertical, keys.text(4097), keys.code(4098)) {
        (Some(code), _, _) if datum_name.is_some() => {
            VerticalDatum::Named(format!("EPSG:{code} ({})", datum_name.unwrap_or_default()))
        }
        (Some(code), Some(name), _) => VerticalDatum::Named(format!("EPSG:{code} ({name})")),
        (Some(code), None, _) => VerticalDatum::Named(format!("EPSG:{code}")),
        (None, Some(name), _) => VerticalDatum::Named(name),
        (None, None, Some(code)) if code != USER_DEFINED => VerticalDatum::Named(format!("datum EPSG:{code}")),
        _ => VerticalDatum::Unknown,
    };
    if vertical.is_some_and(|code| matches!(code, 5715 | 5706 | 5612 | 5861 | 5866 | 5862 | 6357 | 6358)) {
        warnings
            .push("the vertical system counts depth downward; the numbers are taken as heights all the same".into());
    }
    let vertical_metres = match keys.code(4099) {
        Some(unit) => {
            let metres = metres_of_unit(unit.into());
            if metres.is_none() {
                warnings.push(format!("the vertical unit EPSG:{unit} is unknown; metres are taken"));
            }
            metres
        }
        None => vertical.and_then(|code| match code {
            5702 | 6360 | 6358 => Some(crate::crs::US_SURVEY_FOOT),
            8228 | 5754 | 6357 => Some(0.3048),
            _ => None,
        }),
    };
    Placement { geotransform, registration, crs, vertical_metres, vertical_datum, warnings }
}

impl Keys {
    /// All keys of a directory that can be made sense of.
    fn read(file: &Container, directory: &Directory) -> Keys {
        let table = file.unsigneds(directory, tag::GEO_KEYS).ok().flatten().unwrap_or_default();
        let doubles = file.doubles(directory, tag::GEO_DOUBLES);
        let text = file.text_bytes(directory, tag::GEO_TEXT);
        let mut keys = HashMap::new();
        let count = table.get(3).copied().unwrap_or(0) as usize;
        for entry in table.get(4..).unwrap_or_default().chunks_exact(4).take(count) {
            let &[key, place, count, at] = entry else { continue };
            let at = at as usize;
            let value = match place {
                0 => Some(Value::Code(at as u16)),
                34736 => doubles.get(at).copied().map(Value::Number),
                34737 => text.get(at..(at + count as usize).min(text.len())).map(|bytes| {
                    Value::Text(String::from_utf8_lossy(bytes).trim_end_matches(['|', '\0', ' ']).to_owned())
                }),
                _ => None,
            };
            if let Some(value) = value {
                keys.insert(key as u16, value);
            }
        }
        Keys(keys)
    }

    /// A code other than 0, which stands for "undefined".
    fn code(&self, key: u16) -> Option<u16> {
        match self.0.get(&key) {
            Some(&Value::Code(code)) if code != 0 => Some(code),
            _ => None,
        }
    }

    /// A text that is not empty.
    fn text(&self, key: u16) -> Option<String> {
        match self.0.get(&key) {
            Some(Value::Text(text)) if !text.is_empty() => Some(text.clone()),
            _ => None,
        }
    }

    /// A finite number.
    fn number(&self, key: u16) -> Option<f64> {
        match self.0.get(&key) {
            Some(&Value::Number(number)) if number.is_finite() => Some(number),
            _ => None,
        }
    }

    /// Metres in a unit of the projected coordinates.
    fn unit(&self) -> Option<f64> {
        self.code(3076).and_then(|code| metres_of_unit(code.into())).or(self.number(3077))
    }
}

/// Tags 33550, 33922 and 34264 as GDAL's six numbers, corners of pixels in any case.
fn geotransform(
    file: &Container,
    directory: &Directory,
    registration: Registration,
    warnings: &mut Vec<String>,
) -> Option<[f64; 6]> {
    let scale = file.doubles(directory, tag::PIXEL_SCALE);
    let ties = file.doubles(directory, tag::TIE_POINTS);
    let matrix = file.doubles(directory, tag::TRANSFORMATION);
    let mut transform = if let ([sx, sy, ..], [i, j, _, x, y, _, ..]) = (&scale[..], &ties[..]) {
        // The scale's y counts northward, rows southward. A negative one is a south-up grid.
        [x - i * sx, *sx, 0.0, y + j * sy, 0.0, -sy]
    } else if let [a, b, _, d, e, f, _, h, ..] = matrix[..] {
        [d, a, b, h, e, f]
    } else {
        if ties.len() > 6 {
            warnings.push(
                "the image is placed by control points only, which are not used; `gdalwarp in.tif out.tif` makes a grid of it"
                    .into(),
            );
        }
        return None;
    };
    if !transform.iter().all(|number| number.is_finite()) || transform[1] * transform[5] == transform[2] * transform[4]
    {
        warnings.push("the georeference is not one of a grid (no area or not finite) and is left out".into());
        return None;
    }
    if registration == Registration::Point {
        let [_, a, b, _, d, e] = transform;
        transform[0] -= 0.5 * (a + b);
        transform[3] -= 0.5 * (d + e);
    }
    Some(transform)
}

/// The horizontal system.
fn crs(keys: &Keys, warnings: &mut Vec<String>) -> Crs {
    let unit = keys.unit();
    let projected = keys.code(3072);
    if let Some(code) = projected.filter(|&code| code != USER_DEFINED) {
        return match Crs::from_epsg(code.into()) {
            Some(Crs::Projected { name, metres, definition }) => {
                Crs::Projected { name, metres: unit.unwrap_or(metres), definition }
            }
            Some(other) => other,
            None => Crs::Projected { name: format!("EPSG:{code}"), metres: unit.unwrap_or(1.0), definition: None },
        };
    }
    let model = keys.code(1024);
    if projected.is_some() || model == Some(1) {
        let definition = definition(keys);
        let name = keys.text(3073).or(keys.text(1026)).unwrap_or_else(|| "user-defined projection".into());
        if let Some(wkt) = name.strip_prefix("ESRI PE String = ") {
            return Crs::from_wkt(wkt);
        }
        return Crs::Projected { name, metres: unit.unwrap_or(1.0), definition };
    }
    if let Some(code) = keys.code(2048) {
        if code == USER_DEFINED {
            return Crs::Geographic { name: keys.text(2049).unwrap_or_else(|| "user-defined ellipsoid".into()) };
        }
        return Crs::from_epsg(code.into()).unwrap_or(Crs::Geographic { name: format!("EPSG:{code}") });
    }
    match model {
        Some(2) => Crs::Geographic { name: keys.text(2049).unwrap_or_else(|| "geographic, not named".into()) },
        Some(3) => {
            warnings
                .push("the coordinates are geocentric, which a grid of heights cannot be; they are left out".into());
            Crs::Unknown
        }
        _ => Crs::Unknown,
    }
}

/// PROJ's words for a projection given by its parameters; `None` for methods that are not among the common ones.
fn definition(keys: &Keys) -> Option<String> {
    // EPSG's conversions 16001 … 16160 are UTM's zones; they stand alone.
    let base = match keys.code(2048) {
        Some(code) if code != USER_DEFINED => crate::crs::ellipsoid_words(code.into())?,
        _ => match (keys.code(2056), keys.number(2057), keys.number(2059)) {
            (_, Some(a), Some(inverse)) => format!("+a={a} +rf={inverse}"),
            (Some(7004), ..) => "+ellps=bessel".into(),
            (Some(7008), ..) => "+ellps=clrk66".into(),
            (Some(7019), ..) => "+ellps=GRS80".into(),
            (Some(7022), ..) => "+ellps=intl".into(),
            _ => "+datum=WGS84".into(),
        },
    };
    if let Some(zone) = keys.code(3074).filter(|zone| (16001..=16060).contains(zone) || (16101..=16160).contains(zone))
    {
        let south = if zone > 16100 { " +south" } else { "" };
        return Some(format!("+proj=utm +zone={}{south} {base} +units=m +no_defs", (zone - 16000) % 100));
    }
    let any = |options: &[u16]| options.iter().find_map(|&key| keys.number(key)).unwrap_or(0.0);
    let unit = keys.unit().unwrap_or(1.0);
    let (east, north) = (any(&[3082, 3086, 3090]) * unit, any(&[3083, 3087, 3091]) * unit);
    let (longitude, latitude) = (any(&[3080, 3084, 3088, 3095]), any(&[3081, 3085, 3089]));
    let scale = keys.number(3092).or(keys.number(3093)).unwrap_or(1.0);
    let (first, second) = (any(&[3078]), any(&[3079]));
    let method = match keys.code(3075)? {
        1 => format!("+proj=tmerc +lat_0={latitude} +lon_0={longitude} +k={scale}"),
        7 => format!("+proj=merc +lon_0={longitude} +k={scale}"),
        8 => format!("+proj=lcc +lat_1={first} +lat_2={second} +lat_0={latitude} +lon_0={longitude}"),
        9 => format!("+proj=lcc +lat_1={latitude} +lat_0={latitude} +lon_0={longitude} +k_0={scale}"),
        10 => format!("+proj=laea +lat_0={latitude} +lon_0={longitude}"),
        11 => format!("+proj=aea +lat_1={first} +lat_2={second} +lat_0={latitude} +lon_0={longitude}"),
        15 => format!(
            "+proj=stere +lat_0={} +lat_ts={latitude} +lon_0={longitude} +k={scale}",
            if latitude < 0.0 { -90 } else { 90 }
        ),
        17 => format!("+proj=eqc +lat_ts={first} +lat_0={latitude} +lon_0={longitude}"),
        24 => format!("+proj=sinu +lon_0={longitude}"),
        _ => return None,
    };
    let units = if unit == 1.0 { "+units=m".into() } else { format!("+to_meter={unit}") };
    Some(format!("{method} +x_0={east} +y_0={north} {base} {units} +no_defs"))
}

/// Names of the vertical systems met most often.
fn vertical_name(code: u16) -> Option<&'static str> {
    Some(match code {
        3855 => "EGM2008 height",
        5773 => "EGM96 height",
        5798 => "EGM84 height",
        5702 => "NGVD29 height (ftUS)",
        5703 => "NAVD88 height",
        5103 => "NAVD88",
        6360 => "NAVD88 height (ftUS)",
        8228 => "NAVD88 height (ft)",
        5701 => "ODN height",
        5709 => "NAP height",
        5710 => "Ostend height",
        5711 => "AHD height",
        5714 => "mean sea level height",
        5715 => "mean sea level depth",
        5720 => "NGF-IGN69 height",
        5728 => "LN02 height",
        5729 => "LHN95 height",
        5730 => "EVRF2000 height",
        5621 => "EVRF2007 height",
        5783 => "DHHN92 height",
        7837 => "DHHN2016 height",
        5713 => "CGVD28 height",
        6647 => "CGVD2013 height",
        7839 => "NZVD2016 height",
        5778 => "GHA height",
        5861 => "LAT depth",
        5866 => "MLLW depth",
        6357 => "NAVD88 depth (ft)",
        6358 => "NAVD88 depth (ftUS)",
        _ => return None,
    })
}
