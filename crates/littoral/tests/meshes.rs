//! Pictures of meshes against pictures of the surfaces they are of.

use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::Fbm;
use littoral::field::{HeightField, Land, Raster, Sea, Water};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Patches, Quadtree};
use littoral::picture::{Border, Meshes, Picture, Scene, Settings, Stage};
use littoral::space::{Datum, View};
use littoral::waves::{SeaState, Superposition};

/// Hills that fall below zero to the south, where there is sea.
fn hills() -> Land {
    let fbm = Fbm::new(60.0, 25.0, 5, 4);
    let heights = (0..97 * 97).map(|i| {
        let (x, y) = (f64::from(i % 97), f64::from(i / 97));
        (fbm.at(DVec2::new(x, y)).value + 0.6 * (y - 40.0)) as f32
    });
    Land::new(Raster::new(97, 97, DVec2::splat(10.0), heights.collect()).expect("valid"))
}

fn view() -> View {
    View::looking_at(DVec3::new(-150.0, -520.0, 140.0), DVec3::new(0.0, 100.0, 10.0), 0.8, UVec2::new(200, 130))
}

fn mesh(lod: &mut dyn Lod, field: &dyn HeightField, tolerance: f32) -> Mesh {
    let mut drawing = Drawing::default();
    let view = View { tolerance_pixels: tolerance, ..view() };
    let reached = lod.select(field, &view, &mut drawing).expect("a view");
    assert!(!reached.limited, "{reached:?}");
    drawing.expand(field);
    drawing.mesh
}

/// Mean difference of two pictures as a share of the mean light of the first.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let light: f64 = a.radiance.iter().flatten().map(|v| f64::from(*v)).sum();
    let off: f64 =
        a.radiance.iter().flatten().zip(b.radiance.iter().flatten()).map(|(a, b)| f64::from((a - b).abs())).sum();
    off / light
}

#[test]
fn a_fine_mesh_looks_like_the_ground() {
    let land = hills();
    let water = Water::flood(&land, 0.0);
    let settings = Settings { samples: 4, seed: 0, passes: true };
    for border in [Border::Mist, Border::Cut] {
        let stage = Stage::new(&Scene { border, ..Scene::new(&land, water.as_ref()) });
        let exact = stage.render(&view(), &settings, &|_| {});
        let limits = Limits::default();
        for lod in [&mut Quadtree::new(limits) as &mut dyn Lod, &mut Patches::new(limits)] {
            let mut last = f64::INFINITY;
            for tolerance in [8.0, 1.0, 0.125] {
                let ground = mesh(lod, stage.land(), tolerance);
                let meshes = Meshes { ground: Some(&ground), ..Meshes::default() };
                let drawn = stage.render_meshes(&meshes, None, &view(), &settings, &|_| {});
                let off = difference(&exact, &drawn);
                assert!(off < last, "{border:?} {tolerance} px: {off} after {last}");
                last = off;
                // No hole: where the exact surface is seen and its neighbours, too, the mesh is seen.
                let (width, seen) = (200, |p: &Picture, i: usize| p.depth[i].is_finite());
                for i in width + 1..exact.depth.len() - width - 1 {
                    let around = [0, 1, 2, width, width + 1, width + 2, 2 * width, 2 * width + 1, 2 * width + 2];
                    let inside = around.iter().all(|k| seen(&exact, (i - width - 1 + k).min(exact.depth.len() - 1)));
                    // Outlines may move by the tolerance.
                    assert!(!inside || seen(&drawn, i) || tolerance > 0.5, "a hole at pixel {i}, {tolerance} px");
                }
            }
            assert!(last < 0.006, "{border:?}: {last}");
        }
    }
}

#[test]
fn a_fine_mesh_looks_like_the_sea() {
    let land = hills();
    let water = Water::flood(&land, 0.0).expect("sea in the south");
    let state = SeaState::of_wind(7.0, 1.2, 1e5).expect("a wind");
    let waves = Superposition::of_state(&state, 6, 5).expect("a sea");
    let datum = Datum::Plane { origin: land.origin(), size: land.extent() };
    let sea = Sea::new(datum, 0.0).with(Box::new(waves));
    let stage = Stage::new(&Scene { sea: Some(&sea), ..Scene::new(&land, Some(&water)) });
    let settings = Settings { samples: 4, seed: 0, passes: true };
    let exact = stage.render(&view(), &settings, &|_| {});
    let surface = mesh(&mut Quadtree::new(Limits::default()), &sea, 1.0);
    let coarse = mesh(&mut Quadtree::new(Limits::default()), &sea, 30.0);
    let draw = |mesh: &Mesh, wireframe| {
        let meshes = Meshes { water: Some(mesh), wireframe, ..Meshes::default() };
        stage.render_meshes(&meshes, Some(&sea), &view(), &settings, &|_| {})
    };
    let (fine, coarse, lines) = (draw(&surface, false), draw(&coarse, false), draw(&coarse, true));
    let (off, more) = (difference(&exact, &fine), difference(&exact, &coarse));
    assert!(off < 0.02, "{off}");
    assert!(off < more, "{off} by a fine mesh, {more} by a coarse one");
    assert!(difference(&coarse, &lines) > 0.01, "no wireframe");
    // Lines are drawn on water that is seen only: land in front hides them.
    let land_pixels = || (0..exact.depth.len()).filter(|&i| exact.height[i] > 6.0);
    assert!(land_pixels().count() > 500);
    assert!(land_pixels().all(|i| coarse.radiance[i] == lines.radiance[i]), "lines on the land");
}
