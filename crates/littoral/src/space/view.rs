//! A camera.
//!
//! Eye space has the world's axes and the eye as its origin (pbrt-v4's "camera-world space"), so that everything near the
//! eye keeps its precision in `f32` however far the world's origin is.

use glam::{DVec3, Mat3, Mat4, UVec2, Vec2, Vec3, camera::rh::proj::directx};

/// What a picture sees: where the eye is, what lies within the frame, and how fine a detail counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The eye, in world coordinates (m).
    pub eye: DVec3,
    /// From eye space (world axes, origin at the eye) to clip space: infinite reverse-Z, depth 1 near and 0 at infinity.
    pub clip_from_eye: Mat4,
    /// Pixels that one radian covers in the middle of the picture.
    pub pixels_per_radian: f32,
    /// How wrong a drawing may be on the screen (pixels).
    pub tolerance_pixels: f32,
    /// Width and height of the picture (pixels).
    pub size: UVec2,
}

impl View {
    /// Nearest visible distance (m). With reverse-Z in `f32` a small value costs no precision far away.
    pub const NEAR: f32 = 0.1;

    /// A perspective view from `eye` towards `target` with z up.
    ///
    /// `vertical_field` is the angle between the picture's lower and upper edge (rad), in (0, π). Looking straight up or
    /// down, north is at the picture's top. If eye and target coincide the view looks north.
    pub fn looking_at(eye: DVec3, target: DVec3, vertical_field: f32, size: UVec2) -> View {
        let forward = (target - eye).normalize_or(DVec3::Y).as_vec3().normalize();
        let right = forward.cross(Vec3::Z).try_normalize().unwrap_or(Vec3::X);
        View::oriented(eye, Mat3::from_cols(right, right.cross(forward), -forward), vertical_field, size)
    }

    /// A perspective view whose axes in the world are the columns of `eye_axes`: right, up, back.
    pub fn oriented(eye: DVec3, eye_axes: Mat3, vertical_field: f32, size: UVec2) -> View {
        let aspect = size.x.max(1) as f32 / size.y.max(1) as f32;
        let clip_from_camera = directx::perspective_infinite_reverse(vertical_field, aspect, View::NEAR);
        View {
            eye,
            clip_from_eye: clip_from_camera * Mat4::from_mat3(eye_axes.transpose()),
            pixels_per_radian: size.y as f32 / (2.0 * (0.5 * vertical_field).tan()),
            tolerance_pixels: 1.0,
            size,
        }
    }

    /// The directions that span the picture: that of the pixel coordinate (0, 0), its top left corner, and the steps to
    /// the next pixel rightward and downward. `corner + x * right + y * down` is the (unnormalised) direction, in world
    /// axes, through pixel coordinate (x, y); pixel centres lie at half-integers.
    pub fn frame(&self) -> (Vec3, Vec3, Vec3) {
        let size = self.size.as_vec2().max(Vec2::ONE);
        let eye_from_clip = self.clip_from_eye.inverse();
        // With infinite reverse-Z the plane of clip depth 0 lies at infinity: its points are directions.
        let direction = |x: f32, y: f32| (eye_from_clip * glam::Vec4::new(x, y, 1.0, 1.0)).truncate();
        let forward_scale = 1.0 / View::NEAR;
        let corner = direction(-1.0, 1.0) * forward_scale;
        let right = (direction(1.0, 1.0) * forward_scale - corner) / size.x;
        let down = (direction(-1.0, -1.0) * forward_scale - corner) / size.y;
        (corner, right, down)
    }

    /// The unit direction, in world axes, through a pixel coordinate: (0, 0) is the top left corner of the picture and
    /// pixel centres lie at half-integers.
    pub fn direction(&self, pixel: Vec2) -> Vec3 {
        let (corner, right, down) = self.frame();
        (corner + right * pixel.x + down * pixel.y).normalize()
    }

    /// Whether anything of a ball may lie in the frame: its middle from the eye (m), and its radius (m). `false` is certain.
    pub fn may_see(&self, middle: Vec3, radius: f32) -> bool {
        let [across, upward, depth] = [0, 1, 3].map(|i| self.clip_from_eye.row(i).truncate());
        let sides = [depth, depth + across, depth - across, depth + upward, depth - upward];
        sides.iter().all(|side| side.dot(middle) >= -radius * side.length())
    }

    /// The pixel coordinate at which a world point appears, or `None` when it lies behind the eye.
    pub fn pixel(&self, world: DVec3) -> Option<Vec2> {
        let clip = self.clip_from_eye * (world - self.eye).as_vec3().extend(1.0);
        (clip.w > 0.0).then(|| {
            let ndc = clip.truncate() / clip.w;
            Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * self.size.as_vec2()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_pixels_are_inverse() {
        let eye = DVec3::new(6.0e6, -3.0e6, 500.0);
        let view = View::looking_at(eye, eye + DVec3::new(3.0, 4.0, -1.0), 1.0, UVec2::new(640, 360));
        for pixel in [Vec2::new(0.5, 0.5), Vec2::new(320.0, 180.0), Vec2::new(639.5, 17.25)] {
            let there = eye + view.direction(pixel).as_dvec3() * 1000.0;
            let back = view.pixel(there).expect("in front of the eye");
            assert!((back - pixel).length() < 2e-2, "{pixel} came back as {back}");
        }
        let forward = view.direction(Vec2::new(320.0, 180.0));
        assert!((forward - Vec3::new(3.0, 4.0, -1.0).normalize()).length() < 1e-5);
        assert!(view.direction(Vec2::new(320.0, 0.0)).z > forward.z, "the top of the picture is up");
        assert!(view.pixel(eye - forward.as_dvec3()).is_none(), "behind the eye");
    }

    #[test]
    fn balls_are_missed_only_where_nothing_of_them_is_seen() {
        let size = UVec2::new(64, 48);
        let view = View::looking_at(DVec3::new(5.0, 6.0, 70.0), DVec3::new(50.0, 90.0, 20.0), 0.8, size);
        let mut missed = 0;
        for i in 0..4000u32 {
            let turn =
                |k: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(k * 40_503) >> 8) as f32 / 16_777_216.0 - 0.5;
            let (middle, radius) = (300.0 * Vec3::new(turn(1), turn(7), turn(31)), 20.0 * (turn(77) + 0.5));
            let within = |at: Vec3| {
                view.pixel(view.eye + at.as_dvec3())
                    .is_some_and(|p| p.cmpge(Vec2::ZERO).all() && p.cmple(size.as_vec2()).all())
            };
            let sees = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]
                .iter()
                .any(|to| within(middle + *to * radius) || within(middle - *to * radius));
            assert!(!sees || view.may_see(middle, radius), "{middle} {radius}");
            missed += u32::from(!view.may_see(middle, radius));
        }
        assert!(missed > 2000, "{missed}");
    }

    #[test]
    fn straight_down_has_north_at_the_top() {
        let view = View::looking_at(DVec3::Z * 100.0, DVec3::ZERO, 1.0, UVec2::new(100, 100));
        assert!(view.direction(Vec2::new(50.0, 0.0)).y > 0.1);
        assert!(view.direction(Vec2::new(100.0, 50.0)).x > 0.1);
    }
}
