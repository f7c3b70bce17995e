//! Phases of a train of waves over a bed.
//!
//! The bed is turned so that waves come over its first row, and towards higher columns; of two sides that waves come over, the first row is the
//! deeper one, where they are still nearly plane.

use super::Depths;
use glam::DVec2;
use std::f64::consts::TAU;

/// A train's way over a bed.
pub(super) struct Course<'a> {
    bed: &'a Depths,
    /// Cycles per metre at each node.
    numbers: Vec<f64>,
    /// Cycles per metre in the deep.
    incoming: f64,
    heading: DVec2,
    /// Heading along the rows and columns of the turned bed, the first above 0, the second at least 0.
    along: f64,
    aside: f64,
    rows: usize,
    columns: usize,
    first: usize,
    row_step: isize,
    column_step: isize,
}

/// What came out.
pub(super) struct Phases {
    /// Cycles at each node, less those of the plane wave of the deep.
    pub cycles: Vec<f64>,
    /// Whether waves get there through water.
    pub reached: Vec<bool>,
}

impl<'a> Course<'a> {
    /// `heading` of length 1; wave numbers in rad/m.
    pub(super) fn new(bed: &'a Depths, heading: DVec2, incoming: f64, numbers: &[f64]) -> Course<'a> {
        let (columns, rows) = (bed.columns, bed.rows);
        // A hair off an axis counts as along it.
        let [x, y] = [heading.x, heading.y].map(|part| if part.abs() < 1e-9 { 0.0 } else { part });
        let (west, south) = (x < 0.0, y < 0.0);
        let first = if south { (rows - 1) * columns } else { 0 } + if west { columns - 1 } else { 0 };
        let east_step = if west { -1 } else { 1 };
        let north_step = if south { -(columns as isize) } else { columns as isize };
        let numbers = numbers.iter().map(|number| number / TAU).collect();
        let (x, y) = (x.abs(), y.abs());
        let course = Course {
            bed,
            numbers,
            incoming: incoming / TAU,
            heading,
            along: y,
            aside: x,
            rows,
            columns,
            first,
            row_step: north_step,
            column_step: east_step,
        };
        let side = |count: usize, step: isize| {
            let node = |i: usize| (first as isize + i as isize * step) as usize;
            (0..count).map(|i| bed.depth(node(i))).sum::<f64>() / count as f64
        };
        let (from_south, from_west) = (side(columns, east_step), side(rows, north_step));
        if y == 0.0 || x > 0.0 && (from_west > from_south || from_west == from_south && x > y) {
            let (row_step, column_step) = (east_step, north_step);
            Course { along: x, aside: y, rows: columns, columns: rows, row_step, column_step, ..course }
        } else {
            course
        }
    }

    fn node(&self, row: usize, column: usize) -> usize {
        (self.first as isize + row as isize * self.row_step + column as isize * self.column_step) as usize
    }

    fn wet(&self, node: usize) -> bool {
        self.bed.depth(node) > 0.0
    }

    /// Along straight rays: each node asks its ray where that came through the square before. Beyond the side, depths go on straight outward.
    pub(super) fn straight(&self) -> Phases {
        let mut cycles = vec![0.0; self.numbers.len()];
        let steep = self.along >= self.aside;
        for row in 1..self.rows {
            for column in 0..self.columns {
                let node = self.node(row, column);
                let corner = self.node(row - 1, column.saturating_sub(1));
                // The ray comes between the corner of the square and a neighbour, at a share of the way to the corner.
                let (near, share, stride) = if steep || column == 0 {
                    (self.node(row - 1, column), self.aside / self.along, 1.0 / self.along)
                } else {
                    (self.node(row, column - 1), self.along / self.aside, 1.0 / self.aside)
                };
                let share = if column == 0 { 0.0 } else { share };
                let between = |of: &[f64]| of[near] + (of[corner] - of[near]) * share;
                let mean = 0.5 * (self.numbers[node] + between(&self.numbers));
                cycles[node] = between(&cycles) + (mean - self.incoming) * stride * self.bed.spacing;
            }
        }
        Phases { cycles, reached: (0..self.numbers.len()).map(|node| self.wet(node)).collect() }
    }

    /// Along the true paths, through water; and where none leads, on over land.
    pub(super) fn refracted(&self) -> Phases {
        let mut cycles = vec![f64::INFINITY; self.numbers.len()];
        let mut fixed = vec![false; cycles.len()];
        for column in 0..self.columns {
            let node = self.node(0, column);
            if self.wet(node) {
                cycles[node] = self.plane(node);
                fixed[node] = true;
            }
        }
        // Along the other side from which they come the bed goes on straight outward: there the wave number outward is kept (Snell).
        let kept = self.incoming * self.aside;
        let mut row = 1;
        while self.aside > 0.0 && row < self.rows && fixed[self.node(0, 0)] && self.wet(self.node(row, 0)) {
            let (before, node) = (self.node(row - 1, 0), self.node(row, 0));
            let mean = 0.5 * (self.numbers[before] + self.numbers[node]);
            cycles[node] = cycles[before] + (mean * mean - kept * kept).max(0.0).sqrt() * self.bed.spacing;
            fixed[node] = true;
            row += 1;
        }
        self.sweep(&mut cycles, |node| !fixed[node] && self.wet(node));
        let reached: Vec<bool> = cycles.iter().map(|cycles| cycles.is_finite()).collect();
        if reached.contains(&true) {
            self.sweep(&mut cycles, |node| !reached[node]);
        }
        for (node, cycles) in cycles.iter_mut().enumerate() {
            *cycles -= self.plane(node);
        }
        Phases { cycles, reached }
    }

    /// Phase (cycles) of the plane wave of the deep at a node.
    fn plane(&self, node: usize) -> f64 {
        let place = DVec2::new((node % self.bed.columns) as f64, (node / self.bed.columns) as f64);
        self.incoming * self.bed.spacing * self.heading.dot(place)
    }

    /// Lowers phases of `free` nodes to the first-order upwind solution of |∇θ| = k, sweeping in all four ways until nothing changes.
    fn sweep(&self, cycles: &mut [f64], free: impl Fn(usize) -> bool) {
        let (columns, rows, h) = (self.bed.columns, self.bed.rows, self.bed.spacing);
        let free: Vec<bool> = (0..cycles.len()).map(free).collect();
        for _ in 0..64 {
            let mut changed = false;
            for way in 0..4 {
                for r in 0..rows {
                    let row = if way & 1 == 0 { r } else { rows - 1 - r };
                    for c in 0..columns {
                        let column = if way & 2 == 0 { c } else { columns - 1 - c };
                        let node = row * columns + column;
                        if !free[node] {
                            continue;
                        }
                        let at = |is: bool, near: usize| {
                            if is { (cycles[near], self.numbers[near]) } else { (f64::INFINITY, 0.0) }
                        };
                        let sooner = |a: (f64, f64), b: (f64, f64)| if b.0 < a.0 { b } else { a };
                        let across = sooner(at(column > 0, node.wrapping_sub(1)), at(column + 1 < columns, node + 1));
                        let up = sooner(at(row > 0, node.wrapping_sub(columns)), at(row + 1 < rows, node + columns));
                        let (low, high) = if across.0 < up.0 { (across, up) } else { (up, across) };
                        // The wave number in the middle of the square that waves come through, or of its edge.
                        let rise = 0.5 * (low.1 + high.1) * h;
                        let apart = high.0 - low.0;
                        let reached = if apart < rise {
                            0.5 * (low.0 + high.0 + (2.0 * rise * rise - apart * apart).sqrt())
                        } else {
                            low.0 + 0.5 * (low.1 + self.numbers[node]) * h
                        };
                        if reached < cycles[node] - 1e-12 {
                            cycles[node] = reached;
                            changed = true;
                        }
                    }
                }
            }
            if !changed {
                break;
            }
        }
    }
}
