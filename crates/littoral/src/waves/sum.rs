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
use glam::DVec2;
use multiversion::multiversion;
use std::f64::consts::TAU;

mod grid;

pub use grid::{Grid, GridScratch};

/// Edge of the squares (m) that share a phase in `f64`: within one, phases in `f32` err by less than 10⁻⁶ of a turn for waves above 10 m, and
/// grow only as fast as such waves lose height.
const CELL: f64 = 256.0;

/// Farthest coordinate (m): beyond, where phases have lost all their digits, answers are those of the origin.
const FARTHEST: f64 = 1e12;

/// How many waves' phases are held at once.
const CHUNK: usize = 512;

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
    /// Turns per metre along its way.
    k: f32,
    /// Height (m).
    height: f32,
    /// Slope, sideways displacement (m) and its derivative, along its way.
    tilt: f32,
    push: f32,
    stretch: f32,
    /// Turns per metre.
    kx: f32,
    ky: f32,
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
    /// Fan by fan, in each short waves first.
    waves: Vec<Pushing>,
    hot: Vec<Hot>,
    fans: Vec<Fan>,
    /// Whether the waves of a fan run one way; otherwise there is one fan, and each wave has its own way.
    fanned: bool,
    /// Turns per metre, and turns at the origin at the instant, within ±½; filled up to whole eights.
    kx: Vec<f64>,
    ky: Vec<f64>,
    turns: Vec<f64>,
    /// Covariances of each wave's slopes, xx, xy, yy, and of those of its fan up to it.
    slopes: Vec<[f32; 3]>,
    hidden: Vec<[f32; 3]>,
    /// All wavelengths (m), short ones first, and the greatest height or push (m) of all waves up to each.
    rough: Vec<[f32; 2]>,
    bounds: Bounds,
    pushes: bool,
}

/// Waves `from..to`, which run one way.
#[derive(Clone, Copy, Debug)]
struct Fan {
    /// That way, of length 1.
    along: DVec2,
    from: usize,
    to: usize,
}

/// Fewest waves in a fan, on average, for which fans pay.
const FAN: usize = 4;

impl Sum {
    pub(crate) fn new(waves: impl IntoIterator<Item = Pushing>, water: StillWater) -> Result<Sum, OutOfRange> {
        let water = water.checked()?;
        let mut waves: Vec<Pushing> = waves.into_iter().collect();
        let count = waves.len();
        OutOfRange::unless(count <= MOST_WAVES, "waves", "at most 65 536 waves", count as f64)?;
        waves.iter().try_for_each(Pushing::check)?;
        let (fans, fanned) = fans(&mut waves);
        let (mut slopes, mut hidden) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for fan in &fans {
            let mut sum = [0f32; 3];
            for Pushing { wave, .. } in &waves[fan.from..fan.to] {
                let (half, k) = (0.5 * wave.amplitude * wave.amplitude, wave.wavenumber);
                let own = [half * k.x * k.x, half * k.x * k.y, half * k.y * k.y].map(|number| number as f32);
                sum = [0, 1, 2].map(|i| sum[i] + own[i]);
                slopes.push(own);
                hidden.push(sum);
            }
        }
        let mut bounds = [0.0; 6];
        for Pushing { wave, push } in &waves {
            let (a, k) = (wave.amplitude, wave.wavenumber.length());
            for (sum, part) in bounds.iter_mut().zip([a, push * a, k * a, push * k * a, k * k * a, push * k * k * a]) {
                *sum += part;
            }
        }
        // A little above the sums, for what `f32` rounds.
        let [height, sideways, slope, stretch, curvature, bend] = bounds.map(|sum| (sum * (1.0 + 1e-5)) as f32);
        let hot: Vec<Hot> = waves.iter().map(|wave| Hot::new(wave, water)).collect();
        let mut sum = Sum {
            water,
            rough: rough(&waves, &hot),
            hot,
            fans,
            fanned,
            kx: padded(&waves, |wave| wave.wavenumber.x / TAU),
            ky: padded(&waves, |wave| wave.wavenumber.y / TAU),
            turns: padded(&waves, |_| 0.0),
            pushes: waves.iter().any(|w| w.push > 0.0),
            waves,
            slopes,
            hidden,
            bounds: Bounds { height, sideways, slope, stretch, curvature, bend },
        };
        sum.set_time(0.0);
        Ok(sum)
    }
}

/// Sorts waves into fans, and tells whether these run one way each.
fn fans(waves: &mut [Pushing]) -> (Vec<Fan>, bool) {
    let shorter =
        |a: &Pushing, b: &Pushing| b.wave.wavenumber.length_squared().total_cmp(&a.wave.wavenumber.length_squared());
    let heading = |w: &Pushing| libm::atan2(w.wave.wavenumber.y, w.wave.wavenumber.x);
    waves.sort_by(|a, b| heading(a).total_cmp(&heading(b)));
    // Closer than this, a point within a cell is no farther along the one than along the other than `f32` tells.
    let same = |a: &Pushing, b: &Pushing| (heading(a) - heading(b)).abs() < 1e-9;
    let mut fans = Vec::new();
    let mut from = 0;
    for fan in waves.chunk_by_mut(same) {
        fan.sort_by(shorter);
        let to = from + fan.len();
        fans.push(Fan { along: fan[0].wave.wavenumber.normalize(), from, to });
        from = to;
    }
    if FAN * fans.len() <= from {
        return (fans, true);
    }
    waves.sort_by(shorter);
    (vec![Fan { along: DVec2::ZERO, from: 0, to: from }], false)
}

/// All wavelengths, short ones first, and the greatest height or push of all waves up to each.
fn rough(waves: &[Pushing], hot: &[Hot]) -> Vec<[f32; 2]> {
    let own = |(w, hot): (&Pushing, &Hot)| [hot.length, (w.wave.amplitude * w.push.max(1.0)) as f32];
    let mut rough: Vec<[f32; 2]> = waves.iter().zip(hot).map(own).collect();
    rough.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut sum = 0.0;
    for [_, own] in &mut rough {
        sum += *own;
        *own = sum;
    }
    rough
}

impl Pushing {
    fn check(&self) -> Result<(), OutOfRange> {
        let Pushing { wave, push } = self;
        let k = wave.wavenumber.length();
        OutOfRange::unless((1e-6..=1e4).contains(&k), "wave number", "rad/m, from 1e-6 to 1e4", k)?;
        let fits = (0.0..=1e4).contains(&wave.amplitude);
        OutOfRange::unless(fits, "amplitude", "m, from 0 to 10 000", wave.amplitude)?;
        let fits = (0.0..=1e4).contains(&wave.angular_frequency);
        OutOfRange::unless(fits, "angular frequency", "rad/s, from 0 to 10 000", wave.angular_frequency)?;
        OutOfRange::unless(wave.phase.abs() <= 1e6, "phase", "rad, within ±1e6", wave.phase)?;
        OutOfRange::unless((0.0..=1e4).contains(push), "steepness", "a number from 0 to 10 000", *push)
    }
}

/// A number of each wave, filled up to whole eights.
fn padded(waves: &[Pushing], number: impl Fn(&PlaneWave) -> f64) -> Vec<f64> {
    let mut numbers: Vec<f64> = waves.iter().map(|pushing| number(&pushing.wave)).collect();
    numbers.resize(waves.len().next_multiple_of(8), 0.0);
    numbers
}

impl Hot {
    fn new(pushing: &Pushing, water: StillWater) -> Hot {
        let Pushing { wave, push } = pushing;
        let (a, k) = (wave.amplitude, wave.wavenumber);
        let (length, along) = (k.length(), k / k.length());
        // Of cosh(k(h−d)) / sinh(kh) = (e^−kd + e^−k(2h−d)) / (1 − e^−2kh), and likewise with sinh and a difference.
        let flow = a * wave.angular_frequency / -libm::expm1(-2.0 * length * water.depth);
        Hot {
            k: (length / TAU) as f32,
            kx: (k.x / TAU) as f32,
            ky: (k.y / TAU) as f32,
            height: (a * COSINE) as f32,
            tilt: (-a * length * SINE) as f32,
            push: (-push * a * SINE) as f32,
            stretch: (-push * a * length * COSINE) as f32,
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

    /// Displacements of many blocks: to the bit those of each.
    pub(crate) fn add_displacements(&self, points: &[Points], motions: &mut [Motion]) {
        add_displacements(self, points, motions);
    }

    /// Motions of many blocks: to the bit those of each.
    pub(crate) fn add_motions(&self, points: &[Points], motions: &mut [Motion]) {
        add_motions(self, points, motions);
    }

    /// Heights (m) at places; they must not be pushed sideways.
    pub(crate) fn heights_at(&self, places: &[DVec2], heights: &mut [f32]) {
        heights_at(self, places, heights);
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
        match self.rough.partition_point(|[length, _]| *length < wavelength) {
            0 => 0.0,
            shorter => self.rough[shorter - 1][1],
        }
    }
}

/// Points, each beside the middle of its cell.
struct Local<const W: usize> {
    x: [f32; W],
    y: [f32; W],
    /// Those of a block; more points have one cell, and no footprints.
    cell_x: [f64; BLOCK],
    cell_y: [f64; BLOCK],
    one_cell: bool,
    /// Half the inverse of the footprint (1/m), and that of the narrowest and the widest.
    fineness: [f32; BLOCK],
    finest: f32,
    coarsest: f32,
}

/// How much of a wave is left in a footprint: none of one shorter than twice that, all of one twice as long again.
#[inline(always)]
fn left(length: f32, fineness: f32) -> f32 {
    length.mul_add(fineness, -1.0).clamp(0.0, 1.0)
}

/// Coordinates as distances from the middles of their cells, and those middles (m); 0 for what is not a number.
#[inline(always)]
fn beside_cell<const W: usize>(coordinates: &[f64; W]) -> ([f32; W], [f64; W]) {
    let (mut beside, mut middle) = ([0f32; W], [0f64; W]);
    for lane in 0..W {
        let at = coordinates[lane];
        let at = if at.abs() <= FARTHEST { at } else { 0.0 };
        middle[lane] = (at * (1.0 / CELL)).floor() * CELL + 0.5 * CELL;
        beside[lane] = (at - middle[lane]) as f32;
    }
    (beside, middle)
}

#[inline(always)]
fn all_equal<const W: usize>(numbers: &[f64; W]) -> bool {
    // By bits and without branches.
    let mut apart = 0;
    for lane in 0..W {
        apart |= numbers[lane].to_bits() ^ numbers[0].to_bits();
    }
    apart == 0
}

#[inline(always)]
fn localise(points: &Points) -> Local<BLOCK> {
    let (x, cell_x) = beside_cell(&points.x);
    let (y, cell_y) = beside_cell(&points.y);
    let one_cell = all_equal(&cell_x) && all_equal(&cell_y);
    // Without branches, so that it takes a few instructions for all lanes.
    let mut wide = false;
    for lane in 0..BLOCK {
        wide |= points.footprint[lane] > 0.0;
    }
    let fineness = [f32::INFINITY; BLOCK];
    let mut local = Local { x, y, cell_x, cell_y, one_cell, fineness, finest: f32::INFINITY, coarsest: f32::INFINITY };
    if wide {
        let (mut narrowest, mut widest) = (f32::INFINITY, 0f32);
        for lane in 0..BLOCK {
            let footprint = points.footprint[lane].max(0.0);
            narrowest = narrowest.min(footprint);
            widest = widest.max(footprint);
            local.fineness[lane] = 0.5 / footprint;
        }
        (local.finest, local.coarsest) = (0.5 / narrowest, 0.5 / widest);
    }
    local
}

/// Takes several blocks as one, if all of their points lie in one cell and none has a footprint.
#[inline(always)]
fn localise_together<const W: usize>(points: &[Points], together: &mut Local<W>) -> bool {
    if points.len() * BLOCK != W {
        return false;
    }
    for (n, points) in points.iter().enumerate() {
        let local = localise(points);
        if n == 0 {
            (together.cell_x[0], together.cell_y[0]) = (local.cell_x[0], local.cell_y[0]);
        }
        let same = local.cell_x[0] == together.cell_x[0] && local.cell_y[0] == together.cell_y[0];
        if !local.one_cell || !same || local.coarsest < f32::INFINITY {
            return false;
        }
        together.x[n * BLOCK..][..BLOCK].copy_from_slice(&local.x);
        together.y[n * BLOCK..][..BLOCK].copy_from_slice(&local.y);
    }
    true
}

impl<const W: usize> Local<W> {
    const ORIGIN: Local<W> = Local {
        x: [0.0; W],
        y: [0.0; W],
        cell_x: [0.0; BLOCK],
        cell_y: [0.0; BLOCK],
        one_cell: true,
        fineness: [f32::INFINITY; BLOCK],
        finest: f32::INFINITY,
        coarsest: f32::INFINITY,
    };
}

/// How many points are summed at once where there are many: as many as the registers hold.
const MANY_HEIGHTS: usize = 4 * BLOCK;
const MANY_MOTIONS: usize = 2 * BLOCK;

/// Waves of a fan from the first that is not hidden from all of some points, and the first that is whole for all.
#[inline(always)]
fn seen<const W: usize>(sum: &Sum, fan: &Fan, local: &Local<W>) -> (usize, usize) {
    if local.coarsest == f32::INFINITY {
        return (fan.from, fan.from);
    }
    let hot = &sum.hot[fan.from..fan.to];
    let hidden = hot.partition_point(|hot| left(hot.length, local.finest) == 0.0);
    let whole = hot.partition_point(|hot| left(hot.length, local.coarsest) < 1.0);
    (fan.from + hidden, fan.from + whole)
}

/// What is summed, and at which of the sums it begins: heights first, then the others as far as they are wanted.
const HEIGHTS: u8 = 0;
const DISPLACEMENTS: u8 = 1;
const SLOPES: u8 = 2;
const EVERYTHING: u8 = 3;

const fn tilts(what: u8) -> Option<usize> {
    if what == SLOPES || what == EVERYTHING { Some(1) } else { None }
}

const fn pushes(what: u8) -> Option<usize> {
    match what {
        DISPLACEMENTS => Some(1),
        EVERYTHING => Some(3),
        _ => None,
    }
}

const fn stretches(what: u8) -> Option<usize> {
    if what == EVERYTHING { Some(5) } else { None }
}

/// Adds waves `from..to` of a fan to `sums`: in `FANNED` ones along their common way, `along` which the points lie. `shared` are their phases
/// if the points share a cell.
#[inline(always)]
fn add_waves<
    const W: usize,
    const N: usize,
    const WHAT: u8,
    const FANNED: bool,
    const ONE_CELL: bool,
    const FADING: bool,
>(
    sum: &Sum,
    local: &Local<W>,
    along: &[f32; W],
    shared: &[f32],
    from: usize,
    to: usize,
    sums: &mut [[f32; W]; N],
) {
    let (tilts, pushes, stretches) = (tilts(WHAT), pushes(WHAT), stretches(WHAT));
    // Local copies, which stay in registers. In a fan, those eastward stand for those along its way.
    let none = [0f32; W];
    let mut height = sums[0];
    let [mut tilt_x, mut tilt_y] = tilts.map_or([none; 2], |at| [sums[at], sums[at + 1]]);
    let [mut push_x, mut push_y] = pushes.map_or([none; 2], |at| [sums[at], sums[at + 1]]);
    let [mut stretch_xx, mut stretch_xy, mut stretch_yy] =
        stretches.map_or([none; 3], |at| [sums[at], sums[at + 1], sums[at + 2]]);
    let (x, y, fineness) = (local.x, local.y, local.fineness);
    for ((wave, shared), number) in sum.hot[from..to].iter().zip(shared).zip(from..) {
        let mut own = [0f32; W];
        if !ONE_CELL {
            let (kx, ky, turns) = (sum.kx[number], sum.ky[number], sum.turns[number]);
            for lane in 0..W {
                own[lane] = phase(kx, ky, turns, local.cell_x[lane], local.cell_y[lane]);
            }
        }
        for lane in 0..W {
            let start = if ONE_CELL { *shared } else { own[lane] };
            let turns = if FANNED {
                wave.k.mul_add(along[lane], start)
            } else {
                wave.kx.mul_add(x[lane], wave.ky.mul_add(y[lane], start))
            };
            let r = turns - turns.round_ties_even();
            let v = r.abs() - 0.25;
            let u = v * v;
            let mut cosine = v * (u + C2).mul_add(u, C1).mul_add(u, C0);
            let mut sine = 0.0;
            if tilts.is_some() || pushes.is_some() {
                let even = (u + S3).mul_add(u, S2).mul_add(u, S1).mul_add(u, S0);
                sine = f32::from_bits(even.to_bits() ^ (r.to_bits() & (1 << 31)));
            }
            if FADING {
                let left = left(wave.length, fineness[lane]);
                cosine *= left;
                sine *= left;
            }
            height[lane] = wave.height.mul_add(cosine, height[lane]);
            if FANNED {
                if tilts.is_some() {
                    tilt_x[lane] = wave.tilt.mul_add(sine, tilt_x[lane]);
                }
                if pushes.is_some() {
                    push_x[lane] = wave.push.mul_add(sine, push_x[lane]);
                }
                if stretches.is_some() {
                    stretch_xx[lane] = wave.stretch.mul_add(cosine, stretch_xx[lane]);
                }
            } else {
                if tilts.is_some() {
                    tilt_x[lane] = wave.tilt_x.mul_add(sine, tilt_x[lane]);
                    tilt_y[lane] = wave.tilt_y.mul_add(sine, tilt_y[lane]);
                }
                if pushes.is_some() {
                    push_x[lane] = wave.push_x.mul_add(sine, push_x[lane]);
                    push_y[lane] = wave.push_y.mul_add(sine, push_y[lane]);
                }
                if stretches.is_some() {
                    stretch_xx[lane] = wave.stretch_xx.mul_add(cosine, stretch_xx[lane]);
                    stretch_xy[lane] = wave.stretch_xy.mul_add(cosine, stretch_xy[lane]);
                    stretch_yy[lane] = wave.stretch_yy.mul_add(cosine, stretch_yy[lane]);
                }
            }
        }
    }
    sums[0] = height;
    if let Some(at) = tilts {
        [sums[at], sums[at + 1]] = [tilt_x, tilt_y];
    }
    if let Some(at) = pushes {
        [sums[at], sums[at + 1]] = [push_x, push_y];
    }
    if let Some(at) = stretches {
        [sums[at], sums[at + 1], sums[at + 2]] = [stretch_xx, stretch_xy, stretch_yy];
    }
}

/// A wave's phase in the middle of a cell, in turns within ±½.
#[inline(always)]
fn phase(kx: f64, ky: f64, turns: f64, x: f64, y: f64) -> f32 {
    let all = kx.mul_add(x, ky.mul_add(y, turns));
    (all - all.round_ties_even()) as f32
}

/// Adds waves `from..to` of a fan as far as they are seen; `shared` are the phases of all from `begin` on.
#[inline(always)]
fn add_fan<const W: usize, const N: usize, const WHAT: u8, const FANNED: bool>(
    sum: &Sum,
    fan: &Fan,
    local: &Local<W>,
    along: &[f32; W],
    (shared, begin): (&[f32], usize),
    (from, to): (usize, usize),
    sums: &mut [[f32; W]; N],
) {
    if W > BLOCK {
        return add_waves::<W, N, WHAT, FANNED, true, false>(
            sum,
            local,
            along,
            &shared[from - begin..],
            from,
            to,
            sums,
        );
    }
    let (hidden, whole) = seen(sum, fan, local);
    let (hidden, whole) = (hidden.clamp(from, to), whole.clamp(from, to));
    if local.one_cell {
        if hidden < whole {
            let shared = &shared[hidden - begin..];
            add_waves::<W, N, WHAT, FANNED, true, true>(sum, local, along, shared, hidden, whole, sums);
        }
        let shared = &shared[whole - begin..];
        add_waves::<W, N, WHAT, FANNED, true, false>(sum, local, along, shared, whole, to, sums);
    } else {
        // Here the phases are what takes the time, not the fading.
        let shared = &shared[hidden - begin..];
        add_waves::<W, N, WHAT, FANNED, false, true>(sum, local, along, shared, hidden, to, sums);
    }
}

#[inline(always)]
fn add_all<const W: usize, const N: usize, const WHAT: u8>(sum: &Sum, local: &Local<W>, sums: &mut [[f32; W]; N]) {
    let mut shared = [0f32; CHUNK];
    let count = sum.hot.len();
    let mut begin = 0;
    while begin < count {
        let end = count.min(begin + CHUNK);
        if local.one_cell {
            let filled = begin..end.next_multiple_of(8);
            let (kx, ky, turns) = (&sum.kx[filled.clone()], &sum.ky[filled.clone()], &sum.turns[filled.clone()]);
            let shared = &mut shared[..filled.len()];
            for i in 0..filled.len() {
                shared[i] = phase(kx[i], ky[i], turns[i], local.cell_x[0], local.cell_y[0]);
            }
        }
        let phases = (&shared[..], begin);
        for fan in &sum.fans {
            let (from, to) = (fan.from.max(begin), fan.to.min(end));
            if from >= to {
                continue;
            }
            if sum.fanned {
                add_one_way::<W, N, WHAT>(sum, fan, local, phases, (from, to), sums);
            } else {
                add_fan::<W, N, WHAT, false>(sum, fan, local, &[0.0; W], phases, (from, to), sums);
            }
        }
        begin = end;
    }
}

/// Adds waves `from..to` of a fan, which run one way.
#[inline(always)]
fn add_one_way<const W: usize, const N: usize, const WHAT: u8>(
    sum: &Sum,
    fan: &Fan,
    local: &Local<W>,
    phases: (&[f32], usize),
    range: (usize, usize),
    sums: &mut [[f32; W]; N],
) {
    let (x, y) = (fan.along.x as f32, fan.along.y as f32);
    let mut along = [0f32; W];
    for lane in 0..W {
        along[lane] = x.mul_add(local.x[lane], y * local.y[lane]);
    }
    let mut own = [[0f32; W]; N];
    own[0] = sums[0];
    add_fan::<W, N, WHAT, true>(sum, fan, local, &along, phases, range, &mut own);
    sums[0] = own[0];
    for pair in [tilts(WHAT), pushes(WHAT)].into_iter().flatten() {
        for lane in 0..W {
            sums[pair][lane] = x.mul_add(own[pair][lane], sums[pair][lane]);
            sums[pair + 1][lane] = y.mul_add(own[pair][lane], sums[pair + 1][lane]);
        }
    }
    if let Some(at) = stretches(WHAT) {
        for lane in 0..W {
            let (across, up) = (x * own[at][lane], y * own[at][lane]);
            sums[at][lane] = x.mul_add(across, sums[at][lane]);
            sums[at + 1][lane] = y.mul_add(across, sums[at + 1][lane]);
            sums[at + 2][lane] = y.mul_add(up, sums[at + 2][lane]);
        }
    }
}

#[inline(always)]
fn add<const W: usize>(to: &mut Lanes, what: &[f32; W], from: usize) {
    for lane in 0..BLOCK {
        to[lane] += what[from + lane];
    }
}

/// Adds sums to the motions of one block, whose points begin at `from`.
#[inline(always)]
fn hand_over<const W: usize, const N: usize, const WHAT: u8>(sums: &[[f32; W]; N], from: usize, motion: &mut Motion) {
    add(&mut motion.dz, &sums[0], from);
    if let Some(at) = tilts(WHAT) {
        add(&mut motion.slope_x, &sums[at], from);
        add(&mut motion.slope_y, &sums[at + 1], from);
    }
    if let Some(at) = pushes(WHAT) {
        add(&mut motion.dx, &sums[at], from);
        add(&mut motion.dy, &sums[at + 1], from);
    }
    if let Some(at) = stretches(WHAT) {
        add(&mut motion.dxx, &sums[at], from);
        add(&mut motion.dxy, &sums[at + 1], from);
        add(&mut motion.dyy, &sums[at + 2], from);
    }
}

#[inline(always)]
fn add_block<const N: usize, const WHAT: u8>(sum: &Sum, local: &Local<BLOCK>, motion: &mut Motion) {
    let mut sums = [[0f32; BLOCK]; N];
    add_all::<BLOCK, N, WHAT>(sum, local, &mut sums);
    hand_over::<BLOCK, N, WHAT>(&sums, 0, motion);
}

/// Sums many blocks together where they are near each other, others one by one.
#[inline(always)]
fn add_blocks<const W: usize, const N: usize, const WHAT: u8>(
    sum: &Sum,
    points: &[Points],
    motions: &mut [Motion],
    one: fn(&Sum, &Points, &mut Motion),
) {
    let together = W / BLOCK;
    let mut local = Local::<W>::ORIGIN;
    for (points, motions) in points.chunks(together).zip(motions.chunks_mut(together)) {
        if points.len() == motions.len() && localise_together(points, &mut local) {
            let mut sums = [[0f32; W]; N];
            add_all::<W, N, WHAT>(sum, &local, &mut sums);
            for (n, motion) in motions.iter_mut().enumerate() {
                hand_over::<W, N, WHAT>(&sums, n * BLOCK, motion);
            }
        } else {
            points.iter().zip(motions).for_each(|(points, motion)| one(sum, points, motion));
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_displacement(sum: &Sum, points: &Points, motion: &mut Motion) {
    let local = localise(points);
    if sum.pushes {
        add_block::<3, DISPLACEMENTS>(sum, &local, motion);
    } else {
        add_block::<1, HEIGHTS>(sum, &local, motion);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_motion(sum: &Sum, points: &Points, motion: &mut Motion) {
    let local = localise(points);
    if sum.pushes {
        add_block::<8, EVERYTHING>(sum, &local, motion);
    } else {
        add_block::<3, SLOPES>(sum, &local, motion);
    }
    if local.coarsest < f32::INFINITY {
        for fan in &sum.fans {
            add_hidden(sum, fan, &local, motion);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_displacements(sum: &Sum, points: &[Points], motions: &mut [Motion]) {
    if sum.pushes {
        add_blocks::<MANY_MOTIONS, 3, DISPLACEMENTS>(sum, points, motions, add_displacement);
    } else {
        add_blocks::<MANY_HEIGHTS, 1, HEIGHTS>(sum, points, motions, add_displacement);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_motions(sum: &Sum, points: &[Points], motions: &mut [Motion]) {
    if sum.pushes {
        add_blocks::<MANY_MOTIONS, 8, EVERYTHING>(sum, points, motions, add_motion);
    } else {
        add_blocks::<MANY_MOTIONS, 3, SLOPES>(sum, points, motions, add_motion);
    }
}

/// Adds the slopes that footprints hide of a fan.
#[inline(always)]
fn add_hidden(sum: &Sum, fan: &Fan, local: &Local<BLOCK>, motion: &mut Motion) {
    let (hidden, whole) = seen(sum, fan, local);
    let before = if hidden > fan.from { sum.hidden[hidden - 1] } else { [0.0; 3] };
    let [mut xx, mut xy, mut yy] = before.map(|hidden| [hidden; BLOCK]);
    // Added one by one as in those sums, so that a point's bits do not depend on its neighbours.
    for i in hidden..whole {
        let (length, part) = (sum.hot[i].length, sum.slopes[i]);
        for lane in 0..BLOCK {
            let left = left(length, local.fineness[lane]);
            let lost = left.mul_add(-left, 1.0);
            xx[lane] = lost.mul_add(part[0], xx[lane]);
            xy[lane] = lost.mul_add(part[1], xy[lane]);
            yy[lane] = lost.mul_add(part[2], yy[lane]);
        }
    }
    add(&mut motion.hidden_xx, &xx, 0);
    add(&mut motion.hidden_xy, &xy, 0);
    add(&mut motion.hidden_yy, &yy, 0);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn heights_at(sum: &Sum, places: &[DVec2], heights: &mut [f32]) {
    let mut local = Local::<MANY_HEIGHTS>::ORIGIN;
    for (places, heights) in places.chunks(MANY_HEIGHTS).zip(heights.chunks_mut(MANY_HEIGHTS)) {
        // Filled up with the first place.
        let (mut x, mut y) = ([places[0].x; MANY_HEIGHTS], [places[0].y; MANY_HEIGHTS]);
        for ((x, y), place) in x.iter_mut().zip(&mut y).zip(places) {
            (*x, *y) = (place.x, place.y);
        }
        let (cell_x, cell_y);
        (local.x, cell_x) = beside_cell(&x);
        (local.y, cell_y) = beside_cell(&y);
        let mut sums = [[0f32; MANY_HEIGHTS]; 1];
        if all_equal(&cell_x) && all_equal(&cell_y) {
            (local.cell_x[0], local.cell_y[0]) = (cell_x[0], cell_y[0]);
            add_all::<MANY_HEIGHTS, 1, HEIGHTS>(sum, &local, &mut sums);
        } else {
            for ((x, y), sums) in x.chunks(BLOCK).zip(y.chunks(BLOCK)).zip(sums[0].chunks_mut(BLOCK)) {
                let mut points = Points::at(0.0, 0.0);
                points.x.copy_from_slice(x);
                points.y.copy_from_slice(y);
                let mut motion = Motion::STILL;
                add_displacement(sum, &points, &mut motion);
                sums.copy_from_slice(&motion.dz);
            }
        }
        heights.copy_from_slice(&sums[0][..heights.len()]);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn add_velocity(sum: &Sum, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
    let local = localise(points);
    let bed = sum.water.depth as f32;
    let (mut x, mut y, mut z) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    // Twice the water's depth less the point's, and whether the point is in the water.
    let (mut deep, mut mirrored, mut wet) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    for lane in 0..BLOCK {
        deep[lane] = depths[lane].max(0.0).min(1e9);
        mirrored[lane] = bed - deep[lane] + bed;
        wet[lane] = if deep[lane] <= bed { 1.0 } else { 0.0 };
    }
    for i in 0..sum.hot.len() {
        let (wave, kx, ky, turns) = (sum.hot[i], sum.kx[i], sum.ky[i], sum.turns[i]);
        for lane in 0..BLOCK {
            let start = phase(kx, ky, turns, local.cell_x[lane], local.cell_y[lane]);
            let all = wave.kx.mul_add(local.x[lane], wave.ky.mul_add(local.y[lane], start));
            let r = all - all.round_ties_even();
            let v = r.abs() - 0.25;
            let u = v * v;
            let cosine = v * (u + C2).mul_add(u, C1).mul_add(u, C0);
            let even = (u + S3).mul_add(u, S2).mul_add(u, S1).mul_add(u, S0);
            let sine = f32::from_bits(even.to_bits() ^ (r.to_bits() & (1 << 31)));
            let (down, up) = (power_of_two(wave.decay * deep[lane]), power_of_two(wave.decay * mirrored[lane]));
            let left = left(wave.length, local.fineness[lane]) * wet[lane];
            let across = (down + up) * (left * cosine);
            x[lane] = wave.flow_x.mul_add(across, x[lane]);
            y[lane] = wave.flow_y.mul_add(across, y[lane]);
            z[lane] = (wave.flow_z * (down - up)).mul_add(sine * left, z[lane]);
        }
    }
    add(&mut velocity.x, &x, 0);
    add(&mut velocity.y, &y, 0);
    add(&mut velocity.z, &z, 0);
}

/// 2^x for x ≤ 0, to 2·10⁻⁷ of it; not below 2^−126.
#[inline(always)]
fn power_of_two(x: f32) -> f32 {
    // Adding this leaves the nearest whole number in the low bits.
    const SHIFT: f32 = 12_582_912.0;
    let x = x.clamp(-126.0, 0.0);
    let shifted = x + SHIFT;
    let f = x - (shifted - SHIFT);
    let p = 0.000_154_035_3_f32.mul_add(f, 0.001_333_355_8).mul_add(f, 0.009_618_129).mul_add(f, 0.055_504_11);
    let p = p.mul_add(f, 0.240_226_51).mul_add(f, std::f32::consts::LN_2).mul_add(f, 1.0);
    p * f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23))
}

/// Cosine and sine of a number of turns within ±10⁶.
#[inline(always)]
pub(crate) fn circle(turns: f32) -> (f32, f32) {
    let r = turns - turns.round_ties_even();
    let v = r.abs() - 0.25;
    let u = v * v;
    let cosine = v * (u + C2).mul_add(u, C1).mul_add(u, C0) * COSINE as f32;
    let even = (u + S3).mul_add(u, S2).mul_add(u, S1).mul_add(u, S0) * SINE as f32;
    (cosine, f32::from_bits(even.to_bits() ^ (r.to_bits() & (1 << 31))))
}
