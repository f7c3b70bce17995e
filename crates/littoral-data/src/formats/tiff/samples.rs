//! From the bytes of samples to heights: byte order, predictors, number types.
//!
//! Based on: Adobe. TIFF revision 6.0, section 14 (horizontal differencing). 1992; Adobe Photoshop TIFF Technical Note 3
//! (the floating-point predictor: each row's bytes sorted by significance, highest first, then differenced). 2005.

use crate::formats::raw::SampleType;
use crate::voids::VoidRule;

/// What samples are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleKind {
    /// One bit, eight to a byte, the highest first: masks alone.
    Bit,
    /// Numbers of a machine type.
    Number(SampleType),
}

impl SampleKind {
    /// Bytes of one sample; of eight for bits.
    pub(super) fn size(self) -> usize {
        match self {
            SampleKind::Bit => 1,
            SampleKind::Number(number) => number.bytes() as usize,
        }
    }

    /// Whether samples are floating-point numbers.
    pub(super) fn is_float(self) -> bool {
        matches!(self, SampleKind::Number(number) if number.step() == 0.0)
    }
}

/// What was done to rows before compression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Predictor {
    /// Nothing.
    None,
    /// Each sample holds the difference from its left neighbour.
    Horizontal,
    /// Bytes sorted by significance, then differenced.
    Float,
}

/// Turns the bytes of one row, as decompressed, into native numbers. `interleaved` samples make a pixel; `scratch` is as
/// long as the row at least.
pub(super) fn restore_row(
    row: &mut [u8],
    size: usize,
    little: bool,
    predictor: Predictor,
    interleaved: usize,
    scratch: &mut Vec<u8>,
) {
    let native = little == cfg!(target_endian = "little");
    if predictor == Predictor::Float {
        scratch.clear();
        scratch.extend_from_slice(row);
        match (size, interleaved) {
            (2, 1) => gather::<2>(scratch, row),
            (4, 1) => gather::<4>(scratch, row),
            (8, 1) => gather::<8>(scratch, row),
            _ => gather_interleaved(scratch, row, size, interleaved),
        }
        return;
    }
    if !native && size > 1 {
        row.chunks_exact_mut(size).for_each(<[u8]>::reverse);
    }
    if predictor == Predictor::Horizontal {
        match size {
            1 => {
                for at in interleaved..row.len() {
                    row[at] = row[at].wrapping_add(row[at - interleaved]);
                }
            }
            2 => accumulate(row, interleaved, u16::from_ne_bytes, u16::wrapping_add, u16::to_ne_bytes),
            4 => accumulate(row, interleaved, u32::from_ne_bytes, u32::wrapping_add, u32::to_ne_bytes),
            _ => accumulate(row, interleaved, u64::from_ne_bytes, u64::wrapping_add, u64::to_ne_bytes),
        }
    }
}

/// Where the byte of a significance, 0 the highest, lies in a native number.
#[inline(always)]
fn place(plane: usize, size: usize) -> usize {
    if cfg!(target_endian = "little") { size - 1 - plane } else { plane }
}

/// Undoes the floating-point predictor of one sequence. The running sum passes through the planes one after another; each
/// plane's share of it is known beforehand from the planes' sums, so that all planes run side by side: as many
/// independent chains of additions, and the numbers are put together on the way.
fn gather<const N: usize>(planes: &[u8], row: &mut [u8]) {
    let samples = row.len() / N;
    let mut planes: [&[u8]; N] = std::array::from_fn(|plane| &planes[plane * samples..][..samples]);
    let mut sums = [0u8; N];
    for plane in 1..N {
        let before = planes[plane - 1].iter().fold(0u8, |sum, &byte| sum.wrapping_add(byte));
        sums[plane] = sums[plane - 1].wrapping_add(before);
    }
    planes = planes.map(|plane| &plane[..samples]);
    for (at, number) in row.as_chunks_mut::<N>().0.iter_mut().enumerate().take(samples) {
        for plane in 0..N {
            sums[plane] = sums[plane].wrapping_add(planes[plane][at]);
            number[place(plane, N)] = sums[plane];
        }
    }
}

/// The same by the book, for sequences that lie interleaved.
fn gather_interleaved(planes: &mut [u8], row: &mut [u8], size: usize, interleaved: usize) {
    for at in interleaved..planes.len() {
        planes[at] = planes[at].wrapping_add(planes[at - interleaved]);
    }
    // Plane 0 holds the highest bytes, whatever the byte order of the file.
    for (plane, bytes) in planes.chunks_exact(row.len() / size).take(size).enumerate() {
        for (out, &byte) in row[place(plane, size)..].iter_mut().step_by(size).zip(bytes) {
            *out = byte;
        }
    }
}

/// The running sum of each of the interleaved sequences. Monomorphic in everything: inlines to a loop over one register.
#[inline(always)]
fn accumulate<T: Copy + Default, const N: usize>(
    row: &mut [u8],
    interleaved: usize,
    from: fn([u8; N]) -> T,
    add: fn(T, T) -> T,
    to: fn(T) -> [u8; N],
) {
    let (words, _) = row.as_chunks_mut::<N>();
    if interleaved == 1 {
        let mut sum = T::default();
        for word in words {
            sum = add(sum, from(*word));
            *word = to(sum);
        }
        return;
    }
    for at in interleaved..words.len() {
        words[at] = to(add(from(words[at]), from(words[at - interleaved])));
    }
}

/// Heights (m) of every `stride`-th of a row's native numbers, from the first; NaN where void.
pub(super) fn heights_of_row(row: &[u8], kind: SampleKind, stride: usize, rule: &VoidRule, heights: &mut [f32]) {
    #[inline(always)]
    fn each<const N: usize>(
        row: &[u8],
        stride: usize,
        rule: &VoidRule,
        heights: &mut [f32],
        number: impl Fn([u8; N]) -> f64,
    ) {
        let (words, _) = row.as_chunks::<N>();
        if stride == 1 {
            for (height, word) in heights.iter_mut().zip(words) {
                *height = rule.height(number(*word));
            }
        } else {
            for (height, word) in heights.iter_mut().zip(words.iter().step_by(stride)) {
                *height = rule.height(number(*word));
            }
        }
    }
    let number = match kind {
        SampleKind::Bit => {
            for (at, height) in heights.iter_mut().enumerate() {
                *height = row.get(at / 8).map_or(f32::NAN, |byte| f32::from(byte >> (7 - at % 8) & 1));
            }
            return;
        }
        SampleKind::Number(number) => number,
    };
    match number {
        SampleType::U8 => each(row, stride, rule, heights, |b: [u8; 1]| b[0].into()),
        SampleType::I8 => each(row, stride, rule, heights, |b| i8::from_ne_bytes(b).into()),
        SampleType::U16 => each(row, stride, rule, heights, |b| u16::from_ne_bytes(b).into()),
        SampleType::I16 => each(row, stride, rule, heights, |b| i16::from_ne_bytes(b).into()),
        SampleType::U32 => each(row, stride, rule, heights, |b| u32::from_ne_bytes(b).into()),
        SampleType::I32 => each(row, stride, rule, heights, |b| i32::from_ne_bytes(b).into()),
        SampleType::U64 => each(row, stride, rule, heights, |b| u64::from_ne_bytes(b) as f64),
        SampleType::I64 => each(row, stride, rule, heights, |b| i64::from_ne_bytes(b) as f64),
        SampleType::F16 => each(row, stride, rule, heights, |b| half::f16::from_ne_bytes(b).to_f64()),
        SampleType::F32 => each(row, stride, rule, heights, |b| f32::from_ne_bytes(b).into()),
        SampleType::F64 => each(row, stride, rule, heights, f64::from_ne_bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn predictors_undo_what_writers_do() {
        // Two interleaved sequences of f32: differenced by hand, byte planes highest first.
        let numbers: Vec<f32> = (0..12).map(|i| 100.0 + 1.25 * i as f32 - (i % 3) as f32).collect();
        let native: Vec<u8> = numbers.iter().flat_map(|n| n.to_ne_bytes()).collect();
        for interleaved in [1, 2, 3] {
            let mut planes: Vec<u8> =
                (0..4).flat_map(|plane| numbers.iter().map(move |n| n.to_be_bytes()[plane])).collect();
            for at in (interleaved..planes.len()).rev() {
                planes[at] = planes[at].wrapping_sub(planes[at - interleaved]);
            }
            for little in [true, false] {
                let mut row = planes.clone();
                restore_row(&mut row, 4, little, Predictor::Float, interleaved, &mut Vec::new());
                assert_eq!(row, native);
            }
            for (size, little) in [(1, true), (2, true), (2, false), (4, true), (4, false), (8, true), (8, false)] {
                let number = |i: usize| (i as u64 * 0x0123_4567_89AB_CDEF).rotate_left(i as u32);
                let bytes = |value: u64, little: bool| {
                    let mut bytes = value.to_le_bytes()[..size].to_vec();
                    if !little {
                        bytes.reverse();
                    }
                    bytes
                };
                let stored: Vec<u8> = (0..12)
                    .flat_map(|i| {
                        let left = if i < interleaved { 0 } else { number(i - interleaved) };
                        bytes(number(i).wrapping_sub(left), little)
                    })
                    .collect();
                let expected: Vec<u8> =
                    (0..12).flat_map(|i| bytes(number(i), cfg!(target_endian = "little"))).collect();
                let mut row = stored;
                restore_row(&mut row, size, little, Predictor::Horizontal, interleaved, &mut Vec::new());
                assert_eq!(row, expected, "size {size}, little {little}, interleaved {interleaved}");
            }
        }
    }
}
