//! Every method of detail on the same view: its picture, its mesh, and how far each pixel is from its place.
//!
//! ```text
//! cargo run --release --example methods -- [OUT.png] [TOLERANCE PIXELS] [WIDTH OF ONE PICTURE]
//! ```
//!
//! Red is drawn too high, blue too low, as strong as the tolerance allows; grey is
//! water, black sky.

use glam::{UVec2, Vec3};
use littoral::field::{Water, coast};
use littoral::lod::{Drawing, Limits, Lod, Nested, Patches, Quadtree, Roam, Strips, Whole};
use littoral::picture::{Display, Exposure, Meshes, Scene, Settings, Stage, Sun, mesh_errors};
use littoral::space::View;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().unwrap_or("methods.png".into());
    let tolerance: f32 = arguments.next().map_or(Ok(2.0), |pixels| pixels.parse())?;
    let width: u32 = arguments.next().map_or(Ok(400), |width| width.parse())?;
    let size = UVec2::new(width, (width * 9 / 16).max(1));

    let land = coast::coast();
    let water = Water::flood(&land, 0.0);
    let (azimuth, elevation) = coast::sun();
    let scene = Scene { sun: Sun::new(azimuth, elevation), ..Scene::new(&land, water.as_ref()) };
    let stage = Stage::new(&scene);
    let view = View { tolerance_pixels: tolerance, ..coast::view(size) };

    let limits = Limits { finest: stage.land().finest_level(), triangles: 1_000_000 };
    let methods: [(&str, Box<dyn Lod>); 6] = [
        ("whole", Box::new(Whole::new(limits))),
        ("nested", Box::new(Nested::new(limits))),
        ("quadtree", Box::new(Quadtree::new(limits))),
        ("patches", Box::new(Patches::new(limits))),
        ("strips", Box::new(Strips::new(limits))),
        ("roam", Box::new(Roam::new(limits))),
    ];
    let settings = Settings { samples: 16, ..Settings::default() };
    let row_bytes = (3 * size.x * 3) as usize;
    let mut sheet = vec![0u8; row_bytes * (size.y as usize) * methods.len()];
    let mut grey = None;
    for (row, (name, mut lod)) in methods.into_iter().enumerate() {
        let mut drawing = Drawing::default();
        let reached = lod.select(stage.land(), &view, &mut drawing)?;
        drawing.expand(stage.land());
        let mesh = &drawing.mesh;
        let errors = mesh_errors(mesh, stage.land(), &view);
        let mut draw = |wireframe| {
            let meshes = Meshes { ground: Some(mesh), wireframe, ..Meshes::default() };
            let picture = stage.render_meshes(&meshes, None, &view, &settings, &|_| {});
            // All pictures are exposed alike.
            let grey = *grey.get_or_insert(picture.grey());
            (picture.display(&Display { exposure: Exposure::Grey(grey), ..Display::default() }), picture.height)
        };
        let (picture, heights) = draw(false);
        let (wires, _) = draw(true);
        let map: Vec<[u8; 3]> = errors
            .iter()
            .zip(&heights)
            .map(|(&error, height)| match (error.is_nan() || height.is_nan(), *height <= 0.0) {
                (true, _) => [0; 3],
                // The bed is not seen.
                (false, true) => [200, 206, 212],
                (false, false) => tint(error / tolerance),
            })
            .collect();
        for (column, pixels) in [picture, wires, map].iter().enumerate() {
            for (y, line) in pixels.chunks(size.x as usize).enumerate() {
                let at = (row * size.y as usize + y) * row_bytes + column * (size.x * 3) as usize;
                sheet[at..][..line.len() * 3].copy_from_slice(line.as_flattened());
            }
        }
        let worst = errors.iter().filter(|e| !e.is_nan()).fold(0.0f32, |m, e| m.max(e.abs()));
        println!(
            "{name:<10} {:>8} triangles, within {:.2} pixels, worst {worst:.2}",
            mesh.triangles.len(),
            reached.pixels
        );
    }
    let mut encoder = png::Encoder::new(
        std::io::BufWriter::new(std::fs::File::create(&out)?),
        3 * size.x,
        size.y * (sheet.len() / row_bytes / size.y as usize) as u32,
    );
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&sheet)?;
    println!("{out}: picture, mesh and error, tolerance {tolerance} pixels");
    Ok(())
}

/// White for right, red for high, blue for low.
fn tint(share: f32) -> [u8; 3] {
    let strength = share.abs().min(1.0).sqrt();
    let full = if share > 0.0 { Vec3::new(0.80, 0.10, 0.08) } else { Vec3::new(0.08, 0.22, 0.78) };
    (Vec3::splat(0.97).lerp(full, strength) * 255.0).to_array().map(|v| v as u8)
}
