//! Samples and foam that the processor made, in the textures of the GPU's sea: each tile with its own number of samples, in the corner of its layers.
//!
//! Coarse levels have fewer samples here than there; those left out are not missed, for a level's waves are at least two of its samples long.

use littoral::waves::cascades::Spectrum;

/// Samples of a level of a tile.
pub fn motion(queue: &wgpu::Queue, texture: &wgpu::Texture, tile: u32, level: u32, spectrum: &Spectrum) {
    let Some(samples) = spectrum.samples(level as usize) else { return };
    let side = spectrum.tile().samples >> level;
    let apart = samples.side / side;
    let mut layers = vec![[0.0_f32; 4]; 2 * side * side];
    let (first, second) = layers.split_at_mut(side * side);
    for (row, (first, second)) in first.chunks_exact_mut(side).zip(second.chunks_exact_mut(side)).enumerate() {
        let of = samples.numbers[row * apart * samples.stride..].chunks_exact(8).step_by(apart);
        for ((first, second), eight) in first.iter_mut().zip(second).zip(of) {
            first.copy_from_slice(&eight[..4]);
            second.copy_from_slice(&eight[4..]);
        }
    }
    write(queue, texture, 2 * tile, 2, level, side as u32, bytemuck::cast_slice(&layers));
}

/// All levels of the foam of a tile.
pub fn foam(queue: &wgpu::Queue, texture: &wgpu::Texture, layer: u32, spectrum: &Spectrum) {
    for level in 0..=spectrum.tile().samples.ilog2() {
        let side = spectrum.tile().samples >> level;
        let at = |i: usize| spectrum.foam(level as usize, i % side, i / side);
        let means: Vec<f32> = (0..side * side).map(at).collect();
        write(queue, texture, layer, 1, level, side as u32, bytemuck::cast_slice(&means));
    }
}

fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, layer: u32, layers: u32, level: u32, side: u32, bytes: &[u8]) {
    let to = wgpu::TexelCopyTextureInfo {
        texture,
        mip_level: level,
        origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
        aspect: wgpu::TextureAspect::All,
    };
    let bytes_per_row = bytes.len() as u32 / (layers * side);
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(bytes_per_row), rows_per_image: Some(side) };
    queue.write_texture(to, bytes, layout, wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers });
}
