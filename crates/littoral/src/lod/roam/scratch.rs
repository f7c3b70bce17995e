//! ROAM over prepared land from scratch: nothing is kept from view to view, and no queue is needed.
//!
//! Bounds are nested, so the mesh wanted is the set of diamonds above some priority τ, and one is above τ only if both of its parents are. So the set is
//! found breadth first, level by level, each diamond being asked for by its first parent only. All of a level and kind have their bounds in one table and
//! their size in common, so that they are named by their middles alone, and many are looked up and measured together.
//!
//! Where a budget ends the refinement, τ is not known: it falls in steps, each going on from what the one before left, until a few triangles too many are
//! found; those of least priority are given back. The mesh is then one walk down the bintree, along which neighbours follow each other.
//!
//! Works this rests on: M. Duchaineau et al., "ROAMing terrain: real-time optimally adapting meshes", 1997; P. Lindstrom and V. Pascucci,
//! "Terrain simplification simplified", 2002.

use super::bounds::{Kind, NestedBounds, prefetch};
use super::diamond::Diamond;
use super::factors::Factors;
use super::scan::{Item, Lens, Priority, SPLIT, greatest, measure_alike};
use crate::lod::{Limits, Mesh, Reached, ScreenMetric, ViewError};
use crate::space::View;
use std::cmp::Reverse;
use walk::Vertices;

mod walk;

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
    vertices: Vertices,
}

/// The search for the diamonds that are to be split, and its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    /// By the level of cells, and by [`Kind`].
    ranks: Vec<[Rank; 3]>,
    children: Vec<u32>,
    slots: Vec<u32>,
    bits: Vec<u32>,
    rest: Vec<Given>,
}

/// The diamonds of one level and kind.
#[derive(Clone, Debug, Default)]
struct Rank {
    /// What is to be split.
    taken: Diamonds,
    /// What is above the tolerance, but not split.
    waiting: Diamonds,
    /// How many were taken before the threshold of now.
    before: usize,
}

/// Diamonds by their middles (steps), and their priorities.
#[derive(Clone, Debug, Default)]
struct Diamonds {
    at: Vec<u32>,
    numbers: Vec<f32>,
}

/// What may be given back: its place in the order of splitting, its middle, its level of cells and kind.
type Given = (Order, u32, u8, Kind);

/// Order of splitting: priority (bits), how coarse it is, and its name.
pub(super) type Order = (u32, Reverse<u8>, u64);

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

impl Found {
    /// What is not split only counts.
    fn leave(&mut self, tolerance: f32, number: f32, deviation: f32) {
        self.worst = if number > self.worst { number } else { self.worst };
        self.void |= number > tolerance && deviation == f32::INFINITY;
    }
}

/// What diamonds are measured by.
struct Question<'a> {
    bounds: &'a NestedBounds,
    lens: &'a Lens,
    /// The level of cells that are not split any more.
    finest: u8,
    tolerance: f32,
    threshold: f32,
}

/// Diamonds measured together.
const TOGETHER: usize = 128;

/// How many looked up before its turn the bounds of a diamond are loaded.
const AHEAD: usize = 48;

impl Diamonds {
    fn clear(&mut self) {
        self.at.clear();
        self.numbers.clear();
    }

    fn len(&self) -> usize {
        self.at.len()
    }

    fn push(&mut self, at: u32, number: f32) {
        self.at.push(at);
        self.numbers.push(number);
    }

    /// Makes it so long.
    fn resize(&mut self, length: usize) {
        self.at.resize(length, 0);
        self.numbers.resize(length, 0.0);
    }
}

impl Rank {
    /// Takes what waits above a threshold.
    fn rise(&mut self, threshold: f32) {
        self.before = self.taken.len();
        let (taken, waiting) = (&mut self.taken, &mut self.waiting);
        let length = waiting.len();
        taken.resize(self.before + length);
        let (taken_at, taken_numbers) = (&mut taken.at[self.before..], &mut taken.numbers[self.before..]);
        let (waiting_at, waiting_numbers) = (&mut waiting.at[..length], &mut waiting.numbers[..length]);
        let (mut many, mut few) = (0, 0);
        for i in 0..length {
            let (at, number) = (waiting_at[i], waiting_numbers[i]);
            (taken_at[many], taken_numbers[many]) = (at, number);
            (waiting_at[few], waiting_numbers[few]) = (at, number);
            let above = number > threshold;
            many += usize::from(above);
            few += usize::from(!above);
        }
        taken.resize(self.before + many);
        waiting.resize(few);
    }

    /// Takes what is above the threshold, keeps waiting what is above the tolerance, and leaves the others.
    fn sort(&mut self, ask: &Question, at: &[u32], numbers: &[f32]) {
        let (taken, waiting) = (&mut self.taken, &mut self.waiting);
        let (had, waited) = (taken.len(), waiting.len());
        taken.resize(had + at.len());
        waiting.resize(waited + at.len());
        let (taken_at, taken_numbers) = (&mut taken.at[had..], &mut taken.numbers[had..]);
        let (waiting_at, waiting_numbers) = (&mut waiting.at[waited..], &mut waiting.numbers[waited..]);
        let (mut many, mut few) = (0, 0);
        for (&at, &number) in at.iter().zip(numbers) {
            (taken_at[many], taken_numbers[many]) = (at, number);
            (waiting_at[few], waiting_numbers[few]) = (at, number);
            let above = number > ask.threshold;
            many += usize::from(above);
            few += usize::from(!above & (number > ask.tolerance));
        }
        taken.resize(had + many);
        waiting.resize(waited + few);
    }
}

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
        let mut ask = Question { bounds, lens, finest, tolerance, threshold: f32::INFINITY };
        let mut found = Found { worst: 0.0, void: false, last: (u32::MAX, Reverse(0), 0) };
        self.ranks.resize_with(usize::from(bounds.finest()) + 1, Default::default);
        for rank in self.ranks.iter_mut().flatten() {
            rank.taken.clear();
            rank.waiting.clear();
            rank.before = 0;
        }
        let root = bounds.item(Diamond::ROOT, SPLIT, 0);
        let first = lens.priority(&root, Some(bounds.slopes(Diamond::ROOT)));
        if finest == 0 || first <= tolerance {
            found.leave(tolerance, first, root.deviation);
            return found;
        }
        self.ranks[0][Kind::Square as usize].waiting.push(root.at, first);
        let (mut triangles, mut before) = (2, 2);
        let (mut worst, mut previous) = (first, f32::INFINITY);
        while worst > tolerance && triangles <= budget {
            // How many triangles there are is about a power of the threshold, which the last step tells; rather a few too many than another round.
            let share = 0.98 * triangles as f32 / budget as f32;
            let fallen = ask.threshold.min(first) / previous.min(first);
            let power = (before as f32 / triangles as f32).ln() / fallen.ln();
            let power = if power > 0.0 { power.clamp(1.0, 2.0) } else { 1.0 };
            previous = ask.threshold;
            let lower = worst.min(ask.threshold) * share.powf(1.0 / power).clamp(0.2, 0.99);
            // Numbers may be too small to fall by a share.
            ask.threshold = if lower < worst { lower.max(tolerance) } else { tolerance };
            self.ranks.iter_mut().flatten().for_each(|rank| rank.rise(ask.threshold));
            for level in 0..finest {
                self.descend(&ask, level, &mut found);
            }
            before = triangles;
            triangles += self
                .ranks()
                .map(|(rank, ..)| rank.taken.at[rank.before..].iter().map(|&at| bounds.cost(at)).sum::<usize>())
                .sum::<usize>();
            worst = self.ranks().map(|(rank, ..)| greatest(&rank.waiting.numbers, f32::INFINITY)).fold(0.0, f32::max);
        }
        if triangles > budget {
            self.give_back(&ask, budget.max(2) - before, &mut found);
        }
        for (rank, level, kind) in self.ranks() {
            found.worst = found.worst.max(greatest(&rank.waiting.numbers, f32::INFINITY));
            if bounds.voids() {
                let table = bounds.table(level, kind);
                found.void |= rank.waiting.at.iter().any(|&at| table.bound(at).deviation() == f32::INFINITY);
            }
        }
        // The last taken is one of the newest, if there is any.
        let anew = self.ranks().any(|(rank, ..)| rank.taken.len() > rank.before);
        let newest = |rank: &'_ Rank| if anew { rank.before } else { 0 };
        let mut least = f32::INFINITY;
        for (rank, level, kind) in self.ranks() {
            let from = newest(rank);
            for (&at, &number) in rank.taken.at[from..].iter().zip(&rank.taken.numbers[from..]) {
                if number <= least {
                    least = number;
                    found.last = found.last.min(order(bounds, at, number.to_bits(), level, kind));
                }
            }
        }
        found
    }

    /// All ranks, with their level of cells and kind.
    fn ranks(&self) -> impl Iterator<Item = (&Rank, u8, Kind)> {
        self.ranks
            .iter()
            .zip(0u8..)
            .flat_map(|(ranks, level)| ranks.iter().zip(Kind::ALL).map(move |(rank, kind)| (rank, level, kind)))
    }

    /// Measures what those newly taken of a level of cells are the first parents of.
    fn descend(&mut self, ask: &Question, level: u8, found: &mut Found) {
        let end = 2u32 << ask.bounds.finest();
        // Half a cell's side, eastward and northward (steps).
        let half = end >> (level + 1);
        let (east, north) = (half, half << 16);
        let mut children = std::mem::take(&mut self.children);
        let [squares, ..] = &self.ranks[usize::from(level)];
        let new = squares.taken.at[squares.before..].iter().copied();
        if new.len() > 0 {
            children.clear();
            children.extend(new.clone().map(|at| at - north));
            children.extend(new.clone().filter(|at| (at >> 16) + half == end).map(|at| at + north));
            self.judge(ask, level, Kind::East, &children, found);
            let [squares, ..] = &self.ranks[usize::from(level)];
            let new = squares.taken.at[squares.before..].iter().copied();
            children.clear();
            children.extend(new.clone().map(|at| at + east));
            children.extend(new.filter(|at| at & 0xffff == half).map(|at| at - east));
            self.judge(ask, level, Kind::North, &children, found);
        }
        children.clear();
        let (east, north) = (half / 2, (half / 2) << 16);
        for rank in &self.ranks[usize::from(level)][1..] {
            for &at in &rank.taken.at[rank.before..] {
                if at & 0xffff > 0 && at >> 16 > 0 {
                    children.push(at - east - north);
                }
                if at & 0xffff > 0 && at >> 16 < end {
                    children.push(at - east + north);
                }
            }
        }
        self.judge(ask, level + 1, Kind::Square, &children, found);
        self.children = children;
    }

    /// Looks up and measures diamonds of one level and kind.
    fn judge(&mut self, ask: &Question, level: u8, kind: Kind, children: &[u32], found: &mut Found) {
        let bounds = ask.bounds;
        let word = bounds.word(level, kind);
        let table = (level < bounds.finest()).then(|| bounds.table(level, kind));
        self.slots.clear();
        if let Some(table) = &table {
            table.slots(children, &mut self.slots);
            self.slots.iter().take(AHEAD).for_each(|&slot| prefetch(&table.bounds[slot as usize]));
        }
        let rank = &mut self.ranks[usize::from(level)][kind as usize];
        let (mut heights, mut deviations, mut numbers) = ([0; TOGETHER], [0.0; TOGETHER], [0.0; TOGETHER]);
        for (part, at) in children.chunks(TOGETHER).enumerate() {
            let n = at.len();
            for i in 0..n {
                let bound = match &table {
                    Some(table) => {
                        let here = part * TOGETHER + i;
                        if let Some(&slot) = self.slots.get(here + AHEAD) {
                            prefetch(&table.bounds[slot as usize]);
                        }
                        table.bounds[self.slots[here] as usize]
                    }
                    None => bounds.bound(Diamond::at(bounds.point(at[i]))),
                };
                (heights[i], deviations[i]) = (bound.heights(), bound.deviation());
            }
            let numbers = &mut numbers[..n];
            measure_alike(ask.lens, word, at, &heights[..n], &deviations[..n], numbers);
            if let Some(weights) = &ask.lens.weights {
                for i in 0..n {
                    if numbers[i] > 0.0 {
                        let item = Item { at: at[i], heights: heights[i], deviation: deviations[i], word };
                        let slopes = bounds.slopes(Diamond::at(bounds.point(at[i])));
                        numbers[i] *= weights.of(&ask.lens.extent(&item), slopes);
                    }
                }
            }
            if level < ask.finest {
                found.worst = found.worst.max(greatest(numbers, ask.tolerance));
                rank.sort(ask, at, numbers);
            } else {
                let left = numbers.iter().zip(&deviations);
                left.for_each(|(&number, &deviation)| found.leave(ask.tolerance, number, deviation));
            }
        }
    }

    /// Gives back what of the newly taken there is no room for: in the order of splitting, the last.
    fn give_back(&mut self, ask: &Question, mut room: usize, found: &mut Found) {
        let bounds = ask.bounds;
        self.bits.clear();
        for rank in self.ranks.iter().flatten() {
            self.bits.extend(rank.taken.numbers[rank.before..].iter().map(|number| number.to_bits()));
        }
        // No split costs more than two triangles: so many fit for certain …
        let limit = match room / 2 {
            0 => u32::MAX,
            certain => *self.bits.select_nth_unstable_by(certain - 1, |a, b| b.cmp(a)).1,
        };
        self.rest.clear();
        for (ranks, level) in self.ranks.iter_mut().zip(0..) {
            for (rank, kind) in ranks.iter_mut().zip(Kind::ALL) {
                let (taken, mut kept) = (&mut rank.taken, rank.before);
                for i in rank.before..taken.len() {
                    let (at, number) = (taken.at[i], taken.numbers[i]);
                    if number.to_bits() > limit {
                        room -= bounds.cost(at);
                        (taken.at[kept], taken.numbers[kept]) = (at, number);
                        kept += 1;
                    } else {
                        self.rest.push((order(bounds, at, number.to_bits(), level, kind), at, level, kind));
                    }
                }
                taken.resize(kept);
            }
        }
        // … and of the others, in their order, what there is room for.
        let rest = &mut self.rest;
        if rest.len() > room && room > 0 {
            rest.select_nth_unstable_by(room - 1, |a, b| b.0.cmp(&a.0));
        }
        let few = room.min(rest.len());
        rest[..few].sort_unstable_by_key(|given| Reverse(given.0));
        let mut kept = 0;
        while kept < few && bounds.cost(rest[kept].1) <= room {
            let (order, at, level, kind) = rest[kept];
            room -= bounds.cost(at);
            self.ranks[usize::from(level)][kind as usize].taken.push(at, f32::from_bits(order.0));
            kept += 1;
        }
        for &((bits, ..), at, level, kind) in &rest[kept..] {
            let deviation = if bounds.voids() { bounds.table(level, kind).bound(at).deviation() } else { 0.0 };
            found.leave(ask.tolerance, f32::from_bits(bits), deviation);
        }
    }

    /// How many diamonds are to be split.
    fn len(&self) -> usize {
        self.ranks().map(|(rank, ..)| rank.taken.len()).sum()
    }
}

fn order(bounds: &NestedBounds, at: u32, bits: u32, level: u8, kind: Kind) -> Order {
    let [x, y] = bounds.point(at).map(u64::from);
    (bits, Reverse(2 * level + u8::from(kind != Kind::Square)), x << 32 | y)
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
            vertices: Vertices::default(),
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
        self.vertices.draw(bounds, &self.search, mesh);
        let lost = found.void && self.priority == Priority::ScreenError;
        let pixels = if lost { f32::INFINITY } else { found.worst };
        Ok(Reached { pixels, limited: found.worst > tolerance })
    }
}
