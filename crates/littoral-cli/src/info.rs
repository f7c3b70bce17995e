//! `littoral info`: what a file is, and what is assumed about it.

use crate::ground::{Opened, Reading};
use crate::talk::{Failure, Talk, tidy};
use littoral_data::{Crs, Registration, VerticalDatum, name_of_unit};
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Say what a file is: format, size, heights, coordinates, and what is assumed.
///
/// Every sample is read, so that the range of heights and the number of voids are those of the full data. Heights are
/// given in metres, after the file's scale, offset and unit.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral info dem.tif
  littoral info dem.tif --json | jq .max")]
pub struct Info {
    /// A height file of any known format
    file: PathBuf,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Serialize)]
struct Answer<'a> {
    format: &'a str,
    width: usize,
    height: usize,
    void: u64,
    nodata: Option<f64>,
    min: Option<f32>,
    max: Option<f32>,
    first: Option<f32>,
    centre: Option<f32>,
    last: Option<f32>,
    crs: Option<&'a str>,
    horizontal_unit: String,
    vertical_unit: String,
    geotransform: [f64; 6],
    cell_m: [f64; 2],
    point_or_area: &'static str,
    step_m: f64,
    vertical_datum: Option<&'a str>,
    overviews: Vec<[usize; 2]>,
}

impl Info {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let mut opened = Opened::open(&self.file, self.reading, talk)?;
        let survey = opened.survey(talk)?;
        if survey.min.is_none() {
            talk.warn(format!("{}: no valid height: all {} samples are void", self.file.display(), survey.void));
        }
        let info = opened.info();
        let spacing = opened.frame.spacing();
        let answer = Answer {
            format: info.format,
            width: info.columns,
            height: info.rows,
            void: survey.void,
            nodata: info.nodata,
            min: survey.min,
            max: survey.max,
            first: survey.first,
            centre: survey.centre,
            last: survey.last,
            crs: stated(&info.georeference.crs),
            horizontal_unit: info.georeference.crs.unit(),
            vertical_unit: name_of_unit(info.vertical_metres),
            geotransform: info.georeference.geotransform,
            cell_m: [spacing.x, spacing.y],
            point_or_area: match info.georeference.registration {
                Registration::Area => "area",
                Registration::Point => "point",
            },
            step_m: info.step,
            vertical_datum: match &info.vertical_datum {
                VerticalDatum::Unknown => None,
                VerticalDatum::Named(name) => Some(name),
            },
            overviews: opened.levels().iter().skip(1).map(|level| [level.columns, level.rows]).collect(),
        };
        if talk.json() {
            talk.print_json(answer)
        } else {
            talk.print(table(&self.file.display().to_string(), &answer, &opened))
        }
    }
}

/// A file's name for its coordinate system.
fn stated(crs: &Crs) -> Option<&str> {
    (*crs != Crs::Unknown).then(|| crs.name())
}

fn table(file: &str, answer: &Answer, opened: &Opened) -> String {
    let mut text = format!("{file}\n");
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:<12} {value}"); // writing to a string does not fail
    };
    let height = |h: Option<f32>| h.map_or("void".to_owned(), |h| format!("{h} m"));
    line("format", answer.format.to_owned());
    let samples = answer.width * answer.height;
    line("size", format!("{} × {} samples", answer.width, answer.height));
    if !answer.overviews.is_empty() {
        let sizes: Vec<String> = answer.overviews.iter().map(|[w, h]| format!("{w} × {h}")).collect();
        line("overviews", sizes.join(", "));
    }
    let kilometres = |cells: usize, cell: f64| {
        let metres = (cells - 1) as f64 * cell;
        if metres < 2000.0 { format!("{} m", tidy(metres, 1)) } else { format!("{} km", tidy(metres / 1000.0, 2)) }
    };
    let [x, y] = answer.cell_m;
    line("cell", format!("{} × {} m", tidy(x, 3), tidy(y, 3)));
    line("extent", format!("{} × {}", kilometres(answer.width, x), kilometres(answer.height, y)));
    line(
        "heights",
        match (answer.min, answer.max) {
            (Some(low), Some(high)) => format!("{low} to {high} m"),
            _ => "none".to_owned(),
        },
    );
    line(
        "step",
        match answer.step_m {
            0.0 => "floating point".to_owned(),
            step => format!("{} m between heights that the file can tell apart", tidy(step, 4)),
        },
    );
    let share = 100.0 * answer.void as f64 / samples.max(1) as f64;
    line(
        "void",
        match (answer.void, answer.nodata) {
            (0, None) => "none".to_owned(),
            (0, Some(nodata)) => format!("none (no-data value {nodata})"),
            (void, None) => format!("{void} samples ({} %), no no-data value declared", tidy(share, 2)),
            (void, Some(nodata)) => format!("{void} samples ({} %), no-data value {nodata}", tidy(share, 2)),
        },
    );
    line("first", height(answer.first));
    line("centre", height(answer.centre));
    line("last", height(answer.last));
    line(
        "system",
        answer.crs.map_or("not stated: coordinates taken as metres".to_owned(), |name| {
            format!("{name}, in units of a {}", answer.horizontal_unit)
        }),
    );
    let (low, high) = opened.frame.bounds();
    let shown = |c: f64| opened.frame.shown(c);
    line("X", format!("{} to {}", shown(low.x), shown(high.x)));
    line("Y", format!("{} to {}", shown(low.y), shown(high.y)));
    line("pixels are", format!("{}s", answer.point_or_area));
    line(
        "unit",
        match answer.vertical_unit.as_str() {
            "metre" => "metre".to_owned(),
            unit => format!("{unit}; all heights here are converted to metres"),
        },
    );
    line(
        "datum",
        match answer.vertical_datum {
            Some(name) => name.to_owned(),
            None => "not stated: height 0 taken as sea level".to_owned(),
        },
    );
    text
}
