//! The conformance suite of [`HeightField`]: what the trait promises, asked of every implementation.
//!
//! A new field joins by one line in `every_field_keeps_its_promises` or a property of its own.

use glam::DVec2;
use littoral::field::noise::{Fbm, NoiseField};
use littoral::field::{HeightField, HeightRange, Land, Raster, Sea, Window};
use littoral::space::{Cell, Datum, Place};
use littoral::waves::{SeaState, Superposition};
use proptest::prelude::*;

/// A small deterministic generator: tests name their seed, failures repeat.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn below(&mut self, n: u32) -> u32 {
        ((self.unit() * f64::from(n)) as u32).min(n - 1)
    }
}

/// Checks the promises of `field` on `cells` random cells, none finer than `finest`.
fn check(field: &dyn HeightField, finest: u8, cells: usize, random: &mut Random) {
    for _ in 0..cells {
        let level = random.below(u32::from(finest) + 1) as u8;
        let side = 1u32 << level;
        let cell = Cell { face: 0, level, x: random.below(side), y: random.below(side) };
        let (range, error) = (field.range(cell), field.error(cell));
        assert!(error >= 0.0, "{cell:?}: error {error}");
        if level < finest {
            for child in cell.children() {
                assert!(
                    field.error(child) <= error,
                    "{cell:?}: error {error} is below a child's {}",
                    field.error(child)
                );
            }
        }
        for depth in [0, 1, 3] {
            let mut finer = vec![cell];
            for _ in 0..depth {
                finer = finer.into_iter().flat_map(Cell::children).collect();
            }
            let most = finer.into_iter().map(|cell| field.error(cell)).fold(0.0, f32::max);
            assert_eq!(field.stencil_error(cell, depth), most, "{cell:?}: {depth} levels below");
        }
        let count = (side - cell.x).min(5) as usize;
        let (mut ranges, mut errors) = ([HeightRange::EMPTY; 5], [f32::NAN; 5]);
        field.row(cell, &mut ranges[..count], &mut errors[..count]);
        for i in 0..count {
            let cell = Cell { x: cell.x + i as u32, ..cell };
            assert_eq!((ranges[i], errors[i]), (field.range(cell), field.error(cell)), "{cell:?} in a row");
        }
        let columns = [1, 2, 3, 4, 5, 8, 16, 32][random.below(8) as usize].min((side - cell.x) as usize);
        let mut errors = vec![f32::NAN; columns * (side - cell.y).min(3) as usize];
        field.errors(cell, columns, &mut errors);
        for (i, error) in errors.into_iter().enumerate() {
            let cell = Cell { x: cell.x + (i % columns) as u32, y: cell.y + (i / columns) as u32, ..cell };
            assert_eq!(error, field.error(cell), "{cell:?} among rows of errors");
        }
        let at = |u: f64, v: f64| Place { face: 0, uv: cell.low_corner().uv + DVec2::new(u, v) * cell.side() };
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(u, v)| field.height(at(u, v)));
        let slack = corners.iter().flatten().fold(1.0f32, |m, h| m.max(h.abs())) * 8.0 * f32::EPSILON;
        for _ in 0..24 {
            // Random points, and points of a lattice that samples are likely to lie on.
            let steps = f64::from(1u32 << random.below(5));
            let snap = random.below(2) == 0;
            let mut coordinate = || {
                let t = random.unit();
                if snap { (t * (steps + 1.0)).floor().min(steps) / steps } else { t }
            };
            let (u, v) = (coordinate(), coordinate());
            let Some(height) = field.height(at(u, v)) else { continue };
            let slack = slack.max(height.abs() * 8.0 * f32::EPSILON);
            assert_eq!(field.height(at(u, v)), Some(height), "asked twice");
            let mut bulk = [f32::NAN];
            field.heights(&[at(u, v)], &mut bulk);
            assert_eq!(bulk, [height], "{cell:?} at ({u}, {v}): asked in bulk");
            // On its border a cell that is void, or partly so, may meet its neighbour's surface where it has none itself.
            let inside = u > 0.0 && u < 1.0 && v > 0.0 && v < 1.0;
            if !inside && (error.is_infinite() || range.is_empty()) {
                continue;
            }
            assert!(
                range.low <= height + slack && height - slack <= range.high,
                "{cell:?} at ({u}, {v}): {height} is outside {range:?}"
            );
            let [Some(a), Some(b), Some(c), Some(d)] = corners.map(|h| h.map(f64::from)) else {
                continue;
            };
            let rising = if u >= v { a + (b - a) * u + (d - b) * v } else { a + (d - c) * u + (c - a) * v };
            let falling =
                if u + v <= 1.0 { a + (b - a) * u + (c - a) * v } else { c + (b - d) * (1.0 - v) + (d - c) * u };
            for drawn in [rising, falling] {
                let off = (drawn - f64::from(height)).abs() as f32;
                assert!(off <= error + slack, "{cell:?} at ({u}, {v}): drawn {off} m off, bound {error}");
            }
        }
        let mut filled = [0.0; 25];
        field.fill(cell, 5, &mut filled);
        let places: Vec<Place> = (0..25).map(|i| at(f64::from(i % 5) / 4.0, f64::from(i / 5) / 4.0)).collect();
        let mut bulk = [0.0; 25];
        field.heights(&places, &mut bulk);
        // Points of the lattice: the corners alone, with what lies between, and again and again.
        let points: Vec<[u32; 2]> =
            places.iter().map(|p| (p.uv * f64::from(1u32 << 30)).as_uvec2().to_array()).collect();
        let on_lattice = |i: &usize| glam::UVec2::from(points[*i]).as_dvec2() == places[*i].uv * f64::from(1u32 << 30);
        for some in [vec![0, 4, 20, 24], (0..25).collect(), (0..200).map(|i| i * 7 % 25).collect::<Vec<usize>>()] {
            let some: Vec<usize> = some.into_iter().filter(on_lattice).collect();
            let mut vertices = Vec::new();
            field.raise(3, &some.iter().map(|&i| points[i]).collect::<Vec<_>>(), &mut vertices);
            assert_eq!(vertices.len(), some.len());
            for (&i, vertex) in some.iter().zip(&vertices) {
                let canonical = |h: f32| if h.is_nan() { f32::NAN.to_bits() } else { h.to_bits() };
                assert_eq!(([vertex.x, vertex.y], vertex.face), (points[i], 3));
                assert_eq!(canonical(vertex.height), canonical(bulk[i]), "{:?} of the lattice", points[i]);
            }
        }
        for (i, place) in places.iter().enumerate() {
            let single = field.height(*place).map_or(f32::NAN.to_bits(), f32::to_bits);
            let canonical = |h: f32| if h.is_nan() { f32::NAN.to_bits() } else { h.to_bits() };
            assert_eq!(canonical(bulk[i]), single, "bulk differs from single at {place:?}");
            let close = (filled[i].is_nan() && single == f32::NAN.to_bits()) || (filled[i] - bulk[i]).abs() <= slack;
            assert!(close, "{cell:?}: filled {} where {} was expected", filled[i], bulk[i]);
        }
    }
}

/// Random ground of a random kind: flat, smooth, rough or cliffs; with or without voids.
fn random_land(columns: usize, rows: usize, random: &mut Random) -> Land {
    let kind = random.below(4);
    let void_share = [0.0, 0.0, 0.03, 0.4][random.below(4) as usize];
    let fbm = Fbm::new(9.0, 50.0, 4, random.below(1000));
    let heights = (0..columns * rows).map(|i| {
        let at = DVec2::new((i % columns) as f64 + 0.37, (i / columns) as f64);
        let height = match kind {
            0 => 12.5,
            1 => fbm.at(at).value,
            2 => random.unit() * 100.0 - 50.0,
            _ => f64::from(random.below(2)) * 3000.0,
        };
        if random.unit() < void_share { f32::NAN } else { height as f32 }
    });
    let heights: Vec<f32> = heights.collect();
    let spacing = DVec2::new(0.5 + random.unit() * 10.0, 0.5 + random.unit() * 10.0);
    Land::new(Raster::new(columns, rows, spacing, heights).expect("sizes are valid"))
}

#[test]
fn the_sea_keeps_its_promises() {
    let mut random = Random(3);
    let state = SeaState::of_wind(11.0, 1.0, 2e5).expect("a wind");
    for (seed, level) in [(1, 0.0), (2, 3500.0)] {
        let waves = Superposition::of_state(&SeaState { seed, ..state.clone() }, 8, 6).expect("a sea");
        let datum = Datum::Plane { origin: DVec2::new(1e5, -3e4), size: DVec2::new(700.0, 500.0) };
        let mut sea = Sea::new(datum, level).with(Box::new(waves));
        for time in [0.0, 1234.5] {
            sea.set_time(time);
            check(&sea, 12, 250, &mut random);
        }
    }
}

#[test]
fn every_field_keeps_its_promises() {
    let mut random = Random(1);
    let fbm = Fbm::new(400.0, 120.0, 8, 5);
    check(
        &NoiseField { fbm, origin: DVec2::new(-500.0, 1e5), size: DVec2::new(1000.0, 2000.0) },
        14,
        1500,
        &mut random,
    );
    check(&random_land(300, 130, &mut random), 11, 1500, &mut random);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn land_of_any_size_keeps_its_promises(columns in 2usize..40, rows in 2usize..40, seed: u64) {
        let mut random = Random(seed);
        let land = random_land(columns, rows, &mut random);
        check(&land, land.finest_level() + 2, 40, &mut random);
    }

    #[test]
    fn edited_land_equals_new_land(columns in 2usize..150, rows in 2usize..150, seed: u64) {
        let mut random = Random(seed);
        let mut land = random_land(columns, rows, &mut random);
        let _ = land.error(Cell::face(0)); // the bounds exist before the edit
        let mut heights: Vec<f32> = (0..columns * rows).map(|i| land.raster().sample(i % columns, i / columns).unwrap_or(f32::NAN)).collect();
        for _ in 0..3 {
            let column = random.below(columns as u32) as usize;
            let row = random.below(rows as u32) as usize;
            let window = Window {
                column,
                row,
                columns: 1 + random.below((columns - column).min(20) as u32) as usize,
                rows: 1 + random.below((rows - row).min(20) as u32) as usize,
            };
            let patch: Vec<f32> = (0..window.columns * window.rows)
                .map(|_| if random.below(9) == 0 { f32::NAN } else { (random.unit() * 200.0) as f32 })
                .collect();
            land.edit(window, &patch);
            for (i, height) in patch.iter().enumerate() {
                heights[(row + i / window.columns) * columns + column + i % window.columns] = *height;
            }
        }
        let new = Land::new(Raster::new(columns, rows, land.raster().spacing(), heights).expect("same size"));
        prop_assert_eq!(land.raster().voids().count(), new.raster().voids().count());
        for level in 0..=land.finest_level() {
            for _ in 0..20 {
                let cell = Cell { face: 0, level, x: random.below(1 << level), y: random.below(1 << level) };
                prop_assert!(land.error(cell) >= new.error(cell));
                if land.finest_level() - level <= 6 {
                    prop_assert_eq!(land.error(cell), new.error(cell));
                }
            }
        }
        check(&land, land.finest_level(), 30, &mut random);
    }
}
