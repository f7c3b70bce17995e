//! A good view of any land, chosen by itself.
//!
//! Many cameras are tried, as a photographer walks about: eyes over a lattice of places and several heights, looking in
//! several directions. Each takes a thumbnail by casting a few hundred rays and is judged by rules of the trade: some sky
//! but not much, light from the side that brings out the relief, near, middle and far ground, a skyline with a shape, some
//! water in front if there is any, nothing missing in the frame and nothing in front of the lens. Land too wide or too flat for that
//! is seen from above.

use super::ground::Ground;
use super::{Air, Style, Sun, Water};
use crate::field::{Land, coast};
use crate::raycast::LocalRay;
use crate::space::View;
use glam::{DVec2, DVec3, UVec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A view with the light, air and style that suit it.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// The camera.
    pub view: View,
    /// The sun.
    pub sun: Sun,
    /// The air.
    pub air: Air,
    /// The style.
    pub style: Style,
}

/// Land wider than this (m) is a map rather than a landscape: its bulge would hide its far side.
const WIDEST_LANDSCAPE: f64 = 200_000.0;
/// Vertical angle of view (rad), that of a moderate wide-angle lens.
const FIELD: f64 = 0.62;

/// A good view of `land` and `water`, with the light that suits it.
pub fn compose(land: &Land, water: Option<&Water>, size: UVec2) -> Shot {
    let extent = land.extent().max_element();
    let range = land.height_range();
    if range.is_empty() || extent > WIDEST_LANDSCAPE {
        return overhead(land, water, size);
    }
    let ground = Ground::new(land, water);
    let candidates = candidates(land, water, ground.has_standing());
    let small = UVec2::new(20, (20 * size.y.max(1)).div_ceil(size.x.max(1)).clamp(8, 40));
    let mut judged: Vec<(f64, usize)> =
        candidates.par_iter().enumerate().map(|(i, c)| (judge(&ground, water, c, small), i)).collect();
    // Best first; ties by number, so that the answer is the same everywhere.
    judged.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let finalists: Vec<usize> = judged.iter().take(24).map(|j| j.1).collect();
    let larger = small * 3;
    let best = finalists
        .par_iter()
        .map(|&i| (judge(&ground, water, &candidates[i], larger), i))
        .reduce(|| (f64::NEG_INFINITY, usize::MAX), |a, b| if (b.0, a.1) > (a.0, b.1) { b } else { a });
    let Some(camera) = candidates.get(best.1) else { return overhead(land, water, size) };
    Shot {
        view: camera.view(size),
        sun: Sun::new(camera.sun_bearing, 21f64.to_radians()),
        air: Air { visibility: (7.0 * extent).clamp(35_000.0, 160_000.0), ..Air::default() },
        style: Style::Natural,
    }
}

/// The whole land from straight above, north at the top, as on a map: tinted by height if it is wide, else in the style
/// of a shaded relief's light.
pub fn overhead(land: &Land, water: Option<&Water>, size: UVec2) -> Shot {
    let extent = land.extent();
    let aspect = f64::from(size.x.max(1)) / f64::from(size.y.max(1));
    // A long lens from far away: nearly parallel rays.
    let field = 0.12f64;
    let half = 0.5 * extent.y.max(extent.x / aspect) * 1.03;
    let centre = land.origin() + 0.5 * extent;
    let range = land.height_range();
    let top = if range.is_empty() { 0.0 } else { f64::from(range.high) };
    let eye = centre.extend(top + half / (0.5 * field).tan());
    let wide = extent.max_element() > WIDEST_LANDSCAPE;
    let _ = water;
    Shot {
        view: View::looking_at(eye, centre.extend(top), field as f32, size),
        sun: Sun::new(315f64.to_radians(), 38f64.to_radians()),
        air: Air { visibility: 200_000.0, veils_distance: false },
        style: if wide { Style::Tint } else { Style::Natural },
    }
}

/// The picture of the [built-in coast](crate::field::coast).
pub fn coast_shot(size: UVec2) -> Shot {
    let (azimuth, elevation) = coast::sun();
    Shot {
        view: coast::view(size),
        sun: Sun::new(azimuth, elevation),
        air: Air { visibility: 40_000.0, ..Air::default() },
        style: Style::Natural,
    }
}

/// A camera that is tried.
#[derive(Clone, Copy, Debug)]
struct Camera {
    eye: DVec3,
    /// Where it looks: bearing and elevation (rad).
    bearing: f64,
    tilt: f64,
    sun_bearing: f64,
}

impl Camera {
    fn view(&self, size: UVec2) -> View {
        let (s, c) = self.bearing.sin_cos();
        let (up, flat) = self.tilt.sin_cos();
        View::looking_at(self.eye, self.eye + DVec3::new(s * flat, c * flat, up) * 1e3, FIELD as f32, size)
    }
}

/// Eyes over a lattice of places within the land (and around it, where that is sea), at several heights.
fn candidates(land: &Land, water: Option<&Water>, standing: bool) -> Vec<Camera> {
    const PLACES: i32 = 8;
    const BEARINGS: usize = 12;
    let extent = land.extent();
    let reach = extent.min_element();
    let spacing = land.raster().spacing().max_element();
    let range = land.height_range();
    let relief = f64::from(range.high - range.low);
    let island = water.is_some_and(|w| w.reaches_horizon() && w.share() > 0.3);
    let (first, last) = if island { (-2, PLACES + 2) } else { (0, PLACES) };
    let mut cameras = Vec::new();
    for (i, j) in (first..=last).flat_map(|j| (first..=last).map(move |i| (i, j))) {
        let f = DVec2::new(f64::from(i), f64::from(j)) / f64::from(PLACES);
        let at = land.origin() + extent * (0.02 + 0.96 * f);
        let Some(ground) = ground_below(land, water, at) else { continue };
        for (k, share) in [0.035f64, 0.09, 0.18, 0.34].into_iter().enumerate() {
            // Never nearer to the ground than a few samples, lest they be seen one by one.
            let share = if standing { share.max(0.16) } else { share };
            let above = (share * reach).max(0.22 * relief * (k as f64 + 0.6)).max(5.0 * spacing);
            let eye = at.extend(ground + above);
            for b in 0..BEARINGS {
                let bearing = TAU * b as f64 / BEARINGS as f64;
                let tilt = -[6.0f64, 9.0, 15.0, 26.0][if standing { k.max(2) } else { k }].to_radians();
                // Light from the side, over the shoulder that lies further south.
                let sides = [bearing - 1.22, bearing + 1.22];
                let sun_bearing = if sides[0].cos() <= sides[1].cos() { sides[0] } else { sides[1] };
                cameras.push(Camera { eye, bearing, tilt, sun_bearing: sun_bearing.rem_euclid(TAU) });
            }
        }
    }
    cameras
}

/// The height of ground or water at a place (m); `None` where void, or outside where there is no sea.
fn ground_below(land: &Land, water: Option<&Water>, at: DVec2) -> Option<f64> {
    let level = water.filter(|w| w.covers(at)).map(|w| w.level);
    match (land.height_at(at).map(f64::from), level) {
        (Some(h), Some(l)) => Some(h.max(l)),
        (Some(h), None) => Some(h),
        (None, Some(l)) => Some(l),
        (None, None) => None,
    }
}

/// How good a picture a camera takes: higher is better.
fn judge(ground: &Ground, water: Option<&Water>, camera: &Camera, size: UVec2) -> f64 {
    let land = &*ground.land;
    let view = camera.view(size);
    let (corner, right, down) = view.frame();
    let rays: Vec<LocalRay> = (0..size.x * size.y)
        .map(|i| {
            let (x, y) = ((i % size.x) as f32 + 0.5, (i / size.x) as f32 + 0.5);
            LocalRay::new(Vec3::ZERO, (corner + right * x + down * y).normalize())
        })
        .collect();
    let mut distances = vec![f32::INFINITY; rays.len()];
    land.caster(view.eye).first_hits(&rays, &mut distances);
    let (s, c) = camera.sun_bearing.sin_cos();
    let sun = DVec3::new(s * 0.93, c * 0.93, 0.36).as_vec3();
    let extent = land.extent().max_element();
    let (mut sky, mut missing, mut wet) = (0.0, 0.0, 0.0);
    let (mut lit, mut lit2, mut deep, mut deep2, mut count) = (0.0f64, 0.0, 0.0, 0.0, 0.0f64);
    let mut nearest = f64::INFINITY;
    let mut skyline = vec![size.y as f64; size.x as usize];
    for (i, (ray, &distance)) in rays.iter().zip(&distances).enumerate() {
        let (x, y) = (i % size.x as usize, i / size.x as usize);
        let direction = ray.direction.as_dvec3();
        let mut distance = f64::from(distance);
        let to_water = water.map_or(f64::INFINITY, |w| {
            let t = (w.level - view.eye.z) / direction.z;
            if t > 0.0 && t <= distance && w.covers((view.eye + direction * t).truncate()) { t } else { f64::INFINITY }
        });
        if to_water < f64::INFINITY {
            distance = to_water;
            wet += 1.0;
        } else if distance.is_finite() {
            let at = view.eye + direction * distance;
            let Some(normal) = land.normal_at(at.truncate()) else { continue };
            let known = f64::from(ground.known(at.truncate()));
            if known < 0.5 || normal.dot(ray.direction) > 0.0 {
                // What is near and missing hurts; a rim of mist on the horizon does not.
                missing += if distance < 0.15 * extent {
                    4.0
                } else if distance < 0.5 * extent {
                    1.0
                } else {
                    0.35
                };
                continue;
            }
            let shade = f64::from(normal.dot(sun).max(0.0));
            let depth = distance.ln();
            lit += shade;
            lit2 += shade * shade;
            deep += depth;
            deep2 += depth * depth;
            count += 1.0;
        } else if direction.z < -0.004 {
            missing += 1.0;
            continue;
        } else {
            sky += 1.0;
            continue;
        }
        nearest = nearest.min(distance);
        skyline[x] = skyline[x].min(y as f64);
    }
    let all = rays.len() as f64;
    let (sky, missing, wet, land_share) = (sky / all, missing / all, wet / all, count / all);
    let spread = |sum: f64, squares: f64| (squares / count.max(1.0) - (sum / count.max(1.0)).powi(2)).max(0.0).sqrt();
    let (contrast, layers) = (spread(lit, lit2), spread(deep, deep2));
    let mean = skyline.iter().sum::<f64>() / skyline.len() as f64;
    let shape =
        (skyline.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / skyline.len() as f64).sqrt() / f64::from(size.y);
    let within = |value: f64, best: f64, width: f64| (-((value - best) / width).powi(2)).exp();
    1.5 * (contrast / 0.22).min(1.2)
        + 1.5 * (layers / 0.7).min(1.2)
        + 0.7 * (shape / 0.10).min(1.0)
        + 1.0 * within(sky, 0.27, 0.16)
        + if water.is_some() { 0.8 * within(wet, 0.28, 0.20) } else { 0.0 }
        + 0.8 * land_share.min(0.5)
        - 5.0 * missing
        - 3.0 * (0.12 - land_share).max(0.0) / 0.12
        - 1.5 * (1.0 - nearest / (0.13 * extent)).max(0.0)
}
