//! A path as it is flown: poses at an even pace, so that playing asks for nothing but two neighbours.

use crate::subject::Subject;
use glam::{DVec2, DVec3};
use littoral::flight::{FlightPath, Pose};

/// A flight, recorded.
#[derive(Clone, Debug)]
pub struct Tape {
    poses: Vec<Pose>,
    rate: f64,
    duration: f64,
    /// How long the way is (m).
    pub length: f64,
    /// Whether it goes round and round.
    pub closed: bool,
}

impl Tape {
    /// Poses a second for playing.
    pub const RATE: f64 = 60.0;
    /// The most poses.
    const MOST: f64 = 2e6;

    /// A path over a land, `rate` poses a second.
    pub fn of(path: &FlightPath, subject: &Subject, rate: f64) -> Result<Tape, String> {
        let ground = |at: DVec2| subject.surface(at);
        let flight = path.over(&ground).map_err(|e| e.to_string())?;
        let (duration, count) = (flight.duration(), (flight.duration() * rate).ceil() + 1.0);
        if count > Tape::MOST {
            return Err(format!(
                "expected a flight of at most {:.0} s, got {duration:.0} s; fly faster",
                Tape::MOST / rate
            ));
        }
        let poses = (0..count as usize).map(|i| flight.pose(i as f64 / rate)).collect();
        Ok(Tape { poses, rate, duration, length: flight.length(), closed: path.closed })
    }

    /// How long the flight takes (s).
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// The pose after `time` (s).
    pub fn pose(&self, time: f64) -> Pose {
        let time = if self.closed { time.rem_euclid(self.duration) } else { time.clamp(0.0, self.duration) };
        let at = time * self.rate;
        let last = self.poses.len() - 1;
        let (i, share) = ((at as usize).min(last), at.fract());
        let (a, b) = (self.poses[i], self.poses[(i + 1).min(last)]);
        Pose {
            position: a.position.lerp(b.position, share),
            direction: a.direction.lerp(b.direction, share).normalize_or(DVec3::Y),
        }
    }

    /// About so many places along the way (m), for drawing it.
    pub fn places(&self, count: usize) -> impl Iterator<Item = DVec3> + '_ {
        let step = (self.poses.len() / count.max(1)).max(1);
        self.poses.iter().step_by(step).chain(self.poses.last()).map(|pose| pose.position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subject::Order;

    #[test]
    fn a_tape_is_the_flight() {
        let subject = Subject::open(
            &Order { files: Vec::new(), exaggeration: 1.0, lakes: Vec::new(), objects: Vec::new() },
            &|_, _| {},
        )
        .expect("the coast");
        let land = &subject.land;
        let path = FlightPath::around(land.origin(), land.extent(), land.height_range(), 20.0);
        let tape = Tape::of(&path, &subject, Tape::RATE).expect("flies");
        let ground = |at: DVec2| subject.surface(at);
        let flight = path.over(&ground).expect("flies");
        for i in 0..100 {
            let time = 0.237 * f64::from(i);
            let (played, exact) = (tape.pose(time), flight.pose(time));
            assert!(played.position.distance(exact.position) < 2e-6 * tape.length, "at {time} s");
            assert!(played.direction.distance(exact.direction) < 1e-5, "at {time} s");
        }
        assert!(Tape::of(&FlightPath::default(), &subject, 60.0).is_err_and(|e| e.contains("points")));
        // What takes weeks is not recorded.
        let slow = FlightPath { pace: littoral::flight::Pace::Duration(1e9), ..path };
        assert!(Tape::of(&slow, &subject, 60.0).is_err_and(|e| e.contains("faster")));
    }
}
