// What the passes of a bisection share: which diamonds are split, and what is known of one. The processor's twins are `lod/roam/diamond.rs`, `lod/roam/bounds.rs`
// and `lod/roam/scan.rs`; see `bisector.rs` for the passes.
//
// A diamond is named by the middle of its base, in steps of half a sample. Those whose middle is a sample have a number, too, by which what is known of them is found.

struct Sight {
    // Normals, pointing inward, of the frame's four sides, and straight ahead; w of the last is the nearest visible distance (m).
    sides: array<vec4f, 4>,
    forward: vec4f,
    // Place of the eye in whole steps, and what is left of it (m).
    eye: vec2i,
    rest: vec2f,
    // Metres a step.
    scale: vec2f,
    // Height of the eye (m); pixels that a unit of tangent covers.
    height: f32,
    focal: f32,
    // The greatest distance in the frame as a multiple of its depth; pixels asked for.
    stretch: f32,
    tolerance: f32,
    // Height of step 0 and of one step (m).
    base: f32,
    height_step: f32,
    // Most triangles; most entries of the list of diamonds.
    most: u32,
    room: u32,
    // Cells of this level are not split; level whose cells lie between four samples; samples a row, rows.
    finest: u32,
    samples_level: u32,
    columns: u32,
    rows: u32,
    // How many diamonds have numbers, and how many blocks of them there are.
    diamonds: u32,
    blocks: u32,
    // For each level of cells the numbers of its first square, and of its first side that runs east and north.
    firsts: array<vec4u, 16>,
}

// The set of the diamonds that are split: a bit for each, 32 in a word, and how many are split in words before it.
struct Word {
    bits: atomic<u32>,
    before: u32,
}

// The upper nodes of the tree of sums over the bits: a block is BLOCK words.
struct Block {
    // How many of its diamonds are split, and how many of those in blocks before it.
    count: atomic<u32>,
    start: u32,
    // Of the blocks in which any are split, that many places from the first.
    busy: u32,
}

// A diamond that is split, and its priority in this view (pixels, as bits).
struct Entry {
    at: u32,
    pixels: u32,
}

struct State {
    tolerance: f32,
    // Triangles, at that tolerance.
    count: atomic<i32>,
    // Entries of the list: those from the view before, and behind them those found in this one.
    used: atomic<u32>,
    listed: u32,
    // The entries that are looked at next.
    begin: u32,
    end: u32,
    wave: u32,
    // The greatest priority of what is not split (pixels, as bits); whether anything worth it is not and is partly void.
    reached: atomic<u32>,
    lost: atomic<u32>,
}

// No diamond, no number.
const NONE = 0xffffffffu;
// A block: as many words as a workgroup has threads.
const BLOCK = 256u;
const THREADS = 256u;
const INFINITE = 0x7f800000u;
const LARGEST = 0x7f7fffffu;

@group(0) @binding(0) var<uniform> sight: Sight;
// Bits of the samples' heights (m); voids are not finite.
@group(0) @binding(1) var heights: texture_2d<u32>;
// For each number what `NestedBounds::packed` says, row by row.
@group(0) @binding(2) var bounds: texture_2d<u32>;
@group(0) @binding(3) var<storage, read_write> words: array<Word>;
@group(0) @binding(4) var<storage, read_write> blocks: array<Block>;
@group(0) @binding(5) var<storage, read_write> list: array<Entry>;
@group(0) @binding(6) var<storage, read_write> state: State;

fn pack(at: vec2u) -> u32 {
    return at.x | (at.y << 16u);
}

fn unpack(at: u32) -> vec2u {
    return vec2u(at & 0xffffu, at >> 16u);
}

// Steps along the face's side.
fn steps() -> u32 {
    return 2u << sight.samples_level;
}

// The binary logarithm of half a cell's side, whose diagonal or side the base is (steps).
fn unit_of(at: vec2u) -> u32 {
    return countTrailingZeros(at.x | at.y);
}

// Squares along both ways that have numbers: those over land and one more. What lies farther off is empty, for itself and all that needs it.
fn squares(unit: u32) -> vec2u {
    return min(land_cells(unit) + 1u, vec2u(1u << (sight.samples_level - unit)));
}

// Cells over land.
fn land_cells(unit: u32) -> vec2u {
    return ((vec2u(sight.columns, sight.rows) - 2u) >> vec2u(unit)) + 1u;
}

// The number of a diamond whose middle is a sample; none far from land.
fn number_of(at: vec2u) -> u32 {
    let unit = unit_of(at);
    let first = sight.firsts[sight.samples_level - unit];
    let width = squares(unit);
    let most = land_cells(unit);
    let cell = at >> vec2u(unit + 1u);
    let odd = (at >> vec2u(unit)) & vec2u(1u);
    if odd.x == 0u {
        // A side that runs north.
        return select(NONE, first.z + cell.y * (most.x + 1u) + cell.x, cell.x <= most.x && cell.y < width.y);
    }
    if odd.y == 0u {
        return select(NONE, first.y + cell.y * width.x + cell.x, cell.x < width.x && cell.y <= most.y);
    }
    return select(NONE, first.x + cell.y * width.x + cell.x, all(cell < width));
}

// The diamond of a number.
fn middle(number: u32) -> vec2u {
    var level = sight.samples_level - 1u;
    while sight.firsts[level].x > number {
        level -= 1u;
    }
    let unit = sight.samples_level - level;
    let first = sight.firsts[level];
    var base = first.x;
    var across = squares(unit).x;
    var odd = vec2u(1u);
    if number >= first.z {
        base = first.z;
        across = land_cells(unit).x + 1u;
        odd = vec2u(0u, 1u);
    } else if number >= first.y {
        base = first.y;
        odd = vec2u(1u, 0u);
    }
    let i = number - base;
    return (2u * vec2u(i % across, i / across) + odd) << vec2u(unit);
}

fn packed(number: u32) -> vec2u {
    let width = textureDimensions(bounds).x;
    return textureLoad(bounds, vec2u(number % width, number / width), 0).xy;
}

// Bits of the heights of the corners of a cell between four samples, south-west, south-east, north-west, north-east; not finite where void or no sample.
fn corners_of(at: vec2u) -> vec4u {
    let sample = at >> vec2u(1u);
    if sample.x + 1u >= sight.columns || sample.y + 1u >= sight.rows {
        return vec4u(INFINITE);
    }
    return vec4u(
        textureLoad(heights, sample, 0).x,
        textureLoad(heights, sample + vec2u(1u, 0u), 0).x,
        textureLoad(heights, sample + vec2u(0u, 1u), 0).x,
        textureLoad(heights, sample + vec2u(1u, 1u), 0).x,
    );
}

fn any_void(corners: vec4u) -> bool {
    return any((corners & vec4u(INFINITE)) == vec4u(INFINITE));
}

// Whether a diamond is split.
fn is_split(number: u32) -> bool {
    return number != NONE && (atomicLoad(&words[number >> 5u].bits) >> (number & 31u) & 1u) == 1u;
}
