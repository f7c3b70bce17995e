//! Heights along a line, always from the full data.

use super::section::Line;
use crate::field::Land;
use glam::DVec2;

/// One point of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    /// Horizontal distance from the start (m).
    pub distance: f64,
    /// World position (m).
    pub position: DVec2,
    /// Height of the ground (m); `None` where void or outside the land.
    pub height: Option<f64>,
}

/// Where a profile has points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfilePoints {
    /// So many, evenly spaced, ends included; at least 2.
    Even(usize),
    /// The ends and wherever the line crosses a line between neighbouring samples, eastward or northward: between two
    /// such points the ground is one parabola.
    Crossings,
}

/// What a profile says about the ground below the whole line, whatever points were asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileSummary {
    /// Horizontal length of the line (m).
    pub distance: f64,
    /// The lowest point of the ground below the line, exactly; `None` if it is all void.
    pub lowest: Option<ProfilePoint>,
    /// The highest point, exactly.
    pub highest: Option<ProfilePoint>,
    /// Length (m) of the line over voids and outside the land.
    pub over_void: f64,
}

impl Land {
    /// Heights along the straight line between two world positions (m). `points` is overwritten. Lines may begin, end or
    /// run outside the land: there the height is `None`.
    ///
    /// # Panics
    /// If fewer than 2 even points are asked for.
    pub fn profile(
        &self,
        from: DVec2,
        to: DVec2,
        spacing: ProfilePoints,
        points: &mut Vec<ProfilePoint>,
    ) -> ProfileSummary {
        points.clear();
        let distance = (to - from).length();
        let at = |fraction: f64, height| ProfilePoint {
            distance: fraction * distance,
            position: if fraction == 1.0 { to } else { from + (to - from) * fraction },
            height,
        };
        if let ProfilePoints::Even(count) = spacing {
            assert!(count >= 2, "expected at least 2 points along a profile, got {count}");
            points.extend((0..count).map(|index| {
                let point = at(index as f64 / (count - 1) as f64, None);
                ProfilePoint { height: self.lattice_of(point.position).and_then(|p| self.ground_at(p)), ..point }
            }));
        }
        let crossings = spacing == ProfilePoints::Crossings;
        let mut summary = ProfileSummary { distance, lowest: None, highest: None, over_void: distance };
        let Some((enter, leave)) = self.clip(from, to) else {
            if crossings {
                points.extend([at(0.0, None), at(1.0, None)]);
            }
            return summary;
        };
        let clamped = |fraction: f64| {
            let last = DVec2::new((self.raster().columns() - 1) as f64, (self.raster().rows() - 1) as f64);
            let xy = if fraction == 1.0 { to } else { from + (to - from) * fraction };
            self.lattice_of(xy)
                .unwrap_or_else(|| ((xy - self.origin()) / self.raster().spacing()).clamp(DVec2::ZERO, last))
        };
        let line = Line::new(clamped(enter), clamped(leave));
        if crossings && enter > 0.0 {
            points.push(at(0.0, None));
        }
        let (mut lowest, mut highest) = (None::<(f64, f64)>, None::<(f64, f64)>);
        let mut known = 0.0;
        let strips = line.strips();
        for step in strips.clone() {
            let strip = if line.forward() { step } else { strips.start + strips.end - 1 - step };
            line.pieces(self, strip, |piece| {
                let whole = |fraction: f64| enter + (leave - enter) * fraction;
                let (start, end) = (whole(piece.from), whole(piece.to));
                if crossings {
                    let first = at(start, piece.ground.map(|ground| ground.start));
                    match points.last_mut() {
                        // Two pieces meet: known ground on either side makes the point known.
                        Some(last) if last.distance == first.distance => last.height = last.height.or(first.height),
                        _ => points.push(first),
                    }
                    if end > start {
                        points.push(at(end, piece.ground.map(|ground| ground.end)));
                    }
                }
                if let Some(ground) = piece.ground {
                    known += (end - start) * distance;
                    let place = |v: f64| start + (end - start) * v;
                    let (low, high) = (ground.lowest(), ground.highest());
                    if lowest.is_none_or(|(value, _)| low.0 < value) {
                        lowest = Some((low.0, place(low.1)));
                    }
                    if highest.is_none_or(|(value, _)| high.0 > value) {
                        highest = Some((high.0, place(high.1)));
                    }
                }
            });
        }
        if crossings && leave < 1.0 {
            points.push(at(1.0, None));
        }
        summary.lowest = lowest.map(|(height, fraction)| at(fraction, Some(height)));
        summary.highest = highest.map(|(height, fraction)| at(fraction, Some(height)));
        summary.over_void = (distance - known).max(0.0);
        summary
    }

    /// The part of a line that lies on the land, in fractions of it.
    fn clip(&self, from: DVec2, to: DVec2) -> Option<(f64, f64)> {
        if !(from.is_finite() && to.is_finite()) {
            return None;
        }
        let (low, high) = (self.origin(), self.origin() + self.extent());
        let by = to - from;
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            if by[axis] == 0.0 {
                if from[axis] < low[axis] || from[axis] > high[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low[axis] - from[axis]) / by[axis], (high[axis] - from[axis]) / by[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some((enter, leave))
    }
}
