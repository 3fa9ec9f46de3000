//! Panels without thickness: two facets that coincide, each with a material on its own front. What shows, and what is met,
//! is the side that faces the observer, whatever the order of the facets in the file.

#[path = "support/kernel.rs"]
mod kernel;
mod support;

use glam::dvec3;
use kernel::{mean_irradiance, radiance, solve, within};
use std::f64::consts::PI;
use support::scenes::Mesh;
use support::twin::{Material, Model, Rng, Scene, Sky};

/// A square of side 2 about the origin with corners at any of its four to begin with, seen from +z, of this material.
fn square(material: u32, first: usize, other_diagonal: bool) -> Mesh {
    let corners =
        [dvec3(-1.0, -1.0, 0.0), dvec3(1.0, -1.0, 0.0), dvec3(1.0, 1.0, 0.0), dvec3(-1.0, 1.0, 0.0)];
    let at = |k: usize| ((first + k + usize::from(other_diagonal)) % 4) as u32;
    let facets = vec![[at(0), at(1), at(2)], [at(2), at(3), at(0)]];
    Mesh { vertices: corners.map(|c| c.to_array()).to_vec(), facets, materials: vec![material; 2] }
}

/// Front of material 0 and back of material 1, in either order, and what else there is.
fn panel(rng: &mut Rng, swapped: bool, others: &Mesh) -> Mesh {
    let mut any = || (4.0 * rng.unit()) as usize;
    let (front, back) = (square(0, any(), any() % 2 == 0), square(1, any(), any() % 2 == 0).flipped());
    let (first, second) = if swapped { (&back, &front) } else { (&front, &back) };
    Mesh::default().joined(first).joined(second).joined(others)
}

#[test]
fn the_side_that_faces_the_observer_shows() {
    let mut rng = Rng(3);
    let materials = [Material::new(0.5, 0.0), Material::new(0.2, 0.0)];
    for number in 0..12 {
        let (axis, angle) = ([rng.unit(), rng.unit(), rng.unit() + 0.1], 7.0 * rng.unit());
        let mesh = panel(&mut rng, number % 2 == 0, &Mesh::default()).rotated(axis, angle);
        let normal = Mesh { ..square(0, 0, false) }.rotated(axis, angle);
        let [a, b, c] = normal.corners(0);
        let normal = (b - a).cross(c - a).normalize();
        let scene = Scene::new(&mesh, &materials).sky(Sky::new(Model::Uniform, 1.0, 1.0));
        solve(&scene, &within(2e-3), |_, lit| {
            for _ in 0..40 {
                let target = a + (b - a) * (0.1 + 0.8 * rng.unit()) + (c - b) * (0.1 + 0.8 * rng.unit());
                let aside = dvec3(rng.unit() - 0.5, rng.unit() - 0.5, rng.unit() - 0.5);
                for (side, truth) in [(1.0, 0.5), (-1.0, 0.2)] {
                    let direction = (normal * side + aside).normalize();
                    let seen =
                        radiance(lit, (target + direction * 3.0).to_array(), (-direction).to_array(), 0);
                    // rho times a sky of 1, in closed form
                    assert!((seen - truth).abs() < 1e-12, "{number}: {seen}, not {truth}");
                }
            }
        });
    }
}

#[test]
fn a_radiator_lights_what_looks_at_it() {
    let mut rng = Rng(4);
    let materials = [Material::new(0.0, 0.0).emitting(1.0), Material::new(0.0, 0.0), Material::new(0.5, 0.0)];
    // parallel squares of side 2 at distance 1: the form factor of Howell's catalogue C-11 for X = Y = 2
    let factor = {
        let (x2, root) = (4.0f64, 5.0f64.sqrt());
        let log = (((1.0 + x2) * (1.0 + x2)) / (1.0 + 2.0 * x2)).sqrt().ln();
        2.0 / (PI * x2) * (log + 2.0 * 2.0 * root * (2.0 / root).atan() - 2.0 * 2.0 * 2f64.atan())
    };
    assert!((factor - 0.4153).abs() < 1e-4);
    for number in 0..12 {
        let (axis, angle) = ([rng.unit(), rng.unit(), rng.unit() + 0.1], 7.0 * rng.unit());
        let above = square(2, number % 4, number % 3 == 0).flipped().translated([0.0, 0.0, 1.0]);
        let turned = if number < 4 { 0.0 } else { angle };
        let mesh = panel(&mut rng, number % 2 == 0, &above).rotated(axis, turned);
        let scene = Scene::new(&mesh, &materials);
        for directional in [true, false] {
            let settings = blik_kernel::host::Settings { directional, ..within(2e-3) };
            let received = solve(&scene, &settings, |_, lit| mean_irradiance(lit, &[4, 5])[0]) / PI;
            // two rows of rays, each some two tolerances of the lamp's radiance off at most; by a sheet's wrong side: 0
            assert!((received - factor).abs() < 5e-3, "{number}: {received}, not {factor}");
        }
    }
}
