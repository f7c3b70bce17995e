//! A sea from a state: which model carries which waves.
//!
//! Over a bed the waves that hold the energy are discrete ones, carried over the bed by [`ShoreSea`]: they refract, shoal, break and run on,
//! outside the bed's grid, as the plane waves they are, so that there is no border. Waves shorter than those hardly feel the bottom; they are tiles,
//! lower where land shelters the long ones or depth leaves no room. In the open sea tiles carry everything.

use super::{Finest, Land, Sea, Water};
use crate::space::Datum;
use crate::waves::cascades::{Cascades, Options};
use crate::waves::shore::{Bed, Settings, ShoreError, ShoreSea};
use crate::waves::{OutOfRange, STANDARD_GRAVITY, SeaState, Shelter, Sheltered, StillWater, components};
use glam::DVec2;
use std::f64::consts::TAU;

/// Discrete waves over a bed.
const COMPONENTS: usize = 32;
/// Nodes of the bed's grid along its longer side, at most.
const NODES: usize = 640;
/// Up to this times the highest peak's frequency waves are carried over the bed.
const CARRIED: f64 = 1.8;

impl Sea {
    /// The open sea of a state, at a level (m), as deep as the state says.
    ///
    /// # Errors
    /// If a number of the state makes no sense.
    pub fn of_state(datum: Datum, level: f64, state: &SeaState) -> Result<Sea, OutOfRange> {
        let sea = Sea::new(datum, level);
        if state.trains.is_empty() {
            return Ok(sea);
        }
        let options = Options::default();
        Ok(sea.with(Box::new(Cascades::new(state, &options)?)).with_finest(state, &options))
    }

    /// The sea of a state over `water` on `land`, whose bed its waves feel. Where the state has no depth of its own, that of the open sea is
    /// the land's along its border. `progress` is told now and then, from any thread, which part of the work is done, and answers whether to
    /// go on.
    ///
    /// # Errors
    /// If a number of the state makes no sense, nothing lies under water, or `progress` said so.
    pub fn over(
        land: &Land,
        water: &Water,
        state: &SeaState,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Sea, ShoreError> {
        let sea = Sea::new(Datum::Plane { origin: land.origin(), size: land.extent() }, water.level);
        let Some((low, high)) = state.band() else { return Ok(sea) };
        let bed = bed_of(land, water)?;
        let mut state = state.clone();
        if state.depth.is_infinite() {
            state.depth = bed.edge_depth();
        }
        let split = 0.1 * CARRIED * high;
        let carried = components::drawn(&state, COMPONENTS, low, split);
        let settings = Settings { breaking: state.breaking as f32, ..Settings::default() };
        let shore = ShoreSea::of_waves(&bed, &carried, state.depth, &settings, progress)?;
        let options = Options { lowest: state.water().wavenumber(TAU * split), ..Options::default() };
        let short = 4.0 * libm::sqrt(state.moment(0, split, 20.0 * high));
        let shelter = shelter(&bed, &shore, short)?;
        // Short waves run over water that is deep for them.
        let deep = SeaState { depth: StillWater::DEEP.depth, ..state.clone() };
        let tiles = Sheltered::new(Box::new(Cascades::new(&deep, &options)?), shelter);
        Ok(sea.with(Box::new(shore)).with(Box::new(tiles)).with_finest(&state, &options))
    }

    /// The same with ripples too fine for any model, so that all slopes together are those that C. Cox and W. Munk (1954) saw under the state's
    /// wind: 0.003 + 0.00508 U, of which the models have those of wave numbers up to the options' highest.
    fn with_finest(mut self, state: &SeaState, options: &Options) -> Sea {
        let seen = 0.003 + 5.08e-3 * state.wind.speed;
        let highest = StillWater::DEEP.angular_frequency(options.highest) / TAU;
        let modelled = state.band().map_or(0.0, |(low, _)| {
            // Slopes are k = (2πf)²/g times heights.
            libm::pow(TAU, 4.0) / (STANDARD_GRAVITY * STANDARD_GRAVITY) * state.moment(4, low, highest)
        });
        let left = (seen - modelled).max(0.15 * seen);
        self.finest = Finest { variance: (0.5 * left) as f32, heading: state.wind.heading, wind: state.wind.speed };
        self
    }
}

/// The bed of the sea, coarse enough to be solved over in a moment.
fn bed_of(land: &Land, water: &Water) -> Result<Bed, OutOfRange> {
    let raster = land.raster();
    let (columns, rows) = (raster.columns(), raster.rows());
    let stride = columns.max(rows).div_ceil(NODES).max(1);
    let (across, up) = ((columns - 1) / stride + 1, (rows - 1) / stride + 1);
    let (mut depths, mut sea) = (Vec::with_capacity(across * up), Vec::with_capacity(across * up));
    for row in 0..up {
        for column in 0..across {
            // The mean about the node; unknown where a void, or a surface in place of a bed, is part of it.
            let (mut sum, mut count, mut known) = (0.0, 0, true);
            let half = stride / 2;
            for j in (row * stride).saturating_sub(half)..(row * stride + half + 1).min(rows) {
                for i in (column * stride).saturating_sub(half)..(column * stride + half + 1).min(columns) {
                    let at = j * columns + i;
                    let depth = water.level - f64::from(raster.heights()[at]);
                    known &= !water.is_unsounded(land, at);
                    sum += depth;
                    count += 1;
                }
            }
            depths.push(if known { (sum / f64::from(count)) as f32 } else { f32::NAN });
            sea.push(water.floods(row * stride * columns + column * stride));
        }
    }
    let spacing = raster.spacing() * stride as f64;
    assume(&mut depths, &sea, across, spacing.min_element());
    Bed::new(land.origin(), spacing, across, up, depths, |i| sea[i])
}

/// Where no bed is known under the sea it falls off from the shore, one in forty, to 40 m.
fn assume(depths: &mut [f32], sea: &[bool], columns: usize, spacing: f64) {
    let unknown = |i: usize, depths: &[f32]| sea[i] && depths[i].is_nan();
    if !(0..depths.len()).any(|i| unknown(i, depths)) {
        return;
    }
    // Distances to what is known, by two sweeps (G. Borgefors, "Distance transformations in digital images", 1986).
    let mut away: Vec<f32> = (0..depths.len()).map(|i| if unknown(i, depths) { f32::INFINITY } else { 0.0 }).collect();
    let rows = depths.len() / columns;
    for pass in 0..2 {
        for n in 0..depths.len() {
            let i = if pass == 0 { n } else { depths.len() - 1 - n };
            let (c, r) = ((i % columns) as i64, (i / columns) as i64);
            let back = if pass == 0 { -1 } else { 1 };
            for (dc, dr, far) in [(back, 0, 1.0), (0, back, 1.0), (back, back, 1.4), (-back, back, 1.4)] {
                let (c, r) = (c + dc, r + dr);
                if c >= 0 && r >= 0 && c < columns as i64 && r < rows as i64 {
                    away[i] = away[i].min(away[r as usize * columns + c as usize] + far);
                }
            }
        }
    }
    for i in 0..depths.len() {
        if unknown(i, depths) {
            depths[i] = (away[i] * spacing as f32 / 40.0).clamp(0.3, 40.0);
        } else if depths[i].is_nan() {
            depths[i] = -1.0;
        }
    }
}

/// How land shelters waves that are not carried over the bed, of a significant height (m): as it does those that are, and by leaving them no more
/// height than half the depth.
fn shelter(bed: &Bed, shore: &ShoreSea, height: f64) -> Result<Shelter, OutOfRange> {
    let (columns, rows, spacing) = (bed.columns(), bed.rows(), bed.spacing());
    let (low, high) = shore.extent();
    let open = shore.climate(2.0 * high.x - low.x + 1e4, 2.0 * high.y - low.y + 1e4).significant_height.max(1e-4);
    let factor = |i: usize| {
        let at = bed.origin() + spacing * DVec2::new((i % columns) as f64, (i / columns) as f64);
        let climate = shore.climate(at.x, at.y);
        let most = 0.5 * bed.depths()[i].max(0.0) / (height as f32).max(1e-3);
        // Smoothly towards 1.
        let room = most / (1.0 + most * most * most * most).sqrt().sqrt();
        // Rounding may carry the last bit beyond 1.
        ((climate.significant_height / open).min(1.0) * room).clamp(0.0, 1.0)
    };
    Shelter::new(bed.origin(), spacing, columns, rows, (0..columns * rows).map(factor).collect())
}
