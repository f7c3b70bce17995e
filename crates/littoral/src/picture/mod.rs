//! Pictures without a GPU: the reference that every other renderer is held against.
//!
//! Three nouns, three costs. A [`Scene`] says what is to be seen and costs nothing. A [`Stage`] is a scene made ready:
//! atmosphere tables, light from the sky at every place, the fringe round missing ground; it is built once and serves
//! any number of views. A [`Picture`] is what one [`View`] sees: linear radiance, and the distance, normal, position and
//! height of whatever is seen, which [`Picture::display`] turns into something for a screen.
//!
//! Every sample is a ray against the exact surface: no mesh, no texture of the ground, no detail level to pop. Light
//! follows one atmosphere model from the sun to the eye, so that sun, sky and haze agree at every hour of the day.
//!
//! Where nothing is known — outside the raster where it does not end in water, and at void samples — the picture shows
//! *mist*: a flat neutral tone without relief that cannot be mistaken for ground. Ground dissolves into it over a few
//! samples; no cliff, plain or interpolated hill is ever invented. Land seen from outside is a *block* instead, cut clean where
//! the data ends ([`Border`]).
//!
//! The same scene, view and settings give the same bits, however many threads work.

mod atmosphere;
mod block;
mod cartography;
mod compose;
mod display;
mod drawn;
mod ephemeris;
mod grain;
mod ground;
mod horizon;
mod natural;
mod rim;
mod sampler;
mod sea;
mod shade;
mod skylight;
mod spectrum;
mod stage;
mod tables;
mod texture;
mod things;
mod tile;
mod waves;

pub use compose::{Shot, coast_shot, compose, overhead, suiting_border};
pub use display::{Display, Exposure, Medium, Picture};
pub use drawn::{Meshes, mesh_errors};
pub use ephemeris::NoSun;
pub use sea::Streaks;
pub use stage::Stage;
pub use tables::{Coat, Lattice, SkyTable, Slab, Tables};
pub use texture::{Drape, Texture};
pub use things::Placed;

use crate::field::{Lakes, Land, Sea, Water};
use crate::objects::Standing;
use crate::space::View;
use glam::DVec3;

/// What is to be seen, and in which light.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The ground.
    pub land: &'a Land,
    /// Where water lies over it, if any does.
    pub water: Option<&'a Water>,
    /// The lakes inland, which lie at levels of their own.
    pub lakes: Option<&'a Lakes>,
    /// The waves on that water, of which the level is the same; without them there is a light air over still water.
    pub sea: Option<&'a Sea>,
    /// What stands on the land and floats on the water.
    pub objects: &'a [Standing],
    /// The sun.
    pub sun: Sun,
    /// The air between things and the eye.
    pub air: Air,
    /// How the ground is coloured.
    pub style: Style,
    /// What is shown where the land ends.
    pub border: Border,
    /// The picture laid over the ground; used by [`Style::Image`], which without one is [`Style::Natural`].
    pub drape: Option<&'a Drape>,
    /// What grows and lies where, for [`Style::Natural`].
    pub climate: Climate,
    /// Direction of north: the angle from the land's y axis clockwise to true north (rad). Only the sun's place and the
    /// climate's shady sides depend on it.
    pub north: f64,
}

impl<'a> Scene<'a> {
    /// A scene of `land` and `water` in the afternoon light of a clear day, in natural colours.
    pub fn new(land: &'a Land, water: Option<&'a Water>) -> Scene<'a> {
        Scene {
            land,
            water,
            lakes: None,
            sea: None,
            objects: &[],
            sun: Sun::new(240f64.to_radians(), 25f64.to_radians()),
            air: Air::default(),
            style: Style::Natural,
            border: Border::Mist,
            drape: None,
            climate: Climate::default(),
            north: 0.0,
        }
    }

    /// The scene in the style, light, air and border that suit `shot`.
    pub fn for_shot(land: &'a Land, water: Option<&'a Water>, shot: &Shot) -> Scene<'a> {
        let Shot { sun, air, style, border, .. } = *shot;
        Scene { sun, air, style, border, ..Scene::new(land, water) }
    }
}

/// The sun in the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Bearing, clockwise from north (rad).
    pub azimuth: f64,
    /// Elevation of its centre over the horizon (rad); below −0.3 it is night and the picture is dark.
    pub elevation: f64,
    /// Half the angle it covers (rad).
    pub angular_radius: f64,
}

impl Sun {
    /// The sun as seen from Earth: a disc of 0.53°.
    pub fn new(azimuth: f64, elevation: f64) -> Sun {
        Sun { azimuth, elevation, angular_radius: 0.2665f64.to_radians() }
    }

    /// Unit vector towards its centre in the land's axes, `north` being the angle of true north from y (rad, clockwise).
    pub fn direction(&self, north: f64) -> DVec3 {
        let (s, c) = (self.azimuth + north).sin_cos();
        let (up, flat) = self.elevation.sin_cos();
        DVec3::new(s * flat, c * flat, up)
    }
}

/// The air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Meteorological visibility at sea level (m): the distance at which a black thing's contrast falls to 2 %. 200 km is
    /// the clearest air there is, 40 km a clear day, 10 km haze. Sky and sunlight follow it too.
    pub visibility: f64,
    /// Whether distance veils things. Maps and whole continents are better seen without.
    pub veils_distance: bool,
}

impl Default for Air {
    fn default() -> Air {
        Air { visibility: 40_000.0, veils_distance: true }
    }
}

/// What grows and lies where: heights above sea level (m) at which one kind of ground gives way to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Climate {
    /// Above this forest thins out.
    pub tree_line: f32,
    /// Above this snow stays on level ground.
    pub snow_line: f32,
}

impl Climate {
    /// The usual lines in summer at a latitude (rad): trees to 3 900 m and snow from 5 000 m in the tropics, both sinking to sea
    /// level at the poles (after Körner, *Alpine Plant Life*, 2003, figure 2.1, rounded).
    pub fn at_latitude(latitude: f64) -> Climate {
        let degrees = latitude.abs().to_degrees().min(90.0) as f32;
        let beyond = |from: f32, to: f32| ((degrees - from) / (to - from)).clamp(0.0, 1.0);
        Climate { tree_line: 3900.0 * (1.0 - beyond(25.0, 71.0)), snow_line: 5100.0 * (1.0 - beyond(22.0, 82.0)) }
    }
}

impl Default for Climate {
    fn default() -> Climate {
        Climate::at_latitude(46f64.to_radians())
    }
}

/// How the ground is coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Style {
    /// Rock, scree, grass, woods, sand and snow, by slope, height and noise, with relief down to the pixel.
    #[default]
    Natural,
    /// Colours by height, breaking at the water line, times the light on the relief.
    Tint,
    /// A cartographer's shaded relief.
    Relief,
    /// A picture laid over the ground.
    Image,
}

/// What is shown where the land ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Border {
    /// Land dissolves into mist, water goes on to the horizon: for eyes within it.
    #[default]
    Mist,
    /// Land and water are cut clean, a block on a level floor: for eyes outside it.
    Cut,
}

/// How a picture is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Rays through each pixel, at least 1. Where the first few agree the others are spared.
    pub samples: u32,
    /// Which random pattern; pictures of the same seed are the same to the bit.
    pub seed: u32,
    /// Whether depth, normal, position and height of what is seen are wanted, too. It costs a ray more for each pixel.
    pub passes: bool,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { samples: 12, seed: 0, passes: true }
    }
}

/// What `view` sees of `scene`. Films build the [`Stage`] once and call [`Stage::render`] for each view.
///
/// `progress` is told the fraction done, now and then, from any thread.
pub fn render(scene: &Scene, view: &View, settings: &Settings, progress: &(dyn Fn(f32) + Sync)) -> Picture {
    Stage::new(scene).render(view, settings, progress)
}
