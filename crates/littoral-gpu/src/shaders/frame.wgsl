// What every shader of a picture is told: see `Uniforms` in frame.rs, field by field.

struct Noise {
    // From metres about the eye, east and north, to the noise's own coordinates: rows of a matrix.
    matrix: vec4f,
    // Those of the eye: lattice point, and what is left.
    cell: vec2i,
    rest: vec2f,
    // Wavelength (m); its third coordinates a metre of height; seed; whole steps of the third coordinate.
    wavelength: f32,
    upward: f32,
    seed: u32,
    storey: i32,
}

struct Frame {
    clip_from_eye: mat4x4f,
    // corner + x right + y down is the direction through pixel (x, y). w: what turns clip depth into the share of that direction; angle of a pixel
    // (rad); number of the frame.
    corner: vec4f,
    right: vec4f,
    down: vec4f,
    // Lattice point of the eye, or the land's nearest to it.
    eye_steps: vec4u,
    // Metres a step; how far the eye is beyond that point, in steps.
    step: vec4f,
    // The eye among the samples (columns, rows); its height (m); mean distance of samples (m).
    eye: vec4f,
    // Samples a metre; columns and rows.
    map: vec4f,
    // Number of coarser levels; whether there are heights of trees; whether all is known.
    has: vec4u,
    // Column and row in the atlas, columns and rows, of each coarser level.
    levels: array<vec4u, 14>,
    // Towards the sun; half the angle it covers (rad).
    sun: vec4f,
    // Radiance of its disc (kcd/m²); whether distance veils things.
    disc: vec4f,
    // Level of the water over the eye (m); whether there is any; whether it goes on to the horizon; length of the land's longer side (m).
    water: vec4f,
    // The eye among the samples of the water's basin; samples a metre.
    basin: vec4f,
    // Its columns and rows; whether there are lakes.
    basin_size: vec4f,
    // The land's rectangle from the eye (m).
    land: vec4f,
    // The eye among the points of the light from the sky; points a metre.
    skylight: vec4f,
    // Radiance of mist (kcd/m²), or reflectance of a map's sheet; its level over the eye (m).
    mist: vec4f,
    // Tree line and snow line (m); greatest height of the eye in the sky's table (m).
    climate: vec4f,
    // The block's rectangle from the eye (m).
    block: vec4f,
    // Its floor over the eye (m), its thickness (m), whether there is one, whether any of it is cut away.
    floor: vec4f,
    // What the ground is seen as: 0 nature, 1 tints, 2 a picture, 3 a shaded relief; reflectance of the floor; the eye in the picture.
    coat: vec4f,
    // Heights of the lowest ground, of the land's foot and of the highest ground (m); by how much slopes are steepened.
    tint: vec4f,
    // Albedo of lakes on a map; whether there is any sea.
    lake: vec4f,
    // From metres to the picture: two columns.
    drape: vec4f,
    // Whether there are waves; variance of the slopes of ripples that none of their models has.
    sea: vec4f,
    // The eye among the points of the map of run-up; points a metre.
    run_up: vec4f,
    // Levels of the lakes that were filled (m).
    lake_levels: array<vec4f, 8>,
    // Harmonics of the light over an open plain.
    open: array<vec4f, 9>,
    noise: array<Noise, 56>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Water up to this much farther away than the drawn ground may be seen all the same.
const NEARLY = 1.25;
const PI = 3.14159265;
// Radius of the Earth (m).
const EARTH = 6371000.0;

// A smooth step from 0 at `a` to 1 at `b`, which may lie below it.
fn step_between(a: f32, b: f32, x: f32) -> f32 {
    let t = saturate((x - a) / (b - a));
    return t * t * (3.0 - 2.0 * t);
}

// Width of a pixel at a distance on something whose normal makes this cosine with the eye (m).
fn footprint_of(distance: f32, cosine: f32) -> f32 {
    return max(distance * frame.right.w * sqrt(1.0 / max(cosine, 0.02)) * 0.65, 1e-4);
}

// How far the sea has bent down below a place beyond the land (m).
fn drop_of(rel: vec2f) -> f32 {
    let away = rel - clamp(rel, frame.land.xy, frame.land.zw);
    return dot(away, away) / (2.0 * EARTH);
}

fn normal_of_slope(slope: vec2f) -> vec3f {
    return normalize(vec3f(-slope, 1.0));
}

// Whether the ground is seen as a shaded relief: paper, without sun or air, of which there are only tones.
fn is_paper() -> bool {
    return frame.coat.x == 3.0;
}
