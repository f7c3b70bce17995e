//! Rasters larger than memory, meshed tile by tile: neighbours share their border's vertices, so that the tiles together are
//! one mesh without a crack, and no skirts are needed.
//!
//! * Delaunay tiles simplify each border line by itself first, from its own samples and where voids meet it, and keep it: a
//!   tile is finished with its window and a sample around it.
//! * Right-triangulated tiles first are looked at one after another for the vertices that each needs on its border; what one
//!   needs its neighbour must take too, and whatever that depends on, until nothing changes; then they are meshed, one after
//!   another again. Of each tile only a bit for each sample of its border is remembered.

use super::rtin::Rtin;
use super::{MeshError, Triangulation, tin, tolerance};
use crate::field::{Raster, Window};

/// How a tile is meshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// [`super::rtin`]: each window is read twice.
    Rtin,
    /// [`super::tin`]: each window is read once, with a sample around it.
    Tin,
}

/// A raster and the tiles it is meshed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiling {
    /// Samples of the raster along x and y, two at least.
    pub size: [usize; 2],
    /// Patches along the side of a tile: a power of two, 2 at least. Tiles in the east and north may be narrower.
    pub side: usize,
}

impl Tiling {
    /// How many tiles there are along x and y.
    pub fn tiles(&self) -> [usize; 2] {
        self.size.map(|samples| (samples - 1).div_ceil(self.side))
    }

    /// The samples of a tile; its border's belong to its neighbours too.
    pub fn window(&self, [x, y]: [usize; 2]) -> Window {
        let first = [x * self.side, y * self.side];
        let [columns, rows] = [0, 1].map(|axis| (self.size[axis] - first[axis]).min(self.side + 1));
        Window { column: first[0], row: first[1], columns, rows }
    }

    /// All tiles, row by row from the south-west.
    fn each(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.tiles();
        (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y]))
    }

    /// Meshes tile after tile, so that no sample is farther than `max_error` (m) from the triangles. `read` gives the samples of
    /// a window, `write` takes a tile: its window, its samples, and its mesh, whose vertices are counted from the window's
    /// south-western sample. Either may stop the work by an error of its own. Memory grows with the border of the tiles only.
    ///
    /// # Errors
    /// If `max_error` is negative or no number, what is read has another size than was asked for, the sizes make no sense, or
    /// what `read` or `write` say.
    pub fn mesh<E: From<MeshError>>(
        &self,
        method: Method,
        max_error: f32,
        read: &mut dyn FnMut(Window) -> Result<Raster, E>,
        write: &mut dyn FnMut(Window, &Raster, &Triangulation) -> Result<(), E>,
    ) -> Result<(), E> {
        let max_error = tolerance(max_error)?;
        let sound = self.side.is_power_of_two() && (2..=Raster::MAX_SIDE).contains(&self.side);
        if !sound || self.size.iter().any(|samples| !(2..=1 << 31).contains(samples)) {
            return Err(MeshError::Tiles { size: self.size, side: self.side }.into());
        }
        let mut read = |window: Window| {
            let raster = read(window)?;
            let (expected, got) = ([window.columns, window.rows], [raster.columns(), raster.rows()]);
            if expected == got { Ok(raster) } else { Err(E::from(MeshError::OtherRaster { expected, got })) }
        };
        match method {
            Method::Tin => self.tin(max_error, &mut read, write),
            Method::Rtin => self.rtin(max_error, &mut read, write),
        }
    }

    fn tin<E: From<MeshError>>(
        &self,
        max_error: f32,
        read: &mut dyn FnMut(Window) -> Result<Raster, E>,
        write: &mut dyn FnMut(Window, &Raster, &Triangulation) -> Result<(), E>,
    ) -> Result<(), E> {
        for tile in self.each() {
            let window = self.window(tile);
            // A sample more on each side, where there is one, tells where the neighbours' voids meet the border.
            let more = [usize::from(tile[0] > 0), usize::from(tile[1] > 0)];
            let end = [window.column + window.columns, window.row + window.rows];
            let around = Window {
                column: window.column - more[0],
                row: window.row - more[1],
                columns: (end[0] + 1).min(self.size[0]) + more[0] - window.column,
                rows: (end[1] + 1).min(self.size[1]) + more[1] - window.row,
            };
            let outer = read(around)?;
            let border = tin::border(&outer, more, [window.columns, window.rows], max_error);
            let raster = part(&outer, more, window)?;
            let mesh = tin::triangulate_within(&raster, &border, max_error, &|_| true)?;
            write(window, &raster, &mesh)?;
        }
        Ok(())
    }

    fn rtin<E: From<MeshError>>(
        &self,
        max_error: f32,
        read: &mut dyn FnMut(Window) -> Result<Raster, E>,
        write: &mut dyn FnMut(Window, &Raster, &Triangulation) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut lines = Lines::new(self);
        let mut rtin = None;
        for tile in self.each() {
            let raster = read(self.window(tile))?;
            let rtin = Rtin::renew_tile(&mut rtin, &raster, self.side);
            lines.add(tile, |side, at| rtin.border_deviation(side, at).is_some_and(|deviation| deviation > max_error));
        }
        // What a tile must have on one side may ask for more on another.
        let mut changed = true;
        while changed {
            changed = false;
            for tile in self.each() {
                let layout = Rtin::empty_tile(self.window(tile), self.side);
                let wanted = layout.ancestors_on_border(&lines.of(tile));
                changed |= lines.add(tile, |side, at| wanted[side][at]);
            }
        }
        let mut mesh = Triangulation::default();
        for tile in self.each() {
            let window = self.window(tile);
            let raster = read(window)?;
            let rtin = Rtin::renew_tile(&mut rtin, &raster, self.side);
            rtin.force_border(&lines.of(tile));
            rtin.extract(&raster, max_error, &mut mesh)?;
            write(window, &raster, &mesh)?;
        }
        Ok(())
    }
}

/// A window of a raster that lies in a larger one.
fn part(outer: &Raster, more: [usize; 2], window: Window) -> Result<Raster, MeshError> {
    let mut heights = Vec::with_capacity(window.columns * window.rows);
    for row in more[1]..more[1] + window.rows {
        let sample = |column| outer.sample(column, row).unwrap_or(f32::NAN);
        heights.extend((more[0]..more[0] + window.columns).map(sample));
    }
    let got = [outer.columns(), outer.rows()];
    let expected = [window.columns, window.rows];
    Raster::new(window.columns, window.rows, outer.spacing(), heights)
        .map_err(|_| MeshError::OtherRaster { expected, got })
}

/// Vertices on the four sides of a tile — south, east, north, west — by their place along it, counted eastward or northward.
pub(crate) type Sides = [Vec<bool>; 4];

/// Vertices on all borders between tiles and around them.
struct Lines {
    tiles: [usize; 2],
    side: usize,
    /// Pieces of lines eastward and northward, each as long as a tile, 64 samples a word.
    pieces: [Vec<u64>; 2],
}

impl Lines {
    fn new(tiling: &Tiling) -> Lines {
        let (tiles, words) = (tiling.tiles(), tiling.side.div_ceil(64));
        let pieces = [tiles[0] * (tiles[1] + 1), (tiles[0] + 1) * tiles[1]].map(|pieces| vec![0; pieces * words]);
        Lines { tiles, side: tiling.side, pieces }
    }

    /// Which piece a side of a tile is.
    fn place(&self, [x, y]: [usize; 2], side: usize) -> (usize, usize) {
        match side {
            0 => (0, y * self.tiles[0] + x),
            2 => (0, (y + 1) * self.tiles[0] + x),
            1 => (1, y * (self.tiles[0] + 1) + x + 1),
            _ => (1, y * (self.tiles[0] + 1) + x),
        }
    }

    /// Adds vertices to the sides of a tile; whether any is new.
    fn add(&mut self, tile: [usize; 2], wanted: impl Fn(usize, usize) -> bool) -> bool {
        let (mut new, words) = (false, self.side.div_ceil(64));
        for side in 0..4 {
            let (direction, piece) = self.place(tile, side);
            let bits = &mut self.pieces[direction][piece * words..][..words];
            for at in (1..self.side).filter(|at| wanted(side, *at)) {
                let bit = 1u64 << (at & 63);
                new |= bits[at >> 6] & bit == 0;
                bits[at >> 6] |= bit;
            }
        }
        new
    }

    fn of(&self, tile: [usize; 2]) -> Sides {
        let words = self.side.div_ceil(64);
        [0, 1, 2, 3].map(|side| {
            let (direction, piece) = self.place(tile, side);
            let bits = &self.pieces[direction][piece * words..][..words];
            (0..self.side).map(|at| bits[at >> 6] >> (at & 63) & 1 == 1).collect()
        })
    }
}
