//! The built-in coast by the processor's rays and by the GPU, side by side: `twins.png`, and how far they differ.

use glam::{UVec2, Vec2};
use littoral::field::{HeightField, Water, coast};
use littoral::lod::{Drawing, Limits, Lod, Patches};
use littoral::picture::{Display, Exposure, Scene, Settings, Stage, coast_shot};
use littoral::space::Datum;
use littoral_gpu::{Gpu, Ground, Look, Renderer, Scenery, Triangles};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let size = UVec2::new(640, 360);
    let gpu = Gpu::headless()?;
    println!("on {}", gpu.adapter.name);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let shot = coast_shot(size);
    let scene = Scene::for_shot(&land, water.as_ref(), &shot);
    let stage = Stage::new(&scene);
    let view = shot.view;
    let reference = stage.render(&view, &Settings { samples: 16, ..Settings::default() }, &|_| {});

    let field = stage.land();
    let mut lod = Patches::new(Limits { finest: field.finest_level(), triangles: 2_000_000 });
    let mut drawing = Drawing::default();
    lod.select(field, &view, &mut drawing)?;
    drawing.expand(field);
    let begin = Instant::now();
    let tables = stage.tables();
    println!("tables in {:.0} ms", begin.elapsed().as_secs_f64() * 1e3);
    let Datum::Plane { origin, size: extent } = field.datum() else { return Err("expected a plane".into()) };
    let scenery = Scenery::new(&gpu, &tables, (origin, extent), (view.eye.z, &stage.sky_table(view.eye.z)))?;
    let mut ground = Triangles::default();
    ground.set(&gpu, &drawing.mesh)?;
    let mut renderer = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
    let looks = 16;
    let mut sum = vec![[0.0f32; 4]; (size.x * size.y) as usize];
    for number in 0..looks {
        let begin = Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let offset = Vec2::new((number % 4) as f32 + 0.5, (number / 4) as f32 + 0.5) / 4.0 - 0.5;
        renderer.draw(
            &gpu,
            &mut encoder,
            &scenery,
            Ground::Triangles(&ground),
            &view,
            Look { offset, number: number + 1 },
        );
        gpu.queue.submit([encoder.finish()]);
        for (sum, seen) in sum.iter_mut().zip(renderer.read(&gpu)?) {
            (0..4).for_each(|i| sum[i] += seen[i] / looks as f32);
        }
        println!("look {number}: {:.0} ms", begin.elapsed().as_secs_f64() * 1e3);
    }
    let mut picture = reference.clone();
    for (out, sum) in picture.radiance.iter_mut().zip(&sum) {
        *out = [sum[0], sum[1], sum[2]];
    }
    let how = Display { exposure: Exposure::Grey(reference.grey()), ..Display::default() };
    let (a, b) = (reference.display(&how), picture.display(&how));
    let mut pixels = Vec::new();
    for y in 0..size.y as usize {
        let row = y * size.x as usize..(y + 1) * size.x as usize;
        pixels.extend_from_slice(&a[row.clone()]);
        pixels.extend_from_slice(&b[row.clone()]);
        let apart = |(a, b): (&[u8; 3], &[u8; 3])| {
            std::array::from_fn(|i| (i32::from(b[i]) - i32::from(a[i]) + 128).clamp(0, 255) as u8)
        };
        pixels.extend(a[row.clone()].iter().zip(&b[row]).map(apart));
    }
    let difference: f64 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    println!("mean difference {:.2} of 255", difference / (a.len() * 3) as f64);
    let file = std::io::BufWriter::new(std::fs::File::create("twins.png")?);
    let mut encoder = png::Encoder::new(file, 3 * size.x, size.y);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(pixels.as_flattened())?;
    Ok(())
}
