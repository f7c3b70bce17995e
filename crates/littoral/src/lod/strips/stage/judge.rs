//! Which cells are off by more than is tolerated, sixteen at a time where the processor has AVX-512.

use super::super::page::{SEAMS, SIDE};
use super::{ACROSS, BLOCKS, Judged, LANES, Lens, Rows, Stage, lesser, square};
use crate::space::View;
use multiversion::multiversion;

/// Judges cells by their errors (m) and how near they and half a cell about them are at most; those that cannot be cut,
/// which have no finer ones beside them, by themselves and what coarser ones may add. Bounds are those of [`ScreenMetric`](crate::lod::ScreenMetric) for boxes as high
/// as the blocks about them. Overwrites what is above.
pub(in super::super) fn judge(lens: &Lens, stage: &Stage, rows: &mut Rows) -> Judged {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has just been asked.
        return unsafe { wide::judge(lens, stage, rows) };
    }
    judge_rows(lens, stage, rows)
}

/// The same, row by row.
#[multiversion(targets("x86_64+avx2+fma"))]
fn judge_rows(lens: &Lens, stage: &Stage, rows: &mut Rows) -> Judged {
    let side = 1usize << lens.level;
    let mut judge = Judge::new(lens);
    let mut columns = [Reach::default(); SIDE];
    for (i, columns) in columns[..side].iter_mut().enumerate() {
        let [west, east] = lens.columns(i as i32);
        columns.ahead = lesser(lens.forward[0], west, east) - stage.slack;
        columns.far = square(farther(west, east) + stage.slack);
    }
    for y in 0..side {
        rows.above[y] = 0;
        let [south, north] = lens.rows(y as i32);
        let ahead = lesser(lens.forward[1], south, north);
        let far = square(farther(south, north) + stage.slack);
        let mut asked = rows.cells[y] & rows.whole[y] & rows.seen[y];
        while asked != 0 {
            let x = asked.trailing_zeros() as usize;
            asked &= asked - 1;
            let down = stage.down[stage.block(lens.level, x, y)];
            let reach = Reach { ahead: columns[x].ahead + down + ahead, far: columns[x].far + far };
            rows.above[y] |= u64::from(judge.look(reach, rows.errors[rows.index(x, y)])) << x;
        }
    }
    judge.judged()
}

/// How far the farther of two ends is.
#[inline(always)]
fn farther(low: f32, high: f32) -> f32 {
    if -low > high { -low } else { high }
}

/// How far a cell is ahead at least (m), and how far from the plumb line through the eye at most (square of m).
#[derive(Clone, Copy, Default)]
struct Reach {
    ahead: f32,
    far: f32,
}

/// The bound is f·ρ·dz/w²: whether it is above the tolerance is told by squares, without a root or a quotient. The greatest one asks for a quotient
/// where it may grow, which is seldom.
struct Judge {
    /// Square of a bound (pixels) to that of ρ·dz/w².
    scale: f32,
    stretch: f32,
    /// The square that is too much.
    limit: f32,
    /// The greatest squares of what is not too much, and of what is.
    worst: f32,
    most: f32,
    apart: f32,
}

/// What rounding may take from a product that a quotient has.
const LESS: f32 = 1.0 - 1e-6;

impl Judge {
    fn new(lens: &Lens) -> Judge {
        let (seams, apart) = if lens.cuts { (SEAMS, 0.0) } else { (1.0, lens.tolerance / SEAMS) };
        let scale = square(seams * lens.focal * (1.0 + 1e-5));
        let limit = if lens.cuts { square(lens.tolerance) / scale } else { f32::INFINITY };
        Judge { scale, stretch: square(lens.stretch), limit, worst: 0.0, most: 0.0, apart }
    }

    /// Looks at a cell with an error (m): whether its bound is above the tolerance.
    #[inline(always)]
    fn look(&mut self, reach: Reach, error: f32) -> bool {
        let depth = square(if reach.ahead > View::NEAR { reach.ahead } else { View::NEAR });
        let widest = self.stretch * depth;
        let across = if reach.far < widest { reach.far } else { widest };
        let (moved, depth) = (error * error * across, depth * depth);
        let is_above = moved > self.limit * depth;
        let greatest = if is_above { &mut self.most } else { &mut self.worst };
        if moved > *greatest * LESS * depth {
            *greatest = greatest.max(moved / depth);
        }
        is_above
    }

    fn judged(&self) -> Judged {
        let pixels =
            |square: f32| if square > 0.0 { (square * self.scale).sqrt() * (1.0 + 1e-5) + self.apart } else { 0.0 };
        Judged { worst: pixels(self.worst), most: pixels(self.most) }
    }
}

/// Sixteen cells at once: where rows are shorter, several of them.
#[cfg(target_arch = "x86_64")]
mod wide {
    use super::*;
    use std::arch::x86_64::*;

    /// How far cells are ahead, and how far off, along one axis.
    #[target_feature(enable = "avx512f")]
    #[inline]
    fn reach(lens: &Lens, axis: usize, cells: __m512i, slack: f32) -> (__m512, __m512) {
        let [size, rest, beyond] = [lens.size[axis], lens.rest[axis], lens.beyond[axis]].map(|x| _mm512_set1_ps(x));
        let first = _mm512_add_epi32(cells, _mm512_set1_epi32(lens.cells[axis]));
        let last = _mm512_add_epi32(first, _mm512_set1_epi32(1));
        let low = _mm512_sub_ps(_mm512_sub_ps(_mm512_mul_ps(_mm512_cvtepi32_ps(first), size), rest), beyond);
        let high = _mm512_add_ps(_mm512_sub_ps(_mm512_mul_ps(_mm512_cvtepi32_ps(last), size), rest), beyond);
        let normal = lens.forward[axis];
        let ahead = _mm512_mul_ps(_mm512_set1_ps(normal), if normal > 0.0 { low } else { high });
        let far = _mm512_max_ps(_mm512_sub_ps(_mm512_set1_ps(-0.0), low), high);
        let far = _mm512_add_ps(far, _mm512_set1_ps(slack));
        (ahead, _mm512_mul_ps(far, far))
    }

    /// [`Judge::look`] for sixteen cells, of which those that are `asked` count among the greatest.
    #[target_feature(enable = "avx512f")]
    #[inline]
    fn look(judge: &mut Judge, ahead: __m512, far: __m512, errors: __m512, asked: u16) -> u16 {
        let depth = _mm512_max_ps(ahead, _mm512_set1_ps(View::NEAR));
        let depth = _mm512_mul_ps(depth, depth);
        let across = _mm512_min_ps(far, _mm512_mul_ps(_mm512_set1_ps(judge.stretch), depth));
        let moved = _mm512_mul_ps(_mm512_mul_ps(errors, errors), across);
        let depth = _mm512_mul_ps(depth, depth);
        let than = |square: f32| _mm512_mul_ps(_mm512_set1_ps(square), depth);
        let above = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(moved, than(judge.limit)) & asked;
        let below = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(moved, than(judge.worst * LESS)) & asked & !above;
        let beyond = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(above, moved, than(judge.most * LESS));
        if below | beyond != 0 {
            let bounds = _mm512_div_ps(moved, depth);
            judge.worst = judge.worst.max(_mm512_reduce_max_ps(_mm512_maskz_mov_ps(below, bounds)));
            judge.most = judge.most.max(_mm512_reduce_max_ps(_mm512_maskz_mov_ps(beyond, bounds)));
        }
        above
    }

    /// [`judge_rows`](super::judge_rows) where the processor has AVX-512: twice to four times as fast.
    #[target_feature(enable = "avx512f")]
    pub fn judge(lens: &Lens, stage: &Stage, rows: &mut Rows) -> Judged {
        let (level, side, slack) = (lens.level, 1usize << lens.level, stage.slack);
        let mut judge = Judge::new(lens);
        let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        // SAFETY: sixteen numbers are sixty-four bytes.
        let down = unsafe { _mm512_loadu_ps(stage.down.as_ptr()) };
        // Cells along a block; where there are no blocks in the level, all of them are the first.
        let block = _mm_cvtsi64_si128(if level < BLOCKS { 31 } else { i64::from(level - BLOCKS) });
        let down = if level < BLOCKS { _mm512_set1_ps(stage.down[ACROSS * ACROSS]) } else { down };
        if side < LANES {
            let mut cells = 0u64;
            for y in 0..side {
                cells |= (rows.cells[y] & rows.whole[y] & rows.seen[y]) << (y * side);
            }
            let columns = _mm512_and_si512(lanes, _mm512_set1_epi32(side as i32 - 1));
            let (x_ahead, x_far) = reach(lens, 0, columns, slack);
            let x_ahead = _mm512_sub_ps(x_ahead, _mm512_set1_ps(slack));
            let mut above = 0u64;
            for (part, errors) in rows.errors.as_chunks::<LANES>().0[..(side * side).div_ceil(LANES)].iter().enumerate()
            {
                let at = part * LANES;
                let y = _mm512_add_epi32(lanes, _mm512_set1_epi32(at as i32));
                let y = _mm512_srl_epi32(y, _mm_cvtsi64_si128(level.into()));
                let (y_ahead, y_far) = reach(lens, 1, y, slack);
                let blocks = _mm512_slli_epi32::<{ BLOCKS as u32 }>(_mm512_srl_epi32(y, block));
                let blocks = _mm512_add_epi32(blocks, _mm512_srl_epi32(columns, block));
                let ahead = _mm512_add_ps(x_ahead, _mm512_permutexvar_ps(blocks, down));
                // SAFETY: sixteen numbers are sixty-four bytes.
                let errors = unsafe { _mm512_loadu_ps(errors.as_ptr()) };
                let (ahead, far) = (_mm512_add_ps(ahead, y_ahead), _mm512_add_ps(x_far, y_far));
                above |= u64::from(look(&mut judge, ahead, far, errors, (cells >> at) as u16)) << at;
            }
            for y in 0..side {
                rows.above[y] = above >> (y * side) & ((1 << side) - 1);
            }
            return judge.judged();
        }
        let mut columns = [(_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_si512()); SIDE / LANES];
        for (part, columns) in columns[..side / LANES].iter_mut().enumerate() {
            let x = _mm512_add_epi32(lanes, _mm512_set1_epi32((part * LANES) as i32));
            let (ahead, far) = reach(lens, 0, x, slack);
            *columns = (_mm512_sub_ps(ahead, _mm512_set1_ps(slack)), far, _mm512_srl_epi32(x, block));
        }
        let (mut sixteen_ahead, mut sixteen_far) = (_mm512_setzero_ps(), _mm512_setzero_ps());
        for y in 0..side {
            if y % LANES == 0 {
                let y = _mm512_add_epi32(lanes, _mm512_set1_epi32(y as i32));
                (sixteen_ahead, sixteen_far) = reach(lens, 1, y, slack);
            }
            let asked = rows.cells[y] & rows.whole[y] & rows.seen[y];
            rows.above[y] = 0;
            if asked == 0 {
                continue;
            }
            let lane = _mm512_set1_epi32((y % LANES) as i32);
            let y_ahead = _mm512_permutexvar_ps(lane, sixteen_ahead);
            let y_far = _mm512_permutexvar_ps(lane, sixteen_far);
            let blocks = _mm512_set1_epi32(((y >> (level - BLOCKS)) << BLOCKS) as i32);
            let mut above = 0;
            for (part, &(ahead, far, block)) in columns[..side / LANES].iter().enumerate() {
                let (at, cells) = (part * LANES, (asked >> (part * LANES)) as u16);
                if cells == 0 {
                    continue;
                }
                let down = _mm512_permutexvar_ps(_mm512_add_epi32(blocks, block), down);
                let ahead = _mm512_add_ps(_mm512_add_ps(ahead, down), y_ahead);
                let errors = rows.errors[rows.index(at, y)..][..LANES].as_ptr();
                // SAFETY: sixteen numbers are sixty-four bytes.
                let errors = unsafe { _mm512_loadu_ps(errors) };
                above |= u64::from(look(&mut judge, ahead, _mm512_add_ps(far, y_far), errors, cells)) << at;
            }
            rows.above[y] = above;
        }
        judge.judged()
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::page::Asked;
    use super::*;
    use crate::field::{Land, Raster};
    use crate::lod::ScreenMetric;
    use crate::space::Cell;
    use glam::{DVec2, DVec3, UVec2};

    /// Sixteen cells at once are judged as single ones are.
    #[test]
    #[cfg(target_arch = "x86_64")]
    fn cells_are_judged_alike_by_all_processors() {
        if !std::arch::is_x86_feature_detected!("avx512f") {
            println!("this processor has no AVX-512: not tested");
            return;
        }
        let bumps = (0..129 * 129).map(|i| ((i * 7919) % 101) as f32 * 0.1).collect();
        let land = Land::new(Raster::new(129, 129, DVec2::new(3.0, 5.0), bumps).expect("valid"));
        let (mut state, mut above) = (7u64, 0);
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            state ^ state >> 29
        };
        for (eye, tolerance) in [((-40.0, 60.0, 130.0), 9.0), ((-900.0, 90.0, 20.0), 4.0), ((0.0, 0.0, 400.0), 0.5)] {
            let view = View::looking_at(DVec3::from(eye), DVec3::Z, 0.8, UVec2::new(320, 200));
            let metric = ScreenMetric::new(&view, crate::field::HeightField::datum(&land)).expect("a view");
            let page = Cell { level: 1, x: 1, y: 0, face: 0 };
            let asked = Asked::new(&land, &metric, tolerance, 9);
            let stage = Stage::new(&asked, page, 6);
            for (level, cuts) in (1..=6).flat_map(|level| [(level, true), (level, false)]) {
                let lens = Lens::new(&asked, Cell { level: 1 + level, x: 1 << level, y: 0, face: 0 }, level, cuts);
                let rows = |random: &mut dyn FnMut() -> u64| {
                    let mut rows = Rows::default();
                    rows.room(level);
                    let side = 1usize << level;
                    let all = u64::MAX >> (64 - side);
                    rows.cells[..side].fill_with(|| random() & all);
                    rows.whole[..side].fill_with(|| random() | random());
                    rows.seen[..side].fill_with(|| random() | random());
                    rows.errors.fill_with(|| (random() >> 40) as f32 * 3e-7);
                    rows
                };
                let mut rows = rows(&mut random);
                let one = judge_rows(&lens, &stage, &mut rows);
                let said = rows.above;
                // SAFETY: the processor has just been asked.
                let other = unsafe { wide::judge(&lens, &stage, &mut rows) };
                assert_eq!(said, rows.above, "level {level}");
                assert_eq!((one.worst, one.most), (other.worst, other.most), "level {level}");
                above += said.iter().map(|bits| bits.count_ones()).sum::<u32>();
            }
        }
        assert!((1000..10_000).contains(&above), "{above} above");
    }
}
