//! The march: waves carried over a bed from row to row, with refraction, shoaling, diffraction and breaking.
//!
//! Waves of one frequency over a gently sloping bed obey the mild-slope equation (J. Berkhoff 1972), which for ψ = φ √(c c_g) is
//! ∇²ψ + k²ψ = 0 (A. Radder 1979). The waves that run forward obey ∂ψ/∂y = i √(k² + ∂²/∂x²) ψ, whose root is approximated by a fraction
//! (J. Claerbout 1976; A. Bamberger et al. 1988), here about the direction that Snell's law gives each wave on a bed without change across the
//! march: with ψ = b e^{iκx + i∫p dy} / √p and p = √(k² − κ²),
//!
//! ∂b/∂y = i p^½ Σₙ aₙW / (1 + bₙW) p^½ b,  W = p⁻¹ (∂²/∂x² + 2iκ ∂/∂x) p⁻¹.
//!
//! W is 0 for the wave itself and stays small while it turns little. Each term is one tridiagonal system a row (J. Crank, P. Nicolson 1947);
//! written so, the step is a rotation and keeps Σ|b|², the flux of energy, to rounding. Waves that do not run (|W| large) are made to die
//! out by an imaginary part of bₙ: small everywhere, larger beside land, which sets them off.
//!
//! Sixteen waves march in step, one a lane. Where all waves together are higher than the depth allows they are lowered to that, and stay so.

use super::lanes::{Complex, LANES, Lanes, angle, inverse, sine_cosine};
use multiversion::multiversion;

/// Steps of the tables over depth.
pub(super) const STEPS: usize = 512;
/// How many units the amplitude of the incoming wave has; eight times that is the most that can be told.
pub(super) const UNITS: f32 = 8192.0;

/// Terms of the fraction for √(1+W) − 1: aₙ = ⅖ sin² (nπ/5), bₙ = cos² (nπ/5), and the imaginary part of bₙ far from land. That makes waves
/// that have turned by 30° from where Snell's law would have them lose 0.3 % of their amplitude in a wavelength, and by 45° 1.4 %; with less,
/// those that should not run at all cross the whole grid.
const TERMS: [(f32, f32, f32); 2] = [(0.138_196_6, 0.654_508_5, 0.02), (0.361_803_4, 0.095_491_5, 0.008)];
/// How much more of it beside land.
const BESIDE_LAND: f32 = 0.2;

/// What waves of a batch are at a node, relative to themselves in the open: phase (2⁻¹⁶ turns) and amplitude (1/[`UNITS`]).
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Record {
    pub(super) phase: [i16; LANES],
    pub(super) amplitude: [u16; LANES],
}

impl Record {
    pub(super) const OPEN: Record = Record { phase: [0; LANES], amplitude: [8192; LANES] };
    pub(super) const NONE: Record = Record { phase: [0; LANES], amplitude: [0; LANES] };
}

/// Sixteen waves that march in the same direction.
pub(super) struct Waves {
    /// Over s (see [`Node::s`]): p·s, p^−½, and s times the amplitude that waves of one flux have, which is 1 in the open.
    pub(super) table: Vec<[Lanes; 3]>,
    /// Part of the wave number across the march (rad/m), which Snell's law keeps.
    pub(super) across: Lanes,
    /// Part along the march in the open (rad/m).
    pub(super) along: Lanes,
    /// Half the square of the amplitude in the open (m²).
    pub(super) energy: Lanes,
}

impl Waves {
    pub(super) fn new() -> Waves {
        Waves { table: vec![[Lanes::ONE; 3]; STEPS + 2], across: Lanes::ZERO, along: Lanes::ONE, energy: Lanes::ZERO }
    }
}

/// A node of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Node {
    /// Depth as √(h / (h + scale)), in (0, 1].
    pub(super) s: f32,
    /// How near land is, in [0, 1]; above 1 on land.
    pub(super) near: f32,
    /// How much the waves are drawn towards those of the open sea in a step, in [0, 1].
    pub(super) draw: f32,
    /// How much of what is told is the open sea, in [0, 1].
    pub(super) open: f32,
    /// Most energy (m²) that the depth bears; infinity off the bed.
    pub(super) cap: f32,
    /// Energy (m²) of the waves that march in other batches.
    pub(super) others: f32,
}

/// What a march leaves at a node, all waves of the batch together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Told {
    /// Energy (m²): half the sum of the squares of the amplitudes.
    pub(super) energy: f32,
    /// Energy (m²) the waves would bring to deep water, had none broken.
    pub(super) unbroken: f32,
}

/// What a step works on at a node.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Site {
    /// p, and its square root.
    p: Lanes,
    root: Lanes,
    /// b p^−½.
    u: Complex,
    /// After elimination: the unknown here is `known` less `slope` times that of the next node towards the middle.
    known: Complex,
    slope: Complex,
    /// 1 / |q⁻|².
    part: Lanes,
}

impl Site {
    const NONE: Site = Site {
        p: Lanes::ONE,
        root: Lanes::ONE,
        u: Complex::ZERO,
        known: Complex::ZERO,
        slope: Complex::ZERO,
        part: Lanes::ONE,
    };
}

/// A march: one row of waves, and what is needed to go to the next.
#[derive(Default)]
pub(super) struct March {
    /// Waves, relative to those in the open.
    pub(super) b: Vec<Complex>,
    /// Which part of the energy has not broken.
    pub(super) whole: Vec<f32>,
    sites: Vec<Site>,
    /// What is told of the waves at each node: [`Record`]s, with phase and amplitude of a wave in the lower and the upper half of its bits.
    pub(super) records: Vec<[u32; LANES]>,
    pub(super) told: Vec<Told>,
}

impl March {
    /// Starts with the waves of the open sea on a row of `nodes`.
    pub(super) fn start(&mut self, nodes: usize) {
        fn fill<T: Clone>(list: &mut Vec<T>, nodes: usize, value: T) {
            list.clear();
            list.resize(nodes, value);
        }
        fill(&mut self.b, nodes, Complex::ONE);
        fill(&mut self.whole, nodes, 1.0);
        fill(&mut self.sites, nodes, Site::NONE);
        fill(&mut self.records, nodes, [0; LANES]);
        fill(&mut self.told, nodes, Told::default());
    }
}

/// Where in the tables a depth is: the entry below, and how far on to the next.
#[inline(always)]
pub(super) fn entry(s: f32) -> (usize, f32) {
    let at = s * STEPS as f32;
    let index = (at as usize).min(STEPS - 1);
    (index, at - index as f32)
}

/// Lets the waves of a row break where they are too high, and tells them.
///
/// `share` is how many times the energy of this batch all batches have, where that is not told by the nodes. `records` says whether the waves
/// themselves are told, too.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn settle(march: &mut March, waves: &Waves, row: &[Node], share: f32, records: bool) {
    let n = row.len();
    let b = &mut march.b[..n];
    let tell = records;
    let (whole, records, told) = (&mut march.whole[..n], &mut march.records[..n], &mut march.told[..n]);
    let open_energy = waves.energy;
    for j in 0..n {
        let node = row[j];
        if node.near > 1.0 {
            b[j] = Complex::ZERO;
            records[j] = [0; LANES];
            told[j] = Told { energy: 0.0, unbroken: 0.0 };
            continue;
        }
        let (index, f) = entry(node.s);
        let (low, high) = (waves.table[index][2], waves.table[index + 1][2]);
        let over = 1.0 / node.s;
        let mut z = b[j];
        let (mut re, mut im, mut own) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
        let (mut energies, mut fluxes) = ([0.0f32; LANES], [0.0f32; LANES]);
        for l in 0..LANES {
            let gain = f.mul_add(high.0[l] - low.0[l], low.0[l]) * over;
            (re[l], im[l]) = (z.re[l] * gain, z.im[l] * gain);
            let square = z.re[l].mul_add(z.re[l], z.im[l] * z.im[l]);
            own[l] = square * (gain * gain);
            energies[l] = own[l] * open_energy.0[l];
            fluxes[l] = square * open_energy.0[l];
        }
        let (energy, flux) = (sum(&energies), sum(&fluxes));
        let all = energy.mul_add(share, node.others);
        let mut lower = 1.0;
        if all > node.cap {
            lower = (node.cap / all).sqrt();
            for l in 0..LANES {
                z.re[l] *= lower;
                z.im[l] *= lower;
            }
            b[j] = z;
        }
        told[j] = Told { energy: energy * lower * lower, unbroken: flux / whole[j].max(1e-4) };
        whole[j] *= lower * lower;
        if !tell {
            continue;
        }
        let (mut amplitude, mut phase) = ([0i32; LANES], [0i32; LANES]);
        if node.open > 0.0 {
            // Towards the rim the open sea takes over, by energy: waves that are out of step with it must not cancel it.
            let (c, o) = ((1.0 - node.open) * lower, node.open);
            for l in 0..LANES {
                let (x, y) = (re[l].mul_add(c, o), im[l] * c);
                let length = x.mul_add(x, y * y).sqrt();
                let wanted = (own[l] * lower * lower).mul_add(1.0 - o, o).sqrt();
                amplitude[l] = whole_number((wanted.min(2.0 * length) * UNITS).min(65_535.0));
                phase[l] = whole_number(angle(x, y) * 65_536.0);
            }
        } else {
            let units = lower * UNITS;
            for l in 0..LANES {
                amplitude[l] = whole_number((own[l].sqrt() * units).min(65_535.0));
                phase[l] = whole_number(angle(re[l], im[l]) * 65_536.0);
            }
        }
        for l in 0..LANES {
            records[j][l] = (amplitude[l] << 16 | phase[l] & 0xFFFF).cast_unsigned();
        }
    }
}

/// The nearest whole number, for magnitudes below 2²²: its bits stand at the end of the sum's.
#[inline(always)]
fn whole_number(x: f32) -> i32 {
    ((x + 12_582_912.0).to_bits() as i32).wrapping_sub(0x4B40_0000)
}

/// Sum of sixteen numbers, in a fixed order that suits wide registers.
#[inline(always)]
pub(super) fn sum(x: &[f32; LANES]) -> f32 {
    let mut a = [0.0f32; 8];
    for l in 0..8 {
        a[l] = x[l] + x[l + 8];
    }
    let b = [a[0] + a[4], a[1] + a[5], a[2] + a[6], a[3] + a[7]];
    (b[0] + b[2]) + (b[1] + b[3])
}

/// A term of the fraction, on a grid.
struct Term {
    /// bₙ, and its square.
    b: f32,
    square: f32,
    /// Half of aₙ times the step.
    d: f32,
    /// The imaginary part of bₙ far from land.
    least: f32,
    /// 1 / (distance of nodes)².
    steep: f32,
    /// steep² + drift².
    zz: Lanes,
}

impl Term {
    #[inline(always)]
    fn damping(&self, node: &Node) -> f32 {
        node.near.min(1.0).mul_add(BESIDE_LAND, self.least)
    }
}

/// D = p² / q⁻ at a node, with 1 / |q⁻|²; q⁻ = bₙ − i (δ + d p).
#[inline(always)]
fn diagonal(site: &Site, term: &Term, damping: f32) -> (Complex, Lanes) {
    let (mut to, mut part) = (Complex::ZERO, Lanes::ZERO);
    for l in 0..LANES {
        let p = site.p.0[l];
        let i = term.d.mul_add(p, damping);
        part.0[l] = inverse(i.mul_add(i, term.square));
        let size = p * p * part.0[l];
        (to.re[l], to.im[l]) = (size * term.b, size * i);
    }
    (to, part)
}

/// One node of the elimination, given the reciprocal of the diagonal and the `known` of the node before; tells its own. `drift` is
/// that of the side from which the elimination comes.
#[inline(always)]
fn eliminate(
    site: &mut Site,
    node: &Node,
    term: &Term,
    drift: &Lanes,
    before: &(Complex, Complex),
) -> (Complex, Complex) {
    let (own, part) = diagonal(site, term, term.damping(node));
    let (chain, last, u) = (before.0, before.1, site.u);
    let (mut to_chain, mut to, mut slope) = (Complex::ZERO, Complex::ZERO, Complex::ZERO);
    for l in 0..LANES {
        let (drift, zz) = (drift.0[l], term.zz.0[l]);
        let re = (-zz).mul_add(chain.re[l], own.re[l] - 2.0 * term.steep);
        let im = (-zz).mul_add(chain.im[l], own.im[l]);
        let over = 1.0 / re.mul_add(re, im * im);
        let (cr, ci) = (re * over, -(im * over));
        // i D u less the node before times steep − i drift.
        let xr = -own.re[l].mul_add(u.im[l], own.im[l] * u.re[l]);
        let xi = own.re[l].mul_add(u.re[l], -(own.im[l] * u.im[l]));
        let xr = (-drift).mul_add(last.im[l], (-term.steep).mul_add(last.re[l], xr));
        let xi = drift.mul_add(last.re[l], (-term.steep).mul_add(last.im[l], xi));
        (to_chain.re[l], to_chain.im[l]) = (cr, ci);
        to.re[l] = xr.mul_add(cr, -(xi * ci));
        to.im[l] = xr.mul_add(ci, xi * cr);
        // What the node after is taken times: steep + i drift.
        slope.re[l] = cr.mul_add(term.steep, -(ci * drift));
        slope.im[l] = cr.mul_add(drift, ci * term.steep);
    }
    (site.part, site.known, site.slope) = (part, to, slope);
    (to_chain, to)
}

/// The unknown at a node, given that of the node after; and the step of the waves there.
#[inline(always)]
fn substitute(site: &mut Site, node: &Node, term: &Term, after: &Complex) -> Complex {
    let (known, slope) = (site.known, site.slope);
    let mut to = Complex::ZERO;
    for l in 0..LANES {
        let (ar, ai) = (after.re[l], after.im[l]);
        to.re[l] = slope.im[l].mul_add(ai, (-slope.re[l]).mul_add(ar, known.re[l]));
        to.im[l] = (-slope.im[l]).mul_add(ar, (-slope.re[l]).mul_add(ai, known.im[l]));
    }
    turn(site, node, term, &to);
    to
}

/// u' = u + 2 d p (i u − y) / q⁻.
#[inline(always)]
fn turn(site: &mut Site, node: &Node, term: &Term, y: &Complex) {
    let (p, part, u) = (site.p, site.part, site.u);
    let damping = term.damping(node);
    let mut to = Complex::ZERO;
    for l in 0..LANES {
        let i = term.d.mul_add(p.0[l], damping);
        let size = 2.0 * term.d * p.0[l] * part.0[l];
        let (re, im) = (size * term.b, size * i);
        let (er, ei) = (-u.im[l] - y.re[l], u.re[l] - y.im[l]);
        to.re[l] = (-im).mul_add(ei, re.mul_add(er, u.re[l]));
        to.im[l] = im.mul_add(er, re.mul_add(ei, u.im[l]));
    }
    site.u = to;
}

/// i u: the unknown where waves do not change.
#[inline(always)]
fn unchanged(site: &Site) -> Complex {
    let mut to = Complex::ZERO;
    for l in 0..LANES {
        (to.re[l], to.im[l]) = (-site.u.im[l], site.u.re[l]);
    }
    to
}

/// One term of a step, for waves that stay as they are at both ends: (D + Z) y = i D u, from both ends to the middle and back.
#[inline(always)]
fn solve(sites: &mut [Site], row: &[Node], term: &Term, drift: &Lanes) {
    let ([first, sites @ .., end], [_, row @ .., _]) = (sites, row) else { return };
    let mut opposite = Lanes::ZERO;
    for l in 0..LANES {
        opposite.0[l] = -drift.0[l];
    }
    let half = sites.len() / 2;
    let (left, right) = sites.split_at_mut(half);
    let (left_row, right_row) = row.split_at(half);
    let ([middle, right @ ..], [middle_node, right_row @ ..]) = (right, right_row) else { return };
    let (mut up, mut down) = ((Complex::ZERO, unchanged(first)), (Complex::ZERO, unchanged(end)));
    // The left part may be the longer one, by one.
    let more = left.len() - right.len();
    if more > 0 {
        up = eliminate(&mut left[0], &left_row[0], term, drift, &up);
    }
    let both = left[more..].iter_mut().zip(&left_row[more..]).zip(right.iter_mut().zip(right_row).rev());
    for ((a, a_node), (b, b_node)) in both {
        up = eliminate(a, a_node, term, drift, &up);
        down = eliminate(b, b_node, term, &opposite, &down);
    }
    // In the middle the two meet.
    let (own, part) = diagonal(middle, term, term.damping(middle_node));
    let mut y = Complex::ZERO;
    for l in 0..LANES {
        let (zz, drift) = (term.zz.0[l], drift.0[l]);
        let re = own.re[l] - 2.0 * term.steep - zz * (up.0.re[l] + down.0.re[l]);
        let im = own.im[l] - zz * (up.0.im[l] + down.0.im[l]);
        let over = 1.0 / re.mul_add(re, im * im);
        let (cr, ci) = (re * over, -(im * over));
        let (ur, ui) = (middle.u.re[l], middle.u.im[l]);
        let (sr, si) = (up.1.re[l] + down.1.re[l], up.1.im[l] + down.1.im[l]);
        let (tr, ti) = (down.1.re[l] - up.1.re[l], down.1.im[l] - up.1.im[l]);
        let xr = -own.re[l].mul_add(ui, own.im[l] * ur) - term.steep * sr + drift * ti;
        let xi = own.re[l].mul_add(ur, -(own.im[l] * ui)) - term.steep * si - drift * tr;
        y.re[l] = xr.mul_add(cr, -(xi * ci));
        y.im[l] = xr.mul_add(ci, xi * cr);
    }
    middle.part = part;
    turn(middle, middle_node, term, &y);
    let (mut up, mut down) = (y, y);
    let both = left[more..].iter_mut().zip(&left_row[more..]).rev().zip(right.iter_mut().zip(right_row));
    for ((a, a_node), (b, b_node)) in both {
        up = substitute(a, a_node, term, &up);
        down = substitute(b, b_node, term, &down);
    }
    if more > 0 {
        substitute(&mut left[0], &left_row[0], term, &up);
    }
}

/// How many nodes inland what is solved for is followed, where nothing of it is left.
const INLAND: usize = 16;

/// The next stretch of a row, from a node on, that has water or is near some.
#[inline(always)]
fn stretch(row: &[Node], from: usize) -> Option<(usize, usize)> {
    let first = from + row[from..].iter().position(|node| node.near <= 1.0)?;
    let mut last = first;
    for (j, node) in row.iter().enumerate().skip(first) {
        if node.near <= 1.0 {
            last = j;
        } else if j > last + 2 * INLAND {
            break;
        }
    }
    Some((first.saturating_sub(INLAND).max(from), (last + INLAND + 1).min(row.len())))
}

/// Takes the waves of a row to the next one, `forward` (m) on; nodes are `apart` (m). `row` holds the nodes midway.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn advance(march: &mut March, waves: &Waves, row: &[Node], forward: f32, apart: f32) {
    step(march, waves, row, forward, apart);
}

#[inline(always)]
fn step(march: &mut March, waves: &Waves, row: &[Node], forward: f32, apart: f32) {
    let n = row.len();
    let steep = 1.0 / (apart * apart);
    let (mut drift, mut zz) = (Lanes::ZERO, Lanes::ZERO);
    for l in 0..LANES {
        let across = waves.across.0[l] / apart;
        (drift.0[l], zz.0[l]) = (across, steep.mul_add(steep, across * across));
    }
    let mut from = 0;
    // Land is left out: nothing runs there, and what is left of the unknowns would be too small for quick arithmetic.
    while let Some((first, end)) = stretch(row, from) {
        let (b, sites, row) = (&mut march.b[first..end], &mut march.sites[first..end], &row[first..end]);
        prepare(b, sites, row, waves);
        for (a, b, least) in TERMS {
            solve(sites, row, &Term { b, square: b * b, d: 0.5 * a * forward, least, steep, zz }, &drift);
        }
        finish(b, sites, row, waves, forward);
        from = end;
    }
    (march.b[0], march.b[n - 1]) = (Complex::ONE, Complex::ONE);
    // What has not broken spreads a little, as the waves do.
    let whole = &mut march.whole[..n];
    let mut before = whole[0];
    for j in 1..n - 1 {
        let here = whole[j];
        let mixed = 0.25 * (before + 2.0 * here + whole[j + 1]);
        whole[j] = mixed + (1.0 - mixed) * row[j].draw;
        before = here;
    }
}

/// p and u from the tables and b.
#[inline(always)]
fn prepare(b: &[Complex], sites: &mut [Site], row: &[Node], waves: &Waves) {
    for ((node, from), site) in row.iter().zip(b).zip(sites) {
        let (index, f) = entry(node.s);
        let over = 1.0 / node.s;
        // Copies, here and elsewhere, let the compiler see that nothing overlaps.
        let ([low, low_power, _], [high, high_power, _]) = (waves.table[index], waves.table[index + 1]);
        let from = *from;
        let (mut p, mut root, mut u) = (Lanes::ZERO, Lanes::ZERO, Complex::ZERO);
        for l in 0..LANES {
            let along = f.mul_add(high.0[l] - low.0[l], low.0[l]) * over;
            // One step of Newton's method makes p^−½ of the table's exact.
            let guess = f.mul_add(high_power.0[l] - low_power.0[l], low_power.0[l]);
            let off = (-along).mul_add(guess * guess, 1.0);
            let power = (0.5 * off).mul_add(guess, guess);
            (p.0[l], root.0[l]) = (along, along * power);
            (u.re[l], u.im[l]) = (from.re[l] * power, from.im[l] * power);
        }
        (site.p, site.root, site.u) = (p, root, u);
    }
}

/// b after the step, from u.
#[inline(always)]
fn finish(b: &mut [Complex], sites: &[Site], row: &[Node], waves: &Waves, forward: f32) {
    let open = waves.along;
    for ((node, site), b) in row.iter().zip(sites).zip(b) {
        let land = node.near > 1.0;
        let keep = if land { 0.0 } else { 1.0 - node.draw };
        let gain = if land { 0.0 } else { node.draw };
        let (p, root, u) = (site.p, site.root, site.u);
        let mut to = Complex::ZERO;
        for l in 0..LANES {
            let weight = root.0[l] * keep;
            let turns = (p.0[l] - open.0[l]) * forward * 0.159_154_94;
            let (s, c) = sine_cosine(turns);
            let (re, im) = (u.re[l] * weight, u.im[l] * weight);
            to.re[l] = re.mul_add(c, -(im * s)) + gain;
            to.im[l] = re.mul_add(s, im * c);
        }
        *b = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_and_plain_arithmetic_give_the_same_bits() {
        let mut waves = Waves::new();
        for (i, entry) in waves.table.iter_mut().enumerate() {
            for l in 0..LANES {
                let s = (i as f32 / STEPS as f32).max(1e-3);
                let p = 0.05 + 0.01 * l as f32 + 0.1 / s;
                (entry[0].0[l], entry[1].0[l]) = (p * s, 1.0 / p.sqrt());
                waves.across.0[l] = 0.01 * l as f32;
                waves.along.0[l] = 0.05 + 0.01 * l as f32;
            }
        }
        // Open water, a bank, land of more than twice what is followed inland, a strip of land, and each length of a stretch's remainder.
        for nodes in [2, 3, 4, 60, 61, 120] {
            let row: Vec<Node> = (0..nodes)
                .map(|j| Node {
                    s: 0.4 + 0.3 * (j as f32 * 0.2).sin(),
                    near: if (65..105).contains(&j) || j == 20 { 2.0 } else { 0.3 * (j % 3) as f32 },
                    draw: if j < 4 { 0.1 } else { 0.0 },
                    ..Node::default()
                })
                .collect();
            let (mut wide, mut plain) = (March::default(), March::default());
            wide.start(nodes);
            plain.start(nodes);
            for _ in 0..20 {
                advance(&mut wide, &waves, &row, 3.0, 4.0);
                step(&mut plain, &waves, &row, 3.0, 4.0);
            }
            assert_eq!((&wide.b, &wide.whole), (&plain.b, &plain.whole));
            let energy = |b: &Complex| b.re[3].mul_add(b.re[3], b.im[3] * b.im[3]);
            assert!(wide.b.iter().all(|b| energy(b) < 10.0 && b.im[7].is_finite()));
            assert!(nodes < 60 || (wide.b[20] == Complex::ZERO && energy(&wide.b[40]) > 0.1));
        }
    }
}
