// The triangles that the tolerance leaves: of every cell that is not cut two halves, and slivers that stand upright on the sides of those that are, where the
// cell beyond is not.

// Lattice point, face and height of each vertex, as bits.
@group(0) @binding(8) var<storage, read_write> vertices: array<vec4u>;
@group(0) @binding(9) var<storage, read_write> corners: array<u32>;
// What an indexed draw is told: three times the triangles, instances, and three zeros.
@group(0) @binding(10) var<storage, read_write> drawn: array<atomic<u32>, 5>;

// Vertices and triangles of a workgroup, and where they are put.
var<workgroup> numbers: array<atomic<u32>, 2>;
var<workgroup> bases: array<u32, 2>;

fn is_cut(i: u32) -> bool {
    return looks[i].pixels > state.tolerance && places[i].children != ABSENT;
}

fn put(index: u32, at: vec2u) {
    let sample = at >> vec2u(30u - sight.samples_level);
    vertices[index] = vec4u(at, 0u, textureLoad(heights, sample, 0).x);
}

fn join(triangle: u32, a: u32, b: u32, c: u32) {
    corners[3u * triangle] = a;
    corners[3u * triangle + 1u] = b;
    corners[3u * triangle + 2u] = c;
}

@compute @workgroup_size(256)
fn draw(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = thread.x;
    // Its sides on which slivers stand, a bit each; whether its halves are drawn.
    var slivers = 0u;
    var halves = false;
    if i < atomicLoad(&state.used) && looks[i].above > state.tolerance {
        if is_cut(i) {
            let sides = beside[i];
            for (var side = 0u; side < 4u; side++) {
                let other = sides[side] & ~OPEN;
                if (sides[side] & OPEN) != 0u && (other >= BORDER || !is_cut(other)) {
                    slivers |= 1u << side;
                }
            }
        } else {
            // Numbers that are not negative are in the order of their bits.
            atomicMax(&state.reached, bitcast<u32>(looks[i].bound));
            halves = kind(looks[i]) == WHOLE;
        }
    }

    let count = select(countOneBits(slivers), 2u, halves);
    var before = vec2u(0u);
    if count > 0u {
        before = vec2u(atomicAdd(&numbers[0], select(3u * count, 4u, halves)), atomicAdd(&numbers[1], count));
    }
    workgroupBarrier();
    if local == 0u {
        bases[0] = atomicAdd(&state.vertices, atomicLoad(&numbers[0]));
        bases[1] = atomicAdd(&drawn[0], 3u * atomicLoad(&numbers[1])) / 3u;
        if i == 0u {
            atomicStore(&drawn[1], 1u);
        }
    }
    workgroupBarrier();
    if count == 0u {
        return;
    }

    let first = bases[0] + before.x;
    var triangle = bases[1] + before.y;
    let side = 1u << (30u - (looks[i].kind >> 8u));
    let corner = places[i].at * side;
    if halves {
        put(first, corner);
        put(first + 1u, corner + vec2u(side, 0u));
        put(first + 2u, corner + vec2u(0u, side));
        put(first + 3u, corner + side);
        join(triangle, first, first + 1u, first + 2u);
        join(triangle + 1u, first + 3u, first + 2u, first + 1u);
        return;
    }
    // From one end of each side to the other, run along with the cell on the left, and back to the middle.
    var ends = array(vec2u(0u), vec2u(side, 0u), vec2u(side), vec2u(0u, side), vec2u(0u));
    var vertex = first;
    for (var k = 0u; k < 4u; k++) {
        if (slivers >> k & 1u) == 1u {
            put(vertex, corner + ends[k]);
            put(vertex + 1u, corner + ends[k + 1u]);
            put(vertex + 2u, corner + (ends[k] + ends[k + 1u]) / 2u);
            join(triangle, vertex, vertex + 1u, vertex + 2u);
            vertex += 3u;
            triangle += 1u;
        }
    }
}
