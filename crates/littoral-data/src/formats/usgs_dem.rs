//! USGS ASCII DEM (and Canada's CDED): a header record A, then one record B for each profile, which runs from south to north.
//! Profiles begin at their own northing and have their own length, because quadrangles are turned against the grid: the
//! collar is void. Records are padded to 1024 bytes, with or without line ends; fields are found by reading on, as GDAL does.
//!
//! USGS, "Standards for Digital Elevation Models, Part 2: Specifications". 1998 (and the older layout, which ends at byte
//! 864).

use super::text::number;
use super::{Input, check_fits, info};
use crate::voids::VoidRule;
use crate::{Crs, Error, Georeference, MemorySource, Registration, Source, VerticalDatum};
use std::io::{BufRead, BufReader, Seek, SeekFrom};

/// Length of the old header: what both layouts have in common.
const HEADER: usize = 864;

const FOOT: f64 = 0.3048;

/// Whether the first bytes have whole numbers in the columns of such a header, within their small ranges.
pub fn sniff(head: &[u8]) -> bool {
    let Some(record) = head.get(..HEADER) else { return false };
    let within = |at: usize, low: i64, high: i64| whole(record, at).is_some_and(|n| (low..=high).contains(&n));
    within(156, 0, 20) && within(528, 0, 3) && within(534, 1, 2) && within(540, 3, 4) && within(858, 1, 1 << 24)
}

/// Opens such a file.
///
/// # Errors
/// If the header is broken, promises more than the file can hold, or no profile can be read.
pub fn open(mut input: Input) -> Result<Box<dyn Source>, Error> {
    let record = input.head(1030)?;
    if !sniff(&record) {
        return Err(
            input.error("expected the header of a USGS DEM, got other numbers; it is cut off or another format")
        );
    }
    let real = |at: usize, width: usize| {
        let field = record.get(at..at + width).and_then(|f| std::str::from_utf8(f).ok()).and_then(|f| number(f.trim()));
        field
            .filter(|v| v.is_finite())
            .ok_or_else(|| input.error(format!("expected a number at byte {at} of the header")))
    };
    let system = whole(&record, 156).unwrap_or(0);
    let ground_unit = whole(&record, 528).unwrap_or(2);
    let height_unit = if whole(&record, 534) == Some(1) { FOOT } else { 1.0 };
    let profiles = whole(&record, 858).unwrap_or(0) as usize;
    let [dx, dy, dz] = [real(816, 12)?, real(828, 12)?, real(840, 12)?];
    if !(dx > 0.0 && dy > 0.0 && dz != 0.0) {
        return Err(input.error(format!("expected resolutions above 0, got {dx} × {dy} × {dz}; the header is broken")));
    }
    // Corners SW, NW, NE, SE. Rows lie on whole multiples of the spacing, unless in degrees, where the corners are exact.
    let corners: Result<Vec<f64>, Error> = (0..8).map(|i| real(546 + 24 * i, 24)).collect();
    let corners = corners?;
    let [low, high] = [corners[1].min(corners[7]), corners[3].max(corners[5])];
    let [low, high] = match system {
        0 => [low, high],
        _ => [(low / dy).floor() * dy, (high / dy).ceil() * dy],
    };
    let rows = ((high - low) / dy + 1.5).floor();
    if !(1.0..1e9).contains(&rows) {
        return Err(input.error(format!("expected corners that span rows, got {low} … {high}; the header is broken")));
    }
    let rows = rows as usize;
    // A sample takes six bytes; collars and profiles cut off take none, but not most of a large raster.
    let samples = check_fits(&input, profiles, rows, input.length() + (1 << 20))?;

    let mut info = info("USGSDEM", profiles, rows);
    info.nodata = Some(-32767.0);
    info.vertical_metres = height_unit;
    info.step = (dz * height_unit).abs();
    let horizontal = whole_of(&record, 890, 2);
    info.vertical_datum = match whole_of(&record, 888, 2) {
        Some(1) => VerticalDatum::Named("local mean sea level".into()),
        Some(2) => VerticalDatum::Named("NGVD29".into()),
        Some(3) => VerticalDatum::Named("NAVD88".into()),
        _ => VerticalDatum::Unknown,
    };
    let rule = VoidRule { nodata: info.nodata, metres: height_unit, scale: dz, ..VoidRule::default() };
    let mut heights = vec![f32::NAN; samples];
    let mut west = None;
    let mut read = 0;
    let mut fields = Fields::new(&mut input, data_offset(&record))?;
    for _ in 0..profiles {
        let Some(profile) = fields.profile()? else { break };
        west = west.or(Some(profile.x - (profile.column - 1) as f64 * dx));
        let bottom = ((high - profile.y) / dy).round();
        for index in 0..profile.count {
            let Some(raw) = fields.whole()? else { break };
            let row = bottom - index as f64;
            if (1..=profiles as i64).contains(&profile.column) && row >= 0.0 && row < rows as f64 {
                // The profile's own base is added after scaling: it is in the unit of heights.
                let rule = VoidRule { offset: profile.base, ..rule };
                heights[row as usize * profiles + profile.column as usize - 1] = rule.height(raw as f64);
            }
        }
        read += 1;
    }
    if read == 0 {
        return Err(input.error("expected profiles after the header, got none; the file is cut off"));
    }
    if read < profiles || fields_ended_early(&heights, profiles) {
        info.warnings
            .push(format!("expected {profiles} whole profiles, got {read}: the file is cut off, the rest is void"));
    }
    let west = west.unwrap_or(0.0);
    // Arc seconds for degrees.
    let unit = if system == 0 && ground_unit == 3 { 3600.0 } else { 1.0 };
    let [x, y, step_x, step_y] = [(west - 0.5 * dx) / unit, (high + 0.5 * dy) / unit, dx / unit, dy / unit];
    info.georeference = Georeference {
        geotransform: [x, step_x, 0.0, y, 0.0, -step_y],
        registration: Registration::Point,
        crs: crs(system, whole(&record, 162).unwrap_or(0), horizontal, if ground_unit == 1 { FOOT } else { 1.0 }),
        size: [profiles, rows],
        y_south: false,
    };
    Ok(Box::new(MemorySource::new(info, heights)))
}

/// Whether the last profile, which a cut-off file may have left unfinished, is all void.
fn fields_ended_early(heights: &[f32], columns: usize) -> bool {
    heights.iter().skip(columns - 1).step_by(columns).all(|h| h.is_nan())
}

fn crs(system: i64, zone: i64, horizontal: Option<i64>, metres: f64) -> Crs {
    let (datum, geographic, utm) = match horizontal {
        Some(2) => ("WGS 72", 4322, 32200),
        Some(3) => ("WGS 84", 4326, 32600),
        Some(4) => ("NAD83", 4269, 26900),
        _ => ("NAD27", 4267, 26700),
    };
    match (system, u32::try_from(zone)) {
        (0, _) => Crs::from_epsg(geographic).unwrap_or(Crs::Geographic { name: format!("EPSG:{geographic}") }),
        (1, Ok(zone @ 1..=60)) if metres == 1.0 => Crs::from_epsg(utm + zone).unwrap_or(Crs::Projected {
            name: format!("{datum} / UTM zone {zone}N"),
            metres,
            definition: None,
        }),
        (1, _) => Crs::Projected { name: format!("{datum} / UTM"), metres, definition: None },
        _ => Crs::Projected { name: format!("{datum} / system {system} zone {zone}"), metres, definition: None },
    }
}

/// A whole number of six columns.
fn whole(record: &[u8], at: usize) -> Option<i64> {
    whole_of(record, at, 6)
}

fn whole_of(record: &[u8], at: usize, width: usize) -> Option<i64> {
    std::str::from_utf8(record.get(at..at + width)?).ok()?.trim().parse().ok()
}

/// Where the profiles begin: after 1024 bytes and perhaps a line end, or, in the oldest files, after 864.
fn data_offset(record: &[u8]) -> u64 {
    // A profile begins with its row and column, both small numbers above nothing.
    let begins = |at: usize| whole(record, at).is_some_and(|n| n > 0);
    let offsets = [1024, 1025, 1026, 864, 865, 866];
    offsets.into_iter().find(|&at| begins(at)).unwrap_or(if record.len() > 1024 { 1024 } else { 864 }) as u64
}

struct Profile {
    column: i64,
    count: i64,
    x: f64,
    y: f64,
    base: f64,
}

/// Reads on from field to field, over padding and line ends.
struct Fields<'a> {
    reader: BufReader<&'a mut Input>,
}

impl<'a> Fields<'a> {
    fn new(input: &'a mut Input, offset: u64) -> Result<Fields<'a>, Error> {
        let name = input.name.clone();
        let mut reader = input.from_start()?;
        reader.seek(SeekFrom::Start(offset)).map_err(|e| Error::io(&name, e))?;
        Ok(Fields { reader })
    }

    fn peek(&mut self) -> Result<Option<u8>, Error> {
        match self.reader.fill_buf() {
            Ok(buffer) => Ok(buffer.first().copied()),
            Err(e) => Err(Error::io(&self.reader.get_ref().name, e)),
        }
    }

    fn skip_space(&mut self) -> Result<(), Error> {
        while self.peek()?.is_some_and(|b| b.is_ascii_whitespace() || b == 0) {
            self.reader.consume(1);
        }
        Ok(())
    }

    /// A whole number; the next one's sign ends it too, for fields of six columns touch where all are filled. `None` at the
    /// end of the file.
    fn whole(&mut self) -> Result<Option<i64>, Error> {
        self.skip_space()?;
        let negative = match self.peek()? {
            None => return Ok(None),
            Some(sign @ (b'-' | b'+')) => {
                self.reader.consume(1);
                sign == b'-'
            }
            Some(_) => false,
        };
        let [mut value, mut digits] = [0i64; 2];
        while let Some(digit) = self.peek()?.filter(u8::is_ascii_digit) {
            value = (value * 10 + i64::from(digit - b'0')).min(i64::from(i32::MAX));
            digits += 1;
            self.reader.consume(1);
        }
        if digits == 0 {
            let got = self.peek()?.map_or("the end".into(), |b| format!("{:?}", b as char));
            return Err(self
                .reader
                .get_ref()
                .error(format!("expected whole numbers in the profiles, got {got}; the file is damaged")));
        }
        Ok(Some(if negative { -value } else { value }))
    }

    fn real(&mut self) -> Result<Option<f64>, Error> {
        self.skip_space()?;
        let mut word = Vec::with_capacity(24);
        while let Some(byte) = self.peek()?.filter(|b| !b.is_ascii_whitespace() && *b != 0) {
            word.push(byte);
            self.reader.consume(1);
            if word.len() == 24 {
                break;
            }
        }
        if word.is_empty() {
            return Ok(None);
        }
        let value = std::str::from_utf8(&word).ok().and_then(number).filter(|v| v.is_finite());
        value.map(Some).ok_or_else(|| {
            let got = String::from_utf8_lossy(&word).into_owned();
            self.reader
                .get_ref()
                .error(format!("expected a number at the head of a profile, got {got:?}; the file is damaged"))
        })
    }

    /// The head of the next profile: its row, column, count, 1, place, base, lowest and highest height. `None` at the end.
    fn profile(&mut self) -> Result<Option<Profile>, Error> {
        // Some files end in a record C, of statistics, or in padding: neither is a profile.
        let (Some(_), Some(column), Some(count), Some(_)) =
            (self.whole()?, self.whole()?, self.whole()?, self.whole()?)
        else {
            return Ok(None);
        };
        let (Some(x), Some(y), Some(base), Some(_), Some(_)) =
            (self.real()?, self.real()?, self.real()?, self.real()?, self.real()?)
        else {
            return Ok(None);
        };
        Ok(Some(Profile { column, count, x, y, base }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use littoral::field::Window;

    fn dem(unit: u8, profiles: &[(f64, &[i32])]) -> Vec<u8> {
        let mut a = vec![b' '; 1024];
        let mut put = |at: usize, text: String| a[at..at + text.len()].copy_from_slice(text.as_bytes());
        for (at, n) in [(144, 1), (150, 1), (156, 1), (162, 10), (528, 2), (534, i64::from(unit)), (540, 4), (852, 1)] {
            put(at, format!("{n:6}"));
        }
        put(858, format!("{:6}", profiles.len()));
        for (i, corner) in [500.0, 995.0, 500.0, 1031.0, 530.0, 1031.0, 530.0, 999.0].iter().enumerate() {
            put(546 + 24 * i, format!("{corner:24.15}"));
        }
        for i in 0..3 {
            put(816 + 12 * i, format!("{:>12}", ["0.100000E+02", "0.100000E+02", "0.100000E+01"][i]));
        }
        for (column, (y, samples)) in profiles.iter().enumerate() {
            let mut b = format!("{:6}{:6}{:6}{:6}", 1, column + 1, samples.len(), 1);
            for number in [500.0 + 10.0 * column as f64, *y, 0.0, 1.0, 9.0] {
                b += &format!("{:>24}", format!("{number:.6}D+00"));
            }
            samples.iter().for_each(|s| b += &format!("{s:6}"));
            a.extend(format!("{b:1024}").bytes());
        }
        a
    }

    #[test]
    fn profiles_of_unequal_length_leave_a_collar() {
        let bytes = dem(1, &[(1000.0, &[100, 200, 300]), (1010.0, &[400, -32767, 600]), (990.0, &[7])]);
        assert!(sniff(&bytes));
        let mut source = open(Input::memory("t.dem", bytes)).expect("opens");
        let info = source.info().clone();
        // 990 … 1040 in steps of ten.
        assert_eq!([info.columns, info.rows], [3, 6]);
        assert_eq!(info.georeference.geotransform, [495.0, 10.0, 0.0, 1045.0, 0.0, -10.0]);
        let all = source.read(0, Window { column: 0, row: 0, columns: 3, rows: 6 }).expect("reads");
        let feet = |column: usize, y: usize| all[(1040 - y) / 10 * 3 + column] / 0.3048;
        assert!((feet(0, 1000) - 100.0).abs() < 1e-4 && (feet(0, 1020) - 300.0).abs() < 1e-4);
        assert!((feet(1, 1010) - 400.0).abs() < 1e-4 && feet(1, 1020).is_nan() && (feet(1, 1030) - 600.0).abs() < 1e-4);
        assert!((feet(2, 990) - 7.0).abs() < 1e-4);
        assert_eq!(all.iter().filter(|h| h.is_nan()).count(), 18 - 6);
    }

    #[test]
    fn cut_off_ones_are_partial_and_say_so() {
        let bytes = dem(2, &[(1000.0, &[100, 200, 300]), (1010.0, &[400, 500, 600])]);
        let cut = open(Input::memory("t.dem", bytes[..2048].to_vec())).expect("one profile");
        assert!(cut.info().warnings[0].contains("got 1"));
        assert!(open(Input::memory("t.dem", bytes[..1024].to_vec())).is_err());
        for length in (800..bytes.len()).step_by(7) {
            let _ = open(Input::memory("t.dem", bytes[..length].to_vec()));
        }
    }
}
