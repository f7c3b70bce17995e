//! Waves that are lower in some places: behind a headland, over a shoal, in a harbour.
//!
//! A model of the open sea knows nothing of land. What shelters it is a map of factors, smooth over a wave's length, by which its displacements
//! and velocities shrink.

use super::OutOfRange;
use super::model::{BLOCK, Bounds, Motion, Points, Velocity, WaveModel};
use glam::DVec2;

/// Factors in [0, 1] on a lattice, straight lines between; beyond its border those of the border.
#[derive(Clone, Debug, PartialEq)]
pub struct Shelter {
    origin: DVec2,
    spacing: DVec2,
    columns: usize,
    rows: usize,
    factors: Vec<f32>,
    /// Largest difference of neighbours per metre (1/m).
    steepest: f32,
}

impl Shelter {
    /// Factors row by row from the south-west, `origin` being the first one's place (m).
    ///
    /// # Errors
    /// If there are fewer than 2 × 2, their number is not `columns` × `rows`, one is not in [0, 1], or `spacing` (m) is not above 0.
    pub fn new(
        origin: DVec2,
        spacing: DVec2,
        columns: usize,
        rows: usize,
        factors: Vec<f32>,
    ) -> Result<Shelter, OutOfRange> {
        let count = columns.checked_mul(rows).unwrap_or(0);
        let fine = columns >= 2 && rows >= 2 && factors.len() == count;
        OutOfRange::unless(fine, "shelter", "columns × rows factors, at least 2 × 2", factors.len() as f64)?;
        let fine = spacing.min_element() > 0.0 && spacing.is_finite() && origin.is_finite();
        OutOfRange::unless(fine, "shelter's spacing", "metres above 0", spacing.min_element())?;
        if let Some(wrong) = factors.iter().find(|f| !(0.0..=1.0).contains(*f)) {
            OutOfRange::unless(false, "shelter", "factors from 0 to 1", f64::from(*wrong))?;
        }
        let mut steepest = 0.0f32;
        for (i, factor) in factors.iter().enumerate() {
            let east = if (i + 1) % columns == 0 { *factor } else { factors[i + 1] };
            let north = factors.get(i + columns).unwrap_or(factor);
            let slope = DVec2::new(f64::from(east - factor), f64::from(north - factor)) / spacing;
            // Within a cell either component may go with either of two differences.
            steepest = steepest.max(slope.abs().max_element() as f32 * std::f32::consts::SQRT_2);
        }
        Ok(Shelter { origin, spacing, columns, rows, factors, steepest })
    }

    /// The place of the first factor and the distances between them (m).
    pub fn frame(&self) -> (DVec2, DVec2) {
        (self.origin, self.spacing)
    }

    /// Factors a row, and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// The factors, row by row from the south-west.
    pub fn factors(&self) -> &[f32] {
        &self.factors
    }

    /// The factor at a place (m) and its gradient (1/m).
    pub fn at(&self, x: f64, y: f64) -> (f32, f32, f32) {
        let (u, in_x) = within((x - self.origin.x) / self.spacing.x, self.columns);
        let (v, in_y) = within((y - self.origin.y) / self.spacing.y, self.rows);
        let (i, j) = ((u as usize).min(self.columns - 2), (v as usize).min(self.rows - 2));
        let (s, t) = ((u - i as f64) as f32, (v - j as f64) as f32);
        let at = j * self.columns + i;
        let (a, b) = (self.factors[at], self.factors[at + 1]);
        let (c, d) = (self.factors[at + self.columns], self.factors[at + self.columns + 1]);
        let (low, high) = (a + (b - a) * s, c + (d - c) * s);
        let along_x = ((b - a) * (1.0 - t) + (d - c) * t) * in_x / self.spacing.x as f32;
        let along_y = (high - low) * in_y / self.spacing.y as f32;
        (low + (high - low) * t, along_x, along_y)
    }
}

/// A lattice coordinate held within, and 1 if it was there.
fn within(u: f64, count: usize) -> (f64, f32) {
    let last = (count - 1) as f64;
    // Not a number counts as beyond.
    if u >= 0.0 && u <= last { (u, 1.0) } else { (if u > 0.0 { last } else { 0.0 }, 0.0) }
}

/// A model whose waves a [`Shelter`] makes lower.
pub struct Sheltered {
    model: Box<dyn WaveModel>,
    shelter: Shelter,
}

impl Sheltered {
    /// `model` behind `shelter`.
    pub fn new(model: Box<dyn WaveModel>, shelter: Shelter) -> Sheltered {
        Sheltered { model, shelter }
    }

    /// The model, as it is where nothing shelters it.
    pub fn model(&self) -> &dyn WaveModel {
        self.model.as_ref()
    }

    /// What shelters it.
    pub fn shelter(&self) -> &Shelter {
        &self.shelter
    }
}

impl WaveModel for Sheltered {
    fn set_time(&mut self, seconds: f64) {
        self.model.set_time(seconds);
    }

    fn time(&self) -> f64 {
        self.model.time()
    }

    fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        let mut own = Motion::STILL;
        self.model.add_displacement(points, &mut own);
        for i in 0..BLOCK {
            let (factor, ..) = self.shelter.at(points.x[i], points.y[i]);
            motion.dx[i] += factor * own.dx[i];
            motion.dy[i] += factor * own.dy[i];
            motion.dz[i] += factor * own.dz[i];
        }
    }

    fn add_motion(&self, points: &Points, motion: &mut Motion) {
        let mut own = Motion::STILL;
        self.model.add_motion(points, &mut own);
        for i in 0..BLOCK {
            let (factor, along_x, along_y) = self.shelter.at(points.x[i], points.y[i]);
            motion.dx[i] += factor * own.dx[i];
            motion.dy[i] += factor * own.dy[i];
            motion.dz[i] += factor * own.dz[i];
            motion.slope_x[i] += factor * own.slope_x[i] + along_x * own.dz[i];
            motion.slope_y[i] += factor * own.slope_y[i] + along_y * own.dz[i];
            motion.dxx[i] += factor * own.dxx[i] + along_x * own.dx[i];
            // The factor bends the motion a little: it gets a curl, of which this is the mean of both sides.
            motion.dxy[i] += factor * own.dxy[i] + 0.5 * (along_y * own.dx[i] + along_x * own.dy[i]);
            motion.dyy[i] += factor * own.dyy[i] + along_y * own.dy[i];
            motion.hidden_xx[i] += factor * factor * own.hidden_xx[i];
            motion.hidden_xy[i] += factor * factor * own.hidden_xy[i];
            motion.hidden_yy[i] += factor * factor * own.hidden_yy[i];
            // Low waves do not break.
            let foam = own.foam[i] * factor * factor;
            motion.foam[i] += foam * (1.0 - motion.foam[i]);
        }
    }

    fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        let mut own = Velocity::STILL;
        self.model.add_velocity(points, depths, &mut own);
        for i in 0..BLOCK {
            let (factor, ..) = self.shelter.at(points.x[i], points.y[i]);
            velocity.x[i] += factor * own.x[i];
            velocity.y[i] += factor * own.y[i];
            velocity.z[i] += factor * own.z[i];
        }
    }

    fn bounds(&self) -> Bounds {
        let b = self.model.bounds();
        let s = self.shelter.steepest;
        // The factor has kinks at its lattice, where second derivatives have no bound; over a cell they are those of a product.
        Bounds {
            slope: b.slope + s * b.height,
            stretch: b.stretch + s * b.sideways,
            curvature: f32::INFINITY,
            bend: f32::INFINITY,
            ..b
        }
    }

    fn roughness(&self, wavelength: f32) -> f32 {
        self.model.roughness(wavelength)
    }

    fn rise_speed(&self) -> f32 {
        self.model.rise_speed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_bilinear_and_go_on_beyond_the_border() {
        let shelter =
            Shelter::new(DVec2::new(10.0, 20.0), DVec2::new(2.0, 4.0), 3, 2, vec![0.0, 0.5, 1.0, 0.2, 0.4, 0.6])
                .expect("factors");
        assert_eq!(shelter.at(12.0, 20.0).0, 0.5);
        let (factor, along_x, along_y) = shelter.at(11.0, 22.0);
        assert!((factor - 0.275).abs() < 1e-6);
        assert!((along_x - 0.175).abs() < 1e-6 && (along_y - 0.0125).abs() < 1e-6);
        assert_eq!(shelter.at(-1e9, 0.0), (0.0, 0.0, 0.0));
        assert_eq!(shelter.at(1e9, f64::NAN).0, 1.0);
        for factors in [vec![0.0; 5], vec![2.0; 6], vec![f32::NAN; 6]] {
            assert!(Shelter::new(DVec2::ZERO, DVec2::ONE, 3, 2, factors).is_err());
        }
    }
}
