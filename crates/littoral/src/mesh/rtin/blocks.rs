//! Deviations of small squares: sixteen blocks of 32 × 32 patches side by side, one in each lane.
//!
//! The samples of the blocks are laid out anew so that sixteen at the same place in their blocks lie together; from then on
//! each lane does what a program for one block would do, without a shuffle, for squares of 2, 4, 8, 16 and 32 patches.

use multiversion::multiversion;

/// Patches along the side of a block.
pub(super) const SIDE: usize = 32;
/// Sizes of squares in it.
pub(super) const SIZES: usize = 5;
/// Blocks side by side.
pub(super) const LANES: usize = 16;

const LINE: usize = SIDE + 1;

type Lanes = [f32; LANES];

/// What rounding may add to an error computed in single precision, as a share of the greatest height that it is computed
/// from, and of itself: six roundings of numbers not above twice that height, and one of the difference, each of half a last
/// digit.
pub(super) const OF_HEIGHT: f32 = 4.0 * f32::EPSILON;
pub(super) const OF_ERROR: f32 = 2.0 * f32::EPSILON;

/// Samples of sixteen blocks, and the deviations of their squares.
pub(super) struct Blocks {
    samples: Vec<Lanes>,
    /// For each size m² centres, (m + 1) · m sides in the south and north, m · (m + 1) sides in the west and east.
    found: Vec<Lanes>,
}

/// How many squares of a size lie along the side of a block.
pub(super) const fn across(k: usize) -> usize {
    SIDE >> (k + 1)
}

/// Index of the first centre, southern or northern side, and western or eastern one of a size.
const fn offsets(k: usize) -> [usize; 3] {
    let (mut offset, mut size) = (0, 0);
    while size < k {
        let m = across(size);
        offset += m * m + 2 * m * (m + 1);
        size += 1;
    }
    let m = across(k);
    [offset, offset + m * m, offset + m * m + m * (m + 1)]
}

impl Blocks {
    pub fn new() -> Blocks {
        Blocks { samples: vec![[0.0; LANES]; LINE * LINE], found: vec![[0.0; LANES]; offsets(SIZES)[0]] }
    }

    /// Measures the blocks with these south-western samples; `rises` tells the diagonal of all of them, `exact` which sizes
    /// of squares are computed without rounding.
    pub fn measure(&mut self, heights: &[f32], columns: usize, corners: &[usize; LANES], rises: bool, exact: [bool; SIZES]) {
        lay_out(heights, columns, corners, &mut self.samples);
        measure(&self.samples, rises, exact, &mut self.found);
    }

    /// Row y of the centres of a size, of the sides south of it, or of those west and east of its squares.
    pub fn row(&self, k: usize, kind: usize, y: usize) -> &[Lanes] {
        let wide = across(k) + usize::from(kind == 2);
        &self.found[offsets(k)[kind] + y * wide..][..wide]
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn lay_out(heights: &[f32], columns: usize, corners: &[usize; LANES], samples: &mut [Lanes]) {
    for (y, line) in samples.chunks_exact_mut(LINE).enumerate() {
        let rows: [&[f32]; LANES] = std::array::from_fn(|lane| &heights[corners[lane] + y * columns..][..LINE]);
        for x in 0..LINE {
            for lane in 0..LANES {
                line[x][lane] = rows[lane][x];
            }
        }
    }
}

/// How far samples are from a plane that is at `base` where x = 0; the first of them is at x = `first`.
#[inline(always)]
fn farthest(greatest: &mut Lanes, base: &Lanes, slope: &Lanes, first: i32, line: &[Lanes]) {
    let mut most = *greatest;
    for (x, heights) in line.iter().enumerate() {
        let x = (first + x as i32) as f32;
        for lane in 0..LANES {
            let error = (slope[lane].mul_add(x, base[lane]) - heights[lane]).abs();
            most[lane] = if error > most[lane] { error } else { most[lane] };
        }
    }
    *greatest = most;
}

#[inline(always)]
fn of(f: impl Fn(usize) -> f32) -> Lanes {
    std::array::from_fn(f)
}

#[inline(always)]
fn raise(kept: &mut Lanes, found: &Lanes) {
    for lane in 0..LANES {
        kept[lane] = if found[lane] > kept[lane] { found[lane] } else { kept[lane] };
    }
}

/// The greatest errors of one square of S patches a side: of its halves, and of its southern, eastern, northern and western
/// quarter.
#[inline(always)]
fn square<const S: usize>(samples: &[Lanes], at: usize, rises: bool, exact: bool) -> (Lanes, [Lanes; 4]) {
    let (half, share) = (S / 2, 1.0 / S as f32);
    let line = |y: usize| &samples[at + y * LINE..][..S + 1];
    let (a, b, c, d, m) = (&line(0)[0], &line(0)[S], &line(S)[0], &line(S)[S], &line(half)[half]);
    let slope = |p: &Lanes, q: &Lanes| of(|l| (q[l] - p[l]) * share);
    let (south, north, west, east) = (slope(a, b), slope(c, d), slope(a, c), slope(b, d));
    let mut halves = [0.0; LANES];
    for y in 1..S {
        let (up, down) = (y as f32, y as f32 - S as f32);
        let line = line(y);
        if rises {
            // North-west of the diagonal the northern side's slope, from the western side; else the southern one's, and
            // from there as the eastern side.
            farthest(&mut halves, &of(|l| west[l].mul_add(up, a[l])), &north, 1, &line[1..y]);
            farthest(&mut halves, &of(|l| east[l].mul_add(up, a[l])), &south, y as i32, &line[y..S]);
        } else {
            farthest(&mut halves, &of(|l| west[l].mul_add(up, a[l])), &south, 1, &line[1..S + 1 - y]);
            farthest(&mut halves, &of(|l| east[l].mul_add(down, c[l])), &north, (S + 1 - y) as i32, &line[S + 1 - y..S]);
        }
    }
    let toward = 1.0 / half as f32;
    let rise = |p: &Lanes, q: &Lanes| of(|l| (m[l] - (0.5 * p[l] + 0.5 * q[l])) * toward);
    let (from_south, from_north, from_west, from_east) = (rise(a, b), rise(c, d), rise(a, c), rise(b, d));
    let mut quarters = [[0.0; LANES]; 4];
    for y in 0..=S {
        let (up, down, line) = (y as f32, (S - y) as f32, line(y));
        let depth = y.min(S - y);
        if y < half {
            let base = of(|l| from_south[l].mul_add(up, a[l]));
            farthest(&mut quarters[0], &base, &south, depth as i32 + 1, &line[depth + 1..S - depth]);
        }
        if y > half {
            let base = of(|l| from_north[l].mul_add(down, c[l]));
            farthest(&mut quarters[2], &base, &north, depth as i32 + 1, &line[depth + 1..S - depth]);
        }
        if depth > 0 {
            let base = of(|l| west[l].mul_add(up, a[l]));
            farthest(&mut quarters[3], &base, &from_west, 0, &line[..depth]);
            // Counted from the eastern side.
            let (base, falls) = (of(|l| east[l].mul_add(up, b[l])), of(|l| -from_east[l]));
            farthest(&mut quarters[1], &base, &falls, 1 - depth as i32, &line[S + 1 - depth..]);
        }
    }
    if !exact {
        // Nothing is rounded where all corners are equally high.
        let doubt = of(|l| {
            let highest = a[l].abs().max(b[l].abs()).max(c[l].abs()).max(d[l].abs()).max(m[l].abs());
            let flat = a[l] == b[l] && a[l] == c[l] && a[l] == d[l] && a[l] == m[l];
            // Too large where differences could overflow: then nothing is known.
            if flat { 0.0 } else { highest.max(1e-30) * 34.0 * (OF_HEIGHT / 34.0) }
        });
        let widen = |error: &mut Lanes| *error = of(|l| error[l].mul_add(1.0 + OF_ERROR, doubt[l]));
        widen(&mut halves);
        quarters.iter_mut().for_each(widen);
    }
    (halves, quarters)
}

#[inline(always)]
fn squares<const S: usize>(samples: &[Lanes], rises: bool, exact: bool, found: &mut [Lanes]) {
    let m = SIDE / S;
    let (centres, sides) = found.split_at_mut(m * m);
    let (flat, upright) = sides.split_at_mut(m * (m + 1));
    sides_to_zero(flat);
    sides_to_zero(upright);
    for y in 0..m {
        for x in 0..m {
            let rises = if m == 1 { rises } else { (x + y) % 2 == 0 };
            let (halves, [south, east, north, west]) = if rises {
                square::<S>(samples, y * S * LINE + x * S, true, exact)
            } else {
                square::<S>(samples, y * S * LINE + x * S, false, exact)
            };
            centres[y * m + x] = halves;
            raise(&mut flat[y * m + x], &south);
            raise(&mut flat[(y + 1) * m + x], &north);
            raise(&mut upright[y * (m + 1) + x], &west);
            raise(&mut upright[y * (m + 1) + x + 1], &east);
        }
    }
}

#[inline(always)]
fn sides_to_zero(sides: &mut [Lanes]) {
    sides.fill([0.0; LANES]);
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure(samples: &[Lanes], rises: bool, exact: [bool; SIZES], found: &mut [Lanes]) {
    squares::<2>(samples, rises, exact[0], &mut found[offsets(0)[0]..offsets(1)[0]]);
    squares::<4>(samples, rises, exact[1], &mut found[offsets(1)[0]..offsets(2)[0]]);
    squares::<8>(samples, rises, exact[2], &mut found[offsets(2)[0]..offsets(3)[0]]);
    squares::<16>(samples, rises, exact[3], &mut found[offsets(3)[0]..offsets(4)[0]]);
    squares::<32>(samples, rises, exact[4], &mut found[offsets(4)[0]..offsets(5)[0]]);
}
