// Gradient noise as in the engine's `picture::grain`: K. Perlin, "Improving noise", SIGGRAPH 2002, with its exact gradient. Where the eye is among the
// noise's lattice is told by the frame in integers and what is left, so that noise is as fine far from the origin as near it.

const GRADIENTS = array<vec3f, 16>(
    vec3f(1.0, 1.0, 0.0), vec3f(-1.0, 1.0, 0.0), vec3f(1.0, -1.0, 0.0), vec3f(-1.0, -1.0, 0.0),
    vec3f(1.0, 0.0, 1.0), vec3f(-1.0, 0.0, 1.0), vec3f(1.0, 0.0, -1.0), vec3f(-1.0, 0.0, -1.0),
    vec3f(0.0, 1.0, 1.0), vec3f(0.0, -1.0, 1.0), vec3f(0.0, 1.0, -1.0), vec3f(0.0, -1.0, -1.0),
    vec3f(1.0, 1.0, 0.0), vec3f(-1.0, 1.0, 0.0), vec3f(0.0, -1.0, 1.0), vec3f(0.0, -1.0, -1.0),
);

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

// Noise number `id` at a place `rel` metres from the eye east and north, and `z` in its own third coordinate.
fn grain(id: u32, rel: vec2f, z: f32, seed: u32) -> Grain {
    let n = frame.noise[id];
    let p = vec3f(n.rest + vec2f(dot(n.matrix.xy, rel), dot(n.matrix.zw, rel)), z);
    let whole = floor(p);
    let f = p - whole;
    let base = bitcast<vec3u>(vec3i(whole) + vec3i(n.cell, 0));
    var g: array<vec3f, 8>;
    var d: array<f32, 8>;
    for (var c = 0u; c < 8u; c++) {
        let corner = vec3u(c & 1u, (c >> 1u) & 1u, c >> 2u);
        g[c] = gradient_of(hash(base + corner, seed));
        d[c] = dot(g[c], f - vec3f(corner));
    }
    let u = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let du = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    let x = vec4f(mix(d[0], d[1], u.x), mix(d[2], d[3], u.x), mix(d[4], d[5], u.x), mix(d[6], d[7], u.x));
    let y = vec2f(mix(x.x, x.y, u.y), mix(x.z, x.w, u.y));
    let gy0 = mix(mix(g[0], g[1], u.x), mix(g[2], g[3], u.x), u.y);
    let gy1 = mix(mix(g[4], g[5], u.x), mix(g[6], g[7], u.x), u.y);
    let along_x = mix(mix(d[1] - d[0], d[3] - d[2], u.y), mix(d[5] - d[4], d[7] - d[6], u.y), u.z);
    let along_y = mix(x.y - x.x, x.w - x.z, u.z);
    return Grain(mix(y.x, y.y, u.z), mix(gy0, gy1, u.z) + du * vec3f(along_x, along_y, y.y - y.x));
}

// How much of a wave of this length a pixel of this footprint can show, in [0, 1].
fn resolved(wavelength: f32, footprint: f32) -> f32 {
    let t = saturate((wavelength / footprint - 2.0) * 0.5);
    return t * t * (3.0 - 2.0 * t);
}

// The value of noise of a wavelength (m), fading out where it is finer than `footprint` (m).
fn patch_of(id: u32, rel: vec2f, z: f32, wavelength: f32, footprint: f32, seed: u32) -> f32 {
    let share = resolved(wavelength, footprint);
    if share == 0.0 {
        return 0.0;
    }
    return grain(id, rel, z, seed).value * share;
}
