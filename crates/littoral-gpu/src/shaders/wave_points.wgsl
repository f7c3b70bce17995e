// Where the points of the sea's grid are at an instant.

// From the eye (m).
@group(0) @binding(3) var<storage, read_write> points: array<vec4f>;

@compute @workgroup_size(64)
fn move_points(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= grid.size.x || id.y >= grid.size.y {
        return;
    }
    let rest = rest_of(id.x, id.y);
    let radius = radii[id.y];
    // Waves that the grid would show wrongly are left to the light.
    let moved = waves_displacement(rest, radii[id.y + 1u] - radius) * (1.0 - step_between(grid.far.x, grid.far.y, radius));
    let at = rest + moved.xy;
    points[id.y * grid.size.x + id.x] = vec4f(at, frame.water.x + moved.z - drop_of(at), 0.0);
}
