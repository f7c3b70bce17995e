//! Against Algorithm I, from scratch and without any queue.

use super::super::scan::{measure, renewed};
use super::*;
use crate::field::{Land, Raster, Sea};
use crate::lod::{Disc, RoamOnce};
use crate::space::Datum;
use crate::waves::{SeaState, Superposition};
use glam::{DVec2, DVec3, UVec2};
use proptest::prelude::*;
use std::collections::BTreeSet;

/// Splits, one at a time, the triangle of greatest priority among all that are there; returns the triangles, and the greatest priority left.
fn algorithm_one<G: Ground>(flight: &RoamFlight<'_, G>) -> (BTreeSet<[Point; 3]>, f32) {
    let number = |diamond: Diamond| number(flight, diamond);
    let mut split: BTreeSet<u64> = BTreeSet::new();
    let mut leaves: Vec<(Diamond, usize)> = vec![(Diamond::ROOT, 0), (Diamond::ROOT, 1)];
    loop {
        let splittable = leaves.iter().filter(|(d, _)| flight.idle(*d) == SPLIT && number(*d) > flight.tolerance);
        let top = splittable.max_by_key(|(d, _)| Key::new(number(*d), *d, 0)).copied();
        let Some((top, _)) = top else { break };
        // What must be split with it: parents of parents, as far as they are not.
        let mut forced = vec![top];
        let mut at = 0;
        while at < forced.len() {
            for parent in forced[at].parents().into_iter().flatten() {
                if !split.contains(&parent.name()) && !forced.contains(&parent) {
                    forced.push(parent);
                }
            }
            at += 1;
        }
        let more: usize = forced.iter().map(|d| d.apexes().into_iter().flatten().count()).sum();
        if leaves.len() + more > flight.limits.triangles {
            break;
        }
        forced.sort_by_key(|d| d.level());
        for diamond in forced {
            split.insert(diamond.name());
            let before = leaves.len();
            leaves.retain(|(d, _)| *d != diamond);
            assert_eq!(
                before - leaves.len(),
                diamond.apexes().into_iter().flatten().count(),
                "both of its triangles are there"
            );
            for child in diamond.children().into_iter().flatten() {
                let side = child.apexes().iter().position(|apex| *apex == Some(diamond.at)).expect("a parent");
                leaves.push((child, side));
            }
        }
    }
    let worst = leaves.iter().map(|(d, _)| number(*d)).fold(0.0, f32::max);
    let drawn = leaves.into_iter().filter(|(d, side)| flight.bounds.bound(*d).whole(*side));
    (drawn.map(|(d, side)| turned(d.triangle(d.apexes()[side].expect("there")))).collect(), worst)
}

/// The priority of a diamond in the view seen last.
fn number<G: Ground>(flight: &RoamFlight<'_, G>, diamond: Diamond) -> f32 {
    let (lens, bounds) = (flight.lens.as_ref().expect("a view was seen"), &flight.bounds);
    bounds.priority(lens, &bounds.item(bounds.bound(diamond), diamond, SPLIT, 0), bounds.slopes(diamond))
}

/// Whether no diamond has a greater priority than those that must be split before it.
fn nested<G: Ground>(flight: &RoamFlight<'_, G>) -> bool {
    let number = |diamond: Diamond| number(flight, diamond);
    let finest = flight.limits.finest.min(flight.bounds.finest());
    let mut level = vec![Diamond::ROOT];
    while !level.is_empty() {
        let mut next = Vec::new();
        for diamond in level {
            let children = diamond.children().into_iter().flatten();
            for child in children.filter(|c| c.cell_level() < finest || c.cell_level() == finest && c.is_square()) {
                if number(child) > number(diamond) {
                    return false;
                }
                if child.apexes()[0] == Some(diamond.at) && child.cell_level() < finest {
                    next.push(child);
                }
            }
        }
        level = next;
    }
    true
}

/// A triangle beginning with its least corner.
fn turned(triangle: [Point; 3]) -> [Point; 3] {
    let first = (0..3).min_by_key(|&i| triangle[i]).expect("three");
    [triangle[first], triangle[(first + 1) % 3], triangle[(first + 2) % 3]]
}

fn drawn<G: Ground>(flight: &RoamFlight<'_, G>) -> BTreeSet<[Point; 3]> {
    drawn_of(&flight.mesh)
}

fn drawn_of(mesh: &Mesh) -> BTreeSet<[Point; 3]> {
    let corner = |i: u32| mesh.vertices[i as usize];
    mesh.triangles.iter().map(|t| turned(t.map(|i| [corner(i).x, corner(i).y]))).collect()
}

fn split_set<G: Ground>(flight: &RoamFlight<'_, G>) -> BTreeSet<Point> {
    let splits = flight.list.word_records().filter(|&r| flight.records[r as usize].list != NOWHERE);
    let mut all = BTreeSet::new();
    let mut stack: Vec<u32> = splits.collect();
    while let Some(record) = stack.pop() {
        let known = &flight.records[record as usize];
        if !known.split || all.insert(known.at) {
            stack.extend(known.parents.iter().filter(|&&parent| parent != NONE));
        }
    }
    all
}

fn land(columns: usize, rows: usize, heights: &[f32]) -> Land {
    Land::new(Raster::new(columns, rows, DVec2::new(3.0, 2.0), heights.to_vec()).expect("valid"))
}

fn cases() -> u32 {
    std::env::var("LITTORAL_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(40)
}

fn factors() -> impl Strategy<Value = Factors> {
    let disc = (0f64..60.0, 0f64..40.0, 0f32..20.0, 1f32..9.0);
    let disc = disc.prop_map(|(x, y, radius, factor)| Disc { centre: DVec2::new(x, y), radius, factor });
    let objects = prop::collection::vec(disc, 0..3);
    let parts = (prop_oneof![Just(f32::INFINITY), 3f32..300.0], 0f32..1.0, 1f32..9.0, 0f32..3.0, objects);
    parts.prop_map(|(fog, back_faces, silhouettes, lighting, objects)| Factors {
        fog,
        back_faces,
        silhouettes,
        lighting,
        objects,
    })
}

/// Four measured at once, and many, have the priorities that each has alone, to the bit.
#[test]
fn many_at_once_are_as_each_alone() {
    let at = |i: usize| ((i % 65) as f32, (i / 65) as f32);
    let heights: Vec<f32> = (0..65 * 65).map(at).map(|(x, y)| 9.0 * (0.3 * x).sin() + 7.0 * (0.2 * y).cos()).collect();
    let voids: Vec<f32> = (0..65 * 65).map(|i| if i % 97 == 0 { f32::NAN } else { heights[i] }).collect();
    let [whole, holed] =
        [heights, voids].map(|heights| NestedBounds::of(&land(65, 65, &heights)).expect("few samples"));
    let mut seen = 0;
    let kinds = [(&whole, Priority::ScreenError), (&holed, Priority::ScreenError), (&whole, Priority::InverseDistance)];
    for (turn, (bounds, priority)) in (0..8).flat_map(|turn| kinds.map(|kind| (turn, kind))) {
        let yaw = f64::from(turn);
        let eye = DVec3::new(90.0, 60.0, 20.0 + 2.0 * yaw);
        let view = View::looking_at(eye, eye + DVec3::new(yaw.cos(), yaw.sin(), -0.3), 1.0, UVec2::new(640, 480));
        let metric = ScreenMetric::new(&view, bounds.datum()).expect("a view");
        let lens = bounds.lens(&metric, priority, &Factors::default());
        let mut level = vec![Diamond::ROOT];
        for _ in 0..11 {
            level = level.iter().flat_map(|diamond| diamond.children()).flatten().collect();
            let items: Vec<Item> = level.iter().map(|&diamond| bounds.item(diamond, SPLIT, 9)).collect();
            // Some may be merged, and some places are left.
            let mut numbers: Vec<f32> = (0..items.len()).map(|i| [0.0, -0.0, 5.0, -3.0, f32::NAN][i % 5]).collect();
            let before = numbers.clone();
            measure(&lens, &items, &[], &mut numbers);
            for ((item, before), number) in items.iter().zip(before).zip(numbers) {
                let alone = renewed(lens.priority(item, None), before);
                assert_eq!(number.to_bits(), alone.to_bits(), "{item:?}");
            }
            for four in level.chunks_exact(4) {
                let items = [0, 1, 2, 3].map(|i| bounds.item(four[i], SPLIT, i as u32));
                let Some(together) = lens.priorities(&items) else { continue };
                let alone = items.map(|item| lens.priority(&item, None));
                assert_eq!(together.map(f32::to_bits), alone.map(f32::to_bits), "{four:?}");
                seen += alone.iter().filter(|number| **number > 0.0).count();
            }
        }
    }
    assert!(seen > 1000, "{seen}");
}

/// Each factor moves triangles to where it should.
#[test]
fn factors_move_triangles() {
    // A range of hills across, and a plain roughness everywhere.
    let at = |i: usize| ((i % 65) as f32, (i / 65) as f32);
    let height = |i: usize| 20.0 * (-((at(i).1 - 32.0) / 6.0).powi(2)).exp() + ((i * 7919) % 101) as f32 * 0.004;
    let land = land(65, 65, &(0..65 * 65).map(height).collect::<Vec<f32>>());
    let bounds = NestedBounds::of(&land).expect("few samples").with_slopes();
    let centre = |t: &[Point; 3]| {
        let sum = t.iter().fold(DVec2::ZERO, |sum, p| sum + DVec2::new(f64::from(p[0]), f64::from(p[1])));
        sum / (3.0 * f64::from(STEPS))
    };
    // How many triangles of a part (of the face) there are with factors, and how many without.
    let counts = |factors: Factors, eye: DVec3, part: &dyn Fn(DVec2) -> bool| {
        let once = |factors: &Factors| {
            let mut flight = RoamFlight::over(&bounds, Limits { finest: 30, triangles: 1_000 });
            flight.factors = factors.clone();
            let mut view = View::looking_at(eye, DVec3::new(96.0, 64.0, 0.0), 1.2, UVec2::new(640, 400));
            view.tolerance_pixels = 1e-3;
            flight.update(&view, &mut || false).expect("a view");
            drawn(&flight).iter().filter(|t| part(centre(t))).count()
        };
        (once(&factors), once(&Factors::default()))
    };
    let (low, high) = (DVec3::new(96.0, -40.0, 8.0), DVec3::new(96.0, -40.0, 90.0));
    let off = Factors::default();
    let (with, without) = counts(Factors { fog: 40.0, ..off.clone() }, high, &|p| p.y > 0.6);
    assert!(4 * with < 3 * without, "fog hides the distance: {with}, {without} triangles there");
    let (with, without) = counts(Factors { back_faces: 0.05, ..off.clone() }, low, &|p| p.y > 0.53 && p.y < 0.6);
    assert!(with < without, "what faces away: {with}, {without}");
    let (with, without) = counts(Factors { silhouettes: 20.0, ..off.clone() }, high, &|p| p.y > 0.5 && p.y < 0.6);
    assert!(with > without, "the ridge is a silhouette: {with}, {without}");
    let (with, without) = counts(Factors { lighting: 3.0, ..off.clone() }, high, &|p| (p.y - 0.5).abs() < 0.1);
    assert!(with > without, "the hills' slopes differ most: {with}, {without}");
    let centre = land.origin() + DVec2::new(150.0, 100.0);
    let disc = Disc { centre, radius: 12.0, factor: 50.0 };
    let near = |p: DVec2| (land.origin() + p * land.extent()).distance(centre) < 15.0;
    let (with, without) = counts(Factors { objects: vec![disc], ..off }, high, &near);
    assert!(with > without, "a thing stands there: {with}, {without}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    /// Whatever was seen before, the mesh is that of Algorithm I, and so is its worst triangle; and the work is what changed.
    #[test]
    fn every_frame_is_as_good_as_from_scratch(
        side in (2usize..20, 2usize..20),
        heights in prop::collection::vec(prop_oneof![9 => 0f32..60.0, 1 => Just(f32::NAN)], 400),
        holes in any::<bool>(),
        flat in any::<bool>(),
        budget in prop_oneof![2usize..300, Just(100_000)],
        tolerance in 0.3f32..40.0,
        views in prop::collection::vec(((-0.5f64..1.5, -0.5f64..1.5, -20f64..120.0), (0f64..6.3, -1.5f64..0.5)), 1..6),
        distance in any::<bool>(),
        factors in prop_oneof![Just(None), factors().prop_map(Some)],
        stops in any::<bool>(),
    ) {
        let (columns, rows) = side;
        let filled = |h: &f32| if flat { 7.0 } else if h.is_nan() && !holes { 0.0 } else { *h };
        let heights: Vec<f32> = heights.iter().map(filled).take(columns * rows).collect();
        let land = land(columns, rows, &heights);
        let bounds = NestedBounds::of(&land).expect("few samples");
        let bounds = if factors.is_some() { bounds.with_slopes() } else { bounds };
        let mut flight = RoamFlight::over(&bounds, Limits { finest: 30, triangles: budget });
        if distance {
            flight.priority = Priority::InverseDistance;
        }
        flight.factors = factors.unwrap_or_default();
        for ((u, v, up), (yaw, pitch)) in views {
            let eye = (land.origin() + land.extent() * DVec2::new(u, v)).extend(up);
            let ahead = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
            let mut view = View::looking_at(eye, eye + ahead, 1.0, UVec2::new(320, 200));
            view.tolerance_pixels = tolerance;
            if stops {
                // What a stopped frame leaves undone is done by the next.
                flight.update(&view, &mut || true).expect("a view");
            }
            let before = (split_set(&flight), flight.operations());
            let reached = flight.update(&view, &mut || false).expect("a view");
            let (triangles, worst) = algorithm_one(&flight);
            prop_assert!(nested(&flight));
            for part in [DVec2::new(0.0, 0.0), DVec2::new(0.3, 0.1), DVec2::new(u.abs().fract(), v.abs().fract())] {
                let place = Place { face: 0, uv: part };
                let point = part * f64::from(STEPS);
                let within = |t: &[Point; 3]| {
                    let [a, b, c] = t.map(|p| DVec2::new(f64::from(p[0]), f64::from(p[1])));
                    [(a, b), (b, c), (c, a)].into_iter().all(|(a, b)| (b - a).perp_dot(point - a) >= 0.0)
                };
                match flight.triangle_at(place) {
                    Some(found) => prop_assert!(within(&found.map(|v| [v.x, v.y]))),
                    // On an edge the triangle beyond may be void.
                    None => prop_assert!(triangles.iter().filter(|t| within(t)).count() == 0 || part.x == 0.0),
                }
            }
            prop_assert_eq!(drawn(&flight), triangles);
            let mut once = RoamOnce::over(&bounds, flight.limits);
            once.priority = flight.priority;
            once.factors = flight.factors.clone();
            let mut mesh = Mesh::default();
            prop_assert_eq!(once.draw(&view, &mut mesh).expect("a view"), reached);
            prop_assert_eq!(mesh.triangles.len(), flight.mesh.triangles.len());
            prop_assert_eq!(drawn_of(&mesh), drawn(&flight));
            if reached.pixels.is_finite() {
                prop_assert_eq!(reached.pixels, worst);
            }
            // From scratch thresholds may overshoot; from frame to frame only what the border passes over twice is done twice.
            let changed = before.0.symmetric_difference(&split_set(&flight)).count() as u64;
            let done = flight.operations().0 + flight.operations().1 - before.1.0 - before.1.1;
            prop_assert!(done >= changed);
            if before.1.0 > 0 {
                prop_assert!(done <= changed + 8, "{} steps for {} changes", done, changed);
            }
        }
    }
}

/// The triangles of the mesh whose split diamonds these are.
fn leaves<G: Ground>(flight: &RoamFlight<'_, G>, split: &BTreeSet<Point>) -> BTreeSet<[Point; 3]> {
    let mut all = BTreeSet::new();
    let mut add = |diamond: Diamond, side: usize, apex: Point| {
        if !split.contains(&diamond.at) && flight.bounds.bound(diamond).whole(side) {
            all.insert(turned(diamond.triangle(apex)));
        }
    };
    for (side, apex) in Diamond::ROOT.apexes().into_iter().enumerate() {
        add(Diamond::ROOT, side, apex.expect("a root has both"));
    }
    for &at in split {
        for child in Diamond::at(at).children().into_iter().flatten() {
            let side = child.apexes().iter().position(|apex| *apex == Some(at)).expect("a parent");
            add(child, side, at);
        }
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    /// Where priorities are old the mesh has no gaps, and when all are known it is that of Algorithm I.
    #[test]
    fn deferred_groups_catch_up(
        heights in prop::collection::vec(prop_oneof![19 => 0f32..60.0, 1 => Just(f32::NAN)], 17 * 17),
        groups in 2u32..7,
        budget in prop_oneof![2usize..300, Just(100_000)],
        tolerance in 0.3f32..20.0,
        views in prop::collection::vec(((-0.5f64..1.5, -0.5f64..1.5, -20f64..120.0), (0f64..6.3, -1.5f64..0.5)), 2..9),
    ) {
        let land = land(17, 17, &heights);
        let bounds = NestedBounds::of(&land).expect("few samples");
        let mut flight = RoamFlight::over(&bounds, Limits { finest: 30, triangles: budget });
        flight.groups = groups;
        let last = views.len() - 1;
        for (i, ((u, v, up), (yaw, pitch))) in views.into_iter().enumerate() {
            let eye = (land.origin() + land.extent() * DVec2::new(u, v)).extend(up);
            let ahead = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
            let mut view = View::looking_at(eye, eye + ahead, 1.0, UVec2::new(320, 200));
            view.tolerance_pixels = tolerance;
            for _ in 0..if i == last { 4 * groups + 4 } else { 1 } {
                flight.update(&view, &mut || false).expect("a view");
                let split = split_set(&flight);
                prop_assert!(split.iter().all(|&at| Diamond::at(at).parents().iter().flatten().all(|p| split.contains(&p.at))));
                prop_assert_eq!(drawn(&flight), leaves(&flight, &split));
                prop_assert!(flight.triangles() <= budget.max(2));
            }
        }
        prop_assert_eq!(drawn(&flight), algorithm_one(&flight).0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    /// Over a sea, too, whatever was seen before, and when.
    #[test]
    fn every_frame_over_a_sea_is_as_good_as_from_scratch(
        size in (300f64..3000.0, 300f64..3000.0),
        wind in 2f64..20.0,
        finest in 1u8..6,
        budget in prop_oneof![2usize..300, Just(100_000)],
        tolerance in 0.3f32..40.0,
        views in prop::collection::vec(((-0.5f64..1.5, -0.5f64..1.5, -20f64..120.0), (0f64..6.3, -1.5f64..0.5), -500f64..500.0), 1..6),
        distance in any::<bool>(),
        fog in prop_oneof![Just(f32::INFINITY), 30f32..900.0],
    ) {
        let (origin, size) = (DVec2::new(-4e5, 9e4), DVec2::new(size.0, size.1));
        let waves = Superposition::of_state(&SeaState::of_wind(wind, 1.0, 2e5).expect("a wind"), 4, 3).expect("a sea");
        let mut sea = Sea::new(Datum::Plane { origin, size }, 12.0).with(Box::new(waves));
        let mut flight = RoamSea::new(Limits { finest, triangles: budget }).with_lateness(0.0);
        if distance {
            flight.priority = Priority::InverseDistance;
        }
        flight.factors.fog = fog;
        for ((u, v, up), (yaw, pitch), time) in views {
            let eye = (origin + size * DVec2::new(u, v)).extend(up);
            let ahead = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
            let mut view = View::looking_at(eye, eye + ahead, 1.0, UVec2::new(320, 200));
            view.tolerance_pixels = tolerance;
            sea.set_time(time);
            let reached = flight.update(&sea, &view, &mut || false).expect("a view");
            prop_assert!(nested(&flight));
            let (triangles, worst) = algorithm_one(&flight);
            prop_assert_eq!(drawn(&flight), triangles);
            prop_assert_eq!(reached.pixels, worst);
        }
    }
}

/// A frame that is stopped is whole, and no step is lost.
#[test]
fn stopped_frames_catch_up() {
    let heights: Vec<f32> = (0..65 * 65).map(|i| ((i * 7919) % 101) as f32).collect();
    let land = land(65, 65, &heights);
    let bounds = NestedBounds::of(&land).expect("few samples");
    let mut flight = RoamFlight::over(&bounds, Limits { finest: 30, triangles: 1_500 });
    let look = |x: f64| {
        let mut view =
            View::looking_at(DVec3::new(x, -60.0, 130.0), DVec3::new(x, 20.0, 50.0), 1.0, UVec2::new(320, 200));
        view.tolerance_pixels = 0.5;
        view
    };
    flight.update(&look(-60.0), &mut || false).expect("a view");
    let mut worst = f32::INFINITY;
    for frame in 0..100 {
        let mut asked = 0;
        let mut stop = || {
            asked += 1;
            asked > 2
        };
        let before = flight.operations();
        let reached = flight.update(&look(60.0), &mut stop).expect("a view");
        assert!(flight.triangles() <= 1_500, "frame {frame}");
        let done = flight.operations().0 + flight.operations().1 - before.0 - before.1;
        assert!(done <= 3 * 16, "frame {frame}: {done} steps after it was told to stop");
        let area = |[a, b, c]: [Point; 3]| {
            let [a, b, c] = [a, b, c].map(|p| p.map(i64::from));
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let covered: i64 = drawn(&flight).into_iter().map(area).sum();
        assert_eq!(covered, 2 << 60, "frame {frame} is whole");
        worst = reached.pixels;
        if asked <= 2 {
            break;
        }
        assert!(reached.limited && frame < 99, "it never ends");
    }
    let (triangles, best) = algorithm_one(&flight);
    assert_eq!(drawn(&flight), triangles);
    assert_eq!(worst, best);
}
