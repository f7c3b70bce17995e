//! Whether files belong together, and on which lattice.

use super::tile::{ALIGNED, Tile};
use crate::{Crs, Error, Georeference, Info, VerticalDatum};
use glam::{DAffine2, DVec2};
use littoral::field::Raster;
use std::path::Path;

/// A lattice of more samples is made coarser: even to stream by it would take minutes.
const MOST_SAMPLES: f64 = 1.6e10;

/// Files whose cells differ by less than this factor are blended as equals.
const ALIKE: f64 = 1.5;

/// What becomes of the files.
pub(super) struct Joined {
    /// The mosaic; its warnings are those of joining alone.
    pub info: Info,
    /// The files by spacing, the finest first.
    pub groups: Vec<Vec<usize>>,
    /// The coarsest spacing over the finest.
    pub ratio: f64,
}

/// Checks that files belong together, brings their longitudes together, and finds their lattice.
pub(super) fn join(tiles: &mut [Tile]) -> Result<Joined, Error> {
    let Some(first) = tiles.first() else {
        return Err(Error::content(Path::new("mosaic"), "expected at least one file, got none; name one"));
    };
    // What has no system of its own is taken to be in that of the others.
    let model = tiles.iter().find(|tile| tile.info.georeference.crs != Crs::Unknown).unwrap_or(first);
    let (model_file, model_place) = (model.file.clone(), model.info.georeference.clone());
    let mut warnings = Vec::new();
    for tile in &mut *tiles {
        let own = &tile.info.georeference;
        if own.y_south {
            let problem = format!(
                "expected files that say where they lie, to be joined, got one that does not; place it with `gdal_translate -a_ullr \
                 WEST NORTH EAST SOUTH {} placed.tif`",
                tile.file.display()
            );
            return Err(Error::content(&tile.file, problem));
        }
        if !same_system(&model_place, own) {
            return Err(Error::content(&tile.file, other_system(&model_file, &model_place.crs, &tile.file, &own.crs)));
        }
        if own.crs == Crs::Unknown && model_place.crs != Crs::Unknown {
            let text = "no coordinate system is stated; it is taken to be that of";
            warnings.push(format!("{}: {text} {}", tile.file.display(), model_file.display()));
            tile.info.georeference.crs = model_place.crs.clone();
        } else if own.crs.name() != model_place.crs.name() && matches!(own.crs, Crs::Geographic { .. }) {
            warnings.push(format!(
                "{} is in {} and {} in {}: joined as they stand; where their datums differ they lie up to a few hundred metres apart",
                model_file.display(),
                model_place.crs.name(),
                tile.file.display(),
                own.crs.name()
            ));
        }
        tile.turn_to(model_place.middle());
    }

    // Cells in the system's own units: the root of their area.
    let cells: Vec<f64> = tiles.iter().map(|tile| cell(&tile.info.georeference)).collect();
    let least = cells.iter().copied().fold(f64::INFINITY, f64::min);
    let most = cells.iter().copied().fold(0.0, f64::max);
    let finest = cells.iter().position(|&cell| cell <= least * 1.01).unwrap_or(0);
    let mut order: Vec<usize> = (0..tiles.len()).collect();
    order.sort_by(|&a, &b| cells[a].total_cmp(&cells[b]));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for tile in order {
        match groups.last_mut() {
            Some(group) if cells[tile] <= ALIKE * cells[group[0]] => group.push(tile),
            _ => groups.push(vec![tile]),
        }
    }

    let georeference = lattice(tiles, finest, &mut warnings)?;
    let [columns, rows] = georeference.size;
    let covered: f64 = tiles
        .iter()
        .map(|tile| {
            let [columns, rows] = tile.info.georeference.size;
            columns as f64 * rows as f64 * cell(&tile.info.georeference).powi(2)
        })
        .sum();
    let share = covered / (columns as f64 * rows as f64 * cell(&georeference).powi(2));
    if share < 0.05 {
        warnings.push(format!(
            "the files lie far apart: at most {:.1} % of the ground between them is covered",
            share * 100.0
        ));
    }
    let info = Info {
        format: "Mosaic",
        columns,
        rows,
        nodata: None,
        vertical_metres: common(tiles.iter().map(|tile| tile.info.vertical_metres)).unwrap_or(1.0),
        vertical_datum: datum(tiles, &mut warnings),
        step: tiles.iter().map(|tile| tile.info.step).fold(0.0, f64::max),
        georeference,
        warnings,
    };
    Ok(Joined { info, groups, ratio: most / least })
}

/// The side of a square cell of the same area, in the system's units.
fn cell(georeference: &Georeference) -> f64 {
    georeference.crs_from_sample().matrix2.determinant().abs().sqrt()
}

/// The one value, if there is but one.
fn common(mut values: impl Iterator<Item = f64>) -> Option<f64> {
    let first = values.next()?;
    values.all(|value| value == first).then_some(first)
}

/// Whether coordinates of one file mean the same in the other's system.
fn same_system(a: &Georeference, b: &Georeference) -> bool {
    match (&a.crs, &b.crs) {
        (Crs::Unknown, _) | (_, Crs::Unknown) | (Crs::Geographic { .. }, Crs::Geographic { .. }) => true,
        (Crs::Projected { name, metres, .. }, Crs::Projected { name: other, metres: others, .. }) => {
            // One system has many names: what decides is where a place comes out, to a twentieth of a cell.
            (name == other && metres == others)
                || [DVec2::ZERO, b.size.map(|n| n as f64 - 1.0).into()].into_iter().all(|sample| {
                    let at = b.crs_from_sample().transform_point2(sample);
                    let there = b.lonlat_from_crs(at).and_then(|lonlat| a.crs_from_lonlat(lonlat));
                    there.is_ok_and(|there| (there - at).length() < 0.05 * cell(b))
                })
        }
        _ => false,
    }
}

/// What to do about a file in another system.
fn other_system(model_file: &Path, model: &Crs, file: &Path, crs: &Crs) -> String {
    let target = match model {
        Crs::Projected { definition: Some(words), name, .. } if !name.starts_with("EPSG:") => words,
        crs => crs.name(),
    };
    let target = if target.starts_with("EPSG:") { target.to_owned() } else { format!("'{target}'") };
    format!(
        "expected coordinates in {}, as in {}, got {}; convert it with `gdalwarp -t_srs {target} -r bilinear {} converted.tif`",
        model.name(),
        model_file.display(),
        crs.name(),
        file.display()
    )
}

/// The lattice of one file carried on over all of them, or a coarser one if that has too many samples.
fn lattice(tiles: &[Tile], finest: usize, warnings: &mut Vec<String>) -> Result<Georeference, Error> {
    let model = &tiles[finest].info.georeference;
    let samples_from_crs = model.crs_from_sample().inverse();
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for tile in tiles {
        let own = &tile.info.georeference;
        let map: DAffine2 = samples_from_crs * own.crs_from_sample();
        let last: DVec2 = own.size.map(|n| n as f64 - 1.0).into();
        for corner in [DVec2::ZERO, DVec2::new(last.x, 0.0), DVec2::new(0.0, last.y), last] {
            let at = map.transform_point2(corner);
            (low, high) = (low.min(at), high.max(at));
        }
    }
    let (low, high) = ((low - ALIGNED).ceil(), (high + ALIGNED).floor());
    let size = high - low + 1.0;
    if !size.is_finite() || size.min_element() < 2.0 {
        let problem = format!("expected files that span at least 2 × 2 samples together, got {} × {}", size.x, size.y);
        return Err(Error::content(&tiles[finest].file, problem));
    }
    let mut factor = 1.0;
    while (size / factor).max_element() > Raster::MAX_SIDE as f64 || (size / factor).element_product() > MOST_SAMPLES {
        factor *= 2.0;
    }
    let [columns, rows] = (size / factor).ceil().max(DVec2::splat(2.0)).to_array();
    let [x, a, b, y, d, e] = model.geotransform;
    let geotransform =
        [x + a * low.x + b * low.y, a * factor, b * factor, y + d * low.x + e * low.y, d * factor, e * factor];
    if factor > 1.0 {
        warnings.push(format!(
            "{} × {} cells as fine as those of {} are too many: the files are joined in cells {factor} times as wide",
            size.x,
            size.y,
            tiles[finest].file.display()
        ));
    }
    Ok(Georeference { geotransform, size: [columns as usize, rows as usize], ..model.clone() })
}

/// What the heights are counted from, together.
fn datum(tiles: &[Tile], warnings: &mut Vec<String>) -> VerticalDatum {
    let mut names: Vec<(&str, &Path)> = Vec::new();
    for tile in tiles {
        if let VerticalDatum::Named(name) = &tile.info.vertical_datum
            && names.iter().all(|(other, _)| other != name)
        {
            names.push((name, &tile.file));
        }
    }
    if names.len() > 1 {
        let said: Vec<String> = names.iter().map(|(name, file)| format!("{name} in {}", file.display())).collect();
        warnings.push(format!("heights are counted from {}: they are joined as they stand", said.join(", ")));
    }
    match names.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" and ") {
        none if none.is_empty() => VerticalDatum::Unknown,
        name => VerticalDatum::Named(name),
    }
}
