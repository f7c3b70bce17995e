//! PLY, binary, little endian: G. Turk, *The PLY polygon file format*, 1994. Coordinates in double precision, which all
//! common readers take; the waterline as an element `edge`.

use super::{all_normals, one_line};
use crate::write::Sink;
use littoral::mesh::Model;
use std::io;

pub(super) fn write(sink: &mut dyn Sink, model: &Model, notes: &[(&str, String)]) -> io::Result<()> {
    let normals = all_normals(model);
    let mut head = String::from("ply\nformat binary_little_endian 1.0\ncomment littoral\n");
    for (name, note) in notes {
        head += &format!("comment {name}: {}\n", one_line(note));
    }
    head += &format!("element vertex {}\n", model.positions.len());
    head += "property double x\nproperty double y\nproperty double z\n";
    if normals {
        head += "property float nx\nproperty float ny\nproperty float nz\n";
    }
    head += &format!("element face {}\nproperty list uchar int vertex_indices\n", model.triangles.len());
    if !model.shoreline.is_empty() {
        head += &format!("element edge {}\nproperty int vertex1\nproperty int vertex2\n", model.shoreline.len());
    }
    head += "end_header\n";
    sink.write_all(head.as_bytes())?;
    for (index, position) in model.positions.iter().enumerate() {
        sink.write_all(position.to_array().map(f64::to_le_bytes).as_flattened())?;
        if normals {
            sink.write_all(model.normals[index].to_array().map(f32::to_le_bytes).as_flattened())?;
        }
    }
    for triangle in &model.triangles {
        let mut face = [3u8; 13];
        face[1..].copy_from_slice(triangle.map(u32::to_le_bytes).as_flattened());
        sink.write_all(&face)?;
    }
    for edge in &model.shoreline {
        sink.write_all(edge.map(u32::to_le_bytes).as_flattened())?;
    }
    Ok(())
}
