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
