//! Normals of triangles that come without: smooth where they meet flat, sharp where they meet at an edge.
//!
//! Each corner takes the mean of the triangles round its place that lean from its own triangle by less than some angle, each by its area
//! (H. Gouraud's means, 1971, kept within creases).

use super::{Corner, Form};
use glam::Vec3;
use std::collections::HashMap;

/// Round a place with more triangles than this every one keeps its own normal.
const MOST_AROUND: usize = 64;

/// Triangles over places (m, and their albedo) with normals. Corners are smooth over edges that turn by no more than an angle, given by its cosine: 1 for flat
/// facets. Triangles must name places that are there.
pub fn creased(places: &[(Vec3, Vec3)], triangles: &[[u32; 3]], crease_cosine: f32) -> Form {
    let wide = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|place| places[place as usize].0);
        (b - a).cross(c - a)
    };
    let wides: Vec<Vec3> = triangles.iter().map(|&triangle| wide(triangle)).collect();
    // The triangles round each place, one after the other.
    let mut starts = vec![0u32; places.len() + 1];
    triangles.as_flattened().iter().for_each(|&place| starts[place as usize + 1] += 1);
    (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
    let mut next = starts.clone();
    let mut around = vec![0u32; 3 * triangles.len()];
    for (i, &place) in triangles.as_flattened().iter().enumerate() {
        around[next[place as usize] as usize] = i as u32 / 3;
        next[place as usize] += 1;
    }
    let mut form = Form::default();
    let mut named: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    for (triangle, &own) in triangles.iter().zip(&wides) {
        let flat = own.normalize_or_zero();
        if flat == Vec3::ZERO {
            continue; // nothing is seen of it
        }
        let corner = |place: u32| {
            let round = &around[starts[place as usize] as usize..starts[place as usize + 1] as usize];
            let smooth = if round.len() > MOST_AROUND || crease_cosine >= 1.0 { &[][..] } else { round };
            let level = |other: &Vec3| other.normalize_or_zero().dot(flat) >= crease_cosine;
            let sum: Vec3 = smooth.iter().map(|&other| wides[other as usize]).filter(level).sum();
            let normal = sum.normalize_or(flat);
            *named.entry((place, normal.to_array().map(f32::to_bits))).or_insert_with(|| {
                let (position, albedo) = places[place as usize];
                form.corners.push(Corner { position, normal, albedo });
                form.corners.len() as u32 - 1
            })
        };
        let corners = triangle.map(corner);
        form.triangles.push(corners);
    }
    form
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roof_keeps_its_ridge_and_a_gentle_bend_is_smooth() {
        // Two slopes that meet along y.
        let roof = |rise: f32| {
            let at = |x: f32, y: f32, z: f32| (Vec3::new(x, y, z), Vec3::ONE);
            let places = [at(0.0, 0.0, rise), at(0.0, 1.0, rise), at(1.0, 0.0, 0.0), at(-1.0, 0.0, 0.0)];
            creased(&places, &[[0, 2, 1], [0, 1, 3]], 40f32.to_radians().cos())
        };
        let steep = roof(1.0);
        assert_eq!(steep.corners.len(), 6);
        assert!(steep.corners.iter().all(|c| (c.normal.z - 0.5f32.sqrt()).abs() < 1e-6));
        let gentle = roof(0.1);
        assert_eq!(gentle.corners.len(), 4);
        let ridge: Vec<_> = gentle.corners.iter().filter(|c| c.position.x == 0.0).collect();
        assert!(ridge.len() == 2 && ridge.iter().all(|c| c.normal.distance(Vec3::Z) < 1e-6), "{ridge:?}");
        assert_eq!(creased(&[(Vec3::ZERO, Vec3::ONE)], &[[0, 0, 0]], 1.0), Form::default());
    }
}
