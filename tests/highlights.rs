//! The sun in lobes: as a disc, straight and by way of flat mirrors, against path tracing, on generated scenes.

#[path = "support/judge/mod.rs"]
mod judge;
#[path = "support/kernel.rs"]
mod kernel;
mod support;

use blik_kernel::arena::Memory;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use glam::{DVec3, dvec3};
use judge::{Judge, score};
use kernel::{solve, within};
use support::scenes::Mesh;
use support::twin::{Material, Model, Rng, Scene, Sky, Sun};

/// Pixels on either side of an image.
const PIXELS: usize = 16;

fn glossy(diffuse: f64, specular: f64, ratio: f64) -> Material {
    Material { gloss: Some(ratio), ..Material::new(diffuse, specular) }
}

fn camera(eye: DVec3, target: DVec3, height: f64) -> CameraInput {
    CameraInput {
        projection: Projection::Orthographic { height },
        eye: eye.to_array(),
        target: target.to_array(),
        up: [0.0, 0.0, 1.0],
        columns: PIXELS,
        rows: PIXELS,
        sampling: Sampling::Centre,
    }
}

/// The true error of an image, as low as the judge's noise lets it be, and the estimate.
fn measured(scene: &Scene, camera: &CameraInput, tolerance: f64) -> (f64, f64) {
    let (pixels, reference, estimate) = solve(scene, &within(tolerance), |host, lit| {
        let image = host.image(lit, camera, false).unwrap();
        (image.pixels, lit.reference().to_vec(), image.report.error_estimate)
    });
    let mut memory = Memory::default();
    let judge = Judge::new(scene, &mut memory);
    let halves = judge.image(camera, 0.1 * tolerance, 6_000_000, 5);
    let pixels: Vec<f64> = pixels.iter().map(|&p| f64::from(p)).collect();
    let found = score(&pixels, [&halves.values[0], &halves.values[1]], &halves.hit, &reference);
    println!("eps {:.1e} ({:.1e} to {:.1e}), estimate {estimate:.1e}", found.eps, found.low, found.high);
    (found.low, estimate)
}

/// A wall that is a lobe over a floor that is a mirror, and sometimes a second mirror at the side: all are looked at so
/// that the highlight of one of the sun's images is near.
fn wall_over_mirrors(rng: &mut Rng, number: usize) -> (Scene, CameraInput) {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, dvec3(0.0, 1.0, 0.0), dvec3(0.0, 0.0, 1.0), 1, 0);
    mesh.rectangle(DVec3::ZERO, dvec3(2.5, 0.0, 0.0), dvec3(0.0, 1.0, 0.0), 1, 1);
    if number % 3 == 1 {
        mesh.rectangle(DVec3::ZERO, dvec3(0.0, 0.0, 1.5), dvec3(2.5, 0.0, 0.0), 1, 1);
    }
    let ratio = [3.0, 12.0, 40.0, 150.0][number % 4];
    let half = [0.0f64, 0.2665, 1.0, 3.0][(number / 2) % 4].to_radians();
    let diffuse = if number.is_multiple_of(2) { 0.0 } else { 0.2 };
    let sun = dvec3(0.6 + rng.unit(), 0.3 + 0.5 * rng.unit(), 0.5 + rng.unit()).normalize();
    let materials = [glossy(diffuse, 0.5, ratio), Material::new(0.0, 0.4 + 0.5 * rng.unit())];
    let mut scene = Scene::new(&mesh, &materials).sun(Sun::new(sun, 2.0, half));
    if number % 4 == 3 {
        scene = scene.sky(Sky::new(Model::Uniform, 0.3, 0.3));
    }
    // against the mirrored image's mirror direction, some widths of the lobe off
    let off = dvec3(rng.unit() - 0.5, rng.unit() - 0.5, rng.unit() - 0.5) * (2.0 / ratio);
    let image = dvec3(sun.x, if number % 3 == 1 { -sun.y } else { sun.y }, -sun.z);
    let eye = (dvec3(image.x, -image.y, -image.z) + off).normalize();
    (scene, camera(dvec3(0.0, 0.5, 0.5) + eye * 5.0, dvec3(0.0, 0.5, 0.5), 0.7))
}

#[test]
fn flat_mirrors_throw_the_sun_into_lobes() {
    let mut rng = Rng(21);
    let mut lied = 0;
    for number in 0..16 {
        let (scene, camera) = wall_over_mirrors(&mut rng, number);
        let (error, estimate) = measured(&scene, &camera, 5e-3);
        assert!(error < 10.0 * estimate.max(5e-3), "{number}: {error}");
        lied += usize::from(error > estimate);
    }
    // nineteen of twenty hold
    assert!(lied <= 1, "{lied} of 16 estimates are too low");
}

/// Radiance of a floor that is a lobe, at a point, by the mean of q over the disc straight from q's definition.
#[test]
fn a_lobe_shows_the_mean_of_the_disc() {
    let mut rng = Rng(22);
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-1.0, -1.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 2.0, 0.0), 1, 0);
    for number in 0..16 {
        let ratio = [5.0, 30.0, 300.0, 3000.0][number % 4];
        let half = [0.2665f64, 0.05, 2.0, 8.0][(number / 4) % 4].to_radians();
        let direction = dvec3(rng.unit() - 0.5, rng.unit() - 0.5, 0.6).normalize();
        let sun = Sun::new(direction, 1.0, half);
        let scene = Scene::new(&mesh, &[glossy(0.0, 0.5, ratio)]).sun(sun.clone());
        // the mirror direction within some disc's and lobe's widths of the disc
        let width = half + 1.0 / ratio;
        let off = dvec3(rng.unit() - 0.5, rng.unit() - 0.5, rng.unit() - 0.5) * (3.0 * width);
        let mirrored = (direction + off).normalize();
        let eye = dvec3(-mirrored.x, -mirrored.y, mirrored.z);
        // the mean over the disc of a sum graded toward the mirror direction: rings about it
        let rings = 4000;
        let angle = direction.dot(mirrored).clamp(-1.0, 1.0).acos();
        let (near, far) = ((angle - half).max(0.0), angle + half);
        let (a, b) = ((1.0 + (ratio * near).powi(2)).ln(), (1.0 + (ratio * far).powi(2)).ln());
        let mut truth = 0.0;
        for ring in 0..rings {
            // rings of nearly equal energy
            let at = |k: f64| (((a + (b - a) * k / f64::from(rings)).exp() - 1.0).max(0.0)).sqrt() / ratio;
            let (from, to) = (at(f64::from(ring)), at(f64::from(ring) + 1.0));
            let cone = 0.5 * (from + to);
            // the arc of a circle about the mirror direction inside the disc: the spherical law of cosines
            let cosine = (half.cos() - cone.cos() * angle.cos()) / (cone.sin() * angle.sin());
            let share = cosine.clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
            truth += share
                * std::f64::consts::TAU
                * (from.cos() - to.cos())
                * support::twin::lobe(ratio, cone.cos());
        }
        truth *= 0.5 / (std::f64::consts::PI * half.sin().powi(2));
        let seen = solve(&scene, &within(1e-3), |_, lit| {
            kernel::radiance(lit, (eye * 3.0).to_array(), (-eye).to_array(), 0)
        });
        println!("{number}: T {ratio}, half {half:.4}: {seen:.5}, truth {truth:.5}");
        // rings a four thousandth of the energy wide; the disc is above the floor
        assert!((seen - truth).abs() < 5e-4 * truth, "{number}: {seen}, not {truth}");
    }
}
