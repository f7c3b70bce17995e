//! Where the sun stands over a place at an instant: I. Reda and A. Andreas, *Solar position algorithm for solar radiation applications* (Solar Energy 76,
//! 2004), good to 0.0003°, by the crate `solar-positioning`.

use super::Sun;
use glam::DVec2;
use solar_positioning::{Location, RefractionCorrection, SolarPositions, delta_t, time::JulianDate};

/// A place or an instant that no sun can be told for.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "expected a longitude from -180 to 180°, a latitude from -90 to 90° and an instant between the years -500 and 3000, got {0}°, {1}° and {2} s after 1970",
    lonlat.x,
    lonlat.y,
    seconds
)]
pub struct NoSun {
    /// Longitude and latitude (degrees).
    pub lonlat: DVec2,
    /// Seconds since the beginning of 1970, UTC.
    pub seconds: f64,
}

impl Sun {
    /// The sun as it is seen at sea level from a place, `lonlat` being its longitude and latitude (degrees), so many seconds after the beginning of 1970, UTC, leap
    /// seconds not counted. The air lifts it as it does at 15 °C: by 0.5° at the horizon.
    ///
    /// # Errors
    /// If there is no such place, or the instant is not between the years −500 and 3000.
    pub fn over(lonlat: DVec2, seconds: f64) -> Result<Sun, NoSun> {
        const DAY: f64 = 86_400.0;
        let wrong = |_| NoSun { lonlat, seconds };
        let days = seconds / DAY;
        // Julian dates count days from a noon 2 440 587.5 days before 1970.
        let delta = delta_t::estimate(1970.0 + days / 365.2425).map_err(wrong)?;
        let date = JulianDate::new(2_440_587.5 + days, delta).map_err(wrong)?;
        let place = Location { latitude: lonlat.y, longitude: lonlat.x };
        let air = Some(RefractionCorrection::standard());
        let position = SolarPositions::new().at_from_julian(date, place, 0.0, air).map_err(wrong)?;
        Ok(Sun::new(position.azimuth().to_radians(), position.elevation_angle().to_radians()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seconds after 1970 of 2026, a day of it from 0 and an hour (UTC).
    fn instant(day: f64, hour: f64) -> f64 {
        1_767_225_600.0 + day * 86_400.0 + hour * 3600.0
    }

    #[test]
    fn at_solstices_the_noon_sun_stands_by_latitude_and_tilt() {
        // 21 June and 21 December: 90° − latitude ± 23.44°, to the south, within the refraction of high suns.
        for (day, tilt) in [(171.0, 23.44), (354.0, -23.44)] {
            let noon =
                |latitude: f64, hour: f64| Sun::over(DVec2::new(10.0, latitude), instant(day, hour)).expect("a sun");
            let highest = (0..240)
                .map(|i| noon(50.0, 10.0 + f64::from(i) / 100.0))
                .max_by(|a, b| a.elevation.total_cmp(&b.elevation))
                .expect("some");
            assert!((highest.elevation.to_degrees() - (40.0 + tilt)).abs() < 0.07, "{highest:?}");
            assert!((highest.azimuth.to_degrees() - 180.0).abs() < 0.3, "{highest:?}");
        }
    }

    #[test]
    fn the_paper_s_example() {
        // 17 October 2003, 12:30:30 seven hours west of UTC, 39.742476° N, 105.1786° W: zenith angle 50.1116°, azimuth 194.3402° (at 1830 m, 820 hPa,
        // 11 °C; the sea's air lifts the sun 0.004° more).
        let seconds = 1_066_419_030.0;
        let sun = Sun::over(DVec2::new(-105.1786, 39.742_476), seconds).expect("a sun");
        assert!((sun.azimuth.to_degrees() - 194.340_24).abs() < 0.002, "{}", sun.azimuth.to_degrees());
        assert!((sun.elevation.to_degrees() - (90.0 - 50.111_62)).abs() < 0.006, "{}", sun.elevation.to_degrees());
    }

    #[test]
    fn nowhere_and_never_are_errors() {
        let good = (DVec2::new(10.0, 50.0), instant(100.0, 12.0));
        assert!(Sun::over(good.0, good.1).is_ok());
        for lonlat in [DVec2::new(10.0, 91.0), DVec2::new(f64::NAN, 0.0), DVec2::new(10.0, f64::INFINITY)] {
            let said = Sun::over(lonlat, good.1).expect_err("nowhere").to_string();
            assert!(said.starts_with("expected a longitude"), "{said}");
        }
        for seconds in [f64::NAN, f64::INFINITY, 1e12, -1e12] {
            assert!(Sun::over(good.0, seconds).is_err(), "{seconds}");
        }
    }
}
