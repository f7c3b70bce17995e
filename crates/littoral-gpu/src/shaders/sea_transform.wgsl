// The waves of all tiles at an instant, packed, and summed by fast Fourier transform: first along x for each wave number in y, then along y.
//
// Every packed spectrum is a real multiplier times h (littoral::waves::fft): eight real fields are four complex transforms, which go
// through here two by two, as the halves (re, im, re, im) of a vector. The transform is T. Stockham's (W. Cochran and others, "What is the fast
// Fourier transform?", 1967): each pass of radix R joins R results of `span` samples into one, and leaves them in order.

// How many results a pass joins: 4 or 8.
override RADIX: u32 = 8u;
// Whether the pass is the first along x, which makes what it reads.
override FROM_WAVES: bool = false;
// Whether the pass is the first along y, where wave numbers that no tile has are to be read as 0.
override FROM_ROWS: bool = false;
// Whether the pass is the last along y, which writes samples.
override TO_SAMPLES: bool = false;
// Whether the pass is part of a tick of foam: of the tiles that have any, the stretches alone.
override FOAM: bool = false;

// What a pass needs to know.
struct Pass {
    // Samples along a side.
    samples: u32,
    // Samples of each result that is joined.
    span: u32,
    // Steps in the table of turns for one step of the joined result.
    stride: u32,
    // Highest magnitude of a wave number's index along y.
    rows: u32,
    // Level of detail.
    level: u32,
}

// An instant.
struct Moment {
    // Whole seconds, and the rest in units of 2⁻³² s.
    seconds: i32,
    rest: u32,
    // Of a tick of foam: which half of the foam is that before,
    half: u32,
    // what is left of it,
    decay: f32,
    // the least there is, and for each tile with foam the Jacobian from which there is new foam, and how much of it below that.
    least: f32,
    foaming: array<vec4f, 16>,
}

struct Tile {
    // Where its waves begin.
    first: u32,
    // Highest magnitude of an index.
    rows: i32,
    // Between neighbouring wave numbers (rad/m).
    step: f32,
    // The tile that has this tile's number among those with foam.
    with_foam: u32,
}

// Two waves against each other: see littoral::waves::cascades::Wave.
struct Wave {
    sum: vec2f,
    difference: vec2f,
    // Whole turns in a second (28 bits), and above them the number of levels that have it.
    whole: u32,
    // The rest of the turns in a second, in units of 2⁻³² and 2⁻⁶⁴.
    high: u32,
    low: u32,
    reach: f32,
}

@group(0) @binding(0) var<uniform> pass_: Pass;
@group(0) @binding(1) var<uniform> moment: Moment;
@group(0) @binding(2) var<storage, read> tiles: array<Tile>;
@group(0) @binding(3) var<storage, read> waves: array<Wave>;
// e^(2πi q / n) for the q-th of n.
@group(0) @binding(4) var<storage, read> turns: array<vec2f>;
@group(0) @binding(5) var<storage, read> before: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> after: array<vec4f>;
// Two layers for each tile: (z, x, ∂x/∂x, y) and (∂y/∂y, ∂z/∂x, ∂x/∂y, ∂z/∂y).
@group(0) @binding(7) var samples: texture_storage_2d_array<rgba32float, write>;
// Two halves, and in each the tiles with foam, row by row.
@group(0) @binding(8) var<storage, read_write> foam: array<f32>;

// The upper half of a product.
fn upper(a: u32, b: u32) -> u32 {
    let low = (a & 0xffffu) * (b & 0xffffu);
    let middle = (a >> 16u) * (b & 0xffffu) + (low >> 16u);
    let other = (a & 0xffffu) * (b >> 16u) + (middle & 0xffffu);
    return (a >> 16u) * (b >> 16u) + (middle >> 16u) + (other >> 16u);
}

// A wave's phase in turns, from −½ to ½: whole turns fall off by themselves, so that no instant is too late.
fn phase(wave: Wave) -> f32 {
    let seconds = bitcast<u32>(moment.seconds);
    // Seconds before 0 are 2³² too large.
    let correction = select(0u, wave.low, moment.seconds < 0);
    let turned = wave.high * seconds + upper(wave.low, seconds) - correction
        + (wave.whole & 0x0fffffffu) * moment.rest + upper(wave.high, moment.rest);
    return f32(bitcast<i32>(turned)) * 0x1p-32;
}

// sin 2πs for |s| ≤ ¼. (WGSL's own sine may err by 2⁻¹¹.)
fn quarter_sine(s: f32) -> f32 {
    let z = s * s;
    return s * fma(fma(fma(fma(39.53492, z, -76.54953), z, 81.60099), z, -41.341656), z, 6.283185);
}

// h of a wave.
fn height(wave: Wave) -> vec2f {
    let r = phase(wave);
    let size = abs(r);
    let folded = 0.25 - abs(size - 0.25);
    let sine = quarter_sine(select(folded, -folded, r < 0.0));
    let cosine = quarter_sine(0.25 - size);
    let s = wave.sum;
    let d = wave.difference;
    return vec2f(fma(d.y, sine, s.x * cosine), fma(-d.x, sine, s.y * cosine));
}

// The packed spectra of a half for the wave number with index m along x, at place i of a line, and n along y.
fn packed(tile: Tile, half: u32, i: u32, n: i32) -> vec4f {
    let m = select(i32(i), i32(i) - i32(pass_.samples), 2u * i >= pass_.samples);
    if abs(m) > tile.rows || abs(n) > tile.rows {
        return vec4f(0.0);
    }
    let width = 2 * tile.rows + 1;
    let wave = waves[tile.first + u32((n + tile.rows) * width + m + tile.rows)];
    if wave.whole >> 28u <= pass_.level {
        return vec4f(0.0);
    }
    let h = height(wave);
    let x = f32(m) * tile.step;
    let y = f32(n) * tile.step;
    if FOAM {
        return vec4f(x * x * h - y * y * vec2f(h.y, -h.x), x * y * h) * -wave.reach;
    }
    var multipliers = vec2f(1.0 - x * wave.reach, -wave.reach * (x * x + y));
    if half == 1u {
        multipliers = vec2f(-(y * y * wave.reach + x), -(x * y * wave.reach + y));
    }
    return multipliers.xxyy * h.xyxy;
}

fn turned(v: vec4f, by: vec2f) -> vec4f {
    return v * by.x + vec4f(-v.y, v.x, -v.w, v.z) * by.y;
}

fn times_i(v: vec4f) -> vec4f {
    return vec4f(-v.y, v.x, -v.w, v.z);
}

struct Four {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    d: vec4f,
}

fn joined(a: vec4f, b: vec4f, c: vec4f, d: vec4f) -> Four {
    let even = a + c;
    let odd = a - c;
    let sum = b + d;
    let difference = times_i(b - d);
    return Four(even + sum, odd + difference, even - sum, odd - difference);
}

// A place in the lines of a pass.
struct Place {
    // Where the line's first number stands, and how far its numbers are apart.
    start: u32,
    apart: u32,
    // Two for each tile; with foam, one for each tile that has any.
    layer: u32,
    // Index of the wave number along y.
    n: i32,
    // Of the numbers that a result of `span` has.
    index: u32,
    // x of the line.
    x: u32,
}

fn number(place: Place, i: u32) -> vec4f {
    if FROM_WAVES {
        let tile = select(place.layer / 2u, tiles[place.layer].with_foam, FOAM);
        return packed(tiles[tile], place.layer % 2u, i, place.n);
    }
    if FROM_ROWS && min(i, pass_.samples - i) > pass_.rows {
        return vec4f(0.0);
    }
    let value = before[place.start + i * place.apart];
    if pass_.span == 1u {
        return value;
    }
    let r = i / (pass_.samples / RADIX);
    return turned(value, turns[r * place.index * pass_.stride]);
}

fn keep(place: Place, i: u32, value: vec4f) {
    if TO_SAMPLES && FOAM {
        let jacobian = (1.0 + value.x) * (1.0 + value.y) - value.z * value.z;
        let foaming = moment.foaming[place.layer];
        let fresh = clamp((foaming.x - jacobian) * foaming.y, 0.0, 1.0);
        let size = pass_.samples * pass_.samples;
        let at = place.layer * size + i * pass_.samples + place.x;
        let half = arrayLength(&foam) / 2u;
        let all = max(foam[moment.half * half + at] * moment.decay, fresh);
        foam[(1u - moment.half) * half + at] = select(all, 0.0, all < moment.least);
    } else if TO_SAMPLES {
        textureStore(samples, vec2u(place.x, i), place.layer, value);
    } else {
        after[place.start + i * place.apart] = value;
    }
}

// The j-th join of a line.
fn join(place: Place, j: u32) {
    let apart = pass_.samples / RADIX;
    let to = (j - place.index) * RADIX + place.index;
    let span = pass_.span;
    if RADIX == 4u {
        let all = joined(
            number(place, j),
            number(place, j + apart),
            number(place, j + 2u * apart),
            number(place, j + 3u * apart),
        );
        keep(place, to, all.a);
        keep(place, to + span, all.b);
        keep(place, to + 2u * span, all.c);
        keep(place, to + 3u * span, all.d);
        return;
    }
    let even = joined(
        number(place, j),
        number(place, j + 2u * apart),
        number(place, j + 4u * apart),
        number(place, j + 6u * apart),
    );
    let odd = joined(
        number(place, j + apart),
        number(place, j + 3u * apart),
        number(place, j + 5u * apart),
        number(place, j + 7u * apart),
    );
    let eighth = vec2f(0.70710678);
    let b = turned(odd.b, eighth);
    let c = times_i(odd.c);
    let d = turned(odd.d, vec2f(-eighth.x, eighth.y));
    keep(place, to, even.a + odd.a);
    keep(place, to + span, even.b + b);
    keep(place, to + 2u * span, even.c + c);
    keep(place, to + 3u * span, even.d + d);
    keep(place, to + 4u * span, even.a - odd.a);
    keep(place, to + 5u * span, even.b - b);
    keep(place, to + 6u * span, even.c - c);
    keep(place, to + 7u * span, even.d - d);
}

@compute @workgroup_size(64)
fn along_x(@builtin(global_invocation_id) id: vec3u) {
    let joins = pass_.samples / RADIX;
    let line = id.x / joins;
    if line > 2u * pass_.rows {
        return;
    }
    let j = id.x % joins;
    let n = i32(line) - i32(pass_.rows);
    let row = (line + pass_.samples - pass_.rows) % pass_.samples;
    let start = (id.y * pass_.samples + row) * pass_.samples;
    join(Place(start, 1u, id.y, n, j % pass_.span, 0u), j);
}

@compute @workgroup_size(64)
fn along_y(@builtin(global_invocation_id) id: vec3u) {
    let x = id.x % pass_.samples;
    let j = id.x / pass_.samples;
    if j >= pass_.samples / RADIX {
        return;
    }
    let start = id.y * pass_.samples * pass_.samples + x;
    join(Place(start, pass_.samples, id.y, 0, j % pass_.span, x), j);
}
