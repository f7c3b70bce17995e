// Foam at an instant between two ticks, and its means over ever larger squares.

struct Shown {
    // Which half of the foam is that of the tick before.
    half: u32,
    // The part of the way to the next.
    part: f32,
}

@group(0) @binding(0) var<uniform> shown: Shown;
@group(0) @binding(1) var<storage, read> foam: array<f32>;
@group(0) @binding(2) var finer: texture_2d_array<f32>;
@group(0) @binding(3) var level: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(level);
    if any(id.xy >= size) {
        return;
    }
    let half = arrayLength(&foam) / 2u;
    let at = (id.z * size.y + id.y) * size.x + id.x;
    let before = foam[shown.half * half + at];
    let after = foam[(1u - shown.half) * half + at];
    textureStore(level, id.xy, id.z, vec4f(before + (after - before) * shown.part));
}

@compute @workgroup_size(8, 8)
fn halve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(level)) {
        return;
    }
    let low = textureLoad(finer, 2u * id.xy, id.z, 0).x + textureLoad(finer, 2u * id.xy + vec2u(1u, 0u), id.z, 0).x;
    let high = textureLoad(finer, 2u * id.xy + vec2u(0u, 1u), id.z, 0).x + textureLoad(finer, 2u * id.xy + 1u, id.z, 0).x;
    textureStore(level, id.xy, id.z, vec4f(0.25 * (low + high)));
}
