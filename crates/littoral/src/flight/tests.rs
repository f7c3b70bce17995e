use super::*;

const ALL: [Interpolation; 3] = [Interpolation::Straight, Interpolation::CatmullRom, Interpolation::Smooth];

fn flat(_: DVec2) -> Option<f64> {
    Some(0.0)
}

/// Steep hills and a needle one metre wide.
fn hills(p: DVec2) -> Option<f64> {
    let needle = if (p - DVec2::new(1500.0, 320.0)).length() < 1.0 { 900.0 } else { 0.0 };
    Some(300.0 * (p.x / 170.0).sin() * (p.y / 230.0).cos() + 100.0 + needle)
}

fn waypoint(x: f64, y: f64, level: Level) -> Waypoint {
    Waypoint { spot: Spot { xy: DVec2::new(x, y), level }, look: Look::Ahead { pitch: None } }
}

/// A bent path with short and long pieces.
fn bent(interpolation: Interpolation, closed: bool) -> FlightPath {
    let points = [
        (0.0, 0.0, 600.0),
        (500.0, 40.0, 620.0),
        (560.0, 400.0, 700.0),
        (2000.0, 700.0, 900.0),
        (2500.0, -900.0, 500.0),
    ];
    FlightPath {
        points: points.iter().map(|&(x, y, z)| waypoint(x, y, Level::Absolute(z))).collect(),
        interpolation,
        closed,
        ease: 0.0,
        ..FlightPath::default()
    }
}

/// The time at which a flight is nearest to a point, and how near (m).
fn nearest(flight: &Flight<'_>, point: DVec3) -> f64 {
    let off = |t: f64| flight.pose(t).position.distance(point);
    let coarse =
        (0..=20_000).map(|i| flight.duration() * f64::from(i) / 20_000.0).min_by(|a, b| off(*a).total_cmp(&off(*b)));
    let (mut best, mut step) = (coarse.expect("not empty"), flight.duration() / 20_000.0);
    while step > 1e-9 {
        best = [best - step, best, best + step].into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b))).expect("three");
        step *= 0.5;
    }
    off(best)
}

#[test]
fn every_interpolation_passes_through_its_points() {
    for interpolation in ALL {
        for closed in [false, true] {
            let path = bent(interpolation, closed);
            let flight = path.over(&flat).expect("a flight");
            for point in &path.points {
                let Level::Absolute(z) = point.spot.level else { unreachable!() };
                let off = nearest(&flight, point.spot.xy.extend(z));
                assert!(off < 1e-5, "{interpolation:?}, closed {closed}: {off} m off {point:?}");
            }
            let last = if closed { path.points[0] } else { path.points[4] };
            assert!(flight.pose(flight.duration() - 1e-12).position.truncate().distance(last.spot.xy) < 1e-6);
        }
    }
}

#[test]
fn continuity_is_what_the_interpolation_promises() {
    // One-sided differences at each inner knot, by the curve's own parameter.
    for closed in [false, true] {
        for (interpolation, smooth) in
            [(Interpolation::Straight, 0), (Interpolation::CatmullRom, 1), (Interpolation::Smooth, 2)]
        {
            let flight = bent(interpolation, closed).over(&flat).expect("a flight");
            let curve = &flight.curve;
            let mut knots: Vec<(f64, f64)> = curve.knots[1..curve.pieces.len()].iter().map(|&k| (k, k)).collect();
            if closed {
                knots.push((curve.end(), 0.0));
            }
            let (mut broken_tangents, mut broken_curvatures) = (0, 0);
            for (before, after) in knots {
                let e = 1e-5;
                assert!(curve.position(before - 1e-9).distance(curve.position(after + 1e-9)) < 1e-6, "no jumps");
                let (d0, d1) = (curve.derivative(before - 1e-9), curve.derivative(after + 1e-9));
                let second = |a: f64, b: f64| (curve.derivative(b) - curve.derivative(a)) / e;
                let (c0, c1) = (second(before - 1e-9 - e, before - 1e-9), second(after + 1e-9, after + 1e-9 + e));
                broken_tangents += usize::from(d0.distance(d1) > 1e-4 * d0.length());
                broken_curvatures += usize::from(c0.distance(c1) > 1e-3 * (c0.length() + 1.0));
            }
            assert_eq!(broken_tangents == 0, smooth >= 1, "{interpolation:?}, closed {closed}");
            if smooth >= 1 {
                assert_eq!(broken_curvatures == 0, smooth == 2, "{interpolation:?}, closed {closed}");
            }
        }
    }
}

#[test]
fn a_natural_spline_has_straight_ends_and_reproduces_lines() {
    let mut path = bent(Interpolation::Smooth, false);
    let flight = path.over(&flat).expect("a flight");
    let first = flight.curve.pieces[0][2];
    assert!(first.length() < 1e-9, "curvature at the open end: {first}");
    for (i, point) in path.points.iter_mut().enumerate() {
        *point = waypoint(100.0 * (i * i) as f64, 50.0 * (i * i) as f64, Level::Absolute(700.0));
    }
    let line = path.over(&flat).expect("a flight");
    assert!((line.length() - DVec2::new(1600.0, 800.0).length()).abs() < 1e-6);
}

/// Greatest relative deviation from the wanted speed, measured over a millisecond at many times.
fn unevenness(flight: &Flight<'_>, corners: usize) -> f64 {
    let (speed, tiny) = (flight.length() / flight.duration(), 1e-3);
    let off = |i: i32| {
        let time = (flight.duration() - tiny) * f64::from(i) / 4000.0;
        let way = flight.pose(time).position.distance(flight.pose(time + tiny).position);
        (way / (speed * tiny) - 1.0).abs()
    };
    let mut off: Vec<f64> = (0..=4000).map(off).collect();
    off.sort_by(f64::total_cmp);
    // A step that cuts a corner is shorter than the way it goes.
    off[off.len() - 1 - corners]
}

#[test]
fn speed_is_constant_to_a_ten_thousandth() {
    for interpolation in ALL {
        for closed in [false, true] {
            let flight = bent(interpolation, closed).over(&flat).expect("a flight");
            let off = unevenness(&flight, if interpolation == Interpolation::Straight { 5 } else { 0 });
            assert!(off < 1e-4, "{interpolation:?}, closed {closed}: speed off by {off}");
            assert!((flight.length() / flight.duration() - 60.0).abs() < 1e-9);
        }
    }
}

#[test]
fn easing_starts_and_ends_at_rest_and_keeps_total_time() {
    let mut path = bent(Interpolation::Smooth, false);
    (path.pace, path.ease) = (Pace::Duration(30.0), 3.0);
    let flight = path.over(&flat).expect("a flight");
    assert_eq!(flight.duration(), 30.0);
    assert_eq!([flight.distance(0.0), flight.distance(30.0)], [0.0, flight.length()]);
    assert!(flight.distance(0.03) < 1e-4 * flight.length() && flight.distance(29.97) > 0.9999 * flight.length());
    let cruise = (flight.distance(20.0) - flight.distance(10.0)) / 10.0;
    assert!((cruise - flight.length() / 27.0).abs() < 1e-9);
    let slope = |t: f64| (flight.distance(t + 1e-4) - flight.distance(t - 1e-4)) / 2e-4;
    for t in [3.0, 27.0] {
        assert!((slope(t) - cruise).abs() < 1e-3 * cruise, "speed has no step at {t} s");
    }
    (path.pace, path.ease) = (Pace::Speed(100.0), 4.0);
    let flight = path.over(&flat).expect("a flight");
    assert!((flight.duration() - (flight.length() / 100.0 + 4.0)).abs() < 1e-9);
}

#[test]
fn relative_points_follow_the_ground() {
    let path = FlightPath {
        points: (0..5).map(|i| waypoint(400.0 * f64::from(i), 100.0, Level::AboveGround(2000.0))).collect(),
        ..FlightPath::default()
    };
    let raised = |p: DVec2| hills(p).map(|h| h + 123.0);
    let (low, high) = (path.over(&hills).expect("a flight"), path.over(&raised).expect("a flight"));
    for i in 0..50 {
        let t = low.duration() * f64::from(i) / 50.0;
        let (a, b) = (low.pose(t).position, high.pose(t).position);
        assert!((b - a - DVec3::Z * 123.0).length() < 1e-6, "{a} {b}");
    }
    let ground = hills(DVec2::new(400.0, 100.0)).expect("ground");
    assert!(nearest(&low, DVec3::new(400.0, 100.0, ground + 2000.0)) < 1e-5);
}

#[test]
fn never_below_the_ground_even_between_points_and_over_needles() {
    for interpolation in ALL {
        for level in [Level::AboveGround(5.0), Level::Absolute(120.0)] {
            let mut path = FlightPath { interpolation, clearance: 15.0, ..FlightPath::default() };
            path.points = [(0.0, 0.0), (900.0, 300.0), (2000.0, 340.0), (3000.0, 100.0)]
                .map(|(x, y)| waypoint(x, y, level))
                .into();
            let flight = path.over(&hills).expect("a flight");
            for i in 0..=50_000 {
                let p = flight.pose(flight.duration() * f64::from(i) / 50_000.0).position;
                let ground = hills(p.truncate()).expect("ground everywhere");
                assert!(p.z >= ground + 15.0 - 1e-9, "{interpolation:?}: {} m over ground", p.z - ground);
            }
        }
    }
}

#[test]
fn the_lift_alone_clears_smooth_ground_and_is_itself_smooth() {
    let ground = |p: DVec2| Some(400.0 * (-(p.x - 1000.0).powi(2) / 60_000.0).exp());
    let path = FlightPath {
        points: vec![waypoint(0.0, 0.0, Level::Absolute(50.0)), waypoint(2000.0, 0.0, Level::Absolute(50.0))],
        ease: 0.0,
        clearance: 10.0,
        ..FlightPath::default()
    };
    let flight = path.over(&ground).expect("a flight");
    let step = flight.duration() / 4000.0;
    let mut slopes = Vec::new();
    for i in 0..4000 {
        let at = flight.curve.end() * f64::from(i) / 4000.0;
        let p = flight.on_curve(at);
        assert!(p.z >= ground(p.truncate()).expect("ground") + 10.0 - 1e-6, "without the last comparison");
        let (a, b) = (flight.pose(f64::from(i) * step).position, flight.pose(f64::from(i + 1) * step).position);
        slopes.push((b.z - a.z) / step);
    }
    let jerkiest = slopes.windows(2).map(|s| (s[1] - s[0]).abs()).fold(0.0, f64::max);
    // A hard maximum would jump by tens of m/s at once where the hill begins.
    assert!(jerkiest < 0.5, "vertical speed jumps by {jerkiest} m/s within {step} s");
    assert!(flight.pose(0.0).position.z < 50.0 + 1e-9, "untouched far from the hill");
    assert!(unevenness(&flight, 0) < 1e-3);
}

#[test]
fn the_camera_looks_where_it_is_told() {
    let mut path = bent(Interpolation::Smooth, false);
    let target = DVec3::new(1000.0, 5000.0, 77.0);
    let at = Look::At(Spot { xy: target.truncate(), level: Level::AboveGround(77.0) });
    for point in &mut path.points {
        point.look = at;
    }
    path.points[4].look = Look::Heading { bearing: 0.5 * PI, pitch: -0.3 };
    let flight = path.over(&flat).expect("a flight");
    let three_quarters = flight.lengths.table.iter().find(|e| e.0 >= flight.curve.knots[3]).expect("a knot").1 / 60.0;
    for i in 0..100 {
        let pose = flight.pose(three_quarters * f64::from(i) / 100.0);
        assert!(pose.direction.dot((target - pose.position).normalize()) > 1.0 - 1e-9);
    }
    let end = flight.pose(flight.duration()).direction;
    assert!(end.distance(DVec3::new(0.3f64.cos(), 0.0, -(0.3f64.sin()))) < 1e-9, "east and down, got {end}");
    let mut last = flight.pose(0.0).direction;
    for i in 0..=5000 {
        let next = flight.pose(flight.duration() * f64::from(i) / 5000.0).direction;
        assert!((next.length() - 1.0).abs() < 1e-9 && next.dot(last) > 0.9999, "no snapping of the camera");
        last = next;
    }
}

#[test]
fn looking_ahead_turns_corners_without_a_snap() {
    let mut path = bent(Interpolation::Straight, false);
    for point in &mut path.points {
        point.look = Look::Ahead { pitch: Some(-0.2) };
    }
    let flight = path.over(&flat).expect("a flight");
    let frames = (flight.duration() * 60.0) as i32;
    let mut last = flight.pose(0.0).direction;
    for i in 1..=frames {
        let next = flight.pose(f64::from(i) / 60.0).direction;
        assert!((next.z - (-0.2f64).sin()).abs() < 1e-9);
        assert!(next.dot(last) > 5f64.to_radians().cos(), "turned too fast at frame {i}");
        last = next;
    }
}

#[test]
fn opposite_looks_turn_through_the_horizon() {
    for share in [0.0, 0.3, 0.5, 0.8, 1.0] {
        let d = turned(DVec3::X, -DVec3::X, share);
        assert!(d.z.abs() < 1e-9 || share == 0.0, "{d}");
        assert!((d.length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn an_orbit_is_a_circle() {
    let centre = DVec3::new(100.0, -50.0, 30.0);
    let flight = FlightPath::orbit(centre, 1000.0, 400.0, 20.0)
        .over(&flat)
        .map(|f| (0..100).map(|i| f.pose(f64::from(i) * 0.2)).collect::<Vec<_>>());
    for pose in flight.expect("a flight") {
        let off = pose.position - centre;
        assert!((off.truncate().length() - 1000.0).abs() < 0.5, "radius {}", off.truncate().length());
        assert!((off.z - 400.0).abs() < 1e-9);
        assert!(pose.direction.dot(-off.normalize()) > 1.0 - 1e-9);
    }
    let start = FlightPath::orbit(centre, 1000.0, 400.0, 20.0);
    let start = start.over(&flat).expect("a flight").pose(0.0).position;
    assert!(start.distance(DVec3::new(100.0, -1050.0, 430.0)) < 1e-6, "starts in the south");
}

#[test]
fn impossible_paths_say_why() {
    let message = |path: &FlightPath, ground: Ground<'_>| {
        path.over(ground).map(|f| f.duration()).expect_err("no flight").to_string()
    };
    let mut path = bent(Interpolation::Smooth, false);
    path.points.truncate(1);
    assert!(message(&path, &flat).contains("at least 2 points, got 1"));
    path = bent(Interpolation::Smooth, false);
    path.points[3] = path.points[2];
    assert!(message(&path, &flat).contains("points 3 and 4"));
    path = bent(Interpolation::Smooth, true);
    path.points.push(path.points[0]);
    assert!(message(&path, &flat).contains("points 6 and 1"));
    path = bent(Interpolation::Smooth, false);
    path.points[1].spot.level = Level::AboveGround(1.0);
    assert!(message(&path, &|_| None).contains("point 2: expected ground"));
    path = bent(Interpolation::Smooth, false);
    path.pace = Pace::Speed(0.0);
    assert!(message(&path, &flat).contains("positive speed"));
    path = bent(Interpolation::Smooth, false);
    path.points[2].spot.xy.x = f64::NAN;
    assert!(message(&path, &flat).contains("point 3"));
    path = bent(Interpolation::Smooth, false);
    path.ease = -1.0;
    assert!(message(&path, &flat).contains("ease"));
}
