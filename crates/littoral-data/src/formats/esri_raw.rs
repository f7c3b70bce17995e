//! Plain samples with an ESRI header beside them: `.bil`, `.bip`, `.bsq`, `.dem` (EHdr, GTOPO30) and `.flt` (GridFloat). Both
//! write lines of names and values into a `.hdr`; EHdr places the *middle* of the north-west sample (`ULXMAP`), GridFloat a
//! corner or middle in the south-west, as ESRI ASCII does.
//!
//! ESRI, "Extendable Image Formats"; ArcGIS "Float to Raster".

use super::raw::{Layout, RawSource, SampleType, check_size};
use super::text::number;
use super::{Input, assume_degrees, crs_from_sidecar, info};
use crate::voids::VoidRule;
use crate::{Error, Georeference, Registration, Source};
use std::collections::HashMap;

/// Data files that such a header may belong to, the likely ones first.
pub const EXTENSIONS: [&str; 7] = ["bil", "flt", "bsq", "bip", "dem", "img", "raw"];

/// Whether a header file's text is of this kind.
pub fn sniff_header(text: &str) -> bool {
    let names = names(text);
    let has = |a: &str, b: &str| names.contains_key(a) || names.contains_key(b);
    has("ncols", "samples") && has("nrows", "lines") && !text.trim_start().starts_with("ENVI")
}

fn names(text: &str) -> HashMap<String, String> {
    let pair = |line: &str| {
        let mut words = line.split_whitespace();
        Some((words.next()?.to_lowercase(), words.next()?.to_lowercase()))
    };
    text.lines().filter_map(pair).collect()
}

/// Opens the samples, given the header's text.
///
/// # Errors
/// If the header lacks a size, speaks of samples that are no numbers, or the file does not hold what it promises.
pub fn open(input: Input, header: &str) -> Result<Box<dyn Source>, Error> {
    let names = names(header);
    let text = |name: &str| names.get(name).map(String::as_str);
    let value = |name: &str| text(name).and_then(number).filter(|v| v.is_finite());
    let count = |name: &str| value(name).filter(|v| *v >= 0.0 && *v <= 1e15 && v.fract() == 0.0).map(|v| v as u64);
    let required = |name: &str| {
        count(name).ok_or_else(|| {
            input.error(format!("expected {name} in the header, got {:?}", text(name).unwrap_or("none")))
        })
    };
    let [columns, rows] = [required("ncols")?, required("nrows")?];
    check_size(&input, columns, rows)?;
    let samples = columns * rows;
    let bands = count("nbands").unwrap_or(1).max(1);
    let skip = count("skipbytes").unwrap_or(0);
    let overflow = || input.error("expected a header whose sizes fit in a file, got an overflow");

    // GridFloat names no type and is always 32-bit; EHdr's default is 8 bits, but heights never are without saying so.
    let grid_float = !names.contains_key("ulxmap") && !names.contains_key("nbits") && !names.contains_key("layout");
    let bits = match count("nbits") {
        Some(bits) => bits,
        None if grid_float => 32,
        None => input.length().saturating_sub(skip) / samples.checked_mul(bands).ok_or_else(overflow)? * 8,
    };
    let kind = text("pixeltype").unwrap_or(if bits == 32 { "float" } else { "signedint" });
    let sample = match (bits, kind.chars().next()) {
        (8, Some('s')) => SampleType::I8,
        (8, _) => SampleType::U8,
        (16, Some('u')) => SampleType::U16,
        (16, Some('s')) => SampleType::I16,
        (32, Some('u')) => SampleType::U32,
        (32, Some('s')) => SampleType::I32,
        (32, Some('f')) => SampleType::F32,
        (64, Some('f')) => SampleType::F64,
        _ => {
            return Err(
                input.error(format!("expected samples of 8, 16, 32 or 64 bits, got {bits} bits of type {kind}"))
            );
        }
    };
    let bytes = sample.bytes();
    let row = columns * bytes;
    let layout_name = text("layout").unwrap_or("bil");
    let (sample_stride, row_stride) = match layout_name {
        "bsq" => (bytes, row),
        "bip" => (bands.checked_mul(bytes).ok_or_else(overflow)?, row.checked_mul(bands).ok_or_else(overflow)?),
        _ => {
            let band_row = count("bandrowbytes").unwrap_or(row).max(row);
            let total = band_row.checked_mul(bands).ok_or_else(overflow)?;
            (bytes, count("totalrowbytes").unwrap_or(total).max(total))
        }
    };
    let big_endian = matches!(text("byteorder"), Some("m" | "msbfirst" | "msb_first" | "vms_ffloat"));
    let layout = Layout { offset: skip, sample, big_endian, sample_stride, row_stride, south_first: false };

    let mut info = info("EHdr", columns as usize, rows as usize);
    let side = value("cellsize");
    let step = |name: &str| value(name).or(side).filter(|step| *step > 0.0);
    let [dx, dy] = [step("xdim"), step("ydim")];
    if dx.is_none() || dy.is_none() {
        info.warnings.push("the header has no size of a cell: taken as 1".into());
    }
    let [dx, dy] = [dx.unwrap_or(1.0), dy.unwrap_or(1.0)];
    let high = rows as f64 * dy;
    let corner =
        value("ulxmap").map(|x| x - 0.5 * dx).or(value("xllcorner")).or(value("xllcenter").map(|x| x - 0.5 * dx));
    let top = value("ulymap").map(|y| y + 0.5 * dy).or(value("yllcorner").map(|y| y + high));
    let top = top.or(value("yllcenter").map(|y| y + high - 0.5 * dy));
    if corner.is_none() || top.is_none() {
        info.warnings.push("the header does not say where the samples lie: placed at 0, 0".into());
    }
    info.georeference = Georeference {
        geotransform: [corner.unwrap_or(0.0), dx, 0.0, top.unwrap_or(high), 0.0, -dy],
        registration: Registration::Area,
        crs: crs_from_sidecar(&input),
        size: [columns as usize, rows as usize],
        y_south: false,
    };
    assume_degrees(&mut info);
    if bands > 1 {
        info.warnings.push(format!("the file has {bands} bands: the first is read"));
    }
    if bits == 16 && !names.contains_key("pixeltype") {
        info.warnings.push("the header names no type: taken as signed 16-bit".into());
    }
    info.nodata = value("nodata").or(value("nodata_value"));
    info.step = sample.step();
    // Old ARC/INFO projections have a line such as `Zunits  FEET`; newer headers may.
    let projection = input.sidecar_text("prj").unwrap_or_default().to_lowercase();
    let old_units = projection.lines().find_map(|line| line.trim().strip_prefix("zunits").map(|u| u.trim().to_owned()));
    if let Some(metres) =
        text("zunits").map(str::to_owned).or(old_units).and_then(|unit| crate::metres_of_unit_name(&unit))
    {
        info.vertical_metres = metres;
        info.step *= metres;
    }
    let rule = VoidRule { nodata: info.nodata, metres: info.vertical_metres, ..VoidRule::default() };
    Ok(Box::new(RawSource::new(input, info, layout, rule)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    #[test]
    fn second_byte_order_second_band_and_feet() {
        let header = "NROWS 2\nNCOLS 2\nNBANDS 2\nNBITS 16\nPIXELTYPE SIGNEDINT\nBYTEORDER M\nLAYOUT BIL\nSKIPBYTES 1\n\
                      ULXMAP 10\nULYMAP 50\nXDIM 2\nYDIM 4\nNODATA -1\nZUNITS feet\n";
        assert!(sniff_header(header));
        let numbers: [i16; 8] = [100, 200, 0, 0, -1, 400, 0, 0];
        let bytes = [0u8].into_iter().chain(numbers.iter().flat_map(|n| n.to_be_bytes())).collect();
        let mut source = open(Input::memory("a.bil", bytes), header).expect("opens");
        let all = source.read(0, Window { column: 0, row: 0, columns: 2, rows: 2 }).expect("reads");
        assert_eq!(all[..2], [30.48, 60.96]);
        assert!(all[2].is_nan());
        assert_eq!(all[3], 121.92);
        assert_eq!(source.info().georeference.geotransform, [9.0, 2.0, 0.0, 52.0, 0.0, -4.0]);
        assert_eq!(source.info().step, 0.3048);
    }

    #[test]
    fn grid_float_is_placed_from_the_south_west() {
        let header =
            "ncols 2\nnrows 3\nxllcorner 0\nyllcorner 100\ncellsize 10\nNODATA_value -9999\nbyteorder LSBFIRST\n";
        let bytes = (0..6).flat_map(|i| (i as f32).to_le_bytes()).collect();
        let source = open(Input::memory("a.flt", bytes), header).expect("opens");
        assert_eq!(source.info().georeference.geotransform, [0.0, 10.0, 0.0, 130.0, 0.0, -10.0]);
    }

    #[test]
    fn hostile_headers_are_errors() {
        for header in [
            "ncols 0\nnrows 3\n",
            "ncols 16000000\nnrows 16000000\nnbands 900000000000000\n",
            "ncols 2\nnrows 2\nnbits 17\n",
            "ncols 2\nnrows 2\nnbits 32\npixeltype complex\n",
            "ncols 2\nnrows 2\nnbits 16\nskipbytes 900000000000000\n",
            "ncols x\nnrows 2\n",
            "ncols 2\nnrows 2\nnbits 16\nbandrowbytes 900000000000000\nnbands 900000000000000",
        ] {
            assert!(open(Input::memory("a.bil", vec![0; 64]), header).is_err(), "{header}");
        }
    }
}
