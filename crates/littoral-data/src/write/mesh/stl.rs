//! STL, binary: 3D Systems, *Stereolithography interface specification*, 1989. A triangle is its normal and three
//! places.

use crate::write::Sink;
use glam::{DVec3, Vec3};
use littoral::mesh::Model;
use std::io;

pub(super) fn write(sink: &mut dyn Sink, model: &Model, origin: DVec3) -> io::Result<()> {
    // Readers take a file that begins with "solid" for text.
    let mut head = format!("littoral; metres; coordinates count from {} {} {}", origin.x, origin.y, origin.z);
    head.truncate(80);
    sink.write_all(format!("{head:80}").as_bytes())?;
    sink.write_all(&(model.triangles.len() as u32).to_le_bytes())?;
    for triangle in &model.triangles {
        let [a, b, c] = triangle.map(|vertex| (model.positions[vertex as usize] - origin).as_vec3());
        let normal = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize_or_zero().as_vec3();
        let mut facet = [0u8; 50];
        for (bytes, vector) in facet.chunks_exact_mut(12).zip([normal, a, b, c]) {
            bytes.copy_from_slice(bytes_of(vector).as_flattened());
        }
        sink.write_all(&facet)?;
    }
    Ok(())
}

fn bytes_of(vector: Vec3) -> [[u8; 4]; 3] {
    vector.to_array().map(f32::to_le_bytes)
}
