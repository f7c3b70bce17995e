//! A glTF file's description and its numbers.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::{Checked, USize64, Validate};
use gltf::json::{Accessor, Index, Path, Root, Value};
use std::borrow::Cow;

/// The description, and the binary chunk if there is one.
pub fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    if !bytes.starts_with(b"glTF") {
        let text = bytes.trim_ascii_start().starts_with(b"{");
        let wrong = "expected a glTF object (.glb or .gltf), got another format; export it as .glb";
        return if text { Ok((bytes, None)) } else { Err(wrong.into()) };
    }
    let number = |at: usize| bytes.get(at..at + 4).and_then(|four| four.try_into().ok()).map(u32::from_le_bytes);
    match number(4) {
        Some(2) => {}
        Some(version) => return Err(format!("expected glTF 2.0, got version {version}; export it anew")),
        None => return Err(cut_off(12, bytes.len())),
    }
    let (mut description, mut binary) = (None, None);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (number(at), bytes.get(at + 4..at + 8)) {
        let (from, to) = (at + 8, at as u64 + 8 + u64::from(length));
        let chunk = usize::try_from(to).ok().and_then(|to| bytes.get(from..to));
        let chunk = chunk.ok_or_else(|| cut_off(to, bytes.len()))?;
        match kind {
            b"JSON" if description.is_none() => description = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {} // the specification asks that others be passed over
        }
        at = from + chunk.len();
    }
    let description = description.ok_or_else(|| cut_off(20, bytes.len()))?;
    Ok((description, binary))
}

fn cut_off(expected: u64, got: usize) -> String {
    format!("expected at least {expected} bytes, got {got}: it is cut off; fetch or export it again")
}

/// The description, all whose names are those of things that exist.
pub fn described(json: &[u8]) -> Result<Root, String> {
    let wrong = |problem: String| format!("expected a sound glTF description, got {problem}; export it anew");
    let mut root: Root = gltf::json::deserialize::from_slice(json).map_err(|e| wrong(e.to_string()))?;
    // Numbers of any size are read here, which is all that this one asks for.
    root.extensions_required.retain(|name| name != "KHR_mesh_quantization");
    if let Some(name) = root
        .extensions_required
        .iter()
        .find(|name| !name.starts_with("KHR_materials_") && *name != "KHR_texture_transform")
    {
        return Err(format!("expected plain glTF, got one that needs {name}; export it without compression"));
    }
    // Materials that need more than a base colour are drawn in that.
    root.extensions_required.clear();
    // Bounds that files tell are not used; the checks below would look them up without asking whether there are such accessors.
    for accessor in &mut root.accessors {
        accessor.min = Some(Value::from(vec![0.0; 3]));
        accessor.max.clone_from(&accessor.min);
    }
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    if primitives.flat_map(|p| p.attributes.values()).any(|accessor| accessor.value() >= root.accessors.len()) {
        return Err(wrong("the name of an accessor that is out of bounds".into()));
    }
    let mut first = None;
    root.validate(&root, Path::new, &mut |path, error| {
        first.get_or_insert_with(|| format!("{} at {}", error.to_string().to_lowercase(), path()));
    });
    first.map_or(Ok(root), |problem| Err(wrong(problem)))
}

/// The bytes of each buffer, at least as many as the description says.
pub fn buffers<'a>(
    root: &Root,
    binary: Option<&'a [u8]>,
    beside: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<Vec<Cow<'a, [u8]>>, String> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    let mut total = 0;
    for (number, buffer) in root.buffers.iter().enumerate() {
        let bytes = match (&buffer.uri, binary) {
            (None, Some(binary)) => Cow::Borrowed(binary),
            (None, None) => return Err(format!("expected the bytes of buffer {number}, got none; export it as .glb")),
            (Some(uri), _) => Cow::Owned(match uri.strip_prefix("data:") {
                Some(data) => {
                    let text = data.split_once(";base64,").map(|(_, text)| text);
                    let decoded = text.and_then(|text| BASE64_STANDARD.decode(text).ok());
                    decoded.ok_or_else(|| {
                        format!("expected base64 in buffer {number}, got something else; export it as .glb")
                    })?
                }
                None => beside(uri).map_err(|problem| format!("buffer {number}: {problem}"))?,
            }),
        };
        total += if matches!(bytes, Cow::Owned(_)) { bytes.len() as u64 } else { 0 };
        if total > super::LONGEST {
            return Err(format!(
                "expected buffers of at most {} bytes together, got more; simplify it",
                super::LONGEST
            ));
        }
        if (bytes.len() as u64) < buffer.byte_length.0 {
            return Err(cut_off(buffer.byte_length.0, bytes.len()));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// Numbers in a buffer, which holds all of them.
pub struct Numbers<'a> {
    bytes: &'a [u8],
    stride: usize,
    /// How many vectors.
    pub count: usize,
    /// How many numbers each has.
    pub width: usize,
    component: ComponentType,
    normalized: bool,
}

impl<'a> Numbers<'a> {
    /// Those of an accessor.
    pub fn of(root: &Root, buffers: &'a [Cow<[u8]>], accessor: Index<Accessor>) -> Result<Numbers<'a>, String> {
        let number = accessor.value();
        let accessor = &root.accessors[number];
        let (Checked::Valid(component), Checked::Valid(kind)) = (accessor.component_type, accessor.type_) else {
            return Err(format!("expected numbers of a known type in accessor {number}, got others; export it anew"));
        };
        let width = match kind {
            Type::Scalar => 1,
            Type::Vec2 => 2,
            Type::Vec3 => 3,
            Type::Vec4 => 4,
            _ => return Err(format!("expected vectors in accessor {number}, got matrices; export it anew")),
        };
        let (Some(view), None) = (accessor.buffer_view, &accessor.sparse) else {
            return Err(format!(
                "expected the numbers of accessor {number}, got a sparse one; export it without morphs"
            ));
        };
        let view = &root.buffer_views[view.value()];
        let size = width * component.0.size();
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        let from = |offset: Option<USize64>| offset.map_or(0, |offset| offset.0);
        let held = || {
            let bytes = &buffers[view.buffer.value()];
            let start = usize::try_from(from(view.byte_offset)).ok()?;
            let within = bytes.get(start..start.checked_add(usize::try_from(view.byte_length.0).ok()?)?)?;
            let within = within.get(usize::try_from(from(accessor.byte_offset)).ok()?..)?;
            let count = usize::try_from(accessor.count.0).ok()?;
            let last = if count == 0 { 0 } else { (count - 1).checked_mul(stride)?.checked_add(size)? };
            (stride >= size && last <= within.len()).then_some((within, count))
        };
        let (bytes, count) = held().ok_or_else(|| {
            let count = accessor.count.0;
            format!("expected {count} vectors of {size} bytes in accessor {number}, got fewer bytes; fetch or export it again")
        })?;
        Ok(Numbers { bytes, stride, count, width, component: component.0, normalized: accessor.normalized })
    }

    fn raw(&self, vector: usize, axis: usize) -> &[u8] {
        let size = self.component.size();
        &self.bytes[vector * self.stride + axis * size..][..size]
    }

    /// A whole number without sign, for indices; `None` if it is of another type.
    pub fn index(&self, vector: usize) -> Option<u32> {
        match (self.component, self.raw(vector, 0)) {
            (ComponentType::U8, &[a]) => Some(a.into()),
            (ComponentType::U16, &[a, b]) => Some(u16::from_le_bytes([a, b]).into()),
            (ComponentType::U32, &[a, b, c, d]) => Some(u32::from_le_bytes([a, b, c, d])),
            _ => None,
        }
    }

    /// Its first three numbers (0 for what it lacks), normalised if the file says so.
    pub fn vector(&self, vector: usize) -> [f32; 3] {
        let scaled = |value: f32, most: f32| if self.normalized { (value / most).max(-1.0) } else { value };
        [0, 1, 2].map(|axis| match (self.component, if axis < self.width { self.raw(vector, axis) } else { &[] }) {
            (ComponentType::I8, &[a]) => scaled(f32::from(a as i8), 127.0),
            (ComponentType::U8, &[a]) => scaled(f32::from(a), 255.0),
            (ComponentType::I16, &[a, b]) => scaled(f32::from(i16::from_le_bytes([a, b])), 32_767.0),
            (ComponentType::U16, &[a, b]) => scaled(f32::from(u16::from_le_bytes([a, b])), 65_535.0),
            (ComponentType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
            _ => 0.0,
        })
    }
}
