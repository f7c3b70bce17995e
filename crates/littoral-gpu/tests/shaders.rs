//! Every shader is valid, told without a device.

/// What shaders may ask for beyond the plainest: WebGPU promises to pack halves.
const WEBGPU: naga::valid::Capabilities = naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32;

#[test]
fn shaders_are_valid() {
    let waves = littoral_gpu::wave_shaders();
    let waves = waves.iter().map(|(name, source)| (*name, source.as_str()));
    let fixed = littoral_gpu::SHADERS
        .into_iter()
        .chain(littoral_gpu::TESSELLATION_SHADERS)
        .chain(littoral_gpu::BISECTION_SHADERS)
        .chain([littoral_gpu::EXPANSION_SHADER]);
    for (name, source) in fixed.chain(littoral_gpu::rays::SHADERS).chain(waves) {
        let module = naga::front::wgsl::parse_str(source)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string_with_path(source, name)));
        let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), WEBGPU);
        validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string_with_path(source, name)));
    }
}
