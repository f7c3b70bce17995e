//! Longest-edge bisection on the device, gone on with from view to view: what is worth it is split, what is no longer is merged.
//!
//! A mesh is the set of diamonds that are split (see `lod/roam/diamond.rs`), kept as a concurrent binary tree: a bit for each diamond of the land, which threads set and
//! clear as they come, under sums of how many are set before. So whoever is split has a rank, which is its vertex, and the mesh is indexed without any sorting.
//!
//! The bounds of [`NestedBounds`] make all decisions independent of each other: what needs a diamond never has a greater priority. So a diamond is merged when its own
//! priority falls below the tolerance, however many were split below it, since they all fall with it; and no split is ever forced: whoever is above the tolerance finds its
//! parents split, or about to be. A view takes these passes. *Look* goes over what is split, measures and merges it, and splits those of its children whose other
//! parent is split; then over those, and so on, as often as the tree is deep: from one frame of a flight to the next, hardly ever. In between *settle* keeps a
//! census and raises the tolerance where triangles run out. *Sum* and *place* number what is split, *draw* puts out vertices and triangles. The processor records the same commands
//! for every view and reads nothing back.
//!
//! The mesh depends on the view alone and not on the way to it. Its twin is [`littoral::lod::RoamOnce`], which finds it on the processor; where triangles run out that takes
//! the last of them one by one, this by bins of which 256 make an octave.
//!
//! Works this rests on: J. Dupuy, "Concurrent binary trees", 2020 (bits under sums); A. Benyoub and J. Dupuy, "Concurrent binary trees for large-scale game components",
//! 2024 (splits and merges of every frame, which there wait for and force each other); M. Duchaineau et al., "ROAMing terrain", 1997.

use crate::bindings;
use crate::compute::{VOID, numbers, read};
use crate::device::{Gpu, GpuError};
use crate::scenery::TooLarge;
use crate::tessellator::Tessellated;
use crate::triangles::Triangles;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, UVec2, Vec4};
use littoral::lod::{Limits, Mesh, NestedBounds, Reached, ScreenMetric, Vertex, ViewError};
use littoral::space::{Datum, View};

/// The shaders of a bisection with their names, as they are compiled: for tests that need no device.
pub const BISECTION_SHADERS: [(&str, &str); 2] = [
    ("bisect: update", concat!(include_str!("shaders/bisect.wgsl"), include_str!("shaders/bisect_update.wgsl"))),
    ("bisect: draw", concat!(include_str!("shaders/bisect.wgsl"), include_str!("shaders/bisect_draw.wgsl"))),
];

/// What every pass is told of the view and the land: see `Sight` in bisect.wgsl, field by field.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Sight {
    sides: [[f32; 4]; 4],
    forward: [f32; 4],
    eye: [i32; 2],
    rest: [f32; 2],
    scale: [f32; 2],
    height: f32,
    focal: f32,
    stretch: f32,
    tolerance: f32,
    base: f32,
    height_step: f32,
    most: u32,
    room: u32,
    finest: u32,
    samples_level: u32,
    columns: u32,
    rows: u32,
    diamonds: u32,
    blocks: u32,
    firsts: [[u32; 4]; 16],
}

/// `State` in bisect.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct State {
    tolerance: f32,
    count: i32,
    used: u32,
    listed: u32,
    begin: u32,
    end: u32,
    wave: u32,
    reached: f32,
    lost: u32,
}

/// The diamonds of a land by their numbers, level by level: squares, then sides that run east, then those that run north; row by row.
#[derive(Clone, Debug)]
struct Numbers {
    /// Level of the cells between four samples.
    samples_level: u32,
    samples: UVec2,
    /// Of each level the first square and the first sides.
    firsts: Vec<[u32; 3]>,
    count: u32,
}

impl Numbers {
    fn new(samples_level: u8, [columns, rows]: [u32; 2]) -> Numbers {
        let mut numbers = Numbers {
            samples_level: samples_level.into(),
            samples: UVec2::new(columns, rows),
            firsts: Vec::new(),
            count: 0,
        };
        for level in 0..u32::from(samples_level) {
            let (land, squares) = numbers.cells(level);
            let first = numbers.count;
            let east = first + squares.x * squares.y;
            let north = east + squares.x * (land.y + 1);
            numbers.firsts.push([first, east, north]);
            numbers.count = north + (land.x + 1) * squares.y;
        }
        numbers
    }

    /// Cells of a level over land, and squares that have numbers: beyond one more all are empty, whatever needs them.
    fn cells(&self, level: u32) -> (UVec2, UVec2) {
        let land = ((self.samples - 2) >> (self.samples_level - level)) + 1;
        (land, (land + 1).min(UVec2::splat(1 << level)))
    }

    /// The middle of a diamond, column and row among the samples.
    fn middle(&self, number: u32) -> UVec2 {
        let level = self.firsts.partition_point(|first| first[0] <= number) - 1;
        let (land, squares) = self.cells(level as u32);
        let (base, across, odd) = match self.firsts[level] {
            [_, _, north] if number >= north => (north, land.x + 1, UVec2::new(0, 1)),
            [_, east, _] if number >= east => (east, squares.x, UVec2::new(1, 0)),
            [first, ..] => (first, squares.x, UVec2::ONE),
        };
        let at = UVec2::new((number - base) % across, (number - base) / across);
        (2 * at + odd) << (self.samples_level - level as u32 - 1)
    }
}

/// Bisects a land on the device, from view to view. Made once for a land; made anew when that changes.
#[derive(Debug)]
pub struct Bisector {
    datum: Datum,
    scale: (f32, f32),
    numbers: Numbers,
    finest: u8,
    most: u32,
    room: u32,
    sight: wgpu::Buffer,
    state: wgpu::Buffer,
    bins: wgpu::Buffer,
    workgroups: wgpu::Buffer,
    start: wgpu::ComputePipeline,
    look: wgpu::ComputePipeline,
    settle: wgpu::ComputePipeline,
    rest: wgpu::ComputePipeline,
    drop: wgpu::ComputePipeline,
    sum: wgpu::ComputePipeline,
    place: wgpu::ComputePipeline,
    draw: wgpu::ComputePipeline,
    updating: wgpu::BindGroup,
    dispatching: wgpu::BindGroup,
    drawing: wgpu::BindGroup,
    triangles: Triangles,
    /// Pixels asked for last.
    tolerance: f32,
}

/// Waves of splits that all workgroups do; one workgroup does what is left.
const WAVES: u32 = 4;
/// Diamonds that there is room for: so many for each triangle allowed, and some beside. From frame to frame a sixth of that is used, since a split adds two triangles; the first
/// view takes more where the limit binds, as what the tolerance was raised for stays in the list.
const ROOM_A_TRIANGLE: u64 = 3;
const ROOM_BESIDE: u64 = 4096;
/// Threads of a workgroup.
const THREADS: u64 = 256;
/// Diamonds of a block, and bytes of a word of 32 of them and of a block.
const BLOCK: u32 = 32 * THREADS as u32;
const WORD_BYTES: u64 = 8;
const BLOCK_BYTES: u64 = 12;
/// Bins of the census.
const BINS: u64 = (0x7f80_0000 >> 15) + 1;

impl Bisector {
    /// Brings a land to the device: heights and what [`NestedBounds`] know, about twelve bytes a sample. Nothing finer than its samples is drawn, and fewer triangles
    /// than `limits` allow if the device's buffers hold no more.
    ///
    /// # Errors
    /// If the land has more samples than the device's textures hold.
    pub fn new(gpu: &Gpu, bounds: &NestedBounds, limits: Limits) -> Result<Bisector, TooLarge> {
        let triangles = limits.triangles.max(2) as u64;
        Bisector::with_room(gpu, bounds, limits, ROOM_A_TRIANGLE.saturating_mul(triangles).saturating_add(ROOM_BESIDE))
    }

    /// The same, with room for so many diamonds that are split or found worth it, at least 64 and eight bytes each. Where it does not do,
    /// detail is missing, and what was reached is told.
    ///
    /// # Errors
    /// As [`Bisector::new`].
    pub fn with_room(gpu: &Gpu, bounds: &NestedBounds, limits: Limits, room: u64) -> Result<Bisector, TooLarge> {
        let device = &gpu.device;
        let [columns, rows] = bounds.samples();
        let largest_side = device.limits().max_texture_dimension_2d;
        let too_large = TooLarge { columns: columns as usize, rows: rows as usize, most: largest_side };
        if columns.max(rows) > largest_side {
            return Err(too_large);
        }
        let all = Numbers::new(bounds.finest(), [columns, rows]);
        let width = u64::from(all.count).isqrt().next_power_of_two().clamp(1, largest_side.into()) as u32;
        let height = all.count.div_ceil(width).max(1);
        if height > largest_side {
            return Err(too_large);
        }
        let heights = numbers(
            gpu,
            "heights",
            wgpu::TextureFormat::R32Uint,
            columns as usize,
            rows as usize,
            |row, line: &mut Vec<u32>| {
                let bits = |column| match bounds.sample_height(column, row as u32) {
                    height if height.is_nan() => VOID,
                    height => height.to_bits(),
                };
                line.extend((0..columns).map(bits));
            },
        );
        let known = numbers(
            gpu,
            "bounds",
            wgpu::TextureFormat::Rg32Uint,
            width as usize,
            height as usize,
            |row, line: &mut Vec<u32>| {
                let first = row as u32 * width;
                let end = (first + width).min(all.count);
                let begin = line.len();
                line.extend((first..end).flat_map(|number| {
                    let at = all.middle(number);
                    bounds.packed(at.x, at.y)
                }));
                line.resize(begin + 2 * width as usize, 0);
            },
        );

        let largest = device.limits().max_storage_buffer_binding_size.min(device.limits().max_buffer_size);
        let vertex = size_of::<Vertex>() as u64;
        let workgroups = u64::from(device.limits().max_compute_workgroups_per_dimension);
        let finest = limits.finest.min(bounds.finest());
        // Small lands have no more triangles than that.
        let most = (limits.triangles as u64).clamp(2, 2 << (2 * finest)).min(largest / vertex - 4).min(1 << 27);
        let room = room.max(64).min(2 * u64::from(all.count) + 64).min(largest / 8).min(workgroups * THREADS - 1);
        let blocks = all.count.div_ceil(BLOCK).max(1);

        use wgpu::BufferUsages as Usage;
        let buffer = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let storage = Usage::STORAGE;
        let sight = buffer("bisection: sight", size_of::<Sight>() as u64, Usage::UNIFORM | Usage::COPY_DST);
        let state = buffer("bisection: state", size_of::<State>() as u64, storage | Usage::COPY_SRC);
        let words = buffer("bisection: words", WORD_BYTES * THREADS * u64::from(blocks), storage);
        let sums = buffer("bisection: blocks", BLOCK_BYTES * u64::from(blocks), storage);
        let list = buffer("bisection: list", 8 * room, storage);
        let bins = buffer("bisection: census", 4 * BINS, storage | Usage::COPY_DST);
        let turns = buffer("bisection: workgroups", 48, storage | Usage::INDIRECT);
        let (triangles, [vertices, corners, drawn]) = Triangles::made(gpu, most + 4, most);

        let (uniform, texels, write) = (bindings::uniform(false), bindings::numbers(), bindings::storage(false));
        let layout = |types: &[wgpu::BindingType]| {
            bindings::group_layout(device, "bisection", wgpu::ShaderStages::COMPUTE, types)
        };
        let shared = [uniform, texels, texels, write, write, write, write];
        let update_layout = layout(&[&shared[..], &[write]].concat());
        let turn_layout = layout(&[write]);
        let draw_layout = layout(&[&shared[..], &[write, write, write]].concat());
        let views = [&heights, &known].map(|texture| texture.create_view(&Default::default()));
        let group = |layout: &wgpu::BindGroupLayout, more: &[&wgpu::Buffer]| {
            let mut resources = vec![
                sight.as_entire_binding(),
                wgpu::BindingResource::TextureView(&views[0]),
                wgpu::BindingResource::TextureView(&views[1]),
            ];
            let buffers = [&words, &sums, &list, &state];
            resources.extend(buffers.into_iter().chain(more.iter().copied()).map(wgpu::Buffer::as_entire_binding));
            bindings::group(device, "bisection", layout, resources)
        };
        let [update, draw] = BISECTION_SHADERS.map(|(label, source)| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        });
        let pipeline = |module, entry, groups: &[&wgpu::BindGroupLayout]| {
            let layout = bindings::pipeline_layout(device, "bisection", groups);
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&layout),
                module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        let alone = [&update_layout];
        let both = [&update_layout, &turn_layout];
        let out = [&draw_layout];
        Ok(Bisector {
            datum: bounds.datum(),
            scale: bounds.scale(),
            finest,
            most: most as u32,
            room: room as u32,
            start: pipeline(&update, "start", &both),
            look: pipeline(&update, "look", &alone),
            settle: pipeline(&update, "settle", &both),
            rest: pipeline(&update, "rest", &both),
            drop: pipeline(&update, "drop", &alone),
            sum: pipeline(&update, "sum", &both),
            place: pipeline(&draw, "place", &out),
            draw: pipeline(&draw, "draw", &out),
            updating: group(&update_layout, &[&bins]),
            dispatching: bindings::group(device, "bisection", &turn_layout, [turns.as_entire_binding()]),
            drawing: group(&draw_layout, &[&vertices, &corners, &drawn]),
            numbers: all,
            sight,
            state,
            bins,
            workgroups: turns,
            triangles,
            tolerance: 0.0,
        })
    }

    /// Records the passes that go on to a view, one view a submission: [`Bisector::triangles`] are then those of that view. `timestamps` are written at the beginning and the
    /// end of the passes.
    ///
    /// # Errors
    /// If the view is not one that a picture can be drawn of; then nothing is recorded.
    pub fn bisect(
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
            label: Some("bisection"),
            timestamp_writes: timestamps,
        });
        // Where the numbers of workgroups lie: over what is looked at next, over all the list, over busy blocks, over what is split.
        let [next, all, busy, split] = [0, 12, 24, 36];
        pass.set_bind_group(0, &self.updating, &[]);
        pass.set_bind_group(1, &self.dispatching, &[]);
        pass.set_pipeline(&self.start);
        pass.dispatch_workgroups(1, 1, 1);
        for _ in 0..WAVES {
            pass.set_pipeline(&self.look);
            pass.dispatch_workgroups_indirect(&self.workgroups, next);
            pass.set_pipeline(&self.settle);
            pass.dispatch_workgroups(1, 1, 1);
        }
        pass.set_pipeline(&self.rest);
        pass.dispatch_workgroups(1, 1, 1);
        pass.set_pipeline(&self.drop);
        pass.dispatch_workgroups_indirect(&self.workgroups, all);
        pass.set_pipeline(&self.sum);
        pass.dispatch_workgroups(1, 1, 1);
        pass.set_bind_group(0, &self.drawing, &[]);
        pass.set_pipeline(&self.place);
        pass.dispatch_workgroups_indirect(&self.workgroups, busy);
        pass.set_pipeline(&self.draw);
        pass.dispatch_workgroups_indirect(&self.workgroups, split);
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
        let metric = ScreenMetric::on_plane(view, self.datum)?;
        let (origin, size) = match self.datum {
            Datum::Plane { origin, size } => (origin, size),
            Datum::Ellipsoid { .. } => return Err(ViewError::Ellipsoid),
        };
        let (forward, sides, focal, stretch) = metric.lens();
        let all = &self.numbers;
        let scale = size / f64::from(2u32 << all.samples_level);
        let at = (view.eye.truncate() - origin) / scale;
        // Differences of places are whole numbers of 32 bits.
        let whole = at.floor().clamp(DVec2::splat(-1e9), DVec2::splat(1e9));
        let mut firsts = [[0; 4]; 16];
        firsts.iter_mut().zip(&all.firsts).for_each(|(to, &[first, east, north])| *to = [first, east, north, 0]);
        Ok(Sight {
            sides: sides.map(|side| side.extend(0.0).to_array()),
            forward: Vec4::from((forward, View::NEAR)).to_array(),
            eye: [whole.x as i32, whole.y as i32],
            rest: ((at - whole) * scale).as_vec2().to_array(),
            scale: scale.as_vec2().to_array(),
            height: view.eye.z as f32,
            focal,
            stretch,
            tolerance: metric.tolerance(),
            base: self.scale.0,
            height_step: self.scale.1,
            most: self.most,
            room: self.room,
            finest: self.finest.into(),
            samples_level: all.samples_level,
            columns: all.samples.x,
            rows: all.samples.y,
            diamonds: all.count,
            blocks: all.count.div_ceil(BLOCK).max(1),
            firsts,
        })
    }

    /// What the bisection that was submitted last came to. Waits for the device: for tests and tools.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn read(&self, gpu: &Gpu) -> Result<Tessellated, GpuError> {
        let state: State = bytemuck::pod_read_unaligned(&read(gpu, &self.state, size_of::<State>() as u64)?);
        let triangles = self.triangles.number_made(gpu)?;
        let pixels = if state.lost == 0 { state.reached } else { f32::INFINITY };
        let reached = Reached { pixels, limited: state.reached > self.tolerance };
        Ok(Tessellated { reached, triangles, vertices: state.listed + 4, looked_at: state.used })
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

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::{Land, Raster};

    /// Every diamond has one number, and none that has not knows of any surface.
    #[test]
    fn what_has_no_number_is_empty() {
        for (columns, rows) in [(2, 2), (2, 9), (3, 3), (17, 5), (40, 33), (64, 65), (5, 130)] {
            let heights = (0..columns * rows).map(|i| (i * 7919 % 101) as f32).collect();
            let land = Land::new(Raster::new(columns, rows, DVec2::ONE, heights).expect("a raster"));
            let bounds = NestedBounds::of(&land).expect("small");
            let all = Numbers::new(bounds.finest(), bounds.samples());
            let side = 1u32 << bounds.finest();
            let mut has = vec![false; ((side + 1) * (side + 1)) as usize];
            for number in 0..all.count {
                let at = all.middle(number);
                let place = &mut has[(at.y * (side + 1) + at.x) as usize];
                assert!(!std::mem::replace(place, true), "{at} has two numbers, for {columns} × {rows}");
            }
            for (i, has) in (0..).zip(has) {
                let (x, y) = (i % (side + 1), i / (side + 1));
                let corner = x % side == 0 && y % side == 0;
                assert!(!(corner && has));
                if !has && !corner {
                    let [_, heights] = bounds.packed(x, y);
                    assert!(heights & 0xffff > heights >> 16, "{x}, {y} of {columns} × {rows} has no number");
                }
            }
        }
    }
}
