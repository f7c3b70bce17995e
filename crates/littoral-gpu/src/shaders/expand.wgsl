// Patches become triangles: vertices on the lattice, with heights of the samples, morphed. The processor's twin is `lod/drawing.rs`, with the same names.

struct Here {
    // Cells of the stencil along a side; 0 for a triangle. Patches; vertices and triangles that are there before.
    cells: u32,
    patches: u32,
    vertices: u32,
    triangles: u32,
    // Level whose cells lie between four samples; samples a row, rows; whether any is void.
    samples_level: u32,
    columns: u32,
    rows: u32,
    voids: u32,
}

struct Patch {
    corner: vec2u,
    across: vec2i,
    up: vec2i,
    morph: f32,
    // Southern, eastern, northern, western side.
    edges: array<f32, 4>,
    // The sides beyond which it is twice as coarse, a bit each.
    coarser: u32,
}

@group(0) @binding(0) var<uniform> here: Here;
// Bits of the samples' heights (m); voids are not finite.
@group(0) @binding(1) var heights: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> patches: array<Patch>;
// Two lattice coordinates, the face and the bits of a height each.
@group(0) @binding(3) var<storage, read_write> vertices: array<vec4u>;
@group(0) @binding(4) var<storage, read_write> corners: array<u32>;
// What an indexed draw is told: three times the triangles, instances, and three zeros.
@group(0) @binding(5) var<storage, read_write> drawn: array<atomic<u32>, 5>;

const THREADS = 256u;
// Most cells of a stencil along a side.
const MOST = 32u;
const INFINITE = 0x7f800000u;
const VOID = 0x7fc00000u;

fn is_void(bits: u32) -> bool {
    return (bits & INFINITE) == INFINITE;
}

fn sample(at: vec2u) -> u32 {
    return textureLoad(heights, at, 0).x;
}

// Whether a cell between four samples is whole.
fn exists(at: vec2i) -> bool {
    if any(at < vec2i(0)) || at.x + 1 >= i32(here.columns) || at.y + 1 >= i32(here.rows) {
        return false;
    }
    let low = vec2u(at);
    return !(is_void(sample(low)) || is_void(sample(low + vec2u(1u, 0u))) || is_void(sample(low + vec2u(0u, 1u))) || is_void(sample(low + 1u)));
}

// Bits of the height of a lattice point; not finite where there is none.
fn height(at: vec2u) -> u32 {
    let shift = 30u - here.samples_level;
    let low = at >> vec2u(shift);
    let part = vec2f(at - (low << vec2u(shift))) / f32(1u << shift);
    let last = vec2u(here.columns, here.rows) - 1u;
    if any(low > last) || any((low == last) & (part > vec2f(0.0))) {
        return VOID;
    }
    if here.voids == 0u && all(part == vec2f(0.0)) {
        return sample(low);
    }
    // On a line between cells the one before may be there where the one after is not.
    for (var k = 0u; k < 4u; k++) {
        let back = vec2u(k & 1u, k >> 1u);
        if any((back == vec2u(1u)) & (part != vec2f(0.0))) {
            continue;
        }
        let cell = vec2i(low) - vec2i(back);
        if exists(cell) {
            let c = vec2u(cell);
            let u = part + vec2f(back);
            let south = bitcast<f32>(sample(c)) * (1.0 - u.x) + bitcast<f32>(sample(c + vec2u(1u, 0u))) * u.x;
            let north = bitcast<f32>(sample(c + vec2u(0u, 1u))) * (1.0 - u.x) + bitcast<f32>(sample(c + 1u)) * u.x;
            return bitcast<u32>(south * (1.0 - u.y) + north * u.y);
        }
    }
    return VOID;
}

// The lattice point of the stencil's (i / n, j / n), n being a power of two and the patch no smaller than n steps.
fn point(index: u32, v: vec2u, n: u32) -> vec2u {
    let reach = (patches[index].across / i32(n)) * i32(v.x) + (patches[index].up / i32(n)) * i32(v.y);
    return patches[index].corner + bitcast<vec2u>(reach);
}

// Of a square's patch: heights of its vertices as they are.
var<workgroup> own: array<u32, (MOST + 1u) * (MOST + 1u)>;
var<workgroup> taken: atomic<u32>;
var<workgroup> base: u32;

fn own_height(v: vec2u) -> u32 {
    return own[v.y * (here.cells + 1u) + v.x];
}

// One end of the line on which a stencil twice as coarse draws a vertex.
fn coarse_end(v: vec2u, other: bool) -> vec2u {
    let odd = v & vec2u(1u);
    let half = v >> vec2u(1u);
    let by = select(-vec2i(odd), vec2i(odd), other);
    if all(odd == vec2u(1u)) && ((half.x + half.y) & 1u) == 1u {
        return vec2u(vec2i(v) + vec2i(-by.x, by.y));
    }
    return vec2u(vec2i(v) + by);
}

fn whole(cell: vec2u) -> bool {
    return !(is_void(own_height(cell)) || is_void(own_height(cell + vec2u(1u, 0u))) || is_void(own_height(cell + vec2u(0u, 1u))) || is_void(own_height(cell + 1u)));
}

// The side on which a vertex is that the patch beyond lacks: 0 to 3; 4 for none.
fn lacking(v: vec2u, coarser: u32) -> u32 {
    let n = here.cells;
    if (v.x & 1u) == 1u {
        if v.y == 0u && (coarser & 1u) != 0u { return 0u; }
        if v.y == n && (coarser & 4u) != 0u { return 2u; }
    }
    if (v.y & 1u) == 1u {
        if v.x == n && (coarser & 2u) != 0u { return 1u; }
        if v.x == 0u && (coarser & 8u) != 0u { return 3u; }
    }
    return 4u;
}

// Of the two cells at such a vertex the second; the first lies before it along the side.
fn beside(v: vec2u, side: u32) -> vec2u {
    return vec2u(select(v.x, v.x - 1u, side == 1u), select(v.y, v.y - 1u, side == 2u));
}

// How many of them are whole.
fn wholes(v: vec2u, side: u32) -> u32 {
    let cell = beside(v, side);
    let before = select(cell - vec2u(0u, 1u), cell - vec2u(1u, 0u), side % 2u == 0u);
    return select(0u, 1u, whole(before)) + select(0u, 1u, whole(cell));
}

// The vertex that is drawn for one: where a side's middle is left out, the one before it.
fn kept(v: vec2u, coarser: u32) -> u32 {
    let side = lacking(v, coarser);
    var at = v;
    if side < 4u && wholes(v, side) == 2u {
        at = coarse_end(v, false);
    }
    return at.y * (here.cells + 1u) + at.x;
}

// Triangles are counted first, and then put where there is room.
fn push(first: u32, a: u32, b: u32, c: u32, count: bool) {
    if a == b || b == c || c == a {
        return;
    }
    let slot = atomicAdd(&taken, 1u);
    if !count {
        let triangle = 3u * (base + slot);
        corners[triangle] = first + a;
        corners[triangle + 1u] = first + b;
        corners[triangle + 2u] = first + c;
    }
}

fn triangles_of(coarser: u32, first: u32, local: u32, count: bool) {
    let n = here.cells;
    for (var i = local; i < n * n; i += THREADS) {
        let cell = vec2u(i % n, i / n);
        if whole(cell) {
            let a = kept(cell, coarser);
            let b = kept(cell + vec2u(1u, 0u), coarser);
            let c = kept(cell + vec2u(0u, 1u), coarser);
            let d = kept(cell + 1u, coarser);
            if ((cell.x + cell.y) & 1u) == 0u {
                push(first, a, b, d, count);
                push(first, a, d, c, count);
            } else {
                push(first, a, b, c, count);
                push(first, b, d, c, count);
            }
        }
    }
    // Where one of the two cells at a left out vertex is missing, it stays, and a triangle that stands upright closes the gap.
    for (var i = local; i < 4u * n; i += THREADS) {
        let side = i / n;
        let k = i % n;
        let v = vec2u(select(k, select(0u, n, side == 1u), side % 2u == 1u), select(k, select(0u, n, side == 2u), side % 2u == 0u));
        if lacking(v, coarser) != side || wholes(v, side) != 1u {
            continue;
        }
        let one = coarse_end(v, false);
        let other = coarse_end(v, true);
        if is_void(own_height(one)) || is_void(own_height(other)) {
            continue;
        }
        let turned = side >= 2u;
        let begin = select(one, other, turned);
        let end = select(other, one, turned);
        push(first, begin.y * (n + 1u) + begin.x, end.y * (n + 1u) + end.x, v.y * (n + 1u) + v.x, count);
    }
}

@compute @workgroup_size(THREADS)
fn squares(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let index = group.y * groups.x + group.x;
    // The last row of workgroups is longer than needed.
    if index >= here.patches {
        return;
    }
    let n = here.cells;
    let side = n + 1u;
    for (var i = local; i < side * side; i += THREADS) {
        own[i] = height(point(index, vec2u(i % side, i / side), n));
    }
    workgroupBarrier();
    let first = here.vertices + index * side * side;
    for (var i = local; i < side * side; i += THREADS) {
        let v = vec2u(i % side, i / side);
        var morph = patches[index].morph;
        if v.y == 0u {
            morph = patches[index].edges[0];
        } else if v.y == n {
            morph = patches[index].edges[2];
        } else if v.x == 0u {
            morph = patches[index].edges[3];
        } else if v.x == n {
            morph = patches[index].edges[1];
        }
        var bits = own[i];
        if morph > 0.0 {
            let ends = array(own_height(coarse_end(v, false)), own_height(coarse_end(v, true)));
            // Next to a void there may be nothing to move to.
            if !is_void(ends[0]) && !is_void(ends[1]) && !is_void(bits) {
                let height = bitcast<f32>(bits);
                bits = bitcast<u32>(height + (0.5 * (bitcast<f32>(ends[0]) + bitcast<f32>(ends[1])) - height) * morph);
            }
        }
        vertices[first + i] = vec4u(point(index, v, n), 0u, bits);
    }
    let coarser = patches[index].coarser;
    triangles_of(coarser, first, local, true);
    workgroupBarrier();
    if local == 0u {
        base = atomicAdd(&drawn[0], 3u * atomicExchange(&taken, 0u)) / 3u;
    }
    workgroupBarrier();
    triangles_of(coarser, first, local, false);
}

// Patches of a few vertices: a thread each.
@compute @workgroup_size(THREADS)
fn few(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    let index = (group.y * groups.x + group.x) * THREADS + local;
    var count = 0u;
    let each = select(4u, 3u, here.cells == 0u);
    let first = here.vertices + index * each;
    if index < here.patches {
        count = each - 2u;
        for (var v = 0u; v < each; v++) {
            let at = point(index, vec2u(v & 1u, v >> 1u), 1u);
            let bits = height(at);
            vertices[first + v] = vec4u(at, 0u, bits);
            if is_void(bits) {
                count = 0u;
            }
        }
    }
    var before = 0u;
    if count > 0u {
        before = atomicAdd(&taken, count);
    }
    workgroupBarrier();
    if local == 0u {
        base = atomicAdd(&drawn[0], 3u * atomicLoad(&taken)) / 3u;
    }
    workgroupBarrier();
    if count > 0u {
        let triangle = 3u * (base + before);
        // South-west, south-east and north-west; of a square north-east, too.
        corners[triangle] = first;
        corners[triangle + 1u] = first + 1u;
        corners[triangle + 2u] = first + select(3u, 2u, count == 1u);
        if count == 2u {
            corners[triangle + 3u] = first;
            corners[triangle + 4u] = first + 3u;
            corners[triangle + 5u] = first + 2u;
        }
    }
}
