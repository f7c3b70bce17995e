//! Lines of sight: whether two points above the ground see each other, by how much, and what is in the way.
//!
//! The ground below a straight line is a chain of parabolas (see [`super::section`]), and so is the distance between the
//! two; its minimum over each is known in closed form. A curved Earth under bent light is seen as a flat one whose ground
//! sinks with the square of the distance: light bends with k times the Earth's curvature, so that what remains is an Earth
//! of radius R/(1 − k). The sinking adds the same second-order term to every parabola: the answer stays exact.
//!
//! W. Torge, *Geodesy*, 4th ed. 2012, section 5.1: the coefficient of refraction.

use super::section::{Line, Parabola};
use crate::field::Land;
use glam::{DVec2, DVec3};
use std::cell::Cell;

/// How deep below the ground (m) a line of sight may pass and still count as free: a line that touches the ground is not
/// blocked. Heights are `f32`, whose steps are 0.5 mm at 8000 m: less would only measure rounding.
pub const GRAZE: f64 = 1e-3;

/// How many strips of a line are looked at before the others: more cost more than they spare.
const PROBES: i64 = 16;

/// A point some way above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// World position (m).
    pub position: DVec2,
    /// Height above the ground below it (m).
    pub above_ground: f64,
}

/// How the Earth falls away from a level line, and how far light bends after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// Radius of the Earth (m).
    pub radius: f64,
    /// Coefficient of refraction k: curvature of light over that of the Earth. 0 without air; below 1.
    pub refraction: f64,
}

impl Curvature {
    /// The Earth's mean radius and the refraction of an average clear day over land, k = 0.13 (Gauss).
    pub const EARTH: Curvature = Curvature { radius: 6_371_008.8, refraction: 0.13 };

    /// How far ground sinks below the level of an observer (m) at a horizontal distance (m): d²(1 − k)/(2R).
    pub fn drop(&self, distance: f64) -> f64 {
        self.per_square_metre() * distance * distance
    }

    /// Drop over squared distance (1/m).
    pub(super) fn per_square_metre(&self) -> f64 {
        (1.0 - self.refraction) / (2.0 * self.radius)
    }
}

/// What lies between two stations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Smallest vertical distance of the line above the ground (m), ends included: never more than the stations' heights
    /// above the ground, negative where the line runs below the ground.
    pub clearance: f64,
    /// Where that is: horizontal distance from the first station (m).
    pub clearance_distance: f64,
    /// Where the line first passes more than [`GRAZE`] below the ground; `None` when the stations see each other.
    pub blocked_at: Option<Obstacle>,
    /// Horizontal distance between the stations (m).
    pub distance: f64,
    /// Length of line (m) below which the ground is unknown. Voids do not block: an answer with voids is "as far as known".
    pub over_void: f64,
}

impl Sight {
    /// Whether the stations see each other.
    pub fn visible(&self) -> bool {
        self.blocked_at.is_none()
    }
}

/// The first point at which the ground is in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Horizontal distance from the first station (m).
    pub distance: f64,
    /// The point of the ground, in world coordinates (m).
    pub position: DVec3,
}

/// Why there is no line of sight to speak of.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SightError {
    /// A station stands outside the land.
    #[error("expected a position on the land, got ({}, {}) m, which is outside", .0.x, .0.y)]
    Outside(DVec2),
    /// A station stands where the ground is void, so that a height above it means nothing.
    #[error("expected a position with known ground, got ({}, {}) m, which is void", .0.x, .0.y)]
    Void(DVec2),
    /// A height, radius or curvature is not a number, or not one that makes sense.
    #[error("expected {0}, got {1}")]
    Number(&'static str, f64),
}

/// A line between two points above the land, in the land's lattice, ready to be compared with the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct SightLine {
    line: Line,
    /// Absolute height (m) of the first end, and how much higher the second appears than it.
    height: f64,
    rise: f64,
    /// Squared horizontal length (m²) times the curvature's drop per square metre: the drop (m) at the end.
    drop: f64,
}

impl SightLine {
    /// The line between two lattice points at absolute heights (m). `drop_per_square` is the curvature's (1/m).
    pub fn new(land: &Land, from: (DVec2, f64), to: (DVec2, f64), drop_per_square: f64) -> SightLine {
        let drop = ((to.0 - from.0) * land.raster().spacing()).length_squared() * drop_per_square;
        SightLine { line: Line::new(from.0, to.0), height: from.1, rise: to.1 - drop - from.1, drop }
    }

    /// The strips of the line, see [`Line::strips`].
    pub fn strips(&self) -> std::ops::Range<i64> {
        self.line.strips()
    }

    /// How far the line runs above the ground within a strip, piece by piece: start and end as fractions of the line,
    /// and the distance (m); `None` where void.
    #[inline]
    pub fn clearances(&self, land: &Land, strip: i64, mut visit: impl FnMut(f64, f64, Option<Parabola>)) {
        self.line.pieces(land, strip, |piece| {
            let above = |at: f64, ground: f64| self.height + self.rise * at + self.drop * at * at - ground;
            let run = piece.to - piece.from;
            let clearance = piece.ground.map(|ground| Parabola {
                start: above(piece.from, ground.start),
                end: above(piece.to, ground.end),
                bulge: -ground.bulge - self.drop * run * run,
            });
            visit(piece.from, piece.to, clearance);
        });
    }

    /// Whether the ground of a strip is in the way.
    #[inline]
    pub fn blocked_in(&self, land: &Land, strip: i64) -> bool {
        // Most strips lie well below the line.
        if self.lowest_over(strip, strip + 1) >= self.line.highest_sample(land, strip) {
            return false;
        }
        let mut blocked = false;
        self.clearances(land, strip, |_, _, clearance| {
            blocked |= clearance.is_some_and(|clearance| clearance.lowest().0 < -GRAZE);
        });
        blocked
    }

    /// Whether the ground is in the way anywhere between the strips `first` and `last` (not included). Looks first where
    /// the line ends, since what hides a point is most often close in front of it.
    pub fn blocked_between(&self, land: &Land, first: i64, last: i64) -> bool {
        let skip = |level, block| self.least_over(land, level, block) >= 0.0;
        self.line.walk(land, (first, last), false, skip, |strip| self.blocked_in(land, strip))
    }

    /// Whether the ground is in the way anywhere.
    pub fn blocked(&self, land: &Land) -> bool {
        let strips = self.line.strips();
        self.blocked_between(land, strips.start, strips.end)
    }

    /// A lower bound of the distance (m) between line and ground over a block of 2^`level` strips.
    fn least_over(&self, land: &Land, level: u32, block: i64) -> f64 {
        self.lowest_over(block << level, (block + 1) << level) - self.line.highest(land, level, block)
    }

    /// A lower bound of the line's height (m) over the strips from `first` up to `last` (not included).
    #[inline]
    fn lowest_over(&self, first: i64, last: i64) -> f64 {
        let (from, to) = self.line.fractions(first, last);
        self.height + (self.rise * from).min(self.rise * to) + self.drop * from * from
    }
}

impl Land {
    /// The lattice position of a station and the height (m) of the ground below it.
    pub(super) fn stand(&self, station: Station) -> Result<(DVec2, f64), SightError> {
        if !station.above_ground.is_finite() {
            return Err(SightError::Number("a finite height above the ground (m)", station.above_ground));
        }
        let lattice = self.lattice_of(station.position).ok_or(SightError::Outside(station.position))?;
        let ground = self.ground_at(lattice).ok_or(SightError::Void(station.position))?;
        Ok((lattice, ground))
    }

    /// The line of sight between two stations, against the exact surface of the full data. With `curvature` the ground
    /// sinks away as it does on the Earth under refracted light; without, the world is flat and light straight.
    ///
    /// A line that touches the ground, or dips at most [`GRAZE`] below it, is free. Two stations at one place see each
    /// other unless below the ground.
    ///
    /// # Errors
    /// If a station is outside the land or over a void, or a number is not finite.
    pub fn sight(&self, from: Station, to: Station, curvature: Option<Curvature>) -> Result<Sight, SightError> {
        let drop_per_square = drop_per_square(curvature)?;
        let (start, start_ground) = self.stand(from)?;
        let (end, end_ground) = self.stand(to)?;
        let ends = ((start, start_ground + from.above_ground), (end, end_ground + to.above_ground));
        let line = SightLine::new(self, ends.0, ends.1, drop_per_square);
        let distance = ((end - start) * self.raster().spacing()).length();

        let nearer_end =
            if to.above_ground < from.above_ground { (to.above_ground, 1.0) } else { (from.above_ground, 0.0) };
        let clearance = Cell::new(nearer_end);
        let blocked_at = Cell::new((from.above_ground < -GRAZE).then_some(0.0));
        let mut over_void = 0.0;
        let strips = line.strips();
        // Blocks that can neither lower the clearance nor hold the first obstacle are passed over. Voids are to be
        // measured, so that lands with voids are walked strip by strip.
        let known = !self.raster().voids().any();
        let skip = |level, block| {
            let matters = if blocked_at.get().is_some() { clearance.get().0 } else { clearance.get().0.max(-GRAZE) };
            known && line.least_over(self, level, block) >= matters
        };
        let lower = |from: f64, to: f64, piece: &Parabola| {
            let (lowest, v) = piece.lowest();
            if lowest < clearance.get().0 {
                clearance.set((lowest, from + (to - from) * v));
            }
            (lowest, v)
        };
        // A few strips looked at beforehand give a low clearance to begin with, below which most blocks do not reach.
        for probe in 0..PROBES {
            let strip = strips.start + (strips.end - strips.start) * (2 * probe + 1) / (2 * PROBES);
            line.clearances(self, strip, |from, to, piece| {
                piece.inspect(|piece| {
                    lower(from, to, piece);
                });
            });
        }
        line.line.walk(self, (strips.start, strips.end), true, skip, |strip| {
            line.clearances(self, strip, |from, to, piece| match piece {
                Some(piece) => {
                    let (lowest, v) = lower(from, to, &piece);
                    if blocked_at.get().is_none() && lowest < -GRAZE {
                        let v = piece.first_at_most(-GRAZE).unwrap_or(v);
                        blocked_at.set(Some(from + (to - from) * v));
                    }
                }
                None => over_void += (to - from) * distance,
            });
            false
        });
        let (clearance, clearance_fraction) = clearance.get();
        let blocked_at = blocked_at.get().or((to.above_ground < -GRAZE).then_some(1.0)).map(|fraction| {
            let lattice = start + (end - start) * fraction;
            let position = self.origin() + lattice * self.raster().spacing();
            let z = ends.0.1 + line.rise * fraction + line.drop * fraction * fraction;
            Obstacle { distance: fraction * distance, position: position.extend(z) }
        });
        Ok(Sight { clearance, clearance_distance: clearance_fraction * distance, blocked_at, distance, over_void })
    }
}

/// Drop over squared distance (1/m): 0 on a flat Earth.
pub(super) fn drop_per_square(curvature: Option<Curvature>) -> Result<f64, SightError> {
    let Some(curvature) = curvature else { return Ok(0.0) };
    if !(curvature.radius > 0.0 && curvature.radius.is_finite()) {
        return Err(SightError::Number("a positive radius of the Earth (m)", curvature.radius));
    }
    if !(curvature.refraction < 1.0 && curvature.refraction.is_finite()) {
        return Err(SightError::Number("a coefficient of refraction below 1", curvature.refraction));
    }
    Ok(curvature.per_square_metre())
}
