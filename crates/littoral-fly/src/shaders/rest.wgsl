// Many looks at a picture that rests, gathered into one.

// What is shown of a look: encoded as sRGB, one of its pixels for `coarse` of the picture's, each way.
@group(0) @binding(0) var look: texture_2d<f32>;
// Sums of light, and how many looks they are of.
@group(0) @binding(1) var sums: texture_2d<f32>;

struct Gathering {
    // Which of each pixel's parts this look went through.
    part: vec2u,
    // From the picture's pixels to the look's parts.
    shift: vec2u,
    coarse: u32,
    fresh: u32,
    unused: vec2u,
}

@group(0) @binding(2) var<uniform> gathering: Gathering;

@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn light(encoded: vec3f) -> vec3f {
    return select(pow((encoded + 0.055) / 1.055, vec3f(2.4)), encoded / 12.92, encoded <= vec3f(0.04045));
}

fn encoded(light: vec3f) -> vec3f {
    return select(1.055 * pow(light, vec3f(1.0 / 2.4)) - 0.055, light * 12.92, light <= vec3f(0.0031308));
}

fn look_at(at: vec2i) -> vec3f {
    let last = vec2i(textureDimensions(look)) - 1;
    return light(textureLoad(look, clamp(at, vec2i(0), last), 0).rgb);
}

@fragment
fn gather(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2u(position.xy) + gathering.shift;
    let coarse = gathering.coarse;
    if gathering.fresh != 0u && coarse > 1u {
        // Until a pixel gets a look of its own, what lies between the four nearest will do: it counts for next to nothing.
        let p = (vec2f(at) + 0.5) / f32(coarse) - 0.5;
        let i = vec2i(floor(p));
        let f = p - floor(p);
        let top = mix(look_at(i), look_at(i + vec2i(1, 0)), f.x);
        let bottom = mix(look_at(i + vec2i(0, 1)), look_at(i + 1), f.x);
        return vec4f(mix(top, bottom, f.y), 1.0) * 1e-5;
    }
    var sum = textureLoad(sums, vec2u(position.xy), 0);
    if gathering.fresh != 0u {
        sum = vec4f(0.0);
    }
    if any(at % vec2u(coarse) != gathering.part) {
        return sum;
    }
    return sum + vec4f(look_at(vec2i(at / coarse)), 1.0);
}

@fragment
fn settle(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let sum = textureLoad(sums, vec2u(position.xy), 0);
    return vec4f(encoded(sum.rgb / max(sum.a, 1e-9)), 1.0);
}
