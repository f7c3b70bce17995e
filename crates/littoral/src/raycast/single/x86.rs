//! The looks of `single.rs` with AVX-512; and as they are, with what AVX2 and FMA make of them.

use super::*;
use std::arch::x86_64::*;

/// Sixteen lanes of AVX-512 F, BW, DQ and VL.
#[derive(Clone, Copy)]
struct Avx512 {
    /// The odd lanes, and the lower word of each lane: in registers from the ray's beginning to its end.
    odd: __mmask16,
    words: __mmask32,
    /// The upper half of the lanes, and the lower.
    upper: __mmask16,
    lower: __mmask16,
}

/// The kernel compiled for AVX-512.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
pub(super) fn first_hit(land: &Single, ray: &LocalRay) -> f32 {
    let (mut odd, mut words, mut upper, mut lower) = (0xAAAA_u16, 0x5555_5555_u32, 0xFF00_u16, 0xFF_u16);
    // SAFETY: no instruction at all; the masks stay what they are, and the compiler does not know them.
    unsafe {
        std::arch::asm!(
            "/* {0} {1} {2} {3} */",
            inout(kreg) odd,
            inout(kreg) words,
            inout(kreg) upper,
            inout(kreg) lower,
            options(nomem, nostack, preserves_flags)
        );
    }
    land.walk(Avx512 { odd, words, upper, lower }, ray)
}

/// The looks in plain Rust, where a · b + c is one instruction.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
pub(super) fn portable(land: &Single, ray: &LocalRay) -> f32 {
    land.walk(Portable, ray)
}

const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
const UP: i32 = _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC;

// Functions rather than closures: a closure is compiled by itself, without the features of the function around it.

/// The same place, which the compiler no longer recognizes: what is there is read where it is needed, by the instruction
/// that needs it, not ahead of the loop into a register that then has to be saved.
#[inline(always)]
#[allow(clippy::pointers_in_nomem_asm_block, reason = "no instruction is there to read or write")]
fn anew<T>(place: &T) -> &T {
    let mut pointer: *const T = place;
    // SAFETY: no instruction at all; the pointer stays what it is.
    unsafe {
        std::arch::asm!("/* {0} */", inout(reg) pointer, options(nomem, nostack, preserves_flags));
        &*pointer
    }
}

/// Rows 0 to 3 and 1 to 4 of eight samples each.
///
/// # Safety
/// They are there.
#[inline(always)]
unsafe fn fetch(land: &Single, octant: &Octant, corner: usize) -> [[__m512; 2]; 2] {
    unsafe {
        let first = land.heights.as_ptr().add(corner).offset(octant.start);
        let row = |index: isize| _mm256_loadu_ps(first.offset(index * octant.line));
        let two = |a: __m256, b: __m256| _mm512_insertf32x8::<1>(_mm512_castps256_ps512(a), b);
        let rows = [row(0), row(1), row(2), row(3), row(4)];
        [[two(rows[0], rows[1]), two(rows[2], rows[3])], [two(rows[1], rows[2]), two(rows[3], rows[4])]]
    }
}

impl Avx512 {
    /// Numbers of two tables of 32: of the first for the lower lanes, of the second for the upper.
    #[inline(always)]
    fn pick(self, [near, far]: [[__m512; 2]; 2], index: __m512i) -> __m512 {
        unsafe {
            let picked = _mm512_mask2_permutex2var_ps(near[0], index, self.lower, near[1]);
            _mm512_mask2_permutex2var_ps(far[0], _mm512_castps_si512(picked), self.upper, far[1])
        }
    }
}

/// Height of the ray over bilinear patches at s.
#[inline(always)]
fn over([slope, fall, column, behind, height]: [__m512; 5], [rise, across, twist]: [__m512; 3], s: __m512) -> __m512 {
    unsafe {
        let u = _mm512_sub_ps(s, column);
        let v = _mm512_fmadd_ps(slope, s, behind);
        let z = _mm512_fmadd_ps(fall, s, height);
        let z = _mm512_fnmadd_ps(u, rise, z);
        _mm512_fnmadd_ps(v, _mm512_fmadd_ps(twist, u, across), z)
    }
}

#[cold]
#[inline(never)]
fn at_the_border<const X: bool>(land: &Single, octant: &Octant, way: &Way, nodes: [Node; 2]) -> Option<Met> {
    Portable.patches::<X>(land, octant, way, nodes)
}

impl Looks for Avx512 {
    #[inline(always)]
    fn fused(self, a: Vec4, b: Vec4, c: Vec4) -> Vec4 {
        unsafe { _mm_fmadd_ps(a.into(), b.into(), c.into()).into() }
    }

    #[inline(always)]
    unsafe fn floor(self, number: f32) -> i32 {
        unsafe { _mm_cvt_roundss_i32::<DOWN>(_mm_set_ss(number)) }
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
        let way = anew(way);
        let (row_at, slope) = way.row::<X>();
        let (highs, tables) = (&block.0, anew(octant.tables));
        unsafe {
            // SAFETY: sixteen and sixty-four numbers, as many as are loaded and stored; the frame is the caller's.
            let columns = _mm512_load_ps(floor.columns.0.as_ptr());
            let table = _mm512_load_si512(tables.nodes.0.as_ptr().cast());
            let (south, north) =
                (_mm512_load_si512(highs.as_ptr().cast()), _mm512_load_si512(highs[32..].as_ptr().cast()));
            let column = _mm512_add_ps(columns, _mm512_set1_ps(*anew(first)));
            _mm512_store_ps((*frame).columns.0.as_mut_ptr(), column);
            let enter = _mm512_max_ps(column, _mm512_set1_ps(way.from));
            let next = _mm512_add_ps(column, _mm512_set1_ps(floor.side));
            let leave = _mm512_min_ps(next, _mm512_set1_ps(way.end));
            let edge = _mm512_mask_blend_ps(self.odd, enter, leave);
            let row = _mm512_fmadd_ps(_mm512_set1_ps(slope), edge, _mm512_set1_ps(row_at));
            let row = _mm512_cvt_roundps_epi32::<DOWN>(row);
            let row = _mm512_sra_epi32(row, _mm_load_si128((&raw const floor.shift).cast()));
            _mm512_store_si512((*frame).rows.0.as_mut_ptr().cast(), row);
            let row = _mm512_sub_epi32(row, _mm512_set1_epi32(anew(&*frame).node[1]));
            let lowest = _mm512_mask_blend_ps(octant.falls, enter, leave);
            let lowest = _mm512_fmadd_ps(_mm512_set1_ps(way.steps_rate.z), lowest, _mm512_set1_ps(way.steps.z));
            let lowest = _mm512_max_ps(lowest, _mm512_set1_ps(tables.one));
            let never = _mm512_castps_si512(lowest);
            let lowest = _mm512_cvt_roundps_epi32::<UP>(lowest);
            let index = _mm512_xor_si512(table, if X { _mm512_slli_epi32::<3>(row) } else { row });
            let high = _mm512_maskz_permutex2var_epi16(self.words, south, index, north);
            let inside = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(enter, leave);
            let inside = _mm512_mask_cmplt_epu32_mask(inside, row, _mm512_set1_epi32(tables.eight));
            // The row left counts if it is not the row entered; a row entered always does, no row being what the bits of 1.0 and
            // more say.
            let entered = _mm512_mask_shuffle_epi32::<0b10_10_00_00>(never, self.odd, row);
            let inside = _mm512_mask_cmpneq_epi32_mask(inside, row, entered);
            u32::from(_mm512_mask_cmple_epu32_mask(inside, lowest, high))
        }
    }

    #[inline(always)]
    fn patches<const X: bool>(self, land: &Single, octant: &Octant, way: &Way, nodes: [Node; 2]) -> Option<Met> {
        let [this, other] = nodes;
        // At the map's north and east the samples of fewer patches must do.
        if this.x.max(other.x) >= land.whole[0] || this.y.max(other.y) >= land.whole[1] {
            return at_the_border::<X>(land, octant, &{ *way }, nodes);
        }
        let corners = nodes.map(|node| 4 * (node.y * land.columns + node.x));
        let way = anew(way);
        let (land, octant) = (anew(land), anew(octant));
        let (row_at, slope) = way.row::<X>();
        unsafe {
            let tables = anew(octant.tables);
            let columns = _mm512_load_ps(tables.columns.0.as_ptr());
            let odd = _mm512_load_ps(tables.rows.0.as_ptr());
            let (zero, one) = (_mm512_setzero_ps(), _mm512_set1_ps(tables.one));
            let first = _mm512_set1_ps(*anew(this.first));
            let first = _mm512_mask_blend_ps(self.upper, first, _mm512_set1_ps(*anew(other.first)));
            let rows = _mm512_set1_epi32(*anew(this.row));
            let rows = _mm512_mask_blend_epi32(self.upper, rows, _mm512_set1_epi32(*anew(other.row)));
            let column = _mm512_add_ps(columns, first);
            let enter = _mm512_max_ps(column, _mm512_set1_ps(way.start));
            let leave = _mm512_min_ps(_mm512_add_ps(column, one), _mm512_set1_ps(way.end));
            let base = _mm512_set1_ps(row_at);
            let inverse = _mm512_set1_ps(way.inverse_slope::<X>());
            let slope = _mm512_set1_ps(slope);
            let row = _mm512_roundscale_ps::<DOWN>(_mm512_fmadd_ps(slope, enter, base));
            let row = _mm512_add_ps(row, odd);
            let place = _mm512_sub_epi32(_mm512_cvttps_epi32(row), _mm512_slli_epi32::<2>(rows));
            // The line beyond the row is crossed at the piece's end; with the next it begins.
            let behind = _mm512_sub_ps(base, row);
            let b = _mm512_min_ps(_mm512_fnmadd_ps(behind, inverse, inverse), leave);
            let a = _mm512_mask_moveldup_ps(enter, self.odd, b);
            let valid = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b);
            let valid = _mm512_mask_cmplt_epu32_mask(valid, place, _mm512_set1_epi32(tables.four));

            // SAFETY: five rows of eight samples, of which five are looked at; nodes that are whole have as many, and where rows
            // are mirrored they are the same ones from the other end.
            let near = fetch(land, octant, corners[0]);
            let far = fetch(land, octant, corners[1]);
            let tables = &tables.samples;
            let place = if X {
                _mm512_slli_epi32::<3>(place)
            } else {
                _mm512_xor_si512(place, _mm512_set1_epi32(octant.mirror[1] & 3))
            };
            let this = _mm512_add_epi32(place, _mm512_load_si512(tables[0].0.as_ptr().cast()));
            let that = _mm512_add_epi32(place, _mm512_load_si512(tables[1].0.as_ptr().cast()));
            let (corner, beside) = (self.pick([near[0], far[0]], this), self.pick([near[0], far[0]], that));
            let (beyond, last) = (self.pick([near[1], far[1]], this), self.pick([near[1], far[1]], that));
            let (next, aside) = if X { (beside, beyond) } else { (beyond, beside) };
            let (rise, across) = (_mm512_sub_ps(next, corner), _mm512_sub_ps(aside, corner));
            let twist = _mm512_sub_ps(_mm512_sub_ps(last, aside), rise);

            let height = _mm512_sub_ps(_mm512_set1_ps(way.at.z), corner);
            let fall = _mm512_set1_ps(way.rate.z);
            let lines = [slope, fall, column, behind, height];
            let (f0, f1) = (over(lines, [rise, across, twist], a), over(lines, [rise, across, twist], b));
            let length = _mm512_sub_ps(b, a);
            let bend = _mm512_mul_ps(_mm512_mul_ps(twist, slope), _mm512_mul_ps(length, length));
            let bend = _mm512_sub_ps(zero, bend);
            let near = _mm512_max_ps(zero, bend);
            let near = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, _mm512_min_ps(f0, f1), near);
            if near == 0 {
                return None;
            }
            let slope = _mm512_sub_ps(_mm512_sub_ps(f1, f0), bend);
            let disc = _mm512_mul_ps(_mm512_mul_ps(_mm512_set1_ps(4.0), bend), f0);
            let disc = _mm512_fmsub_ps(slope, slope, disc);
            let falls = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(slope, zero);
            let dips = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(falls, zero, disc);
            let turns = _mm512_add_ps(slope, _mm512_add_ps(bend, bend));
            let dips = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(dips, zero, turns);
            let under = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(_mm512_min_ps(f0, f1), zero);
            let hit = near & (under | dips);
            if hit == 0 {
                return None;
            }
            let root = _mm512_sqrt_ps(_mm512_max_ps(disc, zero));
            let above = _mm512_mask_blend_ps(falls, _mm512_add_ps(slope, root), _mm512_add_ps(f0, f0));
            let under = _mm512_mul_ps(_mm512_set1_ps(-2.0), bend);
            let under = _mm512_mask_blend_ps(falls, under, _mm512_sub_ps(root, slope));
            let root = _mm512_min_ps(_mm512_div_ps(above, under), one);
            let root = _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(zero, f0), root);
            let s = _mm512_fmadd_ps(root, length, a);
            let below = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(f0, zero);
            let first = hit & hit.wrapping_neg();
            let s = _mm512_cvtss_f32(_mm512_maskz_compress_ps(first, s));
            Some(Met { s, below: below & first != 0 })
        }
    }
}
