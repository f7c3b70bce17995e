//! The mesh of a set of split diamonds: their vertices, and a walk down the bintree for the triangles.

use super::{Diamonds, Search};
use crate::lod::roam::CORNERS;
use crate::lod::roam::bounds::{Kind, NestedBounds, prefetch};
use crate::lod::{Mesh, Vertex};
use crate::memory::in_large_pages;

/// Which vertex lies in the middle of each diamond: a table a level and kind, as bounds have, so that what is split lies together.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices {
    levels: Vec<Level>,
    /// Numbers up to this one are of meshes before.
    past: u32,
}

/// The vertices of cells and of their sides, counted on from mesh to mesh, so that nothing needs to be cleared.
#[derive(Clone, Debug)]
struct Level {
    squares: Vec<u32>,
    /// Sides that run east lie in even rows, others in odd ones.
    sides: Vec<u32>,
    /// Binary logarithm of half a cell's side (steps).
    unit: u32,
    /// Tiles a row.
    columns: [u32; 2],
}

impl Level {
    fn new(unit: u32, level: u8) -> Level {
        let n = 1usize << level;
        // Tiles are 4 × 4: a line of memory.
        let columns = [n.div_ceil(4), (n + 1).div_ceil(4)];
        let table = |columns: usize, rows: usize| in_large_pages(vec![0; 16 * columns * rows.div_ceil(4)]);
        Level {
            squares: table(columns[0], n),
            sides: table(columns[1], 2 * n + 1),
            unit,
            columns: columns.map(|columns| columns as u32),
        }
    }

    #[inline]
    fn slot(x: u32, y: u32, columns: u32) -> usize {
        (((y >> 2) * columns + (x >> 2)) << 4 | (y & 3) << 2 | x & 3) as usize
    }

    /// Where the vertex in a cell's middle (steps) is kept.
    #[inline]
    fn square(&self, x: u32, y: u32) -> usize {
        Level::slot(x >> (self.unit + 1), y >> (self.unit + 1), self.columns[0])
    }

    /// The same of a side's.
    #[inline]
    fn side(&self, x: u32, y: u32) -> usize {
        Level::slot(x >> (self.unit + 1), y >> self.unit, self.columns[1])
    }
}

/// How many vertices before its turn a height is loaded.
const AHEAD: usize = 24;

impl Vertices {
    /// Overwrites `mesh` with that of what was found.
    pub(super) fn draw(&mut self, bounds: &NestedBounds, found: &Search, mesh: &mut Mesh) {
        mesh.clear();
        if self.levels.is_empty() {
            let levels = (0..bounds.finest()).map(|level| Level::new(u32::from(bounds.finest() - level), level));
            self.levels = levels.collect();
        }
        let count = (CORNERS.len() + found.len()) as u32;
        if self.past.checked_add(count).is_none() {
            self.past = 0;
            self.levels.iter_mut().for_each(|level| {
                level.squares.fill(0);
                level.sides.fill(0);
            });
        }
        mesh.vertices.reserve(count as usize);
        mesh.vertices.extend(CORNERS.map(|at| Vertex { x: at[0], y: at[1], face: 0, height: bounds.height(at) }));
        for (rank, level, kind) in found.ranks() {
            if rank.taken.len() > 0 {
                self.place(bounds, level, kind, &rank.taken, mesh);
            }
        }
        mesh.triangles.reserve(2 * count as usize);
        let end = 2u64 << bounds.finest();
        let corner = |x: u64, y: u64, vertex| Corner { at: x | y << 32, vertex };
        let [a, b, c, d] = [corner(0, 0, 0), corner(end, 0, 1), corner(end, end, 2), corner(0, end, 3)];
        let mut walk = Walk { levels: &self.levels, past: self.past, count, bounds, triangles: &mut mesh.triangles };
        let root = walk.middle_of_square(0, a, c);
        walk.square(0, [a, c, d], root);
        walk.square(0, [c, a, b], root);
        self.past += count;
    }

    /// Adds the vertices of one level and kind.
    fn place(&mut self, bounds: &NestedBounds, level: u8, kind: Kind, taken: &Diamonds, mesh: &mut Mesh) {
        let level = &mut self.levels[usize::from(level)];
        let (table, unit, columns) = match kind {
            Kind::Square => (&mut level.squares, level.unit + 1, level.columns[0]),
            _ => (&mut level.sides, level.unit, level.columns[1]),
        };
        for (&at, vertex) in taken.at.iter().zip(self.past + mesh.vertices.len() as u32..) {
            table[Level::slot((at & 0xffff) >> (level.unit + 1), (at >> 16) >> unit, columns)] = vertex;
        }
        let soon = taken.at.iter().skip(AHEAD).chain(std::iter::repeat(&0));
        mesh.vertices.extend(taken.at.iter().zip(soon).map(|(&at, &soon)| {
            bounds.expect_height(bounds.point(soon));
            let at = bounds.point(at);
            Vertex { x: at[0], y: at[1], face: 0, height: bounds.height(at) }
        }));
    }
}

/// A corner of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    /// Where it is (steps), x in the lower half.
    at: u64,
    vertex: u32,
}

struct Walk<'a> {
    levels: &'a [Level],
    past: u32,
    count: u32,
    bounds: &'a NestedBounds,
    triangles: &'a mut Vec<[u32; 3]>,
}

impl Walk<'_> {
    /// The middle of a cell's diagonal, and its vertex if it is split.
    #[inline(always)]
    fn middle_of_square(&self, level: usize, a: Corner, b: Corner) -> Corner {
        let at = (a.at + b.at) / 2;
        let kept = self.levels.get(level).map_or(0, |own| own.squares[own.square(at as u32, (at >> 32) as u32)]);
        self.middle(at, kept)
    }

    /// The same of a side.
    #[inline(always)]
    fn middle_of_side(&self, level: usize, a: Corner, b: Corner) -> Corner {
        let at = (a.at + b.at) / 2;
        let own = &self.levels[level];
        self.middle(at, own.sides[own.side(at as u32, (at >> 32) as u32)])
    }

    /// A vertex of this mesh; 0 if what is kept is of one before.
    #[inline(always)]
    fn middle(&self, at: u64, kept: u32) -> Corner {
        let vertex = kept.wrapping_sub(self.past);
        Corner { at, vertex: if vertex < self.count { vertex } else { 0 } }
    }

    /// Adds the triangles that one over a cell's diagonal is cut into: the ends of its base and its apex, counter-clockwise; its base's middle is known.
    /// What both parts will ask for is asked before either is walked down: while one is, the other's comes from memory.
    fn square(&mut self, level: usize, [a, b, c]: [Corner; 3], m: Corner) {
        if m.vertex == 0 {
            return self.add(m.at, a, b, c);
        }
        let (first, second) = (self.middle_of_side(level, c, a), self.middle_of_side(level, b, c));
        if let Some(next) = self.levels.get(level + 1) {
            let at = (m.at + c.at) / 2;
            prefetch(&next.squares[next.square(at as u32, (at >> 32) as u32)]);
        }
        self.side(level, [c, a, m], first);
        self.side(level, [b, c, m], second);
    }

    /// The same of one over a side.
    #[inline(always)]
    fn side(&mut self, level: usize, [a, b, c]: [Corner; 3], m: Corner) {
        if m.vertex == 0 {
            return self.add(m.at, a, b, c);
        }
        let (first, second) = (self.middle_of_square(level + 1, c, a), self.middle_of_square(level + 1, b, c));
        self.square(level + 1, [c, a, m], first);
        self.square(level + 1, [b, c, m], second);
    }

    #[inline(always)]
    fn add(&mut self, at: u64, a: Corner, b: Corner, c: Corner) {
        let point = |at: u64| [at as u32, (at >> 32) as u32];
        if !self.bounds.voids() || self.bounds.whole(point(at), point(c.at)) {
            self.triangles.push([a.vertex, b.vertex, c.vertex]);
        }
    }
}
