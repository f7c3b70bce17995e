//! A sea over a bed on the device: nodes and waves of a [`ShoreSea`](littoral::waves::ShoreSea), and what shelters the tiles, for `sea_shore.wgsl`.

use crate::{Gpu, GpuError, bindings};
use glam::DVec2;
use littoral::waves::{Shelter, ShoreTables, ShoreWave};
use wgpu::util::DeviceExt;

/// `Shore` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Place {
    place: [f32; 4],
    size: [u32; 4],
    shelter: [f32; 4],
    rest: [f32; 4],
}

/// `ShoreWave` of the shader.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Wave {
    turns: [f32; 2],
    heading: [f32; 2],
    phase: f32,
    unit: f32,
    unused: [f32; 2],
}

/// A lattice: its first point, and from point to point (m).
type Frame = (DVec2, DVec2);

/// What shaders know of a shore.
#[derive(Debug)]
pub(crate) struct GpuShore {
    waves: Vec<ShoreWave>,
    place: Place,
    nodes: Frame,
    factors: Frame,
    places: wgpu::Buffer,
    phases: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl std::fmt::Debug for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Place").field("size", &self.size).finish_non_exhaustive()
    }
}

/// Amplitudes of records in units of this share of the open sea's.
const UNIT: f32 = 1.0 / 8192.0;

impl GpuShore {
    /// A shore and a shelter, or the open sea where there is none.
    ///
    /// # Errors
    /// If the bed has more nodes than the device's buffers hold.
    pub fn new(gpu: &Gpu, shore: Option<ShoreTables>, shelter: Option<&Shelter>) -> Result<GpuShore, GpuError> {
        let device = &gpu.device;
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let needed = shore.as_ref().map_or(0, |s| size_of_val(&s.records[..]).max(size_of_val(&s.places[..])) as u64);
        if needed > most {
            return Err(GpuError::TooLittle {
                adapter: gpu.adapter.name.clone(),
                wanted: format!("buffers of {needed} bytes, for a sea over a bed"),
                offered: format!("{most}"),
            });
        }
        let mut place = Place::default();
        let mut nodes = (DVec2::ZERO, DVec2::ONE);
        if let Some(shore) = &shore {
            nodes = (shore.origin, shore.spacing);
            place.size = [shore.columns as u32, shore.rows as u32, shore.waves.len() as u32, 0];
            place.rest = [0.0, 0.0, shore.frequency, shore.breaking];
        }
        let mut factors = (DVec2::ZERO, DVec2::ONE);
        if let Some(shelter) = shelter {
            factors = shelter.frame();
            let [columns, rows] = shelter.size();
            (place.rest[0], place.rest[1], place.size[3]) = (columns as f32, rows as f32, 1);
        }
        let storage = |label, contents: &[u8]| {
            let contents = super::never_empty(contents);
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let (records, known, waves) = match shore {
            Some(shore) => (shore.records, shore.places, shore.waves),
            None => Default::default(),
        };
        let phases = storage("shore: waves", &vec![0; size_of::<Wave>() * waves.len()]);
        let records = storage("shore: records", bytemuck::cast_slice(&records));
        let known = storage("shore: places", bytemuck::cast_slice(&known));
        let lower = storage("shore: shelter", bytemuck::cast_slice(shelter.map_or(&[], |shelter| shelter.factors())));
        let places = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("shore"),
            size: size_of::<Place>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let buffers = [&places, &phases, &records, &known, &lower].map(|buffer| buffer.as_entire_binding());
        let group = bindings::group(device, "shore", &layout(device), buffers);
        Ok(GpuShore { waves, place, nodes, factors, places, phases, group })
    }

    /// Puts the origin of the places that shaders ask about under the eye (m), and the waves where they are at an instant (s).
    pub fn set(&self, gpu: &Gpu, eye: DVec2, seconds: f64) {
        let four = |(origin, spacing): Frame| {
            let (at, over) = ((eye - origin) / spacing, spacing.recip());
            [at.x, at.y, over.x, over.y].map(|v| v as f32)
        };
        let place = Place { place: four(self.nodes), shelter: four(self.factors), ..self.place };
        gpu.queue.write_buffer(&self.places, 0, bytemuck::bytes_of(&place));
        let wave = |wave: &ShoreWave| Wave {
            turns: wave.turns.as_vec2().to_array(),
            heading: wave.turns.normalize_or_zero().as_vec2().to_array(),
            phase: wave.phase(eye, seconds) as f32,
            unit: wave.amplitude * UNIT,
            unused: [0.0; 2],
        };
        let waves: Vec<Wave> = self.waves.iter().map(wave).collect();
        gpu.queue.write_buffer(&self.phases, 0, bytemuck::cast_slice(&waves));
    }

    /// What the shader's functions are bound to.
    pub fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }
}

/// The layout of that group.
pub(crate) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let stages = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
    let read = bindings::storage(true);
    bindings::group_layout(device, "shore", stages, &[bindings::uniform(false), read, read, read, read])
}
