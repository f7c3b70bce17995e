//! Pictures of the GPU against those of the processor's rays: the same light, the same ground, no cracks.

use glam::UVec2;
use littoral::field::{Land, Water, coast};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Patches};
use littoral::picture::{Display, Exposure, Scene, Settings, Stage, Sun, coast_shot};
use littoral::space::View;
use littoral_gpu::{Gpu, Painter};

fn gpu() -> Option<Gpu> {
    match Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(e) => {
            eprintln!("not tested: {e}");
            None
        }
    }
}

fn mesh(land: &Land, view: &View) -> Mesh {
    let mut lod = Patches::new(Limits { finest: land.finest_level(), triangles: 500_000 });
    let mut drawing = Drawing::default();
    lod.select(land, view, &mut drawing).expect("a view");
    drawing.expand(land);
    drawing.mesh
}

/// Mean difference of displayed values, in steps of 255, and the share of pixels that differ by more than 24 steps in any channel.
fn apart(stage: &Stage, painter: &mut Painter, view: &View) -> (f64, f64) {
    let mesh = mesh(stage.land(), view);
    let settings = Settings { samples: 8, ..Settings::default() };
    let expected = stage.render(view, &settings, &|_| {});
    let painted = painter.picture(stage, &mesh, view, 8, &|_| {}).expect("a picture");
    let how = Display { exposure: Exposure::Grey(expected.grey()), ..Display::default() };
    let (a, b) = (expected.display(&how), painted.display(&how));
    let steps = |(a, b): (&[u8; 3], &[u8; 3])| [0, 1, 2].map(|i| a[i].abs_diff(b[i]));
    let differences: Vec<[u8; 3]> = a.iter().zip(&b).map(steps).collect();
    let mean = differences.as_flattened().iter().map(|&d| f64::from(d)).sum::<f64>() / (3 * a.len()) as f64;
    let far = differences.iter().filter(|d| d.iter().any(|&d| d > 24)).count() as f64 / a.len() as f64;
    // No crack: where all rays of a pixel and of those about it meet something, all looks do.
    let width = view.size.x as usize;
    for i in width + 1..a.len() - width - 1 {
        let whole = [i, i - 1, i + 1, i - width, i + width].iter().all(|&k| expected.coverage[k] == 1.0);
        assert!(!whole || painted.coverage[i] > 0.999, "sky within the ground at {}, {}", i % width, i / width);
    }
    (mean, far)
}

#[test]
fn the_coast_looks_as_rays_see_it() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(256, 144);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let shot = coast_shot(size);
    let low = View::looking_at(shot.view.eye, shot.view.eye + glam::DVec3::new(-300.0, 500.0, -60.0), 0.9, size);
    for (name, sun, views) in
        [("afternoon", shot.sun, &[shot.view, low][..]), ("low sun", Sun::new(5.2, 0.06), &[shot.view][..])]
    {
        let scene = Scene { sun, ..Scene::for_shot(&land, water.as_ref(), &shot) };
        let stage = Stage::new(&scene);
        let mut painter = Painter::new(gpu.clone(), &stage).expect("a natural scene");
        for view in views {
            let (mean, far) = apart(&stage, &mut painter, view);
            eprintln!("{name}: mean difference {mean:.2} of 255, {:.2} % of pixels far off", 100.0 * far);
            assert!(mean < 4.0 && far < 0.02, "{name}: {mean} of 255 in the mean, {far} of pixels far off");
        }
    }
}

#[test]
fn the_same_picture_twice_and_nothing_from_a_map() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(96, 54);
    let land = coast::coast();
    let shot = coast_shot(size);
    let scene = Scene::for_shot(&land, None, &shot);
    let stage = Stage::new(&scene);
    let mesh = mesh(stage.land(), &shot.view);
    let mut painter = Painter::new(gpu.clone(), &stage).expect("a natural scene");
    let mut paint = || painter.picture(&stage, &mesh, &shot.view, 2, &|_| {}).expect("a picture").radiance;
    let first = paint();
    assert_eq!(first, paint());
    assert!(first.iter().flatten().all(|v| v.is_finite()) && first.iter().any(|v| v[0] > 0.1));
    let map = Scene { style: littoral::picture::Style::Tint, ..scene };
    let refused = Painter::new(gpu, &Stage::new(&map)).expect_err("maps are drawn by the processor");
    assert!(refused.to_string().contains("natural colours"), "{refused}");
}
