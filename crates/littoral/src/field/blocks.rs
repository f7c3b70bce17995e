//! The highest points of the range pyramid once more, in blocks of 8 × 8 nodes that a kernel looks at in one go.
//!
//! Level k has nodes of 4·8ᵏ × 4·8ᵏ patches: every third level of the range pyramid, copied, up to blocks of 2048 × 2048
//! patches. A block is 128 bytes, two lines of cache: a ray's way through 64 nodes is decided from registers. 0.13 bytes a
//! sample.

use super::pyramid::{EMPTY_HIGH, Level};
use super::{Raster, Window};
use crate::memory::filled;

/// Highs of 8 × 8 nodes, row by row from the south-west, in the steps of the range pyramid; [`EMPTY_HIGH`] where there is no
/// surface and beyond the raster.
#[repr(C, align(128))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Block(pub [u16; 64]);

/// One level of blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct BlockLevel {
    /// Index of its first block.
    pub offset: usize,
    /// Blocks along x and y.
    pub columns: usize,
    pub rows: usize,
}

/// Blocks of up to [`BLOCK_LEVELS`] levels, fewer where the last of fewer is a single one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blocks {
    pub levels: Vec<BlockLevel>,
    pub blocks: Vec<Block>,
}

/// Most levels that there are.
pub(crate) const BLOCK_LEVELS: usize = 3;

/// The range pyramid's level that the nodes of level k are.
const fn source(k: usize) -> usize {
    2 + 3 * k
}

impl Blocks {
    /// Blocks over the highs of a range pyramid of `raster`.
    pub fn new(raster: &Raster, levels: &[Level], highs: &[u16]) -> Blocks {
        let (mut blocks, mut offset) = (Blocks::default(), 0);
        loop {
            let patches = 32usize << (3 * blocks.levels.len());
            let (columns, rows) = ((raster.columns() - 1).div_ceil(patches), (raster.rows() - 1).div_ceil(patches));
            blocks.levels.push(BlockLevel { offset, columns, rows });
            offset += columns * rows;
            if columns * rows == 1 || blocks.levels.len() == BLOCK_LEVELS {
                break;
            }
        }
        blocks.blocks = filled(Block([EMPTY_HIGH; 64]), offset);
        let whole = Window { column: 0, row: 0, columns: raster.columns() - 1, rows: raster.rows() - 1 };
        blocks.edited(whole, levels, highs);
        blocks
    }

    /// Copies anew what lies over a window of patches.
    pub fn edited(&mut self, window: Window, levels: &[Level], highs: &[u16]) {
        for (k, here) in self.levels.iter().enumerate() {
            // A small raster's pyramid may end below this level: then its one node is the last one.
            let level = levels[source(k).min(levels.len()) - 1];
            let shift = source(k);
            for row in window.row >> shift..=(window.row + window.rows - 1) >> shift {
                for column in window.column >> shift..=(window.column + window.columns - 1) >> shift {
                    let block = here.offset + (row >> 3) * here.columns + (column >> 3);
                    let high = highs[level.offset + row * level.columns + column];
                    self.blocks[block].0[(row & 7) * 8 + (column & 7)] = high;
                }
            }
        }
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.blocks.as_slice())
    }
}
