//! Extraction: squares that are split, row by row, one size after another.
//!
//! Rows keep their order from size to size, so that a vertex that two squares share is handed on by the earlier one to the
//! later one through a line of vertices: nothing is searched for.

use super::cut::Cut;
use super::{Corners, Part, Rtin, halves, quarter};
use crate::field::Raster;
use crate::mesh::measure::{doubled_area, lies_on_surface};
use crate::mesh::{MeshError, Triangulation};

/// A square whose centre is a vertex.
#[derive(Clone, Copy, Debug)]
struct Square {
    x: u32,
    y: u32,
    /// Vertices at the corners: south-west, south-east, north-west, north-east.
    corners: [u32; 4],
}

/// No vertex: outside the raster.
const NONE: u32 = u32::MAX;

/// A mesh that grows, one size of squares after another.
pub(super) struct Growth<'a> {
    rtin: &'a Rtin,
    raster: &'a Raster,
    max_error: f32,
    mesh: &'a mut Triangulation,
    last: [u32; 2],
    scratch: &'a mut Scratch,
}

/// Memory that extractions use again and again.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    squares: Vec<Square>,
    finer: Vec<Square>,
    /// Of the finer squares those in the upper half of a row.
    upper: Vec<Square>,
    /// Vertices on the sides between two rows of squares.
    line: Vec<u32>,
    /// Vertices on the eastern and northern border, where triangles are cut.
    east: Vec<u32>,
    north: Vec<u32>,
    /// New names of vertices.
    pub(super) names: Vec<u32>,
}

/// All of a line of vertices without any.
fn clear(line: &mut Vec<u32>, length: usize) {
    line.clear();
    line.resize(length, NONE);
}

impl Growth<'_> {
    pub fn new<'a>(
        rtin: &'a Rtin,
        raster: &'a Raster,
        max_error: f32,
        scratch: &'a mut Scratch,
        mesh: &'a mut Triangulation,
    ) -> Growth<'a> {
        mesh.vertices.clear();
        mesh.triangles.clear();
        let last = rtin.size.map(|samples| samples as u32 - 1);
        clear(&mut scratch.east, rtin.size[1]);
        clear(&mut scratch.north, rtin.size[0]);
        Growth { rtin, raster, max_error, mesh, last, scratch }
    }

    fn active(&self, index: usize) -> bool {
        self.rtin.deviations[index] > self.max_error
    }

    /// The vertex at a sample where none was named before, unless it is on the border.
    fn vertex(&mut self, at: [u32; 2]) -> u32 {
        let new = self.mesh.vertices.len() as u32;
        let border = if at[0] > self.last[0] || at[1] > self.last[1] {
            return NONE;
        } else if at[0] == self.last[0] {
            &mut self.scratch.east[at[1] as usize]
        } else if at[1] == self.last[1] {
            &mut self.scratch.north[at[0] as usize]
        } else {
            self.mesh.vertices.push(at);
            return new;
        };
        if *border == NONE {
            *border = new;
            self.mesh.vertices.push(at);
        }
        *border
    }

    /// A triangle of the virtual square, cut at the border, if it is not void.
    fn emit(&mut self, corners: Corners, vertices: [u32; 3]) {
        if !vertices.contains(&NONE) {
            if !self.raster.voids().any() || lies_on_surface(self.raster, corners) {
                self.mesh.triangles.push(vertices);
            }
            return;
        }
        let cut = Cut::new(corners, self.last);
        let mut fan = [0; 6];
        if cut.count < 3 || cut.triangles().all(|part| doubled_area(part) == 0) {
            return;
        }
        if self.raster.voids().any()
            && !cut.triangles().any(|part| doubled_area(part) > 0 && lies_on_surface(self.raster, part))
        {
            return;
        }
        for (k, at) in cut.corners[..cut.count].iter().enumerate() {
            let old = corners.iter().position(|corner| corner == at);
            fan[k] = match old {
                Some(old) => vertices[old],
                None => self.vertex(*at),
            };
        }
        for (k, part) in cut.triangles().enumerate() {
            if doubled_area(part) > 0 {
                self.mesh.triangles.push([fan[0], fan[k + 1], fan[k + 2]]);
            }
        }
    }

    pub fn grow(&mut self) -> Result<(), MeshError> {
        let top = self.rtin.levels.len() - 1;
        let side = 2u32 << top;
        let places = [[0, 0], [side, 0], [0, side], [side, side]];
        let corners = places.map(|at| self.vertex(at));
        if !self.active(self.rtin.levels[top].centre(0, 0)) {
            let [a, b] = halves(0, 0, side, true);
            self.emit(a, [corners[0], corners[1], corners[3]]);
            self.emit(b, [corners[0], corners[3], corners[2]]);
            return Ok(());
        }
        let take = std::mem::take::<Vec<Square>>;
        let mut squares = take(&mut self.scratch.squares);
        let (mut finer, mut upper) = (take(&mut self.scratch.finer), take(&mut self.scratch.upper));
        let mut line = std::mem::take(&mut self.scratch.line);
        squares.clear();
        squares.push(Square { x: 0, y: 0, corners });
        let solid = !self.raster.voids().any();
        for k in (0..=top).rev() {
            if self.mesh.vertices.len() + 8 * squares.len() > NONE as usize {
                return Err(MeshError::TooMany);
            }
            finer.clear();
            clear(&mut line, self.rtin.levels[k].columns);
            for row in squares.chunk_by(|a, b| a.y == b.y) {
                let mut east = NONE;
                for square in row {
                    if solid && (square.x + 1) << (k + 1) < self.last[0] && (square.y + 1) << (k + 1) < self.last[1] {
                        self.split_inner(k, square, &mut line, &mut east, &mut finer, &mut upper);
                    } else {
                        self.split(k, square, &mut line, &mut east, &mut finer, &mut upper);
                    }
                }
                finer.append(&mut upper);
            }
            std::mem::swap(&mut squares, &mut finer);
        }
        // Each where it was, so that the next time it is large enough.
        if top.is_multiple_of(2) {
            std::mem::swap(&mut squares, &mut finer);
        }
        (self.scratch.squares, self.scratch.finer, self.scratch.upper) = (squares, finer, upper);
        self.scratch.line = line;
        Ok(())
    }

    /// The same as [`Growth::split`] for most squares: those that nothing is cut from and that touch no border where triangles
    /// are cut.
    #[inline(always)]
    fn split_inner(
        &mut self,
        k: usize,
        square: &Square,
        line: &mut [u32],
        middle_east: &mut u32,
        finer: &mut Vec<Square>,
        upper: &mut Vec<Square>,
    ) {
        let (level, side) = (&self.rtin.levels[k], 2u32 << k);
        let (x, y) = (square.x as usize, square.y as usize);
        let (west, south, half) = (square.x * side, square.y * side, side / 2);
        let [sw, se, nw, ne] = square.corners;
        let deviations = &*self.rtin.deviations;
        let [flat, upright] = [level.flat(x, y), level.upright(x, y)];
        let split_south = deviations[flat] > self.max_error;
        let split_north = deviations[flat + level.columns] > self.max_error;
        let split_west = deviations[upright] > self.max_error;
        let split_east = deviations[upright + 1] > self.max_error;
        let vertices = &mut self.mesh.vertices;
        vertices.reserve(5);
        let mut vertex = |x: u32, y: u32| {
            vertices.push([west + x, south + y]);
            vertices.len() as u32 - 1
        };
        let centre = vertex(half, half);
        let (mut s, mut w, mut e, mut n) = (NONE, NONE, NONE, NONE);
        if split_south {
            s = if y > 0 { line[x] } else { vertex(half, 0) };
        }
        if split_west {
            w = if x > 0 { *middle_east } else { vertex(0, half) };
        }
        if split_east {
            e = vertex(side, half);
            *middle_east = e;
        }
        if split_north {
            n = vertex(half, side);
            line[x] = n;
        }
        let (mut child_sw, mut child_se, mut child_nw, mut child_ne) = (false, false, false, false);
        if k > 0 {
            // What is split has both of its sides split.
            let finer = &self.rtin.levels[k - 1];
            let first = finer.centre(2 * x, 2 * y);
            let second = first + finer.columns;
            child_sw = split_south && split_west && deviations[first] > self.max_error;
            child_se = split_south && split_east && deviations[first + 1] > self.max_error;
            child_nw = split_north && split_west && deviations[second] > self.max_error;
            child_ne = split_north && split_east && deviations[second + 1] > self.max_error;
        }
        let triangles = &mut self.mesh.triangles;
        triangles.reserve(8);
        let mut quarter = |split: bool, from: u32, middle: u32, to: u32, first: bool, second: bool| {
            if !split {
                triangles.push([from, to, centre]);
                return;
            }
            if !first {
                triangles.push([from, middle, centre]);
            }
            if !second {
                triangles.push([middle, to, centre]);
            }
        };
        quarter(split_south, sw, s, se, child_sw, child_se);
        quarter(split_east, se, e, ne, child_se, child_ne);
        quarter(split_north, ne, n, nw, child_ne, child_nw);
        quarter(split_west, nw, w, sw, child_nw, child_sw);
        let (x, y) = (2 * square.x, 2 * square.y);
        if child_sw {
            finer.push(Square { x, y, corners: [sw, s, w, centre] });
        }
        if child_se {
            finer.push(Square { x: x + 1, y, corners: [s, se, centre, e] });
        }
        if child_nw {
            upper.push(Square { x, y: y + 1, corners: [w, centre, nw, n] });
        }
        if child_ne {
            upper.push(Square { x: x + 1, y: y + 1, corners: [centre, e, n, ne] });
        }
    }

    /// Splits a square at its centre, and its sides where they are to be. `line` has the vertices on the sides to the south,
    /// `middle_east` the one on the side to the west.
    fn split(
        &mut self,
        k: usize,
        square: &Square,
        line: &mut [u32],
        middle_east: &mut u32,
        finer: &mut Vec<Square>,
        upper: &mut Vec<Square>,
    ) {
        let (level, side) = (self.rtin.levels[k], 2u32 << k);
        let (x, y) = (square.x as usize, square.y as usize);
        let (west, south, half) = (square.x * side, square.y * side, side / 2);
        let [sw, se, nw, ne] = square.corners;
        let centre = self.vertex([west + half, south + half]);
        let split_south = self.active(level.flat(x, y));
        let split_east = self.active(level.upright(x + 1, y));
        let split_north = self.active(level.flat(x, y + 1));
        let split_west = self.active(level.upright(x, y));
        let mut middle = [NONE; 4];
        // A side that is split has squares on both sides that are, and the earlier one has named the vertex.
        if split_south {
            middle[0] = if y > 0 { line[x] } else { self.vertex([west + half, south]) };
        }
        if split_west {
            middle[3] = if x > 0 { *middle_east } else { self.vertex([west, south + half]) };
        }
        if split_east {
            middle[1] = self.vertex([west + side, south + half]);
            *middle_east = middle[1];
        }
        if split_north {
            middle[2] = self.vertex([west + half, south + side]);
            line[x] = middle[2];
        }
        // Each quarter whole, or its halves unless they belong to a square that is split itself.
        let parts = [
            (Part::South, split_south, sw, se),
            (Part::East, split_east, se, ne),
            (Part::North, split_north, ne, nw),
            (Part::West, split_west, nw, sw),
        ];
        let children = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]: [usize; 2]| {
            k > 0
                && 2 * x + i < self.rtin.levels[k - 1].columns
                && 2 * y + j < self.rtin.levels[k - 1].rows
                && self.active(self.rtin.levels[k - 1].centre(2 * x + i, 2 * y + j))
        });
        let [child_sw, child_se, child_nw, child_ne] = children;
        let ends = [(child_sw, child_se), (child_se, child_ne), (child_ne, child_nw), (child_nw, child_sw)];
        for (((part, split, from, to), (first, second)), middle) in parts.into_iter().zip(ends).zip(middle) {
            let corners = quarter(west, south, side, part);
            if !split {
                self.emit(corners, [from, to, centre]);
                continue;
            }
            let [a, b, c] = corners;
            let between = [u32::midpoint(a[0], b[0]), u32::midpoint(a[1], b[1])];
            if !first {
                self.emit([a, between, c], [from, middle, centre]);
            }
            if !second {
                self.emit([between, b, c], [middle, to, centre]);
            }
        }
        let [south_middle, east_middle, north_middle, west_middle] = middle;
        let child = |i: u32, j: u32, corners: [u32; 4]| Square { x: 2 * square.x + i, y: 2 * square.y + j, corners };
        if child_sw {
            finer.push(child(0, 0, [sw, south_middle, west_middle, centre]));
        }
        if child_se {
            finer.push(child(1, 0, [south_middle, se, centre, east_middle]));
        }
        if child_nw {
            upper.push(child(0, 1, [west_middle, centre, nw, north_middle]));
        }
        if child_ne {
            upper.push(child(1, 1, [centre, east_middle, north_middle, ne]));
        }
    }
}
