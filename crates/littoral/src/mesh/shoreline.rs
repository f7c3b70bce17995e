//! A waterline cut into a mesh: where it crosses a level, triangles are parted along it.
//!
//! A cut keeps to the plane of its triangle, so that the surface is the same as before in every point, and with it
//! every bound of its error. Two triangles share the cut of their common edge. The line is the border of what lies
//! *above* the level: a sea that is flat at it belongs to the water.

use glam::{DVec2, DVec3};
use std::cmp::Ordering;
use std::collections::HashMap;

/// Nearer to the level than this (m) is at it: a cut so close to a vertex would be hard to tell from it.
const AT_LEVEL: f64 = 1e-6;

fn side_of(height: f64, level: f64) -> Ordering {
    let above = height - level;
    if above > AT_LEVEL {
        Ordering::Greater
    } else if above < -AT_LEVEL {
        Ordering::Less
    } else {
        Ordering::Equal
    }
}

/// Parts triangles where they cross `level`; positions are columns, rows and heights, `spacing` (m) apart.
pub(super) fn cut(positions: &mut Vec<DVec3>, triangles: &mut Vec<[u32; 3]>, spacing: DVec2, level: f64) {
    let mut side: Vec<Ordering> = positions.iter().map(|at| side_of(at.z, level)).collect();
    let mut cuts = HashMap::new();
    let mut parted = Vec::with_capacity(triangles.len());
    for &triangle in triangles.iter() {
        let sides = triangle.map(|vertex| side[vertex as usize]);
        if !(sides.contains(&Ordering::Less) && sides.contains(&Ordering::Greater)) {
            parted.push(triangle);
            continue;
        }
        // Turned so that the first corner is alone on its side, or between the two others.
        let lone = (0..3).find(|&corner| {
            let (here, next, before) = (sides[corner], sides[(corner + 1) % 3], sides[(corner + 2) % 3]);
            if here == Ordering::Equal { true } else { here != next && here != before && next == before }
        });
        let lone = lone.unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|corner| triangle[(corner + lone) % 3]);
        let mut between = |from: u32, to: u32| {
            let (low, high) = (from.min(to), from.max(to));
            *cuts.entry((low, high)).or_insert_with(|| {
                let (mut p, mut q) = (positions[low as usize], positions[high as usize]);
                // From the south-western end on, so that tiles agree on their common border to the bit.
                if (q.y, q.x) < (p.y, p.x) {
                    (p, q) = (q, p);
                }
                let part = (level - p.z) / (q.z - p.z);
                let at = p.truncate() + (q - p).truncate() * part;
                positions.push(at.extend(level));
                side.push(Ordering::Equal);
                positions.len() as u32 - 1
            })
        };
        if sides[lone] == Ordering::Equal {
            let across = between(b, c);
            parted.extend([[a, b, across], [a, across, c]]);
            continue;
        }
        let (right, left) = (between(a, b), between(c, a));
        parted.push([a, right, left]);
        // What is left has four corners: parted along its shorter diagonal.
        let length = |from: u32, to: u32| {
            let step = (positions[to as usize] - positions[from as usize]).truncate() * spacing;
            step.length_squared()
        };
        if length(right, c) <= length(left, b) {
            parted.extend([[right, b, c], [right, c, left]]);
        } else {
            parted.extend([[right, b, left], [b, c, left]]);
        }
    }
    *triangles = parted;
}

/// The edges at the level between a triangle above it and one that is not, the higher one on their left, one after the
/// other along the line.
pub(super) fn line(positions: &[DVec3], triangles: &[[u32; 3]], level: f64) -> Vec<[u32; 2]> {
    let side = |vertex: u32| side_of(positions[vertex as usize].z, level);
    let (mut above, mut other) = (Vec::new(), Vec::new());
    for &[a, b, c] in triangles {
        let high = [a, b, c].iter().any(|&vertex| side(vertex) == Ordering::Greater);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if [from, to].iter().all(|&vertex| side(vertex) == Ordering::Equal) {
                if high { above.push([from, to]) } else { other.push([to, from]) }
            }
        }
    }
    other.sort_unstable();
    above.retain(|edge| other.binary_search(edge).is_ok());
    chained(above)
}

/// The same edges, each followed by one that goes on where it ends, as far as there is one.
fn chained(mut edges: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    edges.sort_unstable();
    let mut ends: Vec<u32> = edges.iter().map(|edge| edge[1]).collect();
    ends.sort_unstable();
    // Lines that begin somewhere first, then those that are closed.
    let begins = |edge: &[u32; 2]| ends.binary_search(&edge[0]).is_err();
    let starts: Vec<usize> = (0..edges.len()).filter(|&edge| begins(&edges[edge])).chain(0..edges.len()).collect();
    let mut done = vec![false; edges.len()];
    let mut chained = Vec::with_capacity(edges.len());
    for start in starts {
        let mut next = Some(start).filter(|&edge| !done[edge]);
        while let Some(edge) = next {
            done[edge] = true;
            chained.push(edges[edge]);
            let [_, end] = edges[edge];
            let first = edges.partition_point(|other| other[0] < end);
            next = (first..edges.len()).take_while(|&other| edges[other][0] == end).find(|&other| !done[other]);
        }
    }
    chained
}
