//! The conformance suite of [`Lod`]: what the trait promises, asked of every method.
//!
//! A new method joins by one line in `METHODS`. `LITTORAL_CASES` says how many random cases each method gets (default 60),
//! `LITTORAL_FIRST` the first seed, `LITTORAL_METHOD` the only method to get any.

#![allow(missing_docs)]

mod check;
#[path = "../counting/mod.rs"]
mod counting;
mod grids;
mod memory;
mod roam;
mod roam_sea;
mod surfaces;

use check::{Case, check};
use glam::{DVec3, UVec2};
use littoral::lod::{Drawing, Limits, Lod, Nested, Patches, Quadtree, Roam, Seams, Strips, ViewError, Whole};
use littoral::space::View;
pub use surfaces::{Random, Surface, random_land, random_surface, random_terrain, random_view, surface_of};

/// A method under test.
pub struct Method {
    pub name: &'static str,
    pub make: fn(Limits) -> Box<dyn Lod>,
}

/// Every method there is.
pub const METHODS: &[Method] = &[
    Method { name: "whole", make: |limits| Box::new(Whole::new(limits)) },
    Method { name: "nested", make: |limits| nested(limits, Seams::Strips) },
    Method { name: "nested, morphing", make: |limits| nested(limits, Seams::Morphing) },
    Method { name: "quadtree", make: |limits| Box::new(Quadtree::new(limits)) },
    Method { name: "patches", make: |limits| Box::new(Patches::new(limits)) },
    Method { name: "strips", make: |limits| Box::new(Strips::new(limits)) },
    Method { name: "roam", make: |limits| Box::new(Roam::new(limits)) },
];

/// Nested grids of few cells.
fn nested(limits: Limits, seams: Seams) -> Box<dyn Lod> {
    let mut lod = Nested::new(limits);
    (lod.cells, lod.seams) = (8, seams);
    Box::new(lod)
}

/// The seeds of the random cases that each method gets.
pub fn cases() -> std::ops::Range<u64> {
    let number = |name| std::env::var(name).ok().and_then(|n| n.parse().ok());
    let first = number("LITTORAL_FIRST").unwrap_or(0);
    first..first + number("LITTORAL_CASES").unwrap_or(60)
}

#[test]
fn random_views_of_random_surfaces() {
    use rayon::prelude::*;
    let only = std::env::var("LITTORAL_METHOD").ok();
    for method in METHODS.iter().filter(|method| only.as_ref().is_none_or(|only| only == method.name)) {
        cases().into_par_iter().for_each(|seed| {
            let mut random = Random::new(seed);
            let surface = random_surface(&mut random);
            let finest = surface.finest + random.below(3) as u8;
            let limits = Limits { finest, triangles: [300, 4_000, 20_000][random.below(3) as usize] };
            let mut lod = (method.make)(limits);
            // The same object sees several views, so that what one leaves behind would show in the next.
            for turn in 0..2 {
                let view = random_view(&surface, &mut random);
                let label = format!("{} seed {seed} view {turn}", method.name);
                check(&mut *lod, &Case { surface: &surface, view: &view, limits, label: &label }, &mut random);
            }
        });
    }
}

#[test]
fn a_second_look_is_like_the_first() {
    let mut random = Random::new(77);
    for method in METHODS {
        for _ in 0..10 {
            let surface = random_surface(&mut random);
            let limits = Limits { finest: surface.finest + 1, triangles: 5_000 };
            let (view, other) = (random_view(&surface, &mut random), random_view(&surface, &mut random));
            let (mut lod, mut drawing) = ((method.make)(limits), Drawing::default());
            let mut look = |view: &View, lod: &mut dyn Lod| {
                let reached = lod.select(&*surface.field, view, &mut drawing).expect("a view");
                drawing.expand(&*surface.field);
                (check::sorted(&drawing), reached)
            };
            let first = look(&view, &mut *lod);
            assert!(look(&view, &mut *lod) == first, "{}: asked twice", method.name);
            let _ = look(&other, &mut *lod);
            assert!(look(&view, &mut *lod) == first, "{}: asked after another view", method.name);
            assert!(look(&view, &mut *(method.make)(limits)) == first, "{}: asked anew", method.name);
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
                let got = pool.install(|| {
                    let mut drawing = Drawing::default();
                    let reached = (method.make)(limits).select(&*surface.field, &view, &mut drawing).expect("a view");
                    drawing.expand(&*surface.field);
                    (check::sorted(&drawing), reached)
                });
                assert!(got == first, "{}: on {threads} threads", method.name);
            }
        }
    }
}

#[test]
fn views_that_cannot_be_drawn_are_refused() {
    let mut random = Random::new(5);
    let surface = random_land(20, 20, &mut random);
    let good = View::looking_at(DVec3::new(0.0, 0.0, 100.0), DVec3::ONE, 1.0, UVec2::new(64, 64));
    for method in METHODS {
        let mut lod = (method.make)(Limits::default());
        let mut drawing = Drawing::default();
        let mut ask = |view: View| lod.select(&*surface.field, &view, &mut drawing);
        assert!(ask(good).is_ok());
        let nan = DVec3::new(0.0, f64::NAN, 1.0);
        assert!(matches!(ask(View { eye: nan, ..good }), Err(ViewError::NotFinite(_))), "{}", method.name);
        assert!(matches!(
            ask(View { clip_from_eye: good.clip_from_eye * f32::NAN, ..good }),
            Err(ViewError::NotFinite(_))
        ));
        assert!(matches!(ask(View { size: UVec2::new(0, 64), ..good }), Err(ViewError::Empty(0, 64))));
        for tolerance in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(matches!(ask(View { tolerance_pixels: tolerance, ..good }), Err(ViewError::Tolerance(_))));
        }
        let flat = glam::Mat4::from_scale(glam::Vec3::splat(0.01));
        assert!(matches!(ask(View { clip_from_eye: flat, ..good }), Err(ViewError::Projection(_))));
        assert!(ask(good).is_ok(), "{}: an error spoils nothing", method.name);
    }
}
