// The transform as passes over memory, one for each step: for devices without fast memory in a workgroup. Goes on from sea_waves.wgsl.

// How many results a pass joins: 4 or 8.
override RADIX: u32 = 8u;
// Whether the pass is the first along x, which makes what it reads.
override FROM_WAVES: bool = false;
// Whether the pass is the first along y, where wave numbers that no tile has are to be read as 0.
override FROM_ROWS: bool = false;
// Whether the pass is the last along y, which writes samples.
override TO_SAMPLES: bool = false;

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
        return packed(tiles[tile_of(place.layer)], place.layer % 2u, i, place.n);
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
    if TO_SAMPLES {
        finish(place.layer, vec2u(place.x, i), value);
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
