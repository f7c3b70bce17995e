//! Triangles of a surface on the device.

use crate::compute::read;
use crate::device::{Gpu, GpuError};
use littoral::lod::{Mesh, Vertex};

/// Triangles of a surface on the device.
#[derive(Debug, Default)]
pub struct Triangles {
    pub(crate) vertices: Option<wgpu::Buffer>,
    pub(crate) corners: Option<wgpu::Buffer>,
    /// Three times the triangles, or the most there may be.
    pub(crate) count: u32,
    /// What an indexed draw is told, where only the device knows how many there are; its first four numbers tell the same to a draw without indices.
    pub(crate) drawn: Option<wgpu::Buffer>,
}

impl Triangles {
    /// Brings a mesh to the device, in memory used before if that is large enough.
    ///
    /// # Errors
    /// If it is larger than the device's buffers can be; then nothing changes.
    pub fn set(&mut self, gpu: &Gpu, mesh: &Mesh) -> Result<(), TooMany> {
        let most = gpu.device.limits().max_buffer_size;
        let bytes = size_of_val(&mesh.vertices[..]).max(size_of_val(&mesh.triangles[..])) as u64;
        let triangles = mesh.triangles.len();
        if bytes > most || triangles > (u32::MAX / 3) as usize {
            return Err(TooMany { triangles, megabytes: most >> 20 });
        }
        fill(gpu, &mut self.vertices, "vertices", VERTICES, bytemuck::cast_slice(&mesh.vertices));
        fill(gpu, &mut self.corners, "triangles", CORNERS, bytemuck::cast_slice(&mesh.triangles));
        (self.count, self.drawn) = (3 * triangles as u32, None);
        Ok(())
    }

    /// Room for so many vertices and triangles, all of which the device makes, and the buffers for them: vertices, corners, and what the draw is told.
    pub(crate) fn made(gpu: &Gpu, vertices: u64, triangles: u64) -> (Triangles, [wgpu::Buffer; 3]) {
        let buffers = [
            ("vertices", vertices * size_of::<Vertex>() as u64, VERTICES),
            ("triangles", 12 * triangles, CORNERS),
            ("draw", 20, DRAWN),
        ]
        .map(|(label, size, usage)| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        });
        let [vertices, corners, drawn] = buffers.clone().map(Some);
        (Triangles { vertices, corners, count: 3 * triangles as u32, drawn }, buffers)
    }

    /// Brings a mesh to the device with room for so many vertices and triangles in all, the rest of which the device makes.
    pub(crate) fn make(&mut self, gpu: &Gpu, mesh: &Mesh, [vertices, triangles]: [u64; 2]) {
        let to = reserve(gpu, &mut self.vertices, "vertices", VERTICES, vertices * size_of::<Vertex>() as u64);
        gpu.queue.write_buffer(to, 0, bytemuck::cast_slice(&mesh.vertices));
        let to = reserve(gpu, &mut self.corners, "triangles", CORNERS, 12 * triangles);
        gpu.queue.write_buffer(to, 0, bytemuck::cast_slice(&mesh.triangles));
        let drawn = [3 * mesh.triangles.len() as u32, 1, 0, 0, 0];
        fill(gpu, &mut self.drawn, "draw", DRAWN, bytemuck::cast_slice(&drawn));
        self.count = 3 * triangles as u32;
    }

    /// How many triangles the device made, read back.
    pub(crate) fn number_made(&self, gpu: &Gpu) -> Result<u32, GpuError> {
        let Some(drawn) = &self.drawn else { return Ok(0) };
        Ok(bytemuck::pod_read_unaligned::<u32>(&read(gpu, drawn, 4)?) / 3)
    }

    /// So many vertices and triangles, read back.
    pub(crate) fn read(&self, gpu: &Gpu, vertices: u32, triangles: u32) -> Result<Mesh, GpuError> {
        let (Some(from), Some(corners)) = (&self.vertices, &self.corners) else { return Ok(Mesh::default()) };
        let vertices = read(gpu, from, u64::from(vertices) * size_of::<Vertex>() as u64)?;
        let corners = read(gpu, corners, 12 * u64::from(triangles))?;
        Ok(Mesh {
            vertices: bytemuck::pod_collect_to_vec(&vertices),
            triangles: bytemuck::pod_collect_to_vec(&corners),
        })
    }

    /// How many triangles there are; how many there may be at most, if the device made them.
    pub fn len(&self) -> usize {
        self.count as usize / 3
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// A mesh that does not fit into the device's buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected a mesh that fits into {megabytes} MiB, which is what this graphics adapter's buffers hold, got {triangles} triangles; allow fewer of them"
)]
pub struct TooMany {
    /// Its triangles.
    pub triangles: usize,
    /// What a buffer holds at most.
    pub megabytes: u64,
}

const VERTICES: wgpu::BufferUsages =
    wgpu::BufferUsages::VERTEX.union(wgpu::BufferUsages::STORAGE).union(wgpu::BufferUsages::COPY_SRC);
const CORNERS: wgpu::BufferUsages =
    wgpu::BufferUsages::INDEX.union(wgpu::BufferUsages::STORAGE).union(wgpu::BufferUsages::COPY_SRC);
const DRAWN: wgpu::BufferUsages =
    wgpu::BufferUsages::INDIRECT.union(wgpu::BufferUsages::STORAGE).union(wgpu::BufferUsages::COPY_SRC);

/// Writes bytes into a buffer, making a new one half as large again where they do not fit.
pub(crate) fn fill(gpu: &Gpu, buffer: &mut Option<wgpu::Buffer>, label: &str, usage: wgpu::BufferUsages, bytes: &[u8]) {
    gpu.queue.write_buffer(reserve(gpu, buffer, label, usage, bytes.len() as u64), 0, bytes);
}

/// A buffer of so many bytes at least: the one there is, or a new one half as large again.
fn reserve<'a>(
    gpu: &Gpu,
    buffer: &'a mut Option<wgpu::Buffer>,
    label: &str,
    usage: wgpu::BufferUsages,
    size: u64,
) -> &'a wgpu::Buffer {
    let room = |buffer: &wgpu::Buffer| buffer.size() >= size;
    // No larger than shaders can read, unless it has to be.
    let limits = gpu.device.limits();
    let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size).max(size);
    match buffer.take().filter(room) {
        Some(kept) => buffer.insert(kept),
        None => buffer.insert(gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: (size + size / 2).clamp(256, most.max(256)).next_multiple_of(4),
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })),
    }
}
