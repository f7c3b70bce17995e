//! Sums of plane waves at any points.
//!
//! Each wave's phase is found in `f64` at the middle of the point's cell of [`CELL`] metres, then carried to the point in `f32` turns, so that
//! distance and time cost no accuracy. Cosine and sine come from one pair of polynomials: with r the phase less the nearest whole turn and
//! v = |r| − ¼, cos 2πr = −sin 2πv is odd in v and sin 2πr = ±cos 2πv even, on |v| ≤ ¼ only. Both are scaled to a leading coefficient of 1
//! (the scale goes into the waves), which makes their first step an addition. They err by less than 6·10⁻⁷ and 5·10⁻⁸ (Lawson's
//! iteration for the best approximation: C. Lawson, *Contributions to the theory of linear least maximum approximation*, 1961).
//!
//! Points of a block that share a cell share their phases there; others pay for their own. Either way a point's answer has the same
//! bits. Waves are sorted from short to long: a footprint hides a prefix of them, whose slopes are known beforehand, and fades the next few.

use super::{BLOCK, Bounds, Motion, OutOfRange, PlaneWave, Points, StillWater, Velocity};
use multiversion::multiversion;
use std::f64::consts::TAU;

/// Edge of the squares (m) that share a phase in `f64`: within one, phases in `f32` err by less than 10⁻⁶ of a turn for waves above 10 m, and
/// grow only as fast as such waves lose height.
const CELL: f64 = 256.0;

/// Farthest coordinate (m) that is told apart: beyond, phases would have lost all their digits.
const FARTHEST: f64 = 1e12;

/// How many waves' phases are held at once.
const CHUNK: usize = 64;

/// Most waves in a sum.
pub(crate) const MOST_WAVES: usize = 1 << 16;

/// cos 2πr = `COSINE` · v · p(v²), v = |r| − ¼, p = (((v² + c₂) v² + c₁) v² + c₀).
const COSINE: f64 = 70.993_429_954_819_4;
const C0: f32 = -0.088_503_458;
const C1: f32 = 0.582_267_15;
const C2: f32 = -1.145_750_7;

/// sin 2πr = ± `SINE` · q(v²), with the sign of r.
const SINE: f64 = 56.242_380_482_363_19;
const S0: f32 = 0.017_780_185;
const S1: f32 = -0.350_966_14;
const S2: f32 = 1.154_549_1;
const S3: f32 = -1.515_589;

type Lanes = [f32; BLOCK];

/// What the inner loops read of a wave, in turns and scaled to the polynomials.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Hot {
    /// Turns per metre.
    kx: f32,
    ky: f32,
    /// Height (m).
    height: f32,
    /// ∂/∂X and ∂/∂Y of the height.
    tilt_x: f32,
    tilt_y: f32,
    /// Sideways displacement (m).
    push_x: f32,
    push_y: f32,
    /// Its derivatives.
    stretch_xx: f32,
    stretch_xy: f32,
    stretch_yy: f32,
    /// Wavelength (m).
    length: f32,
    /// Velocities at the surface (m/s), scaled for the depth: see [`Wave::flow`].
    flow_x: f32,
    flow_y: f32,
    flow_z: f32,
    /// Binary orders by which motion dies out in a metre of depth, at most 0.
    decay: f32,
}

/// A wave of a sum: a plane wave and how far it pushes water sideways, in parts of its height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pushing {
    pub wave: PlaneWave,
    pub push: f64,
}

/// A sum of plane waves over water of one depth at an instant.
#[derive(Clone, Debug)]
pub(crate) struct Sum {
    water: StillWater,
    /// Short waves first.
    waves: Vec<Pushing>,
    hot: Vec<Hot>,
    /// Turns per metre.
    kx: Vec<f64>,
    ky: Vec<f64>,
    /// Turns at the origin at this instant.
    turns: Vec<f64>,
    /// Covariances of each wave's slopes, xx, xy, yy, and of those of all waves before each.
    slopes: Vec<[f32; 3]>,
    hidden: Vec<[f32; 3]>,
    /// Greatest height or push (m) of all waves before each.
    rough: Vec<f32>,
    bounds: Bounds,
    pushes: bool,
}

impl Sum {
    pub(crate) fn new(waves: impl IntoIterator<Item = Pushing>, water: StillWater) -> Result<Sum, OutOfRange> {
        let water = water.checked()?;
        let mut waves: Vec<Pushing> = waves.into_iter().collect();
        let count = waves.len();
        OutOfRange::unless(count <= MOST_WAVES, "waves", "at most 65 536 waves", count as f64)?;
        for Pushing { wave, push } in &waves {
            let k = wave.wavenumber.length();
            OutOfRange::unless((1e-6..=1e4).contains(&k), "wave number", "rad/m, from 1e-6 to 1e4", k)?;
            let fits = (0.0..=1e4).contains(&wave.amplitude);
            OutOfRange::unless(fits, "amplitude", "m, from 0 to 10 000", wave.amplitude)?;
            let fits = (0.0..=1e4).contains(&wave.angular_frequency);
            OutOfRange::unless(fits, "angular frequency", "rad/s, from 0 to 10 000", wave.angular_frequency)?;
            OutOfRange::unless(wave.phase.abs() <= 1e6, "phase", "rad, within ±1e6", wave.phase)?;
            OutOfRange::unless((0.0..=1e4).contains(push), "steepness", "a number from 0 to 10 000", *push)?;
        }
        waves.sort_by(|a, b| b.wave.wavenumber.length_squared().total_cmp(&a.wave.wavenumber.length_squared()));
        let (mut slopes, mut hidden, mut rough) = (Vec::new(), vec![[0f32; 3]], vec![0f32]);
        let mut bounds = [0.0; 6];
        for Pushing { wave, push } in &waves {
            let (a, k) = (wave.amplitude, wave.wavenumber);
            let half = 0.5 * a * a;
            let covariance = [half * k.x * k.x, half * k.x * k.y, half * k.y * k.y].map(|number| number as f32);
            let before = hidden[hidden.len() - 1];
            slopes.push(covariance);
            hidden.push([0, 1, 2].map(|i| before[i] + covariance[i]));
            rough.push(rough[rough.len() - 1] + (a * push.max(1.0)) as f32);
            let k = k.length();
            for (sum, part) in bounds.iter_mut().zip([a, push * a, k * a, push * k * a, k * k * a, push * k * k * a]) {
                *sum += part;
            }
        }
        // A little above the sums, for what `f32` rounds.
        let [height, sideways, slope, stretch, curvature, bend] = bounds.map(|sum| (sum * (1.0 + 1e-5)) as f32);
        let mut sum = Sum {
            water,
            hot: waves.iter().map(|wave| Hot::new(wave, water)).collect(),
            kx: waves.iter().map(|w| w.wave.wavenumber.x / TAU).collect(),
            ky: waves.iter().map(|w| w.wave.wavenumber.y / TAU).collect(),
            turns: vec![0.0; waves.len()],
            pushes: waves.iter().any(|w| w.push > 0.0),
            waves,
            slopes,
            hidden,
            rough,
            bounds: Bounds { height, sideways, slope, stretch, curvature, bend },
        };
        sum.set_time(0.0);
        Ok(sum)
    }
}

impl Hot {
    fn new(pushing: &Pushing, water: StillWater) -> Hot {
        let Pushing { wave, push } = pushing;
        let (a, k) = (wave.amplitude, wave.wavenumber);
        let (length, along) = (k.length(), k / k.length());
        // Of cosh(k(h−d)) / sinh(kh) = (e^−kd + e^−k(2h−d)) / (1 − e^−2kh), and likewise with sinh and a difference.
        let flow = a * wave.angular_frequency / -libm::expm1(-2.0 * length * water.depth);
        Hot {
            kx: (k.x / TAU) as f32,
            ky: (k.y / TAU) as f32,
            height: (a * COSINE) as f32,
            tilt_x: (-a * k.x * SINE) as f32,
            tilt_y: (-a * k.y * SINE) as f32,
            push_x: (-push * a * along.x * SINE) as f32,
            push_y: (-push * a * along.y * SINE) as f32,
            stretch_xx: (-push * a * along.x * k.x * COSINE) as f32,
            stretch_xy: (-push * a * along.x * k.y * COSINE) as f32,
            stretch_yy: (-push * a * along.y * k.y * COSINE) as f32,
            length: (TAU / length) as f32,
            flow_x: (flow * along.x * COSINE) as f32,
            flow_y: (flow * along.y * COSINE) as f32,
            flow_z: (flow * SINE) as f32,
            decay: (-length * std::f64::consts::LOG2_E) as f32,
        }
    }
}

impl Sum {
    pub(crate) fn waves(&self) -> &[Pushing] {
        &self.waves
    }

    pub(crate) fn water(&self) -> StillWater {
        self.water
    }

    /// Goes to an instant (s).
    pub(crate) fn set_time(&mut self, seconds: f64) {
        for (turns, Pushing { wave, .. }) in self.turns.iter_mut().zip(&self.waves) {
            let all = wave.phase / TAU - wave.angular_frequency / TAU * seconds;
            *turns = all - all.round_ties_even();
        }
    }

    pub(crate) fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        add_displacement(self, points, motion);
    }

    pub(crate) fn add_motion(&self, points: &Points, motion: &mut Motion) {
        add_motion(self, points, motion);
    }

    pub(crate) fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        add_velocity(self, points, depths, velocity);
    }

    pub(crate) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Greatest height or push of the waves shorter than `wavelength` (m).
    pub(crate) fn roughness(&self, wavelength: f32) -> f32 {
        self.rough[self.hot.partition_point(|hot| hot.length < wavelength)]
    }
}

/// A block of points, each beside the middle of its cell.
struct Local {
    x: Lanes,
    y: Lanes,
    cell_x: [f64; BLOCK],
    cell_y: [f64; BLOCK],
    one_cell: bool,
    /// Half the inverse of the footprint (1/m).
    fineness: Lanes,
    /// First wave that is not hidden from all, and first that is whole for all.
    hidden: usize,
    whole: usize,
}

/// How much of a wave is left in a footprint: none of one shorter than twice that, all of one twice as long again.
#[inline(always)]
fn left(length: f32, fineness: f32) -> f32 {
    length.mul_add(fineness, -1.0).clamp(0.0, 1.0)
}

#[inline(always)]
fn localise(sum: &Sum, points: &Points) -> Local {
    let mut local = Local {
        x: [0.0; BLOCK],
        y: [0.0; BLOCK],
        cell_x: [0.0; BLOCK],
        cell_y: [0.0; BLOCK],
        one_cell: true,
        fineness: [f32::INFINITY; BLOCK],
        hidden: 0,
        whole: 0,
    };
    let (mut narrowest, mut widest) = (f32::INFINITY, 0f32);
    let mut apart = 0u64;
    for lane in 0..BLOCK {
        // Written so that what is not a number becomes a number.
        let x = points.x[lane].max(-FARTHEST).min(FARTHEST);
        let y = points.y[lane].max(-FARTHEST).min(FARTHEST);
        let (cell_x, cell_y) =
            ((x * (1.0 / CELL)).floor() * CELL + 0.5 * CELL, (y * (1.0 / CELL)).floor() * CELL + 0.5 * CELL);
        local.x[lane] = (x - cell_x) as f32;
        local.y[lane] = (y - cell_y) as f32;
        local.cell_x[lane] = cell_x;
        local.cell_y[lane] = cell_y;
        apart |= (cell_x.to_bits() ^ local.cell_x[0].to_bits()) | (cell_y.to_bits() ^ local.cell_y[0].to_bits());
        let footprint = points.footprint[lane].max(0.0);
        narrowest = narrowest.min(footprint);
        widest = widest.max(footprint);
        local.fineness[lane] = 0.5 / footprint;
    }
    local.one_cell = apart == 0;
    if widest > 0.0 {
        local.hidden = sum.hot.partition_point(|hot| left(hot.length, 0.5 / narrowest) == 0.0);
        local.whole = sum.hot.partition_point(|hot| left(hot.length, 0.5 / widest) < 1.0);
    }
    local
}

/// Sums, as many as [`Motion`] has.
struct Sums {
    height: Lanes,
    tilt_x: Lanes,
    tilt_y: Lanes,
    push_x: Lanes,
    push_y: Lanes,
    stretch_xx: Lanes,
    stretch_xy: Lanes,
    stretch_yy: Lanes,
}

const HEIGHTS: u8 = 0;
const DISPLACEMENTS: u8 = 1;
const SLOPES: u8 = 2;
const EVERYTHING: u8 = 3;

/// Adds waves `from..to` to `sums`.
#[inline(always)]
fn add_waves<const WHAT: u8, const ONE_CELL: bool, const FADING: bool>(
    sum: &Sum,
    local: &Local,
    from: usize,
    to: usize,
    sums: &mut Sums,
) {
    let tilts = WHAT == SLOPES || WHAT == EVERYTHING;
    let pushes = WHAT == DISPLACEMENTS || WHAT == EVERYTHING;
    let stretches = WHAT == EVERYTHING;
    let Sums { mut height, mut tilt_x, mut tilt_y, mut push_x, mut push_y, .. } = *sums;
    let Sums { mut stretch_xx, mut stretch_xy, mut stretch_yy, .. } = *sums;
    let (x, y, fineness) = (local.x, local.y, local.fineness);
    let mut shared = [0f32; CHUNK];
    let mut first = from;
    while first < to {
        let last = to.min(first + CHUNK);
        let hot = &sum.hot[first..last];
        let (kx, ky, turns) = (&sum.kx[first..last], &sum.ky[first..last], &sum.turns[first..last]);
        if ONE_CELL {
            let (cell_x, cell_y) = (local.cell_x[0], local.cell_y[0]);
            for (((shared, kx), ky), turns) in shared.iter_mut().zip(kx).zip(ky).zip(turns) {
                *shared = phase(*kx, *ky, *turns, cell_x, cell_y);
            }
        }
        for i in 0..hot.len() {
            let wave = hot[i];
            let mut own = [0f32; BLOCK];
            if !ONE_CELL {
                for lane in 0..BLOCK {
                    own[lane] = phase(kx[i], ky[i], turns[i], local.cell_x[lane], local.cell_y[lane]);
                }
            }
            for lane in 0..BLOCK {
                let start = if ONE_CELL { shared[i] } else { own[lane] };
                let turns = wave.kx.mul_add(x[lane], wave.ky.mul_add(y[lane], start));
                let r = turns - turns.round_ties_even();
                let v = r.abs() - 0.25;
                let u = v * v;
                let mut cosine = v * (u + C2).mul_add(u, C1).mul_add(u, C0);
                let mut sine = 0.0;
                if tilts || pushes {
                    let even = (u + S3).mul_add(u, S2).mul_add(u, S1).mul_add(u, S0);
                    sine = f32::from_bits(even.to_bits() ^ (r.to_bits() & (1 << 31)));
                }
                if FADING {
                    let left = left(wave.length, fineness[lane]);
                    cosine *= left;
                    sine *= left;
                }
                height[lane] = wave.height.mul_add(cosine, height[lane]);
                if tilts {
                    tilt_x[lane] = wave.tilt_x.mul_add(sine, tilt_x[lane]);
                    tilt_y[lane] = wave.tilt_y.mul_add(sine, tilt_y[lane]);
                }
                if pushes {
                    push_x[lane] = wave.push_x.mul_add(sine, push_x[lane]);
                    push_y[lane] = wave.push_y.mul_add(sine, push_y[lane]);
                }
                if stretches {
                    stretch_xx[lane] = wave.stretch_xx.mul_add(cosine, stretch_xx[lane]);
                    stretch_xy[lane] = wave.stretch_xy.mul_add(cosine, stretch_xy[lane]);
                    stretch_yy[lane] = wave.stretch_yy.mul_add(cosine, stretch_yy[lane]);
                }
            }
        }
        first = last;
    }
    *sums = Sums { height, tilt_x, tilt_y, push_x, push_y, stretch_xx, stretch_xy, stretch_yy };
}

/// A wave's phase in the middle of a cell, in turns within ±½.
#[inline(always)]
fn phase(kx: f64, ky: f64, turns: f64, x: f64, y: f64) -> f32 {
    let all = kx.mul_add(x, ky.mul_add(y, turns));
    (all - all.round_ties_even()) as f32
}

#[inline(always)]
fn add_all<const WHAT: u8>(sum: &Sum, local: &Local, sums: &mut Sums) {
    let count = sum.hot.len();
    if local.one_cell {
        if local.hidden < local.whole {
            add_waves::<WHAT, true, true>(sum, local, local.hidden, local.whole, sums);
        }
        add_waves::<WHAT, true, false>(sum, local, local.whole, count, sums);
    } else {
        // What makes these slow are their phases.
        add_waves::<WHAT, false, true>(sum, local, local.hidden, count, sums);
    }
}

const STILL: Sums = Sums {
    height: [0.0; BLOCK],
    tilt_x: [0.0; BLOCK],
    tilt_y: [0.0; BLOCK],
    push_x: [0.0; BLOCK],
    push_y: [0.0; BLOCK],
    stretch_xx: [0.0; BLOCK],
    stretch_xy: [0.0; BLOCK],
    stretch_yy: [0.0; BLOCK],
};

#[inline(always)]
fn add(to: &mut Lanes, what: &Lanes) {
    for lane in 0..BLOCK {
        to[lane] += what[lane];
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_displacement(sum: &Sum, points: &Points, motion: &mut Motion) {
    let (local, mut sums) = (localise(sum, points), STILL);
    if sum.pushes {
        add_all::<DISPLACEMENTS>(sum, &local, &mut sums);
        add(&mut motion.dx, &sums.push_x);
        add(&mut motion.dy, &sums.push_y);
    } else {
        add_all::<HEIGHTS>(sum, &local, &mut sums);
    }
    add(&mut motion.dz, &sums.height);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_motion(sum: &Sum, points: &Points, motion: &mut Motion) {
    let (local, mut sums) = (localise(sum, points), STILL);
    if sum.pushes {
        add_all::<EVERYTHING>(sum, &local, &mut sums);
        add(&mut motion.dx, &sums.push_x);
        add(&mut motion.dy, &sums.push_y);
        add(&mut motion.dxx, &sums.stretch_xx);
        add(&mut motion.dxy, &sums.stretch_xy);
        add(&mut motion.dyy, &sums.stretch_yy);
    } else {
        add_all::<SLOPES>(sum, &local, &mut sums);
    }
    add(&mut motion.dz, &sums.height);
    add(&mut motion.slope_x, &sums.tilt_x);
    add(&mut motion.slope_y, &sums.tilt_y);
    if local.whole > 0 {
        let [mut xx, mut xy, mut yy] = sum.hidden[local.hidden].map(|hidden| [hidden; BLOCK]);
        for i in local.hidden..local.whole {
            // Differences of these sums are not taken, so that a lane's bits do not depend on its neighbours.
            let part = sum.slopes[i];
            for lane in 0..BLOCK {
                let left = left(sum.hot[i].length, local.fineness[lane]);
                let lost = left.mul_add(-left, 1.0);
                xx[lane] = lost.mul_add(part[0], xx[lane]);
                xy[lane] = lost.mul_add(part[1], xy[lane]);
                yy[lane] = lost.mul_add(part[2], yy[lane]);
            }
        }
        add(&mut motion.hidden_xx, &xx);
        add(&mut motion.hidden_xy, &xy);
        add(&mut motion.hidden_yy, &yy);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_velocity(sum: &Sum, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
    let local = localise(sum, points);
    let bed = sum.water.depth as f32;
    let (mut x, mut y, mut z) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    // Twice the water's depth less the point's, and whether the point is in the water.
    let (mut deep, mut mirrored, mut wet) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    for lane in 0..BLOCK {
        deep[lane] = depths[lane].max(0.0).min(1e9);
        mirrored[lane] = bed - deep[lane] + bed;
        wet[lane] = if deep[lane] <= bed { 1.0 } else { 0.0 };
    }
    for i in local.hidden..sum.hot.len() {
        let wave = sum.hot[i];
        for lane in 0..BLOCK {
            let start = phase(sum.kx[i], sum.ky[i], sum.turns[i], local.cell_x[lane], local.cell_y[lane]);
            let turns = wave.kx.mul_add(local.x[lane], wave.ky.mul_add(local.y[lane], start));
            let r = turns - turns.round_ties_even();
            let v = r.abs() - 0.25;
            let u = v * v;
            let cosine = v * (u + C2).mul_add(u, C1).mul_add(u, C0);
            let even = (u + S3).mul_add(u, S2).mul_add(u, S1).mul_add(u, S0);
            let sine = f32::from_bits(even.to_bits() ^ (r.to_bits() & (1 << 31)));
            let (down, up) = (power_of_two(wave.decay * deep[lane]), power_of_two(wave.decay * mirrored[lane]));
            let left = left(wave.length, local.fineness[lane]) * wet[lane];
            let across = (down + up) * left * cosine;
            x[lane] = wave.flow_x.mul_add(across, x[lane]);
            y[lane] = wave.flow_y.mul_add(across, y[lane]);
            z[lane] = (wave.flow_z * (down - up)).mul_add(sine * left, z[lane]);
        }
    }
    add(&mut velocity.x, &x);
    add(&mut velocity.y, &y);
    add(&mut velocity.z, &z);
}

/// 2^x for x ≤ 0, to 2·10⁻⁷ of it; 2^−126 for all below.
#[inline(always)]
fn power_of_two(x: f32) -> f32 {
    // Adding this leaves the nearest whole number in the low bits.
    const SHIFT: f32 = 12_582_912.0;
    let shifted = x.max(-126.0) + SHIFT;
    let f = x.max(-126.0) - (shifted - SHIFT);
    let p = 0.000_154_035_3_f32.mul_add(f, 0.001_333_355_8).mul_add(f, 0.009_618_129).mul_add(f, 0.055_504_11);
    let p = p.mul_add(f, 0.240_226_51).mul_add(f, std::f32::consts::LN_2).mul_add(f, 1.0);
    p * f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23))
}
