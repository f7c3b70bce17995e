//! The device's own clock.

use littoral_gpu::Gpu;

pub fn wait(gpu: &Gpu) {
    drop(gpu.device.poll(wgpu::PollType::wait_indefinitely()));
}

/// Timestamps about a pass.
pub struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
}

impl Timer {
    pub fn new(gpu: &Gpu) -> Option<Timer> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timer"),
            ty: wgpu::QueryType::Timestamp,
            count: 2,
        });
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timer"),
                size: 16,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let resolved = buffer(Usage::QUERY_RESOLVE | Usage::COPY_SRC);
        Some(Timer { queries, resolved, read: buffer(Usage::COPY_DST | Usage::MAP_READ) })
    }

    pub fn writes(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Milliseconds of the pass that it was given to last.
    pub fn read(&self, gpu: &Gpu) -> f64 {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read, 0, 16);
        gpu.queue.submit([encoder.finish()]);
        self.read.map_async(wgpu::MapMode::Read, .., |_| {});
        wait(gpu);
        let ticks =
            self.read.get_mapped_range(..).map_or([0; 2], |bytes| bytemuck::pod_read_unaligned::<[u64; 2]>(&bytes));
        self.read.unmap();
        ticks[1].saturating_sub(ticks[0]) as f64 * f64::from(gpu.queue.get_timestamp_period()) * 1e-6
    }
}
