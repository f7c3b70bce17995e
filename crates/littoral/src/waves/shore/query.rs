//! What the sea over a bed answers at points: the kernel over waves.
//!
//! A cell's four corners are unpacked once, sixteen waves at a time, into bilinear polynomials of phase and amplitude whose phase includes
//! the wave of the open sea and the instant; points in the same cell follow at the cost of a sine each wave. A point's answer does not
//! depend on which others are asked about with it.

use super::super::{Motion, Points, Velocity};
use super::lanes::{LANES, decay, sine_cosine};
use super::march::sum;
use super::shape::{self, Place, Sums};
use super::{BLOCK, ShoreSea};
use multiversion::multiversion;

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
    column: [i64; BLOCK],
    row: [i64; BLOCK],
    /// How far into them the points lie, in [0, 1].
    u: [f32; BLOCK],
    v: [f32; BLOCK],
    /// Their corners, in the order 00, 10, 01, 11; the node after the last is the open sea.
    nodes: [[u32; BLOCK]; 4],
}

#[inline(always)]
#[allow(clippy::manual_clamp, reason = "what is no number becomes a number")]
fn find(sea: &ShoreSea, points: &Points) -> Spots {
    let mut spots =
        Spots { column: [0; BLOCK], row: [0; BLOCK], u: [0.0; BLOCK], v: [0.0; BLOCK], nodes: [[0; BLOCK]; 4] };
    let (columns, rows) = (sea.columns as i64, sea.rows as i64);
    let open = (columns * rows) as u32;
    let (origin, over) = (sea.origin, sea.over);
    for l in 0..BLOCK {
        // Not a number and what is beyond all seas are taken as far off.
        let u = ((points.x[l] - origin.x) * over.x).max(-FAR).min(FAR);
        let v = ((points.y[l] - origin.y) * over.y).max(-FAR).min(FAR);
        let (c, r) = (u.floor(), v.floor());
        spots.u[l] = (u - c) as f32;
        spots.v[l] = (v - r) as f32;
        spots.column[l] = c as i64;
        spots.row[l] = r as i64;
    }
    for l in 0..BLOCK {
        let (c, r) = (spots.column[l], spots.row[l]);
        let node = |c: i64, r: i64| {
            let inside = (c >= 0) & (r >= 0) & (c < columns) & (r < rows);
            if inside { (r * columns + c) as u32 } else { open }
        };
        spots.nodes[0][l] = node(c, r);
        spots.nodes[1][l] = node(c + 1, r);
        spots.nodes[2][l] = node(c, r + 1);
        spots.nodes[3][l] = node(c + 1, r + 1);
    }
    spots
}

/// Cells off the grid that are told apart.
const FAR: f64 = 1e15;

/// Asks for what the points need to be brought near: random places would wait for memory one after another.
#[inline(always)]
fn fetch(sea: &ShoreSea, spots: &Spots) {
    #[cfg(target_arch = "x86_64")]
    for point in 0..BLOCK {
        // Neighbours share their cell.
        if point > 0 && spots.nodes[0][point] == spots.nodes[0][point - 1] {
            continue;
        }
        for corner in &spots.nodes {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let node = corner[point] as usize;
            let (record, place) = (node * sea.blocks, node);
            for block in 0..sea.blocks.min(MOST) {
                // SAFETY: a hint about an address; reads nothing.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(sea.records.as_ptr().wrapping_add(record + block).cast()) };
            }
            // SAFETY: as above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(sea.places.as_ptr().wrapping_add(place).cast()) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (sea, spots);
}

/// Sixteens of waves that are unpacked at once.
const MOST: usize = 2;

/// Unpacks a sixteen of waves over the cell of a point.
#[inline(always)]
fn unpack(sea: &ShoreSea, spots: &Spots, point: usize, block: usize, cell: &mut Cell) {
    let at = |corner: usize| sea.records[spots.nodes[corner][point] as usize * sea.blocks + block];
    let (a, b, c, d) = (at(0), at(1), at(2), at(3));
    let corner_x = sea.spacing.x.mul_add(spots.column[point] as f64, sea.origin.x);
    let corner_y = sea.spacing.y.mul_add(spots.row[point] as f64, sea.origin.y);
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

/// Sums over the waves at the points, the first `N` of: ζ, ξ, sideways x and y; of ζ and ξ, the derivatives along x and y; the three of the
/// sideways motion; and three of hidden slopes.
#[inline(always)]
fn gather<const N: usize>(sea: &ShoreSea, points: &Points, sums: &mut Sums) {
    let motion = N >= 11;
    let filtered = N == FILTERED_DISPLACEMENT || N == 14;
    let mut cells = [Cell::NONE; MOST];
    let mut ground = [[0.0f32; 8]; 4];
    let mut unpacked = None;
    let (over_x, over_y) = (sea.over.x as f32, sea.over.y as f32);
    let tau = std::f32::consts::TAU;
    let spots = find(sea, points);
    fetch(sea, &spots);
    let mut totals = [[0.0f32; BLOCK]; N];
    for point in 0..BLOCK {
        let (u, v) = (spots.u[point], spots.v[point]);
        let uv = u * v;
        let mut quarters = [[0.0f32; 4]; N];
        let mut first = 0;
        while first < sea.blocks {
            let count = (sea.blocks - first).min(MOST);
            let wanted = Some((spots.column[point], spots.row[point], first));
            if unpacked != wanted {
                for (n, cell) in cells[..count].iter_mut().enumerate() {
                    unpack(sea, &spots, point, first + n, cell);
                }
                ground = place(sea, &spots, point);
                unpacked = wanted;
            }
            let mut sum = [[0.0f32; LANES]; N];
            let footprint = points.footprint[point] * (1.0 / std::f32::consts::PI);
            let square = footprint * footprint;
            for cell in &cells[..count] {
                let (p, a) = (&cell.phase, &cell.amplitude);
                for l in 0..LANES {
                    let turns = uv.mul_add(p[3][l], v.mul_add(p[2][l], u.mul_add(p[1][l], p[0][l])));
                    let height = uv.mul_add(a[3][l], v.mul_add(a[2][l], u.mul_add(a[1][l], a[0][l])));
                    let kx = v.mul_add(p[3][l], p[1][l]) * (tau * over_x);
                    let ky = u.mul_add(p[3][l], p[2][l]) * (tau * over_y);
                    let weight = if filtered {
                        let k = kx.mul_add(kx, ky * ky);
                        let t = ((1.0 - k * square) * (4.0 / 3.0)).clamp(0.0, 1.0);
                        t * t * (3.0 - 2.0 * t)
                    } else {
                        1.0
                    };
                    let (s, c) = sine_cosine(turns);
                    let shown = height * weight;
                    let (hc, hs) = (shown * c, shown * s);
                    let (ex, ey) = (cell.heading[0][l], cell.heading[1][l]);
                    sum[0][l] += hc;
                    sum[1][l] += hs;
                    sum[2][l] = hs.mul_add(ex, sum[2][l]);
                    sum[3][l] = hs.mul_add(ey, sum[3][l]);
                    if N >= 11 {
                        let ax = v.mul_add(a[3][l], a[1][l]) * (over_x * weight);
                        let ay = u.mul_add(a[3][l], a[2][l]) * (over_y * weight);
                        let (xx, xy) = (ax.mul_add(s, hc * kx), ay.mul_add(s, hc * ky));
                        sum[4][l] += ax.mul_add(c, -(hs * kx));
                        sum[5][l] += ay.mul_add(c, -(hs * ky));
                        sum[6][l] += xx;
                        sum[7][l] += xy;
                        sum[8][l] = xx.mul_add(ex, sum[8][l]);
                        sum[9][l] = (0.5 * xy).mul_add(ex, (0.5 * xx).mul_add(ey, sum[9][l]));
                        sum[10][l] = xy.mul_add(ey, sum[10][l]);
                    }
                    if N >= 14 {
                        let lost = 0.5 * height * height * (1.0 - weight * weight);
                        sum[11][l] += lost * kx * kx;
                        sum[12][l] += lost * kx * ky;
                        sum[13][l] += lost * ky * ky;
                    }
                }
            }
            // Written out: in a loop over n the compiler would gather across the sums instead of adding within them.
            macro_rules! fold {
                ($($n:literal)*) => { $(if $n < N { fold(&sum[$n % N], &mut quarters[$n % N]); })* };
            }
            fold!(0 1 2 3 4 5 6 7 8 9 10 11 12 13);
            first += count;
        }
        for (total, q) in totals.iter_mut().zip(&quarters) {
            total[point] = (q[0] + q[2]) + (q[1] + q[3]);
        }
        let (mut value, mut along_x, mut along_y) = ([0.0f32; 8], [0.0f32; 8], [0.0f32; 8]);
        for n in 0..8 {
            let [a, across, up, twist] = [ground[0][n], ground[1][n], ground[2][n], ground[3][n]];
            value[n] = uv.mul_add(twist, v.mul_add(up, u.mul_add(across, a)));
            along_x[n] = v.mul_add(twist, across) * over_x;
            along_y[n] = u.mul_add(twist, up) * over_y;
        }
        for n in 0..8 {
            sums.place[n][point] = value[n];
        }
        if motion {
            for n in Place::HEIGHT..=Place::SWING {
                sums.place_x[n][point] = along_x[n];
                sums.place_y[n][point] = along_y[n];
            }
        }
    }
    [sums.zeta, sums.xi, sums.side_x, sums.side_y] = [totals[0], totals[1], totals[2], totals[3]];
    if N >= 11 {
        [sums.zeta_x, sums.zeta_y, sums.xi_x, sums.xi_y] = [totals[4], totals[5], totals[6], totals[7]];
        sums.stretch = [totals[8], totals[9], totals[10]];
    }
    if N >= 14 {
        sums.hidden = [totals[11], totals[12], totals[13]];
    }
}

/// Adds up every fourth of sixteen numbers.
#[inline(always)]
fn fold(sum: &[f32; LANES], quarters: &mut [f32; 4]) {
    let mut half = [0.0f32; 8];
    for l in 0..8 {
        half[l] = sum[l] + sum[l + 8];
    }
    for l in 0..4 {
        quarters[l] += half[l] + half[l + 4];
    }
}

/// A number of sums that means displacement alone, but with footprints: one more than is used.
const FILTERED_DISPLACEMENT: usize = 5;

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
        (true, true) => gather::<14>(sea, points, sums),
        (true, false) => gather::<11>(sea, points, sums),
        (false, true) => gather::<FILTERED_DISPLACEMENT>(sea, points, sums),
        (false, false) => gather::<4>(sea, points, sums),
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
    let tau = std::f32::consts::TAU;
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
        let square =
            (points.footprint[point] / std::f32::consts::PI) * (points.footprint[point] / std::f32::consts::PI);
        for block in 0..sea.blocks {
            unpack(sea, &spots, point, block, &mut cell);
            let waves = &sea.lanes[block];
            let mut value = [[0.0f32; LANES]; 3];
            for l in 0..LANES {
                let (p, a) = (&cell.phase, &cell.amplitude);
                let uv = u * v;
                let turns = uv.mul_add(p[3][l], v.mul_add(p[2][l], u.mul_add(p[1][l], p[0][l])));
                let height = uv.mul_add(a[3][l], v.mul_add(a[2][l], u.mul_add(a[1][l], a[0][l])));
                let kx = v.mul_add(p[3][l], p[1][l]) * (tau * over_x);
                let ky = u.mul_add(p[3][l], p[2][l]) * (tau * over_y);
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

/// How far (m) the swash has raised or lowered the waterline at the points.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn swash(sea: &ShoreSea, points: &Points, levels: &mut [f32; BLOCK]) {
    *levels = [0.0; BLOCK];
    if sea.blocks == 0 {
        return;
    }
    let mut sums = Sums::NONE;
    add_up::<false>(sea, points, &mut sums);
    for l in 0..LANES {
        levels[l] = shape::swash(&sums, l);
    }
}
