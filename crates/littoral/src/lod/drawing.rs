//! What methods put out: patches of one stencil, or a mesh of their own.

use crate::field::HeightField;
pub use crate::field::Vertex;
use crate::space::{Cell, Datum, Place};
use glam::{DVec2, Vec3};

/// Steps of the lattice along a face's side.
pub(super) const STEPS: u32 = 1 << Cell::MAX_LEVEL;

/// The place of a lattice point.
pub(super) fn place(face: u8, at: [u32; 2]) -> Place {
    Place { face, uv: DVec2::new(f64::from(at[0]), f64::from(at[1])) / f64::from(STEPS) }
}

/// Triangles over shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The vertices; some may be unused.
    pub vertices: Vec<Vertex>,
    /// Three vertices each, counter-clockwise seen from above. Those without area in plan stand upright and close seams.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Removes everything, keeping the memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.triangles.clear();
    }

    /// Unit normals at the vertices: the mean, weighted by area, of those of the triangles that meet there (Liu, Xu and Chen 2009 take the plain
    /// mean). Vertices without triangles point upward.
    pub fn normals(&self, datum: &Datum, normals: &mut Vec<Vec3>) {
        normals.clear();
        normals.resize(self.vertices.len(), Vec3::ZERO);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.vertices[i as usize].world(datum));
            let normal = (b - a).cross(c - a).as_vec3();
            triangle.iter().for_each(|&i| normals[i as usize] += normal);
        }
        for (normal, vertex) in normals.iter_mut().zip(&self.vertices) {
            *normal = normal.try_normalize().unwrap_or_else(|| datum.world(vertex.place(), 0.0).1.as_vec3());
        }
    }
}

/// What every patch of a drawing is an image of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stencil {
    /// The unit square in this many cells a side: one, or a multiple of four. Diagonals run from the middle of each block of 2 × 2 cells
    /// to its corners, so that leaving out the middle of a block's side leaves two whole triangles.
    Square(u32),
    /// The triangle (0, 0), (1, 0), (0, 1).
    #[default]
    Triangle,
}

/// One side of a square patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edge {
    /// How far its odd vertices have moved towards the line between their neighbours, 0 to 1: the same on both sides of the edge.
    pub morph: f32,
    /// Whether the patch beyond is twice as coarse: odd vertices are then left out.
    pub coarser: bool,
}

/// An affine image of the stencil.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Patch {
    /// Which face.
    pub face: u8,
    /// Lattice point that the stencil's (0, 0) lies on.
    pub corner: [u32; 2],
    /// From there to its (1, 0).
    pub across: [i32; 2],
    /// From there to its (0, 1).
    pub up: [i32; 2],
    /// How far the vertices that a patch twice as coarse would lack have moved to where it would draw them, 0 to 1.
    pub morph: f32,
    /// Southern, eastern, northern and western side.
    pub edges: [Edge; 4],
}

impl Patch {
    /// The square patch over a cell.
    pub fn of(cell: Cell) -> Patch {
        let side = STEPS >> cell.level;
        let corner = [cell.x * side, cell.y * side];
        Patch {
            face: cell.face,
            corner,
            across: [side as i32, 0],
            up: [0, side as i32],
            morph: 0.0,
            edges: [Edge::default(); 4],
        }
    }

    /// Lattice point of the stencil's (i / n, j / n).
    fn point(&self, i: u32, j: u32, n: u32) -> [u32; 2] {
        let along = |axis: usize| {
            let reach = i64::from(self.across[axis]) * i64::from(i) + i64::from(self.up[axis]) * i64::from(j);
            (i64::from(self.corner[axis]) + reach / i64::from(n)) as u32
        };
        [along(0), along(1)]
    }
}

/// What is to be drawn in one view.
#[derive(Clone, Debug, Default)]
pub struct Drawing {
    /// What the patches are images of.
    pub stencil: Stencil,
    /// The patches.
    pub patches: Vec<Patch>,
    /// Triangles beside the patches.
    pub mesh: Mesh,
    /// Strips of triangles: each ends before the vertex named, and begins where the one before it ends, the first with the mesh's first vertex. In a
    /// strip, every three vertices in a row are a triangle, the first counter-clockwise seen from above, the second clockwise, and so on; those of which two vertices are
    /// the same are none.
    pub strips: Vec<u32>,
    places: Vec<Place>,
    heights: Vec<f32>,
}

/// Patches whose heights are asked for together.
const TOGETHER: usize = 256;

impl Drawing {
    /// Removes everything, keeping the memory.
    pub fn clear(&mut self) {
        self.patches.clear();
        self.strips.clear();
        self.mesh.clear();
    }

    /// How many triangles are drawn at most; voids leave some out.
    pub fn triangles(&self) -> usize {
        let each = match self.stencil {
            Stencil::Square(n) => 2 * (n * n) as usize,
            Stencil::Triangle => 1,
        };
        let strips = self.strips.last().map_or(0, |&end| end as usize - 2 * self.strips.len());
        self.patches.len() * each + strips + self.mesh.triangles.len()
    }

    /// Turns the strips into triangles of the mesh, and removes them.
    pub fn expand_strips(&mut self) {
        let mut begin = 0;
        for end in self.strips.drain(..) {
            let vertices = &self.mesh.vertices;
            let corners = (begin..end.saturating_sub(2))
                .map(|i| if (i - begin) & 1 == 0 { [i, i + 1, i + 2] } else { [i + 1, i, i + 2] });
            self.mesh.triangles.extend(corners.filter(|triangle| {
                let [a, b, c] = triangle.map(|i| [vertices[i as usize].x, vertices[i as usize].y]);
                a != b && b != c && c != a
            }));
            begin = end;
        }
    }

    /// Turns the patches into triangles of the mesh, with heights of `field`, and removes them; so it does with strips. Triangles that would reach into a
    /// void are left out.
    pub fn expand(&mut self, field: &dyn HeightField) {
        self.expand_strips();
        let n = match self.stencil {
            Stencil::Square(n) => n,
            Stencil::Triangle => 1,
        };
        for patches in self.patches.chunks(TOGETHER) {
            self.places.clear();
            for patch in patches {
                match self.stencil {
                    Stencil::Square(n) => self.places.extend(
                        (0..(n + 1) * (n + 1)).map(|v| place(patch.face, patch.point(v % (n + 1), v / (n + 1), n))),
                    ),
                    Stencil::Triangle => self
                        .places
                        .extend([(0, 0), (1, 0), (0, 1)].map(|(i, j)| place(patch.face, patch.point(i, j, 1)))),
                }
            }
            self.heights.clear();
            self.heights.resize(self.places.len(), 0.0);
            field.heights(&self.places, &mut self.heights);
            let each = self.places.len() / patches.len();
            for (patch, heights) in patches.iter().zip(self.heights.chunks(each)) {
                match self.stencil {
                    Stencil::Square(_) => square(patch, n, heights, &mut self.mesh),
                    Stencil::Triangle => triangle(patch, heights, &mut self.mesh),
                }
            }
        }
        self.patches.clear();
    }
}

/// Appends a triangle.
fn triangle(patch: &Patch, heights: &[f32], mesh: &mut Mesh) {
    if heights.iter().any(|h| h.is_nan()) {
        return;
    }
    let base = mesh.vertices.len() as u32;
    for (&height, (i, j)) in heights.iter().zip([(0, 0), (1, 0), (0, 1)]) {
        let [x, y] = patch.point(i, j, 1);
        mesh.vertices.push(Vertex { x, y, face: patch.face.into(), height });
    }
    mesh.triangles.push([base, base + 1, base + 2]);
}

/// The two triangles of a cell, corners south-west, south-east, north-west, north-east: diagonals run from the middle of each block of 2 × 2 cells to its
/// corners.
pub(super) fn halves(column: u32, row: u32, [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    if (column + row) & 1 == 0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] }
}

/// Appends the triangles of a square patch of n × n cells.
fn square(patch: &Patch, n: u32, heights: &[f32], mesh: &mut Mesh) {
    let base = mesh.vertices.len() as u32;
    let side = n + 1;
    let height = |i: u32, j: u32| heights[(j * side + i) as usize];
    for j in 0..side {
        for i in 0..side {
            let [x, y] = patch.point(i, j, n);
            let own = height(i, j);
            let morph = match (i, j) {
                (_, 0) => patch.edges[0].morph,
                (_, j) if j == n => patch.edges[2].morph,
                (0, _) => patch.edges[3].morph,
                (i, _) if i == n => patch.edges[1].morph,
                _ => patch.morph,
            };
            let drawn = if morph > 0.0 {
                let [one, other] = coarse_ends(i, j);
                let coarse = 0.5 * (height(one.0, one.1) + height(other.0, other.1));
                // Next to a void there may be nothing to move to.
                if coarse.is_nan() { own } else { own + (coarse - own) * morph }
            } else {
                own
            };
            mesh.vertices.push(Vertex { x, y, face: patch.face.into(), height: drawn });
        }
    }
    // A cell exists only whole.
    let whole =
        |i: u32, j: u32| [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].iter().all(|&(i, j)| !height(i, j).is_nan());
    // Odd vertices of a side whose neighbour lacks them are replaced by the even ones before them, so that of three triangles at the side two
    // remain. Where one of the two cells there is missing, the vertex stays, and a triangle that stands upright closes the gap.
    let [south, east, north, west] = patch.edges.map(|edge| edge.coarser);
    let missing = |i: u32, j: u32| {
        if i & 1 == 1 && ((south && j == 0) || (north && j == n)) {
            let row = if j == 0 { 0 } else { n - 1 };
            Some([(i - 1, row), (i, row)])
        } else if j & 1 == 1 && ((west && i == 0) || (east && i == n)) {
            let column = if i == 0 { 0 } else { n - 1 };
            Some([(column, j - 1), (column, j)])
        } else {
            None
        }
    };
    let kept = |i: u32, j: u32| match missing(i, j) {
        Some(cells) if cells.iter().all(|&(i, j)| whole(i, j)) => {
            let [before, _] = coarse_ends(i, j);
            before.1 * side + before.0
        }
        _ => j * side + i,
    };
    let mut push = |corners: [u32; 3]| {
        let [a, b, c] = corners;
        if a != b && b != c && c != a {
            mesh.triangles.push(corners.map(|v| base + v));
        }
    };
    for j in 0..n {
        for i in 0..n {
            if !whole(i, j) {
                continue;
            }
            let [a, b, c, d] = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| kept(i, j));
            halves(i, j, [a, b, c, d]).into_iter().for_each(&mut push);
        }
    }
    if south || east || north || west {
        for k in (1..n).step_by(2) {
            // Each side, run along with the patch on the left.
            for (i, j, turned) in [(k, 0, false), (n, k, false), (k, n, true), (0, k, true)] {
                let Some(cells) = missing(i, j) else { continue };
                let [one, other] = coarse_ends(i, j);
                let ends = [one, other].map(|(i, j)| (!height(i, j).is_nan()).then_some(j * side + i));
                if let ([Some(one), Some(other)], 1) = (ends, cells.iter().filter(|&&(i, j)| whole(i, j)).count()) {
                    let (from, to) = if turned { (other, one) } else { (one, other) };
                    push([from, to, j * side + i]);
                }
            }
        }
    }
}

/// The ends of the line on which a stencil twice as coarse draws the vertex (i, j): itself if both are even.
pub(super) fn coarse_ends(i: u32, j: u32) -> [(u32, u32); 2] {
    match (i & 1, j & 1) {
        (0, 0) => [(i, j), (i, j)],
        (1, 0) => [(i - 1, j), (i + 1, j)],
        (0, _) => [(i, j - 1), (i, j + 1)],
        // The coarse cell's diagonal runs between those of its corners that are even and odd in both directions.
        _ if ((i >> 1) + (j >> 1)) & 1 == 0 => [(i - 1, j - 1), (i + 1, j + 1)],
        _ => [(i + 1, j - 1), (i - 1, j + 1)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Land, Raster};

    fn land() -> Land {
        let heights = (0..17 * 17).map(|i| ((i * 7919) % 101) as f32).collect();
        Land::new(Raster::new(17, 17, DVec2::ONE, heights).expect("valid"))
    }

    #[test]
    fn a_patch_fully_morphed_is_its_parent() {
        let land = land();
        let cell = Cell { face: 0, level: 1, x: 1, y: 0 };
        let draw = |stencil, patches: Vec<Patch>| {
            let mut drawing = Drawing { stencil, patches, ..Drawing::default() };
            drawing.expand(&land);
            drawing.mesh
        };
        let fine = Patch { morph: 1.0, edges: [Edge { morph: 1.0, coarser: false }; 4], ..Patch::of(cell) };
        let (fine, coarse) =
            (draw(Stencil::Square(8), vec![fine]), draw(Stencil::Square(8), vec![Patch::of(Cell::face(0))]));
        // Each vertex of the fine patch lies on the coarse mesh.
        for v in &fine.vertices {
            let mut found = false;
            for t in &coarse.triangles {
                let [a, b, c] = t.map(|i| coarse.vertices[i as usize]);
                let at = |p: &Vertex| DVec2::new(f64::from(p.x), f64::from(p.y));
                let area = (at(&b) - at(&a)).perp_dot(at(&c) - at(&a));
                let (wb, wc) = (
                    (at(v) - at(&a)).perp_dot(at(&c) - at(&a)) / area,
                    (at(&b) - at(&a)).perp_dot(at(v) - at(&a)) / area,
                );
                if wb >= 0.0 && wc >= 0.0 && wb + wc <= 1.0 {
                    let plane =
                        f64::from(a.height) * (1.0 - wb - wc) + f64::from(b.height) * wb + f64::from(c.height) * wc;
                    assert!((plane - f64::from(v.height)).abs() < 1e-4, "{v:?} off {plane}");
                    found = true;
                }
            }
            assert!(found, "{v:?} lies nowhere");
        }
    }
}
