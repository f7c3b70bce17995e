//! Objects by the GPU against those by the processor: the same places, the same light, the same things before them.

use glam::{DVec2, DVec3, UVec2, Vec3};
use littoral::field::{Land, Raster, Sea, Water, coast};
use littoral::objects::{Corner, Footing, Form, Object, Standing, buoy, lighthouse};
use littoral::picture::{Display, Exposure, Picture, Scene, Settings, Stage, Sun, coast_shot};
use littoral::space::View;
use littoral_gpu::{Gpu, Painter};
use std::sync::Arc;

fn gpu() -> Option<Gpu> {
    match Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(e) => {
            eprintln!("not tested: {e}");
            None
        }
    }
}

/// A box of half a side (m) about a middle, red as nothing else is.
fn red_box(half: Vec3, middle: Vec3) -> Arc<Object> {
    let mut form = Form::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut normal = Vec3::ZERO;
            normal[axis] = sign;
            let [across, upward] = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| Vec3::AXES[axis]);
            let base = form.corners.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let position = middle + half * (normal + across * x + upward * y);
                form.corners.push(Corner { position, normal, albedo: Vec3::new(0.7, 0.01, 0.01) });
            }
            form.triangles.extend([[base, base + 1, base + 2], [base + 1, base + 3, base + 2]]);
        }
    }
    Arc::new(Object::new(vec![form]).expect("a box"))
}

/// The processor's picture and the device's, each through every pixel so many times.
fn both(gpu: &Gpu, scene: &Scene, sea: Option<&Sea>, view: &View, samples: u32) -> [Picture; 2] {
    let stage = Stage::new(scene);
    let settings = Settings { samples, ..Settings::default() };
    let expected = stage.render_sea(sea, view, &settings, &|_| {});
    let mut painter = Painter::new(gpu.clone(), &stage).expect("a natural scene");
    painter.set_waves(sea).expect("waves");
    painter.set_objects(&stage.placed(sea)).expect("few objects");
    let painted = painter.picture(&stage, None, view, samples, &|_| {}).expect("a picture");
    [expected, painted]
}

/// Mean difference of displayed values, in steps of 255, and the share of pixels that differ by more than 24 steps; over the pixels for which `of` holds. Where
/// `LITTORAL_PICTURES` names a folder both are written there side by side.
fn apart(name: &str, pictures: &[Picture; 2], of: impl Fn(usize) -> bool) -> (f64, f64) {
    let how = Display { exposure: Exposure::Grey(pictures[0].grey()), ..Display::default() };
    let shown = [0, 1].map(|i| pictures[i].display(&how));
    let UVec2 { x: width, y: height } = pictures[0].size;
    if let Ok(folder) = std::env::var("LITTORAL_PICTURES") {
        let width = width as usize;
        let rows = (0..height as usize).flat_map(|y| shown.iter().map(move |s| &s[y * width..(y + 1) * width]));
        let pixels: Vec<[u8; 3]> = rows.flatten().copied().collect();
        let file = std::fs::File::create(format!("{folder}/objects_{name}.png")).expect("a file");
        let mut encoder = png::Encoder::new(file, 2 * width as u32, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().and_then(|mut w| w.write_image_data(pixels.as_flattened())).expect("a picture");
    }
    let pixels: Vec<usize> = (0..shown[0].len()).filter(|&i| of(i)).collect();
    let steps = |&i: &usize| [0, 1, 2].map(|c| shown[0][i][c].abs_diff(shown[1][i][c]));
    let differences: Vec<[u8; 3]> = pixels.iter().map(steps).collect();
    let mean = differences.as_flattened().iter().map(|&d| f64::from(d)).sum::<f64>() / (3 * pixels.len()) as f64;
    let far = differences.iter().filter(|d| d.iter().any(|&d| d > 24)).count() as f64 / pixels.len() as f64;
    eprintln!("{name}: mean difference {mean:.2} of 255, {:.2} % of {} pixels far off", 100.0 * far, pixels.len());
    (mean, far)
}

/// Pixels that are red as nothing else is.
fn red(picture: &Picture) -> Vec<bool> {
    picture.radiance.iter().map(|[r, g, _]| *r > 4.0 * g).collect()
}

#[test]
fn a_lighthouse_and_buoys_on_the_coast_look_as_rays_see_them() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(256, 144);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let shot = coast_shot(size);
    let (tower, float) = (Arc::new(lighthouse()), Arc::new(buoy()));
    let place = DVec2::new(3030.0, 1310.0);
    let top = f64::from(land.height_at(place).expect("known"));
    let objects = [
        Standing::at(&tower, place),
        Standing { scale: 3.0, heading: 0.4, ..Standing::at(&float, DVec2::new(3190.0, 850.0)) },
        Standing { scale: 3.0, ..Standing::at(&float, DVec2::new(3130.0, 1000.0)) },
        Standing { footing: Footing::Ground, ..Standing::at(&tower, DVec2::new(2860.0, 1850.0)) },
    ];
    let near =
        View::looking_at(place.extend(top + 14.0) + DVec3::new(35.0, -48.0, 6.0), place.extend(top + 11.0), 0.7, size);
    for (name, sun, view) in
        [("shot", shot.sun, shot.view), ("near", shot.sun, near), ("noon", Sun::new(2.9, 1.1), near)]
    {
        let scene = Scene { objects: &objects, sun, ..Scene::for_shot(&land, Some(&water), &shot) };
        let pictures = both(&gpu, &scene, None, &view, 8);
        // From near, ground at the foot of it is noise to a few looks.
        let (mean, far) = apart(name, &pictures, |_| true);
        assert!(mean < 6.0 && far < 0.07, "{name}: {mean} of 255 in the mean, {far} of pixels far off");
        let bare = Stage::new(&Scene { objects: &[], ..scene }).render(&view, &Settings::default(), &|_| {});
        let of_objects = |i: usize| {
            (pictures[0].depth[i] - bare.depth[i]).abs() > 0.01 * bare.depth[i]
                || bare.depth[i].is_infinite() && pictures[0].depth[i].is_finite()
        };
        let (mean, far) = apart(name, &pictures, of_objects);
        // From afar they are a few pixels, all of them edges.
        let most = if name == "shot" { (60.0, 1.1) } else { (5.0, 0.04) };
        assert!(
            mean < most.0 && far < most.1,
            "{name}, objects alone: {mean} of 255 in the mean, {far} of pixels far off"
        );
    }
}

#[test]
fn buoys_ride_the_waves_alike() {
    let Some(gpu) = gpu() else { return };
    let size = UVec2::new(192, 108);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let shot = coast_shot(size);
    let float = red_box(Vec3::new(4.0, 4.0, 3.0), Vec3::ZERO);
    let objects: Vec<Standing> = (0..6)
        .map(|i| Standing::at(&float, DVec2::new(3050.0 + 40.0 * f64::from(i % 3), 700.0 + 60.0 * f64::from(i / 3))))
        .collect();
    let scene = Scene { objects: &objects, ..Scene::for_shot(&land, Some(&water), &shot) };
    let mut sea =
        Sea::over(&land, &water, &"hs=2.5,tp=8,from=210".parse().expect("a state"), &|_| true).expect("a sea");
    sea.set_time(11.0);
    let view = View::looking_at(DVec3::new(3090.0, 600.0, 14.0), DVec3::new(3090.0, 730.0, 0.0), 0.9, size);
    let pictures = both(&gpu, &scene, Some(&sea), &view, 4);
    let [expected, painted] = [0, 1].map(|i| red(&pictures[i]));
    apart("waves", &pictures, |i| expected[i] && painted[i]);
    let (one, two) =
        (expected.iter().filter(|r| **r).count(), expected.iter().zip(&painted).filter(|(a, b)| **a && **b).count());
    assert!(one > 150 && two as f64 > 0.9 * one as f64, "{two} of {one} pixels are red in both");
}

#[test]
fn what_is_before_and_behind_is_so_on_both() {
    let Some(gpu) = gpu() else { return };
    // A ridge along x, 100 m high, with a sea before it.
    let height = |at: DVec2| if at.y < 500.0 { -6.0 } else { (100.0 - 0.5 * (at.y - 1000.0).abs()).max(3.0) };
    let heights =
        (0..201 * 201).map(|i| height(DVec2::new((i % 201) as f64, (i / 201) as f64) * 10.0) as f32).collect();
    let land = Land::at(Raster::new(201, 201, DVec2::splat(10.0), heights).expect("valid"), DVec2::ZERO);
    let water = Water::flood(&land, 0.0).expect("a sea");
    let tower = red_box(Vec3::new(20.0, 20.0, 30.0), Vec3::Z * 20.0);
    let view =
        View::looking_at(DVec3::new(1000.0, -200.0, 70.0), DVec3::new(1000.0, 1000.0, 50.0), 0.5, UVec2::new(192, 144));
    let standing =
        |y: f64, scale: f64, footing| Standing { scale, footing, ..Standing::at(&tower, DVec2::new(1000.0, y)) };
    let scene = Scene::new(&land, Some(&water));
    for (name, object, seen) in [
        ("before", standing(800.0, 1.0, Footing::Surface), 120..300),
        ("behind", standing(1400.0, 1.0, Footing::Surface), 0..1),
        ("above", standing(1400.0, 4.0, Footing::Surface), 200..4000),
        ("afloat", standing(300.0, 1.0, Footing::Surface), 600..3000),
        ("half under water", standing(300.0, 1.0, Footing::Ground), 600..3000),
    ] {
        let objects = [object];
        let pictures = both(&gpu, &Scene { objects: &objects, ..scene }, None, &view, 4);
        let counts = [0, 1].map(|i| red(&pictures[i]).iter().filter(|red| **red).count());
        let differ = red(&pictures[0]).iter().zip(red(&pictures[1])).filter(|(a, b)| **a != *b).count();
        eprintln!("{name}: {counts:?} pixels are red, {differ} in one picture only");
        assert!(counts.iter().all(|count| seen.contains(count)), "{name}: {counts:?}");
        assert!(differ <= 4 + counts[0] / 12, "{name}: {differ} of {counts:?}");
        let (mean, far) = apart(name, &pictures, |_| true);
        assert!(mean < 5.0 && far < 0.07, "{name}: {mean} {far}");
    }
    // Six metres of it are under water.
    let count = |footing| {
        let objects = [standing(300.0, 1.0, footing)];
        red(&both(&gpu, &Scene { objects: &objects, ..scene }, None, &view, 1)[1]).iter().filter(|red| **red).count()
    };
    let (afloat, aground) = (count(Footing::Surface), count(Footing::Ground));
    assert!((aground as f64) < 0.95 * afloat as f64, "{aground} {afloat}");
}

#[test]
fn a_million_triangles_in_a_few_draws() {
    let Some(gpu) = gpu() else { return };
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let shot = coast_shot(UVec2::new(160, 90));
    let (tower, float) = (Arc::new(lighthouse()), Arc::new(buoy()));
    let objects: Vec<Standing> = (0..800)
        .map(|i| {
            let place = DVec2::new(f64::from(i % 40) * 60.0 + 1600.0, f64::from(i / 40) * 60.0 + 900.0);
            Standing::at(if water.covers(place) { &float } else { &tower }, place)
        })
        .collect();
    let scene = Scene { objects: &objects, ..Scene::for_shot(&land, Some(&water), &shot) };
    let stage = Stage::new(&scene);
    let triangles: usize = objects.iter().map(|o| o.object.forms()[0].triangles.len()).sum();
    assert!(triangles > 1_000_000, "{triangles}");
    let placed = stage.placed(None);
    assert_eq!(placed.len(), objects.len());
    let mut painter = Painter::new(gpu, &stage).expect("a natural scene");
    painter.set_objects(&placed).expect("they fit");
    // All in full, and as far as they are worth it.
    let mut drawn = |tolerance_pixels: f32| {
        let view = View { tolerance_pixels, ..shot.view };
        let picture = painter.picture(&stage, None, &view, 1, &|_| {}).expect("a picture");
        (picture, painter.object_triangles())
    };
    let (full, all) = drawn(1e-9);
    let (fair, few) = drawn(1.0);
    assert!(all > 300_000 && few * 4 < all, "{all} {few}");
    let (mean, far) = apart("million", &[full, fair], |_| true);
    assert!(mean < 0.5 && far < 0.01, "{mean} {far}");
}
