//! The sea over a bed, against closed forms and against solutions found in other ways.

use glam::DVec2;
use littoral::waves::shore::{BREAKING, Bed, Frame, Settings, ShoreError, ShoreSea, Surf};
use littoral::waves::{Motion, PlaneWave, Points, SeaState, StillWater, Velocity, WaveModel};
use std::f64::consts::TAU;

fn wave(period: f64, amplitude: f64, heading: f64, depth: f64) -> PlaneWave {
    let omega = TAU / period;
    let k = StillWater::of_depth(depth).expect("wet").wavenumber(omega);
    PlaneWave { amplitude, wavenumber: DVec2::from_angle(heading) * k, angular_frequency: omega, phase: 0.0 }
}

fn sea(bed: &Bed, waves: &[PlaneWave], depth: f64, settings: &Settings) -> ShoreSea {
    ShoreSea::of_waves(bed, waves, depth, settings, &|_| true).expect("a sea")
}

/// A plane beach that rises towards +y from a flat bed, wide enough that its ends do not matter.
fn beach(slope: f64, depth: f64) -> Bed {
    let rows = ((depth / slope + 160.0) / 2.0) as usize;
    Bed::of(DVec2::ZERO, DVec2::new(8.0, 2.0), 450, rows, |p| depth - slope * (p.y - 100.0).max(0.0)).expect("a bed")
}

const MIDDLE: f64 = 1800.0;

fn unsmoothed() -> Settings {
    Settings { smoothing: Some(0.0), ..Settings::default() }
}

#[test]
fn a_plane_beach_refracts_by_snell_and_shoals_by_green() {
    let (depth, slope) = (12.0, 0.03);
    let bed = beach(slope, depth);
    for degrees in [0.0f64, 20.0, 40.0] {
        let incoming = wave(9.0, 0.01, (90.0 - degrees).to_radians(), depth);
        let sea = sea(&bed, &[incoming], depth, &Settings { apron: Some(400.0), ..unsmoothed() });
        let water = |h: f64| StillWater::of_depth(h).expect("wet");
        let (omega, across) = (incoming.angular_frequency, incoming.wavenumber.x);
        let flux = |h: f64| {
            let k = water(h).wavenumber(omega);
            water(h).group_speed(k) * (1.0 - (across / k).powi(2)).sqrt()
        };
        let (mut worst_turn, mut worst_length, mut worst_rise) = (0.0f64, 0.0f64, 0.0f64);
        for step in 0..100 {
            let y = 111.0 + f64::from(step) * 4.0;
            let h = depth - slope * (y - 100.0);
            if h < 0.5 {
                break;
            }
            let (amplitude, direction) = sea.component(0, MIDDLE + 3.0, y);
            let k = water(h).wavenumber(omega);
            worst_turn =
                worst_turn.max((direction.x / direction.length() - across / k).abs() / (across / k).abs().max(0.1));
            worst_length = worst_length.max((direction.length() / k - 1.0).abs());
            worst_rise = worst_rise.max((amplitude / (0.01 * (flux(depth) / flux(h)).sqrt()) - 1.0).abs());
        }
        println!("{degrees}°: Snell {worst_turn:.5}, wave number {worst_length:.5}, shoaling {worst_rise:.5}");
        assert!(worst_turn < 0.01 && worst_length < 0.01 && worst_rise < 0.02);
    }
}

#[test]
fn waves_break_where_the_depth_bears_no_more() {
    let (depth, slope) = (12.0, 0.03);
    let bed = beach(slope, depth);
    // In three directions of march at once, so that the limit holds for all of them together.
    let waves = [wave(9.0, 0.5, 1.57, depth), wave(8.0, 0.3, 0.7, depth), wave(7.0, 0.3, 2.5, depth)];
    let sea = sea(&bed, &waves, depth, &unsmoothed());
    let (mut broken, mut lowest) = (0, f32::INFINITY);
    for step in 0..420 {
        let y = 100.0 + f64::from(step);
        let h = (depth - slope * (y - 100.0)) as f32;
        if h < 0.3 {
            break;
        }
        let climate = sea.climate(MIDDLE, y);
        assert!((climate.depth - h).abs() < 0.04);
        let index = climate.significant_height / h;
        assert!(index < BREAKING * 1.03, "{index} at {h} m");
        if h < 2.0 {
            broken += 1;
            lowest = lowest.min(index);
        }
    }
    println!("index in the surf down to {lowest}");
    assert!(broken > 40 && lowest > 0.95 * BREAKING, "the surf is as high as the depth bears: {lowest}");
    let outside = sea.climate(MIDDLE, 120.0).significant_height;
    assert!((outside / (4.0 * (0.5f32 * (0.25 + 0.09 + 0.09)).sqrt()) - 1.0).abs() < 0.04, "{outside}");
}

#[test]
fn the_flux_of_energy_is_kept_over_an_uneven_bed() {
    let depth = 15.0;
    let bed = Bed::of(DVec2::ZERO, DVec2::new(6.0, 4.0), 400, 200, |p| {
        let shoal = |x: f64, y: f64, r: f64| (-((p.x - x).powi(2) + (p.y - y).powi(2)) / (r * r)).exp();
        depth - 8.0 * shoal(1200.0, 350.0, 130.0) - 3.0 * shoal(1000.0, 500.0, 90.0)
    })
    .expect("a bed");
    let incoming = wave(8.0, 0.05, 1.5, depth);
    let sea = sea(&bed, &[incoming], depth, &unsmoothed());
    let flux = |y: f64| -> f64 {
        (40..360)
            .map(|i| {
                let x = f64::from(i) * 6.0 + 3.0;
                let (amplitude, k) = sea.component(0, x, y);
                let water = StillWater::of_depth(f64::from(sea.climate(x, y).depth)).expect("wet");
                let own = water.wavenumber(incoming.angular_frequency);
                amplitude * amplitude * water.group_speed(own) * k.y / own
            })
            .sum()
    };
    let first = flux(22.0);
    let worst = (1..38).map(|i| (flux(22.0 + 20.0 * f64::from(i)) / first - 1.0).abs()).fold(0.0, f64::max);
    let (highest, _) = (0..40)
        .map(|i| sea.component(0, 1200.0, 350.0 + 8.0 * f64::from(i)))
        .fold((0.0f64, ()), |m, c| (m.0.max(c.0), ()));
    println!("flux changes by {worst:.4}; behind the shoal waves grow by {:.2}", highest / 0.05);
    assert!(worst < 0.02, "{worst}");
    assert!(highest > 0.05 * 1.3, "the shoal focuses");
}

/// ∫ e^{iτ²} dτ from −∞ to x, by Simpson's rule from 0.
fn fresnel(x: f64) -> (f64, f64) {
    let half = (std::f64::consts::PI / 8.0).sqrt();
    let n = 2 * (20 + (x * x * 8.0) as usize);
    let step = x / n as f64;
    let (mut c, mut s) = (0.0, 0.0);
    for i in 0..=n {
        let w = if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
        let t = i as f64 * step;
        c += w * (t * t).cos();
        s += w * (t * t).sin();
    }
    (half + c * step / 3.0, half + s * step / 3.0)
}

/// Amplitude behind a half-plane x < 0 at y = 0 for waves that come straight on (A. Sommerfeld 1896): of a screen on which waves are 0,
/// of one that throws them back whole, and the mean of both.
fn sommerfeld(k: f64, x: f64, y: f64) -> [f64; 3] {
    let r = x.hypot(y);
    let angle = (-y).atan2(-x).rem_euclid(TAU);
    let start = 0.25 * TAU;
    let term = |off: f64| {
        let (c, s) = fresnel((2.0 * k * r).sqrt() * (off / 2.0).cos());
        let phase = -k * r * off.cos() - TAU / 8.0;
        let (pc, ps) = (phase.cos(), phase.sin());
        ((c * pc - s * ps) / std::f64::consts::PI.sqrt(), (c * ps + s * pc) / std::f64::consts::PI.sqrt())
    };
    let (a, b) = (term(angle - start), term(angle + start));
    [(a.0 - b.0).hypot(a.1 - b.1), (a.0 + b.0).hypot(a.1 + b.1), a.0.hypot(a.1)]
}

#[test]
fn waves_bend_round_a_breakwater_as_sommerfeld_says() {
    let depth = 20.0;
    let incoming = wave(6.0, 0.1, 0.25 * TAU, depth);
    let k = incoming.wavenumber.length();
    let wavelength = TAU / k;
    let bed = Bed::of(DVec2::new(-1800.0, -100.0), DVec2::new(5.0, 5.0), 600, 120, |p| {
        if p.x <= 0.0 && p.y.abs() < 6.0 { -1.0 } else { depth }
    })
    .expect("a bed");
    let sea = sea(&bed, &[incoming], depth, &unsmoothed());
    let (mut worst, mut square, mut count) = ([0.0f64; 3], [0.0f64; 3], 0.0);
    for j in 1..=8 {
        let y = f64::from(j) * wavelength;
        for i in -12..=12 {
            // From 45° within the shadow to 45° outside it.
            let x = y * f64::from(i) / 12.0;
            let ours = sea.component(0, x, y).0 / 0.1;
            let exact = sommerfeld(k, x - 2.5, y);
            for n in 0..3 {
                let off = (ours - exact[n]).abs();
                worst[n] = worst[n].max(off);
                square[n] += off * off;
            }
            count += 1.0;
            if i % 4 == 0 && j % 4 == 0 {
                println!(
                    "  y {j} λ, x {:5.2} y: {ours:.3}, exact {:.3} {:.3} {:.3}",
                    f64::from(i) / 12.0,
                    exact[0],
                    exact[1],
                    exact[2]
                );
            }
        }
    }
    let rms = square.map(|s| (s / count).sqrt());
    println!(
        "against Sommerfeld (soft, hard, their mean): largest {worst:.3?}, rms {rms:.3?} of the incoming amplitude"
    );
    // The march has no waves on the screen, as a soft one.
    assert!(worst[0] < 0.10 && rms[0] < 0.04);
}

/// ζ and its value a quarter of a period later: real and imaginary part of a wave's amplitude.
fn complex(sea: &mut ShoreSea, period: f64, places: &[DVec2]) -> Vec<(f64, f64)> {
    let mut read = |time: f64| -> Vec<f64> {
        sea.set_time(time);
        let height = |p: &DVec2| {
            let mut motion = Motion::STILL;
            sea.add_displacement(&Points::at(p.x, p.y), &mut motion);
            f64::from(motion.dz[0])
        };
        places.iter().map(height).collect()
    };
    let (a, b) = (read(0.0), read(0.25 * period));
    a.into_iter().zip(b).collect()
}

/// The mild-slope equation of one frequency in time (R. Smith, T. Sprinks 1975): φ'' = ∇·(c c_g ∇φ) − (ω² − k² c c_g) φ, on a fine grid, with the
/// incoming wave held on along the border and the island's shore swallowing what comes.
fn fine_solution(
    incoming: &PlaneWave,
    amplitude: f64,
    half: f64,
    step: f64,
    depth: impl Fn(DVec2) -> f64,
    places: &[DVec2],
) -> Vec<(f64, f64)> {
    let n = (2.0 * half / step) as usize + 1;
    let omega = incoming.angular_frequency;
    let place = |i: usize| DVec2::new((i % n) as f64, (i / n) as f64) * step - DVec2::splat(half);
    let medium: Vec<(f32, f32)> = (0..n * n)
        .map(|i| {
            let water = StillWater::of_depth(depth(place(i)).max(0.3)).expect("wet");
            let k = water.wavenumber(omega);
            let ccg = water.phase_speed(k) * water.group_speed(k);
            (ccg as f32, (omega * omega - k * k * ccg) as f32)
        })
        .collect();
    let ramp = |d: f64| ((d - (half - 130.0)) / 130.0).clamp(0.0, 1.0).powi(3) * 0.15;
    let hold: Vec<f32> = (0..n * n).map(|i| ramp(place(i).x.abs()).max(ramp(place(i).y.abs())) as f32).collect();
    let swallow: Vec<f32> =
        (0..n * n).map(|i| (((3.5 - depth(place(i))) / 3.5).clamp(0.0, 1.2).powi(2) * 0.08) as f32).collect();
    let dt = 2.0 * std::f64::consts::PI / omega / 90.0;
    // Until what the island throws back has gone round, too.
    let steps = 90 * 60;
    let (mut now, mut before) = (vec![0.0f32; n * n], vec![0.0f32; n * n]);
    let mut sums = vec![(0.0f64, 0.0f64); places.len()];
    let c = (dt * dt / (step * step)) as f32;
    let waves: Vec<(f32, f32)> = (0..n * n)
        .map(|i| {
            let phase = incoming.wavenumber.dot(place(i));
            ((amplitude * phase.cos()) as f32, (amplitude * phase.sin()) as f32)
        })
        .collect();
    for t in 0..steps {
        let time = (t + 1) as f64 * dt;
        // What the incoming wave changes by in two steps.
        let rise = |time: f64| (time * omega / TAU / 3.0).clamp(0.0, 1.0);
        let change = |f: fn(f64) -> f64| {
            (rise(time) * f(omega * time) - rise(time - 2.0 * dt) * f(omega * (time - 2.0 * dt))) as f32
        };
        let (cos, sin) = (change(f64::cos), change(f64::sin));
        for j in 1..n - 1 {
            for i in j * n + 1..j * n + n - 1 {
                let m = medium[i].0;
                let flow = |k: usize| 0.5 * (m + medium[k].0) * (now[k] - now[i]);
                let push = flow(i - 1) + flow(i + 1) + flow(i - n) + flow(i + n);
                let wave = waves[i].0 * cos + waves[i].1 * sin;
                let drag = hold[i] + swallow[i];
                let next = 2.0 * now[i] - before[i] * (1.0 - drag) + c * push - (dt * dt) as f32 * medium[i].1 * now[i];
                // What was before is not needed any more.
                before[i] = (next + hold[i] * wave) / (1.0 + drag);
            }
        }
        std::mem::swap(&mut now, &mut before);
        if t >= steps - 90 {
            for (sum, p) in sums.iter_mut().zip(places) {
                let q = (*p + DVec2::splat(half)) / step;
                let (i, f) = ((q.y as usize) * n + q.x as usize, q - q.floor());
                let v = |k: usize| f64::from(now[k]);
                let low = v(i) + f.x * (v(i + 1) - v(i));
                let value = low + f.y * (v(i + n) + f.x * (v(i + n + 1) - v(i + n)) - low);
                sum.0 += value * (omega * time).cos() / 45.0;
                sum.1 += value * (omega * time).sin() / 45.0;
            }
        }
    }
    sums
}

#[test]
fn round_an_island_waves_agree_with_a_fine_solution_in_time() {
    let (depth, shore, shelf) = (16.0, 45.0, 180.0);
    let period = 6.0;
    // S. Homma's island: a shelf like a bowl turned over.
    let bed_depth = |p: DVec2| {
        let r = p.length();
        if r < shore { -1.0 } else { depth * (r / shelf).powi(2).min(1.0) }
    };
    let incoming = wave(period, 0.01, 0.25 * TAU, depth);
    let bed = Bed::of(DVec2::splat(-420.0), DVec2::splat(3.0), 281, 281, bed_depth).expect("a bed");
    let mut sea = sea(&bed, &[incoming], depth, &unsmoothed());
    let mut places = Vec::new();
    for ring in [95.0, 120.0, 150.0, 200.0, 260.0] {
        for i in 0..72 {
            places.push(DVec2::from_angle(f64::from(i) * TAU / 72.0) * ring);
        }
    }
    let ours = complex(&mut sea, period, &places);
    let fine = fine_solution(&incoming, 0.01, 480.0, 2.0, bed_depth, &places);
    let (mut square, mut count, mut within, mut worst, mut heights) = (0.0, 0.0, 0.0, 0.0f64, 0.0);
    for ((p, a), b) in places.iter().zip(&ours).zip(&fine) {
        let (la, lb) = (a.0.hypot(a.1), b.0.hypot(b.1));
        if lb < 0.4 * 0.01 {
            continue;
        }
        let turns = ((a.1 * b.0 - a.0 * b.1).atan2(a.0 * b.0 + a.1 * b.1)) / TAU;
        // Of the phase that the wave has run through since it came to the shelf.
        let run = ((p.y + shelf + 60.0) * incoming.wavenumber.length() / TAU).max(1.0);
        let relative = (turns / run).abs();
        square += relative * relative;
        count += 1.0;
        within += f64::from(u8::from(relative < 0.02));
        worst = worst.max(relative);
        heights += (la - lb).powi(2);
    }
    let rms = f64::sqrt(square / count);
    let height = f64::sqrt(heights / count) / 0.01;
    println!(
        "round an island: phases rms {rms:.4}, worst {worst:.4} of the phase run, {:.3} within 2 %; amplitudes rms {height:.3} ({count} places)",
        within / count
    );
    // Deep in the lee, where waves have turned by more than the march can follow, the rest is lost.
    assert!(rms < 0.015 && within > 0.9 * count, "{rms}");
}

fn rugged(columns: usize, rows: usize) -> Bed {
    Bed::of(DVec2::new(-50.0, 30.0), DVec2::new(5.0, 4.0), columns, rows, |p| {
        let isle = ((p.x - 200.0).hypot(p.y - 180.0) - 45.0) * 0.06;
        (0.03 * (420.0 - p.y) + 0.8 * (p.x * 0.05).sin()).min(isle).min(14.0)
    })
    .expect("a bed")
}

fn mixed(depth: f64) -> Vec<PlaneWave> {
    (0..20)
        .map(|i| {
            let i = f64::from(i);
            PlaneWave { phase: 1.7 * i, ..wave(4.5 + 0.3 * i, 0.12, 1.5 + 0.9 * (i * 2.4).sin(), depth) }
        })
        .collect()
}

#[test]
fn bits_are_the_same_for_any_number_of_threads_and_any_history() {
    let (bed, waves) = (rugged(100, 120), mixed(14.0));
    let settings = Settings::default();
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| sea(&bed, &waves, 14.0, &settings))
    };
    let (mut one, mut four) = (build(1), build(4));
    // The second has been elsewhere before, in space and time.
    four.solve(&rugged(60, 50), &waves[..7], 9.0, &settings, &|_| true).expect("another sea");
    four.set_time(-7e5);
    four.solve(&bed, &waves, 14.0, &settings, &|_| true).expect("the first sea again");
    one.set_time(1234.5);
    four.set_time(1234.5);
    assert_eq!(one.bounds(), four.bounds());
    for i in 0..400 {
        let mut points = Points::at(0.0, 0.0);
        for l in 0..16 {
            points.x[l] = -150.0 + f64::from((i * 37 + l as i32 * 101) % 800);
            points.y[l] = -80.0 + f64::from((i * 91 + l as i32 * 53) % 700);
            points.footprint[l] = if i % 3 == 0 { 4.0 } else { 0.0 };
        }
        let (mut a, mut b, mut c) = (Motion::STILL, Motion::STILL, Motion::STILL);
        one.add_motion(&points, &mut a);
        four.add_motion(&points, &mut b);
        one.add_displacement(&points, &mut c);
        assert_eq!(a, b);
        assert_eq!((a.dx, a.dy, a.dz), (c.dx, c.dy, c.dz));
        // Alone, a point is answered as among others.
        let mut alone = Motion::STILL;
        let single = Points { footprint: [points.footprint[3]; 16], ..Points::at(points.x[3], points.y[3]) };
        one.add_motion(&single, &mut alone);
        assert_eq!((alone.dz[9], alone.slope_x[9], alone.foam[9]), (a.dz[3], a.slope_x[3], a.foam[3]));
        // Displacements of points that share a cell are added up in another way.
        let mut together = Motion::STILL;
        one.add_displacement(&single, &mut together);
        assert_eq!((together.dx[9], together.dy[9], together.dz[9]), (a.dx[3], a.dy[3], a.dz[3]));
    }
}

#[test]
fn slopes_are_derivatives_and_nothing_exceeds_the_bounds() {
    let (bed, waves) = (rugged(100, 120), mixed(14.0));
    let mut sea = sea(&bed, &waves, 14.0, &Settings::default());
    sea.set_time(77.0);
    let bounds = sea.bounds();
    assert!(bounds.stretch < 1.0, "water keeps its order: {bounds:?}");
    let at = |x: f64, y: f64| {
        let mut motion = Motion::STILL;
        sea.add_motion(&Points::at(x, y), &mut motion);
        motion
    };
    let d = 0.02;
    let mut worst = [0.0f32; 3];
    for i in 0..4000 {
        let (x, y) = (-140.0 + f64::from((i * 37) % 760) + 0.31, -70.0 + f64::from((i * 91) % 660) + 0.37);
        let here = at(x, y);
        let (e, w, n, s) = (at(x + d, y), at(x - d, y), at(x, y + d), at(x, y - d));
        let over = 1.0 / (2.0 * d as f32);
        worst[0] = worst[0].max(((e.dz[0] - w.dz[0]) * over - here.slope_x[0]).abs());
        worst[0] = worst[0].max(((n.dz[0] - s.dz[0]) * over - here.slope_y[0]).abs());
        worst[1] = worst[1].max(((e.dx[0] - w.dx[0]) * over - here.dxx[0]).abs());
        worst[1] = worst[1].max(((n.dy[0] - s.dy[0]) * over - here.dyy[0]).abs());
        let xy = 0.5 * ((n.dx[0] - s.dx[0]) + (e.dy[0] - w.dy[0])) * over;
        worst[2] = worst[2].max((xy - here.dxy[0]).abs());
        assert!(here.dz[0].abs() <= bounds.height && here.dx[0].hypot(here.dy[0]) <= bounds.sideways);
        assert!(here.slope_x[0].hypot(here.slope_y[0]) <= bounds.slope);
        assert!(here.dxx[0].abs() <= bounds.stretch && (0.0..=1.0).contains(&here.foam[0]));
    }
    println!("derivatives off by at most {worst:?}");
    assert!(worst.iter().all(|w| *w < 4e-3), "{worst:?}");
    let steep =
        ShoreSea::new(&bed, &"beaufort=7,from=190,depth=14".parse().expect("a state"), 32).expect("a sea").bounds();
    assert!(steep.stretch < 1.0, "{steep:?}");
    assert!(sea.roughness(0.0) == 0.0 && sea.roughness(3.0) <= sea.roughness(60.0));
    assert!(sea.roughness(1e9) >= 0.99 * bounds.height / 1.4);
}

#[test]
fn what_is_shorter_than_a_footprint_is_known_by_octaves() {
    let depth = 12.0;
    let sea = sea(&beach(0.03, depth), &[wave(9.0, 0.01, 0.25 * TAU, depth)], depth, &unsmoothed());
    // Towards the shore the wave becomes shorter and higher.
    let seen: Vec<(f64, f64)> = (0..480)
        .map(|y| sea.component(0, MIDDLE, f64::from(y)))
        .map(|(amplitude, wavenumber)| (TAU / wavenumber.length(), amplitude))
        .collect();
    let mut octaves = Vec::new();
    for octave in 3..8 {
        let length = f64::from(1 << octave);
        let told = f64::from(sea.roughness(length as f32)) / 1.4;
        let highest = seen.iter().filter(|s| s.0 < length).map(|s| s.1).fold(0.0, f64::max);
        assert!(told >= 0.999 * highest, "{told} below {length} m, not {highest}");
        octaves.push(highest);
    }
    assert!(octaves.iter().filter(|highest| **highest > 0.0).count() > 2);
}

#[test]
fn the_sea_outside_is_the_waves_that_come_and_has_no_border() {
    let waves = mixed(14.0);
    let sea = {
        let mut sea = sea(&rugged(100, 120), &waves, 14.0, &Settings::default());
        sea.set_time(12.0);
        sea
    };
    let height = |x: f64, y: f64| {
        let mut motion = Motion::STILL;
        sea.add_displacement(&Points::at(x, y), &mut motion);
        motion.dz[0]
    };
    let (low, high) = sea.extent();
    for i in 0..200 {
        let t = f64::from(i) / 200.0;
        let along = low + (high - low) * t;
        for (inside, outside) in [
            (DVec2::new(along.x, low.y + 1e-3), DVec2::new(along.x, low.y - 1e-3)),
            (DVec2::new(along.x, high.y - 1e-3), DVec2::new(along.x, high.y + 1e-3)),
            (DVec2::new(low.x + 1e-3, along.y), DVec2::new(low.x - 1e-3, along.y)),
            (DVec2::new(high.x - 1e-3, along.y), DVec2::new(high.x + 1e-3, along.y)),
        ] {
            assert!((height(inside.x, inside.y) - height(outside.x, outside.y)).abs() < 2e-3, "{inside}");
        }
        let far = low - DVec2::new(300.0 + 11.0 * f64::from(i), 150.0);
        let exact: f64 = waves
            .iter()
            .map(|w| w.amplitude * (w.wavenumber.dot(far) - w.angular_frequency * 12.0 + w.phase).cos())
            .sum();
        // The open sea of 14 m is shallow enough for a trace of sharper crests.
        assert!((f64::from(height(far.x, far.y)) - exact).abs() < 0.06, "{} for {exact}", height(far.x, far.y));
    }
}

#[test]
fn hostile_beds_and_numbers_do_no_harm() {
    let grid = |depths: Vec<f32>| Bed::new(DVec2::ZERO, DVec2::splat(3.0), 30, 20, depths, |_| true);
    let error = grid(vec![-1.0; 600]).expect_err("all land").to_string();
    assert!(error.contains("nodes of the bed under water") && error.contains("at least one"), "{error}");
    assert!(grid(vec![f32::NAN; 600]).is_err() && grid(vec![0.0; 600]).is_err() && grid(vec![1.0; 599]).is_err());
    assert!(Bed::new(DVec2::ZERO, DVec2::splat(3.0), 30, 20, vec![5.0; 600], |_| false).is_err(), "no sea");
    assert!(Bed::new(DVec2::ZERO, DVec2::splat(f64::NAN), 30, 20, vec![5.0; 600], |_| true).is_err());
    assert!(Bed::new(DVec2::ZERO, DVec2::splat(1.0), 1 << 40, 1 << 40, vec![5.0; 600], |_| true).is_err());
    let one = |value: f32, rest: f32| {
        let mut depths = vec![rest; 600];
        depths[333] = value;
        depths
    };
    let wild: Vec<f32> = (0..600)
        .map(|i| match i % 7 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => -3.0e38,
            3 => 1e-30,
            4 => 9000.0,
            _ => 3.0,
        })
        .collect();
    for depths in [one(2.0, -1.0), one(-2.0, 5.0), one(f32::NAN, 5.0), one(11e3, 1e-6), wild] {
        let bed = grid(depths).expect("a bed");
        for depth in [0.5, 12.0, f64::INFINITY] {
            let state: SeaState = "beaufort=7,from=240,swell=2@14/300".parse().expect("a state");
            let mut sea = ShoreSea::new(&bed, &SeaState { depth, ..state }, 20).expect("a sea");
            for time in [0.0, 1e9, -1e9, f64::NAN, f64::INFINITY] {
                sea.set_time(time);
                for (x, y) in [(0.0, 0.0), (45.0, 33.3), (-1e9, 1e9), (f64::NAN, 1.0), (f64::INFINITY, -1e300)] {
                    let points = Points { footprint: [1.0; 16], ..Points::at(x, y) };
                    let (mut m, mut v) = (Motion::STILL, Velocity::STILL);
                    sea.add_motion(&points, &mut m);
                    sea.add_velocity(&points, &[0.5; 16], &mut v);
                    let all =
                        [m.dx, m.dy, m.dz, m.slope_x, m.slope_y, m.dxx, m.dxy, m.dyy, m.hidden_xx, m.foam, v.x, v.z];
                    assert!(sea.run_up(DVec2::new(x, y)).is_finite());
                    assert!(all.iter().flatten().all(|n| n.is_finite()), "{x}, {y} at {time}: {m:?}");
                }
            }
            let b = sea.bounds();
            assert!(
                [b.height, b.sideways, b.slope, b.stretch, b.curvature, b.bend].iter().all(|n| n.is_finite()),
                "{b:?}"
            );
        }
    }
    let bed = grid(vec![5.0; 600]).expect("a bed");
    let fine = wave(8.0, 0.1, 1.0, 5.0);
    let refused =
        |w: PlaneWave, depth: f64| ShoreSea::of_waves(&bed, &[w], depth, &Settings::default(), &|_| true).is_err();
    assert!(refused(fine, 0.0) && refused(fine, f64::NAN));
    assert!(refused(PlaneWave { amplitude: f64::NAN, ..fine }, 5.0));
    assert!(refused(PlaneWave { wavenumber: DVec2::ZERO, ..fine }, 5.0));
    assert!(refused(PlaneWave { phase: f64::INFINITY, ..fine }, 5.0));
    let calm = ShoreSea::new(&bed, &SeaState::CALM, 32).expect("a calm");
    let mut motion = Motion::STILL;
    calm.add_motion(&Points::at(3.0, 3.0), &mut motion);
    assert_eq!((motion, calm.bounds().height), (Motion::STILL, 0.0));
    let cancelled = ShoreSea::of_waves(&rugged(100, 120), &mixed(14.0), 14.0, &Settings::default(), &|done| done < 0.3);
    assert!(matches!(cancelled, Err(ShoreError::Cancelled(_))));
}

#[test]
fn a_designers_shore_has_its_slope_and_its_surf() {
    let line = [DVec2::new(600.0, 300.0), DVec2::new(300.0, 330.0), DVec2::new(0.0, 300.0)];
    let frame = Frame { origin: DVec2::ZERO, spacing: DVec2::splat(3.0), columns: 200, rows: 150 };
    let surf = Surf { width: 90.0, height: 1.2 };
    let bed = Bed::of_shoreline(&line, 0.04, Some(surf), 9.0, frame).expect("a bed");
    // The land lies to the left of who walks from east to west: in the south.
    let depth = |x: usize, y: usize| f64::from(bed.depths()[y * 200 + x]);
    assert!(depth(100, 10) < 0.0 && depth(100, 140) > 0.0);
    let off = (120.0 * 3.0 - 330.0) * (300.0f64).hypot(0.0) / (300.0f64).hypot(30.0);
    assert!((depth(100, 120) - 1.2 / f64::from(BREAKING) * off / 90.0).abs() < 0.05, "{}", depth(100, 120));
    let mut sea = sea(&bed, &[wave(8.0, 1.2 / 8f64.sqrt(), -0.25 * TAU, 9.0)], 9.0, &Settings::default());
    let climate = |y: f64| sea.climate(300.0, y);
    assert!(climate(400.0).broken > 0.1 && climate(445.0).broken < 0.2, "it breaks where it should");
    // The waterline moves, and by about as much as Stockdon's formula has it.
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for step in 0..40 {
        sea.set_time(f64::from(step) * 0.8);
        let mut motion = Motion::STILL;
        sea.add_displacement(&Points::at(300.0, 322.0), &mut motion);
        low = low.min(motion.dz[0]);
        high = high.max(motion.dz[0]);
    }
    println!("waterline from {low} to {high} m");
    assert!(high - low > 0.15 && high < 2.0 && low > -1.0);
    assert!(Bed::of_shoreline(&line[..1], 0.04, None, 9.0, frame).is_err());
    assert!(Bed::of_shoreline(&line, 0.0, None, 9.0, frame).is_err());
}

#[test]
fn water_moves_as_linear_waves_have_it() {
    let (depth, period) = (9.0, 7.0);
    let incoming = wave(period, 0.02, 0.6, depth);
    let bed = Bed::of(DVec2::ZERO, DVec2::splat(5.0), 60, 60, |_| depth).expect("a bed");
    let mut sea = sea(&bed, &[incoming], depth, &unsmoothed());
    let water = StillWater::of_depth(depth).expect("wet");
    let k = incoming.wavenumber.length();
    for (time, below) in [(0.0, 0.0f32), (1.3, 2.0), (4.0, 8.9), (9.1, 9.1)] {
        sea.set_time(time);
        for (x, y) in [(120.0, 140.0), (-900.0, 33.0)] {
            let mut v = Velocity::STILL;
            sea.add_velocity(&Points::at(x, y), &[below; 16], &mut v);
            let phase = incoming.wavenumber.dot(DVec2::new(x, y)) - incoming.angular_frequency * time;
            let (sideways, upright) = water.motion_below(k, -f64::from(below));
            let speed = 0.02 * incoming.angular_frequency;
            let exact = incoming.wavenumber / k * (speed * sideways * phase.cos());
            let rise = speed * upright * phase.sin();
            assert!(
                (f64::from(v.x[3]) - exact.x).abs() < 2e-4 && (f64::from(v.y[3]) - exact.y).abs() < 2e-4,
                "{exact} {v:?}"
            );
            assert!((f64::from(v.z[3]) - rise).abs() < 2e-4);
        }
    }
}
