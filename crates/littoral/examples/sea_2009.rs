//! The sea of 2009: S. Liu, X. Xu and C. Chen's sum of M × N = 16 × 8 waves of a directional spectrum, at any point and instant. What is shorter
//! than all of these, for which they took a texture, comes from the tiles of `Cascades`.
//!
//! ```text
//! cargo run --release --example sea_2009 -- [OUT.png] [SECONDS] [WIDTH]
//! ```

use glam::{DVec2, DVec3, UVec2};
use littoral::field::{Land, Raster, Sea, Water};
use littoral::picture::{Air, Display, Scene, Settings, Stage, Sun};
use littoral::space::{Datum, View};
use littoral::waves::cascades::{Cascades, Options};
use littoral::waves::{SeaState, Superposition, heading_from_bearing};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().unwrap_or("sea_2009.png".into());
    let seconds = arguments.next().map_or(Ok(12.0), |seconds| seconds.parse())?;

    // A fresh breeze out of the south-west, and every one of its 128 waves.
    let state = SeaState::beaufort(5.0, heading_from_bearing(235.0))?;
    let waves = Superposition::of_state(&state, 16, 8)?;
    println!("{} waves, significant height {:.2} m", waves.waves().count(), state.significant_height());

    let shortest = waves.waves().map(|wave| wave.wavenumber.length()).fold(0.0, f64::max);
    let ripples = Cascades::new(&state, &Options { lowest: shortest, ..Options::default() })?;

    let land = Land::at(Raster::new(5, 5, DVec2::splat(1000.0), vec![-200.0; 25])?, DVec2::splat(-2000.0));
    let water = Water::flood(&land, 0.0);
    let datum = Datum::Plane { origin: land.origin(), size: land.extent() };
    let mut sea = Sea::new(datum, 0.0).with(Box::new(waves)).with(Box::new(ripples));
    sea.set_time(seconds);

    let width = arguments.next().map_or(Ok(1280), |width| width.parse())?;
    let size = UVec2::new(width, (width * 9 / 16).max(1));
    let view = View::looking_at(DVec3::new(0.0, 0.0, 9.0), DVec3::new(-60.0, 45.0, 2.0), 0.7, size);
    let sun = Sun::new(318f64.to_radians(), 8f64.to_radians());
    let air = Air { visibility: 30_000.0, ..Air::default() };
    let scene = Scene { sun, air, ..Scene::new(&land, water.as_ref()) };
    let picture =
        Stage::new(&scene).render_sea(Some(&sea), &view, &Settings { samples: 16, ..Settings::default() }, &|_| {});
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(std::fs::File::create(&out)?), size.x, size.y);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(picture.display(&Display::default()).as_flattened())?;
    println!("{out}: the sea at {seconds} s");
    Ok(())
}
