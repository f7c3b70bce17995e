// Gradient noise as in the engine's `picture::grain`: K. Perlin, "Improving noise", SIGGRAPH 2002, with its exact gradient. Where the eye is among the
// noise's lattice is told by the frame in integers and what is left, so that noise is as fine far from the origin as near it.

fn hash(p: vec3u, seed: u32) -> u32 {
    var h = (p.x * 0x8DA6B343u) ^ (p.y * 0xD8163841u) ^ (p.z * 0xCB1AB31Fu);
    h ^= seed * 0x9E3779B9u;
    h = (h ^ (h >> 16u)) * 0x7FEB352Du;
    h = (h ^ (h >> 15u)) * 0x846CA68Bu;
    return h ^ (h >> 16u);
}

// Twelve edge directions of a cube, by the bits of a hash: no table to look up in.
fn gradient_of(h: u32) -> vec3f {
    let k = h >> 28u;
    let a = select(1.0, -1.0, (k & 1u) != 0u);
    let b = select(1.0, -1.0, (k & 2u) != 0u);
    if k < 4u || k == 12u || k == 13u {
        return vec3f(a, b, 0.0);
    }
    if k < 8u {
        return vec3f(a, 0.0, b);
    }
    if k < 12u {
        return vec3f(0.0, a, b);
    }
    return vec3f(0.0, -1.0, select(1.0, -1.0, k == 15u));
}

struct Grain {
    value: f32,
    gradient: vec3f,
}

// Where a place is in the lattice of a noise.
struct Cell {
    base: vec3u,
    f: vec3f,
    seed: u32,
}

// `rel` metres from the eye east and north, `z` metres up.
fn cell_of(id: u32, rel: vec2f, z: f32) -> Cell {
    let n = frame.noise[id];
    let p = vec3f(n.rest + vec2f(dot(n.matrix.xy, rel), dot(n.matrix.zw, rel)), z * n.upward);
    let whole = floor(p);
    return Cell(bitcast<vec3u>(vec3i(whole) + vec3i(n.cell, n.storey)), p - whole, n.seed);
}

fn corner_gradient(cell: Cell, corner: vec3u) -> vec3f {
    return gradient_of(hash(cell.base + corner, cell.seed));
}

fn corner_value(cell: Cell, corner: vec3u) -> f32 {
    return dot(corner_gradient(cell, corner), cell.f - vec3f(corner));
}

fn fade(f: vec3f) -> vec3f {
    return f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
}

// The noise and its gradient, per unit of its own coordinates.
fn grain(id: u32, rel: vec2f, z: f32) -> Grain {
    let cell = cell_of(id, rel, z);
    let f = cell.f;
    let g0 = corner_gradient(cell, vec3u(0u, 0u, 0u));
    let g1 = corner_gradient(cell, vec3u(1u, 0u, 0u));
    let g2 = corner_gradient(cell, vec3u(0u, 1u, 0u));
    let g3 = corner_gradient(cell, vec3u(1u, 1u, 0u));
    let g4 = corner_gradient(cell, vec3u(0u, 0u, 1u));
    let g5 = corner_gradient(cell, vec3u(1u, 0u, 1u));
    let g6 = corner_gradient(cell, vec3u(0u, 1u, 1u));
    let g7 = corner_gradient(cell, vec3u(1u, 1u, 1u));
    let d0 = dot(g0, f);
    let d1 = dot(g1, f - vec3f(1.0, 0.0, 0.0));
    let d2 = dot(g2, f - vec3f(0.0, 1.0, 0.0));
    let d3 = dot(g3, f - vec3f(1.0, 1.0, 0.0));
    let d4 = dot(g4, f - vec3f(0.0, 0.0, 1.0));
    let d5 = dot(g5, f - vec3f(1.0, 0.0, 1.0));
    let d6 = dot(g6, f - vec3f(0.0, 1.0, 1.0));
    let d7 = dot(g7, f - vec3f(1.0, 1.0, 1.0));
    let u = fade(f);
    let du = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    let x = vec4f(mix(d0, d1, u.x), mix(d2, d3, u.x), mix(d4, d5, u.x), mix(d6, d7, u.x));
    let y = vec2f(mix(x.x, x.y, u.y), mix(x.z, x.w, u.y));
    let low = mix(mix(g0, g1, u.x), mix(g2, g3, u.x), u.y);
    let high = mix(mix(g4, g5, u.x), mix(g6, g7, u.x), u.y);
    let along_x = mix(mix(d1 - d0, d3 - d2, u.y), mix(d5 - d4, d7 - d6, u.y), u.z);
    let along_y = mix(x.y - x.x, x.w - x.z, u.z);
    return Grain(mix(y.x, y.y, u.z), mix(low, high, u.z) + du * vec3f(along_x, along_y, y.y - y.x));
}

// Its value alone.
fn value_of(id: u32, rel: vec2f, z: f32) -> f32 {
    let cell = cell_of(id, rel, z);
    let u = fade(cell.f);
    let x = vec4f(
        mix(corner_value(cell, vec3u(0u, 0u, 0u)), corner_value(cell, vec3u(1u, 0u, 0u)), u.x),
        mix(corner_value(cell, vec3u(0u, 1u, 0u)), corner_value(cell, vec3u(1u, 1u, 0u)), u.x),
        mix(corner_value(cell, vec3u(0u, 0u, 1u)), corner_value(cell, vec3u(1u, 0u, 1u)), u.x),
        mix(corner_value(cell, vec3u(0u, 1u, 1u)), corner_value(cell, vec3u(1u, 1u, 1u)), u.x),
    );
    return mix(mix(x.x, x.y, u.y), mix(x.z, x.w, u.y), u.z);
}

// How much of a wave of this length a pixel of this footprint can show, in [0, 1].
fn resolved(wavelength: f32, footprint: f32) -> f32 {
    let t = saturate((wavelength / footprint - 2.0) * 0.5);
    return t * t * (3.0 - 2.0 * t);
}

// The value of noise number `id`, fading out where it is finer than `footprint` (m).
fn patch_of(id: u32, rel: vec2f, z: f32, footprint: f32) -> f32 {
    let share = resolved(frame.noise[id].wavelength, footprint);
    if share == 0.0 {
        return 0.0;
    }
    return value_of(id, rel, z) * share;
}
