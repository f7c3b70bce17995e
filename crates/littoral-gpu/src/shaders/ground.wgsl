// The smooth ground at any fineness: the engine's `picture::ground`. Slopes are central differences, blended between samples, on the level of a
// pyramid of means that fits the footprint.

@group(0) @binding(1) var fine_heights: texture_2d<f32>;
// All coarser levels side by side.
@group(0) @binding(2) var coarse_heights: texture_2d<f32>;
// Share known; height of trees (m); tangent of the horizon towards the sun.
@group(0) @binding(3) var known_map: texture_2d<f32>;
@group(0) @binding(4) var standing_map: texture_2d<f32>;
@group(0) @binding(5) var horizon_map: texture_2d<f32>;

struct Surface {
    height: f32,
    slope: vec2f,
    hollow: f32,
}

// Columns and rows of a level.
fn size_of(level: u32) -> vec2i {
    if level == 0u {
        return vec2i(frame.map.zw);
    }
    return vec2i(frame.levels[level - 1u].zw);
}

fn height_of(at: vec2i, level: u32) -> f32 {
    if level == 0u {
        return textureLoad(fine_heights, at, 0).x;
    }
    return textureLoad(coarse_heights, at + vec2i(frame.levels[level - 1u].xy), 0).x;
}

// Where a place `rel` metres from the eye is among the samples.
fn sample_of(rel: vec2f) -> vec2f {
    return frame.eye.xy + rel * frame.map.xy;
}

fn surface_of(place: vec2f, level: u32) -> Surface {
    let size = size_of(level);
    let last = vec2f(size - 1);
    let scale = 1.0 / f32(1u << level);
    let p = clamp(place * scale, vec2f(0.0), last);
    let ij = min(vec2i(p), size - 2);
    let uv = p - vec2f(ij);
    var m: array<f32, 4>;
    var rise: array<f32, 4>;
    var bend: array<f32, 4>;
    for (var dj = 0; dj < 4; dj++) {
        let j = clamp(ij.y + dj - 1, 0, size.y - 1);
        let h0 = height_of(vec2i(max(ij.x - 1, 0), j), level);
        let h1 = height_of(vec2i(ij.x, j), level);
        let h2 = height_of(vec2i(ij.x + 1, j), level);
        let h3 = height_of(vec2i(min(ij.x + 2, size.x - 1), j), level);
        m[dj] = mix(h1, h2, uv.x);
        rise[dj] = mix(h2 - h0, h3 - h1, uv.x);
        bend[dj] = mix(h0 + h2 - 2.0 * h1, h1 + h3 - 2.0 * h2, uv.x);
    }
    let s = frame.map.xy * scale;
    let along = mix(m[0] + m[2] - 2.0 * m[1], m[1] + m[3] - 2.0 * m[2], uv.y);
    return Surface(
        mix(m[1], m[2], uv.y),
        0.5 * vec2f(mix(rise[1], rise[2], uv.y), mix(m[2] - m[0], m[3] - m[1], uv.y)) * s,
        0.5 * (mix(bend[1], bend[2], uv.y) * s.x * s.x + along * s.y * s.y),
    );
}

// The smooth surface, averaged over `footprint` (m).
fn surface_at(rel: vec2f, footprint: f32) -> Surface {
    let place = sample_of(rel);
    let level = min(log2(max(footprint / frame.eye.w, 1.0)), f32(frame.has.x));
    let fine = u32(level);
    let blend = level - f32(fine);
    let a = surface_of(place, fine);
    if blend < 1e-3 || fine >= frame.has.x {
        return a;
    }
    let b = surface_of(place, fine + 1u);
    return Surface(mix(a.height, b.height, blend), mix(a.slope, b.slope, blend), mix(a.hollow, b.hollow, blend));
}

// Bilinear between the samples of the finest level about a place.
fn between(map: texture_2d<f32>, place: vec2f) -> f32 {
    let size = vec2i(frame.map.zw);
    let p = clamp(place, vec2f(0.0), vec2f(size - 1));
    let ij = min(vec2i(p), size - 2);
    let uv = p - vec2f(ij);
    let south = mix(textureLoad(map, ij, 0).x, textureLoad(map, ij + vec2i(1, 0), 0).x, uv.x);
    let north = mix(textureLoad(map, ij + vec2i(0, 1), 0).x, textureLoad(map, ij + 1, 0).x, uv.x);
    return mix(south, north, uv.y);
}

fn is_within(place: vec2f) -> bool {
    return all(place >= vec2f(0.0)) && all(place <= frame.map.zw - 1.0);
}

// The mean height on a level, and nothing else.
fn mean_of(place: vec2f, level: u32) -> f32 {
    let size = size_of(level);
    let p = clamp(place / f32(1u << level), vec2f(0.0), vec2f(size - 1));
    let ij = min(vec2i(p), size - 2);
    let uv = p - vec2f(ij);
    let south = mix(height_of(ij, level), height_of(ij + vec2i(1, 0), level), uv.x);
    let north = mix(height_of(ij + vec2i(0, 1), level), height_of(ij + 1, level), uv.x);
    return mix(south, north, uv.y);
}

// How far the ground is known, in [0, 1].
fn known_at(rel: vec2f) -> f32 {
    let place = sample_of(rel);
    if frame.has.z != 0u {
        return 1.0;
    }
    if !is_within(place) {
        return 0.0;
    }
    return between(known_map, place);
}

// Height of trees and houses that the surface includes (m).
fn standing_at(rel: vec2f) -> f32 {
    let place = sample_of(rel);
    if frame.has.y == 0u || !is_within(place) {
        return 0.0;
    }
    let ij = min(vec2i(place), vec2i(frame.map.zw) - 2);
    let uv = place - vec2f(ij);
    let a = textureLoad(standing_map, ij, 0).x;
    let b = textureLoad(standing_map, ij + vec2i(1, 0), 0).x;
    let c = textureLoad(standing_map, ij + vec2i(0, 1), 0).x;
    let d = textureLoad(standing_map, ij + 1, 0).x;
    let blend = mix(mix(a, b, uv.x), mix(c, d, uv.x), uv.y);
    return max(blend, select(0.0, 0.6 * max(max(a, b), max(c, d)), blend > 0.3));
}

// How much of the sun's disc is seen from the ground, `height` metres above the sea.
fn sun_seen(rel: vec2f) -> f32 {
    let place = sample_of(rel);
    if !is_within(place) {
        return step_between(-1.0, 1.0, asin(clamp(frame.sun.z, -1.0, 1.0)) / frame.sun.w);
    }
    let horizon = atan(between(horizon_map, place));
    return step_between(-1.0, 1.0, (asin(clamp(frame.sun.z, -1.0, 1.0)) - horizon) / frame.sun.w);
}
