//! Where a file's samples lie: in its own coordinate system, in degrees, and in the engine's local metres.
//!
//! *Local metres* count from the middle of the raster, x along its columns, y along its rows, whichever way makes them
//! right-handed with north up. A step between samples is as long as the ground is in the middle of the raster: for
//! degrees by the radii of curvature of the WGS84 ellipsoid along the meridian and across it, for maps by their unit.
//! Everything is affine; what the Earth's curvature adds away from the middle is left out, and said so above 5 degrees.
//!
//! Formulas: Bugayevskiy, Snyder. Map projections: a reference manual, chapter 1. 1995.

use crate::Crs;
use crate::crs::Projector;
use glam::{DAffine2, DMat2, DVec2};
use littoral::field::Window;

/// Whether a file's samples stand for areas (pixel centres) or for points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Registration {
    /// Pixels are areas; samples stand for their middles.
    Area,
    /// Samples are points.
    Point,
}

/// From samples to coordinates to local metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Georeference {
    /// GDAL's six numbers: x = g₀ + g₁ c + g₂ r, y = g₃ + g₄ c + g₅ r at pixel *corners*, so that the sample of column c
    /// and row r lies at (c + ½, r + ½). Rows count from the file's first.
    pub geotransform: [f64; 6],
    /// What the file says its pixels are; the geotransform has it settled already.
    pub registration: Registration,
    /// The coordinate system.
    pub crs: Crs,
    /// Columns and rows of the full raster.
    pub size: [usize; 2],
    /// Whether y counts southward, as in a picture that nobody has placed on the Earth: true for
    /// [`Georeference::none`] and what is cut from it, false for everything that a file does place.
    pub y_south: bool,
}

/// Half of WGS84's longer axis (m).
const EQUATORIAL_RADIUS: f64 = 6_378_137.0;
/// WGS84's first eccentricity, squared.
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_141_316e-3;

/// Metres in a degree of longitude and in one of latitude on the WGS84 ellipsoid, at a latitude (degrees).
pub fn metres_per_degree(latitude: f64) -> DVec2 {
    let (sine, cosine) = latitude.clamp(-90.0, 90.0).to_radians().sin_cos();
    let w = 1.0 - ECCENTRICITY_SQUARED * sine * sine;
    let across = EQUATORIAL_RADIUS / w.sqrt();
    let along = EQUATORIAL_RADIUS * (1.0 - ECCENTRICITY_SQUARED) / (w * w.sqrt());
    DVec2::new(across * cosine, along).map(f64::to_radians)
}

impl Georeference {
    /// For a file that says nothing: one metre a pixel, the first row in the north.
    pub fn none(columns: usize, rows: usize) -> Georeference {
        Georeference {
            geotransform: [0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            registration: Registration::Area,
            crs: Crs::Unknown,
            size: [columns, rows],
            y_south: true,
        }
    }

    /// The same ground in other numbers of columns and rows: for overviews and rasters averaged down.
    pub fn resized(&self, columns: usize, rows: usize) -> Georeference {
        let [x, a, b, y, d, e] = self.geotransform;
        let across = self.size[0] as f64 / columns as f64;
        let down = self.size[1] as f64 / rows as f64;
        let geotransform = [x, a * across, b * down, y, d * across, e * down];
        Georeference { geotransform, size: [columns, rows], ..self.clone() }
    }

    /// A part of the same grid.
    pub fn window(&self, window: Window) -> Georeference {
        let [x, a, b, y, d, e] = self.geotransform;
        let (c, r) = (window.column as f64, window.row as f64);
        let geotransform = [x + a * c + b * r, a, b, y + d * c + e * r, d, e];
        Georeference { geotransform, size: [window.columns, window.rows], ..self.clone() }
    }

    /// The six numbers of a world file's text (`.tfw`, `.wld` …), which speaks of pixel centres, as a geotransform of
    /// corners; `None` if the text is not six finite numbers that span an area.
    pub fn geotransform_of_world_file(text: &str) -> Option<[f64; 6]> {
        let mut numbers = text.split_whitespace().map(|word| word.replace(',', ".").parse::<f64>());
        let mut next = || numbers.next()?.ok().filter(|n| n.is_finite());
        // The order is A D B E C F: x steps first, then y, then the middle of the first pixel.
        let [a, d, b, e, c, f] = [next()?, next()?, next()?, next()?, next()?, next()?];
        (a * e - b * d != 0.0).then_some([c - 0.5 * (a + b), a, b, f - 0.5 * (d + e), d, e])
    }

    /// Coordinates in the file's system from (column, row), where whole numbers are samples.
    pub fn crs_from_sample(&self) -> DAffine2 {
        let linear = self.step();
        let origin = DVec2::new(self.geotransform[0], self.geotransform[3]);
        DAffine2::from_mat2_translation(linear, origin + linear * DVec2::splat(0.5))
    }

    /// Local metres from (column, row) of the file's grid, where whole numbers are samples.
    pub fn local_from_sample(&self) -> DAffine2 {
        let [flip_columns, flip_rows] = self.flips();
        let sign = DVec2::new(if flip_columns { -1.0 } else { 1.0 }, if flip_rows { -1.0 } else { 1.0 });
        let middle = DVec2::new(self.size[0] as f64 - 1.0, self.size[1] as f64 - 1.0) * 0.5;
        let scale = sign * self.spacing();
        DAffine2::from_scale_angle_translation(scale, 0.0, -scale * middle)
    }

    /// Local metres from coordinates in the file's system. Longitudes may be whole turns away from the file's: see
    /// [`Georeference::near`].
    pub fn local_from_crs(&self) -> DAffine2 {
        self.local_from_sample() * self.crs_from_sample().inverse()
    }

    /// Coordinates in the file's system from local metres.
    pub fn crs_from_local(&self) -> DAffine2 {
        self.crs_from_sample() * self.local_from_sample().inverse()
    }

    /// The coordinates of the raster's middle.
    pub fn middle(&self) -> DVec2 {
        let size = DVec2::new(self.size[0] as f64, self.size[1] as f64);
        DVec2::new(self.geotransform[0], self.geotransform[3]) + self.step() * (size * 0.5)
    }

    /// The same coordinates with a longitude within half a turn of the raster's middle, so that files in 0 … 360 degrees
    /// and across the antimeridian understand −180 … 180. Other systems' coordinates stay as they are.
    pub fn near(&self, crs: DVec2) -> DVec2 {
        if !matches!(self.crs, Crs::Geographic { .. }) {
            return crs;
        }
        let middle = self.middle().x;
        let turns = ((crs.x - middle) / 360.0).round();
        DVec2::new(crs.x - 360.0 * turns, crs.y)
    }

    /// Coordinates in the file's system from WGS84 longitude and latitude (degrees). Between geographic systems the
    /// difference of their datums, up to a few hundred metres, is left out.
    ///
    /// # Errors
    /// A sentence that says why there is no answer: no coordinate system stated, one that cannot be computed, or a place
    /// that the projection does not reach.
    pub fn crs_from_lonlat(&self, lonlat: DVec2) -> Result<DVec2, String> {
        match &self.crs {
            Crs::Geographic { .. } => Ok(self.near(lonlat)),
            crs => Projector::new(crs)?.forward(lonlat),
        }
    }

    /// WGS84 longitude in (−180, 180] and latitude (degrees) from coordinates in the file's system.
    ///
    /// # Errors
    /// As [`Georeference::crs_from_lonlat`].
    pub fn lonlat_from_crs(&self, crs: DVec2) -> Result<DVec2, String> {
        match &self.crs {
            Crs::Geographic { .. } => Ok(DVec2::new(180.0 - (180.0 - crs.x).rem_euclid(360.0), crs.y)),
            crs_named => Projector::new(crs_named)?.inverse(crs),
        }
    }

    /// [`Georeference::lonlat_from_crs`] for many coordinates in place, longitudes being whole turns away from there where
    /// this keeps them together: within half a turn of the raster's middle. Degrees stay as they are.
    ///
    /// # Errors
    /// As [`Georeference::lonlat_from_crs`].
    pub fn lonlats_from_crs(&self, places: &mut [DVec2]) -> Result<(), String> {
        if matches!(self.crs, Crs::Geographic { .. }) {
            return Ok(());
        }
        let projector = Projector::new(&self.crs)?;
        let middle = projector.inverse(self.middle())?.x;
        for place in places {
            *place = projector.inverse(*place)?;
            place.x -= 360.0 * ((place.x - middle) / 360.0).round();
        }
        Ok(())
    }

    /// Distance between samples along columns and along rows (m), in the middle of the raster.
    pub fn spacing(&self) -> DVec2 {
        let metric = self.metric();
        DVec2::new(metric.x_axis.length(), metric.y_axis.length())
    }

    /// Whether the file's columns, and its rows, run against the local x and y.
    pub fn flips(&self) -> [bool; 2] {
        let metric = self.metric();
        // Right-handed: both or neither turned for grids that are so already, else one of them. Of the two ways left, the
        // one with y nearer to north.
        if metric.determinant() > 0.0 {
            let against = metric.y_axis.y < 0.0 || (metric.y_axis.y == 0.0 && metric.x_axis.x < 0.0);
            [against, against]
        } else {
            let rows = metric.y_axis.y < 0.0 || (metric.y_axis.y == 0.0 && metric.x_axis.x > 0.0);
            [!rows, rows]
        }
    }

    /// Turns samples of `columns` a row from the file's order into the local one, west to east and south to north, or back.
    pub fn turn<T>(&self, samples: &mut [T], columns: usize) {
        let [flip_columns, flip_rows] = self.flips();
        let rows = samples.len() / columns.max(1);
        if flip_rows {
            for row in 0..rows / 2 {
                let (upper, lower) = samples.split_at_mut((rows - 1 - row) * columns);
                upper[row * columns..(row + 1) * columns].swap_with_slice(&mut lower[..columns]);
            }
        }
        if flip_columns {
            samples.chunks_exact_mut(columns).for_each(<[T]>::reverse);
        }
    }

    /// The angle (rad) from the local y axis to the file's y axis (grid north), counter-clockwise positive: grid north
    /// lies along (−sin, cos) of it. Zero for grids that are not rotated.
    pub fn grid_north(&self) -> f64 {
        let [_, flip_rows] = self.flips();
        let metric = self.metric();
        let up = if flip_rows { -metric.y_axis } else { metric.y_axis };
        // In the system's own axes the raster's y points along `up`; north, seen from it, lies the other way round.
        up.x.atan2(up.y)
    }

    /// The angle (rad) from the local y axis to true north in the middle of the raster, counter-clockwise positive: grid
    /// north and the convergence of the meridians. Grid north where no projection is known to compute it from.
    pub fn true_north(&self) -> f64 {
        self.grid_north() + self.convergence().unwrap_or(0.0)
    }

    /// The angle (rad) from grid north to true north, counter-clockwise positive; `None` if it cannot be computed.
    fn convergence(&self) -> Option<f64> {
        let Crs::Projected { .. } = self.crs else { return None };
        let projector = Projector::new(&self.crs).ok()?;
        let middle = self.middle();
        let lonlat = projector.inverse(middle).ok()?;
        let step = DVec2::new(0.0, if lonlat.y > 0.0 { -1e-4 } else { 1e-4 });
        let north = (projector.forward(lonlat + step).ok()? - projector.forward(lonlat).ok()?) * step.y.signum();
        (north.length() > 0.0).then(|| (-north.x).atan2(north.y))
    }

    /// Map lengths over true ones in the middle of the raster, along x and y, where a projection is known.
    fn map_scale(&self) -> Option<DVec2> {
        let Crs::Projected { metres, .. } = self.crs else { return None };
        let projector = Projector::new(&self.crs).ok()?;
        let middle = self.middle();
        let lonlat = projector.inverse(middle).ok()?;
        let stride = 50.0 / metres;
        let true_length = |step: DVec2| {
            let there = projector.inverse(middle + step).ok()?;
            let mut degrees = there - lonlat;
            degrees.x -= 360.0 * (degrees.x / 360.0).round();
            let length = (degrees * metres_per_degree(lonlat.y)).length();
            (length > 0.0 && length.is_finite()).then_some(length)
        };
        Some(DVec2::new(50.0 / true_length(DVec2::X * stride)?, 50.0 / true_length(DVec2::Y * stride)?))
    }

    /// The scale that lengths are corrected by: that of maps that stretch by more than 1 %, as Web Mercator does away from
    /// the equator. Below that, map lengths are kept, so that they agree with everything else on the map.
    fn stretch(&self) -> DVec2 {
        let scale = self.map_scale().unwrap_or(DVec2::ONE);
        let uneven = (scale - 1.0).abs().max_element() > 0.01;
        if uneven && scale.is_finite() { scale } else { DVec2::ONE }
    }

    /// The file's units from a step in columns and rows.
    fn step(&self) -> DMat2 {
        let g = self.geotransform;
        DMat2::from_cols(DVec2::new(g[1], g[4]), DVec2::new(g[2], g[5]))
    }

    /// Metres east and north from a step in columns and rows, in the middle of the raster.
    fn metric(&self) -> DMat2 {
        let scale = match &self.crs {
            Crs::Unknown => DVec2::new(1.0, if self.y_south { -1.0 } else { 1.0 }),
            // At the pole itself a degree of longitude has no length; a grid there has one all the same.
            Crs::Geographic { .. } => metres_per_degree(self.middle().y).max(DVec2::splat(1.0)),
            Crs::Projected { metres, .. } => *metres / self.stretch(),
        };
        DMat2::from_diagonal(scale) * self.step()
    }

    /// What a user should know about this placement. One sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let corner = |c: usize, r: usize| {
            let at = DVec2::new((self.size[0] * c) as f64, (self.size[1] * r) as f64);
            DVec2::new(self.geotransform[0], self.geotransform[3]) + self.step() * at
        };
        let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        let (low, high) = (corners.iter().copied().reduce(DVec2::min), corners.iter().copied().reduce(DVec2::max));
        let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
        match &self.crs {
            Crs::Geographic { .. } => {
                let extent = (high - low).max_element();
                if extent > 5.0 {
                    warnings.push(format!(
                        "{extent:.0} degrees of the Earth are laid flat: lengths are true in the middle only, at latitude {:.1}",
                        self.middle().y
                    ));
                }
                if low.y < -91.0 || high.y > 91.0 {
                    warnings
                        .push(format!("latitudes from {:.1} to {:.1} degrees are not of this Earth", low.y, high.y));
                }
            }
            Crs::Projected { name, .. } => {
                let stretch = self.stretch();
                if stretch != DVec2::ONE {
                    warnings.push(format!(
                        "{name} stretches lengths by {:.3} here: local metres are true ones in the middle of the raster",
                        stretch.y
                    ));
                }
            }
            Crs::Unknown => {}
        }
        let metric = self.metric();
        let shear = metric.x_axis.normalize_or_zero().dot(metric.y_axis.normalize_or_zero());
        if shear.abs() > 1e-3 {
            warnings.push(format!(
                "the grid's rows and columns meet at {:.1} degrees, but are laid out at right angles",
                shear.acos().to_degrees()
            ));
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn placed(geotransform: [f64; 6], crs: Crs, size: [usize; 2]) -> Georeference {
        Georeference { geotransform, registration: Registration::Area, crs, size, y_south: false }
    }

    fn metres() -> Crs {
        Crs::Projected { name: "metres".into(), metres: 1.0, definition: None }
    }

    fn close(a: DVec2, b: DVec2, tolerance: f64) {
        assert!((a - b).abs().max_element() < tolerance, "expected {b}, got {a}");
    }

    #[test]
    fn degrees_have_the_lengths_of_geodesy() {
        // Metres per degree on WGS84 as NGA's tables give them; at the pole the radius of curvature is a² / c.
        for (latitude, east, north) in
            [(0.0, 111_319.491, 110_574.276), (45.0, 78_846.806, 111_131.779), (90.0, 0.0, 111_693.979)]
        {
            close(metres_per_degree(latitude), DVec2::new(east, north), 0.2);
            close(metres_per_degree(-latitude), metres_per_degree(latitude), 1e-12);
        }
    }

    #[test]
    fn local_metres_are_right_handed_with_north_up() {
        let none = Georeference::none(5, 3);
        // (geotransform, y to the south, where the sample of row 0, column 0 lies)
        let grids = [
            (placed([100.0, 2.0, 0.0, 50.0, 0.0, -3.0], metres(), [5, 3]), [-4.0, 3.0]),
            (placed([100.0, 2.0, 0.0, 50.0, 0.0, 3.0], metres(), [5, 3]), [-4.0, -3.0]),
            (placed([100.0, -2.0, 0.0, 50.0, 0.0, -3.0], metres(), [5, 3]), [4.0, 3.0]),
            (placed([100.0, -2.0, 0.0, 50.0, 0.0, 3.0], metres(), [5, 3]), [4.0, -3.0]),
            (none.clone(), [-2.0, 1.0]),
            (none.resized(10, 6), [-2.25, 1.25]),
            (none.window(Window { column: 2, row: 1, columns: 3, rows: 2 }), [-1.0, 0.5]),
        ];
        for (grid, first) in grids {
            close(grid.local_from_sample().transform_point2(DVec2::ZERO), first.into(), 1e-12);
            assert_eq!(grid.grid_north(), 0.0, "{grid:?}");
            let middle = grid.crs_from_local().transform_point2(DVec2::ZERO);
            close(middle, grid.middle(), 1e-9);
            let east = grid.crs_from_local().transform_point2(DVec2::X) - middle;
            let north = grid.crs_from_local().transform_point2(DVec2::Y) - middle;
            close(east, DVec2::X, 1e-9);
            close(north, if grid.y_south { DVec2::NEG_Y } else { DVec2::Y }, 1e-9);
        }
    }

    #[test]
    fn rotated_grids_know_where_north_is() {
        for degrees in [0.0, 20.0, -20.0, 75.0, 89.9] {
            let angle = f64::to_radians(degrees);
            let (sine, cosine) = angle.sin_cos();
            // Columns run `angle` counter-clockwise from east; rows run southward from there.
            for (rows, down) in [(1.0, [30.0 * sine, -30.0 * cosine]), (-1.0, [-30.0 * sine, 30.0 * cosine])] {
                let grid = placed([7e5, 20.0 * cosine, down[0], 5e6, 20.0 * sine, down[1]], metres(), [160, 120]);
                close(grid.spacing(), DVec2::new(20.0, 30.0), 1e-9);
                assert!((grid.grid_north() - -angle).abs() < 1e-12, "{degrees}, {rows}: {}", grid.grid_north());
                let north = DVec2::from_angle(FRAC_PI_2 + grid.grid_north());
                let step = grid.crs_from_local().transform_vector2(north);
                close(step, DVec2::Y, 1e-9);
                let transform = grid.local_from_sample() * grid.crs_from_sample().inverse();
                assert!((transform.matrix2.determinant() - 1.0).abs() < 1e-9, "lengths and handedness kept");
            }
        }
    }

    #[test]
    fn degrees_become_metres_and_feet_too() {
        let crs = Crs::Geographic { name: "EPSG:4326".into() };
        let grid = placed([-158.65, 0.03, 0.0, 21.0, 0.0, -0.03], crs, [96, 64]);
        close(grid.spacing(), metres_per_degree(21.0 - 0.96) * 0.03, 1e-9);
        let feet = Crs::Projected { name: "feet".into(), metres: 0.3048, definition: None };
        close(placed([0.0, 10.0, 0.0, 0.0, 0.0, -5.0], feet, [9, 9]).spacing(), DVec2::new(3.048, 1.524), 1e-12);
    }

    #[test]
    fn longitudes_turn_to_the_file() {
        let crs = || Crs::Geographic { name: "EPSG:4326".into() };
        let east = placed([150.0, 0.5, 0.0, 10.0, 0.0, -0.5], crs(), [140, 40]); // 150 to 220
        for (asked, expected) in [(-170.0, 190.0), (160.0, 160.0), (190.0, 190.0), (-145.0, 215.0), (520.0, 160.0)] {
            close(east.crs_from_lonlat(DVec2::new(asked, 1.0)).expect("degrees"), DVec2::new(expected, 1.0), 1e-9);
        }
        close(east.lonlat_from_crs(DVec2::new(190.0, 1.0)).expect("degrees"), DVec2::new(-170.0, 1.0), 1e-9);
        close(east.lonlat_from_crs(DVec2::new(180.0, 1.0)).expect("degrees"), DVec2::new(180.0, 1.0), 1e-9);
        let whole = placed([0.0, 1.0, 0.0, 90.0, 0.0, -1.0], crs(), [360, 180]);
        close(whole.crs_from_lonlat(DVec2::new(-158.0, 21.0)).expect("degrees"), DVec2::new(202.0, 21.0), 1e-9);
    }

    #[test]
    fn meridians_converge_on_maps() {
        let utm = Crs::from_epsg(32610).expect("known");
        let grid = placed([562_000.0, 30.0, 0.0, 5_118_000.0, 0.0, -30.0], utm, [100, 100]);
        // Transverse Mercator: convergence ≈ Δλ sin φ; east of the central meridian true north lies to the left.
        let lonlat = grid.lonlat_from_crs(grid.middle()).expect("within reach");
        let expected = (lonlat.x + 123.0).to_radians() * lonlat.y.to_radians().sin();
        assert!((grid.true_north() - expected).abs() < 1e-5, "{} against {expected}", grid.true_north());
        assert_eq!(grid.grid_north(), 0.0);
        close(grid.spacing(), DVec2::splat(30.0), 1e-12);
        let back = grid.crs_from_lonlat(lonlat).expect("within reach");
        close(back, grid.middle(), 1e-4);
    }

    #[test]
    fn web_mercator_is_not_taken_at_its_word() {
        let mercator = Crs::from_epsg(3857).expect("known");
        let y = 8_399_737.889_818; // 60 degrees north
        let grid = placed([0.0, 100.0, 0.0, y + 5000.0, 0.0, -100.0], mercator, [100, 100]);
        let spacing = grid.spacing();
        assert!((spacing - 50.0).abs().max_element() < 0.2, "{spacing}");
        assert!(grid.warnings().iter().any(|warning| warning.contains("stretches lengths by")));
        let utm = Crs::from_epsg(32610).expect("known");
        assert_eq!(placed([5e5, 1.0, 0.0, 5e6, 0.0, -1.0], utm, [9, 9]).warnings(), [""; 0]);
    }

    #[test]
    fn what_cannot_be_computed_is_said() {
        let none = Georeference::none(3, 3).crs_from_lonlat(DVec2::ZERO).expect_err("no system");
        assert!(none.contains("got none"), "{none}");
        let grid = placed([0.0, 1.0, 0.0, 0.0, 0.0, -1.0], metres(), [9, 9]);
        assert!(grid.crs_from_lonlat(DVec2::ZERO).expect_err("no definition").contains("got metres"));
        let wide = placed([-180.0, 1.0, 0.0, 90.0, 0.0, -1.0], Crs::Geographic { name: "degrees".into() }, [360, 180]);
        assert!(wide.warnings()[0].contains("true in the middle only"));
        let sheared = placed([0.0, 1.0, 0.5, 0.0, 0.0, -1.0], metres(), [9, 9]);
        assert!(sheared.warnings()[0].contains("meet at"));
    }

    #[test]
    fn world_files_speak_of_pixel_centres() {
        let text = "30.0\r\n0.0\n0.0\n-30.0\n560820.0\n5115990.0\n";
        let expected = [560_805.0, 30.0, 0.0, 5_116_005.0, 0.0, -30.0];
        assert_eq!(Georeference::geotransform_of_world_file(text), Some(expected));
        for broken in ["", "1 2 3", "1 0 0 0 5 5", "a b c d e f", "1 0 0 nan 5 5", "1 0 0 inf 5 5"] {
            assert_eq!(Georeference::geotransform_of_world_file(broken), None, "{broken}");
        }
    }
}
