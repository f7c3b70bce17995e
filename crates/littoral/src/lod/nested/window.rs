//! One window, and what its cells amount to.

use super::super::ScreenMetric;
use super::layer::Layer;
use crate::field::HeightField;
use crate::space::Cell;
use glam::DVec2;

/// One window: its cells are those of a level of the quadtree.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Window {
    pub level: u8,
    /// Its south-western cell.
    pub x: u32,
    pub y: u32,
    /// Cells along its side.
    pub side: u32,
    /// Cells along the side of a hole: half as many as the finer window has.
    pub half: u32,
    /// First column and row of the hole that the finer window fills.
    pub hole: Option<[u32; 2]>,
}

impl Window {
    /// Which of its sides (south, east, north, west) lie within the face: there something coarser follows.
    pub fn inner_sides(&self) -> [bool; 4] {
        let last = 1u64 << self.level;
        [self.y > 0, u64::from(self.x + self.side) < last, u64::from(self.y + self.side) < last, self.x > 0]
    }

    /// How far (cells) a vertex is from the nearest side within the face.
    pub fn depth(&self, i: u32, j: u32) -> u32 {
        let distances = [j, self.side - i, self.side - j, i];
        let inner = self.inner_sides();
        (0..4).filter(|&k| inner[k]).map(|k| distances[k]).min().unwrap_or(u32::MAX)
    }

    /// The same with a hole as near to a place as may be, and the finer window that fills it.
    pub fn around(&self, middle: DVec2) -> (Window, Window) {
        // A cell away from the border, unless that is the face's.
        let cells = 1u32 << self.level;
        let place = |centre: f64, low: u32| {
            let wanted = (centre * f64::from(cells) - 0.5 * f64::from(self.half)).round().max(0.0) as u32;
            let least = if low == 0 { 0 } else { low + 1 };
            let room = low + self.side - self.half;
            let most = if low + self.side == cells { room } else { room - 1 };
            wanted.clamp(least, most)
        };
        let (x, y) = (place(middle.x, self.x), place(middle.y, self.y));
        let finer =
            Window { level: self.level + 1, x: 2 * x, y: 2 * y, side: 2 * self.half, half: self.half, hole: None };
        (Window { hole: Some([x - self.x, y - self.y]), ..*self }, finer)
    }
}

/// A window held against a field and a view.
pub(super) struct Judge<'a> {
    pub field: &'a dyn HeightField,
    pub metric: &'a ScreenMetric,
    pub window: Window,
    /// Width (cells) of the border in which vertices move.
    pub zone: u32,
}

/// Blocks of up to this many levels of cells are asked for the greatest error of these cells; larger ones for their own, which is no smaller.
const STENCIL: u8 = 3;

/// Columns and rows of a window, the last ones excluded.
struct Part {
    low: [u32; 2],
    high: [u32; 2],
}

impl Judge<'_> {
    /// The part of the window that a block of cells, `depth` levels above them, covers; `None` if it is none.
    fn part(&self, block: Cell, depth: u8) -> Option<Part> {
        let w = &self.window;
        let along = |at: u32, first: u32| {
            let (from, to) = (u64::from(at) << depth, u64::from(at + 1) << depth);
            let (low, high) = (u64::from(first), u64::from(first + w.side));
            (from < high && to > low).then(|| ((from.max(low) - low) as u32, (to.min(high) - low) as u32))
        };
        let ((left, right), (bottom, top)) = (along(block.x, w.x)?, along(block.y, w.y)?);
        let part = Part { low: [left, bottom], high: [right, top] };
        let filled =
            w.hole.is_some_and(|hole| (0..2).all(|k| hole[k] <= part.low[k] && part.high[k] <= hole[k] + w.half));
        (!filled).then_some(part)
    }

    /// Blocks that cover the window, and how many levels they are above its cells.
    fn blocks(&self) -> (impl Iterator<Item = Cell> + use<>, u8) {
        let w = self.window;
        let depth = (w.side.next_power_of_two().trailing_zeros() as u8).min(w.level);
        let along = move |first: u32| (first >> depth)..=((first + w.side - 1) >> depth);
        let level = w.level - depth;
        (along(w.y).flat_map(move |y| along(w.x).map(move |x| Cell { face: 0, level, x, y })), depth)
    }

    /// No cell of a block has a larger bound (pixels); that of a cell itself. `None` if nothing of it is seen.
    fn bound(&self, block: Cell, depth: u8) -> Option<f32> {
        let part = self.part(block, depth)?;
        let range = self.field.range(block);
        if range.is_empty() {
            return None;
        }
        let bounds = self.metric.bounds(block, range);
        if !self.metric.sees(&bounds) {
            return None;
        }
        let greatest = |depth: u8| match depth {
            0..=STENCIL => self.field.stencil_error(block, depth),
            _ => self.field.error(block),
        };
        let mut error = greatest(depth);
        // Where vertices move, what the coarser ring would draw adds to the bound.
        if self.zone > 0 && self.moves(&part) {
            error += match (depth, block.parent()) {
                (0, Some(parent)) => self.field.error(parent),
                (0, None) => 0.0,
                _ => greatest(depth - 1),
            };
        }
        if depth > 0 && error.is_infinite() {
            return Some(f32::INFINITY);
        }
        Some(self.metric.pixels(&bounds, error))
    }

    /// Whether any of a part lies in the border in which vertices move.
    fn moves(&self, part: &Part) -> bool {
        let side = self.window.side;
        let near = [part.low[1], side + 1 - part.high[0], side + 1 - part.high[1], part.low[0]];
        self.window.inner_sides().iter().zip(near).any(|(inner, near)| *inner && near <= self.zone)
    }

    /// The worst bound (pixels) of the cells, or `worst` if that is worse; looked for no further when more than `enough`.
    pub fn worst(&self, worst: f32, enough: f32) -> f32 {
        let (blocks, depth) = self.blocks();
        let mut worst = worst;
        for block in blocks {
            self.look(block, depth, self.bound(block, depth), &mut worst, enough);
        }
        worst
    }

    fn look(&self, block: Cell, depth: u8, bound: Option<f32>, worst: &mut f32, enough: f32) {
        let Some(bound) = bound.filter(|bound| *bound > *worst && *worst <= enough) else { return };
        if depth == 0 {
            *worst = bound;
            return;
        }
        // The most promising first.
        let mut parts = block.children().map(|child| (child, self.bound(child, depth - 1)));
        parts.sort_unstable_by(|one, other| other.1.unwrap_or(-1.0).total_cmp(&one.1.unwrap_or(-1.0)));
        parts.iter().for_each(|&(child, bound)| self.look(child, depth - 1, bound, worst, enough));
    }

    /// Notes which cells are drawn: those seen, whole, and not in the hole.
    pub fn record(&self, layer: &mut Layer) {
        let (blocks, depth) = self.blocks();
        blocks.for_each(|block| self.note(block, depth, layer));
        layer.finish();
    }

    fn note(&self, block: Cell, depth: u8, layer: &mut Layer) {
        let Some(part) = self.part(block, depth) else { return };
        let range = self.field.range(block);
        if range.is_empty() {
            return;
        }
        let bounds = self.metric.bounds(block, range);
        if !self.metric.sees(&bounds) {
            return;
        }
        if depth == 0 || self.metric.holds(&bounds) {
            if self.field.error(block).is_finite() {
                layer.draw(part.low, part.high);
                return;
            }
            if depth == 0 {
                return;
            }
        }
        block.children().into_iter().for_each(|child| self.note(child, depth - 1, layer));
    }
}
