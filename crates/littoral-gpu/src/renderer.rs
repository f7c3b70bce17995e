//! The passes of a picture: how far away surfaces are, the light of every pixel, and the screen.

use crate::bindings;
use crate::device::{Gpu, GpuError};
use crate::frame::{self, Look, Uniforms};
use crate::objects::{OBJECT_SHADER, ObjectPass};
use crate::rays::ShapeTexture;
use crate::scenery::{self, Scenery};
use crate::triangles::Triangles;
use crate::waves::{self, WavePass, Wet};
use glam::{UVec2, Vec3};
use littoral::lod::Vertex;
use littoral::picture::Medium;
use littoral::space::View;

/// Every shader with its name, as it is compiled: for tests that need no device.
pub const SHADERS: [(&str, &str); 5] = [
    ("surface", concat!(include_str!("shaders/frame.wgsl"), include_str!("shaders/surface.wgsl"))),
    (
        "shade",
        concat!(
            include_str!("shaders/frame.wgsl"),
            include_str!("shaders/noise.wgsl"),
            include_str!("shaders/ground.wgsl"),
            include_str!("shaders/air.wgsl"),
            include_str!("shaders/natural.wgsl"),
            include_str!("shaders/water.wgsl"),
            include_str!("shaders/coat.wgsl"),
            include_str!("shaders/block.wgsl"),
            include_str!("shaders/shade.wgsl"),
        ),
    ),
    ("display", include_str!("shaders/display.wgsl")),
    ("wires", concat!(include_str!("shaders/frame.wgsl"), include_str!("shaders/wires.wgsl"))),
    OBJECT_SHADER,
];

pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Radiance (kcd/m²), and the distance of what is seen (m), 0 for the sky.
pub(crate) const RADIANCE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// What tells how far away the ground is.
#[derive(Clone, Copy, Debug)]
pub enum Ground<'a> {
    /// A mesh of it.
    Triangles(&'a Triangles),
    /// A ray through each pixel.
    Rays {
        /// What they meet.
        shape: &'a ShapeTexture,
        /// 0 for exact hits; otherwise squares of ground that are not wider than so many pixels are drawn as high as their highest point.
        pixels: f32,
    },
}

/// What a picture is drawn into before it is shown, and what passes are bound to that read it.
#[derive(Debug)]
struct Canvas {
    size: UVec2,
    depth: wgpu::TextureView,
    radiance: wgpu::Texture,
    light: wgpu::TextureView,
    /// Of one pixel where no waves were drawn yet.
    wet: Wet,
    /// How far away ground and sea are.
    distances: wgpu::BindGroup,
    /// The light, and how it is shown.
    shown: wgpu::BindGroup,
}

/// Draws sceneries. Made once for a device and the format of what is drawn to.
#[derive(Debug)]
pub struct Renderer {
    surface: wgpu::RenderPipeline,
    shade: wgpu::RenderPipeline,
    display: wgpu::RenderPipeline,
    wires: wgpu::RenderPipeline,
    format: wgpu::TextureFormat,
    uniforms: wgpu::Buffer,
    /// Those.
    frame: wgpu::BindGroup,
    shown: wgpu::Buffer,
    canvas: Option<Canvas>,
    /// Made when the first waves are drawn.
    waves: Option<WavePass>,
    objects: ObjectPass,
}

impl Renderer {
    /// A renderer that draws to targets of a format: 8 bits a channel, encoded as sRGB by the format or not.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Renderer {
        let device = &gpu.device;
        let [surface, shade, display, wires, objects] = SHADERS.map(|(label, source)| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        });
        let attributes = wgpu::vertex_attr_array![0 => Uint32x2];
        let height = wgpu::VertexAttribute { format: wgpu::VertexFormat::Float32, offset: 12, shader_location: 1 };
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &[attributes[0], height],
        };
        let surface = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("surface"),
            layout: Some(&bindings::pipeline_layout(device, "surface", &[&frame::layout(device)])),
            vertex: wgpu::VertexState {
                module: &surface,
                entry_point: Some("surface"),
                compilation_options: Default::default(),
                buffers: &[Some(vertices)],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: None,
            multiview_mask: None,
            cache: None,
        });
        let everywhere = |label, module: &wgpu::ShaderModule, format: wgpu::TextureFormat, groups: &[_]| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(label),
                layout: Some(&bindings::pipeline_layout(device, label, groups)),
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
                    entry_point: Some(label),
                    compilation_options: Default::default(),
                    targets: &[Some(format.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let wires = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("wires"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &wires,
                entry_point: Some("wire"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &wires,
                entry_point: Some("drawn"),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format,
                    blend: Some(wgpu::BlendState::ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        });
        let uniform = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let uniforms = uniform("frame", size_of::<Uniforms>() as u64);
        let frame = bindings::group(device, "frame", &frame::layout(device), [uniforms.as_entire_binding()]);
        let lit = [
            &frame::layout(device),
            &scenery::layout(device),
            &distances_layout(device),
            &waves::run_up_layout(device),
        ];
        Renderer {
            surface,
            shade: everywhere("shade", &shade, RADIANCE, &lit),
            display: everywhere("display", &display, format, &[&shown_layout(device)]),
            wires,
            format,
            uniforms,
            frame,
            shown: uniform("shown", 32),
            canvas: None,
            waves: None,
            objects: ObjectPass::new(gpu, &objects),
        }
    }

    /// Makes the canvas for pictures of a size, if it is not that.
    fn set_canvas(&mut self, gpu: &Gpu, size: UVec2) {
        let kept = self.canvas.take().filter(|canvas| canvas.size == size);
        self.canvas = Some(kept.unwrap_or_else(|| Canvas::new(gpu, size, &self.shown)));
    }

    /// Records the first pass of a picture alone: how far away the ground is.
    pub fn distances(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        scenery: &Scenery,
        ground: Ground<'_>,
        view: &View,
        look: Look,
    ) {
        gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&Uniforms::new(scenery, view, look)));
        self.set_canvas(gpu, view.size);
        let Some(canvas) = &self.canvas else { return };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surface"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &canvas.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: gpu.render_times("surface"),
            ..Default::default()
        });
        match ground {
            Ground::Triangles(triangles) => self.surface(&mut pass, triangles),
            Ground::Rays { shape, pixels } => shape.cast(gpu, &mut pass, &self.frame, view, pixels),
        }
    }

    /// Records the passes that find what a view sees of a scenery with this ground, and its light.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        scenery: &Scenery,
        ground: Ground<'_>,
        view: &View,
        look: Look,
    ) {
        self.distances(gpu, encoder, scenery, ground, view, look);
        let Some(canvas) = &mut self.canvas else { return };
        if let Some(waves) = &scenery.waves {
            canvas.wet(gpu);
            let passes = self.waves.get_or_insert_with(|| WavePass::new(gpu, DEPTH));
            passes.draw(gpu, encoder, &self.uniforms, waves, scenery.land, view, &canvas.depth, &canvas.wet);
        }

        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shade"),
            color_attachments: &[Some(onto(&canvas.light, wgpu::LoadOp::Clear(wgpu::Color::BLACK)))],
            timestamp_writes: gpu.render_times("shade"),
            ..Default::default()
        });
        pass.set_pipeline(&self.shade);
        for (number, group) in (0..).zip([&self.frame, &scenery.group, &canvas.distances, scenery.run_up()]) {
            pass.set_bind_group(number, group, &[]);
        }
        pass.draw(0..3, 0..1);
        drop(pass);
        self.objects.draw(gpu, encoder, (&self.frame, view), scenery, &canvas.radiance, &canvas.depth);
    }

    /// How many triangles of objects were drawn last.
    pub fn object_triangles(&self) -> u64 {
        self.objects.triangles
    }

    /// Records triangles, as far away as they are.
    fn surface(&self, pass: &mut wgpu::RenderPass<'_>, ground: &Triangles) {
        let (Some(vertices), Some(corners), false) = (&ground.vertices, &ground.corners, ground.is_empty()) else {
            return;
        };
        pass.set_pipeline(&self.surface);
        pass.set_bind_group(0, &self.frame, &[]);
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_index_buffer(corners.slice(..), wgpu::IndexFormat::Uint32);
        match &ground.drawn {
            Some(drawn) => pass.draw_indexed_indirect(drawn, 0),
            None => pass.draw_indexed(0..ground.count, 0, 0..1),
        }
    }

    /// Records the pass that draws the edges of triangles over what was shown: onto a target of the size that was drawn. What lies behind the ground is hidden. Of
    /// more triangles than shaders can read there are no edges.
    pub fn wires(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        triangles: &Triangles,
        target: &wgpu::TextureView,
    ) {
        let Some(canvas) = &self.canvas else { return };
        let (Some(vertices), Some(corners), false) = (&triangles.vertices, &triangles.corners, triangles.is_empty())
        else {
            return;
        };
        let most = gpu.device.limits().max_storage_buffer_binding_size;
        if vertices.size().max(corners.size()) > most {
            return; // shaders could not read all of them
        }
        let buffers = [(0, &self.uniforms), (16, vertices), (17, corners)];
        let bound = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("wires"),
            layout: &self.wires.get_bind_group_layout(0),
            entries: &buffers
                .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }),
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("wires"),
            color_attachments: &[Some(onto(target, wgpu::LoadOp::Load))],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &canvas.depth,
                depth_ops: None,
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.wires);
        pass.set_bind_group(0, &bound, &[]);
        match &triangles.drawn {
            Some(drawn) => pass.draw_indirect(drawn, 0),
            None => pass.draw(0..triangles.count, 0..1),
        }
    }

    /// Records the pass that shows what was drawn last on a target of some size (pixels), the drawn picture stretched over all of it. `grey` is the radiance (kcd/m²) that is shown
    /// as middle grey, where the picture has an exposure.
    pub fn show(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        scenery: &Scenery,
        grey: f32,
        target: &wgpu::TextureView,
        size: UVec2,
    ) {
        let Some(canvas) = &self.canvas else { return };
        let stretch = canvas.size.as_vec2() / size.max(UVec2::ONE).as_vec2();
        let encodes = if self.format.is_srgb() { 1.0 } else { 0.0 };
        let grey = grey.max(1e-9);
        let (medium, scale) = match scenery.medium {
            Medium::Photograph => (0.0, scenery.balance * (0.30 / grey)),
            Medium::Model => (1.0, scenery.balance * (0.18 / grey)),
            Medium::Paper => (2.0, Vec3::ONE),
        };
        let shown = [scale.x, scale.y, scale.z, medium, encodes, stretch.x, stretch.y, 0.0];
        gpu.queue.write_buffer(&self.shown, 0, bytemuck::cast_slice(&shown));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("display"),
            color_attachments: &[Some(onto(target, wgpu::LoadOp::Clear(wgpu::Color::BLACK)))],
            ..Default::default()
        });
        pass.set_pipeline(&self.display);
        pass.set_bind_group(0, &canvas.shown, &[]);
        pass.draw(0..3, 0..1);
    }

    /// What was drawn last, read back: for each pixel, row by row from the top left, radiance (kcd/m²) and the distance (m) of what is seen, 0 for the sky.
    ///
    /// # Errors
    /// If the device was lost.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<[f32; 4]>, GpuError> {
        let Some(canvas) = &self.canvas else { return Ok(Vec::new()) };
        let (width, height) = (canvas.radiance.width(), canvas.radiance.height());
        let row = (width * 16).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            canvas.radiance.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            canvas.radiance.size(),
        );
        gpu.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        gpu.check()?;
        let lost =
            |e: &dyn std::fmt::Display| GpuError::Lost { adapter: gpu.adapter.name.clone(), reason: e.to_string() };
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(&e))?;
        let mapped = buffer.get_mapped_range(..).map_err(|e| lost(&e))?;
        let rows = mapped.chunks_exact(row as usize);
        Ok(rows.flat_map(|r| bytemuck::cast_slice::<u8, [f32; 4]>(&r[..width as usize * 16])).copied().collect())
    }
}

impl Canvas {
    /// For pictures of a size; how they are shown is in a buffer.
    fn new(gpu: &Gpu, size: UVec2, how: &wgpu::Buffer) -> Canvas {
        let depth = drawable(gpu, "depth", size, DEPTH, wgpu::TextureUsages::empty());
        let depth = depth.create_view(&Default::default());
        let radiance = drawable(gpu, "radiance", size, RADIANCE, wgpu::TextureUsages::COPY_SRC);
        let light = radiance.create_view(&Default::default());
        let wet = Wet::new(gpu, UVec2::ONE, DEPTH);
        let distances = distances(gpu, &depth, &wet);
        let shown = bindings::group(
            &gpu.device,
            "display",
            &shown_layout(&gpu.device),
            [wgpu::BindingResource::TextureView(&light), how.as_entire_binding()],
        );
        Canvas { size, depth, radiance, light, wet, distances, shown }
    }

    /// Makes room for the sea in each pixel, if there is none yet.
    fn wet(&mut self, gpu: &Gpu) {
        let size = self.size.max(UVec2::ONE);
        if self.wet.size != size {
            self.wet = Wet::new(gpu, size, DEPTH);
            self.distances = distances(gpu, &self.depth, &self.wet);
        }
    }
}

/// What the pass that shades is bound to of a canvas.
fn distances(gpu: &Gpu, depth: &wgpu::TextureView, wet: &Wet) -> wgpu::BindGroup {
    let views = [depth, &wet.depth, &wet.seen].map(wgpu::BindingResource::TextureView);
    bindings::group(&gpu.device, "distances", &distances_layout(&gpu.device), views)
}

fn distances_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let types = [bindings::depths(), bindings::depths(), bindings::numbers()];
    bindings::group_layout(device, "distances", wgpu::ShaderStages::FRAGMENT, &types)
}

/// The light of a picture, and how it is shown.
fn shown_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let types = [bindings::texels(wgpu::TextureViewDimension::D2), bindings::uniform(false)];
    bindings::group_layout(device, "display", wgpu::ShaderStages::FRAGMENT, &types)
}

/// A texture of a size (pixels, at least one each way) that passes draw and shaders read.
pub(crate) fn drawable(
    gpu: &Gpu,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x.max(1), height: size.y.max(1), depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

/// A colour attachment that keeps what is drawn.
pub(crate) fn onto(view: &wgpu::TextureView, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
    }
}
