// The land as a block cut clean where the data ends, on a level floor: the engine's `picture::block`.

const PLASTER_CUT = vec3f(0.300, 0.275, 0.245);

fn has_block() -> bool {
    return frame.floor.z > 0.0;
}

// Whether the sample next to a place is cut away.
fn is_cut_away(rel: vec2f) -> bool {
    if frame.floor.w == 0.0 {
        return false;
    }
    let last = vec2i(frame.map.zw) - 1;
    return textureLoad(known_map, clamp(vec2i(round(sample_of(rel))), vec2i(0), last), 0).y > 0.0;
}

// Whether the surface at a place is a side of the block: part of it is cut away.
fn is_side(rel: vec2f) -> bool {
    let place = sample_of(rel);
    if frame.floor.w == 0.0 || !is_within(place) {
        return false;
    }
    let ij = min(vec2i(place), vec2i(frame.map.zw) - 2);
    let sum = textureLoad(known_map, ij, 0).y + textureLoad(known_map, ij + vec2i(1, 0), 0).y
        + textureLoad(known_map, ij + vec2i(0, 1), 0).y + textureLoad(known_map, ij + 1, 0).y;
    return sum > 0.0;
}

// Out of the block where it is cut away beside a place. The stairs of the samples are smoothed.
fn outward(rel: vec2f) -> vec3f {
    var sum = vec2f(0.0);
    for (var j = -4; j <= 4; j++) {
        for (var i = -4; i <= 4; i++) {
            let offset = vec2f(f32(i), f32(j)) / frame.map.xy;
            sum += select(vec2f(0.0), offset, is_cut_away(rel + offset));
        }
    }
    return vec3f(select(vec2f(0.0, -1.0), normalize(sum), length(sum) > 0.0), 0.0);
}

// Distances at which a ray from `from` enters the block's column of space and leaves it; no span where it leaves first. And the axis of the side it enters by.
struct Span {
    enter: f32,
    leave: f32,
    normal: vec3f,
}

fn span_of(from_: vec2f, direction: vec3f) -> Span {
    let along = select(direction.xy, vec2f(1e-12), abs(direction.xy) < vec2f(1e-12));
    let a = (frame.block.xy - from_) / along;
    let b = (frame.block.zw - from_) / along;
    let near = min(a, b);
    let far = max(a, b);
    let normal = select(vec3f(-sign(along.x), 0.0, 0.0), vec3f(0.0, -sign(along.y), 0.0), near.y > near.x);
    return Span(max(near.x, near.y), min(far.x, far.y), normal);
}

struct Wall {
    // Negative for none (m).
    distance: f32,
    normal: vec3f,
    // Heights over the eye of the wall's point and of the ground above it (m).
    z: f32,
    ground: f32,
    rel: vec2f,
}

// Just within the block.
fn inside_block(rel: vec2f) -> vec2f {
    let room = 1e-4 / frame.map.xy;
    return clamp(rel, frame.block.xy + room, frame.block.zw - room);
}

// The cut that a ray from outside meets before any ground.
fn wall_of(from_: vec3f, direction: vec3f) -> Wall {
    let span = span_of(from_.xy, direction);
    var wall = Wall(-1.0, span.normal, 0.0, 0.0, vec2f(0.0));
    if !(span.enter > 0.0 && span.enter <= span.leave) {
        return wall;
    }
    wall.rel = inside_block(from_.xy + direction.xy * span.enter);
    wall.z = from_.z + direction.z * span.enter;
    wall.ground = select(mean_of(sample_of(wall.rel), 0u) - frame.eye.z, frame.floor.x, is_cut_away(wall.rel));
    let in_water = frame.water.y > 0.0 && wall.z <= frame.water.x && covers(wall.rel);
    if wall.z > frame.floor.x && (wall.z <= wall.ground || in_water) {
        wall.distance = span.enter;
    }
    return wall;
}

// Light of the cut (kcd/m²), seen along `direction`.
fn wall_seen(wall: Wall, direction: vec3f) -> vec3f {
    if is_paper() {
        return frame.mist.rgb * (0.62 + 0.12 * max(dot(wall.normal, frame.sun.xyz), 0.0));
    }
    let known = known_at(wall.rel);
    if wall.z > wall.ground {
        // Looking into water through its side: it glows as deep water does, less the deeper the less light comes down.
        let below_surface = irradiance_open(vec3f(0.0, 0.0, 1.0)) + sunlight(0.0) * max(frame.sun.z, 0.0);
        let depth = frame.water.x - wall.z;
        let column = max(frame.water.x - wall.ground, 1e-3);
        let dim = 0.45 + 0.55 * exp(-1.6 * depth / column);
        let share = fresnel(-dot(direction, wall.normal));
        let mirrored = reflect(direction, wall.normal);
        let sheen = sky_over_land(normalize(vec3f(mirrored.xy, max(mirrored.z, 0.02))));
        let glow = from_below(60.0, 0.8, 0.8, below_surface, vec3f(0.0)) * (2.2 * dim);
        return mix(frame.mist.rgb, glow + sheen * (0.5 * share), known);
    }
    let facing = max(dot(wall.normal, frame.sun.xyz), 0.0);
    let light = PLASTER_CUT / PI * (irradiance_open(wall.normal) + sunlight(0.0) * facing);
    return mix(frame.mist.rgb, light, known);
}

// Light of the floor, in the block's shadow or out of it.
fn floor_seen(rel: vec3f) -> vec3f {
    if is_paper() {
        return frame.mist.rgb;
    }
    let beside = clamp(rel.xy, frame.block.xy, frame.block.zw);
    let away = length(rel.xy - beside);
    let thickness = frame.floor.y;
    // What a long wall as high as the block is thick hides of an even sky.
    let openness = select(1.0 - 0.4 * (1.0 - away / length(vec2f(away, thickness))), 1.0, is_cut_away(beside));
    var sky = irradiance_open(vec3f(0.0, 0.0, 1.0)) * openness;
    // A studio is lit evenly: half of the sky's blue is left.
    sky = mix(sky, vec3f(dot(sky, vec3f(0.2126, 0.7152, 0.0722))), 0.5);
    var sun = vec3f(0.0);
    if frame.sun.z > 0.0 && wall_of(rel, frame.sun.xyz).distance < 0.0 {
        // Over the edge of the block, and then over its hills.
        let span = span_of(rel.xy, frame.sun.xyz);
        var hidden = false;
        if span.leave > 0.0 && span.enter <= span.leave {
            let start = max(span.enter, 0.0) + 1e-3;
            let at = rel + frame.sun.xyz * start;
            hidden = march(at.xy, at.z + frame.eye.z, frame.sun.xyz) > 0.0;
        }
        sun = select(sunlight(0.0) * frame.sun.z, vec3f(0.0), hidden);
    }
    return frame.coat.y / PI * (sky + sun);
}
