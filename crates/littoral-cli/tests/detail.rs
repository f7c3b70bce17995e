//! Pictures of meshes, by command.

mod common;

use common::{fails, json};

#[test]
fn a_mesh_is_drawn_within_its_tolerance() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    // Hills of some hundred metres.
    let dem = out("hills.asc");
    let mut text = "ncols 65\nnrows 65\nxllcorner 500000\nyllcorner 5000000\ncellsize 30\n".to_owned();
    for row in 0..65 {
        for column in 0..65 {
            let (x, y) = (f64::from(column) * 0.21, f64::from(row) * 0.17);
            text += &format!("{:.2} ", 400.0 + 150.0 * x.sin() * y.cos() + 20.0 * (3.0 * x + y).sin());
        }
        text.push('\n');
    }
    std::fs::write(&dem, text).expect("a file");
    let draw = |name: &str, more: &[&str]| {
        let file = out(name);
        let mut arguments = vec!["render", &dem, "--size", "96x54", "--samples", "1", "--out", &file];
        arguments.extend(more);
        let answer = json(&arguments);
        (answer, std::fs::read(&file).expect("a picture"))
    };
    let (exact, plain) = draw("exact.png", &[]);
    assert!(exact.get("triangles").is_none(), "no mesh was asked for");
    for method in ["nested", "quadtree", "patches", "strips", "roam"] {
        let (fine, picture) = draw("mesh.png", &["--lod", method, "--tolerance", "2"]);
        let (coarse, _) = draw("coarse.png", &["--lod", method, "--tolerance", "8"]);
        for (answer, tolerance) in [(&fine, 2.0), (&coarse, 8.0)] {
            assert!(answer["bound_pixels"].as_f64().is_some_and(|p| p > 0.0 && p <= tolerance), "{method}: {answer}");
            assert_eq!(answer["limited"], false, "{method}");
        }
        let count = |answer: &serde_json::Value| answer["triangles"].as_u64().expect("a number");
        assert!(count(&fine) > count(&coarse), "{method}: {fine} and {coarse}");
        assert_ne!(picture, plain, "{method}: the exact picture");
        let (_, wires) = draw("wires.png", &["--lod", method, "--tolerance", "2", "--wireframe"]);
        assert_ne!(wires, picture, "{method}: no wires");
    }
    let (few, _) = draw("few.png", &["--lod", "patches", "--tolerance", "0.05", "--triangles", "500"]);
    assert!(few["limited"] == true && few["triangles"].as_u64().is_some_and(|n| n <= 500), "{few}");
    let (_, own) = draw(
        "own.png",
        &["--lod", "patches", "--tolerance", "2", "--eye", "500300,5000200,900", "--look", "501200,5001500,300"],
    );
    let away = ["--lod", "patches", "--tolerance", "2", "--eye", "500300,5000200,900", "--look", "501200,5001500,300"];
    let (_, frozen) = draw("frozen.png", &[&away[..], &["--lod-from", "501900,5001900,1500"]].concat());
    assert_ne!(own, frozen, "the mesh is that of another eye");
}

#[test]
fn what_makes_no_mesh_is_refused() {
    fails(&["render", "--lod", "quadtree", "--tolerance", "0"], 2, "expected 0.001 to 1000000 pixels, got 0");
    fails(&["render", "--lod", "quadtree", "--tolerance", "nan"], 2, "expected 0.001");
    fails(&["render", "--lod", "quadtree", "--triangles", "0"], 2, "--triangles");
    fails(&["render", "--wireframe"], 2, "--lod <METHOD>");
    fails(&["render", "--lod", "quadtree", "--path", "orbit"], 2, "cannot be used with '--path");
    fails(&["render", "--lod", "clipmap"], 2, "[possible values: whole, nested, quadtree, patches, strips, roam]");
}
