//! Samples between both bounds of the horizon: followed back towards the eye, all of a ring's at once, until the upper
//! bound of rings ago clears them or the ground hides them.
//!
//! The line to a sample is compared with the ground where it crosses each ring, which is exact but for rounding, and with
//! what the patches between two rings can bulge. What rounding, or that bound, leaves open gets a line of sight in double
//! precision, over the strips in question.

use super::frame::{BATCH, NOTHING, Rings};
use super::lanes::Lanes;
use super::sweep::{Ago, table};
use crate::raycast::GRAZE;

/// What is known of the rings of a batch when a group of bins has come to one of them.
#[derive(Default)]
pub(super) struct Past {
    /// The upper bounds before each ring.
    pub upper: [[f32; 16]; BATCH + 1],
    /// The number, in a row, of the sample at or before the first edge; how far behind it that edge is (samples); and
    /// the ring's distance (samples).
    pub offsets: [usize; BATCH + 1],
    pub starts: [f32; BATCH + 1],
    pub distances: [f32; BATCH + 1],
    /// Rounding, as a height (m).
    pub rounding: f32,
    /// The same for heights computed by small differences.
    pub rounding_nearby: f32,
}

/// See [`Bins`](super::sweep::Bins).
pub(super) struct Crest<V> {
    pub from: V,
    pub to: V,
    pub before: V,
    pub after: V,
    /// The first ring of the batch.
    pub first: f32,
}

/// Samples in doubt, each in the lane of its bin.
pub(super) struct Doubt<V: Lanes> {
    /// The row of their ring.
    pub row: usize,
    pub doubtful: u16,
    /// The sample at or before the bin's left edge: the one in doubt is the next.
    pub index: V::Index,
    pub whole: V,
    /// Its height relative to the eye (m), and the step to it from the one before.
    pub peak: V,
    pub step: V,
    /// Slope of the target, where in its bin it is (0 to 1), and the twist of the patch in front of it: by how much the
    /// step along its near side is greater than along its far side (m).
    pub sample: V,
    pub at: V,
    pub twist: V,
    pub crest: Crest<V>,
}

/// Where lines cross a ring.
struct Crossing<V: Lanes> {
    /// The sample at or before, counted from the row's offset, and how far behind it the line is.
    index: V::Index,
    whole: V,
    within: V,
    /// Heights of that sample and the next, and of the ground between them (m).
    a: V,
    b: V,
    height: V,
    /// Where the ground is known.
    known: u16,
}

/// Crosses a row with the lines that start at the group's first edge and drift aside by so much per ring.
///
/// # Safety
/// As [`resolve`].
#[inline(always)]
unsafe fn cross<V: Lanes, const VOIDS: bool>(rings: &Rings, past: &Past, drift: V, row: usize) -> Crossing<V> {
    let y = drift.mul(V::splat(past.distances[row])).add(V::splat(past.starts[row]));
    let (index, whole) = y.max(V::splat(0.0)).min(V::splat(15.999_999)).whole();
    let from = row * rings.stride + past.offsets[row];
    // SAFETY: the caller's.
    let (a, b) = unsafe { pair::<V>(rings.heights.as_ptr().add(from), index) };
    let known = if VOIDS {
        // SAFETY: the caller's.
        let (a, b) = unsafe { pair::<V>(rings.solid.as_ptr().add(from), index) };
        // Of row 0 it is not known what is void on the ring before.
        if row == 0 { 0 } else { V::splat(0.5 * NOTHING).at_most(a.min(b)) }
    } else {
        u16::MAX
    };
    let within = y.sub(whole);
    Crossing { index, whole, within, a, b, height: a.add(b.sub(a).mul(within)), known }
}

/// Entries `index` and those after them, of the numbers from `at` on.
///
/// # Safety
/// Seventeen numbers must be readable at `at`.
#[inline(always)]
unsafe fn pair<V: Lanes>(at: *const f32, index: V::Index) -> (V, V) {
    // SAFETY: the caller's.
    unsafe { (V::load(at).lookup(index), V::load(at.add(1)).lookup(index)) }
}

/// Returns which of the samples in doubt are seen, and calls `pending` with those that stay in doubt and the rings
/// between which something may be in their way (from 0: anywhere).
///
/// # Safety
/// The processor must have the instructions of `V`, and the rows must be filled as far as the group's bins reach.
#[inline(always)]
pub(super) unsafe fn resolve<V: Lanes, const VOIDS: bool>(
    rings: &Rings,
    past: &Past,
    ago: &[Ago],
    doubt: Doubt<V>,
    target_height: f32,
    left: f32,
    mut pending: impl FnMut(u16, V, V),
) -> u16 {
    let Doubt { row, mut doubtful, index, whole, peak, step, sample, at, twist, crest } = doubt;
    let zero = V::splat(0.0);
    let graze = GRAZE as f32;
    let rounding = past.rounding;
    let far = past.distances[row];
    // How far the lines move aside per ring, from the first edge.
    let drift = whole.add(V::splat(1.0 - past.starts[row])).mul(V::splat(1.0 / far));
    let (sure, maybe) = (V::splat(graze + rounding), V::splat(graze - rounding));

    // The one patch in front of the sample: the line's height above it is a parabola from `start` to `stop`.
    // SAFETY: as this function's caller vouches.
    let mut here = unsafe { cross::<V, VOIDS>(rings, past, drift, row - 1) };
    let mut clearance = sample.mul(V::splat(past.distances[row - 1])).sub(here.height);
    let drifts = drift.add(V::splat(left)).max(zero);
    // By differences to the sample, which hardly round.
    let (own, near_step) = (V::splat(past.rounding_nearby), twist.add(step));
    // SAFETY: as above.
    let near = unsafe { V::load(rings.heights.as_ptr().add((row - 1) * rings.stride + past.offsets[row] + 1)) };
    let stop = V::splat(target_height);
    let descent = peak.add(stop).mul(V::splat(1.0 / far));
    let start = peak.sub(near.lookup(index)).add(drifts.mul(near_step)).add(stop.sub(descent));
    let (own_sure, own_maybe) = (V::splat(graze).add(own), V::splat(graze).sub(own));
    let bulge = drifts.mul(twist);
    let rise = start.sub(stop);
    let dip = bulge.add(rise).mul(bulge.add(rise));
    let fourfold = bulge.mul(V::splat(4.0));
    // Bulges within rounding decide nothing: that is left to the line of sight.
    let fourfold_own = own.mul(V::splat(4.0));
    let dips = rise.abs().at_most(bulge) & !bulge.at_most(fourfold_own);
    let blocked = start.add(own_sure).at_most(zero) | dips & fourfold.mul(start.add(own_sure)).at_most(dip);
    let blocked = if VOIDS {
        // SAFETY: as above.
        let solid = unsafe {
            let far = rings.solid.as_ptr().add(row * rings.stride + past.offsets[row]);
            let (a, b) = pair::<V>(far, index);
            let (c, d) = pair::<V>(far.sub(rings.stride), index);
            a.min(b).min(c.min(d))
        };
        blocked & V::splat(0.5 * NOTHING).at_most(solid)
    } else {
        blocked
    };
    let lowest = start.min(stop).add(own_maybe);
    let free = zero.at_most(start.add(own_maybe))
        & (bulge.add(fourfold_own).at_most(rise.abs())
            | dip.at_most(fourfold.mul(start.add(own_maybe))) & !bulge.at_most(zero)
            | bulge.at_most(lowest.mul(V::splat(4.0))));
    doubtful &= !blocked;
    let mut open = !free;

    let reach = V::splat(rounding / far);
    let ring = rings.rings[row].ring as f32;

    // What hides the sample is either close by or the crest before this batch: then nothing else is in question.
    let crest_to = crest.to.max(crest.to.next());
    let distant = crest_to.add(V::splat(1.0)).at_most(V::splat(crest.first));
    let crested = doubtful & distant & clears(crest.before, at, sample, reach) & clears(crest.after, at, sample, reach);
    report(crested, open, crest.from.min(crest.from.next()), crest_to, V::splat(ring), &mut pending);
    doubtful &= !crested;

    let mut visible = 0;
    let mut row = row - 1;
    loop {
        if doubtful == 0 {
            return visible;
        }
        if row == 0 {
            // Before the batch only the bounds of some rings are known.
            let begin = V::splat(rings.rings[0].ring as f32);
            for ago in ago {
                let clear = doubtful & clears(table::<V>(&ago.upper), at, sample, reach);
                doubtful &= !clear;
                let from = V::splat(ago.ring as f32);
                report(clear, open, from, begin, V::splat(ring), &mut pending);
            }
            report(doubtful, open, zero, begin, V::splat(ring), &mut pending);
            return visible;
        }
        // The strip that ends at this ring.
        // SAFETY: as above.
        let next = unsafe { cross::<V, VOIDS>(rings, past, drift, row - 1) };
        let ahead = sample.mul(V::splat(past.distances[row - 1])).sub(next.height);
        // Either one patch, or two with a lattice line between them: a parabola each.
        let shift = past.offsets[row] as f32 - past.offsets[row - 1] as f32;
        let one = here.whole.add(V::splat(shift)).at_most(next.whole);
        // SAFETY: as above.
        let (far_before, near_after) = unsafe {
            let far = rings.heights.as_ptr().add(row * rings.stride + past.offsets[row]);
            let near = rings.heights.as_ptr().add((row - 1) * rings.stride + past.offsets[row - 1]);
            (V::load(far.sub(1)).lookup(here.index), V::load(near.add(2)).lookup(next.index))
        };
        let (near_step, far_step) = (next.b.sub(next.a), here.b.sub(here.a));
        // The share of the strip beyond the lattice line, all of it where there is none.
        let beyond = here.within.div(drifts).max(zero).min(V::splat(1.0));
        let before = V::splat(1.0).sub(beyond);
        let kink = sample.mul(V::splat(past.distances[row]).sub(beyond));
        let kink = kink.sub(here.a.mul(before).add(next.b.mul(beyond)));
        let kink = ahead.select(one, kink);
        let beyond = V::splat(1.0).select(one, beyond);
        let near_bulge = drifts.mul(near_step.sub(here.a.sub(far_before))).mul(before.mul(before));
        let near_bulge = zero.select(one, near_bulge);
        let far_steps = near_step.select(one, near_after.sub(next.b)).sub(far_step);
        let far_bulge = drifts.mul(far_steps).mul(beyond.mul(beyond));
        let lowest = lowest_of(ahead, kink, near_bulge).min(lowest_of(kink, clearance, far_bulge));
        // Along a diagonal, rounding may put a whole patch between both crossings.
        let apart = next.whole.add(V::splat(1.5)).at_most(here.whole.add(V::splat(shift)));
        let lowest = ahead.min(clearance).select(apart, lowest);
        open |= apart;
        let reached = if VOIDS { ahead } else { lowest };
        doubtful &= !(reached.add(sure).at_most(zero) & next.known);
        open |= !zero.at_most(lowest.add(maybe));
        let clear = doubtful & clears(table::<V>(&past.upper[row]), at, sample, reach);
        visible |= clear & !open;
        if clear & open != 0 {
            pending(clear & open, V::splat(rings.rings[row - 1].ring as f32), V::splat(ring));
        }
        doubtful &= !clear;
        (here, clearance) = (next, ahead);
        row -= 1;
    }
}

/// Reports samples whose lines are in question between the rings `from` and `to`, and where they are `open` up to their
/// own.
#[inline(always)]
fn report<V: Lanes>(lanes: u16, open: u16, from: V, to: V, ring: V, pending: &mut impl FnMut(u16, V, V)) {
    if lanes & !open != 0 {
        pending(lanes & !open, from, to);
    }
    if lanes & open != 0 {
        pending(lanes & open, from, ring);
    }
}

/// Where an upper bound leaves samples of such slopes clear.
#[inline(always)]
fn clears<V: Lanes>(upper: V, at: V, sample: V, rounding: V) -> u16 {
    let rise = upper.next().sub(upper);
    upper.add(rise.mul(at)).add(rise.abs().mul(V::splat(1e-5))).add(rounding).at_most(sample)
}

/// The lowest value of the parabola from `start` to `end` that a bulge of the ground lowers by bulge·v(1 − v).
#[inline(always)]
fn lowest_of<V: Lanes>(start: V, end: V, bulge: V) -> V {
    let rest = bulge.sub(end.sub(start).abs()).max(V::splat(0.0));
    start.min(end).sub(rest.mul(rest).div(bulge.mul(V::splat(4.0)).max(V::splat(1e-9))))
}
