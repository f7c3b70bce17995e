//! `littoral bench lod`: all methods of detail along the same flights.

mod counted;
mod figure;

use super::mountains;
use crate::plot;
use crate::talk::{Failure, Talk, progress, tidy};
use counted::Counted;
use glam::{DVec2, DVec3, UVec2};
use littoral::field::{HeightField, Land, Sea, coast};
use littoral::lod::{Drawing, Limits, Mesh, Method, NestedBounds, RoamFlight, RoamSea};
use littoral::picture::mesh_errors;
use littoral::space::{Datum, View};
use littoral::waves::Superposition;
use serde::Serialize;
use std::cell::RefCell;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub struct Lod {
    /// Samples along a side of the mountains
    #[arg(long, default_value = "4097", value_parser = clap::value_parser!(u32).range(65..=8193))]
    size: u32,
    /// How far from its place a mesh may be drawn, in pixels
    #[arg(long, value_name = "PIXELS", value_parser = crate::input::tolerance, default_value = "1")]
    tolerance: f64,
    /// The most triangles
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = clap::value_parser!(u32).range(1..=50_000_000))]
    triangles: u32,
    /// Frames of each flight, at 60 a second
    #[arg(long, value_name = "N", default_value = "60", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: u32,
    /// Also draw it, and how errors fall with the number of triangles: .png or .svg
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

/// The picture that tolerances count in.
const FRAME: UVec2 = UVec2::new(1280, 720);
/// Frames whose errors are measured, of each flight.
const MEASURED: u32 = 4;

/// The longest that a method flies (s), errors and all.
const LONGEST: f64 = 30.0;

/// What else the tolerance is for a plot, as multiples of the one that is asked for, and for how many frames and seconds.
const SWEEP: [f64; 3] = [0.5, 2.0, 4.0];
const SWEPT: (u32, f64) = (4, 8.0);

/// A surface and how a camera moves over it.
struct Flight<'a> {
    name: &'static str,
    over: Over<'a>,
    finest: u8,
    /// Eye and target at an instant (s).
    camera: Box<dyn Fn(f64) -> (DVec3, DVec3) + 'a>,
}

/// What is flown over.
#[derive(Clone, Copy)]
enum Over<'a> {
    /// Land, and what ROAM prepares to go on from frame to frame.
    Land(&'a Land, &'a NestedBounds),
    /// A sea that moves.
    Sea(&'a RefCell<Sea>),
}

/// ROAM that goes on from frame to frame, with the mesh in place.
enum Going<'a> {
    Land(Box<RoamFlight<'a>>),
    Sea(Box<RoamSea>),
}

impl Going<'_> {
    fn mesh(&self) -> &Mesh {
        match self {
            Going::Land(flight) => flight.mesh(),
            Going::Sea(flight) => flight.mesh(),
        }
    }

    /// Heights that the last frame asked for.
    fn heights(&self) -> usize {
        match self {
            Going::Land(flight) => flight.changed_vertices().map(|range| range.len()).sum(),
            Going::Sea(flight) => flight.heights_asked(),
        }
    }
}

#[derive(Serialize)]
struct Answer {
    frame: [u32; 2],
    tolerance_pixels: f64,
    most_triangles: u32,
    flights: Vec<Row>,
    /// The same with other tolerances, if a plot was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    sweep: Vec<Row>,
}

/// One method on one flight.
#[derive(Serialize)]
struct Row {
    flight: &'static str,
    method: String,
    tolerance_pixels: f64,
    triangles: usize,
    vertices: usize,
    /// Heights that the field was asked for, in a frame; of ROAM in flight over land, those that changed.
    heights_evaluated: usize,
    bound_pixels: f32,
    error_max_pixels: f32,
    error_99_pixels: f32,
    error_mean_pixels: f32,
    pop_pixels: f32,
    select_ms: f64,
    select_99_ms: f64,
    mesh_ms: f64,
    mesh_mb: f64,
    /// What the drawing and the method hold after the flight, and what was prepared for it beside the land's own pyramids.
    memory_mb: f64,
    prepared_mb: f64,
}

impl Row {
    /// The choice and the mesh.
    fn frame_ms(&self) -> f64 {
        self.select_ms + self.mesh_ms
    }
}

impl Lod {
    /// Runs the measurement.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let kind = self.plot.as_deref().map(|file| plot::ending(file, &["png", "svg"])).transpose()?;
        if let Some(file) = &self.plot {
            crate::render::check_output(file, &[])?;
        }
        let (mountains, coast) = (mountains(self.size), coast::coast());
        let datum = Datum::Plane { origin: DVec2::splat(-1500.0), size: DVec2::splat(3000.0) };
        // The sea of 2009: 16 frequencies in 8 directions.
        let waves = Superposition::of_state(&coast::sea_state(), 16, 8)
            .map_err(|e| Failure::Work(format!("the sea of the measurement: {e}")))?;
        let sea = RefCell::new(Sea::new(datum, 0.0).with(Box::new(waves)));
        counted::count();
        let bar = progress(2, "preparing");
        let prepare = |land: &Land| {
            let bounds = NestedBounds::of(land).map_err(|e| Failure::Work(e.to_string()));
            bar.inc(1);
            bounds
        };
        let bounds = [prepare(&mountains)?, prepare(&coast)?];
        bar.finish_and_clear();
        let flights = flights(&mountains, &coast, &sea, &bounds);
        let runs = if self.plot.is_some() { 1 + SWEEP.len() } else { 1 };
        let bar = progress((flights.len() * Method::ALL.len() * runs + 1) as u64, "flying");
        let (mut rows, mut sweep) = (Vec::new(), Vec::new());
        for flight in &flights {
            for method in Method::ALL {
                rows.push(self.fly(flight, method, true, self.tolerance, self.frames, LONGEST)?);
                bar.inc(1);
                if method == Method::Roam && matches!(flight.over, Over::Sea(_)) {
                    rows.push(self.fly(flight, method, false, self.tolerance, self.frames, LONGEST)?);
                    bar.inc(1);
                }
                for factor in SWEEP.iter().filter(|_| self.plot.is_some()) {
                    let (frames, longest) = SWEPT;
                    let (tolerance, frames) = (self.tolerance * factor, frames.min(self.frames));
                    sweep.push(self.fly(flight, method, true, tolerance, frames, longest)?);
                    bar.inc(1);
                }
            }
        }
        bar.finish_and_clear();
        let answer = Answer {
            frame: FRAME.to_array(),
            tolerance_pixels: self.tolerance,
            most_triangles: self.triangles,
            flights: rows,
            sweep,
        };
        if let (Some(file), Some(kind)) = (&self.plot, kind) {
            figure::write(&answer, file, kind)?;
            talk.note(format!("plot in {}", file.display()));
        }
        if talk.json() { talk.print_json(answer) } else { talk.print(answer.table()) }
    }

    /// Flies a method for so many frames, and for so long (s). What can go on from frame to frame does so, if it `goes_on`.
    fn fly(
        &self,
        flight: &Flight,
        method: Method,
        goes_on: bool,
        tolerance: f64,
        frames: u32,
        longest: f64,
    ) -> Result<Row, Failure> {
        let limits = Limits { finest: flight.finest, triangles: self.triangles as usize };
        let mut lod = method.within(limits);
        let (mut roam, prepared) = match flight.over {
            Over::Land(_, bounds) if method == Method::Roam && goes_on => {
                (Some(Going::Land(Box::new(RoamFlight::over(bounds, limits)))), bounds.bytes())
            }
            Over::Sea(_) if method == Method::Roam && goes_on => (Some(Going::Sea(Box::new(RoamSea::new(limits)))), 0),
            _ => (None, 0),
        };
        let mut drawing = Drawing::default();
        let (mut select, mut expand) = (Vec::new(), Vec::new());
        let (mut triangles, mut vertices) = (Vec::new(), Vec::new());
        let (mut bound, mut pop) = (0.0f32, 0.0f32);
        let mut errors: Vec<f32> = Vec::new();
        let mut evaluated: Vec<usize> = Vec::new();
        let mut before = Mesh::default();
        let started = Instant::now();
        for frame in 0..frames {
            // A method that is no match for a flight is not waited for.
            if frame > 1 && started.elapsed().as_secs_f64() > longest {
                break;
            }
            let (eye, target) = (flight.camera)(f64::from(frame) / 60.0);
            let view =
                View { tolerance_pixels: tolerance as f32, ..View::looking_at(eye, target, 50f32.to_radians(), FRAME) };
            // That the sea moves on is paid for by whoever shows it, not by a method.
            let time = f64::from(frame) / 60.0;
            let sea = match flight.over {
                Over::Sea(sea) => {
                    sea.borrow_mut().set_time(time);
                    Some(sea.borrow())
                }
                Over::Land(..) => None,
            };
            let field: &dyn HeightField = match (&sea, flight.over) {
                (Some(sea), _) => &**sea,
                (None, Over::Land(land, _)) => land,
                (None, Over::Sea(_)) => unreachable!("a sea was borrowed"),
            };
            let start = Instant::now();
            let mut asked = start;
            let mut stop = || {
                asked = Instant::now();
                false
            };
            let reached = match (&mut roam, &sea) {
                (Some(Going::Land(roam)), _) => roam.update(&view, &mut || false),
                (Some(Going::Sea(roam)), Some(sea)) => roam.update(sea, &view, &mut stop),
                _ => lod.select(field, &view, &mut drawing),
            };
            let reached = reached.map_err(|e| Failure::Work(e.to_string()))?;
            // Over a sea heights come after the last question whether to stop.
            let chosen = if let Some(Going::Sea(_)) = roam { asked } else { Instant::now() };
            if roam.is_none() {
                drawing.expand(field);
            }
            // The first frame comes from nothing.
            if frame > 0 || frames < 3 {
                select.push((chosen - start).as_secs_f64() * 1e3);
                expand.push(if let Some(Going::Land(_)) = roam { 0.0 } else { chosen.elapsed().as_secs_f64() * 1e3 });
            }
            if let Some(roam) = &roam {
                drawing.mesh.clone_from(roam.mesh());
            }
            triangles.push(drawing.mesh.triangles.len());
            vertices.push(drawing.mesh.vertices.len());
            bound = bound.max(reached.pixels);
            let stride = (frames / MEASURED).max(1);
            let measured = frame % stride == 1 % stride && (frames >= MEASURED * 4 || errors.is_empty());
            if measured {
                evaluated.push(match &roam {
                    Some(roam) => roam.heights(),
                    None => {
                        let counted = Counted::new(field);
                        lod.select(&counted, &view, &mut drawing).map_err(|e| Failure::Work(e.to_string()))?;
                        drawing.expand(&counted);
                        counted.heights_asked()
                    }
                });
                // Both meshes from the same eye, each against the surface of its own instant: what moves is the change of mesh alone.
                let now = mesh_errors(&drawing.mesh, field, &view);
                drop(sea);
                let then = match flight.over {
                    Over::Land(land, _) => mesh_errors(&before, land, &view),
                    Over::Sea(sea) => {
                        sea.borrow_mut().set_time((time - 1.0 / 60.0).max(0.0));
                        mesh_errors(&before, &*sea.borrow(), &view)
                    }
                };
                let jumps = now.iter().zip(&then).map(|(now, then)| (now - then).abs());
                pop = jumps.fold(pop, f32::max);
                errors.extend(now.iter().filter(|e| !e.is_nan()).map(|e| e.abs()));
            }
            before.clone_from(&drawing.mesh);
        }
        // What goes when they go is what they held.
        let held = counted::held();
        drop((lod, roam, drawing));
        let memory = (held - counted::held()).max(0);
        errors.sort_by(f32::total_cmp);
        evaluated.sort_unstable();
        [&mut select, &mut expand].into_iter().for_each(|times| times.sort_by(f64::total_cmp));
        triangles.sort_unstable();
        vertices.sort_unstable();
        let at = |share: f64, count: usize| ((count as f64 * share) as usize).min(count.saturating_sub(1));
        let error = |share: f64| errors.get(at(share, errors.len())).copied().unwrap_or(f32::NAN);
        let (half, vertex_count) = (at(0.5, select.len()), vertices[at(0.5, vertices.len())]);
        let triangle_count = triangles[at(0.5, triangles.len())];
        Ok(Row {
            flight: flight.name,
            method: if goes_on { method.to_string() } else { format!("{method} anew") },
            tolerance_pixels: tolerance,
            triangles: triangle_count,
            vertices: vertex_count,
            heights_evaluated: evaluated.get(evaluated.len() / 2).copied().unwrap_or(0),
            bound_pixels: bound,
            error_max_pixels: error(1.0),
            error_99_pixels: error(0.99),
            error_mean_pixels: errors.iter().map(|&e| f64::from(e)).sum::<f64>() as f32 / errors.len().max(1) as f32,
            pop_pixels: pop,
            select_ms: select[half],
            select_99_ms: select[at(0.99, select.len())],
            mesh_ms: expand[half],
            mesh_mb: (vertex_count * 16 + triangle_count * 12) as f64 / 1e6,
            memory_mb: memory as f64 / 1e6,
            prepared_mb: prepared as f64 / 1e6,
        })
    }
}

/// Low over mountains, high above them, along the coast, and over the open sea.
fn flights<'a>(
    mountains: &'a Land,
    coast: &'a Land,
    sea: &'a RefCell<Sea>,
    bounds: &'a [NestedBounds; 2],
) -> Vec<Flight<'a>> {
    let ground = |land: &Land, at: DVec2| f64::from(land.height_at(at).unwrap_or(0.0)).max(0.0);
    let over = move |land: &'a Land, from: DVec2, to: DVec2, speed: f64, above: f64, down: f64| {
        let ahead = (to - from).normalize();
        // A pilot looks ahead: the height changes with the land of a kilometre.
        let height = move |at: DVec2| {
            (-4..=4).map(|i| ground(land, at + ahead * (f64::from(i) * 125.0))).fold(0.0, f64::max) + above
        };
        move |t: f64| {
            let at = from + ahead * (speed * t);
            let eye = at.extend(height(from) + t * (height(to) - height(from)) * speed / from.distance(to));
            (eye, eye + ahead.extend(-down) * 1000.0)
        }
    };
    let (low, extent) = (mountains.origin(), mountains.extent());
    let finest = mountains.finest_level();
    let (south, size) = (coast.origin(), coast.extent());
    vec![
        Flight {
            name: "low over mountains, 100 m/s",
            over: Over::Land(mountains, &bounds[0]),
            finest,
            camera: Box::new(over(
                mountains,
                low + extent * 0.3,
                low + extent * DVec2::new(0.35, 0.33),
                100.0,
                150.0,
                0.1,
            )),
        },
        Flight {
            name: "high above them, 250 m/s",
            over: Over::Land(mountains, &bounds[0]),
            finest,
            camera: Box::new(over(
                mountains,
                low + extent * 0.2,
                low + extent * DVec2::new(0.4, 0.3),
                250.0,
                5000.0,
                0.8,
            )),
        },
        Flight {
            name: "along the coast, 50 m/s",
            over: Over::Land(coast, &bounds[1]),
            finest: coast.finest_level(),
            camera: Box::new(over(
                coast,
                south + size * DVec2::new(0.3, 0.35),
                south + size * DVec2::new(0.6, 0.4),
                50.0,
                60.0,
                0.05,
            )),
        },
        Flight {
            name: "over the sea, 20 m/s",
            over: Over::Sea(sea),
            finest: 12,
            camera: Box::new(|t| {
                let eye = DVec3::new(-500.0 + 20.0 * t, -800.0, 25.0);
                (eye, eye + DVec3::new(300.0, 900.0, -120.0))
            }),
        },
    ]
}

impl Answer {
    fn table(&self) -> String {
        let mut text = format!(
            "{} x {} pixels, tolerance {} pixels, at most {} triangles; medians of the frames of each flight\n\
             errors and bounds in pixels; heights: asked of the field in a frame; MB: what drawing and method hold\n",
            self.frame[0], self.frame[1], self.tolerance_pixels, self.most_triangles
        );
        let mut flight = "";
        for row in &self.flights {
            if row.flight != flight {
                flight = row.flight;
                text += &format!(
                    "\n{flight}\n  {:<12} {:>10} {:>10} {:>10} {:>8} {:>24} {:>7} {:>16} {:>8} {:>8}\n",
                    "method",
                    "triangles",
                    "vertices",
                    "heights",
                    "bound",
                    "error max 99 % mean",
                    "pop",
                    "select ms 99 %",
                    "mesh ms",
                    "MB"
                );
            }
            let number = |v: f32| tidy(f64::from(v), if v < 10.0 { 2 } else { 0 });
            let three = [row.error_max_pixels, row.error_99_pixels, row.error_mean_pixels].map(number).join("  ");
            let select = format!("{}  {}", tidy(row.select_ms, 2), tidy(row.select_99_ms, 2));
            text += &format!(
                "  {:<12} {:>10} {:>10} {:>10} {:>8} {three:>24} {:>7} {select:>16} {:>8} {:>8}\n",
                row.method,
                row.triangles,
                row.vertices,
                row.heights_evaluated,
                number(row.bound_pixels),
                number(row.pop_pixels),
                tidy(row.mesh_ms, 2),
                tidy(row.memory_mb, 1)
            );
            if row.prepared_mb > 0.0 {
                text += &format!("  {:<12} (prepared from the land: {} MB)\n", "", tidy(row.prepared_mb, 1));
            }
        }
        text
    }
}
