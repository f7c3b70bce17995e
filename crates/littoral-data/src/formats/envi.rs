//! ENVI: plain samples with a `.hdr` that begins with the word ENVI and holds `name = value` pairs, values in braces running
//! over lines.
//!
//! NV5 Geospatial, "ENVI Header Files".

use super::raw::{Layout, RawSource, SampleType, check_size};
use super::text::number;
use super::{Input, assume_degrees, crs_from_sidecar, info};
use crate::voids::VoidRule;
use crate::{Crs, Error, Info, Source, metres_of_unit_name};
use std::collections::HashMap;

/// Data files that such a header may belong to, the likely ones first; also one without any extension.
pub const EXTENSIONS: [&str; 8] = ["img", "dat", "bsq", "bil", "bip", "raw", "envi", ""];

/// Whether a header file's text is of this kind.
pub fn sniff_header(text: &str) -> bool {
    text.trim_start().starts_with("ENVI")
}

fn names(text: &str) -> HashMap<String, String> {
    let mut names = HashMap::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some((name, value)) = line.split_once('=') else { continue };
        let mut value = value.trim().to_owned();
        if value.starts_with('{') {
            while !value.contains('}') {
                let Some(line) = lines.next() else { break };
                value.push(' ');
                value.push_str(line.trim());
            }
        }
        let value = value.trim_start_matches('{').split('}').next().unwrap_or_default().trim().to_owned();
        names.insert(name.trim().to_lowercase(), value);
    }
    names
}

/// Opens the samples, given the header's text.
///
/// # Errors
/// If the header lacks a size, speaks of samples that are no real numbers, or the file does not hold what it promises.
pub fn open(input: Input, header: &str) -> Result<Box<dyn Source>, Error> {
    let names = names(header);
    let text = |name: &str| names.get(name).map(String::as_str);
    let count = |name: &str| text(name).and_then(number).filter(|v| *v >= 0.0 && *v <= 1e15 && v.fract() == 0.0);
    let required = |name: &str| {
        let count = count(name).map(|v| v as u64);
        count.ok_or_else(|| {
            input.error(format!("expected \"{name}\" in the header, got {:?}", text(name).unwrap_or("none")))
        })
    };
    let [columns, rows] = [required("samples")?, required("lines")?];
    check_size(&input, columns, rows)?;
    let bands = count("bands").map_or(1, |b| b as u64).max(1);
    let sample = match required("data type")? {
        1 => SampleType::U8,
        2 => SampleType::I16,
        3 => SampleType::I32,
        4 => SampleType::F32,
        5 => SampleType::F64,
        12 => SampleType::U16,
        13 => SampleType::U32,
        14 => SampleType::I64,
        15 => SampleType::U64,
        other => return Err(input.error(format!("expected a data type of real numbers (1–5, 12–15), got {other}"))),
    };
    let bytes = sample.bytes();
    let row = columns * bytes;
    let overflow = || input.error("expected a header whose sizes fit in a file, got an overflow");
    let all_bands = row.checked_mul(bands).ok_or_else(overflow)?;
    let (sample_stride, row_stride) = match text("interleave").unwrap_or("bsq").to_lowercase().as_str() {
        "bil" => (bytes, all_bands),
        "bip" => (bytes * bands, all_bands),
        _ => (bytes, row),
    };
    let offset = count("header offset").unwrap_or(0.0) as u64;
    let big_endian = text("byte order") == Some("1");
    let layout = Layout { offset, sample, big_endian, sample_stride, row_stride, south_first: false };

    let mut info = info("ENVI", columns as usize, rows as usize);
    info.step = sample.step();
    if bands > 1 {
        info.warnings.push(format!("the file has {bands} bands: the first is read"));
    }
    place(&mut info, &input, text("map info"), text("coordinate system string"));
    info.nodata = text("data ignore value").and_then(number);
    let rule = VoidRule { nodata: info.nodata, ..VoidRule::default() };
    Ok(Box::new(RawSource::new(input, info, layout, rule)?))
}

/// `map info = {name, x of a pixel, y of it, easting, northing, width, height, …, units=…, rotation=…}`; pixels are counted
/// from 1 at the outer corner of the first.
fn place(info: &mut Info, input: &Input, map_info: Option<&str>, wkt: Option<&str>) {
    let words: Vec<&str> = map_info.unwrap_or_default().split(',').map(str::trim).collect();
    let numbers: Vec<f64> = words.iter().skip(1).take(6).filter_map(|w| number(w)).filter(|v| v.is_finite()).collect();
    let crs = match wkt.map_or(Crs::Unknown, Crs::from_wkt) {
        Crs::Unknown => crs_of_words(&words),
        crs => crs,
    };
    let crs = if crs == Crs::Unknown { crs_from_sidecar(input) } else { crs };
    info.georeference.crs = crs;
    match numbers[..] {
        [px, py, x, y, dx, dy] if dx > 0.0 && dy > 0.0 => {
            info.georeference.y_south = false;
            info.georeference.geotransform = [x - (px - 1.0) * dx, dx, 0.0, y + (py - 1.0) * dy, 0.0, -dy];
            if let Some(turn) = words.iter().find_map(|w| w.strip_prefix("rotation=")).and_then(number)
                && turn.is_finite()
                && turn != 0.0
            {
                // Counter-clockwise, about the tie point, as GDAL takes it.
                let (sin, cos) = turn.to_radians().sin_cos();
                let [a, b, d, e] = [cos * dx, sin * dy, sin * dx, -cos * dy];
                info.georeference.geotransform =
                    [x - (px - 1.0) * a - (py - 1.0) * b, a, b, y - (px - 1.0) * d - (py - 1.0) * e, d, e];
            }
            assume_degrees(info);
        }
        _ => info.warnings.push("the header does not say where the samples lie: one metre a sample".into()),
    }
}

fn crs_of_words(words: &[&str]) -> Crs {
    match words.first().map(|w| w.to_lowercase()).as_deref() {
        Some(name) if name.starts_with("geographic") => Crs::Geographic { name: "EPSG:4326".into() },
        Some("utm") if words.iter().any(|w| w.eq_ignore_ascii_case("WGS-84")) => {
            let zone = words.get(7).and_then(|z| z.parse::<u32>().ok()).filter(|z| (1..=60).contains(z));
            let south = words.get(8).is_some_and(|h| h.eq_ignore_ascii_case("south"));
            zone.and_then(|zone| Crs::from_epsg(if south { 32700 } else { 32600 } + zone)).unwrap_or(Crs::Unknown)
        }
        // Feet would otherwise be taken for metres.
        Some(_) => {
            let unit = words.iter().find_map(|w| w.to_lowercase().strip_prefix("units=").and_then(metres_of_unit_name));
            unit.filter(|m| *m != 1.0).map_or(Crs::Unknown, |metres| Crs::Projected {
                name: format!("ENVI {}", words[0]),
                metres,
                definition: None,
            })
        }
        None => Crs::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    const HEADER: &str = "ENVI\ndescription = {\nland,\nmetres}\nsamples = 3\nlines   = 2\nbands = 1\nheader offset = 4\n\
                          data type = 12\ninterleave = bsq\nbyte order = 1\ndata ignore value = 7\n\
                          map info = {UTM, 2, 1, 1000, 5000, 10, 20, 32, North}\n";

    #[test]
    fn samples_place_and_void() {
        assert!(sniff_header(HEADER) && !sniff_header("ncols 3"));
        let bytes =
            [0u8; 4].into_iter().chain([1u16, 2, 3, 4, 7, 65535].iter().flat_map(|n| n.to_be_bytes())).collect();
        let mut source = open(Input::memory("a.img", bytes), HEADER).expect("opens");
        let all = source.read(0, Window { column: 0, row: 0, columns: 3, rows: 2 }).expect("reads");
        assert_eq!(all[..4], [1.0, 2.0, 3.0, 4.0]);
        assert!(all[4].is_nan() && all[5].is_nan());
        assert_eq!(source.info().georeference.geotransform, [990.0, 10.0, 0.0, 5000.0, 0.0, -20.0]);
    }

    #[test]
    fn hostile_headers_are_errors() {
        let with = |from: &str, to: &str| open(Input::memory("a.img", vec![0; 16]), &HEADER.replace(from, to));
        assert!(with("", "").is_ok());
        for (from, to) in [
            ("samples = 3", "samples = 0"),
            ("samples = 3", ""),
            ("data type = 12", "data type = 6"),
            ("bands = 1", "bands = 999999999999999"),
            ("header offset = 4", "header offset = 999999999999999"),
            ("lines   = 2", "lines = 999999"),
        ] {
            let result = with(from, to);
            assert!(result.is_err() || to.starts_with("bands"), "{to}");
        }
        assert!(with("description = {", "description = {{{").is_ok() || with("description = {", "x").is_ok());
        assert!(open(Input::memory("a.img", vec![0; 16]), "ENVI\nmap info = {").is_err());
    }
}
