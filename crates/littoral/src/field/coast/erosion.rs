//! Rivers and slopes carve the land.
//!
//! Rivers lower their beds by the stream-power law ∂h/∂t = u − K √A S (A the area that drains through a place, S its
//! slope): large streams flatten, headwaters steepen, and valleys branch as real ones do. Every place drains to its
//! steepest neighbour, so the law can be solved from the sea upward, implicitly, in one pass of linear cost and with steps
//! of any length. Soil creeps downhill by diffusion, which rounds the crests between.
//!
//! Works this rests on: J. Braun, S. Willett, "A very efficient O(n), implicit and parallel method to solve the stream power
//! equation", Geomorphology 180–181, 2013; R. Barnes et al., "Priority-flood", Computers & Geosciences 62, 2014;
//! G. Cordonnier et al., "Large scale terrain generation from tectonic uplift and fluvial erosion", Eurographics 2016.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// A square of heights being carved; heights at or below zero are sea and stay.
pub struct Carving {
    /// Samples a side.
    pub side: usize,
    /// Distance between samples (m).
    pub spacing: f32,
    /// Heights (m), row by row from the south.
    pub heights: Vec<f32>,
}

/// How land is carved over one step of time.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// K times the length of the step: how much a place that drains 1 m² at a slope of 1 is lowered (m / m).
    pub rivers: f32,
    /// Height gained over the step where `rise` is 1 (m).
    pub uplift: f32,
    /// Diffusivity times the length of the step (m²).
    pub creep: f32,
}

impl Carving {
    /// Fills every hollow so that all land drains to the sea, each place a trifle above the next.
    pub fn drain(&mut self) {
        let side = self.side;
        let mut seen: Vec<bool> = self.heights.iter().map(|h| *h <= 0.0).collect();
        let mut queue: BinaryHeap<Reverse<Level>> =
            (0..side * side).filter(|&i| seen[i]).map(|i| Reverse(Level(self.heights[i].max(0.0), i as u32))).collect();
        while let Some(Reverse(Level(level, i))) = queue.pop() {
            for (j, _) in neighbours(i as usize, side) {
                if !seen[j] {
                    seen[j] = true;
                    self.heights[j] = self.heights[j].max(level + 1e-3 * self.spacing);
                    queue.push(Reverse(Level(self.heights[j], j as u32)));
                }
            }
        }
    }

    /// Carves for `steps` steps. `rise` says how much of the uplift each place gets.
    pub fn carve(&mut self, law: &Law, rise: &[f32], steps: usize) {
        let count = self.heights.len();
        let mut receiver = vec![0u32; count];
        let mut run = vec![0.0f32; count];
        let mut order: Vec<u32> = Vec::with_capacity(count);
        let mut first = vec![0u32; count + 1];
        let mut donors = vec![0u32; count];
        let mut area = vec![0.0f32; count];
        let mut next = self.heights.clone();
        for _ in 0..steps {
            self.receivers(&mut receiver, &mut run);
            // From the sea upward: each place comes after the one it drains to.
            first.fill(0);
            for i in 0..count {
                if receiver[i] as usize != i {
                    first[receiver[i] as usize + 1] += 1;
                }
            }
            for i in 0..count {
                first[i + 1] += first[i];
            }
            let mut place = first.clone();
            for (i, &r) in receiver.iter().enumerate().take(count) {
                let r = r as usize;
                if r != i {
                    donors[place[r] as usize] = i as u32;
                    place[r] += 1;
                }
            }
            order.clear();
            order.extend((0..count as u32).filter(|&i| receiver[i as usize] == i));
            let mut at = 0;
            while at < order.len() {
                let i = order[at] as usize;
                order.extend_from_slice(&donors[first[i] as usize..first[i + 1] as usize]);
                at += 1;
            }
            area.fill(self.spacing * self.spacing);
            for &i in order.iter().rev() {
                let r = receiver[i as usize] as usize;
                if r != i as usize {
                    area[r] += area[i as usize];
                }
            }
            for &i in &order {
                let (i, r) = (i as usize, receiver[i as usize] as usize);
                if r != i {
                    let pull = law.rivers * area[i].sqrt() / run[i];
                    let risen = self.heights[i] + law.uplift * rise[i];
                    self.heights[i] = (risen + pull * self.heights[r].max(0.0)) / (1.0 + pull);
                }
            }
            self.creep(law.creep, &mut next);
        }
    }

    /// Where each place drains to, and how far that is; itself for the sea and for hollows.
    fn receivers(&self, receiver: &mut [u32], run: &mut [f32]) {
        for (i, receiver) in receiver.iter_mut().enumerate() {
            let (mut best, mut steepest) = (i, 0.0);
            if self.heights[i] > 0.0 {
                for (j, distance) in neighbours(i, self.side) {
                    let slope = (self.heights[i] - self.heights[j].max(0.0)) / distance;
                    if slope > steepest {
                        (best, steepest) = (j, slope);
                        run[i] = distance * self.spacing;
                    }
                }
            }
            *receiver = best as u32;
        }
    }

    /// One explicit step of diffusion, stable up to a quarter of a cell's area; land stays land.
    fn creep(&mut self, amount: f32, next: &mut [f32]) {
        let side = self.side;
        let share = (amount / (self.spacing * self.spacing)).min(0.24);
        for j in 0..side {
            for i in 0..side {
                let at = j * side + i;
                let here = self.heights[at];
                if here <= 0.0 {
                    next[at] = here;
                    continue;
                }
                let h = |k: usize| self.heights[k].max(0.0);
                let west = h(if i > 0 { at - 1 } else { at });
                let east = h(if i + 1 < side { at + 1 } else { at });
                let south = h(if j > 0 { at - side } else { at });
                let north = h(if j + 1 < side { at + side } else { at });
                next[at] = (here + share * (west + east + south + north - 4.0 * here)).max(1e-3);
            }
        }
        self.heights.copy_from_slice(next);
    }

    /// The same land with twice as many samples (2n − 1 a side), blended smoothly between.
    pub fn finer(&self) -> Carving {
        let (side, fine) = (self.side, 2 * self.side - 1);
        // Four-point interpolation, exact for cubics, along rows and then along columns.
        let between = |get: &dyn Fn(usize) -> f32, k: usize| {
            let (a, b) = (get(k.saturating_sub(1)), get(k));
            let (c, d) = (get(k + 1), get((k + 2).min(side - 1)));
            (9.0 * (b + c) - a - d) / 16.0
        };
        let mut rows = vec![0.0f32; fine * side];
        for j in 0..side {
            let row = &self.heights[j * side..][..side];
            for i in 0..fine {
                rows[j * fine + i] = if i % 2 == 0 { row[i / 2] } else { between(&|k| row[k], i / 2) };
            }
        }
        let mut heights = vec![0.0f32; fine * fine];
        for j in 0..fine {
            for i in 0..fine {
                let column = |k: usize| rows[k * fine + i];
                heights[j * fine + i] = if j % 2 == 0 { column(j / 2) } else { between(&column, j / 2) };
            }
        }
        Carving { side: fine, spacing: 0.5 * self.spacing, heights }
    }
}

/// A height in a queue; ties go by index, so that the order is the same everywhere.
struct Level(f32, u32);

impl PartialEq for Level {
    fn eq(&self, other: &Level) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Level {}
impl PartialOrd for Level {
    fn partial_cmp(&self, other: &Level) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Level {
    fn cmp(&self, other: &Level) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

/// The up to eight neighbours of a sample, and how far they are in samples.
fn neighbours(i: usize, side: usize) -> impl Iterator<Item = (usize, f32)> {
    let (x, y) = (i % side, i / side);
    const DIAGONAL: f32 = std::f32::consts::SQRT_2;
    const AROUND: [(isize, isize, f32); 8] = [
        (-1, 0, 1.0),
        (1, 0, 1.0),
        (0, -1, 1.0),
        (0, 1, 1.0),
        (-1, -1, DIAGONAL),
        (1, -1, DIAGONAL),
        (-1, 1, DIAGONAL),
        (1, 1, DIAGONAL),
    ];
    AROUND.into_iter().filter_map(move |(dx, dy, distance)| {
        let (nx, ny) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
        (nx < side && ny < side).then(|| (ny * side + nx, distance))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(side: usize) -> Carving {
        // Sea along the southern edge, a slope of 0.1 behind it.
        let heights = (0..side * side).map(|i| if i < side { -1.0 } else { (i / side) as f32 }).collect();
        Carving { side, spacing: 10.0, heights }
    }

    #[test]
    fn rivers_reach_the_profile_where_they_carry_off_what_rises() {
        // On a ramp without creep every column is a river of its own: at rest S = u / (K √A), with A growing along it.
        let mut land = strip(33);
        let law = Law { rivers: 0.2, uplift: 0.5, creep: 0.0 };
        land.carve(&law, &vec![1.0; 33 * 33], 4000);
        let column = 16;
        for j in 2..32 {
            let drop = land.heights[j * 33 + column] - land.heights[(j - 1) * 33 + column];
            let area = 100.0 * (33 - j) as f32;
            let expected = law.uplift / (law.rivers * area.sqrt()) * 10.0;
            assert!((drop / expected - 1.0).abs() < 0.02, "row {j}: {drop} for {expected}");
        }
    }

    #[test]
    fn drained_land_has_no_hollows() {
        let mut land = strip(33);
        for (i, h) in land.heights.iter_mut().enumerate() {
            if *h > 0.0 {
                *h = (*h + 6.0 * ((i * 7919 % 13) as f32 - 6.0)).max(0.5);
            }
        }
        land.drain();
        for i in 0..33 * 33 {
            if land.heights[i] > 0.0 {
                assert!(neighbours(i, 33).any(|(j, _)| land.heights[j] < land.heights[i]), "hollow at {i}");
            }
        }
    }

    #[test]
    fn finer_land_passes_through_its_samples() {
        let land = strip(17);
        let fine = land.finer();
        assert_eq!(fine.side, 33);
        for j in 0..17 {
            for i in 0..17 {
                assert_eq!(fine.heights[2 * j * 33 + 2 * i], land.heights[j * 17 + i]);
            }
        }
    }
}
