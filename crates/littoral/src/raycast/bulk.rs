//! Many rays at once: the public face of the kernels, and the choice of instructions.

use super::camera::ViewRays;
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{Lanes, Portable};
use super::scene::Scene;
use super::single::Single;
use super::stream::{self, BLOCK, LocalRay, Prepared, Rays};
use super::walk;
use crate::field::Land;
use crate::space::{Ray, View};
use glam::{DVec3, Vec2};
use rayon::prelude::*;
use std::ops::Range;

/// Which instructions the kernels use. All give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simd {
    /// Plain Rust.
    Portable,
    /// Eight lanes of AVX2 and FMA (x86-64).
    Avx2,
    /// Sixteen lanes of AVX-512 F, BW, DQ and VL (x86-64).
    Avx512,
}

impl Simd {
    /// Whether this processor has them.
    pub fn available(self) -> bool {
        match self {
            Simd::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Simd::Avx2 => {
                use std::arch::is_x86_feature_detected as has;
                has!("avx2") && has!("fma") && has!("bmi1") && has!("bmi2") && has!("popcnt") && has!("lzcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Simd::Avx512 => {
                use std::arch::is_x86_feature_detected as has;
                Simd::Avx2.available() && has!("avx512f") && has!("avx512dq") && has!("avx512bw") && has!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The widest that this processor has.
    pub fn best() -> Simd {
        [Simd::Avx512, Simd::Avx2].into_iter().find(|simd| simd.available()).unwrap_or(Simd::Portable)
    }
}

/// Casts many rays at a land in `f32`, all relative to one `f64` anchor: made once per camera or batch.
///
/// Positions near the anchor keep their precision wherever it lies; the error of a hit is about 10⁻⁷ of its distance from
/// the anchor plus half a millimetre, measured along the steeper of ray and surface. Put the anchor near where rays start.
#[derive(Clone, Debug)]
pub struct RayCaster<'a> {
    pub(super) land: &'a Land,
    pub(super) anchor: DVec3,
    pub(super) scene: Option<Scene<'a>>,
    single: Option<Single<'a>>,
    pub(super) simd: Simd,
}

impl Land {
    /// A caster of many rays whose origins count from `anchor`.
    pub fn caster(&self, anchor: DVec3) -> RayCaster<'_> {
        let scene = Scene::new(self, anchor);
        let single = scene.as_ref().and_then(|scene| Single::new(self, scene));
        RayCaster { land: self, anchor, scene, single, simd: Simd::best() }
    }
}

impl<'a> RayCaster<'a> {
    /// Uses other instructions than the best there are: for tests and comparisons.
    ///
    /// # Panics
    /// If the processor lacks them.
    pub fn with_simd(mut self, simd: Simd) -> RayCaster<'a> {
        assert!(simd.available(), "{simd:?} is not available here");
        self.simd = simd;
        self
    }

    /// The distance to the first hit of one ray (in lengths of its direction), infinity for none, from above and below as
    /// [`Land::first_hit`]. For rays that come one by one; many at a time are faster as [`RayCaster::first_hits`].
    #[inline]
    pub fn first_hit(&self, ray: &LocalRay) -> f32 {
        if ray.spread > 0.0 {
            let mut distance = [0.0];
            self.first_hits(std::slice::from_ref(ray), &mut distance);
            return distance[0];
        }
        let distance = self.single.as_ref().map_or(f32::NAN, |single| single.first_hit(self.simd, ray));
        if distance.is_nan() { self.exact(ray) } else { distance }
    }

    /// Whether one ray meets the surface anywhere from its origin to its reach.
    pub fn any_hit(&self, ray: &LocalRay) -> bool {
        self.first_hit(ray) < f32::INFINITY
    }

    /// The distance to the first hit of each ray (in lengths of its direction), infinity where there is none, from above
    /// and below as [`Land::first_hit`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn first_hits(&self, rays: &[LocalRay], distances: &mut [f32]) {
        assert_eq!(rays.len(), distances.len(), "expected as many distances as rays");
        self.walk::<false, _>(rays, distances, |distance| distance);
    }

    /// Whether each ray meets the surface anywhere from its origin to its reach.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn any_hits(&self, rays: &[LocalRay], hits: &mut [bool]) {
        assert_eq!(rays.len(), hits.len(), "expected as many answers as rays");
        self.walk::<true, _>(rays, hits, |distance| distance < f32::INFINITY);
    }

    /// [`RayCaster::first_hits`] on all threads, with the same answers.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn par_first_hits(&self, rays: &[LocalRay], distances: &mut [f32]) {
        assert_eq!(rays.len(), distances.len(), "expected as many distances as rays");
        let parts = rays.par_chunks(PART).zip(distances.par_chunks_mut(PART));
        parts.for_each(|(rays, distances)| self.first_hits(rays, distances));
    }

    /// [`RayCaster::any_hits`] on all threads, with the same answers.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn par_any_hits(&self, rays: &[LocalRay], hits: &mut [bool]) {
        assert_eq!(rays.len(), hits.len(), "expected as many answers as rays");
        rays.par_chunks(PART).zip(hits.par_chunks_mut(PART)).for_each(|(rays, hits)| self.any_hits(rays, hits));
    }

    /// The primary rays of some rows of a picture: for each pixel, row by row, the distance of what is seen there, infinity
    /// for nothing. A ray goes through the point `sample` of its pixel, (0.5, 0.5) being the centre; distances count lengths
    /// of the direction `corner + right * x + down * y` of [`View::frame`], so that
    /// `view.eye + distance * direction` is the point seen.
    ///
    /// Works for any anchor; the eye itself is the best one. Much faster than the same rays as a stream. Rows are
    /// independent of each other: any split gives the same answers up to the last bits of a distance.
    ///
    /// # Panics
    /// If the rows leave the picture or `distances` does not hold a number for each of their pixels.
    pub fn view_hits(&self, view: &View, sample: Vec2, rows: Range<u32>, distances: &mut [f32]) {
        self.view::<false>(view, sample, 0.0, rows, distances);
    }

    /// [`RayCaster::view_hits`] by footprint: where a node of the range pyramid is not wider than `pixels` pixels there, its
    /// highest point stands for all of it. Never later than the exact hit, and earlier by no more than what such a node
    /// holds.
    ///
    /// # Panics
    /// As [`RayCaster::view_hits`].
    pub fn view_hits_by_footprint(
        &self,
        view: &View,
        sample: Vec2,
        pixels: f32,
        rows: Range<u32>,
        distances: &mut [f32],
    ) {
        self.view::<true>(view, sample, pixels, rows, distances);
    }

    fn view<const FOOTPRINT: bool>(
        &self,
        view: &View,
        sample: Vec2,
        pixels: f32,
        rows: Range<u32>,
        distances: &mut [f32],
    ) {
        assert!(rows.start <= rows.end && rows.end <= view.size.y, "rows {rows:?} leave a picture of {}", view.size.y);
        assert_eq!(distances.len(), rows.len() * view.size.x as usize, "expected one distance for each pixel");
        if distances.is_empty() {
            return;
        }
        let eye = (view.eye - self.anchor).as_vec3();
        let (corner, right, down) = view.frame();
        let (width, first) = (view.size.x, rows.start);
        let direction = |index: usize| {
            let (x, y) = (
                (index % width as usize) as f32 + sample.x,
                (first as usize + index / width as usize) as f32 + sample.y,
            );
            corner + right * x + down * y
        };
        let Some(scene) = &self.scene else {
            for (index, distance) in distances.iter_mut().enumerate() {
                *distance = self.exact(&LocalRay::new(eye, direction(index)));
            }
            return;
        };
        let mut below = Vec::new();
        let frame = (corner, right, down);
        let mut rays = ViewRays::<FOOTPRINT>::new(eye, frame, sample, pixels, width, rows, distances, &mut below);
        if scene.voids.is_empty() {
            dispatch::<_, false, false>(self.simd, scene, &mut rays);
        } else {
            dispatch::<_, true, false>(self.simd, scene, &mut rays);
        }
        if !below.is_empty() {
            let rays: Vec<LocalRay> = below.iter().map(|&id| LocalRay::new(eye, direction(id as usize))).collect();
            let mut again = vec![f32::INFINITY; rays.len()];
            let mut stream = Stream::<f32, false> {
                rays: &rays,
                order: None,
                next: 0,
                out: &mut again,
                answer: |distance| distance,
                below: &mut Vec::new(),
            };
            dispatch::<_, true, false>(self.simd, scene, &mut stream);
            for (&id, again) in below.iter().zip(again) {
                distances[id as usize] = again;
            }
        }
    }

    /// [`RayCaster::view_hits`] of the whole picture on all threads, with the same answers for any number of them.
    ///
    /// # Panics
    /// If `distances` does not hold a number for each pixel.
    pub fn par_view_hits(&self, view: &View, sample: Vec2, distances: &mut [f32]) {
        assert_eq!(
            distances.len(),
            view.size.x as usize * view.size.y as usize,
            "expected one distance for each pixel"
        );
        let band = 64 * view.size.x as usize;
        distances.par_chunks_mut(band.max(1)).enumerate().for_each(|(index, distances)| {
            let first = 64 * index as u32;
            self.view_hits(view, sample, first..(first + 64).min(view.size.y), distances);
        });
    }

    fn walk<const ANY: bool, T: Copy>(&self, rays: &[LocalRay], out: &mut [T], answer: fn(f32) -> T) {
        // A part at a time, so that rays are still near when they are walked.
        for (rays, out) in rays.chunks(PART).zip(out.chunks_mut(PART)) {
            if rays.iter().any(|ray| ray.spread > 0.0) {
                self.walk_as::<true, ANY, T>(rays, out, answer);
            } else {
                self.walk_as::<false, ANY, T>(rays, out, answer);
            }
        }
    }

    fn walk_as<const FOOTPRINT: bool, const ANY: bool, T: Copy>(
        &self,
        rays: &[LocalRay],
        out: &mut [T],
        answer: fn(f32) -> T,
    ) {
        let Some(scene) = &self.scene else {
            for (ray, out) in rays.iter().zip(out) {
                *out = answer(self.exact(ray));
            }
            return;
        };
        let mut below = Vec::new();
        // Under a sheet with holes a ray that starts above may get below: all rays go by the sheet.
        if scene.voids.is_empty() {
            let mut stream = Stream::<T, FOOTPRINT> { rays, order: None, next: 0, out, answer, below: &mut below };
            dispatch::<_, false, ANY>(self.simd, scene, &mut stream);
            if below.is_empty() {
                return;
            }
        } else {
            below.extend(0..rays.len() as i32);
        }
        let (order, below) = (Some(below.as_slice()), &mut Vec::new());
        let mut stream = Stream::<T, FOOTPRINT> { rays, order, next: 0, out, answer, below };
        dispatch::<_, true, ANY>(self.simd, scene, &mut stream);
    }

    /// One ray by the `f64` walk.
    pub(super) fn exact(&self, ray: &LocalRay) -> f32 {
        let (origin, direction) = (self.anchor + ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let ray = Ray { origin, direction, reach: f64::from(ray.reach) };
        walk::first_crossing(self.land, &ray, true).map_or(f32::INFINITY, |crossing| crossing.distance as f32)
    }
}

/// Rays that a thread takes at a time.
pub(super) const PART: usize = 1 << 14;

/// Level at which streams start: neither all the way down from the top, nor all the way up.
const START: i32 = 5;

/// A slice of rays, or some of it in some order.
struct Stream<'a, T, const FOOTPRINT: bool> {
    rays: &'a [LocalRay],
    order: Option<&'a [i32]>,
    next: usize,
    out: &'a mut [T],
    answer: fn(f32) -> T,
    below: &'a mut Vec<i32>,
}

impl<T: Copy, const FOOTPRINT: bool> Rays for Stream<'_, T, FOOTPRINT> {
    const REFILL: u32 = 12;
    const RISE: i32 = 1;
    const FOOTPRINT: bool = FOOTPRINT;

    #[inline(always)]
    fn next<L: Lanes>(&mut self, l: L, scene: &Scene, block: &mut Prepared) {
        let left = self.order.map_or(self.rays.len(), <[i32]>::len) - self.next;
        block.count = left.min(BLOCK);
        for at in (0..block.count).step_by(L::COUNT) {
            let mut id = [0; 16];
            let mut rows = [&[0.0; 8]; 16];
            for lane in 0..L::COUNT {
                // The last vector repeats the last ray.
                let index = self.next + (at + lane).min(block.count - 1);
                id[lane] = self.order.map_or(index as i32, |order| order[index]);
                rows[lane] = bytemuck::cast_ref(&self.rays[id[lane] as usize]);
            }
            let [x, y, z, reach, dx, dy, dz, spread] = l.columns(rows);
            let (zero, top) = (l.splat(0.0), l.int(scene.top.min(START)));
            block.set(l, scene, at, l.load_int(&id), [x, y, z], [dx, dy, dz], reach, zero, top);
            if FOOTPRINT {
                l.store(l.mul(spread, l.splat(scene.per_metre.min_element())), &mut block.spread[at..]);
            }
        }
        self.next += block.count;
    }

    #[inline(always)]
    fn done(&mut self, id: i32, distance: f32) {
        self.out[id as usize] = (self.answer)(distance);
    }

    #[inline(always)]
    fn below(&mut self, id: i32) {
        self.below.push(id);
    }
}

/// Runs the kernel compiled for `simd`.
pub(super) fn dispatch<R: Rays, const SHEET: bool, const ANY: bool>(simd: Simd, scene: &Scene, rays: &mut R) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512dq,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
        fn avx512<R: Rays, const SHEET: bool, const ANY: bool>(scene: &Scene, rays: &mut R) {
            // SAFETY: this function is compiled for it and only called where it is available.
            stream::run::<_, R, SHEET, ANY>(unsafe { Avx512::new() }, scene, rays);
        }
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
        fn avx2<R: Rays, const SHEET: bool, const ANY: bool>(scene: &Scene, rays: &mut R) {
            // SAFETY: as above.
            stream::run::<_, R, SHEET, ANY>(unsafe { Avx2::new() }, scene, rays);
        }
        match simd {
            // SAFETY: `RayCaster` holds only instructions that are available.
            Simd::Avx512 => return unsafe { avx512::<R, SHEET, ANY>(scene, rays) },
            // SAFETY: as above.
            Simd::Avx2 => return unsafe { avx2::<R, SHEET, ANY>(scene, rays) },
            Simd::Portable => {}
        }
    }
    let _ = simd;
    stream::run::<_, R, SHEET, ANY>(Portable, scene, rays);
}
