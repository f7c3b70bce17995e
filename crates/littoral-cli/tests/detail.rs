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
fn films_of_meshes_are_drawn_frame_by_frame() {
    let folder = tempfile::tempdir().expect("a folder");
    let film = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        std::fs::create_dir_all(&out).expect("a folder");
        let file = out.display().to_string();
        let film = ["render", "--path", "orbit", "--seconds", "3", "--fps", "1", "--size", "64x36", "--samples", "1"];
        let answer = json(&[&film[..], &["--out", &file], more].concat());
        let frames = (1..=3).map(|i| std::fs::read(out.join(format!("frame_{i:05}.png"))).expect("a frame"));
        (answer, frames.collect::<Vec<_>>())
    };
    let (exact, plain) = film("exact", &[]);
    assert!(exact.get("triangles").is_none(), "no mesh was asked for");
    for method in ["quadtree", "roam"] {
        let coarse = ["--lod", method, "--tolerance", "6"];
        let (answer, frames) = film(method, &coarse);
        assert!(answer["bound_pixels"].as_f64().is_some_and(|p| p > 0.0 && p <= 6.0), "{method}: {answer}");
        assert!(answer["triangles"].as_u64().is_some_and(|n| n > 10) && answer["frames_drawn"] == 3, "{answer}");
        for (mesh, exact) in frames.iter().zip(&plain) {
            assert_ne!(mesh, exact, "{method}: the exact picture");
        }
        // What is missing is drawn as if nothing had been: what came before leaves no trace.
        std::fs::remove_file(folder.path().join(method).join("frame_00002.png")).expect("a frame");
        let (again, repaired) = film(method, &coarse);
        assert!(again["frames_drawn"] == 1 && repaired == frames, "{method}: {again}");
    }
}

/// The mesh stays that of one eye, on land and sea, while the film's camera flies.
#[test]
fn a_film_of_a_frozen_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    let film = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        std::fs::create_dir_all(&out).expect("a folder");
        let film = ["render", "--path", "orbit", "--seconds", "3", "--fps", "1", "--size", "64x36", "--samples", "1"];
        let mesh = ["--lod", "roam", "--tolerance", "6", "--out"];
        let answer = json(&[&film[..], &mesh, &[&out.display().to_string()], more].concat());
        let frame = std::fs::read(out.join("frame_00003.png")).expect("a frame");
        (answer["triangles"].as_u64().expect("a number"), answer["bound_pixels"].as_f64().expect("a number"), frame)
    };
    let (_, _, flown) = film("flown", &[]);
    let (near, bound, frozen) = film("near", &["--lod-from", "3380,560,175"]);
    let (far, _, other) = film("far", &["--lod-from", "3380,-90000,60000"]);
    assert!(far < near && bound <= 6.0, "{far} triangles from afar, {near} from near");
    assert!(frozen != flown && frozen != other, "each mesh is of its own eye");
}

#[test]
fn what_makes_no_mesh_is_refused() {
    fails(&["render", "--lod", "quadtree", "--tolerance", "0"], 2, "expected 0.001 to 1000000 pixels, got 0");
    fails(&["render", "--lod", "quadtree", "--tolerance", "nan"], 2, "expected 0.001");
    fails(&["render", "--lod", "quadtree", "--triangles", "0"], 2, "--triangles");
    fails(&["render", "--wireframe"], 2, "--lod <METHOD>");
    fails(&["render", "--lod", "clipmap"], 2, "[possible values: whole, nested, quadtree, patches, strips, roam]");
}
