//! The sea: water that waves move, as a height field and as answers about its heights, slopes and currents.
//!
//! Models of waves tell where water *goes* that rests at a place X: to X + D(X), raised by η(X). A question is about where it *is*: which X
//! has X + D(X) = x? The answer is found by iteration: X ← x − D(X), which converges where neighbouring water keeps its order, and Newton's
//! method for what that leaves (after J. Tessendorf, "Simulating ocean water", 1999, whose choppy waves these are). What is left of the
//! difference is told. Where waves fold over, which real ones do only when they break, one of the surfaces is named.
//!
//! One function serves pictures, queries and meshes, so that a boat floats on the water that is seen.

mod build;

use super::{HeightField, HeightRange, Land, Water};
use crate::space::{Cell, Datum, Place};
use crate::waves::{BLOCK, Bounds, Motion, Points, Velocity, WaveModel};
use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

/// A sea at an instant.
pub struct Sea {
    models: Vec<Box<dyn WaveModel>>,
    /// Height of still water (m).
    level: f64,
    datum: Datum,
    bounds: Bounds,
    time: f64,
    finest: Finest,
    rises: [Rise; OCTAVES],
}

/// How fast the surface can be expected to rise over a distance d: by no more than `jump` + `slope` · d, all but never.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Rise {
    /// What waves shorter than some length rise at once (m).
    pub jump: f32,
    /// How steep the others are.
    pub slope: f32,
}

/// Lengths at which waves are told short from long, each twice the one before.
const OCTAVES: usize = 12;
/// The shortest of them (m).
const SHORTEST: f32 = 0.125;

/// The ripples that are too fine for any model: slopes without heights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Finest {
    /// Variance of their slopes in each direction.
    pub variance: f32,
    /// Where the wind blows them to (rad, counter-clockwise from x).
    pub heading: f64,
    /// Its speed 10 m above the sea (m/s).
    pub wind: f64,
}

impl std::fmt::Debug for Sea {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Sea { models, level, datum, bounds, time, finest, .. } = self;
        let models = models.len();
        f.debug_struct("Sea")
            .field("models", &models)
            .field("level", level)
            .field("datum", datum)
            .field("bounds", bounds)
            .field("time", time)
            .field("finest", finest)
            .finish_non_exhaustive()
    }
}

/// The water's surface at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Height (m above the datum).
    pub height: f64,
    /// Slopes ∂z/∂x and ∂z/∂y of the surface there.
    pub slope: Vec2,
    /// Covariances (xx, xy, yy) of the slopes of waves finer than the footprint asked for.
    pub hidden: Vec3,
    /// How much of the surface is foam, in [0, 1].
    pub foam: f32,
    /// Where this water rests when the sea is calm (m).
    pub rest: DVec2,
    /// Distance (m) between the place asked about and where the water named in `rest` is: no more than [`Sea::TOLERANCE`], save
    /// where waves fold over.
    pub residual: f32,
}

impl Surface {
    /// Upward unit normal.
    pub fn normal(&self) -> Vec3 {
        Vec3::new(-self.slope.x, -self.slope.y, 1.0).normalize()
    }
}

/// What [`Sea::find`] tells about a block of places.
pub(crate) struct Found {
    /// Where the water there rests.
    pub rest: Points,
    /// How it moves.
    pub motion: Motion,
    /// How far off the answer is (m).
    pub residual: [f32; BLOCK],
}

impl Sea {
    /// How near (m, sideways) an answer is to the place asked about. Its height is off by no more than that times the slope.
    pub const TOLERANCE: f32 = 5e-4;

    /// Still water at a level (m), to which models of waves may be added, over a datum, which must be a plane.
    pub fn new(datum: Datum, level: f64) -> Sea {
        Sea {
            models: Vec::new(),
            level,
            datum,
            bounds: Bounds::default(),
            time: 0.0,
            finest: Finest::default(),
            rises: [Rise::default(); OCTAVES],
        }
    }

    /// The ripples that are too fine for its models.
    pub fn finest(&self) -> Finest {
        self.finest
    }

    /// The same with the waves of another model.
    pub fn with(mut self, mut model: Box<dyn WaveModel>) -> Sea {
        model.set_time(self.time);
        self.models.push(model);
        self.bound();
        self
    }

    /// The models whose waves are added up. Ask one as [`std::any::Any`] which it is.
    pub fn models(&self) -> impl Iterator<Item = &dyn WaveModel> {
        self.models.iter().map(|model| model.as_ref())
    }

    /// Goes to an instant (s), forward or back; what is answered there depends on that instant alone.
    pub fn set_time(&mut self, seconds: f64) {
        self.time = seconds;
        self.models.iter_mut().for_each(|m| m.set_time(seconds));
        self.bound();
    }

    /// The instant it stands at (s).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Height of still water (m).
    pub fn level(&self) -> f64 {
        self.level
    }

    /// How far its waves go at this instant.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn bound(&mut self) {
        self.bounds = self.models.iter().fold(Bounds::default(), |sum, model| {
            let b = model.bounds();
            Bounds {
                height: sum.height + b.height,
                sideways: sum.sideways + b.sideways,
                slope: sum.slope + b.slope,
                stretch: sum.stretch + b.stretch,
                curvature: sum.curvature + b.curvature,
                bend: sum.bend + b.bend,
            }
        });
        // Roughness is about six standard deviations: slopes of 3½ are all but never passed.
        let length = |octave: usize| SHORTEST * (1u32 << octave) as f32;
        let rough = |wavelength: f32| self.models.iter().map(|m| m.roughness(wavelength)).sum::<f32>();
        let mut square = 0.0;
        let mut above = self.bounds.height;
        for octave in (0..OCTAVES).rev() {
            let (below, wavenumber) = (rough(length(octave)), std::f32::consts::TAU / length(octave));
            // Waves between this length and twice it.
            square += (above * above - below * below).max(0.0) * (wavenumber * wavenumber) * (3.5f32 / 6.0).powi(2);
            let slope = square.sqrt().min(self.bounds.slope);
            self.rises[octave] = Rise { jump: 1.2 * below, slope };
            above = below;
        }
    }

    /// How the surface can be expected to rise: for short distances the first of these is the least, for long ones the last.
    pub(crate) fn rises(&self) -> &[Rise] {
        &self.rises
    }

    /// Height of the water (m above the datum) at a place (m).
    pub fn height_at(&self, at: DVec2) -> f64 {
        let found = self.find_displaced(&Points::at(at.x, at.y));
        self.level + f64::from(found.motion.dz[0])
    }

    /// Heights of the water at many places, worked out in parallel; to the bit what [`Sea::height_at`] says.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn heights_at(&self, places: &[DVec2], heights: &mut [f64]) {
        assert_eq!(places.len(), heights.len(), "expected as many heights as places");
        let blocks = places.par_chunks(BLOCK).zip(heights.par_chunks_mut(BLOCK));
        blocks.with_min_len(64).for_each(|(places, heights)| {
            let found = self.find_displaced(&block(places));
            for (height, dz) in heights.iter_mut().zip(found.motion.dz) {
                *height = self.level + f64::from(dz);
            }
        });
    }

    /// The surface of the water at a place (m), without what is finer than a footprint (m, 0 for everything).
    pub fn surface_at(&self, at: DVec2, footprint: f32) -> Surface {
        let points = Points { footprint: [footprint; BLOCK], ..Points::at(at.x, at.y) };
        self.surface(&self.find(&points, None, 0.0), 0)
    }

    /// The surface at many places, in parallel; to the bit what [`Sea::surface_at`] says.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn surfaces_at(&self, places: &[DVec2], footprint: f32, surfaces: &mut [Surface]) {
        assert_eq!(places.len(), surfaces.len(), "expected as many surfaces as places");
        let blocks = places.par_chunks(BLOCK).zip(surfaces.par_chunks_mut(BLOCK));
        blocks.with_min_len(32).for_each(|(places, surfaces)| {
            let points = Points { footprint: [footprint; BLOCK], ..block(places) };
            let found = self.find(&points, None, 0.0);
            for (lane, surface) in surfaces.iter_mut().enumerate() {
                *surface = self.surface(&found, lane);
            }
        });
    }

    /// How high (m) above still water its waves run up a beach at a place (m), at most: 0 away from shores.
    pub fn run_up(&self, at: DVec2) -> f32 {
        self.models.iter().map(|m| m.run_up(at)).fold(0.0, f32::max)
    }

    /// Velocities (m/s) of the water at many points (m), at its surface or below it; points above it have that of the surface below
    /// them. Depth counts from the moving surface (J. Wheeler 1970, "stretching").
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn velocities_at(&self, points: &[DVec3], velocities: &mut [Vec3]) {
        assert_eq!(points.len(), velocities.len(), "expected as many velocities as points");
        let blocks = points.par_chunks(BLOCK).zip(velocities.par_chunks_mut(BLOCK));
        blocks.with_min_len(32).for_each(|(points, velocities)| {
            let places: [DVec2; BLOCK] = std::array::from_fn(|i| points[i.min(points.len() - 1)].truncate());
            let found = self.find_displaced(&block(&places));
            let depth = |i: usize| {
                let surface = self.level + f64::from(found.motion.dz[i]);
                (surface - points[i.min(points.len() - 1)].z).max(0.0) as f32
            };
            let depths: [f32; BLOCK] = std::array::from_fn(depth);
            let mut moved = Velocity::STILL;
            self.models.iter().for_each(|m| m.add_velocity(&found.rest, &depths, &mut moved));
            for (lane, velocity) in velocities.iter_mut().enumerate() {
                *velocity = Vec3::new(moved.x[lane], moved.y[lane], moved.z[lane]);
            }
        });
    }

    /// The velocity (m/s) of the water at a point (m): see [`Sea::velocities_at`].
    pub fn velocity_at(&self, point: DVec3) -> Vec3 {
        let mut velocity = [Vec3::ZERO];
        self.velocities_at(&[point], &mut velocity);
        velocity[0]
    }

    /// Which water is at some places, to within [`Sea::TOLERANCE`] or a share `fine` of the footprint, and everything about its motion. A guess of
    /// where it rests saves time.
    pub(crate) fn find(&self, places: &Points, guess: Option<&Points>, fine: f32) -> Found {
        let mut found = self.find_to(places, guess, fine);
        found.motion = Motion::STILL;
        self.models.iter().for_each(|m| m.add_motion(&found.rest, &mut found.motion));
        found
    }

    /// Adds the displacement of the water that rests at some places.
    pub(crate) fn displacement(&self, rest: &Points, motion: &mut Motion) {
        self.models.iter().for_each(|m| m.add_displacement(rest, motion));
    }

    /// Which water is at some places.
    fn find_displaced(&self, places: &Points) -> Found {
        self.find_to(places, None, 0.0)
    }

    fn find_to(&self, places: &Points, guess: Option<&Points>, fine: f32) -> Found {
        /// Plain iterations, and those with Newton's method after them.
        const PLAIN: usize = 4;
        const NEWTON: usize = 8;
        let mut rest = *guess.unwrap_or(places);
        rest.footprint = places.footprint;
        let mut motion = Motion::STILL;
        let mut residual = [0.0f32; BLOCK];
        for iteration in 0..=PLAIN + NEWTON {
            let newton = iteration > PLAIN;
            motion = Motion::STILL;
            for model in &self.models {
                match newton {
                    true => model.add_motion(&rest, &mut motion),
                    false => model.add_displacement(&rest, &mut motion),
                }
            }
            let mut open = false;
            #[allow(clippy::needless_range_loop, reason = "a lane of many arrays")]
            for i in 0..BLOCK {
                let off_x = (places.x[i] - rest.x[i] - f64::from(motion.dx[i])) as f32;
                let off_y = (places.y[i] - rest.y[i] - f64::from(motion.dy[i])) as f32;
                residual[i] = (off_x * off_x + off_y * off_y).sqrt();
                // A point that has arrived stays, whatever the others of its block do.
                if residual[i] > Sea::TOLERANCE.max(fine * rest.footprint[i]) && iteration < PLAIN + NEWTON {
                    open = true;
                    let (mut step_x, mut step_y) = (off_x, off_y);
                    if newton {
                        let (a, b, c) = (1.0 + motion.dxx[i], motion.dxy[i], 1.0 + motion.dyy[i]);
                        let area = a * c - b * b;
                        if area > 0.05 {
                            step_x = (c * off_x - b * off_y) / area;
                            step_y = (a * off_y - b * off_x) / area;
                        } else {
                            (step_x, step_y) = (0.5 * off_x, 0.5 * off_y);
                        }
                    }
                    rest.x[i] += f64::from(step_x);
                    rest.y[i] += f64::from(step_y);
                }
            }
            if !open {
                break;
            }
        }
        Found { rest, motion, residual }
    }

    /// The surface at one place of a block, in the terms of those who look at it from outside.
    pub(crate) fn surface(&self, found: &Found, lane: usize) -> Surface {
        let m = &found.motion;
        let (a, b, c) = (1.0 + m.dxx[lane], m.dxy[lane], 1.0 + m.dyy[lane]);
        // Slopes over where water is are those over where it rests, through the inverse of the map between them.
        let area = (a * c - b * b).max(0.05);
        let (sx, sy) = (m.slope_x[lane], m.slope_y[lane]);
        Surface {
            height: self.level + f64::from(m.dz[lane]),
            slope: Vec2::new((c * sx - b * sy) / area, (a * sy - b * sx) / area),
            hidden: Vec3::new(
                m.hidden_xx[lane] + self.finest.variance,
                m.hidden_xy[lane],
                m.hidden_yy[lane] + self.finest.variance,
            ),
            foam: m.foam[lane],
            rest: DVec2::new(found.rest.x[lane], found.rest.y[lane]),
            residual: found.residual[lane],
        }
    }

    /// Greatest vertical distance (m) from the surface to a triangle over it, anywhere, that fits into a circle of a diameter (m).
    pub(crate) fn triangle_error(&self, diameter: f32) -> f32 {
        let b = &self.bounds;
        let mut error = (2.0 * b.height).min(self.steepest() * diameter);
        if b.stretch < 1.0 {
            // Second derivatives through the inverse map, and a triangle no point of which is farther than the circle's radius from its
            // nearest corner: |f − f_drawn| ≤ κ (diameter / 2)² / 2.
            let left = 1.0 - b.stretch;
            let curvature = b.curvature / (left * left) + b.slope * b.bend / (left * left * left);
            error = error.min(0.125 * curvature * diameter * diameter);
        }
        error + 2.0 * Sea::TOLERANCE * b.slope.min(1.0) + 4e-7 * (self.level.abs() as f32 + b.height)
    }

    /// How fast (m/s) the surface goes up or down at a place, at most: see [`WaveModel::rise_speed`].
    pub fn rise_speed(&self) -> f32 {
        self.models.iter().map(|model| model.rise_speed()).sum()
    }

    /// Greatest slope of the surface, infinite where waves may fold.
    fn steepest(&self) -> f32 {
        let b = &self.bounds;
        if b.stretch < 1.0 { b.slope / (1.0 - b.stretch) } else { f32::INFINITY }
    }
}

/// A block of up to [`BLOCK`] places; the last fills what is over.
fn block(places: &[DVec2]) -> Points {
    let last = places.len() - 1;
    Points {
        x: std::array::from_fn(|i| places[i.min(last)].x),
        y: std::array::from_fn(|i| places[i.min(last)].y),
        footprint: [0.0; BLOCK],
    }
}

/// The sea at its instant. There is water everywhere: where land is higher, it hides it.
impl HeightField for Sea {
    fn datum(&self) -> Datum {
        self.datum
    }

    fn height(&self, at: Place) -> Option<f32> {
        let world = self.datum.world(at, 0.0).0;
        Some(self.height_at(world.truncate()) as f32)
    }

    fn range(&self, _: Cell) -> HeightRange {
        // The same everywhere: asking the water itself would cost more than a tighter answer saves.
        let level = self.level as f32;
        let all = self.bounds.height + 1e-6 * (level.abs() + self.bounds.height);
        HeightRange { low: level - all, high: level + all }
    }

    fn error(&self, cell: Cell) -> f32 {
        self.triangle_error((cell.side() * self.datum.metres_per_uv(cell.centre())).length() as f32)
    }

    fn stencil_error(&self, cell: Cell, depth: u8) -> f32 {
        // The same for all cells of a size.
        let finer = depth.min(Cell::MAX_LEVEL - cell.level);
        self.error(Cell { level: cell.level + finer, x: cell.x << finer, y: cell.y << finer, ..cell })
    }

    fn row(&self, first: Cell, ranges: &mut [HeightRange], errors: &mut [f32]) {
        ranges.fill(self.range(first));
        self.errors(first, errors.len().max(1), errors);
    }

    fn errors(&self, first: Cell, _: usize, errors: &mut [f32]) {
        errors.fill(self.error(first));
    }

    fn heights(&self, places: &[Place], heights: &mut [f32]) {
        assert_eq!(places.len(), heights.len(), "expected as many heights as places");
        places.par_chunks(BLOCK).zip(heights.par_chunks_mut(BLOCK)).with_min_len(64).for_each(|(places, heights)| {
            let worlds: [DVec2; BLOCK] =
                std::array::from_fn(|i| self.datum.world(places[i.min(places.len() - 1)], 0.0).0.truncate());
            let found = self.find_displaced(&block(&worlds));
            for (height, dz) in heights.iter_mut().zip(found.motion.dz) {
                *height = (self.level + f64::from(dz)) as f32;
            }
        });
    }
}
