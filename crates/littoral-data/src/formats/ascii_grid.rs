//! Grids in text with a header of names and numbers: ESRI ASCII (`ncols 160`) and GeoClaw's topotypes 2 and 3
//! (`160 ncols`), which differ in the order within a line of the header and in what `xlower` means. Values follow row by
//! row from the north-west, wrapped anywhere.
//!
//! ESRI: ArcGIS "Esri ASCII raster format"; GeoClaw: "Topography data" and `topotools.py`, where `xllcorner` is the corner
//! of a cell while `xlower` and `xllcenter` are places of samples.

use super::text::{Tokens, not_a_number, number};
use super::{Input, assume_degrees, check_fits, crs_from_sidecar, info};
use crate::voids::VoidRule;
use crate::{Error, Georeference, MemorySource, Registration, Source};
use std::collections::HashMap;

/// Headers are shorter than this.
const LONGEST_HEADER: usize = 4096;

/// Names of such headers. Where the value comes first, only these are taken for names.
const NAMES: [&str; 25] = [
    "ncols",
    "nrows",
    "mx",
    "my",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "xlower",
    "ylower",
    "xll",
    "yll",
    "cellsize",
    "dx",
    "dy",
    "xdim",
    "ydim",
    "nodata_value",
    "nodata",
    "nodatavalue",
    "no_data_value",
    "north",
    "south",
    "east",
    "west",
];

/// Whether the first line of the head is one of such a header.
pub fn sniff(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(&head[..head.len().min(LONGEST_HEADER)]);
    let first = text.trim_start_matches('\u{feff}').trim_start().lines().next().unwrap_or_default();
    let words: Vec<String> = first.split_whitespace().take(3).map(str::to_lowercase).collect();
    words.len() >= 2 && words.iter().take(2).any(|w| NAMES.contains(&w.as_str()))
}

struct Header {
    names: HashMap<String, Vec<f64>>,
    value_first: bool,
    data_offset: u64,
}

/// Lines with a name in them, up to the first of only numbers.
fn header(input: &Input, head: &[u8]) -> Result<Header, Error> {
    let mut header = Header { names: HashMap::new(), value_first: false, data_offset: 0 };
    let mut offset = if head.starts_with(b"\xEF\xBB\xBF") { 3 } else { 0 };
    for line in head[offset..].split_inclusive(|&b| b == b'\n' || b == b'\r') {
        let text = String::from_utf8_lossy(line);
        let words: Vec<&str> = text.split_whitespace().collect();
        let is_name = |at: usize, word: &str| {
            let letters = word.starts_with(|c: char| c.is_ascii_alphabetic()) && number(word).is_none();
            letters && (at == 0 || NAMES.contains(&word.to_lowercase().as_str()))
        };
        if let Some((name_at, name)) = words.iter().enumerate().find(|(at, word)| is_name(*at, word)) {
            let mut values = Vec::new();
            for word in words.iter().take(4).filter(|w| *w != name) {
                values.push(number(word).ok_or_else(|| input.error(format!("{} after {name}", not_a_number(word))))?);
            }
            header.value_first |= name_at > 0;
            header.names.insert(name.to_lowercase(), values);
        } else if !words.is_empty() {
            break;
        }
        offset += line.len();
    }
    header.data_offset = offset as u64;
    Ok(header)
}

impl Header {
    fn get(&self, names: &[&str]) -> Option<f64> {
        names.iter().find_map(|n| self.names.get(*n)).and_then(|values| values.first().copied())
    }

    fn count(&self, input: &Input, names: &[&str]) -> Result<usize, Error> {
        let value =
            self.get(names).ok_or_else(|| input.error(format!("expected {} in the header, got none", names[0])))?;
        if value >= 1.0 && value.fract() == 0.0 && value <= 1e15 {
            return Ok(value as usize);
        }
        Err(input.error(format!("expected {} to be a whole number above 0, got {value}", names[0])))
    }
}

/// Opens such a file.
///
/// # Errors
/// If the header lacks a size or spacing, promises more values than the file can hold, or a value is not a number.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let head = input.head(LONGEST_HEADER)?;
    let header = header(&input, &head)?;
    let columns = header.count(&input, &["ncols", "mx"])?;
    let rows = header.count(&input, &["nrows", "my"])?;
    // The shortest value is a digit and a space.
    let samples = check_fits(&input, columns, rows, (input.length() - header.data_offset) / 2 + 1)?;

    let size = header.names.get("cellsize").map_or(&[] as &[f64], Vec::as_slice);
    let dx = header.get(&["dx", "xdim"]).or(size.first().copied());
    let dy = header.get(&["dy", "ydim"]).or(size.get(1).or(size.first()).copied()).or(dx);
    let (Some(dx), Some(dy)) = (dx, dy) else {
        return Err(input.error("expected cellsize (or dx and dy) in the header, got none"));
    };
    if !(dx > 0.0 && dy > 0.0 && dx.is_finite() && dy.is_finite()) {
        return Err(input.error(format!("expected a cell size above 0, got {dx} × {dy}")));
    }
    let mut info = info(if header.value_first { "GeoClaw" } else { "AAIGrid" }, columns, rows);
    let mut lower = |corner: &[&str], centre: &[&str], step: f64| {
        let at = header.get(corner).or(header.get(centre).map(|c| c - 0.5 * step));
        at.filter(|at| at.is_finite()).unwrap_or_else(|| {
            info.warnings.push(format!("the header has no {}: taken as 0", corner[0]));
            0.0
        })
    };
    let x = lower(&["xllcorner"], &["xllcenter", "xlower", "xll"], dx);
    let y = lower(&["yllcorner"], &["yllcenter", "ylower", "yll"], dy);
    let corner = header.names.contains_key("xllcorner");
    info.georeference = Georeference {
        geotransform: [x, dx, 0.0, y + rows as f64 * dy, 0.0, -dy],
        registration: if corner { Registration::Area } else { Registration::Point },
        crs: crs_from_sidecar(&input),
        size: [columns, rows],
        y_south: false,
    };
    info.nodata = header.get(&["nodata_value", "nodata", "nodatavalue", "no_data_value"]);
    assume_degrees(&mut info);

    let rule = VoidRule { nodata: info.nodata, ..VoidRule::default() };
    let mut tokens = Tokens::new(&mut input, header.data_offset)?;
    let mut heights = Vec::with_capacity(samples);
    let mut whole = true;
    while heights.len() < samples {
        let Some(value) = tokens.next_number()? else { break };
        whole &= value.fract() == 0.0;
        heights.push(rule.height(value));
    }
    info.step = if whole { 1.0 } else { 0.0 };
    if heights.len() < samples {
        if !tokens.closed {
            heights.pop(); // The last number may have lost digits.
        }
        if heights.is_empty() {
            return Err(
                input.error(format!("expected {samples} values after the header, got none; the file is cut off"))
            );
        }
        info.warnings.push(format!("expected {samples} values, got {}: the rest is void", heights.len()));
        heights.resize(samples, f32::NAN);
    } else {
        let mut more = 0u64;
        while tokens.next_token()?.is_some() {
            more += 1;
        }
        if more > 0 {
            info.warnings
                .push(format!("expected {samples} values, got {more} too many: those at the end are left out"));
        }
    }
    Ok(Box::new(MemorySource::new(info, heights)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    fn read(text: &str) -> Result<(crate::Info, Vec<f32>), Error> {
        let mut source = open(Input::memory("t.asc", text.as_bytes().to_vec()))?;
        let info = source.info().clone();
        let window = Window { column: 0, row: 0, columns: info.columns, rows: info.rows };
        let heights = source.read(0, window)?;
        Ok((info, heights))
    }

    #[test]
    fn corner_and_centre_agree() {
        let corner = "NCOLS 3\r\nNROWS 2\r\nXLLCORNER 10\r\nYLLCORNER 20\r\nCELLSIZE 2\r\nNODATA_VALUE 5\r\n1 2\r\n3 4 5\t6e0\r\n";
        let centre = "ncols 3\nnrows 2\nxllcenter 11\nyllcenter 21\ndx 2\ndy 2\nnodata 5\n1 2 3\n4 5 6";
        let (a, heights) = read(corner).expect("reads");
        let (b, same) = read(centre).expect("reads");
        assert_eq!(a.georeference.geotransform, [10.0, 2.0, 0.0, 24.0, 0.0, -2.0]);
        assert_eq!(a.georeference.geotransform, b.georeference.geotransform);
        assert_eq!(heights[..4], [1.0, 2.0, 3.0, 4.0]);
        assert!(heights[4].is_nan() && same[4].is_nan());
        assert_eq!(heights[5], same[5]);
        assert_eq!((a.nodata, a.step), (Some(5.0), 1.0));
    }

    #[test]
    fn geoclaw_names_follow_values_and_xlower_is_a_sample() {
        let text = "2 mx\n2 my\n0.5 xlower\n1.5 ylower\n1.0 2.0 cellsize\n-999 nodata_value\n1\n2\n3\n-999\n";
        let (info, heights) = read(text).expect("reads");
        assert_eq!(info.georeference.geotransform, [0.0, 1.0, 0.0, 4.5, 0.0, -2.0]);
        assert_eq!(info.format, "GeoClaw");
        assert!(heights[3].is_nan());
        assert!(sniff(text.as_bytes()) && sniff(b"ncols 5\n") && !sniff(b"1 2 3\n") && !sniff(b"x y z\n"));
    }

    #[test]
    fn sizes_are_checked_against_the_file() {
        let grid = |ncols: &str, values: &str| {
            read(&format!("ncols {ncols}\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n{values}"))
        };
        for (ncols, values, words) in [
            ("99999999999", "1 2 3 4", "hold"),
            ("-3", "1 2 3 4", "above 0"),
            ("2.5", "1 2 3 4", "whole"),
            ("2", "1,5 2,5 3,5 4,5", "decimal commas"),
            ("2", "1 2 x 4", "\"x\""),
            ("2", "", "hold"),
        ] {
            let error = grid(ncols, values).expect_err("must fail").to_string();
            assert!(error.contains(words), "{error}");
        }
        let (info, heights) = grid("2", "10 20 30 400").expect("partial");
        assert!(info.warnings.is_empty());
        assert_eq!(heights[3], 400.0);
        let (info, heights) = grid("2", "10 20 30").expect("partial");
        assert!(info.warnings[0].contains("got 2"), "the third number may be cut: {:?}", info.warnings);
        assert!(heights[2].is_nan() && heights[3].is_nan());
        let (info, _) = grid("2", "1 2 3 4 5 6 7\n").expect("too many");
        assert!(info.warnings[0].contains("3 too many"));
    }
}
