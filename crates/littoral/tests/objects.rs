//! Objects in pictures: where they stand, what lies before what, and in which light.

use glam::{DVec2, DVec3, UVec2, Vec3, Vec3Swizzles};
use littoral::field::{Land, Raster, Sea, Water, coast};
use littoral::lod::{Drawing, Limits, Method};
use littoral::objects::{Corner, Footing, Form, Object, Standing, buoy, lighthouse};
use littoral::picture::{Meshes, Picture, Scene, Settings, Stage, Sun};
use littoral::space::View;
use std::sync::Arc;

/// Land of 2 km, a sample every 10 m.
fn land(height: impl Fn(DVec2) -> f64) -> Land {
    let heights =
        (0..201 * 201).map(|i| height(DVec2::new((i % 201) as f64, (i / 201) as f64) * 10.0) as f32).collect();
    Land::at(Raster::new(201, 201, DVec2::splat(10.0), heights).expect("valid"), DVec2::ZERO)
}

/// A box of half a side (m) about a middle, that throws back this much.
fn block(half: Vec3, middle: Vec3, albedo: Vec3) -> Arc<Object> {
    let mut form = Form::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut normal = Vec3::ZERO;
            normal[axis] = sign;
            let (across, upward) = (normal.yzx().abs(), normal.zxy().abs());
            let base = form.corners.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let position = middle + half * (normal + across * x + upward * y);
                form.corners.push(Corner { position, normal, albedo });
            }
            form.triangles.extend([[base, base + 1, base + 2], [base + 1, base + 3, base + 2]]);
        }
    }
    Arc::new(Object::new(vec![form]).expect("a box"))
}

fn render(scene: &Scene, view: &View) -> Picture {
    Stage::new(scene).render(view, &Settings { samples: 4, ..Settings::default() }, &|_| {})
}

/// The height (m) of what is seen at a place of the world, and how far away it is.
fn seen(picture: &Picture, view: &View, at: DVec3) -> (f32, f32) {
    let pixel = view.pixel(at).expect("ahead").as_uvec2();
    let i = (pixel.y * view.size.x + pixel.x) as usize;
    (picture.height[i], picture.depth[i])
}

#[test]
fn a_hill_hides_what_is_behind_it_and_is_hidden_by_what_is_before() {
    // A ridge along x at y = 1000, 100 m high.
    let land = land(|at| (100.0 - 0.5 * (at.y - 1000.0).abs()).max(0.0));
    let tower = block(Vec3::new(20.0, 20.0, 30.0), Vec3::Z * 30.0, Vec3::splat(0.5));
    let objects = [600.0, 1400.0].map(|y| Standing::at(&tower, DVec2::new(1000.0, y)));
    let eye = DVec3::new(1000.0, 0.0, 60.0);
    let view = View::looking_at(eye, DVec3::new(1000.0, 1000.0, 60.0), 0.5, UVec2::new(160, 120));
    let scene = Scene { objects: &objects, ..Scene::new(&land, None) };
    let picture = render(&scene, &view);
    let (height, near) = seen(&picture, &view, DVec3::new(1000.0, 580.0, 40.0));
    assert!((height - 40.0).abs() < 2.0 && (near - 580.0).abs() < 5.0, "{height} {near}");
    // The other is 60 m high behind a ridge of 100 m.
    let bare = render(&Scene { objects: &objects[..1], ..scene }, &view);
    assert_eq!(bare.radiance, picture.radiance);
    let hidden = render(&Scene { objects: &objects[1..], ..scene }, &view);
    assert_eq!(hidden.radiance, render(&Scene { objects: &[], ..scene }, &view).radiance);
    // Three times as large it looks over.
    let tall = [Standing { scale: 3.0, ..objects[1].clone() }];
    let over = render(&Scene { objects: &tall, ..scene }, &view);
    assert!(seen(&over, &view, DVec3::new(1000.0, 1340.0, 150.0)).0 > 140.0);
}

#[test]
fn what_stands_in_water_shows_above_it_and_what_floats_lies_on_it() {
    let land = land(|at| if at.y < 1500.0 { -8.0 } else { 40.0 });
    let water = Water::flood(&land, 0.0).expect("a sea");
    let pile = block(Vec3::new(15.0, 15.0, 10.0), Vec3::Z * 10.0, Vec3::splat(0.5));
    let at = DVec2::new(1000.0, 700.0);
    let pose = |footing| {
        Standing { footing, ..Standing::at(&pile, at) }.pose(&land, Some(&water), None, None).expect("somewhere")
    };
    assert_eq!(pose(Footing::Ground).origin, at.extend(-8.0));
    assert_eq!(pose(Footing::Surface).origin, at.extend(0.0));
    assert_eq!(Standing::at(&pile, DVec2::new(1e5, 2e5)).pose(&land, None, None, None), None);

    let view = View::looking_at(DVec3::new(1000.0, 400.0, 40.0), at.extend(0.0), 0.4, UVec2::new(120, 90));
    let objects = [Standing { footing: Footing::Ground, ..Standing::at(&pile, at) }];
    let picture = render(&Scene { objects: &objects, ..Scene::new(&land, Some(&water)) }, &view);
    // Twelve of its twenty metres are above the water; of the others nothing is seen.
    let front = |z: f64| seen(&picture, &view, DVec3::new(1000.0, 685.0, z)).0;
    assert!((front(9.0) - 9.0).abs() < 1.0 && (front(2.5) - 2.5).abs() < 1.0, "{} {}", front(9.0), front(2.5));
    assert!(front(-2.0).abs() < 0.01 && front(-6.0).abs() < 0.01, "{} {}", front(-2.0), front(-6.0));
}

#[test]
fn what_floats_rises_and_leans_with_the_waves() {
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let mut sea = Sea::over(&land, &water, &"hs=3,tp=9,from=200".parse().expect("a state"), &|_| true).expect("a sea");
    let buoy = Standing::at(&Arc::new(buoy()), DVec2::new(3000.0, 300.0));
    let (mut low, mut high, mut leaning) = (f64::INFINITY, f64::NEG_INFINITY, 0f32);
    for second in 0..30 {
        sea.set_time(f64::from(second));
        let pose = buoy.pose(&land, Some(&water), None, Some(&sea)).expect("afloat");
        let surface = sea.surface_at(buoy.place, 2.4);
        assert!((pose.origin.z - surface.height).abs() < 1e-9);
        let normal = Vec3::new(-surface.slope.x, -surface.slope.y, 1.0).normalize();
        assert!(pose.axes.z_axis.distance(normal) < 1e-5, "{} {normal}", pose.axes.z_axis);
        (low, high) = (low.min(pose.origin.z), high.max(pose.origin.z));
        leaning = leaning.max(1.0 - normal.z);
    }
    assert!(high - low > 1.0 && leaning > 1e-4, "{low} {high} {leaning}");
}

#[test]
fn it_turns_clockwise_and_stands_on_the_full_data_whatever_is_drawn() {
    let land = land(|at| 60.0 + 30.0 * (at.x * 0.02).sin() * (at.y * 0.03).cos());
    let place = DVec2::new(1003.0, 907.0);
    let bar = block(Vec3::new(1.0, 20.0, 5.0), Vec3::new(0.0, 20.0, 45.0), Vec3::new(0.6, 0.02, 0.02));
    let east = Standing { heading: 90f64.to_radians(), ..Standing::at(&bar, place) };
    let pose = east.pose(&land, None, None, None).expect("on the ground");
    assert_eq!(pose.origin.z, f64::from(land.height_at(place).expect("known")));
    let tip = pose.world(Vec3::new(0.0, 40.0, 45.0));
    assert!((tip - pose.origin).distance(DVec3::new(40.0, 0.0, 45.0)) < 1e-4, "{tip}");

    let objects = [east];
    let scene = Scene { objects: &objects, ..Scene::new(&land, None) };
    let view = View::looking_at(DVec3::new(1020.0, 500.0, 160.0), place.extend(80.0), 0.35, UVec2::new(120, 90));
    let stage = Stage::new(&scene);
    let settings = Settings { samples: 4, ..Settings::default() };
    let exact = stage.render(&view, &settings, &|_| {});
    let limits = Limits { finest: 2, triangles: 100_000 };
    let mut drawing = Drawing::default();
    Method::Quadtree.within(limits).select(stage.land(), &view, &mut drawing).expect("a view");
    drawing.expand(stage.land());
    let meshes = Meshes { ground: Some(&drawing.mesh), ..Meshes::default() };
    let coarse = stage.render_meshes(&meshes, None, &view, &settings, &|_| {});
    assert!(exact.height != coarse.height, "the ground is drawn coarsely");
    // The bar stays where it is, above what is drawn, but for its edges, at which the ground is seen, too.
    let red =
        |picture: &Picture, i: usize| picture.radiance[i][0] > 3.0 * picture.radiance[i][1] && picture.height[i] > 85.0;
    let both: Vec<usize> = (0..exact.radiance.len()).filter(|&i| red(&exact, i) && red(&coarse, i)).collect();
    let one = (0..exact.radiance.len()).filter(|&i| red(&exact, i) != red(&coarse, i)).count();
    assert!(both.len() > 100 && one < 10, "{} {one}", both.len());
    assert!(both.iter().all(|&i| exact.height[i] == coarse.height[i]));
}

#[test]
fn sun_and_the_shadow_of_the_land_fall_on_it() {
    // A wall of rock in the west, 200 m high, and low sun behind it.
    let land = land(|at| if at.x < 500.0 { 200.0 } else { 0.0 });
    let tower = block(Vec3::new(10.0, 10.0, 75.0), Vec3::Z * 75.0, Vec3::splat(0.5));
    let objects = [Standing::at(&tower, DVec2::new(800.0, 1000.0))];
    let sun = Sun::new(270f64.to_radians(), 20f64.to_radians());
    let scene = Scene { objects: &objects, sun, ..Scene::new(&land, None) };
    let stage = Stage::new(&scene);
    // The edge at x = 500 hides the sun up to 200 − 290 tan 20° ≈ 94 m.
    let sunny = stage.placed(None)[0].sunny;
    assert_eq!(sunny, [0.0, 0.0, 1.0, 1.0]);
    let eye = DVec3::new(560.0, 1000.0, 80.0);
    let view = View::looking_at(eye, DVec3::new(800.0, 1000.0, 80.0), 0.8, UVec2::new(120, 120));
    let picture = stage.render(&view, &Settings { samples: 8, ..Settings::default() }, &|_| {});
    let bright = |z: f64| {
        let pixel = view.pixel(DVec3::new(790.0, 1000.0, z)).expect("ahead").as_uvec2();
        picture.radiance[(pixel.y * 120 + pixel.x) as usize][1]
    };
    assert!(bright(120.0) > 2.5 * bright(70.0), "{} {}", bright(120.0), bright(70.0));
    assert!((bright(70.0) / bright(40.0) - 1.0).abs() < 0.4, "{} {}", bright(70.0), bright(40.0));
}

#[test]
fn far_away_a_coarse_form_does() {
    let lighthouse = Arc::new(lighthouse());
    let land = land(|_| 0.0);
    let pose = Standing::at(&lighthouse, DVec2::new(1000.0, 1000.0)).pose(&land, None, None, None).expect("somewhere");
    let form = |distance: f64, tolerance_pixels: f32| {
        let eye = DVec3::new(1000.0, 1000.0 - distance, 10.0);
        let view = View::looking_at(eye, DVec3::new(1000.0, 1000.0, 10.0), 0.8, UVec2::new(1280, 720));
        pose.form(&lighthouse, &View { tolerance_pixels, ..view })
    };
    let last = lighthouse.forms().len() - 1;
    assert_eq!((form(30.0, 0.05), form(20_000.0, 1.0)), (Some(0), Some(last)));
    let chosen: Vec<_> = (5..14).map(|k| form(f64::from(1 << k), 0.5).expect("seen")).collect();
    assert!(chosen.is_sorted() && chosen[0] < chosen[8], "{chosen:?}");
    for (k, &number) in (5..14).zip(&chosen) {
        let (_, radius) = lighthouse.ball();
        let focal = 360.0 / 0.4f32.tan();
        let pixels = |number: usize| lighthouse.forms()[number].error * focal / ((1 << k) as f32 - radius - 5.0);
        assert!(pixels(number) < 0.55, "{number} at {k}");
    }
    let behind =
        View::looking_at(DVec3::new(1000.0, 1000.0, 60.0), DVec3::new(1000.0, 1000.0, 900.0), 0.8, UVec2::new(64, 64));
    assert_eq!(pose.form(&lighthouse, &behind), None);
}

#[test]
fn a_thousand_of_them_give_the_same_picture_twice_and_none_of_a_map() {
    let land = land(|at| 20.0 * (at.x * 0.01).sin());
    let boulder = Arc::new(lighthouse());
    let objects: Vec<Standing> = (0..1000)
        .map(|i| Standing {
            scale: 0.2,
            ..Standing::at(&boulder, DVec2::new(f64::from(i % 40), f64::from(i / 40)) * 48.0 + 40.0)
        })
        .collect();
    let scene = Scene { objects: &objects, ..Scene::new(&land, None) };
    let view =
        View::looking_at(DVec3::new(1000.0, -300.0, 200.0), DVec3::new(1000.0, 900.0, 0.0), 0.8, UVec2::new(96, 64));
    let first = render(&scene, &view);
    assert_eq!(first.radiance, render(&scene, &view).radiance);
    assert_ne!(first.radiance, render(&Scene { objects: &[], ..scene }, &view).radiance);
    let map = Scene { style: littoral::picture::Style::Relief, ..scene };
    assert_eq!(render(&map, &view).radiance, render(&Scene { objects: &[], ..map }, &view).radiance);
}
