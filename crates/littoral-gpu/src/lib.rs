//! Littoral on the GPU.
//!
//! The caller owns device, queue and target ([`Gpu`] makes the first two for those who have none). A [`Renderer`] is made once for a device, a [`Scenery`] once
//! for a scene made ready ([`littoral::picture::Stage`]), and each frame draws what a level-of-detail method chose ([`littoral::lod::Drawing`]).
//!
//! A picture takes two steps: first only how far away surfaces are, as triangles; then every pixel is lit once, from the data and not from the triangles.
//! So light costs the same whatever the method, and pictures of two methods differ by their triangles alone.
//!
//! [`GpuSea`] sums the waves of a sea of tiles, for shaders to ask about any place.

mod coat;
mod device;
mod frame;
mod painter;
mod renderer;
mod scenery;
pub mod sea;
mod tessellator;
mod triangles;
mod waves;

pub use device::{Gpu, GpuError};
pub use frame::Look;
pub use painter::{Painter, PainterError};
pub use renderer::{Renderer, SHADERS};
pub use scenery::{Scenery, TooLarge};
pub use sea::GpuSea;
pub use tessellator::{TESSELLATION_SHADERS, Tessellated, Tessellator};
pub use triangles::{TooMany, Triangles};
pub use waves::{WavesError, wave_shaders};
