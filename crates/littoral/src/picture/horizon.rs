//! How high the horizon stands toward the sun, for every sample: a map of shadows that holds for any elevation of the sun.
//!
//! Lines run through the raster away from the sun, one sample apart. Along a line only points of the upper convex hull of what lies towards the sun can be
//! a horizon, and a point that one step hides is never seen again from farther on: each is put on a stack and taken off once. So the cost is that of
//! reading the raster, however long the shadows.
//!
//! Works this rests on: N. Max, "Horizon mapping: shadows for bump-mapped surfaces", The Visual Computer 4, 1988; W. Timonen and
//! J. Westerholm, "Scalable height field self-shadowing", Computer Graphics Forum 29(2), 2010 (the hull along lines).

use glam::{DVec2, Vec2};
use rayon::prelude::*;

/// The tangent where nothing lies ahead.
const NOTHING: f32 = -1.0;

/// Tangent of the elevation of the horizon above each sample of a raster (row by row from the south), seen along `toward`, a horizontal unit direction.
/// Where only the raster's end lies ahead it is −1.
pub fn horizon(heights: &[f32], columns: usize, rows: usize, spacing: DVec2, toward: Vec2) -> Vec<f32> {
    let step = toward.as_dvec2() / spacing;
    // Lines advance by one sample along the longer axis.
    let by_columns = step.x.abs() >= step.y.abs();
    let (length, width) = if by_columns { (columns, rows) } else { (rows, columns) };
    let (major, minor) = if by_columns { (step.x, step.y) } else { (step.y, step.x) };
    let slant = minor / major;
    let apart = (1.0 / major.abs()) as f32;
    let height = |along: usize, across: f64| {
        let across = across.clamp(0.0, (width - 1) as f64);
        let a = (across as usize).min(width - 2);
        let f = (across - a as f64) as f32;
        let at = |a: usize| if by_columns { heights[a * columns + along] } else { heights[along * columns + a] };
        at(a) + (at(a + 1) - at(a)) * f
    };
    // The line of number 0 passes through `first` at the raster's beginning.
    let drift = slant * (length - 1) as f64;
    let first = (-drift.max(0.0)).floor();
    let lines = (width as f64 - drift.min(0.0) - first).ceil() as usize + 1;
    let mut slanted = vec![NOTHING; lines * length];
    slanted.par_chunks_exact_mut(length).enumerate().for_each_init(
        Vec::new,
        |hull: &mut Vec<(f32, f32)>, (line, out)| {
            hull.clear();
            for k in 0..length {
                let along = if major > 0.0 { length - 1 - k } else { k };
                let across = first + line as f64 + slant * along as f64;
                if !(across > -1.0 && across < width as f64) {
                    continue;
                }
                let (s, h) = (k as f32 * apart, height(along, across));
                let rise = |&(at, top): &(f32, f32)| (top - h) / (s - at);
                while let [.., second, last] = &hull[..]
                    && rise(second) >= rise(last)
                {
                    hull.pop();
                }
                if let Some(last) = hull.last() {
                    out[along] = rise(last).max(NOTHING);
                }
                hull.push((s, h));
            }
        },
    );
    let mut found = vec![NOTHING; columns * rows];
    found.par_chunks_exact_mut(columns).enumerate().for_each(|(row, out)| {
        for (column, out) in out.iter_mut().enumerate() {
            let (along, across) = if by_columns { (column, row) } else { (row, column) };
            let line = across as f64 - slant * along as f64 - first;
            let a = (line as usize).min(lines - 2);
            let f = (line - a as f64) as f32;
            let (here, next) = (slanted[a * length + along], slanted[(a + 1) * length + along]);
            *out = here + (next - here) * f;
        }
    });
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By brute force: every step along the line of a sample.
    fn marched(heights: &[f32], columns: usize, rows: usize, spacing: DVec2, toward: Vec2, at: (usize, usize)) -> f32 {
        let step = toward.as_dvec2() / spacing;
        let stride = 1.0 / step.abs().max_element();
        let place = DVec2::new(at.0 as f64, at.1 as f64);
        let last = DVec2::new((columns - 1) as f64, (rows - 1) as f64);
        let here = heights[at.1 * columns + at.0];
        let mut best = NOTHING;
        for k in 1.. {
            let p = place + step * (stride * f64::from(k));
            if !(p.cmpge(DVec2::splat(-1e-9)).all() && p.cmple(last + 1e-9).all()) {
                return best;
            }
            let base = p.clamp(DVec2::ZERO, last).floor().min(last - 1.0);
            let f = (p - base).as_vec2();
            let (i, j) = (base.x as usize, base.y as usize);
            let h = |i: usize, j: usize| heights[j * columns + i];
            let south = h(i, j) + (h(i + 1, j) - h(i, j)) * f.x;
            let north = h(i, j + 1) + (h(i + 1, j + 1) - h(i, j + 1)) * f.x;
            best = best.max((south + (north - south) * f.y - here) / (stride * f64::from(k)) as f32);
        }
        best
    }

    #[test]
    fn along_rows_and_columns_it_is_that_of_every_step() {
        let (columns, rows, spacing) = (37, 23, DVec2::new(10.0, 7.0));
        let heights: Vec<f32> = (0..columns * rows).map(|i| ((i * 7919) % 613) as f32 * 0.1).collect();
        for toward in [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y] {
            let found = horizon(&heights, columns, rows, spacing, toward);
            for (i, found) in found.iter().enumerate() {
                let expected = marched(&heights, columns, rows, spacing, toward, (i % columns, i / columns));
                assert!((found - expected).abs() < 1e-4, "{found} for {expected} at {i} toward {toward}");
            }
        }
    }

    #[test]
    fn a_ridge_hides_the_sun_as_far_as_its_height_says_from_any_side() {
        // A cone in a plain: beyond its foot its top is the horizon, straight away from the sun.
        let (side, spacing) = (201, DVec2::new(10.0, 12.0));
        let centre = DVec2::splat(100.0) * spacing;
        let height = |p: DVec2| (100.0 - 0.8 * p.distance(centre)).max(0.0) as f32;
        let place = |i: usize| DVec2::new((i % side) as f64, (i / side) as f64) * spacing;
        let heights: Vec<f32> = (0..side * side).map(|i| height(place(i))).collect();
        for turn in 0..24 {
            let toward = Vec2::from_angle(turn as f32 * 0.2618 + 0.1);
            let found = horizon(&heights, side, side, spacing, toward);
            let at = centre - toward.as_dvec2() * 400.0;
            let lattice = (at / spacing).round();
            let there = lattice * spacing;
            let expected = marched(&heights, side, side, spacing, toward, (lattice.x as usize, lattice.y as usize));
            let got = found[lattice.y as usize * side + lattice.x as usize];
            assert!((got - expected).abs() < 0.012, "{got} for {expected} toward {toward}");
            assert!((0.19..0.30).contains(&got), "{got} at {there}");
            // On the sunny side the plain ends level.
            let sunny = ((centre + toward.as_dvec2() * 400.0) / spacing).round();
            let got = found[sunny.y as usize * side + sunny.x as usize];
            assert!(got <= 1e-6, "{got} on the sunny side");
        }
    }
}
