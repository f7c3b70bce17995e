#![no_main]

use littoral_data::formats;
use littoral_data_fuzz::{check, header_and_samples, input};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let (header, samples) = header_and_samples(data);
    check(formats::esri_raw::open(input("land.bil", samples), &String::from_utf8_lossy(header)));
});
