//! `littoral waves height`: the water's surface at points and an instant, from the sea that pictures show.

use super::state;
use crate::ground::{Frame, Reading, System, height_at};
use crate::input::{self, WaterLevel};
use crate::points::{self, Typed};
use crate::subject::Subject;
use crate::talk::{Failure, Talk, progress, tidy, written};
use glam::{DVec2, Vec3};
use littoral::field::{Beach, Land, Sea, Surface, coast};
use littoral::space::Datum;
use littoral::waves::SeaState;
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// How high the water stands at points and an instant, how it leans, and how it runs.
///
/// It is the very sea that `littoral render --sea` draws, asked instead of shown: of the same state, seed, land and instant. Without --land
/// it is the open sea, and X and Y are metres east and north. One line for each point: `X,Y,HEIGHT,NX,NY,NZ,VX,VY,VZ`, X and Y as they were
/// given; the height in metres above still water, with --land in the land's heights; the upward unit normal; the velocity of the water at its
/// surface (m/s). The components of vectors are east, north (with --land along its own axes) and up. `nan` where there is no water. With
/// --until a record of instants, each line with its own in front: `TIME,X,Y,HEIGHT,…`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral waves height --sea wind=15,from=240 --at 0,0 --time 12.5
  littoral waves height --sea beaufort=6,seed=3 --at 0,0 10,0 20,0 --json
  littoral waves height --sea hs=2,tp=9 --at 0,0 --until 600 --every 0.25 > buoy.csv
  littoral waves height --sea hs=2,tp=9 --at 0,0 --below 3     the water 3 m below its surface
  littoral waves height --sea buoy=41010.data_spec --at 0,0    the sea that a buoy measured
  littoral waves height --land coast --at 2600,1200            the built-in coast, its own sea
  littoral waves height --land bay.tif --sea beaufort=5,from=200 --at 434100,5431200 --time 3
  littoral waves height --land bay.tif --sea douglas=4 --points track.csv > heights.csv
  littoral waves height --sea wind=9 --points - < points.csv

Points are in the coordinates of --land's file, as those of `littoral height` are; --lonlat for
degrees. JSON: height (m), normal, velocity (m/s), foam (share of the surface, 0 to 1), each an
array where several points are asked for, with null where it is dry; level (m, of still water),
time (s), hs (m, of the open sea); with --until these are of the first instant, and record is an array
of time, height, normal, velocity and foam for each.")]
pub struct Height {
    /// The waves, as `littoral render --sea` takes them: wind=15,from=240; hs=2,tp=9; beaufort=6; douglas=4; calm; buoy=FILE; with
    /// swell=HEIGHT@PERIOD/FROM, fetch=KM, model=, gamma=, spread=, depth=, breaking=, seed= [default with --land coast: beaufort=4,from=225]
    #[arg(long, value_name = "SPEC", required_unless_present = "land")]
    sea: Option<String>,
    /// Which of the seas of this state, as seed= in --sea [default: 0]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Points
    #[arg(long, value_name = "X,Y", num_args = 1.., required_unless_present = "points", conflicts_with = "points")]
    at: Vec<Typed>,
    /// A file with one X,Y a line (comma, blank or tab between), or - for standard input
    #[arg(long, value_name = "FILE|-")]
    points: Option<PathBuf>,
    /// The instant in seconds
    #[arg(long, value_name = "S", value_parser = input::instant, default_value = "0")]
    time: f64,
    /// The last instant of a record that begins at --time
    #[arg(long, value_name = "S", value_parser = input::instant)]
    until: Option<f64>,
    /// How long it is from one instant of a record to the next (s)
    #[arg(long, value_name = "S", value_parser = every, default_value = "0.5", requires = "until")]
    every: f64,
    /// Leave out waves shorter than twice this width (m), as a hull of that width or a wide pixel does
    #[arg(long, value_name = "METRES", value_parser = footprint, default_value = "0")]
    footprint: f32,
    /// Velocities so far (m) below the moving surface, instead of at it
    #[arg(long, value_name = "METRES", value_parser = below)]
    below: Option<f64>,
    /// Velocities at this height (m); above the surface those of the water under it
    #[arg(long, value_name = "METRES", value_parser = input::number, conflicts_with = "below")]
    z: Option<f64>,

    /// Height files for the bed and the shore, or `coast` for the built-in coast (./coast for a file of that name)
    #[arg(long, value_name = "FILE", num_args = 1.., help_heading = "Land")]
    land: Vec<PathBuf>,
    /// Height of still water in metres
    #[arg(long, value_name = "METRES", value_parser = level, requires = "land", help_heading = "Land")]
    water: Option<f64>,
    /// Coordinates are longitude and latitude in degrees
    #[arg(long, requires = "land", help_heading = "Land")]
    lonlat: bool,
    /// Use all samples of the land, however many, as `render --full` does; otherwise files of more than 16 million are taken coarser
    #[arg(long, requires = "land", help_heading = "Land")]
    full: bool,
    #[command(flatten, next_help_heading = "Land")]
    reading: Reading,
}

fn footprint(text: &str) -> Result<f32, String> {
    input::within(text, 0.0, 1e6, "a width from 0 to 1e6 m").map(|width| width as f32)
}

fn every(text: &str) -> Result<f64, String> {
    input::within(text, 1e-3, 1e6, "a time from 0.001 to 1e6 s")
}

fn below(text: &str) -> Result<f64, String> {
    input::within(text, 0.0, 12_000.0, "a depth from 0 to 12000 m")
}

fn level(text: &str) -> Result<f64, String> {
    input::within(text, -12_000.0, 9_000.0, "a height from -12000 to 9000 m")
}

/// What is known of the water at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Known {
    height: f64,
    normal: Vec3,
    foam: f32,
    /// Nothing where the point lies in the ground.
    velocity: Option<Vec3>,
}

/// One of them, or a list.
#[derive(Serialize)]
#[serde(untagged)]
enum Few<T> {
    One(Option<T>),
    Several(Vec<Option<T>>),
}

impl<T> Few<T> {
    fn of(known: &[Option<Known>], single: bool, part: impl Fn(&Known) -> Option<T>) -> Few<T> {
        let mut parts = known.iter().map(|k| k.as_ref().and_then(&part));
        if single { Few::One(parts.next().flatten()) } else { Few::Several(parts.collect()) }
    }
}

/// What is known at an instant.
#[derive(Serialize)]
struct Moment {
    height: Few<f64>,
    normal: Few<[f32; 3]>,
    velocity: Few<[f32; 3]>,
    foam: Few<f32>,
    time: f64,
}

impl Moment {
    fn of(time: f64, known: &[Option<Known>], single: bool) -> Moment {
        Moment {
            height: Few::of(known, single, |k| Some(k.height)),
            normal: Few::of(known, single, |k| Some(k.normal.to_array())),
            velocity: Few::of(known, single, |k| k.velocity.map(|v| v.to_array())),
            foam: Few::of(known, single, |k| Some(k.foam)),
            time,
        }
    }
}

#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    first: Moment,
    level: f64,
    hs: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    record: Option<Vec<Moment>>,
}

/// Points without an answer.
#[derive(Default)]
struct Misses {
    total: usize,
    dry: usize,
    outside: usize,
    buried: usize,
    first_dry: Option<String>,
}

/// The sea, and the land that it washes.
struct Shown {
    sea: Sea,
    land: Option<Subject>,
    /// Where a swash could get to.
    beach: Option<Beach>,
}

impl Shown {
    /// Whether waves may wet a place, as pictures have it: it lies in still water, or on a shore that rises from it.
    fn may_be_wet(&self, place: DVec2) -> bool {
        let Some(land) = &self.land else { return true };
        land.water.as_ref().is_some_and(|water| water.covers(place))
            || self.beach.as_ref().is_some_and(|beach| beach.covers(&land.land, place))
    }
}

impl Height {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        if let Some(until) = self.until.filter(|&until| until < self.time) {
            let times = format!("--until {until} and --time {}", self.time);
            return Err(Failure::Usage(format!(
                "expected a record that ends after it begins, got {times}; change one"
            )));
        }
        let state = self.state(talk)?;
        let hs = state.significant_height();
        let mut shown = self.shown(state, talk)?;
        let (mut misses, mut all) = (Misses::default(), Vec::new());
        if let Some(until) = self.until {
            return self.record(until, &mut shown, hs, talk);
        }
        let mut take = |typed: &[Typed]| -> Result<(), Failure> {
            let known = self.known(&shown, typed, &mut misses)?;
            if talk.json() {
                all.extend(known);
                return Ok(());
            }
            let mut text = String::with_capacity(100 * typed.len());
            typed.iter().zip(known).for_each(|(point, known)| line(&point.text, known, &mut text));
            written(std::io::stdout().lock().write_all(text.as_bytes()))
        };
        match &self.points {
            Some(file) => points::stream(file, |typed| take(&typed))?,
            None => take(&self.at)?,
        }
        misses.report(&shown, talk);
        if !talk.json() {
            return Ok(());
        }
        let single = self.points.is_none() && all.len() == 1;
        let first = Moment::of(self.time, &all, single);
        talk.print_json(Answer { first, level: shown.sea.level(), hs, record: None })
    }

    /// Instant after instant.
    fn record(&self, until: f64, shown: &mut Shown, hs: f64, talk: &mut Talk) -> Result<(), Failure> {
        let mut typed = self.at.clone();
        if let Some(file) = &self.points {
            points::stream(file, |more| {
                typed.extend(more);
                Ok(())
            })?;
        }
        // The last instant counts in spite of rounding.
        let steps = ((until - self.time) / self.every + 1e-9).floor();
        if talk.json() && steps * typed.len().max(1) as f64 > MOST {
            let got = format!("{} points at {} instants", typed.len(), steps + 1.0);
            return Err(Failure::Usage(format!(
                "expected a record of at most 1e7 answers with --json, got {got}; leave out --json, end it earlier, or take larger steps with --every"
            )));
        }
        let single = self.points.is_none() && typed.len() == 1;
        let (mut misses, mut moments, mut first) = (Misses::default(), Vec::new(), None);
        let bar = progress(steps as u64 + 1, "record");
        for step in 0..=steps as u64 {
            let time = self.time + step as f64 * self.every;
            shown.sea.set_time(time);
            let known = self.known(shown, &typed, &mut misses)?;
            if talk.json() {
                moments.push(Moment::of(time, &known, single));
                first.get_or_insert(known);
            } else {
                let mut text = String::with_capacity(110 * typed.len());
                for (point, known) in typed.iter().zip(known) {
                    line(&format!("{},{}", tidy(time, 6), point.text), known, &mut text);
                }
                written(std::io::stdout().lock().write_all(text.as_bytes()))?;
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        misses.report(shown, talk);
        if !talk.json() {
            return Ok(());
        }
        let first = Moment::of(self.time, &first.unwrap_or_default(), single);
        talk.print_json(Answer { first, level: shown.sea.level(), hs, record: Some(moments) })
    }

    fn built_in(&self) -> bool {
        self.land == [Path::new("coast")]
    }

    fn state(&self, talk: &mut Talk) -> Result<SeaState, Failure> {
        let mut state = match &self.sea {
            Some(spec) => state::read(spec, talk)?,
            None if self.built_in() => coast::sea_state(),
            None => return Err(Failure::Usage("expected --sea SPEC for the waves, got none; add it".into())),
        };
        if let Some(seed) = self.seed {
            let words = self.sea.as_deref().unwrap_or("").split(',');
            if words.map(str::trim).any(|word| word.starts_with("seed=")) {
                return Err(Failure::Usage("expected --seed or seed= in --sea, got both; leave one out".into()));
            }
            state.seed = seed;
        }
        Ok(state)
    }

    /// The sea of a state, as it is drawn.
    fn shown(&self, state: SeaState, talk: &mut Talk) -> Result<Shown, Failure> {
        if self.land.is_empty() {
            let datum = Datum::Plane { origin: DVec2::splat(-1e4), size: DVec2::splat(2e4) };
            let made = Sea::of_state(datum, 0.0, &state);
            let mut sea = made.map_err(|e| Failure::Usage(format!("--sea: {e}; correct it")))?;
            sea.set_time(self.time);
            return Ok(Shown { sea, land: None, beach: None });
        }
        let files: &[PathBuf] = if self.built_in() { &[] } else { &self.land };
        let level = self.water.unwrap_or(0.0);
        let subject = Subject::open(files, self.reading, self.full, 1.0, WaterLevel::At(level), talk)?;
        let Some(sea) = subject.sea(&state, self.time)? else {
            return Err(Failure::Work(format!(
                "{}: expected land with water, got a dry bed: nothing along its border lies below {level} m; --water METRES says how high water stands",
                subject.name
            )));
        };
        let beach = subject.water.as_ref().and_then(|water| Beach::of(&subject.land, water));
        Ok(Shown { sea, land: Some(subject), beach })
    }

    /// What is known of the water at points.
    fn known(&self, shown: &Shown, typed: &[Typed], misses: &mut Misses) -> Result<Vec<Option<Known>>, Failure> {
        let sea = &shown.sea;
        let system = System::of(self.lonlat);
        let place = |point: &Typed| match &shown.land {
            Some(land) => land.local(system, point.xy),
            None if point.xy.abs().max_element() <= FAR => Ok(point.xy),
            None => {
                let problem = "expected X and Y within 1e9 m of the origin, got";
                Err(Failure::Work(format!("{problem} {}; choose a nearer point", point.text)))
            }
        };
        let places = typed.iter().map(place).collect::<Result<Vec<DVec2>, Failure>>()?;
        let mut surfaces = vec![EMPTY; places.len()];
        sea.surfaces_at(&places, self.footprint, &mut surfaces);
        let z = |surface: &Surface| self.z.unwrap_or(surface.height - self.below.unwrap_or(0.0));
        let asked: Vec<_> = places.iter().zip(&surfaces).map(|(place, s)| place.extend(z(s))).collect();
        let mut velocities = vec![Vec3::ZERO; places.len()];
        sea.velocities_at(&asked, &mut velocities);
        let mut known = Vec::with_capacity(places.len());
        for (i, surface) in surfaces.iter().enumerate() {
            misses.total += 1;
            let ground = shown.land.as_ref().and_then(|land| height_at(&land.land, places[i])).map(f64::from);
            let wet = shown.may_be_wet(places[i]) && ground.is_none_or(|ground| ground < surface.height);
            if !wet {
                misses.dry(&typed[i].text, ground, surface.height);
                known.push(None);
                continue;
            }
            misses.outside += usize::from(shown.land.as_ref().is_some_and(|land| outside(&land.land, places[i])));
            let buried = ground.is_some_and(|ground| asked[i].z < ground);
            misses.buried += usize::from(buried);
            known.push(Some(Known {
                height: surface.height,
                normal: surface.normal(),
                foam: surface.foam,
                velocity: (!buried).then_some(velocities[i]),
            }));
        }
        Ok(known)
    }
}

/// Most answers of a record that is told as a whole.
const MOST: f64 = 1e7;

/// Farther from the origin (m) phases lose their digits.
const FAR: f64 = 1e9;

const EMPTY: Surface =
    Surface { height: 0.0, slope: glam::Vec2::ZERO, hidden: Vec3::ZERO, foam: 0.0, rest: DVec2::ZERO, residual: 0.0 };

impl Misses {
    fn dry(&mut self, at: &str, ground: Option<f64>, water: f64) {
        self.dry += 1;
        self.first_dry.get_or_insert_with(|| match ground {
            Some(ground) if ground >= water => {
                format!("the ground at {at} is {} m high, the water's surface {} m", tidy(ground, 2), tidy(water, 2))
            }
            Some(_) => format!("the water does not get to {at}, however low"),
            None => format!("there is neither land nor sea at {at}"),
        });
    }

    fn report(&self, shown: &Shown, talk: &mut Talk) {
        let Some(Subject { name, frame, land, .. }) = &shown.land else { return };
        let total = self.total;
        if let Some(first) = &self.first_dry {
            talk.warn(format!("{name}: {} of {total} points are dry: {first}", self.dry));
        }
        if self.outside > 0 {
            talk.warn(format!(
                "{name}: {} of {total} points lie outside the data, {}: there is the open sea",
                self.outside,
                reach(frame, land)
            ));
        }
        if self.buried > 0 {
            talk.warn(format!("{name}: {} of {total} points lie below the bed: they have no velocity", self.buried));
        }
    }
}

/// Whether a local position lies beyond the land, by more than rounding.
fn outside(land: &Land, place: DVec2) -> bool {
    let (low, slack) = (land.origin(), land.extent() * 1e-9);
    place.cmplt(low - slack).any() || place.cmpgt(low + land.extent() + slack).any()
}

/// From where to where the land goes, in its coordinates.
fn reach(frame: &Frame, land: &Land) -> String {
    let shares = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE];
    let corners = shares.map(|share| frame.crs(land.origin() + share * land.extent()));
    let (low, high) =
        (corners.into_iter().fold(corners[0], DVec2::min), corners.into_iter().fold(corners[0], DVec2::max));
    let shown = |number: f64| frame.shown(number);
    format!("X {} to {} and Y {} to {}", shown(low.x), shown(high.x), shown(low.y), shown(high.y))
}

fn line(at: &str, known: Option<Known>, text: &mut String) {
    let shown = |number: f64| if number.is_nan() { "nan".to_owned() } else { tidy(number, 6) };
    let height = known.map_or(f64::NAN, |k| k.height);
    let normal = known.map_or(Vec3::NAN, |k| k.normal);
    let velocity = known.and_then(|k| k.velocity).unwrap_or(Vec3::NAN);
    // Writing to a string does not fail.
    let _ = write!(text, "{at},{}", shown(height));
    for number in normal.to_array().into_iter().chain(velocity.to_array()) {
        let _ = write!(text, ",{}", shown(f64::from(number)));
    }
    text.push('\n');
}
