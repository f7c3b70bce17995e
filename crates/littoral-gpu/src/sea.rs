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
//! **Against the processor.** Samples differ from those of [`Cascades`] by less than 10⁻⁵ of their field's root mean square (tested for tiles of 64² to 512²,
//! at times up to 10⁸ s; by 5·10⁻⁶ at most on Mesa's software Vulkan). Foam differs by less than 0.01. Two calls on one device give the same bits.
//! Between samples of coarse levels [`sample_source`] differs by the error of interpolation, 2 % of the shortest waves there, for the processor
//! never has fewer than 64 samples a side.
//!
//! **A sea that changes** ([`Cascades::changing`]) is uploaded as it stands; [`GpuSea::copy`] follows it.

mod foam;
mod plan;
pub(crate) mod sample;
pub(crate) mod shore;
mod upload;

use crate::{Gpu, GpuError, bindings};
use foam::{Foam, Moment};
use glam::DVec2;
use littoral::waves::WaveModel;
use littoral::waves::cascades::{Cascades, Tile};
use plan::Plan;
use sample::SampleTile;
use std::sync::{Mutex, PoisonError};
use wgpu::util::DeviceExt;

/// How the sums are made on a device. Both differ from the processor by no more than the module says, but not to the bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// Step after step over all memory: for devices whose workgroups have no fast memory, such as processors that do a GPU's work.
    Passes,
    /// Whole lines in the memory of a workgroup: all is read and written once along each axis.
    Lines,
}

/// A sea of tiles whose samples are in a texture of the GPU.
///
/// The texture has two layers for each tile, in the order of [`Cascades::tiles`]: `(z, x, ∂x/∂x, y)` and `(∂y/∂y, ∂z/∂x, ∂x/∂y, ∂z/∂y)` in the
/// tile's own axes, texel (i, j) at (i, j) · length / samples from the tile's corner. All layers have the samples of the tile that has most, but after
/// [`GpuSea::copy`] each tile has its own in the corner of its layers.
pub struct GpuSea {
    gpu: Gpu,
    plan: Plan,
    pipelines: Vec<wgpu::ComputePipeline>,
    /// By level: from the first of the two buffers to the second, and back.
    groups: Vec<[wgpu::BindGroup; 2]>,
    moments: wgpu::Buffer,
    motion: wgpu::Texture,
    foam: Foam,
    caps: Caps,
    tiles: Vec<Tile>,
    sample_tiles: Vec<SampleTile>,
    /// Of the places that shaders ask about (m).
    origin: Mutex<DVec2>,
    sample_buffer: wgpu::Buffer,
    sample_layout: wgpu::BindGroupLayout,
    sample_group: wgpu::BindGroup,
    seconds: f64,
    /// Whether the samples are the processor's.
    copied: bool,
}

impl GpuSea {
    /// Instants that are worked on in one submission.
    const MOMENTS: usize = 128;
    /// Bytes from one to the next.
    const MOMENT: usize = 512;

    /// The sea of `sea`, with its waves as strong as they are where it stands.
    ///
    /// # Errors
    /// If the device cannot hold that many samples at once, or the sea has more than 16 tiles with foam.
    pub fn new(gpu: &Gpu, sea: &Cascades) -> Result<GpuSea, GpuError> {
        let transform = if gpu.is_software() { Transform::Passes } else { Transform::Lines };
        GpuSea::with_transform(gpu, sea, transform)
    }

    /// The same, summed in a way that is asked for.
    ///
    /// # Errors
    /// As [`GpuSea::new`].
    pub fn with_transform(gpu: &Gpu, sea: &Cascades, transform: Transform) -> Result<GpuSea, GpuError> {
        let device = &gpu.device;
        let tiles: Vec<Tile> = sea.tiles().copied().collect();
        let foam = Foam::new(sea.breakers(), tiles.len());
        let plan = Plan::new(sea, &foam.tiles, transform);
        check(gpu, &plan, &foam)?;
        let layers = tiles.len().max(1) as u32;
        let side = plan.samples;
        let motion = texture(device, "sea", wgpu::TextureFormat::Rgba32Float, side, 2 * layers, plan.levels);
        let constant = |label: &str, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let empty = |label: &str, size: u64, usage| {
            let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            device.create_buffer(&descriptor)
        };
        let (uniform, storage, copy) =
            (wgpu::BufferUsages::UNIFORM, wgpu::BufferUsages::STORAGE, wgpu::BufferUsages::COPY_DST);
        let steps = constant("sea: passes", &plan.uniforms(), uniform);
        let wave_tiles = constant("sea: tiles", never_empty(bytemuck::cast_slice(&plan.tiles)), storage);
        let waves = constant("sea: waves", never_empty(bytemuck::cast_slice(&plan.waves)), storage);
        let turns = constant("sea: turns", bytemuck::cast_slice(&plan.turns()), storage);
        let moments = empty("sea: moments", (GpuSea::MOMENTS * GpuSea::MOMENT) as u64, uniform | copy);
        let area = u64::from(side) * u64::from(side);
        let buffers = ["sea: one", "sea: other"].map(|label| empty(label, 32 * area * u64::from(layers), storage));
        let of_foam = empty("sea: foam", 8 * area * foam.tiles.len().max(1) as u64, storage | copy);
        let layout = layout(device);
        let groups = (0..plan.levels).map(|level| {
            let view = view(&motion, level);
            [(0, 1), (1, 0)].map(|(before, after): (usize, usize)| {
                bindings::group(
                    device,
                    "sea",
                    &layout,
                    [
                        part(&steps, Plan::STEP),
                        part(&moments, size_of::<Moment>() as u64),
                        wave_tiles.as_entire_binding(),
                        waves.as_entire_binding(),
                        turns.as_entire_binding(),
                        buffers[before].as_entire_binding(),
                        buffers[after].as_entire_binding(),
                        wgpu::BindingResource::TextureView(&view),
                        of_foam.as_entire_binding(),
                    ],
                )
            })
        });
        let groups = groups.collect();
        let pipelines = pipelines(device, &layout, &plan, transform);
        let caps = Caps::new(device, of_foam, side, foam.tiles.len().max(1) as u32);
        let sample_tiles = sample::tiles(sea, &sea.breakers(), side);
        let sample_buffer = constant("sea: places", bytemuck::cast_slice(&sample_tiles), storage | copy);
        let sample_layout = sample::layout(device);
        let sample_group = bindings::group(
            device,
            "sea",
            &sample_layout,
            [
                sample_buffer.as_entire_binding(),
                wgpu::BindingResource::TextureView(&whole(&motion)),
                wgpu::BindingResource::TextureView(&whole(&caps.shown)),
            ],
        );
        let mut sea = GpuSea {
            gpu: gpu.clone(),
            plan,
            pipelines,
            groups,
            moments,
            motion,
            foam,
            caps,
            tiles,
            sample_tiles,
            origin: Mutex::default(),
            sample_buffer,
            sample_layout,
            sample_group,
            seconds: f64::NAN,
            copied: false,
        };
        sea.set_origin(DVec2::ZERO);
        sea.set_time(0.0);
        Ok(sea)
    }

    /// Goes to an instant (s), forward or back; up to ±10⁹ s, as on the processor. The work is submitted at once: what is submitted later finds the samples
    /// of this instant.
    pub fn set_time(&mut self, seconds: f64) {
        let seconds = if seconds.is_nan() { 0.0 } else { seconds.clamp(-1e9, 1e9) };
        if (seconds == self.seconds && !self.copied) || self.plan.tiles.is_empty() {
            return;
        }
        if self.copied {
            let samples = self.plan.samples;
            self.tell_samples(|_| samples);
            self.copied = false;
        }
        self.seconds = seconds;
        let newer = self.foam.newer();
        let now = Moment::new(self.foam.time(seconds));
        let foamy = !self.foam.tiles.is_empty();
        let mut ticks = Vec::new();
        let device = &self.gpu.device;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if foamy {
            let due = self.foam.set(seconds);
            if due.clear {
                let half = self.caps.foam.size() / 2;
                encoder.clear_buffer(&self.caps.foam, u64::from(newer) * half, Some(half));
            }
            ticks = due.ticks;
            let shown = [self.foam.half, due.part.to_bits(), 0, 0];
            self.gpu.queue.write_buffer(&self.caps.instant, 0, bytemuck::bytes_of(&shown));
        }
        let mut ticks = ticks.chunks(GpuSea::MOMENTS - 1).peekable();
        loop {
            let some = ticks.next().unwrap_or_default();
            let last = ticks.peek().is_none();
            let mut bytes = vec![0; GpuSea::MOMENT * (some.len() + 1)];
            for (to, moment) in bytes.chunks_exact_mut(GpuSea::MOMENT).zip(some.iter().chain([&now])) {
                to[..size_of::<Moment>()].copy_from_slice(bytemuck::bytes_of(moment));
            }
            self.gpu.queue.write_buffer(&self.moments, 0, &bytes);
            {
                // Ticks of foam after a leap in time take submissions of their own, and are not told.
                let timestamp_writes = if last { self.gpu.compute_times("sea") } else { None };
                let mut pass =
                    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("sea"), timestamp_writes });
                (0..some.len()).for_each(|tick| self.sum(&mut pass, tick, true));
                if last {
                    self.sum(&mut pass, some.len(), false);
                    if foamy {
                        self.caps.show(&mut pass);
                    }
                }
            }
            let next = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.gpu.queue.submit([std::mem::replace(&mut encoder, next).finish()]);
            if last {
                return;
            }
        }
    }

    /// Takes over the samples and foam of the sea that it was made from, where that stands, instead of making them: where a processor does the GPU's work,
    /// its own transforms are several times faster than shaders that imitate a GPU's. `false`, and nothing done, for a sea of other tiles.
    pub fn copy(&mut self, sea: &Cascades) -> bool {
        if !sea.tiles().eq(&self.tiles) {
            return false;
        }
        for (index, spectrum) in sea.spectra().enumerate() {
            for level in 0..spectrum.levels() {
                upload::motion(&self.gpu.queue, &self.motion, index as u32, level as u32, &spectrum);
            }
            if let Some(layer) = self.foam.tiles.iter().position(|tile| *tile == index) {
                upload::foam(&self.gpu.queue, &self.caps.shown, layer as u32, &spectrum);
            }
        }
        self.seconds = sea.time();
        self.copied = true;
        self.tell_samples(|tile| tile.samples as u32);
        true
    }

    /// Tells shaders how many samples tiles have.
    fn tell_samples(&mut self, of: impl Fn(&Tile) -> u32) {
        self.sample_tiles.iter_mut().zip(&self.tiles).for_each(|(to, tile)| to.samples = of(tile));
        self.tell_places();
    }

    /// Tells shaders where tiles are.
    fn tell_places(&self) {
        let origin = *self.origin.lock().unwrap_or_else(PoisonError::into_inner);
        let mut tiles = self.sample_tiles.clone();
        sample::place(origin, &self.tiles, &mut tiles);
        self.gpu.queue.write_buffer(&self.sample_buffer, 0, bytemuck::cast_slice(&tiles));
    }

    /// The instant it stands at (s).
    pub fn time(&self) -> f64 {
        self.seconds
    }

    /// Moves the origin of the places that shaders ask about (m, east and north): best near the eye, once a frame.
    pub fn set_origin(&self, origin: DVec2) {
        *self.origin.lock().unwrap_or_else(PoisonError::into_inner) = origin;
        self.tell_places();
    }

    /// Its samples.
    pub fn motion(&self) -> &wgpu::Texture {
        &self.motion
    }

    /// Its foam: a layer for each tile that has any, with means over 2 × 2, 4 × 4, … samples as levels.
    pub fn foam(&self) -> &wgpu::Texture {
        &self.caps.shown
    }

    /// Layout of the group that [`sample_source`] asks for.
    pub fn sample_layout(&self) -> &wgpu::BindGroupLayout {
        &self.sample_layout
    }

    /// The group that [`sample_source`] asks for; the same for all instants and origins.
    pub fn sample_group(&self) -> &wgpu::BindGroup {
        &self.sample_group
    }

    /// Bytes that a step without a tick of foam reads and writes as it is built: waves, numbers between the passes, and samples.
    pub fn bytes_moved(&self) -> u64 {
        self.plan.bytes_moved()
    }

    /// The passes of all levels, or those of a tick of foam.
    fn sum(&self, pass: &mut wgpu::ComputePass, moment: usize, foam: bool) {
        for (index, step) in self.plan.steps.iter().enumerate() {
            let pipeline = if foam { step.foaming } else { Some(step.pipeline) };
            let Some(pipeline) = pipeline else { continue };
            let layers = if foam { self.foam.tiles.len() } else { 2 * self.plan.tiles.len() };
            let offsets = [index as u32 * Plan::APART, (moment * GpuSea::MOMENT) as u32];
            pass.set_pipeline(&self.pipelines[pipeline]);
            pass.set_bind_group(0, &self.groups[step.pass.level as usize][step.from], &offsets);
            pass.dispatch_workgroups(step.workgroups, layers as u32, 1);
        }
    }
}

/// `sea_sample.wgsl`, functions that tell the sea's surface at any place, for the bind group of a number.
pub fn sample_source(group: u32) -> String {
    include_str!("shaders/sea_sample.wgsl").replace("@group(GROUP)", &format!("@group({group})"))
}

/// Whether the device can hold a sea.
fn check(gpu: &Gpu, plan: &Plan, foam: &Foam) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let (tiles, side) = (plan.tiles.len() as u64, u64::from(plan.samples));
    let too_little = |wanted: String, offered: String| {
        Err(GpuError::TooLittle { adapter: gpu.adapter.name.clone(), wanted, offered })
    };
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let needed = (32 * tiles * side * side).max(size_of_val(&plan.waves[..]) as u64);
    if needed > most {
        let wanted = format!("buffers of {needed} bytes, for a sea of {tiles} tiles with {side}² samples");
        return too_little(wanted, format!("{most}"));
    }
    if 2 * tiles > u64::from(limits.max_texture_array_layers) {
        let offered = format!("{}", limits.max_texture_array_layers);
        return too_little(format!("textures with {} layers, for a sea of {tiles} tiles", 2 * tiles), offered);
    }
    if foam.tiles.len() > foam::MOST {
        return too_little(format!("foam on {} tiles", foam.tiles.len()), format!("foam on {}", foam::MOST));
    }
    Ok(())
}

/// Bytes that can be bound, even if there are none.
fn never_empty(bytes: &[u8]) -> &[u8] {
    if bytes.is_empty() { &[0; 256] } else { bytes }
}

/// What is seen of foam at an instant.
struct Caps {
    foam: wgpu::Buffer,
    instant: wgpu::Buffer,
    shown: wgpu::Texture,
    /// For the finest level, then for the others.
    pipelines: [wgpu::ComputePipeline; 2],
    /// By level.
    groups: Vec<wgpu::BindGroup>,
}

impl Caps {
    fn new(device: &wgpu::Device, foam: wgpu::Buffer, side: u32, layers: u32) -> Caps {
        let levels = side.ilog2() + 1;
        let shown = texture(device, "sea: foam", wgpu::TextureFormat::R32Float, side, layers, levels);
        let instant = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sea: instant of foam"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = bindings::group_layout(
            device,
            "sea",
            wgpu::ShaderStages::COMPUTE,
            &[
                bindings::uniform(false),
                bindings::storage(true),
                bindings::texels(wgpu::TextureViewDimension::D2Array),
                stored(wgpu::TextureFormat::R32Float),
            ],
        );
        let module = device.create_shader_module(wgpu::include_wgsl!("shaders/sea_foam.wgsl"));
        let pipelines = ["show", "halve"].map(|entry| pipeline(device, &layout, &module, entry, &[]));
        let groups = (0..levels).map(|level| {
            let (finer, to) = (view(&shown, if level == 0 { 1 } else { level - 1 }), view(&shown, level));
            let resources = [
                instant.as_entire_binding(),
                foam.as_entire_binding(),
                wgpu::BindingResource::TextureView(&finer),
                wgpu::BindingResource::TextureView(&to),
            ];
            bindings::group(device, "sea", &layout, resources)
        });
        let groups = groups.collect();
        Caps { foam, instant, shown, pipelines, groups }
    }

    fn show(&self, pass: &mut wgpu::ComputePass) {
        for (level, group) in self.groups.iter().enumerate() {
            let workgroups = (self.shown.width() >> level).div_ceil(8);
            pass.set_pipeline(&self.pipelines[level.min(1)]);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(workgroups, workgroups, self.shown.depth_or_array_layers());
        }
    }
}

fn texture(
    device: &wgpu::Device,
    label: &str,
    format: wgpu::TextureFormat,
    side: u32,
    layers: u32,
    levels: u32,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// All layers of a level.
fn view(texture: &wgpu::Texture, level: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        base_mip_level: level,
        mip_level_count: Some(1),
        ..Default::default()
    })
}

/// All layers of all levels.
fn whole(texture: &wgpu::Texture) -> wgpu::TextureView {
    let dimension = Some(wgpu::TextureViewDimension::D2Array);
    texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() })
}

/// The first bytes of a buffer, which offsets move.
fn part(buffer: &wgpu::Buffer, size: u64) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size: wgpu::BufferSize::new(size) })
}

fn stored(format: wgpu::TextureFormat) -> wgpu::BindingType {
    let access = wgpu::StorageTextureAccess::WriteOnly;
    wgpu::BindingType::StorageTexture { access, format, view_dimension: wgpu::TextureViewDimension::D2Array }
}

fn pipeline(
    device: &wgpu::Device,
    group: &wgpu::BindGroupLayout,
    module: &wgpu::ShaderModule,
    entry: &str,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let layout = bindings::pipeline_layout(device, "sea", &[group]);
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("sea"),
        layout: Some(&layout),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

/// What the passes of the transform are bound to.
fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let (read, write) = (bindings::storage(true), bindings::storage(false));
    let types = [
        bindings::uniform(true),
        bindings::uniform(true),
        read,
        read,
        read,
        read,
        write,
        stored(wgpu::TextureFormat::Rgba32Float),
        write,
    ];
    bindings::group_layout(device, "sea", wgpu::ShaderStages::COMPUTE, &types)
}

/// The source of a transform.
pub fn transform_source(transform: Transform) -> String {
    let steps = match transform {
        Transform::Passes => include_str!("shaders/sea_passes.wgsl"),
        Transform::Lines => include_str!("shaders/sea_lines.wgsl"),
    };
    [include_str!("shaders/sea_waves.wgsl"), steps].join("\n")
}

/// One for each kind of pass.
fn pipelines(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    plan: &Plan,
    transform: Transform,
) -> Vec<wgpu::ComputePipeline> {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("sea"),
        source: wgpu::ShaderSource::Wgsl(transform_source(transform).into()),
    });
    let make = |kind: &plan::Kind| {
        let foam = ("FOAM", f64::from(u8::from(kind.foam)));
        let constants = [
            foam,
            ("RADIX", f64::from(kind.radix)),
            ("FROM_WAVES", f64::from(u8::from(kind.first && !kind.along_y))),
            ("FROM_ROWS", f64::from(u8::from(kind.first && kind.along_y))),
            ("TO_SAMPLES", f64::from(u8::from(kind.last && kind.along_y))),
        ];
        let constants = if transform == Transform::Passes { &constants[..] } else { &constants[..1] };
        pipeline(device, layout, &module, if kind.along_y { "along_y" } else { "along_x" }, constants)
    };
    plan.kinds.iter().map(make).collect()
}
