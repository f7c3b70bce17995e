//! What lies beyond the raster's border, judged by the border: the farther out, the wider the stretch of it that counts.
//!
//! The border is one closed line. The mean of anything over a stretch of it is a difference of two integrals, so that answers cost the same
//! however wide the stretch, and change smoothly: bed and water carry on from the border without a seam and lose its details as they go.

use super::Water;
use crate::field::Land;
use glam::{DVec2, Vec2};

/// The border of some land, from its south-western corner counter-clockwise.
pub struct Rim {
    low: DVec2,
    extent: DVec2,
    /// Distances along the border (m), from 0 to its whole length.
    along: Vec<f64>,
    /// Depth of the water (m) and whether there is any, at those.
    values: Vec<Vec2>,
    /// Their integrals from the beginning.
    sums: Vec<DVec2>,
}

/// What counts as being beyond a stretch of the border.
#[derive(Clone, Copy, Debug)]
pub struct Beyond {
    /// Distance from the border (m).
    pub away: f64,
    /// Mean depth (m) along the stretch, dry ground counting as 0.
    pub depth: f32,
    /// Share of it that lies under water, in [0, 1].
    pub wet: f32,
}

/// Half of the stretch that counts, as a share of the distance from the border.
const SPREAD: f64 = 0.3;

impl Rim {
    /// The border of `land`, where `bed` is the ground below its water.
    pub fn new(land: &Land, bed: &Land, water: &Water) -> Rim {
        let (low, extent) = (land.origin(), land.extent());
        let raster = land.raster();
        let (columns, rows) = (raster.columns() - 1, raster.rows() - 1);
        let spacing = raster.spacing();
        let mut places: Vec<DVec2> = (0..columns).map(|i| DVec2::new(i as f64 * spacing.x, 0.0)).collect();
        places.extend((0..rows).map(|j| DVec2::new(extent.x, j as f64 * spacing.y)));
        places.extend((0..columns).map(|i| DVec2::new(extent.x - i as f64 * spacing.x, extent.y)));
        places.extend((0..rows).map(|j| DVec2::new(0.0, extent.y - j as f64 * spacing.y)));
        places.push(DVec2::ZERO);
        let value = |p: &DVec2| {
            let at = low + p.clamp(DVec2::ZERO, extent);
            let under = |height: Option<f32>| height.is_none_or(|h| f64::from(h) <= water.level);
            if !(water.covers(at) && under(land.height_at(at))) {
                return Vec2::ZERO;
            }
            let depth = bed.height_at(at).map_or(40.0, |h| (water.level - f64::from(h)).clamp(0.0, 1e4));
            Vec2::new(depth as f32, 1.0)
        };
        let values: Vec<Vec2> = places.iter().map(value).collect();
        let (mut along, mut sums) = (vec![0.0], vec![DVec2::ZERO]);
        for i in 1..places.len() {
            let step = places[i].distance(places[i - 1]);
            along.push(along[i - 1] + step);
            sums.push(sums[i - 1] + 0.5 * step * (values[i - 1] + values[i]).as_dvec2());
        }
        Rim { low, extent, along, values, sums }
    }

    /// What is to be expected at a place (m) beyond the border; `None` within it.
    pub fn beyond(&self, at: DVec2) -> Option<Beyond> {
        let p = at - self.low;
        let border = p.clamp(DVec2::ZERO, self.extent);
        let away = p.distance(border);
        (away > 0.0).then(|| self.expected(p, border, away))
    }

    /// Depth (m) and share of water to be expected at a distance (m) from a place along the border (a share of its length).
    pub fn at(&self, along: f64, away: f64) -> Vec2 {
        let Beyond { depth, wet, .. } = self.around(along * self.along[self.along.len() - 1], away);
        Vec2::new(depth, wet)
    }

    /// What is to be expected at a place (m from the south-western corner) so far from the nearest one of the border.
    fn expected(&self, p: DVec2, border: DVec2, away: f64) -> Beyond {
        let DVec2 { x: width, y: height } = self.extent;
        let along = if p.y <= 0.0 {
            border.x
        } else if p.x >= width {
            width + border.y
        } else if p.y >= height {
            width + height + (width - border.x)
        } else {
            2.0 * width + height + (height - border.y)
        };
        self.around(along, away)
    }

    /// What is to be expected so far from a place along the border.
    fn around(&self, along: f64, away: f64) -> Beyond {
        let depth = self.mean(along, SPREAD * away).x;
        // Even at the border a few samples decide.
        let nearest = 2.0 * self.along[1].max(self.along[self.along.len() - 1] - self.along[self.along.len() - 2]);
        let wet = self.mean(along, SPREAD * away + nearest).y;
        Beyond { away, depth, wet }
    }

    /// The mean of the values within `half` (m) of a place along the border.
    fn mean(&self, along: f64, half: f64) -> Vec2 {
        let length = self.along[self.along.len() - 1];
        let whole = self.sums[self.sums.len() - 1];
        if 2.0 * half >= length {
            return (whole / length).as_vec2();
        }
        let integral = |s: f64| {
            let turns = (s / length).floor();
            let s = s - turns * length;
            let i = (self.along.partition_point(|a| *a <= s).max(1) - 1).min(self.along.len() - 2);
            let (step, f) = (self.along[i + 1] - self.along[i], s - self.along[i]);
            let (a, b) = (self.values[i].as_dvec2(), self.values[i + 1].as_dvec2());
            whole * turns + self.sums[i] + a * f + (b - a) * (0.5 * f * f / step)
        };
        // A stretch too short for a difference of integrals.
        let half = half.max(1e-6 * length);
        ((integral(along + half) - integral(along - half)) / (2.0 * half)).as_vec2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Raster;

    #[test]
    fn the_border_carries_on_and_fades_into_its_mean() {
        // A bed that falls to the east, 8 × 6 samples, with one deep furrow that ends at the southern border.
        let heights = (0..48).map(|i| if i == 3 { -30.0 } else { -((i % 8) as f32) - 1.0 }).collect();
        let land = Land::at(Raster::new(8, 6, DVec2::new(10.0, 20.0), heights).expect("valid"), DVec2::new(5.0, 7.0));
        let water = Water::flood(&land, 0.0).expect("wet");
        let rim = Rim::new(&land, &land, &water);
        // At the border: its depth.
        for (at, depth) in [((5.0, 7.0), 1.0), ((75.0, 57.0), 8.0), ((40.0, 107.0), 4.5), ((35.0, 7.0), 30.0)] {
            let (at, middle) = (DVec2::from(at), DVec2::new(40.0, 57.0));
            let beyond = rim.beyond(middle + (at - middle) * (1.0 + 1e-9)).expect("outside");
            assert!((beyond.depth - depth).abs() < 0.02 && beyond.away < 1e-6, "{at:?}: {beyond:?}");
            assert!(rim.beyond(middle + (at - middle) * 0.999).is_none());
            assert!((beyond.wet - 1.0).abs() < 1e-6);
        }
        let depth = |x: f64, y: f64| rim.beyond(DVec2::new(x, y)).expect("outside").depth;
        // Far away: the mean of the whole, from all sides alike.
        let mean = depth(-9e3, 40.0);
        assert!((depth(40.0, 9e3) - mean).abs() < 1e-4 && (3.0..8.0).contains(&mean));
        // The furrow is wider and shallower farther out.
        let near = depth(35.0, 2.0);
        let far = depth(35.0, -60.0);
        assert!(near > 25.0 && far < 15.0 && far > 4.0, "{near}, {far}");
        // No jumps, round the corners too.
        let mut last = depth(100.0, 40.0);
        for i in 1..=4000 {
            let turn = std::f64::consts::TAU * f64::from(i) / 4000.0;
            let here = depth(40.0 + 60.0 * turn.cos(), 57.0 + 75.0 * turn.sin());
            assert!((here - last).abs() < 0.3, "{i}: {last} to {here}");
            last = here;
        }
    }

    #[test]
    fn land_beyond_land_and_sea_beyond_sea() {
        let heights = (0..100).map(|i| if i % 10 < 5 { -3.0 } else { 4.0 }).collect();
        let land = Land::at(Raster::new(10, 10, DVec2::splat(50.0), heights).expect("valid"), DVec2::ZERO);
        let water = Water::flood(&land, 0.0).expect("wet");
        let rim = Rim::new(&land, &land, &water);
        let wet = |x: f64| rim.beyond(DVec2::new(x, 200.0)).expect("outside").wet;
        assert!(wet(-30.0) > 0.99);
        assert!(wet(490.0) < 0.01);
        let all = wet(1e6);
        assert!((0.4..0.6).contains(&all), "{all}");
    }
}
