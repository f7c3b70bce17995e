//! Lakes that are named, by command.

mod common;

use common::{fails, json, littoral, text};
use std::path::Path;

/// A bowl 40 m deep in a plain at 60 m, of 61 × 61 samples 10 m apart: as a file that begins at X 1000, Y 2000.
fn bowl(file: &Path) {
    let mut text = String::from("ncols 61\nnrows 61\nxllcenter 1000\nyllcenter 2000\ncellsize 10\n");
    for row in 0..61 {
        for column in 0..61 {
            let away = (f64::from(column) - 30.0).hypot(f64::from(row) - 30.0) / 25.0;
            text += &format!("{:.3} ", 20.0 + 40.0 * (away * away).min(1.0));
        }
        text.push('\n');
    }
    std::fs::write(file, text).expect("written");
}

#[test]
fn a_lake_is_filled_drawn_and_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let (land, out) = (folder.path().join("bowl.asc"), folder.path().join("bowl.exr"));
    bowl(&land);
    let (land, out) = (land.display().to_string(), out.display().to_string());
    let view = ["--eye", "1300,1900,200", "--look", "1300,2300,40", "--size", "64x36", "--samples", "2"];
    let render = |more: &[&str]| json(&[&["render", &land, "--out", &out], &view[..], more].concat());
    assert!(render(&[]).get("lakes").is_none());
    let answer = render(&["--lake", "1250,2300=50"]);
    let lake = &answer["lakes"][0];
    // The shore lies where 40 (r / 250)² = 30.
    let area = std::f64::consts::PI * 250.0 * 250.0 * 0.75;
    assert!((lake["area_m2"].as_f64().expect("a number") / area - 1.0).abs() < 0.02, "{lake}");
    assert!((lake["volume_m3"].as_f64().expect("a number") / (0.5 * area * 30.0) - 1.0).abs() < 0.02, "{lake}");
    assert_eq!((&lake["level"], &lake["deepest_m"], &lake["overflows_at"]), (&50.0.into(), &30.0.into(), &60.0.into()));
    // Stretched, it is told as unstretched.
    let stretched = render(&["--lake", "1250,2300=50", "--exaggeration", "2"]);
    assert_eq!(stretched["lakes"][0]["deepest_m"], lake["deepest_m"]);
    // --above counts from its surface.
    let above = |height: &str, lake: &[&str]| {
        let eye = format!("1300,2300,{height}");
        let near = ["render", &land, "--out", &out, "--eye", &eye, "--size", "16x9", "--samples", "1", "--above"];
        json(&[&near[..], lake].concat())["eye"][2].as_f64().expect("a height")
    };
    assert_eq!((above("7", &[]), above("7", &["--lake", "1300,2300=50"])), (27.0, 57.0));
    // In films and as a map, too.
    let frames = folder.path().join("frames").display().to_string();
    let film = ["render", &land, "--lake", "1300,2300=50", "--path", "orbit", "--out", &frames, "--style", "tint"];
    json(&[&film[..], &["--size", "16x10", "--seconds", "0.1", "--fps", "20", "--samples", "1"]].concat());
}

#[test]
fn what_cannot_be_filled_says_why() {
    let folder = tempfile::tempdir().expect("a folder");
    let (land, out) = (folder.path().join("bowl.asc"), folder.path().join("bowl.png"));
    bowl(&land);
    let (land, out) = (land.display().to_string(), out.display().to_string());
    let refused = |lakes: &[&str], code: i32, words: &str| {
        let mut all = vec!["render", &land, "--out", &out, "--size", "16x9", "--samples", "1"];
        lakes.iter().for_each(|lake| all.extend(["--lake", lake]));
        fails(&all, code, words);
        assert!(!Path::new(&out).exists());
    };
    refused(
        &["1300,2300=70"],
        1,
        "--lake 1300,2300=70: expected a level below 60.00 m, at which the hollow overflows beyond the data, got 70.00 m; lower it; its outlet is at",
    );
    refused(&["1300,2300=10"], 1, "got 20.00 m");
    refused(&["-1300,2300=50"], 1, "void or outside");
    refused(&["1300,2300=50", "1310,2300=50"], 1, "name it once");
    refused(&["1300,2300"], 2, "X,Y=LEVEL");
    let output = littoral(&["render", &land, "--out", &out, "--size", "16x9", "--lake", "1300,2300=50"]);
    assert!(text(&output.stderr).contains("it would overflow at 60 m"), "{}", text(&output.stderr));
}
