//! Things that stand in pictures, by command.

mod common;

use common::{fails, json, littoral, text};
use std::path::Path;

/// Pixels of a PNG.
fn pixels(file: &str) -> Vec<u8> {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).expect("a picture")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    reader.next_frame(&mut bytes).expect("pixels");
    bytes
}

#[test]
fn things_stand_where_they_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    let tower = out("tower.glb");
    littoral_data::write::object(Path::new(&tower), &littoral::objects::lighthouse()).expect("written");
    let near = ["--eye", "3700,920,60", "--look", "3690,1000,50", "--samples", "1", "--size", "96x54"];
    let render = |file: &str, more: &[&str]| json(&[&["render", "--out", file], &near[..], more].concat());
    let [bare, built_in, read, afloat] = ["bare.png", "built_in.png", "read.png", "afloat.png"].map(out);
    assert!(render(&bare, &[]).get("objects").is_none());
    assert_eq!(render(&built_in, &["--object", "lighthouse@3690,1000"])["objects"], 1);
    let of_file = format!("{tower}@3690,1000,0,1");
    render(&read, &["--object", &of_file]);
    assert_ne!(pixels(&bare), pixels(&built_in));
    // Read back, it has other coarse forms or none.
    let (one, two) = (pixels(&built_in), pixels(&read));
    let apart = one.iter().zip(&two).filter(|(a, b)| a.abs_diff(**b) > 24).count();
    assert!(apart * 50 < one.len(), "{apart} of {}", one.len());
    assert_eq!(render(&afloat, &["--object", "buoy@3300,300", "--object", &of_file])["objects"], 2);
}

#[test]
fn the_card_draws_them_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    let small = [
        "--eye",
        "3700,920,60",
        "--look",
        "3690,1000,50",
        "--samples",
        "1",
        "--size",
        "96x54",
        "--gpu",
        "--object",
        "lighthouse@3690,1000",
    ];
    let file = out("card.png");
    let output = littoral(&[&["render", "--out", &file], &small[..]].concat());
    if !output.status.success() {
        let said = text(&output.stderr);
        assert!(said.contains("expected a graphics adapter, found none"), "{said}");
        return println!("not tested: {said}");
    }
    let card = pixels(&file);
    let bare = out("bare.png");
    littoral(&[&["render", "--out", &bare], &small[..small.len() - 2]].concat());
    assert_ne!(card, pixels(&bare));
    let frames = out("frames");
    littoral(&[&["render", "--path", "--seconds", "0.1", "--fps", "10", "--out", &frames], &small[4..]].concat());
    let first =
        std::fs::read_dir(&frames).expect("frames").flatten().any(|f| f.path().extension().is_some_and(|e| e == "png"));
    assert!(first);
}

#[test]
fn what_cannot_stand_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    let file = out("none.png");
    let with = |order: &str, code, words| {
        let small = ["render", "--out", &file, "--size", "64x36", "--samples", "1", "--water", "none"];
        fails(&[&small[..], &["--object", order]].concat(), code, words);
    };
    with("lighthouse@3690,9000", 1, "expected ground or water");
    with("nowhere.glb@3690,1000", 1, "nowhere.glb");
    with("lighthouse", 2, "FILE@X,Y");
    let text = out("text.glb");
    std::fs::write(&text, "no object").expect("written");
    with(&format!("{text}@3690,1000"), 1, "another format");
    assert!(!Path::new(&file).exists());
}
