//! `littoral mesh`: triangles for printers, viewers and other programs.

use crate::ground::{Frame, Opened, Reading, System};
use crate::input;
use crate::plot::ending;
use crate::render::check_output;
use crate::talk::{Failure, Talk, progress, seconds, tidy};
use glam::{DAffine2, DVec2, DVec4};
use littoral::field::{HeightRange, Raster, Window, coast};
use littoral::mesh::measure::measure;
use littoral::mesh::tiled::{self, Tiling};
use littoral::mesh::{Form, MeshError, ModelError, Pieces, Triangulation, rtin, tin};
use littoral_data::write::{self, MeshFormat};
use littoral_data::{Crs, name_of_all};
use serde::Serialize;
use std::cell::RefCell;
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
    /// Mesh in tiles of so many samples a side, a power of two, which takes less memory: their meshes join without a gap
    /// [default: 4096 for more than 64 million samples, else no tiles]
    #[arg(long, value_name = "SAMPLES", value_parser = tile_side, help_heading = "Data")]
    tile: Option<usize>,
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

fn tile_side(text: &str) -> Result<usize, String> {
    let wrong = || format!("expected a power of two from 2 to 16384, got \"{}\"", text.trim());
    let side = text.trim().parse::<usize>().map_err(|_| wrong())?;
    if side.is_power_of_two() && (2..=16_384).contains(&side) { Ok(side) } else { Err(wrong()) }
}

/// More samples than this are meshed in tiles.
const IN_ONE_PIECE: usize = 64 << 20;
/// Samples along the side of these.
const TILE: usize = 4096;

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
    frame: Frame,
    /// What heights are counted from, in words.
    datum: String,
    /// The distance between heights that the file can tell apart (m).
    step: f64,
    /// Distance between samples (m).
    spacing: DVec2,
    /// Columns and rows.
    size: [usize; 2],
    /// Local metres, and the file's coordinates, of column and row.
    local_from_lattice: DAffine2,
    crs_from_lattice: DAffine2,
    samples: Samples,
}

/// Where samples come from.
enum Samples {
    /// The built-in coast.
    Coast(Raster),
    /// A window of a file.
    File(Box<Opened>, Window),
}

/// What was made of the samples.
struct Meshed {
    pieces: Pieces,
    max_error: f64,
    void: usize,
}

/// Why tiles were not meshed.
enum Stopped {
    Mesh(MeshError),
    Told(Failure),
}

impl From<MeshError> for Stopped {
    fn from(error: MeshError) -> Stopped {
        Stopped::Mesh(error)
    }
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

        let mut ground = self.ground(talk)?;
        let samples = ground.size[0] * ground.size[1];
        let tile = self.tile.or((samples > IN_ONE_PIECE).then_some(TILE));
        // In one piece all is known at once; of tiles, only if what was not asked for has to be chosen.
        let whole = if tile.is_none() { Some(ground.read(None, talk)?) } else { None };
        let range = match &whole {
            Some(raster) => Some(raster.range()),
            None if self.max_error.is_none() => Some(ground.survey(talk)?),
            None => None,
        };
        let relief = range.map_or(0.0, |range| f64::from(range.high) - f64::from(range.low));
        let asked = self.max_error.unwrap_or_else(|| suiting(relief, ground.step));
        if let (Some(Some(base)), Some(range), true) = (base, range, whole.is_some())
            && base >= f64::from(range.low)
        {
            return Err(ground.failure(too_high(base, f64::from(range.low))));
        }
        let meshed = match (&whole, tile) {
            (Some(raster), _) => self.in_one_piece(&ground, raster, asked, shoreline)?,
            (None, side) => self.in_tiles(&mut ground, side.unwrap_or(TILE), asked, shoreline, talk)?,
        };
        drop(whole);
        let base = base.map(|height| height.unwrap_or_else(|| self.below(&ground, meshed.pieces.lowest())));
        let coordinates = self.coordinates(&ground, talk);
        let place = ground.place(coordinates);
        let to = |at: DVec2| place.transform_point2(at);
        let turn = match coordinates {
            Coordinates::LonLat => ground.frame.north(),
            // Of the axis alone: degrees and feet stretch, which is no turn.
            _ => place.matrix2.x_axis.to_angle(),
        };
        let form = Form { shoreline, base, exaggeration: self.exaggeration, place: &to, turn };
        let made = meshed.pieces.finish(&form);
        let mut model = made.map_err(|error| match error {
            ModelError::Base { base, lowest } => ground.failure(too_high(base, lowest)),
            error => ground.failure(error),
        })?;
        if coordinates == Coordinates::LonLat {
            ground.frame.to_lonlat(&mut model.positions).map_err(|problem| ground.failure(problem))?;
        }
        if let (Some(level), true) = (shoreline, model.shoreline.is_empty()) {
            talk.warn(format!("{}: the ground nowhere crosses {level} m, so there is no line to keep", ground.name));
        }
        let notes = self.notes(&ground, coordinates, meshed.max_error, base, shoreline);
        let origin = write::mesh(&self.out, format, &model, &notes)?;

        let answer = Answer {
            file: self.out.display().to_string(),
            format: format!("{format:?}").to_lowercase(),
            method: format!("{:?}", self.method).to_lowercase(),
            triangles: model.triangles.len(),
            vertices: model.positions.len(),
            max_error: meshed.max_error,
            max_error_asked: asked,
            seconds: started.elapsed().as_secs_f64(),
            samples,
            void: meshed.void,
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

    /// The ground of the files, or of none the built-in coast.
    fn ground(&self, talk: &mut Talk) -> Result<Ground, Failure> {
        if self.files.is_empty() {
            if self.window.is_some() || self.lonlat {
                let problem = "expected a file for --window and --lonlat, got none; name one";
                return Err(Failure::Usage(problem.into()));
            }
            let land = coast::coast();
            let raster = land.raster().clone();
            let place = DAffine2::from_scale_angle_translation(raster.spacing(), 0.0, land.origin());
            return Ok(Ground {
                name: "the built-in coast".into(),
                frame: Frame::metres(),
                datum: "heights above its sea level".into(),
                step: 0.0,
                spacing: raster.spacing(),
                size: [raster.columns(), raster.rows()],
                local_from_lattice: place,
                crs_from_lattice: place,
                samples: Samples::Coast(raster),
            });
        }
        let opened = Opened::open_all(&self.files, self.reading, talk)?;
        let (columns, rows) = (opened.info().columns, opened.info().rows);
        let window = match self.window {
            None => Window { column: 0, row: 0, columns, rows },
            Some(corners) => {
                let system = System::of(self.lonlat);
                let corners = [DVec2::new(corners.x, corners.y), DVec2::new(corners.z, corners.w)];
                let [a, b] = corners.map(|at| opened.local(system, at));
                let Some(window) = opened.samples_between(a?, b?) else {
                    let outside = opened.outside(system, 0.5 * (corners[0] + corners[1]));
                    return Err(opened.failure(&format!("--window holds less than 2 x 2 samples: {outside}")));
                };
                window
            }
        };
        if window.columns < 2 || window.rows < 2 {
            return Err(opened.failure(&format!("expected at least 2 x 2 samples, got {columns} x {rows}")));
        }
        let (frame, spacing) = (opened.frame.clone(), opened.frame.spacing());
        Ok(Ground {
            name: name_of_all(&self.files).display().to_string(),
            datum: opened.datum(),
            step: opened.info().step,
            spacing,
            size: [window.columns, window.rows],
            local_from_lattice: DAffine2::from_scale_angle_translation(spacing, 0.0, frame.corner(window)),
            crs_from_lattice: frame.crs_from_lattice(window),
            frame,
            samples: Samples::File(Box::new(opened), window),
        })
    }

    fn in_one_piece(
        &self,
        ground: &Ground,
        raster: &Raster,
        asked: f64,
        shoreline: Option<f64>,
    ) -> Result<Meshed, Failure> {
        let bar = progress(1000, "meshing");
        let single = not_above(asked);
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
        let mesh = made.map_err(|error| ground.failure(error))?;
        let mut pieces = Pieces::new(shoreline);
        let max_error = kept(raster, &mesh, asked).map_err(|problem| ground.failure(problem))?;
        pieces.add(&mesh, ground.whole(), raster, [0, 0]).map_err(|error| ground.failure(error))?;
        Ok(Meshed { pieces, max_error, void: raster.voids().count() })
    }

    fn in_tiles(
        &self,
        ground: &mut Ground,
        side: usize,
        asked: f64,
        shoreline: Option<f64>,
        talk: &mut Talk,
    ) -> Result<Meshed, Failure> {
        let (tiling, whole, name) = (Tiling { size: ground.size, side }, ground.whole(), ground.name.clone());
        let failure = |problem: &dyn std::fmt::Display| Failure::Work(format!("{name}: {problem}"));
        let bar = progress(tiling.tiles().iter().product::<usize>() as u64, "meshing");
        let method = match self.method {
            Method::Rtin => tiled::Method::Rtin,
            Method::Tin => tiled::Method::Tin,
        };
        let mut meshed = Meshed { pieces: Pieces::new(shoreline), max_error: 0.0, void: 0 };
        // What was read last: most tiles are written with the samples that they were made from.
        let source = RefCell::new((ground, talk, None::<(Window, Raster)>));
        let read = |window: Window| -> Result<Raster, Failure> {
            let (ground, talk, last) = &mut *source.borrow_mut();
            let raster = ground.read(Some(window), talk)?;
            *last = Some((window, raster.clone()));
            Ok(raster)
        };
        let done = tiling.mesh(
            method,
            not_above(asked),
            &mut |window| read(window).map_err(Stopped::Told),
            &mut |tile, raster, mesh| {
                let told = |problem: &dyn std::fmt::Display| Stopped::Told(failure(problem));
                let error = kept(raster, mesh, asked).map_err(|problem| told(&problem))?;
                meshed.max_error = meshed.max_error.max(error);
                meshed.void += own_voids(tile, raster);
                let around = with_margin(tile, whole);
                let last = source.borrow_mut().2.take().filter(|(window, _)| *window == around);
                let samples = match last {
                    Some((_, samples)) => samples,
                    None => read(around).map_err(Stopped::Told)?,
                };
                bar.inc(1);
                meshed.pieces.add(mesh, tile, &samples, [around.column, around.row]).map_err(|error| told(&error))
            },
        );
        bar.finish_and_clear();
        done.map_err(|stopped| match stopped {
            Stopped::Mesh(error) => failure(&error),
            Stopped::Told(failure) => failure,
        })?;
        Ok(meshed)
    }

    /// The height of a base that nobody chose: below the lowest ground by a fiftieth of the longer side as it will look.
    fn below(&self, ground: &Ground, lowest: f64) -> f64 {
        let [columns, rows] = ground.size;
        let extent = DVec2::new(columns as f64 - 1.0, rows as f64 - 1.0) * ground.spacing;
        let thickness = 0.02 * extent.max_element() / self.exaggeration;
        let step = 10f64.powf(thickness.log10().floor());
        ((lowest - thickness) / step).floor() * step
    }

    /// What X and Y are to be.
    fn coordinates(&self, ground: &Ground, talk: &mut Talk) -> Coordinates {
        let system = ground.frame.system();
        if self.lonlat {
            return Coordinates::LonLat;
        }
        if self.local
            || matches!(ground.samples, Samples::Coast(_))
            || !ground.frame.is_placed()
            || matches!(system, Crs::Geographic { .. })
        {
            return Coordinates::Local;
        }
        let scale = ground.crs_from_lattice.matrix2.x_axis.length() / ground.spacing.x;
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
    /// All of it.
    fn whole(&self) -> Window {
        let [columns, rows] = self.size;
        Window { column: 0, row: 0, columns, rows }
    }

    /// The samples of a part, or of all.
    fn read(&mut self, part: Option<Window>, talk: &mut Talk) -> Result<Raster, Failure> {
        let part = part.unwrap_or(self.whole());
        match &mut self.samples {
            Samples::File(opened, window) => opened.samples(self.frame.within(*window, part), talk),
            Samples::Coast(raster) => {
                let sample = |column, row| raster.sample(column, row).unwrap_or(f32::NAN);
                let row = |row| (part.column..part.column + part.columns).map(move |column| sample(column, row));
                let heights = (part.row..part.row + part.rows).flat_map(row).collect();
                let raster = Raster::new(part.columns, part.rows, self.spacing, heights);
                raster.map_err(|error| Failure::Work(error.to_string()))
            }
        }
    }

    /// The lowest and the highest of all heights of the file.
    fn survey(&mut self, talk: &mut Talk) -> Result<HeightRange, Failure> {
        match &mut self.samples {
            Samples::Coast(raster) => Ok(raster.range()),
            Samples::File(opened, _) => {
                let survey = opened.survey(talk)?;
                let none = HeightRange::EMPTY;
                Ok(HeightRange { low: survey.min.unwrap_or(none.low), high: survey.max.unwrap_or(none.high) })
            }
        }
    }

    /// A failure with its name.
    fn failure(&self, problem: impl std::fmt::Display) -> Failure {
        Failure::Work(format!("{}: {problem}", self.name))
    }

    /// From column and row to X and Y; for longitude and latitude to what they are computed from.
    fn place(&self, coordinates: Coordinates) -> DAffine2 {
        match coordinates {
            Coordinates::Local => self.local_from_lattice,
            Coordinates::File | Coordinates::LonLat => self.crs_from_lattice,
        }
    }

    /// What X and Y are, in words.
    fn explained(&self, coordinates: Coordinates) -> String {
        let system = self.frame.system();
        match coordinates {
            Coordinates::File => format!("{}, X and Y in {}", system.name(), system.unit()),
            Coordinates::LonLat => "longitude and latitude in degrees".into(),
            Coordinates::Local if matches!(self.samples, Samples::Coast(_)) => "metres east and north".into(),
            Coordinates::Local => {
                let middle = self.frame.crs(DVec2::ZERO);
                let shown = |x| self.frame.shown(x);
                format!("metres east and north of {},{} in {}", shown(middle.x), shown(middle.y), system.name())
            }
        }
    }
}

/// How far a mesh is from its samples (m), measured at each; an error if this is farther than was asked for.
fn kept(raster: &Raster, mesh: &Triangulation, asked: f64) -> Result<f64, String> {
    let measured = measure(raster, mesh);
    match measured.max_error <= asked && measured.missed + measured.void_covered == 0 {
        true => Ok(measured.max_error),
        false => Err(format!("expected a mesh within {asked} m, got {measured:?}; please report it with the file")),
    }
}

/// A bound in single precision that is not above it.
fn not_above(asked: f64) -> f32 {
    let single = asked as f32;
    if f64::from(single) > asked { single.next_down() } else { single }
}

fn too_high(base: f64, lowest: f64) -> String {
    format!("expected --base below the lowest ground, {} m, got {base} m; choose a lower one", tidy(lowest, 3))
}

/// A window with a sample more on each side, as far as there is one.
fn with_margin(tile: Window, whole: Window) -> Window {
    let (column, row) = (tile.column.saturating_sub(1), tile.row.saturating_sub(1));
    Window {
        column,
        row,
        columns: (tile.column + tile.columns + 1).min(whole.columns) - column,
        rows: (tile.row + tile.rows + 1).min(whole.rows) - row,
    }
}

/// Voids of a tile but for those in its first column and row, which are the neighbours'.
fn own_voids(tile: Window, raster: &Raster) -> usize {
    let from = |first: usize| usize::from(first > 0);
    let in_row = |row: usize| {
        let own = (from(tile.column)..raster.columns()).map(|column| row * raster.columns() + column);
        own.filter(|&index| raster.voids().is_void(index)).count()
    };
    if raster.voids().any() { (from(tile.row)..raster.rows()).map(in_row).sum() } else { 0 }
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
