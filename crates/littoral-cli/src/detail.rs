//! Pictures and films of meshes: which method of detail, how fine, and what it drew.

use crate::input;
use crate::render::Render;
use crate::subject::Subject;
use crate::talk::{Failure, Talk, progress, tidy};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::DVec3;
use littoral::field::{HeightField, Land, Sea};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Method, NestedBounds, Reached, RoamFlight, RoamSea, ViewError};
use littoral::picture::{Meshes, Picture, Settings, Stage};
use littoral::space::{Datum, View};
use littoral_gpu::{Gpu, Painter, PainterError};
use std::time::Instant;

/// How a mesh is chosen.
#[derive(clap::Args, Clone, Debug)]
pub struct Detail {
    /// Draw a mesh that this method of detail chooses, instead of the exact surface; the same light falls on it
    #[arg(long, value_parser = methods(), value_name = "METHOD", help_heading = "Mesh")]
    pub lod: Option<Method>,
    /// How far from its place the mesh may be drawn, in pixels
    #[arg(long, value_name = "PIXELS", value_parser = input::tolerance, default_value = "1", requires = "lod", help_heading = "Mesh")]
    pub tolerance: f64,
    /// The most triangles of the ground, and as many of the sea; where they do not do, the tolerance gives way
    #[arg(long, value_name = "N", default_value = "2000000", value_parser = clap::value_parser!(u32).range(1..=50_000_000), requires = "lod", help_heading = "Mesh")]
    pub triangles: u32,
    /// Draw the mesh's edges, too
    #[arg(long, requires = "lod", conflicts_with = "gpu", help_heading = "Mesh")]
    pub wireframe: bool,
    /// Draw on the graphics card (or what stands for one): the exact surface by rays, or the mesh of --lod
    #[arg(long, conflicts_with = "passes", help_heading = "Mesh")]
    pub gpu: bool,
    /// Choose the mesh for an eye at this place that looks at the same point, and look at it from --eye, or all along --path
    #[arg(long, value_name = "X,Y,Z", value_parser = input::xyz, requires = "lod", help_heading = "Mesh")]
    pub lod_from: Option<DVec3>,
}

/// The methods of detail by name, each with what it does.
fn methods() -> impl TypedValueParser<Value = Method> {
    let named = |method: Method| PossibleValue::new(method.name()).help(method.description());
    PossibleValuesParser::new(Method::ALL.map(named)).try_map(|name| name.parse::<Method>())
}

/// A method at work: picture after picture, it keeps what it can.
pub struct Chooser<'a> {
    detail: &'a Detail,
    land: &'a Land,
    limits: Limits,
    ground: Box<dyn Lod>,
    /// Land prepared for ROAM.
    prepared: Option<&'a NestedBounds>,
    /// ROAM over prepared land, which goes on from picture to picture.
    flight: Option<RoamFlight<'a>>,
    ground_drawing: Drawing,
    water: Option<Box<dyn Lod>>,
    /// ROAM over the sea, which goes on where that over land does.
    water_flight: Option<RoamSea>,
    water_drawing: Drawing,
    shows_water: bool,
}

/// What pictures are drawn by: rays or a mesh, on the processor or the graphics card.
pub struct Drawer<'a> {
    /// What chooses the mesh, if one is to be drawn.
    pub chooser: Option<Chooser<'a>>,
    /// The graphics card, if it is to draw.
    pub painter: Option<Painter>,
}

impl Drawer<'_> {
    /// Chooses the meshes for a view, if such are drawn.
    pub fn choose(&mut self, sea: Option<&Sea>, view: &View) -> Result<Option<Told>, Failure> {
        let Some(chooser) = &mut self.chooser else { return Ok(None) };
        match &mut self.painter {
            Some(painter) => chooser.choose_on(painter, view),
            None => chooser.choose(sea, view),
        }
        .map(Some)
    }

    /// The picture, of what was chosen last if meshes are drawn.
    pub fn picture(
        &mut self,
        stage: &Stage,
        sea: Option<&Sea>,
        view: &View,
        settings: &Settings,
        told: &(dyn Fn(f32) + Sync),
    ) -> Result<Picture, Failure> {
        if let Some(painter) = &mut self.painter {
            if let Some(sea) = sea {
                painter.follow_waves(sea);
            }
            painter.set_objects(&stage.placed(sea)).map_err(unpainted)?;
            let told = |done| told(done);
            let painted = match &self.chooser {
                Some(_) => painter.picture_of_made(stage, view, settings.samples, &told),
                None => painter.picture(stage, None, view, settings.samples, &told),
            };
            return painted.map_err(unpainted);
        }
        Ok(match &self.chooser {
            Some(chooser) => stage.render_meshes(&chooser.meshes(), sea, view, settings, told),
            None => stage.render_sea(sea, view, settings, told),
        })
    }
}

/// What is told about a mesh.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Told {
    /// Triangles of ground and sea; of a film, the most in a frame.
    pub triangles: usize,
    /// No point that is seen is farther from its place than this (pixels).
    pub bound_pixels: f32,
    /// Whether the number of triangles, not the tolerance, ended the refinement.
    pub limited: bool,
    /// How long the choice took, without picture.
    pub select_seconds: f64,
}

impl Detail {
    /// Whether it is the exact surface that is drawn, on the processor.
    pub fn is_default(&self) -> bool {
        self.lod.is_none() && !self.gpu
    }

    /// What lets ROAM go on from picture to picture over a land, if that is what is wanted and the land is not too large.
    pub fn prepare(&self, land: &Land) -> Option<NestedBounds> {
        if self.lod != Some(Method::Roam) {
            return None;
        }
        let bar = progress(1, "preparing");
        let bounds = NestedBounds::of(land).ok();
        bar.finish_and_clear();
        bounds
    }

    /// The method that is wanted, if any, over a land that may have been prepared.
    pub fn chooser<'a>(&'a self, land: &'a Land, prepared: Option<&'a NestedBounds>) -> Option<Chooser<'a>> {
        let limits = Limits { finest: land.finest_level(), triangles: self.triangles as usize };
        Some(Chooser {
            detail: self,
            land,
            limits,
            ground: self.lod?.within(limits),
            prepared,
            flight: prepared.filter(|_| !self.gpu).map(|bounds| RoamFlight::over(bounds, limits)),
            ground_drawing: Drawing::default(),
            water: None,
            water_flight: None,
            water_drawing: Drawing::default(),
            shows_water: false,
        })
    }

    /// The graphics card made ready for a stage, if it is to draw.
    pub fn painter(&self, stage: &Stage, sea: Option<&Sea>, talk: &mut Talk) -> Result<Option<Painter>, Failure> {
        if !self.gpu {
            return Ok(None);
        }
        let gpu = Gpu::headless().map_err(|e| unpainted(e.into()))?;
        if gpu.is_software() {
            talk.note(format!("no graphics card: {} stands for one", gpu.adapter.name));
        }
        let mut painter = Painter::new(gpu, stage).map_err(unpainted)?;
        painter.set_waves(sea).map_err(unpainted)?;
        Ok(Some(painter))
    }

    /// The view that the mesh is chosen for: the picture's, or another eye's on the same point.
    pub fn view(
        &self,
        render: &Render,
        subject: &Subject,
        view: &View,
        look: DVec3,
        talk: &mut Talk,
    ) -> Result<View, Failure> {
        let Some(from) = self.lod_from else { return Ok(*view) };
        let eye = render.eye_position(subject, from, talk)?;
        let field = 2.0 * (0.5 * view.size.y as f32 / view.pixels_per_radian).atan();
        Ok(View::looking_at(eye, look, field, view.size))
    }
}

impl Chooser<'_> {
    /// Chooses the meshes for a view.
    pub fn choose(&mut self, sea: Option<&Sea>, view: &View) -> Result<Told, Failure> {
        let view = View { tolerance_pixels: self.detail.tolerance as f32, ..*view };
        let started = Instant::now();
        let mut told = match &mut self.flight {
            Some(flight) => {
                let reached = flight.update(&view, &mut || false).map_err(refused)?;
                Told::of(reached, flight.mesh().triangles.len(), started)
            }
            None => choose(&mut *self.ground, self.land, &view, &mut self.ground_drawing)?,
        };
        self.shows_water = sea.is_some();
        if let Some(sea) = sea {
            // No cell of water is smaller than this (m).
            const SMALLEST: f64 = 0.25;
            let Datum::Plane { size, .. } = sea.datum() else {
                return Err(Failure::Work("expected a sea on a plane, got one on an ellipsoid".into()));
            };
            let finest = (size.max_element() / SMALLEST).log2().ceil().clamp(0.0, 30.0) as u8;
            let limits = Limits { finest, triangles: self.detail.triangles as usize };
            let water = if self.flight.is_some() {
                let started = Instant::now();
                // No height is late: a frame is the same, whichever were drawn before it.
                let flight = self.water_flight.get_or_insert_with(|| RoamSea::new(limits).with_lateness(0.0));
                let reached = flight.update(sea, &view, &mut || false).map_err(refused)?;
                Told::of(reached, flight.mesh().triangles.len(), started)
            } else {
                let method = self.detail.lod.unwrap_or(Method::Whole);
                let water = self.water.get_or_insert_with(|| method.within(limits));
                choose(&mut **water, sea, &view, &mut self.water_drawing)?
            };
            told.triangles += water.triangles;
            told.join(water);
        }
        Ok(told)
    }

    /// Chooses the ground for a view on the graphics card, if that knows the method; else it makes triangles of what the processor chose. It has
    /// triangles of its own for the sea.
    fn choose_on(&mut self, painter: &mut Painter, view: &View) -> Result<Told, Failure> {
        let view = View { tolerance_pixels: self.detail.tolerance as f32, ..*view };
        let started = Instant::now();
        let chosen = match (self.detail.lod, self.prepared) {
            (Some(Method::Roam), Some(bounds)) => painter.bisect(bounds, self.limits, &view),
            (Some(Method::Patches), _) => painter.tessellate(self.land, self.limits, &view),
            _ => {
                let reached = self.ground.select(self.land, &view, &mut self.ground_drawing).map_err(refused)?;
                let triangles = painter.expand(self.land, &mut self.ground_drawing).map_err(unpainted)?;
                return Ok(Told::of(reached, triangles, started));
            }
        }
        .map_err(unpainted)?;
        Ok(Told::of(chosen.reached, chosen.triangles as usize, started))
    }

    /// The mesh of the ground that was chosen last.
    fn ground(&self) -> &Mesh {
        self.flight.as_ref().map_or(&self.ground_drawing.mesh, RoamFlight::mesh)
    }

    /// That of the sea.
    fn water(&self) -> &Mesh {
        self.water_flight.as_ref().map_or(&self.water_drawing.mesh, RoamSea::mesh)
    }

    /// What was chosen last.
    fn meshes(&self) -> Meshes<'_> {
        Meshes {
            ground: Some(self.ground()),
            water: self.shows_water.then(|| self.water()),
            wireframe: self.detail.wireframe,
        }
    }
}

fn unpainted(error: PainterError) -> Failure {
    Failure::Work(format!("--gpu: {error}"))
}

fn refused(error: ViewError) -> Failure {
    Failure::Work(format!("--lod: {error}"))
}

/// Draws what a method chooses of a field.
fn choose(lod: &mut dyn Lod, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Told, Failure> {
    let started = Instant::now();
    let reached = lod.select(field, view, drawing).map_err(refused)?;
    let mut told = Told::of(reached, 0, started);
    drawing.expand(field);
    told.triangles = drawing.mesh.triangles.len();
    Ok(told)
}

impl Told {
    fn of(reached: Reached, triangles: usize, started: Instant) -> Told {
        Told {
            triangles,
            bound_pixels: reached.pixels,
            limited: reached.limited,
            select_seconds: started.elapsed().as_secs_f64(),
        }
    }

    /// Also tells about another mesh, or another picture: the most triangles of any, the largest bound, all the time.
    pub fn join(&mut self, other: Told) {
        self.triangles = self.triangles.max(other.triangles);
        self.bound_pixels = self.bound_pixels.max(other.bound_pixels);
        self.limited |= other.limited;
        self.select_seconds += other.select_seconds;
    }

    /// For people.
    pub fn line(&self) -> String {
        let limited = if self.limited { ", the most allowed" } else { "" };
        format!("; {} triangles{limited}, within {} pixels", self.triangles, tidy(f64::from(self.bound_pixels), 2))
    }
}
