//! Reading a file at any place without moving a cursor, so that many threads may read at once.

use std::fs::File;
use std::io;
use std::path::Path;

/// The content of a file: on disk, or in memory already.
#[derive(Debug)]
pub(crate) enum Bytes {
    /// On disk, with the length it had when it was opened.
    File(File, u64),
    /// In memory.
    Memory(Vec<u8>),
}

impl Bytes {
    /// Opens a file and notes its length; folders and devices are refused.
    pub(crate) fn open(path: &Path) -> io::Result<Bytes> {
        let file = File::open(path)?;
        let data = file.metadata()?;
        if !data.is_file() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "expected a file, got a folder or a device"));
        }
        Ok(Bytes::File(file, data.len()))
    }

    /// Length (bytes).
    pub(crate) fn length(&self) -> u64 {
        match self {
            Bytes::File(_, length) => *length,
            Bytes::Memory(bytes) => bytes.len() as u64,
        }
    }

    /// Fills `buffer` from `offset` on, as far as the file goes; the number of bytes read.
    pub(crate) fn read(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Bytes::Memory(bytes) => {
                let start = usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len());
                let count = buffer.len().min(bytes.len() - start);
                buffer[..count].copy_from_slice(&bytes[start..start + count]);
                Ok(count)
            }
            Bytes::File(file, _) => {
                let mut done = 0;
                while done < buffer.len() {
                    match read_at(file, &mut buffer[done..], offset + done as u64) {
                        Ok(0) => break,
                        Ok(count) => done += count,
                        Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                        Err(error) => return Err(error),
                    }
                }
                Ok(done)
            }
        }
    }

    /// `count` bytes from `offset` on, or `None` if the file has no such bytes. Allocates only what the file holds.
    pub(crate) fn exact(&self, offset: u64, count: u64) -> Option<Vec<u8>> {
        if offset.checked_add(count)? > self.length() {
            return None;
        }
        let mut buffer = vec![0; usize::try_from(count).ok()?];
        (self.read(offset, &mut buffer).ok()? == buffer.len()).then_some(buffer)
    }
}

#[cfg(unix)]
fn read_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, buffer, offset)
}

#[cfg(windows)]
fn read_at(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, buffer, offset)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn disk_and_memory_agree_and_end_where_the_file_ends() {
        let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
        file.write_all(&[1, 2, 3, 4, 5]).expect("written");
        for bytes in [Bytes::open(file.path()).expect("opens"), Bytes::Memory(vec![1, 2, 3, 4, 5])] {
            assert_eq!(bytes.length(), 5);
            assert_eq!(bytes.exact(1, 3), Some(vec![2, 3, 4]));
            assert_eq!(bytes.exact(3, 3), None);
            assert_eq!(bytes.exact(u64::MAX, 3), None);
            let mut buffer = [9; 4];
            assert_eq!((bytes.read(3, &mut buffer).expect("reads"), buffer), (2, [4, 5, 9, 9]));
            assert_eq!(bytes.read(100, &mut buffer).expect("reads"), 0);
        }
        assert!(Bytes::open(&std::env::temp_dir()).is_err());
    }
}
