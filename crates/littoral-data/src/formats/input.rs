//! A file's bytes, wherever they lie: on disk, inside an archive, or in memory for tests and fuzzers.

use super::tiles::Encoding;
use crate::Error;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// No companion file (header, projection, world file) is longer; what is longer is something else of the same name.
const LONGEST_SIDECAR: u64 = 1 << 20;

/// Companions that stand behind the whole name only, `land.tif.msk`: `land.msk` belongs to some other file.
pub(super) const APPENDED: [&str; 3] = ["aux.xml", "msk", "msk.ovr"];

/// An opened file and what lies beside it. Every reader takes one.
pub struct Input {
    /// The file's name: shown in messages, and a hint for formats that keep their place or size in it.
    pub name: PathBuf,
    /// What the pixels of a PNG mean; `None` to tell it from the heights that they give.
    pub encoding: Option<Encoding>,
    length: u64,
    bytes: Bytes,
    beside: Vec<(String, Vec<u8>)>,
}

enum Bytes {
    Disk(File),
    Memory(Cursor<Vec<u8>>),
}

impl Input {
    /// Opens a file on disk. Only its length is looked at.
    ///
    /// # Errors
    /// If there is no such file, it is a directory or a device, or may not be read.
    pub fn file(path: &Path) -> Result<Input, Error> {
        // Asked before opening: opening a pipe would wait for its other end.
        let metadata = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
        if metadata.is_dir() {
            return Err(Error::content(path, "expected a height file, got a folder; name one of the files in it"));
        }
        if !metadata.is_file() {
            return Err(Error::content(path, "expected a height file, got a pipe or device; save it to a file first"));
        }
        let file = File::open(path).map_err(|e| Error::io(path, e))?;
        let bytes = Bytes::Disk(file);
        Ok(Input { name: path.to_owned(), encoding: None, length: metadata.len(), bytes, beside: Vec::new() })
    }

    /// Bytes in memory under a name. Companion files are only those added by [`Input::with_sidecar`].
    pub fn memory(name: impl Into<PathBuf>, bytes: Vec<u8>) -> Input {
        let length = bytes.len() as u64;
        Input {
            name: name.into(),
            encoding: None,
            length,
            bytes: Bytes::Memory(Cursor::new(bytes)),
            beside: Vec::new(),
        }
    }

    /// Adds a companion file by its extension in lower case and without the dot, such as `hdr` or `prj`.
    pub fn with_sidecar(mut self, extension: &str, content: Vec<u8>) -> Input {
        self.beside.push((extension.to_owned(), content));
        self
    }

    /// The bytes alone, to be read at any place by many threads.
    pub(crate) fn into_bytes(self) -> crate::bytes::Bytes {
        match self.bytes {
            Bytes::Disk(file) => crate::bytes::Bytes::File(file, self.length),
            Bytes::Memory(bytes) => crate::bytes::Bytes::Memory(bytes.into_inner()),
        }
    }

    /// Length in bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Whether the bytes are read from a file, so that others may lie beside it.
    pub(crate) fn is_on_disk(&self) -> bool {
        matches!(self.bytes, Bytes::Disk(_))
    }

    /// A content error that names this file.
    pub fn error(&self, problem: impl Into<String>) -> Error {
        Error::content(&self.name, problem)
    }

    /// The file's name without folders, in lower case.
    pub fn lower_name(&self) -> String {
        self.name.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
    }

    /// The first bytes, at most `most`, fewer if the file is shorter.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn head(&mut self, most: usize) -> Result<Vec<u8>, Error> {
        let mut head = vec![0; most.min(usize::try_from(self.length).unwrap_or(usize::MAX))];
        self.read_at(0, &mut head)?;
        Ok(head)
    }

    /// Fills `buffer` from `offset` on.
    ///
    /// # Errors
    /// If the file cannot be read or ends before.
    pub fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<(), Error> {
        if offset.checked_add(buffer.len() as u64).is_none_or(|end| end > self.length) {
            let problem = format!("expected {} bytes at offset {offset}, got the end of the file", buffer.len());
            return Err(self.error(format!("{problem} after {} bytes; it is cut off", self.length)));
        }
        self.seek(SeekFrom::Start(offset)).and_then(|_| self.read_exact(buffer)).map_err(|e| Error::io(&self.name, e))
    }

    /// The whole file.
    ///
    /// # Errors
    /// If the file cannot be read, or is longer than `most` bytes: the message then asks for a tiled GeoTIFF.
    pub fn read_all(&mut self, most: u64) -> Result<Vec<u8>, Error> {
        if self.length > most {
            return Err(self.error(format!(
                "expected at most {most} bytes of a format that is read at one go, got {}; convert it with \
                 `gdal_translate -of COG {} land.tif`",
                self.length,
                self.name.display()
            )));
        }
        self.head(most as usize)
    }

    /// Reads from the start, with a small buffer.
    ///
    /// # Errors
    /// If the file cannot be rewound.
    pub fn from_start(&mut self) -> Result<BufReader<&mut Input>, Error> {
        self.seek(SeekFrom::Start(0)).map_err(|e| Error::io(&self.name, e))?;
        Ok(BufReader::with_capacity(1 << 16, self))
    }

    /// The bytes as the NetCDF reader wants them: ranges of a file, or memory.
    pub(crate) fn into_storage(self) -> Result<netcdf_reader::DynStorage, Error> {
        Ok(match self.bytes {
            Bytes::Memory(cursor) => Arc::new(netcdf_reader::BytesStorage::new(cursor.into_inner())),
            Bytes::Disk(file) => {
                let storage = netcdf_reader::FileStorage::from_file(file);
                Arc::new(storage.map_err(|e| Error::content(&self.name, format!("expected a readable file, got {e}")))?)
            }
        })
    }

    /// The companion of this extension, in lower or upper case: `land.hdr` or `land.bil.hdr` beside `land.bil`.
    /// `None` if there is none or it cannot be read.
    pub fn sidecar(&self, extension: &str) -> Option<Vec<u8>> {
        if let Some((_, content)) = self.beside.iter().find(|(name, _)| name == extension) {
            return Some(content.clone());
        }
        let path = self.sidecar_path(extension)?;
        let mut content = Vec::new();
        File::open(path).ok()?.take(LONGEST_SIDECAR + 1).read_to_end(&mut content).ok()?;
        (content.len() as u64 <= LONGEST_SIDECAR).then_some(content)
    }

    /// Where the companion of this extension lies on disk, if there is one.
    pub fn sidecar_path(&self, extension: &str) -> Option<PathBuf> {
        let Bytes::Disk(_) = self.bytes else { return None };
        let appended_only = APPENDED.contains(&extension);
        let mut paths = [extension.to_owned(), extension.to_uppercase()].into_iter().flat_map(|extension| {
            let mut appended = OsString::from(&self.name);
            appended.push(".");
            appended.push(&extension);
            let instead = (!appended_only).then(|| self.name.with_extension(&extension));
            instead.into_iter().chain([PathBuf::from(appended)])
        });
        paths.find(|path| *path != self.name && path.is_file())
    }

    /// All bytes of a companion, to be read at any place; `None` if there is none.
    ///
    /// # Errors
    /// If it is there and cannot be opened.
    pub(crate) fn sidecar_bytes(&self, extension: &str) -> std::io::Result<Option<crate::bytes::Bytes>> {
        if let Some((_, content)) = self.beside.iter().find(|(name, _)| name == extension) {
            return Ok(Some(crate::bytes::Bytes::Memory(content.clone())));
        }
        self.sidecar_path(extension).map(|path| crate::bytes::Bytes::open(&path)).transpose()
    }

    /// The companion of this extension as text.
    pub fn sidecar_text(&self, extension: &str) -> Option<String> {
        self.sidecar(extension).map(|content| String::from_utf8_lossy(&content).into_owned())
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match &mut self.bytes {
            Bytes::Disk(file) => file.read(buffer),
            Bytes::Memory(cursor) => cursor.read(buffer),
        }
    }
}

impl Seek for Input {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        match &mut self.bytes {
            Bytes::Disk(file) => file.seek(to),
            Bytes::Memory(cursor) => cursor.seek(to),
        }
    }
}
