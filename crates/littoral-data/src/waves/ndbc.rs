//! The files of the National Data Buoy Center, as text of one record a line.
//!
//! Real-time files (`41010.data_spec`, `.swdir`, `.swdir2`, `.swr1`, `.swr2`) hold pairs of a value and its frequency in brackets, the latest
//! record first; historical ones (`41010w2019.txt`, and `d`, `i`, `j`, `k` instead of `w`) rows of values under a header of frequencies. Both say
//! α₁ and α₂ in degrees from true north from which waves come, r₁ and r₂ as 0 to 1 or, in historical files, in hundredths; 999 is missing
//! ("Measurement descriptions and units" at www.ndbc.noaa.gov). Years have two digits before 1999, and minutes came in 2005.

use super::{LONGEST, Time};
use crate::Error;
use crate::formats::text::number;
use std::fmt;
use std::path::{Path, PathBuf};

/// The highest frequency that a buoy resolves is below this (Hz).
const HIGHEST: f64 = 10.0;
/// No line is longer: some 300 frequencies.
const LONGEST_LINE: usize = 1 << 14;

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Density,
    Mean,
    Principal,
    First,
    Second,
}

impl Kind {
    pub const ALL: [Kind; 5] = [Kind::Density, Kind::Mean, Kind::Principal, Kind::First, Kind::Second];

    /// Extensions of real-time files, letters of historical ones, and folders of NDBC's archive.
    const ENDINGS: [&str; 5] = ["data_spec", "swdir", "swdir2", "swr1", "swr2"];
    const LETTERS: [u8; 5] = *b"wdijk";
    const FOLDERS: [&str; 5] = ["swden", "swdir", "swdir2", "swr1", "swr2"];
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Kind::Density => "energy density",
            Kind::Mean => "mean direction (alpha1)",
            Kind::Principal => "principal direction (alpha2)",
            Kind::First => "strength r1",
            Kind::Second => "strength r2",
        })
    }
}

/// What a file holds by its name, and the names that files of each kind may have beside it; `None` if the name says nothing.
pub fn companions(file: &Path) -> Option<(Kind, [Vec<PathBuf>; 5])> {
    let name = file.file_name()?.to_str()?;
    let plain = name.strip_suffix(".gz").unwrap_or(name);
    let folder = file.parent().unwrap_or(Path::new(""));
    let packed = |name: String| [folder.join(&name), folder.join(name + ".gz")];
    if let Some((stem, ending)) = plain.rsplit_once('.')
        && let Some(kind) = Kind::ENDINGS.iter().position(|known| known.eq_ignore_ascii_case(ending))
    {
        return Some((Kind::ALL[kind], Kind::ENDINGS.map(|ending| packed(format!("{stem}.{ending}")).to_vec())));
    }
    // The last such letter before a year.
    let bytes = plain.as_bytes();
    let is_year = |at: usize| bytes.get(at + 1..at + 5).is_some_and(|year| year.iter().all(u8::is_ascii_digit));
    let at =
        (0..bytes.len()).rev().find(|&at| is_year(at) && Kind::LETTERS.contains(&bytes[at].to_ascii_lowercase()))?;
    let kind = Kind::LETTERS.iter().position(|&letter| letter == bytes[at].to_ascii_lowercase())?;
    let names = std::array::from_fn(|other| {
        let letter = char::from(Kind::LETTERS[other]);
        let letter = if bytes[at].is_ascii_uppercase() { letter.to_ascii_uppercase() } else { letter };
        let name = format!("{}{letter}{}", &plain[..at], &plain[at + 1..]);
        let mut paths = packed(name.clone()).to_vec();
        // As in the archive: historical/swden/41010w2019.txt.gz, historical/swdir/41010d2019.txt.gz.
        if folder.file_name().is_some_and(|folder| folder == Kind::FOLDERS[kind]) {
            let across = folder.with_file_name(Kind::FOLDERS[other]);
            paths.extend([across.join(&name), across.join(name + ".gz")]);
        }
        paths
    });
    Some((Kind::ALL[kind], names))
}

/// How the values of a line are laid out.
enum Layout {
    /// `value (frequency)` again and again; one number before them says where sea and swell are separated.
    Pairs { separation: bool },
    /// One value for each of these frequencies (Hz).
    Rows(Vec<f64>),
}

/// Where a record stands.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub time: Time,
    /// Its line, from 1.
    pub line: usize,
    start: usize,
    end: usize,
}

/// One file.
pub struct Table {
    pub name: PathBuf,
    pub kind: Kind,
    pub rows: Vec<Row>,
    pub warnings: Vec<String>,
    text: String,
    layout: Layout,
    /// Numbers of a line that say when: 4 or 5.
    time_words: usize,
    /// One unit of the file's values.
    scale: f64,
}

impl Table {
    /// A file of unpacked bytes. `named` is what its name says it holds: of historical files only that can tell; without, they hold
    /// densities.
    pub fn read(name: &Path, bytes: Vec<u8>, named: Option<Kind>) -> Result<Table, Error> {
        let wrong = |problem: String| Error::content(name, problem);
        if bytes.len() as u64 > LONGEST {
            return Err(super::too_long(name, bytes.len() as u64));
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
            wrong(format!("line {line}: expected text of a buoy, got binary data; check that it is NDBC's file"))
        })?;
        let Some((number, header)) = lines(&text).find(|(_, line)| !line.of(&text).trim().is_empty()) else {
            return Err(wrong("expected NDBC's spectra, got an empty file; fetch it again".into()));
        };
        let header = header.of(&text).trim_start_matches('\u{feff}').trim();
        let (layout, time_words, told) =
            layout(header).map_err(|problem| wrong(format!("line {number}: {problem}")))?;
        let kind = told.or(named).unwrap_or(Kind::Density);
        let mut table = Table {
            name: name.to_owned(),
            kind,
            rows: Vec::new(),
            warnings: Vec::new(),
            text,
            layout,
            time_words,
            scale: 1.0,
        };
        table.index(number)?;
        if matches!(kind, Kind::First | Kind::Second) {
            table.scale = if table.in_hundredths() { 0.01 } else { 1.0 };
        }
        Ok(table)
    }

    /// Finds the lines below the header, and when they were measured.
    fn index(&mut self, header: usize) -> Result<(), Error> {
        let mut rows = Vec::new();
        for (line, place) in lines(&self.text) {
            let text = place.of(&self.text);
            if line <= header || text.trim().is_empty() || text.trim_start().starts_with('#') {
                continue;
            }
            if text.len() > LONGEST_LINE {
                let problem =
                    format!("expected a record, got a line of {} bytes; check that it is NDBC's file", text.len());
                return Err(self.error(line, &problem));
            }
            let time = self.time(text).ok_or_else(|| {
                let shown: String = text.trim().chars().take(16).collect();
                let expected = if self.time_words == 5 {
                    "year, month, day, hour and minute"
                } else {
                    "year, month, day and hour"
                };
                self.error(
                    line,
                    &format!("expected {expected} of a record, got \"{shown}\"; correct or remove the line"),
                )
            })?;
            rows.push(Row { time, line, start: place.start, end: place.end });
        }
        rows.sort_by_key(|row| row.time);
        let all = rows.len();
        rows.dedup_by_key(|row| row.time);
        if rows.is_empty() {
            let problem = "expected records below the header, got none; fetch the file again";
            return Err(Error::content(&self.name, problem));
        }
        if rows.len() < all {
            let twice = all - rows.len();
            self.warnings
                .push(format!("{}: {twice} records repeat a time: the first ones are taken", self.name.display()));
        }
        self.rows = rows;
        Ok(())
    }

    fn time(&self, line: &str) -> Option<Time> {
        let mut words = line.split_ascii_whitespace();
        let mut numbers = [0; 5];
        for number in &mut numbers[..self.time_words] {
            *number = words.next()?.parse().ok()?;
        }
        Time::new(numbers)
    }

    /// Whether most values are above 1, looked at in the first records.
    fn in_hundredths(&self) -> bool {
        let (mut above, mut below) = (0, 0);
        for row in self.rows.iter().take(256) {
            for (_, value) in self.raw(row).into_iter().flatten() {
                match value {
                    Some(value) if value > 1.0 => above += 1,
                    Some(value) if value > 0.0 => below += 1,
                    _ => {}
                }
            }
        }
        above > below
    }

    /// The record of a time.
    pub fn row_at(&self, time: Time) -> Option<&Row> {
        self.rows.binary_search_by_key(&time, |row| row.time).ok().map(|at| &self.rows[at])
    }

    /// Frequencies (Hz, rising) and values of a record, in the units of its kind but r in 0 to 1; `None` where missing.
    pub fn values(&self, row: &Row) -> Result<Vec<(f64, Option<f64>)>, Error> {
        let mut values = self.raw(row)?;
        let (unit, most) = match self.kind {
            Kind::Density => (" m²/Hz", 1e5),
            Kind::Mean | Kind::Principal => (" degrees", 360.0),
            Kind::First | Kind::Second if self.scale < 1.0 => (" hundredths", 100.0),
            Kind::First | Kind::Second => ("", 1.0),
        };
        for (frequency, value) in &mut values {
            let Some(value) = value else { continue };
            if !(0.0..=most).contains(value) {
                let problem = format!(
                    "expected a value of {} from 0 to {most}{unit} (999: missing) at {frequency} Hz, got {value}; correct or remove the line",
                    self.kind
                );
                return Err(self.error(row.line, &problem));
            }
            *value *= self.scale;
        }
        Ok(values)
    }

    /// Frequencies and values as they stand; `None` where missing.
    fn raw(&self, row: &Row) -> Result<Vec<(f64, Option<f64>)>, Error> {
        let wrong = |problem: String| self.error(row.line, &format!("{problem}; correct or remove the line"));
        let kind = self.kind;
        let value = |word: &str| match number(word) {
            Some(value) if value == 999.0 || value == 9999.0 => Ok(None),
            Some(value) if value.is_finite() => Ok(Some(value)),
            None if word == "MM" => Ok(None),
            _ => Err(wrong(format!("expected a value of {kind}, got \"{}\"", short(word)))),
        };
        let text = self.text[row.start..row.end].trim();
        let mut rest = text;
        for _ in 0..self.time_words {
            rest = rest.trim_start();
            rest = &rest[rest.find(|c: char| c.is_ascii_whitespace()).unwrap_or(rest.len())..];
        }
        let mut values = Vec::new();
        match &self.layout {
            Layout::Rows(frequencies) => {
                let mut words = rest.split_ascii_whitespace();
                for &frequency in frequencies {
                    let Some(word) = words.next() else {
                        let (expected, got) = (frequencies.len(), values.len());
                        return Err(wrong(format!("expected {expected} values of {kind}, got {got}")));
                    };
                    values.push((frequency, value(word)?));
                }
                let more = words.count();
                if more > 0 {
                    let expected = frequencies.len();
                    return Err(wrong(format!("expected {expected} values of {kind}, got {}", expected + more)));
                }
            }
            Layout::Pairs { separation } => {
                let mut before = 0.0;
                for (index, pair) in rest.split_terminator(')').enumerate() {
                    let Some((words, frequency)) = pair.split_once('(') else {
                        return Err(wrong(format!(
                            "expected a value and its frequency in brackets, got \"{}\"",
                            short(pair.trim())
                        )));
                    };
                    let mut words = words.split_ascii_whitespace();
                    if index == 0 && *separation {
                        words.next();
                    }
                    let (Some(word), None) = (words.next(), words.next()) else {
                        return Err(wrong(format!(
                            "expected one value before each frequency, got \"{}\"",
                            short(pair.trim())
                        )));
                    };
                    let frequency = number(frequency.trim()).filter(|f| is_frequency(*f, before)).ok_or_else(|| {
                        wrong(format!(
                            "expected frequencies (Hz) rising from above 0 to at most {HIGHEST}, got \"{}\"",
                            short(frequency)
                        ))
                    })?;
                    before = frequency;
                    values.push((frequency, value(word)?));
                }
                if !rest.trim_end().ends_with(')') {
                    return Err(wrong(
                        "expected a frequency in brackets at the end of a record, got a line that is cut off".into(),
                    ));
                }
            }
        }
        Ok(values)
    }

    /// An error in one of its lines.
    pub fn error(&self, line: usize, problem: &str) -> Error {
        Error::content(&self.name, format!("line {line}: {problem}"))
    }
}

/// What a header says: layout of the lines below, numbers of their times, and what they hold if it says that.
fn layout(header: &str) -> Result<(Layout, usize, Option<Kind>), String> {
    let shown = short(header);
    let wrong = || {
        format!(
            "expected the header of NDBC's spectra, `#YY MM DD hh mm …`, got \"{shown}\"; check that it is one of them"
        )
    };
    let words: Vec<&str> = header.trim_start_matches('#').split_ascii_whitespace().collect();
    let is = |at: usize, names: &[&str]| words.get(at).is_some_and(|word| names.contains(word));
    if !(is(0, &["YY", "YYYY", "yr"]) && is(1, &["MM", "mo"]) && is(2, &["DD", "dy"]) && is(3, &["hh", "hr"])) {
        return Err(wrong());
    }
    let time_words = 4 + usize::from(is(4, &["mm", "mn"]));
    let rest = &words[time_words..];
    let names = [
        ("spec_", Kind::Density),
        ("alpha1_", Kind::Mean),
        ("alpha2_", Kind::Principal),
        ("r1_", Kind::First),
        ("r2_", Kind::Second),
    ];
    if rest.iter().any(|word| word.starts_with("(freq")) {
        let known = |word: &&str| names.iter().find(|(name, _)| word.starts_with(name)).map(|(_, kind)| *kind);
        let kind = rest.iter().find_map(known).ok_or_else(wrong)?;
        return Ok((Layout::Pairs { separation: rest[0] == "Sep_Freq" }, time_words, Some(kind)));
    }
    if rest.iter().any(|word| ["WVHT", "SwH", "WSPD"].contains(word)) {
        return Err("expected spectra, got NDBC's summary (heights and periods only); fetch the station's .data_spec or …w2019.txt".into());
    }
    let mut before = 0.0;
    let mut frequencies = Vec::with_capacity(rest.len());
    for word in rest {
        let frequency = number(word).filter(|f| is_frequency(*f, before)).ok_or_else(|| {
            format!("expected frequencies (Hz) rising from above 0 to at most {HIGHEST} in the header, got \"{}\"; correct it", short(word))
        })?;
        before = frequency;
        frequencies.push(frequency);
    }
    if frequencies.len() < 2 {
        return Err(wrong());
    }
    Ok((Layout::Rows(frequencies), time_words, None))
}

fn is_frequency(frequency: f64, before: f64) -> bool {
    frequency > before && frequency <= HIGHEST
}

fn short(text: &str) -> String {
    text.chars().take(40).filter(|c| !c.is_control()).collect()
}

/// A stretch of a text.
#[derive(Clone, Copy)]
struct Place {
    start: usize,
    end: usize,
}

impl Place {
    fn of(self, text: &str) -> &str {
        &text[self.start..self.end]
    }
}

/// The lines of a text, from 1; ended as on any system.
fn lines(text: &str) -> impl Iterator<Item = (usize, Place)> {
    let mut start = 0;
    text.split('\n').enumerate().map(move |(index, line)| {
        let place = Place { start, end: start + line.len() };
        start = place.end + 1;
        (index + 1, place)
    })
}
