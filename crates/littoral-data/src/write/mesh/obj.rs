//! Wavefront OBJ: text, in groups `ground`, `base` and `shoreline`. Indices count from one.

use super::one_line;
use crate::write::Sink;
use littoral::mesh::Model;
use std::io;

pub(super) fn write(sink: &mut dyn Sink, model: &Model, notes: &[(&str, String)]) -> io::Result<()> {
    writeln!(sink, "# littoral")?;
    for (name, note) in notes {
        writeln!(sink, "# {name}: {}", one_line(note))?;
    }
    for position in &model.positions {
        let single = position.z as f32;
        // Heights are single precision mostly, and read better as such.
        if f64::from(single) == position.z {
            writeln!(sink, "v {} {} {single}", position.x, position.y)?;
        } else {
            writeln!(sink, "v {} {} {}", position.x, position.y, position.z)?;
        }
    }
    for normal in &model.normals {
        writeln!(sink, "vn {:.5} {:.5} {:.5}", normal.x, normal.y, normal.z)?;
    }
    let (ground, base) = model.triangles.split_at(model.ground_triangles);
    writeln!(sink, "g ground")?;
    for triangle in ground {
        let [a, b, c] = triangle.map(|vertex| u64::from(vertex) + 1);
        writeln!(sink, "f {a}//{a} {b}//{b} {c}//{c}")?;
    }
    if !base.is_empty() {
        writeln!(sink, "g base")?;
    }
    for triangle in base {
        let [a, b, c] = triangle.map(|vertex| u64::from(vertex) + 1);
        writeln!(sink, "f {a} {b} {c}")?;
    }
    if !model.shoreline.is_empty() {
        writeln!(sink, "g shoreline")?;
    }
    for edge in &model.shoreline {
        let [a, b] = edge.map(|vertex| u64::from(vertex) + 1);
        writeln!(sink, "l {a} {b}")?;
    }
    Ok(())
}
