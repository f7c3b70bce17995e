//! What shaders are bound to, numbered from 0 on. Layouts of the same types are the same: groups and pipelines are made apart, each with its own.

use wgpu::{BindingType, BufferBindingType, TextureSampleType, TextureViewDimension};

/// A buffer of one element, or one where offsets tell of which.
pub fn uniform(has_dynamic_offset: bool) -> BindingType {
    BindingType::Buffer { ty: BufferBindingType::Uniform, has_dynamic_offset, min_binding_size: None }
}

/// A buffer of any number of elements.
pub fn storage(read_only: bool) -> BindingType {
    BindingType::Buffer {
        ty: BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A texture that is read texel by texel.
pub fn texels(view_dimension: TextureViewDimension) -> BindingType {
    texture(TextureSampleType::Float { filterable: false }, view_dimension)
}

/// A texture that is read between its texels, too.
pub fn smooth(view_dimension: TextureViewDimension) -> BindingType {
    texture(TextureSampleType::Float { filterable: true }, view_dimension)
}

/// A texture of depths.
pub fn depths() -> BindingType {
    texture(TextureSampleType::Depth, TextureViewDimension::D2)
}

/// A texture of whole numbers.
pub const fn numbers() -> BindingType {
    texture(TextureSampleType::Uint, TextureViewDimension::D2)
}

const fn texture(sample_type: TextureSampleType, view_dimension: TextureViewDimension) -> BindingType {
    BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

/// The layout of a group of these types.
pub fn group_layout(
    device: &wgpu::Device,
    label: &str,
    visibility: wgpu::ShaderStages,
    types: &[BindingType],
) -> wgpu::BindGroupLayout {
    let entry =
        |(binding, &ty): (u32, &BindingType)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// A group of a layout.
pub fn group<'a>(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    let entries = (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
    let entries: Vec<_> = entries.collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// The layout of a pipeline with these groups.
pub fn pipeline_layout(device: &wgpu::Device, label: &str, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().map(|group| Some(*group)).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}
