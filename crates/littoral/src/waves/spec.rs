//! Sea states written in a line.
//!
//! `wind=15,from=240,model=jonswap,fetch=300,gamma=3.3,spread=hasselmann,swell=2@12/300,seed=7`; `hs=2,tp=8` instead of a wind; the name of a
//! state, `beaufort=6` or `douglas=4`, alone or with others of these; or `calm`.

use super::state::{Train, heading_from_bearing};
use super::{OutOfRange, SeaState, Spectrum, Spreading, StillWater};
use std::str::FromStr;

/// Why a line is not a sea state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// A word that means nothing here.
    #[error("`{0}`: expected `calm` or KEY=VALUE with KEY one of {KEYS}")]
    Word(String),
    /// A value that cannot be read.
    #[error("`{key}={value}`: expected {expected}")]
    Value {
        /// The key.
        key: String,
        /// What was given for it.
        value: String,
        /// What was expected.
        expected: &'static str,
    },
    /// Keys that contradict one another.
    #[error("`{0}` and `{1}` cannot both be given; leave one out")]
    Both(&'static str, &'static str),
    /// A key that needs another.
    #[error("`{0}` needs `{1}`, too")]
    Needs(&'static str, &'static str),
    /// A number that makes no sense.
    #[error(transparent)]
    Range(#[from] OutOfRange),
}

const KEYS: &str = "wind, from, fetch, model, gamma, hs, tp, spread, swell, depth, breaking, seed, beaufort, douglas";

/// Fetch where none is told (m).
const USUAL_FETCH: f64 = 300e3;

/// Wind (m/s) over waves that need none.
const BREEZE: f64 = 2.5;

#[derive(Default)]
struct Fields {
    wind: Option<f64>,
    from: Option<f64>,
    fetch: Option<f64>,
    model: Option<Model>,
    gamma: Option<f64>,
    hs: Option<f64>,
    tp: Option<f64>,
    spread: Option<String>,
    swells: Vec<(f64, f64, f64)>,
    depth: Option<f64>,
    breaking: Option<f64>,
    seed: Option<u64>,
    beaufort: Option<f64>,
    douglas: Option<f64>,
}

#[derive(Clone, Copy, PartialEq)]
enum Model {
    PiersonMoskowitz,
    Jonswap,
    Tma,
}

impl FromStr for SeaState {
    type Err = SpecError;

    fn from_str(line: &str) -> Result<SeaState, SpecError> {
        let mut fields = Fields::default();
        for word in line.split(',').map(str::trim).filter(|w| !w.is_empty() && *w != "calm") {
            fields.read(word)?;
        }
        if line.trim().is_empty() {
            return Err(SpecError::Word(String::new()));
        }
        fields.state()
    }
}

impl Fields {
    fn read(&mut self, word: &str) -> Result<(), SpecError> {
        let (key, value) = word.split_once('=').ok_or_else(|| SpecError::Word(word.to_owned()))?;
        let wrong = |expected| SpecError::Value { key: key.to_owned(), value: value.to_owned(), expected };
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
        let some = |expected| number(value).map(Some).ok_or_else(|| wrong(expected));
        match key.trim() {
            "wind" => self.wind = some("m/s, above 0 and at most 120")?,
            "from" => self.from = some("degrees clockwise from north, 0 to 360")?,
            "fetch" => self.fetch = some("kilometres, above 0")?,
            "gamma" => self.gamma = some("a number from 1 to 20")?,
            "hs" => self.hs = some("metres, from 0 to 100")?,
            "tp" => self.tp = some("seconds, above 0 and at most 100")?,
            "depth" => self.depth = some("a number of metres above 0")?,
            "breaking" => self.breaking = some("a height over depth from 0.1 to 2")?,
            "beaufort" => self.beaufort = some("a number from 0 to 12")?,
            "douglas" => self.douglas = some("a degree from 0 to 9")?,
            "seed" => self.seed = Some(value.trim().parse().map_err(|_| wrong("a whole number, at least 0"))?),
            "spread" => self.spread = Some(value.trim().to_owned()),
            "model" => {
                self.model = Some(match value.trim() {
                    "pm" => Model::PiersonMoskowitz,
                    "jonswap" => Model::Jonswap,
                    "tma" => Model::Tma,
                    _ => return Err(wrong("pm, jonswap or tma")),
                });
            }
            "swell" => {
                let parts = value.split_once('@').and_then(|(height, rest)| {
                    let (period, from) = rest.split_once('/')?;
                    Some((number(height)?, number(period)?, number(from)?))
                });
                self.swells.push(parts.ok_or_else(|| wrong("HEIGHT@PERIOD/FROM, as in 2@12/300"))?);
            }
            _ => return Err(SpecError::Word(word.to_owned())),
        }
        Ok(())
    }

    /// The state they describe.
    fn state(&self) -> Result<SeaState, SpecError> {
        let from = self.from.unwrap_or(270.0);
        OutOfRange::unless((-360.0..=360.0).contains(&from), "from", "degrees clockwise from north, 0 to 360", from)?;
        let heading = heading_from_bearing(from);
        let sources = [("beaufort", self.beaufort), ("douglas", self.douglas), ("wind", self.wind), ("hs", self.hs)];
        let mut given = sources.iter().filter(|(_, value)| value.is_some()).map(|(name, _)| *name);
        if let (Some(first), Some(second)) = (given.next(), given.next())
            && (first, second) != ("wind", "hs")
        {
            return Err(SpecError::Both(first, second));
        }
        let mut state = if let Some(number) = self.beaufort {
            SeaState::beaufort(number, heading)?
        } else if let Some(degree) = self.douglas {
            SeaState::douglas(degree, heading)?
        } else {
            self.by_numbers(heading)?
        };
        for &(height, period, from) in &self.swells {
            state = state.with_swell(height, period, heading_from_bearing(from))?;
        }
        if let Some(depth) = self.depth {
            StillWater::of_depth(depth)?;
            state.depth = depth;
        }
        let spreading = self.spread.as_deref().map(|name| spreading(name, &state)).transpose()?;
        // Named states and winds are those of a deep sea; in water of a depth the longest waves have broken.
        let shallow = self.model == Some(Model::Tma);
        if shallow && self.depth.is_none() {
            return Err(SpecError::Needs("model=tma", "depth=METRES"));
        }
        let first = usize::from(!state.trains.is_empty());
        for train in &mut state.trains[..first] {
            if let Train::Formula { spectrum, spreading: own, .. } = train {
                *own = spreading.unwrap_or(*own);
                if shallow {
                    *spectrum = spectrum.in_depth(state.depth);
                }
            }
        }
        state.breaking = self.breaking.unwrap_or(state.breaking);
        state.seed = self.seed.unwrap_or(0);
        Ok(state.checked()?)
    }

    /// A sea given by wind, or by height and period.
    fn by_numbers(&self, heading: f64) -> Result<SeaState, SpecError> {
        let gamma = self.gamma.unwrap_or(3.3);
        if let Some(fetch) = self.fetch {
            OutOfRange::unless(fetch > 0.0 && fetch < 1e6, "fetch", "kilometres, above 0", fetch)?;
        }
        let fetch = self.fetch.map_or(USUAL_FETCH, |km| km * 1000.0);
        let grown = self.model == Some(Model::PiersonMoskowitz);
        let spectrum = match (self.wind, self.hs, self.tp) {
            (_, Some(hs), tp) if hs > 0.0 || tp.is_some() => match (grown, tp) {
                (true, None) => Spectrum::pierson_moskowitz_of_height(hs)?,
                (true, Some(tp)) => Spectrum::of_height_and_period(hs, tp, 1.0)?,
                (false, Some(tp)) => Spectrum::of_height_and_period(hs, tp, gamma)?,
                (false, None) => return Err(SpecError::Needs("hs", "tp=SECONDS")),
            },
            (_, None, Some(_)) => return Err(SpecError::Needs("tp", "hs=METRES")),
            (Some(wind), ..) if wind != 0.0 => match grown {
                true => Spectrum::pierson_moskowitz(wind)?,
                false => Spectrum::jonswap(wind, fetch, gamma)?,
            },
            _ => return Ok(SeaState::CALM),
        };
        let mut state = SeaState::CALM;
        let speed = self.wind.unwrap_or_else(|| spectrum.raising_wind().clamp(BREEZE, 60.0));
        state.wind = super::Wind { speed, heading };
        state.trains.push(Train::Formula { spectrum, spreading: Spreading::Hasselmann, heading });
        Ok(state)
    }
}

fn spreading(name: &str, state: &SeaState) -> Result<Spreading, SpecError> {
    let wrong = || SpecError::Value {
        key: "spread".to_owned(),
        value: name.to_owned(),
        expected: "hasselmann, mitsuyasu, donelan-banner, or cos2s:S as in cos2s:10",
    };
    match name {
        "hasselmann" => Ok(Spreading::Hasselmann),
        "donelan-banner" => Ok(Spreading::DonelanBanner),
        "mitsuyasu" => {
            let peak = state.peak().unwrap_or(0.1);
            Ok(Spreading::mitsuyasu(state.wind.speed.max(0.1), peak))
        }
        _ => {
            let s = name.strip_prefix("cos2s:").and_then(|s| s.parse::<f64>().ok()).ok_or_else(wrong)?;
            OutOfRange::unless((0.0..=1000.0).contains(&s), "spread=cos2s", "an exponent from 0 to 1000", s)?;
            Ok(Spreading::HalfAngle { s })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> SeaState {
        line.parse().unwrap_or_else(|e| panic!("{line}: {e}"))
    }

    #[test]
    fn lines_mean_what_they_say() {
        let state = read("wind=15,from=240,model=jonswap,fetch=300,gamma=3.3,spread=hasselmann,swell=2@12/300,seed=7");
        assert_eq!((state.trains.len(), state.seed, state.wind.speed), (2, 7, 15.0));
        assert!((state.wind.heading.to_degrees() - 30.0).abs() < 1e-9);
        assert!((5.5..6.5).contains(&state.significant_height()), "{}", state.significant_height());
        assert!((read("hs=2,tp=8").significant_height() - 2.0).abs() < 0.01);
        assert!((8.0..14.0).contains(&read("hs=4,tp=9").wind.speed) && read("hs=1,tp=12").wind.speed < 3.0);
        assert!((read("hs=2,model=pm").significant_height() - 2.0).abs() < 0.01);
        assert!(
            read("calm").trains.is_empty() && read("wind=0").trains.is_empty() && read("beaufort=0").trains.is_empty()
        );
        assert!((read("beaufort=8").significant_height() - 5.5).abs() < 1e-3);
        assert!((read("douglas=4,from=90").significant_height() - 1.875).abs() < 1e-3);
        assert!(read("wind=12,model=tma,depth=6").significant_height() < read("wind=12").significant_height());
        assert_eq!((read("hs=2,tp=8").breaking, read("hs=2,tp=8,breaking=0.5").breaking), (0.78, 0.5));
        for line in ["wind=9,spread=mitsuyasu", "wind=9,spread=donelan-banner", "wind=9,spread=cos2s:20"] {
            assert_ne!(read(line), read("wind=9"), "{line}");
        }
    }

    #[test]
    fn states_rise_from_name_to_name() {
        let mut before = 0.0;
        for number in 1..=12 {
            let state = SeaState::beaufort(f64::from(number), 0.0).expect("a number");
            assert!(state.significant_height() > before);
            before = state.significant_height();
            let period = 1.0 / state.peak().expect("waves");
            assert!((0.4..20.0).contains(&period), "beaufort {number}: {period} s");
        }
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        let error = |line: &str| line.parse::<SeaState>().expect_err(line).to_string();
        assert_eq!(error("wind=abc"), "`wind=abc`: expected m/s, above 0 and at most 120");
        assert_eq!(error("wind=NaN"), "`wind=NaN`: expected m/s, above 0 and at most 120");
        assert_eq!(error("wind=-4"), "wind: expected m/s, above 0 and at most 120, got -4");
        assert_eq!(error("wind=900"), "wind: expected m/s, above 0 and at most 120, got 900");
        assert_eq!(error("beaufort=13"), "beaufort: expected a number from 0 to 12, got 13");
        assert_eq!(error("depth=0,wind=5"), "depth: expected a number of metres above 0, got 0");
        assert_eq!(error("wind=5,breaking=3"), "breaking: expected a height over depth from 0.1 to 2, got 3");
        assert_eq!(error("beaufort=3,douglas=4"), "`beaufort` and `douglas` cannot both be given; leave one out");
        assert_eq!(error("model=tma,wind=9"), "`model=tma` needs `depth=METRES`, too");
        assert!(error("storm").contains("expected `calm` or KEY=VALUE"));
        assert!(error("swell=2").contains("2@12/300") && error("model=x").contains("pm, jonswap or tma"));
        assert!(error("spread=wide").contains("hasselmann") && error("").contains("KEY=VALUE"));
        assert!(error("tp=5").contains("needs `hs=METRES`") && error("seed=-1").contains("whole number"));
    }
}
