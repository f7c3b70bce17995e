//! One wedge of directions, swept outward ring by ring with fifteen bins to an instruction.

use super::doubt::{Crest, Doubt, Past, resolve};
use super::frame::{BATCH, Frame, NOTHING, Rings};
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{Lanes, Portable};
use super::marks::{Marks, Seen};
use super::near::{NEAR, near_horizon};
use super::{Pending, Scene, ViewshedCount};
use crate::raycast::{GRAZE, Simd};

/// How many bins are swept together: as many as sixteen lanes of edges hold between them.
pub(super) const BINS: usize = 15;

/// Widest a bin may be, in samples: it then holds one sample at most, and fifteen of them no more than sixteen.
pub(super) const WIDEST: f64 = 0.998;

/// How many upper bounds of long ago are kept; each is up to twice as old as the one before it.
const AGES: usize = 6;

/// The upper bounds before some ring.
#[derive(Clone, Copy)]
pub(super) struct Ago {
    /// The ring before that one: 0 where nothing is known.
    pub ring: i64,
    pub upper: [f32; 16],
}

/// How many rings an upper bound must not rise for a crest to end.
const PAUSE: i64 = 12;

/// Fifteen neighbouring bins: bounds of the steepest slope that the ground has shown so far, each a straight line over
/// the bin.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Bins {
    /// Nothing so far is steeper than this: at the edges of the bins.
    pub upper: [f32; 16],
    /// Nothing on the last ring is steeper than this: likewise.
    pub last: [f32; 16],
    /// Something so far is at least as steep as this: at each bin's left and right edge.
    pub lower_left: [f32; 16],
    pub lower_right: [f32; 16],
    /// The crest: the rings over which the upper bound rose last, without a pause; the upper bound before them; and
    /// that of all the ground after them.
    pub crest_from: [f32; 16],
    pub crest_to: [f32; 16],
    pub before: [f32; 16],
    pub after: [f32; 16],
    /// Upper bounds of long ago.
    pub ago: [Ago; AGES],
    /// No lower bound is smaller than this.
    pub floor: f32,
    /// Whether the last ring was skipped, because all of it lay below `floor`.
    pub skipped: bool,
}

impl Bins {
    /// Bins that have seen nothing.
    pub fn open() -> Bins {
        let nothing = [NOTHING; 16];
        let mut lower = nothing;
        // Behind the last edge there is no bin: what stands there must neither rise nor count.
        lower[BINS] = -NOTHING;
        Bins {
            upper: nothing,
            last: nothing,
            lower_left: lower,
            lower_right: lower,
            crest_from: [0.0; 16],
            crest_to: [0.0; 16],
            before: nothing,
            after: nothing,
            ago: [Ago { ring: 0, upper: nothing }; AGES],
            floor: NOTHING,
            skipped: false,
        }
    }

    /// Brings `floor` up to date.
    pub fn settle(&mut self) {
        self.floor = self.lower_left.iter().chain(&self.lower_right).copied().fold(f32::INFINITY, f32::min);
    }

    /// Keeps the upper bounds as they are before the `batch`-th batch of rings, which begins after `ring`: each place is
    /// renewed half as often as the one before it.
    fn remember(&mut self, batch: u32, ring: i64) {
        let places = 1 + batch.trailing_zeros().min(AGES as u32 - 1) as usize;
        self.ago.copy_within(0..places - 1, 1);
        self.ago[0] = Ago { ring, upper: self.upper };
    }

    /// The same bounds over bins of half the width: the left and the right fifteen.
    fn halves(&self) -> [Bins; 2] {
        let middle = |a: f32, b: f32| 0.5 * a + 0.5 * b;
        [0, BINS].map(|first| {
            let mut bins = Bins { floor: self.floor, skipped: self.skipped, ..Bins::open() };
            for edge in 0..=BINS {
                let (old, half) = ((first + edge) / 2, (first + edge) % 2 == 1);
                let at = |from: &[f32; 16]| if half { middle(from[old], from[old + 1]) } else { from[old] };
                (bins.upper[edge], bins.last[edge]) = (at(&self.upper), at(&self.last));
                (bins.before[edge], bins.after[edge]) = (at(&self.before), at(&self.after));
                let both = old..=if half { old + 1 } else { old };
                bins.crest_from[edge] = both.clone().map(|old| self.crest_from[old]).fold(f32::INFINITY, f32::min);
                bins.crest_to[edge] = both.map(|old| self.crest_to[old]).fold(0.0, f32::max);
                for (ago, old) in bins.ago.iter_mut().zip(&self.ago) {
                    *ago = Ago { ring: old.ring, upper: ago.upper };
                    ago.upper[edge] = at(&old.upper);
                }
                if edge < BINS {
                    let (left, right) = (self.lower_left[old], self.lower_right[old]);
                    (bins.lower_left[edge], bins.lower_right[edge]) =
                        if half { (middle(left, right), right) } else { (left, middle(left, right)) };
                }
            }
            bins
        })
    }
}

/// Marks what is seen in the `part`-th of `parts` equal wedges of the octant. Samples on the near rings are left to the caller.
pub(super) fn sweep(scene: &Scene, frame: &Frame, part: usize, parts: usize, seen: &Seen) -> ViewshedCount {
    match scene.simd {
        // SAFETY: `viewshed_with` asked the processor for the instructions.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx512 => unsafe { with_avx512(scene, frame, part, parts, seen) },
        // SAFETY: likewise.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2 => unsafe { with_avx2(scene, frame, part, parts, seen) },
        // SAFETY: plain arrays need no particular instructions.
        _ => unsafe { sweep_with::<Portable>(scene, frame, part, parts, seen) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn with_avx512(scene: &Scene, frame: &Frame, part: usize, parts: usize, seen: &Seen) -> ViewshedCount {
    // SAFETY: this function is compiled for the instructions of these lanes.
    unsafe { sweep_with::<Avx512>(scene, frame, part, parts, seen) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn with_avx2(scene: &Scene, frame: &Frame, part: usize, parts: usize, seen: &Seen) -> ViewshedCount {
    // SAFETY: this function is compiled for the instructions of these lanes.
    unsafe { sweep_with::<Avx2>(scene, frame, part, parts, seen) }
}

/// # Safety
/// The processor must have the instructions of `V`.
#[inline(always)]
unsafe fn sweep_with<V: Lanes>(scene: &Scene, frame: &Frame, part: usize, parts: usize, seen: &Seen) -> ViewshedCount {
    let mut count = ViewshedCount::default();
    let mut pending = Vec::new();
    let mut past = Box::new(Past::default());
    // Bins of the wedge, each as one part of the whole octant's.
    let mut bins = BINS;
    let edges = std::array::from_fn(|edge| Frame::border(part * BINS + edge, parts * BINS));
    let mut groups = vec![near_horizon(scene, frame, &edges)];
    let mut rings = Rings::default();
    let mut marks = Marks::default();
    let (mut batch, mut first) = (0, NEAR + 1);
    let (from, to) = (edges[0], edges[BINS]);
    while first <= frame.rings {
        let last = (first + BATCH as i64 - 1).min(frame.rings);
        while (to - from) / bins as f64 * frame.distance(last) > WIDEST {
            groups = groups.iter().flat_map(Bins::halves).collect();
            bins *= 2;
        }
        if !rings.turn(scene, frame, first, from, to) {
            break;
        }
        marks.turn(rings.low, rings.stride);
        batch += 1;
        for (index, group) in groups.iter_mut().enumerate() {
            group.remember(batch, first - 1);
            let border = |edge: usize| Frame::border(part * bins + index * BINS + edge, parts * bins);
            let edges = (border(0), border(BINS));
            // SAFETY: the caller vouches for the instructions.
            unsafe {
                if rings.solid.is_empty() {
                    cross::<V, false>(scene, frame, &mut rings, group, edges, &mut past, &mut marks, &mut pending);
                } else {
                    cross::<V, true>(scene, frame, &mut rings, group, edges, &mut past, &mut marks, &mut pending);
                }
            }
        }
        // What is left in doubt is followed now, while the ground is at hand.
        count.lines += pending.len();
        for pending in pending.drain(..) {
            count.whole_lines += usize::from(pending.from == 0);
            if scene.free(frame, &pending) {
                marks.add((pending.ring - first) as usize, pending.minor, 1);
            }
        }
        // SAFETY: only samples between the wedge's borders are marked.
        count.seen += unsafe { marks.write(frame, &rings.rings, (from, to), seen) };
        first = last + 1;
    }
    count
}

const LANE: [f32; 16] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// The largest fraction below one.
const ALMOST_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Takes the fifteen bins between two directions across a batch of rings.
///
/// # Safety
/// The processor must have the instructions of `V`.
#[inline(always)]
// One reason covers the many loads: it stands before the first of them.
#[allow(clippy::too_many_arguments, clippy::undocumented_unsafe_blocks)]
unsafe fn cross<V: Lanes, const VOIDS: bool>(
    scene: &Scene,
    frame: &Frame,
    rings: &mut Rings,
    bins: &mut Bins,
    (left, right): (f64, f64),
    past: &mut Past,
    marks: &mut Marks,
    pending: &mut Vec<Pending>,
) {
    // Where on each ring the bins begin: the number of the sample at or before the first edge, and how far behind it
    // that is.
    let count = rings.rings.len();
    let end = rings.rings.iter().position(|ring| frame.eye_minor + left * ring.distance > (frame.minors - 1) as f64);
    let end = end.unwrap_or(count);
    if end <= 1 {
        return;
    }
    for (row, ring) in rings.rings[..end].iter().enumerate() {
        let here = frame.eye_minor + left * ring.distance;
        let base = here.floor();
        past.offsets[row] = (base as i64 - rings.low) as usize;
        past.starts[row] = ((here - base) as f32).min(ALMOST_ONE);
        past.distances[row] = ring.distance as f32;
    }
    let (low, high) = (past.offsets[0] - 2, past.offsets[end - 1] + 20);
    assert!(low < high && high < rings.stride, "bins outside their batch of rings");
    if !VOIDS && lies_hidden(scene, frame, rings, bins.floor, (low, high), end) {
        bins.skipped = true;
        return;
    }
    // SAFETY: the caller vouches for the instructions.
    unsafe { rings.fill::<V>(scene, frame, low, high) };
    let rings = &*rings;

    let lane = table::<V>(&LANE);
    let zero = V::splat(0.0);
    let width_of_bin = (right - left) / BINS as f64;
    // How far aside a ray moves per ring, at most, in each bin.
    let aside = V::splat((left + width_of_bin) as f32).add(lane.mul(V::splat(width_of_bin as f32)));
    let (mut upper, mut last) = (table::<V>(&bins.upper), table::<V>(&bins.last));
    let (mut lower_left, mut lower_right) = (table::<V>(&bins.lower_left), table::<V>(&bins.lower_right));
    let (mut crest_from, mut crest_to) = (table::<V>(&bins.crest_from), table::<V>(&bins.crest_to));
    let (mut before_crest, mut after_crest) = (table::<V>(&bins.before), table::<V>(&bins.after));
    let (mut floor, mut skipped, mut risen) = (bins.floor, bins.skipped, false);
    let target_height = scene.target_height as f32;
    // The last ring's own lower bound: what lies below it is behind the ground just before.
    let (mut low_left, mut low_right) = (V::splat(NOTHING), V::splat(NOTHING));
    let mut noted = 0;

    // Rounding, as a height (m): of the heights themselves and what is computed of them (2⁻²⁴ each), and of positions
    // along a ring (3·10⁻⁶ of a sample, times how much neighbours differ); then how far bilinear interpolation of the
    // curved Earth's drop is from the drop.
    let rounding = 6e-8 * (scene.eye_height.abs() as f32 + 12.0 * rings.reach) + 6e-6 * rings.rough + scene.sag as f32;
    let graze = GRAZE as f32;
    past.rounding = rounding;
    past.rounding_nearby = 2.5e-7 * rings.reach + 2e-6 * rings.rough + 2.0 * scene.sag as f32;

    for row in 1..end {
        let ring = &rings.rings[row];
        let (distance, before) = (past.distances[row], past.distances[row] - 1.0);
        let (offset, start) = (past.offsets[row], past.starts[row]);
        // SAFETY of all loads below: they begin 2 before to 4 after `offset` and read 16 numbers, all within the row by
        // the assertion above, and filled.
        let far = unsafe { rings.heights.as_ptr().add(row * rings.stride + offset) };
        let near = unsafe { rings.heights.as_ptr().add((row - 1) * rings.stride + offset) };

        let level = if floor > 0.0 { floor * before } else { floor * distance };
        let hidden_below = V::splat(level - target_height.max(0.0) - 2.0 * rounding);
        let highest = unsafe {
            let far = V::load(far.sub(1)).max(V::load(far.add(3)));
            far.max(V::load(near.sub(1)).max(V::load(near.add(3))))
        };
        if highest.at_most(hidden_below) == u16::MAX {
            skipped = true;
            continue;
        }
        // Bin by bin: what its rays pass over lies between the samples from one before its first to two after.
        let width = width_of_bin * ring.distance;
        let y = lane.mul(V::splat(width as f32)).add(V::splat(start));
        let (index, whole) = y.whole();
        let (f, n) = unsafe { (ring_of_samples::<V>(far), ring_of_samples::<V>(near)) };
        let ahead = f[0].max(f[1]).max(f[2].max(f[3]));
        let highest = ahead.max(n[0].max(n[1]).max(n[2].max(n[3]))).lookup(index);
        let lower = lower_left.min(lower_right);
        let level = lower.mul(V::splat(before)).min(lower.mul(V::splat(distance)));
        if highest.add(V::splat(target_height.max(0.0) + 2.0 * rounding)).at_most(level) == u16::MAX {
            skipped = true;
            continue;
        }
        if skipped {
            // All that was skipped lies below the lower bounds, which have not changed since, or below the floor.
            let inside = lower.select(u16::MAX >> 1, V::splat(NOTHING));
            last = inside.max(inside.previous()).max(V::splat(floor));
            after_crest = after_crest.max(last);
            (low_left, low_right) = (V::splat(NOTHING), V::splat(NOTHING));
            skipped = false;
        }
        for upper_then in &mut past.upper[noted + 1..=row] {
            save(upper, upper_then);
        }
        noted = row;
        let inverse = 1.0 / distance;
        let margin = V::splat(rounding * inverse);
        let (per_ring, inverse) = (V::splat(1.0 / before), V::splat(inverse));
        let inverse_width = V::splat((1.0 / width) as f32);

        // The ground at the edges.
        let within = y.sub(whole);
        let (a, b) = (f[1].lookup(index), f[2].lookup(index));
        let step = b.sub(a);
        let slope = a.add(step.mul(within)).mul(inverse);
        let slope_right = slope.next();

        // The sample within each bin, where there is one.
        let mut has = !whole.next().at_most(whole);
        let samples = ((frame.eye_minor + right * ring.distance).floor() as i64 - offset as i64 - rings.low) as u32;
        if has.count_ones() != samples {
            // Rounding at the last edge: whose sample it is was decided in double precision.
            if has.count_ones() < samples {
                has |= 1 << (BINS - 1);
            } else {
                has &= !(1 << (15 - has.leading_zeros()));
            }
        }
        let at = V::splat(1.0).sub(within).mul(inverse_width).min(V::splat(1.0));
        let peak = b.mul(inverse);
        let sample = peak.add(V::splat(target_height).mul(inverse));
        let tent = peak.sub(slope.add(slope_right.sub(slope).mul(at)));

        // The steps along both rings: a bin's rays run through the patch after the left edge's sample, those before and
        // after it only if they get there; those to samples stay in that one.
        let near_step = n[2].sub(n[1]).lookup(index);
        let twist = near_step.sub(step);
        let (near_before, far_before) = (n[1].sub(n[0]).lookup(index), f[1].sub(f[0]).lookup(index));
        let enters = within.at_most(aside);
        let (steepest, flattest) = (near_step.max(near_before), step.min(far_before));
        let (steepest, flattest) = (steepest.select(enters, near_step), flattest.select(enters, step));
        let (leaving_near, leaving_far) = (steepest.max(near_step.next()), flattest.min(step.next()));
        let (steepest, flattest) = (leaving_near.select(has, steepest), leaving_far.select(has, flattest));
        let bulge = aside.mul(steepest.sub(flattest)).max(zero).add(V::splat(4.0 * rounding + 1e-9));

        // Samples of this ring against the horizon of those before, and against the one patch in front of them.
        let rise = upper.next().sub(upper);
        let bound = upper.add(rise.mul(at));
        let hump = aside.mul(twist).add(V::splat(4.0 * scene.sag as f32)).max(zero).mul(per_ring);
        let slack = rise.abs().mul(V::splat(1e-5)).add(margin);
        let above = bound.add(slack.add(hump)).at_most(sample);
        let lower_rise = lower_right.sub(lower_left);
        let lower_bound = lower_left.add(lower_rise.mul(at));
        let below = sample.add(lower_rise.abs().mul(V::splat(1e-5))).add(margin).at_most(lower_bound);
        let low_bound = low_left.add(low_right.sub(low_left).mul(at));
        let mut behind = sample.add(margin.add(margin)).at_most(low_bound);
        if VOIDS {
            // No line between something and nothing.
            behind &= V::splat(-1e12).at_most(low_left.min(low_right));
        }
        let base = offset as i64 + rings.low + 1;
        let asked = belonging(has, samples, base, ring.belonging);
        let mut visible = above & has;
        let doubtful = has & !(above | below | behind);
        if doubtful != 0 && V::squeeze(doubtful, has) & asked != 0 {
            let first = rings.rings[1].ring as f32;
            let crest = Crest { from: crest_from, to: crest_to, before: before_crest, after: after_crest, first };
            let doubt = Doubt { row, doubtful, index, whole, peak: b, step, sample, at, twist, crest };
            let (past, ago, pending) = (&*past, &bins.ago, &mut *pending);
            // SAFETY: the caller vouches for the instructions.
            visible |= unsafe {
                V::apart(
                    #[inline(always)]
                    move || {
                        resolve::<V, VOIDS>(
                            rings,
                            past,
                            ago,
                            doubt,
                            target_height,
                            left as f32,
                            #[inline(always)]
                            |lanes, open_from, open_to| {
                                let mut lanes = lanes;
                                while lanes != 0 {
                                    let lane = lanes.trailing_zeros();
                                    let place = (has & ((1 << lane) - 1)).count_ones();
                                    if asked >> place & 1 == 1 {
                                        let minor = base + i64::from(place);
                                        let (from, to) =
                                            (open_from.lane(lane as usize) as i64, open_to.lane(lane as usize) as i64);
                                        pending.push(Pending { ring: ring.ring, minor, from, to });
                                    }
                                    lanes &= lanes - 1;
                                }
                            },
                        )
                    },
                )
            };
        }
        marks.add(row - 1, base, u32::from(V::squeeze(visible, has) & asked));

        // The ground of the strip that ends at this ring raises the horizon: the upper bound by what a sample in the bins
        // beside an edge stands above its chord, and by what the patches bulge between the rings.
        let tent_up = tent.max(zero).select(has, zero);
        let lift = tent_up.max(tent_up.previous()).add(V::splat(rounding - graze).mul(inverse));
        let now = slope.add(lift);
        let bulge = bulge.max(bulge.previous());
        let rest = bulge.sub(now.sub(last).abs().mul(V::splat(before))).max(zero);
        let excess = hump_of(rest, bulge).mul(V::splat(0.25)).mul(per_ring);
        let reached = now.max(last).add(excess);
        let rises = !reached.at_most(upper);
        let number = V::splat(ring.ring as f32);
        let starts = rises & crest_to.at_most(V::splat((ring.ring - PAUSE) as f32));
        before_crest = upper.select(starts, before_crest);
        crest_from = number.select(starts, crest_from);
        crest_to = number.select(rises, crest_to);
        after_crest = V::splat(NOTHING).select(rises, after_crest.max(reached));
        upper = upper.max(reached);
        last = now;

        let (slope, slope_right, tent) = if VOIDS {
            let solid = unsafe { rings.solid.as_ptr().add(row * rings.stride + offset) };
            let (a, b) = unsafe { (V::load(solid).lookup(index), V::load(solid.add(1)).lookup(index)) };
            let slope = a.add(b.sub(a).mul(within)).mul(inverse);
            let slope_right = slope.next();
            (slope, slope_right, b.mul(inverse).sub(slope.add(slope_right.sub(slope).mul(at))))
        } else {
            (slope, slope_right, tent)
        };
        let sink = tent.min(zero).select(has, zero).sub(V::splat(rounding + graze).mul(inverse));
        (low_left, low_right) = (slope.add(sink), slope_right.add(sink));
        let better = lower_left.add(lower_right).at_most(low_left.add(low_right));
        if better != 0 {
            lower_left = low_left.select(better, lower_left);
            lower_right = low_right.select(better, lower_right);
            risen = true;
        }
        if risen && row % 4 == 0 {
            floor = floor.max(lower_left.min(lower_right).smallest());
            risen = false;
        }
    }
    if risen {
        floor = floor.max(lower_left.min(lower_right).smallest());
    }
    save(upper, &mut bins.upper);
    save(last, &mut bins.last);
    save(lower_left, &mut bins.lower_left);
    save(lower_right, &mut bins.lower_right);
    save(crest_from, &mut bins.crest_from);
    save(crest_to, &mut bins.crest_to);
    save(before_crest, &mut bins.before);
    save(after_crest, &mut bins.after);
    (bins.floor, bins.skipped) = (floor, skipped);
}

/// Whether all the land of a batch between two numbers of its rows lies below a floor of slopes already seen, so that it
/// need not even be fetched.
fn lies_hidden(
    scene: &Scene,
    frame: &Frame,
    rings: &Rings,
    floor: f32,
    (low, high): (usize, usize),
    end: usize,
) -> bool {
    let (first, last) = (&rings.rings[0], &rings.rings[end - 1]);
    let level = f64::from(floor) * if floor > 0.0 { first.distance } else { last.distance };
    let minors = (rings.low + low as i64, rings.low + high as i64);
    let highest = f64::from(frame.highest(scene, (first.ring, last.ring), minors));
    // More than all that rounding could come to.
    let range = scene.land.ranges().range();
    let slack = 0.01 + scene.sag + 1e-5 * (scene.eye_height.abs() + f64::from(range.high.abs().max(range.low.abs())));
    highest - scene.eye_height + scene.target_height.max(0.0) + slack <= level
}

/// Sixteen numbers from one before, from, from one and from two after `at`.
///
/// # Safety
/// As [`Lanes::load`], for all of them.
#[inline(always)]
unsafe fn ring_of_samples<V: Lanes>(at: *const f32) -> [V; 4] {
    // SAFETY: the caller's.
    unsafe { [V::load(at.sub(1)), V::load(at), V::load(at.add(1)), V::load(at.add(2))] }
}

#[inline(always)]
pub(super) fn table<V: Lanes>(values: &[f32; 16]) -> V {
    // SAFETY: the array holds sixteen numbers; lanes are only made where their instructions are.
    unsafe { V::load(values.as_ptr()) }
}

#[inline(always)]
fn save<V: Lanes>(values: V, to: &mut [f32; 16]) {
    // SAFETY: likewise.
    unsafe { values.store(to.as_mut_ptr()) };
}

/// At least rest²/bulge, for a rest from 0 to the bulge: two chords of the parabola, without a division.
#[inline(always)]
fn hump_of<V: Lanes>(rest: V, bulge: V) -> V {
    let half = V::splat(0.5);
    let low = rest.mul(half);
    low.max(rest.add(low).sub(bulge.mul(half)))
}

/// Which of `samples` samples from `base` on belong to the octant, lowest bit first.
#[inline(always)]
fn belonging(has: u16, samples: u32, base: i64, (low, high): (i64, i64)) -> u16 {
    debug_assert!(has.count_ones() == samples);
    if base >= low && base + 16 <= high {
        return u16::MAX;
    }
    let from = (low - base).clamp(0, 16) as u32;
    let to = (high - base).clamp(0, 16) as u32;
    ((1u32 << to) - 1) as u16 & !((1u32 << from) - 1) as u16
}
