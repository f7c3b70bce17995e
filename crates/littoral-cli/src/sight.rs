//! `littoral sight`: whether two points see each other.

use crate::ground::{Opened, Reading, System};
use crate::input;
use crate::talk::{Failure, Talk, tidy};
use glam::{DVec2, DVec3};
use littoral::raycast::{Curvature, SightError, Station};
use serde::Serialize;
use std::path::PathBuf;

/// Line of sight between two points above the ground.
///
/// Exact against the full data. The clearance is the least vertical distance of the line above the ground, the ends
/// included; negative where the ground is in the way.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  littoral sight dem.tif --from 560900,5115900,2 --to 565000,5112500,10
  littoral sight dem.tif --from -155.6,19.82,3 --to -156.25,20.7,3 --lonlat --curvature
  littoral sight dem.tif --from 0,0,2 --to 900,50,2 --curvature --refraction 0.25 --json")]
pub struct Sight {
    /// A height file
    file: PathBuf,
    /// One end: X, Y and metres above the ground
    #[arg(long, value_name = "X,Y,H", value_parser = input::xyz)]
    from: DVec3,
    /// The other end: X, Y and metres above the ground
    #[arg(long, value_name = "X,Y,H", value_parser = input::xyz)]
    to: DVec3,
    /// Coordinates are longitude and latitude in degrees
    #[arg(long)]
    lonlat: bool,
    #[command(flatten)]
    curved: Curved,
    #[command(flatten)]
    reading: Reading,
}

/// The Earth's curvature, for whoever looks far.
#[derive(clap::Args, Clone, Copy)]
pub struct Curved {
    /// Let the Earth curve, and light bend after it
    #[arg(long)]
    curvature: bool,
    /// How much light bends: 0 for straight, 0.13 for an average clear day
    #[arg(long, value_name = "K", requires = "curvature", value_parser = input::refraction, default_value_if("curvature", "true", "0.13"))]
    refraction: Option<f64>,
}

impl Curved {
    /// As the engine takes it.
    pub fn curvature(self) -> Option<Curvature> {
        let refraction = self.refraction.unwrap_or(Curvature::EARTH.refraction);
        self.curvature.then_some(Curvature { refraction, ..Curvature::EARTH })
    }

    /// In words.
    pub fn told(self) -> String {
        match self.curvature() {
            None => "flat Earth, straight light".to_owned(),
            Some(curved) => format!("curved Earth, refraction {}", curved.refraction),
        }
    }
}

#[derive(Serialize)]
struct Answer {
    visible: bool,
    blocked_at: Option<Obstacle>,
    clearance: f64,
    clearance_distance: f64,
    distance: f64,
    void_length: f64,
    curvature: bool,
    refraction: Option<f64>,
}

#[derive(Serialize)]
struct Obstacle {
    x: f64,
    y: f64,
    height: f64,
    distance: f64,
}

impl Sight {
    /// Runs the command.
    pub fn run(self, talk: &mut Talk) -> Result<(), Failure> {
        let mut opened = Opened::open(&self.file, self.reading, talk)?;
        let system = System::of(self.lonlat);
        let (from, to) = (opened.local(system, self.from.truncate())?, opened.local(system, self.to.truncate())?);
        let land = opened.part(opened.window_of([from, to]), talk)?;
        let station = |position, end: DVec3| Station { position, above_ground: end.z };
        let curvature = self.curved.curvature();
        let sight = land
            .sight(station(from, self.from), station(to, self.to), curvature)
            .map_err(|error| explained(&opened, system, error, &[(from, self.from), (to, self.to)]))?;
        if sight.over_void > 1e-6 * sight.distance {
            let metres = tidy(sight.over_void, 1);
            talk.warn(format!(
                "{}: the ground is unknown below {metres} m of the line; voids do not block it",
                self.file.display()
            ));
        }
        let blocked = sight.blocked_at.map(|obstacle| {
            let at = opened.frame.crs(obstacle.position.truncate());
            Obstacle { x: at.x, y: at.y, height: obstacle.position.z, distance: obstacle.distance }
        });
        if talk.json() {
            return talk.print_json(Answer {
                visible: sight.visible(),
                blocked_at: blocked,
                clearance: sight.clearance,
                clearance_distance: sight.clearance_distance,
                distance: sight.distance,
                void_length: sight.over_void,
                curvature: curvature.is_some(),
                refraction: curvature.map(|c| c.refraction),
            });
        }
        let told = self.curved.told();
        let distance = tidy(sight.distance, 1);
        let where_least = tidy(sight.clearance_distance, 1);
        let text = match blocked {
            None => format!(
                "visible over {distance} m, at least {} m above the ground ({where_least} m from the start; {told})\n",
                tidy(sight.clearance, 2)
            ),
            Some(at) => format!(
                "blocked {} m from the start at {},{} by ground of {} m; the line of {distance} m passes up to {} m below \
                 the ground ({where_least} m from the start; {told})\n",
                tidy(at.distance, 1),
                opened.frame.shown(at.x),
                opened.frame.shown(at.y),
                tidy(at.height, 2),
                tidy(-sight.clearance, 2)
            ),
        };
        talk.print(text)
    }
}

/// An engine's complaint about stations, in the file's coordinates.
pub fn explained(opened: &Opened, system: System, error: SightError, stations: &[(DVec2, DVec3)]) -> Failure {
    // The engine speaks of local metres; find the end it means.
    let given = |at: DVec2| stations.iter().find(|(local, _)| *local == at).map_or(at, |(_, given)| given.truncate());
    opened.failure(&match error {
        SightError::Outside(at) => opened.outside(system, given(at)),
        SightError::Void(at) => {
            let at = given(at);
            format!("expected known ground to stand on, got a void at {},{}; choose another place", at.x, at.y)
        }
        SightError::Number(..) => format!("{error}; change it"),
    })
}
