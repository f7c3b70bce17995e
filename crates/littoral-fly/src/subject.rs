//! The land that is flown over, its water, and how its coordinates are told to people.

use glam::{DAffine2, DVec2, DVec3};
use littoral::field::{LakeError, Lakes, Land, Water, coast};
use littoral::flight::FlightPath;
use littoral::objects::{Footing, Standing};
use littoral::picture::Drape;
use littoral::space::{Ray, View};
use littoral_data::path::{Coordinates, SavedPath};
use littoral_data::{Crs, Georeference, LakeOrder, LoadOptions, ObjectOrder, VerticalDatum};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is to be opened.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// Height files that are one land; none for the built-in coast.
    pub files: Vec<PathBuf>,
    /// By how much heights are stretched.
    pub exaggeration: f64,
    /// Lakes to be filled over their beds.
    pub lakes: Vec<LakeOrder>,
    /// What is to stand on it.
    pub objects: Vec<ObjectOrder>,
}

/// Land and all that belongs to it. It does not change: whoever needs it shares it.
#[derive(Debug)]
pub struct Subject {
    /// What it was made of.
    pub order: Order,
    /// What it is called.
    pub name: String,
    /// The ground, heights stretched.
    pub land: Land,
    /// The water.
    pub water: Option<Water>,
    /// The lakes.
    pub lakes: Option<Lakes>,
    /// What stands on them.
    pub objects: Vec<Standing>,
    /// What heights are counted from, in words.
    pub datum: String,
    /// What its readers noticed.
    pub notes: Vec<String>,
    /// Where it lies, if a file says so.
    pub georeference: Option<Georeference>,
    crs_from_local: DAffine2,
}

/// Why what was ordered is no land.
#[derive(Debug)]
pub enum Refusal {
    /// What went wrong.
    Problem(String),
    /// It is a picture of something.
    Picture(PathBuf),
}

/// At most so many samples are taken: a larger file is averaged down.
const FITTING: usize = 16 << 20;

/// The ray of a cursor goes so far (m).
const REACH: f64 = 1e7;

impl Subject {
    /// Opens what is ordered. `told` hears what is being done, and how much of it is done, in [0, 1].
    pub fn open(order: &Order, told: &dyn Fn(&str, f32)) -> Result<Subject, Refusal> {
        match &order.files[..] {
            [file] if littoral_data::is_picture(file) => Err(Refusal::Picture(file.clone())),
            _ => Subject::heights(order, told).map_err(Refusal::Problem),
        }
    }

    fn heights(order: &Order, told: &dyn Fn(&str, f32)) -> Result<Subject, String> {
        let files = &order.files;
        let (name, land, georeference, datum, notes) = if files.is_empty() {
            told("making the built-in coast", 0.0);
            (
                "the built-in coast".to_owned(),
                coast::coast(),
                None,
                "heights above its sea level".to_owned(),
                Vec::new(),
            )
        } else {
            let name = littoral_data::name_of_all(files);
            let mut source = littoral_data::open_all(files, None).map_err(|e| e.to_string())?;
            let options = LoadOptions { most_samples: FITTING };
            let reading = |done: f32| told("reading", done);
            let dem = littoral_data::load_from(&mut *source, &name, options, &reading).map_err(|e| e.to_string())?;
            let datum = match &dem.info.vertical_datum {
                VerticalDatum::Unknown => "heights taken as above sea level (the file does not say)".to_owned(),
                VerticalDatum::Named(name) => format!("heights above {name}"),
            };
            let mut notes = dem.info.warnings;
            notes.extend(dem.georeference.warnings());
            told("building the land", 0.0);
            (shown_name(&name), Land::new(dem.raster), Some(dem.georeference), datum, notes)
        };
        let land = match order.exaggeration {
            1.0 => land,
            factor => {
                let origin = land.origin();
                Land::at(land.raster().clone().exaggerated(factor as f32), origin)
            }
        };
        told("finding the water", 0.5);
        let water = Water::flood(&land, 0.0);
        let lakes = Lakes::find(&land, water.as_ref());
        let crs_from_local = georeference.as_ref().map_or(DAffine2::IDENTITY, Georeference::crs_from_local);
        let mut subject = Subject {
            order: order.clone(),
            name,
            land,
            water,
            lakes,
            objects: Vec::new(),
            datum,
            notes,
            georeference,
            crs_from_local,
        };
        subject.fill_lakes();
        subject.place_objects(told);
        Ok(subject)
    }

    /// Fills the lakes that are ordered. What cannot be filled is left out; a note says why.
    fn fill_lakes(&mut self) {
        let factor = self.order.exaggeration;
        for order in &self.order.lakes {
            let near = self.georeference.as_ref().map_or(order.at, |georeference| georeference.near(order.at));
            let at = self.crs_from_local.inverse().transform_point2(near);
            let lakes = self.lakes.get_or_insert_with(|| Lakes::none(&self.land));
            if let Err(error) = lakes.fill(&self.land, self.water.as_ref(), at, order.level * factor) {
                let place = match error {
                    LakeError::Overflows { outlet, .. } => format!("; its outlet is at {}", self.shown(outlet.at)),
                    _ => String::new(),
                };
                let (x, y, error) = (order.at.x, order.at.y, error.stretched(1.0 / factor));
                self.notes.push(format!("the lake at {x},{y}: {error}{place}"));
            }
        }
    }

    /// Opens the objects that are ordered, each file once. What cannot stand is left out; a note says why.
    fn place_objects(&mut self, told: &dyn Fn(&str, f32)) {
        let local_from_crs = self.crs_from_local.inverse();
        let mut opened = Vec::new();
        for order in self.order.objects.clone() {
            told("opening objects", self.objects.len() as f32 / self.order.objects.len() as f32);
            let file = order.file.display();
            if !opened.iter().any(|(known, _)| *known == order.file) {
                match order.open() {
                    Ok(read) => {
                        self.notes.extend(read.warnings.iter().map(|warning| format!("{file}: {warning}")));
                        opened.push((order.file.clone(), Arc::new(read.object)));
                    }
                    Err(problem) => self.notes.push(problem.to_string()),
                }
            }
            let Some((_, object)) = opened.iter().find(|(known, _)| *known == order.file) else { continue };
            let near = self.georeference.as_ref().map_or(order.at, |georeference| georeference.near(order.at));
            let standing = Standing {
                object: object.clone(),
                place: local_from_crs.transform_point2(near),
                heading: order.heading_degrees.to_radians() + self.north(),
                scale: order.scale,
                footing: Footing::Surface,
            };
            match standing.pose(&self.land, self.water.as_ref(), self.lakes.as_ref(), None) {
                Some(_) => self.objects.push(standing),
                None => self
                    .notes
                    .push(format!("{file}: neither ground nor water at {},{}; move it", order.at.x, order.at.y)),
            }
        }
    }

    /// A picture as it lies over this land, and what was noticed.
    pub fn drape(&self, file: &Path) -> Result<(Drape, Vec<String>), String> {
        let nowhere = Georeference::none(2, 2);
        let place = self.georeference.as_ref().unwrap_or(&nowhere);
        let (drape, noticed) =
            littoral_data::open_drape(file, &self.land, place, self.crs_from_local).map_err(|e| e.to_string())?;
        Ok((drape, noticed.into_iter().map(|words| format!("{}: {words}", shown_name(file))).collect()))
    }

    /// The angle from the land's y axis clockwise to true north (rad).
    pub fn north(&self) -> f64 {
        self.georeference.as_ref().map_or(0.0, |g| -g.true_north())
    }

    /// Longitude and latitude of its middle (degrees), where they can be known.
    pub fn lonlat(&self) -> Option<DVec2> {
        let georeference = self.georeference.as_ref()?;
        georeference.lonlat_from_crs(georeference.middle()).ok()
    }

    /// Height of the ground (m, stretched) at a place, its border included but for rounding.
    pub fn ground(&self, at: DVec2) -> Option<f64> {
        let uv = (at - self.land.origin()) / self.land.extent();
        if !(uv.cmpge(DVec2::splat(-1e-9)).all() && uv.cmple(DVec2::splat(1.0 + 1e-9)).all()) {
            return None;
        }
        self.land.height_at(at).map(f64::from)
    }

    /// Height of still water (m, stretched) where a place is under it, beyond the land as well if the sea goes on.
    pub fn still_water(&self, at: DVec2) -> Option<f64> {
        let sea = self.water.as_ref().filter(|water| water.covers(at)).map(|water| water.level);
        let sea = sea.filter(|level| self.ground(at).is_none_or(|ground| ground < *level));
        sea.or_else(|| self.lakes.as_ref()?.at(&self.land, at).map(|lake| lake.level))
    }

    /// Height of ground or still water (m, stretched), whichever is higher.
    pub fn surface(&self, at: DVec2) -> Option<f64> {
        match (self.ground(at), self.still_water(at)) {
            (Some(ground), Some(water)) => Some(ground.max(water)),
            (ground, water) => ground.or(water),
        }
    }

    /// The place on ground or still water (m) that is seen at a pixel.
    pub fn seen(&self, view: &View, pixel: glam::Vec2) -> Option<DVec3> {
        let direction = view.direction(pixel).as_dvec3();
        let ground = self.land.first_hit(&Ray::new(view.eye, direction)).map(|hit| (hit.distance, hit.position));
        let level = self.water.as_ref().and_then(|water| {
            let distance = (water.level - view.eye.z) / direction.z;
            let at = view.eye + direction * distance;
            (distance > 0.0 && distance < REACH && water.covers(at.truncate())).then_some((distance, at))
        });
        // A lake over a bed is seen where the ray comes down to it.
        let ground = ground.map(|(distance, at)| {
            let lake = self.lakes.as_ref().and_then(|lakes| lakes.at(&self.land, at.truncate()));
            let above = lake.map_or(0.0, |lake| ((lake.level - view.eye.z) / direction.z).clamp(0.0, distance));
            if above > 0.0 { (above, view.eye + direction * above) } else { (distance, at) }
        });
        ground.into_iter().chain(level).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, at)| at)
    }

    /// South-western and north-eastern corner (m).
    pub fn bounds(&self) -> [DVec2; 2] {
        [self.land.origin(), self.land.origin() + self.land.extent()]
    }

    /// Where a place is, for people.
    pub fn shown(&self, at: DVec2) -> String {
        let crs = self.crs_from_local.transform_point2(at);
        match &self.georeference {
            Some(georeference) => {
                let lonlat = georeference.lonlat_from_crs(crs).ok();
                let decimals = if self.decimals() == 7 { 5 } else { 0 };
                let own = format!("{:.decimals$}, {:.decimals$}", crs.x, crs.y);
                match lonlat.filter(|_| decimals == 0) {
                    Some(lonlat) => format!("{own} ({:.5}°, {:.5}°)", lonlat.x, lonlat.y),
                    None => own,
                }
            }
            None => format!("{:.0} m east, {:.0} m north", crs.x, crs.y),
        }
    }

    fn decimals(&self) -> usize {
        let degrees = self.georeference.as_ref().is_some_and(|g| matches!(g.crs, Crs::Geographic { .. }));
        if degrees { 7 } else { 2 }
    }

    /// Saves a path in the file's coordinates, as unstretched.
    pub fn save_path(&self, path: &FlightPath, file: &Path) -> Result<(), String> {
        let path = path.clone().stretched(1.0 / self.order.exaggeration);
        SavedPath::of(&path, |xy| self.crs_from_local.transform_point2(xy), self.decimals())
            .save(file)
            .map_err(|e| e.to_string())
    }

    /// Loads a path for this land.
    pub fn load_path(&self, file: &Path) -> Result<FlightPath, String> {
        let saved = SavedPath::load(file).map_err(|e| e.to_string())?;
        let local_from_crs = self.georeference.as_ref().map_or(DAffine2::IDENTITY, Georeference::local_from_crs);
        let local = |coordinates, xy| match (coordinates, &self.georeference) {
            (Coordinates::Metres, _) | (Coordinates::File, None) => Some(xy),
            (Coordinates::File, Some(georeference)) => Some(local_from_crs.transform_point2(georeference.near(xy))),
            (Coordinates::LonLat, georeference) => {
                let crs = georeference.as_ref()?.crs_from_lonlat(xy).ok()?;
                Some(local_from_crs.transform_point2(crs))
            }
        };
        let path = saved.placed(local).map_err(|point| {
            let (file, name) = (file.display(), &self.name);
            format!(
                "{file}: point {point}: expected coordinates that {name} can place, got others; change \"coordinates\""
            )
        })?;
        Ok(path.stretched(self.order.exaggeration))
    }
}

/// A file's own name, without its folders.
fn shown_name(file: &Path) -> String {
    file.file_name().map_or_else(|| file.display().to_string(), |name| name.to_string_lossy().into_owned())
}
