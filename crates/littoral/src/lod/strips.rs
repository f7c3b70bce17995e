//! Strips made on the fly: nothing is prepared, no mesh is kept, and what comes out are strips of triangles.
//!
//! The face is divided into *pages*, squares of 64 × 64 cells; those that may be seen are walked, the nearest first, each row by row, and their rows become
//! strips whose cells change size on the way ([`walk`](self::walk)). The walk is that of M. Finch and L. Bishop as V. Kapustin, V. Eruhimov and
//! A. Malashkina published it (GraphiCon 2001), with its five ways to cut a cell. Theirs decides on the level of a
//! cell while it walks, from the strip before; here the bounds decide first, for all pages at once, a bit a cell ([`page`](self::page)), so that
//! pages can be walked in any order, by many threads, and the bound holds. Where the land goes deeper than a page, pages lie within pages.
//!
//! A vertex that a side leaves out is off by no more than the coarser cell beside it: where a cell's own bound is held to half the tolerance, and
//! counts as far as half a cell beyond it, cells and seams together keep it. How near and how visible cells are is taken from slabs: the least and
//! the greatest height of a sixteenth of the page and what is beside it, as the paper's footprint has one slab for all.

mod page;
mod stage;
mod walk;

use super::drawing::{STEPS, Vertex};
use super::{Drawing, Limits, Lod, Reached, ScreenMetric, ViewError};
use crate::field::HeightField;
use crate::space::{Cell, Datum, View};
use glam::DVec2;
use page::{Asked, DEPTH, Page, SEAMS, SIDE, UNKNOWN, halve};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use stage::Rows;
use walk::{Beyond, Trail, Walk, Way};

/// Strips of triangles, page by page.
#[derive(Clone, Debug)]
pub struct Strips {
    /// Where it ends though the tolerance is not met.
    pub limits: Limits,
    /// Pages by size, the largest first.
    tiers: Vec<Tier>,
    /// Tier and number of pages, the nearest first, with their distances.
    order: Vec<(f64, u32, u32)>,
    /// At least one.
    walked: Vec<Walked>,
}

/// Pages of one size.
#[derive(Clone, Debug, Default)]
struct Tier {
    depth: u8,
    /// Those in use, and others that wait for their turn.
    pages: Vec<Page>,
    used: usize,
    index: FxHashMap<[u32; 2], u32>,
    /// Pages by how doubtful their bounds are (pixels).
    doubts: Vec<(f32, usize)>,
    /// The last level of which anything is cut, page by page, while neighbours cut each other.
    lasts: Vec<u8>,
}

/// Sides of a page, and which is beyond them.
const SOUTH: usize = 0;
const EAST: usize = 1;
const NORTH: usize = 2;
const WEST: usize = 3;
const BESIDE: [(i32, i32); 4] = [(0, -1), (1, 0), (0, 1), (-1, 0)];

/// What a walk brings home.
#[derive(Clone, Debug, Default)]
struct Walked {
    way: Way,
    trail: Trail,
    vertices: Vec<Vertex>,
    ends: Vec<u32>,
}

/// Pages fewer than these are not worth other threads.
const FEW: usize = 64;

/// One page of so many is asked first where there may be too many triangles.
const SOME: usize = 16;

impl Tier {
    fn clear(&mut self, depth: u8) {
        self.depth = depth;
        self.used = 0;
        self.index.clear();
    }

    /// The page over a cell, made if it is not there.
    fn page(&mut self, cell: Cell) -> &mut Page {
        let Tier { depth, pages, used, index, .. } = self;
        let number = *index.entry([cell.x, cell.y]).or_insert_with(|| {
            match pages.get_mut(*used) {
                Some(page) => page.turn(cell, *depth),
                None => pages.push(Page::of(cell, *depth)),
            }
            *used += 1;
            *used as u32 - 1
        });
        &mut pages[number as usize]
    }

    /// The pages in use.
    fn pages(&self) -> &[Page] {
        &self.pages[..self.used]
    }

    fn find(&self, x: u32, y: u32) -> Option<&Page> {
        self.index.get(&[x, y]).map(|&number| &self.pages[number as usize])
    }

    /// Raises the greatest bound (pixels) by what was in doubt: the most doubtful pages first, until none may raise it.
    fn resolve(&mut self, asked: &Asked, mut worst: f32) -> f32 {
        let mut doubts = std::mem::take(&mut self.doubts);
        doubts.clear();
        let pages = self.pages().iter().enumerate();
        doubts.extend(pages.filter(|(_, page)| page.doubt > worst).map(|(number, page)| (page.doubt, number)));
        doubts.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut rows = Rows::default();
        for &(doubt, number) in &doubts {
            if doubt <= worst {
                break;
            }
            worst = self.pages[number].resolve(asked, &mut rows).max(worst);
        }
        self.doubts = doubts;
        worst
    }

    /// Does something with every page, on several threads if there are many.
    fn each<T: Send>(
        &mut self,
        work: impl Fn(&mut Page, &mut Rows) -> T + Sync + Send,
        join: fn(T, T) -> T,
    ) -> Option<T> {
        let some = |pages: &mut [Page]| {
            let mut rows = Rows::default();
            pages.iter_mut().map(|page| work(page, &mut rows)).reduce(join)
        };
        let pages = &mut self.pages[..self.used];
        if pages.len() < FEW || rayon::current_num_threads() == 1 {
            some(pages)
        } else {
            pages.par_chunks_mut(FEW / 4).filter_map(some).reduce_with(join)
        }
    }
}

impl Strips {
    /// The method within limits.
    pub fn new(limits: Limits) -> Strips {
        Strips { limits, tiers: Vec::new(), order: Vec::new(), walked: vec![Walked::default()] }
    }

    /// Cuts what `tolerance` asks for, and what neighbours then need; the bound reached (pixels) and the number of cells, or, if that takes more
    /// triangles than allowed, about how many cells it would have been.
    fn refine(
        &mut self,
        field: &dyn HeightField,
        metric: &ScreenMetric,
        tolerance: f32,
    ) -> Result<(f32, usize), usize> {
        let finest = self.limits.finest.min(Cell::MAX_LEVEL);
        let asked = Asked::new(field, metric, tolerance, finest);
        // Pages end at the finest level; the first takes what is left above them.
        let tiers = usize::from(finest.div_ceil(DEPTH));
        self.tiers.resize_with(tiers, Tier::default);
        for (i, tier) in self.tiers.iter_mut().enumerate() {
            tier.clear(if i == 0 { finest - DEPTH * (tiers as u8 - 1) } else { DEPTH });
        }
        let face = Cell::face(0);
        let mut worst = SEAMS * metric.cell(field, face, field.error(face)).map_or(0.0, |(_, pixels)| pixels);
        if worst <= tolerance || finest == 0 {
            return Ok((worst, 1));
        }
        self.tiers[0].page(face);
        worst = 0.0;
        // A page has at least three cells that are seen, or nearly so: pages that would be too many are not made.
        let (mut leaves, most) = (0, self.limits.triangles.max(64) / 3 * 2);
        for i in 0..tiers {
            let (coarse, fine) = self.tiers.split_at_mut(i + 1);
            let tier = &mut coarse[i];
            let refine = |page: &mut Page, rows: &mut Rows| {
                let bound = page.refine(&asked, rows);
                (bound, page.count(), page.below())
            };
            let join = |a: (f32, usize, usize), b: (f32, usize, usize)| (a.0.max(b.0), a.1 + b.1, a.2 + b.2);
            // What is far too much is known from a part of the pages.
            if tier.used * SIDE * SIDE * 2 > self.limits.triangles && tier.used > SOME * FEW {
                let mut rows = Rows::default();
                let some = tier.pages[..tier.used].iter_mut().skip(SOME / 2).step_by(SOME);
                let some = some.map(|page| refine(page, &mut rows)).reduce(join).unwrap_or_default();
                let about = leaves + SOME * (some.1 + 3 * some.2);
                if about > most / 8 * 10 {
                    return Err(about);
                }
            }
            let (bound, drawn, pages) = tier.each(refine, join).unwrap_or_default();
            worst = tier.resolve(&asked, bound.max(worst));
            leaves += drawn;
            if leaves + 3 * pages > most {
                return Err(leaves + 3 * pages);
            }
            if let Some(fine) = fine.first_mut() {
                tier.pages().iter().for_each(|page| for_bits(page, |cell| _ = fine.page(cell)));
            }
        }
        self.balance();
        let mut cells = 0;
        for tier in &mut self.tiers {
            let settle = |page: &mut Page, rows: &mut Rows| {
                page.settle(&asked, rows);
                page.count()
            };
            cells += tier.each(settle, |a, b| a + b).unwrap_or(0);
        }
        if 2 * cells > self.limits.triangles && cells > 4 { Err(cells) } else { Ok((worst, cells)) }
    }

    /// Refines as far as the tolerance asks and the limits allow; the bound reached (pixels).
    fn fit(&mut self, field: &dyn HeightField, metric: &ScreenMetric) -> f32 {
        let most = self.limits.triangles.max(8);
        // Most of what is allowed: a guess that is meant to fit should not just fail to.
        let aim = most as f64 * 0.94;
        // The finest bound that is known to be too fine and the coarsest one that fits, with the triangles they take.
        let (mut fine, mut fits) = (None::<(f64, f64)>, None::<(f64, f64)>);
        let (mut guess, mut reached, mut stands) = (f64::from(metric.tolerance()), 0.0, true);
        for tries in 0.. {
            match self.refine(field, metric, guess as f32) {
                Ok((pixels, cells)) => {
                    fits = Some((guess, 2.0 * cells.max(1) as f64));
                    (reached, stands) = (pixels, true);
                }
                Err(cells) => {
                    fine = Some((guess, 2.0 * cells.max(1) as f64));
                    stands = false;
                }
            }
            // Between two bounds triangles are about a power of the bound; from one they are guessed to be as its inverse, or somewhat steeper.
            guess = match (fine, fits) {
                (None, _) => return reached,
                (Some((bound, count)), None) => bound * (count / aim).powf(0.7).clamp(1.05, 10.0),
                (Some(fine), Some(fits)) => {
                    if fits.1 >= most as f64 * 0.875 || tries > 8 || fits.0 < fine.0 * 1.001 {
                        break;
                    }
                    let share = (fine.1.max(aim * 1.01) / aim).ln() / (fine.1.max(aim * 1.01) / fits.1).ln();
                    fine.0 * (fits.0 / fine.0).powf(share.clamp(0.1, 0.9))
                }
            };
        }
        if let (false, Some((bound, _))) = (stands, fits) {
            _ = self.refine(field, metric, bound as f32);
        }
        reached
    }

    /// Cuts more until neighbours differ by one level at most.
    fn balance(&mut self) {
        for i in (0..self.tiers.len()).rev() {
            let (coarse, fine) = self.tiers.split_at_mut(i + 1);
            let tier = &mut coarse[i];
            // What lies below a page is cut.
            if let Some(fine) = fine.first() {
                let up = tier.depth;
                for page in fine.pages() {
                    let (x, y) = (page.cell.x, page.cell.y);
                    let above = Cell { level: page.cell.level - up, x: x >> up, y: y >> up, ..page.cell };
                    let mask = (1u32 << up) - 1;
                    tier.page(above).mark(up, y & mask, 1 << (x & mask));
                }
            }
            let Tier { pages, used, lasts, .. } = tier;
            lasts.clear();
            lasts.extend(pages[..*used].iter().map(|page| page.last));
            for level in (1..=tier.depth).rev() {
                let mut number = 0;
                while number < tier.used {
                    if tier.lasts[number] >= level {
                        tier.grow(number, level);
                    }
                    number += 1;
                }
            }
        }
    }
}

/// The cells of a page's last level that are cut.
fn for_bits(page: &Page, mut each: impl FnMut(Cell)) {
    for y in 0..1u32 << page.depth {
        let mut bits = page.cut[page::row(page.depth, y)];
        while bits != 0 {
            let x = bits.trailing_zeros();
            bits &= bits - 1;
            let level = page.cell.level + page.depth;
            each(Cell { level, x: (page.cell.x << page.depth) + x, y: (page.cell.y << page.depth) + y, ..page.cell });
        }
    }
}

impl Tier {
    /// Cuts the parents of all that lies beside what is cut on a level of a page.
    fn grow(&mut self, number: usize, level: u8) {
        let side = 1u32 << level;
        let all = u64::MAX >> (64 - side);
        let cell = self.pages[number].cell;
        let cells = 1u32 << cell.level;
        let half = side / 2;
        // Rows with a cut cell at the western and at the eastern side.
        let (mut western, mut eastern) = (0, 0);
        for y in 0..side {
            let page = &mut self.pages[number];
            let bits = page.cut[page::row(level, y)];
            if bits == 0 {
                continue;
            }
            page.mark(level - 1, y >> 1, halve((bits | bits << 1 | bits >> 1) & all));
            for beyond in [y.checked_sub(1), Some(y + 1).filter(|&y| y < side)].into_iter().flatten() {
                page.mark(level - 1, beyond >> 1, halve(bits));
            }
            if y == 0 && cell.y > 0 {
                self.mark(number, SOUTH, level - 1, half - 1, halve(bits));
            }
            if y == side - 1 && cell.y + 1 < cells {
                self.mark(number, NORTH, level - 1, 0, halve(bits));
            }
            western |= (bits & 1) << y;
            eastern |= (bits >> (side - 1) & 1) << y;
        }
        let west = Some((WEST, western, half - 1)).filter(|_| cell.x > 0);
        let east = Some((EAST, eastern, 0)).filter(|_| cell.x + 1 < cells);
        for (side, rows, column) in [west, east].into_iter().flatten().filter(|&(_, rows, _)| rows != 0) {
            let rows = halve(rows);
            (0..half).filter(|y| rows >> y & 1 == 1).for_each(|y| self.mark(number, side, level - 1, y, 1 << column));
        }
    }

    /// Cuts cells of the page beside one, made if it is not there.
    fn mark(&mut self, number: usize, side: usize, level: u8, y: u32, bits: u64) {
        let Page { cell, beside, .. } = self.pages[number];
        let mut other = beside[side] as usize;
        if beside[side] == UNKNOWN {
            let (i, j) = BESIDE[side];
            let (x, y) = (cell.x.wrapping_add_signed(i), cell.y.wrapping_add_signed(j));
            self.page(Cell { x, y, ..cell });
            let found = self.index[&[x, y]];
            self.pages[number].beside[side] = found;
            self.pages[found as usize].beside[(side + 2) % 4] = number as u32;
            other = found as usize;
            self.lasts.resize(self.used, 0);
        }
        self.pages[other].mark(level, y, bits);
        self.lasts[other] = self.pages[other].last;
    }
}

impl Default for Strips {
    fn default() -> Strips {
        Strips::new(Limits::default())
    }
}

impl Lod for Strips {
    fn select(&mut self, field: &dyn HeightField, view: &View, drawing: &mut Drawing) -> Result<Reached, ViewError> {
        let metric = ScreenMetric::on_plane(view, field.datum())?;
        drawing.clear();
        if metric.cell(field, Cell::face(0), 0.0).is_none() {
            return Ok(Reached { pixels: 0.0, limited: false });
        }
        let pixels = self.fit(field, &metric);
        self.walk(field, &metric, view, drawing);
        Ok(Reached { pixels, limited: pixels > metric.tolerance() })
    }
}

impl Strips {
    /// Walks over all pages, the nearest first.
    fn walk(&mut self, field: &dyn HeightField, metric: &ScreenMetric, view: &View, drawing: &mut Drawing) {
        let (origin, size) = match field.datum() {
            Datum::Plane { origin, size } => (origin, size),
            Datum::Ellipsoid { .. } => (DVec2::ZERO, DVec2::ONE),
        };
        let turned = metric.lens().0.y < 0.0;
        let eye = (view.eye.truncate() - origin) / size;
        self.order.clear();
        for (i, tier) in self.tiers.iter().enumerate() {
            for (number, page) in tier.pages().iter().enumerate() {
                let (low, side) = (page.cell.low_corner().uv, page.cell.side());
                let away = (eye - eye.clamp(low, low + side)) * size;
                self.order.push((away.length_squared(), i as u32, number as u32));
            }
        }
        self.order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        if self.order.is_empty() {
            // One cell is all there is.
            if field.error(Cell::face(0)).is_finite() {
                let corners = [[0, STEPS], [0, 0], [STEPS, STEPS], [STEPS, 0]];
                drawing.strips.push(4);
                field.raise(0, &corners, &mut drawing.mesh.vertices);
            }
            return;
        }
        let (tiers, order) = (&self.tiers, &self.order);
        if order.len() < FEW || rayon::current_num_threads() == 1 {
            let Drawing { mesh, strips, .. } = drawing;
            self.walked[0].pages(tiers, order, turned, field, &mut mesh.vertices, strips);
            return;
        }
        // Parts of what is walked over, a few for each thread, that are put together in order.
        let parties = 4 * rayon::current_num_threads();
        let together = order.len().div_ceil(parties);
        self.walked.resize_with(parties.max(self.walked.len()), Walked::default);
        let parties = order.len().div_ceil(together);
        self.walked.par_iter_mut().zip(order.par_chunks(together)).for_each(|(walked, pages)| {
            let (mut vertices, mut ends) = (std::mem::take(&mut walked.vertices), std::mem::take(&mut walked.ends));
            vertices.clear();
            ends.clear();
            walked.pages(tiers, pages, turned, field, &mut vertices, &mut ends);
            (walked.vertices, walked.ends) = (vertices, ends);
        });
        for walked in &self.walked[..parties] {
            let base = drawing.mesh.vertices.len() as u32;
            drawing.mesh.vertices.extend_from_slice(&walked.vertices);
            drawing.strips.extend(walked.ends.iter().map(|end| base + end));
        }
    }
}

impl Walked {
    /// Walks over pages and adds what it finds.
    fn pages(
        &mut self,
        tiers: &[Tier],
        pages: &[(f64, u32, u32)],
        turned: bool,
        field: &dyn HeightField,
        vertices: &mut Vec<Vertex>,
        ends: &mut Vec<u32>,
    ) {
        self.trail.clear();
        for (i, &(_, tier, number)) in pages.iter().enumerate() {
            let face = self.page(tiers, [tier, number].map(|i| i as usize), turned);
            if !self.trail.is_enough() && i + 1 < pages.len() {
                continue;
            }
            let (points, strips) = self.trail.strips();
            let begun = vertices.len() as u32;
            ends.extend(strips.iter().map(|end| begun + end));
            field.raise(face, points, vertices);
            for sliver in self.trail.slivers() {
                field.raise(face, sliver, vertices);
                ends.push(vertices.len() as u32);
            }
            self.trail.clear();
        }
    }

    /// Walks over a page.
    fn page(&mut self, tiers: &[Tier], [tier, number]: [usize; 2], turned: bool) -> u8 {
        let page = &tiers[tier].pages[number];
        let Cell { x, y, level, face } = page.cell;
        let beyond = [SOUTH, EAST, NORTH, WEST].map(|side| {
            if page.beside[side] != UNKNOWN {
                return Beyond { page: Some(&tiers[tier].pages[page.beside[side] as usize]), cell: false };
            }
            let (i, j) = BESIDE[side];
            let [x, y] = [i64::from(x) + i64::from(i), i64::from(y) + i64::from(j)];
            if !(0..1i64 << level).contains(&x) || !(0..1i64 << level).contains(&y) {
                return Beyond::default();
            }
            let (x, y) = (x as u32, y as u32);
            let page = tiers[tier].find(x, y);
            let cell = page.is_none() && tier > 0 && {
                let up = tiers[tier - 1].depth;
                let mask = (1u32 << up) - 1;
                let above = tiers[tier - 1].find(x >> up, y >> up);
                above.is_some_and(|above| above.drawn[page::row(up, y & mask)] >> (x & mask) & 1 == 1)
            };
            Beyond { page, cell }
        });
        self.way.load(page, &beyond, turned);
        let side = STEPS >> level;
        let corner = [x, y].map(|at| (at + u32::from(turned)) * side);
        let side = if turned { side.wrapping_neg() } else { side };
        Walk { way: &self.way, trail: &mut self.trail, corner, side }.run();
        face
    }
}
