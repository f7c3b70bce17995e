// What the ground is seen as where it is not nature: the engine's `picture::cartography`, and pictures laid over it.

// Colours of tints, land and bed; or the picture.
@group(0) @binding(4) var coat_map: texture_2d<f32>;

fn is_map() -> bool {
    return frame.coat.x == 1.0;
}

// Albedo of a map at a place and height over the sea (m).
fn tint_at(rel: vec2f, z: f32) -> vec3f {
    if lake_at(rel) >= 0.0 {
        return frame.lake.rgb;
    }
    let level = frame.water.x + frame.eye.z;
    var at: f32;
    var row = 0.25;
    if frame.lake.w > 0.0 && z <= level && covers(rel) {
        at = pow(saturate((level - z) / max(level - frame.tint.x, 1e-3)), 0.6);
        row = 0.75;
    } else {
        at = pow(saturate((z - frame.tint.y) / max(frame.tint.z - frame.tint.y, 1e-3)), 0.75);
    }
    let width = f32(textureDimensions(coat_map).x);
    return textureSampleLevel(coat_map, smooth_sampler, vec2f((at * (width - 1.0) + 0.5) / width, row), 0.0).rgb;
}

// Albedo of the picture about a place over a footprint (m), grey beyond it.
fn picture_at(rel: vec2f, footprint: f32) -> vec3f {
    let uv = frame.coat.zw + frame.drape.xy * rel.x + frame.drape.zw * rel.y;
    if any(uv < vec2f(0.0)) || any(uv > vec2f(1.0)) {
        return vec3f(0.25);
    }
    let size = vec2f(textureDimensions(coat_map));
    let texels = footprint * sqrt(length(frame.drape.xy * size) * length(frame.drape.zw * size));
    // Cameras' pictures hold light, not albedo: what is white in them reflects about 0.6.
    return 0.6 * textureSampleLevel(coat_map, smooth_sampler, uv, log2(max(texels, 1.0))).rgb;
}

// Even ground of an albedo, its slopes steepened for the light.
fn coated(albedo: vec3f, surface: Surface, footprint: f32, steepening: f32) -> Material {
    let openness = clamp(1.0 - 0.6 * surface.hollow * max(frame.eye.w, footprint), 0.75, 1.0);
    return Material(albedo, normal_of_slope(surface.slope * steepening), openness, 0.0);
}
