//! Files out: pictures, grids, meshes and films, each written whole or not at all.
//!
//! Everything is written to a temporary file beside its destination, which takes the destination's name only when it is
//! complete; whatever goes wrong before, an older file of that name stays as it was. A program that is interrupted calls
//! [`abandon`] to take the unfinished files away.

mod exr;
mod film;
mod geotiff;
mod mesh;
mod object;
mod png;

pub use self::exr::{Layer, exr};
pub use self::png::{PngPixels, png};
pub use film::{Film, FilmSettings, FrameFolder, ffmpeg_installed};
pub use geotiff::{GeoTags, GridSamples, geotiff};
pub use mesh::{MeshFormat, mesh};
pub use object::object;

use crate::Error;
use std::io::{BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Temporary files in being, so that [`abandon`] finds them.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes all files that are being written at the moment. Call it when the program is interrupted, just before it
/// ends.
pub fn abandon() {
    // A poisoned list is still the list.
    for file in UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        let _ = std::fs::remove_file(file); // it may have been finished or removed meanwhile
    }
}

/// A temporary file beside its destination, known to [`abandon`] as long as it exists.
pub(crate) struct Unfinished {
    temporary: Option<tempfile::NamedTempFile>,
    destination: PathBuf,
}

impl Unfinished {
    /// `suffix` ends the temporary name, for programs that judge a file by it.
    pub(crate) fn beside(destination: &Path, suffix: &str) -> Result<Unfinished, Error> {
        let folder = match destination.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            let problem = format!(
                "expected the folder {} to exist, got nothing of that name; create it or choose another name",
                folder.display()
            );
            return Err(Error::content(destination, problem));
        }
        if destination.is_dir() {
            return Err(Error::content(destination, "expected the name of a file, got a folder; add a file name"));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".littoral-").suffix(suffix);
        #[cfg(unix)]
        {
            // As any other program's new file: readable by whom the user's umask allows, not by the user alone.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let temporary = builder.tempfile_in(folder).map_err(|e| Error::io(destination, e))?;
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).push(temporary.path().to_owned());
        Ok(Unfinished { temporary: Some(temporary), destination: destination.to_owned() })
    }

    pub(crate) fn path(&self) -> &Path {
        self.temporary.as_ref().map_or(Path::new(""), tempfile::NamedTempFile::path)
    }

    /// Gives the file its name.
    pub(crate) fn finish(mut self) -> Result<(), Error> {
        let Some(temporary) = self.temporary.take() else { return Ok(()) };
        let path = temporary.path().to_owned();
        let kept = temporary.persist(&self.destination).map_err(|e| Error::io(&self.destination, e.error));
        forget(&path);
        kept.map(drop)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if let Some(temporary) = self.temporary.take() {
            let path = temporary.path().to_owned();
            drop(temporary); // removes it
            forget(&path);
        }
    }
}

fn forget(path: &Path) {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).retain(|p| p != path);
}

/// What a writer writes to.
pub trait Sink: Write + Seek {}
impl<T: Write + Seek> Sink for T {}

/// Writes a file whole or not at all: `content` is written to a temporary file that replaces `file` only when all went
/// well.
///
/// # Errors
/// If the folder does not exist, the system refuses, or `content` fails.
pub fn whole(file: &Path, content: impl FnOnce(&mut dyn Sink) -> std::io::Result<()>) -> Result<(), Error> {
    let unfinished = Unfinished::beside(file, ".part")?;
    if let Some(temporary) = &unfinished.temporary {
        let mut sink = BufWriter::with_capacity(1 << 18, temporary.as_file());
        content(&mut sink).and_then(|()| sink.flush()).map_err(|e| Error::io(file, e))?;
    }
    unfinished.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.txt");
        whole(&file, |sink| sink.write_all(b"old")).expect("written");
        let failed = whole(&file, |sink| {
            sink.write_all(b"new and half")?;
            Err(std::io::Error::other("disk full"))
        });
        assert!(failed.expect_err("fails").to_string().ends_with("a.txt: disk full"));
        assert_eq!(std::fs::read(&file).expect("still there"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
        whole(&file, |sink| sink.write_all(b"new")).expect("written");
        assert_eq!(std::fs::read(&file).expect("there"), b"new");
    }

    #[test]
    fn missing_folders_and_folders_as_files_are_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let missing = whole(&folder.path().join("no/where.png"), |_| Ok(())).expect_err("no folder").to_string();
        assert!(missing.contains("expected the folder") && missing.contains("create it"), "{missing}");
        let itself = whole(folder.path(), |_| Ok(())).expect_err("a folder").to_string();
        assert!(itself.contains("got a folder"), "{itself}");
    }

    #[cfg(unix)]
    #[test]
    fn files_are_as_readable_as_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        whole(&ours, |_| Ok(())).expect("written");
        std::fs::write(&plain, b"").expect("written");
        let mode = |p: &Path| std::fs::metadata(p).expect("there").permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
