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
//! The number of windows is what the finest needs to keep the tolerance. Where the rings do not keep it, larger windows are
//! tried as far as the limits allow; a drawing by rings cannot follow rough ground as others do, and its bound says so. Or there are as many windows of as
//! many cells as one says, as in 2009.
//!
//! What is asked of a window is asked of blocks of its cells: a block out of sight or within the frame is settled at once, and the worst cell is found
//! by looking only where a block's bound exceeds the worst so far.

mod layer;
mod window;

use super::drawing::{STEPS, Vertex, coarse_ends, halves};
use super::{Drawing, Limits, Lod, Reached, ScreenMetric, Stencil, ViewError};
use crate::field::HeightField;
use crate::space::{Place, View};
use layer::{Layer, NONE};
use window::{Judge, Window};

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
    /// Cells along the side of a window: at least so many, as far as the limits allow. Taken as a multiple of 4, from 4 to 4096.
    pub cells: u32,
    /// So many windows of `cells` cells (the outermost: as the whole face has at a level of its quadtree), whatever the tolerance and the number of triangles.
    /// `None` for as many, and as large ones, as these ask for.
    pub windows: Option<u8>,
    /// How windows join.
    pub seams: Seams,
    /// The windows that are drawn, from the outermost, and others whose memory is kept.
    layers: Vec<Layer>,
    laid: usize,
    places: Vec<Place>,
    heights: Vec<f32>,
}

/// What came of laying windows.
struct Laid {
    /// Whether they keep the limit of triangles.
    fits: bool,
    /// The bound (pixels) of all but the finest, and of all. On trial nobody asks how large they are beyond the tolerance.
    rings: f32,
    pixels: f32,
}

/// The sizes of windows that are tried are this many to an octave, so that one of them takes most of the triangles allowed, yet a small
/// change of the view mostly leaves all as it is.
const TO_AN_OCTAVE: i32 = 10;

/// Cells along the side of the n-th window that is tried.
fn side(n: i32) -> u32 {
    (f64::exp2(f64::from(n) / f64::from(TO_AN_OCTAVE)).round() as u32).clamp(1, 1024) * 4
}

impl Nested {
    /// The method within limits: windows of at least 32 cells joined by strips.
    pub fn new(limits: Limits) -> Nested {
        Nested {
            limits,
            cells: 32,
            windows: None,
            seams: Seams::Strips,
            layers: Vec::new(),
            laid: 0,
            places: Vec::new(),
            heights: Vec::new(),
        }
    }

    /// Adds a window, with what is seen of it.
    fn add(&mut self, field: &dyn HeightField, metric: &ScreenMetric, window: Window) {
        if self.layers.len() == self.laid {
            self.layers.push(Layer::default());
        }
        let layer = &mut self.layers[self.laid];
        layer.start(window);
        Judge { field, metric, window, zone: 0 }.record(layer);
        self.laid += 1;
    }

    /// Lays windows of `side` cells about the viewer, as many as the tolerance asks for or as there shall be. Where they take more triangles than
    /// allowed, it stops: with fewer windows, or, `on_trial`, with nothing.
    fn lay(&mut self, field: &dyn HeightField, metric: &ScreenMetric, side: u32, on_trial: bool) -> Laid {
        self.laid = 0;
        let Place { uv, .. } = field.datum().place(metric.eye()).0;
        let middle = uv.clamp(glam::DVec2::ZERO, glam::DVec2::ONE);
        let tolerance = metric.tolerance();
        // The outermost is all of the face, in as many cells as a window has, or the whole power of two below.
        let level = (side.ilog2() as u8).min(self.limits.finest);
        self.add(field, metric, Window { level, x: 0, y: 0, side: 1 << level, half: side / 2, hole: None });
        let (mut rings, mut cells) = (0.0f32, 0);
        loop {
            let last = self.laid - 1;
            let window = self.layers[last].window;
            let judge = |window: Window| Judge { field, metric, window, zone: self.zone(&window) };
            let more = match self.windows {
                Some(count) => self.laid < usize::from(count),
                None => judge(window).worst(0.0, tolerance) > tolerance,
            };
            if !more || window.level >= self.limits.finest {
                let whole = if on_trial { 0.0 } else { judge(window).worst(rings, f32::INFINITY) };
                let fits = 2 * (cells + self.layers[last].count + last * side as usize) <= self.limits.triangles;
                return Laid { fits, rings, pixels: rings.max(whole) };
            }
            let (ring, finer) = window.around(middle);
            self.layers[last].cut(ring);
            self.add(field, metric, finer);
            let seen = cells + self.layers[last].count + self.layers[last + 1].count;
            // Two triangles a cell, and what closes the seams.
            let triangles = 2 * (seen + self.laid * side as usize);
            if self.windows.is_none() && triangles > self.limits.triangles {
                self.laid = last;
                if on_trial {
                    return Laid { fits: false, rings, pixels: rings };
                }
                self.add(field, metric, window);
                let whole = Judge { field, metric, window, zone: self.zone(&window) }.worst(rings, f32::INFINITY);
                return Laid { fits: false, rings, pixels: rings.max(whole) };
            }
            cells += self.layers[last].count;
            if !on_trial || rings <= tolerance {
                let enough = if on_trial { tolerance } else { f32::INFINITY };
                rings = Judge { field, metric, window: ring, zone: self.zone(&ring) }.worst(rings, enough);
            }
        }
    }

    /// Lays the smallest windows that keep the tolerance, or the largest that keep the limit of triangles; the bound reached (pixels).
    fn search(&mut self, field: &dyn HeightField, metric: &ScreenMetric) -> f32 {
        let asked = self.cells.clamp(4, 4096);
        if self.windows.is_some() {
            return self.lay(field, metric, asked.next_multiple_of(4), false).pixels;
        }
        let mut low = (0..).find(|&n| side(n) >= asked).unwrap_or(0);
        let mut high = low;
        let first = self.lay(field, metric, side(low), true);
        let enough = |laid: &Laid| laid.rings <= metric.tolerance();
        let mut best = None;
        if !first.fits {
            low = -1;
        } else if enough(&first) {
            best = Some(high);
        } else {
            let most = 1 << self.limits.finest.min(12);
            loop {
                if side(high) >= most {
                    best = Some(high);
                    break;
                }
                (low, high) = (high, high + TO_AN_OCTAVE);
                let laid = self.lay(field, metric, side(high), true);
                if laid.fits && enough(&laid) {
                    best = Some(high);
                }
                if !laid.fits || enough(&laid) {
                    break;
                }
            }
        }
        let grows = first.fits;
        while high - low > 1 && (best != Some(low)) {
            let middle = (low + high) / 2;
            let laid = self.lay(field, metric, side(middle), true);
            if laid.fits && (!grows || !enough(&laid)) {
                low = middle;
            } else {
                high = middle;
                best = laid.fits.then_some(middle).or(best);
            }
        }
        self.lay(field, metric, side(best.unwrap_or(low.max(0))), false).pixels
    }

    /// Width (cells) of the border in which vertices move; 0 for none.
    fn zone(&self, window: &Window) -> u32 {
        if self.seams == Seams::Morphing { (window.half / 4).max(1) } else { 0 }
    }

    /// Puts the vertices into the mesh, with their heights.
    fn evaluate(&mut self, field: &dyn HeightField, drawing: &mut Drawing) {
        self.places.clear();
        for w in 0..self.laid {
            let zone = self.zone(&self.layers[w].window).max(1);
            let layer = &mut self.layers[w];
            layer.mark_vertices(if w > 0 { zone } else { 0 });
            let window = layer.window;
            let step = STEPS >> window.level;
            layer.number(drawing.mesh.vertices.len() as u32, |i, j| {
                let vertex = Vertex { x: (window.x + i) * step, y: (window.y + j) * step, face: 0, height: f32::NAN };
                self.places.push(vertex.place());
                drawing.mesh.vertices.push(vertex);
            });
        }
        self.heights.clear();
        self.heights.resize(self.places.len(), 0.0);
        field.heights(&self.places, &mut self.heights);
        for (vertex, &height) in drawing.mesh.vertices.iter_mut().zip(&self.heights) {
            vertex.height = height;
        }
    }

    /// Moves the vertices near the borders of windows to where the coarser ones would draw them.
    fn morph(&self, drawing: &mut Drawing) {
        let vertices = &mut drawing.mesh.vertices;
        for layers in self.layers[..self.laid].windows(2) {
            let [coarser, layer] = layers else { continue };
            let window = layer.window;
            let zone = self.zone(&window);
            // First what the coarser window lacks; it moves by the heights of what that has.
            layer.near_border(zone, |i, j, slot| {
                if (i | j) & 1 == 1 {
                    let ends = coarse_ends(i, j).map(|(i, j)| vertices[layer.vertex(i, j) as usize].height);
                    let coarse = 0.5 * (ends[0] + ends[1]);
                    let share = 1.0 - window.depth(i, j) as f32 / zone as f32;
                    let height = &mut vertices[slot as usize].height;
                    if !coarse.is_nan() {
                        *height += (coarse - *height) * share;
                    }
                }
            });
            // Then, on the border, the coarser window's own vertices, which may have moved.
            layer.near_border(1, |i, j, slot| {
                if (i | j) & 1 == 0 {
                    let at = [(window.x + i) / 2 - coarser.window.x, (window.y + j) / 2 - coarser.window.y];
                    let theirs = coarser.vertex(at[0], at[1]);
                    if theirs != NONE {
                        vertices[slot as usize].height = vertices[theirs as usize].height;
                    }
                }
            });
        }
    }

    /// Puts the triangles into the mesh.
    fn index(&self, drawing: &mut Drawing) {
        let mesh = &mut drawing.mesh;
        // A cell that is drawn has all its heights, but numbers are believed when seen.
        let whole = !self.heights.iter().any(|height| height.is_nan());
        let morphs = self.seams == Seams::Morphing;
        for (w, layer) in self.layers[..self.laid].iter().enumerate() {
            let (side, inner) = (layer.window.side, layer.window.inner_sides());
            let coarser = w.checked_sub(1).map(|w| &self.layers[w]);
            // For an odd vertex of a side: the two cells at it, and the ends of the coarser edge, this window on their left.
            let seam = |i: u32, j: u32| {
                let number = match (i, j) {
                    (i, 0) if i & 1 == 1 && inner[0] => 0,
                    (i, j) if i == side && j & 1 == 1 && inner[1] => 1,
                    (i, j) if j == side && i & 1 == 1 && inner[2] => 2,
                    (0, j) if j & 1 == 1 && inner[3] => 3,
                    _ => return None,
                };
                if !layer.is_drawn_beyond(coarser?, i, j, number) {
                    return None;
                }
                let k = side - 1;
                Some(match number {
                    0 => ([(i - 1, 0), (i, 0)], [(i - 1, 0), (i + 1, 0)]),
                    1 => ([(k, j - 1), (k, j)], [(side, j - 1), (side, j + 1)]),
                    2 => ([(i - 1, k), (i, k)], [(i + 1, side), (i - 1, side)]),
                    _ => ([(0, j - 1), (0, j)], [(0, j + 1), (0, j - 1)]),
                })
            };
            let kept = |i: u32, j: u32| match seam(i, j) {
                Some((at, [from, to])) if morphs && at.iter().all(|&(i, j)| layer.is_drawn(i, j)) => {
                    let before = from.min(to);
                    layer.vertex(before.0, before.1)
                }
                _ => layer.vertex(i, j),
            };
            let mut push = |corners: [u32; 3]| {
                let [a, b, c] = corners;
                let there = |v: u32| v != NONE && (whole || !mesh.vertices[v as usize].height.is_nan());
                if a != b && b != c && c != a && corners.iter().all(|&v| there(v)) {
                    mesh.triangles.push(corners);
                }
            };
            layer.runs(|j, from, to| {
                // Vertices of a row follow each other, and only those of the border may be left out.
                let (south, north) = (layer.vertex(from, j), layer.vertex(from, j + 1));
                for i in from..to {
                    let (a, c) = (south + (i - from), north + (i - from));
                    let border = i == 0 || j == 0 || i + 1 == side || j + 1 == side;
                    let corners = match border {
                        false => [a, a + 1, c, c + 1],
                        true => [kept(i, j), kept(i + 1, j), kept(i, j + 1), kept(i + 1, j + 1)],
                    };
                    halves(i, j, corners).into_iter().for_each(&mut push);
                }
            });
            for k in (1..side).step_by(2) {
                for (i, j) in [(k, 0), (side, k), (k, side), (0, k)] {
                    let Some((at, ends)) = seam(i, j) else { continue };
                    let here = at.iter().filter(|&&(i, j)| layer.is_drawn(i, j)).count();
                    if here == 1 || (here == 2 && !morphs) {
                        let [from, to] = ends.map(|(i, j)| layer.vertex(i, j));
                        push([from, to, layer.vertex(i, j)]);
                    }
                }
            }
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
        let pixels = self.search(field, &metric);
        self.evaluate(field, drawing);
        if self.seams == Seams::Morphing {
            self.morph(drawing);
        }
        self.index(drawing);
        Ok(Reached { pixels, limited: pixels > metric.tolerance() })
    }
}
