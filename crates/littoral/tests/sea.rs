//! The sea as a whole: one function for pictures and queries, the same bits in bulk and one by one.

use glam::{DVec2, DVec3, UVec2, Vec3};
use littoral::field::{HeightField, Land, Raster, Sea, Surface, Water, coast};
use littoral::picture::{Scene, Settings, Sun, render};
use littoral::space::{Cell, Datum, Place, View};
use littoral::waves::{Length, SeaState, Sine, Sines, StillWater, Superposition, components};

/// A sea of long waves only, so that a picture shows all of them.
fn long_waves(seed: u64) -> Superposition {
    let state = SeaState { seed, ..SeaState::of_wind(16.0, 0.6, 4e5).expect("a wind") };
    let peak = state.peak().expect("waves");
    Superposition::new(&components::drawn(&state, 40, 0.6 * peak, 1.6 * peak), StillWater::DEEP).expect("a sea")
}

fn datum() -> Datum {
    Datum::Plane { origin: DVec2::new(-400.0, 300.0), size: DVec2::new(1200.0, 900.0) }
}

/// A flat bed far below.
fn bed() -> Land {
    let raster = Raster::new(13, 10, DVec2::splat(100.0), vec![-60.0; 130]).expect("a bed");
    Land::at(raster, DVec2::new(-400.0, 300.0))
}

fn unit(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as f64 / (1u64 << 31) as f64
}

#[test]
fn what_is_seen_is_what_is_asked() {
    let land = bed();
    let water = Water::flood(&land, 1.5).expect("wet");
    let mut sea = Sea::new(datum(), 1.5).with(Box::new(long_waves(4)));
    sea.set_time(37.25);
    let (mut compared, mut worst) = (0, 0.0f64);
    for (eye, look) in [
        (DVec3::new(-100.0, 350.0, 22.0), DVec3::new(300.0, 700.0, 0.0)),
        (DVec3::new(500.0, 800.0, 60.0), DVec3::new(100.0, 500.0, 0.0)),
        (DVec3::new(200.0, 900.0, 300.0), DVec3::new(200.0, 700.0, 0.0)),
    ] {
        let view = View::looking_at(eye, look, 0.4, UVec2::new(120, 80));
        let scene = Scene { sea: Some(&sea), sun: Sun::new(4.0, 0.5), ..Scene::new(&land, Some(&water)) };
        let picture = render(&scene, &view, &Settings { samples: 1, ..Settings::default() }, &|_| {});
        for (k, position) in picture.position.iter().enumerate() {
            let place = eye + DVec3::from_array(position.map(f64::from));
            let grazing = f64::from(position[2].abs()) / f64::from(picture.depth[k]);
            // Where pixels are wider than a fifth of the shortest wave it is not all there to be seen.
            if !picture.depth[k].is_finite() || f64::from(picture.depth[k]) * 0.005 / grazing.sqrt() > 14.0 {
                continue;
            }
            let (low, high) = (land.origin(), land.origin() + land.extent());
            if place.truncate().cmplt(low).any() || place.truncate().cmpgt(high).any() {
                continue;
            }
            compared += 1;
            worst = worst.max((place.z - sea.height_at(place.truncate())).abs());
            // The ray through the pixel meets that very point.
            let ahead = view.direction(glam::Vec2::new((k % 120) as f32 + 0.5, (k / 120) as f32 + 0.5));
            let off = (place - eye).as_vec3().normalize().dot(ahead).clamp(-1.0, 1.0).acos();
            assert!(off < 2e-3, "pixel {k}: {off} rad off its ray");
            let normal = Vec3::from_array(picture.normal[k]);
            let asked = sea.surface_at(place.truncate(), 0.0).normal();
            assert!((normal - asked).length() < 2e-3, "{normal} for {asked}");
        }
    }
    assert!(compared > 10_000, "only {compared} points");
    // f32 positions from the eye: a few hundredths of a millimetre; the rest is where rounding moves the place along a slope.
    assert!(worst < 1e-3, "{worst} m between picture and query at {compared} points");
}

#[test]
fn in_bulk_as_one_by_one() {
    let mut sea = Sea::new(datum(), -3.0).with(Box::new(long_waves(1))).with(Box::new(long_waves(2)));
    sea.set_time(-12.5);
    let mut seed = 7;
    let places: Vec<DVec2> = (0..531).map(|_| DVec2::new(unit(&mut seed) * 4e4 - 2e4, unit(&mut seed) * 4e4)).collect();
    let mut heights = vec![0.0; places.len()];
    sea.heights_at(&places, &mut heights);
    let blank = sea.surface_at(DVec2::ZERO, 0.0);
    let mut surfaces = vec![blank; places.len()];
    sea.surfaces_at(&places, 0.0, &mut surfaces);
    let points: Vec<DVec3> = places.iter().map(|p| p.extend(-8.0)).collect();
    let mut velocities = vec![Vec3::ZERO; places.len()];
    sea.velocities_at(&points, &mut velocities);
    for (i, place) in places.iter().enumerate() {
        assert_eq!(heights[i].to_bits(), sea.height_at(*place).to_bits());
        let one: Surface = sea.surface_at(*place, 0.0);
        assert_eq!(surfaces[i], one);
        assert_eq!(one.height.to_bits(), heights[i].to_bits());
        assert!(one.residual <= Sea::TOLERANCE);
        assert_eq!(velocities[i], sea.velocity_at(points[i]));
    }
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let mut serial = vec![0.0; places.len()];
    alone.install(|| sea.heights_at(&places, &mut serial));
    assert!(serial.iter().zip(&heights).all(|(a, b)| a.to_bits() == b.to_bits()));
    // Elsewhere in time and back.
    let before = heights.clone();
    sea.set_time(1e5);
    sea.heights_at(&places, &mut heights);
    assert!(heights.iter().zip(&before).any(|(a, b)| (a - b).abs() > 0.1), "the sea stands still");
    sea.set_time(-12.5);
    sea.heights_at(&places, &mut heights);
    assert_eq!(heights, before);
}

#[test]
fn nothing_is_nan_at_nonsense() {
    let mut sea = Sea::new(datum(), 0.0).with(Box::new(long_waves(3)));
    for time in [0.0, -1e9, 1e12, f64::NAN, f64::INFINITY] {
        sea.set_time(time);
        for at in [DVec2::ZERO, DVec2::splat(1e9), DVec2::new(-1e15, 3.0), DVec2::NAN, DVec2::splat(f64::INFINITY)] {
            assert!(sea.height_at(at).is_finite(), "{at} at {time}");
            assert!(sea.velocity_at(at.extend(-1.0)).is_finite(), "{at} at {time}");
            assert!(sea.surface_at(at, 1.0).slope.is_finite(), "{at} at {time}");
        }
    }
}

#[test]
fn still_water_is_level() {
    let sea = Sea::new(datum(), 2.25);
    assert_eq!(sea.height_at(DVec2::new(5.0, -7.0)), 2.25);
    assert_eq!(sea.height(Place { face: 0, uv: DVec2::splat(0.3) }), Some(2.25));
    assert!(sea.error(Cell::face(0)) < 1e-4);
    let range = sea.range(Cell::face(0));
    assert!(range.contains(2.25) && range.high - range.low < 1e-3);
}

/// A beach on one side, from dry land to deep water, a few metres of it too shallow for any wave.
fn beach() -> Land {
    let heights = (0..48 * 40).map(|i| 3.0 - 0.02 * ((i % 48) as f32).powi(2)).collect();
    Land::at(Raster::new(48, 40, DVec2::splat(12.0), heights).expect("a bed"), DVec2::ZERO)
}

#[test]
fn waves_that_break_early_are_lower_in_the_surf_and_no_lower_beyond() {
    let land = beach();
    let water = Water::flood(&land, 0.0).expect("wet");
    // The root of the mean square (m) along the shore now and then, where the water is 2.6 m deep, and where it is 29 m.
    let heights = |spec: &str| {
        let mut sea = Sea::over(&land, &water, &spec.parse().expect("a state"), &|_| true).expect("a sea");
        let mut squares = [0.0; 2];
        for i in 0..60 {
            sea.set_time(f64::from(i) * 17.0);
            for (square, x) in squares.iter_mut().zip([200.0, 480.0]) {
                *square +=
                    (0..8).map(|k| sea.height_at(DVec2::new(x, 60.0 + 50.0 * f64::from(k))).powi(2)).sum::<f64>();
            }
        }
        squares.map(|square| (square / 480.0).sqrt())
    };
    let ([near, far], [lower, as_far]) = (heights("hs=2,tp=9,from=90"), heights("hs=2,tp=9,from=90,breaking=0.4"));
    assert!(lower < 0.75 * near, "{lower} m for {near} m in the surf");
    assert!((as_far / far - 1.0).abs() < 0.05, "{as_far} m for {far} m beyond");
}

#[test]
fn a_bed_takes_every_state() {
    let land = beach();
    let water = Water::flood(&land, 0.0).expect("wet");
    for number in 1..=12 {
        let state = SeaState::beaufort(f64::from(number), 3.0).expect("a number");
        let sea = Sea::over(&land, &water, &state, &|_| true).unwrap_or_else(|e| panic!("beaufort {number}: {e}"));
        for i in 0..40 {
            let at = DVec2::new(f64::from(i) * 17.0 - 60.0, 200.0);
            assert!(sea.height_at(at).abs() < 2.5 * state.significant_height().max(0.2), "beaufort {number} at {at}");
        }
    }
    assert!(Sea::over(&land, &water, &SeaState::CALM, &|_| true).expect("calm").height_at(DVec2::ONE) == 0.0);
    // Where rounding once left waves higher within the bed than outside.
    let coast = coast::coast();
    let water = Water::flood(&coast, 0.0).expect("the sea");
    Sea::over(&coast, &water, &"beaufort=3".parse().expect("a state"), &|_| true).expect("a sea");
}

#[test]
fn no_height_changes_faster_than_is_said() {
    let places: Vec<DVec2> = (0..40_000).map(|i| DVec2::new(f64::from(i % 200), f64::from(i / 200)) * 3.7).collect();
    let sum =
        |seed| Superposition::of_state(&SeaState { seed, ..SeaState::beaufort(6.0, 0.3).expect("a number") }, 16, 8);
    let sine =
        |steepness: f64| Sine { amplitude: 0.8, length: Length::Wavelength(30.0), heading: 0.4, phase: 0.0, steepness };
    let sines = |steepness| Sines::new(&[sine(steepness)], StillWater::DEEP).expect("waves");
    let sea = || Sea::new(datum(), 3.0);
    let still = sea();
    assert_eq!(still.rise_speed(), 0.0);
    let state = SeaState::beaufort(5.0, 0.3).expect("a number");
    // How much more may be said than is seen: waves of a sum may all meet, but do not here.
    for (name, mut sea, slack) in [
        ("one sine", sea().with(Box::new(sines(0.0))), 1.01),
        ("one trochoid", sea().with(Box::new(sines(0.5))), 1.5),
        ("128 waves", sea().with(Box::new(sum(1).expect("a sea"))), 7.0),
        ("tiles", Sea::of_state(datum(), 3.0, &state).expect("a sea"), 2.5),
    ] {
        let said = f64::from(sea.rise_speed());
        let (mut before, mut now) = (vec![0.0; places.len()], vec![0.0; places.len()]);
        let mut most = 0.0f64;
        for second in 0..10 {
            for (time, heights) in [(0.0, &mut before), (0.02, &mut now)] {
                sea.set_time(f64::from(second) + time);
                sea.heights_at(&places, heights);
            }
            most = before.iter().zip(&now).fold(most, |most, (a, b)| most.max((a - b).abs() / 0.02));
        }
        // Each height may be off by what the search for it leaves.
        assert!(most <= said + 0.06, "{name}: {most} m/s where {said} was said");
        assert!(said < slack * most, "{name}: {said} m/s said, {most} seen");
    }
}
