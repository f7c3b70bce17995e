//! Triangle patches cut level by level, edges deciding: the procedure of a GPU's tessellation stages, on a CPU.
//!
//! The face is cut once into right triangles. Level by level every patch is looked at: out of sight, it is dropped; if none of its edges is worth
//! splitting, it is final; else it is cut through the middles of its three edges into four of half the size. Whether an edge is worth splitting
//! depends on the edge alone, so that both patches that share it decide alike. On an edge that is not split a triangle without area remains
//! between its ends and its middle; given heights it is a sliver that stands upright and closes the crack. No patch asks its
//! neighbours, nothing is kept from frame to frame, and all patches of a level can be looked at together.
//!
//! After the virtual Earth of GraphiCon 2016 (control, evaluation and geometry stages). The edge's error is a bound here: no point of the surface over
//! an unsplit edge leaves it by more than the tolerance, hence no sliver is larger; and since the longest edge lies within the patch's own cell,
//! its bound is that of the patch.
//!
//! Without geomorphs: a patch is whole or cut.

use super::{Drawing, Limits, Lod, Patch, Reached, ScreenMetric, Stencil, ViewError};
use crate::field::HeightField;
use crate::space::{Cell, View};
use rayon::prelude::*;

/// Right triangles over half cells, cut where an edge is worth it.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    /// Where it ends though the tolerance is not met.
    pub limits: Limits,
    list: Vec<Half>,
    next: Vec<Half>,
    verdicts: Vec<Verdict>,
}

/// Half of a cell: the triangle between a corner and the two next to it.
#[derive(Clone, Copy, Debug, Default)]
struct Half {
    cell: Cell,
    /// Whether the right angle lies in the cell's north-eastern corner, not in its south-western one.
    far: bool,
}

/// What becomes of a patch.
#[derive(Clone, Copy, Debug, Default)]
enum Verdict {
    /// Nothing of it is seen, or there is no surface.
    #[default]
    Dropped,
    /// It is drawn; its bound (pixels).
    Final(f32),
    /// It is partly void, and too small to matter or as fine as allowed: no void is bridged. How large it is (pixels).
    Left(f32),
    /// It is cut; which of its legs, horizontal and vertical, are split.
    Cut([bool; 2]),
}

/// Patches from which on they are looked at by several threads.
const MANY: usize = 4096;

impl Patches {
    /// The method within limits.
    pub fn new(limits: Limits) -> Patches {
        Patches { limits, ..Patches::default() }
    }

    /// Draws with a tolerance of `tolerance` pixels; `None` if that takes more triangles than allowed.
    fn attempt(
        &mut self,
        field: &dyn HeightField,
        metric: &ScreenMetric,
        tolerance: f32,
        drawing: &mut Drawing,
    ) -> Option<f32> {
        drawing.clear();
        drawing.stencil = Stencil::Triangle;
        self.list.clear();
        for face in 0..field.datum().faces() {
            self.list.extend([false, true].map(|far| Half { cell: Cell::face(face), far }));
        }
        let mut worst = 0.0f32;
        while !self.list.is_empty() {
            let finest = self.limits.finest;
            let judge = |half: &Half| judge(field, metric, tolerance, finest, half);
            self.verdicts.clear();
            if self.list.len() >= MANY {
                self.verdicts.resize(self.list.len(), Verdict::Dropped);
                self.verdicts.par_iter_mut().zip(&self.list).with_min_len(256).for_each(|(v, half)| *v = judge(half));
            } else {
                self.verdicts.extend(self.list.iter().map(judge));
            }
            self.next.clear();
            for (half, verdict) in self.list.iter().zip(&self.verdicts) {
                match *verdict {
                    Verdict::Dropped => {}
                    Verdict::Left(pixels) => worst = worst.max(pixels),
                    Verdict::Final(pixels) => {
                        worst = worst.max(pixels);
                        drawing.patches.push(half.patch());
                    }
                    Verdict::Cut(split) => {
                        self.next.extend(half.children());
                        let slivers = half.slivers();
                        drawing.patches.extend(split.iter().zip(slivers).filter(|(split, _)| !**split).map(|(_, s)| s));
                    }
                }
            }
            std::mem::swap(&mut self.list, &mut self.next);
            if self.list.len() + drawing.patches.len() > self.limits.triangles.max(64) {
                return None;
            }
        }
        Some(worst)
    }
}

impl Lod for Patches {
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::new(view, field.datum())?;
        let mut tolerance = metric.tolerance();
        loop {
            if let Some(pixels) = self.attempt(field, &metric, tolerance, drawing) {
                return Ok(Reached { pixels, limited: pixels > metric.tolerance() });
            }
            tolerance *= 1.5;
        }
    }
}

/// The two stages that decide: culling, and the errors of the edges.
fn judge(field: &dyn HeightField, metric: &ScreenMetric, tolerance: f32, finest: u8, half: &Half) -> Verdict {
    let cell = half.cell;
    let error = field.error(cell);
    let Some((_, own)) = metric.cell(field, cell, error) else { return Verdict::Dropped };
    if own <= tolerance || cell.level >= finest {
        return if error.is_finite() { Verdict::Final(own) } else { Verdict::Left(own) };
    }
    // A leg lies in the cells on both its sides, so the surface over it is no farther off than the lesser of their bounds. Here that is the
    // other one's: a patch gets here only because its own is too large. Where nothing
    // is drawn beyond, nothing has to be closed.
    let split = half.beyond().map(|other| {
        let Some(cell) = other else { return true };
        let error = field.error(cell);
        // What is partly void is never drawn as it is.
        error.is_infinite()
            || field.range(cell).is_empty()
            || metric.cell(field, cell, error).is_some_and(|(_, pixels)| pixels > tolerance)
    });
    Verdict::Cut(split)
}

impl Half {
    /// The triangle as an image of the stencil.
    fn patch(&self) -> Patch {
        let whole = Patch::of(self.cell);
        let side = whole.across[0];
        if self.far {
            let corner = whole.corner.map(|c| c + side as u32);
            Patch { corner, across: [-side, 0], up: [0, -side], ..whole }
        } else {
            whole
        }
    }

    /// The four triangles between its corners and the middles of its edges.
    fn children(&self) -> [Half; 4] {
        let [sw, se, nw, ne] = self.cell.children();
        let far = self.far;
        let corner = if far { ne } else { sw };
        // One at the right angle, one at each end, and one between, turned round.
        [Half { cell: corner, far }, Half { cell: se, far }, Half { cell: nw, far }, Half { cell: corner, far: !far }]
    }

    /// The cells beyond the horizontal and the vertical leg; `None` where the face ends.
    fn beyond(&self) -> [Option<Cell>; 2] {
        let cell = self.cell;
        let last = (1u32 << cell.level) - 1;
        if self.far {
            [
                (cell.y < last).then(|| Cell { y: cell.y + 1, ..cell }),
                (cell.x < last).then(|| Cell { x: cell.x + 1, ..cell }),
            ]
        } else {
            [cell.y.checked_sub(1).map(|y| Cell { y, ..cell }), cell.x.checked_sub(1).map(|x| Cell { x, ..cell })]
        }
    }

    /// The triangles without area over its horizontal and its vertical leg, between their ends and their middles.
    fn slivers(&self) -> [Patch; 2] {
        let patch = self.patch();
        let half = |by: [i32; 2]| by.map(|c| c / 2);
        let (across, up) = (patch.across, patch.up);
        // Along the horizontal leg the patch runs from its corner outward, along the vertical one back to its corner.
        let along = |from: [u32; 2], by: [i32; 2]| Patch { corner: from, across: by, up: half(by), ..patch };
        let end = [0, 1].map(|axis| patch.corner[axis].wrapping_add_signed(up[axis]));
        [along(patch.corner, across), along(end, up.map(|c| -c))]
    }
}
