//! The built-in coast: making it, making it ready, and a small picture of it.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::UVec2;
use littoral::field::coast;
use littoral::picture::{Display, Scene, Settings, Stage, Water, coast_shot, compose};

fn pictures(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("picture");
    group.sample_size(10);
    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let shot = coast_shot(UVec2::new(320, 180));
    let scene = Scene::for_shot(&land, water.as_ref(), &shot);
    let stage = Stage::new(&scene);
    let picture = stage.render(&shot.view, &Settings::default(), &|_| {});
    group.bench_function("coast", |b| b.iter(coast::coast));
    group.bench_function("flood", |b| b.iter(|| Water::flood(&land, 0.0)));
    group.bench_function("compose", |b| b.iter(|| compose(&land, water.as_ref(), shot.view.size)));
    group.bench_function("stage", |b| b.iter(|| Stage::new(&scene)));
    group.bench_function("render 320x180x12", |b| b.iter(|| stage.render(&shot.view, &Settings::default(), &|_| {})));
    group.bench_function("display", |b| b.iter(|| picture.display(&Display::default())));
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
