use super::*;

/// A slope that rises eastward out of a sea at 0: 1 m in 10.
fn slope(below: bool, test: impl FnOnce(&World)) {
    let ground = |at: DVec2| (at.x.abs() <= 5000.0).then_some(0.1 * at.x);
    let water = |at: DVec2| (at.x < 0.0).then_some(0.0);
    test(&World { ground: &ground, water: &water, bounds: [DVec2::splat(-5000.0), DVec2::splat(5000.0)], below });
}

fn flown(mut camera: Camera, hands: Hands, steps: u32, dt: f64) -> Camera {
    slope(false, |world| (0..steps).for_each(|_| camera.step(&hands, dt, world)));
    camera
}

#[test]
fn sixty_steps_are_thirty_twice_as_long() {
    let start = Camera::new(DVec3::new(300.0, 0.0, 200.0), DVec3::new(1.0, 2.0, -0.3));
    let hands = Hands { forward: 1.0, right: -0.4, up: 0.2, turn: 0.5, tilt: -0.1, fast: true };
    for mode in Mode::ALL {
        let mut camera = start.clone();
        slope(false, |world| camera.change(mode, Some(DVec3::new(-500.0, 50.0, 0.0)), world).expect("possible"));
        let (often, seldom) =
            (flown(camera.clone(), hands, 60, 1.0 / 60.0), flown(camera.clone(), hands, 30, 1.0 / 30.0));
        let way = (often.eye - camera.eye).length();
        assert!(way > 1.0, "{mode:?} moves: {way}");
        assert!((often.eye - seldom.eye).length() < 1e-6 * way, "{mode:?}: {} and {}", often.eye, seldom.eye);
        assert!((often.direction() - seldom.direction()).length() < 1e-9, "{mode:?}");
        // Steps that do not divide evenly come close.
        let odd = flown(camera.clone(), hands, 47, 1.0 / 47.0);
        assert!((often.eye - odd.eye).length() < 0.01 * way, "{mode:?}: {} and {}", often.eye, odd.eye);
    }
}

#[test]
fn flight_follows_the_look_and_is_faster_higher_up() {
    let way = |height: f64| {
        let start = Camera::new(DVec3::new(0.0, 0.0, height), DVec3::Y);
        let camera = flown(start.clone(), Hands { forward: 1.0, ..Hands::default() }, 60, 1.0 / 60.0);
        assert!((camera.eye - start.eye).normalize().dot(DVec3::Y) > 0.999_999);
        (camera.eye - start.eye).length()
    };
    // v = 0.7 h less what the start costs: τ (1 − e^(−1/τ)) of a second.
    let expected = |height: f64| 0.7 * height * (1.0 - 0.25 * (1.0 - (-4f64).exp()));
    assert!((way(1000.0) - expected(1000.0)).abs() < 1e-6 * way(1000.0));
    assert!((way(100.0) - expected(100.0)).abs() < 1e-6 * way(100.0));
}

#[test]
fn nobody_gets_below_the_surface_unasked() {
    let down = Hands { forward: 1.0, ..Hands::default() };
    for x in [-1000.0, 1000.0] {
        let start = Camera::new(DVec3::new(x, 0.0, 150.0), DVec3::new(0.2, 0.0, -1.0));
        let camera = flown(start.clone(), down, 600, 1.0 / 60.0);
        let surface = (0.1 * camera.eye.x).max(0.0);
        assert!((camera.eye.z - surface - CLEARANCE).abs() < 1e-9, "{}", camera.eye);
        let mut diver = start;
        slope(true, |world| (0..600).for_each(|_| diver.step(&down, 1.0 / 60.0, world)));
        assert!(diver.eye.z < 0.1 * diver.eye.x, "{}", diver.eye);
    }
}

#[test]
fn an_orbit_keeps_its_distance_and_its_look() {
    let mut camera = Camera::new(DVec3::new(1000.0, -900.0, 700.0), DVec3::Y);
    let centre = DVec3::new(1000.0, 0.0, 100.0);
    slope(false, |world| camera.change(Mode::Orbit, Some(centre), world).expect("possible"));
    let distance = (camera.eye - centre).length();
    let round = flown(camera.clone(), Hands { right: 1.0, ..Hands::default() }, 90, 1.0 / 30.0);
    assert!((round.eye - camera.eye).length() > 500.0);
    assert!(((round.eye - centre).length() - distance).abs() < 1e-6);
    assert!((round.direction() - (centre - round.eye).normalize()).length() < 1e-9);
    let nearer = flown(camera.clone(), Hands { forward: 1.0, ..Hands::default() }, 30, 1.0 / 30.0);
    assert!((nearer.eye - centre).length() < 0.7 * distance);
}

#[test]
fn walkers_stand_on_the_ground_and_stay_on_it() {
    let mut camera = Camera::new(DVec3::new(4990.0, 0.0, 2000.0), DVec3::X);
    slope(false, |world| camera.change(Mode::Walk, None, world).expect("possible"));
    assert!((camera.eye.z - 499.0 - TALL).abs() < 1e-9);
    let camera = flown(camera, Hands { forward: 1.0, ..Hands::default() }, 600, 1.0 / 30.0);
    assert!(camera.eye.x <= 5000.0 && camera.eye.x > 4999.0, "the data's edge stops one: {}", camera.eye);
    assert!((camera.eye.z - 0.1 * camera.eye.x - TALL).abs() < 1e-9);
}

#[test]
fn boats_float_lean_and_run_aground() {
    let mut camera = Camera::new(DVec3::new(-100.0, 0.0, 500.0), DVec3::X);
    slope(false, |world| camera.change(Mode::Boat, None, world).expect("possible"));
    let [bow, stern, port, starboard] = camera.boat.probes();
    assert!((bow - stern - DVec2::X * 6.0).length() < 1e-9, "the bow points east");
    assert!((port - starboard - DVec2::Y * 2.4).length() < 1e-9, "port lies north");
    // A swell's face: a metre higher at the bow, level abeam, 2 m above still water.
    camera.boat.float([2.5, 1.5, 2.0, 2.0]);
    slope(false, |world| (0..60).for_each(|_| camera.step(&Hands::default(), 1.0 / 30.0, world)));
    assert!((camera.eye.z - 2.0 - HELM).abs() < 1e-3, "{}", camera.eye);
    let size = UVec2::new(640, 360);
    let middle = |camera: &Camera| camera.view(0.8, size, 1.0).direction(0.5 * size.as_vec2());
    let pitch = camera.pitch;
    let up = f64::from(middle(&camera).z).asin() - pitch;
    assert!((up - (1f64 / 6.0).atan()).abs() < 1e-3, "the bow lifts the look: {up}");
    // Looking over the port side, the port side's height does.
    camera.look(DVec2::new(-FRAC_PI_2, 0.0));
    camera.boat.float([2.0, 2.0, 2.2, 1.8]);
    slope(false, |world| (0..60).for_each(|_| camera.step(&Hands::default(), 1.0 / 30.0, world)));
    let up = f64::from(middle(&camera).z).asin() - pitch;
    assert!((up - (0.4f64 / 2.4).atan()).abs() < 1e-3, "port side up: {up}");
    // Full ahead to the east ends where the water is as deep as the boat: 5 m off the shore.
    let camera = flown(camera, Hands { forward: 1.0, ..Hands::default() }, 6000, 1.0 / 60.0);
    assert!(camera.boat.at.x < -5.0 && camera.boat.at.x > -5.2 && camera.boat.speed < 0.1, "{:?}", camera.boat);
    // Without a steady hand the heights that are no numbers change nothing.
    let mut boat = camera.boat;
    boat.float([f64::NAN; 4]);
    assert_eq!(boat, camera.boat);
}

#[test]
fn where_nothing_carries_it_stays_what_it_was() {
    let dry =
        World { ground: &|_| Some(5.0), water: &|_| None, bounds: [DVec2::ZERO, DVec2::splat(10.0)], below: false };
    let mut camera = Camera::new(DVec3::new(1.0, 1.0, 50.0), DVec3::Y);
    let refused = camera.change(Mode::Boat, None, &dry).expect_err("no water");
    assert!(refused.contains("water"), "{refused}");
    assert_eq!(camera.mode(), Mode::Fly);
    let void = World { ground: &|_| None, ..dry };
    assert!(camera.change(Mode::Walk, None, &void).is_err());
}

#[test]
fn a_wider_view_holds_the_picture_at_the_same_scale() {
    let camera = Camera::new(DVec3::new(10.0, 20.0, 30.0), DVec3::new(1.0, 1.0, -0.5));
    let size = UVec2::new(640, 360);
    let (view, wide) = (camera.view(0.8, size, 1.0), camera.view(0.8, size, 1.25));
    assert!((view.pixels_per_radian / wide.pixels_per_radian - 1.0).abs() < 1e-4);
    assert_eq!(wide.size, UVec2::new(800, 450));
    let looking = View::looking_at(camera.eye, camera.eye + camera.direction(), 0.8, size);
    assert!(view.clip_from_eye.abs_diff_eq(looking.clip_from_eye, 1e-5));
}
