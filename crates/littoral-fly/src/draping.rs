//! The picture that is laid over a land, opened on a thread of its own.

use crate::subject::Subject;
use littoral::picture::Drape;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;

/// A picture that is opened, or was.
#[derive(Default)]
pub struct Draping {
    of: Option<PathBuf>,
    thread: Option<JoinHandle<Result<Opened, String>>>,
    drape: Option<Arc<Drape>>,
}

/// A picture as it lies, and what was noticed.
type Opened = (Drape, Vec<String>);

impl Draping {
    /// Opens another picture if another one is wanted. `true` if it begins.
    pub fn follow(&mut self, picture: Option<&Path>, subject: &Arc<Subject>) -> bool {
        let Some(picture) = picture.filter(|picture| self.of.as_deref() != Some(picture)) else { return false };
        let (file, subject) = (picture.to_owned(), subject.clone());
        let thread = std::thread::Builder::new().name("picture".into()).spawn(move || subject.drape(&file));
        *self = Draping { of: Some(picture.to_owned()), thread: thread.ok(), drape: None };
        true
    }

    /// Whether an opening has ended: what was noticed, or what went wrong.
    pub fn ended(&mut self) -> Option<Result<Vec<String>, String>> {
        let thread = self.thread.take_if(|thread| thread.is_finished())?;
        let opened = thread.join().unwrap_or_else(|_| {
            let file = self.of.as_deref().unwrap_or(Path::new("the picture")).display();
            Err(format!("{file}: could not be opened (an internal error; please report it)"))
        });
        Some(opened.map(|(drape, noticed)| {
            self.drape = Some(Arc::new(drape));
            noticed
        }))
    }

    /// The picture, if it is that one and open.
    pub fn drape(&self, picture: Option<&Path>) -> Option<&Arc<Drape>> {
        self.drape.as_ref().filter(|_| picture.is_some() && self.of.as_deref() == picture)
    }
}
