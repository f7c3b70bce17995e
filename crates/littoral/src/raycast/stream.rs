//! Streams of independent rays: one ray a lane, each at its own level of the pyramid, lanes refilled as rays end.
//!
//! All lanes walk at once as in `walk.rs`: leave a node that lies wholly below the ray, else look closer. A lane that
//! has come down to a patch waits there until enough others have, since testing a patch costs several times a step. Three
//! packets take turns, so that one computes while others wait for memory.
//!
//! There are two kinds of rays. Those *over the surface* start above it on a land without voids: they need the highs
//! only, and being under the surface anywhere means that it was crossed. All others go by the *sheet*, where a crossing is
//! a change of sign within a patch, with the same care for lines between patches as in `walk.rs`.
//!
//! Works this rests on: A. Tevs et al., "Maximum mipmaps", I3D 2008; T. Aila, S. Laine, "Understanding the efficiency of
//! ray traversal on GPUs", HPG 2009 (lanes that wait, lanes refilled); I. Wald et al., "Embree", 2014.

use super::lanes::Lanes;
use super::scene::Scene;
use glam::Vec3;

/// A ray in `f32`, relative to an anchor that many share: 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LocalRay {
    /// Where it starts, from the anchor (m).
    pub origin: Vec3,
    /// How far it goes, in lengths of `direction`; infinity for no end.
    pub reach: f32,
    /// Where it goes; its length should lie between 10⁻⁶ and 10⁶ m.
    pub direction: Vec3,
    /// Its width at a distance of one length of `direction` (m), 0 for exact answers. Where the ray is as wide as a node of the
    /// range pyramid, the node's highest point answers for all of it: the method of the maximum mipmaps, for rays that stand
    /// for pixels.
    pub spread: f32,
}

impl LocalRay {
    /// A ray without an end.
    pub fn new(origin: Vec3, direction: Vec3) -> LocalRay {
        LocalRay { origin, reach: f32::INFINITY, direction, spread: 0.0 }
    }

    /// The segment from `from` to `to`, so that distances along it run from 0 to 1.
    pub fn between(from: Vec3, to: Vec3) -> LocalRay {
        LocalRay { origin: from, reach: 1.0, direction: to - from, spread: 0.0 }
    }
}

/// Rays prepared at a time.
pub(super) const BLOCK: usize = 64;
/// Room behind them, so that a whole vector can be read anywhere.
const ROOM: usize = BLOCK + 16;

/// Rays ready to walk, as arrays. Horizontal axes are mirrored so that both directions are positive.
pub(super) struct Prepared {
    pub count: usize,
    pub id: [i32; ROOM],
    /// Position (lattice units from the mirrored anchor cell; m), direction and its inverse.
    pub origin: [[f32; ROOM]; 3],
    pub direction: [[f32; ROOM]; 3],
    pub inverse: [[f32; ROOM]; 2],
    /// Where the walk starts, where the ray enters the map, and where it ends.
    pub t: [f32; ROOM],
    pub start: [f32; ROOM],
    pub end: [f32; ROOM],
    /// Sign bit if mirrored; what turns mirrored cells into those of the raster; the anchor's cell; the last cell.
    pub sign: [[i32; ROOM]; 2],
    pub mirror: [[i32; ROOM]; 2],
    pub base: [[i32; ROOM]; 2],
    pub last: [[i32; ROOM]; 2],
    pub cell: [[i32; ROOM]; 2],
    /// Level to begin with; −1 for rays that meet nothing.
    pub level: [i32; ROOM],
    /// Width at distance 1 (samples); looked at by walks by footprint only.
    pub spread: [f32; ROOM],
}

impl Prepared {
    pub fn new() -> Prepared {
        Prepared {
            count: 0,
            id: [0; ROOM],
            origin: [[0.0; ROOM]; 3],
            direction: [[0.0; ROOM]; 3],
            inverse: [[0.0; ROOM]; 2],
            t: [0.0; ROOM],
            start: [0.0; ROOM],
            end: [0.0; ROOM],
            sign: [[0; ROOM]; 2],
            mirror: [[0; ROOM]; 2],
            base: [[0; ROOM]; 2],
            last: [[0; ROOM]; 2],
            cell: [[0; ROOM]; 2],
            level: [0; ROOM],
            spread: [0.0; ROOM],
        }
    }

    /// Prepares lanes `at..at + COUNT` from positions and directions in metres from the anchor. `from` is the distance
    /// before which nothing can be met, `level` the level to begin with.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the numbers of a ray, each once")]
    pub fn set<L: Lanes>(
        &mut self,
        l: L,
        scene: &Scene,
        at: usize,
        id: L::I,
        origin: [L::F; 3],
        direction: [L::F; 3],
        reach: L::F,
        from: L::F,
        level: L::I,
    ) {
        let zero = l.splat(0.0);
        let infinity = l.splat(f32::INFINITY);
        // 0 · x is 0 unless x is infinite or NaN.
        let mut finite = zero;
        for axis in 0..3 {
            finite = l.add(finite, l.add(l.mul(zero, origin[axis]), l.mul(zero, direction[axis])));
        }
        let mut valid = l.and(l.le(zero, reach), l.le(finite, zero));
        let z = l.add(origin[2], l.splat(scene.height));
        let dz = direction[2];
        let tiny = l.splat(1e-20);

        // Between the lowest and highest height …
        let level_ray = l.lt(absolute(l, dz), tiny);
        let inverse = l.div(l.splat(1.0), l.select(level_ray, l.splat(1.0), dz));
        let (a, b) = (l.mul(l.sub(l.splat(scene.low), z), inverse), l.mul(l.sub(l.splat(scene.high), z), inverse));
        let outside = l.or(l.lt(z, l.splat(scene.low)), l.lt(l.splat(scene.high), z));
        valid = l.without(valid, l.and(level_ray, outside));
        let mut start = l.max(l.select(level_ray, zero, l.min(a, b)), zero);
        let mut end = l.min(l.select(level_ray, infinity, l.max(a, b)), reach);

        // … and over the map.
        let mut cells = [l.int(0); 2];
        let mut positions = [zero; 2];
        for axis in 0..2 {
            let q = l.add(l.mul(origin[axis], l.splat(scene.per_metre[axis])), l.splat(scene.offset[axis]));
            let w = l.mul(direction[axis], l.splat(scene.per_metre[axis]));
            let backward = l.lt(w, zero);
            let sign = l.iselect(backward, l.int(i32::MIN), l.int(0));
            let (mut q, mut w) = (l.flip(q, sign), l.flip(w, sign));
            let (side, count, cell) = (l.int(scene.side), l.int(scene.cells[axis]), l.int(scene.cell[axis]));
            let base = l.iselect(backward, l.isub(side, cell), cell);
            let first = l.iselect(backward, l.isub(side, count), l.int(0));
            let past = l.iselect(backward, side, count);
            let (low, high) = (l.float(l.isub(first, base)), l.float(l.isub(past, base)));
            // A ray that stands still along this axis never gets to the next line: its inverse is as good as infinite,
            // yet 0 times it is 0. On the far border it is nudged inside.
            let still = l.lt(w, tiny);
            w = l.select(still, zero, w);
            let inverse = l.select(still, l.splat(1e30), l.div(l.splat(1.0), l.select(still, l.splat(1.0), w)));
            let inside = l.and(l.le(low, q), l.le(q, high));
            valid = l.without(valid, l.without(still, inside));
            let nudge = l.mul(l.max(absolute(l, high), l.splat(1.0)), l.splat(2.4e-7));
            q = l.select(still, l.min(l.sub(high, nudge), q), q);
            let (enter, leave) = (l.mul(l.sub(low, q), inverse), l.mul(l.sub(high, q), inverse));
            start = l.max(l.select(still, zero, enter), start);
            end = l.min(l.select(still, infinity, leave), end);
            l.store(q, &mut self.origin[axis][at..]);
            l.store(w, &mut self.direction[axis][at..]);
            l.store(inverse, &mut self.inverse[axis][at..]);
            l.store_int(sign, &mut self.sign[axis][at..]);
            let mirror = l.iselect(backward, l.int(scene.side - 1), l.int(0));
            l.store_int(mirror, &mut self.mirror[axis][at..]);
            l.store_int(base, &mut self.base[axis][at..]);
            let last = l.isub(past, l.int(1));
            l.store_int(last, &mut self.last[axis][at..]);
            positions[axis] = q;
            cells[axis] = first;
        }
        let t = l.max(start, from);
        for axis in 0..2 {
            let base = l.load_int(&self.base[axis][at..]);
            let direction = l.load(&self.direction[axis][at..]);
            let here = l.iadd(l.floor(l.add(positions[axis], l.mul(t, direction))), base);
            let last = l.load_int(&self.last[axis][at..]);
            l.store_int(l.imax(l.imin(here, last), cells[axis]), &mut self.cell[axis][at..]);
        }
        valid = l.and(valid, l.le(t, end));
        // An end at infinity would be reached by rays straight up on a level … which the heights cut off. Not so NaN.
        valid = l.and(valid, l.lt(end, infinity));
        l.store(z, &mut self.origin[2][at..]);
        l.store(dz, &mut self.direction[2][at..]);
        l.store(t, &mut self.t[at..]);
        l.store(start, &mut self.start[at..]);
        l.store(end, &mut self.end[at..]);
        l.store_int(id, &mut self.id[at..]);
        l.store_int(l.iselect(valid, level, l.int(-1)), &mut self.level[at..]);
    }
}

/// Where rays come from and where their answers go.
pub(super) trait Rays {
    /// Lanes that must have ended before lanes are refilled, in sixteenths of all: neighbours end together and are best
    /// replaced together, strangers sooner.
    const REFILL: u32;
    /// Which lines lead to the coarser level, as bits of the line's number at the walk's level that must be 0: 1 for every
    /// line that ends a coarser node, 3 for every other one, better for rays that start near what they hit. All walks of
    /// one kind of rays must share it, since a ray that just touches the rim of a hole may be answered either way.
    const RISE: i32;
    /// Whether rays stop at nodes that they are as wide as.
    const FOOTPRINT: bool;

    /// Overwrites `block` with the next rays; `count` = 0 when there are none left.
    fn next<L: Lanes>(&mut self, l: L, scene: &Scene, block: &mut Prepared);
    /// The distance of the first hit, infinity for none.
    fn done(&mut self, id: i32, distance: f32);
    /// The ray started below the surface and must go by the sheet.
    fn below(&mut self, id: i32);
}

/// What a lane's result holds while the ray is found to start below the surface.
const BELOW: f32 = -1.0;
/// Lanes that must wait at patches before patches are tested, in sixteenths of all: more wastes waiting lanes, less wastes
/// whole tests. The optimum is flat.
const PATIENCE: u32 = 9;

/// As many rays as there are lanes.
#[derive(Clone, Copy)]
struct Packet<L: Lanes> {
    id: L::I,
    x: L::F,
    y: L::F,
    z: L::F,
    dx: L::F,
    dy: L::F,
    dz: L::F,
    inverse_x: L::F,
    inverse_y: L::F,
    t: L::F,
    start: L::F,
    end: L::F,
    sign_x: L::I,
    sign_y: L::I,
    mirror_x: L::I,
    mirror_y: L::I,
    base_x: L::I,
    base_y: L::I,
    last_x: L::I,
    last_y: L::I,
    cell_x: L::I,
    cell_y: L::I,
    /// Level of the node looked at next; 0 at a patch, −1 when done.
    level: L::I,
    spread: L::F,
    result: L::F,
    /// Lanes that hold a ray not yet delivered.
    occupied: u32,
}

impl<L: Lanes> Packet<L> {
    #[inline(always)]
    fn empty(l: L) -> Packet<L> {
        let (f, i) = (l.splat(0.0), l.int(0));
        Packet {
            id: i,
            x: f,
            y: f,
            z: f,
            dx: f,
            dy: f,
            dz: f,
            inverse_x: f,
            inverse_y: f,
            t: f,
            start: f,
            end: f,
            sign_x: i,
            sign_y: i,
            mirror_x: i,
            mirror_y: i,
            base_x: i,
            base_y: i,
            last_x: i,
            last_y: i,
            cell_x: i,
            cell_y: i,
            level: l.int(-1),
            spread: f,
            result: f,
            occupied: 0,
        }
    }

    /// Delivers the rays that are done and fills their lanes with new ones. Whether any lane is at work.
    #[inline(always)]
    fn turn_over<R: Rays>(
        &mut self,
        l: L,
        scene: &Scene,
        rays: &mut R,
        block: &mut Prepared,
        cursor: &mut usize,
    ) -> bool {
        let all = (1u32 << L::COUNT) - 1;
        let done = l.bits(l.igt(l.int(0), self.level));
        if done.count_ones() * 16 < R::REFILL * L::COUNT as u32 {
            return true;
        }
        let mut deliver = done & self.occupied;
        if deliver != 0 {
            let (mut ids, mut results) = ([0; 16], [0.0; 16]);
            l.store_int(self.id, &mut ids);
            l.store(self.result, &mut results);
            while deliver != 0 {
                let lane = deliver.trailing_zeros() as usize;
                if results[lane] == BELOW {
                    rays.below(ids[lane])
                } else {
                    rays.done(ids[lane], results[lane])
                }
                deliver &= deliver - 1;
            }
            self.occupied &= !done;
        }
        if *cursor == block.count {
            if block.count == 0 {
                return done != all;
            }
            *cursor = 0;
            rays.next(l, scene, block);
            if block.count == 0 {
                return done != all;
            }
        }
        let at = *cursor;
        let mut fill = done;
        while fill.count_ones() as usize > block.count - at {
            fill &= fill - 1;
        }
        *cursor += fill.count_ones() as usize;
        self.occupied |= fill;
        let m = l.mask(fill);
        self.id = l.expand_int(self.id, m, &block.id[at..]);
        self.x = l.expand(self.x, m, &block.origin[0][at..]);
        self.y = l.expand(self.y, m, &block.origin[1][at..]);
        self.z = l.expand(self.z, m, &block.origin[2][at..]);
        self.dx = l.expand(self.dx, m, &block.direction[0][at..]);
        self.dy = l.expand(self.dy, m, &block.direction[1][at..]);
        self.dz = l.expand(self.dz, m, &block.direction[2][at..]);
        self.inverse_x = l.expand(self.inverse_x, m, &block.inverse[0][at..]);
        self.inverse_y = l.expand(self.inverse_y, m, &block.inverse[1][at..]);
        self.t = l.expand(self.t, m, &block.t[at..]);
        self.start = l.expand(self.start, m, &block.start[at..]);
        self.end = l.expand(self.end, m, &block.end[at..]);
        self.sign_x = l.expand_int(self.sign_x, m, &block.sign[0][at..]);
        self.sign_y = l.expand_int(self.sign_y, m, &block.sign[1][at..]);
        self.mirror_x = l.expand_int(self.mirror_x, m, &block.mirror[0][at..]);
        self.mirror_y = l.expand_int(self.mirror_y, m, &block.mirror[1][at..]);
        self.base_x = l.expand_int(self.base_x, m, &block.base[0][at..]);
        self.base_y = l.expand_int(self.base_y, m, &block.base[1][at..]);
        self.last_x = l.expand_int(self.last_x, m, &block.last[0][at..]);
        self.last_y = l.expand_int(self.last_y, m, &block.last[1][at..]);
        self.cell_x = l.expand_int(self.cell_x, m, &block.cell[0][at..]);
        self.cell_y = l.expand_int(self.cell_y, m, &block.cell[1][at..]);
        self.level = l.expand_int(self.level, m, &block.level[at..]);
        if R::FOOTPRINT {
            self.spread = l.expand(self.spread, m, &block.spread[at..]);
        }
        self.result = l.select(m, l.splat(f32::INFINITY), self.result);
        true
    }

    /// One step of every lane: into, or past, a node or a patch.
    #[inline(always)]
    fn step<R: Rays, const SHEET: bool, const ANY: bool>(&mut self, l: L, scene: &Scene) {
        let (zero, one) = (l.int(0), l.int(1));
        let lines_x = Lines { base: self.base_x, origin: self.x, inverse: self.inverse_x };
        let lines_y = Lines { base: self.base_y, origin: self.y, inverse: self.inverse_y };
        let next_x = l.shl(l.iadd(l.shr(self.cell_x, self.level), one), self.level);
        let next_y = l.shl(l.iadd(l.shr(self.cell_y, self.level), one), self.level);
        let (tx, ty) = (lines_x.crossing(l, next_x), lines_y.crossing(l, next_y));
        let leave = l.max(l.min(l.min(tx, ty), self.end), self.t);
        let z0 = l.fused(self.t, self.dz, self.z);
        let z1 = l.fused(leave, self.dz, self.z);
        let (column, row) = (l.ixor(self.cell_x, self.mirror_x), l.ixor(self.cell_y, self.mirror_y));

        // Nodes: left where the ray is clear of them.
        let inner = l.igt(self.level, zero);
        let (mut clear, mut wide);
        {
            let line = l.imul(l.shr(row, self.level), l.lookup(&scene.strides, self.level));
            let node = l.iadd(l.iadd(line, l.shr(column, self.level)), l.lookup(&scene.offsets, self.level));
            // In steps of the pyramid.
            let per_step = l.splat(scene.per_step);
            let lowest = l.mul(l.sub(l.min(z0, z1), l.splat(scene.high_base)), per_step);
            // SAFETY: cells lie within the raster (kept by `Prepared::set` and the clamps below), so the node exists; the
            // arrays end with one number of padding.
            let high = l.float(unsafe { l.gather_u16(inner, scene.highs, node) });
            clear = l.lt(high, lowest);
            if SHEET {
                let highest = l.mul(l.sub(l.max(z0, z1), l.splat(scene.low_base)), per_step);
                // SAFETY: as above.
                let low = l.float(unsafe { l.gather_u16(inner, scene.lows, node) });
                clear = l.or(clear, l.or(l.lt(highest, low), l.lt(high, low)));
            }
            wide = l.mask(0);
            if R::FOOTPRINT {
                // As wide as the node, and on its way into it: met where it comes down to the top.
                let side = l.float(l.shl(one, self.level));
                let high = l.add(l.mul(high, l.splat(scene.step)), l.splat(scene.high_base));
                wide = l.and(l.without(inner, clear), l.le(side, l.mul(self.spread, self.t)));
                let falls = l.and(l.lt(self.dz, l.splat(0.0)), l.lt(high, z0));
                let down = l.div(l.sub(high, self.z), l.select(falls, self.dz, l.splat(-1.0)));
                let met = l.select(falls, l.max(l.min(down, leave), self.t), self.t);
                self.result = l.select(wide, met, self.result);
            }
        }
        let mut advance = l.and(inner, clear);
        let mut hit = l.mask(0);
        let patches = l.ieq(self.level, zero);
        let (waiting, walking) = (l.bits(patches), l.bits(inner));
        if waiting != 0 && (walking == 0 || waiting.count_ones() * 16 >= PATIENCE * L::COUNT as u32) {
            let here = l.iadd(l.imul(row, l.int(scene.columns)), column);
            // SAFETY: the patch exists, as above; it has a sample east, north and north-east of this one.
            let ((a, b), (c, d)) = unsafe {
                let there = l.iadd(here, l.int(scene.columns));
                (l.gather_pair(patches, scene.heights, here), l.gather_pair(patches, scene.heights, there))
            };
            let (u0, v0, u1, v1, f0, f1);
            let east = l.sub(b, a);
            let north = l.sub(c, a);
            let twist = l.sub(l.sub(d, c), east);
            if SHEET {
                let x_lines = (lines_x.crossing(l, self.cell_x), lines_x.crossing(l, l.iadd(self.cell_x, one)));
                let y_lines = (lines_y.crossing(l, self.cell_y), lines_y.crossing(l, l.iadd(self.cell_y, one)));
                let x = (self.x, self.dx, l.float(l.isub(self.cell_x, self.base_x)));
                let y = (self.y, self.dy, l.float(l.isub(self.cell_y, self.base_y)));
                u0 = within(l, x_lines, x, self.sign_x, self.t);
                u1 = within(l, x_lines, x, self.sign_x, leave);
                v0 = within(l, y_lines, y, self.sign_y, self.t);
                v1 = within(l, y_lines, y, self.sign_y, leave);
                f0 = l.sub(z0, blend(l, [a, b, c, d], u0, v0));
                f1 = l.sub(z1, blend(l, [a, b, c, d], u1, v1));
            } else {
                let (from_x, from_y) =
                    (l.float(l.isub(column, l.int(scene.cell[0]))), l.float(l.isub(row, l.int(scene.cell[1]))));
                u0 = l.sub(l.flip(l.fused(self.t, self.dx, self.x), self.sign_x), from_x);
                v0 = l.sub(l.flip(l.fused(self.t, self.dy, self.y), self.sign_y), from_y);
                u1 = l.sub(l.flip(l.fused(leave, self.dx, self.x), self.sign_x), from_x);
                v1 = l.sub(l.flip(l.fused(leave, self.dy, self.y), self.sign_y), from_y);
                f0 = l.fused_from(v0, l.fused(twist, u0, north), l.fused_from(east, u0, l.sub(z0, a)));
                f1 = l.fused_from(v1, l.fused(twist, u1, north), l.fused_from(east, u1, l.sub(z1, a)));
            }
            // f(s) = f0 + slope·s + bend·s², seen from above.
            let nought = l.splat(0.0);
            let sign = if SHEET { l.iselect(l.lt(f0, nought), l.int(i32::MIN), zero) } else { zero };
            let (g0, g1) = if SHEET { (l.flip(f0, sign), l.flip(f1, sign)) } else { (f0, f1) };
            let bend = l.mul(l.mul(l.sub(nought, twist), l.sub(u1, u0)), l.sub(v1, v0));
            let bend = if SHEET { l.flip(bend, sign) } else { bend };
            let slope = l.sub(l.sub(g1, g0), bend);
            let disc = l.fused_from(l.mul(l.splat(4.0), bend), g0, l.mul(slope, slope));
            let dips = l.and(l.lt(nought, bend), l.lt(slope, nought));
            let dips = l.and(dips, l.and(l.lt(nought, l.add(slope, l.add(bend, bend))), l.le(nought, disc)));
            hit = l.and(patches, l.or(l.or(l.le(g1, nought), l.le(g0, nought)), dips));
            if SHEET && !scene.voids.is_empty() {
                let (mut columns, mut rows) = ([0; 16], [0; 16]);
                l.store_int(column, &mut columns);
                l.store_int(row, &mut rows);
                let mut bits = l.bits(hit);
                let mut real = bits;
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize;
                    real &= !(u32::from(scene.is_void(columns[lane], rows[lane])) << lane);
                    bits &= bits - 1;
                }
                hit = l.mask(real);
            }
            advance = l.or(advance, l.without(patches, hit));
            if l.bits(hit) != 0 {
                let below = l.and(l.lt(f0, nought), l.le(self.t, self.start));
                let distance = if ANY {
                    leave
                } else {
                    // The smaller positive root, without a difference of nearly equal numbers.
                    let (root, falls) = (l.sqrt(l.max(disc, nought)), l.lt(slope, nought));
                    let above = l.select(falls, l.add(g0, g0), l.add(slope, root));
                    let root = l.div(above, l.select(falls, l.sub(root, slope), l.mul(l.splat(-2.0), bend)));
                    // Below already on entry, or 0/0: at the entry.
                    let root = l.select(l.lt(nought, g0), l.min(root, l.splat(1.0)), nought);
                    l.fused(root, l.sub(leave, self.t), self.t)
                };
                let result = if SHEET { distance } else { l.select(below, l.splat(BELOW), distance) };
                self.result = l.select(hit, result, self.result);
            }
        }

        // Across the nearer line; the other coordinate follows, but never back nor out of the node or the map.
        let x_first = l.le(tx, ty);
        let mut follow_x = l.iadd(l.floor(l.fused(leave, self.dx, self.x)), self.base_x);
        let mut follow_y = l.iadd(l.floor(l.fused(leave, self.dy, self.y)), self.base_y);
        if SHEET {
            // What counts is the crossing, not the rounded position.
            follow_x = l.iselect(l.lt(leave, lines_x.crossing(l, follow_x)), l.isub(follow_x, one), follow_x);
            follow_x =
                l.iselect(l.le(lines_x.crossing(l, l.iadd(follow_x, one)), leave), l.iadd(follow_x, one), follow_x);
            follow_y = l.iselect(l.lt(leave, lines_y.crossing(l, follow_y)), l.isub(follow_y, one), follow_y);
            follow_y =
                l.iselect(l.le(lines_y.crossing(l, l.iadd(follow_y, one)), leave), l.iadd(follow_y, one), follow_y);
        }
        let follow_x = l.imax(l.imin(follow_x, l.imin(self.last_x, l.isub(next_x, one))), self.cell_x);
        let follow_y = l.imax(l.imin(follow_y, l.imin(self.last_y, l.isub(next_y, one))), self.cell_y);
        let line = l.iselect(x_first, next_x, next_y);
        self.cell_x = l.iselect(advance, l.iselect(x_first, next_x, follow_x), self.cell_x);
        self.cell_y = l.iselect(advance, l.iselect(x_first, follow_y, next_y), self.cell_y);
        self.t = l.select(advance, leave, self.t);

        // A level up where the line ends the coarser node as well, down into nodes that are in the way.
        let ends = l.ieq(l.iand(line, l.shl(l.int(R::RISE), self.level)), zero);
        let up = l.and(l.and(advance, ends), l.igt(l.int(scene.top), self.level));
        let finished = l.or(l.or(hit, wide), l.and(advance, l.le(self.end, leave)));
        let mut level = l.iselect(up, l.iadd(self.level, one), self.level);
        level = l.iselect(l.without(inner, clear), l.isub(self.level, one), level);
        self.level = l.iselect(finished, l.int(-1), level);
    }
}

/// The size of a number. (Functions rather than closures throughout the kernels: a closure is compiled by itself, without
/// the features of the function around it.)
#[inline(always)]
pub(super) fn absolute<L: Lanes>(l: L, a: L::F) -> L::F {
    l.max(a, l.sub(l.splat(0.0), a))
}

/// The lines between cells along one axis, and the ray's way across them.
struct Lines<L: Lanes> {
    base: L::I,
    origin: L::F,
    inverse: L::F,
}

impl<L: Lanes> Lines<L> {
    /// The distance at which the ray crosses a line: always this one expression.
    #[inline(always)]
    fn crossing(&self, l: L, line: L::I) -> L::F {
        l.mul(l.sub(l.float(l.isub(line, self.base)), self.origin), self.inverse)
    }
}

/// The bilinear height in the form that is exact on the lines between patches.
#[inline(always)]
pub(super) fn blend<L: Lanes>(l: L, [a, b, c, d]: [L::F; 4], u: L::F, v: L::F) -> L::F {
    let (west, south) = (l.sub(l.splat(1.0), u), l.sub(l.splat(1.0), v));
    let at_south = l.add(l.mul(a, west), l.mul(b, u));
    let at_north = l.add(l.mul(c, west), l.mul(d, u));
    l.add(l.mul(at_south, south), l.mul(at_north, v))
}

/// Position within a cell at distance `t`, exactly 0 or 1 on its lines, turned back into that of the raster: `lines` are
/// the distances at which they are crossed, `axis` the ray's origin and direction and the cell.
#[inline(always)]
fn within<L: Lanes>(l: L, lines: (L::F, L::F), axis: (L::F, L::F, L::F), sign: L::I, t: L::F) -> L::F {
    let (nought, unit) = (l.splat(0.0), l.splat(1.0));
    let position = l.sub(l.add(axis.0, l.mul(t, axis.1)), axis.2);
    let position = l.min(l.max(position, nought), unit);
    let position = l.select(l.le(lines.1, t), unit, position);
    let position = l.select(l.le(t, lines.0), nought, position);
    l.select(l.igt(l.int(0), sign), l.sub(unit, position), position)
}

/// Walks all rays of `rays`.
#[inline(always)]
pub(super) fn run<L: Lanes, R: Rays, const SHEET: bool, const ANY: bool>(l: L, scene: &Scene, rays: &mut R) {
    let mut block = Prepared::new();
    let mut cursor = 0;
    rays.next(l, scene, &mut block);
    let mut packets = [Packet::empty(l); 3];
    loop {
        let mut busy = false;
        for packet in &mut packets {
            busy |= packet.turn_over(l, scene, rays, &mut block, &mut cursor);
            packet.step::<R, SHEET, ANY>(l, scene);
        }
        if !busy {
            break;
        }
    }
}
