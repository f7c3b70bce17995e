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

fn height_of(at: vec2u) -> f32 {
    return textureLoad(heights, at, 0).x;
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
    // The samples there are from the node's south-western one on: 3 × 3, or fewer at the border.
    let corner = 2u * id.xy;
    let last = min(step_.finer.yz - 1u - corner, vec2u(2u));
    var range = EMPTY;
    for (var j = 0u; j < last.y; j++) {
        for (var i = 0u; i < last.x; i++) {
            let at = corner + vec2u(i, j);
            range = union_(range, patch_range(height_of(at), height_of(at + vec2u(1u, 0u)), height_of(at + vec2u(0u, 1u)), height_of(at + 1u)));
        }
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
