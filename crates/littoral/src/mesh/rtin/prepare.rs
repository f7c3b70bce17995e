//! Measuring all deviations.
//!
//! The raster is worked on in strips of 64 rows of patches, each by itself, with small squares in blocks ([`super::blocks`]);
//! squares of a few blocks are measured with them, larger ones follow from smaller ones ([`super::search`]); what is cut by
//! the raster's border or partly void is measured one triangle after the other. A side between two strips has a triangle in
//! each, so that what depends on it is raised once more in the end.
//! Greatest numbers do not depend on the order they are compared in: any number of threads finds the same bits.

use super::blocks::{self, Blocks, LANES, OF_ERROR, OF_HEIGHT, Planes, SIDE, SIZES};
use super::cut::Cut;
use super::rows::{Errors, Rows, collect, greater, nest_centres, nest_sides, raise, split};
use super::search::{self, Stack};
use super::states::{ALL_SOLID, SOLID, States, VOID, all_states, half_states, state};
use super::{Corners, Level, Part, Rtin, halves, quarter, rises};
use crate::field::Raster;
use crate::mesh::measure::{Exactness, deviation};
use rayon::prelude::*;

/// Rounded up.
fn up(deviation: f64) -> f32 {
    let nearest = deviation as f32;
    if f64::from(nearest) < deviation { nearest.next_up() } else { nearest }
}

/// What all strips need to know.
struct Ground<'a> {
    raster: &'a Raster,
    exactness: Exactness,
    levels: &'a [Level],
    /// States of all squares of each size; empty where nothing is void.
    states: Vec<Vec<States>>,
    last: [u32; 2],
}

impl Ground<'_> {
    fn states(&self, k: usize, x: usize, y: usize) -> States {
        self.states.get(k).map_or(ALL_SOLID, |states| states[y * self.levels[k].columns + x])
    }

    /// Whether a square lies in the raster, nothing of it void.
    fn whole(&self, k: usize, x: usize, y: usize) -> bool {
        let side = 2usize << k;
        let inside = (x + 1) * side <= self.last[0] as usize && (y + 1) * side <= self.last[1] as usize;
        inside && self.states(k, x, y) == ALL_SOLID
    }

    /// Whether single precision rounds nothing in squares of a size.
    fn exact(&self, k: usize) -> bool {
        self.exactness.bits + k as u32 + 3 <= 24
    }

    /// The greatest errors of any square, triangle by triangle.
    fn square(&self, k: usize, x: usize, y: usize, one: &mut dyn FnMut(Corners, u8) -> f32) -> Errors {
        let (side, states) = (2u32 << k, self.states(k, x, y));
        let (west, south) = (x as u32 * side, y as u32 * side);
        let [state_a, state_b] = half_states(states, rises(x, y));
        let [a, b] = halves(west, south, side, rises(x, y));
        let centre = one(a, state_a).max(one(b, state_b));
        let mut part = |part| one(quarter(west, south, side, part), state(states, part));
        [centre, part(Part::South), part(Part::East), part(Part::North), part(Part::West)]
    }

    /// The greatest error of a triangle that may be cut or partly void, from all of its samples.
    fn any(&self, corners: Corners, state: u8) -> f32 {
        match state {
            _ if state == SOLID | VOID => f32::INFINITY,
            SOLID => {
                let measure =
                    |corners| deviation(self.raster.heights(), self.raster.columns(), self.exactness, corners);
                up(Cut::new(corners, self.last).triangles().map(measure).fold(0.0, f64::max))
            }
            _ => 0.0,
        }
    }

    /// The greatest error of a large triangle, from smaller ones where it is whole; `floor` if it is not more.
    fn large(&self, rtin: &Rtin, stack: &mut Stack, corners: Corners, state: u8, floor: f32) -> f32 {
        if state != SOLID || corners.iter().any(|at| at[0] > self.last[0] || at[1] > self.last[1]) {
            return self.any(corners, state).max(floor);
        }
        // The right angle is at the corner that the others are equally far from.
        let [a, b, c] = corners;
        let squared = |p: [u32; 2], q: [u32; 2]| {
            [0, 1].map(|i| (i64::from(p[i]) - i64::from(q[i])).pow(2)).into_iter().sum::<i64>()
        };
        let longest = squared(a, b).max(squared(b, c)).max(squared(c, a));
        let turned = match longest {
            _ if longest == squared(a, b) => [a, b, c],
            _ if longest == squared(b, c) => [b, c, a],
            _ => [c, a, b],
        };
        let heights = self.raster.heights();
        let error = search::deviation(rtin, heights, turned, f64::from(floor), stack);
        // Halving heights time and again may round them, unless they have few digits.
        let highest = corners
            .map(|at| f64::from(heights[at[1] as usize * self.raster.columns() + at[0] as usize]).abs())
            .into_iter()
            .fold(0.0, f64::max);
        let rounding = if self.exactness.bits <= 24 { 0.0 } else { 64.0 * f64::EPSILON * highest };
        if error > f64::from(floor) { up(error + rounding) } else { floor }
    }

    /// Measures all small squares of a strip.
    fn strip(&self, strip: usize, sizes: &mut [Rows], blocks: &mut Blocks) -> Vec<Errors> {
        let mut parts = vec![[0.0; 5]; self.medium().map(|k| self.levels[k].columns).sum()];
        let columns = self.raster.columns();
        let mut lists = [Vec::new(), Vec::new()];
        for x in 0..(columns - 1).div_ceil(SIDE) {
            if sizes.len() == SIZES && self.whole(SIZES - 1, x, strip) {
                lists[usize::from(rises(x, strip))].push(x);
            } else {
                self.block(strip, x, sizes);
            }
        }
        for (rises, list) in [false, true].into_iter().zip(lists) {
            for group in list.chunks(LANES) {
                // Fewer blocks than lanes: the last one several times.
                let block: [usize; LANES] = std::array::from_fn(|lane| group[lane.min(group.len() - 1)]);
                let corners = block.map(|x| (strip * columns + x) * SIDE);
                let exact = std::array::from_fn(|k| self.exact(k));
                blocks.measure(self.raster.heights(), columns, &corners, rises, exact);
                for (k, rows) in sizes.iter_mut().enumerate() {
                    collect(blocks, k, &block[..group.len()], rows);
                }
                let mut first = 0;
                for k in self.medium() {
                    self.beside(k, strip, &block[..group.len()], rises, blocks, &mut parts[first..]);
                    first += self.levels[k].columns;
                }
            }
        }
        for k in 0..sizes.len() {
            let (finer, rest) = sizes.split_at_mut(k);
            rest[0].nest(finer.last().map(|finer| (&*finer.centres, finer.columns)));
        }
        parts
    }

    /// Sizes of squares of a few blocks, measured with them.
    fn medium(&self) -> std::ops::Range<usize> {
        SIZES.min(self.levels.len())..(SIZES + 2).min(self.levels.len())
    }

    /// What the samples of blocks tell of larger squares: their errors as far as they lie in these blocks.
    fn beside(&self, k: usize, strip: usize, list: &[usize], rises_here: bool, blocks: &Blocks, parts: &mut [Errors]) {
        let (m, side) = ((2usize << k) / SIDE, 2u32 << k);
        let (mut of_halves, mut of_quarters) = ([Planes::default(); 2], [Planes::default(); 2]);
        let mut which = [[0; 2]; LANES];
        let y = strip / m;
        for (lane, &block) in list.iter().enumerate() {
            let (x, i, j) = (block / m, block % m, strip % m);
            let (west, south) = (x as u32 * side, y as u32 * side);
            if !self.whole(k, x, y) {
                continue;
            }
            let rises = rises(x, y);
            let two = halves(west, south, side, rises);
            // Which half the block lies in, or which are on the sides of its diagonal.
            let beyond = if rises { j.cmp(&i) } else { (i + j).cmp(&(m - 1)) };
            let [a, b] = match beyond {
                std::cmp::Ordering::Less => [0, 0],
                std::cmp::Ordering::Equal => [0, 1],
                std::cmp::Ordering::Greater => [1, 1],
            };
            let corner = [(block * SIDE) as u32, (strip * SIDE) as u32];
            self.plane(two[a], corner, lane, &mut of_halves[0]);
            self.plane(two[b], corner, lane, &mut of_halves[1]);
            let (above, across) = (j.cmp(&i), (i + j).cmp(&(m - 1)));
            use Part::{East, North, South, West};
            use std::cmp::Ordering::{Equal, Greater, Less};
            let pair = match (above, across) {
                (Less, Less) => [South, South],
                (Less, Greater) => [East, East],
                (Greater, Less) => [West, West],
                (Greater, Greater) => [North, North],
                (Equal, Less) => [South, West],
                (Equal, _) => [East, North],
                (Less, Equal) => [South, East],
                (Greater, Equal) => [West, North],
            };
            which[lane] = pair.map(|part| 1 + part as usize);
            for (part, planes) in pair.into_iter().zip(&mut of_quarters) {
                self.plane(quarter(west, south, side, part), corner, lane, planes);
            }
        }
        let found = [blocks.beside(rises_here, &of_halves), blocks.beside(rises_here, &of_quarters)];
        for (lane, &block) in list.iter().enumerate() {
            let part = &mut parts[block / m];
            let [[a, b], [c, d]] = found.map(|found| found.map(|found| found[lane]));
            let [first, second] = which[lane];
            for (kind, found) in [(0, a), (0, b), (first, c), (second, d)] {
                raise(&mut part[kind], found);
            }
        }
    }

    /// The plane of a triangle, as it lies over a block.
    fn plane(&self, [a, b, c]: Corners, corner: [u32; 2], lane: usize, planes: &mut Planes) {
        let height = |at: [u32; 2]| f64::from(self.height(at));
        let from_a = |at: [u32; 2]| [0, 1].map(|axis| f64::from(at[axis]) - f64::from(a[axis]));
        let ([bx, by], [cx, cy], [x, y]) = (from_a(b), from_a(c), from_a(corner));
        let (rise_b, rise_c) = (height(b) - height(a), height(c) - height(a));
        // Twice the area is a power of two.
        let share = 1.0 / (bx * cy - by * cx);
        let (east, north) = ((rise_b * cy - rise_c * by) * share, (rise_c * bx - rise_b * cx) * share);
        planes.base[lane] = (height(a) + (x * east + y * north)) as f32;
        (planes.east[lane], planes.north[lane]) = (east as f32, north as f32);
    }

    fn height(&self, at: [u32; 2]) -> f32 {
        self.raster.heights()[at[1] as usize * self.raster.columns() + at[0] as usize]
    }

    /// The errors of a whole square of a few blocks, of what its blocks have found, and of what rounding may have hidden.
    fn together(&self, k: usize, x: usize, y: usize, found: Errors) -> Errors {
        if self.exact(k) {
            return found;
        }
        let (side, half) = (2u32 << k, 1u32 << k);
        let (west, south) = (x as u32 * side, y as u32 * side);
        let places = [[0, 0], [side, 0], [0, side], [side, side], [half, half]];
        let heights = places.map(|[x, y]| self.height([west + x, south + y]));
        if heights.iter().all(|height| *height == heights[0]) {
            return found;
        }
        let highest = heights.into_iter().fold(1e-30, |most, height| greater(most, height.abs()));
        // Too large where differences could overflow: then nothing is known.
        found.map(|error| error * (1.0 + OF_ERROR) + 2.0 * highest * 17.0 * (OF_HEIGHT / 17.0))
    }

    /// All small squares of a block, one by one.
    fn block(&self, strip: usize, block: usize, sizes: &mut [Rows]) {
        for (k, rows) in sizes.iter_mut().enumerate() {
            let across = blocks::across(k);
            for y in 0..rows.rows {
                for x in block * across..((block + 1) * across).min(rows.columns) {
                    let errors = self.square(k, x, strip * across + y, &mut |corners, state| self.any(corners, state));
                    rows.raise(x, y, errors);
                }
            }
        }
    }
}

/// Measures every deviation of a raster.
pub(super) fn measure(rtin: &mut Rtin, raster: &Raster) {
    let levels = rtin.levels.clone();
    let states = if raster.voids().any() { all_states(raster, &levels) } else { Vec::new() };
    let last = [raster.columns() as u32 - 1, raster.rows() as u32 - 1];
    let exactness = Exactness::of(raster);
    let ground = Ground { raster, exactness, levels: &levels, states, last };
    let strips = (raster.rows() - 1).div_ceil(SIDE);
    let small = levels.len().min(SIZES);
    let (seams, parts): (Vec<Vec<Vec<f32>>>, Vec<Vec<Errors>>) = {
        let mut sizes = split(&mut rtin.deviations, &levels[..small], strips);
        let work = |blocks: &mut Blocks, (strip, sizes): (usize, &mut Vec<Rows>)| ground.strip(strip, sizes, blocks);
        let parts = sizes.par_iter_mut().with_min_len(4).enumerate().map_init(Blocks::new, work).collect();
        let seams = sizes.into_iter().map(|sizes| sizes.into_iter().map(|rows| rows.seam).collect());
        (seams.collect(), parts)
    };
    // What lies at the seams between strips, once more.
    for (strip, seams) in seams.into_iter().enumerate() {
        for (k, seam) in seams.into_iter().enumerate() {
            let (level, y) = (levels[k], (strip + 1) * blocks::across(k));
            if y <= level.rows {
                let line = &mut rtin.deviations[level.flat(0, y)..][..level.columns];
                line.iter_mut().zip(seam).for_each(|(side, found)| raise(side, found));
                nest_sides(rtin, k, y - 1..level.rows.min(y + 1));
                nest_centres(rtin, k, y - 1..level.rows.min(y + 1));
            }
        }
    }
    for (k, level) in levels.iter().enumerate().skip(small) {
        if ground.medium().contains(&k) {
            take_parts(rtin, &ground, k, &parts);
        }
        nest_sides(rtin, k, 0..level.rows);
        // What is no more than is known of what lies within does not matter.
        let known = &*rtin;
        let quarters = |stack: &mut Stack, index: usize| {
            let (x, y) = (index % level.columns, index / level.columns);
            let (side, states) = (2u32 << k, ground.states(k, x, y));
            let searched = !(ground.medium().contains(&k) && ground.whole(k, x, y));
            let places = [level.flat(x, y), level.upright(x + 1, y), level.flat(x, y + 1), level.upright(x, y)];
            let parts = [Part::South, Part::East, Part::North, Part::West];
            std::array::from_fn(|i| {
                let corners = quarter(x as u32 * side, y as u32 * side, side, parts[i]);
                let floor = known.deviations[places[i]];
                let mut found = || ground.large(known, stack, corners, state(states, parts[i]), floor);
                (places[i], if searched { found() } else { floor })
            })
        };
        let squares = level.columns * level.rows;
        let found: Vec<[(usize, f32); 4]> = (0..squares).into_par_iter().map_init(Stack::default, quarters).collect();
        found.into_iter().flatten().for_each(|(place, found)| raise(&mut rtin.deviations[place], found));
        nest_centres(rtin, k, 0..level.rows);
        let known = &*rtin;
        let centres = |stack: &mut Stack, index: usize| {
            let (x, y) = (index % level.columns, index / level.columns);
            let side = 2u32 << k;
            if ground.medium().contains(&k) && ground.whole(k, x, y) {
                return known.deviations[level.centre(x, y)];
            }
            let [a, b] = halves(x as u32 * side, y as u32 * side, side, rises(x, y));
            let [state_a, state_b] = half_states(ground.states(k, x, y), rises(x, y));
            let first = ground.large(known, stack, a, state_a, known.deviations[level.centre(x, y)]);
            ground.large(known, stack, b, state_b, first)
        };
        let found: Vec<f32> = (0..squares).into_par_iter().map_init(Stack::default, centres).collect();
        rtin.deviations[level.centres..][..squares].copy_from_slice(&found);
    }
}

/// Takes over what the blocks of all strips have found of squares of a size.
fn take_parts(rtin: &mut Rtin, ground: &Ground, k: usize, parts: &[Vec<Errors>]) {
    let level = rtin.levels[k];
    let m = (2usize << k) / SIDE;
    let first: usize = (SIZES..k).map(|k| rtin.levels[k].columns).sum();
    for (x, y) in (0..level.rows).flat_map(|y| (0..level.columns).map(move |x| (x, y))) {
        if ground.whole(k, x, y) {
            let mut found = [0.0; 5];
            for part in &parts[y * m..(y + 1) * m] {
                found.iter_mut().zip(part[first + x]).for_each(|(most, part)| raise(most, part));
            }
            let [centre, south, east, north, west] = ground.together(k, x, y, found);
            let deviations = &mut rtin.deviations;
            raise(&mut deviations[level.centre(x, y)], centre);
            raise(&mut deviations[level.flat(x, y)], south);
            raise(&mut deviations[level.flat(x, y + 1)], north);
            raise(&mut deviations[level.upright(x, y)], west);
            raise(&mut deviations[level.upright(x + 1, y)], east);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn rough(columns: usize, rows: usize, kind: u32) -> Raster {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64 ^ u64::from(kind);
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / 16_777_216.0
        };
        let height = |i: usize| {
            let (x, y) = ((i % columns) as f32, (i / columns) as f32);
            let waves = 400.0 * (x * 0.021).sin() * (y * 0.017).cos() + 50.0 * (x * 0.11 + y * 0.07).sin();
            match kind {
                // Whole numbers are exact, others not; a block and a few samples may be void.
                0 => (waves + 8.0 * random()).floor(),
                1 => waves + 3.0 * random() + 1000.0,
                _ if random() < 1e-4 || (x as usize / 40 == 2 && y as usize / 40 == 3) => f32::NAN,
                _ => waves + 3.0 * random(),
            }
        };
        Raster::new(columns, rows, DVec2::ONE, (0..columns * rows).map(height).collect()).expect("a raster")
    }

    /// Every deviation by its definition, triangle by triangle in double precision.
    fn slowly(raster: &Raster) -> Rtin {
        let size = [raster.columns(), raster.rows()];
        let mut rtin = Rtin::layout(size, 2, Vec::new());
        let levels = rtin.levels.clone();
        let states = if raster.voids().any() { all_states(raster, &levels) } else { Vec::new() };
        let last = size.map(|samples| samples as u32 - 1);
        let ground = Ground { raster, exactness: Exactness::of(raster), levels: &levels, states, last };
        for (k, level) in levels.iter().enumerate() {
            for (x, y) in (0..level.rows).flat_map(|y| (0..level.columns).map(move |x| (x, y))) {
                let found = ground.square(k, x, y, &mut |corners, state| ground.any(corners, state));
                let places = [level.centre(x, y), level.flat(x, y), level.upright(x + 1, y), level.flat(x, y + 1)];
                for (place, found) in places.into_iter().chain([level.upright(x, y)]).zip(found) {
                    rtin.deviations[place] = rtin.deviations[place].max(found);
                }
            }
            nest_sides(&mut rtin, k, 0..level.rows);
            nest_centres(&mut rtin, k, 0..level.rows);
        }
        rtin
    }

    #[test]
    fn quick_deviations_are_the_defined_ones() {
        for (columns, rows, kind) in
            [(257, 257, 0), (257, 257, 1), (200, 331, 0), (513, 130, 1), (300, 300, 2), (1200, 66, 1), (65, 65, 1)]
        {
            let raster = rough(columns, rows, kind);
            let (quick, slow) = (Rtin::new(&raster), slowly(&raster));
            assert_eq!(quick.deviations.len(), slow.deviations.len());
            for (quick, slow) in quick.deviations.iter().zip(&slow.deviations) {
                let rounding = if kind == 0 { 0.0 } else { 3e-3 };
                assert!(
                    quick >= slow && *quick <= slow + rounding || quick == slow,
                    "{columns} × {rows}: {quick}, {slow}"
                );
            }
        }
    }

    #[test]
    fn threads_find_the_same_bits() {
        for kind in 0..3 {
            let raster = rough(700, 500, kind);
            let of = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
                pool.install(|| Rtin::new(&raster).deviations.iter().map(|d| d.to_bits()).collect::<Vec<_>>())
            };
            assert!(of(1) == of(3), "{kind}");
        }
    }
}
