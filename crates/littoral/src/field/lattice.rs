//! Vertices at points of a face's lattice. Most points that meshes ask for lie on samples: those are read as they are, eight at a time.

use crate::space::{Cell, Datum, Place};
use glam::{DVec2, DVec3};

/// A vertex: a point of a face's lattice and the height it is drawn at. Sixteen bytes, as a GPU takes them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// Steps from the face's western side, in [0, 2³⁰].
    pub x: u32,
    /// Steps from its southern side, in [0, 2³⁰].
    pub y: u32,
    /// Which face.
    pub face: u32,
    /// Height above the datum (m). NaN where the surface is void; no triangle uses such a vertex.
    pub height: f32,
}

impl Vertex {
    /// The place it lies at.
    pub fn place(&self) -> Place {
        let steps = f64::from(1u32 << Cell::MAX_LEVEL);
        Place { face: self.face as u8, uv: DVec2::new(f64::from(self.x), f64::from(self.y)) / steps }
    }

    /// Where it is in the world (m).
    pub fn world(&self, datum: &Datum) -> DVec3 {
        datum.world(self.place(), f64::from(self.height)).0
    }
}

/// Samples row by row, and how far a lattice point's coordinates are shifted to be a column and a row.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub heights: &'a [f32],
    pub columns: usize,
    pub rows: usize,
    pub shift: u32,
}

/// How many times eight points ahead of what is read memory is asked for.
#[cfg(target_arch = "x86_64")]
const AHEAD: usize = 32;

impl Samples<'_> {
    /// Adds vertices at points that lie on samples; `false`, and nothing added, if some do not.
    pub fn raise(self, face: u32, points: &[[u32; 2]], vertices: &mut Vec<Vertex>) -> bool {
        assert!(self.heights.len() >= self.columns * self.rows, "expected a height for each sample");
        let length = vertices.len();
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has just been asked.
            let all = unsafe { self.gather(face, points, vertices) };
            vertices.truncate(if all { usize::MAX } else { length });
            return all;
        }
        let all = self.pick(face, points, vertices);
        vertices.truncate(if all { usize::MAX } else { length });
        all
    }

    /// Adds what lies on samples, point by point; whether that is all.
    fn pick(self, face: u32, points: &[[u32; 2]], vertices: &mut Vec<Vertex>) -> bool {
        let on_sample = |&[x, y]: &[u32; 2]| {
            let [column, row] = [x, y].map(|at| (at >> self.shift) as usize);
            let on_sample = (x | y) & ((1 << self.shift) - 1) == 0 && column < self.columns && row < self.rows;
            on_sample.then(|| Vertex { x, y, face, height: self.heights[row * self.columns + column] })
        };
        let length = vertices.len();
        vertices.extend(points.iter().map_while(on_sample));
        vertices.len() == length + points.len()
    }

    /// The same, eight at a time and past the caches, where they would drive out what is read: a page's neighbours are asked for next, vertices
    /// much later.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn gather(self, face: u32, points: &[[u32; 2]], vertices: &mut Vec<Vertex>) -> bool {
        use std::arch::x86_64::*;
        vertices.reserve(points.len());
        // Vertices before the first whole line of the cache.
        let ahead = vertices.as_ptr().addr().wrapping_add(16 * vertices.len()).wrapping_neg() % 64;
        let streams = ahead.is_multiple_of(16);
        let (before, points) = points.split_at(if streams { (ahead / 16).min(points.len()) } else { 0 });
        if !self.pick(face, before, vertices) {
            return false;
        }
        let (eights, rest) = points.as_chunks::<8>();
        let (length, mut all) = (vertices.len(), 0xff);
        let columns = _mm512_set1_epi64(self.columns as i64);
        let rows = _mm512_set1_epi64(self.rows as i64);
        let low = _mm512_set1_epi64(u32::MAX.into());
        let between = _mm512_set1_epi64((((1i64 << self.shift) - 1) << 32) | ((1 << self.shift) - 1));
        let (x_by, y_by) = (_mm_cvtsi64_si128(self.shift.into()), _mm_cvtsi64_si128(i64::from(self.shift) + 32));
        let faces = _mm512_set1_epi64(face.into());
        let first = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
        let last = _mm512_setr_epi64(4, 12, 5, 13, 6, 14, 7, 15);
        // Reading waits for memory most of the time: what comes later is asked for ahead of it. Points of strips alternate between a row and the next: every
        // other one was read with the row before, and lines of memory hold several.
        let ahead_of = |points: &[[u32; 2]; 8]| {
            for &[x, y] in points.iter().step_by(4) {
                let at = (y >> self.shift) as usize * self.columns + (x >> self.shift) as usize;
                // Where there is no memory nothing is asked for.
                _mm_prefetch::<_MM_HINT_T0>(self.heights.as_ptr().wrapping_add(at).cast());
            }
        };
        eights.iter().take(AHEAD).for_each(ahead_of);
        for (i, points) in eights.iter().enumerate() {
            if let Some(points) = eights.get(i + AHEAD) {
                ahead_of(points);
            }
            // SAFETY: eight points are sixty-four bytes; heights are read only where columns and rows have them; there is room for as many vertices as
            // points, a line's if they begin with one, and they are said to be there after they were written.
            unsafe {
                let points = _mm512_loadu_si512(points.as_ptr().cast());
                let x = _mm512_srl_epi64(_mm512_and_si512(points, low), x_by);
                let y = _mm512_srl_epi64(points, y_by);
                let on_sample = _mm512_testn_epi64_mask(points, between)
                    & _mm512_cmplt_epu64_mask(x, columns)
                    & _mm512_cmplt_epu64_mask(y, rows);
                all &= on_sample;
                let index = _mm512_add_epi64(_mm512_mul_epu32(y, columns), x);
                let heights =
                    _mm512_mask_i64gather_ps::<4>(_mm256_setzero_ps(), on_sample, index, self.heights.as_ptr().cast());
                let heights = _mm512_slli_epi64::<32>(_mm512_cvtepu32_epi64(_mm256_castps_si256(heights)));
                let others = _mm512_or_si512(heights, faces);
                let to = vertices.as_mut_ptr().add(length + 8 * i).cast::<__m512i>();
                let four = _mm512_permutex2var_epi64(points, first, others);
                let next = _mm512_permutex2var_epi64(points, last, others);
                if streams {
                    _mm512_stream_si512(to, four);
                    _mm512_stream_si512(to.add(1), next);
                } else {
                    _mm512_storeu_si512(to.cast(), four);
                    _mm512_storeu_si512(to.add(1).cast(), next);
                }
            }
        }
        if !eights.is_empty() {
            // Others see what went past the caches after the fence.
            _mm_sfence();
        }
        // SAFETY: these were just written.
        unsafe { vertices.set_len(length + 8 * eights.len()) };
        all == 0xff && self.pick(face, rest, vertices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_raised_or_refused() {
        let heights: Vec<f32> = (0..37 * 23).map(|i| i as f32).collect();
        let samples = Samples { heights: &heights, columns: 37, rows: 23, shift: 24 };
        let mut points: Vec<[u32; 2]> = (0..61u32).map(|i| [(i * 7 % 37) << 24, (i * 5 % 23) << 24]).collect();
        for count in [0, 1, 3, 8, 11, 61] {
            // After any number of others.
            let (mut some, mut picked) = (Vec::new(), Vec::new());
            for round in 1..9 {
                assert!(samples.raise(round, &points[..count], &mut some));
                assert!(samples.pick(round, &points[..count], &mut picked));
                assert_eq!(some, picked);
                samples.raise(round, &points[..1], &mut some);
                samples.pick(round, &points[..1], &mut picked);
            }
            for vertex in some {
                assert_eq!(vertex.height, ((vertex.y >> 24) * 37 + (vertex.x >> 24)) as f32);
            }
        }
        for wrong in [[37 << 24, 0], [0, 23 << 24], [1 << 23, 0], [0, (1 << 24) + 1]] {
            for at in [0, 30, 60] {
                let right = std::mem::replace(&mut points[at], wrong);
                let mut vertices = vec![Vertex { x: 1, y: 2, face: 3, height: 4.0 }];
                assert!(!samples.raise(0, &points, &mut vertices), "{wrong:?} is no sample");
                assert_eq!(vertices.len(), 1, "nothing is added");
                assert!(!samples.pick(0, &points, &mut vertices), "{wrong:?} is no sample");
                points[at] = right;
            }
        }
    }
}
