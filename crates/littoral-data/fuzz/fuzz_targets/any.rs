#![no_main]

use littoral_data::formats;
use littoral_data_fuzz::{check, header_and_samples, input};

// The way of every file: told by content, archives unpacked, under a name of its own and with companions.
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let (name, content) = header_and_samples(data);
    let name = String::from_utf8_lossy(name).into_owned();
    check(formats::open_input(input(&name, content)));
    let (sidecar, content) = header_and_samples(content);
    let beside = |extension| input(&name, content).with_sidecar(extension, sidecar.to_vec());
    check(formats::open_input(beside("hdr")));
    check(formats::open_input(beside("prj").with_sidecar("wld", sidecar.to_vec())));
    check(formats::open_input(beside("aux.xml")));
    check(formats::open_input(beside("msk")));
});
