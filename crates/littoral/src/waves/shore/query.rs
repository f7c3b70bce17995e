//! What the sea over a bed answers at points: the kernel over waves.
//!
//! A cell's four corners are unpacked once, sixteen waves at a time, into bilinear polynomials of phase and amplitude whose phase includes
//! the wave of the open sea and the instant; points in the same cell follow at the cost of a sine each wave. A point's answer does not
//! depend on which others are asked about with it.

use super::super::{Motion, Points, Velocity};
use super::lanes::{LANES, decay, sine_cosine};
use super::march::{Record, sum};
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

/// Sixteens of waves that are unpacked at once.
const MOST: usize = 2;

/// Unpacks a sixteen of waves over a cell.
#[inline(always)]
fn unpack(sea: &ShoreSea, column: i64, row: i64, block: usize, cell: &mut Cell) {
    let open = Record::OPEN;
    let at = |c: i64, r: i64| sea.node(c, r).map_or(&open, |i| &sea.records[i * sea.blocks + block]);
    let (east, north) = (column.saturating_add(1), row.saturating_add(1));
    let (a, b, c, d) = (at(column, row), at(east, row), at(column, north), at(east, north));
    let corner_x = sea.spacing.x.mul_add(column as f64, sea.origin.x);
    let corner_y = sea.spacing.y.mul_add(row as f64, sea.origin.y);
    let waves = &sea.lanes[block];
    for l in 0..LANES {
        let turns = waves.turns_x[l].mul_add(corner_x, waves.turns_y[l].mul_add(corner_y, waves.now[l]));
        let base = (turns - turns.floor()) as f32;
        let across = b.phase[l].wrapping_sub(a.phase[l]);
        let up = c.phase[l].wrapping_sub(a.phase[l]);
        let twist = i32::from(d.phase[l].wrapping_sub(c.phase[l])) - i32::from(across);
        const TURN: f32 = 1.0 / 65_536.0;
        cell.phase[0][l] = f32::from(a.phase[l]).mul_add(TURN, base);
        cell.phase[1][l] = f32::from(across).mul_add(TURN, waves.step_x[l]);
        cell.phase[2][l] = f32::from(up).mul_add(TURN, waves.step_y[l]);
        cell.phase[3][l] = twist as f32 * TURN;
        let unit = waves.unit[l];
        let (aa, ab, ac, ad) =
            (i32::from(a.amplitude[l]), i32::from(b.amplitude[l]), i32::from(c.amplitude[l]), i32::from(d.amplitude[l]));
        cell.amplitude[0][l] = aa as f32 * unit;
        cell.amplitude[1][l] = (ab - aa) as f32 * unit;
        cell.amplitude[2][l] = (ac - aa) as f32 * unit;
        cell.amplitude[3][l] = (ad - ac - ab + aa) as f32 * unit;
    }
    cell.heading = waves.heading;
}

/// Sums over the waves at the points; slopes and all only where `MOTION`.
#[inline(always)]
fn gather<const MOTION: bool>(sea: &ShoreSea, points: &Points, sums: &mut Sums) {
    let mut cells = [Cell::NONE; MOST];
    let mut unpacked = None;
    let (over_x, over_y) = ((1.0 / sea.spacing.x) as f32, (1.0 / sea.spacing.y) as f32);
    let tau = std::f32::consts::TAU;
    let filtered = points.footprint.iter().any(|f| *f > 0.0);
    for point in 0..BLOCK {
        let ([column, row], [u, v]) = sea.locate(points.x[point], points.y[point]);
        place::<MOTION>(sea, column, row, u, v, point, sums);
        let uv = u * v;
        let mut first = 0;
        while first < sea.blocks {
            let count = (sea.blocks - first).min(MOST);
            if unpacked != Some((column, row, first)) {
                for n in 0..count {
                    unpack(sea, column, row, first + n, &mut cells[n]);
                }
                unpacked = Some((column, row, first));
            }
            let mut value = [[0.0f32; LANES]; 4];
            let mut along_x = [[0.0f32; LANES]; 4];
            let mut along_y = [[0.0f32; LANES]; 4];
            let mut hidden = [[0.0f32; LANES]; 3];
            for cell in &cells[..count] {
                if MOTION || filtered {
                    let footprint = points.footprint[point] * (1.0 / std::f32::consts::PI);
                    let square = footprint * footprint;
                    for l in 0..LANES {
                        let (p, a) = (&cell.phase, &cell.amplitude);
                        let turns = uv.mul_add(p[3][l], v.mul_add(p[2][l], u.mul_add(p[1][l], p[0][l])));
                        let height = uv.mul_add(a[3][l], v.mul_add(a[2][l], u.mul_add(a[1][l], a[0][l])));
                        let kx = v.mul_add(p[3][l], p[1][l]) * (tau * over_x);
                        let ky = u.mul_add(p[3][l], p[2][l]) * (tau * over_y);
                        let k = kx.mul_add(kx, ky * ky);
                        let t = ((1.0 - k * square) * (4.0 / 3.0)).clamp(0.0, 1.0);
                        let weight = t * t * (3.0 - 2.0 * t);
                        let (s, c) = sine_cosine(turns);
                        let shown = height * weight;
                        let (hc, hs) = (shown * c, shown * s);
                        value[0][l] += hc;
                        value[1][l] += hs;
                        value[2][l] -= hs * cell.heading[0][l];
                        value[3][l] -= hs * cell.heading[1][l];
                        if MOTION {
                            let ax = v.mul_add(a[3][l], a[1][l]) * (over_x * weight);
                            let ay = u.mul_add(a[3][l], a[2][l]) * (over_y * weight);
                            let (zx, zy) = (ax.mul_add(c, -(hs * kx)), ay.mul_add(c, -(hs * ky)));
                            let (xx, xy) = (ax.mul_add(s, hc * kx), ay.mul_add(s, hc * ky));
                            along_x[0][l] += zx;
                            along_y[0][l] += zy;
                            along_x[1][l] += xx;
                            along_y[1][l] += xy;
                            along_x[2][l] -= xx * cell.heading[0][l];
                            along_y[2][l] -= xy * cell.heading[0][l];
                            along_x[3][l] -= xx * cell.heading[1][l];
                            along_y[3][l] -= xy * cell.heading[1][l];
                            let lost = 0.5 * height * height * (1.0 - weight * weight);
                            hidden[0][l] += lost * kx * kx;
                            hidden[1][l] += lost * kx * ky;
                            hidden[2][l] += lost * ky * ky;
                        }
                    }
                } else {
                    for l in 0..LANES {
                        let (p, a) = (&cell.phase, &cell.amplitude);
                        let turns = uv.mul_add(p[3][l], v.mul_add(p[2][l], u.mul_add(p[1][l], p[0][l])));
                        let height = uv.mul_add(a[3][l], v.mul_add(a[2][l], u.mul_add(a[1][l], a[0][l])));
                        let (s, c) = sine_cosine(turns);
                        let (hc, hs) = (height * c, height * s);
                        value[0][l] += hc;
                        value[1][l] += hs;
                        value[2][l] -= hs * cell.heading[0][l];
                        value[3][l] -= hs * cell.heading[1][l];
                    }
                }
            }
            for n in 0..4 {
                sums.values[n][point] += sum(&value[n]);
                if MOTION {
                    sums.along_x[n][point] += sum(&along_x[n]);
                    sums.along_y[n][point] += sum(&along_y[n]);
                }
            }
            if MOTION {
                for n in 0..3 {
                    sums.hidden[n][point] += sum(&hidden[n]);
                }
            }
            first += count;
        }
    }
}

/// What is known of the place of a point.
#[inline(always)]
fn place<const MOTION: bool>(sea: &ShoreSea, column: i64, row: i64, u: f32, v: f32, point: usize, sums: &mut Sums) {
    let at = |c: i64, r: i64| &sea.node(c, r).map_or(&sea.open, |i| &sea.places[i]).0;
    let (east, north) = (column.saturating_add(1), row.saturating_add(1));
    let (a, b, c, d) = (at(column, row), at(east, row), at(column, north), at(east, north));
    let (over_x, over_y) = ((1.0 / sea.spacing.x) as f32, (1.0 / sea.spacing.y) as f32);
    for n in 0..8 {
        let (across, up) = (b[n] - a[n], c[n] - a[n]);
        let twist = (d[n] - c[n]) - across;
        sums.place[n][point] = (u * v).mul_add(twist, v.mul_add(up, u.mul_add(across, a[n])));
        if MOTION {
            sums.place_x[n][point] = v.mul_add(twist, across) * over_x;
            sums.place_y[n][point] = u.mul_add(twist, up) * over_y;
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn displacement(sea: &ShoreSea, points: &Points, motion: &mut Motion) {
    if sea.blocks == 0 {
        return;
    }
    let mut sums = Sums::NONE;
    gather::<false>(sea, points, &mut sums);
    for l in 0..LANES {
        let parts = shape::profile(&sums, l);
        let sideways = sums.place[Place::SIDEWAYS][l];
        motion.dz[l] += parts.0;
        motion.dx[l] += sideways * sums.values[2][l];
        motion.dy[l] += sideways * sums.values[3][l];
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn motion(sea: &ShoreSea, points: &Points, motion: &mut Motion) {
    if sea.blocks == 0 {
        return;
    }
    let mut sums = Sums::NONE;
    gather::<true>(sea, points, &mut sums);
    for l in 0..LANES {
        let parts = shape::profile(&sums, l);
        let sideways = sums.place[Place::SIDEWAYS][l];
        motion.dz[l] += parts.0;
        motion.dx[l] += sideways * sums.values[2][l];
        motion.dy[l] += sideways * sums.values[3][l];
        motion.slope_x[l] += shape::profile_slope(&sums, l, parts, &sums.along_x, &sums.place_x);
        motion.slope_y[l] += shape::profile_slope(&sums, l, parts, &sums.along_y, &sums.place_y);
        let (gx, gy) = (sums.place_x[Place::SIDEWAYS][l], sums.place_y[Place::SIDEWAYS][l]);
        motion.dxx[l] += sideways.mul_add(sums.along_x[2][l], gx * sums.values[2][l]);
        motion.dyy[l] += sideways.mul_add(sums.along_y[3][l], gy * sums.values[3][l]);
        let xy = sideways.mul_add(sums.along_y[2][l], gy * sums.values[2][l]);
        let yx = sideways.mul_add(sums.along_x[3][l], gx * sums.values[3][l]);
        motion.dxy[l] += 0.5 * (xy + yx);
        motion.hidden_xx[l] += sums.hidden[0][l];
        motion.hidden_xy[l] += sums.hidden[1][l];
        motion.hidden_yy[l] += sums.hidden[2][l];
    }
    for l in 0..LANES {
        let at = (points.x[l], points.y[l]);
        let foam = sea.lace.foam(&sums, l, sea.frequency, sea.breaking, at, points.footprint[l]);
        motion.foam[l] = motion.foam[l].max(foam);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn velocity(sea: &ShoreSea, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
    if sea.blocks == 0 {
        return;
    }
    let (over_x, over_y) = ((1.0 / sea.spacing.x) as f32, (1.0 / sea.spacing.y) as f32);
    let tau = std::f32::consts::TAU;
    let mut sums = Sums::NONE;
    let mut cell = Cell::NONE;
    for point in 0..BLOCK {
        let ([column, row], [u, v]) = sea.locate(points.x[point], points.y[point]);
        place::<false>(sea, column, row, u, v, point, &mut sums);
        let bed = sums.place[Place::DEPTH][point];
        let below = depths[point].max(0.0);
        if below >= bed {
            continue;
        }
        let square = (points.footprint[point] / std::f32::consts::PI) * (points.footprint[point] / std::f32::consts::PI);
        for block in 0..sea.blocks {
            unpack(sea, column, row, block, &mut cell);
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
    gather::<false>(sea, points, &mut sums);
    for l in 0..LANES {
        let swing = sums.place[Place::SWING][l];
        // 2 % of waves are higher than 2.8 √m₀.
        let usual = (0.7 * sums.place[Place::HEIGHT][l]).max(1e-4);
        let wave = (sums.values[0][l] / usual).clamp(-1.0, 1.3);
        levels[l] = swing.mul_add(wave, sums.place[Place::SETUP][l]);
    }
}
