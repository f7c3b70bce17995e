//! ROAM from frame to frame over a sea that moves.
//!
//! How far a triangle over a sea may be off depends on its size and on how steep the waves are at all, not on where it lies: one table of a number a level, made
//! anew at each instant, takes the place of prepared bounds. Over the longest side of a triangle, or a circle that holds it, those numbers fall from level to level, so
//! they are nested; and which triangles are worth drawing depends on the view and the instant alone.
//!
//! Heights are asked many together, after the choice. Those far away are not asked in each frame (1999: "far triangles not animated"): a height that is
//! a while old is off by at most
//!
//! ```text
//! late = rise speed of the sea (m/s) · age (s) · pixels a metre
//! ```
//!
//! pixels a metre being those of the box round all triangles that may meet in the vertex: the diamond that it is the middle of. A share of the tolerance is kept
//! for that, and a height is asked again before it is later than between half of the share and all of it, at a point drawn from the vertex's name and that instant: so
//! the work is spread over the frames. A vertex has one height, whoever meets there: there are no cracks between near and far.
//!
//! Works this rests on: M. Duchaineau et al., "ROAMing terrain: real-time optimally adapting meshes", 1997; spec page of 1999.

use super::super::factors::Slopes;
use super::super::scan::{Extent, around, priority_of_box, renewed};
use super::super::scratch::Order;
use super::*;
use crate::field::{HeightField, Sea};
use crate::lod::drawing::place;
use crate::space::{Cell, Datum};
use multiversion::multiversion;

/// ROAM over a moving sea, from frame to frame: of all that [`RoamFlight`] tells, and with one more argument, the sea at its instant.
pub type RoamSea = RoamFlight<'static, Waves>;

/// Bits of lattice coordinates below a step of the lists, so that sums of steps fit into 32 bits.
const SHIFT: u8 = 4;

/// The finest level of cells: a step is half of one.
const SEA_FINEST: u8 = Cell::MAX_LEVEL - 1 - SHIFT;

/// What a [`RoamSea`] knows of the sea: bounds at an instant, and how old heights are.
#[derive(Clone, Debug)]
pub struct Waves {
    datum: Datum,
    /// Lowest and highest height (m).
    range: [f32; 2],
    /// Greatest vertical distance to the surface (m), by the level of diamonds.
    deviations: [f32; 64],
    /// The share of the tolerance that heights may be late by.
    share: f32,
    /// When the height of each vertex was asked for (s); NaN where it is not used.
    asked: Vec<f64>,
    /// Pixels a metre at each vertex.
    pixels: Vec<f32>,
    due: Vec<u32>,
    places: Vec<Place>,
    heights: Vec<f32>,
}

impl Waves {
    /// Learns the bounds of a sea at its instant.
    fn learn(&mut self, sea: &Sea) {
        self.datum = sea.datum();
        let range = sea.range(Cell::face(0));
        self.range = [range.low, range.high];
        let Datum::Plane { size, .. } = self.datum else { return };
        for (level, deviation) in self.deviations.iter_mut().enumerate().take(2 * usize::from(SEA_FINEST) + 2) {
            // Both triangles of a square lie within the circle over its diagonal; those of a side within that over the longer of a cell's
            // sides: where they are acute, its apex being nearer than that, the circle through their corners is smaller.
            let across = if level % 2 == 0 { size.length() } else { size.max_element() };
            *deviation = sea.triangle_error((across / f64::from(1u32 << (level / 2))) as f32);
        }
    }

    /// The box round all that needs a diamond.
    #[inline(always)]
    fn extent(&self, lens: &Lens, item: &Item) -> Extent {
        let level = item.deviation.to_bits();
        let unit = u32::from(SEA_FINEST).wrapping_sub(level >> 1) & 31;
        around(lens, [item.at as i32, item.heights as i32], ((3 - (level & 1)) << unit) as i32, self.range)
    }

    #[inline(always)]
    fn number<const ERRORS: bool>(&self, lens: &Lens, item: &Item) -> f32 {
        let level = item.deviation;
        let deviation = self.deviations[(level.to_bits() & 63) as usize];
        priority_of_box::<ERRORS, false>(lens, self.extent(lens, item), true, deviation)
    }

    /// Pixels that a vertical metre covers at most in the triangles that may meet in a vertex; 0 out of sight.
    #[inline(always)]
    fn pixels_a_metre(&self, lens: &Lens, at: Point) -> f32 {
        // The middle of a diamond is as even as half a cell's side.
        let both = at[0] | at[1];
        let half = both & both.wrapping_neg();
        let square = u32::from(at[0] & half != 0) & u32::from(at[1] & half != 0);
        let steps = half.wrapping_mul(2 + square) >> SHIFT;
        let extent = around(lens, at.map(|c| (c >> SHIFT) as i32), steps as i32, self.range);
        priority_of_box::<true, false>(lens, extent, true, 1.0)
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_errors(waves: &Waves, lens: &Lens, items: &[Item], out: &mut [f32]) {
    out.iter_mut().zip(items).for_each(|(out, item)| *out = renewed(waves.number::<true>(lens, item), *out));
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_distances(waves: &Waves, lens: &Lens, items: &[Item], out: &mut [f32]) {
    out.iter_mut().zip(items).for_each(|(out, item)| *out = renewed(waves.number::<false>(lens, item), *out));
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn measure_vertices(waves: &Waves, lens: &Lens, vertices: &[Vertex], out: &mut [f32]) {
    out.iter_mut().zip(vertices).for_each(|(out, vertex)| *out = waves.pixels_a_metre(lens, [vertex.x, vertex.y]));
}

impl Ground for Waves {
    fn datum(&self) -> Datum {
        self.datum
    }

    #[inline]
    fn finest(&self) -> u8 {
        SEA_FINEST
    }

    fn voids(&self) -> bool {
        false
    }

    /// Asked for later, many together.
    #[inline]
    fn height(&self, _: Point) -> f32 {
        f32::NAN
    }

    /// There is water everywhere; all else the level says.
    #[inline]
    fn bound(&self, _: Diamond) -> Bound {
        Bound::WATER
    }

    #[inline]
    fn slopes(&self, _: Diamond) -> Option<Slopes> {
        None
    }

    /// The middle takes the room of the heights, and the level that of the deviation.
    #[inline]
    fn item(&self, _: Bound, diamond: Diamond, kind: u8, record: u32) -> Item {
        let [at, heights] = diamond.at.map(|c| c >> SHIFT);
        let deviation = f32::from_bits(u32::from(diamond.level()));
        Item { at, heights, deviation, word: Item::word(kind, diamond.is_square(), 1, record) }
    }

    #[inline]
    fn middle(&self, item: &Item) -> Point {
        [item.at << SHIFT, item.heights << SHIFT]
    }

    fn lens(&self, metric: &ScreenMetric, priority: Priority, factors: &Factors) -> Lens {
        let steps = f64::from(STEPS >> SHIFT);
        Lens::new(metric, self.datum, steps, (0.0, 1.0), priority, false, factors)
    }

    #[inline]
    fn priority(&self, lens: &Lens, item: &Item, slopes: Option<Slopes>) -> f32 {
        let number = match lens.priority {
            Priority::ScreenError => self.number::<true>(lens, item),
            Priority::InverseDistance => self.number::<false>(lens, item),
        };
        match &lens.weights {
            Some(weights) if number > 0.0 => {
                number * weights.of(&self.extent(lens, item), slopes.unwrap_or(Slopes::EMPTY))
            }
            _ => number,
        }
    }

    fn measure(&self, lens: &Lens, items: &[Item], slopes: &[Slopes], out: &mut [f32]) {
        match lens.priority {
            Priority::ScreenError => measure_errors(self, lens, items, out),
            Priority::InverseDistance => measure_distances(self, lens, items, out),
        }
        if let Some(weights) = &lens.weights {
            weights.weigh(|item| self.extent(lens, item), items, slopes, out);
        }
    }

    fn search(&self, _: &mut Search, _: &Lens, _: u8, _: f32, _: usize) -> Option<Order> {
        None
    }

    #[inline]
    fn expect_height(&self, _: Point) {}

    #[inline]
    fn expect_bound(&self, _: Diamond) {}

    #[inline]
    fn forget(&mut self, vertex: u32) {
        if let Some(asked) = self.asked.get_mut(vertex as usize) {
            *asked = f64::NAN;
        }
    }
}

impl RoamSea {
    /// A flight with nothing drawn yet.
    pub fn new(limits: Limits) -> RoamSea {
        RoamFlight::on(
            Waves {
                datum: Datum::Plane { origin: DVec2::ZERO, size: DVec2::ONE },
                range: [0.0; 2],
                deviations: [0.0; 64],
                share: 0.25,
                asked: Vec::new(),
                pixels: Vec::new(),
                due: Vec::new(),
                places: Vec::new(),
                heights: Vec::new(),
            },
            limits,
        )
    }

    /// The same with another share of the tolerance, from 0 to 0.9, that heights may be late by: 0 asks for all of them in each frame. By default a
    /// quarter.
    pub fn with_lateness(mut self, share: f32) -> RoamSea {
        self.bounds.share = if share > 0.0 { share.min(0.9) } else { 0.0 };
        self
    }

    /// Changes the mesh into that of `view` and of the sea's instant. `stop` is asked between steps of the choice of triangles, as over land, and once more when that is
    /// done: heights come after it.
    ///
    /// Which triangles are drawn depends on the view and the instant alone, and so does all else with a lateness of 0. With more, the heights of far vertices depend on
    /// when they were asked for, and what they may be off by is part of what is reached. It is always the same sea that is shown, at any instants;
    /// [`RoamFlight::restart`] comes before another.
    ///
    /// # Errors
    /// If the view is not one that a picture can be drawn of, or the sea lies on an ellipsoid.
    pub fn update(&mut self, sea: &Sea, view: &View, stop: &mut dyn FnMut() -> bool) -> Result<Reached, ViewError> {
        ScreenMetric::on_plane(view, sea.datum())?;
        if self.bounds.datum != sea.datum() {
            self.restart();
        }
        self.bounds.learn(sea);
        let speed = sea.rise_speed();
        let share = if speed.is_finite() { self.bounds.share } else { 0.0 };
        let sharper = View { tolerance_pixels: view.tolerance_pixels * (1.0 - share), ..*view };
        let reached = self.advance(&sharper, stop)?;
        stop();
        let late = self.raise(sea, speed, view.tolerance_pixels * share);
        Ok(Reached { pixels: reached.pixels + late, ..reached })
    }

    /// How many heights the last update asked for.
    pub fn heights_asked(&self) -> usize {
        self.bounds.due.len()
    }

    /// Asks for the heights that are new, or too late by more than `room` pixels; returns by how much the others may be.
    fn raise(&mut self, sea: &Sea, speed: f32, room: f32) -> f32 {
        let Some(lens) = &self.lens else { return 0.0 };
        let vertices = &mut self.mesh.vertices;
        let waves = &mut self.bounds;
        waves.asked.resize(vertices.len(), f64::NAN);
        let mut pixels = std::mem::take(&mut waves.pixels);
        pixels.resize(vertices.len(), 0.0);
        measure_vertices(waves, lens, vertices, &mut pixels);
        // What meets in a corner may be as large as the face.
        let corner = waves.pixels_a_metre(lens, Diamond::ROOT.at);
        pixels[..CORNERS.len()].fill(corner);
        waves.pixels = pixels;
        waves.due.clear();
        waves.places.clear();
        let (now, mut latest) = (sea.time(), 0.0f32);
        for (i, (vertex, (&asked, &pixels))) in (0..).zip(vertices.iter().zip(waves.asked.iter().zip(&waves.pixels))) {
            let late = speed * ((now - asked).abs() as f32) * pixels;
            let used = !asked.is_nan();
            if vertex.height.is_nan() || used && (room <= 0.0 || late > room * patience([vertex.x, vertex.y], asked)) {
                waves.due.push(i);
                waves.places.push(place(0, [vertex.x, vertex.y]));
            } else {
                // What is not used is not late.
                latest = latest.max(late);
            }
        }
        waves.heights.resize(waves.due.len(), 0.0);
        sea.heights(&waves.places, &mut waves.heights);
        for (&vertex, &height) in waves.due.iter().zip(&waves.heights) {
            vertices[vertex as usize].height = height;
            waves.asked[vertex as usize] = now;
            Changes::mark(&mut self.changed.vertices, vertex);
        }
        latest
    }
}

/// A number in [½, 1) of a vertex that was asked at an instant: another each time, lest those that are equally far be due together again and again.
#[inline(always)]
fn patience([x, y]: Point, asked: f64) -> f32 {
    let asked = asked.to_bits();
    let mixed = (x ^ y.rotate_left(15) ^ (asked ^ asked >> 29) as u32).wrapping_mul(0x9e37_79b1);
    let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca6b);
    0.5 + (mixed >> 8) as f32 * f32::EPSILON * 0.25
}
