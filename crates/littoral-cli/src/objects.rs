//! What `--object` asks for: things on the land and the water.

use crate::ground::System;
use crate::subject::Subject;
use crate::talk::{Failure, Talk};
use littoral::objects::{Footing, Object, Standing};
use littoral_data::ObjectOrder;
use std::path::Path;
use std::sync::Arc;

/// The objects that were ordered, each file opened once, where they are to stand.
pub fn standing(
    orders: &[ObjectOrder],
    system: System,
    subject: &Subject,
    talk: &mut Talk,
) -> Result<Vec<Standing>, Failure> {
    let mut opened: Vec<(&Path, Arc<Object>)> = Vec::new();
    let mut all = Vec::with_capacity(orders.len());
    for order in orders {
        let known = opened.iter().find(|(file, _)| *file == order.file).map(|(_, object)| object.clone());
        let object = match known {
            Some(object) => object,
            None => {
                let file = order.file.display();
                let read = order.open()?;
                read.warnings.iter().for_each(|warning| talk.warn(format!("{file}: {warning}")));
                let triangles = read.object.forms()[0].triangles.len();
                if read.object.forms().len() == 1 && triangles > MANY {
                    talk.note(format!(
                        "{file}: its {triangles} triangles are drawn at any distance; built with littoral-data's feature lod, it would get coarser forms"
                    ));
                }
                let object = Arc::new(read.object);
                opened.push((&order.file, object.clone()));
                object
            }
        };
        let standing = Standing {
            place: subject.local(system, order.at)?,
            // Counted from true north, and from the land's y axis.
            heading: order.heading_degrees.to_radians() + subject.frame.north(),
            scale: order.scale,
            footing: Footing::Surface,
            object,
        };
        if standing.pose(&subject.land, subject.water.as_ref(), subject.lakes.as_ref(), None).is_none() {
            return Err(Failure::Work(format!(
                "--object {}@{},{}: expected ground or water of {} there, got none (void or outside); move it",
                order.file.display(),
                order.at.x,
                order.at.y,
                subject.name
            )));
        }
        all.push(standing);
    }
    Ok(all)
}

/// So many triangles are worth a coarser form.
const MANY: usize = 5000;
