#![no_main]

use littoral_data::formats;
use littoral_data_fuzz::{check, header_and_samples, input};

// The name comes first: lengths of whole tiles are out of a fuzzer's reach but for the smallest, so bytes are repeated up to it.
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let (name, samples) = header_and_samples(data);
    let name = String::from_utf8_lossy(name);
    check(formats::hgt::open(input(&name, samples)));
    check(formats::named_raw::open(input(&name, samples)));
    if !samples.is_empty() {
        let tile: Vec<u8> = samples.iter().copied().cycle().take(121 * 121 * 2).collect();
        check(formats::hgt::open(input(&name, &tile)));
    }
});
