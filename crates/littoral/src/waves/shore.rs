//! The shore: a sea of single waves over a real sea bed.
//!
//! Every wave of the sea is carried over the bed by the mild-slope equation (see `march`): it slows, bunches, turns towards the beach, grows,
//! reaches round headlands and islands into their shadow, and breaks where all waves together are too high for the depth. What is kept is, for
//! every wave and node, its amplitude and its phase relative to the wave it would be over the uniform depth of the open sea; between
//! nodes both are interpolated bilinearly, phases by the shorter way round. Outside the grid are those waves of the open sea themselves, so
//! there is no border. Each of them runs with its own frequency: any instant can be asked for.
//!
//! Near the shore waves are no sines: their sum takes the shape of T. Abreu et al. 2010, crests sharp, troughs flat, fronts steep,
//! by as much as B. Ruessink, G. Ramaekers and L. van Rijn 2012 measured for the Ursell number of the place (see `shape`).
//!
//! *How right it is* (`tests/shore.rs`). On a plane beach Snell's and Green's laws hold within 0.1 %, the flux of energy over shoals within 1.2 %.
//! Behind a half-plane the amplitude is that of A. Sommerfeld's soft screen to 0.03 (rms; 0.08 at worst) of the incoming one within 45° of the
//! shadow's edge. Round an island with a shelf that turns waves right round, phases are within 1.2 % (rms) of those of a fine solution in time, and within 2 %
//! at 94 of 100 places, but not on the shelf's lee flanks: waves arrive there that have turned by more than a march can follow, and neither more terms
//! of the fraction nor a finer grid brings them back. Phases are kept
//! to 5·10⁻⁵ rad and amplitudes to 6·10⁻⁵ of the incoming ones; linear interpolation of phases errs by an eighth of what the step of the relative
//! phase from node to node changes by: 10⁻³ rad in 2 m of water on a slope of 1 : 30 with nodes 2 m apart. Slopes are the exact derivative
//! of that surface, which has a kink of the same order at the borders of cells.
//!
//! *What is approximate.* Waves run forward only (none comes back from a cliff). Each marches along the side of the grid nearest to its
//! heading, at most 45° off, about its own direction by Snell's law; what turns further than some 75° from that side is lost. Waves shorten to no
//! less than what a grid resolves: their wave number grows by at most 2.4 per node. Currents and the wind over the shoal are not there.

mod bed;
mod lanes;
#[allow(clippy::needless_range_loop, reason = "lanes are counted over several arrays at once")]
mod march;
#[allow(clippy::needless_range_loop, reason = "lanes are counted over several arrays at once")]
mod measure;
#[allow(clippy::needless_range_loop, reason = "lanes are counted over several arrays at once")]
mod query;
#[allow(clippy::needless_range_loop, reason = "lanes are counted over several arrays at once")]
mod shape;
mod solve;
mod tables;

pub use bed::{Bed, Frame, Surf};
pub use tables::{ShoreTables, ShoreWave};

use super::{BLOCK, Bounds, Motion, OutOfRange, PlaneWave, Points, SeaState, Velocity, WaveModel, components};
use glam::DVec2;
use lanes::LANES;
use march::{Record, UNITS};
use rayon::prelude::*;
use shape::Place;
use solve::{Scratch, squeeze, stretch};
use std::f64::consts::TAU;

/// Significant height over depth at which waves break: J. McCowan's limit of 1894.
pub const BREAKING: f32 = 0.78;

/// How waves are carried over a bed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Significant height over depth at which waves break, from 0.1 to 2.
    pub breaking: f32,
    /// Standard deviation (m) of the Gaussian that smooths the bed, for the mild-slope equation wants mild slopes; by itself 7 % of a wavelength.
    pub smoothing: Option<f64>,
    /// Width (m) of the apron round the bed, in which it goes over into the open sea's depth; by itself a wavelength, from 8 to 40 nodes.
    pub apron: Option<f64>,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { breaking: BREAKING, smoothing: None, apron: None }
    }
}

/// Waves were told to stop coming.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the shore's solution was cancelled")]
pub struct Cancelled;

/// Why there is no sea.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShoreError {
    /// A number that makes no sense.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// The caller wanted no more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A wave of the open sea, ready for being asked about.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Component {
    /// Turns per metre.
    turns: DVec2,
    /// Phase at the origin at time 0 (turns).
    start: f64,
    /// Frequency (Hz).
    frequency: f64,
    amplitude: f32,
}

/// Sixteen waves of the open sea, as the kernel wants them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct WaveLanes {
    /// Turns per metre.
    turns_x: [f64; LANES],
    turns_y: [f64; LANES],
    /// Phases (turns) at the origin at the instant that the sea stands at.
    now: [f64; LANES],
    /// Turns from node to node.
    step_x: [f32; LANES],
    step_y: [f32; LANES],
    /// Metres per unit of amplitude.
    unit: [f32; LANES],
    /// Angular frequency (rad/s).
    omega: [f32; LANES],
    /// Directions.
    heading: [[f32; LANES]; 2],
}

impl WaveLanes {
    const NONE: WaveLanes = WaveLanes {
        turns_x: [0.0; LANES],
        turns_y: [0.0; LANES],
        now: [0.0; LANES],
        step_x: [0.0; LANES],
        step_y: [0.0; LANES],
        unit: [0.0; LANES],
        omega: [0.0; LANES],
        heading: [[0.0; LANES]; 2],
    };
}

/// A sea over a bed.
pub struct ShoreSea {
    origin: DVec2,
    spacing: DVec2,
    /// One over the spacing.
    over: DVec2,
    columns: usize,
    rows: usize,
    apron: [usize; 2],
    components: Vec<Component>,
    /// Where among them each wave is that was given.
    seats: Vec<usize>,
    /// The same in sixteens.
    lanes: Vec<WaveLanes>,
    /// How many sixteens.
    blocks: usize,
    /// By node, then by block; after the last node comes the open sea.
    records: Vec<Record>,
    /// By node, and the open sea.
    places: Vec<Place>,
    /// The place of everything outside the grid.
    open: Place,
    /// Mean angular frequency (rad/s).
    frequency: f32,
    breaking: f32,
    time: f64,
    bounds: Bounds,
    /// Largest amplitude (m) of each component by octaves of its local wavelength.
    by_length: Vec<[f32; BINS]>,
    /// Scratch: what the waves can be at most by cell, and how much of the sideways motion is let be by node.
    cells: Vec<[f32; 3]>,
    held: Vec<f32>,
    scratch: Scratch,
    /// Scratch: how many rings inland a node lies.
    rings: Vec<u32>,
}

/// Bins of wavelengths, each an octave; the first is all below 1 m.
const BINS: usize = 12;

impl std::fmt::Debug for ShoreSea {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShoreSea")
            .field("origin", &self.origin)
            .field("spacing", &self.spacing)
            .field("columns", &self.columns)
            .field("rows", &self.rows)
            .field("components", &self.components.len())
            .field("time", &self.time)
            .finish_non_exhaustive()
    }
}

/// The sea at a place, on the average over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Climate {
    /// Depth (m) that the waves feel: smoothed, and at least 2 cm; up to 1000 km.
    pub depth: f32,
    /// Significant height (m).
    pub significant_height: f32,
    /// Which part of the waves is broken there, in [0, 1] (J. Battjes, J. Janssen 1978).
    pub broken: f32,
}

impl ShoreSea {
    /// The sea of a state over a bed, as `count` waves of equal energy; the state's depth is that of the sea off the bed.
    ///
    /// # Errors
    /// If a number of the state makes no sense.
    pub fn new(bed: &Bed, state: &SeaState, count: usize) -> Result<ShoreSea, ShoreError> {
        let state = state.clone().checked()?;
        OutOfRange::unless((1..=1024).contains(&count), "waves over a bed", "from 1 to 1024", count as f64)?;
        let waves = state.band().map_or(Vec::new(), |(low, high)| components::drawn(&state, count, low, high));
        let settings = Settings { breaking: state.breaking as f32, ..Settings::default() };
        ShoreSea::of_waves(bed, &waves, state.depth, &settings, &|_| true)
    }

    /// A sea of given waves, which come over water of a depth (m, infinity for deep), over a bed. `progress` is told now and then, from any
    /// thread, which part of the work is done, and answers whether to go on.
    ///
    /// # Errors
    /// If a number makes no sense, or `progress` said so.
    pub fn of_waves(
        bed: &Bed,
        waves: &[PlaneWave],
        depth: f64,
        settings: &Settings,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<ShoreSea, ShoreError> {
        let mut sea = ShoreSea {
            origin: DVec2::ZERO,
            spacing: DVec2::ONE,
            over: DVec2::ONE,
            columns: 0,
            rows: 0,
            apron: [0; 2],
            components: Vec::new(),
            seats: Vec::new(),
            lanes: Vec::new(),
            blocks: 0,
            records: Vec::new(),
            places: Vec::new(),
            open: Place::default(),
            frequency: 1.0,
            breaking: BREAKING,
            time: 0.0,
            bounds: Bounds::default(),
            by_length: Vec::new(),
            cells: Vec::new(),
            held: Vec::new(),
            scratch: Scratch::default(),
            rings: Vec::new(),
        };
        sea.solve(bed, waves, depth, settings, progress)?;
        Ok(sea)
    }

    /// The same with other waves or another bed, in the memory of this one. After an error the sea is as it was.
    ///
    /// # Errors
    /// As [`ShoreSea::of_waves`].
    pub fn solve(
        &mut self,
        bed: &Bed,
        waves: &[PlaneWave],
        depth: f64,
        settings: &Settings,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<(), ShoreError> {
        solve::solve(&mut self.scratch, bed, waves, depth, settings, progress)?;
        self.take(waves, depth, settings);
        let time = self.time;
        self.set_time(time);
        Ok(())
    }

    /// Takes over what the marches have left.
    fn take(&mut self, waves: &[PlaneWave], depth: f64, settings: &Settings) {
        let grid = &self.scratch.grid;
        (self.origin, self.spacing) = (grid.origin, grid.spacing);
        self.over = self.spacing.recip();
        (self.columns, self.rows, self.apron) = (grid.columns, grid.rows, grid.apron);
        let count = grid.columns * grid.rows;
        let (frequency, wavenumber) = solve::means(waves);
        self.frequency = frequency as f32;
        self.breaking = settings.breaking;
        // Kept in the order of the batches, so that what they told is copied in whole runs.
        self.seats.clear();
        self.seats.resize(waves.len(), 0);
        let order = || self.scratch.batches.iter().flat_map(|b| &b.members);
        order().enumerate().for_each(|(seat, &wave)| self.seats[wave] = seat);
        self.components.clear();
        self.components.extend(order().map(|&n| &waves[n]).map(|w| Component {
            turns: w.wavenumber / TAU,
            start: w.phase / TAU,
            frequency: w.angular_frequency / TAU,
            amplitude: w.amplitude as f32,
        }));
        let blocks = waves.len().div_ceil(LANES);
        self.blocks = blocks;
        self.lanes.clear();
        self.lanes.resize(blocks, WaveLanes::NONE);
        for (n, wave) in order().map(|&n| &waves[n]).enumerate() {
            let (lanes, l) = (&mut self.lanes[n / LANES], n % LANES);
            let turns = wave.wavenumber / TAU;
            (lanes.turns_x[l], lanes.turns_y[l]) = (turns.x, turns.y);
            lanes.step_x[l] = (turns.x * self.spacing.x) as f32;
            lanes.step_y[l] = (turns.y * self.spacing.y) as f32;
            lanes.unit[l] = wave.amplitude as f32 / UNITS;
            lanes.omega[l] = wave.angular_frequency as f32;
            let heading = wave.wavenumber.normalize();
            (lanes.heading[0][l], lanes.heading[1][l]) = (heading.x as f32, heading.y as f32);
        }

        // What is at every node besides the waves.
        let rim = squeeze(depth);
        let energy: f64 = waves.iter().map(|w| 0.5 * w.amplitude * w.amplitude).sum();
        let steep: f64 = waves.iter().map(|w| w.amplitude * w.wavenumber.length()).sum();
        let ground = shape::Ground::new(frequency, wavenumber, steep, energy, settings.breaking);
        self.open = ground.place(stretch(rim), energy as f32, None);
        let batches = &self.scratch.batches;
        let total = |i: usize| {
            batches.iter().fold((0.0f32, 0.0f32), |(e, u), b| (e + b.told[i].energy, u + b.told[i].unbroken))
        };
        self.places.clear();
        self.places.resize(count + 1, self.open);
        self.places[..count].par_iter_mut().enumerate().for_each(|(i, place)| {
            let (energy, unbroken) = total(i);
            let energy = energy.min(grid.cap[i]);
            let height = 4.0 * unbroken.max(0.0).sqrt();
            *place = ground.place(stretch(grid.s[i]), energy, Some((grid.slope[i], height)));
        });

        // The waves, no higher together than the depth bears.
        solve::resize(&mut self.records, (count + 1) * blocks, Record::NONE);
        self.records[count * blocks..].fill(Record::OPEN);
        if blocks > 0 {
            self.records[..count * blocks].par_chunks_exact_mut(blocks).enumerate().for_each(|(i, records)| {
                let all = total(i).0;
                let cap = grid.cap[i];
                let by = if all > cap { (cap / all).sqrt() } else { 1.0 };
                let mut seat = 0;
                for batch in batches {
                    let count = batch.members.len();
                    for wave in &batch.records[i * count..][..count] {
                        let record = &mut records[seat / LANES];
                        record.phase[seat % LANES] = *wave as i16;
                        record.amplitude[seat % LANES] = (wave >> 16) as u16;
                        seat += 1;
                    }
                }
                if by < 1.0 {
                    records.iter_mut().for_each(|r| r.amplitude.iter_mut().for_each(|a| *a = solve::lowered(*a, by)));
                }
            });
        }
        self.reach_inland();
        measure::measure(self);
    }

    /// Lets the waves at the water's edge hold on into the land, for what is between nodes and for the swash: ring by ring, every node of
    /// land takes the mean of those around it that have some.
    fn reach_inland(&mut self) {
        const REACH: f64 = 80.0;
        /// What waves themselves do in there, rather than run up (m): they fall to a fiftieth, from which the swash still tells their phase.
        const INLAND: f64 = 4.0;
        const NONE: u32 = u32::MAX;
        let (columns, rows, blocks) = (self.columns, self.rows, self.blocks);
        let last = (REACH / self.spacing.min_element()).ceil().clamp(2.0, 40.0) as u32;
        let fading = |over: f64| libm::exp(-self.spacing.min_element() / over) as f32;
        let (fade, drown) = (fading(0.4 * REACH), fading(INLAND));
        let near = &self.scratch.grid.near;
        let rings = &mut self.rings;
        rings.clear();
        rings.extend(near.iter().map(|near| if *near > 1.0 { NONE } else { 0 }));
        let mut dry: Vec<usize> = (0..columns * rows).filter(|&i| rings[i] == NONE).collect();
        let mut around = Vec::with_capacity(8);
        for ring in 1..=last {
            let drown = if f64::from(ring) * self.spacing.min_element() < 4.0 * INLAND { drown } else { 1.0 };
            let reached = |rings: &[u32], i: usize, around: &mut Vec<usize>| {
                let (c, r) = (i % columns, i / columns);
                around.clear();
                for row in r.saturating_sub(1)..(r + 2).min(rows) {
                    for column in c.saturating_sub(1)..(c + 2).min(columns) {
                        if rings[row * columns + column] < ring {
                            around.push(row * columns + column);
                        }
                    }
                }
            };
            dry.retain(|&i| {
                reached(rings, i, &mut around);
                if around.is_empty() {
                    return true;
                }
                let count = around.len() as i32;
                for block in 0..blocks {
                    let first = self.records[around[0] * blocks + block];
                    let mut mean = first;
                    for l in 0..LANES {
                        let (mut turn, mut amplitude) = (0i32, 0i32);
                        for &n in &around {
                            let record = &self.records[n * blocks + block];
                            turn += i32::from(record.phase[l].wrapping_sub(first.phase[l]));
                            amplitude += i32::from(record.amplitude[l]);
                        }
                        mean.phase[l] = first.phase[l].wrapping_add((turn / count) as i16);
                        mean.amplitude[l] = (drown * (amplitude / count) as f32) as u16;
                    }
                    self.records[i * blocks + block] = mean;
                }
                let mut place = Place::default();
                for &n in &around {
                    place.0.iter_mut().zip(self.places[n].0).for_each(|(sum, value)| *sum += value / count as f32);
                }
                // Rollers do not climb the beach, and what swash may reach ends somewhere.
                place.0[Place::BROKEN] *= 0.7;
                place.0[Place::HEIGHT] *= drown;
                place.0[Place::SETUP] *= fade;
                place.0[Place::SWING] *= fade;
                self.places[i] = place;
                rings[i] = ring;
                false
            });
            if dry.is_empty() {
                break;
            }
        }
    }

    /// Where on the grid a place lies: column and row of the node below it (which may lie off the grid), and how far on to the next.
    #[allow(clippy::manual_clamp, reason = "what is no number becomes 0")]
    fn locate(&self, x: f64, y: f64) -> ([i64; 2], [f32; 2]) {
        let (u, v) = ((x - self.origin.x) * self.over.x, (y - self.origin.y) * self.over.y);
        let (c, r) = (u.floor(), v.floor());
        // A place that is no number is taken as the first node.
        ([c as i64, r as i64], [(u - c).max(0.0).min(1.0) as f32, (v - r).max(0.0).min(1.0) as f32])
    }

    /// Index of a node, if it lies on the grid.
    fn node(&self, column: i64, row: i64) -> Option<usize> {
        let inside =
            column >= 0 && row >= 0 && (column as u64) < self.columns as u64 && (row as u64) < self.rows as u64;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    /// What a place is like, on the average over time.
    pub fn climate(&self, x: f64, y: f64) -> Climate {
        let ([c, r], [u, v]) = self.locate(x, y);
        let at = |dc: i64, dr: i64| {
            self.node(c.saturating_add(dc), r.saturating_add(dr)).map_or(self.open, |i| self.places[i]).0
        };
        let (a, b, d, e) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
        let mix = |n: usize| {
            let low = a[n] + u * (b[n] - a[n]);
            low + v * (d[n] + u * (e[n] - d[n]) - low)
        };
        Climate { depth: mix(Place::DEPTH), significant_height: mix(Place::HEIGHT), broken: mix(Place::BROKEN) }
    }

    /// Amplitude (m) and wave number (rad/m, in the direction in which it runs) of the n-th wave, as the sea was given them, at a place (m).
    ///
    /// # Panics
    /// If there is no such wave.
    pub fn component(&self, n: usize, x: f64, y: f64) -> (f64, DVec2) {
        assert!(n < self.components.len(), "expected a wave below {}, got {n}", self.components.len());
        let n = self.seats[n];
        let ([c, r], [u, v]) = self.locate(x, y);
        let at = |dc: i64, dr: i64| {
            self.node(c.saturating_add(dc), r.saturating_add(dr)).map_or((0, UNITS as u16), |i| {
                let record = &self.records[i * self.blocks + n / LANES];
                (record.phase[n % LANES], record.amplitude[n % LANES])
            })
        };
        let (a, b, d, e) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
        let (u, v) = (f64::from(u), f64::from(v));
        let turn = |p: i16, q: i16| f64::from(q.wrapping_sub(p)) / 65_536.0;
        let low = f64::from(a.1) + u * (f64::from(b.1) - f64::from(a.1));
        let high = f64::from(d.1) + u * (f64::from(e.1) - f64::from(d.1));
        let across = turn(a.0, b.0) * (1.0 - v) + turn(d.0, e.0) * v;
        let up = turn(a.0, d.0) * (1.0 - u) + turn(b.0, e.0) * u;
        let component = &self.components[n];
        let amplitude = (low + v * (high - low)) / f64::from(UNITS) * f64::from(component.amplitude);
        (amplitude, TAU * (component.turns + DVec2::new(across, up) / self.spacing))
    }

    /// The first and the last place (m) of the grid with its apron: outside, the waves are those of the open sea.
    pub fn extent(&self) -> (DVec2, DVec2) {
        let last = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64);
        (self.origin, self.origin + self.spacing * last)
    }
}

impl WaveModel for ShoreSea {
    fn set_time(&mut self, seconds: f64) {
        self.time = if seconds.is_finite() { seconds } else { 0.0 };
        for (n, component) in self.components.iter().enumerate() {
            let turns = component.start - component.frequency * self.time;
            self.lanes[n / LANES].now[n % LANES] = turns - turns.floor();
        }
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        query::displacement(self, points, motion);
    }

    fn add_motion(&self, points: &Points, motion: &mut Motion) {
        query::motion(self, points, motion);
    }

    fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        query::velocity(self, points, depths, velocity);
    }

    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn run_up(&self, at: DVec2) -> f32 {
        let ([c, r], [u, v]) = self.locate(at.x, at.y);
        let reach = |dc: i64, dr: i64| {
            let place = self.node(c.saturating_add(dc), r.saturating_add(dr)).map_or(self.open, |i| self.places[i]).0;
            place[Place::SETUP] + shape::FARTHEST * place[Place::SWING]
        };
        let (south, north) = (reach(0, 0) * (1.0 - u) + reach(1, 0) * u, reach(0, 1) * (1.0 - u) + reach(1, 1) * u);
        south + (north - south) * v
    }

    fn roughness(&self, wavelength: f32) -> f32 {
        if wavelength.is_nan() || wavelength <= 0.0 {
            return 0.0;
        }
        let bins = measure::octave(wavelength) + 1;
        let sum: f32 = self.by_length.iter().map(|bins_of| bins_of[..bins].iter().copied().fold(0.0, f32::max)).sum();
        // Below the lowest bin with the length itself.
        let left = if wavelength < 1.0 { wavelength } else { 1.0 };
        shape::HIGHEST * sum * left
    }
}
