//! Models: closed when they are said to be, their surface the same with a waterline cut in, their normals those of the data.

use glam::{DVec2, DVec3, Vec3};
use littoral::field::Raster;
use littoral::mesh::{Form, Model, ModelError, Triangulation};
use proptest::prelude::*;
use std::collections::HashMap;

/// Two triangles over every patch whose corners are known.
fn whole(raster: &Raster) -> Triangulation {
    let mut mesh = Triangulation::default();
    for row in 0..raster.rows() as u32 {
        mesh.vertices.extend((0..raster.columns() as u32).map(|column| [column, row]));
    }
    let known = |column: usize, row: usize| raster.sample(column, row).is_some();
    for row in 0..raster.rows() - 1 {
        for column in 0..raster.columns() - 1 {
            if known(column, row) && known(column + 1, row) && known(column, row + 1) && known(column + 1, row + 1) {
                let [a, b] = [row, row + 1].map(|row| (row * raster.columns() + column) as u32);
                match (row + column) % 2 {
                    0 => mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]),
                    _ => mesh.triangles.extend([[a, a + 1, b], [a + 1, b + 1, b]]),
                }
            }
        }
    }
    // Vertices that no triangle uses are none of a mesh's.
    let mut number = vec![u32::MAX; mesh.vertices.len()];
    let mut used = Vec::new();
    for corner in mesh.triangles.as_flattened_mut() {
        if number[*corner as usize] == u32::MAX {
            number[*corner as usize] = used.len() as u32;
            used.push(mesh.vertices[*corner as usize]);
        }
        *corner = number[*corner as usize];
    }
    mesh.vertices = used;
    mesh
}

const LATTICE: Form = Form { shoreline: None, base: None, exaggeration: 1.0, place: &|at| at, turn: 0.0 };

/// Rasters of a few samples a side, some of them void, heights at and about 0 often.
fn rasters() -> impl Strategy<Value = Raster> {
    (2usize..9, 2usize..9, 0u32..4).prop_flat_map(|(columns, rows, voids)| {
        let height = prop_oneof![
            voids => Just(f32::NAN),
            4 => (-3i8..4).prop_map(f32::from),
            4 => -20f32..30.0,
        ];
        proptest::collection::vec(height, columns * rows)
            .prop_map(move |heights| Raster::new(columns, rows, DVec2::new(2.0, 3.0), heights).expect("a raster"))
    })
}

fn cases() -> ProptestConfig {
    let cases = std::env::var("LITTORAL_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(500);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// How often each directed edge occurs, vertices being told apart by `name`.
fn edges<T: std::hash::Hash + Eq + Copy>(triangles: &[[u32; 3]], name: impl Fn(u32) -> T) -> HashMap<(T, T), usize> {
    let mut count = HashMap::new();
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *count.entry((name(from), name(to))).or_default() += 1;
        }
    }
    count
}

fn assert_closed<T: std::hash::Hash + Eq + Copy>(triangles: &[[u32; 3]], name: impl Fn(u32) -> T) {
    let count = edges(triangles, name);
    for (&(from, to), &times) in &count {
        assert_eq!(times, 1, "an edge runs twice the same way");
        assert_eq!(count.get(&(to, from)), Some(&1), "an edge has one side only");
    }
}

/// Height of a model's ground at a place, by search; `None` beside it.
fn height_of(positions: &[DVec3], triangles: &[[u32; 3]], at: DVec2) -> Option<f64> {
    triangles.iter().find_map(|triangle| {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        let part = |p: DVec3, q: DVec3| (p.truncate() - at).perp_dot(q.truncate() - at) / area;
        let (u, v, w) = (part(b, c), part(c, a), part(a, b));
        (area > 0.0 && u.min(v).min(w) >= -1e-12).then(|| u * a.z + v * b.z + w * c.z)
    })
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn a_base_closes(raster in rasters(), shoreline in proptest::option::of(-3f64..4.0), factor in 0.1f64..9.0) {
        let mesh = whole(&raster);
        prop_assume!(!mesh.triangles.is_empty());
        let place = |at: DVec2| at * raster.spacing() + DVec2::new(-7.0, 4.0);
        let form = Form { shoreline, base: Some(-25.0), exaggeration: factor, place: &place, turn: 0.0 };
        let model = Model::new(&mesh, &raster, &form).expect("a model");
        assert_closed(&model.triangles, |vertex| vertex);
        prop_assert!(model.is_closed());
        // Programs that read triangles without indices know vertices by their places, in single precision.
        let name = |vertex: u32| model.positions[vertex as usize].as_vec3().to_array().map(f32::to_bits);
        if shoreline.is_none() {
            assert_closed(&model.triangles, name);
        }
        // The volume is that of the prisms below the triangles; parted pinches take a little of it.
        let prism = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|v| {
                let [column, row] = mesh.vertices[v as usize];
                let height = raster.sample(column as usize, row as usize).expect("known");
                (DVec2::new(f64::from(column), f64::from(row)) * raster.spacing()).extend(f64::from(height))
            });
            let area = 0.5 * (b - a).truncate().perp_dot((c - a).truncate());
            area * ((a.z + b.z + c.z) / 3.0 + 25.0) * factor
        };
        let volume: f64 = mesh.triangles.iter().map(prism).sum();
        prop_assert!(model.volume() > 0.0);
        prop_assert!((model.volume() - volume).abs() <= 0.02 * volume, "{} {volume}", model.volume());
        prop_assert_eq!(model.normals.len() + mesh_bottom(&model), model.positions.len());
        // No vertex below but for walls: each stands under one of the border.
        let walls = model.triangles[model.ground_triangles..].iter().filter(|t| t.iter().any(|&v| (v as usize) < model.normals.len()));
        prop_assert_eq!(walls.count(), 2 * mesh_bottom(&model));
    }

    #[test]
    fn a_waterline_changes_no_height(raster in rasters(), level in prop_oneof![Just(0.0), -3f64..4.0]) {
        let mesh = whole(&raster);
        prop_assume!(!mesh.triangles.is_empty());
        let plain = Model::new(&mesh, &raster, &LATTICE).expect("a model");
        let cut = Model::new(&mesh, &raster, &Form { shoreline: Some(level), ..LATTICE }).expect("a model");
        prop_assert_eq!(&plain.positions[..], &cut.positions[..plain.positions.len()]);
        let area = |model: &Model| -> f64 {
            let at = |v: u32| model.positions[v as usize].truncate();
            model.triangles.iter().map(|&[a, b, c]| (at(b) - at(a)).perp_dot(at(c) - at(a))).sum()
        };
        prop_assert!((area(&plain) - area(&cut)).abs() < 1e-9);
        for triangle in &cut.triangles {
            let corners = triangle.map(|vertex| cut.positions[vertex as usize]);
            let heights = corners.map(|at| at.z);
            prop_assert!(heights.iter().all(|z| *z >= level) || heights.iter().all(|z| *z <= level), "{heights:?} straddle {level}");
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let before = height_of(&plain.positions, &plain.triangles, middle.truncate()).expect("within");
            prop_assert!((middle.z - before).abs() < 1e-6, "{} {before}", middle.z);
        }
        // Each edge between ground above the level and ground that is not is of the line, and none else.
        let count = edges(&cut.triangles, |vertex| vertex);
        for (edge, times) in &count {
            prop_assert_eq!(*times, 1, "{:?}", edge);
        }
        let owner = |from: u32, to: u32| cut.triangles.iter().find(|t| {
            (0..3).any(|i| t[i] == from && t[(i + 1) % 3] == to)
        });
        let high = |t: &[u32; 3]| t.iter().any(|&v| cut.positions[v as usize].z > level);
        let mut expected: Vec<[u32; 2]> = count.keys().filter(|&&(from, to)| {
            matches!((owner(from, to), owner(to, from)), (Some(left), Some(right)) if high(left) && !high(right))
        }).map(|&(from, to)| [from, to]).collect();
        let mut line = cut.shoreline.clone();
        // Along each line edges follow each other: no other could go on where a line breaks off.
        for (place, pair) in line.windows(2).enumerate() {
            let later = line[place + 1..].iter().any(|edge| edge[0] == pair[0][1]);
            prop_assert!(pair[0][1] == pair[1][0] || !later, "{line:?}");
        }
        expected.sort_unstable();
        line.sort_unstable();
        prop_assert!(line.as_flattened().iter().all(|&v| cut.positions[v as usize].z == level));
        prop_assert_eq!(line, expected);
    }
}

/// Vertices of the bottom: all others are ground.
fn mesh_bottom(model: &Model) -> usize {
    let lowest = model.bounds().0.z;
    model.positions.iter().filter(|at| at.z == lowest).count()
}

#[test]
fn voids_that_touch_in_a_corner_leave_two_walls() {
    let mut heights = vec![1.0; 36];
    // The patches round sample 1, 1 are void but for the one south-east … of two voids that touch at sample (2, 2).
    heights[6 + 1] = f32::NAN;
    heights[3 * 6 + 3] = f32::NAN;
    let raster = Raster::new(6, 6, DVec2::ONE, heights).expect("a raster");
    let mesh = whole(&raster);
    let model =
        Model::new(&mesh, &raster, &Form { base: Some(0.0), shoreline: Some(0.5), ..LATTICE }).expect("a model");
    let parted: Vec<DVec3> =
        model.positions.iter().copied().filter(|at| at.z == 1.0 && at.truncate().fract() != DVec2::ZERO).collect();
    assert_eq!(parted.len(), 2, "{parted:?}");
    assert!(parted.iter().all(|at| (at.truncate() - DVec2::splat(2.0)).length() < 0.02));
    assert!(parted[0] != parted[1]);
    assert_closed(&model.triangles, |vertex| model.positions[vertex as usize].as_vec3().to_array().map(f32::to_bits));
    // 25 patches less two voids of four each, one high.
    assert!((model.volume() - 17.0).abs() < 0.1, "{}", model.volume());
}

#[test]
fn normals_are_those_of_the_data_however_few_the_triangles() {
    // A parabola along x, on samples 2 m apart: z = x²/10, of which two triangles know nothing.
    let (columns, spacing) = (9, DVec2::new(2.0, 5.0));
    let heights: Vec<f32> = (0..9 * 2).map(|i| (2.0 * (i % 9) as f32).powi(2) / 10.0).collect();
    let raster = Raster::new(columns, 2, spacing, heights).expect("a raster");
    let mesh = Triangulation { vertices: vec![[0, 0], [4, 0], [8, 0], [4, 1]], triangles: vec![[0, 1, 3], [1, 2, 3]] };
    let place = |at: DVec2| at * spacing;
    let form = Form { exaggeration: 3.0, place: &place, ..LATTICE };
    let model = Model::new(&mesh, &raster, &form).expect("a model");
    // The mean slope to both neighbours of x = 8 is that of the parabola, 8/5; stretched by 3.
    let expected = Vec3::new(-3.0 * 8.0 / 5.0, 0.0, 1.0).normalize();
    assert!((model.normals[1] - expected).length() < 1e-6, "{} {expected}", model.normals[1]);
    assert!((model.positions[1] - DVec3::new(8.0, 0.0, 3.0 * 6.4)).length() < 1e-5);
    let turned = Model::new(&mesh, &raster, &Form { turn: std::f64::consts::FRAC_PI_2, ..form }).expect("a model");
    assert!((turned.normals[1] - Vec3::new(0.0, expected.x, expected.z)).length() < 1e-6);
    // A vertex that a waterline adds between samples has the slope between theirs.
    let cut = Model::new(&mesh, &raster, &Form { shoreline: Some(3.2), ..form }).expect("a model");
    let on_line = cut.positions.iter().zip(&cut.normals).find(|(at, _)| (at.x - 4.0).abs() < 1e-5 && at.y == 0.0);
    let (_, normal) = on_line.expect("the chord from x = 0 to x = 8 is 3.2 high at x = 4");
    assert!((*normal - Vec3::new(-3.0 * 4.0 / 5.0, 0.0, 1.0).normalize()).length() < 1e-5);
}

#[test]
fn bases_above_ground_and_empty_meshes_are_refused() {
    let raster = Raster::new(2, 2, DVec2::ONE, vec![1.0, 2.0, 3.0, 4.0]).expect("a raster");
    let mesh = whole(&raster);
    for base in [1.0, 5.0, f64::NAN, f64::INFINITY] {
        let refused = Model::new(&mesh, &raster, &Form { base: Some(base), ..LATTICE });
        assert!(matches!(refused, Err(ModelError::Base { lowest: 1.0, .. })), "{base}");
    }
    let none = Model::new(&Triangulation::default(), &raster, &LATTICE);
    assert_eq!(none, Err(ModelError::Empty));
}
