//! What one image of a TIFF is made of: its size, its chunks and where they lie, and how samples are stored in them.
//!
//! Everything a decoder relies on later is checked here, once: sizes that overflow, tables too short for the size the
//! header claims, codecs and number types that cannot be read.

use super::directory::{Container, Directory};
use super::samples::{Predictor, SampleKind};
use crate::formats::raw::SampleType;

/// No chunk may be larger when decoded (bytes): writers use kilobytes to a few megabytes, and a single strip for a whole
/// uncompressed image, which is not read as one.
const LARGEST_CHUNK: u64 = 1 << 30;
/// Rows of uncompressed strips are read in portions of about this many bytes.
const PORTION: usize = 1 << 18;
/// A file is believed to hold so many samples for each of its bytes, and `FEW` in any case. Blocks that are all one value
/// or not stored at all reach some ten thousand.
const MOST_SAMPLES_PER_BYTE: u64 = 1 << 16;
const FEW: u64 = 1 << 28;
/// A file is believed to be so many columns wide for each of its bytes, and `NARROW` in any case, since rows are read whole.
const MOST_COLUMNS_PER_BYTE: u64 = 16;
const NARROW: u64 = 1 << 20;
/// The longest side of an image: the most that is left when an `i32` counts pixels, as in most software that writes them.
const LONGEST_SIDE: u64 = i32::MAX as u64;

/// Tags of TIFF 6.0 and its extensions, as far as they are needed.
pub(super) mod tag {
    pub const NEW_SUBFILE_TYPE: u16 = 254;
    pub const COLUMNS: u16 = 256;
    pub const ROWS: u16 = 257;
    pub const BITS: u16 = 258;
    pub const COMPRESSION: u16 = 259;
    pub const FILL_ORDER: u16 = 266;
    pub const STRIP_OFFSETS: u16 = 273;
    pub const BANDS: u16 = 277;
    pub const ROWS_PER_STRIP: u16 = 278;
    pub const STRIP_BYTES: u16 = 279;
    pub const PLANAR: u16 = 284;
    pub const PREDICTOR: u16 = 317;
    pub const TILE_COLUMNS: u16 = 322;
    pub const TILE_ROWS: u16 = 323;
    pub const TILE_OFFSETS: u16 = 324;
    pub const TILE_BYTES: u16 = 325;
    pub const EXTRA_SAMPLES: u16 = 338;
    pub const SAMPLE_FORMAT: u16 = 339;
    pub const PIXEL_SCALE: u16 = 33550;
    pub const TIE_POINTS: u16 = 33922;
    pub const TRANSFORMATION: u16 = 34264;
    pub const GEO_KEYS: u16 = 34735;
    pub const GEO_DOUBLES: u16 = 34736;
    pub const GEO_TEXT: u16 = 34737;
    pub const GDAL_METADATA: u16 = 42112;
    pub const GDAL_NODATA: u16 = 42113;
    pub const LERC_PARAMETERS: u16 = 50674;
}

/// How chunks are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    PackBits,
    Lzw,
    Deflate,
    Zstd,
    Lzma,
    Lerc,
    LercDeflate,
    LercZstd,
}

impl Compression {
    /// How many bytes one encoded byte can stand for at most.
    pub(super) fn most_expansion(self) -> usize {
        match self {
            Compression::None => 1,
            // Two bytes for a run of 128.
            Compression::PackBits => 64,
            // Twelve bits for a string as long as the table.
            Compression::Lzw => 4096,
            // Two bits for a match of 258.
            Compression::Deflate => 1032,
            // Three bytes for a block of 128 KiB; LZMA's long matches stay below that.
            Compression::Zstd | Compression::Lzma => 1 << 16,
            // A constant block is a header, whatever its size.
            Compression::Lerc | Compression::LercDeflate | Compression::LercZstd => 1 << 24,
        }
    }

    /// Whether the codec deals in numbers rather than bytes, and leaves predictors out.
    pub(super) fn is_lerc(self) -> bool {
        matches!(self, Compression::Lerc | Compression::LercDeflate | Compression::LercZstd)
    }
}

/// One image of a TIFF, ready to be decoded chunk by chunk.
pub(super) struct Image {
    pub columns: usize,
    pub rows: usize,
    /// Columns and rows of a chunk: a tile, a strip, or a portion of uncompressed strips.
    pub chunk: [usize; 2],
    /// Number of chunks across and down.
    pub across: usize,
    pub down: usize,
    /// How many bands the image has.
    pub bands: usize,
    /// How many of them lie interleaved in a chunk: all or one.
    pub interleaved: usize,
    /// Which of the interleaved ones is an alpha band, where 0 means void.
    pub alpha: Option<usize>,
    pub kind: SampleKind,
    pub compression: Compression,
    pub predictor: Predictor,
    /// Bytes have their bits in reversed order (FillOrder 2).
    pub reversed_bits: bool,
    pub tiled: bool,
    /// Rows of a strip in the file, where portions of strips are read.
    strip_rows: Option<usize>,
    offsets: Vec<u64>,
    bytes: Vec<u64>,
    /// Bytes in the file.
    length: u64,
}

/// Where a chunk's bytes lie in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Segment {
    pub offset: u64,
    pub bytes: u64,
    /// The chunk's rows that lie there.
    pub rows: usize,
}

impl Image {
    /// Understands the directory of heights. The error reads "expected …, got …; what to do".
    pub(super) fn new(file: &Container, directory: &Directory) -> Result<Image, String> {
        Image::of_kind(file, directory, kind(file, directory)?)
    }

    /// Understands the directory of a mask, whose samples may be single bits.
    pub(super) fn mask(file: &Container, directory: &Directory) -> Result<Image, String> {
        let bits = file.unsigned(directory, tag::BITS)?.unwrap_or(1);
        let bands = file.unsigned(directory, tag::BANDS)?.unwrap_or(1);
        let kind = if bits == 1 && bands == 1 { SampleKind::Bit } else { kind(file, directory)? };
        Image::of_kind(file, directory, kind)
    }

    fn of_kind(file: &Container, directory: &Directory, kind: SampleKind) -> Result<Image, String> {
        let number = |tag, name: &str| {
            file.unsigned(directory, tag)?.ok_or_else(|| format!("expected the image's {name} (tag {tag}), got none"))
        };
        let or = |tag, default| Ok::<u64, String>(file.unsigned(directory, tag)?.unwrap_or(default));
        let (columns, rows) = (number(tag::COLUMNS, "width")?, number(tag::ROWS, "height")?);
        let bands = or(tag::BANDS, 1)?;
        let area = columns.checked_mul(rows).and_then(|area| area.checked_mul(bands)?.checked_mul(kind.size() as u64));
        if columns.max(rows) > LONGEST_SIDE || area.is_none_or(|area| area > i64::MAX as u64) {
            return Err(format!(
                "expected a size that a raster can have, got {columns} × {rows}; the header is damaged"
            ));
        }
        let length = file.bytes.length();
        if columns > NARROW.max(length.saturating_mul(MOST_COLUMNS_PER_BYTE))
            || columns * rows > FEW.max(length.saturating_mul(MOST_SAMPLES_PER_BYTE))
        {
            return Err(format!(
                "expected a size that {length} bytes can hold, got {columns} × {rows} samples; the header is damaged"
            ));
        }
        if columns == 0 || rows == 0 || bands == 0 || bands > 65_535 {
            return Err(format!("expected at least one sample, got {columns} × {rows} of {bands} bands"));
        }
        let compression = compression(file, directory, kind)?;
        let predictor = match or(tag::PREDICTOR, 1)? {
            // Other codecs do not know the tag, and libtiff leaves it out of account there.
            _ if matches!(compression, Compression::None | Compression::PackBits) || compression.is_lerc() => {
                Predictor::None
            }
            1 => Predictor::None,
            2 => Predictor::Horizontal,
            3 if kind.is_float() => Predictor::Float,
            3 => return Err(format!("expected floating-point samples under predictor 3, got {kind:?}")),
            other => return Err(format!("expected predictor 1, 2 or 3, got {other}")),
        };
        let chunky = match or(tag::PLANAR, 1)? {
            1 => true,
            2 => bands == 1,
            other => return Err(format!("expected planar configuration 1 or 2, got {other}")),
        };
        let interleaved = if chunky { bands } else { 1 };
        // Both fit: bands and sizes were checked above.
        let pixel_bytes = interleaved * kind.size() as u64;

        let tiled = file.unsigned(directory, tag::TILE_COLUMNS)?.is_some();
        let (chunk_columns, chunk_rows) = if tiled {
            (number(tag::TILE_COLUMNS, "tile width")?, number(tag::TILE_ROWS, "tile height")?)
        } else {
            (columns, or(tag::ROWS_PER_STRIP, rows)?.min(rows))
        };
        let what = if tiled { "tile" } else { "strip" };
        if chunk_columns == 0 || chunk_rows == 0 {
            return Err(format!("expected {what}s of at least one sample, got {chunk_columns} × {chunk_rows}"));
        }
        let chunk_bytes = chunk_columns.checked_mul(chunk_rows).and_then(|samples| samples.checked_mul(pixel_bytes));
        // Portions of an uncompressed strip are read, so that its size does not matter.
        let portioned = !tiled && compression == Compression::None;
        if !portioned && chunk_bytes.is_none_or(|bytes| bytes > LARGEST_CHUNK) {
            return Err(format!(
                "expected {what}s of at most {} MiB, got {chunk_columns} × {chunk_rows} samples of {pixel_bytes} bytes; \
                 `gdal_translate -of GTiff -co TILED=YES -co COMPRESS=DEFLATE in.tif out.tif` writes smaller ones",
                LARGEST_CHUNK >> 20
            ));
        }

        let (across, down) = (columns.div_ceil(chunk_columns), rows.div_ceil(chunk_rows));
        let needed = across * down;
        let (offset_tag, bytes_tag) =
            if tiled { (tag::TILE_OFFSETS, tag::TILE_BYTES) } else { (tag::STRIP_OFFSETS, tag::STRIP_BYTES) };
        let offsets = file
            .unsigneds(directory, offset_tag)?
            .ok_or_else(|| format!("expected a table of {what}s (tag {offset_tag}), got none"))?;
        if (offsets.len() as u64) < needed {
            return Err(format!(
                "expected {needed} {what}s for {columns} × {rows} samples, got a table of {}; the header is damaged",
                offsets.len()
            ));
        }
        let bytes = match file.unsigneds(directory, bytes_tag)? {
            Some(bytes) if bytes.len() >= offsets.len().min(needed as usize) => bytes,
            // Some old writers leave the sizes of uncompressed strips to be worked out.
            _ if compression == Compression::None => vec![chunk_bytes.unwrap_or(u64::MAX); offsets.len()],
            _ => return Err(format!("expected the byte count of each {what} (tag {bytes_tag}), got too few")),
        };
        if tiled && compression == Compression::None && offsets.iter().all(|&offset| offset >= file.bytes.length()) {
            return Err(format!("expected {what}s within the file, got only offsets past its end; it is cut off"));
        }

        let row_bytes = if kind == SampleKind::Bit { columns.div_ceil(8) } else { columns * pixel_bytes } as usize;
        let (chunk, strip_rows) = if portioned {
            let portion = (PORTION / row_bytes.max(1)).clamp(1, rows as usize);
            ([columns as usize, portion], Some(chunk_rows as usize))
        } else {
            ([chunk_columns as usize, chunk_rows as usize], None)
        };
        // Extra bands are the last ones; 1 and 2 are alpha, premultiplied and not.
        let extra = file.unsigneds(directory, tag::EXTRA_SAMPLES)?.unwrap_or_default();
        let alpha = (extra.iter().position(|&extra| extra == 1 || extra == 2))
            .and_then(|at| (bands as usize).checked_sub(extra.len())?.checked_add(at))
            .filter(|&at| chunky && at > 0 && at < bands as usize);
        Ok(Image {
            columns: columns as usize,
            rows: rows as usize,
            chunk,
            across: across as usize,
            down: rows.div_ceil(chunk[1] as u64) as usize,
            bands: bands as usize,
            interleaved: interleaved as usize,
            alpha,
            kind,
            compression,
            predictor,
            reversed_bits: or(tag::FILL_ORDER, 1)? == 2,
            tiled,
            strip_rows,
            offsets,
            bytes,
            length: file.bytes.length(),
        })
    }

    /// Bytes of one row of a chunk, all interleaved bands included.
    pub(super) fn row_bytes(&self) -> usize {
        let samples = self.chunk[0] * self.interleaved;
        if self.kind == SampleKind::Bit { samples.div_ceil(8) } else { samples * self.kind.size() }
    }

    /// Columns and rows of a chunk that lie within the image.
    pub(super) fn extent(&self, chunk: usize) -> [usize; 2] {
        let (x, y) = (chunk % self.across * self.chunk[0], chunk / self.across * self.chunk[1]);
        [self.chunk[0].min(self.columns - x), self.chunk[1].min(self.rows - y)]
    }

    /// Where the bytes of a chunk of the first band lie: one segment for tiles and compressed strips, one for each strip
    /// touched otherwise. A segment of no bytes is not stored.
    pub(super) fn segments(&self, chunk: usize, out: &mut Vec<Segment>) {
        out.clear();
        let Some(strip_rows) = self.strip_rows else {
            let bytes = if self.offsets[chunk] == 0 { 0 } else { self.bytes[chunk] };
            return out.push(Segment { offset: self.offsets[chunk], bytes, rows: self.extent(chunk)[1] });
        };
        let (mut row, end) = (chunk * self.chunk[1], chunk * self.chunk[1] + self.extent(chunk)[1]);
        while row < end {
            let (strip, within) = (row / strip_rows, row % strip_rows);
            let rows = (strip_rows - within).min(end - row);
            let (skip, wanted) = ((within * self.row_bytes()) as u64, (rows * self.row_bytes()) as u64);
            let stored = if self.offsets[strip] == 0 { 0 } else { self.bytes[strip].saturating_sub(skip).min(wanted) };
            out.push(Segment { offset: self.offsets[strip].saturating_add(skip), bytes: stored, rows });
            row += rows;
        }
    }

    /// How many bytes of a segment the file holds and a sound encoder could have written: what is worth reading.
    pub(super) fn readable(&self, segment: Segment) -> u64 {
        let decoded = (segment.rows.max(self.chunk[1]) * self.row_bytes()) as u64;
        segment.bytes.min(self.length.saturating_sub(segment.offset)).min(2 * decoded + 65_536)
    }
}

/// The number type of the first band.
fn kind(file: &Container, directory: &Directory) -> Result<SampleKind, String> {
    let bits = file.unsigneds(directory, tag::BITS)?.unwrap_or_else(|| vec![1]);
    let format = file.unsigned(directory, tag::SAMPLE_FORMAT)?.unwrap_or(1);
    let first = bits.first().copied().unwrap_or(1);
    if let Some(other) = bits.iter().find(|&&other| other != first) {
        return Err(format!("expected bands of one bit depth, got {first} and {other}"));
    }
    let number = match (format, first) {
        (1 | 4, 8) => Ok(SampleType::U8),
        (1 | 4, 16) => Ok(SampleType::U16),
        (1 | 4, 32) => Ok(SampleType::U32),
        (1 | 4, 64) => Ok(SampleType::U64),
        (2, 8) => Ok(SampleType::I8),
        (2, 16) => Ok(SampleType::I16),
        (2, 32) => Ok(SampleType::I32),
        (2, 64) => Ok(SampleType::I64),
        (3, 16) => Ok(SampleType::F16),
        (3, 32) => Ok(SampleType::F32),
        (3, 64) => Ok(SampleType::F64),
        (5 | 6, _) => Err("expected real samples, got complex numbers, which are not heights".into()),
        (1..=4, bits) => Err(format!(
            "expected samples of 8, 16, 32 or 64 bits, got {bits}; `gdal_translate -of GTiff -co COMPRESS=DEFLATE -ot \
             Float32 in.tif out.tif` converts them"
        )),
        (format, _) => {
            Err(format!("expected sample format 1, 2 or 3 (unsigned, signed, floating point), got {format}"))
        }
    };
    number.map(SampleKind::Number)
}

fn compression(file: &Container, directory: &Directory, kind: SampleKind) -> Result<Compression, String> {
    let code = file.unsigned(directory, tag::COMPRESSION)?.unwrap_or(1);
    let name = match code {
        1 => return Ok(Compression::None),
        5 => return Ok(Compression::Lzw),
        8 | 32946 => return Ok(Compression::Deflate),
        32773 => return Ok(Compression::PackBits),
        34925 => return Ok(Compression::Lzma),
        50000 => return Ok(Compression::Zstd),
        34887 => {
            let parameters = file.unsigneds(directory, tag::LERC_PARAMETERS)?.unwrap_or_default();
            return match parameters.get(1).copied().unwrap_or(0) {
                0 => Ok(Compression::Lerc),
                1 => Ok(Compression::LercDeflate),
                2 => Ok(Compression::LercZstd),
                other => Err(format!("expected LERC alone, with Deflate or with ZSTD, got additional codec {other}")),
            };
        }
        2..=4 => "CCITT fax",
        6 | 7 if kind != SampleKind::Number(SampleType::U8) => {
            return Err(format!(
                "expected a lossless codec for {kind:?} samples, got JPEG (code {code}), which holds 8-bit pictures only; \
                 the header is damaged"
            ));
        }
        6 | 7 => "JPEG",
        34712 => "JPEG 2000",
        50001 => "WebP",
        50002 | 52546 => "JPEG XL",
        _ => "unknown",
    };
    Err(format!(
        "expected compression none, LZW, Deflate, PackBits, ZSTD, LZMA or LERC, got {name} (code {code}); \
         `gdal_translate -of GTiff -co COMPRESS=DEFLATE in.tif out.tif` rewrites the file"
    ))
}
