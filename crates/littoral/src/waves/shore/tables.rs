//! A sea over a bed in numbers: what programs elsewhere need to answer as it does.

use super::lanes::LANES;
use super::{ShoreSea, shape};
use glam::DVec2;

/// What a [`ShoreSea`] knows, in the form in which other processors want it.
#[derive(Clone, Debug)]
pub struct ShoreTables {
    /// The place of the south-western node, and the distances of nodes (m). Outside their lattice the sea is open.
    pub origin: DVec2,
    /// From node to node (m).
    pub spacing: DVec2,
    /// Nodes a row.
    pub columns: usize,
    /// Rows of nodes.
    pub rows: usize,
    /// The waves, as they are in the open.
    pub waves: Vec<ShoreWave>,
    /// For each node, row by row, and at last for the open sea, all waves one after the other: in the lower half of the bits the phase by which the wave is ahead
    /// of the one in the open (2⁻¹⁶ turns, signed), in the upper its amplitude over that of the one in the open (2⁻¹³).
    pub records: Vec<u32>,
    /// For each node and at last for the open sea: depth and significant height (m), r cos φ and r sin φ of the waves' profile, the share of the sideways motion
    /// that is let be, the share of waves that is broken, set-up and swing of the swash (m).
    pub places: Vec<[f32; 8]>,
    /// Mean angular frequency of the waves (rad/s).
    pub frequency: f32,
    /// Height over depth at which waves break.
    pub breaking: f32,
}

/// One of the waves of a [`ShoreSea`] in the open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShoreWave {
    /// Wave number, in the direction in which it runs (turns/m).
    pub turns: DVec2,
    /// Phase at the origin at time 0 (turns).
    pub start: f64,
    /// Frequency (Hz).
    pub frequency: f64,
    /// Amplitude (m).
    pub amplitude: f32,
}

impl ShoreWave {
    /// Phase (turns, in [0, 1)) at a place (m) at a time (s).
    pub fn phase(&self, at: DVec2, seconds: f64) -> f64 {
        let now = self.start - self.frequency * seconds;
        let turns = self.turns.dot(at) + (now - now.floor());
        turns - turns.floor()
    }
}

impl ShoreSea {
    /// How high above still water swash reaches, in swings of it above its set-up.
    pub const FARTHEST_SWASH: f32 = shape::FARTHEST;

    /// Everything it knows of the bed and the waves, whatever the instant.
    pub fn tables(&self) -> ShoreTables {
        let count = self.components.len();
        let record = |node: usize, wave: usize| {
            let record = &self.records[node * self.blocks + wave / LANES];
            let (phase, amplitude) = (record.phase[wave % LANES], record.amplitude[wave % LANES]);
            u32::from(phase.cast_unsigned()) | u32::from(amplitude) << 16
        };
        let nodes = self.columns * self.rows + 1;
        let wave = |c: &super::Component| ShoreWave {
            turns: c.turns,
            start: c.start,
            frequency: c.frequency,
            amplitude: c.amplitude,
        };
        ShoreTables {
            origin: self.origin,
            spacing: self.spacing,
            columns: self.columns,
            rows: self.rows,
            waves: self.components.iter().map(wave).collect(),
            records: (0..nodes).flat_map(|node| (0..count).map(move |wave| record(node, wave))).collect(),
            places: self.places.iter().map(|place| place.0).collect(),
            frequency: self.frequency,
            breaking: self.breaking,
        }
    }
}
