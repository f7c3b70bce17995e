//! A picture of the built-in coast, or of raw heights, as a PNG file:
//!
//! ```text
//! cargo run --release --example picture -- OUT.png [name=value …]
//!   raw=FILE columns=N rows=N dx=M [dy=M] [void=H]   little-endian f32 heights, northern row first
//!   size=1280x720 samples=12 style=natural|tint|relief sun=AZIMUTH,ELEVATION visibility=M level=M stops=S overhead=1
//!   eye=X,Y,Z look=X,Y,Z fov=DEGREES
//! ```

use glam::{DVec2, DVec3, UVec2};
use littoral::field::{Land, Raster, Water, coast};
use littoral::picture::{Display, Scene, Settings, Stage, Style, Sun, coast_shot, compose, overhead};
use littoral::space::View;
use std::collections::HashMap;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("expected the name of a PNG file to write")?;
    let options: HashMap<String, String> =
        arguments.filter_map(|a| a.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()))).collect();
    let numbers = |key: &str| -> Option<Vec<f64>> {
        options.get(key).map(|v| v.split([',', 'x']).filter_map(|n| n.parse().ok()).collect())
    };
    let number = |key: &str| numbers(key).and_then(|n| n.first().copied());
    let started = Instant::now();
    let land = match options.get("raw") {
        Some(file) => raw(file, &number)?,
        None => coast::coast(),
    };
    eprintln!("land {:?}", started.elapsed());
    let water = Water::flood(&land, number("level").unwrap_or(0.0));
    let size = numbers("size").map_or(UVec2::new(1280, 720), |s| UVec2::new(s[0] as u32, s[1] as u32));
    let mut shot = match options.contains_key("raw") {
        true => compose(&land, water.as_ref(), size),
        false => coast_shot(size),
    };
    if options.contains_key("overhead") {
        shot = overhead(&land, water.as_ref(), size);
    }
    eprintln!("shot {:?}: eye {:.0}", started.elapsed(), shot.view.eye);
    if let (Some(eye), Some(look)) = (numbers("eye"), numbers("look")) {
        let fov = number("fov").unwrap_or(45.0).to_radians() as f32;
        shot.view = View::looking_at(DVec3::from_slice(&eye), DVec3::from_slice(&look), fov, size);
    }
    if let Some(sun) = numbers("sun") {
        shot.sun = Sun::new(sun[0].to_radians(), sun[1].to_radians());
    }
    if let Some(visibility) = number("visibility") {
        shot.air.visibility = visibility;
    }
    match options.get("style").map(String::as_str) {
        Some("natural") => shot.style = Style::Natural,
        Some("tint") => shot.style = Style::Tint,
        Some("relief") => shot.style = Style::Relief,
        _ => {}
    }
    let stage = Stage::new(&Scene::for_shot(&land, water.as_ref(), &shot));
    eprintln!("stage {:?}", started.elapsed());
    let settings = Settings { samples: number("samples").unwrap_or(12.0) as u32, ..Settings::default() };
    let picture = stage.render(&shot.view, &settings, &|_| {});
    eprintln!("render {:?}", started.elapsed());
    let display = Display { compensation: number("stops").unwrap_or(0.0) as f32, ..Display::default() };
    let pixels: Vec<u8> = picture.display(&display).into_iter().flatten().collect();
    eprintln!("display {:?}", started.elapsed());
    let mut encoder = png::Encoder::new(std::fs::File::create(&out)?, size.x, size.y);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(())
}

fn raw(file: &str, number: &dyn Fn(&str) -> Option<f64>) -> Result<Land, Failure> {
    let (columns, rows) = (number("columns").ok_or("columns=?")? as usize, number("rows").ok_or("rows=?")? as usize);
    let dx = number("dx").ok_or("dx=?")?;
    let void = number("void").map(|v| v as f32);
    let bytes = std::fs::read(file)?;
    let heights: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let southern_first = heights.chunks_exact(columns).rev().flatten();
    let masked = southern_first.map(|&h| if Some(h) == void || !(-12e3..9e3).contains(&h) { f32::NAN } else { h });
    let spacing = DVec2::new(dx, number("dy").unwrap_or(dx));
    Ok(Land::new(Raster::new(columns, rows, spacing, masked.collect())?))
}
