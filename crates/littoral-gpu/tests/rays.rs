//! Rays on the GPU against the processor's. Where there is no adapter these tests say so and pass; that the shaders are sound is tested without one.

use glam::{DVec2, DVec3, UVec2, Vec3};
use littoral::field::{HeightRange, Land, Raster, coast};
use littoral::picture::{Scene, Stage};
use littoral::raycast::LocalRay;
use littoral::space::{Ray, View};
use littoral_gpu::{Gpu, Painter, ShapeError, ShapeTexture};

fn gpu() -> Option<Gpu> {
    match Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            println!("not tested: {error}");
            None
        }
    }
}

/// Numbers in [0, 1) that are the same on every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Rough land: so many samples, so far apart (m), heights up to `relief` (m), so many voids in a hundred.
fn rough(random: &mut Random, [columns, rows]: [usize; 2], spacing: DVec2, relief: f64, voids: f64) -> Land {
    let spikes = random.next() < 0.3;
    let heights = (0..columns * rows)
        .map(|_| {
            let height = if spikes && random.next() < 0.9 { 0.0 } else { random.between(-0.3, 0.7) * relief };
            if 100.0 * random.next() < voids { f32::NAN } else { height as f32 }
        })
        .collect();
    Land::at(Raster::new(columns, rows, spacing, heights).expect("valid"), DVec2::new(-13.0, 7.5))
}

/// How far the GPU may be from the truth about a ray (m): see `littoral_gpu::rays`.
fn hair(land: &Land, anchor: DVec3, ray: &Ray, distance: f64) -> f64 {
    let range = land.height_range();
    let end = if distance.is_finite() { ray.at(distance) } else { ray.origin };
    let worked_with = (ray.origin - anchor).length() + (end - anchor).length();
    let height = f64::from(range.high - range.low) + anchor.z.abs();
    5e-4 + 3e-6 * worked_with + 3e-7 * height
}

/// Fails unless the GPU's answer lies among those that the processor gives of the ray and of rays a hair beside it, above or below.
fn check(land: &Land, anchor: DVec3, ray: &Ray, got: f32) -> f64 {
    let exact = land.first_hit(ray).map_or(f64::INFINITY, |hit| hit.distance);
    let got = f64::from(got);
    if got == exact {
        return 0.0;
    }
    let hair = hair(land, anchor, ray, got.min(exact));
    let hair_along = 2.0 * hair / ray.direction.length();
    if (got - exact).abs() <= hair_along {
        return (got - exact).abs() * ray.direction.length();
    }
    let (mut first, mut last) = (exact, exact);
    // Beside steep walls and rims a little less is another thing.
    let offsets = [0.0, 1.0, 0.1, 1e-2, 1e-3, 1e-4].map(|part| part * hair);
    let offsets: Vec<f64> = offsets.into_iter().flat_map(|by| [by, -by]).skip(1).collect();
    for (&x, &y) in offsets.iter().flat_map(|x| offsets.iter().map(move |y| (x, y))) {
        for &z in &offsets {
            let beside = Ray { origin: ray.origin + DVec3::new(x, y, z), ..*ray };
            let hit = land.first_hit(&beside).map_or(f64::INFINITY, |hit| hit.distance);
            (first, last) = (first.min(hit), last.max(hit));
        }
    }
    let within = got >= first - hair_along && got <= last + hair_along;
    // A ray that just touches the surface, or the rim of a hole, may be told to touch it there.
    let at = ray.at(got);
    let offsets = (0..9).map(|k| DVec2::new(f64::from(k % 3 - 1), f64::from(k / 3 - 1)) * (0.5 * hair));
    let off =
        offsets.filter_map(|by| land.height_at(at.truncate() + by)).map(|height| (f64::from(height) - at.z).abs());
    let off = off.fold(f64::INFINITY, f64::min);
    let steep = f64::from(land.height_range().high - land.height_range().low) / land.raster().spacing().min_element();
    let touches = got < first && off <= hair * (1.0 + steep);
    assert!(
        within || touches,
        "{got} is not within {first}..{last} (exactly {exact}, {hair} m) of {ray:?} from {anchor}"
    );
    0.0
}

/// A ray of some kind against a land, counted from an anchor.
fn ray(random: &mut Random, land: &Land, kind: u32) -> Ray {
    let (origin, extent, spacing) = (land.origin(), land.extent(), land.raster().spacing());
    let HeightRange { low, high } = land.height_range();
    let (low, high) = if low > high { (0.0, 1.0) } else { (f64::from(low), f64::from(high)) };
    let about = |random: &mut Random| {
        let xy = origin + extent * DVec2::new(random.between(-0.3, 1.3), random.between(-0.3, 1.3));
        xy.extend(random.between(low - 0.3 * (high - low) - 1.0, high + 0.6 * (high - low) + 5.0))
    };
    let sample = |random: &mut Random| {
        let (column, row) = (
            (random.next() * land.raster().columns() as f64) as usize,
            (random.next() * land.raster().rows() as f64) as usize,
        );
        let height = f64::from(land.raster().heights()[row * land.raster().columns() + column]);
        (origin + DVec2::new(column as f64, row as f64) * spacing).extend(height)
    };
    match kind {
        0 => {
            let from = about(random);
            Ray::new(from, about(random) - from)
        }
        1 => Ray::between(about(random), about(random)),
        // At a sample, and at a point on the line between two.
        2 => {
            let from = about(random);
            Ray::new(from, sample(random) - from)
        }
        3 => {
            let (from, to) = (about(random), sample(random));
            let to = DVec3::new(to.x, to.y + random.next() * spacing.y, to.z);
            Ray::new(from, to - from)
        }
        // Up and down, beside samples and on them.
        4 => Ray::new(about(random), DVec3::new(0.0, 0.0, if random.next() < 0.7 { -2.0 } else { 0.5 })),
        5 => Ray::new(sample(random) + DVec3::Z * random.between(-30.0, 70.0), -DVec3::Z),
        // Along lines between samples, and along diagonals.
        6 => {
            let along = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y][(4.0 * random.next()) as usize];
            Ray::new(
                sample(random) + DVec3::Z * random.between(-3.0, 7.0),
                along + DVec3::Z * random.between(-0.6, 0.4),
            )
        }
        7 => {
            let way = DVec3::new(spacing.x, -spacing.y, random.between(-4.0, 0.0));
            Ray::new(sample(random) + DVec3::Z * 10.0, way)
        }
        // Grazing: nearly level just over the summits.
        8 => {
            let from = about(random);
            let from = DVec3::new(from.x, from.y, high - random.between(0.0, 0.2) * (high - low));
            let to = about(random);
            Ray::new(from, DVec3::new(to.x, to.y, from.z + random.between(-0.02, 0.02) * (high - low)) - from)
        }
        // From below, and from outside.
        9 => {
            let from = about(random);
            Ray::new(DVec3::new(from.x, from.y, low - 20.0), about(random) - from + DVec3::Z * 20.0)
        }
        _ => {
            let to = about(random);
            let from =
                to + DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.4) * 5.0 * extent.max_element();
            Ray::new(from, to - from)
        }
    }
}

const KINDS: u32 = 11;

/// What an `f32` ray from an anchor is in `f64`.
fn exactly(anchor: DVec3, ray: &LocalRay) -> Ray {
    Ray { origin: anchor + ray.origin.as_dvec3(), direction: ray.direction.as_dvec3(), reach: f64::from(ray.reach) }
}

fn local(anchor: DVec3, ray: &Ray) -> LocalRay {
    LocalRay { reach: ray.reach as f32, ..LocalRay::new((ray.origin - anchor).as_vec3(), ray.direction.as_vec3()) }
}

/// Checks so many rays of all kinds; the number of hits, and the mean distance from the processor's (m).
fn compare(gpu: &Gpu, land: &Land, random: &mut Random, count: u32) -> (usize, f64) {
    let shape = ShapeTexture::new(gpu, land).expect("a small land");
    let middle = (land.origin() + 0.5 * land.extent()).extend(f64::from(land.height_range().high.clamp(-1e4, 1e4)));
    let (mut hits, mut sum) = (0, 0.0);
    for anchor in [DVec3::new(-10.0, 10.0, 3.0), middle] {
        let rays: Vec<LocalRay> = (0..count / 2).map(|i| local(anchor, &ray(random, land, i % KINDS))).collect();
        let got = shape.first_hits(gpu, anchor, &rays).expect("a device");
        for (ray, got) in rays.iter().zip(got) {
            sum += check(land, anchor, &exactly(anchor, ray), got);
            hits += usize::from(got.is_finite());
        }
    }
    (hits, sum / hits.max(1) as f64)
}

#[test]
fn rays_meet_what_the_processors_do() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(7);
    let sizes = [[2, 2], [3, 2], [2, 9], [5, 5], [17, 33], [2, 300], [257, 3], [31, 64], [100, 75], [65, 65]];
    let spacings = [DVec2::ONE, DVec2::new(2.0, 0.7), DVec2::new(9.0, 30.0)];
    let (mut hits, mut all) = (0, 0);
    for (i, size) in sizes.into_iter().enumerate() {
        for (spacing, voids) in spacings.into_iter().flat_map(|spacing| [(spacing, 0.0), (spacing, 12.0)]) {
            let relief = [100.0, 3.0, 2000.0][(i + voids as usize) % 3] * spacing.max_element().min(5.0);
            let land = rough(&mut random, size, spacing, relief, voids);
            hits += compare(&gpu, &land, &mut random, 440).0;
            all += 440;
        }
    }
    println!("{hits} of {all} rays hit rough lands");
    assert!(all >= 20_000 && hits > all / 4);
    let coast = coast::coast();
    let (hits, off) = compare(&gpu, &coast, &mut random, 11_000);
    println!("{hits} of 11 000 rays hit the coast, {:.2} mm off in the mean", 1e3 * off);
    assert!(hits > 2000);
}

#[test]
fn the_pyramid_is_the_processors() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(11);
    for (size, voids) in
        [([2, 2], 0.0), ([2, 77], 0.0), ([64, 65], 9.0), ([131, 18], 40.0), ([257, 257], 0.0), ([9, 9], 100.0)]
    {
        let land = rough(&mut random, size, DVec2::new(3.0, 4.0), 700.0, voids);
        let shape = ShapeTexture::new(&gpu, &land).expect("a small land");
        let got = shape.ranges(&gpu).expect("a device");
        let mut at = 0;
        for (n, [columns, rows]) in shape.sizes().enumerate() {
            let level = n as u32 + 1;
            assert_eq!(land.ranges().size(level), (columns as usize, rows as usize));
            for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
                // Of every patch below the node, exactly.
                let patches = |node: u32, samples: usize| {
                    (node as usize) << level..(((node as usize) + 1) << level).min(samples - 1)
                };
                let mut expected = HeightRange::EMPTY;
                for (i, j) in patches(row, size[1]).flat_map(|j| patches(column, size[0]).map(move |i| (i, j))) {
                    for height in land.corners(i, j).into_iter().flatten() {
                        expected = expected.union(HeightRange { low: height, high: height });
                    }
                }
                let node = got[at];
                at += 1;
                // The processor's is the same rounded outward, to the step of its 16 bits.
                let rounded = land.ranges().node(level, column as usize, row as usize);
                assert_eq!(node.is_empty(), expected.is_empty(), "{size:?}, level {level}, node {column}, {row}");
                assert_eq!(node.is_empty(), rounded.is_empty());
                if !expected.is_empty() {
                    assert_eq!(node.low.to_bits(), expected.low.to_bits());
                    assert_eq!(node.high.to_bits(), expected.high.to_bits());
                    assert!(rounded.low <= node.low && rounded.high >= node.high);
                    assert!(rounded.high - node.high < 0.05 && node.low - rounded.low < 0.05);
                }
            }
        }
        assert_eq!(at, got.len());
    }
}

#[test]
fn far_from_the_origin_nothing_is_lost() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(3);
    let near = rough(&mut random, [80, 90], DVec2::new(2.0, 1.5), 9.0, 4.0);
    // Whole multiples of the spacing, so that both lands have the same samples.
    let away = DVec3::new(4_600_000.0, -3_300_000.0, 0.0);
    let far = Land::at(near.raster().clone(), near.origin() + away.truncate());
    let shapes = [&near, &far].map(|land| ShapeTexture::new(&gpu, land).expect("a small land"));
    let anchor = DVec3::new(33.25, 61.5, 14.0);
    let rays: Vec<LocalRay> = (0..4000).map(|i| local(anchor, &ray(&mut random, &near, i % KINDS))).collect();
    let hits = [(&shapes[0], anchor), (&shapes[1], anchor + away)];
    let [a, b] = hits.map(|(shape, anchor)| shape.first_hits(&gpu, anchor, &rays).expect("a device"));
    assert!(a.iter().filter(|hit| hit.is_finite()).count() > 1000);
    assert_eq!(a, b);
}

#[test]
fn nothing_slips_through_between_patches() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(5);
    let mut all = 0;
    for spacing in [DVec2::ONE, DVec2::new(0.7, 3.1)] {
        // Rays are steeper than the ground: one that slipped through would not come up again.
        let land = rough(&mut random, [65, 41], spacing, 1.5, 0.0);
        let shape = ShapeTexture::new(&gpu, &land).expect("a small land");
        let HeightRange { low, high } = land.height_range();
        let anchor = land.origin().extend(0.0) + DVec3::new(7.3, 11.9, f64::from(high));
        let inner = |random: &mut Random, n: usize| 4.0 + (random.next() * (n - 8) as f64).floor();
        // Down to a sample, or to a point on the line between two, far below the surface: on the way there it must be met.
        let rays: Vec<LocalRay> = (0..30_000)
            .map(|i| {
                let mut to = DVec2::new(inner(&mut random, 65), inner(&mut random, 41));
                match i % 3 {
                    0 => to.x += random.next(),
                    1 => to.y += random.next(),
                    _ => {}
                }
                let to = (land.origin() + to * spacing).extend(f64::from(low) - 5.0);
                let beside = DVec2::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0)) * spacing;
                // Straight down, along the lines, and across them.
                let beside = [DVec2::ZERO, beside * DVec2::X, beside * DVec2::Y, beside][i / 3 % 4];
                // From far enough away for rounding to matter.
                let from = to + 30_000.0 * beside.extend(6.0 * spacing.max_element());
                local(anchor, &Ray::between(from, to))
            })
            .collect();
        let hits = shape.first_hits(&gpu, anchor, &rays).expect("a device");
        let missed = hits.iter().position(|hit| !hit.is_finite());
        assert!(missed.is_none(), "{:?} slips through", missed.map(|i| rays[i]));
        all += hits.len();
    }
    println!("{all} rays at lines and corners, all met");
}

#[test]
fn a_cone_stops_at_nodes_as_wide_as_it() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(9);
    let land = coast::coast();
    let shape = ShapeTexture::new(&gpu, &land).expect("a small land");
    let spacing = land.raster().spacing();
    let (columns, rows) = (land.raster().columns() as i64, land.raster().rows() as i64);
    let anchor = (land.origin() + 0.5 * land.extent()).extend(300.0);
    let exact: Vec<LocalRay> = (0..6000).map(|_| local(anchor, &ray(&mut random, &land, 0))).collect();
    let cones: Vec<LocalRay> =
        exact.iter().map(|ray| LocalRay { spread: 0.02 * ray.direction.length(), ..*ray }).collect();
    let [exact_hits, hits] = [&exact, &cones].map(|rays| shape.first_hits(&gpu, anchor, rays).expect("a device"));
    let mut earlier = 0;
    for ((ray, exact), got) in cones.iter().zip(exact_hits).zip(hits) {
        let slack = 1e-3 + 1e-5 * exact.min(1e9);
        assert!(got <= exact + slack, "{got} after the exact {exact} of {ray:?}");
        if got >= exact - slack {
            continue;
        }
        earlier += 1;
        // Some ground that the cone covers reaches up to it.
        let point = exactly(anchor, ray).at(f64::from(got));
        let width = f64::from(ray.spread * got) / spacing.min_element();
        let place = (point.truncate() - land.origin()) / spacing;
        let window = |at: f64, n: i64| {
            ((at - width).floor() as i64 - 1).clamp(0, n - 1)..=((at + width).ceil() as i64 + 1).clamp(0, n - 1)
        };
        let samples = window(place.y, rows).flat_map(|row| window(place.x, columns).map(move |column| (column, row)));
        let heights = samples.map(|(column, row)| land.raster().heights()[(row * columns + column) as usize]);
        let (low, high) = heights.fold((f32::MAX, f32::MIN), |(low, high), h| (low.min(h), high.max(h)));
        let z = point.z as f32;
        assert!(z <= high + 0.05 && z >= low - 0.05, "{z} is not within {low}..{high}: {ray:?}");
    }
    println!("{earlier} of {} cones end before the exact hit", cones.len());
    assert!(earlier > 100);
}

#[test]
fn a_pictures_rays_meet_what_the_processors_do() {
    let Some(gpu) = gpu() else { return };
    let land = coast::coast();
    let stage = Stage::new(&Scene::new(&land, None));
    let mut painter = Painter::new(gpu, &stage).expect("a natural scene");
    let middle = land.origin() + 0.5 * land.extent();
    let ground = f64::from(land.height_at(middle).expect("land"));
    let size = UVec2::new(211, 117);
    let (mut all, mut off) = (0, 0);
    for (eye, target) in [
        (DVec3::new(3380.0, 560.0, 175.0), DVec3::new(2833.0, 2457.0, 5.0)),
        (middle.extend(ground + 2.0), middle.extend(ground + 2.0) + DVec3::new(-400.0, 900.0, 20.0)),
        (middle.extend(9000.0), middle.extend(0.0)),
    ] {
        let view = View::looking_at(eye, target, 0.9, size);
        let picture = painter.picture(&stage, None, &view, 1, &|_| {}).expect("a picture");
        let (corner, right, down) = view.frame();
        for (i, &got) in picture.depth.iter().enumerate() {
            let (x, y) = ((i as u32 % size.x) as f32 + 0.5, (i as u32 / size.x) as f32 + 0.5);
            let direction = (corner + right * x + down * y).as_dvec3().normalize();
            let exact = stage.land().first_hit(&Ray::new(eye, direction)).map_or(f64::INFINITY, |hit| hit.distance);
            // Beyond the ground there is mist.
            if exact.is_finite() {
                all += 1;
                off += usize::from((f64::from(got) - exact).abs() > 0.01 + 1e-5 * exact);
            }
        }
    }
    println!("{off} of {all} pixels are farther off than a centimetre and 10⁻⁵ of their distance");
    assert!(all > 20_000 && off * 500 < all, "{off} of {all}");
}

#[test]
fn what_cannot_be_met_or_held_is_said() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(1);
    let land = rough(&mut random, [9, 9], DVec2::ONE, 5.0, 0.0);
    let shape = ShapeTexture::new(&gpu, &land).expect("a small land");
    let from = (land.origin() + 4.5).extend(100.0).as_vec3();
    let down = LocalRay::new(from, -Vec3::Z);
    let bad = [
        LocalRay::new(from, Vec3::ZERO),
        LocalRay::new(Vec3::NAN, -Vec3::Z),
        LocalRay::new(from, Vec3::new(0.0, f32::INFINITY, -1.0)),
        LocalRay { reach: f32::NAN, ..down },
        LocalRay { reach: -1.0, ..down },
        LocalRay { reach: 50.0, ..down },
    ];
    let got = shape.first_hits(&gpu, DVec3::ZERO, &bad).expect("a device");
    assert!(got.iter().all(|&hit| hit == f32::INFINITY), "{got:?}");
    // Whatever the length of the direction, and beside a bad one.
    let lengths = [1e-6, 1.0, 1e6].map(|length| LocalRay::new(from, -Vec3::Z * length));
    let got = shape.first_hits(&gpu, DVec3::ZERO, &lengths).expect("a device");
    assert!(got.iter().zip([1e-6, 1.0, 1e6]).all(|(hit, length)| (hit * length - got[1]).abs() < 1e-3), "{got:?}");
    assert!(shape.first_hits(&gpu, DVec3::NAN, &lengths).expect("a device").iter().all(|hit| hit.is_infinite()));
    assert!(shape.first_hits(&gpu, DVec3::ZERO, &[]).expect("a device").is_empty());

    let most = gpu.device.limits().max_texture_dimension_2d as usize;
    let long = Raster::new(most + 1, 2, DVec2::ONE, vec![0.0; 2 * (most + 1)]).expect("valid");
    let refused = ShapeTexture::new(&gpu, &Land::new(long)).expect_err("no texture is that long");
    assert!(matches!(refused, ShapeError::TooLarge(_)));
    assert!(refused.to_string().contains(&format!("{} × 2", most + 1)), "{refused}");
    assert!(gpu.check().is_ok());
}
