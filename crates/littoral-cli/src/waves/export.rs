//! `littoral waves export`: a square of sea that repeats itself, as maps for other programs.
//!
//! The sea is one tile of the engine's own ([`Cascades`]), with all waves that fit into it, read off at its very samples: what lies beyond one
//! edge is what begins at the opposite one, to the last bit. In a loop each wave runs through a whole number of turns.

use super::state;
use super::{bearing, digits};
use crate::input;
use crate::render::check_output;
use crate::talk::{Failure, Talk, progress, seconds as shown_seconds, tidy};
use glam::{DVec2, Vec3};
use indicatif::ProgressBar;
use littoral::waves::cascades::{Cascades, Options, Tile};
use littoral::waves::{BLOCK, Motion, Points, SeaState, WaveModel, bearing_from_heading};
use littoral_data::write::{self, Layer, PngPixels};
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Instant;

/// A tile of sea that repeats without a seam: displacement, normals and foam, at an instant or as a loop.
///
/// All waves of the state that fit into the tile: none longer than it, none shorter than four samples. Water moves sideways, too (choppy
/// waves): the vertex that rests at a sample goes to that sample plus its displacement, and there the surface has that normal and that foam.
/// The sample in column i and row j from below rests at (i, j) * TILE / SAMPLES; the pixel left of the first column is the last one of its row.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral waves export --sea wind=12,from=240 --out sea.exr        floats, all in one file
  littoral waves export --sea beaufort=5 --size 1024 --tile 400 --out sea.png
                                     sea_displacement.png, sea_normal.png, sea_foam.png
  littoral waves export --sea hs=1,tp=6 --what normal --out ripples.png
  littoral waves export --sea wind=15 --loop 20 --fps 30 --out waves/
  littoral waves export --sea wind=15 --loop 20 --format exr --out waves/

Pictures have north (+y) at the top and east (+x) at the right, z up.
  displacement  metres: EXR as they are; PNG 16 bits a channel, R G B = x y z,
                metres = (2 * value / 65535 - 1) * range, one range for all of a loop
  normal        unit vectors: EXR as they are; PNG 8 bits, R G B = x y z,
                component = 2 * value / 255 - 1 (y up, as in OpenGL; flip G for DirectX)
  foam          share of the surface, 0 to 1: EXR as it is; PNG 8 bits, 255 for 1
An EXR of several has layers (displacement.X, .Y, .Z, normal.X, …, foam.V), of one R, G, B or Y.
A folder gets a file for each (displacement.png, …; in a loop displacement_00001.png onward) and
tile.json, which says what is printed with --json: range (m), tile (m), size, sample (m), time
(s), loop, fps, frames, hs (m, of the state) and tile_hs (of the waves in the tile), shortest and
longest wave (m), from (where waves come from), wind (m/s), wind_from, files, seconds.")]
pub struct Export {
    /// The waves, as `littoral render --sea` takes them: wind=15,from=240; hs=2,tp=9; beaufort=6; douglas=4; buoy=FILE; with
    /// swell=HEIGHT@PERIOD/FROM, fetch=KM, model=, gamma=, spread=, depth=, breaking=, seed=
    #[arg(long, value_name = "SPEC")]
    sea: String,
    /// The file to write: .exr or .png; or a folder
    #[arg(long, short, value_name = "FILE|FOLDER")]
    out: PathBuf,
    /// Samples along a side: a power of two from 64 to 1024
    #[arg(long, value_name = "SAMPLES", value_parser = size, default_value = "512")]
    size: usize,
    /// Length of a side (m) [default: about five times the highest waves' length]
    #[arg(long, value_name = "METRES", value_parser = length)]
    tile: Option<f64>,
    /// What to write
    #[arg(long, value_enum, value_delimiter = ',', value_name = "WHAT,…", default_values = ["displacement", "normal", "foam"])]
    what: Vec<What>,
    /// The files' format in a folder [default: png]
    #[arg(long, value_enum, value_name = "FORMAT")]
    format: Option<Format>,
    /// Sideways motion over that of real waves, from 0 (heights alone) to 2
    #[arg(long, value_name = "FACTOR", value_parser = choppiness, default_value = "1")]
    choppiness: f64,
    /// The instant in seconds; of a loop, that of its first frame
    #[arg(long, value_name = "S", value_parser = input::instant, default_value = "0")]
    time: f64,
    /// A loop of so many seconds: the frame after the last is the first, to the bit
    #[arg(long = "loop", value_name = "SECONDS", value_parser = period)]
    period: Option<f64>,
    /// Frames a second of the loop
    #[arg(long, value_name = "F", value_parser = fps, default_value = "30", requires = "period")]
    fps: f64,
}

fn size(text: &str) -> Result<usize, String> {
    let wrong = || format!("expected a power of two from 64 to 1024, got \"{}\"", text.trim());
    let size = text.trim().parse::<usize>().map_err(|_| wrong())?;
    if size.is_power_of_two() && (64..=1024).contains(&size) { Ok(size) } else { Err(wrong()) }
}

fn length(text: &str) -> Result<f64, String> {
    input::within(text, 0.1, 1e6, "a length from 0.1 to 1e6 m")
}

fn choppiness(text: &str) -> Result<f64, String> {
    input::within(text, 0.0, 2.0, "a factor from 0 to 2")
}

fn period(text: &str) -> Result<f64, String> {
    input::within(text, 0.1, 3600.0, "a loop from 0.1 to 3600 s")
}

fn fps(text: &str) -> Result<f64, String> {
    input::within(text, 0.01, 1000.0, "0.01 to 1000 frames a second")
}

/// What is known of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
enum What {
    /// Where its water goes (m)
    Displacement,
    /// How the surface leans there
    Normal,
    /// How white it is
    Foam,
}

impl What {
    fn name(self) -> &'static str {
        match self {
            What::Displacement => "displacement",
            What::Normal => "normal",
            What::Foam => "foam",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// 8 or 16 bits: see below
    Png,
    /// Floating point
    Exr,
}

/// The tile at an instant, row by row from the north.
struct Maps {
    displacement: Vec<Vec3>,
    normal: Vec<Vec3>,
    foam: Vec<f32>,
}

/// Where files go.
struct Out {
    /// A folder, or the file.
    path: PathBuf,
    folder: bool,
    format: Format,
}

#[derive(Serialize)]
struct Answer {
    files: Vec<String>,
    size: usize,
    tile: f64,
    sample: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<f32>,
    time: f64,
    #[serde(rename = "loop")]
    period: Option<f64>,
    fps: Option<f64>,
    frames: usize,
    hs: f64,
    tile_hs: f64,
    shortest: f64,
    longest: f64,
    wind: f64,
    wind_from: f64,
    from: f64,
    choppiness: f64,
    seconds: f64,
}

impl Export {
    /// Runs the command.
    pub fn run(mut self, talk: &mut Talk) -> Result<(), Failure> {
        let started = Instant::now();
        self.what.sort();
        self.what.dedup();
        let out = self.output()?;
        let state = state::read(&self.sea, talk)?;
        let wrong =
            |error: littoral::waves::OutOfRange| Failure::Usage(format!("--sea {}: {error}; correct it", self.sea));
        let tile = self.tile(&state);
        let (hs, tile_hs) = self.heights(&state, &tile, talk);
        let options = Options { choppiness: self.choppiness, period: self.period, ..Options::default() };
        let foam = self.what.contains(&What::Foam);
        let make = |foam| Cascades::with_tiles(&state, &[tile], &Options { foam, ..options });
        let frames = match self.period {
            Some(period) => ((period * self.fps).round() as usize).max(1),
            None => 1,
        };
        const MOST: usize = 100_000;
        if frames > MOST {
            let problem =
                format!("expected at most {MOST} frames, got {frames}; choose a lower --fps or a shorter --loop");
            return Err(Failure::Usage(problem));
        }
        let time = |frame: usize| self.time + self.period.map_or(0.0, |period| period * frame as f64 / frames as f64);
        if out.folder {
            std::fs::create_dir_all(&out.path).map_err(|e| littoral_data::Error::io(&out.path, e))?;
            self.look_for_others(&out, frames, talk);
        }

        let coded = out.format == Format::Png && self.what.contains(&What::Displacement);
        let bar = if frames == 1 {
            ProgressBar::hidden()
        } else {
            progress((frames * if coded { 2 } else { 1 }) as u64, "exporting")
        };
        let range = if coded {
            // All frames are seen first, without foam: it does not move the water.
            let mut sea = make(false).map_err(wrong)?;
            let mut most = 0f32;
            for frame in 0..frames {
                sea.set_time(time(frame));
                most =
                    maps(&sea, &tile, DVec2::ZERO).displacement.iter().fold(most, |m, d| m.max(d.abs().max_element()));
                bar.inc(1);
            }
            Some(round_up(most))
        } else {
            None
        };
        let mut sea = make(foam).map_err(wrong)?;
        let mut files = Vec::new();
        for frame in 0..frames {
            sea.set_time(time(frame));
            let maps = maps(&sea, &tile, DVec2::ZERO);
            let number = self.period.map(|_| frame + 1);
            let written = self.write(&out, number, &maps, range, &tile)?;
            files.extend(written.iter().map(|file| file.display().to_string()));
            bar.inc(1);
        }
        bar.finish_and_clear();

        let answer = Answer {
            size: tile.samples,
            tile: tile.length,
            sample: tile.length / tile.samples as f64,
            range,
            time: self.time,
            period: self.period,
            fps: self.period.map(|period| frames as f64 / period),
            frames,
            hs,
            tile_hs,
            shortest: TAU / tile.highest,
            longest: tile.length,
            wind: state.wind.speed,
            wind_from: bearing_from_heading(state.wind.heading),
            from: bearing_from_heading(state.mean_heading()),
            choppiness: self.choppiness,
            files,
            seconds: started.elapsed().as_secs_f64(),
        };
        if out.folder {
            let file = out.path.join("tile.json");
            let text = serde_json::to_vec_pretty(&answer).map_err(|e| Failure::Work(format!("JSON: {e}")))?;
            write::whole(&file, |sink| sink.write_all(&text))?;
        }
        if talk.json() { talk.print_json(answer) } else { talk.print(told(&answer, &out)) }
    }

    fn output(&self) -> Result<Out, Failure> {
        let path = self.out.clone();
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_lowercase);
        let file = match ending.as_deref() {
            _ if path.is_dir() => None,
            Some("png") => Some(Format::Png),
            Some("exr") => Some(Format::Exr),
            None => None,
            Some(other) => {
                let shown = path.display();
                let problem = format!("expected a name ending in .exr or .png, or a folder, got .{other}; change it");
                return Err(Failure::Usage(format!("{shown}: {problem}")));
            }
        };
        let shown = path.display();
        let out = match (file, self.format) {
            (None, format) => Out { path, folder: true, format: format.unwrap_or(Format::Png) },
            (Some(_), _) if self.period.is_some() => {
                return Err(Failure::Usage(format!(
                    "{shown}: expected a folder for the frames of a loop, got a file; leave out its ending"
                )));
            }
            (Some(of_name), Some(format)) if format != of_name => {
                return Err(Failure::Usage(format!(
                    "{shown}: expected the ending of --format, got another; leave one out"
                )));
            }
            (Some(format), _) => Out { path, folder: false, format },
        };
        // A slash at the end leaves the folder itself to be made.
        check_output(&out.path.components().collect::<PathBuf>(), &[])?;
        Ok(out)
    }

    /// The tile for a state.
    fn tile(&self, state: &SeaState) -> Tile {
        let peak = state.peak().map(|frequency| TAU / state.water().wavenumber(TAU * frequency));
        let length = self.tile.unwrap_or_else(|| peak.map_or(100.0, |length| round(5.0 * length).clamp(1.0, 1e5)));
        let step = TAU / length;
        // From the longest that fits to four samples a wave: what programs make of the samples in between still looks like it.
        Tile { length, turn: 0.0, samples: self.size, lowest: 0.5 * step, highest: step * (self.size / 4) as f64 }
    }

    /// The state's significant height (m) and that of the waves in the tile, which may leave out too much to be worth having.
    fn heights(&self, state: &SeaState, tile: &Tile, talk: &mut Talk) -> (f64, f64) {
        let Some((low, high)) = state.band() else { return (0.0, 0.0) };
        let frequency = |wavenumber: f64| state.water().angular_frequency(wavenumber) / TAU;
        let (from, to) = (frequency(tile.lowest).max(0.5 * low), frequency(tile.highest).min(20.0 * high));
        let hs = state.significant_height();
        let held = if from < to { 4.0 * state.moment(0, from, to).sqrt() } else { 0.0 };
        let share = (held / hs.max(1e-9)).powi(2).min(1.0);
        if share < 0.8 {
            let peak = state.peak().map_or(0.0, |f| TAU / state.water().wavenumber(TAU * f));
            let (length, sample) = (tidy(tile.length, 2), digits(tile.length / tile.samples as f64, 2));
            let percent = tidy(100.0 * share, 0);
            let advice = format!("the highest are {} m long", digits(peak, 2));
            talk.warn(format!(
                "a tile of {length} m with samples every {sample} m holds {percent} % of the waves' energy: {advice}; change --tile or --size"
            ));
        }
        if let (Some(period), Some(peak)) = (self.period, state.peak())
            && period * peak < 3.0
        {
            let (asked, better) = (tidy(period, 2), digits(4.0 / peak, 2));
            talk.warn(format!(
                "in a loop of {asked} s waves of {} s change their speed or stand still; {better} s or more is better",
                digits(1.0 / peak, 2)
            ));
        }
        (hs, held)
    }

    /// Frames of an older, longer loop would be taken for this one's.
    fn look_for_others(&self, out: &Out, frames: usize, talk: &mut Talk) {
        let beyond = self.file(out, self.period.map(|_| frames + 1), Some(self.what[0]));
        if self.period.is_some() && beyond.is_file() {
            talk.warn(format!("{}: is of another, longer loop; remove it and those after it", beyond.display()));
        }
    }

    /// The name of a file, of all kinds together for `None`.
    fn file(&self, out: &Out, number: Option<usize>, what: Option<What>) -> PathBuf {
        let ending = if out.format == Format::Png { "png" } else { "exr" };
        match (what, number) {
            _ if !out.folder && (self.what.len() == 1 || what.is_none()) => out.path.clone(),
            (Some(what), _) if !out.folder => {
                let stem = out.path.file_stem().unwrap_or_default().to_string_lossy();
                out.path.with_file_name(format!("{stem}_{}.{ending}", what.name()))
            }
            (what, Some(number)) => out.path.join(format!("{}_{number:05}.{ending}", what.map_or("tile", What::name))),
            (what, None) => out.path.join(format!("{}.{ending}", what.map_or("tile", What::name))),
        }
    }

    /// Writes what is asked for of an instant.
    fn write(
        &self,
        out: &Out,
        number: Option<usize>,
        maps: &Maps,
        range: Option<f32>,
        tile: &Tile,
    ) -> Result<Vec<PathBuf>, Failure> {
        let side = tile.samples as u32;
        let sea = format!("--sea {} on {} m", self.sea, tile.length);
        if out.format == Format::Exr {
            let comment =
                |what: &str| format!("{sea}; {what}; X east (right), Y north (up), Z up; displacement in metres");
            if !out.folder && self.what.len() > 1 {
                let layers = self.what.iter().map(|what| layer(*what, maps, true)).collect();
                let file = self.file(out, number, None);
                write::exr(&file, side, side, layers, &comment("a tile"))?;
                return Ok(vec![file]);
            }
            let one = |what: &What| {
                let file = self.file(out, number, Some(*what));
                write::exr(&file, side, side, vec![layer(*what, maps, false)], &comment(what.name()))?;
                Ok(file)
            };
            return self.what.iter().map(one).collect();
        }
        let one = |what: &What| {
            let file = self.file(out, number, Some(*what));
            let notes = |text: String| [("Software", "littoral".to_owned()), ("Description", format!("{sea}; {text}"))];
            match what {
                What::Displacement => {
                    let range = range.unwrap_or(1.0);
                    let code = |metres: f32| ((metres / range * 0.5 + 0.5) * 65_535.0).round() as u16;
                    let pixels: Vec<[u16; 3]> = maps.displacement.iter().map(|d| d.to_array().map(code)).collect();
                    let text = format!("displacement x y z in metres = (2 * value / 65535 - 1) * {range}");
                    write::png(&file, side, side, PngPixels::Rgb16(&pixels), &notes(text))?;
                }
                What::Normal => {
                    let code = |part: f32| ((part * 0.5 + 0.5) * 255.0).round() as u8;
                    let pixels: Vec<[u8; 3]> = maps.normal.iter().map(|n| n.to_array().map(code)).collect();
                    let text = "normal x y z = 2 * value / 255 - 1, y up".to_owned();
                    write::png(&file, side, side, PngPixels::Rgb8(&pixels), &notes(text))?;
                }
                What::Foam => {
                    let pixels: Vec<u8> = maps.foam.iter().map(|foam| (foam * 255.0).round() as u8).collect();
                    write::png(&file, side, side, PngPixels::Grey8(&pixels), &notes("foam, 255 for all".to_owned()))?;
                }
            }
            Ok(file)
        };
        self.what.iter().map(one).collect()
    }
}

/// What is known of the samples of a tile whose first stands at `origin`.
fn maps(sea: &Cascades, tile: &Tile, origin: DVec2) -> Maps {
    let n = tile.samples;
    let mut maps = Maps { displacement: vec![Vec3::ZERO; n * n], normal: vec![Vec3::Z; n * n], foam: vec![0.0; n * n] };
    let rows = maps.displacement.par_chunks_mut(n).zip(maps.normal.par_chunks_mut(n)).zip(maps.foam.par_chunks_mut(n));
    rows.enumerate().for_each(|(row, ((displacement, normal), foam))| {
        let mut points = Points::at(0.0, origin.y + tile.length * (n - 1 - row) as f64 / n as f64);
        for start in (0..n).step_by(BLOCK) {
            points.x = std::array::from_fn(|l| origin.x + tile.length * (start + l) as f64 / n as f64);
            let mut motion = Motion::STILL;
            sea.add_motion(&points, &mut motion);
            for l in 0..BLOCK {
                displacement[start + l] = Vec3::new(motion.dx[l], motion.dy[l], motion.dz[l]);
                normal[start + l] = normal_of(&motion, l);
                foam[start + l] = motion.foam[l].clamp(0.0, 1.0);
            }
        }
    });
    maps
}

/// The upward unit normal of the displaced surface: across what the map makes of steps eastward and northward.
fn normal_of(motion: &Motion, l: usize) -> Vec3 {
    let east = Vec3::new(1.0 + motion.dxx[l], motion.dxy[l], motion.slope_x[l]);
    let north = Vec3::new(motion.dxy[l], 1.0 + motion.dyy[l], motion.slope_y[l]);
    let across = east.cross(north);
    // Where water folds over it is upright.
    across.with_z(across.z.max(0.05)).normalize_or(Vec3::Z)
}

/// As a layer of an EXR, named or the only one.
fn layer(what: What, maps: &Maps, named: bool) -> Layer {
    let three = |planes: &[Vec3], names: [&'static str; 3]| {
        let plane = |i: usize| (names[i], planes.iter().map(|p| p[i]).collect());
        vec![plane(0), plane(1), plane(2)]
    };
    let names = if named { ["X", "Y", "Z"] } else { ["R", "G", "B"] };
    let channels = match what {
        What::Displacement => three(&maps.displacement, names),
        What::Normal => three(&maps.normal, names),
        What::Foam => vec![(if named { "V" } else { "Y" }, maps.foam.clone())],
    };
    Layer { name: if named { what.name() } else { "" }, channels }
}

/// To two digits.
fn round(number: f64) -> f64 {
    let unit = 10f64.powf(number.log10().floor() - 1.0);
    (number / unit).round() * unit
}

/// Upward to three digits; 1 for nothing at all.
fn round_up(number: f32) -> f32 {
    if number <= 0.0 {
        return 1.0;
    }
    let unit = 10f32.powf(number.log10().floor() - 2.0);
    let rounded = (number / unit).ceil() * unit;
    // As it is printed, and never too small.
    let tidied = tidy(f64::from(rounded), 5).parse().unwrap_or(rounded);
    if tidied >= number { tidied } else { number }
}

/// The answer for people.
fn told(answer: &Answer, out: &Out) -> String {
    let files = match &answer.files[..] {
        files if out.folder => format!("{}: {} files and tile.json", out.path.display(), files.len()),
        files => files.join(", "),
    };
    let size = format!("{} x {0} samples over {} m", answer.size, tidy(answer.tile, 2));
    let range =
        answer.range.map_or(String::new(), |range| format!(", displacement 0 to 65535 for -{range} to {range} m"));
    let frames = match answer.fps {
        Some(fps) => format!(", {} frames at {} a second", answer.frames, tidy(fps, 3)),
        None => String::new(),
    };
    let waves = format!("waves of {} m from {}", digits(answer.tile_hs, 2), bearing(answer.from));
    format!("{files}: {size}{frames}, {waves}{range}, in {}\n", shown_seconds(answer.seconds))
}
#[cfg(test)]
mod tests {
    use super::*;

    fn sea(length: f64, period: Option<f64>) -> (Cascades, Tile) {
        let state: SeaState = "wind=13,from=250,seed=5".parse().expect("a sea");
        let step = TAU / length;
        let tile = Tile { length, turn: 0.0, samples: 64, lowest: 0.5 * step, highest: 16.0 * step };
        let options = Options { period, ..Options::default() };
        (Cascades::with_tiles(&state, &[tile], &options).expect("a tile"), tile)
    }

    fn same(a: &Maps, b: &Maps) -> bool {
        a.displacement == b.displacement && a.normal == b.normal && a.foam == b.foam
    }

    #[test]
    fn beyond_an_edge_the_tile_begins_anew() {
        let (mut sea, tile) = sea(128.0, None);
        sea.set_time(31.4);
        let here = maps(&sea, &tile, DVec2::ZERO);
        assert!(same(&here, &maps(&sea, &tile, DVec2::new(128.0, 0.0))));
        assert!(same(&here, &maps(&sea, &tile, DVec2::new(-384.0, 256.0))));
        assert!(here.foam.iter().any(|f| *f > 0.3), "no foam to compare");
        // The step over the edge is like all others: neither none, as where the edge is there twice, nor a jump.
        let n = tile.samples;
        let step = |a: usize, b: usize| f64::from((here.displacement[a] - here.displacement[b]).length_squared());
        let across: f64 =
            (0..n).map(|r| step(r * n, r * n + n - 1) + step(r, (n - 1) * n + r)).sum::<f64>() / (2 * n) as f64;
        let inside: f64 = (0..n * n).filter(|i| i % n > 0 && *i >= n).map(|i| step(i, i - 1) + step(i, i - n)).sum();
        let ratio = across / (inside / (2 * (n - 1) * (n - 1)) as f64);
        assert!((0.6..1.6).contains(&ratio), "steps over the edges are {ratio} of the others");
    }

    #[test]
    fn a_loop_returns_to_the_same_bits() {
        let (mut sea, tile) = sea(100.0, Some(12.0));
        let mut at = |time: f64| {
            sea.set_time(time);
            maps(&sea, &tile, DVec2::ZERO)
        };
        let (first, middle, last) = (at(0.0), at(5.0), at(12.0));
        assert!(same(&first, &last) && same(&middle, &at(17.0)));
        assert!(!same(&first, &middle));
    }

    #[test]
    fn rows_run_from_north_to_south_and_normals_lean_with_the_surface() {
        let (mut sea, tile) = sea(200.0, None);
        sea.set_time(3.0);
        let here = maps(&sea, &tile, DVec2::ZERO);
        let n = tile.samples;
        let side = tile.length / n as f64;
        // A sample counted from below is where its water rests.
        let (column, row) = (5, 40);
        let mut motion = Motion::STILL;
        sea.add_motion(&Points::at(column as f64 * side, row as f64 * side), &mut motion);
        assert_eq!(here.displacement[(n - 1 - row) * n + column].z, motion.dz[0]);
        let place = |x: usize, y: usize| {
            Vec3::new(x as f32 * side as f32, -(y as f32) * side as f32, 0.0) + here.displacement[y * n + x]
        };
        let mut off = 0.0;
        for y in 1..n - 1 {
            for x in 1..n - 1 {
                let (east, north) = (place(x + 1, y) - place(x - 1, y), place(x, y - 1) - place(x, y + 1));
                let normal = here.normal[y * n + x];
                assert!((normal.length() - 1.0).abs() < 1e-5 && normal.z > 0.0);
                off += (normal - east.cross(north).normalize()).length() / ((n - 2) * (n - 2)) as f32;
            }
        }
        // Differences over two samples flatten waves of four samples a good deal.
        assert!(off < 0.08, "normals are off by {off} in the mean");
        let mean_square = here.displacement.iter().map(|d| f64::from(d.z * d.z)).sum::<f64>() / (n * n) as f64;
        let state: SeaState = "wind=13,from=250".parse().expect("a sea");
        let held = 4.0 * mean_square.sqrt() / state.significant_height();
        assert!((0.7..1.3).contains(&held), "{held} of the height");
    }

    #[test]
    fn ranges_are_short_numbers_that_hold_all() {
        for (most, range) in [(3.0471_f32, 3.05_f32), (0.0, 1.0), (12.31, 12.4), (0.012_34, 0.0124), (2.5, 2.5)] {
            let got = round_up(most);
            assert!((got - range).abs() < 1e-6 * range && got >= most, "{got} for {most}");
        }
        assert_eq!((round(612.0), round(4.37)), (610.0, 4.4));
    }
}
