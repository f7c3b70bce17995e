//! The waves of a scenery: a sea of the engine on the device, the grid that it is drawn on, and the passes that find where it is seen and what it is like there.
//!
//! 1. In compute, the points of a grid ([`grid`]) go where their water is at the instant.
//! 2. As triangles they cover, nearest first, what of the water may be before the ground; every pixel of it works out slopes, hidden slopes and foam where its
//!    water rests, which the triangles tell: nothing is searched for.
//!
//! Light falls on it in the pass that shades everything else.

mod grid;

use crate::renderer::drawable;
use crate::sea::{self, GpuSea, shore::GpuShore};
use crate::{Gpu, GpuError, bindings};
use glam::{DVec2, UVec2};
use grid::WaveGrid;
use littoral::field::{Finest, Sea};
use littoral::space::View;
use littoral::waves::cascades::Cascades;
use littoral::waves::{Bounds, Sheltered, ShoreSea, WaveModel};
use std::any::Any;
use std::sync::atomic::{AtomicU64, Ordering};

/// The functions that tell the waves at a place, for two bind groups from a number on.
pub(crate) fn waves_source(group: u32) -> String {
    let shore = include_str!("shaders/sea_shore.wgsl");
    sea::sample_source(group) + &shore.replace("@group(GROUP)", &format!("@group({})", group + 1))
}

/// The shaders of the passes, with their names.
pub fn wave_shaders() -> [(&'static str, String); 2] {
    let frame = include_str!("shaders/frame.wgsl");
    let (grid, waves) = (include_str!("shaders/wave_grid.wgsl"), waves_source(1));
    let noise = include_str!("shaders/noise.wgsl");
    [
        ("wave points", [frame, grid, &waves, include_str!("shaders/wave_points.wgsl")].concat()),
        ("waves seen", [frame, noise, grid, &waves, include_str!("shaders/wave_seen.wgsl")].concat()),
    ]
}

/// Why a sea has no waves on the device.
#[derive(Debug, thiserror::Error)]
pub enum WavesError {
    /// Too large for the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Made of waves that it does not know.
    #[error(
        "expected a sea of tiles, with waves over a bed or without, got another model of waves: the GPU does not draw that yet; draw it on the processor"
    )]
    Unknown,
}

/// The waves of a sea at an instant, on the device: for [`Scenery::set_waves`](crate::Scenery::set_waves). To make them takes as long as their shaders take to compile.
pub struct Waves {
    tiles: GpuSea,
    shore: GpuShore,
    finest: Finest,
    bounds: Bounds,
    level: f64,
    time: f64,
    /// Tells one instant of one sea from all others.
    instant: u64,
    /// How high swash reaches above still water (m): what the pass that shades is bound to, and the nodes of the bed that it is known at.
    pub(crate) run_up: (wgpu::BindGroup, DVec2, DVec2),
}

impl std::fmt::Debug for Waves {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Waves").field("shore", &self.shore).field("time", &self.time).finish_non_exhaustive()
    }
}

/// The models of a sea that can be drawn.
struct Parts<'a> {
    shore: Option<&'a ShoreSea>,
    sheltered: Option<&'a Sheltered>,
    tiles: &'a Cascades,
}

fn parts(sea: &Sea) -> Option<Parts<'_>> {
    let (mut shore, mut sheltered, mut tiles) = (None, None, None);
    let cascades = |model: &'_ dyn WaveModel| (model as &dyn Any).is::<Cascades>();
    for model in sea.models() {
        let any: &dyn Any = model;
        if let (Some(found), None) = (any.downcast_ref::<ShoreSea>(), shore) {
            shore = Some(found);
        } else if let (Some(found), None) = (any.downcast_ref::<Cascades>(), tiles) {
            tiles = Some(found);
        } else if let (Some(found), None) = (any.downcast_ref::<Sheltered>().filter(|s| cascades(s.model())), tiles) {
            sheltered = Some(found);
            tiles = (found.model() as &dyn Any).downcast_ref();
        } else {
            return None;
        }
    }
    Some(Parts { shore, sheltered, tiles: tiles? })
}

fn next_instant() -> u64 {
    static INSTANTS: AtomicU64 = AtomicU64::new(0);
    INSTANTS.fetch_add(1, Ordering::Relaxed)
}

impl Waves {
    /// The waves of a sea where it stands; `None` if it has none.
    ///
    /// # Errors
    /// If they are made in ways that the device does not know, or do not fit into its memory.
    pub fn new(gpu: &Gpu, sea: &Sea) -> Result<Option<Waves>, WavesError> {
        if sea.models().next().is_none() {
            return Ok(None);
        }
        let parts = parts(sea).ok_or(WavesError::Unknown)?;
        let tables = parts.shore.map(ShoreSea::tables);
        let (mut size, mut nodes) = ([1, 1], (DVec2::ZERO, DVec2::ONE));
        let mut reach = vec![0.0f32];
        if let Some(tables) = &tables {
            (size, nodes) = ([tables.columns as u32, tables.rows as u32], (tables.origin, tables.spacing));
            // Set-up and swing.
            let high = |place: &[f32; 8]| place[6] + ShoreSea::FARTHEST_SWASH * place[7];
            reach = tables.places[..tables.columns * tables.rows].iter().map(high).collect();
        }
        let mut waves = Waves {
            tiles: GpuSea::new(gpu, parts.tiles)?,
            shore: GpuShore::new(gpu, tables, parts.sheltered.map(Sheltered::shelter))?,
            finest: sea.finest(),
            bounds: Bounds::default(),
            level: sea.level(),
            time: f64::NAN,
            instant: 0,
            run_up: (run_up(gpu, size, &reach), nodes.0, nodes.1),
        };
        waves.follow(gpu, sea);
        Ok(Some(waves))
    }

    /// Goes to the instant at which a sea stands: the one that it was made of.
    pub(crate) fn follow(&mut self, gpu: &Gpu, sea: &Sea) {
        self.time = sea.time();
        self.bounds = sea.bounds();
        self.instant = next_instant();
        // Where a processor does the device's work its own transforms are faster.
        let copied = gpu.is_software() && parts(sea).is_some_and(|parts| self.tiles.copy(parts.tiles));
        if !copied {
            self.tiles.set_time(sea.time());
        }
    }

    /// The instant (s).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Ripples finer than the waves.
    pub(crate) fn finest(&self) -> Finest {
        self.finest
    }
}

/// How high swash reaches, on so many columns and rows of nodes, for the pass that shades.
pub(crate) fn run_up(gpu: &Gpu, [columns, rows]: [u32; 2], reach: &[f32]) -> wgpu::BindGroup {
    let (format, flat) = (wgpu::TextureFormat::R32Float, wgpu::TextureDimension::D2);
    let map = crate::scenery::texture(gpu, "run-up", format, [columns, rows, 1], flat, bytemuck::cast_slice(reach));
    let view = map.create_view(&Default::default());
    let layout = run_up_layout(&gpu.device);
    bindings::group(&gpu.device, "run-up", &layout, [wgpu::BindingResource::TextureView(&view)])
}

/// The layout of that group.
pub(crate) fn run_up_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let map = bindings::texels(wgpu::TextureViewDimension::D2);
    bindings::group_layout(device, "run-up", wgpu::ShaderStages::FRAGMENT, &[map])
}

/// What is known of the sea in each pixel of a canvas.
#[derive(Debug)]
pub(crate) struct Wet {
    /// Pixels.
    pub size: UVec2,
    /// As far away as the sea.
    pub depth: wgpu::TextureView,
    /// What `wave_seen.wgsl` tells.
    pub seen: wgpu::TextureView,
}

impl Wet {
    /// For pictures of a size.
    pub fn new(gpu: &Gpu, size: UVec2, depth: wgpu::TextureFormat) -> Wet {
        let make = |label, format| {
            let texture = drawable(gpu, label, size, format, wgpu::TextureUsages::empty());
            texture.create_view(&Default::default())
        };
        Wet { size, depth: make("depth of the sea", depth), seen: make("sea seen", wgpu::TextureFormat::Rgba32Uint) }
    }
}

/// `Grid` of the shaders.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct GridUniform {
    fan: [f32; 4],
    size: [u32; 4],
    far: [f32; 4],
}

/// What the passes are bound to, as long as it is the same rings, points and distances of the ground.
#[derive(Debug)]
struct Bound {
    of: (wgpu::Buffer, wgpu::Buffer, wgpu::TextureView),
    moving: wgpu::BindGroup,
    seeing: wgpu::BindGroup,
}

/// The passes that draw waves.
#[derive(Debug)]
pub(crate) struct WavePass {
    move_points: wgpu::ComputePipeline,
    seen: wgpu::RenderPipeline,
    grid: wgpu::Buffer,
    radii: Option<wgpu::Buffer>,
    points: Option<wgpu::Buffer>,
    bound: Option<Bound>,
    /// The view and the instant that the points are for, and how many: a ring, rings.
    drawn: Option<(View, u64, [u32; 2])>,
}

impl WavePass {
    /// Passes for canvases of a format of depth.
    pub fn new(gpu: &Gpu, depth: wgpu::TextureFormat) -> WavePass {
        let device = &gpu.device;
        let [points, seen] = wave_shaders().map(|(label, source)| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        });
        let (tiles, shore) = (sea::sample::layout(device), sea::shore::layout(device));
        let layout = |own| bindings::pipeline_layout(device, "waves", &[&own, &tiles, &shore]);
        let move_points = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("wave points"),
            layout: Some(&layout(moving_layout(device))),
            module: &points,
            entry_point: Some("move_points"),
            compilation_options: Default::default(),
            cache: None,
        });
        let seen = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("waves seen"),
            layout: Some(&layout(seeing_layout(device))),
            vertex: wgpu::VertexState {
                module: &seen,
                entry_point: Some("wave"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { topology: wgpu::PrimitiveTopology::TriangleStrip, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: depth,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &seen,
                entry_point: Some("wet"),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::TextureFormat::Rgba32Uint.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let grid = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("wave grid"),
            size: size_of::<GridUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        WavePass { move_points, seen, grid, radii: None, points: None, bound: None, drawn: None }
    }

    /// Records the passes that find the sea, given how far the ground is. `land` is the land's rectangle (m).
    #[allow(clippy::too_many_arguments, reason = "what a frame is made of")]
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        uniforms: &wgpu::Buffer,
        waves: &Waves,
        land: (DVec2, DVec2),
        view: &View,
        ground: &wgpu::TextureView,
        wet: &Wet,
    ) {
        let eye = view.eye.truncate();
        waves.tiles.set_origin(eye);
        waves.shore.set(gpu, eye, waves.time);
        if !self.drawn.is_some_and(|(of, instant, _)| (of, instant) == (*view, waves.instant)) {
            self.drawn = None;
            let border = (land.0 - eye).abs().max((land.1 - eye).abs()).length();
            if let Some(grid) = WaveGrid::of(view, waves.level, &waves.bounds, border) {
                let size = self.set_grid(gpu, &grid);
                self.drawn = Some((*view, waves.instant, size));
                self.bind(gpu, uniforms, ground);
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some("wave points"),
                    timestamp_writes: gpu.compute_times("wave points"),
                });
                pass.set_pipeline(&self.move_points);
                let own = self.bound.as_ref().map(|bound| &bound.moving);
                pass.set_bind_group(0, own, &[]);
                pass.set_bind_group(1, waves.tiles.sample_group(), &[]);
                pass.set_bind_group(2, waves.shore.group(), &[]);
                pass.dispatch_workgroups(size[0].div_ceil(64), size[1], 1);
            }
        }
        let size = self.drawn.map_or([0, 0], |drawn| drawn.2);
        self.bind(gpu, uniforms, ground);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("waves"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &wet.seen,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &wet.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: gpu.render_times("waves"),
            ..Default::default()
        });
        if size[1] < 2 {
            return;
        }
        pass.set_pipeline(&self.seen);
        pass.set_bind_group(0, self.bound.as_ref().map(|bound| &bound.seeing), &[]);
        pass.set_bind_group(1, waves.tiles.sample_group(), &[]);
        pass.set_bind_group(2, waves.shore.group(), &[]);
        pass.draw(0..2 * size[0], 0..size[1] - 1);
    }

    /// Tells shaders a grid, and makes room for its points. How many they are: a ring, rings.
    fn set_grid(&mut self, gpu: &Gpu, grid: &WaveGrid) -> [u32; 2] {
        let size = [grid.columns as u32, grid.rings() as u32];
        let last = grid.radii[grid.rings() - 1];
        let far = if grid.reaches_horizon { [0.8 * last, 0.97 * last] } else { [f32::MAX, f32::INFINITY] };
        let uniform = GridUniform {
            fan: [grid.first, grid.step, grid.middle.x, grid.middle.y].map(|v| v as f32),
            size: [size[0], size[1], grid.circle as u32, 0],
            far: [far[0], far[1], 0.0, 0.0],
        };
        gpu.queue.write_buffer(&self.grid, 0, bytemuck::bytes_of(&uniform));
        let storage = wgpu::BufferUsages::STORAGE;
        crate::triangles::fill(gpu, &mut self.radii, "wave rings", storage, bytemuck::cast_slice(&grid.radii));
        let bytes = 16 * u64::from(size[0]) * u64::from(size[1]);
        if self.points.as_ref().is_none_or(|points| points.size() < bytes) {
            self.points = Some(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("wave points"),
                size: bytes + bytes / 4,
                usage: storage,
                mapped_at_creation: false,
            }));
        }
        size
    }

    /// Makes what the passes are bound to, if it is not that already.
    fn bind(&mut self, gpu: &Gpu, uniforms: &wgpu::Buffer, ground: &wgpu::TextureView) {
        let (Some(radii), Some(points)) = (&self.radii, &self.points) else { return };
        let of = (radii.clone(), points.clone(), ground.clone());
        if self.bound.as_ref().is_some_and(|bound| bound.of == of) {
            return;
        }
        let device = &gpu.device;
        let own = || [uniforms, &self.grid, radii, points].map(wgpu::Buffer::as_entire_binding);
        let ground = wgpu::BindingResource::TextureView(ground);
        let moving = bindings::group(device, "wave points", &moving_layout(device), own());
        let seeing = bindings::group(device, "waves seen", &seeing_layout(device), own().into_iter().chain([ground]));
        self.bound = Some(Bound { of, moving, seeing });
    }
}

/// Frame, grid, radii and points to be written.
fn moving_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let (uniform, storage) = (bindings::uniform(false), bindings::storage);
    let types = [uniform, uniform, storage(true), storage(false)];
    bindings::group_layout(device, "wave points", wgpu::ShaderStages::COMPUTE, &types)
}

/// Frame, grid, radii and points to be drawn, and how far away the ground is.
fn seeing_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let (uniform, read) = (bindings::uniform(false), bindings::storage(true));
    let types = [uniform, uniform, read, read, bindings::depths()];
    bindings::group_layout(device, "waves seen", wgpu::ShaderStages::VERTEX_FRAGMENT, &types)
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::{HeightField, Water, coast};
    use littoral::waves::random::uniform;
    use littoral::waves::{BLOCK, Motion, Points, SeaState};

    /// Asks the shader's functions about places at rest (from the eye, m) with footprints: sixteen numbers for each.
    fn ask(gpu: &Gpu, waves: &Waves, places: &[[f32; 4]]) -> Vec<[f32; 16]> {
        const KERNEL: &str = "
            @group(2) @binding(0) var<storage, read> asked: array<vec4f>;
            @group(2) @binding(1) var<storage, read_write> told: array<array<vec4f, 4>>;
            @compute @workgroup_size(64)
            fn tell(@builtin(global_invocation_id) id: vec3u) {
                if id.x >= arrayLength(&asked) {
                    return;
                }
                let place = asked[id.x];
                let s = waves_surface(place.xy, place.z);
                let d = waves_displacement(place.xy, place.z);
                told[id.x] = array<vec4f, 4>(vec4f(s.displacement, s.foam), vec4f(s.slope, s.stretch.xy), vec4f(s.stretch.z, s.hidden), vec4f(d, 0.0));
            }";
        let device = &gpu.device;
        let source = waves_source(0) + KERNEL;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let types = [bindings::storage(true), bindings::storage(false)];
        let own = bindings::group_layout(device, "asked", wgpu::ShaderStages::COMPUTE, &types);
        let (tiles, shore) = (sea::sample::layout(device), sea::shore::layout(device));
        let layout = bindings::pipeline_layout(device, "asked", &[&tiles, &shore, &own]);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&layout),
            module: &module,
            entry_point: Some("tell"),
            compilation_options: Default::default(),
            cache: None,
        });
        let buffer = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let asked = buffer(16 * places.len() as u64, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST);
        gpu.queue.write_buffer(&asked, 0, bytemuck::cast_slice(places));
        let told = buffer(64 * places.len() as u64, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let back = buffer(told.size(), wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let bound = bindings::group(device, "asked", &own, [asked.as_entire_binding(), told.as_entire_binding()]);
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            for (number, group) in [waves.tiles.sample_group(), waves.shore.group(), &bound].into_iter().enumerate() {
                pass.set_bind_group(number as u32, group, &[]);
            }
            pass.dispatch_workgroups(places.len().div_ceil(64) as u32, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&told, 0, &back, 0, told.size());
        gpu.queue.submit([encoder.finish()]);
        back.map_async(wgpu::MapMode::Read, .., |_| {});
        device.poll(wgpu::PollType::wait_indefinitely()).expect("a working device");
        let bytes = back.get_mapped_range(..).expect("mapped");
        bytemuck::cast_slice(&bytes).to_vec()
    }

    /// The same from the processor.
    fn expected(sea: &Sea, eye: DVec2, place: &[f32; 4]) -> [f32; 16] {
        let mut points = Points::at(eye.x + f64::from(place[0]), eye.y + f64::from(place[1]));
        points.footprint = [place[2]; BLOCK];
        let mut m = Motion::STILL;
        sea.models().for_each(|model| model.add_motion(&points, &mut m));
        [
            m.dx[0],
            m.dy[0],
            m.dz[0],
            m.foam[0],
            m.slope_x[0],
            m.slope_y[0],
            m.dxx[0],
            m.dxy[0],
            m.dyy[0],
            m.hidden_xx[0],
            m.hidden_xy[0],
            m.hidden_yy[0],
            m.dx[0],
            m.dy[0],
            m.dz[0],
            0.0,
        ]
    }

    #[test]
    fn shaders_know_the_waves_of_the_processor() {
        let gpu = match Gpu::headless() {
            Ok(gpu) => gpu,
            Err(e) => return eprintln!("not tested: {e}"),
        };
        let land = coast::coast();
        let water = Water::flood(&land, 0.0).expect("a sea");
        for (beaufort, time) in [(3.0, 0.0), (8.0, 1234.5)] {
            let state = SeaState::beaufort(beaufort, 0.6).expect("a state");
            let over = Sea::over(&land, &water, &state, &|_| true).expect("a sea");
            let open = Sea::of_state(over.datum(), 0.0, &state).expect("a sea");
            for mut sea in [over, open] {
                sea.set_time(time);
                let waves = Waves::new(&gpu, &sea).expect("known").expect("waves");
                let eye = land.origin() + 0.4 * land.extent();
                waves.tiles.set_origin(eye);
                waves.shore.set(&gpu, eye, time);
                // Near and far, on land and off the grid.
                let number = |i: usize, k: i64| uniform(3, i as i64, k, 0);
                let places: Vec<[f32; 4]> = (0..4000)
                    .map(|i| {
                        let away = 10f64.powf(1.0 + 3.2 * number(i, 0));
                        let place = DVec2::from_angle(6.3 * number(i, 1)) * away;
                        let footprint = [0.0, 0.3, 3.0, 40.0][i % 4];
                        [place.x as f32, place.y as f32, footprint, 0.0]
                    })
                    .collect();
                let told = ask(&gpu, &waves, &places);
                let expected: Vec<_> = places.iter().map(|place| expected(&sea, eye, place)).collect();
                for field in 0..15 {
                    let square: f64 = expected.iter().map(|e| f64::from(e[field]).powi(2)).sum();
                    let rms = (square / expected.len() as f64).sqrt().max(1e-9);
                    let off = |i: usize| f64::from(told[i][field] - expected[i][field]).abs() / rms;
                    assert!(told.iter().all(|t| t[field].is_finite()), "field {field}");
                    let mean = (0..places.len()).map(off).sum::<f64>() / places.len() as f64;
                    // Of slopes it is the place in the finest tile that counts, which 32 bits tell to a millimetre 15 km away.
                    let most = if (4..9).contains(&field) { 2e-3 } else { 2e-4 };
                    assert!(mean < most, "field {field}, Beaufort {beaufort}: {mean} of {rms} off in the mean");
                    let near = |i: usize| places[i][0].hypot(places[i][1]) < 1000.0;
                    let worst = (0..places.len()).filter(|&i| near(i)).map(off).fold(0.0, f64::max);
                    assert!(worst < 0.03, "field {field}, Beaufort {beaufort}: {worst} of {rms} off");
                }
            }
        }
    }
}
