//! GeoTIFF, classic and BigTIFF, as terrain data comes: strips and tiles, overviews within or beside the file, any of the
//! usual codecs and number types.
//!
//! The skeleton (header, directories, tags) is parsed here rather than by the `tiff` crate: that crate gives no access to
//! the bytes of a chunk whose codec it does not know (LZMA, LERC), refuses sparse chunks and the number types of mixed
//! overviews, and reports damage in its own words and only when a chunk is read. The codecs are all crates.
//!
//! - `directory`: header and tags, every count held against the file's length.
//! - `image`: one image's layout, checked once.
//! - `codec`, `samples`, `heights`: from a chunk's bytes to heights.
//! - `geokeys`: where it lies.
//!
//! A chunk that is missing or broken is void, and one warning counts them.

mod codec;
mod directory;
mod geokeys;
mod heights;
mod image;
mod samples;
mod source;

use crate::formats::Input;
use crate::{Error, Source};
use std::path::Path;

/// Whether a file's first bytes are those of a TIFF or BigTIFF of either byte order.
pub fn sniff(start: &[u8]) -> bool {
    matches!(start.get(..4), Some([b'I', b'I', 42 | 43, 0] | [b'M', b'M', 0, 42 | 43]))
}

/// Opens a GeoTIFF, together with its overviews (`.ovr`), masks (`.msk`), GDAL's notes (`.aux.xml`) and world
/// file (`.tfw`) beside it.
///
/// # Errors
/// If the file cannot be read, is no TIFF, or holds no height samples that can be decoded.
pub fn open(file: &Path) -> Result<Box<dyn Source>, Error> {
    open_input(Input::file(file)?)
}

/// Opens a GeoTIFF on disk or in memory.
///
/// # Errors
/// As [`open`].
pub fn open_input(input: Input) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(source::TiffSource::open(input)?))
}
