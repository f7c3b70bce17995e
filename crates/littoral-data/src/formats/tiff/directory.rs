//! The skeleton of a TIFF: header, directories, tags. Every count and offset is held against the file's length before
//! anything is allocated.
//!
//! Based on: Adobe. TIFF revision 6.0. 1992; BigTIFF as in libtiff 4 (Aware Systems' description).

use crate::bytes::Bytes;
use std::collections::HashSet;

/// No sane file has more; a longer chain is a forgery.
const MOST_DIRECTORIES: usize = 1024;
/// TIFF's own limit for the classic form; BigTIFF's counts are held to it as well.
const MOST_ENTRIES: u64 = 65_535;

/// A TIFF whose header has been understood.
pub(crate) struct Container {
    pub bytes: Bytes,
    /// Whether numbers have their lowest byte first.
    pub little: bool,
    /// Whether offsets have 64 bits.
    pub big: bool,
    /// Offset of the first directory.
    first: u64,
}

/// One image's tags.
pub(crate) struct Directory {
    entries: Vec<Entry>,
}

/// A tag: `count` values of a type, or where they are.
#[derive(Clone, Copy)]
struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    /// The values if they fit, their offset if not, in the file's byte order.
    field: [u8; 8],
}

/// Bytes of one value of a TIFF type; `None` for types that do not exist.
fn size_of_kind(kind: u16) -> Option<u64> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16 | 17 | 18 => Some(8),
        _ => None,
    }
}

impl Container {
    /// Reads the header. The error says what was expected and found.
    pub(crate) fn new(bytes: Bytes) -> Result<Container, String> {
        let length = bytes.length();
        let mut head = [0u8; 16];
        let got = bytes.read(0, &mut head).map_err(|error| error.to_string())?;
        if got == 0 {
            return Err("expected a TIFF, got an empty file".into());
        }
        if got < 8 || !super::sniff(&head[..got]) {
            let shown: String = head[..got.min(4)].iter().map(|byte| format!(" {byte:02x}")).collect();
            return Err(format!(
                "expected a TIFF (starting 49 49 2a 00 or 4d 4d 00 2a), got{shown}; is the name right?"
            ));
        }
        let little = head[0] == b'I';
        let mut container = Container { bytes, little, big: false, first: 0 };
        container.big = container.u16(&head[2..]) == 43;
        container.first = if container.big {
            if got < 16 || container.u16(&head[4..]) != 8 {
                return Err("expected a BigTIFF header of 16 bytes with 8-byte offsets, got something else".into());
            }
            container.u64(&head[8..])
        } else {
            container.u32(&head[4..]).into()
        };
        if container.first == 0 {
            return Err("expected an image directory, got none (its offset is 0)".into());
        }
        if container.first >= length {
            return Err(format!(
                "expected an image directory within the file's {length} bytes, got offset {}; the file is cut off",
                container.first
            ));
        }
        Ok(container)
    }

    pub(crate) fn u16(&self, b: &[u8]) -> u16 {
        let bytes = [b[0], b[1]];
        if self.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) }
    }

    fn u32(&self, b: &[u8]) -> u32 {
        let bytes = [b[0], b[1], b[2], b[3]];
        if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) }
    }

    fn u64(&self, b: &[u8]) -> u64 {
        let bytes = [b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]];
        if self.little { u64::from_le_bytes(bytes) } else { u64::from_be_bytes(bytes) }
    }

    /// All directories of the chain, and a warning if the chain is broken or loops. The first must be sound.
    pub(crate) fn directories(&self) -> Result<(Vec<Directory>, Option<String>), String> {
        let (mut found, mut seen, mut offset) = (Vec::new(), HashSet::new(), self.first);
        while offset != 0 {
            if !seen.insert(offset) {
                return Ok((found, Some("the chain of image directories loops; the loop is left out".into())));
            }
            if found.len() == MOST_DIRECTORIES {
                return Ok((found, Some(format!("more than {MOST_DIRECTORIES} images; the rest is left out"))));
            }
            match self.directory(offset) {
                Ok((directory, next)) => {
                    found.push(directory);
                    offset = next;
                }
                Err(problem) if found.is_empty() => return Err(problem),
                Err(problem) => return Ok((found, Some(format!("a further image directory is broken: {problem}")))),
            }
        }
        Ok((found, None))
    }

    /// One directory and the offset of the next.
    fn directory(&self, offset: u64) -> Result<(Directory, u64), String> {
        let (count_size, entry_size, next_size) = if self.big { (8, 20, 8) } else { (2, 12, 4) };
        let cut = || format!("expected an image directory at offset {offset}, got the end of the file");
        let head = self.bytes.exact(offset, count_size).ok_or_else(cut)?;
        let count = if self.big { self.u64(&head) } else { self.u16(&head).into() };
        if count == 0 || count > MOST_ENTRIES {
            return Err(format!("expected 1 to {MOST_ENTRIES} tags in an image directory, got {count}"));
        }
        let table = self.bytes.exact(offset + count_size, count * entry_size).ok_or_else(cut)?;
        let entries = table
            .chunks_exact(entry_size as usize)
            .map(|raw| {
                let mut field = [0; 8];
                let values = if self.big { &raw[12..20] } else { &raw[8..12] };
                field[..values.len()].copy_from_slice(values);
                let count = if self.big { self.u64(&raw[4..]) } else { self.u32(&raw[4..]).into() };
                Entry { tag: self.u16(raw), kind: self.u16(&raw[2..]), count, field }
            })
            .collect();
        // A file cut off right behind its only directory still has an image to show.
        let next = self.bytes.exact(offset + count_size + count * entry_size, next_size);
        let next = next.map_or(0, |raw| if self.big { self.u64(&raw) } else { self.u32(&raw).into() });
        Ok((Directory { entries }, next))
    }

    /// The bytes of a tag's values, and their type; `None` if the tag is absent.
    fn values(&self, directory: &Directory, tag: u16) -> Result<Option<(u16, Vec<u8>)>, String> {
        let Some(entry) = directory.entries.iter().find(|entry| entry.tag == tag) else { return Ok(None) };
        let Entry { kind, count, field, .. } = *entry;
        let size = size_of_kind(kind).ok_or_else(|| format!("tag {tag}: expected a TIFF type, got type {kind}"))?;
        let inline = if self.big { 8 } else { 4 };
        let total = size.checked_mul(count);
        if let Some(total) = total.filter(|&total| total <= inline) {
            return Ok(Some((kind, field[..total as usize].to_vec())));
        }
        let offset = if self.big { self.u64(&field) } else { self.u32(&field).into() };
        let bytes = total.and_then(|total| self.bytes.exact(offset, total)).ok_or_else(|| {
            let length = self.bytes.length();
            format!(
                "tag {tag}: expected {count} values at offset {offset}, got a file of {length} bytes; it is cut off"
            )
        })?;
        Ok(Some((kind, bytes)))
    }

    /// All values of an unsigned integer tag.
    pub(crate) fn unsigneds(&self, directory: &Directory, tag: u16) -> Result<Option<Vec<u64>>, String> {
        let Some((kind, raw)) = self.values(directory, tag)? else { return Ok(None) };
        Ok(Some(match kind {
            1 | 7 => raw.iter().map(|&byte| byte.into()).collect(),
            3 => raw.chunks_exact(2).map(|b| self.u16(b).into()).collect(),
            4 | 13 => raw.chunks_exact(4).map(|b| self.u32(b).into()).collect(),
            16 | 18 => raw.chunks_exact(8).map(|b| self.u64(b)).collect(),
            _ => return Err(format!("tag {tag}: expected unsigned integers, got type {kind}")),
        }))
    }

    /// The first value of an unsigned integer tag.
    pub(crate) fn unsigned(&self, directory: &Directory, tag: u16) -> Result<Option<u64>, String> {
        Ok(self.unsigneds(directory, tag)?.and_then(|values| values.first().copied()))
    }

    /// All values of a floating point tag; nothing if it is absent or of another type.
    pub(crate) fn doubles(&self, directory: &Directory, tag: u16) -> Vec<f64> {
        match self.values(directory, tag) {
            Ok(Some((12, raw))) => raw.chunks_exact(8).map(|b| f64::from_bits(self.u64(b))).collect(),
            Ok(Some((11, raw))) => raw.chunks_exact(4).map(|b| f32::from_bits(self.u32(b)).into()).collect(),
            _ => Vec::new(),
        }
    }

    /// A text tag up to its first zero byte; `None` if it is absent or of another type.
    pub(crate) fn text(&self, directory: &Directory, tag: u16) -> Option<String> {
        let (kind, raw) = self.values(directory, tag).ok().flatten()?;
        let end = raw.iter().position(|&byte| byte == 0).unwrap_or(raw.len());
        matches!(kind, 1 | 2 | 7).then(|| String::from_utf8_lossy(&raw[..end]).into_owned())
    }

    /// A text tag with its zero bytes, as GeoKeys point into it.
    pub(crate) fn text_bytes(&self, directory: &Directory, tag: u16) -> Vec<u8> {
        self.values(directory, tag).ok().flatten().map_or_else(Vec::new, |(_, raw)| raw)
    }
}
