//! Several numbers at once: the one abstraction that the ray kernels are written in.
//!
//! A kernel is generic over [`Lanes`] and inlined into an entry point compiled for one set of processor features (the
//! pattern of the `memchr` crate). A value of a `Lanes` type is the proof that its processor features are there, which
//! makes its methods safe. No operation contracts what is written apart or approximates, and comparisons treat NaN alike, so that every
//! implementation gives the same bits.

/// Arithmetic on `COUNT` lanes of `f32` and `i32`.
pub(super) trait Lanes: Copy {
    const COUNT: usize;
    type F: Copy;
    type I: Copy;
    type M: Copy;

    fn splat(self, value: f32) -> Self::F;
    fn int(self, value: i32) -> Self::I;
    fn load(self, from: &[f32]) -> Self::F;
    fn load_int(self, from: &[i32]) -> Self::I;
    fn store(self, value: Self::F, to: &mut [f32]);
    fn store_int(self, value: Self::I, to: &mut [i32]);

    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a · b + c, rounded once.
    fn fused(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// c − a · b, rounded once.
    fn fused_from(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    fn sqrt(self, a: Self::F) -> Self::F;
    /// `b` unless `a < b`.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `b` unless `a > b`.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// `a` where the mask is set, else `b`.
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// The least of the lanes, none of them NaN.
    fn least(self, a: Self::F) -> f32;
    /// Exclusive or of the bits with those of an integer: flips signs.
    fn flip(self, a: Self::F, bits: Self::I) -> Self::F;

    /// The bits of numbers as integers.
    fn to_bits(self, a: Self::F) -> Self::I;
    fn float(self, a: Self::I) -> Self::F;
    /// The greatest integer that is not greater; numbers outside the range of `i32` give anything.
    fn floor(self, a: Self::F) -> Self::I;
    fn iadd(self, a: Self::I, b: Self::I) -> Self::I;
    fn isub(self, a: Self::I, b: Self::I) -> Self::I;
    fn imul(self, a: Self::I, b: Self::I) -> Self::I;
    fn iand(self, a: Self::I, b: Self::I) -> Self::I;
    fn ixor(self, a: Self::I, b: Self::I) -> Self::I;
    fn imin(self, a: Self::I, b: Self::I) -> Self::I;
    fn imax(self, a: Self::I, b: Self::I) -> Self::I;
    /// Shifts by amounts outside 0..32 give 0.
    fn shl(self, a: Self::I, by: Self::I) -> Self::I;
    /// Logical; shifts by amounts outside 0..32 give 0.
    fn shr(self, a: Self::I, by: Self::I) -> Self::I;
    fn igt(self, a: Self::I, b: Self::I) -> Self::M;
    fn ieq(self, a: Self::I, b: Self::I) -> Self::M;
    fn iselect(self, mask: Self::M, a: Self::I, b: Self::I) -> Self::I;

    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// `a` and not `b`.
    fn without(self, a: Self::M, b: Self::M) -> Self::M;
    /// One bit a lane, the first lane lowest.
    fn bits(self, mask: Self::M) -> u32;
    fn mask(self, bits: u32) -> Self::M;

    /// `table[index & 15]`.
    fn lookup(self, table: &[i32; 16], index: Self::I) -> Self::I;
    /// Lanes of the mask take the next numbers of `from`, in order; the others keep theirs. `from` must hold `COUNT`.
    fn expand(self, old: Self::F, mask: Self::M, from: &[f32]) -> Self::F;
    fn expand_int(self, old: Self::I, mask: Self::M, from: &[i32]) -> Self::I;

    /// The first numbers of the first `COUNT` rows, their second ones, and so on.
    fn columns(self, rows: [&[f32; 8]; 16]) -> [Self::F; 8];

    /// `from[index]` where the mask is set, elsewhere 0.
    ///
    /// # Safety
    /// Where the mask is set `index` and `index + 1` lie within `from`.
    unsafe fn gather_u16(self, mask: Self::M, from: &[u16], index: Self::I) -> Self::I;
    /// `from[index]` and `from[index + 1]` where the mask is set, elsewhere 0.
    ///
    /// # Safety
    /// Where the mask is set `index` and `index + 1` lie within `from`, which holds two numbers at least.
    unsafe fn gather_pair(self, mask: Self::M, from: &[f32], index: Self::I) -> (Self::F, Self::F);
}

/// Eight lanes in plain Rust, for any processor.
#[derive(Clone, Copy)]
pub(super) struct Portable;

/// Applies a function to each lane.
#[inline(always)]
fn each<T: Copy, U>(a: [T; 8], mut f: impl FnMut(T) -> U) -> [U; 8] {
    std::array::from_fn(|i| f(a[i]))
}

#[inline(always)]
fn both<T: Copy, U>(a: [T; 8], b: [T; 8], mut f: impl FnMut(T, T) -> U) -> [U; 8] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn pick<T: Copy>(mask: [bool; 8], a: [T; 8], b: [T; 8]) -> [T; 8] {
    std::array::from_fn(|i| if mask[i] { a[i] } else { b[i] })
}

#[inline(always)]
fn first<T: Copy>(from: &[T]) -> [T; 8] {
    std::array::from_fn(|i| from[i])
}

#[inline(always)]
fn expanded<T: Copy>(old: [T; 8], mask: [bool; 8], from: &[T]) -> [T; 8] {
    let mut next = from.iter();
    std::array::from_fn(|i| if mask[i] { next.next().copied().unwrap_or(old[i]) } else { old[i] })
}

#[rustfmt::skip]
impl Lanes for Portable {
    const COUNT: usize = 8;
    type F = [f32; 8];
    type I = [i32; 8];
    type M = [bool; 8];

    #[inline(always)] fn splat(self, value: f32) -> Self::F { [value; 8] }
    #[inline(always)] fn int(self, value: i32) -> Self::I { [value; 8] }
    #[inline(always)] fn load(self, from: &[f32]) -> Self::F { first(from) }
    #[inline(always)] fn load_int(self, from: &[i32]) -> Self::I { first(from) }
    #[inline(always)] fn store(self, value: Self::F, to: &mut [f32]) { to[..8].copy_from_slice(&value) }
    #[inline(always)] fn store_int(self, value: Self::I, to: &mut [i32]) { to[..8].copy_from_slice(&value) }
    #[inline(always)] fn add(self, a: Self::F, b: Self::F) -> Self::F { both(a, b, |a, b| a + b) }
    #[inline(always)] fn sub(self, a: Self::F, b: Self::F) -> Self::F { both(a, b, |a, b| a - b) }
    #[inline(always)] fn mul(self, a: Self::F, b: Self::F) -> Self::F { both(a, b, |a, b| a * b) }
    #[inline(always)] fn fused(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F { std::array::from_fn(|i| a[i].mul_add(b[i], c[i])) }
    #[inline(always)] fn fused_from(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F { std::array::from_fn(|i| (-a[i]).mul_add(b[i], c[i])) }
    #[inline(always)] fn div(self, a: Self::F, b: Self::F) -> Self::F { both(a, b, |a, b| a / b) }
    #[inline(always)] fn sqrt(self, a: Self::F) -> Self::F { each(a, f32::sqrt) }
    #[inline(always)] fn min(self, a: Self::F, b: Self::F) -> Self::F { both(a, b, |a, b| if a < b { a } else { b }) }
    #[inline(always)] fn max(self, a: Self::F, b: Self::F) -> Self::F { both(a, b, |a, b| if a > b { a } else { b }) }
    #[inline(always)] fn lt(self, a: Self::F, b: Self::F) -> Self::M { both(a, b, |a, b| a < b) }
    #[inline(always)] fn le(self, a: Self::F, b: Self::F) -> Self::M { both(a, b, |a, b| a <= b) }
    #[inline(always)] fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F { pick(mask, a, b) }
    #[inline(always)] fn least(self, a: Self::F) -> f32 { a.into_iter().fold(f32::INFINITY, |a, b| if b < a { b } else { a }) }
    #[inline(always)] fn flip(self, a: Self::F, bits: Self::I) -> Self::F { std::array::from_fn(|i| f32::from_bits(a[i].to_bits() ^ bits[i] as u32)) }
    #[inline(always)] fn to_bits(self, a: Self::F) -> Self::I { each(a, |a| a.to_bits() as i32) }
    #[inline(always)] fn float(self, a: Self::I) -> Self::F { each(a, |a| a as f32) }
    #[inline(always)] fn floor(self, a: Self::F) -> Self::I { each(a, |a| { let i = a as i32; if i as f32 > a { i.wrapping_sub(1) } else { i } }) }
    #[inline(always)] fn iadd(self, a: Self::I, b: Self::I) -> Self::I { both(a, b, i32::wrapping_add) }
    #[inline(always)] fn isub(self, a: Self::I, b: Self::I) -> Self::I { both(a, b, i32::wrapping_sub) }
    #[inline(always)] fn imul(self, a: Self::I, b: Self::I) -> Self::I { both(a, b, i32::wrapping_mul) }
    #[inline(always)] fn iand(self, a: Self::I, b: Self::I) -> Self::I { both(a, b, |a, b| a & b) }
    #[inline(always)] fn ixor(self, a: Self::I, b: Self::I) -> Self::I { both(a, b, |a, b| a ^ b) }
    #[inline(always)] fn imin(self, a: Self::I, b: Self::I) -> Self::I { both(a, b, i32::min) }
    #[inline(always)] fn imax(self, a: Self::I, b: Self::I) -> Self::I { both(a, b, i32::max) }
    #[inline(always)] fn shl(self, a: Self::I, by: Self::I) -> Self::I { both(a, by, |a, by| if by as u32 > 31 { 0 } else { a << by }) }
    #[inline(always)] fn shr(self, a: Self::I, by: Self::I) -> Self::I { both(a, by, |a, by| if by as u32 > 31 { 0 } else { (a as u32 >> by) as i32 }) }
    #[inline(always)] fn igt(self, a: Self::I, b: Self::I) -> Self::M { both(a, b, |a, b| a > b) }
    #[inline(always)] fn ieq(self, a: Self::I, b: Self::I) -> Self::M { both(a, b, |a, b| a == b) }
    #[inline(always)] fn iselect(self, mask: Self::M, a: Self::I, b: Self::I) -> Self::I { pick(mask, a, b) }
    #[inline(always)] fn and(self, a: Self::M, b: Self::M) -> Self::M { both(a, b, |a, b| a & b) }
    #[inline(always)] fn or(self, a: Self::M, b: Self::M) -> Self::M { both(a, b, |a, b| a | b) }
    #[inline(always)] fn without(self, a: Self::M, b: Self::M) -> Self::M { both(a, b, |a, b| a & !b) }
    #[inline(always)] fn bits(self, mask: Self::M) -> u32 { mask.iter().enumerate().map(|(i, &m)| u32::from(m) << i).sum() }
    #[inline(always)] fn mask(self, bits: u32) -> Self::M { std::array::from_fn(|i| bits >> i & 1 == 1) }
    #[inline(always)] fn lookup(self, table: &[i32; 16], index: Self::I) -> Self::I { each(index, |i| table[i as usize & 15]) }
    #[inline(always)] fn expand(self, old: Self::F, mask: Self::M, from: &[f32]) -> Self::F { expanded(old, mask, from) }
    #[inline(always)] fn expand_int(self, old: Self::I, mask: Self::M, from: &[i32]) -> Self::I { expanded(old, mask, from) }
    #[inline(always)] fn columns(self, rows: [&[f32; 8]; 16]) -> [Self::F; 8] {
        std::array::from_fn(|column| std::array::from_fn(|row| rows[row][column]))
    }
    #[inline(always)] unsafe fn gather_u16(self, mask: Self::M, from: &[u16], index: Self::I) -> Self::I {
        // SAFETY: promised by the caller.
        std::array::from_fn(|i| if mask[i] { unsafe { i32::from(*from.get_unchecked(index[i] as usize)) } } else { 0 })
    }
    #[inline(always)] unsafe fn gather_pair(self, mask: Self::M, from: &[f32], index: Self::I) -> (Self::F, Self::F) {
        // SAFETY: promised by the caller.
        let pick = |by: usize| std::array::from_fn(|i| if mask[i] { unsafe { *from.get_unchecked(index[i] as usize + by) } } else { 0.0 });
        (pick(0), pick(1))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
#[allow(
    clippy::undocumented_unsafe_blocks,
    reason = "every block but those of gathers has the same: a value of the type proves the features"
)]
mod x86 {
    use super::Lanes;
    use std::arch::x86_64::*;

    /// Eight lanes of AVX2.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(());

    impl Avx2 {
        /// # Safety
        /// The processor has AVX2, and the caller is compiled for it.
        #[inline(always)]
        pub unsafe fn new() -> Avx2 {
            Avx2(())
        }
    }

    /// For each mask of eight lanes, which number each lane takes when numbers are dealt out in order: a nibble a lane.
    const EXPANSION: [u32; 256] = {
        let mut table = [0u32; 256];
        let mut mask = 0;
        while mask < 256 {
            let (mut lane, mut next) = (0, 0);
            while lane < 8 {
                if mask >> lane & 1 == 1 {
                    table[mask] |= next << (4 * lane);
                    next += 1;
                }
                lane += 1;
            }
            mask += 1;
        }
        table
    };

    impl Avx2 {
        #[inline(always)]
        fn expansion(self, mask: __m256) -> __m256i {
            unsafe {
                let nibbles = _mm256_set1_epi32(EXPANSION[_mm256_movemask_ps(mask) as usize] as i32);
                let shifted = _mm256_srlv_epi32(nibbles, _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28));
                _mm256_and_si256(shifted, _mm256_set1_epi32(7))
            }
        }
    }

    #[rustfmt::skip]
    impl Lanes for Avx2 {
        const COUNT: usize = 8;
        type F = __m256;
        type I = __m256i;
        type M = __m256;

        #[inline(always)] fn splat(self, value: f32) -> Self::F { unsafe { _mm256_set1_ps(value) } }
        #[inline(always)] fn int(self, value: i32) -> Self::I { unsafe { _mm256_set1_epi32(value) } }
        #[inline(always)] fn load(self, from: &[f32]) -> Self::F { assert!(from.len() >= 8); unsafe { _mm256_loadu_ps(from.as_ptr()) } }
        #[inline(always)] fn load_int(self, from: &[i32]) -> Self::I { assert!(from.len() >= 8); unsafe { _mm256_loadu_si256(from.as_ptr().cast()) } }
        #[inline(always)] fn store(self, value: Self::F, to: &mut [f32]) { assert!(to.len() >= 8); unsafe { _mm256_storeu_ps(to.as_mut_ptr(), value) } }
        #[inline(always)] fn store_int(self, value: Self::I, to: &mut [i32]) { assert!(to.len() >= 8); unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), value) } }
        #[inline(always)] fn add(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm256_add_ps(a, b) } }
        #[inline(always)] fn sub(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm256_sub_ps(a, b) } }
        #[inline(always)] fn mul(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm256_mul_ps(a, b) } }
        #[inline(always)] fn fused(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F { unsafe { _mm256_fmadd_ps(a, b, c) } }
        #[inline(always)] fn fused_from(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F { unsafe { _mm256_fnmadd_ps(a, b, c) } }
        #[inline(always)] fn div(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm256_div_ps(a, b) } }
        #[inline(always)] fn sqrt(self, a: Self::F) -> Self::F { unsafe { _mm256_sqrt_ps(a) } }
        #[inline(always)] fn min(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm256_min_ps(a, b) } }
        #[inline(always)] fn max(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm256_max_ps(a, b) } }
        #[inline(always)] fn lt(self, a: Self::F, b: Self::F) -> Self::M { unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) } }
        #[inline(always)] fn le(self, a: Self::F, b: Self::F) -> Self::M { unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) } }
        #[inline(always)] fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm256_blendv_ps(b, a, mask) } }
        #[inline(always)] fn least(self, a: Self::F) -> f32 {
            unsafe {
                let a = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
                let a = _mm_min_ps(a, _mm_movehl_ps(a, a));
                _mm_cvtss_f32(_mm_min_ss(a, _mm_movehdup_ps(a)))
            }
        }
        #[inline(always)] fn flip(self, a: Self::F, bits: Self::I) -> Self::F { unsafe { _mm256_xor_ps(a, _mm256_castsi256_ps(bits)) } }
        #[inline(always)] fn to_bits(self, a: Self::F) -> Self::I { unsafe { _mm256_castps_si256(a) } }
        #[inline(always)] fn float(self, a: Self::I) -> Self::F { unsafe { _mm256_cvtepi32_ps(a) } }
        #[inline(always)] fn floor(self, a: Self::F) -> Self::I { unsafe { _mm256_cvttps_epi32(_mm256_floor_ps(a)) } }
        #[inline(always)] fn iadd(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_add_epi32(a, b) } }
        #[inline(always)] fn isub(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_sub_epi32(a, b) } }
        #[inline(always)] fn imul(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_mullo_epi32(a, b) } }
        #[inline(always)] fn iand(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_and_si256(a, b) } }
        #[inline(always)] fn ixor(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_xor_si256(a, b) } }
        #[inline(always)] fn imin(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_min_epi32(a, b) } }
        #[inline(always)] fn imax(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_max_epi32(a, b) } }
        #[inline(always)] fn shl(self, a: Self::I, by: Self::I) -> Self::I { unsafe { _mm256_sllv_epi32(a, by) } }
        #[inline(always)] fn shr(self, a: Self::I, by: Self::I) -> Self::I { unsafe { _mm256_srlv_epi32(a, by) } }
        #[inline(always)] fn igt(self, a: Self::I, b: Self::I) -> Self::M { unsafe { _mm256_castsi256_ps(_mm256_cmpgt_epi32(a, b)) } }
        #[inline(always)] fn ieq(self, a: Self::I, b: Self::I) -> Self::M { unsafe { _mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b)) } }
        #[inline(always)] fn iselect(self, mask: Self::M, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm256_blendv_epi8(b, a, _mm256_castps_si256(mask)) } }
        #[inline(always)] fn and(self, a: Self::M, b: Self::M) -> Self::M { unsafe { _mm256_and_ps(a, b) } }
        #[inline(always)] fn or(self, a: Self::M, b: Self::M) -> Self::M { unsafe { _mm256_or_ps(a, b) } }
        #[inline(always)] fn without(self, a: Self::M, b: Self::M) -> Self::M { unsafe { _mm256_andnot_ps(b, a) } }
        #[inline(always)] fn bits(self, mask: Self::M) -> u32 { unsafe { _mm256_movemask_ps(mask) as u32 } }
        #[inline(always)] fn mask(self, bits: u32) -> Self::M {
            unsafe {
                let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
                _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(bits as i32), lane), lane))
            }
        }
        #[inline(always)] fn lookup(self, table: &[i32; 16], index: Self::I) -> Self::I {
            unsafe {
                let low = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(table.as_ptr().cast()), index);
                let high = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(table.as_ptr().add(8).cast()), index);
                let upper = _mm256_slli_epi32::<28>(index);
                _mm256_castps_si256(_mm256_blendv_ps(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high), _mm256_castsi256_ps(upper)))
            }
        }
        #[inline(always)] fn expand(self, old: Self::F, mask: Self::M, from: &[f32]) -> Self::F {
            let dealt = unsafe { _mm256_permutevar8x32_ps(self.load(from), self.expansion(mask)) };
            self.select(mask, dealt, old)
        }
        #[inline(always)] fn expand_int(self, old: Self::I, mask: Self::M, from: &[i32]) -> Self::I {
            let dealt = unsafe { _mm256_permutevar8x32_epi32(self.load_int(from), self.expansion(mask)) };
            self.iselect(mask, dealt, old)
        }
        #[inline(always)] fn columns(self, rows: [&[f32; 8]; 16]) -> [Self::F; 8] {
            unsafe {
                let mut row = [_mm256_setzero_ps(); 8];
                for (row, from) in row.iter_mut().zip(rows) {
                    *row = _mm256_loadu_ps(from.as_ptr());
                }
                let (mut low, mut high) = ([_mm256_setzero_ps(); 4], [_mm256_setzero_ps(); 4]);
                for i in 0..4 {
                    (low[i], high[i]) = (_mm256_unpacklo_ps(row[2 * i], row[2 * i + 1]), _mm256_unpackhi_ps(row[2 * i], row[2 * i + 1]));
                }
                // Columns k and k + 4 of four rows, and of the four next.
                let mut quad = [[_mm256_setzero_ps(); 4]; 2];
                for half in 0..2 {
                    let ((a, b), (c, d)) = ((low[2 * half], low[2 * half + 1]), (high[2 * half], high[2 * half + 1]));
                    quad[half] = [
                        _mm256_shuffle_ps::<0x44>(a, b), _mm256_shuffle_ps::<0xEE>(a, b),
                        _mm256_shuffle_ps::<0x44>(c, d), _mm256_shuffle_ps::<0xEE>(c, d),
                    ];
                }
                let mut columns = [_mm256_setzero_ps(); 8];
                for k in 0..4 {
                    let (a, b) = (quad[0][k], quad[1][k]);
                    (columns[k], columns[k + 4]) = (_mm256_permute2f128_ps::<0x20>(a, b), _mm256_permute2f128_ps::<0x31>(a, b));
                }
                columns
            }
        }
        #[inline(always)] unsafe fn gather_u16(self, mask: Self::M, from: &[u16], index: Self::I) -> Self::I {
            // SAFETY: the caller promises that each index that is looked at and the one after it lie within.
            unsafe {
                let low = _mm256_set1_epi32(0xFFFF);
                let here = _mm256_mask_i32gather_epi32::<2>(_mm256_setzero_si256(), from.as_ptr().cast(), index, _mm256_castps_si256(mask));
                _mm256_and_si256(here, low)
            }
        }
        #[inline(always)] unsafe fn gather_pair(self, mask: Self::M, from: &[f32], index: Self::I) -> (Self::F, Self::F) {
            // SAFETY: the caller promises that each index that is looked at and the one after it lie within; so does the first.
            unsafe {
                let at = from.as_ptr().cast::<f64>();
                let index = _mm256_and_si256(index, _mm256_castps_si256(mask));
                let low = _mm256_castpd_ps(_mm256_i32gather_pd::<4>(at, _mm256_castsi256_si128(index)));
                let high = _mm256_castpd_ps(_mm256_i32gather_pd::<4>(at, _mm256_extracti128_si256::<1>(index)));
                // Lanes come out as 0 1 4 5 | 2 3 6 7.
                let order = |v: __m256| _mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(_mm256_castps_pd(v)));
                let (a, b) = (_mm256_shuffle_ps::<0b10_00_10_00>(low, high), _mm256_shuffle_ps::<0b11_01_11_01>(low, high));
                (_mm256_and_ps(order(a), mask), _mm256_and_ps(order(b), mask))
            }
        }
    }

    /// Sixteen lanes of AVX-512 F and DQ.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx512(());

    impl Avx512 {
        /// # Safety
        /// The processor has AVX-512 F and DQ, and the caller is compiled for them.
        #[inline(always)]
        pub unsafe fn new() -> Avx512 {
            Avx512(())
        }
    }

    #[rustfmt::skip]
    impl Lanes for Avx512 {
        const COUNT: usize = 16;
        type F = __m512;
        type I = __m512i;
        type M = __mmask16;

        #[inline(always)] fn splat(self, value: f32) -> Self::F { unsafe { _mm512_set1_ps(value) } }
        #[inline(always)] fn int(self, value: i32) -> Self::I { unsafe { _mm512_set1_epi32(value) } }
        #[inline(always)] fn load(self, from: &[f32]) -> Self::F { assert!(from.len() >= 16); unsafe { _mm512_loadu_ps(from.as_ptr()) } }
        #[inline(always)] fn load_int(self, from: &[i32]) -> Self::I { assert!(from.len() >= 16); unsafe { _mm512_loadu_si512(from.as_ptr().cast()) } }
        #[inline(always)] fn store(self, value: Self::F, to: &mut [f32]) { assert!(to.len() >= 16); unsafe { _mm512_storeu_ps(to.as_mut_ptr(), value) } }
        #[inline(always)] fn store_int(self, value: Self::I, to: &mut [i32]) { assert!(to.len() >= 16); unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), value) } }
        #[inline(always)] fn add(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm512_add_ps(a, b) } }
        #[inline(always)] fn sub(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm512_sub_ps(a, b) } }
        #[inline(always)] fn mul(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm512_mul_ps(a, b) } }
        #[inline(always)] fn fused(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F { unsafe { _mm512_fmadd_ps(a, b, c) } }
        #[inline(always)] fn fused_from(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F { unsafe { _mm512_fnmadd_ps(a, b, c) } }
        #[inline(always)] fn div(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm512_div_ps(a, b) } }
        #[inline(always)] fn sqrt(self, a: Self::F) -> Self::F { unsafe { _mm512_sqrt_ps(a) } }
        #[inline(always)] fn min(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm512_min_ps(a, b) } }
        #[inline(always)] fn max(self, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm512_max_ps(a, b) } }
        #[inline(always)] fn lt(self, a: Self::F, b: Self::F) -> Self::M { unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) } }
        #[inline(always)] fn le(self, a: Self::F, b: Self::F) -> Self::M { unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) } }
        #[inline(always)] fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F { unsafe { _mm512_mask_blend_ps(mask, b, a) } }
        #[inline(always)] fn least(self, a: Self::F) -> f32 { unsafe { _mm512_reduce_min_ps(a) } }
        #[inline(always)] fn flip(self, a: Self::F, bits: Self::I) -> Self::F { unsafe { _mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(a), bits)) } }
        #[inline(always)] fn to_bits(self, a: Self::F) -> Self::I { unsafe { _mm512_castps_si512(a) } }
        #[inline(always)] fn float(self, a: Self::I) -> Self::F { unsafe { _mm512_cvtepi32_ps(a) } }
        #[inline(always)] fn floor(self, a: Self::F) -> Self::I { unsafe { _mm512_cvt_roundps_epi32::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(a) } }
        #[inline(always)] fn iadd(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_add_epi32(a, b) } }
        #[inline(always)] fn isub(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_sub_epi32(a, b) } }
        #[inline(always)] fn imul(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_mullo_epi32(a, b) } }
        #[inline(always)] fn iand(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_and_si512(a, b) } }
        #[inline(always)] fn ixor(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_xor_si512(a, b) } }
        #[inline(always)] fn imin(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_min_epi32(a, b) } }
        #[inline(always)] fn imax(self, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_max_epi32(a, b) } }
        #[inline(always)] fn shl(self, a: Self::I, by: Self::I) -> Self::I { unsafe { _mm512_sllv_epi32(a, by) } }
        #[inline(always)] fn shr(self, a: Self::I, by: Self::I) -> Self::I { unsafe { _mm512_srlv_epi32(a, by) } }
        #[inline(always)] fn igt(self, a: Self::I, b: Self::I) -> Self::M { unsafe { _mm512_cmpgt_epi32_mask(a, b) } }
        #[inline(always)] fn ieq(self, a: Self::I, b: Self::I) -> Self::M { unsafe { _mm512_cmpeq_epi32_mask(a, b) } }
        #[inline(always)] fn iselect(self, mask: Self::M, a: Self::I, b: Self::I) -> Self::I { unsafe { _mm512_mask_blend_epi32(mask, b, a) } }
        #[inline(always)] fn and(self, a: Self::M, b: Self::M) -> Self::M { a & b }
        #[inline(always)] fn or(self, a: Self::M, b: Self::M) -> Self::M { a | b }
        #[inline(always)] fn without(self, a: Self::M, b: Self::M) -> Self::M { a & !b }
        #[inline(always)] fn bits(self, mask: Self::M) -> u32 { u32::from(mask) }
        #[inline(always)] fn mask(self, bits: u32) -> Self::M { bits as u16 }
        #[inline(always)] fn lookup(self, table: &[i32; 16], index: Self::I) -> Self::I { unsafe { _mm512_permutexvar_epi32(index, _mm512_loadu_si512(table.as_ptr().cast())) } }
        #[inline(always)] fn expand(self, old: Self::F, mask: Self::M, from: &[f32]) -> Self::F { unsafe { _mm512_mask_expand_ps(old, mask, self.load(from)) } }
        #[inline(always)] fn expand_int(self, old: Self::I, mask: Self::M, from: &[i32]) -> Self::I { unsafe { _mm512_mask_expand_epi32(old, mask, self.load_int(from)) } }
        #[inline(always)] fn columns(self, rows: [&[f32; 8]; 16]) -> [Self::F; 8] {
            unsafe {
                // Quarters of the last step come out as 0 2 | 0 2: so rows 4 apart share a vector.
                let mut row = [_mm512_setzero_ps(); 8];
                for (i, row) in row.iter_mut().enumerate() {
                    let first = i + (i & 4);
                    let (a, b) = (_mm256_loadu_ps(rows[first].as_ptr()), _mm256_loadu_ps(rows[first + 4].as_ptr()));
                    *row = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(a), b);
                }
                let (mut low, mut high) = ([_mm512_setzero_ps(); 4], [_mm512_setzero_ps(); 4]);
                for i in 0..4 {
                    (low[i], high[i]) = (_mm512_unpacklo_ps(row[2 * i], row[2 * i + 1]), _mm512_unpackhi_ps(row[2 * i], row[2 * i + 1]));
                }
                // Columns k and k + 4 of four rows, and of the four next.
                let mut quad = [[_mm512_setzero_ps(); 4]; 2];
                for half in 0..2 {
                    let ((a, b), (c, d)) = ((low[2 * half], low[2 * half + 1]), (high[2 * half], high[2 * half + 1]));
                    quad[half] = [
                        _mm512_shuffle_ps::<0x44>(a, b), _mm512_shuffle_ps::<0xEE>(a, b),
                        _mm512_shuffle_ps::<0x44>(c, d), _mm512_shuffle_ps::<0xEE>(c, d),
                    ];
                }
                let mut columns = [_mm512_setzero_ps(); 8];
                for k in 0..4 {
                    let (a, b) = (quad[0][k], quad[1][k]);
                    (columns[k], columns[k + 4]) = (_mm512_shuffle_f32x4::<0x88>(a, b), _mm512_shuffle_f32x4::<0xDD>(a, b));
                }
                columns
            }
        }
        #[inline(always)] unsafe fn gather_u16(self, mask: Self::M, from: &[u16], index: Self::I) -> Self::I {
            // SAFETY: the caller promises that each index that is looked at and the one after it lie within.
            unsafe {
                let here = _mm512_mask_i32gather_epi32::<2>(_mm512_setzero_si512(), mask, index, from.as_ptr().cast());
                _mm512_and_si512(here, _mm512_set1_epi32(0xFFFF))
            }
        }
        #[inline(always)] unsafe fn gather_pair(self, mask: Self::M, from: &[f32], index: Self::I) -> (Self::F, Self::F) {
            // SAFETY: the caller promises that each index that is looked at and the one after it lie within.
            unsafe {
                let (at, zero) = (from.as_ptr().cast::<f64>(), _mm512_setzero_pd());
                let low = _mm512_mask_i32gather_pd::<4>(zero, mask as u8, _mm512_castsi512_si256(index), at);
                let high = _mm512_mask_i32gather_pd::<4>(zero, (mask >> 8) as u8, _mm512_extracti64x4_epi64::<1>(index), at);
                let (low, high) = (_mm512_castpd_ps(low), _mm512_castpd_ps(high));
                let even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
                let odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
                (_mm512_permutex2var_ps(low, even, high), _mm512_permutex2var_ps(low, odd, high))
            }
        }
    }
}
