//! A height file as ground to stand on, in the file's coordinates and in local metres.

use crate::talk::{Failure, Talk};
use glam::{DAffine2, DVec2};
use littoral::field::{Land, Raster, Window};
use littoral_data::{Crs, Info, Source, VerticalDatum};
use std::path::{Path, PathBuf};

/// An opened height file.
pub struct Opened {
    /// Its name.
    pub file: PathBuf,
    /// How its coordinates and local metres belong together.
    pub frame: Frame,
    source: Box<dyn Source>,
}

/// How a file's samples, its coordinates and local metres belong together.
#[derive(Clone, Debug)]
pub struct Frame {
    local_from_sample: DAffine2,
    crs_from_sample: DAffine2,
    crs: Crs,
    last: DVec2,
    /// Whether the file's rows run against the land's.
    north_first: bool,
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
    pub fn open(file: &Path, talk: &mut Talk) -> Result<Opened, Failure> {
        let source = littoral_data::open(file)?;
        let frame = Frame::of(source.info());
        for warning in &source.info().warnings {
            talk.warn(format!("{}: {warning}", file.display()));
        }
        Ok(Opened { file: file.to_owned(), frame, source })
    }

    /// What the file is.
    pub fn info(&self) -> &Info {
        self.source.info()
    }

    /// The resolutions held, the full one first.
    pub fn levels(&self) -> &[littoral_data::Level] {
        self.source.levels()
    }

    /// Rows of the blocks in which the file is stored: windows along their borders read cheapest.
    pub fn block_rows(&self) -> usize {
        self.source.block(0)[1].max(1)
    }

    /// Heights of a window at full resolution, in the file's order.
    pub fn read(&mut self, window: Window) -> Result<Vec<f32>, Failure> {
        Ok(self.source.read(0, window)?)
    }

    /// The whole file as land, at full resolution.
    pub fn whole(&mut self) -> Result<Land, Failure> {
        let (columns, rows) = (self.info().columns, self.info().rows);
        self.part(Window { column: 0, row: 0, columns, rows })
    }

    /// A window of the file as land, at full resolution, in the local metres of the whole file.
    pub fn part(&mut self, window: Window) -> Result<Land, Failure> {
        let mut heights = self.read(window)?;
        if self.frame.north_first {
            for row in 0..window.rows / 2 {
                let (upper, lower) = heights.split_at_mut((window.rows - 1 - row) * window.columns);
                upper[row * window.columns..(row + 1) * window.columns].swap_with_slice(&mut lower[..window.columns]);
            }
        }
        let spacing = self.frame.spacing();
        let raster =
            Raster::new(window.columns, window.rows, spacing, heights).map_err(|e| self.failure(&e.to_string()))?;
        let first_row = if self.frame.north_first { window.row + window.rows - 1 } else { window.row };
        let corner = DVec2::new(window.column as f64, first_row as f64);
        Ok(Land::at(raster, self.frame.local_from_sample.transform_point2(corner)))
    }

    /// The smallest window whose patches hold all the local positions, with a sample to spare; at least 2 × 2.
    pub fn window_of(&self, positions: impl IntoIterator<Item = DVec2>) -> Window {
        let samples = self.frame.local_from_sample.inverse();
        let (mut low, mut high) = (self.frame.last, DVec2::ZERO);
        for position in positions {
            let sample = samples.transform_point2(position);
            (low, high) = (low.min(sample), high.max(sample));
        }
        let low = (low.floor() - 1.0).clamp(DVec2::ZERO, self.frame.last - 1.0);
        let high = (high.ceil() + 1.0).clamp(low + 1.0, self.frame.last);
        let size = high - low + 1.0;
        Window { column: low.x as usize, row: low.y as usize, columns: size.x as usize, rows: size.y as usize }
    }

    /// A failure with the file's name.
    pub fn failure(&self, problem: &str) -> Failure {
        Failure::Work(format!("{}: {problem}", self.file.display()))
    }

    /// Says that positions lie outside, in a way that helps to find the mistake.
    pub fn outside(&self, system: System, at: DVec2) -> String {
        let (low, high) = self.frame.bounds();
        let degrees = at.x.abs() <= 360.0 && at.y.abs() <= 90.0;
        let advice = match (&self.frame.crs, system) {
            (Crs::Projected { .. }, System::File) if degrees => "if these are degrees, add --lonlat",
            (_, System::File) if low.y <= at.x && at.x <= high.y && low.x <= at.y && at.y <= high.x => "swap X and Y",
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
        datum(&self.info().vertical_datum)
    }
}

/// What heights are counted from, in words.
pub fn datum(datum: &VerticalDatum) -> String {
    match datum {
        VerticalDatum::Unknown => "heights taken as above sea level (the file does not say)".to_owned(),
        VerticalDatum::Named(name) => format!("heights above {name}"),
    }
}

impl Frame {
    /// The frame of a file.
    pub fn of(info: &Info) -> Frame {
        let georeference = &info.georeference;
        let crs_from_sample = georeference.crs_from_sample();
        let last = DVec2::new((info.columns - 1) as f64, (info.rows - 1) as f64);
        let (x, y) = (crs_from_sample.matrix2.x_axis, crs_from_sample.matrix2.y_axis);
        let scale = match &georeference.crs {
            Crs::Unknown => DVec2::ONE,
            Crs::Projected { metres, .. } => DVec2::splat(*metres),
            Crs::Geographic { .. } => metres_per_degree(crs_from_sample.transform_point2(0.5 * last).y),
        };
        let spacing = DVec2::new((x * scale).length(), (y * scale).length());
        // A file without a place of its own shows its first row in the north, as pictures do.
        let north_first =
            x.perp_dot(y) < 0.0 || georeference.crs == Crs::Unknown && georeference.geotransform[5] == 1.0;
        let step = if north_first { DVec2::new(spacing.x, -spacing.y) } else { spacing };
        let local_from_sample = DAffine2::from_scale_angle_translation(step, 0.0, -0.5 * last * step);
        Frame { local_from_sample, crs_from_sample, crs: georeference.crs.clone(), last, north_first }
    }

    /// The frame of land that is given in metres alone.
    pub fn local() -> Frame {
        Frame {
            local_from_sample: DAffine2::IDENTITY,
            crs_from_sample: DAffine2::IDENTITY,
            crs: Crs::Unknown,
            last: DVec2::ONE,
            north_first: false,
        }
    }

    /// Whether the file's first row is the northern one, against the land's order.
    pub fn north_first(&self) -> bool {
        self.north_first
    }

    /// Distance between samples (m).
    pub fn spacing(&self) -> DVec2 {
        DVec2::new(self.local_from_sample.matrix2.x_axis.x, self.local_from_sample.matrix2.y_axis.y.abs())
    }

    /// Local metres of coordinates.
    pub fn local_from(&self, system: System, at: DVec2) -> Result<DVec2, String> {
        if system == System::LonLat && !matches!(self.crs, Crs::Geographic { .. }) {
            return Err(
                "expected a file in degrees for --lonlat, got one in another system; give its own coordinates".into()
            );
        }
        let sample = self.crs_from_sample.inverse();
        let mut at = sample.transform_point2(at);
        if let Crs::Geographic { .. } = self.crs {
            // Longitudes of -180 to 180 and of 0 to 360 mean the same places.
            let turn = sample.transform_vector2(DVec2::new(360.0, 0.0));
            for other in [at + turn, at - turn] {
                let inside = |p: DVec2| p.x >= -0.5 && p.x <= self.last.x + 0.5;
                if !inside(at) && inside(other) {
                    at = other;
                }
            }
        }
        Ok(self.local_from_sample.transform_point2(at))
    }

    /// The file's coordinates of local metres.
    pub fn crs_from(&self, local: DVec2) -> DVec2 {
        (self.crs_from_sample * self.local_from_sample.inverse()).transform_point2(local)
    }

    /// Whether a local position lies within the samples.
    pub fn holds(&self, local: DVec2) -> bool {
        let sample = self.local_from_sample.inverse().transform_point2(local);
        sample.cmpge(DVec2::splat(-1e-6)).all() && sample.cmple(self.last + 1e-6).all()
    }

    /// The lowest and highest coordinates of samples.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        let corners = [DVec2::ZERO, DVec2::new(self.last.x, 0.0), DVec2::new(0.0, self.last.y), self.last];
        let corners = corners.map(|corner| self.crs_from_sample.transform_point2(corner));
        (corners.into_iter().fold(corners[0], DVec2::min), corners.into_iter().fold(corners[0], DVec2::max))
    }

    /// A coordinate as it is worth showing: to a centimetre or so.
    pub fn shown(&self, coordinate: f64) -> String {
        crate::talk::tidy(coordinate, self.decimals())
    }

    /// Decimals that make a coordinate good to a centimetre or better.
    pub fn decimals(&self) -> usize {
        if matches!(self.crs, Crs::Geographic { .. }) { 7 } else { 2 }
    }

    /// The coordinate system.
    pub fn crs(&self) -> &Crs {
        &self.crs
    }

    /// The latitude of the middle (degrees), where known.
    pub fn latitude(&self) -> Option<f64> {
        matches!(self.crs, Crs::Geographic { .. }).then(|| self.crs_from_sample.transform_point2(0.5 * self.last).y)
    }

    /// The angle from the land's y axis clockwise to north (rad).
    pub fn north(&self) -> f64 {
        let north = (self.local_from_sample * self.crs_from_sample.inverse()).transform_vector2(DVec2::Y);
        if self.crs == Crs::Unknown { 0.0 } else { north.x.atan2(north.y) }
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

/// Metres in a degree of longitude and of latitude on WGS 84 at a latitude (degrees).
fn metres_per_degree(latitude: f64) -> DVec2 {
    const A: f64 = 6_378_137.0;
    const E2: f64 = 0.006_694_379_990_141_317;
    let (sin, cos) = latitude.to_radians().sin_cos();
    let w = 1.0 - E2 * sin * sin;
    let prime_vertical = A / w.sqrt();
    let meridian = prime_vertical * (1.0 - E2) / w;
    DVec2::new(prime_vertical * cos.max(1e-3), meridian) * 1f64.to_radians()
}
