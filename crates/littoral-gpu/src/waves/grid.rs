//! Points of the sea's surface for a view: rings about a place, as far apart as a few pixels.
//!
//! A projected grid (C. Johanson, "Real-time water rendering", 2004) whose points lie on rings: along an azimuth as dense as the footprints of pixels are, for
//! which waves are filtered, too; and only over the azimuths and distances that the view sees. The rings' middle lies behind the eye, so that waves moved sideways
//! into the picture from beyond its edges are there.

use glam::{DVec2, DVec3, Vec3};
use littoral::space::View;
use littoral::waves::Bounds;

/// Pixels between points.
const APART: f64 = 3.0;
/// No more points than this, if need be farther apart.
const MOST: usize = 1_500_000;
/// Radius of the Earth (m).
const EARTH: f64 = 6_371_000.0;

/// Which points.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveGrid {
    /// The middle of the rings from the eye (m).
    pub middle: DVec2,
    /// Azimuth of the first point of a ring and from one to the next (rad, counter-clockwise from east).
    pub first: f64,
    pub step: f64,
    /// Points a ring, those that close a circle twice.
    pub columns: usize,
    /// Points after which a ring closes.
    pub circle: usize,
    /// Radii (m) of the rings, and of one more that is not drawn.
    pub radii: Vec<f32>,
    /// Whether the last ring lies at the horizon.
    pub reaches_horizon: bool,
}

impl WaveGrid {
    /// The points for a view of waves within bounds about a level (m), the land's border being no farther from the eye than `land` (m). `None` where no water
    /// can be seen.
    pub fn of(view: &View, level: f64, bounds: &Bounds, land: f64) -> Option<WaveGrid> {
        let (height, sideways) = (f64::from(bounds.height), f64::from(bounds.sideways));
        // The eye may be among the waves.
        let rise = (view.eye.z - level).abs().max(0.5);
        let rim = rim(view);
        // Steps down to the highest water and to the lowest.
        let (high, low) = ((rise - height).max(0.0), rise + height);
        let reach = |direction: &DVec3, down: f64| match direction.z < -1e-4 {
            true => down / -direction.z * direction.truncate().length(),
            false => f64::INFINITY,
        };
        let horizon = 1.1 * (2.0 * EARTH * low).sqrt() + land;
        let seen = rim.iter().map(|d| reach(d, low)).fold(0.0, f64::max);
        let down = view.clip_from_eye * Vec3::NEG_Z.extend(1.0);
        let up = view.clip_from_eye * Vec3::Z.extend(1.0);
        let within = |clip: glam::Vec4| clip.w > 0.0 && clip.x.abs() <= clip.w && clip.y.abs() <= clip.w;
        if rim.iter().all(|d| d.z > 1e-3) && rise > height && !within(down) {
            return None;
        }
        let reaches_horizon = seen >= horizon;
        let end = seen.min(horizon) * 1.02 + sideways + 1.0;
        let start = match within(down) {
            true => 0.0,
            // Edges are straight lines on the water: between two directions the nearest point is hardly nearer than either.
            false => (0.95 * rim.iter().map(|d| reach(d, high)).fold(f64::INFINITY, f64::min) - sideways).max(0.0),
        };
        let (middle, first, span) = fan(&rim, within(down) || within(up), 1.5 * sideways + 1.0);
        let back = middle.length();
        let pixel = f64::from(view.pixels_per_radian).recip();
        let mut apart = APART;
        loop {
            let full = span >= std::f64::consts::TAU;
            let circle = (span / (apart * pixel)).ceil().clamp(8.0, 1e6) as usize;
            let (start, end) = (if back > 0.0 { start.min(end) } else { start }, end + back);
            let mut radii = vec![start as f32];
            let mut radius = start;
            while radii.len() < MOST {
                let away = (radius - back).max(0.0).hypot(rise);
                let footprint = 0.65 * pixel * away * (away / rise).clamp(1.0, 50.0).sqrt();
                radius += (apart * footprint).max(0.03).max(1e-6 * radius);
                radii.push(radius as f32);
                if radius > end && radii.len() > 3 {
                    break;
                }
            }
            let columns = circle + 1;
            if columns * (radii.len() - 1) <= MOST {
                let step = span / circle as f64;
                let circle = if full { circle } else { columns };
                return Some(WaveGrid { middle, first, step, columns, circle, radii, reaches_horizon });
            }
            apart *= 1.3;
        }
    }

    /// How many rings are drawn.
    pub fn rings(&self) -> usize {
        self.radii.len() - 1
    }
}

/// Directions along the edges of the picture.
fn rim(view: &View) -> Vec<DVec3> {
    let (corner, right, down) = view.frame();
    let size = view.size.as_vec2();
    let at = |x: f32, y: f32| (corner + right * (x * size.x) + down * (y * size.y)).normalize().as_dvec3();
    let steps = (0..=8).map(|i| i as f32 / 8.0);
    steps.flat_map(|t| [at(t, 0.0), at(t, 1.0), at(0.0, t), at(1.0, t)]).collect()
}

/// The azimuths that a view sees: the middle of the fan, its first azimuth and its width, with room (m) beside the eye; all round where it looks down or up.
fn fan(rim: &[DVec3], round: bool, room: f64) -> (DVec2, f64, f64) {
    use std::f64::consts::{PI, TAU};
    let flat: Vec<DVec2> = rim.iter().map(|d| d.truncate()).filter(|d| d.length() > 1e-6).collect();
    let ahead: DVec2 = flat.iter().map(|d| d.normalize()).sum::<DVec2>().normalize_or(DVec2::X);
    let half = flat.iter().map(|d| ahead.angle_to(*d).abs()).fold(0.02, f64::max);
    if round || flat.is_empty() || half > 0.45 * PI {
        return (DVec2::ZERO, 0.0, TAU);
    }
    let half = half * 1.02;
    (-ahead * (room / half.sin()), ahead.to_angle() - half, 2.0 * half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;
    use littoral::waves::random::uniform;

    /// Whether a triangle of the grid covers a place at rest (from the eye, m).
    fn covers(grid: &WaveGrid, at: DVec2) -> bool {
        let own = at - grid.middle;
        let azimuth = (own.to_angle() - grid.first).rem_euclid(std::f64::consts::TAU);
        let (near, far) = (f64::from(grid.radii[0]), f64::from(grid.radii[grid.rings() - 1]));
        // A chord is nearer to the middle than its ends.
        let far = far * (0.5 * grid.step).cos();
        azimuth <= grid.step * (grid.columns - 1) as f64 + 1e-9 && (near..=far).contains(&own.length())
    }

    #[test]
    fn all_water_that_can_be_seen_is_on_the_grid() {
        let mut drawn = 0;
        let mut number = || {
            drawn += 1;
            uniform(5, drawn, 0, 0)
        };
        let mut seen = 0;
        for _ in 0..400 {
            let height = 10f64.powf(4.0 * number());
            let eye = DVec3::new(1e5 * number(), -1e4 * number(), height);
            let (azimuth, pitch) = (6.3 * number(), 2.9 * number() - 2.1);
            let ahead = DVec3::new(azimuth.cos() * pitch.cos(), azimuth.sin() * pitch.cos(), pitch.sin());
            let view = View::looking_at(eye, eye + ahead * 100.0, 0.2 + number() as f32, UVec2::new(160, 90));
            let bounds = Bounds { height: 2.5, sideways: 3.0, ..Bounds::default() };
            let grid = WaveGrid::of(&view, 0.0, &bounds, 0.0);
            let (corner, right, down) = view.frame();
            for _ in 0..50 {
                let pixel = right * (160.0 * number() as f32) + down * (90.0 * number() as f32);
                let direction = (corner + pixel).as_dvec3().normalize();
                let level = 5.0 * number() - 2.5;
                let t = (level - eye.z) / direction.z;
                let at = direction.truncate() * t;
                if t <= 0.0 || at.length() > 0.9 * (2.0 * EARTH * height).sqrt() || height < 2.6 {
                    continue;
                }
                let moved = DVec2::from_angle(6.3 * number()) * 3.0 * number();
                let grid = grid.as_ref().expect("water is seen");
                assert!(covers(grid, at - moved), "{at} of {height} m, pitch {pitch}: {grid:?}");
                assert!(grid.columns * grid.rings() <= MOST);
                seen += 1;
            }
        }
        assert!(seen > 5000, "{seen}");
    }

    #[test]
    fn looking_up_there_is_no_water() {
        let bounds = Bounds { height: 1.0, ..Bounds::default() };
        let view = View::looking_at(DVec3::Z * 50.0, DVec3::new(0.0, 10.0, 80.0), 0.5, UVec2::splat(64));
        assert_eq!(WaveGrid::of(&view, 0.0, &bounds, 0.0), None);
    }
}
