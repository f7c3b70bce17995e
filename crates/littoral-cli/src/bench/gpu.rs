//! `littoral bench gpu`: the same views by the processor and by the graphics adapter.

mod sheet;

use super::mountains;
use crate::ground::Reading;
use crate::input::{self, WaterLevel};
use crate::subject::Subject;
use crate::talk::{Failure, Talk, progress};
use glam::{DVec2, DVec3, UVec2};
use littoral::field::{HeightField, Lakes, Land, Sea, Water, coast};
use littoral::lod::{Drawing, Limits, Lod, Patches};
use littoral::picture::{self, Display, Exposure, Picture, Scene, Settings, Shot, Stage};
use littoral::space::{Cell, Datum, View};
use littoral_gpu::{
    Gpu, GpuError, Ground, Look, Painter, PassTimes, Renderer, Scenery, ShapeTexture, Triangles, Waves,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub struct GpuBench {
    /// Height files to draw; none for the built-in coast and mountains made by noise
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Width and height of the pictures in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = input::size, default_value = "1280x720")]
    size: UVec2,
    /// Frames that are timed, of each view and each way to draw it
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Rays through each pixel of the pictures that are compared; frames are timed with one
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..=1024))]
    samples: u32,
    /// Also draw a sheet, a row for each view: by the processor, by the adapter, and what differs: .png
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// The longest that one way to draw a view is timed (s).
const LONGEST: f64 = 5.0;
/// The most triangles of a mesh.
const TRIANGLES: usize = 2_000_000;
/// A pixel that differs by more steps of 255 in any channel is far off.
const FAR: u8 = 24;

/// Land and views of it, with its waves or with still water.
struct Place {
    name: String,
    land: Land,
    water: Option<Water>,
    lakes: Option<Lakes>,
    /// The waves of those views that are to have some.
    sea: Option<Sea>,
    shot: Shot,
    views: Vec<(&'static str, View, bool)>,
}

#[derive(Serialize)]
struct Answer {
    adapter: Adapter,
    threads: usize,
    width: u32,
    height: u32,
    samples: u32,
    views: Vec<Viewed>,
}

#[derive(Serialize)]
struct Adapter {
    name: String,
    /// discrete, integrated, virtual, software or other.
    kind: &'static str,
    backend: String,
    driver: String,
    /// Whether the adapter's own clock told the times of passes.
    has_pass_times: bool,
}

#[derive(Serialize)]
struct Viewed {
    land: String,
    view: &'static str,
    rows: Vec<Row>,
}

/// One way to draw a view.
#[derive(Default, Serialize)]
struct Row {
    drawn_by: &'static str,
    /// Wall-clock time of a frame, from the first call to the finished work; the median and what 99 % of frames do not exceed. Absent where only pictures are compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_99_ms: Option<f64>,
    /// Of the frame, by the adapter's clock (medians), pass by pass: `surface_ms`, `shade_ms` and so on.
    #[serde(flatten)]
    passes: BTreeMap<String, f64>,
    /// Choosing the mesh and bringing it to the adapter, which is not part of the frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    choose_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<usize>,
    /// From the processor's picture: the mean over all channels (steps of 255), and the share of pixels with more than 24 steps in any.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_difference: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    far_share: Option<f64>,
}

impl GpuBench {
    /// Runs the measurement.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        if let Some(out) = &self.out {
            crate::plot::ending(out, &["png"])?;
            let inputs: Vec<_> = self.files.iter().map(PathBuf::as_path).collect();
            crate::render::check_output(out, &inputs)?;
        }
        let gpu = Gpu::headless().map_err(|e| Failure::Work(e.to_string()))?.timed();
        let most = gpu.device.limits().max_texture_dimension_2d;
        if self.size.max_element() > most {
            let UVec2 { x, y } = self.size;
            return Err(Failure::Usage(format!(
                "expected a picture of at most {most} pixels a side, which is what this graphics adapter draws, got {x}x{y}; change --size"
            )));
        }
        let places = self.places(talk)?;
        let count: usize = places.iter().map(|place| place.views.len()).sum();
        let bar = progress(4 * count as u64, "drawing");
        let (mut views, mut sheet) = (Vec::new(), sheet::Sheet::new(self.size));
        for place in &places {
            let scene = Scene {
                lakes: place.lakes.as_ref(),
                ..Scene::for_shot(&place.land, place.water.as_ref(), &place.shot)
            };
            let stage = Stage::new(&scene);
            let mut painter = Painter::new(gpu.clone(), &stage).map_err(|e| Failure::Work(e.to_string()))?;
            let mut frames = Frames::new(&gpu, &stage)?;
            for (name, view, waves) in &place.views {
                let sea = place.sea.as_ref().filter(|_| *waves);
                painter.set_waves(sea).map_err(|e| Failure::Work(e.to_string()))?;
                let waves = sea.map(|sea| Waves::new(&gpu, sea)).transpose();
                frames.scenery.set_waves(waves.map_err(|e| Failure::Work(e.to_string()))?.flatten());
                let rows = self.view(&stage, sea, &mut painter, &mut frames, view, &mut sheet, &|| bar.inc(1))?;
                views.push(Viewed { land: place.name.clone(), view: name, rows });
            }
        }
        bar.finish_and_clear();
        if let Some(out) = &self.out {
            sheet.write(out)?;
            talk.note(format!("{}: by the processor, by the adapter, and four times their difference", out.display()));
        }
        let kind = match gpu.adapter.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        };
        let answer = Answer {
            adapter: Adapter {
                name: gpu.adapter.name.clone(),
                kind,
                backend: gpu.adapter.backend.to_string(),
                driver: format!("{} {}", gpu.adapter.driver, gpu.adapter.driver_info).trim().to_owned(),
                has_pass_times: gpu.times.is_some(),
            },
            threads: rayon::current_num_threads(),
            width: self.size.x,
            height: self.size.y,
            samples: self.samples,
            views,
        };
        if talk.json() { talk.print_json(answer) } else { talk.print(answer.table()) }
    }

    /// What is drawn.
    fn places(&self, talk: &mut Talk) -> Result<Vec<Place>, Failure> {
        let size = self.size;
        if !self.files.is_empty() {
            let subject = Subject::open(&self.files, self.reading, false, 1.0, WaterLevel::At(0.0), talk)?;
            let Subject { name, land, water, lakes, .. } = subject;
            let shot = picture::compose(&land, water.as_ref(), size);
            let above = picture::overhead(&land, water.as_ref(), size).view;
            let mut views = vec![("a view chosen by itself", shot.view, false)];
            // Of wide land that is the view chosen.
            if above != shot.view {
                views.push(("from above", above, false));
            }
            return Ok(vec![Place { name, land, water, lakes, sea: None, shot, views }]);
        }
        let land = coast::coast();
        let water = Water::flood(&land, 0.0);
        let shot = picture::coast_shot(size);
        let eye = shot.view.eye;
        let low = View::looking_at(eye, eye + DVec3::new(-300.0, 500.0, -60.0), 0.9, size);
        let views = vec![
            ("from its cliffs", shot.view, false),
            ("from its cliffs, with waves", shot.view, true),
            ("over its bay", low, false),
        ];
        let sea = water.as_ref().map(|water| Sea::over(&land, water, &coast::sea_state(), &|_| true)).transpose();
        let sea = sea.map_err(|e| Failure::Work(format!("the built-in coast: {e}")))?;
        let coast = Place { name: "the built-in coast".to_owned(), land, water, lakes: None, sea, shot, views };

        let land = mountains(2049);
        let over = |at: DVec2, above: f64, down: f64| {
            let position = land.origin() + at * land.extent();
            let eye = position.extend(f64::from(land.height_at(position).unwrap_or(0.0)) + above);
            View::looking_at(eye, eye + DVec3::new(1.0, 1.0, -down), 1.0, size)
        };
        let views = vec![
            ("50 m over the ground", over(DVec2::splat(0.1), 50.0, 0.1), false),
            ("3 km high", over(DVec2::splat(0.2), 3000.0, 1.0), false),
        ];
        let name = "mountains of 30 × 30 km, 2049 × 2049 samples".to_owned();
        let mountains = Place { name, land, water: None, lakes: None, sea: None, shot, views };
        Ok(vec![coast, mountains])
    }

    /// All ways to draw a view.
    #[allow(clippy::too_many_arguments, reason = "what is drawn, by what, and who is told")]
    fn view(
        &self,
        stage: &Stage,
        sea: Option<&Sea>,
        painter: &mut Painter,
        frames: &mut Frames,
        view: &View,
        sheet: &mut sheet::Sheet,
        done: &dyn Fn(),
    ) -> Result<Vec<Row>, Failure> {
        let settings = Settings { samples: self.samples, ..Settings::default() };
        let expected = stage.render_sea(sea, view, &settings, &|_| {});
        let how = Display { exposure: Exposure::Grey(expected.grey()), ..Display::default() };
        let expected = expected.display(&how);
        let against = |row: Row, picture: &Picture| {
            let (mean, far) = apart(&expected, &picture.display(&how));
            Row { mean_difference: Some(mean), far_share: Some(far), ..row }
        };
        let once = Settings { samples: 1, ..settings };
        let times = self.times(&mut || {
            stage.render_sea(sea, view, &once, &|_| {});
            Ok(Default::default())
        })?;
        let processor = times.row("processor, rays");
        let again = stage.render_sea(sea, view, &Settings { seed: 1, ..settings }, &|_| {});
        let noise = against(Row { drawn_by: "processor, another seed", ..Row::default() }, &again);
        done();

        frames.prepare(stage, view);
        let times = self.times(&mut || frames.draw(None, view))?;
        let picture = painter.picture(stage, None, view, self.samples, &|_| {});
        let picture = picture.map_err(|e| Failure::Work(e.to_string()))?;
        let rays = against(times.row("adapter, rays"), &picture);
        sheet.add(&expected, &picture.display(&how));
        done();

        let land = stage.land();
        land.error(Cell::face(0)); // bounds that are made once for a land
        let start = Instant::now();
        let mut drawing = Drawing::default();
        let mut lod = Patches::new(Limits { finest: land.finest_level(), triangles: TRIANGLES });
        lod.select(land, view, &mut drawing).map_err(|e| Failure::Work(e.to_string()))?;
        drawing.expand(land);
        let mut triangles = Triangles::default();
        triangles.set(&frames.gpu, &drawing.mesh).map_err(|e| Failure::Work(e.to_string()))?;
        let choose_ms = Some(start.elapsed().as_secs_f64() * 1e3);
        let times = self.times(&mut || frames.draw(Some(&triangles), view))?;
        done();
        let picture = painter.picture(stage, Some(&drawing.mesh), view, self.samples, &|_| {});
        let picture = picture.map_err(|e| Failure::Work(e.to_string()))?;
        let row = Row { choose_ms, triangles: Some(triangles.len()), ..times.row("adapter, mesh") };
        let mesh = against(row, &picture);
        done();
        Ok(vec![processor, rays, mesh, noise])
    }

    /// Times frames, which tell how long their passes took.
    fn times(&self, frame: &mut dyn FnMut() -> Result<Passes, GpuError>) -> Result<Times, Failure> {
        let mut frame = || frame().map_err(|e| Failure::Work(e.to_string()));
        frame()?; // caches, and what is made once
        let (begin, mut times) = (Instant::now(), Times::default());
        while times.frames.is_empty()
            || times.frames.len() < self.frames as usize && begin.elapsed().as_secs_f64() < LONGEST
        {
            let start = Instant::now();
            let passes = frame()?;
            times.frames.push(start.elapsed().as_secs_f64() * 1e3);
            times.passes.iter_mut().zip(passes).for_each(|(times, time)| times.extend(time));
        }
        times.frames.sort_by(f64::total_cmp);
        times.passes.iter_mut().for_each(|times| times.sort_by(f64::total_cmp));
        Ok(times)
    }
}

/// Times of the passes of a frame (ms), as far as they were recorded.
type Passes = [Option<f64>; PassTimes::PASSES.len()];

/// Times of frames and of their passes (ms), sorted.
#[derive(Default)]
struct Times {
    frames: Vec<f64>,
    passes: [Vec<f64>; PassTimes::PASSES.len()],
}

impl Times {
    fn row(&self, drawn_by: &'static str) -> Row {
        let at = |times: &[f64], share: f64| {
            times.get(((times.len() as f64 * share) as usize).min(times.len().saturating_sub(1))).copied()
        };
        let passes = PassTimes::PASSES.iter().zip(&self.passes);
        let passes = passes.filter_map(|(name, times)| Some((key(name), at(times, 0.5)?))).collect();
        Row { drawn_by, frame_ms: at(&self.frames, 0.5), frame_99_ms: at(&self.frames, 0.99), passes, ..Row::default() }
    }
}

/// What a pass is called in JSON.
fn key(pass: &str) -> String {
    format!("{}_ms", pass.replace(' ', "_"))
}

/// Draws frames without reading them back.
struct Frames {
    gpu: Gpu,
    renderer: Renderer,
    scenery: Scenery,
    shape: ShapeTexture,
}

impl Frames {
    fn new(gpu: &Gpu, stage: &Stage) -> Result<Frames, Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::Work(e.to_string());
        let Datum::Plane { origin, size } = stage.land().datum() else {
            return Err(Failure::Work("expected land on a plane, got another".into()));
        };
        let tables = stage.tables();
        let height = f64::from(stage.land().height_range().high).max(2.0);
        let scenery = Scenery::new(gpu, &tables, (origin, size), (height, &stage.sky_table(height)));
        let renderer = Renderer::new(gpu, wgpu::TextureFormat::Rgba8Unorm);
        Ok(Frames {
            gpu: gpu.clone(),
            renderer,
            scenery: scenery.map_err(|e| failed(&e))?,
            shape: ShapeTexture::new(gpu, stage.land()).map_err(|e| failed(&e))?,
        })
    }

    /// Makes ready what a window would make beside its frames: the sky from the eye's height.
    fn prepare(&mut self, stage: &Stage, view: &View) {
        if self.scenery.wants_sky(view.eye.z) {
            self.scenery.set_sky(&self.gpu, view.eye.z, &stage.sky_table(view.eye.z));
        }
    }

    /// One frame by triangles, or by rays; how long its passes took (ms).
    fn draw(&mut self, triangles: Option<&Triangles>, view: &View) -> Result<Passes, GpuError> {
        let gpu = &self.gpu;
        let ground = triangles.map_or(Ground::Rays { shape: &self.shape, pixels: 0.0 }, Ground::Triangles);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.renderer.draw(gpu, &mut encoder, &self.scenery, ground, view, Look::default());
        if let Some(times) = &gpu.times {
            times.keep(&mut encoder);
        }
        gpu.queue.submit([encoder.finish()]);
        let finished = gpu.device.poll(wgpu::PollType::wait_indefinitely());
        finished.map_err(|e| GpuError::Lost { adapter: gpu.adapter.name.clone(), reason: e.to_string() })?;
        gpu.check()?;
        gpu.times.as_ref().map_or(Ok(Default::default()), |times| times.read(gpu))
    }
}

/// Mean difference (steps of 255), and the share of pixels that are far off.
fn apart(a: &[[u8; 3]], b: &[[u8; 3]]) -> (f64, f64) {
    let (mut sum, mut far) = (0u64, 0usize);
    for (a, b) in a.iter().zip(b) {
        let steps = [0, 1, 2].map(|i| a[i].abs_diff(b[i]));
        sum += steps.iter().map(|&s| u64::from(s)).sum::<u64>();
        far += usize::from(steps.iter().any(|&s| s > FAR));
    }
    let pixels = a.len().max(1) as f64;
    (sum as f64 / (3.0 * pixels), far as f64 / pixels)
}

impl Answer {
    fn table(&self) -> String {
        let Adapter { name, kind, backend, driver, has_pass_times } = &self.adapter;
        let mut text = format!(
            "adapter: {name} ({kind}, {backend}{}{driver}); processor: {} threads\n\
             {} x {} pixels; frames with one ray a pixel, wall clock until the work is done; differences of pictures with {}, from the processor's:\n\
             mean of all channels in steps of 255, and pixels with more than {FAR} steps in any\n",
            if driver.is_empty() { "" } else { ", " },
            self.threads,
            self.width,
            self.height,
            self.samples
        );
        if *kind == "software" {
            text += "The adapter is a processor that stands for a graphics card: both run on the same cores, and its clock for passes is of no use\n";
        } else if !has_pass_times {
            text += "This adapter has no clock for its passes\n";
        }
        for viewed in &self.views {
            // Those of any row.
            let timed = |pass: &&str| viewed.rows.iter().any(|row| row.passes.contains_key(&key(pass)));
            let timed: Vec<&str> = PassTimes::PASSES.into_iter().filter(timed).collect();
            let passes: String = timed.iter().map(|pass| format!(" {pass:>11}")).collect();
            text += &format!("\n{}, {}\n", viewed.land, viewed.view);
            text += &format!(
                "  {:<24} {:>9} {:>9}{passes} {:>10} {:>10} {:>11} {:>8}\n",
                "drawn by", "frame ms", "99 %", "choose ms", "triangles", "difference", "far"
            );
            for row in &viewed.rows {
                let shown =
                    |number: Option<f64>, decimals: usize| number.map_or(String::new(), |n| format!("{n:.decimals$}"));
                let time = |pass: &&str| format!(" {:>11}", shown(row.passes.get(&key(pass)).copied(), 3));
                let passes: String = timed.iter().map(time).collect();
                text += &format!(
                    "  {:<24} {:>9} {:>9}{passes} {:>10} {:>10} {:>11} {:>8}\n",
                    row.drawn_by,
                    shown(row.frame_ms, 2),
                    shown(row.frame_99_ms, 2),
                    shown(row.choose_ms, 1),
                    row.triangles.map_or(String::new(), |n| n.to_string()),
                    shown(row.mean_difference, 2),
                    row.far_share.map_or(String::new(), |share| format!("{:.2} %", 100.0 * share))
                );
            }
        }
        text
    }
}
