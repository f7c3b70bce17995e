//! What the shaders are told about a view: field by field what `frame.wgsl` reads.

use bytemuck::{Pod, Zeroable};
use glam::{DMat2, DVec2, UVec2, Vec2, Vec3};
use littoral::field::{Finest, Lakes};
use littoral::picture::Streaks;
use littoral::space::View;

use crate::bindings;
use crate::scenery::Scenery;

/// One noise: from metres to its own coordinates, and where the eye is in those.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Noise {
    matrix: [f32; 4],
    cell: [i32; 2],
    rest: [f32; 2],
    wavelength: f32,
    upward: f32,
    seed: u32,
    storey: i32,
}

/// Room for noises.
const NOISES: usize = 56;
/// Room for levels of lakes, by four.
const LAKE_LEVELS: usize = Lakes::MOST_FILLED / 4;
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
    coat: [f32; 4],
    tint: [f32; 4],
    lake: [f32; 4],
    drape: [f32; 4],
    sea: [f32; 4],
    run_up: [f32; 4],
    lake_levels: [[f32; 4]; LAKE_LEVELS],
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

/// A noise of the engine's `picture`: `natural`, or `sea`.
struct Sound {
    /// From metres, east and north, to its own coordinates.
    matrix: DMat2,
    /// Its third coordinates a metre of height.
    upward: f64,
    /// Its wavelength (m), by which it fades out.
    wavelength: f32,
    seed: u32,
    /// How far it has moved, in its own coordinates; of the third one only whole steps.
    moved: DVec2,
    storey: f64,
}

/// All noises where samples are so far apart (m), and of the finest ripples of a sea at a time (s), by the numbers that `natural.wgsl`, `water.wgsl` and
/// `wave_seen.wgsl` know them by.
fn noises(spacing: f64, finest: Finest, time: f64) -> Vec<Sound> {
    let even = |wavelength: f64, tall: f64, seed: u32| Sound {
        matrix: DMat2::from_diagonal(DVec2::splat(1.0 / wavelength)),
        upward: tall / wavelength,
        wavelength: wavelength as f32,
        seed,
        moved: DVec2::ZERO,
        storey: 0.0,
    };
    let mut all = Vec::new();
    // 0: octaves of relief below the samples.
    let mut wavelength = 2.3 * spacing as f32;
    for octave in 0..11 {
        all.push(even(f64::from(wavelength), 1.0, 100 + octave));
        wavelength *= 0.47;
    }
    // 11: patches of growth.
    let patches = [
        (620.0, 1),
        (260.0, 2),
        (2700.0, 15),
        (9400.0, 16),
        (74.0, 3),
        (31.0, 4),
        (9.0, 5),
        (3.1, 6),
        (0.9, 7),
        (14.0, 12),
    ];
    all.extend(patches.map(|(wavelength, seed)| even(wavelength, 0.35, seed)));
    // 21: crowns and twigs.
    all.extend([even(7.0, 1.0, 8), even(2.3, 1.0, 9)]);
    // 23: beds of stone, wide and thin; 26: joints.
    let tall = (spacing / 4.0).max(1.0);
    let bed = |wavelength: f64, seed| Sound {
        matrix: DMat2::from_diagonal(DVec2::splat(0.05 / (wavelength * tall))),
        ..even(wavelength, 1.0, seed)
    };
    all.extend([bed(13.0, 10), bed(4.1, 11), bed(1.3, 13), even(8.5 * tall, 0.16, 14)]);
    // 27: leaves, twigs, kinds of trees, kinds of houses (two), tiles.
    all.extend([
        even(1.7, 1.0, 20),
        even(0.6, 1.0, 21),
        even(21.0, 0.0, 22),
        even(46.0, 0.0, 23),
        even(17.0, 0.0, 24),
        even(2.0, 1.0, 25),
    ]);
    // 33: octaves of ripples, each turned a little, and longer along its crests.
    let mut wavelength = 17.0f32;
    for octave in 0..9 {
        let (s, c) = (0.35 + 0.9 * f64::from(octave)).sin_cos();
        let turned = DMat2::from_cols(DVec2::new(c, -0.55 * s), DVec2::new(s, 0.55 * c));
        let matrix = turned * (1.0 / f64::from(wavelength));
        all.push(Sound { matrix, upward: 1.0, wavelength, ..even(1.0, 0.0, 50 + octave) });
        wavelength *= 0.53;
    }
    // 42: lanes of wind.
    let lanes = DMat2::from_cols(DVec2::new(0.8, -0.6 * 2.6), DVec2::new(0.6, 0.8 * 2.6));
    all.extend(
        [(700.0, 40), (190.0, 41), (47.0, 44)]
            .map(|(wavelength, seed)| Sound { matrix: lanes * (1.0 / wavelength), ..even(wavelength, 0.0, seed) }),
    );
    // 45: ripples that run with the wind, as fast as gravity and tension drive them (m/s).
    all.extend([(0.083, 0.37), (0.037, 0.26), (0.016, 0.23)].into_iter().enumerate().map(
        |(i, (wavelength, speed))| {
            let turn = DVec2::from_angle(finest.heading + 0.6 * i as f64 - 0.5);
            let rise = 0.35 * speed * time / wavelength;
            Sound {
                moved: turn * (speed * time / wavelength),
                upward: rise - rise.floor(),
                storey: rise.floor(),
                ..even(wavelength, 0.0, 90 + i as u32)
            }
        },
    ));
    // 48: foam, drawn out along the wind.
    let streaks = Streaks::of_wind(finest.heading, finest.wind);
    let across = streaks.along.perp();
    let drawn = DMat2::from_cols(streaks.along / streaks.stretch, across).transpose();
    all.extend([6.1, 2.3, 2.9, 1.1, 0.47, 0.17, 0.07].into_iter().enumerate().map(|(i, wavelength)| Sound {
        matrix: DMat2::from_angle(1.1 * i as f64) * drawn * (1.0 / wavelength),
        ..even(wavelength, 1.0, 70 + i as u32)
    }));
    all
}

/// The layout of the group that says to every shader of a picture what the frame is: a uniform buffer of [`Uniforms`].
pub(crate) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    bindings::group_layout(device, "frame", wgpu::ShaderStages::VERTEX_FRAGMENT, &[bindings::uniform(false)])
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
        // Differences of lattice points are whole numbers of 32 bits: the eye is counted from the land's nearest point.
        let whole = steps.floor().clamp(DVec2::ZERO, DVec2::splat((1u64 << 30) as f64));
        let four = |v: Vec3, w: f32| [v.x, v.y, v.z, w];
        let pair = |a: DVec2, b: DVec2| [a.x as f32, a.y as f32, b.x as f32, b.y as f32];
        let place = |origin: DVec2, spacing: DVec2| pair((flat - origin) / spacing, 1.0 / spacing);
        let mut noise = [Noise::zeroed(); NOISES];
        let waves = scenery.waves.as_ref();
        let (finest, time) = waves.map_or_else(Default::default, |waves| (waves.finest(), waves.time()));
        for (noise, sound) in noise.iter_mut().zip(noises(f64::from(scenery.mean_spacing), finest, time)) {
            let at = sound.matrix * flat - sound.moved;
            let cell = at.floor();
            let rows = sound.matrix.transpose();
            *noise = Noise {
                matrix: [rows.x_axis.x, rows.x_axis.y, rows.y_axis.x, rows.y_axis.y].map(|v| v as f32),
                cell: [cell.x as i64 as i32, cell.y as i64 as i32],
                rest: (at - cell).as_vec2().to_array(),
                wavelength: sound.wavelength,
                upward: sound.upward as f32,
                seed: sound.seed,
                storey: sound.storey as i64 as i32,
            };
        }
        let level = scenery.level.map_or(0.0, |level| (level - eye.z) as f32);
        let drape = scenery.coat.uv_from_eye(flat);
        let is_map = scenery.coat.is_map();
        let flag = |yes: bool| f32::from(u8::from(yes));
        Uniforms {
            clip_from_eye: clip_from_eye.to_cols_array(),
            corner: four(corner, View::NEAR / depth),
            right: four(right, 1.0 / view.pixels_per_radian),
            down: four(down, look.number as f32),
            eye_steps: [whole.x as u32, whole.y as u32, 0, 0],
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
                flag(scenery.level.is_some() && !is_map),
                flag(scenery.endless),
                (scenery.land.1 - scenery.land.0).max_element() as f32,
            ],
            basin: place(scenery.basin_origin, scenery.basin_spacing),
            basin_size: [scenery.basin_size.x as f32, scenery.basin_size.y as f32, flag(scenery.has_lakes), 0.0],
            land: pair(scenery.land.0 - flat, scenery.land.1 - flat),
            skylight: place(scenery.skylight_origin, scenery.skylight_spacing),
            mist: four(scenery.mist.0, (scenery.mist.1 - eye.z) as f32),
            climate: [scenery.lines[0], scenery.lines[1], 60_000.0, (0.06 * eye.x + 0.03 * eye.y) as f32],
            block: scenery.block.map_or([0.0; 4], |block| pair(block.low - flat, block.high - flat)),
            floor: scenery.block.map_or([0.0; 4], |block| {
                [(block.floor - eye.z) as f32, block.thickness as f32, 1.0, flag(scenery.is_cut_away)]
            }),
            coat: [scenery.coat.kind, scenery.floor, drape.1.x as f32, drape.1.y as f32],
            tint: scenery.coat.tint,
            lake: four(scenery.coat.lake, flag(scenery.level.is_some())),
            drape: drape.0,
            sea: [flag(waves.is_some()), finest.variance, 0.0, 0.0],
            run_up: waves.map_or([0.0; 4], |waves| place(waves.run_up.1, waves.run_up.2)),
            lake_levels: std::array::from_fn(|i| {
                std::array::from_fn(|k| scenery.lake_levels.get(4 * i + k).copied().unwrap_or_default())
            }),
            open: scenery.open.map(|light| four(light, 0.0)),
            noise,
        }
    }
}
