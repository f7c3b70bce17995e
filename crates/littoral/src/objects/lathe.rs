//! Things that are turned on a lathe: a profile that goes once round. As many sides as are wanted, so that the chain of forms needs no
//! simplification, and its errors are known exactly: a regular polygon of n sides within a circle of radius r is r (1 − cos π/n) from it.

use super::{Corner, Form, Object, ObjectError};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// A ring of the profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// Radius (m).
    pub radius: f32,
    /// Height (m).
    pub height: f32,
    /// Albedo from here up to the next.
    pub albedo: Vec3,
}

/// A profile turned round the z axis, from its foot to its top, in forms of so many sides, the most first. Edges between rungs are sharp, sides are smooth.
///
/// # Errors
/// If there are fewer than two rungs or three sides, or the sides do not become fewer.
pub fn lathe(profile: &[Rung], sides: &[u32]) -> Result<Object, ObjectError> {
    let widest = profile.iter().map(|rung| rung.radius).fold(0.0, f32::max);
    let sagitta = |sides: u32| widest * (1.0 - (PI / sides.max(3) as f32).cos());
    let first = sides.first().map_or(0.0, |&sides| sagitta(sides));
    let forms = sides.iter().map(|&sides| turned(profile, sides.max(3), sagitta(sides) - first));
    Object::new(forms.collect())
}

fn turned(profile: &[Rung], sides: u32, error: f32) -> Form {
    let mut form = Form { error, ..Form::default() };
    for pair in profile.windows(2) {
        let (low, high) = (pair[0], pair[1]);
        // Upward along the profile, its outer side is to the right.
        let along = Vec2::new(high.radius - low.radius, high.height - low.height);
        let outward = Vec2::new(along.y, -along.x).normalize_or(Vec2::X);
        let base = form.corners.len() as u32;
        for side in 0..=sides {
            let (s, c) = (TAU * (side % sides) as f32 / sides as f32).sin_cos();
            for rung in [low, high] {
                form.corners.push(Corner {
                    position: Vec3::new(c * rung.radius, s * rung.radius, rung.height),
                    normal: Vec3::new(c * outward.x, s * outward.x, outward.y),
                    albedo: low.albedo,
                });
            }
        }
        for side in 0..sides {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| base + 2 * side + k);
            // Of a tip there is one triangle.
            form.triangles.extend([[a, c, b]].into_iter().filter(|_| low.radius > 0.0));
            form.triangles.extend([[b, c, d]].into_iter().filter(|_| high.radius > 0.0));
        }
    }
    form
}

/// How many sides the built-in things have.
const SIDES: [u32; 5] = [64, 32, 16, 8, 5];

/// A lighthouse, 25 m high over a base that reaches 3 m into the ground: white with red bands, a gallery, a lantern under a copper roof.
pub fn lighthouse() -> Object {
    let white = Vec3::splat(0.72);
    let red = Vec3::new(0.42, 0.035, 0.025);
    let stone = Vec3::new(0.27, 0.25, 0.23);
    let dark = Vec3::new(0.045, 0.05, 0.055);
    let glass = Vec3::new(0.20, 0.24, 0.25);
    let copper = Vec3::new(0.11, 0.21, 0.17);
    let rung = |radius, height, albedo| Rung { radius, height, albedo };
    turned_well(&[
        rung(4.4, -3.0, stone),
        rung(4.2, 1.2, stone),
        rung(3.3, 1.5, white),
        rung(2.95, 5.5, red),
        rung(2.65, 9.5, white),
        rung(2.35, 13.5, red),
        rung(2.1, 17.5, white),
        rung(2.0, 19.0, white),
        rung(3.0, 19.6, dark),
        rung(3.0, 20.0, dark),
        rung(1.5, 20.05, dark),
        rung(1.5, 20.8, glass),
        rung(1.5, 22.9, copper),
        rung(1.9, 23.0, copper),
        rung(0.5, 24.3, copper),
        rung(0.14, 24.4, dark),
        rung(0.0, 25.5, dark),
    ])
}

/// A sea buoy, 5 m high and 2.4 m wide, that floats at its origin: a red hull, a mast of lattice seen from afar, a lamp.
pub fn buoy() -> Object {
    let red = Vec3::new(0.50, 0.05, 0.03);
    let white = Vec3::splat(0.70);
    let dark = Vec3::splat(0.05);
    let rung = |radius, height, albedo| Rung { radius, height, albedo };
    turned_well(&[
        rung(0.0, -1.1, dark),
        rung(0.9, -0.8, dark),
        rung(1.2, -0.1, red),
        rung(1.2, 0.55, red),
        rung(0.95, 0.75, red),
        rung(0.42, 0.8, red),
        rung(0.36, 2.0, white),
        rung(0.30, 2.9, red),
        rung(0.26, 3.4, dark),
        rung(0.34, 3.5, white),
        rung(0.34, 3.8, dark),
        rung(0.0, 4.1, dark),
    ])
}

fn turned_well(profile: &[Rung]) -> Object {
    match lathe(profile, &SIDES) {
        Ok(object) => object,
        Err(error) => unreachable!("the profile is fixed: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_within_their_errors_and_point_outward() {
        for object in [lighthouse(), buoy()] {
            let full = &object.forms()[0];
            let radius = full.corners.iter().map(|c| c.position.truncate().length()).fold(0.0, f32::max);
            for form in object.forms() {
                for triangle in &form.triangles {
                    let [a, b, c] = triangle.map(|k| form.corners[k as usize]);
                    let flat = (b.position - a.position).cross(c.position - a.position).normalize();
                    for corner in [a, b, c] {
                        assert!(flat.dot(corner.normal) > 0.5, "{corner:?} {flat}");
                    }
                    // The middle of a side at the widest rung is as far within as is told.
                    let middle = 0.5 * (a.position + c.position).truncate();
                    let level = (a.position.truncate().length() - c.position.truncate().length()).abs() < 1e-4;
                    let within = a.position.truncate().length() - middle.length();
                    assert!(!level || within <= form.error + radius * 0.002, "{within} {}", form.error);
                }
            }
            let errors: Vec<f32> = object.forms().iter().map(|form| form.error).collect();
            assert!(errors[0] == 0.0 && errors.windows(2).all(|pair| pair[0] < pair[1]), "{errors:?}");
        }
        assert!(
            lathe(&[], &[8]).is_err() && lathe(&[Rung { radius: 1.0, height: 0.0, albedo: Vec3::ONE }], &[]).is_err()
        );
    }
}
