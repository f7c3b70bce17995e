// Light on and in water: the engine's `picture::sea`, and what of `picture::shade` belongs to it.

// Red: 1 where ground below the water's level is wet, at least a half where waves may get to ground above it; green, over 255: 0 where there is no lake, up to
// FARTHEST the distance to the shore of one whose bed is unknown, in samples, above that the number of one that was filled.
@group(1) @binding(10) var basin_map: texture_2d<f32>;
// Beyond the land: depth (m) and share of water, by place along the border and distance from it.
@group(1) @binding(11) var rim_map: texture_2d<f32>;
// How high swash reaches above still water (m).
@group(3) @binding(0) var run_up_map: texture_2d<f32>;

const INDEX = 1.34;

// Whether a place lies in the water's basin.
fn covers(rel: vec2f) -> bool {
    let place = frame.basin.xy + rel * frame.basin.zw;
    if any(place < vec2f(0.0)) || any(place > frame.basin_size.xy - 1.0) {
        return frame.water.z > 0.0;
    }
    return textureLoad(basin_map, vec2i(round(place)), 0).x > 0.9;
}

// Whether waves may get to a place: it lies in still water, or on a shore that rises from it.
fn may_be_wet(rel: vec2f) -> bool {
    if covers(rel) {
        return true;
    }
    let place = frame.basin.xy + rel * frame.basin.zw;
    let inside = all(place >= vec2f(0.0)) && all(place <= frame.basin_size.xy - 1.0);
    return inside && textureLoad(basin_map, vec2i(round(place)), 0).x > 0.3
        && mean_of(sample_of(rel), 0u) >= frame.water.x + frame.eye.z;
}

// How high waves run up above still water at a place (m): 0 away from shores.
fn run_up_at(rel: vec2f) -> f32 {
    let p = frame.run_up.xy + rel * frame.run_up.zw;
    let last = vec2f(textureDimensions(run_up_map)) - 1.0;
    if frame.sea.x == 0.0 || any(p < vec2f(0.0)) || any(p > last) || any(last < vec2f(1.0)) {
        return 0.0;
    }
    let ij = vec2i(min(floor(p), last - 1.0));
    let f = p - vec2f(ij);
    let south = mix(textureLoad(run_up_map, ij, 0).x, textureLoad(run_up_map, ij + vec2i(1, 0), 0).x, f.x);
    let north = mix(textureLoad(run_up_map, ij + vec2i(0, 1), 0).x, textureLoad(run_up_map, ij + 1, 0).x, f.x);
    return mix(south, north, f.y);
}

const FARTHEST = 223.0;

struct Lake {
    // Depth (m), negative where there is no lake, and level (m).
    depth: f32,
    level: f32,
    // Whether its bed is known.
    is_sounded: bool,
}

const NO_LAKE = Lake(-1.0, 0.0, false);

// The lake at a place. Its edge is the contour of its bed; where that is unknown, of the ground a few centimetres above its level.
fn lake_at(rel: vec2f) -> Lake {
    let p = frame.basin.xy + rel * frame.basin.zw;
    if frame.basin_size.z == 0.0 || any(p < vec2f(0.0)) || any(p > frame.basin_size.xy - 1.0) {
        return NO_LAKE;
    }
    let ij = min(vec2i(p), vec2i(frame.basin_size.xy) - 2);
    let f = p - vec2f(ij);
    let a = textureLoad(basin_map, ij, 0).y;
    let b = textureLoad(basin_map, ij + vec2i(1, 0), 0).y;
    let c = textureLoad(basin_map, ij + vec2i(0, 1), 0).y;
    let d = textureLoad(basin_map, ij + 1, 0).y;
    let most = max(max(a, b), max(c, d));
    if most == 0.0 {
        return NO_LAKE;
    }
    let ground = mean_of(sample_of(rel), 0u);
    let number = round(most * 255.0) - FARTHEST;
    if number > 0.0 {
        let i = u32(number) - 1u;
        let level = frame.lake_levels[i / 4u][i % 4u];
        return Lake(level - ground, level, true);
    }
    var wet = vec2f(1.0, 1.0);
    if a > 0.0 {
        wet = vec2f(0.0);
    } else if b > 0.0 {
        wet = vec2f(1.0, 0.0);
    } else if c > 0.0 {
        wet = vec2f(0.0, 1.0);
    }
    let level = mean_of(sample_of(rel + (wet - f) / frame.basin.zw), 0u);
    if ground > level + 0.05 {
        return NO_LAKE;
    }
    let to_shore = mix(mix(a, b, f.x), mix(c, d, f.x), f.y) * 255.0 / max(frame.basin.z, frame.basin.w);
    return Lake(min(0.07 * to_shore, 30.0), level, false);
}

// Depth (m) and share of water beyond the border, by how far away that is.
struct Beyond {
    away: f32,
    depth: f32,
    wet: f32,
}

fn beyond(rel: vec2f) -> Beyond {
    let inside = clamp(rel, frame.land.xy, frame.land.zw);
    let away = distance(rel, inside);
    if away == 0.0 {
        return Beyond(0.0, 0.0, 1.0);
    }
    let extent = frame.land.zw - frame.land.xy;
    let p = inside - frame.land.xy;
    var along = 2.0 * extent.x + extent.y + (extent.y - p.y);
    if rel.y <= frame.land.y {
        along = p.x;
    } else if rel.x >= frame.land.z {
        along = extent.x + p.y;
    } else if rel.y >= frame.land.w {
        along = extent.x + extent.y + (extent.x - p.x);
    }
    let size = vec2f(textureDimensions(rim_map));
    let row = min(log(away / (frame.water.w * 1e-4) + 1.0) / 0.35, size.y - 1.0);
    let column = along / (2.0 * (extent.x + extent.y)) * size.x;
    let i = i32(floor(column));
    let j = min(i32(row), i32(size.y) - 2);
    let f = vec2f(column - floor(column), row - f32(j));
    let n = i32(size.x);
    let a = mix(textureLoad(rim_map, vec2i(i % n, j), 0).xy, textureLoad(rim_map, vec2i((i + 1) % n, j), 0).xy, f.x);
    let b = mix(textureLoad(rim_map, vec2i(i % n, j + 1), 0).xy, textureLoad(rim_map, vec2i((i + 1) % n, j + 1), 0).xy, f.x);
    let found = mix(a, b, f.y);
    return Beyond(away, found.x, found.y);
}

// Depth of still water (m), negative where the ground is higher. Beyond the land the bed sinks on.
fn depth_at(rel: vec2f) -> f32 {
    let out = beyond(rel);
    if out.away > 0.0 {
        return out.depth + 0.03 * out.away;
    }
    return min(frame.water.x + frame.eye.z - mean_of(sample_of(rel), 0u), 1e4);
}

fn fresnel(cosine: f32) -> f32 {
    let c = saturate(cosine);
    let t = sqrt(max(1.0 - (1.0 - c * c) / (INDEX * INDEX), 0.0));
    let s = (c - INDEX * t) / (c + INDEX * t);
    let p = (INDEX * c - t) / (INDEX * c + t);
    return 0.5 * (s * s + p * p);
}

// Direction within the water of a ray that meets it from above.
fn refracted(direction: vec3f, normal: vec3f) -> vec3f {
    let cosine = -dot(direction, normal);
    let k = 1.0 - (1.0 - cosine * cosine) / (INDEX * INDEX);
    return direction / INDEX + normal * (cosine / INDEX - sqrt(max(k, 0.0)));
}

struct Ripples {
    slope: vec2f,
    // Covariances (xx, xy, yy) of the slopes that a pixel cannot show.
    hidden: vec3f,
}

fn bell(x: f32) -> f32 {
    return 0.3989423 * exp(-0.5 * x * x);
}

// Share of the normal distribution below x (Abramowitz and Stegun 26.2.17).
fn below(x: f32) -> f32 {
    let a = abs(x);
    let t = 1.0 / (1.0 + 0.2316419 * a);
    let tail = bell(a) * t * (0.31938153 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429))));
    return select(1.0 - tail, tail, x < 0.0);
}

// Mean and standard deviation of the slopes along a horizontal unit direction.
fn along_of(r: Ripples, d: vec2f) -> vec2f {
    let square = r.hidden.x * d.x * d.x + 2.0 * r.hidden.y * d.x * d.y + r.hidden.z * d.y * d.y;
    return vec2f(dot(r.slope, d), sqrt(max(square, 1e-8)));
}

fn flat_of(v: vec3f) -> vec2f {
    let l = length(v.xy);
    return select(vec2f(1.0, 0.0), v.xy / max(l, 1e-12), l > 1e-12);
}

// Area of the facets turned towards a unit direction, as seen from there, per area of still water.
fn seen_from(r: Ripples, eye: vec3f) -> f32 {
    let along = along_of(r, flat_of(eye));
    let flat_eye = length(eye.xy);
    let above = eye.z - flat_eye * along.x;
    let spread = max(flat_eye * along.y, 1e-6);
    return above * below(above / spread) + spread * bell(above / spread);
}

// A slope drawn from those turned towards a unit direction (E. Heitz and E. d'Eon 2014), for two normal numbers.
fn seen_slope(r: Ripples, eye: vec3f, random: vec2f) -> vec2f {
    let along = flat_of(eye);
    let across = vec2f(-along.y, along.x);
    let m = along_of(r, along);
    let flat_eye = length(eye.xy);
    let edge = clamp((eye.z - flat_eye * m.x) / max(flat_eye * m.y, 1e-6), -6.0, 1e4);
    let whole = edge * below(edge) + bell(edge);
    let wanted = below(random.x) * whole;
    var low = -7.0;
    var high = min(edge, 7.0);
    var p = clamp(random.x, low, high);
    for (var i = 0; i < 6; i++) {
        let off = edge * below(p) + bell(p) - wanted;
        if off > 0.0 {
            high = p;
        } else {
            low = p;
        }
        let next = p - off / max((edge - p) * bell(p), 1e-9);
        p = select(0.5 * (low + high), next, next > low && next < high);
    }
    let covariance = along.x * (r.hidden.x * across.x + r.hidden.y * across.y) + along.y * (r.hidden.y * across.x + r.hidden.z * across.y);
    let n = along_of(r, across);
    let follow = covariance / m.y;
    let left = sqrt(max(n.y * n.y - follow * follow, 0.0));
    return along * (m.x + m.y * p) + across * (n.x + follow * p + left * random.y);
}

fn density_of(r: Ripples, slope: vec2f) -> f32 {
    let area = max(r.hidden.x * r.hidden.z - r.hidden.y * r.hidden.y, 1e-12);
    let d = slope - r.slope;
    let exponent = (r.hidden.z * d.x * d.x - 2.0 * r.hidden.y * d.x * d.y + r.hidden.x * d.y * d.y) / area;
    return exp(-0.5 * exponent) / (2.0 * PI * sqrt(area));
}

// Radiance of the sun's glitter per sunlight on a facing surface (1/sr): C. Cox and W. Munk 1954.
fn glitter(eye: vec3f, sun: vec3f, r: Ripples) -> f32 {
    let h = normalize(eye + sun);
    if h.z < 0.05 {
        return 0.0;
    }
    let density = density_of(r, -h.xy / h.z);
    let lit = saturate(sun.z / max(seen_from(r, sun), 1e-4));
    return fresnel(dot(eye, h)) * density * lit / (4.0 * max(seen_from(r, eye), 1e-3) * h.z * h.z * h.z * h.z);
}

// The ripples of a light air.
fn ripples_at(rel: vec2f, footprint: f32) -> Ripples {
    var lanes = 0.0;
    for (var k = 0u; k < 3u; k++) {
        lanes += patch_of(42u + k, rel, 0.0, footprint) * (1.0 - 0.3 * f32(k));
    }
    let strength = clamp(0.85 + 1.1 * lanes, 0.25, 1.8);
    var slope = vec2f(0.0);
    var variance = 4.0e-4;
    for (var octave = 0u; octave < 9u; octave++) {
        let amplitude = 0.020 * strength * select(1.0, 0.45, octave < 2u);
        let share = resolved(frame.noise[33u + octave].wavelength, footprint);
        if share > 0.0 {
            let g = grain(33u + octave, rel, 0.37).gradient;
            let turn = 0.35 + 0.9 * f32(octave);
            let s = sin(turn);
            let c = cos(turn);
            let d = vec2f(g.x, 0.55 * g.y);
            slope += vec2f(d.x * c - d.y * s, d.x * s + d.y * c) * (amplitude * share);
        }
        variance += 0.45 * amplitude * amplitude * (1.0 - share * share);
    }
    return Ripples(slope, vec3f(variance, 0.0, variance));
}

// The x with a share of the normal distribution below it (Abramowitz and Stegun 26.2.23).
fn quantile(share: f32) -> f32 {
    let p = clamp(share, 1e-6, 1.0 - 1e-6);
    let t = sqrt(-2.0 * log(min(p, 1.0 - p)));
    let x = t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
    return select(x, -x, p < 0.5);
}

// How much of a pixel is white where `cover` of the water about it is foam: threads and holes, carried by the water that rests at a place.
fn lace(rest: vec2f, footprint: f32, cover: f32) -> f32 {
    if cover <= 0.002 {
        return 0.0;
    }
    var shares = array<f32, 7>(0.20, 0.14, 0.18, 0.18, 0.14, 0.09, 0.07);
    var sum = 0.0;
    var left = 1.0;
    for (var i = 0u; i < 7u; i++) {
        let shown = resolved(frame.noise[48u + i].wavelength, footprint);
        if shown == 0.0 {
            continue;
        }
        let noise = value_of(48u + i, rest, 0.31) / sqrt(0.074);
        var score = noise;
        if i >= 2u && i <= 4u {
            score = quantile(2.0 - 2.0 * below(abs(noise)));
        }
        sum += score * shown * sqrt(shares[i]);
        left -= shares[i] * shown * shown;
    }
    let soft = max(left, 0.05);
    return below((sum * sqrt(min((1.0 - soft) / max(1.0 - left, 1e-3), 1.0)) - quantile(1.0 - cover)) / sqrt(soft));
}

// Radiance leaving the surface for irradiance just under it, over a bed of this depth that throws back `bed` of it.
fn from_below(depth: f32, sun_cosine: f32, eye_cosine: f32, below_surface: vec3f, bed: vec3f) -> vec3f {
    let path = max(depth, 0.0) * (1.0 / sun_cosine + 1.05 / eye_cosine);
    let at = min(sqrt(path / 160.0), 1.0) * 256.0;
    let u = (at + 0.5) / 257.0;
    let own = textureSampleLevel(media_map, smooth_sampler, vec2f(u, 1.0 / 6.0), 0.0).rgb;
    let left = textureSampleLevel(media_map, smooth_sampler, vec2f(u, 0.5), 0.0).rgb;
    return (own + left * bed / PI) * below_surface * 0.54;
}
