//! Waves that come to a shore, seen from above, as a PNG file: the built-in coast, or raw heights.
//!
//! ```text
//! cargo run --release --example shore -- OUT.png [name=value …]
//!   sea=STATE           such as sea=hs=2,tp=9,from=200; words as in littoral's sea states
//!   depth=M             depth of the open sea (m); by itself that of the seaward edge
//!   time=S size=1200    longer side of the picture in pixels
//!   waves=32            number of waves
//!   raw=FILE columns=N rows=N dx=M dy=M    little-endian f32 heights, northern row first
//! ```

use glam::{DVec2, Vec2};
use littoral::field::coast;
use littoral::waves::shore::{Bed, ShoreSea};
use littoral::waves::{BLOCK, Motion, Points, SeaState, WaveModel};
use std::collections::HashMap;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

/// Heights (m) on a grid, southern row first.
struct Ground {
    columns: usize,
    rows: usize,
    spacing: DVec2,
    heights: Vec<f32>,
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("expected the name of a PNG file to write")?;
    let options: HashMap<String, String> =
        arguments.filter_map(|a| a.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()))).collect();
    let number = |key: &str| options.get(key).and_then(|v| v.parse::<f64>().ok());
    let ground = match options.get("raw") {
        Some(file) => raw(file, &number)?,
        None => built_in(),
    };
    let depths: Vec<f32> = ground.heights.iter().map(|h| -h).collect();
    let sea_nodes = flood(&ground);
    let bed = Bed::new(DVec2::ZERO, ground.spacing, ground.columns, ground.rows, depths, |i| sea_nodes[i])?;
    let mut state: SeaState = options.get("sea").map_or("hs=1.6,tp=9,from=200", String::as_str).parse()?;
    state.depth = number("depth").unwrap_or_else(|| bed.edge_depth());
    let started = Instant::now();
    let mut sea = ShoreSea::new(&bed, &state, number("waves").unwrap_or(32.0) as usize)?;
    eprintln!("solved in {:?}; the open sea is {:.1} m deep", started.elapsed(), state.depth);
    sea.set_time(number("time").unwrap_or(100.0));

    let extent = ground.spacing * DVec2::new((ground.columns - 1) as f64, (ground.rows - 1) as f64);
    let pixel = extent.max_element() / number("size").unwrap_or(1200.0);
    let (width, height) = ((extent.x / pixel) as u32, (extent.y / pixel) as u32);
    let mut pixels = vec![0u8; (width * height * 3) as usize];
    for row in 0..height {
        for block in 0..width.div_ceil(BLOCK as u32) {
            let mut points = Points::at(0.0, 0.0);
            points.footprint = [pixel as f32; BLOCK];
            for l in 0..BLOCK {
                points.x[l] = (f64::from(block) * BLOCK as f64 + l as f64 + 0.5) * pixel;
                points.y[l] = extent.y - (f64::from(row) + 0.5) * pixel;
            }
            let mut motion = Motion::STILL;
            sea.add_motion(&points, &mut motion);
            for l in 0..BLOCK {
                let column = block * BLOCK as u32 + l as u32;
                if column >= width {
                    break;
                }
                let (ground_height, ground_slope) = ground.at(DVec2::new(points.x[l], points.y[l]));
                let colour = if ground_height > motion.dz[l] {
                    land(ground_height, ground_slope)
                } else {
                    let slope = Vec2::new(motion.slope_x[l], motion.slope_y[l]);
                    let depth = motion.dz[l] - ground_height;
                    water(depth, slope, motion.foam[l])
                };
                let at = ((row * width + column) * 3) as usize;
                for (pixel, value) in pixels[at..at + 3].iter_mut().zip(colour) {
                    *pixel = (value.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0 + 0.5) as u8;
                }
            }
        }
    }
    let mut encoder = png::Encoder::new(std::fs::File::create(&out)?, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(())
}

impl Ground {
    /// Height (m) and slope at a place, bilinear.
    fn at(&self, place: DVec2) -> (f32, Vec2) {
        let p =
            (place / self.spacing).clamp(DVec2::ZERO, DVec2::new((self.columns - 2) as f64, (self.rows - 2) as f64));
        let (c, r) = (p.x as usize, p.y as usize);
        let f = (p - p.floor()).as_vec2();
        let at = |c: usize, r: usize| self.heights[r * self.columns + c];
        let (a, b, d, e) = (at(c, r), at(c + 1, r), at(c, r + 1), at(c + 1, r + 1));
        let (low, high) = (a + f.x * (b - a), d + f.x * (e - d));
        let slope = Vec2::new((b - a) + f.y * ((e - d) - (b - a)), high - low) / self.spacing.as_vec2();
        (low + f.y * (high - low), slope)
    }
}

fn land(height: f32, slope: Vec2) -> [f32; 3] {
    let light = (0.72 - 0.5 * slope.dot(Vec2::new(0.8, -0.6))) / (1.0 + slope.length_squared()).sqrt();
    let sand = 1.0 - ((height - 1.5) / 3.0).clamp(0.0, 1.0);
    let wet = 1.0 - ((height - 0.1) / 0.9).clamp(0.0, 1.0);
    let [r, g, b] = [0.16 + 0.33 * sand, 0.17 + 0.23 * sand, 0.08 + 0.17 * sand];
    [r, g, b].map(|c| c * light.max(0.05) * 1.3 * (1.0 - 0.4 * wet))
}

fn water(depth: f32, slope: Vec2, foam: f32) -> [f32; 3] {
    // The bed through the water, its colour and the sky on it, by which way a facet leans: a low light in the north-west.
    let left = [0.45f32, 0.11, 0.08].map(|a| (-a * 2.0 * depth).exp());
    let sand = [0.46, 0.38, 0.26];
    let deep = [0.010, 0.055, 0.085];
    let lean = 4.5 * slope.dot(Vec2::new(0.35, -0.94));
    let sky = (0.16 + 0.3 * lean).clamp(0.0, 0.9);
    let mut colour = [0.0; 3];
    for n in 0..3 {
        let body = deep[n] + (sand[n] - deep[n]) * left[n];
        let seen = body * (0.85 + 0.5 * lean).clamp(0.2, 2.0) + [0.45, 0.55, 0.65][n] * sky * sky;
        colour[n] = seen + foam * (0.85 - seen);
    }
    colour
}

/// Which nodes below 0 are joined to the open edge.
fn flood(ground: &Ground) -> Vec<bool> {
    let (columns, rows) = (ground.columns, ground.rows);
    let mut wet = vec![false; columns * rows];
    let edge = |i: usize| {
        i.is_multiple_of(columns) || i % columns == columns - 1 || i / columns == 0 || i / columns == rows - 1
    };
    let mut open: Vec<usize> = (0..columns * rows).filter(|&i| edge(i) && ground.heights[i] < 0.0).collect();
    open.iter().for_each(|&i| wet[i] = true);
    while let Some(i) = open.pop() {
        let (c, r) = (i % columns, i / columns);
        let mut visit = |c: usize, r: usize| {
            let j = r * columns + c;
            if !wet[j] && ground.heights[j] < 0.0 {
                wet[j] = true;
                open.push(j);
            }
        };
        if c > 0 {
            visit(c - 1, r);
        }
        if c + 1 < columns {
            visit(c + 1, r);
        }
        if r > 0 {
            visit(c, r - 1);
        }
        if r + 1 < rows {
            visit(c, r + 1);
        }
    }
    wet
}

/// The headland of the built-in coast and its bay.
fn built_in() -> Ground {
    let land = coast::coast();
    let raster = land.raster();
    // The southern half, where the sea is.
    let (columns, rows) = (raster.columns(), raster.rows() * 55 / 100);
    let heights = raster.heights()[..columns * rows].to_vec();
    Ground { columns, rows, spacing: raster.spacing(), heights }
}

fn raw(file: &str, number: &dyn Fn(&str) -> Option<f64>) -> Result<Ground, Failure> {
    let (columns, rows) = (number("columns").ok_or("columns=?")? as usize, number("rows").ok_or("rows=?")? as usize);
    let dx = number("dx").ok_or("dx=?")?;
    let spacing = DVec2::new(dx, number("dy").unwrap_or(dx));
    let bytes = std::fs::read(file)?;
    let numbers: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    if numbers.len() != columns * rows || columns < 2 || rows < 2 {
        return Err(format!("expected {columns} × {rows} heights, got {}", numbers.len()).into());
    }
    let heights = numbers.chunks_exact(columns).rev().flatten().copied().collect();
    Ok(Ground { columns, rows, spacing, heights })
}
