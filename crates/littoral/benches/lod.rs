//! Grids that follow the eye: the set-ups of the papers, and every method on one view of land and of sea. Processor time.
//!
//! * *Nested grids*, 2009: six windows of 32 cells over a sea of 16 × 8 waves, heights and normals, 1024 × 768 pixels.

mod clock;

use clock::{median, processor_time};
use glam::{DVec2, DVec3, UVec2, Vec3};
use littoral::field::noise::Fbm;
use littoral::field::{HeightField, Land, Raster, Sea, coast};
use littoral::lod::{Drawing, Limits, Lod, Nested, Patches, Quadtree};
use littoral::memory::collected;
use littoral::space::{Datum, View};
use littoral::waves::Superposition;
use std::hint::black_box;

fn main() {
    nested();
    everyone();
}

/// A sea of 16 frequencies in 8 directions, 3 km a side.
fn sea() -> Sea {
    let datum = Datum::Plane { origin: DVec2::splat(-1500.0), size: DVec2::splat(3000.0) };
    let waves = Superposition::of_state(&coast::sea_state(), 16, 8).expect("a sea");
    Sea::new(datum, 0.0).with(Box::new(waves))
}

/// The set-up of 2009.
fn nested() {
    let mut sea = sea();
    let mut lod = Nested::new(Limits { finest: 30, triangles: usize::MAX });
    (lod.cells, lod.windows) = (32, Some(6));
    let (mut drawing, mut normals) = (Drawing::default(), Vec::<Vec3>::new());
    let mut frame = 0;
    let mut parts = [Vec::new(), Vec::new()];
    let seconds = median(301, || {
        frame += 1;
        let time = f64::from(frame) / 60.0;
        let eye = DVec3::new(-200.0 + 10.0 * time, -300.0, 12.0);
        let view =
            View::looking_at(eye, eye + DVec3::new(300.0, 900.0, -120.0), 45f32.to_radians(), UVec2::new(1024, 768));
        let begin = processor_time();
        sea.set_time(time);
        lod.select(&sea, &view, &mut drawing).expect("a view");
        let chosen = processor_time();
        drawing.mesh.normals(&sea.datum(), &mut normals);
        black_box(&normals);
        parts[0].push(chosen - begin);
        parts[1].push(processor_time() - chosen);
    });
    let [chosen, shaded] = parts.map(|mut part| {
        part.sort_by(f64::total_cmp);
        part[part.len() / 2] * 1e3
    });
    println!(
        "nested, 6 windows of 32 cells, 16 x 8 waves: {:.3} ms a frame ({chosen:.3} choice and heights, {shaded:.3} normals), {} of {} vertices evaluated, {} triangles",
        seconds * 1e3,
        drawing.mesh.vertices.len(),
        6 * 33 * 33,
        drawing.mesh.triangles.len()
    );
}

/// Every method of this file's on views of land and sea.
fn everyone() {
    let land = mountains(4097);
    let sea = sea();
    let at = land.origin() + land.extent() * 0.3;
    let low = at.extend(f64::from(land.height_at(at).unwrap_or(0.0)) + 150.0);
    let views: [(&str, &dyn HeightField, u8, DVec3, DVec3); 3] = [
        ("low over mountains", &land, 12, low, DVec3::new(0.8, 0.6, -0.1)),
        ("high above them", &land, 12, at.extend(6000.0), DVec3::new(0.8, 0.6, -0.8)),
        ("over the sea", &sea, 12, DVec3::new(-500.0, -800.0, 25.0), DVec3::new(0.3, 0.9, -0.12)),
    ];
    for (name, field, finest, eye, ahead) in views {
        let view = View::looking_at(eye, eye + 1000.0 * ahead, 50f32.to_radians(), UVec2::new(1280, 720));
        for triangles in [150_000, 1_000_000] {
            let limits = Limits { finest, triangles };
            let methods: [(&str, Box<dyn Lod>); 3] = [
                ("nested", Box::new(Nested::new(limits))),
                ("quadtree", Box::new(Quadtree::new(limits))),
                ("patches", Box::new(Patches::new(limits))),
            ];
            for (method, mut lod) in methods {
                let mut drawing = Drawing::default();
                let mut reached = None;
                let mut look = || reached = Some(lod.select(field, &view, &mut drawing).expect("a view"));
                look();
                let seconds = median(9, look);
                println!(
                    "{name}, at most {triangles} triangles, {method:<9} {:.2} ms, {} triangles, {:.2} pixels",
                    seconds * 1e3,
                    drawing.triangles(),
                    reached.map_or(f32::NAN, |r| r.pixels)
                );
            }
        }
    }
}

/// Mountains of 30 × 30 km.
fn mountains(side: usize) -> Land {
    let step = 30_000.0 / (side - 1) as f64;
    let noise = Fbm::new(8000.0, 900.0, 10, 5);
    let at = |i: usize| DVec2::new((i % side) as f64, (i / side) as f64) * step;
    let heights = collected((0..side * side).map(|i| noise.at(at(i)).value as f32));
    Land::new(Raster::new(side, side, DVec2::splat(step), heights).expect("sizes are valid"))
}
