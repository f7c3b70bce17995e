//! Everything equally fine: the simplest method, and the template for a new one.
//!
//! The whole face is drawn in cells of one level, the coarsest that keeps the tolerance where it is hardest to keep. Nobody would draw a
//! landscape like this; what other methods save is counted from here.

use super::{Drawing, Limits, Lod, Patch, Reached, ScreenMetric, Stencil, ViewError};
use crate::field::HeightField;
use crate::space::{Cell, View};

/// Cells of one level over everything that is seen.
#[derive(Clone, Debug, Default)]
pub struct Whole {
    /// Where it ends though the tolerance is not met.
    pub limits: Limits,
    cells: Vec<Cell>,
    next: Vec<Cell>,
}

impl Whole {
    /// The method within limits.
    pub fn new(limits: Limits) -> Whole {
        Whole { limits, ..Whole::default() }
    }
}

impl Lod for Whole {
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::new(view, field.datum())?;
        drawing.clear();
        drawing.stencil = Stencil::Square(1);
        self.cells.clear();
        self.cells.extend((0..field.datum().faces()).map(Cell::face));
        let mut reached = Reached { pixels: 0.0, limited: false };
        for level in 0..=Cell::MAX_LEVEL {
            // The next level's cells are four times as many, unless they are void or out of sight.
            let mut worst = 0.0f32;
            self.next.clear();
            for &cell in &self.cells {
                if let Some((_, pixels)) = metric.cell(field, cell, field.error(cell)) {
                    worst = worst.max(pixels);
                    self.next.push(cell);
                }
            }
            std::mem::swap(&mut self.cells, &mut self.next);
            reached.pixels = worst;
            if worst <= metric.tolerance() {
                break;
            }
            reached.limited = level >= self.limits.finest || self.cells.len() * 8 > self.limits.triangles;
            if reached.limited {
                break;
            }
            self.next.clear();
            self.next.extend(self.cells.iter().flat_map(|cell| cell.children()));
            std::mem::swap(&mut self.cells, &mut self.next);
        }
        // No void is bridged: what is partly void is left out.
        let whole = self.cells.iter().filter(|&&cell| field.error(cell).is_finite());
        drawing.patches.extend(whole.map(|&cell| Patch::of(cell)));
        Ok(reached)
    }
}
