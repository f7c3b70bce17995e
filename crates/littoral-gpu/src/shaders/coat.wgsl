// What the ground is seen as where it is not nature: the engine's `picture::cartography`, and pictures laid over it.

// Colours of tints, land and bed; or the picture. Nothing of a shaded relief.
@group(1) @binding(3) var coat_map: texture_2d<f32>;
// Of a picture of which only pages are there: how many levels it has and pages along a side of the atlas that the map then is; of each level texels, columns of pages, and where
// in the table they begin; and of each page its place. No level where the whole picture is there.
@group(1) @binding(13) var<storage, read> pages: array<u32>;

fn is_map() -> bool {
    return frame.coat.x == 1.0 || is_paper();
}

// Albedo of a map at a place and height over the sea (m).
fn tint_at(rel: vec2f, z: f32) -> vec3f {
    if lake_at(rel).depth >= 0.0 {
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
    var size = vec2f(textureDimensions(coat_map));
    if pages[0] > 0u {
        size = vec2f(f32(pages[4]), f32(pages[5]));
    }
    let texels = footprint * sqrt(length(frame.drape.xy * size) * length(frame.drape.zw * size));
    let level = log2(max(texels, 1.0));
    // Cameras' pictures hold light, not albedo: what is white in them reflects about 0.6.
    if pages[0] == 0u {
        return 0.6 * textureSampleLevel(coat_map, smooth_sampler, uv, level).rgb;
    }
    let finer = u32(level);
    return 0.6 * mix(paged(uv, finer), paged(uv, finer + 1u), fract(level));
}

// Texels of a page along a side, all and without those at its border that are the next page's.
const PAGE = 256.0;
const INNER = 254.0;
const ABSENT = 0xffffffffu;

// The picture on a level, or on the next coarser one that is there; the coarsest always is.
fn paged(uv: vec2f, level: u32) -> vec3f {
    var found = vec3f(0.25);
    for (var i = min(level, pages[0] - 1u); i < pages[0]; i++) {
        let head = 4u * (i + 1u);
        let size = vec2f(f32(pages[head]), f32(pages[head + 1u]));
        let texel = uv * size;
        let page = min(floor(texel / INNER), ceil(size / INNER) - 1.0);
        let place = pages[pages[head + 3u] + u32(page.y) * pages[head + 2u] + u32(page.x)];
        if place != ABSENT {
            let corner = vec2f(f32(place % pages[1]), f32(place / pages[1])) * PAGE;
            let at = corner + 1.0 + (texel - page * INNER);
            found = textureSampleLevel(coat_map, smooth_sampler, at / (PAGE * f32(pages[1])), 0.0).rgb;
            break;
        }
    }
    return found;
}

// Even ground of an albedo, its slopes steepened for the light.
fn coated(albedo: vec3f, surface: Surface, footprint: f32, steepening: f32) -> Material {
    let openness = clamp(1.0 - 0.6 * surface.hollow * max(frame.eye.w, footprint), 0.75, 1.0);
    return Material(albedo, normal_of_slope(surface.slope * steepening), openness, 0.0);
}

// Linear light of a hue (degrees), saturation and lightness in sRGB.
fn hsl(hue: f32, saturation: f32, lightness: f32) -> vec3f {
    let k = (vec3f(0.0, 8.0, 4.0) + hue / 30.0) % 12.0;
    let v = lightness - saturation * min(lightness, 1.0 - lightness) * clamp(min(k - 3.0, 9.0 - k), vec3f(-1.0), vec3f(1.0));
    return select(pow((v + 0.055) / 1.055, vec3f(2.4)), v / 12.92, v <= vec3f(0.04045));
}

// Reflectance of a shaded relief at a place and height over the sea (m), for a pixel of this footprint (m).
fn relief_at(rel: vec2f, z: f32, footprint: f32) -> vec3f {
    if lake_at(rel).depth >= 0.0 {
        return frame.lake.rgb;
    }
    let level = frame.tint.y;
    let below = frame.lake.w > 0.0 && z < level && covers(rel);
    let foot = select(level, frame.tint.x, below);
    let top = select(frame.tint.z, level, below);
    let elevation = saturate((z - foot) / max(top - foot, 1e-3));
    // Slopes of three sizes.
    let size = max(frame.eye.w, footprint);
    let extent = (frame.map.zw - 1.0) / frame.map.xy;
    var scales = array<vec2f, 3>(vec2f(1.0, 0.50), vec2f(5.0, 0.32), vec2f(18.0, 0.18));
    var slope = vec2f(0.0);
    for (var i = 0; i < 3; i++) {
        slope += surface_at(rel, min(size * scales[i].x, 0.05 * min(extent.x, extent.y))).slope * scales[i].y;
    }
    slope *= frame.tint.w;
    let normal = normal_of_slope(slope);
    let level_sun = length(frame.sun.xy);
    let to_sun = select(vec2f(-0.7, 0.7), frame.sun.xy / max(level_sun, 1e-30), level_sun > 0.0);
    // Four lights over a quarter turn to either side of the main one, weighed by how far the slope turns from each.
    let steep = length(slope);
    let aspect = select(to_sun, -slope / max(steep, 1e-30), steep > 0.0);
    var turns = array<vec2f, 4>(vec2f(-0.9, 0.7), vec2f(-0.3, 1.0), vec2f(0.35, 1.0), vec2f(0.95, 0.6));
    var sum = 0.0;
    var weights = 0.0;
    for (var i = 0; i < 4; i++) {
        let c = cos(turns[i].x);
        let s = sin(turns[i].x);
        let flat_light = vec2f(to_sun.x * c - to_sun.y * s, to_sun.x * s + to_sun.y * c);
        let along = dot(aspect, flat_light);
        let weight = turns[i].y * (0.35 + 1.0 - along * along);
        sum += weight * max(dot(normal, vec3f(0.77 * flat_light, 0.64)), 0.0);
        weights += weight;
    }
    let single = max(dot(normal, vec3f(0.77 * to_sun, 0.64)), 0.0);
    let shade = 0.45 * sum / weights + 0.55 * single;
    // 0 where flat, towards 1 in full light and -1 in full shade; valleys lie under more air.
    let contrast = select(0.70 + 0.45 * elevation, 0.45 + 0.25 * elevation, below);
    let tone = clamp((shade - 0.64) / 0.36, -1.8, 1.0) * contrast;
    var paper = mix(hsl(86.0, 0.20, 0.69), hsl(42.0, 0.46, 0.82), pow(elevation, 0.7));
    var deep = hsl(238.0, 0.20, 0.27);
    if below {
        paper = hsl(204.0, 0.42, 0.70 + 0.16 * elevation);
        deep = hsl(218.0, 0.45, 0.32);
    }
    if tone > 0.0 {
        return mix(paper, hsl(50.0, 0.85, 0.95), min(tone, 1.0) * 0.75);
    }
    let t = min(-tone, 1.6) / 1.6;
    let half_shaded = mix(paper, hsl(222.0, 0.20, 0.55) * paper * 1.4, min(2.0 * t, 1.0));
    return mix(half_shaded, deep, saturate((t - 0.30) / 0.70) * 0.9);
}
