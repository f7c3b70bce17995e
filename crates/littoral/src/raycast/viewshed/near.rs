//! The first rings around the eye, where a step of one sample is a large part of the distance: in double precision and
//! finer steps.

use super::Scene;
use super::frame::{Frame, NOTHING};
use super::sweep::{BINS, Bins};
use crate::raycast::GRAZE;

/// How many rings are near.
pub(super) const NEAR: i64 = 4;

/// The horizon over the near rings for the bins between neighbouring directions of `edges`.
pub(super) fn near_horizon(scene: &Scene, frame: &Frame, edges: &[f64; BINS + 1]) -> Bins {
    let mut bins = Bins::open();
    for bin in 0..BINS {
        let (left, right) = (edges[bin], edges[bin + 1]);
        let mut horizon = Horizon::default();
        for ring in 1..=NEAR.min(frame.rings) {
            let strip = Strip { scene, frame, ring };
            let end = frame.distance(ring);
            let start = (end - 1.0).max(0.0);
            // Steps that double from the eye outward, then quarters of a sample.
            let cuts: &[f64] = if ring == 1 {
                &[1.0 / 128.0, 1.0 / 64.0, 1.0 / 32.0, 1.0 / 16.0, 0.125, 0.25, 0.5, 1.0]
            } else {
                &[0.25, 0.5, 0.75, 1.0]
            };
            let mut before = start;
            for cut in cuts {
                let at = if ring == 1 { end * cut } else { start + cut };
                strip.raise(&mut horizon, left, right, before, at);
                before = at;
            }
        }
        // Rounded outward: what is stored stays a bound.
        let up = |value: f64| (value + value.abs() * 2e-7) as f32;
        let down = |value: f64| (value - value.abs() * 2e-7) as f32;
        for side in 0..2 {
            bins.upper[bin + side] = bins.upper[bin + side].max(up(horizon.upper[side]));
            bins.last[bin + side] = bins.last[bin + side].max(up(horizon.last[side]));
        }
        bins.lower_left[bin] = down(horizon.lower[0]);
        bins.lower_right[bin] = down(horizon.lower[1]);
    }
    bins.settle();
    bins
}

/// Bounds of the steepest slope seen so far, at both edges of a bin (see the head of the parent module).
struct Horizon {
    upper: [f64; 2],
    lower: [f64; 2],
    last: [f64; 2],
}

impl Default for Horizon {
    fn default() -> Horizon {
        Horizon { upper: [f64::from(NOTHING); 2], lower: [f64::from(NOTHING); 2], last: [f64::from(NOTHING); 2] }
    }
}

/// The strip between two rings.
struct Strip<'a> {
    scene: &'a Scene<'a>,
    frame: &'a Frame,
    ring: i64,
}

impl Strip<'_> {
    /// Height relative to the eye of a sample on one of the strip's two rings, and whether it is known.
    fn sample(&self, ring: i64, minor: i64) -> (f64, bool) {
        let (scene, frame) = (self.scene, self.frame);
        let minor = minor.clamp(0, frame.minors - 1);
        let major = frame.major(ring).clamp(0, frame.majors - 1);
        let raster = scene.land.raster();
        let index = frame.index(major, minor);
        let along = frame.distance(ring) * frame.spacing_major;
        let aside = (minor as f64 - frame.eye_minor) * frame.spacing_minor;
        let drop = scene.drop_per_square * (along * along + aside * aside);
        (f64::from(raster.heights()[index]) - scene.eye_height - drop, !raster.voids().is_void(index))
    }

    /// Height relative to the eye on the line at distance `at` from the eye, at a lattice line of the minor axis.
    fn profile(&self, at: f64, minor: i64) -> f64 {
        let q = at + 1.0 - self.frame.distance(self.ring);
        self.sample(self.ring - 1, minor).0 * (1.0 - q) + self.sample(self.ring, minor).0 * q
    }

    /// Raises the horizon of the bin between the directions `left` and `right` over the ground at distances from `near`
    /// to `far`.
    fn raise(&self, horizon: &mut Horizon, left: f64, right: f64, near: f64, far: f64) {
        let (frame, scene) = (self.frame, self.scene);
        let width = (right - left) * far;
        let (y_left, y_right) = (frame.eye_minor + left * far, frame.eye_minor + right * far);
        let lerp = |y: f64| {
            let base = y.floor();
            let (a, b) = (self.profile(far, base as i64), self.profile(far, base as i64 + 1));
            (a + (b - a) * (y - base), b - a)
        };
        let ((h_left, step_left), (h_right, step_right)) = (lerp(y_left), lerp(y_right));
        let tent = (step_left - step_right) * (y_left.floor() + 1.0 - y_left) * (y_right - y_right.floor()) / width;
        let tent = if y_left.floor() == y_right.floor() { 0.0 } else { tent };

        // Steepest steps along the two lines where rays of this bin pass.
        let at_near = [frame.eye_minor + left * near, frame.eye_minor + right * near];
        let low = at_near[0].min(at_near[1]).min(y_left).floor() as i64;
        let high = at_near[0].max(at_near[1]).max(y_right).floor() as i64;
        let mut known = true;
        let (mut near_steps, mut far_steps) = ((f64::INFINITY, f64::NEG_INFINITY), (f64::INFINITY, f64::NEG_INFINITY));
        for minor in low..=high {
            let near_step = self.profile(near, minor + 1) - self.profile(near, minor);
            let far_step = self.profile(far, minor + 1) - self.profile(far, minor);
            near_steps = (near_steps.0.min(near_step), near_steps.1.max(near_step));
            far_steps = (far_steps.0.min(far_step), far_steps.1.max(far_step));
            for ring in [self.ring - 1, self.ring] {
                known &= self.sample(ring, minor).1 && self.sample(ring, minor + 1).1;
            }
        }
        let aside = left.abs().max(right.abs());
        let twist = if left + right >= 0.0 { near_steps.1 - far_steps.0 } else { far_steps.1 - near_steps.0 };
        let bulge = (aside * (far - near) * twist).max(0.0);

        let margin = scene.sag + 1e-9 * (1.0 + h_left.abs() + h_right.abs());
        for (side, height) in [h_left, h_right].into_iter().enumerate() {
            let here = (height + tent.max(0.0) + margin - GRAZE) / far;
            let above = scene.above_ground.max(0.0);
            let before = horizon.last[side];
            let (peak, excess) = if near == 0.0 {
                (here, (bulge.sqrt() - above.sqrt()).max(0.0).powi(2) / far)
            } else {
                let rest = (bulge - (here - before).abs() * near).max(0.0);
                (here.max(before), if rest > 0.0 { rest * rest / (4.0 * bulge * near) } else { 0.0 })
            };
            horizon.upper[side] = horizon.upper[side].max(peak + excess);
            horizon.last[side] = here;
        }
        let lower = [h_left, h_right].map(|height| (height + tent.min(0.0) - margin - GRAZE) / far);
        if known && lower[0] + lower[1] > horizon.lower[0] + horizon.lower[1] {
            horizon.lower = lower;
        }
    }
}
