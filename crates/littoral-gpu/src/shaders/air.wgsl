// Sky, haze, and the light of both: the engine's `picture::atmosphere` and `picture::skylight`, from the tables that they make.

@group(1) @binding(12) var smooth_sampler: sampler;
// Distances × elevations × (azimuths of Rayleigh, Mie and higher orders), as the eye sees them, and as the land does.
@group(1) @binding(5) var eye_light: texture_3d<f32>;
@group(1) @binding(6) var eye_through: texture_2d<f32>;
@group(1) @binding(7) var land_light: texture_3d<f32>;
// Nine harmonics of light from all sides.
@group(1) @binding(8) var skylight_map: texture_2d_array<f32>;
// By length of path in water: its own radiance, and the share left of the bed's light; sunlight by height. A row each.
@group(1) @binding(9) var media_map: texture_2d<f32>;

const AZIMUTHS = 16.0;
const ELEVATIONS = 160.0;
const DISTANCES = 41.0;
// Tables hold this many times the light, so that half floats do for dusk.
const GAIN = 64.0;

struct Veil {
    light: vec3f,
    through: vec3f,
}

fn rayleigh_phase(cosine: f32) -> f32 {
    return 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
}

// Cornette and Shanks's phase function.
fn mie_phase(cosine: f32) -> f32 {
    const G = 0.76;
    let base = max(1.0 + G * G - 2.0 * G * cosine, 1e-4);
    return 3.0 / (8.0 * PI) * (1.0 - G * G) * (1.0 + cosine * cosine) / ((2.0 + G * G) * base * sqrt(base));
}

// Texture coordinates of a direction and distance: distance, elevation, azimuth (in slices).
fn sky_place(direction: vec3f, distance: f32) -> vec3f {
    let flat = length(direction.xy);
    let sun_flat = normalize(select(frame.sun.xy, vec2f(0.0, 1.0), length(frame.sun.xy) < 1e-6));
    let cosine = select(1.0, dot(direction.xy, sun_flat) / max(flat, 1e-6), flat > 1e-6);
    let azimuth = acos(clamp(cosine, -1.0, 1.0)) / PI * (AZIMUTHS - 1.0);
    let elevation = asin(clamp(direction.z, -1.0, 1.0));
    let w = sign(elevation) * sqrt(abs(elevation) / (0.5 * PI));
    let row = (w * 0.5 + 0.5) * (ELEVATIONS - 1.0);
    let k = log(1300000.0 / 150.0 + 1.0) / (DISTANCES - 1.0);
    let slice = min(log(max(distance, 0.0) / 150.0 + 1.0) / k, DISTANCES - 1.0);
    return vec3f((slice + 0.5) / DISTANCES, (row + 0.5) / ELEVATIONS, azimuth + 0.5);
}

fn scattered(light: texture_3d<f32>, place: vec3f, direction: vec3f) -> vec3f {
    let cosine = dot(direction, frame.sun.xyz);
    let rayleigh = textureSampleLevel(light, smooth_sampler, vec3f(place.xy, place.z / (3.0 * AZIMUTHS)), 0.0).rgb;
    let mie = textureSampleLevel(light, smooth_sampler, vec3f(place.xy, (place.z + AZIMUTHS) / (3.0 * AZIMUTHS)), 0.0).rgb;
    let many = textureSampleLevel(light, smooth_sampler, vec3f(place.xy, (place.z + 2.0 * AZIMUTHS) / (3.0 * AZIMUTHS)), 0.0).rgb;
    return max(rayleigh * rayleigh_phase(cosine) + mie * mie_phase(cosine) + many, vec3f(0.0)) / GAIN;
}

// What the air does along a unit direction from the eye over a distance (m).
fn veil(direction: vec3f, distance: f32) -> Veil {
    let place = sky_place(direction, distance);
    let through = textureSampleLevel(eye_through, smooth_sampler, place.xy, 0.0).rgb;
    return Veil(scattered(eye_light, place, direction), max(through, vec3f(0.0)));
}

// Radiance of the sky as the eye sees it, with the sun's disc; on paper there is none.
fn sky_seen(direction: vec3f) -> vec3f {
    if is_paper() {
        return frame.mist.rgb;
    }
    let seen = veil(direction, 1e9);
    let edge = cos(frame.sun.w);
    let inside = saturate((dot(direction, frame.sun.xyz) - edge) / (0.1 * (1.0 - edge)));
    let disc = select(frame.disc.rgb * seen.through * inside, vec3f(0.0), direction.z < -0.02);
    return seen.light + disc;
}

// Radiance of the sky as the land sees it.
fn sky_over_land(direction: vec3f) -> vec3f {
    return scattered(land_light, sky_place(direction, 1e9), direction);
}

// Sunlight on a facing surface at a height (m): klx.
fn sunlight(height: f32) -> vec3f {
    let at = sqrt(saturate(height / 100000.0));
    return textureSampleLevel(media_map, smooth_sampler, vec2f((at * 255.0 + 0.5) / 257.0, 5.0 / 6.0), 0.0).rgb;
}

// What each of nine harmonics of light adds to the irradiance on a surface of this normal: the cosine lobe's share of it.
fn weight_of(i: i32, d: vec3f) -> f32 {
    const A = PI * 0.282095;
    const B = 2.0 * PI / 3.0 * 0.488603;
    const C = PI / 4.0;
    switch i {
        case 0: { return A; }
        case 1: { return B * d.y; }
        case 2: { return B * d.z; }
        case 3: { return B * d.x; }
        case 4: { return C * 1.092548 * d.x * d.y; }
        case 5: { return C * 1.092548 * d.y * d.z; }
        case 6: { return C * 0.315392 * (3.0 * d.z * d.z - 1.0); }
        case 7: { return C * 1.092548 * d.x * d.z; }
        default: { return C * 0.546274 * (d.x * d.x - d.y * d.y); }
    }
}

// Irradiance (klx) of light from the sky and the land around on a surface at a place.
fn irradiance_at(rel: vec2f, normal: vec3f) -> vec3f {
    let size = vec2f(textureDimensions(skylight_map));
    let uv = (clamp(frame.skylight.xy + rel * frame.skylight.zw, vec2f(0.0), size - 1.0) + 0.5) / size;
    var sum = vec3f(0.0);
    for (var i = 0; i < 9; i++) {
        sum += textureSampleLevel(skylight_map, smooth_sampler, uv, i, 0.0).rgb * weight_of(i, normal);
    }
    return max(sum, vec3f(0.0)) / GAIN;
}

// Irradiance (klx) of the light over an open plain.
fn irradiance_open(normal: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0; i < 9; i++) {
        sum += frame.open[i].rgb * weight_of(i, normal);
    }
    return max(sum, vec3f(0.0));
}

// Light as it arrives at the eye, and from how far.
fn through_air(direction: vec3f, rel: vec3f, distance: f32, light: vec3f) -> vec4f {
    if frame.disc.w == 0.0 {
        return vec4f(light, distance);
    }
    var through = distance;
    if frame.eye.z > frame.climate.z {
        through = min(through, (frame.climate.z - (frame.eye.z + rel.z)) / max(-direction.z, 1e-3));
    }
    let air = veil(direction, through);
    return vec4f(light * air.through + air.light, distance);
}
