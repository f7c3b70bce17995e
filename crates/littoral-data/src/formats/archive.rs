//! Height files packed by `gzip` or into a `.zip` with one height file: unpacked in memory, up to a limit, and opened as
//! what is inside. Companions of the same archive (`.hdr`, `.prj`, world files) come along.

use super::{Input, input::APPENDED};
use crate::Error;
use std::io::Read;
use std::path::Path;

/// Packed files are unpacked in memory; beyond this they are better unpacked to disk (bytes).
const MOST_UNPACKED: u64 = 1 << 30;

/// What height files are called, to find the one among an archive's readme files.
const HEIGHT_EXTENSIONS: [&str; 24] = [
    "hgt",
    "tif",
    "tiff",
    "asc",
    "dem",
    "bil",
    "bip",
    "bsq",
    "flt",
    "img",
    "grd",
    "nc",
    "xyz",
    "ter",
    "png",
    "bmp",
    "tt1",
    "tt2",
    "tt3",
    "topotype3",
    "r16",
    "r32",
    "raw",
    "adf",
];

/// What may belong to one.
const SIDECAR_EXTENSIONS: [&str; 7] = ["hdr", "prj", "tfw", "pgw", "bpw", "wld", "aux"];

/// Whether the file begins as gzip's do.
pub fn is_gzip(head: &[u8]) -> bool {
    head.starts_with(&[0x1F, 0x8B, 8])
}

/// Whether the file begins as a zip archive's first member does.
pub fn is_zip(head: &[u8]) -> bool {
    head.starts_with(b"PK\x03\x04")
}

/// What is inside a gzip file, under its name without `.gz`.
///
/// # Errors
/// If it is broken, or holds more than fits in memory.
pub fn unpack_gzip(mut input: Input) -> Result<Input, Error> {
    let name = input.name.clone();
    let decoder = flate2::bufread::MultiGzDecoder::new(input.from_start()?);
    let inner = decoder.header().and_then(|h| h.filename()).map(|f| String::from_utf8_lossy(f).into_owned());
    let bytes = unpack(decoder, &name)?;
    // `N19W156.hgt.gz` is N19W156.hgt; `download.gz` has its true name in its header, if anywhere.
    let outer = name.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let inner = inner.filter(|_| !outer.contains('.')).unwrap_or(outer);
    Ok(Input::memory(name.join(inner), bytes))
}

/// The one height file inside a zip archive.
///
/// # Errors
/// If there is none or more than one, it is broken, encrypted or packed in an unusual way, or more than fits in memory.
pub fn unpack_zip(mut input: Input) -> Result<Input, Error> {
    let name = input.name.clone();
    let fails = |e: zip::result::ZipError| {
        Error::content(&name, format!("expected a sound zip archive, got {e}; unpack it by hand"))
    };
    let mut archive = zip::ZipArchive::new(input.from_start()?).map_err(fails)?;
    let files: Vec<String> = archive
        .file_names()
        .filter_map(|name| Some(name.ok()?.into_owned()))
        .filter(|n| !n.ends_with('/') && !n.starts_with("__MACOSX") && !base(n).starts_with('.'))
        .collect();
    let mut found: Vec<&String> = files.iter().filter(|n| HEIGHT_EXTENSIONS.contains(&extension(n).as_str())).collect();
    if found.is_empty() && files.len() == 1 {
        found = files.iter().collect();
    }
    let [found] = found[..] else {
        let shown: Vec<&str> = found.iter().take(3).map(|n| n.as_str()).collect();
        let problem =
            format!("expected one height file in the archive, got {} {shown:?}; unpack it and name one", found.len());
        return Err(Error::content(&name, problem));
    };
    let bytes = unpack(archive.by_name(found).map_err(fails)?, &name)?;
    let mut unpacked = Input::memory(name.join(base(found)), bytes);
    for file in files.iter().filter(|n| SIDECAR_EXTENSIONS.contains(&extension(n).as_str())).take(8) {
        // A companion of another file does no harm: only those that a format knows are looked at.
        let mut content = Vec::new();
        let sidecar = archive.by_name(file).map_err(fails)?;
        if sidecar.take(1 << 20).read_to_end(&mut content).is_ok() {
            unpacked = unpacked.with_sidecar(&extension(file), content);
        }
    }
    // Those that stand behind the whole name. A mask may be as long as the file itself.
    for ending in APPENDED {
        if let Some(file) = files.iter().find(|n| n.strip_prefix(found.as_str()) == Some(&format!(".{ending}"))) {
            let content = unpack(archive.by_name(file).map_err(fails)?, &name)?;
            unpacked = unpacked.with_sidecar(ending, content);
        }
    }
    Ok(unpacked)
}

fn unpack(packed: impl Read, name: &Path) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    packed.take(MOST_UNPACKED + 1).read_to_end(&mut bytes).map_err(|e| {
        Error::content(name, format!("expected sound packed data, got {e} after {} bytes; fetch it again", bytes.len()))
    })?;
    if bytes.len() as u64 > MOST_UNPACKED {
        let problem = format!("expected at most {MOST_UNPACKED} bytes inside, got more; unpack it to disk first");
        return Err(Error::content(name, problem));
    }
    Ok(bytes)
}

fn base(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn extension(path: &str) -> String {
    base(path).rsplit_once('.').map_or(String::new(), |(_, extension)| extension.to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const GRID: &[u8] = b"ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 5\n1 2\n3 4\n";

    fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
        let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, content) in files {
            writer.start_file(*name, zip::write::SimpleFileOptions::default()).expect("starts");
            writer.write_all(content).expect("writes");
        }
        writer.finish().expect("finishes").into_inner()
    }

    #[test]
    fn the_height_file_is_found() {
        let bytes = zip(&[("readme.txt", b"hello"), ("a/land.asc", GRID), ("a/land.prj", b"text")]);
        let unpacked = unpack_zip(Input::memory("x.zip", bytes)).expect("unpacks");
        assert_eq!(unpacked.lower_name(), "land.asc");
        assert_eq!(unpacked.sidecar_text("prj").as_deref(), Some("text"));
        let files =
            [("a/land.asc", GRID), ("a/land.asc.aux.xml", b"<a/>"), ("b/land.asc.msk", b"1"), ("a/land.asc.msk", b"2")];
        let unpacked = unpack_zip(Input::memory("x.zip", zip(&files))).expect("unpacks");
        assert_eq!(unpacked.sidecar_text("aux.xml").as_deref(), Some("<a/>"));
        assert_eq!(unpacked.sidecar_text("msk").as_deref(), Some("2"));
        let two = zip(&[("a.asc", GRID), ("b.asc", GRID)]);
        assert!(unpack_zip(Input::memory("x.zip", two)).err().expect("two").to_string().contains("got 2"));
        let none = zip(&[("a.doc", GRID), ("b.doc", GRID)]);
        assert!(unpack_zip(Input::memory("x.zip", none)).is_err());
        let single = zip(&[("noname", GRID)]);
        assert!(crate::formats::open_input(Input::memory("x.zip", single)).is_ok());
    }

    #[test]
    fn gzip_opens_as_what_is_inside_and_says_when_cut_off() {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(GRID).expect("writes");
        let bytes = encoder.finish().expect("finishes");
        let source = crate::formats::open_input(Input::memory("land.asc.gz", bytes.clone())).expect("opens");
        assert_eq!(source.info().columns, 2);
        let cut = crate::formats::open_input(Input::memory("land.asc.gz", bytes[..bytes.len() - 12].to_vec()));
        assert!(cut.err().expect("cut").to_string().contains("fetch it again"));
    }
}
