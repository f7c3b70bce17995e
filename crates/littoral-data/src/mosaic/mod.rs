//! Several files as one: a mosaic that is a [`Source`] like any other.
//!
//! All files are laid on one lattice, that of the finest of them carried on over all the ground. A file on the same lattice
//! is copied sample by sample; any other is interpolated bilinearly, and averaged down first where it is finer. Windows
//! touch only the files that they meet, and of these only the samples that they need, so that memory is bounded by the
//! window and by the few files that are kept open.
//!
//! Where files overlap, those of like spacing are blended across the whole width of the overlap: each counts by its
//! distance from its own borders, a product of the distance along columns and along rows, so that the share of a file fades
//! to nothing at its border and is even across the overlap. Of files of unlike spacing the finer one hides the coarser but
//! for a margin at the finer one's borders. Towards voids a file fades in the same way, and a void of all files stays void.
//! Nothing of this depends on the order in which the files are named.
//!
//! Based on: Szeliski. Image alignment and stitching: a tutorial, section 6.2 (feathering by distance maps). 2006;
//! Borgefors. Distance transformations in digital images. 1986.

mod blend;
mod join;
mod tile;

use crate::{Encoding, Error, Georeference, Info, Level, Source, open_as};
use blend::Blend;
use littoral::field::Window;
use littoral::memory::filled;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use tile::{Reopen, Tile};

/// So many files are kept open: a mosaic of hundreds must not take as many handles, nor as many caches.
const MOST_OPEN: usize = 32;

/// Several files as one.
pub struct Mosaic {
    tiles: Vec<Tile>,
    /// Tiles that are open and can be opened again, the most recently read last.
    open: VecDeque<usize>,
    /// Files of like spacing, the finest first.
    groups: Vec<Vec<usize>>,
    info: Info,
    levels: Vec<Level>,
    /// What was noticed when the files were joined.
    joining: Vec<String>,
    /// Width of the margin in which a finer file gives way to a coarser one, and a file to its voids (samples).
    margin: usize,
}

/// Opens files as one source: one file as it is, several as a [`Mosaic`]; PNGs in this encoding, see [`open_as`].
///
/// # Errors
/// As [`open_as`] for each file, and as [`Mosaic::new`].
pub fn open_all(files: &[PathBuf], encoding: Option<Encoding>) -> Result<Box<dyn Source>, Error> {
    if let [file] = files {
        return open_as(file, encoding);
    }
    let mut tiles = Vec::with_capacity(files.len());
    for file in files {
        let mut tile = Tile::new(file.clone(), open_as(file, encoding)?, Reopen::As(encoding))?;
        if tiles.len() >= MOST_OPEN {
            tile.close();
        }
        tiles.push(tile);
    }
    Ok(Box::new(Mosaic::of_tiles(tiles)?))
}

/// What several files are called together, in messages.
pub fn name_of_all(files: &[PathBuf]) -> PathBuf {
    match files {
        [] => PathBuf::new(),
        [file] => file.clone(),
        [a, b] => format!("{} + {}", a.display(), b.display()).into(),
        [a, rest @ ..] => format!("{} + {} more", a.display(), rest.len()).into(),
    }
}

impl Mosaic {
    /// Joins opened sources, each under the name of its file.
    ///
    /// # Errors
    /// If there are none, one does not say where it lies, or they are not in one coordinate system. Geographic systems count
    /// as one; so do projected ones that agree in their coordinates, whatever they are called.
    pub fn new(sources: Vec<(PathBuf, Box<dyn Source>)>) -> Result<Mosaic, Error> {
        let tiles = sources.into_iter().map(|(file, source)| Tile::new(file, source, Reopen::Never));
        Mosaic::of_tiles(tiles.collect::<Result<_, _>>()?)
    }

    fn of_tiles(mut tiles: Vec<Tile>) -> Result<Mosaic, Error> {
        let join::Joined { info, groups, ratio } = join::join(&mut tiles)?;
        let joining = info.warnings.clone();
        // One sample of the coarsest files, but not so narrow that a step shows, nor so wide that detail is lost.
        let margin = (ratio.ceil() as usize).clamp(16, 64);
        let levels = levels(&tiles, &info.georeference);
        let open = (0..tiles.len()).filter(|&tile| tiles[tile].closable()).collect();
        let mut mosaic = Mosaic { tiles, open, groups, info, levels, joining, margin };
        mosaic.gather_warnings();
        Ok(mosaic)
    }

    /// All that was noticed, the same about several files said once.
    fn gather_warnings(&mut self) {
        let mut said: Vec<(&str, &Path, usize)> = Vec::new();
        for tile in &self.tiles {
            for warning in &tile.info.warnings {
                match said.iter_mut().find(|(text, ..)| text == warning) {
                    Some((_, _, files)) => *files += 1,
                    None => said.push((warning, &tile.file, 1)),
                }
            }
        }
        let mut warnings = self.joining.clone();
        warnings.extend(said.into_iter().map(|(text, file, files)| match files {
            1 => format!("{}: {text}", file.display()),
            files => format!("{} + {} more: {text}", file.display(), files - 1),
        }));
        self.info.warnings = warnings;
    }

    /// Heights of one file on the lattice of a level, and where they lie; `None` if it does not reach the window.
    fn patch(&mut self, tile: usize, lattice: &Georeference, window: Window) -> Result<Option<tile::Patch>, Error> {
        let patch = self.tiles[tile].patch(lattice, window)?;
        if self.tiles[tile].closable() {
            self.open.retain(|&other| other != tile);
            self.open.push_back(tile);
        }
        while self.open.len() > MOST_OPEN {
            if let Some(oldest) = self.open.pop_front() {
                self.tiles[oldest].close();
            }
        }
        Ok(patch)
    }
}

/// The full lattice, and its halves as far as every file holds overviews for them. Without overviews a halved lattice costs
/// as much as the full one, and averaging that down is exact.
fn levels(tiles: &[Tile], full: &Georeference) -> Vec<Level> {
    let mut levels = Vec::new();
    let [mut columns, mut rows] = full.size;
    while levels.is_empty()
        || columns.min(rows) >= 2 && tiles.iter().all(|tile| tile.serves(&full.resized(columns, rows)))
    {
        levels.push(Level { columns, rows });
        (columns, rows) = (columns.div_ceil(2), rows.div_ceil(2));
        if levels.last() == Some(&Level { columns, rows }) {
            break;
        }
    }
    levels
}

/// The window and so many samples round it, within a level.
fn grown(window: Window, by: usize, level: Level) -> Window {
    let (column, row) = (window.column.saturating_sub(by), window.row.saturating_sub(by));
    Window {
        column,
        row,
        columns: (window.column + window.columns + by).min(level.columns) - column,
        rows: (window.row + window.rows + by).min(level.rows) - row,
    }
}

impl Source for Mosaic {
    fn info(&self) -> &Info {
        &self.info
    }

    fn levels(&self) -> &[Level] {
        &self.levels
    }

    fn read(&mut self, level: usize, window: Window) -> Result<Vec<f32>, Error> {
        let size = self.levels[level];
        let lattice = self.info.georeference.resized(size.columns, size.rows);
        let reached: Vec<(usize, Window)> = (self.tiles.iter().enumerate())
            .filter_map(|(index, tile)| Some((index, tile.reach(&lattice, window)?)))
            .collect();
        let overlap = (reached.iter().enumerate())
            .any(|(count, (_, a))| reached[..count].iter().any(|(_, b)| tile::overlap(*a, *b)));
        let mut heights = filled(f32::NAN, window.columns * window.rows);
        if !overlap {
            for (tile, _) in reached {
                if let Some(patch) = self.patch(tile, &lattice, window)? {
                    patch.paste(window, &mut heights);
                }
            }
        } else {
            // Distances to borders and voids are needed as far as they count, also beyond the window.
            let margin = (self.margin >> level).max(2);
            let ground = grown(window, margin, size);
            let mut blend = Blend::new(ground, margin);
            // From coarse to fine: each group lies over those before it.
            for group in (0..self.groups.len()).rev() {
                for tile in self.groups[group].clone() {
                    if let Some(patch) = self.patch(tile, &lattice, ground)? {
                        blend.add(&patch);
                    }
                }
                blend.lay_over();
            }
            blend.cut(window, &mut heights);
        }
        self.gather_warnings();
        Ok(heights)
    }
}

#[cfg(test)]
mod tests;
