//! ROAM over a sea that moves, held against the same promises from frame to frame.

use super::check::{Case, check, sorted};
use super::counting::allocations;
use super::{Random, Surface, cases, random_view};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::{HeightField, Sea};
use littoral::lod::{Drawing, Limits, Lod, Reached, RoamSea, Vertex, ViewError};
use littoral::space::{Datum, View};
use littoral::waves::cascades::{Cascades, Options};
use littoral::waves::{Length, SeaState, Sine, Sines, StillWater, Superposition};

/// A flight as a method: over its own sea, whatever it is shown.
struct Fixed {
    flight: RoamSea,
    sea: Sea,
}

impl Lod for Fixed {
    fn select(&mut self, _: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let reached = self.flight.update(&self.sea, view, &mut || false)?;
        drawing.clear();
        drawing.mesh.clone_from(self.flight.mesh());
        Ok(reached)
    }
}

/// A sum of waves; one in eight seas of tiles, one of trochoids.
fn sea_of(seed: u64) -> Sea {
    let mut random = Random::new(seed + 5_000_000);
    let datum =
        Datum::Plane { origin: DVec2::new(1e4, -3e4), size: DVec2::new(2000.0, 300.0 + 2500.0 * random.unit()) };
    let state = SeaState::of_wind(3.0 + 12.0 * random.unit(), 1.0, 2e5).expect("a wind");
    let state = SeaState { seed, ..state };
    let sea = Sea::new(datum, 3.0);
    match seed % 8 {
        0 => {
            let options = Options { samples: 64, highest: 1.0, foam: false, ..Options::default() };
            sea.with(Box::new(Cascades::new(&state, &options).expect("a sea")))
        }
        1 => {
            let sine = |i: u32| Sine {
                amplitude: 0.3 + 0.2 * f64::from(i),
                length: Length::Wavelength(40.0 + 30.0 * f64::from(i)),
                heading: f64::from(i),
                phase: 0.3,
                steepness: 1.0,
            };
            sea.with(Box::new(Sines::new(&[0, 1, 2].map(sine), StillWater::DEEP).expect("waves")))
        }
        _ => sea.with(Box::new(Superposition::of_state(&state, 6, 5).expect("a sea"))),
    }
}

fn surface_of(seed: u64, time: f64) -> Surface {
    let mut sea = sea_of(seed);
    sea.set_time(time);
    let Datum::Plane { origin, size } = sea.datum() else { panic!("a plane") };
    Surface { field: Box::new(sea), finest: 9, samples: None, extent: size, origin }
}

/// Corners of the triangles of a drawing, without heights.
fn plan(drawing: &Drawing) -> Vec<[(u32, u32); 3]> {
    let mut all: Vec<_> = sorted(drawing).into_iter().map(|t| t.map(|(_, x, y, _)| (x, y))).collect();
    all.sort_unstable();
    all
}

#[test]
fn flights_over_a_moving_sea_keep_every_promise() {
    use rayon::prelude::*;
    let late: usize = cases()
        .into_par_iter()
        .map(|seed| {
            let mut random = Random::new(seed + 2_000_000);
            let limits =
                Limits { finest: 7 + random.below(6) as u8, triangles: [300, 4_000, 20_000][random.below(3) as usize] };
            let lateness = [0.0, 0.25, 0.8][random.below(3) as usize];
            let make = || Fixed { flight: RoamSea::new(limits).with_lateness(lateness), sea: sea_of(seed) };
            let mut lod = make();
            let mut time = random.unit() * 1000.0;
            let mut view = random_view(&surface_of(seed, time), &mut random);
            let mut late = 0;
            for turn in 0..6 {
                // Mostly the next frame, sometimes another place and time.
                match random.below(6) {
                    0 => time = random.unit() * 1000.0,
                    1 => view = random_view(&surface_of(seed, time), &mut random),
                    _ => time += [1.0 / 60.0, 0.1, 0.5][random.below(3) as usize],
                }
                view.eye += DVec3::new(random.unit(), random.unit(), random.unit()) * 0.3;
                let surface = surface_of(seed, time);
                lod.sea.set_time(time);
                let label = format!("sea seed {seed} view {turn}, lateness {lateness}");
                check(&mut lod, &Case { surface: &surface, view: &view, limits, label: &label }, &mut random);
                late += lod.flight.mesh().vertices.len() - lod.flight.heights_asked();
                // What was seen before leaves no trace in what is drawn; without lateness, none in heights.
                let mut anew = make();
                anew.sea.set_time(time);
                let (mut one, mut other) = (Drawing::default(), Drawing::default());
                let first = lod.select(&*surface.field, &view, &mut one).expect("a view");
                let second = anew.select(&*surface.field, &view, &mut other).expect("a view");
                assert!(plan(&one) == plan(&other), "{label}: another mesh from scratch");
                if lateness == 0.0 {
                    assert_eq!(first, second, "{label}");
                    assert!(sorted(&one) == sorted(&other), "{label}: other heights from scratch");
                }
            }
            late
        })
        .sum();
    assert!(late > 100 || cases().count() < 30, "{late} heights were late at all");
}

fn low_over_the_sea(time: f64) -> View {
    let eye = DVec3::new(1e4 + 500.0 + 20.0 * time, -3e4 + 50.0, 25.0);
    let mut view = View::looking_at(eye, eye + DVec3::new(300.0, 300.0, -60.0), 1.0, UVec2::new(640, 360));
    view.tolerance_pixels = 2.0;
    view
}

/// What a GPU that is sent only what changed holds is what there is.
#[test]
fn changes_are_all_told() {
    let mut sea = sea_of(2);
    let mut flight = RoamSea::new(Limits { finest: 12, triangles: 12_000 });
    let (mut triangles, mut vertices) = (Vec::new(), Vec::new());
    for step in 0..60 {
        let time = f64::from(step) / 60.0;
        sea.set_time(time);
        flight.limits.triangles = if step % 2 == 1 { 11_940 } else { 12_000 };
        flight.update(&sea, &low_over_the_sea(time), &mut || false).expect("a view");
        let mesh = flight.mesh();
        triangles.resize(mesh.triangles.len(), [9; 3]);
        vertices.resize(mesh.vertices.len(), mesh.vertices[0]);
        for range in flight.changed_triangles() {
            triangles[range.clone()].copy_from_slice(&mesh.triangles[range]);
        }
        for range in flight.changed_vertices() {
            vertices[range.clone()].copy_from_slice(&mesh.vertices[range]);
        }
        let bits = |all: &[Vertex]| all.iter().map(|v| (v.x, v.y, v.height.to_bits())).collect::<Vec<_>>();
        assert!(triangles == mesh.triangles && bits(&vertices) == bits(&mesh.vertices), "step {step}");
    }
}

/// Far heights are asked for once in some frames, and not all in the same.
#[test]
fn far_heights_wait_and_the_work_is_spread() {
    let mut sea = sea_of(2);
    let mut flight = RoamSea::new(Limits { finest: 12, triangles: 20_000 }).with_lateness(0.5);
    let mut asked = Vec::new();
    for frame in 0..60 {
        sea.set_time(f64::from(frame) / 60.0);
        flight.update(&sea, &low_over_the_sea(0.0), &mut || false).expect("a view");
        asked.push(flight.heights_asked());
    }
    let all = flight.mesh().vertices.len();
    assert_eq!(asked[0], all, "at first nothing is known");
    let (least, most) = asked[20..].iter().fold((all, 0), |(l, m), &n| (l.min(n), m.max(n)));
    assert!(0 < least && most < all / 2, "{least} to {most} of {all} heights a frame");
    assert!(most < 2 * least, "{least} to {most} heights a frame");
    flight.update(&sea, &low_over_the_sea(0.0), &mut || false).expect("a view");
    assert_eq!(flight.heights_asked(), 0, "nothing moved");
}

/// No height of what is drawn is later than its share of the tolerance, over a wave whose rise speed is reached everywhere.
#[test]
fn no_height_is_later_than_its_share() {
    let datum = Datum::Plane { origin: DVec2::new(1e4, -3e4), size: DVec2::splat(2000.0) };
    let sine = Sine { amplitude: 1.0, length: Length::Wavelength(60.0), heading: 0.7, phase: 0.0, steepness: 0.0 };
    let mut sea = Sea::new(datum, 3.0).with(Box::new(Sines::new(&[sine], StillWater::DEEP).expect("a wave")));
    let mut flight = RoamSea::new(Limits { finest: 12, triangles: 20_000 }).with_lateness(0.5);
    let view = low_over_the_sea(0.0);
    let forward = DVec3::new(300.0, 300.0, -60.0).normalize();
    let focal = 180.0 / 0.5f64.tan();
    let mut latest = 0.0f64;
    for frame in 0..90 {
        sea.set_time(f64::from(frame) / 60.0);
        flight.update(&sea, &view, &mut || false).expect("a view");
        let mesh = flight.mesh();
        for vertex in mesh.triangles.iter().flatten().map(|&i| &mesh.vertices[i as usize]) {
            let at = vertex.world(&datum);
            let away = at - view.eye;
            let depth = away.dot(forward);
            if depth > 1.0 {
                let off = (at.z - sea.height_at(at.truncate())).abs();
                latest = latest.max(off * focal * away.truncate().length() / (depth * depth));
            }
        }
    }
    let share = 0.5 * f64::from(view.tolerance_pixels);
    assert!((0.2 * share..=share * 1.01).contains(&latest), "{latest} pixels late of {share}");
}

#[test]
fn warm_frames_allocate_nothing() {
    let mut sea = sea_of(2);
    let mut flight = RoamSea::new(Limits { finest: 12, triangles: 20_000 });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().expect("a thread");
    pool.install(|| {
        let mut fly = || {
            for step in 0..20 {
                let time = f64::from(step) / 10.0;
                sea.set_time(time);
                flight.update(&sea, &low_over_the_sea(time), &mut || false).expect("a view");
            }
        };
        (0..3).for_each(|_| fly());
        let before = allocations();
        fly();
        assert_eq!(allocations() - before, 0);
    });
}

#[test]
fn views_that_cannot_be_drawn_are_refused() {
    let mut sea = sea_of(2);
    let mut flight = RoamSea::new(Limits { finest: 12, triangles: 2_000 });
    let good = low_over_the_sea(0.0);
    let mut ask = |view: View| flight.update(&sea, &view, &mut || false);
    let first = ask(good).expect("a view");
    assert!(matches!(ask(View { eye: DVec3::NAN, ..good }), Err(ViewError::NotFinite(_))));
    assert!(matches!(ask(View { size: UVec2::ZERO, ..good }), Err(ViewError::Empty(0, 0))));
    for tolerance in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(ask(View { tolerance_pixels: tolerance, ..good }), Err(ViewError::Tolerance(_))));
    }
    assert_eq!(ask(good), Ok(first), "an error spoils nothing");
    sea = Sea::new(Datum::WGS84, 0.0);
    assert_eq!(flight.update(&sea, &good, &mut || false), Err(ViewError::Ellipsoid));
}
