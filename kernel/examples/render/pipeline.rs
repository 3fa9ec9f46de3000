//! The one place that calls the kernel: a checked scene and a mesh go in, an image and a report come out.

use std::path::Path;

use blik_kernel::Error;
use blik_kernel::arena::Memory;
use blik_kernel::bvh::Bvh;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::host::{GeometryMemory, Host, Lit, Rounds, Settings};
use blik_kernel::scene::{Gloss, MaterialInput, Scene as KernelScene, SceneInput};
use blik_kernel::simd::Isa;
use blik_kernel::sky::{Sky as KernelSky, SkyInput, SkyModel, SkyTable};
use blik_kernel::sun::{Sun as KernelSun, SunInput};

use crate::facets_file::Row;
use crate::failure::{Failure, Outcome};
use crate::mesh_file::Mesh;
use crate::progress::Progress;
use crate::report_file::Report;
use crate::scene_file::{self, Camera, Material, Model, Scene, Sky, Sun};
use crate::sky_table::Table;
use crate::view::View;

/// All that an image is made of.
pub struct Job<'a> {
    /// The scene file, for messages.
    pub path: &'a Path,
    /// The scene.
    pub scene: &'a Scene,
    /// Its mesh.
    pub mesh: &'a Mesh,
    /// The material table of each of the mesh's material names.
    pub materials: Vec<&'a Material>,
    /// The sky's table, where its model is one.
    pub table: Option<&'a Table>,
    /// 0: all cores.
    pub threads: usize,
    /// Whether the facets' irradiances are wanted.
    pub facets: bool,
    /// Whether the three terms of eq. 11 are wanted.
    pub components: bool,
}

/// A rendered scene.
pub struct Rendered {
    /// Pixels in a row.
    pub columns: usize,
    /// Rows, from the top.
    pub rows: usize,
    /// Radiance (row, column, band).
    pub pixels: Vec<f32>,
    /// The terms of eq. 11: diffuse, mirrored sky, mirrored diffuse; each like `pixels`.
    pub components: Option<[Vec<f32>; 3]>,
    /// Irradiances, where they were wanted.
    pub facets: Vec<Row>,
    /// What was done. Seconds of reading, writing and in total are still 0.
    pub report: Report,
}

/// Computes the image.
pub fn run(job: &Job, progress: &Progress) -> Outcome<Rendered> {
    check_normals(job)?;
    compute(job, progress).map_err(|error| describe(job, error))
}

/// Finds out whether the kernel takes the scene, and what the camera sees of it.
pub fn check(job: &Job) -> Outcome<View> {
    check_normals(job)?;
    let look = || -> Result<View, Error> {
        let materials: Vec<MaterialInput> =
            job.materials.iter().map(|material| material_input(material)).collect();
        let input = scene_input(job, &materials);
        let mut memory = Memory::new(KernelScene::bytes(&input)?);
        let scene = KernelScene::new(&input, memory.bytes_mut())?;
        if let Some(sky) = &job.scene.sky {
            KernelSky::new(&sky_input(sky, job.table), scene.bands())?;
        }
        if let Some(sun) = &job.scene.sun {
            KernelSun::new(&sun_input(sun), scene.bands())?;
        }
        let mut memory = Memory::new(Bvh::bytes(scene.facets())?);
        let bvh = Bvh::build(scene.corners(), scene.areas(), Isa::detect(), memory.bytes_mut())?;
        View::new(&scene, &bvh, &camera_input(&job.scene.camera))
    };
    look().map_err(|error| describe(job, error))
}

/// What `smooth` asks of the mesh file.
fn check_normals(job: &Job) -> Outcome<()> {
    if job.scene.smooth && !job.mesh.has_normals() && job.mesh.normal_fault.is_none() {
        let what = "smooth = true: expected a mesh file with vertex normals, this one has none";
        return Err(Failure::at(&job.scene.mesh, what));
    }
    if let Some(fault) = job.mesh.normal_fault.as_ref().filter(|_| job.scene.smooth) {
        return Err(Failure::new(format_args!("{fault} (smooth = true asks for normals)")));
    }
    Ok(())
}

fn compute(job: &Job, progress: &Progress) -> Result<Rendered, Error> {
    let scene = job.scene;
    let host = Host::new(job.threads)?;
    let materials: Vec<MaterialInput> =
        job.materials.iter().map(|material| material_input(material)).collect();
    let sky = scene.sky.as_ref().map(|sky| sky_input(sky, job.table));
    let sun = scene.sun.as_ref().map(sun_input);
    let mut rounds = Rounds::new(scene.tolerance);
    let mut memory = GeometryMemory::default();
    loop {
        let settings = rounds.settings(Settings {
            max_bounces: scene.max_bounces,
            reference_radiance: scene.reference_radiance.clone(),
            all_irradiances: job.facets,
            // A uniform sky is told by closure, without the directions in which it is seen.
            directional: scene.sky.as_ref().is_some_and(|sky| !matches!(sky.model, Model::Uniform)),
            ..Settings::default()
        });
        progress.stage("coupling");
        let geometry = host.geometry(&mut memory, &scene_input(job, &materials), &settings)?;
        progress.stage("light");
        let lit = host.light(&geometry, sky.as_ref(), sun.as_ref())?;
        progress.stage("image");
        let camera = camera_input(&scene.camera);
        if let Some(look) = host.look(&lit, &camera)?
            && rounds.at_once(&look)
        {
            continue;
        }
        let mut image = host.image(&lit, &camera, job.components)?;
        if rounds.again(&mut image.report) {
            continue;
        }
        return Ok(Rendered {
            columns: image.columns,
            rows: image.rows,
            pixels: image.pixels,
            components: image.components,
            facets: if job.facets { facet_rows(&lit) } else { Vec::new() },
            report: Report::new(image.report, View::new(geometry.scene(), geometry.bvh(), &camera)?),
        });
    }
}

fn facet_rows(lit: &Lit) -> Vec<Row> {
    let mut rows = Vec::new();
    lit.facets(|index, side, area, irradiance, diffuse_radiance| {
        let (irradiance, diffuse_radiance) = (irradiance.to_vec(), diffuse_radiance.to_vec());
        rows.push(Row { index, side, area, irradiance, diffuse_radiance });
    });
    rows
}

fn scene_input<'a>(job: &'a Job, materials: &'a [MaterialInput<'a>]) -> SceneInput<'a> {
    let (scene, mesh) = (job.scene, job.mesh);
    SceneInput {
        vertices: &mesh.vertices,
        facets: &mesh.facets,
        facet_materials: &mesh.facet_materials,
        normals: if scene.smooth { &mesh.normals } else { &[] },
        facet_normals: if scene.smooth { &mesh.facet_normals } else { &[] },
        materials,
        two_sided: scene.two_sided,
        bands: scene.bands,
    }
}

fn material_input(material: &Material) -> MaterialInput<'_> {
    MaterialInput {
        diffuse: &material.diffuse,
        specular: &material.specular,
        emission: &material.emission,
        gloss: material.gloss.map(|(axis_ratio, rays)| Gloss { axis_ratio, rays }),
    }
}

fn sky_input<'a>(sky: &'a Sky, table: Option<&'a Table>) -> SkyInput<'a> {
    let model = match (&sky.model, table) {
        (Model::Hemisphere, _) => SkyModel::Hemisphere,
        (Model::Overcast, _) => SkyModel::Overcast,
        (Model::Cie { kind, sun_direction }, _) => {
            SkyModel::Cie { kind: *kind, sun_direction: *sun_direction }
        }
        (Model::Gradient, _) => SkyModel::Gradient,
        (Model::Table { azimuth_zero, .. }, Some(table)) => SkyModel::Table(SkyTable {
            rows: table.rows,
            columns: table.columns,
            bands: table.bands,
            radiance: &table.radiance,
            azimuth_zero: *azimuth_zero,
        }),
        (Model::Uniform | Model::Table { .. }, _) => SkyModel::Uniform,
    };
    SkyInput { model, radiance: &sky.radiance, ground: &sky.ground, up: sky.up }
}

fn sun_input(sun: &Sun) -> SunInput<'_> {
    SunInput { direction: sun.direction, irradiance: &sun.irradiance, half_angle_deg: sun.half_angle_deg }
}

fn camera_input(camera: &Camera) -> CameraInput {
    CameraInput {
        projection: match camera.projection {
            scene_file::Projection::Orthographic(height) => Projection::Orthographic { height },
            scene_file::Projection::Perspective(fov_deg) => Projection::Perspective { fov_deg },
        },
        eye: camera.eye,
        target: camera.target,
        up: camera.up,
        columns: camera.columns,
        rows: camera.rows,
        sampling: if camera.area_sampling { Sampling::Area } else { Sampling::Centre },
    }
}

/// The kernel's refusal with the files' own names instead of indices.
fn describe(job: &Job, error: Error) -> Failure {
    let of_mesh = |what: &dyn std::fmt::Display| Failure::at(&job.scene.mesh, what);
    let named = |material: usize| {
        let name = job.mesh.material_names.get(material).map_or("default", String::as_str);
        Failure::at(job.path, format_args!("material {name:?}: {error}"))
    };
    match error {
        Error::NormalNotFinite { normal } => {
            of_mesh(&format_args!("vertex normal {normal} (counted from 0) is zero: expected a direction"))
        }
        Error::NoFacets
        | Error::VertexNotFinite { .. }
        | Error::Extent
        | Error::IndexOutOfRange { .. }
        | Error::NormalIndexOutOfRange { .. } => of_mesh(&error),
        Error::BandCount { material, .. }
        | Error::MaterialRange { material, .. }
        | Error::ReflectanceSum { material, .. } => named(material),
        _ => Failure::at(job.path, error),
    }
}
