//! From seconds to what waves and foam depend on.

/// Length of a tick of foam (s), if no loop asks for another.
const TICK: f64 = 0.25;
/// Latest and earliest second: beyond, phases lose accuracy.
const END: f64 = 1e9;

/// How time goes on.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    /// When the sea has each of its states (s), rising.
    pub times: Vec<f64>,
    /// Wind speed then (m/s).
    pub winds: Vec<f64>,
    /// After how many seconds all starts again.
    pub period: Option<f64>,
}

/// An instant as waves see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// In the unit of the waves' turns: seconds, or loops.
    pub time: f64,
    /// The state before, and how far on it is to the one after.
    pub blend: (usize, f64),
    /// Wind speed (m/s).
    pub wind: f64,
}

/// An instant as foam sees it: between two ticks.
pub(super) struct Instant<'a> {
    clock: &'a Clock,
    pub time: f64,
    pub blend: (usize, f64),
    /// The tick before, and the part of the way from there to the next.
    pub tick: i64,
    pub part: f32,
    /// Seconds from tick to tick.
    pub length: f64,
    /// After how many ticks all starts again.
    pub ticks: Option<i64>,
}

impl Clock {
    pub fn instant(&self, seconds: f64) -> Instant<'_> {
        let seconds = sane(seconds);
        let moment = self.moment(seconds);
        let ticks = self.period.map(|period| ((period / TICK).round_ties_even() as i64).max(1));
        let length = self.period.zip(ticks).map_or(TICK, |(period, ticks)| period / ticks as f64);
        let local = self.period.map_or(seconds, |period| seconds.rem_euclid(period));
        let tick = (local / length).floor();
        let part = (local / length - tick) as f32;
        Instant { clock: self, time: moment.time, blend: moment.blend, tick: tick as i64, part, length, ticks }
    }

    fn moment(&self, seconds: f64) -> Moment {
        let (local, time) = match self.period {
            Some(period) => {
                let local = seconds.rem_euclid(period);
                (local, local / period)
            }
            None => (seconds, seconds),
        };
        let after = self.times.partition_point(|t| *t <= local);
        let (before, share) = if after == 0 {
            (0, 0.0)
        } else if after == self.times.len() {
            (after - 1, 0.0)
        } else {
            let (from, to) = (self.times[after - 1], self.times[after]);
            (after - 1, (local - from) / (to - from))
        };
        let next = (before + 1).min(self.winds.len() - 1);
        let wind = self.winds[before] + (self.winds[next] - self.winds[before]) * share;
        Moment { time, blend: (before, share), wind }
    }
}

impl Instant<'_> {
    /// The moment of a tick.
    pub fn at_tick(&self, tick: i64) -> Moment {
        let tick = self.ticks.map_or(tick, |ticks| tick.rem_euclid(ticks));
        self.clock.moment(tick as f64 * self.length)
    }
}

/// A number of seconds that waves can stand at.
pub(super) fn sane(seconds: f64) -> f64 {
    if seconds.is_nan() { 0.0 } else { seconds.clamp(-END, END) }
}
