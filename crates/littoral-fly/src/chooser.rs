//! A method at work over one land, frame after frame.

use littoral::field::{HeightField, Land, Sea};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Method, NestedBounds, Reached, RoamFlight, ViewError};
use littoral::space::{Datum, View};
use std::cell::OnceCell;

/// A method of detail, and what it keeps from frame to frame.
pub struct Chooser<'a> {
    land: &'a Land,
    /// What ROAM needs to go on from frame to frame, made when it is first wanted.
    bounds: &'a OnceCell<Option<NestedBounds>>,
    method: Method,
    triangles: usize,
    ground: Box<dyn Lod>,
    flight: Option<RoamFlight<'a>>,
    water: Option<Box<dyn Lod>>,
    ground_drawing: Drawing,
    water_drawing: Drawing,
}

/// No cell of water is smaller than this (m).
const SMALLEST: f64 = 0.25;

impl<'a> Chooser<'a> {
    /// A method over a land, with nothing chosen yet.
    pub fn new(
        land: &'a Land,
        bounds: &'a OnceCell<Option<NestedBounds>>,
        method: Method,
        triangles: usize,
    ) -> Chooser<'a> {
        let limits = Limits { finest: land.finest_level(), triangles };
        let flight = match method {
            // Land that is too large for a flight is served by ROAM anew for each frame.
            Method::Roam => bounds
                .get_or_init(|| NestedBounds::of(land).ok())
                .as_ref()
                .map(|bounds| RoamFlight::over(bounds, limits)),
            _ => None,
        };
        Chooser {
            land,
            bounds,
            method,
            triangles,
            ground: method.within(limits),
            flight,
            water: None,
            ground_drawing: Drawing::default(),
            water_drawing: Drawing::default(),
        }
    }

    /// Goes on with another method or another limit, if they are others.
    pub fn follow(&mut self, method: Method, triangles: usize) {
        if (method, triangles) != (self.method, self.triangles) {
            *self = Chooser::new(self.land, self.bounds, method, triangles);
        }
    }

    /// The triangles of the ground for a view.
    pub fn ground(&mut self, view: &View) -> Result<(Mesh, Reached), ViewError> {
        match &mut self.flight {
            Some(flight) => {
                let reached = flight.update(view, &mut || false)?;
                Ok((flight.mesh().clone(), reached))
            }
            None => choose(&mut *self.ground, self.land, view, &mut self.ground_drawing),
        }
    }

    /// The triangles of a sea for a view.
    pub fn water(&mut self, sea: &Sea, view: &View) -> Result<(Mesh, Reached), ViewError> {
        let (method, triangles) = (self.method, self.triangles);
        let lod = self.water.get_or_insert_with(|| {
            let side = match sea.datum() {
                Datum::Plane { size, .. } => size.max_element(),
                Datum::Ellipsoid { equatorial_radius, .. } => equatorial_radius,
            };
            let finest = (side / SMALLEST).log2().ceil().clamp(0.0, 30.0) as u8;
            method.within(Limits { finest, triangles })
        });
        choose(&mut **lod, sea, view, &mut self.water_drawing)
    }
}

fn choose(
    lod: &mut dyn Lod,
    field: &dyn HeightField,
    view: &View,
    drawing: &mut Drawing,
) -> Result<(Mesh, Reached), ViewError> {
    let reached = lod.select(field, view, drawing)?;
    drawing.expand(field);
    Ok((std::mem::take(&mut drawing.mesh), reached))
}
