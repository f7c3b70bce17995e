#![no_main]

use littoral_data::formats;
use littoral_data_fuzz::{check, input};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    check(formats::png::open(input("land.png", data)));
});
