//! Triangulated irregular networks: the fewest triangles, Delaunay, within a bound that holds at every sample.
//!
//! Greedy insertion: the sample that is farthest from the triangulation becomes a vertex, until none is farther than was
//! asked for. Not the farthest of all each time: the threshold falls in phases, and in a phase one triangle after another is
//! refined with what arises from it, so that what is worked on lies in the caches, and a triangle is looked at when it is
//! settled and not each time a neighbour flips it. That takes a fifth of the time and no more triangles.
//!
//! Voids are cut out: the corners of their outline become vertices at once, and more samples on it until all of it is edges of
//! the triangulation, which then are fixed. Edges between neighbouring samples always are edges of a Delaunay triangulation, so
//! this ends.
//!
//! Works this rests on: M. Garland and P. Heckbert, "Fast polygonal approximation of terrains and height fields", 1995; C.
//! Lawson, "Software for C¹ surface interpolation", 1977.

mod border;
mod candidate;
mod net;
mod outline;
mod tiles;

use super::measure::lies_on_surface;
use super::{MeshError, Triangulation, tolerance};
use crate::field::Raster;
pub(super) use border::border;
use candidate::{Candidate, Ground};
use net::{CHANGED, Net, OUTSIDE};
use tiles::Tiles;

/// By how much the threshold falls from phase to phase: less makes fewer triangles, and more work.
const FALL: f32 = 0.6;

/// Meshes a raster with about as few triangles as possible so that no sample of it is farther than `max_error` (m) from them,
/// measured vertically, and none of them lies on a void. The triangulation is Delaunay but for edges on the outline of
/// voids. `progress` is told now and then which part of the work is done, and answers whether to go on.
///
/// # Errors
/// If `max_error` is negative or no number, `progress` said so, or there would be more vertices than can be named.
pub fn triangulate(
    raster: &Raster,
    max_error: f32,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Triangulation, MeshError> {
    mesh(raster, None, max_error, progress)
}

/// The same, with these vertices on the border of the raster and no others; its corners are among them always. What lies
/// between two of them on the border is taken to be no farther than `max_error` (m) from the line between them.
///
/// # Errors
/// As [`triangulate`].
pub(crate) fn triangulate_within(
    raster: &Raster,
    border: &[[u32; 2]],
    max_error: f32,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Triangulation, MeshError> {
    mesh(raster, Some(border), max_error, progress)
}

fn mesh(
    raster: &Raster,
    border: Option<&[[u32; 2]]>,
    max_error: f32,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Triangulation, MeshError> {
    let max_error = tolerance(max_error)?;
    let last = [raster.columns() as u32 - 1, raster.rows() as u32 - 1];
    let tiles = Tiles::new(raster.heights(), raster.columns());
    let kept_border = border.map(|_| last);
    let ground = Ground { heights: raster.heights(), columns: raster.columns(), tiles: &tiles, max_error, kept_border };
    let mut net = Net::over(last);
    if let Some(border) = border {
        outline::insert(&mut net, border.to_vec())?;
    }
    if raster.voids().any() {
        outline::cut_out(&mut net, raster, kept_border)?;
    }
    refine(&mut net, &ground, progress)?;
    Ok(finished(net, raster))
}

/// What was looked at last in each triangle.
#[derive(Default)]
struct Candidates(Vec<Candidate>);

impl Candidates {
    /// The candidate of a triangle as it is now.
    fn of(&mut self, triangle: u32, net: &mut Net, ground: &Ground) -> Candidate {
        let index = triangle as usize;
        if self.0.len() < net.triangles() {
            self.0.resize(net.triangles(), Candidate { at: [0; 2], error: 0.0 });
        }
        if net.flags[index] & CHANGED != 0 {
            net.flags[index] &= !CHANGED;
            self.0[index] = match net.flags[index] & OUTSIDE {
                0 => ground.candidate(net.triangle(triangle)),
                _ => Candidate { at: [0; 2], error: 0.0 },
            };
        }
        self.0[index]
    }
}

/// Inserts samples until none is too far from the net.
fn refine(net: &mut Net, ground: &Ground, progress: &(dyn Fn(f64) -> bool + Sync)) -> Result<(), MeshError> {
    let mut candidates = Candidates::default();
    let mut worst = 0f32;
    for triangle in 0..net.triangles() as u32 {
        worst = worst.max(candidates.of(triangle, net, ground).error);
    }
    // As many phases as it takes to fall to the error asked for, or to what is nothing beside the greatest.
    let worst = worst.min(f32::MAX);
    let falling = (1..46).map(|phase| worst * FALL.powi(phase));
    let mut thresholds: Vec<f32> = falling.take_while(|threshold| *threshold > ground.max_error).collect();
    thresholds.push(ground.max_error);
    let mut stack = Vec::new();
    for (phase, threshold) in thresholds.iter().copied().enumerate() {
        let mut seed = 0;
        // Those that arise in this phase are dealt with as they arise.
        let seeds = net.triangles() as u32;
        while seed < seeds {
            stack.push(seed);
            while let Some(triangle) = stack.pop() {
                let candidate = candidates.of(triangle, net, ground);
                if candidate.error > threshold {
                    if net.triangles() > u32::MAX as usize / 3 - 8 {
                        return Err(MeshError::TooMany);
                    }
                    net.insert(candidate.at, triangle);
                    stack.extend_from_slice(&net.touched);
                }
            }
            seed += 1;
            if seed % 1024 == 0 || seed == seeds {
                // Each phase makes about as many triangles as all before.
                let left = f64::from(FALL).powi((thresholds.len() - 1 - phase) as i32);
                let within = f64::from(seed) / f64::from(seeds);
                if !progress(left * (f64::from(FALL) + (1.0 - f64::from(FALL)) * within)) {
                    return Err(MeshError::Stopped);
                }
            }
        }
    }
    Ok(())
}

/// The triangles that are on the surface.
fn finished(net: Net, raster: &Raster) -> Triangulation {
    let voids = raster.voids().any();
    let kept = |t: &usize| net.flags[*t] & OUTSIDE == 0;
    let corners = |t: usize| [net.corners[3 * t], net.corners[3 * t + 1], net.corners[3 * t + 2]];
    let triangles = (0..net.triangles()).filter(kept).map(corners).collect();
    let mut mesh = Triangulation { vertices: net.vertices, triangles };
    if voids {
        mesh.drop_unused(&mut Vec::new());
    }
    mesh
}
