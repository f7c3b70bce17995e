//! Films: a path, and a picture for each moment of it.

use crate::detail::{Drawer, Told};
use crate::ground::System;
use crate::subject::Subject;
use crate::talk::{Failure, Talk, progress, seconds as shown_seconds, tidy};
use glam::{DVec2, UVec2};
use littoral::field::Sea;
use littoral::flight::{Flight, FlightPath, Pace};
use littoral::picture::{Border, Display, Exposure, Settings, Stage, suiting_border};
use littoral::space::View;
use littoral_data::path::{Coordinates, SavedPath};
use littoral_data::write::{self, Film, FilmSettings, FrameFolder};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How long an orbit takes unless said otherwise (s).
const ORBIT_SECONDS: f64 = 12.0;

/// What film is wanted.
pub struct Order<'a> {
    /// The path; `None` for an orbit.
    pub path: Option<&'a Path>,
    /// Its length (s), if not the path's own.
    pub seconds: Option<f64>,
    /// Frames a second.
    pub fps: f64,
    /// Where to save the path.
    pub save: Option<&'a Path>,
    /// Where to write the film.
    pub out: &'a Path,
    /// Whether that is a folder for frames.
    pub folder: bool,
    /// All that changes the look of a frame, in words.
    pub look: String,
    /// Vertical angle of view (rad).
    pub field: f64,
    /// Pixels of a frame.
    pub size: UVec2,
    /// The view that meshes are chosen for, if not that of each frame.
    pub frozen: Option<View>,
}

#[derive(Serialize)]
struct Answer {
    file: String,
    width: u32,
    height: u32,
    frames: usize,
    frames_drawn: usize,
    fps: f64,
    film_seconds: f64,
    path_metres: f64,
    seconds: f64,
    exaggeration: f64,
    datum: String,
    /// The meshes, if such were drawn.
    #[serde(skip_serializing_if = "Option::is_none", flatten)]
    mesh: Option<Told>,
}

/// Where frames go.
enum Sink {
    Film(Film),
    Folder(FrameFolder),
}

impl Order<'_> {
    /// What suits the land's border all along the path: a cut where it stays outside.
    pub fn border(&self, subject: &Subject) -> Result<Border, Failure> {
        let (land, water) = (&subject.land, subject.water.as_ref());
        let points = self.flight_path(subject)?.points;
        let outside = points.iter().all(|p| suiting_border(land, water, p.spot.xy.extend(0.0)) == Border::Cut);
        Ok(if outside { Border::Cut } else { Border::Mist })
    }

    /// Draws and writes the film: of the surface, or of the meshes that a method chooses.
    #[allow(clippy::too_many_arguments, reason = "what a film is of, and how it is drawn")]
    pub fn run(
        &self,
        subject: &Subject,
        stage: &Stage<'_>,
        mut sea: Option<&mut Sea>,
        mut drawer: Drawer<'_>,
        settings: &Settings,
        started: Instant,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        let path = self.flight_path(subject)?;
        if let Some(save) = self.save {
            saved(subject, &path).save(save)?;
            talk.note(format!("path saved in {}", save.display()));
        }
        let ground = |xy: DVec2| subject.surface(xy);
        let named = self.path.map_or_else(|| "the orbit".to_owned(), |p| p.display().to_string());
        let flight = path.over(&ground).map_err(|e| Failure::Work(format!("{named}: {e}")))?;
        let frames = ((flight.duration() * self.fps).round() as usize).max(1);
        const MOST: usize = 1_000_000;
        if frames > MOST {
            return Err(Failure::Work(format!(
                "{named}: expected a film of at most {MOST} frames, got {} s at {} a second; shorten it with --seconds or --fps",
                tidy(flight.duration(), 1),
                self.fps
            )));
        }

        let (mut sink, out) = self.sink(&path, subject, settings, talk)?;
        let view = |time: f64, size: UVec2| {
            let pose = flight.pose(time);
            View::looking_at(pose.position, pose.position + pose.direction * 1000.0, self.field as f32, size)
        };
        let display = Display { exposure: Exposure::Grey(steady_grey(&flight, stage, &view)), ..Display::default() };
        let begin = sea.as_ref().map_or(0.0, |sea| sea.time());
        let bar = progress(frames as u64, "filming");
        let mut drawn = 0;
        let mut mesh: Option<Told> = None;
        for frame in 1..=frames {
            let there = matches!(&sink, Sink::Folder(folder) if folder.has(frame));
            if !there {
                let time = (frame - 1) as f64 / self.fps;
                if let Some(sea) = &mut sea {
                    sea.set_time(begin + time);
                }
                let (sea, view) = (sea.as_deref(), view(time, self.size));
                let chosen_for = self.frozen.as_ref().unwrap_or(&view);
                if let Some(told) = drawer.choose(sea.filter(|_| stage.shows_waves()), chosen_for)? {
                    mesh.get_or_insert(Told { select_seconds: 0.0, ..told }).join(told);
                }
                let picture = drawer.picture(stage, sea, &view, settings, &|_| {})?;
                let pixels = picture.display(&display);
                match &mut sink {
                    Sink::Film(film) => film.frame(&pixels)?,
                    Sink::Folder(folder) => folder.write(frame, &pixels)?,
                }
                drawn += 1;
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        match sink {
            Sink::Film(film) => film.finish()?,
            Sink::Folder(folder) => {
                if drawn < frames {
                    talk.note(format!("{} frames were there already", frames - drawn));
                }
                talk.note(format!("join the frames with: {}", folder.how_to_join()));
            }
        }
        let elapsed = started.elapsed().as_secs_f64();
        if talk.json() {
            return talk.print_json(Answer {
                file: out.display().to_string(),
                width: self.size.x,
                height: self.size.y,
                frames,
                frames_drawn: drawn,
                fps: self.fps,
                film_seconds: frames as f64 / self.fps,
                path_metres: flight.length(),
                seconds: elapsed,
                exaggeration: subject.exaggeration,
                datum: subject.datum.clone(),
                mesh,
            });
        }
        talk.print(format!(
            "{}: {frames} frames of {}x{}, {} s at {} a second, along {named} of {} m, in {}, exaggeration {}, {}{}\n",
            out.display(),
            self.size.x,
            self.size.y,
            tidy(frames as f64 / self.fps, 2),
            tidy(self.fps, 3),
            tidy(flight.length(), 0),
            shown_seconds(elapsed),
            tidy(subject.exaggeration, 2),
            subject.datum,
            mesh.map_or(String::new(), |told| told.line())
        ))
    }

    /// The path in local metres, heights stretched like the land.
    fn flight_path(&self, subject: &Subject) -> Result<FlightPath, Failure> {
        let Some(file) = self.path else {
            let land = &subject.land;
            let seconds = self.seconds.unwrap_or(ORBIT_SECONDS);
            return Ok(FlightPath::around(land.origin(), land.extent(), land.height_range(), seconds));
        };
        let saved = SavedPath::load(file)?;
        let local = |coordinates, xy| match coordinates {
            Coordinates::Metres => Some(xy),
            Coordinates::File => subject.local(System::File, xy).ok(),
            Coordinates::LonLat => subject.local(System::LonLat, xy).ok(),
        };
        let path = saved.placed(local).map_err(|point| {
            let file = file.display();
            let name = &subject.name;
            Failure::Work(format!(
                "{file}: point {point}: expected coordinates that {name} can place, got others; change \"coordinates\""
            ))
        })?;
        let mut path = path.stretched(subject.exaggeration);
        if let Some(seconds) = self.seconds {
            path.pace = Pace::Duration(seconds);
        }
        Ok(path)
    }

    fn sink(
        &self,
        path: &FlightPath,
        subject: &Subject,
        settings: &Settings,
        talk: &mut Talk,
    ) -> Result<(Sink, PathBuf), Failure> {
        let film = FilmSettings { width: self.size.x, height: self.size.y, rate: self.fps };
        if !self.folder && write::ffmpeg_installed() {
            return Ok((Sink::Film(Film::create(self.out, film)?), self.out.to_owned()));
        }
        let folder = match self.folder {
            true => self.out.to_owned(),
            false => {
                let name = self.out.file_stem().map_or("film".into(), |stem| stem.to_string_lossy().into_owned());
                let folder = self.out.with_file_name(name + "_frames");
                talk.note(format!("ffmpeg is not installed: frames go into {}", folder.display()));
                folder
            }
        };
        // Whatever changes a frame is part of the label, so that frames of different films are never mixed.
        let label = format!(
            "Frames of a film by littoral; the same command goes on where it stopped.\nland {} {:?} {:?}\nsize {}x{}\nfps {}\n\
             field {}\nsettings {settings:?}\nexaggeration {}\nlook {}\npath {path:?}\n",
            subject.name,
            subject.land.extent(),
            subject.land.height_range(),
            self.size.x,
            self.size.y,
            self.fps,
            self.field,
            subject.exaggeration,
            self.look
        );
        Ok((Sink::Folder(FrameFolder::open(&folder, film, &label)?), folder))
    }
}

/// One exposure for the whole film, from small pictures along it: as a photographer would meter before filming, since an
/// exposure that follows every frame pumps.
fn steady_grey(flight: &Flight<'_>, stage: &Stage<'_>, view: &dyn Fn(f64, UVec2) -> View) -> f32 {
    const PROBES: usize = 7;
    let settings = Settings { samples: 1, passes: false, ..Settings::default() };
    let grey = |i: usize| {
        let time = flight.duration() * (i as f64 + 0.5) / PROBES as f64;
        stage.render(&view(time, UVec2::new(96, 54)), &settings, &|_| {}).grey()
    };
    let mean = (0..PROBES).map(|i| grey(i).max(1e-9).ln()).sum::<f32>() / PROBES as f32;
    mean.exp()
}

/// A path as it is saved: in the file's coordinates, unstretched.
fn saved(subject: &Subject, path: &FlightPath) -> SavedPath {
    let path = path.clone().stretched(1.0 / subject.exaggeration);
    SavedPath::of(&path, |xy| subject.frame.crs(xy), subject.frame.decimals())
}
