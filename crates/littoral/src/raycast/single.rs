//! One ray at a time: its way through 64 nodes, or through the 16 patches of each of two, decided by one comparison.
//!
//! Along its major axis a ray crosses a column of nodes in at most two rows: the one it enters and the one it leaves by. So
//! eight columns of a block are sixteen nodes in the order of the way, and the first of them that reaches up to the ray is
//! where to look closer: in the 8 × 8 nodes below it or, at the end, in its 4 × 4 patches and in those of the next such node,
//! eight pieces of the way each. Blocks left without a hit are taken up again where they were left. The walk begins at a block
//! of the middle level and climbs only when it must: looking for a better one costs more than it saves, and a ray that falls
//! through half of the ground's heights within a block goes on to the next.
//!
//! The way is told by the position s along the major axis, in which lines between cells are integers. Lattice axes are
//! mirrored so that both directions are positive, and everything counts from a corner of nodes near the anchor.
//!
//! The kernel is for rays that start above a surface without holes: being under it anywhere means that it was crossed, so
//! that nothing slips through where rounding hides a sliver of a node or a patch. Rays that come into a patch from below,
//! be it because they started there or through such a sliver, are left to the `f64` walk, and so are steep ones, for
//! which s says too little.
//!
//! Each step waits for the one before it, so that what counts is how many instructions there are: the processor begins the
//! next ray while it waits. Hence numbers of the ray lie in memory, where an instruction reads and spreads them at once;
//! levels are pointers that move; what the walk itself has checked is not checked again.
//!
//! Works this rests on: A. Tevs et al., "Maximum mipmaps", I3D 2008; I. Wald et al., "Getting rid of packets: efficient SIMD
//! single-ray traversal using multi-branching BVHs", RT 2008 (one ray against many nodes).

#[cfg(target_arch = "x86_64")]
#[allow(
    clippy::undocumented_unsafe_blocks,
    reason = "every block but those that say so has the same: a value of the type proves the features"
)]
mod x86;

use super::Simd;
use super::scene::Scene;
use super::stream::LocalRay;
use crate::field::{BLOCK_LEVELS, Block, Land};
use glam::{BVec4A, Vec4, Vec4Swizzles};
use std::mem::MaybeUninit;

/// Rays that fall or rise more than this many metres for each metre along their major axis count as steep.
const STEEP: f32 = 16.0;

/// Patches along an axis beyond which `f32` tells cells apart too badly.
const MOST_PATCHES: i32 = 1 << 20;

/// A land as this kernel sees it.
#[derive(Clone, Debug)]
pub(super) struct Single<'a> {
    /// By the signs of the direction, bit 0 for x; those whose major axis is y come last.
    octants: [Octant; 16],
    /// Lattice units per metre and the anchor's position (lattice units from the corner; m).
    scale: Vec4,
    offset: Vec4,
    /// Steps of the pyramid per metre, and the height of step 0 with a hair of slack (m).
    per_step: Vec4,
    base: Vec4,
    floors: [Floor<'a>; BLOCK_LEVELS],
    /// The level to begin at.
    begin: usize,
    heights: &'a [f32],
    columns: usize,
    /// Patches along x and y.
    patches: [i32; 2],
    /// Along x and y, the 4 × 4 patches with 8 samples to a row.
    whole: [usize; 2],
}

/// A shift of vectors: 64 bits, and as many that do not matter.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
struct Shift {
    low: i32,
    high: [i32; 3],
}

/// A level of blocks.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
struct Floor<'a> {
    blocks: &'a [Block],
    /// Blocks along x and y.
    size: [usize; 2],
    /// The corner that cells count from, also when mirrored: node n of the raster is node n − corner, or corner − 1 − n.
    corner: [i32; 2],
    /// Binary logarithm of a node's side, as vectors are shifted, and the side (cells).
    shift: Shift,
    side: f32,
    last: bool,
    /// Where its columns begin, each twice (cells from the first).
    columns: Columns,
}

/// What the direction of a ray makes of the map. Pairs are along x and y, or along the major and the minor axis.
#[derive(Clone, Copy, Debug)]
struct Octant {
    /// The map's box mirrored, from the corner and from height 0.
    low: Vec4,
    high: Vec4,
    /// Its first and last cells along the major and the minor axis.
    first: [f32; 2],
    last: [f32; 2],
    /// Climb (m per lattice unit) beyond which rays are steep.
    steep: f32,
    /// Half of all that the ground's heights differ by (m).
    relief: f32,
    /// For the major and the minor axis: all ones where the ray runs backward.
    mirror: [i32; 2],
    /// Samples from one row to the next, and from the first of 4 × 4 patches to the row to begin with.
    line: isize,
    start: isize,
    tables: &'static Tables,
    /// All ones if rays fall.
    falls: u16,
}

/// A ray on its way, mirrored. The position s along the major axis is what everything depends on. Vectors are along x, y
/// and z; what they say about the major axis is not used.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct Way {
    /// Position at s = 0 and its change with s; the same with heights in steps of the pyramid; the change of s with it.
    at: Vec4,
    rate: Vec4,
    steps: Vec4,
    steps_rate: Vec4,
    inverse: Vec4,
    /// Where the way begins and ends, and where it has come to.
    start: f32,
    end: f32,
    from: f32,
}

impl Way {
    /// Row at s = 0 and its change with s.
    #[inline(always)]
    fn row<const X: bool>(&self) -> (f32, f32) {
        if X { (self.at.y, self.rate.y) } else { (self.at.x, self.rate.x) }
    }

    /// Change of s with the row.
    #[inline(always)]
    fn inverse_slope<const X: bool>(&self) -> f32 {
        if X { self.inverse.y } else { self.inverse.x }
    }
}

/// Tables for one way of mirroring.
#[repr(C, align(64))]
#[derive(Debug)]
struct Tables {
    /// The part of a node's index in its block that the column makes.
    nodes: Rows,
    /// The part of a sample's index among 8 to a line that the major axis makes, on this side along x and on the other.
    samples: [Rows; 2],
    /// Column and row of the pieces of the way through 4 × 4 patches, twice.
    columns: Columns,
    rows: Columns,
    one: f32,
    four: i32,
    eight: i32,
}

/// Rows of the nodes of a block along the way, column after column: entered, left.
#[repr(align(64))]
#[derive(Clone, Copy, Debug)]
struct Rows([i32; 16]);

/// By (major axis is y) · 4 + (y, x mirrored).
static TABLES: [Tables; 8] = {
    let mut tables = [const {
        Tables {
            nodes: Rows([0; 16]),
            samples: [Rows([0; 16]); 2],
            columns: Columns([0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]),
            rows: Columns([0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]),
            one: 1.0,
            four: 4,
            eight: 8,
        }
    }; 8];
    let mut table = 0;
    while table < 8 {
        let mirror = (if table & 1 != 0 { 7 } else { 0 }) | (if table & 2 != 0 { 56 } else { 0 });
        let mut lane = 0;
        while lane < 16 {
            let column = lane as i32 / 2;
            tables[table].nodes.0[lane] = (if table & 4 == 0 { column } else { 8 * column }) ^ mirror;
            let mut side = 0;
            while side < 2 {
                let column = column % 4;
                let mirrored = table & 1 != 0;
                tables[table].samples[side].0[lane] = if table & 4 == 0 {
                    if mirrored { 4 - column - side as i32 } else { column + side as i32 }
                } else {
                    8 * column + if mirrored { 1 - side as i32 } else { side as i32 }
                };
                side += 1;
            }
            lane += 1;
        }
        table += 1;
    }
    tables
};

/// A hit within 4 × 4 patches: where, and whether the ray came into the patch from below.
#[derive(Clone, Copy)]
struct Met {
    s: f32,
    below: bool,
}

/// The two looks and what comes before them, for one set of instructions; all give the same bits.
trait Looks: Copy {
    /// a · b + c, rounded once.
    fn fused(self, a: Vec4, b: Vec4, c: Vec4) -> Vec4;

    /// The whole number below.
    ///
    /// # Safety
    /// It is an `i32`.
    unsafe fn floor(self, number: f32) -> i32;

    /// Which of the sixteen nodes along the way through a block, whose columns begin at `first`, reach up to the ray, as bits.
    ///
    /// # Safety
    /// The frame, whose node is set, is the caller's; its rows and columns are written.
    unsafe fn nodes<const X: bool>(
        self,
        octant: &Octant,
        way: &Way,
        floor: &Floor,
        first: &f32,
        block: &Block,
        frame: *mut Frame,
    ) -> u32;

    /// The first hit within the 4 × 4 patches of two nodes, one after the other, which may be the same.
    fn patches<const X: bool>(self, land: &Single, octant: &Octant, way: &Way, nodes: [Node; 2]) -> Option<Met>;
}

/// A node of the first level: where its columns begin (cells), its row, and what it is of the raster's.
#[derive(Clone, Copy)]
struct Node<'a> {
    first: &'a f32,
    row: &'a i32,
    x: usize,
    y: usize,
}

impl<'a> Single<'a> {
    /// `None` where the kernel does not apply: lands with voids and giants.
    pub fn new(land: &'a Land, scene: &Scene<'a>) -> Option<Single<'a>> {
        if !scene.voids.is_empty() || scene.cells.iter().any(|&cells| cells > MOST_PATCHES) {
            return None;
        }
        let blocks = &land.ranges().blocks;
        // The corner: of nodes of every level, so that they are whole numbers.
        let node = 4 << (3 * (blocks.levels.len() - 1));
        let corner = scene.cell.map(|cell| cell & -node);
        let octants = std::array::from_fn(|index| {
            let (signs, x) = (index & 7, index < 8);
            let mut octant = Octant {
                low: Vec4::ZERO,
                high: Vec4::ZERO,
                first: [0.0; 2],
                last: [0.0; 2],
                steep: 0.0,
                relief: 0.5 * (scene.high - scene.low),
                mirror: [0; 2],
                line: 0,
                start: 0,
                falls: 0,
                tables: &TABLES[signs & 3 | if x { 0 } else { 4 }],
            };
            for axis in 0..2 {
                let (cells, corner) = (scene.cells[axis], corner[axis]);
                let backward = signs >> axis & 1 == 1;
                let first = if backward { corner - cells } else { -corner };
                (octant.low[axis], octant.high[axis]) = (first as f32, (first + cells) as f32);
                let rank = axis ^ usize::from(!x);
                (octant.first[rank], octant.last[rank]) = (first as f32, (first + cells - 1) as f32);
                octant.mirror[rank] = -i32::from(backward);
            }
            octant.steep = STEEP / if x { scene.per_metre.x } else { scene.per_metre.y };
            let falls = signs & 4 == 4;
            (octant.low.z, octant.high.z) = if falls { (scene.high, scene.low) } else { (scene.low, scene.high) };
            let columns = scene.columns as isize;
            (octant.line, octant.start) = if signs & 2 == 2 { (-columns, 4 * columns) } else { (columns, 0) };
            octant.falls = if falls { 0xFFFF } else { 0 };
            octant
        });
        let floors = std::array::from_fn(|k| {
            let shift = 2 + 3 * k;
            let level = blocks.levels.get(k).copied().unwrap_or_default();
            Floor {
                blocks: &blocks.blocks[level.offset..level.offset + level.columns * level.rows],
                size: [level.columns, level.rows],
                corner: corner.map(|corner| corner >> shift),
                shift: Shift { low: shift as i32, high: [0; 3] },
                side: (1 << shift) as f32,
                last: k + 1 == blocks.levels.len(),
                columns: Columns(std::array::from_fn(|lane| ((lane / 2) << shift) as f32)),
            }
        });
        Some(Single {
            octants,
            scale: Vec4::new(scene.per_metre.x, scene.per_metre.y, 1.0, 0.0),
            offset: Vec4::new(
                scene.offset.x + (scene.cell[0] - corner[0]) as f32,
                scene.offset.y + (scene.cell[1] - corner[1]) as f32,
                scene.height,
                0.0,
            ),
            per_step: Vec4::splat(1.0 / scene.step),
            base: Vec4::splat(scene.high_base),
            floors,
            begin: (blocks.levels.len() - 1).min(1),
            heights: scene.heights,
            columns: scene.columns as usize,
            patches: scene.cells,
            whole: [((scene.cells[0] + 1) / 4).max(1) as usize - 1, scene.cells[1] as usize / 4],
        })
    }

    /// The distance of a ray's first hit, infinity for none; NaN for rays that are left to the `f64` walk.
    #[inline]
    pub fn first_hit(&self, simd: Simd, ray: &LocalRay) -> f32 {
        #[cfg(target_arch = "x86_64")]
        match simd {
            // SAFETY: `RayCaster` holds only instructions that are available.
            Simd::Avx512 => return unsafe { x86::first_hit(self, ray) },
            // SAFETY: as above.
            Simd::Avx2 => return unsafe { x86::portable(self, ray) },
            Simd::Portable => {}
        }
        let _ = simd;
        self.portable(ray)
    }

    #[inline(never)]
    fn portable(&self, ray: &LocalRay) -> f32 {
        self.walk(Portable, ray)
    }

    #[inline(always)]
    fn walk<L: Looks>(&self, looks: L, ray: &LocalRay) -> f32 {
        let [origin, direction]: &[[f32; 4]; 2] = bytemuck::cast_ref(ray);
        let (origin, direction) = (Vec4::from_array(*origin), Vec4::from_array(*direction));
        // What the fourth numbers come to does not matter.
        let place = looks.fused(origin, self.scale, self.offset);
        let direction = direction * self.scale;
        // By comparison: a zero with a sign runs forward.
        let backward = direction.cmplt(Vec4::ZERO);
        let signs = backward.bitmask() as usize & 7;
        let size = direction.abs();
        // Heights are not mirrored.
        let level = BVec4A::new(true, true, false, false);
        let at = Vec4::select(backward & level, -place, place);
        let inverse = Vec4::ONE / size.max(Vec4::splat(1e-20));
        let ends = Vec4::select(backward & !level, -inverse, inverse);
        let along = Vec4::select(level, size, direction);
        if size.x >= size.y {
            self.follow::<L, true>(looks, &self.octants[signs], origin, at, along, [inverse, ends])
        } else {
            self.follow::<L, false>(looks, &self.octants[8 + signs], origin, at, along, [inverse, ends])
        }
    }

    /// Follows a ray, mirrored, which is given by its position and direction along x, y and z and by the inverse of the
    /// direction's size, without and with the sign along z. Its major axis is x if `X` and y otherwise; its reach is the fourth number of `origin`.
    #[inline(always)]
    #[allow(clippy::neg_cmp_op_on_partial_ord, reason = "NaN is to fail")]
    fn follow<L: Looks, const X: bool>(
        &self,
        looks: L,
        octant: &Octant,
        origin: Vec4,
        at: Vec4,
        size: Vec4,
        [inverse, ends]: [Vec4; 2],
    ) -> f32 {
        let enter = ((octant.low - at) * ends).with_w(0.0);
        let leave = ((octant.high - at) * ends).with_w(origin.w);
        let (enter, leave) = (enter.max(enter.zwzw()), leave.min(leave.zwzw()));
        let (start, end) = (more(enter.x, enter.y), less(leave.x, leave.y));
        // What is not finite meets nothing in the `f64` walk; here it fails this comparison or a later one.
        if !(start < end) {
            return if start > end { f32::INFINITY } else { f32::NAN };
        }
        let (major, along, inverse_major) =
            if X { (at.xxxx(), size.xxxx(), inverse.xxxx()) } else { (at.yyyy(), size.yyyy(), inverse.yyyy()) };
        let rate = size * inverse_major;
        let base = looks.fused(-rate, major, at);
        if rate.z.abs() > octant.steep {
            return f32::NAN;
        }
        // A branch that is foreseen costs less than waiting for the sums.
        let mut begin = if X { [at.x, at.y] } else { [at.y, at.x] };
        if start > 0.0 {
            branch();
            begin[0] = start.mul_add(along.x, begin[0]);
            begin[1] = start.mul_add(if X { size.y } else { size.x }, begin[1]);
        }
        let mut way = Way {
            at: base,
            rate,
            steps: (base - self.base) * self.per_step,
            steps_rate: rate * self.per_step,
            inverse: along * inverse,
            start: begin[0],
            end: end.mul_add(along.x, major.x),
            from: begin[0],
        };
        let cell = |axis: usize| {
            let at = more(less(begin[axis], octant.last[axis]), octant.first[axis]);
            // SAFETY: just made to fit, NaN too.
            unsafe { looks.floor(at) }
        };
        let cell = [cell(0), cell(1)];

        // A level and its frame move together between the first level and the last there is. `highest` is the frame of the
        // coarsest block begun; those from there down to the current one have been written.
        let mut frames = [MaybeUninit::<Frame>::uninit(); BLOCK_LEVELS];
        let first = frames.as_mut_ptr().cast::<Frame>();
        // SAFETY: `begin` is a level.
        let (mut floor, mut frame) = unsafe { (self.floors.as_ptr().add(self.begin), first.add(self.begin)) };
        let mut highest = frame;
        // The node to look around next; then the first of the block.
        // SAFETY: `floor` points to a level, here and everywhere below.
        let mut node = cell.map(|cell| cell >> unsafe { (*floor).shift.low });
        let (mut edge, mut column);
        loop {
            // SAFETY: as above.
            let here = unsafe { &*floor };
            let [i, j] = here.raster::<X>(octant, node);
            let (mut x, mut y) = (i >> 3, j >> 3);
            if x >= here.size[0] || y >= here.size[1] {
                return f32::INFINITY;
            }
            let inner = if X { [i, j] } else { [j, i] };
            node = [0, 1].map(|axis| node[axis] - ((inner[axis] as i32 ^ octant.mirror[axis]) & 7));
            edge = (node[0] << here.shift.low) as f32;
            column = &edge;
            'blocks: loop {
                // SAFETY: there is such a block: the outermost was looked for just now, and one below a node is there because the
                // node has a high, which only nodes with patches have. The frame is this level's.
                let mut mask = unsafe {
                    let floor = &*floor;
                    let block = floor.blocks.get_unchecked(y * floor.size[0] + x);
                    (*frame).node = node;
                    looks.nodes::<X>(octant, &way, floor, column, block, frame)
                };
                // The next node on the way: of this block, or of one above it.
                loop {
                    if mask != 0 {
                        let lane = mask.trailing_zeros() as usize;
                        mask &= mask - 1;
                        let row;
                        // SAFETY: masks have sixteen bits, and as many rows and columns were written. Above the first level there
                        // is one below.
                        unsafe {
                            let here = &*floor;
                            column = &*(&raw const (*frame).columns).cast::<f32>().add(lane);
                            row = &*(&raw const (*frame).rows).cast::<i32>().add(lane);
                            let below = [(*frame).node[0] + lane as i32 / 2, *row];
                            [x, y] = here.raster::<X>(octant, below);
                            if here.shift.low > 2 {
                                (*frame).mask = mask;
                                (frame, floor) = (frame.sub(1), floor.sub(1));
                                node = [8 * below[0], 8 * below[1]];
                                continue 'blocks;
                            }
                        }
                        // The next one, if there is one, is looked at as well: mostly the ray gets there.
                        let other = if mask == 0 { lane } else { mask.trailing_zeros() as usize };
                        mask &= mask.wrapping_sub(1);
                        // SAFETY: as above.
                        let other = unsafe {
                            let first = &*(&raw const (*frame).columns).cast::<f32>().add(other);
                            let row = &*(&raw const (*frame).rows).cast::<i32>().add(other);
                            let [x, y] = (*floor).raster::<X>(octant, [(*frame).node[0] + other as i32 / 2, *row]);
                            Node { first, row, x, y }
                        };
                        let nodes = [Node { first: column, row, x, y }, other];
                        if let Some(met) = looks.patches::<X>(self, octant, &way, nodes) {
                            let distance = more((met.s - major.x) * inverse_major.x, 0.0);
                            return if met.below { f32::NAN } else { distance };
                        }
                    } else if frame < highest {
                        // SAFETY: the levels up to the highest have been begun.
                        unsafe {
                            (frame, floor) = (frame.add(1), floor.add(1));
                            mask = (*frame).mask;
                        }
                    } else {
                        break 'blocks;
                    }
                }
            }
            // On from where the ray leaves the block: one level up, or to the next block of the coarsest.
            // SAFETY: as above; there is one level more unless this is the last.
            unsafe {
                node = (*frame).node;
                let next = node.map(|node| node + 8);
                let line = next.map(|node| (node << (*floor).shift.low) as f32);
                let (at_column, at_row) = (line[0], (line[1] - way.row::<X>().0) * way.inverse_slope::<X>());
                way.from = more(way.from, less(at_column, at_row));
                if way.from >= way.end {
                    return f32::INFINITY;
                }
                // A ray that falls or rises so fast is soon through: it needs no larger blocks.
                if !(*floor).last && 8.0 * (*floor).side * way.rate.z.abs() <= octant.relief {
                    (frame, floor) = (frame.add(1), floor.add(1));
                    highest = frame;
                    node = node.map(|node| node >> 3);
                } else if at_row < at_column {
                    node[1] = next[1];
                } else {
                    node[0] = next[0];
                }
            }
        }
    }
}

/// A block under way, to come back to.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct Frame {
    /// Of the nodes along the way: where their column begins (cells), and their row.
    columns: Columns,
    rows: Rows,
    /// The first node, along the major and the minor axis.
    node: [i32; 2],
    /// Those to look at.
    mask: u32,
}

/// Sixteen numbers.
#[repr(align(64))]
#[derive(Clone, Copy, Debug)]
struct Columns([f32; 16]);

impl Floor<'_> {
    /// The raster's node, along x and y, that a mirrored one is.
    #[inline(always)]
    fn raster<const X: bool>(&self, octant: &Octant, [major, minor]: [i32; 2]) -> [usize; 2] {
        let (major, minor) = (major ^ octant.mirror[0], minor ^ octant.mirror[1]);
        let [x, y] = if X { [major, minor] } else { [minor, major] };
        [(x + self.corner[0]) as u32 as usize, (y + self.corner[1]) as u32 as usize]
    }
}

/// The looks in plain Rust, piece after piece of the way.
#[derive(Clone, Copy)]
struct Portable;

/// Keeps the branch that it stands in a branch: the compiler would select, and selecting waits for both sides.
#[inline(always)]
fn branch() {
    std::hint::black_box(());
}

#[inline(always)]
fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn more(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Looks for Portable {
    #[inline(always)]
    fn fused(self, a: Vec4, b: Vec4, c: Vec4) -> Vec4 {
        a.mul_add(b, c)
    }

    #[inline(always)]
    unsafe fn floor(self, number: f32) -> i32 {
        number.floor() as i32
    }

    #[inline(always)]
    unsafe fn nodes<const X: bool>(
        self,
        octant: &Octant,
        way: &Way,
        floor: &Floor,
        first: &f32,
        block: &Block,
        frame: *mut Frame,
    ) -> u32 {
        // SAFETY: the caller's, and its node is set.
        let first_row = unsafe { (*frame).node[1] };
        let (mut rows, mut columns) = ([0; 16], [0.0; 16]);
        let (row_at, slope) = way.row::<X>();
        let mut mask = 0;
        for lane in 0..16 {
            let column = first + floor.columns.0[lane];
            columns[lane] = column;
            let (enter, leave) = (more(column, way.from), less(column + floor.side, way.end));
            let edge = if lane & 1 == 0 { enter } else { leave };
            let row = slope.mul_add(edge, row_at).floor() as i32 >> floor.shift.low;
            rows[lane] = row;
            let lowest = way.steps_rate.z.mul_add(if octant.falls != 0 { leave } else { enter }, way.steps.z);
            let within = row.wrapping_sub(first_row);
            let index = octant.tables.nodes.0[lane] ^ if X { within.wrapping_mul(8) } else { within };
            let twin = lane & 1 == 1 && rows[lane - 1] == row;
            let high = block.0[index as usize & 63];
            let blocked = (0..8).contains(&within) && enter < leave && !twin && more(lowest, 1.0) <= f32::from(high);
            mask |= u32::from(blocked) << lane;
        }
        // SAFETY: the caller's.
        unsafe { ((*frame).rows, (*frame).columns) = (Rows(rows), Columns(columns)) };
        mask
    }

    #[inline(always)]
    fn patches<const X: bool>(self, land: &Single, octant: &Octant, way: &Way, nodes: [Node; 2]) -> Option<Met> {
        let [this, other] = nodes;
        let met = patches_of::<X>(land, octant, way, this);
        if met.is_some() || std::ptr::eq(this.row, other.row) { met } else { patches_of::<X>(land, octant, way, other) }
    }
}

/// The first hit within the 4 × 4 patches of a node.
#[inline(always)]
fn patches_of<const X: bool>(
    land: &Single,
    octant: &Octant,
    way: &Way,
    Node { first, row: node, x, y }: Node,
) -> Option<Met> {
    let (west, south) = (4 * x, 4 * y);
    let ((row_at, slope), inverse) = (way.row::<X>(), way.inverse_slope::<X>());
    let mirror = if X { octant.mirror } else { [octant.mirror[1], octant.mirror[0]] };
    for lane in 0..8 {
        let major = lane / 2;
        let column = major as f32 + first;
        let (enter, leave) = (more(column, way.start), less(column + 1.0, way.end));
        // Where the line beyond a row is crossed.
        let crossing = |row: f32| less((row - row_at).mul_add(inverse, inverse), leave);
        let row = slope.mul_add(enter, row_at).floor();
        let (a, row) = if lane & 1 == 0 { (enter, row) } else { (crossing(row), row + 1.0) };
        let b = crossing(row);
        let minor = (row as i32).wrapping_sub(4 * node);
        if !(a < b && (0..4).contains(&minor)) {
            continue;
        }
        let [i, j] = if X { [major, minor] } else { [minor, major] };
        // The patch of the raster; its nearest sample is its first, or its last along a mirrored axis.
        let (x, y) = (west as i32 + (i ^ mirror[0] & 3), south as i32 + (j ^ mirror[1] & 3));
        if x >= land.patches[0] || y >= land.patches[1] {
            continue;
        }
        let sample = |i: i32, j: i32| {
            let (x, y) = (x + (i ^ mirror[0] & 1), y + (j ^ mirror[1] & 1));
            land.heights[y as usize * land.columns + x as usize]
        };
        let corner = sample(0, 0);
        let (next, aside) = if X { (sample(1, 0), sample(0, 1)) } else { (sample(0, 1), sample(1, 0)) };
        let (rise, across) = (next - corner, aside - corner);
        let twist = (sample(1, 1) - aside) - rise;
        let over = |s: f32| {
            let (u, v) = (s - column, slope.mul_add(s, row_at - row));
            let z = (-u).mul_add(rise, way.rate.z.mul_add(s, way.at.z - corner));
            (-v).mul_add(twist.mul_add(u, across), z)
        };
        let (f0, f1) = (over(a), over(b));
        let length = b - a;
        let bend = (twist * slope) * (length * length);
        // Between two points above it the ray can only dip where both are nearer than the bend.
        let bend = 0.0 - bend;
        let near = more(0.0, bend);
        let lowest = less(f0, f1);
        if lowest.is_nan() || lowest > near {
            continue;
        }
        let slope = (f1 - f0) - bend;
        let disc = slope.mul_add(slope, -((4.0 * bend) * f0));
        let dips = slope < 0.0 && slope + (bend + bend) > 0.0 && disc >= 0.0;
        if lowest > 0.0 && !dips {
            continue;
        }
        let root = more(disc, 0.0).sqrt();
        let root = if slope < 0.0 { (f0 + f0) / (root - slope) } else { (slope + root) / (-2.0 * bend) };
        let root = if f0 > 0.0 { less(root, 1.0) } else { 0.0 };
        return Some(Met { s: root.mul_add(length, a), below: f0 < 0.0 });
    }
    None
}
