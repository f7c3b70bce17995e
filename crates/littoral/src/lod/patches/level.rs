//! The list of a level, an array for each property, and the census over tolerances.

use super::{half, sliver};
use crate::field::HeightField;
use crate::lod::{Patch, ScreenMetric};
use crate::space::Cell;
use rayon::prelude::*;

/// The cells of one level that are looked at: those whose parent is cut.
#[derive(Clone, Debug, Default)]
pub(super) struct Level {
    cells: Vec<Cell>,
    /// The cells beyond their sides (south, east, north, west): places in this list, [`ABSENT`] or [`BORDER`].
    beside: Vec<[u32; 4]>,
    /// The tolerance (pixels) below which the parent is cut.
    above: Vec<f32>,
    looks: Vec<Look>,
    /// Place in the next level's list of the first of the four children; [`ABSENT`] if it is not cut.
    children: Vec<u32>,
    /// Sides over which a sliver stands unless the cell beyond is cut, too: a bit each.
    open: Vec<u8>,
    /// Scratch: bounds in order.
    order: Vec<u32>,
}

/// Not in the list.
const ABSENT: u32 = u32::MAX;
/// Beyond the face.
const BORDER: u32 = u32::MAX - 1;

/// Lists from so many cells on are measured by several threads.
const MANY: usize = 4096;

/// What a cell amounts to in a view.
#[derive(Clone, Copy, Debug, Default)]
struct Look {
    kind: Kind,
    /// Its bound (pixels); 0 for what is not seen.
    bound: f32,
    /// The tolerance (pixels) below which it is cut: its bound, or its parent's if that is less.
    pixels: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Kind {
    /// There is no surface, or out of sight one that is partly void: nothing has to be closed towards it.
    #[default]
    Empty,
    /// Out of sight, and all there.
    Unseen,
    /// Seen, and all there.
    Whole,
    /// Seen and partly void: it is never drawn, since no void is bridged.
    Torn,
}

impl Level {
    /// Begins with the whole faces.
    pub fn start(&mut self, faces: u8) {
        self.clear();
        for face in 0..faces {
            self.cells.push(Cell::face(face));
            self.beside.push([BORDER; 4]);
            self.above.push(f32::INFINITY);
        }
    }

    fn clear(&mut self) {
        self.cells.clear();
        self.beside.clear();
        self.above.clear();
        self.looks.clear();
        self.children.clear();
        self.open.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// How many cells are looked at.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Looks at every cell.
    pub fn measure(&mut self, field: &dyn HeightField, metric: &ScreenMetric) {
        let look = |cell: &Cell, above: &f32| {
            let range = field.range(*cell);
            if range.is_empty() {
                return Look::default();
            }
            let bounds = metric.bounds(*cell, range);
            let error = field.error(*cell);
            if !metric.sees(&bounds) {
                let kind = if error.is_finite() { Kind::Unseen } else { Kind::Empty };
                return Look { kind, ..Look::default() };
            }
            let kind = if error.is_finite() { Kind::Whole } else { Kind::Torn };
            let bound = metric.pixels(&bounds, error);
            Look { kind, bound, pixels: bound.min(*above) }
        };
        self.looks.resize(self.cells.len(), Look::default());
        let Level { cells, above, looks, .. } = self;
        if cells.len() < MANY {
            looks.iter_mut().zip(cells.iter().zip(above.iter())).for_each(|(l, (cell, above))| *l = look(cell, above));
        } else {
            let all = looks.par_iter_mut().zip(cells.par_iter().zip(above.par_iter()));
            all.with_min_len(512).for_each(|(l, (cell, above))| *l = look(cell, above));
        }
    }

    /// Tells the census what is drawn at which tolerance, and finds the sides over which slivers may stand. Answers whether to go on to the next level.
    pub fn count(&mut self, field: &dyn HeightField, census: &mut Census, may_be_cut: bool) -> bool {
        self.open.clear();
        self.open.resize(self.cells.len(), 0);
        let tolerance = census.tolerance();
        let (may_be_cut, least) = if may_be_cut { self.fit(census) } else { (false, 0) };
        for (i, (look, above)) in self.looks.iter().zip(&self.above).enumerate() {
            if look.kind == Kind::Whole {
                census.add(*above, 2);
            }
            if !may_be_cut || look.pixels <= tolerance {
                continue;
            }
            if look.kind == Kind::Whole {
                census.add(look.pixels, -2);
            }
            for side in 0..4 {
                let closes = match self.beside[i][side] {
                    BORDER => false,
                    ABSENT => {
                        // Where nothing is drawn beyond, nothing has to be closed.
                        let beyond = beyond(self.cells[i], side);
                        field.error(beyond).is_finite() && !field.range(beyond).is_empty()
                    }
                    other => {
                        let other = self.looks[other as usize];
                        if other.kind == Kind::Whole && other.pixels > tolerance {
                            census.add(look.pixels.min(other.pixels), -1);
                        }
                        matches!(other.kind, Kind::Whole | Kind::Unseen)
                    }
                };
                if closes {
                    census.add(look.pixels, 1);
                    self.open[i] |= 1 << side;
                }
            }
        }
        census.settle(least);
        may_be_cut
    }

    /// Whether cells may be cut, and above which bin if not all of them.
    fn fit(&mut self, census: &mut Census) -> (bool, usize) {
        let room = census.room(self.cells.len());
        let tolerance = census.tolerance();
        if self.looks.iter().filter(|look| look.pixels > tolerance).count() <= room {
            return (true, 0);
        }
        // The bin of the first that finds no room, the largest bounds coming first.
        self.order.clear();
        self.order.extend(self.looks.iter().map(|look| look.pixels.to_bits()));
        let (_, first, _) = self.order.select_nth_unstable_by(room, |a, b| b.cmp(a));
        let least = (*first >> SHIFT) as usize;
        // Where bounds hardly fall from level to level that would leave next to nothing: then this level is the last.
        let cut = self.order.iter().filter(|&&bits| (bits >> SHIFT) as usize > least).count();
        if census.enough(least, cut) { (true, least) } else { (false, 0) }
    }

    /// Puts the quarters of the cells that `tolerance` (pixels) asks to cut into the next level's list.
    pub fn cut(&mut self, tolerance: f32, next: &mut Level) {
        next.clear();
        self.children.clear();
        let mut first = 0;
        self.children.extend(self.looks.iter().map(|look| {
            if look.pixels <= tolerance {
                return ABSENT;
            }
            first += 4;
            first - 4
        }));
        for (i, &children) in self.children.iter().enumerate() {
            if children == ABSENT {
                continue;
            }
            let across = |side: usize, child: u32| match self.beside[i][side] {
                outside @ (BORDER | ABSENT) => outside,
                other => match self.children[other as usize] {
                    ABSENT => ABSENT,
                    children => children + child,
                },
            };
            next.cells.extend(self.cells[i].children());
            for k in 0..4 {
                let (east, north) = (k & 1 == 1, k & 2 == 2);
                next.beside.push([
                    if north { children + (k ^ 2) } else { across(0, k ^ 2) },
                    if east { across(1, k ^ 1) } else { children + (k ^ 1) },
                    if north { across(2, k ^ 2) } else { children + (k ^ 2) },
                    if east { children + (k ^ 1) } else { across(3, k ^ 1) },
                ]);
            }
            next.above.extend([self.looks[i].pixels; 4]);
        }
    }

    /// Draws what a tolerance (pixels) leaves, and raises `worst` (pixels) to its bound.
    pub fn draw(&self, tolerance: f32, patches: &mut Vec<Patch>, worst: &mut f32) {
        let is_cut = |i: usize| self.looks[i].pixels > tolerance && self.children.get(i).is_some_and(|c| *c != ABSENT);
        for (i, &cell) in self.cells.iter().enumerate() {
            if self.above[i] <= tolerance {
                continue;
            }
            let look = self.looks[i];
            if is_cut(i) {
                let stands = |side: usize| {
                    let other = self.beside[i][side];
                    self.open[i] >> side & 1 == 1 && (other >= BORDER || !is_cut(other as usize))
                };
                patches.extend((0..4).filter(|&side| stands(side)).map(|side| sliver(cell, side)));
                continue;
            }
            *worst = worst.max(look.bound);
            if look.kind == Kind::Whole {
                patches.extend([false, true].map(|far| half(cell, far)));
            }
        }
    }
}

/// The cell beyond a side, which must not be the face's.
fn beyond(cell: Cell, side: usize) -> Cell {
    match side {
        0 => Cell { y: cell.y - 1, ..cell },
        1 => Cell { x: cell.x + 1, ..cell },
        2 => Cell { y: cell.y + 1, ..cell },
        _ => Cell { x: cell.x - 1, ..cell },
    }
}

/// How many triangles would be drawn at each tolerance, as far as is known.
#[derive(Clone, Debug, Default)]
pub(super) struct Census {
    tolerance: f32,
    most: i64,
    /// Triangles at the tolerance.
    count: i64,
    /// For each bin of tolerances: how many more triangles there are below it than above.
    bins: Vec<i32>,
    /// Cells that are looked at, and that may be.
    cells: usize,
    most_cells: usize,
}

/// Cells that are looked at for each triangle allowed, and some beside: usually there are 0.6 to 1.5. Of a surface whose bound hardly falls from level to level, such as that of
/// waves that may break, there would be four times as many on each level.
const CELLS_A_TRIANGLE: usize = 2;
const CELLS_BESIDE: usize = 4096;

/// Bits of a number that do not tell bins apart: 256 bins to an octave.
const SHIFT: u32 = 15;

impl Census {
    /// Begins: a tolerance (pixels) that is kept unless it takes more than `most` triangles.
    pub fn start(&mut self, tolerance: f32, most: usize) {
        let most_cells = most.saturating_mul(CELLS_A_TRIANGLE).saturating_add(CELLS_BESIDE);
        let bins = std::mem::take(&mut self.bins);
        *self = Census { tolerance, most: most as i64, count: 0, bins, cells: 0, most_cells };
        self.bins.clear();
        self.bins.resize((f32::INFINITY.to_bits() >> SHIFT) as usize + 1, 0);
    }

    pub fn tolerance(&self) -> f32 {
        self.tolerance
    }

    /// So many triangles are there at tolerances (pixels) below one, which is above the present.
    fn add(&mut self, below: f32, triangles: i32) {
        self.bins[(below.to_bits() >> SHIFT) as usize] += triangles;
        self.count += i64::from(triangles);
    }

    /// So many more cells are looked at: how many of them may be cut for the lists to stay within bounds.
    fn room(&mut self, cells: usize) -> usize {
        self.cells += cells;
        self.most_cells.saturating_sub(self.cells) / 4
    }

    /// Whether enough of the triangles allowed are left above a bin, if so many cells are cut into four.
    fn enough(&self, least: usize, cut: usize) -> bool {
        let kept: i64 = self.bins[least + 1..].iter().map(|&more| i64::from(more)).sum();
        2 * (kept + 8 * cut as i64) >= self.most
    }

    /// Raises the tolerance until it takes no more triangles than allowed, and above a bin at least.
    fn settle(&mut self, least: usize) {
        let mut bin = 0;
        if self.count > self.most {
            // From the largest tolerance down.
            let mut count = 0;
            bin = self.bins.len() - 1;
            while count + i64::from(self.bins[bin]) <= self.most && bin > 0 {
                count += i64::from(self.bins[bin]);
                bin -= 1;
            }
        } else if least == 0 {
            return;
        }
        let bin = bin.max(least);
        self.tolerance = self.tolerance.max(f32::from_bits((((bin + 1) << SHIFT) - 1) as u32));
        // What is below the new tolerance is no more.
        self.bins[..=bin].fill(0);
        self.count = self.bins[bin + 1..].iter().map(|&more| i64::from(more)).sum();
    }
}
