//! The ground as a texture of its shape: rays that meet the exact surface, without triangles.
//!
//! A [`ShapeTexture`] holds the heights of a land's samples, and above them a pyramid: how low and how high the surface reaches over 2 × 2 patches, 4 × 4, and so
//! on. A ray leaves what it passes over in one step, whatever its size, and comes down to patches only where it may meet them; so the time depends little on how
//! many samples there are. Nothing is prepared for a view, nothing is culled or sorted, and coarser levels need no triangles of their own: where a pixel is as
//! wide as a node, the node can answer for all of it.
//!
//! The walk is the engine's (`littoral::raycast`), in `f32` from an anchor near where rays start: pictures count from the eye, its place among the samples taken
//! as a whole number and a rest, so that nothing jitters far from the origin.
//!
//! **Against the processor.** Hits differ from those of [`Land::first_hit`] by less than 3·10⁻⁶ of the distances that are worked with (from the anchor to
//! where the ray starts and ends), 3·10⁻⁷ of the heights and half a millimetre, measured along the steeper of ray and surface: what `f32` can tell. The pyramid is exact.
//!
//! Works this rests on: spec page 004, "The height map as a shape texture" (2015), with A. Tevs et al., "Maximum mipmaps", I3D 2008. Ranges hold the samples
//! on a node's border, too, so that they bound the bilinear surface.

use crate::bindings;
use crate::device::{Gpu, GpuError};
use crate::frame;
use crate::read::read;
use crate::renderer::DEPTH;
use crate::scenery::TooLarge;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3};
use littoral::field::{HeightRange, Land};
use littoral::raycast::LocalRay;
use littoral::space::View;
use wgpu::util::{DeviceExt, TextureDataOrder};

/// The shaders of rays with their names, as they are compiled: for tests that need no device.
pub const SHADERS: [(&str, &str); 3] = [
    ("ranges", include_str!("shaders/rays_ranges.wgsl")),
    ("query", concat!(include_str!("shaders/rays.wgsl"), include_str!("shaders/rays_query.wgsl"))),
    (
        "cast",
        concat!(
            include_str!("shaders/frame.wgsl"),
            include_str!("shaders/rays.wgsl"),
            include_str!("shaders/rays_picture.wgsl")
        ),
    ),
];

/// What stands for a void on the device; heights beyond a tenth of it are voids, too.
const VOID: f32 = 1e38;
/// Distances beyond this (m) are none.
const NEVER: f32 = 1e38;
/// Room for levels.
const LEVELS: usize = 24;
/// Rays that are cast at a time.
const PART: usize = 1 << 20;

/// What shaders are told of the land, and of the anchor that a cast counts from: `Relief` in `rays.wgsl`, field by field.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Relief {
    cells: [i32; 2],
    anchor: [i32; 2],
    rest: [f32; 2],
    per_metre: [f32; 2],
    height: f32,
    above: f32,
    low: f32,
    high: f32,
    hair: f32,
    top: i32,
    has_voids: u32,
    spread: f32,
    levels: [[u32; 4]; LEVELS],
}

/// The ground as rays meet it, on the device.
#[derive(Debug)]
pub struct ShapeTexture {
    heights: wgpu::Texture,
    ranges: wgpu::Buffer,
    /// Where each level's nodes begin, its columns and rows.
    levels: Vec<[u32; 4]>,
    samples: [u32; 2],
    has_voids: bool,
    bounds: HeightRange,
    origin: DVec2,
    spacing: DVec2,
    /// The passes that build the pyramid: pipeline, what it works on, groups of threads along x and y.
    passes: Vec<(wgpu::ComputePipeline, wgpu::BindGroup, [u32; 2])>,
    query: wgpu::ComputePipeline,
    cast: wgpu::RenderPipeline,
    /// For pictures: the land as the view's eye sees it.
    relief: wgpu::Buffer,
    seen: wgpu::BindGroup,
}

/// Why a land has no shape texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShapeError {
    /// Its heights do not fit into a texture.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// Its pyramid does not fit into a buffer.
    #[error(
        "expected a pyramid of at most {megabytes} MiB, which is what this graphics adapter's shaders can read, got that of {columns} × {rows} samples; draw fewer samples (without --full), or a mesh (--lod patches)"
    )]
    Pyramid {
        /// Samples a row.
        columns: usize,
        /// Rows.
        rows: usize,
        /// What a buffer holds at most.
        megabytes: u64,
    },
}

impl ShapeTexture {
    /// Brings a land's heights to the device and builds their pyramid there.
    ///
    /// # Errors
    /// If there are more samples than the device's textures or buffers hold.
    pub fn new(gpu: &Gpu, land: &Land) -> Result<ShapeTexture, ShapeError> {
        let device = &gpu.device;
        let raster = land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        let limits = device.limits();
        if columns.max(rows) > limits.max_texture_dimension_2d as usize {
            return Err(TooLarge { columns, rows, most: limits.max_texture_dimension_2d }.into());
        }
        let samples = [columns as u32, rows as u32];
        let levels = levels(samples);
        let nodes = levels.last().map_or(1, |last| u64::from(last[0]) + 1);
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if 8 * nodes > most {
            return Err(ShapeError::Pyramid { columns, rows, megabytes: most >> 20 });
        }
        let marked: Vec<f32>;
        let values = match raster.voids().any() {
            false => raster.heights(),
            true => {
                let mark = |(i, &height)| if raster.voids().is_void(i) { VOID } else { height };
                marked = raster.heights().iter().enumerate().map(mark).collect();
                &marked
            }
        };
        let heights = device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some("shape"),
                size: wgpu::Extent3d { width: samples[0], height: samples[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::R32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            },
            TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(values),
        );
        let ranges = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("ranges"),
            size: 8 * nodes,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let [build, query, cast] = SHADERS.map(|(label, source)| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        });
        let passes = passes(gpu, &build, samples, &levels, &heights, &ranges);
        let cast = cast_pipeline(device, &cast);
        let relief = uniform(gpu, &Relief::zeroed());
        let seen = shape_group(gpu, &cast.get_bind_group_layout(1), &relief, &heights, &ranges);
        let shape = ShapeTexture {
            heights,
            ranges,
            levels,
            samples,
            has_voids: raster.voids().any(),
            bounds: land.height_range(),
            origin: land.origin(),
            spacing: raster.spacing(),
            passes,
            query: compute_pipeline(device, &query, "query"),
            cast,
            relief,
            seen,
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        shape.build(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        Ok(shape)
    }

    /// Records the passes that build the pyramid from the heights, as [`ShapeTexture::new`] did.
    pub fn build(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("ranges"), timestamp_writes: None });
        for (pipeline, group, [x, y]) in &self.passes {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(*x, *y, 1);
        }
    }

    /// Bytes that [`ShapeTexture::build`] reads and writes at least.
    pub fn bytes_built(&self) -> u64 {
        let nodes = self.ranges.size() / 8;
        // Each sample once, each node written, and all but the last read.
        4 * u64::from(self.samples[0]) * u64::from(self.samples[1]) + 8 * (2 * nodes - 1)
    }

    /// Columns and rows of each level of the pyramid, from that of 2 × 2 patches to that of one node.
    pub fn sizes(&self) -> impl Iterator<Item = [u32; 2]> {
        self.levels.iter().map(|level| [level[1], level[2]])
    }

    /// The pyramid, read back: the range of each node, row by row from the south, level after level, [`HeightRange::is_empty`] where there is no surface.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn ranges(&self, gpu: &Gpu) -> Result<Vec<HeightRange>, GpuError> {
        let pairs: Vec<[f32; 2]> = read(gpu, &self.ranges, self.ranges.size())?;
        Ok(pairs.into_iter().map(|[low, high]| HeightRange { low, high }).collect())
    }

    /// The distance to the first hit of each ray (in lengths of its direction), infinity where there is none, from above and below. Origins count from `anchor`, which
    /// is best near to where rays start. Rays with a `spread` may stop at nodes that they are as wide as, as [`LocalRay`] says. Rays whose numbers are not
    /// finite (but for the reach) or whose direction is zero meet nothing.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn first_hits(&self, gpu: &Gpu, anchor: DVec3, rays: &[LocalRay]) -> Result<Vec<f32>, GpuError> {
        let mut distances = Vec::with_capacity(rays.len());
        if !anchor.is_finite() || self.bounds.is_empty() {
            distances.resize(rays.len(), f32::INFINITY);
            return Ok(distances);
        }
        let relief = uniform(gpu, &self.relief(anchor, 0.0));
        let shape = shape_group(gpu, &self.query.get_bind_group_layout(1), &relief, &self.heights, &self.ranges);
        for part in rays.chunks(PART) {
            let asked: Vec<LocalRay> = part.iter().map(|&ray| sound(ray)).collect();
            let asked = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("rays"),
                contents: bytemuck::cast_slice(&asked),
                usage: wgpu::BufferUsages::STORAGE,
            });
            let size = size_of_val(part) as u64 / 8;
            let answers = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("distances"),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("rays"),
                layout: &self.query.get_bind_group_layout(0),
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: asked.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: answers.as_entire_binding() },
                ],
            });
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.query);
            pass.set_bind_group(0, &group, &[]);
            pass.set_bind_group(1, &shape, &[]);
            pass.dispatch_workgroups(part.len().div_ceil(64) as u32, 1, 1);
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
            let met: Vec<f32> = read(gpu, &answers, size)?;
            distances.extend(met.into_iter().map(|met| if met < NEVER { met } else { f32::INFINITY }));
        }
        Ok(distances)
    }

    /// Records, in a pass that has nothing but depth, one ray through each pixel of a view. `frame` is what shaders are told of the view; where a node is
    /// not wider than `pixels` pixels, its highest point stands for all of it.
    pub(crate) fn cast<'a>(
        &'a self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'a>,
        frame: &wgpu::BindGroup,
        view: &View,
        pixels: f32,
    ) {
        if self.bounds.is_empty() || !view.eye.is_finite() {
            return;
        }
        let (_, right, _) = view.frame();
        let relief = self.relief(view.eye, pixels.max(0.0) * right.length());
        gpu.queue.write_buffer(&self.relief, 0, bytemuck::bytes_of(&relief));
        pass.set_pipeline(&self.cast);
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &self.seen, &[]);
        pass.draw(0..3, 0..1);
    }

    fn relief(&self, anchor: DVec3, spread: f32) -> Relief {
        let at = (anchor.truncate() - self.origin) / self.spacing;
        let cells = self.samples.map(|n| n as i32 - 1);
        // Further away whole numbers of 32 bits end, and with them what `f32` could tell.
        let side = f64::from(cells[0].max(cells[1]));
        let cell = at.floor().clamp(DVec2::splat(-side), DVec2::splat(2.0 * side));
        // Heights count from the anchor's as `f32` tells it; what that leaves goes with the ray.
        let height = anchor.z.clamp(-1e30, 1e30) as f32;
        let most = self.bounds.low.abs().max(self.bounds.high.abs());
        let hair = 1e-6 * most;
        let mut levels = [[0; 4]; LEVELS];
        levels.iter_mut().zip(&self.levels).for_each(|(to, from)| *to = *from);
        Relief {
            cells,
            anchor: [cell.x as i32, cell.y as i32],
            rest: (at - cell).as_vec2().to_array(),
            per_metre: (1.0 / self.spacing).as_vec2().to_array(),
            height,
            above: (anchor.z - f64::from(height)) as f32,
            low: self.bounds.low - height - hair - 1e-3,
            high: self.bounds.high - height + hair + 1e-3,
            hair,
            top: self.levels.len() as i32,
            has_voids: self.has_voids.into(),
            spread,
            levels,
        }
    }
}

/// Where each level begins, its columns and rows, over so many samples.
fn levels(samples: [u32; 2]) -> Vec<[u32; 4]> {
    let [mut columns, mut rows] = samples.map(|n| n - 1);
    let (mut levels, mut first) = (Vec::new(), 0);
    loop {
        (columns, rows) = (columns.div_ceil(2), rows.div_ceil(2));
        levels.push([first, columns, rows, 0]);
        first += columns * rows;
        if columns == 1 && rows == 1 {
            return levels;
        }
    }
}

/// A ray that shaders can follow: one that meets nothing instead of one that cannot be followed.
fn sound(ray: LocalRay) -> LocalRay {
    let size = ray.direction.abs().max_element();
    let fine = ray.origin.is_finite() && ray.direction.is_finite() && size > 1e-20 && size < 1e20 && ray.reach >= 0.0;
    let spread = if ray.spread > 0.0 { ray.spread.min(1e15) } else { 0.0 };
    match fine {
        true => LocalRay { reach: ray.reach.min(1e18), spread, ..ray },
        false => LocalRay { reach: -1.0, spread, ..LocalRay::new(glam::Vec3::ZERO, glam::Vec3::Z) },
    }
}

fn uniform(gpu: &Gpu, relief: &Relief) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("relief"),
        contents: bytemuck::bytes_of(relief),
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
    })
}

fn shape_group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    relief: &wgpu::Buffer,
    heights: &wgpu::Texture,
    ranges: &wgpu::Buffer,
) -> wgpu::BindGroup {
    let heights = heights.create_view(&Default::default());
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("shape"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: relief.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&heights) },
            wgpu::BindGroupEntry { binding: 2, resource: ranges.as_entire_binding() },
        ],
    })
}

fn compute_pipeline(device: &wgpu::Device, module: &wgpu::ShaderModule, entry: &str) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: None,
        module,
        entry_point: Some(entry),
        compilation_options: Default::default(),
        cache: None,
    })
}

fn cast_pipeline(device: &wgpu::Device, module: &wgpu::ShaderModule) -> wgpu::RenderPipeline {
    let shape = bindings::group_layout(
        device,
        "shape",
        wgpu::ShaderStages::FRAGMENT,
        &[bindings::uniform(false), bindings::texels(wgpu::TextureViewDimension::D2), bindings::storage(true)],
    );
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("cast"),
        layout: Some(&bindings::pipeline_layout(device, "cast", &[&frame::layout(device), &shape])),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("everywhere"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("meet"),
            compilation_options: Default::default(),
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// The passes that build a pyramid, level by level.
fn passes(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    samples: [u32; 2],
    levels: &[[u32; 4]],
    heights: &wgpu::Texture,
    ranges: &wgpu::Buffer,
) -> Vec<(wgpu::ComputePipeline, wgpu::BindGroup, [u32; 2])> {
    let pipelines = ["first", "coarser"].map(|entry| compute_pipeline(&gpu.device, module, entry));
    let view = heights.create_view(&Default::default());
    let finer = std::iter::once([0, samples[0], samples[1], 0]).chain(levels.iter().copied());
    let passes = finer.zip(levels).enumerate().map(|(number, (finer, made))| {
        let pipeline = &pipelines[number.min(1)];
        let step = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("step"),
            contents: bytemuck::cast_slice(&[finer, *made]),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let mut entries = vec![
            wgpu::BindGroupEntry { binding: 0, resource: step.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 2, resource: ranges.as_entire_binding() },
        ];
        if number == 0 {
            entries.push(wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) });
        }
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("step"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        (pipeline.clone(), group, [made[1].div_ceil(8), made[2].div_ceil(8)])
    });
    passes.collect()
}
