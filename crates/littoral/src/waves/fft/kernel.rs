//! Transforms along one dimension of 16 columns at once, and transpositions of 16 × 16 blocks.
//!
//! Every loop over lanes has the butterfly of one lane as its body: in that form the compiler makes one vector instruction of each operation.

use std::f64::consts::TAU;

/// Columns that are worked on at once.
pub(crate) const LANES: usize = 16;
/// One number of each column.
pub(crate) type Lane = [f32; LANES];

/// One complex number of each column.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Wide {
    pub re: Lane,
    pub im: Lane,
}

impl Wide {
    pub const ZERO: Wide = Wide { re: [0.0; LANES], im: [0.0; LANES] };
}

/// How to transform a line of numbers: X[x] = Σ Y[m] e^(2πi x m / n).
pub(crate) struct Line {
    /// n: a power of two from 64 to 1024.
    pub samples: usize,
    radices: Vec<usize>,
    /// For each pass but the last, for each first index: what its outputs are turned by.
    twiddles: Vec<Vec<[[f32; 2]; 8]>>,
    /// Where in the output each X stands.
    pub position: Vec<u32>,
}

impl Line {
    /// Tables for lines of `samples` numbers, a power of two from 64 to 1024.
    pub fn new(samples: usize) -> Line {
        assert!(samples.is_power_of_two() && (64..=1024).contains(&samples), "64 to 1024 samples, got {samples}");
        let radices: Vec<usize> = match samples {
            64 => vec![8, 8],
            128 => vec![8, 2, 8],
            256 => vec![8, 4, 8],
            512 => vec![8, 8, 8],
            _ => vec![8, 4, 4, 8],
        };
        let mut twiddles = Vec::new();
        let mut length = samples;
        for &radix in &radices[..radices.len() - 1] {
            let turned = |v: usize, j: usize| {
                let angle = TAU * (v * j % length) as f64 / length as f64;
                [libm::cos(angle) as f32, libm::sin(angle) as f32]
            };
            twiddles.push((0..length / radix).map(|v| std::array::from_fn(|j| turned(v, j))).collect());
            length /= radix;
        }
        let position = (0..samples).map(|x| {
            let (mut rest, mut at) = (x, 0);
            for &radix in &radices {
                at = at * radix + rest % radix;
                rest /= radix;
            }
            at as u32
        });
        Line { samples, twiddles, position: position.collect(), radices }
    }

    /// Transforms the line whose number m stands at `source[base + at[m]]` into `result`, in the order of `position`. `scratch` is overwritten.
    /// Both hold `samples`. If `narrow`, numbers in the middle half (n/4 ≤ m < 3n/4) are taken as 0 and never read.
    #[inline(always)]
    pub fn run(
        &self,
        source: &[Wide],
        at: &[u32],
        base: usize,
        narrow: bool,
        result: &mut [Wide],
        scratch: &mut [Wide],
    ) {
        let n = self.samples;
        let (result, scratch) = (&mut result[..n], &mut scratch[..n]);
        // Whichever buffer the first pass fills, the last one fills `result`.
        let (mut full, mut free): (&mut [Wide], &mut [Wide]) =
            if self.radices.len() % 2 == 0 { (scratch, result) } else { (result, scratch) };
        if narrow {
            first_narrow(source, at, base, &self.twiddles[0], full);
        } else {
            first(source, at, base, &self.twiddles[0], full);
        }
        let mut done = 8;
        for (radix, twiddles) in self.radices[1..].iter().zip(&self.twiddles[1..]) {
            match radix {
                2 => middle2(full, done, twiddles, free),
                4 => middle4(full, done, twiddles, free),
                _ => middle8(full, done, twiddles, free),
            }
            done *= radix;
            std::mem::swap(&mut full, &mut free);
        }
        last(full, free);
    }
}

type Complex = (f32, f32);

#[inline(always)]
fn add(a: Complex, b: Complex) -> Complex {
    (a.0 + b.0, a.1 + b.1)
}

#[inline(always)]
fn sub(a: Complex, b: Complex) -> Complex {
    (a.0 - b.0, a.1 - b.1)
}

/// i a
#[inline(always)]
fn quarter(a: Complex) -> Complex {
    (-a.1, a.0)
}

#[inline(always)]
fn times(a: Complex, w: [f32; 2]) -> Complex {
    (a.1.mul_add(-w[1], a.0 * w[0]), a.1.mul_add(w[0], a.0 * w[1]))
}

/// e^(iπ/4) a
#[inline(always)]
fn eighth(a: Complex) -> Complex {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    ((a.0 - a.1) * half, (a.0 + a.1) * half)
}

#[inline(always)]
fn fourier4(x: [Complex; 4]) -> [Complex; 4] {
    let (a, b) = (add(x[0], x[2]), sub(x[0], x[2]));
    let (c, d) = (add(x[1], x[3]), quarter(sub(x[1], x[3])));
    [add(a, c), add(b, d), sub(a, c), sub(b, d)]
}

#[inline(always)]
fn fourier8(x: [Complex; 8]) -> [Complex; 8] {
    let e = fourier4([x[0], x[2], x[4], x[6]]);
    let o = fourier4([x[1], x[3], x[5], x[7]]);
    joined(e, o)
}

/// The eight numbers of which only 0, 1, 6 and 7 are not zero.
#[inline(always)]
fn fourier8_narrow(x0: Complex, x1: Complex, x6: Complex, x7: Complex) -> [Complex; 8] {
    let (d, f) = (quarter(x6), quarter(x7));
    let e = [add(x0, x6), sub(x0, d), sub(x0, x6), add(x0, d)];
    let o = [add(x1, x7), sub(x1, f), sub(x1, x7), add(x1, f)];
    joined(e, o)
}

#[inline(always)]
fn joined(e: [Complex; 4], o: [Complex; 4]) -> [Complex; 8] {
    let (o1, o2, o3) = (eighth(o[1]), quarter(o[2]), quarter(eighth(o[3])));
    [
        add(e[0], o[0]),
        add(e[1], o1),
        add(e[2], o2),
        add(e[3], o3),
        sub(e[0], o[0]),
        sub(e[1], o1),
        sub(e[2], o2),
        sub(e[3], o3),
    ]
}

#[inline(always)]
fn group<const RADIX: usize>(to: &mut [Wide], index: usize) -> &mut [Wide; RADIX] {
    (&mut to[RADIX * index..RADIX * index + RADIX]).try_into().expect("as many as the radix")
}

#[inline(always)]
fn first(from: &[Wide], at: &[u32], base: usize, twiddles: &[[[f32; 2]; 8]], to: &mut [Wide]) {
    let stride = twiddles.len();
    for (v, w) in twiddles.iter().enumerate() {
        let x = |u: usize| &from[base + at[v + u * stride] as usize];
        let x = [x(0), x(1), x(2), x(3), x(4), x(5), x(6), x(7)];
        let y = group::<8>(to, v);
        for l in 0..LANES {
            let c = |u: usize| (x[u].re[l], x[u].im[l]);
            let z = fourier8([c(0), c(1), c(2), c(3), c(4), c(5), c(6), c(7)]);
            (y[0].re[l], y[0].im[l]) = z[0];
            for j in 1..8 {
                (y[j].re[l], y[j].im[l]) = times(z[j], w[j]);
            }
        }
    }
}

#[inline(always)]
fn first_narrow(from: &[Wide], at: &[u32], base: usize, twiddles: &[[[f32; 2]; 8]], to: &mut [Wide]) {
    let stride = twiddles.len();
    for (v, w) in twiddles.iter().enumerate() {
        let x = |u: usize| &from[base + at[v + u * stride] as usize];
        let x = [x(0), x(1), x(6), x(7)];
        let y = group::<8>(to, v);
        for l in 0..LANES {
            let c = |u: usize| (x[u].re[l], x[u].im[l]);
            let z = fourier8_narrow(c(0), c(1), c(2), c(3));
            (y[0].re[l], y[0].im[l]) = z[0];
            for j in 1..8 {
                (y[j].re[l], y[j].im[l]) = times(z[j], w[j]);
            }
        }
    }
}

#[inline(always)]
fn middle8(from: &[Wide], done: usize, twiddles: &[[[f32; 2]; 8]], to: &mut [Wide]) {
    let stride = twiddles.len() * done;
    for (v, w) in twiddles.iter().enumerate() {
        for q in 0..done {
            let x = |u: usize| &from[v * done + q + u * stride];
            let x = [x(0), x(1), x(2), x(3), x(4), x(5), x(6), x(7)];
            let y = group::<8>(to, v * done + q);
            for l in 0..LANES {
                let c = |u: usize| (x[u].re[l], x[u].im[l]);
                let z = fourier8([c(0), c(1), c(2), c(3), c(4), c(5), c(6), c(7)]);
                (y[0].re[l], y[0].im[l]) = z[0];
                for j in 1..8 {
                    (y[j].re[l], y[j].im[l]) = times(z[j], w[j]);
                }
            }
        }
    }
}

#[inline(always)]
fn middle4(from: &[Wide], done: usize, twiddles: &[[[f32; 2]; 8]], to: &mut [Wide]) {
    let stride = twiddles.len() * done;
    for (v, w) in twiddles.iter().enumerate() {
        for q in 0..done {
            let x = |u: usize| &from[v * done + q + u * stride];
            let x = [x(0), x(1), x(2), x(3)];
            let y = group::<4>(to, v * done + q);
            for l in 0..LANES {
                let c = |u: usize| (x[u].re[l], x[u].im[l]);
                let z = fourier4([c(0), c(1), c(2), c(3)]);
                (y[0].re[l], y[0].im[l]) = z[0];
                for j in 1..4 {
                    (y[j].re[l], y[j].im[l]) = times(z[j], w[j]);
                }
            }
        }
    }
}

#[inline(always)]
fn middle2(from: &[Wide], done: usize, twiddles: &[[[f32; 2]; 8]], to: &mut [Wide]) {
    let stride = twiddles.len() * done;
    for (v, w) in twiddles.iter().enumerate() {
        for q in 0..done {
            let x = [&from[v * done + q], &from[v * done + q + stride]];
            let y = group::<2>(to, v * done + q);
            for l in 0..LANES {
                let (a, b) = ((x[0].re[l], x[0].im[l]), (x[1].re[l], x[1].im[l]));
                (y[0].re[l], y[0].im[l]) = add(a, b);
                (y[1].re[l], y[1].im[l]) = times(sub(a, b), w[1]);
            }
        }
    }
}

#[inline(always)]
fn last(from: &[Wide], to: &mut [Wide]) {
    let stride = to.len() / 8;
    for q in 0..stride {
        let x = |u: usize| &from[q + u * stride];
        let x = [x(0), x(1), x(2), x(3), x(4), x(5), x(6), x(7)];
        let y = group::<8>(to, q);
        for l in 0..LANES {
            let c = |u: usize| (x[u].re[l], x[u].im[l]);
            let z = fourier8([c(0), c(1), c(2), c(3), c(4), c(5), c(6), c(7)]);
            for j in 0..8 {
                (y[j].re[l], y[j].im[l]) = z[j];
            }
        }
    }
}

/// Transposes a block: rows become columns.
#[inline(always)]
pub(crate) fn transpose(block: &mut [Lane; 16]) {
    // The compiler takes plain shuffles through memory, which cost three times as much as all butterflies between two transpositions.
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has the feature.
        unsafe { transpose_avx512(block) };
        return;
    }
    transpose_portable(block);
}

/// Four times, row i and row i + 8 are shuffled together to become rows 2i and 2i + 1.
#[inline(always)]
fn transpose_portable(block: &mut [Lane; 16]) {
    let mut other = [[0.0f32; 16]; 16];
    shuffle(block, &mut other);
    shuffle(&other, block);
    shuffle(block, &mut other);
    shuffle(&other, block);
}

#[inline(always)]
fn shuffle(from: &[Lane; 16], to: &mut [Lane; 16]) {
    for i in 0..8 {
        for l in 0..8 {
            to[2 * i][2 * l] = from[i][l];
            to[2 * i][2 * l + 1] = from[i + 8][l];
            to[2 * i + 1][2 * l] = from[i][l + 8];
            to[2 * i + 1][2 * l + 1] = from[i + 8][l + 8];
        }
    }
}

/// The same in registers: within quarters of them, then quarters among them.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
#[inline]
fn transpose_avx512(block: &mut [Lane; 16]) {
    use std::arch::x86_64::*;
    let mut r = [_mm512_setzero_ps(); 16];
    for (r, row) in r.iter_mut().zip(&*block) {
        // SAFETY: a row holds sixteen numbers.
        *r = unsafe { _mm512_loadu_ps(row.as_ptr()) };
    }
    let mut s = r;
    for i in 0..8 {
        s[2 * i] = _mm512_unpacklo_ps(r[2 * i], r[2 * i + 1]);
        s[2 * i + 1] = _mm512_unpackhi_ps(r[2 * i], r[2 * i + 1]);
    }
    let pair = |a, b| {
        let (a, b) = (_mm512_castps_pd(a), _mm512_castps_pd(b));
        (_mm512_castpd_ps(_mm512_unpacklo_pd(a, b)), _mm512_castpd_ps(_mm512_unpackhi_pd(a, b)))
    };
    for i in 0..4 {
        (r[4 * i], r[4 * i + 1]) = pair(s[4 * i], s[4 * i + 2]);
        (r[4 * i + 2], r[4 * i + 3]) = pair(s[4 * i + 1], s[4 * i + 3]);
    }
    // Row i now holds columns i mod 4, + 4, + 8, + 12 of four rows.
    for i in 0..4 {
        for half in 0..2 {
            let (a, b) = (r[8 * half + i], r[8 * half + 4 + i]);
            s[8 * half + i] = _mm512_shuffle_f32x4::<0x88>(a, b);
            s[8 * half + 4 + i] = _mm512_shuffle_f32x4::<0xDD>(a, b);
        }
    }
    for i in 0..4 {
        let (even, odd) = ((s[i], s[8 + i]), (s[4 + i], s[12 + i]));
        r[i] = _mm512_shuffle_f32x4::<0x88>(even.0, even.1);
        r[8 + i] = _mm512_shuffle_f32x4::<0xDD>(even.0, even.1);
        r[4 + i] = _mm512_shuffle_f32x4::<0x88>(odd.0, odd.1);
        r[12 + i] = _mm512_shuffle_f32x4::<0xDD>(odd.0, odd.1);
    }
    for (r, row) in r.iter().zip(block) {
        // SAFETY: a row holds sixteen numbers.
        unsafe { _mm512_storeu_ps(row.as_mut_ptr(), *r) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waves::random::uniform;

    fn number(i: usize, j: usize) -> f32 {
        uniform(5, i as i64, j as i64, 0) as f32 - 0.5
    }

    #[test]
    fn transpositions_transpose() {
        let block: [Lane; 16] = std::array::from_fn(|i| std::array::from_fn(|j| number(i, j)));
        let turned: [Lane; 16] = std::array::from_fn(|i| std::array::from_fn(|j| block[j][i]));
        let (mut best, mut portable) = (block, block);
        transpose(&mut best);
        transpose_portable(&mut portable);
        assert!(best == turned && portable == turned);
    }

    #[test]
    fn lines_are_fourier_sums() {
        for samples in [64, 128, 256, 512, 1024] {
            let line = Line::new(samples);
            for narrow in [false, true] {
                let there = |m: usize| !narrow || m < samples / 4 || m >= 3 * samples / 4;
                let source: Vec<Wide> = (0..samples)
                    .map(|m| Wide {
                        re: std::array::from_fn(|l| number(m, l)),
                        im: std::array::from_fn(|l| number(m, 16 + l)),
                    })
                    .collect();
                let at: Vec<u32> = (0..samples as u32).collect();
                let (mut result, mut spare) = (vec![Wide::ZERO; samples], vec![Wide::ZERO; samples]);
                line.run(&source, &at, 0, narrow, &mut result, &mut spare);
                for x in (0..samples).step_by(7) {
                    let got = &result[line.position[x] as usize];
                    for l in [0, 5, 15] {
                        let (mut re, mut im, mut size) = (0.0, 0.0, 0.0);
                        for m in (0..samples).filter(|m| there(*m)) {
                            let (sine, cosine) = libm::sincos(TAU * (x * m % samples) as f64 / samples as f64);
                            let (a, b) = (f64::from(source[m].re[l]), f64::from(source[m].im[l]));
                            re += a * cosine - b * sine;
                            im += a * sine + b * cosine;
                            size += a * a + b * b;
                        }
                        let off = libm::hypot(f64::from(got.re[l]) - re, f64::from(got.im[l]) - im);
                        assert!(off < 6e-7 * libm::sqrt(size), "{samples} {narrow} {x}: {off} of {}", libm::sqrt(size));
                    }
                }
            }
        }
    }
}
