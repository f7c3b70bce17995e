//! From a bed and waves to what every wave is at every node: the ground made ready, the marches, and what they add up to.
//!
//! Every wave marches along the side of the grid nearest to its heading, so at most 45° off; waves that go the same way march together. All
//! share one limit of height: a second march knows the energy of the batches that it does not carry from the first, and what little is
//! then too much is taken off at the node itself. Batches are cut in the same way however many threads there are.

use super::super::{OutOfRange, PlaneWave, StillWater};
use super::bed::Bed;
use super::lanes::{Complex, LANES, smooth};
use super::march::{self, March, Node, STEPS, Told, Waves};
use super::{Cancelled, Settings, ShoreError};
use crate::memory;
use glam::DVec2;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Depth (m) at which [`Node::s`] is √½.
const SCALE: f64 = 10.0;
/// Waves feel no shallower water than this (m).
const SHALLOWEST: f64 = 0.02;

/// Depth as a number in (0, 1]; endless depth is 1.
pub(super) fn squeeze(depth: f64) -> f32 {
    if depth >= 1e7 {
        return 1.0;
    }
    let h = depth.max(SHALLOWEST);
    libm::sqrt(h / (h + SCALE)) as f32
}

/// The depth (m) of such a number, at most 1000 km.
pub(super) fn stretch(s: f32) -> f64 {
    let square = f64::from(s) * f64::from(s);
    SCALE * square / (1.0 - square).max(1e-5)
}

/// The grid the waves march over: the bed with its apron.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Grid {
    pub(super) origin: DVec2,
    pub(super) spacing: DVec2,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Nodes of apron at each end, along x and y.
    pub(super) apron: [usize; 2],
    /// Smoothed depth, squeezed.
    pub(super) s: Vec<f32>,
    /// How near land is; above 1 on land.
    pub(super) near: Vec<f32>,
    /// Slope of the bed (m per m), over some nodes.
    pub(super) slope: Vec<f32>,
    /// Most energy (m²) that the depth bears: where Hs = 4 √m₀ is the breaking index times it. Endless off the bed.
    pub(super) cap: Vec<f32>,
}

/// Everything that a solution needs and that the next one can use again.
#[derive(Default)]
pub(super) struct Scratch {
    pub(super) grid: Grid,
    pub(super) batches: Vec<Batch>,
    smooth: Vec<f32>,
    other: Vec<f32>,
}

/// Waves that march together.
#[derive(Default)]
pub(super) struct Batch {
    /// Which waves.
    pub(super) members: Vec<usize>,
    axis: usize,
    waves: Option<Waves>,
    march: March,
    nodes: Vec<Node>,
    /// How far out in the apron a node across the march is.
    sides: Vec<f32>,
    /// What is told of each member at each node, as in [`March::records`].
    pub(super) records: Vec<u32>,
    pub(super) told: Vec<Told>,
    /// Energy (m²) of the other batches, told by the march before.
    before: Vec<f32>,
    /// The last row before waves began to break, where the second march may begin: which, the waves, and what of them had not broken.
    kept: Option<usize>,
    kept_b: Vec<Complex>,
    kept_whole: Vec<f32>,
}

/// Directions of march: along x, along y, against x, against y.
const AXES: [DVec2; 4] = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];

/// Mean angular frequency and mean wave number in the open (rad/s, rad/m), weighted by energy.
pub(super) fn means(waves: &[PlaneWave]) -> (f64, f64) {
    let energy: f64 = waves.iter().map(|w| w.amplitude * w.amplitude).sum();
    let mean = |f: &dyn Fn(&PlaneWave) -> f64| {
        waves.iter().map(|w| w.amplitude * w.amplitude * f(w)).sum::<f64>() / energy.max(1e-300)
    };
    (mean(&|w| w.angular_frequency), mean(&|w| w.wavenumber.length()))
}

impl Grid {
    /// Makes the bed ready for waves of a mean length (m) that come over water of a depth (m).
    fn lay(&mut self, bed: &Bed, depth: f64, wavelength: f64, settings: &Settings, a: &mut Vec<f32>, b: &mut Vec<f32>) {
        let spacing = bed.spacing();
        let reach = settings.apron.unwrap_or(wavelength);
        let cells = |step: f64| ((reach / step) as usize).clamp(8, 40);
        let apron = if settings.apron.is_some() {
            [spacing.x, spacing.y].map(|s| ((reach / s) as usize).clamp(4, 400))
        } else {
            [cells(spacing.x), cells(spacing.y)]
        };
        let (columns, rows) = (bed.columns() + 2 * apron[0], bed.rows() + 2 * apron[1]);
        self.origin = bed.origin() - spacing * DVec2::new(apron[0] as f64, apron[1] as f64);
        (self.spacing, self.columns, self.rows, self.apron) = (spacing, columns, rows, apron);
        let rim = squeeze(depth);
        let count = columns * rows;

        // The depths with the apron, at first without its blend.
        let bed_index = |i: usize| {
            let column = (i % columns).saturating_sub(apron[0]).min(bed.columns() - 1);
            let row = (i / columns).saturating_sub(apron[1]).min(bed.rows() - 1);
            row * bed.columns() + column
        };
        a.clear();
        a.extend((0..count).map(|i| bed.depths()[bed_index(i)].clamp(0.0, 1e4)));
        let sigma = settings.smoothing.unwrap_or(0.07 * wavelength.min(250.0));
        for _ in 0..3 {
            blur(a, b, columns, rows, radius(sigma, spacing.x), radius(sigma, spacing.y));
        }
        self.s.clear();
        self.s.resize(count, 0.0);
        let s = &mut self.s;
        for (i, s) in s.iter_mut().enumerate() {
            let inner = squeeze(f64::from(a[i]));
            let t = outward(i % columns, columns, apron[0]).max(outward(i / columns, rows, apron[1]));
            let w = (t / 0.7).min(1.0);
            let w = w * w * (3.0 - 2.0 * w);
            *s = if w >= 1.0 { rim } else { inner + (rim - inner) * w as f32 };
        }
        self.cap.clear();
        self.cap.extend(self.s.iter().map(|&s| {
            let height = settings.breaking * stretch(s) as f32;
            if s >= rim - 1e-3 { f32::INFINITY } else { (0.25 * height) * (0.25 * height) }
        }));

        // Where land is near.
        a.clear();
        a.extend((0..count).map(|i| {
            let (column, row) = (i % columns, i / columns);
            let inside = column >= apron[0] && column < columns - apron[0] && row >= apron[1] && row < rows - apron[1];
            f32::from(u8::from(inside && bed.depths()[bed_index(i)] <= 0.0))
        }));
        self.near.clear();
        self.near.extend_from_slice(a);
        blur(a, b, columns, rows, 2, 2);
        blur(a, b, columns, rows, 2, 2);
        for (near, soft) in self.near.iter_mut().zip(a.iter()) {
            *near = if *near > 0.0 { 2.0 } else { (3.0 * soft).min(1.0) };
        }

        // How steep the bed is where it meets the sea.
        a.clear();
        a.extend((0..count).map(|i| bed.depths()[bed_index(i)].clamp(-4.0, 8.0)));
        let wide = (8.0f64).max(2.0 * spacing.max_element());
        blur(a, b, columns, rows, radius(wide, spacing.x), radius(wide, spacing.y));
        self.slope.clear();
        self.slope.extend((0..count).map(|i| {
            let (c, r) = (i % columns, i / columns);
            let (w, e) = (c.saturating_sub(1), (c + 1).min(columns - 1));
            let (d, u) = (r.saturating_sub(1), (r + 1).min(rows - 1));
            let x = (a[r * columns + e] - a[r * columns + w]) / ((e - w) as f32 * spacing.x as f32);
            let y = (a[u * columns + c] - a[d * columns + c]) / ((u - d) as f32 * spacing.y as f32);
            (x * x + y * y).sqrt()
        }));
    }
}

/// How far out in the apron a node is, from 0 on the bed to 1 at the rim.
fn outward(i: usize, side: usize, apron: usize) -> f64 {
    let out = apron.saturating_sub(i).max((i + apron + 1).saturating_sub(side));
    out as f64 / apron as f64
}

/// Half width (nodes) of the box that, used three times, spreads like a Gaussian of a standard deviation (m).
fn radius(sigma: f64, spacing: f64) -> usize {
    let variance = sigma * sigma / (spacing * spacing);
    (0.5 * (libm::sqrt(1.0 + 4.0 * variance) - 1.0) + 0.5) as usize
}

/// Means over boxes of 2·rx + 1 by 2·ry + 1 nodes, with the border held on.
fn blur(values: &mut [f32], other: &mut Vec<f32>, columns: usize, rows: usize, rx: usize, ry: usize) {
    other.clear();
    other.extend_from_slice(values);
    let (rx, ry) = (rx.min(columns - 1), ry.min(rows - 1));
    if rx > 0 {
        let scale = 1.0 / (2 * rx + 1) as f64;
        for (row, out) in values.chunks_exact(columns).zip(other.chunks_exact_mut(columns)) {
            let at = |i: isize| f64::from(row[i.clamp(0, columns as isize - 1) as usize]);
            let mut sum: f64 = (-(rx as isize)..=rx as isize).map(at).sum();
            for (i, out) in out.iter_mut().enumerate() {
                *out = (sum * scale) as f32;
                let i = i as isize;
                sum += at(i + rx as isize + 1) - at(i - rx as isize);
            }
        }
    }
    if ry == 0 {
        values.copy_from_slice(other);
        return;
    }
    let scale = 1.0 / (2 * ry + 1) as f64;
    let row = |i: isize| {
        let r = i.clamp(0, rows as isize - 1) as usize;
        &other[r * columns..(r + 1) * columns]
    };
    let mut sums = vec![0.0f64; columns];
    for i in -(ry as isize)..=ry as isize {
        sums.iter_mut().zip(row(i)).for_each(|(s, v)| *s += f64::from(*v));
    }
    for r in 0..rows as isize {
        for (out, sum) in values[r as usize * columns..].iter_mut().zip(&sums) {
            *out = (sum * scale) as f32;
        }
        let (enter, leave) = (row(r + ry as isize + 1), row(r - ry as isize));
        for ((s, e), l) in sums.iter_mut().zip(enter).zip(leave) {
            *s += f64::from(*e) - f64::from(*l);
        }
    }
}

/// Makes a list so long, in new memory of large pages if it must grow.
pub(super) fn resize<T: Clone>(list: &mut Vec<T>, length: usize, value: T) {
    if list.capacity() < length {
        *list = memory::in_large_pages(Vec::with_capacity(length));
    }
    list.resize(length, value);
}

/// How far a solution has come, and whether to go on.
struct Progress<'a> {
    done: AtomicUsize,
    all: usize,
    stopped: AtomicBool,
    tell: &'a (dyn Fn(f64) -> bool + Sync),
}

impl Progress<'_> {
    /// Counts rows; false to stop.
    fn count(&self, rows: usize) -> bool {
        if self.stopped.load(Ordering::Relaxed) {
            return false;
        }
        let done = self.done.fetch_add(rows, Ordering::Relaxed) + rows;
        if !(self.tell)((done as f64 / self.all as f64).min(1.0)) {
            self.stopped.store(true, Ordering::Relaxed);
            return false;
        }
        true
    }
}

/// Marches all waves over a bed. What comes out is in `scratch`.
pub(super) fn solve(
    scratch: &mut Scratch,
    bed: &Bed,
    waves: &[PlaneWave],
    depth: f64,
    settings: &Settings,
    tell: &(dyn Fn(f64) -> bool + Sync),
) -> Result<(), ShoreError> {
    check(waves, depth, settings)?;
    let Scratch { grid, batches, smooth, other } = scratch;
    let (_, mean) = means(waves);
    let wavelength = if mean > 0.0 { TAU / mean } else { 50.0 };
    grid.lay(bed, depth, wavelength, settings, smooth, other);
    gather(batches, waves, depth, grid);
    let rows: usize = batches.iter().map(|b| if b.axis.is_multiple_of(2) { grid.columns } else { grid.rows }).sum();
    let progress = Progress { done: AtomicUsize::new(0), all: 2 * rows, stopped: AtomicBool::new(false), tell };
    let whole: f64 = waves.iter().map(|w| w.amplitude * w.amplitude).sum();
    let alone = batches.len() < 2;
    let grid = &*grid;
    // First all batches as if the others broke as they do, then with what the others came to.
    for pass in 0..2 {
        let went = batches
            .par_iter_mut()
            .map(|batch| {
                let own: f64 = batch.members.iter().map(|&i| waves[i].amplitude * waves[i].amplitude).sum();
                let share = if pass == 0 { whole / own.max(1e-300) } else { 1.0 };
                batch.walk(grid, share as f32, alone, &progress)
            })
            .reduce(|| true, |a, b| a && b);
        if !went {
            return Err(Cancelled.into());
        }
        if alone || pass == 1 || batches.iter().all(|batch| batch.kept.is_none()) {
            break;
        }
        let count = grid.columns * grid.rows;
        for i in 0..count {
            let total: f32 = batches.iter().map(|b| b.told[i].energy).sum();
            if total > 0.97 * grid.cap[i] {
                for batch in batches.iter_mut() {
                    let first = batch.kept.unwrap_or(0);
                    let (column, row) = (i % grid.columns, i / grid.columns);
                    let forward = if batch.axis.is_multiple_of(2) { column } else { row };
                    let steps = if batch.axis.is_multiple_of(2) { grid.columns } else { grid.rows };
                    let step = if batch.axis >= 2 { steps - 1 - forward } else { forward };
                    if step < first {
                        batch.kept = None;
                    }
                }
            }
        }
        for b in 0..batches.len() {
            let mut before = std::mem::take(&mut batches[b].before);
            before.clear();
            before.extend((0..count).map(|i| {
                let total: f32 = batches.iter().map(|b| b.told[i].energy).sum();
                let lower = (grid.cap[i] / total.max(1e-30)).min(1.0);
                (total - batches[b].told[i].energy).max(0.0) * lower
            }));
            batches[b].before = before;
        }
    }
    (tell)(1.0);
    Ok(())
}

fn check(waves: &[PlaneWave], depth: f64, settings: &Settings) -> Result<(), OutOfRange> {
    StillWater::of_depth(depth)?;
    OutOfRange::unless(waves.len() <= 1024, "waves over a bed", "at most 1024", waves.len() as f64)?;
    for wave in waves {
        let fine = wave.amplitude >= 0.0 && wave.amplitude <= 100.0;
        OutOfRange::unless(fine, "amplitude of a wave", "m, from 0 to 100", wave.amplitude)?;
        let k = wave.wavenumber.length();
        OutOfRange::unless((1e-6..=1e3).contains(&k), "wave number of a wave", "rad/m, from 1e-6 to 1000", k)?;
        let omega = wave.angular_frequency;
        OutOfRange::unless((1e-3..=1e3).contains(&omega), "frequency of a wave", "rad/s, from 0.001 to 1000", omega)?;
        OutOfRange::unless(wave.phase.is_finite(), "phase of a wave", "a finite angle", wave.phase)?;
    }
    let breaking = settings.breaking;
    OutOfRange::unless((0.1..=2.0).contains(&breaking), "breaking index", "from 0.1 to 2", f64::from(breaking))?;
    for (what, length) in [("smoothing of the bed", settings.smoothing), ("apron of the bed", settings.apron)] {
        let length = length.unwrap_or(0.0);
        OutOfRange::unless((0.0..=1e6).contains(&length), what, "m, from 0 to 1000000", length)?;
    }
    Ok(())
}

/// Sorts waves by their direction of march into batches.
fn gather(batches: &mut Vec<Batch>, waves: &[PlaneWave], depth: f64, grid: &Grid) {
    let axis = |w: &PlaneWave| {
        let (x, y) = (w.wavenumber.x, w.wavenumber.y);
        if x.abs() >= y.abs() {
            if x > 0.0 { 0 } else { 2 }
        } else if y > 0.0 {
            1
        } else {
            3
        }
    };
    let mut used = 0;
    for march in 0..4 {
        let members: Vec<usize> = (0..waves.len()).filter(|&i| axis(&waves[i]) == march).collect();
        let parts = members.len().div_ceil(LANES);
        for part in 0..parts {
            if batches.len() == used {
                batches.push(Batch::default());
            }
            let batch = &mut batches[used];
            used += 1;
            // Every so-manieth wave, so that all batches are of one mixture.
            batch.members.clear();
            batch.members.extend(members.iter().copied().skip(part).step_by(parts));
            batch.axis = march;
            let list = batch.waves.get_or_insert_with(Waves::new);
            list.prepare(waves, &batch.members, depth, grid, march);
            batch.before.clear();
            batch.kept = None;
        }
    }
    batches.truncate(used);
}

impl Waves {
    fn prepare(&mut self, waves: &[PlaneWave], members: &[usize], depth: f64, grid: &Grid, axis: usize) {
        let water = StillWater { depth, ..StillWater::DEEP };
        for (l, &member) in members.iter().enumerate() {
            let wave = &waves[member];
            let k = wave.wavenumber.length();
            let omega = wave.angular_frequency;
            // Waves whose own wave number is not that of still water keep the ratio.
            let ratio = k / water.wavenumber(omega);
            let q = if axis.is_multiple_of(2) { wave.wavenumber.y } else { wave.wavenumber.x };
            // No shorter than what the grid resolves.
            let finest = k + 2.4 / grid.spacing.max_element();
            for (step, entry) in self.table.iter_mut().enumerate() {
                let s = (step as f64 / STEPS as f64).clamp(1e-3, 1.0);
                let h = if s >= 1.0 { f64::INFINITY } else { SCALE * s * s / (1.0 - s * s) };
                let still = quick(omega, h);
                let k = (still * ratio).min(finest);
                let p = (k * k - q * q).max(0.02 * k * k).sqrt();
                let speed = StillWater { depth: h, ..StillWater::DEEP }.group_speed(still);
                let values = [p * s, 1.0 / p.sqrt(), (k / (speed * p)).sqrt() * s];
                entry.iter_mut().zip(values).for_each(|(to, value)| to.0[l] = value as f32);
            }
            // What the march itself makes of the open sea's depth, to the bit.
            let s = squeeze(depth);
            let (index, f) = march::entry(s);
            let at = |part: usize| {
                let (low, high) = (self.table[index][part].0[l], self.table[index + 1][part].0[l]);
                f.mul_add(high - low, low) * (1.0 / s)
            };
            self.along.0[l] = at(0);
            let open = at(2);
            self.table.iter_mut().for_each(|entry| entry[2].0[l] /= open);
            debug_assert!(wave.wavenumber.dot(AXES[axis]) > 0.0);
            self.across.0[l] = q as f32;
            self.energy.0[l] = (0.5 * wave.amplitude * wave.amplitude) as f32;
        }
        // Idle lanes carry the first wave without energy.
        for l in members.len()..LANES {
            let lists = self.table.iter_mut().flatten().chain([&mut self.across, &mut self.along]);
            lists.for_each(|list| list.0[l] = list.0[0]);
            self.energy.0[l] = 0.0;
        }
    }
}

/// Wave number (rad/m) at a depth (m), to a relative error of 1e-8: Newton's method on J. Eckart's guess in D. Peachey's form.
pub(super) fn quick(omega: f64, depth: f64) -> f64 {
    let deep = omega * omega / super::super::STANDARD_GRAVITY;
    let mu = deep * depth;
    if mu > 25.0 {
        return deep;
    }
    // x tanh x = mu.
    let mut x = mu / libm::sqrt(libm::tanh(mu));
    for _ in 0..3 {
        let t = libm::tanh(x);
        x -= (x * t - mu) / (t + x * (1.0 - t * t));
    }
    x / depth
}

impl Batch {
    /// Marches over the whole grid; false if it was told to stop. Unless it is `alone`, it must march again from where waves may break.
    fn walk(&mut self, grid: &Grid, share: f32, alone: bool, progress: &Progress<'_>) -> bool {
        let Batch { axis, members, waves, march, nodes, sides, records, told, before, kept, kept_b, kept_whole } = self;
        let Some(waves) = waves else { return true };
        let (columns, rows) = (grid.columns, grid.rows);
        let count = columns * rows;
        let waves_told = members.len();
        resize(records, count * waves_told, 0);
        resize(told, count, Told::default());
        let along_x = axis.is_multiple_of(2);
        let (steps, across) = if along_x { (columns, rows) } else { (rows, columns) };
        let (forward, apart) =
            if along_x { (grid.spacing.x, grid.spacing.y) } else { (grid.spacing.y, grid.spacing.x) };
        let backward = *axis >= 2;
        let (apron_along, apron_across) =
            if along_x { (grid.apron[0], grid.apron[1]) } else { (grid.apron[1], grid.apron[0]) };
        march.start(across);
        let again = !before.is_empty();
        let first = if again { kept.unwrap_or(0) } else { 0 };
        if first > 0 {
            march.b.copy_from_slice(kept_b);
            march.whole.copy_from_slice(kept_whole);
        }
        nodes.resize(across, Node::default());
        sides.clear();
        sides.extend((0..across).map(|j| outward(j, across, apron_across) as f32));
        let at = |step: usize, j: usize| {
            let step = if backward { steps - 1 - step } else { step };
            if along_x { j * columns + step } else { step * columns + j }
        };
        for step in first..steps {
            let out = outward(step, steps, apron_along) as f32;
            for (j, (node, side)) in nodes.iter_mut().zip(&*sides).enumerate() {
                let i = at(step, j);
                *node = Node {
                    s: grid.s[i],
                    near: grid.near[i],
                    draw: 0.0,
                    open: smooth(0.4, 1.0, out.max(*side)),
                    cap: grid.cap[i],
                    others: if again { before[i] } else { 0.0 },
                };
            }
            if !again && kept.is_none() {
                kept_b.clone_from(&march.b);
                kept_whole.clone_from(&march.whole);
            }
            let tell = alone || again || kept.is_none();
            march::settle(march, waves, nodes, share, tell);
            // Well before the limit, for what the other batches come to is only guessed in the first march.
            if !again && kept.is_none() && nodes.iter().zip(&march.told).any(|(n, t)| t.energy * share > 0.3 * n.cap) {
                *kept = Some(step);
            }
            for j in 0..across {
                let i = at(step, j);
                told[i] = march.told[j];
                if tell {
                    records[i * waves_told..][..waves_told].copy_from_slice(&march.records[j][..waves_told]);
                }
            }
            if step + 1 == steps {
                break;
            }
            let most = (5.0 * forward / (apart * apron_across as f64)) as f32;
            for (j, (node, side)) in nodes.iter_mut().zip(&*sides).enumerate() {
                let next = at(step + 1, j);
                (node.s, node.near) = (0.5 * (node.s + grid.s[next]), grid.near[next]);
                node.draw = (most * side * side).min(1.0);
            }
            march::advance(march, waves, nodes, forward as f32, apart as f32);
            if step % 16 == 15 && !progress.count(16) {
                return false;
            }
        }
        true
    }
}

/// What becomes of a record of a march when all waves are lowered alike.
pub(super) fn lowered(amplitude: u16, by: f32) -> u16 {
    (f32::from(amplitude) * by + 0.5) as u16
}
