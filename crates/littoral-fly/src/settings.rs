//! What is remembered from one flight to the next: a readable file in the user's folder for settings.

use crate::camera::Mode;
use crate::detail::{Detail, within};
use littoral::lod::Method;
use littoral::picture;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How the picture is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// In the light of the data: every pixel is lit once, whatever the triangles.
    #[default]
    Natural,
    /// So lit, in colours by height.
    Tint,
    /// A cartographer's shaded relief.
    Relief,
    /// So lit, under a picture of the ground.
    Image,
    /// The triangles themselves, flatly lit; waves are triangles, too.
    Plain,
}

impl Style {
    /// All of them.
    pub const ALL: [Style; 5] = [Style::Natural, Style::Tint, Style::Relief, Style::Image, Style::Plain];

    /// What it is called, and what it does.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Style::Natural => ("Natural", "Rock, scree, grass, woods, sand, snow and the sea in the light of the day"),
            Style::Tint => ("Tint", "Colours by height, land and sea bed, in the light on the relief"),
            Style::Relief => ("Relief", "A cartographer's shaded relief"),
            Style::Image => ("Image", "A picture laid over the ground: drop one on the window, or name it below"),
            Style::Plain => {
                ("Plain", "The triangles themselves, flatly lit, waves as well: quick without a graphics card")
            }
        }
    }

    /// How the light falls on it; `None` for triangles themselves.
    pub fn lit(self) -> Option<picture::Style> {
        match self {
            Style::Natural => Some(picture::Style::Natural),
            Style::Tint => Some(picture::Style::Tint),
            Style::Relief => Some(picture::Style::Relief),
            Style::Image => Some(picture::Style::Image),
            Style::Plain => None,
        }
    }
}

/// What is seen of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Show {
    /// The surface, lit.
    #[default]
    Textured,
    /// Its triangles' edges alone.
    Wireframe,
    /// Both.
    Both,
}

impl Show {
    /// All of them.
    pub const ALL: [Show; 3] = [Show::Textured, Show::Wireframe, Show::Both];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Show::Textured => "Textured",
            Show::Wireframe => "Wireframe",
            Show::Both => "Both",
        }
    }
}

/// Which pictures are shown of two methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// The first alone.
    #[default]
    Off,
    /// Both, side by side.
    Halves,
    /// How they differ, amplified.
    Difference,
}

impl Split {
    /// All of them.
    pub const ALL: [Split; 3] = [Split::Off, Split::Halves, Split::Difference];

    /// What it is called, and what it does.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Split::Off => ("One", "One method alone"),
            Split::Halves => ("Two", "The same view by two methods: drag the line between them"),
            Split::Difference => ("Difference", "How far the two pictures differ, amplified"),
        }
    }
}

/// A picture that is laid over a land.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Laid {
    /// The picture's file.
    pub picture: PathBuf,
    /// The land's; none for the built-in coast.
    pub over: Vec<PathBuf>,
}

impl Laid {
    /// A picture over the land of some files, by names that hold wherever the program is started next time.
    pub fn new(picture: &Path, over: &[PathBuf]) -> Laid {
        let absolute = |file: &Path| std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        Laid { picture: absolute(picture), over: over.iter().map(|file| absolute(file)).collect() }
    }
}

/// What says where the sun stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SunBy {
    /// It stands where it suits the land.
    #[default]
    Land,
    /// Its bearing and elevation.
    Hand,
    /// Date, time of day and place.
    Date,
}

impl SunBy {
    /// All of them.
    pub const ALL: [SunBy; 3] = [SunBy::Land, SunBy::Hand, SunBy::Date];

    /// What it is called, and what it does.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            SunBy::Land => ("As suits", "The sun stands where it suits the land"),
            SunBy::Hand => ("By hand", "Its bearing, and its height over the horizon"),
            SunBy::Date => ("By date", "Where it stands on a day at an hour, over the place of the land"),
        }
    }
}

/// All that is remembered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Of the file's format.
    pub version: u32,
    /// How the picture is drawn.
    pub style: Style,
    /// One pixel of light for so many of the window's, each way.
    pub coarse: u32,
    /// Textured, wireframe or both.
    pub show: Show,
    /// What says where the sun stands.
    pub sun: SunBy,
    /// Bearing of the sun (degrees, clockwise from north).
    pub sun_azimuth_degrees: f64,
    /// Its elevation (degrees).
    pub sun_elevation_degrees: f64,
    /// The year of the sun by date.
    pub year: i16,
    /// The day of that year, from 1.
    pub day: u16,
    /// The hour of the sun's own time there, 12 at noon.
    pub hour: f64,
    /// Where land lies that does not say so: east (degrees).
    pub longitude_degrees: f64,
    /// And north (degrees).
    pub latitude_degrees: f64,
    /// How far one sees (km); 0 for what suits the land.
    pub visibility_kilometres: f64,
    /// The sea's state, as it is typed.
    pub sea: String,
    /// Whether there are waves at all.
    pub waves: bool,
    /// By how much heights are stretched.
    pub exaggeration: f64,
    /// Multiplies all speeds.
    pub speed: f64,
    /// Vertical angle of view (degrees).
    pub field_degrees: f64,
    /// What carries the eye.
    pub mode: Mode,
    /// Whether the eye may go below the surface.
    pub below: bool,
    /// Whether the panel is open.
    pub panel: bool,
    /// How long a frame may take (ms): the tolerance follows; 0 for as long as it takes.
    pub budget_milliseconds: f64,
    /// Which pictures are shown of two methods.
    pub split: Split,
    /// By how much differences are amplified.
    pub gain: f64,
    /// How triangles are chosen.
    pub first: Detail,
    /// And those of the second picture.
    pub second: Detail,
    /// The picture of the ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub laid: Option<Laid>,
}

/// The newest version of the file.
const VERSION: u32 = 1;

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            version: VERSION,
            style: Style::default(),
            coarse: 1,
            show: Show::default(),
            sun: SunBy::Land,
            sun_azimuth_degrees: 240.0,
            sun_elevation_degrees: 25.0,
            year: 2026,
            day: 172,
            hour: 17.0,
            longitude_degrees: 10.0,
            latitude_degrees: 50.0,
            visibility_kilometres: 0.0,
            sea: "beaufort=4,from=225".to_owned(),
            waves: true,
            exaggeration: 1.0,
            speed: 1.0,
            field_degrees: 45.0,
            mode: Mode::Fly,
            below: false,
            panel: true,
            budget_milliseconds: 0.0,
            split: Split::Off,
            gain: 8.0,
            first: Detail::default(),
            second: Detail { method: Method::Whole, ..Detail::default() },
            laid: None,
        }
    }
}

impl Settings {
    /// Where they are kept, if the user has a place for such.
    pub fn file() -> Option<PathBuf> {
        Some(directories::ProjectDirs::from("", "", "littoral")?.config_dir().join("fly.toml"))
    }

    /// The settings of a file, and what is to be said about it. A file that is not there says nothing; one that is broken, or of a newer version, gives
    /// the defaults.
    pub fn load(file: &Path) -> (Settings, Option<String>) {
        let complaint = |problem: String| {
            let message = format!("{}: {problem}; the usual settings are taken", file.display());
            (Settings::default(), Some(message))
        };
        let text = match std::fs::read_to_string(file) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return (Settings::default(), None),
            Err(error) => return complaint(format!("expected a readable file of settings, got \"{error}\"")),
        };
        match toml::from_str::<Settings>(&text) {
            Ok(settings) if settings.version == VERSION => settings.sound(file),
            Ok(settings) => complaint(format!("expected version {VERSION} of the settings, got {}", settings.version)),
            Err(error) => {
                let what = error.message().lines().next().unwrap_or_default().to_owned();
                complaint(format!("expected settings, got an error: {what}"))
            }
        }
    }

    /// With what is out of range put right.
    fn sound(mut self, file: &Path) -> (Settings, Option<String>) {
        let mut wrong = Vec::new();
        let usual = Settings::default();
        let mut number = |name: &str, value: &mut f64, usual: f64, low: f64, high: f64| {
            within(name, value, usual, low..=high, &mut wrong);
        };
        number("budget_milliseconds", &mut self.budget_milliseconds, usual.budget_milliseconds, 0.0, 10_000.0);
        number("gain", &mut self.gain, usual.gain, 1.0, 255.0);
        number("sun_azimuth_degrees", &mut self.sun_azimuth_degrees, usual.sun_azimuth_degrees, 0.0, 360.0);
        number("sun_elevation_degrees", &mut self.sun_elevation_degrees, usual.sun_elevation_degrees, -90.0, 90.0);
        number("visibility_kilometres", &mut self.visibility_kilometres, usual.visibility_kilometres, 0.0, 1000.0);
        number("hour", &mut self.hour, usual.hour, 0.0, 24.0);
        number("longitude_degrees", &mut self.longitude_degrees, usual.longitude_degrees, -180.0, 180.0);
        number("latitude_degrees", &mut self.latitude_degrees, usual.latitude_degrees, -90.0, 90.0);
        number("exaggeration", &mut self.exaggeration, usual.exaggeration, 0.01, 1000.0);
        number("speed", &mut self.speed, usual.speed, 0.01, 100.0);
        number("field_degrees", &mut self.field_degrees, usual.field_degrees, 5.0, 120.0);
        within("coarse", &mut self.coarse, usual.coarse, 1..=8, &mut wrong);
        self.first.put_right("first", &mut wrong);
        self.second.put_right("second", &mut wrong);
        let message = (!wrong.is_empty())
            .then(|| format!("{}: {} out of range; the usual taken", file.display(), wrong.join(", ")));
        (self, message)
    }

    /// Saves them, whole or not at all.
    pub fn save(&self, file: &Path) -> Result<(), String> {
        let problem = |e: &dyn std::fmt::Display| format!("the settings could not be saved: {e}");
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).map_err(|e| problem(&e))?;
        }
        let text = toml::to_string(self).map_err(|e| problem(&e))?;
        littoral_data::write::whole(file, |sink| sink.write_all(text.as_bytes())).map_err(|e| problem(&e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_come_back_as_they_were() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("deep/fly.toml");
        assert_eq!(Settings::load(&file), (Settings::default(), None), "none yet, nothing to say");
        let settings = Settings {
            first: Detail { method: Method::Roam, ..Detail::default() },
            second: Detail { tolerance_pixels: 0.2, ..Detail::default() },
            split: Split::Halves,
            show: Show::Both,
            style: Style::Plain,
            sun: SunBy::Date,
            sea: "wind=14,from=300".into(),
            exaggeration: 2.5,
            mode: Mode::Boat,
            ..Settings::default()
        };
        settings.save(&file).expect("saved");
        assert_eq!(Settings::load(&file), (settings, None));
    }

    #[test]
    fn broken_settings_are_the_usual_ones_and_said_so() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("fly.toml");
        let load = |text: &[u8]| {
            std::fs::write(&file, text).expect("written");
            Settings::load(&file)
        };
        for text in [
            &b"version = 99"[..],
            b"metod = \"roam\"",
            b"first.method = \"rome\"",
            b"speed = \"fast\"",
            b"\xff\xfe",
            b"= =",
        ] {
            let (settings, message) = load(text);
            assert_eq!(settings, Settings::default());
            let message = message.expect("a message");
            assert!(message.contains("fly.toml") && message.contains("expected"), "{message}");
            assert!(!message.contains('\n'), "{message}");
        }
        // What is missing has its usual value, what is out of range too.
        let (settings, message) =
            load(b"first.method = \"strips\"\nspeed = nan\nfirst.triangles = 5\nfield_degrees = 60");
        assert_eq!(
            settings,
            Settings {
                first: Detail { method: Method::Strips, ..Detail::default() },
                field_degrees: 60.0,
                ..Settings::default()
            }
        );
        assert!(message.is_some_and(|m| m.contains("speed, first.triangles")));
        assert_eq!(load(b""), (Settings::default(), None));
    }
}
