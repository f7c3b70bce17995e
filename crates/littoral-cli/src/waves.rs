//! `littoral waves`: numbers and plots of waves.

mod dispersion;
mod export;
mod height;
mod picture;
mod spectrum;
pub mod state;
mod summary;

use crate::talk::{Failure, Talk};

/// Waves in numbers and plots: spectra of the sea, how fast waves run, how high the water stands,
/// and tiles of sea for other programs.
#[derive(clap::Args)]
#[command(after_help = "Start here:
  littoral waves spectrum --wind 15                   the sea a wind of 15 m/s raises
  littoral waves spectrum --buoy 41010.data_spec      what a buoy measured
  littoral waves dispersion --period 8 --depth 5      how long and fast an 8 s wave is in 5 m
  littoral waves height --sea wind=15 --at 0,0        how high that sea stands, and how it runs
  littoral waves export --sea wind=15 --out sea.exr   a tile of it, for other programs")]
pub struct Waves {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    Spectrum(Box<spectrum::Spectrum>),
    Dispersion(dispersion::Dispersion),
    Height(Box<height::Height>),
    Export(Box<export::Export>),
}

impl Waves {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        match self.command {
            Command::Spectrum(command) => command.run(talk),
            Command::Dispersion(command) => command.run(talk),
            Command::Height(command) => command.run(talk),
            Command::Export(command) => command.run(talk),
        }
    }
}

/// A number for people: so many digits that count.
fn digits(number: f64, digits: i32) -> String {
    if number == 0.0 || !number.is_finite() {
        return if number == 0.0 { "0".into() } else { "-".into() };
    }
    let power = number.abs().log10().floor() as i32;
    if !(-5..9).contains(&power) {
        return format!("{number:.*e}", (digits - 1).max(0) as usize);
    }
    crate::talk::tidy(number, (digits - 1 - power).clamp(0, 12) as usize)
}

/// The compass point nearest to a bearing (degrees).
fn compass(bearing: f64) -> &'static str {
    const POINTS: [&str; 16] =
        ["N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW"];
    POINTS[(bearing / 22.5).round().rem_euclid(16.0) as usize % 16]
}

/// A bearing for people.
fn bearing(degrees: f64) -> String {
    format!("{}° ({})", whole(degrees), compass(degrees))
}

/// A bearing in whole degrees, 0 to 359.
fn whole(degrees: f64) -> f64 {
    degrees.round().rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_digits() {
        let cases = [(0.073_812, "0.0738"), (12.345, "12.3"), (1234.5, "1234"), (0.0, "0"), (1.2e-9, "1.20e-9")];
        for (number, text) in cases {
            assert_eq!(digits(number, 3), text);
        }
        assert_eq!([compass(0.0), compass(359.0), compass(225.0), compass(281.0)], ["N", "N", "SW", "W"]);
    }
}
