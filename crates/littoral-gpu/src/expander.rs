//! The patches that a method chose become triangles on the device: 48 bytes a patch go there instead of all its vertices and corners.
//!
//! The twin of [`Drawing::expand`] over land. What drawings hold beside patches, meshes and strips with heights of their own, is brought as it is.

use crate::bindings;
use crate::compute::heights;
use crate::device::{Gpu, GpuError};
use crate::scenery::TooLarge;
use crate::triangles::{TooMany, Triangles, fill};
use bytemuck::{Pod, Zeroable};
use littoral::field::Land;
use littoral::lod::{Drawing, Mesh, Patch, Stencil, Vertex};

/// The shader with its name, as it is compiled: for tests that need no device.
pub const EXPANSION_SHADER: (&str, &str) = ("expand", include_str!("shaders/expand.wgsl"));

/// `Here` in expand.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Here {
    cells: u32,
    patches: u32,
    vertices: u32,
    triangles: u32,
    samples_level: u32,
    columns: u32,
    rows: u32,
    voids: u32,
}

/// `Patch` in expand.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Packed {
    corner: [u32; 2],
    across: [i32; 2],
    up: [i32; 2],
    morph: f32,
    edges: [f32; 4],
    coarser: u32,
}

impl From<&Patch> for Packed {
    fn from(patch: &Patch) -> Packed {
        let side = |i: usize| u32::from(patch.edges[i].coarser) << i;
        Packed {
            corner: patch.corner,
            across: patch.across,
            up: patch.up,
            morph: patch.morph,
            edges: patch.edges.map(|edge| edge.morph),
            coarser: side(0) | side(1) | side(2) | side(3),
        }
    }
}

/// Turns what is drawn of a land into triangles on the device. Made once for a land; made anew when that changes.
#[derive(Debug)]
pub struct Expander {
    /// Samples level, columns, rows, whether any is void.
    land: [u32; 4],
    heights: wgpu::TextureView,
    here: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    squares: wgpu::ComputePipeline,
    few: wgpu::ComputePipeline,
    patches: Option<wgpu::Buffer>,
    packed: Vec<Packed>,
    triangles: Triangles,
    /// Vertices there were last.
    vertices: u32,
}

/// Most cells of a stencil along a side, and threads of a workgroup: as in expand.wgsl.
const MOST_CELLS: u32 = 32;
const THREADS: u32 = 256;

impl Expander {
    /// Brings the heights of a land to the device: four bytes a sample.
    ///
    /// # Errors
    /// If the land has more samples along a side than the device's textures.
    pub fn new(gpu: &Gpu, land: &Land) -> Result<Expander, TooLarge> {
        let raster = land.raster();
        let (columns, rows) = (raster.columns() as u32, raster.rows() as u32);
        let heights = heights(gpu, land)?.create_view(&Default::default());
        let device = &gpu.device;
        let (uniform, texels, write) = (bindings::uniform(false), bindings::numbers(), bindings::storage(false));
        let types = [uniform, texels, bindings::storage(true), write, write, write];
        let layout = bindings::group_layout(device, "expansion", wgpu::ShaderStages::COMPUTE, &types);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(EXPANSION_SHADER.0),
            source: wgpu::ShaderSource::Wgsl(EXPANSION_SHADER.1.into()),
        });
        let pipeline_layout = bindings::pipeline_layout(device, "expansion", &[&layout]);
        let pipeline = |entry| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        Ok(Expander {
            land: [land.finest_level().into(), columns, rows, raster.voids().any().into()],
            heights,
            here: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("expansion"),
                size: size_of::<Here>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            squares: pipeline("squares"),
            few: pipeline("few"),
            layout,
            patches: None,
            packed: Vec::new(),
            triangles: Triangles::default(),
            vertices: 0,
        })
    }

    /// Brings a drawing of the land to the device, one a submission, and submits what makes triangles of it: [`Expander::triangles`] are then those. Strips of the drawing become
    /// triangles of its mesh.
    ///
    /// # Errors
    /// If the triangles are more than the device's buffers hold, or their stencil has more than 32 cells along a side; then nothing changes.
    pub fn expand(&mut self, gpu: &Gpu, drawing: &mut Drawing) -> Result<(), TooMany> {
        drawing.expand_strips();
        let (cells, vertices, triangles) = match drawing.stencil {
            Stencil::Triangle => (0, 3, 1),
            // A side that is left out may leave a triangle that stands upright at each of its middles.
            Stencil::Square(n) => (n, (u64::from(n) + 1).pow(2), 2 * u64::from(n).pow(2) + 2 * u64::from(n)),
        };
        let [samples_level, columns, rows, voids] = self.land;
        let patches = drawing.patches.len() as u64;
        let before = [drawing.mesh.vertices.len(), drawing.mesh.triangles.len()].map(|n| n as u64);
        let most = gpu.device.limits().max_storage_buffer_binding_size.min(gpu.device.limits().max_buffer_size);
        let vertices = vertices * patches + before[0];
        let triangles = triangles * patches + before[1];
        let bytes =
            (vertices * size_of::<Vertex>() as u64).max(12 * triangles).max(size_of::<Packed>() as u64 * patches);
        let groups = if cells <= 1 { patches.div_ceil(THREADS.into()) } else { patches };
        let across = groups.clamp(1, 1 << 15);
        let down = groups.div_ceil(across);
        let most_groups = u64::from(gpu.device.limits().max_compute_workgroups_per_dimension);
        if bytes > most || triangles > u64::from(u32::MAX / 3) || cells > MOST_CELLS || down > most_groups {
            return Err(TooMany { triangles: drawing.triangles(), megabytes: most >> 20 });
        }
        let here = Here {
            cells,
            patches: patches as u32,
            vertices: before[0] as u32,
            triangles: before[1] as u32,
            samples_level,
            columns,
            rows,
            voids,
        };
        gpu.queue.write_buffer(&self.here, 0, bytemuck::bytes_of(&here));
        self.packed.clear();
        self.packed.extend(drawing.patches.iter().map(Packed::from));
        fill(gpu, &mut self.patches, "patches", wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&self.packed));
        self.triangles.make(gpu, &drawing.mesh, [vertices, triangles]);
        self.vertices = vertices as u32;
        let (Some(patches), Some(to), Some(corners), Some(drawn)) =
            (&self.patches, &self.triangles.vertices, &self.triangles.corners, &self.triangles.drawn)
        else {
            return Ok(());
        };
        let resources = [
            self.here.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.heights),
            patches.as_entire_binding(),
            to.as_entire_binding(),
            corners.as_entire_binding(),
            drawn.as_entire_binding(),
        ];
        let group = bindings::group(&gpu.device, "expansion", &self.layout, resources);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("expansion"), timestamp_writes: None });
        pass.set_pipeline(if cells <= 1 { &self.few } else { &self.squares });
        pass.set_bind_group(0, &group, &[]);
        if groups > 0 {
            pass.dispatch_workgroups(across as u32, down as u32, 1);
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// The triangles, for [`Renderer::draw`](crate::Renderer::draw).
    pub fn triangles(&self) -> &Triangles {
        &self.triangles
    }

    /// How many triangles were submitted last. Waits for the device.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn count(&self, gpu: &Gpu) -> Result<u32, GpuError> {
        self.triangles.number_made(gpu)
    }

    /// The triangles that were submitted last, read back. Waits for the device: for tests and tools.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn mesh(&self, gpu: &Gpu) -> Result<Mesh, GpuError> {
        self.triangles.read(gpu, self.vertices, self.count(gpu)?)
    }
}
