//! Things that stand on the land or float on the sea: lighthouses, boats, boulders.
//!
//! An [`Object`] is triangles about an origin of its own, in several forms, each coarser than the one before and told how far it is from the
//! first. A [`Standing`] says where one stands. Its height is that of the full data's ground or of the water, never of what some level of
//! detail draws there: so what stands on the ground does not float when the ground is drawn coarsely, and stays where it is when the eye comes
//! nearer. Which form a view is worth is decided by the rule that holds for land: the error, seen from there, in pixels.

mod creases;
mod lathe;
mod standing;

pub use creases::creased;
pub use lathe::{Rung, buoy, lathe, lighthouse};
pub use standing::{Footing, Pose, Standing};

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A corner of an object's triangles.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Corner {
    /// Where, from the object's origin (m): east, north and up, as it is modelled.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Share of light that is thrown back, linear Rec. 709.
    pub albedo: Vec3,
}

/// One form of an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Form {
    /// The corners.
    pub corners: Vec<Corner>,
    /// Three corners each. Both sides are seen.
    pub triangles: Vec<[u32; 3]>,
    /// How far it is from the first form (m).
    pub error: f32,
}

/// Why there is no object.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObjectError {
    /// There is nothing of it.
    #[error("expected an object of at least one triangle, got none")]
    Empty,
    /// A triangle names a corner that is not there.
    #[error("expected triangles of corners 0 to {last}, got corner {got}; correct the model", last = .corners.saturating_sub(1))]
    Corner {
        /// How many corners there are.
        corners: usize,
        /// The one named.
        got: u32,
    },
    /// A corner lies nowhere, or where no object reaches.
    #[error("expected corners within 1000 km of the object's origin, got one at {0}; correct the model or its units")]
    Position(Vec3),
    /// Forms are not told from fine to coarse.
    #[error("expected forms from fine to coarse, the first with an error of 0, got errors {0:?}")]
    Order(Vec<f32>),
}

/// A free-standing thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    forms: Vec<Form>,
    low: Vec3,
    high: Vec3,
}

impl Object {
    /// No corner is farther from the origin, along any axis (m).
    pub const REACH: f32 = 1e6;

    /// An object in these forms, the finest first. Normals are made unit, colours kept within what can be thrown back; triangles are turned so that they run
    /// counter-clockwise seen from the side that their normals point to.
    ///
    /// # Errors
    /// If it is empty, triangles name corners that are not there, corners lie nowhere, or forms are not ordered by their errors.
    pub fn new(mut forms: Vec<Form>) -> Result<Object, ObjectError> {
        let errors = || forms.iter().map(|form| form.error).collect();
        if forms.first().is_some_and(|form| form.error != 0.0) || !forms.is_sorted_by(|a, b| a.error <= b.error) {
            return Err(ObjectError::Order(errors()));
        }
        if forms.is_empty() || forms.iter().any(|form| form.triangles.is_empty()) {
            return Err(ObjectError::Empty);
        }
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for form in &mut forms {
            let corners = form.corners.len();
            if let Some(&got) = form.triangles.as_flattened().iter().find(|&&corner| corner as usize >= corners) {
                return Err(ObjectError::Corner { corners, got });
            }
            for corner in &mut form.corners {
                if !corner.position.is_finite() || corner.position.abs().max_element() > Object::REACH {
                    return Err(ObjectError::Position(corner.position));
                }
                corner.normal = corner.normal.normalize_or(Vec3::Z);
                corner.albedo = corner.albedo.map(|share| if share >= 0.0 { share.min(1.0) } else { 0.0 });
                (low, high) = (low.min(corner.position), high.max(corner.position));
            }
            for triangle in &mut form.triangles {
                let [a, b, c] = triangle.map(|corner| form.corners[corner as usize]);
                let flat = (b.position - a.position).cross(c.position - a.position);
                if flat.dot(a.normal + b.normal + c.normal) < 0.0 {
                    triangle.swap(1, 2);
                }
            }
        }
        Ok(Object { forms, low, high })
    }

    /// Its forms, the finest first: at least one.
    pub fn forms(&self) -> &[Form] {
        &self.forms
    }

    /// Least and greatest coordinates (m).
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.low, self.high)
    }

    /// A ball that holds it: its middle, and its radius (m).
    pub fn ball(&self) -> (Vec3, f32) {
        (0.5 * (self.low + self.high), 0.5 * self.low.distance(self.high))
    }

    /// The number of the coarsest form that is no farther from the first than this (m).
    pub fn form_within(&self, error: f32) -> usize {
        self.forms.partition_point(|form| form.error <= error).max(1) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Form {
        let at =
            |x: f32, y: f32| Corner { position: Vec3::new(x, y, 0.0), normal: Vec3::Z * 3.0, albedo: Vec3::splat(2.0) };
        Form { corners: vec![at(0.0, 0.0), at(0.0, 1.0), at(1.0, 0.0)], triangles: vec![[0, 1, 2]], error: 0.0 }
    }

    #[test]
    fn corners_are_put_in_order() {
        let object = Object::new(vec![triangle()]).expect("an object");
        let form = &object.forms()[0];
        assert_eq!(form.triangles, [[0, 2, 1]], "seen from above");
        assert_eq!(form.corners[0].normal, Vec3::Z);
        assert_eq!(form.corners[0].albedo, Vec3::ONE);
        assert_eq!(object.bounds(), (Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)));
        assert_eq!(object.ball().1, 0.5f32.sqrt());
    }

    #[test]
    fn nonsense_is_refused() {
        let with = |change: &dyn Fn(&mut Form)| {
            let mut form = triangle();
            change(&mut form);
            Object::new(vec![form]).map(|_| ()).expect_err("nonsense")
        };
        assert_eq!(Object::new(Vec::new()), Err(ObjectError::Empty));
        assert_eq!(with(&|form| form.triangles.clear()), ObjectError::Empty);
        assert_eq!(with(&|form| form.triangles[0][1] = 3), ObjectError::Corner { corners: 3, got: 3 });
        assert!(matches!(with(&|form| form.corners[1].position.y = f32::NAN), ObjectError::Position(_)));
        assert!(matches!(with(&|form| form.corners[1].position.x = 2e6), ObjectError::Position(_)));
        assert_eq!(with(&|form| form.error = 1.0), ObjectError::Order(vec![1.0]));
        let coarse = |error| Form { error, ..triangle() };
        assert!(matches!(Object::new(vec![coarse(0.0), coarse(2.0), coarse(1.0)]), Err(ObjectError::Order(_))));
        assert!(matches!(Object::new(vec![coarse(0.0), coarse(f32::NAN)]), Err(ObjectError::Order(_))));
    }

    #[test]
    fn the_coarsest_form_that_is_near_enough_is_taken() {
        let forms = [0.0, 0.1, 0.5].map(|error| Form { error, ..triangle() });
        let object = Object::new(forms.to_vec()).expect("an object");
        assert_eq!(
            [0.0, 0.05, 0.1, 0.4, 0.5, 9.0, f32::NAN].map(|error| object.form_within(error)),
            [0, 0, 1, 1, 2, 2, 0]
        );
    }
}
