//! Triangle patches cut level by level, edges deciding: the procedure of a GPU's tessellation stages, on a CPU.
//!
//! The face is cut once into right triangles. Level by level every patch is looked at: out of sight, it is dropped; if none of its edges is worth
//! splitting, it is final; else it is cut through the middles of its three edges into four of half the size. Whether an edge is worth splitting
//! depends on the edge alone, so that both patches that share it decide alike. On an edge that is not split a triangle without area remains
//! between its ends and its middle; given heights it is a sliver that stands upright and closes the crack. Nothing is kept from
//! frame to frame, and all patches of a level can be looked at together.
//!
//! After the virtual Earth of GraphiCon 2016 (control, evaluation and geometry stages). The edge's error is a bound here: no point of the surface over
//! an unsplit edge leaves it by more than the tolerance, hence no sliver is larger; and since the longest edge lies within the patch's own cell,
//! its bound is that of the patch. So the two patches of a cell share their fate, and a leg between two cells is split if both of
//! them are cut: the lists hold cells, each measured once, which know those beside them.
//!
//! Where the limit of triangles binds, the tolerance that it leaves is found on the way: a histogram over tolerances counts what would be drawn at each of
//! them, so that it is raised only as far as needed, and nothing is done twice. So it is where the lists would grow beyond two cells for each triangle allowed.
//!
//! Without geomorphs: a patch is whole or cut.

mod level;

use super::{Drawing, Limits, Lod, Patch, Reached, ScreenMetric, Stencil, ViewError};
use crate::field::HeightField;
use crate::space::{Cell, View};
use level::{Census, Level};

/// Right triangles over half cells, cut where an edge is worth it.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    /// Where it ends though the tolerance is not met.
    pub limits: Limits,
    levels: Vec<Level>,
    census: Census,
}

impl Patches {
    /// The method within limits.
    pub fn new(limits: Limits) -> Patches {
        Patches { limits, ..Patches::default() }
    }
}

impl Lod for Patches {
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::new(view, field.datum())?;
        drawing.clear();
        drawing.stencil = Stencil::Triangle;
        let finest = self.limits.finest.min(Cell::MAX_LEVEL);
        self.levels.resize_with(usize::from(finest) + 1, Level::default);
        self.census.start(metric.tolerance(), self.limits.triangles.max(64));
        self.levels[0].start(field.datum().faces());
        let mut last = 0;
        loop {
            let (here, next) = self.levels.split_at_mut(last + 1);
            let here = &mut here[last];
            here.measure(field, &metric);
            let goes_on = here.count(field, &mut self.census, last < usize::from(finest));
            let Some(next) = next.first_mut().filter(|_| goes_on) else { break };
            here.cut(self.census.tolerance(), next);
            if next.is_empty() {
                break;
            }
            last += 1;
        }
        // The tolerance may have risen since a cell was cut.
        let mut pixels = 0.0f32;
        for level in &self.levels[..=last] {
            level.draw(self.census.tolerance(), &mut drawing.patches, &mut pixels);
        }
        Ok(Reached { pixels, limited: pixels > metric.tolerance() })
    }
}

/// The triangle of half a cell as an image of the stencil: between a corner, the north-eastern one if `far`, else the south-western, and the two next to it.
fn half(cell: Cell, far: bool) -> Patch {
    let whole = Patch::of(cell);
    let side = whole.across[0];
    if far {
        let corner = whole.corner.map(|c| c + side as u32);
        Patch { corner, across: [-side, 0], up: [0, -side], ..whole }
    } else {
        whole
    }
}

/// The triangles without area over a cell's sides (south, east, north, west), between their ends and their middles, run along with the cell on the left.
fn sliver(cell: Cell, side: usize) -> Patch {
    let patch = Patch::of(cell);
    let length = patch.across[0];
    let (from, by) = match side {
        0 => ([0, 0], [length, 0]),
        1 => ([length, 0], [0, length]),
        2 => ([length, length], [-length, 0]),
        _ => ([0, length], [0, -length]),
    };
    let corner = [0, 1].map(|axis| patch.corner[axis].wrapping_add_signed(from[axis]));
    Patch { corner, across: by, up: by.map(|c| c / 2), ..patch }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::HeightRange;
    use crate::space::{Datum, Place};
    use glam::{DVec2, DVec3, UVec2};

    /// A surface that is as wrong drawn finely as coarsely, like the bound of waves that may break.
    struct Restless;

    impl HeightField for Restless {
        fn datum(&self) -> Datum {
            Datum::Plane { origin: DVec2::splat(-4000.0), size: DVec2::splat(8000.0) }
        }

        fn height(&self, _: Place) -> Option<f32> {
            Some(0.0)
        }

        fn range(&self, _: Cell) -> HeightRange {
            HeightRange { low: -5.0, high: 5.0 }
        }

        fn error(&self, _: Cell) -> f32 {
            10.0
        }
    }

    #[test]
    fn lists_stay_within_bounds_where_errors_do_not_fall() {
        let view = View::looking_at(DVec3::new(0.0, -3000.0, 120.0), DVec3::ZERO, 0.8, UVec2::new(640, 360));
        for triangles in [5_000, 40_000] {
            let mut lod = Patches::new(Limits { finest: 20, triangles });
            let mut drawing = Drawing::default();
            let reached = lod.select(&Restless, &view, &mut drawing).expect("a view");
            let cells: usize = lod.levels.iter().map(Level::len).sum();
            assert!(cells <= 2 * triangles + 4096, "{cells} cells for {triangles} triangles");
            assert!((triangles / 4..=triangles).contains(&drawing.patches.len()), "{} drawn", drawing.patches.len());
            assert!(reached.limited && reached.pixels.is_finite());
        }
    }
}
