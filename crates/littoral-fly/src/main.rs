//! `littoral-fly`: a window on land and sea.
//!
//! Two threads share the work. The *scene* ([`scene`]) owns the land and the method of detail and turns the newest wish into meshes; the *window*
//! ([`window`]) draws the newest mesh with the newest view and waits for nobody. What both do is decided in [`cockpit`], which knows neither window nor
//! graphics card; cameras, the path's editor and the settings are plain functions of their arguments.

mod calendar;
mod camera;
mod chooser;
mod cockpit;
mod compare;
mod detail;
mod draping;
mod draw;
mod editor;
mod film;
#[cfg(feature = "gamepad")]
mod gamepad;
mod keys;
mod paint;
mod panel;
mod plain;
mod plots;
mod rest;
mod scene;
mod seastate;
mod settings;
mod steering;
mod subject;
mod tape;
mod window;

use camera::Mode;
use clap::Parser;
use detail::Detail;
use glam::UVec2;
use littoral::lod::Method;
use littoral_data::{LakeOrder, ObjectOrder};
use settings::{Laid, Settings, Show, Split, Style};
use std::path::PathBuf;
use std::process::ExitCode;

/// Fly over any land and its sea, walk on it, sail on it, and change how it is drawn while you look.
///
/// Without FILE the built-in coast is opened. Files can also be dropped on the window: height files become the land, a picture is laid over the ground, a path's
/// file (.toml) is loaded. Settings are remembered from flight to flight.
#[derive(Parser)]
#[command(
    name = "littoral-fly",
    version,
    max_term_width = 100,
    after_help = "Examples:
  littoral-fly                                 the built-in coast
  littoral-fly dem.tif                         your land
  littoral-fly N45W122.hgt N46W122.hgt         files that join, as one land
  littoral-fly dem.tif --path round.toml       along a path that was saved
  littoral-fly --method roam --show both       a method of detail at work
  littoral-fly --method strips --against whole two methods, and how far apart their pictures are
  littoral-fly --sea beaufort=8,from=240 --mode boat
  littoral-fly --object lighthouse@3030,1310   with a lighthouse on the rock
  littoral-fly dem.tif --texture ortho.tif     under a picture of the ground
  littoral-fly --smoke 200 --size 1280x720     fly 200 frames, print the medians as JSON

In the window: W S A D and the mouse fly, the wheel sets the speed, F1 lists all keys. F12 saves
a picture, R films the path; both go into the folder the program was started in.
Exit codes: 0 done, 1 no display, no graphics adapter or lost, 2 the command line was wrong."
)]
struct Arguments {
    /// Height files of any known format: several that lie beside each other are one land; none for the built-in coast
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Width and height of the window in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size, default_value = "1280x720")]
    size: UVec2,
    /// A thing on the land or afloat: a glTF file, or lighthouse or buoy, which are built in; where it stands, in the coordinates of the height files;
    /// how many degrees it is turned clockwise, and how many times larger it is. Can be given many times; natural pictures show it
    #[arg(long, value_name = "FILE@X,Y[,HEADING[,SCALE]]")]
    object: Vec<ObjectOrder>,
    /// A lake over a known bed, or a reservoir: a place in it, in the coordinates of the height files, and how high it stands in metres. Can be given many times
    #[arg(long, value_name = "X,Y=LEVEL", allow_hyphen_values = true)]
    lake: Vec<LakeOrder>,
    /// A path to be flown at once
    #[arg(long, value_name = "FILE.toml")]
    path: Option<PathBuf>,
    /// The method of detail
    #[arg(long, value_name = "whole|nested|quadtree|patches|strips|roam")]
    method: Option<Method>,
    /// How far from its place the mesh may be drawn, in pixels
    #[arg(long, value_name = "PIXELS", value_parser = tolerance)]
    tolerance: Option<f64>,
    /// The most triangles of the ground, and as many of the sea
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1000..=20_000_000))]
    triangles: Option<u32>,
    /// How long a frame may take, in milliseconds: the tolerance follows; 0 for as long as it takes
    #[arg(long, value_name = "MS", value_parser = budget)]
    budget: Option<f64>,
    /// Another method beside it, as fine and with as many triangles: two pictures of the same view, and how far apart they are
    #[arg(long, value_name = "METHOD")]
    against: Option<Method>,
    /// The exact ground by rays in place of the method's mesh, in natural pictures
    #[arg(long)]
    rays: bool,
    /// How the picture is drawn: in the light of the data, or (plain) as the triangles themselves
    #[arg(long, value_parser = named::<Style>, value_name = "natural|tint|relief|image|plain")]
    style: Option<Style>,
    /// A picture to lay over the ground (.tif, .png, .jpg); where it has no place of its own, over all of it
    #[arg(long, value_name = "IMAGE")]
    texture: Option<PathBuf>,
    /// One pixel of light for so many of the window's, each way: natural pictures without a graphics card [default: 1; 4 without a graphics card]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8))]
    coarse: Option<u32>,
    /// What is seen of the mesh
    #[arg(long, value_parser = named::<Show>, value_name = "textured|wireframe|both")]
    show: Option<Show>,
    /// What carries the eye
    #[arg(long, value_parser = named::<Mode>, value_name = "fly|orbit|walk|boat")]
    mode: Option<Mode>,
    /// The sea's state, such as beaufort=5,from=240; calm for still water
    #[arg(long, value_name = "SPEC")]
    sea: Option<String>,
    /// Use the usual settings, not those of the last flight
    #[arg(long)]
    fresh: bool,
    /// Fly so many frames by itself with the usual settings, print their medians as JSON, and exit
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    smoke: Option<u32>,
}

/// `WIDTHxHEIGHT`.
fn size(text: &str) -> Result<UVec2, String> {
    let wrong = || format!("expected WIDTHxHEIGHT such as 1280x720, each from 64 to 16384, got \"{}\"", text.trim());
    let (width, height) = text.trim().split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    let side = |text: &str| text.parse::<u32>().ok().filter(|side| (64..=16_384).contains(side)).ok_or_else(wrong);
    Ok(UVec2::new(side(width)?, side(height)?))
}

/// A tolerance in pixels.
fn tolerance(text: &str) -> Result<f64, String> {
    let wrong = || format!("expected 0.05 to 100 pixels, got \"{}\"", text.trim());
    text.trim().parse().ok().filter(|t| (0.05..=100.0).contains(t)).ok_or_else(wrong)
}

/// A budget of time in milliseconds.
fn budget(text: &str) -> Result<f64, String> {
    let wrong = || format!("expected 0 to 10000 milliseconds, got \"{}\"", text.trim());
    text.trim().parse().ok().filter(|t| (0.0..=10_000.0).contains(t)).ok_or_else(wrong)
}

/// A name, as the settings' file has it.
fn named<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    let name = text.trim().to_lowercase();
    serde_json::from_value(serde_json::Value::String(name)).map_err(|e| {
        // "unknown variant `x`, expected one of …"
        let words = e.to_string();
        words.split_once("expected ").map_or(words.clone(), |(_, known)| format!("expected {known}, got \"{text}\""))
    })
}

impl Arguments {
    /// The settings of the last flight with what was asked for, and what is to be said about them.
    fn settings(&self) -> (Settings, Option<String>) {
        let remembered = !self.fresh && self.smoke.is_none();
        let (mut settings, note) = match Settings::file().filter(|_| remembered) {
            Some(file) => Settings::load(&file),
            None => (Settings::default(), None),
        };
        let first = &mut settings.first;
        first.method = self.method.unwrap_or(first.method);
        first.tolerance_pixels = self.tolerance.unwrap_or(first.tolerance_pixels);
        first.triangles = self.triangles.unwrap_or(first.triangles);
        settings.budget_milliseconds = self.budget.unwrap_or(settings.budget_milliseconds);
        if let Some(method) = self.against {
            (settings.second, settings.split) = (Detail { method, rays: false, ..*first }, Split::Halves);
        }
        // A second method stays a mesh: so the two show how wrong it is.
        settings.first.rays |= self.rays;
        if let Some(picture) = &self.texture {
            (settings.laid, settings.style) = (Some(Laid::new(picture, &self.files)), Style::Image);
        }
        settings.style = self.style.unwrap_or(settings.style);
        settings.coarse = self.coarse.unwrap_or(settings.coarse);
        settings.show = self.show.unwrap_or(settings.show);
        settings.mode = self.mode.unwrap_or(settings.mode);
        if let Some(sea) = &self.sea {
            settings.waves = sea != "calm";
            settings.sea = sea.clone();
        }
        (settings, note)
    }
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are answers, everything else is a wrong command line.
            let _ = error.print(); // a closed pipe wants no answer
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    let (settings, note) = arguments.settings();
    match window::run(arguments, settings, note) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("littoral-fly: {problem}");
            ExitCode::from(1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_holds_together() {
        Arguments::command().debug_assert();
        let arguments = Arguments::try_parse_from([
            "littoral-fly",
            "--method",
            "Roam",
            "--against",
            "whole",
            "--smoke",
            "5",
            "--sea",
            "calm",
        ]);
        let (settings, note) = arguments.expect("parses").settings();
        assert_eq!(
            settings,
            Settings {
                first: Detail { method: Method::Roam, ..Detail::default() },
                second: Detail { method: Method::Whole, ..Detail::default() },
                split: Split::Halves,
                waves: false,
                sea: "calm".into(),
                ..Settings::default()
            }
        );
        assert_eq!(note, None);
        for wrong in
            [["--method", "rome"], ["--size", "7"], ["--tolerance", "0"], ["--budget", "nan"], ["--smoke", "0"]]
        {
            let error = Arguments::try_parse_from(["littoral-fly", wrong[0], wrong[1]]).map(|_| ()).expect_err("wrong");
            assert!(error.to_string().contains(wrong[1]), "{error}");
        }
        assert!(named::<Style>("rome").is_err_and(|e| e.contains("plain")));
    }
}
