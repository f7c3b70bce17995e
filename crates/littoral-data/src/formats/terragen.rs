//! Terragen's `.ter`: chunks with a four-letter mark, little-endian. Heights are 16-bit steps of `scale / 65 536` about a base,
//! in units of the terrain, of which `SCAL` says how many metres they are (30 if nothing is said). Rows run from the south.
//!
//! Planetside, "Terragen .TER file format".

use super::raw::{Layout, RawSource, SampleType, check_size};
use super::{Input, info};
use crate::voids::VoidRule;
use crate::{Error, Georeference, Registration, Source};

const MARK: &[u8] = b"TERRAGENTERRAIN ";

/// Whether the file begins as such files do.
pub fn sniff(head: &[u8]) -> bool {
    head.starts_with(MARK)
}

/// Opens such a file.
///
/// # Errors
/// If it has no size or no heights, or an impossible size.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let mut at = MARK.len() as u64;
    let [mut size, mut x_points, mut y_points] = [None::<i16>; 3];
    let mut scale = [30.0f32; 3];
    // Seven kinds of chunks are known, each once; more than a few hundred is no terrain.
    for _ in 0..256 {
        let mut mark = [0; 4];
        if at + 4 > input.length() {
            break;
        }
        input.read_at(at, &mut mark)?;
        at += 4;
        let mut bytes = [0; 12];
        let body = match &mark {
            b"SCAL" => &mut bytes[..12],
            b"EOF " => break,
            _ => &mut bytes[..4],
        };
        if at + body.len() as u64 > input.length() {
            break;
        }
        input.read_at(at, body)?;
        let first = i16::from_le_bytes([body[0], body[1]]);
        let second = i16::from_le_bytes([body[2], body[3]]);
        at += body.len() as u64;
        match &mark {
            b"SIZE" => size = Some(first.saturating_add(1)),
            b"XPTS" => x_points = Some(first),
            b"YPTS" => y_points = Some(first),
            b"SCAL" => {
                for (axis, number) in scale.iter_mut().enumerate() {
                    *number = f32::from_le_bytes([
                        body[4 * axis],
                        body[4 * axis + 1],
                        body[4 * axis + 2],
                        body[4 * axis + 3],
                    ]);
                }
            }
            b"ALTW" => {
                let [columns, rows] = [x_points.or(size), y_points.or(size)].map(|n| i64::from(n.unwrap_or(0)));
                return open_heights(input, [columns, rows], scale, [first, second], at);
            }
            // Radius and kind of a planet's curve: one number each, read above.
            b"CRAD" | b"CRVM" => {}
            _ => break,
        }
    }
    Err(input.error("expected an ALTW chunk with heights, got none; the file is cut off or not a whole terrain"))
}

fn open_heights(
    input: Input,
    [columns, rows]: [i64; 2],
    scale: [f32; 3],
    [span, base]: [i16; 2],
    offset: u64,
) -> Result<Box<dyn Source>, Error> {
    if columns < 1 || rows < 1 {
        return Err(
            input.error(format!("expected 1 or more samples a side, got {columns} × {rows}; the header is broken"))
        );
    }
    check_size(&input, columns as u64, rows as u64)?;
    if !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
        return Err(input.error(format!("expected a scale above 0, got {scale:?}; the header is broken")));
    }
    let [dx, dy, metres] = scale.map(f64::from);
    let mut info = info("Terragen", columns as usize, rows as usize);
    info.georeference = Georeference {
        // As GDAL has it: places are counted from the north-west, and the south is where y grows.
        geotransform: [0.0, dx, 0.0, 0.0, 0.0, dy],
        registration: Registration::Point,
        ..Georeference::none(info.columns, info.rows)
    };
    let step = f64::from(span) / 65536.0;
    info.step = (step * metres).abs();
    // Every one of the 65 536 numbers is a height here.
    let rule = VoidRule { nodata: None, scale: step, offset: f64::from(base), metres, sentinels: false };
    let layout = Layout { south_first: true, ..Layout::plain(offset, SampleType::I16, false, info.columns) };
    Ok(Box::new(RawSource::new(input, info, layout, rule)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    fn terrain(altw: bool) -> Vec<u8> {
        let mut bytes = MARK.to_vec();
        bytes.extend(b"SIZE\x01\0\0\0XPTS\x03\0\0\0YPTS\x02\0\0\0SCAL");
        [10.0f32, 10.0, 2.0].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        if altw {
            bytes.extend(b"ALTW");
            [100i16, 50, -32768, 0, 16384, 1, 2, 3].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
            bytes.extend(b"EOF ");
        }
        bytes
    }

    #[test]
    fn heights_are_steps_about_a_base_and_none_is_void() {
        let mut source = open(Input::memory("t.ter", terrain(true))).expect("opens");
        let all = source.read(0, Window { column: 0, row: 0, columns: 3, rows: 2 }).expect("reads");
        let height = |raw: f64| ((50.0 + raw * 100.0 / 65536.0) * 2.0) as f32;
        assert_eq!(all, [1.0, 2.0, 3.0, -32768.0, 0.0, 16384.0].map(height));
        assert_eq!(all[3], 0.0);
        assert_eq!(source.info().georeference.geotransform, [0.0, 10.0, 0.0, 0.0, 0.0, 10.0]);
    }

    #[test]
    fn what_is_missing_is_named() {
        let error = |bytes| open(Input::memory("t.ter", bytes)).err().expect("fails").to_string();
        assert!(error(terrain(false)).contains("no") && error(terrain(false)).contains("ALTW"));
        let mut negative = terrain(true);
        negative[28] = 0x00;
        negative[29] = 0x80;
        assert!(error(negative).contains("-32768"));
        for length in 16..terrain(true).len() {
            let _ = open(Input::memory("t.ter", terrain(true)[..length].to_vec()));
        }
    }
}
