//! The built-in coast: an invented headland with cliffs, a bay with a beach, hills behind, sea bed in front.
//!
//! The outline is drawn by hand and bent by noise; rivers carve the hills behind it (stream power); waves cut cliffs where
//! the shore lies open and build a beach where the bay shelters it; the bed falls off as beaches do (R. Dean,
//! "Equilibrium beach profiles", 1991: depth grows with distance to the power ⅔). Equal bits on every run.

mod erosion;

use super::noise::{Fbm, gradient};
use super::{Land, Raster};
use crate::space::View;
use crate::waves::{SeaState, heading_from_bearing};
use erosion::{Carving, Law};
use glam::{DVec2, DVec3, UVec2};
use rayon::prelude::*;

/// Side of the coast (m): x and y run from 0 to this.
pub const SIDE: f64 = 5120.0;
/// Samples a side.
const SAMPLES: usize = 1281;

/// The coast. Sea level is 0.
pub fn coast() -> Land {
    let carved = hills();
    let shore = Shore::new(&carved);
    let spacing = SIDE / (SAMPLES - 1) as f64;
    let mut heights = vec![0.0f32; SAMPLES * SAMPLES];
    heights.par_chunks_exact_mut(SAMPLES).enumerate().for_each(|(j, row)| {
        for (i, height) in row.iter_mut().enumerate() {
            *height = shore.height(DVec2::new(i as f64, j as f64) * spacing) as f32;
        }
    });
    match Raster::new(SAMPLES, SAMPLES, DVec2::splat(spacing), heights) {
        Ok(raster) => Land::at(raster, DVec2::ZERO),
        Err(error) => unreachable!("the coast's size is fixed: {error}"),
    }
}

/// A good view of the coast.
pub fn view(size: UVec2) -> View {
    let eye = DVec3::new(3380.0, 560.0, 175.0);
    View::looking_at(eye, DVec3::new(2850.0, 2400.0, 10.0), 38f32.to_radians(), size)
}

/// Bearing and elevation of the sun that suits [`view`] (rad).
pub fn sun() -> (f64, f64) {
    (254f64.to_radians(), 14f64.to_radians())
}

/// The sea that suits [`view`]: a moderate breeze and its waves out of the south-west.
pub fn sea_state() -> SeaState {
    match SeaState::beaufort(4.0, heading_from_bearing(225.0)) {
        Ok(state) => state,
        Err(error) => unreachable!("the coast's sea is fixed: {error}"),
    }
}

/// How far inland a place lies (m), by the outline drawn by hand, bent by noise; negative at sea.
fn inland(at: DVec2) -> f64 {
    let bend = |seed: u32| Fbm::new(900.0, 300.0, 5, seed).at(at).value;
    let p = at + DVec2::new(bend(11), bend(61));
    // The shore as the height of land over x: a lesser cape in the west, a wide bay, a headland in the east.
    let bump = |middle: f64, width: f64| (-((p.x - middle) / width).powi(2)).exp();
    let line = 2000.0 - 1150.0 * bump(3750.0, 430.0) + 400.0 * bump(2500.0, 620.0)
        - 620.0 * bump(1050.0, 480.0)
        - 150.0 * bump(5100.0, 700.0);
    p.y - line
}

/// Hills carved by rivers, coarse and then finer; sea is negative.
fn hills() -> Carving {
    let side = 161;
    let spacing = SIDE / (side - 1) as f64;
    let place = |i: usize, side: usize| DVec2::new((i % side) as f64, (i / side) as f64) * (SIDE / (side - 1) as f64);
    let swell = Fbm::new(1500.0, 150.0, 5, 5);
    let start = |i: usize| {
        let at = place(i, side);
        let d = inland(at);
        if d < 0.0 {
            return (d * 0.05) as f32;
        }
        let rise = 0.11 * d + 40.0 * (1.0 - (-d / 180.0).exp());
        (rise + swell.at(at).value * (d / 900.0).min(1.0)).max(1.0) as f32
    };
    let mut land = Carving { side, spacing: spacing as f32, heights: (0..side * side).map(start).collect() };
    let rises = |side: usize| -> Vec<f32> {
        let hard = Fbm::new(700.0, 0.9, 4, 21);
        (0..side * side)
            .map(|i| {
                let at = place(i, side);
                let d = inland(at).max(0.0);
                let valley = (-((at.x - 2500.0) / 700.0).powi(2)).exp();
                let high = 0.35 + 0.9 * (d / 2200.0).min(1.2);
                ((high * (1.0 - 0.55 * valley)) * (1.0 + hard.at(at).value)).max(0.05) as f32
            })
            .collect()
    };
    land.drain();
    land.carve(&Law { rivers: 0.030, uplift: 1.5, creep: 60.0 }, &rises(land.side), 60);
    for (steps, law) in
        [(14, Law { rivers: 0.030, uplift: 1.5, creep: 25.0 }), (6, Law { rivers: 0.022, uplift: 1.2, creep: 7.0 })]
    {
        land = land.finer();
        land.drain();
        land.carve(&law, &rises(land.side), steps);
    }
    land
}

/// The shore between hills and sea.
struct Shore {
    side: usize,
    spacing: f64,
    /// Height of the hills (m).
    hills: Vec<f32>,
    /// Distance to the shore (m), negative at sea.
    inland: Vec<f32>,
}

impl Shore {
    fn new(carved: &Carving) -> Shore {
        let land: Vec<bool> = carved.heights.iter().map(|h| *h > 0.0).collect();
        let to_sea = distances(&land, carved.side);
        let to_land = distances(&land.iter().map(|l| !l).collect::<Vec<_>>(), carved.side);
        let inland: Vec<f32> = to_sea.iter().zip(&to_land).map(|(sea, land)| (sea - land) * carved.spacing).collect();
        let inland = rounded(&rounded(&inland, carved.side), carved.side);
        Shore { side: carved.side, spacing: f64::from(carved.spacing), hills: carved.heights.clone(), inland }
    }

    /// Height of the finished coast at a place (m).
    fn height(&self, at: DVec2) -> f64 {
        let raw = self.blend(&self.inland, at);
        let carved = self.blend(&self.hills, at).max(0.0);
        let exposed = self.exposure(at);
        let off = (-raw).max(0.0);
        if off > 420.0 {
            return self.bed(at, off, exposed).max(self.skerries(at));
        }
        if raw > 420.0 {
            let crags = Fbm::new(46.0, 5.0, 3, 35).at(at).value;
            return self.lifted(at, carved, raw) + crags * smooth(20.0, 160.0, carved);
        }
        // Rock breaks along the shore in steps of tens of metres.
        let ragged = Fbm::new(150.0, 44.0, 4, 31).at(at).value;
        let d = raw + ragged * smooth(-200.0, 0.0, raw) * (0.25 + 0.75 * exposed);
        let hill = self.lifted(at, carved, d);
        let bed = self.bed(at, (-d).max(0.0), exposed);

        // A beach rises gently to its dunes; behind, the hills begin.
        let dune = gradient(at / 70.0, 34).value * 2.6;
        let beach = 0.04 * d.max(0.0) + (1.2 + dune).max(0.0) * smooth(60.0, 120.0, d);
        let gentle = beach + (hill - beach).max(0.0) * smooth(90.0, 380.0, d);

        // Waves have taken the foot of open hills: what is left ends in a cliff above a platform of rock.
        let crags = Fbm::new(46.0, 5.0, 4, 35).at(at).value;
        let retreat = 62.0 + 0.5 * ragged;
        let face = smooth(retreat - 7.0, retreat + 10.0, d + 2.2 * crags);
        let top = hill + crags * smooth(20.0, 120.0, hill) + 1.0;
        let platform = (bed - 0.4).min(-0.6 - 0.02 * (retreat - d).max(0.0))
            + 0.9 * Fbm::new(30.0, 5.0, 3, 36).at(at).value.max(-0.5) * smooth(110.0, 50.0, (d - retreat).abs());
        let cliff = platform + (top - platform) * face;
        let open = if d > -200.0 { cliff } else { bed };
        let sheltered = if d > 0.0 { gentle.min(hill.max(beach)) } else { bed };
        (sheltered + (open - sheltered) * exposed).max(self.skerries(at))
    }

    /// The carved hills, with open headlands lifted clear of the sea.
    fn lifted(&self, at: DVec2, carved: f64, d: f64) -> f64 {
        let headland = (-((at.x - 3700.0) / 620.0).powi(2)).exp() * smooth(2600.0, 1300.0, at.y);
        let cape = 0.55 * (-((at.x - 1100.0) / 520.0).powi(2)).exp() * smooth(2500.0, 1500.0, at.y);
        let uneven = 1.0 + 0.7 * gradient(at / 420.0, 42).value;
        carved + 62.0 * headland.max(cape).max(0.18) * uneven * smooth(-20.0, 60.0, d) * smooth(1500.0, 400.0, d)
    }

    /// The bed: a beach's profile in the bay, a steeper rocky one in the open, uneven.
    fn bed(&self, at: DVec2, off: f64, exposed: f64) -> f64 {
        let root = off.cbrt();
        let sandy = 0.075 * root * root + 0.006 * off;
        let rocky = 1.0 + 0.26 * root * root + 0.018 * off;
        let uneven = Fbm::new(240.0, 7.0, 4, 33).at(at).value * exposed * smooth(0.0, 120.0, off);
        -(sandy + (rocky - sandy) * exposed) + uneven.min(0.6 * rocky)
    }

    /// How open a place lies to the waves, in [0, 1]: the bay is sheltered.
    fn exposure(&self, at: DVec2) -> f64 {
        let wander = gradient(at / 500.0, 41).value * 120.0;
        let bay = smooth(760.0, 470.0, (at.x + wander - 2420.0).abs()) * smooth(1500.0, 1900.0, at.y);
        1.0 - bay
    }

    /// Rocks off the headland.
    fn skerries(&self, at: DVec2) -> f64 {
        let rocks = [
            (3040.0, 1290.0, 40.0, 26.0),
            (3110.0, 1220.0, 26.0, 9.0),
            (2960.0, 1390.0, 22.0, 5.0),
            (1790.0, 1010.0, 60.0, 14.0),
        ];
        let mut best = f64::NEG_INFINITY;
        for (i, (x, y, radius, height)) in rocks.into_iter().enumerate() {
            let away = at - DVec2::new(x, y);
            if away.length() < 6.0 * radius {
                let bend = Fbm::new(55.0, 26.0, 4, 60 + i as u32).at(at).value;
                let r = (away.length() + bend) / radius;
                let crag = Fbm::new(24.0, 5.0, 4, 70 + i as u32).at(at).value;
                best = best.max(
                    (height + crag) * smooth(1.15, 0.55, r) - 60.0 * smooth(0.7, 6.0, r) - 3.0 * smooth(0.8, 1.2, r),
                );
            }
        }
        best
    }

    fn blend(&self, values: &[f32], at: DVec2) -> f64 {
        // Catmull-Rom over four by four samples: no creases between them.
        let p = (at / self.spacing).clamp(DVec2::ZERO, DVec2::splat((self.side - 1) as f64));
        let base = p.floor().min(DVec2::splat((self.side - 2) as f64));
        let f = p - base;
        let weights = |t: f64| {
            let (t2, t3) = (t * t, t * t * t);
            [
                0.5 * (-t + 2.0 * t2 - t3),
                0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
                0.5 * (t + 4.0 * t2 - 3.0 * t3),
                0.5 * (t3 - t2),
            ]
        };
        let (wx, wy) = (weights(f.x), weights(f.y));
        let (x, y) = (base.x as usize, base.y as usize);
        let mut sum = 0.0;
        for (dj, wj) in wy.into_iter().enumerate() {
            let row = (y + dj).saturating_sub(1).min(self.side - 1) * self.side;
            for (di, wi) in wx.into_iter().enumerate() {
                sum += wi * wj * f64::from(values[row + (x + di).saturating_sub(1).min(self.side - 1)]);
            }
        }
        sum
    }
}

/// Distance in samples from each true sample to the nearest false one, found by handing on the offset to it in two sweeps
/// (P.-E. Danielsson, "Euclidean distance mapping", 1980); 0 at false ones.
fn distances(inside: &[bool], side: usize) -> Vec<f32> {
    const FAR: i32 = 20_000;
    let length = |(x, y): (i32, i32)| x * x + y * y;
    let mut offsets: Vec<(i32, i32)> = inside.iter().map(|&i| if i { (FAR, FAR) } else { (0, 0) }).collect();
    let back: [(isize, isize); 4] = [(-1, 0), (0, -1), (-1, -1), (1, -1)];
    for sign in [1, -1] {
        for k in 0..side * side {
            let at = if sign == 1 { k } else { side * side - 1 - k };
            let (x, y) = (at % side, at / side);
            let mut best = offsets[at];
            for (dx, dy) in back {
                let (nx, ny) = (x.wrapping_add_signed(sign * dx), y.wrapping_add_signed(sign * dy));
                if nx < side && ny < side {
                    let (ox, oy) = offsets[ny * side + nx];
                    let through = (ox + (sign * dx) as i32, oy + (sign * dy) as i32);
                    if length(through) < length(best) {
                        best = through;
                    }
                }
            }
            offsets[at] = best;
        }
        // A second look along the rows reaches what lies on the other side.
        for k in 0..side * side {
            let at = if sign == 1 { side * side - 1 - k } else { k };
            let next = (at % side).wrapping_add_signed(sign);
            if next < side {
                let (ox, oy) = offsets[at - at % side + next];
                let through = (ox + sign as i32, oy);
                if length(through) < length(offsets[at]) {
                    offsets[at] = through;
                }
            }
        }
    }
    offsets.into_iter().map(|o| (length(o) as f32).sqrt()).collect()
}

/// Rounds the stairs of a grid by averaging each value with its neighbours.
fn rounded(values: &[f32], side: usize) -> Vec<f32> {
    let mean = |i: usize| {
        let (x, y) = (i % side, i / side);
        let (mut sum, mut count) = (0.0, 0.0);
        for r in y.saturating_sub(1)..(y + 2).min(side) {
            for c in x.saturating_sub(1)..(x + 2).min(side) {
                sum += values[r * side + c];
                count += 1.0;
            }
        }
        sum / count
    };
    (0..side * side).into_par_iter().map(mean).collect()
}

/// A smooth step from 0 at `from` to 1 at `to`, either way round.
fn smooth(from: f64, to: f64, at: f64) -> f64 {
    let t = ((at - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coast_has_all_that_it_promises() {
        let land = coast();
        let range = land.height_range();
        assert!((250.0..800.0).contains(&range.high), "hills of {} m", range.high);
        assert!((-120.0..-15.0).contains(&range.low), "a bed at {} m", range.low);
        let heights = land.raster().heights();
        let share = heights.iter().filter(|h| **h > 0.0).count() as f64 / heights.len() as f64;
        assert!((0.3..0.8).contains(&share), "{share} of it land");
        let steepest = (0..SAMPLES * SAMPLES - 1).map(|i| (heights[i + 1] - heights[i]).abs()).fold(0.0, f32::max);
        assert!(steepest > 5.0, "cliffs");
        assert!(land.height_at(view(UVec2::new(16, 9)).eye.truncate()).is_some_and(|h| h < 0.0), "seen from the sea");
        assert_eq!(land.raster(), coast().raster(), "equal bits on every run");
    }
}
