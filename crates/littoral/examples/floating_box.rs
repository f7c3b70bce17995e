//! A box that floats: buoyancy from bulk queries of the sea.
//!
//! The box is 96 small cells. Sixty times a second all of them ask the sea where its surface is and how the water runs; what of a cell is under
//! water is pushed up by the water it displaces (Archimedes) and dragged along with the water's speed. That is all: it heaves, pitches, rolls and
//! drifts, in any sea that a `SeaState` can name.
//!
//! ```text
//! cargo run --release --example floating_box                    a minute in each sea from calm to Beaufort 10, as numbers
//! cargo run --release --example floating_box -- film 5 frames/  six seconds at Beaufort 5, as pictures in a folder
//! ```

use glam::{DMat3, DQuat, DVec2, DVec3, UVec2, Vec3};
use littoral::field::{Land, Raster, Sea, Water};
use littoral::picture::{Air, Display, Picture, Scene, Settings, Stage, Sun};
use littoral::space::{Datum, View};
use littoral::waves::{STANDARD_GRAVITY, SeaState};
use std::error::Error;

const SIZE: DVec3 = DVec3::new(6.0, 3.0, 2.0);
const CELLS: [usize; 3] = [8, 4, 3];
/// kg/m³
const WATER: f64 = 1026.0;
const BOX: f64 = 420.0;
/// How fast water carries a cell along (1/s).
const DRAG: f64 = 0.9;
const STEP: f64 = 1.0 / 60.0;

/// A rigid box on the sea.
struct Float {
    position: DVec3,
    attitude: DQuat,
    velocity: DVec3,
    /// Angular velocity (rad/s).
    spin: DVec3,
}

impl Float {
    fn new() -> Float {
        Float { position: DVec3::ZERO, attitude: DQuat::IDENTITY, velocity: DVec3::ZERO, spin: DVec3::ZERO }
    }

    /// Where the middles of the cells are (m).
    fn cells(&self) -> Vec<DVec3> {
        let [nx, ny, nz] = CELLS;
        let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        (0..nx * ny * nz)
            .map(|i| DVec3::new(share(i % nx, nx), share(i / nx % ny, ny), share(i / (nx * ny), nz)) * SIZE)
            .map(|cell| self.position + self.attitude * cell)
            .collect()
    }

    /// One step under the forces of the sea, which stands at the instant.
    fn step(&mut self, sea: &Sea) {
        let cells = self.cells();
        let places: Vec<DVec2> = cells.iter().map(|c| c.truncate()).collect();
        let (mut heights, mut currents) = (vec![0.0; cells.len()], vec![Vec3::ZERO; cells.len()]);
        sea.heights_at(&places, &mut heights);
        sea.velocities_at(&cells, &mut currents);

        let volume = SIZE.element_product() / cells.len() as f64;
        let tall = SIZE.z / CELLS[2] as f64;
        let mass = BOX * SIZE.element_product();
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for ((cell, height), current) in cells.iter().zip(&heights).zip(&currents) {
            let under = ((height - cell.z) / tall + 0.5).clamp(0.0, 1.0);
            let arm = *cell - self.position;
            let speed = self.velocity + self.spin.cross(arm);
            let push = WATER * volume * under * (DVec3::Z * STANDARD_GRAVITY + (current.as_dvec3() - speed) * DRAG);
            force += push;
            torque += arm.cross(push);
        }
        self.velocity += (force / mass - DVec3::Z * STANDARD_GRAVITY) * STEP;
        let square = SIZE * SIZE;
        let inertia = DVec3::new(square.y + square.z, square.x + square.z, square.x + square.y) * (mass / 12.0);
        let axes = DMat3::from_quat(self.attitude);
        self.spin += axes * ((axes.transpose() * torque) / inertia) * STEP;
        self.position += self.velocity * STEP;
        self.attitude = (DQuat::from_scaled_axis(self.spin * STEP) * self.attitude).normalize();
    }

    /// How far it leans (rad).
    fn tilt(&self) -> f64 {
        (self.attitude * DVec3::Z).z.clamp(-1.0, 1.0).acos()
    }
}

/// Open sea of a Beaufort number, out of the west.
fn open_sea(beaufort: f64) -> Result<Sea, Box<dyn Error>> {
    let datum = Datum::Plane { origin: DVec2::splat(-2000.0), size: DVec2::splat(4000.0) };
    Ok(Sea::of_state(datum, 0.0, &SeaState::beaufort(beaufort, 0.3)?)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments[..] {
        [] => numbers(),
        [film, beaufort, folder] if film == "film" => pictures(beaufort.parse()?, folder),
        _ => Err("expected nothing, or: film BEAUFORT FOLDER".into()),
    }
}

fn numbers() -> Result<(), Box<dyn Error>> {
    println!("Beaufort   Hs (m)   draught (m)   heave ± (m)   greatest tilt (°)   drift (m/s)");
    for beaufort in 0..=10 {
        let state = SeaState::beaufort(f64::from(beaufort), 0.3)?;
        let mut sea = open_sea(f64::from(beaufort))?;
        let mut float = Float::new();
        let (mut below, mut heave, mut tilt, steps) = (0.0, 0.0, 0.0f64, 3600);
        for i in 0..steps {
            sea.set_time(f64::from(i) * STEP);
            float.step(&sea);
            let surface = sea.height_at(float.position.truncate());
            below += (surface - float.position.z + 0.5 * SIZE.z) / f64::from(steps);
            heave += float.position.z.powi(2) / f64::from(steps);
            tilt = tilt.max(float.tilt());
        }
        let (height, drift) = (state.significant_height(), float.position.truncate().length() / 60.0);
        println!(
            "{beaufort:8}   {height:6.2}   {below:11.2}   {:11.2}   {:17.1}   {drift:11.2}",
            heave.sqrt(),
            tilt.to_degrees()
        );
    }
    println!("at rest it should draw {:.2} m", SIZE.z * BOX / WATER);
    Ok(())
}

fn pictures(beaufort: f64, folder: &str) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let mut sea = open_sea(beaufort)?;
    let land = Land::at(Raster::new(5, 5, DVec2::splat(1000.0), vec![-200.0; 25])?, DVec2::splat(-2000.0));
    let water = Water::flood(&land, 0.0);
    let size = UVec2::new(640, 360);
    let scene = Scene {
        sun: Sun::new(200f64.to_radians(), 16f64.to_radians()),
        air: Air { visibility: 30_000.0, ..Air::default() },
        ..Scene::new(&land, water.as_ref())
    };
    let stage = Stage::new(&scene);
    let mut float = Float::new();
    // Until it has found its way of floating.
    for i in 0..600 {
        sea.set_time(f64::from(i) * STEP);
        float.step(&sea);
    }
    let middle = float.position;
    let view = View::looking_at(middle + DVec3::new(-9.0, -26.0, 7.0), middle, 0.62, size);
    let mut grey = None;
    for frame in 0..180 {
        for half in 0..2 {
            sea.set_time(f64::from(600 + 2 * frame + half) * STEP);
            float.step(&sea);
        }
        let mut picture = stage.render_sea(Some(&sea), &view, &Settings { samples: 8, ..Settings::default() }, &|_| {});
        let grey = *grey.get_or_insert(picture.grey());
        paint(&float, &view, &scene.sun.direction(0.0), &mut picture, grey);
        let display = Display { exposure: littoral::picture::Exposure::Grey(grey), ..Display::default() };
        let file = std::fs::File::create(format!("{folder}/frame_{frame:05}.png"))?;
        let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), size.x, size.y);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header()?.write_image_data(picture.display(&display).as_flattened())?;
    }
    println!("join the frames with: ffmpeg -framerate 30 -i {folder}/frame_%05d.png -pix_fmt yuv420p box.mp4");
    Ok(())
}

/// Draws the box over a picture, where the sea does not hide it.
fn paint(float: &Float, view: &View, sun: &DVec3, picture: &mut Picture, grey: f32) {
    let back = float.attitude.inverse();
    let eye = back * (view.eye - float.position);
    for (i, light) in picture.radiance.iter_mut().enumerate() {
        let (x, y) = (i as u32 % picture.size.x, i as u32 / picture.size.x);
        let mut sum = Vec3::ZERO;
        for sample in 0..4 {
            let at = glam::Vec2::new(x as f32 + [0.4, 0.9, 0.1, 0.6][sample], y as f32 + [0.1, 0.4, 0.6, 0.9][sample]);
            let ahead = view.direction(at).as_dvec3();
            let ray = back * ahead;
            // Where the ray enters and leaves each pair of faces.
            let (a, b) = ((-0.5 * SIZE - eye) / ray, (0.5 * SIZE - eye) / ray);
            let (near, far) = (a.min(b), a.max(b));
            let enter = near.max_element();
            let hidden = f64::from(picture.depth[i]) < enter;
            sum += if enter > far.min_element() || enter < 0.0 || hidden {
                Vec3::from_array(*light)
            } else {
                let face = DVec3::select(near.cmpeq(DVec3::splat(enter)), -ray.signum(), DVec3::ZERO);
                let normal = (float.attitude * face).normalize();
                let lit = 3.2 * normal.dot(*sun).max(0.0) as f32 + 0.9 + 0.6 * normal.z as f32;
                // Planks.
                let along = (eye + ray * enter).x / 0.5;
                let tone = 0.85 + 0.15 * (along.floor() as f32 * 2.4).sin();
                Vec3::new(0.52, 0.30, 0.15) * (tone * lit * grey)
            };
        }
        *light = (sum / 4.0).to_array();
    }
}
