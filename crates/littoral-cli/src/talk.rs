//! What is said, and where: results on stdout, talk on stderr.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use std::io::{IsTerminal, Write};

/// Why a command did not do what it was asked for.
#[derive(Debug)]
pub enum Failure {
    /// The input or the work failed: exit 1.
    Work(String),
    /// The command line was wrong: exit 2.
    Usage(String),
    /// Nobody reads the results any more (a closed pipe): nothing to complain about.
    ReaderGone,
}

impl From<littoral_data::Error> for Failure {
    fn from(error: littoral_data::Error) -> Failure {
        use std::io::ErrorKind;
        Failure::Work(match error {
            littoral_data::Error::Io { file, source } => {
                let (got, advice) = match source.kind() {
                    ErrorKind::NotFound => ("none of that name".to_owned(), "check the name"),
                    ErrorKind::PermissionDenied => ("permission denied".to_owned(), "change its permissions"),
                    ErrorKind::IsADirectory => ("a folder".to_owned(), "name a file in it"),
                    ErrorKind::StorageFull => ("a full disk".to_owned(), "make room"),
                    _ => (source.to_string(), "check the file and the disk"),
                };
                format!("{}: expected a usable file, got {got}; {advice}", file.display())
            }
            error => error.to_string(),
        })
    }
}

/// The voice of the program.
pub struct Talk {
    json: bool,
    warnings: Vec<String>,
}

impl Talk {
    /// With `json`, results are one JSON object.
    pub fn new(json: bool) -> Talk {
        Talk { json, warnings: Vec::new() }
    }

    /// Whether results are JSON.
    pub fn json(&self) -> bool {
        self.json
    }

    /// Warns: at once on stderr, and under "warnings" of a JSON result. The same warning is given once.
    pub fn warn(&mut self, warning: impl Into<String>) {
        let warning = warning.into();
        if !self.warnings.contains(&warning) {
            eprintln!("littoral: warning: {warning}");
            self.warnings.push(warning);
        }
    }

    /// Says something on stderr.
    pub fn note(&self, note: impl AsRef<str>) {
        eprintln!("littoral: {}", note.as_ref());
    }

    /// Prints text on stdout.
    pub fn print(&self, text: impl AsRef<str>) -> Result<(), Failure> {
        written(std::io::stdout().lock().write_all(text.as_ref().as_bytes()))
    }

    /// Prints a result as JSON, with the warnings so far.
    pub fn print_json(&self, result: impl Serialize) -> Result<(), Failure> {
        #[derive(Serialize)]
        struct Warned<'a, T> {
            #[serde(flatten)]
            result: T,
            warnings: &'a [String],
        }
        let warned = Warned { result, warnings: &self.warnings };
        let mut text = serde_json::to_vec(&warned).map_err(|e| Failure::Work(format!("JSON: {e}")))?;
        text.push(b'\n');
        written(std::io::stdout().lock().write_all(&text))
    }
}

/// A write to stdout.
pub fn written(result: std::io::Result<()>) -> Result<(), Failure> {
    result.map_err(|error| match error.kind() {
        std::io::ErrorKind::BrokenPipe => Failure::ReaderGone,
        _ => Failure::Work(format!("stdout: expected to be written to, got \"{error}\"; check where it leads")),
    })
}

/// A progress bar of `length` steps: on a terminal's stderr, or nowhere.
pub fn progress(length: u64, what: &'static str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::hidden());
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %  {elapsed} gone, {eta} to go");
    let bar = ProgressBar::new(length).with_message(what);
    bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(10));
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// Says that the program ends because it was asked to.
pub fn interrupted() {
    eprintln!("\nlittoral: interrupted; no half-written file is left");
}

/// A number for people: so many decimals, none of them a lonely zero.
pub fn tidy(number: f64, decimals: usize) -> String {
    let text = format!("{number:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Seconds for people.
pub fn seconds(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.1} s")
    } else {
        format!("{:.0} min {:.0} s", (seconds / 60.0).floor(), seconds % 60.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_tidy() {
        let cases = [(1.5, 3, "1.5"), (100.0, 2, "100"), (-0.001, 2, "0"), (1200.0, 0, "1200"), (0.05, 1, "0.1")];
        for (number, decimals, text) in cases {
            assert_eq!(tidy(number, decimals), text);
        }
        assert_eq!([seconds(3.21), seconds(125.0)], ["3.2 s", "2 min 5 s"]);
    }
}
