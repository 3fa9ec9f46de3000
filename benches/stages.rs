//! Time of each stage, and of a new light or a new view on what is there already, on scenes of two sizes.
//!
//! `cargo bench --bench stages`; the stages' own times are those that the report states.

#[path = "../tests/support/scenes/mod.rs"]
#[allow(dead_code, unused_imports)]
mod scenes;

use blik_kernel::arena::Memory;
use blik_kernel::bvh::Bvh;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::host::{Geometry, GeometryMemory, Host, Lit, Settings};
use blik_kernel::scene::{MaterialInput, Scene, SceneInput};
use blik_kernel::simd::Isa;
use blik_kernel::sky::{SkyInput, SkyModel};
use blik_kernel::sun::SunInput;
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;

const FINISH: MaterialInput =
    MaterialInput { diffuse: &[0.3], specular: &[0.1], emission: &[0.0], gloss: None };
const SUN: SunInput = SunInput { direction: [0.3, 0.2, 1.0], irradiance: &[2.0], half_angle_deg: 0.2665 };

/// A corner of three unit squares: every facet sees two thirds of the others, straight and in mirrors.
fn meshes() -> [scenes::Mesh; 2] {
    [8, 16].map(scenes::corner).map(|mesh| mesh.of_material(0))
}

fn input<'a>(mesh: &'a scenes::Mesh, materials: &'a [MaterialInput<'a>]) -> SceneInput<'a> {
    SceneInput {
        vertices: &mesh.vertices,
        facets: &mesh.facets,
        facet_materials: &mesh.materials,
        normals: &[],
        facet_normals: &[],
        materials,
        two_sided: false,
        bands: 1,
    }
}

fn sky(model: SkyModel<'static>) -> SkyInput<'static> {
    SkyInput { model, radiance: &[1.0], ground: &[0.1], up: [0.0, 0.0, 1.0] }
}

fn camera(eye: [f64; 3]) -> CameraInput {
    CameraInput {
        projection: Projection::Orthographic { height: 1.7 },
        eye,
        target: [0.4; 3],
        up: [0.0, 0.0, 1.0],
        columns: 256,
        rows: 256,
        sampling: Sampling::Area,
    }
}

/// The group of a stage; every run of it takes about the same time.
fn group<'c>(c: &'c mut Criterion, stage: &str) -> BenchmarkGroup<'c, WallTime> {
    let mut group = c.benchmark_group(stage);
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group
}

/// Adds up the seconds that `run` reports, over so many runs.
fn reported(runs: u64, mut run: impl FnMut() -> f64) -> Duration {
    Duration::from_secs_f64((0..runs).map(|_| run()).sum())
}

/// What needs the mesh alone.
fn geometry(c: &mut Criterion) {
    let host = Host::new(0).expect("threads");
    let settings = Settings::default();
    for mesh in meshes() {
        let (facets, materials) = (mesh.facets.len(), [FINISH]);
        let input = input(&mesh, &materials);
        let mut memory = Memory::new(Scene::bytes(&input).expect("a sound scene"));
        group(c, "scene").bench_function(BenchmarkId::from_parameter(facets), |b| {
            b.iter(|| black_box(Scene::new(&input, memory.bytes_mut())).map(|scene| scene.facets()));
        });
        let scene = Scene::new(&input, memory.bytes_mut()).expect("a sound scene");
        let mut tree = Memory::new(Bvh::bytes(facets).expect("few facets"));
        let mut build = |name, build: Builder| {
            group(c, name).bench_function(BenchmarkId::from_parameter(facets), |b| {
                b.iter(|| build(&scene, tree.bytes_mut()));
            });
        };
        build("bvh_obvhs", |scene, memory| {
            black_box(Bvh::build_obvhs(scene.corners(), scene.areas(), Isa::detect(), memory))
                .expect("a tree");
        });
        build("bvh_compact", |scene, memory| {
            black_box(Bvh::build(scene.corners(), scene.areas(), Isa::detect(), memory)).expect("a tree");
        });
        group(c, "coupling").bench_function(BenchmarkId::from_parameter(facets), |b| {
            b.iter_custom(|runs| {
                reported(runs, || {
                    let mut memory = GeometryMemory::default();
                    let geometry = host.geometry(&mut memory, &input, &settings);
                    geometry.expect("a sound scene").report().seconds.coupling
                })
            });
        });
    }
}

/// Builds a tree in the memory given.
type Builder = fn(&Scene<'_>, &mut [u8]);

/// What a light and a view need.
fn light_and_view(c: &mut Criterion) {
    let host = Host::new(0).expect("threads");
    for mesh in meshes() {
        let (facets, materials) = (mesh.facets.len(), [FINISH]);
        let mut memory = GeometryMemory::default();
        let geometry = host.geometry(&mut memory, &input(&mesh, &materials), &Settings::default());
        let geometry = geometry.expect("a sound scene");
        let lit = light(&host, &geometry, SkyModel::Overcast);
        let id = BenchmarkId::from_parameter(facets);
        group(c, "light").bench_function(id.clone(), |b| {
            b.iter_custom(|runs| {
                reported(runs, || light(&host, &geometry, SkyModel::Overcast).report().seconds.light)
            });
        });
        group(c, "radiosity").bench_function(id.clone(), |b| {
            b.iter_custom(|runs| {
                reported(runs, || light(&host, &geometry, SkyModel::Overcast).report().seconds.radiosity)
            });
        });
        group(c, "image").bench_function(id.clone(), |b| {
            b.iter_custom(|runs| reported(runs, || image(&host, &lit, [2.0, 2.1, 2.2])));
        });
        group(c, "relight").bench_function(id.clone(), |b| {
            b.iter(|| image(&host, &light(&host, &geometry, SkyModel::Gradient), [2.0, 2.1, 2.2]));
        });
        group(c, "new_view").bench_function(id, |b| {
            b.iter(|| image(&host, &lit, [3.0, 1.5, 1.2]));
        });
    }
}

fn light<'g>(host: &Host, geometry: &'g Geometry<'g>, model: SkyModel<'static>) -> Lit<'g> {
    host.light(geometry, Some(&sky(model)), Some(&SUN)).expect("a sound light")
}

/// Makes an image; the seconds that it reports.
fn image(host: &Host, lit: &Lit<'_>, eye: [f64; 3]) -> f64 {
    host.image(lit, &camera(eye), false).expect("a sound camera").report.seconds.image
}

criterion_group!(stages, geometry, light_and_view);
criterion_main!(stages);
