//! Meshes of whole rasters: each patch covered exactly once, and no sample farther away than was asked for.

mod counting;

use counting::allocations;
use glam::DVec2;
use littoral::field::{Raster, Window};
use littoral::mesh::measure::{Flaw, measure, verify, verify_delaunay};
use littoral::mesh::rtin::{Rtin, Scratch};
use littoral::mesh::tiled::{Method, Tiling};
use littoral::mesh::{MeshError, Triangulation, tin};
use proptest::prelude::*;

/// How many random cases a property is tried on.
fn cases(few: u32) -> ProptestConfig {
    let cases = std::env::var("LITTORAL_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(few);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// Uniform numbers in [0, 1) (xorshift).
fn random(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / 16_777_216.0
    }
}

/// Kinds of ground that break meshes in different ways.
#[derive(Clone, Copy, Debug)]
enum Ground {
    Flat,
    Slope,
    Hills,
    Noise,
    Whole,
    Spikes,
    Huge,
    Tiny,
}

/// Where there is none.
#[derive(Clone, Copy, Debug)]
enum Gaps {
    None,
    Few,
    Many,
    Block,
    Wedge,
    All,
}

fn heights(columns: usize, rows: usize, ground: Ground, gaps: Gaps, seed: u64) -> Vec<f32> {
    let mut random = random(seed);
    let [a, b, c] = [0; 3].map(|_| random());
    let (cx, cy) = ((random() * columns as f32) as usize, (random() * rows as f32) as usize);
    (0..columns * rows)
        .map(|i| {
            let (x, y) = (i % columns, i / columns);
            let gap = match gaps {
                Gaps::None => false,
                Gaps::Few => random() < 0.01,
                Gaps::Many => random() < 0.3,
                Gaps::Block => x.abs_diff(cx) < columns / 4 && y.abs_diff(cy) < rows / 4,
                Gaps::Wedge => (x as f32) * a + (y as f32) * (b - 0.5) > columns as f32 * 0.5 * c,
                Gaps::All => true,
            };
            if gap {
                return f32::NAN;
            }
            let (u, v) = (x as f32, y as f32);
            match ground {
                Ground::Flat => 100.1 * a,
                Ground::Slope => (u * (8.0 * b).floor() + v * (8.0 * c).floor()) * 0.25 + 1000.0,
                Ground::Hills => 300.0 + 40.0 * (u * (0.1 + 0.2 * a)).sin() * (v * (0.1 + 0.2 * b)).cos() + random(),
                Ground::Noise => 100.0 * random(),
                Ground::Whole => (30.0 * random()).floor(),
                Ground::Spikes => {
                    if random() < 0.02 {
                        5000.0
                    } else {
                        (u * 0.2).sin()
                    }
                }
                Ground::Huge => (random() - 0.5) * f32::MAX * 1.9,
                Ground::Tiny => random() * 1e-40,
            }
        })
        .collect()
}

fn raster(columns: usize, rows: usize, ground: Ground, gaps: Gaps, seed: u64) -> Raster {
    Raster::new(columns, rows, DVec2::ONE, heights(columns, rows, ground, gaps, seed)).expect("a raster")
}

/// What a raster is made of: short to print when a case fails.
#[derive(Clone, Copy, Debug)]
struct Recipe {
    columns: usize,
    rows: usize,
    ground: Ground,
    gaps: Gaps,
    seed: u64,
}

impl Recipe {
    fn make(self) -> Raster {
        raster(self.columns, self.rows, self.ground, self.gaps, self.seed)
    }
}

prop_compose! {
    fn recipes()(
        columns in 2usize..71, rows in 2usize..71, seed: u64,
        ground in prop_oneof![
            Just(Ground::Flat), Just(Ground::Slope), Just(Ground::Hills), Just(Ground::Noise),
            Just(Ground::Whole), Just(Ground::Spikes), Just(Ground::Huge), Just(Ground::Tiny),
        ],
        gaps in prop_oneof![
            4 => Just(Gaps::None), 1 => Just(Gaps::Few), 1 => Just(Gaps::Many), 1 => Just(Gaps::Block),
            1 => Just(Gaps::Wedge), 1 => Just(Gaps::All),
        ],
    ) -> Recipe {
        Recipe { columns, rows, ground, gaps, seed }
    }
}

/// Errors to ask for, as shares of the range of heights, or as they are.
fn errors() -> impl Strategy<Value = (bool, f32)> {
    prop_oneof![
        Just((false, 0.0)),
        Just((false, 1e-6)),
        Just((false, f32::INFINITY)),
        Just((false, 1e-41)),
        (0f32..0.6).prop_map(|share| (true, share)),
        (0f32..50.0).prop_map(|error| (false, error)),
    ]
}

fn asked(raster: &Raster, (share, error): (bool, f32)) -> f32 {
    let range = raster.range();
    if share && !range.is_empty() { (error * range.high - error * range.low).min(f32::MAX) } else { error }
}

/// Everything that is promised of every mesh.
fn check(raster: &Raster, mesh: &Triangulation, max_error: f32) {
    assert_eq!(verify(raster, mesh), Ok(()));
    let measured = measure(raster, mesh);
    assert_eq!((measured.missed, measured.void_covered), (0, 0));
    let brute = brute_force(raster, mesh);
    assert!(measured.max_error <= f64::from(max_error), "asked {max_error}, got {measured:?}");
    let range = raster.range();
    let rounding = if range.is_empty() { 0.0 } else { 1e-12 * f64::from(range.high.abs().max(range.low.abs())) };
    assert!((brute - measured.max_error).abs() <= 1e-9 * brute + rounding, "{brute} is not {measured:?}");
    let mut used = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
    assert!(used.iter().all(|used| *used), "a vertex without a triangle");
}

/// The greatest error at a sample: every sample in the box around every triangle, by its definition.
fn brute_force(raster: &Raster, mesh: &Triangulation) -> f64 {
    let mut worst = 0f64;
    for triangle in &mesh.triangles {
        let corners = mesh.corners(*triangle).map(|at| at.map(i64::from));
        let [a, b, c] = corners;
        let cross =
            |a: [i64; 2], b: [i64; 2], c: [i64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let height = |at: [i64; 2]| f64::from(raster.heights()[at[1] as usize * raster.columns() + at[0] as usize]);
        let bounds = |axis: usize| {
            let along = corners.map(|at| at[axis]);
            along.into_iter().min().expect("three")..=along.into_iter().max().expect("three")
        };
        for y in bounds(1) {
            for x in bounds(0) {
                let p = [x, y];
                let weights = [cross(b, c, p), cross(c, a, p), cross(a, b, p)];
                if weights.iter().all(|weight| *weight >= 0) {
                    let area = cross(a, b, c) as f64;
                    let plane = weights.iter().zip(corners).map(|(w, at)| *w as f64 / area * height(at)).sum::<f64>();
                    worst = worst.max((plane - height(p)).abs());
                }
            }
        }
    }
    worst
}

proptest! {
    #![proptest_config(cases(400))]

    #[test]
    fn rtin_covers_once_and_keeps_its_error(recipe in recipes(), error in errors(), other in errors()) {
        let raster = recipe.make();
        let rtin = Rtin::new(&raster);
        let mut mesh = Triangulation::default();
        for error in [error, other] {
            let error = asked(&raster, error);
            rtin.extract(&raster, error, &mut mesh).expect("a mesh");
            check(&raster, &mesh, error);
        }
    }
}

proptest! {
    #![proptest_config(cases(400))]

    #[test]
    fn tin_covers_once_keeps_its_error_and_is_delaunay(recipe in recipes(), error in errors()) {
        let raster = recipe.make();
        let error = asked(&raster, error);
        let mesh = tin::triangulate(&raster, error, &|_| true).expect("a mesh");
        check(&raster, &mesh, error);
        assert_eq!(verify_delaunay(&raster, &mesh), Ok(()));
    }
}

/// One mesh of the meshes of tiles: vertices at the same sample become one.
fn union(tiles: &[(Window, Triangulation)]) -> Triangulation {
    let mut names = std::collections::HashMap::new();
    let mut union = Triangulation::default();
    for (window, tile) in tiles {
        for triangle in &tile.triangles {
            union.triangles.push(tile.corners(*triangle).map(|at| {
                let at = [at[0] + window.column as u32, at[1] + window.row as u32];
                *names.entry(at).or_insert_with(|| {
                    union.vertices.push(at);
                    union.vertices.len() as u32 - 1
                })
            }));
        }
    }
    union
}

/// What is in a window of a raster.
fn part(raster: &Raster, window: Window) -> Raster {
    let rows = window.row..window.row + window.rows;
    let sample = |(row, column)| raster.sample(column, row).unwrap_or(f32::NAN);
    let heights = rows.flat_map(|row| (window.column..window.column + window.columns).map(move |column| (row, column)));
    Raster::new(window.columns, window.rows, raster.spacing(), heights.map(sample).collect()).expect("a window")
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn tiles_together_are_one_mesh(recipe in recipes(), error in errors(), shift in 1u32..6, rtin: bool) {
        let raster = recipe.make();
        let error = asked(&raster, error);
        let method = if rtin { Method::Rtin } else { Method::Tin };
        let tiling = Tiling { size: [raster.columns(), raster.rows()], side: 1 << shift };
        let mut tiles = Vec::new();
        let mut read = |window| Ok::<_, MeshError>(part(&raster, window));
        let mut write = |window: Window, part: &Raster, mesh: &Triangulation| {
            assert_eq!(verify(part, mesh), Ok(()));
            tiles.push((window, mesh.clone()));
            Ok(())
        };
        tiling.mesh(method, error, &mut read, &mut write).expect("tiles");
        check(&raster, &union(&tiles), error);
    }
}

/// Sizes at which blocks, seams between strips and the search of large triangles all take part.
#[test]
fn large_rasters_keep_their_error_too() {
    let sizes = [(257, 257), (300, 131), (193, 400), (513, 67), (140, 2), (3, 500)];
    let grounds = [Ground::Hills, Ground::Whole, Ground::Spikes, Ground::Slope, Ground::Flat];
    let gaps = [Gaps::None, Gaps::Few, Gaps::None, Gaps::Block, Gaps::Wedge];
    for (seed, (columns, rows)) in sizes.into_iter().enumerate() {
        for (ground, gaps) in grounds.into_iter().zip(gaps) {
            let raster = raster(columns, rows, ground, gaps, seed as u64);
            let rtin = Rtin::new(&raster);
            for error in [0.0, 0.7, 12.0, 60.0] {
                let mut mesh = Triangulation::default();
                rtin.extract(&raster, error, &mut mesh).expect("a mesh");
                check(&raster, &mesh, error);
                let mesh = tin::triangulate(&raster, error, &|_| true).expect("a mesh");
                check(&raster, &mesh, error);
                assert_eq!(verify_delaunay(&raster, &mesh), Ok(()));
            }
        }
    }
}

#[test]
fn planes_need_two_triangles() {
    for ground in [Ground::Flat, Ground::Slope] {
        for (columns, rows) in [(2, 2), (65, 65), (300, 300), (41, 17)] {
            let raster = raster(columns, rows, ground, Gaps::None, 3);
            let mesh = tin::triangulate(&raster, 0.0, &|_| true).expect("a mesh");
            assert_eq!(mesh.triangles.len(), 2, "{ground:?}, {columns} × {rows}");
            let mut mesh = Triangulation::default();
            Rtin::new(&raster).extract(&raster, 0.0, &mut mesh).expect("a mesh");
            // Cut at the border, the halves of the virtual square may be four corners each.
            assert!(mesh.triangles.len() <= 4, "{ground:?}, {columns} × {rows}: {}", mesh.triangles.len());
        }
    }
}

#[test]
fn warm_extraction_allocates_nothing() {
    for (columns, gaps) in [(129, Gaps::None), (100, Gaps::None), (100, Gaps::Block)] {
        let raster = raster(columns, 129, Ground::Hills, gaps, 5);
        let rtin = Rtin::new(&raster);
        let (mut mesh, mut scratch) = (Triangulation::default(), Scratch::default());
        let mut extract = || {
            for error in [5.0, 1.0, 20.0] {
                rtin.extract_with(&raster, error, &mut scratch, &mut mesh).expect("a mesh");
            }
        };
        extract();
        let before = allocations();
        extract();
        assert_eq!(allocations(), before);
    }
}

#[test]
fn progress_rises_and_stops_the_work() {
    let raster = raster(200, 200, Ground::Noise, Gaps::None, 5);
    let last = std::sync::Mutex::new(0.0);
    tin::triangulate(&raster, 5.0, &|done| {
        let before = std::mem::replace(&mut *last.lock().expect("one thread"), done);
        assert!((before..=1.0).contains(&done), "{before}, then {done}");
        true
    })
    .expect("a mesh");
    assert!(*last.lock().expect("one thread") == 1.0);
    assert_eq!(tin::triangulate(&raster, 5.0, &|_| false), Err(MeshError::Stopped));
}

#[test]
fn tiles_that_make_no_sense_are_refused() {
    let raster = raster(9, 9, Ground::Hills, Gaps::None, 1);
    let mesh = |size, side, error, read: Raster| {
        Tiling { size, side }
            .mesh(Method::Tin, error, &mut |_| Ok(read.clone()), &mut |_, _, _| Ok(()))
            .map_err(|error: MeshError| error)
    };
    assert_eq!(mesh([9, 9], 3, 1.0, raster.clone()), Err(MeshError::Tiles { size: [9, 9], side: 3 }));
    assert_eq!(mesh([9, 1], 8, 1.0, raster.clone()), Err(MeshError::Tiles { size: [9, 1], side: 8 }));
    assert!(matches!(mesh([9, 9], 8, f32::NAN, raster.clone()), Err(MeshError::Tolerance(_))));
    let other = MeshError::OtherRaster { expected: [10, 9], got: [9, 9] };
    assert_eq!(mesh([17, 9], 8, 1.0, raster), Err(other));
}

#[test]
fn errors_that_are_no_distance_are_refused() {
    let raster = raster(5, 4, Ground::Hills, Gaps::None, 1);
    let rtin = Rtin::new(&raster);
    for error in [-1.0, f32::NAN, f32::NEG_INFINITY] {
        let told = rtin.extract(&raster, error, &mut Triangulation::default()).expect_err("no distance").to_string();
        assert!(told.contains("expected a greatest error of 0 or more"), "{told}");
    }
    let other = self::raster(4, 5, Ground::Hills, Gaps::None, 1);
    let told = rtin.extract(&other, 1.0, &mut Triangulation::default());
    assert_eq!(told, Err(MeshError::OtherRaster { expected: [5, 4], got: [4, 5] }));
}

#[test]
fn what_is_no_mesh_of_a_raster_is_told() {
    let raster = raster(3, 3, Ground::Flat, Gaps::None, 1);
    let of = |vertices: &[[u32; 2]], triangles: &[[u32; 3]]| {
        verify(&raster, &Triangulation { vertices: vertices.to_vec(), triangles: triangles.to_vec() })
    };
    let corners = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 1], [1, 1], [3, 0], [1, 0]];
    assert_eq!(of(&corners[..4], &[[0, 1, 2], [0, 2, 3]]), Ok(()));
    assert_eq!(of(&corners[..4], &[[0, 1, 2]]), Err(Flaw::Open([[2, 2], [0, 0]])));
    assert_eq!(of(&corners[..4], &[]), Err(Flaw::Missing([0, 0], [1, 0])));
    assert_eq!(of(&corners[..4], &[[0, 2, 1], [0, 2, 3]]), Err(Flaw::Turned([[0, 0], [2, 2], [2, 0]])));
    assert_eq!(of(&corners[..4], &[[0, 1, 2], [0, 2, 3], [0, 1, 3]]), Err(Flaw::Overlap([[0, 0], [2, 0]])));
    assert_eq!(of(&corners[..4], &[[0, 1, 9]]), Err(Flaw::Nowhere([0, 1, 9])));
    assert_eq!(of(&corners[..7], &[[0, 1, 6]]), Err(Flaw::Nowhere([0, 1, 6])));
    assert_eq!(of(&corners[..6], &[[0, 1, 2], [0, 2, 3]]), Err(Flaw::Twice([1, 1])));
    // The middle of the diagonal is a vertex on one side only.
    assert_eq!(of(&corners[..5], &[[0, 1, 4], [1, 2, 4], [0, 2, 3]]), Err(Flaw::Open([[0, 0], [2, 2]])));
    let holed = Raster::new(3, 3, DVec2::ONE, [1.0; 8].into_iter().chain([f32::NAN]).collect()).expect("a raster");
    let whole = Triangulation { vertices: corners[..4].to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] };
    assert!(matches!(verify(&holed, &whole), Err(Flaw::Open(_))));
    let measured = measure(&holed, &whole);
    assert_eq!((measured.covered, measured.missed, measured.void_covered), (9, 0, 1));
}
