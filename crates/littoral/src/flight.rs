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

use crate::field::HeightRange;
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
    /// round its middle, near enough to see relief and high enough to see all of it.
    pub fn around(origin: DVec2, extent: DVec2, heights: HeightRange, seconds: f64) -> FlightPath {
        let (low, high) =
            if heights.is_empty() { (0.0, 0.0) } else { (f64::from(heights.low), f64::from(heights.high)) };
        let radius = 0.5 * extent.length();
        let centre = (origin + 0.5 * extent).extend(low + 0.4 * (high - low));
        FlightPath::orbit(centre, radius, (high - centre.z) + 0.32 * radius, seconds)
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

/// A piecewise cubic over increasing knots.
#[derive(Clone, Debug)]
struct Curve {
    knots: Vec<f64>,
    /// For each piece the powers of (t − its first knot).
    pieces: Vec<[DVec3; 4]>,
}

impl Curve {
    /// Through all `points`; for a closed curve the last is the first again.
    fn through(points: &[DVec3], interpolation: Interpolation, closed: bool) -> Curve {
        let mut knots = vec![0.0];
        for (i, pair) in points.windows(2).enumerate() {
            knots.push(knots[i] + (pair[1] - pair[0]).length().sqrt()); // centripetal
        }
        let spans: Vec<f64> = knots.windows(2).map(|k| k[1] - k[0]).collect();
        let slopes: Vec<DVec3> = points.windows(2).zip(&spans).map(|(p, h)| (p[1] - p[0]) / h).collect();
        let hermite = |tangents: &[DVec3]| {
            let piece = |i: usize| {
                let (h, s, a, b) = (spans[i], slopes[i], tangents[i], tangents[i + 1]);
                [points[i], a, (3.0 * s - 2.0 * a - b) / h, (a + b - 2.0 * s) / (h * h)]
            };
            (0..spans.len()).map(piece).collect()
        };
        let pieces = match interpolation {
            Interpolation::Straight => {
                points.iter().zip(&slopes).map(|(&p, &s)| [p, s, DVec3::ZERO, DVec3::ZERO]).collect()
            }
            Interpolation::CatmullRom => hermite(&catmull_rom_tangents(&spans, &slopes, closed)),
            Interpolation::Smooth => hermite(&spline_tangents(&spans, &slopes, closed)),
        };
        Curve { knots, pieces }
    }

    fn end(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// The piece a parameter falls into, and how far through it (0 to 1).
    fn segment(&self, at: f64) -> (usize, f64) {
        let segment = self.knots.partition_point(|&k| k <= at).clamp(1, self.pieces.len()) - 1;
        let (from, to) = (self.knots[segment], self.knots[segment + 1]);
        (segment, ((at - from) / (to - from)).clamp(0.0, 1.0))
    }

    fn position(&self, at: f64) -> DVec3 {
        let (segment, _) = self.segment(at);
        let ([a, b, c, d], t) = (self.pieces[segment], at - self.knots[segment]);
        a + t * (b + t * (c + t * d))
    }

    fn derivative(&self, at: f64) -> DVec3 {
        let (segment, _) = self.segment(at);
        let ([_, b, c, d], t) = (self.pieces[segment], at - self.knots[segment]);
        b + t * (2.0 * c + t * 3.0 * d)
    }
}

/// The derivative at each point of the parabola through it and its neighbours; at open ends as if the curve went on
/// mirrored.
fn catmull_rom_tangents(spans: &[f64], slopes: &[DVec3], closed: bool) -> Vec<DVec3> {
    let pieces = spans.len();
    let tangent = |before: usize, after: usize| {
        let (g, h) = (spans[before], spans[after]);
        (h * slopes[before] + g * slopes[after]) / (g + h)
    };
    let mut tangents: Vec<DVec3> = (1..pieces).map(|i| tangent(i - 1, i)).collect();
    let (first, last) = match closed {
        true => (tangent(pieces - 1, 0), tangent(pieces - 1, 0)),
        false => (slopes[0], slopes[pieces - 1]),
    };
    tangents.insert(0, first);
    tangents.push(last);
    tangents
}

/// The derivatives that make curvature continuous: h₁ m₀ + 2(h₀+h₁) m₁ + h₀ m₂ = 3(h₁ s₀ + h₀ s₁) at each inner point,
/// and no curvature at open ends.
fn spline_tangents(spans: &[f64], slopes: &[DVec3], closed: bool) -> Vec<DVec3> {
    let pieces = spans.len();
    let inner = |before: usize, after: usize| {
        let (g, h) = (spans[before], spans[after]);
        (h, 2.0 * (g + h), g, 3.0 * (h * slopes[before] + g * slopes[after]))
    };
    if !closed {
        let mut rows = vec![(0.0, 2.0, 1.0, 3.0 * slopes[0])];
        rows.extend((1..pieces).map(|i| inner(i - 1, i)));
        rows.push((1.0, 2.0, 0.0, 3.0 * slopes[pieces - 1]));
        return tridiagonal(&rows);
    }
    // Sherman–Morrison: the two corner entries are a rank-one change of a tridiagonal matrix.
    let mut rows: Vec<_> = (0..pieces).map(|i| inner((i + pieces - 1) % pieces, i)).collect();
    let (top_right, bottom_left) = (rows[0].0, rows[pieces - 1].2);
    let gamma = -rows[0].1;
    rows[0].1 -= gamma;
    rows[pieces - 1].1 -= top_right * bottom_left / gamma;
    let plain = tridiagonal(&rows);
    for (i, row) in rows.iter_mut().enumerate() {
        row.3 = DVec3::splat(match i {
            0 => gamma,
            i if i == pieces - 1 => bottom_left,
            _ => 0.0,
        });
    }
    let correction = tridiagonal(&rows);
    let along = |x: &[DVec3]| x[0] + x[pieces - 1] * (top_right / gamma);
    let factor = along(&plain) / (DVec3::ONE + along(&correction));
    let mut tangents: Vec<DVec3> = plain.iter().zip(&correction).map(|(x, z)| x - factor * z).collect();
    tangents.push(tangents[0]);
    tangents
}

/// Solves a diagonally dominant tridiagonal system; each row: below, on and above the diagonal, right-hand side.
fn tridiagonal(rows: &[(f64, f64, f64, DVec3)]) -> Vec<DVec3> {
    let mut above = Vec::with_capacity(rows.len());
    let mut solution: Vec<DVec3> = Vec::with_capacity(rows.len());
    for (i, &(a, b, c, r)) in rows.iter().enumerate() {
        let (pivot, rest) = match i {
            0 => (b, r),
            _ => (b - a * above[i - 1], r - a * solution[i - 1]),
        };
        above.push(c / pivot);
        solution.push(rest / pivot);
    }
    for i in (0..rows.len() - 1).rev() {
        let next = solution[i + 1];
        solution[i] -= above[i] * next;
    }
    solution
}

/// How much a curve is raised to clear the ground: a uniform cubic B-spline over its parameter.
#[derive(Clone, Debug)]
struct Lift {
    step: f64,
    /// Control points, one before the first sample to one beyond the last; empty for no lift at all.
    controls: Vec<f64>,
}

impl Lift {
    fn none(curve: &Curve) -> Lift {
        Lift { step: curve.end(), controls: Vec::new() }
    }

    fn any(&self) -> bool {
        !self.controls.is_empty()
    }

    fn over(curve: &Curve, ground: Ground<'_>, clearance: f64, closed: bool, duration: f64) -> Lift {
        let samples = (64 * curve.pieces.len()).clamp(1 << 12, 1 << 16);
        let step = curve.end() / samples as f64;
        let missing = |i: usize| {
            let p = curve.position(i as f64 * step);
            ground(p.truncate()).map_or(0.0, |ground| (ground + clearance - p.z).max(0.0))
        };
        let missing: Vec<f64> = (0..=samples).map(missing).collect();
        if missing.iter().all(|&m| m == 0.0) {
            return Lift::none(curve);
        }
        // Start to climb about a second and a half ahead, however fast the path is flown, but not over a tenth of it.
        let reach = ((1.5 / duration * samples as f64) as usize).clamp(6, samples / 10) / 3 * 3;
        // Indices beyond the ends: round again, or as at the end.
        let pad = 2 * reach + 4;
        let index = |i: isize| match closed {
            true => i.rem_euclid(samples as isize) as usize,
            false => i.clamp(0, samples as isize) as usize,
        };
        let padded: Vec<f64> = (-(pad as isize)..=(samples + pad) as isize).map(|i| missing[index(i)]).collect();
        // A control point is felt two samples away: widen by two more than the averages will narrow.
        let mut controls = running_maximum(&padded, reach + 2);
        for _ in 0..3 {
            controls = running_mean(&controls, reach / 3);
        }
        Lift { step, controls: controls[pad - 1..=pad + samples + 1].to_vec() }
    }

    /// Value and derivative.
    fn value(&self, at: f64) -> (f64, f64) {
        if self.controls.is_empty() {
            return (0.0, 0.0);
        }
        let x = (at / self.step).max(0.0);
        let index = (x as usize).min(self.controls.len() - 4);
        let t = (x - index as f64).clamp(0.0, 1.0);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| self.controls[index + i]);
        let s = 1.0 - t;
        let value = (s * s * s * a
            + (4.0 - 6.0 * t * t + 3.0 * t * t * t) * b
            + (4.0 - 6.0 * s * s + 3.0 * s * s * s) * c
            + t * t * t * d)
            / 6.0;
        let slope = (s * s * (b - a) + (1.0 + 2.0 * t * s) * (c - b) + t * t * (d - c)) / 2.0;
        (value, slope / self.step)
    }
}

/// The greatest number within `reach` places of each.
fn running_maximum(numbers: &[f64], reach: usize) -> Vec<f64> {
    let mut falling = std::collections::VecDeque::new();
    let mut result = Vec::with_capacity(numbers.len());
    for i in 0..numbers.len() + reach {
        if i < numbers.len() {
            while falling.back().is_some_and(|&j: &usize| numbers[j] <= numbers[i]) {
                falling.pop_back();
            }
            falling.push_back(i);
        }
        if i >= reach {
            while falling.front().is_some_and(|&j| j + reach < i - reach) {
                falling.pop_front();
            }
            result.push(falling.front().map_or(0.0, |&j| numbers[j]));
        }
    }
    result
}

/// The mean within `reach` places of each number, fewer at the ends.
fn running_mean(numbers: &[f64], reach: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    for (i, number) in numbers.iter().enumerate() {
        sums.push(sums[i] + number);
    }
    let mean = |i: usize| {
        let (from, to) = (i.saturating_sub(reach), (i + reach + 1).min(numbers.len()));
        ((sums[to] - sums[from]) / (to - from) as f64).max(0.0)
    };
    (0..numbers.len()).map(mean).collect()
}

/// Arc length over the parameter.
#[derive(Clone, Debug)]
struct Lengths {
    /// Parameter and length so far, both increasing.
    table: Vec<(f64, f64)>,
}

impl Lengths {
    fn of(curve: &Curve, lift: &Lift) -> Lengths {
        // Intervals end at every knot of the curve and of the lift, so that the integrand is smooth within each.
        let mut marks = Vec::new();
        for pair in curve.knots.windows(2) {
            marks.extend((0..32).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / 32.0));
        }
        marks.extend((0..lift.controls.len().saturating_sub(3)).map(|i| i as f64 * lift.step));
        marks.push(curve.end());
        marks.sort_by(f64::total_cmp);
        marks.dedup();
        let mut table = vec![(0.0, 0.0)];
        for pair in marks.windows(2) {
            let so_far = table[table.len() - 1].1;
            table.push((pair[1], so_far + arc(curve, lift, pair[0], pair[1])));
        }
        Lengths { table }
    }

    fn total(&self) -> f64 {
        self.table[self.table.len() - 1].1
    }

    /// The parameter at a distance from the start.
    fn parameter(&self, distance: f64, curve: &Curve, lift: &Lift) -> f64 {
        let index = self.table.partition_point(|&(_, s)| s <= distance).clamp(1, self.table.len() - 1);
        let ((t0, s0), (t1, s1)) = (self.table[index - 1], self.table[index]);
        let wanted = (distance - s0).clamp(0.0, s1 - s0);
        let mut at = if s1 > s0 { t0 + (t1 - t0) * wanted / (s1 - s0) } else { t0 };
        // Newton: the intervals are short, two steps reach rounding.
        for _ in 0..3 {
            let speed = speed(curve, lift, at);
            if speed > 1e-9 {
                at = (at - (arc(curve, lift, t0, at) - wanted) / speed).clamp(t0, t1);
            }
        }
        at
    }
}

fn speed(curve: &Curve, lift: &Lift, at: f64) -> f64 {
    (curve.derivative(at) + DVec3::Z * lift.value(at).1).length()
}

/// Length between two parameters within one interval: Gauss–Legendre of five points.
fn arc(curve: &Curve, lift: &Lift, from: f64, to: f64) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    half * NODES.iter().map(|(x, w)| w * speed(curve, lift, middle + half * x)).sum::<f64>()
}

#[cfg(test)]
mod tests;
