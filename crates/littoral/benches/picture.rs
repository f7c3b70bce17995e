//! What a picture costs: once for a land (making ready, choosing a view) and for each view (small pictures of every kind).
//!
//! Runs in a few seconds a line; all threads work, so compare only on a quiet machine.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::UVec2;
use littoral::field::{Water, coast};
use littoral::picture::{Display, Scene, Settings, Shot, Stage, Style, coast_shot, compose, overhead};
use std::time::Duration;

fn pictures(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("picture");
    group.sample_size(10).warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(3));
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let size = UVec2::new(320, 180);
    let landscape = coast_shot(size);
    let map = Shot { style: Style::Tint, ..overhead(&land, water.as_ref(), size) };
    let relief = Shot { style: Style::Relief, ..map };
    group.bench_function("coast", |b| b.iter(coast::coast));
    group.bench_function("flood", |b| b.iter(|| Water::flood(&land, 0.0)));
    group.bench_function("compose", |b| b.iter(|| compose(&land, water.as_ref(), size)));
    for (name, shot) in [("landscape", landscape), ("map", map), ("relief", relief)] {
        let scene = Scene::for_shot(&land, water.as_ref(), &shot);
        let stage = Stage::new(&scene);
        group.bench_function(format!("stage of a {name}"), |b| b.iter(|| Stage::new(&scene)));
        for samples in [4, 12] {
            let settings = Settings { samples, ..Settings::default() };
            group.bench_function(format!("{name} 320x180x{samples}"), |b| {
                b.iter(|| stage.render(&shot.view, &settings, &|_| {}));
            });
        }
    }
    let picture = Stage::new(&Scene::for_shot(&land, water.as_ref(), &landscape)).render(
        &landscape.view,
        &Settings::default(),
        &|_| {},
    );
    group.bench_function("display", |b| b.iter(|| picture.display(&Display::default())));
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
