//! The graphics adapter, by command. Where there is none the command says so, and these tests pass.

mod common;

use common::{fails, json, littoral, text};

/// Hills of some hundred metres, as a file.
fn hills(file: &str) {
    let mut dem = "ncols 65\nnrows 49\nxllcorner 500000\nyllcorner 5000000\ncellsize 30\n".to_owned();
    for row in 0..49 {
        for column in 0..65 {
            let (x, y) = (f64::from(column) * 0.21, f64::from(row) * 0.17);
            dem += &format!("{:.2} ", 400.0 + 150.0 * x.sin() * y.cos() + 20.0 * (3.0 * x + y).sin());
        }
        dem.push('\n');
    }
    std::fs::write(file, dem).expect("a file");
}

/// What the command answers; `None` if there is no adapter, which is what it says then.
fn answer(arguments: &[&str]) -> Option<serde_json::Value> {
    let output = littoral(&[arguments, &["--json"]].concat());
    let said = text(&output.stderr);
    if !output.status.success() {
        assert!(said.contains("expected a graphics adapter, found none"), "{said}");
        println!("not tested: {said}");
        return None;
    }
    Some(serde_json::from_slice(&output.stdout).expect("JSON"))
}

#[test]
fn the_card_draws_the_exact_surface_unless_a_mesh_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    let dem = out("hills.asc");
    hills(&dem);
    let small = |file| ["render", &dem, "--gpu", "--size", "96x54", "--samples", "1", "--out", file];
    let (rays, mesh) = (out("rays.png"), out("mesh.png"));
    let Some(exact) = answer(&small(&rays)) else { return };
    assert!(exact.get("triangles").is_none(), "no mesh was asked for: {exact}");
    let meshed = json(&[&small(&mesh)[..], &["--lod", "patches", "--tolerance", "30"]].concat());
    assert!(meshed["triangles"].as_u64().is_some_and(|n| n > 0), "{meshed}");
    let [rays, mesh] = [rays, mesh].map(|file| std::fs::read(file).expect("a picture"));
    assert_ne!(rays, mesh);
}

#[test]
fn both_processors_are_measured_and_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    let (dem, sheet) = (out("hills.asc"), out("sheet.png"));
    hills(&dem);
    let small = ["--size", "96x54", "--frames", "2", "--samples", "2"];
    let Some(answer) = answer(&[&["bench", "gpu", &dem, "--out", &sheet][..], &small].concat()) else { return };
    assert!(answer["adapter"]["name"].is_string() && answer["adapter"]["kind"].is_string(), "{answer}");
    let views = answer["views"].as_array().expect("views");
    assert_eq!(views.len(), 2);
    for view in views {
        let rows = view["rows"].as_array().expect("rows");
        let by: Vec<_> = rows.iter().filter_map(|row| row["drawn_by"].as_str()).collect();
        assert_eq!(by, ["processor, rays", "adapter, rays", "adapter, mesh", "processor, another seed"]);
        for row in &rows[..3] {
            let (half, most) = (row["frame_ms"].as_f64(), row["frame_99_ms"].as_f64());
            assert!(half > Some(0.0) && most >= half, "{row}");
        }
        assert!(rows[2]["triangles"].as_u64() > Some(0));
        for row in &rows[1..] {
            assert!(row["mean_difference"].as_f64().is_some_and(|d| d < 12.0), "{row}");
            assert!(row["far_share"].as_f64().is_some_and(|share| share < 0.3), "{row}");
        }
    }
    let png = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&sheet).expect("a sheet")));
    let info = png.read_info().expect("a picture");
    assert_eq!((info.info().width, info.info().height), (3 * 96, 2 * 54));
    let table = text(&littoral(&[&["bench", "gpu", &dem][..], &small].concat()).stdout);
    assert!(table.contains("adapter, rays") && table.contains("from above"), "{table}");
    fails(&["bench", "gpu", &dem, "--out", &out("sheet.jpg")], 2, ".png");
    fails(&["bench", "gpu", &dem, "--size", "96x9000000"], 2, "--size");
}
