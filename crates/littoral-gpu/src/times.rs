//! How long the passes of a picture take, by the device's own clock.

use crate::device::{Gpu, GpuError};
use crate::read::read;

/// Times of the passes of [`Renderer::draw`](crate::Renderer::draw), for a renderer that is given one.
#[derive(Debug)]
pub struct PassTimes {
    set: wgpu::QuerySet,
    ticks: wgpu::Buffer,
    /// Milliseconds a tick.
    period: f64,
}

impl PassTimes {
    /// The passes that are timed, in the order of their work.
    pub const PASSES: [&str; 2] = ["surface", "shade"];

    /// `None` where the device has no clock, or is a processor, whose clock tells when passes were recorded rather than when they ran.
    pub fn new(gpu: &Gpu) -> Option<PassTimes> {
        if gpu.is_software() || !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let count = 2 * PassTimes::PASSES.len() as u32;
        Some(PassTimes {
            set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            ticks: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times"),
                size: 8 * u64::from(count),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            period: f64::from(gpu.queue.get_timestamp_period()) * 1e-6,
        })
    }

    /// What a pass of this name is told to write.
    pub(crate) fn of(&self, pass: &str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let number = PassTimes::PASSES.iter().position(|&name| name == pass)? as u32;
        Some(wgpu::RenderPassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(2 * number),
            end_of_pass_write_index: Some(2 * number + 1),
        })
    }

    /// Records that the times of a picture recorded before are to be kept.
    pub fn keep(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.set, 0..2 * PassTimes::PASSES.len() as u32, &self.ticks, 0);
    }

    /// The times that were kept last (ms), in the order of [`PassTimes::PASSES`].
    ///
    /// # Errors
    /// If the device was lost.
    pub fn read(&self, gpu: &Gpu) -> Result<[f64; PassTimes::PASSES.len()], GpuError> {
        let ticks: Vec<[u64; 2]> = read(gpu, &self.ticks, self.ticks.size())?;
        Ok(std::array::from_fn(|pass| ticks[pass][1].saturating_sub(ticks[pass][0]) as f64 * self.period))
    }
}
