//! An object and where it is to stand, as it is typed.

use super::{ObjectFile, open_object};
use crate::Error;
use glam::DVec2;
use littoral::objects::{buoy, lighthouse};
use std::path::PathBuf;
use std::str::FromStr;

/// `FILE@X,Y[,HEADING[,SCALE]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectOrder {
    /// A glTF file; or `lighthouse` or `buoy`, which are built in.
    pub file: PathBuf,
    /// Where it stands, in coordinates of the land's file or whatever else is asked for.
    pub at: DVec2,
    /// By how much it is turned clockwise (degrees): at 0 what is −z in the file, and the built-in things' north, points north.
    pub heading_degrees: f64,
    /// By how much it is enlarged.
    pub scale: f64,
}

impl FromStr for ObjectOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<ObjectOrder, String> {
        let text = text.trim();
        let wrong = |expected: &str| format!("expected {expected}, got \"{text}\"");
        let form = "FILE@X,Y or FILE@X,Y,HEADING,SCALE such as boat.glb@2600,900,135";
        let (file, rest) = text.rsplit_once('@').filter(|(file, _)| !file.is_empty()).ok_or_else(|| wrong(form))?;
        let numbers: Option<Vec<f64>> =
            rest.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
        let numbers = numbers.filter(|numbers| (2..=4).contains(&numbers.len())).ok_or_else(|| wrong(form))?;
        let scale = numbers.get(3).copied().unwrap_or(1.0);
        if !(1e-4..=1e4).contains(&scale) {
            return Err(wrong("a scale from 0.0001 to 10000"));
        }
        Ok(ObjectOrder {
            file: file.into(),
            at: DVec2::new(numbers[0], numbers[1]),
            heading_degrees: numbers.get(2).copied().unwrap_or(0.0),
            scale,
        })
    }
}

impl ObjectOrder {
    /// What is ordered.
    ///
    /// # Errors
    /// If the file cannot be opened: see [`open_object`].
    pub fn open(&self) -> Result<ObjectFile, Error> {
        let built_in = |object| Ok(ObjectFile { object, warnings: Vec::new() });
        match self.file.to_str() {
            Some("lighthouse") => built_in(lighthouse()),
            Some("buoy") => built_in(buoy()),
            _ => open_object(&self.file),
        }
    }
}
