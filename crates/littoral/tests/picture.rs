//! Pictures as a whole: the same bits on any number of threads, true passes, honest voids, sensible views of any land, and
//! a few golden pictures (`LITTORAL_BLESS=1` writes them anew; look at them before they are committed).

use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use littoral::field::noise::Fbm;
use littoral::field::{Land, Raster, Sea, Water, coast};
use littoral::picture::{
    Border, Display, Drape, Picture, Scene, Settings, Shot, Stage, Style, Texture, coast_shot, compose, overhead,
    render,
};
use littoral::space::{Ray, View};
use proptest::prelude::*;
use std::path::PathBuf;

/// An island of noise, some of it below sea level on all sides.
fn island(side: usize, spacing: f64) -> Land {
    let fbm = Fbm::new(0.4 * side as f64, 0.35, 6, 3);
    let heights = (0..side * side).map(|i| {
        let at = DVec2::new((i % side) as f64, (i / side) as f64);
        let r = (at / (side - 1) as f64 * 2.0 - 1.0).length();
        ((0.45 - r + fbm.at(at).value) * 0.22 * side as f64 * spacing) as f32
    });
    Land::new(Raster::new(side, side, DVec2::splat(spacing), heights.collect()).expect("valid"))
}

fn quick(samples: u32) -> Settings {
    Settings { samples, ..Settings::default() }
}

fn picture_of(land: &Land, water: Option<&Water>, shot: &Shot, samples: u32) -> Picture {
    render(&Scene::for_shot(land, water, shot), &shot.view, &quick(samples), &|_| {})
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let land = island(65, 20.0);
    let water = Water::flood(&land, 0.0);
    let shot = compose(&land, water.as_ref(), UVec2::new(70, 41));
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let picture = pool.install(|| picture_of(&land, water.as_ref(), &shot, 5));
        let radiance: Vec<u32> = picture.radiance.iter().flatten().map(|v| v.to_bits()).collect();
        let depth: Vec<u32> = picture.depth.iter().map(|v| v.to_bits()).collect();
        (radiance, depth, picture.display(&Display::default()))
    };
    let one = bits(1);
    assert!(one == bits(2) && one == bits(3));
}

#[test]
fn passes_are_what_the_middle_of_each_pixel_sees() {
    let land = island(65, 20.0);
    let eye = DVec3::new(-900.0, -700.0, 420.0);
    let view = View::looking_at(eye, DVec3::new(0.0, 0.0, 60.0), 0.8, UVec2::new(48, 27));
    let water = Water::flood(&land, 0.0).expect("an island");
    let picture = render(&Scene::new(&land, Some(&water)), &view, &quick(1), &|_| {});
    let mut seen = [0; 3];
    for y in 0..27u32 {
        for x in 0..48u32 {
            let i = (y * 48 + x) as usize;
            let direction = view.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)).as_dvec3();
            let to_water = if direction.z < 0.0 { -eye.z / direction.z } else { f64::INFINITY };
            let to_land = land.first_hit(&Ray::new(eye, direction)).map_or(f64::INFINITY, |h| h.distance);
            if to_land < to_water {
                seen[0] += 1;
                assert!((f64::from(picture.depth[i]) / to_land - 1.0).abs() < 2e-4, "at {x}, {y}");
                let position = eye + Vec3::from(picture.position[i]).as_dvec3();
                assert!((position.z - f64::from(picture.height[i])).abs() < 0.1);
                let normal = land.normal_at(position.truncate()).expect("on the land");
                assert!(Vec3::from(picture.normal[i]).dot(normal) > 0.99);
            } else if to_water < 4_000.0 {
                seen[1] += 1;
                assert!((f64::from(picture.depth[i]) / to_water - 1.0).abs() < 5e-3, "at {x}, {y}");
                assert!(picture.height[i].abs() < 1e-3);
            } else if direction.z > 0.01 {
                seen[2] += 1;
                assert_eq!((picture.depth[i], picture.normal[i]), (f32::INFINITY, [0.0; 3]));
                assert!(picture.height[i].is_nan());
            }
        }
    }
    assert!(seen.iter().all(|n| *n > 50), "{seen:?}");
    // Without water the mist round the land is no surface, and neither is the floor round a block.
    for border in [Border::Mist, Border::Cut] {
        let picture = render(&Scene { border, ..Scene::new(&land, None) }, &view, &quick(1), &|_| {});
        let highest = f64::from(land.height_range().high) + 1e-3;
        let off = |i: &usize| {
            let at = (eye + Vec3::from(picture.position[*i]).as_dvec3()).truncate();
            !at.is_finite()
                || (at.abs().cmple(land.extent() * 0.5 + 1e-2).all() && f64::from(picture.height[*i]) <= highest)
        };
        let beside: Vec<_> =
            (0..48 * 27).filter(|i| !off(i)).map(|i| (i, picture.position[i], picture.height[i])).collect();
        assert!(beside.is_empty(), "{border:?} has something beside the land: {beside:?}");
        assert!(picture.depth.iter().filter(|depth| depth.is_infinite()).count() > 300);
    }
}

#[test]
fn a_hole_is_mist_and_neither_pit_nor_cliff() {
    // A plain of grass with a hole; seen from above all that is unknown has one tone, inside the raster and outside.
    let side = 60;
    let heights = (0..side * side).map(|i| {
        let (x, y) = (i % side, i / side);
        let hole = (25..38).contains(&x) && (20..33).contains(&y);
        if hole { f32::NAN } else { 100.0 + 0.2 * x as f32 }
    });
    let land = Land::new(Raster::new(side, side, DVec2::splat(10.0), heights.collect()).expect("valid"));
    let view = View::looking_at(DVec3::new(0.0, -1.0, 1500.0), DVec3::new(0.0, 0.0, 100.0), 0.8, UVec2::new(96, 96));
    let mut scene = Scene::new(&land, None);
    scene.air.veils_distance = false;
    let picture = render(&scene, &view, &quick(4), &|_| {});
    let tone_at = |x: f64, y: f64| {
        let pixel = view.pixel(DVec3::new(x, y, 105.0)).expect("in front").as_uvec2();
        Vec3::from(picture.radiance[(pixel.y * 96 + pixel.x) as usize])
    };
    let (hole, outside, ground) = (tone_at(15.0, -35.0), tone_at(450.0, 0.0), tone_at(-150.0, 150.0));
    assert!((hole - outside).length() < 1e-4 * outside.length(), "{hole} and {outside}");
    assert!((ground - outside).length() > 0.2 * outside.length(), "ground {ground} is not mist {outside}");
    let heights = picture.height.iter().filter(|h| **h > 80.0);
    assert!(heights.clone().count() > 1000 && heights.fold(0.0f32, |m, h| m.max(*h)) < 113.0, "no spikes");
}

#[test]
fn any_land_has_a_picture() {
    let all_void = Land::new(Raster::new(9, 7, DVec2::ONE, vec![f32::NAN; 63]).expect("valid"));
    let smallest = Land::new(Raster::new(2, 2, DVec2::new(3.0, 900.0), vec![0.0, 1.0, 2.0, -5.0]).expect("valid"));
    let flat = Land::new(Raster::new(31, 31, DVec2::ONE, vec![0.0; 961]).expect("valid"));
    let spike = Land::new(
        Raster::new(31, 5, DVec2::splat(0.01), (0..155).map(|i| if i == 70 { 8e3 } else { -4e3 }).collect())
            .expect("valid"),
    );
    let earth = Land::new(
        Raster::new(73, 37, DVec2::splat(550_000.0), (0..73 * 37).map(|i| (i % 97) as f32 * 90.0 - 4000.0).collect())
            .expect("valid"),
    );
    for land in [all_void, smallest, flat, spike, earth] {
        for level in [-1e9, 0.0, 1e9] {
            let water = Water::flood(&land, level);
            let wide = UVec2::new(24, 14);
            let shots = [compose(&land, water.as_ref(), wide), overhead(&land, water.as_ref(), UVec2::ONE)];
            for (shot, style) in
                shots.into_iter().flat_map(|s| [(s, Style::Natural), (s, Style::Relief), (s, Style::Image)])
            {
                let picture = picture_of(&land, water.as_ref(), &Shot { style, ..shot }, 1);
                assert!(picture.radiance.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
            }
        }
    }
}

#[test]
fn a_draped_picture_keeps_its_colours_in_their_places() {
    let land = Land::new(Raster::new(33, 33, DVec2::splat(10.0), vec![5.0; 33 * 33]).expect("valid"));
    // Red in the north-west, green in the north-east, blue in the south.
    let texels = vec![[200, 20, 20], [20, 200, 20], [20, 20, 200], [20, 20, 200]];
    let drape = Drape {
        texture: Texture::from_srgb(UVec2::new(2, 2), &texels),
        uv_from_local: glam::DAffine2::from_scale_angle_translation(
            DVec2::new(1.0 / 320.0, -1.0 / 320.0),
            0.0,
            DVec2::splat(0.5),
        ),
    };
    let shot = overhead(&land, None, UVec2::new(40, 40));
    let scene = Scene { drape: Some(&drape), style: Style::Image, ..Scene::for_shot(&land, None, &shot) };
    let shown = render(&scene, &shot.view, &quick(2), &|_| {}).display(&Display::default());
    let strongest = |x: usize, y: usize| (0..3).max_by_key(|c| shown[y * 40 + x][*c]).expect("three");
    assert_eq!([strongest(11, 11), strongest(28, 11), strongest(20, 30)], [0, 1, 2]);
}

#[test]
fn progress_reaches_one() {
    let land = island(17, 20.0);
    let most = std::sync::Mutex::new(0.0f32);
    let view = compose(&land, None, UVec2::new(40, 40)).view;
    Stage::new(&Scene::new(&land, None)).render(&view, &quick(1), &|done| {
        let mut most = most.lock().expect("no panic");
        *most = most.max(done);
    });
    assert_eq!(most.into_inner().expect("no panic"), 1.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    #[test]
    fn a_camera_is_never_within_the_ground(side in 2usize..40, seed: u32, relief in 0.0..2.0f64, wet: bool, voids: bool) {
        let fbm = Fbm::new(0.5 * side as f64, relief * side as f64, 5, seed);
        let heights = (0..side * side).map(|i| {
            let (x, y) = ((i % side) as f64, (i / side) as f64);
            if voids && (x - y).abs() < 0.1 * side as f64 { f32::NAN } else { 10.0 * fbm.at(DVec2::new(x, y)).value as f32 }
        });
        let land = Land::new(Raster::new(side, side, DVec2::splat(10.0), heights.collect()).expect("valid"));
        let water = if wet { Water::flood(&land, 0.0) } else { None };
        let view = compose(&land, water.as_ref(), UVec2::new(64, 36)).view;
        prop_assert!(view.eye.is_finite());
        if let Some(ground) = land.height_at(view.eye.truncate()) {
            prop_assert!(view.eye.z > f64::from(ground) + 1.0);
        }
    }
}

/// CIE L*a*b* of a colour on an sRGB screen.
fn lab(rgb: [u8; 3]) -> Vec3 {
    let linear = Vec3::from(rgb.map(|v| {
        let v = f32::from(v) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    }));
    let xyz = Vec3::new(
        linear.dot(Vec3::new(0.4124, 0.3576, 0.1805)) / 0.9505,
        linear.dot(Vec3::new(0.2126, 0.7152, 0.0722)),
        linear.dot(Vec3::new(0.0193, 0.1192, 0.9505)) / 1.089,
    );
    let f = xyz.map(|t| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    Vec3::new(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z))
}

/// Compares a picture with the golden one of that name: the mean difference in colour (ΔE, where 1 is just visible) is small, after
/// both are blurred over 3 × 3 pixels, as an eye at arm's length does.
fn golden(name: &str, picture: &Picture) {
    let size = picture.size;
    let shown = picture.display(&Display::default());
    let mean = shown.iter().map(|p| lab(*p)).sum::<Vec3>() / shown.len() as f32;
    let spread = (shown.iter().map(|p| (lab(*p) - mean).length_squared()).sum::<f32>() / shown.len() as f32).sqrt();
    assert!(spread > 5.0, "{name} is blank: its colours spread by {spread} only");
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests", "golden", &format!("{name}.png")].iter().collect();
    if std::env::var_os("LITTORAL_BLESS").is_some() {
        let mut encoder = png::Encoder::new(std::fs::File::create(&path).expect("writable"), size.x, size.y);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().expect("written");
        writer.write_image_data(&shown.concat()).expect("written");
        return;
    }
    let file = std::io::BufReader::new(std::fs::File::open(&path).expect("the golden picture is in the repository"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    reader.next_frame(&mut bytes).expect("a whole PNG");
    let expected: Vec<[u8; 3]> = bytes.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    assert_eq!(expected.len(), shown.len(), "{name} has another size");
    let blurred = |pixels: &[[u8; 3]], x: u32, y: u32| {
        let around = (y.saturating_sub(1)..(y + 2).min(size.y))
            .flat_map(|r| (x.saturating_sub(1)..(x + 2).min(size.x)).map(move |c| (r * size.x + c) as usize));
        let (sum, count) = around.fold((Vec3::ZERO, 0.0), |(s, n), i| (s + lab(pixels[i]), n + 1.0));
        sum / count
    };
    let mut sum = 0.0;
    for i in 0..size.x * size.y {
        let (x, y) = (i % size.x, i / size.x);
        sum += (blurred(&shown, x, y) - blurred(&expected, x, y)).length();
    }
    let difference = sum / shown.len() as f32;
    assert!(difference < 1.0, "{name} differs from its golden picture by ΔE {difference} in the mean");
}

#[test]
fn golden_coast() {
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("the sea");
    let size = UVec2::new(240, 135);
    golden("coast", &picture_of(&land, Some(&water), &coast_shot(size), 8));
    let above = overhead(&land, Some(&water), UVec2::new(128, 128));
    golden("coast_relief", &picture_of(&land, Some(&water), &Shot { style: Style::Relief, ..above }, 4));
}

#[test]
fn golden_island() {
    let land = island(129, 60.0);
    let water = Water::flood(&land, 0.0).expect("an island");
    let shot = compose(&land, Some(&water), UVec2::new(192, 108));
    golden("island", &picture_of(&land, Some(&water), &shot, 8));
    golden("island_tint", &picture_of(&land, Some(&water), &Shot { style: Style::Tint, ..shot }, 8));
}

#[test]
fn golden_sea() {
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("the sea");
    let state = "beaufort=8,from=240".parse().expect("a state");
    let sea = Sea::over(&land, &water, &state, &|_| true).expect("a sea");
    let shot = coast_shot(UVec2::new(240, 135));
    let scene = Scene { sea: Some(&sea), ..Scene::for_shot(&land, Some(&water), &shot) };
    golden("storm", &render(&scene, &shot.view, &quick(8), &|_| {}));
    // A block of water is cut as its land is: waves end at the side, and beside it is the floor.
    let land = island(129, 12.0);
    let water = Water::flood(&land, 0.0).expect("an island");
    let sea = Sea::over(&land, &water, &"hs=4,tp=11,from=200".parse().expect("a state"), &|_| true).expect("a sea");
    let view = View::looking_at(DVec3::new(-700.0, -2100.0, 900.0), DVec3::ZERO, 0.7, UVec2::new(192, 108));
    let scene = Scene { sea: Some(&sea), border: Border::Cut, ..Scene::new(&land, Some(&water)) };
    let picture = render(&scene, &view, &quick(8), &|_| {});
    golden("block_of_sea", &picture);
    let wet = picture.position.iter().zip(&picture.height).filter(|(_, height)| height.is_finite());
    let half = 0.5 * land.extent() + 1e-2;
    assert!(wet.clone().all(|(p, _)| (view.eye + Vec3::from(*p).as_dvec3()).truncate().abs().cmple(half).all()));
    let side = |(p, height): (&[f32; 3], &f32)| (view.eye.y + f64::from(p[1]) + half.y).abs() < 0.1 && *height > -2.0;
    let edge: Vec<f32> = wet.filter(|w| side(*w)).map(|w| *w.1).collect();
    let (low, high) = edge.iter().fold((0.0f32, 0.0f32), |(low, high), h| (low.min(*h), high.max(*h)));
    assert!(edge.len() > 20 && high > 0.4, "the upper edge of the side is a wave: {low} to {high}");
}
