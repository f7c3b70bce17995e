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

use super::lanes::{Complex, LANES, Lanes, angle, sine_cosine};
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
    /// k·s and c_g over s (see [`Node::s`]).
    pub(super) table: Vec<[Lanes; 2]>,
    /// Part of the wave number across the march (rad/m), which Snell's law keeps.
    pub(super) across: Lanes,
    /// Part along the march in the open (rad/m).
    pub(super) along: Lanes,
    /// Largest wave number that the grid resolves (rad/m).
    pub(super) finest: Lanes,
    /// c_g p / k in the open.
    pub(super) flux: Lanes,
    /// Half the square of the amplitude in the open (m²).
    pub(super) energy: Lanes,
}

impl Waves {
    pub(super) fn new() -> Waves {
        Waves {
            table: vec![[Lanes::ONE; 2]; STEPS + 2],
            across: Lanes::ZERO,
            along: Lanes::ONE,
            finest: Lanes::ONE,
            flux: Lanes::ONE,
            energy: Lanes::ZERO,
        }
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

/// A march: one row of waves, and what is needed to go to the next.
#[derive(Default)]
pub(super) struct March {
    /// Waves, relative to those in the open.
    pub(super) b: Vec<Complex>,
    /// Which part of the energy has not broken.
    pub(super) whole: Vec<f32>,
    p: Vec<Lanes>,
    v: Vec<Complex>,
    g: Vec<Complex>,
    inverse: Vec<Complex>,
    part: Vec<Lanes>,
    root: Vec<Lanes>,
    pub(super) records: Vec<Record>,
    pub(super) told: Vec<Told>,
}

impl March {
    /// Starts with the waves of the open sea on a row of `nodes`.
    pub(super) fn start(&mut self, nodes: usize) {
        let March { b, whole, p, v, g, inverse, part, root, records, told } = self;
        for (list, value) in [(b, Complex::ONE), (v, Complex::ZERO), (g, Complex::ZERO), (inverse, Complex::ZERO)] {
            list.clear();
            list.resize(nodes, value);
        }
        whole.clear();
        whole.resize(nodes, 1.0);
        for list in [p, part, root] {
            list.clear();
            list.resize(nodes, Lanes::ONE);
        }
        records.clear();
        records.resize(nodes, Record::NONE);
        told.clear();
        told.resize(nodes, Told::default());
    }
}

#[inline(always)]
fn entry(s: f32) -> (usize, f32) {
    let at = s * STEPS as f32;
    let index = (at as usize).min(STEPS - 1);
    (index, at - index as f32)
}

/// Lets the waves of a row break where they are too high, and tells them.
///
/// `share` is how many times the energy of this batch all batches have, where that is not told by the nodes.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn settle(march: &mut March, waves: &Waves, row: &[Node], share: f32) {
    let n = row.len();
    let b = &mut march.b[..n];
    let (whole, records, told) = (&mut march.whole[..n], &mut march.records[..n], &mut march.told[..n]);
    let (finest, across, open_flux, open_energy) = (waves.finest, waves.across, waves.flux, waves.energy);
    for j in 0..n {
        let node = row[j];
        if node.near > 1.0 {
            b[j] = Complex::ZERO;
            records[j] = Record::NONE;
            told[j] = Told { energy: 0.0, unbroken: 0.0 };
            continue;
        }
        let (index, f) = entry(node.s);
        let (low, high) = (waves.table[index], waves.table[index + 1]);
        let inverse = 1.0 / node.s;
        let mut z = b[j];
        let (mut re, mut im) = ([0.0f32; LANES], [0.0f32; LANES]);
        let (mut energies, mut fluxes) = ([0.0f32; LANES], [0.0f32; LANES]);
        for l in 0..LANES {
            let k = (f.mul_add(high[0].0[l] - low[0].0[l], low[0].0[l]) * inverse).min(finest.0[l]);
            let speed = f.mul_add(high[1].0[l] - low[1].0[l], low[1].0[l]);
            let q = across.0[l];
            let p = k.mul_add(k, -(q * q)).max(0.02 * k * k).sqrt();
            // Amplitude of this flux at this speed.
            let square = open_flux.0[l] * k / (speed * p);
            let factor = square.sqrt();
            (re[l], im[l]) = (z.re[l] * factor, z.im[l] * factor);
            let flux = z.re[l].mul_add(z.re[l], z.im[l] * z.im[l]) * open_energy.0[l];
            energies[l] = flux * square;
            fluxes[l] = flux;
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
        // Towards the rim the open sea takes over, by energy: waves that are out of step with it must not cancel it.
        let (c, o) = ((1.0 - node.open) * lower, node.open);
        let (mut amplitude, mut phase) = ([0i32; LANES], [0i32; LANES]);
        for l in 0..LANES {
            let (x, y) = (re[l].mul_add(c, o), im[l] * c);
            let length = x.mul_add(x, y * y).sqrt();
            let own = re[l].mul_add(re[l], im[l] * im[l]) * lower * lower;
            let wanted = own.mul_add(1.0 - o, o).sqrt();
            let told = if o > 0.0 { wanted.min(2.0 * length) } else { length };
            amplitude[l] = whole_number((told * UNITS).min(65_535.0));
            phase[l] = whole_number(angle(x, y) * 65_536.0);
        }
        let record = &mut records[j];
        for l in 0..LANES {
            record.amplitude[l] = amplitude[l] as u16;
            record.phase[l] = phase[l] as i16;
        }
    }
}

/// q⁺ v, where q⁺ is b + i (d p − damping).
#[inline(always)]
fn weighed(p: &Lanes, v: &Complex, b: f32, d: f32, damping: f32) -> Complex {
    let mut to = Complex::ZERO;
    for l in 0..LANES {
        let i = d.mul_add(p.0[l], -damping);
        let (re, im) = (v.re[l], v.im[l]);
        to.re[l] = b.mul_add(re, -(i * im));
        to.im[l] = b.mul_add(im, i * re);
    }
    to
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

/// Takes the waves of a row to the next one, `forward` (m) on; nodes are `apart` (m). `row` holds the nodes midway.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
pub(super) fn advance(march: &mut March, waves: &Waves, row: &[Node], forward: f32, apart: f32) {
    let n = row.len();
    let (b, p, v) = (&mut march.b[..n], &mut march.p[..n], &mut march.v[..n]);
    let (g, inverse) = (&mut march.g[..n], &mut march.inverse[..n]);
    let (part, root) = (&mut march.part[..n], &mut march.root[..n]);
    let steep = 1.0 / (apart * apart);
    let (across, finest) = (waves.across, waves.finest);
    let mut drift = Lanes::ZERO;
    for l in 0..LANES {
        drift.0[l] = across.0[l] / apart;
    }
    for j in 0..n {
        let (index, f) = entry(row[j].s);
        let (low, high) = (&waves.table[index], &waves.table[index + 1]);
        let over = 1.0 / row[j].s;
        // Copies, here and below, let the compiler see that nothing overlaps.
        let (low, high, from) = (low[0], high[0], b[j]);
        let (mut to_p, mut to_root, mut to_v) = (Lanes::ZERO, Lanes::ZERO, Complex::ZERO);
        for l in 0..LANES {
            let k = (f.mul_add(high.0[l] - low.0[l], low.0[l]) * over).min(finest.0[l]);
            let q = across.0[l];
            let along = k.mul_add(k, -(q * q)).max(0.02 * k * k).sqrt();
            to_p.0[l] = along;
            let power = along * along.sqrt();
            to_root.0[l] = power;
            let weight = 1.0 / power;
            to_v.re[l] = from.re[l] * weight;
            to_v.im[l] = from.im[l] * weight;
        }
        (p[j], root[j], v[j]) = (to_p, to_root, to_v);
    }
    for (a, bn, least) in TERMS {
        let d = 0.5 * a * forward;
        // Right-hand side: p²v + Z (q⁺ v), with Z the second difference and the drift across.
        // Forward elimination; at the ends are the waves of the open sea, which do not change.
        let mut last = Complex::ZERO;
        let mut chain = Complex::ZERO;
        let ends = [0, n - 1].map(|j| {
            let damping = row[j].near.min(1.0).mul_add(BESIDE_LAND, least);
            weighed(&p[j], &v[j], bn, -d, damping)
        });
        last = if n > 1 { ends[0] } else { last };
        // q⁺ v of the nodes before, here and after: in a loop of its own the compiler would take nodes for lanes, by gathers.
        let ahead = |j: usize| {
            let damping = row[j].near.min(1.0).mul_add(BESIDE_LAND, least);
            weighed(&p[j], &v[j], bn, d, damping)
        };
        let mut before = ahead(0);
        let mut here = ahead(1.min(n - 1));
        for j in 1..n - 1 {
            let damping = row[j].near.min(1.0).mul_add(BESIDE_LAND, least);
            let after = ahead(j + 1);
            let (pj, vj) = (p[j], v[j]);
            let (mut to_chain, mut to, mut to_part) = (Complex::ZERO, Complex::ZERO, Lanes::ZERO);
            for l in 0..LANES {
                let drift = drift.0[l];
                let square = pj.0[l] * pj.0[l];
                // z± = steep ± i drift
                let (sr, si) = (before.re[l] + after.re[l], before.im[l] + after.im[l]);
                let (tr, ti) = (after.re[l] - before.re[l], after.im[l] - before.im[l]);
                let right_re = steep.mul_add(sr - 2.0 * here.re[l], square.mul_add(vj.re[l], -(drift * ti)));
                let right_im = steep.mul_add(si - 2.0 * here.im[l], square.mul_add(vj.im[l], drift * tr));
                // Diagonal: p²/q⁻ − 2 steep, q⁻ = bₙ − i (δ + d p).
                let i = -d.mul_add(pj.0[l], damping);
                let part = 1.0 / bn.mul_add(bn, i * i);
                to_part.0[l] = part;
                let size = square * part;
                let zz = steep.mul_add(steep, drift * drift);
                let den_re = size.mul_add(bn, -2.0 * steep) - zz * chain.re[l];
                let den_im = -(size * i) - zz * chain.im[l];
                let over = 1.0 / den_re.mul_add(den_re, den_im * den_im);
                let (cr, ci) = (den_re * over, -(den_im * over));
                to_chain.re[l] = cr;
                to_chain.im[l] = ci;
                // (right − z⁻ last) chain
                let xr = right_re - steep.mul_add(last.re[l], drift * last.im[l]);
                let xi = right_im - steep.mul_add(last.im[l], -(drift * last.re[l]));
                to.re[l] = xr.mul_add(cr, -(xi * ci));
                to.im[l] = xr.mul_add(ci, xi * cr);
            }
            (chain, last, before, here) = (to_chain, to, here, after);
            inverse[j] = chain;
            part[j] = to_part;
            g[j] = last;
        }
        // Back substitution, and v from what was solved for.
        let mut next = ends[1];
        for j in (1..n - 1).rev() {
            let damping = row[j].near.min(1.0).mul_add(BESIDE_LAND, least);
            let (inverse, gj, pj, part) = (inverse[j], g[j], p[j], part[j]);
            let (mut to, mut to_v) = (Complex::ZERO, Complex::ZERO);
            for l in 0..LANES {
                let drift = drift.0[l];
                let (cr, ci) = (inverse.re[l], inverse.im[l]);
                let yr = steep.mul_add(next.re[l], -(drift * next.im[l]));
                let yi = steep.mul_add(next.im[l], drift * next.re[l]);
                let xr = gj.re[l] - yr.mul_add(cr, -(yi * ci));
                let xi = gj.im[l] - yr.mul_add(ci, yi * cr);
                to.re[l] = xr;
                to.im[l] = xi;
                let i = -d.mul_add(pj.0[l], damping);
                to_v.re[l] = xr.mul_add(bn, xi * i) * part.0[l];
                to_v.im[l] = xi.mul_add(bn, -(xr * i)) * part.0[l];
            }
            (next, v[j]) = (to, to_v);
        }
    }
    for j in 0..n {
        let land = row[j].near > 1.0;
        let keep = if land { 0.0 } else { 1.0 - row[j].draw };
        let gain = if land { 0.0 } else { row[j].draw };
        let end = j == 0 || j == n - 1;
        if end {
            b[j] = Complex::ONE;
            continue;
        }
        let (pj, vj, power, open) = (p[j], v[j], root[j], waves.along);
        let mut to = Complex::ZERO;
        for l in 0..LANES {
            let along = pj.0[l];
            let weight = power.0[l] * keep;
            let turns = (along - open.0[l]) * forward * 0.159_154_94;
            let (s, c) = sine_cosine(turns);
            let (re, im) = (vj.re[l] * weight, vj.im[l] * weight);
            to.re[l] = re.mul_add(c, -(im * s)) + gain;
            to.im[l] = re.mul_add(s, im * c);
        }
        b[j] = to;
    }
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
