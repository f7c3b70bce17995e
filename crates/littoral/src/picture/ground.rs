//! The ground as pictures need it: smooth slopes at any fineness, and mist where nothing is known.
//!
//! The exact bilinear surface has creases along every sample; light would show them. Slopes for shading are central
//! differences, blended between samples, on the level of a pyramid of means that fits the footprint of the pixel, so that
//! distant ground neither shimmers nor turns plastic.
//!
//! Missing ground — voids, and what lies beyond an edge of the raster that does not end in water — is replaced by a smooth
//! membrane spanned between its rims and, outside, a level below the lowest ground. It is never shown as ground: `known`
//! falls to zero over a few samples before it, and the renderer draws mist there. It exists so that no wall or pit
//! opens where data ends. A cut [border](Border) needs none outside. The membrane is found by pull and push over a pyramid (S. Gortler et al., "The lumigraph",
//! SIGGRAPH 1996), then relaxed.

use super::block::Block;
use super::{Border, Water};
use crate::field::{Land, Raster};
use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::borrow::Cow;

/// Ground made ready for pictures.
pub struct Ground<'a> {
    /// The surface that rays meet.
    pub land: Cow<'a, Land>,
    /// How far each sample is known, 255 for wholly; empty when all is.
    known: Vec<u8>,
    /// The block that the land is cut to, if it is.
    pub block: Option<Block>,
    /// For a block: which samples were cut away, being void from the raster's edge on; empty for none.
    cut_away: Vec<bool>,
    /// Heights for shading where those of `land` drop to the floor; empty if they never do.
    uncut: Vec<f32>,
    /// Height of the mist that lies beyond the land (m).
    pub mist: f64,
    /// Coarser and coarser means; sample i of a level lies on sample 2i of the finer one. The finest is `land` itself.
    means: Vec<Means>,
    /// Height (m) of trees and houses at each sample; empty where the samples are of bare ground or too wide apart to tell.
    standing: Vec<f32>,
}

struct Means {
    columns: usize,
    rows: usize,
    heights: Vec<f32>,
}

/// The smooth surface about a point, at the fineness asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surface {
    /// Height (m).
    pub height: f32,
    /// Rise eastward and northward.
    pub slope: Vec2,
    /// Mean of the second derivatives (1/m): positive in hollows.
    pub hollow: f32,
}

impl<'a> Ground<'a> {
    /// Makes `land` ready.
    pub fn new(land: &'a Land, water: Option<&Water>, border: Border) -> Ground<'a> {
        let range = land.height_range();
        let (low, high) = if range.is_empty() { (0.0, 0.0) } else { (f64::from(range.low), f64::from(range.high)) };
        let level = water.map_or(f64::NEG_INFINITY, |w| w.level);
        let mist = match water {
            Some(water) if water.reaches_horizon() => water.level - 0.02 * (high - low) - 0.5,
            _ => low - 0.05 * (high - low) - 0.002 * land.extent().min_element(),
        };
        let sunk = water.and_then(|w| with_sunk_bed(land, w));
        let land = sunk.map_or(Cow::Borrowed(land), Cow::Owned);
        let cut = border == Border::Cut;
        let block = cut.then(|| Block::of(&land));
        let (mut cut_away, mut uncut) = (Vec::new(), Vec::new());
        let (land, known) = if land.raster().voids().any() || !cut && has_dry_border(&land, level) {
            let (inner_columns, inner_rows) = (land.raster().columns(), land.raster().rows());
            let margin = if cut { 0 } else { (inner_columns.min(inner_rows) / 14).clamp(3, 160) };
            if cut {
                cut_away = land.voids_from_the_edge();
            }
            let (land, known) = with_mist(&land, level, mist, margin, &cut_away);
            let land = match block.filter(|_| !cut_away.is_empty()) {
                Some(block) => {
                    uncut = land.raster().heights().to_vec();
                    lowered(&land, &cut_away, block.floor as f32)
                }
                None => land,
            };
            (Cow::Owned(land), known)
        } else {
            (land, Vec::new())
        };
        let raster = land.raster();
        let smooth = if uncut.is_empty() { raster.heights() } else { &uncut };
        let means = pyramid_of_means(smooth, raster.columns(), raster.rows());
        let standing = standing(smooth, raster.columns(), raster.rows(), raster.spacing());
        Ground { land, known, block, cut_away, uncut, mist, means, standing }
    }

    /// Whether the sample next to a world position (m) is cut away.
    pub fn is_cut_away(&self, at: DVec2) -> bool {
        !self.cut_away.is_empty() && {
            let raster = self.land.raster();
            let last = DVec2::new((raster.columns() - 1) as f64, (raster.rows() - 1) as f64);
            let p = ((at - self.land.origin()) / raster.spacing()).round().clamp(DVec2::ZERO, last);
            self.cut_away[p.y as usize * raster.columns() + p.x as usize]
        }
    }

    /// Out of the block where it is cut away beside a world position (m): a level unit vector. The stairs of the samples are
    /// smoothed, so that the side is lit as one.
    pub fn outward(&self, at: DVec2) -> Vec3 {
        const RADIUS: i32 = 4;
        let spacing = self.land.raster().spacing();
        let mut sum = DVec2::ZERO;
        for j in -RADIUS..=RADIUS {
            for i in -RADIUS..=RADIUS {
                let offset = DVec2::new(f64::from(i), f64::from(j)) * spacing;
                if self.is_cut_away(at + offset) {
                    sum += offset;
                }
            }
        }
        sum.normalize_or(DVec2::NEG_Y).extend(0.0).as_vec3()
    }

    /// Whether the surface at a world position (m) is a side of the block: part of it is cut away.
    pub fn is_side(&self, at: DVec2) -> bool {
        let raster = self.land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        !self.cut_away.is_empty()
            && lattice(at - self.land.origin(), raster.spacing(), columns, rows).is_some_and(|((i, j), _)| {
                let base = j * columns + i;
                [base, base + 1, base + columns, base + columns + 1].iter().any(|&k| self.cut_away[k])
            })
    }

    /// Distance between samples (m), the geometric mean of both directions.
    pub fn spacing(&self) -> f32 {
        let s = self.land.raster().spacing();
        (s.x * s.y).sqrt() as f32
    }

    /// How far the ground at a world position (m) is known, in [0, 1].
    pub fn known(&self, at: DVec2) -> f32 {
        if self.known.is_empty() {
            return 1.0;
        }
        let raster = self.land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        let Some(((i, j), f)) = lattice(at - self.land.origin(), raster.spacing(), columns, rows) else { return 0.0 };
        let k = |i: usize, j: usize| f32::from(self.known[j.min(rows - 1) * columns + i.min(columns - 1)]);
        let south = k(i, j) + (k(i + 1, j) - k(i, j)) * f.x;
        let north = k(i, j + 1) + (k(i + 1, j + 1) - k(i, j + 1)) * f.x;
        (south + (north - south) * f.y) * (1.0 / 255.0)
    }

    /// The smooth surface about a world position (m), averaged over `footprint` (m). Beyond the border: that of the border.
    pub fn surface(&self, at: DVec2, footprint: f32) -> Surface {
        let level = (footprint / self.spacing()).max(1.0).log2().min(self.means.len() as f32);
        let (fine, blend) = (level as usize, level.fract());
        let a = self.surface_of(at, fine);
        if blend < 1e-3 || fine >= self.means.len() {
            return a;
        }
        let b = self.surface_of(at, fine + 1);
        Surface {
            height: a.height + (b.height - a.height) * blend,
            slope: a.slope.lerp(b.slope, blend),
            hollow: a.hollow + (b.hollow - a.hollow) * blend,
        }
    }

    /// Height of the trees and houses that the surface at a world position (m) includes (m).
    pub fn standing(&self, at: DVec2) -> f32 {
        let raster = self.land.raster();
        let (columns, rows) = (raster.columns(), raster.rows());
        if self.standing.is_empty() {
            return 0.0;
        }
        let Some(((i, j), f)) = lattice(at - self.land.origin(), raster.spacing(), columns, rows) else { return 0.0 };
        // The higher ends of a patch that rises from the ground to a roof are wall, not ground.
        let s = |i: usize, j: usize| self.standing[j.min(rows - 1) * columns + i.min(columns - 1)];
        let (a, b, c, d) = (s(i, j), s(i + 1, j), s(i, j + 1), s(i + 1, j + 1));
        let blend = (a + (b - a) * f.x) + ((c + (d - c) * f.x) - (a + (b - a) * f.x)) * f.y;
        blend.max(0.6 * a.max(b).max(c).max(d) * f32::from(u8::from(blend > 0.3)))
    }

    /// Whether the surface includes trees and houses.
    pub fn has_standing(&self) -> bool {
        !self.standing.is_empty()
    }

    /// The level of the pyramid whose samples are about `footprint` (m) apart.
    pub fn level_of(&self, footprint: f32) -> usize {
        ((footprint / self.spacing()).max(1.0).log2().round() as usize).min(self.means.len())
    }

    /// The mean height about a place on a [level](Ground::level_of) of the pyramid: one bilinear read. The place counts samples of
    /// the finest level from the origin.
    #[inline]
    pub fn mean(&self, place: Vec2, level: usize) -> f32 {
        let (heights, columns, rows) = self.heights(level);
        let p = place * (1.0 / (1u64 << level) as f32);
        let p = p.clamp(Vec2::ZERO, Vec2::new((columns - 1) as f32, (rows - 1) as f32));
        let (i, j) = ((p.x as usize).min(columns - 2), (p.y as usize).min(rows - 2));
        let (u, v) = (p.x - i as f32, p.y - j as f32);
        let base = j * columns + i;
        let (south, north) = (&heights[base..base + 2], &heights[base + columns..base + columns + 2]);
        let (a, b) = (south[0] + (south[1] - south[0]) * u, north[0] + (north[1] - north[0]) * u);
        a + (b - a) * v
    }

    /// The coarsest level of the pyramid.
    pub fn levels(&self) -> usize {
        self.means.len()
    }

    /// Which samples were cut away from a block; empty for none.
    pub fn cut_away_samples(&self) -> &[bool] {
        &self.cut_away
    }

    /// How far each sample is known, 255 for wholly; empty when all is.
    pub fn known_samples(&self) -> &[u8] {
        &self.known
    }

    /// Height (m) of trees and houses at each sample; empty where there are none.
    pub fn standing_samples(&self) -> &[f32] {
        &self.standing
    }

    /// Heights, columns and rows of a level of the pyramid.
    pub fn heights(&self, level: usize) -> (&[f32], usize, usize) {
        match level.checked_sub(1) {
            None => {
                let raster = self.land.raster();
                let heights = if self.uncut.is_empty() { raster.heights() } else { &self.uncut };
                (heights, raster.columns(), raster.rows())
            }
            Some(k) => (&self.means[k].heights, self.means[k].columns, self.means[k].rows),
        }
    }

    fn surface_of(&self, at: DVec2, level: usize) -> Surface {
        let (heights, columns, rows) = self.heights(level);
        let spacing = self.land.raster().spacing() * (1u64 << level) as f64;
        let last = DVec2::new((columns - 1) as f64, (rows - 1) as f64);
        let p = ((at - self.land.origin()) / spacing).clamp(DVec2::ZERO, last);
        let (i, j) = ((p.x as usize).min(columns - 2), (p.y as usize).min(rows - 2));
        let (u, v) = ((p.x - i as f64) as f32, (p.y - j as f64) as f32);
        let line = |dj: usize| (j + dj).saturating_sub(1).min(rows - 1) * columns;
        let (west, east) = (i.saturating_sub(1), (i + 2).min(columns - 1));
        let row = |dj: usize| {
            let base = line(dj);
            [heights[base + west], heights[base + i], heights[base + i + 1], heights[base + east]]
        };
        let (h0, h1, h2, h3) = (row(0), row(1), row(2), row(3));
        // Bilinear between the four samples about the point, of what central differences say at each.
        let across = |h: [f32; 4]| h[1] + (h[2] - h[1]) * u;
        let rise = |h: [f32; 4]| (h[2] - h[0]) + ((h[3] - h[1]) - (h[2] - h[0])) * u;
        let bend = |h: [f32; 4]| {
            let (a, b) = (h[0] + h[2] - 2.0 * h[1], h[1] + h[3] - 2.0 * h[2]);
            a + (b - a) * u
        };
        let (m0, m1, m2, m3) = (across(h0), across(h1), across(h2), across(h3));
        let (sx, sy) = (1.0 / spacing.x as f32, 1.0 / spacing.y as f32);
        let mix = |a: f32, b: f32| a + (b - a) * v;
        let along = mix(m0 + m2 - 2.0 * m1, m1 + m3 - 2.0 * m2);
        Surface {
            height: mix(m1, m2),
            slope: 0.5 * Vec2::new(mix(rise(h1), rise(h2)) * sx, mix(m2 - m0, m3 - m1) * sy),
            hollow: 0.5 * (mix(bend(h1), bend(h2)) * sx * sx + along * sy * sy),
        }
    }
}

/// The patch that holds an offset from the origin, and where in it; `None` outside.
fn lattice(offset: DVec2, spacing: DVec2, columns: usize, rows: usize) -> Option<((usize, usize), Vec2)> {
    let p = offset / spacing;
    let last = DVec2::new((columns - 1) as f64, (rows - 1) as f64);
    if !(p.cmpge(DVec2::ZERO).all() && p.cmple(last).all()) {
        return None;
    }
    let base = p.floor().min(last - 1.0);
    Some(((base.x as usize, base.y as usize), (p - base).as_vec2()))
}

fn pyramid_of_means(finest: &[f32], columns: usize, rows: usize) -> Vec<Means> {
    let mut means: Vec<Means> = Vec::new();
    loop {
        let (heights, columns, rows) = match means.last() {
            None => (finest, columns, rows),
            Some(m) => (&m.heights[..], m.columns, m.rows),
        };
        if columns.min(rows) < 4 {
            return means;
        }
        let (halved_columns, halved_rows) = (columns.div_ceil(2), rows.div_ceil(2));
        let mut halved = vec![0.0f32; halved_columns * halved_rows];
        halved.par_chunks_exact_mut(halved_columns).enumerate().for_each(|(j, line)| {
            let row = |dj: usize| &heights[(2 * j + dj).saturating_sub(1).min(rows - 1) * columns..][..columns];
            let (south, middle, north) = (row(0), row(1), row(2));
            for (i, out) in line.iter_mut().enumerate() {
                let column = |di: usize| {
                    let c = (2 * i + di).saturating_sub(1).min(columns - 1);
                    0.25 * (south[c] + north[c]) + 0.5 * middle[c]
                };
                *out = 0.25 * (column(0) + column(2)) + 0.5 * column(1);
            }
        });
        means.push(Means { columns: halved_columns, rows: halved_rows, heights: halved });
    }
}

/// How high trees and houses stand over the ground below them, if the samples are close enough to show them and do: what a disc of
/// some 40 m cannot reach from below, where much of the surface is too steep for earth.
fn standing(heights: &[f32], columns: usize, rows: usize, spacing: DVec2) -> Vec<f32> {
    const CLOSE: f64 = 2.5;
    const RADIUS: f64 = 20.0;
    /// Share of samples with a wall beside them above which a surface is one of trees and houses.
    const STEEP: f64 = 0.04;
    if spacing.max_element() > CLOSE {
        return Vec::new();
    }
    let spacing = spacing.min_element();
    let wall = (1.5 * spacing) as f32;
    let steep = heights.windows(2).filter(|w| (w[0] - w[1]).abs() > wall).count();
    if (steep as f64) < STEEP * heights.len() as f64 {
        return Vec::new();
    }
    let radius = (RADIUS / spacing) as usize;
    let lowest = extremes(heights, columns, rows, radius, f32::min);
    let opened = extremes(&lowest, columns, rows, radius, f32::max);
    heights.iter().zip(&opened).map(|(h, o)| h - o).collect()
}

/// The least (or greatest) value within a square about each sample, by columns and rows (M. van Herk, "A fast algorithm for
/// local minimum and maximum filters", 1992).
fn extremes(values: &[f32], columns: usize, rows: usize, radius: usize, pick: fn(f32, f32) -> f32) -> Vec<f32> {
    let line = |get: &dyn Fn(usize) -> f32, length: usize, out: &mut dyn FnMut(usize, f32)| {
        let window = 2 * radius + 1;
        let at = |i: isize| get(i.clamp(0, length as isize - 1) as usize);
        let padded = length + 2 * radius;
        let value = |i: usize| at(i as isize - radius as isize);
        let (mut forward, mut backward) = (vec![0.0; padded], vec![0.0; padded]);
        for i in 0..padded {
            forward[i] = if i % window == 0 { value(i) } else { pick(forward[i - 1], value(i)) };
        }
        for i in (0..padded).rev() {
            let ends = i + 1 == padded || (i + 1) % window == 0;
            backward[i] = if ends { value(i) } else { pick(backward[i + 1], value(i)) };
        }
        for i in 0..length {
            out(i, pick(backward[i], forward[i + window - 1]));
        }
    };
    let mut across = vec![0.0f32; values.len()];
    across.par_chunks_exact_mut(columns).enumerate().for_each(|(j, row)| {
        line(&|i| values[j * columns + i], columns, &mut |i, v| row[i] = v);
    });
    let mut turned = vec![0.0f32; values.len()];
    turned.par_chunks_exact_mut(rows).enumerate().for_each(|(i, column)| {
        line(&|j| across[j * columns + i], rows, &mut |j, v| column[j] = v);
    });
    let mut result = across;
    result.par_chunks_exact_mut(columns).enumerate().for_each(|(j, row)| {
        for (i, v) in row.iter_mut().enumerate() {
            *v = turned[i * rows + j];
        }
    });
    result
}

/// Whether the land has an edge that does not lie under water.
fn has_dry_border(land: &Land, level: f64) -> bool {
    let raster = land.raster();
    let (columns, rows) = (raster.columns(), raster.rows());
    let dry = |c: usize, r: usize| raster.sample(c, r).is_none_or(|h| f64::from(h) > level);
    (0..columns).any(|c| dry(c, 0) || dry(c, rows - 1)) || (0..rows).any(|r| dry(0, r) || dry(columns - 1, r))
}

/// The land with a bed under water that nobody sounded: where samples are missing, or all lie at the very level of the water
/// as flattened lakes and seas do. There it sinks gently from the shore, as it does beyond the raster: the water is shown deep, and
/// no bed through it. `None` where all of the bed was measured.
fn with_sunk_bed(land: &Land, water: &Water) -> Option<Land> {
    /// Fall of the bed, and its greatest depth (m).
    const FALL: f32 = 0.05;
    const DEEPEST: f32 = 80.0;
    let raster = land.raster();
    let (columns, rows) = (raster.columns(), raster.rows());
    let level = water.level as f32;
    let dry: Vec<bool> = (0..columns * rows).map(|i| !water.is_unsounded(land, i)).collect();
    let unsounded = dry.iter().filter(|dry| !**dry).count();
    // A few samples that happen to lie at the level are a shore.
    if unsounded < (columns * rows) / 500 + 8 {
        return None;
    }
    let fall = FALL * raster.spacing().min_element() as f32;
    let mut heights: Vec<f32> =
        (0..columns * rows).map(|i| raster.sample(i % columns, i / columns).unwrap_or(f32::NAN)).collect();
    for (height, away) in heights.iter_mut().zip(distances(&dry, columns, rows)) {
        if away > 0.0 {
            *height = level - (fall * away).min(DEEPEST);
        }
    }
    let sunk = Raster::new(columns, rows, raster.spacing(), heights).ok()?;
    Some(Land::at(sunk, land.origin()))
}

/// The land with some samples lowered to one height (m).
fn lowered(land: &Land, which: &[bool], height: f32) -> Land {
    let raster = land.raster();
    let heights = raster.heights().iter().zip(which).map(|(h, low)| if *low { height } else { *h }).collect();
    match Raster::new(raster.columns(), raster.rows(), raster.spacing(), heights) {
        Ok(raster) => Land::at(raster, land.origin()),
        Err(error) => unreachable!("a raster with other heights is still a raster: {error}"),
    }
}

/// The land widened by a margin (samples; 0 for none), with a membrane where nothing is known, and how far each sample is known.
/// What is `cut_away` does not count as unknown.
fn with_mist(land: &Land, level: f64, mist: f64, margin: usize, cut_away: &[bool]) -> (Land, Vec<u8>) {
    let raster = land.raster();
    let (inner_columns, inner_rows) = (raster.columns(), raster.rows());
    let (columns, rows) = (inner_columns + 2 * margin, inner_rows + 2 * margin);
    let mut heights = vec![f32::NAN; columns * rows];
    for r in 0..inner_rows {
        for c in 0..inner_columns {
            if let Some(h) = raster.sample(c, r) {
                heights[(r + margin) * columns + c + margin] = h;
            }
        }
    }
    // The outermost ring holds the membrane down: to the sea bed where the raster ends in water, else to the mist.
    let mut void: Vec<bool> = heights.iter().map(|h| h.is_nan()).collect();
    for r in 0..rows {
        for c in 0..columns {
            let ring = margin > 0 && (r == 0 || c == 0 || r == rows - 1 || c == columns - 1);
            if ring {
                let inside = (c.clamp(margin, columns - 1 - margin), r.clamp(margin, rows - 1 - margin));
                let edge = heights[inside.1 * columns + inside.0];
                let bed = f64::from(edge) <= level;
                heights[r * columns + c] = if bed { edge } else { mist as f32 };
            } else if void[r * columns + c] {
                // Beyond a wet edge the bed goes on level, and counts as known: it is seen through water, as the sea's.
                let inside = (c.clamp(margin, columns - 1 - margin), r.clamp(margin, rows - 1 - margin));
                let outside = inside != (c, r);
                let edge = heights[inside.1 * columns + inside.0];
                if outside && f64::from(edge) <= level {
                    heights[r * columns + c] = edge;
                    void[r * columns + c] = false;
                }
            }
        }
    }
    if heights.iter().all(|h| h.is_nan()) {
        heights.fill(mist as f32);
    }
    span_membrane(&mut heights, columns, rows);
    for (void, _) in void.iter_mut().zip(cut_away).filter(|(_, away)| **away) {
        *void = false;
    }
    let fringe = (inner_columns.min(inner_rows) as f32 / 48.0).clamp(0.7, 12.0);
    let known = distances(&void, columns, rows)
        .into_iter()
        .map(|d| {
            let t = ((d - 1.0) / fringe).clamp(0.0, 1.0);
            (t * t * (3.0 - 2.0 * t) * 255.0 + 0.5) as u8
        })
        .collect();
    let origin = land.origin() - raster.spacing() * margin as f64;
    match Raster::new(columns, rows, raster.spacing(), heights) {
        Ok(raster) => (Land::at(raster, origin), known),
        Err(error) => unreachable!("a raster widened by a margin is still a raster: {error}"),
    }
}

/// Replaces every NaN by a smooth membrane through the other heights.
fn span_membrane(heights: &mut [f32], columns: usize, rows: usize) {
    let missing: Vec<usize> = (0..heights.len()).filter(|&i| heights[i].is_nan()).collect();
    // Pull: means of what is known, coarser and coarser, until nothing is missing.
    let mut levels = vec![(heights.to_vec(), columns, rows)];
    while let Some((fine, c, r)) = levels.last()
        && fine.iter().any(|h| h.is_nan())
        && *c.max(r) > 1
    {
        let (hc, hr) = (c.div_ceil(2), r.div_ceil(2));
        let mut coarse = vec![f32::NAN; hc * hr];
        for (i, out) in coarse.iter_mut().enumerate() {
            let (x, y) = (2 * (i % hc), 2 * (i / hc));
            let (mut sum, mut count) = (0.0, 0);
            for yy in y..(y + 2).min(*r) {
                for xx in x..(x + 2).min(*c) {
                    let h = fine[yy * c + xx];
                    if !h.is_nan() {
                        sum += h;
                        count += 1;
                    }
                }
            }
            if count > 0 {
                *out = sum / count as f32;
            }
        }
        levels.push((coarse, hc, hr));
    }
    // Push: what is missing is read from the next coarser level, bilinearly, and relaxed there before it is used.
    for k in (0..levels.len() - 1).rev() {
        let (finer, coarser) = levels.split_at_mut(k + 1);
        let (fine, c, r) = &mut finer[k];
        let (coarse, hc, hr) = &coarser[0];
        let holes: Vec<usize> = (0..fine.len()).filter(|&i| fine[i].is_nan()).collect();
        for &i in &holes {
            let x = ((i % *c) as f32 * 0.5 - 0.25).clamp(0.0, (hc - 1) as f32);
            let y = ((i / *c) as f32 * 0.5 - 0.25).clamp(0.0, (hr - 1) as f32);
            let (x0, y0) = (x as usize, y as usize);
            let (x1, y1) = ((x0 + 1).min(hc - 1), (y0 + 1).min(hr - 1));
            let (u, v) = (x - x0 as f32, y - y0 as f32);
            let at = |x: usize, y: usize| coarse[y * hc + x];
            let south = at(x0, y0) + (at(x1, y0) - at(x0, y0)) * u;
            let north = at(x0, y1) + (at(x1, y1) - at(x0, y1)) * u;
            fine[i] = south + (north - south) * v;
        }
        for _ in 0..12 {
            for &i in &holes {
                let (x, y) = (i % *c, i / *c);
                let (mut sum, mut count) = (0.0, 0.0f32);
                for (xx, yy) in [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)] {
                    if xx < *c && yy < *r {
                        sum += fine[yy * *c + xx];
                        count += 1.0;
                    }
                }
                fine[i] = sum / count;
            }
        }
    }
    for i in missing {
        heights[i] = levels[0].0[i];
    }
}

/// Distance (in samples, by chamfers of 1 and √2) from each sample to the nearest void one.
fn distances(void: &[bool], columns: usize, rows: usize) -> Vec<f32> {
    const DIAGONAL: f32 = std::f32::consts::SQRT_2;
    let mut d: Vec<f32> = void.iter().map(|&v| if v { 0.0 } else { 1e9 }).collect();
    for j in 0..rows {
        for i in 0..columns {
            let mut best = d[j * columns + i];
            if i > 0 {
                best = best.min(d[j * columns + i - 1] + 1.0);
            }
            if j > 0 {
                best = best.min(d[(j - 1) * columns + i] + 1.0);
                if i > 0 {
                    best = best.min(d[(j - 1) * columns + i - 1] + DIAGONAL);
                }
                if i + 1 < columns {
                    best = best.min(d[(j - 1) * columns + i + 1] + DIAGONAL);
                }
            }
            d[j * columns + i] = best;
        }
    }
    for j in (0..rows).rev() {
        for i in (0..columns).rev() {
            let mut best = d[j * columns + i];
            if i + 1 < columns {
                best = best.min(d[j * columns + i + 1] + 1.0);
            }
            if j + 1 < rows {
                best = best.min(d[(j + 1) * columns + i] + 1.0);
                if i > 0 {
                    best = best.min(d[(j + 1) * columns + i - 1] + DIAGONAL);
                }
                if i + 1 < columns {
                    best = best.min(d[(j + 1) * columns + i + 1] + DIAGONAL);
                }
            }
            d[j * columns + i] = best;
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(columns: usize, rows: usize, f: impl Fn(f64, f64) -> f64) -> Land {
        let spacing = DVec2::new(2.0, 3.0);
        let h = |i: usize| f((i % columns) as f64 * spacing.x, (i / columns) as f64 * spacing.y) as f32;
        let raster = Raster::new(columns, rows, spacing, (0..columns * rows).map(h).collect()).expect("valid");
        Land::at(raster, DVec2::ZERO)
    }

    #[test]
    fn slopes_of_a_plane_are_exact_at_every_fineness() {
        let land = plane(65, 49, |x, y| 0.3 * x - 0.7 * y - 500.0);
        let sea = Water::flood(&land, 1e4).expect("all under water");
        let ground = Ground::new(&land, Some(&sea), Border::Mist);
        assert!(ground.known.is_empty());
        for footprint in [0.1, 3.0, 7.5, 11.0] {
            let s = ground.surface(DVec2::new(61.3, 70.1), footprint);
            assert!((s.slope - Vec2::new(0.3, -0.7)).length() < 1e-3, "{footprint}: {}", s.slope);
            assert!(s.hollow.abs() < 1e-3);
        }
    }

    #[test]
    fn extremes_are_those_of_the_square() {
        let (columns, rows) = (13, 9);
        let values: Vec<f32> = (0..columns * rows).map(|i| ((i * 7919) % 101) as f32).collect();
        let found = extremes(&values, columns, rows, 2, f32::min);
        for j in 0..rows {
            for i in 0..columns {
                let window = (j.saturating_sub(2)..(j + 3).min(rows))
                    .flat_map(|r| (i.saturating_sub(2)..(i + 3).min(columns)).map(move |c| (r, c)));
                let expected = window.map(|(r, c)| values[r * columns + c]).fold(f32::INFINITY, f32::min);
                assert_eq!(found[j * columns + i], expected);
            }
        }
    }

    #[test]
    fn houses_stand_on_the_ground_and_hills_do_not() {
        let town = |x: f64, y: f64| {
            let house = (x as i64 / 6) % 3 == 0 && (y as i64 / 6) % 3 == 0;
            0.05 * x + if house { 7.0 } else { 0.0 }
        };
        let columns = 120;
        let heights = (0..columns * columns).map(|i| town((i % columns) as f64, (i / columns) as f64) as f32).collect();
        let raster = Raster::new(columns, columns, DVec2::ONE, heights).expect("valid");
        let heights = standing(raster.heights(), columns, columns, DVec2::ONE);
        assert!((heights[62 * columns + 56] - 7.0).abs() < 1.5 || (heights[57 * columns + 57] - 7.0).abs() < 1.5);
        let hill: Vec<f32> = (0..columns * columns).map(|i| (i % columns) as f32 * 0.8).collect();
        assert!(standing(&hill, columns, columns, DVec2::ONE).is_empty());
    }

    #[test]
    fn known_samples_keep_their_heights_and_holes_are_spanned_within_their_rims() {
        let land = plane(40, 40, |x, y| {
            let hole = (30.0..44.0).contains(&x) && (40.0..70.0).contains(&y);
            if hole { f64::NAN } else { 100.0 + x }
        });
        let ground = Ground::new(&land, None, Border::Mist);
        for (x, y) in [(10.0, 60.0), (66.0, 90.0), (76.0, 3.0)] {
            let at = DVec2::new(x, y);
            assert_eq!(ground.land.height_at(at), land.height_at(at));
        }
        assert_eq!(ground.known(DVec2::new(12.0, 60.0)), 1.0);
        assert_eq!(ground.known(DVec2::new(37.0, 55.0)), 0.0);
        assert_eq!(ground.known(DVec2::new(-4.0, 55.0)), 0.0);
        let spanned = ground.land.height_at(DVec2::new(37.0, 55.0)).expect("spanned");
        assert!((125.0..150.0).contains(&spanned), "{spanned}");
    }
}
