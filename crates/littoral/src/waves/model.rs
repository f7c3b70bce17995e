//! What a model of waves answers.

use glam::DVec2;
use std::any::Any;

/// How many points are asked about at once: as many as fill the widest vector registers.
pub const BLOCK: usize = 16;

/// Places on still water.
#[derive(Clone, Copy, Debug)]
pub struct Points {
    /// Eastward (m).
    pub x: [f64; BLOCK],
    /// Northward (m).
    pub y: [f64; BLOCK],
    /// Width of what is looked at (m), at least 0: waves shorter than twice this are left out of the motion and told as its
    /// hidden slopes instead. 0 for everything.
    pub footprint: [f32; BLOCK],
}

impl Points {
    /// All at one place, with everything.
    pub fn at(x: f64, y: f64) -> Points {
        Points { x: [x; BLOCK], y: [y; BLOCK], footprint: [0.0; BLOCK] }
    }
}

/// How water that rests at some points is displaced at an instant, and how that changes from point to point.
///
/// The surface is what the map X → X + (dx, dy), raised by dz, makes of still water. Models without sideways motion leave all but
/// `dz` and its slopes at 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Displacement eastward (m).
    pub dx: [f32; BLOCK],
    /// Displacement northward (m).
    pub dy: [f32; BLOCK],
    /// Displacement upward (m).
    pub dz: [f32; BLOCK],
    /// ∂dz/∂X.
    pub slope_x: [f32; BLOCK],
    /// ∂dz/∂Y.
    pub slope_y: [f32; BLOCK],
    /// ∂dx/∂X.
    pub dxx: [f32; BLOCK],
    /// ∂dx/∂Y, which is also ∂dy/∂X where the motion has no curl, and else the mean of both.
    pub dxy: [f32; BLOCK],
    /// ∂dy/∂Y.
    pub dyy: [f32; BLOCK],
    /// Variance of the eastward slopes of the waves that the footprint left out.
    pub hidden_xx: [f32; BLOCK],
    /// Their covariance with the northward slopes.
    pub hidden_xy: [f32; BLOCK],
    /// Variance of the northward slopes.
    pub hidden_yy: [f32; BLOCK],
    /// How much of the surface is foam, in [0, 1].
    pub foam: [f32; BLOCK],
}

impl Motion {
    /// Still water.
    pub const STILL: Motion = Motion {
        dx: [0.0; BLOCK],
        dy: [0.0; BLOCK],
        dz: [0.0; BLOCK],
        slope_x: [0.0; BLOCK],
        slope_y: [0.0; BLOCK],
        dxx: [0.0; BLOCK],
        dxy: [0.0; BLOCK],
        dyy: [0.0; BLOCK],
        hidden_xx: [0.0; BLOCK],
        hidden_xy: [0.0; BLOCK],
        hidden_yy: [0.0; BLOCK],
        foam: [0.0; BLOCK],
    };
}

/// How fast water moves at some points (m/s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Velocity {
    /// Eastward.
    pub x: [f32; BLOCK],
    /// Northward.
    pub y: [f32; BLOCK],
    /// Upward.
    pub z: [f32; BLOCK],
}

impl Velocity {
    /// Water at rest.
    pub const STILL: Velocity = Velocity { x: [0.0; BLOCK], y: [0.0; BLOCK], z: [0.0; BLOCK] };
}

/// How far a model can go at the instant it is set to: nothing exceeds these anywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Largest |dz| (m).
    pub height: f32,
    /// Largest length of (dx, dy) (m).
    pub sideways: f32,
    /// Largest length of the gradient of dz.
    pub slope: f32,
    /// Largest magnitude of the stretch (spectral norm) of (dx, dy).
    pub stretch: f32,
    /// Largest second derivative of dz along any direction (1/m).
    pub curvature: f32,
    /// Largest second derivative of (dx, dy) along any direction (1/m).
    pub bend: f32,
}

/// A moving surface of waves over still water.
///
/// A model stands at an instant ([`WaveModel::set_time`]) and answers for any points there. What it answers depends on that instant
/// alone, never on those before it. As [`Any`], a model can be asked which one it is: renderers elsewhere work out some themselves.
pub trait WaveModel: Any + Send + Sync {
    /// Goes to an instant (s), forward or back. Allocates nothing when warm.
    fn set_time(&mut self, seconds: f64);

    /// The instant it stands at (s).
    fn time(&self) -> f64;

    /// Adds its displacements at `points` to `dx`, `dy` and `dz` of `motion`: to the bit what [`WaveModel::add_motion`] adds there.
    fn add_displacement(&self, points: &Points, motion: &mut Motion);

    /// Adds everything it knows of the motion at `points`; foam grows to cover what either covers.
    fn add_motion(&self, points: &Points, motion: &mut Motion);

    /// Adds the velocity of the water that rests `depths` (m, at least 0) below still water at `points`.
    fn add_velocity(&self, points: &Points, depths: &[f32; BLOCK], velocity: &mut Velocity);

    /// [`WaveModel::add_displacement`] of many blocks, to the bit: faster where neighbouring blocks are near each other. As many blocks are
    /// answered as the shorter slice has.
    fn add_displacements(&self, points: &[Points], motions: &mut [Motion]) {
        points.iter().zip(motions).for_each(|(points, motion)| self.add_displacement(points, motion));
    }

    /// [`WaveModel::add_motion`] of many blocks, likewise.
    fn add_motions(&self, points: &[Points], motions: &mut [Motion]) {
        points.iter().zip(motions).for_each(|(points, motion)| self.add_motion(points, motion));
    }

    /// How far it goes at this instant, with everything (footprint 0).
    fn bounds(&self) -> Bounds;

    /// Greatest height and sideways displacement (m) of the waves shorter than `wavelength` (m) at this instant: what an error is to land. Falls
    /// to 0 with the wavelength.
    fn roughness(&self, wavelength: f32) -> f32;

    /// How fast (m/s) its surface goes up or down at a place that stays, at most: what a height that is a while old is off by. All but never passed
    /// where waves are random (six standard deviations); infinite for models that do not know.
    fn rise_speed(&self) -> f32 {
        f32::INFINITY
    }

    /// How high (m) above still water its waves run up a beach at a place (m), at most; 0 for models that know of none.
    fn run_up(&self, _at: DVec2) -> f32 {
        0.0
    }
}
