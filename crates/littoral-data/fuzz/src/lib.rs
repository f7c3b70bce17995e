//! What every fuzz target does: open the bytes, and if they open, read them as `load` would.

use littoral::field::Window;
use littoral_data::formats::Input;
use littoral_data::{Error, Source};

/// Opens and reads. Whatever the bytes, this ends soon, without a panic, in memory that the file justifies.
pub fn check(opened: Result<Box<dyn Source>, Error>) {
    let mut source = match opened {
        Ok(source) => source,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    let levels = source.levels().to_vec();
    let full = levels[0];
    assert_eq!([full.columns, full.rows], [source.info().columns, source.info().rows]);
    assert!(full.columns > 0 && full.rows > 0);
    for (index, level) in levels.iter().enumerate().take(4) {
        // All of it if that is little, else its corners.
        let [columns, rows] = [level.columns.min(64), level.rows.min(64)];
        for (column, row) in [(0, 0), (level.columns - columns, level.rows - rows)] {
            if let Ok(heights) = source.read(index, Window { column, row, columns, rows }) {
                assert_eq!(heights.len(), columns * rows);
                assert!(heights.iter().all(|h| h.is_nan() || (-12_001.0..=9_001.0).contains(h)));
            }
        }
    }
}

/// Splits the bytes at the first zero: a header beside, and the samples.
pub fn header_and_samples(data: &[u8]) -> (&[u8], &[u8]) {
    let at = data.iter().position(|&b| b == 0).unwrap_or(data.len());
    (&data[..at], data.get(at + 1..).unwrap_or_default())
}

/// The bytes under a name.
pub fn input(name: &str, data: &[u8]) -> Input {
    Input::memory(name, data.to_vec())
}
