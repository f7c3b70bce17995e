//! What is uploaded of a sea, and which passes sum it.

use super::Transform;
use littoral::waves::cascades::{Cascades, Wave};
use std::f64::consts::TAU;

/// What a pass needs to know; the shader says what of.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Pass {
    pub samples: u32,
    pub span: u32,
    pub stride: u32,
    pub rows: u32,
    pub level: u32,
    unused: [u32; 3],
}

/// A tile as the shader knows it.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tile {
    first: u32,
    rows: i32,
    step: f32,
    /// The tile that has this one's number among those with foam.
    with_foam: u32,
}

/// A wave as the shader knows it.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Packed {
    sum: [f32; 2],
    difference: [f32; 2],
    whole: u32,
    high: u32,
    low: u32,
    reach: f32,
}

impl Packed {
    fn new(wave: &Wave) -> Packed {
        let whole = wave.turns.floor();
        let rest = ((wave.turns - whole) * 18_446_744_073_709_551_616.0) as u64;
        Packed {
            sum: wave.sum,
            difference: wave.difference,
            whole: whole as u32 & 0x0FFF_FFFF | wave.levels.min(15) << 28,
            high: (rest >> 32) as u32,
            low: rest as u32,
            reach: wave.reach,
        }
    }
}

/// A pipeline's kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    pub along_y: bool,
    /// Of one step, or 0 for all steps of a line.
    pub radix: u32,
    pub first: bool,
    pub last: bool,
    /// Of a tick of foam.
    pub foam: bool,
}

/// A pass of all tiles at a level.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub pass: Pass,
    /// Index of its kind.
    pub pipeline: usize,
    /// And of that of the same pass in a tick of foam, for the finest level.
    pub foaming: Option<usize>,
    /// Which of the two buffers it reads.
    pub from: usize,
    pub workgroups: u32,
}

/// All that is known of a sea in advance.
pub struct Plan {
    /// Along a side of all tiles.
    pub samples: u32,
    pub levels: u32,
    pub tiles: Vec<Tile>,
    pub waves: Vec<Packed>,
    pub kinds: Vec<Kind>,
    pub steps: Vec<Step>,
}

impl Plan {
    /// Bytes of a pass's uniforms, and from one to the next.
    pub const STEP: u64 = size_of::<Pass>() as u64;
    pub const APART: u32 = 256;
    /// Invocations in a workgroup.
    const GROUP: u32 = 64;
    /// Numbers that the lines of a workgroup have together.
    const NUMBERS: u32 = 1024;

    pub fn new(sea: &Cascades, with_foam: &[usize], transform: Transform) -> Plan {
        let samples = sea.tiles().map(|tile| tile.samples).max().unwrap_or(64) as u32;
        let levels = sea.spectra().map(|spectrum| spectrum.levels()).max().unwrap_or(1);
        let (mut tiles, mut waves, mut rows) = (Vec::new(), Vec::new(), vec![0; levels]);
        for spectrum in sea.spectra() {
            let all = spectrum.rows();
            tiles.push(Tile { first: waves.len() as u32, rows: all, step: spectrum.step() as f32, with_foam: 0 });
            for n in -all..=all {
                for m in -all..=all {
                    let wave = spectrum.wave(m, n);
                    if wave.turns > 0.0 {
                        rows[..wave.levels as usize]
                            .iter_mut()
                            .for_each(|rows: &mut u32| *rows = n.unsigned_abs().max(*rows));
                    }
                    waves.push(Packed::new(&wave));
                }
            }
        }
        for (to, tile) in tiles.iter_mut().zip(with_foam) {
            to.with_foam = *tile as u32;
        }
        let mut plan = Plan { samples, levels: levels as u32, tiles, waves, kinds: Vec::new(), steps: Vec::new() };
        for (level, rows) in rows.into_iter().enumerate() {
            let samples = plan.samples >> level;
            let mut from = 1;
            for along_y in [false, true] {
                let radices = match transform {
                    Transform::Passes => radices(samples),
                    Transform::Lines => vec![0],
                };
                let mut span = 1;
                for (index, &radix) in radices.iter().enumerate() {
                    let kind =
                        Kind { along_y, radix, first: index == 0, last: index + 1 == radices.len(), foam: false };
                    let stride = plan.samples / (span * radix.max(1));
                    let pass = Pass { samples, span, stride, rows, level: level as u32, unused: [0; 3] };
                    let lines = if along_y { samples } else { 2 * rows + 1 };
                    let workgroups = match transform {
                        Transform::Passes => (lines * (samples / radix)).div_ceil(Plan::GROUP),
                        Transform::Lines => lines.div_ceil(Plan::NUMBERS / samples),
                    };
                    let pipeline = plan.pipeline(kind);
                    let foaming =
                        (level == 0 && !with_foam.is_empty()).then(|| plan.pipeline(Kind { foam: true, ..kind }));
                    plan.steps.push(Step { pass, pipeline, foaming, from, workgroups });
                    from = 1 - from;
                    span *= radix;
                }
            }
        }
        plan
    }

    fn pipeline(&mut self, kind: Kind) -> usize {
        self.kinds.iter().position(|of| *of == kind).unwrap_or_else(|| {
            self.kinds.push(kind);
            self.kinds.len() - 1
        })
    }

    /// The passes' uniforms, [`Plan::APART`] bytes apart.
    pub fn uniforms(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.steps.len().max(1) * Plan::APART as usize];
        for (to, step) in bytes.chunks_exact_mut(Plan::APART as usize).zip(&self.steps) {
            to[..size_of::<Pass>()].copy_from_slice(bytemuck::bytes_of(&step.pass));
        }
        bytes
    }

    /// The unit circle in as many steps as there are samples.
    pub fn turns(&self) -> Vec<[f32; 2]> {
        let turn = |q: u32| {
            let (sine, cosine) = (TAU * f64::from(q) / f64::from(self.samples)).sin_cos();
            [cosine as f32, sine as f32]
        };
        (0..self.samples).map(turn).collect()
    }

    pub fn bytes_moved(&self) -> u64 {
        let mut bytes = 0;
        for step in &self.steps {
            let Pass { samples, rows, .. } = step.pass;
            let (whole, present) = (u64::from(samples * samples), u64::from(samples * (2 * rows + 1)));
            let kind = self.kinds[step.pipeline];
            let read = match kind {
                Kind { along_y: false, first: true, .. } => u64::from((2 * rows + 1) * (2 * rows + 1)),
                Kind { along_y: false, .. } | Kind { along_y: true, first: true, .. } => present,
                _ => whole,
            };
            bytes += 32 * (read + if kind.along_y { whole } else { present });
        }
        bytes * self.tiles.len() as u64
    }
}

/// Factors of a power of two from 16 on, each 8 or 4.
fn radices(samples: u32) -> Vec<u32> {
    let (mut left, mut radices) = (samples.ilog2(), Vec::new());
    while left > 0 {
        let bits = if left == 4 || left == 2 { 2 } else { 3.min(left) };
        radices.push(1 << bits);
        left -= bits;
    }
    radices
}
