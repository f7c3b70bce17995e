//! Heights at many points: the exact bilinear surface, vectors of points at a time.
//!
//! Such a query is two reads from far apart and a little arithmetic. Cells and fractions are worked out first, for a block
//! of points, so that the reads of many points are under way together.

use super::bulk::{RayCaster, Simd};
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{Lanes, Portable};
use super::stream::blend;
use crate::field::Land;
use glam::{DVec2, Vec2};
use rayon::prelude::*;

/// Points worked on together.
const BLOCK: usize = 64;

impl Land {
    /// Heights (m) of the surface at many world positions; NaN where void or outside. The same bits as
    /// [`Land::height_at`], many times as fast.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn heights_at(&self, places: &[DVec2], heights: &mut [f32]) {
        assert_eq!(places.len(), heights.len(), "expected as many heights as places");
        let (origin, spacing) = (self.origin(), self.raster().spacing());
        lookup(Simd::best(), self, places, heights, |place| (place - origin) / spacing);
    }

    /// [`Land::heights_at`] on all threads, with the same answers.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn par_heights_at(&self, places: &[DVec2], heights: &mut [f32]) {
        assert_eq!(places.len(), heights.len(), "expected as many heights as places");
        let part = super::bulk::PART;
        places
            .par_chunks(part)
            .zip(heights.par_chunks_mut(part))
            .for_each(|(places, heights)| self.heights_at(places, heights));
    }
}

impl RayCaster<'_> {
    /// Heights (m, absolute) of the surface at positions counted from the anchor; NaN where void or outside.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn heights_at(&self, places: &[Vec2], heights: &mut [f32]) {
        assert_eq!(places.len(), heights.len(), "expected as many heights as places");
        let (origin, spacing) = (self.land.origin(), self.land.raster().spacing());
        let anchor = self.anchor.truncate() - origin;
        lookup(self.simd, self.land, places, heights, |place| (anchor + place.as_dvec2()) / spacing);
    }
}

/// Runs the kernel compiled for `simd`; `lattice` turns a place into units of samples.
fn lookup<P: Copy>(simd: Simd, land: &Land, places: &[P], heights: &mut [f32], lattice: impl Fn(P) -> DVec2) {
    if land.raster().heights().len() > i32::MAX as usize {
        for (place, height) in places.iter().zip(heights) {
            *height = land.height_at_lattice(lattice(*place)).unwrap_or(f32::NAN);
        }
        return;
    }
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512dq,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
        fn avx512<P: Copy>(land: &Land, places: &[P], heights: &mut [f32], lattice: impl Fn(P) -> DVec2) {
            // SAFETY: this function is compiled for it and only called where it is available.
            kernel(unsafe { Avx512::new() }, land, places, heights, lattice);
        }
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
        fn avx2<P: Copy>(land: &Land, places: &[P], heights: &mut [f32], lattice: impl Fn(P) -> DVec2) {
            // SAFETY: as above.
            kernel(unsafe { Avx2::new() }, land, places, heights, lattice);
        }
        match simd {
            // SAFETY: callers name only instructions that are available.
            Simd::Avx512 => return unsafe { avx512(land, places, heights, lattice) },
            // SAFETY: as above.
            Simd::Avx2 => return unsafe { avx2(land, places, heights, lattice) },
            Simd::Portable => {}
        }
    }
    let _ = simd;
    kernel(Portable, land, places, heights, lattice);
}

#[inline(always)]
fn kernel<L: Lanes, P: Copy>(l: L, land: &Land, places: &[P], heights: &mut [f32], lattice: impl Fn(P) -> DVec2) {
    let raster = land.raster();
    let columns = raster.columns() as i32;
    let last = DVec2::new((raster.columns() - 1) as f64, (raster.rows() - 1) as f64);
    let voids = raster.voids().any();
    let (mut index, mut u, mut v) = ([0i32; BLOCK], [0.0f32; BLOCK], [0.0f32; BLOCK]);
    for (places, heights) in places.chunks(BLOCK).zip(heights.chunks_mut(BLOCK)) {
        for (lane, place) in places.iter().enumerate() {
            let at = lattice(*place);
            let inside = at.x >= 0.0 && at.y >= 0.0 && at.x <= last.x && at.y <= last.y;
            let (x, y) = if inside { (at.x, at.y) } else { (0.0, 0.0) };
            let (column, row) = (x.floor().min(last.x - 1.0), y.floor().min(last.y - 1.0));
            // SAFETY: both lie within the raster, whose number of samples fits an `i32`.
            let (c, r) = unsafe { (column.to_int_unchecked::<i32>(), row.to_int_unchecked::<i32>()) };
            index[lane] = r * columns + c;
            u[lane] = if inside { (x - column) as f32 } else { f32::NAN };
            v[lane] = (y - row) as f32;
        }
        let mut answers = [0.0f32; BLOCK];
        let all = l.mask(u32::MAX);
        for at in (0..places.len()).step_by(L::COUNT) {
            let here = l.load_int(&index[at..]);
            let (u, v) = (l.load(&u[at..]), l.load(&v[at..]));
            // SAFETY: `index` names a sample with neighbours east, north and north-east; entries behind the last place
            // are those of an earlier block, or 0.
            let ((a, b), (c, d)) = unsafe {
                (
                    l.gather_pair(all, raster.heights(), here),
                    l.gather_pair(all, raster.heights(), l.iadd(here, l.int(columns))),
                )
            };
            l.store(blend(l, [a, b, c, d], u, v), &mut answers[at..]);
        }
        heights.copy_from_slice(&answers[..heights.len()]);
        if voids {
            let words = raster.voids();
            for (lane, height) in heights.iter_mut().enumerate() {
                let here = index[lane] as usize;
                let corners = [here, here + 1, here + columns as usize, here + columns as usize + 1];
                if corners.into_iter().any(|corner| words.is_void(corner)) && !height.is_nan() {
                    *height = land.height_at_lattice(lattice(places[lane])).unwrap_or(f32::NAN);
                }
            }
        }
    }
}
