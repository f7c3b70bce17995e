//! Heights in colours: the Terrarium and Terrain-RGB codes of web map tiles, told from each other and from pictures by what
//! the colours decode to.
//!
//! Terrarium (Mapzen, "Terrain Tiles: formats"): height = 256 R + G + B / 256 − 32 768.
//! Terrain-RGB (Mapbox, "Mapbox Terrain-RGB v1"): height = −10 000 + 0.1 (65 536 R + 256 G + B).
//!
//! Heights of this Earth need R = 81 … 163 in the first and R = 0 … 2 in the second, so plausible heights in nearly all
//! pixels decide between the two. A picture that happens to have such reds is found out by its carries: where R of a true
//! code steps, G jumps back, so that the height goes on smoothly; in a picture neighbouring channels step together and the
//! height jumps by about a whole step of R.

use crate::voids::PLAUSIBLE;

/// A code for heights in 24 bits of colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Mapzen's, in 1/256 m.
    Terrarium,
    /// Mapbox's, in 1/10 m.
    TerrainRgb,
}

/// What the pixels of a picture of heights mean, where whoever opens it knows better than [`detect`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// A code of 24 bits.
    Code(Code),
    /// Greys are metres, also where they are stored as colours.
    Grey,
}

/// Set in a pixel that is transparent: there is no data.
pub const TRANSPARENT: u32 = 1 << 24;

impl Code {
    /// The height (m) of `0xRRGGBB`; NaN where transparent, implausible, or the code's own "nothing" (black in Terrain-RGB).
    pub fn height(self, pixel: u32) -> f32 {
        if pixel & TRANSPARENT != 0 || (self == Code::TerrainRgb && pixel == 0) {
            return f32::NAN;
        }
        let height = self.metres(pixel);
        if PLAUSIBLE.contains(&height) { height as f32 } else { f32::NAN }
    }

    /// Distance between representable heights (m).
    pub fn step(self) -> f64 {
        match self {
            Code::Terrarium => 1.0 / 256.0,
            Code::TerrainRgb => 0.1,
        }
    }

    fn metres(self, pixel: u32) -> f64 {
        let code = f64::from(pixel & 0xFF_FFFF);
        match self {
            Code::Terrarium => code / 256.0 - 32768.0,
            // Divided, not multiplied by 0.1: tenths come out as the nearest number to them.
            Code::TerrainRgb => (code - 100_000.0) / 10.0,
        }
    }
}

/// Which code these pixels (row by row, `columns` a row) are in, or why they are a picture.
///
/// # Errors
/// A sentence on what the colours look like instead.
pub fn detect(pixels: &[u32], columns: usize) -> Result<Code, String> {
    let opaque = pixels.iter().filter(|&&p| p & TRANSPARENT == 0).count();
    if opaque == 0 {
        return Err("expected heights in colours, got a picture that is transparent everywhere".into());
    }
    let plausible = |code: Code| pixels.iter().filter(|&&p| code.height(p).is_finite()).count() as f64 / opaque as f64;
    let [terrarium, terrain_rgb] = [plausible(Code::Terrarium), plausible(Code::TerrainRgb)];
    let code = if terrarium >= terrain_rgb { Code::Terrarium } else { Code::TerrainRgb };
    // Half, not nearly all: tiles over the shore may be mostly empty.
    if terrarium.max(terrain_rgb) < 0.5 {
        return Err(format!(
            "expected heights in colours, got a picture: {:.0} % of its pixels are plausible heights as Terrarium and {:.0} % \
             as Terrain-RGB; pictures are draped, not read as land",
            terrarium * 100.0,
            terrain_rgb * 100.0
        ));
    }
    if looks_like_a_picture(pixels, columns, code) {
        return Err(
            "expected heights in colours, got a picture: the channels rise and fall together, where those of a code \
                    carry over; pictures are draped, not read as land"
                .into(),
        );
    }
    Ok(code)
}

/// Among neighbours whose R differs, whether most heights differ by about as much as R alone would make them.
fn looks_like_a_picture(pixels: &[u32], columns: usize, code: Code) -> bool {
    let step = match code {
        Code::Terrarium => 256.0,
        Code::TerrainRgb => 6553.6,
    };
    let [mut steps, mut together] = [0u64; 2];
    for row in pixels.chunks(columns) {
        for pair in row.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|p| f64::from(p >> 16 & 0xFF));
            let [from, to] = [pair[0], pair[1]].map(|p| code.height(p));
            if a != b && from.is_finite() && to.is_finite() {
                let jump = f64::from((to - from).abs()) / (step * (a - b).abs());
                steps += 1;
                together += u64::from((0.85..1.15).contains(&jump));
            }
        }
    }
    steps >= 16 && together as f64 > 0.6 * steps as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encode(code: Code, height: f64) -> u32 {
        match code {
            Code::Terrarium => ((height + 32768.0) * 256.0).round() as u32,
            Code::TerrainRgb => ((height + 10_000.0) * 10.0).round() as u32,
        }
    }

    fn land(code: Code, low: f64, high: f64) -> Vec<u32> {
        let height = |i: usize| {
            let [x, y] = [(i % 64) as f64, (i / 64) as f64];
            low + (high - low) * (0.5 + 0.3 * (x * 0.13).sin() + 0.2 * (y * 0.21 + x * 0.05).cos())
        };
        (0..64 * 64).map(|i| encode(code, height(i))).collect()
    }

    #[test]
    fn codes_are_told_apart_over_all_of_earth() {
        for code in [Code::Terrarium, Code::TerrainRgb] {
            for (low, high) in
                [(-11_000.0, 8_800.0), (-5.0, 5.0), (600.0, 2600.0), (-400.0, 8000.0), (-9_900.0, -6_500.0)]
            {
                if code == Code::TerrainRgb && low < -10_000.0 {
                    continue;
                }
                assert_eq!(detect(&land(code, low, high), 64), Ok(code), "{low} … {high}");
            }
        }
    }

    #[test]
    fn decoding_inverts_encoding() {
        for tenths in (-100_000..90_000).step_by(777) {
            let height = f64::from(tenths) / 10.0;
            if height > -10_000.0 {
                assert_eq!(Code::TerrainRgb.height(encode(Code::TerrainRgb, height)), height as f32);
            }
            assert!(
                (f64::from(Code::Terrarium.height(encode(Code::Terrarium, height))) - height).abs()
                    <= 0.5 / 256.0 + 1e-3
            );
        }
        assert!(Code::Terrarium.height(0).is_nan() && Code::TerrainRgb.height(0).is_nan());
        assert!(Code::Terrarium.height(0x80_00_00 | TRANSPARENT).is_nan());
        assert_eq!(Code::Terrarium.height(0x80_00_00), 0.0);
    }

    #[test]
    fn pictures_are_refused() {
        // A grey-green slope: all channels move together, within Terrarium's plausible reds.
        let slope: Vec<u32> =
            (0..64 * 64u32).map(|i| 100 + (i % 64) / 2).map(|v| v << 16 | (v + 20) << 8 | v).collect();
        assert!(detect(&slope, 64).is_err());
        // White with black letters.
        let page: Vec<u32> = (0..64 * 64u32).map(|i| if i % 7 == 0 { 0 } else { 0xFF_FF_FF }).collect();
        assert!(detect(&page, 64).is_err());
        assert!(detect(&[TRANSPARENT; 16], 4).is_err());
    }
}
