//! Keeps frames within a budget of time: slower ones make the triangles coarser, quicker ones finer.
//!
//! Triangles grow about with the inverse square of the tolerance where ground is rough, and more slowly elsewhere; so a tolerance that follows the square root of the
//! time nears the budget without passing it. Between four fifths of the budget and a little above it nothing changes. Where a finer tolerance proved too slow,
//! the next try waits twice as long as the last one (screens that show frames in steps of their own would make it go to and fro for ever).

use std::ops::RangeInclusive;

/// Steers the tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct Steering {
    tolerance: f64,
    times: Vec<f32>,
    /// Whether the last change was to a finer tolerance.
    refined: bool,
    /// How many more measurements go by before the next try of a finer tolerance, and how many will after a failed one.
    waits: u32,
    patience: u32,
    /// Whether the coarsest tolerance is still too slow.
    pub short: bool,
}

/// Within which tolerances (pixels) it stays.
pub const RANGE: RangeInclusive<f64> = 0.25..=20.0;
/// So many frames are one measurement, their median: a stall or two do not count.
const FRAMES: usize = 9;
/// Shares of the budget between which nothing changes, and what is aimed at otherwise.
const QUICK: f64 = 0.8;
const SLOW: f64 = 1.05;
const AIM: f64 = 0.92;
/// The longest patience (measurements).
const LONGEST: u32 = 64;

impl Steering {
    /// Begins at a tolerance (pixels).
    pub fn at(tolerance: f64) -> Steering {
        let tolerance = tolerance.clamp(*RANGE.start(), *RANGE.end());
        Steering { tolerance, times: Vec::new(), refined: false, waits: 0, patience: 1, short: false }
    }

    /// The tolerance now (pixels).
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// A frame took so long (ms), with triangles of the tolerance of now.
    pub fn frame(&mut self, milliseconds: f64, budget: f64) {
        self.times.push(milliseconds as f32);
        if self.times.len() < FRAMES {
            return;
        }
        let load = f64::from(crate::cockpit::median(self.times.drain(..))) / budget;
        if load > SLOW {
            self.patience = if self.refined { (2 * self.patience).min(LONGEST) } else { 1 };
            (self.refined, self.waits) = (false, self.patience);
            self.short = self.tolerance >= *RANGE.end();
            self.scale((load / AIM).sqrt().min(2.0));
        } else {
            self.short = false;
            if load >= QUICK {
                self.refined = false;
            } else if self.waits > 0 {
                (self.refined, self.waits) = (false, self.waits - 1);
            } else if self.tolerance > *RANGE.start() {
                self.refined = true;
                self.scale((load / AIM).sqrt().max(0.7));
            }
        }
    }

    fn scale(&mut self, factor: f64) {
        self.tolerance = (self.tolerance * factor).clamp(*RANGE.start(), *RANGE.end());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flies so many frames whose time follows the tolerance: the tolerances in use.
    fn fly(steering: &mut Steering, frames: usize, budget: f64, mut time: impl FnMut(f64, usize) -> f64) -> Vec<f64> {
        let mut used = Vec::new();
        for i in 0..frames {
            used.push(steering.tolerance());
            steering.frame(time(steering.tolerance(), i), budget);
        }
        used
    }

    /// How often a course turns round.
    fn turns(course: &[f64]) -> usize {
        let mut steps: Vec<f64> = course.windows(2).map(|w| w[1] - w[0]).filter(|step| *step != 0.0).collect();
        steps.dedup_by(|a, b| a.signum() == b.signum());
        steps.len().saturating_sub(1)
    }

    #[test]
    fn whatever_triangles_cost_the_budget_is_met_and_kept() {
        for power in [0.8, 1.0, 1.5, 2.0] {
            for fixed in [0.0, 4.0, 12.0] {
                for start in [0.3, 1.0, 15.0] {
                    let time = |tolerance: f64, i: usize| {
                        // Every tenth frame stalls, and all of them tremble.
                        let tremble = 1.0 + 0.04 * ((i * 7919 % 13) as f64 / 6.0 - 1.0);
                        let stall = if i % 10 == 3 { 30.0 } else { 0.0 };
                        (fixed + 20.0 * tolerance.powf(-power)) * tremble + stall
                    };
                    let mut steering = Steering::at(start);
                    fly(&mut steering, 600, 20.0, time);
                    let kept = fly(&mut steering, 900, 20.0, time);
                    let end = *kept.last().expect("frames");
                    let load = (fixed + 20.0 * end.powf(-power)) / 20.0;
                    assert!((0.75..1.1).contains(&load), "power {power}, fixed {fixed}, from {start}: {load}");
                    assert!(
                        turns(&kept) <= 1,
                        "power {power}, fixed {fixed}, from {start}: to and fro {}",
                        turns(&kept)
                    );
                }
            }
        }
    }

    #[test]
    fn a_heavier_view_is_met_within_seconds() {
        let mut steering = Steering::at(1.0);
        fly(&mut steering, 300, 20.0, |t, _| 16.0 / t);
        let before = steering.tolerance();
        let course = fly(&mut steering, 90, 20.0, |t, _| 64.0 / t);
        assert!(64.0 / course.last().expect("frames") < 22.0 && steering.tolerance() > 2.5 * before, "{course:?}");
        // And back.
        fly(&mut steering, 400, 20.0, |t, _| 16.0 / t);
        assert!(steering.tolerance() < 1.2 * before);
    }

    #[test]
    fn a_screen_that_counts_in_steps_of_its_own_does_not_make_it_swing() {
        let steps = |t: f64, _| (12.0 / t / 16.7).ceil().max(1.0) * 16.7;
        let mut steering = Steering::at(1.0);
        let course = fly(&mut steering, 6000, 25.0, steps);
        assert!(turns(&course[..600]) > turns(&course[5400..]), "tries grow rare");
        let missed = course[3000..].iter().filter(|t| steps(**t, 0) > 26.0).count();
        assert!(missed < 150, "{missed} of 3000 frames too slow");
        // Within its band, nothing moves at all.
        let mut steering = Steering::at(1.0);
        let course = fly(&mut steering, 1000, 20.0, |_, _| 16.7);
        assert_eq!(turns(&course), 0);
        assert_eq!(course.last(), Some(&1.0));
    }

    #[test]
    fn what_triangles_cannot_help_is_said() {
        let mut steering = Steering::at(1.0);
        fly(&mut steering, 400, 10.0, |_, _| 50.0);
        assert!(steering.short && steering.tolerance() == *RANGE.end());
        fly(&mut steering, 400, 100.0, |_, _| 50.0);
        assert!(!steering.short && steering.tolerance() == *RANGE.start());
    }
}
