#![no_main]

use littoral_data::image_from;
use littoral_data_fuzz::input;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if let Ok(picture) = image_from(input("picture", data)) {
        assert_eq!(picture.rgb.len(), picture.columns * picture.rows);
    }
});
