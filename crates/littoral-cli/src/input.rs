//! What is typed: coordinates, sizes, angles.

use glam::{DVec2, DVec3, DVec4, UVec2};
use std::ffi::OsString;

/// Lets negative numbers through: a parser takes `-155.2,19.4` for options. Arguments that can only be numbers get a
/// space in front, which all parsers here trim.
pub fn shielded(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut verbatim = false;
    arguments
        .map(|argument| {
            let Some(text) = argument.to_str() else { return argument };
            verbatim |= text == "--";
            let negative = text.strip_prefix('-').is_some_and(|rest| {
                rest.starts_with(|c: char| c.is_ascii_digit() || c == '.')
                    && rest.chars().all(|c| c.is_ascii_digit() || "+-.,eE=".contains(c))
            });
            if negative && !verbatim { format!(" {text}").into() } else { argument }
        })
        .collect()
}

/// `N` numbers with commas between.
fn numbers<const N: usize>(text: &str, expected: &str) -> Result<[f64; N], String> {
    let wrong = || format!("expected {expected}, got \"{}\"", text.trim());
    let mut parts = text.split(',').map(|part| part.trim().parse::<f64>());
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = parts.next().and_then(Result::ok).filter(|n| n.is_finite()).ok_or_else(wrong)?;
    }
    if parts.next().is_some() { Err(wrong()) } else { Ok(numbers) }
}

/// `X,Y`.
pub fn xy(text: &str) -> Result<DVec2, String> {
    numbers::<2>(text, "two numbers X,Y without a space").map(DVec2::from)
}

/// `X,Y,Z` or `X,Y,H`.
pub fn xyz(text: &str) -> Result<DVec3, String> {
    numbers::<3>(text, "three numbers X,Y,HEIGHT without spaces").map(DVec3::from)
}

/// `X,Y,X,Y`: two corners.
pub fn window(text: &str) -> Result<DVec4, String> {
    numbers::<4>(text, "two corners X,Y,X,Y without spaces").map(DVec4::from)
}

/// A position whose height may be left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Where.
    pub xy: DVec2,
    /// How high; `None` for on the ground.
    pub z: Option<f64>,
}

/// `X,Y` (on the ground) or `X,Y,Z`.
pub fn target(text: &str) -> Result<Target, String> {
    match text.split(',').count() {
        2 => xy(text).map(|xy| Target { xy, z: None }),
        _ => xyz(text).map(|p| Target { xy: p.truncate(), z: Some(p.z) }),
    }
}

/// `WIDTHxHEIGHT`.
pub fn size(text: &str) -> Result<UVec2, String> {
    let wrong = || format!("expected WIDTHxHEIGHT such as 1280x720, each from 1 to 16384, got \"{}\"", text.trim());
    let (width, height) = text.trim().split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    let side = |text: &str| text.parse::<u32>().ok().filter(|side| (1..=16_384).contains(side)).ok_or_else(wrong);
    Ok(UVec2::new(side(width)?, side(height)?))
}

/// `AZIMUTH,ELEVATION` in degrees.
pub fn sun(text: &str) -> Result<DVec2, String> {
    let sun = DVec2::from(numbers::<2>(text, "AZIMUTH,ELEVATION in degrees, such as 300,25")?);
    match (-90.0..=90.0).contains(&sun.y) {
        true => Ok(sun),
        false => Err(format!("expected an elevation of the sun from -90 to 90 degrees, got {}", sun.y)),
    }
}

/// An instant such as `2026-06-21T18:30Z`, in seconds since the beginning of 1970, UTC.
pub fn moment(text: &str) -> Result<f64, String> {
    let instant: Result<jiff::Timestamp, _> = text.trim().parse();
    instant.map(|instant| instant.as_millisecond() as f64 * 1e-3).map_err(|_| {
        let text = text.trim();
        format!("expected a date and a time with Z or an offset, such as 2026-06-21T18:30Z, got \"{text}\"")
    })
}

/// `LONGITUDE,LATITUDE` in degrees.
pub fn place(text: &str) -> Result<DVec2, String> {
    let place = DVec2::from(numbers::<2>(text, "LONGITUDE,LATITUDE in degrees, such as -155.2,19.4")?);
    match place.x.abs() <= 180.0 && place.y.abs() <= 90.0 {
        true => Ok(place),
        false => Err(format!(
            "expected a longitude within 180 and a latitude within 90 degrees, got {},{}",
            place.x, place.y
        )),
    }
}

/// A number within limits.
pub fn within(text: &str, low: f64, high: f64, what: &str) -> Result<f64, String> {
    let [number] = numbers::<1>(text, what)?;
    if (low..=high).contains(&number) { Ok(number) } else { Err(format!("expected {what}, got {number}")) }
}

/// A vertical angle of view in degrees.
pub fn field_of_view(text: &str) -> Result<f64, String> {
    within(text, 0.1, 170.0, "an angle from 0.1 to 170 degrees")
}

/// A factor for heights.
pub fn factor(text: &str) -> Result<f64, String> {
    within(text, 0.01, 1000.0, "a factor from 0.01 to 1000")
}

/// A positive number.
pub fn positive(text: &str) -> Result<f64, String> {
    within(text, f64::MIN_POSITIVE, 1e12, "a number above 0")
}

/// A tolerance in pixels.
pub fn tolerance(text: &str) -> Result<f64, String> {
    within(text, 1e-3, 1e6, "0.001 to 1000000 pixels")
}

/// An instant in seconds.
pub fn instant(text: &str) -> Result<f64, String> {
    within(text, -1e9, 1e9, "-1e9 to 1e9 seconds")
}

/// Any number.
pub fn number(text: &str) -> Result<f64, String> {
    within(text, -1e12, 1e12, "a number")
}

/// A coefficient of refraction.
pub fn refraction(text: &str) -> Result<f64, String> {
    within(text, -5.0, 0.99, "a coefficient of refraction from -5 to 0.99 (0: straight light; 0.13: a clear day)")
}

/// A level of water, or `none`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WaterLevel {
    /// No water.
    None,
    /// Height (m).
    At(f64),
}

/// `none` or a height.
pub fn water(text: &str) -> Result<WaterLevel, String> {
    match text.trim() {
        "none" => Ok(WaterLevel::None),
        text => within(text, -12_000.0, 9_000.0, "a height in metres, or none").map(WaterLevel::At),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_numbers_are_shielded_and_nothing_else() {
        let words = ["littoral", "-155.2,19.4", "-122,46=-430", "-5", "-.5,1e-3", "--json", "-h", "-1.tif", "--", "-3"];
        let after: Vec<String> =
            shielded(words.iter().map(OsString::from)).into_iter().map(|w| w.into_string().expect("text")).collect();
        let expected =
            ["littoral", " -155.2,19.4", " -122,46=-430", " -5", " -.5,1e-3", "--json", "-h", "-1.tif", "--", "-3"];
        assert_eq!(after, expected);
    }

    #[test]
    fn values_parse_or_say_what_was_expected() {
        assert_eq!(xy(" -155.2,19.4"), Ok(DVec2::new(-155.2, 19.4)));
        assert_eq!(xyz("1,2,3"), Ok(DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(target("1,2"), Ok(Target { xy: DVec2::new(1.0, 2.0), z: None }));
        assert_eq!(target("1,2,3").map(|t| t.z), Ok(Some(3.0)));
        assert_eq!(size("1280x720"), Ok(UVec2::new(1280, 720)));
        assert_eq!(water("none"), Ok(WaterLevel::None));
        for wrong in ["1", "1,2,3", "a,b", "nan,1", "inf,2", "1,,2", ""] {
            assert!(xy(wrong).is_err_and(|e| e.contains("expected two numbers")), "{wrong}");
        }
        for wrong in ["0x5", "1280", "-1x5", "99999x5", "1280x720x3"] {
            assert!(size(wrong).is_err_and(|e| e.contains("WIDTHxHEIGHT")), "{wrong}");
        }
        assert_eq!(moment("2026-06-21T18:30Z"), moment("2026-06-21T20:30:00+02:00"));
        assert_eq!(moment("1970-01-02T00:00:01Z"), Ok(86_401.0));
        for wrong in ["2026-06-21T18:30", "2026-06-31T18:30Z", "noon", ""] {
            assert!(moment(wrong).is_err_and(|e| e.contains("with Z or an offset")), "{wrong}");
        }
        assert_eq!(place("-155.2,19.4"), Ok(DVec2::new(-155.2, 19.4)));
        assert!(place("19.4,-155.2").is_err_and(|e| e.contains("within 90")));
        assert!(sun("300,95").is_err() && field_of_view("0").is_err() && refraction("1").is_err());
    }
}
