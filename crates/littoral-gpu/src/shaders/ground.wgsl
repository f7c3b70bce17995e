// The smooth ground at any fineness: the engine's `picture::ground`. Slopes are central differences, blended between samples, on the level of a
// pyramid of means that fits the footprint.

@group(1) @binding(0) var fine_heights: texture_2d<f32>;
// All coarser levels side by side.
@group(1) @binding(1) var coarse_heights: texture_2d<f32>;
// Share known, and what was cut away; tangent of the horizon towards the sun, and height of trees (m).
@group(1) @binding(2) var known_map: texture_2d<f32>;
@group(1) @binding(4) var horizon_map: texture_2d<f32>;

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

// Along a row of four samples: the height between the middle ones, the rise and the bend there.
fn along_row(i: vec2i, row: i32, size: vec2i, level: u32, u: f32) -> vec3f {
    let j = clamp(row, 0, size.y - 1);
    let h0 = height_of(vec2i(max(i.x - 1, 0), j), level);
    let h1 = height_of(vec2i(i.x, j), level);
    let h2 = height_of(vec2i(i.x + 1, j), level);
    let h3 = height_of(vec2i(min(i.x + 2, size.x - 1), j), level);
    return vec3f(mix(h1, h2, u), mix(h2 - h0, h3 - h1, u), mix(h0 + h2 - 2.0 * h1, h1 + h3 - 2.0 * h2, u));
}

fn surface_of(place: vec2f, level: u32) -> Surface {
    let size = size_of(level);
    let last = vec2f(size - 1);
    let scale = 1.0 / f32(1u << level);
    let p = clamp(place * scale, vec2f(0.0), last);
    let ij = min(vec2i(p), size - 2);
    let uv = p - vec2f(ij);
    let r0 = along_row(ij, ij.y - 1, size, level, uv.x);
    let r1 = along_row(ij, ij.y, size, level, uv.x);
    let r2 = along_row(ij, ij.y + 1, size, level, uv.x);
    let r3 = along_row(ij, ij.y + 2, size, level, uv.x);
    let s = frame.map.xy * scale;
    let along = mix(r0.x + r2.x - 2.0 * r1.x, r1.x + r3.x - 2.0 * r2.x, uv.y);
    return Surface(
        mix(r1.x, r2.x, uv.y),
        0.5 * vec2f(mix(r1.y, r2.y, uv.y), mix(r2.x - r0.x, r3.x - r1.x, uv.y)) * s,
        0.5 * (mix(r1.z, r2.z, uv.y) * s.x * s.x + along * s.y * s.y),
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
    let a = textureLoad(horizon_map, ij, 0).y;
    let b = textureLoad(horizon_map, ij + vec2i(1, 0), 0).y;
    let c = textureLoad(horizon_map, ij + vec2i(0, 1), 0).y;
    let d = textureLoad(horizon_map, ij + 1, 0).y;
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
