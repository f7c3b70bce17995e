//! A glTF scene as one form: every node's meshes where it has them, turned from y up to z up.

use super::bytes::Numbers;
use glam::{Mat3, Mat4, Quat, Vec3};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Root, scene};
use littoral::objects::{Corner, Form, creased};
use std::borrow::Cow;
use std::collections::HashMap;

/// The most triangles, whatever the nodes repeat.
const MOST: usize = 4_000_000;

/// Nodes within nodes.
const DEEPEST: usize = 256;

/// East, north and up from glTF's axes.
fn turned(at: Vec3) -> Vec3 {
    Vec3::new(at.x, -at.z, at.y)
}

/// All that the scene shows: the one that the file names, else its first, else all nodes that are no other's children.
pub fn form(root: &Root, buffers: &[Cow<[u8]>], warnings: &mut Vec<String>) -> Result<Form, String> {
    let scene = root.scene.map_or(0, |scene| scene.value());
    let mut open: Vec<(usize, Mat4, usize)> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|node| (node.value(), Mat4::IDENTITY, 0)).collect(),
        None => {
            let children = root.nodes.iter().flat_map(|node| node.children.iter().flatten());
            let mut is_child = vec![false; root.nodes.len()];
            children.for_each(|child| is_child[child.value()] = true);
            (0..root.nodes.len()).filter(|&node| !is_child[node]).map(|node| (node, Mat4::IDENTITY, 0)).collect()
        }
    };
    let mut seen = vec![false; root.nodes.len()];
    let mut builder = Builder { root, buffers, warnings, form: Form::default(), left: MOST };
    while let Some((number, parent, depth)) = open.pop() {
        // The specification has nodes in trees: each is some other's child once, or none's.
        if std::mem::replace(&mut seen[number], true) || depth > DEEPEST {
            return Err("expected nodes in trees, got a circle of them; export it anew".into());
        }
        let node = &root.nodes[number];
        let matrix = parent * local(node);
        open.extend(node.children.iter().flatten().map(|child| (child.value(), matrix, depth + 1)));
        if let Some(mesh) = node.mesh {
            for primitive in &root.meshes[mesh.value()].primitives {
                builder.add(primitive, matrix)?;
            }
        }
    }
    Ok(builder.form)
}

/// From a node's coordinates to its parent's.
fn local(node: &scene::Node) -> Mat4 {
    match &node.matrix {
        Some(columns) => Mat4::from_cols_array(columns),
        None => Mat4::from_scale_rotation_translation(
            node.scale.map_or(Vec3::ONE, Vec3::from),
            node.rotation.map_or(Quat::IDENTITY, |turn| Quat::from_array(turn.0).normalize()),
            node.translation.map_or(Vec3::ZERO, Vec3::from),
        ),
    }
}

struct Builder<'a> {
    root: &'a Root,
    buffers: &'a [Cow<'a, [u8]>],
    warnings: &'a mut Vec<String>,
    form: Form,
    /// Triangles that there may still be.
    left: usize,
}

impl<'a> Builder<'a> {
    fn warn(&mut self, warning: &str) {
        if !self.warnings.iter().any(|known| known == warning) {
            self.warnings.push(warning.to_owned());
        }
    }

    fn numbers(&self, primitive: &Primitive, semantic: Semantic) -> Result<Option<Numbers<'a>>, String> {
        let accessor = primitive.attributes.get(&Checked::Valid(semantic));
        accessor.map(|&accessor| Numbers::of(self.root, self.buffers, accessor)).transpose()
    }

    fn add(&mut self, primitive: &Primitive, matrix: Mat4) -> Result<(), String> {
        let mode = match &primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => *mode,
            _ => {
                self.warn("its points and lines are left out");
                return Ok(());
            }
        };
        let (root, buffers) = (self.root, self.buffers);
        let Some(positions) = self.numbers(primitive, Semantic::Positions)? else { return Ok(()) };
        let indices = primitive.indices.map(|indices| Numbers::of(root, buffers, indices)).transpose()?;
        let count = indices.as_ref().map_or(positions.count, |indices| indices.count);
        let triangles = if mode == Mode::Triangles { count / 3 } else { count.saturating_sub(2) };
        self.left = self.left.checked_sub(triangles).ok_or_else(|| {
            format!("expected at most {MOST} triangles, got more; simplify the object, or let nodes repeat less of it")
        })?;
        let corner = |i: usize| match &indices {
            None => Ok(i as u32),
            Some(indices) => {
                let last = positions.count.saturating_sub(1);
                let index = indices.index(i).filter(|&index| (index as usize) < positions.count);
                index.ok_or_else(|| format!("expected indices from 0 to {last}, got another; export it anew"))
            }
        };
        let numbered = |k: usize| match mode {
            Mode::Triangles => [3 * k, 3 * k + 1, 3 * k + 2],
            Mode::TriangleFan => [0, k + 1, k + 2],
            _ => [k, k + 1 + k % 2, k + 2 - k % 2],
        };
        // Only the vertices that are named: many primitives may share one long list.
        let (mut named, mut used, mut list) = (HashMap::new(), Vec::new(), Vec::with_capacity(triangles));
        for k in 0..triangles {
            let mut triangle = [0; 3];
            for (to, i) in triangle.iter_mut().zip(numbered(k)) {
                let vertex = corner(i)?;
                *to = *named.entry(vertex).or_insert_with(|| {
                    used.push(vertex as usize);
                    used.len() as u32 - 1
                });
            }
            list.push(triangle);
        }
        let linear = Mat3::from_mat4(matrix);
        if linear.determinant() < 0.0 {
            list.iter_mut().for_each(|triangle| triangle.swap(1, 2)); // mirrored
        }
        let normals = self
            .numbers(primitive, Semantic::Normals)?
            .filter(|normals| normals.width == 3 && normals.count >= positions.count);
        let colours = self.numbers(primitive, Semantic::Colors(0))?.filter(|colours| colours.count >= positions.count);
        let (base, textured) = self.base(primitive);
        let albedo = |vertex: usize| base * colours.as_ref().map_or(Vec3::ONE, |colours| colours.vector(vertex).into());
        let position = |vertex: usize| turned(matrix.transform_point3(positions.vector(vertex).into()));
        let part = match normals {
            Some(normals) => {
                // Normals turn with the inverse of the transposed matrix; a flattened node has none.
                let across = linear.inverse().transpose();
                let across = if across.is_finite() { across } else { linear };
                let corner = |&vertex: &usize| Corner {
                    position: position(vertex),
                    normal: turned(across * Vec3::from(normals.vector(vertex))).normalize_or(Vec3::Z),
                    albedo: albedo(vertex),
                };
                Form { corners: used.iter().map(corner).collect(), triangles: list, error: 0.0 }
            }
            // The specification asks for flat facets.
            None => {
                let places: Vec<(Vec3, Vec3)> = used.iter().map(|&vertex| (position(vertex), albedo(vertex))).collect();
                creased(&places, &list, 1.0)
            }
        };
        let first = self.form.corners.len() as u32;
        self.form.corners.extend(part.corners);
        self.form.triangles.extend(part.triangles.iter().map(|triangle| triangle.map(|corner| first + corner)));
        if textured {
            self.warn("its textures are left out: it is drawn in its base colours");
        }
        Ok(())
    }

    /// The base colour of a primitive, and whether there is a texture to it.
    fn base(&self, primitive: &Primitive) -> (Vec3, bool) {
        let Some(material) = primitive.material.and_then(|material| self.root.materials.get(material.value())) else {
            return (Vec3::ONE, false);
        };
        let look = &material.pbr_metallic_roughness;
        let [red, green, blue, _] = look.base_color_factor.0;
        (Vec3::new(red, green, blue), look.base_color_texture.is_some())
    }
}
