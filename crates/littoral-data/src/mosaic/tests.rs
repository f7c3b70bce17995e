use super::*;
use crate::formats::info;
use crate::{Crs, LoadOptions, MemorySource, Registration, load_from};
use glam::DVec2;

fn metres() -> Crs {
    Crs::from_epsg(32610).expect("UTM zone 10")
}

/// Columns and rows of cells of a size from a north-western corner, each height by its coordinates.
fn tile(corner: [f64; 2], cell: f64, size: [usize; 2], height: impl Fn(DVec2) -> f32) -> MemorySource {
    let [columns, rows] = size;
    let mut info = info("GTiff", columns, rows);
    info.georeference = Georeference {
        geotransform: [corner[0], cell, 0.0, corner[1], 0.0, -cell],
        registration: Registration::Area,
        crs: metres(),
        size,
        y_south: false,
    };
    let place = info.georeference.crs_from_sample();
    let at = |i: usize| place.transform_point2(DVec2::new((i % columns) as f64, (i / columns) as f64));
    let heights = (0..columns * rows).map(|i| height(at(i))).collect();
    MemorySource::new(info, heights)
}

fn joined(tiles: Vec<MemorySource>) -> Mosaic {
    try_joined(tiles).unwrap_or_else(|error| panic!("{error}"))
}

fn try_joined(tiles: Vec<MemorySource>) -> Result<Mosaic, Error> {
    let named = |(i, tile): (usize, MemorySource)| (format!("{i}.tif").into(), Box::new(tile) as Box<dyn Source>);
    Mosaic::new(tiles.into_iter().enumerate().map(named).collect())
}

fn all(mosaic: &mut Mosaic) -> Vec<f32> {
    let Level { columns, rows } = mosaic.levels()[0];
    mosaic.read(0, Window { column: 0, row: 0, columns, rows }).expect("reads")
}

/// A height that no float rounds, so that differences show.
fn plane(at: DVec2) -> f32 {
    (1000.0 + 0.5 * (at.x - 500_000.0) - 0.25 * (at.y - 5_000_000.0)) as f32
}

fn is_the_plane(mosaic: &mut Mosaic, tolerance: f32) {
    let place = mosaic.info().georeference.crs_from_sample();
    let columns = mosaic.info().columns;
    for (i, height) in all(mosaic).into_iter().enumerate() {
        let expected = plane(place.transform_point2(DVec2::new((i % columns) as f64, (i / columns) as f64)));
        assert!((height - expected).abs() <= tolerance, "sample {i}: expected {expected}, got {height}");
    }
}

#[test]
fn a_plane_in_parts_is_the_plane() {
    let part = |x: f64, y: f64, columns, rows| tile([500_000.0 + x, 5_000_000.0 - y], 10.0, [columns, rows], plane);
    for parts in [
        // Side by side, one above the other, overlapping, sharing a row, four with a cross of overlaps, one within another.
        vec![(0.0, 0.0, 20, 30), (200.0, 0.0, 25, 30)],
        vec![(0.0, 0.0, 20, 30), (0.0, 300.0, 20, 7)],
        vec![(0.0, 0.0, 20, 30), (130.0, 0.0, 25, 30)],
        vec![(0.0, 0.0, 20, 30), (0.0, 290.0, 20, 30)],
        vec![(0.0, 0.0, 20, 20), (150.0, 0.0, 20, 20), (0.0, 150.0, 20, 20), (150.0, 150.0, 20, 20)],
        vec![(0.0, 0.0, 40, 40), (150.0, 110.0, 8, 9)],
    ] {
        for turn in 0..parts.len() {
            let mut parts = parts.clone();
            parts.rotate_left(turn);
            let mut mosaic = joined(parts.iter().map(|&(x, y, c, r)| part(x, y, c, r)).collect());
            is_the_plane(&mut mosaic, 0.0);
            assert_eq!(mosaic.info().warnings, [""; 0]);
        }
    }
}

#[test]
fn other_spacings_and_phases_meet_without_a_gap() {
    let part =
        |x: f64, y: f64, cell: f64, columns, rows| tile([500_000.0 + x, 5_000_000.0 - y], cell, [columns, rows], plane);
    // A third of a cell off; three times as coarse, beside and around; a fine one that the lattice has no room for.
    let mut off = joined(vec![part(0.0, 0.0, 10.0, 20, 30), part(203.0, 0.0, 10.0, 25, 30)]);
    is_the_plane(&mut off, 1e-3);
    let mut beside = joined(vec![part(0.0, 0.0, 30.0, 20, 20), part(600.0, 0.0, 10.0, 30, 60)]);
    assert_eq!(beside.info().georeference.geotransform[1], 10.0);
    // The coarse file's outer pixels reach farther than its samples; only those are in the lattice.
    is_the_plane(&mut beside, 1e-3);
    let mut around = joined(vec![part(0.0, 0.0, 90.0, 20, 20), part(600.0, 500.0, 10.0, 60, 60)]);
    is_the_plane(&mut around, 1e-3);
}

#[test]
fn a_turned_or_flipped_file_is_laid_the_same_way() {
    let mut flipped = tile([500_000.0, 4_999_600.0], 10.0, [40, 40], |_| 0.0);
    let mut info = flipped.info().clone();
    info.georeference.geotransform = [500_000.0, 10.0, 0.0, 4_999_400.0, 0.0, 10.0];
    let place = info.georeference.crs_from_sample();
    let heights =
        (0..1600).map(|i| plane(place.transform_point2(DVec2::new((i % 40) as f64, (i / 40) as f64)))).collect();
    flipped = MemorySource::new(info, heights);
    let north = tile([500_000.0, 5_000_000.0], 10.0, [40, 40], plane);
    let mut mosaic = joined(vec![north, flipped]);
    assert_eq!([mosaic.info().columns, mosaic.info().rows], [40, 60]);
    is_the_plane(&mut mosaic, 0.0);
}

#[test]
fn a_step_between_overlapping_files_is_spread_over_the_overlap() {
    // Up to half a file's width the share of a file runs straight from border to border; beyond, it bends.
    for (overlap, steepest) in [(1, 20.0), (2, 20.0), (20, 2.0), (30, 1.34), (50, 3.0)] {
        let low = tile([500_000.0, 5_000_000.0], 10.0, [60, 20], |_| 100.0);
        let high = tile([500_600.0 - 10.0 * overlap as f64, 5_000_000.0], 10.0, [60, 20], |_| 140.0);
        let mut mosaic = joined(vec![low, high]);
        let columns = 120 - overlap;
        for row in all(&mut mosaic).chunks_exact(columns) {
            assert_eq!((row[0], row[columns - 1], row[59 - overlap], row[60]), (100.0, 140.0, 100.0, 140.0));
            for pair in row.windows(2) {
                assert!((0.0..=steepest * 1.001).contains(&(pair[1] - pair[0])), "{overlap}: {pair:?}");
            }
        }
    }
}

#[test]
fn a_finer_file_hides_the_coarser_but_at_its_borders() {
    let coarse = tile([500_000.0, 5_000_000.0], 30.0, [100, 100], |_| 100.0);
    let fine = tile([501_000.0, 4_999_000.0], 10.0, [100, 100], |_| 132.0);
    let mut mosaic = joined(vec![coarse, fine]);
    let columns = mosaic.info().columns;
    let heights = all(&mut mosaic);
    let place = mosaic.info().georeference.crs_from_sample().inverse();
    let at = |x: f64, y: f64| {
        let sample = place.transform_point2(DVec2::new(x, y)).round();
        heights[sample.y as usize * columns + sample.x as usize]
    };
    assert_eq!(at(501_505.0, 4_998_505.0), 132.0);
    assert_eq!(at(500_905.0, 4_998_505.0), 100.0);
    for line in heights.chunks_exact(columns) {
        for pair in line.windows(2) {
            assert!((pair[1] - pair[0]).abs() <= 32.0 / 16.0 + 1e-3, "{pair:?}");
        }
    }
}

#[test]
fn voids_are_filled_by_others_without_an_edge_and_never_bridged() {
    let hole = |at: DVec2| (at - DVec2::new(500_400.0, 4_999_600.0)).length() < 105.0;
    let a = |at: DVec2| if hole(at) { f32::NAN } else { 100.0 };
    let whole = || tile([500_000.0, 5_000_000.0], 10.0, [80, 80], |_| 108.0);
    let holed = || tile([500_000.0, 5_000_000.0], 10.0, [80, 80], a);
    for tiles in [vec![whole(), holed()], vec![holed(), whole()]] {
        let heights = all(&mut joined(tiles));
        assert_eq!(heights[40 * 80 + 40], 108.0);
        assert_eq!(heights[0], 104.0);
        for line in heights.chunks_exact(80) {
            for pair in line.windows(2) {
                assert!((pair[1] - pair[0]).abs() <= 0.5, "{pair:?}");
            }
        }
    }
    // A void of both is void; one row of void between two files is not bridged.
    let heights = all(&mut joined(vec![holed(), holed()]));
    assert_eq!(
        heights.iter().filter(|h| h.is_nan()).count(),
        all(&mut joined(vec![holed()])).iter().filter(|h| h.is_nan()).count()
    );
    let north = tile([500_000.0, 5_000_000.0], 10.0, [20, 20], plane);
    let south = tile([500_000.0, 4_999_790.0], 10.0, [20, 20], plane);
    let heights = all(&mut joined(vec![north, south]));
    assert!(heights[20 * 20..21 * 20].iter().all(|h| h.is_nan()));
    assert_eq!(heights.iter().filter(|h| h.is_nan()).count(), 20);
    // Bilinear samples do not reach over a void.
    let off = tile([500_203.0, 5_000_000.0], 10.0, [20, 20], |at| if at.x < 500_250.0 { f32::NAN } else { 1.0 });
    let heights = all(&mut joined(vec![tile([500_000.0, 5_000_000.0], 10.0, [20, 20], |_| 1.0), off]));
    assert!(heights[20..26].iter().all(|h| h.is_nan()), "{:?}", &heights[18..30]);
    assert_eq!(heights[26], 1.0);
}

#[test]
fn windows_are_parts_of_the_whole() {
    let rough = |at: DVec2| ((at.x * 0.013).sin() * 50.0 + (at.y * 0.017).cos() * 30.0) as f32;
    let hole = move |at: DVec2| {
        if (at.x - 500_500.0).abs() + (at.y - 4_999_400.0).abs() < 90.0 { f32::NAN } else { rough(at) }
    };
    let mut mosaic = joined(vec![
        tile([500_000.0, 5_000_000.0], 10.0, [70, 90], hole),
        tile([500_503.0, 4_999_896.0], 10.0, [70, 90], move |at| rough(at) + 5.0),
        tile([499_900.0, 5_000_100.0], 45.0, [40, 40], move |at| rough(at) - 7.0),
    ]);
    let whole = all(&mut mosaic);
    let Level { columns, rows } = mosaic.levels()[0];
    for (column, row, w, h) in
        [(0, 0, columns, 1), (10, 20, 50, 40), (60, 31, 1, 90), (40, 0, 33, rows), (columns - 1, rows - 1, 1, 1)]
    {
        let part = mosaic.read(0, Window { column, row, columns: w, rows: h }).expect("reads");
        for (i, height) in part.into_iter().enumerate() {
            let expected = whole[(row + i / w) * columns + column + i % w];
            assert!(
                height.to_bits() == expected.to_bits() || height.is_nan() && expected.is_nan(),
                "{i} of {w} × {h} at {column}, {row}"
            );
        }
    }
}

/// A source with overviews: every second sample's mean.
struct Pyramid(MemorySource, [Level; 2], Vec<f32>);

impl Source for Pyramid {
    fn info(&self) -> &Info {
        self.0.info()
    }

    fn levels(&self) -> &[Level] {
        &self.1
    }

    fn read(&mut self, level: usize, window: Window) -> Result<Vec<f32>, Error> {
        if level == 0 {
            return self.0.read(0, window);
        }
        let line = |row: usize| &self.2[row * self.1[1].columns..][window.column..window.column + window.columns];
        Ok((window.row..window.row + window.rows).flat_map(line).copied().collect())
    }
}

#[test]
fn overviews_are_read_where_all_files_have_them() {
    let pyramid = |x: f64| {
        let mut full = tile([500_000.0 + x, 5_000_000.0], 10.0, [40, 30], plane);
        let fine = full.read(0, Window { column: 0, row: 0, columns: 40, rows: 30 }).expect("reads");
        let mut reducer = crate::reduce::Reducer::new(40, 30, 20, 15);
        reducer.push(&fine);
        Pyramid(full, [Level { columns: 40, rows: 30 }, Level { columns: 20, rows: 15 }], reducer.into_heights())
    };
    let sources = |tiles: Vec<Box<dyn Source>>| {
        Mosaic::new(tiles.into_iter().map(|tile| ("a.tif".into(), tile)).collect()).expect("joins")
    };
    let mut mosaic = sources(vec![Box::new(pyramid(0.0)), Box::new(pyramid(400.0))]);
    assert_eq!(mosaic.levels(), [Level { columns: 80, rows: 30 }, Level { columns: 40, rows: 15 }]);
    let coarse = mosaic.read(1, Window { column: 0, row: 0, columns: 40, rows: 15 }).expect("reads");
    let place = mosaic.info().georeference.resized(40, 15).crs_from_sample();
    for (i, height) in coarse.into_iter().enumerate() {
        let expected = plane(place.transform_point2(DVec2::new((i % 40) as f64, (i / 40) as f64)));
        assert!((height - expected).abs() < 1e-3, "{i}: expected {expected}, got {height}");
    }
    let bare = tile([500_800.0, 5_000_000.0], 10.0, [40, 30], plane);
    let mosaic = sources(vec![Box::new(pyramid(0.0)), Box::new(pyramid(400.0)), Box::new(bare)]);
    assert_eq!(mosaic.levels().len(), 1);
}

#[test]
fn a_file_too_fine_for_the_lattice_is_averaged_down() {
    let mut fine =
        Tile::new("fine.tif".into(), Box::new(tile([500_000.0, 5_000_000.0], 1.0, [101, 70], plane)), Reopen::Never)
            .expect("large enough");
    let lattice = tile([500_000.0, 5_000_000.0], 10.0, [11, 7], plane).info().georeference.clone();
    let patch =
        fine.patch(&lattice, Window { column: 0, row: 0, columns: 11, rows: 7 }).expect("reads").expect("meets");
    let mut heights = vec![f32::NAN; 77];
    patch.paste(Window { column: 0, row: 0, columns: 11, rows: 7 }, &mut heights);
    let place = lattice.crs_from_sample();
    for (i, height) in heights.into_iter().enumerate().filter(|(i, _)| i % 11 < 10) {
        let expected = plane(place.transform_point2(DVec2::new((i % 11) as f64, (i / 11) as f64)));
        assert!((height - expected).abs() < 1e-2, "{i}: expected {expected}, got {height}");
    }
}

#[test]
fn what_does_not_belong_together_is_said() {
    let error = |tiles| try_joined(tiles).err().expect("they do not belong together").to_string();
    let here = || tile([500_000.0, 5_000_000.0], 10.0, [4, 4], plane);
    let of = |crs: Option<Crs>| {
        let source = here();
        let mut info = source.info().clone();
        match crs {
            Some(crs) => info.georeference.crs = crs,
            None => info.georeference = Georeference::none(4, 4),
        }
        MemorySource::new(info, vec![1.0; 16])
    };
    let zone = error(vec![here(), of(Crs::from_epsg(32611))]);
    assert!(zone.contains("1.tif: expected coordinates in EPSG:32610, as in 0.tif, got EPSG:32611"), "{zone}");
    assert!(zone.contains("gdalwarp -t_srs EPSG:32610 -r bilinear 1.tif"), "{zone}");
    assert!(error(vec![here(), of(Crs::from_epsg(4326))]).contains("got EPSG:4326"));
    assert!(error(vec![here(), of(None)]).contains("where they lie"));
    assert!(error(Vec::new()).contains("at least one"));
    // One system under two names; none at all, beside one that is named; two geographic ones.
    let own = Crs::from_proj("+proj=utm +zone=10 +datum=WGS84 +units=m +no_defs");
    assert!(try_joined(vec![here(), of(Some(own))]).is_ok());
    let silent = try_joined(vec![of(Some(Crs::Unknown)), here()]).expect("joins");
    assert_eq!(silent.info().georeference.crs, metres());
    assert!(silent.info().warnings[0].contains("taken to be that of 1.tif"));
}

#[test]
fn longitudes_meet_across_the_date_line() {
    let degrees = |west: f64| {
        let source = tile([west, 1.0], 0.1, [10, 10], |_| 5.0);
        let mut info = source.info().clone();
        info.georeference.crs = Crs::Geographic { name: "EPSG:4326".into() };
        MemorySource::new(info, vec![5.0; 100])
    };
    for west in [[179.0, -180.0], [-180.0, 179.0], [179.0, 180.0], [-181.0, -180.0]] {
        let mosaic = joined(west.into_iter().map(degrees).collect());
        assert_eq!([mosaic.info().columns, mosaic.info().rows], [20, 10], "{west:?}");
    }
}

#[test]
fn far_apart_and_far_too_fine() {
    let here = tile([500_000.0, 5_000_000.0], 0.5, [40, 40], plane);
    let far = tile([100_000.0, 9_000_000.0], 0.5, [40, 40], plane);
    let mut mosaic = joined(vec![here, far]);
    let warnings = mosaic.info().warnings.join("\n");
    assert!(warnings.contains("too many") && warnings.contains("far apart"), "{warnings}");
    let Level { columns, rows } = mosaic.levels()[0];
    assert!((columns * rows) as f64 <= 1.7e10);
    let last = mosaic.read(0, Window { column: columns - 3, row: rows - 3, columns: 3, rows: 3 }).expect("reads");
    assert!(last.iter().any(|height| !height.is_nan()), "{last:?}");
}

#[test]
fn files_are_opened_again_and_their_warnings_gathered() {
    use crate::write::{GridSamples, geotiff};
    let folder = tempfile::tempdir().expect("a folder");
    let files: Vec<PathBuf> = (0..MOST_OPEN + 3)
        .map(|i| {
            let source = tile([500_000.0 + 40.0 * i as f64, 5_000_000.0], 10.0, [4, 4], plane);
            let file = folder.path().join(format!("{i}.tif"));
            let place = &source.info().georeference;
            let at = |i: usize| place.crs_from_sample().transform_point2(DVec2::new((i % 4) as f64, (i / 4) as f64));
            let heights: Vec<f32> = (0..16).map(|i| plane(at(i))).collect();
            geotiff(&file, place, None, GridSamples::F32(&heights), None, "").expect("written");
            file
        })
        .collect();
    let mut source = open_all(&files, None).expect("opens");
    for _ in 0..2 {
        let dem = load_from(&mut *source, &name_of_all(&files), LoadOptions { most_samples: 1 << 20 }, &|_| {})
            .expect("loads");
        assert!(dem.raster.heights().iter().all(|h| !h.is_nan()));
        assert_eq!((dem.raster.columns(), dem.raster.rows()), (4 * files.len(), 4));
    }
    std::fs::remove_file(&files[0]).expect("removed");
    let gone = load_from(&mut *source, "x".as_ref(), LoadOptions { most_samples: 1 << 20 }, &|_| {});
    assert!(gone.expect_err("gone").to_string().contains("0.tif"));
    assert_eq!(name_of_all(&files[1..3]).to_string_lossy().matches(" + ").count(), 1);
    assert!(name_of_all(&files).ends_with(format!("0.tif + {} more", files.len() - 1)));
}
