//! What every model of waves keeps to, and the physics of the sums.
//!
//! A new model adds one test that calls [`conforms`].

use glam::DVec2;
use littoral::waves::cascades::{self, Cascades};
use littoral::waves::shore::{Bed, ShoreSea};
use littoral::waves::{
    BLOCK, Beach, Bounds, Length, Motion, Path, Peachey, PlaneWave, Points, STANDARD_GRAVITY, SeaState, Sine, Sines,
    StillWater, Superposition, Surf, Swell, Velocity, WaveModel,
};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::f64::consts::TAU;

/// Counts what each thread allocates.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: everything is left to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps to the contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps to the contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// What is to be expected of a model, and where to ask it.
#[derive(Clone, Copy, Debug)]
struct Expected {
    /// Middle and half the edge (m) of the square to ask in.
    middle: DVec2,
    reach: f64,
    /// Step (m) of differences between points, much smaller than the waves.
    step: f64,
    /// Greatest error of slopes, stretches and velocities against differences, in parts of their root mean squares.
    error: f64,
    /// Share of points that may lie on creases, where differences mean nothing.
    creases: f64,
    /// Whether water that is pushed sideways moves with the velocity below it: for free waves over deep water with the steepness of Gerstner's.
    flowing: bool,
    /// Greatest root mean square of the divergence of the velocity in parts of that of its largest term.
    divergence: f64,
    /// Whether sideways motion may curl, as where a bed turns waves: then `dxy` is the mean of both of its derivatives.
    curling: bool,
    /// How much velocities may err beyond that: they are linear waves' where crests are sharpened and fronts steepened.
    sharpened: f64,
    /// What may be left of the motion (m) where a footprint hides all waves: set-up by a shore.
    left: f32,
    /// Relative scatter of slopes' variance over a few thousand points.
    scatter: f64,
}

const USUAL: Expected = Expected {
    middle: DVec2::new(300.0, -700.0),
    reach: 2000.0,
    step: 0.02,
    error: 0.01,
    creases: 0.0,
    flowing: false,
    divergence: 3e-3,
    curling: false,
    left: 0.0,
    sharpened: 0.0,
    scatter: 0.1,
};

/// Everything that the trait promises.
fn conforms(model: &mut dyn WaveModel, expected: Expected) {
    stands_at_its_time(model);
    derivatives_are_those_of_the_displacement(model, expected);
    displacements_are_those_of_the_motion(model, expected);
    answers_add(model, expected);
    neighbours_do_not_matter(model, expected);
    many_blocks_are_answered_as_single_ones(model, expected);
    instants_may_come_in_any_order(model, expected);
    bounds_hold(model, expected);
    roughness_bounds_what_footprints_hide(model, expected);
    footprints_keep_the_slopes_variance(model, expected);
    nothing_is_ever_not_a_number(model);
    water_moves_with_its_surface(model, expected);
    motion_dies_out_and_keeps_the_volume(model, expected);
    nothing_is_allocated(model, expected);
}

/// Numbers in [0, 1) by counting (Weyl's sequence).
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *seed;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 * f64::exp2(-53.0)
}

/// Places all over, at footprint 0; every other block within some metres.
fn places(expected: Expected, seed: u64) -> Points {
    let mut state = seed.wrapping_mul(0x1234_5678_9abc_def1) ^ 77;
    let mut anywhere = || {
        let [x, y] = [0, 1].map(|_| 2.0 * random(&mut state) - 1.0);
        expected.middle + expected.reach * DVec2::new(x, y)
    };
    let first = anywhere();
    let place: [DVec2; BLOCK] =
        std::array::from_fn(|_| if seed.is_multiple_of(2) { first + (anywhere() - first) * 1e-3 } else { anywhere() });
    Points { x: place.map(|p| p.x), y: place.map(|p| p.y), footprint: [0.0; BLOCK] }
}

/// The same with footprints from none to as wide as the square.
fn blurred(expected: Expected, seed: u64) -> Points {
    let mut state = seed ^ 0xabcd;
    let mut footprint = || match (random(&mut state) * 8.0) as i32 {
        0 | 1 => 0.0,
        _ => (0.01 * (100.0 * expected.reach).powf(random(&mut state))) as f32,
    };
    Points { footprint: std::array::from_fn(|_| footprint()), ..places(expected, seed) }
}

fn shifted(points: &Points, by: DVec2) -> Points {
    Points { x: points.x.map(|x| x + by.x), y: points.y.map(|y| y + by.y), ..*points }
}

fn displacement(model: &dyn WaveModel, points: &Points) -> Motion {
    let mut motion = Motion::STILL;
    model.add_displacement(points, &mut motion);
    motion
}

fn motion(model: &dyn WaveModel, points: &Points) -> Motion {
    let mut motion = Motion::STILL;
    model.add_motion(points, &mut motion);
    motion
}

fn velocity(model: &dyn WaveModel, points: &Points, depths: [f32; BLOCK]) -> Velocity {
    let mut velocity = Velocity::STILL;
    model.add_velocity(points, &depths, &mut velocity);
    velocity
}

const FIELDS: usize = 12;

fn fields(motion: &Motion) -> [[f32; BLOCK]; FIELDS] {
    let Motion { dx, dy, dz, slope_x, slope_y, dxx, dxy, dyy, hidden_xx, hidden_xy, hidden_yy, foam } = *motion;
    [dx, dy, dz, slope_x, slope_y, dxx, dxy, dyy, hidden_xx, hidden_xy, hidden_yy, foam]
}

fn bits(motion: &Motion) -> [[u32; BLOCK]; FIELDS] {
    // Both zeros are one.
    fields(motion).map(|field| field.map(|number| (number + 0.0).to_bits()))
}

fn root_mean_square(numbers: &[f64]) -> f64 {
    (numbers.iter().map(|x| x * x).sum::<f64>() / numbers.len().max(1) as f64).sqrt()
}

/// Pairs of numbers agree to `error` of the root mean square of the second, but for a share of them.
fn agree(what: &str, pairs: &[(f64, f64)], error: f64, creases: f64) {
    let scale = root_mean_square(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>());
    let apart = |pair: &&(f64, f64)| (pair.0 - pair.1).abs() > error * scale + 1e-6;
    let wrong = pairs.iter().filter(apart).count();
    let most = (creases * pairs.len() as f64) as usize;
    let first = pairs.iter().find(apart);
    assert!(wrong <= most, "{what}: {wrong} of {} differ, scale {scale}, such as {first:?}", pairs.len());
}

fn stands_at_its_time(model: &mut dyn WaveModel) {
    for time in [0.0, 12.5, -3.0, 1e6] {
        model.set_time(time);
        assert_eq!(model.time(), time);
    }
}

fn derivatives_are_those_of_the_displacement(model: &mut dyn WaveModel, expected: Expected) {
    let h = expected.step;
    let mut pairs = [const { Vec::new() }; 6];
    for seed in 0..60 {
        model.set_time(seed as f64 * 17.3);
        let points = if seed % 3 == 0 { blurred(expected, seed) } else { places(expected, seed) };
        let here = motion(model, &points);
        let around =
            [DVec2::X, -DVec2::X, DVec2::Y, -DVec2::Y].map(|by| displacement(model, &shifted(&points, by * h)));
        let by = |of: fn(&Motion) -> &[f32; BLOCK], along: usize, lane: usize| {
            let [after, before] = [0, 1].map(|i| f64::from(of(&around[2 * along + i])[lane]));
            (after - before) / (2.0 * h)
        };
        for lane in 0..BLOCK {
            let found =
                [here.slope_x, here.slope_y, here.dxx, here.dxy, here.dxy, here.dyy].map(|f| f64::from(f[lane]));
            let mut differences = [
                by(|m| &m.dz, 0, lane),
                by(|m| &m.dz, 1, lane),
                by(|m| &m.dx, 0, lane),
                by(|m| &m.dx, 1, lane),
                by(|m| &m.dy, 0, lane),
                by(|m| &m.dy, 1, lane),
            ];
            if expected.curling {
                let mean = 0.5 * (differences[3] + differences[4]);
                (differences[3], differences[4]) = (mean, mean);
            }
            for (pairs, pair) in pairs.iter_mut().zip(differences.into_iter().zip(found)) {
                pairs.push(pair);
            }
        }
    }
    for (name, pairs) in ["slope_x", "slope_y", "dxx", "dxy", "dyx", "dyy"].iter().zip(&pairs) {
        // What differences of `f32` can tell.
        let bounds = model.bounds();
        let noise = 1e-6 * f64::from(bounds.height.max(bounds.sideways)) / h;
        let scale = root_mean_square(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>());
        let error = if scale > 0.0 { expected.error + noise / scale } else { 0.0 };
        agree(name, pairs, error, expected.creases);
    }
    assert!(pairs[0].iter().any(|pair| pair.1 != 0.0), "nothing moves");
}

fn displacements_are_those_of_the_motion(model: &mut dyn WaveModel, expected: Expected) {
    for seed in 0..40 {
        model.set_time(seed as f64 * 3.7);
        for points in [places(expected, seed), blurred(expected, seed)] {
            let (short, long) = (bits(&displacement(model, &points)), bits(&motion(model, &points)));
            assert_eq!(short[..3], long[..3], "{points:?}");
            assert!(short[3..].iter().flatten().all(|number| *number == 0), "more than displacements were asked for");
        }
    }
}

fn answers_add(model: &mut dyn WaveModel, expected: Expected) {
    model.set_time(21.0);
    let near = |sum: f32, a: f32, b: f32| (sum - (a + b)).abs() <= 1e-5 * (1.0 + a.abs() + b.abs());
    for seed in 0..10 {
        let points = blurred(expected, seed);
        let ones = [1.0; BLOCK];
        let before = Motion {
            dx: ones,
            dy: [2.0; BLOCK],
            dz: [-3.0; BLOCK],
            slope_x: [0.5; BLOCK],
            slope_y: [0.25; BLOCK],
            dxx: [0.125; BLOCK],
            dxy: ones,
            dyy: [-1.0; BLOCK],
            hidden_xx: [0.5; BLOCK],
            hidden_xy: [0.25; BLOCK],
            hidden_yy: [0.75; BLOCK],
            foam: [0.3; BLOCK],
        };
        let mut after = before;
        model.add_motion(&points, &mut after);
        let (alone, before, after) = (fields(&motion(model, &points)), fields(&before), fields(&after));
        for field in 0..FIELDS - 1 {
            for lane in 0..BLOCK {
                let (sum, a, b) = (after[field][lane], before[field][lane], alone[field][lane]);
                assert!(near(sum, a, b), "field {field}: {sum} is not {a} + {b}");
            }
        }
        for lane in 0..BLOCK {
            let foam = after[FIELDS - 1][lane];
            assert!((0.3..=1.0).contains(&foam) && foam >= alone[FIELDS - 1][lane] - 1e-6);
        }
        let mut twice = Velocity { x: ones, y: ones, z: ones };
        model.add_velocity(&points, &[0.5; BLOCK], &mut twice);
        let once = velocity(model, &points, [0.5; BLOCK]);
        for lane in 0..BLOCK {
            for (sum, part) in [(twice.x, once.x), (twice.y, once.y), (twice.z, once.z)] {
                assert!(near(sum[lane], 1.0, part[lane]), "velocities do not add");
            }
        }
    }
}

fn neighbours_do_not_matter(model: &mut dyn WaveModel, expected: Expected) {
    for seed in 0..12 {
        model.set_time(seed as f64 * 1234.5);
        for points in [places(expected, seed), blurred(expected, seed)] {
            let depths = std::array::from_fn(|lane| lane as f32 * 0.3);
            let (together, flow) = (bits(&motion(model, &points)), velocity(model, &points, depths));
            for lane in 0..BLOCK {
                let footprint = [points.footprint[lane]; BLOCK];
                let repeated = Points { footprint, ..Points::at(points.x[lane], points.y[lane]) };
                let alone = bits(&motion(model, &repeated));
                for field in 0..FIELDS {
                    for copy in [0, lane, BLOCK - 1] {
                        let (a, b) = (alone[field][copy], together[field][lane]);
                        assert_eq!(a, b, "field {field}, lane {lane} of {points:?}");
                    }
                }
                let slow = velocity(model, &repeated, [depths[lane]; BLOCK]);
                assert_eq!([slow.x[0], slow.y[3], slow.z[9]], [flow.x[lane], flow.y[lane], flow.z[lane]]);
            }
        }
    }
}

fn many_blocks_are_answered_as_single_ones(model: &mut dyn WaveModel, expected: Expected) {
    model.set_time(-77.0);
    let near = places(expected, 2);
    for count in [0, 1, 2, 3, 4, 5, 9] {
        let blocks = |of: &dyn Fn(u64) -> Points| (0..count).map(of).collect::<Vec<_>>();
        let neighbours = blocks(&|seed| shifted(&near, DVec2::new(seed as f64, 3.0)));
        for blocks in [neighbours, blocks(&|seed| places(expected, seed)), blocks(&|seed| blurred(expected, seed))] {
            let (mut short, mut long) = (vec![Motion::STILL; blocks.len()], vec![Motion::STILL; blocks.len()]);
            model.add_displacements(&blocks, &mut short);
            model.add_motions(&blocks, &mut long);
            for ((points, short), long) in blocks.iter().zip(&short).zip(&long) {
                assert_eq!(bits(short), bits(&displacement(model, points)));
                assert_eq!(bits(long), bits(&motion(model, points)));
            }
        }
    }
}

fn instants_may_come_in_any_order(model: &mut dyn WaveModel, expected: Expected) {
    let times: [f64; 6] = [0.0, 0.016, 5.0, -70.0, 86_400.0, 1e6];
    let points = blurred(expected, 5);
    let mut all = |times: &mut dyn Iterator<Item = f64>| -> Vec<_> {
        times
            .map(|time| {
                model.set_time(time);
                (bits(&motion(model, &points)), velocity(model, &points, [0.2; BLOCK]))
            })
            .collect()
    };
    let forward = all(&mut times.into_iter());
    let mut back = all(&mut times.into_iter().rev());
    back.reverse();
    assert!(forward == back, "what was asked before shows");
    assert!(forward[1..].iter().any(|other| other.0 != forward[0].0), "nothing changes with time");
}

fn bounds_hold(model: &mut dyn WaveModel, expected: Expected) {
    let mut most = Bounds::default();
    let mut creased = 0;
    for seed in 0..600 {
        if seed % 20 == 0 {
            model.set_time(seed as f64 * 1.7);
        }
        let m = motion(model, &places(expected, seed));
        let bounds = model.bounds();
        for lane in 0..BLOCK {
            let sideways = m.dx[lane].hypot(m.dy[lane]);
            let slope = m.slope_x[lane].hypot(m.slope_y[lane]);
            let (mean, half) = (0.5 * (m.dxx[lane] + m.dyy[lane]), 0.5 * (m.dxx[lane] - m.dyy[lane]));
            let stretch = mean.abs() + half.hypot(m.dxy[lane]);
            assert!(m.dz[lane].abs() <= bounds.height, "height {} of {bounds:?}", m.dz[lane]);
            assert!(sideways <= bounds.sideways, "sideways {sideways} of {bounds:?}");
            assert!(slope <= bounds.slope, "slope {slope} of {bounds:?}");
            assert!(stretch <= bounds.stretch, "stretch {stretch} of {bounds:?}");
            assert!((0.0..=1.0).contains(&m.foam[lane]));
            most = Bounds {
                height: most.height.max(m.dz[lane].abs()),
                sideways: most.sideways.max(sideways),
                slope: most.slope.max(slope),
                stretch: most.stretch.max(stretch),
                ..Bounds::default()
            };
        }
        if bounds.curvature.is_finite() {
            let points = places(expected, seed);
            let h = expected.step;
            let tilted = motion(model, &shifted(&points, DVec2::X * h));
            for lane in 0..BLOCK {
                let curvature = f64::from(tilted.slope_x[lane] - m.slope_x[lane]).abs() / h;
                let noise = 1e-6 * f64::from(bounds.slope) / h;
                let mut beyond = Vec::new();
                if curvature > f64::from(bounds.curvature) + noise {
                    beyond.push(("curvature", curvature));
                }
                let bend =
                    f64::from(tilted.dxx[lane] - m.dxx[lane]).hypot(f64::from(tilted.dxy[lane] - m.dxy[lane])) / h;
                let noise = 1e-6 * f64::from(bounds.stretch) / h;
                if bend > f64::from(bounds.bend) + noise {
                    beyond.push(("bend", bend));
                }
                // Across a crease a second derivative has no bound.
                creased += usize::from(!beyond.is_empty());
                let most = (600.0 * BLOCK as f64 * expected.creases) as usize;
                assert!(creased <= most, "{beyond:?} of {bounds:?}");
            }
        }
    }
    // They mean something, too.
    let bounds = model.bounds();
    assert!(most.height > 0.02 * bounds.height && most.slope > 0.02 * bounds.slope, "{most:?} within {bounds:?}");
}

fn roughness_bounds_what_footprints_hide(model: &mut dyn WaveModel, expected: Expected) {
    model.set_time(99.0);
    let lengths: Vec<f32> = (0..60).map(|i| 10f32.powf(-6.0 + 0.2 * i as f32)).collect();
    for pair in lengths.windows(2) {
        assert!(model.roughness(pair[0]) <= model.roughness(pair[1]), "roughness falls at {}", pair[1]);
    }
    let all = model.roughness(1e6);
    assert!(all > 0.0 && model.roughness(1e-6) <= 1e-4 * all, "{} of {all} is left", model.roughness(1e-6));
    for seed in 0..200 {
        let sharp = places(expected, seed);
        let blunt = blurred(expected, seed);
        let (sharp, full) = (motion(model, &sharp), motion(model, &blunt));
        for lane in 0..BLOCK {
            let apart =
                [full.dx[lane] - sharp.dx[lane], full.dy[lane] - sharp.dy[lane], full.dz[lane] - sharp.dz[lane]];
            // A footprint hides all waves up to twice its width, and may fade those up to four times.
            let most = model.roughness(4.0 * blunt.footprint[lane]) * 1.0001 + 1e-5;
            assert!(apart[2].abs() <= most && apart[0].hypot(apart[1]) <= most, "{apart:?} hidden of {most}");
        }
    }
}

fn footprints_keep_the_slopes_variance(model: &mut dyn WaveModel, expected: Expected) {
    let mut first: Option<[f64; 3]> = None;
    for footprint in [0.0, 0.05, 0.3, 1.0, 3.0, 10.0, 40.0, 1e4] {
        let (mut sums, mut count) = ([0.0; 3], 0.0);
        for seed in 0..400 {
            if seed % 10 == 0 {
                model.set_time(seed as f64 * 3.3);
            }
            let m = motion(model, &Points { footprint: [footprint; BLOCK], ..places(expected, 2 * seed + 1) });
            for lane in 0..BLOCK {
                let (x, y) = (f64::from(m.slope_x[lane]), f64::from(m.slope_y[lane]));
                let hidden = [m.hidden_xx, m.hidden_xy, m.hidden_yy].map(|field| f64::from(field[lane]));
                for ((sum, resolved), hidden) in sums.iter_mut().zip([x * x, x * y, y * y]).zip(hidden) {
                    *sum += resolved + hidden;
                }
                assert!(footprint > 0.0 || hidden == [0.0; 3], "something is hidden without a footprint");
                assert!(
                    hidden[0] >= 0.0 && hidden[2] >= 0.0 && hidden[1].powi(2) <= 1.001 * hidden[0] * hidden[2] + 1e-12
                );
                count += 1.0;
            }
        }
        let means = sums.map(|sum| sum / count);
        let whole = first.get_or_insert(means);
        let scale = whole[0] + whole[2];
        for i in 0..3 {
            let apart = (means[i] - whole[i]).abs() / scale;
            assert!(apart < expected.scatter, "footprint {footprint}: {means:?} for {whole:?}");
        }
    }
    // In the end nothing is left but hidden slopes.
    let blind = motion(model, &Points { footprint: [1e9; BLOCK], ..places(expected, 1) });
    let left = [blind.dz[0], blind.slope_x[1], blind.slope_y[2], blind.dx[3]];
    assert!(left.iter().all(|x| x.abs() <= expected.left), "{left:?} is left");
}

fn nothing_is_ever_not_a_number(model: &mut dyn WaveModel) {
    let hostile = [0.0, -0.0, 1e7, -1e7, 1e15, f64::MAX, f64::MIN, f64::INFINITY, f64::NAN, 5e-324, 123.456];
    let wide = [0.0, -1.0, 1e-30, 1.0, 1e9, f32::MAX, f32::INFINITY, f32::NAN];
    for time in [0.0, 1e6, -1e6, 1e300, f64::NEG_INFINITY, f64::NAN] {
        model.set_time(time);
        assert!(model.time().is_finite());
        for shift in 0..hostile.len() {
            let points = Points {
                x: std::array::from_fn(|i| hostile[(i + shift) % hostile.len()]),
                y: std::array::from_fn(|i| hostile[(i * 7 + 3) % hostile.len()]),
                footprint: std::array::from_fn(|i| wide[(i * 3 + shift) % wide.len()]),
            };
            let motion = motion(model, &points);
            assert!(fields(&motion).iter().flatten().all(|number| number.is_finite()), "{motion:?} at {points:?}");
            let velocity = velocity(model, &points, std::array::from_fn(|i| wide[(i + shift) % wide.len()]));
            let finite = |numbers: [f32; BLOCK]| numbers.iter().all(|number| number.is_finite());
            assert!(finite(velocity.x) && finite(velocity.y) && finite(velocity.z), "{velocity:?} at {points:?}");
        }
        let bounds = model.bounds();
        assert!(bounds.height.is_finite() && bounds.sideways.is_finite() && bounds.slope.is_finite());
        for wavelength in wide {
            assert!(!model.roughness(wavelength).is_nan(), "roughness of {wavelength}");
        }
    }
    // Far from everything the sea still moves.
    model.set_time(1e6);
    let far = motion(model, &Points { x: std::array::from_fn(|i| 1e7 + 3.0 * i as f64), ..Points::at(0.0, -1e7) });
    assert!(far.dz.iter().any(|height| *height != far.dz[0]) || far.dz == [0.0; BLOCK]);
}

fn water_moves_with_its_surface(model: &mut dyn WaveModel, expected: Expected) {
    let step = 0.01;
    let mut pairs = [const { Vec::new() }; 3];
    for seed in 0..60 {
        let time = seed as f64 * 7.7;
        let points = places(expected, seed);
        let [before, after] = [-1.0, 1.0].map(|way| {
            model.set_time(time + way * step);
            displacement(model, &points)
        });
        model.set_time(time);
        let velocity = velocity(model, &points, [0.0; BLOCK]);
        for lane in 0..BLOCK {
            let rate = |after: f32, before: f32| f64::from(after - before) / (2.0 * step);
            pairs[0].push((rate(after.dz[lane], before.dz[lane]), f64::from(velocity.z[lane])));
            pairs[1].push((rate(after.dx[lane], before.dx[lane]), f64::from(velocity.x[lane])));
            pairs[2].push((rate(after.dy[lane], before.dy[lane]), f64::from(velocity.y[lane])));
        }
    }
    let scale = root_mean_square(&pairs[0].iter().map(|pair| pair.1).collect::<Vec<_>>());
    let error = expected.error + expected.sharpened + 1e-6 * f64::from(model.bounds().height) / step / scale;
    agree("upward velocity", &pairs[0], error, expected.creases);
    if expected.flowing {
        agree("eastward velocity", &pairs[1], error, expected.creases);
        agree("northward velocity", &pairs[2], error, expected.creases);
    }
}

fn motion_dies_out_and_keeps_the_volume(model: &mut dyn WaveModel, expected: Expected) {
    let h = expected.step;
    let mut last = f64::INFINITY;
    for depth in [0.05f32, 0.5, 2.0, 10.0, 50.0, 1000.0] {
        let (mut speeds, mut divergences, mut terms) = (Vec::new(), Vec::new(), Vec::new());
        for seed in 0..40 {
            model.set_time(seed as f64 * 13.0);
            let points = places(expected, seed);
            let at = |by: DVec2, below: f64| {
                velocity(model, &shifted(&points, by), [(f64::from(depth) + below) as f32; BLOCK])
            };
            let [east, west] = [h, -h].map(|by| at(DVec2::X * by, 0.0));
            let [north, south] = [h, -h].map(|by| at(DVec2::Y * by, 0.0));
            let [above, below] = [-h, h].map(|by| at(DVec2::ZERO, by));
            for lane in 0..BLOCK {
                let speed = f64::from(above.x[lane]).powi(2)
                    + f64::from(above.y[lane]).powi(2)
                    + f64::from(above.z[lane]).powi(2);
                speeds.push(speed.sqrt());
                let by = |after: f32, before: f32| f64::from(after - before) / (2.0 * h);
                let upward = by(above.z[lane], below.z[lane]);
                divergences.push(by(east.x[lane], west.x[lane]) + by(north.y[lane], south.y[lane]) + upward);
                terms.push(upward);
            }
        }
        let speed = root_mean_square(&speeds);
        assert!(speed <= last, "{speed} m/s at {depth} m");
        last = speed;
        if depth <= 2.0 {
            // Creases aside.
            divergences.sort_by(|a: &f64, b| a.abs().total_cmp(&b.abs()));
            divergences.truncate(((1.0 - expected.creases) * divergences.len() as f64) as usize);
            let (sum, scale) = (root_mean_square(&divergences), root_mean_square(&terms));
            let noise = 1e-6 * speed / h;
            assert!(sum <= expected.divergence * scale + noise, "divergence {sum} of {scale} at {depth} m");
        }
    }
}

fn nothing_is_allocated(model: &mut dyn WaveModel, expected: Expected) {
    let mut use_all = |time: f64| {
        model.set_time(time);
        for seed in 0..4 {
            std::hint::black_box(displacement(model, &places(expected, seed)));
            std::hint::black_box(motion(model, &blurred(expected, seed)));
            std::hint::black_box(velocity(model, &places(expected, seed), [1.0; BLOCK]));
        }
        std::hint::black_box((model.bounds(), model.roughness(3.0)));
    };
    use_all(1.0);
    let before = ALLOCATIONS.with(Cell::get);
    use_all(2.0);
    use_all(-7.0);
    assert_eq!(ALLOCATIONS.with(Cell::get) - before, 0, "allocations when warm");
}

fn state(depth: f64) -> SeaState {
    SeaState { depth, seed: 5, ..SeaState::of_wind(9.0, 0.6, 2e5).expect("a wind") }
}

#[test]
fn superpositions_conform() {
    for depth in [f64::INFINITY, 12.0] {
        let mut sea = Superposition::of_state(&state(depth), 16, 8).expect("a sea");
        conforms(&mut sea, USUAL);
    }
    conforms(&mut Superposition::of_state(&state(30.0), 11, 13).expect("a sea").looping(120.0).expect("a loop"), USUAL);
}

#[test]
fn sines_and_trochoids_conform() {
    let sine = |amplitude, wavelength, heading, steepness| {
        let length = Length::Wavelength(wavelength);
        Sine { amplitude, length, heading, phase: wavelength, steepness }
    };
    let list = |steepness| {
        [(1.0, 50.0, 0.3), (0.4, 23.0, -0.4), (0.1, 9.0, 2.0), (0.01, 1.3, -2.8)]
            .map(|(a, l, h)| sine(a, l, h, steepness))
    };
    for (steepness, depth, flowing) in [(0.0, 25.0, false), (1.0, f64::INFINITY, true), (0.7, 5.0, false)] {
        let water = StillWater::of_depth(depth).expect("wet");
        let mut sines = Sines::new(&list(steepness), water).expect("waves");
        conforms(&mut sines, Expected { flowing, scatter: 0.15, ..USUAL });
        // Several to each heading, which are summed otherwise.
        let rows: Vec<Sine> = (0..12)
            .map(|i| sine(0.3, 12.0 + 5.0 * f64::from(i), 0.8 * f64::from(i % 3) - 0.5, 0.6 * steepness))
            .collect();
        let mut sines = Sines::new(&rows, water).expect("waves");
        conforms(&mut sines, Expected { scatter: 0.2, ..USUAL });
    }
}

#[test]
fn peacheys_waves_conform() {
    let shore = vec![DVec2::new(900.0, -50.0), DVec2::new(500.0, 0.0), DVec2::new(-100.0, 60.0)];
    let beach = Beach { shore, slope: 0.02, surf_width: 60.0 };
    let bed = beach.depths(DVec2::new(0.0, -800.0), 5.0, 161, 181).expect("a bed");
    let swell = |amplitude, period, heading| Swell { amplitude, period, heading, phase: 1.0 };
    let swells = [swell(0.4, 7.0, 1.2), swell(0.2, 4.5, 1.9)];
    for path in [Path::Refracted, Path::Straight] {
        for surf in [Surf::default(), Surf { shoaling: false, breaking: beach.breaking(0.6).expect("a ratio") }] {
            let mut waves = Peachey::new(&bed, &swells, path, surf).expect("waves");
            let expected = Expected {
                middle: DVec2::new(400.0, -350.0),
                reach: 330.0,
                step: 0.02,
                error: 0.02,
                creases: 0.02,
                divergence: 0.2,
                scatter: 0.15,
                ..USUAL
            };
            conforms(&mut waves, expected);
        }
    }
}

#[test]
fn tiles_conform() {
    // Interpolated between samples: slopes err by what the shortest waves leave, and creases lie along the cells.
    let expected = Expected { error: 0.3, creases: 0.05, divergence: 0.2, ..USUAL };
    let options = cascades::Options { samples: 64, foam: false, ..cascades::Options::default() };
    conforms(&mut Cascades::new(&state(f64::INFINITY), &options).expect("a sea"), expected);
}

#[test]
fn waves_over_a_bed_conform() {
    // From a sloping beach to water 16 m deep.
    let bed = Bed::of(DVec2::ZERO, DVec2::splat(5.0), 120, 140, |p| 0.03 * (p.y - 80.0) + 0.5 * (0.02 * p.x).sin());
    let bed = bed.expect("a bed");
    let mut sea = ShoreSea::new(&bed, &SeaState { depth: 18.0, ..state(18.0).turned(0.9) }, 24).expect("a sea");
    // Outside the surf, in which waves change from node to node.
    let expected = Expected {
        middle: DVec2::new(300.0, 430.0),
        reach: 230.0,
        error: 0.05,
        creases: 0.05,
        divergence: 0.55,
        curling: true,
        left: 2e-3,
        sharpened: 0.4,
        scatter: 0.2,
        ..USUAL
    };
    conforms(&mut sea, expected);
}

#[test]
fn linear_waves_are_airys_at_any_depth_distance_and_time() {
    for depth in [0.5, 3.0, 40.0, f64::INFINITY] {
        let water = StillWater::of_depth(depth).expect("wet");
        for wavelength in [2.0, 17.0, 130.0] {
            let k = TAU / wavelength;
            let omega = (STANDARD_GRAVITY * k * (k * depth).tanh()).sqrt();
            let wavenumber = DVec2::new(0.6, -0.8) * k;
            let wave =
                PlaneWave { amplitude: 0.3, wavenumber, angular_frequency: water.angular_frequency(k), phase: 0.5 };
            let mut sea = Superposition::new(&[wave], water).expect("a sea");
            for (x, y, t) in
                [(0.0, 0.0, 0.0), (100.0, 40.0, 3.0), (-100_000.0, 70_000.0, 86_400.0), (13.0, -7.5, -5000.0)]
            {
                sea.set_time(t);
                let theta = wavenumber.x * x + wavenumber.y * y - omega * t + 0.5;
                let (points, below) = (Points::at(x, y), 0.3 * depth.min(10.0));
                let (m, v) = (motion(&sea, &points), velocity(&sea, &points, [below as f32; BLOCK]));
                let (across, up) = if depth.is_finite() {
                    let (up, down) = (k * (depth - below), k * depth);
                    (up.cosh() / down.sinh(), up.sinh() / down.sinh())
                } else {
                    ((-k * below).exp(), (-k * below).exp())
                };
                let flow = 0.3 * omega * across * theta.cos();
                let expected = [
                    (m.dz[0], 0.3 * theta.cos(), 0.3),
                    (m.slope_x[0], -0.3 * wavenumber.x * theta.sin(), 0.3 * k),
                    (m.slope_y[0], -0.3 * wavenumber.y * theta.sin(), 0.3 * k),
                    (v.x[0], 0.6 * flow, 0.3 * omega * across),
                    (v.y[0], -0.8 * flow, 0.3 * omega * across),
                    (v.z[0], 0.3 * omega * up * theta.sin(), 0.3 * omega * across),
                ];
                for (n, (got, wanted, scale)) in expected.into_iter().enumerate() {
                    let error = (f64::from(got) - wanted).abs() / scale;
                    assert!(
                        error < 6e-5,
                        "{n}: {got} for {wanted} at {x}, {y}, {t}, depth {depth}, length {wavelength}"
                    );
                }
            }
            // A crest runs ω / k.
            let speed = omega / k;
            sea.set_time(-4.0);
            let start = motion(&sea, &Points::at(5.0, 5.0)).dz[0];
            sea.set_time(7.5);
            let there = motion(&sea, &Points::at(5.0 + 0.6 * speed * 11.5, 5.0 - 0.8 * speed * 11.5)).dz[0];
            assert!((start - there).abs() < 1e-5);
        }
    }
}

#[test]
fn far_away_and_late_the_sum_errs_by_less_than_a_hundredth_of_a_millimetre() {
    let state = SeaState { seed: 9, ..SeaState::beaufort(7.0, 0.4).expect("a sea state") };
    let mut sea = Superposition::of_state(&state, 16, 8).expect("a sea");
    let mut worst = 0f64;
    for seed in 0..50 {
        let time = 86_400.0 + seed as f64;
        sea.set_time(time);
        let middle = DVec2::new(70_000.0, -71_000.0);
        let points = places(Expected { middle, ..USUAL }, seed);
        let m = displacement(&sea, &points);
        for lane in 0..BLOCK {
            let place = DVec2::new(points.x[lane], points.y[lane]);
            let height =
                |w: &PlaneWave| w.amplitude * (w.wavenumber.dot(place) - w.angular_frequency * time + w.phase).cos();
            let exact: f64 = sea.waves().map(height).sum();
            worst = worst.max((f64::from(m.dz[lane]) - exact).abs());
        }
    }
    println!("largest error: {worst:.2e} m");
    assert!(worst < 1e-5, "{worst} m");
}

#[test]
fn superpositions_have_the_height_of_their_state() {
    let state = state(20.0);
    let mut sea = Superposition::of_state(&state, 24, 12).expect("a sea");
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..4000 {
        sea.set_time(seed as f64 * 31.0);
        let m = displacement(&sea, &places(Expected { reach: 20_000.0, ..USUAL }, 2 * seed + 1));
        sum += m.dz.iter().map(|z| f64::from(*z).powi(2)).sum::<f64>();
        count += BLOCK as f64;
    }
    let (height, wanted) = (4.0 * (sum / count).sqrt(), state.significant_height());
    assert!((height / wanted - 1.0).abs() < 0.02, "{height} for {wanted}");
}

#[test]
fn heights_in_bulk_are_those_of_blocks() {
    let lattice = Superposition::of_state(&state(20.0), 16, 8).expect("a sea");
    let loose: Vec<PlaneWave> = lattice
        .waves()
        .enumerate()
        .map(|(i, wave)| PlaneWave { wavenumber: DVec2::from_angle(i as f64).rotate(wave.wavenumber), ..*wave })
        .collect();
    for mut sea in [lattice, Superposition::new(&loose, StillWater::of_depth(20.0).expect("wet")).expect("a sea")] {
        sea.set_time(500.0);
        for count in [0, 1, 15, 64, 65, 1000] {
            // Along a line through several cells, and one place that is none.
            let place = |i: usize| DVec2::new(-150.0 + 2.3 * i as f64, 0.7 * i as f64);
            let mut places: Vec<DVec2> = (0..count).map(place).collect();
            if count > 70 {
                places[70].x = f64::NAN;
            }
            let mut heights = vec![f32::NAN; count];
            sea.heights_at(&places, &mut heights);
            for (place, height) in places.iter().zip(&heights) {
                assert_eq!(displacement(&sea, &Points::at(place.x, place.y)).dz[5], *height);
            }
        }
    }
}

#[test]
fn loops_return_to_the_same_bits() {
    let sea = Superposition::of_state(&state(15.0), 16, 8).expect("a sea");
    for period in [64.0, 10.1] {
        let mut looping = sea.looping(period).expect("a loop");
        let energy = |sea: &Superposition| sea.waves().map(|wave| wave.amplitude.powi(2)).sum::<f64>();
        assert!((energy(&looping) / energy(&sea) - 1.0).abs() < 1e-12);
        for wave in looping.waves() {
            let cycles = wave.angular_frequency * period / TAU;
            assert!((cycles - cycles.round()).abs() < 1e-9 && cycles > 0.5);
            let k = StillWater::of_depth(15.0).expect("wet").wavenumber(wave.angular_frequency);
            assert!((wave.wavenumber.length() / k - 1.0).abs() < 1e-9);
        }
        let points = places(USUAL, 3);
        let mut at = |time: f64| {
            looping.set_time(time);
            bits(&motion(&looping, &points))
        };
        assert_eq!(at(0.0), at(period));
        assert_eq!(at(-period), at(0.0));
        if period == 64.0 {
            assert_eq!(at(7.25), at(7.25 + 64.0 * f64::exp2(30.0)));
        }
        assert_ne!(at(1.0), at(2.0));
    }
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(sea.looping(wrong).is_err());
    }
}

#[test]
fn nonsense_is_refused_by_name() {
    let wave = PlaneWave { amplitude: 1.0, wavenumber: DVec2::X, angular_frequency: 3.0, phase: 0.0 };
    let error = |wave| Superposition::new(&[wave], StillWater::DEEP).map(|_| ()).expect_err("nonsense").to_string();
    assert!(error(PlaneWave { amplitude: f64::NAN, ..wave }).contains("amplitude"));
    assert!(error(PlaneWave { wavenumber: DVec2::ZERO, ..wave }).contains("wave number"));
    assert!(error(PlaneWave { angular_frequency: f64::INFINITY, ..wave }).contains("angular frequency"));
    assert!(error(PlaneWave { phase: f64::NAN, ..wave }).contains("phase"));
    assert!(Superposition::of_state(&state(0.0), 4, 4).is_err());
    assert!(Superposition::of_state(&state(5.0), usize::MAX, 4).is_err());
    let calm = Superposition::of_state(&SeaState::CALM, 4, 4).expect("a calm");
    assert_eq!(motion(&calm, &Points::at(1.0, 2.0)), Motion::STILL);
    assert_eq!((calm.bounds(), calm.roughness(10.0)), (Bounds::default(), 0.0));
}
