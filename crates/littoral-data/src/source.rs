//! What a reader offers, and how a file becomes land.

use crate::{Error, Georeference, formats};
use littoral::field::{Raster, Window};
use std::path::Path;

/// What a file's heights are counted from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VerticalDatum {
    /// Not stated: taken as mean sea level, and said so.
    Unknown,
    /// What the file names, such as `EGM96` or `EPSG:5773`.
    Named(String),
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
        let mut heights = Vec::with_capacity(window.columns * window.rows);
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

/// How much of a file to load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadOptions {
    /// At most so many samples; a coarser level is read, or the full one averaged down, to fit.
    pub most_samples: usize,
}

/// A file made ready for the engine.
#[derive(Clone, Debug)]
pub struct Dem {
    /// The samples in local metres: x east, y north of the raster's middle (for rotated grids: along its rows and columns).
    pub raster: Raster,
    /// How local metres, samples and the file's coordinates belong together.
    pub georeference: Georeference,
    /// What the file said.
    pub info: Info,
}

/// Opens and reads a file at a resolution that fits.
///
/// # Errors
/// As [`open`]; also if no sample is valid.
pub fn load(file: &Path, options: LoadOptions) -> Result<Dem, Error> {
    let _ = options;
    Err(Error::content(file, "not yet"))
}
