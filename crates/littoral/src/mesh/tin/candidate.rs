//! The sample of a triangle that is farthest from its plane.

use super::tiles::{TILE, Tiles};
use crate::mesh::measure::{Plane, Spans, spans};
use multiversion::multiversion;

const LANES: usize = 8;

/// Twice the samples of a triangle that is searched by tiles.
const LARGE: f64 = 4096.0;

/// The sample farthest from a triangle, and how far it is (m), never less than the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub at: [u32; 2],
    pub error: f32,
}

/// A raster's numbers, and what is asked for.
#[derive(Clone, Copy)]
pub(super) struct Ground<'a> {
    pub heights: &'a [f32],
    pub columns: usize,
    pub tiles: &'a Tiles,
    /// The error asked for (m).
    pub max_error: f32,
    /// Last column and row, where the border must stay as it is.
    pub kept_border: Option<[u32; 2]>,
}

impl Ground<'_> {
    fn on_kept_border(&self, at: [u32; 2]) -> bool {
        self.kept_border.is_some_and(|last| (0..2).any(|axis| at[axis] == 0 || at[axis] == last[axis]))
    }

    /// The candidate of a triangle. An error of 0 means that there is none.
    pub fn candidate(&self, corners: [[u32; 2]; 3]) -> Candidate {
        let (found, doubt) = quick(self, corners);
        if found.error + doubt <= self.max_error {
            return Candidate { error: found.error + doubt, ..found };
        }
        // Where rounding could decide, or make a corner look like a candidate, every digit counts.
        let doubtful = found.error <= self.max_error.max(doubt) + doubt || self.on_kept_border(found.at);
        if doubtful { self.exact(corners) } else { found }
    }

    /// The same in double precision, exact where the heights allow it.
    fn exact(&self, corners: [[u32; 2]; 3]) -> Candidate {
        let plane = Plane::new(self.heights, self.columns, corners);
        let (mut worst, mut at) = (0.0, corners[0]);
        spans(corners, |row, first, last| {
            for column in first..=last {
                let here = [column, row];
                if corners.contains(&here) || self.on_kept_border(here) {
                    continue;
                }
                let height = self.heights[row as usize * self.columns + column as usize];
                let error = plane.error(f64::from(column), f64::from(row), height);
                if error > worst {
                    (worst, at) = (error, here);
                }
            }
        });
        let nearest = worst as f32;
        Candidate { at, error: if f64::from(nearest) < worst { nearest.next_up() } else { nearest } }
    }
}

/// What keeps lanes out: the last of these numbers but so many.
const KEPT: [f32; 2 * LANES] = {
    let mut kept = [-1.0; 2 * LANES];
    let mut lane = 0;
    while lane < LANES {
        kept[lane] = f32::INFINITY;
        lane += 1;
    }
    kept
};

/// How far samples beside each other are from a plane that is at `here` where the first is; −1 for lanes that are kept out.
#[inline(always)]
fn errors(here: f32, slope: f32, heights: &[f32; LANES], kept: &[f32; LANES]) -> [f32; LANES] {
    let mut errors = [0.0; LANES];
    for lane in 0..LANES {
        let error = (here + slope * lane as f32 - heights[lane]).abs();
        errors[lane] = if error < kept[lane] { error } else { kept[lane] };
    }
    errors
}

/// Calls `look(errors, column)` for the samples of a row of a triangle, several at once, some of them twice.
#[inline(always)]
fn row_errors(line: &[f32], count: usize, west: f64, east: f64, mut look: impl FnMut(&[f32; LANES], usize)) {
    let slope = east as f32;
    let all = KEPT.first_chunk::<LANES>().unwrap_or(&[0.0; LANES]);
    if count >= LANES {
        // From the start of each chunk, so that numbers stay small enough to be exact.
        let (chunks, rest) = line[..count].as_chunks::<LANES>();
        for (k, heights) in chunks.iter().enumerate() {
            look(&errors((west + (k * LANES) as f64 * east) as f32, slope, heights, all), k * LANES);
        }
        if !rest.is_empty()
            && let Some(heights) = line[..count].last_chunk::<LANES>()
        {
            let first = count - LANES;
            look(&errors((west + first as f64 * east) as f32, slope, heights, all), first);
        }
    } else if let Some(kept) = KEPT[LANES - count..].first_chunk::<LANES>() {
        match line.first_chunk::<LANES>() {
            Some(heights) => look(&errors(west as f32, slope, heights, kept), 0),
            None => {
                // The end of the last row.
                let mut heights = [0.0; LANES];
                for (to, from) in heights.iter_mut().zip(line) {
                    *to = *from;
                }
                look(&errors(west as f32, slope, &heights, kept), 0);
            }
        }
    }
}

/// The candidate in single precision, and a bound of what rounding may have changed of its error.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn quick(ground: &Ground, corners: [[u32; 2]; 3]) -> (Candidate, f32) {
    let (heights, columns) = (ground.heights, ground.columns);
    let height = |at: [u32; 2]| heights[at[1] as usize * columns + at[0] as usize];
    let [a, b, c] = corners;
    let from_a = |at: [u32; 2]| [0, 1].map(|axis| f64::from(at[axis]) - f64::from(a[axis]));
    let ([bx, by], [cx, cy]) = (from_a(b), from_a(c));
    let base = f64::from(height(a));
    let (rise_b, rise_c) = (f64::from(height(b)) - base, f64::from(height(c)) - base);
    let inverse = 1.0 / (bx * cy - by * cx);
    let (east, north) = ((rise_b * cy - rise_c * by) * inverse, (rise_c * bx - rise_b * cx) * inverse);
    let west_of = |row: u32, first: u32| {
        base + (f64::from(row) - f64::from(a[1])) * north + (f64::from(first) - f64::from(a[0])) * east
    };
    let highest = corners.into_iter().map(|at| height(at).abs()).fold(0.0, f32::max);
    // Six roundings of numbers not above twice the corners', and one of the difference; a slender triangle's plane is steep.
    let slender = (bx.abs() + cx.abs()) * (by.abs() + cy.abs()) * inverse * 16.0 * f64::EPSILON;
    let doubt = (f32::EPSILON * 4.0 + slender as f32) * highest + f32::MIN_POSITIVE;
    let mut found = Candidate { at: a, error: -1.0 };
    let Some(spans) = Spans::new(corners) else { return (found, f32::INFINITY) };
    let area = (bx * cy - by * cx).abs();
    if area < LARGE {
        small(ground, &spans, west_of, east, &mut found);
    } else {
        large(ground, &spans, west_of, [east, north], doubt, &mut found);
    }
    // Where numbers overflow, nothing is known.
    if found.error < 0.0 || highest > 1e37 || found.error > 1e37 {
        return (Candidate { error: 0.0, ..found }, f32::INFINITY);
    }
    (found, doubt + f32::EPSILON * 2.0 * found.error)
}

/// Looks at all samples.
#[inline(always)]
fn small(ground: &Ground, spans: &Spans, west_of: impl Fn(u32, u32) -> f64, east: f64, found: &mut Candidate) {
    let mut best = [-1f32; LANES];
    for row in spans.rows[0]..=spans.rows[1] {
        let (first, last) = spans.row(row);
        if first <= last {
            let line = &ground.heights[row as usize * ground.columns + first as usize..];
            row_errors(line, (last - first + 1) as usize, west_of(row, first), east, |errors, _| {
                for lane in 0..LANES {
                    best[lane] = if errors[lane] > best[lane] { errors[lane] } else { best[lane] };
                }
            });
        }
    }
    for error in best {
        found.error = if error > found.error { error } else { found.error };
    }
    // Where it is does not matter if nothing comes of it.
    if found.error * 1.01 < ground.max_error {
        return;
    }
    for row in spans.rows[0]..=spans.rows[1] {
        let (first, last) = spans.row(row);
        if first <= last {
            let line = &ground.heights[row as usize * ground.columns + first as usize..];
            let mut at = u32::MAX;
            row_errors(line, (last - first + 1) as usize, west_of(row, first), east, |errors, column| {
                let mut hits = 0;
                for (lane, error) in errors.iter().enumerate() {
                    hits |= u32::from(*error == found.error) << lane;
                }
                if hits != 0 && at == u32::MAX {
                    at = first + column as u32 + hits.trailing_zeros();
                }
            });
            if at != u32::MAX {
                found.at = [at, row];
                return;
            }
        }
    }
}

/// Looks at those squares of samples only whose range leaves room for a greater error than found so far, first at the one
/// that leaves most.
#[inline(always)]
fn large(
    ground: &Ground,
    spans: &Spans,
    west_of: impl Fn(u32, u32) -> f64,
    [east, north]: [f64; 2],
    doubt: f32,
    found: &mut Candidate,
) {
    let tiles = ground.tiles;
    // Half the way that the plane rises across a square, and what rounding hides.
    let slack = ((east.abs() + north.abs()) * (0.5 * (TILE - 1) as f64)) as f32 * 1.001 + 4.0 * doubt;
    let middle = 0.5 * (TILE - 1) as f64;
    let (mut most, mut likeliest) = (-1f32, [0; 2]);
    let band = |y: usize| {
        let rows = [spans.rows[0].max((y * TILE) as u32), spans.rows[1].min((y * TILE + TILE - 1) as u32)];
        // Edges are straight: in a band they are farthest out at its first or last row, or where the short edges meet.
        let mut extent = [u32::MAX, 0];
        for row in rows[0]..=rows[1] {
            let (first, last) = spans.row(row);
            if first <= last {
                extent = [extent[0].min(first), extent[1].max(last)];
            }
        }
        (rows, extent)
    };
    // The greatest error that there could be in each of 16 squares beside each other.
    let room = |x: usize, y: usize, count: usize| {
        let mut room = [-1f32; 16];
        let first = y * tiles.columns + x;
        let (low, high) = (&tiles.low[first..first + count], &tiles.high[first..first + count]);
        let west = west_of((y * TILE) as u32, (x * TILE) as u32) + middle * (east + north);
        let (here, step) = (west as f32, (east * TILE as f64) as f32);
        for k in 0..count {
            let plane = here + step * k as f32;
            let (above, below) = (high[k] - plane, plane - low[k]);
            room[k] = if above > below { above } else { below } + slack;
        }
        room
    };
    let bands = spans.rows[0] as usize / TILE..=spans.rows[1] as usize / TILE;
    for y in bands.clone() {
        let (_, [first, last]) = band(y);
        if first > last {
            continue;
        }
        let (first, last) = (first as usize / TILE, last as usize / TILE);
        for x in (first..=last).step_by(16) {
            for (k, &room) in room(x, y, 16.min(last + 1 - x)).iter().enumerate() {
                if room > most {
                    (most, likeliest) = (room, [x + k, y]);
                }
            }
        }
    }
    look(ground, spans, &west_of, east, likeliest[0], band(likeliest[1]).0, found);
    for y in bands {
        let (rows, [first, last]) = band(y);
        if first > last {
            continue;
        }
        let (first, last) = (first as usize / TILE, last as usize / TILE);
        for x in (first..=last).step_by(16) {
            for (k, &room) in room(x, y, 16.min(last + 1 - x)).iter().enumerate() {
                if room > found.error && [x + k, y] != likeliest {
                    look(ground, spans, &west_of, east, x + k, rows, found);
                }
            }
        }
    }
}

/// Looks at the samples of a triangle in one square.
#[inline(always)]
fn look(
    ground: &Ground,
    spans: &Spans,
    west_of: &impl Fn(u32, u32) -> f64,
    east: f64,
    x: usize,
    rows: [u32; 2],
    found: &mut Candidate,
) {
    for row in rows[0]..=rows[1] {
        let (first, last) = spans.row(row);
        let (first, last) = (first.max((x * TILE) as u32), last.min((x * TILE + TILE - 1) as u32));
        if first > last {
            continue;
        }
        let line = &ground.heights[row as usize * ground.columns + first as usize..];
        row_errors(line, (last - first + 1) as usize, west_of(row, first), east, |errors, column| {
            for (lane, &error) in errors.iter().enumerate() {
                if error > found.error {
                    *found = Candidate { at: [first + (column + lane) as u32, row], error };
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Candidates of triangles of all sizes against every sample by its definition.
    #[test]
    fn no_sample_is_farther_than_the_candidate() {
        let columns = 400usize;
        let mut state = 88_172_645_463_325_252_u64;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let height = |i: usize| {
            let (x, y) = ((i % columns) as f32, (i / columns) as f32);
            300.0 * (x * 0.03).sin() * (y * 0.02).cos()
        };
        let heights: Vec<f32> = (0..columns * columns).map(|i| height(i) + 20.0 * random() as f32).collect();
        let tiles = Tiles::new(&heights, columns);
        for _ in 0..2000 {
            let size = 400.0 * random() * random();
            let mut corner = || [0, 0].map(|_: u32| ((random() * size) + 200.0 * size / 400.0).min(399.0) as u32);
            let corners = [corner(), corner(), corner()];
            let area = crate::mesh::measure::doubled_area(corners);
            if area == 0 {
                continue;
            }
            let corners = if area > 0 { corners } else { [corners[0], corners[2], corners[1]] };
            let ground = Ground { heights: &heights, columns, tiles: &tiles, max_error: 1.0, kept_border: None };
            let candidate = ground.candidate(corners);
            let plane = Plane::new(&heights, columns, corners);
            let mut worst = 0f64;
            let mut at_candidate = None;
            for (i, &height) in heights.iter().enumerate() {
                let (x, y) = ((i % columns) as u32, (i / columns) as u32);
                let edges = [[0, 1], [1, 2], [2, 0]].map(|[a, b]: [usize; 2]| [corners[a], corners[b], [x, y]]);
                if edges.iter().all(|edge| crate::mesh::measure::doubled_area(*edge) >= 0) {
                    let error = plane.error(f64::from(x), f64::from(y), height);
                    worst = worst.max(error);
                    if candidate.at == [x, y] {
                        at_candidate = Some(error);
                    }
                }
            }
            assert!((f64::from(candidate.error) - worst).abs() < 2e-3, "{corners:?}: {candidate:?}, {worst}");
            if worst > 1.01 {
                assert!(at_candidate.is_some_and(|error| (error - worst).abs() < 2e-3), "{corners:?}: {candidate:?}");
                assert!(!corners.contains(&candidate.at));
            }
        }
    }
}
