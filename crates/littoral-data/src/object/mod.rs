//! Objects from glTF files, `.glb` or `.gltf`: Khronos, *glTF 2.0 specification*, 2021 (ISO/IEC 12113:2022).
//!
//! There y points up and metres are the unit. Here x points east, y north and z up: east is its x, north its −z, as in the GLB files that
//! [`crate::write`] writes. Of materials the base colour is read, times the colours of vertices; a texture is told of and left out. Animations, skins,
//! lights and cameras are none of an object's business.
//!
//! The crate `gltf` knows the description and checks that whatever is named there exists. Bytes are read here: no number of the file is believed
//! before it was held against the bytes that there are.

mod bytes;
mod order;
mod scene;

pub use order::ObjectOrder;

use crate::Error;
use littoral::objects::Object;
use std::path::{Component, Path};

/// An object from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectFile {
    /// The object: in one form, or with the feature `lod` in a chain of ever coarser ones.
    pub object: Object,
    /// What was noticed. One sentence each.
    pub warnings: Vec<String>,
}

/// No file is longer (bytes).
const LONGEST: u64 = 1 << 30;

/// Opens a `.glb` file, or a `.gltf` file with its buffers beside it or within.
///
/// # Errors
/// If it cannot be read, is no glTF, is broken, needs what is not known here, or has nothing to be seen.
pub fn open_object(file: &Path) -> Result<ObjectFile, Error> {
    let beside = |name: &str| {
        let name = Path::new(name);
        let own = name.components().all(|part| matches!(part, Component::Normal(_)));
        let problem = "expected the name of a file beside it, got a place elsewhere; save it as .glb";
        if own { whole(&file.with_file_name("").join(name)).map_err(|e| e.to_string()) } else { Err(problem.into()) }
    };
    object_from(file, &whole(file)?, &beside)
}

/// All bytes of a file.
fn whole(file: &Path) -> Result<Vec<u8>, Error> {
    // Asked before opening: opening a pipe would wait for its other end.
    let metadata = std::fs::metadata(file).map_err(|e| Error::io(file, e))?;
    if !metadata.is_file() {
        return Err(Error::content(
            file,
            "expected an object's file (.glb or .gltf), got a folder or device; name a file",
        ));
    }
    if metadata.len() > LONGEST {
        let got = metadata.len();
        return Err(Error::content(
            file,
            format!("expected at most {LONGEST} bytes of an object, got {got}; simplify it"),
        ));
    }
    std::fs::read(file).map_err(|e| Error::io(file, e))
}

/// Reads an object that a file held. `beside` gives the bytes of a file beside it, or says why not.
///
/// # Errors
/// As [`open_object`].
pub fn object_from(
    file: &Path,
    bytes: &[u8],
    beside: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<ObjectFile, Error> {
    let wrong = |problem: String| Error::content(file, problem);
    let (description, binary) = bytes::split(bytes).map_err(wrong)?;
    let root = bytes::described(description).map_err(wrong)?;
    let buffers = bytes::buffers(&root, binary, beside).map_err(wrong)?;
    let mut warnings = Vec::new();
    let form = scene::form(&root, &buffers, &mut warnings).map_err(wrong)?;
    if form.triangles.is_empty() {
        return Err(wrong("expected triangles to be seen, got none; export the object's meshes, too".into()));
    }
    let object = Object::new(vec![form]).map_err(|e| wrong(e.to_string()))?;
    #[cfg(feature = "lod")]
    let object = crate::lod::with_coarser_forms(object).map_err(|e| wrong(e.to_string()))?;
    Ok(ObjectFile { object, warnings })
}
