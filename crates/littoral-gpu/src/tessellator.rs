//! Triangle patches cut level by level on the device: the twin of [`littoral::lod::Patches`], with the same triangles.
//!
//! The lists of all levels lie one after the other in one buffer. For each level three passes go over its list, as many workgroups as an earlier pass
//! wrote down: *count* tells the census what would be drawn at which tolerance, *settle* raises the tolerance if that is more than allowed, and *cut* puts four
//! children in place of what is worth it, with what they amount to in the view. The first levels are done in one pass by one workgroup. In the end *draw* goes
//! over all lists and puts out triangles and, for an indirect draw, their number. The processor records the same commands for every view and reads nothing back.
//!
//! A cell decides once, before its neighbours ask: so there are no cracks, whatever rounding does. Boxes about cells are counted from the eye in lattice
//! integers; they are a few parts in 10⁷ wider than the processor's, whose decision the device's may differ from where a bound is that near to the tolerance.
//!
//! Where lists are full, the tolerance rises as it does where triangles run out: all that is drawn is drawn with the same one, nothing is left out, and
//! what was reached is told.
//!
//! After the virtual Earth of GraphiCon 2016, whose tessellation and geometry stages portable interfaces do not have.

mod land;
mod passes;

use crate::bindings;
use crate::compute::read;
use crate::device::{Gpu, GpuError};
use crate::scenery::TooLarge;
use crate::triangles::Triangles;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, Vec4};
use land::DeviceLand;
use littoral::field::Land;
use littoral::lod::{Limits, Mesh, Reached, ScreenMetric, Vertex, ViewError};
use littoral::space::{Cell, View};
pub use passes::TessellationPasses;

/// The shaders of a tessellation with their names, as they are compiled: for tests that need no device.
pub const TESSELLATION_SHADERS: [(&str, &str); 2] = [
    (
        "tessellate: levels",
        concat!(include_str!("shaders/tessellate.wgsl"), include_str!("shaders/tessellate_levels.wgsl")),
    ),
    (
        "tessellate: draw",
        concat!(include_str!("shaders/tessellate.wgsl"), include_str!("shaders/tessellate_draw.wgsl")),
    ),
];

/// What every pass is told of the view and the land: see `Sight` in tessellate.wgsl, field by field.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Sight {
    sides: [[f32; 4]; 4],
    forward: [f32; 4],
    eye_steps: [u32; 2],
    rest: [f32; 2],
    step: [f32; 2],
    eye_height: [f32; 2],
    focal: f32,
    stretch: f32,
    tolerance: f32,
    base: f32,
    height_step: f32,
    height_slack: f32,
    most: u32,
    room: u32,
    finest: u32,
    samples_level: u32,
    columns: u32,
    rows: u32,
}

/// The beginning of `State` in tessellate.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct State {
    tolerance: f32,
    count: i32,
    candidates: u32,
    used: u32,
    vertices: u32,
    reached: f32,
    firsts: [u32; 32],
}

/// What a tessellation or a bisection came to, read back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tessellated {
    /// As [`littoral::lod::Lod::select`] tells it.
    pub reached: Reached,
    /// Triangles drawn.
    pub triangles: u32,
    /// Vertices drawn.
    pub vertices: u32,
    /// Cells or diamonds that were looked at.
    pub looked_at: u32,
}

/// Tessellates a land on the device. Made once for a land; made anew when that changes.
#[derive(Debug)]
pub struct Tessellator {
    land: DeviceLand,
    finest: u8,
    most: u32,
    room: u32,
    sight: wgpu::Buffer,
    state: wgpu::Buffer,
    bins: wgpu::Buffer,
    /// Workgroups of the next pass, written by turns.
    workgroups: [wgpu::Buffer; 2],
    passes: TessellationPasses,
    /// By level; the first is for all of [`FIRST_LEVELS`].
    levels: Vec<wgpu::BindGroup>,
    /// For passes that write to the first or the second of `workgroups`.
    turns: [wgpu::BindGroup; 2],
    drawing: wgpu::BindGroup,
    triangles: Triangles,
    /// Pixels asked for last.
    tolerance: f32,
}

/// Cells that there is room for: so many for each triangle allowed, and some beside. Where no limit binds, 0.6 to 0.8 are looked at for each triangle drawn; where one
/// does, up to 1.5, and four where it allows only hundreds.
const CELLS_A_TRIANGLE: u64 = 2;
const CELLS_BESIDE: u64 = 4096;
/// Levels that one workgroup does.
const FIRST_LEVELS: u8 = 5;
/// Threads of a workgroup.
const THREADS: u64 = 256;
/// Bins of the census: see `Census` of the processor's twin.
const BINS: u64 = (0x7f80_0000 >> 15) + 1;
/// From one level's number to the next in the buffer of numbers.
const NUMBER: u64 = 256;

impl Tessellator {
    /// Brings a land to the device: heights, ranges and errors, about fifteen bytes a sample. Nothing finer than its samples is drawn, and fewer triangles than
    /// `limits` allow if the device's buffers hold no more.
    ///
    /// # Errors
    /// If the land has more samples along a side than the device's textures.
    pub fn new(gpu: &Gpu, passes: &TessellationPasses, land: &Land, limits: Limits) -> Result<Tessellator, TooLarge> {
        let triangles = limits.triangles.max(64) as u64;
        Tessellator::with_room(
            gpu,
            passes,
            land,
            limits,
            CELLS_A_TRIANGLE.saturating_mul(triangles).saturating_add(CELLS_BESIDE),
        )
    }

    /// The same, with room for so many cells that are looked at, at least 64 and 48 bytes each. Where it does not do, the tolerance rises.
    ///
    /// # Errors
    /// As [`Tessellator::new`].
    pub fn with_room(
        gpu: &Gpu,
        passes: &TessellationPasses,
        land: &Land,
        limits: Limits,
        cells: u64,
    ) -> Result<Tessellator, TooLarge> {
        let device = &gpu.device;
        let on_device = DeviceLand::new(gpu, land)?;
        let finest = limits.finest.min(land.finest_level());
        let largest = device.limits().max_storage_buffer_binding_size.min(device.limits().max_buffer_size);
        let vertex = size_of::<Vertex>() as u64;
        // Small lands have no more cells than that.
        let all = 1u64 << (2 * finest);
        let most =
            (limits.triangles as u64).min(2 * all).max(64).min(largest / (3 * vertex)).min(u64::from(u32::MAX / 8));
        let workgroups = u64::from(device.limits().max_compute_workgroups_per_dimension);
        let room = cells.min(2 * all).max(64).min(largest / 16).min(workgroups * THREADS);

        use wgpu::BufferUsages as Usage;
        let buffer = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let storage = Usage::STORAGE;
        let sight = buffer("tessellation: sight", size_of::<Sight>() as u64, Usage::UNIFORM | Usage::COPY_DST);
        let numbers =
            buffer("tessellation: numbers", NUMBER * (u64::from(finest) + 1), Usage::UNIFORM | Usage::COPY_DST);
        for level in 0..=finest {
            gpu.queue.write_buffer(&numbers, NUMBER * u64::from(level), &u32::from(level).to_ne_bytes());
        }
        let state = buffer("tessellation: state", size_of::<State>() as u64, storage | Usage::COPY_SRC);
        let places = buffer("tessellation: places", 16 * room, storage);
        let beside = buffer("tessellation: neighbours", 16 * room, storage);
        let looks = buffer("tessellation: looks", 16 * room, storage);
        let bins = buffer("tessellation: census", 4 * BINS, storage | Usage::COPY_DST);
        let turn = || buffer("tessellation: workgroups", 24, storage | Usage::INDIRECT);
        let turns = [turn(), turn()];
        let (triangles, [vertices, corners, drawn]) = Triangles::made(gpu, 3 * most, most);

        let group = |number: u8, layout: &wgpu::BindGroupLayout, more: &[&wgpu::Buffer]| {
            let views =
                [on_device.cells(number), &on_device.heights].map(|texture| texture.create_view(&Default::default()));
            let number = wgpu::BufferBinding {
                buffer: &numbers,
                offset: NUMBER * u64::from(number),
                size: wgpu::BufferSize::new(4),
            };
            let mut resources = vec![
                sight.as_entire_binding(),
                wgpu::BindingResource::Buffer(number),
                wgpu::BindingResource::TextureView(&views[0]),
                wgpu::BindingResource::TextureView(&views[1]),
            ];
            let lists = [&state, &places, &beside, &looks];
            resources.extend(lists.into_iter().chain(more.iter().copied()).map(wgpu::Buffer::as_entire_binding));
            bindings::group(device, "tessellation", layout, resources)
        };
        Ok(Tessellator {
            passes: passes.clone(),
            levels: (0..=finest).map(|number| group(number, &passes.level, &[&bins])).collect(),
            turns: [0, 1]
                .map(|turn| bindings::group(device, "tessellation", &passes.turn, [turns[turn].as_entire_binding()])),
            drawing: group(finest, &passes.drawing, &[&vertices, &corners, &drawn]),
            land: on_device,
            finest,
            most: most as u32,
            room: room as u32,
            sight,
            state,
            bins,
            workgroups: turns,
            triangles,
            tolerance: 0.0,
        })
    }

    /// Records the passes that tessellate the land for a view, one view a submission: [`Tessellator::triangles`] are then those of that view. `timestamps`
    /// are written at the beginning and the end of the passes.
    ///
    /// # Errors
    /// If the view is not one that a picture can be drawn of; then nothing is recorded.
    pub fn tessellate(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) -> Result<(), ViewError> {
        let sight = self.sight(view)?;
        self.tolerance = sight.tolerance;
        gpu.queue.write_buffer(&self.sight, 0, bytemuck::bytes_of(&sight));
        encoder.clear_buffer(&self.bins, 0, None);
        if let Some(drawn) = &self.triangles.drawn {
            encoder.clear_buffer(drawn, 0, None);
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("tessellation"),
            timestamp_writes: timestamps,
        });
        // How many workgroups go over a level's list is in one of two buffers: *settle* of the level above wrote it while passes went by the other.
        let of = |level: u8| usize::from(level) % 2;
        let first = self.finest.min(FIRST_LEVELS - 1);
        pass.set_pipeline(&self.passes.first_levels);
        pass.set_bind_group(0, &self.levels[0], &[]);
        pass.set_bind_group(1, &self.turns[of(first + 1)], &[]);
        pass.dispatch_workgroups(1, 1, 1);
        for level in first + 1..=self.finest {
            pass.set_bind_group(0, &self.levels[usize::from(level)], &[]);
            if level > first + 1 {
                pass.set_pipeline(&self.passes.cut);
                pass.dispatch_workgroups_indirect(&self.workgroups[of(level - 1)], 0);
            }
            if level < self.finest {
                pass.set_pipeline(&self.passes.count);
                pass.dispatch_workgroups_indirect(&self.workgroups[of(level)], 0);
            }
            pass.set_pipeline(&self.passes.settle);
            pass.set_bind_group(1, &self.turns[of(level + 1)], &[]);
            pass.dispatch_workgroups(1, 1, 1);
        }
        pass.set_pipeline(&self.passes.draw);
        pass.set_bind_group(0, &self.drawing, &[]);
        pass.dispatch_workgroups_indirect(&self.workgroups[of(self.finest + 1)], 12);
        Ok(())
    }

    /// The triangles, for [`Renderer::draw`](crate::Renderer::draw): as many as the device finds when it comes to them.
    pub fn triangles(&self) -> &Triangles {
        &self.triangles
    }

    /// The limits that it keeps: those asked for, as far as the samples and the device's buffers go.
    pub fn limits(&self) -> Limits {
        Limits { finest: self.finest, triangles: self.most as usize }
    }

    /// What a view amounts to.
    fn sight(&self, view: &View) -> Result<Sight, ViewError> {
        let land = &self.land;
        let metric = ScreenMetric::on_plane(view, land.datum)?;
        let (forward, sides, focal, stretch) = metric.lens();
        let step = land.size / f64::from(1u32 << Cell::MAX_LEVEL);
        let steps = (view.eye.truncate() - land.origin) / step;
        // Differences of lattice points are whole numbers of 32 bits: the eye is counted from the land's nearest point.
        let whole = steps.floor().clamp(DVec2::ZERO, DVec2::splat(f64::from(1u32 << Cell::MAX_LEVEL)));
        let height = view.eye.z as f32;
        let (base, height_step) = land.scale;
        Ok(Sight {
            sides: sides.map(|side| side.extend(0.0).to_array()),
            forward: Vec4::from((forward, View::NEAR)).to_array(),
            eye_steps: [whole.x as u32, whole.y as u32],
            rest: (steps - whole).as_vec2().to_array(),
            step: step.as_vec2().to_array(),
            eye_height: [height, (view.eye.z - f64::from(height)) as f32],
            focal,
            stretch,
            tolerance: metric.tolerance(),
            base,
            height_step,
            // Two roundings of numbers no larger than these.
            height_slack: (base.abs() + 65_536.0 * height_step) * f32::EPSILON,
            most: self.most,
            room: self.room,
            finest: self.finest.into(),
            samples_level: land.finest.into(),
            columns: land.columns,
            rows: land.rows,
        })
    }

    /// What the tessellation that was submitted last came to. Waits for the device: for tests and tools.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn read(&self, gpu: &Gpu) -> Result<Tessellated, GpuError> {
        let bytes = read(gpu, &self.state, size_of::<State>() as u64)?;
        let state: State = bytemuck::pod_read_unaligned(&bytes);
        let triangles = self.triangles.number_made(gpu)?;
        let reached = Reached { pixels: state.reached, limited: state.reached > self.tolerance };
        Ok(Tessellated { reached, triangles, vertices: state.vertices, looked_at: state.used })
    }

    /// The triangles that were submitted last, read back. Waits for the device: for tests and tools.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn mesh(&self, gpu: &Gpu) -> Result<Mesh, GpuError> {
        let Tessellated { triangles, vertices, .. } = self.read(gpu)?;
        self.triangles.read(gpu, vertices, triangles)
    }
}
