//! Mesh files: OBJ, PLY, STL and glTF, chosen by the name's ending.

mod builder;
mod gltf;
mod mtl;
mod obj;
mod ply;
mod polygon;
mod stl;

use std::collections::BTreeMap;
use std::path::Path;

use crate::failure::{Failure, Outcome, Warnings};

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
    /// Materials that the file declares to be seen from both sides.
    pub double_sided: Vec<u32>,
    /// Files of material properties that the file names.
    pub libraries: Vec<String>,
    /// How the file says that its materials look, by name: values to start from.
    pub finishes: BTreeMap<String, Finish>,
    /// Why the vertex normals cannot be used, where they cannot.
    pub normal_fault: Option<Failure>,
    /// What was passed over or not applied.
    pub warnings: Warnings,
}

/// Reflectances and emission of a material in red, green and blue, as drawing programs mean them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finish {
    /// Diffuse reflectance.
    pub diffuse: [f64; 3],
    /// Mirror reflectance.
    pub specular: [f64; 3],
    /// Own radiance.
    pub emission: [f64; 3],
}

impl Mesh {
    /// The lowest and the highest coordinates of all facets.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let mut bounds = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for vertex in self.facets.iter().flatten().map(|i| self.vertices[*i as usize]) {
            for (axis, x) in vertex.into_iter().enumerate() {
                bounds.0[axis] = bounds.0[axis].min(x);
                bounds.1[axis] = bounds.1[axis].max(x);
            }
        }
        bounds
    }

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

/// How the libraries that the mesh file at `path` names say that its materials look, and what they say more.
pub fn libraries(path: &Path, mesh: &Mesh) -> (BTreeMap<String, Finish>, Warnings) {
    let mut warnings = Warnings::default();
    let mut finishes = mesh.finishes.clone();
    for names in &mesh.libraries {
        mtl::read(path, names, &mut finishes, &mut warnings);
    }
    (finishes, warnings)
}
