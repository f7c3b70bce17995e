//! The sea that is drawn and the sea that is asked about are one, whatever it is made of and wherever it lies.

mod common;

use common::{fails, json, littoral, text};
use exr::prelude::{ReadChannels, ReadLayers, read};
use littoral_data::write::{GridSamples, geotiff};
use littoral_data::{Crs, Georeference, Registration};
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|v| v.as_f64().unwrap_or(f64::NAN)).collect()
}

/// A beach that falls off westward to 25 m, far east in a zone of UTM: its grid's north is 2° off true north.
fn beach(folder: &Path, name: &str, rise: f32) -> String {
    const COLUMNS: usize = 120;
    const ROWS: usize = 90;
    let file = folder.join(name);
    let georeference = Georeference {
        geotransform: [784_000.0, 10.0, 0.0, 5_400_900.0, 0.0, -10.0],
        registration: Registration::Point,
        crs: Crs::from_epsg(32_610).expect("a zone of UTM"),
        size: [COLUMNS, ROWS],
        y_south: false,
    };
    let height = |i: usize| rise - 25.0 + 0.25 * (i % COLUMNS) as f32;
    let heights: Vec<f32> = (0..COLUMNS * ROWS).map(height).collect();
    geotiff(&file, &georeference, None, GridSamples::F32(&heights), None, "").expect("written");
    file.display().to_string()
}

/// The channels of an EXR by name.
fn channels(file: &Path) -> impl Fn(&str) -> Vec<f32> + use<> {
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let channels = image.from_file(file).expect("an EXR").layer_data.channel_data;
    move |name: &str| {
        let channel = channels.list.iter().find(|c| c.name.to_string() == name);
        channel.unwrap_or_else(|| panic!("no {name}")).sample_data.values_as_f32().collect()
    }
}

/// Heights and normals of the answer for points X,Y, and the words on stderr.
fn asked(arguments: &[&str], points: &str) -> (Vec<f64>, Vec<[f64; 3]>) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_littoral"))
        .args(["waves", "height"])
        .args(arguments)
        .args(["--points", "-", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the command runs");
    child.stdin.take().expect("a pipe").write_all(points.as_bytes()).expect("taken");
    let output = child.wait_with_output().expect("an answer");
    let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let three = |value: &Value| value.as_array().map_or([f64::NAN; 3], |_| numbers(value).try_into().expect("three"));
    (numbers(&answer["height"]), answer["normal"].as_array().expect("normals").iter().map(three).collect())
}

/// Draws a sea from low above it and asks about every place that the picture shows.
fn drawn_is_asked(render: &[&str], height: &[&str], other: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("sea.exr");
    let name = out.display().to_string();
    let fixed = ["--size", "40x30", "--fov", "5", "--samples", "1", "--passes", "position,normal", "--out", &name];
    let answer = json(&[&["render"], render, &fixed].concat());
    let eye = numbers(&answer["eye"]);
    let channel = channels(&out);
    let [x, y, z] = ["position.X", "position.Y", "position.Z"].map(&channel);
    let [nx, ny, nz] = ["normal.X", "normal.Y", "normal.Z"].map(&channel);
    let place = |i: usize| [f64::from(x[i]) + eye[0], f64::from(y[i]) + eye[1]];
    let points: String = (0..x.len()).map(|i| format!("{},{}\n", place(i)[0], place(i)[1])).collect();
    let (heights, normals) = asked(height, &points);
    assert_eq!((heights.len(), x.len()), (1200, 1200));
    let (mut worst, mut tilt, mut low, mut high) = (0f64, 0f64, f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..heights.len() {
        let seen = f64::from(z[i]) + eye[2];
        worst = worst.max((heights[i] - seen).abs());
        (low, high) = (low.min(seen), high.max(seen));
        let n = [nx[i], ny[i], nz[i]].map(f64::from);
        tilt += (0..3).map(|k| n[k] * normals[i][k]).sum::<f64>() / 1200.0;
    }
    // Waves narrower than a pixel, here a decimetre, are not in the picture.
    assert!(worst < 6e-3, "{worst} m between picture and answer");
    // The picture has ripples besides, finer than any wave of the sea.
    assert!(tilt > 0.97, "normals differ: mean cosine {tilt}");
    assert!(high - low > 0.15, "the picture shows {} m of waves: too few to tell", high - low);
    let (others, _) = asked(other, &points);
    let off = others.iter().zip(&heights).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off > 0.05, "another sea is the same one to {off} m");
}

#[test]
fn the_picture_of_the_coast_shows_what_is_asked() {
    let eye = ["--eye", "2600,900,25", "--look", "2600,930,0", "--time", "7.5"];
    drawn_is_asked(
        &eye,
        &["--land", "coast", "--time", "7.5"],
        &["--land", "coast", "--sea", "beaufort=4,from=225", "--seed", "1", "--time", "7.5"],
    );
}

#[test]
fn the_picture_of_a_file_shows_what_is_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let land = beach(folder.path(), "beach.tif", 0.0);
    let sea = ["--sea", "wind=9,from=300,swell=1@10/250,seed=3", "--time", "-40"];
    let eye = ["--eye", "784500,5400400,20", "--look", "784520,5400420,0"];
    drawn_is_asked(
        &[&[land.as_str()], &sea[..], &eye].concat(),
        &[&["--land", land.as_str()], &sea[..]].concat(),
        &["--land", land.as_str(), "--sea", "wind=9,from=300,swell=1@10/250", "--time", "-40"],
    );
}

#[test]
fn where_the_picture_shows_sand_it_is_dry() {
    let folder = tempfile::tempdir().expect("a folder");
    let land = beach(folder.path(), "beach.tif", 0.0);
    let out = folder.path().join("shore.exr");
    let sea = ["--sea", "hs=1.2,tp=8,from=270", "--time", "11"];
    // The waterline lies at X = 785005, where the ground is a centimetre for every four.
    let eye = ["--eye", "784990,5400400,14", "--look", "785006,5400401,0", "--size", "60x60", "--fov", "50"];
    let name = out.display().to_string();
    let fixed = ["--samples", "1", "--passes", "position", "--out", &name];
    let answer = json(&[&["render", land.as_str()], &sea[..], &eye, &fixed].concat());
    let eye = numbers(&answer["eye"]);
    let channel = channels(&out);
    let [x, y, z] = ["position.X", "position.Y", "position.Z"].map(&channel);
    let points: String =
        (0..x.len()).map(|i| format!("{},{}\n", f64::from(x[i]) + eye[0], f64::from(y[i]) + eye[1])).collect();
    let (heights, _) = asked(&[&["--land", land.as_str()], &sea[..]].concat(), &points);
    let (mut dry, mut wet, mut apart, mut worst) = (0, 0, 0, 0f64);
    for i in 0..heights.len() {
        let ground = -25.0 + 0.025 * (f64::from(x[i]) + eye[0] - 784_005.0);
        let shown = f64::from(z[i]) + eye[2];
        let (told, near) = if heights[i].is_nan() { (ground, 0.02) } else { (heights[i], 0.05) };
        if heights[i].is_nan() {
            dry += 1
        } else {
            wet += 1
        }
        apart += usize::from((shown - told).abs() > near);
        worst = worst.max((shown - told).abs());
    }
    assert!(dry > 500 && wet > 500, "{dry} dry, {wet} wet");
    assert!(apart == 0 && worst < 0.01, "{apart} pixels are apart from what is told, by up to {worst} m");
}

#[test]
fn one_point_gives_numbers_and_several_give_lists() {
    let sea = ["waves", "height", "--sea", "wind=12,from=200", "--time", "3"];
    let one = json(&[&sea[..], &["--at", "10,-20"]].concat());
    let normal = numbers(&one["normal"]);
    assert!((normal.iter().map(|n| n * n).sum::<f64>() - 1.0).abs() < 1e-5 && normal[2] > 0.5);
    assert_eq!(numbers(&one["velocity"]).len(), 3);
    assert!((one["hs"].as_f64().expect("hs") - 4.0).abs() < 2.0 && one["level"].as_f64() == Some(0.0));
    let two = json(&[&sea[..], &["--at", "10,-20", "11,-20"]].concat());
    assert_eq!((&two["height"][0], &two["velocity"][0]), (&one["height"], &one["velocity"]));
    assert_ne!(two["height"][1], one["height"]);
    let output = littoral(&[&sea[..], &["--at", "10,-20"]].concat());
    let fields: Vec<f64> = text(&output.stdout).trim().split(',').map(|f| f.parse().expect("a number")).collect();
    assert_eq!(fields.len(), 9);
    assert!((fields[2] - one["height"].as_f64().expect("a height")).abs() < 1e-6 && fields[..2] == [10.0, -20.0]);
    // The seed of the words is that of the flag; another is another sea.
    let seed = |spec: &str, more: &[&str]| {
        json(&[&["waves", "height", "--at", "0,0", "--sea", spec], more].concat())["height"].clone()
    };
    assert_eq!(seed("wind=9,seed=4", &[]), seed("wind=9", &["--seed", "4"]));
    assert_ne!(seed("wind=9,seed=4", &[]), seed("wind=9", &[]));
    // The deeper, the stiller; and above is at the surface.
    let speed = |more: &[&str]| {
        let v = numbers(&json(&[&sea[..], &["--at", "10,-20"], more].concat())["velocity"]);
        v.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    let (surface, five, fifty) = (speed(&[]), speed(&["--below", "5"]), speed(&["--below", "50"]));
    assert!(fifty < 0.6 * five && five < surface && speed(&["--z", "100"]) == surface, "{surface} {five} {fifty}");
    let calm = json(&["waves", "height", "--sea", "calm", "--at", "0,0"]);
    assert_eq!((calm["height"].as_f64(), numbers(&calm["velocity"])), (Some(0.0), vec![0.0; 3]));
}

#[test]
fn dry_ground_has_no_sea_and_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let (land, hills) = (beach(folder.path(), "beach.tif", 0.0), beach(folder.path(), "hills.tif", 26.0));
    let sea = ["--sea", "beaufort=5"];
    let at = ["--at", "785150,5400400", "784100,5400400", "783000,5400400"];
    let answer = json(&[&["waves", "height", "--land", &land], &sea[..], &at].concat());
    assert!(answer["height"][0].is_null() && answer["normal"][0].is_null() && answer["height"][1].is_number());
    let warnings = answer["warnings"].to_string();
    assert!(warnings.contains("1 of 3 points are dry: the ground at 785150,5400400 is 3.62 m high"), "{warnings}");
    assert!(warnings.contains("1 of 3 points lie outside the data"), "{warnings}");
    let deep = ["--at", "784100,5400400", "--z", "-24"];
    let buried = json(&[&["waves", "height", "--land", &land], &sea[..], &deep].concat());
    assert!(buried["velocity"].is_null() && buried["height"].is_number());
    let high = ["--water", "10", "--at", "785150,5400400"];
    let risen = json(&[&["waves", "height", "--land", &land], &sea[..], &high].concat());
    assert!((risen["height"].as_f64().expect("wet") - 10.0).abs() < 3.0 && risen["level"].as_f64() == Some(10.0));
    fails(&[&["waves", "height", "--land", &hills], &sea[..], &["--at", "784100,5400400"]].concat(), 1, "a dry bed");
}

#[test]
fn a_buoy_makes_the_sea_of_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("b2020.txt");
    std::fs::write(
        &file,
        "#YY MM DD hh mm .0800 .1000 .1500 .2000\n2020 06 08 03 50 0.0 4.0 1.0 0.3\n2020 06 08 04 50 0.0 40.0 1.0 0.3\n",
    )
    .expect("written");
    let name = file.display();
    let hs = |spec: &str| json(&["waves", "height", "--sea", spec, "--at", "0,0"])["hs"].as_f64().expect("a height");
    let (first, last) = (hs(&format!("buoy={name},record=1")), hs(&format!("buoy={name}")));
    assert!(last > 2.0 * first && first > 1.0, "{first} {last}");
    let out = folder.path().join("a.png").display().to_string();
    let land = beach(folder.path(), "beach.tif", 0.0);
    let spec = format!("buoy={name},record=1,wind=6,from=280");
    let small = ["--size", "32x18", "--samples", "1", "--out", &out];
    json(&[&["render", &land, "--sea", &spec], &small[..]].concat());
    // What cannot be read names the field, its range, and the file where there is one.
    let render = |spec: &str, code: i32, words: &str| {
        fails(&[&["render", &land, "--sea", spec], &small[..]].concat(), code, words);
        fails(&["waves", "height", "--at", "0,0", "--sea", spec], code, words);
    };
    render(&format!("buoy={name}x"), 1, "none of that name");
    std::fs::write(folder.path().join("broken.txt"), "#YY MM DD hh mm .0800 .1000\n2020 06 08 03 50 0.0 -4.0\n")
        .expect("written");
    render(&format!("buoy={}", folder.path().join("broken.txt").display()), 1, "broken.txt: line 2: expected a value");
    render("wind=NaN", 2, "`wind=NaN`: expected m/s, above 0 and at most 120");
    render("wind=900", 2, "wind: expected m/s, above 0 and at most 120, got 900");
    render("wind=9,depth=0", 2, "depth: expected a number of metres above 0, got 0");
    render("hs=2,tp=inf", 2, "`tp=inf`: expected seconds, above 0 and at most 100");
    render("hs=50,tp=1", 2, "alpha: expected a number from 0 to 1000");
}

#[test]
fn a_record_is_the_answers_of_its_instants() {
    let sea = ["waves", "height", "--sea", "wind=12,from=200", "--time", "3"];
    let until = ["--until", "4.2", "--every", "0.4", "--at", "10,-20", "11,-20"];
    let record = json(&[&sea[..], &until].concat());
    let moments = record["record"].as_array().expect("instants");
    assert_eq!(moments.len(), 4);
    let output = littoral(&[&sea[..], &until].concat());
    let lines: Vec<Vec<f64>> = text(&output.stdout)
        .lines()
        .map(|line| line.split(',').map(|field| field.parse().expect("a number")).collect())
        .collect();
    assert_eq!(lines.len(), 8);
    for (i, moment) in moments.iter().enumerate() {
        let time = 3.0 + 0.4 * i as f64;
        assert!((moment["time"].as_f64().expect("a time") - time).abs() < 1e-9);
        let then = ["waves", "height", "--sea", "wind=12,from=200", "--time", &time.to_string()];
        let alone = json(&[&then[..], &["--at", "10,-20", "11,-20"]].concat());
        let [told, alone] = [&moment["height"], &alone["height"]].map(numbers);
        assert!(told.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-6), "{told:?} for {alone:?}");
        assert!(lines[2 * i].len() == 10 && (lines[2 * i][0] - time).abs() < 1e-6);
        assert!((lines[2 * i][3] - told[0]).abs() < 1e-5 && lines[2 * i + 1][1..3] == [11.0, -20.0]);
    }
    assert_eq!(record["height"], moments[0]["height"]);
    assert_ne!(moments[3]["height"], moments[0]["height"]);
}

#[test]
fn nonsense_is_refused_and_named() {
    let height = |rest: &[&str], words: &str| fails(&[&["waves", "height"], rest].concat(), 2, words);
    height(&["--at", "0,0"], "--sea <SPEC>");
    height(&["--sea", "wind=9"], "--at <X,Y>");
    height(&["--sea", "wind=9", "--at", "0"], "expected two numbers X,Y");
    height(&["--sea", "wind=9", "--at", "0,nan"], "expected two numbers X,Y");
    height(&["--sea", "wind=9,seed=1", "--seed", "2", "--at", "0,0"], "got both");
    height(&["--sea", "wind=9", "--at", "0,0", "--time", "nan"], "-1e9 to 1e9 seconds");
    height(&["--sea", "wind=9", "--at", "0,0", "--time", "5", "--until", "4"], "ends after it begins");
    let long = ["--sea", "wind=9", "--at", "0,0", "--until", "1e9", "--every", "0.001", "--json"];
    height(&long, "at most 1e7 answers with --json");
    height(&["--sea", "wind=9", "--at", "0,0", "--every", "1"], "--until");
    height(&["--sea", "wind=9", "--at", "0,0", "--lonlat"], "--land");
    height(&["--sea", "wind=9", "--at", "0,0", "--below", "-1"], "a depth from 0");
    fails(&["waves", "height", "--sea", "wind=9", "--at", "1e300,0"], 1, "within 1e9 m");
    fails(&["waves", "height", "--land", "none.tif", "--sea", "wind=9", "--at", "0,0"], 1, "none of that name");
}

/// Samples of a PNG as whole numbers, and how many a pixel has.
fn png_of(file: &Path) -> (usize, Vec<u16>, usize) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).expect("a picture")))
        .read_info()
        .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut bytes).expect("pixels");
    let values = match info.bit_depth {
        png::BitDepth::Sixteen => bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect(),
        _ => bytes.iter().map(|b| u16::from(*b)).collect(),
    };
    (info.width as usize, values, info.color_type.samples())
}

#[test]
fn exported_tiles_say_how_they_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let path = |name: &str| at(name).display().to_string();
    let sea = ["waves", "export", "--sea", "wind=14,from=190,seed=2", "--size", "128", "--tile", "200", "--time", "20"];
    let floats = json(&[&sea[..], &["--out", &path("a.exr")]].concat());
    let pictures = json(&[&sea[..], &["--out", &path("a.png")]].concat());
    assert!(floats["range"].is_null() && floats["sample"].as_f64() == Some(200.0 / 128.0));
    assert_eq!(pictures["files"].as_array().map(Vec::len), Some(3));
    let range = pictures["range"].as_f64().expect("a range");
    let channel = channels(&at("a.exr"));
    let (side, codes, parts) = png_of(&at("a_displacement.png"));
    assert_eq!((side, parts, codes.len()), (128, 3, 128 * 128 * 3));
    let mut most = 0f64;
    for (part, name) in ["displacement.X", "displacement.Y", "displacement.Z"].into_iter().enumerate() {
        for (i, metres) in channel(name).into_iter().enumerate() {
            let read = (2.0 * f64::from(codes[3 * i + part]) / 65_535.0 - 1.0) * range;
            assert!((read - f64::from(metres)).abs() <= 1.01 * range / 65_535.0, "{name} {i}: {read} for {metres}");
            most = most.max(f64::from(metres).abs());
        }
    }
    assert!(most <= range && most > 0.95 * range, "range {range} for {most}");
    let (_, codes, _) = png_of(&at("a_normal.png"));
    for (part, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
        let off = |(i, n): (usize, f32)| (2.0 * f32::from(codes[3 * i + part]) / 255.0 - 1.0 - n).abs();
        assert!(channel(name).into_iter().enumerate().map(off).fold(0.0, f32::max) < 0.0041, "{name}");
    }
    let (_, codes, parts) = png_of(&at("a_foam.png"));
    let foam = channel("foam.V");
    assert!(parts == 1 && codes.iter().zip(&foam).all(|(c, f)| (f32::from(*c) - f * 255.0).abs() < 0.51));
    assert!(codes.iter().any(|c| *c > 100), "a gale without foam");
    // One thing alone has plain channels; all of the sea is that of the words.
    json(&[&sea[..], &["--what", "normal", "--out", &path("n.exr")]].concat());
    assert_eq!(channels(&at("n.exr"))("G"), channel("normal.Y"));
    let tile_hs = pictures["tile_hs"].as_f64().expect("a height");
    assert!(tile_hs > 0.9 * pictures["hs"].as_f64().expect("a height"), "{tile_hs}");
}

#[test]
fn exported_loops_close() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let export = |time: &str, name: &str, more: &[&str]| {
        let sea = ["waves", "export", "--sea", "wind=14", "--size", "64", "--tile", "100", "--loop", "6", "--fps", "2"];
        json(&[&sea[..], &["--time", time, "--out", &at(name).display().to_string()], more].concat())
    };
    let answer = export("0", "one", &[]);
    assert_eq!((answer["frames"].as_u64(), answer["files"].as_array().map(Vec::len)), (Some(12), Some(36)));
    export("6", "two", &[]);
    export("3", "half", &[]);
    let bytes = |folder: &str, name: &str| std::fs::read(at(folder).join(name)).expect("written");
    for what in ["displacement", "normal", "foam"] {
        for frame in 1..=12 {
            let name = format!("{what}_{frame:05}.png");
            // A loop later everything is as it was; half a loop later so are the frames half a loop before.
            assert!(
                bytes("one", &name).iter().zip(bytes("two", &name)).filter(|(a, b)| **a != *b).count() == 0,
                "{name}"
            );
            let later = format!("{what}_{:05}.png", (frame + 5) % 12 + 1);
            assert_eq!(png_of(&at("half").join(&name)).1, png_of(&at("one").join(&later)).1, "{name}");
        }
        let frames = [1, 2].map(|frame| bytes("one", &format!("{what}_{frame:05}.png")));
        assert_ne!(frames[0], frames[1], "{what} stands still");
    }
    let told: Value = serde_json::from_slice(&bytes("one", "tile.json")).expect("JSON");
    assert_eq!((&told["range"], told["loop"].as_f64(), told["fps"].as_f64()), (&answer["range"], Some(6.0), Some(2.0)));
    let floats = export("0", "floats", &["--format", "exr", "--what", "foam,displacement"]);
    assert!(floats["range"].is_null() && at("floats").join("displacement_00012.exr").is_file());
}

#[test]
fn exports_that_make_no_sense_are_refused() {
    let export = |rest: &[&str], words: &str| fails(&[&["waves", "export"], rest].concat(), 2, words);
    let sea = ["--sea", "wind=9", "--out"];
    export(&["--sea", "wind=9"], "--out <FILE|FOLDER>");
    export(&[&sea[..], &["a.tif"]].concat(), "a name ending in .exr or .png, or a folder, got .tif");
    export(&[&sea[..], &["a.png", "--loop", "8"]].concat(), "expected a folder for the frames of a loop");
    export(&[&sea[..], &["a.png", "--format", "exr"]].concat(), "expected the ending of --format");
    export(&[&sea[..], &["a.png", "--size", "100"]].concat(), "a power of two from 64 to 1024");
    export(&[&sea[..], &["a.png", "--tile", "0"]].concat(), "a length from 0.1 to 1e6 m");
    export(&[&sea[..], &["a.png", "--choppiness", "nan"]].concat(), "expected a factor from 0 to 2");
    export(&[&sea[..], &["a", "--loop", "3600", "--fps", "1000"]].concat(), "at most 100000 frames");
    export(&["--sea", "wind=nan", "--out", "a.png"], "expected m/s, above 0 and at most 120");
    fails(
        &["waves", "export", "--sea", "wind=9", "--out", "no/where/a.png"],
        1,
        "expected the folder no/where to exist",
    );
    // Calm water and tiles of anything from ripples to oceans are exported, and say what they lack.
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a.png").display().to_string();
    for (spec, tile, words) in [
        ("calm", "10", "[]"),
        ("wind=20", "2", "of the waves' energy"),
        ("beaufort=1", "1e6", "of the waves' energy"),
        ("wind=20,depth=0.5", "300", "waves of 7.3 m in 0.5 m of water would have broken"),
        ("wind=9,depth=6,model=tma", "300", "[]"),
    ] {
        let answer = json(&["waves", "export", "--sea", spec, "--tile", tile, "--size", "64", "--out", &out]);
        assert!(answer["warnings"].to_string().contains(words), "{spec}: {answer}");
    }
}
