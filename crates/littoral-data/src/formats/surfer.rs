//! Golden Software's Surfer grids: text (`DSAA`), Surfer 6 binary (`DSBB`) and Surfer 7 binary (`DSRB`). All run from the
//! south row by row, samples are points, and 1.70141e38 is blank.
//!
//! Golden Software, "Surfer 6 Grid File Format", "Surfer 7 Grid File Format".

use super::raw::{Layout, RawSource, SampleType, check_size};
use super::text::Tokens;
use super::{Input, assume_degrees, check_fits, crs_from_sidecar, info};
use crate::voids::VoidRule;
use crate::{Error, Georeference, Info, MemorySource, Registration, Source};

/// What these programs write where there is nothing; any number from here on.
const BLANK: f64 = 1.701_41e38;

/// Whether the file begins with one of the three marks.
pub fn sniff(head: &[u8]) -> bool {
    [b"DSAA", b"DSBB", b"DSRB"].iter().any(|mark| head.starts_with(*mark))
}

/// Opens such a file.
///
/// # Errors
/// If the header is broken or promises more samples than the file holds.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let mut mark = [0; 4];
    input.read_at(0, &mut mark)?;
    match &mark {
        b"DSAA" => open_text(input),
        b"DSBB" => open_6(input),
        _ => open_7(input),
    }
}

/// Places samples that run from `low` to `high` in both directions.
fn place(input: &Input, info: &mut Info, low: [f64; 2], high: [f64; 2]) -> Result<(), Error> {
    let [columns, rows] = [info.columns, info.rows];
    let step = |axis: usize, count: usize| (high[axis] - low[axis]) / (count.max(2) - 1) as f64;
    place_stepwise(input, info, low, [step(0, columns), step(1, rows)])
}

fn place_stepwise(input: &Input, info: &mut Info, low: [f64; 2], [dx, dy]: [f64; 2]) -> Result<(), Error> {
    if !(dx > 0.0 && dy > 0.0 && dx.is_finite() && dy.is_finite() && low[0].is_finite() && low[1].is_finite()) {
        return Err(input.error(format!(
            "expected samples that run east and north, got steps of {dx} and {dy}; the header is broken"
        )));
    }
    let top = low[1] + dy * (info.rows as f64 - 0.5);
    info.georeference = Georeference {
        geotransform: [low[0] - 0.5 * dx, dx, 0.0, top, 0.0, -dy],
        registration: Registration::Point,
        crs: crs_from_sidecar(input),
        size: [info.columns, info.rows],
        y_south: false,
    };
    info.nodata = Some(BLANK);
    assume_degrees(info);
    Ok(())
}

fn open_text(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let cut_off = input.error("expected nine numbers in the header, got fewer; the file is cut off");
    let length = input.length();
    let name = input.name.clone();
    let mut tokens = Tokens::new(&mut input, 4)?;
    let mut header = [0.0; 8];
    for number in &mut header {
        let Some(value) = tokens.next_number()? else { return Err(cut_off) };
        *number = value;
    }
    let [columns, rows, x_low, x_high, y_low, y_high, ..] = header;
    let whole = |v: f64| (1.0..=1e15).contains(&v) && v.fract() == 0.0;
    if !whole(columns) || !whole(rows) {
        return Err(Error::content(
            &name,
            format!("expected whole numbers of columns and rows, got {columns} × {rows}"),
        ));
    }
    let [columns, rows] = [columns as usize, rows as usize];
    let samples = super::check_size_fits(&name, length, columns, rows, length / 2)?;
    let mut heights = Vec::with_capacity(samples);
    while heights.len() < samples {
        let Some(value) = tokens.next_number()? else { break };
        heights.push(VoidRule::default().height(value));
    }
    let closed = tokens.closed;
    let mut info = info("GSAG", columns, rows);
    place(&input, &mut info, [x_low, y_low], [x_high, y_high])?;
    if heights.len() < samples {
        if !closed {
            heights.pop(); // The last number may have lost digits.
        }
        if heights.is_empty() {
            return Err(
                input.error(format!("expected {samples} values after the header, got none; the file is cut off"))
            );
        }
        info.warnings
            .push(format!("expected {samples} values, got {}: the rest, in the north, is void", heights.len()));
        heights.resize(samples, f32::NAN);
    }
    // From the north.
    for row in 0..rows / 2 {
        let (upper, lower) = heights.split_at_mut((rows - 1 - row) * columns);
        upper[row * columns..(row + 1) * columns].swap_with_slice(&mut lower[..columns]);
    }
    Ok(Box::new(MemorySource::new(info, heights)))
}

fn open_6(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let mut header = [0; 56];
    input.read_at(0, &mut header)?;
    let count = |at: usize| i16::from_le_bytes([header[at], header[at + 1]]).max(0) as usize;
    let [columns, rows] = [count(4), count(6)];
    let number = |at: usize| f64_at(&header, at);
    check_size(&input, columns as u64, rows as u64)?;
    let mut info = info("GSBG", columns, rows);
    place(&input, &mut info, [number(8), number(24)], [number(16), number(32)])?;
    let layout = Layout { south_first: true, ..Layout::plain(56, SampleType::F32, false, columns) };
    Ok(Box::new(RawSource::new(input, info, layout, VoidRule::default())?))
}

/// Surfer 7: sections with a mark and a length; `GRID` holds sizes and places, `DATA` the samples.
fn open_7(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let mut at = 0u64;
    let mut grid = None;
    // A few sections, in any order but the header first; fault information is left aside.
    for _ in 0..64 {
        let mut section = [0; 8];
        if at + 8 > input.length() {
            break;
        }
        input.read_at(at, &mut section)?;
        let size = u64::from(u32::from_le_bytes([section[4], section[5], section[6], section[7]]));
        at += 8;
        match &section[..4] {
            b"GRID" if size >= 72 => {
                let mut body = [0; 72];
                input.read_at(at, &mut body)?;
                grid = Some(body);
            }
            b"DATA" => {
                let Some(body) = grid else { break };
                return open_7_data(input, &body, at);
            }
            _ => {}
        }
        at += size;
    }
    Err(input.error("expected a GRID and a DATA section in a Surfer 7 grid, got none; it is cut off or damaged"))
}

fn open_7_data(input: Input, grid: &[u8; 72], offset: u64) -> Result<Box<dyn Source>, Error> {
    let count = |at: usize| u64::from(u32::from_le_bytes([grid[at], grid[at + 1], grid[at + 2], grid[at + 3]]));
    let [rows, columns] = [count(0), count(4)];
    let [x, y, dx, dy, _, _, rotation, blank] = std::array::from_fn(|i| f64_at(grid, 8 + 8 * i));
    check_size(&input, columns, rows)?;
    let mut info = info("GS7BG", columns as usize, rows as usize);
    check_fits(&input, info.columns, info.rows, input.length())?;
    place_stepwise(&input, &mut info, [x, y], [dx, dy])?;
    info.nodata = Some(blank);
    if rotation != 0.0 {
        info.warnings
            .push(format!("the grid says it is turned by {rotation}°, which Surfer does not use either: left aside"));
    }
    let layout = Layout { south_first: true, ..Layout::plain(offset, SampleType::F64, false, info.columns) };
    let rule = VoidRule { nodata: Some(blank), ..VoidRule::default() };
    Ok(Box::new(RawSource::new(input, info, layout, rule)?))
}

fn f64_at(bytes: &[u8], at: usize) -> f64 {
    bytes.get(at..at + 8).and_then(|b| b.first_chunk()).map_or(f64::NAN, |b| f64::from_le_bytes(*b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    fn read(bytes: Vec<u8>) -> Result<(Info, Vec<f32>), Error> {
        let mut source = open(Input::memory("t.grd", bytes))?;
        let info = source.info().clone();
        let all = source.read(0, Window { column: 0, row: 0, columns: info.columns, rows: info.rows })?;
        Ok((info, all))
    }

    fn text() -> Vec<u8> {
        b"DSAA\n3 2\n0 20\n100 105\n1 6\n1 2 3\n4 5 1.70141e38\n".to_vec()
    }

    fn binary_6() -> Vec<u8> {
        let mut bytes = b"DSBB".to_vec();
        [3i16, 2].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        [0.0, 20.0, 100.0, 105.0, 1.0, 6.0f64].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        [1.0, 2.0, 3.0, 4.0, 5.0, 1.70141e38f32].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        bytes
    }

    fn binary_7() -> Vec<u8> {
        let mut bytes = b"DSRB\x04\0\0\0\x01\0\0\0GRID\x48\0\0\0".to_vec();
        [2i32, 3].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        [0.0, 100.0, 10.0, 5.0, 1.0, 6.0, 0.0, -5.0f64].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        bytes.extend(b"DATA\x30\0\0\0");
        [1.0, 2.0, 3.0, 4.0, 5.0, -5.0f64].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        bytes
    }

    #[test]
    fn three_kinds_say_the_same() {
        for bytes in [text(), binary_6(), binary_7()] {
            assert!(sniff(&bytes));
            let (info, heights) = read(bytes).expect("reads");
            assert_eq!(info.georeference.geotransform, [-5.0, 10.0, 0.0, 107.5, 0.0, -5.0], "{}", info.format);
            assert_eq!(heights[..2], [4.0, 5.0]);
            assert!(heights[2].is_nan());
            assert_eq!(heights[3..], [1.0, 2.0, 3.0]);
        }
    }

    #[test]
    fn cut_off_or_hostile_ones_never_panic() {
        for whole in [text(), binary_6(), binary_7()] {
            for length in 0..whole.len() {
                if length >= 4 {
                    let _ = read(whole[..length].to_vec());
                }
            }
            for at in 4..whole.len() {
                for value in [0, 0x7F, 0xFF] {
                    let mut broken = whole.clone();
                    broken[at] = value;
                    let _ = read(broken);
                }
            }
        }
        assert!(read(b"DSAA\n99999 99999\n0 1 0 1 0 1\n1 2 3".to_vec()).is_err());
        assert!(read(b"DSAA\n2 2\n1 0 0 1 0 1\n1 2 3 4".to_vec()).is_err());
    }
}
