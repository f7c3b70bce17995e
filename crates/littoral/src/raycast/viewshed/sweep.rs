//! One wedge of directions, swept outward ring by ring with sixteen bins or samples to an instruction.

use super::frame::{BATCH, Frame, NOTHING, Ring, Rings};
#[cfg(target_arch = "x86_64")]
use super::lanes::{Avx2, Avx512};
use super::lanes::{Lanes, Portable};
use super::near::{NEAR, near_horizon};
use super::{Pending, Scene, Seen};
use crate::raycast::{GRAZE, Simd};

/// Widest a bin may be, in samples: sixteen of them then need no more than sixteen neighbouring heights.
const WIDEST: f64 = 0.875;

/// Sixteen neighbouring bins: bounds of the steepest slope that the ground has shown so far, each a straight line over
/// the bin given at its left and right edge.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Bins {
    /// Nothing so far is steeper than this.
    pub upper_left: [f32; 16],
    pub upper_right: [f32; 16],
    /// Something so far is at least as steep as this.
    pub lower_left: [f32; 16],
    pub lower_right: [f32; 16],
    /// Nothing on the last ring is steeper than this.
    pub last_left: [f32; 16],
    pub last_right: [f32; 16],
    /// The smallest of all lower bounds.
    pub floor: f32,
    /// Whether the last ring was skipped, because all of it lay below `floor`.
    pub skipped: bool,
}

impl Bins {
    /// Bins that have seen nothing.
    pub fn open() -> Bins {
        let nothing = [NOTHING; 16];
        Bins {
            upper_left: nothing,
            upper_right: nothing,
            lower_left: nothing,
            lower_right: nothing,
            last_left: nothing,
            last_right: nothing,
            floor: NOTHING,
            skipped: false,
        }
    }

    /// Brings `floor` up to date.
    pub fn settle(&mut self) {
        self.floor = self.lower_left.iter().chain(&self.lower_right).copied().fold(f32::INFINITY, f32::min);
    }

    /// The same bounds over bins of half the width: the left and the right eight, each in two.
    fn halves(&self) -> [Bins; 2] {
        let split = |left: &[f32; 16], right: &[f32; 16], half: usize| {
            let (mut l, mut r) = ([0.0; 16], [0.0; 16]);
            for bin in 0..8 {
                let (a, b) = (left[half * 8 + bin], right[half * 8 + bin]);
                let middle = 0.5 * a + 0.5 * b;
                (l[2 * bin], r[2 * bin], l[2 * bin + 1], r[2 * bin + 1]) = (a, middle, middle, b);
            }
            (l, r)
        };
        [0, 1].map(|half| {
            let (upper_left, upper_right) = split(&self.upper_left, &self.upper_right, half);
            let (lower_left, lower_right) = split(&self.lower_left, &self.lower_right, half);
            let (last_left, last_right) = split(&self.last_left, &self.last_right, half);
            let mut bins = Bins {
                upper_left,
                upper_right,
                lower_left,
                lower_right,
                last_left,
                last_right,
                floor: self.floor,
                skipped: self.skipped,
            };
            if !bins.skipped {
                bins.settle();
            }
            bins
        })
    }
}

/// What a wedge came to.
#[derive(Default)]
pub(super) struct Found {
    /// How many samples were marked.
    pub seen: usize,
    /// Those that the bounds did not decide.
    pub pending: Vec<Pending>,
}

/// The upper bounds of sixteen bins before each ring of a batch.
type History = [([f32; 16], [f32; 16]); BATCH + 1];

/// Finds what is seen between the directions `from` and `to` (minor over major, of one sign): marks what is surely seen
/// and lists what is undecided. Samples on the near rings are left to the caller.
pub(super) fn sweep(scene: &Scene, frame: &Frame, from: f64, to: f64, seen: &Seen) -> Found {
    match scene.simd {
        // SAFETY: `viewshed_with` asked the processor for the instructions.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx512 => unsafe { with_avx512(scene, frame, from, to, seen) },
        // SAFETY: likewise.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2 => unsafe { with_avx2(scene, frame, from, to, seen) },
        // SAFETY: plain arrays need no particular instructions.
        _ => unsafe { sweep_with::<Portable>(scene, frame, from, to, seen) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn with_avx512(scene: &Scene, frame: &Frame, from: f64, to: f64, seen: &Seen) -> Found {
    // SAFETY: this function is compiled for the instructions of these lanes.
    unsafe { sweep_with::<Avx512>(scene, frame, from, to, seen) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn with_avx2(scene: &Scene, frame: &Frame, from: f64, to: f64, seen: &Seen) -> Found {
    // SAFETY: this function is compiled for the instructions of these lanes.
    unsafe { sweep_with::<Avx2>(scene, frame, from, to, seen) }
}

/// # Safety
/// The processor must have the instructions of `V`.
#[inline(always)]
unsafe fn sweep_with<V: Lanes>(scene: &Scene, frame: &Frame, from: f64, to: f64, seen: &Seen) -> Found {
    let mut found = Found::default();
    let mut history: Box<History> = Box::new([([0.0; 16], [0.0; 16]); BATCH + 1]);
    let mut groups = vec![near_horizon(scene, frame, from, (to - from) / 16.0)];
    let mut rings = Rings::default();
    let mut first = NEAR + 1;
    while first <= frame.rings {
        let last = (first + BATCH as i64 - 1).min(frame.rings);
        while (to - from) / (16 * groups.len()) as f64 * frame.distance(last) > WIDEST {
            groups = groups.iter().flat_map(Bins::halves).collect();
        }
        // SAFETY: the caller vouches for the instructions.
        if !unsafe { rings.fetch::<V>(scene, frame, first, from, to) } {
            break;
        }
        let step = (to - from) / groups.len() as f64;
        for (index, bins) in groups.iter_mut().enumerate() {
            let left = from + index as f64 * step;
            // SAFETY: the caller vouches for the instructions.
            unsafe {
                if rings.solid.is_empty() {
                    cross::<V, false>(scene, frame, &rings, bins, left, step, seen, &mut history, &mut found);
                } else {
                    cross::<V, true>(scene, frame, &rings, bins, left, step, seen, &mut history, &mut found);
                }
            }
        }
        first = last + 1;
    }
    found
}

const LANE: [f32; 16] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// Takes the sixteen bins between the directions `left` and `left + span` across a batch of rings.
///
/// # Safety
/// The processor must have the instructions of `V`.
#[inline(always)]
// One reason covers the many loads: it stands before the first of them.
#[allow(clippy::too_many_arguments, clippy::undocumented_unsafe_blocks)]
unsafe fn cross<V: Lanes, const VOIDS: bool>(
    scene: &Scene,
    frame: &Frame,
    rings: &Rings,
    bins: &mut Bins,
    left: f64,
    span: f64,
    seen: &Seen,
    history: &mut History,
    found: &mut Found,
) {
    // SAFETY: the arrays hold sixteen numbers.
    let table = |values: &[f32; 16]| unsafe { V::load(values.as_ptr()) };
    // SAFETY: likewise.
    let save = |values: V, to: &mut [f32; 16]| unsafe { values.store(to.as_mut_ptr()) };
    let lane = table(&LANE);
    let zero = V::splat(0.0);
    let rising = left >= 0.0;
    let width_of_bin = span / 16.0;
    let aside = V::splat(left as f32).add(lane.mul(V::splat(width_of_bin as f32))).abs();
    let aside = if rising { aside.add(V::splat(width_of_bin as f32)) } else { aside };
    let (mut upper_left, mut upper_right) = (table(&bins.upper_left), table(&bins.upper_right));
    let (mut lower_left, mut lower_right) = (table(&bins.lower_left), table(&bins.lower_right));
    let (mut last_left, mut last_right) = (table(&bins.last_left), table(&bins.last_right));
    let (mut floor, mut skipped) = (bins.floor, bins.skipped);
    let target_height = scene.target_height as f32;
    let mut noted = 0;

    // Rounding, as a height (m): of the heights themselves and what is computed of them (2⁻²⁴ each), and of positions
    // along a ring (3·10⁻⁶ of a sample, times how much neighbours differ); then how far bilinear interpolation of the
    // curved Earth's drop is from the drop.
    let rounding =
        6e-8 * (scene.eye_height.abs() as f32 + 16.0 * rings.reach) + 1.5e-5 * rings.rough + scene.sag as f32;
    let graze = GRAZE as f32;

    for (row, ring) in rings.rings.iter().enumerate().skip(1) {
        let Ring { distance, .. } = *ring;
        let here = frame.eye_minor + left * distance;
        let there = frame.eye_minor + (left + span) * distance;
        if here > (frame.minors - 1) as f64 || there < 0.0 {
            continue;
        }
        let base = here.floor();
        let offset = (base as i64 - rings.low) as usize;
        assert!(offset >= 2 && offset + 40 <= rings.stride, "a bin outside its batch of rings");
        // SAFETY of all loads below: they begin 2 before to 17 after `offset` and read 16 numbers: the assertion keeps them
        // within the row.
        let far = unsafe { rings.heights.as_ptr().add(row * rings.stride + offset) };
        let near = unsafe { rings.heights.as_ptr().add((row - 1) * rings.stride + offset) };

        let (distance, before) = (distance as f32, (distance - 1.0) as f32);
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
        if skipped {
            (last_left, last_right) = (V::splat(floor), V::splat(floor));
            skipped = false;
        }
        for (left, right) in &mut history[noted + 1..=row] {
            save(upper_left, left);
            save(upper_right, right);
        }
        noted = row;
        let inverse = V::splat(1.0 / distance);
        let width = width_of_bin * ring.distance;
        let inverse_width = V::splat((1.0 / width) as f32);

        // Samples of this ring against the horizon of those before, and against the one patch in front of them.
        let from = (here.ceil() as i64).max(ring.belonging.0);
        let end = if left + span >= 1.0 { i64::MAX } else { there.ceil() as i64 };
        let from = if left <= -1.0 { ring.belonging.0 } else { from };
        let count = end.min(ring.belonging.1) - from;
        if count > 0 {
            let asked = if count >= 16 { u16::MAX } else { (1u16 << count) - 1 };
            let to = from - base as i64;
            let side: isize = if rising { -1 } else { 1 };
            let shift = (from as f64 - here) as f32;
            let (c0, c1, p0, p1) = unsafe {
                let (far, near) = (far.offset(to as isize), near.offset(to as isize));
                (V::load(far), V::load(far.offset(side)), V::load(near), V::load(near.offset(side)))
            };
            let slope = c0.add(V::splat(target_height)).mul(inverse);
            let place = lane.add(V::splat(shift)).mul(inverse_width).max(zero).min(V::splat(15.999_999));
            let (bin, whole) = place.whole();
            let within = place.sub(whole);
            let margin = V::splat(rounding).mul(inverse);
            let (upper, upper_margin) = chord(upper_left, upper_right, bin, within, margin);
            let (lower, lower_margin) = chord(lower_left, lower_right, bin, within, margin);
            let above = upper.add(upper_margin).at_most(slope);
            let below = slope.add(lower_margin).at_most(lower);

            let across =
                V::splat(((from as f64 - frame.eye_minor) / ring.distance) as f32).add(lane.mul(inverse)).abs();
            let (near_step, far_step) = (p1.sub(p0), c1.sub(c0));
            let start = slope.mul(V::splat(before)).sub(p0.add(near_step.mul(across)));
            let stop = V::splat(target_height);
            let bulge = across.mul(far_step.sub(near_step));
            let rise = start.sub(stop);
            let dip = bulge.add(rise).mul(bulge.add(rise));
            let fourfold = bulge.mul(V::splat(4.0));
            let (sure, maybe) = (V::splat(graze + 4.0 * rounding), V::splat(graze - 4.0 * rounding));
            // Bulges within rounding decide nothing: that is left to the line of sight.
            let dips = rise.abs().at_most(bulge) & !bulge.at_most(V::splat(4.0 * rounding));
            let blocked = start.add(sure).at_most(zero) | dips & fourfold.mul(start.add(sure)).at_most(dip);
            let lowest = start.min(stop).add(maybe);
            let free = zero.at_most(start.add(maybe))
                & (bulge.add(V::splat(4.0 * rounding)).at_most(rise.abs())
                    | dip.at_most(fourfold.mul(start.add(maybe))) & !bulge.at_most(zero)
                    | bulge.at_most(lowest.mul(V::splat(4.0))));
            let blocked = if VOIDS {
                let solid = unsafe {
                    let at = (row * rings.stride) as isize + offset as isize + to as isize;
                    let (far, near) =
                        (rings.solid.as_ptr().offset(at), rings.solid.as_ptr().offset(at - rings.stride as isize));
                    let far = V::load(far).min(V::load(far.offset(side)));
                    far.min(V::load(near).min(V::load(near.offset(side))))
                };
                blocked & V::splat(0.5 * NOTHING).at_most(solid)
            } else {
                blocked
            };

            let visible = asked & above & free;
            found.seen += visible.count_ones() as usize;
            let (first, step) = (frame.index(ring.major, from), frame.step());
            let mut bits = visible;
            while bits != 0 {
                // SAFETY: the sample belongs to this wedge only.
                unsafe { seen.mark(first + step * bits.trailing_zeros() as usize) };
                bits &= bits - 1;
            }
            // Samples in doubt: above the horizon of how many rings ago? Only the strips since then are in question.
            let mut doubtful = asked & !visible & !below & !blocked;
            let mut back = row;
            while doubtful != 0 {
                let (clear, since) = if back == 0 {
                    (doubtful, 0)
                } else {
                    let (left, right) = (table(&history[back].0), table(&history[back].1));
                    let (upper, upper_margin) = chord(left, right, bin, within, margin);
                    (doubtful & upper.add(upper_margin).at_most(slope), rings.rings[back - 1].ring)
                };
                doubtful &= !clear;
                back = back.saturating_sub(1);
                let mut bits = clear;
                while bits != 0 {
                    let minor = from + i64::from(bits.trailing_zeros());
                    found.pending.push(Pending { ring: ring.ring, minor, since });
                    bits &= bits - 1;
                }
            }
        }

        // The ground of the strip that ends at this ring raises the horizon.
        let y = lane.mul(V::splat(width as f32)).add(V::splat((here - base) as f32));
        let (i_left, whole) = y.whole();
        let f_left = y.sub(whole);
        let y = y.add(V::splat(width as f32));
        let (i_right, whole) = y.whole();
        let f_right = y.sub(whole);
        let (h0, h1) = unsafe { (V::load(far), V::load(far.add(1))) };
        let (h_left, step_left) = along(h0, h1, i_left, f_left);
        let (h_right, step_right) = along(h0, h1, i_right, f_right);
        // A sample within the bin: the ground there stands above (or below) the chord by so much.
        let vertex = V::splat(1.0).sub(f_left).mul(f_right).mul(inverse_width);
        let tent = step_left.sub(step_right).mul(vertex);

        let bulge = unsafe {
            let (steep, flat) = if rising { (near.sub(1), far.sub(1)) } else { (far, near) };
            let ([s0, s1, s2], [f0, f1, f2]) = (steps::<V>(steep), steps::<V>(flat));
            let (steepest, flattest) = (s0.max(s1).max(s2), f0.min(f1).min(f2));
            let twist = steepest.sub(flattest).lookup(i_left);
            aside.mul(twist).max(zero).add(V::splat(4.0 * rounding + 1e-9))
        };
        let per_bulge = V::splat(0.25 / before).div(bulge);
        let before = V::splat(before);
        let lift = tent.max(zero).add(V::splat(rounding - graze));
        (upper_left, last_left) = raise(upper_left, last_left, h_left.add(lift).mul(inverse), bulge, per_bulge, before);
        (upper_right, last_right) =
            raise(upper_right, last_right, h_right.add(lift).mul(inverse), bulge, per_bulge, before);

        let (h_left, h_right, tent) = if VOIDS {
            let solid = unsafe { rings.solid.as_ptr().add(row * rings.stride + offset) };
            let (h0, h1) = unsafe { (V::load(solid), V::load(solid.add(1))) };
            let (h_left, step_left) = along(h0, h1, i_left, f_left);
            let (h_right, step_right) = along(h0, h1, i_right, f_right);
            (h_left, h_right, step_left.sub(step_right).mul(vertex))
        } else {
            (h_left, h_right, tent)
        };
        let sink = tent.min(zero).sub(V::splat(rounding + graze));
        let (low_left, low_right) = (h_left.add(sink).mul(inverse), h_right.add(sink).mul(inverse));
        let better = lower_left.add(lower_right).at_most(low_left.add(low_right));
        if better != 0 {
            lower_left = low_left.select(better, lower_left);
            lower_right = low_right.select(better, lower_right);
            floor = lower_left.min(lower_right).smallest();
        }
    }

    save(upper_left, &mut bins.upper_left);
    save(upper_right, &mut bins.upper_right);
    save(lower_left, &mut bins.lower_left);
    save(lower_right, &mut bins.lower_right);
    save(last_left, &mut bins.last_left);
    save(last_right, &mut bins.last_right);
    (bins.floor, bins.skipped) = (floor, skipped);
}

/// A line over bins at a place within them, and how far rounding may have moved it.
#[inline(always)]
fn chord<V: Lanes>(left: V, right: V, bin: V::Index, within: V, margin: V) -> (V, V) {
    let (left, right) = (left.lookup(bin), right.lookup(bin));
    let rise = right.sub(left);
    (left.add(rise.mul(within)), rise.abs().mul(V::splat(1e-5)).add(margin))
}

/// Heights between samples, and the steps from one sample to the next there.
#[inline(always)]
fn along<V: Lanes>(here: V, next: V, index: V::Index, within: V) -> (V, V) {
    let (a, b) = (here.lookup(index), next.lookup(index));
    let step = b.sub(a);
    (a.add(step.mul(within)), step)
}

/// The steps from each of eighteen samples to the next: sixteen from the first, from the second, from the third on.
///
/// # Safety
/// Nineteen numbers must be readable at `row`.
#[inline(always)]
unsafe fn steps<V: Lanes>(row: *const f32) -> [V; 3] {
    // SAFETY: the caller's.
    let [a, b, c, d] = unsafe { [V::load(row), V::load(row.add(1)), V::load(row.add(2)), V::load(row.add(3))] };
    [b.sub(a), c.sub(b), d.sub(c)]
}

/// The upper bound of one edge after a strip that begins at slope `last` and ends at slope `now`, and `now`. Between the
/// two, `before` samples or more away from the eye, the ground may stand above its chord by `bulge`·u(1 − u).
#[inline(always)]
fn raise<V: Lanes>(upper: V, last: V, now: V, bulge: V, per_bulge: V, before: V) -> (V, V) {
    let rest = bulge.sub(now.sub(last).abs().mul(before)).max(V::splat(0.0));
    let excess = rest.mul(rest).mul(per_bulge);
    (upper.max(now.max(last).add(excess)), now)
}
