//! Paths through the air: a few points, and a flight through them that never touches the ground.
//!
//! A path's points are counted from the ground below them or from the datum, so that the same path can be flown lower,
//! higher or over edited ground. [`FlightPath::over`] resolves it over a ground: the points become a piecewise cubic curve —
//! straight lines, a Catmull–Rom spline or a cubic spline with continuous curvature — that is lifted where the ground
//! comes too near, and then run through by arc length, so that speed is what it says.
//!
//! The lift is smooth and safe by construction: what is missing to the clearance is sampled along the curve, widened by a
//! running maximum and then averaged over no more than it was widened by, which keeps every mean at or above each
//! original number; the result serves as the control points of a uniform cubic B-spline, which stays within the hull of
//! its neighbours. So the lifted path is as smooth as its interpolation (at most C²). A last comparison with the ground at
//! the exact position catches needles narrower than the sampling.
//!
//! Based on: E. Catmull, R. Rom, "A class of local interpolating splines", 1974; C. Yuksel, S. Schaefer, J. Keyser,
//! "Parameterization and applications of Catmull–Rom curves", 2011 (centripetal knots: no cusps, no loops within a
//! segment); E. T. Y. Lee, "Choosing nodes in parametric curve interpolation", 1989; C. de Boor, *A Practical Guide to
//! Splines*, 1978 (natural and periodic cubic splines).

mod curve;

use crate::field::HeightRange;
use curve::{Curve, Lengths, Lift};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// What a height is counted from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// Metres above the ground straight below: moves with the ground.
    AboveGround(f64),
    /// World z (m).
    Absolute(f64),
}

/// A position whose height may depend on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Where, in world coordinates (m).
    pub xy: DVec2,
    /// How high.
    pub level: Level,
}

/// Where the camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// Where the path goes: at the position some seconds ahead ([`FlightPath::look_ahead`]), so that corners are
    /// looked round before they are flown. With a pitch (rad, positive upward), only the bearing follows the path.
    Ahead {
        /// Fixed angle above the horizon (rad); `None` looks up and down with the path.
        pitch: Option<f64>,
    },
    /// A fixed direction.
    Heading {
        /// Compass bearing (rad), clockwise from north (+y).
        bearing: f64,
        /// Angle above the horizon (rad).
        pitch: f64,
    },
    /// At a fixed spot.
    At(Spot),
}

/// One point of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Where the path passes.
    pub spot: Spot,
    /// Where the camera looks there; between points one look turns smoothly into the next.
    pub look: Look,
}

/// How a path runs from point to point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines: continuous, with corners.
    Straight,
    /// Centripetal Catmull–Rom spline: continuous direction; each piece depends on four points only.
    CatmullRom,
    /// Cubic spline (natural at open ends): continuous direction and curvature.
    Smooth,
}

/// How fast a path is flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// Metres a second along the path.
    Speed(f64),
    /// Seconds for the whole path.
    Duration(f64),
}

/// A path before it meets a ground: what is saved and loaded.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightPath {
    /// The points, at least two (three when closed), no two neighbours at the same spot.
    pub points: Vec<Waypoint>,
    /// How the path runs between them.
    pub interpolation: Interpolation,
    /// Whether the last point leads back to the first.
    pub closed: bool,
    /// How fast; constant along the path but for [`FlightPath::ease`].
    pub pace: Pace,
    /// Seconds taken to gather speed at the start, and to lose it at the end; 0 for none.
    pub ease: f64,
    /// The path never comes nearer to the ground straight below it (m), between the points as well.
    pub clearance: f64,
    /// How many seconds ahead [`Look::Ahead`] looks.
    pub look_ahead: f64,
}

impl Default for FlightPath {
    /// No points; smooth, open, 60 m/s, two seconds of easing, at least 2 m above ground, looking two seconds ahead.
    fn default() -> FlightPath {
        FlightPath {
            points: Vec::new(),
            interpolation: Interpolation::Smooth,
            closed: false,
            pace: Pace::Speed(60.0),
            ease: 2.0,
            clearance: 2.0,
            look_ahead: 2.0,
        }
    }
}

/// Why points make no flight. Points are counted from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlightError {
    /// Too few points.
    #[error("expected at least {least} points, got {got}; add points")]
    TooFew {
        /// How many there must be.
        least: usize,
        /// How many there are.
        got: usize,
    },
    /// A number that is not finite, or not in its range.
    #[error("expected {expected}, got {got}; change it")]
    Number {
        /// What was expected.
        expected: &'static str,
        /// The number.
        got: f64,
    },
    /// A coordinate that is not finite.
    #[error("point {point}: expected finite coordinates, got NaN or infinity; change it")]
    NotFinite {
        /// Which point.
        point: usize,
    },
    /// Two neighbours in one spot.
    #[error("points {first} and {second}: expected different positions, got the same one; remove one of them")]
    Repeated {
        /// The earlier point.
        first: usize,
        /// The later point.
        second: usize,
    },
    /// Nothing to count a height from.
    #[error(
        "point {point}: expected ground below it to count its height from, got none (outside the data, or void); move it \
         or give it an absolute height"
    )]
    NoGround {
        /// Which point, or the point whose target it is.
        point: usize,
    },
}

/// Where the camera is and where it looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// World position (m).
    pub position: DVec3,
    /// Unit direction of view.
    pub direction: DVec3,
}

/// Ground heights (m) below world positions (m); `None` where there is none.
pub type Ground<'a> = &'a (dyn Fn(DVec2) -> Option<f64> + Sync);

/// A path resolved over a ground: ready to be flown.
#[derive(Clone)]
pub struct Flight<'a> {
    ground: Ground<'a>,
    clearance: f64,
    curve: Curve,
    looks: Vec<ResolvedLook>,
    lift: Lift,
    lengths: Lengths,
    closed: bool,
    duration: f64,
    ease: f64,
    gaze: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum ResolvedLook {
    Ahead(Option<f64>),
    Direction(DVec3),
    At(DVec3),
}

impl FlightPath {
    /// A closed circle of `radius` (m) about `centre`, at its height plus `above` (m), once round counter-clockwise from
    /// the south in `seconds`, always looking at the centre.
    pub fn orbit(centre: DVec3, radius: f64, above: f64, seconds: f64) -> FlightPath {
        // With 16 points the spline leaves the circle by less than a ten-thousandth of its radius.
        const POINTS: usize = 16;
        let target = Spot { xy: centre.truncate(), level: Level::Absolute(centre.z) };
        let points = (0..POINTS).map(|i| {
            let angle = TAU * i as f64 / POINTS as f64 - 0.5 * PI;
            let xy = centre.truncate() + radius * DVec2::from_angle(angle);
            Waypoint { spot: Spot { xy, level: Level::Absolute(centre.z + above) }, look: Look::At(target) }
        });
        FlightPath {
            points: points.collect(),
            closed: true,
            pace: Pace::Duration(seconds),
            ease: 0.0,
            ..FlightPath::default()
        }
    }

    /// The default orbit round a land whose south-western sample lies at `origin` and that covers `extent` (both m):
    /// round its middle, far enough and high enough to have all of it in a frame of 16:9 and a height of 36°.
    pub fn around(origin: DVec2, extent: DVec2, heights: HeightRange, seconds: f64) -> FlightPath {
        let (low, high) =
            if heights.is_empty() { (0.0, 0.0) } else { (f64::from(heights.low), f64::from(heights.high)) };
        let radius = 0.5 * extent.length();
        // The near half fills more of the frame than the far one: the middle of the frame is below that of the land.
        let centre = (origin + 0.5 * extent).extend(low + 0.4 * (high - low) - 0.22 * radius);
        FlightPath::orbit(centre, 1.85 * radius, 0.4 * (high - low) + 1.15 * radius, seconds)
    }

    /// The same path over ground whose heights are multiplied by `factor`: heights above ground and above sea level grow with it.
    pub fn stretched(mut self, factor: f64) -> FlightPath {
        let stretch = |spot: &mut Spot| {
            let (Level::AboveGround(z) | Level::Absolute(z)) = &mut spot.level;
            *z *= factor;
        };
        for point in &mut self.points {
            stretch(&mut point.spot);
            if let Look::At(spot) = &mut point.look {
                stretch(spot);
            }
        }
        self
    }

    /// Resolves the path over a ground.
    ///
    /// Points that have their clearance are passed through exactly, unless ground within about a second of flight
    /// forces the path up.
    ///
    /// # Errors
    /// If there are too few points, neighbours coincide, a number is out of its range, or a height is counted from a
    /// ground that is not there.
    pub fn over<'a>(&self, ground: Ground<'a>) -> Result<Flight<'a>, FlightError> {
        self.check()?;
        let resolve = |spot: Spot, point: usize| match spot.level {
            Level::Absolute(z) => Ok(spot.xy.extend(z)),
            Level::AboveGround(above) => {
                let below = ground(spot.xy).ok_or(FlightError::NoGround { point })?;
                Ok(spot.xy.extend(below + above))
            }
        };
        let mut positions = Vec::with_capacity(self.points.len() + 1);
        let mut looks = Vec::with_capacity(self.points.len() + 1);
        for (i, point) in self.points.iter().enumerate() {
            positions.push(resolve(point.spot, i + 1)?);
            looks.push(match point.look {
                Look::Ahead { pitch } => ResolvedLook::Ahead(pitch),
                Look::Heading { bearing, pitch } => ResolvedLook::Direction(direction(bearing, pitch)),
                Look::At(spot) => ResolvedLook::At(resolve(spot, i + 1)?),
            });
        }
        if self.closed {
            positions.push(positions[0]);
            looks.push(looks[0]);
        }
        for (i, pair) in positions.windows(2).enumerate() {
            if (pair[1] - pair[0]).length() < 1e-6 {
                return Err(FlightError::Repeated { first: i + 1, second: (i + 1) % self.points.len() + 1 });
            }
        }

        let curve = Curve::through(&positions, self.interpolation, self.closed);
        let mut lengths = Lengths::of(&curve, &Lift::none(&curve));
        let (mut duration, ease) = self.timing(lengths.total());
        let lift = Lift::over(&curve, ground, self.clearance, self.closed, duration);
        if lift.any() {
            lengths = Lengths::of(&curve, &lift);
            duration = self.timing(lengths.total()).0;
        }
        let gaze = self.look_ahead * lengths.total() / (duration - ease);
        let (clearance, closed) = (self.clearance, self.closed);
        Ok(Flight { ground, clearance, curve, looks, lift, lengths, closed, duration, ease, gaze })
    }

    fn check(&self) -> Result<(), FlightError> {
        let least = if self.closed { 3 } else { 2 };
        if self.points.len() < least {
            return Err(FlightError::TooFew { least, got: self.points.len() });
        }
        let positive = |expected, got: f64| match got.is_finite() && got > 0.0 {
            true => Ok(()),
            false => Err(FlightError::Number { expected, got }),
        };
        match self.pace {
            Pace::Speed(speed) => positive("a positive speed (m/s)", speed)?,
            Pace::Duration(seconds) => positive("a positive duration (s)", seconds)?,
        }
        for (expected, got) in [
            ("an ease of 0 s or more", self.ease),
            ("a clearance of 0 m or more", self.clearance),
            ("to look 0 s or more ahead", self.look_ahead),
        ] {
            if !(got.is_finite() && got >= 0.0) {
                return Err(FlightError::Number { expected, got });
            }
        }
        let finite = |spot: Spot| {
            let (Level::Absolute(z) | Level::AboveGround(z)) = spot.level;
            spot.xy.is_finite() && z.is_finite()
        };
        for (i, point) in self.points.iter().enumerate() {
            let look = match point.look {
                Look::Ahead { pitch } => pitch.is_none_or(f64::is_finite),
                Look::Heading { bearing, pitch } => bearing.is_finite() && pitch.is_finite(),
                Look::At(spot) => finite(spot),
            };
            if !(finite(point.spot) && look) {
                return Err(FlightError::NotFinite { point: i + 1 });
            }
        }
        Ok(())
    }

    /// Duration and easing time (s) of a path of this length (m). Easing over e seconds costs e/2 at each end.
    fn timing(&self, length: f64) -> (f64, f64) {
        match self.pace {
            // Too short a path to reach its speed is eased for as long as it would take without easing.
            Pace::Speed(speed) => {
                let ease = self.ease.min(length / speed);
                (length / speed + ease, ease)
            }
            Pace::Duration(seconds) => (seconds, self.ease.min(0.5 * seconds)),
        }
    }
}

impl Flight<'_> {
    /// How long the flight takes (s).
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// How long the path is (m), lifts over the ground included.
    pub fn length(&self) -> f64 {
        self.lengths.total()
    }

    /// Metres flown after `time` (s): constant speed between the eased ends. Times outside the flight count as its ends.
    pub fn distance(&self, time: f64) -> f64 {
        let (ease, duration) = (self.ease, self.duration);
        let time = time.clamp(0.0, duration);
        let speed = self.lengths.total() / (duration - ease);
        // Speed grows as smoothstep 3x² − 2x³, whose integral is x³ − x⁴/2.
        let gather = |t: f64| {
            let x = t / ease;
            speed * ease * (x * x * x - 0.5 * x * x * x * x)
        };
        if time < ease {
            gather(time)
        } else if time > duration - ease {
            self.lengths.total() - gather(duration - time)
        } else {
            speed * (time - 0.5 * ease)
        }
    }

    /// Where the camera is and where it looks after `time` (s). Any time, in any order; before the start and after the
    /// end it rests there (on closed paths without easing it goes round and round).
    pub fn pose(&self, time: f64) -> Pose {
        let time = if self.closed && self.ease == 0.0 { time.rem_euclid(self.duration) } else { time };
        let distance = self.distance(time);
        let at = self.lengths.parameter(distance, &self.curve, &self.lift);
        let mut position = self.on_curve(at);
        if let Some(ground) = (self.ground)(position.truncate()) {
            position.z = position.z.max(ground + self.clearance);
        }
        Pose { position, direction: self.look(distance, at, position) }
    }

    fn on_curve(&self, at: f64) -> DVec3 {
        let mut position = self.curve.position(at);
        position.z += self.lift.value(at).0;
        position
    }

    fn tangent(&self, at: f64) -> DVec3 {
        let mut tangent = self.curve.derivative(at);
        tangent.z += self.lift.value(at).1;
        tangent.normalize_or(DVec3::Y)
    }

    fn look(&self, distance: f64, at: f64, position: DVec3) -> DVec3 {
        let (segment, fraction) = self.curve.segment(at);
        let (from, to) = (self.looks[segment], self.looks[segment + 1]);
        let resolve = |look| match look {
            ResolvedLook::Direction(direction) => direction,
            ResolvedLook::At(target) => (target - position).try_normalize().unwrap_or_else(|| self.tangent(at)),
            ResolvedLook::Ahead(pitch) => {
                let ahead = self.ahead(distance, position).try_normalize().unwrap_or_else(|| self.tangent(at));
                match pitch {
                    Some(pitch) => {
                        let level = ahead.truncate().normalize_or(DVec2::Y);
                        (level * pitch.cos()).extend(pitch.sin())
                    }
                    None => ahead,
                }
            }
        };
        if from == to {
            return resolve(from);
        }
        // Smootherstep: the turn starts and ends without a jerk.
        let x = fraction;
        turned(resolve(from), resolve(to), x * x * x * (10.0 + x * (6.0 * x - 15.0)))
    }

    /// From `position` to where the path will be, beyond its end straight on.
    fn ahead(&self, distance: f64, position: DVec3) -> DVec3 {
        let (then, total) = (distance + self.gaze, self.lengths.total());
        let parameter = |distance| self.lengths.parameter(distance, &self.curve, &self.lift);
        if self.closed {
            self.on_curve(parameter(then.rem_euclid(total))) - position
        } else if then > total {
            let end = self.curve.end();
            self.on_curve(end) + self.tangent(end) * (then - total) - position
        } else {
            self.on_curve(parameter(then)) - position
        }
    }
}

/// The unit vector of a compass bearing and a pitch (rad).
fn direction(bearing: f64, pitch: f64) -> DVec3 {
    DVec3::new(bearing.sin() * pitch.cos(), bearing.cos() * pitch.cos(), pitch.sin())
}

/// `from` turned towards `to` by a `share` of the angle between them (spherical interpolation). Opposite directions are
/// turned through the horizon rather than over the top.
fn turned(from: DVec3, to: DVec3, share: f64) -> DVec3 {
    let across = from.cross(to);
    let angle = across.length().atan2(from.dot(to));
    let axis = across.try_normalize().or_else(|| from.cross(DVec3::Z).cross(from).try_normalize()).unwrap_or(DVec3::X);
    let (sin, cos) = (share * angle).sin_cos();
    (from * cos + axis.cross(from) * sin).normalize()
}

#[cfg(test)]
mod tests;
