//! The sea of periodic tiles ([`Cascades`]) on the GPU: the waves of the same seed, summed at the same samples.
//!
//! [`GpuSea::new`] uploads the very spectrum of a sea on the processor. [`GpuSea::set_time`] turns the phases of all waves, sums them by fast
//! Fourier transform, and leaves in a texture what the processor keeps of a tile: height, displacements and their derivatives at each sample, for every
//! level of detail as a level of the texture. A level has the waves that are left when those are taken out that it would show wrongly, and
//! how steep these are on the mean is known in advance; so the texture needs no averaging.
//!
//! **Time.** A phase is a whole number of 2⁻³² turns: frequencies of 64 bits behind the point are multiplied by whole seconds and by parts of a second,
//! and whole turns fall off by themselves. Phases are right to 10⁻⁹ turns at any time that a sea can stand at.
//!
//! **Against the processor.** Samples differ from those of [`Cascades`] by less than 2·10⁻⁶ of their field's root mean square where the device adds and multiplies
//! as IEEE 754 says (to 2·10⁻⁵ where it only promises what WGSL asks for). Two calls on one device give the same bits.

mod plan;

use crate::{Gpu, GpuError};
use littoral::waves::cascades::Cascades;
use plan::Plan;
use wgpu::util::DeviceExt;

/// A sea of tiles whose samples are in a texture of the GPU.
///
/// The texture has two layers for each tile, in the order of [`Cascades::tiles`]: `(z, x, ∂x/∂x, y)` and `(∂y/∂y, ∂z/∂x, ∂x/∂y, ∂z/∂y)` in the
/// tile's own axes, texel (i, j) at (i, j) · length / samples from the tile's corner. All layers have the samples of the tile that has most.
pub struct GpuSea {
    gpu: Gpu,
    /// Time as the waves count it, from seconds: what the period of a sea that repeats itself makes of them.
    period: Option<f64>,
    plan: Plan,
    pipelines: Vec<wgpu::ComputePipeline>,
    /// By level: from the first of the two buffers to the second, and back.
    groups: Vec<[wgpu::BindGroup; 2]>,
    moment: wgpu::Buffer,
    motion: wgpu::Texture,
    seconds: f64,
}

impl GpuSea {
    /// The sea of `sea`, with its waves as strong as they are where it stands.
    ///
    /// # Errors
    /// If the device cannot hold that many samples at once.
    pub fn new(gpu: &Gpu, sea: &Cascades) -> Result<GpuSea, GpuError> {
        let device = &gpu.device;
        let plan = Plan::new(sea);
        let tiles = plan.tiles.len().max(1);
        let side = plan.samples as u64;
        let most = device.limits().max_storage_buffer_binding_size.min(device.limits().max_buffer_size);
        let between = 2 * tiles as u64 * side * side * 16;
        let needed = between.max(size_of_val(&plan.waves[..]) as u64);
        if needed > most {
            return Err(GpuError::TooLittle {
                adapter: gpu.adapter.name.clone(),
                wanted: format!(
                    "buffers of {needed} bytes for a sea of {tiles} tiles with {side}² samples (fewer samples take less)"
                ),
                offered: format!("{most}"),
            });
        }
        let motion = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("sea"),
            size: wgpu::Extent3d { width: plan.samples, height: plan.samples, depth_or_array_layers: 2 * tiles as u32 },
            mip_level_count: plan.levels,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let layout = layout(device);
        let constant = |label: &str, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let steps = constant("sea: passes", &plan.uniforms(), wgpu::BufferUsages::UNIFORM);
        let tiles = constant("sea: tiles", bytemuck::cast_slice(&plan.tiles), wgpu::BufferUsages::STORAGE);
        let waves = constant("sea: waves", bytemuck::cast_slice(&plan.waves), wgpu::BufferUsages::STORAGE);
        let turns = constant("sea: turns", bytemuck::cast_slice(&plan.turns()), wgpu::BufferUsages::STORAGE);
        let moment = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sea: moment"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let buffers = ["sea: one", "sea: other"].map(|label| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: between,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        });
        let groups = (0..plan.levels).map(|level| {
            let view = motion.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                base_mip_level: level,
                mip_level_count: Some(1),
                ..Default::default()
            });
            [(0, 1), (1, 0)].map(|(before, after): (usize, usize)| {
                let step = wgpu::BufferBinding { buffer: &steps, offset: 0, size: wgpu::BufferSize::new(Plan::STEP) };
                let entries = [
                    wgpu::BindingResource::Buffer(step),
                    moment.as_entire_binding(),
                    tiles.as_entire_binding(),
                    waves.as_entire_binding(),
                    turns.as_entire_binding(),
                    buffers[before].as_entire_binding(),
                    buffers[after].as_entire_binding(),
                    wgpu::BindingResource::TextureView(&view),
                ];
                let mut binding = 0..;
                let entries = entries
                    .map(|resource| wgpu::BindGroupEntry { binding: binding.next().unwrap_or_default(), resource });
                device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("sea"),
                    layout: &layout,
                    entries: &entries,
                })
            })
        });
        let groups = groups.collect();
        let pipelines = pipelines(device, &layout, &plan);
        let mut sea = GpuSea {
            gpu: gpu.clone(),
            period: sea.period(),
            plan,
            pipelines,
            groups,
            moment,
            motion,
            seconds: f64::NAN,
        };
        sea.set_time(0.0);
        Ok(sea)
    }

    /// Goes to an instant (s), forward or back; up to ±10⁹ s, as on the processor.
    pub fn set_time(&mut self, seconds: f64) {
        let seconds = if seconds.is_nan() { 0.0 } else { seconds.clamp(-1e9, 1e9) };
        if seconds == self.seconds || self.plan.tiles.is_empty() {
            return;
        }
        self.seconds = seconds;
        let time = self.period.map_or(seconds, |period| seconds.rem_euclid(period) / period);
        self.gpu.queue.write_buffer(&self.moment, 0, bytemuck::bytes_of(&moment(time)));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.sum(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// The instant it stands at (s).
    pub fn time(&self) -> f64 {
        self.seconds
    }

    /// Its samples.
    pub fn motion(&self) -> &wgpu::Texture {
        &self.motion
    }

    /// Bytes that a step reads and writes at the least: waves once, numbers between the passes, and samples.
    pub fn bytes_moved(&self) -> u64 {
        self.plan.bytes_moved()
    }

    fn sum(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("sea"), timestamp_writes: None });
        for (index, step) in self.plan.steps.iter().enumerate() {
            pass.set_pipeline(&self.pipelines[step.pipeline]);
            let offset = index as u32 * Plan::APART;
            pass.set_bind_group(0, &self.groups[step.pass.level as usize][step.from], &[offset]);
            pass.dispatch_workgroups(step.workgroups, 2 * self.plan.tiles.len() as u32, 1);
        }
    }
}

/// Whole seconds and the rest in units of 2⁻³² s.
fn moment(time: f64) -> [u32; 4] {
    let whole = time.floor();
    [whole as i32 as u32, ((time - whole) * 4_294_967_296.0) as u32, 0, 0]
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let buffer = |ty, has_dynamic_offset| wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None };
    let uniform = wgpu::BufferBindingType::Uniform;
    let read = wgpu::BufferBindingType::Storage { read_only: true };
    let types = [
        buffer(uniform, true),
        buffer(uniform, false),
        buffer(read, false),
        buffer(read, false),
        buffer(read, false),
        buffer(read, false),
        buffer(wgpu::BufferBindingType::Storage { read_only: false }, false),
        wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: wgpu::TextureFormat::Rgba32Float,
            view_dimension: wgpu::TextureViewDimension::D2Array,
        },
    ];
    let mut binding = 0..;
    let entries = types.map(|ty| wgpu::BindGroupLayoutEntry {
        binding: binding.next().unwrap_or_default(),
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    });
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("sea"), entries: &entries })
}

/// One for each kind of pass.
fn pipelines(device: &wgpu::Device, group: &wgpu::BindGroupLayout, plan: &Plan) -> Vec<wgpu::ComputePipeline> {
    let module = device.create_shader_module(wgpu::include_wgsl!("shaders/sea_transform.wgsl"));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("sea"),
        bind_group_layouts: &[Some(group)],
        immediate_size: 0,
    });
    let make = |kind: &plan::Kind| {
        let constants = [
            ("RADIX", f64::from(kind.radix)),
            ("FROM_WAVES", f64::from(u8::from(kind.first && !kind.along_y))),
            ("FROM_ROWS", f64::from(u8::from(kind.first && kind.along_y))),
            ("TO_SAMPLES", f64::from(u8::from(kind.last && kind.along_y))),
        ];
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("sea"),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(if kind.along_y { "along_y" } else { "along_x" }),
            compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
            cache: None,
        })
    };
    plan.kinds.iter().map(make).collect()
}
