//! Files that are broken, hostile or empty: each gives an error that says why, or a partial read with a warning; soon, and in
//! memory that the file justifies. The collection is not part of the project: without `../shared/data` this passes and says so.

use littoral_data::{LoadOptions, load, open, survey};
use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

/// Counts what is allocated, now and at most.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged; counting touches only atomics.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        MOST.fetch_max(NOW.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: the caller keeps the promises of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        MOST.fetch_max(NOW.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: the caller keeps the promises of `alloc_zeroed`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the promises of `dealloc`.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

enum Expected {
    /// An error with one of these words.
    Error(&'static [&'static str]),
    /// A warning with one of these words.
    Warning(&'static [&'static str]),
    /// An error or a warning with one of these words.
    Either(&'static [&'static str]),
    /// Opens, and need not say anything.
    Opens,
}

use Expected::*;

/// What `BAD.tsv` asks of each file, in our words.
const FILES: [(&str, Expected); 36] = [
    ("empty.tif", Error(&["empty"])),
    ("header_only.tif", Error(&["past", "beyond", "end", "cut off", "directory"])),
    ("text_named.tif", Error(&["begins with"])),
    ("truncated_last_tile.tif", Either(&["void", "cut off", "missing", "beyond"])),
    ("ifd_offset_huge.tif", Error(&["past", "beyond", "end", "cut off", "directory"])),
    ("ifd_offset_zero.tif", Error(&["directory"])),
    ("ifd_cycle.tif", Opens),
    ("width_height_overflow.tif", Error(&["×", "samples", "overflow"])),
    ("width_height_bomb_65535.tif", Error(&["strip", "65535"])),
    ("compression_unknown.tif", Error(&["65000"])),
    ("compression_jpeg.tif", Error(&["JPEG"])),
    ("predictor3_on_int16.tif", Error(&["floating"])),
    ("sampleformat_unknown.tif", Error(&["9"])),
    ("sampleformat_complex.tif", Error(&["complex"])),
    ("bits_17.tif", Error(&["17"])),
    ("tilewidth_zero.tif", Error(&["tile"])),
    ("tilewidth_huge.tif", Error(&["tile"])),
    ("tile_bytecount_huge.tif", Either(&["void", "tile", "block"])),
    ("zstd_bad_magic_tile0.tif", Either(&["void", "tile", "block", "zstd"])),
    ("bigtiff_ifd_2e63.tif", Error(&["past", "beyond", "end", "cut off", "directory"])),
    ("f32_all_nodata.tif", Opens),
    ("asc_extra.asc", Warning(&["3 too many"])),
    ("asc_ncols_negative.asc", Error(&["ncols"])),
    ("asc_ncols_huge.asc", Error(&["99999999999"])),
    ("asc_comma_decimal.asc", Error(&["decimal comma"])),
    ("N00E000_short.hgt", Error(&["1201 × 1201"])),
    ("badname.hgt", Error(&["1201 × 1201", "rename"])),
    ("png_truncated.png", Either(&["rest is void"])),
    ("png_bad_crc_ihdr.png", Error(&["CRC"])),
    ("png_2g_x_2g.png", Error(&["2147483647", "16777216"])),
    ("ter_no_altw.ter", Error(&["ALTW"])),
    ("ter_negative_xpts.ter", Error(&["-"])),
    ("nc3_truncated.nc", Either(&["void", "NetCDF"])),
    ("nc_bad_version.nc", Error(&["version 9"])),
    ("bmp_int_min.bmp", Error(&["BMP"])),
    ("usgs_dem_truncated.dem", Either(&["rest is void"])),
];

#[test]
fn every_bad_file_is_told_apart() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/formats"));
    let Ok(table) = std::fs::read_to_string(folder.join("BAD.tsv")) else {
        println!("../shared/data is absent: no bad file is tried");
        return;
    };
    let mut failures = Vec::new();
    let [mut most_memory, mut most_seconds] = [(0.0, ""), (0.0, "")];
    let listed: Vec<&str> = table.lines().skip(1).filter_map(|line| line.split('\t').next()).collect();
    for file in &listed {
        if !FILES.iter().any(|(name, _)| name == file) {
            failures.push(format!("{file}: listed in BAD.tsv, but not here"));
        }
    }
    for (file, expected) in &FILES {
        let path = folder.join("bad").join(file);
        let length = std::fs::metadata(&path).map_or(0, |m| m.len() as usize);
        MOST.store(NOW.load(Relaxed), Relaxed);
        let before = NOW.load(Relaxed);
        let start = Instant::now();
        // A panic is caught, to be reported with the others.
        let result = std::panic::catch_unwind(|| {
            let mut source = open(&path)?;
            let survey = survey(source.as_mut(), &|_| ())?;
            if survey.min.is_some_and(|m| m.is_nan()) || survey.max.is_some_and(|m| m.is_nan()) {
                panic!("NaN among the heights");
            }
            Ok::<Vec<String>, littoral_data::Error>(source.info().warnings.clone())
        });
        let seconds = start.elapsed().as_secs_f64();
        let memory = MOST.load(Relaxed).saturating_sub(before);
        most_memory = if memory as f64 > most_memory.0 { (memory as f64, file) } else { most_memory };
        most_seconds = if seconds > most_seconds.0 { (seconds, file) } else { most_seconds };
        let has = |text: &str, words: &[&str]| words.iter().any(|word| text.contains(word));
        let said = match &result {
            Err(_) => "panicked".to_owned(),
            Ok(Err(error)) => format!("error: {error}"),
            Ok(Ok(warnings)) => format!("opened: {warnings:?}"),
        };
        let as_expected = match (&result, expected) {
            (Err(_), _) => false,
            (Ok(Err(_)), Error(words) | Either(words)) => has(&said, words),
            (Ok(Ok(_)), Warning(words) | Either(words)) => has(&said, words),
            (Ok(Ok(_)), Opens) => true,
            _ => false,
        };
        println!("{file}: {said} ({} KiB, {:.1} ms)", memory >> 10, seconds * 1e3);
        if !as_expected {
            failures.push(format!("{file}: {said}"));
        }
        if memory > 2 * length + (64 << 20) {
            failures.push(format!("{file}: {memory} bytes of memory for a file of {length}"));
        }
        // A guard against hanging, not a measurement.
        if seconds > 20.0 {
            failures.push(format!("{file}: {seconds} s"));
        }
    }
    println!(
        "most memory: {} KiB ({}), longest: {:.1} ms ({})",
        most_memory.0 as usize >> 10,
        most_memory.1,
        most_seconds.0 * 1e3,
        most_seconds.1
    );
    // Where nothing is valid there is nothing to show.
    let options = LoadOptions { most_samples: 1 << 20 };
    match load(&folder.join("bad/f32_all_nodata.tif"), options) {
        Err(error) if error.to_string().contains("valid height") => {}
        other => {
            failures.push(format!("f32_all_nodata.tif: expected an error of no valid height, got {:?}", other.err()))
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
