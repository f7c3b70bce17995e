//! What a shader needs to know of the tiles to find a place in them.

use crate::bindings;
use glam::DVec2;
use littoral::waves::cascades::{Breakers, Cascades, Tile};

/// Most levels of detail that a tile can have, and one more.
const LEVELS: usize = 8;

/// A tile as `sea_sample.wgsl` knows it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SampleTile {
    corner: [f32; 2],
    turn: [f32; 2],
    length: f32,
    fineness: f32,
    levels: u32,
    foam: i32,
    raised: f32,
    torn: f32,
    pub samples: u32,
    unused: u32,
    slopes: [[f32; 4]; LEVELS],
}

/// Tiles with `samples` along their sides, the origin in their corners. A sea of none has one without waves.
pub fn tiles(sea: &Cascades, breakers: &Breakers, samples: u32) -> Vec<SampleTile> {
    let over = |variance: f64| if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
    let (mut before, mut after) = (0.0, None);
    let mut layer = 0;
    let mut tiles: Vec<SampleTile> = sea
        .spectra()
        .enumerate()
        .map(|(index, spectrum)| {
            let tile = spectrum.tile();
            let mut of = SampleTile {
                turn: [tile.turn.cos() as f32, tile.turn.sin() as f32],
                length: tile.length as f32,
                fineness: (tile.highest / std::f64::consts::PI) as f32,
                levels: spectrum.levels() as u32,
                foam: -1,
                raised: over(before) as f32,
                samples,
                ..SampleTile::default()
            };
            for (level, slopes) in of.slopes.iter_mut().enumerate() {
                let [xx, xy, yy] = spectrum.slopes(level);
                *slopes = [xx as f32, xy as f32, yy as f32, 0.0];
            }
            before += spectrum.variance();
            if let Some(after) = &mut after {
                let [xx, _, yy] = spectrum.slopes(0);
                *after += xx + yy;
            }
            if breakers.makes_foam(index) {
                of.foam = layer;
                layer += 1;
                after.get_or_insert(0.0);
            }
            of
        })
        .collect();
    if tiles.is_empty() {
        tiles.push(SampleTile { length: 1.0, foam: -1, samples, ..SampleTile::default() });
    }
    tiles.iter_mut().for_each(|tile| tile.torn = over(after.unwrap_or(0.0)) as f32);
    tiles
}

/// Places the origin (m) in the tiles.
pub fn place(origin: DVec2, tiles: &[Tile], into: &mut [SampleTile]) {
    for (tile, to) in tiles.iter().zip(into) {
        let own = DVec2::from_angle(-tile.turn).rotate(origin) / tile.length;
        to.corner = (own - own.floor()).as_vec2().to_array();
    }
}

/// What `sea_sample.wgsl` is bound to.
pub fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let texels = bindings::texels(wgpu::TextureViewDimension::D2Array);
    let stages = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
    bindings::group_layout(device, "sea", stages, &[bindings::storage(true), texels, texels])
}
