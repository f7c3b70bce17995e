//! The command as a script sees it: names, keys, streams, exit codes, and files that are whole or not there.

use littoral_data::write::{GridSamples, geotiff};
use littoral_data::{Crs, Georeference, Registration};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn littoral(arguments: &[&str]) -> Output {
    in_folder(Path::new("."), arguments)
}

fn in_folder(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_littoral")).args(arguments).current_dir(folder).output().expect("the command runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text")
}

/// Succeeds, prints one JSON object, and nothing else.
fn json(arguments: &[&str]) -> Value {
    let mut arguments = arguments.to_vec();
    arguments.push("--json");
    let output = littoral(&arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    let value: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", text(&output.stdout)));
    assert!(value["warnings"].is_array(), "warnings are always listed");
    value
}

/// Fails with this exit code and a message of one line on stderr; nothing on stdout.
fn fails(arguments: &[&str], code: i32) -> String {
    let output = littoral(arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed {}", text(&output.stdout));
    assert!(!said.contains("panicked"), "{said}");
    said
}

const COLUMNS: usize = 60;
const ROWS: usize = 40;

/// The height of a sample of the test file: a plane that rises eastward and northward, with a wall across it.
fn height(column: usize, row: usize) -> f32 {
    let wall = if column == 40 { 500.0 } else { 0.0 };
    100.0 + 2.0 * column as f32 + (ROWS - 1 - row) as f32 + wall
}

/// A GeoTIFF of 10 m cells whose sample of column c and row r lies at (500000 + 10 c, 5000000 − 10 r); voids at the
/// first and in a corner.
fn file(folder: &Path) -> PathBuf {
    part(folder, "land.tif", 0..COLUMNS, 32610)
}

/// Some columns of that.
fn part(folder: &Path, name: &str, columns: std::ops::Range<usize>, epsg: u32) -> PathBuf {
    let file = folder.join(name);
    let georeference = Georeference {
        geotransform: [499_995.0 + 10.0 * columns.start as f64, 10.0, 0.0, 5_000_005.0, 0.0, -10.0],
        registration: Registration::Area,
        crs: Crs::from_epsg(epsg).expect("a zone of UTM"),
        size: [columns.len(), ROWS],
        y_south: false,
    };
    let mut heights: Vec<f32> =
        (0..ROWS).flat_map(|row| columns.clone().map(move |column| height(column, row))).collect();
    if columns.start == 0 {
        heights[0] = f32::NAN;
    }
    geotiff(&file, &georeference, None, GridSamples::F32(&heights), None, "").expect("written");
    file
}

struct Desk {
    folder: tempfile::TempDir,
    land: String,
}

impl Desk {
    fn new() -> Desk {
        let folder = tempfile::tempdir().expect("a folder");
        let land = file(folder.path()).display().to_string();
        Desk { folder, land }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("an entry").file_name().into_string().expect("text")).collect();
        names.sort();
        names
    }
}

fn pixels(file: &str) -> (u32, u32, Vec<u8>) {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).expect("a picture")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a small picture")];
    let info = reader.next_frame(&mut bytes).expect("pixels");
    (info.width, info.height, bytes)
}

fn not_blank(file: &str) {
    let (_, _, bytes) = pixels(file);
    let (low, high) = (bytes.iter().min().expect("pixels"), bytes.iter().max().expect("pixels"));
    assert!(high - low > 30, "{file} is blank: {low} to {high}");
}

#[test]
fn info_has_the_keys_of_the_contract() {
    let desk = Desk::new();
    let info = json(&["info", &desk.land]);
    for key in [
        "format",
        "width",
        "height",
        "void",
        "nodata",
        "min",
        "max",
        "first",
        "centre",
        "last",
        "crs",
        "horizontal_unit",
        "vertical_unit",
        "geotransform",
        "cell_m",
        "point_or_area",
        "warnings",
    ] {
        assert!(info.get(key).is_some(), "no {key} in {info}");
    }
    assert_eq!((info["width"].as_u64(), info["height"].as_u64(), info["void"].as_u64()), (Some(60), Some(40), Some(1)));
    assert_eq!(info["first"], Value::Null);
    assert_eq!(info["centre"].as_f64(), Some(f64::from(height(30, 20))));
    assert_eq!(info["last"].as_f64(), Some(f64::from(height(59, 39))));
    assert_eq!(info["geotransform"][0].as_f64(), Some(499_995.0));
    assert_eq!((info["crs"].as_str(), info["point_or_area"].as_str()), (Some("EPSG:32610"), Some("area")));
    let told = littoral(&["info", &desk.land]);
    assert!(text(&told.stdout).contains("EPSG:32610") && text(&told.stdout).contains("taken as sea level"));
}

#[test]
fn heights_are_exact_at_and_between_samples() {
    let desk = Desk::new();
    // A sample, the last sample, between four samples, the void one, outside.
    let points = ["500050,4999900", "500590,4999610", "500055,4999905", "500000,5000000", "1,2"];
    let mut arguments = vec!["height", &desk.land, "--at"];
    arguments.extend(points);
    let answer = json(&arguments);
    let heights: Vec<Option<f64>> = answer["heights"].as_array().expect("heights").iter().map(Value::as_f64).collect();
    let between = f64::from(height(5, 10) + height(6, 10) + height(5, 9) + height(6, 9)) / 4.0;
    let sample = |c, r| Some(f64::from(height(c, r)));
    assert_eq!(heights, [sample(5, 10), sample(59, 39), Some(between), None, None]);
    assert_eq!(answer["warnings"].as_array().map(Vec::len), Some(2), "{answer}");

    arguments.push("--normals");
    let normals = json(&arguments);
    let normal = |i: usize, k: usize| normals["normals"][i][k].as_f64().expect("a number");
    let length = (0.2f64.powi(2) + 0.1f64.powi(2) + 1.0).sqrt();
    assert!((normal(2, 0) + 0.2 / length).abs() < 1e-5 && (normal(2, 1) + 0.1 / length).abs() < 1e-5);

    let plain = littoral(&["height", &desk.land, "--at", "500050,4999900", "500000,5000000"]);
    assert_eq!(text(&plain.stdout), format!("500050,4999900,{}\n500000,5000000,nan\n", height(5, 10)));
}

#[test]
fn many_points_stream_through() {
    use std::io::Write;
    let desk = Desk::new();
    let mut child = Command::new(env!("CARGO_BIN_EXE_littoral"))
        .args(["height", &desk.land, "--points", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the command runs");
    let mut input = child.stdin.take().expect("a pipe");
    let writer = std::thread::spawn(move || {
        let mut lines = String::from("x y\n# a comment\n\n");
        for i in 0..200_000 {
            lines += &format!("{} {}\n", 500_050 + 10 * (i % 30), 4_999_900 - 10 * (i % 7));
        }
        input.write_all(lines.as_bytes()).expect("taken");
    });
    let output = child.wait_with_output().expect("it ends");
    writer.join().expect("written");
    let lines = text(&output.stdout);
    assert_eq!(lines.lines().count(), 200_000);
    for (i, line) in lines.lines().enumerate().step_by(997) {
        let expected =
            format!("{},{},{}", 500_050 + 10 * (i % 30), 4_999_900 - 10 * (i % 7), height(5 + i % 30, 10 + i % 7));
        assert_eq!(line, expected);
    }

    let points = desk.path("points.txt");
    std::fs::write(&points, "500050,4999900\n500060,north\n").expect("written");
    let said = fails(&["height", &desk.land, "--points", &points], 1);
    assert!(said.contains("points.txt: line 2: expected X,Y, got \"500060,north\"; correct"), "{said}");
}

#[test]
fn a_wall_blocks_the_view() {
    let desk = Desk::new();
    let sight = |from: &str, to: &str, more: &[&str]| {
        let mut arguments = vec!["sight", &desk.land, "--from", from, "--to", to];
        arguments.extend(more);
        json(&arguments)
    };
    let free = sight("500100,4999800,5", "500300,4999800,5", &[]);
    assert_eq!((free["visible"].as_bool(), &free["blocked_at"]), (Some(true), &Value::Null));
    assert!((free["clearance"].as_f64().expect("a number") - 5.0).abs() < 1e-3);
    let blocked = sight("500100,4999800,5", "500550,4999800,5", &["--curvature"]);
    assert_eq!(blocked["visible"].as_bool(), Some(false));
    let x = blocked["blocked_at"]["x"].as_f64().expect("a place");
    assert!((500_390.0..=500_400.0).contains(&x), "the wall rises from 500390 to 500400, got {x}");
    assert!(blocked["clearance"].as_f64().expect("a number") < -400.0);
    assert_eq!(blocked["refraction"].as_f64(), Some(0.13));
    let said = fails(&["sight", &desk.land, "--from", "1,2,3", "--to", "500550,4999800,5"], 1);
    assert!(said.contains("land.tif: expected a position within the data") && said.contains("got 1,2; "), "{said}");
    let said = fails(&["sight", &desk.land, "--from", "500000,5000000,3", "--to", "500550,4999800,5"], 1);
    assert!(said.contains("got a void at 500000,5000000"), "{said}");
    fails(&["sight", &desk.land, "--from", "1,2,3", "--to", "1,2,3", "--refraction", "0.2"], 2);
}

#[test]
fn a_profile_is_csv_json_or_a_plot() {
    let desk = Desk::new();
    let line = ["profile", &desk.land, "--from", "500010,4999800", "--to", "500590,4999800"];
    let output = littoral(&line);
    let csv = text(&output.stdout);
    assert!(csv.starts_with("distance,x,y,height\n0,500010,4999800,"), "{csv}");
    assert_eq!(csv.lines().count(), 1 + 59);
    let answer = json(&line);
    let last = |key: &str| answer[key].as_array().and_then(|a| a.last()).and_then(Value::as_f64);
    assert_eq!((last("distance"), last("height")), (Some(580.0), Some(f64::from(height(59, 20)))));
    assert_eq!(answer["highest"].as_f64(), Some(f64::from(height(40, 20))));
    for name in ["plot.png", "plot.svg", "plot.csv"] {
        let out = desk.path(name);
        let mut arguments = line.to_vec();
        arguments.extend(["--out", &out]);
        assert!(littoral(&arguments).status.success());
        assert!(std::fs::metadata(&out).expect("written").len() > 300);
    }
    not_blank(&desk.path("plot.png"));
    let out = desk.path("plot.pdf");
    let mut arguments = line.to_vec();
    arguments.extend(["--out", &out]);
    assert!(fails(&arguments, 2).contains("expected a name ending in .csv, .svg, .png, got .pdf; change it"));
}

#[test]
fn a_viewshed_lies_over_its_land() {
    let desk = Desk::new();
    let out = desk.path("seen.tif");
    let answer = json(&["viewshed", &desk.land, "--from", "500100,4999800,5", "--out", &out]);
    let info = json(&["info", &out]);
    let land = json(&["info", &desk.land]);
    for key in ["width", "height", "geotransform", "crs", "point_or_area", "void"] {
        assert_eq!(info[key], land[key], "{key}");
    }
    assert_eq!((info["min"].as_f64(), info["max"].as_f64()), (Some(0.0), Some(255.0)));
    let at = |x: f64, y: f64| json(&["height", &out, "--at", &format!("{x},{y}")])["heights"][0].as_f64();
    assert_eq!(at(500_200.0, 4_999_800.0), Some(255.0), "in front of the wall");
    assert_eq!(at(500_500.0, 4_999_800.0), Some(0.0), "behind it");
    let seen = answer["seen"].as_u64().expect("a number");
    assert!(seen > 1000 && seen < 1700, "{seen} of 2400 seen");
    let near = json(&["viewshed", &desk.land, "--from", "500100,4999800,5", "--radius", "35", "--out", &out]);
    assert_eq!(near["seen"].as_u64(), Some(37), "the samples within 35 m");
    let said = fails(&["viewshed", &desk.land, "--from", "500100,4999800,5", "--out", &desk.land], 2);
    assert!(said.contains("expected another name than an input's"), "{said}");
}

#[test]
fn a_picture_is_drawn_and_its_view_can_be_typed_again() {
    let desk = Desk::new();
    let (first, again) = (desk.path("a.png"), desk.path("b.png"));
    let small = ["--size", "160x90", "--samples", "2"];
    let render = |out: &str, more: &[&str]| {
        let mut arguments = vec!["render", &desk.land, "--out", out];
        arguments.extend(small);
        arguments.extend(more);
        let output = littoral(&arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let line = render(&first, &[]);
    assert_eq!(line.lines().count(), 1, "one line: {line}");
    assert!(line.contains("a.png: 160x90 in ") && line.contains("exaggeration 1, heights taken as above sea level"));
    not_blank(&first);
    // The view that was printed gives nearly the same picture.
    let words: Vec<&str> = line.split_whitespace().collect();
    let value = |name: &str| {
        let at = words.iter().position(|w| *w == name).unwrap_or_else(|| panic!("no {name} in {line}"));
        words[at + 1].trim_end_matches(',')
    };
    render(&again, &["--eye", value("--eye"), "--look", value("--look"), "--fov", value("--fov")]);
    let (a, b) = (pixels(&first).2, pixels(&again).2);
    let off = a.iter().zip(&b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.len() as f64;
    assert!(off < 6.0, "the copied view differs by {off} of 255 on average");
}

#[test]
fn pictures_do_not_depend_on_threads() {
    let desk = Desk::new();
    for threads in ["1", "2"] {
        let out = desk.path(threads) + ".png";
        let arguments =
            ["render", &desk.land, "--size", "96x54", "--samples", "3", "--threads", threads, "--out", &out];
        assert!(littoral(&arguments).status.success());
    }
    let read = |name: &str| std::fs::read(desk.path(name)).expect("written");
    assert!(read("1.png") == read("2.png"), "one and two threads give different pictures");
}

#[test]
fn files_that_join_are_drawn_as_one() {
    let desk = Desk::new();
    let folder = desk.folder.path();
    let parts = [("west.tif", 0..25), ("middle.tif", 24..42), ("east.tif", 42..COLUMNS)];
    let [west, middle, east] = parts.map(|(name, columns)| part(folder, name, columns, 32610).display().to_string());
    let drawn = |files: &[&str]| {
        let out = desk.path("out.png");
        let quick = ["--size", "96x54", "--samples", "2", "--out", &out];
        let answer = json(&[&["render"], files, &quick].concat());
        // Warnings name the files.
        (pixels(&out), answer["eye"].clone(), answer["warnings"].as_array().map(Vec::len))
    };
    let whole = drawn(&[&desk.land]);
    assert_eq!(drawn(&[&west, &middle, &east]), whole);
    assert_eq!(drawn(&[&east, &west, &middle]), whole);

    let zone = part(folder, "zone.tif", 0..9, 32611).display().to_string();
    let said = fails(&["render", &west, &zone, "--out", &desk.path("no.png")], 1);
    assert!(said.contains("zone.tif: expected coordinates in EPSG:32610") && said.contains("gdalwarp"), "{said}");
    let input = desk.path("input.png");
    std::fs::copy(&middle, &input).expect("copied");
    let said = fails(&["render", &west, &input, "--out", &input], 2);
    assert!(said.contains("another name than an input's"), "{said}");
    assert!(!desk.files().contains(&"no.png".to_owned()));
}

#[test]
fn the_encoding_of_a_png_can_be_chosen() {
    let desk = Desk::new();
    let file = desk.path("tile.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&file).expect("a file"), 2, 2);
    encoder.set_color(png::ColorType::Rgb);
    // Reds of 200 are above every mountain in both codes, reds of 129 in one.
    let pixels = [200, 0, 0, 200, 0, 0, 200, 0, 0, 129, 0, 0];
    encoder.write_header().expect("a header").write_image_data(&pixels).expect("pixels");
    assert!(fails(&["info", &file], 1).contains("choose the encoding"));
    let info = json(&["info", &file, "--encoding", "terrarium"]);
    assert_eq!((&info["last"], &info["void"]), (&Value::from(256.0), &Value::from(3)));
    assert_eq!(json(&["height", &file, "--at", "1.5,1.5", "--encoding", "terrarium"])["heights"][0], 256.0);
    assert_eq!(json(&["info", &file, "--encoding", "mapbox"])["void"], 4);
    assert!(fails(&["info", &file, "--encoding", "grey"], 1).contains("got colours"));
    fails(&["info", &file, "--encoding", "webp"], 2);
    assert!(fails(&["info", &desk.land, "--encoding", "grey"], 1).contains("expected a PNG"));
}

#[test]
fn passes_are_floating_point_and_agree_with_the_ground() {
    let desk = Desk::new();
    let out = desk.path("linear.exr");
    let passes = ["--passes", "depth,normal,position,height"];
    let above = ["--eye", "500200,4999800,2000", "--look", "500200,4999810,0", "--size", "32x32", "--samples", "1"];
    let arguments = [&["render", &desk.land, "--out", &out][..], &passes, &above].concat();
    let answer = json(&arguments);
    assert_eq!(answer["file"].as_str(), Some(out.as_str()));
    let bytes = std::fs::read(&out).expect("written");
    assert_eq!(bytes[..4], [0x76, 0x2f, 0x31, 0x01], "an OpenEXR file");
    for name in ["depth.V", "normal.X", "position.Z", "height.V", "R", "G", "B"] {
        let name = [name.as_bytes(), &[0]].concat();
        assert!(bytes.windows(name.len()).any(|w| w == name), "no channel {}", text(&name));
    }
    // Beside a PNG they go into a file of their own.
    let png = desk.path("shown.png");
    let arguments = [&["render", &desk.land, "--out", &png][..], &passes, &above].concat();
    assert!(json(&arguments)["passes"].as_str().is_some_and(|p| p.ends_with("shown.exr")));
    assert!(Path::new(&desk.path("shown.exr")).is_file());
}

#[test]
fn a_film_goes_into_a_folder_and_goes_on_where_it_stopped() {
    let desk = Desk::new();
    let (out, path) = (desk.path("film"), desk.path("round.toml"));
    let film = |more: &[&str]| {
        let short = ["--size", "32x18", "--samples", "1", "--fps", "2", "--out", &out];
        [&["render", &desk.land][..], more, &short].concat().iter().map(|s| (*s).to_owned()).collect::<Vec<String>>()
    };
    let run = |arguments: &[String]| json(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let first = run(&film(&["--path", "--seconds", "3", "--save-path", &path]));
    assert_eq!((first["frames"].as_u64(), first["frames_drawn"].as_u64()), (Some(6), Some(6)));
    std::fs::remove_file(desk.path("film/frame_00004.png")).expect("it was there");
    let again = run(&film(&["--path", "--seconds", "3"]));
    assert_eq!((again["frames"].as_u64(), again["frames_drawn"].as_u64()), (Some(6), Some(1)));
    not_blank(&desk.path("film/frame_00004.png"));
    // Another film does not mix with it.
    let other = film(&["--path", "--seconds", "2"]);
    let said = fails(&other.iter().map(String::as_str).collect::<Vec<_>>(), 1);
    assert!(said.contains("got those of another") && said.contains("choose another folder"), "{said}");
    // The saved path gives the same flight.
    let saved = std::fs::read_to_string(&path).expect("saved");
    assert!(saved.contains("version = 1") && saved.contains("[[point]]"), "{saved}");
    let (out, from_file) = (desk.path("film2"), path.as_str());
    let short = ["--size", "32x18", "--samples", "1", "--fps", "2", "--out", &out];
    let again = json(&[&["render", &desk.land, "--path", from_file][..], &short].concat());
    let length = |value: &Value| value["path_metres"].as_f64().expect("a length");
    assert!((length(&again) / length(&first) - 1.0).abs() < 1e-3, "{again} {first}");
    std::fs::write(&path, "version = 7\n").expect("written");
    let arguments = [&["render", &desk.land, "--path", from_file][..], &short].concat();
    let said = fails(&arguments, 1);
    assert!(said.contains("round.toml: line 1: expected version 1") && said.contains("update"), "{said}");
}

#[test]
fn without_a_file_the_coast_is_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = in_folder(folder.path(), &["render", "--size", "160x90", "--samples", "1"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).starts_with("littoral.png: 160x90 in "));
    let names: Vec<_> =
        std::fs::read_dir(folder.path()).expect("a folder").map(|e| e.expect("an entry").file_name()).collect();
    assert_eq!(names, ["littoral.png"], "nothing else is left behind");
    not_blank(&folder.path().join("littoral.png").display().to_string());
}

#[test]
fn wrong_command_lines_and_failing_work_have_their_codes() {
    let desk = Desk::new();
    for wrong in [
        &["paint"][..],
        &["render", "--size", "0x5"],
        &["render", "--look", "1,2"],
        &["render", "--style", "oil"],
        &["render", "--style", "image"],
        &["render", "--out", "a.gif"],
        &["render", "--out", "a.mp4"],
        &["render", "--threads", "0"],
        &["height", &desk.land],
        &["height", &desk.land, "--at", "5"],
        &["profile", &desk.land, "--from", "1,2"],
        &["viewshed", &desk.land, "--from", "1,2,3", "--out", "seen.png"],
    ] {
        fails(wrong, 2);
    }
    let missing = desk.path("none.tif");
    for command in [&["info", &missing][..], &["render", &missing], &["height", &missing, "--at", "1,2"]] {
        let said = fails(command, 1);
        assert!(
            said.contains("none.tif: expected") && said.contains("got") && said.trim_end().ends_with("check the name"),
            "{said}"
        );
    }
    let text_file = desk.path("notes.tif");
    std::fs::write(&text_file, "this is not a picture of any land").expect("written");
    let said = fails(&["info", &text_file], 1);
    assert!(said.starts_with("littoral: ") && said.contains("notes.tif: expected"), "{said}");
    assert_eq!(littoral(&["--help"]).status.code(), Some(0));
    assert_eq!(littoral(&["--version"]).status.code(), Some(0));
}

#[test]
fn failed_work_leaves_no_files() {
    let desk = Desk::new();
    let before = desk.files();
    let nowhere = desk.path("no/folder/a.png");
    let said = fails(&["render", &desk.land, "--size", "32x18", "--out", &nowhere], 1);
    assert!(said.contains("expected the folder") && said.contains("create it"), "{said}");
    fails(&["viewshed", &desk.land, "--from", "1,2,3", "--out", &desk.path("seen.tif")], 1);
    fails(&["profile", &desk.land, "--from", "1,2", "--to", "3,4", "--out", &desk.path("p.svg")], 1);
    assert_eq!(desk.files(), before);
}

#[cfg(unix)]
#[test]
fn an_interrupted_film_leaves_no_half_written_file() {
    if !littoral_data::write::ffmpeg_installed() {
        println!("ffmpeg is not installed: interrupting a film is not tested");
        return;
    }
    let desk = Desk::new();
    let out = desk.path("film.mp4");
    let mut child = Command::new(env!("CARGO_BIN_EXE_littoral"))
        .args(["render", &desk.land, "--path", "--seconds", "3000", "--size", "64x36", "--samples", "1", "--out", &out])
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("the command runs");
    let started = std::time::Instant::now();
    while desk.files().len() < 2 {
        assert!(started.elapsed().as_secs() < 120, "the film never began");
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(killed.success());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(desk.files(), ["land.tif"]);
}

/// Other people's files, where they are.
fn collection() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/formats"));
    if folder.is_dir() {
        return Some(folder);
    }
    println!("the collection of formats is absent: not tested");
    None
}

#[test]
fn the_whole_collection_gives_pictures_and_the_expected_numbers() {
    let Some(folder) = collection() else { return };
    let expected = std::fs::read_to_string(folder.join("EXPECT.tsv")).expect("a table");
    let mut header = expected.lines();
    let columns: Vec<&str> = header.next().expect("a header").split('\t').collect();
    let desk = Desk::new();
    for line in header.filter(|line| line.starts_with("ok/")) {
        let row: Vec<&str> = line.split('\t').collect();
        let value = |name: &str| row[columns.iter().position(|c| *c == name).expect("a column")];
        let file = folder.join(value("file")).display().to_string();
        let info = json(&["info", &file]);
        assert_eq!(info["width"].to_string(), value("w"), "{file}");
        assert_eq!(info["height"].to_string(), value("h"), "{file}");
        // Raw numbers of the table, as heights.
        let (scale, offset) = value("scale").split_once(',').unwrap_or(("None", "None"));
        let (scale, offset) = (scale.parse().unwrap_or(1.0), offset.parse().unwrap_or(0.0));
        let unit = match info["vertical_unit"].as_str() {
            Some("foot") => 0.3048,
            Some("US survey foot") => 1200.0 / 3937.0,
            _ => 1.0,
        };
        for name in ["min", "max", "first", "centre", "last"] {
            let (Some(got), Ok(raw)) = (info[name].as_f64(), value(name).parse::<f64>()) else { continue };
            if (raw * scale + offset).abs() > 9000.0 || raw <= -32767.0 {
                continue; // a sentinel that the table takes for a height
            }
            let (as_is, in_metres) = (raw * scale + offset, (raw * scale + offset) * unit);
            let near = |a: f64| (a - got).abs() < 0.006 + 1e-4 * got.abs();
            assert!(near(as_is) || near(in_metres), "{file}: {name} {got}, expected {as_is} or {in_metres}");
        }
        let out = desk.path("p.png");
        let output = littoral(&["render", &file, "--size", "160x90", "--samples", "1", "--out", &out]);
        assert!(output.status.success(), "{file}: {}", text(&output.stderr));
        not_blank(&out);
    }
}

#[test]
fn broken_files_end_in_a_sentence() {
    let Some(folder) = collection() else { return };
    for entry in std::fs::read_dir(folder.join("bad")).expect("a folder") {
        let file = entry.expect("an entry").path().display().to_string();
        let output = littoral(&["info", &file]);
        let said = text(&output.stderr);
        assert!(matches!(output.status.code(), Some(0 | 1)), "{file}: {said}");
        assert!(!said.contains("panicked"), "{file}: {said}");
        if output.status.code() == Some(1) {
            assert!(
                said.lines().last().is_some_and(|l| l.starts_with("littoral: ") && l.contains(&file)),
                "{file}: {said}"
            );
        }
    }
}

#[test]
fn the_sun_follows_date_and_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a.png").display().to_string();
    let land = file(folder.path()).display().to_string();
    let render = ["render", &land, "--size", "32x18", "--samples", "1", "--out", &out, "--sun-at"];
    // 123° W, 45.15° N: on the day of the solstice the sun stands south at 20:14 UTC, 68.3° high.
    let noon = json(&[&render[..], &["2026-06-21T20:14Z"]].concat());
    let at = |i: usize| noon["sun"][i].as_f64().expect("a number");
    assert!((at(0) - 180.0).abs() < 1.0 && (at(1) - 68.3).abs() < 0.2, "{}", noon["sun"]);
    let night = json(&[&render[..], &["2026-06-21T00:14-08:00"]].concat());
    assert!(night["warnings"].to_string().contains("below the horizon"), "{}", night["warnings"]);
    let elsewhere = json(&[&render[..], &["2026-12-21T12:00Z", "--sun-place", "0,-23.44"]].concat());
    assert!(elsewhere["sun"][1].as_f64().expect("a number") > 89.0, "{}", elsewhere["sun"]);
    // Land without a place has no sun by date.
    let said = fails(&["render", "--size", "32x18", "--out", &out, "--sun-at", "2026-06-21T12:00Z"], 2);
    assert!(said.contains("--sun-place"), "{said}");
    let said = fails(&["render", "--sun-at", "2026-06-21"], 2);
    assert!(said.contains("2026-06-21T18:30Z"), "{said}");
}
