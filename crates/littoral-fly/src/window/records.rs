//! What a flight leaves behind: pictures and films.

use super::Flight;
use crate::film::Filming;
use crate::paint::Gui;
use littoral_data::write::{PngPixels, png};
use std::path::PathBuf;

impl Flight {
    /// Saves what is seen under the first name that is free.
    pub fn picture(&mut self, gui: Option<&Gui>) {
        let free = (1..100_000).map(|i| PathBuf::from(format!("littoral-{i}.png"))).find(|file| !file.exists());
        let Some(file) = free else { return };
        let size = self.paint.size();
        let name = self.cockpit.subject.as_ref().map_or(String::new(), |subject| subject.name.clone());
        let notes = [("Software", "littoral-fly".to_owned()), ("Source", name)];
        let saved = self
            .paint
            .copy(&self.cockpit, gui)
            .and_then(|pixels| png(&file, size.x, size.y, PngPixels::Rgb8(&pixels), &notes).map_err(|e| e.to_string()));
        self.cockpit.note(match saved {
            Ok(()) => format!("picture saved in {}", file.display()),
            Err(problem) => problem,
        });
    }

    /// Begins a film along the path, or ends it.
    pub fn toggle_film(&mut self) {
        if let Some(filming) = self.filming.take() {
            let said = filming.end(&mut self.cockpit.time);
            self.cockpit.note(said);
            self.shown.film = None;
            return;
        }
        match Filming::new(&self.cockpit, self.paint.size()) {
            Ok(filming) => self.filming = Some(filming),
            Err(problem) => self.cockpit.note(problem),
        }
    }

    /// Films the frame that has come, if one has.
    pub fn film(&mut self) {
        let Some(filming) = &mut self.filming else { return };
        let size = self.paint.size();
        let done = match filming.awaits(&self.cockpit, size) {
            Err(problem) => Err(problem),
            Ok(false) => Ok(false),
            Ok(true) => self.paint.copy(&self.cockpit, None).and_then(|pixels| filming.frame(&pixels)),
        };
        self.shown.film = Some(filming.done());
        match done {
            Ok(false) => {}
            Ok(true) => self.toggle_film(),
            Err(problem) => {
                self.toggle_film();
                self.cockpit.note(problem);
            }
        }
    }
}
