//! Which material table belongs to which facets.

use std::path::Path;

use crate::failure::{Failure, Outcome};
use crate::mesh_file::Mesh;
use crate::scene_file::{Material, Scene};

/// The table of each of the mesh's material names, in their order: the one of that name, else "default".
pub fn assign<'a>(path: &Path, scene: &'a Scene, mesh: &Mesh) -> Outcome<Vec<&'a Material>> {
    let table = |name: &String| {
        scene.materials.get(name).or(scene.materials.get("default")).ok_or_else(|| {
            let what = format!(
                "material {name:?} of {} is unknown: expected a table [material.{name}] or [material.default]",
                scene.mesh.display()
            );
            Failure::at(path, what)
        })
    };
    let assigned = mesh.material_names.iter().map(table).collect::<Outcome<_>>()?;
    let unused = |name: &str| name != "default" && !mesh.material_names.iter().any(|used| used == name);
    match scene.materials.keys().find(|name| unused(name)) {
        None => Ok(assigned),
        Some(name) => {
            let used = mesh.material_names.join(", ");
            let what = format!("material.{name}: no facet uses it: expected one of {used}, or default");
            Err(Failure::at(path, what))
        }
    }
}
