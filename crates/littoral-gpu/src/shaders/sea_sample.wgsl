// The sea at any place: what littoral::waves::WaveModel answers of a sea of tiles, from the textures that GpuSea keeps.
//
// To be put before a shader, after GROUP is replaced by the number of the bind group (littoral_gpu::sea::sample_source). Places are those of the
// water at rest, east and north in metres from the origin that GpuSea::set_origin was told; at r metres from it they are right to 10⁻⁷ r.
// Between samples stand bicubic Hermite patches; of two neighbouring levels of detail a footprint takes a mixture, as the processor does.

struct SeaTile {
    // Where the origin lies, in parts of the sides.
    corner: vec2f,
    // Cosine and sine of the angle by which the tile's axes are turned.
    turn: vec2f,
    // Of its sides (m).
    length: f32,
    // One over the footprint from which on waves are left out (1/m).
    fineness: f32,
    levels: u32,
    // Layer of its foam, or −1.
    foam: i32,
    // One over the standard deviation of the heights of all tiles before (1/m); 0 where there are none.
    raised: f32,
    // One over that of the slopes of all tiles after the first with foam; 0 where there are none.
    torn: f32,
    // Along a side, at level 0.
    samples: u32,
    unused: u32,
    // Variances to be expected of the slopes of each level's waves, and 0 after the last: xx, xy, yy.
    slopes: array<vec4f, 8>,
}

// The surface at a place: the map p → p + displacement makes it of still water.
struct SeaSurface {
    // Eastward, northward, upward (m).
    displacement: vec3f,
    // ∂z/∂x and ∂z/∂y of the place at rest.
    slope: vec2f,
    // ∂x/∂x, ∂x/∂y and ∂y/∂y of the displacement.
    stretch: vec3f,
    // (Co)variances xx, xy, yy of the slopes of waves that the footprint left out.
    hidden: vec3f,
    // The part of the water that foam covers, in [0, 1].
    foam: f32,
}

@group(GROUP) @binding(0) var<storage, read> sea_tiles: array<SeaTile>;
// Two layers for each tile: (z, x, ∂x/∂x, y) and (∂y/∂y, ∂z/∂x, ∂x/∂y, ∂z/∂y) in the tile's axes.
@group(GROUP) @binding(1) var sea_motion: texture_2d_array<f32>;
@group(GROUP) @binding(2) var sea_foam: texture_2d_array<f32>;

// Where a place lies in a tile, in parts of its sides.
fn sea_place(tile: u32, rest: vec2f) -> vec2f {
    let turn = sea_tiles[tile].turn;
    let own = vec2f(dot(rest, turn), dot(rest, vec2f(-turn.y, turn.x)));
    return fract(sea_tiles[tile].corner + own / sea_tiles[tile].length);
}

// The finer of the two levels that a footprint (m) mixes, and the share of the coarser one.
fn sea_levels(tile: u32, footprint: f32) -> vec2f {
    let ratio = clamp(footprint * sea_tiles[tile].fineness, 1.0, 1e9);
    let bits = bitcast<u32>(ratio);
    return vec2f(f32((bits >> 23u) - 127u), bitcast<f32>((bits & 0x007fffffu) | 0x3f800000u) - 1.0);
}

// The samples round a place: of each corner both layers.
struct SeaCorners {
    a: array<vec4f, 4>,
    b: array<vec4f, 4>,
    // Where between them.
    at: vec2f,
    // How far apart they are (m).
    side: f32,
}

fn sea_corners(tile: u32, level: u32, place: vec2f) -> SeaCorners {
    let size = sea_tiles[tile].samples >> level;
    let p = place * f32(size);
    let low = vec2u(p) & vec2u(size - 1u);
    let high = (low + 1u) & vec2u(size - 1u);
    let layer = 2u * tile;
    return SeaCorners(
        array<vec4f, 4>(
            textureLoad(sea_motion, low, layer, level),
            textureLoad(sea_motion, vec2u(high.x, low.y), layer, level),
            textureLoad(sea_motion, vec2u(low.x, high.y), layer, level),
            textureLoad(sea_motion, high, layer, level),
        ),
        array<vec4f, 4>(
            textureLoad(sea_motion, low, layer + 1u, level),
            textureLoad(sea_motion, vec2u(high.x, low.y), layer + 1u, level),
            textureLoad(sea_motion, vec2u(low.x, high.y), layer + 1u, level),
            textureLoad(sea_motion, high, layer + 1u, level),
        ),
        p - floor(p),
        sea_tiles[tile].length / f32(size),
    );
}

// Cubic Hermite weights of two values and two slopes over a side.
fn sea_values(t: f32, side: f32) -> vec4f {
    let s = 1.0 - t;
    let rise = t * t * (3.0 - 2.0 * t);
    return vec4f(1.0 - rise, rise, t * s * s * side, -t * t * s * side);
}

// Derivatives of those weights.
fn sea_rises(t: f32, side: f32) -> vec4f {
    let s = 1.0 - t;
    let rise = 6.0 * t * s / side;
    return vec4f(-rise, rise, s * (1.0 - 3.0 * t), t * (3.0 * t - 2.0));
}

// Σ of weights along x and y over a value and its two derivatives at four corners.
fn sea_patched(value: vec4f, dx: vec4f, dy: vec4f, along_x: vec4f, along_y: vec4f) -> f32 {
    let low = dot(vec4f(value.xy, dx.xy), along_x);
    let high = dot(vec4f(value.zw, dx.zw), along_x);
    let rises = vec2f(dot(dy.xy, along_x.xy), dot(dy.zw, along_x.xy));
    return dot(vec4f(low, high, rises), along_y);
}

// From a tile's axes to east and north.
fn sea_turned(v: vec2f, turn: vec2f) -> vec2f {
    return vec2f(v.x * turn.x - v.y * turn.y, v.x * turn.y + v.y * turn.x);
}

// Displacement by one level of a tile; slopes and stretches too where `whole`.
fn sea_add_level(tile: u32, level: u32, place: vec2f, weight: f32, whole: bool, surface: ptr<function, SeaSurface>) {
    if weight == 0.0 || level >= sea_tiles[tile].levels {
        return;
    }
    let c = sea_corners(tile, level, place);
    let turn = sea_tiles[tile].turn;
    let x_values = sea_values(c.at.x, c.side);
    let y_values = sea_values(c.at.y, c.side);
    let z = vec4f(c.a[0].x, c.a[1].x, c.a[2].x, c.a[3].x);
    let x = vec4f(c.a[0].y, c.a[1].y, c.a[2].y, c.a[3].y);
    let xx = vec4f(c.a[0].z, c.a[1].z, c.a[2].z, c.a[3].z);
    let y = vec4f(c.a[0].w, c.a[1].w, c.a[2].w, c.a[3].w);
    let yy = vec4f(c.b[0].x, c.b[1].x, c.b[2].x, c.b[3].x);
    let zx = vec4f(c.b[0].y, c.b[1].y, c.b[2].y, c.b[3].y);
    let xy = vec4f(c.b[0].z, c.b[1].z, c.b[2].z, c.b[3].z);
    let zy = vec4f(c.b[0].w, c.b[1].w, c.b[2].w, c.b[3].w);
    let sideways = vec2f(sea_patched(x, xx, xy, x_values, y_values), sea_patched(y, xy, yy, x_values, y_values));
    let up = sea_patched(z, zx, zy, x_values, y_values);
    (*surface).displacement += weight * vec3f(sea_turned(sideways, turn), up);
    if !whole {
        return;
    }
    let x_rises = sea_rises(c.at.x, c.side);
    let y_rises = sea_rises(c.at.y, c.side);
    let slope = vec2f(sea_patched(z, zx, zy, x_rises, y_values), sea_patched(z, zx, zy, x_values, y_rises));
    (*surface).slope += weight * sea_turned(slope, turn);
    let own_xx = sea_patched(x, xx, xy, x_rises, y_values);
    let own_yy = sea_patched(y, xy, yy, x_values, y_rises);
    let own_xy = 0.5 * (sea_patched(x, xx, xy, x_values, y_rises) + sea_patched(y, xy, yy, x_rises, y_values));
    let cc = turn.x * turn.x;
    let cs = turn.x * turn.y;
    let ss = turn.y * turn.y;
    (*surface).stretch += weight * vec3f(
        cc * own_xx - 2.0 * cs * own_xy + ss * own_yy,
        cs * (own_xx - own_yy) + (cc - ss) * own_xy,
        ss * own_xx + 2.0 * cs * own_xy + cc * own_yy,
    );
}

// Foam at a place by straight lines between the means of a level.
fn sea_foam_level(tile: u32, level: u32, place: vec2f) -> f32 {
    let coarsest = firstTrailingBit(sea_tiles[tile].samples);
    let l = min(level, coarsest);
    let size = sea_tiles[tile].samples >> l;
    // A mean stands in the middle of its samples.
    let back = 0.5 - 0.5 / f32(1u << l);
    let p = place * f32(size) + (f32(size) - back);
    let low = vec2u(p) & vec2u(size - 1u);
    let high = (low + 1u) & vec2u(size - 1u);
    let at = p - floor(p);
    let layer = sea_tiles[tile].foam;
    let below = mix(
        textureLoad(sea_foam, low, layer, l).x,
        textureLoad(sea_foam, vec2u(high.x, low.y), layer, l).x,
        at.x,
    );
    let above = mix(
        textureLoad(sea_foam, vec2u(low.x, high.y), layer, l).x,
        textureLoad(sea_foam, high, layer, l).x,
        at.x,
    );
    return mix(below, above, at.y);
}

// The same on the mean over a footprint (m).
fn sea_foam_at(tile: u32, place: vec2f, footprint: f32) -> f32 {
    let width = clamp(footprint * f32(sea_tiles[tile].samples) / sea_tiles[tile].length, 1.0, 1e9);
    let bits = bitcast<u32>(width);
    let level = (bits >> 23u) - 127u;
    let share = bitcast<f32>((bits & 0x007fffffu) | 0x3f800000u) - 1.0;
    let finer = sea_foam_level(tile, level, place);
    if share == 0.0 {
        return finer;
    }
    return mix(finer, sea_foam_level(tile, level + 1u, place), share);
}

// Displacement alone of the water that rests at a place, by the waves at least twice a footprint (m) long.
fn sea_displacement(rest: vec2f, footprint: f32) -> vec3f {
    var surface = SeaSurface();
    for (var tile = 0u; tile < arrayLength(&sea_tiles); tile++) {
        let place = sea_place(tile, rest);
        let levels = sea_levels(tile, footprint);
        sea_add_level(tile, u32(levels.x), place, 1.0 - levels.y, false, &surface);
        sea_add_level(tile, u32(levels.x) + 1u, place, levels.y, false, &surface);
    }
    return surface.displacement;
}

// Everything known of the surface where the water rests at a place, seen over a footprint (m).
fn sea_surface(rest: vec2f, footprint: f32) -> SeaSurface {
    var surface = SeaSurface();
    // The stretch by the tiles up to the first with foam.
    var gathered = 0.0;
    var foaming = false;
    for (var tile = 0u; tile < arrayLength(&sea_tiles); tile++) {
        let place = sea_place(tile, rest);
        if sea_tiles[tile].foam >= 0 {
            // Short waves break upon the crests of long ones.
            let upon = clamp(1.0 + 0.8 * surface.displacement.z * sea_tiles[tile].raised, 0.0, 2.6);
            let covered = min(sea_foam_at(tile, place, footprint) * upon, 1.0);
            surface.foam += covered - surface.foam * covered;
        }
        let levels = sea_levels(tile, footprint);
        let level = u32(levels.x);
        sea_add_level(tile, level, place, 1.0 - levels.y, true, &surface);
        sea_add_level(tile, level + 1u, place, levels.y, true, &surface);
        let last = sea_tiles[tile].levels;
        let finer = sea_tiles[tile].slopes[min(level, last)].xyz;
        let coarser = sea_tiles[tile].slopes[min(level + 1u, last)].xyz;
        // Waves between the two levels keep 1 − share of their height.
        let kept = (1.0 - levels.y) * (1.0 - levels.y);
        surface.hidden += sea_tiles[tile].slopes[0].xyz - finer + (1.0 - kept) * (finer - coarser);
        if !foaming && sea_tiles[tile].foam >= 0 {
            foaming = true;
            gathered = surface.stretch.x + surface.stretch.z;
        }
    }
    if foaming {
        // Finer waves gather foam where they press the water together, and part it where they stretch it.
        let pressed = clamp((gathered - surface.stretch.x - surface.stretch.z) * sea_tiles[0].torn, -2.0, 2.0);
        surface.foam = clamp(surface.foam + 1.5 * surface.foam * (1.0 - surface.foam) * pressed, 0.0, 1.0);
    }
    return surface;
}
