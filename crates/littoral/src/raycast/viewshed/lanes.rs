//! Sixteen numbers at once: AVX-512, AVX2 or plain arrays, equal to the bit.
//!
//! Only operations that IEEE 754 defines exactly are used, and never a fused multiply–add, so that every form gives the
//! same numbers. What plain loops would not give is [`Lanes::lookup`], a table of sixteen entries held in registers.

/// Sixteen `f32` at once.
pub(super) trait Lanes: Copy {
    /// Sixteen indices into a table of sixteen.
    type Index: Copy;

    fn splat(value: f32) -> Self;
    /// # Safety
    /// Sixteen numbers must be readable at `from`, and the processor must have the instructions of this form.
    unsafe fn load(from: *const f32) -> Self;
    /// # Safety
    /// Sixteen numbers must be writable at `to`, and the processor must have the instructions of this form.
    unsafe fn store(self, to: *mut f32);
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// The greater; `other` where they compare neither way.
    fn max(self, other: Self) -> Self;
    /// The smaller; `other` where they compare neither way.
    fn min(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// Whole part as an index and as a number; for values in [0, 16).
    fn whole(self) -> (Self::Index, Self);
    /// Entry `index` of this table, lane by lane.
    fn lookup(self, index: Self::Index) -> Self;
    /// Each lane's right-hand neighbour; the last lane keeps its own.
    fn next(self) -> Self;
    /// Each lane's left-hand neighbour; the first lane keeps its own.
    fn previous(self) -> Self;
    /// The bits of `bits` where `mask` has a one, moved together.
    fn squeeze(bits: u16, mask: u16) -> u16;
    /// Where this is at most `other`, lowest lane in the lowest bit.
    fn at_most(self, other: Self) -> u16;
    /// `self` where the mask has a one, else `other`.
    fn select(self, mask: u16, other: Self) -> Self;
    /// Sixteen rows turned into sixteen columns.
    #[inline(always)]
    fn turn(rows: [Self; 16]) -> [Self; 16] {
        let mut table = [[0.0f32; 16]; 16];
        let mut turned = rows;
        for (row, lanes) in rows.into_iter().enumerate() {
            let mut line = [0.0f32; 16];
            // SAFETY: there is room for sixteen numbers; lanes exist only where their instructions do.
            unsafe { lanes.store(line.as_mut_ptr()) };
            for (column, number) in line.into_iter().enumerate() {
                table[column][row] = number;
            }
        }
        for (row, lanes) in turned.iter_mut().enumerate() {
            // SAFETY: likewise.
            *lanes = unsafe { Self::load(table[row].as_ptr()) };
        }
        turned
    }
    /// Asks for a cache line that will be read soon; any address will do.
    fn prefetch(_from: *const f32) {}
    /// Runs what is seldom needed as a function of its own, with the instructions of this form: inlined it would take
    /// registers from what is always needed.
    ///
    /// # Safety
    /// The processor must have the instructions of this form.
    #[inline(always)]
    unsafe fn apart(work: impl FnOnce() -> u16) -> u16 {
        work()
    }
    /// One lane.
    fn lane(self, lane: usize) -> f32;
    /// The smallest lane.
    fn smallest(self) -> f32;
    /// The greatest lane.
    fn greatest(self) -> f32;
}

/// Plain arrays, for every processor.
#[derive(Clone, Copy)]
pub(super) struct Portable([f32; 16]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut result = self;
        for lane in 0..16 {
            result.0[lane] = f(self.0[lane], other.0[lane]);
        }
        result
    }
}

// Loops over lanes are what the compiler turns into vectors.
#[allow(clippy::needless_range_loop)]
impl Lanes for Portable {
    type Index = [u32; 16];

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Portable([value; 16])
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller vouches for sixteen numbers; reads may be unaligned.
        Portable(unsafe { from.cast::<[f32; 16]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller vouches for room for sixteen numbers; writes may be unaligned.
        unsafe { to.cast::<[f32; 16]>().write_unaligned(self.0) }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.zip(self, |a, _| a.abs())
    }
    #[inline(always)]
    fn whole(self) -> (Self::Index, Self) {
        let mut index = [0; 16];
        let mut whole = self;
        for lane in 0..16 {
            index[lane] = self.0[lane] as i32 as u32;
            whole.0[lane] = index[lane] as i32 as f32;
        }
        (index, whole)
    }
    #[inline(always)]
    fn lookup(self, index: Self::Index) -> Self {
        let mut result = self;
        for lane in 0..16 {
            result.0[lane] = self.0[(index[lane] & 15) as usize];
        }
        result
    }
    #[inline(always)]
    fn next(self) -> Self {
        let mut result = self;
        result.0[..15].copy_from_slice(&self.0[1..]);
        result
    }
    #[inline(always)]
    fn previous(self) -> Self {
        let mut result = self;
        result.0[1..].copy_from_slice(&self.0[..15]);
        result
    }
    #[inline(always)]
    fn squeeze(bits: u16, mut mask: u16) -> u16 {
        let (mut result, mut place) = (0, 0);
        while mask != 0 {
            result |= (bits >> mask.trailing_zeros() & 1) << place;
            place += 1;
            mask &= mask - 1;
        }
        result
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u16 {
        let mut mask = 0;
        for lane in 0..16 {
            mask |= u16::from(self.0[lane] <= other.0[lane]) << lane;
        }
        mask
    }
    #[inline(always)]
    fn select(self, mask: u16, other: Self) -> Self {
        let mut result = other;
        for lane in 0..16 {
            if mask >> lane & 1 == 1 {
                result.0[lane] = self.0[lane];
            }
        }
        result
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f32 {
        self.0[lane & 15]
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        self.0.into_iter().fold(f32::INFINITY, f32::min)
    }
    #[inline(always)]
    fn greatest(self) -> f32 {
        self.0.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Lanes;
    use std::arch::x86_64::*;

    /// One register of AVX-512. Values exist only where the instructions do: see [`Lanes::load`] and the dispatch.
    #[derive(Clone, Copy)]
    pub struct Avx512(__m512);

    /// Two registers of AVX2.
    #[derive(Clone, Copy)]
    pub struct Avx2(__m256, __m256);

    // SAFETY of all that follows: these methods are called only from functions compiled for the instruction set, which
    // are entered only after the processor was asked for it.
    #[allow(clippy::undocumented_unsafe_blocks)]
    impl Lanes for Avx512 {
        #[inline(always)]
        fn prefetch(from: *const f32) {
            unsafe { _mm_prefetch::<_MM_HINT_T0>(from.cast()) }
        }
        #[inline(always)]
        unsafe fn apart(work: impl FnOnce() -> u16) -> u16 {
            #[target_feature(enable = "avx512f,avx512dq,avx2,bmi1,bmi2,lzcnt,popcnt")]
            #[inline(never)]
            fn run(work: impl FnOnce() -> u16) -> u16 {
                work()
            }
            unsafe { run(work) }
        }
        type Index = __m512i;

        #[inline(always)]
        fn splat(value: f32) -> Self {
            Avx512(unsafe { _mm512_set1_ps(value) })
        }
        #[inline(always)]
        unsafe fn load(from: *const f32) -> Self {
            Avx512(unsafe { _mm512_loadu_ps(from) })
        }
        #[inline(always)]
        unsafe fn store(self, to: *mut f32) {
            unsafe { _mm512_storeu_ps(to, self.0) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Avx512(unsafe { _mm512_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            Avx512(unsafe { _mm512_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            Avx512(unsafe { _mm512_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            Avx512(unsafe { _mm512_div_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Avx512(unsafe { _mm512_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Avx512(unsafe { _mm512_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Avx512(unsafe { _mm512_abs_ps(self.0) })
        }
        #[inline(always)]
        fn whole(self) -> (Self::Index, Self) {
            unsafe {
                let index = _mm512_cvttps_epi32(self.0);
                (index, Avx512(_mm512_cvtepi32_ps(index)))
            }
        }
        #[inline(always)]
        fn lookup(self, index: Self::Index) -> Self {
            Avx512(unsafe { _mm512_permutexvar_ps(index, self.0) })
        }
        #[inline(always)]
        fn next(self) -> Self {
            unsafe {
                let from = _mm512_setr_epi32(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 15);
                Avx512(_mm512_permutexvar_ps(from, self.0))
            }
        }
        #[inline(always)]
        fn previous(self) -> Self {
            unsafe {
                let from = _mm512_setr_epi32(0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14);
                Avx512(_mm512_permutexvar_ps(from, self.0))
            }
        }
        #[inline(always)]
        fn squeeze(bits: u16, mask: u16) -> u16 {
            unsafe { _pext_u32(u32::from(bits), u32::from(mask)) as u16 }
        }
        #[inline(always)]
        fn at_most(self, other: Self) -> u16 {
            unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn select(self, mask: u16, other: Self) -> Self {
            Avx512(unsafe { _mm512_mask_blend_ps(mask, other.0, self.0) })
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> f32 {
            let mut lanes = [0.0; 16];
            unsafe { _mm512_storeu_ps(lanes.as_mut_ptr(), self.0) };
            lanes[lane & 15]
        }
        #[inline(always)]
        fn turn(rows: [Self; 16]) -> [Self; 16] {
            // Pairs of rows, then of pairs, are interleaved within quarters of a register; then quarters change places.
            unsafe {
                let r = rows.map(|row| row.0);
                let mut s = r;
                for k in 0..8 {
                    s[2 * k] = _mm512_unpacklo_ps(r[2 * k], r[2 * k + 1]);
                    s[2 * k + 1] = _mm512_unpackhi_ps(r[2 * k], r[2 * k + 1]);
                }
                let mut t = s;
                for k in 0..4 {
                    let [a, b, c, d] = [s[4 * k], s[4 * k + 1], s[4 * k + 2], s[4 * k + 3]];
                    t[4 * k] = _mm512_shuffle_ps::<0x44>(a, c);
                    t[4 * k + 1] = _mm512_shuffle_ps::<0xEE>(a, c);
                    t[4 * k + 2] = _mm512_shuffle_ps::<0x44>(b, d);
                    t[4 * k + 3] = _mm512_shuffle_ps::<0xEE>(b, d);
                }
                let mut result = rows;
                for k in 0..4 {
                    let (a, b) = (t[k], t[k + 4]);
                    let (c, d) = (t[k + 8], t[k + 12]);
                    let (even_low, odd_low) = (_mm512_shuffle_f32x4::<0x88>(a, b), _mm512_shuffle_f32x4::<0xDD>(a, b));
                    let (even_high, odd_high) =
                        (_mm512_shuffle_f32x4::<0x88>(c, d), _mm512_shuffle_f32x4::<0xDD>(c, d));
                    result[k] = Avx512(_mm512_shuffle_f32x4::<0x88>(even_low, even_high));
                    result[k + 8] = Avx512(_mm512_shuffle_f32x4::<0xDD>(even_low, even_high));
                    result[k + 4] = Avx512(_mm512_shuffle_f32x4::<0x88>(odd_low, odd_high));
                    result[k + 12] = Avx512(_mm512_shuffle_f32x4::<0xDD>(odd_low, odd_high));
                }
                result
            }
        }
        #[inline(always)]
        fn smallest(self) -> f32 {
            unsafe { _mm512_reduce_min_ps(self.0) }
        }
        #[inline(always)]
        fn greatest(self) -> f32 {
            unsafe { _mm512_reduce_max_ps(self.0) }
        }
    }

    #[allow(clippy::undocumented_unsafe_blocks)]
    impl Lanes for Avx2 {
        #[inline(always)]
        fn prefetch(from: *const f32) {
            unsafe { _mm_prefetch::<_MM_HINT_T0>(from.cast()) }
        }
        #[inline(always)]
        unsafe fn apart(work: impl FnOnce() -> u16) -> u16 {
            #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
            #[inline(never)]
            fn run(work: impl FnOnce() -> u16) -> u16 {
                work()
            }
            unsafe { run(work) }
        }
        type Index = (__m256i, __m256i);

        #[inline(always)]
        fn splat(value: f32) -> Self {
            let half = unsafe { _mm256_set1_ps(value) };
            Avx2(half, half)
        }
        #[inline(always)]
        unsafe fn load(from: *const f32) -> Self {
            unsafe { Avx2(_mm256_loadu_ps(from), _mm256_loadu_ps(from.add(8))) }
        }
        #[inline(always)]
        unsafe fn store(self, to: *mut f32) {
            unsafe {
                _mm256_storeu_ps(to, self.0);
                _mm256_storeu_ps(to.add(8), self.1);
            }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { Avx2(_mm256_add_ps(self.0, other.0), _mm256_add_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { Avx2(_mm256_sub_ps(self.0, other.0), _mm256_sub_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { Avx2(_mm256_mul_ps(self.0, other.0), _mm256_mul_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            unsafe { Avx2(_mm256_div_ps(self.0, other.0), _mm256_div_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { Avx2(_mm256_max_ps(self.0, other.0), _mm256_max_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            unsafe { Avx2(_mm256_min_ps(self.0, other.0), _mm256_min_ps(self.1, other.1)) }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            unsafe {
                let sign = _mm256_set1_ps(-0.0);
                Avx2(_mm256_andnot_ps(sign, self.0), _mm256_andnot_ps(sign, self.1))
            }
        }
        #[inline(always)]
        fn whole(self) -> (Self::Index, Self) {
            unsafe {
                let (a, b) = (_mm256_cvttps_epi32(self.0), _mm256_cvttps_epi32(self.1));
                ((a, b), Avx2(_mm256_cvtepi32_ps(a), _mm256_cvtepi32_ps(b)))
            }
        }
        #[inline(always)]
        fn lookup(self, index: Self::Index) -> Self {
            unsafe { Avx2(lookup_half(self, index.0), lookup_half(self, index.1)) }
        }
        #[inline(always)]
        fn next(self) -> Self {
            unsafe {
                let (one, last) = (_mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 7), _mm256_setzero_si256());
                let (low, high) = (_mm256_permutevar8x32_ps(self.0, one), _mm256_permutevar8x32_ps(self.1, one));
                Avx2(_mm256_blend_ps::<0x80>(low, _mm256_permutevar8x32_ps(self.1, last)), high)
            }
        }
        #[inline(always)]
        fn previous(self) -> Self {
            unsafe {
                let (one, first) = (_mm256_setr_epi32(0, 0, 1, 2, 3, 4, 5, 6), _mm256_set1_epi32(7));
                let (low, high) = (_mm256_permutevar8x32_ps(self.0, one), _mm256_permutevar8x32_ps(self.1, one));
                Avx2(low, _mm256_blend_ps::<0x01>(high, _mm256_permutevar8x32_ps(self.0, first)))
            }
        }
        #[inline(always)]
        fn squeeze(bits: u16, mask: u16) -> u16 {
            unsafe { _pext_u32(u32::from(bits), u32::from(mask)) as u16 }
        }
        #[inline(always)]
        fn at_most(self, other: Self) -> u16 {
            unsafe {
                let a = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0));
                let b = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.1, other.1));
                (a | b << 8) as u16
            }
        }
        #[inline(always)]
        fn select(self, mask: u16, other: Self) -> Self {
            unsafe { Avx2(select_half(mask & 255, self.0, other.0), select_half(mask >> 8, self.1, other.1)) }
        }
        #[inline(always)]
        fn lane(self, lane: usize) -> f32 {
            let mut lanes = [0.0; 16];
            unsafe { self.store(lanes.as_mut_ptr()) };
            lanes[lane & 15]
        }
        #[inline(always)]
        fn smallest(self) -> f32 {
            let mut lanes = [0.0; 8];
            unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), _mm256_min_ps(self.0, self.1)) };
            lanes.into_iter().fold(f32::INFINITY, f32::min)
        }
        #[inline(always)]
        fn greatest(self) -> f32 {
            let mut lanes = [0.0; 8];
            unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), _mm256_max_ps(self.0, self.1)) };
            lanes.into_iter().fold(f32::NEG_INFINITY, f32::max)
        }
    }
    /// # Safety
    /// The processor must have AVX2.
    #[inline(always)]
    unsafe fn lookup_half(table: Avx2, index: __m256i) -> __m256 {
        // SAFETY: the caller's. Bit 3 of an index, moved to the sign, picks the half of the table.
        unsafe {
            let upper = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(index));
            let (low, high) = (_mm256_permutevar8x32_ps(table.0, index), _mm256_permutevar8x32_ps(table.1, index));
            _mm256_blendv_ps(low, high, upper)
        }
    }

    /// # Safety
    /// The processor must have AVX2.
    #[inline(always)]
    unsafe fn select_half(bits: u16, yes: __m256, no: __m256) -> __m256 {
        // SAFETY: the caller's.
        unsafe {
            let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(i32::from(bits)), bit), bit);
            _mm256_blendv_ps(no, yes, _mm256_castsi256_ps(set))
        }
    }
}
