//! Samples without any header: `.r16`, `.r32`, `.raw` and the like, as terrain editors write them. The size is taken from the
//! name (`land_160x120.r16`) or, if the number of samples is a square, from that; the type from the extension, the name
//! (`u16le`) or the length. What was assumed is said in a warning.

use super::raw::{Layout, RawSource, SampleType};
use super::{Input, check_fits, info};
use crate::voids::VoidRule;
use crate::{Error, Source};

/// Whether the name is one of such files'.
pub fn sniff(input: &Input) -> bool {
    let name = input.lower_name();
    matches!(name.rsplit_once('.').map(|(_, e)| e), Some("r8" | "r16" | "r32" | "raw" | "u16" | "i16" | "s16" | "f32"))
}

/// Opens such a file.
///
/// # Errors
/// If neither the name nor the length tells its size.
pub fn open(input: Input) -> Result<Box<dyn Source>, Error> {
    let name = input.lower_name();
    let length = input.length();
    let (named_type, big_endian) = sample_type(&name);
    let named_size = size(&name);
    let guess = |samples: u64| match length.checked_div(samples).filter(|bytes| bytes * samples == length) {
        Some(1) => Some(SampleType::U8),
        Some(2) => Some(SampleType::U16),
        Some(4) => Some(SampleType::F32),
        _ => None,
    };
    let square = |sample: SampleType| {
        let side = (length / sample.bytes()).isqrt();
        (side > 1 && side * side * sample.bytes() == length).then_some((sample, [side, side]))
    };
    let found = match (named_type, named_size) {
        (Some(sample), Some([c, r])) => (c * r * sample.bytes() == length).then_some((sample, [c, r])),
        (None, Some([c, r])) => guess(c * r).map(|sample| (sample, [c, r])),
        (Some(sample), None) => square(sample),
        (None, None) => square(SampleType::U16).or(square(SampleType::F32)).or(square(SampleType::U8)),
    };
    let Some((sample, [columns, rows])) = found else {
        return Err(input.error(format!(
            "expected raw samples whose size is in the name, such as land_160x120.r16, or that form a square, got {length} bytes; \
             put the size into the name or an ENVI header beside it"
        )));
    };
    let mut info = info("raw", columns as usize, rows as usize);
    check_fits(&input, info.columns, info.rows, length)?;
    info.step = sample.step();
    let order = if big_endian { "big" } else { "little" };
    info.warnings.push(format!(
        "a file without a header: assumed to be {columns} × {rows} samples of type {sample:?}, {order}-endian, in metres, from \
         the north-west, one metre apart"
    ));
    let layout = Layout::plain(0, sample, big_endian, info.columns);
    Ok(Box::new(RawSource::new(input, info, layout, VoidRule::default())?))
}

/// The type and whether it is big-endian, from words of the name such as `u16le` or from the extension.
fn sample_type(name: &str) -> (Option<SampleType>, bool) {
    let mut found = (None, false);
    for word in name.split(|c: char| !c.is_ascii_alphanumeric()) {
        let (word, big) = match (word.strip_suffix("be"), word.strip_suffix("le")) {
            (Some(word), _) => (word, true),
            (_, Some(word)) => (word, false),
            _ => (word, false),
        };
        let sample = match word {
            "u8" | "r8" => SampleType::U8,
            "u16" | "r16" => SampleType::U16,
            "i16" | "s16" => SampleType::I16,
            "u32" => SampleType::U32,
            "i32" | "s32" => SampleType::I32,
            "f32" | "r32" => SampleType::F32,
            "f64" => SampleType::F64,
            _ => continue,
        };
        // The first word wins: an extension such as `r16` only says the width.
        if found.0.is_none() {
            found = (Some(sample), big);
        }
    }
    found
}

/// `160x120` anywhere in the name.
fn size(name: &str) -> Option<[u64; 2]> {
    name.match_indices('x').find_map(|(at, _)| {
        let digits = |text: &str| (!text.is_empty() && text.len() < 9).then(|| text.parse::<u64>().ok()).flatten();
        let before = name[..at].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |end| end + 1);
        let after = name[at + 1..].find(|c: char| !c.is_ascii_digit()).map_or(name.len(), |n| at + 1 + n);
        // A letter before the digits is the end of another word: `land160x120` is fine, `0x120` has no size.
        let [columns, rows] = [digits(name.get(before..at)?)?, digits(&name[at + 1..after])?];
        (columns > 1 && rows > 1).then_some([columns, rows])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    #[test]
    fn names_are_read() {
        assert_eq!(size("raw_u16le_160x120.r16"), Some([160, 120]));
        assert_eq!(size("land.r16"), None);
        assert_eq!(size("0x1.raw"), None);
        assert_eq!(size("näx2x3é.raw"), Some([2, 3]));
        assert_eq!(sample_type("a_i16be_2x2.raw"), (Some(SampleType::I16), true));
        assert_eq!(sample_type("table.r32"), (Some(SampleType::F32), false));
    }

    #[test]
    fn squares_are_guessed_and_others_refused() {
        let bytes: Vec<u8> = (0..9u16).flat_map(|n| n.to_le_bytes()).collect();
        let mut source = open(Input::memory("land.r16", bytes.clone())).expect("a square");
        let all = source.read(0, Window { column: 0, row: 1, columns: 3, rows: 1 }).expect("reads");
        assert_eq!(all, [3.0, 4.0, 5.0]);
        assert!(source.info().warnings[0].contains("3 × 3"));
        assert!(open(Input::memory("land.r16", bytes[..16].to_vec())).is_err());
        assert!(open(Input::memory("land_2x4.r16", bytes[..16].to_vec())).is_ok());
        assert!(open(Input::memory("land_99999999x99999999.r16", bytes)).is_err());
    }
}
