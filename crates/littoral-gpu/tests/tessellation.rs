//! Tessellation on the device: the processor's triangles, and what every method of detail promises.

#![allow(missing_docs)]

#[path = "../../littoral/tests/lod/check.rs"]
mod check;
#[path = "../../littoral/tests/lod/surfaces.rs"]
#[expect(dead_code, reason = "the suite of the processor's methods asks for more surfaces")]
mod surfaces;

use check::{Case, check, sorted};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::{HeightField, Land, Raster, coast};
use littoral::lod::{Drawing, Limits, Lod, Patches, Reached, ViewError};
use littoral::picture::{Scene, Stage, coast_shot};
use littoral::space::View;
use littoral_gpu::{Gpu, Painter, Tessellated, TessellationPasses, Tessellator};
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
    tessellator: Tessellator,
    /// What the last one came to.
    told: Option<Tessellated>,
}

impl OnDevice<'_> {
    fn new<'a>(gpu: &'a Gpu, passes: &TessellationPasses, land: &Land, limits: Limits) -> OnDevice<'a> {
        OnDevice { gpu, tessellator: Tessellator::new(gpu, passes, land, limits).expect("a small land"), told: None }
    }

    fn with_room<'a>(
        gpu: &'a Gpu,
        passes: &TessellationPasses,
        land: &Land,
        limits: Limits,
        cells: u64,
    ) -> OnDevice<'a> {
        let tessellator = Tessellator::with_room(gpu, passes, land, limits, cells).expect("a small land");
        OnDevice { gpu, tessellator, told: None }
    }
}

impl Lod for OnDevice<'_> {
    fn select(&mut self, _: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.tessellator.tessellate(self.gpu, &mut encoder, view, None)?;
        self.gpu.queue.submit([encoder.finish()]);
        drawing.clear();
        drawing.mesh = self.tessellator.mesh(self.gpu).expect("a device");
        let told = self.tessellator.read(self.gpu).expect("a device");
        assert!(told.triangles as usize <= self.tessellator.limits().triangles, "{told:?}");
        self.told = Some(told);
        Ok(told.reached)
    }
}

/// Triangles that both draw, and those that only one of them does.
fn compare(land: &Land, limits: Limits, on_device: &mut OnDevice, view: &View) -> (usize, usize) {
    let mut twin = Patches::new(limits);
    let (mut expected, mut got) = (Drawing::default(), Drawing::default());
    let reached = twin.select(land, view, &mut expected).expect("a view");
    expected.expand(land);
    let told = on_device.select(land, view, &mut got).expect("a view");
    let (expected, got) = (sorted(&expected), sorted(&got));
    assert!(got.windows(2).all(|pair| pair[0] != pair[1]), "a triangle is drawn twice");
    let [expected, got] = [&expected, &got].map(|all| all.iter().collect::<HashSet<_>>());
    let apart = expected.symmetric_difference(&got).count();
    if apart == 0 {
        assert!((told.pixels - reached.pixels).abs() <= 1e-4 * reached.pixels, "{told:?} for {reached:?}");
        assert_eq!(told.limited, reached.limited);
    }
    (expected.intersection(&got).count(), apart)
}

#[test]
fn the_coast_in_the_processors_triangles() {
    let Some((gpu, _alone)) = gpu() else { return };
    let passes = TessellationPasses::new(&gpu);
    let land = coast::coast();
    let (mut same, mut apart) = (0, 0);
    for triangles in [500_000, 20_000, 700] {
        let limits = Limits { finest: land.finest_level(), triangles };
        let mut on_device = OnDevice::new(&gpu, &passes, &land, limits);
        for turn in 0..8 {
            let view = coast_shot(UVec2::new(960, 540)).view;
            let towards = DVec3::new((f64::from(turn) * 0.8).sin(), (f64::from(turn) * 0.8).cos(), -0.2);
            let mut view = View::looking_at(view.eye, view.eye + towards, 0.9, view.size);
            view.tolerance_pixels = [0.5, 1.0, 3.0][turn as usize % 3];
            let (both, one) = compare(&land, limits, &mut on_device, &view);
            (same, apart) = (same + both, apart + one);
        }
    }
    eprintln!("the coast: {same} triangles drawn by both, {apart} by one of them");
    assert!(same > 100_000);
    assert!(apart * 2000 < same, "{apart} triangles apart of {same}");
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
    let passes = TessellationPasses::new(&gpu);
    let (mut same, mut apart, mut views) = (0, 0, 0);
    for seed in cases() {
        let mut random = Random::new(seed);
        let most = if seed % 4 == 0 { 200 } else { 70 };
        let (columns, rows) = (2 + random.below(most) as usize, 2 + random.below(most) as usize);
        let mut land = random_terrain(columns, rows, &mut random);
        if seed % 3 == 0 {
            land = Land::at(land.raster().clone(), DVec2::new(6.2e6, -3.1e6));
        }
        // Coarser than the samples, as fine, or finer, which the device does not draw.
        let finest = (land.finest_level() + random.below(3) as u8).saturating_sub(1);
        let limits = Limits { finest, triangles: [300, 4_000, 20_000][random.below(3) as usize] };
        let mut on_device = OnDevice::new(&gpu, &passes, &land, limits);
        let limits = Limits { finest: finest.min(land.finest_level()), ..limits };
        let surface = surface_of(land.clone());
        for turn in 0..3 {
            let view = random_view(&surface, &mut random);
            let label = format!("seed {seed} view {turn}");
            check(&mut on_device, &Case { surface: &surface, view: &view, limits, label: &label }, &mut random);
            let (both, one) = compare(&land, limits, &mut on_device, &view);
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
fn full_lists_raise_the_tolerance() {
    let Some((gpu, _alone)) = gpu() else { return };
    let passes = TessellationPasses::new(&gpu);
    let coast = coast::coast();
    let mut full = 0;
    for seed in 0..12 {
        let mut random = Random::new(500 + seed);
        let land = if seed < 4 { coast.clone() } else { random_terrain(90, 60, &mut random) };
        let limits = Limits { finest: land.finest_level(), triangles: 100_000 };
        let room = [64, 100, 600, 2000][seed as usize % 4];
        let surface = Surface { samples: None, ..surface_of(land.clone()) };
        let mut on_device = OnDevice::with_room(&gpu, &passes, &land, limits, room);
        for turn in 0..2 {
            let view = match seed {
                0..4 => coast_shot(UVec2::new(960, 540)).view,
                _ => random_view(&surface, &mut random),
            };
            let label = format!("seed {seed} view {turn} room for {room}");
            let case = Case { surface: &surface, view: &view, limits, label: &label };
            check(&mut on_device, &case, &mut random);
            let told = on_device.told.expect("told");
            assert!(u64::from(told.looked_at) <= room, "{label}: {told:?}");
            let mut wanting = OnDevice::new(&gpu, &passes, &land, limits);
            wanting.select(&land, &view, &mut Drawing::default()).expect("a view");
            let wanted = wanting.told.expect("told");
            if u64::from(wanted.looked_at) > room {
                full += 1;
                // What there is room for is used.
                assert!(
                    told.reached.pixels >= wanted.reached.pixels && told.reached.limited,
                    "{label}: {told:?} for {wanted:?}"
                );
                assert!(u64::from(told.looked_at) > room / 3, "{label}: {told:?}");
            } else {
                assert_eq!(told, wanted, "{label}");
            }
        }
    }
    assert!(full > 6, "only {full} were full");
}

#[test]
fn views_and_lands_that_cannot_be_are_refused() {
    let Some((gpu, _alone)) = gpu() else { return };
    let passes = TessellationPasses::new(&gpu);
    let land = random_terrain(9, 9, &mut Random::new(1));
    let limits = Limits { finest: 30, triangles: usize::MAX };
    let mut tessellator = Tessellator::new(&gpu, &passes, &land, limits).expect("a small land");
    assert!(tessellator.limits().triangles as u64 * 48 <= gpu.device.limits().max_buffer_size);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let view = View::looking_at(DVec3::splat(f64::NAN), DVec3::ZERO, 1.0, UVec2::new(9, 9));
    assert_eq!(tessellator.tessellate(&gpu, &mut encoder, &view, None), Err(ViewError::NotFinite("an eye")));
    let side = gpu.device.limits().max_texture_dimension_2d as usize + 1;
    let raster = Raster::new(side, 2, DVec2::ONE, vec![0.0; 2 * side]).expect("valid");
    let refused = Tessellator::new(&gpu, &passes, &Land::new(raster), limits).expect_err("too long").to_string();
    assert!(refused.contains("draw fewer samples"), "{refused}");
    assert!(gpu.check().is_ok(), "{:?}", gpu.check());
}

#[test]
fn a_picture_of_made_is_that_of_their_mesh() {
    let Some((gpu, _alone)) = gpu() else { return };
    let size = UVec2::new(96, 54);
    let land = coast::coast();
    let shot = coast_shot(size);
    let stage = Stage::new(&Scene::for_shot(&land, None, &shot));
    let limits = Limits { finest: land.finest_level(), triangles: 60_000 };
    let mut drawing = Drawing::default();
    let reached = Patches::new(limits).select(&land, &shot.view, &mut drawing).expect("a view");
    drawing.expand(&land);
    let mut painter = Painter::new(gpu, &stage).expect("a natural scene");
    let told = painter.tessellate(&land, limits, &shot.view).expect("a small land");
    assert_eq!(told.triangles as usize, drawing.mesh.triangles.len());
    assert!((told.reached.pixels - reached.pixels).abs() < 1e-3 * reached.pixels, "{told:?} for {reached:?}");
    let patches = painter.picture_of_made(&stage, &shot.view, 1, &|_| {}).expect("a picture");
    let mesh = painter.picture(&stage, Some(&drawing.mesh), &shot.view, 1, &|_| {}).expect("a picture");
    assert_eq!(patches.radiance, mesh.radiance);
    assert_eq!(patches.depth, mesh.depth);
    assert!(mesh.depth.iter().filter(|depth| **depth > 0.0).count() > 2000, "hardly any ground");
}
