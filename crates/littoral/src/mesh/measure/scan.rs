//! The samples of a triangle, and how far they are from its plane.

use crate::field::Raster;
use multiversion::multiversion;

/// Rounds a quotient of two integers up to 2²⁴ down exactly, from its product in `f64`: that errs by less than 2⁻²⁸, and what
/// is no whole number is at least 2⁻²⁴ away from one.
const BIAS: f64 = 1.0 / 67_108_864.0;

#[inline(always)]
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from(whole as f64 > x)
}

/// One edge as columns by rows.
#[derive(Clone, Copy)]
struct Side {
    from: [i64; 2],
    slope: f64,
}

impl Side {
    fn new(from: [u32; 2], to: [u32; 2]) -> Side {
        let (from, to) = (from.map(i64::from), to.map(i64::from));
        let slope = if to[1] > from[1] { (to[0] - from[0]) as f64 / (to[1] - from[1]) as f64 } else { 0.0 };
        Side { from, slope }
    }

    #[inline(always)]
    fn at(&self, row: u32) -> f64 {
        (i64::from(row) - self.from[1]) as f64 * self.slope
    }

    /// The first sample at or east of the edge.
    #[inline(always)]
    fn first(&self, row: u32) -> u32 {
        (self.from[0] - floor(BIAS - self.at(row))) as u32
    }

    /// The last sample at or west of it.
    #[inline(always)]
    fn last(&self, row: u32) -> u32 {
        (self.from[0] + floor(self.at(row) + BIAS)) as u32
    }
}

/// The samples within and on the border of a triangle, row by row.
#[derive(Clone, Copy)]
pub(crate) struct Spans {
    long: Side,
    lower: Side,
    upper: Side,
    /// First and last row.
    pub rows: [u32; 2],
    /// First row of the upper side.
    middle: u32,
    long_is_west: bool,
}

impl Spans {
    /// Of a triangle whose corners turn either way; none of a flat one.
    #[inline(always)]
    pub fn new(mut corners: [[u32; 2]; 3]) -> Option<Spans> {
        corners.sort_unstable_by_key(|at| at[1]);
        let [low, middle, high] = corners;
        let turn = super::doubled_area([low, high, middle]);
        (turn != 0).then(|| Spans {
            long: Side::new(low, high),
            lower: Side::new(low, middle),
            upper: Side::new(middle, high),
            rows: [low[1], high[1]],
            middle: if middle[1] == high[1] { u32::MAX } else { middle[1] },
            long_is_west: turn < 0,
        })
    }

    /// The first and last sample of one of its rows; none where the first is beyond the last.
    #[inline(always)]
    pub fn row(&self, row: u32) -> (u32, u32) {
        let short = if row < self.middle { &self.lower } else { &self.upper };
        let (west, east) = if self.long_is_west { (&self.long, short) } else { (short, &self.long) };
        (west.first(row), east.last(row))
    }
}

/// Calls `visit(row, first, last)` for the samples within and on the border of a triangle, row by row; rows without any are
/// left out. The corners may turn either way.
#[inline(always)]
pub(crate) fn spans(corners: [[u32; 2]; 3], mut visit: impl FnMut(u32, u32, u32)) {
    let Some(spans) = Spans::new(corners) else { return };
    for row in spans.rows[0]..=spans.rows[1] {
        let (first, last) = spans.row(row);
        if first <= last {
            visit(row, first, last);
        }
    }
}

/// Whether sums and products of the heights are exact: the heights are multiples of a step that is not too fine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exactness {
    /// How many bits a height takes when counted in steps, without its sign.
    pub bits: u32,
}

impl Exactness {
    /// More bits than can be counted on.
    const NONE: Exactness = Exactness { bits: 1000 };

    /// Of all heights of a raster.
    pub fn of(raster: &Raster) -> Exactness {
        let (mut last, mut first) = (i32::MAX, 0);
        for heights in raster.heights().chunks(1 << 14) {
            let (lowest, highest) = digits(heights);
            (last, first) = (last.min(lowest), first.max(highest));
            // The exponent of the first digit, in the same count as that of the last; and what single precision can square.
            let top = (first >> 23).max(1) as i32 + 24;
            if last != i32::MAX && (top - last > 24 || f32::from_bits(first) > 1e18) {
                return Exactness::NONE;
            }
        }
        let top = (first >> 23).max(1) as i32 + 24;
        Exactness { bits: if last == i32::MAX { 0 } else { (top - last) as u32 } }
    }
}

/// The lowest place of a digit that is not 0 in any number, and the greatest of them without its sign, as bits.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn digits(heights: &[f32]) -> (i32, u32) {
    let (mut lowest, mut highest) = (i32::MAX, 0);
    for height in heights {
        let bits = height.to_bits() & 0x7fff_ffff;
        let exponent = (bits >> 23) as i32;
        let mantissa = (bits & 0x7f_ffff) | if exponent > 0 { 0x80_0000 } else { 0 };
        // The last digit by itself, made a number whose exponent tells its place.
        let last = (mantissa & mantissa.wrapping_neg()) as i32 as f32;
        let place = exponent.max(1) + (last.to_bits() >> 23) as i32 - 127;
        let place = if mantissa == 0 { i32::MAX } else { place };
        lowest = lowest.min(place);
        highest = highest.max(bits);
    }
    (lowest, highest)
}

/// The plane through the corners of a triangle, all numbers multiplied by twice its area so that no division rounds them.
pub(crate) struct Plane {
    origin: [f64; 2],
    height: f64,
    slope: [f64; 2],
    area: f64,
}

impl Plane {
    pub fn new(heights: &[f32], columns: usize, corners: [[u32; 2]; 3]) -> Plane {
        let [a, b, c] = corners;
        let height = |at: [u32; 2]| f64::from(heights[at[1] as usize * columns + at[0] as usize]);
        let from_a = |at: [u32; 2]| [0, 1].map(|axis| f64::from(at[axis]) - f64::from(a[axis]));
        let ([bx, by], [cx, cy]) = (from_a(b), from_a(c));
        let (rise_b, rise_c) = (height(b) - height(a), height(c) - height(a));
        let slope = [rise_b * cy - rise_c * by, rise_c * bx - rise_b * cx];
        Plane { origin: a.map(f64::from), height: height(a), slope, area: bx * cy - by * cx }
    }

    /// How far a height is from the plane (m).
    #[inline(always)]
    pub fn error(&self, column: f64, row: f64, height: f32) -> f64 {
        let rise = (column - self.origin[0]) * self.slope[0] + (row - self.origin[1]) * self.slope[1];
        ((rise + self.area * (self.height - f64::from(height))) / self.area).abs()
    }
}

/// The greatest vertical distance (m) between the plane through the corners of a triangle and the samples in it, never less
/// than the true one, and exact where the heights allow it.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(crate) fn deviation(heights: &[f32], columns: usize, exactness: Exactness, corners: [[u32; 2]; 3]) -> f64 {
    const LANES: usize = 8;
    let plane = Plane::new(heights, columns, corners);
    let mut greatest = [0f64; LANES];
    spans(corners, |row, first, last| {
        let rise = (f64::from(row) - plane.origin[1]) * plane.slope[1];
        let line = &heights[row as usize * columns..][first as usize..last as usize + 1];
        let west = f64::from(first) - plane.origin[0];
        for (chunk, heights) in line.chunks(LANES).enumerate() {
            let west = west + (chunk * LANES) as f64;
            for (lane, height) in heights.iter().enumerate() {
                let rise = rise + (west + lane as f64) * plane.slope[0];
                let error = (rise + plane.area * (plane.height - f64::from(*height))).abs();
                greatest[lane] = greatest[lane].max(error);
            }
        }
    });
    let area = plane.area.abs();
    let greatest = greatest.into_iter().fold(0.0, f64::max);
    let extent = |axis: usize| {
        let along = corners.map(|at| at[axis]);
        1 + along.into_iter().max().unwrap_or(0) - along.into_iter().min().unwrap_or(0)
    };
    let (width, height) = (extent(0), extent(1));
    // Numbers are products of two sides and a height, and sums of four of them.
    let bits = 66 - width.leading_zeros() - height.leading_zeros() + exactness.bits;
    if bits <= 53 || (plane.slope == [0.0; 2] && greatest == 0.0) {
        return greatest / area;
    }
    let corner = |at: [u32; 2]| f64::from(heights[at[1] as usize * columns + at[0] as usize]).abs();
    let highest = corners.into_iter().map(corner).fold(0.0, f64::max);
    let slender = f64::from(width) * f64::from(height) / area;
    (greatest / area) * (1.0 + 16.0 * f64::EPSILON) + 32.0 * f64::EPSILON * highest * slender
}
