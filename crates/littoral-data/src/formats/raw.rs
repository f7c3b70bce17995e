//! Samples that lie in a file as plain numbers, row after row: read by seeking, so that a window of a file larger than
//! memory costs no more than the window.

use super::Input;
use crate::voids::VoidRule;
use crate::{Error, Info, Level, Source};
use littoral::field::{Raster, Window};
use littoral::memory::in_large_pages;

/// The machine type of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SampleType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

impl SampleType {
    /// Bytes of one sample.
    pub fn bytes(self) -> u64 {
        match self {
            SampleType::U8 | SampleType::I8 => 1,
            SampleType::U16 | SampleType::I16 | SampleType::F16 => 2,
            SampleType::U32 | SampleType::I32 | SampleType::F32 => 4,
            SampleType::U64 | SampleType::I64 | SampleType::F64 => 8,
        }
    }

    /// Distance between neighbouring numbers of this type: 1, or 0 for floating point.
    pub fn step(self) -> f64 {
        if matches!(self, SampleType::F16 | SampleType::F32 | SampleType::F64) { 0.0 } else { 1.0 }
    }
}

/// How samples lie in a file.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Bytes before the first sample.
    pub offset: u64,
    /// Type of a sample.
    pub sample: SampleType,
    /// Byte order.
    pub big_endian: bool,
    /// Bytes from one sample of a row to the next.
    pub sample_stride: u64,
    /// Bytes from one row to the next.
    pub row_stride: u64,
    /// Whether the file begins with the southern row; windows are handed out from the north all the same.
    pub south_first: bool,
}

impl Layout {
    /// Rows of `columns` samples without gaps, from the north.
    pub fn plain(offset: u64, sample: SampleType, big_endian: bool, columns: usize) -> Layout {
        let sample_stride = sample.bytes();
        let row_stride = columns as u64 * sample_stride;
        Layout { offset, sample, big_endian, sample_stride, row_stride, south_first: false }
    }
}

/// A file of plain samples.
pub struct RawSource {
    input: Input,
    info: Info,
    level: [Level; 1],
    layout: Layout,
    rule: VoidRule,
}

impl RawSource {
    /// Checks `layout` against the file's length. A file that ends early reads as void from there on, with a warning; if
    /// less than a quarter of it is there, the header is not believed.
    ///
    /// # Errors
    /// If the size is impossible, or most of the file is missing.
    pub fn new(input: Input, mut info: Info, layout: Layout, rule: VoidRule) -> Result<RawSource, Error> {
        check_size(&input, info.columns as u64, info.rows as u64)?;
        let Layout { offset, sample, sample_stride, row_stride, .. } = layout;
        let needed = (info.rows as u64 - 1)
            .checked_mul(row_stride)
            .and_then(|n| n.checked_add((info.columns as u64 - 1).checked_mul(sample_stride)?))
            .and_then(|n| n.checked_add(sample.bytes()))
            .filter(|n| n.checked_add(offset).is_some_and(|end| end < i64::MAX as u64))
            .ok_or_else(|| input.error("expected a header whose sizes fit in a file, got an overflow"))?;
        let there = input.length().saturating_sub(offset);
        if there < needed {
            let what = format!("{needed} bytes of samples for {} × {}", info.columns, info.rows);
            if there < needed.div_ceil(4) {
                return Err(
                    input.error(format!("expected {what}, got {there}; the header is wrong or the file cut off"))
                );
            }
            info.warnings.push(format!("expected {what}, got {there}: the file is cut off, the rest is void"));
        }
        let level = [Level { columns: info.columns, rows: info.rows }];
        Ok(RawSource { input, info, level, layout, rule })
    }
}

/// That a raster can have such sides.
pub(crate) fn check_size(input: &Input, columns: u64, rows: u64) -> Result<(), Error> {
    let most = Raster::MAX_SIDE as u64;
    if (1..=most).contains(&columns) && (1..=most).contains(&rows) {
        return Ok(());
    }
    Err(input.error(format!("expected 1 to {most} samples a side, got {columns} × {rows}; the header is broken")))
}

impl Source for RawSource {
    fn info(&self) -> &Info {
        &self.info
    }

    fn levels(&self) -> &[Level] {
        &self.level
    }

    fn read(&mut self, _level: usize, window: Window) -> Result<Vec<f32>, Error> {
        let Layout { offset, sample, sample_stride, row_stride, south_first, .. } = self.layout;
        let mut heights = in_large_pages(Vec::with_capacity(window.columns * window.rows));
        if window.columns == 0 {
            return Ok(heights);
        }
        let span = (window.columns as u64 - 1) * sample_stride + sample.bytes();
        let mut bytes = vec![0u8; span as usize];
        for row in window.row..window.row + window.rows {
            let stored_row = if south_first { self.info.rows - 1 - row } else { row };
            let start = offset + stored_row as u64 * row_stride + window.column as u64 * sample_stride;
            let there = self.input.length().saturating_sub(start).min(span) as usize;
            if there > 0 {
                self.input.read_at(start, &mut bytes[..there])?;
            }
            decode_row(&bytes[..there], self.layout, &self.rule, window.columns, &mut heights);
            heights.resize((row - window.row + 1) * window.columns, f32::NAN);
        }
        Ok(heights)
    }
}

/// Appends the heights of up to `columns` whole samples of `bytes`.
fn decode_row(bytes: &[u8], layout: Layout, rule: &VoidRule, columns: usize, heights: &mut Vec<f32>) {
    let stride = layout.sample_stride as usize;
    macro_rules! decode {
        ($number:ty) => {
            decode!($number, |n| n as f64)
        };
        ($number:ty, $to:expr) => {{
            const SIZE: usize = size_of::<$number>();
            let samples = bytes.chunks(stride).filter_map(|chunk| chunk.first_chunk::<SIZE>()).take(columns);
            let to: fn($number) -> f64 = $to;
            if layout.big_endian {
                heights.extend(samples.map(|&s| rule.height(to(<$number>::from_be_bytes(s)))));
            } else {
                heights.extend(samples.map(|&s| rule.height(to(<$number>::from_le_bytes(s)))));
            }
        }};
    }
    match layout.sample {
        SampleType::U8 => decode!(u8),
        SampleType::I8 => decode!(i8),
        SampleType::U16 => decode!(u16),
        SampleType::I16 => decode!(i16),
        SampleType::U32 => decode!(u32),
        SampleType::I32 => decode!(i32),
        SampleType::U64 => decode!(u64),
        SampleType::I64 => decode!(i64),
        SampleType::F16 => decode!(half::f16, half::f16::to_f64),
        SampleType::F32 => decode!(f32),
        SampleType::F64 => decode!(f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::info;

    fn source(bytes: Vec<u8>, columns: usize, rows: usize, layout: Layout) -> Result<RawSource, Error> {
        let input = Input::memory("t.raw", bytes);
        RawSource::new(input, info("raw", columns, rows), layout, VoidRule::default())
    }

    #[test]
    fn windows_of_interleaved_south_first_rows() {
        // 3 × 2 pixels of two bands, little-endian; the second band is 100, 101 … from the south-west.
        let numbers: Vec<i16> = (0..6).flat_map(|i| [-1, 100 + i]).collect();
        let bytes = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        let layout = Layout {
            offset: 2,
            sample: SampleType::I16,
            big_endian: false,
            sample_stride: 4,
            row_stride: 12,
            south_first: true,
        };
        let mut source = source(bytes, 3, 2, layout).expect("fits exactly");
        let all = source.read(0, Window { column: 0, row: 0, columns: 3, rows: 2 }).expect("reads");
        assert_eq!(all, [103.0, 104.0, 105.0, 100.0, 101.0, 102.0]);
        let one = source.read(0, Window { column: 1, row: 1, columns: 1, rows: 1 }).expect("reads");
        assert_eq!(one, [101.0]);
        assert!(source.info().warnings.is_empty());
    }

    #[test]
    fn a_file_cut_off_is_void_from_there() {
        let layout = Layout::plain(0, SampleType::F32, true, 2);
        let bytes: Vec<u8> = [1.5f32, 2.5, 3.5].iter().flat_map(|n| n.to_be_bytes()).collect();
        let mut cut = source(bytes[..11].to_vec(), 2, 2, layout).expect("most is there");
        let all = cut.read(0, Window { column: 0, row: 0, columns: 2, rows: 2 }).expect("reads");
        assert_eq!(all[..2], [1.5, 2.5]);
        assert!(all[2].is_nan() && all[3].is_nan());
        assert!(cut.info().warnings[0].contains("cut off"));
        assert!(source(bytes[..3].to_vec(), 2, 2, layout).is_err());
        assert!(source(bytes.clone(), 0, 2, layout).is_err());
        let huge = Layout { row_stride: u64::MAX / 2, ..layout };
        assert!(source(bytes, 2, 4, huge).is_err());
    }
}
