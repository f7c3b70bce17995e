//! Ever coarser forms of a free-standing model, such as a boat or a lighthouse, by edge collapse.
//!
//! M. Garland and P. Heckbert, "Surface simplification using quadric error metrics", 1997, by the library meshoptimizer (the
//! crate `meshopt`), which is C++: hence the feature `lod`, off by default. Land has better: meshes with a bound that is
//! measured at every sample ([`littoral::mesh`]).

use glam::{DVec3, Vec3};
use littoral::mesh::Model;
use littoral::objects::{Form, Object, ObjectError, creased};
use meshopt::SimplifyOptions;
use std::collections::HashMap;

/// How far a form may be reduced: until it has few enough triangles, or the error would grow too large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reduction {
    /// Share of the full model's triangles that is enough, in [0, 1]; 0 for as few as the error allows.
    pub share: f64,
    /// The greatest error (in the model's units); infinite for whatever the share asks for.
    pub max_error: f64,
}

/// A coarser form.
#[derive(Clone, Debug, PartialEq)]
pub struct Lod {
    /// The form: vertices of the full model, those that are left.
    pub model: Model,
    /// How far it is from the full model (in its units), as meshoptimizer reports it: the square root of the greatest
    /// quadric error of a collapse. An estimate of the distance, not a bound that anything was measured against.
    pub error: f64,
}

/// Why a model cannot be reduced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LodError {
    /// A triangle names a vertex that is not there.
    #[error("expected triangles of vertices 0 to {last}, got vertex {got}; correct the model", last = .vertices.saturating_sub(1))]
    Vertex {
        /// How many vertices there are.
        vertices: usize,
        /// The one named.
        got: u32,
    },
    /// A vertex lies nowhere.
    #[error("expected finite positions, got {0}; correct the model")]
    Position(DVec3),
    /// A reduction asks for what makes no sense.
    #[error("expected a share from 0 to 1 and an error of 0 or more, got {0:?}")]
    Reduction(Reduction),
}

/// Forms of a model, the full one first with error 0, then one for each reduction, each made from the full model so that its error
/// is counted from there. The chain ends early where a reduction gives no fewer triangles than the form before.
///
/// Normals are kept where every vertex has one. Waterlines and what is ground and what base are told of the full form only.
///
/// # Errors
/// If the model's triangles or positions, or a reduction, make no sense.
pub fn lod_chain(model: &Model, reductions: &[Reduction]) -> Result<Vec<Lod>, LodError> {
    let vertices = model.positions.len();
    if let Some(&got) = model.triangles.as_flattened().iter().find(|&&vertex| vertex as usize >= vertices) {
        return Err(LodError::Vertex { vertices, got });
    }
    if let Some(&position) = model.positions.iter().find(|at| !at.is_finite()) {
        return Err(LodError::Position(position));
    }
    let (low, high) = model.bounds();
    let middle = if vertices == 0 { DVec3::ZERO } else { 0.5 * (low + high) };
    // Single precision about the middle, wherever the model stands.
    let places: Vec<[f32; 3]> = model.positions.iter().map(|at| (*at - middle).as_vec3().to_array()).collect();
    let mut chain = vec![Lod { model: model.clone(), error: 0.0 }];
    for &reduction in reductions {
        if !((0.0..=1.0).contains(&reduction.share) && reduction.max_error >= 0.0) {
            return Err(LodError::Reduction(reduction));
        }
        let enough = 3 * (reduction.share * model.triangles.len() as f64).round() as usize;
        let mut error = 0f32;
        let left = meshopt::simplify_decoder(
            model.triangles.as_flattened(),
            &places,
            enough,
            reduction.max_error as f32,
            SimplifyOptions::ErrorAbsolute,
            Some(&mut error),
        );
        let before = chain.last().map_or(0, |form| form.model.triangles.len());
        if left.len() / 3 >= before || left.is_empty() {
            break;
        }
        let (triangles, _) = left.as_chunks::<3>();
        chain.push(Lod { model: compact(model, triangles), error: f64::from(error) });
    }
    Ok(chain)
}

/// An object of one form in a chain of ever coarser ones: half as many triangles, a quarter and so on, as far as that makes it coarser. The coarser ones are smooth over edges that
/// turn by less than 40°.
///
/// # Errors
/// None, but for what would be wrong with an object.
pub fn with_coarser_forms(object: Object) -> Result<Object, ObjectError> {
    /// Fewer triangles are drawn at once as they are.
    const FEW: usize = 24;
    let full = &object.forms()[0];
    // Simplification goes on over edges along which only normals differ, but not where colours do.
    let (mut named, mut places) = (HashMap::new(), Vec::<(Vec3, Vec3)>::new());
    let mut name = |corner: u32| {
        let corner = &full.corners[corner as usize];
        let key = [corner.position, corner.albedo].map(|v| v.to_array().map(|n| (n + 0.0).to_bits()));
        *named.entry(key).or_insert_with(|| {
            places.push((corner.position, corner.albedo));
            places.len() as u32 - 1
        })
    };
    let welded: Vec<[u32; 3]> = full.triangles.iter().map(|triangle| triangle.map(&mut name)).collect();
    let positions: Vec<[f32; 3]> = places.iter().map(|place| place.0.to_array()).collect();
    let mut forms = vec![full.clone()];
    for halvings in 1..8 {
        let before = &forms[forms.len() - 1];
        let enough = full.triangles.len() >> halvings;
        if enough < FEW {
            break;
        }
        let mut error = 0f32;
        let options = SimplifyOptions::ErrorAbsolute;
        let left = meshopt::simplify_decoder(
            welded.as_flattened(),
            &positions,
            3 * enough,
            f32::MAX,
            options,
            Some(&mut error),
        );
        if 4 * left.len() / 3 > 3 * before.triangles.len() || left.is_empty() {
            break; // hardly fewer
        }
        let error = error.max(before.error).max(f32::MIN_POSITIVE);
        let (triangles, _) = left.as_chunks::<3>();
        let form = creased(&places, triangles, 40f32.to_radians().cos());
        if form.triangles.is_empty() || !error.is_finite() {
            break;
        }
        forms.push(Form { error, ..form });
    }
    Object::new(forms)
}

/// Some triangles of a model with the vertices that they need.
fn compact(model: &Model, triangles: &[[u32; 3]]) -> Model {
    let with_normals = model.normals.len() == model.positions.len();
    let mut names = vec![u32::MAX; model.positions.len()];
    let (mut positions, mut normals) = (Vec::new(), Vec::<Vec3>::new());
    let mut name = |vertex: u32| {
        let index = vertex as usize;
        if names[index] == u32::MAX {
            names[index] = positions.len() as u32;
            positions.push(model.positions[index]);
            if with_normals {
                normals.push(model.normals[index]);
            }
        }
        names[index]
    };
    let triangles: Vec<[u32; 3]> = triangles.iter().map(|triangle| triangle.map(&mut name)).collect();
    Model { ground_triangles: triangles.len(), positions, normals, triangles, shoreline: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::objects::Corner;

    /// A sphere of radius 10 about a place far from zero: an octahedron, each triangle parted in four again and again.
    fn sphere(times: usize) -> Model {
        let middle = DVec3::new(5e5, 5e6, 100.0);
        let mut places = vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
        let mut triangles: Vec<[u32; 3]> =
            vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        for _ in 0..times {
            let mut middles = std::collections::HashMap::new();
            let mut between = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    places.push((places[a as usize] + places[b as usize]).normalize());
                    places.len() as u32 - 1
                })
            };
            let part = |&[a, b, c]: &[u32; 3]| {
                let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            triangles = triangles.iter().flat_map(part).collect();
        }
        Model {
            normals: places.iter().map(|at| at.as_vec3()).collect(),
            positions: places.iter().map(|at| middle + 10.0 * *at).collect(),
            ground_triangles: triangles.len(),
            triangles,
            shoreline: Vec::new(),
        }
    }

    #[test]
    fn a_sphere_gets_coarser_and_stays_a_sphere() {
        let full = sphere(5);
        let reduction = |share, max_error| Reduction { share, max_error };
        let asked =
            [reduction(0.5, f64::INFINITY), reduction(0.1, f64::INFINITY), reduction(0.0, 0.5), reduction(0.0, 2.0)];
        let chain = lod_chain(&full, &asked).expect("a chain");
        assert_eq!(chain.len(), 5);
        assert_eq!((&chain[0].model, chain[0].error), (&full, 0.0));
        for (form, asked) in chain[1..].iter().zip(asked) {
            let count = form.model.triangles.len();
            assert!(form.error > 0.0 && form.error <= asked.max_error * 1.000_001, "{} {asked:?}", form.error);
            if asked.share > 0.0 {
                let share = count as f64 / full.triangles.len() as f64;
                assert!((0.8 * asked.share..=1.001 * asked.share).contains(&share), "{share} {asked:?}");
            }
            assert!(form.model.is_closed());
            let least: f64 = 4.0 / 3.0 * std::f64::consts::PI * (10.0 - 2.0 * form.error).powi(3);
            assert!(form.model.volume() > least.min(0.99 * full.volume()), "{} {least}", form.model.volume());
            let middle = DVec3::new(5e5, 5e6, 100.0);
            for (at, normal) in form.model.positions.iter().zip(&form.model.normals) {
                assert!(((*at - middle) / 10.0 - normal.as_dvec3()).length() < 1e-6);
            }
        }
        assert!(chain.windows(2).all(|pair| pair[1].model.triangles.len() < pair[0].model.triangles.len()));
    }

    #[test]
    fn an_object_gets_a_chain_of_forms_in_its_colours() {
        let full = sphere(4);
        let corner = |at: &DVec3| {
            let place = (*at - DVec3::new(5e5, 5e6, 100.0)).as_vec3();
            let albedo = if place.z > 0.0 { Vec3::new(0.6, 0.1, 0.1) } else { Vec3::splat(0.4) };
            Corner { position: place, normal: place / 10.0, albedo }
        };
        let corners: Vec<Corner> = full.positions.iter().map(corner).collect();
        let object = Object::new(vec![Form { corners, triangles: full.triangles, error: 0.0 }]).expect("a ball");
        let chained = with_coarser_forms(object.clone()).expect("a chain");
        let [first, given] = [&chained, &object].map(|object| &object.forms()[0]);
        assert!(first.triangles == given.triangles, "the full form has other triangles");
        for (first, given) in first.corners.iter().zip(&given.corners) {
            // Normals are made unit once more.
            assert!(first.position == given.position && (first.normal - given.normal).length() < 1e-6, "{first:?}");
        }
        assert!(chained.forms().len() >= 4, "{}", chained.forms().len());
        for pair in chained.forms().windows(2) {
            assert!(pair[1].triangles.len() * 4 <= pair[0].triangles.len() * 3 && pair[1].error >= pair[0].error);
            for corner in &pair[1].corners {
                assert!(corner.position.length() > 9.0 && corner.normal.dot(corner.position) > 3.0, "{corner:?}");
                assert!(corner.albedo.x == if corner.position.z > 0.0 { 0.6 } else { 0.4 });
            }
        }
        let few =
            Object::new(vec![Form { triangles: vec![[0, 1, 2]], ..object.forms()[0].clone() }]).expect("a triangle");
        assert!(with_coarser_forms(few).is_ok_and(|object| object.forms().len() == 1));
    }

    #[test]
    fn what_cannot_be_reduced_ends_the_chain_and_nonsense_is_refused() {
        let full = sphere(1);
        let tenth = Reduction { share: 0.0, max_error: 0.0 };
        assert_eq!(lod_chain(&full, &[tenth]).expect("a chain").len(), 1);
        assert_eq!(lod_chain(&Model::default(), &[tenth]).expect("a chain").len(), 1);
        let nan = Reduction { share: f64::NAN, ..tenth };
        assert!(matches!(lod_chain(&full, &[nan]), Err(LodError::Reduction(_))));
        let mut broken = full.clone();
        broken.triangles[3][1] = 1000;
        assert_eq!(lod_chain(&broken, &[tenth]), Err(LodError::Vertex { vertices: full.positions.len(), got: 1000 }));
        broken = full;
        broken.positions[2].y = f64::NAN;
        assert!(matches!(lod_chain(&broken, &[tenth]), Err(LodError::Position(_))));
    }
}
