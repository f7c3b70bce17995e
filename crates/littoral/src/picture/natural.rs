//! Natural ground: what lies where, and its relief down to the pixel.
//!
//! Relief below the samples continues the spectrum above them: octaves of noise whose slopes are alike (so that heights
//! fall with wavelength, as eroded land's do), strong on rock and weak on grass and sand, each fading out before it is finer than the
//! pixel. Rock shows where the ground so roughened is steep; scree lies below it, grass and heath on what is gentle, woods in
//! patches that prefer hollows, sand on low slopes by the water, snow on high ground that is not steep. Colours are
//! albedos of measured materials (linear Rec. 709), and no mixture reflects more than its brightest part.

use super::Climate;
use super::grain::{grain, patch, resolved, step};
use super::ground::Surface;
use glam::{DVec3, Vec3};

/// What light meets at a place.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Share of light thrown back, evenly to all sides.
    pub albedo: Vec3,
    /// Unit normal with all relief that a pixel can show.
    pub normal: Vec3,
    /// How much of the sky the relief itself hides, in [0, 1]: 1 for nothing.
    pub openness: f32,
    /// How wet, in [0, 1]: a film of water that mirrors the sky at grazing angles.
    pub wet: f32,
}

const FRESH_GRASS: Vec3 = Vec3::new(0.066, 0.086, 0.027);
const DRY_GRASS: Vec3 = Vec3::new(0.165, 0.138, 0.068);
const HEATH: Vec3 = Vec3::new(0.082, 0.066, 0.038);
const WOODS: Vec3 = Vec3::new(0.026, 0.037, 0.014);
const SOIL: Vec3 = Vec3::new(0.130, 0.097, 0.062);
const WARM_ROCK: Vec3 = Vec3::new(0.255, 0.212, 0.165);
const COOL_ROCK: Vec3 = Vec3::new(0.165, 0.158, 0.150);
const SCREE: Vec3 = Vec3::new(0.190, 0.170, 0.144);
const SAND: Vec3 = Vec3::new(0.450, 0.372, 0.262);
const MUD: Vec3 = Vec3::new(0.150, 0.122, 0.088);
const SNOW: Vec3 = Vec3::new(0.860, 0.880, 0.910);
const ROOF_TILES: Vec3 = Vec3::new(0.190, 0.085, 0.055);
const ROOF_SLATE: Vec3 = Vec3::new(0.115, 0.112, 0.115);
const PLASTER: Vec3 = Vec3::new(0.480, 0.445, 0.390);
const SEAGRASS: Vec3 = Vec3::new(0.030, 0.042, 0.022);

/// A place on the ground, and how it is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// Where (m).
    pub at: DVec3,
    /// Distance between samples there (m).
    pub spacing: f32,
    /// Width of a pixel on the ground (m).
    pub footprint: f32,
    /// Level of the water nearby (m), if any.
    pub water: Option<f32>,
    /// How high waves run up here (m).
    pub run_up: f32,
    /// Height of trees and houses that the samples include (m).
    pub standing: f32,
}

/// What kind of ground lies at `site` on `surface`, which is `broad`ly so over some tens of metres.
pub fn natural(site: &Site, surface: &Surface, broad: &Surface, climate: &Climate) -> Material {
    let Site { at, spacing, footprint, water, run_up, standing } = *site;
    let normal = Vec3::new(-surface.slope.x, -surface.slope.y, 1.0).normalize();
    let steep = surface.slope.length();
    // Wide samples smooth cliffs away: what is left of their slope counts for more.
    let blunt = (spacing / 3.0).max(1.0).log2().min(5.0) / 5.0;
    let rocky = step(0.58, 1.10, steep * (1.0 + 0.60 * blunt));
    let above = water.map_or(f32::INFINITY, |level| at.z as f32 - level);

    // Relief below the samples.
    let shore_calm = step(0.5, 6.0, above.abs() + 12.0 * rocky);
    let amplitude = (0.060 + 0.24 * rocky - 0.07 * step(1.4, 2.4, steep)) * (0.25 + 0.75 * shore_calm);
    let mut wavelength = 2.3 * spacing;
    let (mut relief, mut bumps, mut shown) = (Vec3::ZERO, 0.0f32, 0.0f32);
    // Cliffs are layered, finer upward than along; on gentler ground layers would show as contour lines. Between them both are there, as rough together as either: one whose
    // layers grew finer with the slope would, high above 0, draw contours of the slope.
    let layered = step(0.9, 1.8, steep);
    let both = layered.hypot(1.0 - layered);
    for octave in 0..11u32 {
        let share = resolved(wavelength, footprint);
        if share == 0.0 {
            break;
        }
        for (upward, part) in [(0.35, 1.0 - layered), (2.05, layered)] {
            if part > 0.0 {
                let (layers, share) = (DVec3::new(1.0, 1.0, upward), share * part / both);
                let noise = grain(at * layers / f64::from(wavelength), 100 + octave);
                relief += noise.gradient * layers.as_vec3() * (amplitude * share);
                bumps += noise.value * share;
            }
        }
        shown += 1.0;
        wavelength *= 0.47;
    }
    let roughened = (normal - (relief - normal * relief.dot(normal))).normalize();
    let rough_steep = (1.0 - roughened.z * roughened.z).max(0.0).sqrt() / roughened.z.max(0.05);
    let pits = (bumps / shown.max(1.0).sqrt()).clamp(-1.0, 1.0);

    // Patches of growth.
    let plain = DVec3::new(at.x, at.y, 0.35 * at.z);
    let mut wide = patch(plain, 620.0, footprint, 1) + 0.6 * patch(plain, 260.0, footprint, 2);
    // Wide samples are of wide land, seen from so far that only whole valleys and plains differ.
    let regional = step(12.0, 40.0, spacing);
    if regional > 0.0 {
        wide = wide * (1.0 - 0.45 * regional)
            + regional * (0.75 * patch(plain, 2700.0, footprint, 15) + 0.75 * patch(plain, 9400.0, footprint, 16));
    }
    let middle = patch(plain, 74.0, footprint, 3) + 0.6 * patch(plain, 31.0, footprint, 4);
    let fine =
        patch(plain, 9.0, footprint, 5) + 0.7 * patch(plain, 3.1, footprint, 6) + 0.5 * patch(plain, 0.9, footprint, 7);
    let moist = (broad.hollow * spacing.max(8.0) * 9.0).clamp(-1.0, 1.0);
    let height = at.z as f32;
    let alpine = step(climate.tree_line - 350.0, climate.tree_line + 450.0, height + 180.0 * middle + 120.0 * wide);

    let lush = (0.52 + 0.55 * wide + 0.35 * middle + 0.35 * moist - 0.45 * alpine).clamp(0.0, 1.0);
    let mut albedo = DRY_GRASS.lerp(FRESH_GRASS, lush);
    albedo = albedo.lerp(HEATH, step(0.10, 0.50, 0.6 * middle - 0.5 * wide + 0.25 * fine) * 0.75);
    albedo *= 1.0 + 0.30 * fine + 0.12 * pits;
    albedo = albedo.lerp(SOIL, 0.5 * step(0.42, 0.70, rough_steep + 0.2 * fine));

    // Woods thin out with height, slope and near the sea.
    let mut openness = 1.0 + 0.25 * pits.min(0.0);
    let mut shaded = roughened;
    let likes = 0.50 * wide + 0.55 * middle + 0.45 * moist - 0.9 * alpine - 0.45 * step(0.5, 0.9, steep) - 0.02;
    let clumps = 0.45 * patch(plain, 31.0, footprint, 4) + 0.35 * patch(plain, 14.0, footprint, 12) + 0.25 * fine;
    let wood = step(-0.02, 0.22, likes + clumps) * step(5.0, 14.0, above) * (1.0 - 0.85 * rocky);
    if wood > 0.0 {
        let crown = resolved(7.0, footprint);
        let crowns = grain(at / 7.0, 8);
        let twigs = patch(at, 2.3, footprint, 9);
        let canopy = (normal - crowns.gradient * (0.55 * crown) * Vec3::new(1.0, 1.0, 0.3)).normalize();
        let tone = 1.0 + 0.45 * crown * crowns.value + 0.35 * twigs + 0.25 * fine;
        albedo = albedo.lerp(WOODS * tone * (1.0 + 0.3 * wide), wood * 0.94);
        shaded = shaded.lerp(canopy, wood).normalize();
        openness *= 1.0 - wood * (0.22 - 0.35 * crown * crowns.value).clamp(0.0, 0.5);
    }

    if standing > 1.0 {
        return stands(site, surface, albedo, normal);
    }

    // Bare ground: high, steep or washed by the sea.
    let scree = alpine.max(step(0.52, 0.80, rough_steep * (1.0 + 0.5 * blunt) + 0.12 * fine) * 0.85);
    albedo = albedo.lerp(SCREE * (1.0 + 0.25 * fine + 0.15 * pits), scree * (0.55 + 0.45 * step(-0.3, 0.3, middle)));
    let washed = (1.0 - step(2.0, 5.0, above + 2.5 * middle)) * step(0.16, 0.34, steep.max(broad.slope.length()));
    let rock = step(0.68, 1.05, rough_steep * (1.0 + 0.60 * blunt) + 0.15 * fine).max(washed);
    if rock > 0.0 {
        // Beds of harder and softer stone, hardly tilted, and joints that run down through them.
        let cliff = step(0.9, 1.7, steep * (1.0 + 0.5 * blunt));
        let tall = (spacing / 4.0).max(1.0);
        let level = f64::from(tall);
        let beds = DVec3::new(at.x * 0.05, at.y * 0.05, at.z + 0.06 * at.x + 0.03 * at.y) / level;
        let bed = patch(beds, 13.0, footprint / tall, 10)
            + 0.6 * patch(beds, 4.1, footprint / tall, 11)
            + 0.35 * patch(beds, 1.3, footprint / tall, 13);
        let joint_at = DVec3::new(at.x, at.y, 0.16 * at.z) / (8.5 * level);
        // Joints as wide as a valley would look like worms.
        let split = resolved(8.5 * tall, footprint) * cliff * (1.0 - step(6.0, 16.0, spacing));
        let joints = grain(joint_at, 14);
        let crack = split * step(0.16, 0.0, joints.value.abs());
        let lean = joints.gradient * Vec3::new(0.42, 0.42, 0.07) * split;
        shaded = (shaded - (lean - normal * lean.dot(normal)) * rock).normalize();
        let warm = (0.45 + 0.9 * bed + 0.45 * middle).clamp(0.0, 1.0);
        let stone =
            COOL_ROCK.lerp(WARM_ROCK, warm) * (1.0 + 0.32 * pits + 0.20 * fine + 0.30 * bed * cliff - 0.38 * crack);
        albedo = albedo.lerp(stone, rock);
        openness *= 1.0 - rock * (0.15 * (0.5 - pits).clamp(0.0, 1.0) + 0.45 * crack);
    }

    // The shore.
    let mut wet = 0.0;
    if above < 12.0 {
        let gentle = (1.0 - step(0.20, 0.36, steep)) * (1.0 - step(0.22, 0.40, broad.slope.length()));
        let sand = (1.0 - step(1.7, 3.0, above + 0.7 * middle + 0.25 * fine)) * gentle;
        // Flats too level for waves to have built are mud and marsh.
        let flat = 1.0 - step(0.003, 0.012, steep + 0.004 * middle);
        let marsh = MUD.lerp(FRESH_GRASS.lerp(DRY_GRASS, 0.55), step(0.2, 0.9, above + 0.4 * middle + 0.2 * fine));
        let tone = SAND * (1.0 + 0.10 * middle + 0.07 * fine);
        albedo = albedo.lerp(tone.lerp(marsh, flat * step(-0.6, 0.0, above)), sand);
        shaded = shaded.lerp(normal, 0.75 * sand).normalize();
        openness = openness + (1.0 - openness) * sand;
        let reach = (0.8 * run_up).max(0.3);
        wet = 1.0 - step(0.2 * reach, 1.8 * reach, above + (0.12 * middle + 0.04 * fine) * (reach / 0.3).sqrt());
        // Water fills the pores: less light comes back, of a deeper colour.
        albedo = albedo.lerp(albedo * (0.30 + 0.45 * albedo), wet * (0.35 + 0.65 * sand.max(rock)));
    }
    if above < 0.0 {
        let grown =
            step(0.02, 0.48, 0.55 * middle + 0.5 * wide + 0.22 * patch(plain, 14.0, footprint, 12) + 0.2 * fine)
                * step(-1.2, -4.5, above);
        let soaked = 0.62 + 0.38 * step(0.0, -1.2, above);
        albedo = (SAND * soaked).lerp(COOL_ROCK * 0.6, rock).lerp(SEAGRASS, grown * 0.85) * (1.0 + 0.12 * fine);
        wet = 0.0;
    }

    // Snow.
    let cover = height - climate.snow_line + 260.0 * middle + 160.0 * wide + 240.0 * moist + 60.0 * fine;
    let snow = step(-120.0, 160.0, cover) * (1.0 - step(0.75, 1.05, rough_steep * (1.0 + 0.3 * blunt) + 0.1 * fine));
    if snow > 0.0 && above > 2.0 {
        albedo = albedo.lerp(SNOW, snow);
        shaded = shaded.lerp(normal, 0.6 * snow).normalize();
        openness += (1.0 - openness) * snow;
    }
    Material { albedo: albedo.clamp(Vec3::splat(0.01), Vec3::splat(0.92)), normal: shaded, openness, wet }
}

/// What stands on the ground: trees where the surface is rough, houses where it is even.
fn stands(site: &Site, surface: &Surface, ground: Vec3, normal: Vec3) -> Material {
    let Site { at, spacing, footprint, standing, .. } = *site;
    let rough = step(0.10, 0.32, surface.hollow.abs() * spacing + 0.10 * (surface.slope.length() - 1.0).max(0.0))
        * (1.0 - step(24.0, 34.0, standing));
    let plain = DVec3::new(at.x, at.y, 0.0);
    let leaves = grain(at / 1.7, 20);
    let twigs = grain(at / 0.6, 21);
    let (near, nearer) = (resolved(1.7, footprint), resolved(0.6, footprint));
    let shaken = leaves.gradient * (0.6 * near) + twigs.gradient * (0.4 * nearer);
    let tree = WOODS
        * (1.5 + 0.9 * patch(plain, 21.0, footprint, 22) + 0.5 * near * leaves.value + 0.5 * nearer * twigs.value);
    let kind = patch(plain, 46.0, 0.1, 23) + 0.5 * patch(plain, 17.0, 0.1, 24);
    let roof = ROOF_TILES.lerp(ROOF_SLATE, step(-0.02, 0.06, kind)) * (1.0 + 0.15 * patch(at, 2.0, footprint, 25));
    let wall = step(1.3, 2.4, surface.slope.length());
    let house = roof.lerp(PLASTER, wall);
    let share = step(1.0, 2.2, standing);
    let leafy = (normal - shaken * rough).normalize();
    Material {
        albedo: ground.lerp(house.lerp(tree, rough), share),
        normal: normal.lerp(leafy, share).normalize(),
        openness: 1.0 - 0.25 * rough * share * (0.5 - near * leaves.value).clamp(0.0, 1.0),
        wet: 0.0,
    }
}
