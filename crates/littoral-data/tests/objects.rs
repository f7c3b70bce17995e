//! Objects from glTF files: what comes in, what is refused, and that nothing worse happens.

use glam::{DVec2, Vec3};
use littoral::objects::{Corner, Form, Object, lighthouse};
use littoral_data::{ObjectFile, ObjectOrder, object_from, open_object, write};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::path::Path;

/// The bytes of an object's file.
fn object_bytes(object: &Object) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.glb");
    write::object(&file, object).expect("written");
    std::fs::read(&file).expect("there")
}

fn read(bytes: &[u8]) -> Result<ObjectFile, String> {
    let none = |name: &str| Err(format!("expected {name}, got nothing"));
    object_from(Path::new("a.glb"), bytes, &none).map_err(|e| e.to_string())
}

/// A triangle with corners at the origin, a metre along x and two along y; as bytes of a buffer.
fn positions() -> Vec<u8> {
    [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// That triangle's description, its buffer within.
fn described() -> Value {
    let data = format!("data:application/octet-stream;base64,{}", base64_of(&positions()));
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0.0, 0.0, 0.0], "max": [1.0, 2.0, 0.0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": data }],
    })
}

/// Adds one to a list.
fn add(value: &mut Value, list: &str, one: Value) {
    value[list].as_array_mut().expect("a list").push(one);
}

fn base64_of(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::prelude::BASE64_STANDARD.encode(bytes)
}

fn read_json(value: &Value) -> Result<ObjectFile, String> {
    read(value.to_string().as_bytes())
}

fn places(file: &ObjectFile) -> Vec<Vec3> {
    file.object.forms()[0].corners.iter().map(|corner| corner.position).collect()
}

#[test]
fn what_is_written_comes_back() {
    let tower = lighthouse();
    let file = read(&object_bytes(&tower)).expect("a GLB file");
    let (got, expected) = (&file.object.forms()[0], &tower.forms()[0]);
    let corners =
        |form: &Form| form.triangles.as_flattened().iter().map(|&k| form.corners[k as usize]).collect::<Vec<Corner>>();
    let (got, expected) = (corners(got), corners(expected));
    assert_eq!(got.len(), expected.len());
    for (got, expected) in got.iter().zip(&expected) {
        assert_eq!((got.position, got.albedo), (expected.position, expected.albedo));
        assert!(got.normal.distance(expected.normal) < 1e-6);
    }
    assert!(file.warnings.is_empty());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("tower.glb");
    write::object(&path, &tower).expect("written");
    assert_eq!(open_object(&path).expect("opens"), file);
    let error = open_object(folder.path()).expect_err("a folder").to_string();
    assert!(error.contains("got a folder"), "{error}");
}

#[test]
fn y_points_up_and_nodes_stand_within_each_other() {
    let plain = read_json(&described()).expect("a triangle");
    assert_eq!(places(&plain), [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 0.0, 2.0)]);
    // No normals: flat, towards the side from which corners run counter-clockwise, which is glTF's z and our south.
    assert!(plain.object.forms()[0].corners.iter().all(|c| c.normal == Vec3::NEG_Y && c.albedo == Vec3::ONE));
    let mut nodes = described();
    // Twice as large, a quarter turn about the vertical, in a node that is 10 m up and 5 m towards glTF's z.
    let half = 0.5f32.sqrt();
    nodes["nodes"] = json!([
        { "translation": [0, 10, 5], "children": [1] },
        { "mesh": 0, "rotation": [0, half, 0, half], "scale": [2, 2, 2] },
    ]);
    let file = read_json(&nodes).expect("a triangle");
    for (got, expected) in
        places(&file).iter().zip([Vec3::new(0.0, -5.0, 10.0), Vec3::new(0.0, -3.0, 10.0), Vec3::new(0.0, -5.0, 14.0)])
    {
        assert!(got.distance(expected) < 1e-5, "{got} {expected}");
    }
    // A mirror turns the corners' order, not the side that is outside.
    nodes["nodes"] = json!([{ "mesh": 0, "scale": [-1, 1, 1] }]);
    let mirrored = read_json(&nodes).expect("a triangle");
    assert!(mirrored.object.forms()[0].corners.iter().all(|c| c.normal == Vec3::NEG_Y), "{mirrored:?}");
}

#[test]
fn colours_of_materials_and_vertices_are_multiplied_and_textures_told() {
    let mut coloured = described();
    let bytes = [&positions()[..], &[255, 128, 0, 255].repeat(3)].concat();
    coloured["buffers"][0] = json!({ "byteLength": 48, "uri": format!("data:;base64,{}", base64_of(&bytes)) });
    add(&mut coloured, "bufferViews", json!({ "buffer": 0, "byteOffset": 36, "byteLength": 12 }));
    let colours = json!({ "bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4" });
    add(&mut coloured, "accessors", colours);
    let primitive = &mut coloured["meshes"][0]["primitives"][0];
    primitive["attributes"]["COLOR_0"] = json!(1);
    primitive["material"] = json!(0);
    coloured["materials"] = json!([{ "pbrMetallicRoughness": {
        "baseColorFactor": [0.5, 0.5, 0.5, 1.0], "baseColorTexture": { "index": 0 } } }]);
    coloured["textures"] = json!([{ "source": 0 }]);
    coloured["images"] = json!([{ "uri": "skin.png" }]);
    let file = read_json(&coloured).expect("a triangle");
    let expected = Vec3::new(0.5, 64.0 / 255.0, 0.0);
    assert!(file.object.forms()[0].corners.iter().all(|c| c.albedo.distance(expected) < 1e-6), "{file:?}");
    assert_eq!(file.warnings, ["its textures are left out: it is drawn in its base colours"]);
}

#[test]
fn strips_fans_indices_and_side_files() {
    let corners: Vec<u8> = [[0, 0], [1, 0], [0, 1], [1, 1], [0, 2]]
        .iter()
        .flat_map(|[x, y]| [*x as f32, *y as f32, 0.0])
        .flat_map(f32::to_le_bytes)
        .collect();
    let bytes = [&corners[..], &[0u16, 1, 2, 3, 4].map(u16::to_le_bytes).concat()].concat();
    let shape = |mode: u32, indexed: bool| {
        let mut value = described();
        value["buffers"][0] = json!({ "byteLength": 70, "uri": "corners.bin" });
        value["bufferViews"] =
            json!([{ "buffer": 0, "byteLength": 60 }, { "buffer": 0, "byteOffset": 60, "byteLength": 10 }]);
        value["accessors"][0]["count"] = json!(5);
        add(&mut value, "accessors", json!({ "bufferView": 1, "componentType": 5123, "count": 5, "type": "SCALAR" }));
        value["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        if indexed {
            value["meshes"][0]["primitives"][0]["indices"] = json!(1);
        }
        let beside = |name: &str| if name == "corners.bin" { Ok(bytes.clone()) } else { Err("?".into()) };
        object_from(Path::new("a.gltf"), value.to_string().as_bytes(), &beside).map_err(|e| e.to_string())
    };
    let area = |file: &ObjectFile| {
        let form = &file.object.forms()[0];
        let at = |corner: u32| form.corners[corner as usize].position;
        let wide = |&[a, b, c]: &[u32; 3]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a));
        (form.triangles.len(), form.triangles.iter().map(wide).sum::<Vec3>())
    };
    for indexed in [false, true] {
        assert_eq!(
            area(&shape(5, indexed).expect("a strip")),
            (3, Vec3::new(0.0, -1.5, 0.0)),
            "all the same way round"
        );
        assert_eq!(area(&shape(6, indexed).expect("a fan")).0, 3);
        assert_eq!(area(&shape(4, indexed).expect("a triangle")), (1, Vec3::new(0.0, -0.5, 0.0)));
    }
    assert!(shape(1, true).expect_err("lines").contains("expected triangles"));
    // From a folder: beside it and nowhere else.
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.gltf");
    let mut value = described();
    for (uri, whole) in
        [("corners.bin", true), ("../corners.bin", false), ("/etc/hostname", false), ("gone.bin", false)]
    {
        value["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&file, value.to_string()).expect("written");
        std::fs::write(folder.path().join("corners.bin"), positions()).expect("written");
        assert_eq!(open_object(&file).is_ok(), whole, "{uri}");
    }
}

#[test]
fn what_is_wrong_is_told() {
    let told = |change: &dyn Fn(&mut Value)| {
        let mut value = described();
        change(&mut value);
        read_json(&value).map(|_| ()).expect_err("wrong")
    };
    type Change<'a> = &'a dyn Fn(&mut Value);
    let cases: [(Change, &str); 12] = [
        (&|v| v["accessors"][0]["count"] = json!(4), "expected 4 vectors of 12 bytes in accessor 0"),
        (&|v| v["accessors"][0]["count"] = json!(u64::MAX), "got fewer bytes"),
        (&|v| v["accessors"][0]["byteOffset"] = json!(u64::MAX), "got fewer bytes"),
        (&|v| v["bufferViews"][0]["byteOffset"] = json!(u64::MAX), "got fewer bytes"),
        (&|v| v["bufferViews"][0]["byteStride"] = json!(8), "got fewer bytes"),
        (
            &|v| {
                v["accessors"][0] =
                    json!({ "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 2, 0] })
            },
            "missing data",
        ),
        (&|v| v["buffers"][0]["byteLength"] = json!(37), "cut off"),
        (&|v| v["nodes"][0]["mesh"] = json!(7), "out of bounds"),
        (&|v| v["nodes"] = json!([{ "mesh": 0, "children": [0] }]), "a circle"),
        (&|v| v["meshes"][0]["primitives"][0]["mode"] = json!(1), "expected triangles"),
        (&|v| v["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
        (&|v| v["nodes"][0]["translation"] = json!([2e6, 0, 0]), "1000 km"),
    ];
    for (change, expected) in cases {
        let said = told(change);
        assert!(said.starts_with("a.glb: ") && said.contains(expected), "{said}, not {expected}");
    }
    let glb = object_bytes(&lighthouse());
    for (bytes, expected) in [
        (&b"hello"[..], "another format"),
        (b"", "another format"),
        (b"{", "expected a sound glTF description"),
        (b"glTF", "cut off"),
        (b"glTF\x01\0\0\0\x0c\0\0\0", "version 1"),
        (&glb[..glb.len() / 2], "cut off"),
        (&glb[..30], "cut off"),
    ] {
        let said = read(bytes).map(|_| ()).expect_err("wrong");
        assert!(said.contains(expected) && said.contains("expected"), "{said}, not {expected}");
    }
}

#[test]
fn a_small_file_cannot_ask_for_a_large_object() {
    // Nodes that repeat a mesh, which repeats a list of indices.
    let mut value = described();
    let triangle = value["meshes"][0]["primitives"][0].clone();
    value["meshes"][0]["primitives"] = json!(vec![triangle; 3000]);
    value["nodes"] = json!(vec![json!({ "mesh": 0 }); 3000]);
    value["scenes"][0]["nodes"] = json!((0..3000).collect::<Vec<u32>>());
    assert!(read_json(&value).expect_err("too many").contains("at most 4000000 triangles"));
    // Nodes too deep within each other.
    let chain: Vec<Value> =
        (1..3000).map(|child| json!({ "children": [child] })).chain([json!({ "mesh": 0 })]).collect();
    value = described();
    value["nodes"] = json!(chain);
    assert!(read_json(&value).is_err());
}

#[test]
fn orders_are_read() {
    let order = |text: &str| text.parse::<ObjectOrder>();
    let plain = order("boats/my boat@2.glb@2600,-900.5").expect("an order");
    assert_eq!((plain.file, plain.at), ("boats/my boat@2.glb".into(), DVec2::new(2600.0, -900.5)));
    assert_eq!((plain.heading_degrees, plain.scale), (0.0, 1.0));
    let full = order("lighthouse@1,2,135,0.5").expect("an order");
    assert_eq!((full.heading_degrees, full.scale), (135.0, 0.5));
    assert_eq!(full.open().expect("built in").object, lighthouse());
    for wrong in [
        "",
        "a.glb",
        "@1,2",
        "a.glb@1",
        "a.glb@1,2,3,4,5",
        "a.glb@1,x",
        "a.glb@1,inf",
        "a.glb@1,2,0,0",
        "a.glb@1,2,0,-1",
    ] {
        let said = order(wrong).expect_err("wrong");
        assert!(said.starts_with("expected") && said.contains("got"), "{said}");
    }
}

fn pyramid() -> &'static [u8] {
    static BYTES: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
    BYTES.get_or_init(small_glb)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(4000) })]

    /// Whatever bytes are changed, cut off or written twice, reading ends with an object or a sentence.
    #[test]
    fn broken_files_end_well(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..12), cut in any::<prop::sample::Index>(), cuts: bool, text: bool) {
        let mut bytes = if text { described().to_string().into_bytes() } else { pyramid().to_vec() };
        for (at, to) in changes {
            let at = at.index(bytes.len());
            bytes[at] = to;
        }
        if cuts {
            bytes.truncate(cut.index(bytes.len()));
        }
        match read(&bytes) {
            Ok(file) => prop_assert!(!file.object.forms()[0].triangles.is_empty()),
            Err(said) => prop_assert!(said.starts_with("a.glb: ") && said.contains("expected"), "{}", said),
        }
    }
}

/// A pyramid, mostly description.
fn small_glb() -> Vec<u8> {
    let corner =
        |x: f32, y: f32, z: f32| Corner { position: Vec3::new(x, y, z), normal: Vec3::Z, albedo: Vec3::splat(0.5) };
    let corners = vec![corner(0.0, 0.0, 1.0), corner(1.0, 0.0, 0.0), corner(0.0, 1.0, 0.0), corner(-1.0, -1.0, 0.0)];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]];
    object_bytes(&Object::new(vec![Form { corners, triangles, error: 0.0 }]).expect("a pyramid"))
}
