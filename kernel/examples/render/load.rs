//! All that a scene file names, read and checked.

use std::path::Path;

use crate::failure::{Failure, Outcome, Warnings};
use crate::mesh_file::{self, Mesh};
use crate::pipeline::Job;
use crate::scene_file::{self, Columns, Model, Scene};
use crate::sky_table::{self, Table};
use crate::{materials, outputs};

/// A scene with its mesh and its sky's table.
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
    /// The sky's table, where its model is one.
    pub table: Option<Table>,
    /// What was passed over, not applied, or is seldom meant.
    pub warnings: Warnings,
}

/// Reads the scene file.
pub fn scene(path: &Path) -> Outcome<Scene> {
    scene_file::read(path)
}

/// Reads the files that `scene`, of the file at `path`, names.
pub fn files(path: &Path, scene: Scene) -> Outcome<Loaded> {
    let mut mesh = mesh_file::read(&scene.mesh)?;
    let mut warnings = std::mem::take(&mut mesh.warnings);
    warnings.append(materials::unused(path, &scene, &mesh));
    warnings.append(two_sided(&scene, &mesh));
    let mut table = None;
    if let Some((file, columns)) = table_file(&scene) {
        let mut read = sky_table::read(file, scene.bands, columns)?;
        warnings.append(std::mem::take(&mut read.warnings));
        table = Some(read);
    }
    Ok(Loaded { scene, mesh, table, warnings })
}

/// Finds out whether `targets` can be written and are none of the scene's files.
pub fn check_targets<'a>(
    path: &'a Path,
    scene: &'a Scene,
    targets: impl Iterator<Item = &'a Path>,
) -> Outcome<()> {
    let table = table_file(scene).map(|(file, _)| file);
    outputs::check(targets, [path, &scene.mesh].into_iter().chain(table))
}

fn table_file(scene: &Scene) -> Option<(&Path, Option<Columns>)> {
    match scene.sky.as_ref().map(|sky| &sky.model) {
        Some(Model::Table { file, columns, .. }) => Some((file.as_path(), *columns)),
        _ => None,
    }
}

/// A warning where the mesh file has facets seen from both sides and the scene does not.
fn two_sided(scene: &Scene, mesh: &Mesh) -> Warnings {
    let named = |index: &u32| mesh.material_names[*index as usize].as_str();
    let names: Vec<&str> = mesh.double_sided.iter().map(named).collect();
    if scene.two_sided || names.is_empty() {
        return Warnings::default();
    }
    let what = format!(
        "facets of {} are seen from both sides there (doubleSided); their backs are black here: two_sided = true in \
         [mesh] gives all facets two sides",
        names.join(", ")
    );
    Warnings::of(Failure::at(&scene.mesh, what))
}

impl Loaded {
    /// The job of rendering it.
    pub fn job<'a>(&'a self, path: &'a Path) -> Outcome<Job<'a>> {
        Ok(Job {
            path,
            materials: materials::assign(path, &self.scene, &self.mesh)?,
            table: self.table.as_ref(),
            scene: &self.scene,
            mesh: &self.mesh,
            threads: 0,
            facets: false,
            components: false,
        })
    }
}
