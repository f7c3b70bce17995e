//! Meshes of one fixed raster on one thread: time, triangles, and the true greatest error of each.
//!
//! The scene is 30 km of fractal noise in 4097² samples, or the raw `f32` heights of a square that the environment variable
//! `LITTORAL_MAP` names. `LITTORAL_ERROR` is the error to ask for (m), 10 by default. Where `LITTORAL_MESHES` names a folder the
//! meshes are written there as raw 32-bit integers, so that others can check them. Medians of processor time.

mod clock;

use clock::median;
use glam::DVec2;
use littoral::field::Raster;
use littoral::field::noise::Fbm;
use littoral::memory::collected;
use littoral::mesh::measure::{measure, verify, verify_delaunay};
use littoral::mesh::rtin::{Rtin, Scratch};
use littoral::mesh::tiled::{Method, Tiling};
use littoral::mesh::{MeshError, Triangulation, tin};
use std::hint::black_box;

const EXTENT: f64 = 30_000.0;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("one thread");
    let raster = match std::env::var("LITTORAL_MAP") {
        Ok(path) => measured(&path),
        Err(_) => invented(4097),
    };
    let error = std::env::var("LITTORAL_ERROR").ok().and_then(|text| text.parse().ok()).unwrap_or(10.0);
    println!("{} × {} samples, {error} m, one thread", raster.columns(), raster.rows());
    let samples = raster.heights().len() as f64;
    let seconds = median(5, || drop(black_box(Rtin::new(&raster))));
    let mut rtin = Rtin::new(&raster);
    let again = median(5, || rtin.renew(&raster));
    let bytes = rtin.bytes() as f64 / samples;
    println!(
        "rtin: prepared in {:.1} ms ({:.1} in memory used before), {bytes:.2} bytes a sample",
        seconds * 1e3,
        again * 1e3
    );
    let (mut mesh, mut scratch) = (Triangulation::default(), Scratch::default());
    let mut extract = || rtin.extract_with(&raster, error, &mut scratch, &mut mesh).expect("a mesh");
    extract();
    let seconds = median(21, extract);
    let each = seconds * 1e9 / mesh.triangles.len() as f64;
    println!("rtin: extracted in {:.2} ms, {each:.1} ns a triangle", seconds * 1e3);
    report("rtin", &raster, &mesh);
    assert_eq!(verify(&raster, &mesh), Ok(()));
    let seconds = median(3, || mesh = tin::triangulate(&raster, error, &|_| true).expect("a mesh"));
    println!("tin: {:.0} ms", seconds * 1e3);
    report("tin", &raster, &mesh);
    assert_eq!((verify(&raster, &mesh), verify_delaunay(&raster, &mesh)), (Ok(()), Ok(())));
    let tiling = Tiling { size: [raster.columns(), raster.rows()], side: 512 };
    for method in [Method::Rtin, Method::Tin] {
        let (mut triangles, mut worst) = (0, 0f64);
        let seconds = median(1, || {
            let mut read = |window: littoral::field::Window| {
                let rows = window.row..window.row + window.rows;
                let heights =
                    rows.flat_map(|row| &raster.heights()[row * raster.columns() + window.column..][..window.columns]);
                Ok::<_, MeshError>(
                    Raster::new(window.columns, window.rows, raster.spacing(), heights.copied().collect())
                        .expect("a window"),
                )
            };
            let mut write = |_, part: &Raster, mesh: &Triangulation| {
                triangles += mesh.triangles.len();
                worst = worst.max(measure(part, mesh).max_error);
                Ok(())
            };
            tiling.mesh(method, error, &mut read, &mut write).expect("tiles");
        });
        println!(
            "{method:?} in tiles of 512²: {triangles} triangles, {worst:.6} m, {:.0} ms with measuring",
            seconds * 1e3
        );
    }
}

fn report(name: &str, raster: &Raster, mesh: &Triangulation) {
    let mut measured = None;
    let seconds = median(3, || measured = Some(measure(raster, mesh)));
    let found = measured.expect("measured");
    println!(
        "{name}: {} triangles, {} vertices, true error {:.6} m (measured in {:.0} ms)",
        mesh.triangles.len(),
        mesh.vertices.len(),
        found.max_error,
        seconds * 1e3
    );
    if let Ok(folder) = std::env::var("LITTORAL_MESHES") {
        let bytes = |numbers: &mut dyn Iterator<Item = u32>| numbers.flat_map(u32::to_le_bytes).collect::<Vec<u8>>();
        let write = |kind: &str, bytes: Vec<u8>| {
            std::fs::write(format!("{folder}/{name}.{kind}"), bytes).expect("a folder that can be written to");
        };
        write("vertices", bytes(&mut mesh.vertices.iter().flatten().copied()));
        write("triangles", bytes(&mut mesh.triangles.iter().flatten().copied()));
    }
}

fn invented(samples: usize) -> Raster {
    let noise = Fbm::new(9000.0, 1500.0, 11, 7);
    let step = EXTENT / (samples - 1) as f64;
    let height = |i: usize| noise.at(DVec2::new((i % samples) as f64, (i / samples) as f64) * step).value as f32;
    let heights = collected((0..samples * samples).map(height));
    Raster::new(samples, samples, DVec2::splat(step), heights).expect("finite heights")
}

fn measured(path: &str) -> Raster {
    let bytes = std::fs::read(path).expect("LITTORAL_MAP names a readable file");
    let heights = collected(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    let side = heights.len().isqrt();
    Raster::new(side, side, DVec2::splat(EXTENT / (side - 1) as f64), heights).expect("the heights of a square")
}
