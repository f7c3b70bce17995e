//! From metres on the ground to pixels on the screen: the error that detail is chosen by.
//!
//! A point p (from the eye) at depth w in front of it appears at f·p⊥/w from the middle of the picture, f being the focal length in pixels. Raised by
//! dz it moves by f·|p × dz|/w², since p⊥·dw and w·dp⊥ are the two parts of that cross product: at most f·ρ·dz/w² with ρ the point's distance
//! from the plumb line through the eye. So a vertical error costs nothing straight below and most at the horizon. Over a box the bound takes the largest
//! ρ and the smallest w, which makes it monotone: a box within another never has a larger one (the nesting that refinement rests on: P. Lindstrom
//! and V. Pascucci, "Terrain simplification simplified", 2002). On an ellipsoid, where plumb lines differ, |p| takes the place of ρ.

use crate::field::{HeightField, HeightRange};
use crate::space::{Cell, Datum, Place, View};
use glam::{DVec2, DVec3, Vec3, Vec4Swizzles};

/// Why no picture can be drawn of a view.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// A number of the view is NaN or infinite.
    #[error("expected a view of finite numbers, got {0} that is not; check the eye, the target and the field of view")]
    NotFinite(&'static str),
    /// The picture has no pixels.
    #[error("expected a picture of at least one pixel, got {0} × {1}")]
    Empty(u32, u32),
    /// The tolerance is not a positive number.
    #[error("expected a positive tolerance (pixels), got {0}")]
    Tolerance(f32),
    /// The projection has no perspective.
    #[error("expected a perspective projection, got a matrix whose last row is {0}")]
    Projection(Vec3),
    /// The method works on one face only.
    #[error("expected a plane, got an ellipsoid; use a method that works on one (whole, patches)")]
    Ellipsoid,
}

/// An upright box round a piece of surface, relative to the eye (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its least coordinates.
    pub low: Vec3,
    /// Its greatest coordinates.
    pub high: Vec3,
}

impl Bounds {
    /// The smallest box that holds both.
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// How large things appear in a view.
#[derive(Clone, Copy, Debug)]
pub struct ScreenMetric {
    datum: Datum,
    eye: DVec3,
    /// Straight ahead, unit.
    forward: Vec3,
    /// Normals, pointing inward, of the frame's four sides, all through the eye.
    sides: [Vec3; 4],
    /// Pixels that a unit of tangent covers.
    focal: f32,
    /// The greatest distance of anything in the frame as a multiple of its depth.
    stretch: f32,
    tolerance: f32,
}

/// What rounding may take from a bound.
const SLACK: f32 = 1.0 + 1e-5;

impl ScreenMetric {
    /// The metric of `view` over surfaces on `datum`.
    ///
    /// # Errors
    /// If the view holds numbers that are not finite, no pixels, no perspective, or no positive tolerance.
    pub fn new(view: &View, datum: Datum) -> Result<ScreenMetric, ViewError> {
        if !view.eye.is_finite() {
            return Err(ViewError::NotFinite("an eye"));
        }
        if !view.clip_from_eye.is_finite() {
            return Err(ViewError::NotFinite("a projection"));
        }
        if view.size.min_element() == 0 {
            return Err(ViewError::Empty(view.size.x, view.size.y));
        }
        if !(view.tolerance_pixels > 0.0 && view.tolerance_pixels.is_finite()) {
            return Err(ViewError::Tolerance(view.tolerance_pixels));
        }
        let [across, upward, depth] = [0, 1, 3].map(|i| view.clip_from_eye.row(i).xyz());
        if depth.length_squared() < 1e-12 || depth.cross(across).cross(depth.cross(upward)).length_squared() < 1e-24 {
            return Err(ViewError::Projection(depth));
        }
        // Clip coordinates count in units in which the depth is `depth · p`.
        let forward = depth.normalize();
        let scale = 1.0 / depth.length();
        let flat = |row: Vec3| (row - forward * row.dot(forward)) * scale;
        let half = view.size.as_vec2() * 0.5;
        let focal = (flat(across).length() * half.x).max(flat(upward).length() * half.y);
        let sides = [depth + across, depth - across, depth + upward, depth - upward].map(Vec3::normalize);
        let (corner, right, down) = view.frame();
        let size = view.size.as_vec2();
        let stretch = [(0.0, 0.0), (size.x, 0.0), (0.0, size.y), (size.x, size.y)]
            .into_iter()
            .map(|(x, y)| {
                let direction = corner + right * x + down * y;
                direction.length() / direction.dot(forward)
            })
            .fold(1.0, f32::max);
        Ok(ScreenMetric { datum, eye: view.eye, forward, sides, focal, stretch, tolerance: view.tolerance_pixels })
    }

    /// The same for methods that work on one face only.
    ///
    /// # Errors
    /// Also if `datum` is not a plane.
    pub fn on_plane(view: &View, datum: Datum) -> Result<ScreenMetric, ViewError> {
        match datum {
            Datum::Plane { .. } => ScreenMetric::new(view, datum),
            Datum::Ellipsoid { .. } => Err(ViewError::Ellipsoid),
        }
    }

    /// How wrong a drawing may be (pixels).
    pub fn tolerance(&self) -> f32 {
        self.tolerance
    }

    /// Where the eye is (m).
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Straight ahead, the frame's four sides (normals pointing inward), pixels a unit of tangent covers, and the greatest distance in the frame
    /// as a multiple of the depth: for who measures many boxes at once.
    pub fn lens(&self) -> (Vec3, [Vec3; 4], f32, f32) {
        (self.forward, self.sides, self.focal, self.stretch)
    }

    /// A box round the surface over `cell`, whose heights lie within `range`.
    pub fn bounds(&self, cell: Cell, range: HeightRange) -> Bounds {
        let (low, high) = match self.datum {
            Datum::Plane { origin, size } => {
                let corner = origin + cell.low_corner().uv * size;
                let far = corner + size * cell.side();
                (corner.extend(f64::from(range.low)), far.extend(f64::from(range.high)))
            }
            Datum::Ellipsoid { equatorial_radius, .. } => self.curved(cell, range, equatorial_radius),
        };
        self.from_eye(low, high)
    }

    /// The same for a box given in the world.
    pub fn from_eye(&self, low: DVec3, high: DVec3) -> Bounds {
        let (low, high) = ((low - self.eye).as_vec3(), (high - self.eye).as_vec3());
        Bounds { low: low.map(f32::next_down), high: high.map(f32::next_up) }
    }

    /// Corners of a box (m) round a curved cell: its points on a lattice of 3 × 3, and room for how far the arcs between them may bulge.
    fn curved(&self, cell: Cell, range: HeightRange, radius: f64) -> (DVec3, DVec3) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let corner = cell.low_corner().uv;
        for i in 0..9 {
            let uv = corner + DVec2::new(f64::from(i % 3), f64::from(i / 3)) * (0.5 * cell.side());
            for height in [range.low, range.high] {
                let world = self.datum.world(Place { face: cell.face, uv }, f64::from(height)).0;
                (low, high) = (low.min(world), high.max(world));
            }
        }
        // Half the lattice's step spans at most this angle in each direction (a face spans a right angle).
        let angle = std::f64::consts::FRAC_PI_2 * 0.25 * cell.side() * std::f64::consts::SQRT_2;
        let room = (radius + f64::from(range.high.max(0.0))) * (1.0 - angle.cos()) * 1.05;
        (low - room, high + room)
    }

    /// Whether any of the box may lie within the frame.
    #[inline]
    pub fn sees(&self, bounds: &Bounds) -> bool {
        let reach = |normal: Vec3| (normal * bounds.low).max(normal * bounds.high).element_sum();
        let slack = -1e-6 * bounds.low.abs().max(bounds.high.abs()).element_sum();
        self.sides.iter().all(|side| reach(*side) >= slack) && reach(self.forward) >= View::NEAR
    }

    /// Whether all of the box lies within the frame, and with it every box within.
    #[inline]
    pub(super) fn holds(&self, bounds: &Bounds) -> bool {
        let reach = |normal: Vec3| (normal * bounds.low).min(normal * bounds.high).element_sum();
        self.sides.iter().all(|side| reach(*side) >= 0.0) && reach(self.forward) >= View::NEAR
    }

    /// Pixels that a vertical metre covers at most, anywhere in the box and the frame. Monotone: never larger for a box within another.
    #[inline]
    pub fn pixels_per_metre(&self, bounds: &Bounds) -> f32 {
        let far = bounds.low.abs().max(bounds.high.abs());
        let across = match self.datum {
            Datum::Plane { .. } => far.truncate().length(),
            Datum::Ellipsoid { .. } => far.length(),
        };
        self.focal * self.spread(bounds, across)
    }

    /// Pixels between any two points of the box at most.
    #[inline]
    pub fn pixels_across(&self, bounds: &Bounds) -> f32 {
        let far = bounds.low.abs().max(bounds.high.abs());
        self.focal * self.spread(bounds, far.length()) * (bounds.high - bounds.low).length()
    }

    /// Greatest ρ/w² for a greatest ρ, anywhere in the box and the frame.
    #[inline]
    fn spread(&self, bounds: &Bounds, across: f32) -> f32 {
        let nearest = (self.forward * bounds.low).min(self.forward * bounds.high).element_sum();
        let depth = nearest.max(View::NEAR);
        across.min(self.stretch * depth) / (depth * depth) * SLACK
    }

    /// The bound (pixels) for a cell drawn with vertical errors up to `error` (m). A cell that is partly void has no finite error; it is no farther
    /// off than it is large.
    #[inline]
    pub fn pixels(&self, bounds: &Bounds, error: f32) -> f32 {
        if error.is_finite() { error * self.pixels_per_metre(bounds) } else { self.pixels_across(bounds) }
    }

    /// The bound (pixels) for `cell` of `field` drawn as it is asked to be, and its box; `None` if nothing of it is seen.
    pub fn cell(&self, field: &dyn HeightField, cell: Cell, error: f32) -> Option<(Bounds, f32)> {
        let range = field.range(cell);
        if range.is_empty() {
            return None;
        }
        let bounds = self.bounds(cell, range);
        self.sees(&bounds).then(|| (bounds, self.pixels(&bounds, error)))
    }
}
