//! What `--lake` asks for: lakes over known beds.

use crate::ground::System;
use crate::subject::Subject;
use crate::talk::{Failure, Talk, tidy};
use littoral::field::{LakeError, Lakes};
use littoral_data::LakeOrder;
use serde::Serialize;

/// A lake that was filled: heights above the datum, unstretched, and where it would overflow, if it ever would.
#[derive(Serialize)]
pub struct Lake {
    level: f64,
    area_m2: f64,
    volume_m3: f64,
    deepest_m: f64,
    overflows_at: Option<f64>,
    outlet: Option<[f64; 2]>,
}

/// Fills the lakes that were ordered, and tells what they came to.
pub fn fill(
    orders: &[LakeOrder],
    system: System,
    subject: &mut Subject,
    talk: &mut Talk,
) -> Result<Vec<Lake>, Failure> {
    let mut all = Vec::with_capacity(orders.len());
    for order in orders {
        let named = format!("--lake {},{}={}", order.at.x, order.at.y, order.level);
        let (at, level) = (subject.local(system, order.at)?, order.level * subject.exaggeration);
        let lakes = subject.lakes.get_or_insert_with(|| Lakes::none(&subject.land));
        let filled = lakes.fill(&subject.land, subject.water.as_ref(), at, level);
        let filled = filled.map_err(|error| Failure::Work(format!("{named}: {}", told(error, subject))))?;
        let filled = filled.stretched(1.0 / subject.exaggeration);
        if filled.voids_beside > 0 {
            let count = filled.voids_beside;
            talk.warn(format!(
                "{named}: it ends at {count} void samples as at a wall, but where nothing is known it may run out"
            ));
        }
        let outlet = filled.outlet.map(|outlet| (outlet.height, subject.frame.crs(outlet.at)));
        let sill = outlet.map_or(String::new(), |(height, at)| {
            let (x, y) = (subject.frame.shown(at.x), subject.frame.shown(at.y));
            format!("; it would overflow at {} m, at {x},{y}", tidy(height, 2))
        });
        talk.note(format!(
            "{named}: {} km², {} million m³, at most {} m deep{sill}",
            tidy(filled.area * 1e-6, 3),
            tidy(filled.volume * 1e-6, 3),
            tidy(filled.deepest, 1)
        ));
        all.push(Lake {
            level: order.level,
            area_m2: filled.area,
            volume_m3: filled.volume,
            deepest_m: filled.deepest,
            overflows_at: outlet.map(|(height, _)| height),
            outlet: outlet.map(|(_, at)| at.to_array()),
        });
    }
    Ok(all)
}

/// Why a lake cannot be filled, in the file's coordinates and heights.
fn told(error: LakeError, subject: &Subject) -> String {
    let error = error.stretched(1.0 / subject.exaggeration);
    match error {
        LakeError::NoGround { .. } => {
            "expected known ground there, got none (void or outside); choose a place above the lake's bed".to_owned()
        }
        LakeError::Overflows { outlet, .. } => {
            let at = subject.frame.crs(outlet.at);
            format!("{error}; its outlet is at {},{}", subject.frame.shown(at.x), subject.frame.shown(at.y))
        }
        error => error.to_string(),
    }
}
