//! GeoTIFF.

use crate::{Error, Source};
use std::path::Path;

/// Whether a file's first bytes are those of a TIFF or BigTIFF of either byte order.
pub fn sniff(start: &[u8]) -> bool {
    matches!(start.get(..4), Some([b'I', b'I', 42 | 43, 0] | [b'M', b'M', 0, 42 | 43]))
}

/// Opens a GeoTIFF.
///
/// # Errors
/// If the file cannot be read, is no TIFF, or holds no height samples that can be decoded.
pub fn open(file: &Path) -> Result<Box<dyn Source>, Error> {
    open_bytes(file, std::fs::read(file).map_err(|e| Error::io(file, e))?)
}

/// Opens a GeoTIFF that is in memory already; `file` only names it in errors.
///
/// # Errors
/// As [`open`].
pub fn open_bytes(file: &Path, _bytes: Vec<u8>) -> Result<Box<dyn Source>, Error> {
    Err(Error::content(file, "not yet"))
}
