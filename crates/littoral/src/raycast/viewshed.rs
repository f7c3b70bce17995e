//! Viewsheds: which samples of the land are seen from a point.

use super::sight::{Curvature, SightError, SightLine, Station, drop_per_square};
use crate::field::Land;
use glam::DVec2;

/// What a viewshed is asked for, beside the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewshed {
    /// Height above the ground (m) of what is looked for.
    pub target_height: f64,
    /// Samples farther away horizontally (m) are not seen. Infinity for the whole land.
    pub radius: f64,
    /// Whether, and how, the Earth curves.
    pub curvature: Option<Curvature>,
}

impl Default for Viewshed {
    /// The ground itself, as far as the land goes, on a flat Earth.
    fn default() -> Viewshed {
        Viewshed { target_height: 0.0, radius: f64::INFINITY, curvature: None }
    }
}

/// What a viewshed found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewshedCount {
    /// Samples seen.
    pub seen: usize,
    /// Samples that needed a line of sight of their own.
    pub lines: usize,
}

impl Land {
    /// Which samples an observer sees: writes 255 for those seen and 0 for the others, row by row from the south as the
    /// raster's heights. A sample is seen if the line of sight from the observer to the point `target_height` above it is
    /// free: exactly the answer of [`Land::sight`] for that pair, with its rules for touching and voids. Void samples are
    /// not seen. Runs on rayon's threads; the result does not depend on their number.
    ///
    /// # Errors
    /// If the observer is outside the land or over a void, or a number makes no sense.
    ///
    /// # Panics
    /// If `seen` does not hold one number for each sample.
    pub fn viewshed(&self, observer: Station, asked: &Viewshed, seen: &mut [u8]) -> Result<ViewshedCount, SightError> {
        let raster = self.raster();
        assert_eq!(seen.len(), raster.heights().len(), "expected room for one number for each sample");
        if !asked.target_height.is_finite() {
            return Err(SightError::Number("a finite target height (m)", asked.target_height));
        }
        if asked.radius.is_nan() || asked.radius < 0.0 {
            return Err(SightError::Number("a radius of 0 or more (m)", asked.radius));
        }
        let drop_per_square = drop_per_square(asked.curvature)?;
        let (eye, ground) = self.stand(observer)?;
        let eye_height = ground + observer.above_ground;
        let mut count = ViewshedCount::default();
        for row in 0..raster.rows() {
            for column in 0..raster.columns() {
                let target = DVec2::new(column as f64, row as f64);
                let index = row * raster.columns() + column;
                let within = ((target - eye) * raster.spacing()).length() <= asked.radius;
                seen[index] = 0;
                if within && !raster.voids().is_void(index) {
                    let top = f64::from(raster.heights()[index]) + asked.target_height;
                    let line = SightLine::new(self, (eye, eye_height), (target, top), drop_per_square);
                    count.lines += 1;
                    if observer.above_ground >= -super::GRAZE && !line.blocked(self) {
                        seen[index] = 255;
                        count.seen += 1;
                    }
                }
            }
        }
        Ok(count)
    }
}
