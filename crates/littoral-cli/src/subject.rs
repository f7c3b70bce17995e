//! What pictures show and numbers tell of: land, its water, and the waves on it, the same for every command.

use crate::ground::{Frame, Opened, Reading, System, height_at};
use crate::input::WaterLevel;
use crate::talk::{Failure, Talk, progress, tidy};
use glam::{DVec2, DVec3};
use littoral::field::{Lakes, Land, Sea, Water, coast};
use littoral::picture::Drape;
use littoral::waves::{SeaState, ShoreError};
use std::path::{Path, PathBuf};

/// Land and all that belongs to it.
pub struct Subject {
    /// What it is called.
    pub name: String,
    /// The ground, heights stretched.
    pub land: Land,
    /// The water.
    pub water: Option<Water>,
    /// The lakes.
    pub lakes: Option<Lakes>,
    /// How coordinates and local metres belong together.
    pub frame: Frame,
    /// What heights are counted from, in words.
    pub datum: String,
    /// By how much heights are stretched.
    pub exaggeration: f64,
}

/// At most so many samples are taken without `--full`.
const FITTING: usize = 16 << 20;

impl Subject {
    /// The land of some files, or of none the built-in coast, at a resolution that fits a picture unless it is to be the `full` one.
    pub fn open(
        files: &[PathBuf],
        reading: Reading,
        full: bool,
        exaggeration: f64,
        water: WaterLevel,
        talk: &mut Talk,
    ) -> Result<Subject, Failure> {
        let (name, land, frame, datum) = match files {
            [] => {
                ("the built-in coast".to_owned(), coast::coast(), Frame::metres(), "heights above its sea level".into())
            }
            files => {
                let mut opened = Opened::open_all(files, reading, talk)?;
                let (land, frame) = opened.fitting(if full { usize::MAX } else { FITTING }, talk)?;
                (littoral_data::name_of_all(files).display().to_string(), land, frame, opened.datum())
            }
        };
        let land = match exaggeration {
            1.0 => land,
            factor => {
                let origin = land.origin();
                Land::at(land.raster().clone().exaggerated(factor as f32), origin)
            }
        };
        let (water, lakes) = match water {
            WaterLevel::None => (None, None),
            WaterLevel::At(level) => {
                let sea = Water::flood(&land, level * exaggeration);
                let lakes = Lakes::find(&land, sea.as_ref());
                (sea, lakes)
            }
        };
        Ok(Subject { name, land, water, lakes, frame, datum, exaggeration })
    }

    /// The sea of a state on its water at an instant (s): what is drawn is what is asked. `None` where there is no water.
    pub fn sea(&self, state: &SeaState, seconds: f64) -> Result<Option<Sea>, Failure> {
        let Some(water) = &self.water else { return Ok(None) };
        // Bearings count from true north, headings from the land's x axis.
        let state = state.clone().turned(-self.frame.north());
        let bar = progress(1000, "carrying the waves over the bed");
        let told = |done: f64| {
            bar.set_position((done * 1000.0) as u64);
            true
        };
        let made = Sea::over(&self.land, water, &state, &told);
        bar.finish_and_clear();
        let failure = |error: ShoreError| Failure::Work(format!("{}: {error}", self.name));
        let mut sea = made.map_err(failure)?;
        sea.set_time(seconds);
        Ok(Some(sea))
    }

    /// A picture to lay over the ground.
    pub fn drape(&self, file: &Path, talk: &mut Talk) -> Result<Drape, Failure> {
        let (drape, warnings) = self.frame.drape(file, &self.land)?;
        warnings.into_iter().for_each(|warning| talk.warn(format!("{}: {warning}", file.display())));
        Ok(drape)
    }

    /// Local metres of typed coordinates.
    pub fn local(&self, system: System, at: DVec2) -> Result<DVec2, Failure> {
        self.frame.local(system, at).map_err(|e| Failure::Work(format!("{}: {e}", self.name)))
    }

    /// Height (m, stretched) of ground or still water below a local position.
    pub fn surface(&self, local: DVec2) -> Option<f64> {
        let ground = height_at(&self.land, local).map(f64::from);
        let water = self.water.as_ref().filter(|water| water.covers(local)).map(|water| water.level);
        let water = water.or_else(|| self.lakes.as_ref()?.at(&self.land, local).map(|lake| lake.level));
        match (ground, water) {
            (Some(ground), Some(water)) => Some(ground.max(water)),
            (ground, water) => ground.or(water),
        }
    }

    /// A local position in the file's coordinates, its height as unstretched.
    pub fn given(&self, local: DVec3) -> DVec3 {
        self.frame.crs(local.truncate()).extend(local.z / self.exaggeration)
    }

    /// `X,Y,Z` as it can be typed.
    pub fn shown(&self, given: DVec3) -> String {
        format!("{},{},{}", self.frame.shown(given.x), self.frame.shown(given.y), tidy(given.z, 1))
    }
}
