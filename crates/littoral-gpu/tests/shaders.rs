//! Every shader is valid, told without a device.

#[test]
fn shaders_are_valid() {
    for (name, source) in littoral_gpu::SHADERS.into_iter().chain(littoral_gpu::TESSELLATION_SHADERS) {
        let module = naga::front::wgsl::parse_str(source)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string_with_path(source, name)));
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string_with_path(source, name)));
    }
}
