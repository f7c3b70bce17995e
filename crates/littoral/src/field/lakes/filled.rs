//! Lakes over a known bed: water that is poured in at a place until it stands at a level.
//!
//! Water spreads from a place to the lowest sample beside what it has wetted, and rises only where it must: a flood by priority (R. Barnes, C. Lehman,
//! D. Mulla, "Priority-flood: an optimal depression-filling and watershed-labeling algorithm", 2014), begun inside a hollow in place of the border. What is
//! wetted before it first rises above the level is the lake. It is followed further until it runs out over the border or into the sea: how high it stands then is the lowest
//! sill of the hollow, and where it last rose, the place of its outlet.
//!
//! Voids are walls. But many files are void all round, and there the data end: water that stands deep at such a void runs out, while one with a rim about at the level, of
//! a bed that was sounded and nothing else, is the shore.

use super::{Lakes, Land, Water};
use glam::DVec2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A lake that was filled to a level over its bed. Areas and volumes are sums over samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filled {
    /// Height of its surface (m).
    pub level: f64,
    /// Of its surface (m²).
    pub area: f64,
    /// Of its water (m³).
    pub volume: f64,
    /// Its greatest depth (m).
    pub deepest: f64,
    /// Where it would overflow if it rose; `None` where it never would, since voids are all about it that do not go on to the raster's edge, or are its shore.
    pub outlet: Option<Outlet>,
    /// Voids beside it. It ends at them, but they may be an outlet.
    pub voids_beside: usize,
}

/// The lowest place of a hollow's rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlet {
    /// How high it lies (m). Water in the hollow stands no higher.
    pub height: f64,
    /// Where it is (m).
    pub at: DVec2,
    /// Whether what overflows gets into the sea, and not out of the data.
    pub into_sea: bool,
}

impl Filled {
    /// The same where all heights are that many times as large.
    pub fn stretched(self, factor: f64) -> Filled {
        Filled {
            level: self.level * factor,
            volume: self.volume * factor,
            deepest: self.deepest * factor,
            outlet: self.outlet.map(|outlet| Outlet { height: outlet.height * factor, ..outlet }),
            ..self
        }
    }
}

/// Why a lake cannot be filled.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LakeError {
    /// It was named where nothing is known.
    #[error("expected a place on known ground, got {:.2},{:.2} (void or outside); choose one above the lake's bed", at.x, at.y)]
    NoGround {
        /// Where (m).
        at: DVec2,
    },
    /// It was named where the ground is above its level.
    #[error(
        "expected ground no higher than the lake's level of {level:.2} m, got {ground:.2} m; raise the level or choose a lower place"
    )]
    Dry {
        /// Its level (m).
        level: f64,
        /// Height of the ground there (m).
        ground: f64,
    },
    /// It was named in the sea.
    #[error(
        "expected a place inland, got one in the sea, which stands at {level:.2} m; choose another or leave the sea out"
    )]
    InSea {
        /// The sea's level (m).
        level: f64,
    },
    /// The hollow does not hold water up to its level.
    #[error("expected a level below {:.2} m, at which the hollow overflows {}, got {level:.2} m; lower it", outlet.height, if outlet.into_sea { "into the sea" } else { "beyond the data" })]
    Overflows {
        /// Its level (m).
        level: f64,
        /// Where water would run out.
        outlet: Outlet,
    },
    /// It meets another one that was filled.
    #[error("expected a lake apart from the others, got one that meets that at {level:.2} m; name it once")]
    Meets {
        /// The other's level (m).
        level: f64,
    },
    /// There are as many as there can be.
    #[error("expected at most {} lakes, got one more; leave some out", Lakes::MOST_FILLED)]
    TooMany,
}

impl LakeError {
    /// The same where all heights are that many times as large.
    pub fn stretched(self, factor: f64) -> LakeError {
        match self {
            LakeError::Dry { level, ground } => LakeError::Dry { level: level * factor, ground: ground * factor },
            LakeError::InSea { level } => LakeError::InSea { level: level * factor },
            LakeError::Overflows { level, outlet } => {
                let outlet = Outlet { height: outlet.height * factor, ..outlet };
                LakeError::Overflows { level: level * factor, outlet }
            }
            LakeError::Meets { level } => LakeError::Meets { level: level * factor },
            LakeError::NoGround { .. } | LakeError::TooMany => self,
        }
    }
}

impl Lakes {
    /// Fills the hollow at a place (m) of `land`, whose ground is its bed, with water up to a level (m). Samples join at their corners, too. It ends at voids; at those
    /// that go on to the raster's edge only if it is shallow there. A level hollow that it drowns becomes part of it.
    ///
    /// # Errors
    /// If the place is void, outside, above the level or in the sea; if the water would run out of the data, into `sea`, or meet another lake that was filled; if there
    /// are [`Lakes::MOST_FILLED`].
    pub fn fill(&mut self, land: &Land, sea: Option<&Water>, at: DVec2, level: f64) -> Result<Filled, LakeError> {
        if self.filled.len() == Lakes::MOST_FILLED {
            return Err(LakeError::TooMany);
        }
        // Samples are single: a level is no finer, so that a lake named at the height of its samples covers them.
        let level = f64::from(level as f32);
        let ground = land.height_at(at).map(f64::from).ok_or(LakeError::NoGround { at })?;
        if level.is_nan() || ground > level {
            return Err(LakeError::Dry { level, ground });
        }
        if let Some(sea) = sea.filter(|sea| ground <= sea.level && sea.covers(at)) {
            return Err(LakeError::InSea { level: sea.level });
        }
        let hollow = self.pour(land, sea, self.lowest_about(land, at), level);
        if let Some(outlet) = hollow.outlet.filter(|outlet| outlet.height <= level) {
            return Err(LakeError::Overflows { level, outlet });
        }
        let depths = hollow.wet.iter().map(|&i| level - f64::from(land.raster().heights()[i]));
        let deepest = depths.clone().fold(0.0, f64::max);
        if let Some(outlet) = hollow.brink.filter(|outlet| outlet.height <= level) {
            // About at the level: a shore on a slope of one in two, and no more than a twentieth of all depth.
            let shallow = (0.5 * self.spacing.max_element()).max(0.05 * deepest);
            let deep = |i: &&usize| level - f64::from(land.raster().heights()[**i]) > shallow;
            if hollow.by_voids.iter().filter(deep).count() as f64 > DEEP * hollow.by_voids.len() as f64 {
                return Err(LakeError::Overflows { level, outlet });
            }
        }
        if let Some(number) = hollow.wet.iter().find_map(|&i| self.samples[i].checked_sub(Lakes::FARTHEST + 1)) {
            return Err(LakeError::Meets { level: self.filled[usize::from(number)].level });
        }
        let cell = self.spacing.x * self.spacing.y;
        let filled = Filled {
            level,
            area: hollow.wet.len() as f64 * cell,
            volume: depths.sum::<f64>() * cell,
            deepest,
            outlet: hollow.brink.filter(|outlet| outlet.height > level).or(hollow.outlet),
            voids_beside: hollow.voids_beside,
        };
        self.filled.push(filled);
        let number = Lakes::FARTHEST + self.filled.len() as u8;
        hollow.wet.iter().for_each(|&i| self.samples[i] = number);
        let samples = &self.samples;
        self.hollows.retain(|(sample, _)| samples[*sample] <= Lakes::FARTHEST);
        Ok(filled)
    }

    /// The lowest sample of the patch that holds a place on known ground.
    fn lowest_about(&self, land: &Land, at: DVec2) -> usize {
        let raster = land.raster();
        let p = (at - self.origin) / self.spacing;
        let (c, r) = (p.x.max(0.0) as usize, p.y.max(0.0) as usize);
        // On a line between patches the one before may be the one that exists.
        let around = |at: usize, exact: bool, end: usize| at - usize::from(exact && at > 0)..(at + 2).min(end);
        let columns = around(c.min(self.columns - 1), p.x == c as f64, self.columns);
        let samples = around(r.min(self.rows - 1), p.y == r as f64, self.rows)
            .flat_map(|r| columns.clone().map(move |c| r * self.columns + c))
            .filter(|&i| !raster.voids().is_void(i));
        let heights = raster.heights();
        samples.min_by(|&a, &b| heights[a].total_cmp(&heights[b])).unwrap_or(0)
    }

    /// Water that spreads from a sample: what it wets until it has to rise above a level, and where it runs out.
    fn pour(&self, land: &Land, sea: Option<&Water>, from: usize, level: f64) -> Poured {
        let raster = land.raster();
        let (columns, rows, heights, voids) = (self.columns, self.rows, raster.heights(), raster.voids());
        let edge = land.voids_from_the_edge();
        let is_sea = |i: usize| sea.is_some_and(|sea| sea.floods(i));
        let mut seen = vec![false; columns * rows];
        // Samples no higher than the water stands, and those it has to rise to, the lowest first.
        let (mut low, mut rim) = (vec![from], BinaryHeap::new());
        let (mut stands, mut sill) = (heights[from], from);
        let mut poured = Poured::default();
        seen[from] = true;
        loop {
            let i = match low.pop() {
                Some(i) => i,
                None => match rim.pop() {
                    Some(Reverse((_, i))) => {
                        (stands, sill) = (heights[i], i);
                        i
                    }
                    None => return poured,
                },
            };
            let (column, row) = (i % columns, i / columns);
            let is_border = column == 0 || row == 0 || column + 1 == columns || row + 1 == rows;
            let outlet = |into_sea: bool| {
                let place = DVec2::new((sill % columns) as f64, (sill / columns) as f64);
                Outlet { height: f64::from(stands), at: self.origin + place * self.spacing, into_sea }
            };
            if is_border || is_sea(i) {
                poured.outlet = Some(outlet(is_sea(i)));
                return poured;
            }
            let is_wet = f64::from(stands) <= level;
            if is_wet {
                poured.wet.push(i);
            }
            let mut is_by_void = false;
            for r in row - 1..row + 2 {
                for j in r * columns + column - 1..r * columns + column + 2 {
                    is_by_void |= edge.get(j) == Some(&true) && !is_sea(j);
                    if std::mem::replace(&mut seen[j], true) {
                        continue;
                    }
                    // A void of the sea's lets the water run out, at the height it has.
                    if is_sea(j) || !voids.is_void(j) && heights[j] <= stands {
                        low.push(j);
                    } else if voids.is_void(j) {
                        poured.voids_beside += usize::from(is_wet);
                    } else {
                        rim.push(Reverse((rank(heights[j]), j)));
                    }
                }
            }
            if is_by_void {
                poured.brink.get_or_insert(outlet(false));
                if is_wet {
                    poured.by_voids.push(i);
                }
            }
        }
    }
}

/// The part of a lake's samples by voids at which the data end that may be deep.
const DEEP: f64 = 0.35;

/// What water has wetted.
#[derive(Default)]
struct Poured {
    wet: Vec<usize>,
    voids_beside: usize,
    /// Those of the wet that are by voids at which the data end, and where water first got there.
    by_voids: Vec<usize>,
    brink: Option<Outlet>,
    /// Where it got to the border or into the sea.
    outlet: Option<Outlet>,
}

/// A whole number that is larger for a larger height.
fn rank(height: f32) -> u32 {
    let bits = height.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests;
