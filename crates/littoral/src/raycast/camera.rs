//! Primary rays of a view: beams of neighbouring pixels find out together where there is nothing to meet.
//!
//! A *beam* is the bundle of rays through a square of pixels. As far as its lowest ray stays above the highest point of
//! all nodes below the beam, none of its rays can meet anything. Beams of 16² pixels march first, sixteen at once, one in
//! each lane; beams of 4² pixels go on from where theirs stopped; from there the sixteen rays of each walk together
//! (`tile.rs`) as long as they see the same patches, and those left over walk by themselves in the stream. A step of the
//! march is a bar of the beam about as long as a node is wide, and looks at the 2 × 2 nodes that its footprint can touch:
//! longer after a success, shorter after a failure, until it would be no longer than the beam is wide.
//!
//! Works this rests on: spec page 004 (the bar halved along its depth); J. Amanatides, "Ray tracing with cones", SIGGRAPH
//! 1984; A. Reshetov et al., "Multi-level ray tracing algorithm", SIGGRAPH 2005 (common entry points of beams).

use super::lanes::Lanes;
use super::scene::Scene;
use super::stream::{BLOCK, Prepared, Rays, absolute};
use super::tile::{self, Beam, Outcome};
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Side of a tile, of a coarse and of a fine beam (pixels).
const TILE: u32 = 64;
const COARSE: u32 = 16;
const FINE: u32 = tile::SIDE as u32;
/// Width of a fine beam (cells) up to which its rays see few enough patches to walk together.
const TOGETHER: f32 = 2.0;
const FINE_IN_TILE: usize = ((TILE / FINE) * (TILE / FINE)) as usize;

/// The id of a ray beyond the picture's edge: no index of a slice.
const NOWHERE: i32 = -1;

/// The pixels of a fine beam.
const PIXEL_X: [i32; 16] = [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3];
const PIXEL_Y: [i32; 16] = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3];

/// The rays of some rows of a picture, tile by tile.
pub(super) struct ViewRays<'a, const FOOTPRINT: bool> {
    pub eye: Vec3,
    /// Direction through pixel coordinate (0, 0), and the steps to the next pixel rightward and downward.
    pub corner: Vec3,
    pub right: Vec3,
    pub down: Vec3,
    /// Where in each pixel the ray goes.
    pub sample: Vec2,
    pub width: u32,
    pub rows: Range<u32>,
    pub distances: &'a mut [f32],
    pub below: &'a mut Vec<i32>,
    /// How wide rays are (pixels), if they are walked by footprint.
    pub pixels: f32,
    tile: u32,
    /// Next fine beam of the tile, row by row.
    fine: u32,
    starts: [f32; FINE_IN_TILE],
    levels: [i32; FINE_IN_TILE],
    left: Left,
}

/// Rays that are left to the stream: their pixels, and where and at which level they start. Fewer than a beam's, and room for
/// another one's.
struct Left {
    count: usize,
    x: [i32; 32],
    y: [i32; 32],
    from: [f32; 32],
    level: [i32; 32],
}

impl Left {
    fn new() -> Left {
        let (numbers, integers) = ([0.0; 32], [0; 32]);
        Left { count: 0, x: integers, y: integers, from: numbers, level: integers }
    }

    fn push(&mut self, (x, y): (u32, u32), from: f32, level: i32) {
        let at = self.count;
        (self.x[at], self.y[at], self.from[at], self.level[at]) = (x as i32, y as i32, from, level);
        self.count += 1;
    }

    /// Forgets the first ones.
    fn forget(&mut self, count: usize) {
        self.x.copy_within(count..self.count, 0);
        self.y.copy_within(count..self.count, 0);
        self.from.copy_within(count..self.count, 0);
        self.level.copy_within(count..self.count, 0);
        self.count -= count;
    }
}

/// Sixteen beams: where they start and at which level, and between which bounds their directions lie.
struct Beams {
    t: [f32; 16],
    level: [i32; 16],
    x: [[f32; 16]; 2],
    y: [[f32; 16]; 2],
    z: [f32; 16],
}

impl<'a, const FOOTPRINT: bool> ViewRays<'a, FOOTPRINT> {
    #[allow(clippy::too_many_arguments, reason = "the numbers of a view, each once")]
    pub fn new(
        eye: Vec3,
        (corner, right, down): (Vec3, Vec3, Vec3),
        sample: Vec2,
        pixels: f32,
        width: u32,
        rows: Range<u32>,
        distances: &'a mut [f32],
        below: &'a mut Vec<i32>,
    ) -> ViewRays<'a, FOOTPRINT> {
        let (starts, levels) = ([0.0; FINE_IN_TILE], [0; FINE_IN_TILE]);
        ViewRays {
            eye,
            corner,
            right,
            down,
            sample,
            width,
            rows,
            distances,
            below,
            pixels,
            tile: 0,
            fine: 0,
            starts,
            levels,
            left: Left::new(),
        }
    }

    /// Fills in the bounds of the beam through `side` × `side` pixels from (x, y).
    #[inline(always)]
    fn bound(&self, scene: &Scene, beams: &mut Beams, lane: usize, x: u32, y: u32, side: u32) {
        let half = 0.5 * (side - 1) as f32;
        let middle = Vec2::new(x as f32 + half, y as f32 + half) + self.sample;
        let centre = self.corner + self.right * middle.x + self.down * middle.y;
        // A millionth more than needed, for what rounding does to the rays.
        let reach = (self.right.abs() + self.down.abs()) * half + 1e-6 * (centre.abs().max_element());
        let (low, high) = (centre - reach, centre + reach);
        beams.x[0][lane] = low.x * scene.per_metre.x;
        beams.x[1][lane] = high.x * scene.per_metre.x;
        beams.y[0][lane] = low.y * scene.per_metre.y;
        beams.y[1][lane] = high.y * scene.per_metre.y;
        beams.z[lane] = low.z;
    }

    /// Finds out where the fine beams of the tile at (x, y) may first meet something.
    #[inline(always)]
    fn survey<L: Lanes>(&mut self, l: L, scene: &Scene, x: u32, y: u32) {
        let zeros = [[0.0; 16]; 2];
        let mut coarse = Beams { t: [0.0; 16], level: [scene.top - 1; 16], x: zeros, y: zeros, z: [0.0; 16] };
        for beam in 0..16 {
            let (i, j) = (beam % (TILE / COARSE), beam / (TILE / COARSE));
            self.bound(scene, &mut coarse, beam as usize, x + i * COARSE, y + j * COARSE, COARSE);
        }
        self.march(l, scene, &mut coarse);
        for beam in 0..16 {
            let (i, j) = (beam % 4 * COARSE, beam / 4 * COARSE);
            let (t, level) = (coarse.t[beam as usize], coarse.level[beam as usize]);
            let mut fine = Beams { t: [t; 16], level: [level; 16], x: zeros, y: zeros, z: [0.0; 16] };
            for part in 0..16 {
                let (x, y) = (x + i + part % 4 * FINE, y + j + part / 4 * FINE);
                self.bound(scene, &mut fine, part as usize, x, y, FINE);
            }
            self.march(l, scene, &mut fine);
            for part in 0..16 {
                let (column, row) = ((i / FINE + part % 4) as usize, (j / FINE + part / 4) as usize);
                self.starts[row * 16 + column] = fine.t[part as usize];
                self.levels[row * 16 + column] = fine.level[part as usize];
            }
        }
    }

    /// Directions through some pixels.
    #[inline(always)]
    fn directions<L: Lanes>(&self, l: L, x: L::I, y: L::I) -> [L::F; 3] {
        let px = l.add(l.float(x), l.splat(self.sample.x));
        let py = l.add(l.float(y), l.splat(self.sample.y));
        let mut direction = [px; 3];
        for (axis, direction) in direction.iter_mut().enumerate() {
            let across = l.add(l.splat(self.corner[axis]), l.mul(l.splat(self.right[axis]), px));
            *direction = l.add(across, l.mul(l.splat(self.down[axis]), py));
        }
        direction
    }

    /// How wide rays are at distance 1 (samples).
    fn spread(&self, scene: &Scene) -> f32 {
        if FOOTPRINT { self.pixels * self.right.length() * scene.per_metre.min_element() } else { 0.0 }
    }

    /// Walks the rays of the fine beam at (x, y) as far as they go together.
    #[inline(always)]
    fn walk<L: Lanes>(&mut self, l: L, scene: &Scene, (x, y): (u32, u32), from: f32, level: i32) {
        let (mut directions, mut wanted) = ([[l.splat(0.0); 3]; 2], 0);
        for (half, directions) in directions.iter_mut().enumerate().take(16 / L::COUNT) {
            let at = half * L::COUNT;
            let ix = l.iadd(l.load_int(&PIXEL_X[at..]), l.int(x as i32));
            let iy = l.iadd(l.load_int(&PIXEL_Y[at..]), l.int(y as i32));
            let inside = l.and(l.igt(l.int(self.width as i32), ix), l.igt(l.int(self.rows.end as i32), iy));
            wanted |= l.bits(inside) << at;
            *directions = self.directions(l, ix, iy);
        }
        let middle = Vec2::new(x as f32, y as f32) + 0.5 * FINE as f32;
        let middle = self.corner + self.right * middle.x + self.down * middle.y;
        let beam = Beam { eye: self.eye, directions: &directions, middle, from, wanted, spread: self.spread(scene) };
        let mut outcome = Outcome { distance: [0.0; 16], from: [0.0; 16], open: 0, below: 0 };
        tile::walk(l, scene, &beam, &mut outcome);
        let columns = tile::SIDE.min((self.width - x) as usize);
        for (row, distances) in outcome.distance.chunks_exact(tile::SIDE).enumerate() {
            if y + (row as u32) < self.rows.end {
                let line = self.place(x, y + row as u32);
                self.distances[line..line + columns].copy_from_slice(&distances[..columns]);
            }
        }
        for lane in ones(outcome.below & wanted) {
            self.below.push(self.place(x + lane % FINE, y + lane / FINE) as i32);
        }
        // Those that have gone some way stand near the ground.
        let level = if outcome.open == wanted && outcome.from[0] == from { level } else { 1 };
        for lane in ones(outcome.open & wanted) {
            self.left.push((x + lane % FINE, y + lane / FINE), outcome.from[lane as usize], level);
        }
    }

    /// Prepares pixels for the stream.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the numbers of a ray, each once")]
    fn prepare<L: Lanes>(
        &self,
        l: L,
        scene: &Scene,
        block: &mut Prepared,
        at: usize,
        (x, y): (L::I, L::I),
        from: L::F,
        level: L::I,
    ) {
        let inside = l.and(l.igt(l.int(self.width as i32), x), l.igt(l.int(self.rows.end as i32), y));
        let line = l.imul(l.isub(y, l.int(self.rows.start as i32)), l.int(self.width as i32));
        let id = l.iselect(inside, l.iadd(line, x), l.int(NOWHERE));
        let origin = [l.splat(self.eye.x), l.splat(self.eye.y), l.splat(self.eye.z)];
        let direction = self.directions(l, x, y);
        block.set(l, scene, at, id, origin, direction, l.splat(f32::INFINITY), from, level);
        if FOOTPRINT {
            l.store(l.splat(self.spread(scene)), &mut block.spread[at..]);
        }
    }

    /// Moves up to sixteen of the rays that are left to the block.
    #[inline(always)]
    fn take<L: Lanes>(&mut self, l: L, scene: &Scene, block: &mut Prepared) {
        let count = self.left.count.min(16);
        for part in (0..16).step_by(L::COUNT) {
            let pixels = (l.load_int(&self.left.x[part..]), l.load_int(&self.left.y[part..]));
            let (from, level) = (l.load(&self.left.from[part..]), l.load_int(&self.left.level[part..]));
            self.prepare(l, scene, block, block.count + part, pixels, from, level);
        }
        block.count += count;
        self.left.forget(count);
    }

    /// Where the answer of a pixel goes.
    fn place(&self, x: u32, y: u32) -> usize {
        (y - self.rows.start) as usize * self.width as usize + x as usize
    }

    /// Writes down that the pixels of the fine beam at (x, y) see nothing.
    fn nothing(&mut self, x: u32, y: u32) {
        let columns = x.min(self.width)..(x + FINE).min(self.width);
        for row in y..(y + FINE).min(self.rows.end) {
            let line = (row - self.rows.start) as usize * self.width as usize;
            self.distances[line + columns.start as usize..line + columns.end as usize].fill(f32::INFINITY);
        }
    }

    /// Moves the starts of beams as far as nothing can be met.
    #[inline(always)]
    fn march<L: Lanes>(&self, l: L, scene: &Scene, beams: &mut Beams) {
        for at in (0..16).step_by(L::COUNT) {
            let x = l.splat(self.eye.x * scene.per_metre.x + scene.offset.x);
            let y = l.splat(self.eye.y * scene.per_metre.y + scene.offset.y);
            let z = l.splat(self.eye.z + scene.height);
            let (x_low, x_high) = (l.load(&beams.x[0][at..]), l.load(&beams.x[1][at..]));
            let (y_low, y_high) = (l.load(&beams.y[0][at..]), l.load(&beams.y[1][at..]));
            let z_low = l.load(&beams.z[at..]);
            let mut t = l.load(&beams.t[at..]);
            let mut level = l.load_int(&beams.level[at..]);
            let zero = l.splat(0.0);
            // Cells per unit of distance along the beam and across it.
            let along_x = l.max(absolute(l, x_low), absolute(l, x_high));
            let along_y = l.max(absolute(l, y_low), absolute(l, y_high));
            let along = l.max(l.max(along_x, along_y), l.splat(1e-9));
            let across = l.max(l.sub(x_high, x_low), l.sub(y_high, y_low));
            let pace = l.div(l.splat(1.0), along);
            // Beyond this every ray of the beam has left the map, or the heights above it.
            let rises = l.lt(zero, z_low);
            let out = l.div(l.splat(scene.high - self.eye.z - scene.height), l.select(rises, z_low, l.splat(1.0)));
            // The slowest of its rays: on the axis where even that one moves fastest.
            let slow_x = l.max(x_low, l.sub(zero, x_high));
            let slow_y = l.max(y_low, l.sub(zero, y_high));
            let slow = l.max(slow_x, slow_y);
            let moves = l.lt(l.splat(1e-9), slow);
            let far = l.div(l.splat(self.diagonal(scene)), l.select(moves, slow, l.splat(1.0)));
            let end = l.select(rises, l.max(out, zero), l.splat(f32::INFINITY));
            let end = l.min(l.select(moves, far, l.splat(f32::INFINITY)), end);
            let (one, all) = (l.int(1), l.mask(u32::MAX));
            let mut active = l.lt(t, end);
            let (mut steps, most) = (0, 200);
            while l.bits(active) != 0 && steps < most {
                steps += 1;
                // Bars of 2^level cells; with the width of the beam their footprint still fits 2 × 2 nodes of this level + 1.
                let cells = l.float(l.shl(one, level));
                let next = l.add(t, l.mul(cells, pace));
                let ((x0, x1), (y0, y1)) = (span(l, [x_low, x_high], x, t, next), span(l, [y_low, y_high], y, t, next));
                let lowest = l.add(z, l.min(l.mul(z_low, t), l.mul(z_low, next)));
                let coarser = l.imin(l.iadd(level, one), l.int(scene.top));
                let (x0, x1) = (node(l, scene, 0, x0, coarser), node(l, scene, 0, x1, coarser));
                let (y0, y1) = (node(l, scene, 1, y0, coarser), node(l, scene, 1, y1, coarser));
                // Wider than two nodes: too wide for this level (the beam fans out, or the bar is steep).
                let fits = l.and(l.igt(l.int(2), l.isub(x1, x0)), l.igt(l.int(2), l.isub(y1, y0)));
                let (offset, stride) = (l.lookup(&scene.offsets, coarser), l.lookup(&scene.strides, coarser));
                let (south, north) = (l.iadd(offset, l.imul(y0, stride)), l.iadd(offset, l.imul(y1, stride)));
                // SAFETY: nodes are clamped to the raster's, at levels 1 to the top.
                let (south_high, north_high) = unsafe {
                    let west = (
                        l.gather_u16(all, scene.highs, l.iadd(south, x0)),
                        l.gather_u16(all, scene.highs, l.iadd(north, x0)),
                    );
                    let east = (
                        l.gather_u16(all, scene.highs, l.iadd(south, x1)),
                        l.gather_u16(all, scene.highs, l.iadd(north, x1)),
                    );
                    (l.imax(west.0, east.0), l.imax(west.1, east.1))
                };
                let high = l.imax(south_high, north_high);
                let high = l.add(l.mul(l.float(high), l.splat(scene.step)), l.splat(scene.high_base));
                let clear = l.and(l.and(active, fits), l.lt(l.add(high, l.splat(0.01)), lowest));
                t = l.select(clear, next, t);
                let blocked = l.without(active, clear);
                let width = l.mul(across, t);
                level = l.iselect(clear, l.imin(l.iadd(level, one), l.int(scene.top - 1)), level);
                // Stop where the bar has become about as short as the beam is wide.
                let stop = l.or(l.igt(l.int(2), level), l.le(cells, width));
                let stopped = l.and(blocked, stop);
                level = l.iselect(l.without(blocked, stop), l.isub(level, one), level);
                active = l.without(active, l.or(stopped, l.le(end, t)));
            }
            // Nothing is left to meet: the rays need not be walked at all.
            let t = l.select(l.le(end, t), l.splat(f32::INFINITY), t);
            l.store(t, &mut beams.t[at..]);
            l.store_int(l.imax(level, one), &mut beams.level[at..]);
        }
    }

    /// More than any ray over the map has gone along either axis (cells): the map's sides and the way to them.
    fn diagonal(&self, scene: &Scene) -> f32 {
        let from = |axis: usize| {
            (scene.cell[axis].abs() + scene.cells[axis]) as f32
                + (self.eye[axis] * scene.per_metre[axis]).abs()
                + scene.offset[axis].abs()
        };
        from(0) + from(1)
    }
}

/// The numbers of the bits that are set.
fn ones(mut bits: u32) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = (bits != 0).then(|| bits.trailing_zeros());
        bits &= bits.wrapping_sub(1);
        bit
    })
}

/// The first and last cell along an axis that a beam touches between distances `from` and `to`: `bounds` of its direction,
/// `at` its origin.
#[inline(always)]
fn span<L: Lanes>(l: L, bounds: [L::F; 2], at: L::F, from: L::F, to: L::F) -> (L::I, L::I) {
    let hair = l.splat(0.01);
    let low = l.min(l.mul(bounds[0], from), l.mul(bounds[0], to));
    let high = l.max(l.mul(bounds[1], from), l.mul(bounds[1], to));
    (l.floor(l.sub(l.add(low, at), hair)), l.floor(l.add(l.add(high, at), hair)))
}

/// The node of a level, along an axis, over a cell counted from the anchor's; the nearest one for cells beside the map.
#[inline(always)]
fn node<L: Lanes>(l: L, scene: &Scene, axis: usize, cell: L::I, level: L::I) -> L::I {
    let cell = l.iadd(cell, l.int(scene.cell[axis]));
    l.shr(l.imax(l.imin(cell, l.int(scene.cells[axis] - 1)), l.int(0)), level)
}

impl<const FOOTPRINT: bool> Rays for ViewRays<'_, FOOTPRINT> {
    const REFILL: u32 = 16;
    const RISE: i32 = 3;
    const FOOTPRINT: bool = FOOTPRINT;

    #[inline(always)]
    fn next<L: Lanes>(&mut self, l: L, scene: &Scene, block: &mut Prepared) {
        let across = self.width.div_ceil(TILE);
        let tiles = across * (self.rows.end - self.rows.start).div_ceil(TILE);
        let cells = FINE as f32 * self.right.length() * scene.per_metre.max_element();
        block.count = 0;
        while block.count < BLOCK && self.tile < tiles {
            let (x, y) = (self.tile % across * TILE, self.rows.start + self.tile / across * TILE);
            if self.fine == 0 {
                self.survey(l, scene, x, y);
            }
            // Two by two, so that those that meet in the stream are neighbours.
            let (group, beam) = (self.fine / 4, self.fine % 4);
            let (bx, by) = (group % 8 * 2 + beam % 2, group / 8 * 2 + beam / 2);
            let fine = (by * (TILE / FINE) + bx) as usize;
            self.fine += 1;
            if self.fine as usize == FINE_IN_TILE {
                (self.fine, self.tile) = (0, self.tile + 1);
            }
            let (x, y) = (x + bx * FINE, y + by * FINE);
            let (start, level) = (self.starts[fine], self.levels[fine]);
            if x >= self.width || y >= self.rows.end {
                continue;
            }
            if start == f32::INFINITY {
                self.nothing(x, y);
            } else if start * cells > TOGETHER {
                for part in (0..16).step_by(L::COUNT) {
                    let ix = l.iadd(l.load_int(&PIXEL_X[part..]), l.int(x as i32));
                    let iy = l.iadd(l.load_int(&PIXEL_Y[part..]), l.int(y as i32));
                    let at = block.count + part;
                    self.prepare(l, scene, block, at, (ix, iy), l.splat(start), l.int(level));
                }
                block.count += 16;
            } else {
                self.walk(l, scene, (x, y), start, level);
                if self.left.count >= 16 {
                    self.take(l, scene, block);
                }
            }
        }
        if block.count < BLOCK && self.left.count > 0 {
            self.take(l, scene, block);
        }
    }

    #[inline(always)]
    fn done(&mut self, id: i32, distance: f32) {
        if let Some(place) = self.distances.get_mut(id as usize) {
            *place = distance;
        }
    }

    #[inline(always)]
    fn below(&mut self, id: i32) {
        if id != NOWHERE {
            self.below.push(id);
        }
    }
}
