//! From a chunk's bytes in the file to the bytes of its samples: one arm for each compression, the work done by crates.
//!
//! LERC (Esri's "limited error raster compression") is the one codec that knows about samples: it hands out numbers and a
//! mask, which is written into floating-point samples as NaN, as libtiff does.

use super::image::{Compression, Image};
use super::samples::SampleKind;
use crate::formats::raw::SampleType;

/// What decoding needs again and again; one for each thread.
#[derive(Default)]
pub(super) struct Scratch {
    /// The chunk as it is in the file.
    pub encoded: Vec<u8>,
    /// The chunk's samples, row by row, and perhaps more behind them: grown by new zero pages, never cleared, so that a
    /// size that turns out to be a lie costs no memory.
    pub decoded: Vec<u8>,
    deflate: Option<libdeflater::Decompressor>,
    zstd: Option<zstd::bulk::Decompressor<'static>>,
    inner: Vec<u8>,
}

/// More memory than this for LZMA's dictionary (KiB) is refused: xz's own presets stop at 64 MiB.
const MOST_DICTIONARY: u32 = 66 * 1024;

impl Scratch {
    /// Decodes `self.encoded` into the first `size` bytes of `self.decoded`; how many of them are good, counted from the
    /// first. The error says what the codec did not like.
    pub(super) fn decode(&mut self, image: &Image, size: usize) -> Result<usize, String> {
        if image.reversed_bits {
            self.encoded.iter_mut().for_each(|byte| *byte = byte.reverse_bits());
        }
        let most = self.encoded.len().saturating_mul(image.compression.most_expansion());
        if most < size && image.compression != Compression::None {
            return Err(format!("{} bytes cannot hold the {size} of its samples", self.encoded.len()));
        }
        let size = size.min(most);
        grow(&mut self.decoded, size);
        let Scratch { encoded, decoded, deflate, zstd, inner } = self;
        let decoded = &mut decoded[..size];
        match image.compression {
            Compression::None => {
                decoded.copy_from_slice(&encoded[..size]);
                Ok(size)
            }
            Compression::PackBits => Ok(unpack_bits(encoded, decoded)),
            Compression::Lzw => lzw(encoded, decoded),
            Compression::Deflate => inflate(deflate, encoded, decoded),
            Compression::Zstd => unzstd(zstd, encoded, decoded),
            Compression::Lzma => unxz(encoded, decoded),
            Compression::Lerc => lerc(image, encoded, decoded),
            // Anything above the raw size of the blob's samples, their mask and a header is not LERC.
            Compression::LercDeflate | Compression::LercZstd => {
                grow(inner, size + size / 8 + 4096);
                let count = match image.compression {
                    Compression::LercDeflate => inflate(deflate, encoded, inner)?,
                    _ => unzstd(zstd, encoded, inner)?,
                };
                lerc(image, &inner[..count], decoded)
            }
        }
    }
}

/// Makes a buffer at least so long. Fresh zero pages take no memory before they are written to.
fn grow(buffer: &mut Vec<u8>, size: usize) {
    if buffer.len() < size {
        *buffer = vec![0; size];
    }
}

/// Apple's run-length code: TIFF 6.0, section 9.
fn unpack_bits(mut encoded: &[u8], decoded: &mut [u8]) -> usize {
    let mut done = 0;
    while let [head, rest @ ..] = encoded {
        let room = decoded.len() - done;
        if room == 0 {
            break;
        }
        let head = *head as i8;
        if head >= 0 {
            let count = (head as usize + 1).min(rest.len()).min(room);
            decoded[done..done + count].copy_from_slice(&rest[..count]);
            done += count;
            encoded = &rest[count..];
        } else if head == -128 {
            encoded = rest;
        } else {
            let [value, rest @ ..] = rest else { break };
            let count = (1 - head as isize) as usize;
            let count = count.min(room);
            decoded[done..done + count].fill(*value);
            done += count;
            encoded = rest;
        }
    }
    done
}

fn lzw(encoded: &[u8], decoded: &mut [u8]) -> Result<usize, String> {
    if let [0, second, ..] = encoded
        && second & 1 == 1
    {
        return Err("LZW of the time before TIFF 5, with its bits reversed, is not supported".into());
    }
    let mut decoder = weezl::decode::Configuration::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
        .with_yield_on_full_buffer(true)
        .build();
    let (mut read, mut done) = (0, 0);
    loop {
        let step = decoder.decode_bytes(&encoded[read..], &mut decoded[done..]);
        read += step.consumed_in;
        done += step.consumed_out;
        match step.status {
            _ if done == decoded.len() => return Ok(done),
            Ok(weezl::LzwStatus::Done) => return Ok(done),
            Ok(_) if step.consumed_in == 0 && step.consumed_out == 0 => return Ok(done),
            Ok(_) => {}
            Err(error) if done == 0 => return Err(error.to_string()),
            Err(_) => return Ok(done),
        }
    }
}

/// zlib streams. The fast decoder knows only whole and sound ones; for the others a slower one saves what comes before
/// the damage.
fn inflate(
    decompressor: &mut Option<libdeflater::Decompressor>,
    encoded: &[u8],
    decoded: &mut [u8],
) -> Result<usize, String> {
    let fast = decompressor.get_or_insert_with(libdeflater::Decompressor::new);
    if let Ok(count) = fast.zlib_decompress(encoded, decoded) {
        return Ok(count);
    }
    let mut slow = flate2::Decompress::new(true);
    let result = slow.decompress(encoded, decoded, flate2::FlushDecompress::Finish);
    match (slow.total_out() as usize, result) {
        (0, Err(error)) => Err(error.to_string()),
        (0, Ok(_)) => Err("the stream is cut off".into()),
        (count, _) => Ok(count.min(decoded.len())),
    }
}

fn unzstd(
    decompressor: &mut Option<zstd::bulk::Decompressor<'static>>,
    encoded: &[u8],
    decoded: &mut [u8],
) -> Result<usize, String> {
    if decompressor.is_none() {
        *decompressor = Some(zstd::bulk::Decompressor::new().map_err(|error| error.to_string())?);
    }
    match decompressor {
        Some(decompressor) => decompressor.decompress_to_buffer(encoded, decoded).map_err(|error| error.to_string()),
        None => Err("no decoder".into()),
    }
}

fn unxz(encoded: &[u8], decoded: &mut [u8]) -> Result<usize, String> {
    use std::io::Read;
    let mut reader = lzma_rust2::XzReader::new_mem_limit(encoded, false, MOST_DICTIONARY);
    let mut done = 0;
    while done < decoded.len() {
        match reader.read(&mut decoded[done..]) {
            Ok(0) => break,
            Ok(count) => done += count,
            Err(error) if done == 0 => return Err(error.to_string()),
            Err(_) => break,
        }
    }
    Ok(done)
}

fn lerc(image: &Image, blob: &[u8], decoded: &mut [u8]) -> Result<usize, String> {
    let info = lerc::decode_info(blob).map_err(|error| error.to_string())?;
    let (columns, rows) = (info.width as usize, info.height as usize);
    let values = (info.depth as usize).checked_mul(info.bands as usize);
    if columns != image.chunk[0] || rows > image.chunk[1] || values != Some(image.interleaved) {
        return Err(format!(
            "expected a LERC block of {} × {} × {}, got {columns} × {rows} × {values:?}",
            image.chunk[0], image.chunk[1], image.interleaved
        ));
    }
    if info.bands > 1 {
        return Err("LERC blocks of several bands are not supported".into());
    }
    let count = columns * rows * image.interleaved;

    // Out as the bytes of native numbers. In a file of the other byte order libtiff swaps the samples before LERC takes
    // them for native, so they are swapped once more afterwards, like those of any codec.
    fn typed<T: lerc::Sample + Copy, const N: usize>(
        blob: &[u8],
        count: usize,
        interleaved: usize,
        decoded: &mut [u8],
        bytes: fn(T) -> [u8; N],
        zero: T,
        void: T,
    ) -> Result<usize, String> {
        let mut numbers = vec![zero; count];
        let result = lerc::decode_into(blob, &mut numbers).map_err(|error| error.to_string())?;
        if let Some(mask) = result.valid_masks.first().filter(|mask| !mask.is_all_valid()) {
            for (pixel, numbers) in numbers.chunks_exact_mut(interleaved).enumerate() {
                if !mask.is_valid(pixel) {
                    numbers.fill(void);
                }
            }
        }
        for (out, number) in decoded.chunks_exact_mut(N).zip(numbers) {
            out.copy_from_slice(&bytes(number));
        }
        Ok(count * N)
    }
    let interleaved = image.interleaved;
    let SampleKind::Number(number) = image.kind else { return Err("expected numbers under LERC, got bits".into()) };
    match (number, info.data_type) {
        (SampleType::I8, lerc::DataType::Char) => typed(blob, count, interleaved, decoded, i8::to_ne_bytes, 0, 0),
        (SampleType::U8, lerc::DataType::Byte) => typed(blob, count, interleaved, decoded, u8::to_ne_bytes, 0, 0),
        (SampleType::I16, lerc::DataType::Short) => typed(blob, count, interleaved, decoded, i16::to_ne_bytes, 0, 0),
        (SampleType::U16, lerc::DataType::UShort) => typed(blob, count, interleaved, decoded, u16::to_ne_bytes, 0, 0),
        (SampleType::I32, lerc::DataType::Int) => typed(blob, count, interleaved, decoded, i32::to_ne_bytes, 0, 0),
        (SampleType::U32, lerc::DataType::UInt) => typed(blob, count, interleaved, decoded, u32::to_ne_bytes, 0, 0),
        (SampleType::F32, lerc::DataType::Float) => {
            typed(blob, count, interleaved, decoded, f32::to_ne_bytes, 0.0, f32::NAN)
        }
        (SampleType::F64, lerc::DataType::Double) => {
            typed(blob, count, interleaved, decoded, f64::to_ne_bytes, 0.0, f64::NAN)
        }
        (number, got) => Err(format!("expected LERC numbers of {number:?}, got {got:?}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pack_bits_reads_the_example_of_the_specification() {
        let encoded = [0xFE, 0xAA, 0x02, 0x80, 0x00, 0x2A, 0xFD, 0xAA, 0x03, 0x80, 0x00, 0x2A, 0x22, 0xF7, 0xAA];
        let expected = [
            0xAA, 0xAA, 0xAA, 0x80, 0x00, 0x2A, 0xAA, 0xAA, 0xAA, 0xAA, 0x80, 0x00, 0x2A, 0x22, 0xAA, 0xAA, 0xAA, 0xAA,
            0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA,
        ];
        let mut decoded = [0; 24];
        assert_eq!(unpack_bits(&encoded, &mut decoded), 24);
        assert_eq!(decoded, expected);
        let mut small = [0; 4];
        assert_eq!(unpack_bits(&encoded, &mut small), 4);
        assert_eq!(small, expected[..4]);
        assert_eq!(unpack_bits(&[0x05, 1, 2], &mut decoded), 2, "a run that the data does not hold");
        assert_eq!(unpack_bits(&[0xFE], &mut decoded), 0);
    }
}
