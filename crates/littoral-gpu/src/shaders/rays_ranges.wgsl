// The pyramid of ranges: how low and how high the bilinear surface reaches over every aligned square of patches, the engine's `field::pyramid` without its
// rounding. A level is made from the one below it; the first from the samples, those on a node's border included.

struct Step {
    // Where the finer level begins, and its columns and rows; of the first step, columns and rows of samples.
    finer: vec4u,
    // The same of the level to be made.
    made: vec4u,
}

@group(0) @binding(0) var<uniform> step_: Step;
@group(0) @binding(1) var heights: texture_2d<f32>;
@group(0) @binding(2) var<storage, read_write> ranges: array<vec2f>;

// Heights above this are voids.
const VOID = 1e37;
// The range of nothing.
const EMPTY = vec2f(3e38, -3e38);

fn union_(a: vec2f, b: vec2f) -> vec2f {
    return vec2f(min(a.x, b.x), max(a.y, b.y));
}

fn patch_range(a: f32, b: f32, c: f32, d: f32) -> vec2f {
    let high = max(max(a, b), max(c, d));
    return select(vec2f(min(min(a, b), min(c, d)), high), EMPTY, high > VOID);
}

@compute @workgroup_size(8, 8)
fn first(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step_.made.yz) {
        return;
    }
    // 3 × 3 samples from the node's south-western one on; at the border fewer, which are read again in place of what is missing.
    let corner = 2u * id.xy;
    let last = step_.finer.yz - 1u;
    var h: array<f32, 9>;
    for (var k = 0u; k < 9u; k++) {
        h[k] = textureLoad(heights, min(corner + vec2u(k % 3u, k / 3u), last), 0).x;
    }
    var range = patch_range(h[0], h[1], h[3], h[4]);
    let more = corner + 1u < last;
    if more.x {
        range = union_(range, patch_range(h[1], h[2], h[4], h[5]));
    }
    if more.y {
        range = union_(range, patch_range(h[3], h[4], h[6], h[7]));
    }
    if all(more) {
        range = union_(range, patch_range(h[4], h[5], h[7], h[8]));
    }
    ranges[step_.made.x + id.y * step_.made.y + id.x] = range;
}

@compute @workgroup_size(8, 8)
fn coarser(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step_.made.yz) {
        return;
    }
    let low = 2u * id.xy;
    let high = min(low + 1u, step_.finer.yz - 1u);
    let south = step_.finer.x + low.y * step_.finer.y;
    let north = step_.finer.x + high.y * step_.finer.y;
    let range = union_(
        union_(ranges[south + low.x], ranges[south + high.x]),
        union_(ranges[north + low.x], ranges[north + high.x]),
    );
    ranges[step_.made.x + id.y * step_.made.y + id.x] = range;
}
