//! A picture that is larger than what it may take of the device: only those pages of it are there that a view needs.
//!
//! Each level of the picture's pyramid is cut into pages, and a table says where in one texture, the atlas, a page lies, if it does. For a view the pages are
//! found from the coarsest level down: one is needed where its ground is seen, and those below it where a pixel is finer than its texels. Coarser pages
//! come first, and the coarsest is always there; a shader that misses a page takes the next coarser one, so nothing is ever blank. What a view sees depends on
//! it and on what was brought, never on what was looked at before.
//!
//! After C. Tanner, C. Migdal, M. Jones, "The clipmap: a virtual mipmap", SIGGRAPH 1998; S. Barrett, "Sparse virtual textures", 2008.

use super::encoded;
use crate::device::Gpu;
use glam::{DVec2, UVec2};
use littoral::lod::ScreenMetric;
use littoral::picture::{Drape, Texture};
use littoral::space::{Datum, View};
use std::collections::HashMap;

/// Texels of a page along a side, one at each border doubling the page beyond.
const PAGE: u32 = 256;
const INNER: u32 = PAGE - 2;
/// Instead of a place in the atlas.
const ABSENT: u32 = u32::MAX;
/// Words of the table before and for each level: see coat.wgsl.
const HEAD: usize = 4;
const LEVEL: usize = 4;

/// One level of the picture's pyramid.
#[derive(Clone, Copy, Debug)]
struct Level {
    size: UVec2,
    /// Its pages, columns and rows, and the first of them in the table.
    pages: UVec2,
    first: usize,
}

/// The pages of a picture.
#[derive(Debug)]
pub(crate) struct Pages {
    pub(super) atlas: wgpu::Texture,
    pub(super) table: wgpu::Buffer,
    levels: Vec<Level>,
    words: Vec<u32>,
    /// Of each place in the atlas the page there, by its place in the table, and when it was needed last.
    places: Vec<Option<(usize, u64)>>,
    held: HashMap<usize, u32>,
    clock: u64,
}

/// A page that a view needs.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Needed {
    level: usize,
    at: UVec2,
}

impl Pages {
    /// Room for pages of so many bytes, at least for the coarsest ones.
    pub fn new(gpu: &Gpu, texture: &Texture, bytes: u64) -> Pages {
        let mut first = HEAD;
        let sizes: Vec<UVec2> = texture.levels().map(|(size, _)| size).collect();
        first += LEVEL * sizes.len();
        let levels: Vec<Level> = sizes
            .into_iter()
            .map(|size| {
                let pages = (size + (INNER - 1)) / INNER;
                let level = Level { size, pages, first };
                first += (pages.x * pages.y) as usize;
                level
            })
            .collect();
        let most = gpu.device.limits().max_texture_dimension_2d / PAGE;
        let room = bytes / u64::from(4 * PAGE * PAGE);
        let across = (room.isqrt() as u32).clamp(2, most.max(2));
        let atlas = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("pages"),
            size: wgpu::Extent3d { width: across * PAGE, height: across * PAGE, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let mut words = vec![ABSENT; first];
        words[..HEAD].copy_from_slice(&[levels.len() as u32, across, 0, 0]);
        for (level, words) in levels.iter().zip(words[HEAD..].chunks_mut(LEVEL)) {
            words.copy_from_slice(&[level.size.x, level.size.y, level.pages.x, level.first as u32]);
        }
        let table = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("page table"),
            size: 4 * words.len() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.queue.write_buffer(&table, 0, bytemuck::cast_slice(&words));
        let places = vec![None; (across * across) as usize];
        Pages { atlas, table, levels, words, places, held: HashMap::new(), clock: 0 }
    }

    /// Brings the pages that a view needs of a picture over land between two heights (m), no more than `most` that are not there yet. Whether all
    /// are, and whether anything has changed.
    pub fn bring(
        &mut self,
        gpu: &Gpu,
        drape: &Drape,
        land: (Datum, [f32; 2]),
        view: &View,
        most: usize,
    ) -> (bool, bool) {
        let needed = self.needed(drape, land, view);
        self.clock += 1;
        for page in &needed {
            if let Some(&place) = self.held.get(&self.index(*page)) {
                self.places[place as usize] = Some((self.index(*page), self.clock));
            }
        }
        let levels: Vec<(UVec2, &[[f32; 3]])> = drape.texture.levels().collect();
        let (mut brought, mut missing) = (0, false);
        let mut texels = Vec::new();
        for page in &needed {
            let index = self.index(*page);
            if self.held.contains_key(&index) {
                continue;
            }
            if brought == most {
                missing = true;
                break;
            }
            // The place that was needed longest ago, and not now.
            let free = (0u32..).zip(&self.places).min_by_key(|(_, held)| held.map_or(0, |(_, when)| when));
            let Some((place, held)) = free.filter(|(_, held)| held.is_none_or(|(_, when)| when < self.clock)) else {
                missing = true;
                break;
            };
            if let Some((old, _)) = held {
                self.held.remove(old);
            }
            cut(levels[page.level], page.at, &mut texels);
            self.write(gpu, place, &texels);
            self.places[place as usize] = Some((index, self.clock));
            self.held.insert(index, place);
            brought += 1;
        }
        let changed = self.tell(gpu, &needed);
        (!missing, changed)
    }

    fn index(&self, page: Needed) -> usize {
        let level = self.levels[page.level];
        level.first + (page.at.y * level.pages.x + page.at.x) as usize
    }

    fn write(&self, gpu: &Gpu, place: u32, texels: &[[u8; 4]]) {
        let across = self.words[1];
        let origin = wgpu::Origin3d { x: place % across * PAGE, y: place / across * PAGE, z: 0 };
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo { origin, ..self.atlas.as_image_copy() },
            texels.as_flattened(),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * PAGE), rows_per_image: Some(PAGE) },
            wgpu::Extent3d { width: PAGE, height: PAGE, depth_or_array_layers: 1 },
        );
    }

    /// Brings the table: of pages that are needed, and the coarsest. Whether it has changed.
    fn tell(&mut self, gpu: &Gpu, needed: &[Needed]) -> bool {
        let first = HEAD + LEVEL * self.levels.len();
        let mut words = self.words.clone();
        words[first..].fill(ABSENT);
        for page in needed {
            let index = self.index(*page);
            if let Some(&place) = self.held.get(&index) {
                words[index] = place;
            }
        }
        let changed = words != self.words;
        if changed {
            gpu.queue.write_buffer(&self.table, 0, bytemuck::cast_slice(&words));
            self.words = words;
        }
        changed
    }

    /// The pages that a view needs, coarse ones first, as many as there are places for.
    fn needed(&self, drape: &Drape, (datum, [low, high]): (Datum, [f32; 2]), view: &View) -> Vec<Needed> {
        let local_from_uv = drape.uv_from_local.inverse();
        let metric = ScreenMetric::new(&View { tolerance_pixels: 1.0, ..*view }, datum).ok();
        let land = match datum {
            Datum::Plane { origin, size } => [origin, origin + size],
            Datum::Ellipsoid { .. } => [DVec2::NEG_INFINITY, DVec2::INFINITY],
        };
        // Texels of the finest level to a metre, as the shader counts them.
        let size = drape.texture.size().as_dvec2();
        let columns = drape.uv_from_local.matrix2;
        let per_metre = ((columns.x_axis * size).length() * (columns.y_axis * size).length()).sqrt();
        // The finest level that is seen of a page: `None` if it is not.
        let finest = |page: Needed| {
            let level = self.levels[page.level];
            let corner = |i: u32, j: u32| {
                let texel = ((page.at + UVec2::new(i, j)) * INNER).min(level.size);
                local_from_uv.transform_point2(texel.as_dvec2() / level.size.as_dvec2())
            };
            let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
            let least = corners.into_iter().fold(DVec2::INFINITY, DVec2::min).max(land[0]);
            let most = corners.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max).min(land[1]);
            if least.cmpgt(most).any() {
                return None;
            }
            let (least, most) = (least.extend(low.into()), most.extend(high.into()));
            if !metric.as_ref().is_none_or(|metric| metric.sees(&metric.from_eye(least, most))) {
                return None;
            }
            let near = view.eye.clamp(least, most).distance(view.eye);
            // As `footprint_of` of frame.wgsl, where the ground faces the eye.
            let footprint = (near * 0.65 / f64::from(view.pixels_per_radian)).max(1e-4);
            Some((footprint * per_metre).max(1.0).log2())
        };
        let coarsest = self.levels.len() - 1;
        let mut needed = vec![Needed { level: coarsest, at: UVec2::ZERO }];
        let mut begin = 0;
        for level in (0..coarsest).rev() {
            // Those on this level below any of the level above whose texels are too coarse somewhere.
            let mut below: Vec<(u64, Needed)> = Vec::new();
            let end = needed.len();
            for &page in &needed[begin..end] {
                if finest(page).is_none_or(|finest| finest >= f64::from(page.level as u32)) {
                    continue;
                }
                let (above, here) = (self.levels[page.level], self.levels[level]);
                let scale = here.size.as_dvec2() / above.size.as_dvec2() / f64::from(INNER);
                let first = ((page.at * INNER).as_dvec2() * scale).floor().as_uvec2();
                let last = (((page.at + 1) * INNER).as_dvec2() * scale).ceil().as_uvec2().min(here.pages);
                for at in (first.y..last.y).flat_map(|y| (first.x..last.x).map(move |x| UVec2::new(x, y))) {
                    let page = Needed { level, at };
                    if let Some(finest) = finest(page) {
                        below.push((finest.to_bits(), page));
                    }
                }
            }
            below.sort_by_key(|(finest, page)| (*finest, page.at.y, page.at.x));
            below.dedup_by_key(|(_, page)| page.at);
            begin = end;
            needed.extend(below.into_iter().map(|(_, page)| page).take(self.places.len().saturating_sub(end)));
            if begin == needed.len() {
                break;
            }
        }
        needed
    }
}

/// The texels of a page, sRGB, with one at each border that is the next page's, or the picture's last.
fn cut((size, texels): (UVec2, &[[f32; 3]]), at: UVec2, page: &mut Vec<[u8; 4]>) {
    page.clear();
    let first = at * INNER;
    for j in 0..PAGE {
        let y = (first.y + j).saturating_sub(1).min(size.y - 1);
        let row = &texels[y as usize * size.x as usize..][..size.x as usize];
        page.extend((0..PAGE).map(|i| encoded(row[(first.x + i).saturating_sub(1).min(size.x - 1) as usize])));
    }
}
