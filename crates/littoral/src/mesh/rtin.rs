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
//! The bound is one at samples. Between them it holds, too, for the bilinear surface over patches that no edge cuts; along a
//! diagonal through a patch that surface is a parabola, which may be farther by a quarter of the patch's twist.
//!
//! Works this rests on: W. Evans, D. Kirkpatrick, G. Townsend, "Right-triangulated irregular networks", 2001 (the triangles);
//! M. Duchaineau et al., "ROAMing terrain", 1997 (diamonds); P. Lindstrom and V. Pascucci, "Terrain simplification
//! simplified", 2002 (nested bounds).

mod blocks;
mod border;
mod cut;
mod grow;
mod prepare;
mod rows;
mod search;
mod states;

use super::{MeshError, Triangulation, tolerance};
use crate::field::Raster;
use crate::memory::in_large_pages;
use grow::Growth;
pub use grow::Scratch;

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

impl Rtin {
    /// Measures every deviation of a raster.
    pub fn new(raster: &Raster) -> Rtin {
        let mut rtin = Rtin::layout([raster.columns(), raster.rows()], 2, Vec::new());
        prepare::measure(&mut rtin, raster);
        rtin
    }

    /// Measures another raster in the same memory.
    pub fn renew(&mut self, raster: &Raster) {
        let deviations = std::mem::take(&mut self.deviations);
        *self = Rtin::layout([raster.columns(), raster.rows()], 2, deviations);
        prepare::measure(self, raster);
    }

    /// Where everything is in a virtual square of `side` patches a side, or of as many more as it takes, and how much it is.
    fn places(size: [usize; 2], side: usize) -> (Rtin, usize) {
        let patches = size.map(|samples| samples - 1);
        let (mut levels, mut offset) = (Vec::new(), 0);
        for k in 1.. {
            let [columns, rows] = patches.map(|patches| patches.div_ceil(1 << k));
            let flat = offset + columns * rows;
            let upright = flat + columns * (rows + 1);
            levels.push(Level { columns, rows, centres: offset, flat, upright });
            offset = upright + (columns + 1) * rows;
            if columns * rows == 1 && 1 << k >= side {
                break;
            }
        }
        (Rtin { size, levels, deviations: Vec::new() }, offset)
    }

    /// The same with nothing in it, in the memory of earlier deviations.
    fn layout(size: [usize; 2], side: usize, mut deviations: Vec<f32>) -> Rtin {
        let (rtin, count) = Rtin::places(size, side);
        if deviations.capacity() < count {
            // Zeros from the system cost less than zeros written.
            deviations = in_large_pages(vec![0.0; count]);
        } else {
            deviations.clear();
            deviations.resize(count, 0.0);
        }
        Rtin { deviations, ..rtin }
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
        self.extract_with(raster, max_error, &mut Scratch::default(), into)
    }

    /// The same with scratch of the caller's, so that nothing is allocated where as much was before.
    ///
    /// # Errors
    /// As [`Rtin::extract`].
    pub fn extract_with(
        &self,
        raster: &Raster,
        max_error: f32,
        scratch: &mut Scratch,
        into: &mut Triangulation,
    ) -> Result<(), MeshError> {
        let got = [raster.columns(), raster.rows()];
        if got != self.size {
            return Err(MeshError::OtherRaster { expected: self.size, got });
        }
        Growth::new(self, raster, tolerance(max_error)?, scratch, into).grow()?;
        if raster.voids().any() {
            into.drop_unused(&mut scratch.names);
        }
        Ok(())
    }
}
