//! glTF 2.0, as text with its buffers beside it or as one binary file, through the `gltf` crate.
//!
//! The nodes of the default scene (or the first) in depth-first order, primitives in the meshes' order. Node
//! transforms are applied in f64, read from the JSON directly: the crate rounds them to f32, half a metre at
//! earth's radius. Axes are left as they are; skins and morph targets are not applied.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use serde_json::Value;

use super::Mesh;
use super::builder::{Builder, Corner, Place};
use crate::failure::{Failure, Outcome};

/// Reads the content of a .gltf or .glb file.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let fail = |e: &dyn std::fmt::Display| Failure::at(path, e);
    let json = if bytes.starts_with(b"glTF") {
        // the crate takes the head's 12 bytes off the length that it tells
        let length = bytes.get(8..12).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
        if length < 12 {
            return Err(fail(&format_args!(
                "expected a length of at least 12 bytes in the head, got {length}"
            )));
        }
        gltf::Glb::from_slice(bytes).map_err(|e| fail(&e))?.json.into_owned()
    } else {
        bytes.to_vec()
    };
    let json: Value = serde_json::from_slice(&json).map_err(|e| fail(&e))?;
    check_positions(&json).map_err(|what| fail(&what))?;
    let file = gltf::Gltf::from_slice(bytes).map_err(|e| fail(&e))?;
    let scene = file.default_scene().or(file.scenes().next()).ok_or_else(|| fail(&"expected a scene"))?;
    let mut reader = Reader {
        path,
        buffers: buffers(path, &file)?,
        nodes: &json["nodes"],
        deepest: file.nodes().len(),
        visits: 0,
        builder: Builder::new(path, 0),
        faces: 0,
    };
    for node in scene.nodes() {
        reader.node(&node, DMat4::IDENTITY, 1)?;
    }
    reader.builder.finish()
}

/// The crate looks up the accessors of positions before it has checked that there are so many.
fn check_positions(json: &Value) -> Result<(), String> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let accessors = json["accessors"].as_array().map_or(0, Vec::len);
    for (index, mesh) in list(&json["meshes"]).iter().enumerate() {
        for primitive in list(&mesh["primitives"]) {
            let position = primitive["attributes"]["POSITION"].as_u64().unwrap_or(0);
            if primitive["attributes"]["POSITION"].is_u64() && position >= accessors as u64 {
                return Err(format!(
                    "meshes[{index}]: POSITION is accessor {position}, accessors: {accessors}"
                ));
            }
        }
    }
    Ok(())
}

/// The content of all buffers: of the binary file itself, in the text (base64), or of files beside it.
fn buffers(path: &Path, file: &gltf::Gltf) -> Outcome<Vec<Vec<u8>>> {
    let load = |buffer: gltf::Buffer| {
        let fail = |what: String| Failure::at(path, format_args!("buffers[{}]: {what}", buffer.index()));
        let content = match buffer.source() {
            gltf::buffer::Source::Bin => file.blob.clone().ok_or_else(|| fail("no binary chunk".into()))?,
            gltf::buffer::Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => {
                    let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
                    let encoded = encoded.ok_or_else(|| fail("expected base64 data".into()))?;
                    STANDARD.decode(encoded).map_err(|e| fail(e.to_string()))?
                }
                None => {
                    let name = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
                    let beside = path.parent().unwrap_or(Path::new("")).join(&*name);
                    std::fs::read(&beside).map_err(|e| fail(format!("{}: {e}", beside.display())))?
                }
            },
        };
        if content.len() < buffer.length() {
            return Err(fail(format!("expected {} bytes, got {}", buffer.length(), content.len())));
        }
        Ok(content)
    };
    file.buffers().map(load).collect()
}

struct Reader<'a> {
    path: &'a Path,
    buffers: Vec<Vec<u8>>,
    nodes: &'a Value,
    deepest: usize,
    visits: usize,
    builder: Builder<'a>,
    faces: usize,
}

impl Reader<'_> {
    fn node(&mut self, node: &gltf::Node, parent: DMat4, depth: usize) -> Outcome<()> {
        if depth > self.deepest {
            return Err(self.fail(&format!("nodes[{}] is its own ancestor", node.index())));
        }
        // without this, nodes that share children could ask for twice the work on each level
        self.visits += 1;
        if self.visits > self.deepest {
            return Err(self.fail(&format!("nodes[{}] is a child of two nodes", node.index())));
        }
        let transform = local(&self.nodes[node.index()])
            .ok_or_else(|| self.fail(&format!("nodes[{}]: expected a finite transform", node.index())))?;
        let transform = parent * transform;
        for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives()) {
            self.primitive(&primitive, transform)
                .map_err(|what| self.fail(&format!("nodes[{}]: {what}", node.index())))?;
        }
        node.children().try_for_each(|child| self.node(&child, transform, depth + 1))
    }

    fn fail(&self, what: &str) -> Failure {
        Failure::at(self.path, what)
    }

    /// Appends a primitive's triangles. The error is a sentence without the file's name.
    fn primitive(&mut self, primitive: &gltf::Primitive, transform: DMat4) -> Result<(), String> {
        // Points and lines have no facets.
        if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(());
        }
        let of = format!("primitive {}", primitive.index());
        for (semantic, accessor) in primitive.attributes() {
            if matches!(semantic, gltf::Semantic::Positions | gltf::Semantic::Normals) {
                sound(&accessor, Dimensions::Vec3, &[DataType::F32]).map_err(|e| format!("{of}: {e}"))?;
            }
        }
        if let Some(accessor) = primitive.indices() {
            sound(&accessor, Dimensions::Scalar, &[DataType::U8, DataType::U16, DataType::U32])
                .map_err(|e| format!("{of}: {e}"))?;
        }
        let reader = primitive.reader(|buffer| self.buffers.get(buffer.index()).map(Vec::as_slice));
        let short = || format!("{of}: an accessor reaches beyond its buffer");
        let positions: Vec<[f32; 3]> = reader.read_positions().ok_or_else(short)?.collect();
        let normals: Option<Vec<[f32; 3]>> = reader.read_normals().map(Iterator::collect);
        if primitive.get(&gltf::Semantic::Normals).is_some()
            && normals.as_ref().is_none_or(|normals| normals.len() != positions.len())
        {
            return Err(format!("{of}: expected as many normals as positions"));
        }
        let indices: Vec<u32> = match primitive.indices() {
            Some(_) => reader.read_indices().ok_or_else(short)?.into_u32().collect(),
            None => (0..positions.len() as u32).collect(),
        };
        if primitive.mode() == Mode::Triangles && !indices.len().is_multiple_of(3) {
            return Err(format!("{of}: expected a multiple of 3 indices, got {}", indices.len()));
        }
        let vertices = Vertices { positions, normals };
        if let Some(index) = indices.iter().find(|i| **i as usize >= vertices.positions.len()) {
            let count = vertices.positions.len();
            return Err(format!("{of}: vertex index {index} is out of range: expected 0 to {}", count - 1));
        }
        let triangles = triangles(primitive.mode(), &indices);
        if triangles.is_empty() {
            return Ok(());
        }
        let material = self.builder.material(primitive.material().name().unwrap_or("default"));
        self.append(&vertices, transform, triangles, material).map_err(|e| format!("{of}: {e}"))
    }

    fn append(
        &mut self,
        vertices: &Vertices,
        transform: DMat4,
        triangles: Vec<[u32; 3]>,
        material: u32,
    ) -> Result<(), Failure> {
        let (vertex, normal) = (self.builder.vertices() as i64, self.builder.normals() as i64);
        for p in &vertices.positions {
            let place = Place::Item(self.builder.vertices());
            self.builder.vertex(place, transform.transform_point3(p.map(f64::from).into()).into())?;
        }
        let linear = DMat3::from_mat4(transform);
        // Normals turn with the cofactors, which exist for singular transforms too; front stays front.
        let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        for n in vertices.normals.iter().flatten() {
            let place = Place::Item(self.builder.normals());
            self.builder.normal(place, (cofactors * DVec3::from(n.map(f64::from))).into())?;
        }
        let with_normals = vertices.normals.is_some();
        for mut triangle in triangles {
            if sign < 0.0 {
                // A mirroring transform turns the winding round (glTF 2.0, section 3.7.4).
                triangle.swap(1, 2);
            }
            let corners = triangle.map(|i| Corner {
                vertex: vertex + i64::from(i),
                normal: with_normals.then_some(normal + i64::from(i)),
            });
            self.builder.polygon(Place::Item(self.faces), corners, material)?;
            self.faces += 1;
        }
        Ok(())
    }
}

struct Vertices {
    positions: Vec<[f32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
}

/// Checks what the crate's accessor iterator takes for granted.
fn sound(accessor: &gltf::Accessor, shape: Dimensions, types: &[DataType]) -> Result<(), String> {
    let of = format!("accessors[{}]", accessor.index());
    if accessor.dimensions() != shape || !types.contains(&accessor.data_type()) {
        return Err(format!("{of}: expected {shape:?} of {types:?}"));
    }
    if accessor.count() == 0 || accessor.sparse().is_some_and(|sparse| sparse.count() == 0) {
        return Err(format!("{of}: expected at least one element"));
    }
    let item = accessor.size();
    let fits = |view: gltf::buffer::View, offset: usize, count: usize| {
        let stride = view.stride().unwrap_or(item);
        let end = stride.checked_mul(count).and_then(|bytes| bytes.checked_add(offset));
        let view_end = view.offset().checked_add(view.length());
        stride >= item
            && end.is_some_and(|end| end <= view.length() + stride - item)
            && view_end.is_some_and(|end| end <= view.buffer().length())
    };
    if accessor.view().is_some_and(|view| !fits(view, accessor.offset(), accessor.count())) {
        return Err(format!("{of} reaches beyond its buffer"));
    }
    Ok(())
}

fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::Triangles => indices.as_chunks().0.to_vec(),
        Mode::TriangleFan => {
            let first = indices[..1].repeat(indices.len());
            first.iter().zip(indices.windows(2).skip(1)).map(|(a, bc)| [*a, bc[0], bc[1]]).collect()
        }
        _ => {
            let turned = |(i, abc): (usize, &[u32])| {
                // Every second triangle of a strip runs the other way.
                if i % 2 == 0 { [abc[0], abc[1], abc[2]] } else { [abc[1], abc[0], abc[2]] }
            };
            indices.windows(3).enumerate().map(turned).collect()
        }
    }
}

/// A node's own transform: `matrix`, or `translation`, `rotation` and `scale`; `None` where not finite.
fn local(node: &Value) -> Option<DMat4> {
    let matrix = match numbers::<16>(node, "matrix") {
        Some(columns) => DMat4::from_cols_array(&columns),
        None => {
            let rotation = numbers(node, "rotation").map_or(DQuat::IDENTITY, DQuat::from_array);
            let scale = numbers(node, "scale").map_or(DVec3::ONE, DVec3::from_array);
            let translation = numbers(node, "translation").map_or(DVec3::ZERO, DVec3::from_array);
            // Files carry quaternions rounded to f32.
            if rotation.length() == 0.0 {
                return None;
            }
            DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation)
        }
    };
    matrix.is_finite().then_some(matrix)
}

fn numbers<const N: usize>(node: &Value, key: &str) -> Option<[f64; N]> {
    let values: Vec<f64> = node.get(key)?.as_array()?.iter().filter_map(Value::as_f64).collect();
    values.try_into().ok()
}
