//! Right-triangulated irregular networks: isosceles right triangles, each split at the middle of its hypotenuse, within a
//! bound that holds at every sample.
//!
//! Squares of 2, 4, 8, … patches a side tile the raster. A square of side s is drawn as two triangles, by one diagonal; split
//! at its *centre* it is four; a side split at its *middle* is the hypotenuse of two triangles on either side, halves of
//! squares of side s ⁄ 2. So every sample is the centre of one square or the middle of one side, and is in the mesh if its
//! *deviation* is above the error asked for: the greatest distance from the surface to the two triangles that meet there
//! while it is not, at every sample in them, or the deviation of any of its four children if that is more. Deviations nest,
//! so that a vertex never comes without the two it depends on, and no T-vertex arises.
//!
//! Only samples inside a triangle and on its hypotenuse have to be looked at: its legs are its children's hypotenuses.
//! Rasters of any size lie in a virtual square of 2ᵏ patches a side. Triangles that leave the raster are cut at its border:
//! edges are parallel to the axes or diagonal, so every cut is a sample. A triangle that is partly void must be split.
//!
//! Works this rests on: W. Evans, D. Kirkpatrick, G. Townsend, "Right-triangulated irregular networks", 2001 (the triangles);
//! M. Duchaineau et al., "ROAMing terrain", 1997 (diamonds); P. Lindstrom and V. Pascucci, "Terrain simplification
//! simplified", 2002 (nested bounds).

use super::measure::{Exactness, deviation, lies_on_surface, patch_exists};
use super::{MeshError, Triangulation, tolerance};
use crate::field::Raster;
use rayon::prelude::*;

/// Where the deviations of one size of squares lie.
#[derive(Clone, Copy, Debug)]
struct Level {
    /// Squares along x and y: as many as touch the raster.
    columns: usize,
    rows: usize,
    /// Index of the first centre, of the first southern or northern side, of the first western or eastern one.
    centres: usize,
    flat: usize,
    upright: usize,
}

impl Level {
    fn centre(&self, x: usize, y: usize) -> usize {
        self.centres + y * self.columns + x
    }

    /// The southern side of square (x, y), the northern one of (x, y − 1).
    fn flat(&self, x: usize, y: usize) -> usize {
        self.flat + y * self.columns + x
    }

    /// The western side of square (x, y), the eastern one of (x − 1, y).
    fn upright(&self, x: usize, y: usize) -> usize {
        self.upright + y * (self.columns + 1) + x
    }
}

/// The deviations of one raster: what is needed to mesh it again and again for different errors. Four bytes a sample.
#[derive(Clone, Debug)]
pub struct Rtin {
    size: [usize; 2],
    /// `levels[k]` has squares of 2ᵏ⁺¹ patches a side; the last is one square.
    levels: Vec<Level>,
    /// One for each vertex (m); infinite where a triangle is partly void.
    deviations: Vec<f32>,
}

/// Rounded up.
fn up(deviation: f64) -> f32 {
    let nearest = deviation as f32;
    if f64::from(nearest) < deviation { nearest.next_up() } else { nearest }
}

/// The triangles of a square, each with the square's south-western corner and side (patches).
#[derive(Clone, Copy)]
enum Part {
    /// Between the centre and a side.
    South,
    East,
    North,
    West,
}

/// Whether the diagonal of a square leads from the south-west to the north-east: it starts at the centre of the square of
/// twice its side.
fn rises(x: usize, y: usize) -> bool {
    (x + y).is_multiple_of(2)
}

/// Corners of a triangle on the virtual lattice.
type Corners = [[u32; 2]; 3];

fn quarter(x: u32, y: u32, side: u32, part: Part) -> Corners {
    let ([west, south, east, north], centre) = ([x, y, x + side, y + side], [x + side / 2, y + side / 2]);
    match part {
        Part::South => [[west, south], [east, south], centre],
        Part::East => [[east, south], [east, north], centre],
        Part::North => [[east, north], [west, north], centre],
        Part::West => [[west, north], [west, south], centre],
    }
}

/// The two halves of a square, the southern one first.
fn halves(x: u32, y: u32, side: u32, rises: bool) -> [Corners; 2] {
    let [west, south, east, north] = [x, y, x + side, y + side];
    if rises {
        [[[west, south], [east, south], [east, north]], [[west, south], [east, north], [west, north]]]
    } else {
        [[[west, south], [east, south], [west, north]], [[east, south], [east, north], [west, north]]]
    }
}

/// What is left of a triangle inside the raster, counter-clockwise: up to five corners.
#[derive(Clone, Copy)]
struct Cut {
    corners: [[u32; 2]; 6],
    count: usize,
}

impl Cut {
    fn new(corners: Corners, last: [u32; 2]) -> Cut {
        let mut cut = Cut { corners: [[0; 2]; 6], count: 3 };
        cut.corners[..3].copy_from_slice(&corners);
        for axis in 0..2 {
            if cut.corners[..cut.count].iter().any(|at| at[axis] > last[axis]) {
                cut = cut.clip(axis, last[axis]);
            }
        }
        // The fan must not depend on which corner of the triangle was named first.
        let first = (0..cut.count).min_by_key(|k| cut.corners[*k]).unwrap_or(0);
        cut.corners[..cut.count].rotate_left(first);
        cut
    }

    fn clip(&self, axis: usize, last: u32) -> Cut {
        let mut cut = Cut { corners: [[0; 2]; 6], count: 0 };
        for (k, &from) in self.corners[..self.count].iter().enumerate() {
            let to = self.corners[(k + 1) % self.count];
            if from[axis] <= last {
                cut.push(from);
            }
            if (from[axis] <= last) != (to[axis] <= last) {
                // Edges are parallel to the axes or diagonal: a step along one is none or one along the other.
                let other = 1 - axis;
                let steps = i64::from(last) - i64::from(from[axis]);
                let run = i64::from(to[axis]) - i64::from(from[axis]);
                let along = i64::from(to[other]) - i64::from(from[other]);
                let mut at = from;
                at[axis] = last;
                at[other] = (i64::from(from[other]) + along.signum() * steps.abs() * i64::from(run != 0)) as u32;
                cut.push(at);
            }
        }
        while cut.count > 1 && cut.corners[0] == cut.corners[cut.count - 1] {
            cut.count -= 1;
        }
        cut
    }

    fn push(&mut self, at: [u32; 2]) {
        if self.count == 0 || self.corners[self.count - 1] != at {
            self.corners[self.count] = at;
            self.count += 1;
        }
    }

    /// A fan of triangles.
    fn triangles(&self) -> impl Iterator<Item = Corners> + '_ {
        (2..self.count).map(|k| [self.corners[0], self.corners[k - 1], self.corners[k]])
    }
}

/// What there is of the surface in the four quarters of a square, two bits each: something, and something void.
type States = u8;
const SOLID: u8 = 1;
const VOID: u8 = 2;

fn state(states: States, part: Part) -> u8 {
    states >> (2 * part as u8) & 3
}

/// States of the halves of a square.
fn half_states(states: States, rises: bool) -> [u8; 2] {
    let of = |part| state(states, part);
    if rises {
        [of(Part::South) | of(Part::East), of(Part::North) | of(Part::West)]
    } else {
        [of(Part::South) | of(Part::West), of(Part::North) | of(Part::East)]
    }
}

impl Rtin {
    /// Measures every deviation of a raster.
    pub fn new(raster: &Raster) -> Rtin {
        let size = [raster.columns(), raster.rows()];
        let mut rtin = Rtin::layout(size);
        let exactness = Exactness::of(raster);
        let last = size.map(|samples| samples as u32 - 1);
        let mut states = Vec::new();
        for k in 0..rtin.levels.len() {
            let level = rtin.levels[k];
            if raster.voids().any() {
                states = if k == 0 {
                    finest_states(raster, level)
                } else {
                    coarser_states(&states, rtin.levels[k - 1], level)
                };
            }
            let side = 2u32 << k;
            let one = |corners: Corners, state: u8| match state {
                _ if state == SOLID | VOID => f32::INFINITY,
                SOLID => {
                    let cut = Cut::new(corners, last);
                    let measure = |corners| deviation(raster.heights(), size[0], exactness, corners);
                    up(cut.triangles().map(measure).fold(0.0, f64::max))
                }
                _ => 0.0,
            };
            let of_square = |x: usize, y: usize| {
                let states = states.get(y * level.columns + x).copied().unwrap_or(0b0101_0101);
                let (west, south) = (x as u32 * side, y as u32 * side);
                let [a, b] = half_states(states, rises(x, y));
                let [half_a, half_b] = halves(west, south, side, rises(x, y));
                let parts = [Part::South, Part::East, Part::North, Part::West]
                    .map(|part| one(quarter(west, south, side, part), state(states, part)));
                (one(half_a, a).max(one(half_b, b)), parts)
            };
            let squares = level.columns * level.rows;
            let measured: Vec<(f32, [f32; 4])> =
                (0..squares).into_par_iter().map(|i| of_square(i % level.columns, i / level.columns)).collect();
            for (i, (centre, parts)) in measured.into_iter().enumerate() {
                let (x, y) = (i % level.columns, i / level.columns);
                rtin.deviations[level.centre(x, y)] = centre;
                let sides = [level.flat(x, y), level.upright(x + 1, y), level.flat(x, y + 1), level.upright(x, y)];
                for (side, part) in sides.into_iter().zip(parts) {
                    rtin.deviations[side] = rtin.deviations[side].max(part);
                }
            }
            rtin.nest(k);
        }
        rtin
    }

    /// Where everything is, and nothing in it.
    fn layout(size: [usize; 2]) -> Rtin {
        let patches = size.map(|samples| samples - 1);
        let (mut levels, mut offset) = (Vec::new(), 0);
        for k in 1.. {
            let [columns, rows] = patches.map(|patches| patches.div_ceil(1 << k));
            let flat = offset + columns * rows;
            let upright = flat + columns * (rows + 1);
            levels.push(Level { columns, rows, centres: offset, flat, upright });
            offset = upright + (columns + 1) * rows;
            if columns * rows == 1 {
                break;
            }
        }
        Rtin { size, levels, deviations: vec![0.0; offset] }
    }

    /// Raises the deviations of a level to those of their children.
    fn nest(&mut self, k: usize) {
        let level = self.levels[k];
        if k > 0 {
            let finer = self.levels[k - 1];
            for y in 0..finer.rows {
                for x in 0..finer.columns {
                    let child = self.deviations[finer.centre(x, y)];
                    let (column, row) = (x / 2, y / 2);
                    for side in [level.flat(column, row + y % 2), level.upright(column + x % 2, row)] {
                        self.deviations[side] = self.deviations[side].max(child);
                    }
                }
            }
        }
        for y in 0..level.rows {
            for x in 0..level.columns {
                let sides = [level.flat(x, y), level.upright(x + 1, y), level.flat(x, y + 1), level.upright(x, y)];
                let centre = level.centre(x, y);
                self.deviations[centre] =
                    sides.into_iter().fold(self.deviations[centre], |most, side| most.max(self.deviations[side]));
            }
        }
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.deviations.as_slice()) + size_of_val(self.levels.as_slice())
    }

    /// Meshes the raster that was given to [`Rtin::new`] so that no sample of it is farther than `max_error` (m) from the
    /// triangles, measured vertically, and none of them lies on a void. What `into` held is replaced; its memory is used
    /// again.
    ///
    /// # Errors
    /// If `max_error` is negative or no number, or the raster is of another size.
    pub fn extract(&self, raster: &Raster, max_error: f32, into: &mut Triangulation) -> Result<(), MeshError> {
        let got = [raster.columns(), raster.rows()];
        if got != self.size {
            return Err(MeshError::OtherRaster { expected: self.size, got });
        }
        let max_error = tolerance(max_error)?;
        let mut growth = Growth::new(self, raster, max_error, into);
        growth.grow();
        if raster.voids().any() {
            into.drop_unused();
        }
        Ok(())
    }
}

/// Two bits of each quarter of each square of two patches a side.
fn finest_states(raster: &Raster, level: Level) -> Vec<States> {
    let patch = |x: usize, y: usize| match x + 1 < raster.columns() && y + 1 < raster.rows() {
        false => 0,
        true if patch_exists(raster, x as i64, y as i64) => SOLID,
        true => VOID,
    };
    let of = |i: usize| {
        let (x, y) = (2 * (i % level.columns), 2 * (i / level.columns));
        let [a, b, c, d] = [patch(x, y), patch(x + 1, y), patch(x, y + 1), patch(x + 1, y + 1)];
        (a | b) | (b | d) << 2 | (c | d) << 4 | (a | c) << 6
    };
    (0..level.columns * level.rows).into_par_iter().map(of).collect()
}

/// The same for squares of twice the side.
fn coarser_states(finer: &[States], under: Level, level: Level) -> Vec<States> {
    let halves = |x: usize, y: usize| match x < under.columns && y < under.rows {
        true => half_states(finer[y * under.columns + x], rises(x, y)),
        false => [0; 2],
    };
    let of = |i: usize| {
        let (x, y) = (2 * (i % level.columns), 2 * (i / level.columns));
        let [a, b, c, d] = [halves(x, y), halves(x + 1, y), halves(x, y + 1), halves(x + 1, y + 1)];
        (a[0] | b[0]) | (b[1] | d[0]) << 2 | (c[1] | d[1]) << 4 | (a[1] | c[0]) << 6
    };
    (0..level.columns * level.rows).into_par_iter().map(of).collect()
}

/// A square whose centre is a vertex.
#[derive(Clone, Copy)]
struct Square {
    x: u32,
    y: u32,
    /// Vertices at the corners: south-west, south-east, north-west, north-east.
    corners: [u32; 4],
}

/// No vertex: outside the raster.
const NONE: u32 = u32::MAX;

/// A mesh that grows, one size of squares after another.
struct Growth<'a> {
    rtin: &'a Rtin,
    raster: &'a Raster,
    max_error: f32,
    mesh: &'a mut Triangulation,
    last: [u32; 2],
    /// Vertices on the eastern and northern border, where triangles are cut.
    east: Vec<u32>,
    north: Vec<u32>,
}

impl Growth<'_> {
    fn new<'a>(rtin: &'a Rtin, raster: &'a Raster, max_error: f32, mesh: &'a mut Triangulation) -> Growth<'a> {
        mesh.vertices.clear();
        mesh.triangles.clear();
        let last = rtin.size.map(|samples| samples as u32 - 1);
        let (east, north) = (vec![NONE; rtin.size[1]], vec![NONE; rtin.size[0]]);
        Growth { rtin, raster, max_error, mesh, last, east, north }
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
            &mut self.east[at[1] as usize]
        } else if at[1] == self.last[1] {
            &mut self.north[at[0] as usize]
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
        if cut.count < 3 || cut.triangles().all(|part| super::measure::doubled_area(part) == 0) {
            return;
        }
        if self.raster.voids().any()
            && !cut.triangles().any(|part| super::measure::doubled_area(part) > 0 && lies_on_surface(self.raster, part))
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
            if super::measure::doubled_area(part) > 0 {
                self.mesh.triangles.push([fan[0], fan[k + 1], fan[k + 2]]);
            }
        }
    }

    fn grow(&mut self) {
        let top = self.rtin.levels.len() - 1;
        let side = 2u32 << top;
        let places = [[0, 0], [side, 0], [0, side], [side, side]];
        let corners = places.map(|at| self.vertex(at));
        if !self.active(self.rtin.levels[top].centre(0, 0)) {
            let [a, b] = halves(0, 0, side, true);
            self.emit(a, [corners[0], corners[1], corners[3]]);
            self.emit(b, [corners[0], corners[3], corners[2]]);
            return;
        }
        let mut squares = vec![Square { x: 0, y: 0, corners }];
        let (mut finer, mut upper) = (Vec::new(), Vec::new());
        for k in (0..=top).rev() {
            finer.clear();
            let mut line = vec![NONE; self.rtin.levels[k].columns];
            for row in squares.chunk_by(|a, b| a.y == b.y) {
                let mut east = NONE;
                for square in row {
                    self.split(k, square, &mut line, &mut east, &mut finer, &mut upper);
                }
                finer.append(&mut upper);
            }
            std::mem::swap(&mut squares, &mut finer);
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
