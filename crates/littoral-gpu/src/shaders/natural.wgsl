// Natural ground: the engine's `picture::natural`, line by line. Noise is told apart by its number in the frame (see `noises` in frame.rs).

struct Material {
    albedo: vec3f,
    normal: vec3f,
    openness: f32,
    wet: f32,
}

const FRESH_GRASS = vec3f(0.066, 0.086, 0.027);
const DRY_GRASS = vec3f(0.165, 0.138, 0.068);
const HEATH = vec3f(0.082, 0.066, 0.038);
const WOODS = vec3f(0.026, 0.037, 0.014);
const SOIL = vec3f(0.130, 0.097, 0.062);
const WARM_ROCK = vec3f(0.255, 0.212, 0.165);
const COOL_ROCK = vec3f(0.165, 0.158, 0.150);
const SCREE = vec3f(0.190, 0.170, 0.144);
const SAND = vec3f(0.450, 0.372, 0.262);
const MUD = vec3f(0.150, 0.122, 0.088);
const SNOW = vec3f(0.860, 0.880, 0.910);
const ROOF_TILES = vec3f(0.190, 0.085, 0.055);
const ROOF_SLATE = vec3f(0.115, 0.112, 0.115);
const PLASTER = vec3f(0.480, 0.445, 0.390);
const SEAGRASS = vec3f(0.030, 0.042, 0.022);

struct Site {
    // From the eye (m), and height above the sea (m).
    rel: vec2f,
    z: f32,
    footprint: f32,
    // Height over the water nearby (m); huge where there is none.
    above: f32,
    run_up: f32,
    standing: f32,
}

fn natural(site: Site, surface: Surface, broad: Surface) -> Material {
    let rel = site.rel;
    let z = site.z;
    let footprint = site.footprint;
    let spacing = frame.eye.w;
    let above = site.above;
    let normal = normal_of_slope(surface.slope);
    let steep = length(surface.slope);
    let blunt = min(log2(max(spacing / 3.0, 1.0)), 5.0) / 5.0;
    let rocky = step_between(0.58, 1.10, steep * (1.0 + 0.60 * blunt));

    // Relief below the samples.
    let shore_calm = step_between(0.5, 6.0, abs(above) + 12.0 * rocky);
    let amplitude = (0.060 + 0.24 * rocky - 0.07 * step_between(1.4, 2.4, steep)) * (0.25 + 0.75 * shore_calm);
    let layered = step_between(0.9, 1.8, steep);
    let both = length(vec2f(layered, 1.0 - layered));
    var relief = vec3f(0.0);
    var bumps = 0.0;
    var shown = 0.0;
    for (var octave = 0u; octave < 11u; octave++) {
        let share = resolved(frame.noise[octave].wavelength, footprint);
        if share == 0.0 {
            break;
        }
        for (var k = 0u; k < 2u; k++) {
            let part = select(1.0 - layered, layered, k == 1u) / both;
            if part > 0.0 {
                let upward = select(0.35, 2.05, k == 1u);
                let n = grain(octave, rel, z * upward);
                relief += n.gradient * vec3f(1.0, 1.0, upward) * (amplitude * share * part);
                bumps += n.value * share * part;
            }
        }
        shown += 1.0;
    }
    let roughened = normalize(normal - (relief - normal * dot(relief, normal)));
    let rough_steep = sqrt(max(1.0 - roughened.z * roughened.z, 0.0)) / max(roughened.z, 0.05);
    let pits = clamp(bumps / sqrt(max(shown, 1.0)), -1.0, 1.0);

    // Patches of growth, by wavelength.
    let regional = step_between(12.0, 40.0, spacing);
    var p: array<f32, 10>;
    for (var k = 0u; k < 10u; k++) {
        if regional > 0.0 || (k != 2u && k != 3u) {
            p[k] = patch_of(11u + k, rel, z, footprint);
        }
    }
    let thirty = p[5];
    let fourteen = p[9];
    let wide = (p[0] + 0.6 * p[1]) * (1.0 - 0.45 * regional) + regional * 0.75 * (p[2] + p[3]);
    let middle = p[4] + 0.6 * thirty;
    let fine = p[6] + 0.7 * p[7] + 0.5 * p[8];
    let moist = clamp(broad.hollow * max(spacing, 8.0) * 9.0, -1.0, 1.0);
    let tree_line = frame.climate.x;
    let snow_line = frame.climate.y;
    let alpine = step_between(tree_line - 350.0, tree_line + 450.0, z + 180.0 * middle + 120.0 * wide);

    let lush = saturate(0.52 + 0.55 * wide + 0.35 * middle + 0.35 * moist - 0.45 * alpine);
    var albedo = mix(DRY_GRASS, FRESH_GRASS, lush);
    albedo = mix(albedo, HEATH, step_between(0.10, 0.50, 0.6 * middle - 0.5 * wide + 0.25 * fine) * 0.75);
    albedo *= 1.0 + 0.30 * fine + 0.12 * pits;
    albedo = mix(albedo, SOIL, 0.5 * step_between(0.42, 0.70, rough_steep + 0.2 * fine));

    // Woods thin out with height, slope and near the sea.
    var openness = 1.0 + 0.25 * min(pits, 0.0);
    var shaded = roughened;
    let likes = 0.50 * wide + 0.55 * middle + 0.45 * moist - 0.9 * alpine - 0.45 * step_between(0.5, 0.9, steep) - 0.02;
    let clumps = 0.45 * thirty + 0.35 * fourteen + 0.25 * fine;
    let wood = step_between(-0.02, 0.22, likes + clumps) * step_between(5.0, 14.0, above) * (1.0 - 0.85 * rocky);
    if wood > 0.0 {
        let crown = resolved(7.0, footprint);
        var crowns = Grain(0.0, vec3f(0.0));
        if crown > 0.0 {
            crowns = grain(21u, rel, z);
        }
        let twigs = patch_of(22u, rel, z, footprint);
        let canopy = normalize(normal - crowns.gradient * (0.55 * crown) * vec3f(1.0, 1.0, 0.3));
        let tone = 1.0 + 0.45 * crown * crowns.value + 0.35 * twigs + 0.25 * fine;
        albedo = mix(albedo, WOODS * tone * (1.0 + 0.3 * wide), wood * 0.94);
        shaded = normalize(mix(shaded, canopy, wood));
        openness *= 1.0 - wood * clamp(0.22 - 0.35 * crown * crowns.value, 0.0, 0.5);
    }

    if site.standing > 1.0 {
        return stands(site, surface, albedo, normal);
    }

    // Bare ground: high, steep or washed by the sea.
    let scree = max(alpine, step_between(0.52, 0.80, rough_steep * (1.0 + 0.5 * blunt) + 0.12 * fine) * 0.85);
    albedo = mix(albedo, SCREE * (1.0 + 0.25 * fine + 0.15 * pits), scree * (0.55 + 0.45 * step_between(-0.3, 0.3, middle)));
    let washed = (1.0 - step_between(2.0, 5.0, above + 2.5 * middle)) * step_between(0.16, 0.34, max(steep, length(broad.slope)));
    let rock = max(step_between(0.68, 1.05, rough_steep * (1.0 + 0.60 * blunt) + 0.15 * fine), washed);
    if rock > 0.0 {
        // Beds of harder and softer stone, hardly tilted, and joints that run down through them.
        let cliff = step_between(0.9, 1.7, steep * (1.0 + 0.5 * blunt));
        let tall = max(spacing / 4.0, 1.0);
        let bed_z = (z + frame.climate.w + 0.06 * rel.x + 0.03 * rel.y) / tall;
        var bed = 0.0;
        for (var k = 0u; k < 3u; k++) {
            bed += patch_of(23u + k, rel, bed_z, footprint / tall) * select(select(0.35, 0.6, k == 1u), 1.0, k == 0u);
        }
        // Joints as wide as a valley would look like worms.
        let split = resolved(8.5 * tall, footprint) * cliff * (1.0 - step_between(6.0, 16.0, spacing));
        var joints = Grain(1.0, vec3f(0.0));
        if split > 0.0 {
            joints = grain(26u, rel, z);
        }
        let crack = split * step_between(0.16, 0.0, abs(joints.value));
        let lean = joints.gradient * vec3f(0.42, 0.42, 0.07) * split;
        shaded = normalize(shaded - (lean - normal * dot(lean, normal)) * rock);
        let warm = saturate(0.45 + 0.9 * bed + 0.45 * middle);
        let stone = mix(COOL_ROCK, WARM_ROCK, warm) * (1.0 + 0.32 * pits + 0.20 * fine + 0.30 * bed * cliff - 0.38 * crack);
        albedo = mix(albedo, stone, rock);
        openness *= 1.0 - rock * (0.15 * saturate(0.5 - pits) + 0.45 * crack);
    }

    // The shore.
    var wet = 0.0;
    if above < 12.0 {
        let gentle = (1.0 - step_between(0.20, 0.36, steep)) * (1.0 - step_between(0.22, 0.40, length(broad.slope)));
        let sand = (1.0 - step_between(1.7, 3.0, above + 0.7 * middle + 0.25 * fine)) * gentle;
        // Flats too level for waves to have built are mud and marsh.
        let flat_ground = 1.0 - step_between(0.003, 0.012, steep + 0.004 * middle);
        let marsh = mix(MUD, mix(FRESH_GRASS, DRY_GRASS, 0.55), step_between(0.2, 0.9, above + 0.4 * middle + 0.2 * fine));
        let tone = SAND * (1.0 + 0.10 * middle + 0.07 * fine);
        albedo = mix(albedo, mix(tone, marsh, flat_ground * step_between(-0.6, 0.0, above)), sand);
        shaded = normalize(mix(shaded, normal, 0.75 * sand));
        openness += (1.0 - openness) * sand;
        let reach = max(0.8 * site.run_up, 0.3);
        wet = 1.0 - step_between(0.2 * reach, 1.8 * reach, above + (0.12 * middle + 0.04 * fine) * sqrt(reach / 0.3));
        // Water fills the pores: less light comes back, of a deeper colour.
        albedo = mix(albedo, albedo * (0.30 + 0.45 * albedo), wet * (0.35 + 0.65 * max(sand, rock)));
    }
    if above < 0.0 {
        let grown = step_between(0.02, 0.48, 0.55 * middle + 0.5 * wide + 0.22 * fourteen + 0.2 * fine) * step_between(-1.2, -4.5, above);
        let soaked = 0.62 + 0.38 * step_between(0.0, -1.2, above);
        albedo = mix(mix(SAND * soaked, COOL_ROCK * 0.6, rock), SEAGRASS, grown * 0.85) * (1.0 + 0.12 * fine);
        wet = 0.0;
    }

    // Snow.
    let cover = z - snow_line + 260.0 * middle + 160.0 * wide + 240.0 * moist + 60.0 * fine;
    let snow = step_between(-120.0, 160.0, cover) * (1.0 - step_between(0.75, 1.05, rough_steep * (1.0 + 0.3 * blunt) + 0.1 * fine));
    if snow > 0.0 && above > 2.0 {
        albedo = mix(albedo, SNOW, snow);
        shaded = normalize(mix(shaded, normal, 0.6 * snow));
        openness += (1.0 - openness) * snow;
    }
    return Material(clamp(albedo, vec3f(0.01), vec3f(0.92)), shaded, openness, wet);
}

// What stands on the ground: trees where the surface is rough, houses where it is even.
fn stands(site: Site, surface: Surface, ground: vec3f, normal: vec3f) -> Material {
    let rel = site.rel;
    let z = site.z;
    let footprint = site.footprint;
    let steep = length(surface.slope);
    let rough = step_between(0.10, 0.32, abs(surface.hollow) * frame.eye.w + 0.10 * max(steep - 1.0, 0.0))
        * (1.0 - step_between(24.0, 34.0, site.standing));
    var both: array<Grain, 2>;
    for (var k = 0u; k < 2u; k++) {
        both[k] = grain(27u + k, rel, z);
    }
    let leaves = both[0];
    let twigs = both[1];
    // Kinds of trees; kinds of houses, whatever the footprint; tiles.
    var p: array<f32, 4>;
    for (var k = 0u; k < 4u; k++) {
        p[k] = patch_of(29u + k, rel, z, select(footprint, 0.1, k == 1u || k == 2u));
    }
    let near = resolved(1.7, footprint);
    let nearer = resolved(0.6, footprint);
    let shaken = leaves.gradient * (0.6 * near) + twigs.gradient * (0.4 * nearer);
    let tree = WOODS * (1.5 + 0.9 * p[0] + 0.5 * near * leaves.value + 0.5 * nearer * twigs.value);
    let kind = p[1] + 0.5 * p[2];
    let roof = mix(ROOF_TILES, ROOF_SLATE, step_between(-0.02, 0.06, kind)) * (1.0 + 0.15 * p[3]);
    let house = mix(roof, PLASTER, step_between(1.3, 2.4, steep));
    let share = step_between(1.0, 2.2, site.standing);
    let leafy = normalize(normal - shaken * rough);
    return Material(
        mix(ground, mix(house, tree, rough), share),
        normalize(mix(normal, leafy, share)),
        1.0 - 0.25 * rough * share * saturate(0.5 - near * leaves.value),
        0.0,
    );
}
