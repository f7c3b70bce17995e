//! The sample of a triangle that is farthest from its plane.

use crate::mesh::measure::{Plane, spans};
use multiversion::multiversion;

const LANES: usize = 8;

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
        let (found, doubt) = quick(self.heights, self.columns, corners);
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

/// The candidate in single precision, and a bound of what rounding may have changed of its error.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn quick(heights: &[f32], columns: usize, corners: [[u32; 2]; 3]) -> (Candidate, f32) {
    let height = |at: [u32; 2]| heights[at[1] as usize * columns + at[0] as usize];
    let [a, b, c] = corners;
    let from_a = |at: [u32; 2]| [0, 1].map(|axis| f64::from(at[axis]) - f64::from(a[axis]));
    let ([bx, by], [cx, cy]) = (from_a(b), from_a(c));
    let base = f64::from(height(a));
    let (rise_b, rise_c) = (f64::from(height(b)) - base, f64::from(height(c)) - base);
    let inverse = 1.0 / (bx * cy - by * cx);
    let (east, north) = ((rise_b * cy - rise_c * by) * inverse, (rise_c * bx - rise_b * cx) * inverse);
    let slope = east as f32;
    let mut steps = [0f32; LANES];
    for (lane, step) in steps.iter_mut().enumerate() {
        *step = lane as f32;
    }
    let mut best = [-1f32; LANES];
    let (mut best_column, mut best_row) = ([0u32; LANES], [0u32; LANES]);
    spans(corners, |row, first, last| {
        let start = row as usize * columns;
        let west = base + (f64::from(row) - f64::from(a[1])) * north + (f64::from(first) - f64::from(a[0])) * east;
        let mut column = first;
        while column <= last {
            let from = start + column as usize;
            let mut lanes = [0f32; LANES];
            match heights.get(from..from + LANES) {
                Some(all) => lanes.copy_from_slice(all),
                None => lanes[..heights.len() - from].copy_from_slice(&heights[from..]),
            }
            // From the start of each chunk, so that numbers stay small enough to be exact.
            let (here, count) = ((west + f64::from(column - first) * east) as f32, last - column + 1);
            for lane in 0..LANES {
                let error = (here + slope * steps[lane] - lanes[lane]).abs();
                let better = error > best[lane] && (lane as u32) < count;
                best[lane] = if better { error } else { best[lane] };
                best_column[lane] = if better { column } else { best_column[lane] };
                best_row[lane] = if better { row } else { best_row[lane] };
            }
            column += LANES as u32;
        }
    });
    let mut found = Candidate { at: a, error: -1.0 };
    for lane in 0..LANES {
        let at = [best_column[lane] + lane as u32, best_row[lane]];
        if best[lane] > found.error || (best[lane] == found.error && [at[1], at[0]] < [found.at[1], found.at[0]]) {
            found = Candidate { at, error: best[lane] };
        }
    }
    let highest = corners.into_iter().map(|at| height(at).abs()).fold(0.0, f32::max);
    // Where numbers overflow, nothing is known.
    if found.error < 0.0 || highest > 1e37 || found.error > 1e37 {
        return (Candidate { error: 0.0, ..found }, f32::INFINITY);
    }
    // Six roundings of numbers not above twice the corners', and one of the difference; a slender triangle's plane is steep.
    let slender = (bx.abs() + cx.abs()) * (by.abs() + cy.abs()) * inverse * 16.0 * f64::EPSILON;
    let relative = (f32::EPSILON * 4.0 + slender as f32) * highest + f32::EPSILON * 2.0 * found.error;
    let doubt = relative + f32::MIN_POSITIVE;
    (found, doubt)
}
