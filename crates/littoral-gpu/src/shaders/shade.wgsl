// Every pixel lit once: from how far away things are to the light they send. The engine's `picture::shade`.

@group(0) @binding(15) var depth_map: texture_depth_2d;

@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// Width of a pixel at a distance on something whose normal makes this cosine with the eye (m).
fn footprint_of(distance: f32, cosine: f32) -> f32 {
    return max(distance * frame.right.w * sqrt(1.0 / max(cosine, 0.02)) * 0.65, 1e-4);
}

// Distance along a unit direction to a level surface `rise` metres below, bent with the Earth; negative for none.
fn curved(rise: f32, direction: vec3f) -> f32 {
    if direction.z >= 0.0 {
        return -1.0;
    }
    let bend = dot(direction.xy, direction.xy) / (2.0 * EARTH);
    let square = direction.z * direction.z - 4.0 * bend * rise;
    if square < 0.0 {
        return -1.0;
    }
    return 2.0 * rise / (-direction.z + sqrt(square));
}

fn material_at(rel: vec2f, z: f32, surface: Surface, footprint: f32) -> Material {
    let broad = surface_at(rel, max(4.0 * frame.eye.w, footprint));
    let level = frame.water.x + frame.eye.z;
    let near_water = frame.water.y > 0.0 && (z < level + 15.0 || covers(rel));
    let above = select(1e9, z - level, near_water);
    return natural(Site(rel, z, footprint, above, 0.0, standing_at(rel)), surface, broad);
}

fn ground_seen(direction: vec3f, rel: vec3f, distance: f32) -> vec3f {
    let known = known_at(rel.xy);
    if known == 0.0 {
        return frame.mist.rgb;
    }
    let z = frame.eye.z + rel.z;
    let level = u32(clamp(round(log2(max(distance * frame.right.w / frame.eye.w, 1.0))), 0.0, f32(frame.has.x)));
    let cosine = -dot(direction, normal_of_slope(surface_of(sample_of(rel.xy), level).slope));
    let footprint = footprint_of(distance, cosine);
    let surface = surface_at(rel.xy, footprint);
    let smooth_normal = normal_of_slope(surface.slope);
    let material = material_at(rel.xy, z, surface, footprint);
    var light = material.albedo / PI * irradiance_at(rel.xy, material.normal) * material.openness;
    if material.wet > 0.0 {
        let mirrored = reflect(direction, smooth_normal);
        let share = fresnel(-dot(direction, smooth_normal)) * material.wet * 0.6;
        light += share * sky_over_land(normalize(vec3f(mirrored.xy, max(mirrored.z, 0.02))));
    }
    // Slopes that turn from the sun hide their own relief from it.
    let facing = max(dot(material.normal, frame.sun.xyz), 0.0) * step_between(-0.02, 0.12, dot(smooth_normal, frame.sun.xyz));
    if facing > 0.0 {
        light += material.albedo / PI * sunlight(z) * (facing * (0.4 + 0.6 * material.openness) * sun_seen(rel.xy));
    }
    return mix(frame.mist.rgb, light, known);
}

// The land as it looks from afar, mirrored in water.
fn land_mirrored(rel: vec2f, z: f32) -> vec3f {
    let footprint = 2.0 * frame.eye.w;
    let surface = surface_at(rel, footprint);
    let material = material_at(rel, z, surface, footprint);
    let sun = sunlight(z) * (max(dot(material.normal, frame.sun.xyz), 0.0) * sunny_at(rel));
    let sky = irradiance_at(rel, material.normal) * material.openness;
    return mix(frame.mist.rgb, material.albedo / PI * (sun + sky), known_at(rel));
}

// What water mirrors along a ray that leaves it: the land if it rises into the ray's way, else the sky.
fn mirrored_in(rel: vec2f, direction: vec3f) -> vec3f {
    let flat_length = length(direction.xy);
    let start = frame.eye.z + frame.water.x;
    var t = 1.5 * frame.eye.w;
    var last = 0.0;
    if direction.z < 0.9 {
        for (var i = 0; i < 40; i++) {
            let at = rel + direction.xy * t;
            let place = sample_of(at);
            if !is_within(place) || t > 6e4 {
                break;
            }
            let level = u32(clamp(log2(0.06 * t / frame.eye.w), 0.0, f32(frame.has.x)));
            if mean_of(place, level) > start + direction.z * t {
                // Closed in on.
                var far = t;
                for (var k = 0; k < 4; k++) {
                    let middle = 0.5 * (last + far);
                    if mean_of(sample_of(rel + direction.xy * middle), level) > start + direction.z * middle {
                        far = middle;
                    } else {
                        last = middle;
                    }
                }
                let light = land_mirrored(rel + direction.xy * far, start + direction.z * far);
                if frame.disc.w == 0.0 {
                    return light;
                }
                let air = veil(direction, far);
                return light * air.through + air.light;
            }
            last = t;
            t = t * 1.16 + 0.5 * frame.eye.w / max(flat_length, 0.1);
        }
    }
    return sky_over_land(direction);
}

// Two normal numbers of a pixel and the number of the frame; nought in the first.
fn random_of(pixel: vec2f) -> vec2f {
    if frame.down.w == 0.0 {
        return vec2f(0.0);
    }
    let h = hash(vec3u(vec2u(pixel), u32(frame.down.w)), 977u);
    let u = (f32(h >> 8u) + 0.5) / 16777216.0;
    let v = f32(hash(vec3u(vec2u(pixel), u32(frame.down.w)), 1409u) >> 8u) / 16777216.0;
    let r = sqrt(-2.0 * log(u));
    return r * vec2f(cos(2.0 * PI * v), sin(2.0 * PI * v));
}

fn water_seen(direction: vec3f, rel: vec3f, distance: f32, pixel: vec2f) -> vec3f {
    let eye = -direction;
    let footprint = footprint_of(distance, eye.z);
    let ripples = ripples_at(rel.xy, footprint);
    let shown = normal_of_slope(ripples.slope);
    // Into the water, to where the bent ray meets the bed.
    let within = refracted(direction, select(vec3f(0.0, 0.0, 1.0), shown, dot(shown, eye) > 0.02));
    let down = max(-within.z, 0.3);
    let aside = within.xy / down;
    var under = rel.xy;
    var depth = max(depth_at(rel.xy), 0.0);
    for (var i = 0; i < 3; i++) {
        under = rel.xy + aside * min(depth, 60.0);
        depth = 0.5 * (depth + max(depth_at(under), 0.0));
    }
    let sun_within = -refracted(-frame.sun.xyz, vec3f(0.0, 0.0, 1.0));
    var bed = vec3f(0.1);
    if depth < 45.0 {
        let inside = clamp(under, frame.land.xy, frame.land.zw);
        let away = length(under - inside);
        let surface = surface_at(inside, max(footprint, 0.6 * away));
        let material = material_at(under, frame.water.x + frame.eye.z - depth, surface, footprint);
        let facing = clamp(dot(material.normal, sun_within) / max(sun_within.z, 0.2), 0.3, 1.5);
        let known = select(known_at(under), 1.0, away > 0.0);
        bed = mix(vec3f(0.1), material.albedo * facing, known);
    }
    let sun = max(frame.sun.z, 0.0);
    let sun_cosine = max(sun_within.z, 0.5);
    let lit = select(1.0, sun_seen(rel.xy), all(rel.xy >= frame.land.xy) && all(rel.xy <= frame.land.zw));
    let direct = sunlight(0.0) * (sun * (1.0 - fresnel(sun)) * lit);
    let diffuse = irradiance_open(vec3f(0.0, 0.0, 1.0)) * 0.93;
    let up = from_below(depth, sun_cosine, down, direct + diffuse, bed);

    var facet = normal_of_slope(seen_slope(ripples, eye, random_of(pixel)));
    if dot(facet, eye) <= 0.0 {
        facet = vec3f(0.0, 0.0, 1.0);
    }
    let share = fresnel(dot(facet, eye));
    var mirrored = 2.0 * dot(facet, eye) * facet - eye;
    // A ray thrown down into the next ripple comes up again, a little higher.
    mirrored.z = select(max(mirrored.z, 0.004), 0.02 - 0.5 * mirrored.z, mirrored.z < 0.0);
    // The last film of water mirrors no more than wet sand.
    let film = step_between(0.0, 0.05, depth);
    var light = up * ((1.0 - share) / 0.98);
    light += mirrored_in(rel.xy, normalize(mirrored)) * (share * (0.5 + 0.5 * film));
    if frame.sun.z > 0.0 {
        light += sunlight(0.0) * (glitter(eye, frame.sun.xyz, ripples) * film * lit);
    }
    let open = step_between(0.15, 0.85, beyond(rel.xy).wet);
    return mix(frame.mist.rgb, light, open);
}

@fragment
fn shade(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let across = frame.corner.xyz + frame.right.xyz * position.x + frame.down.xyz * position.y;
    let direction = normalize(across);
    let depth = textureLoad(depth_map, vec2i(position.xy), 0);
    var rel = across * (frame.corner.w / max(depth, 1e-12));
    var ground = length(rel);
    if depth == 0.0 {
        ground = 1e30;
    }
    var light = vec3f(0.0);
    var distance = ground;
    var is_water = false;
    let rise = -frame.water.x;
    if frame.water.y > 0.0 && rise > 0.0 && direction.z < 0.0 {
        let level = -rise / direction.z;
        let at = direction.xy * level;
        var t = level;
        if any(at < frame.land.xy) || any(at > frame.land.zw) {
            t = curved(rise, direction);
        }
        if t > 0.0 && t <= ground * (1.0 + 1e-6) && covers(direction.xy * t) {
            is_water = true;
            distance = t;
            rel = direction * t;
        }
    }
    if is_water {
        light = water_seen(direction, rel, distance, position.xy);
    } else if ground < 1e29 {
        light = ground_seen(direction, rel, distance);
    } else {
        let t = curved(-frame.mist.w, direction);
        if frame.mist.w >= 0.0 || t < 0.0 {
            return vec4f(sky_seen(direction), 0.0);
        }
        distance = t;
        rel = direction * t;
        light = frame.mist.rgb;
    }
    if frame.disc.w > 0.0 {
        var through = distance;
        if frame.eye.z > frame.climate.z {
            through = min(through, (frame.climate.z - (frame.eye.z + rel.z)) / max(-direction.z, 1e-3));
        }
        let air = veil(direction, through);
        light = light * air.through + air.light;
    }
    return vec4f(light, distance);
}
