//! The rays of a fine beam of a view, walked together: 4 × 4 pixels, a lane each.
//!
//! Near the eye many neighbouring pixels see the same few patches. So the sixteen rays share one walk: strips of patches
//! between neighbouring lattice lines of the axis that they cross most lines of, front to back, and in each strip the
//! patches that lie between the beam's outermost rays. A patch whose highest corner is below the lowest ray there is
//! passed; any other is tested against all rays at once, its corners read once and dealt out, where a walk of each ray
//! by itself has to gather them. As long as a strip is clear, whole blocks of strips are asked of the pyramid.
//!
//! Rays start at one point, so that everything about their bounds is a number, not a vector: on the lattice line at
//! distance m along the major axis the beam lies between m · s₀ and m · s₁ along the minor one (s the outermost slopes),
//! and above m · g (g the steepest descent of those not yet ended). On a line of the major axis a ray's height over a
//! patch is `f(s) = above + slope·s + bend·s²`, with s the distance behind the strip's first line; a ray meets the patch
//! if f is not positive where it enters or leaves it, or dips below 0 between. Patches are tried in the order in which
//! each ray crosses them, so the first found is the hit; where exactly is worked out for all rays at the end.
//!
//! Beams that have grown wide, or have cost many tests, are given up: the rays not yet ended go on one by one in the
//! stream, from the strip that they have come to. So do beams about an axis, whose rays run to both sides of it, and all
//! beams over land with voids.
//!
//! Works this rests on: I. Wald et al., "Interactive rendering with coherent ray tracing", Eurographics 2001 (packets);
//! A. Reshetov et al., "Multi-level ray tracing algorithm", SIGGRAPH 2005 (one walk for a beam).

use super::lanes::Lanes;
use super::scene::Scene;
use glam::Vec3;

/// Pixels of a beam in a row.
pub(super) const SIDE: usize = 4;
/// Tests after which a beam is given up: about what its rays cost in the stream.
const TESTS: u32 = 32;
/// Width at which it is given up (cells).
const WIDTH: f32 = 2.0;

/// The rays of a beam, from one eye.
pub(super) struct Beam<'a, L: Lanes> {
    pub eye: Vec3,
    /// Directions of the lanes, in one or two vectors.
    pub directions: &'a [[L::F; 3]; 2],
    /// Direction of the beam's middle.
    pub middle: Vec3,
    /// Nothing can be met before.
    pub from: f32,
    /// One bit for each lane whose answer is wanted.
    pub wanted: u32,
    /// Width of rays at distance 1 (samples) if walked by footprint, else 0.
    pub spread: f32,
}

/// What has become of the rays.
pub(super) struct Outcome {
    /// Distances of first hits, infinity for none.
    pub distance: [f32; 16],
    /// Where to go on with those that are open.
    pub from: [f32; 16],
    /// Rays not ended, and rays that started below the surface: one bit each.
    pub open: u32,
    pub below: u32,
}

/// One axis, mirrored so that the beam runs forward along it. Cells and lines are counted from the anchor's.
#[derive(Clone, Copy)]
struct Axis {
    backward: bool,
    /// The eye.
    at: f32,
    /// What turns cells into mirrored ones of the raster, and those into the raster's.
    base: i32,
    mirror: i32,
    /// The map's cells.
    first: i32,
    last: i32,
    /// The eye, counted from the first cell, and how many cells follow that: for bounds only.
    here: f32,
    most: f32,
}

impl Axis {
    #[inline(always)]
    fn new(scene: &Scene, axis: usize, eye: Vec3, middle: Vec3) -> Axis {
        let backward = middle[axis] * scene.per_metre[axis] < 0.0;
        let at = eye[axis] * scene.per_metre[axis] + scene.offset[axis];
        let (side, count, cell) = (scene.side, scene.cells[axis], scene.cell[axis]);
        let (base, mirror) = if backward { (side - cell, side - 1) } else { (cell, 0) };
        let first = if backward { side - count } else { 0 } - base;
        let at = if backward { -at } else { at };
        let here = at - first as f32;
        Axis { backward, at, base, mirror, first, last: first + count - 1, here, most: (count - 1) as f32 }
    }

    /// A mirrored node of a level in the raster.
    #[inline(always)]
    fn node(&self, node: i32, level: i32) -> i32 {
        node ^ self.mirror >> level
    }

    /// The raster's sample at the near border of a cell.
    #[inline(always)]
    fn sample(&self, cell: i32) -> i32 {
        ((cell + self.base) ^ self.mirror) + i32::from(self.backward)
    }

    /// Whether all its cells are counted exactly, and those about the eye finely.
    fn is_near(&self) -> bool {
        self.at.abs() < 65536.0 && self.most < 16_777_216.0
    }

    /// Directions (m) as mirrored, in cells.
    #[inline(always)]
    fn forward<L: Lanes>(&self, l: L, way: L::F, per_metre: f32) -> L::F {
        l.flip(l.mul(way, l.splat(per_metre)), l.int(if self.backward { i32::MIN } else { 0 }))
    }
}

/// Heights (m) of a patch: its near corner, what is added to the next one along the major axis and along the minor one,
/// and what the far corner lacks then.
struct Patch {
    near: f32,
    along: f32,
    aside: f32,
    twist: f32,
}

/// For some lanes, all that is the same for every patch.
#[derive(Clone, Copy)]
struct Rays<L: Lanes> {
    /// Directions along the major and the minor axis and up, the horizontal ones' inverses, and minus their product.
    major: L::F,
    minor: L::F,
    up: L::F,
    per_major: L::F,
    per_minor: L::F,
    product: L::F,
    /// Rise along each axis.
    grades: [L::F; 2],
    /// Distances at which the strip begins and ends, and position on the minor axis and height at its beginning.
    near: L::F,
    far: L::F,
    aside: L::F,
    height: L::F,
    /// Rays not ended yet, and those that have met something: where they entered the patch, how far they could go in it,
    /// and the coefficients of their height from there.
    open: L::M,
    hit: L::M,
    enter: L::F,
    reach: L::F,
    above: L::F,
    slope: L::F,
    bend: L::F,
}

impl<L: Lanes> Rays<L> {
    #[inline(always)]
    fn new(l: L, [major, minor, up]: [L::F; 3], wanted: u32) -> Rays<L> {
        let (zero, one) = (l.splat(0.0), l.splat(1.0));
        let (per_major, per_minor) = (l.div(one, major), l.div(one, minor));
        Rays {
            major,
            minor,
            up,
            per_major,
            per_minor,
            product: l.sub(zero, l.mul(major, minor)),
            grades: [l.mul(up, per_major), l.mul(up, per_minor)],
            near: zero,
            far: zero,
            aside: zero,
            height: zero,
            open: l.mask(wanted),
            hit: l.mask(0),
            enter: zero,
            reach: zero,
            above: zero,
            slope: zero,
            bend: zero,
        }
    }

    /// Goes to the strip between two lines, counted from the eye.
    #[inline(always)]
    fn enter_strip(&mut self, l: L, lines: (f32, f32), aside: f32, z: f32) {
        self.near = l.mul(l.splat(lines.0), self.per_major);
        self.far = l.mul(l.splat(lines.1), self.per_major);
        self.aside = l.fused(self.near, self.minor, l.splat(aside));
        self.height = l.fused(self.near, self.up, l.splat(z));
    }

    /// Tests the strip's patch in a row; the row's lines are counted from the eye.
    #[inline(always)]
    fn test(&mut self, l: L, patch: &Patch, row: i32, lines: (f32, f32)) {
        let zero = l.splat(0.0);
        let (twist, aside) = (l.splat(patch.twist), l.splat(patch.aside));
        // Height over the patch on the strip's first line, its slope there, and its bend.
        let v = l.sub(self.aside, l.splat(row as f32));
        let above = l.fused_from(aside, v, l.sub(self.height, l.splat(patch.near)));
        let along = l.fused(twist, v, l.splat(patch.along));
        let slope = l.fused_from(aside, self.minor, l.fused_from(along, self.major, self.up));
        let bend = l.mul(twist, self.product);
        let enter = l.max(l.max(self.near, l.mul(l.splat(lines.0), self.per_minor)), zero);
        let leave = l.min(self.far, l.mul(l.splat(lines.1), self.per_minor));
        let (s0, s1) = (l.sub(enter, self.near), l.sub(leave, self.near));
        let f0 = l.fused(s0, l.fused(bend, s0, slope), above);
        let f1 = l.fused(s1, l.fused(bend, s1, slope), above);
        let twice = l.add(bend, bend);
        let (slope0, slope1) = (l.fused(twice, s0, slope), l.fused(twice, s1, slope));
        // Falls first and rises then: the lowest point lies between.
        let dips = l.and(l.lt(slope0, zero), l.lt(zero, slope1));
        let dips = l.and(dips, l.le(zero, discriminant(l, slope0, bend, f0)));
        let meets = l.or(l.or(l.le(f0, zero), l.le(f1, zero)), dips);
        let hit = l.and(l.and(meets, self.open), l.le(enter, leave));
        self.open = l.without(self.open, hit);
        self.hit = l.or(self.hit, hit);
        self.enter = l.select(hit, enter, self.enter);
        self.reach = l.select(hit, l.sub(s1, s0), self.reach);
        self.above = l.select(hit, f0, self.above);
        self.slope = l.select(hit, slope0, self.slope);
        self.bend = l.select(hit, bend, self.bend);
    }

    /// Distances of the hits; and which of them mean that the ray was below the surface from its start on, where it came
    /// over the map.
    #[inline(always)]
    fn distances(&self, l: L, start: L::F) -> (L::F, L::M) {
        let zero = l.splat(0.0);
        // The smaller positive root, without a difference of nearly equal numbers.
        let disc = discriminant(l, self.slope, self.bend, self.above);
        let (root, falls) = (l.sqrt(l.max(disc, zero)), l.lt(self.slope, zero));
        let above = l.select(falls, l.add(self.above, self.above), l.add(self.slope, root));
        let root = l.div(above, l.select(falls, l.sub(root, self.slope), l.mul(l.splat(-2.0), self.bend)));
        // Below already on entry, or 0/0: at the entry.
        let root = l.select(l.lt(zero, self.above), l.min(root, self.reach), zero);
        let distance = l.select(self.hit, l.add(self.enter, root), l.splat(f32::INFINITY));
        (distance, l.and(self.hit, l.and(l.lt(self.above, zero), l.le(self.enter, start))))
    }
}

/// Lanes that move forward at a speed that has an inverse.
#[inline(always)]
fn moves<L: Lanes>(l: L, way: L::F) -> L::M {
    l.and(l.lt(l.splat(1e-20), way), l.lt(way, l.splat(1e20)))
}

#[inline(always)]
fn discriminant<L: Lanes>(l: L, slope: L::F, bend: L::F, above: L::F) -> L::F {
    l.fused_from(l.mul(l.splat(4.0), bend), above, l.mul(slope, slope))
}

/// One bit for each lane of one or two vectors.
#[inline(always)]
fn bits<L: Lanes>(l: L, of: [L::M; 2]) -> u32 {
    if L::COUNT == 16 { l.bits(of[0]) } else { l.bits(of[0]) | l.bits(of[1]) << 8 }
}

/// Walks a beam until all its rays have ended or it is given up.
#[inline(always)]
pub(super) fn walk<L: Lanes>(l: L, scene: &Scene, beam: &Beam<L>, outcome: &mut Outcome) {
    *outcome = Outcome { distance: [f32::INFINITY; 16], from: [beam.from; 16], open: beam.wanted, below: 0 };
    let cells = beam.middle.truncate() * scene.per_metre;
    let eastward = cells.x.abs() >= cells.y.abs();
    let (x, y) = (Axis::new(scene, 0, beam.eye, beam.middle), Axis::new(scene, 1, beam.eye, beam.middle));
    if !(scene.voids.is_empty() && x.is_near() && y.is_near()) {
        return;
    }
    let (major, minor) = if eastward { (x, y) } else { (y, x) };
    let z = beam.eye.z + scene.height;

    let (halves, never) = (16 / L::COUNT, l.splat(f32::INFINITY));
    let mut forward = [l.mask(0); 2];
    let mut rays = [Rays::new(l, [l.splat(1.0); 3], 0); 2];
    // Slopes seen from above, speeds, and rises along both axes: of the corner rays, as no ray between exceeds them.
    let mut numbers = [[0.0; 16]; 4];
    for (half, rays) in rays.iter_mut().enumerate().take(halves) {
        let [x_way, y_way, up] = beam.directions[half];
        let (x_way, y_way) = (x.forward(l, x_way, scene.per_metre.x), y.forward(l, y_way, scene.per_metre.y));
        let (along, across) = if eastward { (x_way, y_way) } else { (y_way, x_way) };
        forward[half] = l.and(moves(l, along), moves(l, across));
        *rays = Rays::new(l, [along, across, up], beam.wanted >> (half * L::COUNT));
        let at = half * L::COUNT;
        l.store(l.mul(across, rays.per_major), &mut numbers[0][at..]);
        l.store(along, &mut numbers[1][at..]);
        l.store(rays.grades[0], &mut numbers[2][at..]);
        l.store(rays.grades[1], &mut numbers[3][at..]);
    }
    if bits(l, forward) != 0xFFFF {
        return;
    }
    let corners = numbers.map(|of| [of[0], of[SIDE - 1], of[16 - SIDE], of[15]]);
    let least = corners.map(|[a, b, c, d]| smaller(smaller(a, b), smaller(c, d)));
    let [slope_low, speed, grade_major, grade_minor] = least;
    let (mut fall_major, mut fall_minor) = (Fall::new(grade_major), Fall::new(grade_minor));
    let [a, b, c, d] = corners[0];
    let slope_high = larger(larger(a, b), larger(c, d));
    // For what rounding does to bounds.
    let hair = 0.004 + 2e-6 * (major.here.abs() + minor.here.abs());
    let sole = z - (0.01 + 1e-6 * z.abs());

    // Steps in the raster along the axes as mirrored.
    let (step_major, step_minor) = if eastward { (1, scene.columns) } else { (scene.columns, 1) };
    let ahead = if major.backward { -step_major } else { step_major };
    let aside = if minor.backward { -step_minor } else { step_minor };

    let mut strip = major.first + whole(major.here + beam.from * speed - hair, major.most);
    let mut level = 0;
    let (mut open, mut tests) = (beam.wanted, 0);
    // Rays left over have met nothing, unless the beam is given up.
    let mut given_up = false;
    while strip <= major.last {
        let next = ((((strip + major.base) >> level) + 1) << level) - major.base;
        let (a, b) = (larger(strip as f32 - major.at, 0.0), next as f32 - major.at);
        let width = hair + 2e-6 * b;
        let (low, high) = (minor.here + a * slope_low - width, minor.here + b * slope_high + width);
        let (first, last) = (minor.first + whole(low, minor.most), minor.first + whole(high, minor.most));
        // None if the beam has not come to the map yet.
        let last = if high < 0.0 { minor.first - 1 } else { last };
        let lowest = sole + fall_major.least(a, b);
        if low > minor.most + 1.0 || lowest > scene.high && fall_major.rises() {
            break;
        }
        if beam.spread * b >= 2.0 * speed {
            given_up = true;
            break;
        }
        if level > 0 {
            let nodes = ((first + minor.base) >> level, (last + minor.base) >> level);
            let clear = nodes.1 - nodes.0 < 2 && {
                let along = major.node((strip + major.base) >> level, level);
                let (offset, stride) = (scene.offsets[level as usize], scene.strides[level as usize]);
                let (along, across) = if eastward { (along, stride) } else { (along * stride, 1) };
                let high = |node: i32| {
                    let index = (offset + along + minor.node(node, level) * across) as usize;
                    // SAFETY: strips and rows are clamped to the map's, so the node exists at every level to the top.
                    unsafe { *scene.highs.get_unchecked(index) }
                };
                nodes.1 < nodes.0 || f32::from(high(nodes.0).max(high(nodes.1))) * scene.step + scene.high_base < lowest
            };
            if !clear {
                level -= 1;
                continue;
            }
            strip = next;
            level += i32::from((strip + major.base) & ((2 << level) - 1) == 0 && level < scene.top);
            continue;
        }
        if b * (slope_high - slope_low) > WIDTH || tests > TESTS {
            given_up = true;
            break;
        }

        // The strip's patches, each sharing two corners with the one before.
        let mut at = major.sample(strip) * step_major + minor.sample(first) * step_minor;
        // SAFETY: as above; a patch has a sample on each of its corners.
        let height = |at: i32| unsafe { *scene.heights.get_unchecked(at as usize) };
        let (mut row, mut tested) = (first, false);
        let (mut near, mut far) = if first <= last { (height(at), height(at + ahead)) } else { (0.0, 0.0) };
        let mut highest = larger(near, far);
        while row <= last {
            let lines = (row as f32 - minor.at, (row + 1) as f32 - minor.at);
            let (near_aside, far_aside) = (height(at + aside), height(at + aside + ahead));
            let lowest = larger(lowest, sole + fall_minor.least(larger(lines.0, 0.0), lines.1));
            let highest_aside = larger(near_aside, far_aside);
            if larger(highest, highest_aside) > lowest {
                let patch = Patch {
                    near,
                    along: far - near,
                    aside: near_aside - near,
                    twist: (far_aside - near_aside) - (far - near),
                };
                let mut left = [l.mask(0); 2];
                for half in 0..halves {
                    let rays = &mut rays[half];
                    if !tested {
                        rays.enter_strip(l, (strip as f32 - major.at, next as f32 - major.at), minor.at, z);
                    }
                    rays.test(l, &patch, row, lines);
                    left[half] = rays.open;
                }
                tested = true;
                tests += 1;
                if bits(l, left) == 0 {
                    break;
                }
            }
            (near, far, highest) = (near_aside, far_aside, highest_aside);
            (at, row) = (at + aside, row + 1);
        }
        let left = bits(l, [rays[0].open, rays[1].open]);
        if left != open {
            if left == 0 {
                break;
            }
            // Those that are left are the higher ones, as a rule.
            open = left;
            let mut grades = [f32::INFINITY; 2];
            for rays in &rays[..halves] {
                for (least, &grade) in grades.iter_mut().zip(&rays.grades) {
                    *least = smaller(*least, l.least(l.select(rays.open, grade, never)));
                }
            }
            (fall_major, fall_minor) = (Fall::new(grades[0]), Fall::new(grades[1]));
        }
        strip = next;
        level = i32::from(!tested && (strip + major.base) & 1 == 0 && scene.top > 0);
    }

    outcome.open = 0;
    for half in 0..halves {
        let (rays, at) = (&rays[half], half * L::COUNT);
        // Where rays come over the map.
        let over_major = l.mul(l.splat(major.first as f32 - major.at), rays.per_major);
        let over_minor = l.mul(l.splat(minor.first as f32 - minor.at), rays.per_minor);
        let start = l.max(l.max(over_major, over_minor), l.splat(0.0));
        let (distance, below) = rays.distances(l, start);
        l.store(distance, &mut outcome.distance[at..]);
        outcome.below |= l.bits(below) << at;
        if given_up {
            outcome.open |= l.bits(rays.open) << at;
            let here = l.mul(l.splat(strip as f32 - major.at), rays.per_major);
            l.store(l.max(here, l.splat(beam.from)), &mut outcome.from[at..]);
        }
    }
}

/// How the lowest of some rays rises or falls along an axis: its height where it has come to either end of a piece of the way, as a share of each.
#[derive(Clone, Copy)]
struct Fall {
    from: f32,
    to: f32,
}

impl Fall {
    /// For rays that rise by at least `grade` (m) a cell.
    #[inline(always)]
    fn new(grade: f32) -> Fall {
        // Lowest at the end if they fall, else at the beginning; and a millionth lower, for what rounding does.
        if grade < 0.0 { Fall { from: 0.0, to: grade * (1.0 + 1e-6) } } else { Fall { from: grade, to: -1e-6 * grade } }
    }

    /// The least rise (m) from the eye to a place between two distances (cells), of which the first is not negative.
    #[inline(always)]
    fn least(self, from: f32, to: f32) -> f32 {
        from * self.from + to * self.to
    }

    #[inline(always)]
    fn rises(self) -> bool {
        self.from > 0.0 || self.to == 0.0
    }
}

/// `b` unless `a > b`: one instruction, unlike [`f32::max`].
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `b` unless `a < b`.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Rounds down to an integer from 0 to `most`, which is one; NaN gives 0.
#[inline(always)]
fn whole(a: f32, most: f32) -> i32 {
    // SAFETY: the number lies between 0 and `most`.
    unsafe { smaller(larger(a, 0.0), most).to_int_unchecked() }
}
