//! The deviation of a large triangle, found from what is known of the triangles in it.
//!
//! A triangle's plane differs from that of a triangle in it linearly, so most at a corner; and the surface differs from the
//! latter by its deviation at most. What cannot hold a greater error than the greatest found so far is left out; of the rest
//! both halves are looked at. What is found is the error at a sample, without any bound's slack, after a few dozen
//! samples instead of all (branch and bound: A. Land and A. Doig, 1960).

use super::Rtin;

/// A corner: column, row, the height of the large triangle's plane there, and how far the sample is from it.
#[derive(Clone, Copy)]
struct Corner {
    at: [u32; 2],
    plane: f64,
    error: f64,
}

/// The greatest vertical distance (m) at a sample from a triangle of the raster's surface, nothing of it void; its corners at
/// the hypotenuse come first. What is not above `floor` (m) is not looked for: then the answer is `floor`. `stack` is scratch.
pub(super) fn deviation(rtin: &Rtin, heights: &[f32], corners: [[u32; 2]; 3], floor: f64, stack: &mut Stack) -> f64 {
    let columns = rtin.size[0];
    let height = |at: [u32; 2]| f64::from(heights[at[1] as usize * columns + at[0] as usize]);
    let own = (0..2).map(|i| corners[0][i].abs_diff(corners[1][i])).fold(0, u32::max);
    let mut greatest = floor;
    stack.0.clear();
    stack.0.push(corners.map(|at| Corner { at, plane: height(at), error: 0.0 }));
    while let Some([p, q, r]) = stack.0.pop() {
        let (low, high) = ([0, 1].map(|i| p.at[i].min(q.at[i])), [0, 1].map(|i| p.at[i].max(q.at[i])));
        let extent = [high[0] - low[0], high[1] - low[1]];
        let side = extent[0].max(extent[1]);
        // Of squares of the size in question nothing is known yet.
        if side < own {
            let size = side.trailing_zeros();
            let level = &rtin.levels[size as usize - 1];
            let (x, y) = (low[0] as usize >> size, low[1] as usize >> size);
            let place = match extent {
                [_, 0] => level.flat(x, y),
                [0, _] => level.upright(x, y),
                _ => level.centre(x, y),
            };
            if p.error.max(q.error).max(r.error) + f64::from(rtin.deviations[place]) <= greatest {
                continue;
            }
        }
        let at = [u32::midpoint(low[0], high[0]), u32::midpoint(low[1], high[1])];
        let plane = 0.5 * (p.plane + q.plane);
        let middle = Corner { at, plane, error: (plane - height(at)).abs() };
        greatest = greatest.max(middle.error);
        // Halves of a triangle over two patches have no samples but their corners.
        if side > 2 || (extent[0] > 0 && extent[1] > 0) {
            let (first, second) = ([p, r, middle], [r, q, middle]);
            // The likelier one last, to be looked at first.
            stack.0.extend(if p.error > q.error { [second, first] } else { [first, second] });
        }
    }
    greatest
}

/// Triangles still to be looked at.
#[derive(Default)]
pub(super) struct Stack(Vec<[Corner; 3]>);
