//! ROAM over prepared land from scratch: nothing is kept from view to view, and no queue is needed.
//!
//! Bounds are nested, so the mesh wanted is the set of diamonds above some priority τ, and one is above τ only if both of its parents are. So the set is
//! found breadth first, many priorities at a time, each diamond being asked for by its first parent only. Where a budget ends the refinement, τ is not
//! known: it falls in steps, each going on from what the one before left, until a few triangles too many are found; those of least priority are
//! given back. The mesh is then one walk down the bintree, along which neighbours follow each other.
//!
//! Works this rests on: M. Duchaineau et al., "ROAMing terrain: real-time optimally adapting meshes", 1997; P. Lindstrom and V. Pascucci,
//! "Terrain simplification simplified", 2002.

use super::CORNERS;
use super::bounds::NestedBounds;
use super::diamond::Diamond;
use super::factors::{Factors, Slopes};
use super::scan::{Item, Lens, Priority, SPLIT, measure};
use crate::lod::{Limits, Mesh, Reached, ScreenMetric, Vertex, ViewError};
use crate::space::View;

/// ROAM over prepared land, for one view: the mesh of [`super::RoamFlight`], faster than a flight's first, but nothing of it serves the next.
#[derive(Clone, Debug)]
pub struct RoamOnce<'a> {
    bounds: &'a NestedBounds,
    /// Where refinement ends though the tolerance is not met.
    pub limits: Limits,
    /// What comes first.
    pub priority: Priority,
    /// What makes triangles matter more or less.
    pub factors: Factors,
    search: Search,
    /// For each sample the vertex on it; 0 where there is none.
    vertices: Vec<u32>,
}

/// The search for the diamonds that are to be split, and its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    /// What is to be split: middle (steps) and priority (bits).
    taken: Vec<(u32, u32)>,
    /// What is not.
    waiting: Vec<(Item, f32)>,
    wave: Vec<u32>,
    asked: Vec<Item>,
    slopes: Vec<Slopes>,
    numbers: Vec<f32>,
    bits: Vec<u32>,
    rest: Vec<(Order, u32)>,
}

/// Order of splitting: priority (bits), how coarse it is, and its name.
pub(super) type Order = (u32, std::cmp::Reverse<u8>, u64);

/// What a search found beside the diamonds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    /// Greatest priority of what is not split.
    pub worst: f32,
    /// Whether anything above the tolerance that is not split is partly void.
    pub void: bool,
    /// The last that is split.
    pub last: Order,
}

/// Candidates measured together.
const TOGETHER: usize = 512;

impl Search {
    /// Finds what Algorithm I would split: by falling priority what is above `tolerance`, until the next would make more triangles than `budget`.
    pub(super) fn run(
        &mut self,
        bounds: &NestedBounds,
        lens: &Lens,
        finest: u8,
        tolerance: f32,
        budget: usize,
    ) -> Found {
        let shift = bounds.shift();
        let splittable = |item: &Item| item.unit_level(shift) < finest;
        self.taken.clear();
        self.waiting.clear();
        let root = bounds.item(Diamond::ROOT, SPLIT, 0);
        let mut found = Found { worst: 0.0, void: false, last: (u32::MAX, std::cmp::Reverse(0), 0) };
        let first = lens.priority(&root, bounds.slopes(Diamond::ROOT));
        // What cannot be split, at least not by this search, only counts.
        let mut leave = |item: &Item, number: f32| {
            found.worst = found.worst.max(number);
            found.void |= number > tolerance && item.deviation == f32::INFINITY;
        };
        if !splittable(&root) || first <= tolerance {
            leave(&root, first);
            return found;
        }
        self.waiting.push((root, first));
        let (mut triangles, mut threshold) = (2, f32::INFINITY);
        while !self.waiting.is_empty() && triangles <= budget {
            // Triangles are about as many as the inverse of the bound; rather a few too many than another round.
            let worst = self.waiting.iter().map(|waiting| waiting.1).fold(0.0, f32::max);
            let share = 0.93 * triangles as f32 / budget as f32;
            threshold = (worst.min(threshold) * share.clamp(0.2, 0.97)).max(tolerance);
            self.wave.clear();
            self.waiting.retain(|&(item, number)| {
                if number > threshold {
                    self.taken.push((item.at, number.to_bits()));
                    self.wave.push(item.at);
                    triangles += bounds.cost(item.at);
                }
                number <= threshold
            });
            if self.wave.is_empty() {
                // Numbers too small to fall by a share.
                threshold = tolerance;
            }
            let mut at = 0;
            while at < self.wave.len() {
                self.asked.clear();
                self.slopes.clear();
                let end = (at + TOGETHER).min(self.wave.len());
                for &at in &self.wave[at..end] {
                    bounds.expect_first(at);
                }
                for &at in &self.wave[at..end] {
                    bounds.first_children(at, |child| {
                        self.asked.push(bounds.item(child, SPLIT, 0));
                        self.slopes.push(bounds.slopes(child));
                    });
                }
                at = end;
                self.numbers.resize(self.asked.len(), 0.0);
                measure(lens, &self.asked, &self.slopes, &mut self.numbers);
                for (item, &number) in self.asked.iter().zip(&self.numbers) {
                    if !splittable(item) || number <= tolerance {
                        leave(item, number);
                    } else if number > threshold {
                        self.taken.push((item.at, number.to_bits()));
                        self.wave.push(item.at);
                        triangles += bounds.cost(item.at);
                    } else {
                        self.waiting.push((*item, number));
                    }
                }
            }
        }
        self.waiting.iter().for_each(|(item, number)| leave(item, *number));
        let order = |at: u32, bits: u32| {
            let diamond = Diamond::at(bounds.point(at));
            (bits, std::cmp::Reverse(diamond.level()), diamond.name())
        };
        if triangles > budget {
            // No split costs more than two triangles: so many fit for certain …
            let certain = (budget.max(2) - 2) / 2;
            self.bits.clear();
            self.bits.extend(self.taken.iter().map(|taken| taken.1));
            let limit = match certain {
                0 => u32::MAX,
                _ => *self.bits.select_nth_unstable_by(certain - 1, |a, b| b.cmp(a)).1,
            };
            let mut room = budget.max(2) - 2;
            self.rest.clear();
            self.taken.retain(|&(at, bits)| {
                if bits > limit {
                    room -= bounds.cost(at);
                } else {
                    self.rest.push((order(at, bits), at));
                }
                bits > limit
            });
            // … and of the others, in their order, what there is room for.
            if self.rest.len() > room && room > 0 {
                self.rest.select_nth_unstable_by(room - 1, |a, b| b.cmp(a));
            }
            let few = room.min(self.rest.len());
            self.rest[..few].sort_unstable_by(|a, b| b.cmp(a));
            let mut kept = 0;
            while kept < few && bounds.cost(self.rest[kept].1) <= room {
                room -= bounds.cost(self.rest[kept].1);
                self.taken.push((self.rest[kept].1, self.rest[kept].0.0));
                kept += 1;
            }
            for &((bits, ..), at) in &self.rest[kept..] {
                leave(&bounds.item(Diamond::at(bounds.point(at)), SPLIT, 0), f32::from_bits(bits));
            }
        }
        found.last = match self.taken.iter().map(|taken| taken.1).min() {
            Some(least) => {
                let last = self.taken.iter().filter(|taken| taken.1 == least).map(|&(at, bits)| order(at, bits)).min();
                last.unwrap_or(found.last)
            }
            None => found.last,
        };
        found
    }
}

impl<'a> RoamOnce<'a> {
    /// The method over prepared land within limits.
    pub fn over(bounds: &'a NestedBounds, limits: Limits) -> RoamOnce<'a> {
        RoamOnce {
            bounds,
            limits,
            priority: Priority::default(),
            factors: Factors::default(),
            search: Search::default(),
            vertices: Vec::new(),
        }
    }

    /// Overwrites `mesh` with that of `view`.
    ///
    /// # Errors
    /// If the view is not one that a picture can be drawn of.
    pub fn draw(&mut self, view: &View, mesh: &mut Mesh) -> Result<Reached, ViewError> {
        let bounds = self.bounds;
        let metric = ScreenMetric::new(view, bounds.datum())?;
        let lens = bounds.lens(&metric, self.priority, &self.factors);
        let tolerance = self.priority.tolerance(&metric);
        let finest = self.limits.finest.min(bounds.finest());
        let found = self.search.run(bounds, &lens, finest, tolerance, self.limits.triangles);
        mesh.clear();
        let taken = self.search.taken.iter().map(|&(at, _)| bounds.point(at));
        mesh.vertices.extend(CORNERS.into_iter().chain(taken).map(|at| Vertex {
            x: at[0],
            y: at[1],
            face: 0,
            height: bounds.height(at),
        }));
        let side = (1usize << bounds.finest()) + 1;
        self.vertices.resize(side * side, 0);
        // Steps are half a sample.
        let sample = |at: u32| (at >> 17) as usize * side + ((at & 0xffff) >> 1) as usize;
        for (vertex, &(at, _)) in (4..).zip(&self.search.taken) {
            self.vertices[sample(at)] = vertex;
        }
        let end = 2 << bounds.finest();
        let [a, b, c, d] = [[0, 0], [end, 0], [end, end], [0, end]];
        let walk = Walk { bounds, vertices: &self.vertices, side };
        walk.down([(a, 0), (c, 2), (d, 3)], &mut mesh.triangles);
        walk.down([(c, 2), (a, 0), (b, 1)], &mut mesh.triangles);
        self.search.taken.iter().for_each(|&(at, _)| self.vertices[sample(at)] = 0);
        let lost = found.void && self.priority == Priority::ScreenError;
        let pixels = if lost { f32::INFINITY } else { found.worst };
        Ok(Reached { pixels, limited: found.worst > tolerance })
    }
}

struct Walk<'a> {
    bounds: &'a NestedBounds,
    vertices: &'a [u32],
    side: usize,
}

impl Walk<'_> {
    /// Adds the triangles that one is cut into: the ends of its base and its apex, counter-clockwise, with their vertices.
    fn down(&self, [a, b, c]: [([u32; 2], u32); 3], triangles: &mut Vec<[u32; 3]>) {
        let [x, y] = [a.0[0] + b.0[0], a.0[1] + b.0[1]];
        // Middles of patches are no samples.
        let middle = if (x | y) & 2 == 0 { self.vertices[(y / 4) as usize * self.side + (x / 4) as usize] } else { 0 };
        if middle != 0 {
            let m = ([x / 2, y / 2], middle);
            self.down([c, a, m], triangles);
            self.down([b, c, m], triangles);
        } else if !self.bounds.voids() || self.bounds.whole([x / 2, y / 2], c.0) {
            triangles.push([a.1, b.1, c.1]);
        }
    }
}
