//! The outline of voids as edges of the triangulation.

use super::*;
use crate::mesh::measure::patch_exists;
use std::collections::HashSet;

/// A piece of the outline: two samples on a line along an axis.
type Segment = [[u32; 2]; 2];

/// Makes the outline of the surface edges of the net, fixes them, and marks the triangles beyond.
/// Where the border is kept, its pieces are edges already, with the corners of the outline among their ends.
pub(super) fn cut_out(net: &mut Net, raster: &Raster, kept_border: Option<[u32; 2]>) -> Result<(), MeshError> {
    let mut segments = segments(raster);
    if let Some(last) = kept_border {
        segments.retain(|[a, b]| !(0..2).any(|i| a[i] == b[i] && (a[i] == 0 || a[i] == last[i])));
    }
    let mut places: Vec<[u32; 2]> = segments.iter().flatten().copied().collect();
    while !places.is_empty() {
        insert(net, std::mem::take(&mut places))?;
        // Edges that lie along an axis; what is missing of the outline is halved.
        let edges: HashSet<Segment> = (0..net.corners.len() as u32).filter_map(|edge| along_axis(net, edge)).collect();
        let mut halved = Vec::with_capacity(segments.len());
        for [from, to] in segments {
            if edges.contains(&[from, to]) || edges.contains(&[to, from]) {
                halved.push([from, to]);
            } else {
                let middle = [0, 1].map(|axis| u32::midpoint(from[axis], to[axis]));
                places.push(middle);
                halved.extend([[from, middle], [middle, to]]);
            }
        }
        segments = halved;
    }
    let segments: HashSet<Segment> = segments.into_iter().collect();
    for edge in 0..net.corners.len() as u32 {
        if along_axis(net, edge)
            .is_some_and(|[from, to]| segments.contains(&[from, to]) || segments.contains(&[to, from]))
        {
            net.fix_edge(edge);
        }
    }
    for triangle in 0..net.triangles() as u32 {
        if !lies_on_surface(raster, net.triangle(triangle)) {
            net.flags[triangle as usize] |= OUTSIDE;
        }
    }
    Ok(())
}

/// Makes samples vertices.
pub(super) fn insert(net: &mut Net, mut places: Vec<[u32; 2]>) -> Result<(), MeshError> {
    shuffle(&mut places);
    let mut near = 0;
    for at in places {
        if net.triangles() > u32::MAX as usize / 3 - 8 {
            return Err(MeshError::TooMany);
        }
        near = net.locate(at, near);
        net.insert(at, near);
    }
    Ok(())
}

fn along_axis(net: &Net, edge: u32) -> Option<Segment> {
    let (from, to) = (net.at(edge), net.at(net::next(edge)));
    (from[0] == to[0] || from[1] == to[1]).then_some([from, to])
}

/// Straight pieces of the outline of the surface, from corner to corner, inside the raster and on its border.
fn segments(raster: &Raster) -> Vec<Segment> {
    let (columns, rows) = (raster.columns() as i64, raster.rows() as i64);
    let exists = |x: i64, y: i64| patch_exists(raster, x, y);
    // Whether the piece east or north of a sample is on the outline.
    let east = |x: i64, y: i64| exists(x, y) != exists(x, y - 1);
    let north = |x: i64, y: i64| exists(x, y) != exists(x - 1, y);
    // Whether the outline is not straight at a sample.
    let corner = |x: i64, y: i64| {
        let (e, w, n, s) = (east(x, y), east(x - 1, y), north(x, y), north(x, y - 1));
        e != w || n != s || (e && n)
    };
    let mut segments = Vec::new();
    let at = |x: i64, y: i64| [x as u32, y as u32];
    for y in 0..rows {
        let mut from = None;
        for x in 0..columns {
            if let Some(begin) = from
                && corner(x, y)
            {
                segments.push([at(begin, y), at(x, y)]);
                from = None;
            }
            if from.is_none() && east(x, y) {
                from = Some(x);
            }
        }
    }
    for x in 0..columns {
        let mut from = None;
        for y in 0..rows {
            if let Some(begin) = from
                && corner(x, y)
            {
                segments.push([at(x, begin), at(x, y)]);
                from = None;
            }
            if from.is_none() && north(x, y) {
                from = Some(y);
            }
        }
    }
    segments
}

/// An order in which insertion is quick: rounds of random samples, each round twice the one before, neighbours near each
/// other (N. Amenta, S. Choi, G. Rote, "Incremental constructions con BRIO", 2003).
fn shuffle(places: &mut Vec<[u32; 2]>) {
    let key = |at: &[u32; 2]| {
        let hash = (u64::from(at[0]) << 32 | u64::from(at[1])).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let hash = (hash ^ hash >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (u32::MAX - hash.leading_zeros().min(16), interleaved(at[0]) | interleaved(at[1]) << 1)
    };
    places.sort_by_cached_key(key);
    places.dedup();
}

/// A number's bits, each before one of another's.
fn interleaved(number: u32) -> u64 {
    let mut bits = u64::from(number);
    for (shift, mask) in [(16, 0x0000_ffff_0000_ffff), (8, 0x00ff_00ff_00ff_00ff), (4, 0x0f0f_0f0f_0f0f_0f0f)] {
        bits = (bits | bits << shift) & mask;
    }
    bits = (bits | bits << 2) & 0x3333_3333_3333_3333;
    (bits | bits << 1) & 0x5555_5555_5555_5555
}
