//! A file's heights in five numbers, from one pass over all of it in bounded memory.

use crate::{Error, Source, source::bands};

/// What a look at every sample of the full resolution tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survey {
    /// How many samples are void.
    pub void: u64,
    /// The lowest valid height (m); `None` if all is void.
    pub min: Option<f32>,
    /// The highest valid height (m); `None` if all is void.
    pub max: Option<f32>,
    /// The height (m) at row 0, column 0; `None` if void.
    pub first: Option<f32>,
    /// The height (m) at row ⌊rows / 2⌋, column ⌊columns / 2⌋; `None` if void.
    pub centre: Option<f32>,
    /// The height (m) at the last row and column; `None` if void.
    pub last: Option<f32>,
}

/// Reads all heights of the full resolution once, row by row. `progress` hears the part done, in [0, 1].
///
/// # Errors
/// As [`Source::read`].
pub fn survey(source: &mut dyn Source, progress: &dyn Fn(f32)) -> Result<Survey, Error> {
    let level = source.levels()[0];
    let mut survey = Survey { void: 0, min: None, max: None, first: None, centre: None, last: None };
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for window in bands(source, 0) {
        let heights = source.read(0, window)?;
        for &height in &heights {
            survey.void += u64::from(height.is_nan());
            low = if height < low { height } else { low };
            high = if height > high { height } else { high };
        }
        let at = |row: usize, column: usize| {
            let index = row.checked_sub(window.row)? * level.columns + column;
            heights.get(index).copied().filter(|height| !height.is_nan())
        };
        survey.first = survey.first.or_else(|| at(0, 0));
        survey.centre = survey.centre.or_else(|| at(level.rows / 2, level.columns / 2));
        survey.last = survey.last.or_else(|| at(level.rows.checked_sub(1)?, level.columns.checked_sub(1)?));
        progress((window.row + window.rows) as f32 / level.rows as f32);
    }
    if low <= high {
        (survey.min, survey.max) = (Some(low), Some(high));
    }
    Ok(survey)
}
