//! What may make a triangle matter more or less than its error or distance tells.
//!
//! Each factor is *nested* as bounds are: that of a diamond is never below that of one that needs it. A box within another is no nearer to the eye,
//! touches no more discs, and its slopes are among the other's; so what all faces away within the larger does within the smaller, and what may be a
//! silhouette in the smaller may be one in the larger. So the product with a nested priority is nested, and the queues stay optimal: no factor is
//! a mere heuristic in the order of steps, though how much each is worth is a matter of taste.
//!
//! Works this rests on: M. Duchaineau et al., "ROAMing terrain: real-time optimally adapting meshes", 1997 (the list of factors); spec page of 1999.

use super::scan::{Extent, Item};
use glam::DVec2;

/// Factors of priority; by default all are off. With any of them on, priorities are no pixels any more but weighed pixels, and it is those that the
/// tolerance ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Factors {
    /// What is seen through fog, rain or dusk: priority falls by e every so many metres from the eye, above 0; infinite for clear air.
    pub fog: f32,
    /// Multiplies what faces away from the eye as a whole, from 0 to 1. Needs [`super::NestedBounds::with_slopes`].
    pub back_faces: f32,
    /// Multiplies what may be a silhouette: where some faces towards the eye and some away, from 1. Needs slopes, too.
    pub silhouettes: f32,
    /// Raises what is lit unevenly: one more for each unit that slopes differ by, from 0. Needs slopes, too.
    pub lighting: f32,
    /// Places that ask for detail, such as what stands or floats there.
    pub objects: Vec<Disc>,
}

/// A place that asks for detail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its middle (m, world).
    pub centre: DVec2,
    /// Its radius (m).
    pub radius: f32,
    /// Multiplies what touches it, from 1.
    pub factor: f32,
}

impl Default for Factors {
    fn default() -> Factors {
        Factors { fog: f32::INFINITY, back_faces: 1.0, silhouettes: 1.0, lighting: 0.0, objects: Vec::new() }
    }
}

/// The factors in one view.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    /// Powers of e a metre, over [`ROOTS`].
    fog: f32,
    back_faces: f32,
    silhouettes: f32,
    lighting: f32,
    /// Middles from the eye and radii (m), and factors.
    discs: Vec<[f32; 4]>,
}

/// (1 − x/n)ⁿ for the exponential: by squaring, each step of which is monotone under rounding. Half a per cent too low at most, where it matters least.
const ROOTS: f32 = 64.0;

impl Weights {
    /// What of the factors is on, if any; numbers out of range count as the nearest within.
    pub(super) fn new(factors: &Factors, eye: DVec2) -> Option<Weights> {
        if *factors == Factors::default() {
            return None;
        }
        let within = |number: f32, low: f32, high: f32| if number.is_nan() { low } else { number.clamp(low, high) };
        let disc = |disc: &Disc| {
            let [x, y] = (disc.centre - eye).as_vec2().to_array();
            [x, y, within(disc.radius, 0.0, f32::MAX), within(disc.factor, 1.0, 1e6)]
        };
        Some(Weights {
            fog: if factors.fog > 0.0 { 1.0 / (factors.fog * ROOTS) } else { 0.0 },
            back_faces: if factors.back_faces.is_nan() { 1.0 } else { factors.back_faces.clamp(0.0, 1.0) },
            silhouettes: within(factors.silhouettes, 1.0, 1e6),
            lighting: within(factors.lighting, 0.0, 1e6),
            discs: factors.objects.iter().map(disc).collect(),
        })
    }

    /// The factor of a diamond.
    pub(super) fn of(&self, extent: &Extent, slopes: Slopes) -> f32 {
        let [[x0, x1], [y0, y1], [z0, z1]] = extent.0;
        let gap = |a: f32, b: f32| a.max(-b).max(0.0);
        let (gx, gy, gz) = (gap(x0, x1), gap(y0, y1), gap(z0, z1));
        let distance = (gx * gx + gy * gy + gz * gz).sqrt();
        let mut factor = (1.0 - distance * self.fog).max(0.0);
        (0..6).for_each(|_| factor *= factor);
        let mut most = 1.0f32;
        for &[x, y, radius, disc] in &self.discs {
            let (dx, dy) = ((x0 - x).max(x - x1).max(0.0), (y0 - y).max(y - y1).max(0.0));
            if dx * dx + dy * dy <= radius * radius {
                most = most.max(disc);
            }
        }
        factor *= most;
        let Some([sx, sy]) = slopes.ranges() else { return factor };
        let products = |s: [f32; 2], x: [f32; 2]| {
            let all = [s[0] * x[0], s[0] * x[1], s[1] * x[0], s[1] * x[1]];
            [all.into_iter().fold(f32::INFINITY, f32::min), all.into_iter().fold(f32::NEG_INFINITY, f32::max)]
        };
        // How much the normal (−sx, −sy, 1) points to the eye: least and most.
        let (x, y) = (products(sx, [x0, x1]), products(sy, [y0, y1]));
        let (least, greatest) = (x[0] + y[0] - z1, x[1] + y[1] - z0);
        if greatest < 0.0 {
            factor *= self.back_faces;
        } else if least <= 0.0 {
            factor *= self.silhouettes;
        }
        factor * (1.0 + self.lighting * ((sx[1] - sx[0]) + (sy[1] - sy[0])).min(16.0))
    }

    /// Multiplies priorities by factors; of slopes there are as many, or none.
    pub(super) fn weigh(&self, extent: impl Fn(&Item) -> Extent, items: &[Item], slopes: &[Slopes], out: &mut [f32]) {
        let slopes = slopes.iter().copied().chain(std::iter::repeat(Slopes::EMPTY));
        for ((item, slopes), out) in items.iter().zip(slopes).zip(out) {
            // What is not there has no number, what is not seen none that a factor changes.
            if out.abs() > 0.0 {
                *out *= self.of(&extent(item), slopes);
            }
        }
    }
}

/// The range of slopes of a piece of surface, outward to sixteenths: least eastward and northward, greatest eastward and northward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slopes([i8; 4]);

impl Slopes {
    /// Of nothing: the neutral element of [`Slopes::union`].
    pub(super) const EMPTY: Slopes = Slopes([i8::MAX, i8::MAX, i8::MIN, i8::MIN]);

    /// Of two slopes in each direction.
    pub(super) fn of(east: [f32; 2], north: [f32; 2]) -> Slopes {
        let down = |s: [f32; 2]| (s[0].min(s[1]) * 16.0).floor() as i8;
        let up = |s: [f32; 2]| (s[0].max(s[1]) * 16.0).ceil() as i8;
        Slopes([down(east), down(north), up(east), up(north)])
    }

    pub(super) fn union(self, other: Slopes) -> Slopes {
        let (a, b) = (self.0, other.0);
        Slopes([a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])])
    }

    /// Slopes eastward and northward; those at the end of the scale may be any steeper. `None` for those of nothing.
    fn ranges(self) -> Option<[[f32; 2]; 2]> {
        let number = |s: i8| match s {
            i8::MIN => -1e6,
            i8::MAX => 1e6,
            s => f32::from(s) / 16.0,
        };
        let [a, b, c, d] = self.0;
        (a <= c && b <= d).then(|| [[number(a), number(c)], [number(b), number(d)]])
    }
}
