//! Bisection on the device: the processor's triangles whatever was drawn before, and what every method of detail promises.

#![allow(missing_docs)]

#[path = "../../littoral/tests/lod/check.rs"]
mod check;
#[path = "../../littoral/tests/lod/surfaces.rs"]
#[expect(dead_code, reason = "the suite of the processor's methods asks for more surfaces")]
mod surfaces;

use check::{Case, check, sorted};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::{HeightField, Land, Raster, coast};
use littoral::lod::{Drawing, Limits, Lod, NestedBounds, Reached, RoamOnce, ViewError};
use littoral::picture::{Scene, Stage, coast_shot};
use littoral::space::View;
use littoral_gpu::{Bisector, Gpu, Painter, Tessellated};
use std::collections::HashSet;
use std::sync::{Mutex, MutexGuard, PoisonError};
pub use surfaces::{Random, Surface};
use surfaces::{random_terrain, random_view, surface_of};

/// One device at a time: two that a processor stands for keep each other from its cores.
static ONE: Mutex<()> = Mutex::new(());

fn gpu() -> Option<(Gpu, MutexGuard<'static, ()>)> {
    let alone = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    match Gpu::headless() {
        Ok(gpu) => Some((gpu, alone)),
        Err(e) => {
            eprintln!("not tested: {e}");
            None
        }
    }
}

/// The device as a method of detail.
struct OnDevice<'a> {
    gpu: &'a Gpu,
    bisector: Bisector,
    /// What the last one came to.
    told: Option<Tessellated>,
}

impl OnDevice<'_> {
    fn new<'a>(gpu: &'a Gpu, bounds: &NestedBounds, limits: Limits) -> OnDevice<'a> {
        OnDevice { gpu, bisector: Bisector::new(gpu, bounds, limits).expect("a small land"), told: None }
    }
}

impl Lod for OnDevice<'_> {
    fn select(&mut self, _: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.bisector.bisect(self.gpu, &mut encoder, view, None)?;
        self.gpu.queue.submit([encoder.finish()]);
        drawing.clear();
        drawing.mesh = self.bisector.mesh(self.gpu).expect("a device");
        let told = self.bisector.read(self.gpu).expect("a device");
        assert!(told.triangles as usize <= self.bisector.limits().triangles, "{told:?}");
        self.told = Some(told);
        Ok(told.reached)
    }
}

/// What a land is asked about.
struct Twins<'a> {
    land: &'a Land,
    bounds: &'a NestedBounds,
    limits: Limits,
}

impl Twins<'_> {
    /// Triangles that both draw, and those that only one of them does; where triangles run out, only what was reached is compared.
    fn compare(&self, on_device: &mut OnDevice, view: &View) -> (usize, usize) {
        let mut expected = Drawing::default();
        let reached = RoamOnce::over(self.bounds, self.limits).draw(view, &mut expected.mesh).expect("a view");
        let mut got = Drawing::default();
        let told = on_device.select(self.land, view, &mut got).expect("a view");
        let mut all = Drawing::default();
        let unlimited = Limits { triangles: 1 << 20, ..self.limits };
        RoamOnce::over(self.bounds, unlimited).draw(view, &mut all.mesh).expect("a view");
        let (expected, got) = (sorted(&expected), sorted(&got));
        let out = sorted(&all) != expected;
        assert!(got.windows(2).all(|pair| pair[0] != pair[1]), "a triangle is drawn twice");
        if out {
            // Whole bins of a 256th of an octave are given back, with what is partly void among them.
            assert!(told.limited && reached.limited, "{told:?} for {reached:?}");
            let near = told.pixels <= reached.pixels * 1.01;
            assert!(near || told.pixels == f32::INFINITY, "{told:?} for {reached:?}");
            return (0, 0);
        }
        let [expected, got] = [&expected, &got].map(|all| all.iter().collect::<HashSet<_>>());
        let apart = expected.symmetric_difference(&got).count();
        if apart == 0 {
            let near = (told.pixels - reached.pixels).abs() <= 1e-3 * reached.pixels;
            assert!(near || told.pixels == reached.pixels, "{told:?} for {reached:?}");
            assert_eq!(told.limited, reached.limited);
        }
        (expected.intersection(&got).count(), apart)
    }
}

#[test]
fn a_flight_over_the_coast_in_the_processors_triangles() {
    let Some((gpu, _alone)) = gpu() else { return };
    let land = coast::coast();
    let bounds = NestedBounds::of(&land).expect("a small land");
    let (mut same, mut apart) = (0, 0);
    for triangles in [500_000, 20_000, 700] {
        let limits = Limits { finest: land.finest_level(), triangles };
        let twins = Twins { land: &land, bounds: &bounds, limits };
        let mut on_device = OnDevice::new(&gpu, &bounds, limits);
        let start = coast_shot(UVec2::new(960, 540)).view;
        for turn in 0..12 {
            // Onward by steps, then elsewhere at once.
            let angle = if turn < 8 { f64::from(turn) * 0.02 } else { f64::from(turn) * 1.3 };
            let eye = start.eye + DVec3::new(f64::from(turn) * 15.0, 0.0, f64::from(turn % 3) * 5.0);
            let mut view = View::looking_at(eye, eye + DVec3::new(angle.sin(), angle.cos(), -0.2), 0.9, start.size);
            view.tolerance_pixels = [0.5, 1.0, 3.0][turn as usize / 4];
            let (both, one) = twins.compare(&mut on_device, &view);
            (same, apart) = (same + both, apart + one);
        }
    }
    eprintln!("the coast: {same} triangles drawn by both, {apart} by one of them");
    assert!(same > 100_000);
    assert!(apart * 1000 < same, "{apart} triangles apart of {same}");
}

/// How many random lands are looked at.
fn cases() -> std::ops::Range<u64> {
    let number = |name| std::env::var(name).ok().and_then(|n| n.parse().ok());
    let first = number("LITTORAL_FIRST").unwrap_or(0);
    first..first + number("LITTORAL_CASES").unwrap_or(12)
}

#[test]
fn random_lands_keep_what_methods_promise() {
    let Some((gpu, _alone)) = gpu() else { return };
    let (mut same, mut apart, mut views) = (0, 0, 0);
    for seed in cases() {
        let mut random = Random::new(seed);
        let most = if seed % 4 == 0 { 200 } else { 70 };
        let (columns, rows) = (2 + random.below(most) as usize, 2 + random.below(most) as usize);
        let mut land = random_terrain(columns, rows, &mut random);
        if seed % 3 == 0 {
            land = Land::at(land.raster().clone(), DVec2::new(6.2e6, -3.1e6));
        }
        let bounds = NestedBounds::of(&land).expect("a small land");
        let finest = land.finest_level() - (random.below(2) as u8).min(land.finest_level());
        let limits = Limits { finest, triangles: [300, 4_000, 20_000][random.below(3) as usize] };
        let twins = Twins { land: &land, bounds: &bounds, limits };
        let mut on_device = OnDevice::new(&gpu, &bounds, limits);
        let surface = surface_of(land.clone());
        for turn in 0..4 {
            let view = random_view(&surface, &mut random);
            let label = format!("seed {seed} view {turn}");
            check(&mut on_device, &Case { surface: &surface, view: &view, limits, label: &label }, &mut random);
            let (both, one) = twins.compare(&mut on_device, &view);
            if one > 0 {
                eprintln!("{label}: {both} triangles drawn by both, {one} by one of them");
            }
            (same, apart, views) = (same + both, apart + one, views + usize::from(one > 0));
        }
    }
    eprintln!("random lands: {same} triangles drawn by both, {apart} by one of them, in {views} views");
    assert!(apart * 500 <= same, "{apart} triangles apart of {same}");
}

#[test]
fn where_lists_are_full_what_was_reached_is_told() {
    let Some((gpu, _alone)) = gpu() else { return };
    let coast = coast::coast();
    let mut full = 0;
    for seed in 0..12 {
        let mut random = Random::new(500 + seed);
        let land = if seed < 4 { coast.clone() } else { random_terrain(90, 60, &mut random) };
        let bounds = NestedBounds::of(&land).expect("a small land");
        let limits = Limits { finest: land.finest_level(), triangles: 100_000 };
        let room = [64, 100, 600, 2000][seed as usize % 4];
        let surface = Surface { samples: None, ..surface_of(land.clone()) };
        let bisector = Bisector::with_room(&gpu, &bounds, limits, room).expect("a small land");
        let mut on_device = OnDevice { gpu: &gpu, bisector, told: None };
        for turn in 0..3 {
            let view = match seed {
                0..4 => coast_shot(UVec2::new(960, 540)).view,
                _ => random_view(&surface, &mut random),
            };
            let label = format!("seed {seed} view {turn} room for {room}");
            check(&mut on_device, &Case { surface: &surface, view: &view, limits, label: &label }, &mut random);
            let told = on_device.told.expect("told");
            assert!(u64::from(told.looked_at) <= room, "{label}: {told:?}");
            full += usize::from(u64::from(told.looked_at) == room);
        }
    }
    assert!(full > 6, "only {full} were full");
}

#[test]
fn views_and_lands_that_cannot_be_are_refused() {
    let Some((gpu, _alone)) = gpu() else { return };
    let land = random_terrain(9, 9, &mut Random::new(1));
    let bounds = NestedBounds::of(&land).expect("a small land");
    let limits = Limits { finest: 30, triangles: usize::MAX };
    let mut bisector = Bisector::new(&gpu, &bounds, limits).expect("a small land");
    assert_eq!(bisector.limits(), Limits { finest: 3, triangles: 128 });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let view = View::looking_at(DVec3::splat(f64::NAN), DVec3::ZERO, 1.0, UVec2::new(9, 9));
    assert_eq!(bisector.bisect(&gpu, &mut encoder, &view, None), Err(ViewError::NotFinite("an eye")));
    let most = gpu.device.limits().max_texture_dimension_2d as usize;
    if most < NestedBounds::MOST {
        let raster = Raster::new(most + 1, 2, DVec2::ONE, vec![0.0; 2 * (most + 1)]).expect("valid");
        let bounds = NestedBounds::of(&Land::new(raster)).expect("few enough");
        let refused = Bisector::new(&gpu, &bounds, limits).expect_err("too long").to_string();
        assert!(refused.contains("draw fewer samples"), "{refused}");
    }
    assert!(gpu.check().is_ok(), "{:?}", gpu.check());
}

#[test]
fn a_picture_of_bisection_is_that_of_its_mesh() {
    let Some((gpu, _alone)) = gpu() else { return };
    let size = UVec2::new(96, 54);
    let land = coast::coast();
    let bounds = NestedBounds::of(&land).expect("a small land");
    let shot = coast_shot(size);
    let stage = Stage::new(&Scene::for_shot(&land, None, &shot));
    let limits = Limits { finest: land.finest_level(), triangles: 60_000 };
    let mut drawing = Drawing::default();
    let reached = RoamOnce::over(&bounds, limits).draw(&shot.view, &mut drawing.mesh).expect("a view");
    let mut painter = Painter::new(gpu, &stage).expect("a natural scene");
    let elsewhere = View::looking_at(DVec3::new(0.0, 0.0, 900.0), DVec3::ZERO, 0.9, size);
    painter.bisect(&bounds, limits, &elsewhere).expect("a small land");
    let told = painter.bisect(&bounds, limits, &shot.view).expect("a small land");
    assert_eq!(told.triangles as usize, drawing.mesh.triangles.len());
    assert!((told.reached.pixels - reached.pixels).abs() < 1e-3 * reached.pixels, "{told:?} for {reached:?}");
    let chosen = painter.picture_of_made(&stage, &shot.view, 1, &|_| {}).expect("a picture");
    let mesh = painter.picture(&stage, Some(&drawing.mesh), &shot.view, 1, &|_| {}).expect("a picture");
    assert_eq!(chosen.radiance, mesh.radiance);
    assert_eq!(chosen.depth, mesh.depth);
    assert!(mesh.depth.iter().filter(|depth| **depth > 0.0).count() > 2000, "hardly any ground");
}
