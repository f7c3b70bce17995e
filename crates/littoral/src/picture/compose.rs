//! A good view of any land, chosen by itself.
//!
//! Many cameras are tried, as a photographer walks about: eyes over a lattice of places and several heights, looking in
//! several directions. Each takes a thumbnail by casting a few hundred rays and is judged by rules of the trade: some sky
//! but not much, light from the side that brings out the relief, near, middle and far ground, a skyline with a shape, some
//! water in front if there is any, nothing missing in the frame and nothing in front of the lens.
//!
//! Land that gives no such picture, being flat, small or cut off by the data's edge, is shown as a model: a block on a floor, seen whole
//! from outside through a long lens, in a light as low as its relief is gentle. Land too wide for either is a map.

use super::cartography::Tints;
use super::ground::Ground;
use super::{Air, Border, Style, Sun, Water};
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
    /// What is shown where the land ends.
    pub border: Border,
}

/// Land wider than this (m) is a map rather than a landscape: its bulge would hide its far side.
const WIDEST_LANDSCAPE: f64 = 200_000.0;
/// Vertical angle of view (rad), that of a moderate wide-angle lens.
const FIELD: f64 = 0.62;

/// Share of the outline that lies in the sea above which land is an island, whose sea goes on to the horizon.
const ISLAND: f64 = 0.9;
/// How good a landscape has to be, lest a model be better.
const GOOD: f64 = 3.58;
/// Relief as a share of the land's width above which heights and distances can hardly be in the same unit, or nobody knows the
/// distances: grey values as heights in a picture without a place. True walls and gorges stay below.
const ABSURD: f64 = 1.2;

/// What suits the border of `land` for an eye at `eye`: mist from within or where the sea goes on, a cut from outside.
pub fn suiting_border(land: &Land, water: Option<&Water>, eye: DVec3) -> Border {
    let (low, high) = (land.origin(), land.origin() + land.extent());
    let within = eye.truncate().cmpge(low).all() && eye.truncate().cmple(high).all();
    let island = water.is_some_and(|w| w.share_of_border() >= ISLAND);
    if within || island { Border::Mist } else { Border::Cut }
}

/// A good view of `land` and `water`, with the light that suits it.
pub fn compose(land: &Land, water: Option<&Water>, size: UVec2) -> Shot {
    let extent = land.extent().max_element();
    let range = land.height_range();
    if range.is_empty() || extent > WIDEST_LANDSCAPE {
        return overhead(land, water, size);
    }
    let ground = Ground::new(land, water, Border::Mist);
    let level = water.map_or(f32::NEG_INFINITY, |w| w.level as f32);
    let slope = Tints::of(&ground, range, level).slope;
    if f64::from(range.high - range.low) > ABSURD * land.extent().min_element() {
        return Shot { style: Style::Relief, ..overhead(land, water, size) };
    }
    // A small raster shows its samples near the eye.
    let (columns, rows) = (land.raster().columns(), land.raster().rows());
    let coarse = 0.3 * (1.0 - columns.min(rows) as f64 / 256.0).max(0.0);
    let landscape = landscape(land, water, &ground, size).filter(|(_, score)| *score - coarse >= GOOD);
    match landscape {
        Some((shot, _)) => shot,
        None => model(land, water, slope, size),
    }
}

/// The best landscape, and how good it is.
fn landscape(land: &Land, water: Option<&Water>, ground: &Ground, size: UVec2) -> Option<(Shot, f64)> {
    let extent = land.extent().max_element();
    let candidates = candidates(land, water, ground.has_standing());
    let small = UVec2::new(20, (20 * size.y.max(1)).div_ceil(size.x.max(1)).clamp(8, 40));
    let mut judged: Vec<(f64, usize)> =
        candidates.par_iter().enumerate().map(|(i, c)| (judge(ground, water, c, small), i)).collect();
    // Best first; ties by number, so that the answer is the same everywhere.
    judged.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let finalists: Vec<usize> = judged.iter().take(24).map(|j| j.1).collect();
    let larger = small * 3;
    let best = finalists
        .par_iter()
        .map(|&i| (judge(ground, water, &candidates[i], larger), i))
        .reduce(|| (f64::NEG_INFINITY, usize::MAX), |a, b| if (b.0, a.1) > (a.0, b.1) { b } else { a });
    let camera = candidates.get(best.1)?;
    let shot = Shot {
        view: camera.view(size),
        sun: Sun::new(camera.sun_bearing, 21f64.to_radians()),
        air: Air { visibility: (7.0 * extent).clamp(35_000.0, 160_000.0), ..Air::default() },
        style: Style::Natural,
        border: Border::Mist,
    };
    Some((shot, best.0))
}

/// The land as a block, all of it in the frame.
fn model(land: &Land, water: Option<&Water>, slope: f32, size: UVec2) -> Shot {
    const BEARINGS: usize = 24;
    let ground = Ground::new(land, water, Border::Cut);
    let floor = ground.block.map_or(0.0, |block| block.floor);
    // The flatter the land, the steeper the look and the lower the light.
    let gentle = f64::from((0.30 - slope) / 0.25).clamp(0.0, 1.0);
    let tilts = [0.50 + 0.10 * gentle, 0.64 + 0.12 * gentle];
    let elevation = (2.5 * f64::from(slope)).atan().clamp(0.24, 0.60);
    let outline = outline(&ground, floor);
    let small = UVec2::new(48, (48 * size.y.max(1)).div_ceil(size.x.max(1)).clamp(16, 96));
    let score = |i: usize| {
        let (bearing, tilt) = (TAU * (i % BEARINGS) as f64 / BEARINGS as f64, -tilts[i / BEARINGS]);
        let camera = framed(&outline, bearing, tilt, small);
        let view = camera.view_through(LONG, small);
        let (corner, right, down) = view.frame();
        let rays: Vec<LocalRay> = pixels(small)
            .map(|(x, y)| LocalRay::new(Vec3::ZERO, (corner + right * x + down * y).normalize()))
            .collect();
        let mut distances = vec![f32::INFINITY; rays.len()];
        ground.land.caster(view.eye).first_hits(&rays, &mut distances);
        let sun = Sun::new(camera.sun_bearing, elevation).direction(0.0).as_vec3();
        let (mut lit, mut lit2, mut count) = (0.0, 0.0, 0.0f64);
        for (ray, distance) in rays.iter().zip(&distances).filter(|(_, d)| d.is_finite()) {
            let at = (view.eye + ray.direction.as_dvec3() * f64::from(*distance)).truncate();
            let shade = f64::from(ground.land.normal_at(at).map_or(0.0, |n| n.dot(sun).max(0.0)));
            lit += shade;
            lit2 += shade * shade;
            count += 1.0;
        }
        let contrast = (lit2 / count.max(1.0) - (lit / count.max(1.0)).powi(2)).max(0.0).sqrt();
        // North towards the top, as on a map, unless another side is better.
        1.5 * count / rays.len() as f64 + 1.2 * (contrast / 0.15).min(1.3) + 0.12 * bearing.cos()
    };
    let scores: Vec<f64> = (0..BEARINGS * tilts.len()).into_par_iter().map(score).collect();
    let best = (0..scores.len()).fold(0, |best, i| if scores[i] > scores[best] { i } else { best });
    let camera = framed(&outline, TAU * (best % BEARINGS) as f64 / BEARINGS as f64, -tilts[best / BEARINGS], size);
    Shot {
        view: camera.view_through(LONG, size),
        sun: Sun::new(camera.sun_bearing, elevation),
        air: Air { visibility: 120_000.0, veils_distance: false },
        style: Style::Natural,
        border: Border::Cut,
    }
}

/// Vertical angle of view (rad) of the lens for models.
const LONG: f64 = 0.36;

/// Middles of pixels.
fn pixels(size: UVec2) -> impl Iterator<Item = (f32, f32)> {
    (0..size.x * size.y).map(move |i| ((i % size.x) as f32 + 0.5, (i / size.x) as f32 + 0.5))
}

/// Points that hold a block: those of its ground and of the floor below it.
fn outline(ground: &Ground, floor: f64) -> Vec<DVec3> {
    const SIDE: usize = 24;
    let (origin, extent) = (ground.land.origin(), ground.land.extent());
    let mut points = Vec::new();
    for i in 0..=SIDE {
        for j in 0..=SIDE {
            let at = origin + extent * DVec2::new(i as f64, j as f64) / SIDE as f64;
            if let Some(height) = ground.land.height_at(at).filter(|_| !ground.is_cut_away(at)) {
                points.extend([at.extend(f64::from(height)), at.extend(floor)]);
            }
        }
    }
    points
}

/// The camera that looks in a direction and has all `points` in its frame, in the middle and with some air around.
fn framed(points: &[DVec3], bearing: f64, tilt: f64, size: UVec2) -> Camera {
    const FILL: f64 = 0.86;
    let centre = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let reach = points.iter().map(|p| p.distance(centre)).fold(1e-3, f64::max);
    let (s, c) = bearing.sin_cos();
    let (up, flat) = tilt.sin_cos();
    let forward = DVec3::new(s * flat, c * flat, up);
    let right = DVec3::new(c, -s, 0.0);
    let top = right.cross(forward);
    let half_height = (0.5 * LONG).tan();
    let half_width = half_height * f64::from(size.x.max(1)) / f64::from(size.y.max(1));
    let mut eye = centre - forward * (2.0 * reach / half_height);
    // Each round puts the middle of what is seen into the middle of the frame and steps nearer until it fills it.
    for _ in 0..12 {
        let (mut low, mut high, mut near) = (DVec2::INFINITY, DVec2::NEG_INFINITY, f64::INFINITY);
        for p in points {
            let away = *p - eye;
            let depth = away.dot(forward).max(1e-9);
            let place = DVec2::new(away.dot(right) / half_width, away.dot(top) / half_height) / depth;
            (low, high, near) = (low.min(place), high.max(place), near.min(depth));
        }
        let depth = (centre - eye).dot(forward);
        let (middle, spread) = (0.5 * (low + high), 0.5 * (high - low).max_element());
        eye += right * (middle.x * half_width * depth) + top * (middle.y * half_height * depth);
        eye += forward * ((1.0 - spread / FILL) * depth).min(0.9 * near);
    }
    let sun_bearing = (bearing - 1.55).rem_euclid(TAU);
    Camera { eye, bearing, tilt, sun_bearing }
}

/// The whole land from straight above, north at the top, as on a map: tinted by height if it is wide, else in the style
/// of a shaded relief's light.
pub fn overhead(land: &Land, water: Option<&Water>, size: UVec2) -> Shot {
    let extent = land.extent();
    let aspect = f64::from(size.x.max(1)) / f64::from(size.y.max(1));
    let half = 0.5 * extent.y.max(extent.x / aspect) * 1.06;
    let centre = land.origin() + 0.5 * extent;
    let range = land.height_range();
    let (top, relief) =
        if range.is_empty() { (0.0, 0.0) } else { (f64::from(range.high), f64::from(range.high - range.low)) };
    // A long lens from far away: nearly parallel rays, however deep the land.
    let field = 0.12f64.min(2.0 * half / (60.0 * relief).max(1e-9));
    let eye = centre.extend(top + half / (0.5 * field).tan());
    let wide = extent.max_element() > WIDEST_LANDSCAPE;
    let style = if wide { Style::Tint } else { Style::Natural };
    let border = match style {
        Style::Natural if water.is_some_and(|w| w.share_of_border() >= ISLAND) => Border::Mist,
        _ => Border::Cut,
    };
    Shot {
        view: View::looking_at(eye, centre.extend(top), field as f32, size),
        // Soft light, so that a map's shadows have no edges.
        sun: Sun { angular_radius: 0.10, ..Sun::new(315f64.to_radians(), 38f64.to_radians()) },
        air: Air { visibility: 200_000.0, veils_distance: false },
        style,
        border,
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
        border: Border::Mist,
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
        self.view_through(FIELD, size)
    }

    /// Through a lens of a vertical angle of view (rad).
    fn view_through(&self, field: f64, size: UVec2) -> View {
        let (s, c) = self.bearing.sin_cos();
        let (up, flat) = self.tilt.sin_cos();
        View::looking_at(self.eye, self.eye + DVec3::new(s * flat, c * flat, up) * 1e3, field as f32, size)
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
    let rays: Vec<LocalRay> =
        pixels(size).map(|(x, y)| LocalRay::new(Vec3::ZERO, (corner + right * x + down * y).normalize())).collect();
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
    // The summit wants some sky above it, and neither the middle of the frame nor its edge.
    let summit = (0..skyline.len()).min_by(|a, b| skyline[*a].total_cmp(&skyline[*b])).unwrap_or(0);
    let headroom = skyline[summit] / f64::from(size.y);
    let aside = ((summit as f64 + 0.5) / skyline.len() as f64 - 0.5).abs();
    let within = |value: f64, best: f64, width: f64| (-((value - best) / width).powi(2)).exp();
    1.5 * (contrast / 0.22).min(1.2)
        + 1.5 * (layers / 0.7).min(1.2)
        + 0.7 * (shape / 0.10).min(1.0)
        + 1.0 * within(sky, 0.27, 0.16)
        + if water.is_some() { 0.8 * within(wet, 0.28, 0.20) } else { 0.0 }
        + 0.8 * land_share.min(0.5)
        - 5.0 * missing
        - 0.8 * (0.14 - headroom).max(0.0) / 0.14
        - 0.6 * (aside - 0.30).max(0.0) / 0.20
        - 3.0 * (0.12 - land_share).max(0.0) / 0.12
        - 1.5 * (1.0 - nearest / (0.13 * extent)).max(0.0)
}
