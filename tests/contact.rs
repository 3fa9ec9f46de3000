//! Where light changes within lengths far smaller than facets: small bodies on large ones, contact lines. Truths are the
//! judge's paths.

#[path = "support/case.rs"]
mod case;
#[path = "support/judge/mod.rs"]
mod judge;
mod support;

use blik_kernel::arena::Memory;
use blik_kernel::camera::{CameraInput, Projection};
use blik_kernel::host::{Geometry, GeometryMemory, Host, Image, Rounds, Settings};
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic};
use glam::{DVec3, dvec3};
use judge::{Judge, Score, score};
use support::scenes::Mesh;
use support::twin::{Material, Model, Rng, Scene, Sky, Sun};

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

/// Where reflections are counted, walls that are partly inside of a body are exact beside it, too: light of one reflection
/// arrives at a wall that a step pierces from the sky alone, half of which is above the horizon.
#[test]
fn counted_reflections_beside_contacts() {
    let (tolerance, rho) = (4e-3, 0.8);
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(0.0, 0.0, 0.2), DVec3::X, DVec3::Y * 0.25, 1, 0);
    mesh.rectangle(dvec3(0.0, -1.0, 0.0), DVec3::Y * 3.0, DVec3::Z * 2.6, 1, 0);
    mesh.rectangle(DVec3::ZERO, DVec3::X, DVec3::Z * 0.2, 1, 0);
    let case =
        Case::new(mesh, &[Material::new(rho, 0.0)]).sky(SkyOf::new(SkyModel::Hemisphere, &[1.0], &[0.0]));
    let camera = orthographic([5.0, -5.0, 5.0], [0.1, 0.1, 0.2], 0.5, 32);
    let settings = Settings { tolerance, max_bounces: Some(1), ..Settings::default() };
    let image = image(&case, &settings, &camera);
    let (mut worst, mut count) = (0.0f64, 0);
    for (at, pixel) in image.pixels.iter().enumerate() {
        let ray = judge::ray(&camera, (at % 32) as f64 + 0.5, (at / 32) as f64 + 0.5);
        // where it meets the plane of the wall, beside and above the step
        let place = ray.origin - ray.direction * (ray.origin.x / ray.direction.x);
        if place.z > 0.2 + 1e-3 && place.z < 2.6 && place.y < 1.9 {
            worst = worst.max((f64::from(*pixel) - 0.5 * rho).abs());
            count += 1;
        }
    }
    println!(
        "{count} pixels of the wall, the worst wrong by {worst:.1e}, estimate {:.1e}",
        image.report.error_estimate
    );
    // rays go on until half of the tolerance is expected: single pixels are a few times as wrong
    assert!(count > 100 && worst < 4.0 * tolerance, "{worst}");
}

/// A generated room, staircase, row of fins or corner, its light and a view of it.
fn generated(index: u64) -> (String, Case, CameraInput) {
    let mut rng = Rng(1000 + index);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.unit();
    let kind = ["room", "stairs", "fins", "corner"][index as usize % 4];
    let mut mesh = Mesh::default();
    let (target, size) = match kind {
        "room" => {
            let (a, b, c) = (between(0.8, 1.6), between(0.8, 1.6), between(0.5, 1.2));
            let (x, y, z) = (DVec3::X * a, DVec3::Y * b, DVec3::Z * c);
            mesh.rectangle(DVec3::ZERO, x, y, 1, 0);
            mesh.rectangle(DVec3::ZERO, y, z, 1, 1);
            mesh.rectangle(DVec3::ZERO, z, x, 1, 1);
            mesh.rectangle(x + y, z, -x, 1, 1);
            mesh.rectangle(x + y, -y, z, 1, 1);
            // on the floor, for every other room
            if index.is_multiple_of(8) {
                box_on_floor(
                    &mut mesh,
                    dvec3(between(0.2, 0.4), between(0.2, 0.4), 0.0),
                    DVec3::splat(0.2),
                    0,
                );
            }
            (dvec3(0.3 * a, 0.3 * b, 0.2 * c), a.max(b))
        }
        "stairs" => {
            let (steps, rise, run) = (3 + index % 3, between(0.12, 0.25), between(0.2, 0.35));
            for step in 0..steps {
                let low = dvec3(0.0, run * step as f64, rise * step as f64);
                mesh.rectangle(low, DVec3::X, DVec3::Z * rise, 1, 0);
                mesh.rectangle(low + DVec3::Z * rise, DVec3::X, DVec3::Y * run, 1, 0);
            }
            let (y, z) = (run * steps as f64, rise * steps as f64);
            mesh.rectangle(dvec3(0.0, -0.6, 0.0), DVec3::X, DVec3::Y * 0.6, 1, 0);
            mesh.rectangle(dvec3(0.0, -0.6, 0.0), DVec3::Y * (y + 0.6), DVec3::Z * (z + 0.8), 1, 1);
            (dvec3(0.35, 0.4 * y, 0.5 * z), 1.2)
        }
        "fins" => {
            let (gap, height) = (between(0.15, 0.4), between(0.2, 0.6));
            mesh.rectangle(DVec3::ZERO, DVec3::X * 4.0 * gap, DVec3::Y, 1, 0);
            for fin in 1..4 {
                let low = dvec3(gap * fin as f64, 0.15, 0.0);
                box_on_floor(&mut mesh, low - DVec3::X * 0.01, dvec3(0.02, between(0.4, 0.8), height), 1);
            }
            (dvec3(2.0 * gap, 0.4, 0.2 * height), 4.0 * gap)
        }
        _ => {
            let n = 1 + (index / 4 % 3) as usize * 3;
            mesh.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, n, 0);
            mesh.rectangle(DVec3::ZERO, DVec3::Y * between(0.6, 1.0), DVec3::Z * between(0.5, 1.0), n, 1);
            if index % 8 == 3 {
                mesh.rectangle(DVec3::ZERO, DVec3::Z, DVec3::X, n, 2);
            }
            (dvec3(0.35, 0.35, 0.3), 1.3)
        }
    };
    let mut material = || {
        let diffuse = between(0.2, 0.8);
        let specular = if index.is_multiple_of(3) { between(0.1, 0.4).min(0.95 - diffuse) } else { 0.0 };
        Material::new(diffuse, specular.max(0.0))
    };
    let materials = [material(), material(), material()];
    let model = [SkyModel::Overcast, SkyModel::Uniform, SkyModel::Hemisphere][(index / 2) as usize % 3];
    let ground = if matches!(model, SkyModel::Uniform) { 1.0 } else { 0.0 };
    let mut case = Case::new(mesh, &materials).sky(SkyOf::new(model, &[1.0], &[ground]));
    if index % 5 < 2 {
        let half = if index.is_multiple_of(2) { 0.0 } else { 0.2665 };
        let direction = [between(0.1, 0.8), between(-0.8, 0.3), between(0.4, 1.0)];
        case = case.sun(SunOf::new(direction, &[std::f64::consts::PI], half));
    }
    let from = match kind {
        "stairs" => dvec3(between(1.5, 3.0), between(-3.0, -1.5), between(1.0, 3.0)),
        "fins" => dvec3(between(-1.0, 1.0), between(-3.0, -1.5), between(1.5, 3.0)),
        _ => dvec3(between(0.6, 2.0), between(0.6, 2.0), between(1.5, 3.0)),
    };
    let height = size * between(0.25, 1.2);
    let camera = orthographic((target + from).into(), target.into(), height, 48);
    (format!("{index:02}_{kind}"), case, camera)
}

/// A generated scene as the program takes it.
fn scene_file(case: &Case, camera: &CameraInput) -> String {
    let mut text = "[mesh]\nfile = \"m.obj\"\n".to_owned();
    for (index, m) in case.materials.iter().enumerate() {
        let used = case.mesh.materials.contains(&(index as u32));
        if used {
            text += &format!(
                "[material.m{index}]\ndiffuse = {:?}\nspecular = {:?}\n",
                m.diffuse[0], m.specular[0]
            );
        }
    }
    if let Some(sky) = &case.sky {
        let model = format!("{:?}", sky.model).to_lowercase();
        text += &format!("[sky]\nmodel = \"{model}\"\nground = {:?}\n", sky.ground[0]);
    }
    if let Some(sun) = &case.sun {
        text += &format!(
            "[sun]\ndirection = {:?}\nirradiance = {:?}\nhalf_angle_deg = {:?}\n",
            sun.direction, sun.irradiance[0], sun.half_angle_deg
        );
    }
    let Projection::Orthographic { height } = camera.projection else { unreachable!("parallel views") };
    text + &format!(
        "[camera]\nkind = \"orthographic\"\neye = {:?}\ntarget = {:?}\nup = [0, 0, 1]\nheight = {height:?}\nresolution = [{}, {}]\nsampling = \"centre\"\n",
        camera.eye, camera.target, camera.columns, camera.rows
    )
}

/// Writes generated scenes and the judge's images of them, in halves of f64, into a folder: `CONTACT_FOLDER`.
#[test]
#[ignore = "minutes; writes files for the program to be compared with"]
fn write_generated_scenes() {
    let folder = std::path::PathBuf::from(std::env::var("CONTACT_FOLDER").expect("CONTACT_FOLDER"));
    for index in 0..36 {
        let (name, case, camera) = generated(index);
        let folder = folder.join(&name);
        std::fs::create_dir_all(&folder).unwrap();
        let mut obj = String::new();
        for v in &case.mesh.vertices {
            obj += &format!("v {:?} {:?} {:?}\n", v[0], v[1], v[2]);
        }
        for (facet, material) in case.mesh.facets.iter().zip(&case.mesh.materials) {
            let [a, b, c] = facet.map(|corner| corner + 1);
            obj += &format!("usemtl m{material}\nf {a} {b} {c}\n");
        }
        std::fs::write(folder.join("m.obj"), obj).unwrap();
        std::fs::write(folder.join("scene.toml"), scene_file(&case, &camera)).unwrap();
        let scene = scene(&case);
        let mut memory = Memory::default();
        let judge = Judge::new(&scene, &mut memory);
        let halves = judge.image(&camera, 1.5e-4, 40_000_000, 5);
        for (half, values) in halves.values.iter().enumerate() {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            std::fs::write(folder.join(format!("half{half}.f64")), bytes).unwrap();
        }
        let hit: Vec<u8> = halves.hit.iter().map(|h| u8::from(*h)).collect();
        std::fs::write(folder.join("hit.u8"), hit).unwrap();
        println!("{name}: {} samples, {} rays", halves.samples, halves.rays);
    }
}
