//! An object as GLB: its first form, with normals and the colours of vertices.

use super::mesh::begin_glb;
use super::whole;
use crate::Error;
use glam::Vec3;
use littoral::objects::Object;
use serde_json::json;
use std::path::Path;

/// Writes an object as a `.glb` file that [`crate::open_object`] reads back.
///
/// # Errors
/// If the file cannot be written, or would be longer than such files can be.
pub fn object(file: &Path, object: &Object) -> Result<(), Error> {
    whole(file, |sink| {
        let (head, bytes) = described(object);
        begin_glb(sink, &head, bytes.len())?;
        sink.write_all(&bytes)
    })
}

/// An object's description and its bytes.
fn described(object: &Object) -> (serde_json::Value, Vec<u8>) {
    let turned = |at: Vec3| Vec3::new(at.x, at.z, -at.y);
    let form = &object.forms()[0];
    let mut bytes = Vec::with_capacity(36 * form.corners.len() + 12 * form.triangles.len());
    let mut put = |vector: Vec3| bytes.extend(vector.to_array().map(f32::to_le_bytes).as_flattened());
    form.corners.iter().for_each(|corner| put(turned(corner.position)));
    form.corners.iter().for_each(|corner| put(turned(corner.normal)));
    form.corners.iter().for_each(|corner| put(corner.albedo));
    bytes.extend(form.triangles.as_flattened().iter().flat_map(|corner| corner.to_le_bytes()));
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for at in form.corners.iter().map(|corner| turned(corner.position)) {
        (low, high) = (low.min(at), high.max(at));
    }
    let count = form.corners.len();
    let vectors = 12 * count;
    let view =
        |number: usize| json!({ "buffer": 0, "byteOffset": number * vectors, "byteLength": vectors, "target": 34_962 });
    let vector = |view: usize| json!({ "bufferView": view, "componentType": 5126, "count": count, "type": "VEC3" });
    let mut positions = vector(0);
    (positions["min"], positions["max"]) = (json!(low.to_array()), json!(high.to_array()));
    let corners = 3 * form.triangles.len();
    let white = json!({ "baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 });
    let head = json!({
        "asset": { "version": "2.0", "generator": "littoral" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": "object", "mesh": 0 }],
        "meshes": [{ "name": "object", "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "COLOR_0": 2 }, "indices": 3, "mode": 4, "material": 0,
        }] }],
        "materials": [{ "name": "coloured", "pbrMetallicRoughness": white }],
        "accessors": [positions, vector(1), vector(2),
            { "bufferView": 3, "componentType": 5125, "count": corners, "type": "SCALAR" }],
        "bufferViews": [view(0), view(1), view(2),
            { "buffer": 0, "byteOffset": 3 * vectors, "byteLength": 4 * corners, "target": 34_963 }],
        "buffers": [{ "byteLength": bytes.len() }],
    });
    (head, bytes)
}
