//! A method at work over one land, frame after frame.

use crate::settings::Detail;
use littoral::field::{HeightField, Land, Sea};
use littoral::lod::{Drawing, Limits, Lod, Mesh, Method, NestedBounds, Reached, RoamFlight, ViewError};
use littoral::space::{Datum, View};
use std::cell::OnceCell;

/// A method of detail, and what it keeps from frame to frame.
pub struct Chooser<'a> {
    land: &'a Land,
    /// What ROAM needs to go on from frame to frame, made when it is first wanted.
    bounds: &'a OnceCell<Option<NestedBounds>>,
    detail: Detail,
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
    pub fn new(land: &'a Land, bounds: &'a OnceCell<Option<NestedBounds>>, detail: Detail) -> Chooser<'a> {
        let limits = Limits { finest: land.finest_level(), triangles: detail.triangles as usize };
        let flight = match detail.method {
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
            detail,
            ground: detail.method.within(limits),
            flight,
            water: None,
            ground_drawing: Drawing::default(),
            water_drawing: Drawing::default(),
        }
    }

    /// Goes on as wished: another method or another limit begins anew, another tolerance does not.
    pub fn follow(&mut self, detail: Detail) {
        if (detail.method, detail.triangles) != (self.detail.method, self.detail.triangles) {
            *self = Chooser::new(self.land, self.bounds, detail);
        }
        self.detail = detail;
    }

    /// How it chooses.
    pub fn detail(&self) -> Detail {
        self.detail
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
        let detail = self.detail;
        let lod = self.water.get_or_insert_with(|| {
            let side = match sea.datum() {
                Datum::Plane { size, .. } => size.max_element(),
                Datum::Ellipsoid { equatorial_radius, .. } => equatorial_radius,
            };
            let finest = (side / SMALLEST).log2().ceil().clamp(0.0, 30.0) as u8;
            detail.method.within(Limits { finest, triangles: detail.triangles as usize })
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
