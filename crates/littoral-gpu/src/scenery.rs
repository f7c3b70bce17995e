//! A scene made ready for the GPU: the engine's tables as textures.

use crate::bindings;
use crate::coat::{GpuCoat, PICTURE_BYTES};
use crate::device::Gpu;
use crate::frame::LEVELS;
use crate::objects::{Objects, TooManyObjects};
use crate::waves::Waves;
use glam::{DVec2, UVec2, Vec3};
use half::f16;
use littoral::field::{HeightField, Sea};
use littoral::picture::{Lattice, Medium, Placed, SkyTable, Slab, Stage, Tables};
use littoral::space::View;
use wgpu::util::{DeviceExt, TextureDataOrder};
use wgpu::{TextureDimension, TextureFormat};

/// What is seen, and in which light: made once, good for any number of views. It has no ground until a mesh of it is drawn.
#[derive(Debug)]
pub struct Scenery {
    /// All that [`layout`] names; what changes with the eye's height is also here to be written.
    pub(crate) group: wgpu::BindGroup,
    eye_light: wgpu::Texture,
    eye_through: wgpu::Texture,
    /// Instead of that of waves where there are none.
    still: wgpu::BindGroup,
    pub(crate) coat: GpuCoat,
    pub(crate) medium: Medium,
    pub(crate) waves: Option<Waves>,
    pub(crate) objects: Objects,
    /// Of the lattice that meshes' vertices are on (m), and metres a step.
    pub(crate) origin: DVec2,
    pub(crate) step: DVec2,
    pub(crate) map_origin: DVec2,
    pub(crate) map_spacing: DVec2,
    pub(crate) map_size: UVec2,
    pub(crate) mean_spacing: f32,
    pub(crate) levels: Vec<[u32; 4]>,
    pub(crate) has_standing: bool,
    pub(crate) all_known: bool,
    pub(crate) sun: Vec3,
    pub(crate) sun_radius: f32,
    pub(crate) disc: Vec3,
    pub(crate) veils_distance: bool,
    pub(crate) floor: f32,
    pub(crate) level: Option<f64>,
    pub(crate) endless: bool,
    pub(crate) basin_origin: DVec2,
    pub(crate) basin_spacing: DVec2,
    pub(crate) basin_size: UVec2,
    pub(crate) has_lakes: bool,
    pub(crate) lake_levels: Vec<f32>,
    pub(crate) land: (DVec2, DVec2),
    pub(crate) skylight_origin: DVec2,
    pub(crate) skylight_spacing: DVec2,
    pub(crate) mist: (Vec3, f64),
    pub(crate) lines: [f32; 2],
    pub(crate) block: Option<Slab>,
    pub(crate) is_cut_away: bool,
    /// What light is multiplied by so that white is shown white.
    pub(crate) balance: Vec3,
    pub(crate) open: [Vec3; 9],
    /// Height of the eye (m) that the sky is that of.
    sky_height: f64,
}

/// A raster that is larger than the device's textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected at most {most} × {most} samples, which is what this graphics adapter's textures hold, got {columns} × {rows}; draw fewer samples (without --full), or on the processor"
)]
pub struct TooLarge {
    /// Samples a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Most texels along a side.
    pub most: u32,
}

/// What tables of light are multiplied by, so that half floats do for dusk.
const GAIN: f32 = 64.0;

impl Scenery {
    /// Brings a stage's tables to the device, with the sky from a height of the eye (m). `datum` is that of the land whose meshes will be drawn, a plane: its
    /// south-western corner and its size (m).
    ///
    /// # Errors
    /// If the raster is larger than textures can be.
    pub fn new(gpu: &Gpu, tables: &Tables, datum: (DVec2, DVec2), sky: (f64, &SkyTable)) -> Result<Scenery, TooLarge> {
        Scenery::with_picture_bytes(gpu, tables, datum, sky, PICTURE_BYTES)
    }

    /// The same where a picture that is laid over the land may take so many bytes of the device (usually 256 MiB); of a larger one there are only the pages of
    /// [`Scenery::bring_picture`].
    ///
    /// # Errors
    /// As [`Scenery::new`].
    pub fn with_picture_bytes(
        gpu: &Gpu,
        tables: &Tables,
        datum: (DVec2, DVec2),
        sky: (f64, &SkyTable),
        picture_bytes: u64,
    ) -> Result<Scenery, TooLarge> {
        let finest = &tables.heights[0];
        let most = gpu.device.limits().max_texture_dimension_2d;
        let (columns, rows) = (finest.columns, finest.rows);
        if columns.max(rows) > most as usize {
            return Err(TooLarge { columns, rows, most });
        }
        let make = |label, format, size: [u32; 3], bytes: &[u8]| {
            texture(gpu, label, format, size, TextureDimension::D2, bytes)
        };
        let map = [columns as u32, rows as u32, 1];
        let floats =
            |label, values: &[f32], size| make(label, TextureFormat::R32Float, size, bytemuck::cast_slice(values));
        let (size, atlas, levels) = atlas(&tables.heights[1..]);
        let known = match tables.known.is_empty() && tables.cut_away.is_empty() {
            true => make("known", TextureFormat::Rg8Unorm, [1, 1, 1], &[255, 0]),
            false => {
                let of = |i: usize| {
                    let cut = tables.cut_away.get(i).is_some_and(|cut| *cut);
                    [tables.known.get(i).copied().unwrap_or(255), 255 * u8::from(cut)]
                };
                let both: Vec<u8> = (0..columns * rows).flat_map(of).collect();
                make("known", TextureFormat::Rg8Unorm, map, &both)
            }
        };
        let nowhere = Lattice { columns: 1, rows: 1, origin: DVec2::ZERO, spacing: DVec2::ONE, values: vec![0] };
        let has_lakes = !tables.lakes.values.is_empty();
        let lakes = if has_lakes { &tables.lakes } else { &nowhere };
        let basin = tables.water.as_ref().map_or(lakes, |water| &water.1);
        let wet: Vec<u8> = (0..basin.values.len())
            .flat_map(|i| {
                [if tables.water.is_some() { basin.values[i] } else { 0 }, if has_lakes { lakes.values[i] } else { 0 }]
            })
            .collect();
        let basin_size = UVec2::new(basin.columns as u32, basin.rows as u32);
        let rim: Vec<f32> = match tables.rim.values.is_empty() {
            true => vec![0.0, 0.0, 0.0, 0.0],
            false => tables.rim.values.iter().flat_map(|v| v.to_array()).collect(),
        };
        let rim_size = [tables.rim.columns.max(1) as u32, tables.rim.rows.max(2) as u32, 1];
        let half_of = |v: f32| f16::from_f32(v.min(f32::from(f16::MAX))).to_bits();
        let horizon: Vec<[u16; 2]> = (0..columns * rows)
            .map(|i| [tables.horizon[i], tables.standing.get(i).copied().unwrap_or(0.0)].map(half_of))
            .collect();
        let points = tables.skylight.values.len();
        let layers = (0..9).flat_map(|k| (0..points).map(move |i| (tables.skylight.values[i][k] * GAIN, 0.0)));
        let skylight = halves(layers);
        let width = tables.depths.len().max(tables.sunlight.len());
        let row = |values: Vec<Vec3>| (0..width).map(move |i| (values.get(i).copied().unwrap_or_default(), 0.0));
        let (own, left) = (tables.depths.iter().map(|d| d.0).collect(), tables.depths.iter().map(|d| d.1).collect());
        let media = row(own).chain(row(left)).chain(row(tables.sunlight.clone()));
        let [azimuths, elevations, distances] = Tables::SKY.map(|n| n as u32);
        let volume = |label| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: distances, height: elevations, depth_or_array_layers: 3 * azimuths },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D3,
                format: TextureFormat::Rgba16Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        let half = TextureFormat::Rgba16Float;
        let (eye_light, land_light) = (volume("sky of the eye"), volume("sky of the land"));
        let nothing = vec![0; (distances * elevations * 8) as usize];
        let eye_through = make("air before the eye", half, [distances, elevations, 1], &nothing);
        let points = [tables.skylight.columns as u32, tables.skylight.rows as u32, 9];
        let (coat, coat_map, pages) = GpuCoat::new(gpu, &tables.coat, picture_bytes);
        let textures = [
            &floats("heights", &finest.values, map),
            &floats("coarse heights", &atlas, [size.x, size.y, 1]),
            &known,
            &coat_map,
            &make("horizon", TextureFormat::Rg16Float, map, bytemuck::cast_slice(&horizon)),
            &eye_light,
            &eye_through,
            &land_light,
            &make("skylight", half, points, bytemuck::cast_slice(&skylight)),
            &make("media", half, [width as u32, 3, 1], bytemuck::cast_slice(&halves(media))),
            &make("basin", TextureFormat::Rg8Unorm, [basin_size.x, basin_size.y, 1], &wet),
            &make("rim", TextureFormat::Rg32Float, rim_size, bytemuck::cast_slice(&rim)),
        ];
        write_light(gpu, &land_light, &tables.land_sky);
        let mut scenery = Scenery {
            group: group(&gpu.device, textures, &pages),
            eye_light,
            eye_through,
            still: crate::waves::run_up(gpu, [1, 1], &[0.0]),
            coat,
            medium: tables.medium,
            waves: None,
            objects: Objects::default(),
            origin: datum.0,
            step: datum.1 / (1u64 << 30) as f64,
            map_origin: finest.origin,
            map_spacing: finest.spacing,
            map_size: UVec2::new(map[0], map[1]),
            mean_spacing: (finest.spacing.x * finest.spacing.y).sqrt() as f32,
            levels,
            has_standing: !tables.standing.is_empty(),
            all_known: tables.known.is_empty(),
            sun: tables.sun,
            sun_radius: tables.sun_radius,
            disc: tables.disc,
            veils_distance: tables.veils_distance,
            floor: tables.floor,
            level: tables.water.as_ref().map(|water| water.0),
            endless: tables.endless,
            basin_origin: basin.origin,
            basin_spacing: basin.spacing,
            basin_size,
            has_lakes,
            lake_levels: tables.lake_levels.clone(),
            land: tables.land,
            skylight_origin: tables.skylight.origin,
            skylight_spacing: tables.skylight.spacing,
            mist: tables.mist,
            lines: tables.lines,
            block: tables.block,
            is_cut_away: !tables.cut_away.is_empty(),
            balance: {
                let white = Vec3::from(tables.white).max(Vec3::splat(1e-9));
                white.dot(Vec3::new(0.2126, 0.7152, 0.0722)) / white
            },
            open: tables.open,
            sky_height: f64::NAN,
        };
        scenery.set_sky(gpu, sky.0, sky.1);
        Ok(scenery)
    }

    /// Whether the sky is that of an eye at another height (m), so much that it would be seen: then [`Scenery::set_sky`] is due.
    pub fn wants_sky(&self, height: f64) -> bool {
        let change = (height - self.sky_height).abs();
        change.is_nan() || change > 5.0 + 0.02 * self.sky_height.abs()
    }

    /// The sky and the air as an eye at a height (m) sees them.
    pub fn set_sky(&mut self, gpu: &Gpu, height: f64, sky: &SkyTable) {
        write_light(gpu, &self.eye_light, &sky.light);
        let through = halves(sky.through.iter().map(|&through| (through, 0.0)));
        write(gpu, &self.eye_through, bytemuck::cast_slice(&through));
        self.sky_height = height;
    }

    /// Brings what a view needs of the picture that is laid over the land, that of the stage, if it is too large to be there as a whole: no more than `most` pages of 256 × 256 texels
    /// that are not there yet, the coarsest first. What is not there is seen in coarser ones. Whether all is there, and whether anything has changed.
    pub fn bring_picture(&mut self, gpu: &Gpu, stage: &Stage, view: &View, most: usize) -> (bool, bool) {
        let range = stage.land().height_range();
        match (&mut self.coat.pages, stage.drape()) {
            (Some(pages), Some(drape)) => {
                pages.bring(gpu, drape, (stage.land().datum(), [range.low, range.high]), view, most)
            }
            _ => (true, false),
        }
    }

    /// Whether there is water that waves can be drawn on: on maps it is a colour.
    pub fn shows_waves(&self) -> bool {
        self.level.is_some() && !self.coat.is_map()
    }

    /// Draws waves on the water from here on, or still water.
    pub fn set_waves(&mut self, waves: Option<Waves>) {
        self.waves = waves.filter(|_| self.shows_waves());
    }

    /// Goes on to the instant at which the sea stands now that the waves of [`Scenery::set_waves`] were made of.
    pub fn follow_waves(&mut self, gpu: &Gpu, sea: &Sea) {
        if let Some(waves) = &mut self.waves {
            waves.follow(gpu, sea);
        }
    }

    /// Draws these objects from here on, in place of those before: [`Stage::placed`].
    ///
    /// # Errors
    /// If they do not fit into the device's buffers; then nothing changes.
    pub fn set_objects(&mut self, gpu: &Gpu, placed: &[Placed]) -> Result<(), TooManyObjects> {
        self.objects.set(gpu, placed)
    }

    /// How high swash reaches: what the pass that shades is bound to.
    pub(crate) fn run_up(&self) -> &wgpu::BindGroup {
        self.waves.as_ref().map_or(&self.still, |waves| &waves.run_up.0)
    }
}

/// The layout of a scenery's group: its textures, in the order in which [`Scenery::new`] names them, a sampler that reads between texels, and the pages of a picture.
pub(crate) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    use wgpu::TextureViewDimension::{D2, D2Array, D3};
    let (texels, smooth) = (bindings::texels(D2), bindings::smooth(D2));
    let types = [
        texels,
        texels,
        texels,
        smooth,
        texels,
        bindings::smooth(D3),
        smooth,
        bindings::smooth(D3),
        bindings::smooth(D2Array),
        smooth,
        texels,
        texels,
        wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        bindings::storage(true),
    ];
    bindings::group_layout(device, "scenery", wgpu::ShaderStages::FRAGMENT, &types)
}

fn group(device: &wgpu::Device, textures: [&wgpu::Texture; 12], pages: &wgpu::Buffer) -> wgpu::BindGroup {
    let views = textures.map(|texture| texture.create_view(&Default::default()));
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("smooth"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    });
    let views = views.iter().map(wgpu::BindingResource::TextureView);
    let others = [wgpu::BindingResource::Sampler(&sampler), pages.as_entire_binding()];
    bindings::group(device, "scenery", &layout(device), views.chain(others))
}

/// Light of the sky: azimuths are slices, one after the other for each kind of scattering.
fn write_light(gpu: &Gpu, texture: &wgpu::Texture, light: &[[Vec3; 3]]) {
    let kinds = (0..3).flat_map(|kind| light.iter().map(move |light| (light[kind] * GAIN, 0.0)));
    write(gpu, texture, bytemuck::cast_slice(&halves(kinds)));
}

/// Colours as half floats, with a fourth number.
pub(crate) fn halves(colours: impl Iterator<Item = (Vec3, f32)>) -> Vec<u16> {
    let most = f32::from(f16::MAX);
    let half = |v: f32| f16::from_f32(v.min(most)).to_bits();
    colours.flat_map(|(c, w)| [c.x, c.y, c.z, w].map(half)).collect()
}

/// Writes all of a texture of half floats.
fn write(gpu: &Gpu, texture: &wgpu::Texture, bytes: &[u8]) {
    let size = texture.size();
    gpu.queue.write_texture(
        texture.as_image_copy(),
        bytes,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(8 * size.width),
            rows_per_image: Some(size.height),
        },
        size,
    );
}

/// A texture with its contents.
pub(crate) fn texture(
    gpu: &Gpu,
    label: &str,
    format: TextureFormat,
    [width, height, depth]: [u32; 3],
    dimension: TextureDimension,
    bytes: &[u8],
) -> wgpu::Texture {
    gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
            mip_level_count: 1,
            sample_count: 1,
            dimension,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        },
        TextureDataOrder::LayerMajor,
        bytes,
    )
}

/// All coarser levels in one picture: the first to the left, the others in a column beside it. Its size, its texels, and where each level is.
fn atlas(levels: &[Lattice<f32>]) -> (UVec2, Vec<f32>, Vec<[u32; 4]>) {
    let levels = &levels[..levels.len().min(LEVELS)];
    let Some(first) = levels.first() else { return (UVec2::ONE, vec![0.0], Vec::new()) };
    let beside: usize = levels[1..].iter().map(|level| level.rows).sum();
    let width = first.columns + levels.get(1).map_or(0, |level| level.columns);
    let height = first.rows.max(beside);
    let mut texels = vec![0.0; width * height];
    let mut places = Vec::new();
    let mut next = [0, 0];
    for level in levels {
        let [left, low] = next;
        for (row, values) in level.values.chunks_exact(level.columns).enumerate() {
            texels[(low + row) * width + left..][..level.columns].copy_from_slice(values);
        }
        places.push([left, low, level.columns, level.rows].map(|n| n as u32));
        next = if left == 0 { [first.columns, 0] } else { [left, low + level.rows] };
    }
    (UVec2::new(width as u32, height as u32), texels, places)
}
