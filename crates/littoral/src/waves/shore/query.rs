//! What the sea over a bed answers at points: the kernel over waves.
//!
//! A cell's four corners are unpacked once, sixteen waves at a time, into bilinear polynomials of phase and amplitude whose phase includes
//! the wave of the open sea and the instant; points in the same cell follow at the cost of a sine each wave. Sixteen points that share a cell lie along
//! lanes, others follow each other with waves along lanes; both add up waves in the same order, so that a point's answer does not
//! depend on which others are asked about with it.

use super::super::fft::kernel::transpose;
use super::super::sum::{COSINE, SINE, small_circle};
use super::super::{Motion, Points, Velocity};
use super::lanes::{LANES, decay, sine_cosine};
use super::march::sum;
use super::shape::{self, Place, Sums};
use super::{BLOCK, ShoreSea};
use multiversion::multiversion;
use std::f32::consts::TAU;

/// Phase (turns) and amplitude (m) of sixteen waves over a cell: c₀ + c₁u + c₂v + c₃uv.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Cell {
    phase: [[f32; LANES]; 4],
    amplitude: [[f32; LANES]; 4],
    /// Directions in which they run in the open.
    heading: [[f32; LANES]; 2],
}

impl Cell {
    const NONE: Cell = Cell { phase: [[0.0; LANES]; 4], amplitude: [[0.0; LANES]; 4], heading: [[0.0; LANES]; 2] };
}

/// Where sixteen points lie on the grid.
struct Spots {
    /// Cells, which may lie off the grid.
    column: [f64; BLOCK],
    row: [f64; BLOCK],
    /// How far into them the points lie, in [0, 1].
    u: [f32; BLOCK],
    v: [f32; BLOCK],
    /// Squares of the footprints over π (m²).
    square: [f32; BLOCK],
    /// Their corners, in the order 00, 10, 01, 11; the node after the last is the open sea.
    nodes: [[u32; BLOCK]; 4],
    /// Whether all lie in one cell.
    shared: bool,
}

#[inline(always)]
#[allow(clippy::manual_clamp, reason = "what is no number becomes a number")]
fn find(sea: &ShoreSea, points: &Points) -> Spots {
    let mut spots = Spots {
        column: [0.0; BLOCK],
        row: [0.0; BLOCK],
        u: [0.0; BLOCK],
        v: [0.0; BLOCK],
        square: [0.0; BLOCK],
        nodes: [[0; BLOCK]; 4],
        shared: true,
    };
    let (columns, rows) = (sea.columns as i32, sea.rows as i32);
    let open = (columns * rows) as u32;
    let (origin, over) = (sea.origin, sea.over);
    let (mut c, mut r) = ([0i32; BLOCK], [0i32; BLOCK]);
    let mut apart = 0;
    for l in 0..BLOCK {
        // Not a number and what is beyond all seas are taken as far off.
        let u = ((points.x[l] - origin.x) * over.x).max(-FAR).min(FAR);
        let v = ((points.y[l] - origin.y) * over.y).max(-FAR).min(FAR);
        (spots.column[l], spots.row[l]) = (u.floor(), v.floor());
        spots.u[l] = (u - spots.column[l]) as f32;
        spots.v[l] = (v - spots.row[l]) as f32;
    }
    for l in 0..BLOCK {
        apart |= spots.column[l].to_bits() ^ spots.column[0].to_bits();
        apart |= spots.row[l].to_bits() ^ spots.row[0].to_bits();
        // Off the grid it does not matter how far.
        c[l] = spots.column[l].max(-2.0).min(f64::from(columns)) as i32;
        r[l] = spots.row[l].max(-2.0).min(f64::from(rows)) as i32;
        let footprint = points.footprint[l].max(0.0).min(WIDEST) * std::f32::consts::FRAC_1_PI;
        spots.square[l] = footprint * footprint;
    }
    spots.shared = apart == 0;
    for l in 0..BLOCK {
        let (left, right) = ((c[l] >= 0) & (c[l] < columns), (c[l] >= -1) & (c[l] < columns - 1));
        let (low, high) = ((r[l] >= 0) & (r[l] < rows), (r[l] >= -1) & (r[l] < rows - 1));
        let at = r[l].wrapping_mul(columns).wrapping_add(c[l]);
        let node = |inside: bool, at: i32| if inside { at as u32 } else { open };
        spots.nodes[0][l] = node(left & low, at);
        spots.nodes[1][l] = node(right & low, at.wrapping_add(1));
        spots.nodes[2][l] = node(left & high, at.wrapping_add(columns));
        spots.nodes[3][l] = node(right & high, at.wrapping_add(columns + 1));
    }
    spots
}

/// The widest footprint (m): wider than any wave.
const WIDEST: f32 = 1e9;

/// Cells off the grid that are told apart.
const FAR: f64 = 1e15;

/// How many points ahead is asked for what they need: random places would wait for memory one after another.
const AHEAD: usize = 4;

/// Asks for what a point needs to be brought near.
#[inline(always)]
fn fetch(sea: &ShoreSea, spots: &Spots, point: usize) {
    // Neighbours share their cell.
    if point > 0 && spots.nodes[0][point] == spots.nodes[0][point - 1] {
        return;
    }
    #[cfg(target_arch = "x86_64")]
    for corner in &spots.nodes {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let node = corner[point] as usize;
        for block in 0..sea.blocks.min(MOST) {
            let record = sea.records.as_ptr().wrapping_add(node * sea.blocks + block);
            // SAFETY: a hint about an address; reads nothing.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(record.cast()) };
        }
        // SAFETY: as above.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(sea.places.as_ptr().wrapping_add(node).cast()) };
    }
}

/// Sixteens of waves that are unpacked at once.
const MOST: usize = 4;

/// Unpacks a sixteen of waves over the cell of a point.
#[inline(always)]
fn unpack(sea: &ShoreSea, spots: &Spots, point: usize, block: usize, cell: &mut Cell) {
    let at = |corner: usize| sea.records[spots.nodes[corner][point] as usize * sea.blocks + block];
    let (a, b, c, d) = (at(0), at(1), at(2), at(3));
    let corner_x = sea.spacing.x.mul_add(spots.column[point], sea.origin.x);
    let corner_y = sea.spacing.y.mul_add(spots.row[point], sea.origin.y);
    let waves = &sea.lanes[block];
    let mut to = Cell::NONE;
    for l in 0..LANES {
        let turns = waves.turns_x[l].mul_add(corner_x, waves.turns_y[l].mul_add(corner_y, waves.now[l]));
        let base = (turns - turns.floor()) as f32;
        let across = b.phase[l].wrapping_sub(a.phase[l]);
        let up = c.phase[l].wrapping_sub(a.phase[l]);
        let twist = i32::from(d.phase[l].wrapping_sub(c.phase[l])) - i32::from(across);
        const TURN: f32 = 1.0 / 65_536.0;
        to.phase[0][l] = f32::from(a.phase[l]).mul_add(TURN, base);
        to.phase[1][l] = f32::from(across).mul_add(TURN, waves.step_x[l]);
        to.phase[2][l] = f32::from(up).mul_add(TURN, waves.step_y[l]);
        to.phase[3][l] = twist as f32 * TURN;
        let unit = waves.unit[l];
        let (aa, ab) = (i32::from(a.amplitude[l]), i32::from(b.amplitude[l]));
        let (ac, ad) = (i32::from(c.amplitude[l]), i32::from(d.amplitude[l]));
        to.amplitude[0][l] = aa as f32 * unit;
        to.amplitude[1][l] = (ab - aa) as f32 * unit;
        to.amplitude[2][l] = (ac - aa) as f32 * unit;
        to.amplitude[3][l] = (ad - ac - ab + aa) as f32 * unit;
    }
    to.heading = waves.heading;
    *cell = to;
}

/// Adds wave `w` of a cell at a point, which lies at `u` and `v` in it and has a `square` of its footprint, to lane `l` of the first `N` of: ζ, ξ,
/// sideways x and y; of ζ and ξ, the derivatives along x and y; the three of the sideways motion; and three of hidden slopes. The first four
/// come scaled by [`SCALES`]. A macro, for loops over a function that took and gave so many numbers would not be made vectors of.
macro_rules! add {
    ($n:ident, $sum:ident[$l:ident], $cell:ident[$w:ident], $over:ident, $u:expr, $v:expr, $square:expr) => {
        let (p, a, l, w) = (&$cell.phase, &$cell.amplitude, $l, $w);
        let (u, v) = ($u, $v);
        let uv = u * v;
        let turns = uv.mul_add(p[3][w], v.mul_add(p[2][w], u.mul_add(p[1][w], p[0][w])));
        let height = uv.mul_add(a[3][w], v.mul_add(a[2][w], u.mul_add(a[1][w], a[0][w])));
        let kx = v.mul_add(p[3][w], p[1][w]) * (TAU * $over[0]);
        let ky = u.mul_add(p[3][w], p[2][w]) * (TAU * $over[1]);
        let weight = if $n == FILTERED_DISPLACEMENT || $n == 14 {
            let k = kx.mul_add(kx, ky * ky);
            let t = ((1.0 - k * $square) * (4.0 / 3.0)).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        } else {
            1.0
        };
        let (c, s) = small_circle(turns);
        let shown = height * weight;
        let (ex, ey) = ($cell.heading[0][w], $cell.heading[1][w]);
        let hs = shown * s;
        $sum[0][l] = shown.mul_add(c, $sum[0][l]);
        $sum[1][l] += hs;
        $sum[2][l] = hs.mul_add(ex, $sum[2][l]);
        $sum[3][l] = hs.mul_add(ey, $sum[3][l]);
        if $n >= 11 {
            let (c, s) = (c * SCALES[0], s * SCALES[1]);
            let (hc, hs) = (shown * c, shown * s);
            let ax = v.mul_add(a[3][w], a[1][w]) * ($over[0] * weight);
            let ay = u.mul_add(a[3][w], a[2][w]) * ($over[1] * weight);
            let (xx, xy) = (ax.mul_add(s, hc * kx), ay.mul_add(s, hc * ky));
            $sum[4 % $n][l] += ax.mul_add(c, -(hs * kx));
            $sum[5 % $n][l] += ay.mul_add(c, -(hs * ky));
            $sum[6 % $n][l] += xx;
            $sum[7 % $n][l] += xy;
            $sum[8 % $n][l] = xx.mul_add(ex, $sum[8 % $n][l]);
            $sum[9 % $n][l] = (0.5 * xy).mul_add(ex, (0.5 * xx).mul_add(ey, $sum[9 % $n][l]));
            $sum[10 % $n][l] = xy.mul_add(ey, $sum[10 % $n][l]);
        }
        if $n >= 14 {
            let lost = 0.5 * height * height * (1.0 - weight * weight);
            $sum[11 % $n][l] += lost * kx * kx;
            $sum[12 % $n][l] += lost * kx * ky;
            $sum[13 % $n][l] += lost * ky * ky;
        }
    };
}

/// What the first four sums must be multiplied by.
const SCALES: [f32; 4] = [COSINE as f32, SINE as f32, SINE as f32, SINE as f32];

/// A number of sums that means displacement alone, but with footprints: one more than is used.
const FILTERED_DISPLACEMENT: usize = 5;

/// Sums over the waves at the points; `FOURS` is how many fours of sums there are.
#[inline(always)]
fn gather<const N: usize, const FOURS: usize>(sea: &ShoreSea, points: &Points, sums: &mut Sums) {
    let spots = find(sea, points);
    let mut totals = [[0.0f32; BLOCK]; N];
    // More sums than these would not stay in registers, which costs more than is spared.
    if N <= FILTERED_DISPLACEMENT && spots.shared && sea.blocks <= MOST {
        together(sea, &spots, &mut totals, sums);
    } else {
        one_by_one::<N, FOURS>(sea, &spots, &mut totals, sums);
    }
    for (total, scale) in totals.iter_mut().zip(SCALES) {
        total.iter_mut().for_each(|total| *total *= scale);
    }
    [sums.zeta, sums.xi, sums.side_x, sums.side_y] = [totals[0], totals[1], totals[2], totals[3]];
    if N >= 11 {
        let [a, b, c, d, e, f, g] = std::array::from_fn(|n| totals[(4 + n) % N]);
        [sums.zeta_x, sums.zeta_y, sums.xi_x, sums.xi_y] = [a, b, c, d];
        sums.stretch = [e, f, g];
    }
    if N >= 14 {
        sums.hidden = std::array::from_fn(|n| totals[(11 + n) % N]);
    }
}

/// Displacements at points that share a cell: points lie along lanes, and waves follow each other in the order in which [`one_by_one`] adds them up.
#[inline(always)]
fn together<const N: usize>(sea: &ShoreSea, spots: &Spots, totals: &mut [[f32; BLOCK]; N], sums: &mut Sums) {
    let over = [sea.over.x as f32, sea.over.y as f32];
    let mut cells = [Cell::NONE; MOST];
    for (block, cell) in cells[..sea.blocks].iter_mut().enumerate() {
        unpack(sea, spots, 0, block, cell);
    }
    let mut halves = [[[0.0f32; BLOCK]; N]; 2];
    for (half, first) in halves.iter_mut().zip([0, 1]) {
        let mut quarters = [[[0.0f32; BLOCK]; N]; 2];
        for (quarter, first) in quarters.iter_mut().zip([first, first + 2]) {
            let mut pairs = [[[0.0f32; BLOCK]; N]; 2];
            for (pair, first) in pairs.iter_mut().zip([first, first + 4]) {
                let mut ones = [[[0.0f32; BLOCK]; N]; 2];
                for (one, wave) in ones.iter_mut().zip([first, first + 8]) {
                    for cell in &cells[..sea.blocks] {
                        for l in 0..BLOCK {
                            add!(N, one[l], cell[wave], over, spots.u[l], spots.v[l], spots.square[l]);
                        }
                    }
                }
                *pair = added(&ones);
            }
            *quarter = added(&pairs);
        }
        *half = added(&quarters);
    }
    *totals = added(&halves);
    let ground = place(sea, spots, 0);
    for n in 0..8 {
        let [a, across, up, twist] = [ground[0][n], ground[1][n], ground[2][n], ground[3][n]];
        let mut value = [0.0f32; BLOCK];
        for l in 0..BLOCK {
            let (u, v) = (spots.u[l], spots.v[l]);
            value[l] = (u * v).mul_add(twist, v.mul_add(up, u.mul_add(across, a)));
        }
        sums.place[n] = value;
    }
}

/// Two sets of sums as one.
#[inline(always)]
fn added<const N: usize>([a, b]: &[[[f32; BLOCK]; N]; 2]) -> [[f32; BLOCK]; N] {
    let mut sum = [[0.0f32; BLOCK]; N];
    for n in 0..N {
        for l in 0..BLOCK {
            sum[n][l] = a[n][l] + b[n][l];
        }
    }
    sum
}

/// Sums point by point: waves lie along lanes. Each sum of a point is folded to four numbers, and those of all points turned at last, so that
/// points lie along lanes.
#[inline(always)]
fn one_by_one<const N: usize, const FOURS: usize>(
    sea: &ShoreSea,
    spots: &Spots,
    totals: &mut [[f32; BLOCK]; N],
    sums: &mut Sums,
) {
    let motion = N >= 11;
    let over = [sea.over.x as f32, sea.over.y as f32];
    for point in 0..AHEAD {
        fetch(sea, spots, point);
    }
    let mut cells = [Cell::NONE; MOST];
    let mut ground = [[0.0f32; 8]; 4];
    let mut rows = [[[0.0f32; LANES]; BLOCK]; FOURS];
    // What is known of the places, and its derivatives along x; and those along y.
    let mut places = [[[0.0f32; LANES]; BLOCK]; 2];
    let mut first = 0;
    while first < sea.blocks {
        let count = (sea.blocks - first).min(MOST);
        let mut unpacked = None;
        for point in 0..BLOCK {
            if first == 0 && point + AHEAD < BLOCK {
                fetch(sea, spots, point + AHEAD);
            }
            let (u, v, square) = (spots.u[point], spots.v[point], spots.square[point]);
            let wanted = Some((spots.column[point], spots.row[point]));
            if unpacked != wanted {
                for (n, cell) in cells[..count].iter_mut().enumerate() {
                    unpack(sea, spots, point, first + n, cell);
                }
                if first == 0 {
                    ground = place(sea, spots, point);
                }
                unpacked = wanted;
            }
            let mut sum = [[0.0f32; LANES]; N];
            for cell in &cells[..count] {
                for l in 0..LANES {
                    add!(N, sum[l], cell[l], over, u, v, square);
                }
            }
            for (four, rows) in rows.iter_mut().enumerate() {
                let at = |n: usize| if 4 * four + n < N { sum[(4 * four + n) % N] } else { [0.0; LANES] };
                let folded = fold(&at(0), &at(1), &at(2), &at(3));
                if first == 0 {
                    rows[point] = folded;
                } else {
                    rows[point].iter_mut().zip(folded).for_each(|(row, folded)| *row += folded);
                }
            }
            if first == 0 {
                for n in 0..8 {
                    let [a, across, up, twist] = [ground[0][n], ground[1][n], ground[2][n], ground[3][n]];
                    places[0][point][n] = (u * v).mul_add(twist, v.mul_add(up, u.mul_add(across, a)));
                    if motion {
                        places[0][point][8 + n] = v.mul_add(twist, across) * over[0];
                        places[1][point][n] = u.mul_add(twist, up) * over[1];
                    }
                }
            }
        }
        first += count;
    }
    for (four, rows) in rows.iter_mut().enumerate() {
        transpose(rows);
        for (n, total) in totals.iter_mut().skip(4 * four).take(4).enumerate() {
            for l in 0..BLOCK {
                total[l] = (rows[4 * n][l] + rows[4 * n + 2][l]) + (rows[4 * n + 1][l] + rows[4 * n + 3][l]);
            }
        }
    }
    transpose(&mut places[0]);
    sums.place.copy_from_slice(&places[0][..8]);
    if motion {
        transpose(&mut places[1]);
        sums.place_x.copy_from_slice(&places[0][8..]);
        sums.place_y.copy_from_slice(&places[1][..8]);
    }
}

/// Adds up every fourth number of four sixteens: four numbers of each.
#[inline(always)]
fn fold(a: &[f32; LANES], b: &[f32; LANES], c: &[f32; LANES], d: &[f32; LANES]) -> [f32; LANES] {
    let (mut low, mut high) = ([0.0f32; LANES], [0.0f32; LANES]);
    for l in 0..8 {
        low[l] = a[l] + a[l + 8];
        low[l + 8] = b[l] + b[l + 8];
        high[l] = c[l] + c[l + 8];
        high[l + 8] = d[l] + d[l + 8];
    }
    let mut row = [0.0f32; LANES];
    for l in 0..4 {
        row[l] = low[l] + low[l + 4];
        row[l + 4] = low[l + 8] + low[l + 12];
        row[l + 8] = high[l] + high[l + 4];
        row[l + 12] = high[l + 8] + high[l + 12];
    }
    row
}

/// What is known of the cell of a point: the coefficients of 1, u, v and uv.
#[inline(always)]
fn place(sea: &ShoreSea, spots: &Spots, point: usize) -> [[f32; 8]; 4] {
    let at = |corner: usize| sea.places[spots.nodes[corner][point] as usize].0;
    let (a, b, c, d) = (at(0), at(1), at(2), at(3));
    let mut out = [a; 4];
    for n in 0..8 {
        let (across, up) = (b[n] - a[n], c[n] - a[n]);
        out[1][n] = across;
        out[2][n] = up;
        out[3][n] = (d[n] - c[n]) - across;
    }
    out
}

/// Sums over the waves, with what the footprints leave out only where there are some.
#[inline(always)]
fn add_up<const MOTION: bool>(sea: &ShoreSea, points: &Points, sums: &mut Sums) {
    match (MOTION, points.footprint.iter().any(|f| *f > 0.0)) {
        (true, true) => gather::<14, 4>(sea, points, sums),
        (true, false) => gather::<11, 3>(sea, points, sums),
        (false, true) => gather::<FILTERED_DISPLACEMENT, 1>(sea, points, sums),
        (false, false) => gather::<4, 1>(sea, points, sums),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn displacement(sea: &ShoreSea, points: &Points, motion: &mut Motion) {
    if sea.blocks == 0 {
        return;
    }
    let mut sums = Sums::NONE;
    add_up::<false>(sea, points, &mut sums);
    for l in 0..LANES {
        let sideways = sums.place[Place::SIDEWAYS][l];
        motion.dz[l] += shape::profile(&sums, l).0 + shape::swash(&sums, l);
        motion.dx[l] -= sideways * sums.side_x[l];
        motion.dy[l] -= sideways * sums.side_y[l];
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn motion(sea: &ShoreSea, points: &Points, motion: &mut Motion) {
    if sea.blocks == 0 {
        return;
    }
    let mut sums = Sums::NONE;
    add_up::<true>(sea, points, &mut sums);
    for l in 0..LANES {
        let parts = shape::profile(&sums, l);
        let sideways = sums.place[Place::SIDEWAYS][l];
        let (x, y) = (sums.side_x[l], sums.side_y[l]);
        motion.dz[l] += parts.0 + shape::swash(&sums, l);
        motion.dx[l] -= sideways * x;
        motion.dy[l] -= sideways * y;
        let (east, north) = ((sums.zeta_x[l], sums.xi_x[l]), (sums.zeta_y[l], sums.xi_y[l]));
        let swashing =
            (shape::swash_slope(&sums, l, east.0, &sums.place_x), shape::swash_slope(&sums, l, north.0, &sums.place_y));
        motion.slope_x[l] += shape::profile_slope(&sums, l, parts, east, &sums.place_x) + swashing.0;
        motion.slope_y[l] += shape::profile_slope(&sums, l, parts, north, &sums.place_y) + swashing.1;
        let (gx, gy) = (sums.place_x[Place::SIDEWAYS][l], sums.place_y[Place::SIDEWAYS][l]);
        motion.dxx[l] -= sideways.mul_add(sums.stretch[0][l], gx * x);
        motion.dxy[l] -= sideways.mul_add(sums.stretch[1][l], 0.5 * gy.mul_add(x, gx * y));
        motion.dyy[l] -= sideways.mul_add(sums.stretch[2][l], gy * y);
        motion.hidden_xx[l] += sums.hidden[0][l];
        motion.hidden_xy[l] += sums.hidden[1][l];
        motion.hidden_yy[l] += sums.hidden[2][l];
    }
    for l in 0..LANES {
        let foam = shape::foam(&sums, l, sea.frequency, sea.breaking);
        motion.foam[l] = motion.foam[l].max(foam);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn velocity(sea: &ShoreSea, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
    if sea.blocks == 0 {
        return;
    }
    let (over_x, over_y) = (sea.over.x as f32, sea.over.y as f32);
    let mut cell = Cell::NONE;
    let spots = find(sea, points);
    for point in 0..BLOCK {
        let (u, v) = (spots.u[point], spots.v[point]);
        let ground = place(sea, &spots, point);
        let depth = |n: usize| ground[n][Place::DEPTH];
        let bed = (u * v).mul_add(depth(3), v.mul_add(depth(2), u.mul_add(depth(1), depth(0))));
        let below = depths[point].max(0.0);
        if below >= bed {
            continue;
        }
        let square = spots.square[point];
        for block in 0..sea.blocks {
            unpack(sea, &spots, point, block, &mut cell);
            let waves = &sea.lanes[block];
            let mut value = [[0.0f32; LANES]; 3];
            for l in 0..LANES {
                let (p, a) = (&cell.phase, &cell.amplitude);
                let uv = u * v;
                let turns = uv.mul_add(p[3][l], v.mul_add(p[2][l], u.mul_add(p[1][l], p[0][l])));
                let height = uv.mul_add(a[3][l], v.mul_add(a[2][l], u.mul_add(a[1][l], a[0][l])));
                let kx = v.mul_add(p[3][l], p[1][l]) * (TAU * over_x);
                let ky = u.mul_add(p[3][l], p[2][l]) * (TAU * over_y);
                let k = kx.mul_add(kx, ky * ky);
                let t = ((1.0 - k * square) * (4.0 / 3.0)).clamp(0.0, 1.0);
                let k = k.sqrt().max(1e-6);
                let (s, c) = sine_cosine(turns);
                // cosh k(h−d) / sinh kh and sinh k(h−d) / sinh kh.
                let down = decay(-k * below);
                let back = decay(-k * (2.0 * bed - below));
                let whole = 1.0 / (1.0 - decay(-2.0 * k * bed)).max(1e-6);
                let speed = height * (t * t * (3.0 - 2.0 * t)) * waves.omega[l] * whole;
                let sideways = speed * (down + back) * c / k;
                value[0][l] = sideways * kx;
                value[1][l] = sideways * ky;
                value[2][l] = speed * (down - back) * s;
            }
            velocity.x[point] += sum(&value[0]);
            velocity.y[point] += sum(&value[1]);
            velocity.z[point] += sum(&value[2]);
        }
    }
}
