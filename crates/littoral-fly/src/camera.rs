//! Four ways of moving: free flight, orbit, on foot, by boat.
//!
//! Time is an argument. A step is cut into equal parts of no more than 1/120 s, and within each, velocities approach what the hands ask for by
//! exact exponentials; so the way flown hardly depends on how many frames were drawn on it.

use glam::{DVec2, DVec3, Mat3, UVec2};
use littoral::space::View;
use std::f64::consts::{FRAC_PI_2, TAU};

/// What carries the eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Anywhere above the ground, the faster the higher.
    #[default]
    Fly,
    /// Round a point, always looking at it.
    Orbit,
    /// On the ground, at a person's height.
    Walk,
    /// On the water, lifted and tilted by its waves.
    Boat,
}

impl Mode {
    /// All of them.
    pub const ALL: [Mode; 4] = [Mode::Fly, Mode::Orbit, Mode::Walk, Mode::Boat];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Fly => "Fly",
            Mode::Orbit => "Orbit",
            Mode::Walk => "Walk",
            Mode::Boat => "Boat",
        }
    }
}

/// What the hands ask for, each from −1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hands {
    /// Forward; of a boat, the throttle.
    pub forward: f64,
    /// Sideways; of a boat, the rudder.
    pub right: f64,
    /// Up.
    pub up: f64,
    /// Turning right.
    pub turn: f64,
    /// Turning up.
    pub tilt: f64,
    /// Whether in a hurry.
    pub fast: bool,
}

/// What a camera may ask about its surroundings.
pub struct World<'a> {
    /// Height of the ground (m) at a place, `None` where there is none.
    pub ground: &'a dyn Fn(DVec2) -> Option<f64>,
    /// Height of still water (m) where a place is under it.
    pub water: &'a dyn Fn(DVec2) -> Option<f64>,
    /// South-western and north-eastern corner of the land (m).
    pub bounds: [DVec2; 2],
    /// Whether the eye may go below the surface.
    pub below: bool,
}

impl World<'_> {
    /// Height of ground or still water (m), whichever is higher.
    pub fn surface(&self, at: DVec2) -> Option<f64> {
        match ((self.ground)(at), (self.water)(at)) {
            (Some(ground), Some(water)) => Some(ground.max(water)),
            (ground, water) => ground.or(water),
        }
    }

    /// Depth of the water (m); 0 on dry land, infinite where no bed is known.
    fn depth(&self, at: DVec2) -> f64 {
        match ((self.water)(at), (self.ground)(at)) {
            (Some(water), Some(ground)) => (water - ground).max(0.0),
            (Some(_), None) => f64::INFINITY,
            (None, _) => 0.0,
        }
    }
}

/// A boat of 6 m by 2.4 m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Boat {
    /// Where its middle is (m).
    pub at: DVec2,
    /// Where its bow points (rad, clockwise from north).
    pub heading: f64,
    /// Speed through the water (m/s).
    pub speed: f64,
    /// Height of the water under it (m), bow over stern (rad) and port over starboard (rad), as they were last asked for.
    water: DVec3,
    /// The same as the boat has followed them.
    lie: DVec3,
}

/// Half the length and half the beam of a boat (m).
const HULL: DVec2 = DVec2::new(1.2, 3.0);
/// A boat needs so much water (m).
const DRAUGHT: f64 = 0.5;

impl Boat {
    /// Bow, stern, port and starboard: where the water's height is asked for.
    pub fn probes(&self) -> [DVec2; 4] {
        let bow = ahead(self.heading) * HULL.y;
        let starboard = ahead(self.heading + FRAC_PI_2) * HULL.x;
        [self.at + bow, self.at - bow, self.at - starboard, self.at + starboard]
    }

    /// Takes the heights of the water (m) at its [`Boat::probes`].
    pub fn float(&mut self, heights: [f64; 4]) {
        let [bow, stern, port, starboard] = heights;
        if heights.iter().all(|h| h.is_finite()) {
            let mean = 0.25 * heights.iter().sum::<f64>();
            self.water =
                DVec3::new(mean, ((bow - stern) / (2.0 * HULL.y)).atan(), ((port - starboard) / (2.0 * HULL.x)).atan());
        }
    }

    /// Lies on still water (m) at once.
    fn settle(&mut self, level: f64) {
        self.water = DVec3::new(level, 0.0, 0.0);
        self.lie = self.water;
    }
}

/// Where the eye is, where it looks, and what carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    mode: Mode,
    /// The eye (m).
    pub eye: DVec3,
    /// Where it looks (rad, clockwise from north).
    pub bearing: f64,
    /// Angle above the horizon (rad).
    pub pitch: f64,
    /// Right side down (rad).
    roll: f64,
    velocity: DVec3,
    /// What an orbit goes round (m).
    pub centre: DVec3,
    distance: f64,
    /// The boat.
    pub boat: Boat,
    /// Multiplies all speeds.
    pub speed: f64,
}

/// Height of a walker's eye (m).
const TALL: f64 = 1.7;
/// Height of a helmsman's eye above the water (m).
const HELM: f64 = 2.2;
/// The longest part of a step (s).
const PART: f64 = 1.0 / 120.0;
/// The longest step (s): after a pause the flight goes on where it was.
const LONGEST: f64 = 0.25;
/// No flight comes nearer to the surface than this (m).
const CLEARANCE: f64 = 1.0;
/// Slower than this (m/s) is standing still.
const STILL: f64 = 0.01;
/// The steepest look (rad), short of the pole.
const STEEPEST: f64 = FRAC_PI_2 - 0.01;
/// Turning by keys (rad/s).
const TURN: f64 = 1.1;

/// The horizontal unit vector of a bearing.
fn ahead(bearing: f64) -> DVec2 {
    DVec2::new(bearing.sin(), bearing.cos())
}

impl Camera {
    /// A flying camera at `eye` that looks along `direction`.
    pub fn new(eye: DVec3, direction: DVec3) -> Camera {
        let mut camera = Camera {
            mode: Mode::Fly,
            eye,
            bearing: 0.0,
            pitch: 0.0,
            roll: 0.0,
            velocity: DVec3::ZERO,
            centre: eye + direction * 1000.0,
            distance: 1000.0,
            boat: Boat::default(),
            speed: 1.0,
        };
        camera.look_along(direction);
        camera
    }

    /// What carries it.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Where it looks.
    pub fn direction(&self) -> DVec3 {
        (ahead(self.bearing) * self.pitch.cos()).extend(self.pitch.sin())
    }

    /// Looks along a direction.
    pub fn look_along(&mut self, direction: DVec3) {
        let direction = direction.normalize_or(DVec3::Y);
        if direction.truncate().length() > 1e-9 {
            self.bearing = direction.x.atan2(direction.y).rem_euclid(TAU);
        }
        self.pitch = direction.z.clamp(-1.0, 1.0).asin().clamp(-STEEPEST, STEEPEST);
    }

    /// Turns the look by a mouse's movement: rightward and upward (rad).
    pub fn look(&mut self, by: DVec2) {
        match self.mode {
            // The mouse turns the world: the eye goes round the other way.
            Mode::Orbit => self.go_round(by.x, by.y, 1.0),
            _ => {
                self.bearing = (self.bearing + by.x).rem_euclid(TAU);
                self.pitch = (self.pitch + by.y).clamp(-STEEPEST, STEEPEST);
            }
        }
    }

    /// Nearer to the centre of an orbit, by e to the power of this.
    pub fn zoom(&mut self, by: f64) {
        if self.mode == Mode::Orbit {
            self.go_round(0.0, 0.0, (-by).exp());
        }
    }

    /// Changes what carries it, and so where it is: an orbit goes round what is looked at (`seen`), a walker comes down to the ground,
    /// a boat to the nearest water. An error says why it stays what it was.
    pub fn change(&mut self, mode: Mode, seen: Option<DVec3>, world: &World) -> Result<(), String> {
        match mode {
            Mode::Fly => {}
            Mode::Orbit => {
                self.centre = seen.unwrap_or(self.eye + self.direction() * self.distance.max(10.0));
                self.distance = (self.centre - self.eye).length().max(1.0);
                self.look_along(self.centre - self.eye);
            }
            Mode::Walk => {
                let ground = |at: DVec2| (world.ground)(at).map(|_| at);
                let at = near(self.eye.truncate(), seen, world.bounds, ground)
                    .ok_or("expected ground to walk on, found none here; fly somewhere else")?;
                self.eye = at.extend(self.eye.z);
                self.pitch = self.pitch.clamp(-0.5, 0.5);
                self.stand(world);
            }
            Mode::Boat => {
                let wet = |at: DVec2| (world.depth(at) > 2.0 * DRAUGHT).then_some(at);
                let at = near(self.eye.truncate(), seen, world.bounds, wet)
                    .ok_or("expected water to float on, found none here; fly to the sea, or raise the water's level")?;
                self.boat = Boat { at, heading: self.bearing, ..Boat::default() };
                self.boat.settle((world.water)(at).unwrap_or(0.0));
                self.pitch = self.pitch.clamp(-0.3, 0.3);
                self.board();
            }
        }
        self.mode = mode;
        self.velocity = DVec3::ZERO;
        if mode != Mode::Boat {
            self.roll = 0.0;
        }
        Ok(())
    }

    /// Goes on for `seconds`.
    pub fn step(&mut self, hands: &Hands, seconds: f64, world: &World) {
        let seconds = if seconds.is_finite() { seconds.clamp(0.0, LONGEST) } else { 0.0 };
        let parts = (seconds / PART - 1e-6).ceil().max(1.0);
        for _ in 0..parts as u32 {
            self.part(hands, seconds / parts, world);
        }
    }

    fn part(&mut self, hands: &Hands, dt: f64, world: &World) {
        let hurry = if hands.fast { 4.0 } else { 1.0 };
        if self.mode == Mode::Orbit {
            let rate = 0.6 * self.speed * hurry * dt;
            let turn = hands.right + hands.turn;
            self.go_round(-turn * rate, -(hands.up + hands.tilt) * rate, (-hands.forward * rate * 1.5).exp());
            self.rise(world);
            return;
        }
        self.bearing = (self.bearing + hands.turn * TURN * dt).rem_euclid(TAU);
        self.pitch = (self.pitch + hands.tilt * TURN * dt).clamp(-STEEPEST, STEEPEST);
        match self.mode {
            Mode::Fly | Mode::Orbit => {
                let wanted = self.direction() * hands.forward
                    + ahead(self.bearing + FRAC_PI_2).extend(0.0) * hands.right
                    + DVec3::Z * hands.up;
                let speed = self.flying_speed(world) * hurry;
                self.glide(wanted.clamp_length_max(1.0) * speed, 0.25, dt);
                self.rise(world);
            }
            Mode::Walk => {
                let level = ahead(self.bearing) * hands.forward + ahead(self.bearing + FRAC_PI_2) * hands.right;
                let before = self.eye;
                self.glide((level.clamp_length_max(1.0) * 1.6 * self.speed * hurry).extend(0.0), 0.1, dt);
                // The data's edge is a wall.
                if (world.ground)(self.eye.truncate()).is_none() {
                    (self.eye, self.velocity) = (before, DVec3::ZERO);
                }
                self.stand(world);
            }
            Mode::Boat => self.sail(hands, dt, world),
        }
    }

    /// How fast one flies here (m/s): the faster the higher.
    pub fn flying_speed(&self, world: &World) -> f64 {
        let height = world.surface(self.eye.truncate()).map_or(self.eye.z, |surface| self.eye.z - surface);
        (0.7 * height.abs()).clamp(8.0, 20_000.0) * self.speed
    }

    /// Moves while the velocity approaches a wanted one: v + (v₀ − v)·e^(−t/τ), integrated.
    fn glide(&mut self, wanted: DVec3, lag: f64, dt: f64) {
        let left = (-dt / lag).exp();
        self.eye += wanted * dt + (self.velocity - wanted) * (lag * (1.0 - left));
        self.velocity = wanted + (self.velocity - wanted) * left;
        // Who hardly moves rests, and so does the picture.
        if wanted == DVec3::ZERO && self.velocity.length() < STILL {
            self.velocity = DVec3::ZERO;
        }
    }

    /// Not below the surface, unless that is allowed.
    fn rise(&mut self, world: &World) {
        if let Some(surface) = world.surface(self.eye.truncate()).filter(|_| !world.below)
            && self.eye.z < surface + CLEARANCE
        {
            self.eye.z = surface + CLEARANCE;
            self.velocity.z = self.velocity.z.max(0.0);
            if self.mode == Mode::Orbit {
                self.look_along(self.centre - self.eye);
            }
        }
    }

    /// On the ground, wading at most up to the chin.
    fn stand(&mut self, world: &World) {
        let at = self.eye.truncate();
        let ground = (world.ground)(at).map(|ground| ground + TALL);
        let water = (world.water)(at).map(|water| water + 0.3);
        if let Some(z) = ground.into_iter().chain(water).reduce(f64::max) {
            self.eye.z = z;
        }
    }

    fn go_round(&mut self, turn: f64, tilt: f64, nearer: f64) {
        self.bearing = (self.bearing + turn).rem_euclid(TAU);
        self.pitch = (self.pitch + tilt).clamp(-STEEPEST, STEEPEST);
        self.distance = (self.distance * nearer).clamp(1.0, 1e7);
        self.eye = self.centre - self.direction() * self.distance;
    }

    fn sail(&mut self, hands: &Hands, dt: f64, world: &World) {
        let boat = &mut self.boat;
        let hurry = if hands.fast { 2.0 } else { 1.0 };
        // Six knots cruising; half astern.
        let wanted = if hands.forward < 0.0 { 0.5 * hands.forward } else { hands.forward } * 3.1 * hurry * self.speed;
        let left = (-dt / 2.5).exp();
        boat.speed = wanted + (boat.speed - wanted) * left;
        // A rudder works by the water that runs past it.
        let turned = hands.right * 0.4 * boat.speed / (boat.speed.abs() + 1.5) * dt;
        boat.heading = (boat.heading + turned).rem_euclid(TAU);
        self.bearing = (self.bearing + turned).rem_euclid(TAU);
        let next = boat.at + ahead(boat.heading) * boat.speed * dt;
        if world.depth(next) > DRAUGHT {
            boat.at = next
        } else {
            boat.speed = 0.0
        }
        let left = (-dt / 0.2).exp();
        boat.lie = boat.water + (boat.lie - boat.water) * left;
        self.board();
    }

    /// The eye of the helmsman.
    fn board(&mut self) {
        self.eye = self.boat.at.extend(self.boat.lie.x + HELM);
    }

    /// What the eye sees in a picture of `size` with an angle of `field` (rad) from bottom to top. `wider` widens both, at the same number of
    /// pixels a radian: 1 for the picture itself.
    pub fn view(&self, field: f64, size: UVec2, wider: f64) -> View {
        let (mut pitch, mut roll) = (self.pitch, self.roll);
        if self.mode == Mode::Boat {
            // Looking ahead one pitches with the boat, looking abeam one rolls.
            let (s, c) = (self.bearing - self.boat.heading).sin_cos();
            pitch += self.boat.lie.y * c - self.boat.lie.z * s;
            roll += self.boat.lie.z * c + self.boat.lie.y * s;
        }
        let forward = (ahead(self.bearing) * pitch.cos()).extend(pitch.sin());
        let level = ahead(self.bearing + FRAC_PI_2).extend(0.0);
        let up = level.cross(forward);
        let (s, c) = roll.sin_cos();
        let (right, up) = (level * c - up * s, up * c + level * s);
        let axes = Mat3::from_cols(right.as_vec3(), up.as_vec3(), -forward.as_vec3());
        let field = 2.0 * ((0.5 * field).tan() * wider).atan();
        let size = (size.as_dvec2() * wider).round().as_uvec2().max(UVec2::ONE);
        View::oriented(self.eye, axes, field as f32, size)
    }
}

/// The nearest place from `at` outward that has what is wanted, what is looked at being asked first if it is within sight.
fn near(at: DVec2, seen: Option<DVec3>, bounds: [DVec2; 2], has: impl Fn(DVec2) -> Option<DVec2>) -> Option<DVec2> {
    const RINGS: u32 = 64;
    let extent = (bounds[1] - bounds[0]).length();
    let inside = at.clamp(bounds[0], bounds[1]);
    has(at).or_else(|| seen.and_then(|seen| has(seen.truncate()))).or_else(|| {
        (0..=RINGS).find_map(|ring| {
            let radius = extent * (f64::from(ring) / f64::from(RINGS)).powi(2);
            (0..32).find_map(|i| has(inside + DVec2::from_angle(TAU * f64::from(i) / 32.0) * radius))
        })
    })
}

#[cfg(test)]
mod tests;
