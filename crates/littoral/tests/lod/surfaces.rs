//! Random surfaces and views, made from a seed.

use glam::{DVec2, DVec3, UVec2};
use littoral::field::noise::{Fbm, NoiseField};
use littoral::field::{HeightField, Land, Raster, Sea};
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
