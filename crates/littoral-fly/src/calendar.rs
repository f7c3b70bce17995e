//! The sun by date, time of day and place. The hour is the sun's own at that place: at twelve it stands about highest, without a table of time zones.

use crate::settings::Settings;
use glam::DVec2;
use jiff::civil::{Date, date};
use jiff::tz::TimeZone;
use jiff::{Timestamp, ToSpan};
use littoral::picture::Sun;

/// The years that can be chosen.
pub const YEARS: std::ops::RangeInclusive<i16> = 1800..=2200;

/// The date that a day of a year is, counted from 1: of a year that has fewer days, its last.
pub fn day(year: i16, number: u16) -> Date {
    let year = year.clamp(*YEARS.start(), *YEARS.end());
    let first = date(year, 1, 1);
    let last = first.days_in_year().unsigned_abs();
    first.saturating_add((i32::from(number.clamp(1, last)) - 1).days())
}

/// A day of a year for people: `21 Jun`.
pub fn day_words(year: i16, number: u16) -> String {
    day(year, number).strftime("%-d %b").to_string()
}

/// Seconds after the beginning of 1970, UTC, at an hour of the sun's own (mean) time on a day at a longitude (degrees).
fn instant(year: i16, number: u16, hour: f64, longitude: f64) -> f64 {
    let midnight =
        day(year, number).at(0, 0, 0, 0).to_zoned(TimeZone::UTC).map_or(0, |zoned| zoned.timestamp().as_second());
    midnight as f64 + (hour - longitude / 15.0) * 3600.0
}

/// Where the sun by date stands: over the land's own place, or the one that was entered.
pub fn place(settings: &Settings, known: Option<DVec2>) -> DVec2 {
    known.unwrap_or(DVec2::new(settings.longitude_degrees, settings.latitude_degrees))
}

/// The sun of the settings' date over a place, its longitude and latitude (degrees).
pub fn sun(settings: &Settings, lonlat: DVec2) -> Option<Sun> {
    Sun::over(lonlat, instant(settings.year, settings.day, settings.hour, lonlat.x)).ok()
}

/// The settings' instant in UTC for people.
pub fn utc_words(settings: &Settings, lonlat: DVec2) -> String {
    let seconds = instant(settings.year, settings.day, settings.hour, lonlat.x).round() as i64;
    Timestamp::from_second(seconds).map_or(String::new(), |at| at.strftime("%Y-%m-%d %H:%M UTC").to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_counted_through_leap_years() {
        assert_eq!(day_words(2026, 172), "21 Jun");
        assert_eq!(day_words(2024, 60), "29 Feb");
        assert_eq!(day_words(2026, 60), "1 Mar");
        assert_eq!((day_words(2026, 0), day_words(2026, 999)), ("1 Jan".into(), "31 Dec".into()));
    }

    #[test]
    fn at_twelve_the_sun_is_about_highest_wherever_one_is() {
        for longitude in [-155.2, 0.0, 10.0, 179.0] {
            let at = |hour: f64| {
                let settings = Settings { year: 2026, day: 172, hour, ..Settings::default() };
                sun(&settings, DVec2::new(longitude, 50.0)).expect("a sun")
            };
            let noon = at(12.0);
            assert!((noon.azimuth.to_degrees() - 180.0).abs() < 2.0, "{longitude}: {noon:?}");
            assert!((noon.elevation.to_degrees() - 63.4).abs() < 0.2, "{longitude}: {noon:?}");
            assert!(at(6.0).azimuth < noon.azimuth && at(18.0).azimuth > noon.azimuth && at(0.0).elevation < 0.0);
        }
        let settings = Settings { year: 2026, day: 1, hour: 12.0, ..Settings::default() };
        assert_eq!(utc_words(&settings, DVec2::new(-150.0, 20.0)), "2026-01-01 22:00 UTC");
    }

    #[test]
    fn the_land_s_place_goes_before_the_one_entered() {
        let settings = Settings { longitude_degrees: 10.0, latitude_degrees: 50.0, ..Settings::default() };
        assert_eq!(place(&settings, None), DVec2::new(10.0, 50.0));
        assert_eq!(place(&settings, Some(DVec2::new(1.0, 2.0))), DVec2::new(1.0, 2.0));
    }
}
