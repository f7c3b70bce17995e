//! Files read back by other people's readers.

use super::*;
use glam::Vec3;
use littoral::field::Raster;
use littoral::mesh::{Form, Triangulation};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::io::{BufReader, Cursor};
use std::path::PathBuf;

/// A place far from zero, as maps have them.
const CORNER: DVec2 = DVec2::new(562_300.25, 5_115_801.5);

/// Sixteen samples 30 m apart, with a waterline at 1.25 m, and a base on request.
fn model(base: Option<f64>) -> Model {
    let heights: Vec<f32> = (0..16).map(|i| [0.1, 2.3, 1.7, 4.9, 0.4][i % 5]).collect();
    let raster = Raster::new(4, 4, DVec2::splat(30.0), heights).expect("a raster");
    let mut mesh = Triangulation::default();
    for i in 0..16u32 {
        mesh.vertices.push([i % 4, i / 4]);
        if i % 4 < 3 && i / 4 < 3 {
            mesh.triangles.extend([[i, i + 1, i + 5], [i, i + 5, i + 4]]);
        }
    }
    let place = |at: DVec2| CORNER + 30.0 * at;
    let form = Form { shoreline: Some(1.25), base, exaggeration: 1.0, place: &place, turn: 0.0 };
    Model::new(&mesh, &raster, &form).expect("a model")
}

/// Names of files may hold anything.
fn notes() -> Vec<(&'static str, String)> {
    vec![("source", "a \"file\"\nend_header\n# é \u{7}".to_owned()), ("heights", "metres".to_owned())]
}

fn written(name: &str, model: &Model) -> (Vec<u8>, DVec3) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join(name);
    let format = MeshFormat::of_name(&file).expect("a format");
    let origin = mesh(&file, format, model, &notes()).expect("written");
    (std::fs::read(&file).expect("a file"), origin)
}

#[test]
fn ply_comes_back_in_full() {
    for base in [None, Some(-3.0)] {
        let model = model(base);
        let (bytes, origin) = written("a.ply", &model);
        assert_eq!(origin, DVec3::ZERO);
        let ply = Parser::<DefaultElement>::new().read_ply(&mut Cursor::new(bytes)).expect("a PLY file");
        let double = |element: &DefaultElement, name: &str| match element[name] {
            Property::Double(x) => x,
            ref other => panic!("{name} is {other:?}"),
        };
        let vertices: Vec<DVec3> =
            ply.payload["vertex"].iter().map(|v| DVec3::from(["x", "y", "z"].map(|name| double(v, name)))).collect();
        assert_eq!(vertices, model.positions);
        let faces: Vec<Vec<i32>> = ply.payload["face"]
            .iter()
            .map(|face| match &face["vertex_indices"] {
                Property::ListInt(list) => list.clone(),
                other => panic!("a face is {other:?}"),
            })
            .collect();
        assert_eq!(faces, model.triangles.iter().map(|t| t.map(|v| v as i32).to_vec()).collect::<Vec<_>>());
        let int = |element: &DefaultElement, name: &str| match element[name] {
            Property::Int(x) => x as u32,
            ref other => panic!("{name} is {other:?}"),
        };
        let edges: Vec<[u32; 2]> =
            ply.payload["edge"].iter().map(|edge| [int(edge, "vertex1"), int(edge, "vertex2")]).collect();
        assert!(!edges.is_empty());
        assert_eq!(edges, model.shoreline);
        let normal = |element: &DefaultElement, name: &str| match element.get(name) {
            Some(Property::Float(x)) => Some(*x),
            _ => None,
        };
        let normals: Option<Vec<Vec3>> = ply.payload["vertex"]
            .iter()
            .map(|v| Some(Vec3::new(normal(v, "nx")?, normal(v, "ny")?, normal(v, "nz")?)))
            .collect();
        assert_eq!(normals, base.is_none().then(|| model.normals.clone()));
        // No note may end the header early.
        assert!(ply.header.comments.iter().any(|c| c.contains("\"file\" end_header")), "{:?}", ply.header.comments);
    }
}

#[test]
fn obj_comes_back_in_full() {
    for base in [None, Some(-3.0)] {
        let model = model(base);
        let (bytes, _) = written("a.obj", &model);
        // By hand, in full precision.
        let text = String::from_utf8(bytes.clone()).expect("text");
        let places: Vec<DVec3> = text
            .lines()
            .filter_map(|line| line.strip_prefix("v "))
            .map(|line| {
                let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().expect("a number")).collect();
                DVec3::from_slice(&numbers)
            })
            .collect();
        assert_eq!(places.len(), model.positions.len());
        for (got, expected) in places.iter().zip(&model.positions) {
            assert_eq!(got.truncate(), expected.truncate());
            assert_eq!(got.z as f32, expected.z as f32);
        }
        // By a reader.
        let options = tobj::LoadOptions::default();
        let none = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
        let (models, _) = tobj::load_obj_buf(&mut BufReader::new(&bytes[..]), &options, none).expect("an OBJ file");
        let of_group = |name: &str| models.iter().find(|model| model.name == name).map(|model| &model.mesh);
        let corners = |mesh: &tobj::Mesh| -> Vec<[f32; 3]> {
            let at =
                |&i: &u32| <[f32; 3]>::try_from(&mesh.positions[3 * i as usize..3 * i as usize + 3]).expect("three");
            mesh.indices.iter().map(at).collect()
        };
        let expected = |triangles: &[[u32; 3]]| -> Vec<[f32; 3]> {
            triangles.as_flattened().iter().map(|&v| model.positions[v as usize].as_vec3().to_array()).collect()
        };
        let (ground, rest) = model.triangles.split_at(model.ground_triangles);
        let mesh = of_group("ground").expect("ground");
        assert_eq!(corners(mesh), expected(ground));
        assert_eq!(mesh.normal_indices.len(), 3 * ground.len());
        let first = mesh.normal_indices[0] as usize * 3;
        let normal = Vec3::from_slice(&mesh.normals[first..first + 3]);
        assert!((normal - model.normals[ground[0][0] as usize]).length() < 2e-5);
        assert_eq!(of_group("base").map(corners), base.map(|_| expected(rest)));
        let line = of_group("shoreline").expect("a line");
        assert_eq!(line.indices.len(), 2 * model.shoreline.len());
    }
}

#[test]
fn stl_comes_back_closed() {
    let model = model(Some(-3.0));
    let (bytes, origin) = written("a.stl", &model);
    assert!(!bytes.starts_with(b"solid"));
    assert_eq!(bytes.len(), 84 + 50 * model.triangles.len());
    assert!(String::from_utf8_lossy(&bytes[..80]).contains(&format!("from {} {} 0", origin.x, origin.y)));
    let stl = stl_io::read_stl(&mut Cursor::new(&bytes)).expect("an STL file");
    stl.validate().expect("a closed mesh");
    assert_eq!(stl.faces.len(), model.triangles.len());
    for (face, triangle) in stl.faces.iter().zip(&model.triangles) {
        let [a, b, c] = triangle.map(|vertex| model.positions[vertex as usize]);
        let read = face.vertices.map(|v| DVec3::from_array(stl.vertices[v].0.map(f64::from)) + origin);
        for (got, expected) in read.iter().zip([a, b, c]) {
            assert!((*got - expected).length() < 1e-5, "{got} {expected}");
        }
        let normal = (b - a).cross(c - a).normalize();
        assert!((DVec3::from_array(face.normal.0.map(f64::from)) - normal).length() < 1e-5);
    }
}

#[test]
fn glb_comes_back_in_its_place_y_up() {
    for base in [None, Some(-3.0)] {
        let model = model(base);
        let (bytes, origin) = written("a.glb", &model);
        assert_ne!(origin, DVec3::ZERO);
        assert_eq!(bytes.len() % 4, 0);
        let gltf = gltf::Gltf::from_slice(&bytes).expect("a GLB file");
        let blob = gltf.blob.as_deref().expect("a binary chunk");
        let node = gltf.nodes().next().expect("a node");
        let (translation, ..) = node.transform().decomposed();
        let mesh = node.mesh().expect("a mesh");
        let primitives: Vec<_> = mesh.primitives().collect();
        assert_eq!(primitives.len(), 2);
        let reader = primitives[0].reader(|_| Some(blob));
        let back = |[x, y, z]: [f32; 3]| DVec3::new(f64::from(x), -f64::from(z), f64::from(y));
        let places: Vec<DVec3> = reader.read_positions().expect("positions").map(|p| back(p) + origin).collect();
        assert_eq!(places.len(), model.positions.len());
        for (got, expected) in places.iter().zip(&model.positions) {
            assert!((*got - *expected).length() < 1e-5, "{got} {expected}");
        }
        // The translation puts it back: single precision here is the reader's.
        assert_eq!(back(translation), origin.as_vec3().as_dvec3());
        let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
        assert_eq!(indices, model.triangles.as_flattened());
        let normals = reader.read_normals().map(|n| n.map(|n| back(n).as_vec3()).collect::<Vec<_>>());
        assert_eq!(normals, base.is_none().then(|| model.normals.clone()));
        let bounds = primitives[0].bounding_box();
        let all = || primitives[0].reader(|_| Some(blob)).read_positions().expect("positions").map(Vec3::from_array);
        assert_eq!(Vec3::from_array(bounds.min), all().fold(Vec3::INFINITY, Vec3::min));
        assert_eq!(Vec3::from_array(bounds.max), all().fold(Vec3::NEG_INFINITY, Vec3::max));
        let line = primitives[1].reader(|_| Some(blob));
        let ends: Vec<u32> = line.read_indices().expect("indices").into_u32().collect();
        assert_eq!(primitives[1].mode(), gltf::mesh::Mode::Lines);
        assert_eq!(ends, model.shoreline.as_flattened());
    }
}

#[test]
fn coordinates_near_zero_are_kept_as_they_are() {
    let mut model = model(None);
    model.positions.iter_mut().for_each(|at| *at -= CORNER.extend(0.0) + DVec3::new(40.0, 50.0, 0.0));
    assert_eq!(MeshFormat::Glb.origin(&model), DVec3::ZERO);
    // A degree of the Earth, in degrees: an origin of few digits.
    model.positions.iter_mut().for_each(|at| *at = DVec3::new(at.x / 90.0 - 155.53, at.y / 90.0 + 19.21, at.z));
    assert_eq!(MeshFormat::Stl.origin(&model), DVec3::new(-155.47, 19.15, 0.0));
    assert_eq!(MeshFormat::Ply.origin(&model), DVec3::ZERO);
    assert_eq!(MeshFormat::Stl.origin(&Model::default()), DVec3::ZERO);
}

#[test]
fn meshes_too_large_for_a_format_are_refused_before_work() {
    const GIB: usize = 1 << 30;
    let refused = |format: MeshFormat, vertices, triangles| {
        let said = format.fits(vertices, triangles, 0).expect_err("too large");
        assert!(said.starts_with("expected at most") && said.contains("got") && said.contains("write ."), "{said}");
    };
    refused(MeshFormat::Ply, 2 * GIB, 4 * GIB);
    refused(MeshFormat::Stl, 2 * GIB, 4 * GIB);
    refused(MeshFormat::Glb, GIB / 10, GIB / 5);
    assert_eq!(MeshFormat::Ply.fits(2 * GIB - 1, 4 * GIB, 0), Ok(()));
    assert_eq!(MeshFormat::Obj.fits(4 * GIB - 1, 8 * GIB, 0), Ok(()));
    assert_eq!(MeshFormat::Glb.fits(80_000_000, 160_000_000, 9), Ok(()));
}

#[test]
fn a_file_that_cannot_be_written_is_not_begun() {
    let folder = tempfile::tempdir().expect("a folder");
    let missing = folder.path().join("no/where.ply");
    let said = mesh(&missing, MeshFormat::Ply, &model(None), &[]).expect_err("no folder").to_string();
    assert!(said.contains("expected the folder"), "{said}");
    assert!(mesh(folder.path(), MeshFormat::Stl, &model(None), &[]).is_err());
    // A disk without room for it: the device that is always full.
    let full = PathBuf::from("/dev/full");
    if full.exists() {
        let sink = std::fs::OpenOptions::new().write(true).open(full).expect("a device");
        let mut sink = std::io::BufWriter::new(Unseeking(sink));
        let result = ply::write(&mut sink, &model(None), &[]).and_then(|()| std::io::Write::flush(&mut sink));
        assert_eq!(result.expect_err("full").kind(), std::io::ErrorKind::StorageFull);
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

/// A sink that cannot go back, as none of these formats needs to.
struct Unseeking(std::fs::File);

impl std::io::Write for Unseeking {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

impl std::io::Seek for Unseeking {
    fn seek(&mut self, _: std::io::SeekFrom) -> std::io::Result<u64> {
        Err(std::io::ErrorKind::Unsupported.into())
    }
}
