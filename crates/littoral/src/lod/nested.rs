//! Nested grids: square windows about the viewer, each with cells twice as large as the one within.
//!
//! Made for a sea that moves: no preparation, no decision for a triangle, and heights asked only where something is seen. Every window but the
//! finest is a ring: eight rectangles about a hole (four corners, four sides), and along the hole's edges what joins the ring to the finer
//! window. Windows are snapped to the cells of the next coarser one, so that vertices do not swim.
//!
//! Two ways to join. *Strips* (Y. Liu, X. Xu and X. Chen 2009): the finer border keeps its vertices, and between each coarse edge and the finer
//! vertex over its middle an upright triangle closes the T-crack. *Morphing* (after the geometry clipmaps of F. Losasso and H. Hoppe, 2004):
//! towards the border the vertices that the coarser ring lacks move to where it would draw them, and on the border they are left out; nothing
//! pops when a window moves.
//!
//! The number of windows is what the finest needs to keep the tolerance. Where the rings do not keep it, windows of twice as many cells are
//! tried as far as the limits allow; a drawing by rings cannot follow rough ground as others do, and its bound says so.

use super::drawing::{STEPS, Vertex, coarse_ends};
use super::{Drawing, Limits, Lod, Reached, ScreenMetric, Stencil, ViewError};
use crate::field::HeightField;
use crate::space::{Cell, Place, View};

/// How a window joins the one about it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seams {
    /// Upright triangles over the coarser window's edges.
    #[default]
    Strips,
    /// Vertices that move before they are left out.
    Morphing,
}

/// Square windows within each other.
#[derive(Clone, Debug)]
pub struct Nested {
    /// Where it ends though the tolerance is not met.
    pub limits: Limits,
    /// Cells along the side of a window at first: taken as the next power of two from 4 to 4096.
    pub cells: u32,
    /// How windows join.
    pub seams: Seams,
    windows: Vec<Window>,
    /// For each window in turn: which cells are drawn, and where its vertices are in the mesh.
    drawn: Vec<bool>,
    vertices: Vec<u32>,
    places: Vec<Place>,
    heights: Vec<f32>,
    moved: Vec<f32>,
}

/// One window: its cells are those of a level of the quadtree.
#[derive(Clone, Copy, Debug)]
struct Window {
    level: u8,
    /// Its south-western cell.
    x: u32,
    y: u32,
    /// Cells along its side.
    side: u32,
    /// First column and row of the hole that the finer window fills; the hole is half as wide.
    hole: Option<[u32; 2]>,
}

/// A vertex that is not needed.
const NONE: u32 = u32::MAX;

impl Window {
    fn in_hole(&self, i: u32, j: u32) -> bool {
        self.hole.is_some_and(|[x, y]| {
            let half = self.side / 2;
            (x..x + half).contains(&i) && (y..y + half).contains(&j)
        })
    }

    fn cell(&self, i: u32, j: u32) -> Cell {
        Cell { face: 0, level: self.level, x: self.x + i, y: self.y + j }
    }

    /// Which of its sides (south, east, north, west) lie within the face: there something coarser follows.
    fn inner_sides(&self) -> [bool; 4] {
        let last = 1u64 << self.level;
        [self.y > 0, u64::from(self.x + self.side) < last, u64::from(self.y + self.side) < last, self.x > 0]
    }

    /// How far (cells) a vertex is from the nearest side within the face.
    fn depth(&self, i: u32, j: u32) -> u32 {
        let distances = [j, self.side - i, self.side - j, i];
        let inner = self.inner_sides();
        (0..4).filter(|&k| inner[k]).map(|k| distances[k]).min().unwrap_or(u32::MAX)
    }
}

impl Nested {
    /// The method within limits: windows of 32 cells joined by strips.
    pub fn new(limits: Limits) -> Nested {
        Nested {
            limits,
            cells: 32,
            seams: Seams::Strips,
            windows: Vec::new(),
            drawn: Vec::new(),
            vertices: Vec::new(),
            places: Vec::new(),
            heights: Vec::new(),
            moved: Vec::new(),
        }
    }

    /// Lays windows of `side` cells about the viewer, as many as the tolerance asks for; the bound reached (pixels).
    fn lay(&mut self, field: &dyn HeightField, metric: &ScreenMetric, side: u32) -> f32 {
        self.windows.clear();
        self.drawn.clear();
        let Place { uv, .. } = field.datum().place(metric.eye()).0;
        let middle = uv.clamp(glam::DVec2::ZERO, glam::DVec2::ONE);
        let coarsest = (side.trailing_zeros() as u8).min(self.limits.finest);
        // The coarsest is all of the face, in as many cells as a window has, or the whole power of two below.
        let first = Window { level: coarsest, x: 0, y: 0, side: 1 << coarsest, hole: None };
        self.windows.push(first);
        let mut rings = 0.0f32;
        loop {
            let last = self.windows.len() - 1;
            let window = self.windows[last];
            let whole = self.judge(field, metric, &window, |_, _| true);
            let more = window.level < self.limits.finest
                && window.side >= 4
                && self.windows.len() * 2 * (side * side) as usize <= self.limits.triangles.max(512);
            if whole <= metric.tolerance() || !more {
                self.record(field, metric, &window);
                return rings.max(whole);
            }
            // The finer window, even with the cells of this one, a cell away from its border unless that is the face's.
            let (half, cells) = (window.side / 2, 1u32 << window.level);
            let place = |centre: f64, low: u32| {
                let wanted = (centre * f64::from(cells) - 0.5 * f64::from(half)).round().max(0.0) as u32;
                let least = if low == 0 { 0 } else { low + 1 };
                let most = if low + window.side == cells { low + half } else { low + half - 1 };
                wanted.clamp(least, most)
            };
            let (x, y) = (place(middle.x, window.x), place(middle.y, window.y));
            let ring = Window { hole: Some([x - window.x, y - window.y]), ..window };
            self.windows[last] = ring;
            let worst = self.judge(field, metric, &ring, |i, j| !ring.in_hole(i, j));
            rings = rings.max(worst);
            self.record(field, metric, &ring);
            self.windows.push(Window { level: window.level + 1, x: 2 * x, y: 2 * y, side: window.side, hole: None });
        }
    }

    /// The worst bound (pixels) of some of a window's cells.
    fn judge(
        &self,
        field: &dyn HeightField,
        metric: &ScreenMetric,
        window: &Window,
        wanted: impl Fn(u32, u32) -> bool,
    ) -> f32 {
        // Where vertices move, what the coarser ring would draw adds to the bound.
        let zone = self.zone(window);
        let mut worst = 0.0f32;
        for j in 0..window.side {
            for i in (0..window.side).filter(|&i| wanted(i, j)) {
                let cell = window.cell(i, j);
                let mut error = field.error(cell);
                if let (true, Some(parent)) = (window.depth(i, j) <= zone, cell.parent()) {
                    error += field.error(parent);
                }
                if let Some((_, pixels)) = metric.cell(field, cell, error) {
                    worst = worst.max(pixels);
                }
            }
        }
        worst
    }

    /// Notes which cells of a window are drawn: those seen, whole, and not in its hole.
    fn record(&mut self, field: &dyn HeightField, metric: &ScreenMetric, window: &Window) {
        for j in 0..window.side {
            for i in 0..window.side {
                let cell = window.cell(i, j);
                let drawn =
                    !window.in_hole(i, j) && field.error(cell).is_finite() && metric.cell(field, cell, 0.0).is_some();
                self.drawn.push(drawn);
            }
        }
    }

    /// Width (cells) of the border in which vertices move; 0 for none.
    fn zone(&self, window: &Window) -> u32 {
        if self.seams == Seams::Morphing && self.windows.len() > 1 { (window.side / 8).max(1) } else { 0 }
    }

    /// Puts the vertices into the mesh, with their heights.
    fn evaluate(&mut self, field: &dyn HeightField, drawing: &mut Drawing) {
        self.vertices.clear();
        self.places.clear();
        let mut cells = 0;
        for w in 0..self.windows.len() {
            let window = self.windows[w];
            let (side, columns) = (window.side, window.side + 1);
            let base = self.vertices.len();
            self.vertices.resize(base + (columns * columns) as usize, NONE);
            for j in 0..side {
                for i in 0..side {
                    if self.drawn[cells + (j * side + i) as usize] {
                        for (i, j) in [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)] {
                            self.vertices[base + (j * columns + i) as usize] = 0;
                        }
                    }
                }
            }
            if w > 0 {
                // Those that others move towards, or that end the coarser edges along the sides.
                let zone = self.zone(&window).max(1);
                for j in 0..columns {
                    for i in 0..columns {
                        if self.vertices[base + (j * columns + i) as usize] != NONE && window.depth(i, j) < zone {
                            for (i, j) in coarse_ends(i, j) {
                                self.vertices[base + (j * columns + i) as usize] = 0;
                            }
                        }
                    }
                }
            }
            let step = STEPS >> window.level;
            for j in 0..columns {
                for i in 0..columns {
                    let slot = &mut self.vertices[base + (j * columns + i) as usize];
                    if *slot == NONE {
                        continue;
                    }
                    *slot = drawing.mesh.vertices.len() as u32;
                    let vertex =
                        Vertex { x: (window.x + i) * step, y: (window.y + j) * step, face: 0, height: f32::NAN };
                    self.places.push(vertex.place());
                    drawing.mesh.vertices.push(vertex);
                }
            }
            cells += (side * side) as usize;
        }
        self.heights.clear();
        self.heights.resize(self.places.len(), 0.0);
        field.heights(&self.places, &mut self.heights);
        for (vertex, &height) in drawing.mesh.vertices.iter_mut().zip(&self.heights) {
            vertex.height = height;
        }
    }

    /// Moves the vertices near the borders of windows to where the coarser ones would draw them.
    fn morph(&mut self, drawing: &mut Drawing) {
        let mut base = ((self.windows[0].side + 1) * (self.windows[0].side + 1)) as usize;
        let mut coarse_base = 0;
        for w in 1..self.windows.len() {
            let (window, coarser) = (self.windows[w], self.windows[w - 1]);
            let columns = window.side + 1;
            let zone = self.zone(&window);
            let at = |i: u32, j: u32| self.vertices[base + (j * columns + i) as usize];
            self.moved.clear();
            for j in 0..columns {
                for i in 0..columns {
                    let (slot, depth) = (at(i, j), window.depth(i, j));
                    if slot == NONE {
                        self.moved.push(f32::NAN);
                        continue;
                    }
                    let own = drawing.mesh.vertices[slot as usize].height;
                    let height = if depth == 0 && (i | j) & 1 == 0 {
                        // The coarser window's own vertex, which may have moved.
                        let (x, y) = ((window.x + i) / 2 - coarser.x, (window.y + j) / 2 - coarser.y);
                        let slot = self.vertices[coarse_base + (y * (coarser.side + 1) + x) as usize];
                        if slot == NONE { own } else { drawing.mesh.vertices[slot as usize].height }
                    } else if depth < zone {
                        let [one, other] =
                            coarse_ends(i, j).map(|(i, j)| drawing.mesh.vertices[at(i, j) as usize].height);
                        let coarse = 0.5 * (one + other);
                        let share = 1.0 - depth as f32 / zone as f32;
                        if coarse.is_nan() { own } else { own + (coarse - own) * share }
                    } else {
                        own
                    };
                    self.moved.push(height);
                }
            }
            for (slot, &height) in self.vertices[base..].iter().zip(&self.moved) {
                if *slot != NONE {
                    drawing.mesh.vertices[*slot as usize].height = height;
                }
            }
            coarse_base = base;
            base += (columns * columns) as usize;
        }
    }

    /// Puts the triangles into the mesh.
    fn index(&self, drawing: &mut Drawing) {
        let (mut cells, mut base) = (0, 0);
        let mut coarser: Option<(Window, usize, usize)> = None;
        for &window in &self.windows {
            let (side, columns) = (window.side, window.side + 1);
            let drawn = |i: u32, j: u32| i < side && j < side && self.drawn[cells + (j * side + i) as usize];
            let slot = |i: u32, j: u32| self.vertices[base + (j * columns + i) as usize];
            let inner = window.inner_sides();
            // The cell of the coarser window beyond a vertex of a side, if it is drawn.
            let beyond = |i: u32, j: u32, side_number: usize| {
                let (coarser, cells, _) = coarser?;
                let (x, y) = ((window.x + i) / 2 - coarser.x, (window.y + j) / 2 - coarser.y);
                let (x, y) = match side_number {
                    0 => (x, y.checked_sub(1)?),
                    3 => (x.checked_sub(1)?, y),
                    _ => (x, y),
                };
                (x < coarser.side && y < coarser.side && self.drawn[cells + (y * coarser.side + x) as usize])
                    .then_some(())
            };
            // For an odd vertex of a side: which side, the two cells at it, and the ends of the coarser edge, this window on their left.
            let seam = |i: u32, j: u32| {
                let side_number = match (i, j) {
                    (i, 0) if i & 1 == 1 && inner[0] => 0,
                    (i, j) if i == side && j & 1 == 1 && inner[1] => 1,
                    (i, j) if j == side && i & 1 == 1 && inner[2] => 2,
                    (0, j) if j & 1 == 1 && inner[3] => 3,
                    _ => return None,
                };
                beyond(i, j, side_number)?;
                let k = side - 1;
                Some(match side_number {
                    0 => ([(i - 1, 0), (i, 0)], [(i - 1, 0), (i + 1, 0)]),
                    1 => ([(k, j - 1), (k, j)], [(side, j - 1), (side, j + 1)]),
                    2 => ([(i - 1, k), (i, k)], [(i + 1, side), (i - 1, side)]),
                    _ => ([(0, j - 1), (0, j)], [(0, j + 1), (0, j - 1)]),
                })
            };
            let morphs = self.seams == Seams::Morphing;
            let kept = |i: u32, j: u32| match seam(i, j) {
                Some((at, [from, to])) if morphs && at.iter().all(|&(i, j)| drawn(i, j)) => {
                    let before = from.min(to);
                    slot(before.0, before.1)
                }
                _ => slot(i, j),
            };
            let mut push = |corners: [u32; 3]| {
                let [a, b, c] = corners;
                if a != b && b != c && c != a && corners.iter().all(|&v| v != NONE) {
                    let whole = corners.iter().all(|&v| !drawing.mesh.vertices[v as usize].height.is_nan());
                    if whole {
                        drawing.mesh.triangles.push(corners);
                    }
                }
            };
            for j in 0..side {
                for i in (0..side).filter(|&i| drawn(i, j)) {
                    let [a, b, c, d] = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| kept(i, j));
                    if (i + j) & 1 == 0 {
                        push([a, b, d]);
                        push([a, d, c]);
                    } else {
                        push([a, b, c]);
                        push([b, d, c]);
                    }
                }
            }
            for k in (1..side).step_by(2) {
                for (i, j) in [(k, 0), (side, k), (k, side), (0, k)] {
                    let Some((at, ends)) = seam(i, j) else { continue };
                    let here = at.iter().filter(|&&(i, j)| drawn(i, j)).count();
                    if here == 1 || (here == 2 && !morphs) {
                        let [from, to] = ends.map(|(i, j)| slot(i, j));
                        push([from, to, slot(i, j)]);
                    }
                }
            }
            coarser = Some((window, cells, base));
            cells += (side * side) as usize;
            base += (columns * columns) as usize;
        }
    }
}

impl Default for Nested {
    fn default() -> Nested {
        Nested::new(Limits::default())
    }
}

impl Lod for Nested {
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::on_plane(view, field.datum())?;
        drawing.clear();
        drawing.stencil = Stencil::Triangle;
        let mut side = self.cells.clamp(4, 4096).next_power_of_two();
        let mut pixels = self.lay(field, &metric, side);
        while pixels > metric.tolerance()
            && side < 1 << self.limits.finest.min(14)
            && 4 * self.windows.len() * 2 * (side * side) as usize <= self.limits.triangles
        {
            side *= 2;
            pixels = self.lay(field, &metric, side);
        }
        self.evaluate(field, drawing);
        if self.seams == Seams::Morphing {
            self.morph(drawing);
        }
        self.index(drawing);
        Ok(Reached { pixels, limited: pixels > metric.tolerance() })
    }
}
