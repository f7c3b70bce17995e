// The passes that change which diamonds are split: *start*, then by turns *look*, which measures and splits, and *settle*, which raises the tolerance where triangles run
// out; *rest* does what is left of both; *drop* merges what the raised tolerance no longer asks for, and *sum* numbers what is split.

// Triangles by the priority (pixels) above which they are there.
@group(0) @binding(7) var<storage, read_write> bins: array<atomic<i32>>;
// Workgroups of the passes to come: over the entries to look at, over the whole list, over busy blocks, over what is split.
@group(1) @binding(0) var<storage, read_write> workgroups: array<u32, 12>;

// Bits of a number that do not tell bins apart: 256 bins to an octave.
const SHIFT = 15u;
const BINS = (INFINITE >> SHIFT) + 1u;

// What a workgroup has to add up.
var<workgroup> more: atomic<i32>;
var<workgroup> reached: atomic<u32>;
var<workgroup> lost: atomic<u32>;

// Greatest vertical distance to the surface (m), and the greatest error in pixels of all that needs a diamond, 0 where none is seen.
struct Measured {
    deviation: f32,
    pixels: f32,
}

// The farthest that a box reaches along a direction. Sums are spelt out, so that each compilation rounds them alike: a box within another never
// reaches farther.
fn reach(normal: vec3f, low: vec3f, high: vec3f) -> f32 {
    let corner = select(low, high, normal >= vec3f(0.0));
    return fma(normal.x, corner.x, fma(normal.y, corner.y, normal.z * corner.z));
}

fn along(at: vec2i) -> vec2f {
    return fma(vec2f(at - sight.eye), sight.scale, -sight.rest);
}

fn height_of(step: u32) -> f32 {
    return fma(f32(step), sight.height_step, sight.base);
}

fn measure(at: vec2u) -> Measured {
    let unit = unit_of(at);
    var measured = Measured(0.0, 0.0);
    var span = vec2f(0.0);
    if unit == 0u {
        let corners = corners_of(at);
        if any_void(corners) {
            return measured;
        }
        let h = bitcast<vec4f>(corners);
        let sizes = abs(h);
        let size = max(max(sizes.x, sizes.y), max(sizes.z, sizes.w));
        // A quarter of the twist, and what rounding may take.
        let twist = fma(size, 1.1920929e-7, 0.25 * abs((h.x - h.y) - (h.z - h.w)));
        measured.deviation = bitcast<f32>((bitcast<u32>(twist) + 15u) & ~15u);
        let within = vec2f(min(min(h.x, h.y), min(h.z, h.w)), max(max(h.x, h.y), max(h.z, h.w)));
        // In whole steps, as what needs it.
        let step = vec2u(max((within - sight.base) / sight.height_step, vec2f(0.0)));
        span = vec2f(height_of(step.x), height_of(step.y));
        span = vec2f(
            select(span.x, height_of(max(step.x, 1u) - 1u), span.x > within.x),
            select(span.y, height_of(step.y + 1u), span.y < within.y),
        );
    } else {
        let number = number_of(at);
        if number == NONE {
            return measured;
        }
        let known = packed(number);
        let low = known.y & 0xffffu;
        let high = known.y >> 16u;
        if low > high {
            return measured;
        }
        measured.deviation = bitcast<f32>(known.x & ~15u);
        span = vec2f(height_of(low), height_of(high));
    }

    let odd = (at >> vec2u(unit)) & vec2u(1u);
    let half = i32((1u + odd.x + odd.y) << unit);
    let low = vec3f(along(vec2i(at) - half), span.x - sight.height);
    let high = vec3f(along(vec2i(at) + half), span.y - sight.height);
    let far = max(abs(low), abs(high));
    let slack = -2e-6 * (far.x + far.y + far.z);
    var inside = reach(sight.sides[0].xyz, low, high);
    for (var i = 1u; i < 4u; i++) {
        inside = min(inside, reach(sight.sides[i].xyz, low, high));
    }
    if inside < slack || reach(sight.forward.xyz, low, high) < sight.forward.w {
        return measured;
    }

    let depth = max(-reach(-sight.forward.xyz, low, high), sight.forward.w);
    let flat = fma(far.x, far.x, far.y * far.y);
    var wrong = measured.deviation;
    var distance = sqrt(flat);
    if wrong > bitcast<f32>(LARGEST) {
        // What is partly void is as far off as it is large.
        let size = high - low;
        wrong = sqrt(fma(size.x, size.x, fma(size.y, size.y, size.z * size.z))) * 1.0001;
        distance = sqrt(fma(far.z, far.z, flat));
    }
    let near = 1.0 / depth;
    let pixels = wrong * (sight.focal * 1.00002) * min(distance * near * near, sight.stretch * near);
    // Roots and quotients may be rounded as the device likes: parents get that little more than their children.
    let depth_in_tree = 2u * (sight.samples_level - unit) + select(1u, 0u, all(odd == vec2u(1u)));
    measured.pixels = min(pixels * fma(f32(2u * sight.samples_level - depth_in_tree), 2e-6, 1.0), bitcast<f32>(LARGEST));
    return measured;
}

// How many triangles a split adds.
fn cost(at: vec2u) -> i32 {
    let border = any(at == vec2u(0u)) || any(at == vec2u(steps()));
    return select(2, 1, border);
}

// What is split at tolerances below a number of pixels.
fn add(at: vec2u, pixels: f32) {
    atomicAdd(&bins[bitcast<u32>(pixels) >> SHIFT], cost(at));
    atomicAdd(&more, cost(at));
}

// What is not split. Numbers that are not negative are in the order of their bits.
fn leave(measured: Measured) {
    atomicMax(&reached, bitcast<u32>(measured.pixels));
    if measured.pixels > sight.tolerance && measured.deviation > bitcast<f32>(LARGEST) {
        atomicMax(&lost, 1u);
    }
}

fn hand_on(local: u32) {
    workgroupBarrier();
    if local == 0u {
        let sum = atomicExchange(&more, 0);
        if sum != 0 {
            atomicAdd(&state.count, sum);
        }
        atomicMax(&state.reached, atomicExchange(&reached, 0u));
        atomicMax(&state.lost, atomicExchange(&lost, 0u));
    }
}

fn split(at: vec2u, measured: Measured) {
    let slot = atomicAdd(&state.used, 1u);
    if slot >= sight.room {
        leave(measured);
        return;
    }
    let number = number_of(at);
    let bit = 1u << (number & 31u);
    if (atomicOr(&words[number >> 5u].bits, bit) & bit) != 0u {
        // Its other parent was faster.
        list[slot] = Entry(NONE, 0u);
        return;
    }
    atomicAdd(&blocks[number / (32u * BLOCK)].count, 1u);
    list[slot] = Entry(pack(at), bitcast<u32>(measured.pixels));
    add(at, measured.pixels);
}

fn merge(number: u32) {
    let bit = 1u << (number & 31u);
    if (atomicAnd(&words[number >> 5u].bits, ~bit) & bit) != 0u {
        atomicSub(&blocks[number / (32u * BLOCK)].count, 1u);
    }
}

// Looks at an entry of the list: at the diamond itself, if it was split for the view before, and at its children. A child can be split once both of its parents are; whoever
// of them comes second sees to it. Of two that were split before, it is the child's first parent.
fn look_at(i: u32) {
    let again = state.wave == 0u;
    let root = again && i == state.end;
    if i > state.end || (i == state.end && !root) {
        return;
    }
    var at = vec2u(steps() / 2u);
    var above = bitcast<f32>(LARGEST);
    if !root {
        let entry = list[i];
        if entry.at == NONE || (!again && bitcast<f32>(entry.pixels) <= state.tolerance) {
            return;
        }
        at = unpack(entry.at);
        above = bitcast<f32>(entry.pixels);
    }
    let unit = unit_of(at);
    let odd = (at >> vec2u(unit)) & vec2u(1u);
    let square = all(odd == vec2u(1u));
    let half = i32(1u << unit);
    for (var k = select(1u, 0u, again); k < select(5u, 1u, root); k++) {
        var here = at;
        var ready = true;
        if k > 0u {
            // South, east, north, west of a cell's middle; around a side's.
            let turn = k - 1u;
            let ahead = vec2i(select(0, select(1, -1, turn == 3u), turn % 2u == 1u), select(0, select(1, -1, turn == 0u), turn % 2u == 0u));
            let left = vec2i(-ahead.y, ahead.x);
            let by = select((ahead - left) * half / 2, ahead * half, square);
            let child = vec2i(at) + by;
            if any(child < vec2i(0)) || any(child > vec2i(i32(steps()))) {
                continue;
            }
            here = vec2u(child);
            var first = by.x < 0;
            if square {
                first = turn < 2u || (turn == 2u && here.y == steps()) || (turn == 3u && here.x == 0u);
            }
            let other = child + by;
            if all(other >= vec2i(0)) && all(other <= vec2i(i32(steps()))) {
                ready = is_split(number_of(vec2u(other)));
            }
            if !first && (again || !ready) {
                continue;
            }
            if unit_of(here) > 0u && is_split(number_of(here)) {
                continue;
            }
        }
        var measured = measure(here);
        if k == 0u && !root {
            above = measured.pixels;
            list[i].pixels = bitcast<u32>(above);
            if above <= state.tolerance {
                merge(number_of(here));
                leave(measured);
                return;
            }
            add(here, above);
            continue;
        }
        if root && sight.samples_level > 0u && is_split(number_of(here)) {
            return;
        }
        measured.pixels = min(measured.pixels, above);
        // Cells of a finer level than allowed are not made.
        if measured.pixels <= state.tolerance || sight.samples_level - unit_of(here) >= sight.finest {
            leave(measured);
        } else if ready {
            split(here, measured);
        }
    }
}

const PART = (BINS + THREADS - 1u) / THREADS;
var<workgroup> sums: array<i32, THREADS>;
var<workgroup> excess: u32;

// The number of triangles in the bin that is so far from the last.
fn from_top(i: u32) -> i32 {
    if i >= BINS {
        return 0;
    }
    return atomicLoad(&bins[BINS - 1u - i]);
}

// Raises the tolerance until it takes no more triangles than allowed, and says what is looked at next.
fn settle_wave(local: u32) {
    if local == 0u {
        let used = min(atomicLoad(&state.used), sight.room);
        atomicStore(&state.used, used);
        state.begin = state.end;
        state.end = used;
        state.wave += 1u;
        workgroups[0] = (state.end - state.begin + THREADS - 1u) / THREADS;
        workgroups[1] = 1u;
        workgroups[2] = 1u;
        workgroups[3] = (used + THREADS - 1u) / THREADS;
        workgroups[4] = 1u;
        workgroups[5] = 1u;
        excess = select(0u, 1u, atomicLoad(&state.count) > i32(sight.most));
    }
    if workgroupUniformLoad(&excess) == 0u {
        return;
    }
    var sum = 0;
    for (var i = local * PART; i < (local + 1u) * PART; i++) {
        sum += from_top(i);
    }
    sums[local] = sum;
    workgroupBarrier();
    if local == 0u {
        // The first bin, from the largest down, with which there would be too many.
        let most = i32(sight.most);
        var count = 2;
        var part = 0u;
        while part < THREADS && count + sums[part] <= most {
            count += sums[part];
            part += 1u;
        }
        var i = part * PART;
        while i + 1u < BINS && count + from_top(i) <= most {
            count += from_top(i);
            i += 1u;
        }
        state.tolerance = max(state.tolerance, bitcast<f32>(((BINS - 1u - min(i, BINS - 1u) + 1u) << SHIFT) - 1u));
        atomicStore(&state.count, count);
        excess = BINS - min(i, BINS - 1u);
    }
    // What is below the new tolerance is no more.
    let below = workgroupUniformLoad(&excess);
    for (var i = local; i < below; i += THREADS) {
        atomicStore(&bins[i], 0);
    }
}

@compute @workgroup_size(1)
fn start() {
    state.tolerance = sight.tolerance;
    state.begin = 0u;
    state.end = state.listed;
    state.wave = 0u;
    atomicStore(&state.count, 2);
    atomicStore(&state.used, state.listed);
    atomicStore(&state.reached, 0u);
    atomicStore(&state.lost, 0u);
    // One more, for the whole face.
    workgroups[0] = state.listed / THREADS + 1u;
    workgroups[1] = 1u;
    workgroups[2] = 1u;
}

@compute @workgroup_size(THREADS)
fn look(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    look_at(state.begin + thread.x);
    hand_on(local);
}

@compute @workgroup_size(THREADS)
fn settle(@builtin(local_invocation_index) local: u32) {
    settle_wave(local);
}

var<workgroup> range: vec2u;

@compute @workgroup_size(THREADS)
fn rest(@builtin(local_invocation_index) local: u32) {
    loop {
        if local == 0u {
            range = vec2u(state.begin, state.end);
        }
        let here = workgroupUniformLoad(&range);
        if here.x >= here.y {
            break;
        }
        for (var i = here.x + local; i < here.y; i += THREADS) {
            look_at(i);
        }
        hand_on(local);
        storageBarrier();
        workgroupBarrier();
        settle_wave(local);
        storageBarrier();
        workgroupBarrier();
    }
}

@compute @workgroup_size(THREADS)
fn drop(@builtin(global_invocation_id) thread: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = thread.x;
    if state.tolerance > sight.tolerance && i < atomicLoad(&state.used) {
        let entry = list[i];
        let pixels = bitcast<f32>(entry.pixels);
        if entry.at != NONE && pixels <= state.tolerance {
            let number = number_of(unpack(entry.at));
            merge(number);
            leave(Measured(bitcast<f32>(packed(number).x & ~15u), pixels));
        }
    }
    hand_on(local);
}

var<workgroup> counts: array<vec2u, THREADS>;

@compute @workgroup_size(THREADS)
fn sum(@builtin(local_invocation_index) local: u32) {
    let part = (sight.blocks + THREADS - 1u) / THREADS;
    let first = min(local * part, sight.blocks);
    let end = min(first + part, sight.blocks);
    var count = vec2u(0u);
    for (var i = first; i < end; i++) {
        let here = atomicLoad(&blocks[i].count);
        count += vec2u(here, select(0u, 1u, here > 0u));
    }
    counts[local] = count;
    workgroupBarrier();
    if local == 0u {
        var before = vec2u(0u);
        for (var i = 0u; i < THREADS; i++) {
            let here = counts[i];
            counts[i] = before;
            before += here;
        }
        state.listed = before.x;
        workgroups[6] = before.y;
        workgroups[7] = 1u;
        workgroups[8] = 1u;
        // One more, for the face's corners.
        workgroups[9] = before.x / THREADS + 1u;
        workgroups[10] = 1u;
        workgroups[11] = 1u;
    }
    workgroupBarrier();
    var before = counts[local];
    for (var i = first; i < end; i++) {
        let here = atomicLoad(&blocks[i].count);
        if here > 0u {
            blocks[i].start = before.x;
            blocks[before.y].busy = i;
            before += vec2u(here, 1u);
        }
    }
}
