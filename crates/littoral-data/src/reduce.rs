//! Averaging a raster down while it streams by: each coarse sample is the mean of the fine samples under its area.
//!
//! The coarse grid covers the same ground as the fine one, to the pixel's corner, so sizes need not divide: a fine sample
//! that lies across a border counts for both sides, by the part that lies in each. A coarse sample is void where more than
//! half of its area is void or missing, and otherwise the mean of what is known there: voids neither grow nor shrink on
//! average, and no height is made up where less than half is known.

use littoral::memory::in_large_pages;

/// Averages rows, handed in one after another, onto a coarser grid.
pub(crate) struct Reducer {
    columns: usize,
    rows: usize,
    out_columns: usize,
    out_rows: usize,
    /// For each coarse column: its first and last fine column, and the parts of them that count.
    spans: Vec<Span>,
    /// Weighted sum and weight of the coarse row being filled.
    sums: Vec<[f64; 2]>,
    /// The next fine row.
    row: usize,
    heights: Vec<f32>,
}

#[derive(Clone, Copy)]
struct Span {
    first: usize,
    last: usize,
    first_weight: f64,
    last_weight: f64,
}

/// The fine samples under coarse sample `index` of `out`, of `fine` in all.
fn span(index: usize, fine: usize, out: usize) -> Span {
    // Borders are fractions of `out`: whole-number arithmetic keeps neighbours' weights complementary.
    let (start, end) = (index * fine, (index + 1) * fine);
    let (first, last) = (start / out, (end - 1) / out);
    let part = |from: usize, to: usize| (to - from) as f64 / out as f64;
    Span {
        first,
        last,
        first_weight: part(start, end.min((first + 1) * out)),
        last_weight: part(start.max(last * out), end),
    }
}

impl Reducer {
    /// From `columns` × `rows` samples to `out_columns` × `out_rows`, which may not be more.
    pub(crate) fn new(columns: usize, rows: usize, out_columns: usize, out_rows: usize) -> Reducer {
        assert!((1..=columns).contains(&out_columns) && (1..=rows).contains(&out_rows), "a coarser grid");
        Reducer {
            columns,
            rows,
            out_columns,
            out_rows,
            spans: (0..out_columns).map(|index| span(index, columns, out_columns)).collect(),
            sums: vec![[0.0; 2]; out_columns],
            row: 0,
            heights: in_large_pages(Vec::with_capacity(out_columns * out_rows)),
        }
    }

    /// Takes whole rows, NaN where void.
    pub(crate) fn push(&mut self, heights: &[f32]) {
        for line in heights.chunks_exact(self.columns) {
            if self.heights.len() == self.out_columns * self.out_rows {
                return;
            }
            let mut index = self.heights.len() / self.out_columns;
            let mut rows = span(index, self.rows, self.out_rows);
            let weight = if self.row == rows.last { rows.last_weight } else { 1.0 };
            self.add(line, if self.row == rows.first { rows.first_weight } else { weight });
            if self.row == rows.last {
                self.finish();
                index += 1;
                if index < self.out_rows {
                    rows = span(index, self.rows, self.out_rows);
                    // The row reaches over the border: its remainder belongs to the next coarse row.
                    if rows.first == self.row {
                        self.add(line, rows.first_weight);
                    }
                }
            }
            self.row += 1;
        }
    }

    /// Adds a row by its weight to the coarse row being filled.
    fn add(&mut self, line: &[f32], weight: f64) {
        for (sum, span) in self.sums.iter_mut().zip(&self.spans) {
            let [mut total, mut known] = [0.0f64; 2];
            let mut take = |height: f32, weight: f64| {
                let valid = !height.is_nan();
                total += if valid { f64::from(height) * weight } else { 0.0 };
                known += if valid { weight } else { 0.0 };
            };
            take(line[span.first], span.first_weight);
            if span.last > span.first {
                line[span.first + 1..span.last].iter().for_each(|&height| take(height, 1.0));
                take(line[span.last], span.last_weight);
            }
            sum[0] += total * weight;
            sum[1] += known * weight;
        }
    }

    fn finish(&mut self) {
        let area = self.columns as f64 / self.out_columns as f64 * (self.rows as f64 / self.out_rows as f64);
        for [total, known] in &mut self.sums {
            let height = if *known >= 0.5 * area * (1.0 - 1e-9) { (*total / *known) as f32 } else { f32::NAN };
            self.heights.push(height);
            [*total, *known] = [0.0; 2];
        }
    }

    /// The coarse heights, NaN where void or where no row came.
    pub(crate) fn into_heights(mut self) -> Vec<f32> {
        self.heights.resize(self.out_columns * self.out_rows, f32::NAN);
        self.heights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same by its definition: every fine sample against every coarse one, areas of overlap by floating point.
    fn by_definition(fine: &[f32], [w, h]: [usize; 2], [ow, oh]: [usize; 2]) -> Vec<f32> {
        let overlap = |out: usize, outs: usize, fine: usize, fines: usize| {
            let scale = fines as f64 / outs as f64;
            let (a, b) = (out as f64 * scale, (out + 1) as f64 * scale);
            (b.min((fine + 1) as f64) - a.max(fine as f64)).max(0.0)
        };
        let mut coarse = Vec::new();
        for y in 0..oh {
            for x in 0..ow {
                let (mut total, mut known, mut area) = (0.0, 0.0, 0.0);
                for r in 0..h {
                    for c in 0..w {
                        let weight = overlap(x, ow, c, w) * overlap(y, oh, r, h);
                        area += weight;
                        if !fine[r * w + c].is_nan() {
                            total += weight * f64::from(fine[r * w + c]);
                            known += weight;
                        }
                    }
                }
                coarse.push(if known > 0.4999999 * area { (total / known) as f32 } else { f32::NAN });
            }
        }
        coarse
    }

    #[test]
    fn streamed_means_are_means_by_area() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as usize
        };
        for _ in 0..300 {
            let (w, h) = (1 + random() % 23, 1 + random() % 23);
            let (ow, oh) = (1 + random() % w, 1 + random() % h);
            let fine: Vec<f32> =
                (0..w * h).map(|_| if random() % 4 == 0 { f32::NAN } else { random() as f32 % 1000.0 }).collect();
            let mut reducer = Reducer::new(w, h, ow, oh);
            let mut at = 0;
            while at < h {
                let rows = (1 + random() % 5).min(h - at);
                reducer.push(&fine[at * w..(at + rows) * w]);
                at += rows;
            }
            for (got, expected) in reducer.into_heights().iter().zip(by_definition(&fine, [w, h], [ow, oh])) {
                let same = got.is_nan() == expected.is_nan() && (got.is_nan() || (got - expected).abs() < 1e-3);
                assert!(same, "{w} × {h} to {ow} × {oh}: expected {expected}, got {got}");
            }
        }
    }

    #[test]
    fn the_same_size_is_the_same_raster() {
        let fine: Vec<f32> = (0..35).map(|i| i as f32 * 1.7).collect();
        let mut reducer = Reducer::new(7, 5, 7, 5);
        reducer.push(&fine);
        assert_eq!(reducer.into_heights(), fine);
    }
}
