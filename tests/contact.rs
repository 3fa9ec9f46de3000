//! Where light changes within lengths far smaller than facets: small bodies on large ones, contact lines. Truths are the
//! judge's paths.

#[path = "support/case.rs"]
mod case;
#[path = "support/judge/mod.rs"]
mod judge;
mod support;

use blik_kernel::arena::Memory;
use blik_kernel::camera::CameraInput;
use blik_kernel::host::{Geometry, GeometryMemory, Host, Image, Rounds, Settings};
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, orthographic};
use glam::{DVec3, dvec3};
use judge::{Judge, Score, score};
use support::scenes::Mesh;
use support::twin::{Material, Model, Scene, Sky, Sun};

/// The judge's scene.
fn scene(case: &Case) -> Scene {
    let mut scene = Scene::new(&case.mesh, &case.materials).two_sided(case.two_sided);
    if let Some(sky) = &case.sky {
        let model = match sky.model {
            SkyModel::Hemisphere => Model::Hemisphere,
            SkyModel::Overcast => Model::Overcast,
            _ => Model::Uniform,
        };
        let radiance = sky.radiance.clone();
        scene = scene.sky(Sky { radiance, ground: sky.ground.clone(), ..Sky::new(model, 1.0, 0.0) });
    }
    if let Some(sun) = &case.sun {
        scene = scene.sun(Sun::new(
            DVec3::from(sun.direction),
            sun.irradiance[0],
            sun.half_angle_deg.to_radians(),
        ));
    }
    scene
}

/// The image that the program would write: rounds until it is as good as asked.
fn image(case: &Case, settings: &Settings, camera: &CameraInput) -> Image {
    let host = Host::new(0).unwrap();
    let (sky, sun) = (case.sky.as_ref().map(SkyOf::input), case.sun.as_ref().map(|s| s.input()));
    let mut rounds = Rounds::new(settings.tolerance);
    loop {
        let mut memory = GeometryMemory::default();
        let image = case.with_input(|input| {
            let geometry: Geometry<'_> =
                host.geometry(&mut memory, input, &rounds.settings(settings.clone())).unwrap();
            let lit = host.light(&geometry, sky.as_ref(), sun.as_ref()).unwrap();
            let mut image = host.image(&lit, camera, false).unwrap();
            (!rounds.again(&mut image.report)).then_some(image)
        });
        if let Some(image) = image {
            return image;
        }
    }
}

/// True error of an image, from a reference with a tenth of the tolerance as its own; and the largest of its pixels.
fn error(case: &Case, camera: &CameraInput, image: &Image, tolerance: f64) -> Score {
    let scene = scene(case);
    let mut memory = Memory::default();
    let judge = Judge::new(&scene, &mut memory);
    let halves = judge.image(camera, 0.1 * tolerance, 20_000_000, 5);
    let pixels: Vec<f64> = image.pixels.iter().map(|&p| f64::from(p)).collect();
    score(&pixels, [&halves.values[0], &halves.values[1]], &halves.hit, &judge.reference())
}

/// An open box of facets that face outward: four walls and a lid.
fn box_on_floor(mesh: &mut Mesh, low: DVec3, size: DVec3, material: u32) {
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    mesh.rectangle(low, x, z, 1, material);
    mesh.rectangle(low + x, y, z, 1, material);
    mesh.rectangle(low + x + y, -x, z, 1, material);
    mesh.rectangle(low + y, -y, z, 1, material);
    mesh.rectangle(low + z, x, y, 1, material);
}

/// A floor that is far larger than the body on or over it.
fn floor(half: f64) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-half, -half, 0.0), DVec3::X * 2.0 * half, DVec3::Y * 2.0 * half, 1, 0);
    mesh
}

/// Light between a small body and the large facet that it stands on changes within the body's size.
#[test]
fn small_bodies_on_large_facets() {
    let tolerance = 4e-3;
    // half of the floor's side; the body's size and height over the floor
    let cases = [(5.0, dvec3(0.2, 0.2, 0.12), 0.0), (100.0, dvec3(4.0, 1.8, 1.5), 0.3)];
    for (half, size, height) in cases {
        let mut mesh = floor(half);
        box_on_floor(&mut mesh, dvec3(-0.5 * size.x, -0.4 * size.y, height), size, 1);
        let case = Case::new(mesh, &[Material::new(0.5, 0.0), Material::new(0.5, 0.0)]).sky(SkyOf::new(
            SkyModel::Overcast,
            &[1.0],
            &[0.0],
        ));
        let eye = dvec3(1.0, -2.0, 1.2) * size.length();
        let camera = orthographic(eye.into(), [0.0, 0.0, 0.4 * size.z], 1.2 * size.length(), 32);
        let image = image(&case, &Settings { tolerance, ..Settings::default() }, &camera);
        let truth = error(&case, &camera, &image, tolerance);
        println!("floor of {half}: {truth:?}, estimate {:.1e}", image.report.error_estimate);
        // the reference's error is in low
        assert!(truth.low < tolerance && truth.low < image.report.error_estimate, "{truth:?}");
    }
}
