//! Where things are: the datum heights are counted from, places and cells on it, views and rays.

mod cell;
mod datum;
mod ray;
mod view;

pub use cell::{Cell, Place};
pub use datum::Datum;
pub use ray::Ray;
pub use view::View;
