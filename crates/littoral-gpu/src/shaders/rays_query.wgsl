// Rays in bulk: a distance for each.

struct Ray {
    origin: vec3f,
    reach: f32,
    direction: vec3f,
    spread: f32,
}

@group(0) @binding(0) var<storage, read> asked: array<Ray>;
@group(0) @binding(1) var<storage, read_write> distances: array<f32>;

@compute @workgroup_size(64)
fn query(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&asked) {
        return;
    }
    let ray = asked[id.x];
    // Of a length near 1 m, so that no direction is too short or too long.
    let size = max(max(abs(ray.direction.x), abs(ray.direction.y)), abs(ray.direction.z));
    let distance = first_hit(ray.origin, ray.direction / size, ray.reach * size, ray.spread / size);
    distances[id.x] = select(distance / size, NEVER, distance == NEVER);
}
