//! A stage in numbers: what renderers elsewhere need to light the same scene alike.

use super::Style;
use super::atmosphere::{AZIMUTHS, DISTANCES, ELEVATIONS, Sky};
use super::block::{MIST, PAPER};
use super::cartography::SHEET;
use super::display::Medium;
use super::horizon::horizon;
use super::stage::{HIGHEST_EYE, Stage};
use super::texture::Drape;
use crate::field::Lakes;
use glam::{DVec2, Vec2, Vec3};
use std::borrow::Cow;

/// Values at the points of a lattice, row by row from the south-western one.
#[derive(Clone, Debug, Default)]
pub struct Lattice<T> {
    /// Points a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Where the first point lies (m).
    pub origin: DVec2,
    /// From a point to the next (m).
    pub spacing: DVec2,
    /// One for each point.
    pub values: Vec<T>,
}

/// The block that land is cut to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab {
    /// South-western corner (m).
    pub low: DVec2,
    /// North-eastern corner (m).
    pub high: DVec2,
    /// Height of the floor it stands on (m).
    pub floor: f64,
    /// From there to the lowest ground (m).
    pub thickness: f64,
}

/// What the ground is seen as.
#[derive(Clone, Debug)]
pub enum Coat<'a> {
    /// Grass, rock, sand and snow, as nature might have it.
    Natural,
    /// Tints by height, as on a map.
    Tint {
        /// Albedo of land: at (i / (n − 1))^(4/3) of the way from its foot to the highest ground.
        land: Vec<Vec3>,
        /// Albedo of ground below the water: at (i / (n − 1))^(5/3) of the way from its level to the lowest ground.
        bed: Vec<Vec3>,
        /// Albedo of lakes.
        lake: Vec3,
        /// Heights (m) of the lowest ground, of the foot of the land and of the highest ground.
        heights: [f32; 3],
        /// By how much slopes are steepened for the light on them.
        steepening: f32,
    },
    /// A cartographer's shaded relief: reflectance, whatever the light. Sheet and mist are [`Tables::mist`].
    Relief {
        /// Reflectance of lakes.
        lake: Vec3,
        /// Heights (m) of the lowest ground, of the foot of the land and of the highest ground.
        heights: [f32; 3],
        /// By how much slopes are steepened for the shades.
        steepening: f32,
    },
    /// A picture laid over it; grey beyond that.
    Image(&'a Drape),
}

/// What of a scene does not depend on the eye. Light is linear Rec. 709.
#[derive(Clone, Debug)]
pub struct Tables<'a> {
    /// What the ground is seen as.
    pub coat: Coat<'a>,
    /// What kind of picture it makes.
    pub medium: Medium,
    /// Reflectance of the floor below a block.
    pub floor: f32,
    /// Heights (m) for shading: those of the ground, and coarser and coarser means of them, each level's points lying on every other one of the level before.
    pub heights: Vec<Lattice<f32>>,
    /// How far each point of the finest level is known, 255 for wholly; empty where all are.
    pub known: Vec<u8>,
    /// Height of trees and houses at each point of the finest level (m); empty where there are none.
    pub standing: Vec<f32>,
    /// Tangent of the elevation of the horizon towards the sun, at each point of the finest level.
    pub horizon: Vec<f32>,
    /// Where ground below the level of the water (m) is wet: at points whose value is [`Tables::BASIN`]. Ground above it may be wetted by waves where the value is that or
    /// [`Tables::BEACH`].
    pub water: Option<(f64, Lattice<u8>)>,
    /// At the same points as the water, the lake there: see [`Lakes::samples`](crate::field::Lakes::samples); empty where there are no lakes.
    pub lakes: Lattice<u8>,
    /// Levels (m) of those lakes that were filled over a known bed.
    pub lake_levels: Vec<f32>,
    /// Whether that water goes on to the horizon.
    pub endless: bool,
    /// Beyond the land, depth (m) and share of water: for places along the border, counter-clockwise from its south-western corner (columns, evenly), and
    /// distances from it (rows, [`Tables::distance_from_border`]).
    pub rim: Lattice<Vec2>,
    /// The land's rectangle (m): beyond it, water bends with the Earth.
    pub land: (DVec2, DVec2),
    /// Light from all sides: nine spherical harmonics of radiance (kcd/m²).
    pub skylight: Lattice<[Vec3; 9]>,
    /// The same over an open plain.
    pub open: [Vec3; 9],
    /// Sunlight on a facing surface (klx) at heights of `AIR` · (i / (n − 1))².
    pub sunlight: Vec<Vec3>,
    /// For paths through water of `WATER` · (i / (n − 1))² metres: radiance of the water per irradiance below its surface, and share left of light from the bed.
    pub depths: Vec<(Vec3, Vec3)>,
    /// Unit vector towards the sun.
    pub sun: Vec3,
    /// Half the angle that it covers (rad).
    pub sun_radius: f32,
    /// Radiance of its disc above the air (kcd/m²).
    pub disc: Vec3,
    /// Radiance of mist (kcd/m²), or reflectance of a map's sheet, and the height of the level it lies at beyond the land (m).
    pub mist: (Vec3, f64),
    /// Whether distance veils things.
    pub veils_distance: bool,
    /// What is shown as white (kcd/m²): see [`Picture::white`](super::Picture::white).
    pub white: [f32; 3],
    /// The block that the land is cut to, if it is.
    pub block: Option<Slab>,
    /// Which points of the finest level were cut away from it; empty for none.
    pub cut_away: Vec<bool>,
    /// Heights (m) of tree and snow line.
    pub lines: [f32; 2],
    /// The sky's light as the land sees it.
    pub land_sky: Vec<[Vec3; 3]>,
}

/// The sky and the veil of distance from one height: see [`Tables::SKY`].
#[derive(Clone, Debug)]
pub struct SkyTable {
    /// For each azimuth from the sun, elevation and distance: Rayleigh, Mie and higher orders' light (kcd/m²), without phase functions.
    pub light: Vec<[Vec3; 3]>,
    /// For each elevation and distance: the share let through.
    pub through: Vec<Vec3>,
}

impl Tables<'_> {
    /// Height at which the air ends (m).
    pub const AIR: f32 = 100_000.0;
    /// The longest path in water (m).
    pub const WATER: f32 = 160.0;
    /// Azimuths, elevations and distances of a [`SkyTable`]: azimuths from 0 to π evenly; elevations of w·|w|·π/2 for w from −1 to 1; distances of
    /// 150 m · ((1 300 000 / 150 + 1)^(i / n) − 1).
    pub const SKY: [usize; 3] = [AZIMUTHS, ELEVATIONS, DISTANCES + 1];

    /// Points in the basin of the water.
    pub const BASIN: u8 = 255;
    /// Points that would be if it stood as high as swash is followed.
    pub const BEACH: u8 = 128;

    /// Distance from the border (m) that a row of `rim` stands for, where the land's longer side is so long (m).
    pub fn distance_from_border(row: usize, side: f64) -> f64 {
        side * 1e-4 * ((row as f64 * 0.35).exp() - 1.0)
    }
}

/// Columns and rows of the table of the border.
const RIM: [usize; 2] = [1024, 40];

impl Stage<'_> {
    /// The stage in numbers.
    pub fn tables(&self) -> Tables<'_> {
        let scene = &self.scene;
        let is_paper = scene.style == Style::Relief;
        let coat = match (scene.style, scene.drape) {
            (Style::Relief, _) => self.tints.relief(),
            (Style::Tint, _) => self.tints.coat(),
            (Style::Image, Some(drape)) => Coat::Image(drape),
            (Style::Natural | Style::Image, _) => Coat::Natural,
        };
        let raster = self.ground.land.raster();
        let (origin, spacing) = (self.ground.land.origin(), raster.spacing());
        let heights: Vec<Lattice<f32>> = (0..=self.ground.levels())
            .map(|level| {
                let (values, columns, rows) = self.ground.heights(level);
                let spacing = spacing * (1u64 << level) as f64;
                Lattice { columns, rows, origin, spacing, values: values.to_vec() }
            })
            .collect();
        let toward = self.sun.truncate().normalize_or(Vec2::X);
        let horizon = horizon(&self.with_lakes(&heights[0]), heights[0].columns, heights[0].rows, spacing, toward);
        let land = (scene.land.origin(), scene.land.origin() + scene.land.extent());
        let side = scene.land.extent().max_element();
        let rim = self.rim.as_ref().map_or(Lattice::default(), |rim| {
            let values = (0..RIM[0] * RIM[1]).map(|i| {
                let along = (i % RIM[0]) as f64 / RIM[0] as f64;
                rim.at(along, Tables::distance_from_border(i / RIM[0], side))
            });
            Lattice {
                columns: RIM[0],
                rows: RIM[1],
                origin: DVec2::ZERO,
                spacing: DVec2::ZERO,
                values: values.collect(),
            }
        });
        let on_land = |values: &[u8]| {
            let raster = scene.land.raster();
            let (columns, rows, spacing) = (raster.columns(), raster.rows(), raster.spacing());
            Lattice { columns, rows, origin: land.0, spacing, values: values.to_vec() }
        };
        Tables {
            coat,
            medium: self.medium(),
            floor: if self.is_map() { PAPER } else { MIST },
            horizon,
            known: self.ground.known_samples().to_vec(),
            standing: self.ground.standing_samples().to_vec(),
            water: scene.water.map(|water| {
                let higher = self.beach().map_or(&[][..], |beach| beach.basin());
                let point = |(i, &low): (usize, &u8)| match (low, higher.get(i)) {
                    (0, None | Some(0)) => 0,
                    (0, _) => Tables::BEACH,
                    _ => Tables::BASIN,
                };
                (water.level, on_land(&water.basin().iter().enumerate().map(point).collect::<Vec<u8>>()))
            }),
            lakes: scene.lakes.map_or(Lattice::default(), |lakes| on_land(lakes.samples())),
            lake_levels: scene.lakes.map_or(Vec::new(), |l| l.filled().iter().map(|lake| lake.level as f32).collect()),
            endless: scene.water.is_some_and(|water| water.reaches_horizon()),
            rim,
            land,
            skylight: self.skylight.lattice(),
            open: self.skylight.open,
            sunlight: self.air.sunlight_table().to_vec(),
            depths: self.depths.table().to_vec(),
            sun: self.sun,
            sun_radius: scene.sun.angular_radius as f32,
            disc: self.sky.disc_radiance(),
            mist: (if is_paper { SHEET } else { self.mist }, self.ground.mist),
            white: self.white(),
            block: self.ground.block.map(|block| block.slab()),
            cut_away: self.ground.cut_away_samples().to_vec(),
            veils_distance: scene.air.veils_distance && !is_paper,
            lines: [scene.climate.tree_line, scene.climate.snow_line],
            land_sky: self.sky_table(f64::from(self.middle)).light,
            heights,
        }
    }

    /// Heights (m) at the points of the finest level, those of lakes in place of their beds: the sun reaches the surface.
    fn with_lakes<'b>(&self, finest: &'b Lattice<f32>) -> Cow<'b, [f32]> {
        let Some(lakes) = self.scene.lakes.filter(|lakes| !lakes.filled().is_empty()) else {
            return Cow::Borrowed(&finest.values);
        };
        let land = self.scene.land;
        // The ground of a picture may be wider than the land, by whole samples.
        let margin = ((land.origin() - finest.origin) / finest.spacing).round();
        let first = margin.y as usize * finest.columns + margin.x as usize;
        let columns = land.raster().columns();
        let mut heights = finest.values.clone();
        for (row, samples) in lakes.samples().chunks_exact(columns).enumerate() {
            let heights = &mut heights[first + row * finest.columns..][..columns];
            for (height, number) in heights.iter_mut().zip(samples) {
                if let Some(number) = number.checked_sub(Lakes::FARTHEST + 1) {
                    *height = lakes.filled()[usize::from(number)].level as f32;
                }
            }
        }
        Cow::Owned(heights)
    }

    /// The sky from a height (m).
    pub fn sky_table(&self, height: f64) -> SkyTable {
        let sky = Sky::new(&self.air, &self.scene.sun, self.sun, height.clamp(2.0, HIGHEST_EYE) as f32);
        let (light, through) = sky.into_tables();
        SkyTable { light, through }
    }
}
