//! How far a mesh is from its raster, and whether it is a mesh of it: exact answers, by integers.
//!
//! Each triangle is rasterised on the samples; which of them lie in it is decided without rounding. Whether triangles
//! cover the surface exactly once is told by their border: triangles that all turn the same way cover a point as often as
//! what is left of their edges, once those that run both ways are struck out, winds around it. So if the edges that are
//! left are the outline of the surface, each piece of it once, the surface is covered exactly once and nothing else is.

mod scan;

pub(crate) use scan::{Exactness, Plane, Spans, deviation, spans};

use super::Triangulation;
use crate::field::Raster;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// What a mesh was measured to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The greatest vertical distance (m) between the mesh and the raster at a sample; 0 where no sample is covered.
    pub max_error: f64,
    /// Column and row of a sample where it is found; the first of several, row by row.
    pub at: [u32; 2],
    /// How many samples lie in a triangle or on its border.
    pub covered: usize,
    /// How many samples of the surface lie in none. A sample is one of the surface if a patch without void has it as a corner.
    pub missed: usize,
    /// How many samples that are void lie in a triangle: none, if the mesh is cut out cleanly.
    pub void_covered: usize,
}

/// Measures the true vertical distance between a mesh and its raster at every sample that the mesh covers.
///
/// # Panics
/// If a vertex is no sample of the raster.
pub fn measure(raster: &Raster, mesh: &Triangulation) -> Measured {
    let columns = raster.columns();
    let samples = raster.heights().len();
    let covered: Vec<AtomicU64> = (0..samples.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
    let nothing = (0.0, usize::MAX);
    let greater = |a: (f64, usize), b: (f64, usize)| if b.0 > a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a };
    let one = |triangle: &[u32; 3]| {
        let corners = mesh.corners(*triangle);
        assert!(corners.iter().all(|at| (at[0] as usize) < columns && (at[1] as usize) < raster.rows()));
        if doubled_area(corners) == 0 {
            return nothing;
        }
        let mut worst = nothing;
        let plane = Plane::new(raster.heights(), columns, corners);
        spans(corners, |row, first, last| {
            let start = row as usize * columns;
            mark(&covered, start + first as usize..start + last as usize + 1);
            for index in start + first as usize..start + last as usize + 1 {
                if !raster.voids().is_void(index) {
                    let error = plane.error((index - start) as f64, f64::from(row), raster.heights()[index]);
                    worst = greater(worst, (error, index));
                }
            }
        });
        worst
    };
    let (max_error, index) = mesh.triangles.par_iter().with_min_len(256).map(one).reduce(|| nothing, greater);
    let mut measured = Measured { max_error, at: [0; 2], covered: 0, missed: 0, void_covered: 0 };
    if index != usize::MAX {
        measured.at = [(index % columns) as u32, (index / columns) as u32];
    }
    let covered: Vec<u64> = covered.into_iter().map(AtomicU64::into_inner).collect();
    measured.covered = covered.iter().map(|word| word.count_ones() as usize).sum();
    measured.void_covered =
        raster.voids().words().iter().zip(&covered).map(|(a, b)| (a & b).count_ones() as usize).sum();
    for (word, bits) in covered.iter().enumerate() {
        let mut missed = !bits;
        while missed != 0 {
            let index = word * 64 + missed.trailing_zeros() as usize;
            missed &= missed - 1;
            measured.missed += usize::from(index < samples && on_surface(raster, index % columns, index / columns));
        }
    }
    measured
}

/// Marks a range of samples.
fn mark(covered: &[AtomicU64], range: std::ops::Range<usize>) {
    let (first, last) = (range.start >> 6, (range.end - 1) >> 6);
    for (word, bits) in covered.iter().enumerate().take(last + 1).skip(first) {
        let from = if word == first { range.start & 63 } else { 0 };
        let to = if word == last { (range.end - 1) & 63 } else { 63 };
        let wanted = (u64::MAX << from) & (u64::MAX >> (63 - to));
        // Most are marked already by a neighbour.
        if bits.load(Ordering::Relaxed) & wanted != wanted {
            bits.fetch_or(wanted, Ordering::Relaxed);
        }
    }
}

/// Whether the patch whose south-western corner is this sample exists: it lies in the raster and no corner is void.
#[inline]
pub(crate) fn patch_exists(raster: &Raster, column: i64, row: i64) -> bool {
    let (columns, rows) = (raster.columns() as i64, raster.rows() as i64);
    if column < 0 || row < 0 || column + 1 >= columns || row + 1 >= rows {
        return false;
    }
    let index = (row * columns + column) as usize;
    let voids = raster.voids();
    !voids.any() || ![0, 1, raster.columns(), raster.columns() + 1].iter().any(|step| voids.is_void(index + step))
}

/// Whether a sample is a corner of a patch that exists.
fn on_surface(raster: &Raster, column: usize, row: usize) -> bool {
    let (column, row) = (column as i64, row as i64);
    [(0, 0), (1, 0), (0, 1), (1, 1)].iter().any(|(x, y)| patch_exists(raster, column - x, row - y))
}

/// Twice the area of a triangle in patches, positive when it turns counter-clockwise.
#[inline]
pub(crate) fn doubled_area([a, b, c]: [[u32; 2]; 3]) -> i64 {
    let [ax, ay] = a.map(i64::from);
    (i64::from(b[0]) - ax) * (i64::from(c[1]) - ay) - (i64::from(b[1]) - ay) * (i64::from(c[0]) - ax)
}

/// Whether a triangle that crosses no border of the surface lies on it, told by one patch that it overlaps.
#[inline]
pub(crate) fn lies_on_surface(raster: &Raster, [a, b, c]: [[u32; 2]; 3]) -> bool {
    // From corner a, the way to the middle of the opposite edge leads through the triangle, and first through this patch.
    let toward = |axis: usize| i64::from(b[axis]) + i64::from(c[axis]) - 2 * i64::from(a[axis]);
    let first = |axis: usize| i64::from(a[axis]) - i64::from(toward(axis) < 0);
    patch_exists(raster, first(0), first(1))
}

/// Why triangles are no mesh of a raster.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Flaw {
    /// A triangle names a vertex that there is not, or a vertex a sample that there is not.
    #[error("expected vertices that are samples of the raster, got {0:?}")]
    Nowhere([u32; 3]),
    /// Two vertices are one sample.
    #[error("expected one vertex at sample {0:?}, got several")]
    Twice([u32; 2]),
    /// A triangle is flat or turns clockwise.
    #[error("expected triangles that turn counter-clockwise, got {0:?}")]
    Turned([[u32; 2]; 3]),
    /// Two triangles are on the same side of an edge.
    #[error("expected one triangle on each side of the edge {0:?}, got two on one")]
    Overlap([[u32; 2]; 2]),
    /// An edge has one triangle, but is not on the outline of the surface: a crack, a T-vertex, or a void bridged.
    #[error("expected a triangle on both sides of the edge {0:?}, which is not on the outline of the surface")]
    Open([[u32; 2]; 2]),
    /// The outline of the surface has a piece that is no triangle's edge.
    #[error("expected a triangle at the outline of the surface from {0:?} to {1:?}")]
    Missing([u32; 2], [u32; 2]),
    /// Triangles meet at an edge where the other diagonal would make a Delaunay triangulation.
    #[error("expected a Delaunay triangulation, got the edge {0:?} with {1:?} within the circle")]
    NotDelaunay([[u32; 2]; 2], [u32; 2]),
}

/// Decides, by integers alone, whether triangles cover every patch that exists exactly once and nothing else, each inner edge
/// shared by exactly two triangles.
///
/// # Errors
/// The first flaw found.
pub fn verify(raster: &Raster, mesh: &Triangulation) -> Result<(), Flaw> {
    let edges = directed_edges(raster, mesh)?;
    let mut outline = Outline::new(raster);
    for &(from, to, _) in &edges {
        if edges.binary_search_by(|edge| (edge.0, edge.1).cmp(&(to, from))).is_err() && !outline.strike(from, to) {
            return Err(Flaw::Open([from, to]));
        }
    }
    outline.rest().map_or(Ok(()), |(from, to)| Err(Flaw::Missing(from, to)))
}

/// Decides, by integers alone, whether no vertex lies within the circle around a neighbouring triangle.
///
/// # Errors
/// The first flaw found.
pub fn verify_delaunay(raster: &Raster, mesh: &Triangulation) -> Result<(), Flaw> {
    let edges = directed_edges(raster, mesh)?;
    for &(from, to, apex) in &edges {
        if let Ok(other) = edges.binary_search_by(|edge| (edge.0, edge.1).cmp(&(to, from)))
            && in_circle([from, to, apex], edges[other].2)
        {
            return Err(Flaw::NotDelaunay([from, to], edges[other].2));
        }
    }
    Ok(())
}

/// Whether a sample lies strictly within the circle around three others that turn counter-clockwise.
pub(crate) fn in_circle([a, b, c]: [[u32; 2]; 3], d: [u32; 2]) -> bool {
    let from = |p: [u32; 2]| [0, 1].map(|axis| i128::from(p[axis]) - i128::from(d[axis]));
    let ([ax, ay], [bx, by], [cx, cy]) = (from(a), from(b), from(c));
    let square = |x: i128, y: i128| x * x + y * y;
    square(ax, ay) * (bx * cy - by * cx) - square(bx, by) * (ax * cy - ay * cx) + square(cx, cy) * (ax * by - ay * bx)
        > 0
}

type Edge = ([u32; 2], [u32; 2], [u32; 2]);

/// All edges with the corner opposite, in order.
fn directed_edges(raster: &Raster, mesh: &Triangulation) -> Result<Vec<Edge>, Flaw> {
    let size = [raster.columns(), raster.rows()];
    let inside = |at: &[u32; 2]| (at[0] as usize) < size[0] && (at[1] as usize) < size[1];
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    for &triangle in &mesh.triangles {
        if !triangle.iter().all(|&vertex| mesh.vertices.get(vertex as usize).is_some_and(inside)) {
            return Err(Flaw::Nowhere(triangle));
        }
        let [a, b, c] = mesh.corners(triangle);
        if doubled_area([a, b, c]) <= 0 {
            return Err(Flaw::Turned([a, b, c]));
        }
        edges.extend([(a, b, c), (b, c, a), (c, a, b)]);
    }
    let mut vertices = mesh.vertices.clone();
    vertices.par_sort_unstable();
    if let Some(pair) = vertices.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Flaw::Twice(pair[0]));
    }
    edges.par_sort_unstable();
    match edges.windows(2).find(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1)) {
        Some(pair) => Err(Flaw::Overlap([pair[0].0, pair[0].1])),
        None => Ok(edges),
    }
}

/// The outline of the surface in pieces between neighbouring samples, the surface on the left.
struct Outline {
    columns: usize,
    /// Four bits for each sample: the pieces that start there eastward, northward, westward, southward.
    pieces: Vec<u8>,
}

const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
/// The patches to the left and the right of a piece, as steps from its start.
const SIDES: [[[i64; 2]; 2]; 4] = [[[0, 0], [0, -1]], [[-1, 0], [0, 0]], [[-1, -1], [-1, 0]], [[0, -1], [-1, -1]]];

impl Outline {
    fn new(raster: &Raster) -> Outline {
        let columns = raster.columns();
        let mut pieces = vec![0; raster.heights().len()];
        let inner = !raster.voids().any();
        for (index, bits) in pieces.iter_mut().enumerate() {
            let (column, row) = ((index % columns) as i64, (index / columns) as i64);
            if inner && column > 0 && row > 0 && column + 1 < columns as i64 && row + 1 < raster.rows() as i64 {
                continue;
            }
            for (direction, sides) in SIDES.iter().enumerate() {
                let [left, right] = sides.map(|[x, y]| patch_exists(raster, column + x, row + y));
                *bits |= u8::from(left && !right) << direction;
            }
        }
        Outline { columns, pieces }
    }

    /// Takes the pieces of an edge away; false if they are not all there.
    fn strike(&mut self, from: [u32; 2], to: [u32; 2]) -> bool {
        let way = [0, 1].map(|axis| i64::from(to[axis]) - i64::from(from[axis]));
        let length = way[0].abs().max(way[1].abs());
        let Some(direction) = STEPS.iter().position(|step| step.map(|s| s * length) == way) else { return false };
        (0..length).all(|step| {
            let [column, row] = [0, 1].map(|axis| (i64::from(from[axis]) + step * STEPS[direction][axis]) as usize);
            let bits = &mut self.pieces[row * self.columns + column];
            let there = *bits >> direction & 1 == 1;
            *bits &= !(1 << direction);
            there
        })
    }

    /// A piece that is left.
    fn rest(&self) -> Option<([u32; 2], [u32; 2])> {
        let index = self.pieces.iter().position(|&bits| bits != 0)?;
        let from = [index % self.columns, index / self.columns].map(|at| at as u32);
        let step = STEPS[self.pieces[index].trailing_zeros() as usize];
        Some((from, [0, 1].map(|axis| (i64::from(from[axis]) + step[axis]) as u32)))
    }
}
