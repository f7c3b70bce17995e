//! The device's own clock.

use littoral_gpu::Gpu;

pub fn wait(gpu: &Gpu) {
    drop(gpu.device.poll(wgpu::PollType::wait_indefinitely()));
}

/// What a pass that chooses triangles is told to write.
#[allow(dead_code, reason = "not every benchmark chooses triangles")]
pub fn writes(gpu: &Gpu) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
    gpu.times.as_ref()?.of_compute("tessellation")
}

/// Milliseconds of the timed passes that were submitted since it was asked last, if the device has a clock for them.
pub fn read(gpu: &Gpu) -> Option<f64> {
    let times = gpu.times.as_ref()?;
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    times.keep(&mut encoder);
    gpu.queue.submit([encoder.finish()]);
    Some(times.read(gpu).ok()?.into_iter().flatten().sum())
}
