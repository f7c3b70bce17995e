//! ROAM from frame to frame (Algorithm II): the mesh of the last view is changed into that of the next.
//!
//! Bounds are nested ([`NestedBounds`]), so no priority grows when a triangle is split, and the mesh wanted is simply the set of diamonds above some
//! priority τ: the tolerance, or where the budget ends. A diamond that may be split has both of its triangles; one that may be merged has no split
//! child. Each frame all of these are measured in a row; those on the wrong side of τ, or within a narrow band about the last frame's, enter
//! two queues; and splits by falling and merges by rising priority go on until the queues agree. Ties fall to the coarser diamond, then by
//! name: the outcome depends on the view alone, not on the way there.
//!
//! The mesh is kept, not made: a split turns two triangles into four and a merge four into two, in their places in one dense array, and
//! what changed is told in ranges, so that a GPU need not be sent the rest.
//!
//! Records link to parents and children only, a cache line each: the neighbours of a cell are children of its parents, so that what has to be found is one step away.
//!
//! Works this rests on: M. Duchaineau et al., "ROAMing terrain: real-time optimally adapting meshes", 1997; P. Lindstrom and V. Pascucci,
//! "Terrain simplification simplified", 2002 (nesting).

use super::bounds::{Bound, NestedBounds};
use super::diamond::{Base, Diamond, FINEST, Point, STEPS};
use super::scan::{Item, Lens, List, MERGE, NOWHERE, Priority, SPLIT, STUCK};
use crate::lod::{Limits, Mesh, Reached, ScreenMetric, Vertex, ViewError};
use crate::space::{Cell, Place, View};
use glam::DVec2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

#[cfg(test)]
mod tests;

const NONE: u32 = u32::MAX;

/// How far beyond the last frame's border priorities enter the queues at first.
const BAND: f32 = 1.004;

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

/// Order of splitting: by priority, then coarser ones first, then by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    /// Bits of a number that is not negative: they sort like it.
    priority: u32,
    level: Reverse<u8>,
    name: u64,
    record: u32,
}

impl Key {
    fn at(&self) -> Point {
        [(self.name >> 32) as u32, self.name as u32]
    }

    fn number(&self) -> f32 {
        f32::from_bits(self.priority)
    }
}

/// ROAM over prepared land, from view to view.
#[derive(Clone, Debug)]
pub struct RoamFlight<'a> {
    bounds: &'a NestedBounds,
    /// Where refinement ends though the tolerance is not met.
    pub limits: Limits,
    /// What comes first.
    pub priority: Priority,
    /// Priorities are measured anew for one in so many groups a frame, round robin (1: all). With more, what is reached is told from priorities up to so many
    /// frames old.
    pub groups: u32,
    turn: u32,
    records: Vec<Record>,
    unused: Vec<u32>,
    list: List,
    /// What may be split, above `low`; what may be merged, up to `high`.
    splits: BinaryHeap<Key>,
    merges: BinaryHeap<Reverse<Key>>,
    band: (f32, f32),
    tolerance: f32,
    border: f32,
    lens: Option<Lens>,
    triangles: usize,
    mesh: Mesh,
    /// Record and side of each triangle.
    owners: Vec<u32>,
    unused_vertices: Vec<u32>,
    freed: Vec<u32>,
    changed: Changes,
    found: Vec<u32>,
    /// Became splittable in the last step.
    ready: Vec<u32>,
    /// Splits and merges since it was made.
    operations: (u64, u64),
}

/// Which parts of a mesh changed, in blocks.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    triangles: Vec<u64>,
    vertices: Vec<u64>,
}

/// Triangles or vertices a block.
const BLOCK: usize = 64;

impl Changes {
    #[inline]
    fn mark(blocks: &mut Vec<u64>, at: u32) {
        let block = at as usize / BLOCK;
        if block / 64 >= blocks.len() {
            blocks.resize(block / 64 + 1, 0);
        }
        blocks[block / 64] |= 1 << (block % 64);
    }

    fn clear(&mut self) {
        self.triangles.fill(0);
        self.vertices.fill(0);
    }

    fn ranges(blocks: &[u64], len: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let marked = move |block: usize| blocks.get(block / 64).is_some_and(|word| word >> (block % 64) & 1 == 1);
        let mut block = 0;
        std::iter::from_fn(move || {
            while block * BLOCK < len && !marked(block) {
                block += 1;
            }
            let from = block;
            while block * BLOCK < len && marked(block) {
                block += 1;
            }
            (from < block).then(|| from * BLOCK..(block * BLOCK).min(len))
        })
    }
}

/// Corners of the face, the first four vertices: south-west, south-east, north-east, north-west.
const CORNERS: [Point; 4] = [[0, 0], [STEPS, 0], [STEPS, STEPS], [0, STEPS]];

impl<'a> RoamFlight<'a> {
    /// A flight over prepared land, with nothing drawn yet.
    pub fn over(bounds: &'a NestedBounds, limits: Limits) -> RoamFlight<'a> {
        RoamFlight {
            bounds,
            limits,
            priority: Priority::default(),
            groups: 1,
            turn: 0,
            records: Vec::new(),
            unused: Vec::new(),
            list: List::default(),
            splits: BinaryHeap::new(),
            merges: BinaryHeap::new(),
            band: (0.0, 0.0),
            tolerance: 0.0,
            border: 0.0,
            lens: None,
            triangles: 0,
            mesh: Mesh::default(),
            owners: Vec::new(),
            unused_vertices: Vec::new(),
            freed: Vec::new(),
            changed: Changes::default(),
            found: Vec::new(),
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

    /// Changes the mesh into that of `view`. `stop` is asked between steps; when it says yes the mesh is left as it is then: conforming, and as near to
    /// the one wanted as the most urgent steps brought it.
    ///
    /// # Errors
    /// If the view is not one that a picture can be drawn of.
    pub fn update(&mut self, view: &View, stop: &mut dyn FnMut() -> bool) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::new(view, self.bounds.datum())?;
        let steps = f64::from(STEPS >> self.shift());
        let heights = (self.bounds.base, self.bounds.step);
        self.lens = Some(Lens::new(&metric, self.bounds.datum(), steps, heights, self.priority));
        self.tolerance = match self.priority {
            Priority::ScreenError => metric.tolerance(),
            Priority::InverseDistance => 0.0,
        };
        self.changed.clear();
        self.splits.clear();
        self.merges.clear();
        self.band = (f32::INFINITY, -1.0);
        if self.records.is_empty() {
            self.begin();
            self.descend();
        } else if let Some(lens) = &self.lens {
            let groups = self.groups.max(1) as usize;
            let turn = self.turn as usize % groups;
            let n = self.list.len();
            self.list.measure(lens, n * turn / groups..n * (turn + 1) / groups);
            self.turn = self.turn.wrapping_add(1);
        }
        let stopped = self.balance(stop);
        self.compact();
        let (worst, void) = self.list.worst(self.tolerance);
        let pixels = if void && self.priority == Priority::ScreenError { f32::INFINITY } else { worst };
        Ok(Reached { pixels, limited: worst > self.tolerance || stopped })
    }

    /// Bits of lattice coordinates below half a sample.
    fn shift(&self) -> u8 {
        Cell::MAX_LEVEL - self.bounds.finest() - 1
    }

    /// The two triangles of the face.
    fn begin(&mut self) {
        self.unused.clear();
        self.list.clear();
        self.mesh.clear();
        self.owners.clear();
        self.unused_vertices.clear();
        self.freed.clear();
        self.mesh.vertices.extend(CORNERS.map(|at| self.vertex(at)));
        (0..4).for_each(|corner| Changes::mark(&mut self.changed.vertices, corner));
        let root = self.record(Diamond::ROOT, [0, 2]);
        self.triangles = 2;
        self.draw(root, Diamond::ROOT, 0, 1);
        self.draw(root, Diamond::ROOT, 1, 3);
        self.join(root, self.idle(Diamond::ROOT));
    }

    fn vertex(&self, at: Point) -> Vertex {
        Vertex { x: at[0], y: at[1], face: 0, height: self.bounds.height(at) }
    }

    /// The list that an unsplit diamond belongs to when it has both triangles.
    fn idle(&self, diamond: Diamond) -> u8 {
        if diamond.cell_level() < self.limits.finest.min(self.bounds.finest()).min(FINEST) { SPLIT } else { STUCK }
    }

    fn record(&mut self, diamond: Diamond, ends: [u32; 2]) -> u32 {
        let record = Record {
            at: diamond.at,
            parents: [NONE; 2],
            children: [NONE; 4],
            triangles: [NONE; 2],
            ends,
            bound: self.bounds.bound(diamond),
            place: NONE,
            list: NOWHERE,
            split: false,
            held: 0,
            kids: 0,
        };
        if let Some(unused) = self.unused.pop() {
            self.records[unused as usize] = record;
            return unused;
        }
        self.records.push(record);
        self.records.len() as u32 - 1
    }

    fn item(&self, bound: Bound, diamond: Diamond, kind: u8, record: u32) -> Item {
        let shift = self.shift();
        Item {
            at: diamond.at[0] >> shift | diamond.at[1] >> shift << 16,
            heights: u32::from(bound.low) | u32::from(bound.high) << 16,
            deviation: bound.deviation(),
            word: Item::word(kind, diamond.is_square(), diamond.half >> shift, record),
        }
    }

    /// Puts a record in the list, and in its queue if it is within the band.
    fn join(&mut self, record: u32, kind: u8) {
        let known = &self.records[record as usize];
        let diamond = Diamond::at(known.at);
        let item = self.item(known.bound, diamond, kind, record);
        let priority = self.lens.as_ref().map_or(0.0, |lens| lens.priority(&item));
        let place = self.list.add(item, priority);
        let known = &mut self.records[record as usize];
        (known.place, known.list) = (place, kind);
        self.enqueue(record, diamond, kind, priority);
    }

    /// Makes a record one of another kind; of what it is its priority says all.
    fn turn(&mut self, record: u32, diamond: Diamond, kind: u8) {
        let known = &mut self.records[record as usize];
        known.list = kind;
        self.list.turn(known.place, kind);
        let priority = self.list.priority[known.place as usize];
        self.enqueue(record, diamond, kind, priority);
    }

    fn enqueue(&mut self, record: u32, diamond: Diamond, kind: u8, priority: f32) {
        match kind {
            SPLIT if priority > self.tolerance => {
                if priority > self.band.0 {
                    self.splits.push(key(priority, diamond, record));
                }
                self.ready.push(record);
            }
            MERGE if priority <= self.band.1 => self.merges.push(Reverse(key(priority, diamond, record))),
            _ => {}
        }
    }

    fn leave(&mut self, record: u32) {
        let known = &mut self.records[record as usize];
        known.list = NOWHERE;
        self.list.remove(known.place);
    }

    /// Draws the triangle of a diamond on the side of one of its parents, whose vertex is `apex`.
    fn draw(&mut self, record: u32, diamond: Diamond, side: usize, apex: u32) {
        let known = self.records[record as usize];
        if !known.bound.whole(side) {
            return;
        }
        let [a, b] = known.ends;
        // Clockwise by the order of the base's ends?
        let towards = diamond.apexes()[side].expect("a triangle on this side");
        let turned = match diamond.base {
            Base::Rising | Base::North => towards[0] > diamond.at[0],
            Base::Falling => towards[0] < diamond.at[0],
            Base::East => towards[1] < diamond.at[1],
        };
        let triangle = if turned { [b, a, apex] } else { [a, b, apex] };
        let owner = 2 * record + side as u32;
        let slot = match self.freed.pop() {
            Some(slot) => {
                self.mesh.triangles[slot as usize] = triangle;
                self.owners[slot as usize] = owner;
                slot
            }
            None => {
                self.mesh.triangles.push(triangle);
                self.owners.push(owner);
                self.owners.len() as u32 - 1
            }
        };
        Changes::mark(&mut self.changed.triangles, slot);
        self.records[record as usize].triangles[side] = slot;
    }

    /// Closes the gaps that merges left among the triangles.
    fn compact(&mut self) {
        self.freed.sort_unstable();
        while let Some(slot) = self.freed.pop() {
            let owner = self.owners.pop().expect("as many owners as triangles");
            let triangle = self.mesh.triangles.pop().expect("freed triangles are there");
            if (slot as usize) < self.owners.len() {
                self.owners[slot as usize] = owner;
                self.mesh.triangles[slot as usize] = triangle;
                self.records[owner as usize / 2].triangles[owner as usize & 1] = slot;
                Changes::mark(&mut self.changed.triangles, slot);
            }
        }
    }

    /// Vertices at the apexes.
    fn apexes(&self, known: &Record, diamond: Diamond) -> [u32; 2] {
        if diamond == Diamond::ROOT {
            return [1, 3];
        }
        known.parents.map(|parent| if parent == NONE { NONE } else { self.records[parent as usize].triangles[0] })
    }

    /// The record of a split diamond's child, if the child's other parent has made it.
    fn met(&self, known: &Record, diamond: Diamond, child: usize) -> Option<u32> {
        // Through a parent to the child's other parent, and how the child lies to that.
        let (parent, other, back) = if diamond.is_square() {
            let (slot, own) = match (diamond.base, child) {
                (Base::Rising, 0 | 1) => (0, 3),
                (Base::Rising, _) => (1, 1),
                (_, 1 | 2) => (0, 0),
                _ => (1, 2),
            };
            (known.parents[slot], if child & 1 == 1 { own ^ 1 } else { 3 - own }, child ^ 2)
        } else {
            let (first, other) = match diamond.base {
                Base::East => (child >= 2, [3, 1, 1, 3][child]),
                _ => (child == 0 || child == 3, [0, 0, 2, 2][child]),
            };
            let slot = usize::from(known.parents[1] != NONE && !first);
            (known.parents[slot], other, [2, 3, 0, 1][child])
        };
        if parent == NONE {
            return None;
        }
        let other = self.records[parent as usize].children[other];
        let other = self.records.get(other as usize).filter(|other| other.split)?;
        Some(other.children[back]).filter(|&child| child != NONE)
    }

    /// Splits a diamond that has both triangles.
    fn split(&mut self, record: u32) {
        let known = self.records[record as usize];
        let diamond = Diamond::at(known.at);
        self.operations.0 += 1;
        self.triangles += cost(&known, diamond);
        self.freed.extend(known.triangles.into_iter().filter(|&slot| slot != NONE));
        let vertex = self.vertex(known.at);
        let slot = match self.unused_vertices.pop() {
            Some(slot) => {
                self.mesh.vertices[slot as usize] = vertex;
                slot
            }
            None => {
                self.mesh.vertices.push(vertex);
                self.mesh.vertices.len() as u32 - 1
            }
        };
        Changes::mark(&mut self.changed.vertices, slot);
        let own = &mut self.records[record as usize];
        (own.split, own.triangles) = (true, [slot, NONE]);
        for parent in known.parents {
            if parent != NONE {
                self.records[parent as usize].kids += 1;
                if self.records[parent as usize].list == MERGE {
                    self.leave(parent);
                }
            }
        }
        let apexes = self.apexes(&known, diamond);
        let (points, ends) = (diamond.apexes(), diamond.ends());
        for (i, child) in diamond.children().into_iter().enumerate() {
            let Some(child) = child else { continue };
            let found = self.met(&known, diamond, i);
            let of = found.unwrap_or_else(|| {
                let vertex = |end: Point| match end {
                    _ if end == ends[0] => known.ends[0],
                    _ if end == ends[1] => known.ends[1],
                    _ if Some(end) == points[0] => apexes[0],
                    _ => apexes[1],
                };
                let ends = child.ends().map(vertex);
                self.record(child, ends)
            });
            let side = usize::from(child.apexes()[0] != Some(diamond.at));
            self.records[record as usize].children[i] = of;
            let held = &mut self.records[of as usize];
            held.parents[side] = record;
            held.held += 1;
            let complete = held.held == if at_border(child) { 1 } else { 2 };
            self.draw(of, child, side, slot);
            if complete {
                let list = self.idle(child);
                self.join(of, list);
            }
        }
        self.turn(record, diamond, MERGE);
    }

    /// Merges a split diamond that has no split child.
    fn merge(&mut self, record: u32) {
        let known = self.records[record as usize];
        let diamond = Diamond::at(known.at);
        self.operations.1 += 1;
        self.triangles -= cost(&known, diamond);
        for child in known.children {
            if child == NONE {
                continue;
            }
            let of = &mut self.records[child as usize];
            let side = usize::from(of.parents[0] != record);
            if of.triangles[side] != NONE {
                self.freed.push(of.triangles[side]);
                of.triangles[side] = NONE;
            }
            of.parents[side] = NONE;
            of.held -= 1;
            let (list, held) = (of.list, of.held);
            if list != NOWHERE {
                self.leave(child);
            }
            if held == 0 {
                self.unused.push(child);
            }
        }
        self.unused_vertices.push(known.triangles[0]);
        let own = &mut self.records[record as usize];
        (own.split, own.triangles, own.children) = (false, [NONE; 2], [NONE; 4]);
        let apexes = self.apexes(&known, diamond);
        for (side, apex) in apexes.into_iter().enumerate() {
            if apex != NONE {
                self.draw(record, diamond, side, apex);
            }
        }
        let kind = self.idle(diamond);
        self.turn(record, diamond, kind);
        for parent in known.parents {
            if parent != NONE {
                self.records[parent as usize].kids -= 1;
                if self.records[parent as usize].kids == 0 {
                    self.join(parent, MERGE);
                }
            }
        }
    }

    /// From scratch: splits by thresholds that fall towards where the budget ends, without a queue.
    fn descend(&mut self) {
        let budget = self.limits.triangles;
        let mut above = f32::INFINITY;
        loop {
            self.ready.clear();
            self.list.within(SPLIT, 0.0, f32::INFINITY, &mut self.found);
            let worst = self.found.iter().map(|&place| self.list.priority[place as usize]).fold(0.0, f32::max);
            if worst <= self.tolerance || self.triangles >= budget {
                break;
            }
            // Triangles are about as many as the inverse of the bound; rather too few steps than one too far.
            let share = self.triangles as f32 / budget as f32;
            above = (above.min(worst) * (1.1 * share).clamp(0.3, 0.97)).max(self.tolerance);
            self.list.within(SPLIT, above, f32::INFINITY, &mut self.found);
            self.ready.extend(self.found.iter().map(|&place| self.list.record(place)));
            while let Some(record) = self.ready.pop() {
                let known = &self.records[record as usize];
                if known.list == SPLIT && self.list.priority[known.place as usize] > above {
                    self.split(record);
                }
                if self.triangles >= budget {
                    break;
                }
            }
        }
        self.border = above;
    }

    /// Whether a key is still true.
    fn valid(&self, key: &Key, list: u8) -> bool {
        let known = &self.records[key.record as usize];
        known.list == list && known.at == key.at() && self.list.priority[known.place as usize].to_bits() == key.priority
    }

    /// Makes the band wider and takes what it holds into the queues.
    fn widen(&mut self, low: f32, high: f32) {
        let (low, high) = (low.min(self.band.0), high.max(self.band.1));
        let key_of = |list: &List, records: &[Record], place: u32| {
            let record = list.record(place);
            key(list.priority[place as usize], Diamond::at(records[record as usize].at), record)
        };
        if low < self.band.0 {
            self.list.within(SPLIT, low.max(self.tolerance), self.band.0, &mut self.found);
            for &place in &self.found {
                let key = key_of(&self.list, &self.records, place);
                if key.number() > self.border {
                    self.bounds.expect(Diamond::at(key.at()));
                }
                self.splits.push(key);
            }
        }
        if high > self.band.1 {
            self.list.within(MERGE, self.band.1, high, &mut self.found);
            self.merges.extend(self.found.iter().map(|&place| Reverse(key_of(&self.list, &self.records, place))));
        }
        self.band = (low, high);
    }

    /// Splits and merges until the queues agree; whether it was stopped.
    fn balance(&mut self, stop: &mut dyn FnMut() -> bool) -> bool {
        let (budget, tolerance) = (self.limits.triangles.max(2), self.tolerance);
        let border = self.border.max(tolerance);
        self.widen((border / BAND).max(tolerance), (border * BAND).max(tolerance));
        let mut wider = BAND;
        let mut steps = 0u32;
        let mut stopped = false;
        loop {
            self.ready.clear();
            steps += 1;
            if steps.is_multiple_of(16) && stop() {
                stopped = true;
                break;
            }
            while self.splits.peek().is_some_and(|top| !self.valid(top, SPLIT)) {
                self.splits.pop();
            }
            while self.merges.peek().is_some_and(|last| !self.valid(&last.0, MERGE)) {
                self.merges.pop();
            }
            let (top, last) = (self.splits.peek().copied(), self.merges.peek().map(|last| last.0));
            let merging = match (top, last) {
                // Nothing is split that need not be.
                (_, Some(last)) if last.number() <= tolerance => true,
                _ if self.triangles > budget => true,
                (Some(top), _) => {
                    let known = &self.records[top.record as usize];
                    if self.triangles + cost(known, Diamond::at(known.at)) <= budget {
                        self.splits.pop();
                        self.split(top.record);
                        continue;
                    }
                    match last {
                        Some(last) if last < top => true,
                        Some(_) => break,
                        None if top.number() > self.band.1 => true,
                        None => break,
                    }
                }
                (None, last) => {
                    // Is there anything below the band, for which there is room or something lower to be merged?
                    let full = self.triangles + 1 > budget;
                    if self.band.0 <= tolerance || full && last.is_none_or(|last| last.number() > self.band.0) {
                        break;
                    }
                    wider *= wider;
                    let low = if wider.is_finite() { self.band.0 / wider } else { 0.0 };
                    self.widen(low.max(tolerance), self.band.1);
                    continue;
                }
            };
            if merging {
                match last {
                    Some(last) => {
                        self.merges.pop();
                        self.merge(last.record);
                    }
                    None if self.band.1 == f32::INFINITY => break,
                    None => {
                        wider *= wider;
                        let high =
                            if wider.is_finite() { self.band.1.max(f32::MIN_POSITIVE) * wider } else { f32::INFINITY };
                        self.widen(self.band.0, high);
                    }
                }
            }
        }
        let next = self.splits.peek().map(Key::number).or(self.merges.peek().map(|last| last.0.number()));
        self.border = next.unwrap_or(border).max(tolerance);
        stopped
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

fn key(priority: f32, diamond: Diamond, record: u32) -> Key {
    Key { priority: priority.to_bits(), level: Reverse(diamond.level()), name: diamond.name(), record }
}
