//! A base: walls along every border of a mesh, voids' borders too, and a flat bottom.
//!
//! The bottom needs no vertices but those below the border: it is the constrained Delaunay triangulation of the outline (L.
//! Chew, "Constrained Delaunay triangulations", 1989; the crate `spade`).
//!
//! Ground that meets itself in a single vertex, as between voids that touch at a corner, would make a wall edge between four triangles.
//! Such a vertex is parted first: each fan of triangles round it gets one of its own, a little within the fan.

use super::{Edges, Model, ModelError};
use glam::{DVec2, DVec3};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::HashMap;

/// How far parted vertices move apart, in cells: nothing on a print, and far more than rounding to `f32` can undo.
const GAP: f64 = 0.01;

/// Closes a model of ground alone, whose positions are columns, rows and heights (m), at the height `base` (m).
pub(super) fn close(model: &mut Model, base: f64) -> Result<(), ModelError> {
    let lowest = model.positions.iter().map(|at| at.z).fold(f64::INFINITY, f64::min);
    if base.is_nan() || base >= lowest {
        return Err(ModelError::Base { base, lowest });
    }
    part_pinches(model);
    let ground = model.positions.len();
    let border = Edges::new(ground, &model.triangles).border();
    let (below, bottom) = match outlined(&model.positions, &border) {
        Some(found) => found,
        // The ground itself from below: more triangles, but right whatever the outline is like.
        None => ((0..ground as u32).collect(), model.triangles.iter().map(|&[a, b, c]| [c, b, a]).collect()),
    };
    let count = border.len() * 2 + bottom.len() + model.triangles.len();
    if u32::try_from(count.max(ground + below.len())).is_err() {
        return Err(ModelError::TooLarge);
    }
    let mut names = vec![u32::MAX; ground];
    for (name, &above) in (ground as u32..).zip(&below) {
        names[above as usize] = name;
        model.positions.push(model.positions[above as usize].with_z(base));
    }
    let name = |vertex: u32| names[vertex as usize];
    model.triangles.extend(border.iter().flat_map(|&[a, b]| [[b, a, name(a)], [b, name(a), name(b)]]));
    model.triangles.extend(bottom.iter().map(|triangle| triangle.map(name)));
    Ok(())
}

/// The vertices of an outline, whose edges have the inside on their left, and triangles over it, clockwise seen from
/// above; `None` if it crosses or touches itself.
fn outlined(positions: &[DVec3], border: &[[u32; 2]]) -> Option<(Vec<u32>, Vec<[u32; 3]>)> {
    let mut vertices = border.as_flattened().to_vec();
    vertices.sort_unstable();
    vertices.dedup();
    let number = |vertex: u32| vertices.binary_search(&vertex).unwrap_or_default();
    let places = vertices.iter().map(|&vertex| positions[vertex as usize]).map(|at| Point2::new(at.x, at.y));
    let edges = border.iter().map(|edge| edge.map(number)).collect();
    let mut crossed = false;
    let net =
        ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(places.collect(), edges, |_| crossed = true);
    let net = net.ok().filter(|net| !crossed && net.num_vertices() == vertices.len())?;
    // From the border inward, never across it.
    let mut inside = vec![false; net.num_all_faces()];
    let mut next = Vec::new();
    for &[from, to] in border {
        let [from, to] = [from, to].map(|vertex| FixedVertexHandle::from_index(number(vertex)));
        let edge = net.get_edge_from_neighbors(from, to)?;
        next.extend(edge.face().as_inner());
    }
    let mut bottom = Vec::new();
    while let Some(face) = next.pop() {
        if std::mem::replace(&mut inside[face.index()], true) {
            continue;
        }
        let [a, b, c] = face.vertices().map(|vertex| vertices[vertex.index()]);
        bottom.push([c, b, a]);
        for edge in face.adjacent_edges() {
            if !edge.is_constraint_edge() {
                next.extend(edge.rev().face().as_inner());
            }
        }
    }
    Some((vertices, bottom))
}

/// Gives each fan of triangles round a vertex a vertex of its own.
fn part_pinches(model: &mut Model) {
    let edges = Edges::new(model.positions.len(), &model.triangles);
    let mut leaving = HashMap::<u32, usize>::new();
    for [from, _] in edges.border() {
        *leaving.entry(from).or_default() += 1;
    }
    let mut pinched: Vec<u32> = leaving.into_iter().filter(|(_, count)| *count > 1).map(|(vertex, _)| vertex).collect();
    pinched.sort_unstable();
    // By triangle and vertex.
    let mut renamed = HashMap::<[u32; 2], u32>::new();
    for vertex in pinched {
        let centre = model.positions[vertex as usize];
        let borders = edges.from(vertex).iter().filter(|edge| edges.left_of(edge[0], vertex).is_none());
        for (number, &[first, triangle]) in borders.enumerate() {
            let fan = fan(&edges, &model.triangles, vertex, first, triangle);
            let own = if number == 0 { vertex } else { model.positions.len() as u32 };
            renamed.extend(fan.iter().map(|corner| ([corner.triangle, vertex], own)));
            let moved = within(&model.positions, centre, &fan);
            if number == 0 {
                model.positions[vertex as usize] = moved;
            } else {
                model.positions.push(moved);
                model.normals.push(model.normals[vertex as usize]);
            }
        }
    }
    if renamed.is_empty() {
        return;
    }
    let name = |triangle: u32, vertex: u32| renamed.get(&[triangle, vertex]).copied().unwrap_or(vertex);
    for edge in &mut model.shoreline {
        if let Some(triangle) = edges.left_of(edge[0], edge[1]) {
            *edge = edge.map(|vertex| name(triangle, vertex));
        }
    }
    for (triangle, corners) in model.triangles.iter_mut().enumerate() {
        *corners = corners.map(|vertex| name(triangle as u32, vertex));
    }
}

/// A triangle of a fan, and the ends of its edge opposite to the fan's middle, counter-clockwise.
struct Corner {
    triangle: u32,
    ends: [u32; 2],
}

/// The triangles round a vertex, counter-clockwise from the border edge to `first`, which has `triangle` on its left.
fn fan(edges: &Edges, triangles: &[[u32; 3]], vertex: u32, first: u32, triangle: u32) -> Vec<Corner> {
    let mut fan = Vec::new();
    let mut next = Some((first, triangle));
    while let Some((from, triangle)) = next {
        let corners = triangles[triangle as usize];
        let to = corners.into_iter().find(|&corner| corner != vertex && corner != from).unwrap_or(from);
        fan.push(Corner { triangle, ends: [from, to] });
        next = edges.left_of(vertex, to).map(|triangle| (to, triangle));
    }
    fan
}

/// Where the middle of a fan goes: along both of its borders by [`GAP`], less where triangles are so thin that they
/// might turn over.
fn within(positions: &[DVec3], centre: DVec3, fan: &[Corner]) -> DVec3 {
    let from_centre = |vertex: u32| (positions[vertex as usize] - centre).truncate();
    let (Some(first), Some(last)) = (fan.first(), fan.last()) else { return centre };
    let inward = from_centre(first.ends[0]).normalize_or_zero() + from_centre(last.ends[1]).normalize_or_zero();
    let altitude = |corner: &Corner| {
        let [a, b] = corner.ends.map(from_centre);
        a.perp_dot(b).abs() / (b - a).length()
    };
    let thinnest = fan.iter().map(altitude).fold(f64::INFINITY, f64::min);
    let moved: DVec2 = inward * GAP.min(0.1 * thinnest);
    centre + moved.extend(0.0)
}
