//! A height file as ground to stand on, in the file's coordinates and in local metres.

use crate::talk::{Failure, Talk, progress, tidy};
use glam::{DAffine2, DVec2, DVec3};
use littoral::field::{Land, Raster, Window};
use littoral::picture::Drape;
use littoral_data::{Code, Crs, Dem, Encoding, Error, Georeference, Info, LoadOptions, Source, Survey, VerticalDatum};
use std::path::{Path, PathBuf};

/// How files are read, where they do not say it themselves.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Reading {
    /// What the pixels of a PNG mean [default: told from the heights that they give]
    #[arg(long, value_enum, value_name = "ENCODING")]
    encoding: Option<EncodingName>,
}

/// What the pixels of a PNG mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum EncodingName {
    /// 256 R + G + B/256 - 32768 metres
    Terrarium,
    /// -10000 + 0.1 (65536 R + 256 G + B) metres, Terrain-RGB
    Mapbox,
    /// Greys are metres
    Grey,
}

impl EncodingName {
    fn encoding(self) -> Encoding {
        match self {
            EncodingName::Terrarium => Encoding::Code(Code::Terrarium),
            EncodingName::Mapbox => Encoding::Code(Code::TerrainRgb),
            EncodingName::Grey => Encoding::Grey,
        }
    }
}

/// An opened height file, or several as one.
pub struct Opened {
    /// Its name, or what stands for all of theirs.
    pub file: PathBuf,
    /// How its coordinates and local metres belong together.
    pub frame: Frame,
    several: bool,
    source: Box<dyn Source>,
}

/// How a file's coordinates and local metres belong together.
#[derive(Clone, Debug)]
pub struct Frame {
    georeference: Georeference,
    local_from_sample: DAffine2,
    crs_from_local: DAffine2,
    local_from_crs: DAffine2,
}

/// Coordinates as typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum System {
    /// Those of the file.
    File,
    /// Longitude and latitude in degrees.
    LonLat,
}

impl System {
    /// By the flag `--lonlat`.
    pub fn of(lonlat: bool) -> System {
        if lonlat { System::LonLat } else { System::File }
    }
}

impl Opened {
    /// Opens a file and passes on what its reader noticed.
    pub fn open(file: &Path, reading: Reading, talk: &mut Talk) -> Result<Opened, Failure> {
        Opened::open_all(&[file.to_owned()], reading, talk)
    }

    /// Opens files as one, and passes on what their readers noticed.
    pub fn open_all(files: &[PathBuf], reading: Reading, talk: &mut Talk) -> Result<Opened, Failure> {
        let source = littoral_data::open_all(files, reading.encoding.map(EncodingName::encoding))?;
        let frame = Frame::of(&source.info().georeference);
        let opened = Opened { file: littoral_data::name_of_all(files), frame, several: files.len() > 1, source };
        opened.pass_on(&opened.info().warnings.clone(), talk);
        opened.pass_on(&opened.info().georeference.warnings(), talk);
        Ok(opened)
    }

    /// Warns of what came up since.
    fn pass_on(&self, warnings: &[String], talk: &mut Talk) {
        for warning in warnings {
            // Those of several files name theirs.
            talk.warn(if self.several { warning.clone() } else { format!("{}: {warning}", self.file.display()) });
        }
    }

    /// What the file is.
    pub fn info(&self) -> &Info {
        self.source.info()
    }

    /// The resolutions held, the full one first.
    pub fn levels(&self) -> &[littoral_data::Level] {
        self.source.levels()
    }

    /// What reading every sample tells.
    pub fn survey(&mut self, talk: &mut Talk) -> Result<Survey, Failure> {
        let bar = progress(1000, "reading");
        let survey = littoral_data::survey(&mut *self.source, &|done| bar.set_position((done * 1000.0) as u64))?;
        bar.finish_and_clear();
        self.pass_on(&self.info().warnings.clone(), talk);
        Ok(survey)
    }

    /// The whole file as land, at full resolution.
    pub fn whole(&mut self, talk: &mut Talk) -> Result<Land, Failure> {
        let (columns, rows) = (self.info().columns, self.info().rows);
        self.part(Window { column: 0, row: 0, columns, rows }, talk)
    }

    /// A window of the file as land, at full resolution, in the local metres of the whole file. It may be all void.
    pub fn part(&mut self, window: Window, talk: &mut Talk) -> Result<Land, Failure> {
        let raster = self.samples(window, talk)?;
        Ok(Land::at(raster, self.frame.corner(window)))
    }

    /// The samples of a window of the file, at full resolution. They may be all void.
    pub fn samples(&mut self, window: Window, talk: &mut Talk) -> Result<Raster, Failure> {
        let Window { columns, rows, .. } = window;
        let mut heights = self.source.read(0, window)?;
        self.pass_on(&self.info().warnings.clone(), talk);
        self.frame.georeference.turn(&mut heights, columns);
        Raster::new(columns, rows, self.frame.spacing(), heights).map_err(|e| self.failure(&e.to_string()))
    }

    /// The file as land at a resolution of at most so many samples, and the frame of that.
    pub fn fitting(&mut self, most_samples: usize, talk: &mut Talk) -> Result<(Land, Frame), Failure> {
        let bar = progress(1000, "reading");
        let told = |done: f32| bar.set_position((done * 1000.0) as u64);
        let dem = littoral_data::load_from(&mut *self.source, &self.file, LoadOptions { most_samples }, &told)?;
        bar.finish_and_clear();
        self.pass_on(&dem.info.warnings, talk);
        let Dem { raster, georeference, .. } = dem;
        Ok((Land::new(raster), Frame::of(&georeference)))
    }

    /// The smallest window whose patches hold all the local positions, with a sample to spare; at least 2 × 2.
    pub fn window_of(&self, positions: impl IntoIterator<Item = DVec2>) -> Window {
        let samples = self.frame.local_from_sample.inverse();
        let last = self.frame.last();
        let (mut low, mut high) = (last, DVec2::ZERO);
        for position in positions {
            let sample = samples.transform_point2(position);
            (low, high) = (low.min(sample), high.max(sample));
        }
        let low = (low.floor() - 1.0).clamp(DVec2::ZERO, last - 1.0);
        let high = (high.ceil() + 1.0).max(low + 1.0).min(last);
        let size = high - low + 1.0;
        Window { column: low.x as usize, row: low.y as usize, columns: size.x as usize, rows: size.y as usize }
    }

    /// The window of all samples in the rectangle between two local positions; `None` if there are not 2 × 2.
    pub fn samples_between(&self, a: DVec2, b: DVec2) -> Option<Window> {
        /// As much of a cell as typed decimals may leave a corner off its sample.
        const SLACK: f64 = 1e-6;
        let samples = self.frame.local_from_sample.inverse();
        let (a, b) = (samples.transform_point2(a), samples.transform_point2(b));
        let low = (a.min(b) - SLACK).ceil().max(DVec2::ZERO);
        let high = (a.max(b) + SLACK).floor().min(self.frame.last());
        let size = high - low + 1.0;
        (size.min_element() >= 2.0).then_some(Window {
            column: low.x as usize,
            row: low.y as usize,
            columns: size.x as usize,
            rows: size.y as usize,
        })
    }

    /// A failure with the file's name.
    pub fn failure(&self, problem: &str) -> Failure {
        Failure::Work(format!("{}: {problem}", self.file.display()))
    }

    /// Local metres of typed coordinates.
    pub fn local(&self, system: System, at: DVec2) -> Result<DVec2, Failure> {
        self.frame.local(system, at).map_err(|e| self.failure(&e))
    }

    /// Says that a position lies outside, in a way that helps to find the mistake.
    pub fn outside(&self, system: System, at: DVec2) -> String {
        let (low, high) = self.frame.bounds();
        let degrees = at.x.abs() <= 360.0 && at.y.abs() <= 90.0;
        let within = |p: DVec2| p.cmpge(low).all() && p.cmple(high).all();
        let advice = match (&self.info().georeference.crs, system) {
            (_, System::File) if within(DVec2::new(at.y, at.x)) => "swap X and Y",
            (Crs::Projected { .. }, System::File) if degrees => "if these are degrees, add --lonlat",
            (Crs::Projected { .. }, System::LonLat) if !degrees => "leave out --lonlat",
            _ => "choose one within",
        };
        format!(
            "expected a position within the data, X {} to {} and Y {} to {}, got {},{}; {advice}",
            self.frame.shown(low.x),
            self.frame.shown(high.x),
            self.frame.shown(low.y),
            self.frame.shown(high.y),
            at.x,
            at.y
        )
    }

    /// What the heights are counted from, in words.
    pub fn datum(&self) -> String {
        match &self.info().vertical_datum {
            VerticalDatum::Unknown => "heights taken as above sea level (the file does not say)".to_owned(),
            VerticalDatum::Named(name) => format!("heights above {name}"),
        }
    }
}

impl Frame {
    /// The frame of a raster.
    pub fn of(georeference: &Georeference) -> Frame {
        Frame {
            local_from_sample: georeference.local_from_sample(),
            crs_from_local: georeference.crs_from_local(),
            local_from_crs: georeference.local_from_crs(),
            georeference: georeference.clone(),
        }
    }

    /// The frame of land that is given in metres alone.
    pub fn metres() -> Frame {
        Frame {
            georeference: Georeference::none(2, 2),
            local_from_sample: DAffine2::IDENTITY,
            crs_from_local: DAffine2::IDENTITY,
            local_from_crs: DAffine2::IDENTITY,
        }
    }

    fn last(&self) -> DVec2 {
        let [columns, rows] = self.georeference.size;
        DVec2::new(columns as f64 - 1.0, rows as f64 - 1.0)
    }

    /// The coordinate system.
    pub fn system(&self) -> Crs {
        self.georeference.crs.clone()
    }

    /// Distance between samples (m).
    pub fn spacing(&self) -> DVec2 {
        self.georeference.spacing()
    }

    /// Local metres of coordinates.
    pub fn local(&self, system: System, at: DVec2) -> Result<DVec2, String> {
        let crs = match system {
            System::File => self.georeference.near(at),
            System::LonLat => self.georeference.crs_from_lonlat(at)?,
        };
        Ok(self.local_from_crs.transform_point2(crs))
    }

    /// The file's coordinates of local metres.
    pub fn crs(&self, local: DVec2) -> DVec2 {
        self.crs_from_local.transform_point2(local)
    }

    /// The local position (m) of the south-western sample of a window of the file.
    pub fn corner(&self, window: Window) -> DVec2 {
        self.local_from_sample.transform_point2(self.first_sample(window))
    }

    /// Column and row in the file of a window's south-western sample.
    fn first_sample(&self, window: Window) -> DVec2 {
        let [columns, rows] = self.georeference.flips();
        let column = if columns { window.column + window.columns - 1 } else { window.column };
        let row = if rows { window.row + window.rows - 1 } else { window.row };
        DVec2::new(column as f64, row as f64)
    }

    /// The file's coordinates of column and row of a window's samples, counted from its south-western one.
    pub fn crs_from_lattice(&self, window: Window) -> DAffine2 {
        let [columns, rows] = self.georeference.flips().map(|against| if against { -1.0 } else { 1.0 });
        let first = self.first_sample(window);
        let sample_from_lattice = DAffine2::from_scale_angle_translation(DVec2::new(columns, rows), 0.0, first);
        self.georeference.crs_from_sample() * sample_from_lattice
    }

    /// The window of the file that holds a part of another one; the part's columns and rows count from that one's
    /// south-western sample.
    pub fn within(&self, outer: Window, part: Window) -> Window {
        let [columns, rows] = self.georeference.flips();
        let along = |against: bool, first: usize, size: usize, part: usize, part_size: usize| match against {
            true => first + size - part - part_size,
            false => first + part,
        };
        Window {
            column: along(columns, outer.column, outer.columns, part.column, part.columns),
            row: along(rows, outer.row, outer.rows, part.row, part.rows),
            ..part
        }
    }

    /// Whether something says where the file lies: if not, its coordinates count pixels, southward.
    pub fn is_placed(&self) -> bool {
        !self.georeference.y_south
    }

    /// Replaces the file's coordinates X and Y by longitude and latitude (degrees).
    pub fn to_lonlat(&self, positions: &mut [DVec3]) -> Result<(), String> {
        let mut places: Vec<DVec2> = positions.iter().map(|at| at.truncate()).collect();
        self.georeference.lonlats_from_crs(&mut places)?;
        positions.iter_mut().zip(places).for_each(|(at, place)| *at = place.extend(at.z));
        Ok(())
    }

    /// Whether a local position lies within the samples, but for rounding.
    pub fn holds(&self, local: DVec2) -> bool {
        let sample = self.local_from_sample.inverse().transform_point2(local);
        sample.cmpge(DVec2::splat(-1e-6)).all() && sample.cmple(self.last() + 1e-6).all()
    }

    /// The lowest and highest coordinates of samples.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        let (last, crs) = (self.last(), self.georeference.crs_from_sample());
        let corners = [DVec2::ZERO, DVec2::new(last.x, 0.0), DVec2::new(0.0, last.y), last];
        let corners = corners.map(|corner| crs.transform_point2(corner));
        (corners.into_iter().fold(corners[0], DVec2::min), corners.into_iter().fold(corners[0], DVec2::max))
    }

    /// A coordinate as it is worth showing.
    pub fn shown(&self, coordinate: f64) -> String {
        tidy(coordinate, self.decimals())
    }

    /// Decimals that make a coordinate good to a centimetre or so.
    pub fn decimals(&self) -> usize {
        if matches!(self.georeference.crs, Crs::Geographic { .. }) { 7 } else { 2 }
    }

    /// Longitude and latitude of the middle (degrees), where they can be known.
    pub fn place(&self) -> Option<DVec2> {
        self.georeference.lonlat_from_crs(self.georeference.middle()).ok()
    }

    /// A picture as it lies over land of this frame, and what was noticed.
    pub fn drape(&self, file: &Path, land: &Land) -> Result<(Drape, Vec<String>), Error> {
        littoral_data::open_drape(file, land, &self.georeference, self.crs_from_local)
    }

    /// The angle from the land's y axis clockwise to true north (rad).
    pub fn north(&self) -> f64 {
        -self.georeference.true_north()
    }
}

/// Exact height (m) of the surface below a local position (m); `None` where void or outside. A position that is a
/// sample's but for rounding (a millionth of a cell, as typed decimals leave it) is that sample's: on the data's border it
/// does not fall outside, and next to a void it does not ask the void.
pub fn height_at(land: &Land, local: DVec2) -> Option<f32> {
    let raster = land.raster();
    let last = DVec2::new((raster.columns() - 1) as f64, (raster.rows() - 1) as f64);
    let lattice = (local - land.origin()) / raster.spacing();
    let snap = |at: f64| if (at - at.round()).abs() < 1e-6 { at.round() } else { at };
    let lattice = DVec2::new(snap(lattice.x), snap(lattice.y));
    if !(lattice.cmpge(DVec2::ZERO).all() && lattice.cmple(last).all()) {
        return None;
    }
    let base = lattice.floor();
    let (f, column, row) = (lattice - base, base.x as usize, base.y as usize);
    let corners =
        [(0, 0, (1.0 - f.x) * (1.0 - f.y)), (1, 0, f.x * (1.0 - f.y)), (0, 1, (1.0 - f.x) * f.y), (1, 1, f.x * f.y)];
    let mut height = 0.0;
    for (i, j, weight) in corners {
        if weight > 0.0 {
            height += weight * f64::from(raster.sample(column + i, row + j)?);
        }
    }
    Some(height as f32)
}
