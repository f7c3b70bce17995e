//! What was compared, as a picture: a row for each view.

use crate::talk::Failure;
use glam::UVec2;
use littoral_data::write::{self, PngPixels};
use std::path::Path;

/// Rows of three pictures, drawn small: by the processor, by the adapter, and their difference.
pub struct Sheet {
    size: UVec2,
    /// Pixels of a picture that become one.
    shrink: u32,
    pixels: Vec<[u8; 3]>,
}

/// Pictures are no wider than this.
const WIDEST: u32 = 640;

impl Sheet {
    /// For pictures of a size.
    pub fn new(size: UVec2) -> Sheet {
        Sheet { size, shrink: size.x.div_ceil(WIDEST), pixels: Vec::new() }
    }

    fn small(&self) -> UVec2 {
        (self.size / self.shrink).max(UVec2::ONE)
    }

    /// Adds a row.
    pub fn add(&mut self, processor: &[[u8; 3]], adapter: &[[u8; 3]]) {
        // What differs counts four times, about grey.
        let difference = processor
            .iter()
            .zip(adapter)
            .map(|(a, b)| std::array::from_fn(|i| (128 + 4 * (i32::from(b[i]) - i32::from(a[i]))).clamp(0, 255) as u8));
        let difference: Vec<[u8; 3]> = difference.collect();
        for y in 0..self.small().y {
            for picture in [processor, adapter, &difference] {
                for x in 0..self.small().x {
                    let mean = self.mean(picture, UVec2::new(x, y));
                    self.pixels.push(mean);
                }
            }
        }
    }

    /// The mean of a square of pixels.
    fn mean(&self, picture: &[[u8; 3]], at: UVec2) -> [u8; 3] {
        let mut sum = [0u32; 3];
        for (i, j) in (0..self.shrink).flat_map(|j| (0..self.shrink).map(move |i| (i, j))) {
            // A strip may be lower than the square.
            let at = (at * self.shrink + UVec2::new(i, j)).min(self.size - 1);
            let pixel = picture[(at.y * self.size.x + at.x) as usize];
            (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
        }
        sum.map(|sum| (sum / (self.shrink * self.shrink)) as u8)
    }

    /// Writes it.
    pub fn write(&self, file: &Path) -> Result<(), Failure> {
        let width = 3 * self.small().x;
        let height = self.pixels.len() as u32 / width;
        Ok(write::png(file, width, height, PngPixels::Rgb8(&self.pixels), &[("Software", "littoral".to_owned())])?)
    }
}
