//! Lines of sight in bulk: most long ones end deep inside a mountain, and a few looks at the lows find that out.
//!
//! Sixteen points spread along a segment are compared with the low of the node they lie over, all at once: coarse nodes
//! first, whose numbers stay in the nearest caches, then finer ones. A point under the lowest point of its node is under
//! the surface, so that a segment which starts above it is blocked. What the looks leave open is walked as any ray.

use super::bulk::{PART, RayCaster, Simd};
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{Lanes, Portable};
use super::scene::Scene;
use super::stream::{LocalRay, blend};
use glam::Vec3;
use rayon::prelude::*;

/// The looks, coarse to fine: level of the nodes, and shift of the points in thirty-seconds of the segment.
const LOOKS: [(i32, f32); 3] = [(4, 0.0), (2, 0.0), (2, 1.0)];
/// The points: one in every sixteenth of the segment.
const POINTS: [f32; 16] = {
    let mut points = [0.0; 16];
    let mut i = 0;
    while i < 16 {
        points[i] = (i as f32 + 0.5) / 16.0 - 1.0 / 64.0;
        i += 1;
    }
    points
};

impl RayCaster<'_> {
    /// Whether nothing lies between the two ends of each segment (m, counted from the anchor): the negation of
    /// [`RayCaster::any_hits`], and faster where many segments are long and blocked.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn lines_of_sight(&self, segments: &[[Vec3; 2]], visible: &mut [bool]) {
        assert_eq!(segments.len(), visible.len(), "expected as many answers as segments");
        let (mut rays, mut open, mut hits) = (Vec::with_capacity(BATCH), Vec::with_capacity(BATCH), [false; BATCH]);
        for (segments, visible) in segments.chunks(BATCH).zip(visible.chunks_mut(BATCH)) {
            rays.clear();
            open.clear();
            visible.fill(false);
            match &self.scene {
                // Through a hole a ray may get under the surface without meeting it.
                Some(scene) if scene.voids.is_empty() => self.look(scene, segments, &mut open),
                _ => open.extend(0..segments.len()),
            }
            rays.extend(open.iter().map(|&index| LocalRay::between(segments[index][0], segments[index][1])));
            self.any_hits(&rays, &mut hits[..rays.len()]);
            for (&index, hit) in open.iter().zip(hits) {
                visible[index] = !hit;
            }
        }
    }

    /// [`RayCaster::lines_of_sight`] on all threads, with the same answers.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn par_lines_of_sight(&self, segments: &[[Vec3; 2]], visible: &mut [bool]) {
        assert_eq!(segments.len(), visible.len(), "expected as many answers as segments");
        let parts = segments.par_chunks(PART).zip(visible.par_chunks_mut(PART));
        parts.for_each(|(segments, visible)| self.lines_of_sight(segments, visible));
    }

    /// Lists the segments that the looks leave open.
    fn look(&self, scene: &Scene, segments: &[[Vec3; 2]], open: &mut Vec<usize>) {
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx512f,avx512dq,avx2,bmi1,bmi2,popcnt,lzcnt")]
            fn avx512(scene: &Scene, segments: &[[Vec3; 2]], open: &mut Vec<usize>) {
                // SAFETY: this function is compiled for it and only called where it is available.
                looks(unsafe { Avx512::new() }, scene, segments, open);
            }
            #[target_feature(enable = "avx2,bmi1,bmi2,popcnt,lzcnt")]
            fn avx2(scene: &Scene, segments: &[[Vec3; 2]], open: &mut Vec<usize>) {
                // SAFETY: as above.
                looks(unsafe { Avx2::new() }, scene, segments, open);
            }
            match self.simd {
                // SAFETY: `RayCaster` holds only instructions that are available.
                Simd::Avx512 => return unsafe { avx512(scene, segments, open) },
                // SAFETY: as above.
                Simd::Avx2 => return unsafe { avx2(scene, segments, open) },
                Simd::Portable => {}
            }
        }
        looks(Portable, scene, segments, open);
    }
}

/// Segments whose open ones are walked together.
const BATCH: usize = 1024;

#[inline(always)]
fn looks<L: Lanes>(l: L, scene: &Scene, segments: &[[Vec3; 2]], open: &mut Vec<usize>) {
    let mut candidates = [0u16; BATCH];
    let mut count = 0;
    for (index, segment) in segments.iter().enumerate() {
        let along = segment[1] - segment[0];
        let x = (segment[0].x * scene.per_metre.x + scene.offset.x, along.x * scene.per_metre.x);
        let y = (segment[0].y * scene.per_metre.y + scene.offset.y, along.y * scene.per_metre.y);
        let z = (segment[0].z + scene.height, along.z);
        let mut blocked = false;
        for (level, shift) in LOOKS {
            for at in (0..16).step_by(L::COUNT) {
                let t = l.add(l.load(&POINTS[at..]), l.splat(shift / 32.0));
                blocked |= under(l, scene, level.min(scene.top), t, [x, y, z]);
            }
            if blocked {
                break;
            }
        }
        if blocked {
            candidates[count] = index as u16;
            count += 1;
        } else {
            open.push(index);
        }
    }
    // Only those that start above the surface are surely blocked. Their heights come last and together, since each is far
    // from the others in memory.
    for at in (0..count).step_by(L::COUNT) {
        let (mut x, mut y, mut z) = ([0.0; 16], [0.0; 16], [0.0; 16]);
        for lane in 0..L::COUNT {
            let segment = &segments[candidates[(at + lane).min(count - 1)] as usize];
            x[lane] = segment[0].x * scene.per_metre.x + scene.offset.x;
            y[lane] = segment[0].y * scene.per_metre.y + scene.offset.y;
            z[lane] = segment[0].z + scene.height;
        }
        let above = l.bits(starts_above(l, scene, l.load(&x), l.load(&y), l.load(&z)));
        for lane in 0..L::COUNT.min(count - at) {
            if above >> lane & 1 == 0 {
                open.push(candidates[at + lane] as usize);
            }
        }
    }
}

/// Whether any of the points at `t` of a segment, origin and direction of each axis, lies under the low of its node.
#[inline(always)]
fn under<L: Lanes>(l: L, scene: &Scene, level: i32, t: L::F, [x, y, z]: [(f32, f32); 3]) -> bool {
    let (offset, stride) = (scene.offsets[level as usize], scene.strides[level as usize]);
    let column = l.iadd(l.floor(l.add(l.splat(x.0), l.mul(l.splat(x.1), t))), l.int(scene.cell[0]));
    let row = l.iadd(l.floor(l.add(l.splat(y.0), l.mul(l.splat(y.1), t))), l.int(scene.cell[1]));
    let inner_column = l.imax(l.imin(column, l.int(scene.cells[0] - 1)), l.int(0));
    let inner_row = l.imax(l.imin(row, l.int(scene.cells[1] - 1)), l.int(0));
    let inside = l.and(l.ieq(column, inner_column), l.ieq(row, inner_row));
    let line = l.imul(l.shr(inner_row, l.int(level)), l.int(stride));
    let node = l.iadd(l.iadd(line, l.shr(inner_column, l.int(level))), l.int(offset));
    // SAFETY: the cell was clamped to the raster's.
    let low = l.float(unsafe { l.gather_u16(scene.lows, node) });
    let low = l.add(l.mul(low, l.splat(scene.step)), l.splat(scene.low_base));
    l.bits(l.and(inside, l.lt(l.add(l.splat(z.0), l.mul(l.splat(z.1), t)), low))) != 0
}

/// Whether points of the lattice lie over the surface (not merely beside the map).
#[inline(always)]
fn starts_above<L: Lanes>(l: L, scene: &Scene, x: L::F, y: L::F, z: L::F) -> L::M {
    let (column, row) = (l.floor(x), l.floor(y));
    let (i, j) = (l.iadd(column, l.int(scene.cell[0])), l.iadd(row, l.int(scene.cell[1])));
    let (inner_i, inner_j) = (
        l.imax(l.imin(i, l.int(scene.cells[0] - 1)), l.int(0)),
        l.imax(l.imin(j, l.int(scene.cells[1] - 1)), l.int(0)),
    );
    let inside = l.and(l.ieq(i, inner_i), l.ieq(j, inner_j));
    let at = l.iadd(l.imul(inner_j, l.int(scene.columns)), inner_i);
    // SAFETY: the patch was clamped to the raster's; it has samples east, north and north-east.
    let ((a, b), (c, d)) =
        unsafe { (l.gather_pair(scene.heights, at), l.gather_pair(scene.heights, l.iadd(at, l.int(scene.columns)))) };
    let height = blend(l, [a, b, c, d], l.sub(x, l.float(column)), l.sub(y, l.float(row)));
    l.and(inside, l.lt(height, z))
}
