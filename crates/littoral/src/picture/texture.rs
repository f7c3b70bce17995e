//! Pictures to lay over the ground, with mip maps.
//!
//! Texels are decoded to linear light once and averaged there. A footprint is read as several trilinear probes along its
//! longer axis (as in J. McCormack et al., "Feline: fast elliptical lines for anisotropic texture mapping", SIGGRAPH 1999),
//! so that grazing views stay sharp across without shimmering along.

use glam::{DAffine2, DVec2, UVec2, Vec3};

/// A colour picture with its mip pyramid, in linear light.
#[derive(Clone, Debug)]
pub struct Texture {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    size: UVec2,
    texels: Vec<[f32; 3]>,
}

impl Texture {
    /// A texture of `size` texels (columns, rows), row by row from the top, in 8-bit sRGB.
    ///
    /// # Panics
    /// If a side is zero or the number of texels is not columns × rows.
    pub fn from_srgb(size: UVec2, texels: &[[u8; 3]]) -> Texture {
        assert!(size.min_element() > 0, "expected a picture of at least one texel, got {size}");
        assert_eq!(texels.len(), size.x as usize * size.y as usize, "expected one colour for each texel");
        let linear: [f32; 256] = std::array::from_fn(|i| decode_srgb(i as f32 / 255.0));
        let texels = texels.iter().map(|t| t.map(|v| linear[usize::from(v)])).collect();
        Texture::from_linear(size, texels)
    }

    /// A texture of `size` texels (columns, rows), row by row from the top, in linear light.
    ///
    /// # Panics
    /// If a side is zero or the number of texels is not columns × rows.
    pub fn from_linear(size: UVec2, texels: Vec<[f32; 3]>) -> Texture {
        assert!(size.min_element() > 0, "expected a picture of at least one texel, got {size}");
        assert_eq!(texels.len(), size.x as usize * size.y as usize, "expected one colour for each texel");
        let mut levels = vec![Level { size, texels }];
        while let Some(coarser) = levels.last().and_then(Level::halved) {
            levels.push(coarser);
        }
        Texture { levels }
    }

    /// Columns and rows of the finest level.
    pub fn size(&self) -> UVec2 {
        self.levels[0].size
    }

    /// Size and texels (linear light, row by row from the top) of every level, from the finest on: each half as large as the one before, to a single texel.
    pub fn levels(&self) -> impl Iterator<Item = (UVec2, &[[f32; 3]])> {
        self.levels.iter().map(|level| (level.size, &level.texels[..]))
    }

    /// The mean colour about `uv` ((0, 0) top left, (1, 1) bottom right) over the parallelogram that `along` and `across`
    /// (in uv) span. Clamped at the borders.
    pub fn sample(&self, uv: DVec2, along: DVec2, across: DVec2) -> Vec3 {
        let size = self.size().as_dvec2();
        let (mut long, mut short) = (along * size, across * size);
        if long.length_squared() < short.length_squared() {
            std::mem::swap(&mut long, &mut short);
        }
        let probes = (long.length() / short.length().max(1.0)).ceil().clamp(1.0, 8.0);
        let width = (long.length() / probes).max(short.length()).max(1.0);
        let level = width.log2() as f32;
        let step = long / size / probes;
        let mut sum = Vec3::ZERO;
        for i in 0..probes as u32 {
            sum += self.trilinear(uv + step * (f64::from(i) + 0.5 - 0.5 * probes), level);
        }
        sum / probes as f32
    }

    fn trilinear(&self, uv: DVec2, level: f32) -> Vec3 {
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        let (fine, blend) = (level as usize, level.fract());
        let a = self.levels[fine].bilinear(uv);
        if blend == 0.0 { a } else { a.lerp(self.levels[fine + 1].bilinear(uv), blend) }
    }
}

impl Level {
    fn texel(&self, x: u32, y: u32) -> Vec3 {
        let (x, y) = (x.min(self.size.x - 1), y.min(self.size.y - 1));
        Vec3::from(self.texels[y as usize * self.size.x as usize + x as usize])
    }

    fn bilinear(&self, uv: DVec2) -> Vec3 {
        let at = (uv * self.size.as_dvec2() - 0.5).clamp(DVec2::ZERO, (self.size - 1).as_dvec2());
        let (base, f) = (at.as_uvec2(), at.fract().as_vec2());
        let south = self.texel(base.x, base.y).lerp(self.texel(base.x + 1, base.y), f.x);
        let north = self.texel(base.x, base.y + 1).lerp(self.texel(base.x + 1, base.y + 1), f.x);
        south.lerp(north, f.y)
    }

    /// The next coarser level, `None` for a single texel. Each texel averages the two or three of an uneven side.
    fn halved(&self) -> Option<Level> {
        if self.size == UVec2::ONE {
            return None;
        }
        let size = (self.size / 2).max(UVec2::ONE);
        let span = |i: u32, coarse: u32, fine: u32| (i * fine / coarse, ((i + 1) * fine).div_ceil(coarse));
        let mut texels = Vec::with_capacity(size.x as usize * size.y as usize);
        for y in 0..size.y {
            for x in 0..size.x {
                let ((x0, x1), (y0, y1)) = (span(x, size.x, self.size.x), span(y, size.y, self.size.y));
                let mut sum = Vec3::ZERO;
                for j in y0..y1 {
                    for i in x0..x1 {
                        sum += self.texel(i, j);
                    }
                }
                texels.push((sum / ((x1 - x0) * (y1 - y0)) as f32).to_array());
            }
        }
        Some(Level { size, texels })
    }
}

/// A picture and where on the ground it lies.
#[derive(Clone, Debug)]
pub struct Drape {
    /// The picture.
    pub texture: Texture,
    /// From the land's coordinates (m) to the picture's: (0, 0) top left, (1, 1) bottom right.
    pub uv_from_local: DAffine2,
}

impl Drape {
    /// The mean colour of the ground about `at` (m) over the parallelogram spanned by `along` and `across` (m); `None`
    /// outside the picture.
    pub fn colour(&self, at: DVec2, along: DVec2, across: DVec2) -> Option<Vec3> {
        let uv = self.uv_from_local.transform_point2(at);
        let inside = uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all();
        let into = |v: DVec2| self.uv_from_local.transform_vector2(v);
        inside.then(|| self.texture.sample(uv, into(along), into(across)))
    }
}

/// Linear light of an sRGB value in [0, 1] (IEC 61966-2-1).
pub(super) fn decode_srgb(v: f32) -> f32 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB value of linear light in [0, 1]: the inverse of [`decode_srgb`].
pub(super) fn encode_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_keeps_the_mean() {
        let size = UVec2::new(13, 6);
        let texels: Vec<[u8; 3]> =
            (0..size.x * size.y).map(|i| [(i * 37 % 256) as u8, (i * 91 % 256) as u8, 7]).collect();
        let even = Texture::from_srgb(UVec2::new(16, 8), &vec![[128, 3, 250]; 128]);
        for level in &even.levels {
            for t in &level.texels {
                assert!((Vec3::from(*t) - Vec3::from(even.levels[0].texels[0])).length() < 1e-6);
            }
        }
        let uneven = Texture::from_srgb(size, &texels);
        assert_eq!(uneven.levels.last().expect("one at least").size, UVec2::ONE);
        let far = uneven.sample(DVec2::splat(0.5), DVec2::X * 3.0, DVec2::Y * 3.0);
        assert!((far - Vec3::from(uneven.levels.last().expect("one at least").texels[0])).length() < 1e-6);
    }

    #[test]
    fn srgb_round_trips() {
        for i in 0..=255u8 {
            let v = f32::from(i) / 255.0;
            assert!((encode_srgb(decode_srgb(v)) - v).abs() < 1e-5);
        }
    }

    #[test]
    fn texel_centres_are_read_exactly() {
        let texture = Texture::from_linear(UVec2::new(2, 2), vec![[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]]);
        let at = |u, v| texture.sample(DVec2::new(u, v), DVec2::ZERO, DVec2::ZERO).x;
        assert_eq!([at(0.25, 0.25), at(0.75, 0.25), at(0.25, 0.75), at(0.75, 0.75)], [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(at(0.5, 0.5), 1.5);
    }
}
