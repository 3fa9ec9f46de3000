//! Mesh files: OBJ, PLY, STL and glTF, chosen by the name's ending.

mod builder;
mod gltf;
mod obj;
mod ply;
mod polygon;
mod stl;

use std::path::Path;

use crate::failure::{Failure, Outcome};

/// "No vertex normal" in [`Mesh::facet_normals`].
pub const NO_NORMAL: u32 = u32::MAX;

/// Triangles in the file's order.
#[derive(Default)]
pub struct Mesh {
    /// Finite coordinates, in the file's unit and axes.
    pub vertices: Vec<[f64; 3]>,
    /// Vertex indices, counter-clockwise seen from the front; all in range; at least one facet.
    pub facets: Vec<[u32; 3]>,
    /// Finite vectors of any length.
    pub normals: Vec<[f64; 3]>,
    /// Per corner an index into `normals` or [`NO_NORMAL`]; as long as `facets`.
    pub facet_normals: Vec<[u32; 3]>,
    /// Per facet an index into `material_names`.
    pub facet_materials: Vec<u32>,
    /// Names in the order of first use; "default" where the file names none.
    pub material_names: Vec<String>,
}

impl Mesh {
    /// Whether any corner has a vertex normal.
    pub fn has_normals(&self) -> bool {
        self.facet_normals.iter().flatten().any(|index| *index != NO_NORMAL)
    }
}

/// Reads the mesh file at `path`. Coordinates keep the precision they have in the file.
pub fn read(path: &Path) -> Outcome<Mesh> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let reader = match ending.as_str() {
        "obj" => obj::read,
        "ply" => ply::read,
        "stl" => stl::read,
        "gltf" | "glb" => gltf::read,
        _ => {
            let what = "unknown kind of mesh file: expected .obj, .ply, .stl, .gltf or .glb";
            return Err(Failure::at(path, what));
        }
    };
    let bytes = std::fs::read(path).map_err(|e| Failure::at(path, e))?;
    reader(path, &bytes)
}
