//! What a renderer keeps from picture to picture changes none of them: whatever was drawn before, a picture is the same to the bit.

use glam::UVec2;
use littoral::field::{HeightField, Sea, Water, coast};
use littoral::picture::{Scene, Stage, coast_shot};
use littoral::space::{Datum, View};
use littoral::waves::SeaState;
use littoral_gpu::{Gpu, Ground, Look, Renderer, Scenery, ShapeTexture, Waves};

#[test]
fn a_picture_does_not_depend_on_those_before() {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(e) => return eprintln!("not tested: {e}"),
    };
    let land = coast::coast();
    let water = Water::flood(&land, 0.0).expect("a sea");
    let shot = coast_shot(UVec2::new(48, 27));
    let scene = Scene::for_shot(&land, Some(&water), &shot);
    let stage = Stage::new(&scene);
    let Datum::Plane { origin, size } = stage.land().datum() else { panic!("the coast is a plane") };
    let sky = stage.sky_table(shot.view.eye.z);
    let mut scenery =
        Scenery::new(&gpu, &stage.tables(), (origin, size), (shot.view.eye.z, &sky)).expect("a small land");
    let shape = ShapeTexture::new(&gpu, stage.land()).expect("a small land");
    let state = SeaState::beaufort(6.0, 0.6).expect("a state");
    let sea = Sea::over(&land, &water, &state, &|_| true).expect("a sea");
    let small = View { size: UVec2::new(31, 20), ..shot.view };
    let mut draw = |renderer: &mut Renderer, view: &View, waves: bool| {
        scenery.set_waves(waves.then(|| Waves::new(&gpu, &sea).expect("known waves")).flatten());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let ground = Ground::Rays { shape: &shape, pixels: 0.0 };
        renderer.draw(&gpu, &mut encoder, &scenery, ground, view, Look::default());
        gpu.queue.submit([encoder.finish()]);
        renderer.read(&gpu).expect("a working device")
    };
    let pictures = [(&shot.view, true), (&small, true), (&shot.view, false)];
    let mut one = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
    let expected = pictures.map(|(view, waves)| draw(&mut one, view, waves));
    assert!(expected.iter().flatten().flatten().all(|v| v.is_finite()));
    assert_ne!(expected[0], expected[2], "waves are seen");
    let mut other = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
    for (number, (view, waves)) in pictures.into_iter().enumerate().rev() {
        assert!(draw(&mut other, view, waves) == expected[number], "picture {number}");
    }
}
