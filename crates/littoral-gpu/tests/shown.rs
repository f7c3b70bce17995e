//! What is shown of a picture on a target is what the processor shows of the same light, whatever it is a picture of.

use glam::{DVec3, UVec2};
use littoral::field::{HeightField, Water, coast};
use littoral::picture::{Display, Exposure, Picture, Scene, Stage, Style, coast_shot};
use littoral::space::{Datum, View};
use littoral_gpu::{Gpu, Ground, Look, Renderer, Scenery, ShapeTexture};

/// The texels of a target of so many pixels a side, a multiple of 64.
fn texels(gpu: &Gpu, target: &wgpu::Texture, side: u32) -> Vec<[u8; 4]> {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(4 * side * side),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * side), rows_per_image: None };
    let into = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(target.as_image_copy(), into, target.size());
    gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("a working device");
    bytemuck::cast_slice(&buffer.get_mapped_range(..).expect("mapped")).to_vec()
}

#[test]
fn films_prints_and_papers_are_shown_as_the_processor_shows_them() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return eprintln!("not tested: {e}"),
    };
    let side = 64;
    let size = UVec2::splat(side);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let shot = coast_shot(size);
    let above = View::looking_at(shot.view.eye + DVec3::Z * 2500.0, DVec3::new(2500.0, 3500.0, 0.0), 0.9, size);
    for format in [wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureFormat::Rgba8UnormSrgb] {
        let mut renderer = Renderer::new(&gpu, format);
        for (style, view) in [(Style::Natural, shot.view), (Style::Tint, above), (Style::Relief, above)] {
            let scene = Scene { style, ..Scene::for_shot(&land, water.as_ref(), &shot) };
            let stage = Stage::new(&scene);
            let Datum::Plane { origin, size: extent } = stage.land().datum() else { panic!("the coast is a plane") };
            let tables = stage.tables();
            let sky = stage.sky_table(view.eye.z);
            let scenery = Scenery::new(&gpu, &tables, (origin, extent), (view.eye.z, &sky)).expect("a small land");
            let shape = ShapeTexture::new(&gpu, stage.land()).expect("a small land");
            let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let ground = Ground::Rays { shape: &shape, pixels: 0.0 };
            renderer.draw(&gpu, &mut encoder, &scenery, ground, &view, Look::default());
            gpu.queue.submit([encoder.finish()]);
            let mut picture = Picture::empty(size, view.eye);
            (picture.medium, picture.white) = (tables.medium, tables.white);
            let light = renderer.read(&gpu).expect("a working device");
            picture.radiance = light.iter().map(|&[red, green, blue, _]| [red, green, blue]).collect();
            let grey = picture.grey();
            let expected = picture.display(&Display { exposure: Exposure::Grey(grey), ..Display::default() });
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            renderer.show(&gpu, &mut encoder, &scenery, grey, &target.create_view(&Default::default()), size);
            gpu.queue.submit([encoder.finish()]);
            let shown = texels(&gpu, &target, side);
            assert!(expected.iter().flatten().any(|&v| v > 100), "{style:?}: black");
            for (i, (shown, expected)) in shown.iter().zip(&expected).enumerate() {
                let off = (0..3).map(|k| shown[k].abs_diff(expected[k])).max();
                assert!(off <= Some(1), "{style:?}, {format:?}, pixel {i}: {shown:?} for {expected:?}");
            }
        }
    }
}
