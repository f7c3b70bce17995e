// The sea as far as it is before the ground, and what its waves are like in every pixel: the engine's `picture::waves`.

@group(0) @binding(3) var<storage, read> points: array<vec4f>;

struct Seen {
    @builtin(position) position: vec4f,
    @location(0) rel: vec3f,
    @location(1) rest: vec2f,
}

// A strip for each ring but the last.
@vertex
fn wave(@builtin(vertex_index) vertex: u32, @builtin(instance_index) strip: u32) -> Seen {
    let column = vertex >> 1u;
    let ring = strip + (vertex & 1u);
    let at = points[ring * grid.size.x + column].xyz;
    return Seen(frame.clip_from_eye * vec4f(at, 1.0), at, rest_of(column, ring));
}

// Variance of the slopes that water has in the stillest air.
const FINEST = 3e-4;
// Mean square slope of gradient noise, per direction.
const NOISE = 0.5;

// Slope; covariances of the slopes that the pixel cannot show; foam; displacement (m): as halves, covariances 64 times as large.
@fragment
fn wet(seen: Seen) -> @location(0) vec4u {
    let distance = length(seen.rel);
    let footprint = footprint_of(distance, -seen.rel.z / distance);
    let surface = waves_surface(seen.rest, footprint);
    // Slopes over where water is are those over where it rests, through the inverse of the map between them.
    let a = 1.0 + surface.stretch.x;
    let b = surface.stretch.y;
    let c = 1.0 + surface.stretch.z;
    let s = surface.slope;
    var slope = vec2f(c * s.x - b * s.y, a * s.y - b * s.x) / max(a * c - b * b, 0.05);
    let finest = frame.sea.y;
    var hidden = surface.hidden + vec3f(finest, 0.0, finest);
    // Ripples that no model has: noise that runs with the wind.
    let variance = finest / 3.0;
    for (var i = 0u; i < 3u; i++) {
        let share = resolved(frame.noise[45u + i].wavelength, footprint);
        if share == 0.0 || variance == 0.0 {
            break;
        }
        slope += grain(45u + i, seen.rest, 1.0).gradient.xy * (sqrt(variance / NOISE) * share);
        let shown = variance * share * share;
        hidden -= vec3f(shown, 0.0, shown);
    }
    hidden += vec3f(FINEST, 0.0, FINEST);
    let moved = seen.rel.xy - seen.rest;
    return vec4u(
        pack2x16float(slope),
        pack2x16float(64.0 * hidden.xz),
        pack2x16float(vec2f(64.0 * hidden.y, surface.foam)),
        pack2x16float(moved),
    );
}
