//! The sea on the GPU against the sea on the processor, and against closed forms. Where there is no adapter these tests say so and pass; that the
//! shaders are sound is tested without one.

use glam::DVec2;
use littoral::waves::cascades::{Cascades, Options, Tile};
use littoral::waves::{BLOCK, Motion, Points, SeaState, WaveModel, random};
use littoral_gpu::sea::{Transform, transform_source};
use littoral_gpu::{Gpu, GpuSea};
use std::f64::consts::TAU;

/// How far samples may be from the processor's, over the root mean square of their field.
const TOLERANCE: f64 = 1e-5;

/// The order of the fields of a sample.
const FIELDS: [&str; 8] = ["z", "x", "xx", "y", "yy", "zx", "xy", "zy"];

fn gpu() -> Option<Gpu> {
    match Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            println!("not tested: {error}");
            None
        }
    }
}

/// Samples of a tile at a level, eight fields each, row by row.
fn samples(gpu: &Gpu, texture: &wgpu::Texture, tile: u32, level: u32) -> Vec<[f32; 8]> {
    let side = texture.width() >> level;
    let bytes = u64::from(side) * u64::from(side) * 16;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 2 * bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: level,
            origin: wgpu::Origin3d { x: 0, y: 0, z: 2 * tile },
            aspect: wgpu::TextureAspect::All,
        },
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(16 * side),
                rows_per_image: Some(side),
            },
        },
        wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 2 },
    );
    gpu.queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |result| result.expect("a mapped buffer"));
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("a working device");
    let view = buffer.slice(..).get_mapped_range().expect("a mapped range");
    let numbers: &[[f32; 4]] = bytemuck::cast_slice(&view);
    let (first, second) = numbers.split_at(numbers.len() / 2);
    first.iter().zip(second).map(|(a, b)| [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]).collect()
}

/// The processor's samples of a sea of one unturned tile, on `side` samples, of the waves at least twice `footprint` (m) long.
fn expected(sea: &Cascades, tile: &Tile, side: u32, footprint: f32) -> Vec<[f32; 8]> {
    let mut all = Vec::new();
    let apart = tile.length / f64::from(side);
    for j in 0..side {
        for block in 0..side / BLOCK as u32 {
            let mut points = Points::at(0.0, f64::from(j) * apart);
            points.footprint = [footprint; BLOCK];
            for l in 0..BLOCK {
                points.x[l] = (f64::from(block) * BLOCK as f64 + l as f64) * apart;
            }
            let mut m = Motion::STILL;
            sea.add_motion(&points, &mut m);
            all.extend(
                (0..BLOCK)
                    .map(|l| [m.dz[l], m.dx[l], m.dxx[l], m.dy[l], m.dyy[l], m.slope_x[l], m.dxy[l], m.slope_y[l]]),
            );
        }
    }
    all
}

/// The greatest difference over the root mean square, by field.
fn difference(got: &[[f32; 8]], expected: &[[f32; 8]]) -> [f64; 8] {
    assert_eq!(got.len(), expected.len());
    std::array::from_fn(|f| {
        let square: f64 = expected.iter().map(|e| f64::from(e[f]).powi(2)).sum();
        let rms = (square / expected.len() as f64).sqrt();
        let most = got.iter().zip(expected).map(|(g, e)| (f64::from(g[f]) - f64::from(e[f])).abs()).fold(0.0, f64::max);
        // No comparison with NaN is true.
        assert!(got.iter().all(|g| g[f].is_finite()), "{}", FIELDS[f]);
        most / rms.max(1e-12)
    })
}

#[test]
fn samples_are_those_of_the_processor() {
    let Some(gpu) = gpu() else { return };
    let mut worst: f64 = 0.0;
    for (samples_a_side, seed, beaufort) in [(64, 1, 3.0), (128, 7, 8.0), (256, 2, 5.0), (512, 3, 6.0)] {
        let state = SeaState { seed, ..SeaState::beaufort(beaufort, 0.6).expect("a state") };
        let length = 350.0;
        let highest = 0.5 * (samples_a_side as f64 - 1.0) * 0.5 * TAU / length;
        let tile = Tile { length, turn: 0.0, samples: samples_a_side, lowest: 0.03, highest };
        let options = Options { foam: false, ..Options::default() };
        let mut sea = Cascades::with_tiles(&state, &[tile], &options).expect("a sea");
        let both = [Transform::Passes, Transform::Lines];
        let mut both = both.map(|transform| GpuSea::with_transform(&gpu, &sea, transform).expect("a sea"));
        for (time, transform) in
            [0.0, 12.5, 86_400.0, 1e8, -1234.567].into_iter().flat_map(|time| [(time, 0), (time, 1)])
        {
            let on_gpu = &mut both[transform];
            sea.set_time(time);
            on_gpu.set_time(time);
            for level in 0..on_gpu.motion().mip_level_count() {
                let side = on_gpu.motion().width() >> level;
                // The footprint that a level is for.
                let footprint = (std::f64::consts::PI / highest) as f32 * (1 << level) as f32;
                let expected = expected(&sea, &tile, side, if level == 0 { 0.0 } else { footprint });
                let got = samples(&gpu, on_gpu.motion(), 0, level);
                for (f, off) in difference(&got, &expected).into_iter().enumerate() {
                    assert!(
                        off < TOLERANCE,
                        "{samples_a_side} by {transform} at {time}, level {level}, {}: {off}",
                        FIELDS[f]
                    );
                    worst = worst.max(off);
                }
            }
        }
    }
    println!("at most {worst:.1e} of the root mean square");
}

#[test]
fn a_few_waves_are_their_closed_form() {
    let Some(gpu) = gpu() else { return };
    let state = SeaState::of_wind(9.0, 0.3, 2e5).expect("a wind");
    let (length, options) = (90.0, Options { foam: false, ..Options::default() });
    let step = TAU / length;
    for depth in [3.0, f64::INFINITY] {
        let state = SeaState { depth, ..state.clone() };
        // Only (±4, 0) and (0, ±4).
        let tile = Tile { length, turn: 0.0, samples: 64, lowest: 3.9 * step, highest: 4.05 * step };
        let sea = Cascades::with_tiles(&state, &[tile], &options).expect("a sea");
        let mut on_gpu = GpuSea::new(&gpu, &sea).expect("a sea");
        let spectrum = sea.spectra().next().expect("a tile");
        for time in [0.0, 3.7, 86_400.25, 315_576_000.5] {
            on_gpu.set_time(time);
            let got = samples(&gpu, on_gpu.motion(), 0, 0);
            let mut expected = vec![[0.0; 8]; got.len()];
            for (m, n) in [(4, 0), (-4, 0), (0, 4), (0, -4)] {
                let wave = spectrum.wave(m, n);
                assert!(wave.turns > 0.0 && wave.levels == 1, "{wave:?}");
                let (k, angle) = (4.0 * step, TAU * (wave.turns * time).fract());
                let coth = if depth.is_finite() { 1.0 / (k * depth).tanh() } else { 1.0 };
                let (kx, ky) = (f64::from(m) * step, f64::from(n) * step);
                let (ux, uy) = (kx / k * coth, ky / k * coth);
                let [s, d] = [wave.sum, wave.difference].map(|c| c.map(f64::from));
                let (sine, cosine) = angle.sin_cos();
                let h = [s[0] * cosine + d[1] * sine, s[1] * cosine - d[0] * sine];
                for (at, e) in expected.iter_mut().enumerate() {
                    let apart = length / 64.0;
                    let (sine, cosine) = (kx * (at % 64) as f64 * apart + ky * (at / 64) as f64 * apart).sin_cos();
                    // h e^(ik·x), and i times that: the real parts.
                    let (real, quarter) = (h[0] * cosine - h[1] * sine, -h[0] * sine - h[1] * cosine);
                    let own = [
                        real,
                        ux * quarter,
                        -ux * kx * real,
                        uy * quarter,
                        -uy * ky * real,
                        kx * quarter,
                        -ux * ky * real,
                        ky * quarter,
                    ];
                    (0..8).for_each(|f| e[f] += own[f]);
                }
            }
            let expected: Vec<[f32; 8]> = expected.iter().map(|e| e.map(|e| e as f32)).collect();
            for (f, off) in difference(&got, &expected).into_iter().enumerate() {
                // ∂x/∂y vanishes for waves along the axes.
                assert!(off < TOLERANCE || FIELDS[f] == "xy", "{depth} at {time}, {}: {off}", FIELDS[f]);
            }
        }
    }
}

#[test]
fn an_instant_has_the_same_bits_whatever_was_before() {
    let Some(gpu) = gpu() else { return };
    let state = SeaState::beaufort(6.0, 0.6).expect("a state");
    let sea = Cascades::new(&state, &Options { samples: 64, ..Options::default() }).expect("a sea");
    for transform in [Transform::Passes, Transform::Lines] {
        unchanged_by_the_past(&gpu, &sea, transform);
    }
}

fn unchanged_by_the_past(gpu: &Gpu, sea: &Cascades, transform: Transform) {
    let new = || GpuSea::with_transform(gpu, sea, transform).expect("a sea");
    let (mut one, mut other) = (new(), new());
    one.set_time(77.7);
    // A jump ahead, one back, and some ticks.
    [1e6, 3.0, 76.2, 77.1, 77.7].into_iter().for_each(|time| other.set_time(time));
    let places: Vec<[f32; 4]> = (0..1024_u16).map(|i| [f32::from(i % 32), f32::from(i / 32), 0.0, 0.0]).collect();
    let [a, b] = [&one, &other].map(|sea| told(gpu, sea, &places));
    assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert!(a.iter().any(|told| told[11] > 0.1), "no foam");
    for tile in 0..sea.tiles().len() as u32 {
        for level in 0..one.motion().mip_level_count() {
            let [a, b] = [&one, &other].map(|sea| samples(gpu, sea.motion(), tile, level));
            assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
            if level == 0 {
                assert!(a.iter().any(|sample| sample[0].abs() > 1e-4), "still water");
            }
        }
    }
}

#[test]
fn a_loop_returns_to_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let state = SeaState::beaufort(6.0, 0.6).expect("a state");
    let options = Options { samples: 64, foam: false, period: Some(20.0), ..Options::default() };
    let sea = Cascades::new(&state, &options).expect("a sea");
    let mut on_gpu = GpuSea::new(&gpu, &sea).expect("a sea");
    let mut at = |time| {
        on_gpu.set_time(time);
        samples(&gpu, on_gpu.motion(), 0, 0)
    };
    let first = at(2.5);
    assert!(first == at(22.5) && first == at(-17.5) && first != at(12.5));
}

/// What a shader is told of the surface: displacement, slope, stretch, hidden slopes, foam; then the displacement alone.
type Told = [f32; 16];

/// What the shader's functions tell of places (m from the origin) and footprints (m).
fn told(gpu: &Gpu, sea: &GpuSea, places: &[[f32; 4]]) -> Vec<Told> {
    let source = littoral_gpu::sea::sample_source(1)
        + "
        @group(0) @binding(0) var<storage, read> places: array<vec4f>;
        @group(0) @binding(1) var<storage, read_write> told: array<array<f32, 16>>;
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3u) {
            if id.x >= arrayLength(&places) {
                return;
            }
            let place = places[id.x];
            let s = sea_surface(place.xy, place.z);
            let d = sea_displacement(place.xy, place.z);
            told[id.x] = array<f32, 16>(
                s.displacement.x, s.displacement.y, s.displacement.z, s.slope.x, s.slope.y, s.stretch.x, s.stretch.y,
                s.stretch.z, s.hidden.x, s.hidden.y, s.hidden.z, s.foam, d.x, d.y, d.z, 0.0,
            );
        }";
    let device = &gpu.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let buffer = |size: usize, usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: size as u64,
            usage,
            mapped_at_creation: false,
        })
    };
    let (storage, copy) = (wgpu::BufferUsages::STORAGE, wgpu::BufferUsages::COPY_DST);
    let asked = buffer(size_of_val(places), storage | copy);
    let answers = buffer(places.len() * size_of::<Told>(), storage | wgpu::BufferUsages::COPY_SRC);
    let readable = buffer(places.len() * size_of::<Told>(), copy | wgpu::BufferUsages::MAP_READ);
    gpu.queue.write_buffer(&asked, 0, bytemuck::cast_slice(places));
    let entry = |binding, read_only| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[entry(0, true), entry(1, false)],
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: asked.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: answers.as_entire_binding() },
        ],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout), Some(sea.sample_layout())],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&layout),
        module: &module,
        entry_point: None,
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, sea.sample_group(), &[]);
        pass.dispatch_workgroups((places.len() as u32).div_ceil(64), 1, 1);
    }
    encoder.copy_buffer_to_buffer(&answers, 0, &readable, 0, None);
    gpu.queue.submit([encoder.finish()]);
    readable.slice(..).map_async(wgpu::MapMode::Read, |result| result.expect("a mapped buffer"));
    device.poll(wgpu::PollType::wait_indefinitely()).expect("a working device");
    let view = readable.slice(..).get_mapped_range().expect("a mapped range");
    bytemuck::cast_slice(&view).to_vec()
}

/// The processor's answers.
fn asked(sea: &Cascades, origin: DVec2, places: &[[f32; 4]]) -> Vec<Told> {
    let mut all = Vec::new();
    for block in places.chunks_exact(BLOCK) {
        let mut points = Points::at(0.0, 0.0);
        for (l, place) in block.iter().enumerate() {
            points.x[l] = origin.x + f64::from(place[0]);
            points.y[l] = origin.y + f64::from(place[1]);
            points.footprint[l] = place[2];
        }
        let mut m = Motion::STILL;
        sea.add_motion(&points, &mut m);
        all.extend((0..BLOCK).map(|l| {
            let hidden = [m.hidden_xx[l], m.hidden_xy[l], m.hidden_yy[l]];
            let [dx, dy, dz] = [m.dx[l], m.dy[l], m.dz[l]];
            let stretch = [m.dxx[l], m.dxy[l], m.dyy[l]];
            let [a, b, c] = stretch;
            let [d, e, f] = hidden;
            [dx, dy, dz, m.slope_x[l], m.slope_y[l], a, b, c, d, e, f, m.foam[l], dx, dy, dz, 0.0]
        }));
    }
    all
}

#[test]
fn places_are_told_what_the_processor_tells() {
    let Some(gpu) = gpu() else { return };
    let origin = DVec2::new(1_234_567.8, -345_678.9);
    let places: Vec<[f32; 4]> = (0..4096_i64)
        .map(|i| {
            let [x, y, width] = [0, 1, 2].map(|k| random::uniform(5, i, k, 0));
            // A third each: everything, footprints of the water nearby, and of that far away.
            let footprint = [0.0, 2.0, 300.0][(i % 3) as usize] * width;
            [(100.0 * (x - 0.5)) as f32, (100.0 * (y - 0.5)) as f32, footprint as f32, 0.0]
        })
        .collect();
    let (mut worst, mut worst_foam) = ([0.0_f64; 2], 0.0_f64);
    for (beaufort, options) in [
        (4.0, Options { samples: 64, ..Options::default() }),
        (8.0, Options { samples: 64, choppiness: 1.3, ..Options::default() }),
        (7.0, Options { samples: 64, period: Some(30.0), ..Options::default() }),
    ] {
        let state = SeaState::beaufort(beaufort, 0.6).expect("a state");
        let mut sea = Cascades::new(&state, &options).expect("a sea");
        let transform = if beaufort > 7.5 { Transform::Lines } else { Transform::Passes };
        let mut on_gpu = GpuSea::with_transform(&gpu, &sea, transform).expect("a sea");
        on_gpu.set_origin(origin);
        // A jump, a tick, within a tick, some ticks, and a jump back.
        for time in [100.1, 100.3, 100.4, 103.2, 20.0] {
            sea.set_time(time);
            on_gpu.set_time(time);
            let (got, expected) = (told(&gpu, &on_gpu, &places), asked(&sea, origin, &places));
            let mut foamy = 0;
            for field in 0..15 {
                let square: f64 = expected.iter().map(|e| f64::from(e[field]).powi(2)).sum();
                let rms = (square / expected.len() as f64).sqrt();
                // Where everything is asked for, and over footprints.
                let mut most = [0.0_f64; 2];
                for ((place, g), e) in places.iter().zip(&got).zip(&expected) {
                    let most = &mut most[usize::from(place[2] > 0.0)];
                    *most = most.max((f64::from(g[field]) - f64::from(e[field])).abs());
                }
                assert!(got.iter().all(|g| g[field].is_finite()));
                if field == 11 {
                    // What is fainter than a 512th is dropped on one side only, now and then.
                    foamy = expected.iter().filter(|e| e[field] > 0.1).count();
                    worst_foam = most[0].max(most[1]).max(worst_foam);
                    assert!(worst_foam < 0.01, "foam: {most:?}");
                    continue;
                }
                // Places are known to 10⁻⁷ of their distance, which is 10⁻⁴ of the shortest waves. The processor has coarse levels on
                // 64 samples where here they have fewer: between them waves differ by the error of interpolation.
                let [whole, coarse] = most.map(|most| most / rms);
                worst = [worst[0].max(whole), worst[1].max(coarse)];
                assert!(whole < 2e-3 && coarse < 0.03, "{beaufort} at {time}, {field}: {whole} {coarse}");
            }
            assert!(beaufort < 7.0 || foamy > 50, "{foamy}");
        }
    }
    println!("at most {worst:?} of the root mean square, foam {worst_foam:.1e}");
}

#[test]
fn copied_samples_are_those_of_the_processor() {
    let Some(gpu) = gpu() else { return };
    let state = SeaState::beaufort(7.0, 0.6).expect("a state");
    // The first tile has fewer samples than the others, and coarse levels have more on the processor.
    let options = Options { samples: 256, ..Options::default() };
    let mut sea = Cascades::new(&state, &options).expect("a sea");
    assert!(sea.tiles().any(|tile| tile.samples == 128));
    let mut on_gpu = GpuSea::new(&gpu, &sea).expect("a sea");
    let places: Vec<[f32; 4]> = (0..1024_u16)
        .map(|i| [f32::from(i % 32) * 1.7, f32::from(i / 32) * 2.3, if i % 2 == 0 { 0.0 } else { 0.7 }, 0.0])
        .collect();
    on_gpu.set_time(40.0);
    sea.set_time(7.25);
    assert!(on_gpu.copy(&sea) && on_gpu.time() == 7.25);
    // Where everything is asked for, and over footprints, which also see samples of coarse levels that are fewer here.
    let compare = |on_gpu: &GpuSea, tolerances: [f64; 2]| {
        let (got, expected) = (told(&gpu, on_gpu, &places), asked(&sea, DVec2::ZERO, &places));
        for field in [0, 1, 2, 3, 4, 8, 9, 10, 11] {
            let rms = (expected.iter().map(|e| f64::from(e[field]).powi(2)).sum::<f64>() / 1024.0).sqrt();
            for ((place, g), e) in places.iter().zip(&got).zip(&expected) {
                let off = (f64::from(g[field]) - f64::from(e[field])).abs();
                let tolerance = tolerances[usize::from(place[2] > 0.0)];
                assert!(off < tolerance * rms + 1e-6, "{field}: {off} of {rms}");
            }
        }
    };
    compare(&on_gpu, [1e-3, 0.03]);
    // Back to its own: the foam of this instant, and tiles of equal samples.
    on_gpu.set_time(7.25);
    compare(&on_gpu, [0.03; 2]);
    let other = Cascades::new(&SeaState::beaufort(3.0, 0.6).expect("a state"), &options).expect("a sea");
    assert!(!on_gpu.copy(&other));
}

#[test]
fn shaders_are_sound() {
    let sources = [
        transform_source(Transform::Passes),
        transform_source(Transform::Lines),
        include_str!("../src/shaders/sea_foam.wgsl").into(),
        littoral_gpu::sea::sample_source(3),
    ];
    for source in sources {
        let module = naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
    }
}
