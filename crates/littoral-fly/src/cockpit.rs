//! The state of a flight, apart from window and scene: what is wished for, what came, and what the hands do with it.

use crate::calendar;
use crate::camera::{Camera, Hands, Mode, World};
use crate::compare::Difference;
use crate::detail::Detail;
use crate::draw::Scenery;
use crate::editor::Editor;
use crate::scene::{Frame, Look, News, Wish};
use crate::seastate::Surf;
use crate::settings::{Laid, Settings, Split, Style, SunBy};
use crate::steering::Steering;
use crate::subject::{Order, Refusal, Subject};
use crate::tape::Tape;
use glam::{DVec2, DVec3, UVec2, Vec2};
use littoral::flight::{FlightPath, Pace};
use littoral::picture::{self, Shot, Sun};
use littoral::space::View;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The mesh is chosen for so much more than the frame, so that what a turn brings in is there already.
const WIDER: f64 = 1.2;

/// So many frames are remembered for the plots.
const HISTORY: usize = 240;

/// How long a note stays (s).
const NOTE_SECONDS: f64 = 14.0;

/// Numbers of the last frames.
#[derive(Debug, Default)]
pub struct History {
    /// From frame to frame (ms).
    pub frame: VecDeque<f32>,
    /// Choosing triangles (ms).
    pub method: VecDeque<f32>,
    /// Triangles.
    pub triangles: VecDeque<f32>,
    /// The bound that was reached on the ground (pixels).
    pub bound: VecDeque<f32>,
    /// What frames brought to the graphics card of meshes (MB).
    pub uploads: VecDeque<f32>,
}

impl History {
    /// Adds what a frame brought to the graphics card (bytes).
    pub fn uploaded(&mut self, bytes: u64) {
        History::push(&mut self.uploads, bytes as f64 * 1e-6);
    }

    fn push(list: &mut VecDeque<f32>, value: f64) {
        if list.len() == HISTORY {
            list.pop_front();
        }
        list.push_back(value as f32);
    }
}

/// The middle one of some numbers; 0 of none.
pub fn median(numbers: impl IntoIterator<Item = f32>) -> f32 {
    let mut sorted: Vec<f32> = numbers.into_iter().collect();
    sorted.sort_by(f32::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Something to be read.
#[derive(Clone, Debug)]
pub struct Note {
    /// What.
    pub text: String,
    /// Until when (s, of the cockpit's clock).
    pub until: f64,
}

/// A flight.
pub struct Cockpit {
    /// What is remembered.
    pub settings: Settings,
    /// What is open, or being opened.
    pub order: Order,
    /// The land.
    pub subject: Option<Arc<Subject>>,
    serial: u64,
    shot: Option<Shot>,
    /// Its light and colours.
    pub scenery: Option<Scenery>,
    /// The newest meshes.
    pub frame: Option<Frame>,
    /// The eye.
    pub camera: Camera,
    /// The view that triangles are chosen for, if it is not the eye's.
    pub frozen: Option<View>,
    /// The path that is made.
    pub editor: Editor,
    /// Whether clicks make it.
    pub editing: bool,
    /// Where it is saved.
    pub path_file: String,
    /// The path as it is flown, at an even pace, for drawing and playing.
    pub tape: Option<Tape>,
    taped: Option<FlightPath>,
    /// The instant of the flight along the path (s), if it is flown.
    pub playing: Option<f64>,
    /// Whether it stands still there.
    pub paused: bool,
    /// The instant of the sea (s).
    pub time: f64,
    /// Whether that stands still.
    pub still: bool,
    /// What is being done in the background.
    pub working: Option<(String, f32)>,
    /// What is to be read.
    pub notes: Vec<Note>,
    /// Numbers.
    pub history: History,
    /// Where the second picture begins, as a share of the window's width.
    pub divider: f32,
    /// How far apart the two pictures are.
    pub difference: Option<Difference>,
    /// Whether the picture rests, and is only made cleaner.
    pub rests: bool,
    /// What keeps frames within their budget of time.
    pub steering: Option<Steering>,
    /// What the sea's state is while it is typed.
    pub sea_text: String,
    /// Where the waves break, if they do.
    pub surf: Option<Surf>,
    /// The name of the picture of the ground while it is typed.
    pub picture_text: String,
    /// Logarithm of the radiance that is shown as middle grey.
    grey: Option<f32>,
    clock: f64,
}

impl Cockpit {
    /// Over some files, or the built-in coast.
    pub fn new(settings: Settings, files: Vec<PathBuf>) -> Cockpit {
        let mut camera = Camera::new(DVec3::new(0.0, 0.0, 1000.0), DVec3::Y);
        camera.speed = settings.speed;
        Cockpit {
            order: Order { files, exaggeration: settings.exaggeration, lakes: Vec::new(), objects: Vec::new() },
            sea_text: settings.sea.clone(),
            surf: None,
            picture_text: settings.laid.as_ref().map_or(String::new(), |laid| laid.picture.display().to_string()),
            settings,
            subject: None,
            serial: 0,
            shot: None,
            scenery: None,
            frame: None,
            camera,
            frozen: None,
            editor: Editor::default(),
            editing: false,
            path_file: "path.toml".to_owned(),
            tape: None,
            taped: None,
            playing: None,
            paused: false,
            time: 0.0,
            still: false,
            working: Some(("opening".to_owned(), 0.0)),
            notes: Vec::new(),
            history: History::default(),
            divider: 0.5,
            difference: None,
            rests: false,
            steering: None,
            grey: None,
            clock: 0.0,
        }
    }

    /// Shows a sentence for a while.
    pub fn note(&mut self, text: impl Into<String>) {
        let (text, until) = (text.into(), self.clock + NOTE_SECONDS);
        self.notes.retain(|note| note.text != text);
        self.notes.push(Note { text, until });
    }

    /// Takes what the scene tells.
    pub fn hear(&mut self, news: News) {
        match news {
            News::Working(what, done) => self.working = Some((what, done)),
            News::Idle => self.working = None,
            News::Note(text) => self.note(text),
            News::Refused(refusal) => {
                let laid = match (refusal, &self.subject) {
                    (Refusal::Problem(problem), _) => {
                        self.note(problem);
                        None
                    }
                    (Refusal::Picture(picture), None) => {
                        let file = picture.display();
                        self.note(format!(
                            "{file}: expected heights, got a picture; open a land, then drop it on that"
                        ));
                        None
                    }
                    (Refusal::Picture(picture), Some(_)) => Some(picture),
                };
                // What was there is flown on; where nothing was, the built-in coast.
                self.order = match &self.subject {
                    Some(subject) => subject.order.clone(),
                    None => Order { files: Vec::new(), exaggeration: 1.0, lakes: Vec::new(), objects: Vec::new() },
                };
                self.settings.exaggeration = self.order.exaggeration;
                if let Some(picture) = laid {
                    self.lay(&picture);
                }
            }
            News::Undraped(problem) => {
                self.note(problem);
                self.settings.laid = None;
                if self.settings.style == Style::Image {
                    self.settings.style = Style::Natural;
                }
            }
            News::Surf(surf) => self.surf = surf,
            News::Arrived(subject, shot, serial) => self.arrive(subject, *shot, serial),
            News::Scenery(scenery, serial) => {
                if serial == self.serial {
                    self.scenery = Some(scenery);
                }
            }
            News::Frame(frame) => {
                if frame.serial == self.serial {
                    if let Some(heights) = frame.heights {
                        self.camera.boat.float(heights);
                    }
                    History::push(&mut self.history.method, frame.first.milliseconds);
                    History::push(&mut self.history.triangles, frame.first.triangles() as f64);
                    History::push(&mut self.history.bound, f64::from(frame.first.ground.reached.pixels));
                    self.frame = Some(*frame);
                }
            }
        }
    }

    fn arrive(&mut self, subject: Arc<Subject>, shot: Shot, serial: u64) {
        let stretch = self.subject.as_ref().and_then(|before| {
            let same = before.order.files == subject.order.files;
            same.then(|| subject.order.exaggeration / before.order.exaggeration)
        });
        subject.notes.clone().into_iter().for_each(|note| self.note(note));
        (self.serial, self.scenery, self.frame, self.frozen, self.grey) = (serial, None, None, None, None);
        (self.taped, self.tape, self.playing, self.surf) = (None, None, None, None);
        self.subject = Some(subject);
        match stretch {
            // The same land, stretched: whoever flies stays where he is.
            Some(factor) => {
                self.camera.eye.z *= factor;
                let path = self.editor.path().clone().stretched(factor);
                self.editor.replace(path);
            }
            None => {
                if !self.editor.path().points.is_empty() {
                    self.editor = Editor::default();
                }
            }
        }
        self.shot = Some(shot);
        if stretch.is_none() {
            self.home();
            if self.settings.mode != Mode::Fly {
                self.change_mode(self.settings.mode);
            }
        }
    }

    /// Back to the good view.
    pub fn home(&mut self) {
        if let Some(shot) = &self.shot {
            let direction = shot.view.direction(0.5 * shot.view.size.as_vec2()).as_dvec3();
            self.camera = Camera::new(shot.view.eye, direction);
            self.playing = None;
        }
    }

    /// What suits the land: the bearing and elevation of the sun (degrees).
    pub fn own_sun(&self) -> Option<DVec2> {
        let sun = self.shot.as_ref()?.sun;
        Some(DVec2::new(sun.azimuth.to_degrees().rem_euclid(360.0), sun.elevation.to_degrees()))
    }

    /// The place of the land: longitude and latitude (degrees), its own or as entered.
    pub fn place(&self) -> DVec2 {
        calendar::place(&self.settings, self.subject.as_ref().and_then(|subject| subject.lonlat()))
    }

    /// The sun that is wished for; `None` for the one that suits the land.
    pub fn sun(&self) -> Option<Sun> {
        let settings = &self.settings;
        let [azimuth, elevation] = [settings.sun_azimuth_degrees, settings.sun_elevation_degrees].map(f64::to_radians);
        match settings.sun {
            SunBy::Land => None,
            SunBy::Hand => Some(Sun::new(azimuth, elevation)),
            SunBy::Date => calendar::sun(settings, self.place()),
        }
    }

    /// Vertical angle of view (rad).
    fn field(&self) -> f64 {
        self.settings.field_degrees.to_radians()
    }

    /// What is seen in a picture of this size.
    pub fn view(&self, size: UVec2) -> View {
        self.camera.view(self.field(), size, 1.0)
    }

    /// The view that triangles are chosen for.
    pub fn lod_view(&self, size: UVec2) -> View {
        self.frozen.unwrap_or_else(|| self.camera.view(self.field(), size, WIDER))
    }

    /// How triangles are to be chosen: as set, or as finely as the budget of time allows.
    pub fn first(&self) -> Detail {
        match &self.steering {
            Some(steering) => Detail { tolerance_pixels: steering.tolerance(), ..self.settings.first },
            None => self.settings.first,
        }
    }

    /// How triangles of a second picture are to be chosen, if there is one.
    pub fn second(&self) -> Option<Detail> {
        (self.settings.split != Split::Off).then_some(self.settings.second)
    }

    /// Steers the tolerance after a frame that took so long (ms), if there is a budget. Two pictures have none: each is to be seen as it was set.
    pub fn steer(&mut self, milliseconds: f64) {
        let budget = self.settings.budget_milliseconds;
        if budget <= 0.0 || self.settings.split != Split::Off {
            self.steering = None;
            return;
        }
        let begun = self.settings.first.tolerance_pixels;
        let steering = self.steering.get_or_insert_with(|| Steering::at(begun));
        // Only frames count that are drawn with triangles of the tolerance of now; those of a picture that rests are quicker than a flight's.
        let drawn =
            self.frame.as_ref().is_some_and(|frame| frame.first.detail.tolerance_pixels == steering.tolerance());
        if drawn && !self.rests && self.working.is_none() {
            steering.frame(milliseconds, budget);
        }
    }

    /// Whether waves are wanted as triangles: lit pictures make them of the sea itself.
    fn shows_waves(&self) -> bool {
        self.settings.style == Style::Plain || self.scenery.as_ref().is_some_and(Scenery::is_plain)
    }

    /// The instant of the sea that is wished for (s): still water has but one.
    pub fn sea_time(&self) -> f64 {
        if self.settings.waves { self.time } else { 0.0 }
    }

    /// The picture that is laid over this land.
    pub fn picture(&self) -> Option<&Path> {
        let laid = self.settings.laid.as_ref()?;
        (*laid == Laid::new(&laid.picture, &self.order.files)).then_some(&laid.picture)
    }

    /// Lays a picture over this land.
    pub fn lay(&mut self, picture: &Path) {
        self.picture_text = picture.display().to_string();
        self.settings.laid = Some(Laid::new(picture, &self.order.files));
        self.settings.style = Style::Image;
    }

    /// In which light the land is seen.
    fn look(&self) -> Look {
        let settings = &self.settings;
        let visibility = (settings.visibility_kilometres > 0.0).then_some(settings.visibility_kilometres * 1000.0);
        let picture = self.picture().filter(|_| settings.style == Style::Image).map(Path::to_owned);
        let style = settings.style.lit().filter(|style| *style != picture::Style::Image || picture.is_some());
        Look { sun: self.sun(), visibility, style: style.unwrap_or_default(), picture }
    }

    /// What is wished for, in a picture of this size.
    pub fn wish(&self, size: UVec2) -> Wish {
        let settings = &self.settings;
        Wish {
            order: self.order.clone(),
            look: self.look(),
            sea: settings.waves.then(|| settings.sea.clone()),
            first: self.first(),
            second: self.second(),
            view: self.lod_view(size),
            eye: self.view(size),
            waves: self.shows_waves(),
            time: self.sea_time(),
            probes: (self.camera.mode() == Mode::Boat).then(|| self.camera.boat.probes()),
        }
    }

    /// Multiplies all speeds.
    pub fn faster(&mut self, by: f64) {
        self.settings.speed = (self.settings.speed * by).clamp(0.05, 20.0);
    }

    /// Freezes the view that triangles are chosen for, or lets it follow the eye again.
    pub fn freeze(&mut self, size: UVec2) {
        self.frozen = match self.frozen {
            Some(_) => None,
            None => Some(self.lod_view(size)),
        };
    }

    /// Asks the camera something about the land.
    fn with_world<T>(&mut self, ask: impl FnOnce(&mut Camera, &World) -> T) -> Option<T> {
        let subject = self.subject.clone()?;
        let world = World {
            ground: &|at| subject.ground(at),
            water: &|at| subject.still_water(at),
            bounds: subject.bounds(),
            below: self.settings.below,
        };
        Some(ask(&mut self.camera, &world))
    }

    /// Another way of moving.
    pub fn change_mode(&mut self, mode: Mode) {
        let seen = self.subject.as_ref().and_then(|subject| {
            let view = self.view(UVec2::new(16, 9));
            subject.seen(&view, Vec2::new(8.0, 4.5))
        });
        match self.with_world(|camera, world| camera.change(mode, seen, world)) {
            Some(Err(problem)) => self.note(problem),
            Some(Ok(())) => {
                self.playing = None;
                self.settings.mode = mode;
            }
            None => self.settings.mode = mode,
        }
        if self.camera.mode() != self.settings.mode && self.subject.is_some() {
            self.settings.mode = self.camera.mode();
        }
    }

    /// Height of ground or still water (m) at a place.
    pub fn surface(&self, at: DVec2) -> Option<f64> {
        self.subject.as_ref()?.surface(at)
    }

    /// Goes on for `seconds`.
    pub fn advance(&mut self, hands: &Hands, seconds: f64) {
        self.clock += seconds;
        self.notes.retain(|note| note.until > self.clock);
        History::push(&mut self.history.frame, seconds * 1e3);
        if !self.still {
            self.time += seconds;
        }
        self.camera.speed = self.settings.speed;
        self.adapt(seconds);
        self.retape();
        match (self.playing, &self.tape) {
            (Some(at), Some(tape)) => {
                let at = if self.paused { at } else { at + seconds };
                let pose = tape.pose(at);
                self.camera.eye = pose.position;
                self.camera.look_along(pose.direction);
                let over = at > tape.duration() && !tape.closed;
                self.playing = if over { None } else { Some(at) };
            }
            _ => {
                self.with_world(|camera, world| camera.step(hands, seconds, world));
            }
        }
    }

    /// The eye gets used to the light.
    fn adapt(&mut self, seconds: f64) {
        const SECONDS: f64 = 0.8;
        if let Some(frame) = &self.frame {
            let seen = frame.grey.max(1e-9).ln();
            let left = (-seconds / SECONDS).exp() as f32;
            self.grey = Some(self.grey.map_or(seen, |used| seen + (used - seen) * left));
        }
    }

    /// The radiance that is shown as middle grey (kcd/m²).
    pub fn grey(&self) -> f32 {
        self.grey.map_or(1.0, f32::exp)
    }

    /// Follows the path with its tape.
    fn retape(&mut self) {
        let path = self.editor.path();
        if self.taped.as_ref() == Some(path) {
            return;
        }
        let Some(subject) = &self.subject else { return };
        self.tape = Tape::of(path, subject, Tape::RATE).ok();
        self.taped = Some(path.clone());
        if self.tape.is_none() {
            self.playing = None;
        }
    }

    /// Flies along the path, or stops to.
    pub fn play(&mut self) {
        if self.playing.take().is_some() {
            return;
        }
        let Some(subject) = &self.subject else { return };
        match Tape::of(self.editor.path(), subject, Tape::RATE) {
            Ok(_) => {
                // A path carries the eye as a flight does.
                if self.camera.mode() != Mode::Fly {
                    self.change_mode(Mode::Fly);
                }
                (self.playing, self.paused) = (Some(0.0), false);
            }
            Err(problem) => self.note(format!("no flight yet: {problem}")),
        }
    }

    /// A path once round the land.
    pub fn round_trip(&mut self) {
        let Some(subject) = &self.subject else { return };
        let land = &subject.land;
        let mut path = FlightPath::around(land.origin(), land.extent(), land.height_range(), 40.0);
        path.pace = Pace::Duration(40.0);
        self.editor.replace(path);
    }

    /// Saves the path under its name.
    pub fn save_path(&mut self) {
        let Some(subject) = &self.subject else { return };
        let file = self.path_file.trim().to_owned();
        let said = match file.is_empty() {
            true => "expected a name for the path's file, got none; type one".to_owned(),
            false => match subject.save_path(self.editor.path(), Path::new(&file)) {
                Ok(()) => format!("path of {} points saved in {file}", self.editor.path().points.len()),
                Err(problem) => problem,
            },
        };
        self.note(said);
    }

    /// Loads a path.
    pub fn load_path(&mut self, file: &Path) {
        let Some(subject) = &self.subject else { return };
        match subject.load_path(file) {
            Ok(path) => {
                self.note(format!("path of {} points loaded from {}", path.points.len(), file.display()));
                self.editor.replace(path);
                self.path_file = file.display().to_string();
            }
            Err(problem) => self.note(problem),
        }
    }

    /// Takes files that were dropped: paths are loaded, everything else is opened as land.
    pub fn drop_files(&mut self, files: Vec<PathBuf>) {
        let is_path = |file: &PathBuf| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        let (paths, land): (Vec<_>, Vec<_>) = files.into_iter().partition(is_path);
        if !land.is_empty() {
            self.open(land);
        }
        if let Some(path) = paths.last() {
            self.load_path(path);
        }
    }

    /// Opens files as one land.
    pub fn open(&mut self, files: Vec<PathBuf>) {
        self.order.files = files;
        // They belonged to the land before.
        self.order.lakes.clear();
        self.order.objects.clear();
        self.working = Some(("opening".to_owned(), 0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_laid_over_the_land_that_it_was_dropped_on_alone() {
        let mut cockpit = Cockpit::new(Settings::default(), vec!["dem.tif".into()]);
        cockpit.lay(Path::new("ortho.tif"));
        let style = |cockpit: &Cockpit| cockpit.wish(UVec2::new(16, 9)).look.style;
        assert!(cockpit.picture().is_some_and(|picture| picture.is_absolute() && picture.ends_with("ortho.tif")));
        assert_eq!(style(&cockpit), picture::Style::Image);
        let settings = cockpit.settings.clone();
        let again = Cockpit::new(settings.clone(), vec!["./dem.tif".into()]);
        assert_eq!(style(&again), picture::Style::Image, "remembered");
        let elsewhere = Cockpit::new(settings, Vec::new());
        assert_eq!((elsewhere.picture(), style(&elsewhere)), (None, picture::Style::Natural));
        // What cannot be laid is forgotten.
        cockpit.hear(News::Undraped("broken".into()));
        assert_eq!((cockpit.settings.laid.as_ref(), cockpit.settings.style), (None, Style::Natural));
        assert_eq!(cockpit.notes[0].text, "broken");
        // Colours dropped before there is a land are no picture of it.
        cockpit.hear(News::Refused(Refusal::Picture("photo.jpg".into())));
        assert!(cockpit.settings.laid.is_none() && cockpit.notes[1].text.contains("photo.jpg: expected heights"));
    }
}
