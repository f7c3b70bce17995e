// The passes of a level, each over its whole list: what would be drawn is counted, the tolerance settled, room reserved for the children of what is cut, and
// the children linked, looked at already.

// For each bin of tolerances: how many more triangles there are below it than above.
@group(0) @binding(8) var<storage, read_write> bins: array<atomic<i32>>;
// Workgroups that go over the next level's list, and over all lists.
@group(1) @binding(0) var<storage, read_write> workgroups: array<u32, 6>;

// Bits of a number that do not tell bins apart: 256 bins to an octave.
const SHIFT = 15u;
const BINS = (INFINITE >> SHIFT) + 1u;

var<workgroup> triangles: atomic<i32>;
var<workgroup> taken: atomic<u32>;
var<workgroup> base: u32;

// So many triangles are there at tolerances (pixels) below one. The sum over a workgroup is added by `count_all`.
fn add(below: f32, number: i32) {
    if number != 0 {
        atomicAdd(&bins[bitcast<u32>(below) >> SHIFT], number);
        atomicAdd(&triangles, number);
    }
}

fn count_all(local: u32) {
    workgroupBarrier();
    if local == 0u {
        let sum = atomicLoad(&triangles);
        if sum != 0 {
            atomicAdd(&state.count, sum);
        }
    }
}

fn dispatch(next: u32, all: u32) {
    // At least one, so that the passes after an empty level find what they need.
    workgroups[0] = max((next + 255u) / 256u, 1u);
    workgroups[1] = 1u;
    workgroups[2] = 1u;
    workgroups[3] = max((all + 255u) / 256u, 1u);
    workgroups[4] = 1u;
    workgroups[5] = 1u;
}

@compute @workgroup_size(1)
fn begin() {
    state.tolerance = sight.tolerance;
    atomicStore(&state.candidates, 0u);
    atomicStore(&state.used, 1u);
    atomicStore(&state.vertices, 0u);
    atomicStore(&state.reached, 0u);
    state.firsts[0] = 0u;
    state.firsts[1] = 1u;
    places[0] = Place(vec2u(0u), ABSENT, 0u);
    beside[0] = vec4u(BORDER);
    let whole = look(vec2u(0u), 0u, bitcast<f32>(LARGEST));
    looks[0] = whole;
    atomicStore(&state.count, 0);
    if whole.kind == WHOLE {
        atomicStore(&bins[LARGEST >> SHIFT], 2);
        atomicStore(&state.count, 2);
    }
    dispatch(1u, 1u);
}

// The cell beyond a side.
fn beyond(at: vec2u, side: u32) -> vec2u {
    switch side {
        case 0u: { return at - vec2u(0u, 1u); }
        case 1u: { return at + vec2u(1u, 0u); }
        case 2u: { return at + vec2u(0u, 1u); }
        default: { return at - vec2u(1u, 0u); }
    }
}

@compute @workgroup_size(256)
fn count(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = state.firsts[here.number] + thread.x;
    let tolerance = state.tolerance;
    if i < state.firsts[here.number + 1u] && here.number < sight.finest && looks[i].pixels > tolerance {
        let look = looks[i];
        atomicAdd(&taken, 1u);
        var more = select(0, -2, look.kind == WHOLE);
        var open = 0u;
        for (var side = 0u; side < 4u; side++) {
            let index = beside[i][side];
            var closes = false;
            if index == ABSENT {
                // Where nothing is drawn beyond, nothing has to be closed.
                let land = facts(beyond(places[i].at, side), here.number);
                closes = land.exists && land.whole;
            } else if index != BORDER {
                let other = looks[index];
                if other.kind == WHOLE && other.pixels > tolerance {
                    add(min(look.pixels, other.pixels), -1);
                }
                closes = other.kind == WHOLE || other.kind == UNSEEN;
            }
            if closes {
                more += 1;
                open |= 1u << side;
            }
        }
        add(look.pixels, more);
        places[i].level = here.number | (open << 8u);
    }
    count_all(local);
    if local == 0u {
        let cut = atomicLoad(&taken);
        if cut > 0u {
            atomicAdd(&state.candidates, cut);
        }
    }
}

// Of each of the 256 parts that the bins are dealt out to, from the largest tolerances down: the sum, and the greatest sum from its beginning.
const PART = (BINS + 255u) / 256u;
var<workgroup> sums: array<i32, 256>;
var<workgroup> peaks: array<i32, 256>;
var<workgroup> bound_to_rise: u32;
var<workgroup> fitting: atomic<u32>;
var<workgroup> bin: u32;

// The number of triangles in the bin that is so far from the last.
fn from_top(i: u32) -> i32 {
    if i >= BINS {
        return 0;
    }
    return atomicLoad(&bins[BINS - 1u - i]);
}

// Raises the tolerance until it takes no more triangles than allowed, and no more children than there is room for.
@compute @workgroup_size(256)
fn settle(@builtin(local_invocation_index) local: u32) {
    let first = state.firsts[here.number];
    let end = state.firsts[here.number + 1u];
    if local == 0u {
        let free = (sight.room - atomicLoad(&state.used)) / 4u;
        let candidates = atomicLoad(&state.candidates);
        bound_to_rise = select(0u, 1u, atomicLoad(&state.count) > i32(sight.most)) | select(0u, 2u, candidates > free);
        atomicStore(&state.candidates, 0u);
    }
    let why = workgroupUniformLoad(&bound_to_rise);
    if why == 0u {
        return;
    }

    // The least bin at which the children fit: what is cut lies in bins above it.
    var least = 0u;
    if (why & 2u) != 0u {
        let free = (sight.room - atomicLoad(&state.used)) / 4u;
        for (var bit = 0x8000u; bit > 0u; bit >>= 1u) {
            if local == 0u {
                atomicStore(&fitting, 0u);
            }
            workgroupBarrier();
            let below = least + bit - 1u;
            for (var i = first + local; i < end; i += 256u) {
                if (bitcast<u32>(looks[i].pixels) >> SHIFT) > below && looks[i].pixels > state.tolerance {
                    atomicAdd(&fitting, 1u);
                }
            }
            workgroupBarrier();
            if local == 0u {
                bin = select(least + bit, least, atomicLoad(&fitting) <= free);
            }
            least = workgroupUniformLoad(&bin);
        }
    }

    // The first bin, from the largest tolerance down, at which there would be too many triangles.
    var sum = 0;
    var peak = -0x7fffffff;
    for (var i = local * PART; i < (local + 1u) * PART; i++) {
        sum += from_top(i);
        peak = max(peak, sum);
    }
    sums[local] = sum;
    peaks[local] = peak;
    workgroupBarrier();
    if local == 0u {
        let most = i32(sight.most);
        var count = 0;
        var part = 0u;
        while part < 256u && count + peaks[part] <= most {
            count += sums[part];
            part += 1u;
        }
        var i = part * PART;
        while i + 1u < BINS && count + from_top(i) <= most {
            count += from_top(i);
            i += 1u;
        }
        bin = BINS - 1u - min(i, BINS - 1u);
        // Fewer still, if room for cells asks for that.
        while bin < least {
            bin += 1u;
            count -= atomicLoad(&bins[bin]);
        }
        atomicStore(&state.count, count);
        state.tolerance = max(state.tolerance, bitcast<f32>(((bin + 1u) << SHIFT) - 1u));
    }
    // What is below the new tolerance is no more.
    let last = workgroupUniformLoad(&bin);
    for (var i = local; i <= last; i += 256u) {
        atomicStore(&bins[i], 0);
    }
}

@compute @workgroup_size(256)
fn reserve(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = state.firsts[here.number] + thread.x;
    let is_cut = i < state.firsts[here.number + 1u] && looks[i].pixels > state.tolerance;
    var before = 0u;
    if is_cut {
        before = atomicAdd(&taken, 4u);
    }
    workgroupBarrier();
    if local == 0u {
        let all = atomicLoad(&taken);
        if all > 0u {
            base = atomicAdd(&state.used, all);
        }
    }
    workgroupBarrier();
    if is_cut {
        places[i].children = base + before;
    }
}

// The child that lies beyond a side of a cell: of the cell's neighbour there, if that is cut.
fn across(neighbour: u32, child: u32) -> u32 {
    if neighbour >= BORDER {
        return neighbour;
    }
    let children = places[neighbour].children;
    return select(children + child, ABSENT, children == ABSENT);
}

// Fills the list of the level at hand with the children of what was cut on the one above, and looks at them.
@compute @workgroup_size(256)
fn link(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    let end = state.firsts[here.number];
    let i = state.firsts[here.number - 1u] + thread.x;
    if thread.x == 0u {
        let used = atomicLoad(&state.used);
        state.firsts[here.number + 1u] = used;
        dispatch(used - end, used);
    }
    if i < end && places[i].children != ABSENT {
        let children = places[i].children;
        let sides = beside[i];
        let above = looks[i].pixels;
        var whole = 0;
        for (var k = 0u; k < 4u; k++) {
            // Beyond two of its sides are its siblings, beyond the others children of its parent's neighbours.
            var around = vec4u(children + (k ^ 2u), children + (k ^ 1u), children + (k ^ 2u), children + (k ^ 1u));
            if (k & 2u) == 0u {
                around.x = across(sides.x, k ^ 2u);
            } else {
                around.z = across(sides.z, k ^ 2u);
            }
            if (k & 1u) == 1u {
                around.y = across(sides.y, k ^ 1u);
            } else {
                around.w = across(sides.w, k ^ 1u);
            }
            let at = 2u * places[i].at + vec2u(k & 1u, k >> 1u);
            let seen = look(at, here.number, above);
            places[children + k] = Place(at, ABSENT, here.number);
            beside[children + k] = around;
            looks[children + k] = seen;
            whole += select(0, 2, seen.kind == WHOLE);
        }
        add(above, whole);
    }
    count_all(local);
}
