//! The program in a window that nobody sees: a virtual display, keys and clicks sent to it, and what it leaves behind.

#![cfg(target_os = "linux")]

use littoral_data::path::SavedPath;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_littoral-fly");

/// Ended with the test, however that ends.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn there(program: &str) -> bool {
    Command::new("which").arg(program).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
}

/// Waits until something is so.
fn wait<T>(seconds: u64, what: &str, mut so: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = so() {
            return found;
        }
        assert!(begun.elapsed().as_secs() < seconds, "{what}: not within {seconds} s");
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn without_a_display_one_sentence_says_what_to_do() {
    let mut command = Command::new(PROGRAM);
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    let output = command.output().expect("starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.starts_with("littoral-fly: expected a display") && said.contains("set DISPLAY"), "{said}");
    assert!(said.trim_end().lines().count() == 1 && !said.contains("panicked"), "{said}");
}

/// A display's number, and what ends it.
fn display() -> Option<(String, Ended)> {
    let missing: Vec<_> = ["Xvfb", "xdotool"].into_iter().filter(|program| !there(program)).collect();
    if !missing.is_empty() {
        println!("the window goes untested: {} not installed", missing.join(", "));
        return None;
    }
    // Without `-noreset` it begins anew, and refuses whoever comes meanwhile, each time that the last of its guests leaves.
    let mut server = Command::new("Xvfb")
        .args(["-displayfd", "1", "-noreset", "-screen", "0", "1000x600x24", "-nolisten", "tcp"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("Xvfb starts");
    let mut number = String::new();
    let _ = BufReader::new(server.stdout.take().expect("piped")).read_line(&mut number);
    let server = Ended(server);
    if number.trim().is_empty() {
        println!("the window goes untested: Xvfb opened no display");
        return None;
    }
    let display = format!(":{}", number.trim());
    wait(20, "a display that answers", || {
        let mut asked = Command::new("xdotool");
        let asked =
            asked.arg("getdisplaygeometry").env("DISPLAY", &display).stdout(Stdio::null()).stderr(Stdio::null());
        asked.status().is_ok_and(|status| status.success()).then_some(())
    });
    Some((display, server))
}

/// Width, height and pixels of a picture.
fn picture(file: &Path) -> Option<(usize, usize, Vec<[u8; 3]>)> {
    let mut reader = png::Decoder::new(BufReader::new(std::fs::File::open(file).ok()?)).read_info().ok()?;
    let mut bytes = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut bytes).ok()?;
    let pixels = bytes[..info.buffer_size()].chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Some((info.width as usize, info.height as usize, pixels))
}

/// Whether there is something to see: many colours, and more change from line to line than in a sky.
fn shows_something((width, _, pixels): &(usize, usize, Vec<[u8; 3]>)) -> bool {
    let colours: std::collections::HashSet<_> = pixels.iter().collect();
    colours.len() > 500 && differ(pixels, &pixels[*width..]) > 1.0
}

/// How far apart two pictures are in the mean (of 255), as far as both go.
fn differ(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    let off = |(a, b): (&[u8; 3], &[u8; 3])| (0..3).map(|i| f64::from(a[i].abs_diff(b[i]))).sum::<f64>() / 3.0;
    a.iter().zip(b).map(off).sum::<f64>() / a.len().min(b.len()) as f64
}

/// The program, started in a folder that it also keeps its settings in.
fn started(display: &str, folder: &Path, arguments: &[&str]) -> Ended {
    let mut command = Command::new(PROGRAM);
    command.args(arguments).current_dir(folder).env("DISPLAY", display).env_remove("WAYLAND_DISPLAY");
    command.env("XDG_CONFIG_HOME", folder).env("XDG_RUNTIME_DIR", folder).stderr(Stdio::piped());
    Ended(command.spawn().expect("starts"))
}

/// Writes a picture in one colour.
fn write_picture(file: &Path, colour: [u8; 3]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(file).expect("a file"), 64, 64);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&colour.repeat(64 * 64)).expect("pixels");
}

#[test]
fn a_flight_by_keys_and_clicks() {
    let Some((display, _server)) = display() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let settings = folder.path().join("littoral/fly.toml");
    let arguments = ["missing.tif", "--size", "800x450", "--tolerance", "4", "--triangles", "20000"];
    let mut program = started(&display, folder.path(), &arguments);
    let xdotool = |arguments: &[&str]| {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &display).output().expect("xdotool runs");
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    };
    // A file that is not there is said so in the window, and the flight begins over the coast.
    let mut ended = None;
    let window = wait(180, "a window over the coast", || {
        ended = program.0.try_wait().expect("asked");
        let found = xdotool(&["search", "--name", "Littoral: the built-in coast"]);
        (ended.is_some() || !found.is_empty()).then_some(found)
    });
    if ended.is_some() {
        let mut said = String::new();
        let _ = program.0.stderr.take().map(|mut stderr| stderr.read_to_string(&mut said));
        assert!(said.contains("expected a graphics adapter"), "the program ended: {said}");
        println!("the window goes untested: {said}");
        return;
    }
    let window = window.lines().last().unwrap_or_default().to_owned();
    let pause = || std::thread::sleep(Duration::from_millis(700));
    let key = |name: &str| {
        xdotool(&["key", "--clearmodifiers", name]);
        pause();
    };
    xdotool(&["windowfocus", &window]);
    pause();

    let mut pictures = 0;
    let mut take = || {
        pictures += 1;
        let file = folder.path().join(format!("littoral-{pictures}.png"));
        key("F12");
        wait(60, "a picture", || picture(&file))
    };
    let first = wait(120, "a picture of something", || Some(take()).filter(shows_something));
    assert_eq!((first.0, first.1), (800, 450));
    // Flying on changes it.
    xdotool(&["keydown", "w"]);
    std::thread::sleep(Duration::from_secs(3));
    xdotool(&["keyup", "w"]);
    pause();
    let second = take();
    assert!(shows_something(&second) && differ(&first.2, &second.2) > 1.0, "{}", differ(&first.2, &second.2));
    // Every method, the styles, edges alone: always something to see.
    for _ in 0..6 {
        key("m");
        assert!(shows_something(&take()), "a blank picture after another method");
    }
    key("m");
    key("x");
    let edges = take();
    assert!(differ(&second.2, &edges.2) > 1.0, "edges look otherwise");
    key("x");
    key("x");

    // Colours by height look otherwise; of a picture there is none yet; triangles themselves look otherwise again.
    let natural = take();
    key("t");
    let tint = wait(60, "tints", || Some(take()).filter(|tint| differ(&natural.2, &tint.2) > 5.0));
    assert!(shows_something(&tint));
    for _ in 0..3 {
        key("t");
    }
    let plain = wait(60, "triangles themselves", || Some(take()).filter(|plain| differ(&tint.2, &plain.2) > 5.0));
    assert!(shows_something(&plain));
    key("t");
    wait(60, "natural colours again", || Some(take()).filter(|again| differ(&natural.2, &again.2) < 5.0));

    // A second method beside the first, how they differ, and the first alone again.
    let bright =
        |picture: &[[u8; 3]]| picture.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / picture.len() as f64;
    let one = take();
    key("v");
    let two = wait(60, "two pictures", || Some(take()).filter(|two| differ(&one.2, &two.2) > 0.05));
    assert!(shows_something(&two));
    key("v");
    let apart = take();
    assert!(bright(&apart.2) < 0.5 * bright(&one.2), "a difference is mostly dark");
    key("v");
    assert!(differ(&one.2, &take().2) < differ(&one.2, &two.2), "one again");

    // Three points of a path, one of them taken back, all saved.
    key("Home");
    key("l");
    for (x, y) in ["420", "520", "640"].into_iter().zip(["330", "300", "310"]) {
        xdotool(&["mousemove", "--window", &window, x, y]);
        pause();
        xdotool(&["click", "1"]);
        pause();
    }
    key("ctrl+s");
    let file = folder.path().join("path.toml");
    let points = || wait(60, "a saved path", || SavedPath::load(&file).ok()).path.points.len();
    assert_eq!(points(), 3);
    std::fs::remove_file(&file).expect("removed");
    key("ctrl+z");
    key("ctrl+s");
    assert_eq!(points(), 2);
    key("ctrl+y");
    // Along it, and by boat.
    key("p");
    let along = take();
    pause();
    assert!(differ(&along.2, &take().2) > 0.2, "the flight along the path moves");
    key("p");
    key("Home");
    key("4");
    assert!(shows_something(&take()), "a blank picture from the boat");

    assert!(program.0.try_wait().expect("asked").is_none(), "the program still runs");
    key("ctrl+q");
    let status = wait(60, "an end", || program.0.try_wait().expect("asked"));
    assert!(status.success(), "{status}");
    let remembered = std::fs::read_to_string(&settings).expect("settings are saved");
    for line in ["method = \"patches\"", "mode = \"boat\"", "triangles = 20000", "split = \"off\""] {
        assert!(remembered.contains(line), "{line} in {remembered}");
    }
}

#[test]
fn a_picture_is_laid_over_the_land_and_remembered() {
    let Some((display, _server)) = display() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("ground.png");
    write_picture(&file, [220, 30, 160]);
    let arguments = ["--size", "640x360", "--tolerance", "8", "--triangles", "20000"];
    let laid = [&arguments[..], &["--texture", "ground.png"]].concat();
    // Named by the command first, from the settings then; at last the picture is gone.
    for (round, arguments) in [&laid[..], &arguments, &arguments].into_iter().enumerate() {
        let mut program = started(&display, folder.path(), arguments);
        let xdotool = |arguments: &[&str]| {
            let output =
                Command::new("xdotool").args(arguments).env("DISPLAY", &display).output().expect("xdotool runs");
            String::from_utf8_lossy(&output.stdout).trim().to_owned()
        };
        let mut ended = None;
        let window = wait(180, "a window over the coast", || {
            ended = program.0.try_wait().expect("asked");
            let found = xdotool(&["search", "--name", "Littoral: the built-in coast"]);
            (ended.is_some() || !found.is_empty()).then_some(found)
        });
        if ended.is_some() {
            let mut said = String::new();
            let _ = program.0.stderr.take().map(|mut stderr| stderr.read_to_string(&mut said));
            assert!(said.contains("expected a graphics adapter"), "the program ended: {said}");
            println!("the window goes untested: {said}");
            return;
        }
        xdotool(&["windowfocus", window.lines().last().unwrap_or_default()]);
        let mut pictures = 0;
        let mut take = || {
            let name = |number| folder.path().join(format!("littoral-{number}.png"));
            pictures = (1..).find(|number| !name(*number).exists()).expect("free");
            xdotool(&["key", "--clearmodifiers", "F12"]);
            wait(60, "a picture", || picture(&name(pictures)))
        };
        // The ground is as pink as the picture, or nowhere.
        let pink = |picture: &(usize, usize, Vec<[u8; 3]>)| {
            let is = |p: &&[u8; 3]| i32::from(p[0]) > i32::from(p[1]) + 60 && i32::from(p[2]) > i32::from(p[1]) + 30;
            picture.2.iter().filter(is).count() as f64 / picture.2.len() as f64
        };
        if round < 2 {
            wait(120, "the picture on the ground", || Some(take()).filter(|shown| pink(shown) > 0.15));
        } else {
            let natural = wait(120, "a picture of something", || Some(take()).filter(shows_something));
            assert!(pink(&natural) < 0.01, "{} of it pink", pink(&natural));
        }
        xdotool(&["key", "--clearmodifiers", "ctrl+q"]);
        let status = wait(60, "an end", || program.0.try_wait().expect("asked"));
        assert!(status.success(), "{status}");
        let remembered = std::fs::read_to_string(folder.path().join("littoral/fly.toml")).expect("settings are saved");
        let style = if round < 2 { "style = \"image\"" } else { "style = \"natural\"" };
        assert!(remembered.contains(style), "{remembered}");
        assert_eq!(remembered.contains("ground.png"), round < 2, "{remembered}");
        if round == 1 {
            std::fs::remove_file(&file).expect("removed");
        }
    }
}
