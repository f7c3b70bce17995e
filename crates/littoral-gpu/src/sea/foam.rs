//! Foam on the GPU: where waves break at ticks, and what is seen between two of them. The rules are those of the processor
//! ([`littoral::waves::cascades`]).

use littoral::waves::cascades::{Breakers, FoamTick};

/// Most tiles with foam, as many as the shader has room for.
pub const MOST: usize = 16;

/// An instant of waves as the shader knows it, or a tick.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Moment {
    seconds: i32,
    rest: u32,
    half: u32,
    decay: f32,
    least: f32,
    unused: [u32; 3],
    foaming: [[f32; 4]; MOST],
}

impl Moment {
    /// An instant, in the unit in which waves count time.
    pub fn new(time: f64) -> Moment {
        let whole = time.floor();
        Moment {
            seconds: whole as i32,
            rest: ((time - whole) * 4_294_967_296.0) as u32,
            half: 0,
            decay: 0.0,
            least: FoamTick::LEAST,
            unused: [0; 3],
            foaming: [[0.0; 4]; MOST],
        }
    }
}

/// The foam of a sea's tiles, in two halves of a buffer.
pub struct Foam {
    breakers: Breakers,
    /// The tiles that have any.
    pub tiles: Vec<usize>,
    /// The tick that the older half stands at, while the other stands at the next.
    tick: Option<i64>,
    /// Which half is the older.
    pub half: u32,
}

/// What is to be done for an instant.
pub struct Due {
    /// Whether the newer half is to be emptied first.
    pub clear: bool,
    /// The ticks one after the other.
    pub ticks: Vec<Moment>,
    /// The part of the way from the older half to the newer.
    pub part: f32,
}

impl Foam {
    pub fn new(breakers: Breakers, tiles: usize) -> Foam {
        let tiles = (0..tiles).filter(|tile| breakers.makes_foam(*tile)).collect();
        Foam { breakers, tiles, tick: None, half: 0 }
    }

    /// Time as waves count it.
    pub fn time(&self, seconds: f64) -> f64 {
        self.breakers.time(seconds)
    }

    /// The half that is the newer now: what ticks begin with.
    pub fn newer(&self) -> u32 {
        1 - self.half
    }

    /// Goes to an instant (s).
    pub fn set(&mut self, seconds: f64) -> Due {
        let instant = self.breakers.instant(seconds);
        let behind = self.tick.map(|tick| match instant.ticks {
            Some(ticks) => (instant.tick - tick).rem_euclid(ticks),
            None => instant.tick - tick,
        });
        let (missing, clear) = match behind {
            Some(behind) if (0..=instant.memory).contains(&behind) => (behind, false),
            _ => (instant.memory + 1, true),
        };
        let ticks = (instant.tick + 2 - missing..=instant.tick + 1).map(|tick| self.advance(tick)).collect();
        self.tick = Some(instant.tick);
        Due { clear, ticks, part: instant.part }
    }

    /// One tick, from the newer half to the older, which then change places.
    fn advance(&mut self, tick: i64) -> Moment {
        self.half = 1 - self.half;
        let mut moment = Moment::new(0.0);
        for (layer, tile) in self.tiles.iter().enumerate() {
            if let Some(of) = self.breakers.tick(*tile, tick) {
                moment = Moment { foaming: moment.foaming, ..Moment::new(of.time) };
                moment.decay = of.decay;
                moment.foaming[layer] = [of.threshold, of.steepness, 0.0, 0.0];
            }
        }
        moment.half = self.half;
        moment
    }
}
