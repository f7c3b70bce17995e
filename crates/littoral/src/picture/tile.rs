//! Tiles: the squares of pixels that one thread works on, and how many rays each pixel gets.
//!
//! All rays of a tile that are of one kind go through the caster together: first those from the eye, then those that what they meet
//! asks for. Each pixel begins with a few samples; where these disagree, among themselves or with the pixels next to
//! them, the others follow. A clear sky, a lawn and a sheet of paper are done with the first (after D. Mitchell, "Generating
//! antialiased images at low sampling densities", SIGGRAPH 1987). Nothing depends on what other tiles do.

use super::Settings;
use super::sampler::Patterns;
use super::shade::{Ahead, Near, Shaded};
use super::stage::{Lens, Stage};
use super::waves::Wet;
use crate::raycast::LocalRay;
use crate::space::View;
use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use std::ops::Range;

/// Side of a tile (pixels).
pub const TILE: u32 = 16;
/// Samples that every pixel gets, and the share of all that it does at least.
pub const FIRST: u32 = 4;
const LEAST_SHARE: u32 = 4;
/// Samples of a pixel that share one piece of the sea's surface.
const LENT: usize = 6;
/// Contrast (largest over smallest luminance, less one) that calls for all samples: between those of a pixel, and between neighbours.
const DISAGREE: f32 = 0.12;
const DIFFER: f32 = 0.18;

/// One finished pixel.
pub struct Pixel {
    /// Mean radiance (kcd/m²).
    pub radiance: Vec3,
    /// Share that is not sky.
    pub coverage: f32,
    /// Position and normal of the land or water seen through its middle.
    pub middle: Option<(DVec3, Vec3)>,
}

/// What the samples of a pixel add up to.
#[derive(Clone, Copy)]
struct Sum {
    light: Vec3,
    count: u32,
    sky: u32,
    dimmest: f32,
    brightest: f32,
}

impl Default for Sum {
    fn default() -> Sum {
        Sum { light: Vec3::ZERO, count: 0, sky: 0, dimmest: f32::INFINITY, brightest: 0.0 }
    }
}

impl Sum {
    fn add(&mut self, light: Vec3, sky: bool) {
        let bright = light.element_sum();
        self.light += light;
        self.count += 1;
        self.sky += u32::from(sky);
        self.dimmest = self.dimmest.min(bright);
        self.brightest = self.brightest.max(bright);
    }

    fn bright(&self) -> f32 {
        self.light.element_sum() / self.count as f32
    }
}

/// Where the pixels of a tile are and which rays go through them.
pub struct Mosaic<'a> {
    /// What the eye sees with.
    pub lens: &'a Lens<'a>,
    /// The camera.
    pub view: &'a View,
    /// How often.
    pub settings: &'a Settings,
    /// Through which points of each pixel.
    pub patterns: &'a Patterns,
}

impl Stage<'_> {
    /// The pixels of the tile whose upper left one is `from`, row by row.
    pub(super) fn tile(&self, mosaic: &Mosaic, from: UVec2) -> Vec<Pixel> {
        let to = (from + TILE).min(mosaic.view.size);
        let (width, height) = ((to.x - from.x) as usize, (to.y - from.y) as usize);
        let place = |i: usize| from + UVec2::new((i % width) as u32, (i / width) as u32);
        let samples = mosaic.settings.samples.max(1);
        let first = samples.min(FIRST.max(samples / LEAST_SHARE));
        let mut sums = vec![Sum::default(); width * height];
        let all: Vec<usize> = (0..width * height).collect();
        self.sample(mosaic, &all, &place, 0..first, &mut sums);
        if first < samples {
            let unsettled: Vec<usize> = all.iter().copied().filter(|&i| !settled(&sums, width, i)).collect();
            self.sample(mosaic, &unsettled, &place, first..samples, &mut sums);
        }
        let middles = match mosaic.settings.passes {
            true => self.middles(mosaic, all.iter().map(|&i| place(i))),
            false => vec![None; all.len()],
        };
        let finished = sums.iter().zip(middles).map(|(sum, middle)| {
            let share = 1.0 / sum.count as f32;
            Pixel { radiance: sum.light * share, coverage: 1.0 - sum.sky as f32 * share, middle }
        });
        finished.collect()
    }

    /// Adds some samples of some pixels to their sums.
    fn sample(
        &self,
        mosaic: &Mosaic,
        pixels: &[usize],
        place: &dyn Fn(usize) -> UVec2,
        samples: Range<u32>,
        sums: &mut [Sum],
    ) {
        let Mosaic { lens, view, patterns, .. } = mosaic;
        let (corner, right, down) = view.frame();
        let per_pixel = samples.len();
        let mut rays = Vec::with_capacity(pixels.len() * per_pixel);
        for &i in pixels {
            let at = place(i);
            let pattern = patterns.of(at);
            for s in samples.clone() {
                let p = at.as_vec2() + 0.5 + pattern.lens(s);
                rays.push(LocalRay::new(Vec3::ZERO, (corner + right * p.x + down * p.y).normalize()));
            }
        }
        let mut distances = vec![f32::INFINITY; rays.len()];
        lens.caster.first_hits(&rays, &mut distances);
        let wet = self.wet_all(lens, &rays, &distances, LENT, per_pixel);
        let wet = |k: usize| wet.get(k).copied().flatten();
        let seen = rays.iter().zip(&distances).enumerate();
        let mut ahead: Vec<Ahead> =
            seen.map(|(k, (ray, &distance))| self.ahead(lens, ray.direction, distance, wet(k))).collect();
        self.objects_before(lens, &rays, &mut ahead);
        let mut shaded: Vec<Shaded> = Vec::with_capacity(rays.len());
        let (mut shadow_rays, mut shadow_of) = (Vec::new(), Vec::new());
        let (mut mirror_rays, mut mirror_of) = (Vec::new(), Vec::new());
        for (n, &i) in pixels.iter().enumerate() {
            let pattern = patterns.of(place(i));
            let mut near = Near::default();
            for s in samples.clone() {
                let k = n * per_pixel + (s - samples.start) as usize;
                let sample = self.shade(lens, rays[k].direction, &ahead[k], pattern, s, &mut near);
                if let Some(ray) = sample.shadow {
                    shadow_rays.push(ray);
                    shadow_of.push(k);
                }
                if let Some(ray) = sample.mirror {
                    mirror_rays.push(ray);
                    mirror_of.push(k);
                }
                shaded.push(sample);
            }
        }
        let mut blocked = vec![false; shadow_rays.len()];
        lens.caster.any_hits(&shadow_rays, &mut blocked);
        for (&k, &blocked) in shadow_of.iter().zip(&blocked) {
            if !blocked {
                let sample = &mut shaded[k];
                sample.light += sample.sunlit;
            }
        }
        distances.clear();
        distances.resize(mirror_rays.len(), f32::INFINITY);
        lens.caster.first_hits(&mirror_rays, &mut distances);
        for ((&k, ray), &distance) in mirror_of.iter().zip(&mirror_rays).zip(&distances) {
            let mirrored = self.mirrored(lens, ray, distance);
            let sample = &mut shaded[k];
            sample.light += mirrored * sample.mirror_share;
        }
        // A spark brighter than this would speckle its surroundings; sky and sun are no sparks.
        let brightest = Vec3::splat(self.mist.max_element().max(1.0) * 30.0);
        for (samples, &i) in shaded.chunks_exact(per_pixel).zip(pixels) {
            for sample in samples {
                let light = sample.light * sample.through + sample.veil;
                sums[i].add(if sample.sky { light } else { light.min(brightest) }, sample.sky);
            }
        }
    }

    /// Where rays meet the sea; empty where there is none. Rays are `per_pixel` for each pixel; of `share` that follow one another the first
    /// lends its piece of surface, which is already averaged over the pixel, to the others.
    fn wet_all(
        &self,
        lens: &Lens,
        rays: &[LocalRay],
        distances: &[f32],
        share: usize,
        per_pixel: usize,
    ) -> Vec<Option<Wet>> {
        let Some(sea) = lens.sea else { return Vec::new() };
        let mut wet = vec![None; rays.len()];
        let there = |at: DVec2| self.may_be_wet(at) && self.ground.block.is_none_or(|block| block.holds(at));
        let trace = |wanted: &[usize], wet: &mut [Option<Wet>]| {
            let rays: Vec<LocalRay> = wanted.iter().map(|&k| rays[k]).collect();
            let grounds: Vec<f32> = wanted.iter().map(|&k| distances[k]).collect();
            let mut found = self.wet(lens, sea, &rays, &grounds);
            if let Some(mesh) = lens.water {
                self.wet_mesh(lens, sea, mesh, &rays, &grounds, &mut found);
            }
            for (&k, found) in wanted.iter().zip(found) {
                wet[k] = found.filter(|w| there(w.position.truncate()));
            }
        };
        let lender = |k: usize| k - (k % per_pixel) % share;
        let (lenders, others): (Vec<usize>, Vec<usize>) = (0..rays.len()).partition(|&k| lender(k) == k);
        trace(&lenders, &mut wet);
        // Where the first met no water the others see for themselves.
        let (lent, alone): (Vec<usize>, Vec<usize>) = others.into_iter().partition(|&k| wet[lender(k)].is_some());
        for k in lent {
            wet[k] = wet[lender(k)].and_then(|w| w.lent(lens.eye, &rays[k], distances[k]));
            wet[k] = wet[k].filter(|w| there(w.position.truncate()));
        }
        trace(&alone, &mut wet);
        wet
    }

    /// What is seen through the middle of each pixel: the passes, which no filter may touch.
    fn middles(&self, mosaic: &Mosaic, places: impl Iterator<Item = UVec2>) -> Vec<Option<(DVec3, Vec3)>> {
        let Mosaic { lens, view, .. } = mosaic;
        let (corner, right, down) = view.frame();
        let ray = |at: UVec2| {
            let p = at.as_vec2() + 0.5;
            LocalRay::new(Vec3::ZERO, (corner + right * p.x + down * p.y).normalize())
        };
        let rays: Vec<LocalRay> = places.map(ray).collect();
        let mut distances = vec![f32::INFINITY; rays.len()];
        lens.caster.first_hits(&rays, &mut distances);
        let wet = self.wet_all(lens, &rays, &distances, 1, 1);
        let wet = |k: usize| wet.get(k).copied().flatten();
        let seen = rays.iter().zip(&distances).enumerate();
        let mut ahead: Vec<Ahead> =
            seen.map(|(k, (ray, &distance))| self.ahead(lens, ray.direction, distance, wet(k))).collect();
        self.objects_before(lens, &rays, &mut ahead);
        let seen = ahead.into_iter().map(|ahead| match ahead {
            // Mist and floor stand for what is not known: nothing was measured there.
            Ahead::Sky | Ahead::Mist { .. } | Ahead::Floor { .. } => None,
            Ahead::Water { position, wet } => {
                let slope = wet.map_or(Vec2::ZERO, |w| w.slope);
                Some((position, Vec3::new(-slope.x, -slope.y, 1.0).normalize()))
            }
            Ahead::Wall(wall) => Some((wall.position, wall.normal)),
            Ahead::Object(thing) => Some((thing.position, thing.normal)),
            // The ground drawn reaches a little beyond the land, to dissolve into mist there.
            Ahead::Ground { position } => {
                let normal = self.scene.land.normal_at(position.truncate());
                normal.map(|normal| (position, normal))
            }
        });
        seen.collect()
    }
}

/// Whether the samples of a pixel agree so well that more would change nothing to be seen.
fn settled(sums: &[Sum], width: usize, i: usize) -> bool {
    let sum = &sums[i];
    let here = sum.bright();
    let (column, row) = (i % width, i / width);
    let alike = |j: usize| {
        let there = sums[j].bright();
        here.max(there) <= here.min(there) * (1.0 + DIFFER)
    };
    (sum.sky == 0 || sum.sky == sum.count)
        && sum.brightest <= sum.dimmest * (1.0 + DISAGREE)
        && (column == 0 || alike(i - 1))
        && (column + 1 == width || alike(i + 1))
        && (row == 0 || alike(i - width))
        && (i + width >= sums.len() || alike(i + width))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::noise::Fbm;
    use crate::field::{Land, Raster};
    use crate::picture::stage::Caster;
    use crate::picture::{Border, Picture, Scene, Style, Sun, Water};
    use crate::raycast::Hit;
    use crate::space::Ray;
    use glam::DVec2;

    /// Rays one at a time in `f64`, by the pyramid or past it.
    struct OneByOne<'a> {
        land: &'a Land,
        eye: DVec3,
        cast: fn(&Land, &Ray) -> Option<Hit>,
    }

    impl OneByOne<'_> {
        fn distance(&self, ray: &LocalRay) -> f32 {
            let (origin, direction) = (self.eye + ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let ray = Ray { origin, direction, reach: f64::from(ray.reach) };
            (self.cast)(self.land, &ray).map_or(f32::INFINITY, |hit| hit.distance as f32)
        }
    }

    impl Caster for OneByOne<'_> {
        fn first_hits(&self, rays: &[LocalRay], distances: &mut [f32]) {
            rays.iter().zip(distances).for_each(|(ray, distance)| *distance = self.distance(ray));
        }

        fn any_hits(&self, rays: &[LocalRay], hits: &mut [bool]) {
            rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.distance(ray) < f32::INFINITY);
        }
    }

    /// Hills of noise with a lake's worth of sea, and with voids in the middle and at the edge if asked for.
    fn hills(seed: u32, voids: bool) -> Land {
        let fbm = Fbm::new(11.0, 9.0, 5, seed);
        let (columns, rows) = (29, 23);
        let heights = (0..columns * rows).map(|i| {
            let (x, y) = (i % columns, i / columns);
            let hole = voids && ((9..13).contains(&x) && (5..9).contains(&y) || x + y < 6);
            if hole { f32::NAN } else { (10.0 * fbm.at(DVec2::new(x as f64, y as f64)).value) as f32 + 8.0 }
        });
        Land::new(Raster::new(columns, rows, DVec2::new(10.0, 14.0), heights.collect()).expect("valid"))
    }

    fn bits(picture: &Picture) -> Vec<u32> {
        let planes = [&picture.radiance, &picture.normal, &picture.position].into_iter().flatten().flatten();
        planes.chain(&picture.depth).chain(&picture.height).chain(&picture.coverage).map(|v| v.to_bits()).collect()
    }

    #[test]
    fn the_picture_is_that_of_walking_every_patch() {
        for (seed, voids, border, style) in [
            (1, false, Border::Mist, Style::Natural),
            (2, true, Border::Mist, Style::Natural),
            (3, true, Border::Cut, Style::Natural),
            (4, false, Border::Cut, Style::Tint),
            (5, true, Border::Cut, Style::Relief),
        ] {
            let land = hills(seed, voids);
            let water = Water::flood(&land, 0.0);
            let eye = match border {
                Border::Mist => DVec3::new(-60.0, -90.0, 150.0),
                Border::Cut => DVec3::new(-260.0, -330.0, 290.0),
            };
            let view = View::looking_at(eye, DVec3::new(20.0, 30.0, 0.0), 0.7, UVec2::new(40, 26));
            let scene = Scene { border, style, sun: Sun::new(4.0, 0.4), ..Scene::new(&land, water.as_ref()) };
            let stage = Stage::new(&scene);
            let settings = Settings { samples: 6, seed, passes: true };
            let by = |cast| {
                let caster = OneByOne { land: &stage.ground.land, eye, cast };
                stage.render_with(&caster, None, None, &view, &settings, &|_| {})
            };
            let (pyramid, patches) = (by(Land::first_hit), by(Land::first_hit_patch_by_patch));
            assert!(bits(&pyramid) == bits(&patches), "seed {seed}: the pyramid changes the picture");
            let hits = patches.depth.iter().filter(|d| d.is_finite()).count();
            assert!(hits > 250, "seed {seed}: only {hits} pixels of land");
            // Streams work in single precision: here and there a shadow's edge falls on the other side of a sample.
            let streams = stage.render(&view, &settings, &|_| {});
            let light = |p: &Picture| p.radiance.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
            let difference: f64 = (streams.radiance.iter().flatten().zip(patches.radiance.iter().flatten()))
                .map(|(a, b)| f64::from((a - b).abs()))
                .sum();
            assert!(difference < 2e-3 * light(&patches), "seed {seed}: streams differ by {difference}");
            for (a, b) in streams.depth.iter().zip(&patches.depth).filter(|(a, b)| a.is_finite() || b.is_finite()) {
                assert!((a - b).abs() < 1e-3 * b, "seed {seed}: {a} for {b}");
            }
        }
    }

    #[test]
    fn only_what_disagrees_gets_all_samples() {
        let even = |light: f32| {
            let mut sum = Sum::default();
            (0..4).for_each(|_| sum.add(Vec3::splat(light), false));
            sum
        };
        let mut sums = vec![even(1.0); 9];
        assert!((0..9).all(|i| settled(&sums, 3, i)));
        sums[4] = even(1.5);
        let unsettled: Vec<usize> = (0..9).filter(|&i| !settled(&sums, 3, i)).collect();
        assert_eq!(unsettled, [1, 3, 4, 5, 7], "a step, on both of its sides");
        sums[4] = even(1.0);
        sums[4].add(Vec3::splat(1.3), false);
        assert!(!settled(&sums, 3, 4), "a spark");
        sums[4] = even(1.0);
        sums[4].add(Vec3::splat(1.0), true);
        assert!(!settled(&sums, 3, 4), "a skyline");
    }
}
