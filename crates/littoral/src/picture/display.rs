//! A rendered picture, and its way to a screen.

use super::texture::encode_srgb;
use glam::{DVec3, UVec2, Vec3};

/// What a view sees: planes of numbers, one a pixel, row by row from the top left.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height (pixels).
    pub size: UVec2,
    /// Where the eye was (m), which `position` is relative to.
    pub eye: DVec3,
    /// Radiance as linear Rec. 709 red, green, blue, in kilocandela per square metre.
    pub radiance: Vec<[f32; 3]>,
    /// Distance from the eye along the ray (m); infinite where there is sky.
    pub depth: Vec<f32>,
    /// Unit normal of what is seen, in world axes; zero where there is sky.
    pub normal: Vec<[f32; 3]>,
    /// Position relative to the eye (m), in world axes; infinite where there is sky.
    pub position: Vec<[f32; 3]>,
    /// Height of what is seen (m); NaN where there is sky.
    pub height: Vec<f32>,
    /// Share of the pixel that is not sky, in [0, 1].
    pub coverage: Vec<f32>,
}

/// How bright a picture is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// As a camera would expose it.
    #[default]
    Automatic,
    /// The radiance (kcd/m²) that is shown as middle grey. A film is steady when every frame has the same.
    Grey(f32),
}

/// How radiance becomes numbers for a screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// How bright.
    pub exposure: Exposure,
    /// Brighter (positive) or darker, in stops, on top of `exposure`.
    pub compensation: f32,
}

impl Default for Display {
    fn default() -> Display {
        Display { exposure: Exposure::Automatic, compensation: 0.0 }
    }
}

impl Picture {
    /// The radiance that an automatic exposure shows as middle grey (kcd/m²).
    pub fn grey(&self) -> f32 {
        let mut sum = 0.0f64;
        for p in &self.radiance {
            sum += f64::from(luminance(*p).max(1e-6)).ln();
        }
        (sum / self.radiance.len().max(1) as f64).exp() as f32
    }

    /// The picture for an sRGB screen, 8 bits a channel.
    pub fn display(&self, how: &Display) -> Vec<[u8; 3]> {
        let grey = match how.exposure {
            Exposure::Automatic => self.grey(),
            Exposure::Grey(grey) => grey,
        };
        let scale = 0.18 / grey.max(1e-12) * how.compensation.exp2();
        self.radiance
            .iter()
            .map(|p| {
                let c = Vec3::from(*p) * scale;
                let c = c / (c + 1.0) * 1.1;
                c.to_array().map(|v| (encode_srgb(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8)
            })
            .collect()
    }
}

/// Luminance of a linear Rec. 709 colour.
pub(super) fn luminance(c: [f32; 3]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}
