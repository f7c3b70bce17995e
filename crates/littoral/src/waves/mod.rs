//! Waves over still water: spectra, and four models of how their sum moves.
//!
//! A *sea state* ([`SeaState`]) says how much energy waves of each frequency and direction hold; *dispersion* ([`StillWater`]) says how fast
//! each of them runs; a *model* ([`WaveModel`]) is one surface that has that energy and moves so. Models can be asked about any instant in
//! any order: nothing is stepped.
//!
//! Conventions: waves run *towards* headings in radians counter-clockwise from x (east); frequencies f are in Hz, angular ones ω in rad/s;
//! time is in seconds. Everything random comes from a seed by counting ([`random`]) and every elementary function from one library in Rust, so
//! that a sea has the same bits on every platform.

pub mod cascades;
pub mod components;
mod dispersion;
mod fft;
mod measured;
mod model;
mod peachey;
pub mod random;
mod sheltered;
pub mod shore;
mod sines;
pub mod spec;
mod spectrum;
mod spreading;
mod state;
mod sum;
mod superposition;

pub use components::PlaneWave;
pub use dispersion::{STANDARD_GRAVITY, SURFACE_TENSION, StillWater};
pub use measured::{Band, Entropy, Measured};
pub use model::{BLOCK, Bounds, Motion, Points, Velocity, WaveModel};
pub use peachey::{Beach, Depths, Path, Peachey, Surf, Swell};
pub use sheltered::{Shelter, Sheltered};
pub use shore::{Bed, ShoreError, ShoreSea, ShoreTables, ShoreWave};
pub use sines::{Length, Sine, Sines};
pub use spectrum::{Spectrum, kitaigorodskii};
pub use spreading::{Fan, Spreading};
pub use state::{SeaState, Slice, Train, Wind, bearing_from_heading, heading_from_bearing};
pub use sum::{Grid, GridScratch};
pub use superposition::Superposition;

/// A number that makes no sense where it was given.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}: expected {expected}, got {got}")]
pub struct OutOfRange {
    /// What the number stands for.
    pub what: &'static str,
    /// What would have made sense, with its unit.
    pub expected: &'static str,
    /// What was given.
    pub got: f64,
}

impl OutOfRange {
    /// `Ok` if `fine`.
    pub(crate) fn unless(fine: bool, what: &'static str, expected: &'static str, got: f64) -> Result<(), OutOfRange> {
        if fine { Ok(()) } else { Err(OutOfRange { what, expected, got }) }
    }
}
