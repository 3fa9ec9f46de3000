//! The built-in scenes: the aircraft with two finishes of total reflectance 0.4, after figure 1 of the paper.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::aircraft::{CAMERA_EYE, CAMERA_HEIGHT, CAMERA_TARGET, CAMERA_UP, aircraft};
use crate::mesh_file::{Mesh, NO_NORMAL};
use crate::scene_file::{Camera, Material, Model, Projection, Scene, Sky, Sun};

/// The aircraft, all of material "default".
pub fn mesh() -> Mesh {
    let model = aircraft();
    let facets = model.facets.len();
    Mesh {
        vertices: model.vertices,
        facets: model.facets,
        normals: Vec::new(),
        facet_normals: vec![[NO_NORMAL; 3]; facets],
        facet_materials: vec![0; facets],
        material_names: vec!["default".into()],
        ..Mesh::default()
    }
}

/// The two scenes by the names of their image files.
pub fn finishes() -> [(&'static str, Scene); 2] {
    [("aircraft_diffuse", scene(0.3, 0.1)), ("aircraft_mirror", scene(0.1, 0.3))]
}

/// An overcast sky over darker ground, and a sun from the upper left of the view.
fn scene(diffuse: f64, specular: f64) -> Scene {
    let material =
        Material { diffuse: vec![diffuse], specular: vec![specular], emission: vec![0.0], gloss: None };
    Scene {
        tolerance: 1e-2,
        bands: 1,
        max_bounces: None,
        reference_radiance: None,
        mesh: PathBuf::from("the built-in aircraft"),
        two_sided: false,
        smooth: false,
        materials: BTreeMap::from([("default".to_string(), material)]),
        sky: Some(Sky {
            model: Model::Overcast,
            radiance: vec![1.0],
            ground: vec![0.1],
            up: [0.0, 0.0, 1.0],
        }),
        sun: Some(Sun { direction: [0.5, 0.8, 0.9], irradiance: vec![2.0], half_angle_deg: 0.2665 }),
        camera: Camera {
            projection: Projection::Orthographic(CAMERA_HEIGHT),
            eye: CAMERA_EYE,
            target: CAMERA_TARGET,
            up: CAMERA_UP,
            columns: 512,
            rows: 512,
            area_sampling: true,
        },
    }
}
