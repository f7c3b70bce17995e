//! The thread that chooses triangles, so that the window never waits for them.
//!
//! The window says what it wishes for as often as it likes; only the newest wish counts. The scene thread answers with finished meshes, and with
//! news of what it loads. Files are read and seas are made on threads of their own meanwhile, over which the old scene goes on.
//!
//! Everything that borrows the land (the stage, the sea's method, ROAM's bounds) lives on the stack of [`fly`], for as long as that land is flown over.

use crate::chooser::{Chooser, Chosen, Limit, Prepared};
use crate::detail::Detail;
use crate::draping::Draping;
use crate::draw::Scenery;
use crate::plain::sea_datum;
use crate::seastate::Surf;
use crate::subject::{Order, Refusal, Subject};
use glam::{DVec2, UVec2};
use littoral::field::Sea;
use littoral::lod::ViewError;
use littoral::picture::{self, Air, Border, Climate, Drape, Scene, Shot, Stage, Style, Sun};
use littoral::space::View;
use littoral::waves::SeaState;
use littoral_gpu::Gpu;
use std::path::PathBuf;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What decides the light and the colours: each change makes the stage anew.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The sun; `None` for one that suits the land.
    pub sun: Option<Sun>,
    /// How far one sees (m); `None` for what suits the land.
    pub visibility: Option<f64>,
    /// How the ground is coloured.
    pub style: Style,
    /// The picture that is laid over it, if one is.
    pub picture: Option<PathBuf>,
}

/// What the window wishes to see.
#[derive(Clone, Debug, PartialEq)]
pub struct Wish {
    /// Over which land.
    pub order: Order,
    /// In which light.
    pub look: Look,
    /// The sea's state as typed; `None` for still water.
    pub sea: Option<String>,
    /// How triangles are chosen.
    pub first: Detail,
    /// How triangles of a second picture are, if there is one.
    pub second: Option<Detail>,
    /// For which view; how finely is the details' business.
    pub view: View,
    /// What the eye sees, in a picture of any size.
    pub eye: View,
    /// Whether waves are wanted as triangles.
    pub waves: bool,
    /// The instant of the sea (s).
    pub time: f64,
    /// Where the water's height is asked for.
    pub probes: Option<[DVec2; 4]>,
}

/// What a method chose.
#[derive(Debug)]
pub struct Choice {
    /// How.
    pub detail: Detail,
    /// The ground.
    pub ground: Chosen,
    /// The water.
    pub water: Option<Chosen>,
    /// How long the choice took (ms).
    pub milliseconds: f64,
}

impl Choice {
    /// Triangles of ground and water.
    pub fn triangles(&self) -> usize {
        self.ground.mesh.triangles.len() + self.water.as_ref().map_or(0, |water| water.mesh.triangles.len())
    }
}

/// Meshes for a wish.
#[derive(Debug)]
pub struct Frame {
    /// Which land they are of.
    pub serial: u64,
    /// Which frame of that land it is.
    pub number: u64,
    /// The view they were chosen for.
    pub view: View,
    /// The instant of the sea (s).
    pub time: f64,
    /// The meshes.
    pub first: Choice,
    /// Those of a second picture.
    pub second: Option<Choice>,
    /// The radiance that an eye there would take for middle grey (kcd/m²).
    pub grey: f32,
    /// Heights of the water (m) at the wish's probes.
    pub heights: Option<[f64; 4]>,
}

impl Frame {
    /// Whether its meshes would be others had there been more time.
    pub fn is_unfinished(&self) -> bool {
        let choices = [Some(&self.first), self.second.as_ref()];
        choices.into_iter().flatten().any(|choice| choice.ground.limit == Some(Limit::Time))
    }
}

/// What the scene tells the window.
pub enum News {
    /// Something is being done, and this much of it is done, in [0, 1].
    Working(String, f32),
    /// Nothing is being done any more.
    Idle,
    /// Something that shall be read.
    Note(String),
    /// What was ordered could not be opened.
    Refused(Refusal),
    /// A picture could not be laid over the land.
    Undraped(String),
    /// The surf of the waves that are seen now.
    Surf(Option<Surf>),
    /// Another land, and a good view of it.
    Arrived(Arc<Subject>, Box<Shot>, u64),
    /// The light and the colours of a land.
    Scenery(Scenery, u64),
    /// Meshes.
    Frame(Box<Frame>),
}

/// Where the newest wish lies.
#[derive(Default)]
pub struct Slot {
    newest: Mutex<(Option<Wish>, bool)>,
    changed: Condvar,
}

impl Slot {
    /// Puts a wish in the place of the one before.
    pub fn wish(&self, wish: Wish) {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner).0 = Some(wish);
        self.changed.notify_one();
    }

    /// Ends the scene.
    pub fn end(&self) {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner).1 = true;
        self.changed.notify_one();
    }

    /// The newest wish, if one comes within a time; an error at the end.
    fn wait(&self, most: Duration) -> Result<Option<Wish>, Ended> {
        let newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.changed.wait_timeout_while(newest, most, |(wish, end)| wish.is_none() && !*end);
        let mut newest = waited.unwrap_or_else(PoisonError::into_inner).0;
        if newest.1 { Err(Ended) } else { Ok(newest.0.take()) }
    }
}

/// The window is gone.
struct Ended;

/// What the scene thread speaks with.
#[derive(Clone)]
pub struct Voice {
    news: Sender<News>,
    wake: Arc<dyn Fn() + Send + Sync>,
    /// What was said last to be done, and how much of it (%).
    told: Arc<Mutex<(String, i32)>>,
}

impl Voice {
    /// News go to the window, which is woken for them.
    pub fn new(news: Sender<News>, wake: impl Fn() + Send + Sync + 'static) -> Voice {
        Voice { news, wake: Arc::new(wake), told: Arc::default() }
    }

    fn tell(&self, news: News) {
        let _ = self.news.send(news); // a window that is gone wants no news
        (self.wake)();
    }

    /// Each percent once.
    fn working(&self, what: &str, done: f32) {
        let percent = (done.clamp(0.0, 1.0) * 100.0) as i32;
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if (told.0.as_str(), told.1) != (what, percent) {
            *told = (what.to_owned(), percent);
            drop(told);
            self.tell(News::Working(what.to_owned(), done));
        }
    }

    fn idle(&self) {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).0.clear();
        self.tell(News::Idle);
    }
}

/// How often a scene without wishes looks whether what it waits for is done.
const NAP: Duration = Duration::from_millis(40);

/// The scene thread: until the window ends it.
pub fn run(slot: &Slot, voice: &Voice, gpu: &Gpu) {
    let mut wish = loop {
        match slot.wait(NAP) {
            Ok(Some(wish)) => break wish,
            Ok(None) => {}
            Err(Ended) => return,
        }
    };
    let mut serial = 0;
    let mut opening = Opening::of(&wish.order, voice);
    let mut subject: Option<(Arc<Subject>, Shot)> = None;
    loop {
        let done = match &subject {
            // Nothing to fly over yet.
            None => match slot.wait(NAP) {
                Ok(newest) => {
                    wish = newest.unwrap_or(wish);
                    opening.follow(&wish.order, None, voice);
                    opening.take()
                }
                Err(Ended) => return,
            },
            Some((subject, suits)) => match fly(subject, suits, serial, &mut wish, &mut opening, slot, voice, gpu) {
                Ok(opened) => Some(opened),
                Err(Ended) => return,
            },
        };
        match done {
            Some(Ok(opened)) => {
                serial += 1;
                voice.working("looking for a good view", 0.0);
                let shot = match opened.order.files.is_empty() {
                    true => picture::coast_shot(wish.view.size),
                    false => picture::compose(&opened.land, opened.water.as_ref(), wish.view.size),
                };
                let opened = Arc::new(opened);
                subject = Some((opened.clone(), shot));
                voice.tell(News::Arrived(opened, Box::new(shot), serial));
            }
            Some(Err(problem)) => {
                voice.idle();
                voice.tell(News::Refused(problem));
            }
            None => {}
        }
    }
}

/// A land that is being opened.
struct Opening {
    order: Order,
    thread: Option<std::thread::JoinHandle<Result<Subject, Refusal>>>,
}

impl Opening {
    fn of(order: &Order, voice: &Voice) -> Opening {
        let (ordered, voice) = (order.clone(), voice.clone());
        let work = move || Subject::open(&ordered, &|what, done| voice.working(what, done));
        let thread = std::thread::Builder::new().name("opening".into()).spawn(work).ok();
        Opening { order: order.clone(), thread }
    }

    /// Opens another land if another one is wanted than is there.
    fn follow(&mut self, order: &Order, there: Option<&Order>, voice: &Voice) {
        if Some(order) == there {
            *self = Opening { order: order.clone(), thread: None };
        } else if self.order != *order {
            *self = Opening::of(order, voice);
        }
    }

    /// What was opened, once.
    fn take(&mut self) -> Option<Result<Subject, Refusal>> {
        let thread = self.thread.take_if(|thread| thread.is_finished())?;
        let name = littoral_data::name_of_all(&self.order.files);
        let broken = || format!("{}: could not be opened (an internal error; please report it)", name.display());
        Some(thread.join().unwrap_or_else(|_| Err(Refusal::Problem(broken()))))
    }
}

/// Flies over a land until another one is open. `suits` is a view with the light that suits it.
#[allow(clippy::too_many_arguments, reason = "what is flown over, what is wished for, and whom to tell")]
fn fly(
    subject: &Arc<Subject>,
    suits: &Shot,
    serial: u64,
    wish: &mut Wish,
    opening: &mut Opening,
    slot: &Slot,
    voice: &Voice,
    gpu: &Gpu,
) -> Result<Result<Subject, Refusal>, Ended> {
    std::thread::scope(|threads| {
        let mut waves: Option<Sea> = None;
        // What the waves are of, and what is being made.
        let mut state: Option<String> = None;
        let mut number = 0;
        let mut making: Option<std::thread::ScopedJoinHandle<'_, Result<Made, String>>> = None;
        let mut draping = Draping::default();
        let mut drape: Option<Arc<Drape>> = None;
        loop {
            let (mut look, laid) = (wish.look.clone(), drape.clone());
            if laid.is_none() && look.picture.take().is_some() {
                look.style = Style::Natural; // until it is open
            }
            let scene = scene(subject, suits, &look, laid.as_deref());
            let visibility = scene.air.visibility;
            voice.working("lighting the land", 0.0);
            let stage = Stage::new(&scene);
            let (scenery, problem) = Scenery::new(gpu, &stage, wish.eye.eye.z);
            if let Some(problem) = problem {
                voice.tell(News::Note(problem));
            }
            voice.tell(News::Scenery(scenery.clone(), serial));
            voice.idle();
            let prepared = Prepared::default();
            let mut meter = Meter::default();
            // How long the last sky took, and when it was done.
            let mut sky = (Duration::ZERO, Instant::now());
            let mut still = subject.water.as_ref().map(|water| Sea::new(sea_datum(&subject.land), water.level));
            let mut first = Chooser::new(stage.land(), &prepared, wish.first);
            let mut second: Option<Chooser> = None;
            let mut answered: Option<Wish> = None;
            // Which waves natural pictures show: whether any, and of which instant (s).
            let mut seen = (false, f64::NAN);
            // With which sea objects were placed: whether there was any, and its instant (s).
            let mut placed: Option<(bool, f64)> = None;
            loop {
                if draping.follow(wish.look.picture.as_deref(), subject) {
                    voice.working("opening the picture", 0.0);
                }
                match draping.ended() {
                    Some(Ok(noticed)) => noticed.into_iter().for_each(|words| voice.tell(News::Note(words))),
                    Some(Err(problem)) => {
                        voice.idle();
                        voice.tell(News::Undraped(problem));
                    }
                    None => {}
                }
                // Until a picture is open, the ground is seen as it was.
                let open = draping.drape(wish.look.picture.as_deref());
                if wish.look != look && (wish.look.picture.is_none() || open.is_some()) {
                    drape = open.cloned();
                    break;
                }
                opening.follow(&wish.order, Some(&subject.order), voice);
                match opening.take() {
                    Some(Ok(opened)) => return Ok(Ok(opened)),
                    Some(Err(refusal)) => {
                        voice.idle();
                        voice.tell(News::Refused(refusal));
                    }
                    None => {}
                }
                if making.is_none() && wish.sea != state {
                    state.clone_from(&wish.sea);
                    waves = waves.filter(|_| state.is_some());
                    if let (Some(text), Some(_)) = (state.clone(), &subject.water) {
                        let voice = voice.clone();
                        making = Some(threads.spawn(move || sea(subject, &text, &voice)));
                    }
                }
                if let Some(made) = making.take_if(|making| making.is_finished()) {
                    voice.idle();
                    match made.join() {
                        Ok(Ok((sea, surf))) => {
                            waves = Some(sea);
                            voice.tell(News::Surf(surf));
                        }
                        Ok(Err(problem)) => voice.tell(News::Note(problem)),
                        Err(_) => voice.tell(News::Note(
                            "the waves could not be made (an internal error; please report it)".into(),
                        )),
                    }
                    (answered, seen) = (None, (false, f64::NAN));
                }
                if (wish.first.rays || wish.second.is_some_and(|second| second.rays))
                    && let Err(problem) = scenery.bring_rays(gpu, &stage)
                {
                    voice.tell(News::Note(problem));
                }
                scenery.bring_picture(gpu, &stage, &wish.eye);
                // A sky takes long: no more than a quarter of the time is spent on skies.
                if sky.1.elapsed() > 3 * sky.0 {
                    let begun = Instant::now();
                    scenery.see_from(gpu, &stage, wish.eye.eye.z);
                    sky = (begun.elapsed(), Instant::now());
                }
                // A view that rests is metered once more, where the last measurement was of another one.
                if answered.as_ref() != Some(&*wish) || meter.wants(&wish.eye) {
                    let ready =
                        [Some(&wish.first), wish.second.as_ref()].into_iter().flatten().all(|d| prepared.is_for(d));
                    if !ready {
                        voice.working("preparing the land for ROAM", 0.0);
                    }
                    first.follow(wish.first);
                    match (&mut second, wish.second) {
                        (Some(second), Some(detail)) => second.follow(detail),
                        (None, Some(detail)) => second = Some(Chooser::new(stage.land(), &prepared, detail)),
                        (_, None) => second = None,
                    }
                    if !ready {
                        voice.idle();
                    }
                    let sea = waves.as_mut().or(still.as_mut());
                    number += 1;
                    let grey = meter.grey(&stage, &wish.eye);
                    let made = frame(&mut first, second.as_mut(), sea, wish, visibility);
                    if let Err(problem) =
                        show_waves(&scenery, gpu, waves.as_ref().filter(|_| stage.shows_waves()), &mut seen)
                    {
                        voice.tell(News::Note(problem));
                    }
                    let tide = (waves.is_some(), waves.as_ref().map_or(0.0, Sea::time));
                    if !subject.objects.is_empty() && placed != Some(tide) {
                        if let Err(problem) = scenery.set_objects(gpu, &stage.placed(waves.as_ref())) {
                            voice.tell(News::Note(problem));
                        }
                        placed = Some(tide);
                    }
                    answered = Some(wish.clone());
                    match made {
                        Ok(frame) => {
                            answered = answered.filter(|_| !frame.is_unfinished());
                            voice.tell(News::Frame(Box::new(Frame { serial, number, grey, ..frame })));
                        }
                        Err(problem) => voice.tell(News::Note(problem)),
                    }
                }
                if let Some(newest) = slot.wait(NAP)? {
                    *wish = newest;
                }
            }
        }
    })
}

/// The scene of a land in a light.
fn scene<'a>(subject: &'a Subject, suits: &Shot, look: &Look, drape: Option<&'a Drape>) -> Scene<'a> {
    let air = match look.visibility {
        Some(visibility) => Air { visibility, veils_distance: true },
        None => suits.air,
    };
    let climate = subject.lonlat().map_or_else(Climate::default, |lonlat| Climate::at_latitude(lonlat.y.to_radians()));
    Scene {
        lakes: subject.lakes.as_ref(),
        objects: &subject.objects,
        sun: look.sun.unwrap_or(suits.sun),
        air,
        style: look.style,
        drape,
        // Whoever flies comes within, sooner or later.
        border: Border::Mist,
        climate,
        north: subject.north(),
        ..Scene::new(&subject.land, subject.water.as_ref())
    }
}

/// A sea, and its surf.
type Made = (Sea, Option<Surf>);

/// The sea of a state as typed.
fn sea(subject: &Subject, text: &str, voice: &Voice) -> Result<Made, String> {
    let wrong =
        |problem: String| format!("sea state \"{text}\": {problem}; correct it, for example: beaufort=4,from=225");
    let state: SeaState = text.parse().map_err(|e: littoral::waves::spec::SpecError| wrong(e.to_string()))?;
    let Some(water) = &subject.water else { return Err("there is no water here for waves".into()) };
    // Bearings count from true north, headings from the land's x axis.
    let state = state.turned(-subject.north());
    let told = |done: f64| {
        voice.working("carrying the waves over the bed", done as f32);
        true
    };
    let sea = Sea::over(&subject.land, water, &state, &told).map_err(|e| wrong(e.to_string()))?;
    Ok((sea, Surf::of(&subject.land, water, &state)))
}

/// The meshes that are wished for, where one sees so far (m).
fn frame(
    first: &mut Chooser,
    second: Option<&mut Chooser>,
    sea: Option<&mut Sea>,
    wish: &Wish,
    visibility: f64,
) -> Result<Frame, String> {
    let sea = sea.map(|sea| {
        if sea.time() != wish.time {
            sea.set_time(wish.time);
        }
        &*sea
    });
    let waves = sea.filter(|_| wish.waves);
    let chosen = |chooser: &mut Chooser| choose(chooser, waves, &wish.view, visibility).map_err(|e| e.to_string());
    let heights = sea.zip(wish.probes).map(|(sea, probes)| {
        let mut heights = [0.0; 4];
        sea.heights_at(&probes, &mut heights);
        heights
    });
    Ok(Frame {
        serial: 0,
        number: 0,
        grey: 0.0,
        view: wish.view,
        time: wish.time,
        first: chosen(first)?,
        second: second.map(chosen).transpose()?,
        heights,
    })
}

/// Brings the waves of a sea to natural pictures, as it stands now. `seen` is what they have shown so far: whether any, and of which instant (s).
fn show_waves(scenery: &Scenery, gpu: &Gpu, sea: Option<&Sea>, seen: &mut (bool, f64)) -> Result<(), String> {
    let now = (sea.is_some(), sea.map_or(f64::NAN, Sea::time));
    let before = std::mem::replace(seen, now);
    match sea {
        Some(sea) if !before.0 => scenery.set_waves(gpu, Some(sea)),
        Some(sea) if before.1 != now.1 => {
            scenery.follow_waves(gpu, sea);
            Ok(())
        }
        None if before.0 => scenery.set_waves(gpu, None),
        _ => Ok(()),
    }
}

/// What a method chooses for a view.
fn choose(chooser: &mut Chooser, sea: Option<&Sea>, view: &View, visibility: f64) -> Result<Choice, ViewError> {
    let started = Instant::now();
    let detail = chooser.detail();
    let view = View { tolerance_pixels: detail.tolerance_pixels as f32, ..*view };
    let ground = chooser.ground(&view, visibility)?;
    let water = sea.map(|sea| chooser.water(sea, &view)).transpose()?;
    let milliseconds = started.elapsed().as_secs_f64() * 1e3;
    Ok(Choice { detail, ground, water, milliseconds })
}

/// Meters the light, as a photographer does: by a small picture of what is seen, now and then.
#[derive(Default)]
struct Meter {
    last: Option<(f32, View, Instant)>,
}

impl Meter {
    /// Measurements are so far apart.
    const EVERY: Duration = Duration::from_millis(900);

    /// Whether it is time for another measurement, and another view than the last one's.
    fn wants(&self, eye: &View) -> bool {
        self.last.as_ref().is_none_or(|(_, of, when)| of != eye && when.elapsed() >= Meter::EVERY)
    }

    /// The radiance of middle grey (kcd/m²).
    fn grey(&mut self, stage: &Stage<'_>, eye: &View) -> f32 {
        const SIZE: UVec2 = UVec2::new(48, 27);
        match self.last {
            Some((grey, ..)) if !self.wants(eye) => grey,
            _ => {
                let pixels_per_radian = eye.pixels_per_radian * SIZE.y as f32 / eye.size.y.max(1) as f32;
                let small = View { size: SIZE, pixels_per_radian, ..*eye };
                let settings = picture::Settings { samples: 1, passes: false, ..picture::Settings::default() };
                let grey = stage.render(&small, &settings, &|_| {}).grey().max(1e-6);
                self.last = Some((grey, *eye, Instant::now()));
                grey
            }
        }
    }
}
