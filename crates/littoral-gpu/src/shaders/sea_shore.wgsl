// A sea over a bed at any place, and all waves together: what littoral::waves::ShoreSea and littoral::field::Sea answer. To be put behind sea_sample.wgsl, after
// GROUP is replaced by the number of the bind group. Places are those of the water at rest, east and north in metres from the eye.

struct Shore {
    // The eye among the nodes of the bed; nodes a metre.
    place: vec4f,
    // Columns and rows of nodes; waves; whether tiles are sheltered.
    size: vec4u,
    // The eye among the factors of shelter; factors a metre.
    shelter: vec4f,
    // Their columns and rows (as numbers); mean angular frequency of the waves (rad/s); height over depth at which they break.
    rest: vec4f,
}

struct ShoreWave {
    // Wave number (turns/m) and direction.
    turns: vec2f,
    heading: vec2f,
    // Phase at the eye (turns); metres per unit of amplitude.
    phase: f32,
    unit: f32,
    unused: vec2f,
}

@group(GROUP) @binding(0) var<uniform> shore: Shore;
@group(GROUP) @binding(1) var<storage, read> shore_waves: array<ShoreWave>;
// By node, then by wave: phase against the open sea (2⁻¹⁶ turns, signed) and amplitude. After the last node comes the open sea.
@group(GROUP) @binding(2) var<storage, read> shore_records: array<u32>;
// Two for each node: (depth, height, r cos φ, r sin φ) and (sideways, broken, set-up, swing).
@group(GROUP) @binding(3) var<storage, read> shore_places: array<array<vec4f, 2>>;
@group(GROUP) @binding(4) var<storage, read> shelter_factors: array<f32>;

const SHORE_TURN = 1.0 / 65536.0;
const SHORE_TAU = 6.28318530718;

struct ShoreCell {
    // South-west, south-east, north-west, north-east.
    nodes: vec4u,
    at: vec2f,
}

fn shore_node(c: i32, r: i32) -> u32 {
    let columns = i32(shore.size.x);
    let rows = i32(shore.size.y);
    let inside = c >= 0 && r >= 0 && c < columns && r < rows;
    return select(shore.size.x * shore.size.y, u32(r * columns + c), inside);
}

fn shore_cell(rest: vec2f) -> ShoreCell {
    let p = clamp(shore.place.xy + rest * shore.place.zw, vec2f(-2.0), vec2f(shore.size.xy) + 1.0);
    let low = floor(p);
    let c = i32(low.x);
    let r = i32(low.y);
    return ShoreCell(
        vec4u(shore_node(c, r), shore_node(c + 1, r), shore_node(c, r + 1), shore_node(c + 1, r + 1)),
        p - low,
    );
}

// A place's numbers, and their derivatives eastward and northward (1/m).
struct ShorePlace {
    a: vec4f,
    b: vec4f,
    a_x: vec4f,
    b_x: vec4f,
    a_y: vec4f,
    b_y: vec4f,
}

fn shore_place(cell: ShoreCell) -> ShorePlace {
    let sw = shore_places[cell.nodes.x];
    let se = shore_places[cell.nodes.y];
    let nw = shore_places[cell.nodes.z];
    let ne = shore_places[cell.nodes.w];
    let u = cell.at.x;
    let v = cell.at.y;
    return ShorePlace(
        mix(mix(sw[0], se[0], u), mix(nw[0], ne[0], u), v),
        mix(mix(sw[1], se[1], u), mix(nw[1], ne[1], u), v),
        mix(se[0] - sw[0], ne[0] - nw[0], v) * shore.place.z,
        mix(se[1] - sw[1], ne[1] - nw[1], v) * shore.place.z,
        mix(nw[0] - sw[0], ne[0] - se[0], u) * shore.place.w,
        mix(nw[1] - sw[1], ne[1] - se[1], u) * shore.place.w,
    );
}

// Sums over the waves: ζ = Σ A cos θ and ξ = Σ A sin θ with their derivatives, the sideways motion with its, and the slopes that a footprint leaves out.
struct ShoreSums {
    zeta: vec3f,
    xi: vec3f,
    side: vec2f,
    stretch: vec3f,
    hidden: vec3f,
}

fn shore_sums(rest: vec2f, cell: ShoreCell, footprint: f32, whole: bool) -> ShoreSums {
    let count = shore.size.z;
    let u = cell.at.x;
    let v = cell.at.y;
    let over = shore.place.zw;
    let square = footprint * footprint * 0.10132118; // (footprint / π)²
    var sums = ShoreSums();
    for (var n = 0u; n < count; n++) {
        let wave = shore_waves[n];
        let a = shore_records[cell.nodes.x * count + n];
        let b = shore_records[cell.nodes.y * count + n];
        let c = shore_records[cell.nodes.z * count + n];
        let d = shore_records[cell.nodes.w * count + n];
        // By the shorter way round from node to node: differences wrap at 16 bits.
        let pa = extractBits(bitcast<i32>(a), 0u, 16u);
        let across = extractBits(bitcast<i32>(b) - pa, 0u, 16u);
        let up = extractBits(bitcast<i32>(c) - pa, 0u, 16u);
        let twist = extractBits(bitcast<i32>(d) - bitcast<i32>(c), 0u, 16u) - across;
        let bend = vec2f(f32(across) + f32(twist) * v, f32(up) + f32(twist) * u) * SHORE_TURN;
        let ahead = (f32(pa) + f32(across) * u + (f32(up) + f32(twist) * u) * v) * SHORE_TURN;
        let turns = wave.phase + dot(wave.turns, rest) + ahead;
        let k = (wave.turns + bend * over) * SHORE_TAU;
        let aa = f32(a >> 16u);
        let ab = f32(b >> 16u) - aa;
        let ac = f32(c >> 16u) - aa;
        let ad = f32(d >> 16u) - f32(c >> 16u) - ab;
        let height = (aa + ab * u + (ac + ad * u) * v) * wave.unit;
        let t = saturate((1.0 - dot(k, k) * square) * (4.0 / 3.0));
        let weight = t * t * (3.0 - 2.0 * t);
        let shown = height * weight;
        let angle = (turns - floor(turns)) * SHORE_TAU;
        let hc = shown * cos(angle);
        let hs = shown * sin(angle);
        sums.zeta.x += hc;
        sums.xi.x += hs;
        sums.side += hs * wave.heading;
        if whole {
            let rise = vec2f(ab + ad * v, ac + ad * u) * over * (wave.unit * weight);
            let zeta = rise * cos(angle) - hs * k;
            let xi = rise * sin(angle) + hc * k;
            sums.zeta += vec3f(0.0, zeta);
            sums.xi += vec3f(0.0, xi);
            let e = wave.heading;
            sums.stretch += vec3f(xi.x * e.x, 0.5 * (xi.y * e.x + xi.x * e.y), xi.y * e.y);
            let lost = 0.5 * height * height * (1.0 - weight * weight);
            sums.hidden += lost * vec3f(k.x * k.x, k.x * k.y, k.y * k.y);
        }
    }
    return sums;
}

const SHORE_SOFT = 1.0 / 16.0;
const SHORE_USUAL = 0.7;
const SHORE_FARTHEST = 1.3;

// Height of T. Abreu's profile and the parts it is made of.
struct ShoreProfile {
    height: f32,
    numerator: f32,
    denominator: f32,
    e: f32,
    f: f32,
    lean: f32,
}

fn shore_profile(sums: ShoreSums, place: ShorePlace) -> ShoreProfile {
    let zeta = sums.zeta.x;
    let xi = sums.xi.x;
    let r = place.a.zw;
    let soft = SHORE_SOFT * place.a.y;
    let e = sqrt(soft * soft + zeta * zeta + xi * xi + 1e-12);
    let f = sqrt(max(1.0 - dot(r, r), 0.0));
    let numerator = zeta + r.y / (1.0 + f) * e;
    let lean = r.x * xi - r.y * zeta;
    let denominator = 1.0 - lean / e;
    return ShoreProfile(f * numerator / denominator, numerator, denominator, e, f, lean);
}

// Its slope along an axis, for the derivatives of ζ, ξ and the place along that.
fn shore_slope(sums: ShoreSums, place: ShorePlace, p: ShoreProfile, zeta_d: f32, xi_d: f32, place_d: vec4f) -> f32 {
    let zeta = sums.zeta.x;
    let xi = sums.xi.x;
    let r = place.a.zw;
    let r_d = place_d.zw;
    let soft = SHORE_SOFT * SHORE_SOFT * place.a.y * place_d.y;
    let e_d = (zeta * zeta_d + xi * xi_d + soft) / p.e;
    let f_d = -dot(r, r_d) / max(p.f, 0.1);
    let beta = r.y / (1.0 + p.f);
    let beta_d = (r_d.y - beta * f_d) / (1.0 + p.f);
    let numerator_d = zeta_d + beta * e_d + beta_d * p.e;
    let lean_d = r.x * xi_d - r.y * zeta_d + r_d.x * xi - r_d.y * zeta;
    let denominator_d = -(lean_d - p.lean * e_d / p.e) / p.e;
    return (f_d * p.numerator + p.f * numerator_d - p.f * p.numerator * denominator_d / p.denominator) / p.denominator;
}

// A wave as the swash follows it, and the derivative of that.
fn shore_held(wave: f32) -> vec2f {
    let most = select(SHORE_FARTHEST, 1.0, wave < 0.0);
    let t = min(abs(wave) / (1.5 * most), 1.0);
    return vec2f(sign(wave) * most * t * (1.5 - 0.5 * t * t), 1.0 - t * t);
}

fn shore_usual(place: ShorePlace) -> f32 {
    return SHORE_USUAL * place.a.y + 1e-5;
}

fn shore_swash(sums: ShoreSums, place: ShorePlace) -> f32 {
    return place.b.w * shore_held(sums.zeta.x / shore_usual(place)).x + place.b.z;
}

fn shore_swash_slope(sums: ShoreSums, place: ShorePlace, zeta_d: f32, a_d: vec4f, b_d: vec4f) -> f32 {
    let usual = shore_usual(place);
    let wave = sums.zeta.x / usual;
    let held = shore_held(wave);
    let wave_d = held.y * (zeta_d - wave * SHORE_USUAL * a_d.y) / usual;
    return b_d.w * held.x + place.b.w * wave_d + b_d.z;
}

fn shore_smooth(a: f32, b: f32, x: f32) -> f32 {
    let t = saturate((x - a) / (b - a));
    return t * t * (3.0 - 2.0 * t);
}

// Which part of the water is foam.
fn shore_foam(sums: ShoreSums, place: ShorePlace) -> f32 {
    let broken = place.b.y;
    if broken < 2e-3 {
        return 0.0;
    }
    let zeta = sums.zeta.x;
    let xi = sums.xi.x;
    let frequency = shore.rest.z;
    let most = shore.rest.w * place.a.x;
    let e = sqrt(zeta * zeta + xi * xi);
    let often = shore_smooth(2e-3, 0.05, broken);
    let here = often * shore_smooth(0.55, 1.0, 2.0 * e / max(most, 1e-3));
    // Time since its crest went by.
    let behind = select(0.0, -atan2(xi, zeta) / SHORE_TAU, e > 0.0);
    let period = SHORE_TAU / frequency;
    let age = select(max(behind, 0.0), behind + 1.0, behind < -0.12) * period;
    let front = (0.88 * zeta + 0.47 * xi) / max(e, 1e-6);
    let roller = here * shore_smooth(0.55, 0.85, front);
    let fresh = 0.85 * here * exp(-age / 5.0);
    let old = 0.8 * often * sqrt(broken) * exp(-(age + period) / 10.0);
    return saturate(max(roller, min(max(fresh, old), 0.9)));
}

// The factor by which tiles are lower at a place, and its gradient (1/m).
fn shelter_at(rest: vec2f) -> vec3f {
    if shore.size.w == 0u {
        return vec3f(1.0, 0.0, 0.0);
    }
    let last = shore.rest.xy - 1.0;
    let wanted = shore.shelter.xy + rest * shore.shelter.zw;
    let p = clamp(wanted, vec2f(0.0), last);
    let within = select(vec2f(0.0), vec2f(1.0), wanted == p);
    let low = min(floor(p), last - 1.0);
    let f = p - low;
    let columns = u32(shore.rest.x);
    let i = u32(low.y) * columns + u32(low.x);
    let a = shelter_factors[i];
    let b = shelter_factors[i + 1u];
    let c = shelter_factors[i + columns];
    let d = shelter_factors[i + columns + 1u];
    let south = mix(a, b, f.x);
    let north = mix(c, d, f.x);
    let slope = vec2f(mix(b - a, d - c, f.y), north - south) * within * shore.shelter.zw;
    return vec3f(mix(south, north, f.y), slope);
}

// Displacement alone of the water that rests at a place (m), by the waves at least twice a footprint (m) long.
fn waves_displacement(rest: vec2f, footprint: f32) -> vec3f {
    var moved = sea_displacement(rest, footprint) * shelter_at(rest).x;
    if shore.size.z > 0u {
        let cell = shore_cell(rest);
        let place = shore_place(cell);
        let sums = shore_sums(rest, cell, footprint, false);
        let up = shore_profile(sums, place).height + shore_swash(sums, place);
        moved += vec3f(-place.b.x * sums.side, up);
    }
    return moved;
}

// Everything known of the surface where the water rests at a place, seen over a footprint (m).
fn waves_surface(rest: vec2f, footprint: f32) -> SeaSurface {
    let own = sea_surface(rest, footprint);
    let s = shelter_at(rest);
    var all = SeaSurface();
    all.displacement = own.displacement * s.x;
    all.slope = own.slope * s.x + own.displacement.z * s.yz;
    let d = own.displacement.xy;
    all.stretch = own.stretch * s.x + vec3f(s.y * d.x, 0.5 * (s.z * d.x + s.y * d.y), s.z * d.y);
    all.hidden = own.hidden * (s.x * s.x);
    // Low waves do not break.
    all.foam = own.foam * s.x * s.x;
    if shore.size.z == 0u {
        return all;
    }
    let cell = shore_cell(rest);
    let place = shore_place(cell);
    let sums = shore_sums(rest, cell, footprint, true);
    let profile = shore_profile(sums, place);
    let sideways = place.b.x;
    all.displacement += vec3f(-sideways * sums.side, profile.height + shore_swash(sums, place));
    all.slope += vec2f(
        shore_slope(sums, place, profile, sums.zeta.y, sums.xi.y, place.a_x) + shore_swash_slope(sums, place, sums.zeta.y, place.a_x, place.b_x),
        shore_slope(sums, place, profile, sums.zeta.z, sums.xi.z, place.a_y) + shore_swash_slope(sums, place, sums.zeta.z, place.a_y, place.b_y),
    );
    let g = vec2f(place.b_x.x, place.b_y.x);
    let side = sums.side;
    all.stretch -= sideways * sums.stretch + vec3f(g.x * side.x, 0.5 * (g.y * side.x + g.x * side.y), g.y * side.y);
    all.hidden += sums.hidden;
    let foam = shore_foam(sums, place);
    all.foam = foam + all.foam * (1.0 - foam);
    return all;
}
