//! The methods of detail by name, for whoever lets people choose one.

use super::{Limits, Lod, Nested, Patches, Quadtree, Roam, Strips, Whole};
use std::fmt;
use std::str::FromStr;

/// A method of detail, with its usual settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// Everything equally fine: [`Whole`].
    Whole,
    /// Square windows within each other: [`Nested`].
    Nested,
    /// A restricted quadtree whose patches morph: [`Quadtree`].
    Quadtree,
    /// Triangles cut level by level: [`Patches`].
    Patches,
    /// Strips along rows: [`Strips`].
    Strips,
    /// A bintree of right triangles: [`Roam`], which chooses anew for each view ([`RoamFlight`](super::RoamFlight) goes on from view to view, over
    /// a sea [`RoamSea`](super::RoamSea)).
    Roam,
}

impl Method {
    /// All of them, the simplest first.
    pub const ALL: [Method; 6] =
        [Method::Whole, Method::Nested, Method::Quadtree, Method::Patches, Method::Strips, Method::Roam];

    /// Its name in commands and files: one word, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Method::Whole => "whole",
            Method::Nested => "nested",
            Method::Quadtree => "quadtree",
            Method::Patches => "patches",
            Method::Strips => "strips",
            Method::Roam => "roam",
        }
    }

    /// What it does, in a few words.
    pub fn description(self) -> &'static str {
        match self {
            Method::Whole => "Everything equally fine: what the others are measured by",
            Method::Nested => "Nested square windows, joined by upright strips: for seas",
            Method::Quadtree => "A restricted quadtree whose patches morph",
            Method::Patches => "Triangles cut level by level, edges deciding",
            Method::Strips => "Strips along rows whose cells change size on the way",
            Method::Roam => "A bintree of right triangles, the worst split first",
        }
    }

    /// The method within limits.
    pub fn within(self, limits: Limits) -> Box<dyn Lod> {
        match self {
            Method::Whole => Box::new(Whole::new(limits)),
            Method::Nested => Box::new(Nested::new(limits)),
            Method::Quadtree => Box::new(Quadtree::new(limits)),
            Method::Patches => Box::new(Patches::new(limits)),
            Method::Strips => Box::new(Strips::new(limits)),
            Method::Roam => Box::new(Roam::new(limits)),
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no method's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected one of whole, nested, quadtree, patches, strips, roam, got \"{0}\"")]
pub struct UnknownMethod(pub String);

impl FromStr for Method {
    type Err = UnknownMethod;

    /// A method by its [`Method::name`], in letters of either case.
    fn from_str(text: &str) -> Result<Method, UnknownMethod> {
        let named = |method: &Method| method.name().eq_ignore_ascii_case(text.trim());
        Method::ALL.into_iter().find(named).ok_or_else(|| UnknownMethod(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_their_methods() {
        for method in Method::ALL {
            assert_eq!(method.to_string().to_uppercase().parse(), Ok(method));
        }
        let wrong = "rome".parse::<Method>().expect_err("no method").to_string();
        assert!(
            Method::ALL.iter().all(|method| wrong.contains(method.name())) && wrong.contains("\"rome\""),
            "{wrong}"
        );
    }
}
