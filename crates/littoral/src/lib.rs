//! **Littoral**: height fields of land and sea, drawn, measured and questioned with detail that follows the viewer.
//!
//! The engine is pure: numbers in, numbers out. It never opens a file, reads a clock, touches a GPU or keeps global
//! state. Two ideas keep it small: an algorithm needs to know only how low and high a square of surface reaches
//! ([`HeightField::range`](field::HeightField::range)) and how wrong a coarse drawing of it would be
//! ([`HeightField::error`](field::HeightField::error)); and most detail methods put out affine images of one stencil.
//!
//! Suggested reading order:
//!
//! 1. [`space`]: where things are — datum, place, cell, view, ray.
//! 2. [`field`]: what has a height — land from samples, noise.
//! 3. [`raycast`]: what a ray meets first; lines of sight and viewsheds.
//! 4. [`picture`]: pictures without a GPU.
//! 5. [`lod`]: triangles that follow the eye.
//! 6. [`mesh`]: meshes of a whole raster within a bound of error.
//! 7. [`objects`]: what stands on the land and floats on the sea.
//! 8. [`flight`]: paths through the air.
//!
//! Conventions: right-handed coordinates, x east, y north, z up; metres, seconds and radians unless a name says
//! otherwise; `f64` says where, `f32` says how far from the eye, integers say which.

pub mod field;
pub mod flight;
pub mod lod;
pub mod memory;
pub mod mesh;
pub mod objects;
pub mod picture;
pub mod raycast;
pub mod space;
pub mod waves;
