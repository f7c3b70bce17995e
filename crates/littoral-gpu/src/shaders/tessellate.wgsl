// What the passes of a tessellation share: the lists of cells, what the land says about a cell, and what a cell amounts to in a view. The processor's
// twins are `lod/patches/level.rs` and `lod/metric.rs`, with the same names; see `tessellator.rs` for the passes.

struct Sight {
    // Normals, pointing inward, of the frame's four sides, and straight ahead; w of the last is the nearest visible distance (m).
    sides: array<vec4f, 4>,
    forward: vec4f,
    // Lattice point of the eye, or the land's nearest to it; how far the eye is beyond that point, in steps.
    eye_steps: vec2u,
    rest: vec2f,
    // Metres a step; height of the eye (m) in two parts.
    step: vec2f,
    eye_height: vec2f,
    // Pixels that a unit of tangent covers; the greatest distance in the frame as a multiple of its depth; pixels asked for.
    focal: f32,
    stretch: f32,
    tolerance: f32,
    // Heights are stored as base + steps · height_step (m), and what the rounding of that may take.
    base: f32,
    height_step: f32,
    height_slack: f32,
    // Most triangles; most cells in all lists.
    most: u32,
    room: u32,
    // Finest level that is drawn; level whose cells lie between four samples; samples a row, rows.
    finest: u32,
    samples_level: u32,
    columns: u32,
    rows: u32,
}

// The number of the level that a pass goes over.
struct Level {
    number: u32,
}

// A cell that is looked at, since its parent is cut.
struct Place {
    // Column and row among the cells of its level.
    at: vec2u,
    // Where its parent is in the lists, and the first of its four children if it is cut.
    parent: u32,
    children: u32,
}

// What it amounts to in the view.
struct Look {
    // The tolerance (pixels) below which its parent is cut.
    above: f32,
    // Its bound (pixels); 0 for what is not seen.
    bound: f32,
    // The tolerance (pixels) below which it is cut: its bound, or its parent's if that is less.
    pixels: f32,
    // Its kind in the lowest bits, its level from bit 8 on.
    kind: u32,
}

struct State {
    tolerance: f32,
    // Triangles at that tolerance.
    count: atomic<i32>,
    // Cells of the level at hand that would be cut.
    candidates: atomic<u32>,
    // Cells in all lists; vertices drawn.
    used: atomic<u32>,
    vertices: atomic<u32>,
    // The greatest bound of what is drawn (pixels), as bits.
    reached: atomic<u32>,
    // Where the list of each level begins.
    firsts: array<u32, 32>,
}

// There is no surface, or out of sight one that is partly void: nothing has to be closed towards it.
const EMPTY = 0u;
// Out of sight, and all there.
const UNSEEN = 1u;
// Seen, and all there.
const WHOLE = 2u;
// Seen and partly void: it is never drawn, since no void is bridged.
const TORN = 3u;

// Instead of a place in a list: not in the list; beyond the face.
const ABSENT = 0x7fffffffu;
const BORDER = 0x7ffffffeu;
// A bit beside such a place: a sliver stands on that side unless the cell there is cut, too.
const OPEN = 0x80000000u;

// The cells of the first levels are in one texture, level after level from west to east.
const TOGETHER = 6u;

// Bits of numbers that are not finite, and of the largest that is.
const INFINITE = 0x7f800000u;
const LARGEST = 0x7f7fffffu;

@group(0) @binding(0) var<uniform> sight: Sight;
@group(0) @binding(1) var<uniform> here: Level;
// For each cell of the level: its range in steps, the low one in the lower half, and the bits of its error (m).
@group(0) @binding(2) var cells: texture_2d<u32>;
// Bits of the samples' heights (m); voids are not finite.
@group(0) @binding(3) var heights: texture_2d<u32>;
@group(0) @binding(4) var<storage, read_write> state: State;
@group(0) @binding(5) var<storage, read_write> places: array<Place>;
// Of cells that may be cut, those beyond the sides (south, east, north, west): places in the lists, ABSENT or BORDER, and OPEN.
@group(0) @binding(6) var<storage, read_write> beside: array<vec4u>;
@group(0) @binding(7) var<storage, read_write> looks: array<Look>;

// What the land says about a cell: lowest and highest height and error (m), whether there is a surface, and whether it is without voids.
struct Facts {
    low: f32,
    high: f32,
    error: f32,
    exists: bool,
    whole: bool,
}

fn facts(at: vec2u, level: u32) -> Facts {
    var land: Facts;
    let above = vec2u(sight.samples_level - level);
    if any(at > (vec2u(sight.columns, sight.rows) - 2u) >> above) {
        return land;
    }
    if level == sight.samples_level {
        let bits = vec4u(
            textureLoad(heights, at, 0).x,
            textureLoad(heights, at + vec2u(1u, 0u), 0).x,
            textureLoad(heights, at + vec2u(0u, 1u), 0).x,
            textureLoad(heights, at + vec2u(1u, 1u), 0).x,
        );
        if any((bits & vec4u(INFINITE)) == vec4u(INFINITE)) {
            return land;
        }
        let h = bitcast<vec4f>(bits);
        let sizes = abs(h);
        let size = max(max(sizes.x, sizes.y), max(sizes.z, sizes.w));
        let slack = 1.1e-6 * size;
        land.low = min(min(h.x, h.y), min(h.z, h.w)) - slack;
        land.high = max(max(h.x, h.y), max(h.z, h.w)) + slack;
        // A quarter of the twist, and what rounding may take.
        land.error = 0.25 * abs((h.x - h.y) - (h.z - h.w)) + size * 1.1920929e-7;
        land.exists = true;
        land.whole = true;
        return land;
    }
    let first = select(0u, (1u << level) - 1u, level < TOGETHER);
    let texel = textureLoad(cells, at + vec2u(first, 0u), 0).xy;
    let low = texel.x & 0xffffu;
    let high = texel.x >> 16u;
    land.exists = low <= high;
    land.whole = texel.y < INFINITE;
    land.low = sight.base + f32(low) * sight.height_step - sight.height_slack;
    land.high = sight.base + f32(high) * sight.height_step + sight.height_slack;
    if land.whole {
        land.error = bitcast<f32>(texel.y);
    }
    return land;
}

fn kind(seen: Look) -> u32 {
    return seen.kind & 3u;
}

// From the eye to a lattice point (m), level.
fn from_eye(at: vec2u) -> vec2f {
    return (vec2f(bitcast<vec2i>(at - sight.eye_steps)) - sight.rest) * sight.step;
}

fn above_eye(height: f32) -> f32 {
    return (height - sight.eye_height.x) - sight.eye_height.y;
}

// The farthest that a box reaches along a direction.
fn reach(normal: vec3f, low: vec3f, high: vec3f) -> f32 {
    let most = max(normal * low, normal * high);
    return most.x + most.y + most.z;
}

fn look(at: vec2u, level: u32, above: f32) -> Look {
    let land = facts(at, level);
    var seen = Look(above, 0.0, 0.0, EMPTY | (level << 8u));
    if !land.exists {
        return seen;
    }
    let side = 1u << (30u - level);
    var low = vec3f(from_eye(at * side), above_eye(land.low));
    var high = vec3f(from_eye((at + 1u) * side), above_eye(land.high));
    // Five roundings.
    low -= abs(low) * 3e-7;
    high += abs(high) * 3e-7;
    let far = max(abs(low), abs(high));

    let slack = -1e-6 * (far.x + far.y + far.z);
    var within = reach(sight.forward.xyz, low, high) >= sight.forward.w;
    for (var i = 0u; i < 4u; i++) {
        within = within && reach(sight.sides[i].xyz, low, high) >= slack;
    }
    if !within {
        seen.kind |= select(EMPTY, UNSEEN, land.whole);
        return seen;
    }

    // Greatest ρ/w² in the box and the frame: see `ScreenMetric::spread`.
    let depth = max(-reach(-sight.forward.xyz, low, high), sight.forward.w);
    let nearest = sight.stretch * depth;
    let per_area = 1.00001 / (depth * depth);
    if land.whole {
        seen.kind |= WHOLE;
        seen.bound = land.error * (sight.focal * (min(length(far.xy), nearest) * per_area));
    } else {
        // No farther off than it is large: its own size, since far from the eye the corners are rounded.
        let size = vec3f(f32(side) * sight.step, land.high - land.low);
        seen.kind |= TORN;
        seen.bound = sight.focal * (min(length(far), nearest) * per_area) * length(size);
    }
    seen.bound = min(seen.bound, bitcast<f32>(LARGEST));
    seen.pixels = min(seen.bound, above);
    return seen;
}
