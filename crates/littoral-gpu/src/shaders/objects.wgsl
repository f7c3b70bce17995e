// Objects on land and water, lit where they are: the engine's `picture::things`.

// What was drawn so far: radiance and distance, 0 for the sky.
@group(2) @binding(0) var behind_map: texture_2d<f32>;

struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) albedo: vec3f,
}

struct Placed {
    // Where its axes point, and where its origin is from the eye (m), in the last of each three.
    @location(3) east: vec4f,
    @location(4) north: vec4f,
    @location(5) up: vec4f,
    // Whether the sun is seen at four heights.
    @location(6) sunny: vec4f,
    // The lowest of these over the object's origin, and how many of their steps a metre is, both by the object's own measure.
    @location(7) heights: vec2f,
}

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) rel: vec3f,
    @location(1) normal: vec3f,
    @location(2) albedo: vec3f,
    @location(3) step: f32,
    @location(4) @interpolate(flat) sunny: vec4f,
}

@vertex
fn place(corner: Corner, placed: Placed) -> Seen {
    let axes = mat3x3f(placed.east.xyz, placed.north.xyz, placed.up.xyz);
    let rel = axes * corner.position + vec3f(placed.east.w, placed.north.w, placed.up.w);
    var seen: Seen;
    seen.position = frame.clip_from_eye * vec4f(rel, 1.0);
    seen.rel = rel;
    seen.normal = normalize(axes * corner.normal);
    seen.albedo = corner.albedo;
    seen.step = (corner.position.z - placed.heights.x) * placed.heights.y;
    seen.sunny = placed.sunny;
    return seen;
}

@fragment
fn objects(seen: Seen, @builtin(front_facing) faces: bool) -> @location(0) vec4f {
    let distance = length(seen.rel);
    let behind = textureLoad(behind_map, vec2i(seen.position.xy), 0).w;
    if behind > 0.0 && distance > behind {
        discard;
    }
    // Seen from behind, it is the other side's.
    let normal = normalize(select(-seen.normal, seen.normal, faces));
    // What rises over the ground by a good part of the sky's grid sees past the relief that hides the sky from it.
    let clear = 0.3 / min(frame.skylight.z, frame.skylight.w);
    let over = frame.eye.z + seen.rel.z - mean_of(sample_of(seen.rel.xy), 0u);
    let free = select(step_between(0.0, clear, over), 1.0, !is_within(sample_of(seen.rel.xy)));
    var light = seen.albedo / PI * mix(irradiance_at(seen.rel.xy, normal), irradiance_open(normal), free);
    let facing = dot(normal, frame.sun.xyz);
    if facing > 0.0 {
        let step = clamp(seen.step, 0.0, 3.0);
        let below = u32(min(step, 2.0));
        let sunny = mix(seen.sunny[below], seen.sunny[below + 1u], step - f32(below));
        light += seen.albedo / PI * sunlight(frame.eye.z + seen.rel.z) * (facing * sunny);
    }
    return through_air(seen.rel / distance, seen.rel, distance, light);
}
