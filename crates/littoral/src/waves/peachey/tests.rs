use super::kernel::{self, profile, profile_steepness};
use super::*;

/// A number and its derivatives eastward and northward.
type Jet = [f64; 3];

/// A train at a point, by the formula.
struct Here {
    /// With those of the deep, but not the instant's.
    cycles: Jet,
    amplitude: Jet,
    shore: Jet,
    wavenumber: Jet,
    depth: f64,
}

/// The sum over all nodes of the bed that weigh anything, each with its own B-spline, all in `f64`.
fn at(waves: &Peachey, train: &Train, x: f64, y: f64) -> Here {
    let beyond = DVec2::new(x, y) - waves.origin;
    // Basis and its derivative at a distance in spacings.
    let spline = |t: f64| match t.abs() {
        near if near <= 0.5 => [0.75 - t * t, -2.0 * t],
        near if near <= 1.5 => [0.5 * (1.5 - near).powi(2), -(1.5 - near) * t.signum()],
        _ => [0.0; 2],
    };
    let weights = |place: f64, count: usize| -> Vec<(usize, [f64; 2])> {
        let place = place.clamp(-2.0, count as f64 + 1.0);
        let first = place.round() as i64 - 2;
        (first..first + 5)
            .map(|node| (node.clamp(0, count as i64 - 1) as usize, spline(place - node as f64)))
            .map(|(node, [of, by])| (node, [of, by / waves.spacing]))
            .collect()
    };
    let columns = weights(beyond.x / waves.spacing, waves.columns);
    let mut sums = [[0.0; 3]; 5];
    for (row, [up, up_by]) in weights(beyond.y / waves.spacing, waves.rows) {
        for &(column, [across, across_by]) in &columns {
            let Node { cycles, amplitude, shore, wavenumber, depth } =
                train.nodes[(row + 1) * (waves.columns + 2) + column + 1];
            let numbers = [cycles, amplitude.into(), shore.into(), wavenumber.into(), depth.into()];
            for (sum, number) in sums.iter_mut().zip(numbers) {
                for (sum, weight) in sum.iter_mut().zip([across * up, across_by * up, across * up_by]) {
                    *sum += number * weight;
                }
            }
        }
    }
    let [mut cycles, amplitude, shore, wavenumber, [depth, ..]] = sums;
    cycles[0] += train.far.dot(beyond);
    cycles[1] += train.far.x;
    cycles[2] += train.far.y;
    Here { cycles, amplitude, shore, wavenumber, depth }
}

/// A beach along x, deep in the south: depth = slope × distance from y = 0, with 20 m at most.
fn plane_beach(slope: f64, spacing: f64, columns: usize, rows: usize) -> Depths {
    let far = (rows - 1) as f64 * spacing;
    let depth = |row: usize| (slope * (far - row as f64 * spacing)).min(20.0) as f32;
    let depths = (0..columns * rows).map(|node| depth(node / columns)).collect();
    Depths { origin: DVec2::new(0.0, -far), spacing, columns, rows, depths }
}

const SWELL: Swell = Swell { amplitude: 0.5, period: 8.0, heading: 1.0, phase: 0.2 };

#[test]
fn approximations_keep_what_peachey_states() {
    let mut worst = (0.0, 0.0);
    for i in 1..4000 {
        let wanted = f64::from(i) * 2e-3;
        let exact = wavenumber(wanted, 1.0);
        let same = StillWater::of_depth(1.0).expect("wet").wavenumber(sqrt(wanted * STANDARD_GRAVITY));
        assert!((exact / same - 1.0).abs() < 1e-11, "k∞h {wanted}");
        let error = 1.0 - rough_wavenumber(wanted, 1.0) / exact;
        assert!(error > -1e-9);
        if error > worst.0 {
            worst = (error, wanted);
        }
        // Shallower than a twentieth of the wavelength, √(k∞ / h).
        if exact / TAU < 0.05 {
            assert!((sqrt(wanted) / exact - 1.0).abs() < 0.02, "k∞h {wanted}: {exact}");
        }
        if exact / TAU > 0.25 {
            assert!(error < 0.032, "k∞h {wanted}: {error}");
        }
    }
    assert!((worst.0 - 0.0498).abs() < 2e-4 && (worst.1 - 0.694).abs() < 0.01, "{worst:?}");
}

#[test]
fn crests_turn_as_snell_says() {
    let bed = plane_beach(0.02, 5.0, 121, 241);
    for heading in [0.6, 1.0, 1.5, PI / 2.0, 2.1, 2.5] {
        let waves = Peachey::new(&bed, &[Swell { heading, ..SWELL }], Path::Refracted, Surf::default()).expect("waves");
        let train = &waves.trains[0];
        let kept = train.far.x;
        let deep = TAU * TAU / 64.0 / STANDARD_GRAVITY;
        for i in 0..200 {
            let (x, y) = (20.0 + f64::from(i % 20) * 29.0, -40.0 - f64::from(i) * 5.5);
            let here = at(&waves, train, x, y);
            let k = wavenumber(deep, 0.02 * -y.clamp(-1000.0, 0.0)) / TAU;
            // sin α over the phase speed is constant, and the wave as long as the depth wants it.
            assert!(
                (here.cycles[1] - kept).abs() < 0.01 * kept.abs() + 1e-6,
                "{heading}: {x}, {y}: {} {kept}",
                here.cycles[1]
            );
            let length = sqrt(here.cycles[1].powi(2) + here.cycles[2].powi(2));
            assert!((length / k - 1.0).abs() < 0.01, "{heading}: {x}, {y}: {length} {k}");
        }
    }
}

#[test]
fn straight_rays_add_up_the_wave_number() {
    let bed = plane_beach(0.02, 5.0, 121, 241);
    let deep = TAU * TAU / 64.0 / STANDARD_GRAVITY;
    let incoming = rough_wavenumber(deep, 20.0) / TAU;
    for heading in [0.5, 1.0, PI / 2.0] {
        let waves = Peachey::new(&bed, &[Swell { heading, ..SWELL }], Path::Straight, Surf::default()).expect("waves");
        let train = &waves.trains[0];
        let (sin, cos) = (heading.sin(), heading.cos());
        for i in 0..20 {
            let (x, y) = (100.0 + f64::from(i) * 20.0, -60.0 - f64::from(i) * 40.0);
            // Back along the ray to the first row.
            let reach = (y + 1200.0) / sin;
            let steps = 20_000;
            let sum: f64 = (0..steps)
                .map(|n| y - sin * reach * (f64::from(n) + 0.5) / f64::from(steps))
                .map(|y| rough_wavenumber(deep, (0.02 * -y).min(20.0)) / TAU)
                .sum();
            let start = DVec2::new(x - cos * reach, 0.0);
            let expected = incoming * start.x * cos + sum * reach / f64::from(steps);
            let got = at(&waves, train, x, y).cycles[0];
            // Asking a row before smears a little where depths bend much: near the shore.
            assert!((got - expected).abs() < 0.03, "{heading}: {x}, {y}: {got} for {expected}");
        }
    }
}

#[test]
fn waves_keep_their_period_and_break_at_the_surf() {
    let shore = vec![DVec2::new(600.0, 0.0), DVec2::new(300.0, 0.0), DVec2::new(0.0, 100.0)];
    let beach = Beach { shore, slope: 0.03, surf_width: 50.0 };
    let bed = beach.depths(DVec2::new(0.0, -500.0), 5.0, 121, 131).expect("a bed");
    let surf = Surf { shoaling: false, breaking: beach.breaking(0.5).expect("a ratio") };
    let swell = Swell { heading: 1.6, ..SWELL };
    let mut waves = Peachey::new(&bed, &[swell], Path::Refracted, surf).expect("waves");
    // 40 m and 150 m off the shore at x = 400, the height is four fifths and the whole; on land there is none.
    for (y, most) in [(-150.0, 0.5), (-40.0, 0.4), (-20.0, 0.2), (20.0, 0.0)] {
        let mut highest = 0f32;
        for step in 0..400 {
            waves.set_time(f64::from(step) * 0.02);
            let mut motion = Motion::STILL;
            waves.add_displacement(&Points::at(400.0, y), &mut motion);
            highest = highest.max(motion.dz[0]);
            waves.set_time(f64::from(step) * 0.02 + 8.0);
            let mut later = Motion::STILL;
            waves.add_displacement(&Points::at(400.0, y), &mut later);
            assert!((later.dz[0] - motion.dz[0]).abs() < 1e-5);
        }
        assert!((highest - most).abs() < 0.01, "{highest} at {y}");
    }
    // The sea is to the left of the shore, at its corner too.
    assert!(beach.distance(DVec2::new(200.0, -50.0)) > 0.0 && beach.distance(DVec2::new(300.0, 30.0)) < 0.0);
}

#[test]
fn profiles_are_as_written() {
    for i in 0..100 {
        let u = f64::from(i) / 100.0;
        let phase = (u - u.round()) as f32;
        let (deep, by_deep, _) = profile(phase, 0.0);
        assert!((f64::from(deep) - (TAU * u).cos()).abs() < 2e-6);
        assert!((f64::from(by_deep) + TAU * (TAU * u).sin()).abs() < 2e-5);
        let (shore, by_shore, _) = profile(phase, 1.0);
        assert!((f64::from(shore) - (8.0 * (u - 0.5).powi(2) - 1.0)).abs() < 1e-5);
        assert!((f64::from(by_shore) - 16.0 * (u - 0.5)).abs() < 1e-5);
    }
    for shore in [0.0, 0.3, 1.0] {
        let mean = (0..1000).map(|i| profile((i as f32 + 0.5) / 1000.0 - 0.5, shore).1.powi(2)).sum::<f32>() / 1000.0;
        assert!((mean / profile_steepness(shore) - 1.0).abs() < 1e-4, "{mean} at {shore}");
    }
}

#[test]
fn slopes_follow_amplitude_profile_and_fading() {
    // So steep that all of these change within a wave.
    let bed = plane_beach(0.3, 2.0, 61, 61);
    let surf = Surf { shoaling: true, breaking: 0.78 };
    let waves = Peachey::new(&bed, &[Swell { period: 6.0, ..SWELL }], Path::Refracted, surf).expect("waves");
    let height = |x: f64, y: f64, footprint: f32| {
        let mut motion = Motion::STILL;
        waves.add_motion(&Points { footprint: [footprint; BLOCK], ..Points::at(x, y) }, &mut motion);
        motion
    };
    for footprint in [0.0, 8.0, 12.0] {
        let mut wrong = 0;
        for i in 0..300 {
            let (x, y) = (20.0 + f64::from(i % 40) * 2.03, -3.0 - f64::from(i) * 0.3);
            let here = height(x, y, footprint);
            let by = |a: Motion, b: Motion| (a.dz[0] - b.dz[0]) / 0.1;
            let x_slope = by(height(x + 0.05, y, footprint), height(x - 0.05, y, footprint));
            let y_slope = by(height(x, y + 0.05, footprint), height(x, y - 0.05, footprint));
            // Creases, of crests and where fading begins and ends, may lie between.
            wrong += usize::from((x_slope - here.slope_x[0]).abs() > 4e-4 || (y_slope - here.slope_y[0]).abs() > 4e-4);
        }
        assert!(wrong <= 12, "{wrong} of 300 slopes at a footprint of {footprint} m");
    }
}

#[test]
fn energy_flux_is_kept() {
    let bed = plane_beach(0.02, 5.0, 61, 241);
    let surf = Surf { shoaling: true, breaking: 10.0 };
    let waves = Peachey::new(&bed, &[Swell { heading: PI / 2.0, ..SWELL }], Path::Refracted, surf).expect("waves");
    let deep = TAU * TAU / 64.0 / STANDARD_GRAVITY;
    let flux = |depth: f64| StillWater { depth, ..StillWater::DEEP }.group_speed(wavenumber(deep, depth));
    for depth in [1.0, 2.0, 5.0, 15.0] {
        let here = at(&waves, &waves.trains[0], 150.0, -depth / 0.02);
        assert!((here.amplitude[0] / (0.5 * sqrt(flux(20.0) / flux(depth))) - 1.0).abs() < 0.005, "{depth} m");
    }
}

/// Trains over a beach far from the origin: hundreds of cycles of short waves, and long ones that feel all of it.
fn far_beach() -> Peachey {
    let mut bed = plane_beach(0.015, 4.0, 201, 351);
    bed.origin += DVec2::new(3e6, -7e5);
    // A reef, so that nothing is the same along the shore.
    for (node, depth) in bed.depths.iter_mut().enumerate() {
        let (x, y) = ((node % 201) as f32 - 90.0, (node / 201) as f32 - 200.0);
        *depth -= 6.0 * (-(x * x + y * y) / 900.0).exp();
    }
    let swell = |amplitude, period, heading| Swell { amplitude, period, heading, phase: heading };
    // More trains than are summed at once.
    let swells = [(0.8, 11.0, 1.6), (0.3, 6.0, 1.1), (0.1, 3.0, 2.0), (0.2, 5.0, 1.4), (0.02, 1.5, 0.7)];
    Peachey::new(&bed, &swells.map(|(a, t, way)| swell(a, t, way)), Path::Refracted, Surf::default()).expect("waves")
}

/// Blocks over and beyond a bed: near each other, anywhere, at its nodes and borders, and where only hostile callers ask.
fn blocks(waves: &Peachey, hostile: bool) -> Vec<Points> {
    let size = DVec2::new(waves.columns as f64 - 1.0, waves.rows as f64 - 1.0) * waves.spacing;
    let mut blocks = Vec::new();
    for block in 0..200u32 {
        let mut points = Points::at(0.0, 0.0);
        for lane in 0..BLOCK {
            let n = f64::from(block) * 16.0 + lane as f64;
            let [u, v] = [0.618_033_988_749, 0.754_877_666_247].map(|share| (n * share).fract());
            let at = match block % 5 {
                0 => size * 0.4 + DVec2::new(7.0 * u, 7.0 * v) + f64::from(block),
                1 => size * DVec2::new(1.4 * u - 0.2, 1.4 * v - 0.2),
                // Halfway between nodes, and from border to border.
                2 => DVec2::new((u * 202.0).floor() - 0.5, (v * 352.0).floor() - 0.5) * waves.spacing,
                3 => size * DVec2::new((4.0 * u).round() - 1.0, v) + DVec2::new(0.0, 1e4 * v),
                _ => size * DVec2::new(u, v),
            };
            (points.x[lane], points.y[lane]) = (waves.origin + at).into();
            points.footprint[lane] = if block % 3 == 0 { 0.0 } else { (60.0 * u * v) as f32 };
            if hostile && lane % 5 == 0 {
                points.x[lane] = [f64::NAN, f64::INFINITY, -1e300, 1e12, 5e-324][(block % 5) as usize];
                points.footprint[lane] = [f32::NAN, f32::INFINITY, -1.0, f32::MAX, 1e-40][(block / 5 % 5) as usize];
            }
        }
        blocks.push(points);
    }
    blocks
}

#[test]
fn answers_are_those_of_the_formula() {
    let mut waves = far_beach();
    let bounds = waves.bounds();
    let (mut most, mut high) = ([0f64; 4], 0);
    for (block, points) in blocks(&waves, false).iter().enumerate() {
        waves.set_time(block as f64 * 977.7);
        let (mut motion, mut flow) = (Motion::STILL, Velocity::STILL);
        let depths: [f32; BLOCK] = std::array::from_fn(|lane| [0.0, 0.1, 0.7, 3.0][lane % 4]);
        waves.add_motion(points, &mut motion);
        waves.add_velocity(points, &depths, &mut flow);
        for (lane, below) in depths.map(f64::from).into_iter().enumerate() {
            let (mut height, mut slope, mut hidden) = (0.0, DVec2::ZERO, [0.0; 3]);
            let mut speed = [0.0; 3];
            let mut creased = false;
            for train in &waves.trains {
                let here = at(&waves, train, points.x[lane], points.y[lane]);
                let (amplitude, shore, k) = (here.amplitude[0], here.shore[0], here.wavenumber[0]);
                let fading = PI / (k * f64::from(points.footprint[lane])) - 1.0;
                let left = if points.footprint[lane] > 0.0 { fading.clamp(0.0, 1.0) } else { 1.0 };
                let fades = left > 0.0 && left < 1.0;
                let cycles = here.cycles[0] + train.cycles;
                let u = cycles - cycles.floor();
                let (cosine, parabola) = ((TAU * u).cos(), 8.0 * (u - 0.5).powi(2) - 1.0);
                let w = cosine + shore * (parabola - cosine);
                let by = -(1.0 - shore) * TAU * (TAU * u).sin() + shore * 16.0 * (u - 0.5);
                height += amplitude * left * w;
                for axis in 0..2 {
                    let faded = if fades { -(left + 1.0) / k * here.wavenumber[axis + 1] } else { 0.0 };
                    let along = by * here.cycles[axis + 1] + (parabola - cosine) * here.shore[axis + 1];
                    slope[axis] += (here.amplitude[axis + 1] * left + amplitude * faded) * w + amplitude * left * along;
                }
                let lost = (1.0 - left * left) * amplitude * amplitude * f64::from(profile_steepness(shore as f32));
                let [_, x, y] = here.cycles;
                hidden[0] += lost * x * x;
                hidden[1] += lost * x * y;
                hidden[2] += lost * y * y;
                let water = StillWater { depth: here.depth.max(0.01), ..StillWater::DEEP };
                let (across, upright) = water.motion_below(k, -below);
                let along = DVec2::new(x, y).normalize_or_zero();
                let rate = amplitude * left / train.swell.period;
                speed[0] += TAU * rate * across * (w + shore / 3.0) * along.x;
                speed[1] += TAU * rate * across * (w + shore / 3.0) * along.y;
                speed[2] -= rate * upright * by;
                // Slopes and upward speeds jump at crests near the shore, slopes where fading begins and ends, all speeds at the bed.
                creased |= shore > 0.0 && (u - u.round()).abs() < 1e-6;
                creased |= fading.abs() < 1e-5 || (fading - 1.0).abs() < 1e-5;
                creased |= (below / water.depth - 1.0).abs() < 1e-5;
            }
            most[0] = most[0].max((f64::from(motion.dz[lane]) - height).abs() / f64::from(bounds.height));
            if creased {
                continue;
            }
            high += usize::from(height.abs() > 0.1);
            for (got, wanted) in [(motion.slope_x[lane], slope.x), (motion.slope_y[lane], slope.y)] {
                most[1] = most[1].max((f64::from(got) - wanted).abs());
            }
            let got = [motion.hidden_xx[lane], motion.hidden_xy[lane], motion.hidden_yy[lane]];
            for (got, wanted) in got.into_iter().zip(hidden) {
                most[2] = most[2].max((f64::from(got) - wanted).abs());
            }
            for (got, wanted) in [flow.x[lane], flow.y[lane], flow.z[lane]].into_iter().zip(speed) {
                most[3] = most[3].max((f64::from(got) - wanted).abs());
            }
        }
    }
    assert!(high > 1000, "{high}");
    // Parts of the greatest height, slopes, their squares, and m/s.
    let allowed = [1e-6, 2e-7, 1e-8, 2e-6];
    assert!(most.iter().zip(allowed).all(|(most, allowed)| *most < allowed), "{most:?}");
}

#[test]
fn every_processor_answers_the_same() {
    let mut waves = far_beach();
    for (block, points) in blocks(&waves, true).iter().enumerate() {
        waves.set_time(block as f64 * 13.3);
        let depths: [f32; BLOCK] = std::array::from_fn(|lane| lane as f32 * 0.4 - 0.4);
        let (mut best, mut plain) = (Motion::STILL, Motion::STILL);
        kernel::add_motion(&waves, points, &mut best);
        kernel::add_motion_body(&waves, points, &mut plain);
        assert_eq!(best, plain, "{points:?}");
        let (mut short, mut plain) = (Motion::STILL, Motion::STILL);
        kernel::add_displacement(&waves, points, &mut short);
        kernel::add_displacement_body(&waves, points, &mut plain);
        assert_eq!(short, plain, "{points:?}");
        assert_eq!(short.dz, best.dz, "{points:?}");
        let (mut best, mut plain) = (Velocity::STILL, Velocity::STILL);
        kernel::add_velocity(&waves, points, &depths, &mut best);
        kernel::add_velocity_body(&waves, points, &depths, &mut plain);
        assert_eq!(best, plain, "{points:?}");
    }
}

#[test]
fn nonsense_is_refused() {
    let bed = plane_beach(0.02, 5.0, 11, 61);
    let new = |bed: &Depths, swell: Swell, surf| Peachey::new(bed, &[swell], Path::Refracted, surf);
    assert!(new(&bed, SWELL, Surf::default()).is_ok());
    for wrong in [
        Swell { amplitude: f64::NAN, ..SWELL },
        Swell { period: 0.0, ..SWELL },
        Swell { heading: f64::INFINITY, ..SWELL },
        Swell { phase: f64::NAN, ..SWELL },
    ] {
        assert!(new(&bed, wrong, Surf::default()).is_err(), "{wrong:?}");
    }
    assert!(new(&bed, SWELL, Surf { shoaling: true, breaking: f64::INFINITY }).is_err());
    assert!(new(&Depths { spacing: 0.0, ..bed.clone() }, SWELL, Surf::default()).is_err());
    assert!(new(&Depths { rows: 62, ..bed.clone() }, SWELL, Surf::default()).is_err());
    assert!(new(&Depths { columns: usize::MAX, ..bed.clone() }, SWELL, Surf::default()).is_err());
    // All land, and water only behind it.
    assert!(new(&Depths { depths: vec![f32::NAN; 11 * 61], ..bed.clone() }, SWELL, Surf::default()).is_err());
    let lee = Swell { heading: -PI / 2.0, ..SWELL };
    let error = new(&bed, lee, Surf::default()).map(|_| ()).expect_err("waves from the land").to_string();
    assert!(error.contains("water along the side"), "{error}");
    // Hostile depths are waded through.
    let mut odd = bed;
    for (node, depth) in odd.depths.iter_mut().enumerate().skip(11) {
        *depth = [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e-30, 1e30, 3.0][node % 6];
    }
    let waves = new(&odd, SWELL, Surf::default()).expect("waves");
    let mut motion = Motion::STILL;
    waves.add_motion(&Points { x: std::array::from_fn(|i| i as f64 * 3.0), ..Points::at(0.0, -250.0) }, &mut motion);
    assert!(motion.dz.iter().chain(&motion.slope_x).all(|number| number.is_finite()));
}
