use super::super::fft::{LANES, Wide};
use super::super::{PlaneWave, StillWater};
use super::*;
use glam::DVec2;

/// A wave of a tile's lattice.
fn wave_of(patch: &Patch, m: i32, n: i32) -> (usize, usize) {
    let at = (m.div_euclid(16) + patch.waves.groups) * (2 * patch.waves.rows + 1) + n + patch.waves.rows;
    (at as usize, m.rem_euclid(16) as usize)
}

/// Leaves one wave of a tile, of a given amplitude (m) and phase 0.
fn only(sea: &mut Cascades, tile: usize, m: i32, n: i32, amplitude: f32) -> PlaneWave {
    for patch in &mut sea.patches {
        for column in &mut patch.waves.columns {
            (column.sum, column.difference) = (Wide::ZERO, Wide::ZERO);
        }
    }
    let patch = &mut sea.patches[tile];
    let (at, l) = wave_of(patch, m, n);
    let half = 0.5 * amplitude;
    (patch.waves.columns[at].sum.re[l], patch.waves.columns[at].difference.re[l]) = (half, half);
    let turns = patch.waves.columns[at].turns[l];
    let (at, l) = wave_of(patch, -m, -n);
    (patch.waves.columns[at].sum.re[l], patch.waves.columns[at].difference.re[l]) = (half, -half);
    let in_tile = DVec2::new(f64::from(m), f64::from(n)) * patch.tile.step();
    PlaneWave {
        amplitude: f64::from(amplitude),
        wavenumber: DVec2::from_angle(patch.tile.turn).rotate(in_tile),
        angular_frequency: TAU * turns,
        phase: 0.0,
    }
}

/// Points that fill a region of some size (m).
fn somewhere(seed: u64, size: f64) -> Points {
    let mut points = Points::at(0.0, 0.0);
    for l in 0..LANES {
        points.x[l] = size * (super::super::random::uniform(seed, l as i64, 0, 0) - 0.5);
        points.y[l] = size * (super::super::random::uniform(seed, l as i64, 1, 0) - 0.5);
    }
    points
}

fn motion(sea: &Cascades, points: &Points) -> Motion {
    let mut motion = Motion::STILL;
    sea.add_motion(points, &mut motion);
    motion
}

#[test]
fn one_component_is_an_airy_wave_at_any_depth() {
    let state = SeaState::of_wind(9.0, 0.3, 2e5).expect("a wind");
    for depth in [2.0, 15.0, f64::INFINITY] {
        let state = SeaState { depth, ..state.clone() };
        let options = Options { samples: 64, foam: false, ..Options::default() };
        let mut sea = Cascades::new(&state, &options).expect("a sea");
        let water = StillWater { depth, ..StillWater::DEEP };
        for (tile, m, n) in [(0, 3, -2), (0, -5, 1), (1, 4, 9), (2, -9, 0)] {
            let wave = only(&mut sea, tile, m, n, 0.7);
            let k = wave.wavenumber.length();
            assert!((wave.angular_frequency / water.angular_frequency(k) - 1.0).abs() < 1e-12);
            for time in [0.0, 17.3, 86_400.0 * 40.0 + 0.1] {
                sea.set_time(time);
                let points = somewhere(7, 4000.0);
                let motion = motion(&sea, &points);
                let coth = water.motion_below(k, 0.0).0;
                let mut velocity = Velocity::STILL;
                let depths = std::array::from_fn(|l| (0.04 * l as f64 / k).min(0.9 * depth) as f32);
                sea.add_velocity(&points, &depths, &mut velocity);
                for l in 0..LANES {
                    let at = DVec2::new(points.x[l], points.y[l]);
                    let phase = wave.wavenumber.dot(at) - wave.angular_frequency * time;
                    let (sine, cosine) = libm::sincos(phase);
                    let along = wave.wavenumber / k;
                    let close = |got: f32, exact: f64, scale: f64, part: f64| {
                        assert!(
                            (f64::from(got) - exact).abs() < part * scale,
                            "{tile} {m} {n} h {depth}: {got} {exact}"
                        );
                    };
                    let a = wave.amplitude;
                    // Waves of 64 / 10 samples and longer.
                    close(motion.dz[l], a * cosine, a, 0.01);
                    close(motion.dx[l], -a * coth * along.x * sine, a * coth, 0.01);
                    close(motion.dy[l], -a * coth * along.y * sine, a * coth, 0.01);
                    close(motion.slope_x[l], -a * wave.wavenumber.x * sine, a * k, 0.04);
                    close(motion.slope_y[l], -a * wave.wavenumber.y * sine, a * k, 0.04);
                    close(motion.dxx[l], -a * coth * along.x * wave.wavenumber.x * cosine, a * coth * k, 0.04);
                    close(motion.dxy[l], -a * coth * along.y * wave.wavenumber.x * cosine, a * coth * k, 0.04);
                    close(motion.dyy[l], -a * coth * along.y * wave.wavenumber.y * cosine, a * coth * k, 0.04);
                    let (sideways, upward) = water.motion_below(k, -f64::from(depths[l]));
                    let w = a * wave.angular_frequency;
                    close(velocity.z[l], w * upward * sine, w, 0.04);
                    close(velocity.x[l], w * sideways * along.x * cosine, w * coth, 0.04);
                    close(velocity.y[l], w * sideways * along.y * cosine, w * coth, 0.04);
                }
            }
        }
    }
}

/// The exact sum of all waves at a place and instant: height and displacement (m) of tile after tile.
fn exact(sea: &Cascades, at: DVec2, time: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for patch in &sea.patches {
        let in_tile = DVec2::from_angle(-patch.tile.turn).rotate(at);
        let mut own = DVec2::ZERO;
        let rows = patch.waves.rows;
        for m in -rows..=rows {
            for n in -rows..=rows {
                let (index, l) = wave_of(patch, m, n);
                let column = &patch.waves.columns[index];
                let k = DVec2::new(f64::from(m), f64::from(n)) * patch.tile.step();
                let (sine, cosine) = libm::sincos(TAU * (column.turns[l] * time).fract());
                let re = f64::from(column.sum.re[l]) * cosine + f64::from(column.difference.im[l]) * sine;
                let im = f64::from(column.sum.im[l]) * cosine - f64::from(column.difference.re[l]) * sine;
                let (sine, cosine) = libm::sincos(k.dot(in_tile));
                sum[0] += re * cosine - im * sine;
                own -= k * f64::from(column.reach[l]) * (re * sine + im * cosine);
            }
        }
        let own = DVec2::from_angle(patch.tile.turn).rotate(own);
        sum[1] += own.x;
        sum[2] += own.y;
    }
    sum
}

#[test]
fn answers_are_the_exact_sum_to_the_stated_error() {
    let state = SeaState::beaufort(5.0, 0.6).expect("a state");
    for (samples, stated) in [(64, 6e-3), (128, 4e-3)] {
        let mut sea = Cascades::new(&state, &Options { samples, foam: false, ..Options::default() }).expect("a sea");
        sea.set_time(1234.5);
        let (mut off, mut size) = (0.0, 0.0);
        for seed in 0..3 {
            let points = somewhere(seed, 5e5);
            let motion = motion(&sea, &points);
            for l in (0..LANES).step_by(3) {
                let [z, x, y] = exact(&sea, DVec2::new(points.x[l], points.y[l]), 1234.5);
                let got = [motion.dx[l], motion.dy[l], motion.dz[l]].map(f64::from);
                off += (got[2] - z).powi(2) + (got[0] - x).powi(2) + (got[1] - y).powi(2);
                size += z * z + x * x + y * y;
            }
        }
        let error = (off / size).sqrt();
        assert!(error < stated, "{samples} samples: {error} of the root mean square");
    }
}

#[test]
fn slopes_are_the_derivatives_of_heights() {
    let state = SeaState::beaufort(4.0, 0.6).expect("a state");
    let mut sea = Cascades::new(&state, &Options { samples: 64, ..Options::default() }).expect("a sea");
    sea.set_time(77.0);
    for footprint in [0.0, 0.3, 2.0] {
        let points = Points { footprint: [footprint; BLOCK], ..somewhere(3, 500.0) };
        let here = motion(&sea, &points);
        let mut only_displaced = Motion::STILL;
        sea.add_displacement(&points, &mut only_displaced);
        assert_eq!((here.dx, here.dy, here.dz), (only_displaced.dx, only_displaced.dy, only_displaced.dz));
        let step = 2e-3;
        let moved = |x: f64, y: f64| {
            let (px, py) = (points.x.map(|p| p + x), points.y.map(|p| p + y));
            motion(&sea, &Points { x: px, y: py, footprint: [footprint; BLOCK] })
        };
        let (east, west, north, south) = (moved(step, 0.0), moved(-step, 0.0), moved(0.0, step), moved(0.0, -step));
        let tolerance = 6e-3;
        for l in 0..LANES {
            let rise = |a: &[f32; BLOCK], b: &[f32; BLOCK]| f64::from(a[l] - b[l]) / (2.0 * step);
            assert!((rise(&east.dz, &west.dz) - f64::from(here.slope_x[l])).abs() < tolerance);
            assert!((rise(&north.dz, &south.dz) - f64::from(here.slope_y[l])).abs() < tolerance);
            assert!((rise(&east.dx, &west.dx) - f64::from(here.dxx[l])).abs() < tolerance + 0.02);
            assert!((rise(&north.dy, &south.dy) - f64::from(here.dyy[l])).abs() < tolerance + 0.02);
        }
    }
}

/// Variance of heights and mean direction of the sum of a tile's amplitudes, over what the state says.
#[test]
fn every_band_holds_its_energy() {
    let swell = SeaState::of_wind(11.0, 1.9, 3e5).expect("a wind").with_swell(1.5, 12.0, 0.4).expect("a swell");
    for state in [swell.clone(), SeaState { depth: 12.0, ..swell }] {
        let sea = Cascades::new(&state, &Options { samples: 128, ..Options::default() }).expect("a sea");
        let frequency = |k: f64| state.water().angular_frequency(k) / TAU;
        let mut total = 0.0;
        for patch in &sea.patches {
            let low = frequency(patch.tile.lowest.max(1e-3));
            let band = state.moment(0, low, frequency(patch.tile.highest));
            let held = patch.present[0][3];
            assert!((held / band - 1.0).abs() < 1e-3, "{:?}: {held} for {band}", patch.tile);
            total += held;
        }
        let height = 4.0 * libm::sqrt(total);
        assert!((height / state.significant_height() - 1.0).abs() < 0.01, "{height}");
    }
}

#[test]
fn records_have_the_height_period_and_direction_of_the_spectrum() {
    let state = SeaState { seed: 9, ..SeaState::of_wind(12.0, 0.8, 2e5).expect("a wind") };
    let options = Options { samples: 64, foam: false, choppiness: 0.0, highest: 3.0, ..Options::default() };
    let mut sea = Cascades::new(&state, &options).expect("a sea");
    let (dt, steps) = (0.4, 1500);
    let points = somewhere(11, 2e5);
    let (mut square, mut rate, mut flux) = (0.0, 0.0, DVec2::ZERO);
    let mut before: Option<[f32; BLOCK]> = None;
    for step in 0..steps {
        sea.set_time(f64::from(step) * dt);
        let now = motion(&sea, &points);
        for l in 0..LANES {
            square += f64::from(now.dz[l]).powi(2);
            if let Some(before) = before {
                let speed = f64::from(now.dz[l] - before[l]) / dt;
                rate += speed * speed;
                flux -= DVec2::new(now.slope_x[l].into(), now.slope_y[l].into()) * speed;
            }
        }
        before = Some(now.dz);
    }
    let count = (steps * BLOCK as i32) as f64;
    let frequency = |k: f64| state.water().angular_frequency(k) / TAU;
    let top = frequency(3.0);
    // A difference over dt sees sin²(π f dt) / (π dt)² of f².
    let seen = |f: f64| {
        let sine = libm::sin(0.5 * TAU * f * dt);
        sine * sine * 4.0 / (dt * dt)
    };
    let (m0, mut m2) = (state.moment(0, 0.02, top), 0.0);
    for i in 0..4000 {
        let f = 0.02 + (top - 0.02) * (f64::from(i) + 0.5) / 4000.0;
        m2 += state.density(f) * seen(f) * (top - 0.02) / 4000.0;
    }
    // A sea is one draw of some 150 waves that matter, each with its own energy: the standard error of a variance is about 8 %, that of a
    // direction 0.04.
    assert!((square / count / m0 - 1.0).abs() < 0.16, "variance {} for {m0}", square / count);
    assert!((rate / count / m2 - 1.0).abs() < 0.1, "rate {} for {m2}", rate / count);
    let periods = (square / rate).sqrt() / (m0 / m2).sqrt();
    assert!((periods - 1.0).abs() < 0.04, "mean period {periods} times that of the spectrum");
    assert!((flux.to_angle() - 0.8).abs() < 0.1, "towards {}", flux.to_angle());
}

/// All that a sea answers at some places.
fn all(sea: &Cascades) -> Vec<Motion> {
    (0..6)
        .map(|seed| Points { footprint: [[0.0, 0.7, 9.0][seed as usize % 3]; BLOCK], ..somewhere(seed, 3000.0) })
        .map(|points| motion(sea, &points))
        .collect()
}

fn windy(options: Options) -> Cascades {
    let state = SeaState::beaufort(7.0, -0.4).expect("a state");
    Cascades::new(&state, &Options { samples: 64, ..options }).expect("a sea")
}

#[test]
fn answers_depend_on_the_instant_alone() {
    let mut straight = windy(Options::default());
    straight.set_time(40.0);
    let expected = all(&straight);
    assert!(expected.iter().any(|m| m.foam.iter().any(|f| *f > 0.0)), "there is foam");
    for way in [&[41.0][..], &[39.9, 39.99, 40.3], &[-1e6, 1e9, 37.0], &[30.0, 39.0], &[f64::NAN, 25.1, 58.0]] {
        let mut sea = windy(Options::default());
        way.iter().for_each(|t| sea.set_time(*t));
        sea.set_time(40.0);
        assert_eq!(all(&sea), expected, "by way of {way:?}");
    }
}

#[test]
fn foam_does_not_depend_on_the_frame_rate() {
    let mut seas = [windy(Options::default()), windy(Options::default())];
    for frame in 0..60 {
        seas[0].set_time(f64::from(frame) / 30.0);
    }
    for frame in [0.0, 0.7, 1.1] {
        seas[1].set_time(frame);
    }
    seas.iter_mut().for_each(|sea| sea.set_time(2.0));
    assert_eq!(all(&seas[0]), all(&seas[1]));
}

#[test]
fn loops_come_back_to_the_bit() {
    let mut sea = windy(Options { period: Some(20.0), ..Options::default() });
    for start in [0.0, 3.25, 17.5] {
        sea.set_time(start);
        let first = all(&sea);
        sea.set_time(start + 20.0);
        assert_eq!(all(&sea), first);
        sea.set_time(start - 400.0);
        assert_eq!(all(&sea), first);
        sea.set_time(start + 10.0);
        assert_ne!(all(&sea), first);
    }
}

#[test]
fn bits_do_not_depend_on_threads_or_processor() {
    let mut best = windy(Options::default());
    best.set_time(12.3);
    let expected = all(&best);
    for (portable, threads) in [(true, false), (false, false), (false, true)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("a pool");
        pool.install(|| {
            let mut sea = windy(Options::default());
            sea.run = Run { portable, threads };
            sea.set_time(3.0);
            sea.set_time(12.3);
            assert_eq!(all(&sea), expected, "portable {portable}, threads {threads}");
            for (points, expected) in (0..2).map(|s| somewhere(3 * s, 3000.0)).zip(expected.iter().step_by(3)) {
                let mut motion = Motion::STILL;
                query::add_body(&sea.patches, &points, true, &mut motion);
                assert_eq!(motion, *expected);
            }
        });
    }
}

#[test]
fn wind_turns_and_grows_without_a_jump() {
    let state =
        |speed: f64, heading: f64| SeaState { seed: 4, ..SeaState::of_wind(speed, heading, 2e5).expect("a wind") };
    let states = [(10.0, state(6.0, 0.0)), (70.0, state(9.0, 0.4)), (130.0, state(14.0, 0.7))];
    let options = Options { samples: 64, ..Options::default() };
    let mut sea = Cascades::changing(&states, &options).expect("a sea");
    let points = somewhere(5, 1000.0);
    let height = |sea: &Cascades| 4.0 * libm::sqrt(sea.patches.iter().map(|p| p.present[0][3]).sum::<f64>());
    for (time, state) in &states {
        sea.set_time(*time);
        assert!((height(&sea) / state.significant_height() - 1.0).abs() < 0.02);
        // Going through a state is as smooth as the waves themselves.
        let heights = [-0.02, -0.01, 0.0, 0.01, 0.02].map(|off| {
            sea.set_time(time + off);
            motion(&sea, &points).dz.map(f64::from)
        });
        for l in 0..LANES {
            let bend = |i: usize| heights[i - 1][l] - 2.0 * heights[i][l] + heights[i + 1][l];
            assert!(bend(2).abs() < 2.0 * bend(1).abs().max(bend(3).abs()) + 2e-3, "{time}: {}", bend(2));
        }
    }
    sea.set_time(-50.0);
    let mut before = Cascades::changing(&states[..1], &options).expect("a sea");
    before.set_time(-50.0);
    assert!((height(&sea) / height(&before) - 1.0).abs() < 0.02);
    // Fixed states keep their crests: what runs at the end is what a sea of the last state alone would show on these tiles.
    sea.set_time(500.0);
    let tiles: Vec<Tile> = sea.tiles().copied().collect();
    let mut alone = Cascades::with_tiles(&states[2].1, &tiles, &options).expect("a sea");
    alone.set_time(500.0);
    assert_eq!(motion(&sea, &points).dz, motion(&alone, &points).dz);
}

#[test]
fn footprints_hide_what_they_leave_out() {
    let state = SeaState::beaufort(6.0, 0.3).expect("a state");
    let mut sea = Cascades::new(&state, &Options { samples: 64, foam: false, ..Options::default() }).expect("a sea");
    sea.set_time(3.0);
    let mut before: Option<f64> = None;
    let mut whole = 0.0;
    for i in 0..160 {
        let footprint = 0.01 * libm::pow(1.09, f64::from(i)) as f32;
        let (mut seen, mut hidden) = (0.0, 0.0);
        for seed in 0..40 {
            let m = motion(&sea, &Points { footprint: [footprint; BLOCK], ..somewhere(seed, 4000.0) });
            for l in 0..LANES {
                seen += f64::from(m.slope_x[l]).powi(2) + f64::from(m.slope_y[l]).powi(2);
                hidden += f64::from(m.hidden_xx[l] + m.hidden_yy[l]);
                assert!(m.hidden_xy[l] * m.hidden_xy[l] <= m.hidden_xx[l] * m.hidden_yy[l] * 1.0001);
            }
        }
        let count = 40.0 * LANES as f64;
        let (seen, hidden) = (seen / count, hidden / count);
        if i == 0 {
            whole = seen + hidden;
        }
        assert!((seen + hidden - whole).abs() < 0.15 * whole, "{footprint}: {seen} + {hidden} of {whole}");
        if let Some(before) = before {
            assert!(hidden >= before - 1e-7 && hidden - before < 0.04 * whole, "{footprint}: {before} to {hidden}");
        }
        before = Some(hidden);
    }
    assert!(before.expect("some") > 0.8 * whole);
}

#[test]
fn nothing_exceeds_the_bounds() {
    let state = SeaState::beaufort(7.0, -0.4).expect("a state");
    let tile = Tile { length: 500.0, turn: 0.3, samples: 64, lowest: 0.04, highest: 0.19 };
    let one = Cascades::with_tiles(&state, &[tile], &Options::default()).expect("a sea");
    // Maxima of several tiles hardly ever meet.
    for (mut sea, looseness) in [(one, 1.5), (windy(Options::default()), 6.0)] {
        sea.set_time(31.0);
        let bounds = sea.bounds();
        let mut most = Bounds::default();
        for seed in 0..1500 {
            let points = somewhere(seed, 1000.0);
            let m = motion(&sea, &points);
            for l in 0..LANES {
                most.height = most.height.max(m.dz[l].abs());
                most.sideways = most.sideways.max(m.dx[l].hypot(m.dy[l]));
                most.slope = most.slope.max(m.slope_x[l].hypot(m.slope_y[l]));
                let (mean, half) = (0.5 * (m.dxx[l] + m.dyy[l]), 0.5 * (m.dxx[l] - m.dyy[l]));
                most.stretch = most.stretch.max(mean.abs() + half.hypot(m.dxy[l]));
            }
        }
        assert!(most.height <= bounds.height && bounds.height < looseness * most.height, "{most:?} {bounds:?}");
        assert!(most.sideways <= bounds.sideways && bounds.sideways < looseness * most.sideways, "{most:?} {bounds:?}");
        assert!(most.slope <= bounds.slope && bounds.slope < looseness * most.slope, "{most:?} {bounds:?}");
        assert!(most.stretch <= bounds.stretch && bounds.stretch < looseness * most.stretch, "{most:?} {bounds:?}");
    }
    let sea = windy(Options::default());
    let roughness = [1e-3, 0.05, 0.5, 5.0, 50.0, 500.0, 5e4].map(|w| sea.roughness(w));
    assert!(roughness.windows(2).all(|w| w[0] <= w[1]) && roughness[0] == 0.0, "{roughness:?}");
    assert!(sea.roughness(f32::NAN) == 0.0);
}

#[test]
fn velocity_is_the_rate_of_the_motion() {
    let mut sea = windy(Options { foam: false, highest: 4.0, ..Options::default() });
    let points = somewhere(8, 2000.0);
    let dt = 0.01;
    sea.set_time(50.0 - dt);
    let before = motion(&sea, &points);
    sea.set_time(50.0 + dt);
    let after = motion(&sea, &points);
    sea.set_time(50.0);
    let mut velocity = Velocity::STILL;
    sea.add_velocity(&points, &[0.0; BLOCK], &mut velocity);
    let (mut off, mut size) = (0.0, 0.0);
    for l in 0..LANES {
        for (got, a, b) in
            [(velocity.x, before.dx, after.dx), (velocity.y, before.dy, after.dy), (velocity.z, before.dz, after.dz)]
        {
            let rate = f64::from(b[l] - a[l]) / (2.0 * dt);
            off += (f64::from(got[l]) - rate).powi(2);
            size += rate * rate;
        }
    }
    assert!((off / size).sqrt() < 0.05, "{} of the root mean square", (off / size).sqrt());
    // Deep down nothing moves, and nothing jumps on the way.
    let mut last: Option<Velocity> = None;
    for i in 0..400 {
        let mut velocity = Velocity::STILL;
        sea.add_velocity(&points, &[0.01 * 1.03_f32.powi(i); BLOCK], &mut velocity);
        if let Some(last) = last {
            assert!((0..LANES).all(|l| (velocity.z[l] - last.z[l]).abs() < 0.15), "at {i}");
        }
        last = Some(velocity);
    }
    assert_eq!(last.expect("some"), Velocity::STILL);
}

#[test]
fn whitecaps_cover_what_was_observed() {
    for beaufort in [3.0, 5.0, 7.0, 9.0, 10.0] {
        let state = SeaState::beaufort(beaufort, 0.6).expect("a state");
        let mut sea = Cascades::new(&state, &Options { samples: 128, ..Options::default() }).expect("a sea");
        let mut sum = 0.0;
        for time in [13.0, 57.0] {
            sea.set_time(time);
            for seed in 0..800 {
                sum += motion(&sea, &somewhere(seed, 9000.0)).foam.iter().sum::<f32>();
            }
        }
        let (cover, observed) = (f64::from(sum) / 25_600.0, foam::cover(state.wind.speed));
        assert!(cover > 0.45 * observed && cover < 2.2 * observed, "{beaufort} Beaufort: {cover} for {observed}");
    }
}

#[test]
fn nonsense_is_refused_and_never_answered() {
    let state = SeaState::beaufort(4.0, 0.0).expect("a state");
    let with = |change: &dyn Fn(&mut Options)| {
        let mut options = Options { samples: 64, ..Options::default() };
        change(&mut options);
        Cascades::new(&state, &options).err().map(|error| error.to_string())
    };
    let error = with(&|o| o.samples = 100).expect("refused");
    assert_eq!(error, "samples: expected a power of two from 64 to 1024, got 100");
    assert!(with(&|o| o.choppiness = f64::NAN).is_some());
    assert!(with(&|o| o.period = Some(0.0)).is_some());
    assert!(with(&|o| o.lowest = -1.0).is_some());
    assert!(with(&|o| o.highest = 0.0).is_some());
    assert!(Cascades::new(&SeaState { depth: 0.0, ..state.clone() }, &Options::default()).is_err());
    assert!(Cascades::changing(&[], &Options::default()).is_err());
    assert!(Cascades::changing(&[(1.0, state.clone()), (1.0, state.clone())], &Options::default()).is_err());
    let tile = Tile { length: 100.0, turn: 0.0, samples: 64, lowest: 0.0, highest: 10.0 };
    assert!(Cascades::with_tiles(&state, &[tile], &Options::default()).is_err(), "more than 64 samples carry");
    // Waves up to what the samples can carry are summed too.
    let full = Tile { highest: 2.0, ..tile };
    assert!(Cascades::with_tiles(&state, &[full], &Options::default()).is_ok());

    let mut sea = Cascades::new(&state, &Options { samples: 64, ..Options::default() }).expect("a sea");
    let strange = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e18, f64::MIN_POSITIVE, -0.0, 1e-300];
    for time in strange {
        sea.set_time(time);
        let mut points = Points::at(0.0, 0.0);
        for l in 0..BLOCK {
            (points.x[l], points.y[l]) = (strange[l % 8], strange[(l + l / 8) % 8]);
            points.footprint[l] = [0.0, f32::NAN, f32::INFINITY, -1.0, 1e-30, 1e30][l % 6];
        }
        let m = motion(&sea, &points);
        let mut velocity = Velocity::STILL;
        sea.add_velocity(&points, &std::array::from_fn(|l| [0.0, f32::NAN, f32::INFINITY, -1.0][l % 4]), &mut velocity);
        let fields =
            [m.dx, m.dy, m.dz, m.slope_x, m.dxx, m.dxy, m.foam, m.hidden_xx, m.hidden_xy, velocity.x, velocity.z];
        assert!(fields.iter().flatten().all(|number| number.is_finite()), "{time}");
    }
    let mut calm = Cascades::new(&SeaState::CALM, &Options::default()).expect("a calm");
    calm.set_time(5.0);
    assert_eq!(motion(&calm, &Points::at(3.0, 4.0)), Motion::STILL);
    assert_eq!((calm.bounds(), calm.roughness(10.0)), (Bounds::default(), 0.0));
}
