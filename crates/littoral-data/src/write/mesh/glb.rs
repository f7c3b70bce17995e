//! GLB, the one-file form of glTF: Khronos, *glTF 2.0 specification*, 2021 (ISO/IEC 12113:2022). There y points up: east
//! stays x, north becomes −z.
//!
//! A model with a base has sharp edges and comes without normals, which asks viewers for flat facets; its vertices stay
//! shared, so that it stays closed.

use super::all_normals;
use crate::write::Sink;
use glam::{DVec3, Vec3};
use littoral::mesh::Model;
use serde_json::{Map, Value, json};
use std::io;

/// What bytes of the buffer are, in glTF's numbers.
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;
const F32: u32 = 5126;
const U32: u32 = 5125;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

/// The most bytes that a model of this size takes, its notes being short.
pub(super) fn length(vertices: usize, triangles: usize, lines: usize) -> u64 {
    24 * vertices as u64 + 12 * triangles as u64 + 8 * lines as u64 + (1 << 20)
}

/// East, north, up to right, up, towards the viewer.
fn turned(at: Vec3) -> Vec3 {
    Vec3::new(at.x, at.z, -at.y)
}

pub(super) fn write(sink: &mut dyn Sink, model: &Model, origin: DVec3, notes: &[(&str, String)]) -> io::Result<()> {
    let place = |at: &DVec3| turned((*at - origin).as_vec3());
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for at in model.positions.iter().map(place) {
        (low, high) = (low.min(at), high.max(at));
    }
    let (vertices, corners, ends) = (model.positions.len(), 3 * model.triangles.len(), 2 * model.shoreline.len());
    let mut views = Vec::new();
    let mut accessors = Vec::new();
    let mut offset = 0;
    let mut add = |bytes: usize, target: u32, accessor: Value| {
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes, "target": target }));
        offset += bytes;
        let mut accessor = accessor;
        accessor["bufferView"] = json!(views.len() - 1);
        accessors.push(accessor);
        accessors.len() - 1
    };
    let bounds = [low.to_array(), high.to_array()];
    let positions =
        json!({ "componentType": F32, "count": vertices, "type": "VEC3", "min": bounds[0], "max": bounds[1] });
    let mut attributes = json!({ "POSITION": add(12 * vertices, VERTICES, positions) });
    if all_normals(model) {
        let normals = json!({ "componentType": F32, "count": vertices, "type": "VEC3" });
        attributes["NORMAL"] = json!(add(12 * vertices, VERTICES, normals));
    }
    let mut index =
        |count: usize| add(4 * count, INDICES, json!({ "componentType": U32, "count": count, "type": "SCALAR" }));
    let mut primitives =
        vec![json!({ "attributes": attributes, "indices": index(corners), "mode": TRIANGLES, "material": 0 })];
    if ends > 0 {
        let line = json!({ "POSITION": 0 });
        primitives.push(json!({ "attributes": line, "indices": index(ends), "mode": LINES, "material": 1 }));
    }
    let plain = |name: &str, colour: [f32; 4]| {
        let look = json!({ "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        json!({ "name": name, "pbrMetallicRoughness": look })
    };
    let mut materials = vec![plain("ground", [0.45, 0.42, 0.36, 1.0])];
    if ends > 0 {
        materials.push(plain("shoreline", [0.02, 0.10, 0.35, 1.0]));
    }
    let extras: Map<String, Value> = notes.iter().map(|(name, note)| ((*name).to_owned(), json!(note))).collect();
    let mut node = json!({ "name": "land", "mesh": 0, "extras": extras });
    if origin != DVec3::ZERO {
        node["translation"] = json!([origin.x, origin.z, -origin.y]);
    }
    let head = json!({
        "asset": { "version": "2.0", "generator": "littoral" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [node],
        "meshes": [{ "name": "land", "primitives": primitives }],
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": offset }],
    });
    begin(sink, &head, offset)?;
    let mut put = |vector: Vec3| sink.write_all(vector.to_array().map(f32::to_le_bytes).as_flattened());
    for at in &model.positions {
        put(place(at))?;
    }
    if all_normals(model) {
        for normal in &model.normals {
            put(turned(*normal))?;
        }
    }
    for number in model.triangles.as_flattened().iter().chain(model.shoreline.as_flattened()) {
        sink.write_all(&number.to_le_bytes())?;
    }
    Ok(())
}

/// Writes all of a file but its bytes, a whole number of four, which are to follow.
pub(crate) fn begin(sink: &mut dyn Sink, head: &Value, bytes: usize) -> io::Result<()> {
    let mut head = serde_json::to_vec(head).map_err(io::Error::other)?;
    // Chunks are whole numbers of four bytes; what is in the other one is so by itself.
    head.resize(head.len().next_multiple_of(4), b' ');
    let all = 12 + 8 + head.len() + 8 + bytes;
    let sizes = [all, head.len(), bytes].map(u32::try_from);
    let [Ok(all), Ok(head_length), Ok(bytes)] = sizes else {
        return Err(io::Error::other("expected less than 4 GiB in a GLB file, got more; write .ply"));
    };
    sink.write_all(b"glTF")?;
    for number in [2, all, head_length] {
        sink.write_all(&number.to_le_bytes())?;
    }
    sink.write_all(b"JSON")?;
    sink.write_all(&head)?;
    sink.write_all(&bytes.to_le_bytes())?;
    sink.write_all(b"BIN\0")
}
