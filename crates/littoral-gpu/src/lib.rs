//! Littoral on the GPU.
//!
//! The caller owns device, queue and target ([`Gpu`] makes the first two for those who have none). A [`Renderer`] is made once for a device, a [`Scenery`] once
//! for a scene made ready ([`littoral::picture::Stage`]), and each frame draws what a level-of-detail method chose ([`littoral::lod::Drawing`]).
//!
//! Surfaces are drawn twice over: first only how far away they are, as triangles; then every pixel is lit once, from the data and not from the triangles.
//! So a picture costs the same light whatever the method, and two methods differ by their triangles alone.

mod device;
pub mod sea;

pub use device::{Gpu, GpuError};
pub use sea::GpuSea;
