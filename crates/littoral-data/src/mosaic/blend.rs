//! Overlapping files made one: within a group of like spacing by weights, between groups by a margin.

use super::tile::Patch;
use littoral::field::Window;
use rayon::prelude::*;

/// A part of the lattice on which patches are laid.
pub(super) struct Blend {
    window: Window,
    /// Width of the margin (samples).
    margin: usize,
    /// What has been laid so far (m), NaN where nothing.
    heights: Vec<f32>,
    /// The group being laid: any one of its heights, the weighted sum of differences from it, and the sum of weights.
    /// Differences rather than heights, so that equal heights give that height to the bit.
    base: Vec<f32>,
    sums: Vec<[f64; 2]>,
}

impl Blend {
    pub(super) fn new(window: Window, margin: usize) -> Blend {
        let samples = window.columns * window.rows;
        let nothing = || vec![f32::NAN; samples];
        Blend { window, margin, heights: nothing(), base: nothing(), sums: vec![[0.0; 2]; samples] }
    }

    /// Adds a file to the group.
    pub(super) fn add(&mut self, patch: &Patch) {
        let fade = fade(&patch.heights, patch.window.columns, self.margin);
        let Window { column, row, columns, rows } = patch.window;
        let (all, left, top) = (self.window.columns, column - self.window.column, row - self.window.row);
        let lines = self.base.par_chunks_exact_mut(all).zip(self.sums.par_chunks_exact_mut(all));
        lines.skip(top).take(rows).enumerate().for_each(|(r, (bases, sums))| {
            let own = &patch.heights[r * columns..(r + 1) * columns];
            for (c, &height) in own.iter().enumerate().filter(|(_, height)| !height.is_nan()) {
                let fade = fade.as_ref().map_or(1.0, |fade| f64::from(fade[r * columns + c]));
                let weight = fade * patch.weight(column + c, row + r);
                let (base, [sum, weights]) = (&mut bases[left + c], &mut sums[left + c]);
                if base.is_nan() {
                    *base = height;
                }
                *sum += weight * (f64::from(height) - f64::from(*base));
                *weights += weight;
            }
        });
    }

    /// Lays the group over what has been laid before, and begins the next one.
    pub(super) fn lay_over(&mut self) {
        for (base, [sum, weights]) in self.base.iter_mut().zip(&mut self.sums) {
            if *weights > 0.0 {
                *base = (f64::from(*base) + *sum / *weights) as f32;
            }
            [*sum, *weights] = [0.0; 2];
        }
        let both = self.heights.iter().zip(&self.base).any(|(below, above)| !below.is_nan() && !above.is_nan());
        let fade = if both { fade(&self.base, self.window.columns, self.margin) } else { None };
        for (at, (height, above)) in self.heights.iter_mut().zip(&mut self.base).enumerate() {
            if !above.is_nan() {
                let share = fade.as_ref().map_or(1.0, |fade| fade[at]);
                *height = if height.is_nan() || share == 1.0 { *above } else { *height + share * (*above - *height) };
            }
            *above = f32::NAN;
        }
    }

    /// The heights of a window within.
    pub(super) fn cut(&self, window: Window, heights: &mut [f32]) {
        for (r, line) in heights.chunks_exact_mut(window.columns).enumerate() {
            let from = (window.row + r - self.window.row) * self.window.columns + window.column - self.window.column;
            line.copy_from_slice(&self.heights[from..from + window.columns]);
        }
    }
}

/// For each sample its distance to the nearest void, as a share of `margin`, above 0 beside it and at most 1; `None` if there
/// is no void. Distances run straight and across (1 and √2), which is right to 8 %.
fn fade(heights: &[f32], columns: usize, margin: usize) -> Option<Vec<f32>> {
    if !heights.iter().any(|height| height.is_nan()) {
        return None;
    }
    let far = margin as f32 + 0.5;
    let mut distance: Vec<f32> = heights.iter().map(|height| if height.is_nan() { 0.0 } else { far }).collect();
    let rows = heights.len() / columns;
    const ACROSS: f32 = std::f32::consts::SQRT_2;
    for row in 0..rows {
        for column in 0..columns {
            let at = row * columns + column;
            let mut least = distance[at];
            if column > 0 {
                least = least.min(distance[at - 1] + 1.0);
            }
            if row > 0 {
                let above = at - columns;
                least = least.min(distance[above] + 1.0);
                least = if column > 0 { least.min(distance[above - 1] + ACROSS) } else { least };
                least = if column + 1 < columns { least.min(distance[above + 1] + ACROSS) } else { least };
            }
            distance[at] = least;
        }
    }
    for row in (0..rows).rev() {
        for column in (0..columns).rev() {
            let at = row * columns + column;
            let mut least = distance[at];
            if column + 1 < columns {
                least = least.min(distance[at + 1] + 1.0);
            }
            if row + 1 < rows {
                let below = at + columns;
                least = least.min(distance[below] + 1.0);
                least = if column > 0 { least.min(distance[below - 1] + ACROSS) } else { least };
                least = if column + 1 < columns { least.min(distance[below + 1] + ACROSS) } else { least };
            }
            distance[at] = least;
        }
    }
    // Half a sample off: the border between a void and a height lies between the two.
    distance.iter_mut().for_each(|d| *d = ((*d - 0.5) / margin as f32).clamp(0.0, 1.0));
    Some(distance)
}
