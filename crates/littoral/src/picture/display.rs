//! A rendered picture, and its way to a screen.

use super::texture::encode_srgb;
use glam::{DVec3, Mat3, UVec2, Vec3};
use rayon::prelude::*;

/// What a view sees: planes of numbers, one a pixel, row by row from the top left.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height (pixels).
    pub size: UVec2,
    /// Where the eye was (m), which `position` is relative to.
    pub eye: DVec3,
    /// What `radiance` is a picture of, and so how it wants to be shown.
    pub medium: Medium,
    /// Radiance of a white sheet lying level in the light (kcd/m²), if that is to be shown as white: as in a studio. In a landscape
    /// evening light stays warm: [1, 1, 1].
    pub white: [f32; 3],
    /// Radiance as linear Rec. 709 red, green, blue, in kilocandela per square metre.
    pub radiance: Vec<[f32; 3]>,
    /// Distance from the eye along the ray (m); infinite where there is neither land nor water.
    pub depth: Vec<f32>,
    /// Unit normal of what is seen, in world axes; zero where there is neither land nor water.
    pub normal: Vec<[f32; 3]>,
    /// Position relative to the eye (m), in world axes; infinite where there is neither land nor water.
    pub position: Vec<[f32; 3]>,
    /// Height of what is seen (m); NaN where there is neither land nor water.
    pub height: Vec<f32>,
    /// Share of the pixel that is not sky, in [0, 1].
    pub coverage: Vec<f32>,
}

/// What a picture's radiance is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Medium {
    /// Light of a landscape: exposed, and shown with the contrast and colour of film.
    #[default]
    Photograph,
    /// Light on a model whose colours mean something: shown as their shares of a white sheet's, but for the brightest.
    Model,
    /// The reflectance of paper, shown as it is.
    Paper,
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
    /// A black picture of sky alone, for those who fill it.
    pub fn empty(size: UVec2, eye: DVec3) -> Picture {
        let pixels = size.x as usize * size.y as usize;
        Picture {
            size,
            eye,
            medium: Medium::Photograph,
            white: [1.0; 3],
            radiance: vec![[0.0; 3]; pixels],
            depth: vec![f32::INFINITY; pixels],
            normal: vec![[0.0; 3]; pixels],
            position: vec![[f32::INFINITY; 3]; pixels],
            height: vec![f32::NAN; pixels],
            coverage: vec![0.0; pixels],
        }
    }

    /// The radiance that an automatic exposure shows as middle grey (kcd/m²). For a model that of a card that throws back 0.18;
    /// for a photograph the logarithmic mean of what is neither among the
    /// darkest tenth of the picture nor among the brightest, so that neither the sun's glitter nor a black corner decides.
    pub fn grey(&self) -> f32 {
        if self.medium == Medium::Model {
            return 0.18 * luminance(self.white);
        }
        let mut logs: Vec<f32> = self.radiance.iter().map(|p| luminance(*p).max(1e-9).ln()).collect();
        if logs.is_empty() {
            return 1.0;
        }
        logs.sort_unstable_by(f32::total_cmp);
        let (from, to) = (logs.len() / 10, logs.len() - logs.len() / 10);
        let middle = &logs[from..to.max(from + 1)];
        let mean = middle.iter().map(|l| f64::from(*l)).sum::<f64>() / middle.len() as f64;
        mean.exp() as f32
    }

    /// The picture for an sRGB screen, 8 bits a channel, row by row.
    pub fn display(&self, how: &Display) -> Vec<[u8; 3]> {
        if self.medium == Medium::Paper {
            let shown = |p: &[f32; 3]| p.map(|v| (encode_srgb(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8);
            return self.radiance.par_iter().map(shown).collect();
        }
        let grey = match how.exposure {
            Exposure::Automatic => self.grey(),
            Exposure::Grey(grey) => grey,
        };
        let model = self.medium == Medium::Model;
        let scale = if model { 0.18 } else { 0.30 } / grey.max(1e-9) * how.compensation.exp2();
        // A white sheet is shown white, whatever the colour of the light.
        let balance = luminance(self.white) / Vec3::from(self.white).max(Vec3::splat(1e-9));
        self.radiance
            .par_iter()
            .map(|p| {
                let light = Vec3::from(*p) * scale;
                let shown = if model { print(light * balance) } else { film(light * balance, 1.35, 1.28) };
                // What lies between two steps of the screen is rounded; skies are graded finely enough by sampling noise.
                shown.to_array().map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
            })
            .collect()
    }
}

/// Print: reflectance to display values in [0, 1] (encoded for the screen), true to colour but for what is nearly white and brighter.
fn print(light: Vec3) -> Vec3 {
    const SHOULDER: f32 = 0.75;
    light.map(|v| {
        let over = (v - SHOULDER).max(0.0) / (1.0 - SHOULDER);
        encode_srgb(v.clamp(0.0, SHOULDER) + (1.0 - SHOULDER) * (1.0 - (-over).exp()))
    })
}

/// Film: linear light to display values in [0, 1] (already encoded for the screen). T. Sobotka's AgX, in B. Wrensch's polynomial form
/// (2023): colours lose saturation as they brighten, as on film, and nothing clips. `contrast` and
/// `colour` of 1 are AgX's neutral look.
fn film(light: Vec3, contrast: f32, colour: f32) -> Vec3 {
    const INSET: Mat3 = Mat3::from_cols_array(&[
        0.842_479_1,
        0.042_328_24,
        0.042_375_65,
        0.078_433_6,
        0.878_468_6,
        0.078_433_6,
        0.079_223_745,
        0.079_166_13,
        0.879_143,
    ]);
    const OUTSET: Mat3 = Mat3::from_cols_array(&[
        1.196_879,
        -0.052_896_85,
        -0.052_971_635,
        -0.098_020_88,
        1.151_903_1,
        -0.098_043_45,
        -0.099_029_74,
        -0.098_961_18,
        1.151_073_7,
    ]);
    const LEAST: f32 = -12.473_93;
    const MOST: f32 = 4.026_069;
    let x = (INSET * light.max(Vec3::ZERO)).map(|v| (v.max(1e-10).log2().clamp(LEAST, MOST) - LEAST) / (MOST - LEAST));
    let (x2, x4) = (x * x, x * x * x * x);
    let curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32;
    let curve = curve.clamp(Vec3::ZERO, Vec3::ONE).map(|v| v.powf(contrast));
    let grey = Vec3::splat(luminance(curve.to_array()));
    OUTSET * (grey + (curve - grey) * colour).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Luminance of a linear Rec. 709 colour.
pub(super) fn luminance(c: [f32; 3]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}
