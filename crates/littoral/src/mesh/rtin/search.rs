//! The deviation of a large triangle, found from what is known of the triangles in it.
//!
//! A triangle's plane differs from that of a triangle in it linearly, so most at a corner; and the surface differs from the
//! latter by its deviation at most. What cannot hold a greater error than the greatest found so far is left out; of the rest
//! both halves are looked at. What is found is the error at a sample, without any bound's slack, after a few dozen
//! samples instead of all (branch and bound: A. Land and A. Doig, 1960).

use super::Rtin;

/// A corner: column, row, and the height of the large triangle's plane there.
type Corner = ([u32; 2], f64);

/// A triangle with its hypotenuse from the first to the second corner, and the greatest error at its corners.
#[derive(Clone, Copy)]
struct Node {
    corners: [Corner; 3],
    error: f64,
}

/// The greatest vertical distance (m) at a sample from a triangle of the raster's surface, nothing of it void; its corners at
/// the hypotenuse come first. `stack` is scratch.
pub(super) fn deviation(rtin: &Rtin, heights: &[f32], corners: [[u32; 2]; 3], stack: &mut Stack) -> f64 {
    let columns = rtin.size[0];
    let height = |at: [u32; 2]| f64::from(heights[at[1] as usize * columns + at[0] as usize]);
    let mut greatest = 0f64;
    stack.0.clear();
    stack.0.push(Node { corners: corners.map(|at| (at, height(at))), error: 0.0 });
    while let Some(Node { corners: [p, q, r], error }) = stack.0.pop() {
        let (low, high) = ([0, 1].map(|i| p.0[i].min(q.0[i])), [0, 1].map(|i| p.0[i].max(q.0[i])));
        let extent = [high[0] - low[0], high[1] - low[1]];
        let side = extent[0].max(extent[1]);
        let level = &rtin.levels[side.trailing_zeros() as usize - 1];
        let (x, y) = (low[0] as usize >> side.trailing_zeros(), low[1] as usize >> side.trailing_zeros());
        let place = match extent {
            [_, 0] => level.flat(x, y),
            [0, _] => level.upright(x, y),
            _ => level.centre(x, y),
        };
        if error + f64::from(rtin.deviations[place]) <= greatest {
            continue;
        }
        let middle = [u32::midpoint(low[0], high[0]), u32::midpoint(low[1], high[1])];
        let plane = 0.5 * (p.1 + q.1);
        let here = (plane - height(middle)).abs();
        greatest = greatest.max(here);
        // Halves of a triangle over two patches have no samples but their corners.
        if side > 2 || (extent[0] > 0 && extent[1] > 0) {
            let at = |corner: Corner| (corner.1 - height(corner.0)).abs();
            let (at_p, at_q, both) = (at(p), at(q), at(r).max(here));
            let first = Node { corners: [p, r, (middle, plane)], error: at_p.max(both) };
            let second = Node { corners: [r, q, (middle, plane)], error: at_q.max(both) };
            // The likelier one last, to be looked at first.
            stack.0.extend(if at_p > at_q { [second, first] } else { [first, second] });
        }
    }
    greatest
}

/// Triangles still to be looked at.
#[derive(Default)]
pub(super) struct Stack(Vec<Node>);
