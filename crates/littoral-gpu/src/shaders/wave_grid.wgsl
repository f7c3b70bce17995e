// Rings of points about a place under or behind the eye, on which the sea is drawn: see waves/grid.rs.

struct Grid {
    // Azimuth of the first point of a ring and from one to the next (rad, counter-clockwise from east); the middle of the rings from the eye (m).
    fan: vec4f,
    // Points a ring and rings; points after which a ring closes.
    size: vec4u,
    // Radius from which on waves sink away (m), and at which they are gone.
    far: vec4f,
}

@group(0) @binding(1) var<uniform> grid: Grid;
// Of the rings, and of one more.
@group(0) @binding(2) var<storage, read> radii: array<f32>;

// Where the water of a point rests, from the eye (m).
fn rest_of(column: u32, ring: u32) -> vec2f {
    let azimuth = grid.fan.x + grid.fan.y * f32(column % grid.size.z);
    return grid.fan.zw + radii[ring] * vec2f(cos(azimuth), sin(azimuth));
}
