//! Littoral on the GPU.
//!
//! The caller owns device, queue and target ([`Gpu`] makes the first two for those who have none). A [`Renderer`] is made once for a device, a [`Scenery`] once
//! for a scene made ready ([`littoral::picture::Stage`]), and each frame draws the exact
//! surface by rays ([`ShapeTexture`]) or the triangles of a level-of-detail method: chosen on the device ([`Tessellator`], [`Bisector`]), or on the processor
//! ([`littoral::lod::Drawing`]) and brought as patches ([`Expander`]) or as a mesh ([`Triangles`]).
//!
//! A picture takes two steps: first only how far away surfaces are, by rays or triangles; then every pixel is lit once, from the data and not from the triangles.
//! So light costs the same whatever the method, and pictures of two methods differ by where they find the ground alone.
//!
//! [`GpuSea`] sums the waves of a sea of tiles, for shaders to ask about any place.

mod bindings;
mod bisector;
mod coat;
mod compute;
mod device;
mod expander;
mod frame;
mod objects;
mod painter;
pub mod rays;
mod read;
mod renderer;
mod scenery;
pub mod sea;
mod tessellator;
mod times;
mod triangles;
mod waves;

pub use bisector::{BISECTION_SHADERS, Bisector};
pub use device::{Gpu, GpuError};
pub use expander::{EXPANSION_SHADER, Expander};
pub use frame::Look;
pub use objects::TooManyObjects;
pub use painter::{Painter, PainterError};
pub use rays::{ShapeError, ShapeTexture};
pub use renderer::{Ground, Renderer, SHADERS};
pub use scenery::{Scenery, TooLarge};
pub use sea::GpuSea;
pub use tessellator::{TESSELLATION_SHADERS, Tessellated, TessellationPasses, Tessellator};
pub use times::PassTimes;
pub use triangles::{TooMany, Triangles};
pub use waves::{Waves, WavesError, wave_shaders};
