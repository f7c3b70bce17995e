//! One ray at a time: its way through 64 nodes, or through 16 patches, decided by one comparison.
//!
//! Along its major axis a ray crosses a column of nodes in at most two rows: the one it enters and the one it leaves by. So
//! eight columns of a block are sixteen nodes in the order of the way, and the first of them that reaches up to the ray is
//! where to look closer: in the 8 × 8 nodes below it or, at the end, in its 4 × 4 patches, eight pieces of the way at once.
//! Blocks left without a hit are taken up again where they were left. The walk begins at the block that the clearance below
//! the ray's start suggests and climbs only when it must.
//!
//! The way is told by the position s along the major axis, in which lines between cells are integers. Lattice axes are
//! mirrored so that both directions are positive, and everything counts from a corner of nodes near the anchor.
//!
//! The kernel is for rays that start above a surface without holes: being under it anywhere means that it was crossed, so
//! that nothing slips through where rounding hides a sliver of a node or a patch. Rays that come into a patch from below,
//! be it because they started there or through such a sliver, are left to the `f64` walk, and so are steep ones, for
//! which s says too little.
//!
//! Works this rests on: A. Tevs et al., "Maximum mipmaps", I3D 2008; I. Wald et al., "Getting rid of packets: efficient SIMD
//! single-ray traversal using multi-branching BVHs", RT 2008 (one ray against many nodes).

use super::scene::Scene;
use super::stream::LocalRay;
use crate::field::{BLOCK_LEVELS, Block, Blocks, Land};
use glam::Vec4;

/// Rays that fall or rise more than this many metres for each metre along their major axis count as steep.
const STEEP: f32 = 16.0;

/// Patches along an axis beyond which `f32` tells cells apart too badly.
const MOST_PATCHES: i32 = 1 << 20;

/// A land as this kernel sees it.
#[derive(Clone, Debug)]
pub(super) struct Single<'a> {
    heights: &'a [f32],
    columns: usize,
    blocks: &'a Blocks,
    /// Patches along x and y.
    patches: [i32; 2],
    /// The corner that cells count from, also when mirrored: cell c of the raster is cell c − corner, or corner − 1 − c.
    corner: [i32; 2],
    /// Steps of the pyramid per metre, and the height of step 0 with a hair of slack (m).
    per_step: f32,
    base: f32,
    /// Lattice units per metre and the anchor's position (lattice units from the corner; m).
    scale: Vec4,
    offset: Vec4,
    /// By the signs of the direction, bit 0 for x.
    octants: [Octant; 8],
}

/// What mirroring does to the map.
#[derive(Clone, Copy, Debug, Default)]
struct Octant {
    /// Its box, from the corner and from height 0.
    low: Vec4,
    high: Vec4,
    /// Its first and last cells.
    first: [i32; 2],
    last: [i32; 2],
    /// What makes cells count from a corner of blocks.
    align: [i32; 2],
}

/// What the kernel found out about a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Found {
    /// The distance of the first hit, infinity for none.
    Distance(f32),
    /// A ray for the `f64` walk.
    Left,
}

/// A ray on its way. Index 0 of pairs is the major axis.
struct Way {
    /// Rows per column, and its inverse.
    slope: f32,
    inverse_slope: f32,
    /// Row at s = 0.
    row: f32,
    /// Height at s = 0 (m) and its change with s; the same in steps of the pyramid.
    height: f32,
    climb: f32,
    steps: f32,
    steps_climb: f32,
    /// Where the way begins and ends.
    start: f32,
    end: f32,
    falls: bool,
    /// For the raster's axes x, y: all ones where the ray runs backward.
    mirror: [i32; 2],
    /// Which table of node indices to use.
    table: usize,
}

/// Rows of the nodes of a block along the way, column after column: entered, left.
#[repr(align(64))]
#[derive(Clone, Copy)]
struct Rows([i32; 16]);

/// The part of a node's index in its block that the column makes, by (major axis is x) · 4 + (y, x mirrored).
static COLUMN_INDEX: [Rows; 8] = {
    let mut tables = [Rows([0; 16]); 8];
    let mut table = 0;
    while table < 8 {
        let mirror = (if table & 1 != 0 { 7 } else { 0 }) | (if table & 2 != 0 { 56 } else { 0 });
        let mut lane = 0;
        while lane < 16 {
            let column = lane as i32 / 2;
            tables[table].0[lane] = (if table & 4 != 0 { column } else { 8 * column }) ^ mirror;
            lane += 1;
        }
        table += 1;
    }
    tables
};

/// A hit within 4 × 4 patches: where, and whether the ray came into the patch from below.
struct Met {
    s: f32,
    below: bool,
}

/// The two looks, for one set of instructions; all give the same bits.
trait Looks: Copy {
    /// Which of the sixteen nodes along the way through a block reach up to the ray from `from` on, as bits, and their rows
    /// within the block.
    fn nodes<const X: bool>(self, land: &Single, way: &Way, block: At, from: f32, rows: &mut Rows) -> u32;
    /// The first hit within the 4 × 4 patches from `cell` on.
    fn patches<const X: bool>(self, land: &Single, way: &Way, cell: [i32; 2]) -> Option<Met>;
}

/// A block: its level and its first node along the major and the minor axis.
#[derive(Clone, Copy)]
struct At {
    level: usize,
    node: [i32; 2],
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
        let octants = std::array::from_fn(|signs| {
            let mut octant = Octant::default();
            for axis in 0..2 {
                let (cells, corner) = (scene.cells[axis], corner[axis]);
                let backward = signs >> axis & 1 == 1;
                let first = if backward { corner - cells } else { -corner };
                (octant.first[axis], octant.last[axis]) = (first, first + cells - 1);
                octant.align[axis] = if backward { -corner } else { corner };
                (octant.low[axis], octant.high[axis]) = (first as f32, (first + cells) as f32);
            }
            let (low, high) = if signs & 4 == 4 { (-scene.high, -scene.low) } else { (scene.low, scene.high) };
            (octant.low.z, octant.high.z) = (low, high);
            octant
        });
        Some(Single {
            heights: scene.heights,
            columns: scene.columns as usize,
            blocks,
            patches: scene.cells,
            corner,
            per_step: 1.0 / scene.step,
            base: scene.high_base,
            scale: Vec4::new(scene.per_metre.x, scene.per_metre.y, 1.0, 0.0),
            offset: Vec4::new(
                scene.offset.x + (scene.cell[0] - corner[0]) as f32,
                scene.offset.y + (scene.cell[1] - corner[1]) as f32,
                scene.height,
                0.0,
            ),
            octants,
        })
    }

    /// Finds the first hit of a ray.
    #[inline]
    pub fn first_hit(&self, wide: bool, ray: &LocalRay) -> Found {
        #[cfg(target_arch = "x86_64")]
        if wide {
            // SAFETY: `RayCaster` holds only instructions that are available, and asks for these.
            return unsafe { x86::first_hit(self, ray) };
        }
        let _ = wide;
        self.walk(Portable, ray)
    }

    #[inline(always)]
    fn walk<L: Looks>(&self, looks: L, ray: &LocalRay) -> Found {
        let [origin, direction]: [[f32; 4]; 2] = bytemuck::cast(*ray);
        let reach = ray.reach;
        let origin = (Vec4::from_array(origin) * self.scale + self.offset).with_w(0.0);
        let direction = (Vec4::from_array(direction) * self.scale).with_w(0.0);
        // By comparison: a zero with a sign runs forward.
        let backward = direction.cmplt(Vec4::ZERO);
        let signs = backward.bitmask() as usize & 7;
        let octant = &self.octants[signs];
        let size = direction.abs();
        let at = Vec4::select(backward, -origin, origin);
        let inverse = Vec4::ONE / size.max(Vec4::splat(1e-20));
        let (enter, leave) = ((octant.low - at) * inverse, (octant.high - at) * inverse);
        let start = more(more(enter.x, enter.y), more(enter.z, 0.0));
        let end = less(less(leave.x, leave.y), less(leave.z, reach));
        // Whether every number is finite, in one comparison.
        let finite = (origin + direction) * 0.0 == Vec4::ZERO;
        if !(finite && start < end) {
            return if finite && start > end { Found::Distance(f32::INFINITY) } else { Found::Left };
        }
        let ends = (start, end);
        let steep = |axis: usize| size.z * self.scale[axis] > STEEP * size[axis];
        if size.x >= size.y {
            let axes = [(at.x, size.x, inverse.x), (at.y, size.y, inverse.y)];
            if steep(0) { Found::Left } else { self.follow::<L, true>(looks, axes, origin.z, direction.z, signs, ends) }
        } else {
            let axes = [(at.y, size.y, inverse.y), (at.x, size.x, inverse.x)];
            if steep(1) {
                Found::Left
            } else {
                self.follow::<L, false>(looks, axes, origin.z, direction.z, signs, ends)
            }
        }
    }

    /// Follows a ray given by (position, direction, its inverse) along the major and the minor axis, which are x and y if `X`
    /// and y and x otherwise.
    #[inline(always)]
    fn follow<L: Looks, const X: bool>(
        &self,
        looks: L,
        [(major, along, inverse_major), (minor, across, inverse_minor)]: [(f32, f32, f32); 2],
        z: f32,
        dz: f32,
        signs: usize,
        (start, end): (f32, f32),
    ) -> Found {
        let octant = &self.octants[signs];
        let pair = |values: [i32; 2]| if X { values } else { [values[1], values[0]] };
        let (first, last, align) = (pair(octant.first), pair(octant.last), pair(octant.align));
        let slope = across * inverse_major;
        let climb = dz * inverse_major;
        let height = z - climb * major;
        // A branch that is foreseen costs less than waiting for the sum.
        let mut begin = major;
        if start > 0.0 {
            branch();
            begin = major + start * along;
        }
        let way = Way {
            slope,
            inverse_slope: along * inverse_minor,
            row: minor - slope * major,
            height,
            climb,
            steps: (height - self.base) * self.per_step,
            steps_climb: climb * self.per_step,
            start: begin,
            end: major + end * along,
            falls: dz < 0.0,
            mirror: [-((signs & 1) as i32), -((signs >> 1 & 1) as i32)],
            table: (signs & 3) | if X { 4 } else { 0 },
        };
        let cell = |at: f32, axis: usize| {
            // Within ±2²², whatever `at` is: NaN becomes the lower bound.
            let at = less(more(at.floor(), -4_194_304.0), 4_194_304.0);
            // SAFETY: just made to fit.
            let cell = unsafe { at.to_int_unchecked::<i32>() };
            cell.max(first[axis]).min(last[axis])
        };
        let (column, row) = (cell(begin, 0), cell(way.row + slope * begin, 1));

        let top = self.blocks.levels.len() - 1;
        let mut level = self.begin::<X>(&way, column, row).min(top);
        // The coarsest block begun, by its first node, and where to take up those below it.
        let mut highest = level;
        let number = |cell: i32, axis: usize, level: usize| (cell + align[axis]) >> (5 + 3 * level);
        let around = |[column, row]: [i32; 2], level: usize| {
            let first = |cell, axis| (number(cell, axis, level) << 3) - (align[axis] >> (2 + 3 * level));
            [first(column, 0), first(row, 1)]
        };
        let mut whole = around([column, row], level);
        let mut from = begin;
        let mut node = whole;
        let (mut corners, mut masks) = ([[0; 2]; BLOCK_LEVELS], [0; BLOCK_LEVELS]);
        let mut rows = [Rows([0; 16]); BLOCK_LEVELS];
        'blocks: loop {
            let mut mask = looks.nodes::<X>(self, &way, At { level, node }, from, &mut rows[level]);
            corners[level] = node;
            // The next node on the way: of this block, or of one above it.
            loop {
                if mask != 0 {
                    let lane = mask.trailing_zeros() as usize & 15;
                    mask &= mask - 1;
                    let [column, row] = [corners[level][0] + lane as i32 / 2, corners[level][1] + rows[level].0[lane]];
                    if level > 0 {
                        masks[level] = mask;
                        level -= 1;
                        node = [8 * column, 8 * row];
                        continue 'blocks;
                    }
                    if let Some(met) = looks.patches::<X>(self, &way, [4 * column, 4 * row]) {
                        let distance = more((met.s - major) * inverse_major, 0.0);
                        return if met.below { Found::Left } else { Found::Distance(distance) };
                    }
                } else if level < highest {
                    level += 1;
                    mask = masks[level];
                } else {
                    // On from where the ray leaves the block: one level up, or to the next one of the coarsest.
                    let shift = 2 + 3 * level;
                    let line = |axis: usize| ((whole[axis] + 8) << shift) as f32;
                    let (column, row) = (line(0), (line(1) - way.row) * way.inverse_slope);
                    from = more(from, less(column, row));
                    if from >= way.end {
                        return Found::Distance(f32::INFINITY);
                    }
                    if level < top {
                        level += 1;
                        highest = level;
                        whole = around(whole.map(|node| node << shift), level);
                    } else {
                        let axis = usize::from(row < column);
                        whole[axis] += 8;
                        if whole[axis] << shift > last[axis] {
                            return Found::Distance(f32::INFINITY);
                        }
                    }
                    node = whole;
                    continue 'blocks;
                }
            }
        }
    }

    /// The level to begin with: that of the blocks through which the ray's clearance over their nodes lets it pass.
    #[inline(always)]
    fn begin<const X: bool>(&self, way: &Way, column: i32, row: i32) -> usize {
        let [x, y] = self.raster::<X>(way, [column, row], 0);
        let steps = way.steps + way.steps_climb * way.start;
        let clearance = |level: usize| {
            let (Some(here), shift) = (self.blocks.levels.get(level), 2 + 3 * level) else { return f32::NEG_INFINITY };
            let (x, y) = (x as usize >> shift, y as usize >> shift);
            let block = &self.blocks.blocks[here.offset + (y >> 3) * here.columns + (x >> 3)];
            steps - f32::from(block.0[(y & 7) * 8 + (x & 7)])
        };
        // A branch again: what is foreseen need not be waited for.
        if clearance(2) > way.steps_climb.abs() * 64.0 {
            branch();
            2
        } else if clearance(1) > way.steps_climb.abs() * 8.0 {
            branch();
            1
        } else {
            0
        }
    }
}

impl Single<'_> {
    /// Squares of 2ˡ × 2ˡ cells of the raster, x and y, from those along the major and the minor axis.
    #[inline(always)]
    fn raster<const X: bool>(&self, way: &Way, [major, minor]: [i32; 2], l: usize) -> [i32; 2] {
        let [x, y] = if X { [major, minor] } else { [minor, major] };
        [(x ^ way.mirror[0]) + (self.corner[0] >> l), (y ^ way.mirror[1]) + (self.corner[1] >> l)]
    }

    /// The highs of a block.
    #[inline(always)]
    fn block<const X: bool>(&self, way: &Way, at: At) -> &Block {
        let here = &self.blocks.levels[at.level];
        let [x, y] = self.raster::<X>(way, at.node, 2 + 3 * at.level).map(|node| node >> 3);
        &self.blocks.blocks[here.offset + y as usize * here.columns + x as usize]
    }
}

/// Numbers that both looks at nodes start from.
struct Frame {
    /// Length of a node's side (cells), and its inverse.
    size: f32,
    inverse: f32,
    /// First column of the block (nodes).
    column: f32,
    /// Row at s = 0 (nodes).
    row: f32,
}

impl Frame {
    #[inline(always)]
    fn new(way: &Way, at: At) -> Frame {
        let k = 3 * at.level as u32;
        // 4·8ᵏ and its inverse.
        let (size, inverse) = (f32::from_bits((129 + k) << 23), f32::from_bits((125 - k) << 23));
        Frame { size, inverse, column: at.node[0] as f32, row: way.row * inverse }
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
    fn nodes<const X: bool>(self, land: &Single, way: &Way, at: At, from: f32, rows: &mut Rows) -> u32 {
        let frame = Frame::new(way, at);
        let highs = &land.block::<X>(way, at).0;
        let (from, end) = (from * frame.inverse, way.end * frame.inverse);
        let climb = way.steps_climb * frame.size;
        let mut mask = 0;
        for lane in 0..16 {
            let column = (lane / 2) as f32 + frame.column;
            let (enter, leave) = (more(column, from), less(column + 1.0, end));
            let edge = if lane & 1 == 0 { enter } else { leave };
            let row = ((way.slope * edge + frame.row).floor() as i32).wrapping_sub(at.node[1]);
            rows.0[lane] = row;
            let lowest = climb * (if way.falls { leave } else { enter }) + way.steps;
            let index = COLUMN_INDEX[way.table].0[lane] ^ if X { row.wrapping_mul(8) } else { row };
            let twin = lane & 1 == 1 && rows.0[lane - 1] == row;
            let high = highs[index as usize & 63];
            let blocked = (0..8).contains(&row) && enter < leave && !twin && more(lowest, 1.0) <= f32::from(high);
            mask |= u32::from(blocked) << lane;
        }
        mask
    }

    #[inline(always)]
    fn patches<const X: bool>(self, land: &Single, way: &Way, cell: [i32; 2]) -> Option<Met> {
        let leaf = Leaf::new::<X>(land, way, cell);
        for lane in 0..8 {
            let column = (lane / 2) as f32 + leaf.column;
            let (enter, leave) = (more(column, way.start), less(column + 1.0, way.end));
            let row = (way.slope * enter + leaf.row).floor();
            let crossing = (row + 1.0 - leaf.row) * way.inverse_slope;
            let (a, b, row) = if lane & 1 == 0 {
                (enter, less(crossing, leave), row)
            } else {
                (more(crossing, enter), leave, row + 1.0)
            };
            let patch = if X { [lane / 2, row as i32] } else { [row as i32, lane / 2] };
            let (x, y) = (patch[0] ^ (way.mirror[0] & 3), patch[1] ^ (way.mirror[1] & 3));
            if !(a < b && (0..leaf.patches[0]).contains(&x) && (0..leaf.patches[1]).contains(&y)) {
                continue;
            }
            let at = leaf.corner + y as usize * land.columns + x as usize;
            let [sw, se] = [land.heights[at], land.heights[at + 1]];
            let [nw, ne] = [land.heights[at + land.columns], land.heights[at + land.columns + 1]];
            let (east, north) = (se - sw, nw - sw);
            let twist = (ne - nw) - east;
            let (rise, across) = if X { (east, north) } else { (north, east) };
            let u = leaf.turn[0] - leaf.sign[0] * column;
            let v = leaf.sign[1] * (leaf.row - row) + leaf.turn[1];
            let over = |s: f32| {
                let (u, v) = (leaf.sign[0] * s + u, leaf.lean * s + v);
                (way.climb * s + (way.height - sw)) - (u * rise + v * (twist * u + across))
            };
            let (f0, f1) = (over(a), over(b));
            let length = b - a;
            let bend = (twist * leaf.bend) * (length * length);
            let slope = (f1 - f0) - bend;
            let disc = slope * slope - (4.0 * bend) * f0;
            let dips = slope < 0.0 && slope + (bend + bend) > 0.0 && disc >= 0.0;
            if !(f0 <= 0.0 || f1 <= 0.0 || dips) {
                continue;
            }
            let root = more(disc, 0.0).sqrt();
            let root = if slope < 0.0 { (f0 + f0) / (root - slope) } else { (slope + root) / (-2.0 * bend) };
            let root = if f0 > 0.0 { less(root, 1.0) } else { 0.0 };
            return Some(Met { s: root * length + a, below: f0 < 0.0 });
        }
        None
    }
}

/// Numbers of 4 × 4 patches.
struct Leaf {
    /// Index of the south-western sample.
    corner: usize,
    /// Patches that exist along x and y, up to 4.
    patches: [i32; 2],
    /// First column; row at s = 0, from the first row.
    column: f32,
    row: f32,
    /// Position in a patch of the raster, along the major and minor axis: `sign` · (that of the mirrored one) + `turn`.
    sign: [f32; 2],
    turn: [f32; 2],
    /// Change of the minor position with s, and what turns a patch's twist into the bend of a piece of unit length.
    lean: f32,
    bend: f32,
}

impl Leaf {
    #[inline(always)]
    fn new<const X: bool>(land: &Single, way: &Way, cell: [i32; 2]) -> Leaf {
        // Mirrored, the first cell is the last of the raster's four.
        let [x, y] = land.raster::<X>(way, cell, 0).map(|cell| cell & !3);
        let mirror = if X { way.mirror } else { [way.mirror[1], way.mirror[0]] };
        let sign = mirror.map(|mirror| (1 + 2 * mirror) as f32);
        Leaf {
            corner: y as usize * land.columns + x as usize,
            patches: [(land.patches[0] - x).min(4), (land.patches[1] - y).min(4)],
            column: cell[0] as f32,
            row: way.row - cell[1] as f32,
            sign,
            turn: mirror.map(|mirror| -mirror as f32),
            lean: sign[1] * way.slope,
            bend: -(sign[0] * sign[1] * way.slope),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(
    clippy::undocumented_unsafe_blocks,
    reason = "every block but those that load has the same: a value of the type proves the features"
)]
mod x86 {
    use super::*;
    use std::arch::x86_64::*;

    /// Sixteen lanes of AVX-512 F, BW, DQ and VL.
    #[derive(Clone, Copy)]
    struct Avx512(());

    /// The kernel compiled for AVX-512.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,popcnt,lzcnt")]
    pub(super) fn first_hit(land: &Single, ray: &LocalRay) -> Found {
        land.walk(Avx512(()), ray)
    }

    const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
    static COLUMNS: [f32; 16] = [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 5.0, 5.0, 6.0, 6.0, 7.0, 7.0];

    // Functions rather than closures: a closure is compiled by itself, without the features of the function around it.

    /// Two rows of eight numbers as a table.
    #[inline(always)]
    fn two(a: __m256, b: __m256) -> __m512 {
        unsafe { _mm512_insertf32x8::<1>(_mm512_castps256_ps512(a), b) }
    }

    /// Eight numbers of a table of 32.
    #[inline(always)]
    fn pick((a, b): (__m512, __m512), index: __m512i) -> __m256 {
        unsafe { _mm512_castps512_ps256(_mm512_permutex2var_ps(a, index, b)) }
    }

    /// Height of the ray over bilinear patches at s; u, v and the ray's height are factor and sum of s.
    #[inline(always)]
    fn over((rise, across, twist): (__m256, __m256, __m256), [u, v, z]: [(__m256, __m256); 3], s: __m256) -> __m256 {
        unsafe {
            let (u, v) = (_mm256_add_ps(_mm256_mul_ps(u.0, s), u.1), _mm256_add_ps(_mm256_mul_ps(v.0, s), v.1));
            let side = _mm256_mul_ps(v, _mm256_add_ps(_mm256_mul_ps(twist, u), across));
            let ground = _mm256_add_ps(_mm256_mul_ps(u, rise), side);
            _mm256_sub_ps(_mm256_add_ps(_mm256_mul_ps(z.0, s), z.1), ground)
        }
    }

    #[cold]
    #[inline(never)]
    fn at_the_border<const X: bool>(land: &Single, way: &Way, cell: [i32; 2]) -> Option<Met> {
        Portable.patches::<X>(land, way, cell)
    }

    impl Looks for Avx512 {
        #[inline(always)]
        fn nodes<const X: bool>(self, land: &Single, way: &Way, at: At, from: f32, rows: &mut Rows) -> u32 {
            let frame = Frame::new(way, at);
            let highs = &land.block::<X>(way, at).0;
            unsafe {
                // Sixteen and sixty-four numbers, as many as are loaded and stored.
                let columns = _mm512_loadu_ps(COLUMNS.as_ptr());
                let table = _mm512_load_si512(COLUMN_INDEX[way.table].0.as_ptr().cast());
                let (south, north) =
                    (_mm512_load_si512(highs.as_ptr().cast()), _mm512_load_si512(highs[32..].as_ptr().cast()));
                let column = _mm512_add_ps(columns, _mm512_set1_ps(frame.column));
                let enter = _mm512_max_ps(column, _mm512_set1_ps(from * frame.inverse));
                let next = _mm512_add_ps(column, _mm512_set1_ps(1.0));
                let leave = _mm512_min_ps(next, _mm512_set1_ps(way.end * frame.inverse));
                let edge = _mm512_mask_blend_ps(0xAAAA, enter, leave);
                let row = _mm512_add_ps(_mm512_mul_ps(_mm512_set1_ps(way.slope), edge), _mm512_set1_ps(frame.row));
                let row = _mm512_cvt_roundps_epi32::<DOWN>(row);
                let row = _mm512_sub_epi32(row, _mm512_set1_epi32(at.node[1]));
                _mm512_store_si512(rows.0.as_mut_ptr().cast(), row);
                let lowest = _mm512_mask_blend_ps(if way.falls { 0xFFFF } else { 0 }, enter, leave);
                let climb = _mm512_set1_ps(way.steps_climb * frame.size);
                let lowest = _mm512_add_ps(_mm512_mul_ps(climb, lowest), _mm512_set1_ps(way.steps));
                let lowest = _mm512_max_ps(lowest, _mm512_set1_ps(1.0));
                let index = _mm512_xor_si512(table, if X { _mm512_slli_epi32::<3>(row) } else { row });
                let high = _mm512_maskz_permutex2var_epi16(0x5555_5555, south, index, north);
                let high = _mm512_cvtepi32_ps(high);
                let inside = _mm512_cmplt_epu32_mask(row, _mm512_set1_epi32(8));
                let inside = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(inside, enter, leave);
                let twin = _mm512_mask_cmpeq_epi32_mask(0xAAAA, row, _mm512_shuffle_epi32::<0b10_11_00_01>(row));
                let blocked = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(inside, lowest, high);
                u32::from(blocked & !twin)
            }
        }

        #[inline(always)]
        fn patches<const X: bool>(self, land: &Single, way: &Way, cell: [i32; 2]) -> Option<Met> {
            let leaf = Leaf::new::<X>(land, way, cell);
            // At the map's north and east the samples of fewer patches must do.
            if leaf.patches != [4, 4] {
                return at_the_border::<X>(land, way, cell);
            }
            let samples = &land.heights[leaf.corner..leaf.corner + 4 * land.columns + 5];
            unsafe {
                let columns = _mm256_loadu_ps(COLUMNS.as_ptr());
                let odd = _mm256_setr_ps(0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0);
                let (zero, one) = (_mm256_setzero_ps(), _mm256_set1_ps(1.0));
                let column = _mm256_add_ps(columns, _mm256_set1_ps(leaf.column));
                let enter = _mm256_max_ps(column, _mm256_set1_ps(way.start));
                let leave = _mm256_min_ps(_mm256_add_ps(column, one), _mm256_set1_ps(way.end));
                let (base, slope) = (_mm256_set1_ps(leaf.row), _mm256_set1_ps(way.slope));
                let row = _mm256_floor_ps(_mm256_add_ps(_mm256_mul_ps(slope, enter), base));
                let crossing = _mm256_sub_ps(_mm256_add_ps(row, one), base);
                let crossing = _mm256_mul_ps(crossing, _mm256_set1_ps(way.inverse_slope));
                let a = _mm256_mask_blend_ps(0xAA, enter, _mm256_max_ps(crossing, enter));
                let b = _mm256_mask_blend_ps(0x55, leave, _mm256_min_ps(crossing, leave));
                let row = _mm256_add_ps(row, odd);
                let minor = _mm256_cvttps_epi32(row);
                let major = _mm256_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3);
                let (x, y) = if X { (major, minor) } else { (minor, major) };
                let x = _mm256_xor_si256(x, _mm256_set1_epi32(way.mirror[0] & 3));
                let y = _mm256_xor_si256(y, _mm256_set1_epi32(way.mirror[1] & 3));
                let valid = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b);
                let valid = _mm256_mask_cmplt_epu32_mask(valid, x, _mm256_set1_epi32(4));
                let valid = _mm256_mask_cmplt_epu32_mask(valid, y, _mm256_set1_epi32(4));

                // Five rows of five samples.
                let mut lines = [zero; 5];
                for (row, line) in lines.iter_mut().enumerate() {
                    // SAFETY: the fifth sample of the fifth row is the last of the slice.
                    *line = _mm256_maskz_loadu_ps(0b11111, samples.as_ptr().add(row * land.columns));
                }
                let south = (two(lines[0], lines[1]), two(lines[2], lines[3]));
                let north = (two(lines[1], lines[2]), two(lines[3], lines[4]));
                let west = _mm256_add_epi32(_mm256_slli_epi32::<3>(y), x);
                let east = _mm512_castsi256_si512(_mm256_add_epi32(west, _mm256_set1_epi32(1)));
                let west = _mm512_castsi256_si512(west);
                let (sw, se, nw, ne) = (pick(south, west), pick(south, east), pick(north, west), pick(north, east));
                let (east, north) = (_mm256_sub_ps(se, sw), _mm256_sub_ps(nw, sw));
                let twist = _mm256_sub_ps(_mm256_sub_ps(ne, nw), east);
                let (rise, across) = if X { (east, north) } else { (north, east) };

                let sign = _mm256_set1_ps(leaf.sign[0]);
                let u = _mm256_sub_ps(_mm256_set1_ps(leaf.turn[0]), _mm256_mul_ps(sign, column));
                let v = _mm256_mul_ps(_mm256_set1_ps(leaf.sign[1]), _mm256_sub_ps(base, row));
                let v = _mm256_add_ps(v, _mm256_set1_ps(leaf.turn[1]));
                let (climb, lean) = (_mm256_set1_ps(way.climb), _mm256_set1_ps(leaf.lean));
                let height = _mm256_sub_ps(_mm256_set1_ps(way.height), sw);
                let surface = (rise, across, twist);
                let lines = [(sign, u), (lean, v), (climb, height)];
                let (f0, f1) = (over(surface, lines, a), over(surface, lines, b));
                let length = _mm256_sub_ps(b, a);
                let bend =
                    _mm256_mul_ps(_mm256_mul_ps(twist, _mm256_set1_ps(leaf.bend)), _mm256_mul_ps(length, length));
                let slope = _mm256_sub_ps(_mm256_sub_ps(f1, f0), bend);
                let disc = _mm256_mul_ps(_mm256_mul_ps(_mm256_set1_ps(4.0), bend), f0);
                let disc = _mm256_sub_ps(_mm256_mul_ps(slope, slope), disc);
                let falls = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(slope, zero);
                let dips = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(zero, disc);
                let turns = _mm256_add_ps(slope, _mm256_add_ps(bend, bend));
                let dips = _mm256_mask_cmp_ps_mask::<_CMP_LT_OQ>(dips, zero, turns) & falls;
                let under = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(f0, zero) | _mm256_cmp_ps_mask::<_CMP_LE_OQ>(f1, zero);
                let hit = valid & (under | dips);
                if hit == 0 {
                    return None;
                }
                let root = _mm256_sqrt_ps(_mm256_max_ps(disc, zero));
                let above = _mm256_mask_blend_ps(falls, _mm256_add_ps(slope, root), _mm256_add_ps(f0, f0));
                let under = _mm256_mul_ps(_mm256_set1_ps(-2.0), bend);
                let under = _mm256_mask_blend_ps(falls, under, _mm256_sub_ps(root, slope));
                let root = _mm256_min_ps(_mm256_div_ps(above, under), one);
                let root = _mm256_maskz_mov_ps(_mm256_cmp_ps_mask::<_CMP_LT_OQ>(zero, f0), root);
                let s = _mm256_add_ps(_mm256_mul_ps(root, length), a);
                let below = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(f0, zero);
                let first = hit & hit.wrapping_neg();
                let s = _mm256_cvtss_f32(_mm256_maskz_compress_ps(first, s));
                Some(Met { s, below: below & first != 0 })
            }
        }
    }
}
