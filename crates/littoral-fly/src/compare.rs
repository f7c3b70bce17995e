//! Two pictures of the same view: side by side, or their difference, and how large that is.

use crate::draw::onto;
use glam::UVec2;
use littoral_gpu::Gpu;
use std::sync::mpsc::{Receiver, channel};

/// How far apart two pictures are, in steps of 255.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Difference {
    /// In the mean over all pixels and channels.
    pub mean: f64,
    /// The largest of any channel.
    pub largest: u32,
    /// Share of the pixels that differ by more than 24 steps in a channel.
    pub off: f64,
}

impl Difference {
    /// Of a picture of so many pixels, from what its tiles add up to.
    fn of(tiles: &[[u32; 4]], pixels: u64) -> Difference {
        let share = 1.0 / pixels.max(1) as f64;
        let total = |i: usize| tiles.iter().map(|tile| u64::from(tile[i])).sum::<u64>() as f64;
        Difference {
            mean: total(0) * share / 3.0,
            largest: tiles.iter().map(|tile| tile[1]).max().unwrap_or(0),
            off: total(2) * share,
        }
    }
}

/// What is shown of two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// Both, the second from so many pixels on.
    Halves(f32),
    /// Their difference, so many times amplified.
    Difference(f32),
}

/// Shows two pictures, and measures how far apart they are.
pub struct Compare {
    pictures: Option<[wgpu::Texture; 2]>,
    format: wgpu::TextureFormat,
    shows: wgpu::RenderPipeline,
    measures: wgpu::ComputePipeline,
    how: wgpu::Buffer,
    /// A measurement on its way.
    awaited: Option<Awaited>,
    /// The newest measurement.
    pub difference: Option<Difference>,
}

struct Awaited {
    buffer: wgpu::Buffer,
    pixels: u64,
    come: Receiver<bool>,
}

/// Pixels along a tile's side.
const TILE: u32 = 16;

impl Compare {
    /// Of pictures in a format of targets.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Compare {
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("compare"),
            source: wgpu::ShaderSource::Wgsl(include_str!("shaders/compare.wgsl").into()),
        });
        let measures = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("measure"),
            layout: None,
            module: &module,
            entry_point: Some("measure"),
            compilation_options: Default::default(),
            cache: None,
        });
        let how = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("how"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let shows = everywhere(gpu, &module, "compare", format);
        Compare { pictures: None, format, shows, measures, how, awaited: None, difference: None }
    }

    /// Where the two pictures of a size are to be drawn.
    pub fn pictures(&mut self, gpu: &Gpu, size: UVec2) -> [wgpu::TextureView; 2] {
        let kept = self.pictures.take().filter(|[first, _]| (first.width(), first.height()) == size.into());
        let pictures = self
            .pictures
            .insert(kept.unwrap_or_else(|| ["first", "second"].map(|label| canvas(gpu, label, self.format, size))));
        [&pictures[0], &pictures[1]].map(|picture| picture.create_view(&Default::default()))
    }

    /// Shows the two, and takes their measure now and then.
    pub fn show(&mut self, gpu: &Gpu, shown: Shown, target: &wgpu::TextureView) {
        self.hear(gpu);
        let Some(pictures) = &self.pictures else { return };
        let how = match shown {
            Shown::Halves(divider) => [divider, 0.0, 0.0, 0.0],
            Shown::Difference(gain) => [0.0, gain, 0.0, 0.0],
        };
        gpu.queue.write_buffer(&self.how, 0, bytemuck::cast_slice(&how));
        let views = [&pictures[0], &pictures[1]].map(|picture| picture.create_view(&Default::default()));
        let textures = [0, 1].map(|i: usize| wgpu::BindGroupEntry {
            binding: i as u32,
            resource: wgpu::BindingResource::TextureView(&views[i]),
        });
        let [first, second] = textures;
        let how = wgpu::BindGroupEntry { binding: 2, resource: self.how.as_entire_binding() };
        let bound = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("compare"),
            layout: &self.shows.get_bind_group_layout(0),
            entries: &[first.clone(), second.clone(), how],
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("compare"),
            color_attachments: &[Some(onto(target, wgpu::LoadOp::Clear(wgpu::Color::BLACK)))],
            ..Default::default()
        });
        pass.set_pipeline(&self.shows);
        pass.set_bind_group(0, &bound, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        if self.awaited.is_some() {
            gpu.queue.submit([encoder.finish()]);
            return;
        }
        let (width, height) = (pictures[0].width(), pictures[0].height());
        let (across, down) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let make = |label, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: u64::from(across * down) * 16,
                usage,
                mapped_at_creation: false,
            })
        };
        let tiles = make("tiles", wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let buffer = make("tiles read back", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let bound = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("measure"),
            layout: &self.measures.get_bind_group_layout(0),
            entries: &[first, second, wgpu::BindGroupEntry { binding: 3, resource: tiles.as_entire_binding() }],
        });
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.measures);
        pass.set_bind_group(0, &bound, &[]);
        pass.dispatch_workgroups(across, down, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&tiles, 0, &buffer, 0, buffer.size());
        gpu.queue.submit([encoder.finish()]);
        let (tells, come) = channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = tells.send(result.is_ok()); // nobody waits any more
        });
        self.awaited = Some(Awaited { buffer, pixels: u64::from(width) * u64::from(height), come });
    }

    /// Takes a measurement that has come.
    fn hear(&mut self, gpu: &Gpu) {
        let _ = gpu.device.poll(wgpu::PollType::Poll); // a lost device is noticed elsewhere
        let come = |awaited: &mut Awaited| awaited.come.try_recv() != Err(std::sync::mpsc::TryRecvError::Empty);
        let Some(awaited) = self.awaited.take_if(come) else { return };
        if let Ok(bytes) = awaited.buffer.get_mapped_range(..) {
            self.difference = Some(Difference::of(bytemuck::cast_slice(&bytes), awaited.pixels));
        }
    }
}

/// A texture to be drawn to, copied, and read by shaders.
pub fn canvas(gpu: &Gpu, label: &str, format: wgpu::TextureFormat, size: UVec2) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x.max(1), height: size.y.max(1), depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// A pipeline that runs a fragment shader over all of a target.
pub fn everywhere(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    entry: &str,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(entry),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("everywhere"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::paint::pixels;

    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

    /// A device, if there is one.
    pub fn device() -> Option<Gpu> {
        Gpu::headless().inspect_err(|problem| println!("untested without a device: {problem}")).ok()
    }

    /// Writes into a texture what a function says of each pixel.
    pub fn fill(gpu: &Gpu, texture: &wgpu::Texture, colour: impl Fn(UVec2) -> [u8; 3]) {
        let (width, height) = (texture.width(), texture.height());
        let pixel = |i: u32| colour(UVec2::new(i % width, i / width));
        let bytes: Vec<u8> = (0..width * height).flat_map(|i| [pixel(i).as_slice(), &[255]].concat()).collect();
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
        gpu.queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
    }

    #[test]
    fn two_pictures_are_shown_and_measured() {
        let Some(gpu) = device() else { return };
        let size = UVec2::new(70, 33);
        let mut compare = Compare::new(&gpu, FORMAT);
        let _ = compare.pictures(&gpu, size);
        let [first, second] = compare.pictures.as_ref().expect("made");
        let colour = |at: UVec2| [(at.x * 3) as u8, (at.y * 7) as u8, 40];
        // One pixel in the last, partly filled tile is far off, a column slightly.
        let other = |at: UVec2| match (at.x, at.y) {
            (69, 32) => [(69 * 3) as u8, 32 * 7, 140],
            (5, y) => [5 * 3, (y * 7) as u8, 44],
            _ => colour(at),
        };
        fill(&gpu, first, colour);
        fill(&gpu, second, other);
        let target = canvas(&gpu, "target", FORMAT, size);
        let view = target.create_view(&Default::default());
        compare.show(&gpu, Shown::Halves(20.0), &view);
        let shown = pixels(&gpu, &target).expect("read");
        assert_eq!(shown[5], colour(UVec2::new(5, 0)), "the first on the left");
        assert_eq!(shown[20], [255; 3], "the line between them");
        assert_eq!(shown[70 * 33 - 1], other(size - 1), "the second on the right");
        compare.show(&gpu, Shown::Difference(8.0), &view);
        let shown = pixels(&gpu, &target).expect("read");
        assert_eq!((shown[0], shown[5], shown[70 * 33 - 1]), ([0; 3], [0, 0, 32], [0, 0, 255]));
        let pixels = f64::from(size.element_product());
        let Difference { mean, largest, off } = compare.difference.expect("read back with the pictures");
        assert!((mean - (33.0 * 4.0 + 100.0) / 3.0 / pixels).abs() < 1e-9, "{mean}");
        assert!(largest == 100 && (off - 1.0 / pixels).abs() < 1e-12, "{largest}, {off}");
    }

    #[test]
    fn tiles_add_up() {
        let tiles = [[30, 9, 0, 0], [60, 40, 2, 0]];
        let difference = Difference::of(&tiles, 10);
        assert_eq!(difference, Difference { mean: 3.0, largest: 40, off: 0.2 });
        assert_eq!(Difference::of(&[], 0), Difference::default());
    }
}
