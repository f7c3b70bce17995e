//! A rectangle of height samples and the mask of those that are missing: where data enters the engine.

use glam::DVec2;

/// Which samples of a raster are void, one bit each; costs nothing when none is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VoidMask {
    bits: Vec<u64>,
    count: usize,
}

impl VoidMask {
    /// A mask in which nothing is void.
    pub const fn none() -> VoidMask {
        VoidMask { bits: Vec::new(), count: 0 }
    }

    /// How many samples are void.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether any sample is void.
    pub fn any(&self) -> bool {
        self.count > 0
    }

    /// Whether the sample of this row-major index is void.
    #[inline]
    pub fn is_void(&self, index: usize) -> bool {
        self.bits.get(index >> 6).is_some_and(|word| word >> (index & 63) & 1 == 1)
    }

    /// Whether any sample of a range of row-major indices is void.
    pub fn any_in(&self, indices: std::ops::Range<usize>) -> bool {
        if self.count == 0 || indices.is_empty() {
            return false;
        }
        let (first, last) = (indices.start >> 6, (indices.end - 1) >> 6);
        (first..=last).any(|word| {
            let from = if word == first { indices.start & 63 } else { 0 };
            let to = if word == last { (indices.end - 1) & 63 } else { 63 };
            let wanted = (u64::MAX << from) & (u64::MAX >> (63 - to));
            self.bits.get(word).is_some_and(|bits| bits & wanted != 0)
        })
    }

    /// The bits, 64 samples a word, lowest bit first; empty when nothing is void.
    pub fn words(&self) -> &[u64] {
        &self.bits
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        self.bits.len() * 8
    }

    pub(crate) fn set(&mut self, index: usize, samples: usize, void: bool) {
        if void && self.bits.is_empty() {
            self.bits = vec![0; samples.div_ceil(64)];
        }
        if let Some(word) = self.bits.get_mut(index >> 6) {
            let bit = 1u64 << (index & 63);
            match (*word & bit != 0, void) {
                (false, true) => self.count += 1,
                (true, false) => self.count -= 1,
                _ => {}
            }
            *word = if void { *word | bit } else { *word & !bit };
        }
    }
}

/// A rectangle of a raster's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub column: usize,
    /// First row.
    pub row: usize,
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
}

/// Why numbers do not make a raster.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RasterError {
    /// The number of heights is not columns × rows.
    #[error("expected {columns} × {rows} = {} heights, got {got}", columns.saturating_mul(*rows))]
    Count {
        /// Columns asked for.
        columns: usize,
        /// Rows asked for.
        rows: usize,
        /// Heights given.
        got: usize,
    },
    /// Fewer than two samples in a direction span no surface; more than [`Raster::MAX_SIDE`] cannot be named.
    #[error("expected 2 to {max} samples a side, got {columns} × {rows}", max = Raster::MAX_SIDE)]
    Size {
        /// Columns given.
        columns: usize,
        /// Rows given.
        rows: usize,
    },
    /// The distance between samples is not a positive finite number.
    #[error("expected a positive distance between samples (m), got {0} × {1}")]
    Spacing(f64, f64),
}

/// A rectangle of height samples: finite heights (m) and a mask of those that are void.
///
/// Samples are points, not areas. Row 0 is the southernmost, column 0 the westernmost; rows follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    columns: usize,
    rows: usize,
    spacing: DVec2,
    heights: Vec<f32>,
    voids: VoidMask,
}

impl Raster {
    /// The most samples a raster may have along one side.
    pub const MAX_SIDE: usize = 1 << 24;

    /// Takes `columns` × `rows` heights (m), `spacing` (m) apart eastward and northward. Heights that are not finite are
    /// void; the number stored in their place is the nearest valid height of the same row, or of an earlier row, so that
    /// drawing code that ignores the mask still meets plausible numbers.
    ///
    /// # Errors
    /// If the count is wrong, a side is shorter than 2 or longer than [`Raster::MAX_SIDE`], or the spacing is not positive.
    pub fn new(columns: usize, rows: usize, spacing: DVec2, mut heights: Vec<f32>) -> Result<Raster, RasterError> {
        if !(2..=Raster::MAX_SIDE).contains(&columns) || !(2..=Raster::MAX_SIDE).contains(&rows) {
            return Err(RasterError::Size { columns, rows });
        }
        if columns.checked_mul(rows) != Some(heights.len()) {
            return Err(RasterError::Count { columns, rows, got: heights.len() });
        }
        if !(spacing.is_finite() && spacing.min_element() > 0.0) {
            return Err(RasterError::Spacing(spacing.x, spacing.y));
        }
        let mut voids = VoidMask::none();
        let mut last = heights.iter().copied().find(|h| h.is_finite()).unwrap_or(0.0);
        let samples = heights.len();
        for (index, height) in heights.iter_mut().enumerate() {
            if height.is_finite() {
                last = *height;
            } else {
                voids.set(index, samples, true);
                *height = last;
            }
        }
        Ok(Raster { columns, rows, spacing, heights, voids })
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Distance between samples eastward and northward (m).
    pub fn spacing(&self) -> DVec2 {
        self.spacing
    }

    /// All heights (m), row by row from the south; finite everywhere, without meaning where void.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// Which samples are void.
    pub fn voids(&self) -> &VoidMask {
        &self.voids
    }

    /// The height of one sample (m), `None` where void.
    ///
    /// # Panics
    /// Outside the raster.
    #[inline]
    pub fn sample(&self, column: usize, row: usize) -> Option<f32> {
        assert!(column < self.columns && row < self.rows, "sample ({column}, {row}) is outside the raster");
        let index = row * self.columns + column;
        (!self.voids.is_void(index)).then(|| self.heights[index])
    }

    /// Replaces the samples of `window`, given row by row from the south; values that are not finite become void and
    /// keep the number that was there.
    ///
    /// # Panics
    /// If the window leaves the raster or the number of heights is not its size.
    pub fn replace(&mut self, window: Window, heights: &[f32]) {
        let inside = window.column + window.columns <= self.columns && window.row + window.rows <= self.rows;
        assert!(inside, "{window:?} leaves a raster of {} × {}", self.columns, self.rows);
        assert_eq!(heights.len(), window.columns * window.rows, "expected one height for each sample of the window");
        let samples = self.heights.len();
        for row in 0..window.rows {
            for column in 0..window.columns {
                let index = (window.row + row) * self.columns + window.column + column;
                let height = heights[row * window.columns + column];
                self.voids.set(index, samples, !height.is_finite());
                if height.is_finite() {
                    self.heights[index] = height;
                }
            }
        }
    }

    /// The same ground with every height multiplied by `factor`.
    pub fn exaggerated(mut self, factor: f32) -> Raster {
        self.heights.iter_mut().for_each(|h| *h = (*h * factor).clamp(f32::MIN, f32::MAX));
        self
    }

    /// Lowest and highest valid height.
    pub fn range(&self) -> super::HeightRange {
        let mut range = super::HeightRange::EMPTY;
        for (index, &height) in self.heights.iter().enumerate() {
            if !self.voids.is_void(index) {
                range = range.union(super::HeightRange { low: height, high: height });
            }
        }
        range
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voids_are_masked_and_heights_stay_finite() {
        let heights = vec![f32::NAN, 1.0, 2.0, f32::INFINITY, 4.0, f32::NEG_INFINITY];
        let mut raster = Raster::new(3, 2, DVec2::new(2.0, 5.0), heights).expect("valid");
        assert_eq!(raster.voids().count(), 3);
        assert!(raster.heights().iter().all(|h| h.is_finite()));
        assert_eq!([raster.sample(0, 0), raster.sample(1, 0), raster.sample(0, 1)], [None, Some(1.0), None]);
        assert_eq!(raster.range(), super::super::HeightRange { low: 1.0, high: 4.0 });
        raster.replace(Window { column: 0, row: 0, columns: 2, rows: 1 }, &[7.0, f32::NAN]);
        assert_eq!([raster.sample(0, 0), raster.sample(1, 0)], [Some(7.0), None]);
        assert_eq!(raster.voids().count(), 3);
    }

    #[test]
    fn bad_sizes_are_named() {
        let error = |c, r, s, n| Raster::new(c, r, DVec2::splat(s), vec![0.0; n]).expect_err("must fail").to_string();
        assert_eq!(error(3, 2, 1.0, 5), "expected 3 × 2 = 6 heights, got 5");
        assert!(error(1, 2, 1.0, 2).contains("got 1 × 2"));
        assert!(error(2, 2, 0.0, 4).contains("positive distance"));
        assert!(error(2, 2, f64::NAN, 4).contains("positive distance"));
        assert!(error(usize::MAX, usize::MAX, 1.0, 4).contains("samples a side"));
    }
}
