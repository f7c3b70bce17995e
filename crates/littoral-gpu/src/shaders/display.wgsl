// From radiance to the screen: the engine's `picture::display`.

@group(0) @binding(0) var radiance_map: texture_2d<f32>;
// What radiance is multiplied by, and the medium: 0 film, 1 print, 2 paper; whether the target encodes sRGB by itself; pixels of the picture for each of the target.
struct Shown {
    scale: vec4f,
    how: vec4f,
}

@group(0) @binding(1) var<uniform> shown: Shown;

@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// T. Sobotka's AgX, in B. Wrensch's polynomial form (2023), to values encoded for the screen.
fn film(light: vec3f) -> vec3f {
    let inset = mat3x3f(
        0.8424791, 0.04232824, 0.04237565,
        0.0784336, 0.8784686, 0.0784336,
        0.079223745, 0.07916613, 0.879143,
    );
    let outset = mat3x3f(
        1.196879, -0.05289685, -0.052971635,
        -0.09802088, 1.1519031, -0.09804345,
        -0.09902974, -0.09896118, 1.1510737,
    );
    let least = -12.47393;
    let most = 4.026069;
    let x = (clamp(log2(max(inset * max(light, vec3f(0.0)), vec3f(1e-10))), vec3f(least), vec3f(most)) - least) / (most - least);
    let x2 = x * x;
    let x4 = x2 * x2;
    let curve = saturate(15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232);
    let contrasted = pow(curve, vec3f(1.35));
    let grey = vec3f(dot(contrasted, vec3f(0.2126, 0.7152, 0.0722)));
    return saturate(outset * saturate(grey + (contrasted - grey) * 1.28));
}

// Reflectance to values encoded for the screen, true to colour but for what is nearly white and brighter.
fn print(light: vec3f) -> vec3f {
    const SHOULDER = 0.75;
    let over = max(light - SHOULDER, vec3f(0.0)) / (1.0 - SHOULDER);
    return encoded(clamp(light, vec3f(0.0), vec3f(SHOULDER)) + (1.0 - SHOULDER) * (1.0 - exp(-over)));
}

fn encoded(linear: vec3f) -> vec3f {
    let v = saturate(linear);
    return select(1.055 * pow(v, vec3f(1.0 / 2.4)) - 0.055, 12.92 * v, v <= vec3f(0.0031308));
}

fn radiance_at(at: vec2i) -> vec3f {
    let last = vec2i(textureDimensions(radiance_map)) - 1;
    return textureLoad(radiance_map, clamp(at, vec2i(0), last), 0).rgb;
}

@fragment
fn display(@builtin(position) position: vec4f) -> @location(0) vec4f {
    var radiance = radiance_at(vec2i(position.xy * shown.how.yz));
    if any(shown.how.yz != vec2f(1.0)) {
        // Between the four nearest pixels.
        let p = position.xy * shown.how.yz - 0.5;
        let i = vec2i(floor(p));
        let f = p - floor(p);
        let top = mix(radiance_at(i), radiance_at(i + vec2i(1, 0)), f.x);
        radiance = mix(top, mix(radiance_at(i + vec2i(0, 1)), radiance_at(i + 1), f.x), f.y);
    }
    let light = radiance * shown.scale.rgb;
    var values: vec3f;
    switch u32(shown.scale.w) {
        case 0u: { values = film(light); }
        case 1u: { values = print(light); }
        default: { values = encoded(light); }
    }
    if shown.how.x == 0.0 {
        return vec4f(values, 1.0);
    }
    let linear = select(pow((values + 0.055) / 1.055, vec3f(2.4)), values / 12.92, values <= vec3f(0.04045));
    return vec4f(linear, 1.0);
}
