//! Deviations of small squares: sixteen blocks of 64 × 64 patches side by side, one in each lane.
//!
//! The samples of the blocks are laid out anew so that sixteen at the same place in their blocks lie together; from then on
//! each lane does what a program for one block would do, without a shuffle, for squares of 2, 4, 8, 16, 32 and 64 patches.

use multiversion::multiversion;

/// Patches along the side of a block.
pub(super) const SIDE: usize = 64;
/// Sizes of squares in it.
pub(super) const SIZES: usize = 6;
/// Blocks side by side.
pub(super) const LANES: usize = 16;

const LINE: usize = SIDE + 1;

pub(super) type Lanes = [f32; LANES];

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
    pub fn measure(
        &mut self,
        heights: &[f32],
        columns: usize,
        corners: &[usize; LANES],
        rises: bool,
        exact: [bool; SIZES],
    ) {
        lay_out(heights, columns, corners, &mut self.samples);
        measure(&self.samples, rises, exact, &mut self.found);
    }

    /// How far the samples of the blocks measured last are from two planes each, one on either side of the blocks' diagonal,
    /// the southern side first; on it counts for both.
    pub fn beside(&self, rises: bool, planes: &[Planes; 2]) -> [Lanes; 2] {
        beside(&self.samples, rises, planes)
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
        for lane in 0..LANES {
            let row = &heights[corners[lane] + y * columns..][..LINE];
            for x in 0..LINE {
                line[x][lane] = row[x];
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

/// a · x + b in each lane.
#[inline(always)]
fn linear(a: &Lanes, x: f32, b: &Lanes) -> Lanes {
    let mut sum = [0.0; LANES];
    for lane in 0..LANES {
        sum[lane] = a[lane].mul_add(x, b[lane]);
    }
    sum
}

/// (b − a) · share in each lane.
#[inline(always)]
fn slope(a: &Lanes, b: &Lanes, share: f32) -> Lanes {
    let mut slope = [0.0; LANES];
    for lane in 0..LANES {
        slope[lane] = (b[lane] - a[lane]) * share;
    }
    slope
}

/// The slope from the middle of a side to the centre.
#[inline(always)]
fn rise(a: &Lanes, b: &Lanes, centre: &Lanes, share: f32) -> Lanes {
    let mut slope = [0.0; LANES];
    for lane in 0..LANES {
        slope[lane] = (centre[lane] - (0.5 * a[lane] + 0.5 * b[lane])) * share;
    }
    slope
}

#[inline(always)]
fn raise(kept: &mut Lanes, found: &Lanes) {
    for lane in 0..LANES {
        kept[lane] = if found[lane] > kept[lane] { found[lane] } else { kept[lane] };
    }
}

/// Adds what may have been lost by rounding.
#[inline(always)]
fn widen(errors: &mut Lanes, doubt: &Lanes) {
    for lane in 0..LANES {
        errors[lane] = errors[lane].mul_add(1.0 + OF_ERROR, doubt[lane]);
    }
}

/// The greatest errors of one square of S patches a side: of its halves, and of its southern, eastern, northern and western
/// quarter.
#[inline(always)]
fn square<const S: usize>(samples: &[Lanes], at: usize, rises: bool, exact: bool) -> (Lanes, [Lanes; 4]) {
    let (half, share) = (S / 2, 1.0 / S as f32);
    let (a, b) = (&samples[at], &samples[at + S]);
    let (c, d) = (&samples[at + S * LINE], &samples[at + S * LINE + S]);
    let m = &samples[at + half * LINE + half];
    let (south, north) = (slope(a, b, share), slope(c, d, share));
    let (west, east) = (slope(a, c, share), slope(b, d, share));
    let mut halves = [0.0; LANES];
    for y in 1..S {
        let (up, down) = (y as f32, y as f32 - S as f32);
        let line = &samples[at + y * LINE..][..S + 1];
        if rises {
            // North-west of the diagonal the northern side's slope, from the western side; else the southern one's, and
            // from there as the eastern side.
            farthest(&mut halves, &linear(&west, up, a), &north, 1, &line[1..y]);
            farthest(&mut halves, &linear(&east, up, a), &south, y as i32, &line[y..S]);
        } else {
            farthest(&mut halves, &linear(&west, up, a), &south, 1, &line[1..S + 1 - y]);
            farthest(&mut halves, &linear(&east, down, c), &north, (S + 1 - y) as i32, &line[S + 1 - y..S]);
        }
    }
    let toward = 1.0 / half as f32;
    let (from_south, from_north) = (rise(a, b, m, toward), rise(c, d, m, toward));
    // Eastward from both sides.
    let (from_west, from_east) = (rise(a, c, m, toward), rise(b, d, m, -toward));
    let mut quarters = [[0.0; LANES]; 4];
    for y in 0..=S {
        let (up, down) = (y as f32, (S - y) as f32);
        let line = &samples[at + y * LINE..][..S + 1];
        let depth = y.min(S - y);
        if y < half {
            let base = linear(&from_south, up, a);
            farthest(&mut quarters[0], &base, &south, depth as i32 + 1, &line[depth + 1..S - depth]);
        }
        if y > half {
            let base = linear(&from_north, down, c);
            farthest(&mut quarters[2], &base, &north, depth as i32 + 1, &line[depth + 1..S - depth]);
        }
        if depth > 0 {
            let base = linear(&west, up, a);
            farthest(&mut quarters[3], &base, &from_west, 0, &line[..depth]);
            // Counted from the eastern side.
            let base = linear(&east, up, b);
            farthest(&mut quarters[1], &base, &from_east, 1 - depth as i32, &line[S + 1 - depth..]);
        }
    }
    if !exact {
        let mut doubt = [0.0; LANES];
        for l in 0..LANES {
            let highest = a[l].abs().max(b[l].abs()).max(c[l].abs()).max(d[l].abs()).max(m[l].abs());
            // Nothing is rounded where all corners are equally high.
            let flat = (a[l] == b[l]) & (a[l] == c[l]) & (a[l] == d[l]) & (a[l] == m[l]);
            // Too large where differences could overflow: then nothing is known.
            doubt[l] = if flat { 0.0 } else { highest.max(1e-30) * 34.0 * (OF_HEIGHT / 34.0) };
        }
        widen(&mut halves, &doubt);
        for quarter in &mut quarters {
            widen(quarter, &doubt);
        }
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

/// A plane in each lane: its height at the south-western sample of a block, and how it rises from a sample to the next.
#[derive(Clone, Copy, Default)]
pub(super) struct Planes {
    pub base: Lanes,
    pub east: Lanes,
    pub north: Lanes,
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn beside(samples: &[Lanes], rises: bool, [south, north]: &[Planes; 2]) -> [Lanes; 2] {
    let (mut in_south, mut in_north) = ([0.0; LANES], [0.0; LANES]);
    for (y, line) in samples.chunks_exact(LINE).enumerate() {
        let up = y as f32;
        let (south_base, north_base) = (linear(&south.north, up, &south.base), linear(&north.north, up, &north.base));
        if rises {
            farthest(&mut in_north, &north_base, &north.east, 0, &line[..=y]);
            farthest(&mut in_south, &south_base, &south.east, y as i32, &line[y..]);
        } else {
            farthest(&mut in_south, &south_base, &south.east, 0, &line[..LINE - y]);
            farthest(&mut in_north, &north_base, &north.east, (SIDE - y) as i32, &line[SIDE - y..]);
        }
    }
    [in_south, in_north]
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure(samples: &[Lanes], rises: bool, exact: [bool; SIZES], found: &mut [Lanes]) {
    squares::<2>(samples, rises, exact[0], &mut found[offsets(0)[0]..offsets(1)[0]]);
    squares::<4>(samples, rises, exact[1], &mut found[offsets(1)[0]..offsets(2)[0]]);
    squares::<8>(samples, rises, exact[2], &mut found[offsets(2)[0]..offsets(3)[0]]);
    squares::<16>(samples, rises, exact[3], &mut found[offsets(3)[0]..offsets(4)[0]]);
    squares::<32>(samples, rises, exact[4], &mut found[offsets(4)[0]..offsets(5)[0]]);
    squares::<64>(samples, rises, exact[5], &mut found[offsets(5)[0]..offsets(6)[0]]);
}
