//! What compute passes share: textures of numbers, and buffers read back.

use crate::device::{Gpu, GpuError};
use crate::scenery::TooLarge;
use littoral::field::Land;

/// The first bytes of a buffer.
pub(crate) fn read(gpu: &Gpu, from: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, GpuError> {
    if bytes == 0 {
        return Ok(Vec::new());
    }
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(from, 0, &buffer, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.check()?;
    let lost = |e: &dyn std::fmt::Display| GpuError::Lost { adapter: gpu.adapter.name.clone(), reason: e.to_string() };
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(&e))?;
    let mapped = buffer.get_mapped_range(..).map_err(|e| lost(&e))?;
    Ok(mapped.to_vec())
}

/// A height that is not finite.
pub(crate) const VOID: u32 = f32::INFINITY.to_bits();

/// Bits of a land's heights (m), [`VOID`] where there is none.
///
/// # Errors
/// If the land has more samples along a side than the device's textures.
pub(crate) fn heights(gpu: &Gpu, land: &Land) -> Result<wgpu::Texture, TooLarge> {
    let raster = land.raster();
    let (columns, rows) = (raster.columns(), raster.rows());
    let most = gpu.device.limits().max_texture_dimension_2d;
    if columns.max(rows) > most as usize {
        return Err(TooLarge { columns, rows, most });
    }
    Ok(numbers(gpu, "heights", wgpu::TextureFormat::R32Uint, columns, rows, |row, line: &mut Vec<u32>| {
        let first = row * columns;
        let of = |(i, height): (usize, &f32)| if raster.voids().is_void(first + i) { VOID } else { height.to_bits() };
        line.extend(raster.heights()[first..first + columns].iter().enumerate().map(of));
    }))
}

/// Bytes that are brought to the device together.
const BAND: usize = 32 << 20;

/// A texture of 32-bit numbers; `fill` appends those of a row.
pub(crate) fn numbers(
    gpu: &Gpu,
    label: &str,
    format: wgpu::TextureFormat,
    columns: usize,
    rows: usize,
    mut fill: impl FnMut(usize, &mut Vec<u32>),
) -> wgpu::Texture {
    let size = wgpu::Extent3d { width: columns as u32, height: rows as u32, depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let mut numbers = Vec::new();
    let mut first = 0;
    for row in 0..rows {
        fill(row, &mut numbers);
        let bytes = size_of_val(&numbers[..]);
        if bytes < BAND && row + 1 < rows {
            continue;
        }
        let count = row + 1 - first;
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: first as u32, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(&numbers),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((bytes / count) as u32),
                rows_per_image: None,
            },
            wgpu::Extent3d { height: count as u32, ..size },
        );
        // What was written is on its way: its copy on the processor is let go.
        gpu.queue.submit([]);
        numbers.clear();
        first = row + 1;
    }
    texture
}
