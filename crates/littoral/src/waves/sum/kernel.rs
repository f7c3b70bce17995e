//! The inner loops of sums of plane waves.
//!
//! Each wave's phase is found in `f64` at the middle of the point's cell of [`CELL`] metres, then carried to the point in `f32` turns, so that
//! distance and time cost no accuracy. Cosine and sine come from one pair of polynomials: with r the phase less the nearest whole turn and
//! v = |r| − ¼, cos 2πr = −sin 2πv is odd in v and sin 2πr = ±cos 2πv even, on |v| ≤ ¼ only. Both are scaled to a leading coefficient of 1
//! (the scale goes into the waves), which makes their first step an addition. They err by less than 6·10⁻⁷ and 5·10⁻⁸ (Lawson's
//! iteration for the best approximation: C. Lawson, *Contributions to the theory of linear least maximum approximation*, 1961).
//!
//! Points of a block that share a cell share their phases there; others pay for their own. Either way a point's answer has the same bits.

use super::{Fan, Sum};
use crate::waves::{BLOCK, Motion, Points, Velocity};
use glam::DVec2;
use multiversion::multiversion;

/// Edge of the squares (m) that share a phase in `f64`: within one, phases in `f32` err by what 10⁻⁵ m of way make.
const CELL: f64 = 256.0;

/// Farthest coordinate (m): beyond, where phases have lost all their digits, answers are those of the origin.
pub(super) const FARTHEST: f64 = 1e12;

/// How many waves' phases are held at once.
const CHUNK: usize = 512;

/// cos 2πr = `COSINE` · v · p(v²), v = |r| − ¼, p = (((v² + c₂) v² + c₁) v² + c₀).
pub(crate) const COSINE: f64 = 70.993_429_954_819;
const C0: f32 = -0.088_503_46;
const C1: f32 = 0.582_267_15;
const C2: f32 = -1.145_750_7;

/// sin 2πr = ± `SINE` · q(v²), with the sign of r.
pub(crate) const SINE: f64 = 56.242_380_482_363_19;
const S0: f32 = 0.017_780_185;
const S1: f32 = -0.350_966_14;
const S2: f32 = 1.154_549_1;
const S3: f32 = -1.515_589;

pub(super) type Lanes = [f32; BLOCK];

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
pub(super) fn add_displacement(sum: &Sum, points: &Points, motion: &mut Motion) {
    let local = localise(points);
    if sum.pushes {
        add_block::<3, DISPLACEMENTS>(sum, &local, motion);
    } else {
        add_block::<1, HEIGHTS>(sum, &local, motion);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn add_motion(sum: &Sum, points: &Points, motion: &mut Motion) {
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
pub(super) fn add_displacements(sum: &Sum, points: &[Points], motions: &mut [Motion]) {
    if sum.pushes {
        add_blocks::<MANY_MOTIONS, 3, DISPLACEMENTS>(sum, points, motions, add_displacement);
    } else {
        add_blocks::<MANY_HEIGHTS, 1, HEIGHTS>(sum, points, motions, add_displacement);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn add_motions(sum: &Sum, points: &[Points], motions: &mut [Motion]) {
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
pub(super) fn heights_at(sum: &Sum, places: &[DVec2], heights: &mut [f32]) {
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
pub(super) fn add_velocity(sum: &Sum, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
    let local = localise(points);
    let bed = sum.water.depth as f32;
    let (mut x, mut y, mut z) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    // Twice the water's depth less the point's, and whether the point is in the water.
    let (mut deep, mut mirrored, mut wet) = ([0f32; BLOCK], [0f32; BLOCK], [0f32; BLOCK]);
    for lane in 0..BLOCK {
        deep[lane] = if depths[lane] > 0.0 { depths[lane].min(1e9) } else { 0.0 };
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
pub(crate) fn power_of_two(x: f32) -> f32 {
    // Adding this leaves the nearest whole number in the low bits.
    const SHIFT: f32 = 12_582_912.0;
    let x = x.clamp(-126.0, 0.0);
    let shifted = x + SHIFT;
    let f = x - (shifted - SHIFT);
    let p = 1.540_353e-4_f32.mul_add(f, 0.001_333_355_8).mul_add(f, 0.009_618_129).mul_add(f, 0.055_504_11);
    let p = p.mul_add(f, 0.240_226_5).mul_add(f, std::f32::consts::LN_2).mul_add(f, 1.0);
    p * f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23))
}

/// Cosine and sine of a number of turns within ±10⁶.
#[inline(always)]
pub(crate) fn circle(turns: f32) -> (f32, f32) {
    let (cosine, sine) = small_circle(turns);
    (cosine * COSINE as f32, sine * SINE as f32)
}

/// Cosine over [`COSINE`] and sine over [`SINE`] of a number of turns within ±10⁶.
#[inline(always)]
pub(crate) fn small_circle(turns: f32) -> (f32, f32) {
    let r = turns - turns.round_ties_even();
    let v = r.abs() - 0.25;
    let u = v * v;
    let cosine = v * (u + C2).mul_add(u, C1).mul_add(u, C0);
    let even = (u + S3).mul_add(u, S2).mul_add(u, S1).mul_add(u, S0);
    (cosine, f32::from_bits(even.to_bits() ^ (r.to_bits() & (1 << 31))))
}
