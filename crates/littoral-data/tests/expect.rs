//! Every file of a collection of formats against GDAL's reading of it (`EXPECT.tsv`), and what files say of each other. The
//! collection is not part of the project: without `../shared/data` these tests pass and say so.

use littoral::field::Window;
use littoral_data::formats::{Input, open_input};
use littoral_data::{Crs, Info, VerticalDatum, open};
use std::path::{Path, PathBuf};

fn data() -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    if !path.is_dir() {
        println!("../shared/data is absent: nothing is compared");
        return None;
    }
    Some(path.to_owned())
}

/// A whole file's heights, in its order.
fn read(path: &Path) -> (Info, Vec<f32>) {
    let mut source = open(path).unwrap_or_else(|e| panic!("{e}"));
    let level = source.levels()[0];
    let window = Window { column: 0, row: 0, columns: level.columns, rows: level.rows };
    let heights = source.read(0, window).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(heights.len(), level.columns * level.rows);
    (source.info().clone(), heights)
}

/// Rows in which our reading differs from GDAL's on purpose: (file, voids of ours, lowest and highest of ours, why).
const DIFFERENT: [(&str, usize, f64, f64, &str); 1] =
    [("ok/i16_undeclared_void_-32768.tif", 560, 1166.0, 2543.0, "-32768 is void though the file does not say so")];

#[test]
fn every_row_of_expect() {
    let Some(data) = data() else { return };
    let table = std::fs::read_to_string(data.join("formats/EXPECT.tsv")).expect("EXPECT.tsv");
    let mut failures = Vec::new();
    let mut rows = 0;
    for line in table.lines().skip(1) {
        rows += 1;
        let fields: Vec<&str> = line.split('\t').collect();
        compare(&data.join("formats"), &fields, &mut failures);
    }
    println!("{rows} rows compared");
    assert!(rows >= 40, "only {rows} rows in the table");
    assert!(failures.is_empty(), "{} differences in {rows} rows:\n{}", failures.len(), failures.join("\n"));
}

/// One row: file, driver, size, bands, type, block, compression, no-data, voids, lowest, highest, first, centre, last, scale,
/// overviews, geotransform, checksum. Samples are raw there, before scale and offset.
fn compare(folder: &Path, fields: &[&str], failures: &mut Vec<String>) {
    let [file, driver, columns, rows] = [fields[0], fields[1], fields[2], fields[3]];
    let mut fail = |what: String| failures.push(format!("{file}: {what}"));
    let mut source = match open(&folder.join(file)) {
        Ok(source) => source,
        Err(e) => return fail(e.to_string()),
    };
    let survey = match littoral_data::survey(source.as_mut(), &|_| ()) {
        Ok(survey) => survey,
        Err(e) => return fail(e.to_string()),
    };
    let info = source.info();
    if [info.columns.to_string(), info.rows.to_string()] != [columns, rows] {
        fail(format!("size {} × {}", info.columns, info.rows));
    }
    if !info.format.starts_with(driver) {
        fail(format!("format {}", info.format));
    }
    let place: Vec<f64> = fields[17].split(' ').filter_map(|f| f.parse().ok()).collect();
    for (index, (ours, theirs)) in info.georeference.geotransform.iter().zip(place).enumerate() {
        // The table has six digits.
        if (ours - theirs).abs() > 6e-6 * theirs.abs().max(1e-9) {
            fail(format!("geotransform[{index}] {ours}, expected {theirs}"));
        }
    }
    let number = |index: usize| fields[index].parse::<f64>().unwrap_or(f64::NAN);
    let scale: Vec<f64> = fields[15].split(',').filter_map(|f| f.parse().ok()).collect();
    let [scale, offset] = if let [scale, offset] = scale[..] { [scale, offset] } else { [1.0, 0.0] };
    let near = |ours: Option<f32>, raw: f64| {
        let theirs = raw * scale + offset;
        ours.is_some_and(|ours| (f64::from(ours) - theirs).abs() <= 6e-6 * theirs.abs().max(scale))
    };
    let [low, high] = [survey.min, survey.max];
    if let Some((_, our_void, our_low, our_high, why)) = DIFFERENT.iter().find(|d| d.0 == file) {
        println!("{file} differs on purpose: {why}");
        if survey.void != *our_void as u64
            || low.map(f64::from) != Some(*our_low)
            || high.map(f64::from) != Some(*our_high)
        {
            fail(format!("{} voids, {low:?} … {high:?}, expected {our_void}, {our_low} … {our_high}", survey.void));
        }
        return;
    }
    if survey.void as f64 != number(9) || !near(low, number(10)) || !near(high, number(11)) {
        fail(format!(
            "{} voids, {low:?} … {high:?}, expected {}, {} … {}",
            survey.void, fields[9], fields[10], fields[11]
        ));
    }
    let samples = [survey.first, survey.centre, survey.last].into_iter().zip([number(12), number(13), number(14)]);
    for (which, (ours, raw)) in samples.enumerate() {
        // GDAL takes a PNG's transparent grey, here zero, for no-data; zero is the sea.
        let void = raw.is_nan() || raw == number(8) && driver != "PNG";
        if ours.is_none() != void || !void && !near(ours, raw) {
            fail(format!("sample {which} is {ours:?}, expected {raw}"));
        }
    }
}

#[test]
fn everything_that_is_land_opens() {
    let Some(data) = data() else { return };
    let mut count = 0;
    let mut failures = Vec::new();
    for folder in ["formats/ok", "formats/real", "core", "mountain", "coast", "tiles", "global"] {
        for entry in std::fs::read_dir(data.join(folder)).expect("a folder").flatten() {
            let path = entry.path();
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let land = "tif tiff asc bil img hdr nc grd png ter xyz dem tt2 gz zip r16";
            if !land.split(' ').any(|known| known == extension) {
                continue;
            }
            count += 1;
            let read = open(&path).and_then(|mut source| {
                let level = source.levels()[0];
                source.read(0, Window { column: 0, row: level.rows / 2, columns: level.columns, rows: 1 })
            });
            if let Err(e) = read {
                failures.push(e.to_string());
            }
        }
    }
    println!("{count} files opened");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn tiles_hold_the_crop_they_were_made_of() {
    let Some(data) = data() else { return };
    let (land, heights) = read(&data.join("core/st_helens_30m.tif"));
    for (file, format, tolerance) in [
        ("core/st_helens_terrarium_256.png", "PNG (Terrarium)", 1.0 / 256.0),
        ("tiles/st_helens_terrain_rgb_256.png", "PNG (Terrain-RGB)", 0.05 + 1e-3),
    ] {
        let (tile, got) = read(&data.join(file));
        assert_eq!(tile.format, format);
        assert_eq!([tile.columns, tile.rows], [256, 256]);
        let fits = |column: usize, row: usize| {
            (0..256 * 256).all(|i| {
                let theirs = heights[(row + i / 256) * land.columns + column + i % 256];
                (theirs - got[i]).abs() <= tolerance || theirs.is_nan() && got[i].is_nan()
            })
        };
        let mut places = (0..=land.rows - 256).flat_map(|r| (0..=land.columns - 256).map(move |c| (c, r)));
        let place = places.find(|&(c, r)| fits(c, r));
        println!("{file} is the crop at {place:?}");
        assert!(place.is_some(), "{file} is nowhere in the land");
    }
}

#[test]
fn packed_and_unpacked_agree() {
    let Some(data) = data() else { return };
    let (gzip, a) = read(&data.join("tiles/N19W156.hgt.gz"));
    let (zip, b) = read(&data.join("tiles/N19W156.SRTMGL3.hgt.zip"));
    assert!(a.iter().zip(&b).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));
    assert_eq!(gzip, zip);
    let valid = a.iter().filter(|h| h.is_finite()).count();
    assert!(valid > a.len() / 50 && valid < a.len() / 10, "95 % is void: {valid} of {}", a.len());
    let georeference = gzip.georeference;
    assert!((georeference.geotransform[0] + 156.0 + 0.5 / 1200.0).abs() < 1e-12);
    assert!((georeference.geotransform[3] - 20.0 - 0.5 / 1200.0).abs() < 1e-12);
    assert!(matches!(georeference.crs, Crs::Geographic { .. }));
    assert_eq!(gzip.vertical_datum, VerticalDatum::Named("EGM96".into()));
}

#[test]
fn usgs_dem_is_its_translation() {
    let Some(data) = data() else { return };
    let (dem, a) = read(&data.join("mountain/SainteHelens.dem"));
    assert_eq!([dem.columns, dem.rows], [327, 468]);
    assert_eq!(dem.georeference.geotransform, [557_805.0, 30.0, 0.0, 5_122_005.0, 0.0, -30.0]);
    let (tif, b) = read(&data.join("core/st_helens_30m.tif"));
    // The translation may be a crop: compared where both have places.
    let offset = |axis: usize, step: f64| {
        ((tif.georeference.geotransform[axis] - dem.georeference.geotransform[axis]) / step).round() as isize
    };
    let [right, down] = [offset(0, 30.0), offset(3, -30.0)];
    let mut compared = 0;
    for row in 0..tif.rows {
        for column in 0..tif.columns {
            let [c, r] = [column as isize + right, row as isize + down];
            if (0..dem.columns as isize).contains(&c) && (0..dem.rows as isize).contains(&r) {
                let [theirs, ours] = [b[row * tif.columns + column], a[r as usize * dem.columns + c as usize]];
                assert!(
                    theirs == ours || theirs.is_nan() && ours.is_nan(),
                    "({column}, {row}): {ours}, expected {theirs}"
                );
                compared += 1;
            }
        }
    }
    println!("{compared} samples compared");
    assert!(compared > 50_000);
}

#[test]
fn samples_of_a_name_are_the_png() {
    let Some(data) = data() else { return };
    let (raw, a) = read(&data.join("formats/ok/raw_u16le_160x120.r16"));
    let (_, b) = read(&data.join("formats/ok/png16_grey.png"));
    assert_eq!(a, b);
    assert!(raw.warnings[0].contains("160 × 120"));
}

#[test]
fn windows_are_cut_from_the_whole() {
    let Some(data) = data() else { return };
    let files = [
        "formats/ok/ehdr.bil",
        "formats/ok/envi_f32.img",
        "formats/ok/nc3_classic.nc",
        "formats/ok/surfer_ascii.grd",
        "formats/ok/terragen.ter",
        "mountain/colorado_30s_gtopo30.nc",
        "mountain/SainteHelens.dem",
        "formats/ok/png16_grey.png",
    ];
    for file in files {
        let path = data.join(file);
        let (info, whole) = read(&path);
        let mut source = open(&path).expect("opens");
        for (column, row, columns, rows) in [(0, 0, 1, 1), (3, 5, 7, 11), (info.columns - 2, info.rows - 3, 2, 3)] {
            let part = source.read(0, Window { column, row, columns, rows }).expect("reads");
            for (index, height) in part.iter().enumerate() {
                let expected = whole[(row + index / columns) * info.columns + column + index % columns];
                assert!(*height == expected || height.is_nan() && expected.is_nan(), "{file}");
            }
        }
    }
}

#[test]
fn memory_and_disk_agree() {
    let Some(data) = data() else { return };
    for file in
        ["formats/ok/surfer_ascii.grd", "mountain/kilauea_30m_utm5.nc", "formats/ok/xyz.xyz", "tiles/N19W156.hgt.gz"]
    {
        let path = data.join(file);
        let (info, whole) = read(&path);
        let input = Input::memory(path.clone(), std::fs::read(&path).expect("reads"));
        let mut source = open_input(input).expect("opens");
        assert_eq!(*source.info(), info);
        let window = Window { column: 0, row: 0, columns: info.columns, rows: info.rows };
        let same = source.read(0, window).expect("reads");
        assert!(same.iter().zip(&whole).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
