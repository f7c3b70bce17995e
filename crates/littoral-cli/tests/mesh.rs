//! Meshes as a script gets them: within their bound by an independent reckoning, in the right place, closed when they are said to be.

mod common;

use common::{fails, json, littoral, text};
use littoral_data::write::{GridSamples, geotiff};
use littoral_data::{Crs, Georeference, Registration};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

const COLUMNS: usize = 40;
const ROWS: usize = 30;
/// Side of a cell (m).
const CELL: f64 = 10.0;
/// Where the first sample lies.
const FIRST: [f64; 2] = [500_000.0, 5_000_000.0];

/// Hills by the sea, rows from the north; a void of some samples, and one that touches it at a corner.
fn height(column: usize, row: usize) -> f32 {
    if (5..8).contains(&column) && (6..9).contains(&row) || (10..12).contains(&column) && (11..13).contains(&row) {
        return f32::NAN;
    }
    let (x, y) = (column as f32, row as f32);
    30.0 * (x * 0.3).sin() * (y * 0.21).cos() + 2.0 * y - 20.0 + ((column * 7 + row * 13) % 5) as f32
}

struct Desk {
    folder: tempfile::TempDir,
    land: String,
}

impl Desk {
    fn new() -> Desk {
        let crs = Crs::from_epsg(32610).expect("a zone of UTM");
        Desk::of(crs, [FIRST[0] - 0.5 * CELL, CELL, 0.0, FIRST[1] + 0.5 * CELL, 0.0, -CELL])
    }

    fn of(crs: Crs, geotransform: [f64; 6]) -> Desk {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("land.tif");
        let georeference =
            Georeference { geotransform, registration: Registration::Area, crs, size: [COLUMNS, ROWS], y_south: false };
        let heights: Vec<f32> = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| height(column, row))).collect();
        geotiff(&file, &georeference, None, GridSamples::F32(&heights), None, "").expect("written");
        Desk { land: file.display().to_string(), folder }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn files(&self) -> usize {
        std::fs::read_dir(self.folder.path()).expect("a folder").count()
    }
}

/// Vertices and triangles of an OBJ file.
fn obj(file: &str) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let text = std::fs::read_to_string(file).expect("a mesh");
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let mut words = line.split(' ');
        match words.next() {
            Some("v") => vertices.push([(); 3].map(|()| words.next().expect("three").parse().expect("a number"))),
            Some("f") => triangles.push([(); 3].map(|()| {
                let word = words.next().expect("three").split('/').next().expect("an index");
                word.parse::<usize>().expect("an index") - 1
            })),
            _ => {}
        }
    }
    (vertices, triangles)
}

/// Corners of the triangles of an STL file.
fn stl(file: &str) -> Vec<[[u32; 3]; 3]> {
    let bytes = std::fs::read(file).expect("a mesh");
    let count = u32::from_le_bytes(bytes[80..84].try_into().expect("four")) as usize;
    assert_eq!(bytes.len(), 84 + 50 * count);
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    let corner = |at: usize| [0, 4, 8].map(|i| if number(at + i) == 1 << 31 { 0 } else { number(at + i) });
    (0..count).map(|i| [12, 24, 36].map(|part| corner(84 + 50 * i + part))).collect()
}

/// The greatest distance from a sample to the triangles, and how many samples lie in none, by search.
fn measured(vertices: &[[f64; 3]], triangles: &[[usize; 3]]) -> (f64, usize) {
    let (mut worst, mut missed) = (0f64, 0);
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let sample = f64::from(height(column, row));
            let at = [FIRST[0] + CELL * column as f64, FIRST[1] - CELL * row as f64];
            let found = triangles.iter().find_map(|triangle| {
                let [a, b, c] = triangle.map(|v| vertices[v]);
                let cross =
                    |p: [f64; 3], q: [f64; 3]| (p[0] - at[0]) * (q[1] - at[1]) - (p[1] - at[1]) * (q[0] - at[0]);
                let (u, v, w) = (cross(b, c), cross(c, a), cross(a, b));
                (u.min(v).min(w) >= 0.0).then(|| (u * a[2] + v * b[2] + w * c[2]) / (u + v + w))
            });
            match found {
                Some(mesh) if sample.is_nan() => panic!("a void at {column}, {row} is covered at {mesh}"),
                Some(mesh) => worst = worst.max((mesh - sample).abs()),
                None => missed += usize::from(!sample.is_nan()),
            }
        }
    }
    (worst, missed)
}

#[test]
fn the_bound_holds_at_every_sample_in_the_files_own_coordinates() {
    let desk = Desk::new();
    let out = desk.path("mesh.obj");
    let mut counts = Vec::new();
    for method in ["rtin", "tin"] {
        for error in ["0.5", "5"] {
            let mesh = json(&["mesh", &desk.land, "--method", method, "--max-error", error, "--out", &out]);
            let (vertices, triangles) = obj(&out);
            assert_eq!(mesh["triangles"], triangles.len());
            assert_eq!(mesh["vertices"], vertices.len());
            assert!(mesh["seconds"].as_f64().is_some_and(|s| s >= 0.0));
            let (worst, missed) = measured(&vertices, &triangles);
            let told = mesh["max_error"].as_f64().expect("a number");
            assert!((told - worst).abs() < 1e-5, "{method} {error}: told {told}, measured {worst}");
            assert!(told <= error.parse().expect("a number"), "{method} {error}: {told}");
            assert_eq!(missed, 0, "{method} {error}");
            for [x, y, z] in vertices {
                let (column, row) = ((x - FIRST[0]) / CELL, (FIRST[1] - y) / CELL);
                assert_eq!((column, row), (column.round(), row.round()), "vertices are samples");
                assert_eq!(z as f32, height(column as usize, row as usize));
            }
            counts.push(triangles.len());
        }
    }
    assert!(counts[0] > counts[1] && counts[2] > counts[3] && counts[3] < counts[1], "{counts:?}");
}

#[test]
fn tiles_join_without_a_gap() {
    let desk = Desk::new();
    let (whole, tiled) = (desk.path("whole.obj"), desk.path("tiled.obj"));
    for method in ["rtin", "tin"] {
        for tile in ["8", "16", "64"] {
            let order =
                ["mesh", &desk.land, "--method", method, "--max-error", "1.5", "--shoreline", "3", "--base", "-90"];
            let one = json(&[&order[..], &["--out", &whole]].concat());
            let many = json(&[&order[..], &["--tile", tile, "--out", &tiled]].concat());
            let (vertices, triangles) = obj(&tiled);
            let mut edges = HashMap::new();
            for [a, b, c] in &triangles {
                for edge in [(*a, *b), (*b, *c), (*c, *a)] {
                    *edges.entry(edge).or_insert(0) += 1;
                }
            }
            let closed = edges.iter().all(|(&(from, to), &count)| count == 1 && edges.contains_key(&(to, from)));
            assert!(closed, "{method} {tile}");
            let ground: Vec<_> =
                triangles.into_iter().filter(|t| t.iter().all(|&vertex| vertices[vertex][2] > -90.0)).collect();
            let (worst, missed) = measured(&vertices, &ground);
            assert!(worst <= 1.5 + 1e-9 && missed == 0, "{method} {tile}: {worst}, {missed} missed");
            assert!((many["max_error"].as_f64().expect("a number") - worst).abs() < 1e-5);
            assert_eq!((&many["void"], &many["samples"]), (&one["void"], &one["samples"]));
            assert_eq!(many["base"], -90.0);
            // A normal is that of the ground, at a tile's border too.
            let normals = |file: &str| -> HashMap<String, String> {
                let text = std::fs::read_to_string(file).expect("a mesh");
                let lines = |start: &str| -> Vec<String> {
                    text.lines().filter_map(|line| line.strip_prefix(start)).map(str::to_owned).collect()
                };
                lines("v ").into_iter().zip(lines("vn ")).collect()
            };
            let (expected, got) = (normals(&whole), normals(&tiled));
            let common: Vec<_> = got.iter().filter(|(place, _)| expected.contains_key(*place)).collect();
            assert!(common.len() > 100);
            // Parted vertices' names differ, and so may what was parted there.
            let other = common.iter().filter(|(place, normal)| expected[*place] != **normal).count();
            assert_eq!(other, 0, "{method} {tile}");
        }
    }
    fails(&["mesh", &desk.land, "--tile", "100", "--out", &whole], 2, "expected a power of two");
}

#[test]
fn a_base_makes_a_closed_body_for_printing() {
    let desk = Desk::new();
    let out = desk.path("print.stl");
    for more in
        [&["--base"][..], &["--base", "-100", "--exaggeration", "3"], &["--base", "--local", "--shoreline", "5"]]
    {
        let mesh = json(&[&["mesh", &desk.land, "--max-error", "2", "--out", &out], more].concat());
        let triangles = stl(&out);
        assert_eq!(mesh["triangles"], triangles.len());
        let mut edges = HashMap::new();
        for [a, b, c] in &triangles {
            for edge in [(a, b), (b, c), (c, a)] {
                *edges.entry(edge).or_insert(0) += 1;
            }
        }
        for (&(from, to), &count) in &edges {
            assert_eq!(count, 1, "{more:?}: an edge twice");
            assert_eq!(edges.get(&(to, from)), Some(&1), "{more:?}: an edge without its other side");
        }
        let places = triangles.iter().map(|t| t.map(|corner| corner.map(f32::from_bits)));
        let volume: f64 = places
            .map(|[a, b, c]| {
                let [a, b, c] = [a, b, c].map(|p| p.map(f64::from));
                (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                    + a[2] * (b[0] * c[1] - b[1] * c[0]))
                    / 6.0
            })
            .sum();
        let lowest = triangles.iter().flatten().map(|corner| f32::from_bits(corner[2])).fold(f32::INFINITY, f32::min);
        let stretch = mesh["exaggeration"].as_f64().expect("a factor");
        assert!((f64::from(lowest) - mesh["base"].as_f64().expect("a height") * stretch).abs() < 1e-3);
        let area = (COLUMNS - 1) as f64 * (ROWS - 1) as f64 * CELL * CELL;
        assert!(volume > 0.3 * area * 10.0 && volume < area * 600.0, "{more:?}: {volume}");
    }
    let said = text(&littoral(&["mesh", &desk.land, "--base", "--out", &out]).stdout);
    assert!(said.contains("base at") && said.contains("triangles"), "{said}");
}

#[test]
fn a_waterline_is_kept_as_edges() {
    let desk = Desk::new();
    let out = desk.path("coast.ply");
    let plain = json(&["mesh", &desk.land, "--max-error", "2", "--out", &out]);
    assert!(plain.get("shoreline_edges").is_none());
    let cut = json(&["mesh", &desk.land, "--max-error", "2", "--shoreline", "--out", &out]);
    let edges = cut["shoreline_edges"].as_u64().expect("a number");
    assert!(edges > 20 && cut["vertices"].as_u64() > plain["vertices"].as_u64(), "{cut}");
    assert_eq!(cut["max_error"], plain["max_error"]);
    let bytes = std::fs::read(&out).expect("a mesh");
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(2000)]).into_owned();
    assert!(head.contains(&format!("element edge {edges}\n")) && head.contains("comment shoreline: 0 m"), "{head}");
    // The edges are the end of the file: two numbers each, of vertices at height 0.
    let start = head.find("end_header\n").expect("an end") + "end_header\n".len();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four")) as usize;
    for edge in 0..edges as usize {
        let at = bytes.len() - 8 * (edges as usize - edge);
        for end in [number(at), number(at + 4)] {
            let z = start + 36 * end + 16;
            assert_eq!(f64::from_le_bytes(bytes[z..z + 8].try_into().expect("eight")), 0.0);
        }
    }
    let dry = json(&["mesh", &desk.land, "--shoreline", "4000", "--out", &out]);
    assert_eq!(dry["shoreline_edges"], 0);
    assert!(dry["warnings"][0].as_str().is_some_and(|w| w.contains("nowhere crosses 4000 m")), "{dry}");
}

#[test]
fn coordinates_are_the_files_or_metres_or_degrees() {
    let desk = Desk::new();
    let out = desk.path("mesh.obj");
    let extent = |file: &str| {
        let (vertices, _) = obj(file);
        let least = |i: usize| vertices.iter().map(|v| v[i]).fold(f64::INFINITY, f64::min);
        let most = |i: usize| vertices.iter().map(|v| v[i]).fold(f64::NEG_INFINITY, f64::max);
        [least(0), least(1), most(0), most(1)]
    };
    let (width, depth) = (CELL * (COLUMNS - 1) as f64, CELL * (ROWS - 1) as f64);
    let local = json(&["mesh", &desk.land, "--local", "--out", &out]);
    assert_eq!(extent(&out), [-0.5 * width, -0.5 * depth, 0.5 * width, 0.5 * depth]);
    assert_eq!((&local["coordinates"], &local["crs"]), (&"local".into(), &"EPSG:32610".into()));
    json(&["mesh", &desk.land, "--lonlat", "--out", &out]);
    let [west, south, east, north] = extent(&out);
    // 500 000 m east is the middle meridian of zone 10, 123° west; 5 000 000 m north lies at 45.15°.
    assert!((west + 123.0).abs() < 1e-9 && (north - 45.1535).abs() < 1e-3, "{west} {north}");
    assert!(((east - west) * 78_700.0 - width).abs() < 3.0 && ((north - south) * 111_140.0 - depth).abs() < 3.0);

    // Files in degrees are laid out in metres, unless degrees are asked for.
    let degrees = Desk::of(Crs::from_epsg(4326).expect("degrees"), [10.0, 1e-4, 0.0, 60.0, 0.0, -1e-4]);
    let metres = json(&["mesh", &degrees.land, "--out", &out]);
    assert_eq!(metres["coordinates"], "local");
    let [west, south, east, north] = extent(&out);
    assert!((east - west - 39.0 * 5.58).abs() < 1.0 && (north - south - 29.0 * 11.14).abs() < 1.0);
    assert!((west + east).abs() < 1e-9 && (south + north).abs() < 1e-9);
    json(&["mesh", &degrees.land, "--lonlat", "--out", &out]);
    let [west, _, _, north] = extent(&out);
    assert!((west - 10.00005).abs() < 1e-12 && (north - 59.99995).abs() < 1e-12);
    // Single precision counts from an origin nearby, which is told.
    let stl = json(&["mesh", &desk.land, "--out", &desk.path("mesh.stl")]);
    assert_eq!(stl["origin"], serde_json::json!([500_195.0, 4_999_855.0, 0.0]));
    // What nobody placed has metres and north up, not pixels southward.
    let coast = json(&["mesh", "--max-error", "20", "--out", &out]);
    assert_eq!((&coast["coordinates"], &coast["origin"]), (&"local".into(), &serde_json::json!([0.0, 0.0, 0.0])));
}

#[test]
fn a_window_takes_its_samples_alone() {
    let desk = Desk::new();
    let out = desk.path("part.obj");
    let part =
        json(&["mesh", &desk.land, "--window", "500200,4999900,500300,4999800", "--max-error", "1", "--out", &out]);
    assert_eq!(part["samples"], 11 * 11);
    let (vertices, _) = obj(&out);
    for [x, y, z] in vertices {
        let (column, row) = (((x - FIRST[0]) / CELL) as usize, ((FIRST[1] - y) / CELL) as usize);
        assert!((20..=30).contains(&column) && (10..=20).contains(&row));
        assert_eq!(z as f32, height(column, row));
    }
    fails(&["mesh", &desk.land, "--window", "0,0,5,5", "--out", &out], 1, "less than 2 x 2 samples");
}

#[test]
fn wrong_orders_are_refused_before_any_work() {
    let desk = Desk::new();
    let out = desk.path("mesh.ply");
    let before = desk.files();
    for error in ["0", "-1", "nan", "inf", "x", "1e9"] {
        fails(&["mesh", &desk.land, "--max-error", error, "--out", &out], 2, "expected an error above 0 metres");
    }
    fails(&["mesh", &desk.land, "--max-error", "0", "--out", &out], 2, "such as 0.001");
    fails(
        &["mesh", &desk.land, "--out", &desk.path("mesh.dae")],
        2,
        "expected a name ending in .ply, .obj, .stl, .glb",
    );
    fails(&["mesh", &desk.land, "--out", &desk.path("no/mesh.ply")], 1, "expected the folder");
    fails(&["mesh", &desk.land, "--method", "best", "--out", &out], 2, "rtin");
    fails(&["mesh", &desk.land, "--base", "20", "--out", &out], 1, "expected --base below the lowest ground");
    fails(&["mesh", &desk.land, "--base", "low", "--out", &out], 2, "--base: expected a height in metres");
    fails(&["mesh", &desk.land, "--shoreline", "nan", "--out", &out], 2, "--shoreline: expected a height in metres");
    fails(&["mesh", &desk.land, "--lonlat", "--local", "--out", &out], 2, "cannot be used with");
    fails(&["mesh", "--lonlat", "--out", &out], 2, "expected a file");
    fails(&["mesh", &desk.path("none.tif"), "--out", &out], 1, "none of that name");
    let copy = desk.path("land.ply");
    std::fs::copy(&desk.land, &copy).expect("a copy");
    fails(&["mesh", &copy, "--out", &copy], 2, "expected another name");
    std::fs::remove_file(copy).expect("removed");
    std::fs::create_dir(desk.path("folder.ply")).expect("a folder");
    fails(&["mesh", &desk.land, "--out", &desk.path("folder.ply")], 1, "got a folder");
    std::fs::remove_dir(desk.path("folder.ply")).expect("removed");
    assert_eq!(desk.files(), before, "nothing was written");
    // A file after an option that may have a value is a file.
    json(&["mesh", "--base", &desk.land, "--out", &out]);
    json(&["mesh", "--shoreline", &desk.land, "--out", &out]);
}

#[test]
fn files_that_join_become_one_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    let half = |name: &str, first: usize| {
        let file = folder.path().join(name);
        let georeference = Georeference {
            geotransform: [CELL * first as f64, CELL, 0.0, 0.0, 0.0, -CELL],
            registration: Registration::Area,
            crs: Crs::from_epsg(32610).expect("a zone of UTM"),
            size: [20, 20],
            y_south: false,
        };
        let heights: Vec<f32> =
            (0..400).map(|i| ((first + i % 20) as f32 * 0.4).sin() * 9.0 + (i / 20) as f32).collect();
        geotiff(&file, &georeference, None, GridSamples::F32(&heights), None, "").expect("written");
        file.display().to_string()
    };
    let (west, east) = (half("west.tif", 0), half("east.tif", 20));
    let out = folder.path().join("both.obj").display().to_string();
    let mesh = json(&["mesh", &west, &east, "--max-error", "0.5", "--out", &out]);
    assert_eq!(mesh["samples"], 40 * 20);
    let (vertices, triangles) = obj(&out);
    // One surface, without a gap where the files meet: edges with one side only run along the outline.
    let mut edges = HashMap::new();
    for [a, b, c] in &triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.insert((*from, *to), ());
        }
    }
    for (from, to) in edges.keys().filter(|(from, to)| !edges.contains_key(&(*to, *from))) {
        let (p, q) = (vertices[*from], vertices[*to]);
        let along = |i: usize, low: f64, high: f64| p[i] == q[i] && (p[i] == low || p[i] == high);
        assert!(along(0, 5.0, 395.0) || along(1, -195.0, -5.0), "{p:?} {q:?}");
    }
}

/// Every real file of every format, where the folder of real data is there.
#[test]
fn meshes_of_real_files_keep_their_bound() {
    let data = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/formats/ok"));
    let Ok(entries) = std::fs::read_dir(data) else {
        println!("{} is absent: real files are not tried", data.display());
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("mesh.glb").display().to_string();
    let sidecar = |file: &PathBuf| file.extension().is_some_and(|e| ["prj", "hdr", "tfw"].iter().any(|&s| e == s));
    let mut tried = 0;
    for file in entries.map(|entry| entry.expect("an entry").path()).filter(|file| !sidecar(file)) {
        for method in ["rtin", "tin"] {
            let file = file.display().to_string();
            let mesh = json(&["mesh", &file, "--method", method, "--max-error", "2.5", "--base", "--out", &out]);
            let error = mesh["max_error"].as_f64().expect("a number");
            assert!((0.0..=2.5).contains(&error), "{file}: {error}");
            tried += 1;
        }
    }
    assert!(tried > 40, "{tried}");
}
