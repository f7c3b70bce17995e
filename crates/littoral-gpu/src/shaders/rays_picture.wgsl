// The first step of a picture by rays instead of triangles: one through each pixel, and how far away what it meets is.

@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn meet(@builtin(position) position: vec4f) -> @builtin(frag_depth) f32 {
    let direction = frame.corner.xyz + frame.right.xyz * position.x + frame.down.xyz * position.y;
    let distance = first_hit(vec3f(0.0), direction, NEVER, relief.spread);
    // What is nearer than the near plane is drawn on it; nothing is at infinity.
    return select(min(frame.corner.w / max(distance, 1e-12), 1.0), 0.0, distance == NEVER);
}
