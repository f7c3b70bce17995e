//! Plain pictures: the triangles themselves, flatly lit, ground and waves alike. They are quick where the graphics card is made of software, and show every
//! triangle as it is; the real light is the renderer's (`littoral_gpu`).

use glam::{DVec3, Vec3};
use littoral::field::{HeightField, Land};
use littoral::lod::{Mesh, Vertex};
use littoral::picture::Stage;
use littoral::space::{Datum, View};
use littoral_gpu::Gpu;
use wgpu::util::DeviceExt;

/// Where the meshes lie.
#[derive(Debug)]
pub struct Scenery {
    ground: Datum,
    water: Datum,
    low: f32,
    high: f32,
}

impl Scenery {
    /// Of a stage.
    pub fn new(stage: &Stage<'_>) -> Scenery {
        let land = stage.land();
        let range = land.height_range();
        Scenery { ground: land.datum(), water: sea_datum(land), low: range.low, high: range.high }
    }
}

/// What the sea's heights over a land are counted from: its rectangle, without what the land is padded with.
pub fn sea_datum(land: &Land) -> Datum {
    Datum::Plane { origin: land.origin(), size: land.extent() }
}

/// What is drawn.
pub struct Frame<'a> {
    /// The camera.
    pub view: &'a View,
    /// The ground.
    pub ground: &'a Mesh,
    /// The water.
    pub water: Option<&'a Mesh>,
    /// Whether surfaces are drawn.
    pub surface: bool,
    /// Whether edges are drawn.
    pub wireframe: bool,
}

/// Draws.
pub struct Renderer {
    surface: wgpu::RenderPipeline,
    edges: wgpu::RenderPipeline,
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Uniforms {
    clip_from_eye: [[f32; 4]; 4],
    eye: [i32; 2],
    step: [f32; 2],
    height: f32,
    kind: f32,
    low: f32,
    high: f32,
}

const SHADER: &str = "
struct Uniforms { clip_from_eye: mat4x4f, eye: vec2i, step: vec2f, height: f32, kind: f32, low: f32, high: f32 }
@group(0) @binding(0) var<uniform> u: Uniforms;
struct Out { @builtin(position) clip: vec4f, @location(0) at: vec3f }
@vertex fn vertex(@location(0) place: vec3u, @location(1) height: f32) -> Out {
  let at = vec3f(vec2f(vec2i(place.xy) - u.eye) * u.step, height - u.height);
  return Out(u.clip_from_eye * vec4f(at, 1.0), at);
}
@fragment fn surface(in: Out) -> @location(0) vec4f {
  var n = normalize(cross(dpdx(in.at), dpdy(in.at)));
  if (n.z < 0.0) { n = -n; }
  let light = 0.25 + 0.75 * max(dot(n, normalize(vec3f(-0.7, -0.4, 0.6))), 0.0);
  let h = in.at.z + u.height;
  let t = clamp((h - max(u.low, 0.0)) / max(u.high - max(u.low, 0.0), 1.0), 0.0, 1.0);
  var c = mix(vec3f(0.33, 0.42, 0.20), vec3f(0.62, 0.56, 0.48), smoothstep(0.1, 0.7, t));
  c = mix(c, vec3f(0.95), smoothstep(0.75, 0.9, t));
  c = mix(vec3f(0.5, 0.46, 0.4), c, smoothstep(0.6, 0.85, n.z));
  if (h < 1.5) { c = vec3f(0.72, 0.66, 0.5); }
  if (u.kind > 0.5) { c = mix(vec3f(0.05, 0.17, 0.24), vec3f(0.25, 0.36, 0.42), 1.0 - n.z * n.z); }
  let mist = 1.0 - exp(-length(in.at) / 25000.0);
  return vec4f(mix(c * light, vec3f(0.72, 0.79, 0.86), mist), 1.0);
}
@fragment fn edges(in: Out) -> @location(0) vec4f { return select(vec4f(0.06, 0.05, 0.04, 1.0), vec4f(0.02, 0.1, 0.2, 1.0), u.kind > 0.5); }
";

impl Renderer {
    /// For a format of targets.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Renderer {
        let shader = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("plain"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let make = |entry, topology, bias| {
            gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(entry),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &shader,
                    entry_point: Some("vertex"),
                    compilation_options: Default::default(),
                    buffers: &[Some(wgpu::VertexBufferLayout {
                        array_stride: size_of::<Vertex>() as u64,
                        step_mode: wgpu::VertexStepMode::Vertex,
                        attributes: &wgpu::vertex_attr_array![0 => Uint32x3, 1 => Float32],
                    })],
                },
                primitive: wgpu::PrimitiveState { topology, ..Default::default() },
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: wgpu::TextureFormat::Depth32Float,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                    stencil: Default::default(),
                    bias,
                }),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &shader,
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    targets: &[Some(format.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        Renderer {
            surface: make("surface", wgpu::PrimitiveTopology::TriangleList, Default::default()),
            edges: make("edges", wgpu::PrimitiveTopology::LineList, Default::default()),
        }
    }

    /// Draws a frame.
    pub fn draw(&self, gpu: &Gpu, scenery: &Scenery, frame: &Frame<'_>, target: &wgpu::TextureView) {
        let size = frame.view.size;
        let depth = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let depth = depth.create_view(&Default::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r: 0.72, g: 0.79, b: 0.86, a: 1.0 }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let parts = [(frame.ground, &scenery.ground, 0.0)];
        for (mesh, datum, kind) in parts.into_iter().chain(frame.water.map(|water| (water, &scenery.water, 1.0))) {
            let Datum::Plane { origin, size } = *datum else { continue };
            if mesh.triangles.is_empty() {
                continue;
            }
            let steps = f64::from(1u32 << 30);
            let eye: DVec3 = frame.view.eye;
            let lattice = ((eye.truncate() - origin) / size * steps).round();
            let step = size / steps;
            let rest = eye.truncate() - origin - lattice * step;
            let shift = glam::Mat4::from_translation(Vec3::new(-rest.x as f32, -rest.y as f32, 0.0));
            let uniforms = Uniforms {
                clip_from_eye: (frame.view.clip_from_eye * shift).to_cols_array_2d(),
                eye: [lattice.x as i32, lattice.y as i32],
                step: [step.x as f32, step.y as f32],
                height: eye.z as f32,
                kind,
                low: scenery.low,
                high: scenery.high,
            };
            let buffer = |contents, usage| {
                gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
            };
            let uniforms = buffer(bytemuck::bytes_of(&uniforms), wgpu::BufferUsages::UNIFORM);
            let vertices = buffer(bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX);
            let lines: Vec<[u32; 6]> = match frame.wireframe {
                true => mesh.triangles.iter().map(|&[a, b, c]| [a, b, b, c, c, a]).collect(),
                false => Vec::new(),
            };
            let all = [
                (&self.surface, frame.surface, bytemuck::cast_slice::<_, u32>(&mesh.triangles)),
                (&self.edges, frame.wireframe, bytemuck::cast_slice::<_, u32>(&lines)),
            ];
            for (pipeline, wanted, indices) in all {
                if !wanted {
                    continue;
                }
                let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout: &pipeline.get_bind_group_layout(0),
                    entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() }],
                });
                let index = buffer(bytemuck::cast_slice(indices), wgpu::BufferUsages::INDEX);
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.set_index_buffer(index.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..indices.len() as u32, 0, 0..1);
            }
        }
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
    }
}
