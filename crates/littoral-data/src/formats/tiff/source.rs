//! An opened GeoTIFF: its resolutions, and windows of heights from them.

use super::codec::Scratch;
use super::directory::Container;
use super::geokeys::placement;
use super::heights::{Chunk, decode};
use super::image::{Compression, Image, tag};
use crate::crs::US_SURVEY_FOOT;
use crate::formats::Input;
use crate::formats::pam::{BandNotes, Notes};
use crate::voids::VoidRule;
use crate::{Crs, Error, Georeference, Info, Level, Source, VerticalDatum};
use littoral::field::Window;
use littoral::memory::filled;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet, VecDeque};
use std::path::PathBuf;

/// Decoded heights kept for the next window (bytes), at least one chunk in any case.
const CACHE: usize = 32 << 20;
/// Decoded chunks of one parallel batch together (bytes), at least one chunk in any case.
const BATCH: usize = 16 << 20;

/// Companions that are TIFFs themselves, and whether they hold masks: coarser versions, the mask, and coarser masks.
const COMPANIONS: [(&str, bool); 3] = [("ovr", false), ("msk", true), ("msk.ovr", true)];

/// An opened GeoTIFF.
pub(super) struct TiffSource {
    path: PathBuf,
    /// The file, and those with overviews and masks beside it.
    containers: Vec<Container>,
    /// For each level the container it lies in, and its layout; behind the levels their masks.
    images: Vec<(usize, Image)>,
    /// For each level the place of its mask among the images, if it has one: 0 there is void.
    masks: Vec<Option<usize>>,
    levels: Vec<Level>,
    info: Info,
    rule: VoidRule,
    /// Chunks that a window took only a part of, the most recent last.
    cache: VecDeque<((usize, usize), Vec<f32>)>,
    cached: usize,
    /// Chunks found broken, each noted once, and the place of the warning that counts them.
    broken: HashSet<(usize, usize)>,
    broken_warning: Option<usize>,
    first_problem: String,
    /// Chunks found not stored although no no-data value says what they stand for.
    missing: HashSet<(usize, usize)>,
    missing_warning: Option<usize>,
}

impl TiffSource {
    /// Opens the file and its companions.
    pub(super) fn open(input: Input) -> Result<TiffSource, Error> {
        let path = input.name.clone();
        let error = |problem: String| Error::content(&path, problem);
        let sidecar = |names: &[&str]| {
            let content = names.iter().find_map(|name| input.sidecar(name))?;
            Some(String::from_utf8_lossy(&content).into_owned())
        };
        let world = sidecar(&["tfw", "tifw", "tiffw", "wld"]);
        let projection = sidecar(&["prj"]);
        let beside = Notes::beside(&input);
        let companions = COMPANIONS.map(|(extension, _)| (extension, input.sidecar_bytes(extension)));
        let file = Container::new(input.into_bytes()).map_err(error)?;
        let (directories, chain_warning) = file.directories().map_err(error)?;
        let mut warnings: Vec<String> = chain_warning.into_iter().collect();

        // Bit 0 says a smaller version, bit 2 a mask.
        let role = |directory| file.unsigned(directory, tag::NEW_SUBFILE_TYPE).ok().flatten().unwrap_or(0) & 5;
        let roles: Vec<u64> = directories.iter().map(role).collect();
        let main = roles.iter().position(|&role| role == 0).unwrap_or(0);
        let directory = &directories[main];
        let image = Image::new(&file, directory).map_err(error)?;

        let placement = placement(&file, directory);
        warnings.extend(placement.warnings);
        let notes =
            file.text(directory, tag::GDAL_METADATA).map_or(Ok(BandNotes::default()), |xml| BandNotes::of_tag(&xml));
        let notes = notes.unwrap_or_else(|error| {
            warnings.push(format!("GDAL's notes in tag {} are left aside: {error}", tag::GDAL_METADATA));
            BandNotes::default()
        });
        let nodata = file.text(directory, tag::GDAL_NODATA).and_then(|text| number(&text));
        let notes = BandNotes { nodata, ..notes }.or(beside.band);
        warnings.extend(beside.warnings);
        let stated = notes.metres(&mut warnings).or(placement.vertical_metres);
        let rule = notes.rule(stated.unwrap_or(1.0));
        let crs = beside.crs.unwrap_or(placement.crs);
        if stated.is_none()
            && let Crs::Projected { metres, .. } = crs
            && (metres - 1.0).abs() > 1e-9
            && (metres - US_SURVEY_FOOT).abs() < 0.01
        {
            warnings.push("the map is in feet, but the unit of the heights is not stated; metres are taken".into());
        }

        let mut georeference = Georeference::none(image.columns, image.rows);
        georeference.registration = beside.registration.unwrap_or(placement.registration);
        georeference.crs = crs;
        if georeference.crs == Crs::Unknown
            && let Some(text) = projection
        {
            georeference.crs = Crs::from_wkt(&text);
        }
        if beside.geotransform.is_some() && placement.geotransform.is_some_and(|own| beside.geotransform != Some(own)) {
            warnings.push(
                "the .aux.xml beside the file places it elsewhere than its own tags; it is believed, as GDAL does"
                    .into(),
            );
        }
        let stated = beside.geotransform.or(placement.geotransform);
        if let Some(geotransform) = stated.or_else(|| Georeference::geotransform_of_world_file(&world?)) {
            georeference.y_south = false;
            georeference.geotransform = geotransform;
        }
        if image.bands > 1 {
            let alpha = if image.alpha.is_some() { ", and voids from the alpha band" } else { "" };
            warnings.push(format!("{} bands: the first is taken as the height{alpha}", image.bands));
        }
        let step = if image.kind.is_float() { 0.0 } else { (rule.scale * rule.metres).abs() };
        if image.kind.size() == 1 {
            warnings.push(format!("8-bit samples: heights come in steps of {step} m"));
        }
        let whole = roles.iter().filter(|&&role| role == 0).count();
        if whole > 1 {
            warnings.push(format!("{whole} images in one file: the first is read"));
        }

        let mut containers = vec![file];
        let (mut images, mut loose_masks) = (vec![(0, image)], Vec::new());
        let others = directories.iter().zip(roles).enumerate().filter(|(index, _)| *index != main);
        for (_, (directory, role)) in others {
            match role {
                0 => {}
                1 => push(&mut images, 0, Image::new(&containers[0], directory), "an overview", &mut warnings),
                _ => push(&mut loose_masks, 0, Image::mask(&containers[0], directory), "a mask", &mut warnings),
            }
        }
        for ((extension, content), (_, masks)) in companions.into_iter().zip(COMPANIONS) {
            let content = content.map_err(|error| error.to_string()).transpose();
            let container = match content.map(|content| content.and_then(Container::new)) {
                None => continue,
                Some(container) => container.and_then(|it| Ok((it.directories()?.0, it))),
            };
            match container {
                Ok((found, container)) => {
                    for directory in &found {
                        let at = containers.len();
                        let role = container.unsigned(directory, tag::NEW_SUBFILE_TYPE).ok().flatten().unwrap_or(0);
                        if masks || role & 4 != 0 {
                            push(&mut loose_masks, at, Image::mask(&container, directory), "a mask", &mut warnings);
                        } else {
                            push(&mut images, at, Image::new(&container, directory), "an overview", &mut warnings);
                        }
                    }
                    containers.push(container);
                }
                Err(problem) => warnings.push(format!("the .{extension} beside the file is left out: {problem}")),
            }
        }
        keep_overviews(&mut images);
        // A mask belongs to the level of its size. Without its mask a level shows what is masked: where the full one has a
        // mask, levels without are dropped.
        let mut masks = Vec::new();
        let masked = |image: &Image, masks: &[(usize, Image)]| {
            masks.iter().position(|(_, mask)| mask.columns == image.columns && mask.rows == image.rows)
        };
        let main_is_masked = masked(&images[0].1, &loose_masks).is_some();
        images.retain(|(_, image)| !main_is_masked || masked(image, &loose_masks).is_some());
        for level in 0..images.len() {
            masks.push(masked(&images[level].1, &loose_masks).map(|mask| {
                images.push(loose_masks.swap_remove(mask));
                images.len() - 1
            }));
        }
        let levels: Vec<Level> =
            images[..masks.len()].iter().map(|(_, image)| Level { columns: image.columns, rows: image.rows }).collect();
        let mut info = Info {
            format: "GTiff",
            columns: levels[0].columns,
            rows: levels[0].rows,
            nodata: rule.nodata,
            georeference,
            vertical_metres: rule.metres,
            vertical_datum: match (placement.vertical_datum, beside.vertical) {
                (VerticalDatum::Unknown, Some(datum)) => datum,
                (own, _) => own,
            },
            step,
            warnings,
        };
        crate::formats::assume_degrees(&mut info);
        Ok(TiffSource {
            path,
            containers,
            images,
            masks,
            levels,
            info,
            rule,
            cache: VecDeque::new(),
            cached: 0,
            broken: HashSet::new(),
            broken_warning: None,
            first_problem: String::new(),
            missing: HashSet::new(),
            missing_warning: None,
        })
    }

    /// Copies the part of a decoded chunk that lies within the window.
    fn paste(image: &Image, chunk: usize, heights: &[f32], window: Window, out: &mut [f32]) {
        let [columns, rows] = image.extent(chunk);
        let (x, y) = (chunk % image.across * image.chunk[0], chunk / image.across * image.chunk[1]);
        if heights.len() != columns * rows {
            return; // not stored: the window is void there already
        }
        let (left, right) = (x.max(window.column), (x + columns).min(window.column + window.columns));
        let (top, bottom) = (y.max(window.row), (y + rows).min(window.row + window.rows));
        for row in top..bottom {
            let from = (row - y) * columns + left - x;
            let to = (row - window.row) * window.columns + left - window.column;
            out[to..to + right - left].copy_from_slice(&heights[from..from + right - left]);
        }
    }

    /// Keeps a chunk for the next window, and forgets the oldest ones beyond the budget.
    fn keep(&mut self, level: usize, chunk: usize, heights: Vec<f32>) {
        self.cached += heights.len() * 4;
        self.cache.push_back(((level, chunk), heights));
        while self.cached > CACHE && self.cache.len() > 1 {
            self.cached -= self.cache.pop_front().map_or(0, |(_, heights)| heights.len() * 4);
        }
    }

    /// Notes what is wrong with a chunk, in one warning for all of them.
    fn note(&mut self, level: usize, chunk: usize, decoded: &Chunk) {
        let total: usize = self.images.iter().map(|(_, image)| image.across * image.down).sum();
        if let Some(problem) = &decoded.problem
            && self.broken.insert((level, chunk))
        {
            if self.broken.len() == 1 {
                let image = &self.images[level].1;
                let what = if image.tiled { "tile" } else { "strip" };
                let row = chunk / image.across * image.chunk[1];
                let column = chunk % image.across * image.chunk[0];
                self.first_problem = format!("{what} at column {column}, row {row}: {problem}");
            }
            let text = format!(
                "{} of {total} chunks are broken, and void where they cannot be read ({}); get the file again",
                self.broken.len(),
                self.first_problem
            );
            set_warning(&mut self.info.warnings, &mut self.broken_warning, text);
        }
        let sparse = decoded.heights.is_empty() && decoded.problem.is_none() && level < self.levels.len();
        if sparse && self.rule.nodata.is_none() && self.missing.insert((level, chunk)) {
            let text = format!("{} of {total} chunks are not stored in the file and void", self.missing.len());
            set_warning(&mut self.info.warnings, &mut self.missing_warning, text);
        }
    }
}

impl Source for TiffSource {
    fn info(&self) -> &Info {
        &self.info
    }

    fn levels(&self) -> &[Level] {
        &self.levels
    }

    fn block(&self, level: usize) -> [usize; 2] {
        self.images[level].1.chunk
    }

    fn read(&mut self, level: usize, window: Window) -> Result<Vec<f32>, Error> {
        let Level { columns, rows } = self.levels[level];
        let inside = window.column.checked_add(window.columns).is_some_and(|end| end <= columns)
            && window.row.checked_add(window.rows).is_some_and(|end| end <= rows);
        if !inside {
            return Err(Error::content(
                &self.path,
                format!("expected a window within {columns} × {rows} samples, got {window:?}"),
            ));
        }
        let mut heights = self.read_image(level, window, self.rule);
        if let Some(mask) = self.masks[level] {
            let mask = self.read_image(mask, window, VoidRule::default());
            for (height, mask) in heights.iter_mut().zip(mask) {
                // What is not stored of a mask is 0 like what is masked.
                *height = if mask > 0.0 { *height } else { f32::NAN };
            }
        }
        Ok(heights)
    }
}

impl TiffSource {
    /// Samples of a window of a level or a mask; NaN where there are none.
    fn read_image(&mut self, level: usize, window: Window, rule: VoidRule) -> Vec<f32> {
        let mut out = filled(f32::NAN, window.columns * window.rows);
        if out.is_empty() {
            return out;
        }
        let image = &self.images[level].1;
        let across = window.column / image.chunk[0]..(window.column + window.columns).div_ceil(image.chunk[0]);
        let down = window.row / image.chunk[1]..(window.row + window.rows).div_ceil(image.chunk[1]);
        let all = image.across;
        let chunks: Vec<usize> = down.flat_map(|y| across.clone().map(move |x| y * all + x)).collect();

        let cached: HashMap<usize, usize> = (self.cache.iter().enumerate())
            .filter_map(|(place, ((cached, chunk), _))| (*cached == level).then_some((*chunk, place)))
            .collect();
        let mut wanted = Vec::new();
        for &chunk in &chunks {
            match cached.get(&chunk) {
                Some(&place) => Self::paste(image, chunk, &self.cache[place].1, window, &mut out),
                None => wanted.push(chunk),
            }
        }
        let batch = (BATCH / (image.chunk[0] * image.chunk[1] * 4).max(1)).clamp(1, 4096);
        for batch in wanted.chunks(batch) {
            let (container, image) = &self.images[level];
            let file = &self.containers[*container];
            let decoded: Vec<Chunk> = batch
                .par_iter()
                .map_init(
                    || (Scratch::default(), Vec::new(), Vec::new()),
                    |work, &chunk| decode(file, image, chunk, &rule, work),
                )
                .collect();
            for (&chunk, decoded) in batch.iter().zip(decoded) {
                let image = &self.images[level].1;
                Self::paste(image, chunk, &decoded.heights, window, &mut out);
                self.note(level, chunk, &decoded);
                let image = &self.images[level].1;
                let [columns, rows] = image.extent(chunk);
                let (x, y) = (chunk % image.across * image.chunk[0], chunk / image.across * image.chunk[1]);
                let whole = x >= window.column
                    && y >= window.row
                    && x + columns <= window.column + window.columns
                    && y + rows <= window.row + window.rows;
                // A chunk used up whole is not asked for again by anyone who reads in order.
                if !whole && image.compression != Compression::None {
                    self.keep(level, chunk, decoded.heights);
                }
            }
        }
        out
    }
}

/// Puts a warning where it was before, or at the end.
fn set_warning(warnings: &mut Vec<String>, place: &mut Option<usize>, text: String) {
    match *place {
        Some(at) => warnings[at] = text,
        None => {
            *place = Some(warnings.len());
            warnings.push(text);
        }
    }
}

/// A no-data value as GDAL writes it.
fn number(text: &str) -> Option<f64> {
    text.trim_matches([' ', '\0', '\n', '\r', '\t']).parse().ok()
}

/// Sorts overviews from fine to coarse and drops what is none: not smaller, or not of the same shape.
fn keep_overviews(images: &mut Vec<(usize, Image)>) {
    let (columns, rows) = (images[0].1.columns as f64, images[0].1.rows as f64);
    images[1..].sort_by_key(|(_, image)| std::cmp::Reverse(image.columns));
    let mut last = images[0].1.columns;
    let mut first = true;
    images.retain(|(_, image)| {
        if std::mem::take(&mut first) {
            return true;
        }
        let expected = image.columns as f64 * rows / columns;
        // Writers round each size up, down or to the next; an overview of one row may stand for less than one.
        let alike = (image.rows as f64 - expected).abs() <= 1.0 + rows / columns;
        let keep = image.columns < last && alike;
        if keep {
            last = image.columns;
        }
        keep
    });
}

/// Keeps an image of a container, or says why not.
fn push(
    images: &mut Vec<(usize, Image)>,
    container: usize,
    image: Result<Image, String>,
    what: &str,
    warnings: &mut Vec<String>,
) {
    match image {
        Ok(image) => images.push((container, image)),
        Err(problem) => warnings.push(format!("{what} is left out: {problem}")),
    }
}
