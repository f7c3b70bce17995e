//! `littoral profile`: heights along a line.

use crate::ground::{Opened, Reading, System};
use crate::input;
use crate::plot::{self, Plot};
use crate::talk::{Failure, Talk, tidy};
use glam::{DVec2, UVec2};
use littoral::raycast::{ProfilePoint, ProfilePoints};
use littoral_data::write;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Heights along a line, as CSV or a plot.
///
/// The exact height of the full data along a straight line, one point for each cell it crosses unless --count says
/// otherwise. Without --out the profile is printed as CSV: distance from the start (m), X, Y, height (m; empty where
/// void).
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral profile dem.tif --from 560900,5115900 --to 565000,5112500
  littoral profile dem.tif --from 560900,5115900 --to 565000,5112500 --out profile.svg
  littoral profile dem.tif --from -155.9,19.5 --to -155.0,19.7 --lonlat --count 200 --out profile.csv")]
pub struct Profile {
    /// A height file
    file: PathBuf,
    /// Where the line starts
    #[arg(long, value_name = "X,Y", value_parser = input::xy)]
    from: DVec2,
    /// Where it ends
    #[arg(long, value_name = "X,Y", value_parser = input::xy)]
    to: DVec2,
    /// Coordinates are longitude and latitude in degrees
    #[arg(long)]
    lonlat: bool,
    /// So many points, evenly spaced, ends included [default: one for each cell crossed]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000_000))]
    count: Option<u32>,
    /// Instead a point wherever the line crosses a line between neighbouring samples: all the data there are
    #[arg(long, conflicts_with = "count")]
    exact: bool,
    /// A plot (.svg, .png) or a table (.csv) instead of CSV on stdout
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Size of a plot in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = input::size, default_value = "1280x480")]
    size: UVec2,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Serialize)]
struct Answer<'a> {
    distance: Vec<f64>,
    x: Vec<f64>,
    y: Vec<f64>,
    height: Vec<Option<f64>>,
    length: f64,
    lowest: Option<f64>,
    highest: Option<f64>,
    void_length: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
}

impl Profile {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let ending = self.out.as_deref().map(|out| plot::ending(out, &["csv", "svg", "png"])).transpose()?;
        let mut opened = Opened::open(&self.file, self.reading, talk)?;
        let system = System::of(self.lonlat);
        let (from, to) = (opened.local(system, self.from)?, opened.local(system, self.to)?);
        if from == to {
            return Err(Failure::Usage(
                "expected two different ends of a profile, got the same twice; change one".into(),
            ));
        }
        let window = opened.window_of([from, to]);
        let land = opened.part(window, talk)?;
        let spacing = match (self.count, self.exact) {
            (Some(count), _) => ProfilePoints::Even(count as usize),
            (None, true) => ProfilePoints::Crossings,
            (None, false) => {
                let cells = ((to - from) / opened.frame.spacing()).abs().max_element().ceil();
                ProfilePoints::Even((cells as usize).clamp(1, 10_000_000) + 1)
            }
        };
        let mut points = Vec::new();
        let summary = land.profile(from, to, spacing, &mut points);
        if summary.lowest.is_none() {
            let at = if opened.frame.holds(from) { self.to } else { self.from };
            return Err(match opened.frame.holds(from) && opened.frame.holds(to) {
                true => opened.failure("expected known ground below the line, got voids only; choose another line"),
                false => opened.failure(&opened.outside(system, at)),
            });
        }
        if summary.over_void > 1e-6 * summary.distance {
            let metres = tidy(summary.over_void, 1);
            talk.warn(format!("{}: {metres} m of the line lie over voids or outside the data", self.file.display()));
        }
        let height = |point: Option<ProfilePoint>| point.and_then(|p| p.height);
        let (lowest, highest) = (height(summary.lowest), height(summary.highest));

        let out = self.out.as_deref();
        match (out, ending) {
            (Some(out), Some("csv")) => {
                let text = self.csv(&opened, &points);
                write::whole(out, |sink| sink.write_all(text.as_bytes()))?;
            }
            (Some(out), Some(kind)) => {
                let name = self.file.file_name().unwrap_or(self.file.as_os_str()).to_string_lossy();
                let title = format!("{name}: {} to {}", shown(self.from), shown(self.to));
                let plot =
                    Plot { title, size: self.size, points: points.iter().map(|p| (p.distance, p.height)).collect() };
                plot.write(out, kind)?;
            }
            _ => {}
        }
        if talk.json() {
            let crs = |p: &ProfilePoint| opened.frame.crs(p.position);
            let name = out.map(|out| out.display().to_string());
            return talk.print_json(Answer {
                distance: points.iter().map(|p| p.distance).collect(),
                x: points.iter().map(|p| crs(p).x).collect(),
                y: points.iter().map(|p| crs(p).y).collect(),
                height: points.iter().map(|p| p.height).collect(),
                length: summary.distance,
                lowest,
                highest,
                void_length: summary.over_void,
                file: name.as_deref(),
            });
        }
        let range = match (lowest, highest) {
            (Some(low), Some(high)) => format!("heights {} to {} m", tidy(low, 2), tidy(high, 2)),
            _ => String::new(),
        };
        let length = format!("{} m long", tidy(summary.distance, 1));
        match out {
            Some(out) => talk.print(format!("{}: {length}, {} points, {range}\n", out.display(), points.len())),
            None => {
                talk.print(self.csv(&opened, &points))?;
                talk.note(format!("{length}, {} points, {range}", points.len()));
                Ok(())
            }
        }
    }

    fn csv(&self, opened: &Opened, points: &[ProfilePoint]) -> String {
        let mut text = String::from("distance,x,y,height\n");
        for point in points {
            let at = opened.frame.crs(point.position);
            let height = point.height.map_or(String::new(), |h| tidy(h, 3));
            let (x, y) = (opened.frame.shown(at.x), opened.frame.shown(at.y));
            let _ = writeln!(text, "{},{x},{y},{height}", tidy(point.distance, 3));
        }
        text
    }
}

fn shown(at: DVec2) -> String {
    format!("{},{}", at.x, at.y)
}
