// One ray through the pyramid of ranges to the first point of the bilinear surface: the engine's `raycast::walk` in single precision, counted from an anchor.
//
// The ray moves from cell to cell, never back. It leaves a node that lies wholly below or above it in one step and tries the next coarser one; otherwise it
// looks at the next finer one, down to patches, where its height over the surface is a quadratic.
//
// Nothing slips through between two patches: cells are integers; where a line between cells is crossed is one expression; and the side of the surface that the
// ray is on is carried along, so that finding it on the other side is a hit, whatever was rounded.

struct Relief {
    // Patches along x and y; the cell that the anchor is in, or the land's nearest.
    cells: vec2i,
    anchor: vec2i,
    // The anchor from that cell's corner (cells); cells a metre.
    rest: vec2f,
    per_metre: vec2f,
    // The height that all others are counted from (m); the anchor over it; no surface is lower or higher.
    height: f32,
    above: f32,
    low: f32,
    high: f32,
    // What rounding may do to heights (m); the coarsest level; whether there are voids.
    hair: f32,
    top: i32,
    has_voids: u32,
    // Width of a ray of the picture at a distance of one length (m), 0 for exact hits.
    spread: f32,
    // Where each level's nodes begin, and its columns; the first is that of 2 × 2 patches.
    levels: array<vec4u, 24>,
}

@group(1) @binding(0) var<uniform> relief: Relief;
@group(1) @binding(1) var heights: texture_2d<f32>;
@group(1) @binding(2) var<storage, read> ranges: array<vec2f>;

// The distance of a ray that meets nothing, and of a line that is never crossed.
const NEVER = 3e38;
// Heights above this are voids.
const VOID = 1e37;
// Slower than this (cells a length) a ray stands still.
const STILL = 1e-12;
// The level to begin at: neither all the way down from the top nor all the way up.
const MIDDLE = 5;

// The bilinear height between the corners south-west, south-east, north-west, north-east. In this form it is exactly the neighbour's at 0 and 1.
fn blend(h: vec4f, at: vec2f) -> f32 {
    let west = h.xz * (1.0 - at.x) + h.yw * at.x;
    return west.x * (1.0 - at.y) + west.y * at.y;
}

// The distance, in lengths of `direction`, at which a ray that starts at `from_` (m from the anchor) first meets the surface, from above or below; `NEVER` beyond
// `reach`. Where the ray, `spread` metres wide at a distance of one length, is as wide as a node, it meets the node's
// box; 0 for exact hits.
fn first_hit(from_: vec3f, direction: vec3f, reach: f32, spread: f32) -> f32 {
    let origin = from_.xy * relief.per_metre + relief.rest;
    let way = direction.xy * relief.per_metre;
    let z = from_.z + relief.above;
    let still = abs(way) < vec2f(STILL);
    let inverse = 1.0 / select(way, vec2f(1.0), still);
    // 1 where the ray runs forward: the line that it leaves a cell by is so many further.
    let ahead = select(vec2i(0), vec2i(1), way >= vec2f(0.0));
    let behind = 1 - ahead;
    let forward = 2 * ahead - 1;

    // The part of the ray over the raster and between its lowest and highest height.
    let border = vec4f(vec4i(-relief.anchor, relief.cells - relief.anchor));
    if any(still & ((origin < border.xy) | (origin > border.zw))) {
        return NEVER;
    }
    let enters = select((select(border.zw, border.xy, ahead == vec2i(1)) - origin) * inverse, vec2f(-NEVER), still);
    let leaves = select((select(border.xy, border.zw, ahead == vec2i(1)) - origin) * inverse, vec2f(NEVER), still);
    var t = max(max(enters.x, enters.y), 0.0);
    var end = min(min(leaves.x, leaves.y), reach);
    if abs(direction.z) > 1e-20 {
        let bounds = (vec2f(relief.low, relief.high) - z) / direction.z;
        t = max(t, min(bounds.x, bounds.y));
        end = min(end, max(bounds.x, bounds.y));
    } else if z < relief.low || z > relief.high {
        return NEVER;
    }
    if t > end {
        return NEVER;
    }

    let width = spread * min(relief.per_metre.x, relief.per_metre.y);
    var level = min(relief.top, MIDDLE);
    var cell = vec2i(clamp(floor(origin + t * way), border.xy, border.zw - 1.0));
    // The side of the surface that the ray is on: 1 above, -1 below, 0 not known.
    var side = 0.0;
    // Every second step goes to another cell, and cells are never returned to.
    let most = 2 * (relief.cells.x + relief.cells.y) + 64;
    for (var i = 0; i < most; i++) {
        let node = (cell + relief.anchor) >> vec2u(u32(level));
        // Lines as they are numbered in the raster, and then from the anchor.
        let lines = (node + ahead) << vec2u(u32(level));
        let next = select((vec2f(lines - relief.anchor) - origin) * inverse, vec2f(NEVER), still);
        let leave = max(min(min(next.x, next.y), end), t);
        let z0 = z + t * direction.z;
        let z1 = z + leave * direction.z;
        if level > 0 {
            let stored = relief.levels[level - 1];
            let range = ranges[stored.x + u32(node.y) * stored.y + u32(node.x)];
            let low = range.x - relief.height - relief.hair;
            let high = range.y - relief.height + relief.hair;
            var seen = 0.0;
            if range.x <= range.y {
                let clear_above = min(z0, z1) > high;
                if !clear_above && max(z0, z1) >= low {
                    if f32(1 << u32(level)) <= width * t {
                        // As wide as the node, and on its way into it: met where it comes to its top, or its bottom.
                        if z0 > high || z0 < low {
                            return clamp((select(low, high, z0 > high) - z) / direction.z, t, leave);
                        }
                        return t;
                    }
                    level -= 1;
                    continue;
                }
                seen = select(-1.0, 1.0, clear_above);
            }
            // Beside a hole both sides of the surface are one.
            seen = select(seen, 0.0, relief.has_voids != 0u);
            if seen * side < 0.0 {
                return t;
            }
            side = seen;
        } else {
            let corners = vec4f(
                textureLoad(heights, node, 0).x,
                textureLoad(heights, node + vec2i(1, 0), 0).x,
                textureLoad(heights, node + vec2i(0, 1), 0).x,
                textureLoad(heights, node + 1, 0).x,
            );
            if max(max(corners.x, corners.y), max(corners.z, corners.w)) > VOID {
                side = 0.0;
            } else {
                let h = corners - relief.height;
                let corner = vec2f(cell);
                let entered = select((vec2f(cell + behind) - origin) * inverse, vec2f(-NEVER), still);
                // On a line it is exactly there.
                let begin = select(saturate(origin + t * way - corner), vec2f(behind), entered >= vec2f(t));
                let finish = select(saturate(origin + leave * way - corner), vec2f(ahead), next <= vec2f(leave));
                let f0 = z0 - blend(h, begin);
                let f1 = z1 - blend(h, finish);
                side = select(side, sign(f0), side == 0.0);
                // f(s) = g0 + slope·s + bend·s², seen from above: the bilinear term is all the curvature there is.
                let g0 = f0 * side;
                let g1 = f1 * side;
                let along = finish - begin;
                let bend = -side * (h.x - h.y - h.z + h.w) * along.x * along.y;
                let slope = g1 - g0 - bend;
                let square = slope * slope - 4.0 * bend * g0;
                let dips = bend > 0.0 && slope < 0.0 && slope + 2.0 * bend > 0.0 && square >= 0.0;
                if g0 <= 0.0 {
                    return t;
                }
                if g1 <= 0.0 || dips {
                    // The smaller positive root, without a difference of nearly equal numbers.
                    let root = sqrt(max(square, 0.0));
                    var s = 0.0;
                    if slope < 0.0 {
                        s = 2.0 * g0 / (root - slope);
                    } else {
                        s = (slope + root) / (-2.0 * bend);
                    }
                    return t + saturate(s) * (leave - t);
                }
            }
        }
        if leave >= end {
            return NEVER;
        }
        // Across the nearer line. The other coordinate follows, but never back nor out of the node: where rounding has it a cell short, that cell is left at once.
        let over_x = next.x <= next.y;
        var follow = vec2i(clamp(floor(origin + leave * way), border.xy, border.zw - 1.0));
        // The last cell of the node, and the one beyond the line.
        let last = lines - relief.anchor - ahead;
        follow = select(clamp(follow, last, cell), clamp(follow, cell, last), ahead == vec2i(1));
        cell = select(vec2i(follow.x, last.y + forward.y), vec2i(last.x + forward.x, follow.y), over_x);
        t = leave;
        // Up a level where that line ends the coarser node as well.
        let line = select(lines.y, lines.x, over_x);
        level += select(0, 1, level < relief.top && (line & (1 << u32(level))) == 0);
    }
    return NEVER;
}
