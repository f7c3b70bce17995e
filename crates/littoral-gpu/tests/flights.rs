//! Three flights on the GPU against the processor's rays: no sky, no other surface and no flicker between two of them within what is seen. `LITTORAL_FRAMES` says how many
//! frames each has: a few by itself.

use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::Fbm;
use littoral::field::{Land, Raster, Sea, Water, coast};
use littoral::lod::{Drawing, Limits, Lod, Patches};
use littoral::picture::{Picture, Scene, Settings, Stage};
use littoral::space::View;
use littoral::waves::SeaState;
use littoral_gpu::{Gpu, Painter};

const SIZE: UVec2 = UVec2::new(160, 90);

/// How many pixels were compared, and how many of them showed something else than rays find in and about them.
#[derive(Default)]
struct Seen {
    pixels: usize,
    wrong: usize,
    worst: f32,
}

/// Pixels whose distance on the GPU lies outside those of the nine rays through and about them, by more than `slack` of it.
fn compare(rays: &Picture, painted: &Picture, slack: f32, seen: &mut Seen) {
    let (width, height) = (SIZE.x as usize, SIZE.y as usize);
    // Nothing is infinitely far.
    let distance = |picture: &Picture, i: usize| if picture.depth[i] > 0.0 { picture.depth[i] } else { f32::INFINITY };
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let at = |dx: usize, dy: usize| distance(rays, (y + dy - 1) * width + x + dx - 1);
            let about = || (0..9).map(|k| at(k % 3, k / 3));
            let (near, far) = (about().fold(f32::INFINITY, f32::min), about().fold(0.0, f32::max));
            let drawn = distance(painted, y * width + x);
            // Mist beyond the land is at no distance that rays would tell.
            let misty = |k: usize| {
                let i = (y + k / 3 - 1) * width + x + k % 3 - 1;
                rays.coverage[i] > 0.0 && rays.depth[i] == f32::INFINITY
            };
            if (0..9).any(misty) {
                continue;
            }
            seen.pixels += 1;
            let off = (near / drawn).max(drawn / far);
            if off > 1.0 + slack || off.is_nan() && drawn != far {
                seen.wrong += 1;
                seen.worst = seen.worst.max(off);
            }
        }
    }
}

fn fly(
    gpu: &Gpu,
    stage: &Stage,
    mut sea: Option<Sea>,
    frames: u32,
    camera: &dyn Fn(f64) -> (DVec3, DVec3),
    slack: f32,
) -> Seen {
    let land = stage.land();
    let mut painter = Painter::new(gpu.clone(), stage).expect("a natural scene");
    painter.set_waves(sea.as_ref()).expect("known waves");
    let mut lod = Patches::new(Limits { finest: land.finest_level(), triangles: 500_000 });
    let mut drawing = Drawing::default();
    let mut seen = Seen::default();
    for frame in 0..frames {
        let t = f64::from(frame) / f64::from(frames);
        let (eye, target) = camera(t);
        let view = View::looking_at(eye, target, 0.8, SIZE);
        if let Some(sea) = &mut sea {
            sea.set_time(100.0 * t);
            painter.follow_waves(sea);
        }
        lod.select(land, &view, &mut drawing).expect("a view");
        drawing.expand(land);
        // By turns as a mesh and by rays.
        let ground = (frame % 2 == 0).then_some(&drawing.mesh);
        let painted = painter.picture(stage, ground, &view, 1, &|_| {}).expect("a picture");
        let rays = stage.render_sea(sea.as_ref(), &view, &Settings { samples: 1, ..Settings::default() }, &|_| {});
        compare(&rays, &painted, slack, &mut seen);
    }
    seen
}

#[test]
fn flights_show_what_rays_find() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return eprintln!("not tested: {e}"),
    };
    let frames = std::env::var("LITTORAL_FRAMES").ok().and_then(|n| n.parse().ok()).unwrap_or(6);
    let fbm = Fbm::new(7000.0, 1100.0, 9, 5);
    let height = |i: usize| fbm.at(DVec2::new((i % 513) as f64, (i / 513) as f64) * 30.0).value as f32 + 800.0;
    let raster = Raster::new(513, 513, DVec2::splat(30.0), (0..513 * 513).map(height).collect()).expect("valid");
    let mountains = Land::new(raster);
    let over = |from: DVec2, to: DVec2, above: f64, down: f64| {
        let land = mountains.clone();
        move |t: f64| {
            let at = from.lerp(to, t);
            let ground = |at: DVec2| f64::from(land.height_at(at).unwrap_or(0.0));
            let ahead = (to - from).normalize();
            let eye =
                at.extend((-4..=4).map(|i| ground(at + ahead * f64::from(i) * 100.0)).fold(0.0, f64::max) + above);
            (eye, eye + ahead.extend(-down) * 1000.0)
        }
    };
    let (low, size) = (mountains.origin(), mountains.extent());
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let (south, extent) = (land.origin(), land.extent());
    let along = |t: f64| {
        let at = south + extent * DVec2::new(0.3 + 0.3 * t, 0.35 + 0.05 * t);
        let ground = f64::from(land.height_at(at).unwrap_or(0.0)).max(0.0);
        let eye = at.extend(ground + 60.0);
        (eye, eye + DVec3::new(1000.0 * (6.3 * t).cos(), 1000.0 * (6.3 * t).sin(), -120.0))
    };
    let inland = Stage::new(&Scene::new(&mountains, None));
    let shore = Stage::new(&Scene::new(&land, Some(&water)));
    let gale = SeaState::beaufort(7.0, 0.6).expect("a state");
    let gale = Sea::over(&land, &water, &gale, &|_| true).expect("a sea");
    let low_over = over(low + size * 0.25, low + size * DVec2::new(0.7, 0.6), 150.0, 0.1);
    let high_over = over(low + size * 0.2, low + size * DVec2::new(0.8, 0.5), 5000.0, 0.8);
    // How far the mesh may be off by its tolerance, a pixel, is within the rays about it, but where low ground is grazed and more is seen behind it; waves of the grid are coarser than those that rays find.
    let flights: [(&str, Seen); 4] = [
        ("low over mountains", fly(&gpu, &inland, None, frames, &low_over, 0.01)),
        ("high over mountains", fly(&gpu, &inland, None, frames, &high_over, 0.01)),
        ("along a calm coast", fly(&gpu, &shore, None, frames, &along, 0.01)),
        ("along a coast in a gale", fly(&gpu, &shore, Some(gale), frames, &along, 0.03)),
    ];
    for (name, Seen { pixels, wrong, worst }) in &flights {
        eprintln!(
            "{name}: {wrong} of {pixels} pixels in {frames} frames show something else (at worst {worst} times as far)"
        );
    }
    for (name, seen) in flights {
        assert!(
            seen.wrong * 2000 < seen.pixels,
            "{name}: {} of {} pixels, at worst by {}",
            seen.wrong,
            seen.pixels,
            seen.worst
        );
    }
}
