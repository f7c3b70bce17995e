//! The highest points of the range pyramid once more, over windows of 3 × 3 nodes.
//!
//! Whatever is no longer than two nodes along either axis lies within the window that begins at the node of its
//! south-western corner: one number bounds the ground under it, where the nodes by themselves would take four to nine.
//! Only coarse levels are kept, 0.04 bytes a sample, small enough for the nearer caches.

use super::Window;
use super::pyramid::{EMPTY_HIGH, Level};
use crate::memory::filled;

/// The finest level that windows are kept for.
pub(crate) const FINEST_WINDOWS: usize = 3;

/// Highs of windows that begin at the nodes of some levels, in the steps of the range pyramid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Windows {
    /// `levels[n - FINEST_WINDOWS]` belongs to level n; none where the pyramid ends below.
    pub levels: Vec<Level>,
    /// The highest of node (i, j) to (i + 2, j + 2), those beyond the raster left out. One number of padding at the end.
    pub highs: Vec<u16>,
}

impl Windows {
    /// Windows over the highs of a range pyramid.
    pub fn new(levels: &[Level], highs: &[u16]) -> Windows {
        let mut windows = Windows::default();
        let mut offset = 0;
        for level in levels.iter().skip(FINEST_WINDOWS - 1) {
            windows.levels.push(Level { offset, ..*level });
            offset += level.columns * level.rows;
        }
        windows.highs = filled(EMPTY_HIGH, offset + 1);
        for (n, level) in levels.iter().enumerate().skip(FINEST_WINDOWS - 1) {
            windows.renew(n, Window { column: 0, row: 0, columns: level.columns, rows: level.rows }, levels, highs);
        }
        windows
    }

    /// Computes anew what lies over a window of patches.
    pub fn edited(&mut self, window: Window, levels: &[Level], highs: &[u16]) {
        for n in FINEST_WINDOWS - 1..levels.len() {
            let first = [window.column >> (n + 1), window.row >> (n + 1)].map(|node| node.saturating_sub(2));
            let end = [(window.column + window.columns - 1) >> (n + 1), (window.row + window.rows - 1) >> (n + 1)];
            let nodes =
                Window { column: first[0], row: first[1], columns: end[0] + 1 - first[0], rows: end[1] + 1 - first[1] };
            self.renew(n, nodes, levels, highs);
        }
    }

    /// The windows that begin at the nodes `window` of `levels[n]`.
    fn renew(&mut self, n: usize, window: Window, levels: &[Level], highs: &[u16]) {
        let (level, here) = (levels[n], self.levels[n + 1 - FINEST_WINDOWS]);
        let (first, end) = (window.column, (window.column + window.columns + 2).min(level.columns));
        let mut line = vec![EMPTY_HIGH; window.columns + 2];
        for row in window.row..window.row + window.rows {
            line.fill(EMPTY_HIGH);
            for row in row..(row + 3).min(level.rows) {
                let nodes = &highs[level.offset + row * level.columns..][first..end];
                line.iter_mut().zip(nodes).for_each(|(highest, node)| *highest = (*highest).max(*node));
            }
            let out = &mut self.highs[here.offset + row * here.columns + first..][..window.columns];
            for (out, ((a, b), c)) in out.iter_mut().zip(line.iter().zip(&line[1..]).zip(&line[2..])) {
                *out = (*a).max(*b).max(*c);
            }
        }
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.highs.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{RangePyramid, Raster};
    use glam::DVec2;

    #[test]
    fn windows_hold_nine_nodes_and_follow_edits() {
        let (columns, rows) = (150, 93);
        let heights: Vec<f32> = (0..columns * rows).map(|i| ((i * 7919) % 1013) as f32).collect();
        let mut raster = Raster::new(columns, rows, DVec2::ONE, heights).expect("finite heights");
        let mut pyramid = RangePyramid::new(&raster);
        for (column, row, height) in [(0, 0, 1000.0), (149, 92, 1.0), (70, 41, 1011.0), (128, 64, 3.0)] {
            let before = pyramid.range();
            let window = Window { column, row, columns: 1, rows: 1 };
            raster.replace(window, &[height]);
            pyramid.edited(&raster, window, before);
            let windows = &pyramid.windows;
            for (k, here) in windows.levels.iter().enumerate() {
                let level = pyramid.levels[k + FINEST_WINDOWS - 1];
                let node = |i: usize, j: usize| pyramid.highs[level.offset + j * level.columns + i];
                for (i, j) in (0..here.rows).flat_map(|j| (0..here.columns).map(move |i| (i, j))) {
                    let nine =
                        (j..(j + 3).min(here.rows)).flat_map(|j| (i..(i + 3).min(here.columns)).map(move |i| (i, j)));
                    let highest = nine.map(|(i, j)| node(i, j)).max();
                    assert_eq!(Some(windows.highs[here.offset + j * here.columns + i]), highest, "{k}: {i}, {j}");
                }
            }
        }
    }
}
