//! Lakes: water inland, each at a level of its own.
//!
//! A measured height field holds the surface of a lake and not its bed, and the makers of elevation models flatten it: thousands of samples have
//! the very same height, and all about them the ground is higher, but for an outlet. Such a level hollow is taken for a lake. Level ground on
//! which water would not stay, a plateau or a step of a coarsely rounded plain, has lower ground beside it and is none.
//!
//! Where the bed of a lake is known, or a reservoir is only planned, somebody names a place in it and its level, and it is filled: see [`Lakes::fill`].

mod filled;

pub use filled::{Filled, LakeError, Outlet};

use super::{Land, Water};
use glam::DVec2;
use rayon::prelude::*;
use std::ops::Range;

/// The lakes of some land: those that are level hollows in it, and those that were filled over a bed.
#[derive(Clone, Debug, PartialEq)]
pub struct Lakes {
    columns: usize,
    rows: usize,
    origin: DVec2,
    spacing: DVec2,
    /// One a sample, row by row from the south: see [`Lakes::samples`].
    samples: Vec<u8>,
    /// A sample and the level of each that is a level hollow.
    hollows: Vec<(usize, f32)>,
    filled: Vec<Filled>,
}

/// Water within a lake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InLake {
    /// Height of its surface (m).
    pub level: f64,
    /// Its depth (m). Of a lake whose bed is unknown, a guess: it falls off from the shore.
    pub depth: f32,
    /// Whether its bed is known: it is the land.
    pub is_sounded: bool,
}

/// A lake has at least this many samples: fewer are level by chance.
const LEAST: usize = 200;
/// A run of fewer samples within a row is not looked at.
const NARROWEST: usize = 3;
/// The part of a lake's rim that may be lower: its outlet.
const OUTLET: f64 = 0.01;
/// An unknown bed falls so much a metre from the shore, and no deeper than this (m).
const FALL: f32 = 0.07;
const DEEPEST: f32 = 30.0;

/// A level hollow while it is being found.
#[derive(Clone, Copy, Default)]
struct Hollow {
    samples: usize,
    rim: usize,
    lower: usize,
    kept: bool,
}

impl Lakes {
    /// At most so many lakes can be filled.
    pub const MOST_FILLED: usize = 32;
    /// The greatest distance to a shore that is told (samples).
    pub const FARTHEST: u8 = u8::MAX - Lakes::MOST_FILLED as u8;

    /// No lakes yet.
    pub fn none(land: &Land) -> Lakes {
        let raster = land.raster();
        let (columns, rows, spacing) = (raster.columns(), raster.rows(), raster.spacing());
        let samples = vec![0; columns * rows];
        Lakes { columns, rows, origin: land.origin(), spacing, samples, hollows: Vec::new(), filled: Vec::new() }
    }

    /// The lakes of `land` that are not part of `sea`; `None` if there are none.
    pub fn find(land: &Land, sea: Option<&Water>) -> Option<Lakes> {
        let raster = land.raster();
        let (columns, rows, heights) = (raster.columns(), raster.rows(), raster.heights());
        let level_runs = |row: usize| {
            let heights = &heights[row * columns..][..columns];
            let mut runs: Vec<Range<usize>> = Vec::new();
            let mut start = 0;
            for column in 1..=columns {
                if column == columns || heights[column] != heights[start] {
                    let dry = || !sea.is_some_and(|sea| sea.floods(row * columns + start));
                    // Voids, which are no numbers, are unequal to themselves.
                    if column - start >= NARROWEST && !raster.voids().is_void(row * columns + start) && dry() {
                        runs.push(start..column);
                    }
                    start = column;
                }
            }
            runs
        };
        let runs: Vec<Vec<Range<usize>>> = (0..rows).into_par_iter().map(level_runs).collect();
        let first: Vec<usize> = runs
            .iter()
            .scan(0, |sum, row| {
                *sum += row.len();
                Some(*sum - row.len())
            })
            .collect();
        let mut trees = super::water::Trees::of(first.last()? + runs.last()?.len());
        for row in 1..rows {
            let mut below = 0;
            for (k, run) in runs[row].iter().enumerate() {
                let height = heights[row * columns + run.start];
                while below < runs[row - 1].len() && runs[row - 1][below].end <= run.start {
                    below += 1;
                }
                let touching = runs[row - 1][below..].iter().enumerate().take_while(|(_, other)| other.start < run.end);
                for (n, other) in touching {
                    if heights[(row - 1) * columns + other.start] == height {
                        trees.join(first[row] + k, first[row - 1] + below + n);
                    }
                }
            }
        }
        let mut hollows = vec![Hollow::default(); trees.len()];
        for (row, runs) in runs.iter().enumerate() {
            for (k, run) in runs.iter().enumerate() {
                let hollow = &mut hollows[trees.root(first[row] + k)];
                hollow.samples += run.len();
                let height = heights[row * columns + run.start];
                let mut beside = |i: usize| {
                    if heights[i] != height {
                        hollow.rim += 1;
                        // What is unknown may be anything, an outlet too.
                        hollow.lower += usize::from(heights[i] < height || raster.voids().is_void(i));
                    }
                };
                (run.start > 0).then(|| beside(row * columns + run.start - 1));
                (run.end < columns).then(|| beside(row * columns + run.end));
                for column in run.clone() {
                    (row > 0).then(|| beside((row - 1) * columns + column));
                    (row + 1 < rows).then(|| beside((row + 1) * columns + column));
                }
            }
        }
        let mut lakes = Lakes::none(land);
        for hollow in &mut hollows {
            let round = (hollow.samples as f64).sqrt();
            hollow.kept = hollow.samples >= LEAST
                && hollow.rim as f64 >= 2.0 * round
                && hollow.lower as f64 <= OUTLET * hollow.rim as f64 + 1.0;
        }
        for (row, runs) in runs.iter().enumerate() {
            for (k, run) in runs.iter().enumerate() {
                let root = trees.root(first[row] + k);
                if hollows[root].kept {
                    lakes.samples[row * columns..][run.clone()].fill(Lakes::FARTHEST);
                    if root == first[row] + k {
                        let sample = row * columns + run.start;
                        lakes.hollows.push((sample, heights[sample]));
                    }
                }
            }
        }
        if lakes.hollows.is_empty() {
            return None;
        }
        distances(&mut lakes.samples, columns, rows);
        Some(lakes)
    }

    /// Heights of their surfaces (m): from south to north, then those that were filled.
    pub fn levels(&self) -> impl Iterator<Item = f64> {
        let hollows = self.hollows.iter().map(|(_, level)| f64::from(*level));
        hollows.chain(self.filled.iter().map(|lake| lake.level))
    }

    /// Those that were filled, in that order.
    pub fn filled(&self) -> &[Filled] {
        &self.filled
    }

    /// For each sample of the land, counted row by row from the south: 0 where there is no lake; up to [`Lakes::FARTHEST`] the distance to the shore of a level
    /// hollow, in samples; above, in a filled lake, that much more than its number, counted from 1.
    pub fn samples(&self) -> &[u8] {
        &self.samples
    }

    /// Share of the land's samples that they cover, in [0, 1].
    pub fn share(&self) -> f64 {
        self.samples.iter().filter(|d| **d > 0).count() as f64 / self.samples.len() as f64
    }

    /// The lake at a world position (m) of `land`, which is the one they were found in. The edge of a filled one is the exact contour of the bed; that of a level
    /// hollow the contour of the ground a few centimetres above its level.
    pub fn at(&self, land: &Land, at: DVec2) -> Option<InLake> {
        let p = (at - self.origin) / self.spacing;
        let last = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64);
        if !(p.cmpge(DVec2::ZERO).all() && p.cmple(last).all()) {
            return None;
        }
        let (c, r) = ((p.x as usize).min(self.columns - 2), (p.y as usize).min(self.rows - 2));
        let corner = r * self.columns + c;
        let corners = [corner, corner + 1, corner + self.columns, corner + self.columns + 1];
        let wet = corners.into_iter().max_by_key(|&i| self.samples[i]).filter(|&i| self.samples[i] > 0)?;
        let height = f64::from(land.height_at(at)?);
        if let Some(number) = self.samples[wet].checked_sub(Lakes::FARTHEST + 1) {
            let level = self.filled[usize::from(number)].level;
            let depth = (level - height) as f32;
            return (height <= level).then_some(InLake { level, depth, is_sounded: true });
        }
        let level = f64::from(land.raster().heights()[wet]);
        let f = p - DVec2::new(c as f64, r as f64);
        let distance = |i: usize| f64::from(self.samples[corners[i]]);
        let low = distance(0) + (distance(1) - distance(0)) * f.x;
        let high = distance(2) + (distance(3) - distance(2)) * f.x;
        let to_shore = (low + (high - low) * f.y) * self.spacing.min_element();
        let depth = (FALL * to_shore as f32).min(DEEPEST);
        (height <= level + EDGE).then_some(InLake { level, depth, is_sounded: false })
    }
}

/// How far above a level hollow its shore is drawn (m).
const EDGE: f64 = 0.05;

/// Distances to the nearest 0, counted in samples, by two sweeps (G. Borgefors, "Distance transformations in digital images", 1986). What lies beyond
/// the border is not known to be shore.
fn distances(shore: &mut [u8], columns: usize, rows: usize) {
    for pass in 0..2 {
        for n in 0..columns * rows {
            let i = if pass == 0 { n } else { columns * rows - 1 - n };
            if shore[i] == 0 {
                continue;
            }
            let (c, r) = (i % columns, i / columns);
            let mut least = shore[i];
            let beside = match pass {
                0 => [(c > 0).then(|| i - 1), (r > 0).then(|| i - columns)],
                _ => [(c + 1 < columns).then(|| i + 1), (r + 1 < rows).then(|| i + columns)],
            };
            for j in beside.into_iter().flatten() {
                least = least.min(shore[j].saturating_add(1));
            }
            shore[i] = least;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Raster;
    use crate::field::noise::Fbm;

    /// Hills with a flattened lake where they are lowest, `lower` samples of whose rim are cut down.
    fn hills(side: usize, lower: usize) -> Land {
        let fbm = Fbm::new(60.0, 0.4, 4, 5);
        let mut heights: Vec<f32> = (0..side * side)
            .map(|i| {
                let at = DVec2::new((i % side) as f64, (i / side) as f64);
                let bowl = ((at - 0.5 * side as f64) / (0.5 * side as f64)).length_squared();
                (300.0 + 80.0 * bowl + 20.0 * fbm.at(at).value) as f32
            })
            .collect();
        for height in &mut heights {
            *height = height.max(310.0);
        }
        let rim: Vec<usize> = (side..heights.len() - side)
            .filter(|&i| heights[i] > 310.0 && [i - 1, i + 1, i - side, i + side].iter().any(|&j| heights[j] == 310.0))
            .take(lower)
            .collect();
        rim.into_iter().for_each(|i| heights[i] = 305.0);
        Land::new(Raster::new(side, side, DVec2::splat(10.0), heights).expect("valid"))
    }

    #[test]
    fn a_flattened_hollow_is_a_lake() {
        let land = hills(101, 0);
        let lakes = Lakes::find(&land, None).expect("a lake");
        assert!(lakes.levels().eq([310.0]));
        let flat = land.raster().heights().iter().filter(|h| **h == 310.0).count();
        assert!((lakes.share() * 101.0 * 101.0 - flat as f64).abs() < 0.02 * flat as f64, "all of it but slivers");
        let middle = lakes.at(&land, DVec2::ZERO).expect("in the middle");
        assert!(middle.level == 310.0 && middle.depth > 0.07 * 60.0 && !middle.is_sounded, "{middle:?}");
        assert_eq!(lakes.at(&land, DVec2::new(480.0, 480.0)), None);
        assert_eq!(lakes.at(&land, DVec2::new(9e9, f64::NAN)), None);
        // Its edge is a contour, not the samples' stairs.
        let (mut wet, mut dry) = (0, 0);
        for i in 0..2000 {
            let at = DVec2::from_angle(f64::from(i)) * (100.0 + 0.15 * f64::from(i));
            match (lakes.at(&land, at).is_some(), land.height_at(at).expect("known") <= 310.05) {
                (true, low) => {
                    assert!(low);
                    wet += 1;
                }
                (false, low) => dry += u32::from(!low),
            }
        }
        assert!(wet > 300 && dry > 300, "{wet} {dry}");
    }

    #[test]
    fn what_water_would_run_off_is_none() {
        // A single outlet is one; a broken side is not.
        assert!(Lakes::find(&hills(101, 2), None).is_some());
        assert_eq!(Lakes::find(&hills(101, 40), None), None);
        // A plateau, a plain without a rim, a coarsely rounded slope, ground below the sea's level.
        let of = |f: fn(f64, f64) -> f64| {
            let heights = (0..80 * 80).map(|i| f(f64::from(i % 80), f64::from(i / 80)) as f32).collect();
            Land::new(Raster::new(80, 80, DVec2::ONE, heights).expect("valid"))
        };
        let plateau = of(|x, y| 50.0 - (x - 40.0).hypot(y - 40.0).max(25.0));
        assert_eq!(Lakes::find(&plateau, None), None);
        assert_eq!(Lakes::find(&of(|_, _| 7.0), None), None);
        assert_eq!(Lakes::find(&of(|x, y| (0.05 * x + 0.004 * (y - 40.0).powi(2)).round()), None), None);
        let bay = of(|x, y| (0.1 * (x - 40.0).hypot(y)).max(2.0));
        assert!(Lakes::find(&bay, None).is_some());
        let sea = Water::flood(&bay, 2.0).expect("from the south");
        assert_eq!(Lakes::find(&bay, Some(&sea)), None);
        assert_eq!(Lakes::find(&of(|_, _| f64::NAN), None), None);
    }
}
