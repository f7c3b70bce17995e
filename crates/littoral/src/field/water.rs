//! Still water: where it lies.
//!
//! Ground below a level is wet only if water can get there: the flood starts at the raster's edge and spreads over samples
//! that are no higher than the level. Polders, Death Valley and the Dead Sea stay as they are. The water's edge is the exact
//! contour of the bilinear surface, not the stairs of the mask, since the mask is widened by one sample and heights decide
//! within it.
//!
//! Many files hold no data where there is sea. A void that the flood reaches and whose rim nearly everywhere lies about at the
//! level is taken for it; all other voids stay unknown.

use super::Land;
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;

/// A still body of water over land.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// Height of its surface (m).
    pub level: f64,
    columns: usize,
    rows: usize,
    origin: DVec2,
    spacing: DVec2,
    /// One a sample, row by row from the south: [`DRY`], [`BESIDE`] a flooded one, or [`FLOODED`].
    reach: Vec<u8>,
    flooded: usize,
    /// Whether it goes on beyond each edge: west, east, south, north.
    open: [bool; 4],
}

const DRY: u8 = 0;
const BESIDE: u8 = 1;
const FLOODED: u8 = 2;

impl Water {
    /// The water that reaches `level` (m) from beyond the land's border; `None` where everything there is higher.
    pub fn flood(land: &Land, level: f64) -> Option<Water> {
        let raster = land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        let heights = raster.heights();
        let voids = raster.voids();
        let sea = if voids.any() { voids_of_the_sea(land, level) } else { Vec::new() };
        let low = |i: usize| match voids.is_void(i) {
            true => sea.get(i) == Some(&true),
            false => f64::from(heights[i]) <= level,
        };
        // Runs of low samples within rows, and those that touch each other, corners too, as trees; tree 0 is what lies beyond
        // the border.
        let runs_of = |row: usize| {
            let (mut runs, mut start) = (Vec::new(), None);
            for column in 0..columns {
                match (low(row * columns + column), start) {
                    (true, None) => start = Some(column),
                    (false, Some(first)) => {
                        runs.push(first..column);
                        start = None;
                    }
                    _ => {}
                }
            }
            runs.extend(start.map(|first| first..columns));
            runs
        };
        let runs: Vec<Vec<Range<usize>>> = (0..rows).into_par_iter().map(runs_of).collect();
        let mut trees = Trees::of(1);
        let mut open = [false; 4];
        let mut above = 1;
        for (row, here) in runs.iter().enumerate() {
            let below = if row == 0 { &[] } else { runs[row - 1].as_slice() };
            let (first, mut next) = (trees.0.len(), 0);
            for (k, run) in here.iter().enumerate() {
                trees.0.push(first + k);
                let edges = [run.start == 0, run.end == columns, row == 0, row == rows - 1];
                if edges.contains(&true) {
                    open.iter_mut().zip(edges).for_each(|(open, edge)| *open |= edge);
                    trees.join(first + k, 0);
                }
                while next < below.len() && below[next].end < run.start {
                    next += 1;
                }
                let touching = (next..below.len()).take_while(|&other| below[other].start <= run.end);
                touching.for_each(|other| trees.join(first + k, above + other));
            }
            above = first;
        }
        let mut wet = Vec::new();
        let mut number = 1;
        for (row, here) in runs.iter().enumerate() {
            for run in here {
                if trees.root(number) == 0 {
                    wet.push((row, run.clone()));
                }
                number += 1;
            }
        }
        if wet.is_empty() {
            return None;
        }
        let mut reach = vec![DRY; columns * rows];
        let mut flooded = 0;
        for (row, run) in &wet {
            reach[row * columns..][run.clone()].fill(FLOODED);
            flooded += run.len();
        }
        for (row, run) in wet {
            for row in row.saturating_sub(1)..(row + 2).min(rows) {
                let around = run.start.saturating_sub(1)..(run.end + 1).min(columns);
                reach[row * columns..][around].iter_mut().for_each(|beside| *beside = (*beside).max(BESIDE));
            }
        }
        Some(Water { level, columns, rows, origin: land.origin(), spacing: raster.spacing(), reach, flooded, open })
    }

    /// Share of the land's samples that lie under water, in [0, 1].
    pub fn share(&self) -> f64 {
        self.flooded as f64 / (self.columns * self.rows) as f64
    }

    /// Share of the raster's outline that lies under water, in [0, 1].
    pub fn share_of_border(&self) -> f64 {
        let (columns, rows) = (self.columns, self.rows);
        let ends = (0..columns).flat_map(|c| [c, (rows - 1) * columns + c]);
        let sides = (0..rows).flat_map(|r| [r * columns, (r + 1) * columns - 1]);
        let wet = ends.chain(sides).filter(|&i| self.reach[i] == FLOODED).count();
        wet as f64 / (2 * (columns + rows)) as f64
    }

    /// Whether a sample of the land, counted row by row from the south, lies under water.
    pub fn floods(&self, sample: usize) -> bool {
        self.reach[sample] == FLOODED
    }

    /// Whether a sample of the land, counted row by row from the south, lies under water of which no bed is known: it is void, or holds the water's surface
    /// in place of its bed, as whole squares of samples just at the level do. A line of such is a shore.
    pub fn is_unsounded(&self, land: &Land, sample: usize) -> bool {
        let raster = land.raster();
        if !self.floods(sample) || raster.voids().is_void(sample) {
            return self.floods(sample);
        }
        let level = self.level as f32;
        let (column, row) = (sample % self.columns, sample / self.columns);
        let at = |c: usize, r: usize| raster.heights()[r * self.columns + c] == level;
        let square = |c: usize, r: usize| at(c, r) && at(c + 1, r) && at(c, r + 1) && at(c + 1, r + 1);
        let (columns, rows) = (column.saturating_sub(1)..=column, row.saturating_sub(1)..=row);
        at(column, row)
            && columns.filter(|c| c + 1 < self.columns).any(|c| {
                let mut rows = rows.clone().filter(|r| r + 1 < self.rows);
                rows.any(|r| square(c, r))
            })
    }

    /// Whether the water goes on beyond any edge of the raster.
    pub fn reaches_horizon(&self) -> bool {
        self.open.contains(&true)
    }

    /// For each sample of the land, counted row by row from the south: not 0 if it lies in the water's basin or beside it.
    pub fn basin(&self) -> &[u8] {
        &self.reach
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
        self.reach[nearest.y as usize * self.columns + nearest.x as usize] != DRY
    }
}

/// The shore that rises from some water, as far up as swash is followed.
#[derive(Clone, Debug, PartialEq)]
pub struct Beach {
    level: f64,
    /// The water as it would stand that much higher.
    higher: Water,
}

impl Beach {
    /// How high above still water swash is followed (m).
    pub const HIGHEST: f64 = 3.0;

    /// The shore of `water` on `land`.
    pub fn of(land: &Land, water: &Water) -> Option<Beach> {
        Some(Beach { level: water.level, higher: Water::flood(land, water.level + Beach::HIGHEST)? })
    }

    /// For each sample of the land, row by row from the south: not 0 if it would lie in the water's basin, or beside it, if the water stood so much higher.
    pub fn basin(&self) -> &[u8] {
        self.higher.basin()
    }

    /// Whether swash may get to a place (m) of that land. Ground behind the shore that is lower than still water stays dry.
    pub fn covers(&self, land: &Land, at: DVec2) -> bool {
        self.higher.covers(at) && land.height_at(at).is_some_and(|ground| f64::from(ground) >= self.level)
    }
}

/// Things that belong together, each with one that stands for it, at the end with the least of all.
pub(super) struct Trees(Vec<usize>);

impl Trees {
    /// So many things, each alone.
    pub(super) fn of(count: usize) -> Trees {
        Trees((0..count).collect())
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn root(&mut self, mut thing: usize) -> usize {
        while self.0[thing] != thing {
            self.0[thing] = self.0[self.0[thing]];
            thing = self.0[thing];
        }
        thing
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// The samples of voids with a rim that nearly everywhere lies about at the level: sea, if water gets there.
fn voids_of_the_sea(land: &Land, level: f64) -> Vec<bool> {
    /// Share of the rim that may be higher: cliffs that drop into the sea.
    const HIGH: f64 = 0.35;
    let raster = land.raster();
    let (columns, rows, heights, voids) = (raster.columns(), raster.rows(), raster.heights(), raster.voids());
    let range = land.height_range();
    // About at the level: a beach on a slope of one in ten, and no more than a fiftieth of the relief.
    let tolerance = (0.1 * raster.spacing().max_element()).max(0.02 * f64::from(range.high - range.low)).max(0.5);
    let mut sea = vec![false; columns * rows];
    let mut seen = vec![false; columns * rows];
    let mut queue = Vec::new();
    for start in 0..columns * rows {
        if seen[start] || !voids.is_void(start) {
            continue;
        }
        let (mut part, mut rim, mut high) = (Vec::new(), 0usize, 0usize);
        seen[start] = true;
        queue.push(start);
        while let Some(i) = queue.pop() {
            part.push(i);
            let (column, row) = (i % columns, i / columns);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                for c in column.saturating_sub(1)..(column + 2).min(columns) {
                    let j = r * columns + c;
                    if !voids.is_void(j) {
                        rim += 1;
                        high += usize::from((f64::from(heights[j]) - level).abs() > tolerance);
                    } else if !seen[j] {
                        seen[j] = true;
                        queue.push(j);
                    }
                }
            }
        }
        if rim > 0 && (high as f64) <= HIGH * rim as f64 {
            part.iter().for_each(|&i| sea[i] = true);
        }
    }
    sea
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

    /// Sample by sample from the border, as one would say it.
    fn flood_by_samples(land: &Land, level: f64) -> Vec<bool> {
        let raster = land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        let mut wet = vec![false; columns * rows];
        let border = |i: &usize| {
            i.is_multiple_of(columns) || i % columns == columns - 1 || i / columns == 0 || i / columns == rows - 1
        };
        let mut queue: Vec<usize> = (0..columns * rows).filter(border).collect();
        while let Some(i) = queue.pop() {
            if wet[i] || f64::from(raster.heights()[i]) > level {
                continue;
            }
            wet[i] = true;
            let (column, row) = (i % columns, i / columns);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                queue.extend((column.saturating_sub(1)..(column + 2).min(columns)).map(|c| r * columns + c));
            }
        }
        wet
    }

    #[test]
    fn runs_flood_what_samples_do() {
        let mut state = 88_172_645_463_325_252u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        for _ in 0..400 {
            let (columns, rows) = (2 + (next() * 24.0) as usize, 2 + (next() * 24.0) as usize);
            let share = 0.3 + 0.4 * next();
            let heights = (0..columns * rows).map(|_| next() - share).collect();
            let land = Land::new(Raster::new(columns, rows, DVec2::ONE, heights).expect("valid"));
            let wet = flood_by_samples(&land, 0.0);
            let Some(water) = Water::flood(&land, 0.0) else {
                assert!(!wet.contains(&true));
                continue;
            };
            assert_eq!(water.flooded, wet.iter().filter(|wet| **wet).count());
            let mut open = [false; 4];
            for (i, &flooded) in wet.iter().enumerate() {
                let (column, row) = (i % columns, i / columns);
                let around =
                    |r: usize| (column.saturating_sub(1)..(column + 2).min(columns)).any(|c| wet[r * columns + c]);
                let beside = (row.saturating_sub(1)..(row + 2).min(rows)).any(around);
                let expected = if flooded {
                    FLOODED
                } else if beside {
                    BESIDE
                } else {
                    DRY
                };
                assert_eq!(water.reach[i], expected, "sample {i} of {columns} × {rows}");
                let edges = [column == 0, column == columns - 1, row == 0, row == rows - 1];
                open.iter_mut().zip(edges).for_each(|(open, edge)| *open |= edge && flooded);
            }
            assert_eq!(water.open, open);
        }
    }

    #[test]
    fn a_beach_rises_from_the_water_and_is_no_polder() {
        // Sea, a beach of 1 m, a polder behind it, a dike of 9 m, another polder.
        let land = strip(&[-5.0, -1.0, 1.0, -2.0, 9.0, -2.0]);
        let water = Water::flood(&strip(&[-5.0, -1.0, 1.0, 2.0, 9.0, 2.0]), 0.0).expect("wet in the west");
        let beach = Beach::of(&strip(&[-5.0, -1.0, 1.0, 2.0, 9.0, 9.0]), &water).expect("a beach");
        let covers = |x: f64| beach.covers(&land, DVec2::new(x - 2.5, 0.0));
        assert!(covers(2.0) && !covers(1.0) && !covers(3.0) && !covers(5.0));
        assert!(!covers(40.0) && !covers(f64::NAN));
    }

    #[test]
    fn squares_at_the_level_are_unsounded_and_lines_are_a_shore() {
        let heights = [0.0, 0.0, -1.0, 0.0, 2.0, f32::NAN].repeat(3);
        let land = Land::new(Raster::new(6, 3, DVec2::ONE, heights).expect("valid"));
        let water = Water::flood(&land, 0.0).expect("wet in the west");
        let unsounded = |column: usize| water.is_unsounded(&land, 6 + column);
        assert!(unsounded(0) && unsounded(1) && !unsounded(2) && !unsounded(3) && !unsounded(4));
        assert_eq!(unsounded(5), water.floods(11));
    }

    #[test]
    fn high_land_has_no_water() {
        assert_eq!(Water::flood(&strip(&[5.0, 3.0, 8.0]), 0.0), None);
        let shore = strip(&[-5.0, -1.0, 3.0, 8.0]);
        let water = Water::flood(&shore, 0.0).expect("wet in the west");
        assert_eq!(water.open, [true, false, true, true]);
    }

    #[test]
    fn voids_are_not_water_unless_their_rim_is_a_shore() {
        let land = strip(&[f32::NAN, f32::NAN, 3.0, 80.0]);
        assert_eq!(Water::flood(&land, 0.0), None);
        let land = strip(&[f32::NAN, f32::NAN, 0.3, 9.0, 80.0]);
        let water = Water::flood(&land, 0.0).expect("sea without data");
        assert_eq!((water.flooded, water.open), (6, [true, false, true, true]));
        assert!(water.floods(0) && !water.floods(2));
        assert!((water.share_of_border() - 7.0 / 16.0).abs() < 0.1);
        // A hole in the middle of the land is no sea, however low its rim.
        let hole = (0..25).map(|i| if i == 12 { f32::NAN } else { 0.2 }).collect();
        let land = Land::new(Raster::new(5, 5, DVec2::ONE, hole).expect("valid"));
        assert_eq!(Water::flood(&land, 0.0), None);
    }
}
