//! `littoral height`: exact heights at points.

use crate::ground::{Opened, Reading, System, height_at};
use crate::points::Typed;
use crate::talk::{Failure, Talk, written};
use glam::DVec2;
use littoral::field::Land;
use rayon::prelude::*;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Exact heights at points.
///
/// The height of the bilinear surface through the samples of the full data, whatever is drawn. One line for each point:
/// `X,Y,HEIGHT`, X and Y as they were given, heights in metres, `nan` where the data are void or end. With --normals:
/// `X,Y,HEIGHT,NX,NY,NZ`, the unit vector at right angles to the surface (east, north, up).
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral height dem.tif --at 562000,5114000 563000,5113500
  littoral height dem.tif --at -155.5,19.8 --lonlat
  littoral height dem.tif --points points.csv > heights.csv
  cut -d, -f2,3 track.csv | littoral height dem.tif --points -")]
pub struct Height {
    /// A height file
    file: PathBuf,
    /// Points, in the file's coordinates
    #[arg(long, value_name = "X,Y", num_args = 1.., required_unless_present = "points", conflicts_with = "points")]
    at: Vec<Typed>,
    /// A file with one X,Y a line (comma, blank or tab between), or - for standard input
    #[arg(long, value_name = "FILE|-")]
    points: Option<PathBuf>,
    /// Coordinates are longitude and latitude in degrees
    #[arg(long)]
    lonlat: bool,
    /// Also the surface's unit normals
    #[arg(long)]
    normals: bool,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Serialize)]
struct Answer {
    heights: Vec<Option<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    normals: Option<Vec<Option<[f32; 3]>>>,
}

/// What is known of a point.
type Found = (Option<f32>, Option<[f32; 3]>);

/// What was found of many points.
#[derive(Default)]
struct Misses {
    outside: usize,
    void: usize,
    total: usize,
    first_outside: Option<DVec2>,
}

impl Height {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let mut opened = Opened::open(&self.file, self.reading, talk)?;
        let system = System::of(self.lonlat);
        let mut misses = Misses::default();
        let mut answer = Answer { heights: Vec::new(), normals: self.normals.then(Vec::new) };
        match &self.points {
            None => {
                // Few points: only the samples round them are read.
                for point in &self.at {
                    let local = opened.local(system, point.xy)?;
                    let window = opened.window_of([local]);
                    let land = opened.part(window, talk)?;
                    let found = self.find(&land, local);
                    misses.count(&opened, point.xy, local, &found);
                    self.say(talk, &point.text, found, &mut answer)?;
                }
            }
            Some(points) => self.stream(points, &mut opened, system, talk, &mut misses, &mut answer)?,
        }
        misses.report(&opened, system, talk);
        if talk.json() { talk.print_json(answer) } else { Ok(()) }
    }

    fn find(&self, land: &Land, local: DVec2) -> Found {
        let height = height_at(land, local);
        let normal = if self.normals { land.normal_at(local).map(|n| n.to_array()) } else { None };
        (height, normal)
    }

    fn say(&self, talk: &Talk, text: &str, found: Found, answer: &mut Answer) -> Result<(), Failure> {
        if talk.json() {
            answer.heights.push(found.0);
            if let Some(normals) = &mut answer.normals {
                normals.push(found.1);
            }
            return Ok(());
        }
        let mut line = Vec::new();
        self.line(text, found, &mut line);
        written(std::io::stdout().lock().write_all(&line))
    }

    fn line(&self, text: &str, (height, normal): Found, line: &mut Vec<u8>) {
        // Writing to a vector does not fail.
        let _ = write!(line, "{text},{}", height.unwrap_or(f32::NAN).to_string().to_lowercase());
        if self.normals {
            let [x, y, z] = normal.unwrap_or([f32::NAN; 3]);
            let _ = write!(line, ",{},{},{}", shown(x), shown(y), shown(z));
        }
        line.push(b'\n');
    }

    /// Many points: a block of text at a time, its lines shared among the threads.
    fn stream(
        &self,
        points: &Path,
        opened: &mut Opened,
        system: System,
        talk: &mut Talk,
        misses: &mut Misses,
        answer: &mut Answer,
    ) -> Result<(), Failure> {
        let land = opened.whole(talk)?;
        crate::points::stream(points, |typed| {
            let look = |point: &Typed| -> Result<(DVec2, Found), String> {
                let local =
                    opened.frame.local(system, point.xy).map_err(|e| format!("{}: {e}", opened.file.display()))?;
                Ok((local, self.find(&land, local)))
            };
            let looked: Vec<_> = typed.par_iter().with_min_len(256).map(look).collect();
            let mut text = Vec::with_capacity(64 * typed.len());
            for (point, looked) in typed.iter().zip(looked) {
                let (local, found) = looked.map_err(Failure::Work)?;
                misses.count(opened, point.xy, local, &found);
                if talk.json() {
                    self.say(talk, "", found, answer)?;
                } else {
                    self.line(&point.text, found, &mut text);
                }
            }
            written(std::io::stdout().lock().write_all(&text))
        })
    }
}

impl Misses {
    fn count(&mut self, opened: &Opened, at: DVec2, local: DVec2, found: &Found) {
        self.total += 1;
        if found.0.is_some() {
            return;
        }
        if opened.frame.holds(local) {
            self.void += 1;
        } else {
            self.outside += 1;
            self.first_outside = self.first_outside.or(Some(at));
        }
    }

    fn report(&self, opened: &Opened, system: System, talk: &mut Talk) {
        if let Some(at) = self.first_outside {
            let count = format!("{} of {} points have no height", self.outside, self.total);
            talk.warn(format!("{}: {count}: {}", opened.file.display(), opened.outside(system, at)));
        }
        if self.void > 0 {
            let file = opened.file.display();
            talk.warn(format!("{file}: {} of {} points lie where the data are void", self.void, self.total));
        }
    }
}

fn shown(number: f32) -> String {
    if number.is_nan() { "nan".into() } else { number.to_string() }
}
