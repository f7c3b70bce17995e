//! The beach of 1999: a polyline shore with linearly growing depth.

use super::super::OutOfRange;
use super::Depths;
use glam::DVec2;

/// A shore drawn by a designer, and how the bed falls from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Beach {
    /// Corners of the shoreline (m), at least 2; the sea lies to the left of one who walks along it.
    pub shore: Vec<DVec2>,
    /// Metres down per metre out, from 1e-5 to 10.
    pub slope: f64,
    /// How far out waves begin to break (m), above 0.
    pub surf_width: f64,
}

impl Beach {
    /// The bed on a grid: depths slope × distance from the shore, negative on land.
    ///
    /// # Errors
    /// If the shore has fewer than two corners or one that is not a number, slope or surf width are out of range, or the grid makes no sense.
    pub fn depths(&self, origin: DVec2, spacing: f64, columns: usize, rows: usize) -> Result<Depths, OutOfRange> {
        let corners = self.shore.len();
        OutOfRange::unless(corners >= 2, "corners of the shore", "at least 2", corners as f64)?;
        for corner in &self.shore {
            let farther = if corner.x.abs() <= 1e9 { corner.y } else { corner.x };
            OutOfRange::unless(farther.abs() <= 1e9, "corner of the shore", "m, within ±1e9", farther)?;
        }
        let slope = self.slope;
        OutOfRange::unless((1e-5..=10.0).contains(&slope), "slope of the beach", "from 0.00001 to 10", slope)?;
        // Everything but the depths is checked before they are made.
        let mut bed = Depths { origin, spacing, columns, rows, depths: Vec::new() };
        if let Err(error) = bed.check()
            && error.what != "depths of the bed"
        {
            return Err(error);
        }
        for row in 0..rows {
            for column in 0..columns {
                let place = origin + DVec2::new(column as f64, row as f64) * spacing;
                bed.depths.push((slope * self.distance(place)) as f32);
            }
        }
        Ok(bed)
    }

    /// Height over depth at which waves of these amplitudes (m, all trains together) break just as far out as the surf is wide: for
    /// [`super::Surf::breaking`], without shoaling.
    ///
    /// # Errors
    /// If slope, surf width and amplitude do not make a ratio from 0.01 to 10.
    pub fn breaking(&self, amplitude: f64) -> Result<f64, OutOfRange> {
        let ratio = 2.0 * amplitude / (self.slope * self.surf_width);
        OutOfRange::unless((0.01..=10.0).contains(&ratio), "height over depth in the surf", "from 0.01 to 10", ratio)?;
        Ok(ratio)
    }

    /// Distance from the shore (m), above 0 at sea.
    pub(super) fn distance(&self, place: DVec2) -> f64 {
        let mut nearest = (f64::INFINITY, 0.0);
        for leg in self.shore.windows(2) {
            let (start, along) = (leg[0], leg[1] - leg[0]);
            let share = ((place - start).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            // A leg without length is its corner.
            let foot = start + along * if share.is_finite() { share } else { 0.0 };
            let apart = (place - foot).length();
            // At a corner, which leg says the side? The one that sees the place more squarely.
            let side = along.normalize_or_zero().perp_dot(place - start);
            if apart < nearest.0 - 1e-9 || (apart < nearest.0 + 1e-9 && side.abs() > f64::abs(nearest.1)) {
                nearest = (apart.min(nearest.0), side);
            }
        }
        if nearest.1 < 0.0 { -nearest.0 } else { nearest.0 }
    }
}
