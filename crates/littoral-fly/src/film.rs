//! A film along the path: a frame for each moment, each of them waited for, so that it is as smooth as the path however slow the machine is.

use crate::cockpit::Cockpit;
use crate::scene::Frame;
use crate::tape::Tape;
use glam::UVec2;
use littoral_data::write::{Film, FilmSettings, FrameFolder, ffmpeg_installed};
use std::path::{Path, PathBuf};

/// Frames a second.
const RATE: f64 = 30.0;

/// A film that is being made.
pub struct Filming {
    tape: Tape,
    frame: usize,
    frames: usize,
    size: UVec2,
    begin: f64,
    sink: Option<Sink>,
    out: PathBuf,
}

enum Sink {
    Film(Film),
    Folder(FrameFolder),
}

impl Filming {
    /// A film along the cockpit's path, into the first name that is free.
    pub fn new(cockpit: &Cockpit, size: UVec2) -> Result<Filming, String> {
        let subject = cockpit.subject.as_ref().ok_or("nothing is open yet: wait for the land")?;
        let tape =
            Tape::of(cockpit.editor.path(), subject, RATE).map_err(|problem| format!("no film yet: {problem}"))?;
        let frames = (tape.duration() * RATE).round().max(1.0) as usize;
        let settings = FilmSettings { width: size.x, height: size.y, rate: RATE };
        let ending = if ffmpeg_installed() { ".mp4" } else { "" };
        let out = (1..100_000)
            .map(|i| PathBuf::from(format!("littoral-film-{i}{ending}")))
            .find(|file| !file.exists())
            .ok_or("expected a free name for the film, found none; tidy up the folder")?;
        let sink = match ending {
            "" => FrameFolder::open(&out, settings, "Frames of a film by littoral-fly\n").map(Sink::Folder),
            _ => Film::create(&out, settings).map(Sink::Film),
        };
        let sink = Some(sink.map_err(|e| e.to_string())?);
        Ok(Filming { tape, frame: 0, frames, size, begin: cockpit.time, sink, out })
    }

    /// Puts the eye and the sea where the next frame sees them.
    pub fn pose(&self, cockpit: &mut Cockpit) {
        let time = self.frame as f64 / RATE;
        let pose = self.tape.pose(time);
        cockpit.playing = None;
        cockpit.camera.eye = pose.position;
        cockpit.camera.look_along(pose.direction);
        cockpit.time = self.begin + time;
    }

    /// Whether the triangles of the next frame have come.
    pub fn awaits(&self, cockpit: &Cockpit, size: UVec2) -> Result<bool, String> {
        if size != self.size {
            return Err("the window changed its size: the film ends here".into());
        }
        let wanted = (cockpit.lod_view(size), cockpit.sea_time(), cockpit.second().is_some());
        let come = |f: &Frame| (f.view, f.time, f.second.is_some()) == wanted && !f.is_unfinished();
        Ok(cockpit.scenery.is_some() && cockpit.frame.as_ref().is_some_and(come))
    }

    /// Takes a frame. `true` after the last.
    pub fn frame(&mut self, pixels: &[[u8; 3]]) -> Result<bool, String> {
        self.frame += 1;
        match &mut self.sink {
            Some(Sink::Film(film)) => film.frame(pixels).map_err(|e| e.to_string())?,
            Some(Sink::Folder(folder)) => folder.write(self.frame, pixels).map_err(|e| e.to_string())?,
            None => {}
        }
        Ok(self.frame == self.frames)
    }

    /// Frames made, and to be made.
    pub fn done(&self) -> (usize, usize) {
        (self.frame, self.frames)
    }

    /// Ends the film, and says where it is.
    pub fn end(mut self, time: &mut f64) -> String {
        *time = self.begin;
        let named = |out: &Path| format!("film of {} frames in {}", self.frame, out.display());
        match self.sink.take() {
            Some(Sink::Film(film)) if self.frame > 0 => {
                film.finish().map_or_else(|e| e.to_string(), |()| named(&self.out))
            }
            Some(Sink::Folder(folder)) => format!("{}; join them with: {}", named(&self.out), folder.how_to_join()),
            _ => "no film: it ended before its first frame".to_owned(),
        }
    }
}
