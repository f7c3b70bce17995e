// The passes of a level: *count* what would be drawn of its list at which tolerance, *settle* the tolerance, and *cut* what is worth it, whose children are looked at
// at once. The first levels, of no more cells than a workgroup has threads, are done in one pass.

// For each bin of tolerances: how many more triangles there are below it than above.
@group(0) @binding(8) var<storage, read_write> bins: array<atomic<i32>>;
// Workgroups that go over the next level's list, and over all lists.
@group(1) @binding(0) var<storage, read_write> workgroups: array<u32, 6>;

// Threads of a workgroup, and levels that have no more cells than that.
const THREADS = 256u;
const FIRST_LEVELS = 5u;

// Bits of a number that do not tell bins apart: 256 bins to an octave.
const SHIFT = 15u;
const BINS = (INFINITE >> SHIFT) + 1u;

// What a workgroup has to add to the count of triangles; cells that it cuts; where it puts their children.
var<workgroup> triangles: atomic<i32>;
var<workgroup> taken: atomic<u32>;
var<workgroup> base: u32;

// So many triangles are there at tolerances (pixels) below one. The workgroup's sum is handed on by `hand_on`.
fn add(below: f32, number: i32) {
    if number != 0 {
        atomicAdd(&bins[bitcast<u32>(below) >> SHIFT], number);
        atomicAdd(&triangles, number);
    }
}

fn hand_on(local: u32) {
    workgroupBarrier();
    if local == 0u {
        let sum = atomicExchange(&triangles, 0);
        if sum != 0 {
            atomicAdd(&state.count, sum);
        }
    }
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

// The child that lies beyond a side of its parent: of the cell there, if that is cut.
fn across(neighbour: u32, child: u32) -> u32 {
    let other = neighbour & ~OPEN;
    if other >= BORDER {
        return other;
    }
    let children = places[other].children;
    return select(children + child, ABSENT, children == ABSENT);
}

// The places of the cells beyond a cell's sides.
fn around(i: u32, level: u32) -> vec4u {
    if level == 0u {
        return vec4u(BORDER);
    }
    let place = places[i];
    let sides = beside[place.parent];
    let first = places[place.parent].children;
    let k = i - first;
    // Beyond two sides are siblings, beyond the others children of the parent's neighbours.
    var cells = vec4u(first + (k ^ 2u), first + (k ^ 1u), first + (k ^ 2u), first + (k ^ 1u));
    if (k & 2u) == 0u {
        cells.x = across(sides.x, k ^ 2u);
    } else {
        cells.z = across(sides.z, k ^ 2u);
    }
    if (k & 1u) == 1u {
        cells.y = across(sides.y, k ^ 1u);
    } else {
        cells.w = across(sides.w, k ^ 1u);
    }
    return cells;
}

// Tells the census what cutting a cell changes, and finds the sides over which slivers may stand.
fn count_cell(i: u32, level: u32, local: u32) {
    let tolerance = state.tolerance;
    if i < atomicLoad(&state.used) && looks[i].pixels > tolerance {
        let seen = looks[i];
        atomicAdd(&taken, 1u);
        var more = select(0, -2, kind(seen) == WHOLE);
        var sides = around(i, level);
        for (var side = 0u; side < 4u; side++) {
            let index = sides[side];
            var closes = false;
            if index == ABSENT {
                // Where nothing is drawn beyond, nothing has to be closed.
                let land = facts(beyond(places[i].at, side), level);
                closes = land.exists && land.whole;
            } else if index != BORDER {
                let other = looks[index];
                if kind(other) == WHOLE && other.pixels > tolerance {
                    add(min(seen.pixels, other.pixels), -1);
                }
                closes = kind(other) == WHOLE || kind(other) == UNSEEN;
            }
            if closes {
                more += 1;
                sides[side] |= OPEN;
            }
        }
        add(seen.pixels, more);
        beside[i] = sides;
    }
    hand_on(local);
    if local == 0u {
        let candidates = atomicExchange(&taken, 0u);
        if candidates > 0u {
            atomicAdd(&state.candidates, candidates);
        }
    }
}

// Of each of the parts that the bins are dealt out to, from the largest tolerances down: the sum, and the greatest sum from its beginning.
const PART = (BINS + THREADS - 1u) / THREADS;
var<workgroup> sums: array<i32, THREADS>;
var<workgroup> peaks: array<i32, THREADS>;
// Whether there are too many triangles (1), and too many cells (2).
var<workgroup> excess: u32;
var<workgroup> bin: u32;
var<workgroup> left: atomic<i32>;
// Cells by the upper half of the number of their bin, then by the lower one; how many are in bins above those.
var<workgroup> tally: array<atomic<u32>, THREADS>;
var<workgroup> above: u32;

// The number of triangles in the bin that is so far from the last.
fn from_top(i: u32) -> i32 {
    if i >= BINS {
        return 0;
    }
    return atomicLoad(&bins[BINS - 1u - i]);
}

// The least bin such that no more than so many cells of a list are cut, if those in bins above it are. All of them together are more.
fn fitting(first: u32, end: u32, most: u32, local: u32) -> u32 {
    if local == 0u {
        above = 0u;
    }
    var upper = 0u;
    for (var half = 0u; half < 2u; half++) {
        atomicStore(&tally[local], 0u);
        workgroupBarrier();
        for (var i = first + local; i < end; i += THREADS) {
            let number = bitcast<u32>(looks[i].pixels) >> SHIFT;
            if half == 0u {
                atomicAdd(&tally[number >> 8u], 1u);
            } else if number >> 8u == upper {
                atomicAdd(&tally[number & 0xffu], 1u);
            }
        }
        workgroupBarrier();
        if local == 0u {
            var part = THREADS - 1u;
            while part > 0u && above + atomicLoad(&tally[part]) <= most {
                above += atomicLoad(&tally[part]);
                part -= 1u;
            }
            bin = part;
        }
        upper = (upper << 8u) | workgroupUniformLoad(&bin);
    }
    return upper;
}

// Raises the tolerance until it takes no more triangles than allowed, and no more children than there is room for.
fn settle_level(level: u32, local: u32) {
    let first = state.firsts[level];
    let end = atomicLoad(&state.used);
    let free = (sight.room - end) / 4u;
    if local == 0u {
        let candidates = atomicExchange(&state.candidates, 0u);
        excess = select(0u, 1u, atomicLoad(&state.count) > i32(sight.most)) | select(0u, 2u, candidates > free);
        // The next list begins where this one ends, and is no longer than this.
        let children = 4u * min(candidates, free);
        state.firsts[level + 1u] = end;
        workgroups[0] = max((children + THREADS - 1u) / THREADS, 1u);
        workgroups[1] = 1u;
        workgroups[2] = 1u;
        workgroups[3] = (end + children + THREADS - 1u) / THREADS;
        workgroups[4] = 1u;
        workgroups[5] = 1u;
    }
    let why = workgroupUniformLoad(&excess);
    if why == 0u {
        return;
    }
    var least = 0u;
    if (why & 2u) != 0u {
        least = fitting(first, end, free, local);
    }

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
        // The first bin, from the largest tolerance down, with which there would be too many triangles.
        let most = i32(sight.most);
        var count = 0;
        var part = 0u;
        while part < THREADS && count + peaks[part] <= most {
            count += sums[part];
            part += 1u;
        }
        var i = part * PART;
        while i + 1u < BINS && count + from_top(i) <= most {
            count += from_top(i);
            i += 1u;
        }
        bin = max(BINS - 1u - min(i, BINS - 1u), least);
        state.tolerance = max(state.tolerance, bitcast<f32>(((bin + 1u) << SHIFT) - 1u));
        atomicStore(&left, 0);
    }
    // What is below the new tolerance is no more.
    let last = workgroupUniformLoad(&bin);
    sum = 0;
    for (var i = local; i < BINS; i += THREADS) {
        if i <= last {
            atomicStore(&bins[i], 0);
        } else {
            sum += atomicLoad(&bins[i]);
        }
    }
    atomicAdd(&left, sum);
    workgroupBarrier();
    if local == 0u {
        atomicStore(&state.count, atomicLoad(&left));
    }
}

// Cuts a cell if that is worth it: reserves room for its children, and looks at them.
fn cut_cell(i: u32, level: u32, local: u32) {
    let is_cut = i < state.firsts[level + 1u] && looks[i].pixels > state.tolerance;
    var before = 0u;
    if is_cut {
        before = atomicAdd(&taken, 4u);
    }
    workgroupBarrier();
    if local == 0u {
        let all = atomicExchange(&taken, 0u);
        if all > 0u {
            base = atomicAdd(&state.used, all);
        }
    }
    workgroupBarrier();
    if is_cut {
        let first = base + before;
        places[i].children = first;
        let corner = 2u * places[i].at;
        let above = looks[i].pixels;
        var whole = 0;
        for (var k = 0u; k < 4u; k++) {
            let at = corner + vec2u(k & 1u, k >> 1u);
            let seen = look(at, level + 1u, above);
            places[first + k] = Place(at, i, ABSENT);
            looks[first + k] = seen;
            whole += select(0, 2, kind(seen) == WHOLE);
        }
        add(above, whole);
    }
    hand_on(local);
}

// Until everything a workgroup wrote is there for all its threads.
fn done() {
    storageBarrier();
    workgroupBarrier();
}

@compute @workgroup_size(THREADS)
fn first_levels(@builtin(local_invocation_index) local: u32) {
    if local == 0u {
        state.tolerance = sight.tolerance;
        atomicStore(&state.candidates, 0u);
        atomicStore(&state.used, 1u);
        atomicStore(&state.vertices, 0u);
        atomicStore(&state.reached, 0u);
        atomicStore(&state.count, 0);
        state.firsts[0] = 0u;
        places[0] = Place(vec2u(0u), ABSENT, ABSENT);
        let seen = look(vec2u(0u), 0u, bitcast<f32>(LARGEST));
        looks[0] = seen;
        if kind(seen) == WHOLE {
            add(seen.above, 2);
        }
    }
    hand_on(local);
    done();
    for (var level = 0u; level < FIRST_LEVELS; level++) {
        let i = state.firsts[level] + local;
        if level < sight.finest {
            count_cell(i, level, local);
            done();
        }
        settle_level(level, local);
        done();
        if level >= sight.finest {
            break;
        }
        cut_cell(i, level, local);
        done();
    }
}

@compute @workgroup_size(THREADS)
fn count(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    count_cell(state.firsts[here.number] + thread.x, here.number, local);
}

@compute @workgroup_size(THREADS)
fn settle(@builtin(local_invocation_index) local: u32) {
    settle_level(here.number, local);
}

@compute @workgroup_size(THREADS)
fn cut_level(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    // Bound to what the land says of the level below, whose number it is told.
    let level = here.number - 1u;
    cut_cell(state.firsts[level] + thread.x, level, local);
}
