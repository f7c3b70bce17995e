//! Every pass is made and recorded on a device that does nothing (wgpu's no-op backend, with no more than WebGPU promises): layouts, usages and sizes are checked on
//! machines that have no graphics adapter, too.

use glam::{DAffine2, DVec2, DVec3, UVec2, Vec3};
use littoral::field::{HeightField, Land, Raster, Sea, Water};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Method, NestedBounds, Patch, Patches, Stencil, Vertex};
use littoral::picture::{Border, Drape, Scene, Stage, Style, Texture};
use littoral::raycast::LocalRay;
use littoral::space::{Cell, Datum, View};
use littoral::waves::cascades::{Cascades, Options, Tile};
use littoral::waves::{SeaState, Sines, StillWater};
use littoral_gpu::sea::Transform;
use littoral_gpu::{
    Expander, Gpu, GpuSea, Ground, Look, Painter, PainterError, PassTimes, Renderer, Scenery, ShapeTexture,
    TessellationPasses, Tessellator, Triangles, Waves, WavesError,
};

/// A device that does nothing but check what it is asked for.
fn gpu() -> Gpu {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    let limits = Some(wgpu::Limits::default());
    descriptor.backend_options.noop = wgpu::NoopBackendOptions { limits, ..wgpu::NoopBackendOptions::enabled() };
    Gpu::of(&wgpu::Instance::new(descriptor), None).expect("a device that does nothing")
}

/// That all that was asked for could be done.
fn sound(gpu: &Gpu, what: impl std::fmt::Display) {
    gpu.check().unwrap_or_else(|e| panic!("{what}: {e}"));
}

/// A bay among hills, so many samples each way, with voids or without.
fn bay(columns: usize, rows: usize, voids: bool) -> Land {
    let height = |i: usize| {
        let (x, y) = ((i % columns) as f32 / columns as f32, (i / columns) as f32 / rows as f32);
        if voids && i.is_multiple_of(97) { f32::NAN } else { 40.0 * (9.0 * x).sin() + 60.0 * y - 30.0 }
    };
    let heights = (0..columns * rows).map(height).collect();
    Land::new(Raster::new(columns, rows, DVec2::new(20.0, 25.0), heights).expect("a raster"))
}

fn view(land: &Land, size: UVec2) -> View {
    let middle = (land.origin() + 0.5 * land.extent()).extend(0.0);
    View::looking_at(middle + DVec3::new(-400.0, -500.0, 300.0), middle, 0.9, size)
}

fn mesh(land: &Land) -> Mesh {
    let mut drawing = Drawing::default();
    let limits = Limits { finest: 4, triangles: 10_000 };
    Patches::new(limits).select(land, &view(land, UVec2::new(64, 36)), &mut drawing).expect("a view");
    drawing.expand(land);
    drawing.mesh
}

fn target(gpu: &Gpu, size: UVec2, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size.x.max(1), height: size.y.max(1), depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

fn scenery(gpu: &Gpu, stage: &Stage) -> Scenery {
    let Datum::Plane { origin, size } = stage.land().datum() else { panic!("a plane") };
    Scenery::new(gpu, &stage.tables(), (origin, size), (100.0, &stage.sky_table(100.0))).expect("a small land")
}

#[test]
fn what_is_wrong_is_told_without_an_adapter() {
    let gpu = gpu();
    sound(&gpu, "nothing");
    let [from, to] = [(); 2].map(|()| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 64,
            usage: wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(&from, 0, &to, 0, 64);
    gpu.queue.submit([encoder.finish()]);
    let fault = gpu.check().expect_err("a buffer that cannot be copied from").to_string();
    assert!(fault.contains("COPY_SRC"), "{fault}");
}

#[test]
fn pictures_of_every_kind_and_size_are_recorded() {
    let gpu = gpu();
    let passes = TessellationPasses::new(&gpu);
    let land = bay(65, 49, false);
    let holes = bay(33, 40, true);
    let texels: Vec<[u8; 3]> = (0..300u32 * 170).map(|i| [i as u8, (i >> 3) as u8, 90]).collect();
    let texture = Texture::from_srgb(UVec2::new(300, 170), &texels);
    let uv_from_local = DAffine2::from_scale(1.0 / land.extent());
    let drape = Drape { texture, uv_from_local };
    let water = Water::flood(&land, 0.0);
    let kinds = [
        (Style::Natural, Border::Mist, &land),
        (Style::Natural, Border::Cut, &holes),
        (Style::Tint, Border::Cut, &land),
        (Style::Relief, Border::Mist, &holes),
        (Style::Image, Border::Mist, &land),
    ];
    for format in [wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureFormat::Bgra8UnormSrgb] {
        // One renderer for all: canvases follow the size of the picture, bindings what is drawn.
        let mut renderer = Renderer::new(&gpu, format);
        for (style, border, land) in kinds {
            let wet = water.as_ref().filter(|_| std::ptr::eq(land, kinds[0].2));
            let stage = Stage::new(&Scene { style, border, drape: Some(&drape), ..Scene::new(land, wet) });
            let mut scenery = scenery(&gpu, &stage);
            let shape = ShapeTexture::new(&gpu, stage.land()).expect("a small land");
            let mut patches = Tessellator::new(&gpu, &passes, stage.land(), Limits { finest: 30, triangles: 5000 })
                .expect("a small land");
            for size in [UVec2::new(64, 36), UVec2::ONE, UVec2::new(3, 200), UVec2::ZERO, UVec2::new(64, 36)] {
                let view = view(land, size);
                let mut triangles = Triangles::default();
                triangles.set(&gpu, &mesh(stage.land())).expect("a small mesh");
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                patches.tessellate(&gpu, &mut encoder, &view, None).ok();
                let target = target(&gpu, size, format);
                let empty = Triangles::default();
                for ground in [
                    Ground::Triangles(&triangles),
                    Ground::Triangles(patches.triangles()),
                    Ground::Triangles(&empty),
                    Ground::Rays { shape: &shape, pixels: 0.0 },
                    Ground::Rays { shape: &shape, pixels: 2.0 },
                ] {
                    renderer.draw(&gpu, &mut encoder, &scenery, ground, &view, Look::default());
                    renderer.show(&gpu, &mut encoder, &scenery, 0.3, &target, size);
                    if let Ground::Triangles(triangles) = ground {
                        renderer.wires(&gpu, &mut encoder, triangles, &target);
                    }
                }
                gpu.queue.submit([encoder.finish()]);
                let pixels = renderer.read(&gpu).expect("a device").len();
                assert_eq!(pixels as u32, size.max(UVec2::ONE).element_product());
                sound(&gpu, format!("{style:?}, {border:?}, {size}"));
                scenery.set_sky(&gpu, 900.0, &stage.sky_table(900.0));
            }
        }
    }
}

#[test]
fn waves_are_recorded_come_and_go() {
    let gpu = gpu();
    let land = bay(65, 49, false);
    let water = Water::flood(&land, 0.0).expect("a sea");
    let stage = Stage::new(&Scene::new(&land, Some(&water)));
    let mut scenery = scenery(&gpu, &stage);
    let mut renderer = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
    let shape = ShapeTexture::new(&gpu, stage.land()).expect("a small land");
    let state = SeaState::beaufort(6.0, 0.6).expect("a state");
    let over = Sea::over(&land, &water, &state, &|_| true).expect("a sea");
    let open = Sea::of_state(over.datum(), 0.0, &state).expect("a sea");
    for sea in [Some(over), None, Some(open)] {
        let waves = sea.as_ref().and_then(|sea| Waves::new(&gpu, sea).expect("known waves"));
        assert_eq!(waves.is_some(), sea.is_some());
        scenery.set_waves(waves);
        let mut sea = sea;
        for (instant, size) in [UVec2::new(64, 36), UVec2::ONE, UVec2::new(64, 36), UVec2::ZERO].into_iter().enumerate()
        {
            // Twice at an instant: the second time the points are where they were.
            for towards in [Vec3::ZERO, Vec3::ZERO, Vec3::Z] {
                let seen = view(&land, size);
                let view = match towards == Vec3::ZERO {
                    true => seen,
                    false => View::looking_at(seen.eye, seen.eye + DVec3::new(0.1, 0.0, 1.0), 0.5, size),
                };
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                let ground = Ground::Rays { shape: &shape, pixels: 0.0 };
                renderer.draw(&gpu, &mut encoder, &scenery, ground, &view, Look::default());
                gpu.queue.submit([encoder.finish()]);
                sound(&gpu, format!("instant {instant}, {size}"));
            }
            if let Some(sea) = &mut sea {
                sea.set_time(1.5 * instant as f64);
                scenery.follow_waves(&gpu, sea);
            }
        }
    }
    let sines = Sines::new(&[], StillWater::of_depth(30.0).expect("water")).expect("no waves");
    let designed = Sea::new(stage.land().datum(), 0.0).with(Box::new(sines));
    assert!(matches!(Waves::new(&gpu, &designed), Err(WavesError::Unknown)));
}

#[test]
fn seas_are_summed_in_both_ways() {
    let gpu = gpu();
    let state = SeaState::beaufort(7.0, 0.6).expect("a state");
    let tile = Tile { length: 120.0, turn: 0.3, samples: 64, lowest: 0.1, highest: 1.2 };
    for (tiles, foam) in
        [(&[][..], true), (&[tile], false), (&[tile, Tile { samples: 128, lowest: 1.2, highest: 3.0, ..tile }], true)]
    {
        let options = Options { foam, ..Options::default() };
        let sea = Cascades::with_tiles(&state, tiles, &options).expect("a sea");
        for transform in [Transform::Passes, Transform::Lines] {
            let mut on_device = GpuSea::with_transform(&gpu, &sea, transform).expect("a small sea");
            // On, back, and so far that all foam is made anew.
            for time in [0.1, 3.0, 2.0, 1e6, f64::NAN] {
                on_device.set_time(time);
            }
            assert!(on_device.copy(&sea));
            on_device.set_time(5.0);
            on_device.set_origin(DVec2::new(1e6, -3.0));
            sound(&gpu, format!("{} tiles, {transform:?}", tiles.len()));
        }
    }
}

#[test]
fn lands_of_every_size_are_brought_or_refused() {
    let gpu = gpu();
    let passes = TessellationPasses::new(&gpu);
    for (columns, rows) in [(2, 2), (3, 2), (2, 300), (8192, 2), (8193, 2), (2, 9000)] {
        let land = bay(columns, rows, false);
        let fits = columns.max(rows) <= 8192;
        let stage = Stage::new(&Scene { border: Border::Cut, ..Scene::new(&land, None) });
        let painter = Painter::new(gpu.clone(), &stage);
        assert_eq!(painter.is_ok(), fits, "{columns} × {rows}");
        assert_eq!(ShapeTexture::new(&gpu, &land).is_ok(), fits);
        assert_eq!(Tessellator::new(&gpu, &passes, &land, Limits { finest: 30, triangles: 100 }).is_ok(), fits);
        sound(&gpu, format!("{columns} × {rows}"));
        let Ok(mut painter) = painter else { continue };
        for size in [UVec2::ZERO, UVec2::ONE, UVec2::new(5, 4)] {
            let picture = painter.picture(&stage, None, &view(&land, size), 2, &|_| {}).expect("a picture");
            assert_eq!(picture.radiance.len() as u32, size.element_product());
        }
        // Triangles made on the device, by every way that there is.
        let bounds = NestedBounds::of(&land).expect("few samples");
        let (limits, seen) = (Limits { finest: 30, triangles: 1000 }, view(&land, UVec2::new(64, 36)));
        let small = view(&land, UVec2::new(5, 4));
        let pictured = |painter: &mut Painter| {
            let picture = painter.picture_of_made(&stage, &small, 1, &|_| {}).expect("a picture");
            assert_eq!(picture.radiance.len(), 20);
        };
        painter.tessellate(&land, limits, &seen).expect("a view");
        pictured(&mut painter);
        for _ in 0..2 {
            painter.bisect(&bounds, limits, &seen).expect("a view");
            pictured(&mut painter);
        }
        for method in Method::ALL {
            let mut drawing = Drawing::default();
            method.within(limits).select(&land, &seen, &mut drawing).expect("a view");
            painter.expand(&land, &mut drawing).expect("few triangles");
            pictured(&mut painter);
            sound(&gpu, format!("{method} of {columns} × {rows}"));
        }
        let wide = painter.picture(&stage, None, &view(&land, UVec2::new(8193, 1)), 1, &|_| {});
        assert!(matches!(wide, Err(PainterError::Picture { .. })));
        sound(&gpu, format!("pictures of {columns} × {rows}"));
    }
}

#[test]
fn rays_are_asked_in_parts() {
    let gpu = gpu();
    let land = bay(40, 30, true);
    let shape = ShapeTexture::new(&gpu, &land).expect("a small land");
    assert_eq!(shape.ranges(&gpu).expect("a device").len() as u32, shape.sizes().map(|[x, y]| x * y).sum());
    for count in [0, 1, 65, (1 << 20) + 1] {
        let rays = vec![LocalRay::new(Vec3::Z, Vec3::NEG_Z); count];
        assert_eq!(shape.first_hits(&gpu, DVec3::Z, &rays).expect("a device").len(), count);
    }
    sound(&gpu, "rays");
    // Triangles of another mesh, larger and smaller, in the memory of the one before.
    let vertex = |i: u32| Vertex { x: i, y: i / 7, face: 0, height: 1.0 };
    let mut triangles = Triangles::default();
    for count in [0u32, 1, 5000, 3] {
        let mesh = Mesh { vertices: (0..3 * count).map(vertex).collect(), triangles: vec![[0, 1, 2]; count as usize] };
        triangles.set(&gpu, &mesh).expect("a small mesh");
        assert_eq!(triangles.len(), count as usize);
        sound(&gpu, format!("{count} triangles"));
    }
}

#[test]
fn passes_that_were_recorded_are_timed() {
    let gpu = gpu().timed();
    let land = bay(65, 49, false);
    let water = Water::flood(&land, 0.0).expect("a sea");
    let stage = Stage::new(&Scene::new(&land, Some(&water)));
    let mut scenery = scenery(&gpu, &stage);
    let mut renderer = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
    let mut patches =
        Tessellator::new(&gpu, &TessellationPasses::new(&gpu), stage.land(), Limits { finest: 30, triangles: 500 })
            .expect("a small land");
    let view = view(&land, UVec2::new(64, 36));
    let times = gpu.times.as_ref().expect("a clock");
    let mut draw = |scenery: &Scenery, tessellates: bool| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if tessellates {
            let timestamps = times.of_compute("tessellation");
            patches.tessellate(&gpu, &mut encoder, &view, timestamps).expect("a view");
        }
        let ground = Ground::Triangles(patches.triangles());
        renderer.draw(&gpu, &mut encoder, scenery, ground, &view, Look::default());
        times.keep(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let told = times.read(&gpu).expect("a device");
        sound(&gpu, "times");
        let timed = PassTimes::PASSES.into_iter().zip(told).filter(|(_, time)| time.is_some());
        timed.map(|(pass, _)| pass).collect::<Vec<_>>()
    };
    assert_eq!(draw(&scenery, false), ["surface", "shade"]);
    assert_eq!(draw(&scenery, true), ["tessellation", "surface", "shade"]);
    let state = SeaState::beaufort(6.0, 0.6).expect("a state");
    let sea = Sea::over(&land, &water, &state, &|_| true).expect("a sea");
    scenery.set_waves(Waves::new(&gpu, &sea).expect("known waves"));
    assert_eq!(draw(&scenery, true), PassTimes::PASSES);
    // The same view of the same instant: sums and points stand.
    assert_eq!(draw(&scenery, false), ["surface", "waves", "shade"]);
}

#[test]
fn pages_of_pictures_of_every_size_are_brought() {
    let gpu = gpu();
    let land = bay(65, 49, false);
    let shape = ShapeTexture::new(&gpu, &land).expect("a small land");
    let mut renderer = Renderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm);
    for size in [UVec2::ONE, UVec2::new(300, 170), UVec2::new(9000, 3), UVec2::new(2, 8193)] {
        let texture = Texture::from_srgb(size, &vec![[90, 120, 60]; size.element_product() as usize]);
        let drape = Drape { texture, uv_from_local: DAffine2::from_scale(1.0 / land.extent()) };
        let stage = Stage::new(&Scene { style: Style::Image, drape: Some(&drape), ..Scene::new(&land, None) });
        let Datum::Plane { origin, size: extent } = land.datum() else { panic!("a plane") };
        for bytes in [0, 300_000, 1 << 30] {
            let sky = (100.0, &stage.sky_table(100.0));
            let scenery = Scenery::with_picture_bytes(&gpu, &stage.tables(), (origin, extent), sky, bytes);
            let mut scenery = scenery.expect("a small land");
            for (pixels, most) in [(UVec2::ONE, 0), (UVec2::ZERO, 3), (UVec2::new(64, 36), 1), (UVec2::new(64, 36), 99)]
            {
                let view = view(&land, pixels);
                scenery.bring_picture(&gpu, &stage, &view, most);
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                let ground = Ground::Rays { shape: &shape, pixels: 0.0 };
                renderer.draw(&gpu, &mut encoder, &scenery, ground, &view, Look::default());
                gpu.queue.submit([encoder.finish()]);
                sound(&gpu, format!("{size} within {bytes} bytes, {most} pages for {pixels}"));
            }
        }
    }
}

#[test]
fn drawings_nearly_as_large_as_buffers_are_expanded() {
    let gpu = gpu();
    let land = bay(9, 9, false);
    let mut expander = Expander::new(&gpu, &land).expect("a small land");
    let mut drawing = Drawing::default();
    // Corners of 101 MB, where shaders read no more than 134.
    (drawing.stencil, drawing.patches) = (Stencil::Square(32), vec![Patch::of(Cell::face(0)); 4000]);
    expander.expand(&gpu, &mut drawing).expect("no more than fits");
    sound(&gpu, "a large drawing");
}
