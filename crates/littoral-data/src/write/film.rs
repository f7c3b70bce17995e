//! Films: frames piped to ffmpeg, or a folder of numbered pictures.
//!
//! An encoder is not ours to write: raw frames go to `ffmpeg` through a pipe (H.264, 4:2:0, BT.709, playable while it
//! downloads). Where it is not installed, and for films that take hours, [`FrameFolder`] keeps every finished frame; a
//! later run of the same film goes on where the last one stopped.

use super::{PngPixels, Unfinished, png};
use crate::Error;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

/// What a film is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmSettings {
    /// Width of a frame (pixels); even.
    pub width: u32,
    /// Height of a frame (pixels); even.
    pub height: u32,
    /// Frames a second.
    pub rate: f64,
}

/// Whether `ffmpeg` can be run.
pub fn ffmpeg_installed() -> bool {
    let quiet = |stream: &mut Command| {
        stream.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
    };
    quiet(Command::new("ffmpeg").arg("-version"))
}

/// A film being written by ffmpeg. It has its name only after [`Film::finish`]; dropped before, nothing is left.
pub struct Film {
    encoder: Child,
    complaints: Option<JoinHandle<String>>,
    unfinished: Option<Unfinished>,
    file: PathBuf,
    bytes: usize,
}

impl Film {
    /// Starts a film. The container follows the ending of `file`: `.mp4`, `.mov` or `.mkv`.
    ///
    /// # Errors
    /// If ffmpeg cannot be started, a side is odd, or the file cannot be created.
    pub fn create(file: &Path, settings: FilmSettings) -> Result<Film, Error> {
        let FilmSettings { width, height, rate } = settings;
        if width % 2 != 0 || height % 2 != 0 {
            let problem = format!(
                "expected an even width and height, as films store colour in blocks of 2 × 2 pixels, got {width}x{height}; \
                 use --size {}x{}",
                width.next_multiple_of(2),
                height.next_multiple_of(2)
            );
            return Err(Error::content(file, problem));
        }
        let ending = file.extension().and_then(|e| e.to_str()).unwrap_or("mp4");
        let unfinished = Unfinished::beside(file, &format!(".{ending}"))?;
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]);
        command.args(["-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-r", &rate.to_string(), "-i", "pipe:0", "-an"]);
        command.args(["-vf", "scale=out_color_matrix=bt709:out_range=tv", "-c:v", "libx264", "-preset", "medium"]);
        command.args(["-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]);
        command.args([
            "-color_range",
            "tv",
            "-colorspace",
            "bt709",
            "-color_primaries",
            "bt709",
            "-color_trc",
            "bt709",
        ]);
        command.arg(unfinished.path());
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut encoder = command.spawn().map_err(|e| {
            Error::content(
                file,
                format!("expected to start ffmpeg, got \"{e}\"; install ffmpeg, or write frames into a folder"),
            )
        })?;
        // Read along, or a talkative encoder would wait for us while we wait for it.
        let complaints = encoder.stderr.take().map(|mut stream| {
            std::thread::spawn(move || {
                let mut text = Vec::new();
                let _ = stream.read_to_end(&mut text); // what was read so far is what we can tell
                String::from_utf8_lossy(&text).trim().to_owned()
            })
        });
        let bytes = width as usize * height as usize * 3;
        Ok(Film { encoder, complaints, unfinished: Some(unfinished), file: file.to_owned(), bytes })
    }

    /// Adds a frame, row by row from the top.
    ///
    /// # Errors
    /// If ffmpeg has given up; says why.
    ///
    /// # Panics
    /// If the frame has not the film's size.
    pub fn frame(&mut self, pixels: &[[u8; 3]]) -> Result<(), Error> {
        assert_eq!(pixels.len() * 3, self.bytes, "expected a frame of the film's size");
        let written = match &mut self.encoder.stdin {
            Some(pipe) => pipe.write_all(pixels.as_flattened()),
            None => Ok(()),
        };
        written.map_err(|e| self.failed(&e.to_string()))
    }

    /// Ends the film and gives it its name.
    ///
    /// # Errors
    /// If ffmpeg fails, or the file cannot be renamed.
    pub fn finish(mut self) -> Result<(), Error> {
        drop(self.encoder.stdin.take());
        match self.encoder.wait() {
            Ok(status) if status.success() => match self.unfinished.take() {
                Some(unfinished) => unfinished.finish(),
                None => Ok(()),
            },
            Ok(status) => Err(self.failed(&status.to_string())),
            Err(e) => Err(Error::io(&self.file, e)),
        }
    }

    fn failed(&mut self, what: &str) -> Error {
        drop(self.encoder.stdin.take());
        let _ = self.encoder.wait();
        let said = self.complaints.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let said = said.lines().last().unwrap_or(what).to_owned();
        let advice = "install an ffmpeg with libx264, or write frames into a folder";
        Error::content(&self.file, format!("expected ffmpeg to encode the film, got \"{said}\"; {advice}"))
    }
}

impl Drop for Film {
    fn drop(&mut self) {
        drop(self.encoder.stdin.take());
        if self.unfinished.is_some() {
            let _ = self.encoder.kill(); // it may have ended by itself
        }
        let _ = self.encoder.wait();
    }
}

/// A folder of numbered frames, `frame_00001.png` onward, that can be continued.
///
/// A text file beside the frames says which film they belong to; frames of another film are never mixed in.
pub struct FrameFolder {
    folder: PathBuf,
    settings: FilmSettings,
}

impl FrameFolder {
    /// The file that says which film the frames belong to.
    pub const LABEL: &'static str = "film.txt";

    /// Opens or creates a folder for the film that `label` describes: whatever changes the picture belongs into it.
    ///
    /// # Errors
    /// If the folder cannot be created, or holds frames of another film.
    pub fn open(folder: &Path, settings: FilmSettings, label: &str) -> Result<FrameFolder, Error> {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
        let file = folder.join(FrameFolder::LABEL);
        let frames = FrameFolder { folder: folder.to_owned(), settings };
        match std::fs::read_to_string(&file) {
            Ok(there) if there == label => {}
            Ok(there) => {
                let differs = there.lines().zip(label.lines()).find(|(a, b)| a != b);
                let (got, expected) = differs.unwrap_or((there.trim(), label.trim()));
                let problem = format!(
                    "expected frames of this film ({expected}), got those of another ({got}); choose another folder or \
                     remove this one"
                );
                return Err(Error::content(folder, problem));
            }
            Err(_) if frames.has(1) => {
                let problem = "expected an empty folder or one with frames of this film, got frames of unknown origin; \
                               choose another folder";
                return Err(Error::content(folder, problem));
            }
            Err(_) => super::whole(&file, |sink| sink.write_all(label.as_bytes()))?,
        }
        Ok(frames)
    }

    /// The name of a frame, counted from 1.
    pub fn name(&self, frame: usize) -> PathBuf {
        self.folder.join(format!("frame_{frame:05}.png"))
    }

    /// Whether a frame is there already.
    pub fn has(&self, frame: usize) -> bool {
        self.name(frame).is_file()
    }

    /// Writes a frame.
    ///
    /// # Errors
    /// If the system refuses.
    ///
    /// # Panics
    /// If the frame has not the film's size.
    pub fn write(&self, frame: usize, pixels: &[[u8; 3]]) -> Result<(), Error> {
        png(&self.name(frame), self.settings.width, self.settings.height, PngPixels::Rgb8(pixels), &[])
    }

    /// The command that joins the frames into a film.
    pub fn how_to_join(&self) -> String {
        let pattern = self.folder.join("frame_%05d.png");
        let film = self.folder.with_extension("mp4");
        format!(
            "ffmpeg -framerate {} -i {} -c:v libx264 -crf 18 -pix_fmt yuv420p -movflags +faststart {}",
            self.settings.rate,
            quoted(&pattern),
            quoted(&film)
        )
    }
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = text.chars().all(|c| c.is_alphanumeric() || "/._-%+=:,@".contains(c));
    if plain { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: FilmSettings = FilmSettings { width: 64, height: 36, rate: 25.0 };

    fn grey(value: u8) -> Vec<[u8; 3]> {
        vec![[value; 3]; 64 * 36]
    }

    #[test]
    fn a_folder_goes_on_with_its_own_film_only() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path().join("my film");
        let frames = FrameFolder::open(&place, SETTINGS, "size 64x36\nseed 1\n").expect("opened");
        frames.write(1, &grey(10)).expect("written");
        let again = FrameFolder::open(&place, SETTINGS, "size 64x36\nseed 1\n").expect("opened again");
        assert!(again.has(1) && !again.has(2));
        let other = FrameFolder::open(&place, SETTINGS, "size 64x36\nseed 2\n").map(drop).expect_err("another film");
        assert!(other.to_string().contains("(seed 2), got those of another (seed 1)"), "{other}");
        assert!(again.how_to_join().contains("frame_%05d.png'") && again.how_to_join().contains("'"));
        std::fs::remove_file(place.join(FrameFolder::LABEL)).expect("removed");
        let unknown = FrameFolder::open(&place, SETTINGS, "seed 1").map(drop).expect_err("frames without a label");
        assert!(unknown.to_string().contains("unknown origin"), "{unknown}");
    }

    #[test]
    fn odd_sizes_are_refused_with_a_size_that_works() {
        let odd = FilmSettings { width: 321, height: 181, rate: 25.0 };
        let error = Film::create(Path::new("x.mp4"), odd).map(drop).expect_err("odd").to_string();
        assert!(error.contains("--size 322x182"), "{error}");
    }

    #[test]
    fn a_film_is_written_whole_or_not_at_all() {
        if !ffmpeg_installed() {
            println!("ffmpeg is not installed: films are not tested");
            return;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("film.mp4");
        let mut film = Film::create(&file, SETTINGS).expect("started");
        for i in 0..10 {
            film.frame(&grey(i * 20)).expect("taken");
        }
        drop(film);
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0, "nothing is left of it");
        let mut film = Film::create(&file, SETTINGS).expect("started");
        for i in 0..10 {
            film.frame(&grey(i * 20)).expect("taken");
        }
        film.finish().expect("encoded");
        assert!(std::fs::metadata(&file).expect("there").len() > 500);
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }
}
