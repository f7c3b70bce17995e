//! Viewsheds: which samples of the land are seen from a point. Exact, by bounding the horizon.
//!
//! Seen from the eye, everything can be projected onto a wall: direction (minor over major offset) against slope (height
//! over major offset). Straight lines stay straight there, so the ground along a line of the lattice appears as a chain of
//! straight segments, and the horizon behind which a sample hides is the upper envelope of all that lies before it. The
//! land is cut into eight octants, each swept outward, one ring (a row or a column) after the other, over narrow bins of
//! directions; bins are halved as they spread, so that each is half to one sample wide. For each bin two straight lines
//! bound the horizon: the *upper* one is the chord over the bin's edges of everything met (an envelope of straight
//! segments is convex, so it stays below its chord) raised by what a sample within the bins beside an edge, and the bulge
//! of the saddles between two rings, can add; the *lower* one is the best single segment. A sample that its own last patch
//! cannot hide is seen if it is above the upper line; one below the lower line, or behind the ring just before, is hidden.
//! Between remain about one in a hundred. These are followed back ring by ring, many at once, until the upper line of some
//! rings ago clears them; what an old crest leaves in doubt, three in a thousand, gets a line of sight of its own over the
//! rings in question. So the answer is that of a line of sight to every sample, at the cost of a sweep. Rings that lie
//! wholly below the lower lines of fifteen bins are skipped, sixteen such rings at once before they are even fetched.
//!
//! What is new here is the pair of bounds; sweeping a horizon outward is old: W. R. Franklin, C. K. Ray, "Higher isn't
//! necessarily better: visibility algorithms and experiments", 1994 (R3, R2, Xdraw, all but R3 approximate); M. van
//! Kreveld, "Variations on sweep algorithms: efficient computation of extended viewsheds and class intervals", 1996.

mod doubt;
mod frame;
mod lanes;
mod marks;
mod near;
mod sweep;

use super::sight::{Curvature, SightError, SightLine, Station, drop_per_square};
use super::{GRAZE, Simd};
use crate::field::Land;
use frame::Frame;
use glam::DVec2;
use marks::Seen;
use near::NEAR;
use rayon::prelude::*;

/// What a viewshed is asked for, beside the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewshed {
    /// Height above the ground (m) of what is looked for.
    pub target_height: f64,
    /// Samples farther away horizontally (m) are not seen. Infinity for the whole land.
    pub radius: f64,
    /// Whether, and how, the Earth curves.
    pub curvature: Option<Curvature>,
}

impl Default for Viewshed {
    /// The ground itself, as far as the land goes, on a flat Earth.
    fn default() -> Viewshed {
        Viewshed { target_height: 0.0, radius: f64::INFINITY, curvature: None }
    }
}

/// What a viewshed found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewshedCount {
    /// Samples seen.
    pub seen: usize,
    /// Samples that needed a line of sight of their own.
    pub lines: usize,
    /// Of these, lines that had to be followed all the way to the eye.
    pub whole_lines: usize,
}

/// One viewshed's circumstances.
struct Scene<'a> {
    land: &'a Land,
    /// The eye, in the land's lattice.
    eye: DVec2,
    /// Its height, absolute and above the ground (m).
    eye_height: f64,
    above_ground: f64,
    target_height: f64,
    radius: f64,
    drop_per_square: f64,
    /// How far below the bilinear interpolation of its corners' drops a curved Earth's drop may lie within a patch (m).
    sag: f64,
    /// Which instructions to use.
    simd: Simd,
}

/// A sample whose bounds did not decide.
#[derive(Clone, Copy, Debug)]
struct Pending {
    ring: i64,
    minor: i64,
    /// The rings between which something may be in the way; from 0: anywhere.
    from: i64,
    to: i64,
}

impl Land {
    /// Which samples an observer sees: writes 255 for those seen and 0 for the others, row by row from the south as the
    /// raster's heights. A sample is seen if the line of sight from the observer to the point `target_height` above it is
    /// free: exactly the answer of [`Land::sight`] for that pair, with its rules for touching and voids. Void samples are
    /// not seen. Runs on rayon's threads; the result does not depend on their number.
    ///
    /// # Errors
    /// If the observer is outside the land or over a void, or a number makes no sense.
    ///
    /// # Panics
    /// If `seen` does not hold one number for each sample.
    pub fn viewshed(&self, observer: Station, asked: &Viewshed, seen: &mut [u8]) -> Result<ViewshedCount, SightError> {
        self.viewshed_with(observer, asked, seen, Simd::best())
    }

    /// [`Land::viewshed`] with other instructions than the best there are: for tests and comparisons. All give the
    /// same answer.
    ///
    /// # Panics
    /// If the processor does not have them.
    pub fn viewshed_with(
        &self,
        observer: Station,
        asked: &Viewshed,
        seen: &mut [u8],
        simd: Simd,
    ) -> Result<ViewshedCount, SightError> {
        let raster = self.raster();
        assert!(simd.available(), "expected instructions that this processor has, got {simd:?}");
        assert_eq!(seen.len(), raster.heights().len(), "expected room for one number for each sample");
        if !asked.target_height.is_finite() {
            return Err(SightError::Number("a finite target height (m)", asked.target_height));
        }
        if asked.radius.is_nan() || asked.radius < 0.0 {
            return Err(SightError::Number("a radius of 0 or more (m)", asked.radius));
        }
        let drop_per_square = drop_per_square(asked.curvature)?;
        let (eye, ground) = self.stand(observer)?;
        seen.fill(0);
        if observer.above_ground < -GRAZE || asked.target_height < -GRAZE {
            return Ok(ViewshedCount::default());
        }
        let scene = Scene {
            land: self,
            eye,
            eye_height: ground + observer.above_ground,
            above_ground: observer.above_ground,
            target_height: asked.target_height,
            radius: asked.radius,
            drop_per_square,
            sag: 0.25 * drop_per_square * raster.spacing().length_squared(),
            simd,
        };

        let mut count = ViewshedCount::default();
        if scene.is_beyond_reason() {
            scene.line_by_line(seen, &mut count);
            count.seen -= scene.forget(seen);
            return Ok(count);
        }
        let wedges = scene.wedges();
        let marks = Seen::new(seen);
        let sweep = |(frame, part, parts)| sweep::sweep(&scene, &frame, part, parts, &marks);
        let found: Vec<ViewshedCount> = wedges.into_par_iter().map(sweep).collect();
        for found in found {
            count.seen += found.seen;
            count.lines += found.lines;
            count.whole_lines += found.whole_lines;
        }
        scene.look_around(seen, &mut count);
        count.seen -= scene.forget(seen);
        Ok(count)
    }
}

impl Scene<'_> {
    /// The land in wedges of directions: octant by octant, each in so many equal parts that bins, halved as they spread,
    /// are about one sample wide on the last ring.
    fn wedges(&self) -> Vec<(Frame, usize, usize)> {
        let mut wedges = Vec::with_capacity(56);
        for octant in 0..8 {
            let frame = Frame::new(self, octant & 4 == 0, octant & 2 == 0, octant & 1 == 0);
            let mut parts = frame.distance(frame.rings) / (sweep::BINS as f64 * sweep::WIDEST);
            while parts > 7.0 {
                parts *= 0.5;
            }
            let parts = (parts.ceil() as usize).max(4);
            wedges.extend((0..parts).map(|part| (frame, part, parts)));
        }
        wedges
    }

    /// The line of sight to a sample.
    fn line(&self, target: DVec2, index: usize) -> SightLine {
        let top = f64::from(self.land.raster().heights()[index]) + self.target_height;
        SightLine::new(self.land, (self.eye, self.eye_height), (target, top), self.drop_per_square)
    }

    /// Whether the line of sight to an undecided sample is free.
    fn free(&self, frame: &Frame, pending: &Pending) -> bool {
        let major = frame.major(pending.ring);
        let index = frame.index(major, pending.minor);
        let minor = frame.raw_minor(pending.minor);
        let target = if frame.eastward { (major, minor) } else { (minor, major) };
        let line = self.line(DVec2::new(target.0 as f64, target.1 as f64), index);
        if pending.from <= 1 {
            return !line.blocked(self.land);
        }
        // The strip that ends at the first of the rings counts.
        let (from, to) = (frame.major(pending.from - 1), frame.major(pending.to));
        !line.blocked_between(self.land, from.min(to), from.max(to))
    }

    /// Whether heights are so great that single precision could overflow or mean nothing: no land is like that.
    fn is_beyond_reason(&self) -> bool {
        let range = self.land.ranges().range();
        let drop = self.drop_per_square * self.land.extent().length_squared();
        let greatest = f64::from(range.low.abs().max(range.high.abs()));
        greatest.max(self.eye_height.abs()).max(self.target_height).max(drop) >= 1e7
    }

    /// Decides every sample by its line of sight.
    fn line_by_line(&self, seen: &mut [u8], count: &mut ViewshedCount) {
        let columns = self.land.raster().columns();
        seen.par_iter_mut().enumerate().for_each(|(index, mark)| {
            let target = DVec2::new((index % columns) as f64, (index / columns) as f64);
            *mark = if self.line(target, index).blocked(self.land) { 0 } else { 255 };
        });
        count.lines = seen.len();
        count.whole_lines = seen.len();
        count.seen = seen.iter().filter(|&&mark| mark != 0).count();
    }

    /// Decides the samples close to the eye, one by one.
    fn look_around(&self, seen: &mut [u8], count: &mut ViewshedCount) {
        let raster = self.land.raster();
        let around = |eye: f64, count: usize| {
            let low = (eye.ceil() as i64 - NEAR).max(0) as usize;
            low..=((eye.floor() as i64 + NEAR) as usize).min(count - 1)
        };
        for row in around(self.eye.y, raster.rows()) {
            for column in around(self.eye.x, raster.columns()) {
                let index = row * raster.columns() + column;
                let line = self.line(DVec2::new(column as f64, row as f64), index);
                count.lines += 1;
                if !line.blocked(self.land) {
                    seen[index] = 255;
                    count.seen += 1;
                }
            }
        }
    }

    /// Unmarks voids and what is beyond the radius; returns how many marks that took.
    fn forget(&self, seen: &mut [u8]) -> usize {
        let mut forgotten = 0;
        let mut unmark = |mark: &mut u8| forgotten += usize::from(std::mem::take(mark) != 0);
        let raster = self.land.raster();
        for (word, bits) in raster.voids().words().iter().enumerate() {
            let mut bits = *bits;
            while bits != 0 {
                unmark(&mut seen[word * 64 + bits.trailing_zeros() as usize]);
                bits &= bits - 1;
            }
        }
        if self.radius.is_infinite() {
            return forgotten;
        }
        for (row, marks) in seen.chunks_exact_mut(raster.columns()).enumerate() {
            for (column, mark) in marks.iter_mut().enumerate().filter(|(_, mark)| **mark != 0) {
                let away = (DVec2::new(column as f64, row as f64) - self.eye) * raster.spacing();
                if away.length() > self.radius {
                    unmark(mark);
                }
            }
        }
        forgotten
    }
}
