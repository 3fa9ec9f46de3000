//! Which material table belongs to which facets.

use std::path::Path;

use crate::failure::{Failure, Outcome, Warnings};
use crate::mesh_file::Mesh;
use crate::scene_file::{Material, Scene, table};

/// The table of each of the mesh's material names, in their order: the one of that name, else "default".
pub fn assign<'a>(path: &Path, scene: &'a Scene, mesh: &Mesh) -> Outcome<Vec<&'a Material>> {
    let of = |name: &String| scene.materials.get(name).or(scene.materials.get("default"));
    let missing: Vec<String> = mesh
        .material_names
        .iter()
        .filter(|name| of(name).is_none())
        .map(|name| format!("[{}]", table(name)))
        .collect();
    if !missing.is_empty() {
        let (count, tables) = (missing.len(), missing.join(", "));
        let what = format!(
            "{count} of the materials of {} have no table: expected {tables}, or [material.default] for all of them",
            scene.mesh.display()
        );
        return Err(Failure::at(path, what));
    }
    Ok(mesh.material_names.iter().filter_map(of).collect())
}

/// A warning of tables that no facet uses: a name may be misspelt, or the tables serve several meshes.
pub fn unused(path: &Path, scene: &Scene, mesh: &Mesh) -> Warnings {
    let unused = |name: &&String| *name != "default" && !mesh.material_names.contains(name);
    let unused: Vec<String> =
        scene.materials.keys().filter(unused).map(|name| format!("[{}]", table(name))).collect();
    if unused.is_empty() {
        return Warnings::default();
    }
    let used = mesh.material_names.join(", ");
    Warnings::of(Failure::at(
        path,
        format_args!("{}: no facet uses it; the mesh has {used}", unused.join(", ")),
    ))
}
