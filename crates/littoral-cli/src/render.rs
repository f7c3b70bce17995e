//! `littoral render`: pictures and films.

use crate::detail::{Detail, Drawer, Told};
use crate::film;
use crate::ground::{Frame, Reading, System};
use crate::input::{self, Target, WaterLevel};
use crate::lakes::{self, Lake};
use crate::objects;
use crate::subject::Subject;
use crate::sun::SunChoice;
use crate::talk::{Failure, Talk, progress, seconds, tidy};
use crate::waves::state as sea;
use clap::ValueEnum;
use glam::{DVec3, UVec2};
use littoral::field::{Sea, coast};
use littoral::picture::{self, Border, Climate, Display, Picture, Scene, Settings, Shot, Stage};
use littoral::space::{Ray, View};
use littoral::waves::SeaState;
use littoral_data::write::{self, Layer, PngPixels};
use littoral_data::{LakeOrder, ObjectOrder};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Make a picture, or with --path a film.
///
/// Without FILE the built-in coast is drawn. Without --eye a good view is chosen by itself, and the line that is printed
/// holds it in the file's coordinates, ready to be copied and changed.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral render                                          the built-in coast, into littoral.png
  littoral render dem.tif                                  your land, from a view chosen by itself
  littoral render N45W122.hgt N46W122.hgt                  files that join, as one land
  littoral render dem.tif --sun 240,12 --size 1920x1080 --out evening.png
  littoral render dem.tif --eye 562300,5107000,3200 --look 562300,5115800,1900
  littoral render dem.tif --eye 562300,5109500,2 --look 562300,5115800 --above
  littoral render dem.tif --style image --texture ortho.tif
  littoral render dem.tif --out linear.exr --passes depth,normal
  littoral render dem.tif --sea wind=14,from=300 --sun 300,8
  littoral render dem.tif --sun-at 2026-06-21T18:30Z       in the light of that evening
  littoral render --sea beaufort=8,from=240                the coast in a storm
  littoral render --sea buoy=41010.data_spec               in the waves that a buoy measured
  littoral render dem.tif --lod quadtree --tolerance 2 --wireframe      the mesh that a method of detail draws
  littoral render --object lighthouse@3690,1000            with a lighthouse on the headland
  littoral render dem.tif --object boat.glb@562900,5109300,135    with a boat of your own that heads south-east
  littoral render dem.tif --lake 562590,5116290=1900      a lake or a reservoir: water up to 1900 m over the ground at that place
  littoral render --gpu                                    drawn by the graphics card, the same exact surface
  littoral render dem.tif --path                           a film: once round the land
  littoral render dem.tif --path --save-path round.toml    the path, to be edited, and the film
  littoral render dem.tif --path round.toml --seconds 30 --fps 25 --out flight.mp4
  littoral render dem.tif --path --lod roam --wireframe                 the same as a mesh that follows the eye

A film ending in .mp4 needs ffmpeg and is written when it is complete. A film whose --out is a folder is written frame
by frame: when interrupted, the same command goes on where it stopped.")]
pub struct Render {
    /// Height files of any known format: several that lie beside or over each other, in one coordinate system, are drawn as
    /// one; none for the built-in coast
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// The file to write: .png, .exr (linear light); for films .mp4, .mov, .mkv or a folder for frames
    /// [default: littoral.png, littoral.mp4]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Width and height of the picture in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = input::size, default_value = "1280x720")]
    size: UVec2,

    /// Where the eye is; Z in metres above sea level [default: chosen by itself]
    #[arg(long, value_name = "X,Y,Z", value_parser = input::xyz, help_heading = "View")]
    eye: Option<DVec3>,
    /// Where it looks; without Z at the ground [default: the middle of the land]
    #[arg(long, value_name = "X,Y[,Z]", value_parser = input::target, requires = "eye", help_heading = "View")]
    look: Option<Target>,
    /// Count Z of --eye and --look from the ground below
    #[arg(long, requires = "eye", help_heading = "View")]
    above: bool,
    /// Coordinates are longitude and latitude in degrees
    #[arg(long, help_heading = "View")]
    lonlat: bool,
    /// Angle between the picture's lower and upper edge in degrees [default: 45, or what suits a chosen
    /// view; 36 for films]
    #[arg(long, value_name = "DEGREES", value_parser = input::field_of_view, help_heading = "View")]
    fov: Option<f64>,

    /// How the ground is coloured [default: what suits the land]
    #[arg(long, value_enum, help_heading = "Look")]
    style: Option<StyleName>,
    /// A picture to lay over the ground (.tif, .png, .jpg); where it has no place of its own, over all of it
    #[arg(long, value_name = "IMAGE", help_heading = "Look")]
    texture: Option<PathBuf>,
    #[command(flatten)]
    sun: SunChoice,
    /// Stretch all heights, the eye's too
    #[arg(long, value_name = "FACTOR", value_parser = input::factor, default_value = "1", help_heading = "Look")]
    exaggeration: f64,
    /// Height of still water in metres, or none. It covers low ground that it can reach from the border of the data,
    /// and voids with a rim at that height
    #[arg(long, value_name = "METRES|none", value_parser = input::water, default_value = "0", help_heading = "Look")]
    water: WaterLevel,
    /// A lake over a known bed, or a reservoir: a place in it, as --eye counts, and how high it stands in metres; what is lower and joined to that
    /// place is under water. Fails where it would run out, and says at which level. Can be given many times
    #[arg(long, value_name = "X,Y=LEVEL", help_heading = "Look")]
    lake: Vec<LakeOrder>,
    /// The waves on the sea: wind=15,from=240 (m/s, and where it blows from), hs=2,tp=9 (height and period), beaufort=6, douglas=4 or calm;
    /// buoy=FILE (an NDBC spectrum); more with fetch=KM, swell=HEIGHT@PERIOD/FROM, model=, gamma=, spread=, depth=, breaking=, seed=
    /// [default: calm; the built-in coast: beaufort=4,from=225]
    #[arg(long, value_name = "SPEC", help_heading = "Look")]
    sea: Option<String>,
    /// A thing on the land or, where there is water, afloat: a glTF file (.glb, .gltf; metres, y up), or lighthouse or buoy, which are built
    /// in; where it stands, as --eye counts; by how many degrees it is turned clockwise (0: what is -z in the file points north); and how many
    /// times larger it is. Can be given many times. It casts no shadow yet, and is not mirrored in water
    #[arg(long, value_name = "FILE@X,Y[,HEADING[,SCALE]]", help_heading = "Look")]
    object: Vec<ObjectOrder>,
    /// The instant of the sea in seconds; of a film, that of its first frame
    #[arg(long, value_name = "S", value_parser = input::instant, default_value = "0", help_heading = "Look")]
    time: f64,
    /// How far one sees: 10 in haze, 40 on a clear day, 200 in the clearest air [default: what suits the land]
    #[arg(long, value_name = "KILOMETRES", value_parser = input::positive, help_heading = "Look")]
    visibility: Option<f64>,

    /// Also depth, normal, position, height of what is seen, as floating point: into --out if that is an .exr, else into
    /// an .exr beside it. Distances in metres; positions relative to the eye, X east, Y north, Z up. Infinite, 0 or NaN
    /// where there is neither land nor water
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PASS,…", help_heading = "Quality")]
    passes: Vec<Pass>,
    /// Rays through each pixel: more is smoother and slower
    #[arg(long, value_name = "N", default_value = "10", value_parser = clap::value_parser!(u32).range(1..=4096), help_heading = "Quality")]
    samples: u32,
    /// Which random pattern the rays follow; the same seed gives the same picture to the bit
    #[arg(long, value_name = "N", default_value = "0", help_heading = "Quality")]
    seed: u32,
    /// Use all samples of the file, however many; otherwise files of more than 16 million are drawn coarser
    #[arg(long, help_heading = "Quality")]
    full: bool,

    #[command(flatten)]
    detail: Detail,

    /// A film along a path: a path file, or orbit (also without a value) for once round the land
    #[arg(long, value_name = "FILE|orbit", num_args = 0..=1, default_missing_value = "orbit", help_heading = "Film")]
    path: Option<PathBuf>,
    /// Length of the film in seconds [default: the path's own; orbit: 12]
    #[arg(long, value_name = "S", value_parser = input::positive, requires = "path", help_heading = "Film")]
    seconds: Option<f64>,
    /// Frames a second
    #[arg(long, value_name = "F", default_value = "30", value_parser = fps, help_heading = "Film")]
    fps: f64,
    /// Save the path as text, to be edited
    #[arg(long, value_name = "FILE.toml", requires = "path", help_heading = "Film")]
    save_path: Option<PathBuf>,
}

fn fps(text: &str) -> Result<f64, String> {
    input::within(text, 0.01, 1000.0, "0.01 to 1000 frames a second")
}

/// How the ground is coloured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum StyleName {
    /// Rock, scree, grass, woods, sand and snow
    Natural,
    /// Colours by height
    Tint,
    /// A cartographer's shaded relief
    Relief,
    /// The picture of --texture
    Image,
}

/// What else is known of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Pass {
    /// Distance from the eye (m)
    Depth,
    /// Unit normal
    Normal,
    /// Position relative to the eye (m)
    Position,
    /// Height (m)
    Height,
}

#[derive(Serialize)]
struct Answer {
    file: String,
    width: u32,
    height: u32,
    seconds: f64,
    eye: [f64; 3],
    look: [f64; 3],
    fov: f64,
    sun: [f64; 2],
    style: String,
    exaggeration: f64,
    datum: String,
    samples: u32,
    seed: u32,
    /// Significant height of the waves (m), and the instant (s), if there are waves.
    #[serde(skip_serializing_if = "Option::is_none")]
    hs: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    /// The lakes that were filled, if any.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    lakes: Vec<Lake>,
    /// How many objects there are, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    objects: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    passes: Option<String>,
    /// The mesh, if one was drawn.
    #[serde(skip_serializing_if = "Option::is_none", flatten)]
    mesh: Option<Told>,
}

impl Render {
    /// Runs the command.
    pub fn run(mut self, talk: &mut Talk) -> Result<(), Failure> {
        let started = Instant::now();
        self.untangle()?;
        let out = self.output()?;
        let files = self.files.iter().map(PathBuf::as_path);
        let files = files.chain(self.object.iter().map(|order| order.file.as_path()));
        let inputs: Vec<&Path> = files.chain(self.texture.as_deref()).chain(self.path.as_deref()).collect();
        check_output(&out.file, &inputs)?;
        if let Some(save) = &self.save_path {
            check_output(save, &inputs)?;
        }

        let state = self.sea.as_deref().map(|spec| sea::read(spec, talk)).transpose()?;
        let (reading, full, stretch) = (self.reading, self.full, self.exaggeration);
        let mut subject = Subject::open(&self.files, reading, full, stretch, self.water, talk)?;
        let lakes = lakes::fill(&self.lake, System::of(self.lonlat), &mut subject, talk)?;
        let (mut shot, look) = self.shot(&subject, self.files.is_empty(), talk)?;
        let film = self.film(&out, &shot, state.as_ref());
        if let Some(film) = &film {
            shot.shot.border = film.border(&subject)?;
            shot.shot.air.veils_distance = shot.border == Border::Mist || self.visibility.is_some();
        }
        let drape = self.texture.as_ref().map(|texture| subject.drape(texture, talk)).transpose()?;
        let objects = objects::standing(&self.object, System::of(self.lonlat), &subject, talk)?;
        if shot.style == picture::Style::Relief && !objects.is_empty() {
            talk.warn("a shaded relief is a map: objects are not shown on it".to_owned());
        }
        let scene = Scene {
            drape: drape.as_ref(),
            objects: &objects,
            lakes: subject.lakes.as_ref(),
            climate: climate(&subject.frame),
            north: subject.frame.north(),
            ..Scene::for_shot(&subject.land, subject.water.as_ref(), &shot)
        };
        let stage = Stage::new(&scene);
        let mut sea = self.waves(state.as_ref(), &subject, talk)?;
        let settings = Settings { samples: self.samples, seed: self.seed, passes: !self.passes.is_empty() };
        if let Some(mut film) = film {
            if self.detail.lod_from.is_some() {
                let shot = View::looking_at(shot.view.eye, look, film.field as f32, film.size);
                film.frozen = Some(self.detail.view(&self, &subject, &shot, look, talk)?);
            }
            let prepared = self.detail.prepare(stage.land());
            let chooser = self.detail.chooser(stage.land(), prepared.as_ref());
            let drawer = Drawer { chooser, painter: self.detail.painter(&stage, sea.as_ref(), talk)? };
            return film.run(&subject, &stage, sea.as_mut(), drawer, &settings, started, talk);
        }

        let mesh_view = self.detail.view(&self, &subject, &shot.view, look, talk)?;
        let waves = sea.as_ref().filter(|_| stage.shows_waves());
        let painter = self.detail.painter(&stage, sea.as_ref(), talk)?;
        let mut drawer = Drawer { chooser: self.detail.chooser(stage.land(), None), painter };
        let chosen = drawer.choose(waves, &mesh_view)?;
        let bar = progress(1000, "rendering");
        let told = |done: f32| bar.set_position((f64::from(done) * 1000.0) as u64);
        let picture = drawer.picture(&stage, sea.as_ref(), &shot.view, &settings, &told)?;
        bar.finish_and_clear();
        let passes = self.save(&picture, &out, &subject)?;

        let (eye, look) = (subject.given(shot.view.eye), subject.given(look));
        let elapsed = started.elapsed().as_secs_f64();
        if talk.json() {
            return talk.print_json(Answer {
                file: out.file.display().to_string(),
                width: self.size.x,
                height: self.size.y,
                seconds: elapsed,
                eye: eye.to_array(),
                look: look.to_array(),
                fov: shot.field.to_degrees(),
                sun: [shot.sun.azimuth.to_degrees(), shot.sun.elevation.to_degrees()],
                style: format!("{:?}", shot.style).to_lowercase(),
                exaggeration: self.exaggeration,
                datum: subject.datum,
                samples: self.samples,
                seed: self.seed,
                hs: sea.as_ref().map(|_| state.clone().unwrap_or_else(coast::sea_state).significant_height()),
                time: sea.as_ref().map(Sea::time),
                lakes,
                objects: Some(objects.len()).filter(|&count| count > 0),
                passes: passes.map(|p| p.display().to_string()),
                mesh: chosen,
            });
        }
        let also = passes.map_or(String::new(), |p| format!(" (passes in {})", p.display()));
        talk.print(format!(
            "{}: {}x{} in {}{also}, --eye {} --look {} --fov {}, exaggeration {}, {}{}\n",
            out.file.display(),
            self.size.x,
            self.size.y,
            seconds(elapsed),
            subject.shown(eye),
            subject.shown(look),
            tidy(shot.field.to_degrees(), 1),
            tidy(self.exaggeration, 2),
            subject.datum,
            chosen.map_or(String::new(), |told| told.line())
        ))
    }

    /// The waves on the subject's water at the first instant.
    fn waves(&self, state: Option<&SeaState>, subject: &Subject, talk: &mut Talk) -> Result<Option<Sea>, Failure> {
        if subject.water.is_none() && state.is_some() {
            talk.warn(format!("{}: no water for --sea; --water METRES says how high it stands", subject.name));
        }
        let own = self.files.is_empty().then(coast::sea_state);
        match state.or(own.as_ref()).filter(|state| !state.trains.is_empty()) {
            Some(state) => subject.sea(state, self.time),
            None => Ok(None),
        }
    }

    /// The film that is wanted, if one is.
    fn film<'a>(&'a self, out: &'a Output, shot: &Framed, sea: Option<&SeaState>) -> Option<film::Order<'a>> {
        /// Vertical angle of view (rad) of a moderate wide-angle lens: a film moves, whatever lens a still picture has.
        const LENS: f64 = 0.62;
        let path = self.path.as_deref()?;
        Some(film::Order {
            path: Some(path).filter(|p| *p != Path::new("orbit")),
            seconds: self.seconds,
            fps: self.fps,
            save: self.save_path.as_deref(),
            out: &out.file,
            folder: out.kind == Kind::Frames,
            look: format!(
                "{:?} {:?} {:?} water {:?} sea {sea:?} time {}{}{}{}",
                shot.sun,
                shot.air,
                shot.style,
                self.water,
                self.time,
                if self.detail.is_default() { String::new() } else { format!(" {:?}", self.detail) },
                if self.object.is_empty() { String::new() } else { format!(" {:?}", self.object) },
                if self.lake.is_empty() { String::new() } else { format!(" {:?}", self.lake) }
            ),
            field: self.fov.map_or(LENS, f64::to_radians),
            size: self.size,
            frozen: None,
        })
    }

    /// Sorts out what a parser cannot: `--path dem.tif` without another file means the file, and an orbit.
    fn untangle(&mut self) -> Result<(), Failure> {
        let is_path = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        if let Some(path) = &self.path
            && self.files.is_empty()
            && path != Path::new("orbit")
            && !is_path(path)
        {
            self.files.push(path.clone());
            self.path = Some("orbit".into());
        }
        match (self.style, &self.texture) {
            (Some(StyleName::Image), None) => {
                Err(Failure::Usage("expected a picture for --style image, got none; add --texture IMAGE".into()))
            }
            (None, Some(_)) => {
                self.style = Some(StyleName::Image);
                Ok(())
            }
            (Some(style), Some(_)) if style != StyleName::Image => Err(Failure::Usage(format!(
                "expected --style image with --texture, got {}; remove one",
                format!("{style:?}").to_lowercase()
            ))),
            _ => Ok(()),
        }
    }

    fn output(&self) -> Result<Output, Failure> {
        let film = self.path.is_some();
        let Some(out) = &self.out else {
            return Ok(match (film, film && !write::ffmpeg_installed()) {
                (false, _) => Output { file: "littoral.png".into(), kind: Kind::Png },
                (true, false) => Output { file: "littoral.mp4".into(), kind: Kind::Film },
                (true, true) => Output { file: "littoral_frames".into(), kind: Kind::Frames },
            });
        };
        let ending = out.extension().and_then(|e| e.to_str()).map(str::to_lowercase);
        let kind = match (film, ending.as_deref()) {
            (true, _) if out.is_dir() => Kind::Frames,
            (false, Some("png")) => Kind::Png,
            (false, Some("exr")) => Kind::Exr,
            (true, Some("mp4" | "mov" | "mkv")) => Kind::Film,
            (true, None) => Kind::Frames,
            (false, Some("mp4" | "mov" | "mkv")) => {
                let file = out.display();
                return Err(Failure::Usage(format!("{file}: expected --path for a film, got none; add --path")));
            }
            _ => {
                let allowed = if film { ".mp4, .mov, .mkv or a folder" } else { ".png or .exr" };
                let got = ending.map_or("none".to_owned(), |e| format!(".{e}"));
                let file = out.display();
                return Err(Failure::Usage(format!(
                    "{file}: expected a name ending in {allowed}, got {got}; change it"
                )));
            }
        };
        if film && !self.passes.is_empty() {
            return Err(Failure::Usage(
                "expected --passes with a picture, got a film; remove --passes or --path".into(),
            ));
        }
        Ok(Output { file: out.clone(), kind })
    }

    /// The view, and the point it looks at.
    fn shot(&self, subject: &Subject, built_in: bool, talk: &mut Talk) -> Result<(Framed, DVec3), Failure> {
        let (land, water) = (&subject.land, subject.water.as_ref());
        let chosen = match built_in {
            true => picture::coast_shot(self.size),
            // A shaded relief is a map.
            false if self.style == Some(StyleName::Relief) => picture::overhead(land, water, self.size),
            false => picture::compose(land, water, self.size),
        };
        let (range, narrow) = (land.height_range(), land.extent().min_element());
        let relief = f64::from(range.high - range.low);
        if !range.is_empty() && relief > 1.2 * narrow && self.exaggeration == 1.0 {
            let factor = tidy((0.3 * narrow / relief).max(0.01), 2);
            let (name, relief, narrow) = (&subject.name, tidy(relief, 0), tidy(narrow, 0));
            talk.warn(format!(
                "{name}: {relief} m of relief on {narrow} m of land: does the file say how far apart its samples are? --exaggeration {factor} draws it as hills"
            ));
        }
        let own_field = 2.0 * (0.5 * f64::from(self.size.y) / f64::from(chosen.view.pixels_per_radian)).atan();
        let field = self.fov.map_or(if self.eye.is_some() { 45f64.to_radians() } else { own_field }, f64::to_radians);
        let Shot { mut view, mut sun, mut air, mut style, mut border } = chosen;
        let look = match self.eye {
            Some(eye) => {
                let (eye, look) = (self.eye_position(subject, eye, talk)?, self.target(subject)?);
                view = View::looking_at(eye, look, field as f32, self.size);
                border = picture::suiting_border(land, water, eye);
                look
            }
            None => {
                let ahead = view.direction(0.5 * self.size.as_vec2()).as_dvec3();
                let look = land
                    .first_hit(&Ray::new(view.eye, ahead))
                    .map_or_else(|| view.eye + ahead * 0.5 * land.extent().max_element(), |hit| hit.position);
                if self.fov.is_some() {
                    view = View::looking_at(view.eye, look, field as f32, self.size);
                }
                look
            }
        };
        if let Some(chosen) = self.sun.over(&subject.frame, talk)? {
            sun = chosen;
        }
        if let Some(kilometres) = self.visibility {
            air.visibility = kilometres * 1000.0;
            air.veils_distance = true;
        }
        if let Some(name) = self.style {
            style = match name {
                StyleName::Natural => picture::Style::Natural,
                StyleName::Tint => picture::Style::Tint,
                StyleName::Relief => picture::Style::Relief,
                StyleName::Image => picture::Style::Image,
            };
        }
        Ok((Framed { shot: Shot { view, sun, air, style, border }, field }, look))
    }

    pub fn eye_position(&self, subject: &Subject, eye: DVec3, talk: &mut Talk) -> Result<DVec3, Failure> {
        let local = subject.local(System::of(self.lonlat), eye.truncate())?;
        let ground = subject.surface(local);
        let z = match (self.above, ground) {
            (false, _) => eye.z * self.exaggeration,
            (true, Some(ground)) => ground + eye.z * self.exaggeration,
            (true, None) => {
                let at = format!("{},{}", eye.x, eye.y);
                let name = &subject.name;
                return Err(Failure::Work(format!(
                    "{name}: expected ground below --eye {at} to count from, got none (void or outside); leave out --above"
                )));
            }
        };
        if let Some(ground) = ground.filter(|&ground| z < ground) {
            let below = tidy((ground - z) / self.exaggeration, 1);
            talk.warn(format!("{}: the eye is {below} m below the ground; raise it, or add --above", subject.name));
        }
        Ok(local.extend(z))
    }

    fn target(&self, subject: &Subject) -> Result<DVec3, Failure> {
        let Some(look) = self.look else {
            let middle = subject.land.origin() + 0.5 * subject.land.extent();
            let range = subject.land.height_range();
            let ground = subject.surface(middle).unwrap_or(0.5 * f64::from(range.low + range.high));
            return Ok(middle.extend(ground));
        };
        let local = subject.local(System::of(self.lonlat), look.xy)?;
        let ground = subject.surface(local);
        let z = match (look.z, self.above) {
            (Some(z), false) => z * self.exaggeration,
            (z, _) => ground.unwrap_or(0.0) + z.unwrap_or(0.0) * self.exaggeration,
        };
        Ok(local.extend(z))
    }

    /// Writes the picture; the name of the file with the passes, if that is another one.
    fn save(&self, picture: &Picture, out: &Output, subject: &Subject) -> Result<Option<PathBuf>, Failure> {
        let UVec2 { x: width, y: height } = picture.size;
        let comment = format!(
            "{}; radiance in kcd/m2, linear Rec. 709; depth, position (from the eye: X east, Y north, Z up) and height in metres",
            subject.name
        );
        let mut layers = Vec::new();
        if out.kind == Kind::Exr {
            let plane = |i: usize| picture.radiance.iter().map(|p| p[i]).collect();
            layers.push(Layer { name: "", channels: vec![("R", plane(0)), ("G", plane(1)), ("B", plane(2))] });
        } else {
            let pixels = picture.display(&Display::default());
            let notes = [("Software", "littoral".to_owned()), ("Source", subject.name.clone())];
            write::png(&out.file, width, height, PngPixels::Rgb8(&pixels), &notes)?;
        }
        let three = |name, planes: &[[f32; 3]]| {
            let plane = |i: usize| planes.iter().map(|p| p[i]).collect();
            Layer { name, channels: vec![("X", plane(0)), ("Y", plane(1)), ("Z", plane(2))] }
        };
        let stretch = subject.exaggeration as f32;
        for pass in &self.passes {
            layers.push(match pass {
                Pass::Depth => Layer { name: "depth", channels: vec![("V", picture.depth.clone())] },
                Pass::Normal => three("normal", &picture.normal),
                Pass::Position => three("position", &picture.position),
                Pass::Height => {
                    let heights = picture.height.iter().map(|h| h / stretch).collect();
                    Layer { name: "height", channels: vec![("V", heights)] }
                }
            });
        }
        if layers.is_empty() {
            return Ok(None);
        }
        let file = out.file.with_extension("exr");
        write::exr(&file, width, height, layers, &comment)?;
        Ok((file != out.file).then_some(file))
    }
}

/// A shot and its vertical angle of view (rad).
struct Framed {
    shot: Shot,
    field: f64,
}

impl std::ops::Deref for Framed {
    type Target = Shot;

    fn deref(&self) -> &Shot {
        &self.shot
    }
}

/// What is written.
struct Output {
    file: PathBuf,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Png,
    Exr,
    Film,
    Frames,
}

/// The climate where the land lies.
fn climate(frame: &Frame) -> Climate {
    match frame.place().map(|lonlat| lonlat.y) {
        Some(latitude) => Climate::at_latitude(latitude.to_radians()),
        None => Climate::default(),
    }
}

/// Complains about an output before any work is done: a missing folder, or one of the inputs.
pub fn check_output(out: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    if let Ok(there) = out.canonicalize()
        && inputs.iter().any(|input| input.canonicalize().is_ok_and(|input| input == there))
    {
        let file = out.display();
        return Err(Failure::Usage(format!(
            "{file}: expected another name than an input's for the output; change --out"
        )));
    }
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.is_dir() {
        return Ok(());
    }
    Err(Failure::Work(format!(
        "{}: expected the folder {} to exist, got nothing of that name; create it or choose another name",
        out.display(),
        folder.display()
    )))
}
