//! glTF 2.0, as text with its buffers beside it or as one binary file.
//!
//! A reader of its own: the `gltf` crate rounds node transforms to f32, half a metre at earth's radius, and refuses files
//! that ask for an extension, be it one for textures. The nodes of the default scene (or the first) are read in depth-first
//! order, primitives in the meshes' order. Axes are left as they are. Instances (EXT_mesh_gpu_instancing) and quantised
//! numbers (KHR_mesh_quantization) are read; skins, morph targets and animations are told and not applied.

mod accessor;
mod container;
mod document;

use std::path::Path;

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::builder::{Builder, Corner, Place};
use super::{Finish, Mesh};
use crate::failure::{Failure, Outcome};
use container::Container;
use document::{Node, Primitive};

const INSTANCES: &str = "EXT_mesh_gpu_instancing";
const HIDDEN: &str = "KHR_node_visibility";
/// Primitives whose attributes are in one compressed stream.
const DRACO: &str = "KHR_draco_mesh_compression";
/// Extensions that say nothing of where facets are, by the beginning of their names, and those that are read.
const HARMLESS: [&str; 22] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "MSFT_packing_",
    "MSFT_lod",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_animation_",
    "KHR_techniques_",
    "KHR_audio",
    "EXT_structural_metadata",
    "EXT_mesh_features",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "CESIUM_primitive_outline",
    "ADOBE_materials_",
    "KHR_mesh_quantization",
    "KHR_physics",
    INSTANCES,
    HIDDEN,
];

/// Reads the content of a .gltf or .glb file.
pub fn read(path: &Path, bytes: &[u8]) -> Outcome<Mesh> {
    let container = container::read(path, bytes)?;
    let mut reader = Reader { container: &container, visits: 0, builder: Builder::new(path, 0), faces: 0 };
    reader.all().map_err(|what| Failure::at(path, what))?;
    reader.builder.finish()
}

struct Reader<'a> {
    container: &'a Container,
    visits: usize,
    builder: Builder<'a>,
    faces: usize,
}

/// The error of all methods is a sentence without the file's name.
impl Reader<'_> {
    fn all(&mut self) -> Result<(), String> {
        let document = &self.container.document;
        for name in &document.extensions_required {
            let known = HARMLESS.iter().any(|harmless| name.starts_with(harmless));
            // Compressed data are told where they are met; they need not be all of the file.
            if !known && name != DRACO && !name.ends_with("meshopt_compression") {
                let what = format!("extension {name} is asked for and unknown: read without it");
                self.builder.warn_of_file("extension", what);
            }
        }
        if !document.animations.is_empty() {
            self.builder.warn_of_file("animation", "animations are not applied: nodes stand as they are");
        }
        self.name_materials();
        let roots = match document.scene.or((!document.scenes.is_empty()).then_some(0)) {
            Some(index) => {
                let count = document.scenes.len();
                let scene = document.scenes.get(index);
                if count > 1 {
                    let what = format!("scene {index} of {count} is read");
                    self.builder.warn_of_file("scenes", what);
                }
                scene.ok_or_else(|| format!("scene {index}: expected one of {count} scenes"))?.nodes.clone()
            }
            None => {
                self.builder.warn_of_file("scenes", "the file has no scene: all nodes are read");
                let is_child =
                    |index: &usize| document.nodes.iter().any(|node| node.children.contains(index));
                (0..document.nodes.len()).filter(|index| !is_child(index)).collect()
            }
        };
        roots.into_iter().try_for_each(|node| self.node(node, DMat4::IDENTITY, 1))
    }

    /// Tells materials that the file does not tell apart by name.
    fn name_materials(&mut self) {
        let materials = &self.container.document.materials;
        for (index, material) in materials.iter().enumerate() {
            let (name, given) = (self.material_name(index), material.name.is_some());
            if !given && materials.len() > 1 {
                let what = format!("materials[{index}] has no name: it is called {name:?} here");
                self.builder.warn_of_file("unnamed material", what);
            }
            let same = materials[..index].iter().position(|other| other.name == material.name);
            if let Some(first) = same.filter(|_| given) {
                let what = format!(
                    "materials[{first}] and [{index}] are both called {name:?}: one table serves both"
                );
                self.builder.warn_of_file("same material", what);
            }
        }
    }

    fn material_name(&self, index: usize) -> String {
        let name = self.container.document.materials.get(index).and_then(|material| material.name.clone());
        name.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("material_{index}"))
    }

    fn node(&mut self, index: usize, parent: DMat4, depth: usize) -> Result<(), String> {
        let nodes = &self.container.document.nodes;
        let node =
            nodes.get(index).ok_or_else(|| format!("nodes[{index}]: expected one of {}", nodes.len()))?;
        if depth > nodes.len() {
            return Err(format!("nodes[{index}] is its own ancestor"));
        }
        // Without this, nodes that share children could ask for twice the work on each level.
        self.visits += 1;
        if self.visits > nodes.len() {
            return Err(format!("nodes[{index}] is a child of two nodes"));
        }
        let visible = node.extensions.get(HIDDEN).and_then(|hidden| hidden.get("visible")?.as_bool());
        if visible == Some(false) {
            let what = format!("nodes[{index}] and its children are not visible ({HIDDEN}): passed over");
            self.builder.warn_of_file("hidden", what);
            return Ok(());
        }
        let transform = local(node).ok_or_else(|| format!("nodes[{index}]: expected a finite transform"))?;
        let transform = parent * transform;
        self.mesh(node, transform).map_err(|what| format!("nodes[{index}]: {what}"))?;
        node.children.iter().try_for_each(|child| self.node(*child, transform, depth + 1))
    }

    fn mesh(&mut self, node: &Node, transform: DMat4) -> Result<(), String> {
        let Some(index) = node.mesh else { return Ok(()) };
        let meshes = &self.container.document.meshes;
        let mesh =
            meshes.get(index).ok_or_else(|| format!("mesh {index}: expected one of {}", meshes.len()))?;
        if node.skin.is_some() {
            let what = format!("meshes[{index}]: its skin is not applied, its vertices stand as they are");
            self.builder.warn_of_file("skin", what);
        }
        let weights = node.weights.as_ref().or(mesh.weights.as_ref());
        let bent = weights.is_some_and(|weights| weights.iter().any(|w| *w != 0.0));
        if bent && mesh.primitives.iter().any(|primitive| !primitive.targets.is_empty()) {
            let what = format!("meshes[{index}]: its morph targets are not applied");
            self.builder.warn_of_file("morph", what);
        }
        for transform in self.instances(node, transform)? {
            for (number, primitive) in mesh.primitives.iter().enumerate() {
                self.primitive(primitive, transform)
                    .map_err(|what| format!("meshes[{index}], primitive {number}: {what}"))?;
            }
        }
        Ok(())
    }

    /// The transforms of the node's instances, or its own.
    fn instances(&self, node: &Node, transform: DMat4) -> Result<Vec<DMat4>, String> {
        let Some(instances) = node.extensions.get(INSTANCES) else { return Ok(vec![transform]) };
        let attribute = |name: &str| {
            let index = instances.get("attributes").and_then(|attributes| attributes.get(name)?.as_u64());
            index.map(|index| index as usize)
        };
        let within = |what: String| format!("{INSTANCES}: {what}");
        let vectors =
            |name| attribute(name).map(|i| accessor::read::<3>(self.container, i, "VEC3")).transpose();
        let (moved, scaled) = (vectors("TRANSLATION").map_err(within)?, vectors("SCALE").map_err(within)?);
        let turned = attribute("ROTATION").map(|i| accessor::read::<4>(self.container, i, "VEC4"));
        let turned = turned.transpose().map_err(within)?;
        let counts =
            [moved.as_ref().map(Vec::len), scaled.as_ref().map(Vec::len), turned.as_ref().map(Vec::len)];
        let count = counts.iter().flatten().copied().next().unwrap_or(1);
        if counts.iter().flatten().any(|other| *other != count) {
            return Err(within(format!("expected attributes of one length, got {counts:?}")));
        }
        let one = |i: usize| {
            let own = from_parts(
                moved.as_ref().map_or([0.0; 3], |list| list[i]),
                turned.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |list| list[i]),
                scaled.as_ref().map_or([1.0; 3], |list| list[i]),
            );
            let own = own.filter(|own| own.is_finite());
            own.map(|own| transform * own)
                .ok_or_else(|| within(format!("instance {i}: expected a finite transform")))
        };
        (0..count).map(one).collect()
    }

    /// Appends a primitive's triangles.
    fn primitive(&mut self, primitive: &Primitive, transform: DMat4) -> Result<(), String> {
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            // Points and lines have no facets.
            return Ok(());
        }
        if mode > 6 {
            return Err(format!("mode {mode}: expected 0 to 6"));
        }
        let attribute = |name: &str| match primitive.attributes.get(name) {
            None => Ok(None),
            Some(index) => index
                .as_u64()
                .map(|index| Some(index as usize))
                .ok_or_else(|| format!("{name}: expected the index of an accessor, got {index}")),
        };
        let Some(position) = attribute("POSITION")? else {
            return if primitive.extensions.contains_key(DRACO) {
                Err(format!("{DRACO} is not supported: expected a mesh without compression"))
            } else {
                Err("expected the attribute POSITION".into())
            };
        };
        let of_accessor = |index: usize| self.container.document.accessors.get(index);
        let bare = of_accessor(position).is_some_and(|a| a.buffer_view.is_none() && a.sparse.is_none());
        if primitive.extensions.contains_key(DRACO) && bare {
            return Err(format!("{DRACO} is not supported: expected a mesh without compression"));
        }
        let read = |index| accessor::read::<3>(self.container, index, "VEC3");
        let positions = read(position).map_err(|what| format!("POSITION: {what}"))?;
        let normals = attribute("NORMAL").and_then(|index| index.map(read).transpose());
        let normals = normals.and_then(|normals| match normals {
            Some(normals) if normals.len() != positions.len() => Err(format!(
                "expected {} normals, one for each position, got {}",
                positions.len(),
                normals.len()
            )),
            normals => Ok(normals),
        });
        let normals = normals.unwrap_or_else(|what| {
            // Of matter only where normals are asked for.
            self.builder.normal_fault(Place::Item(self.faces), "facet", format_args!("NORMAL: {what}"));
            None
        });
        let indices = self.indices(primitive, positions.len())?;
        if mode == 4 && !indices.len().is_multiple_of(3) {
            return Err(format!("expected a multiple of 3 indices, got {}", indices.len()));
        }
        let triangles = triangles(mode, &indices);
        if triangles.is_empty() {
            return Ok(());
        }
        let material = self.material(primitive)?;
        self.append(&positions, normals.as_deref(), transform, triangles, material);
        Ok(())
    }

    fn material(&mut self, primitive: &Primitive) -> Result<u32, String> {
        let Some(index) = primitive.material else { return Ok(self.builder.material("default")) };
        let materials = &self.container.document.materials;
        let of = materials.get(index);
        let of = of.ok_or_else(|| format!("material {index}: expected one of {}", materials.len()))?;
        let material = self.builder.material(&self.material_name(index));
        if of.double_sided {
            self.builder.double_sided(material);
        }
        let surface = &of.pbr_metallic_roughness;
        let [r, g, b, _] = surface.base_color_factor.map(|x| x.clamp(0.0, 1.0));
        let metal = surface.metallic_factor.clamp(0.0, 1.0);
        let finish = Finish {
            diffuse: [r, g, b].map(|x| x * (1.0 - metal)),
            specular: [r, g, b].map(|x| x * metal),
            emission: of.emissive_factor,
        };
        self.builder.finish_of(&self.material_name(index), finish);
        Ok(material)
    }

    /// The indices of a primitive, each below its number of `vertices`.
    fn indices(&self, primitive: &Primitive, vertices: usize) -> Result<Vec<u32>, String> {
        let Some(index) = primitive.indices else { return Ok((0..vertices as u32).collect()) };
        let accessors = &self.container.document.accessors;
        if accessors
            .get(index)
            .is_some_and(|a| a.normalized || !matches!(a.component_type, 5121 | 5123 | 5125))
        {
            return Err(format!("accessors[{index}]: expected whole numbers from 0 up as indices"));
        }
        let indices = accessor::read::<1>(self.container, index, "SCALAR")
            .map_err(|what| format!("indices: {what}"))?;
        match indices.iter().position(|[i]| *i >= vertices as f64) {
            None => Ok(indices.into_iter().map(|[i]| i as u32).collect()),
            Some(at) => {
                let [got] = indices[at];
                Err(format!("index {got} (number {at}) is out of range: expected 0 to {}", vertices - 1))
            }
        }
    }

    fn append(
        &mut self,
        positions: &[[f64; 3]],
        normals: Option<&[[f64; 3]]>,
        transform: DMat4,
        triangles: Vec<[u32; 3]>,
        material: u32,
    ) {
        let (vertex, normal) = (self.builder.vertices() as i64, self.builder.normals() as i64);
        for p in positions {
            let place = Place::Item(self.builder.vertices());
            self.builder.vertex(place, "vertex", transform.transform_point3(DVec3::from(*p)).into());
        }
        let linear = DMat3::from_mat4(transform);
        // Normals turn with the cofactors, which exist for singular transforms too; front stays front.
        let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        for n in normals.into_iter().flatten() {
            let place = Place::Item(self.builder.normals());
            self.builder.normal(place, (cofactors * DVec3::from(*n)).into());
        }
        for mut triangle in triangles {
            if sign < 0.0 {
                // A mirroring transform turns the winding round (glTF 2.0, section 3.7.4).
                triangle.swap(1, 2);
            }
            let corners = triangle.map(|i| Corner {
                vertex: vertex + i64::from(i),
                normal: normals.is_some().then_some(normal + i64::from(i)),
            });
            self.builder.polygon(Place::Item(self.faces), corners, material);
            self.faces += 1;
        }
    }
}

fn triangles(mode: u32, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        4 => indices.as_chunks().0.to_vec(),
        6 => {
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
fn local(node: &Node) -> Option<DMat4> {
    let matrix = match node.matrix {
        Some(columns) => Some(DMat4::from_cols_array(&columns)),
        None => from_parts(
            node.translation.unwrap_or_default(),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ),
    };
    matrix.filter(|matrix| matrix.is_finite())
}

/// `None` where the rotation is none.
fn from_parts(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> Option<DMat4> {
    // Files carry quaternions rounded to f32.
    let rotation = DQuat::from_array(rotation);
    (rotation.length() > 0.0).then(|| {
        DMat4::from_scale_rotation_translation(scale.into(), rotation.normalize(), translation.into())
    })
}
