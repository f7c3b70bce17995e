// The transform of whole lines in the memory of a workgroup, all steps at once: memory is read and written once in each direction. Goes on from
// sea_waves.wgsl.
//
// A workgroup has 1024 numbers: one line of 1024, or two of 512, and so on. Each of its 128 invocations joins eight of them at a
// time, by one radix of 8 or two of 4.

const NUMBERS: u32 = 1024u;
const INVOCATIONS: u32 = 128u;

var<workgroup> line_numbers: array<vec4f, NUMBERS>;

// An invocation's part in a step of its line.
struct Part {
    samples: u32,
    // Which of the samples / 8 invocations of the line it is.
    index: u32,
    radix: u32,
    span: u32,
}

// The join of the q-th of its eight numbers, which of those joined it is, and so where it comes from and goes to.
fn join_of(part: Part, q: u32) -> u32 {
    return part.index + select(0u, (q / 4u) * (part.samples / 8u), part.radix == 4u);
}

fn source_of(part: Part, q: u32) -> u32 {
    return join_of(part, q) + (q % part.radix) * (part.samples / part.radix);
}

fn goal_of(part: Part, q: u32) -> u32 {
    let j = join_of(part, q);
    let k = j % part.span;
    return (j - k) * part.radix + k + (q % part.radix) * part.span;
}

fn radix_of(samples: u32, span: u32) -> u32 {
    let left = firstTrailingBit(samples / span);
    return select(8u, 4u, left == 4u || left == 2u);
}

struct Eight {
    v: array<vec4f, 8>,
}

// Turns the numbers of a step and joins them.
fn step_of(part: Part, given: Eight) -> Eight {
    var v = given.v;
    if part.span > 1u {
        let stride = arrayLength(&turns) / (part.span * part.radix);
        v[1] = turned(v[1], turns[(1u % part.radix) * (join_of(part, 1u) % part.span) * stride]);
        v[2] = turned(v[2], turns[(2u % part.radix) * (join_of(part, 2u) % part.span) * stride]);
        v[3] = turned(v[3], turns[(3u % part.radix) * (join_of(part, 3u) % part.span) * stride]);
        v[4] = turned(v[4], turns[(4u % part.radix) * (join_of(part, 4u) % part.span) * stride]);
        v[5] = turned(v[5], turns[(5u % part.radix) * (join_of(part, 5u) % part.span) * stride]);
        v[6] = turned(v[6], turns[(6u % part.radix) * (join_of(part, 6u) % part.span) * stride]);
        v[7] = turned(v[7], turns[(7u % part.radix) * (join_of(part, 7u) % part.span) * stride]);
    }
    if part.radix == 4u {
        let low = joined(v[0], v[1], v[2], v[3]);
        let high = joined(v[4], v[5], v[6], v[7]);
        return Eight(array<vec4f, 8>(low.a, low.b, low.c, low.d, high.a, high.b, high.c, high.d));
    }
    let even = joined(v[0], v[2], v[4], v[6]);
    let odd = joined(v[1], v[3], v[5], v[7]);
    let eighth = vec2f(0.70710678);
    let b = turned(odd.b, eighth);
    let c = times_i(odd.c);
    let d = turned(odd.d, vec2f(-eighth.x, eighth.y));
    return Eight(array<vec4f, 8>(
        even.a + odd.a,
        even.b + b,
        even.c + c,
        even.d + d,
        even.a - odd.a,
        even.b - b,
        even.c - c,
        even.d - d,
    ));
}

// All steps of a line from what the first reads; what the last leaves belongs at goal_of. `place` is where number 0 of the line stands.
fn whole_line(first: Part, place: u32, given: Eight) -> Eight {
    var part = first;
    var eight = step_of(part, given);
    while part.span * part.radix < part.samples {
        workgroupBarrier();
        line_numbers[place + goal_of(part, 0u)] = eight.v[0];
        line_numbers[place + goal_of(part, 1u)] = eight.v[1];
        line_numbers[place + goal_of(part, 2u)] = eight.v[2];
        line_numbers[place + goal_of(part, 3u)] = eight.v[3];
        line_numbers[place + goal_of(part, 4u)] = eight.v[4];
        line_numbers[place + goal_of(part, 5u)] = eight.v[5];
        line_numbers[place + goal_of(part, 6u)] = eight.v[6];
        line_numbers[place + goal_of(part, 7u)] = eight.v[7];
        workgroupBarrier();
        part.span *= part.radix;
        part.radix = radix_of(part.samples, part.span);
        eight = Eight(array<vec4f, 8>(
            line_numbers[place + source_of(part, 0u)],
            line_numbers[place + source_of(part, 1u)],
            line_numbers[place + source_of(part, 2u)],
            line_numbers[place + source_of(part, 3u)],
            line_numbers[place + source_of(part, 4u)],
            line_numbers[place + source_of(part, 5u)],
            line_numbers[place + source_of(part, 6u)],
            line_numbers[place + source_of(part, 7u)],
        ));
        eight = step_of(part, eight);
    }
    return eight;
}

// The part of the last step.
fn last_part(first: Part) -> Part {
    var part = first;
    while part.span * part.radix < part.samples {
        part.span *= part.radix;
        part.radix = radix_of(part.samples, part.span);
    }
    return part;
}

fn keep(start: u32, part: Part, q: u32, value: vec4f) {
    after[start + goal_of(part, q)] = value;
}

@compute @workgroup_size(INVOCATIONS)
fn along_x(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) invocation: u32) {
    let samples_ = pass_.samples;
    let lines = NUMBERS / samples_;
    let own = invocation / (samples_ / 8u);
    // Lines beyond the last do the last one's work in vain: all must meet at the barriers.
    let asked = group.x * lines + own;
    let line = min(asked, 2u * pass_.rows);
    let part = Part(samples_, invocation % (samples_ / 8u), radix_of(samples_, 1u), 1u);
    let n = i32(line) - i32(pass_.rows);
    let tile = tiles[tile_of(group.y)];
    let half = group.y % 2u;
    let given = Eight(array<vec4f, 8>(
        packed(tile, half, source_of(part, 0u), n),
        packed(tile, half, source_of(part, 1u), n),
        packed(tile, half, source_of(part, 2u), n),
        packed(tile, half, source_of(part, 3u), n),
        packed(tile, half, source_of(part, 4u), n),
        packed(tile, half, source_of(part, 5u), n),
        packed(tile, half, source_of(part, 6u), n),
        packed(tile, half, source_of(part, 7u), n),
    ));
    let eight = whole_line(part, own * samples_, given);
    if asked != line {
        return;
    }
    let last = last_part(part);
    let row = (line + samples_ - pass_.rows) % samples_;
    let start = (group.y * samples_ + row) * samples_;
    keep(start, last, 0u, eight.v[0]);
    keep(start, last, 1u, eight.v[1]);
    keep(start, last, 2u, eight.v[2]);
    keep(start, last, 3u, eight.v[3]);
    keep(start, last, 4u, eight.v[4]);
    keep(start, last, 5u, eight.v[5]);
    keep(start, last, 6u, eight.v[6]);
    keep(start, last, 7u, eight.v[7]);
}

fn from_row(start: u32, i: u32) -> vec4f {
    if min(i, pass_.samples - i) > pass_.rows {
        return vec4f(0.0);
    }
    return before[start + i * pass_.samples];
}

@compute @workgroup_size(INVOCATIONS)
fn along_y(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) invocation: u32) {
    let samples_ = pass_.samples;
    let lines = NUMBERS / samples_;
    // Neighbours read neighbouring columns.
    let own = invocation % lines;
    let asked = group.x * lines + own;
    let x = min(asked, samples_ - 1u);
    let part = Part(samples_, invocation / lines, radix_of(samples_, 1u), 1u);
    let start = group.y * samples_ * samples_ + x;
    let given = Eight(array<vec4f, 8>(
        from_row(start, source_of(part, 0u)),
        from_row(start, source_of(part, 1u)),
        from_row(start, source_of(part, 2u)),
        from_row(start, source_of(part, 3u)),
        from_row(start, source_of(part, 4u)),
        from_row(start, source_of(part, 5u)),
        from_row(start, source_of(part, 6u)),
        from_row(start, source_of(part, 7u)),
    ));
    let eight = whole_line(part, own * samples_, given);
    if asked != x {
        return;
    }
    let last = last_part(part);
    finish(group.y, vec2u(x, goal_of(last, 0u)), eight.v[0]);
    finish(group.y, vec2u(x, goal_of(last, 1u)), eight.v[1]);
    finish(group.y, vec2u(x, goal_of(last, 2u)), eight.v[2]);
    finish(group.y, vec2u(x, goal_of(last, 3u)), eight.v[3]);
    finish(group.y, vec2u(x, goal_of(last, 4u)), eight.v[4]);
    finish(group.y, vec2u(x, goal_of(last, 5u)), eight.v[5]);
    finish(group.y, vec2u(x, goal_of(last, 6u)), eight.v[6]);
    finish(group.y, vec2u(x, goal_of(last, 7u)), eight.v[7]);
}
