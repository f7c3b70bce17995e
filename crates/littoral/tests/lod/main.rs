//! The conformance suite of [`Lod`]: what the trait promises, asked of every method.
//!
//! A new method joins by one line in `METHODS`. `LITTORAL_CASES` says how many random cases each method gets (default 60),
//! `LITTORAL_FIRST` the first seed, `LITTORAL_METHOD` the only method to get any.

#![allow(missing_docs)]

mod check;
#[path = "../counting/mod.rs"]
mod counting;
mod memory;
mod roam;

use check::{Case, check};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::{Fbm, NoiseField};
use littoral::field::{HeightField, Land, Raster, Sea};
use littoral::lod::{Drawing, Limits, Lod, Nested, Patches, Quadtree, Roam, Seams, Strips, ViewError, Whole};
use littoral::space::{Datum, View};
use littoral::waves::{SeaState, Superposition};

/// A small deterministic generator: tests name their seed, failures repeat.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        let mut random = Random(seed ^ 0x9e37_79b9_7f4a_7c15);
        random.unit();
        random
    }

    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    pub fn below(&mut self, n: u32) -> u32 {
        ((self.unit() * f64::from(n)) as u32).min(n - 1)
    }
}

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

/// Ground, invented ground or sea, and the finest level worth drawing.
pub struct Surface {
    pub field: Box<dyn HeightField>,
    pub finest: u8,
    /// The raster, if the surface is one.
    pub samples: Option<(usize, usize)>,
    pub extent: DVec2,
    pub origin: DVec2,
}

pub fn random_land(columns: usize, rows: usize, random: &mut Random) -> Surface {
    surface_of(random_terrain(columns, rows, random))
}

pub fn random_terrain(columns: usize, rows: usize, random: &mut Random) -> Land {
    let kind = random.below(5);
    let void_share = [0.0, 0.0, 0.03, 0.4][random.below(4) as usize];
    let fbm = Fbm::new(9.0, 50.0, 4, random.below(1000));
    let spike = random.below((columns * rows) as u32) as usize;
    let heights = (0..columns * rows).map(|i| {
        let at = DVec2::new((i % columns) as f64 + 0.37, (i / columns) as f64);
        let height = match kind {
            0 => 12.5,
            1 => fbm.at(at).value,
            2 => random.unit() * 100.0 - 50.0,
            3 => f64::from(u8::from(i == spike)) * 500.0,
            _ => f64::from(random.below(2)) * 3000.0,
        };
        if random.unit() < void_share { f32::NAN } else { height as f32 }
    });
    let heights: Vec<f32> = heights.collect();
    let spacing = DVec2::new(0.5 + random.unit() * 10.0, 0.5 + random.unit() * 10.0);
    Land::new(Raster::new(columns, rows, spacing, heights).expect("sizes are valid"))
}

pub fn surface_of(land: Land) -> Surface {
    let (finest, extent, origin) = (land.finest_level(), land.extent(), land.origin());
    let samples = Some((land.raster().columns(), land.raster().rows()));
    Surface { field: Box::new(land), finest, samples, extent, origin }
}

pub fn random_surface(random: &mut Random) -> Surface {
    match random.below(6) {
        0 => {
            let state = SeaState::of_wind(3.0 + 12.0 * random.unit(), 1.0, 2e5).expect("a wind");
            let state = SeaState { seed: random.below(9) as u64, ..state };
            let waves = Superposition::of_state(&state, 6, 5).expect("a sea");
            let (origin, extent) = (DVec2::new(1e4, -3e4), DVec2::new(2000.0, 1500.0));
            let mut sea = Sea::new(Datum::Plane { origin, size: extent }, 3.0).with(Box::new(waves));
            sea.set_time(random.unit() * 1000.0);
            Surface { field: Box::new(sea), finest: 9, samples: None, extent, origin }
        }
        1 => {
            let fbm = Fbm::new(200.0 + 300.0 * random.unit(), 90.0, 7, random.below(100));
            let (origin, extent) = (DVec2::new(-500.0, 1e5), DVec2::new(1000.0, 2000.0));
            Surface {
                field: Box::new(NoiseField { fbm, origin, size: extent }),
                finest: 9,
                samples: None,
                extent,
                origin,
            }
        }
        2 => {
            let (columns, rows) = (2 + random.below(3) as usize, 2 + random.below(3) as usize);
            random_land(columns, rows, random)
        }
        _ => {
            let (columns, rows) = (2 + random.below(70) as usize, 2 + random.below(70) as usize);
            random_land(columns, rows, random)
        }
    }
}

/// A view of a surface: from above it, near it, at the horizon, below it, far outside.
pub fn random_view(surface: &Surface, random: &mut Random) -> View {
    let size = surface.extent.max_element();
    let mut point = || surface.origin + surface.extent * DVec2::new(random.unit(), random.unit());
    let (at, target) = (point(), point());
    let ground = |at: DVec2| {
        let place = surface.field.datum().place(at.extend(0.0)).0;
        f64::from(surface.field.height(place).unwrap_or(0.0))
    };
    let kind = random.below(7);
    let (eye, target) = match kind {
        0 => (at.extend(ground(at) + 2.0), target.extend(ground(target))),
        1 => (at.extend(ground(at) + size * random.unit()), target.extend(ground(target))),
        2 => (at.extend(ground(at) + 0.3 * size), at.extend(ground(at))),
        3 => (at.extend(ground(at) - 0.1 * size * random.unit()), target.extend(ground(target))),
        4 => (at.extend(ground(at)), target.extend(ground(at))),
        5 => {
            let away = DVec2::new(random.unit() - 0.5, random.unit() - 0.5) * 20.0 * size;
            ((at + away).extend(5.0 * size * random.unit()), target.extend(0.0))
        }
        _ => (at.extend(ground(at) + 0.1 * size), at.extend(ground(at)) + DVec3::new(0.3, 0.2, 9.0)),
    };
    let pixels = UVec2::new(16 + random.below(500), 16 + random.below(400));
    let mut view = View::looking_at(eye, target, 0.2 + 1.6 * random.unit() as f32, pixels);
    view.tolerance_pixels = [0.5, 1.0, 2.0, 10.0][random.below(4) as usize];
    view
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
