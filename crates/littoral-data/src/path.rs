//! Flight paths as readable text.
//!
//! ```toml
//! version = 1
//! coordinates = "file"        # as the height file's own; or "lonlat" (degrees), "metres" (from its middle)
//! interpolation = "smooth"    # or "straight", "catmull-rom"
//! speed = 60                  # metres a second; or duration = 30 (seconds for the whole path)
//!
//! [[point]]
//! at = [560805, 5116000]
//! above = 300                 # metres above the ground; or z = 2400 (metres above sea level)
//! look_at = [562000, 5117000] # or heading = 90, pitch = -10 (degrees); neither: where the path goes
//! ```
//!
//! What is left out has the defaults of [`FlightPath`]. Unknown keys are errors, with the line they stand in: a
//! misspelled `abov` must not become a path on the ground.

use crate::{Error, write};
use glam::DVec2;
use littoral::flight::{FlightPath, Interpolation, Level, Look, Pace, Spot, Waypoint};
use serde::Deserialize;
use std::fmt::Write as _;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;

/// What a path's horizontal coordinates are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coordinates {
    /// Those of the height file's own coordinate system.
    #[default]
    File,
    /// Longitude and latitude (degrees).
    LonLat,
    /// Metres east and north of the land's middle.
    Metres,
}

/// A path as a file holds it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SavedPath {
    /// What `xy` means in `path`.
    pub coordinates: Coordinates,
    /// The path, its horizontal coordinates not yet metres unless `coordinates` says so.
    pub path: FlightPath,
}

/// The newest version of the format, and the only one so far.
const VERSION: i64 = 1;

impl SavedPath {
    /// The path in the land's metres. `local` turns coordinates into them; `None` where there are none.
    ///
    /// # Errors
    /// The number (from 1) of the first point that `local` cannot place.
    pub fn placed(&self, local: impl Fn(Coordinates, DVec2) -> Option<DVec2>) -> Result<FlightPath, usize> {
        let mut path = self.path.clone();
        for (i, point) in path.points.iter_mut().enumerate() {
            let place = |spot: &mut Spot| {
                spot.xy = local(self.coordinates, spot.xy).filter(|xy| xy.is_finite()).ok_or(i + 1)?;
                Ok::<(), usize>(())
            };
            place(&mut point.spot)?;
            if let Look::At(target) = &mut point.look {
                place(target)?;
            }
        }
        Ok(path)
    }

    /// A path in a land's metres as it is saved: in the file's coordinates (`crs_from_local`, so many decimals are kept of them), its heights to a
    /// centimetre.
    pub fn of(path: &FlightPath, crs_from_local: impl Fn(DVec2) -> DVec2, decimals: usize) -> SavedPath {
        let round = |value: f64, decimals: usize| {
            let power = 10f64.powi(decimals as i32);
            (value * power).round() / power
        };
        let place = |spot: &mut Spot| {
            let xy = crs_from_local(spot.xy);
            spot.xy = DVec2::new(round(xy.x, decimals), round(xy.y, decimals));
            let (Level::AboveGround(z) | Level::Absolute(z)) = &mut spot.level;
            *z = round(*z, 2);
        };
        let mut path = path.clone();
        for point in &mut path.points {
            place(&mut point.spot);
            if let Look::At(spot) = &mut point.look {
                place(spot);
            }
        }
        SavedPath { coordinates: Coordinates::File, path }
    }

    /// Saves the path, whole or not at all.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn save(&self, file: &Path) -> Result<(), Error> {
        let text = self.to_text();
        write::whole(file, |sink| sink.write_all(text.as_bytes()))
    }

    /// Loads a path.
    ///
    /// # Errors
    /// If the file cannot be read, or is not a path; says in which line and why.
    pub fn load(file: &Path) -> Result<SavedPath, Error> {
        // A path of a million points is a few hundred megabytes less than this; anything larger is another file.
        const LARGEST: u64 = 256 << 20;
        let size = std::fs::metadata(file).map_err(|e| Error::io(file, e))?.len();
        if size > LARGEST {
            let problem = format!("expected a flight path as text, got {} MiB; name another file", size >> 20);
            return Err(Error::content(file, problem));
        }
        let bytes = std::fs::read(file).map_err(|e| Error::io(file, e))?;
        let text = String::from_utf8(bytes).map_err(|_| {
            Error::content(file, "expected a flight path as text (TOML), got a binary file; name another file")
        })?;
        SavedPath::from_text(&text).map_err(|problem| Error::content(file, problem))
    }

    /// The path as text, with comments that say what can be changed.
    pub fn to_text(&self) -> String {
        let path = &self.path;
        let mut text =
            String::from("# A flight path for Littoral: edit it freely, then `littoral render FILE --path THIS`.\n");
        let coordinates = match self.coordinates {
            Coordinates::File => {
                "\"file\"           # as the height file's own; or \"lonlat\", \"metres\" from its middle"
            }
            Coordinates::LonLat => "\"lonlat\"         # degrees east and north; or \"file\", \"metres\"",
            Coordinates::Metres => "\"metres\"         # east and north of the land's middle; or \"file\", \"lonlat\"",
        };
        let interpolation = match path.interpolation {
            Interpolation::Straight => "\"straight\"     # or \"catmull-rom\", \"smooth\"",
            Interpolation::CatmullRom => "\"catmull-rom\"  # or \"straight\", \"smooth\"",
            Interpolation::Smooth => "\"smooth\"       # or \"straight\", \"catmull-rom\"",
        };
        let pace = match path.pace {
            Pace::Speed(speed) => {
                format!("speed = {speed:<22} # metres a second; or duration, seconds for the whole path")
            }
            Pace::Duration(seconds) => {
                format!("duration = {seconds:<19} # seconds for the whole path; or speed, metres a second")
            }
        };
        let _ = writeln!(text, "version = {VERSION}");
        let _ = writeln!(text, "coordinates = {coordinates}");
        let _ = writeln!(text, "interpolation = {interpolation}");
        let _ = writeln!(text, "closed = {:<21} # true: the last point leads back to the first", path.closed);
        let _ = writeln!(text, "{pace}");
        let _ =
            writeln!(text, "ease = {:<23} # seconds to gather speed at the start and lose it at the end", path.ease);
        let _ = writeln!(text, "clearance = {:<18} # never nearer to the ground than this (m)", path.clearance);
        let _ = writeln!(
            text,
            "look_ahead = {:<17} # seconds ahead to look, where a point names nothing else",
            path.look_ahead
        );
        for point in &path.points {
            let _ = writeln!(text, "\n[[point]]\nat = [{}, {}]", point.spot.xy.x, point.spot.xy.y);
            let _ = match point.spot.level {
                Level::AboveGround(above) => writeln!(text, "above = {above:<22} # metres above the ground"),
                Level::Absolute(z) => writeln!(text, "z = {z:<26} # metres above sea level"),
            };
            let _ = match point.look {
                Look::Ahead { pitch: None } => Ok(()),
                Look::Ahead { pitch: Some(pitch) } => writeln!(text, "pitch = {}", degrees(pitch)),
                Look::Heading { bearing, pitch } => {
                    writeln!(text, "heading = {}\npitch = {}", degrees(bearing), degrees(pitch))
                }
                Look::At(spot) => {
                    let level = match spot.level {
                        Level::AboveGround(above) => format!("look_at_above = {above}"),
                        Level::Absolute(z) => format!("look_at_z = {z}"),
                    };
                    writeln!(text, "look_at = [{}, {}]\n{level}", spot.xy.x, spot.xy.y)
                }
            };
        }
        text
    }

    /// Reads a path from text.
    ///
    /// # Errors
    /// A sentence of the form "line N: expected …, got …; what to do".
    pub fn from_text(text: &str) -> Result<SavedPath, String> {
        let at = |span: Option<Range<usize>>, what: String| match span {
            Some(span) => format!("line {}: {what}", line(text, span.start)),
            None => what,
        };
        // The version first: what else a newer file may hold, nobody knows yet.
        let loose: Loose = toml::from_str(text).map_err(|e| at(e.span(), syntax(e.message())))?;
        match loose.version {
            Some(version) if *version.get_ref() == VERSION => {}
            Some(version) => {
                let what = format!(
                    "expected version {VERSION} of the path format, got {}; it was written by a newer Littoral: update, or \
                     save it there as version {VERSION}",
                    version.get_ref()
                );
                return Err(at(Some(version.span()), what));
            }
            None => {
                return Err(format!(
                    "expected a flight path beginning with \"version = {VERSION}\", got no version; add that line"
                ));
            }
        }
        let file: File = toml::from_str(text).map_err(|e| at(e.span(), syntax(e.message())))?;
        let defaults = FlightPath::default();
        let pace = match (file.speed, file.duration) {
            (Some(_), Some(duration)) => {
                let what = "expected either speed or duration, got both; remove one".to_owned();
                return Err(at(Some(duration.span()), what));
            }
            (Some(speed), None) => Pace::Speed(*speed.get_ref()),
            (None, Some(duration)) => Pace::Duration(*duration.get_ref()),
            (None, None) => defaults.pace,
        };
        let points = file.point.into_iter().map(|point| {
            let span = point.span();
            point.into_inner().waypoint().map_err(|what| at(Some(span), what))
        });
        let path = FlightPath {
            points: points.collect::<Result<_, _>>()?,
            interpolation: match file.interpolation {
                None => defaults.interpolation,
                Some(Named::Straight) => Interpolation::Straight,
                Some(Named::CatmullRom) => Interpolation::CatmullRom,
                Some(Named::Smooth) => Interpolation::Smooth,
            },
            closed: file.closed.unwrap_or(defaults.closed),
            pace,
            ease: file.ease.unwrap_or(defaults.ease),
            clearance: file.clearance.unwrap_or(defaults.clearance),
            look_ahead: file.look_ahead.unwrap_or(defaults.look_ahead),
        };
        let coordinates = match file.coordinates {
            None | Some(System::File) => Coordinates::File,
            Some(System::Lonlat) => Coordinates::LonLat,
            Some(System::Metres) => Coordinates::Metres,
        };
        Ok(SavedPath { coordinates, path })
    }
}

/// Degrees of an angle, without the last digits that the conversion made up.
fn degrees(angle: f64) -> f64 {
    (angle.to_degrees() * 1e9).round() / 1e9
}

/// The line of a position in a text, from 1.
fn line(text: &str, position: usize) -> usize {
    text.bytes().take(position).filter(|&b| b == b'\n').count() + 1
}

/// A parser's message as one sentence with advice.
fn syntax(message: &str) -> String {
    let message = message.lines().collect::<Vec<_>>().join(", ");
    let first = message.find("expected").filter(|&i| i > 0 && message.starts_with("invalid type"));
    match first {
        // "invalid type: string "x", expected f64" reads the other way round here.
        Some(i) => {
            let (got, expected) = message.split_at(i);
            let got = got.trim_start_matches("invalid type:").trim().trim_end_matches(',');
            format!("{}, got {got}; correct it", expected.replace("f64", "a number").replace("i64", "a whole number"))
        }
        None => format!("expected a flight path, got an error: {message}; correct it"),
    }
}

#[derive(Deserialize)]
struct Loose {
    version: Option<Spanned<i64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "version")]
    _version: i64,
    coordinates: Option<System>,
    interpolation: Option<Named>,
    closed: Option<bool>,
    speed: Option<Spanned<f64>>,
    duration: Option<Spanned<f64>>,
    ease: Option<f64>,
    clearance: Option<f64>,
    look_ahead: Option<f64>,
    #[serde(default)]
    point: Vec<Spanned<Point>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum System {
    File,
    Lonlat,
    Metres,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Named {
    Straight,
    CatmullRom,
    Smooth,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Point {
    at: [f64; 2],
    above: Option<f64>,
    z: Option<f64>,
    heading: Option<f64>,
    pitch: Option<f64>,
    look_at: Option<[f64; 2]>,
    look_at_above: Option<f64>,
    look_at_z: Option<f64>,
}

impl Point {
    fn waypoint(self) -> Result<Waypoint, String> {
        let level = match (self.above, self.z) {
            (Some(above), None) => Level::AboveGround(above),
            (None, Some(z)) => Level::Absolute(z),
            (None, None) => {
                return Err("expected a height for this point, got none; add above = METRES or z = METRES".into());
            }
            (Some(_), Some(_)) => return Err("expected one height for this point, got above and z; remove one".into()),
        };
        let target = match (self.look_at_above, self.look_at_z) {
            (Some(above), None) => Level::AboveGround(above),
            (None, Some(z)) => Level::Absolute(z),
            (None, None) => Level::AboveGround(0.0),
            (Some(_), Some(_)) => {
                return Err("expected one height to look at, got look_at_above and look_at_z; remove one".into());
            }
        };
        let look = match (self.look_at, self.heading, self.pitch) {
            (Some(xy), None, None) => Look::At(Spot { xy: xy.into(), level: target }),
            (Some(_), ..) => {
                return Err(
                    "expected one direction for this point, got look_at with heading or pitch; remove one".into()
                );
            }
            (None, _, _) if self.look_at_above.or(self.look_at_z).is_some() => {
                return Err("expected look_at = [X, Y] beside its height, got the height alone; add it".into());
            }
            (None, Some(heading), pitch) => {
                Look::Heading { bearing: heading.to_radians(), pitch: pitch.unwrap_or(0.0).to_radians() }
            }
            (None, None, pitch) => Look::Ahead { pitch: pitch.map(f64::to_radians) },
        };
        Ok(Waypoint { spot: Spot { xy: self.at.into(), level }, look })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> SavedPath {
        let spot = |x, y, level| Spot { xy: DVec2::new(x, y), level };
        let points = vec![
            Waypoint { spot: spot(-155.25, 19.4, Level::AboveGround(300.0)), look: Look::Ahead { pitch: None } },
            Waypoint { spot: spot(1.0 / 3.0, -1e-7, Level::Absolute(2400.5)), look: Look::Ahead { pitch: Some(-0.2) } },
            Waypoint { spot: spot(7.0, 8.0, Level::Absolute(-3.0)), look: Look::Heading { bearing: 4.0, pitch: -0.1 } },
            Waypoint {
                spot: spot(560_805.0, 5.116e6, Level::AboveGround(10.0)),
                look: Look::At(spot(1e7, 2.0, Level::Absolute(4.0))),
            },
            Waypoint {
                spot: spot(9.0, 9.0, Level::AboveGround(10.0)),
                look: Look::At(spot(1.0, 2.0, Level::AboveGround(4.0))),
            },
        ];
        SavedPath { coordinates: Coordinates::LonLat, path: FlightPath { points, ..FlightPath::default() } }
    }

    #[test]
    fn paths_come_back_as_they_were() {
        let mut saved = example();
        for (coordinates, interpolation, pace) in [
            (Coordinates::LonLat, Interpolation::Smooth, Pace::Speed(12.5)),
            (Coordinates::File, Interpolation::Straight, Pace::Duration(0.1)),
            (Coordinates::Metres, Interpolation::CatmullRom, Pace::Speed(1e6)),
        ] {
            saved.coordinates = coordinates;
            (saved.path.interpolation, saved.path.pace, saved.path.closed) = (interpolation, pace, !saved.path.closed);
            let text = saved.to_text();
            let mut back = SavedPath::from_text(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
            for (point, was) in back.path.points.iter_mut().zip(&saved.path.points) {
                // Angles travel as degrees, rounded to a billionth.
                match (&mut point.look, was.look) {
                    (Look::Ahead { pitch: Some(a) }, Look::Ahead { pitch: Some(b) }) if (*a - b).abs() < 1e-10 => {
                        *a = b
                    }
                    (Look::Heading { bearing, pitch }, Look::Heading { bearing: b, pitch: p })
                        if (*bearing - b).abs() < 1e-10 && (*pitch - p).abs() < 1e-10 =>
                    {
                        (*bearing, *pitch) = (b, p);
                    }
                    _ => {}
                }
            }
            assert_eq!(back, saved);
        }
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.path.toml");
        saved.save(&file).expect("saved");
        assert_eq!(SavedPath::load(&file).expect("loaded").to_text(), saved.to_text());
    }

    #[test]
    fn what_is_left_out_has_defaults() {
        let saved = SavedPath::from_text("version = 1\n[[point]]\nat = [1, 2]\nabove = 3\n").expect("a path");
        let defaults = FlightPath { points: saved.path.points.clone(), ..FlightPath::default() };
        assert_eq!(saved, SavedPath { coordinates: Coordinates::File, path: defaults });
        assert_eq!(saved.path.points[0].spot.level, Level::AboveGround(3.0));
    }

    #[test]
    fn errors_name_the_line_and_what_to_do() {
        let error = |text: &str| SavedPath::from_text(text).expect_err(text);
        let cases = [
            (
                "version = 2\nanything = [1]\n",
                "line 1: expected version 1 of the path format, got 2; it was written by",
            ),
            ("speed = 3\n", "expected a flight path beginning with \"version = 1\""),
            (
                "version = 1\n\n[[point]]\nat = [1, 2]\nabov = 3\n",
                "line 5: expected a flight path, got an error: unknown field `abov`",
            ),
            ("version = 1\n\n[[point]]\nat = [1, 2]\n", "line 3: expected a height for this point"),
            ("version = 1\n[[point]]\nat = [1]\nz = 1\n", "line 3"),
            ("version = 1\n[[point]]\nat = [1, 2]\nz = 1\nabove = 1", "line 2: expected one height"),
            ("version = 1\nspeed = \"fast\"\n", "line 2: expected a number, got string \"fast\"; correct it"),
            ("version = 1\nspeed = 1\nduration = 2\n", "line 3: expected either speed or duration"),
            (
                "version = 1\n[[point]]\nat = [1, 2]\nz = 1\nlook_at = [1, 2]\npitch = 3",
                "line 2: expected one direction",
            ),
            ("version = 1\n[[point]]\nat = [1, 2]\nz = 1\nlook_at_z = 3", "line 2: expected look_at"),
            ("version = 1\ninterpolation = \"wobbly\"", "line 2"),
            ("version = 1\n= 3\n", "line 2"),
        ];
        for (text, start) in cases {
            assert!(error(text).starts_with(start), "{text:?}: {}", error(text));
            assert!(!error(text).contains('\n'), "one line: {}", error(text));
        }
    }

    #[test]
    fn paths_are_saved_in_round_numbers_of_the_file() {
        let at = |x, y, level| Spot { xy: DVec2::new(x, y), level };
        let spot = at(1.234_567, -2.0, Level::AboveGround(30.126));
        let look = Look::At(at(9.876_543, 0.0, Level::Absolute(5.0)));
        let path = FlightPath { points: vec![Waypoint { spot, look }], ..FlightPath::default() };
        let saved = SavedPath::of(&path.stretched(2.0), |xy| xy + 100.0, 3);
        let expected = Waypoint {
            spot: at(101.235, 98.0, Level::AboveGround(60.25)),
            look: Look::At(at(109.877, 100.0, Level::Absolute(10.0))),
        };
        assert_eq!((saved.coordinates, &saved.path.points[..]), (Coordinates::File, &[expected][..]));
    }

    #[test]
    fn points_are_placed_or_named() {
        let saved = example();
        let twice = saved.placed(|_, xy| Some(xy * 2.0)).expect("placed");
        assert_eq!(twice.points[3].spot.xy.x, 2.0 * 560_805.0);
        assert_eq!(twice.points[3].look, Look::At(Spot { xy: DVec2::new(2e7, 4.0), level: Level::Absolute(4.0) }));
        assert_eq!(saved.placed(|_, xy| (xy.x < 1e6).then_some(xy)), Err(4));
    }
}
