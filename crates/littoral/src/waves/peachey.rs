//! Waves that feel the bottom, after Peachey: one phase function over a sea bed.
//!
//! z = Σ Aᵢ wᵢ(fraction(θᵢ(x) − t / Tᵢ)) of D. Peachey (*Modeling waves and surf*, SIGGRAPH 1986). The period is constant from the deep sea to the
//! beach, the wavelength is not: k tanh(k h) = k∞. The phase θ, in cycles, is the integral of k along the wave's path, found once for a bed:
//! either along the true path, which solves |∇θ| = k / 2π (by fast sweeping: H. Zhao, *A fast sweeping method for eikonal equations*, 2005), so
//! that crests slow down, bunch up and turn parallel to the shore; or along straight rays with k∞ / √tanh(k∞ h), as Peachey wrote it. The
//! profile w goes from a cosine in the deep to sharp crests and flat troughs at the shore.
//!
//! There is no diffraction, and amplitudes follow the depth alone, not the bundling of rays: behind a rock waves are as high as before it.
//!
//! Between the nodes of the bed everything is a quadratic B-spline, which smooths a little and never leaves the range of its nodes: so bounds
//! hold. Beyond the bed its border's depths go on straight outward.

use super::{BLOCK, Bounds, Motion, OutOfRange, Points, STANDARD_GRAVITY, StillWater, Velocity, WaveModel};
use glam::DVec2;
use libm::{sqrt, tanh};
use std::f64::consts::{PI, TAU};

mod beach;
mod eikonal;
mod kernel;
#[cfg(test)]
mod tests;

pub use beach::Beach;

/// A grid of depths.
#[derive(Clone, Debug, PartialEq)]
pub struct Depths {
    /// Where the first node lies (m).
    pub origin: DVec2,
    /// Between neighbours (m), above 0.
    pub spacing: f64,
    /// Nodes eastward, at least 2.
    pub columns: usize,
    /// Nodes northward, at least 2.
    pub rows: usize,
    /// Depths (m) below still water, row by row northward; land where they are not above 0 or not numbers.
    pub depths: Vec<f32>,
}

/// A train of waves as it arrives from the deep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swell {
    /// Half the height (m), from 0 to 100.
    pub amplitude: f64,
    /// From crest to crest (s), from 0.1 to 1000.
    pub period: f64,
    /// Where it runs to (rad, counter-clockwise from x).
    pub heading: f64,
    /// Phase (rad) at the first node of the bed at time 0.
    pub phase: f64,
}

/// How phases come about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Path {
    /// Along the waves' true paths, with exact dispersion: waves refract.
    #[default]
    Refracted,
    /// Along straight rays, with Peachey's approximate dispersion: waves bunch, but hardly turn.
    Straight,
}

/// What becomes of the height near the shore.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surf {
    /// Whether waves grow as they slow down, keeping their flux of energy (G. Green, 1838).
    pub shoaling: bool,
    /// Greatest height of all trains together over the depth, from 0.01 to 10, or infinity for no limit: the width of the surf follows from it
    /// (see [`Beach::breaking`]).
    pub breaking: f64,
}

impl Default for Surf {
    /// Shoaling, and breaking at 0.78 of the depth (J. McCowan, 1894).
    fn default() -> Surf {
        Surf { shoaling: true, breaking: 0.78 }
    }
}

/// Peachey's waves over a bed.
#[derive(Clone, Debug)]
pub struct Peachey {
    origin: DVec2,
    spacing: f64,
    columns: usize,
    rows: usize,
    trains: Vec<Train>,
    bounds: Bounds,
    time: f64,
}

/// A train of waves over the whole bed.
#[derive(Clone, Debug)]
struct Train {
    swell: Swell,
    /// Cycles per metre in the deep.
    far: DVec2,
    /// Those of the bed, row by row northward, framed with copies of those at its border.
    nodes: Vec<Node>,
    /// Greatest heights (m) of waves shorter than [`threshold`].
    rough: [f32; THRESHOLDS],
    /// Cycles that time and the train's own phase add, within ±½.
    cycles: f64,
}

/// A train at a node of the bed.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    /// Phase (cycles) less that of the train as it runs in the deep.
    cycles: f64,
    /// Half the height (m).
    amplitude: f32,
    /// 0 for the profile of the deep, 1 for that of the shore.
    shore: f32,
    /// Radians per metre.
    wavenumber: f32,
    /// Water (m).
    depth: f32,
}

const THRESHOLDS: usize = 96;

/// Wavelengths (m), four to an octave from 1 mm up, for which roughness is known.
fn threshold(index: usize) -> f64 {
    1e-3 * libm::exp2(index as f64 / 4.0)
}

/// Wave number (rad/m) of waves of the deep wave number k∞ (rad/m) over a depth (m): solves k tanh(k h) = k∞ to 1e-12.
pub(crate) fn wavenumber(deep: f64, depth: f64) -> f64 {
    let wanted = deep * depth;
    if wanted > 20.0 {
        return deep;
    }
    let mut kh = wanted / sqrt(tanh(wanted));
    for _ in 0..4 {
        let slowed = tanh(kh);
        kh -= (kh * slowed - wanted) / (slowed + kh * (1.0 - slowed * slowed));
    }
    kh / depth
}

/// Peachey's approximation k∞ / √tanh(k∞ h) of the same (rad/m): too small by at most 4.98 %, where k∞ h = 0.694.
pub(crate) fn rough_wavenumber(deep: f64, depth: f64) -> f64 {
    deep / sqrt(tanh(deep * depth))
}

impl Peachey {
    /// Finds the phases of trains of waves over a bed. They arrive as plane waves over the deepest of its water, at the side that faces them;
    /// along the other sides the bed is taken to go on straight outward. Waves over less water than the spacing resolves (shorter than four
    /// nodes) are held at that length; crests may pass over land there, without height.
    ///
    /// # Errors
    /// If the bed has fewer than 2 × 2 or more than 2²⁶ nodes, or not as many depths; if a number of a train makes no sense (there may be up to
    /// 256); if shoaling is asked for without breaking; if there is no water where a train comes from.
    pub fn new(bed: &Depths, swells: &[Swell], path: Path, surf: Surf) -> Result<Peachey, OutOfRange> {
        bed.check()?;
        OutOfRange::unless(swells.len() <= 256, "trains of waves", "at most 256", swells.len() as f64)?;
        let limited = (0.01..=10.0).contains(&surf.breaking) || surf.breaking == f64::INFINITY && !surf.shoaling;
        let expected = "height over depth from 0.01 to 10, or infinity without shoaling";
        OutOfRange::unless(limited, "breaking", expected, surf.breaking)?;
        let mut trains = Vec::new();
        for swell in swells {
            trains.push(Train::new(bed, swell, path, surf.shoaling)?);
        }
        for node in 0..bed.depths.len() {
            let total: f64 = trains.iter().map(|train| f64::from(train.nodes[node].amplitude)).sum();
            let most = 0.5 * surf.breaking * bed.depth(node);
            if total > most {
                trains.iter_mut().for_each(|train| train.nodes[node].amplitude *= (most / total) as f32);
            }
        }
        for train in &mut trains {
            train.measure_roughness();
            train.frame(bed.columns, bed.rows);
        }
        let (columns, rows, spacing) = (bed.columns, bed.rows, bed.spacing);
        let mut waves =
            Peachey { origin: bed.origin, spacing, columns, rows, trains, bounds: Bounds::default(), time: 0.0 };
        waves.bounds = waves.measure_bounds();
        waves.set_time(0.0);
        Ok(waves)
    }

    /// Its trains as they were set.
    pub fn swells(&self) -> impl Iterator<Item = &Swell> {
        self.trains.iter().map(|train| &train.swell)
    }

    fn measure_bounds(&self) -> Bounds {
        let (mut height, mut slope) = (0f64, 0f64);
        // In the square around a node a spline stays within the nine nodes around, its derivatives within their differences.
        for row in 0..self.rows {
            for column in 0..self.columns {
                let (mut high, mut steep) = (0.0, 0.0);
                for train in &self.trains {
                    let (most, tilt) = self.bounds_near(train, column, row);
                    high += most;
                    steep += tilt;
                }
                height = height.max(high);
                slope = slope.max(steep);
            }
        }
        let creased = self.trains.iter().any(|train| train.nodes.iter().any(|n| n.shore > 0.0 && n.amplitude > 0.0));
        let curvature = if creased { f32::INFINITY } else { self.smooth_curvature() };
        let above = |number: f64| (number * (1.0 + 1e-5)) as f32;
        Bounds { height: above(height), slope: above(slope), curvature, ..Bounds::default() }
    }

    /// Height and slope of a train around a node.
    fn bounds_near(&self, train: &Train, column: usize, row: usize) -> (f64, f64) {
        let node = |i: usize, j: usize| &train.nodes[(row + j) * (self.columns + 2) + column + i];
        let most = (0..9).map(|n| f64::from(node(n % 3, n / 3).amplitude)).fold(0.0, f64::max);
        // Largest differences eastward and northward of phase, amplitude and shore.
        let (mut x, mut y) = ([train.far.x.abs(), 0.0, 0.0], [train.far.y.abs(), 0.0, 0.0]);
        for along in 0..3 {
            for step in 0..2 {
                let pairs = [(node(step, along), node(step + 1, along)), (node(along, step), node(along, step + 1))];
                for ((a, b), (most, far)) in pairs.into_iter().zip([(&mut x, train.far.x), (&mut y, train.far.y)]) {
                    most[0] = most[0].max(((b.cycles - a.cycles) / self.spacing + far).abs());
                    most[1] = most[1].max(f64::from(b.amplitude - a.amplitude).abs() / self.spacing);
                    most[2] = most[2].max(f64::from(b.shore - a.shore).abs() / self.spacing);
                }
            }
        }
        let [phase, amplitude, shore] = [0, 1, 2].map(|n| sqrt(x[n] * x[n] + y[n] * y[n]));
        // |w| ≤ 1, |∂w/∂u| ≤ 8, |∂w/∂s| < 0.62.
        (most, most * (8.0 * phase + 0.62 * shore) + amplitude)
    }

    /// Greatest second derivative where no profile has a crease.
    fn smooth_curvature(&self) -> f32 {
        let mut most = 0.0;
        for train in &self.trains {
            let (mut high, mut phase, mut rise) = (0f64, 0f64, 0f64);
            let (mut bend, mut rise_bend) = (0f64, 0f64);
            let at = |i: usize, j: usize| &train.nodes[j * (self.columns + 2) + i];
            let (h, far) = (self.spacing, train.far.length());
            for row in 1..=self.rows {
                for column in 1..=self.columns {
                    let here = at(column, row);
                    high = high.max(f64::from(here.amplitude));
                    for (before, after) in
                        [(at(column - 1, row), at(column + 1, row)), (at(column, row - 1), at(column, row + 1))]
                    {
                        let change = |from: f64, to: f64| (to - from).abs() / h;
                        phase = phase.max(far + 1.5 * change(here.cycles, after.cycles));
                        rise = rise.max(1.5 * change(f64::from(here.amplitude), f64::from(after.amplitude)));
                        // Mixed derivatives are at most these, too: differences of differences.
                        bend = bend.max((change(here.cycles, after.cycles) + change(before.cycles, here.cycles)) / h);
                        let [a, b, c] = [before, here, after].map(|node| f64::from(node.amplitude));
                        rise_bend = rise_bend.max((change(a, b) + change(b, c)) / h);
                    }
                }
            }
            most += high * (TAU * TAU * phase * phase + 2.0 * TAU * bend) + 2.0 * TAU * rise * phase + 2.0 * rise_bend;
        }
        (most * (1.0 + 1e-5)) as f32
    }
}

impl Depths {
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        let fits = (1e-3..=1e6).contains(&self.spacing);
        OutOfRange::unless(fits, "spacing of the bed", "m, from 0.001 to 1 000 000", self.spacing)?;
        for (what, count) in [("columns of the bed", self.columns), ("rows of the bed", self.rows)] {
            OutOfRange::unless((2..=1 << 20).contains(&count), what, "a number from 2 to 1 048 576", count as f64)?;
        }
        let nodes = self.columns * self.rows;
        OutOfRange::unless(nodes <= 1 << 26, "nodes of the bed", "at most 67 108 864", nodes as f64)?;
        let given = self.depths.len();
        OutOfRange::unless(given == nodes, "depths of the bed", "columns × rows of them", given as f64)?;
        for (what, place) in [("origin's x", self.origin.x), ("origin's y", self.origin.y)] {
            OutOfRange::unless(place.abs() <= 1e9, what, "m, within ±1e9", place)?;
        }
        Ok(())
    }

    /// Depth (m) of a node, 0 on land.
    pub(crate) fn depth(&self, node: usize) -> f64 {
        let depth = f64::from(self.depths[node]);
        if depth > 0.0 { depth.min(12_000.0) } else { 0.0 }
    }
}

impl Train {
    fn new(bed: &Depths, swell: &Swell, path: Path, shoaling: bool) -> Result<Train, OutOfRange> {
        let Swell { amplitude, period, heading, phase } = *swell;
        OutOfRange::unless((0.0..=100.0).contains(&amplitude), "amplitude", "m, from 0 to 100", amplitude)?;
        OutOfRange::unless((0.1..=1000.0).contains(&period), "period", "s, from 0.1 to 1000", period)?;
        OutOfRange::unless(heading.abs() <= 1e6, "heading", "rad, within ±1e6", heading)?;
        OutOfRange::unless(phase.abs() <= 1e6, "phase", "rad, within ±1e6", phase)?;
        let deep = TAU / period * (TAU / period) / STANDARD_GRAVITY;
        let offshore = (0..bed.depths.len()).map(|node| bed.depth(node)).fold(0.0, f64::max);
        OutOfRange::unless(offshore > 0.0, "depth of the bed", "some water (m, above 0)", offshore)?;
        let number = match path {
            Path::Refracted => wavenumber,
            Path::Straight => rough_wavenumber,
        };
        let incoming = number(deep, offshore);
        // Nodes cannot hold waves shorter than four of them; on land, which has none, that is as good as any.
        let most = (TAU / (4.0 * bed.spacing)).max(2.0 * incoming);
        let of_depth = |number: fn(f64, f64) -> f64| -> Vec<f64> {
            let at = |node| (bed.depth(node) > 0.0).then(|| number(deep, bed.depth(node)));
            (0..bed.depths.len()).map(|node| at(node).unwrap_or(most)).collect()
        };
        let exact = of_depth(wavenumber);
        let mut numbers = if path == Path::Refracted { exact.clone() } else { of_depth(number) };
        numbers.iter_mut().for_each(|number| *number = number.min(most));
        let heading = DVec2::new(libm::cos(heading), libm::sin(heading));
        let course = eikonal::Course::new(bed, heading, incoming, &numbers);
        let phases = match path {
            Path::Refracted => course.refracted(),
            Path::Straight => course.straight(),
        };
        let reached = phases.reached.iter().any(|reached| *reached);
        let expected = "water along the side from which the waves come";
        OutOfRange::unless(reached, "bed", expected, 0.0)?;
        let group = |depth: f64, k: f64| StillWater { depth, ..StillWater::DEEP }.group_speed(k);
        let flux = group(offshore, wavenumber(deep, offshore));
        let node = |node: usize| {
            let (depth, k) = (bed.depth(node), numbers[node]);
            let wet = depth > 0.0 && phases.reached[node];
            let shoal = if wet && shoaling { sqrt(flux / group(depth, exact[node])) } else { 1.0 };
            // Depth over wavelength, from the limit of the deep to that of the shallow.
            let shore = ((0.25 - depth * k / TAU) / 0.2).clamp(0.0, 1.0);
            Node {
                cycles: phases.cycles[node],
                amplitude: if wet { (amplitude * shoal) as f32 } else { 0.0 },
                shore: shore as f32,
                wavenumber: k as f32,
                depth: depth as f32,
            }
        };
        let nodes = (0..bed.depths.len()).map(node).collect();
        let far = heading * (incoming / TAU);
        Ok(Train { swell: *swell, far, nodes, rough: [0.0; THRESHOLDS], cycles: 0.0 })
    }

    /// Frames its nodes with copies of those at the border.
    fn frame(&mut self, columns: usize, rows: usize) {
        let mut framed = Vec::with_capacity((columns + 2) * (rows + 2));
        for row in [0].into_iter().chain(0..rows).chain([rows - 1]) {
            let row = &self.nodes[row * columns..][..columns];
            framed.push(row[0]);
            framed.extend_from_slice(row);
            framed.push(row[columns - 1]);
        }
        self.nodes = framed;
    }

    fn measure_roughness(&mut self) {
        // Greatest heights, and those of creases, of waves up to each threshold and longer than the one before.
        let mut own = [[0f64; 2]; THRESHOLDS];
        for node in self.nodes.iter().filter(|node| node.amplitude > 0.0) {
            let (a, s) = (f64::from(node.amplitude), f64::from(node.shore));
            let length = TAU / f64::from(node.wavenumber);
            let own = &mut own[libm::ceil(4.0 * libm::log2(length * 1e3)).clamp(0.0, THRESHOLDS as f64 - 1.0) as usize];
            *own = [own[0].max(a), own[1].max(a * s)];
        }
        let mut rough = own.map(|own| own[0]);
        for (longer, [_, crease]) in own.iter().enumerate() {
            for (index, rough) in rough.iter_mut().enumerate().take(longer) {
                // The n-th part of a crease is 8 / (π n)² high and its length over n long; those from n on, less than 8 / π² / (n − ½) together.
                let n = (threshold(longer.saturating_sub(1)) / threshold(index)).max(1.0);
                *rough = rough.max(crease * (8.0 / (PI * PI * (n - 0.5))).min(1.0));
            }
        }
        let mut most = 0.0;
        for (index, kept) in self.rough.iter_mut().enumerate() {
            most = rough[index].max(most);
            *kept = (most * (1.0 + 1e-5)) as f32;
        }
    }
}

impl WaveModel for Peachey {
    fn set_time(&mut self, seconds: f64) {
        self.time = if seconds.is_finite() { seconds } else { 0.0 };
        for train in &mut self.trains {
            let cycles = train.swell.phase / TAU - self.time / train.swell.period;
            train.cycles = cycles - cycles.round_ties_even();
        }
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn add_displacement(&self, points: &Points, motion: &mut Motion) {
        kernel::add_displacement(self, points, motion);
    }

    fn add_motion(&self, points: &Points, motion: &mut Motion) {
        kernel::add_motion(self, points, motion);
    }

    /// As under a linear wave of the local length that has the profile's surface.
    fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity) {
        kernel::add_velocity(self, points, depths, velocity);
    }

    /// Curvature is infinite where crests are creases, which is wherever waves are longer than four times the depth.
    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn roughness(&self, wavelength: f32) -> f32 {
        let first = threshold(0) as f32;
        if wavelength <= first {
            return self.trains.iter().map(|train| train.rough[0]).sum::<f32>() * (wavelength / first).max(0.0);
        }
        let index =
            libm::ceil(4.0 * libm::log2(f64::from(wavelength) * 1e3)).clamp(0.0, THRESHOLDS as f64 - 1.0) as usize;
        self.trains.iter().map(|train| train.rough[index]).sum()
    }
}
