//! SRTM `.hgt`: one degree square of big-endian 16-bit metres, from the north-west, without a header. The south-west
//! corner is in the name (`N46W123.hgt`), the spacing follows from the length. Samples lie on the whole degrees, so
//! neighbouring files share their border rows, and pixel edges lie half a sample outside.
//!
//! Farr et al. The Shuttle Radar Topography Mission. 2007; the file layout is NASA's SRTM_Topo.txt.

use super::raw::{Layout, RawSource, SampleType};
use super::{Input, info};
use crate::voids::VoidRule;
use crate::{Crs, Error, Georeference, Registration, Source, VerticalDatum};

/// Columns and rows in use: 30″, 3″, 1″, 1″ with wider columns near the poles, and finer ones made in the same manner.
const SIZES: [[u64; 2]; 8] =
    [[1201, 1201], [3601, 3601], [1801, 3601], [1201, 3601], [601, 1201], [121, 121], [7201, 7201], [10801, 10801]];

/// Whether the length is that of such a file and the name holds a corner, or at least ends in `.hgt`.
pub fn sniff(input: &Input) -> bool {
    let name = input.lower_name();
    name.ends_with(".hgt") || (size(input.length()).is_some() && corner(&name).is_some())
}

/// Opens such a file.
///
/// # Errors
/// If the length is none of those in use, or the name does not say where it lies.
pub fn open(input: Input) -> Result<Box<dyn Source>, Error> {
    let Some([columns, rows]) = size(input.length()) else {
        return Err(input.error(format!(
            "expected an .hgt file of 1201 × 1201 × 2 = 2884802 or 3601 × 3601 × 2 = 25934402 bytes (or 1801 × 3601, 1201 × \
             3601 …), got {}; it is cut off or not an SRTM file",
            input.length()
        )));
    };
    let Some([longitude, latitude]) = corner(&input.lower_name()).or_else(|| corner(&archive_name(&input))) else {
        return Err(input.error(
            "expected a name with the south-west corner, such as N46W123.hgt, got none; rename it: the file itself does not \
             say where it lies",
        ));
    };
    let [dx, dy] = [1.0 / (columns - 1) as f64, 1.0 / (rows - 1) as f64];
    let mut info = info("SRTMHGT", columns as usize, rows as usize);
    info.nodata = Some(-32768.0);
    info.georeference = Georeference {
        geotransform: [longitude - 0.5 * dx, dx, 0.0, latitude + 1.0 + 0.5 * dy, 0.0, -dy],
        registration: Registration::Point,
        crs: Crs::Geographic { name: "EPSG:4326".into() },
        size: [columns as usize, rows as usize],
        y_south: false,
    };
    info.vertical_datum = VerticalDatum::Named("EGM96".into());
    info.step = 1.0;
    let layout = Layout::plain(0, SampleType::I16, true, columns as usize);
    Ok(Box::new(RawSource::new(input, info, layout, VoidRule { nodata: Some(-32768.0), ..VoidRule::default() })?))
}

/// The name of the archive that holds the file, in lower case; empty if none does.
fn archive_name(input: &Input) -> String {
    let parent = input.name.parent().and_then(|p| p.file_name()).unwrap_or_default().to_string_lossy().to_lowercase();
    if parent.ends_with(".zip") || parent.ends_with(".gz") { parent } else { String::new() }
}

fn size(length: u64) -> Option<[u64; 2]> {
    SIZES.into_iter().find(|[columns, rows]| columns * rows * 2 == length)
}

/// Longitude and latitude of the south-west corner, from `n46w123`, `n46_w123` … anywhere in a name in lower case.
fn corner(name: &str) -> Option<[f64; 2]> {
    let bytes = name.as_bytes();
    let number = |digits: &[u8]| -> Option<f64> {
        digits.iter().try_fold(0.0, |n, d| d.is_ascii_digit().then(|| n * 10.0 + f64::from(d - b'0')))
    };
    for start in 0..bytes.len() {
        let latitude_sign = match bytes[start] {
            b'n' => 1.0,
            b's' => -1.0,
            _ => continue,
        };
        let Some(latitude) = bytes.get(start + 1..start + 3).and_then(number) else { continue };
        let rest = &bytes[start + 3..];
        let rest = rest.strip_prefix(b"_").unwrap_or(rest);
        let longitude_sign = match rest.first() {
            Some(b'e') => 1.0,
            Some(b'w') => -1.0,
            _ => continue,
        };
        let Some(longitude) = rest.get(1..4).and_then(number) else { continue };
        if latitude <= 90.0 && longitude <= 180.0 {
            return Some([longitude_sign * longitude, latitude_sign * latitude]);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    #[test]
    fn corners_are_found_in_names() {
        assert_eq!(corner("n46w123.hgt"), Some([-123.0, 46.0]));
        assert_eq!(corner("s01e000.srtmgl1.hgt"), Some([0.0, -1.0]));
        assert_eq!(corner("astgtm_n19_w156_dem.hgt"), Some([-156.0, 19.0]));
        for name in ["badname.hgt", "n4w123", "n99w123.hgt", "n46w999.hgt", "n+1w+12", "n46w12", ""] {
            assert_eq!(corner(name), None, "{name}");
        }
    }

    #[test]
    fn samples_lie_on_whole_degrees() {
        let mut bytes = vec![0u8; 1201 * 1201 * 2];
        bytes[..4].copy_from_slice(&[0x80, 0x00, 0x01, 0x02]);
        let mut source = open(Input::memory("S34E018.hgt", bytes)).expect("opens");
        let info = source.info();
        assert_eq!([info.columns, info.rows], [1201, 1201]);
        let crs = info.georeference.crs_from_sample();
        let [first, last] = [glam::DVec2::ZERO, glam::DVec2::splat(1200.0)].map(|s| crs.transform_point2(s));
        assert!((first - glam::DVec2::new(18.0, -33.0)).length() < 1e-12, "{first}");
        assert!((last - glam::DVec2::new(19.0, -34.0)).length() < 1e-12, "{last}");
        let heights = source.read(0, Window { column: 0, row: 0, columns: 2, rows: 1 }).expect("reads");
        assert!(heights[0].is_nan());
        assert_eq!(heights[1], 258.0);
    }

    #[test]
    fn wrong_lengths_and_names_are_named() {
        let error = |name: &str, length| open(Input::memory(name, vec![7; length])).err().expect("fails").to_string();
        assert!(error("N00E000.hgt", 2000).contains("got 2000"));
        assert!(error("badname.hgt", 121 * 121 * 2).contains("rename it"));
    }
}
