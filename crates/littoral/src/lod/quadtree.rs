//! A restricted quadtree of square patches whose vertices move before they vanish.
//!
//! A square is cut in four while its drawing in n × n cells may be off by more than the tolerance. Neighbours differ by one level at most, so that a side
//! meets either a side as fine or one twice as coarse, whose odd vertices it then leaves out: there are no T-vertices and nothing to stitch.
//! Before a patch gives way to its parent, the vertices that the parent lacks move to where the parent would draw them, and nothing pops.
//!
//! The quadtree is that of R. Pajarola, "Large scale terrain visualization using the restricted quadtree triangulation" (1998); the morphing
//! patches are the idea of F. Strugar, "Continuous distance-dependent level of detail for rendering heightmaps" (2010), who chooses levels by distance
//! alone. Here an error in pixels chooses them, and how far vertices may move is what the tolerance leaves: a patch whose own bound is e and whose
//! parent's is E moves its odd vertices by the share m = (τ − e) / E, so that e + m·E, which bounds what is drawn, never exceeds τ. On a side
//! that two patches share the lesser share counts. A side that leaves out its odd vertices adds how far these lie from the line
//! between their neighbours; where that is too much the coarser patch is cut, too.

use super::drawing::{STEPS, place};
use super::{Drawing, Edge, Limits, Lod, Patch, Reached, ScreenMetric, Stencil, ViewError};
use crate::field::HeightField;
use crate::space::{Cell, Place, View};
use rustc_hash::{FxHashMap, FxHashSet};

/// Cells along a patch's side, and the levels between a patch and its cells.
const CELLS: u32 = 8;
const DEPTH: u8 = 3;

/// Square patches, cut where the error asks for it.
#[derive(Clone, Debug)]
pub struct Quadtree {
    /// Where it ends though the tolerance is not met.
    pub limits: Limits,
    /// Whether vertices move before they vanish.
    pub morphs: bool,
    /// The cells that are cut, by level and as a set.
    levels: Vec<Vec<Cell>>,
    cut: FxHashSet<Cell>,
    leaves: Vec<Leaf>,
    /// Which leaf is which cell.
    index: FxHashMap<Cell, u32>,
    places: Vec<Place>,
    heights: Vec<f32>,
}

/// A patch to be drawn.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    cell: Cell,
    /// Its bound (pixels), and its parent's.
    own: f32,
    parent: f32,
    /// What sides that leave out vertices add (pixels).
    seams: f32,
    /// How far its odd vertices move.
    morph: f32,
}

/// The tolerance is first raised by this factor while it takes too many triangles.
const STEP: f32 = 1.4;

/// The cells beyond a cell's four sides: south, east, north, west.
const SIDES: [(i32, i32); 4] = [(0, -1), (1, 0), (0, 1), (-1, 0)];

impl Quadtree {
    /// The method within limits, with morphing.
    pub fn new(limits: Limits) -> Quadtree {
        Quadtree {
            limits,
            morphs: true,
            levels: vec![Vec::new(); usize::from(Cell::MAX_LEVEL) + 1],
            cut: FxHashSet::default(),
            leaves: Vec::new(),
            index: FxHashMap::default(),
            places: Vec::new(),
            heights: Vec::new(),
        }
    }

    /// Level of the smallest patches.
    fn deepest(&self) -> u8 {
        self.limits.finest.min(Cell::MAX_LEVEL).saturating_sub(DEPTH)
    }

    /// Marks a cell as cut.
    fn mark(&mut self, cell: Cell) -> bool {
        let new = self.cut.insert(cell);
        if new {
            self.levels[usize::from(cell.level)].push(cell);
        }
        new
    }

    /// Cuts all that `tolerance` pixels ask for; `false` if that takes more triangles than allowed.
    fn refine(&mut self, field: &dyn HeightField, metric: &ScreenMetric, tolerance: f32) -> bool {
        self.cut.clear();
        self.levels.iter_mut().for_each(Vec::clear);
        let mut level = 0;
        let deepest = self.deepest();
        let wants = |cell: Cell| {
            cell.level < deepest
                && metric
                    .cell(field, cell, field.stencil_error(cell, DEPTH))
                    .is_some_and(|(_, pixels)| pixels > tolerance)
        };
        if wants(Cell::face(0)) {
            self.mark(Cell::face(0));
        }
        while level < usize::from(deepest) {
            for i in 0..self.levels[level].len() {
                for child in self.levels[level][i].children() {
                    if wants(child) {
                        self.mark(child);
                    }
                }
            }
            if !self.within_budget() {
                return false;
            }
            level += 1;
        }
        true
    }

    /// Whether so many cuts may leave no more triangles than allowed, if no more than half of the patches are out of sight.
    fn within_budget(&self) -> bool {
        (3 * self.cut.len() + 1) * (2 * CELLS * CELLS) as usize / 2 <= self.limits.triangles.max(512)
    }

    /// Cuts more until neighbours differ by one level at most.
    fn balance(&mut self, field: &dyn HeightField) {
        for level in (1..self.levels.len()).rev() {
            let mut i = 0;
            while i < self.levels[level].len() {
                let cell = self.levels[level][i];
                i += 1;
                self.mark(cell.parent().expect("not the whole face"));
                for beyond in SIDES.iter().filter_map(|&by| neighbour(cell, by)) {
                    let parent = beyond.parent().expect("not the whole face");
                    if !self.cut.contains(&parent) && !field.range(beyond).is_empty() {
                        self.mark(parent);
                    }
                }
            }
        }
    }

    /// Lists what is not cut and is seen.
    fn list(&mut self, field: &dyn HeightField, metric: &ScreenMetric) {
        self.leaves.clear();
        self.index.clear();
        let deepest = self.deepest();
        let plain = |cell: Cell| metric.cell(field, cell, field.stencil_error(cell, DEPTH)).map(|(_, pixels)| pixels);
        // Nothing is finer than these, which near the eye are far smaller than the patch.
        let bound = |cell: Cell| if cell.level >= deepest { bound(field, metric, cell, DEPTH) } else { plain(cell) };
        if let (true, Some(own)) = (self.cut.is_empty(), bound(Cell::face(0))) {
            self.index.insert(Cell::face(0), 0);
            self.leaves.push(Leaf { cell: Cell::face(0), own, parent: f32::INFINITY, seams: 0.0, morph: 0.0 });
        }
        for level in &self.levels {
            for &cell in level {
                let parent =
                    metric.cell(field, cell, field.stencil_error(cell, DEPTH)).map_or(f32::INFINITY, |(_, p)| p);
                for child in cell.children() {
                    if let Some(own) = bound(child).filter(|_| !self.cut.contains(&child)) {
                        self.index.insert(child, self.leaves.len() as u32);
                        self.leaves.push(Leaf { cell: child, own, parent, seams: 0.0, morph: 0.0 });
                    }
                }
            }
        }
    }

    /// Whether the leaf beyond a side is coarser.
    fn is_coarser(&self, field: &dyn HeightField, beyond: Cell) -> bool {
        beyond.parent().is_some_and(|parent| !self.cut.contains(&parent)) && !field.range(beyond).is_empty()
    }

    /// Measures the sides that leave out vertices; cuts the coarser patch where that is too much. `true` if any was cut.
    fn measure_seams(&mut self, field: &dyn HeightField, metric: &ScreenMetric, tolerance: f32) -> bool {
        let mut any = false;
        for i in 0..self.leaves.len() {
            let Leaf { cell, own, .. } = self.leaves[i];
            let mut seams = 0.0f32;
            for (side, &by) in SIDES.iter().enumerate() {
                let Some(beyond) = neighbour(cell, by).filter(|&beyond| self.is_coarser(field, beyond)) else {
                    continue;
                };
                let off = self.seam(field, cell, side);
                let bounds = metric.bounds(cell, field.range(cell));
                let pixels = off * metric.pixels_per_metre(&bounds);
                if own.is_finite() && own + pixels > tolerance {
                    any |= self.mark(beyond.parent().expect("a coarser one"));
                }
                seams = seams.max(pixels);
            }
            self.leaves[i].seams = seams;
        }
        any
    }

    /// How far (m) the odd vertices on a side of a patch lie from the lines between their neighbours.
    fn seam(&mut self, field: &dyn HeightField, cell: Cell, side: usize) -> f32 {
        let step = (STEPS >> cell.level) / CELLS;
        let (x, y) = (cell.x * CELLS, cell.y * CELLS);
        self.places.clear();
        self.places.extend((0..=CELLS).map(|i| {
            let (x, y) = match side {
                0 => (x + i, y),
                1 => (x + CELLS, y + i),
                2 => (x + i, y + CELLS),
                _ => (x, y + i),
            };
            place(cell.face, [x * step, y * step])
        }));
        self.heights.clear();
        self.heights.resize(self.places.len(), 0.0);
        field.heights(&self.places, &mut self.heights);
        let h = &self.heights;
        // `max` passes over what is void.
        (1..h.len()).step_by(2).fold(0.0, |most, i| (h[i] - 0.5 * (h[i - 1] + h[i + 1])).abs().max(most))
    }

    /// Says how far vertices move.
    fn morph(&mut self, tolerance: f32) {
        for leaf in &mut self.leaves {
            let left = (tolerance * (1.0 - 1e-5) - leaf.own - leaf.seams).max(0.0);
            leaf.morph = match leaf.parent {
                parent if !parent.is_finite() => 0.0,
                parent if parent <= left => 1.0,
                parent => left / parent,
            };
        }
    }

    /// The patch of a leaf.
    fn patch(&self, field: &dyn HeightField, leaf: &Leaf) -> Patch {
        let edges = SIDES.map(|by| {
            let Some(beyond) = neighbour(leaf.cell, by) else { return Edge { morph: leaf.morph, coarser: false } };
            if self.is_coarser(field, beyond) {
                return Edge { morph: 0.0, coarser: true };
            }
            let morph = match self.index.get(&beyond) {
                Some(&other) => leaf.morph.min(self.leaves[other as usize].morph),
                // Beyond a finer side nothing moves; beyond one out of sight nobody minds.
                None => 0.0,
            };
            Edge { morph, coarser: false }
        });
        Patch { morph: leaf.morph, edges, ..Patch::of(leaf.cell) }
    }
}

impl Default for Quadtree {
    fn default() -> Quadtree {
        Quadtree::new(Limits::default())
    }
}

impl Lod for Quadtree {
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::on_plane(view, field.datum())?;
        drawing.clear();
        drawing.stencil = Stencil::Square(CELLS);
        let mut tolerance = metric.tolerance();
        if !self.attempt(field, &metric, tolerance) {
            tolerance = self.relax(field, &metric, tolerance);
        }
        if self.morphs {
            self.morph(tolerance);
        }
        let mut pixels = 0.0f32;
        for leaf in &self.leaves {
            pixels = pixels.max(leaf.own + leaf.seams);
            // No void is bridged: what is partly void is left out.
            if field.stencil_error(leaf.cell, DEPTH).is_finite() {
                if leaf.morph > 0.0 {
                    pixels = pixels.max(leaf.own + leaf.seams + leaf.morph * leaf.parent);
                }
                drawing.patches.push(self.patch(field, leaf));
            }
        }
        Ok(Reached { pixels, limited: pixels > metric.tolerance() })
    }
}

impl Quadtree {
    /// Makes the attempt with the least tolerance that keeps the limit of triangles, or little more, given one that does not.
    fn relax(&mut self, field: &dyn HeightField, metric: &ScreenMetric, tolerance: f32) -> f32 {
        /// Halvings of the last step: to a sixth of it.
        const FINER: u32 = 3;
        let mut low = tolerance;
        let mut high = low * STEP;
        while !self.attempt(field, metric, high) {
            (low, high) = (high, high * STEP);
        }
        let mut last = high;
        for _ in 0..FINER {
            if self.triangles() * 10 >= self.limits.triangles * 9 && last == high {
                return high;
            }
            last = (low * high).sqrt();
            if self.attempt(field, metric, last) {
                high = last;
            } else {
                low = last;
            }
        }
        if last != high {
            self.attempt(field, metric, high);
        }
        high
    }

    /// Triangles of the patches that are listed.
    fn triangles(&self) -> usize {
        self.leaves.len() * (2 * CELLS * CELLS) as usize
    }

    /// All but the morphing; `false` if `tolerance` takes more triangles than allowed.
    fn attempt(&mut self, field: &dyn HeightField, metric: &ScreenMetric, tolerance: f32) -> bool {
        if !self.refine(field, metric, tolerance) {
            return false;
        }
        // Each round cuts cells that stay cut, so that there are few.
        loop {
            self.balance(field);
            if !self.within_budget() {
                return false;
            }
            self.list(field, metric);
            if self.triangles() > self.limits.triangles.max(512) {
                return false;
            }
            if !self.measure_seams(field, metric, tolerance) {
                return true;
            }
        }
    }
}

/// The bound (pixels) of a cell drawn in cells `depth` levels below it; `None` if nothing of it is seen. Where it is larger than the tolerance, which it is
/// near the eye, it is that of the parts.
fn bound(field: &dyn HeightField, metric: &ScreenMetric, cell: Cell, depth: u8) -> Option<f32> {
    let (_, pixels) = metric.cell(field, cell, field.stencil_error(cell, depth))?;
    if pixels <= metric.tolerance() || depth == 0 || cell.level == Cell::MAX_LEVEL {
        return Some(pixels);
    }
    cell.children().into_iter().filter_map(|child| bound(field, metric, child, depth - 1)).reduce(f32::max)
}

/// The cell of the same level beyond a side; `None` where the face ends.
fn neighbour(cell: Cell, (i, j): (i32, i32)) -> Option<Cell> {
    let last = (1u32 << cell.level) - 1;
    let (x, y) = (cell.x.checked_add_signed(i)?, cell.y.checked_add_signed(j)?);
    (x <= last && y <= last).then_some(Cell { x, y, ..cell })
}
