//! A model put together from one mesh, or from those of tiles that share their borders.

use super::base::close;
use super::shoreline::{cut, line};
use super::{Form, Model, ModelError, Triangulation};
use crate::field::{Raster, Window};
use glam::{DVec2, DVec3, Vec2};
use rayon::prelude::*;
use std::collections::HashMap;

/// Meshes of tiles on their way to one [`Model`]. Memory grows with the triangles, not with the samples.
#[derive(Clone, Debug, Default)]
pub struct Pieces {
    shoreline: Option<f64>,
    /// Column, row and height (m).
    positions: Vec<DVec3>,
    /// Slopes (m/m) of the ground at each vertex.
    slopes: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    /// Vertices on the borders of tiles, by the bits of their column and row.
    shared: HashMap<[u64; 2], u32>,
}

impl Pieces {
    /// Nothing yet; a waterline of this height (m) will be cut into everything.
    pub fn new(shoreline: Option<f64>) -> Pieces {
        Pieces { shoreline, ..Pieces::default() }
    }

    /// The lowest vertex so far (m); infinite if there is none.
    pub fn lowest(&self) -> f64 {
        self.positions.iter().map(|at| at.z).fold(f64::INFINITY, f64::min)
    }

    /// Adds the mesh of a tile. `raster` holds the tile's samples and, for normals, should hold one more on each side where there is one;
    /// its south-western sample is the one in column and row `first` of the whole. Vertices of the mesh count from that of `tile`, and those on
    /// its border are shared with other tiles.
    ///
    /// # Errors
    /// If there are more vertices or triangles than can be named.
    ///
    /// # Panics
    /// If the mesh names a sample that the raster does not hold.
    pub fn add(
        &mut self,
        mesh: &Triangulation,
        tile: Window,
        raster: &Raster,
        first: [usize; 2],
    ) -> Result<(), ModelError> {
        let (columns, heights) = (raster.columns(), raster.heights());
        let first_place = DVec2::new(first[0] as f64, first[1] as f64);
        let place = |&[column, row]: &[u32; 2]| {
            let (column, row) = (tile.column + column as usize, tile.row + row as usize);
            let height = heights[(row - first[1]) * columns + column - first[0]];
            DVec3::new(column as f64, row as f64, f64::from(height))
        };
        let mut positions: Vec<DVec3> = mesh.vertices.par_iter().map(place).collect();
        let mut triangles = mesh.triangles.clone();
        if let Some(level) = self.shoreline {
            cut(&mut positions, &mut triangles, raster.spacing(), level);
        }
        let slope = |at: &DVec3| slope_at(raster, at.truncate() - first_place).as_vec2();
        let slopes: Vec<Vec2> = positions.par_iter().map(slope).collect();

        let low = DVec2::new(tile.column as f64, tile.row as f64);
        let high = low + DVec2::new(tile.columns as f64 - 1.0, tile.rows as f64 - 1.0);
        let mut names = Vec::with_capacity(positions.len());
        for (position, slope) in positions.into_iter().zip(slopes) {
            let at = position.truncate();
            let own = self.positions.len() as u32;
            let name = match at.cmpeq(low).any() || at.cmpeq(high).any() {
                true => *self.shared.entry([at.x.to_bits(), at.y.to_bits()]).or_insert(own),
                false => own,
            };
            if name == own {
                self.positions.push(position);
                self.slopes.push(slope);
            }
            names.push(name);
        }
        self.triangles.extend(triangles.iter().map(|triangle| triangle.map(|vertex| names[vertex as usize])));
        // A number too large has only been truncated so far, and goes no further.
        match u32::try_from(self.positions.len().max(self.triangles.len())) {
            Ok(_) => Ok(()),
            Err(_) => Err(ModelError::TooLarge),
        }
    }

    /// The model. [`Form::shoreline`] is the one that [`Pieces::new`] was told.
    ///
    /// # Errors
    /// If the base is not below the ground, or there is too much of it, or none.
    pub fn finish(self, form: &Form) -> Result<Model, ModelError> {
        let Pieces { shoreline, positions, slopes, triangles, .. } = self;
        if triangles.is_empty() {
            return Err(ModelError::Empty);
        }
        let normal = |slope: &Vec2| {
            let slope = slope.as_dvec2() * form.exaggeration;
            let normal = DVec3::new(-slope.x, -slope.y, 1.0).normalize();
            DVec2::from_angle(form.turn).rotate(normal.truncate()).extend(normal.z).as_vec3()
        };
        let mut model = Model {
            normals: slopes.par_iter().map(normal).collect(),
            shoreline: shoreline.map_or(Vec::new(), |level| line(&positions, &triangles, level)),
            ground_triangles: triangles.len(),
            positions,
            triangles,
        };
        if let Some(base) = form.base {
            close(&mut model, base)?;
        }
        model.positions.par_iter_mut().for_each(|position| {
            *position = (form.place)(position.truncate()).extend(position.z * form.exaggeration);
        });
        Ok(model)
    }
}

/// The slope (m/m, eastward and northward) at a sample: the mean of those towards the neighbours that are known.
fn slope_of(raster: &Raster, column: usize, row: usize) -> DVec2 {
    let Some(here) = raster.sample(column, row).map(f64::from) else { return DVec2::ZERO };
    let (mut sum, mut count) = (DVec2::ZERO, DVec2::ZERO);
    let mut towards = |along: DVec2, neighbour: Option<f32>| {
        if let Some(there) = neighbour {
            sum += along * (f64::from(there) - here);
            count += along.abs();
        }
    };
    if column > 0 {
        towards(-DVec2::X, raster.sample(column - 1, row));
    }
    if column + 1 < raster.columns() {
        towards(DVec2::X, raster.sample(column + 1, row));
    }
    if row > 0 {
        towards(-DVec2::Y, raster.sample(column, row - 1));
    }
    if row + 1 < raster.rows() {
        towards(DVec2::Y, raster.sample(column, row + 1));
    }
    sum / count.max(DVec2::ONE) / raster.spacing()
}

/// The same between samples, blended from the known ones round the place (in columns and rows).
fn slope_at(raster: &Raster, at: DVec2) -> DVec2 {
    let last = DVec2::new(raster.columns() as f64 - 1.0, raster.rows() as f64 - 1.0);
    let at = at.clamp(DVec2::ZERO, last);
    let (base, part) = (at.floor(), at - at.floor());
    let (mut sum, mut known) = (DVec2::ZERO, 0.0);
    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let share = |far: usize, part: f64| if far == 1 { part } else { 1.0 - part };
        let weight = share(i, part.x) * share(j, part.y);
        let (column, row) = (base.x as usize + i, base.y as usize + j);
        if weight > 0.0 && raster.sample(column, row).is_some() {
            sum += weight * slope_of(raster, column, row);
            known += weight;
        }
    }
    if known > 0.0 { sum / known } else { DVec2::ZERO }
}
