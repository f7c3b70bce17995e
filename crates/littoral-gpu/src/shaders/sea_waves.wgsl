// The waves of all tiles at an instant, packed, and summed by fast Fourier transform: first along x for each wave number in y, then along y.
//
// Every packed spectrum is a real multiplier times h (littoral::waves::fft): eight real fields are four complex transforms, which go
// through here two by two, as the halves (re, im, re, im) of a vector. The transform is T. Stockham's (W. Cochran and others, "What is the fast
// Fourier transform?", 1967): each step of radix R joins R results of `span` samples into one, and leaves them in order.
//
// sea_passes.wgsl or sea_lines.wgsl goes on from here: steps as passes over memory, or whole lines in a workgroup.

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

// What becomes of a sample: it is kept, or has its part in a tick of foam.
fn finish(layer: u32, at_sample: vec2u, value: vec4f) {
    if !FOAM {
        textureStore(samples, at_sample, layer, value);
        return;
    }
    let jacobian = (1.0 + value.x) * (1.0 + value.y) - value.z * value.z;
    let foaming = moment.foaming[layer];
    let fresh = clamp((foaming.x - jacobian) * foaming.y, 0.0, 1.0);
    let size = pass_.samples * pass_.samples;
    let at = layer * size + at_sample.y * pass_.samples + at_sample.x;
    let half = arrayLength(&foam) / 2u;
    let all = max(foam[moment.half * half + at] * moment.decay, fresh);
    foam[(1u - moment.half) * half + at] = select(all, 0.0, all < moment.least);
}

// The tile of a layer.
fn tile_of(layer: u32) -> u32 {
    return select(layer / 2u, tiles[layer].with_foam, FOAM);
}
