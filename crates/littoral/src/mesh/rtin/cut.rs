//! Triangles of the virtual square, cut at the raster's border.

use super::Corners;

/// What is left of a triangle inside the raster, counter-clockwise: up to five corners.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    pub corners: [[u32; 2]; 6],
    pub count: usize,
}

impl Cut {
    pub fn new(corners: Corners, last: [u32; 2]) -> Cut {
        let mut cut = Cut { corners: [[0; 2]; 6], count: 3 };
        cut.corners[..3].copy_from_slice(&corners);
        for axis in 0..2 {
            if cut.corners[..cut.count].iter().any(|at| at[axis] > last[axis]) {
                cut = cut.clip(axis, last[axis]);
            }
        }
        // The fan must not depend on which corner of the triangle was named first.
        let first = (0..cut.count).min_by_key(|k| cut.corners[*k]).unwrap_or(0);
        cut.corners[..cut.count].rotate_left(first);
        cut
    }

    fn clip(&self, axis: usize, last: u32) -> Cut {
        let mut cut = Cut { corners: [[0; 2]; 6], count: 0 };
        for (k, &from) in self.corners[..self.count].iter().enumerate() {
            let to = self.corners[(k + 1) % self.count];
            if from[axis] <= last {
                cut.push(from);
            }
            if (from[axis] <= last) != (to[axis] <= last) {
                // Edges are parallel to the axes or diagonal: a step along one is none or one along the other.
                let other = 1 - axis;
                let steps = i64::from(last) - i64::from(from[axis]);
                let run = i64::from(to[axis]) - i64::from(from[axis]);
                let along = i64::from(to[other]) - i64::from(from[other]);
                let mut at = from;
                at[axis] = last;
                at[other] = (i64::from(from[other]) + along.signum() * steps.abs() * i64::from(run != 0)) as u32;
                cut.push(at);
            }
        }
        while cut.count > 1 && cut.corners[0] == cut.corners[cut.count - 1] {
            cut.count -= 1;
        }
        cut
    }

    fn push(&mut self, at: [u32; 2]) {
        if self.count == 0 || self.corners[self.count - 1] != at {
            self.corners[self.count] = at;
            self.count += 1;
        }
    }

    /// A fan of triangles.
    pub fn triangles(&self) -> impl Iterator<Item = Corners> + '_ {
        (2..self.count).map(|k| [self.corners[0], self.corners[k - 1], self.corners[k]])
    }
}
