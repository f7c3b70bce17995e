//! One file per format; none knows another.

pub mod tiff;

use crate::{Error, Source};
use std::path::Path;

/// Finds the reader for a file by its first bytes.
pub(crate) fn open(file: &Path) -> Result<Box<dyn Source>, Error> {
    Err(Error::content(file, "expected a height file of a known format"))
}
