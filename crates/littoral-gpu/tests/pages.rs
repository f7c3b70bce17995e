//! Pictures of which only pages are on the device are seen as if they were there as a whole.

#![allow(missing_docs)]

use glam::{DAffine2, DVec2, DVec3, UVec2};
use littoral::field::{Land, Water, coast};
use littoral::picture::{Drape, Picture, Scene, Shot, Stage, Style, Texture, coast_shot};
use littoral::space::View;
use littoral_gpu::{Gpu, Painter};

/// Stripes and blobs of all sizes over the coast, a few metres a texel.
fn drape(land: &Land) -> Drape {
    let size = UVec2::new(1700, 1300);
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % size.x), f64::from(i / size.x));
        let wave = |by: f64| (128.0 + 60.0 * ((x / by).sin() + (y / (1.3 * by)).cos())) as u8;
        [wave(3.0), wave(29.0), wave(310.0)]
    };
    let texels: Vec<[u8; 3]> = (0..size.x * size.y).map(texel).collect();
    let (origin, extent) = (land.origin(), land.extent());
    let flip = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::new(0.0, 1.0));
    let local = DAffine2::from_scale(1.0 / extent) * DAffine2::from_translation(-origin);
    Drape { texture: Texture::from_srgb(size, &texels), uv_from_local: flip * local }
}

struct Views {
    shot: Shot,
    low: View,
    above: View,
}

fn views(size: UVec2) -> Views {
    let shot = coast_shot(size);
    let low = View::looking_at(shot.view.eye, shot.view.eye + DVec3::new(300.0, 500.0, -90.0), 0.4, size);
    let above = View::looking_at(DVec3::new(2000.0, 2000.0, 9000.0), DVec3::new(2000.0, 2001.0, 0.0), 0.7, size);
    Views { shot, low, above }
}

/// Mean and greatest difference of radiance, as shares of the mean.
fn apart(a: &Picture, b: &Picture) -> (f32, f32) {
    let mean = a.radiance.as_flattened().iter().sum::<f32>() / (3 * a.radiance.len()) as f32;
    let both = a.radiance.as_flattened().iter().zip(b.radiance.as_flattened());
    let apart: Vec<f32> = both.map(|(a, b)| (a - b).abs() / mean).collect();
    (apart.iter().sum::<f32>() / apart.len() as f32, apart.iter().fold(0.0, |a, &b| a.max(b)))
}

#[test]
fn pages_are_seen_as_the_whole_picture() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return eprintln!("not tested: {e}"),
    };
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let drape = drape(&land);
    let Views { shot, low, above } = views(UVec2::new(320, 180));
    let scene = Scene { style: Style::Image, drape: Some(&drape), ..Scene::for_shot(&land, water.as_ref(), &shot) };
    let stage = Stage::new(&scene);
    let mut whole = Painter::new(gpu.clone(), &stage).expect("a land");
    // The picture takes 12 MB.
    let mut paged = Painter::with_picture_bytes(gpu.clone(), &stage, 8 << 20).expect("a land");
    let mut few = Painter::with_picture_bytes(gpu, &stage, 0).expect("a land");
    let mut before = None;
    for (name, view) in [("shot", &shot.view), ("low", &low), ("above", &above), ("shot", &shot.view)] {
        let paint = |painter: &mut Painter| painter.picture(&stage, None, view, 1, &|_| {}).expect("a picture");
        let expected = paint(&mut whole);
        let (mean, most) = apart(&expected, &paint(&mut paged));
        // Eight bits, and places between texels of which the device keeps eight more.
        eprintln!("{name}: {mean:.5} of the mean apart in the mean, {most:.3} at most");
        assert!(mean < 0.001 && most < 0.1, "{name}: {mean} apart in the mean, {most} at most");
        // Four pages do not hold what is needed: it is seen, but less sharply.
        let coarse = paint(&mut few);
        let (mean, _) = apart(&expected, &coarse);
        let [sharp, blurred] = [&expected, &coarse]
            .map(|picture| picture.radiance.as_flattened().iter().map(|&v| f64::from(v)).sum::<f64>());
        eprintln!("{name}: by four pages {mean:.3} apart in the mean, {:.2} of the light", blurred / sharp);
        assert!(mean > 0.001 && (0.8..1.25).contains(&(blurred / sharp)), "{name}: {mean} apart");
        if name == "shot" {
            // Whatever was looked at before.
            let now = (paint(&mut paged).radiance, coarse.radiance);
            assert!(before.replace(now.clone()).is_none_or(|before| before == now), "another picture of the same view");
        }
    }
}
