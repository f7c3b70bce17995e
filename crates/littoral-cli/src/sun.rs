//! Where the sun stands: as typed, or by date, time and place.

use crate::ground::Frame;
use crate::input;
use crate::talk::{Failure, Talk, tidy};
use glam::DVec2;
use littoral::picture::Sun;

/// What is said of the sun.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct SunChoice {
    /// The sun: compass bearing and height above the horizon in degrees [default: what suits the land]
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = input::sun, help_heading = "Look")]
    sun: Option<DVec2>,
    /// The sun as it stands at an instant over the middle of the land: 2026-06-21T18:30Z, or T20:30+02:00
    #[arg(long, value_name = "DATETTIME", value_parser = input::moment, conflicts_with = "sun", help_heading = "Look")]
    sun_at: Option<f64>,
    /// The place for --sun-at in degrees, where the file does not tell its own
    #[arg(long, value_name = "LONGITUDE,LATITUDE", value_parser = input::place, requires = "sun_at", help_heading = "Look")]
    sun_place: Option<DVec2>,
}

impl SunChoice {
    /// The sun that is asked for, over land in a frame of coordinates; `None` for the one that suits the land.
    pub fn over(&self, frame: &Frame, talk: &mut Talk) -> Result<Option<Sun>, Failure> {
        let Some(seconds) = self.sun_at else {
            return Ok(self.sun.map(|sun| Sun::new(sun.x.to_radians(), sun.y.to_radians())));
        };
        let lonlat = self.sun_place.or_else(|| frame.place()).ok_or_else(|| {
            Failure::Usage(
                "expected a place for --sun-at, got land that does not say where it lies; add --sun-place LONGITUDE,LATITUDE"
                    .into(),
            )
        })?;
        let sun = Sun::over(lonlat, seconds).map_err(|e| Failure::Usage(format!("--sun-at: {e}")))?;
        if sun.elevation < 0.0 {
            let below = tidy(-sun.elevation.to_degrees(), 1);
            talk.warn(format!("the sun stands {below}° below the horizon then: the picture is dark"));
        }
        Ok(Some(sun))
    }
}
