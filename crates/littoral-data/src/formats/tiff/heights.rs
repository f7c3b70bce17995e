//! One chunk of an image, from the file to heights.

use super::codec::Scratch;
use super::directory::Container;
use super::image::{Image, Segment};
use super::samples::{heights_of_row, restore_row};
use crate::voids::VoidRule;

/// What became of a chunk.
pub(super) struct Chunk {
    /// Heights (m) of the chunk's part within the image, row by row; NaN where void. Empty if none of it is stored.
    pub heights: Vec<f32>,
    /// What is wrong with it, if anything; the samples that it spoils are void.
    pub problem: Option<String>,
}

/// Reads and decodes a chunk of the first band. Whatever is missing or broken is void.
pub(super) fn decode(
    file: &Container,
    image: &Image,
    chunk: usize,
    rule: &VoidRule,
    work: &mut (Scratch, Vec<Segment>, Vec<u8>),
) -> Chunk {
    let (scratch, segments, row_scratch) = work;
    image.segments(chunk, segments);
    if segments.iter().all(|segment| segment.bytes == 0) {
        return Chunk { heights: Vec::new(), problem: None };
    }
    let [columns, rows] = image.extent(chunk);
    let row_bytes = image.row_bytes();
    // Made when the first rows have been decoded: a size that no data stands behind costs nothing.
    let mut all = Vec::new();
    let mut problem = None;
    let mut first = 0;
    for &segment in segments.iter() {
        let here = first..first + segment.rows;
        first = here.end;
        if segment.bytes == 0 {
            continue;
        }
        // Never longer than the file, and cleared only where it grows.
        scratch.encoded.resize(image.readable(segment) as usize, 0);
        let read = file.bytes.read(segment.offset, &mut scratch.encoded);
        let good = match read {
            Err(error) => Err(error.to_string()),
            Ok(0) => Err("its bytes lie past the end of the file".into()),
            Ok(got) => {
                scratch.encoded.truncate(got);
                // A compressed chunk may decode to its full size even where the image ends before it does.
                let decoded_rows = if segments_are_rows(image) { segment.rows } else { image.chunk[1] };
                scratch.decode(image, decoded_rows * row_bytes)
            }
        };
        let whole_rows = match &good {
            Ok(bytes) => bytes / row_bytes,
            Err(_) => 0,
        };
        if whole_rows < segment.rows {
            problem = Some(good.err().unwrap_or_else(|| {
                format!("expected {} rows, got {whole_rows} and the end of the data", segment.rows)
            }));
        }
        if problem.is_none() && segment.offset.saturating_add(segment.bytes) > file.bytes.length() {
            problem = Some(format!("its {} bytes overrun the file, and yet all rows were found", segment.bytes));
        }
        if whole_rows == 0 {
            continue;
        }
        all.resize(columns * rows, f32::NAN);
        let good_rows = scratch.decoded.chunks_exact_mut(row_bytes).take(whole_rows.min(segment.rows));
        for (row, heights) in good_rows.zip(all[here.start * columns..].chunks_exact_mut(columns)) {
            restore_row(row, image.kind.size(), file.little, image.predictor, image.interleaved, row_scratch);
            heights_of_row(row, image.kind, image.interleaved, rule, heights);
            if let Some(alpha) = image.alpha {
                let size = image.kind.size();
                for (height, pixel) in heights.iter_mut().zip(row.chunks_exact(size * image.interleaved)) {
                    if pixel[alpha * size..(alpha + 1) * size].iter().all(|&byte| byte == 0) {
                        *height = f32::NAN;
                    }
                }
            }
        }
    }
    Chunk { heights: all, problem }
}

fn segments_are_rows(image: &Image) -> bool {
    image.compression == super::image::Compression::None && !image.tiled
}
