//! One file per format; none knows another.
//!
//! [`open`] looks at the first bytes, and asks each format in turn whether they are its own. Formats without a mark of
//! their own (`.hgt`, raw samples) are known by their length, their name or the header beside them.

pub mod archive;
pub mod ascii_grid;
pub mod bmp;
pub mod envi;
pub mod esri_raw;
pub mod hgt;
mod input;
pub mod named_raw;
pub mod netcdf;
pub(crate) mod pam;
pub mod png;
pub mod raw;
pub mod surfer;
pub mod terragen;
pub mod text;
pub mod tiff;
pub mod tiles;
pub mod usgs_dem;
pub mod xyz;

pub use input::Input;

use crate::{Crs, Error, Georeference, Info, Source, VerticalDatum};
use littoral::field::Raster;
use std::path::Path;

/// How much of a file is looked at to tell its format.
const HEAD: usize = 4096;

/// Finds the reader for a file by its first bytes.
///
/// # Errors
/// If the file cannot be read, is of no known format, or is broken.
pub fn open(file: &Path) -> Result<Box<dyn Source>, Error> {
    open_input(Input::file(file)?)
}

/// Finds the reader for opened bytes.
///
/// # Errors
/// As [`open`].
pub fn open_input(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let (head, encoding) = (input.head(HEAD)?, input.encoding);
    if archive::is_gzip(&head) {
        input = archive::unpack_gzip(input)?;
    } else if archive::is_zip(&head) {
        input = archive::unpack_zip(input)?;
    }
    input.encoding = encoding;
    let head = input.head(HEAD)?;
    if encoding.is_some() && !png::sniff(&head) {
        return Err(
            input.error("expected a PNG, whose encoding can be chosen, got another format; leave the choice out")
        );
    }
    open_unpacked(input)
}

fn open_unpacked(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let head = input.head(HEAD)?;
    if head.is_empty() {
        return Err(input.error("expected a height file, got an empty file"));
    }
    // Formats with a mark of their own.
    if tiff::sniff(&head) {
        return tiff::open_input(input);
    }
    type Sniffer = fn(&[u8]) -> bool;
    type Opener = fn(Input) -> Result<Box<dyn Source>, Error>;
    let marked: [(Sniffer, Opener); 5] = [
        (png::sniff, png::open),
        (netcdf::sniff, netcdf::open),
        (surfer::sniff, surfer::open),
        (terragen::sniff, terragen::open),
        (bmp::sniff, bmp::open),
    ];
    if let Some((_, open)) = marked.iter().find(|(sniff, _)| sniff(&head)) {
        return open(input);
    }
    if let Some(problem) = refused(&head) {
        return Err(input.error(problem));
    }
    if usgs_dem::sniff(&head) {
        return usgs_dem::open(input);
    }
    if text::is_text(&head) {
        if ascii_grid::sniff(&head) && !is_header(&input) {
            return ascii_grid::open(input);
        }
        if let Some(samples) = samples_beside(&input, &head)? {
            return open_unpacked(samples);
        }
        if xyz::sniff(&head) {
            return xyz::open(input);
        }
    }
    // Plain samples: by the header beside them, by length and name.
    if let Some(header) = input.sidecar_text("hdr") {
        if envi::sniff_header(&header) {
            return envi::open(input, &header);
        }
        if esri_raw::sniff_header(&header) {
            return esri_raw::open(input, &header);
        }
    }
    if hgt::sniff(&input) {
        return hgt::open(input);
    }
    if named_raw::sniff(&input) {
        return named_raw::open(input);
    }
    let shown: String = head.iter().take(8).map(|&b| if b.is_ascii_graphic() { b as char } else { '.' }).collect();
    let bytes: Vec<String> = head.iter().take(8).map(|b| format!("{b:02x}")).collect();
    Err(input.error(format!(
        "expected a height file of a known format, got one that begins with {shown:?} ({}); if GDAL knows it, convert it with \
         `gdal_translate -of GTiff {} land.tif`",
        bytes.join(" "),
        input.name.display()
    )))
}

/// Files that are known, and known not to be land.
fn refused(head: &[u8]) -> Option<&'static str> {
    if head.starts_with(&[0xFF, 0xD8, 0xFF]) {
        return Some(
            "expected heights, got a JPEG: its losses would be hills; drape it over land as a picture, or take the PNG or TIFF it came from",
        );
    }
    if head.starts_with(b"GIF8") || head.starts_with(b"RIFF") && head.get(8..12) == Some(b"WEBP") {
        return Some("expected heights, got a GIF or WebP picture; save it as a 16-bit PNG or a TIFF");
    }
    None
}

fn is_header(input: &Input) -> bool {
    input.name.extension().is_some_and(|e| e.eq_ignore_ascii_case("hdr"))
}

/// The samples that a header file on disk belongs to, if this is one: people name either.
fn samples_beside(input: &Input, head: &[u8]) -> Result<Option<Input>, Error> {
    if !is_header(input) || !input.is_on_disk() {
        return Ok(None);
    }
    let text = String::from_utf8_lossy(head);
    let extensions = match (envi::sniff_header(&text), esri_raw::sniff_header(&text)) {
        (true, _) => &envi::EXTENSIONS[..],
        (_, true) => &esri_raw::EXTENSIONS[..],
        _ => return Ok(None),
    };
    let mut candidates =
        extensions.iter().flat_map(|e| [input.name.with_extension(e), input.name.with_extension(e.to_uppercase())]);
    match candidates.find(|path| path.is_file()) {
        Some(path) => Input::file(&path).map(Some),
        None => Err(input
            .error(format!("expected samples beside this header, got no file with an extension of {extensions:?}"))),
    }
}

/// What a header says, before anything of it is known but the size.
pub(crate) fn info(format: &'static str, columns: usize, rows: usize) -> Info {
    Info {
        format,
        columns,
        rows,
        nodata: None,
        georeference: Georeference::none(columns, rows),
        vertical_metres: 1.0,
        vertical_datum: VerticalDatum::Unknown,
        step: 0.0,
        warnings: Vec::new(),
    }
}

/// `columns` × `rows`, if a raster may have such sides and the file can hold `most` samples.
pub(crate) fn check_fits(input: &Input, columns: usize, rows: usize, most: u64) -> Result<usize, Error> {
    check_size_fits(&input.name, input.length(), columns, rows, most)
}

/// As [`check_fits`], where the input is lent to a decoder.
pub(crate) fn check_size_fits(
    name: &Path,
    length: u64,
    columns: usize,
    rows: usize,
    most: u64,
) -> Result<usize, Error> {
    let side = 1..=Raster::MAX_SIDE;
    let samples = columns.checked_mul(rows).filter(|_| side.contains(&columns) && side.contains(&rows));
    samples.filter(|&n| n as u64 <= most).ok_or_else(|| {
        let problem = format!(
            "expected a size that {length} bytes can hold and at most {} samples a side, got {columns} × {rows}; the header \
             is broken or the file cut off",
            Raster::MAX_SIDE
        );
        Error::content(name, problem)
    })
}

/// The coordinate system of the `.prj` beside a file, or of its `.aux.xml`.
pub(crate) fn crs_from_sidecar(input: &Input) -> Crs {
    let projection = input.sidecar_text("prj").map(|text| Crs::from_wkt(&text)).filter(|crs| *crs != Crs::Unknown);
    projection.or_else(|| pam::Notes::beside(input).crs).unwrap_or(Crs::Unknown)
}

/// What an `.aux.xml`, a world file of one of these extensions and a `.prj` beside the file say.
pub(crate) fn georeference_beside(input: &Input, columns: usize, rows: usize, extensions: &[&str]) -> Georeference {
    let world = extensions.iter().find_map(|extension| input.sidecar_text(extension));
    let mut georeference = Georeference { crs: crs_from_sidecar(input), ..Georeference::none(columns, rows) };
    let notes = pam::Notes::beside(input);
    let world = world.and_then(|text| Georeference::geotransform_of_world_file(&text));
    if let Some(geotransform) = notes.geotransform.or(world) {
        georeference.geotransform = geotransform;
        georeference.y_south = false;
        georeference.registration = notes.registration.unwrap_or(georeference.registration);
    }
    georeference
}

/// Files that name no coordinate system, but whose coordinates can only be degrees: a cell under half a unit, all within
/// ±180 (or 0 … 360) and ±90, and not simply counted from zero. Read as metres they would be a spike of infinite height.
pub(crate) fn assume_degrees(info: &mut Info) {
    let g = info.georeference.geotransform;
    let [columns, rows] = [info.columns as f64, info.rows as f64];
    let x = [g[0], g[0] + g[1] * columns];
    let y = [g[3], g[3] + g[5] * rows];
    let small = g[2] == 0.0 && g[4] == 0.0 && g[1].abs() < 0.5 && g[5].abs() < 0.5;
    let on_earth = x.iter().all(|x| (-181.0..=361.0).contains(x)) && y.iter().all(|y| (-91.0..=91.0).contains(y));
    let counted = x.contains(&0.0) && y.contains(&0.0);
    if info.georeference.crs == Crs::Unknown && small && on_earth && !counted {
        info.georeference.crs = Crs::Geographic { name: "degrees, assumed to be WGS 84".into() };
        info.warnings.push(
            "no coordinate system is stated, but the coordinates look like degrees: taken as longitude and latitude"
                .into(),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_of_header_and_samples_may_be_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let header = "ENVI\nsamples = 2\nlines = 2\ndata type = 2\nbyte order = 0\n";
        let samples: Vec<u8> = [1i16, 2, 3, 4].iter().flat_map(|n| n.to_le_bytes()).collect();
        std::fs::write(folder.path().join("a.hdr"), header).expect("writes");
        assert!(open(&folder.path().join("a.hdr")).err().expect("alone").to_string().contains("beside"));
        std::fs::write(folder.path().join("a.dat"), samples).expect("writes");
        for name in ["a.hdr", "a.dat"] {
            assert_eq!(open(&folder.path().join(name)).expect("opens").info().format, "ENVI");
        }
        // Headers under two data names must not send each other round in circles.
        std::fs::write(folder.path().join("b.img"), header).expect("writes");
        std::fs::write(folder.path().join("b.dat"), header).expect("writes");
        assert!(open(&folder.path().join("b.img")).is_err());
        assert!(open(folder.path()).err().expect("a folder").to_string().contains("folder"));
        assert!(open(&folder.path().join("none.tif")).is_err());
    }

    #[test]
    fn names_do_not_matter_where_content_tells() {
        let grid = b"ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 5\n1 2\n3 4\n".to_vec();
        for name in ["land.tif", "land.hgt", "land", "land.png", "a.hdr"] {
            let source = open_input(Input::memory(name, grid.clone()));
            assert!(source.is_ok_and(|s| s.info().format == "AAIGrid") || name == "a.hdr", "{name}");
        }
        let refused = open_input(Input::memory("land.tif", vec![0xFF, 0xD8, 0xFF, 0xE0, 0, 0]));
        assert!(refused.err().expect("a picture").to_string().contains("JPEG"));
        let unknown = open_input(Input::memory("land.tif", vec![1, 2, 3, 4]));
        assert!(unknown.err().expect("nothing known").to_string().contains("01 02 03 04"));
    }
}
