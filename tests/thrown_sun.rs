//! Sunlight that mirrors and lobes throw on diffuse facets: by any number of flat mirrors in closed form, by lobes and curved
//! mirrors within the estimate.

#[path = "support/judge/mod.rs"]
mod judge;
#[path = "support/kernel.rs"]
mod kernel;
mod support;

use blik_kernel::arena::Memory;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use glam::{DVec3, dvec3};
use judge::{Judge, score};
use kernel::{radiance, solve, within};
use std::f64::consts::PI;
use support::scenes::Mesh;
use support::twin::{Material, Model, Rng, Scene, Sky, Sun};

/// A square of side `size` about a point, seen from the side of `normal`.
fn square(mesh: &mut Mesh, middle: DVec3, normal: DVec3, size: f64, material: u32) {
    let across = normal.cross(dvec3(0.1, 0.2, 0.97)).normalize();
    let up = normal.cross(across);
    mesh.rectangle(middle - (across + up) * (0.5 * size), across * size, up * size, 1, material);
}

/// Heliostats about a wall: all of their images of the sun meet on it, however many there are.
#[test]
fn any_number_of_heliostats_adds_up() {
    let mut rng = Rng(61);
    for (number, count) in [1, 4, 5, 16, 17, 18, 24, 33, 48, 65, 100, 150].into_iter().enumerate() {
        let mut mesh = Mesh::default();
        // the wall looks along -y
        mesh.rectangle(dvec3(-0.5, 0.0, 1.0), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 0.0, 1.0), 1, 0);
        let aim = dvec3(0.05, 0.0, 1.5);
        let sun = dvec3(0.3 * rng.unit(), -0.5, 1.0).normalize();
        let mut truth = 0.0;
        for k in 0..count {
            let (row, place) = (k / 25, k % 25);
            let angle = PI * (0.15 + 0.7 * (place as f64 + 0.5) / 25.0);
            let distance = 2.5 + 0.5 * row as f64;
            let at = dvec3(distance * angle.cos(), -distance * angle.sin(), 0.2);
            let toward = (aim - at).normalize();
            square(&mut mesh, at, (toward + sun).normalize(), 0.14, 1);
            truth += 0.9 * 2.0 * -toward.dot(dvec3(0.0, -1.0, 0.0));
        }
        // heliostats may stand in each other's light: not here, rows rise behind each other
        let materials = [Material::new(0.5, 0.0), Material::new(0.0, 0.9)];
        let scene = Scene::new(&mesh, &materials).sun(Sun::new(sun, 2.0, 0.2f64.to_radians()));
        let direct = 2.0 * sun.dot(dvec3(0.0, -1.0, 0.0));
        let truth = 0.5 / PI * (truth + direct);
        let seen =
            solve(&scene, &within(2e-3), |_, lit| radiance(lit, [aim.x, -1.0, aim.z], [0.0, 1.0, 0.0], 0));
        println!("{number}: {count} mirrors: {seen:.4}, {truth:.4}");
        // some of a hundred may stand in the light of others
        let hidden = if count > 25 { 0.1 } else { 2e-3 };
        assert!((seen - truth).abs() <= hidden * truth, "{count}: {seen}, not {truth}");
    }
}

/// A lobe that throws sun on a floor of two triangles: the estimate holds, whatever elements there are.
#[test]
fn what_lobes_throw_is_estimated() {
    let mut rng = Rng(62);
    let mut lied = 0;
    for number in 0..12 {
        let mut mesh = Mesh::default();
        mesh.rectangle(dvec3(0.0, -0.5, 0.3), dvec3(0.0, 1.0, 0.0), dvec3(0.0, 0.0, 0.7), 1, 0);
        mesh.rectangle(dvec3(0.2, -1.5, 0.0), dvec3(2.8, 0.0, 0.0), dvec3(0.0, 3.0, 0.0), 1, 1);
        let ratio = [3.0, 6.0, 12.0, 40.0][number % 4];
        let sun = dvec3(1.2, rng.unit() - 0.5, 0.4 + 0.8 * rng.unit()).normalize();
        let materials = [
            Material { gloss: Some(ratio), ..Material::new(0.0, 0.5 + 0.4 * rng.unit()) },
            Material::new(0.5, 0.0),
        ];
        let scene = Scene::new(&mesh, &materials).sky(Sky::new(Model::Hemisphere, 0.1, 0.0)).sun(Sun::new(
            sun,
            2.0,
            0.2665f64.to_radians(),
        ));
        let camera = CameraInput {
            projection: Projection::Orthographic { height: 3.0 },
            eye: [1.5, 0.0, 5.0],
            target: [1.5, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            columns: 12,
            rows: 12,
            sampling: Sampling::Centre,
        };
        let (pixels, reference, estimate) = solve(&scene, &within(1e-2), |host, lit| {
            let image = host.image(lit, &camera, false).unwrap();
            (image.pixels, lit.reference().to_vec(), image.report.error_estimate)
        });
        let mut memory = Memory::default();
        let halves = Judge::new(&scene, &mut memory).image(&camera, 1e-3, 4_000_000, 7);
        let pixels: Vec<f64> = pixels.iter().map(|&p| f64::from(p)).collect();
        let found = score(&pixels, [&halves.values[0], &halves.values[1]], &halves.hit, &reference);
        println!("{number}: T {ratio}: eps {:.1e} ({:.1e}), estimate {estimate:.1e}", found.eps, found.low);
        lied += usize::from(found.low > estimate);
    }
    assert!(lied <= 1, "{lied} of 12 estimates are too low");
}
