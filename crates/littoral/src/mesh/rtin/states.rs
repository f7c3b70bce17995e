//! Where there is something of the surface, and where something void, in every square.

use super::{Level, Part, rises};
use crate::field::Raster;
use crate::mesh::measure::patch_exists;
use rayon::prelude::*;

/// What there is of the surface in the four quarters of a square, two bits each: something, and something void.
pub(super) type States = u8;
pub(super) const SOLID: u8 = 1;
pub(super) const VOID: u8 = 2;
pub(super) const ALL_SOLID: States = 0b0101_0101;

pub(super) fn state(states: States, part: Part) -> u8 {
    states >> (2 * part as u8) & 3
}

/// States of the halves of a square.
pub(super) fn half_states(states: States, rises: bool) -> [u8; 2] {
    let of = |part| state(states, part);
    if rises {
        [of(Part::South) | of(Part::East), of(Part::North) | of(Part::West)]
    } else {
        [of(Part::South) | of(Part::West), of(Part::North) | of(Part::East)]
    }
}

/// States of the squares of every size.
pub(super) fn all_states(raster: &Raster, levels: &[Level]) -> Vec<Vec<States>> {
    let mut states = vec![finest_states(raster, levels[0])];
    for k in 1..levels.len() {
        states.push(coarser_states(&states[k - 1], levels[k - 1], levels[k]));
    }
    states
}

/// Two bits of each quarter of each square of two patches a side.
fn finest_states(raster: &Raster, level: Level) -> Vec<States> {
    let patch = |x: usize, y: usize| match x + 1 < raster.columns() && y + 1 < raster.rows() {
        false => 0,
        true if patch_exists(raster, x as i64, y as i64) => SOLID,
        true => VOID,
    };
    let of = |i: usize| {
        let (x, y) = (2 * (i % level.columns), 2 * (i / level.columns));
        let [a, b, c, d] = [patch(x, y), patch(x + 1, y), patch(x, y + 1), patch(x + 1, y + 1)];
        (a | b) | (b | d) << 2 | (c | d) << 4 | (a | c) << 6
    };
    (0..level.columns * level.rows).into_par_iter().map(of).collect()
}

/// The same for squares of twice the side.
fn coarser_states(finer: &[States], under: Level, level: Level) -> Vec<States> {
    let halves = |x: usize, y: usize| match x < under.columns && y < under.rows {
        true => half_states(finer[y * under.columns + x], rises(x, y)),
        false => [0; 2],
    };
    let of = |i: usize| {
        let (x, y) = (2 * (i % level.columns), 2 * (i / level.columns));
        let [a, b, c, d] = [halves(x, y), halves(x + 1, y), halves(x, y + 1), halves(x + 1, y + 1)];
        (a[0] | b[0]) | (b[1] | d[0]) << 2 | (c[1] | d[1]) << 4 | (a[1] | c[0]) << 6
    };
    (0..level.columns * level.rows).into_par_iter().map(of).collect()
}
