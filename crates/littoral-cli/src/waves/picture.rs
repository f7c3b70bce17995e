//! Plots of spectra: energy over frequency with the directions below, and energy by frequency and direction as a rose.

use super::{digits, summary};
use crate::plot::{Anchor, Canvas, Colour, GREY, INK, LIGHT, SEA, ticks};
use crate::talk::tidy;
use glam::{DVec2, UVec2};
use littoral::waves::{SeaState, Train, heading_from_bearing};
use std::f64::consts::TAU;

/// The area under a spectrum.
const WATER: Colour = [0xd3, 0xe4, 0xf1];
/// The peak.
const MARK: Colour = [0xc2, 0x4d, 0x2c];
/// Periods that people think in (s).
const PERIODS: [f64; 14] = [30.0, 20.0, 15.0, 12.0, 10.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5];

/// A part of the highest density below which nothing is to be seen.
const UNSEEN: f64 = 5e-3;

fn highest(state: &SeaState, low: f64, high: f64) -> f64 {
    let steps = 4000;
    let peaks = state.trains.iter().map(Train::peak).chain(summary::peak(state));
    let even = (0..=steps).map(|i| low + (high - low) * f64::from(i) / f64::from(steps));
    peaks.filter(|f| (low..=high).contains(f)).chain(even).map(|f| state.density(f)).fold(0.0, f64::max)
}

/// Frequencies (Hz) between which something is to be seen: from 0, to a round one.
fn range(state: &SeaState) -> (f64, f64) {
    let measured = state.trains.iter().filter_map(|train| match train {
        Train::Measured(sea) => sea.bands().last().map(|band| band.frequency),
        Train::Formula { .. } => None,
    });
    let last = measured.fold(0.0, f64::max);
    let top = state.trains.iter().map(Train::peak).fold(last.max(0.1), f64::max);
    let most = highest(state, 0.0, 6.0 * top);
    let seen =
        (0..=600).map(|i| top * f64::from(i) * 0.01).filter(|f| state.density(*f) > UNSEEN * most).fold(0.0, f64::max);
    let end = if last > 0.0 { last.min(seen * 1.4) } else { seen };
    let end = end.max(1e-3);
    let step = ticks(0.0, end, 8.0).get(1).copied().unwrap_or(end);
    (0.0, (end / step).ceil() * step)
}

/// Frequencies (Hz, rising) evenly between two, and the sharp corners and peaks of a state as they are.
fn samples(state: &SeaState, low: f64, high: f64, count: usize) -> Vec<f64> {
    let mut at: Vec<f64> = (0..=count).map(|i| low + (high - low) * i as f64 / count as f64).collect();
    for train in &state.trains {
        match train {
            Train::Measured(sea) => at.extend(sea.bands().iter().map(|band| band.frequency)),
            Train::Formula { spectrum, .. } => at.push(spectrum.peak),
        }
    }
    at.retain(|f| (low..=high).contains(f));
    at.sort_by(f64::total_cmp);
    at.dedup();
    at
}

/// The peaks that stand out, the highest first: frequency and density.
fn peaks(state: &SeaState, low: f64, high: f64) -> Vec<(f64, f64)> {
    let most = highest(state, low, high);
    let at = samples(state, low, high, 600);
    let density: Vec<f64> = at.iter().map(|f| state.density(*f)).collect();
    let mut found: Vec<(f64, f64)> = Vec::new();
    if let Some(peak) = summary::peak(state).filter(|f| (low..=high).contains(f)) {
        found.push((peak, state.density(peak)));
    }
    for i in 1..at.len().saturating_sub(1) {
        if density[i] < density[i - 1] || density[i] < density[i + 1] || density[i] <= 0.12 * most {
            continue;
        }
        // It stands out if the land sinks to three quarters on the way to any higher one.
        let apart = found.iter().all(|&(f, _)| {
            let j = at.partition_point(|other| *other < f);
            let (a, b) = (i.min(j), i.max(j).min(at.len() - 1));
            density[a..=b].iter().fold(f64::INFINITY, |least, d| least.min(*d)) < 0.75 * density[i]
        });
        if apart {
            found.push((at[i], density[i]));
        }
    }
    found
}

/// A plot of energy over frequency.
pub struct Rise<'a> {
    state: &'a SeaState,
    title: String,
    below: String,
    size: UVec2,
    range: (f64, f64),
    /// Whether directions differ from frequency to frequency.
    directed: bool,
}

impl<'a> Rise<'a> {
    /// Of a state; `below` stands under the title. `range` of frequencies (Hz), or what is to be seen.
    pub fn new(
        state: &'a SeaState,
        title: String,
        below: String,
        size: UVec2,
        frequencies: Option<(f64, f64)>,
    ) -> Rise<'a> {
        let range = frequencies.unwrap_or_else(|| range(state));
        let directed = state.trains.len() > 1 || state.trains.iter().any(|train| matches!(train, Train::Measured(_)));
        let told = |f: f64| summary::directions(state, f).0.is_some();
        let directed = directed && summary::peak(state).is_some_and(told);
        Rise { state, title, below, size, range, directed }
    }

    /// Draws it.
    pub fn draw(&self, canvas: &mut dyn Canvas) {
        let (width, height) = (f64::from(self.size.x), f64::from(self.size.y));
        let size = (0.024 * height).clamp(9.0, 30.0);
        let (left, right) = (5.0 * size, width - 2.4 * size);
        let top = 6.6 * size;
        let foot = height - 3.6 * size;
        let bottom = if self.directed { foot - (0.23 * height).max(6.0 * size) } else { foot };
        let (low, high) = self.range;
        let most = highest(self.state, low, high);
        let ceiling = if most > 0.0 { 1.12 * most } else { 1.0 };
        let x = |f: f64| left + (right - left) * (f - low) / (high - low);
        let y = |density: f64| bottom - (bottom - top) * density / ceiling;
        let across = |at: f64| [DVec2::new(left, at), DVec2::new(right, at)];

        canvas.text(DVec2::new(left, 1.9 * size), Anchor::Start, 1.25 * size, INK, &self.title);
        canvas.text(DVec2::new(left, 3.5 * size), Anchor::Start, size, GREY, &self.below);

        for tick in ticks(0.0, ceiling, ((bottom - top) / (2.8 * size)).max(2.0)) {
            canvas.line(&across(y(tick)), LIGHT, 1.0);
            let at = DVec2::new(left - 0.5 * size, y(tick) + 0.35 * size);
            canvas.text(at, Anchor::End, size, INK, &digits(tick, 4));
        }
        self.curves(canvas, &x, &y, bottom, (right - left) as usize);
        if self.directed {
            self.directions(canvas, &x, [left, right, bottom + 1.3 * size, foot], size);
        }
        canvas.line(&across(bottom), GREY, 1.0);
        for tick in ticks(low, high, ((right - left) / (7.0 * size)).max(2.0)) {
            let at = x(tick);
            canvas.line(&[DVec2::new(at, foot), DVec2::new(at, foot + 0.4 * size)], GREY, 1.0);
            canvas.text(DVec2::new(at, foot + 1.5 * size), Anchor::Middle, size, INK, &tidy(tick, 4));
        }
        let mut free = f64::NEG_INFINITY;
        for period in PERIODS {
            let at = x(1.0 / period);
            if !(left - 0.5..=right + 0.5).contains(&at) || at < free {
                continue;
            }
            free = at + 2.4 * size;
            canvas.line(&[DVec2::new(at, top), DVec2::new(at, top - 0.4 * size)], GREY, 1.0);
            canvas.text(DVec2::new(at, top - 0.8 * size), Anchor::Middle, size, INK, &tidy(period, 1));
        }
        canvas.line(&across(top), GREY, 1.0);
        canvas.text(DVec2::new(left - 0.5 * size, top - 0.8 * size), Anchor::End, size, INK, "S (m²/Hz)");
        canvas.text(DVec2::new(right, top - 2.1 * size), Anchor::End, size, INK, "period (s)");
        canvas.text(DVec2::new(right, foot + 2.9 * size), Anchor::End, size, INK, "frequency (Hz)");

        for (f, density) in peaks(self.state, low, high) {
            let at = DVec2::new(x(f), y(density));
            canvas.line(&[at, DVec2::new(at.x, bottom)], MARK, 1.2);
            let label = format!("{} s", digits(1.0 / f, 3));
            let (shift, anchor) = if at.x > right - 6.0 * size { (-0.5, Anchor::End) } else { (0.5, Anchor::Start) };
            canvas.text(at + DVec2::new(shift * size, -0.4 * size), anchor, size, MARK, &label);
        }
    }

    /// The whole spectrum, and its parts if there are several.
    fn curves(
        &self,
        canvas: &mut dyn Canvas,
        x: &dyn Fn(f64) -> f64,
        y: &dyn Fn(f64) -> f64,
        bottom: f64,
        pixels: usize,
    ) {
        let (low, high) = self.range;
        let at = samples(self.state, low, high, pixels.clamp(100, 2000));
        let curve = |density: &dyn Fn(f64) -> f64| -> Vec<DVec2> {
            at.iter().map(|&f| DVec2::new(x(f), y(density(f)))).collect()
        };
        let mut whole = curve(&|f| self.state.density(f));
        if self.state.trains.len() > 1 {
            for train in &self.state.trains {
                canvas.line(&curve(&|f| train.density(f)), GREY, 1.0);
            }
        }
        canvas.line(&whole, SEA, 2.0);
        if let (Some(&first), Some(&last)) = (whole.first(), whole.last()) {
            whole.extend([DVec2::new(last.x, bottom), DVec2::new(first.x, bottom)]);
            canvas.area(&whole, WATER);
        }
    }

    /// From where the waves of each frequency come, and how they spread; fainter where there is little energy.
    fn directions(
        &self,
        canvas: &mut dyn Canvas,
        x: &dyn Fn(f64) -> f64,
        [left, right, top, bottom]: [f64; 4],
        size: f64,
    ) {
        let (low, high) = self.range;
        let most = highest(self.state, low, high);
        let mut frequencies: Vec<f64> = self
            .state
            .trains
            .iter()
            .filter_map(|train| match train {
                Train::Measured(sea) => Some(sea.bands().iter().map(|band| band.frequency)),
                Train::Formula { .. } => None,
            })
            .flatten()
            .collect();
        if frequencies.is_empty() {
            frequencies = (0..=60).map(|i| low + (high - low) * f64::from(i) / 60.0).collect();
        }
        frequencies.retain(|f| (low..=high).contains(f));
        // Wound so that the waves of the peak lie in the middle.
        let middle = summary::peak(self.state).and_then(|f| summary::directions(self.state, f).0).unwrap_or(180.0);
        let start = (middle / 90.0).round() * 90.0 - 180.0;
        let y = |bearing: f64| top + (bottom - top) * (bearing - start) / 360.0;
        for quarter in 0..=4 {
            let bearing = start + 90.0 * f64::from(quarter);
            let at = y(bearing);
            canvas.line(&[DVec2::new(left, at), DVec2::new(right, at)], LIGHT, 1.0);
            let name = super::compass(bearing.rem_euclid(360.0));
            canvas.text(DVec2::new(left - 0.5 * size, at + 0.35 * size), Anchor::End, size, INK, name);
        }
        for f in frequencies {
            let (Some(from), Some(spread)) = summary::directions(self.state, f) else { continue };
            let strength = (self.state.density(f) / most).sqrt().clamp(0.0, 1.0);
            if self.state.density(f) < 0.1 * UNSEEN * most {
                continue;
            }
            let colour = mixed([0xd6, 0xdd, 0xe3], SEA, (1.6 * strength).min(1.0));
            let bearing = start + (from - start).rem_euclid(360.0);
            // A bar that leaves at one side comes in at the other.
            for turn in [-360.0, 0.0, 360.0] {
                let (a, b) = (bearing + turn - spread, bearing + turn + spread);
                let (a, b) = (a.clamp(start, start + 360.0), b.clamp(start, start + 360.0));
                if b > a {
                    canvas.line(&[DVec2::new(x(f), y(a)), DVec2::new(x(f), y(b))], colour, 0.09 * size);
                }
            }
            let (at, r) = (DVec2::new(x(f), y(bearing)), 0.26 * size);
            let dot: Vec<DVec2> = (0..12).map(|i| at + DVec2::from_angle(TAU * f64::from(i) / 12.0) * r).collect();
            canvas.patch(&dot, colour);
        }
        let at = DVec2::new(left, bottom + 2.9 * size);
        canvas.text(at, Anchor::Start, size, INK, "lower panel: bearing from which the waves come, mean ± spread");
    }
}

fn mixed(a: Colour, b: Colour, share: f64) -> Colour {
    std::array::from_fn(|i| (f64::from(a[i]) + (f64::from(b[i]) - f64::from(a[i])) * share).round() as u8)
}

/// Colours of rising energy: from the paper over green and blue to the dark, each step darker.
fn energy(share: f64) -> Colour {
    const STOPS: [Colour; 6] =
        [[0xff; 3], [0xd9, 0xee, 0xe1], [0x86, 0xca, 0xc4], [0x3a, 0x93, 0xb8], [0x2b, 0x55, 0x9a], [0x2a, 0x1e, 0x5c]];
    let at = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (at as usize).min(STOPS.len() - 2);
    mixed(STOPS[below], STOPS[below + 1], at - below as f64)
}

/// A rose of energy: bearings from which waves come round it, frequencies outwards.
pub struct Polar {
    title: String,
    below: String,
    size: UVec2,
    /// Highest frequency (Hz).
    end: f64,
    /// Densities (m²/Hz/degree), ring by ring.
    density: Vec<f64>,
    most: f64,
}

/// Rings and sectors of a rose.
const RINGS: usize = 120;
const SECTORS: usize = 180;
/// Steps of its colours.
const SHADES: f64 = 64.0;

/// A round frequency (Hz) up to which all energy but a thirtieth lies.
fn most_within(state: &SeaState, end: f64) -> f64 {
    let at = samples(state, 0.0, end, 600);
    let part = |pair: &[f64]| (pair[1] - pair[0]) * 0.5 * (state.density(pair[0]) + state.density(pair[1]));
    let all: f64 = at.windows(2).map(part).sum();
    let mut sum = 0.0;
    let within = at.windows(2).find(|pair| {
        sum += part(pair);
        sum > 0.97 * all
    });
    let end = within.map_or(end, |pair| pair[1]);
    let step = ticks(0.0, end, 8.0).get(1).copied().unwrap_or(end);
    (end / step).ceil() * step
}

impl Polar {
    /// Of a state; `below` stands under the title; out to `end` (Hz), or to what is to be seen.
    pub fn new(state: &SeaState, title: String, below: String, size: UVec2, end: Option<f64>) -> Polar {
        let end = end.filter(|end| *end > 0.0).unwrap_or_else(|| most_within(state, range(state).1));
        let mut density = vec![0.0; RINGS * SECTORS];
        let frequency = |ring: usize| end * (ring as f64 + 0.5) / RINGS as f64;
        for train in &state.trains {
            let alone = SeaState { trains: vec![train.clone()], ..SeaState::CALM };
            let sectors = |f: f64| -> Vec<f64> {
                let slice = alone.slice(f);
                let bearing = |sector: usize| 360.0 * (sector as f64 + 0.5) / SECTORS as f64;
                (0..SECTORS).map(|i| slice.density(heading_from_bearing(bearing(i))).to_radians()).collect()
            };
            if let Train::Measured(sea) = train {
                // Directions change from band to band: straight lines between them, as for the densities.
                let bands: Vec<(f64, Vec<f64>)> =
                    sea.bands().iter().map(|b| (b.frequency, sectors(b.frequency))).collect();
                for ring in 0..RINGS {
                    let above = bands.partition_point(|(f, _)| *f <= frequency(ring));
                    let (Some((a, below)), Some((b, over))) = (bands.get(above.wrapping_sub(1)), bands.get(above))
                    else {
                        continue;
                    };
                    let share = (frequency(ring) - a) / (b - a);
                    for sector in 0..SECTORS {
                        density[ring * SECTORS + sector] += below[sector] + (over[sector] - below[sector]) * share;
                    }
                }
                continue;
            }
            for (ring, cells) in density.chunks_mut(SECTORS).enumerate() {
                cells.iter_mut().zip(sectors(frequency(ring))).for_each(|(cell, more)| *cell += more);
            }
        }
        let most = density.iter().copied().fold(0.0, f64::max);
        Polar { title, below, size, end, density, most }
    }

    /// Draws it.
    pub fn draw(&self, canvas: &mut dyn Canvas) {
        let (width, height) = (f64::from(self.size.x), f64::from(self.size.y));
        let size = (0.021 * height.min(width)).clamp(8.0, 30.0);
        let head = 4.6 * size;
        let room = (width - 9.0 * size).min(height - head);
        let radius = 0.5 * room - 2.6 * size;
        let middle = DVec2::new(0.5 * (width - 7.0 * size), head + 0.5 * (height - head));
        canvas.text(DVec2::new(1.6 * size, 2.1 * size), Anchor::Start, 1.3 * size, INK, &self.title);
        canvas.text(DVec2::new(1.6 * size, 3.8 * size), Anchor::Start, size, GREY, &self.below);

        let to = |bearing: f64, r: f64| {
            let angle = bearing.to_radians();
            middle + DVec2::new(angle.sin(), -angle.cos()) * r
        };
        let shade = |density: f64| if self.most > 0.0 { ((density / self.most).sqrt() * SHADES).round() } else { 0.0 };
        let step = 360.0 / SECTORS as f64;
        for ring in 0..RINGS {
            let (inner, outer) = (radius * ring as f64 / RINGS as f64, radius * (ring + 1) as f64 / RINGS as f64);
            let outer = (outer + 1.0).min(radius);
            let shades: Vec<f64> = (0..SECTORS).map(|i| shade(self.density[ring * SECTORS + i])).collect();
            let mut sector = 0;
            while sector < SECTORS {
                let run = shades[sector..].iter().take_while(|other| **other == shades[sector]).count();
                if shades[sector] > 0.0 {
                    // A little over the next cells, which are painted later: no seams.
                    let over = (60.0 / outer.max(1.0)).min(step);
                    let bearing = |i: usize| step * (sector + i) as f64 + if i == run { over } else { 0.0 };
                    let out = (0..=run).map(|i| to(bearing(i), outer));
                    let back = (0..=run).rev().map(|i| to(bearing(i), inner));
                    canvas.patch(&out.chain(back).collect::<Vec<_>>(), energy(shades[sector] / SHADES));
                }
                sector += run;
            }
        }
        let circle = |r: f64| -> Vec<DVec2> { (0..=180).map(|i| to(2.0 * f64::from(i), r)).collect() };
        let quiet = self.quiet();
        for tick in ticks(0.0, self.end, (radius / (4.5 * size)).max(2.0)) {
            let r = radius * tick / self.end;
            if tick <= 0.0 || r > 0.97 * radius {
                continue;
            }
            canvas.line(&circle(r), LIGHT, 0.8);
            let label = format!("{} Hz · {} s", tidy(tick, 3), digits(1.0 / tick, 2));
            canvas.text(to(quiet, r) + DVec2::new(0.0, 0.35 * size), Anchor::Middle, 0.85 * size, GREY, &label);
        }
        for bearing in (0..360).step_by(30).map(f64::from) {
            canvas.line(&[to(bearing, 0.04 * radius), to(bearing, radius)], LIGHT, 0.8);
            let right_angle = bearing % 90.0 == 0.0;
            let label = if right_angle { super::compass(bearing).to_owned() } else { format!("{bearing:.0}°") };
            let (letters, colour) = if right_angle { (1.25 * size, INK) } else { (0.9 * size, GREY) };
            canvas.text(
                to(bearing, radius + 1.3 * size) + DVec2::new(0.0, 0.36 * letters),
                Anchor::Middle,
                letters,
                colour,
                &label,
            );
        }
        canvas.line(&circle(radius), GREY, 1.2);
        let foot = DVec2::new(width - 1.6 * size, height - 1.2 * size);
        canvas.text(foot, Anchor::End, 0.9 * size, GREY, "bearing: where waves come from; outwards: frequency");
        self.key(canvas, width - 6.4 * size, [middle.y - 0.62 * radius, middle.y + 0.62 * radius], size);
    }

    /// The bearing, between the lines, in which there is least to be hidden by labels.
    fn quiet(&self) -> f64 {
        let energy = |bearing: f64| -> f64 {
            let sector = (bearing / 360.0 * SECTORS as f64) as usize;
            let near =
                |ring: usize| (SECTORS - 8..=SECTORS + 8).map(move |off| ring * SECTORS + (sector + off) % SECTORS);
            (0..RINGS).flat_map(near).map(|i| self.density[i]).sum()
        };
        let candidates = [75.0, 105.0, 255.0, 285.0, 15.0, 165.0, 195.0, 345.0];
        candidates.into_iter().min_by(|a, b| energy(*a).total_cmp(&energy(*b))).unwrap_or(75.0)
    }

    /// The scale of colours.
    fn key(&self, canvas: &mut dyn Canvas, left: f64, [top, bottom]: [f64; 2], size: f64) {
        let right = left + 1.2 * size;
        let y = |share: f64| bottom - (bottom - top) * share;
        let steps = 64;
        for i in 0..steps {
            let (a, b) = (f64::from(i) / f64::from(steps), f64::from(i + 1) / f64::from(steps));
            let above = (y(b) - 1.5).max(top);
            let corners =
                [DVec2::new(left, y(a)), DVec2::new(right, y(a)), DVec2::new(right, above), DVec2::new(left, above)];
            canvas.patch(&corners, energy(0.5 * (a + b)));
        }
        let frame = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)].map(DVec2::from);
        canvas.line(&frame, GREY, 1.0);
        canvas.text(DVec2::new(left, top - 2.2 * size), Anchor::Start, size, INK, "energy");
        canvas.text(DVec2::new(left, top - 0.9 * size), Anchor::Start, size, INK, "m²/Hz/°");
        if self.most <= 0.0 {
            return;
        }
        let mut free = f64::INFINITY;
        for tick in ticks(0.0, self.most, 4.0).into_iter().chain(ticks(0.0, 0.1 * self.most, 1.0)) {
            let at = y((tick / self.most).sqrt());
            // From the bottom up, where the scale is narrow.
            if (free - at).abs() < 1.2 * size {
                continue;
            }
            free = at;
            canvas.line(&[DVec2::new(right, at), DVec2::new(right + 0.35 * size, at)], GREY, 1.0);
            canvas.text(DVec2::new(right + 0.6 * size, at + 0.35 * size), Anchor::Start, size, INK, &digits(tick, 3));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_of_sea_and_swell_stand_out() {
        let found = |line: &str| {
            let state: SeaState = line.parse().expect(line);
            let (low, high) = range(&state);
            let mut found: Vec<f64> =
                peaks(&state, low, high).iter().map(|p| (1.0 / p.0 * 10.0).round() / 10.0).collect();
            found.sort_by(f64::total_cmp);
            found
        };
        assert_eq!(found("hs=2,tp=8"), [8.0]);
        assert_eq!(found("hs=2,tp=7,swell=1.5@15/300"), [7.0, 15.0]);
        assert!(found("calm").is_empty());
    }

    #[test]
    fn colours_darken_with_energy() {
        let light = |share: f64| energy(share).iter().map(|&c| f64::from(c)).sum::<f64>();
        assert!((0..100).all(|i| light(f64::from(i) * 0.01) > light(f64::from(i + 1) * 0.01)));
        assert_eq!(energy(0.0), [0xff; 3]);
    }

    #[test]
    fn a_rose_shows_from_where_waves_come() {
        let state: SeaState = "hs=2,tp=8,from=90".parse().expect("a sea");
        let polar = Polar::new(&state, "rose".into(), String::new(), UVec2::new(400, 400), None);
        let top = polar.density.iter().position(|d| *d == polar.most).expect("energy");
        let bearing = 360.0 * ((top % SECTORS) as f64 + 0.5) / SECTORS as f64;
        assert!((bearing - 90.0).abs() <= 2.0, "{bearing}");
        // The sum over the rose is the sea's energy.
        let cell = polar.end / RINGS as f64 * 360.0 / SECTORS as f64;
        let height = 4.0 * (polar.density.iter().sum::<f64>() * cell).sqrt();
        assert!((height / 2.0 - 1.0).abs() < 0.03, "{height}");
        assert!((165.0..345.0).contains(&polar.quiet()), "labels stand where there is nothing: {}", polar.quiet());
    }
}
