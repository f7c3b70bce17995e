//! What a flight goes over: where its bounds come from.
//!
//! Two kinds of surface have nested bounds: land, prepared, and a sea, whose bounds are the same everywhere. Which one it is is known when the flight is
//! compiled, so that neither pays for the other.

use super::bounds::{Bound, NestedBounds};
use super::diamond::{Diamond, Point};
use super::factors::{Factors, Slopes};
use super::scan::{Item, Lens, Priority, measure};
use super::scratch::{Order, Search};
use crate::lod::ScreenMetric;
use crate::space::Datum;

/// A surface with nested bounds.
pub(super) trait Ground {
    fn datum(&self) -> Datum;

    /// The finest level of cells that are drawn.
    fn finest(&self) -> u8;

    /// Whether any of it is void.
    fn voids(&self) -> bool;

    /// Height (m) of a vertex; NaN where void, or not known yet.
    fn height(&self, at: Point) -> f32;

    /// What a diamond's record holds of its bound.
    fn bound(&self, diamond: Diamond) -> Bound;

    /// The slopes of all that needs a diamond, if they are kept.
    fn slopes(&self, diamond: Diamond) -> Option<Slopes>;

    /// What the priority of a diamond is computed from.
    fn item(&self, bound: Bound, diamond: Diamond, kind: u8, record: u32) -> Item;

    /// The lattice point in the middle of an entry's base.
    fn middle(&self, item: &Item) -> Point;

    fn lens(&self, metric: &ScreenMetric, priority: Priority, factors: &Factors) -> Lens;

    fn priority(&self, lens: &Lens, item: &Item, slopes: Option<Slopes>) -> f32;

    /// Priorities of four at once, if that is quicker and nothing but the items is needed.
    #[inline]
    fn priorities(&self, _: &Lens, _: &[Item; 4]) -> Option<[f32; 4]> {
        None
    }

    /// Priorities of many, with as many slopes or none: numbers keep their signs, and what is none stays so.
    fn measure(&self, lens: &Lens, items: &[Item], slopes: &[Slopes], out: &mut [f32]);

    /// The last diamond that is split of those that make a mesh from nothing, if they can be searched for without a record of any.
    fn search(&self, search: &mut Search, lens: &Lens, finest: u8, tolerance: f32, budget: usize) -> Option<Order>;

    /// Begins to load the height of a vertex.
    fn expect_height(&self, at: Point);

    /// Begins to load what a diamond's record holds of its bound.
    fn expect_bound(&self, diamond: Diamond);

    /// A vertex is no longer used.
    fn forget(&mut self, vertex: u32);
}

impl Ground for &NestedBounds {
    fn datum(&self) -> Datum {
        NestedBounds::datum(self)
    }

    #[inline]
    fn finest(&self) -> u8 {
        NestedBounds::finest(self)
    }

    fn voids(&self) -> bool {
        NestedBounds::voids(self)
    }

    #[inline]
    fn height(&self, at: Point) -> f32 {
        NestedBounds::height(self, at)
    }

    #[inline]
    fn bound(&self, diamond: Diamond) -> Bound {
        NestedBounds::bound(self, diamond)
    }

    #[inline]
    fn slopes(&self, diamond: Diamond) -> Option<Slopes> {
        self.keeps_slopes().then(|| NestedBounds::slopes(self, diamond))
    }

    #[inline]
    fn item(&self, bound: Bound, diamond: Diamond, kind: u8, record: u32) -> Item {
        self.item_of(bound, diamond, kind, record)
    }

    #[inline]
    fn middle(&self, item: &Item) -> Point {
        self.point(item.at)
    }

    fn lens(&self, metric: &ScreenMetric, priority: Priority, factors: &Factors) -> Lens {
        NestedBounds::lens(self, metric, priority, factors)
    }

    #[inline]
    fn priority(&self, lens: &Lens, item: &Item, slopes: Option<Slopes>) -> f32 {
        lens.priority(item, slopes)
    }

    #[inline]
    fn priorities(&self, lens: &Lens, items: &[Item; 4]) -> Option<[f32; 4]> {
        lens.priorities(items)
    }

    fn measure(&self, lens: &Lens, items: &[Item], slopes: &[Slopes], out: &mut [f32]) {
        measure(lens, items, slopes, out);
    }

    fn search(&self, search: &mut Search, lens: &Lens, finest: u8, tolerance: f32, budget: usize) -> Option<Order> {
        Some(search.run(self, lens, finest, tolerance, budget).last)
    }

    #[inline]
    fn expect_height(&self, at: Point) {
        NestedBounds::expect_height(self, at);
    }

    #[inline]
    fn expect_bound(&self, diamond: Diamond) {
        NestedBounds::expect_bound(self, diamond);
    }

    #[inline]
    fn forget(&mut self, _: u32) {}
}
