//! Telling heights from voids: the one place where raw samples become metres.

/// How a file's raw samples become heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoidRule {
    /// The declared no-data value, compared with raw samples (before scale and offset).
    pub nodata: Option<f64>,
    /// Height = (raw × `scale` + `offset`) × `metres`.
    pub scale: f64,
    /// See `scale`.
    pub offset: f64,
    /// Metres in one vertical unit: 1, 0.3048, 1200/3937 …
    pub metres: f64,
    /// Whether −32 768, −32 767 and −9999 are void though the file does not say so. Off where every number is a height, as
    /// in formats that spread a range of heights over all sixteen bits.
    pub sentinels: bool,
}

impl Default for VoidRule {
    fn default() -> VoidRule {
        VoidRule { nodata: None, scale: 1.0, offset: 0.0, metres: 1.0, sentinels: true }
    }
}

/// Heights outside this range are not of this Earth, and void (m).
pub const PLAUSIBLE: std::ops::RangeInclusive<f64> = -12_000.0..=9_000.0;

impl VoidRule {
    /// The height (m) of a raw sample, or NaN where void.
    #[inline]
    pub fn height(&self, raw: f64) -> f32 {
        // Sentinels that files use without saying so; ±3.4e38 and NaN fall to the plausible range.
        let sentinel = self.sentinels && (raw == -32768.0 || raw == -32767.0 || raw == -9999.0);
        if sentinel || self.nodata.is_some_and(|n| raw == n || raw as f32 == n as f32) {
            return f32::NAN;
        }
        let height = (raw * self.scale + self.offset) * self.metres;
        if PLAUSIBLE.contains(&height) { height as f32 } else { f32::NAN }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentinels_are_void_and_heights_are_not() {
        let rule = VoidRule { nodata: Some(999.0), ..VoidRule::default() };
        for raw in [999.0, f64::NAN, f64::INFINITY, -32768.0, -32767.0, -9999.0, 3.4e38, -3.4e38, 9000.1, -12000.1] {
            assert!(rule.height(raw).is_nan(), "{raw}");
        }
        for raw in [0.0, -9998.0, 8848.0, -10_994.0, 1000.0] {
            assert_eq!(rule.height(raw), raw as f32);
        }
        let feet = VoidRule { metres: 0.3048, ..VoidRule::default() };
        assert_eq!(feet.height(1000.0), 304.8);
        let packed = VoidRule { scale: 0.01, offset: 5.0, ..VoidRule::default() };
        assert_eq!(packed.height(2165.0), 26.65);
    }
}
