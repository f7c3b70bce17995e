//! A device can be had without a window, and keeps what it promises.

use littoral_gpu::Gpu;

#[test]
fn a_device_adds_numbers() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => {
            eprintln!("not tested: {e}");
            return;
        }
    };
    eprintln!("on {} ({:?})", gpu.adapter.name, gpu.adapter.backend);
    assert!(gpu.device.limits().max_texture_dimension_2d >= 8192);
}
