//! Deviations of large squares, row of samples by row.
//!
//! A band of rows is looked at for all sizes of squares while it lies in the nearer caches; what it finds of a square that is
//! taller than the band is a part of its deviation, the greatest of all parts the whole.

use super::blocks::{OF_ERROR, OF_HEIGHT};
use multiversion::multiversion;

const LANES: usize = 16;

/// One square, and which of its rows are to be looked at.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    /// Index of its south-western sample.
    pub corner: usize,
    /// Patches along its side, at least 32.
    pub side: usize,
    /// Whether its diagonal leads from the south-west to the north-east.
    pub rises: bool,
    /// First and last row, counted from its southern side.
    pub rows: [usize; 2],
    /// Whether nothing is rounded.
    pub exact: bool,
}

/// The greatest errors so far of the halves, and of the southern, eastern, northern and western quarter.
pub(super) type Errors = [f32; 5];

type Lanes = [f32; LANES];

/// How far the samples `line` are from a plane that is at `base` where x = 0; the first of them is at x = `first`.
#[inline(always)]
fn farthest(greatest: &mut Lanes, base: f32, slope: f32, first: f32, line: &[f32]) {
    let mut most = *greatest;
    let mut chunk = |x: f32, heights: &[f32; LANES]| {
        for lane in 0..LANES {
            let error = (slope.mul_add(x + lane as f32, base) - heights[lane]).abs();
            most[lane] = if error > most[lane] { error } else { most[lane] };
        }
    };
    let (chunks, rest) = line.as_chunks::<LANES>();
    for (k, heights) in chunks.iter().enumerate() {
        chunk(first + (k * LANES) as f32, heights);
    }
    if !rest.is_empty() {
        // The last sixteen once more; of fewer, the first one as often as there is room.
        match line.last_chunk::<LANES>() {
            Some(heights) => chunk(first + (line.len() - LANES) as f32, heights),
            None => {
                let mut most = 0f32;
                for (k, height) in rest.iter().enumerate() {
                    most = most.max((slope.mul_add(first + k as f32, base) - height).abs());
                }
                greatest[0] = greatest[0].max(most);
                return;
            }
        }
    }
    *greatest = most;
}

/// Measures a piece of a square.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn measure(heights: &[f32], columns: usize, piece: &Piece) -> Errors {
    let (s, half) = (piece.side, piece.side / 2);
    let (share, toward) = (1.0 / s as f32, 1.0 / half as f32);
    let sample = |x: usize, y: usize| heights[piece.corner + y * columns + x];
    let (a, b, c, d, m) = (sample(0, 0), sample(s, 0), sample(0, s), sample(s, s), sample(half, half));
    let (south, north, west, east) = ((b - a) * share, (d - c) * share, (c - a) * share, (d - b) * share);
    let rise = |p: f32, q: f32| (m - (0.5 * p + 0.5 * q)) * toward;
    let (from_south, from_north, from_west, from_east) = (rise(a, b), rise(c, d), rise(a, c), rise(b, d));
    let mut found = [[0f32; LANES]; 5];
    for y in piece.rows[0]..=piece.rows[1] {
        let line = &heights[piece.corner + y * columns..][..s + 1];
        let (up, down) = (y as f32, (s - y) as f32);
        if y > 0 && y < s {
            if piece.rises {
                farthest(&mut found[0], west.mul_add(up, a), north, 1.0, &line[1..y]);
                farthest(&mut found[0], east.mul_add(up, a), south, y as f32, &line[y..s]);
            } else {
                farthest(&mut found[0], west.mul_add(up, a), south, 1.0, &line[1..s + 1 - y]);
                farthest(&mut found[0], east.mul_add(-down, c), north, (s + 1 - y) as f32, &line[s + 1 - y..s]);
            }
        }
        let depth = y.min(s - y);
        if y < half {
            let base = from_south.mul_add(up, a);
            farthest(&mut found[1], base, south, (depth + 1) as f32, &line[depth + 1..s - depth]);
        }
        if y > half {
            let base = from_north.mul_add(down, c);
            farthest(&mut found[3], base, north, (depth + 1) as f32, &line[depth + 1..s - depth]);
        }
        if depth > 0 {
            farthest(&mut found[4], west.mul_add(up, a), from_west, 0.0, &line[..depth]);
            let base = east.mul_add(up, b);
            farthest(&mut found[2], base, -from_east, 1.0 - depth as f32, &line[s + 1 - depth..]);
        }
    }
    let highest = [a, b, c, d, m].into_iter().fold(0f32, |most, height| most.max(height.abs()));
    let flat = [b, c, d, m].iter().all(|height| *height == a);
    let doubt = if flat { 0.0 } else { highest.max(1e-30) * 34.0 * (OF_HEIGHT / 34.0) };
    found.map(|lanes| {
        let error = lanes.into_iter().fold(0.0, f32::max);
        if piece.exact { error } else { error.mul_add(1.0 + OF_ERROR, doubt) }
    })
}
