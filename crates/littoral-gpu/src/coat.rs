//! What the ground is seen as, on the device: nothing but nature, tints by height, a picture laid over it, or a shaded relief.

mod pages;

use crate::Gpu;
use glam::{DAffine2, DVec2, UVec2, Vec3};
use littoral::picture::{Coat, Texture};
use pages::Pages;
use wgpu::{TextureDimension, TextureFormat};

/// A coat.
#[derive(Debug)]
pub(crate) struct GpuCoat {
    /// 0 for nature, 1 for tints, 2 for a picture, 3 for a shaded relief.
    pub kind: f32,
    /// Heights (m) of the lowest ground, of the land's foot and of the highest ground; by how much slopes are steepened.
    pub tint: [f32; 4],
    /// Albedo of lakes.
    pub lake: Vec3,
    /// From the land's coordinates (m) to the picture's.
    pub uv_from_local: DAffine2,
    /// Of a picture that is too large to be there as a whole.
    pub pages: Option<Pages>,
}

/// Bytes that a picture may take of the device.
pub(crate) const PICTURE_BYTES: u64 = 256 << 20;

impl GpuCoat {
    /// Brings a coat to the device, with its texture and its table of pages: colours of tints, land in the first row and bed in the second; or the picture, with its means. A picture of more than so many
    /// bytes, or larger than the device's textures, comes by pages: [`Pages::bring`] is then due for each view.
    pub fn new(gpu: &Gpu, coat: &Coat, picture_bytes: u64) -> (GpuCoat, wgpu::Texture, wgpu::Buffer) {
        let plain = GpuCoat {
            kind: 0.0,
            tint: [0.0, 0.0, 1.0, 1.0],
            lake: Vec3::ZERO,
            uv_from_local: DAffine2::IDENTITY,
            pages: None,
        };
        let no_pages = || {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("no pages"),
                size: 32,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let make = |format, size: [u32; 2], bytes: &[u8]| {
            crate::scenery::texture(gpu, "coat", format, [size[0], size[1], 1], TextureDimension::D2, bytes)
        };
        let nothing = || make(TextureFormat::Rgba8Unorm, [1, 1], &[0; 4]);
        match coat {
            Coat::Natural => (plain, nothing(), no_pages()),
            Coat::Tint { land, bed, lake, heights: [low, foot, high], steepening } => {
                let colours = land.iter().chain(bed).map(|&colour| (colour, 0.0));
                let halves = crate::scenery::halves(colours);
                let texture = make(TextureFormat::Rgba16Float, [land.len() as u32, 2], bytemuck::cast_slice(&halves));
                let tint = [*low, *foot, *high, *steepening];
                (GpuCoat { kind: 1.0, tint, lake: *lake, ..plain }, texture, no_pages())
            }
            Coat::Relief { lake, heights: [low, foot, high], steepening } => {
                let tint = [*low, *foot, *high, *steepening];
                (GpuCoat { kind: 3.0, tint, lake: *lake, ..plain }, nothing(), no_pages())
            }
            Coat::Image(drape) => {
                let image = GpuCoat { kind: 2.0, uv_from_local: drape.uv_from_local, ..plain };
                let size = drape.texture.size();
                let bytes = 4 * u64::from(size.x) * u64::from(size.y) * 4 / 3;
                if bytes <= picture_bytes && size.max_element() <= gpu.device.limits().max_texture_dimension_2d {
                    return (image, picture(gpu, &drape.texture), no_pages());
                }
                let pages = Pages::new(gpu, &drape.texture, picture_bytes);
                let (atlas, table) = (pages.atlas.clone(), pages.table.clone());
                (GpuCoat { pages: Some(pages), ..image }, atlas, table)
            }
        }
    }

    /// Whether it makes a map, on which water is a colour.
    pub fn is_map(&self) -> bool {
        self.kind == 1.0 || self.kind == 3.0
    }

    /// From the eye (m) to the picture: both columns of a matrix, and where the eye is.
    pub fn uv_from_eye(&self, eye: DVec2) -> ([f32; 4], DVec2) {
        let m = self.uv_from_local.matrix2;
        let columns = [m.x_axis.x, m.x_axis.y, m.y_axis.x, m.y_axis.y];
        (columns.map(|v| v as f32), self.uv_from_local.transform_point2(eye))
    }
}

/// A picture with its means.
fn picture(gpu: &Gpu, texture: &Texture) -> wgpu::Texture {
    let levels: Vec<(UVec2, &[[f32; 3]])> = texture.levels().collect();
    let size = texture.size();
    let made = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("drape"),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (number, (size, texels)) in levels.into_iter().enumerate() {
        let encoded: Vec<[u8; 4]> = texels.iter().map(|t| encoded(*t)).collect();
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo { mip_level: number as u32, ..made.as_image_copy() },
            encoded.as_flattened(),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * size.x), rows_per_image: Some(size.y) },
            wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        );
    }
    made
}

/// Linear light in 8 bits of sRGB (IEC 61966-2-1).
fn encoded([red, green, blue]: [f32; 3]) -> [u8; 4] {
    let one = |v: f32| {
        let v = v.clamp(0.0, 1.0);
        let shown = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (shown * 255.0 + 0.5) as u8
    };
    [one(red), one(green), one(blue), 255]
}
