//! The passes of a tessellation and what they are bound to.

use super::TESSELLATION_SHADERS;
use crate::bindings;
use crate::device::Gpu;

/// What tessellates lands: made once for a device, for any number of [`Tessellator`](super::Tessellator)s.
#[derive(Clone, Debug)]
pub struct TessellationPasses {
    pub(super) first_levels: wgpu::ComputePipeline,
    pub(super) count: wgpu::ComputePipeline,
    pub(super) settle: wgpu::ComputePipeline,
    pub(super) cut: wgpu::ComputePipeline,
    pub(super) draw: wgpu::ComputePipeline,
    /// Of a level, of the workgroups of the next pass, and of what is drawn.
    pub(super) level: wgpu::BindGroupLayout,
    pub(super) turn: wgpu::BindGroupLayout,
    pub(super) drawing: wgpu::BindGroupLayout,
}

impl TessellationPasses {
    /// Takes as long as the shaders take to compile.
    pub fn new(gpu: &Gpu) -> TessellationPasses {
        let device = &gpu.device;
        let (uniform, write, texels) = (bindings::uniform(false), bindings::storage(false), bindings::numbers());
        let level = layout(device, &[uniform, uniform, texels, texels, write, write, write, write, write]);
        let turn = layout(device, &[write]);
        let drawing =
            layout(device, &[uniform, uniform, texels, texels, write, write, write, write, write, write, write]);
        let [levels, draw] = TESSELLATION_SHADERS.map(|(label, source)| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        });
        let pipeline = |module, entry, groups: &[&wgpu::BindGroupLayout]| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&bindings::pipeline_layout(device, "tessellation", groups)),
                module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        TessellationPasses {
            first_levels: pipeline(&levels, "first_levels", &[&level, &turn]),
            count: pipeline(&levels, "count", &[&level]),
            settle: pipeline(&levels, "settle", &[&level, &turn]),
            cut: pipeline(&levels, "cut_level", &[&level]),
            draw: pipeline(&draw, "draw", &[&drawing]),
            level,
            turn,
            drawing,
        }
    }
}

fn layout(device: &wgpu::Device, types: &[wgpu::BindingType]) -> wgpu::BindGroupLayout {
    bindings::group_layout(device, "tessellation", wgpu::ShaderStages::COMPUTE, types)
}
