//! Points as they are typed, and as they stand in files: one a line.

use crate::input;
use crate::talk::Failure;
use glam::DVec2;
use rayon::prelude::*;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// A point and how it was written.
#[derive(Clone)]
pub struct Typed {
    /// Where it is.
    pub xy: DVec2,
    /// As it was written.
    pub text: String,
}

impl std::str::FromStr for Typed {
    type Err = String;

    fn from_str(text: &str) -> Result<Typed, String> {
        Ok(Typed { xy: input::xy(text)?, text: text.trim().to_owned() })
    }
}

/// Reads the points of a file, or of standard input for `-`, and hands them on in blocks of many.
pub fn stream(file: &Path, mut each: impl FnMut(Vec<Typed>) -> Result<(), Failure>) -> Result<(), Failure> {
    let standard = file == Path::new("-");
    let name = if standard { "standard input".to_owned() } else { file.display().to_string() };
    let reader: Box<dyn Read> = match standard {
        true => Box::new(std::io::stdin().lock()),
        false => Box::new(std::fs::File::open(file).map_err(|e| littoral_data::Error::io(file, e))?),
    };
    let mut reader = BufReader::with_capacity(1 << 20, reader);
    let (mut block, mut lines_before) = (Vec::new(), 0);
    loop {
        block.clear();
        let got = fill(&mut reader, &mut block).map_err(|e| Failure::Work(format!("{name}: {e}")))?;
        if got == 0 {
            return Ok(());
        }
        let lines: Vec<&[u8]> = block.strip_suffix(b"\n").unwrap_or(&block).split(|&b| b == b'\n').collect();
        let read = |(number, line): (usize, &&[u8])| -> Result<Option<Typed>, String> {
            let wrong = |got: &str| at_line(&name, lines_before + number, got);
            let text = std::str::from_utf8(line).map_err(|_| wrong("binary data"))?;
            let point = point(text).map_err(wrong)?;
            Ok(point.map(|xy| Typed { xy, text: comma_separated(text.trim()) }))
        };
        let typed: Result<Vec<Option<Typed>>, String> =
            lines.par_iter().enumerate().with_min_len(256).map(read).collect();
        each(typed.map_err(Failure::Work)?.into_iter().flatten().collect())?;
        lines_before += lines.len();
    }
}

/// At most about a mebibyte of whole lines.
fn fill(reader: &mut impl BufRead, block: &mut Vec<u8>) -> std::io::Result<usize> {
    // A line longer than this is no point.
    const LONGEST: u64 = 1 << 16;
    reader.by_ref().take(1 << 20).read_to_end(block)?;
    if block.last().is_some_and(|&b| b != b'\n') {
        reader.by_ref().take(LONGEST).read_until(b'\n', block)?;
    }
    Ok(block.len())
}

/// The point in a line; `None` for blank lines, comments and a header.
fn point(line: &str) -> Result<Option<DVec2>, &str> {
    let line = line.trim();
    if line.is_empty()
        || line.starts_with('#')
        || line.starts_with(|c: char| c.is_alphabetic()) && !line.starts_with(['n', 'N', 'i', 'I'])
    {
        return Ok(None);
    }
    let mut parts = line.split([',', ';', ' ', '\t']).filter(|part| !part.is_empty());
    let mut next = || parts.next().and_then(|part| part.parse::<f64>().ok()).filter(|n| n.is_finite());
    match (next(), next()) {
        (Some(x), Some(y)) => Ok(Some(DVec2::new(x, y))),
        _ => Err(line),
    }
}

/// A point's text with commas between its numbers.
fn comma_separated(line: &str) -> String {
    if line.contains([' ', '\t', ';']) {
        line.split([',', ';', ' ', '\t']).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(",")
    } else {
        line.to_owned()
    }
}

fn at_line(name: &str, line: usize, got: &str) -> String {
    let got: String = got.chars().take(60).collect();
    format!("{name}: line {}: expected X,Y, got \"{got}\"; correct or remove the line", line + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_points_or_skipped_or_wrong() {
        let at = |x, y| Ok(Some(DVec2::new(x, y)));
        assert_eq!(point("1,2"), at(1.0, 2.0));
        assert_eq!(point(" -1.5e3 \t 2 extra\r"), at(-1500.0, 2.0));
        assert_eq!(point("1;2"), at(1.0, 2.0));
        for skipped in ["", "  ", "# note", "x,y", "lon lat"] {
            assert_eq!(point(skipped), Ok(None), "{skipped}");
        }
        for wrong in ["1", "1,b", "nan,1", "inf,2", "?"] {
            assert_eq!(point(wrong), Err(wrong));
        }
        assert_eq!(comma_separated("1 \t2 3"), "1,2,3");
    }

    #[test]
    fn blocks_end_at_lines() {
        let text = "123456,789\n".repeat(300_000);
        let mut reader = BufReader::new(text.as_bytes());
        let (mut block, mut total) = (Vec::new(), 0);
        while fill(&mut reader, &mut block).expect("memory") > 0 {
            assert_eq!(block.last(), Some(&b'\n'));
            total += block.len();
            block.clear();
        }
        assert_eq!(total, text.len());
    }
}
