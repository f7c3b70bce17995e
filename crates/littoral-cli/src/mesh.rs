//! `littoral mesh`: triangles for printers, viewers and other programs.

use crate::ground::{Frame, Opened, Reading, System};
use crate::input;
use crate::plot::ending;
use crate::render::check_output;
use crate::talk::{Failure, Talk, progress, seconds, tidy};
use glam::{DAffine2, DVec2, DVec4};
use littoral::field::{Land, coast};
use littoral::mesh::measure::measure;
use littoral::mesh::{Form, Model, Triangulation, rtin, tin};
use littoral_data::write::{self, MeshFormat};
use littoral_data::{Crs, name_of_all};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A mesh of triangles whose vertical error is nowhere above a bound.
///
/// The error is measured at every sample of the data before anything is written, and told. Voids are cut out cleanly.
/// Normals are those of the full data, however few the triangles. Without FILE the built-in coast is taken.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral mesh dem.tif                                    into littoral.ply
  littoral mesh dem.tif --max-error 2 --out dem.glb        nowhere farther than 2 m from the data
  littoral mesh dem.tif --base --local --out print.stl     closed, ready to be printed
  littoral mesh dem.tif --base -50 --exaggeration 2 --out print.stl
  littoral mesh coast.tif --shoreline --out coast.glb      keeps the line of height 0 as edges
  littoral mesh N45W122.hgt N46W122.hgt --out both.ply     files that join, as one land
  littoral mesh dem.tif --window 560000,5110000,565000,5115000 --max-error 0.5
  littoral mesh dem.tif --lonlat --out degrees.obj

X and Y are the file's own coordinates, Z metres; files in degrees, and those that do not say where
they lie, are laid out in metres east and north of their middle (as everything is with --local).
.ply and .obj hold coordinates in full. .stl and .glb hold seven digits: there coordinates count
from an origin near the model, which the file's header tells (.glb: the node's translation, y up)
and --json as \"origin\".")]
pub struct Mesh {
    /// Height files of any known format: several that lie beside or over each other, in one coordinate system, become one
    /// mesh; none for the built-in coast
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The file to write: .ply, .obj, .stl or .glb
    #[arg(long, short, value_name = "FILE", default_value = "littoral.ply")]
    out: PathBuf,
    /// How triangles are chosen
    #[arg(long, value_enum, value_name = "METHOD", default_value = "tin")]
    method: Method,
    /// The mesh is nowhere farther above or below a sample than this (metres) [default: a two-hundredth of the
    /// relief, half a step of the file's heights at least]
    #[arg(long, value_name = "METRES", value_parser = max_error)]
    max_error: Option<f64>,

    /// Close the mesh for printing, by walls down to a flat bottom at this height in metres [default: below the
    /// lowest ground by a fiftieth of the longer side]
    #[arg(long, value_name = "METRES", num_args = 0..=1, default_missing_value = "", help_heading = "Form")]
    base: Option<String>,
    /// Keep the line of this height in metres as edges of the mesh, which does not change its surface [default: 0]
    #[arg(long, value_name = "METRES", num_args = 0..=1, default_missing_value = "", help_heading = "Form")]
    shoreline: Option<String>,
    /// Stretch all heights; errors and other heights are told unstretched
    #[arg(long, value_name = "FACTOR", value_parser = input::factor, default_value = "1", help_heading = "Form")]
    exaggeration: f64,
    /// X and Y in metres from the middle of the data
    #[arg(long, conflicts_with = "lonlat", help_heading = "Form")]
    local: bool,
    /// X and Y are longitude and latitude in degrees, those of --window too
    #[arg(long, help_heading = "Form")]
    lonlat: bool,

    /// Only the samples of a part: two opposite corners of it
    #[arg(long, value_name = "X,Y,X,Y", value_parser = input::window, help_heading = "Data")]
    window: Option<DVec4>,
    /// Use all samples of the file, however many; otherwise files of more than 128 million become coarser first
    #[arg(long, conflicts_with = "window", help_heading = "Data")]
    full: bool,
    #[command(flatten)]
    reading: Reading,
}

/// How triangles are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    /// Right triangles of halved squares: fast, regular
    Rtin,
    /// A Delaunay triangulation of the samples that matter: the fewest triangles
    Tin,
}

fn max_error(text: &str) -> Result<f64, String> {
    match input::number(text) {
        Ok(0.0) => Err("expected an error above 0 metres, got 0; for all that the data hold choose less than \
                        their step, such as 0.001"
            .into()),
        Ok(error) if (1e-9..=1e6).contains(&error) => Ok(error),
        Ok(error) => Err(format!("expected an error above 0 metres, up to 1e6, got {error}")),
        Err(_) => Err(format!("expected an error above 0 metres, got \"{}\"", text.trim())),
    }
}

/// At most so many samples are taken without `--full`.
const FITTING: usize = 128 << 20;

/// What X and Y of the mesh are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coordinates {
    File,
    Local,
    LonLat,
}

/// The ground to be meshed.
struct Ground {
    name: String,
    land: Land,
    frame: Frame,
    /// What heights are counted from, in words.
    datum: String,
    /// The distance between heights that the file can tell apart (m).
    step: f64,
    built_in: bool,
}

#[derive(Serialize)]
struct Answer {
    file: String,
    format: String,
    method: String,
    triangles: usize,
    vertices: usize,
    max_error: f64,
    max_error_asked: f64,
    seconds: f64,
    /// Samples of the raster that was meshed.
    samples: usize,
    void: usize,
    /// `file`, `local` or `lonlat`, and the system's name.
    coordinates: &'static str,
    crs: String,
    /// What coordinates within the file count from.
    origin: [f64; 3],
    exaggeration: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    base: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shoreline: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shoreline_edges: Option<usize>,
    datum: String,
}

impl Mesh {
    /// Runs the command.
    pub fn run(mut self, talk: &mut Talk) -> Result<(), Failure> {
        let started = Instant::now();
        let base = optional_height(&mut self.base, &mut self.files, "--base")?;
        let shoreline = optional_height(&mut self.shoreline, &mut self.files, "--shoreline")?.map(|h| h.unwrap_or(0.0));
        ending(&self.out, &["ply", "obj", "stl", "glb"])?;
        let inputs: Vec<&Path> = self.files.iter().map(PathBuf::as_path).collect();
        check_output(&self.out, &inputs)?;
        let Some(format) = MeshFormat::of_name(&self.out) else { unreachable!("endings are those of formats") };

        let ground = self.ground(talk)?;
        let (land, raster) = (&ground.land, ground.land.raster());
        let failure = |problem: &str| Failure::Work(format!("{}: {problem}", ground.name));
        let range = land.height_range();
        let asked =
            self.max_error.unwrap_or_else(|| suiting(f64::from(range.high) - f64::from(range.low), ground.step));
        let base = base.map(|height| height.unwrap_or_else(|| self.below(land)));
        if let Some(base) = base.filter(|&base| base >= f64::from(range.low)) {
            let (low, base) = (range.low, tidy(base, 3));
            return Err(failure(&format!(
                "expected --base below the lowest ground, {low} m, got {base} m; choose a lower one"
            )));
        }
        if let Some(level) = shoreline.filter(|&level| !range.contains(level as f32)) {
            talk.warn(format!("{}: no ground at {level} m, so there is no line to keep", ground.name));
        }

        let mesh = self.triangles(&ground, asked)?;
        let measured = measure(raster, &mesh);
        if measured.max_error > asked || measured.missed + measured.void_covered > 0 {
            let problem = format!("expected a mesh within {asked} m, got {measured:?}; please report it with the file");
            return Err(failure(&problem));
        }
        let coordinates = self.coordinates(&ground, talk);
        let place = ground.place(coordinates);
        let to = |at: DVec2| place.transform_point2(at);
        let turn = match coordinates {
            Coordinates::LonLat => ground.frame.north(),
            // Of the axis alone: degrees and feet stretch, which is no turn.
            _ => place.matrix2.x_axis.to_angle(),
        };
        let form = Form { shoreline, base, exaggeration: self.exaggeration, place: &to, turn };
        let mut model = Model::new(&mesh, raster, &form).map_err(|error| failure(&error.to_string()))?;
        drop(mesh);
        if coordinates == Coordinates::LonLat {
            ground.frame.to_lonlat(&mut model.positions).map_err(|problem| failure(&problem))?;
        }
        let notes = self.notes(&ground, coordinates, measured.max_error, base, shoreline);
        let origin = write::mesh(&self.out, format, &model, &notes)?;

        let answer = Answer {
            file: self.out.display().to_string(),
            format: format!("{format:?}").to_lowercase(),
            method: format!("{:?}", self.method).to_lowercase(),
            triangles: model.triangles.len(),
            vertices: model.positions.len(),
            max_error: measured.max_error,
            max_error_asked: asked,
            seconds: started.elapsed().as_secs_f64(),
            samples: raster.heights().len(),
            void: raster.voids().count(),
            coordinates: coordinates.name(),
            crs: ground.frame.system().name().to_owned(),
            origin: origin.to_array(),
            exaggeration: self.exaggeration,
            base,
            shoreline,
            shoreline_edges: shoreline.map(|_| model.shoreline.len()),
            datum: ground.datum.clone(),
        };
        if talk.json() { talk.print_json(answer) } else { talk.print(told(&answer, &ground)) }
    }

    /// The land of the files, or of none the built-in coast.
    fn ground(&self, talk: &mut Talk) -> Result<Ground, Failure> {
        if self.files.is_empty() {
            if self.window.is_some() || self.lonlat {
                let problem = "expected a file for --window and --lonlat, got none; name one";
                return Err(Failure::Usage(problem.into()));
            }
            return Ok(Ground {
                name: "the built-in coast".into(),
                land: coast::coast(),
                frame: Frame::metres(),
                datum: "heights above its sea level".into(),
                step: 0.0,
                built_in: true,
            });
        }
        let name = name_of_all(&self.files).display().to_string();
        let mut opened = Opened::open_all(&self.files, self.reading, talk)?;
        let (land, frame) = match self.window {
            None => opened.fitting(if self.full { usize::MAX } else { FITTING }, talk)?,
            Some(corners) => {
                let system = System::of(self.lonlat);
                let corners = [corners.truncate().truncate(), DVec2::new(corners.z, corners.w)];
                let [a, b] = corners.map(|at| opened.local(system, at));
                let Some(window) = opened.samples_between(a?, b?) else {
                    let outside = opened.outside(system, 0.5 * (corners[0] + corners[1]));
                    return Err(opened.failure(&format!("--window holds less than 2 x 2 samples: {outside}")));
                };
                (opened.part(window, talk)?, opened.frame.clone())
            }
        };
        if opened.info().columns * opened.info().rows > land.raster().heights().len() && self.window.is_none() {
            talk.warn(format!(
                "{name}: the error is that to the coarser samples; --full takes all, --window X,Y,X,Y all of a part"
            ));
        }
        Ok(Ground { name, land, frame, datum: opened.datum(), step: opened.info().step, built_in: false })
    }

    fn triangles(&self, ground: &Ground, asked: f64) -> Result<Triangulation, Failure> {
        let raster = ground.land.raster();
        // Heights are single precision; the bound must not grow by being so.
        let single = asked as f32;
        let single = if f64::from(single) > asked { single.next_down() } else { single };
        let bar = progress(1000, "meshing");
        let made = match self.method {
            Method::Rtin => {
                let mut mesh = Triangulation::default();
                rtin::Rtin::new(raster).extract(raster, single, &mut mesh).map(|()| mesh)
            }
            Method::Tin => tin::triangulate(raster, single, &|done| {
                bar.set_position((done * 1000.0) as u64);
                true
            }),
        };
        bar.finish_and_clear();
        made.map_err(|error| Failure::Work(format!("{}: {error}", ground.name)))
    }

    /// The height of a base that nobody chose: below the ground by a fiftieth of the longer side as it will look.
    fn below(&self, land: &Land) -> f64 {
        let thickness = 0.02 * land.extent().max_element() / self.exaggeration;
        let step = 10f64.powf(thickness.log10().floor());
        ((f64::from(land.height_range().low) - thickness) / step).floor() * step
    }

    /// What X and Y are to be.
    fn coordinates(&self, ground: &Ground, talk: &mut Talk) -> Coordinates {
        let system = ground.frame.system();
        if self.lonlat {
            return Coordinates::LonLat;
        }
        if self.local || ground.built_in || !ground.frame.is_placed() || matches!(system, Crs::Geographic { .. }) {
            return Coordinates::Local;
        }
        let scale = ground.place(Coordinates::File).matrix2.x_axis.length() / ground.land.raster().spacing().x;
        if (scale - 1.0).abs() > 0.01 {
            let scale = tidy(scale, 3);
            talk.warn(format!(
                "{}: X and Y are in its own units, {scale} to a metre of Z; --local gives all in metres",
                ground.name
            ));
        }
        Coordinates::File
    }

    /// What the file says of itself.
    fn notes(
        &self,
        ground: &Ground,
        coordinates: Coordinates,
        max_error: f64,
        base: Option<f64>,
        shoreline: Option<f64>,
    ) -> Vec<(&'static str, String)> {
        let metres = |height: f64| format!("{height} m");
        let stretched = (self.exaggeration != 1.0).then(|| format!("{} times", self.exaggeration));
        let notes = [
            ("source", Some(ground.name.clone())),
            ("coordinates", Some(ground.explained(coordinates))),
            ("heights", Some(format!("metres, {}", ground.datum))),
            ("exaggeration", stretched),
            ("greatest vertical error at a sample", Some(metres(max_error))),
            ("base", base.map(metres)),
            ("shoreline", shoreline.map(metres)),
        ];
        notes.into_iter().filter_map(|(name, note)| Some((name, note?))).collect()
    }
}

impl Coordinates {
    fn name(self) -> &'static str {
        match self {
            Coordinates::File => "file",
            Coordinates::Local => "local",
            Coordinates::LonLat => "lonlat",
        }
    }
}

impl Ground {
    /// From column and row to X and Y; for longitude and latitude to what they are computed from.
    fn place(&self, coordinates: Coordinates) -> DAffine2 {
        match coordinates {
            Coordinates::Local => {
                DAffine2::from_scale_angle_translation(self.land.raster().spacing(), 0.0, self.land.origin())
            }
            Coordinates::File | Coordinates::LonLat => self.frame.crs_from_lattice(&self.land),
        }
    }

    /// What X and Y are, in words.
    fn explained(&self, coordinates: Coordinates) -> String {
        let system = self.frame.system();
        match coordinates {
            Coordinates::File => format!("{}, X and Y in {}", system.name(), system.unit()),
            Coordinates::LonLat => "longitude and latitude in degrees".into(),
            Coordinates::Local if self.built_in => "metres east and north".into(),
            Coordinates::Local => {
                let middle = self.frame.crs(DVec2::ZERO);
                let shown = |x| self.frame.shown(x);
                format!("metres east and north of {},{} in {}", shown(middle.x), shown(middle.y), system.name())
            }
        }
    }
}

/// A height that need not be given. A parser takes the file that follows the option for it.
fn optional_height(
    given: &mut Option<String>,
    files: &mut Vec<PathBuf>,
    option: &str,
) -> Result<Option<Option<f64>>, Failure> {
    let Some(text) = given.take() else { return Ok(None) };
    if text.is_empty() {
        return Ok(Some(None));
    }
    match input::number(&text) {
        Ok(height) => Ok(Some(Some(height))),
        Err(_) if Path::new(&text).is_file() => {
            files.insert(0, text.into());
            Ok(Some(None))
        }
        Err(_) => {
            Err(Failure::Usage(format!("{option}: expected a height in metres or nothing, got \"{text}\"; correct it")))
        }
    }
}

/// A bound (m) that suits some relief, known in steps: a two-hundredth, in round numbers, but no less than half a step.
fn suiting(relief: f64, step: f64) -> f64 {
    let error = (relief / 200.0).max(0.5 * step).max(1e-3);
    let power = 10f64.powf(error.log10().floor());
    let digit = [5.0, 2.0, 1.0].into_iter().find(|digit| digit * power <= error * 1.000_001).unwrap_or(1.0);
    // By way of text, which leaves no dust behind the digits.
    format!("{:.3e}", digit * power).parse().unwrap_or(error)
}

/// The answer in words.
fn told(answer: &Answer, ground: &Ground) -> String {
    let mut more = String::new();
    if let Some(base) = answer.base {
        more += &format!(", base at {} m", tidy(base, 3));
    }
    if let Some(edges) = answer.shoreline_edges {
        more += &format!(", shoreline of {edges} edges");
    }
    if answer.origin != [0.0; 3] {
        let [x, y, _] = answer.origin;
        more += &format!(", coordinates count from {},{}", ground.frame.shown(x), ground.frame.shown(y));
    }
    let share = 100.0 * answer.triangles as f64 / (2 * answer.samples) as f64;
    format!(
        "{}: {} triangles ({} % of all), {} vertices, nowhere farther than {} m from the data ({} m asked), {}{more}, {}\n",
        answer.file,
        answer.triangles,
        tidy(share, 1),
        answer.vertices,
        tidy(answer.max_error, 4),
        tidy(answer.max_error_asked, 6),
        seconds(answer.seconds),
        answer.datum
    )
}
