//! From the device.

use crate::device::{Gpu, GpuError};
use bytemuck::AnyBitPattern;

/// The first `size` bytes of a buffer, read back.
///
/// # Errors
/// If the device was lost.
pub(crate) fn read<T: AnyBitPattern + bytemuck::NoUninit>(
    gpu: &Gpu,
    buffer: &wgpu::Buffer,
    size: u64,
) -> Result<Vec<T>, GpuError> {
    let readable = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &readable, 0, size);
    gpu.queue.submit([encoder.finish()]);
    readable.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.check()?;
    let lost = |e: &dyn std::fmt::Display| GpuError::Lost { adapter: gpu.adapter.name.clone(), reason: e.to_string() };
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(&e))?;
    let mapped = readable.get_mapped_range(..).map_err(|e| lost(&e))?;
    Ok(bytemuck::pod_collect_to_vec(&mapped))
}
