//! The two halves of a tile's transforms: along y by groups of wave numbers, then along x by blocks of rows, put together into what is asked
//! about.

use super::evolve::{Fields, Grid, Waves, pack};
use super::kernel::{LANES, Lane, Wide, transpose};
use multiversion::multiversion;
use rayon::prelude::*;
use std::cell::RefCell;

/// Samples of rows that lie side by side in memory: two of eight fields, or four of four.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Samples(pub [f32; 16]);

/// The order of the fields of a sample of motion.
pub(crate) mod field {
    pub const Z: usize = 0;
    pub const X: usize = 1;
    pub const XX: usize = 2;
    pub const Y: usize = 3;
    pub const YY: usize = 4;
    pub const ZX: usize = 5;
    pub const XY: usize = 6;
    pub const ZY: usize = 7;
}

/// What one thread works with.
struct Scratch {
    packed: Vec<Wide>,
    results: Vec<Wide>,
    spare: Vec<Wide>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = const {
        RefCell::new(Scratch { packed: Vec::new(), results: Vec::new(), spare: Vec::new() })
    };
}

/// Calls a function with scratch for lines of `samples`.
fn with_scratch(samples: usize, work: impl FnOnce(&mut Scratch)) {
    SCRATCH.with_borrow_mut(|scratch| {
        if scratch.spare.len() < samples {
            scratch.packed.resize(4 * samples, Wide::ZERO);
            scratch.results.resize(4 * samples, Wide::ZERO);
            scratch.spare.resize(samples, Wide::ZERO);
        }
        work(scratch);
    });
}

/// How a step is run: the bits are always the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Run {
    /// By the kernels that run on any processor rather than the best for this one.
    pub portable: bool,
    /// On as many threads as there are.
    pub threads: bool,
}

impl Run {
    /// On this thread.
    pub const ALONE: Run = Run { portable: false, threads: false };
    /// On all threads.
    pub const TOGETHER: Run = Run { portable: false, threads: true };
}

/// Calls a function for each chunk of a slice.
fn each_chunk<T: Send>(run: Run, of: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    if run.threads && rayon::current_num_threads() > 1 {
        of.par_chunks_mut(size).enumerate().for_each(|(index, chunk)| work(index, chunk));
    } else {
        of.chunks_mut(size).enumerate().for_each(|(index, chunk)| work(index, chunk));
    }
}

/// Where a row of samples of motion begins, and how many [`Samples`] it takes: one pair more than the tile has, so that the last sample has a
/// neighbour.
pub(crate) fn motion_stride(samples: usize) -> usize {
    samples / 2 + 1
}

/// First half: all groups of a grid's waves at a time. `between` holds [`Grid::between`] numbers.
pub(crate) fn along_y(run: Run, waves: &Waves, grid: &Grid, time: f64, fields: Fields, between: &mut [Wide]) {
    let chunk = fields.transforms() * grid.samples();
    let between = &mut between[..grid.between(fields.transforms())];
    each_chunk(run, between, chunk, |index, to| {
        let group = index as i32 - grid.groups;
        let kernel = if run.portable { group_along_y_body } else { group_along_y };
        with_scratch(grid.samples(), |scratch| kernel(waves, grid, group, time, fields, to, scratch));
    });
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn group_along_y(
    waves: &Waves,
    grid: &Grid,
    group: i32,
    time: f64,
    fields: Fields,
    to: &mut [Wide],
    scratch: &mut Scratch,
) {
    group_along_y_body(waves, grid, group, time, fields, to, scratch);
}

#[inline(always)]
fn group_along_y_body(
    waves: &Waves,
    grid: &Grid,
    group: i32,
    time: f64,
    fields: Fields,
    to: &mut [Wide],
    scratch: &mut Scratch,
) {
    let n = grid.samples();
    pack(waves, grid, group, time, fields, &mut scratch.packed[..4 * n]);
    for (transform, to) in to.chunks_exact_mut(n).enumerate() {
        grid.line.run(&scratch.packed, &grid.along_y, transform, grid.narrow, &mut scratch.results, &mut scratch.spare);
        for (to, position) in to.chunks_exact_mut(LANES).zip(grid.line.position.chunks_exact(LANES)) {
            let mut block = [[0.0; LANES]; LANES];
            for (row, &p) in block.iter_mut().zip(position) {
                *row = scratch.results[p as usize].re;
            }
            transpose(&mut block);
            for (to, row) in to.iter_mut().zip(&block) {
                to.re = *row;
            }
            for (row, &p) in block.iter_mut().zip(position) {
                *row = scratch.results[p as usize].im;
            }
            transpose(&mut block);
            for (to, row) in to.iter_mut().zip(&block) {
                to.im = *row;
            }
        }
    }
}

/// Second half for motion: rows of samples of eight fields, [`motion_stride`] each.
pub(crate) fn motion_along_x(run: Run, grid: &Grid, between: &[Wide], to: &mut [Samples]) {
    each_chunk(run, to, LANES * motion_stride(grid.samples()), |block, to| {
        let kernel = if run.portable { motion_rows_body } else { motion_rows };
        with_scratch(grid.samples(), |scratch| kernel(grid, between, block, to, scratch));
    });
}

/// Transforms a block of rows along x.
#[inline(always)]
fn rows_along_x<const TRANSFORMS: usize>(grid: &Grid, between: &[Wide], block: usize, scratch: &mut Scratch) {
    let n = grid.samples();
    let at = &grid.along_x[TRANSFORMS / 2 - 1];
    for (transform, result) in scratch.results.chunks_exact_mut(n).take(TRANSFORMS).enumerate() {
        let base = transform * n + block * LANES;
        grid.line.run(between, at, base, grid.narrow, result, &mut scratch.spare);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn motion_rows(grid: &Grid, between: &[Wide], block: usize, to: &mut [Samples], scratch: &mut Scratch) {
    motion_rows_body(grid, between, block, to, scratch);
}

#[inline(always)]
fn motion_rows_body(grid: &Grid, between: &[Wide], block: usize, to: &mut [Samples], scratch: &mut Scratch) {
    rows_along_x::<4>(grid, between, block, scratch);
    let (n, stride) = (grid.samples(), motion_stride(grid.samples()));
    for (pair, position) in grid.line.position.chunks_exact(2).enumerate() {
        let mut samples = [[0.0; LANES]; LANES];
        for (half, &p) in position.iter().enumerate() {
            for transform in 0..4 {
                let result = &scratch.results[transform * n + p as usize];
                samples[8 * half + 2 * transform] = result.re;
                samples[8 * half + 2 * transform + 1] = result.im;
            }
        }
        transpose(&mut samples);
        for (row, sample) in samples.iter().enumerate() {
            to[row * stride + pair].0 = *sample;
        }
    }
    for row in to.chunks_exact_mut(stride) {
        row[n / 2] = row[0];
    }
}

/// How foam comes and goes at a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foaming {
    /// What is left of it after a tick.
    pub decay: f32,
    /// Jacobian below which it comes, and what more than covers the water at 0 below that.
    pub threshold: f32,
    /// Foam for each unit of the Jacobian below the threshold.
    pub steepness: f32,
}

/// Least foam there is.
pub(crate) const LEAST_FOAM: f32 = 1.0 / 512.0;

/// Second half for foam: one tick, from the foam before to the foam after; both by blocks of 16 rows, then by x.
pub(crate) fn foam_along_x(
    run: Run,
    grid: &Grid,
    between: &[Wide],
    foaming: Foaming,
    before: &[Lane],
    after: &mut [Lane],
) {
    let n = grid.samples();
    each_chunk(run, after, n, |block, after| {
        let kernel = if run.portable { foam_rows_body } else { foam_rows };
        let before = &before[block * n..block * n + n];
        with_scratch(n, |scratch| kernel(grid, between, block, foaming, before, after, scratch));
    });
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn foam_rows(
    grid: &Grid,
    between: &[Wide],
    block: usize,
    foaming: Foaming,
    before: &[Lane],
    after: &mut [Lane],
    scratch: &mut Scratch,
) {
    foam_rows_body(grid, between, block, foaming, before, after, scratch);
}

#[inline(always)]
fn foam_rows_body(
    grid: &Grid,
    between: &[Wide],
    block: usize,
    foaming: Foaming,
    before: &[Lane],
    after: &mut [Lane],
    scratch: &mut Scratch,
) {
    rows_along_x::<2>(grid, between, block, scratch);
    let n = grid.samples();
    let Foaming { decay, threshold, steepness } = foaming;
    for ((&p, before), after) in grid.line.position.iter().zip(before).zip(after) {
        let (stretch, shear) = (&scratch.results[p as usize], &scratch.results[n + p as usize]);
        for l in 0..LANES {
            let (xx, yy, xy) = (stretch.re[l], stretch.im[l], shear.re[l]);
            let jacobian = (1.0 + xx) * (1.0 + yy) - xy * xy;
            let new = ((threshold - jacobian) * steepness).clamp(0.0, 1.0);
            let left = before[l] * decay;
            let foam = if left > new { left } else { new };
            after[l] = if foam < LEAST_FOAM { 0.0 } else { foam };
        }
    }
}

/// Where a row of samples of velocity begins: [`Samples`] in a row, with four more samples than the tile has.
pub(crate) fn velocity_stride(samples: usize) -> usize {
    samples / 4 + 1
}

/// Second half for velocities: rows of samples of four numbers (upward, eastward, 0, northward), [`velocity_stride`] each.
pub(crate) fn velocity_along_x(run: Run, grid: &Grid, between: &[Wide], to: &mut [Samples]) {
    each_chunk(run, to, LANES * velocity_stride(grid.samples()), |block, to| {
        let kernel = if run.portable { velocity_rows_body } else { velocity_rows };
        with_scratch(grid.samples(), |scratch| kernel(grid, between, block, to, scratch));
    });
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+fma+avx2", "x86_64+avx2+fma"))]
fn velocity_rows(grid: &Grid, between: &[Wide], block: usize, to: &mut [Samples], scratch: &mut Scratch) {
    velocity_rows_body(grid, between, block, to, scratch);
}

#[inline(always)]
fn velocity_rows_body(grid: &Grid, between: &[Wide], block: usize, to: &mut [Samples], scratch: &mut Scratch) {
    rows_along_x::<2>(grid, between, block, scratch);
    let (n, stride) = (grid.samples(), velocity_stride(grid.samples()));
    for (four, position) in grid.line.position.chunks_exact(4).enumerate() {
        let mut samples = [[0.0; LANES]; LANES];
        for (quarter, &p) in position.iter().enumerate() {
            for transform in 0..2 {
                let result = &scratch.results[transform * n + p as usize];
                samples[4 * quarter + 2 * transform] = result.re;
                samples[4 * quarter + 2 * transform + 1] = result.im;
            }
        }
        transpose(&mut samples);
        for (row, sample) in samples.iter().enumerate() {
            to[row * stride + four].0 = *sample;
        }
    }
    for row in to.chunks_exact_mut(stride) {
        row[n / 4] = row[0];
    }
}
