// Triangles of a surface, as far away as they are. Vertices are lattice points: the eye's is taken from them in integers, so that nothing jitters.

struct Seen {
    @builtin(position) position: vec4f,
}

@vertex
fn surface(@location(0) at: vec2u, @location(1) height: f32) -> Seen {
    let steps = vec2f(bitcast<vec2i>(at - frame.eye_steps.xy)) - frame.step.zw;
    // A void is nowhere.
    var seen: Seen;
    seen.position = frame.clip_from_eye * vec4f(steps * frame.step.xy, height - frame.eye.z, 1.0);
    return seen;
}
