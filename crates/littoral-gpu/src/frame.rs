//! What the shaders are told about a view: field by field what `frame.wgsl` reads.

use bytemuck::{Pod, Zeroable};
use glam::{DMat2, DVec2, UVec2, Vec2, Vec3};
use littoral::space::View;

use crate::scenery::Scenery;

/// One noise: from metres to its own coordinates, and where the eye is in those.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Noise {
    matrix: [f32; 4],
    cell: [i32; 2],
    rest: [f32; 2],
}

/// Room for noises.
const NOISES: usize = 56;
/// Room for coarser levels of heights.
pub(crate) const LEVELS: usize = 14;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct Uniforms {
    clip_from_eye: [f32; 16],
    corner: [f32; 4],
    right: [f32; 4],
    down: [f32; 4],
    eye_steps: [u32; 4],
    step: [f32; 4],
    eye: [f32; 4],
    map: [f32; 4],
    has: [u32; 4],
    levels: [[u32; 4]; LEVELS],
    sun: [f32; 4],
    disc: [f32; 4],
    water: [f32; 4],
    basin: [f32; 4],
    basin_size: [f32; 4],
    land: [f32; 4],
    skylight: [f32; 4],
    mist: [f32; 4],
    climate: [f32; 4],
    block: [f32; 4],
    floor: [f32; 4],
    open: [[f32; 4]; 9],
    noise: [Noise; NOISES],
}

/// Which part of each pixel is looked through, and with which random numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Offset from the pixels' middles (pixels), right and down.
    pub offset: Vec2,
    /// Number of the look: 0 sees the middle of all that is random.
    pub number: u32,
}

/// From metres to the coordinates of each noise, where samples are so far apart (m): see `natural.wgsl` and `water.wgsl` for which number is which.
fn noises(spacing: f64) -> Vec<DMat2> {
    let even = |wavelength: f64| DMat2::from_diagonal(DVec2::splat(1.0 / wavelength));
    let mut all: Vec<DMat2> =
        (0..11).map(|octave| even(f64::from(relief_wavelength(spacing as f32, octave)))).collect();
    all.extend([620.0, 260.0, 2700.0, 9400.0, 74.0, 31.0, 9.0, 3.1, 0.9, 14.0, 7.0, 2.3].map(even));
    let tall = (spacing / 4.0).max(1.0);
    all.extend([13.0, 4.1, 1.3].map(|wavelength| even(wavelength * tall / 0.05)));
    all.extend([8.5 * tall, 1.7, 0.6, 21.0, 46.0, 17.0, 2.0].map(even));
    let mut wavelength = 17.0f32;
    for octave in 0..9 {
        // Each octave of ripples turned a little, and longer along its crests.
        let (s, c) = (0.35 + 0.9 * f64::from(octave)).sin_cos();
        let turned = DMat2::from_cols(DVec2::new(c, -0.55 * s), DVec2::new(s, 0.55 * c));
        all.push(turned * (1.0 / f64::from(wavelength)));
        wavelength *= 0.53;
    }
    let lanes = DMat2::from_cols(DVec2::new(0.8, -0.6 * 2.6), DVec2::new(0.6, 0.8 * 2.6));
    all.extend([700.0, 190.0, 47.0].map(|wavelength| lanes * (1.0 / wavelength)));
    all
}

/// Wavelength (m) of an octave of the relief below the samples.
fn relief_wavelength(spacing: f32, octave: u32) -> f32 {
    (0..octave).fold(2.3 * spacing, |wavelength, _| wavelength * 0.47)
}

impl Uniforms {
    /// A scenery as a view sees it.
    pub fn new(scenery: &Scenery, view: &View, look: Look) -> Uniforms {
        let eye = view.eye;
        let flat = eye.truncate();
        let (corner, right, down) = view.frame();
        let depth = (view.clip_from_eye * corner.extend(1.0)).w;
        let size = view.size.max(UVec2::ONE).as_vec2();
        let shift = Vec2::new(-2.0, 2.0) * look.offset / size;
        let mut clip_from_eye = view.clip_from_eye;
        // x + shift · w, for every column.
        for column in 0..4 {
            let w = clip_from_eye.col(column).w;
            let col = clip_from_eye.col_mut(column);
            col.x += shift.x * w;
            col.y += shift.y * w;
        }
        let corner = corner + right * look.offset.x + down * look.offset.y;

        let steps = (flat - scenery.origin) / scenery.step;
        let whole = steps.floor().clamp(DVec2::splat(-2.0e9), DVec2::splat(2.0e9));
        let four = |v: Vec3, w: f32| [v.x, v.y, v.z, w];
        let pair = |a: DVec2, b: DVec2| [a.x as f32, a.y as f32, b.x as f32, b.y as f32];
        let place = |origin: DVec2, spacing: DVec2| pair((flat - origin) / spacing, 1.0 / spacing);
        let mut noise = [Noise::zeroed(); NOISES];
        for (noise, matrix) in noise.iter_mut().zip(noises(f64::from(scenery.mean_spacing))) {
            let at = matrix * flat;
            let cell = at.floor();
            let rows = matrix.transpose();
            *noise = Noise {
                matrix: [rows.x_axis.x, rows.x_axis.y, rows.y_axis.x, rows.y_axis.y].map(|v| v as f32),
                cell: [cell.x as i64 as i32, cell.y as i64 as i32],
                rest: (at - cell).as_vec2().to_array(),
            };
        }
        let level = scenery.level.map_or(0.0, |level| (level - eye.z) as f32);
        let flag = |yes: bool| f32::from(u8::from(yes));
        Uniforms {
            clip_from_eye: clip_from_eye.to_cols_array(),
            corner: four(corner, View::NEAR / depth),
            right: four(right, 1.0 / view.pixels_per_radian),
            down: four(down, look.number as f32),
            eye_steps: [whole.x as i64 as i32 as u32, whole.y as i64 as i32 as u32, 0, 0],
            step: pair(scenery.step, steps - whole),
            eye: {
                let [x, y, ..] = place(scenery.map_origin, scenery.map_spacing);
                [x, y, eye.z as f32, scenery.mean_spacing]
            },
            map: {
                let per = (1.0 / scenery.map_spacing).as_vec2();
                [per.x, per.y, scenery.map_size.x as f32, scenery.map_size.y as f32]
            },
            has: [scenery.levels.len() as u32, scenery.has_standing.into(), scenery.all_known.into(), 0],
            levels: std::array::from_fn(|i| scenery.levels.get(i).copied().unwrap_or_default()),
            sun: four(scenery.sun, scenery.sun_radius),
            disc: four(scenery.disc, flag(scenery.veils_distance)),
            water: [
                level,
                flag(scenery.level.is_some()),
                flag(scenery.endless),
                (scenery.land.1 - scenery.land.0).max_element() as f32,
            ],
            basin: place(scenery.basin_origin, scenery.basin_spacing),
            basin_size: [scenery.basin_size.x as f32, scenery.basin_size.y as f32, 0.0, 0.0],
            land: pair(scenery.land.0 - flat, scenery.land.1 - flat),
            skylight: place(scenery.skylight_origin, scenery.skylight_spacing),
            mist: four(scenery.mist.0, (scenery.mist.1 - eye.z) as f32),
            climate: [scenery.lines[0], scenery.lines[1], 60_000.0, (0.06 * eye.x + 0.03 * eye.y) as f32],
            block: scenery.block.map_or([0.0; 4], |block| pair(block.low - flat, block.high - flat)),
            floor: scenery.block.map_or([0.0; 4], |block| {
                [(block.floor - eye.z) as f32, block.thickness as f32, 1.0, flag(scenery.is_cut_away)]
            }),
            open: scenery.open.map(|light| four(light, 0.0)),
            noise,
        }
    }
}
