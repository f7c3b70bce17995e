// The passes that put out what is split: *place* lists it in the order of numbers, *draw* puts out vertices and triangles.

// Two lattice coordinates, the face and the bits of a height each, as `lod::Vertex`: the face's corners, then the middles of what is split.
@group(0) @binding(7) var<storage, read_write> vertices: array<vec4u>;
@group(0) @binding(8) var<storage, read_write> corners: array<u32>;
// What an indexed draw is told: three times the triangles, instances, and three zeros.
@group(0) @binding(9) var<storage, read_write> drawn: array<atomic<u32>, 5>;

var<workgroup> scan: array<u32, THREADS>;

@compute @workgroup_size(THREADS)
fn place(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let block = blocks[group.x].busy;
    let word = block * BLOCK + local;
    var bits = atomicLoad(&words[word].bits);
    var before = countOneBits(bits);
    scan[local] = before;
    for (var by = 1u; by < THREADS; by *= 2u) {
        workgroupBarrier();
        var left = 0u;
        if local >= by {
            left = scan[local - by];
        }
        workgroupBarrier();
        scan[local] += left;
    }
    before = blocks[block].start + scan[local] - before;
    words[word].before = before;
    while bits != 0u {
        let bit = countTrailingZeros(bits);
        list[before].at = pack(middle(32u * word + bit));
        before += 1u;
        bits &= bits - 1u;
    }
}

// The vertex on a corner of the face or the middle of a diamond that is split.
fn vertex(at: vec2u) -> u32 {
    let far = at == vec2u(steps());
    if all((at == vec2u(0u)) | far) {
        return select(select(0u, 1u, far.x), select(3u, 2u, far.x), far.y);
    }
    let number = number_of(at);
    let bits = atomicLoad(&words[number >> 5u].bits) & ((1u << (number & 31u)) - 1u);
    return 4u + words[number >> 5u].before + countOneBits(bits);
}

fn put(index: u32, at: vec2u) {
    let sample = at >> vec2u(1u);
    var height = 0x7fc00000u;
    if sample.x < sight.columns && sample.y < sight.rows {
        height = textureLoad(heights, sample, 0).x;
    }
    vertices[index] = vec4u(at << vec2u(29u - sight.samples_level), 0u, height);
}

// Whether there is surface under all of a diamond's triangle, told by its apex.
fn whole(at: vec2u, apex: vec2u) -> bool {
    let unit = unit_of(at);
    if unit == 0u {
        return !any_void(corners_of(at));
    }
    let number = number_of(at);
    if number == NONE {
        return false;
    }
    let odd = (at >> vec2u(unit)) & vec2u(1u);
    let half = i32(1u << unit);
    var first = vec2i(0, half);
    if all(odd == vec2u(1u)) {
        let cell = at >> vec2u(unit + 1u);
        first = vec2i(half, select(half, -half, ((cell.x + cell.y) & 1u) == 0u));
    } else if odd.x == 0u {
        first = vec2i(-half, 0);
    }
    let there = vec2i(at) + first;
    let outside = any(there < vec2i(0)) || any(there > vec2i(i32(steps())));
    let side = select(1u, 0u, outside || all(there == vec2i(apex)));
    return (packed(number).x >> side & 1u) == 1u;
}

// Triangles of a workgroup, and where they are put.
var<workgroup> many: atomic<u32>;
var<workgroup> base: u32;

@compute @workgroup_size(THREADS)
fn draw(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = thread.x;
    // The triangles that a split left, a bit each, between two of the corners around its middle. Last the whole face, if that is not split.
    var left = 0u;
    var at = vec2u(steps() / 2u);
    var around = array(vec2i(0), vec2i(0), vec2i(0), vec2i(0), vec2i(0));
    if i < state.listed {
        at = unpack(list[i].at);
        put(4u + i, at);
        let unit = unit_of(at);
        let half = i32(1u << unit);
        let square = all(((at >> vec2u(unit)) & vec2u(1u)) == vec2u(1u));
        for (var k = 0u; k < 5u; k++) {
            // South, or south-west, and on counter-clockwise.
            let turn = k % 4u;
            let ahead = vec2i(select(0, select(1, -1, turn == 3u), turn % 2u == 1u), select(0, select(1, -1, turn == 0u), turn % 2u == 0u));
            let right = vec2i(ahead.y, -ahead.x);
            around[k] = vec2i(at) + half * select(ahead, ahead + vec2i(ahead.y, -ahead.x), square);
        }
        for (var k = 0u; k < 4u; k++) {
            let both = array(around[k], around[k + 1u]);
            let low = min(both[0], both[1]);
            let high = max(both[0], both[1]);
            if all(low >= vec2i(0)) && all(high <= vec2i(i32(steps()))) {
                let child = vec2u(both[0] + both[1]) / 2u;
                let split = unit_of(child) > 0u && is_split(number_of(child));
                if !split && whole(child, at) {
                    left |= 1u << k;
                }
            }
        }
    } else if i == state.listed {
        let end = steps();
        put(0u, vec2u(0u));
        put(1u, vec2u(end, 0u));
        put(2u, vec2u(end));
        put(3u, vec2u(0u, end));
        if sight.samples_level == 0u || !is_split(number_of(at)) {
            left = select(0u, 1u, whole(at, vec2u(end, 0u))) | select(0u, 2u, whole(at, vec2u(0u, end)));
        }
    }

    let count = countOneBits(left);
    var before = 0u;
    if count > 0u {
        before = atomicAdd(&many, count);
    }
    workgroupBarrier();
    if local == 0u {
        base = atomicAdd(&drawn[0], 3u * atomicLoad(&many)) / 3u;
        if i == 0u {
            atomicStore(&drawn[1], 1u);
        }
    }
    workgroupBarrier();
    if count == 0u {
        return;
    }
    var triangle = 3u * (base + before);
    if i == state.listed {
        for (var k = 0u; k < 2u; k++) {
            if (left >> k & 1u) == 1u {
                corners[triangle] = 0u;
                corners[triangle + 1u] = 1u + k;
                corners[triangle + 2u] = 2u + k;
                triangle += 3u;
            }
        }
        return;
    }
    for (var k = 0u; k < 4u; k++) {
        if (left >> k & 1u) == 1u {
            corners[triangle] = vertex(vec2u(around[k]));
            corners[triangle + 1u] = vertex(vec2u(around[k + 1u]));
            corners[triangle + 2u] = 4u + i;
            triangle += 3u;
        }
    }
}
