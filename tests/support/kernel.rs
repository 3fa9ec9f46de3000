//! Hands the twin's scenes to the kernel, so that both compute the same one.
//!
//! Apart from the twin's support modules, which use no kernel code: a test takes it with
//! `#[path = "support/kernel.rs"] mod kernel;`.
#![allow(dead_code)]

use crate::support::scene_file::Camera;
use crate::support::scenes::Mesh;
use crate::support::twin;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::chain::{RaySample, Terms};
use blik_kernel::host::{Geometry, GeometryMemory, Host, Lit, Settings};
use blik_kernel::math::Vec3;
use blik_kernel::ray::Ray;
use blik_kernel::scene::{Gloss, MaterialInput, SceneInput};
use blik_kernel::sky::{SkyInput, SkyModel, SkyTable};
use blik_kernel::sun::SunInput;

/// A triangle soup of the twin's facets, every facet with a material of its own where they differ.
pub struct Soup {
    vertices: Vec<[f64; 3]>,
    facets: Vec<[u32; 3]>,
    facet_materials: Vec<u32>,
    materials: Vec<twin::Material>,
    two_sided: bool,
    /// Vertex normals for interpolated mirror directions, three a facet; empty: flat mirrors.
    pub normals: Vec<[f64; 3]>,
}

impl Soup {
    /// The facets of `scene`.
    pub fn new(scene: &twin::Scene) -> Soup {
        let mut materials: Vec<twin::Material> = Vec::new();
        let index = |m: &twin::Material| {
            let same = |other: &twin::Material| {
                (&other.diffuse, &other.specular) == (&m.diffuse, &m.specular)
                    && (&other.emission, other.gloss) == (&m.emission, m.gloss)
            };
            let known = materials.iter().position(same);
            known.unwrap_or_else(|| {
                materials.push(m.clone());
                materials.len() - 1
            }) as u32
        };
        let facet_materials = scene.materials.iter().map(index).collect();
        let count = scene.corners.len() as u32;
        Soup {
            vertices: scene.corners.iter().flatten().map(|c| c.to_array()).collect(),
            facets: (0..count).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
            facet_materials,
            materials,
            two_sided: scene.two_sided,
            normals: Vec::new(),
        }
    }

    /// A mesh whose facets share their vertices.
    pub fn indexed(mesh: &Mesh, materials: &[twin::Material], two_sided: bool) -> Soup {
        Soup {
            vertices: mesh.vertices.clone(),
            facets: mesh.facets.clone(),
            facet_materials: mesh.materials.clone(),
            materials: materials.to_vec(),
            two_sided,
            normals: Vec::new(),
        }
    }

    /// Calls `with` with the scene as the kernel takes it.
    pub fn with_input<R>(&self, with: impl FnOnce(&SceneInput<'_>) -> R) -> R {
        let input = |m: &'_ twin::Material| m.gloss.map(|axis_ratio| Gloss { axis_ratio, rays: None });
        let materials: Vec<MaterialInput<'_>> = self
            .materials
            .iter()
            .map(|m| MaterialInput {
                diffuse: &m.diffuse,
                specular: &m.specular,
                emission: &m.emission,
                gloss: input(m),
            })
            .collect();
        with(&SceneInput {
            vertices: &self.vertices,
            facets: &self.facets,
            facet_materials: &self.facet_materials,
            normals: &self.normals,
            facet_normals: &[],
            materials: &materials,
            two_sided: self.two_sided,
            bands: self.materials[0].diffuse.len(),
        })
    }
}

/// Settings of a tolerance, all else by default.
pub fn within(tolerance: f64) -> Settings {
    Settings { tolerance, ..Settings::default() }
}

/// Calls `with` with the geometry of the twin's scene.
pub fn geometry<R>(
    scene: &twin::Scene,
    settings: &Settings,
    with: impl FnOnce(&Host, &Geometry<'_>) -> R,
) -> R {
    soup_geometry(&Soup::new(scene), settings, with)
}

fn soup_geometry<R>(soup: &Soup, settings: &Settings, with: impl FnOnce(&Host, &Geometry<'_>) -> R) -> R {
    let host = Host::new(0).unwrap();
    let mut memory = GeometryMemory::default();
    soup.with_input(|input| with(&host, &host.geometry(&mut memory, input, settings).unwrap()))
}

/// Calls `with` with the twin's scene, solved in the twin's light.
pub fn solve<R>(scene: &twin::Scene, settings: &Settings, with: impl FnOnce(&Host, &Lit<'_>) -> R) -> R {
    solve_soup(&Soup::new(scene), scene, settings, with)
}

/// Calls `with` with `soup`, solved in the light of `light`.
pub fn solve_soup<R>(
    soup: &Soup,
    light: &twin::Scene,
    settings: &Settings,
    with: impl FnOnce(&Host, &Lit<'_>) -> R,
) -> R {
    let table = light.sky.as_ref().map_or(Vec::new(), table);
    let sky = light.sky.as_ref().map(|sky| sky_input(sky, &table));
    let sun = light.sun.as_ref().map(sun_input);
    soup_geometry(soup, settings, |host, geometry| {
        with(host, &host.light(geometry, sky.as_ref(), sun.as_ref()).unwrap())
    })
}

/// The values of a sky table.
pub fn table(sky: &twin::Sky) -> Vec<f32> {
    match &sky.model {
        twin::Model::Table { values, .. } => values.iter().map(|&v| v as f32).collect(),
        _ => Vec::new(),
    }
}

/// The sky as the kernel takes it; `table` from [`table`].
pub fn sky_input<'a>(sky: &'a twin::Sky, table: &'a [f32]) -> SkyInput<'a> {
    let model = match &sky.model {
        twin::Model::Uniform => SkyModel::Uniform,
        twin::Model::Hemisphere => SkyModel::Hemisphere,
        twin::Model::Overcast => SkyModel::Overcast,
        twin::Model::Gradient => SkyModel::Gradient,
        twin::Model::Cie { kind, sun } => SkyModel::Cie { kind: *kind as u32, sun_direction: sun.to_array() },
        twin::Model::Table { rows, columns, azimuth_zero, .. } => SkyModel::Table(SkyTable {
            rows: *rows,
            columns: *columns,
            bands: sky.radiance.len(),
            radiance: table,
            azimuth_zero: Some(azimuth_zero.to_array()),
        }),
    };
    SkyInput { model, radiance: &sky.radiance, ground: &sky.ground, up: sky.up.to_array() }
}

/// The sun as the kernel takes it.
pub fn sun_input(sun: &twin::Sun) -> SunInput<'_> {
    SunInput {
        direction: sun.direction.to_array(),
        irradiance: &sun.irradiance,
        half_angle_deg: sun.half_angle.to_degrees(),
    }
}

/// The camera of a scene file: one ray through each pixel's centre.
pub fn camera(camera: &Camera) -> CameraInput {
    let [forward, _, up] = camera.axes;
    let [columns, rows] = camera.resolution;
    CameraInput {
        projection: if camera.perspective {
            Projection::Perspective { fov_deg: 2.0 * (camera.height / 2.0).atan().to_degrees() }
        } else {
            Projection::Orthographic { height: camera.height }
        },
        eye: camera.eye.to_array(),
        target: (camera.eye + forward).to_array(),
        up: up.to_array(),
        columns,
        rows,
        sampling: Sampling::Centre,
    }
}

/// Irradiance of every facet's side, (facet, side, band).
pub fn irradiances(lit: &Lit<'_>) -> Vec<f64> {
    let mut all = Vec::new();
    lit.facets(|_, _, _, irradiance, _| all.extend_from_slice(irradiance));
    all
}

/// Area means of the irradiance of some one-sided facets, one per band.
pub fn mean_irradiance(lit: &Lit<'_>, facets: &[usize]) -> Vec<f64> {
    let (mut sums, mut total) = (vec![0.0; lit.reference().len()], 0.0);
    lit.facets(|facet, _, area, irradiance, _| {
        if facets.contains(&facet) {
            sums.iter_mut().zip(irradiance).for_each(|(s, e)| *s += area * e);
            total += area;
        }
    });
    sums.into_iter().map(|s| s / total).collect()
}

/// Radiance that arrives at `origin` from `direction` (any length), in one band.
pub fn radiance(lit: &Lit<'_>, origin: [f64; 3], direction: [f64; 3], band: usize) -> f64 {
    let solved = lit.solved();
    let (origin, direction) = (Vec3::from_array(origin), Vec3::from_array(direction));
    let ray = Ray::new(solved.scene.to_scene(origin), direction.normalize());
    let mut terms = Terms::ZERO;
    solved.radiance(&ray, RaySample::Integrate(1), &mut terms);
    terms.sum(band)
}
