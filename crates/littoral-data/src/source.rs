//! What a reader offers, and how a file becomes land.

use crate::formats::tiles::Encoding;
use crate::reduce::Reducer;
use crate::{Error, Georeference, formats};
use littoral::field::{Raster, Window};
use littoral::memory::in_large_pages;
use std::path::Path;

/// What a file's heights are counted from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VerticalDatum {
    /// Not stated: taken as mean sea level, and said so.
    Unknown,
    /// What the file names, such as `EGM96` or `EPSG:5773`.
    Named(String),
}

impl VerticalDatum {
    /// The vertical system within a well-known text, and metres in one of its units; `None` if it names none.
    pub fn from_wkt(text: &str) -> Option<(VerticalDatum, f64)> {
        crate::wkt::vertical(text)
    }
}

/// What a file is, from its header alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// Short name of the format, as GDAL's driver is called where there is one: `GTiff`, `SRTMHGT`, `AAIGrid` …
    pub format: &'static str,
    /// Columns of the full raster.
    pub columns: usize,
    /// Rows of the full raster.
    pub rows: usize,
    /// The declared no-data value, raw.
    pub nodata: Option<f64>,
    /// Where the samples lie.
    pub georeference: Georeference,
    /// Metres in one vertical unit of the file.
    pub vertical_metres: f64,
    /// What the heights are counted from.
    pub vertical_datum: VerticalDatum,
    /// Distance between representable heights (m): 1 for integer metres, 0 for floating point.
    pub step: f64,
    /// What the reader noticed: taken for granted, repaired, or left out. One sentence each.
    pub warnings: Vec<String>,
}

/// One resolution of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Columns.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

/// An opened file.
pub trait Source: Send {
    /// What the file is. Warnings may grow as more of the file is read.
    fn info(&self) -> &Info;

    /// The resolutions held, the full one first, then ever coarser ones.
    fn levels(&self) -> &[Level];

    /// Columns and rows of the blocks in which a level is stored, counted from its first sample: windows along their
    /// borders read cheapest. A whole row unless a format says otherwise.
    fn block(&self, level: usize) -> [usize; 2] {
        [self.levels()[level].columns, 1]
    }

    /// Heights (m) of a window of one level, in the file's order (first row first); NaN where void.
    ///
    /// # Errors
    /// If the file is broken there in a way that leaves nothing to show.
    fn read(&mut self, level: usize, window: Window) -> Result<Vec<f32>, Error>;
}

/// A whole raster held in memory: what formats without random access become.
pub struct MemorySource {
    info: Info,
    level: [Level; 1],
    heights: Vec<f32>,
}

impl MemorySource {
    /// `heights` (m) in the file's order, NaN where void.
    ///
    /// # Panics
    /// If there are not `info.columns × info.rows` heights.
    pub fn new(info: Info, heights: Vec<f32>) -> MemorySource {
        assert_eq!(heights.len(), info.columns * info.rows, "expected one height for each sample");
        let level = [Level { columns: info.columns, rows: info.rows }];
        MemorySource { info, level, heights }
    }
}

impl Source for MemorySource {
    fn info(&self) -> &Info {
        &self.info
    }

    fn levels(&self) -> &[Level] {
        &self.level
    }

    fn read(&mut self, _level: usize, window: Window) -> Result<Vec<f32>, Error> {
        let mut heights = in_large_pages(Vec::with_capacity(window.columns * window.rows));
        for row in window.row..window.row + window.rows {
            let start = row * self.info.columns + window.column;
            heights.extend_from_slice(&self.heights[start..start + window.columns]);
        }
        Ok(heights)
    }
}

/// Opens a height file of any known format, told by its content.
///
/// # Errors
/// If the file cannot be read, is of no known format, or is broken.
pub fn open(file: &Path) -> Result<Box<dyn Source>, Error> {
    formats::open(file)
}

/// As [`open`], and the pixels of a PNG in this encoding; `None` to tell it from the heights that they give.
///
/// # Errors
/// As [`open`]; also if the file is no PNG, or its pixels cannot be in that encoding.
pub fn open_as(file: &Path, encoding: Option<Encoding>) -> Result<Box<dyn Source>, Error> {
    let mut input = formats::Input::file(file)?;
    input.encoding = encoding;
    formats::open_input(input)
}

/// How much of a file to load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadOptions {
    /// At most so many samples; a coarser level is read, or a finer one averaged down, to fit.
    pub most_samples: usize,
}

/// A file made ready for the engine.
#[derive(Clone, Debug)]
pub struct Dem {
    /// The samples in local metres: x east, y north of the raster's middle (for rotated grids: along its rows and columns).
    pub raster: Raster,
    /// Where the raster's samples lie, in its own columns and rows: of the file where it was loaded whole, coarser
    /// ones where it was averaged down, a part of them for a window.
    pub georeference: Georeference,
    /// What the file said.
    pub info: Info,
}

/// Samples of one portion of a streaming read: 4 Mi of them are 16 MiB.
const PORTION: usize = 1 << 22;

/// The windows that cover a level from its first row to its last, whole rows each, along the borders of its blocks where
/// these are not too large.
pub(crate) fn bands(source: &dyn Source, level: usize) -> impl Iterator<Item = Window> + use<> {
    let Level { columns, rows } = source.levels()[level];
    let block = source.block(level)[1].max(1);
    let most = (PORTION / columns.max(1)).max(1);
    let step = if most >= block { most / block * block } else { most };
    (0..rows).step_by(step).map(move |row| Window { column: 0, row, columns, rows: step.min(rows - row) })
}

/// Opens and reads a file at a resolution that fits.
///
/// # Errors
/// As [`open`]; also if no sample is valid.
pub fn load(file: &Path, options: LoadOptions) -> Result<Dem, Error> {
    load_from(&mut *open(file)?, file, options, &|_| {})
}

/// Reads an opened file at a resolution that fits: a level as it is stored if one has between a quarter of
/// `most_samples` and all of them, else the next finer one averaged down as it streams by. `file` names it in errors;
/// `progress` hears the part done, in [0, 1].
///
/// Averaging: each coarse sample is the mean of the valid samples under its area, and void where more than half of the
/// area is void.
///
/// # Errors
/// As [`Source::read`]; also if no sample is valid.
pub fn load_from(
    source: &mut dyn Source,
    file: &Path,
    options: LoadOptions,
    progress: &dyn Fn(f32),
) -> Result<Dem, Error> {
    let most = options.most_samples.max(4);
    let full = source.levels()[0];
    if full.columns < 2 || full.rows < 2 {
        let problem = format!("expected at least 2 × 2 samples, got {} × {}", full.columns, full.rows);
        return Err(Error::content(file, problem));
    }
    let samples = |level: &Level| level.columns.saturating_mul(level.rows);
    let usable = |level: &Level| level.columns >= 2 && level.rows >= 2;
    // Levels run from fine to coarse.
    let fitting = source.levels().iter().position(|level| samples(level) <= most && usable(level));
    let finer = source.levels().iter().rposition(|level| samples(level) > most && usable(level));
    let (level, size) = match (fitting, finer) {
        (Some(level), None) => (level, source.levels()[level]),
        (Some(level), Some(_)) if samples(&source.levels()[level]) >= most / 4 => (level, source.levels()[level]),
        (_, Some(level)) => (level, coarser(source.levels()[level], most)),
        (None, None) => (0, full),
    };
    let Level { columns, rows } = source.levels()[level];
    let mut heights;
    if size == source.levels()[level] {
        heights = in_large_pages(Vec::with_capacity(columns * rows));
        for window in bands(source, level) {
            heights.extend_from_slice(&source.read(level, window)?);
            progress((window.row + window.rows) as f32 / rows as f32);
        }
    } else {
        let mut reducer = Reducer::new(columns, rows, size.columns, size.rows);
        for window in bands(source, level) {
            reducer.push(&source.read(level, window)?);
            progress((window.row + window.rows) as f32 / rows as f32);
        }
        heights = reducer.into_heights();
    }
    let georeference = source.info().georeference.resized(size.columns, size.rows);
    let mut dem = finish(source, file, georeference, heights)?;
    if size != full {
        let how = if size == source.levels()[level] { "read from an overview" } else { "averaged down" };
        let text = format!(
            "{} × {} samples {how} to {} × {} to fit into {most}",
            full.columns, full.rows, size.columns, size.rows
        );
        dem.info.warnings.push(text);
    }
    Ok(dem)
}

/// Reads a window of one level of an opened file, as a raster of its own. `file` names it in errors.
///
/// # Errors
/// As [`Source::read`]; also if no sample is valid, or the window is smaller than 2 × 2 samples or leaves the level.
pub fn load_window(source: &mut dyn Source, file: &Path, level: usize, window: Window) -> Result<Dem, Error> {
    let Some(&Level { columns, rows }) = source.levels().get(level) else {
        let problem = format!("expected one of {} levels, got {level}", source.levels().len());
        return Err(Error::content(file, problem));
    };
    let inside = window.column.checked_add(window.columns).is_some_and(|end| end <= columns)
        && window.row.checked_add(window.rows).is_some_and(|end| end <= rows);
    if !inside || window.columns < 2 || window.rows < 2 {
        let problem = format!("expected a window of 2 × 2 samples or more within {columns} × {rows}, got {window:?}");
        return Err(Error::content(file, problem));
    }
    let heights = source.read(level, window)?;
    let georeference = source.info().georeference.resized(columns, rows).window(window);
    finish(source, file, georeference, heights)
}

/// The size of at most `most` samples, in the proportions of a finer one, that a level is averaged down to.
fn coarser(level: Level, most: usize) -> Level {
    let scale = (most as f64 / (level.columns as f64 * level.rows as f64)).sqrt().min(1.0);
    let columns = ((level.columns as f64 * scale) as usize).clamp(2, level.columns);
    // Very long rasters: the shorter side stops at 2, the longer one takes what is left.
    let columns = columns.min((most / 2).max(2));
    let rows = (level.rows as f64 * columns as f64 / level.columns as f64).round() as usize;
    Level { columns, rows: rows.clamp(2, level.rows).min((most / columns).max(2)) }
}

/// Turns heights in the file's order into a raster in local metres.
fn finish(source: &dyn Source, file: &Path, georeference: Georeference, mut heights: Vec<f32>) -> Result<Dem, Error> {
    let mut info = source.info().clone();
    if heights.iter().all(|height| height.is_nan()) {
        return Err(Error::content(file, "expected at least one valid height, got only voids"));
    }
    let [columns, rows] = georeference.size;
    georeference.turn(&mut heights, columns);
    info.warnings.extend(georeference.warnings());
    let raster = Raster::new(columns, rows, georeference.spacing(), heights)
        .map_err(|error| Error::content(file, error.to_string()))?;
    Ok(Dem { raster, georeference, info })
}
