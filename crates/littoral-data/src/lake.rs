//! A lake to be filled, as it is typed.

use glam::DVec2;
use std::str::FromStr;

/// `X,Y=LEVEL`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LakeOrder {
    /// A place in it, in coordinates of the land's file or whatever else is asked for.
    pub at: DVec2,
    /// Height of its surface (m).
    pub level: f64,
}

impl FromStr for LakeOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<LakeOrder, String> {
        let wrong = || {
            let text = text.trim();
            format!(
                "expected X,Y=LEVEL, a place in the lake and how high it stands in metres, such as 35.5,31.4=-430, got \"{text}\""
            )
        };
        let (place, level) = text.split_once('=').ok_or_else(wrong)?;
        let (x, y) = place.split_once(',').ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(wrong);
        let level = number(level)?;
        if !(-12_000.0..=9_000.0).contains(&level) {
            return Err(format!("expected a level from -12000 to 9000 m, got {level}"));
        }
        Ok(LakeOrder { at: DVec2::new(number(x)?, number(y)?), level })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read() {
        let order = |text: &str| text.parse::<LakeOrder>();
        assert_eq!(order(" -122.1,46.27=1060.5"), Ok(LakeOrder { at: DVec2::new(-122.1, 46.27), level: 1060.5 }));
        assert_eq!(order("35.5, 31.4 = -430"), Ok(LakeOrder { at: DVec2::new(35.5, 31.4), level: -430.0 }));
        for wrong in ["", "1,2", "1=2", "1,2=", "1,2,3=4", "a,2=3", "1,2=nan", "1,inf=3", "1,2=3=4", "1,2=99999"] {
            let said = order(wrong).expect_err("wrong");
            assert!(said.starts_with("expected") && said.contains("got"), "{said}");
        }
    }
}
