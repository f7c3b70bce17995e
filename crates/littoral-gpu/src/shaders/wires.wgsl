// Edges of triangles, drawn over the picture. Corners are read by number, so that no edges need be listed: each pixel knows how near it is to one.

// Lattice point, face and height of each vertex, as bits.
@group(0) @binding(16) var<storage, read> vertices: array<vec4u>;
@group(0) @binding(17) var<storage, read> corners: array<u32>;

struct Wire {
    @builtin(position) position: vec4f,
    @location(0) shares: vec3f,
}

@vertex
fn wire(@builtin(vertex_index) i: u32) -> Wire {
    let vertex = vertices[corners[i]];
    let steps = vec2f(bitcast<vec2i>(vertex.xy - frame.eye_steps.xy)) - frame.step.zw;
    let at = vec4f(steps * frame.step.xy, bitcast<f32>(vertex.w) - frame.eye.z, 1.0);
    var out: Wire;
    out.position = frame.clip_from_eye * at;
    // A little nearer than the surface.
    out.position.z *= 1.0005;
    out.shares = vec3f(f32(i % 3u == 0u), f32(i % 3u == 1u), f32(i % 3u == 2u));
    return out;
}

@fragment
fn drawn(in: Wire) -> @location(0) vec4f {
    // Pixels to each edge; triangles of a few pixels would be all line.
    let steepness = fwidth(in.shares);
    let pixels = in.shares / max(steepness, vec3f(1e-9));
    let nearest = min(min(pixels.x, pixels.y), pixels.z);
    let size = 1.0 / max(max(steepness.x, steepness.y), max(steepness.z, 1e-9));
    let line = saturate(1.2 - nearest) * clamp((size - 1.0) / 5.0, 0.12, 1.0);
    return vec4f(0.0, 0.0, 0.0, 0.6 * line);
}
