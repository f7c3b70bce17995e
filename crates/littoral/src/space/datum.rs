//! The surface that heights are counted from: a plane, or an ellipsoid cut into the six faces of a cube.
//!
//! On the ellipsoid a place names the direction of the surface's *normal*, through the cube's face with a tangent warp
//! (equal angles along the face's middle lines). Taking the normal rather than the geocentric direction makes heights
//! exact along it, and geodetic latitude its elevation. The inverse solves for the foot point by Newton's method on the
//! ellipse's multiplier (Eberly, "Distance from a point to an ellipse", 2013).

use super::Place;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_4;

/// The surface that heights are counted from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Datum {
    /// A level rectangle, z = 0. Its one face runs from `origin` (its south-west corner) over `size`, both in metres, so
    /// that cells are rectangles where samples are not square.
    Plane {
        /// World position of uv = (0, 0) (m).
        origin: DVec2,
        /// World size of the face (m), both positive.
        size: DVec2,
    },
    /// An ellipsoid of revolution about z, in six faces: +x, +y, −x, −y, +z, −z.
    Ellipsoid {
        /// Half the longer axis (m).
        equatorial_radius: f64,
        /// Half the axis of rotation (m).
        polar_radius: f64,
    },
}

impl Datum {
    /// The World Geodetic System of 1984.
    pub const WGS84: Datum = Datum::Ellipsoid { equatorial_radius: 6_378_137.0, polar_radius: 6_356_752.314_245_179 };

    /// How many faces the datum has: 1 or 6.
    pub fn faces(&self) -> u8 {
        match self {
            Datum::Plane { .. } => 1,
            Datum::Ellipsoid { .. } => 6,
        }
    }

    /// World position (m) of the point `height` (m) above a place, and the upward unit normal there.
    pub fn world(&self, place: Place, height: f64) -> (DVec3, DVec3) {
        match *self {
            Datum::Plane { origin, size } => ((origin + place.uv * size).extend(height), DVec3::Z),
            Datum::Ellipsoid { equatorial_radius: a, polar_radius: c } => {
                let normal = normal_of(place);
                let squared = DVec3::new(a * a, a * a, c * c);
                let foot = squared * normal / (squared * normal).dot(normal).sqrt();
                (foot + normal * height, normal)
            }
        }
    }

    /// The place below a world position, and the height above it (m). On an ellipsoid positions deeper than half its
    /// smaller radius have no unique answer; any place may be named for them.
    pub fn place(&self, world: DVec3) -> (Place, f64) {
        match *self {
            Datum::Plane { origin, size } => (Place { face: 0, uv: (world.truncate() - origin) / size }, world.z),
            Datum::Ellipsoid { equatorial_radius: a, polar_radius: c } => {
                let (normal, height) = foot_point(a, c, world);
                (place_of(normal), height)
            }
        }
    }

    /// Metres that one unit of u and of v cover at a place, along the surface.
    pub fn metres_per_uv(&self, place: Place) -> DVec2 {
        match *self {
            Datum::Plane { size, .. } => size,
            Datum::Ellipsoid { .. } => {
                let step = 1e-6;
                let along = |by: DVec2| {
                    let at = |sign: f64| self.world(Place { uv: place.uv + by * sign, ..place }, 0.0).0;
                    (at(0.5 * step) - at(-0.5 * step)).length() / step
                };
                DVec2::new(along(DVec2::X), along(DVec2::Y))
            }
        }
    }
}

/// The unit normal that a place on the cube names.
fn normal_of(place: Place) -> DVec3 {
    let warped = (place.uv * 2.0 - 1.0).map(|t| (t * FRAC_PI_4).tan());
    let (s, t) = (warped.x, warped.y);
    match place.face {
        0 => DVec3::new(1.0, s, t),
        1 => DVec3::new(-s, 1.0, t),
        2 => DVec3::new(-1.0, -s, t),
        3 => DVec3::new(s, -1.0, t),
        4 => DVec3::new(-t, s, 1.0),
        _ => DVec3::new(t, s, -1.0),
    }
    .normalize()
}

/// The place whose normal points along `n`: the inverse of [`normal_of`].
fn place_of(n: DVec3) -> Place {
    let size = n.abs();
    let (face, s, t) = if size.z >= size.x && size.z >= size.y {
        if n.z >= 0.0 { (4, n.y / n.z, -n.x / n.z) } else { (5, -n.y / n.z, -n.x / n.z) }
    } else if size.x >= size.y {
        if n.x >= 0.0 { (0, n.y / n.x, n.z / n.x) } else { (2, n.y / n.x, -n.z / n.x) }
    } else if n.y >= 0.0 {
        (1, -n.x / n.y, n.z / n.y)
    } else {
        (3, -n.x / n.y, -n.z / n.y)
    };
    Place { face, uv: (DVec2::new(s, t).map(|w| w.atan() / FRAC_PI_4) + 1.0) * 0.5 }
}

/// Normal and height of a point over an ellipsoid of radii `a` (equator) and `c` (pole).
fn foot_point(a: f64, c: f64, p: DVec3) -> (DVec3, f64) {
    // The foot f satisfies p − f = m · (f.x/a², f.y/a², f.z/c²); find m with f on the ellipsoid.
    let (r, z) = (p.truncate().length(), p.z.abs());
    let mut m = (p.length() - a) * a; // the sphere's answer is a start close enough for any flattening of a planet
    m = m.max(-0.5 * c * c);
    for _ in 0..20 {
        let (dr, dz) = (m + a * a, m + c * c);
        let (fr, fz) = (a * r / dr, c * z / dz);
        let value = fr * fr + fz * fz - 1.0;
        let slope = -2.0 * (fr * fr / dr + fz * fz / dz);
        if slope == 0.0 {
            break;
        }
        let step = value / slope;
        m = (m - step).max(-0.9 * c * c);
        if step.abs() < 1e-9 * a {
            break;
        }
    }
    let foot = p * DVec3::new(a * a / (m + a * a), a * a / (m + a * a), c * c / (m + c * c));
    let normal = (foot / DVec3::new(a * a, a * a, c * c)).normalize_or(DVec3::Z);
    (normal, (p - foot).dot(normal))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_positions_are_inverse() {
        let plane = Datum::Plane { origin: DVec2::new(-10.0, 5.0), size: DVec2::new(100.0, 50.0) };
        for datum in [plane, Datum::WGS84] {
            for face in 0..datum.faces() {
                for (i, j) in [(0.0, 0.5), (0.03, 0.97), (0.5, 0.5), (0.77, 0.2), (0.99, 0.99)] {
                    for height in [-11_000.0, 0.0, 8_849.0, 400_000.0] {
                        let place = Place { face, uv: DVec2::new(i, j) };
                        let (world, normal) = datum.world(place, height);
                        let (back, back_height) = datum.place(world);
                        assert_eq!(back.face, face);
                        assert!((back.uv - place.uv).length() < 1e-12, "{place:?} came back as {back:?}");
                        assert!((back_height - height).abs() < 1e-6);
                        assert!((normal.length() - 1.0).abs() < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn faces_share_their_edges() {
        for v in [0.1, 0.4, 0.8] {
            for face in 0..4u8 {
                let east = Datum::WGS84.world(Place { face, uv: DVec2::new(1.0, v) }, 0.0).0;
                let west = Datum::WGS84.world(Place { face: (face + 1) % 4, uv: DVec2::new(0.0, v) }, 0.0).0;
                assert!((east - west).length() < 1e-6);
            }
            let top = Datum::WGS84.world(Place { face: 0, uv: DVec2::new(v, 1.0) }, 0.0).0;
            let pole = Datum::WGS84.world(Place { face: 4, uv: DVec2::new(v, 0.0) }, 0.0).0;
            assert!((top - pole).length() < 1e-6);
        }
    }

    #[test]
    fn faces_are_right_handed_seen_from_outside() {
        for face in 0..6 {
            let at = |u, v| Datum::WGS84.world(Place { face, uv: DVec2::new(u, v) }, 0.0);
            let (origin, normal) = at(0.5, 0.5);
            let (east, north) = (at(0.6, 0.5).0 - origin, at(0.5, 0.6).0 - origin);
            assert!(east.cross(north).dot(normal) > 0.0, "face {face}");
        }
    }

    #[test]
    fn a_degree_of_latitude_has_its_known_length() {
        // Length of one degree of the meridian about the equator on WGS84: 110 574 m (any geodesy table).
        let at = |lat: f64| {
            let (s, c) = lat.to_radians().sin_cos();
            Datum::WGS84.world(place_of(DVec3::new(c, 0.0, s)), 0.0).0
        };
        assert!(((at(0.5) - at(-0.5)).length() - 110_574.0).abs() < 2.0);
    }
}
