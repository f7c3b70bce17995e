#![no_main]

use littoral_data::object_from;
use std::path::Path;

// A `.glb`, or a `.gltf` whose buffers are the bytes themselves.
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let itself = |_: &str| Ok(data.to_vec());
    match object_from(Path::new("object"), data, &itself) {
        Ok(file) => {
            for form in file.object.forms() {
                assert!(form.triangles.as_flattened().iter().all(|&corner| (corner as usize) < form.corners.len()));
                assert!(form.corners.iter().all(|corner| corner.position.is_finite() && corner.normal.is_finite()));
            }
        }
        Err(error) => assert!(error.to_string().contains("expected")),
    }
});
