//! Objects on the device: each one's forms are brought there once, and a picture draws those that it sees as instances, in the form that each is worth.
//!
//! They are drawn after everything else was lit, before and behind it by distance, and lit by themselves: into the same light and air, in one pass.

use crate::renderer::{DEPTH, RADIANCE, drawable, onto};
use crate::scenery::{self, Scenery};
use crate::triangles::fill;
use crate::{Gpu, bindings, frame};
use bytemuck::{Pod, Zeroable};
use glam::UVec2;
use littoral::objects::{Corner, Object};
use littoral::picture::Placed;
use littoral::space::View;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use wgpu::util::DeviceExt;

/// The shader with its name.
pub(crate) const OBJECT_SHADER: (&str, &str) = (
    "objects",
    concat!(
        include_str!("shaders/frame.wgsl"),
        include_str!("shaders/ground.wgsl"),
        include_str!("shaders/air.wgsl"),
        include_str!("shaders/objects.wgsl"),
    ),
);

/// `Placed` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Instance {
    axes: [[f32; 4]; 3],
    sunny: [f32; 4],
    heights: [f32; 2],
}

/// An object's forms on the device, one after the other.
#[derive(Debug)]
struct Model {
    object: Arc<Object>,
    corners: wgpu::Buffer,
    triangles: wgpu::Buffer,
    /// Where each form's indices are, and its first corner.
    forms: Vec<(Range<u32>, i32)>,
}

/// Objects that do not fit into the device's buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected objects that fit into {megabytes} MiB each, which is what this graphics adapter's buffers hold, got one of {triangles} triangles or {placed} of them; simplify it, place fewer, or draw on the processor"
)]
pub struct TooManyObjects {
    /// Triangles of the largest.
    pub triangles: usize,
    /// How many stand somewhere.
    pub placed: usize,
    /// What a buffer holds at most.
    pub megabytes: u64,
}

/// Objects as they stand at an instant, on the device.
#[derive(Debug, Default)]
pub(crate) struct Objects {
    models: Vec<Model>,
    /// Which model each is of.
    placed: Vec<(usize, Placed)>,
}

impl Objects {
    /// Places objects anew. What is on the device already stays there.
    pub fn set(&mut self, gpu: &Gpu, placed: &[Placed]) -> Result<(), TooManyObjects> {
        let most = gpu.device.limits().max_buffer_size;
        let bytes = |object: &Object| {
            let forms = object.forms().iter();
            forms.map(|form| size_of_val(&form.corners[..]).max(size_of_val(&form.triangles[..])) as u64).sum::<u64>()
        };
        let instances = size_of_val(placed) as u64;
        let largest = placed.iter().map(|placed| bytes(&placed.object)).max().unwrap_or(0);
        if largest.max(instances) > most {
            let triangles = placed.iter().map(|placed| placed.object.forms()[0].triangles.len()).max().unwrap_or(0);
            return Err(TooManyObjects { triangles, placed: placed.len(), megabytes: most >> 20 });
        }
        self.models.retain(|model| placed.iter().any(|placed| Arc::ptr_eq(&placed.object, &model.object)));
        self.placed.clear();
        // Neighbours in the list are often the same thing.
        let mut last = 0;
        for placed in placed {
            let is_it = |model: &Model| Arc::ptr_eq(&model.object, &placed.object);
            if !self.models.get(last).is_some_and(is_it) {
                last = self.models.iter().position(is_it).unwrap_or_else(|| {
                    self.models.push(Model::new(gpu, &placed.object));
                    self.models.len() - 1
                });
            }
            self.placed.push((last, placed.clone()));
        }
        Ok(())
    }

    /// The instances that a view sees, by object and form.
    fn seen(&self, view: &View) -> BTreeMap<(usize, usize), Vec<Instance>> {
        let mut seen: BTreeMap<(usize, usize), Vec<Instance>> = BTreeMap::new();
        for (model, Placed { object, pose, sunny }) in &self.placed {
            if let Some(form) = pose.form(object, view) {
                let (low, high) = object.bounds();
                let origin = (pose.origin - view.eye).as_vec3().to_array();
                let columns = pose.axes.to_cols_array_2d();
                seen.entry((*model, form)).or_default().push(Instance {
                    axes: [0, 1, 2].map(|i| [columns[i][0], columns[i][1], columns[i][2], origin[i]]),
                    sunny: *sunny,
                    heights: [low.z, 3.0 / (high.z - low.z).max(1e-6)],
                });
            }
        }
        seen
    }
}

impl Model {
    fn new(gpu: &Gpu, object: &Arc<Object>) -> Model {
        let (mut corners, mut triangles, mut forms) = (Vec::<Corner>::new(), Vec::<[u32; 3]>::new(), Vec::new());
        for form in object.forms() {
            let indices = 3 * triangles.len() as u32..3 * (triangles.len() + form.triangles.len()) as u32;
            forms.push((indices, corners.len() as i32));
            corners.extend(&form.corners);
            triangles.extend(&form.triangles);
        }
        let made = |label, usage, contents: &[u8]| {
            let descriptor = wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage };
            gpu.device.create_buffer_init(&descriptor)
        };
        Model {
            object: object.clone(),
            corners: made("corners of an object", wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&corners)),
            triangles: made("triangles of an object", wgpu::BufferUsages::INDEX, bytemuck::cast_slice(&triangles)),
            forms,
        }
    }
}

/// The pass that draws objects.
#[derive(Debug)]
pub(crate) struct ObjectPass {
    pipeline: wgpu::RenderPipeline,
    /// What was drawn before them, as large as the canvas.
    behind: Option<wgpu::Texture>,
    instances: Option<wgpu::Buffer>,
    /// Triangles drawn last.
    pub triangles: u64,
}

impl ObjectPass {
    /// The pass of [`OBJECT_SHADER`].
    pub fn new(gpu: &Gpu, module: &wgpu::ShaderModule) -> ObjectPass {
        let corner = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3];
        let placed =
            wgpu::vertex_attr_array![3 => Float32x4, 4 => Float32x4, 5 => Float32x4, 6 => Float32x4, 7 => Float32x2];
        let buffers = [
            Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Corner>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &corner,
            }),
            Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Instance>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &placed,
            }),
        ];
        let device = &gpu.device;
        let groups = [&frame::layout(device), &scenery::layout(device), &behind_layout(device)];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("objects"),
            layout: Some(&bindings::pipeline_layout(device, "objects", &groups)),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("place"),
                compilation_options: Default::default(),
                buffers: &buffers,
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
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some("objects"),
                compilation_options: Default::default(),
                targets: &[Some(RADIANCE.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        ObjectPass { pipeline, behind: None, instances: None, triangles: 0 }
    }

    /// Records the pass, over what was lit so far.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (frame, view): (&wgpu::BindGroup, &View),
        scenery: &Scenery,
        radiance: &wgpu::Texture,
        depth: &wgpu::TextureView,
    ) {
        let seen = scenery.objects.seen(view);
        self.triangles = 0;
        if seen.is_empty() {
            return;
        }
        let all: Vec<Instance> = seen.values().flatten().copied().collect();
        fill(gpu, &mut self.instances, "objects", wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&all));
        // A pass cannot read what it draws onto.
        let size = UVec2::new(radiance.width(), radiance.height());
        let kept = self.behind.take().filter(|behind| (behind.width(), behind.height()) == (size.x, size.y));
        let behind = self
            .behind
            .insert(kept.unwrap_or_else(|| drawable(gpu, "behind", size, RADIANCE, wgpu::TextureUsages::COPY_DST)));
        encoder.copy_texture_to_texture(radiance.as_image_copy(), behind.as_image_copy(), radiance.size());
        let behind = behind.create_view(&Default::default());
        let behind = [wgpu::BindingResource::TextureView(&behind)];
        let behind = bindings::group(&gpu.device, "behind", &behind_layout(&gpu.device), behind);
        let target = radiance.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("objects"),
            color_attachments: &[Some(onto(&target, wgpu::LoadOp::Load))],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let Some(instances) = &self.instances else { return };
        pass.set_pipeline(&self.pipeline);
        for (number, group) in (0..).zip([frame, &scenery.group, &behind]) {
            pass.set_bind_group(number, group, &[]);
        }
        pass.set_vertex_buffer(1, instances.slice(..));
        let mut first = 0;
        for (&(model, form), of_it) in &seen {
            let model = &scenery.objects.models[model];
            let (indices, base) = &model.forms[form];
            let next = first + of_it.len() as u32;
            pass.set_vertex_buffer(0, model.corners.slice(..));
            pass.set_index_buffer(model.triangles.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(indices.clone(), *base, first..next);
            self.triangles += indices.len() as u64 / 3 * of_it.len() as u64;
            first = next;
        }
    }
}

/// What was drawn before objects.
fn behind_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let types = [bindings::texels(wgpu::TextureViewDimension::D2)];
    bindings::group_layout(device, "behind", wgpu::ShaderStages::FRAGMENT, &types)
}
