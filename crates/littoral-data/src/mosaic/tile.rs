//! One file of a mosaic, and its heights on the mosaic's lattice.

use crate::reduce::Reducer;
use crate::{Crs, Encoding, Error, Georeference, Info, Level, Source, open_as};
use glam::{DAffine2, DVec2};
use littoral::field::Window;
use littoral::memory::filled;
use rayon::prelude::*;
use std::path::PathBuf;

/// A position so near to a sample (in samples) is that sample: coordinates are written with so few digits.
pub(super) const ALIGNED: f64 = 1e-3;

/// A file may be so much finer than a lattice (samples a step) before its samples are averaged: bilinear interpolation
/// passes over hardly any of them.
const FINER: f64 = 1.75;

/// A level may be so much coarser than a lattice (samples a step) and still serve it: the sizes of overviews are rounded.
const COARSER: f64 = 0.95;

/// Heights read at once when a file is averaged down: 4 Mi of them are 16 MiB.
const PORTION: usize = 1 << 22;

/// One file of a mosaic.
pub(super) struct Tile {
    pub file: PathBuf,
    /// What the file is; longitudes whole turns from what it says where the mosaic lies there.
    pub info: Info,
    levels: Vec<Level>,
    source: Option<Box<dyn Source>>,
    reopen: Reopen,
}

/// Whether a source can be opened again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reopen {
    /// It is kept open.
    Never,
    /// It is a file, opened like this.
    As(Option<Encoding>),
}

/// A file's heights on a part of a lattice.
pub(super) struct Patch {
    /// Which part; within it, all that the file does not reach is NaN.
    pub window: Window,
    /// Heights (m) of the window, NaN where void.
    pub heights: Vec<f32>,
    /// The file's (column, row) from the lattice's, whole numbers for samples.
    file_from_lattice: DAffine2,
    /// The file's columns and rows.
    size: DVec2,
}

/// How a file is read for a lattice.
struct Way {
    level: usize,
    /// So many samples of the level are averaged along columns and rows.
    averaged: usize,
    /// (column, row) among the averages, which are `size`.
    file_from_lattice: DAffine2,
    size: [usize; 2],
}

impl Tile {
    pub(super) fn new(file: PathBuf, source: Box<dyn Source>, reopen: Reopen) -> Result<Tile, Error> {
        let (info, levels) = (source.info().clone(), source.levels().to_vec());
        if info.columns < 2 || info.rows < 2 {
            let problem = format!("expected at least 2 × 2 samples, got {} × {}", info.columns, info.rows);
            return Err(Error::content(&file, problem));
        }
        Ok(Tile { file, info, levels, source: Some(source), reopen })
    }

    /// Whether it is open and can be opened again.
    pub(super) fn closable(&self) -> bool {
        self.reopen != Reopen::Never && self.source.is_some()
    }

    /// Lets go of the file until it is read next.
    pub(super) fn close(&mut self) {
        self.source = None;
    }

    /// Moves longitudes by whole turns to within half a turn of another place.
    pub(super) fn turn_to(&mut self, place: DVec2) {
        let georeference = &mut self.info.georeference;
        if let Crs::Geographic { .. } = georeference.crs {
            let turns = ((georeference.middle().x - place.x) / 360.0).round();
            georeference.geotransform[0] -= 360.0 * turns;
        }
    }

    /// The way that a lattice is served best: from the coarsest level that is as fine, or from the full one.
    fn way(&self, lattice: &Georeference) -> Way {
        let placed = |[columns, rows]: [usize; 2]| {
            let samples = self.info.georeference.resized(columns, rows);
            samples.crs_from_sample().inverse() * lattice.crs_from_sample()
        };
        let finest = |map: DAffine2| map.matrix2.x_axis.length().min(map.matrix2.y_axis.length());
        let usable = |level: &Level| {
            level.columns.min(level.rows) >= 2 && finest(placed([level.columns, level.rows])) >= COARSER
        };
        let level = self.levels.iter().rposition(usable).unwrap_or(0);
        let Level { columns, rows } = self.levels[level];
        let map = placed([columns, rows]);
        let most = columns.min(rows) / 2;
        let averaged = if finest(map) < FINER { 1 } else { (finest(map).round() as usize).clamp(1, most) };
        let half = DAffine2::from_translation(DVec2::splat(0.5));
        let to_averages = half.inverse() * DAffine2::from_scale(DVec2::splat(1.0 / averaged as f64)) * half;
        Way {
            level,
            averaged,
            file_from_lattice: to_averages * map,
            size: [columns.div_ceil(averaged), rows.div_ceil(averaged)],
        }
    }

    /// Whether a lattice can be served without averaging down.
    pub(super) fn serves(&self, lattice: &Georeference) -> bool {
        self.way(lattice).averaged == 1
    }

    /// The part of a window that lies over the file's pixels; `None` if no sample does.
    pub(super) fn reach(&self, lattice: &Georeference, window: Window) -> Option<Window> {
        let Way { file_from_lattice, size, .. } = self.way(lattice);
        let (low, high) = bounds(file_from_lattice.inverse(), DVec2::splat(-0.5), pixels(size) - 0.5);
        let (low, high) = ((low - ALIGNED).ceil(), (high + ALIGNED).floor());
        let first = DVec2::new(window.column as f64, window.row as f64);
        let low = low.max(first);
        let high = high.min(first + DVec2::new(window.columns as f64, window.rows as f64) - 1.0);
        low.cmple(high).all().then(|| samples_within(low, high))
    }

    /// The heights of a part of a lattice; `None` if the file does not reach it.
    pub(super) fn patch(&mut self, lattice: &Georeference, window: Window) -> Result<Option<Patch>, Error> {
        let Some(window) = self.reach(lattice, window) else { return Ok(None) };
        let way = self.way(lattice);
        let (map, size) = (way.file_from_lattice, way.size);
        let first = DVec2::new(window.column as f64, window.row as f64);
        let last = first + DVec2::new(window.columns as f64, window.rows as f64) - 1.0;
        let shift = (map.transform_point2(first) - first).round();
        let same = |at: DVec2| (map.transform_point2(at) - at - shift).abs().max_element() < ALIGNED;
        let heights = if [first, last, DVec2::new(first.x, last.y), DVec2::new(last.x, first.y)].into_iter().all(same) {
            let at = first + shift;
            self.read(&way, Window { column: at.x as usize, row: at.y as usize, ..window })?
        } else {
            // Two samples along each side at least, so that there is something between them.
            let (low, high) = bounds(map, first, last);
            let most = pixels(size) - 1.0;
            let low = (low - ALIGNED).floor().clamp(DVec2::ZERO, most - 1.0);
            let high = (high + ALIGNED).ceil().clamp(low + 1.0, most);
            let part = samples_within(low, high);
            let samples = self.read(&way, part)?;
            let mut heights = filled(f32::NAN, window.columns * window.rows);
            heights.par_chunks_exact_mut(window.columns).enumerate().for_each(|(row, line)| {
                for (column, height) in line.iter_mut().enumerate() {
                    let at = map.transform_point2(first + DVec2::new(column as f64, row as f64));
                    let within = at.cmpge(DVec2::splat(-0.5 - ALIGNED)) & at.cmple(pixels(size) - 0.5 + ALIGNED);
                    if within.all() {
                        *height = between(&samples, part, at - low);
                    }
                }
            });
            heights
        };
        Ok(Some(Patch { window, heights, file_from_lattice: map, size: pixels(size) }))
    }

    /// Averages of a window of the file, opened again if need be.
    fn read(&mut self, way: &Way, window: Window) -> Result<Vec<f32>, Error> {
        if let (None, Reopen::As(encoding)) = (&self.source, self.reopen) {
            let source = open_as(&self.file, encoding)?;
            if source.levels() != self.levels {
                let problem = "expected the file as it was opened first, got one of another size; leave it as it is while it is read";
                return Err(Error::content(&self.file, problem));
            }
            self.source = Some(source);
        }
        let Some(source) = &mut self.source else { return Ok(Vec::new()) };
        let heights = match way.averaged {
            1 => source.read(way.level, window)?,
            by => averages(&mut **source, way.level, by, window)?,
        };
        // A file opened anew has forgotten what it noticed.
        for warning in &source.info().warnings {
            if !self.info.warnings.contains(warning) {
                self.info.warnings.push(warning.clone());
            }
        }
        Ok(heights)
    }
}

/// Means of `by` × `by` samples, for a window of such means. At the file's end the last row and column stand for those that
/// are missing from a mean.
fn averages(source: &mut dyn Source, level: usize, by: usize, window: Window) -> Result<Vec<f32>, Error> {
    let all = source.levels()[level];
    let (column, columns) = (window.column * by, window.columns * by);
    let there = columns.min(all.columns - column);
    let mut reducer = Reducer::new(columns, window.rows * by, window.columns, window.rows);
    let (mut row, end) = (window.row * by, (window.row + window.rows) * by);
    let step = (PORTION / columns).max(1);
    let mut padded = Vec::new();
    while row < end {
        let first = row.min(all.rows - 1);
        let rows = step.min(all.rows - first).min(end - row);
        let heights = source.read(level, Window { column, row: first, columns: there, rows })?;
        for line in heights.chunks_exact(there) {
            padded.clear();
            padded.extend_from_slice(line);
            padded.resize(columns, line[there - 1]);
            reducer.push(&padded);
        }
        row += rows;
    }
    Ok(reducer.into_heights())
}

/// Columns and rows as lengths.
fn pixels([columns, rows]: [usize; 2]) -> DVec2 {
    DVec2::new(columns as f64, rows as f64)
}

/// The bounds of a mapped rectangle.
fn bounds(map: DAffine2, low: DVec2, high: DVec2) -> (DVec2, DVec2) {
    let corners = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)].map(|c| map.transform_point2(c));
    (corners.into_iter().fold(corners[0], DVec2::min), corners.into_iter().fold(corners[0], DVec2::max))
}

/// The window from one sample to another, both included.
fn samples_within(low: DVec2, high: DVec2) -> Window {
    let count = high - low + 1.0;
    Window { column: low.x as usize, row: low.y as usize, columns: count.x as usize, rows: count.y as usize }
}

/// Whether two windows share a sample.
pub(super) fn overlap(a: Window, b: Window) -> bool {
    let along = |a: usize, n: usize, b: usize, m: usize| a < b + m && b < a + n;
    along(a.column, a.columns, b.column, b.columns) && along(a.row, a.rows, b.row, b.rows)
}

/// The bilinear height at (column, row) of a window of 2 × 2 samples or more; NaN if a sample that counts is void. On the
/// outer half of a border pixel the patch beside it is carried on, so that neighbours whose samples lie a fraction of a step
/// apart meet without a gap and without a step; not where that patch has a void.
fn between(samples: &[f32], window: Window, at: DVec2) -> f32 {
    let snap = |at: f64| if (at - at.round()).abs() < ALIGNED { at.round() } else { at };
    let at = DVec2::new(snap(at.x), snap(at.y));
    let most = DVec2::new(window.columns as f64, window.rows as f64) - 2.0;
    let base = at.floor().clamp(DVec2::ZERO, most);
    let (column, row) = (base.x as usize, base.y as usize);
    let height = |t: DVec2| {
        let mut height = 0.0;
        for (i, j, weight) in
            [(0, 0, (1.0 - t.x) * (1.0 - t.y)), (1, 0, t.x * (1.0 - t.y)), (0, 1, (1.0 - t.x) * t.y), (1, 1, t.x * t.y)]
        {
            if weight != 0.0 {
                height += weight * f64::from(samples[(row + j) * window.columns + column + i]);
            }
        }
        height as f32
    };
    let carried = height(at - base);
    if carried.is_nan() { height((at - base).clamp(DVec2::ZERO, DVec2::ONE)) } else { carried }
}

impl Patch {
    /// Copies what is not void into the heights of another window.
    pub(super) fn paste(&self, window: Window, heights: &mut [f32]) {
        for row in self.window.row.max(window.row)..(self.window.row + self.window.rows).min(window.row + window.rows) {
            let from = (row - self.window.row) * self.window.columns;
            let into = (row - window.row) * window.columns + self.window.column - window.column;
            for (height, &own) in heights[into..].iter_mut().zip(&self.heights[from..from + self.window.columns]) {
                *height = if own.is_nan() { *height } else { own };
            }
        }
    }

    /// How much the file counts at a sample of the lattice: the product of the distances from its nearest borders along
    /// columns and rows (steps of the lattice), above zero.
    pub(super) fn weight(&self, column: usize, row: usize) -> f64 {
        let map = self.file_from_lattice;
        let at = map.transform_point2(DVec2::new(column as f64, row as f64));
        let depth = (at + 0.5).min(self.size - 0.5 - at);
        let step = DVec2::new(map.matrix2.row(0).length(), map.matrix2.row(1).length());
        let depth = (depth / step).max(DVec2::splat(ALIGNED));
        depth.x * depth.y
    }
}
