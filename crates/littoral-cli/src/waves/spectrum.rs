//! `littoral waves spectrum`: how much energy waves of each frequency and direction hold.

use super::picture::{Polar, Rise};
use super::state::{self, Choice};
use super::summary::{self, Summary};
use super::{bearing, digits, whole};
use crate::input;
use crate::plot;
use crate::talk::{Failure, Talk, tidy};
use glam::UVec2;
use littoral::waves::spec::SpecError;
use littoral::waves::{SeaState, Spectrum as Formula, Train};
use littoral_data::waves::Buoy;
use littoral_data::write;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// How much energy the waves of each frequency hold: of a wind, of a height and period, of a sea state, or as a buoy measured it.
///
/// Without --out a table: frequency, period, energy density S, and the direction from which the waves come with its spread. With --out a plot
/// (.png, .svg) or the table (.csv); with --polar by direction, too. Heights and periods are integrals of the spectrum itself, so they may differ a
/// little from those it was made by.
#[derive(clap::Args)]
#[command(
    group(clap::ArgGroup::new("sea_source").args(["wind", "hs", "sea", "buoy"])),
    after_help = "Examples:
  littoral waves spectrum --wind 15                               a growing sea, 300 km of fetch
  littoral waves spectrum --model pm --wind 15                    full-grown (Pierson-Moskowitz)
  littoral waves spectrum --wind 12 --fetch 40 --gamma 5          off a coast 40 km upwind
  littoral waves spectrum --hs 2 --tp 8 --f 0.1,0.125,0.15 --json just these frequencies
  littoral waves spectrum --model tma --hs 3 --tp 10 --depth 8    in 8 m of water
  littoral waves spectrum --sea wind=10,from=240,swell=2@14/300 --out sea.svg
  littoral waves spectrum --buoy 41010.data_spec --out sea.png    what a buoy measured last
  littoral waves spectrum --buoy 41010w2019.txt.gz --list         what there is in a file
  littoral waves spectrum --buoy 41010w2019.txt.gz --record 2019-02-06T00:40 --polar --out rose.png

A buoy's files are NDBC's: any of 41010.data_spec .swdir .swdir2 .swr1 .swr2, or of 41010w2019.txt
and its like with d, i, j, k; the others are found beside it. With words of a sea state beside:
--sea buoy=41010.data_spec,record=latest,swell=2@12/300.

JSON: f (Hz), S (m²/Hz), directions and spreads (degrees, one for each f); hs (m), tp, tm01, tm02,
te (s), mean_direction, peak_direction, spread (degrees); source; time for a buoy. Directions are
compass bearings from which waves come. With --list: records of time and the same numbers."
)]
pub struct Spectrum {
    /// Which formula [default: jonswap]
    #[arg(long, value_enum, value_name = "MODEL", help_heading = "The sea")]
    model: Option<Model>,
    /// Wind speed 10 m above the sea (m/s)
    #[arg(long, value_name = "U10", value_parser = input::number, help_heading = "The sea")]
    wind: Option<f64>,
    /// Significant wave height (m)
    #[arg(long, value_name = "H", value_parser = input::number, help_heading = "The sea")]
    hs: Option<f64>,
    /// Period of the peak (s)
    #[arg(long, value_name = "T", value_parser = input::number, requires = "hs", help_heading = "The sea")]
    tp: Option<f64>,
    /// How much the peak stands out: 1 to 20, or `auto` for what DNV gives to a height and period [default: 3.3]
    #[arg(long, value_name = "GAMMA", value_parser = gamma, help_heading = "The sea")]
    gamma: Option<Gamma>,
    /// How far the wind has blown over water (km) [default: 300]
    #[arg(long, value_name = "KM", value_parser = input::number, requires = "wind", help_heading = "The sea")]
    fetch: Option<f64>,
    /// Depth of the water (m), for tma
    #[arg(long, value_name = "D", value_parser = input::number, help_heading = "The sea", conflicts_with_all = ["sea", "buoy"])]
    depth: Option<f64>,
    /// Compass bearing from which the waves come (degrees) [default: 270]
    #[arg(long, value_name = "BEARING", value_parser = input::number, help_heading = "The sea", conflicts_with_all = ["sea", "buoy"])]
    from: Option<f64>,
    /// How directions spread: hasselmann, mitsuyasu, donelan-banner, or cos2s:S [default: hasselmann]
    #[arg(long, value_name = "NAME", help_heading = "The sea", conflicts_with_all = ["sea", "buoy"])]
    spread: Option<String>,
    /// A sea state: wind=15,from=240,swell=2@12/300; beaufort=6; buoy=FILE
    #[arg(long, value_name = "SPEC", help_heading = "The sea", conflicts_with_all = ["model", "gamma"])]
    sea: Option<String>,
    /// Spectra measured by a buoy: any of NDBC's files of a station
    #[arg(long, value_name = "FILE", help_heading = "The sea", conflicts_with_all = ["model", "gamma"])]
    buoy: Option<PathBuf>,
    /// Which record: a number from 1 (-1: the last), latest, or a time (UTC) such as 2019-02-06T00:40 [default: latest]
    #[arg(long, value_name = "RECORD", value_parser = state::choice, requires = "buoy", help_heading = "The sea")]
    record: Option<Choice>,
    /// All records of the buoy, a line each
    #[arg(long, requires = "buoy", conflicts_with_all = ["record", "f", "polar", "out"])]
    list: bool,
    /// At which frequencies (Hz): a list F1,F2,… or LOW:STEP:HIGH [default: a buoy's own, or some round ones about the peak]
    #[arg(long, value_name = "F1,F2,…", value_parser = frequencies)]
    f: Option<Frequencies>,
    /// By direction, too: a polar plot, or a table of frequency, bearing and density
    #[arg(long, requires = "out")]
    polar: bool,
    /// A plot (.png, .svg) or a table (.csv)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Size of a plot in pixels [default: 1280x720; polar 1000x900]
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = input::size)]
    size: Option<UVec2>,
}

#[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum)]
enum Model {
    /// Pierson and Moskowitz: a full-grown sea
    Pm,
    /// JONSWAP: a growing sea
    Jonswap,
    /// TMA: a growing sea in water of a depth
    Tma,
}

impl Model {
    fn word(self) -> &'static str {
        match self {
            Model::Pm => "pm",
            Model::Jonswap => "jonswap",
            Model::Tma => "tma",
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Gamma {
    Usual,
    Is(f64),
}

fn gamma(text: &str) -> Result<Gamma, String> {
    match text.trim() {
        "auto" => Ok(Gamma::Usual),
        text => input::within(text, 1.0, 20.0, "a number from 1 to 20, or auto").map(Gamma::Is),
    }
}

#[derive(Clone, Debug)]
struct Frequencies(Vec<f64>);

/// No more frequencies are asked for in one go.
const MOST: usize = 10_000;

fn frequencies(text: &str) -> Result<Frequencies, String> {
    let wrong = |got: &str| {
        Err(format!(
            "expected frequencies in Hz, 0 to 1000, as F1,F2,… or LOW:STEP:HIGH such as 0.02:0.01:0.5, got \"{got}\""
        ))
    };
    let number = |word: &str| word.trim().parse::<f64>().ok().filter(|f| (0.0..=1000.0).contains(f));
    let range: Vec<&str> = text.trim().split(':').collect();
    if let [low, step, high] = range[..] {
        let (Some(low), Some(step), Some(high)) = (number(low), number(step), number(high)) else { return wrong(text) };
        let count = ((high - low) / step + 1e-6).floor() + 1.0;
        if high < low || step <= 0.0 || count > MOST as f64 {
            return wrong(text);
        }
        // Rounded, so that 0.02 + 0.01 is 0.03.
        let round = |f: f64| format!("{f:.12}").parse().unwrap_or(f);
        return Ok(Frequencies((0..count as usize).map(|i| round(low + step * i as f64)).collect()));
    }
    let words: Vec<&str> = text.split(',').collect();
    if words.len() > MOST {
        return wrong(&format!("{} of them", words.len()));
    }
    words.into_iter().map(|word| number(word).ok_or(word)).collect::<Result<_, _>>().map(Frequencies).or_else(wrong)
}

/// A sea, and what it is called.
struct Sea {
    state: SeaState,
    title: String,
    time: Option<String>,
}

#[derive(Serialize)]
struct Answer<'a> {
    f: &'a [f64],
    #[serde(rename = "S")]
    density: Vec<f64>,
    directions: Vec<Option<f64>>,
    spreads: Vec<Option<f64>>,
    #[serde(flatten)]
    summary: Summary,
    source: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
}

impl Spectrum {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let ending = self.out.as_deref().map(|out| plot::ending(out, &["csv", "svg", "png"])).transpose()?;
        if let (true, Some(file)) = (self.list, &self.buoy) {
            return list(file, talk);
        }
        let sea = self.sea(talk)?;
        let summary = Summary::of(&sea.state);
        let f = match &self.f {
            Some(Frequencies(f)) => f.clone(),
            None => usual_frequencies(&sea.state),
        };
        let (directions, spreads) = f.iter().map(|f| summary::directions(&sea.state, *f)).unzip();
        let density = f.iter().map(|f| sea.state.density(*f)).collect();
        let file = self.out.as_deref().map(|out| out.display().to_string());
        let time = sea.time.as_deref();
        let answer = Answer { f: &f, density, directions, spreads, summary, source: &sea.title, time, file };
        if let (Some(out), Some(kind)) = (&self.out, ending) {
            self.save(&sea, &answer, out, kind)?;
        }
        if talk.json() {
            return talk.print_json(answer);
        }
        match &self.out {
            Some(out) => talk.print(format!("{}: {}; {}\n", out.display(), sea.title, answer.summary.told())),
            None => talk.print(answer.table()),
        }
    }

    fn save(&self, sea: &Sea, answer: &Answer, out: &Path, kind: &str) -> Result<(), Failure> {
        let usual = if self.polar { UVec2::new(1000, 900) } else { UVec2::new(1280, 720) };
        let size = self.size.unwrap_or(usual);
        let (title, below) = (sea.title.clone(), answer.summary.told());
        let range = self.f.as_ref().and_then(|Frequencies(f)| {
            let (low, high) = (f.iter().copied().fold(f64::INFINITY, f64::min), f.iter().copied().fold(0.0, f64::max));
            (low < high).then_some((low, high))
        });
        match (kind, self.polar) {
            ("csv", polar) => {
                let text = if polar { polar_csv(&sea.state, answer.f) } else { answer.csv() };
                Ok(write::whole(out, |sink| sink.write_all(text.as_bytes()))?)
            }
            (_, true) => {
                let polar = Polar::new(&sea.state, title, below, size, range.map(|(_, high)| high));
                plot::save(out, kind, size, &|canvas| polar.draw(canvas))
            }
            (_, false) => {
                let rise = Rise::new(&sea.state, title, below, size, range);
                plot::save(out, kind, size, &|canvas| rise.draw(canvas))
            }
        }
    }

    /// The sea that is meant.
    fn sea(&self, talk: &mut Talk) -> Result<Sea, Failure> {
        if let Some(file) = &self.buoy {
            let buoy = Buoy::open(file)?;
            let record = state::record(&buoy, file, self.record.unwrap_or(Choice::Latest), talk)?;
            let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
            let time = record.time.to_string();
            let title = format!("{name}, {}", time.replace('T', " ").replace('Z', " UTC"));
            return Ok(Sea { state: state::of_record(record), title, time: Some(time) });
        }
        if let Some(spec) = &self.sea {
            return Ok(Sea { state: state::read(spec, talk)?, title: spec.clone(), time: None });
        }
        let usage = |problem: &str| Err(Failure::Usage(problem.to_owned()));
        let model = self.model.unwrap_or(Model::Jonswap);
        if self.wind.is_none() && self.hs.is_none() {
            return usage(
                "expected a sea (--wind U10, --hs H --tp T, --sea SPEC or --buoy FILE), got none; add one, or see `littoral waves spectrum --help`",
            );
        }
        if self.hs.is_some() && self.tp.is_none() && model != Model::Pm {
            return usage(
                "expected --tp SECONDS beside --hs, got none; add it, or take the full-grown sea of that height: --model pm",
            );
        }
        if model == Model::Pm && (self.fetch.is_some() || self.gamma.is_some()) {
            return usage(
                "expected neither --fetch nor --gamma for a full-grown sea, got one; leave it out, or take --model jonswap",
            );
        }
        if model == Model::Tma && self.depth.is_none() {
            return usage("expected --depth METRES for --model tma, got none; add it");
        }
        if model != Model::Tma && self.depth.is_some() {
            talk.warn("--depth changes the spectrum of --model tma only");
        }
        let gamma = match (self.gamma, self.hs, self.tp) {
            (Some(Gamma::Is(gamma)), ..) => Some(gamma),
            (Some(Gamma::Usual), Some(hs), Some(tp)) if hs > 0.0 && tp > 0.0 => Some(Formula::usual_gamma(hs, tp)),
            (Some(Gamma::Usual), ..) => {
                return usage("expected --hs and --tp for --gamma auto, got a wind; name a number");
            }
            (None, ..) => None,
        };
        if self.wind.is_some_and(|wind| wind <= 0.0) || self.hs.is_some_and(|hs| hs <= 0.0) {
            let (what, got) = self.wind.map_or(("significant height (m)", self.hs), |wind| ("wind (m/s)", Some(wind)));
            let got = got.unwrap_or(0.0);
            return usage(&format!("{what}: expected a number above 0, got {got}; a flat sea is --sea calm"));
        }
        let mut line = format!("model={}", model.word());
        let numbers = [
            ("wind", self.wind),
            ("hs", self.hs),
            ("tp", self.tp),
            ("gamma", gamma),
            ("fetch", self.fetch),
            ("depth", self.depth),
            ("from", self.from),
        ];
        for (key, value) in numbers {
            if let Some(value) = value {
                // Writing to a string does not fail.
                let _ = write!(line, ",{key}={value}");
            }
        }
        if let Some(spread) = &self.spread {
            let _ = write!(line, ",spread={spread}");
        }
        let state: SeaState =
            line.parse().map_err(|error: SpecError| Failure::Usage(format!("{error}; correct the command line")))?;
        Ok(Sea { title: self.title(model, gamma), state, time: None })
    }

    fn title(&self, model: Model, gamma: Option<f64>) -> String {
        let mut title = match model {
            Model::Pm => "Pierson–Moskowitz".to_owned(),
            Model::Jonswap => "JONSWAP".to_owned(),
            Model::Tma => "TMA".to_owned(),
        };
        if let Some(wind) = self.wind {
            let _ = write!(title, ", wind {} m/s", digits(wind, 4));
            if model != Model::Pm {
                let _ = write!(title, " over {} km", digits(self.fetch.unwrap_or(300.0), 4));
            }
        }
        if let Some(hs) = self.hs {
            let _ = write!(title, ", Hs {} m", digits(hs, 4));
        }
        if let Some(tp) = self.tp {
            let _ = write!(title, ", Tp {} s", digits(tp, 4));
        }
        if model != Model::Pm {
            let _ = write!(title, ", γ {}", digits(gamma.unwrap_or(3.3), 3));
        }
        if let (Model::Tma, Some(depth)) = (model, self.depth) {
            let _ = write!(title, ", {} m deep", digits(depth, 4));
        }
        title
    }
}

impl Summary {
    /// In a line.
    pub fn told(&self) -> String {
        let Some(tp) = self.tp else { return "no waves".into() };
        let seconds = |period: Option<f64>| period.map_or("-".into(), |period| digits(period, 3));
        let mut line = format!("Hs {} m, Tp {} s, Tm02 {} s", digits(self.hs, 3), digits(tp, 3), seconds(self.tm02));
        match (self.mean_direction, self.spread) {
            (Some(from), Some(spread)) => {
                let _ = write!(line, ", from {}, spread {spread:.0}°", bearing(from));
            }
            _ => line += ", from all round",
        }
        line
    }
}

impl Answer<'_> {
    fn table(&self) -> String {
        let mut text = format!("{}\n{}\n", self.source, self.summary.told());
        let seconds = |period: Option<f64>| period.map_or("-".into(), |period| digits(period, 4));
        let Summary { tm01, te, peak_direction, .. } = &self.summary;
        let _ = write!(text, "Tm01 {} s, energy period {} s", seconds(*tm01), seconds(*te));
        if let Some(from) = peak_direction {
            let _ = write!(text, ", waves of the peak from {}", bearing(*from));
        }
        text += "\n\n  f (Hz)    T (s)   S (m²/Hz)   from (°)   spread (°)\n";
        for (i, &f) in self.f.iter().enumerate() {
            let from = self.directions[i].map_or("-".to_owned(), |from| whole(from).to_string());
            let spread = self.spreads[i].map_or("-".to_owned(), |spread| format!("{spread:.0}"));
            let (shown, period, density) = (tidy(f, 6), digits(1.0 / f, 3), digits(self.density[i], 4));
            let _ = writeln!(text, "{shown:>8} {period:>8} {density:>11} {from:>10} {spread:>12}");
        }
        text
    }

    fn csv(&self) -> String {
        let mut text = String::from("frequency,density,from,spread\n");
        for (i, f) in self.f.iter().enumerate() {
            let degrees = |value: Option<f64>| value.map_or(String::new(), |value| tidy(value, 2));
            let (from, spread) = (degrees(self.directions[i]), degrees(self.spreads[i]));
            let _ = writeln!(text, "{},{},{from},{spread}", tidy(*f, 6), self.density[i]);
        }
        text
    }
}

/// Density by frequency and direction (m²/Hz/degree), a line each, every 5°.
fn polar_csv(state: &SeaState, frequencies: &[f64]) -> String {
    let mut text = String::from("frequency,from,density\n");
    for &f in frequencies {
        let slice = state.slice(f);
        for from in (0..360).step_by(5) {
            let heading = littoral::waves::heading_from_bearing(f64::from(from));
            let _ = writeln!(text, "{},{from},{}", tidy(f, 6), slice.density(heading).to_radians());
        }
    }
    text
}

/// A buoy's own frequencies; of formulas round ones from before the peak to four times it.
fn usual_frequencies(state: &SeaState) -> Vec<f64> {
    if let [Train::Measured(sea)] = &state.trains[..] {
        return sea.bands().iter().map(|band| band.frequency).collect();
    }
    let peaks = || state.trains.iter().map(Train::peak);
    let (lowest, highest) = (peaks().fold(f64::INFINITY, f64::min), peaks().fold(0.0, f64::max));
    if highest <= 0.0 {
        return (1..=10).map(|i| f64::from(i) * 0.05).collect();
    }
    let steps = plot::ticks(0.4 * lowest, 4.0 * highest, 40.0);
    steps.into_iter().filter(|f| *f > 0.0).map(|f| format!("{f:.9}").parse().unwrap_or(f)).collect()
}

/// One line for each record of a buoy.
fn list(file: &Path, talk: &mut Talk) -> Result<(), Failure> {
    #[derive(Serialize)]
    struct Line {
        time: String,
        #[serde(flatten)]
        summary: Summary,
    }
    #[derive(Serialize)]
    struct Lines {
        records: Vec<Line>,
    }
    let buoy = Buoy::open(file)?;
    buoy.warnings().iter().for_each(|warning| talk.warn(warning));
    let mut records = Vec::new();
    let mut failed = None;
    for index in 0..buoy.count() {
        match buoy.record(index) {
            Ok(record) => {
                let time = record.time.to_string();
                records.push(Line { time, summary: Summary::of(&state::of_record(record)) });
            }
            // A broken record does not spoil the list.
            Err(error) => {
                talk.warn(error.to_string());
                failed = Some(error);
            }
        }
    }
    if let (true, Some(error)) = (records.is_empty(), failed) {
        return Err(error.into());
    }
    if talk.json() {
        return talk.print_json(Lines { records });
    }
    let mut text = String::from("time (UTC)          Hs (m)  Tp (s)  Tm02 (s)  from (°)  at peak (°)  spread (°)\n");
    for Line { time, summary } in &records {
        let number =
            |value: Option<f64>, decimals: usize| value.map_or("-".into(), |value| format!("{value:.decimals$}"));
        let (hs, tp, tm02) = (number(Some(summary.hs), 2), number(summary.tp, 1), number(summary.tm02, 1));
        let [from, peak] = [summary.mean_direction, summary.peak_direction].map(|from| number(from.map(whole), 0));
        let spread = number(summary.spread, 0);
        let _ = writeln!(text, "{time:17} {hs:>8} {tp:>7} {tm02:>9} {from:>9} {peak:>12} {spread:>11}");
    }
    talk.print(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_are_lists_or_ranges() {
        let read = |text: &str| frequencies(text).map(|f| f.0);
        assert_eq!(read("0.1,0.2, 0.3"), Ok(vec![0.1, 0.2, 0.3]));
        assert_eq!(read("0.02:0.01:0.05"), Ok(vec![0.02, 0.03, 0.04, 0.05]));
        for wrong in
            ["", "a", "0.1,,0.2", "-0.1", "nan", "0.1:0:0.2", "0.2:0.1:0.1", "0:1e-9:1", "0.1:0.2", "inf", "0.1,1e9"]
        {
            assert!(read(wrong).is_err_and(|e| e.contains("LOW:STEP:HIGH")), "{wrong}");
        }
    }

    #[test]
    fn usual_frequencies_are_round_and_cover_the_peak() {
        for (line, peak) in [("wind=15", 0.09), ("beaufort=2", 0.4), ("hs=5,tp=18", 0.055)] {
            let f = usual_frequencies(&line.parse().expect(line));
            assert!((20..=60).contains(&f.len()), "{line}: {} of them", f.len());
            assert!(f[0] < peak && f[f.len() - 1] > 2.5 * peak && f[0] > 0.0, "{line}: {f:?}");
            assert!(f.iter().all(|f| f.to_string().len() <= 6), "{f:?}");
        }
    }
}
