//! Sums of the waves of a square periodic tile, by fast Fourier transform.
//!
//! All fields of a tile are real and made from one spectrum h: heights from h itself, slopes from i k h, sideways displacements from
//! i (k/|k|) h, and so on. Real fields go through a complex transform two at a time, A + iB; and because those with an even number of
//! derivatives have real multipliers of h, and those with an odd number imaginary ones, one of each kind always makes a packed spectrum that
//! is a *real* number times h. Eight fields cost four transforms, and their outputs are the fields.
//!
//! The transform works on [`LANES`] columns at once, one per vector lane, so that no butterfly ever crosses lanes: first along y for 16
//! neighbouring wave numbers in x, then, after a transposition of 16 × 16 blocks, along x for 16 neighbouring rows. Within a column it is
//! decimation in frequency by radices of 8, 4 and 2, each pass reading strided and writing in order; the order of digits
//! is put right when the results are read.
//!
//! Works this rests on: J. Cooley and J. Tukey 1965; G. Mastin, P. Watterberg and J. Mareda 1987; J. Tessendorf, *Simulating ocean water*, 2001.

pub(super) mod evolve;
pub(super) mod kernel;
pub(super) mod steps;

pub(super) use evolve::{Column, Grid};
pub(super) use kernel::{LANES, Lane, Wide};
