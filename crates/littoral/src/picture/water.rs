//! Still water: where it lies.
//!
//! Ground below a level is wet only if water can get there: the flood starts at the open border of the land (the raster's
//! edge and the rims of voids) and spreads over samples that are no higher than the level. Polders, Death Valley and the
//! Dead Sea stay as they are. The water's edge is the exact contour of the bilinear surface, not the stairs of the mask,
//! since the mask is widened by one sample and heights decide within it.

use crate::field::Land;
use glam::DVec2;

/// A still body of water over land.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// Height of its surface (m).
    pub level: f64,
    columns: usize,
    rows: usize,
    origin: DVec2,
    spacing: DVec2,
    /// One a sample, row by row from the south: flooded, or next to a flooded one.
    near: Vec<bool>,
    flooded: usize,
    /// Whether it goes on beyond each edge: west, east, south, north.
    open: [bool; 4],
}

impl Water {
    /// The water that reaches `level` (m) from beyond the land's border; `None` where everything there is higher.
    pub fn flood(land: &Land, level: f64) -> Option<Water> {
        let raster = land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        let heights = raster.heights();
        let voids = raster.voids();
        let low = |i: usize| !voids.is_void(i) && f64::from(heights[i]) <= level;
        let mut wet = vec![false; columns * rows];
        let mut queue: Vec<usize> = Vec::new();
        let mut open = [false; 4];
        for row in 0..rows {
            for column in 0..columns {
                let edges = [column == 0, column == columns - 1, row == 0, row == rows - 1];
                let i = row * columns + column;
                if low(i) && edges.contains(&true) {
                    for (open, edge) in open.iter_mut().zip(edges) {
                        *open |= edge;
                    }
                    wet[i] = true;
                    queue.push(i);
                }
            }
        }
        let mut flooded = queue.len();
        while let Some(i) = queue.pop() {
            let (column, row) = (i % columns, i / columns);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                for c in column.saturating_sub(1)..(column + 2).min(columns) {
                    let j = r * columns + c;
                    if !wet[j] && low(j) {
                        wet[j] = true;
                        flooded += 1;
                        queue.push(j);
                    }
                }
            }
        }
        if flooded == 0 {
            return None;
        }
        let mut near = wet.clone();
        for i in (0..columns * rows).filter(|&i| wet[i]) {
            let (column, row) = (i % columns, i / columns);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                near[r * columns + column.saturating_sub(1)..r * columns + (column + 2).min(columns)].fill(true);
            }
        }
        Some(Water { level, columns, rows, origin: land.origin(), spacing: raster.spacing(), near, flooded, open })
    }

    /// Share of the land's samples that lie under water, in [0, 1].
    pub fn share(&self) -> f64 {
        self.flooded as f64 / (self.columns * self.rows) as f64
    }

    /// Whether the water goes on beyond any edge of the raster.
    pub fn reaches_horizon(&self) -> bool {
        self.open.contains(&true)
    }

    /// Whether a world position (m) lies in the water's basin: there it is wet wherever the ground is below
    /// [`Water::level`].
    pub fn covers(&self, at: DVec2) -> bool {
        let lattice = (at - self.origin) / self.spacing;
        let last = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64);
        if !(lattice.cmpge(DVec2::ZERO).all() && lattice.cmple(last).all()) {
            return self.reaches_horizon();
        }
        let nearest = lattice.round();
        self.near[nearest.y as usize * self.columns + nearest.x as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Raster;

    /// A row of heights as land, three samples wide in the other direction.
    fn strip(heights: &[f32]) -> Land {
        let rows: Vec<f32> = [heights, heights, heights].concat();
        Land::new(Raster::new(heights.len(), 3, DVec2::ONE, rows).expect("valid"))
    }

    #[test]
    fn a_polder_stays_dry() {
        let mut heights = vec![-3.0; 7 * 7];
        // A dike all round the middle, and high ground along the eastern edge.
        for i in 0..7 {
            for j in 0..7 {
                if (1..6).contains(&i) && (1..6).contains(&j) && (i == 1 || i == 5 || j == 1 || j == 5) {
                    heights[j * 7 + i] = 2.0;
                }
            }
        }
        let land = Land::new(Raster::new(7, 7, DVec2::ONE, heights).expect("valid"));
        let water = Water::flood(&land, 0.0).expect("the outside is wet");
        assert!(!water.covers(DVec2::ZERO), "behind the dike");
        assert!(water.covers(DVec2::new(-3.0, 0.0)) && water.covers(DVec2::new(50.0, 0.0)));
        assert_eq!(water.flooded, 24);
    }

    #[test]
    fn high_land_has_no_water() {
        assert_eq!(Water::flood(&strip(&[5.0, 3.0, 8.0]), 0.0), None);
        let shore = strip(&[-5.0, -1.0, 3.0, 8.0]);
        let water = Water::flood(&shore, 0.0).expect("wet in the west");
        assert_eq!(water.open, [true, false, true, true]);
    }

    #[test]
    fn voids_are_not_water() {
        let land = strip(&[f32::NAN, f32::NAN, 3.0]);
        assert_eq!(Water::flood(&land, 0.0), None);
    }
}
