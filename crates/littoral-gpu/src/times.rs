//! How long passes take, by the device's own clock.

use crate::device::{Gpu, GpuError};
use crate::read::read;
use std::sync::atomic::{AtomicU32, Ordering};

/// Times of passes, for a device that keeps them: [`Gpu::timed`].
#[derive(Debug)]
pub struct PassTimes {
    set: wgpu::QuerySet,
    ticks: wgpu::Buffer,
    /// Milliseconds a tick.
    period: f64,
    /// Bit by bit, passes recorded since times were kept last, and those that were kept.
    recorded: AtomicU32,
    kept: AtomicU32,
}

/// Of the two ends of a pass, where its times are written.
type Ends = (Option<u32>, Option<u32>);

impl PassTimes {
    /// The passes that are timed, in the order of their work: the sum of a sea's waves at a new instant, the choice of triangles
    /// ([`Tessellator`](crate::Tessellator)), how far away the ground is (by triangles or rays), where the points of the waves' grid are, where the sea is seen, and
    /// the light of everything.
    pub const PASSES: [&str; 6] = ["sea", "tessellation", "surface", "wave points", "waves", "shade"];

    /// `None` where the device has no clock, or is a processor, whose clock tells when passes were recorded rather than when they ran.
    pub(crate) fn new(gpu: &Gpu) -> Option<PassTimes> {
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
            recorded: AtomicU32::new(0),
            kept: AtomicU32::new(0),
        })
    }

    fn ends(&self, pass: &str) -> Option<Ends> {
        let number = PassTimes::PASSES.iter().position(|&name| name == pass)? as u32;
        self.recorded.fetch_or(1 << number, Ordering::Relaxed);
        Some((Some(2 * number), Some(2 * number + 1)))
    }

    /// What a compute pass of this name is told to write.
    pub fn of_compute(&self, pass: &str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.ends(pass).map(|(beginning_of_pass_write_index, end_of_pass_write_index)| {
            wgpu::ComputePassTimestampWrites {
                query_set: &self.set,
                beginning_of_pass_write_index,
                end_of_pass_write_index,
            }
        })
    }

    /// What a render pass of this name is told to write.
    pub fn of_render(&self, pass: &str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.ends(pass).map(|(beginning_of_pass_write_index, end_of_pass_write_index)| {
            wgpu::RenderPassTimestampWrites {
                query_set: &self.set,
                beginning_of_pass_write_index,
                end_of_pass_write_index,
            }
        })
    }

    /// Records that the times of the passes recorded since the last time are to be kept, in this encoder or those submitted before it.
    pub fn keep(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.set, 0..2 * PassTimes::PASSES.len() as u32, &self.ticks, 0);
        self.kept.store(self.recorded.swap(0, Ordering::Relaxed), Ordering::Relaxed);
    }

    /// The times that were kept last (ms), in the order of [`PassTimes::PASSES`]; nothing of passes that were not recorded.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn read(&self, gpu: &Gpu) -> Result<[Option<f64>; PassTimes::PASSES.len()], GpuError> {
        let ticks: Vec<[u64; 2]> = read(gpu, &self.ticks, self.ticks.size())?;
        let kept = self.kept.load(Ordering::Relaxed);
        let time = |pass: usize| ticks[pass][1].saturating_sub(ticks[pass][0]) as f64 * self.period;
        Ok(std::array::from_fn(|pass| (kept >> pass & 1 == 1).then(|| time(pass))))
    }
}
