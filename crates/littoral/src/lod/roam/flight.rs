//! ROAM from frame to frame (Algorithm II): the mesh of the last view is changed into that of the next.
//!
//! Bounds are nested ([`NestedBounds`]), so no priority grows when a triangle is split, and the mesh wanted is simply the set of diamonds above some
//! priority τ: the tolerance, or where the budget ends. A diamond that may be split has both of its triangles; one that may be merged has no split
//! child. Each frame all of these are measured in a row; those on the wrong side of τ, or within a narrow band about the last frame's, enter
//! two queues; and splits by falling and merges by rising priority go on until the queues agree. Ties fall to the coarser diamond, then by
//! name: the outcome depends on the view alone, not on the way there.
//!
//! A frame that follows a stopped one looks at a few hundred of the most urgent first, and at the others only if there is time: putting all that is missing
//! into queues would take the time of the steps.
//!
//! The mesh is kept, not made: a split turns two triangles into four and a merge four into two, in their places in one dense array, and
//! what changed is told in ranges, so that a GPU need not be sent the rest.
//!
//! Records link to parents and children only, a cache line each: the neighbours of a cell are children of its parents, so that what has to be found is one step
//! away. Where time went was waiting for memory; so what a frame will change is loaded before its turn (`foresight`).
//!
//! Works this rests on: M. Duchaineau et al., "ROAMing terrain: real-time optimally adapting meshes", 1997; P. Lindstrom and V. Pascucci,
//! "Terrain simplification simplified", 2002 (nesting).

#![allow(private_bounds, reason = "what is flown over is one of two kinds, each with a name of its own")]

use super::CORNERS;
use super::bounds::{Bound, NestedBounds};
use super::diamond::{Base, Diamond, FINEST, Point, STEPS};
use super::factors::Factors;
use super::ground::Ground;
use super::scan::{Between, Item, Lens, List, MERGE, NOWHERE, Priority, SPLIT, STUCK};
use super::scratch::Search;
use crate::lod::{Limits, Mesh, Reached, ScreenMetric, Vertex, ViewError};
use crate::memory::push;
use crate::space::{Place, View};
use glam::DVec2;
use std::marker::PhantomData;
use std::ops::Range;

mod drawn;
mod foresight;
mod queues;
mod sea;
mod step;
#[cfg(test)]
mod tests;

use drawn::Changes;
use queues::{Key, Queue};
pub use sea::{RoamSea, Waves};

const NONE: u32 = u32::MAX;

/// The most merges that a frame after a stopped one looks at first.
const URGENT: usize = 1024;

/// A diamond of which there is a triangle, or that is split: a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Record {
    at: Point,
    /// Split parents, in the order of [`Diamond::apexes`].
    parents: [u32; 2],
    /// While split: in the order of [`Diamond::children`].
    children: [u32; 4],
    /// Where its triangles are, one for each parent; while split, its vertex.
    triangles: [u32; 2],
    /// Vertices at the ends of its base.
    ends: [u32; 2],
    bound: Bound,
    /// Where it is in the list, and as what.
    place: u32,
    list: u8,
    split: bool,
    /// How many parents are split …
    held: u8,
    /// … and how many children.
    kids: u8,
}

/// A record of nothing yet.
const NEW: Record = Record {
    at: [0; 2],
    parents: [NONE; 2],
    children: [NONE; 4],
    triangles: [NONE; 2],
    ends: [NONE; 2],
    bound: Bound::WATER,
    place: NONE,
    list: NOWHERE,
    split: false,
    held: 0,
    kids: 0,
};

/// ROAM over prepared land, from view to view; over a sea it is [`RoamSea`](super::RoamSea).
#[derive(Clone, Debug)]
pub struct RoamFlight<'a, G = &'a NestedBounds> {
    bounds: G,
    over: PhantomData<&'a ()>,
    /// Where refinement ends though the tolerance is not met.
    pub limits: Limits,
    /// What comes first.
    pub priority: Priority,
    /// What makes triangles matter more or less.
    pub factors: Factors,
    /// Priorities are measured anew for one in so many groups a frame, round robin (1: all). With more, what is reached is told from priorities up to so many
    /// frames old.
    pub groups: u32,
    turn: u32,
    records: Vec<Record>,
    unused: Vec<u32>,
    list: List,
    /// What may be split, above `low`; what may be merged, up to `high`.
    splits: Queue,
    merges: Queue,
    band: (f32, f32),
    /// If the last frame was stopped: the band of what is looked at first.
    urgent: Option<(f32, f32)>,
    tolerance: f32,
    border: f32,
    lens: Option<Lens>,
    triangles: usize,
    mesh: Mesh,
    /// The record of each vertex but the corners: that of the diamond it is the middle of.
    makers: Vec<u32>,
    unused_vertices: Vec<u32>,
    freed: Vec<u32>,
    changed: Changes,
    found: Vec<u32>,
    found_merges: Vec<u32>,
    search: Search,
    /// Became splittable in the last step.
    ready: Vec<u32>,
    /// Splits and merges since it was made.
    operations: (u64, u64),
}

/// The most triangles.
const MOST: usize = 20_000_000;

const _: () = assert!(MOST / 2 * 3 < 1 << Item::RECORD_BITS);

impl<'a> RoamFlight<'a> {
    /// The most triangles that a flight draws, whatever its limits: entries of its list name records by 25 bits, and a mesh of n triangles takes no more than 1.5 n
    /// records.
    pub const MOST: usize = MOST;

    /// A flight over prepared land, with nothing drawn yet.
    pub fn over(bounds: &'a NestedBounds, limits: Limits) -> RoamFlight<'a> {
        RoamFlight::on(bounds, limits)
    }

    /// Changes the mesh into that of `view`. `stop` is asked between steps; when it says yes the mesh is left as it is then: conforming, and as near to
    /// the one wanted as the most urgent steps brought it.
    ///
    /// # Errors
    /// If the view is not one that a picture can be drawn of.
    pub fn update(&mut self, view: &View, stop: &mut dyn FnMut() -> bool) -> Result<Reached, ViewError> {
        self.advance(view, stop)
    }
}

impl<G: Ground> RoamFlight<'_, G> {
    fn on(bounds: G, limits: Limits) -> Self {
        RoamFlight {
            bounds,
            over: PhantomData,
            limits,
            priority: Priority::default(),
            factors: Factors::default(),
            groups: 1,
            turn: 0,
            records: Vec::new(),
            unused: Vec::new(),
            list: List::default(),
            splits: Queue::default(),
            merges: Queue::default(),
            band: (0.0, 0.0),
            urgent: None,
            tolerance: 0.0,
            border: 0.0,
            lens: None,
            triangles: 0,
            mesh: Mesh::default(),
            makers: Vec::new(),
            unused_vertices: Vec::new(),
            freed: Vec::new(),
            changed: Changes::default(),
            found: Vec::new(),
            found_merges: Vec::new(),
            search: Search::default(),
            ready: Vec::new(),
            operations: (0, 0),
        }
    }

    /// What is drawn: triangles without gaps between them in memory, vertices of which some are unused.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Triangles of the bintree, those over voids, which are not drawn, included: what the budget counts.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// Ranges of the mesh's triangles that the last view changed.
    pub fn changed_triangles(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        Changes::ranges(&self.changed.triangles, self.mesh.triangles.len())
    }

    /// Ranges of the mesh's vertices that the last view changed.
    pub fn changed_vertices(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        Changes::ranges(&self.changed.vertices, self.mesh.vertices.len())
    }

    /// Diamonds split and merged since the flight was made; nearly all of them make four triangles of two, or two of four.
    pub fn operations(&self) -> (u64, u64) {
        self.operations
    }

    /// The corners of the triangle over or under a place, found in as many steps as the bintree is deep there; `None` where nothing is drawn.
    pub fn triangle_at(&self, place: Place) -> Option<[Vertex; 3]> {
        let inside = place.uv.cmpge(DVec2::ZERO).all() && place.uv.cmple(DVec2::ONE).all();
        if self.records.is_empty() || !inside {
            return None;
        }
        let point = place.uv * f64::from(STEPS);
        let at = |p: Point| DVec2::new(f64::from(p[0]), f64::from(p[1]));
        // The root is the first record; its first triangle lies to the south-east.
        let (mut record, mut side) = (0, usize::from(point.y > point.x));
        loop {
            let known = &self.records[record];
            if !known.split {
                let triangle = self.mesh.triangles.get(known.triangles[side] as usize)?;
                return Some(triangle.map(|vertex| self.mesh.vertices[vertex as usize]));
            }
            let diamond = Diamond::at(known.at);
            let (middle, apex) = (at(diamond.at), diamond.apexes()[side]?);
            let [a, b] = diamond.ends();
            let end = if (point - middle).dot(at(a) - middle) >= 0.0 { a } else { b };
            let child = [0, 1].map(|i| (end[i] + apex[i]) / 2);
            let index = diamond.children().iter().position(|c| c.is_some_and(|c| c.at == child))?;
            record = known.children[index] as usize;
            side = usize::from(Diamond::at(child).apexes()[0] != Some(diamond.at));
        }
    }

    /// Forgets the mesh.
    pub fn restart(&mut self) {
        self.records.clear();
    }

    /// Changes the mesh into that of a view.
    fn advance(&mut self, view: &View, stop: &mut dyn FnMut() -> bool) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::new(view, self.bounds.datum())?;
        self.lens = Some(self.bounds.lens(&metric, self.priority, &self.factors));
        self.tolerance = self.priority.tolerance(&metric);
        self.changed.clear();
        self.splits.clear();
        self.merges.clear();
        self.band = (f32::INFINITY, -1.0);
        if self.records.is_empty() {
            self.urgent = None;
            self.begin();
            self.descend();
        } else if let Some(lens) = &self.lens {
            let groups = self.groups.max(1) as usize;
            let turn = self.turn as usize % groups;
            let n = self.list.len();
            let part = n * turn / groups..n * (turn + 1) / groups;
            self.turn = self.turn.wrapping_add(1);
            let (mut low, mut high) = self.whole_band();
            if let Some(urgent) = self.urgent {
                (low, high) = (urgent.0.max(low), urgent.1.min(high));
            }
            let within = [Between::new(low, f32::INFINITY), Between::new(-1.0, high)];
            let found = [&mut self.found, &mut self.found_merges];
            self.list.measure(&self.bounds, lens, part, within, found);
            if self.urgent.is_some() && self.found_merges.len() > URGENT {
                // Of what is out of sight one is as good as the other.
                self.found_merges.truncate(URGENT);
            }
            self.enter(low, high);
        }
        let stopped = self.balance(stop);
        self.compact();
        let worst = self.list.worst();
        let void = self.priority == Priority::ScreenError && self.bounds.voids() && self.list.any_void(self.tolerance);
        let pixels = if void { f32::INFINITY } else { worst };
        Ok(Reached { pixels, limited: worst > self.tolerance || stopped })
    }

    /// The two triangles of the face.
    fn begin(&mut self) {
        self.unused.clear();
        self.list.clear();
        self.mesh.clear();
        self.makers.clear();
        self.unused_vertices.clear();
        self.freed.clear();
        self.mesh.vertices.extend(CORNERS.map(|at| self.vertex(at)));
        self.makers.extend([NONE; 4]);
        (0..4).for_each(|corner| Changes::mark(&mut self.changed.vertices, corner));
        let root = self.record(Diamond::ROOT, [0, 2], self.bounds.bound(Diamond::ROOT));
        self.triangles = 2;
        self.draw(root, Diamond::ROOT, 0, 1);
        self.draw(root, Diamond::ROOT, 1, 3);
        self.join(root, self.idle(Diamond::ROOT));
    }

    fn vertex(&self, at: Point) -> Vertex {
        Vertex { x: at[0], y: at[1], face: 0, height: self.bounds.height(at) }
    }

    /// The most triangles.
    fn budget(&self) -> usize {
        self.limits.triangles.clamp(2, MOST)
    }

    /// The level of cells that are not split any more.
    fn finest(&self) -> u8 {
        self.limits.finest.min(self.bounds.finest()).min(FINEST)
    }

    /// The list that an unsplit diamond belongs to when it has both triangles.
    fn idle(&self, diamond: Diamond) -> u8 {
        if diamond.cell_level() < self.finest() { SPLIT } else { STUCK }
    }

    #[inline(always)]
    fn record(&mut self, diamond: Diamond, ends: [u32; 2], bound: Bound) -> u32 {
        let unused = self.unused.pop();
        let place = unused.unwrap_or(self.records.len() as u32);
        if unused.is_none() {
            push(&mut self.records, NEW);
        }
        // Field by field: made elsewhere first, it would be read before it has arrived there.
        let record = &mut self.records[place as usize];
        record.at = diamond.at;
        record.parents = [NONE; 2];
        record.children = [NONE; 4];
        record.triangles = [NONE; 2];
        record.ends = ends;
        record.bound = bound;
        record.place = NONE;
        (record.list, record.split, record.held, record.kids) = (NOWHERE, false, 0, 0);
        place
    }

    /// Puts a record in the list, and in its queue if it is within the band.
    fn join(&mut self, record: u32, kind: u8) {
        let known = &self.records[record as usize];
        let diamond = Diamond::at(known.at);
        let item = self.bounds.item(known.bound, diamond, self.idle(diamond), record);
        let slopes = self.bounds.slopes(diamond);
        let priority = self.lens.as_ref().map_or(0.0, |lens| self.bounds.priority(lens, &item, slopes));
        let place = self.list.add(item, slopes, priority, kind);
        let known = &mut self.records[record as usize];
        (known.place, known.list) = (place, kind);
        self.enqueue(record, diamond, kind, priority);
    }

    /// Makes a record one of another kind; of what it is its priority says all.
    fn turn(&mut self, record: u32, diamond: Diamond, kind: u8) {
        let known = &mut self.records[record as usize];
        known.list = kind;
        self.list.turn(known.place, kind);
        let priority = self.list.priority(known.place);
        self.enqueue(record, diamond, kind, priority);
    }

    fn enqueue(&mut self, record: u32, diamond: Diamond, kind: u8, priority: f32) {
        match kind {
            SPLIT if priority > self.tolerance => {
                if priority > self.band.0 {
                    self.foresee_child(record);
                    self.splits.push(Key::new(priority, diamond, record));
                }
                self.ready.push(record);
            }
            MERGE if priority <= self.band.1 => {
                self.foresee_merge(record, 1);
                self.merges.push(Key::new(priority, diamond, record).reversed());
            }
            _ => {}
        }
    }

    fn leave(&mut self, record: u32) {
        let known = &mut self.records[record as usize];
        known.list = NOWHERE;
        self.list.remove(known.place);
    }
}

/// How many triangles a split adds.
fn cost(record: &Record, diamond: Diamond) -> usize {
    if diamond == Diamond::ROOT || record.parents[1] != NONE { 2 } else { 1 }
}

/// Whether a diamond has one triangle only.
fn at_border(diamond: Diamond) -> bool {
    diamond.at.iter().any(|&c| c == 0 || c == STEPS)
}
