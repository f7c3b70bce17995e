//! Pictures of the GPU against those of the processor's rays: the same light, the same ground, no cracks.

use glam::{DAffine2, DMat2, DVec2, DVec3, UVec2};
use littoral::field::noise::Fbm;
use littoral::field::{Lakes, Land, Raster, Sea, Water, coast};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Patches};
use littoral::picture::{
    Border, Display, Drape, Exposure, Scene, Settings, Stage, Style, Sun, Texture, coast_shot, overhead,
};
use littoral::space::View;
use littoral::waves::SeaState;
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

/// A mesh within a quarter of a pixel, where the samples are that close.
fn mesh(land: &Land, view: &View) -> Mesh {
    let mut lod = Patches::new(Limits { finest: land.finest_level(), triangles: 2_000_000 });
    let mut drawing = Drawing::default();
    let view = View { tolerance_pixels: 0.25, ..*view };
    lod.select(land, &view, &mut drawing).expect("a view");
    drawing.expand(land);
    drawing.mesh
}

/// Mean difference of displayed values, in steps of 255, and the share of pixels that differ by more than 24 steps in any channel.
fn apart(a: &[[u8; 3]], b: &[[u8; 3]]) -> (f64, f64) {
    let steps = |(a, b): (&[u8; 3], &[u8; 3])| [0, 1, 2].map(|i| a[i].abs_diff(b[i]));
    let differences: Vec<[u8; 3]> = a.iter().zip(b).map(steps).collect();
    let mean = differences.as_flattened().iter().map(|&d| f64::from(d)).sum::<f64>() / (3 * a.len()) as f64;
    let far = differences.iter().filter(|d| d.iter().any(|&d| d > 24)).count() as f64 / a.len() as f64;
    (mean, far)
}

/// Holds pictures by a mesh and by rays against the processor's, and against each other; where `LITTORAL_PICTURES` names a folder they are written there side by side.
/// From the processor's they may be so far in the mean, and so great a share of pixels may be far off.
fn compare(name: &str, stage: &Stage, painter: &mut Painter, sea: Option<&Sea>, view: &View, most: (f64, f64)) {
    let mesh = mesh(stage.land(), view);
    let settings = Settings { samples: 8, ..Settings::default() };
    let expected = stage.render_sea(sea, view, &settings, &|_| {});
    let how = Display { exposure: Exposure::Grey(expected.grey()), ..Display::default() };
    let width = view.size.x as usize;
    let mut shown = vec![expected.display(&how)];
    for (by, ground) in [("mesh", Some(&mesh)), ("rays", None)] {
        let painted = painter.picture(stage, ground, view, 8, &|_| {}).expect("a picture");
        // No crack: where all rays of a pixel and of those about it meet something, all looks do.
        for i in width + 1..expected.coverage.len() - width - 1 {
            let whole = [i, i - 1, i + 1, i - width, i + width].iter().all(|&k| expected.coverage[k] == 1.0);
            let (x, y) = (i % width, i / width);
            assert!(!whole || painted.coverage[i] > 0.999, "{name} by {by}: sky within the ground at {x}, {y}");
        }
        shown.push(painted.display(&how));
    }
    if let Ok(folder) = std::env::var("LITTORAL_PICTURES") {
        let rows = (0..view.size.y as usize).flat_map(|y| shown.iter().map(move |s| &s[y * width..(y + 1) * width]));
        let pixels: Vec<[u8; 3]> = rows.flatten().copied().collect();
        let file = std::fs::File::create(format!("{folder}/twins_{name}.png")).expect("a file");
        let mut encoder = png::Encoder::new(file, 3 * view.size.x, view.size.y);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().and_then(|mut w| w.write_image_data(pixels.as_flattened())).expect("a picture");
    }
    for (what, a, b, most) in [
        ("mesh against the processor", 1, 0, most),
        ("rays against the processor", 2, 0, most),
        ("rays against mesh", 2, 1, (1.0, 0.005)),
    ] {
        let (mean, far) = apart(&shown[a], &shown[b]);
        eprintln!("{name}, {what}: mean difference {mean:.2} of 255, {:.2} % of pixels far off", 100.0 * far);
        assert!(mean < most.0 && far < most.1, "{name}, {what}: {mean} of 255 in the mean, {far} of pixels far off");
    }
}

#[test]
fn the_coast_looks_as_rays_see_it() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(256, 144);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let shot = coast_shot(size);
    let low = View::looking_at(shot.view.eye, shot.view.eye + DVec3::new(-300.0, 500.0, -60.0), 0.9, size);
    for (name, sun, views) in
        [("afternoon", shot.sun, &[shot.view, low][..]), ("low sun", Sun::new(5.2, 0.06), &[shot.view][..])]
    {
        let scene = Scene { sun, ..Scene::for_shot(&land, water.as_ref(), &shot) };
        let stage = Stage::new(&scene);
        let mut painter = Painter::new(gpu.clone(), &stage).expect("a natural scene");
        for view in views {
            compare(name, &stage, &mut painter, None, view, (4.0, 0.02));
        }
    }
}

#[test]
fn still_water_mirrors_cliffs_as_rays_do() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(256, 144);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let shot = coast_shot(size);
    let scene = Scene::for_shot(&land, water.as_ref(), &shot);
    let stage = Stage::new(&scene);
    let eye = DVec3::new(3380.0, 560.0, 30.0);
    let view = View::looking_at(eye, DVec3::new(3700.0, 900.0, 20.0), 0.785, size);
    let settings = Settings { samples: 16, ..Settings::default() };
    let expected = stage.render_sea(None, &view, &settings, &|_| {});
    let painted = Painter::new(gpu, &stage).expect("a natural scene").picture(&stage, None, &view, 16, &|_| {});
    let how = Display { exposure: Exposure::Grey(expected.grey()), ..Display::default() };
    let [expected, painted] = [&expected, &painted.expect("a picture")].map(|picture| picture.display(&how));
    // Below the cliffs, in tiles that are large enough for ripples to even out.
    let tile = |shown: &[[u8; 3]], x: usize, y: usize| {
        let rows = (y..y + 8).flat_map(|y| &shown[y * 256 + x..][..16]);
        rows.flatten().map(|&v| f64::from(v)).sum::<f64>() / (3 * 16 * 8) as f64
    };
    let mut worst = 0.0f64;
    for y in (80..136).step_by(8) {
        for x in (0..176).step_by(16) {
            worst = worst.max((tile(&expected, x, y) - tile(&painted, x, y)).abs());
        }
    }
    eprintln!("what a cliff is mirrored as: {worst:.1} of 255 apart at most");
    assert!(worst < 12.0, "{worst} of 255 apart");
}

#[test]
fn waves_look_as_rays_see_them() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(256, 144);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let shot = coast_shot(size);
    let scene = Scene::for_shot(&land, Some(&water), &shot);
    let stage = Stage::new(&scene);
    let mut painter = Painter::new(gpu, &stage).expect("a natural scene");
    let storm = SeaState::beaufort(8.0, 0.6).expect("a state");
    for (name, state, most) in [("breeze", coast::sea_state(), (4.0, 0.028)), ("storm", storm, (4.45, 0.038))] {
        let mut sea = Sea::over(&land, &water, &state, &|_| true).expect("a sea");
        sea.set_time(7.25);
        painter.set_waves(Some(&sea)).expect("waves of tiles over a bed");
        compare(name, &stage, &mut painter, Some(&sea), &shot.view, most);
    }
}

#[test]
fn the_same_picture_twice() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(96, 54);
    let land = coast::coast();
    let shot = coast_shot(size);
    let scene = Scene::for_shot(&land, None, &shot);
    let stage = Stage::new(&scene);
    let mesh = mesh(stage.land(), &shot.view);
    let mut painter = Painter::new(gpu, &stage).expect("a natural scene");
    let mut paint = || painter.picture(&stage, Some(&mesh), &shot.view, 2, &|_| {}).expect("a picture").radiance;
    let first = paint();
    assert_eq!(first, paint());
    assert!(first.iter().flatten().all(|v| v.is_finite()) && first.iter().any(|v| v[0] > 0.1));
}

#[test]
fn maps_and_pictures_look_as_rays_see_them() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(256, 144);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let shot = coast_shot(size);
    // Fields of some colours, not square, over most of the land.
    let (columns, rows) = (301, 180);
    let field = |i: u32| {
        let (x, y) = (i % columns / 16, i / columns / 16);
        [(x * 97 + y * 31) % 200 + 30, (x * 53 + y * 89) % 180 + 40, (x * 17 + y * 61) % 150 + 20].map(|v| v as u8)
    };
    let texels: Vec<[u8; 3]> = (0..columns * rows).map(field).collect();
    let texture = Texture::from_srgb(UVec2::new(columns, rows), &texels);
    let scale = DVec2::new(0.9, -0.9) / land.extent();
    let uv_from_local =
        DAffine2 { matrix2: DMat2::from_diagonal(scale), translation: DVec2::new(0.02, 0.95) - scale * land.origin() };
    let drape = Drape { texture, uv_from_local };
    let above = View::looking_at(shot.view.eye + DVec3::Z * 2500.0, DVec3::new(2500.0, 3500.0, 0.0), 0.9, size);
    for (name, style, view) in [
        ("tint", Style::Tint, above),
        ("relief", Style::Relief, above),
        ("relief low", Style::Relief, shot.view),
        ("picture", Style::Image, above),
        ("picture low", Style::Image, shot.view),
    ] {
        // Paper has neither sun nor noise: both draw the same tones.
        let most = if style == Style::Relief { (1.0, 0.01) } else { (4.0, 0.03) };
        let scene = Scene { style, drape: Some(&drape), ..Scene::for_shot(&land, water.as_ref(), &shot) };
        let stage = Stage::new(&scene);
        let mut painter = Painter::new(gpu.clone(), &stage).expect("known styles");
        compare(name, &stage, &mut painter, None, &view, most);
    }
}

#[test]
fn a_block_with_missing_corners_looks_as_rays_see_it() {
    let Some(gpu) = gpu() else { return };
    // Hills, a sea in the west, a lake in the middle, another with a known bed in the east; two corners are void.
    let (side, spacing) = (193, 30.0);
    let fbm = Fbm::new(2200.0, 260.0, 8, 3);
    let height = |i: usize| {
        let (x, y) = ((i % side) as f64, (i / side) as f64);
        let at = DVec2::new(x, y) * spacing;
        let corner = x + y < 40.0 || x + y > 350.0;
        let away = (at - DVec2::splat(96.0 * spacing)).length();
        let bowl = (at - DVec2::new(150.0, 60.0) * spacing).length();
        let hills = fbm.at(at).value + 1.4 * x - 60.0;
        match () {
            _ if corner => f32::NAN,
            _ if away < 500.0 => 60.0,
            _ if away < 650.0 => hills.max(80.0) as f32,
            _ if bowl < 500.0 => (60.0 + 100.0 * (bowl / 500.0).powi(2)) as f32,
            _ if bowl < 650.0 => hills.max(170.0) as f32,
            _ => hills as f32,
        }
    };
    let heights: Vec<f32> = (0..side * side).map(height).collect();
    let raster = Raster::new(side, side, DVec2::splat(spacing), heights).expect("valid");
    let land = Land::new(raster);
    let water = Water::flood(&land, 0.0);
    let mut lakes = Lakes::find(&land, water.as_ref()).expect("a lake");
    lakes.fill(&land, water.as_ref(), DVec2::new(54.0, -36.0) * spacing, 150.0).expect("a bowl that holds");
    let size = UVec2::new(256, 144);
    let shot = overhead(&land, water.as_ref(), size);
    let eye = DVec3::new(-4000.0, -8000.0, 4500.0);
    let view = View::looking_at(eye, DVec3::ZERO, 0.6, size);
    let scene = Scene { lakes: Some(&lakes), ..Scene::for_shot(&land, water.as_ref(), &shot) };
    for (name, style, most) in [("block", Style::Natural, (4.0, 0.03)), ("relief block", Style::Relief, (1.0, 0.01))] {
        let scene = Scene { style, border: Border::Cut, sun: Sun::new(4.2, 0.5), ..scene };
        let stage = Stage::new(&scene);
        let mut painter = Painter::new(gpu.clone(), &stage).expect("a known style");
        compare(name, &stage, &mut painter, None, &view, most);
    }
}

#[test]
fn lakes_over_known_beds_look_as_rays_see_them() {
    let Some(gpu) = gpu() else { return };
    // A valley in hills, dammed in the south: deep in the middle, with an island; its level is below the sea's, which is elsewhere.
    let (side, spacing) = (161, 20.0);
    let fbm = Fbm::new(700.0, 60.0, 7, 11);
    let height = |i: usize| {
        let (x, y) = ((i % side) as f64 * spacing, (i / side) as f64 * spacing);
        let across = (x - 1600.0 - 350.0 * (y / 600.0).sin()) / 700.0;
        let valley = -380.0 + 190.0 * across * across + 0.05 * (y - 300.0) + fbm.at(DVec2::new(x, y)).value;
        let dam = if (300.0..360.0).contains(&y) && across.abs() < 2.0 { -240.0 } else { valley };
        let island = -240.0 - 0.5 * (DVec2::new(x, y) - DVec2::new(1750.0, 1250.0)).length();
        valley.max(dam).max(island) as f32
    };
    let heights: Vec<f32> = (0..side * side).map(height).collect();
    let land = Land::new(Raster::new(side, side, DVec2::splat(spacing), heights).expect("valid"));
    let mut lakes = Lakes::none(&land);
    let middle = DVec2::new(0.0, -700.0);
    let lake = lakes.fill(&land, None, middle, -270.0).expect("a valley that holds");
    assert!(lake.deepest > 60.0 && lake.area > 1e6, "{lake:?}");
    let size = UVec2::new(256, 144);
    let shot = overhead(&land, None, size);
    let scene = Scene { lakes: Some(&lakes), ..Scene::for_shot(&land, None, &shot) };
    let high = View::looking_at(DVec3::new(700.0, -2500.0, 900.0), middle.extend(-270.0), 0.7, size);
    let low = View::looking_at(DVec3::new(0.0, -1150.0, -250.0), DVec3::new(150.0, 300.0, -290.0), 0.8, size);
    let down = View::looking_at(middle.extend(900.0), middle.extend(-270.0) + DVec3::Y, 0.9, size);
    // Rough slopes and, from low down, ripples differ from ray to ray.
    for (name, view, style, far) in [
        ("reservoir", high, Style::Natural, 0.04),
        ("on the reservoir", low, Style::Natural, 0.04),
        ("reservoir from above", down, Style::Natural, 0.04),
        ("map of the reservoir", down, Style::Tint, 0.03),
    ] {
        let scene = Scene { style, border: Border::Mist, sun: Sun::new(4.2, 0.6), ..scene };
        let stage = Stage::new(&scene);
        let mut painter = Painter::new(gpu.clone(), &stage).expect("a known style");
        compare(name, &stage, &mut painter, None, &view, (4.0, far));
    }
}
