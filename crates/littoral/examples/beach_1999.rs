//! The beach of 1999: a polyline for a shore, a bed that falls off evenly from it, and D. Peachey's waves, which feel the bottom. A designer draws
//! the shore and says how steep the beach is and how wide the surf; crests slow down, bunch up, turn to the shore and break by themselves.
//!
//! ```text
//! cargo run --release --example beach_1999 -- [OUT.png] [SECONDS] [WIDTH]
//! ```

use glam::{DVec2, DVec3, UVec2};
use littoral::field::{Land, Raster, Sea, Water, noise::gradient};
use littoral::picture::{Air, Display, Scene, Settings, Stage, Sun};
use littoral::space::{Datum, View};
use littoral::waves::cascades::{Cascades, Options};
use littoral::waves::{BLOCK, Bounds, Motion, Points, Velocity, WaveModel};
use littoral::waves::{Beach, Depths, Path, Peachey, SeaState, Shelter, Sheltered, Surf, Swell, heading_from_bearing};
use std::error::Error;
use std::f64::consts::TAU;

/// Grid of the bed: nodes eastward and northward, metres between them.
const GRID: (usize, usize, f64) = (600, 450, 2.0);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().unwrap_or("beach_1999.png".into());
    let seconds = arguments.next().map_or(Ok(8.0), |seconds| seconds.parse())?;

    // What the designer draws: the sea lies to the left of one who walks along the shore.
    let bay = |x: f64| 545.0 + 110.0 * (-((x - 620.0) / 300.0).powi(2)).exp() + 14.0 * (x / 90.0).sin();
    let shore = (0..=70).map(|i| 1400.0 - 25.0 * f64::from(i)).map(|x| DVec2::new(x, bay(x))).collect();
    let beach = Beach { shore, slope: 0.022, surf_width: 85.0 };
    let (columns, rows, spacing) = GRID;
    let bed = beach.depths(DVec2::ZERO, spacing, columns, rows)?;

    // A swell is a few trains of nearly one length and direction: they make groups of higher and lower waves.
    let train = |amplitude: f64, period: f64, from: f64, phase: f64| Swell {
        amplitude,
        period,
        heading: heading_from_bearing(from),
        phase,
    };
    let swell = [
        train(0.75, 8.0, 172.0, 0.0),
        train(0.3, 7.1, 186.0, 2.0),
        train(0.22, 9.2, 160.0, 4.0),
        train(0.12, 5.2, 196.0, 1.0),
    ];
    let breaking = beach.breaking(swell.iter().map(|train| train.amplitude).sum())?;
    let waves = Peachey::new(&bed, &swell, Path::Refracted, Surf { shoaling: false, breaking })?;
    // What the paper's texture of water gave: the small waves of a light breeze.
    let breeze = SeaState::beaufort(1.5, heading_from_bearing(210.0))?;
    let small = Cascades::new(&breeze, &Options { lowest: TAU / 4.0, ..Options::default() })?;
    let room = bed.depths.iter().map(|depth| depth.clamp(0.0, 1.0)).collect();
    let small = Sheltered::new(Box::new(small), Shelter::new(bed.origin, DVec2::splat(spacing), columns, rows, room)?);

    let place = |node: usize| DVec2::new((node % columns) as f64, (node / columns) as f64) * spacing;
    let heights = bed.depths.iter().enumerate().map(|(node, depth)| ashore(place(node), -depth)).collect();
    let land = Land::at(Raster::new(columns, rows, DVec2::splat(spacing), heights)?, DVec2::ZERO);
    let water = Water::flood(&land, 0.0);
    let datum = Datum::Plane { origin: land.origin(), size: land.extent() };
    let mut sea = Sea::new(datum, 0.0).with(Box::new(White::new(waves, &bed, &beach, breaking))).with(Box::new(small));
    sea.set_time(seconds);

    let width = arguments.next().map_or(Ok(1280), |width| width.parse())?;
    let size = UVec2::new(width, (width * 9 / 16).max(1));
    let view = View::looking_at(DVec3::new(270.0, 566.0, 12.0), DVec3::new(600.0, 585.0, -6.0), 0.55, size);
    let sun = Sun::new(150f64.to_radians(), 30f64.to_radians());
    let air = Air { visibility: 45_000.0, ..Air::default() };
    let scene = Scene { sun, air, ..Scene::new(&land, water.as_ref()) };
    let picture =
        Stage::new(&scene).render_sea(Some(&sea), &view, &Settings { samples: 16, ..Settings::default() }, &|_| {});
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(std::fs::File::create(&out)?), size.x, size.y);
    encoder.set_color(png::ColorType::Rgb);
    encoder
        .write_header()?
        .write_image_data(picture.display(&Display { compensation: 0.5, ..Display::default() }).as_flattened())?;
    println!("{out}: the sea at {seconds} s");
    Ok(())
}

/// Dry land of a height that the slope of the beach gives: dunes and hills behind the beach.
fn ashore(place: DVec2, height: f32) -> f32 {
    let inland = (height - 1.6).max(0.0);
    let hills = gradient(place / 260.0, 1).value
        + 0.5 * gradient(place / 110.0, 2).value
        + 0.2 * gradient(place / 37.0, 3).value;
    height + inland * (1.2 + 2.5 * hills as f32).max(0.0) * (inland / (inland + 1.5))
}

/// Peachey's waves with the foam of their surf: white where a crest is as high as its depth lets it be, and fading after that. No step of the
/// past is kept: waves of any instant can be asked.
struct White {
    waves: Peachey,
    /// The same at earlier instants (s before).
    before: Vec<(f64, Peachey)>,
    bed: Depths,
    /// Height over depth at which waves break, and depth (m) from which on they do.
    breaking: f32,
    deepest: f32,
}

impl White {
    fn new(waves: Peachey, bed: &Depths, beach: &Beach, breaking: f64) -> White {
        let before = (1..=8).map(|i| (0.3 * f64::from(i), waves.clone())).collect();
        let deepest = (beach.slope * beach.surf_width) as f32;
        White { waves, before, bed: bed.clone(), breaking: breaking as f32, deepest }
    }

    /// Depth (m) of the node nearest to a place.
    fn depth(&self, x: f64, y: f64) -> f32 {
        let index = |at: f64, count: usize| (at / self.bed.spacing).round().clamp(0.0, count as f64 - 1.0) as usize;
        self.bed.depths[index(y, self.bed.rows) * self.bed.columns + index(x, self.bed.columns)]
    }
}

impl WaveModel for White {
    fn set_time(&mut self, seconds: f64) {
        self.waves.set_time(seconds);
        self.before.iter_mut().for_each(|(earlier, waves)| waves.set_time(seconds - *earlier));
    }

    fn time(&self) -> f64 {
        self.waves.time()
    }

    fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        self.waves.add_displacement(points, motion);
    }

    fn add_motion(&self, points: &Points, motion: &mut Motion) {
        self.waves.add_motion(points, motion);
        let depths: [f32; BLOCK] = std::array::from_fn(|i| self.depth(points.x[i], points.y[i]));
        if !depths.iter().any(|depth| *depth < self.deepest) {
            return;
        }
        for (earlier, waves) in std::iter::once((0.0, &self.waves)).chain(self.before.iter().map(|(t, w)| (*t, w))) {
            let mut then = Motion::STILL;
            waves.add_displacement(points, &mut then);
            let left = 0.9 * (-earlier / 1.6).exp() as f32;
            for (i, depth) in depths.iter().enumerate() {
                // How near a crest is to the height at which it breaks.
                let high = then.dz[i] / (0.5 * self.breaking * depth.clamp(0.15, 1e3));
                let inside = ((self.deepest - depth) / (0.25 * self.deepest)).clamp(0.0, 1.0);
                motion.foam[i] = motion.foam[i].max(left * inside * ((high - 0.25) / 0.35).clamp(0.0, 1.0));
            }
        }
    }

    fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        self.waves.add_velocity(points, depths, velocity);
    }

    fn bounds(&self) -> Bounds {
        self.waves.bounds()
    }

    fn roughness(&self, wavelength: f32) -> f32 {
        self.waves.roughness(wavelength)
    }
}
