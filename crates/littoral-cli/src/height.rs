//! `littoral height`: exact heights at points.

use crate::ground::{Opened, Reading, System, height_at};
use crate::input;
use crate::talk::{Failure, Talk, written};
use glam::DVec2;
use littoral::field::Land;
use rayon::prelude::*;
use serde::Serialize;
use std::io::{BufRead, BufReader, Read, Write};
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

/// A point and how it was written.
#[derive(Clone)]
struct Typed {
    xy: DVec2,
    text: String,
}

impl std::str::FromStr for Typed {
    type Err = String;

    fn from_str(text: &str) -> Result<Typed, String> {
        Ok(Typed { xy: input::xy(text)?, text: text.trim().to_owned() })
    }
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
        let name = if points == Path::new("-") { "standard input".to_owned() } else { points.display().to_string() };
        let reader: Box<dyn Read> = match points == Path::new("-") {
            true => Box::new(std::io::stdin().lock()),
            false => Box::new(std::fs::File::open(points).map_err(|e| littoral_data::Error::io(points, e))?),
        };
        let mut reader = BufReader::with_capacity(1 << 20, reader);
        let (mut block, mut lines_before) = (Vec::new(), 0);
        let stdout = std::io::stdout();
        loop {
            block.clear();
            let got = fill(&mut reader, &mut block).map_err(|e| Failure::Work(format!("{name}: {e}")))?;
            if got == 0 {
                return Ok(());
            }
            let lines: Vec<&[u8]> = block.strip_suffix(b"\n").unwrap_or(&block).split(|&b| b == b'\n').collect();
            type Looked = Result<Option<(DVec2, DVec2, Found)>, String>;
            let look = |(number, line): (usize, &&[u8])| -> Looked {
                let text =
                    std::str::from_utf8(line).map_err(|_| at_line(&name, lines_before + number, "binary data"))?;
                let Some(xy) = point(text).map_err(|got| at_line(&name, lines_before + number, got))? else {
                    return Ok(None);
                };
                let local = opened.frame.local(system, xy).map_err(|e| format!("{}: {e}", opened.file.display()))?;
                Ok(Some((xy, local, self.find(&land, local))))
            };
            let looked: Vec<Looked> = lines.par_iter().enumerate().with_min_len(256).map(look).collect();
            let mut text = Vec::with_capacity(2 * block.len());
            for (line, looked) in lines.iter().zip(looked) {
                let Some((xy, local, found)) = looked.map_err(Failure::Work)? else { continue };
                misses.count(opened, xy, local, &found);
                if talk.json() {
                    self.say(talk, "", found, answer)?;
                } else {
                    let given = String::from_utf8_lossy(line);
                    self.line(&comma_separated(given.trim()), found, &mut text);
                }
            }
            written(stdout.lock().write_all(&text))?;
            lines_before += lines.len();
        }
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

/// At most about a mebibyte of whole lines.
fn fill(reader: &mut impl BufRead, block: &mut Vec<u8>) -> std::io::Result<usize> {
    // A line longer than this is no point.
    const LONGEST: u64 = 1 << 16;
    reader.by_ref().take(1 << 20).read_to_end(block)?;
    if block.last().is_some_and(|&b| b != b'\n') {
        reader.by_ref().take(LONGEST).read_until(b'\n', block)?;
    }
    Ok(block.len())
}

/// The point in a line; `None` for blank lines, comments and a header.
fn point(line: &str) -> Result<Option<DVec2>, &str> {
    let line = line.trim();
    if line.is_empty()
        || line.starts_with('#')
        || line.starts_with(|c: char| c.is_alphabetic()) && !line.starts_with(['n', 'N', 'i', 'I'])
    {
        return Ok(None);
    }
    let mut parts = line.split([',', ';', ' ', '\t']).filter(|part| !part.is_empty());
    let mut next = || parts.next().and_then(|part| part.parse::<f64>().ok()).filter(|n| n.is_finite());
    match (next(), next()) {
        (Some(x), Some(y)) => Ok(Some(DVec2::new(x, y))),
        _ => Err(line),
    }
}

/// A point's text with commas between its numbers.
fn comma_separated(line: &str) -> String {
    if line.contains([' ', '\t', ';']) {
        line.split([',', ';', ' ', '\t']).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(",")
    } else {
        line.to_owned()
    }
}

fn at_line(name: &str, line: usize, got: &str) -> String {
    let got: String = got.chars().take(60).collect();
    format!("{name}: line {}: expected X,Y, got \"{got}\"; correct or remove the line", line + 1)
}

fn shown(number: f32) -> String {
    if number.is_nan() { "nan".into() } else { number.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_points_or_skipped_or_wrong() {
        let at = |x, y| Ok(Some(DVec2::new(x, y)));
        assert_eq!(point("1,2"), at(1.0, 2.0));
        assert_eq!(point(" -1.5e3 \t 2 extra\r"), at(-1500.0, 2.0));
        assert_eq!(point("1;2"), at(1.0, 2.0));
        for skipped in ["", "  ", "# note", "x,y", "lon lat"] {
            assert_eq!(point(skipped), Ok(None), "{skipped}");
        }
        for wrong in ["1", "1,b", "nan,1", "inf,2", "?"] {
            assert_eq!(point(wrong), Err(wrong));
        }
        assert_eq!(comma_separated("1 \t2 3"), "1,2,3");
    }

    #[test]
    fn blocks_end_at_lines() {
        let text = "123456,789\n".repeat(300_000);
        let mut reader = BufReader::new(text.as_bytes());
        let (mut block, mut total) = (Vec::new(), 0);
        while fill(&mut reader, &mut block).expect("memory") > 0 {
            assert_eq!(block.last(), Some(&b'\n'));
            total += block.len();
            block.clear();
        }
        assert_eq!(total, text.len());
    }
}
