//! GeoTIFF: opened, read in corners and windows, and small ones loaded and surveyed whole.

#![no_main]

use libfuzzer_sys::fuzz_target;
use littoral_data::formats::tiff;
use littoral_data::{LoadOptions, load_from, survey};
use littoral_data_fuzz::{check, input};

fuzz_target!(|data: &[u8]| {
    check(tiff::open_input(input("land.tif", data)));
    let Ok(mut source) = tiff::open_input(input("land.tif", data)) else { return };
    let samples = source.info().columns * source.info().rows;
    if samples > 1 << 18 {
        return;
    }
    let read = survey(&mut *source, &|_| {});
    for most_samples in [100, 5000] {
        let loaded = load_from(&mut *source, "land.tif".as_ref(), LoadOptions { most_samples }, &|_| {});
        if let (Ok(dem), Ok(read)) = (loaded, &read) {
            assert!(dem.raster.columns() * dem.raster.rows() <= most_samples.max(4));
            assert!(read.min.is_some() || samples > most_samples);
            assert!(dem.raster.heights().iter().all(|height| height.is_finite()));
        }
    }
});
