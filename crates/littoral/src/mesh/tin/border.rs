//! The border of a tile by itself.

use crate::field::Raster;
use crate::mesh::measure::patch_exists;

/// The vertices on the border of a tile of `size` samples, counted from its south-western one, which lies at `first` in a raster
/// that shows the neighbours' samples too, where there are any. A neighbour finds the same ones on the line that is shared.
pub(crate) fn border(outer: &Raster, first: [usize; 2], size: [usize; 2], max_error: f32) -> Vec<[u32; 2]> {
    let last = size.map(|samples| samples - 1);
    let mut vertices = Vec::new();
    for (along, across) in [(0, 0), (0, last[1]), (1, 0), (1, last[0])] {
        let at = |step: usize| if along == 0 { [step, across] } else { [across, step] };
        let sample = |step: usize| {
            let [x, y] = at(step);
            outer.sample(first[0] + x, first[1] + y)
        };
        // Whether the patches on either side of a piece of the line exist.
        let sides = |step: usize| {
            let [x, y] = at(step);
            let [x, y] = [(first[0] + x) as i64, (first[1] + y) as i64];
            let other = if along == 0 { patch_exists(outer, x, y - 1) } else { patch_exists(outer, x - 1, y) };
            [patch_exists(outer, x, y), other]
        };
        let line: Vec<f32> = (0..=last[along]).map(|step| sample(step).unwrap_or(0.0)).collect();
        let mut begin = 0;
        for step in 1..=last[along] {
            if step == last[along] || sides(step) != sides(step - 1) {
                vertices.extend([begin, step].map(at));
                if sides(begin).contains(&true) {
                    simplify(&line, begin, step, max_error, &mut |step| vertices.push(at(step)));
                }
                begin = step;
            }
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    vertices.into_iter().map(|at| at.map(|at| at as u32)).collect()
}

/// Names the samples between two that a line needs so that none is farther from it than `max_error` (m): the farthest, and
/// again on both sides of it (D. Douglas, T. Peucker, "Algorithms for the reduction of the number of points", 1973).
fn simplify(line: &[f32], begin: usize, end: usize, max_error: f32, keep: &mut dyn FnMut(usize)) {
    let mut pieces = vec![[begin, end]];
    while let Some([begin, end]) = pieces.pop() {
        let (from, to, length) = (f64::from(line[begin]), f64::from(line[end]), (end - begin) as f64);
        let (mut worst, mut at) = (0.0, begin);
        for (step, height) in line[begin..=end].iter().enumerate() {
            let step = step as f64;
            let error = ((from * (length - step) + to * step - f64::from(*height) * length) / length).abs();
            if error > worst {
                (worst, at) = (error, begin + step as usize);
            }
        }
        // A little less than may be, so that a triangle at the border, computed in another way, keeps to it too.
        let rounding = worst * 1e-12 + 8.0 * f64::EPSILON * from.abs().max(to.abs());
        if worst > 0.0 && worst + rounding > f64::from(max_error) && at > begin && at < end {
            keep(at);
            pieces.extend([[begin, at], [at, end]]);
        }
    }
}
