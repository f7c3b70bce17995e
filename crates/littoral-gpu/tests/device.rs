//! A device can be had without a window, and says what went wrong instead of ending the program.

use littoral::lod::{Mesh, Vertex};
use littoral_gpu::{Gpu, Triangles};

#[test]
fn a_device_tells_what_went_wrong() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => {
            eprintln!("not tested: {e}");
            return;
        }
    };
    eprintln!("on {} ({:?})", gpu.adapter.name, gpu.adapter.backend);
    assert!(gpu.device.limits().max_texture_dimension_2d >= 8192);
    assert!(gpu.check().is_ok());
    let vertex = |x, y| Vertex { x, y, face: 0, height: 1.0 };
    let mesh = Mesh { vertices: vec![vertex(0, 0), vertex(9, 0), vertex(0, 9)], triangles: vec![[0, 1, 2]] };
    let mut triangles = Triangles::default();
    triangles.set(&gpu, &mesh).expect("a small mesh");
    assert_eq!(triangles.len(), 1);
    assert!(gpu.check().is_ok());
    // More than any buffer holds: no panic, but a fault that stays.
    let _ = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("too large"),
        size: gpu.device.limits().max_buffer_size.saturating_add(4),
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    let fault = gpu.check().expect_err("a fault").to_string();
    assert!(fault.contains("buffer"), "{fault}");
}
