//! The spectrum of a tile at an instant, packed for the transforms of its fields.
//!
//! A wave and the one that runs against it make h(k, t) = h₀(k) e^(−iωt) + h₀*(−k) e^(iωt). With their sum S = h₀(k) + h₀*(−k) and difference
//! D = h₀(k) − h₀*(−k) that is h = S cos ωt − i D sin ωt.

use super::kernel::{LANES, Lane, Line, Wide};

/// The waves of 16 neighbouring wave numbers in x and one in y.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Column {
    /// Turns of the phase in a unit of time.
    pub turns: [f64; LANES],
    /// h₀(k) + h₀*(−k) (m)
    pub sum: Wide,
    /// h₀(k) − h₀*(−k) (m)
    pub difference: Wide,
    /// How far sideways the water goes, over its height and the wave number (m).
    pub reach: Lane,
}

impl Column {
    pub const STILL: Column =
        Column { turns: [0.0; LANES], sum: Wide::ZERO, difference: Wide::ZERO, reach: [0.0; LANES] };
}

/// All waves of a tile: columns by group of wave numbers in x (from −`groups` to `groups`, each of 16), then by wave number in y
/// (from −`rows` to `rows`).
pub(crate) struct Waves {
    pub columns: Vec<Column>,
    pub groups: i32,
    pub rows: i32,
    /// Between neighbouring wave numbers (rad/m).
    pub step: f64,
}

impl Waves {
    pub fn group(&self, group: i32) -> &[Column] {
        let rows = (2 * self.rows + 1) as usize;
        &self.columns[(group + self.groups) as usize * rows..][..rows]
    }
}

/// What a tile's waves are summed up on: as many samples as are needed for the waves that are not left out.
pub(crate) struct Grid {
    pub line: Line,
    /// Highest magnitude of an index of a wave number.
    pub rows: i32,
    /// Groups of wave numbers in x are from −`groups` to `groups`.
    pub groups: i32,
    /// Waves whose squared wave number (rad²/m²) is not below this are left out.
    pub limit: f32,
    /// Whether all wave numbers lie in the lower half of what the samples can carry.
    pub narrow: bool,
    /// Where packed wave numbers in y stand.
    pub along_y: Vec<u32>,
    /// Where wave numbers in x stand between the transforms, for two and for four of them.
    pub along_x: [Vec<u32>; 2],
}

impl Grid {
    /// `samples` a side, for waves with indices up to `rows` and below `limit` (rad/m).
    pub fn new(samples: usize, rows: i32, limit: f64) -> Grid {
        let n = samples as i32;
        assert!(rows < n / 2, "{rows} is beyond what {samples} samples carry");
        let narrow = rows < n / 4;
        let groups = if narrow { n / 64 } else { n / 32 };
        // Those that are not there are never read.
        let x_at = |transforms: i32| {
            let at = |m: i32| {
                let m = if m < n / 2 { m } else { m - n };
                let group = m.div_euclid(16) + groups;
                if (0..2 * groups).contains(&group) { group * transforms * n + m.rem_euclid(16) } else { 0 }
            };
            (0..n).map(|m| at(m) as u32).collect()
        };
        Grid {
            line: Line::new(samples),
            rows,
            groups,
            limit: (limit * limit) as f32,
            narrow,
            along_y: (0..n).map(|m| 4 * m as u32).collect(),
            along_x: [x_at(2), x_at(4)],
        }
    }

    pub fn samples(&self) -> usize {
        self.line.samples
    }

    /// Numbers that `transforms` transforms keep between their two dimensions.
    pub fn between(&self, transforms: usize) -> usize {
        2 * self.groups as usize * transforms * self.samples()
    }
}

/// Which fields are made.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fields {
    /// η + i Dx, Dxx + i Dy, Dyy + i ηx, Dxy + i ηy.
    Motion,
    /// Dxx + i Dyy, Dxy.
    Stretch,
    /// ∂η/∂t + i ∂Dx/∂t, i ∂Dy/∂t at a depth.
    Velocity {
        /// Metres below still water.
        depth: f32,
        /// Depth of the water (m); infinity for deep water.
        bed: f32,
        /// Angular frequency of a turn in a unit of time (rad/s).
        angular: f32,
        /// Sideways motion over that of the waves of theory.
        choppiness: f32,
    },
}

impl Fields {
    pub fn transforms(self) -> usize {
        if matches!(self, Fields::Motion) { 4 } else { 2 }
    }
}

/// What is left of phases (turns) without their whole turns, in [−½, ½].
#[inline(always)]
fn phases(turns: &[f64; LANES], time: f64) -> Lane {
    // Adding and taking off 1.5 · 2⁵² rounds to the nearest whole number.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    let mut rest = [0.0; LANES];
    for l in 0..LANES {
        let turns = turns[l] * time;
        rest[l] = (turns - ((turns + ROUNDER) - ROUNDER)) as f32;
    }
    rest
}

/// Sine and cosine of a phase from −½ to ½ turn, to 4e-9 beside the rounding of `f32`.
#[inline(always)]
fn sine_cosine(r: f32) -> (f32, f32) {
    let size = r.abs();
    let folded = (0.25 - (size - 0.25).abs()).copysign(r);
    (quarter_sine(folded), quarter_sine(0.25 - size))
}

/// sin 2πs for |s| ≤ ¼.
#[inline(always)]
fn quarter_sine(s: f32) -> f32 {
    let z = s * s;
    let p = 39.534_92_f32.mul_add(z, -76.549_53).mul_add(z, 81.600_99).mul_add(z, -41.341_656).mul_add(z, 6.283_185);
    p * s
}

/// e^(−x) for x ≥ 0, to (3 + x)·10⁻⁷ of itself; 0 from 87 on.
#[inline(always)]
fn fading(x: f32) -> f32 {
    const ROUNDER: f32 = 12_582_912.0;
    let y = (-x).max(-87.0) * std::f32::consts::LOG2_E;
    let shifted = y + ROUNDER;
    let f = y - (shifted - ROUNDER);
    let p = 1.535_336e-4_f32
        .mul_add(f, 1.339_887e-3)
        .mul_add(f, 9.618_437e-3)
        .mul_add(f, 5.550_332e-2)
        .mul_add(f, 2.402_264_7e-1)
        .mul_add(f, 6.931_472e-1)
        .mul_add(f, 1.0);
    let scale = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3F80_0000));
    if x < 87.0 { p * scale } else { 0.0 }
}

/// Wave numbers in x (rad/m) of a group.
#[inline(always)]
fn wave_numbers(group: i32, step: f64) -> Lane {
    std::array::from_fn(|l| (f64::from(16 * group + l as i32) * step) as f32)
}

/// Packs the spectra of a group at a time, four for each wave number in y, in the order of the transform; zeros where it reads and no waves
/// are. `packed` holds four for each sample of the grid.
#[inline(always)]
pub(crate) fn pack(waves: &Waves, grid: &Grid, group: i32, time: f64, fields: Fields, packed: &mut [Wide]) {
    let (n, rows) = (grid.samples() as i32, grid.rows);
    let kx = wave_numbers(group, waves.step);
    let columns = waves.group(group);
    let middle = if grid.narrow { n / 4 } else { n / 2 };
    // Wave numbers below the limit fill a disc.
    let nearest = if group < 0 { -16 * group - 15 } else { 16 * group };
    let nearest = f64::from(nearest) * waves.step;
    let chord = (f64::from(grid.limit) - nearest * nearest).max(0.0).sqrt() / waves.step;
    let rows = rows.min(chord as i32);
    packed[4 * (rows + 1) as usize..4 * middle as usize].fill(Wide::ZERO);
    packed[4 * (n - middle) as usize..4 * (n - rows) as usize].fill(Wide::ZERO);
    for row in -rows..=rows {
        let ky = (f64::from(row) * waves.step) as f32;
        let column = &columns[(row + waves.rows) as usize];
        let at = 4 * (if row < 0 { row + n } else { row }) as usize;
        let out: &mut [Wide; 4] = (&mut packed[at..at + 4]).try_into().expect("four");
        match fields {
            Fields::Motion => motion(column, &kx, ky, grid.limit, time, out),
            Fields::Stretch => stretch(column, &kx, ky, grid.limit, time, out),
            Fields::Velocity { depth, bed, angular, choppiness } => {
                velocity(column, &kx, ky, grid.limit, time, [depth, bed, angular, choppiness], out);
            }
        }
    }
}

#[inline(always)]
fn motion(column: &Column, kx: &Lane, ky: f32, limit: f32, time: f64, out: &mut [Wide; 4]) {
    let (s, d) = (&column.sum, &column.difference);
    let phases = phases(&column.turns, time);
    for l in 0..LANES {
        let (sine, cosine) = sine_cosine(phases[l]);
        let (x, reach) = (kx[l], column.reach[l]);
        let there = if x.mul_add(x, ky * ky) < limit { 1.0 } else { 0.0 };
        let re = d.im[l].mul_add(sine, s.re[l] * cosine) * there;
        let im = (-d.re[l]).mul_add(sine, s.im[l] * cosine) * there;
        let a = (-x).mul_add(reach, 1.0);
        let b = -reach * x.mul_add(x, ky);
        let c = -(ky * ky).mul_add(reach, x);
        let e = -(x * ky).mul_add(reach, ky);
        (out[0].re[l], out[0].im[l]) = (a * re, a * im);
        (out[1].re[l], out[1].im[l]) = (b * re, b * im);
        (out[2].re[l], out[2].im[l]) = (c * re, c * im);
        (out[3].re[l], out[3].im[l]) = (e * re, e * im);
    }
}

#[inline(always)]
fn stretch(column: &Column, kx: &Lane, ky: f32, limit: f32, time: f64, out: &mut [Wide; 4]) {
    let (s, d) = (&column.sum, &column.difference);
    let phases = phases(&column.turns, time);
    for l in 0..LANES {
        let (sine, cosine) = sine_cosine(phases[l]);
        let x = kx[l];
        let there = if x.mul_add(x, ky * ky) < limit { -column.reach[l] } else { 0.0 };
        let re = d.im[l].mul_add(sine, s.re[l] * cosine) * there;
        let im = (-d.re[l]).mul_add(sine, s.im[l] * cosine) * there;
        let (xx, xy, yy) = (x * x, x * ky, ky * ky);
        out[0].re[l] = (-yy).mul_add(im, xx * re);
        out[0].im[l] = yy.mul_add(re, xx * im);
        (out[1].re[l], out[1].im[l]) = (xy * re, xy * im);
    }
}

#[inline(always)]
fn velocity(column: &Column, kx: &Lane, ky: f32, limit: f32, time: f64, how: [f32; 4], out: &mut [Wide; 4]) {
    let [depth, bed, angular, choppiness] = how;
    let (s, d) = (&column.sum, &column.difference);
    let phases = phases(&column.turns, time);
    for l in 0..LANES {
        let (sine, cosine) = sine_cosine(phases[l]);
        let x = kx[l];
        let square = x.mul_add(x, ky * ky);
        let k = square.sqrt();
        let omega = if square < limit { column.turns[l] as f32 * angular } else { 0.0 };
        let re = omega * d.im[l].mul_add(cosine, -s.re[l] * sine);
        let im = -omega * d.re[l].mul_add(cosine, s.im[l] * sine);
        // What is left of the motion at this depth: sinh k(h−d) / sinh kh upward, cosh k(h−d) / sinh kh sideways.
        let (left, mirrored) = (fading(k * depth), fading(2.0 * k * (bed - depth)));
        let whole = if square > 0.0 { left / (1.0 - fading(2.0 * k * bed)) } else { 0.0 };
        let upward = whole * (1.0 - mirrored);
        let sideways = choppiness * whole * (1.0 + mirrored) / k.max(1e-12);
        let a = (-x).mul_add(sideways, upward);
        let b = -ky * sideways;
        (out[0].re[l], out[0].im[l]) = (a * re, a * im);
        (out[1].re[l], out[1].im[l]) = (b * re, b * im);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elementary_functions_are_right() {
        for i in -40_000..40_000 {
            let turns = f64::from(i) / 9973.0 + 1e5 * f64::from(i % 7);
            let (sine, cosine) = sine_cosine(phases(&[turns; LANES], 1.0)[3]);
            let angle = std::f64::consts::TAU * (turns - turns.round());
            assert!((f64::from(sine) - angle.sin()).abs() < 2.5e-7, "{turns}");
            assert!((f64::from(cosine) - angle.cos()).abs() < 2.5e-7, "{turns}");
        }
        for i in 0..90_000 {
            let x = i as f32 * 1e-3;
            let exact = (-f64::from(x)).exp();
            assert!(
                (f64::from(fading(x)) - exact).abs() <= (3e-7 + 1e-7 * f64::from(x)) * exact + 1e-37,
                "{x}: {} {exact}",
                fading(x)
            );
        }
        assert_eq!(fading(f32::INFINITY), 0.0);
    }
}
