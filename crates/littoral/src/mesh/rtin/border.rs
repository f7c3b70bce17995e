//! Tiles that share their border's vertices with their neighbours.

use super::{Rtin, prepare};
use crate::field::{Raster, Window};
use crate::mesh::tiled::Sides;

impl Rtin {
    /// A tile of `side` patches a side, or what of it lies in the raster; memory of `kept` is used again.
    pub(crate) fn renew_tile<'a>(kept: &'a mut Option<Rtin>, raster: &Raster, side: usize) -> &'a mut Rtin {
        let size = [raster.columns(), raster.rows()];
        let deviations = kept.take().map_or(Vec::new(), |rtin| rtin.deviations);
        let rtin = kept.insert(Rtin::layout(size, side, deviations));
        prepare::measure(rtin, raster);
        rtin
    }

    /// Only where things are.
    pub(crate) fn empty_tile(window: Window, side: usize) -> Rtin {
        let mut rtin = Rtin::places([window.columns, window.rows], side).0;
        rtin.deviations = Vec::new();
        rtin
    }

    /// The size of squares and the place of a vertex on the border; none where no square touches the raster.
    fn on_border(&self, side: usize, at: usize) -> Option<(usize, usize, usize)> {
        let k = at.trailing_zeros() as usize;
        let along = at >> (k + 1);
        let level = self.levels.get(k)?;
        // The eastern and northern side of the tile, which a narrower one does not reach.
        let beyond = 1 << (self.levels.len() - 1 - k);
        let (x, y) = match side {
            0 => (along, 0),
            1 => (beyond, along),
            2 => (along, beyond),
            _ => (0, along),
        };
        let upright = side % 2 == 1;
        let inside = if upright { x <= level.columns && y < level.rows } else { x < level.columns && y <= level.rows };
        inside.then_some((k, x, y))
    }

    /// The deviation of a vertex on the border, by the side — south, east, north, west — and its place along it.
    pub(crate) fn border_deviation(&self, side: usize, at: usize) -> Option<f32> {
        let (k, x, y) = self.on_border(side, at)?;
        let level = &self.levels[k];
        Some(self.deviations[if side % 2 == 1 { level.upright(x, y) } else { level.flat(x, y) }])
    }

    /// Calls `visit` for all vertices that some on the border depend on, and those themselves: the size of the squares, the
    /// place, and whether it is a centre, a southern or northern side, or a western or eastern one.
    fn visit_ancestors(&self, sides: &Sides, mut visit: impl FnMut(usize, usize, usize, usize)) {
        let mut centres: Vec<[usize; 2]> = Vec::new();
        let mut seen: Vec<(usize, usize, usize)> = Vec::new();
        for k in 0..self.levels.len() {
            let level = &self.levels[k];
            seen.clear();
            // Sides that hold the centre of a finer square.
            for [x, y] in centres.drain(..) {
                seen.push((1, x / 2, y / 2 + y % 2));
                seen.push((2, x / 2 + x % 2, y / 2));
            }
            for (side, wanted) in sides.iter().enumerate() {
                for at in (1usize << k..wanted.len()).step_by(2 << k).filter(|at| wanted[*at]) {
                    if let Some((_, x, y)) = self.on_border(side, at) {
                        seen.push((1 + side % 2, x, y));
                    }
                }
            }
            seen.sort_unstable();
            seen.dedup();
            for &(kind, x, y) in &seen {
                visit(k, kind, x, y);
                let other = if kind == 1 { [x, y.wrapping_sub(1)] } else { [x.wrapping_sub(1), y] };
                centres.extend([[x, y], other].into_iter().filter(|[x, y]| *x < level.columns && *y < level.rows));
            }
            centres.sort_unstable();
            centres.dedup();
            for &[x, y] in &centres {
                visit(k, 0, x, y);
            }
        }
    }

    /// The vertices on the border that others on the border depend on, and those themselves.
    pub(crate) fn ancestors_on_border(&self, sides: &Sides) -> Sides {
        let mut wanted = sides.clone();
        let top = self.levels.len();
        self.visit_ancestors(sides, |k, kind, x, y| {
            let (half, beyond) = (1 << k, 1 << (top - 1 - k));
            match kind {
                1 if y == 0 => wanted[0][x * 2 * half + half] = true,
                1 if y == beyond => wanted[2][x * 2 * half + half] = true,
                2 if x == 0 => wanted[3][y * 2 * half + half] = true,
                2 if x == beyond => wanted[1][y * 2 * half + half] = true,
                _ => {}
            }
        });
        wanted
    }

    /// Makes vertices on the border, and all that they depend on, part of every mesh.
    pub(crate) fn force_border(&mut self, sides: &Sides) {
        let mut forced = Vec::new();
        self.visit_ancestors(sides, |k, kind, x, y| {
            let level = &self.levels[k];
            forced.push([level.centre(x, y), level.flat(x, y), level.upright(x, y)][kind]);
        });
        forced.into_iter().for_each(|index| self.deviations[index] = f32::INFINITY);
    }
}
