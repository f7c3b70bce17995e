// Every pixel lit once: from how far away things are to the light they send. The engine's `picture::shade`.

@group(2) @binding(0) var depth_map: texture_depth_2d;
// As far as the sea is, and what its waves are like there: see wave_seen.wgsl.
@group(2) @binding(1) var sea_depth_map: texture_depth_2d;
@group(2) @binding(2) var sea_map: texture_2d<u32>;

@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
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

// A piece of ground to be looked up, and how coarsely.
struct Piece {
    // From the eye (m), and its height over the sea (m).
    rel: vec2f,
    z: f32,
    footprint: f32,
}

struct Ground {
    surface: Surface,
    material: Material,
}

// Called from one place only: it is nearly all of the shader.
fn ground_at(piece: Piece) -> Ground {
    if is_paper() {
        let reflectance = relief_at(piece.rel, piece.z, piece.footprint);
        return Ground(Surface(), Material(reflectance, vec3f(0.0, 0.0, 1.0), 1.0, 0.0));
    }
    let surface = surface_at(piece.rel, piece.footprint);
    if is_map() {
        return Ground(surface, coated(tint_at(piece.rel, piece.z), surface, piece.footprint, frame.tint.w));
    }
    if frame.coat.x == 2.0 {
        return Ground(surface, coated(picture_at(piece.rel, piece.footprint), surface, piece.footprint, 1.0));
    }
    var broad = surface;
    if piece.footprint < 4.0 * frame.eye.w {
        broad = surface_at(piece.rel, 4.0 * frame.eye.w);
    }
    let level = frame.water.x + frame.eye.z;
    // Dry ground below the sea's level is not by the sea.
    let near_water = frame.water.y > 0.0 && (piece.z >= level && piece.z < level + 15.0 || covers(piece.rel));
    let above = select(1e9, piece.z - level, near_water);
    var run_up = 0.0;
    if above > -1.0 && above < 3.0 {
        run_up = run_up_at(piece.rel);
    }
    let site = Site(piece.rel, piece.z, piece.footprint, above, run_up, standing_at(piece.rel));
    return Ground(surface, natural(site, surface, broad));
}

// Light that a piece of ground throws back (kcd/m²), where the eye looks at it along `direction`.
fn lit(piece: Piece, ground: Ground, direction: vec3f) -> vec3f {
    let material = ground.material;
    if is_paper() {
        return mix(frame.mist.rgb, material.albedo, known_at(piece.rel));
    }
    let smooth_normal = normal_of_slope(ground.surface.slope);
    var light = material.albedo / PI * irradiance_at(piece.rel, material.normal) * material.openness;
    if material.wet > 0.0 {
        let mirrored = reflect(direction, smooth_normal);
        let share = fresnel(-dot(direction, smooth_normal)) * material.wet * 0.6;
        light += share * sky_over_land(normalize(vec3f(mirrored.xy, max(mirrored.z, 0.02))));
    }
    // Slopes that turn from the sun hide their own relief from it.
    let facing = max(dot(material.normal, frame.sun.xyz), 0.0) * step_between(-0.02, 0.12, dot(smooth_normal, frame.sun.xyz));
    if facing > 0.0 {
        light += material.albedo / PI * sunlight(piece.z) * (facing * (0.4 + 0.6 * material.openness) * sun_seen(piece.rel));
    }
    return mix(frame.mist.rgb, light, known_at(piece.rel));
}

// The ground seen at a place: how coarsely goes with its slope.
fn piece_seen(direction: vec3f, rel: vec3f, distance: f32) -> Piece {
    let level = u32(clamp(round(log2(max(distance * frame.right.w / frame.eye.w, 1.0))), 0.0, f32(frame.has.x)));
    let place = sample_of(rel.xy);
    let size = 0.7 * f32(1u << level);
    let slope = vec2f(
        mean_of(place + vec2f(size, 0.0), level) - mean_of(place - vec2f(size, 0.0), level),
        mean_of(place + vec2f(0.0, size), level) - mean_of(place - vec2f(0.0, size), level),
    ) * frame.map.xy / (2.0 * size);
    let footprint = footprint_of(distance, select(-dot(direction, normal_of_slope(slope)), -direction.z, is_map()));
    // The height is the data's: a mesh may lie above or below.
    return Piece(rel.xy, mean_of(place, 0u), footprint);
}

// How far a ray from `rel` at a height goes before the land rises into its way (m); negative if it does not.
fn march(rel: vec2f, height: f32, direction: vec3f) -> f32 {
    if direction.z > 0.9 {
        return -1.0;
    }
    var t = 1.5 * frame.eye.w;
    var last = 0.0;
    for (var i = 0; i < 36; i++) {
        let place = sample_of(rel + direction.xy * t);
        if !is_within(place) {
            return -1.0;
        }
        let level = u32(clamp(log2(0.06 * t / frame.eye.w), 0.0, f32(frame.has.x)));
        if mean_of(place, level) > height + direction.z * t && !is_cut_away(rel + direction.xy * t) {
            // Where among the samples: of a cliff its face is seen, and neither its foot nor its top.
            for (var k = 0; k < 8; k++) {
                let middle = 0.5 * (last + t);
                if mean_of(sample_of(rel + direction.xy * middle), 0u) > height + direction.z * middle {
                    t = middle;
                } else {
                    last = middle;
                }
            }
            return t;
        }
        last = t;
        t = t * 1.19 + 0.5 * frame.eye.w;
    }
    return -1.0;
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

// Whether water of a level over the sea (m) at a place is seen, and not the ground, which is at another place: the drawn ground tells which is nearer, but where they are
// near each other it is off by more than the depth of the water, and from far away distances are too coarse. There the data tell.
fn is_water_before(nearer: bool, nearly: bool, at: vec2f, ground: vec2f, level: f32) -> bool {
    let submerged = !is_within(sample_of(at)) || mean_of(sample_of(at), 0u) <= level;
    return submerged && (nearer || nearly && is_within(sample_of(ground)) && mean_of(sample_of(ground), 0u) <= level);
}

// Whether the ground is seen at a place where a ray comes down to a level over the sea (m): the data rise above it there, so that what was drawn farther off lies behind a crest
// that a mesh cut off.
fn is_ground_before(nearer: bool, at: vec2f, level: f32) -> bool {
    return nearer && is_within(sample_of(at)) && known_at(at) == 1.0 && mean_of(sample_of(at), 0u) > level && !is_cut_away(at);
}

struct Water {
    ripples: Ripples,
    // How much of it is foam, and where the water rests, from the eye (m).
    foam: f32,
    rest: vec2f,
    footprint: f32,
    depth: f32,
    // Where the bent ray meets the bed, from the eye (m).
    under: vec2f,
    // Cosine of the bent ray.
    down: f32,
    lake: Lake,
    // Unit vector to what is mirrored, how much of it comes back, and how far away it is (m), negative for the sky.
    mirrored: vec3f,
    share: f32,
    reach: f32,
}

// Depth of a lake or of the still sea at a place (m).
fn depth_of(rel: vec2f, lake: Lake) -> f32 {
    if lake.depth < 0.0 {
        return depth_at(rel);
    }
    return select(lake.depth, lake.level - mean_of(sample_of(rel), 0u), lake.is_sounded);
}

fn water_at(direction: vec3f, rel: vec3f, distance: f32, lake: Lake, pixel: vec2f, waving: bool) -> Water {
    let eye = -direction;
    let footprint = footprint_of(distance, eye.z);
    var ripples: Ripples;
    var foam = 0.0;
    var rest = rel.xy;
    var raised = 0.0;
    if waving {
        let seen = textureLoad(sea_map, vec2i(pixel), 0);
        let more = unpack2x16float(seen.z);
        let across = unpack2x16float(seen.y);
        ripples = Ripples(unpack2x16float(seen.x), vec3f(across.x, more.x, across.y) / 64.0);
        foam = more.y;
        rest -= unpack2x16float(seen.w);
        raised = rel.z + drop_of(rel.xy) - frame.water.x;
    } else {
        ripples = ripples_at(rel.xy, footprint);
    }
    let shown = normal_of_slope(ripples.slope);
    let within = refracted(direction, select(vec3f(0.0, 0.0, 1.0), shown, dot(shown, eye) > 0.02));
    let down = max(-within.z, 0.3);
    let aside = within.xy / down;
    var under = rel.xy;
    var depth = max(depth_of(rel.xy, lake) + raised, 0.0);
    for (var i = 0; i < 3; i++) {
        under = rel.xy + aside * min(depth, 60.0);
        depth = 0.5 * (depth + max(depth_of(under, lake) + raised, 0.0));
    }
    if waving && depth < 0.25 {
        // What waves carry with them as they run up a beach.
        foam = max(foam, 0.7 * step_between(0.1, 0.8, run_up_at(rel.xy)) * (1.0 - step_between(0.0, 0.25, depth)));
    }
    var facet = normal_of_slope(seen_slope(ripples, eye, random_of(pixel)));
    if dot(facet, eye) <= 0.0 {
        facet = vec3f(0.0, 0.0, 1.0);
    }
    var mirrored = 2.0 * dot(facet, eye) * facet - eye;
    // A ray thrown down into the next ripple comes up again, a little higher.
    mirrored.z = select(max(mirrored.z, 0.004), 0.02 - 0.5 * mirrored.z, mirrored.z < 0.0);
    mirrored = normalize(mirrored);
    let reach = march(rel.xy, frame.eye.z + rel.z, mirrored);
    return Water(ripples, foam, rest, footprint, depth, under, down, lake, mirrored, fresnel(dot(facet, eye)), reach);
}

// What the beds of lakes throw back.
const LAKE_MUD = vec3f(0.09, 0.08, 0.055);

// How much of the sun in the water a piece of bed faces.
fn facing_of(normal: vec3f) -> f32 {
    let sun_within = -refracted(-frame.sun.xyz, vec3f(0.0, 0.0, 1.0));
    return clamp(dot(normal, sun_within) / max(sun_within.z, 0.2), 0.3, 1.5);
}

@fragment
fn shade(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let across = frame.corner.xyz + frame.right.xyz * position.x + frame.down.xyz * position.y;
    let direction = normalize(across);
    let depth = textureLoad(depth_map, vec2i(position.xy), 0);
    var rel = across * (frame.corner.w / max(depth, 1e-12));
    var distance = select(length(rel), 1e30, depth == 0.0);
    var is_water = false;
    if has_block() {
        let wall = wall_of(vec3f(0.0), direction);
        if wall.distance > 0.0 && wall.distance < distance * (1.0 + 1e-4) {
            return through_air(direction, direction * wall.distance, wall.distance, wall_seen(wall, direction));
        }
    }
    var waving = false;
    if frame.sea.x > 0.0 {
        let sea = textureLoad(sea_depth_map, vec2i(position.xy), 0);
        let at = across * (frame.corner.w / max(sea, 1e-12));
        let held = !has_block() || all(at.xy >= frame.block.xy) && all(at.xy <= frame.block.zw);
        let level = at.z + frame.eye.z;
        if sea > 0.0 && held && may_be_wet(at.xy) && is_water_before(sea >= depth, sea * NEARLY >= depth, at.xy, rel.xy, level) {
            waving = true;
            is_water = true;
            rel = at;
            distance = length(at);
        } else if sea > 0.0 && is_ground_before(sea > depth, at.xy, level) {
            rel = at;
            distance = length(at);
        }
    }
    let rise = -frame.water.x;
    if frame.water.y > 0.0 && frame.sea.x == 0.0 && rise > 0.0 && direction.z < 0.0 {
        var t = -rise / direction.z;
        let at = direction.xy * t;
        if any(at < frame.land.xy) || any(at > frame.land.zw) {
            t = select(curved(rise, direction), -1.0, has_block());
        }
        let is_before = is_water_before(t <= distance * (1.0 + 1e-6), t <= distance * NEARLY, direction.xy * t, rel.xy, frame.water.x + frame.eye.z);
        if t > 0.0 && is_before && covers(direction.xy * t) {
            is_water = true;
            distance = t;
            rel = direction * t;
        } else if t > 0.0 && is_ground_before(t < distance, direction.xy * t, frame.water.x + frame.eye.z) {
            distance = t;
            rel = direction * t;
        }
    }
    var lake = NO_LAKE;
    if !is_water && distance < 1e29 && !is_map() && !is_side(rel.xy) {
        lake = lake_at(rel.xy);
        is_water = lake.depth >= 0.0;
    }
    if is_water && lake.is_sounded {
        // From where it comes down to the level to the bed a ray stays within the lake.
        let rise = frame.eye.z - lake.level;
        let t = -rise / direction.z;
        let at = direction * t;
        if rise <= 0.0 {
            is_water = false;
        } else if t <= 0.0 || t > distance * (1.0 + 1e-5) {
            // A mesh may lie above water.
            rel.z = -rise;
        } else if lake_at(at.xy).depth >= 0.0 {
            rel = at;
            distance = t;
        } else {
            // A mesh that cuts off the shore, or the side of a void.
            is_water = false;
            if known_at(at.xy) > 0.0 {
                rel = at;
                distance = t;
            }
        }
    }
    if !is_water && has_block() {
        let is_ground = distance < 1e29;
        if is_ground && is_side(rel.xy) {
            if rel.z < frame.floor.x + 0.01 * frame.floor.y {
                return through_air(direction, rel, distance, floor_seen(rel));
            }
            let side = Wall(distance, outward(rel.xy), rel.z, rel.z, rel.xy);
            return through_air(direction, rel, distance, wall_seen(side, direction));
        }
        if !is_ground {
            let t = frame.floor.x / direction.z;
            if direction.z >= 0.0 || t <= 0.0 {
                return vec4f(sky_seen(direction), 0.0);
            }
            return through_air(direction, direction * t, t, floor_seen(direction * t));
        }
    }
    if !is_water && distance > 1e29 {
        distance = curved(-frame.mist.w, direction);
        if frame.mist.w >= 0.0 || distance < 0.0 {
            return vec4f(sky_seen(direction), 0.0);
        }
        rel = direction * distance;
    }
    var light = frame.mist.rgb;

    // Of water first the bed is looked up, then what it mirrors of the land; of ground, itself.
    var water: Water;
    var pieces: array<Piece, 2>;
    var wanted = vec2<bool>(false);
    if is_water {
        water = water_at(direction, rel, distance, lake, position.xy, waving);
        let inside = clamp(water.under, frame.land.xy, frame.land.zw);
        let footprint = max(footprint_of(distance, -direction.z), 0.6 * length(water.under - inside));
        pieces[0] = Piece(inside, frame.water.x + frame.eye.z - water.depth, footprint);
        pieces[1] = Piece(rel.xy + water.mirrored.xy * water.reach, frame.eye.z + rel.z + water.mirrored.z * water.reach, 2.0 * frame.eye.w);
        wanted = vec2<bool>((water.depth < 45.0 && lake.depth < 0.0), (water.reach > 0.0));
    } else if known_at(rel.xy) > 0.0 {
        pieces[0] = piece_seen(direction, rel, distance);
        wanted.x = true;
    }
    var bed = vec3f(0.1);
    if is_water && lake.depth >= 0.0 {
        if !lake.is_sounded {
            bed = LAKE_MUD;
        } else if water.depth < 45.0 {
            let normal = normal_of_slope(surface_at(pieces[0].rel, pieces[0].footprint).slope);
            bed = mix(bed, LAKE_MUD * facing_of(normal), known_at(pieces[0].rel));
        }
    }
    var mirrored_land = vec3f(0.0);
    for (var i = 0; i < 2; i++) {
        if !wanted[i] {
            continue;
        }
        let piece = pieces[i];
        let ground = ground_at(piece);
        if is_water && i == 0 {
            bed = mix(vec3f(0.1), ground.material.albedo * facing_of(ground.material.normal), known_at(piece.rel));
            continue;
        }
        let back = lit(piece, ground, select(direction, water.mirrored, is_water));
        if is_water {
            mirrored_land = back;
        } else {
            light = back;
        }
    }
    if is_water {
        light = water_seen(water, direction, rel, bed, mirrored_land);
    }
    return through_air(direction, rel, distance, light);
}

// What fresh foam throws back (C. Whitlock, D. Bartlett, E. Gurganus 1982, beyond the blue).
const FOAM = vec3f(0.58, 0.60, 0.62);

// The light that water sends, over a bed that throws back `bed`.
fn water_seen(water: Water, direction: vec3f, rel: vec3f, bed: vec3f, mirrored_land: vec3f) -> vec3f {
    let sun_within = -refracted(-frame.sun.xyz, vec3f(0.0, 0.0, 1.0));
    let sun = max(frame.sun.z, 0.0);
    let direct_share = select(1.0, sun_seen(rel.xy), all(rel.xy >= frame.land.xy) && all(rel.xy <= frame.land.zw));
    let direct = sunlight(frame.eye.z + rel.z) * (sun * (1.0 - fresnel(sun)) * direct_share);
    let diffuse = irradiance_open(vec3f(0.0, 0.0, 1.0)) * 0.93;
    let down = select(water.down, 0.8, water.lake.depth >= 0.0 && !water.lake.is_sounded);
    let up = from_below(water.depth, max(sun_within.z, 0.5), down, direct + diffuse, bed);
    var mirrored = sky_over_land(water.mirrored);
    if water.reach > 0.0 {
        mirrored = mirrored_land;
        if frame.disc.w > 0.0 {
            let air = veil(water.mirrored, water.reach);
            mirrored = mirrored * air.through + air.light;
        }
    }
    // The last film of water mirrors no more than wet sand.
    let film = step_between(0.0, 0.05, water.depth);
    var light = up * ((1.0 - water.share) / 0.98);
    if frame.sun.z > 0.0 {
        light += sunlight(0.0) * (glitter(-direction, frame.sun.xyz, water.ripples) * film * direct_share);
    }
    var white = 0.0;
    if water.foam > 0.0 {
        white = lace(water.rest, water.footprint, water.foam);
        let normal = normal_of_slope(water.ripples.slope);
        let sunny = sunlight(0.0) * (max(dot(normal, frame.sun.xyz), 0.0) * direct_share);
        light = mix(light, FOAM / PI * (irradiance_open(normal) + sunny), white);
    }
    light += mirrored * (water.share * (0.5 + 0.5 * film) * (1.0 - white));
    let open = select(step_between(0.15, 0.85, beyond(rel.xy).wet), known_at(rel.xy), water.lake.depth >= 0.0);
    return mix(frame.mist.rgb, light, open);
}
