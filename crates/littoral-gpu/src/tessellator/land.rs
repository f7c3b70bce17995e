//! What a land says about its cells, as textures.

use crate::compute::{heights, numbers};
use crate::device::Gpu;
use crate::scenery::TooLarge;
use glam::DVec2;
use littoral::field::{HeightField, HeightRange, Land};
use littoral::space::{Cell, Datum};

/// A land on the device.
#[derive(Debug)]
pub(super) struct DeviceLand {
    pub datum: Datum,
    /// World position of its south-western corner, and size of its face (m).
    pub origin: DVec2,
    pub size: DVec2,
    /// Level of the cells between four samples.
    pub finest: u8,
    pub columns: u32,
    pub rows: u32,
    /// Height (m) of step 0, and of a step, of the ranges.
    pub scale: (f32, f32),
    /// Bits of the heights, not finite where there is none.
    pub heights: wgpu::Texture,
    /// Two numbers a cell: its range in steps (low in the lower half) and the bits of its error. The first texture holds the levels [`TOGETHER`], one after the other from west to
    /// east, the others one each. Cells between four samples are told by these.
    cells: Vec<wgpu::Texture>,
}

/// Levels in the first texture of cells: small ones, so that one pass can do several.
const TOGETHER: u8 = 6;

const CELLS: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;

impl DeviceLand {
    pub fn new(gpu: &Gpu, land: &Land) -> Result<DeviceLand, TooLarge> {
        let heights = heights(gpu, land)?;
        let raster = land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        let finest = land.finest_level();
        let first = TOGETHER.min(finest);
        let width = (1usize << first) - 1;
        let together = numbers(gpu, "first cells", CELLS, width.max(1), width.div_ceil(2).max(1), |row, line| {
            let begin = line.len();
            for level in 0..first {
                line.resize(begin + 2 * ((1 << level) - 1), 0);
                ranges_and_errors(land, level, row, line);
            }
            line.resize(begin + 2 * width.max(1), 0);
        });
        let of_level = |level| {
            let (columns, rows) = land.ranges().size(u32::from(finest - level));
            numbers(gpu, "cells", CELLS, columns, rows, |row, line| ranges_and_errors(land, level, row, line))
        };
        let cells = std::iter::once(together).chain((first..finest).map(of_level)).collect();
        let origin = land.origin();
        let size = raster.spacing() * f64::from(1u32 << finest);
        Ok(DeviceLand {
            datum: Datum::Plane { origin, size },
            origin,
            size,
            finest,
            columns: columns as u32,
            rows: rows as u32,
            scale: land.ranges().scale(),
            heights,
            cells,
        })
    }

    /// The texture of the cells of a level.
    pub fn cells(&self, level: u8) -> &wgpu::Texture {
        let index = usize::from((level + 1).saturating_sub(TOGETHER));
        &self.cells[index.min(self.cells.len() - 1)]
    }
}

/// Appends what the land says of a row of cells; of a row that it has not, nothing.
fn ranges_and_errors(land: &Land, level: u8, row: usize, line: &mut Vec<u32>) {
    let above = u32::from(land.finest_level() - level);
    let (columns, rows) = land.ranges().size(above);
    if row >= rows {
        return;
    }
    let (lows, highs) = land.ranges().steps(above);
    let (mut ranges, mut errors) = (vec![HeightRange::EMPTY; columns], vec![0.0; columns]);
    land.row(Cell { face: 0, level, x: 0, y: row as u32 }, &mut ranges, &mut errors);
    let steps = lows[row * columns..].iter().zip(&highs[row * columns..]);
    line.extend(
        steps.zip(&errors).flat_map(|((&low, &high), error)| [u32::from(low) | u32::from(high) << 16, error.to_bits()]),
    );
}
