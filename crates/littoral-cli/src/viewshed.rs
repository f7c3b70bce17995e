//! `littoral viewshed`: what is seen from a point.

use crate::ground::{Opened, Reading, System};
use crate::input;
use crate::plot::ending;
use crate::sight::{Curved, explained};
use crate::talk::{Failure, Talk, seconds, tidy};
use glam::{DVec2, DVec3};
use littoral::field::Window;
use littoral::raycast::{Station, Viewshed as Asked};
use littoral_data::write::{self, GeoTags, GridSamples};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// What void samples are in the answer: neither seen nor not.
const VOID: u8 = 1;

/// What can be seen from a point, as a GeoTIFF over the whole file: 255 seen, 0 not, 1 (declared no-data) void.
///
/// Exact: each sample is seen or not by a line of sight of its own against the full data, or by a proof that it makes no
/// difference.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral viewshed dem.tif --from 562600,5113800,2 --out seen.tif
  littoral viewshed dem.tif --from 562600,5113800,30 --target 1.7 --radius 20000 --curvature --out seen.tif
  littoral viewshed dem.tif --from -155.47,19.82,10 --lonlat --curvature --out seen.tif --json")]
pub struct Viewshed {
    /// A height file
    file: PathBuf,
    /// The observer: X, Y and metres above the ground
    #[arg(long, value_name = "X,Y,H", value_parser = input::xyz)]
    from: DVec3,
    /// The GeoTIFF to write
    #[arg(long, value_name = "FILE.tif")]
    out: PathBuf,
    /// Metres above the ground of what is looked for
    #[arg(long, value_name = "H", default_value = "0", value_parser = input::number)]
    target: f64,
    /// Nothing farther than this is seen (metres) [default: no limit]
    #[arg(long, value_name = "METRES", value_parser = input::positive)]
    radius: Option<f64>,
    /// Coordinates are longitude and latitude in degrees
    #[arg(long)]
    lonlat: bool,
    #[command(flatten)]
    curved: Curved,
    #[command(flatten)]
    reading: Reading,
}

#[derive(Serialize)]
struct Answer {
    file: String,
    width: usize,
    height: usize,
    seen: usize,
    not_seen: usize,
    void: usize,
    seen_km2: f64,
    seconds: f64,
    curvature: bool,
    refraction: Option<f64>,
}

impl Viewshed {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        ending(&self.out, &["tif", "tiff"])?;
        crate::render::check_output(&self.out, &[&self.file])?;
        let mut opened = Opened::open(&self.file, self.reading, talk)?;
        let started = Instant::now();
        let system = System::of(self.lonlat);
        let from = opened.local(system, self.from.truncate())?;
        let info = opened.info().clone();
        let (columns, rows) = (info.columns, info.rows);
        // Beyond the radius nothing matters, so nothing is read.
        let window = match self.radius {
            None => Window { column: 0, row: 0, columns, rows },
            Some(radius) => opened.window_of([from - radius, from + radius]),
        };
        let land = opened.part(window, talk)?;
        let raster = land.raster();
        let mut seen = vec![0; raster.heights().len()];
        let station = Station { position: from, above_ground: self.from.z };
        let curvature = self.curved.curvature();
        let asked = Asked { target_height: self.target, radius: self.radius.unwrap_or(f64::INFINITY), curvature };
        let count = land
            .viewshed(station, &asked, &mut seen)
            .map_err(|error| explained(&opened, system, error, &[(from, self.from)]))?;
        for (index, seen) in seen.iter_mut().enumerate() {
            if raster.voids().is_void(index) {
                *seen = VOID;
            }
        }
        // Into the file's order, and the whole file's size.
        info.georeference.turn(&mut seen, window.columns);
        let mut grid = vec![0; columns * rows];
        for (row, line) in seen.chunks_exact(window.columns).enumerate() {
            let into = (window.row + row) * columns + window.column;
            grid[into..into + window.columns].copy_from_slice(line);
        }
        let void = raster.voids().count();
        let note = format!(
            "viewshed from {},{}, {} m above the ground, of targets {} m above it; {}; 255 seen, 0 not, {VOID} void",
            self.from.x,
            self.from.y,
            self.from.z,
            self.target,
            self.curved.told()
        );
        write::geotiff(
            &self.out,
            &info.georeference,
            GeoTags::of_file(&self.file).as_ref(),
            GridSamples::U8(&grid),
            (void > 0).then_some(VOID),
            &note,
        )?;
        let spacing: DVec2 = opened.frame.spacing();
        let square_kilometres = count.seen as f64 * spacing.x * spacing.y / 1e6;
        let elapsed = started.elapsed().as_secs_f64();
        if talk.json() {
            return talk.print_json(Answer {
                file: self.out.display().to_string(),
                width: columns,
                height: rows,
                seen: count.seen,
                not_seen: columns * rows - count.seen - void,
                void,
                seen_km2: square_kilometres,
                seconds: elapsed,
                curvature: curvature.is_some(),
                refraction: curvature.map(|c| c.refraction),
            });
        }
        let area = match square_kilometres {
            area if area < 0.1 => format!("{} m²", tidy(area * 1e6, 0)),
            area => format!("{} km²", tidy(area, 2)),
        };
        let share = 100.0 * count.seen as f64 / (columns * rows - void).max(1) as f64;
        talk.print(format!(
            "{}: {} samples seen, {} % of {columns} × {rows}, {area}, {} ({})\n",
            self.out.display(),
            count.seen,
            tidy(share, 1),
            seconds(elapsed),
            self.curved.told()
        ))
    }
}
