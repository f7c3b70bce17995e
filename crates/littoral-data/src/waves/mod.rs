//! Spectra of the sea that buoys measured, by time, ready to become a sea state.
//!
//! ```no_run
//! use littoral::waves::{SeaState, Train};
//! use littoral_data::waves::{Buoy, probable_wind};
//!
//! let buoy = Buoy::open("41010.data_spec".as_ref())?;
//! let record = buoy.record(buoy.count() - 1)?; // the latest
//! let wind = probable_wind(&record.measured);
//! let state = SeaState { trains: vec![Train::Measured(record.measured)], wind, ..SeaState::CALM };
//! # Ok::<(), littoral_data::Error>(())
//! ```

mod ndbc;
mod time;

use crate::Error;
use littoral::waves::{Band, Measured, STANDARD_GRAVITY, Wind};
use ndbc::{Kind, Table};
use std::f64::consts::TAU;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
pub use time::Time;

/// A year of spectra every ten minutes takes some 25 MB; what is longer, packed or unpacked, is something else (bytes).
const LONGEST: u64 = 64 << 20;

/// Two files mean the same frequency if they agree to this (Hz): they round to a thousandth.
const SAME_FREQUENCY: f64 = 6e-4;

/// Bands without a direction are worth a note if they hold more than this part of the energy.
const WORTH_A_NOTE: f64 = 0.01;

/// What one buoy measured: a file of energy densities, and four of directions if they are there.
///
/// The files are held as text, and a record is read when it is asked for: one broken line spoils only its own.
pub struct Buoy {
    densities: Table,
    /// α₁, α₂, r₁, r₂.
    directions: [Option<Table>; 4],
    warnings: Vec<String>,
}

/// What a buoy measured at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// When (UTC).
    pub time: Time,
    /// Energy by frequency, each with its directions.
    pub measured: Measured,
    /// What is missing in it and what was taken instead. One sentence each.
    pub notes: Vec<String>,
}

impl Buoy {
    /// Opens NDBC's files of one station: real-time ones, of which `file` is any of `.data_spec .swdir .swdir2 .swr1 .swr2`, or
    /// historical ones, of which it is any of `…w2019…`, `…d2019…`, `…i…`, `…j…`, `…k…`. The others are found beside it by name, all with or
    /// without `.gz`; where files of directions are missing, [`Buoy::warnings`] says so.
    ///
    /// # Errors
    /// If a file cannot be read, is none of these, or has a broken header or time, or if no densities are found.
    pub fn open(file: &Path) -> Result<Buoy, Error> {
        let bytes = read(file)?;
        let named = ndbc::companions(file);
        let table = Table::read(file, bytes, named.as_ref().map(|(kind, _)| *kind))?;
        // Of a historical file only the name tells what it holds, of a real-time one its content.
        let companions = named.map(|(_, companions)| companions);
        let mut tables = vec![table];
        for kind in Kind::ALL {
            if tables[0].kind == kind {
                continue;
            }
            let beside = companions.as_ref().and_then(|c| c[kind as usize].iter().find(|path| path.is_file()));
            if let Some(path) = beside {
                tables.push(Table::read(path, read(path)?, Some(kind))?);
            }
        }
        Buoy::of_tables(file, tables)
    }

    /// The same from files in memory under their names, the one of densities among them.
    ///
    /// # Errors
    /// As [`Buoy::open`].
    pub fn from_memory(files: Vec<(PathBuf, Vec<u8>)>) -> Result<Buoy, Error> {
        let main = files.first().map(|(name, _)| name.clone()).unwrap_or_default();
        let read = |(name, bytes): (PathBuf, Vec<u8>)| {
            let kind = ndbc::companions(&name).map(|(kind, _)| kind);
            Table::read(&name, unpacked(&name, bytes)?, kind)
        };
        let tables: Vec<Table> = files.into_iter().map(read).collect::<Result<_, _>>()?;
        Buoy::of_tables(&main, tables)
    }

    fn of_tables(main: &Path, tables: Vec<Table>) -> Result<Buoy, Error> {
        let mut slots: [Option<Table>; 5] = Default::default();
        for table in tables {
            let slot = &mut slots[table.kind as usize];
            if let Some(other) = slot {
                let problem =
                    format!("expected one file of {}s, got {}, too; leave one out", table.kind, table.name.display());
                return Err(Error::content(&other.name, problem));
            }
            *slot = Some(table);
        }
        let [densities, first, second, r1, r2] = slots;
        let Some(mut densities) = densities else {
            let problem = "expected NDBC's file of energy densities beside it (.data_spec, or …w2019.txt), got none; fetch it, too";
            return Err(Error::content(main, problem));
        };
        let mut warnings = std::mem::take(&mut densities.warnings);
        let mut directions = [first, second, r1, r2];
        warnings.extend(directions.iter_mut().flatten().flat_map(|table| std::mem::take(&mut table.warnings)));
        let name = densities.name.display();
        if directions[0].is_none() || directions[2].is_none() {
            directions = Default::default();
            warnings.push(format!(
                "{name}: no files of directions beside it (.swdir and .swr1, or …d2019 and …j2019): its waves are taken to come from all round"
            ));
        } else if directions[1].is_none() || directions[3].is_none() {
            directions[1] = None;
            directions[3] = None;
            warnings.push(format!(
                "{name}: no second files of directions beside it (.swdir2 and .swr2, or …i2019 and …k2019): taken as a cos²ˢ spreading has them"
            ));
        }
        Ok(Buoy { densities, directions, warnings })
    }

    /// What was noticed while opening. One sentence each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// How many records there are, at least 1.
    pub fn count(&self) -> usize {
        self.densities.rows.len()
    }

    /// When a record was measured (UTC). Records are in the order of time.
    ///
    /// # Panics
    /// If there is no such record.
    pub fn time(&self, index: usize) -> Time {
        self.densities.rows[index].time
    }

    /// The record nearest to a time.
    pub fn nearest(&self, time: Time) -> usize {
        let rows = &self.densities.rows;
        let after = rows.partition_point(|row| row.time < time).min(rows.len() - 1);
        let before = after.saturating_sub(1);
        let far = |index: usize| (rows[index].time.minutes() - time.minutes()).abs();
        if far(before) < far(after) { before } else { after }
    }

    /// What was measured, by index in the order of time. Frequencies without a density are left out; those without a direction come from
    /// all round; those without second coefficients get what a cos²ˢ spreading of the same r₁ has.
    ///
    /// # Errors
    /// If its line is broken in one of the files, or fewer than two frequencies have a density.
    ///
    /// # Panics
    /// If there is no such record.
    pub fn record(&self, index: usize) -> Result<Record, Error> {
        let row = &self.densities.rows[index];
        let name = self.densities.name.display();
        let densities = self.densities.values(row)?;
        let mut notes = Vec::new();
        let mut beside: [Vec<(f64, Option<f64>)>; 4] = Default::default();
        for (values, table) in beside.iter_mut().zip(&self.directions) {
            let Some(table) = table else { continue };
            match table.row_at(row.time) {
                Some(row) => *values = table.values(row)?,
                None => notes.push(format!("{}: no record of {}", table.name.display(), row.time)),
            }
        }
        let at = |values: &[(f64, Option<f64>)], frequency: f64| {
            let near = values.partition_point(|(f, _)| *f < frequency - SAME_FREQUENCY);
            values.get(near).filter(|(f, _)| *f < frequency + SAME_FREQUENCY).and_then(|(_, value)| *value)
        };
        let mut bands = Vec::with_capacity(densities.len());
        let (mut all, mut without) = (0.0, 0.0);
        for &(frequency, density) in &densities {
            let Some(density) = density else { continue };
            let [mean, principal, r1, r2] = std::array::from_fn(|i| at(&beside[i], frequency));
            all += density;
            let band = match (mean, r1) {
                (Some(mean), Some(r1)) => {
                    // cos²ˢ has r₁ = s / (s + 1) and r₂ = s (s − 1) / ((s + 1)(s + 2)).
                    let usual = r1 * (2.0 * r1 - 1.0) / (2.0 - r1);
                    let (principal, r2) = principal.zip(r2).unwrap_or((mean, usual));
                    Band::of_bearings(frequency, density, mean.to_radians(), principal.to_radians(), r1, r2)
                }
                _ => {
                    without += density;
                    Band { frequency, density, first: [0.0; 2], second: [0.0; 2] }
                }
            };
            bands.push(band);
        }
        let missing = densities.len() - bands.len();
        if bands.len() >= 2 && missing > 0 {
            let of = densities.len();
            notes.push(format!("{name}: {missing} of {of} frequencies have no density at {}: left out", row.time));
        }
        if self.directions[0].is_some() && without > WORTH_A_NOTE * all {
            let part = 100.0 * without / all;
            notes.push(format!(
                "{name}: {part:.0} % of the energy has no direction at {}: taken to come from all round",
                row.time
            ));
        }
        let count = bands.len();
        let measured = Measured::new(bands).map_err(|error| {
            let found = if count < 2 { format!("densities at {count}") } else { error.to_string() };
            let problem = format!("expected densities at 2 frequencies or more, got {found}; choose another record");
            self.densities.error(row.line, &problem)
        })?;
        Ok(Record { time: row.time, measured, notes })
    }
}

/// The wind (m/s at 10 m) that a measured sea tells of, from the range where the spectrum falls with f⁻⁴ in balance with the wind:
/// S(f) = 4 β I g u* (2π)⁻³ f⁻⁴ with β = 0.012, I = 2.5 (J. Thomson et al., "Waves and the equilibrium range at Ocean Weather Station P",
/// J. Geophys. Res. 118, 2013), and a logarithmic profile over H. Charnock's roughness 0.012 u*² / g. Its heading is the mean one of that
/// range; 0 for a flat sea. An estimate: full-grown Pierson–Moskowitz seas of 5, 10 and 20 m/s give 6.1, 10.8 and 18.8 m/s.
pub fn probable_wind(measured: &Measured) -> Wind {
    let bands = measured.bands();
    let level = |band: &Band| band.density * band.frequency.powi(4);
    let Some(top) = bands.iter().max_by(|a, b| level(a).total_cmp(&level(b))) else {
        return Wind { speed: 0.0, heading: 0.0 };
    };
    // The middle of these: the peak of a young sea stands out of the range, noise and rounding hide its end.
    let within = |band: &&Band| band.frequency >= 0.67 * top.frequency && band.frequency <= 1.5 * top.frequency;
    let mut range: Vec<&Band> = bands.iter().filter(within).collect();
    let sum = range.iter().fold([0.0, 0.0], |sum, band| [0, 1].map(|i| sum[i] + level(band) * band.first[i]));
    range.sort_by(|a, b| level(a).total_cmp(&level(b)));
    let friction = level(range[range.len() / 2]) * TAU.powi(3) / (4.0 * 0.012 * 2.5 * STANDARD_GRAVITY);
    if friction < 1e-3 {
        return Wind { speed: 0.0, heading: 0.0 };
    }
    let roughness = 0.012 * friction * friction / STANDARD_GRAVITY;
    let speed = friction / 0.4 * (10.0 / roughness).max(1.0).ln();
    Wind { speed: speed.clamp(0.0, 60.0), heading: sum[1].atan2(sum[0]) }
}

/// A file's bytes, unpacked.
fn read(file: &Path) -> Result<Vec<u8>, Error> {
    // Asked before opening: opening a pipe would wait for its other end.
    let metadata = std::fs::metadata(file).map_err(|e| Error::io(file, e))?;
    if !metadata.is_file() {
        let got = if metadata.is_dir() { "folder" } else { "pipe or device" };
        return Err(Error::content(file, format!("expected a file of a buoy, got a {got}; name a file")));
    }
    if metadata.len() > LONGEST {
        return Err(too_long(file, metadata.len()));
    }
    let mut bytes = Vec::new();
    let read = File::open(file).and_then(|opened| opened.take(LONGEST).read_to_end(&mut bytes));
    read.map_err(|e| Error::io(file, e))?;
    unpacked(file, bytes)
}

fn unpacked(file: &Path, bytes: Vec<u8>) -> Result<Vec<u8>, Error> {
    if !crate::formats::archive::is_gzip(&bytes) {
        return Ok(bytes);
    }
    let mut text = Vec::new();
    let unpacking = flate2::bufread::MultiGzDecoder::new(&bytes[..]).take(LONGEST + 1).read_to_end(&mut text);
    unpacking.map_err(|e| {
        Error::content(file, format!("expected a gzip file, got \"{e}\" after {} bytes; it may be cut off", text.len()))
    })?;
    if text.len() as u64 > LONGEST { Err(too_long(file, LONGEST + 1)) } else { Ok(text) }
}

fn too_long(file: &Path, length: u64) -> Error {
    let (most, length) = (LONGEST >> 20, length >> 20);
    Error::content(
        file,
        format!("expected a file of a buoy, at most {most} MiB, got {length} MiB or more; cut it into years"),
    )
}

#[cfg(test)]
mod tests;
