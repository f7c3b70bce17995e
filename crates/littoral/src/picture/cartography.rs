//! Maps rather than landscapes: tints by height, and shaded relief as cartographers draw it.
//!
//! *Tint*: colour runs through stops in hue, saturation and lightness by height, with another set below the water, so that
//! depth and shape are read at once; the light of the scene does the rest.
//!
//! *Relief*: several lights, each strongest where the slope turns its flank to it, so that no ridge disappears by lying along the light; shapes
//! of several sizes at once; sunlit flanks warm and shaded ones cool, contrast rising from the valleys to the summits.
//!
//! Works this rests on: E. Imhof, *Cartographic relief presentation*, 1965; R. Mark, "Multidirectional, oblique-weighted,
//! shaded-relief image of the Island of Hawaii", USGS 92-422, 1992.

use super::ground::Ground;
use super::tables::Coat;
use super::texture::decode_srgb;
use crate::field::HeightRange;
use glam::{DVec2, Vec2, Vec3};
use std::sync::LazyLock;

/// Stops of colour: position in [0, 1], hue (degrees), saturation, lightness.
type Stops = [(f32, f32, f32, f32)];

const LAND: &Stops = &[
    (0.00, 132.0, 0.26, 0.42),
    (0.12, 96.0, 0.30, 0.53),
    (0.30, 56.0, 0.46, 0.67),
    (0.52, 34.0, 0.44, 0.56),
    (0.74, 20.0, 0.30, 0.45),
    (0.90, 16.0, 0.12, 0.66),
    (1.00, 20.0, 0.05, 0.93),
];

const BED: &Stops = &[
    (0.00, 186.0, 0.46, 0.80),
    (0.12, 194.0, 0.50, 0.68),
    (0.35, 203.0, 0.52, 0.53),
    (0.70, 213.0, 0.52, 0.38),
    (1.00, 224.0, 0.52, 0.25),
];

/// Colour by height over a land.
#[derive(Clone, Copy, Debug)]
pub struct Tints {
    /// Lowest and highest ground (m).
    pub low: f32,
    /// Highest ground (m).
    pub high: f32,
    /// Level of the water (m), or below everything.
    pub level: f32,
    /// Root mean square of the slopes of a shape as large as the eye picks out.
    pub slope: f32,
}

impl Tints {
    /// The range and the slopes of a ground.
    pub fn of(ground: &Ground, range: HeightRange, level: f32) -> Tints {
        const SIDE: usize = 48;
        let (origin, extent) = (ground.land.origin(), ground.land.extent());
        let footprint = (extent.max_element() / 160.0) as f32;
        let (mut squares, mut count) = (0.0f64, 0.0f64);
        for i in 0..SIDE * SIDE {
            let f = DVec2::new((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5) / SIDE as f64;
            let at = origin + extent * f;
            if ground.known(at) > 0.5 {
                squares += f64::from(ground.surface(at, footprint).slope.length_squared());
                count += 1.0;
            }
        }
        let slope = (squares / count.max(1.0)).sqrt().max(1e-5) as f32;
        Tints { low: range.low, high: range.high, level, slope }
    }

    /// By how much slopes are steepened for the light on them, at least 1: on wide or flat land true slopes would show nothing.
    /// Only the shades follow, as on any relief map; heights, and all that is measured, stay as they are.
    pub fn steepening(&self) -> f32 {
        (0.32 / self.slope).max(1.0)
    }

    /// The same on a shaded relief: a typical slope is a good grey.
    fn exaggeration(&self) -> f32 {
        0.45 / self.slope
    }

    /// Heights (m) of the lowest ground, of the foot of the land and of the highest ground.
    fn heights(&self) -> [f32; 3] {
        [self.low, self.level.max(self.low), self.high]
    }

    /// Tints in numbers.
    pub fn coat(&self) -> Coat<'static> {
        Coat::Tint {
            land: LAND_RUN.to_vec(),
            bed: BED_RUN.to_vec(),
            lake: LAKE_TINT,
            heights: self.heights(),
            steepening: self.steepening(),
        }
    }

    /// A shaded relief in numbers.
    pub fn relief(&self) -> Coat<'static> {
        Coat::Relief { lake: LAKE_PAPER, heights: self.heights(), steepening: self.exaggeration() }
    }

    /// Albedo (linear) of ground at a height (m); `wet` says whether water lies over it where it is below the level.
    pub fn colour(&self, height: f32, wet: bool) -> Vec3 {
        if wet && height <= self.level {
            // The shelf is a small part of the depth and most of what one looks at.
            let t = ((self.level - height) / (self.level - self.low).max(1e-3)).clamp(0.0, 1.0);
            return look_up(&BED_RUN, t.powf(0.6));
        }
        let foot = self.level.max(self.low);
        let t = ((height - foot) / (self.high - foot).max(1e-3)).clamp(0.0, 1.0);
        look_up(&LAND_RUN, t.powf(0.75))
    }
}

/// A run of colours in steps so small that a straight line between them is as good.
type Run = [Vec3; 1025];
static LAND_RUN: LazyLock<Run> = LazyLock::new(|| std::array::from_fn(|i| run_through(LAND, i as f32 / 1024.0)));
static BED_RUN: LazyLock<Run> = LazyLock::new(|| std::array::from_fn(|i| run_through(BED, i as f32 / 1024.0)));

fn look_up(run: &Run, t: f32) -> Vec3 {
    let at = t.clamp(0.0, 1.0) * 1024.0;
    let i = (at as usize).min(1023);
    run[i].lerp(run[i + 1], at - i as f32)
}

/// The linear colour at `t` along stops.
fn run_through(stops: &Stops, t: f32) -> Vec3 {
    let after = stops.iter().position(|s| s.0 >= t).unwrap_or(stops.len() - 1).max(1);
    let (a, b) = (stops[after - 1], stops[after]);
    let f = ((t - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
    let mix = |p: f32, q: f32| p + (q - p) * f;
    hsl(mix(a.1, b.1), mix(a.2, b.2), mix(a.3, b.3))
}

/// Linear light of a hue (degrees), saturation and lightness in sRGB.
fn hsl(hue: f32, saturation: f32, lightness: f32) -> Vec3 {
    let amount = saturation * lightness.min(1.0 - lightness);
    let channel = |n: f32| {
        let k = (n + hue / 30.0).rem_euclid(12.0);
        decode_srgb(lightness - amount * (k - 3.0).min(9.0 - k).clamp(-1.0, 1.0))
    };
    Vec3::new(channel(0.0), channel(8.0), channel(4.0))
}

/// Reflectance (linear) of lakes on a tinted map.
pub const LAKE_TINT: Vec3 = Vec3::new(0.33, 0.56, 0.72);
/// Reflectance (linear) of lakes on a shaded relief.
pub const LAKE_PAPER: Vec3 = Vec3::new(0.52, 0.69, 0.80);
/// Reflectance (linear) of the sheet that a shaded relief is drawn on.
pub const SHEET: Vec3 = Vec3::new(0.90, 0.89, 0.86);

/// Reflectance (linear) of a shaded relief at a place, for a pixel of this footprint (m). `to_sun` is the main light's
/// direction on the map.
pub fn relief(ground: &Ground, tints: &Tints, at: DVec2, height: f32, footprint: f32, to_sun: Vec2, wet: bool) -> Vec3 {
    let below = wet && height < tints.level;
    let foot = if below { tints.low } else { tints.level.max(tints.low) };
    let top = if below { tints.level } else { tints.high };
    let elevation = ((height - foot) / (top - foot).max(1e-3)).clamp(0.0, 1.0);
    // Slopes of three sizes.
    let size = ground.spacing().max(footprint);
    let extent = ground.land.extent().min_element() as f32;
    let mut slope = Vec2::ZERO;
    for (scale, weight) in [(1.0, 0.50), (5.0, 0.32), (18.0, 0.18)] {
        slope += ground.surface(at, (size * scale).min(0.05 * extent)).slope * weight;
    }
    slope *= tints.exaggeration();
    let normal = Vec3::new(-slope.x, -slope.y, 1.0).normalize();
    // Four lights over a quarter turn to either side of the main one, weighed by how far the slope turns from each.
    let aspect = (-slope).normalize_or(to_sun);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (turn, share) in [(-0.9f32, 0.7), (-0.3, 1.0), (0.35, 1.0), (0.95, 0.6)] {
        let (s, c) = turn.sin_cos();
        let flat = Vec2::new(to_sun.x * c - to_sun.y * s, to_sun.x * s + to_sun.y * c);
        let light = Vec3::new(flat.x * 0.77, flat.y * 0.77, 0.64);
        let oblique = 1.0 - aspect.dot(flat).powi(2);
        let weight = share * (0.35 + oblique);
        sum += weight * normal.dot(light).max(0.0);
        weights += weight;
    }
    let many = sum / weights;
    let single = normal.dot(Vec3::new(to_sun.x * 0.77, to_sun.y * 0.77, 0.64)).max(0.0);
    let shade = 0.45 * many + 0.55 * single;
    // 0 where flat, towards 1 in full light and −1 in full shade; valleys lie under more air.
    let contrast = if below { 0.45 + 0.25 * elevation } else { 0.70 + 0.45 * elevation };
    let tone = ((shade - 0.64) / 0.36).clamp(-1.8, 1.0) * contrast;
    let paper = match below {
        true => hsl(204.0, 0.42, 0.70 + 0.16 * elevation),
        false => hsl(86.0, 0.20, 0.69).lerp(hsl(42.0, 0.46, 0.82), elevation.powf(0.7)),
    };
    if tone > 0.0 {
        paper.lerp(hsl(50.0, 0.85, 0.95), tone.min(1.0) * 0.75)
    } else {
        let deep = if below { hsl(218.0, 0.45, 0.32) } else { hsl(238.0, 0.20, 0.27) };
        let cool = hsl(222.0, 0.20, 0.55);
        let t = (-tone).min(1.6) / 1.6;
        let half = paper.lerp(cool * paper * 1.4, (2.0 * t).min(1.0));
        half.lerp(deep, ((t - 0.30) / 0.70).clamp(0.0, 1.0) * 0.9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tints_break_at_the_water_line_and_nowhere_else() {
        let tints = Tints { low: -100.0, high: 900.0, level: 0.0, slope: 0.1 };
        let jump = |a: f32, b: f32, wet| (tints.colour(a, wet) - tints.colour(b, wet)).length();
        assert!(jump(-0.01, 0.01, true) > 0.2, "the shore is a line");
        assert!(jump(-0.01, 0.01, false) < 0.01, "a polder is land");
        // Steps of half a per cent of depth or height: on the shelf, where one looks, colours follow metres the fastest.
        let mut from_shore = 1e-3;
        while from_shore < 900.0 {
            assert!(jump(from_shore, 1.005 * from_shore, true) < 0.05, "at {from_shore}");
            assert!(jump(-from_shore, -1.005 * from_shore, true) < 0.05, "at -{from_shore}");
            from_shore *= 1.005;
        }
    }

    #[test]
    fn hsl_agrees_with_known_colours() {
        for (h, s, l, rgb) in [(0.0, 1.0, 0.5, Vec3::X), (120.0, 1.0, 0.5, Vec3::Y), (240.0, 1.0, 0.5, Vec3::Z)] {
            assert!((hsl(h, s, l) - rgb).length() < 1e-5);
        }
        assert!((hsl(77.0, 0.0, 1.0) - Vec3::ONE).length() < 1e-5);
    }
}
