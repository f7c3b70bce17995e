//! ROAM: a bintree of right triangles, split where the view needs it most.
//!
//! The face is two triangles; each can be bisected at the middle of its base, together with the one on the base's other side. A
//! triangle's neighbour that is too coarse for that is split first (a *forced split*), so that no vertex ever lies on an edge. What is split
//! next is what is drawn farthest from its place (Algorithm I): with the total order of [`Roam`] the outcome depends on the question alone. Over prepared
//! land, whose bounds are nested, [`RoamOnce`] finds the same without a queue, and [`RoamFlight`] changes it from view to view, [`RoamSea`] over a sea that moves.
//!
//! *Bounds over any field.* A half of the cell P is at most `error(P)` off. A quarter of P, over one of its sides, becomes two halves of smaller cells C when
//! that side's middle is raised into place: it is off by at most the greater `error(C)` and that middle's deviation; and by at most twice `error(P)`,
//! since its apex, in the middle of P, is at most `error(P)` off the halves.
//!
//! *Optimality.* Among all conforming meshes with no triangle above a priority τ the smallest is unique: splitting whatever is above τ, and
//! what must be split for it, in any order, ends in it. Steps taken in falling order pass through all of them. A bound may grow when a
//! triangle is split; so if the budget ends the process, the result is the state before whose worst triangle was least.
//!
//! Vertices appear and vanish in one step: a mesh of so few triangles has no level to morph to (the quadtree and the nested grids have).
//!
//! Works this rests on: M. Duchaineau, M. Wolinsky, D. Sigeti, M. Miller, C. Aldrich, M. Mineev-Weinstein, "ROAMing terrain: real-time optimally
//! adapting meshes", 1997; spec page of 1999, which uses it for a sea; P. Lindstrom and V. Pascucci, "Terrain simplification
//! simplified", 2002 (vertices instead of triangles).

mod bounds;
mod diamond;
mod factors;
mod flight;
mod ground;
mod scan;
mod scratch;

pub use bounds::{NestedBounds, TooManySamples};
pub use factors::{Disc, Factors};
pub use flight::{RoamFlight, RoamSea, Waves};
pub use scan::Priority;
pub use scratch::RoamOnce;

use super::{Drawing, Limits, Lod, Reached, ScreenMetric, Vertex, ViewError};
use crate::field::HeightField;
use crate::space::{Place, View};
use diamond::{Diamond, FINEST, Point, STEPS};
use std::collections::{BinaryHeap, HashMap};
use std::hash::{BuildHasherDefault, Hasher};

/// Corners of the face, the first four vertices: south-west, south-east, north-east, north-west.
const CORNERS: [Point; 4] = [[0, 0], [STEPS, 0], [STEPS, STEPS], [0, STEPS]];

/// ROAM over any height field, from scratch for each view.
#[derive(Clone, Debug, Default)]
pub struct Roam {
    /// Where it ends though the tolerance is not met.
    pub limits: Limits,
    nodes: Vec<Node>,
    index: HashMap<u64, u32, BuildHasherDefault<Mixed>>,
    queue: BinaryHeap<Entry>,
    /// Nodes in the order in which they were split: parents before their children.
    split: Vec<u32>,
    forced: Vec<Diamond>,
    surface: Heights,
    /// Nodes whose split asks for heights that were not asked for yet.
    fresh: Vec<u32>,
}

/// Heights of lattice points, each asked for once, and many together: a sea answers sixteen in the time of one.
#[derive(Clone, Debug, Default)]
struct Heights {
    index: HashMap<u64, u32, BuildHasherDefault<Mixed>>,
    places: Vec<Place>,
    /// NaN where void.
    values: Vec<f32>,
}

impl Heights {
    fn clear(&mut self) {
        self.index.clear();
        self.places.clear();
        self.values.clear();
    }

    fn want(&mut self, at: Point) {
        let places = &mut self.places;
        self.index.entry(name(at)).or_insert_with(|| {
            places.push(super::drawing::place(0, at));
            places.len() as u32 - 1
        });
    }

    fn ask(&mut self, field: &dyn HeightField) {
        let known = self.values.len();
        self.values.resize(self.places.len(), 0.0);
        field.heights(&self.places[known..], &mut self.values[known..]);
    }

    /// The height of a point that was asked for.
    fn at(&self, at: Point) -> f32 {
        self.values[self.index[&name(at)] as usize]
    }
}

fn name(at: Point) -> u64 {
    Diamond { at, ..Diamond::ROOT }.name()
}

/// A diamond of which a triangle is there, or was until it was split.
#[derive(Clone, Copy, Debug)]
struct Node {
    diamond: Diamond,
    /// The greater bound of its two triangles (pixels); 0 out of sight. Of triangles that are partly void the size.
    pixels: f32,
    /// Whether any of its triangles is partly void.
    void: bool,
    /// Whether its triangles can be drawn.
    drawn: [bool; 2],
    /// How many splits there were before it was first there.
    born: u32,
    /// How many splits there were before its own.
    split: u32,
    /// Whether the heights that its split asks for are known.
    foreseen: bool,
}

/// Not split, or not there.
const NEVER: u32 = u32::MAX;

/// Order of splitting: by bound, then coarser ones first, then by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    /// Bits of a number that is not negative: they sort like it.
    pixels: u32,
    level: std::cmp::Reverse<u8>,
    name: u64,
    node: u32,
}

/// Spreads names over the table.
#[derive(Clone, Copy, Debug, Default)]
struct Mixed(u64);

impl Hasher for Mixed {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(byte.into()));
    }

    fn write_u64(&mut self, name: u64) {
        // Names end in as many zeros as the lattice is finer than the mesh: both halves of the product, so that all bits tell in the lowest.
        let product = u128::from(self.0 ^ name) * 0x9e37_79b9_7f4a_7c15;
        self.0 = (product >> 64) as u64 ^ product as u64;
    }
}

impl Roam {
    /// The method within limits.
    pub fn new(limits: Limits) -> Roam {
        Roam { limits, ..Roam::default() }
    }

    /// The node of a diamond, measured if it was not there.
    fn node(&mut self, diamond: Diamond, ask: &Question) -> u32 {
        if let Some(&node) = self.index.get(&diamond.name()) {
            return node;
        }
        let node = self.nodes.len() as u32;
        let (pixels, void, drawn) = ask.measure(diamond, &self.surface);
        let born = self.split.len() as u32;
        self.nodes.push(Node { diamond, pixels, void, drawn, born, split: NEVER, foreseen: false });
        self.index.insert(diamond.name(), node);
        if ask.splittable(diamond) && pixels > ask.metric.tolerance() {
            let level = std::cmp::Reverse(diamond.level());
            self.queue.push(Entry { pixels: pixels.to_bits(), level, name: diamond.name(), node });
            self.fresh.push(node);
        }
        node
    }

    /// Asks for the heights that the split of a node needs, and with them for those of all that are likely to be split later.
    fn foresee(&mut self, node: u32, field: &dyn HeightField) {
        if self.nodes[node as usize].foreseen {
            return;
        }
        self.fresh.push(node);
        while let Some(node) = self.fresh.pop() {
            let node = &mut self.nodes[node as usize];
            if !std::mem::replace(&mut node.foreseen, true) && node.diamond.is_square() {
                self.surface.want(node.diamond.at);
                node.diamond.children().into_iter().flatten().for_each(|side| self.surface.want(side.at));
            }
        }
        self.surface.ask(field);
    }

    fn is_split(&self, diamond: Diamond, before: u32) -> bool {
        self.index.get(&diamond.name()).is_some_and(|&node| self.nodes[node as usize].split < before)
    }

    /// Splits in falling order until nothing is above the tolerance, or the limit of triangles; returns how many splits are worth keeping.
    fn refine(&mut self, ask: &Question) -> u32 {
        self.nodes.clear();
        self.index.clear();
        self.queue.clear();
        self.split.clear();
        self.fresh.clear();
        self.surface.clear();
        CORNERS.into_iter().for_each(|corner| self.surface.want(corner));
        self.surface.ask(ask.field);
        self.node(Diamond::ROOT, ask);
        let (mut triangles, mut best) = (2, (f32::INFINITY, 0));
        loop {
            while self.queue.peek().is_some_and(|top| self.nodes[top.node as usize].split != NEVER) {
                self.queue.pop();
            }
            let Some(top) = self.queue.pop() else { return self.split.len() as u32 };
            // Later states cost more: as good is not better.
            let worst = f32::from_bits(top.pixels);
            if worst < best.0 {
                best = (worst, self.split.len() as u32);
            }
            // What must be split before it, deepest last.
            self.forced.clear();
            self.forced.push(self.nodes[top.node as usize].diamond);
            let mut at = 0;
            while at < self.forced.len() {
                for parent in self.forced[at].parents().into_iter().flatten() {
                    if !self.is_split(parent, NEVER) && !self.forced.contains(&parent) {
                        self.forced.push(parent);
                    }
                }
                at += 1;
            }
            triangles += self.forced.iter().map(|d| d.apexes().into_iter().flatten().count()).sum::<usize>();
            if triangles > self.limits.triangles {
                return best.1;
            }
            self.forced.sort_by_key(|d| d.level());
            for i in 0..self.forced.len() {
                let diamond = self.forced[i];
                let node = self.node(diamond, ask);
                self.foresee(node, ask.field);
                self.nodes[node as usize].split = self.split.len() as u32;
                self.split.push(node);
                for child in diamond.children().into_iter().flatten() {
                    self.node(child, ask);
                }
            }
        }
    }

    /// The bound over the triangles that are there after `splits` splits.
    fn reached(&self, splits: u32, ask: &Question) -> Reached {
        let mut reached = Reached { pixels: 0.0, limited: false };
        for node in self.nodes.iter().filter(|node| node.born <= splits && node.split >= splits) {
            let over = node.pixels > ask.metric.tolerance();
            reached.limited |= over;
            reached.pixels = reached.pixels.max(if node.void && over { f32::INFINITY } else { node.pixels });
        }
        reached
    }

    /// Writes the triangles that are there after `splits` splits.
    fn draw(&self, splits: u32, drawing: &mut Drawing) {
        let vertex = |at: Point| {
            let corner = CORNERS.iter().position(|&corner| corner == at);
            corner.map_or_else(|| 4 + self.nodes[self.index[&name(at)] as usize].split, |i| i as u32)
        };
        let split = self.split[..splits as usize].iter().map(|&node| self.nodes[node as usize].diamond.at);
        drawing.mesh.vertices.extend(CORNERS.into_iter().chain(split).map(|at| Vertex {
            x: at[0],
            y: at[1],
            face: 0,
            height: self.surface.at(at),
        }));
        let super::Mesh { vertices, triangles } = &mut drawing.mesh;
        for node in self.nodes.iter().filter(|node| node.born <= splits && node.split >= splits) {
            for (apex, drawn) in node.diamond.apexes().into_iter().zip(node.drawn) {
                let Some(apex) = apex else { continue };
                let there = node.diamond == Diamond::ROOT || self.is_split(Diamond::at(apex), splits);
                if !there || !drawn {
                    continue;
                }
                let triangle = node.diamond.triangle(apex).map(vertex);
                if triangle.iter().all(|&v| !vertices[v as usize].height.is_nan()) {
                    triangles.push(triangle);
                }
            }
        }
    }
}

impl Lod for Roam {
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::on_plane(view, field.datum())?;
        drawing.clear();
        let ask = Question { field, metric, finest: self.limits.finest.min(FINEST) };
        let splits = self.refine(&ask);
        self.draw(splits, drawing);
        Ok(self.reached(splits, &ask))
    }
}

/// What bounds are computed from.
struct Question<'a> {
    field: &'a dyn HeightField,
    metric: ScreenMetric,
    finest: u8,
}

impl Question<'_> {
    /// Whether splitting makes no cell finer than is allowed.
    fn splittable(&self, diamond: Diamond) -> bool {
        diamond.cell_level() < self.finest
    }

    /// The bound of a diamond (pixels), whether any of it is partly void, and which of its triangles can be drawn.
    fn measure(&self, diamond: Diamond, surface: &Heights) -> (f32, bool, [bool; 2]) {
        let (mut pixels, mut void, mut drawn) = (0.0f32, false, [false; 2]);
        for (apex, drawn) in diamond.apexes().into_iter().zip(&mut drawn) {
            let Some(apex) = apex else { continue };
            let cell = diamond.cell(apex);
            let (range, error) = if diamond.is_square() {
                (self.field.range(cell), self.field.error(cell))
            } else {
                self.quarter(diamond, apex, surface)
            };
            if range.is_empty() {
                continue;
            }
            *drawn = error.is_finite();
            // What is partly void is as far off as its cell is large.
            let bounds = if diamond.is_square() || error.is_infinite() {
                self.metric.bounds(cell, self.field.range(cell))
            } else {
                let [a, b] = self.halves(diamond, apex).map(|half| self.metric.bounds(half, range));
                a.union(b)
            };
            if self.metric.sees(&bounds) {
                void |= error.is_infinite();
                pixels = pixels.max(self.metric.pixels(&bounds, error));
            }
            if diamond.is_square() {
                return (pixels, void, [*drawn; 2]);
            }
        }
        (pixels, void, drawn)
    }

    /// The cells that the side's triangle towards `apex` covers half of.
    fn halves(&self, diamond: Diamond, apex: Point) -> [crate::space::Cell; 2] {
        let whole = diamond.cell(apex);
        diamond.ends().map(|end| {
            // The point halfway between the end and the apex is the middle of the smaller cell.
            let [x, y] = [0, 1].map(|i| ((end[i] + apex[i]) / 2) >> (crate::space::Cell::MAX_LEVEL - whole.level - 1));
            crate::space::Cell { level: whole.level + 1, x, y, ..whole }
        })
    }

    /// Heights and error of the triangle over a side towards `apex`.
    fn quarter(&self, diamond: Diamond, apex: Point, surface: &Heights) -> (crate::field::HeightRange, f32) {
        let halves = self.halves(diamond, apex);
        let ranges = halves.map(|half| self.field.range(half));
        let range = ranges[0].union(ranges[1]);
        if ranges[0].is_empty() || ranges[1].is_empty() {
            return (range, f32::INFINITY);
        }
        let error = halves.map(|half| self.field.error(half)).into_iter().fold(0.0, f32::max);
        if error.is_infinite() {
            return (range, error);
        }
        let [a, b] = diamond.ends();
        let [a, m, b] = [a, diamond.at, b].map(|at| surface.at(at));
        if a.is_nan() || m.is_nan() || b.is_nan() {
            return (range, f32::INFINITY);
        }
        let deviation = (m - 0.5 * (a + b)).abs() + 4.0 * f32::EPSILON * a.abs().max(b.abs()).max(m.abs());
        let whole = self.field.error(diamond.cell(apex));
        (range, (error + deviation).min(2.0 * whole))
    }
}
