//! The lowest and highest sample of small squares: what large triangles are searched by.

use multiversion::multiversion;

/// Samples along the side of a square.
pub(super) const TILE: usize = 16;

/// Ranges of squares of 16 × 16 samples, row by row from the south-west.
#[derive(Clone, Debug, Default)]
pub(super) struct Tiles {
    pub columns: usize,
    pub low: Vec<f32>,
    pub high: Vec<f32>,
}

impl Tiles {
    pub fn new(heights: &[f32], columns: usize) -> Tiles {
        let across = columns.div_ceil(TILE);
        let count = across * (heights.len() / columns).div_ceil(TILE);
        let mut tiles = Tiles { columns: across, low: vec![f32::MAX; count], high: vec![f32::MIN; count] };
        for (row, line) in heights.chunks_exact(columns).enumerate() {
            let first = row / TILE * across;
            widen(line, &mut tiles.low[first..first + across], &mut tiles.high[first..first + across]);
        }
        tiles
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn widen(line: &[f32], lows: &mut [f32], highs: &mut [f32]) {
    for ((heights, low), high) in line.chunks(TILE).zip(lows).zip(highs) {
        for &height in heights {
            *low = if height < *low { height } else { *low };
            *high = if height > *high { height } else { *high };
        }
    }
}
