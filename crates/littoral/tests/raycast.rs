//! Rays against brute force over all patches, on thousands of small maps.

use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use littoral::field::{HeightField, HeightRange, Land, Raster, Window};
use littoral::raycast::{LocalRay, Simd};
use littoral::space::{Cell, Ray, View};
use proptest::prelude::*;

/// Fewer under Miri, which is a thousand times slower.
const fn cases(count: u32) -> u32 {
    if cfg!(miri) { 3 } else { count }
}

/// Corner heights of a patch, if it exists.
fn corners(land: &Land, column: usize, row: usize) -> Option<[f64; 4]> {
    Some(land.corners(column, row)?.map(f64::from))
}

/// Where a ray meets one patch: the parameters of all roots of the quadratic inside the patch, a little tolerant.
fn patch_hits(land: &Land, ray: &Ray, column: usize, row: usize, slack: f64, out: &mut Vec<f64>) {
    let Some([a, b, c, d]) = corners(land, column, row) else { return };
    let spacing = land.raster().spacing();
    let o = (ray.origin.truncate() - land.origin()) / spacing - DVec2::new(column as f64, row as f64);
    let w = ray.direction.truncate() / spacing;
    let (mut t0, mut t1) = (0.0f64, ray.reach);
    for (o, w) in [(o.x, w.x), (o.y, w.y)] {
        if w == 0.0 {
            if !(-slack..=1.0 + slack).contains(&o) {
                return;
            }
        } else {
            let (p, q) = ((-slack - o) / w, (1.0 + slack - o) / w);
            t0 = t0.max(p.min(q));
            t1 = t1.min(p.max(q));
        }
    }
    if t0 > t1 {
        return;
    }
    // f(t) about t0.
    let p = o + w * t0;
    let e = a - b - c + d;
    let f0 = ray.origin.z + t0 * ray.direction.z - (a + (b - a) * p.x + (c - a) * p.y + e * p.x * p.y);
    let f1 = ray.direction.z - ((b - a) * w.x + (c - a) * w.y + e * (p.x * w.y + p.y * w.x));
    let f2 = -e * w.x * w.y;
    let mut root = |s: f64| {
        if s >= -1e-12 && t0 + s <= t1 + 1e-12 {
            out.push(t0 + s);
        }
    };
    if f2.abs() < 1e-14 * f1.abs() || f2 == 0.0 {
        if f1 != 0.0 {
            root(-f0 / f1);
        } else if f0 == 0.0 {
            root(0.0);
        }
    } else {
        let disc = f1 * f1 - 4.0 * f2 * f0;
        if disc >= 0.0 {
            let q = -0.5 * (f1 + f1.signum() * disc.sqrt());
            root(q / f2);
            if q != 0.0 {
                root(f0 / q);
            }
        }
    }
}

fn brute_force(land: &Land, ray: &Ray, slack: f64) -> Option<f64> {
    let mut hits = Vec::new();
    for row in 0..land.raster().rows() - 1 {
        for column in 0..land.raster().columns() - 1 {
            patch_hits(land, ray, column, row, slack, &mut hits);
        }
    }
    hits.into_iter().reduce(f64::min)
}

/// Whether a point lies on the surface as nearly as rounding lets one know.
fn touches(land: &Land, point: DVec3, slack: f64, hair: f64) -> bool {
    let at = (point.truncate() - land.origin()) / land.raster().spacing();
    let side = 30.0 * slack;
    (0..land.raster().rows() - 1).any(|row| {
        (0..land.raster().columns() - 1).any(|column| {
            let Some([a, b, c, d]) = corners(land, column, row) else { return false };
            let p = at - DVec2::new(column as f64, row as f64);
            let q = p.clamp(DVec2::ZERO, DVec2::ONE);
            let height = (a * (1.0 - q.x) + b * q.x) * (1.0 - q.y) + (c * (1.0 - q.x) + d * q.x) * q.y;
            let steep = a.max(b).max(c).max(d) - a.min(b).min(c).min(d);
            (p - q).abs().max_element() <= side && (point.z - height).abs() <= hair + side * steep
        })
    })
}

/// Fails unless `got` lies between what brute force says of the ray moved up and down by a hair, against patches a hair
/// larger and smaller: `slack` in cells, and as a part of all heights and lengths.
fn check(land: &Land, ray: &Ray, got: Option<f64>, slack: f64) -> Result<(), TestCaseError> {
    let range = land.height_range();
    let size = f64::from(range.high.abs().max(range.low.abs())).min(1e9) + ray.origin.length();
    let hair = if range.is_empty() { 0.0 } else { slack * size };
    let side = slack * 30.0 * land.raster().spacing().max_element();
    let moves = [(0, 0, -1), (0, 0, 0), (0, 0, 1), (-1, -1, 0), (-1, 1, 0), (1, -1, 0), (1, 1, 0)];
    let moved = moves.map(|(x, y, z)| {
        let by = DVec3::new(f64::from(x) * side, f64::from(y) * side, f64::from(z) * hair);
        Ray { origin: ray.origin + by, ..*ray }
    });
    let answers = moved
        .iter()
        .flat_map(|ray| [slack, -slack].map(|slack| brute_force(land, ray, slack).unwrap_or(f64::INFINITY)));
    let (first, last) = answers.fold((f64::INFINITY, 0.0f64), |(first, last), t| (first.min(t), last.max(t)));
    let hair = 100.0 * slack * (size + first.min(1e9) * ray.direction.length()) / ray.direction.length().max(1e-9);
    let got = got.unwrap_or(f64::INFINITY);
    if got < first - hair && touches(land, ray.at(got), slack, slack * size) {
        return Ok(());
    }
    prop_assert!(got >= first - hair && got <= last + hair, "{} is not within {}..{} of {:?}", got, first, last, ray);
    Ok(())
}

#[derive(Clone, Copy, Debug)]
enum Ground {
    Flat,
    Gentle,
    Steep,
    Spikes,
}

fn land(seed: u64, columns: usize, rows: usize, spacing: DVec2, ground: Ground, voids: u32) -> Land {
    let mut state = seed | 1;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let heights = (0..columns * rows)
        .map(|i| {
            let (x, y) = ((i % columns) as f32, (i / columns) as f32);
            let h = match ground {
                Ground::Flat => 5.0,
                Ground::Gentle => 20.0 + (0.3 * x).sin() * 2.0 + (0.2 * y).cos() * 3.0 + 0.2 * next(),
                Ground::Steep => 100.0 * next() - 30.0,
                Ground::Spikes => {
                    if next() < 0.05 {
                        500.0 * next()
                    } else {
                        0.0
                    }
                }
            };
            if next() * 100.0 < voids as f32 { f32::NAN } else { h }
        })
        .collect();
    Land::at(Raster::new(columns, rows, spacing, heights).expect("valid"), DVec2::new(-13.0, 7.5))
}

prop_compose! {
    fn any_land()(
        seed in any::<u64>(), columns in 2usize..20, rows in 2usize..20,
        spacing in prop_oneof![Just(DVec2::ONE), Just(DVec2::new(2.0, 0.7)), Just(DVec2::new(9.0, 30.0))],
        ground in prop_oneof![Just(Ground::Flat), Just(Ground::Gentle), Just(Ground::Steep), Just(Ground::Spikes)],
        voids in prop_oneof![Just(0u32), Just(0), Just(3), Just(30)],
    ) -> Land {
        land(seed, columns, rows, spacing, ground, voids)
    }
}

/// A ray between two points about the map's box, or aimed exactly at samples, along edges, straight down.
fn ray_at(land: &Land, kind: u32, k: [f64; 6]) -> Ray {
    let (origin, extent, spacing) = (land.origin(), land.extent(), land.raster().spacing());
    let HeightRange { low, high } = land.height_range();
    let (low, high) = if low > high { (0.0, 1.0) } else { (f64::from(low), f64::from(high)) };
    let about = |k: [f64; 3]| {
        let xy = origin + extent * (DVec2::new(k[0], k[1]) * 1.6 - 0.3);
        xy.extend(low + (high - low + 5.0) * (k[2] * 1.6 - 0.3))
    };
    let sample = |k: [f64; 3]| {
        let columns = (land.raster().columns() as f64 * k[0]).floor();
        let rows = (land.raster().rows() as f64 * k[1]).floor();
        let index = rows as usize * land.raster().columns() + columns as usize;
        let height = f64::from(land.raster().heights()[index]);
        (origin + DVec2::new(columns, rows) * spacing).extend(height)
    };
    let (p, q) = ([k[0], k[1], k[2]], [k[3], k[4], k[5]]);
    match kind {
        0 => Ray::new(about(p), about(q) - about(p)),
        1 => Ray::between(about(p), about(q)),
        2 => Ray::new(about(p), sample(q) - about(p)),
        3 => Ray::new(sample(p) + DVec3::Z * (100.0 * (k[2] - 0.3)), -DVec3::Z),
        4 => Ray::new(about(p), DVec3::new(0.0, 0.0, if k[3] < 0.5 { -2.0 } else { 0.5 })),
        // Along a grid line, and along a diagonal through samples.
        5 => Ray::new(
            sample(p) + DVec3::Z * (10.0 * k[2] - 3.0),
            DVec3::new(if k[3] < 0.5 { 1.0 } else { -1.0 }, 0.0, k[5] - 0.6),
        ),
        6 => Ray::new(sample(p) + DVec3::Z * 10.0, DVec3::new(spacing.x, -spacing.y, k[5] * 4.0 - 4.0)),
        7 => Ray::between(sample(p) + DVec3::Z * 1e-3, sample(q) + DVec3::Z * 1e-3),
        // From far away.
        _ => {
            let target = about(q);
            let from = target + (about(p) - target).normalize_or(DVec3::X) * 1e7;
            Ray::new(from, target - from)
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(3000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn single_rays_equal_brute_force(land in any_land(), kind in 0u32..9, k in any::<[u32; 6]>()) {
        let ray = ray_at(&land, kind, k.map(|k| f64::from(k) / 4_294_967_296.0));
        let hit = land.first_hit(&ray);
        // What 10⁷ m away is known to 10⁻⁹ of a cell: so are lines between patches.
        let slack = if kind == 8 { 1e-8 } else { 1e-10 };
        check(&land, &ray, hit.map(|hit| hit.distance), slack)?;
        prop_assert_eq!(land.any_hit(&ray), hit.is_some());
        let slow = land.first_hit_patch_by_patch(&ray);
        // At the rim of a hole the walk may pass the very corner of a patch without looking at it.
        if land.raster().voids().any() {
            check(&land, &ray, slow.map(|hit| hit.distance), slack)?;
        } else {
            prop_assert_eq!(slow.map(|hit| hit.distance), hit.map(|hit| hit.distance), "the pyramid changed the answer");
        }
    }

    #[test]
    fn streams_equal_brute_force(land in any_land(), k in prop::collection::vec(any::<([u32; 6], u8)>(), 1..40)) {
        let anchor = DVec3::new(-10.0, 10.0, 3.0);
        let rays: Vec<LocalRay> = k.iter().map(|(k, kind)| {
            let ray = ray_at(&land, u32::from(kind % 8), k.map(|k| f64::from(k) / 4_294_967_296.0));
            LocalRay { reach: ray.reach as f32, ..LocalRay::new((ray.origin - anchor).as_vec3(), ray.direction.as_vec3()) }
        }).collect();
        let mut distances = vec![0.0; rays.len()];
        land.caster(anchor).first_hits(&rays, &mut distances);
        for simd in [Simd::Portable, Simd::Avx2, Simd::Avx512].into_iter().filter(|simd| simd.available()) {
            let caster = land.caster(anchor).with_simd(simd);
            let mut again = vec![0.0; rays.len()];
            caster.first_hits(&rays, &mut again);
            prop_assert_eq!(&again, &distances, "{:?} differs", simd);
            let mut any = vec![false; rays.len()];
            caster.any_hits(&rays, &mut any);
            prop_assert!(any.iter().zip(&distances).all(|(any, t)| *any == t.is_finite()));
        }
        let (best, portable) = (land.caster(anchor), land.caster(anchor).with_simd(Simd::Portable));
        for (ray, distance) in rays.iter().zip(distances) {
            let single = best.first_hit(ray);
            prop_assert_eq!(portable.first_hit(ray).to_bits(), single.to_bits(), "portable single rays differ");
            prop_assert_eq!(best.any_hit(ray), single.is_finite());
            let exact = Ray { origin: anchor + ray.origin.as_dvec3(), direction: ray.direction.as_dvec3(), reach: f64::from(ray.reach) };
            for distance in [distance, single] {
                check(&land, &exact, distance.is_finite().then_some(f64::from(distance)), 2e-6)?;
            }
        }
    }

    #[test]
    fn ranges_hold_the_surface_and_edits_equal_rebuilding(
        mut land in any_land(), k in any::<[u8; 4]>(), seed in any::<u64>(), taller in any::<bool>(), cell in any::<[u32; 2]>(), level in 0u8..9,
    ) {
        let (columns, rows) = (land.raster().columns(), land.raster().rows());
        let (column, row) = (k[0] as usize % columns, k[1] as usize % rows);
        let window = Window { column, row, columns: 1 + k[2] as usize % (columns - column), rows: 1 + k[3] as usize % (rows - row) };
        let mut state = seed | 1;
        let heights: Vec<f32> = (0..window.columns * window.rows).map(|_| {
            state ^= state << 13; state ^= state >> 7; state ^= state << 17;
            if state % 9 == 0 { f32::NAN } else { (state % 1000) as f32 * if taller { 3.0 } else { 0.01 } }
        }).collect();
        for edited in [false, true] {
            if edited {
                land.edit(window, &heights);
                prop_assert_eq!(land.height_range(), land.raster().range());
            }
            let cell = Cell { face: 0, level, x: cell[0] >> (32 - u32::from(level)).min(31), y: cell[1] >> (32 - u32::from(level)).min(31) };
            let cell = if level == 0 { Cell::face(0) } else { cell };
            let range = land.range(cell);
            let mut inside = vec![0.0f32; 33 * 33];
            land.fill(cell, 33, &mut inside);
            // The border of a cell may belong to a neighbour's patch alone, where its own is void.
            let inner = (1..32).flat_map(|row| inside[33 * row + 1..33 * row + 32].iter().copied());
            for height in inner.filter(|h| !h.is_nan()) {
                prop_assert!(range.contains(height), "{} outside {:?} of {:?}", height, range, cell);
            }
            let fresh = Land::at(land.raster().clone(), land.origin());
            let there = fresh.range(cell);
            prop_assert_eq!(there.is_empty(), range.is_empty());
            if !range.is_empty() {
                let span = land.height_range().high - land.height_range().low + 3100.0;
                prop_assert!((there.low - range.low).abs() <= span * 4e-5 && (there.high - range.high).abs() <= span * 4e-5);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(300), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn views_equal_brute_force(land in any_land(), k in any::<[u32; 6]>(), size in (1u32..90, 1u32..150), field in 0.01f32..2.5) {
        let ray = ray_at(&land, 0, k.map(|k| f64::from(k) / 4_294_967_296.0));
        let view = View::looking_at(ray.origin, ray.origin + ray.direction, field, UVec2::new(size.0, size.1));
        let (corner, right, down) = view.frame();
        let mut distances = vec![0.0; (size.0 * size.1) as usize];
        let sample = Vec2::new(0.3, 0.6);
        land.caster(view.eye).par_view_hits(&view, sample, &mut distances);
        for simd in [Simd::Portable, Simd::Avx2, Simd::Avx512].into_iter().filter(|simd| simd.available()) {
            let mut again = vec![0.0; distances.len()];
            land.caster(view.eye).with_simd(simd).view_hits(&view, sample, 0..size.1, &mut again);
            prop_assert_eq!(&again, &distances, "{:?} differs", simd);
        }
        for (index, distance) in distances.into_iter().enumerate().step_by(1 + (size.0 * size.1) as usize / 50) {
            let (x, y) = ((index as u32 % size.0) as f32 + sample.x, (index as u32 / size.0) as f32 + sample.y);
            let exact = Ray::new(view.eye, (corner + right * x + down * y).as_dvec3());
            check(&land, &exact, distance.is_finite().then_some(f64::from(distance)), 2e-6)?;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(500), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bulk_heights_and_sights_equal_single_ones(land in any_land(), k in prop::collection::vec(any::<[u32; 6]>(), 1..150)) {
        let anchor = DVec3::new(-10.0, 10.0, 3.0);
        let rays: Vec<Ray> = k.iter().map(|k| ray_at(&land, 1, k.map(|k| f64::from(k) / 4_294_967_296.0))).collect();
        let places: Vec<DVec2> = rays.iter().map(|ray| ray.origin.truncate()).collect();
        let mut heights = vec![0.0; places.len()];
        land.heights_at(&places, &mut heights);
        for (place, height) in places.iter().zip(heights) {
            let single = land.height_at(*place).unwrap_or(f32::NAN);
            // One NaN is as good as another.
            let same = single.to_bits() == height.to_bits() || single.is_nan() && height.is_nan();
            prop_assert!(same, "{} is not {} at {}", height, single, place);
        }
        let segments: Vec<_> = rays.iter().map(|ray| [0.0, 1.0].map(|t| (ray.at(t) - anchor).as_vec3())).collect();
        let locals: Vec<_> = segments.iter().map(|[from, to]| LocalRay::between(*from, *to)).collect();
        for simd in [Simd::Portable, Simd::Avx2, Simd::Avx512].into_iter().filter(|simd| simd.available()) {
            let caster = land.caster(anchor).with_simd(simd);
            let (mut visible, mut hits) = (vec![false; segments.len()], vec![false; segments.len()]);
            caster.lines_of_sight(&segments, &mut visible);
            caster.par_any_hits(&locals, &mut hits);
            prop_assert!(visible.iter().zip(&hits).all(|(visible, hit)| visible != hit));
        }
    }
}

/// Rays along an axis, whose other component is zero of either sign.
#[test]
fn negative_zero_is_zero() {
    let land = land(1, 40, 40, DVec2::ONE, Ground::Gentle, 0);
    let eye = land.origin().extend(40.0) + DVec3::new(20.3, 20.7, 0.0);
    let caster = land.caster(eye);
    for along in [1.0f32, -1.0] {
        for (plus, minus) in [
            (Vec3::new(along, 0.0, -2.0), Vec3::new(along, -0.0, -2.0)),
            (Vec3::new(0.0, along, -2.0), Vec3::new(-0.0, along, -2.0)),
        ] {
            let [plus, minus] = [plus, minus].map(|direction| caster.first_hit(&LocalRay::new(Vec3::ZERO, direction)));
            assert!(plus.is_finite() && plus == minus, "{plus} and {minus} for {along}");
        }
    }
}

/// Rays with a width: never later than exact ones, and where earlier, at the top of a node that is not wider than they are.
#[test]
fn rays_by_footprint_stop_at_nodes_as_wide_as_they_are() {
    let noise = littoral::field::noise::Fbm::new(60.0, 20.0, 6, 11);
    let place = |i: usize| DVec2::new((i % 300) as f64, (i / 300) as f64);
    let heights: Vec<f32> = (0..300 * 200).map(|i| noise.at(place(i)).value as f32).collect();
    for voids in [false, true] {
        let mut heights = heights.clone();
        if voids {
            heights.iter_mut().step_by(1013).for_each(|height| *height = f32::NAN);
        }
        let land = Land::at(Raster::new(300, 200, DVec2::ONE, heights).expect("valid"), DVec2::ZERO);
        let view =
            View::looking_at(DVec3::new(-30.0, 20.0, 60.0), DVec3::new(150.0, 110.0, 0.0), 0.9, UVec2::new(96, 70));
        let caster = land.caster(view.eye);
        let (corner, right, down) = view.frame();
        let pixels = 3.0;
        let spread = pixels * right.length();
        let rays: Vec<LocalRay> = (0..96 * 70)
            .map(|i| LocalRay {
                spread,
                ..LocalRay::new(Vec3::ZERO, corner + right * ((i % 96) as f32 + 0.5) + down * ((i / 96) as f32 + 0.5))
            })
            .collect();
        let [mut exact, mut wide, mut seen] = [(); 3].map(|()| vec![0.0; rays.len()]);
        let narrow: Vec<LocalRay> = rays.iter().map(|ray| LocalRay { spread: 0.0, ..*ray }).collect();
        caster.first_hits(&narrow, &mut exact);
        caster.first_hits(&rays, &mut wide);
        caster.view_hits_by_footprint(&view, Vec2::splat(0.5), pixels, 0..70, &mut seen);
        for simd in [Simd::Portable, Simd::Avx2].into_iter().filter(|simd| simd.available()) {
            let mut again = vec![0.0; rays.len()];
            land.caster(view.eye).with_simd(simd).first_hits(&rays, &mut again);
            assert_eq!(again, wide, "{simd:?} differs");
        }
        let mut earlier = 0;
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!(caster.first_hit(ray).to_bits(), wide[i].to_bits());
            for got in [wide[i], seen[i]] {
                assert!(got <= exact[i] * (1.0 + 1e-5), "{got} is later than {} for {ray:?}", exact[i]);
                if got < exact[i] * (1.0 - 1e-4) {
                    earlier += 1;
                    let at = view.eye + (ray.direction * got).as_dvec3();
                    let on_top = (1..=land.ranges().top()).any(|level| {
                        let side = f64::from(1u32 << level);
                        let nodes = [-1e-3, 1e-3].map(|hair| ((at.truncate() + hair) / side).floor().max(DVec2::ZERO));
                        side <= f64::from(spread * got) * 1.001
                            && nodes.iter().any(|node| {
                                let range = land.ranges().node(level, node.x as usize, node.y as usize);
                                !range.is_empty() && at.z <= f64::from(range.high) + 1e-3
                            })
                    });
                    assert!(on_top, "{got} instead of {} is over every node of {ray:?}", exact[i]);
                }
            }
        }
        assert!(earlier > 1000, "only {earlier} rays stopped early");
    }
}

/// Maps of many blocks, and of more than one of the coarsest, where brute force takes too long: held against the walk
/// that is held against brute force. From above, low and high, to all sides, through the whole map.
#[test]
fn single_rays_equal_the_exact_walk_on_large_maps() {
    for (seed, columns, rows, spacing) in
        [(1, 33, 257, 1.0), (2, 258, 71, 30.0), (3, 700, 650, 7.3), (4, 5000, 90, 2.0), (5, 5, 4500, 1.0)]
    {
        let mut state = u64::from(seed);
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let noise = littoral::field::noise::Fbm::new(180.0 * spacing, 25.0 * spacing, 7, seed);
        let place = |i: usize| DVec2::new((i % columns) as f64, (i / columns) as f64) * spacing;
        let heights = (0..columns * rows).map(|i| noise.at(place(i)).value as f32).collect();
        let land =
            Land::at(Raster::new(columns, rows, DVec2::splat(spacing), heights).expect("valid"), DVec2::new(9e5, -7e4));
        let (mut hits, mut left) = (0, 0);
        for _ in 0..if cfg!(miri) { 4 } else { 4000 } {
            let mut xy = || {
                land.origin()
                    + land.extent() * DVec2::new(random(), random()).clamp(DVec2::splat(0.001), DVec2::splat(0.999))
            };
            let (from, to) = (xy(), xy());
            let ground = |xy: DVec2| f64::from(land.height_at(xy).expect("on the map"));
            let (from, to) = (
                from.extend(ground(from) + spacing * 60.0 * random() * random()),
                to.extend(ground(to) + spacing * 20.0 * (random() - 0.5)),
            );
            let caster = land.caster(from);
            let ray = LocalRay::new(Vec3::ZERO, (to - from).as_vec3());
            let got = caster.first_hit(&ray);
            assert_eq!(caster.clone().with_simd(Simd::Portable).first_hit(&ray).to_bits(), got.to_bits());
            let exact = Ray::new(from, ray.direction.as_dvec3());
            let want = land.first_hit(&exact).map_or(f64::INFINITY, |hit| hit.distance);
            let length = exact.direction.length();
            hits += usize::from(got.is_finite());
            // Rays that graze may pass by a hair: then the surface is that near.
            let near = |t: f64| {
                let point = exact.at(t);
                land.height_at(point.truncate()).is_some_and(|h| {
                    (point.z - f64::from(h)).abs() < 1e-5 * spacing * (1.0 + t * length / spacing * 0.1)
                })
            };
            let got = f64::from(got);
            let same = got == want || ((got - want) * length).abs() < 2e-4 * spacing + 2e-6 * want * length;
            if !same {
                left += 1;
                assert!(near(got.min(want)), "{got} instead of {want} for {exact:?} on {columns} × {rows}");
            }
        }
        assert!(cfg!(miri) || hits > 1000, "only {hits} hits on {columns} × {rows}");
        assert!(left < 20, "{left} rays graze on {columns} × {rows}");
    }
}

/// Maps with coarse levels, from far above the ground to below it, from beside the map and over all lengths: held against
/// the stream that is held against brute force.
#[test]
fn lines_of_sight_equal_streams_on_large_maps() {
    for (seed, columns, rows, spacing) in [(1, 40, 33, 9.0), (2, 258, 71, 30.0), (3, 700, 650, 7.3), (4, 3000, 90, 2.0)]
    {
        let mut state = u64::from(seed);
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let noise = littoral::field::noise::Fbm::new(180.0 * spacing, 25.0 * spacing, 7, seed);
        let place = |i: usize| DVec2::new((i % columns) as f64, (i / columns) as f64) * spacing;
        let heights = (0..columns * rows).map(|i| noise.at(place(i)).value as f32).collect();
        let land =
            Land::at(Raster::new(columns, rows, DVec2::splat(spacing), heights).expect("valid"), DVec2::new(9e5, -7e4));
        let anchor = (land.origin() + 0.3 * land.extent()).extend(10.0);
        let segments: Vec<[Vec3; 2]> = (0..if cfg!(miri) { 30 } else { 20_000 })
            .map(|n| {
                let mut end = |near: Option<DVec2>| {
                    let at = DVec2::new(random(), random());
                    let at = match near {
                        Some(near) if n % 3 == 0 => near + (at - 0.5) * 20.0 * spacing,
                        // One in five beside the map.
                        _ if n % 5 == 0 => land.origin() + land.extent() * (at * 1.6 - 0.3),
                        _ => land.origin() + land.extent() * at,
                    };
                    let inside = (at - land.origin()).clamp(DVec2::ZERO, land.extent() * 0.999) + land.origin();
                    let ground = f64::from(land.height_at(inside).expect("on the map"));
                    at.extend(ground + spacing * 30.0 * (random() * random() - 0.04))
                };
                let from = end(None);
                let to = end(Some(from.truncate()));
                [from, to].map(|end| (end - anchor).as_vec3())
            })
            .collect();
        let rays: Vec<LocalRay> = segments.iter().map(|[from, to]| LocalRay::between(*from, *to)).collect();
        for simd in [Simd::Portable, Simd::Avx2, Simd::Avx512].into_iter().filter(|simd| simd.available()) {
            let caster = land.caster(anchor).with_simd(simd);
            let (mut visible, mut hits) = (vec![false; segments.len()], vec![false; segments.len()]);
            caster.lines_of_sight(&segments, &mut visible);
            caster.any_hits(&rays, &mut hits);
            let blocked = hits.iter().filter(|hit| **hit).count();
            assert!(cfg!(miri) || (2000..18_000).contains(&blocked), "{blocked} blocked on {columns} × {rows}");
            for (segment, (visible, hit)) in segments.iter().zip(visible.iter().zip(&hits)) {
                assert!(visible != hit, "{segment:?} by {simd:?} on {columns} × {rows}: visible {visible}");
            }
        }
    }
}

/// Views over maps of many patches, near and far, held against the exact walk; and every set of instructions against the
/// others.
#[test]
fn views_equal_the_exact_walk_on_large_maps() {
    let (columns, rows) = (700, 650);
    let noise = littoral::field::noise::Fbm::new(1200.0, 160.0, 7, 5);
    let place = |i: usize| DVec2::new((i % columns) as f64, (i / columns) as f64) * 7.3;
    let heights = (0..columns * rows).map(|i| noise.at(place(i)).value as f32).collect();
    let land = Land::at(Raster::new(columns, rows, DVec2::splat(7.3), heights).expect("valid"), DVec2::new(9e5, -7e4));
    let at = |x: f64, y: f64, up: f64| {
        let xy = land.origin() + land.extent() * DVec2::new(x, y);
        xy.extend(f64::from(land.height_at(xy.clamp(land.origin(), land.origin() + land.extent())).expect("land")) + up)
    };
    let size = if cfg!(miri) { UVec2::new(9, 6) } else { UVec2::new(150, 100) };
    for (from, to) in [
        (at(0.1, 0.1, 3.0), at(0.3, 0.35, 0.0)),
        (at(0.9, 0.4, 60.0), at(0.2, 0.5, 0.0)),
        (at(0.5, 0.9, 900.0), at(0.45, 0.5, 0.0)),
        (at(0.6, -0.2, 300.0), at(0.4, 0.8, 0.0)),
        (at(0.5, 0.5, 2000.0), at(0.501, 0.502, 0.0)),
    ] {
        let view = View::looking_at(from, to, 0.8, size);
        let (corner, right, down) = view.frame();
        let mut distances = vec![0.0; (size.x * size.y) as usize];
        land.caster(from).view_hits(&view, Vec2::splat(0.5), 0..size.y, &mut distances);
        for simd in [Simd::Portable, Simd::Avx2].into_iter().filter(|simd| simd.available()) {
            let mut again = vec![0.0; distances.len()];
            land.caster(from).with_simd(simd).view_hits(&view, Vec2::splat(0.5), 0..size.y, &mut again);
            assert_eq!(again, distances, "{simd:?} differs");
        }
        let (mut hits, mut apart) = (0, 0);
        for (i, got) in distances.into_iter().enumerate() {
            let (x, y) = ((i as u32 % size.x) as f32 + 0.5, (i as u32 / size.x) as f32 + 0.5);
            let exact = Ray::new(from, (corner + right * x + down * y).as_dvec3());
            let want = land.first_hit(&exact).map_or(f64::INFINITY, |hit| hit.distance);
            let (got, length) = (f64::from(got), exact.direction.length());
            hits += usize::from(got.is_finite());
            if got != want && ((got - want) * length).abs() > 2e-3 + 2e-6 * want * length {
                // A ray that grazes may pass by a hair.
                apart += 1;
                let point = exact.at(got.min(want));
                let height = land.height_at(point.truncate()).expect("a hit is on the map");
                assert!((point.z - f64::from(height)).abs() < 0.01, "{got} instead of {want} for {exact:?}");
            }
        }
        assert!(cfg!(miri) || hits > 2000, "only {hits} hits from {from}");
        assert!(apart < 20, "{apart} rays graze from {from}");
    }
}

#[test]
fn nonsense_meets_nothing() {
    let land = land(3, 17, 9, DVec2::ONE, Ground::Steep, 0);
    let here = DVec3::new(0.0, 10.0, 1000.0);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(land.first_hit(&Ray::new(here.with_x(bad), -DVec3::Z)), None);
        assert_eq!(land.first_hit(&Ray::new(here, DVec3::new(bad, 0.0, -1.0))), None);
    }
    assert_eq!(land.first_hit(&Ray::new(here, DVec3::ZERO)), None);
    assert_eq!(land.first_hit(&Ray { reach: f64::NAN, ..Ray::new(here, -DVec3::Z) }), None);
    assert_eq!(land.first_hit(&Ray { reach: -1.0, ..Ray::new(here, -DVec3::Z) }), None);
    assert!(land.first_hit(&Ray::new(here, -DVec3::Z)).is_some());
    assert!(land.first_hit(&Ray::new(here, DVec3::new(1e-300, -1e-200, -1.0))).is_some());
    assert!(land.first_hit(&Ray::new(here, DVec3::new(0.0, 0.0, -1e-30))).is_some());
    let huge = land.first_hit(&Ray::new(DVec3::splat(1e300), DVec3::splat(-1e300)));
    assert!(huge.is_none_or(|hit| hit.distance.is_finite()));
}

#[test]
fn all_void_land_meets_nothing() {
    let land = Land::new(Raster::new(9, 5, DVec2::ONE, vec![f32::NAN; 45]).expect("valid"));
    assert_eq!(land.first_hit(&Ray::new(DVec3::Z * 10.0, -DVec3::Z)), None);
    assert!(land.range(Cell::face(0)).is_empty());
}
