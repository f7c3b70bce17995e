//! `littoral waves` as a script sees it.

mod common;

use common::{fails, json, littoral, text};
use serde_json::Value;
use std::path::Path;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|v| v.as_f64().expect("a number")).collect()
}

fn close(got: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(got.len(), expected.len());
    for (g, e) in got.iter().zip(expected) {
        assert!((g - e).abs() <= relative * e.abs().max(1e-12), "{g} for {e}");
    }
}

#[test]
fn spectra_agree_with_other_packages() {
    // mhkit 1.1.2, jonswap_spectrum and pierson_moskowitz_spectrum; wavespectra 4.9.0 by wind: f, S.
    let f = "--f=0.1,0.15,0.3";
    let answer = json(&["waves", "spectrum", "--hs", "2", "--tp", "7", "--gamma", "1", f]);
    assert_eq!(numbers(&answer["f"]), [0.1, 0.15, 0.3]);
    let pm = |f: f64| {
        let fp: f64 = 1.0 / 7.0;
        5.0 / 16.0 * 4.0 * fp.powi(4) / f.powi(5) * (-1.25 * (fp / f).powi(4)).exp()
    };
    close(&numbers(&answer["S"]), &[pm(0.1), pm(0.15), pm(0.3)], 1e-3);
    assert!((answer["hs"].as_f64().expect("hs") - 2.0).abs() < 1e-3 && answer["tp"].as_f64() == Some(7.0));
    let wind = json(&["waves", "spectrum", "--model", "pm", "--wind", "10"]);
    close(&[wind["hs"].as_f64().expect("hs"), wind["tp"].as_f64().expect("tp")], &[2.4606, 7.84397], 2e-3);
    assert!((wind["mean_direction"].as_f64().expect("a direction") - 270.0).abs() < 1e-6);
    for key in ["tm01", "tm02", "te", "peak_direction", "spread", "source", "directions", "spreads"] {
        assert!(!wind[key].is_null(), "no {key}");
    }
    let deep = json(&["waves", "spectrum", "--hs", "3", "--tp", "10", f]);
    let shallow = json(&["waves", "spectrum", "--model", "tma", "--hs", "3", "--tp", "10", "--depth", "8", f]);
    assert!(numbers(&shallow["S"]).iter().zip(numbers(&deep["S"])).all(|(s, d)| *s < d));
    let sea = json(&["waves", "spectrum", "--sea", "wind=9,from=120,swell=2@14/300"]);
    assert!(sea["hs"].as_f64() > Some(2.0));
    let calm = json(&["waves", "spectrum", "--sea", "calm"]);
    assert_eq!((calm["hs"].as_f64(), &calm["tp"]), (Some(0.0), &Value::Null));
}

#[test]
fn dispersion_is_exact() {
    // capytaine 3.0.0, mhkit 1.1.2 and linearwavetheory agree on this one.
    let answer = json(&["waves", "dispersion", "--omega", "0.3", "--depth", "0.5", "--g", "9.81"]);
    close(&[answer["k"].as_f64().expect("k")], &[0.135_560_739_900_045_3], 1e-12);
    let k = answer["k"].as_f64().expect("k");
    for (key, value) in [("wavelength", std::f64::consts::TAU / k), ("phase_speed", 0.3 / k)] {
        close(&[answer[key].as_f64().expect(key)], &[value], 1e-12);
    }
    assert!(answer["group_speed"].as_f64() < answer["phase_speed"].as_f64());
    assert_eq!(answer["regime"], "shallow");
    // Deep water without a depth; there and back.
    let deep = json(&["waves", "dispersion", "--period", "8"]);
    let length = deep["wavelength"].as_f64().expect("a length");
    close(&[length], &[9.80665 * 64.0 / std::f64::consts::TAU], 1e-12);
    assert!(deep["depth"].is_null() && deep["kh"].is_null());
    let back = json(&["waves", "dispersion", "--wavelength", &length.to_string()]);
    close(&[back["period"].as_f64().expect("a period")], &[8.0], 1e-12);
    let ripple = json(&["waves", "dispersion", "--wavelength", "0.017", "--tension"]);
    close(&[ripple["phase_speed"].as_f64().expect("a speed")], &[0.231], 0.01);
    let table = littoral(&["waves", "dispersion", "--period", "8", "--depth", "10"]);
    assert!(text(&table.stdout).contains("phase speed"));
}

const BUOY: &str = "#YY  MM DD hh mm Sep_Freq  < spec_1 (freq_1) spec_2 (freq_2) ... >
2020 06 08 03 50 0.225 0.000 (0.050) 1.500 (0.100) 0.500 (0.150) 0.100 (0.200)
2020 06 08 02 50 9.999 0.000 (0.050) 0.900 (0.100) 0.500 (0.150) 0.200 (0.200)
";

fn buoy(folder: &Path) -> String {
    let pairs = |values: [&str; 4]| {
        let [a, b, c, d] = values;
        let head = "#YY  MM DD hh mm KIND_1 (freq_1) ... >\n";
        let line = |minute: &str| format!("2020 06 08 {minute} 50 {a} (0.050) {b} (0.100) {c} (0.150) {d} (0.200)\n");
        format!("{head}{}{}", line("03"), line("02"))
    };
    let write = |name: &str, text: String| std::fs::write(folder.join(name), text).expect("written");
    write("b.data_spec", BUOY.into());
    write("b.swdir", pairs(["999.0", "300.0", "200.0", "200.0"]).replace("KIND", "alpha1"));
    write("b.swdir2", pairs(["999.0", "300.0", "200.0", "200.0"]).replace("KIND", "alpha2"));
    write("b.swr1", pairs(["999.00", "0.90", "0.70", "0.60"]).replace("KIND", "r1"));
    write("b.swr2", pairs(["999.00", "0.70", "0.30", "0.20"]).replace("KIND", "r2"));
    folder.join("b.data_spec").display().to_string()
}

#[test]
fn buoys_are_read_listed_and_chosen_from() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = buoy(folder.path());
    let latest = json(&["waves", "spectrum", "--buoy", &file]);
    assert_eq!(latest["time"], "2020-06-08T03:50Z");
    assert_eq!(numbers(&latest["S"]), [0.0, 1.5, 0.5, 0.1]);
    assert_eq!(numbers(&latest["f"]), [0.05, 0.1, 0.15, 0.2]);
    // Straight lines between the bands.
    let energy = 0.05 * (0.5 * 0.0 + 1.5 + 0.5 + 0.5 * 0.1);
    close(&[latest["hs"].as_f64().expect("hs")], &[4.0 * f64::sqrt(energy)], 1e-12);
    assert_eq!(latest["tp"].as_f64(), Some(10.0));
    assert!((latest["directions"][1].as_f64().expect("a direction") - 300.0).abs() < 1e-6);
    assert!(latest["directions"][0].is_null() && latest["warnings"].as_array().is_some_and(Vec::is_empty));
    // Any of the five files names the buoy; records by number and time.
    let sibling = file.replace(".data_spec", ".swr1");
    for record in ["1", "-2", "2020-06-08T02:50", "2020-06-08 02:30Z"] {
        let earlier = json(&["waves", "spectrum", "--buoy", &sibling, "--record", record, "--f", "0.1"]);
        assert_eq!((numbers(&earlier["S"]), &earlier["time"]), (vec![0.9], &Value::from("2020-06-08T02:50Z")));
    }
    let list = json(&["waves", "spectrum", "--buoy", &file, "--list"]);
    assert_eq!(list["records"].as_array().map(Vec::len), Some(2));
    assert_eq!(list["records"][1]["hs"], latest["hs"]);
    let state = json(&["waves", "spectrum", "--sea", &format!("buoy={file},record=1,seed=3"), "--f", "0.1"]);
    assert_eq!(numbers(&state["S"]), [0.9]);
    fails(&["waves", "spectrum", "--buoy", &file, "--record", "3"], 1, "expected a record from 1 to 2");
    fails(&["waves", "spectrum", "--buoy", &file, "--record", "2021-01-01"], 1, "2020-06-08T03:50Z");
    std::fs::write(
        folder.path().join("b.swr1"),
        "#YY MM DD hh mm r1_1 (freq_1)\n2020 06 08 03 50 7 (0.05) 1.5 (0.1) 0.1 (0.15) 0.2 (0.2)\n",
    )
    .expect("written");
    fails(&["waves", "spectrum", "--buoy", &file], 1, "b.swr1: line 2: expected a value of strength r1 from 0 to 1");
}

#[test]
fn plots_and_tables_are_written_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = buoy(folder.path());
    for name in ["rise.png", "rise.svg", "rise.csv"] {
        for polar in [false, true] {
            let out = folder.path().join(format!("{polar}-{name}")).display().to_string();
            let mut arguments = vec!["waves", "spectrum", "--buoy", &file, "--out", &out];
            if polar {
                arguments.push("--polar");
            }
            let output = littoral(&arguments);
            assert!(output.status.success(), "{}", text(&output.stderr));
            let bytes = std::fs::read(&out).expect("written");
            if name.ends_with("png") {
                assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5000);
            } else if name.ends_with("svg") {
                assert!(text(&bytes).contains("2020-06-08 03:50 UTC") && text(&bytes).ends_with("</svg>\n"));
            } else {
                let rows = text(&bytes).lines().count();
                assert_eq!(rows, if polar { 4 * 72 + 1 } else { 5 });
            }
        }
    }
    // Tiny and odd sizes are drawn, too.
    for size in ["1x1", "30x900", "900x30"] {
        for polar in [&["--polar"][..], &[]] {
            let out = folder.path().join("odd.png").display().to_string();
            let arguments = [&["waves", "spectrum", "--wind", "9", "--out", &out, "--size", size], polar].concat();
            assert!(littoral(&arguments).status.success(), "{arguments:?}");
        }
    }
}

#[test]
fn nonsense_is_refused_and_named() {
    let spectrum = |rest: &[&str], words: &str| fails(&[&["waves", "spectrum"], rest].concat(), 2, words);
    spectrum(&[], "expected a sea (--wind U10");
    spectrum(&["--wind", "nan"], "expected a number, got");
    spectrum(&["--wind", "0"], "a flat sea is --sea calm");
    spectrum(&["--wind", "900"], "wind: expected m/s, above 0 and at most 120, got 900; correct");
    spectrum(&["--hs", "2"], "expected --tp SECONDS beside --hs");
    spectrum(&["--tp", "8"], "--hs");
    spectrum(&["--model", "tma", "--wind", "9"], "expected --depth METRES for --model tma");
    spectrum(&["--model", "tma", "--wind", "9", "--depth", "0"], "depth: expected a number of metres above 0, got 0");
    spectrum(&["--model", "pm", "--wind", "9", "--fetch", "10"], "full-grown");
    spectrum(&["--wind", "9", "--hs", "2"], "cannot be used with");
    spectrum(&["--wind", "9", "--f", "a"], "LOW:STEP:HIGH");
    spectrum(&["--wind", "9", "--spread", "wide"], "hasselmann");
    spectrum(&["--sea", "storm"], "KEY=VALUE");
    spectrum(&["--wind", "9", "--out", "a.txt"], "expected a name ending in .csv, .svg, .png");
    let dispersion = |rest: &[&str], words: &str| fails(&[&["waves", "dispersion"], rest].concat(), 2, words);
    dispersion(&[], "required");
    dispersion(&["--omega", "0"], "expected an angular frequency from 1e-6");
    dispersion(&["--omega", "1", "--period", "2"], "cannot be used with");
    dispersion(&["--omega", "1", "--depth", "-3"], "expected a depth from 1e-6 to 1e6 m, or deep, got -3");
    dispersion(&["--omega", "1", "--g", "nan"], "gravity");
    fails(&["waves", "spectrum", "--buoy", "none.data_spec"], 1, "none of that name");
    // The ends of what may be asked are answered.
    for depth in ["1e-6", "1e6", "deep"] {
        for wave in [["--omega", "1e-6"], ["--omega", "1e4"], ["--wavelength", "1e-6"], ["--wavelength", "1e9"]] {
            for more in [&["--tension"][..], &["--tension", "1"], &["--g", "1e-3"], &["--g", "1e4"]] {
                let answer = json(&[&["waves", "dispersion", "--depth", depth], &wave[..], more].concat());
                assert!(answer["k"].as_f64().is_some_and(|k| k > 0.0), "{depth} {wave:?} {more:?}: {answer}");
            }
        }
    }
}
