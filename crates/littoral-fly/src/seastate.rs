//! Single numbers of a sea's state as it is typed: `beaufort=4,from=225`; and the surf that follows from it.

use littoral::field::{Land, Water};
use littoral::waves::SeaState;
use std::f64::consts::FRAC_PI_4;

/// Where waves break.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surf {
    /// Significant height of the waves off the shore (m).
    pub height: f64,
    /// Depth that they break in (m).
    pub depth: f64,
    /// How wide the water is that is no deeper (m), in the mean along the shore.
    pub width: f64,
}

impl Surf {
    /// Of a state over water on a land; `None` where no bed is known that it could break on.
    pub fn of(land: &Land, water: &Water, state: &SeaState) -> Option<Surf> {
        let height = state.significant_height();
        let depth = height / state.breaking;
        let raster = land.raster();
        let (columns, spacing) = (raster.columns(), raster.spacing());
        let level = water.level as f32;
        let (mut shallow, mut shores) = (0u64, 0.0);
        for (i, ground) in raster.heights().iter().enumerate() {
            let wet = water.floods(i);
            if wet && *ground < level && level - ground < depth as f32 && !water.is_unsounded(land, i) {
                shallow += 1;
            }
            // Between neighbours of which one is wet a piece of the shore runs.
            let (column, row) = (i % columns, i / columns);
            if column > 0 && wet != water.floods(i - 1) {
                shores += spacing.y;
            }
            if row > 0 && wet != water.floods(i - columns) {
                shores += spacing.x;
            }
        }
        // Along rows and columns a line of any direction is, in the mean, longer by 4 / π.
        let width = shallow as f64 * spacing.x * spacing.y / (shores * FRAC_PI_4);
        (shallow > 0 && height > 0.0 && width.is_finite()).then_some(Surf { height, depth, width })
    }
}

/// The number of a key, if the text has one.
pub fn number(text: &str, key: &str) -> Option<f64> {
    text.split(',').find_map(|part| part.split_once('=').filter(|(name, _)| name.trim() == key)?.1.trim().parse().ok())
}

/// The text with another number of a key; at its end if it had none.
pub fn with(text: &str, key: &str, value: f64) -> String {
    let is = |part: &str| part.split_once('=').is_some_and(|(name, _)| name.trim() == key);
    let mut parts: Vec<String> = text.split(',').map(str::trim).filter(|p| !p.is_empty()).map(str::to_owned).collect();
    let changed = format!("{key}={value}");
    match parts.iter_mut().find(|part| is(part)) {
        Some(part) => *part = changed,
        None => parts.push(changed),
    }
    parts.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use littoral::field::Raster;

    #[test]
    fn surf_is_as_wide_as_the_bed_is_shallow() {
        // A beach of one in fifty along a straight shore; of the samples 5 m apart 100 are dry.
        let heights = (0..300 * 60).map(|i| 10.0 - 0.1 * (i % 300) as f32).collect();
        let land = Land::new(Raster::new(300, 60, DVec2::splat(5.0), heights).expect("a raster"));
        let water = Water::flood(&land, 0.0).expect("wet");
        let surf = |text: &str| Surf::of(&land, &water, &text.parse().expect("a state"));
        let usual = surf("hs=1.56,tp=8").expect("surf");
        assert!((usual.depth - 2.0).abs() < 0.02, "{usual:?}");
        // The shore's length is overestimated where it runs along rows: here by 4 / π, taken off.
        assert!((usual.width * FRAC_PI_4 / 100.0 - 1.0).abs() < 0.06, "{usual:?}");
        let wide = surf("hs=1.56,tp=8,breaking=0.39").expect("surf");
        assert!((wide.width / usual.width - 2.0).abs() < 0.06, "{wide:?}");
        assert_eq!(surf("calm"), None);
    }

    #[test]
    fn numbers_are_found_and_changed_and_the_rest_stays() {
        let text = "wind=3, from=200,swell=2.5@13/240";
        assert_eq!((number(text, "wind"), number(text, "from"), number(text, "swell")), (Some(3.0), Some(200.0), None));
        assert_eq!(with(text, "from", 90.0), "wind=3,from=90,swell=2.5@13/240");
        assert_eq!(with("beaufort=4", "from", 12.5), "beaufort=4,from=12.5");
        assert_eq!(with("", "wind", 7.0), "wind=7");
        let parsed = with(text, "wind", 11.0).parse::<littoral::waves::SeaState>();
        assert!(parsed.is_ok(), "{parsed:?}");
    }
}
