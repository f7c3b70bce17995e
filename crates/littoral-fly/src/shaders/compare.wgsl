// Two pictures beside each other, or how far apart they are.

@group(0) @binding(0) var first: texture_2d<f32>;
@group(0) @binding(1) var second: texture_2d<f32>;

struct How {
    // Where the second picture begins (pixels from the left).
    divider: f32,
    // By how much differences are amplified; 0 for the pictures themselves.
    gain: f32,
    unused: vec2f,
}

@group(0) @binding(2) var<uniform> how: How;

// What a tile of pixels adds up to: differences in steps of 255, all of them and the largest, and how many pixels are off.
struct Tile {
    sum: u32,
    largest: u32,
    off: u32,
    unused: u32,
}

@group(0) @binding(3) var<storage, read_write> tiles: array<Tile>;

@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn compare(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2u(position.xy);
    let a = textureLoad(first, at, 0).rgb;
    let b = textureLoad(second, at, 0).rgb;
    if how.gain > 0.0 {
        return vec4f(saturate(abs(a - b) * how.gain), 1.0);
    }
    if abs(position.x - how.divider) < 1.0 {
        return vec4f(1.0);
    }
    return vec4f(select(b, a, position.x < how.divider), 1.0);
}

// A pixel is off that differs by more steps than this.
const OFF: u32 = 24u;

var<workgroup> sum: atomic<u32>;
var<workgroup> largest: atomic<u32>;
var<workgroup> off: atomic<u32>;

@compute @workgroup_size(16, 16)
fn measure(
    @builtin(global_invocation_id) at: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(num_workgroups) count: vec3u,
    @builtin(local_invocation_index) i: u32,
) {
    if all(at.xy < textureDimensions(first)) {
        let steps = vec3u(round(255.0 * abs(textureLoad(first, at.xy, 0).rgb - textureLoad(second, at.xy, 0).rgb)));
        let most = max(steps.r, max(steps.g, steps.b));
        atomicAdd(&sum, steps.r + steps.g + steps.b);
        atomicMax(&largest, most);
        atomicAdd(&off, select(0u, 1u, most > OFF));
    }
    workgroupBarrier();
    if i == 0u {
        tiles[tile.y * count.x + tile.x] = Tile(atomicLoad(&sum), atomicLoad(&largest), atomicLoad(&off), 0u);
    }
}
