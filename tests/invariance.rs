//! The image does not depend on where the scene is, how large, how turned, and in which order its facets come.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::math::Vec3;
use blik_kernel::sky::SkyModel;
use case::{Case, Outcome, SkyOf, SunOf, orthographic, perspective, rms, within};
use glam::DQuat;
use support::scenes;
use support::twin::Material;

/// Two bands, a diffuse, a mixed and a mirror facet family, a sky that varies and a sun: nothing is symmetric, and all
/// coordinates are multiples of 1/8.
fn scene() -> (Case, [CameraInput; 2]) {
    let body = scenes::cube_outside().scaled(0.25).translated([0.375, 0.25, 0.5]);
    let pairs = [([0.6, 0.3], [0.2, 0.4]), ([0.2, 0.5], [0.0, 0.0]), ([0.1, 0.1], [0.6, 0.3])];
    let materials = pairs.map(|(d, s)| Material::spectral(&d, &s));
    let case = Case::new(scenes::corner(2).joined(&body), &materials)
        .sky(SkyOf::new(SkyModel::Gradient, &[1.0, 0.8], &[0.2, 0.4]))
        .sun(SunOf::new([0.5, 0.75, 1.0], &[2.0, 1.0], 0.2665));
    let eye = [3.0, 2.0, 2.5];
    let target = [0.375, 0.5, 0.25];
    let area = CameraInput { sampling: Sampling::Area, ..orthographic(eye, target, 2.0, 24) };
    (case, [area, perspective(eye, target, 30.0, 24)])
}

/// The scene without its sun, and without its mirrors. With both, sunlight by way of mirrors is constant on each
/// element, and where a beam ends within one the picture depends on how the facets are cut.
fn two_scenes() -> [Case; 2] {
    let (case, _) = scene();
    let mut diffuse = case.clone();
    diffuse.materials.iter_mut().for_each(|m| m.specular.fill(0.0));
    [Case { sun: None, ..case }, diffuse]
}

const TOLERANCE: f64 = 1e-2;

fn run(case: &Case, camera: &CameraInput) -> Outcome {
    case.run(2, &within(TOLERANCE), camera)
}

/// Equal within twice what both say of their own errors, which are expected rms values; those are not much larger
/// than what was asked for.
#[track_caller]
fn agree(what: &str, a: &Outcome, b: &Outcome) {
    let reference = a.image.report.reference_radiance.iter().fold(f64::INFINITY, |m, &r| m.min(r));
    let (first, second) = (a.image.report.error_estimate, b.image.report.error_estimate);
    let difference = rms(&a.image.pixels, &b.image.pixels) / reference;
    println!(
        "{what}: differ by {difference:.1e}, estimates {first:.1e} {second:.1e}, limited by {}",
        a.image.report.limited_by
    );
    assert!(difference > 0.0, "{what}: other rays, other bits");
    assert!(
        difference <= 2.0 * first.hypot(second),
        "{what}: {difference:.2e}, estimates {first:.1e} {second:.1e}"
    );
    // halves of 64 rays say little: an estimate of several tolerances is what they leave
    assert!(first.max(second) <= 5.0 * TOLERANCE, "{what}: the estimate says something");
}

/// The same bits in all pixels, components, irradiances and radiances.
#[track_caller]
fn identical(what: &str, a: &Outcome, b: &Outcome) {
    assert_eq!(a.pixel_bits(), b.pixel_bits(), "{what}: pixels");
    assert_eq!(a.facet_bits(), b.facet_bits(), "{what}: irradiances");
}

fn moved(point: [f64; 3], offset: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| point[k] + offset[k])
}

#[test]
fn exact_translations_change_no_bit() {
    let (case, cameras) = scene();
    for camera in cameras {
        let still = run(&case, &camera);
        // ECEF metres, and an offset at which f32 would see nothing of the object
        for offset in [[6.4e6, -2.5, 1024.0], [-4_194_304.0, 3.5e9, 6.4e6]] {
            let case = Case { mesh: case.mesh.translated(offset), ..case.clone() };
            let camera = CameraInput {
                eye: moved(camera.eye, offset),
                target: moved(camera.target, offset),
                ..camera
            };
            identical("translation", &still, &run(&case, &camera));
        }
    }
}

#[test]
fn powers_of_two_in_scale_change_no_bit() {
    let (case, cameras) = scene();
    for camera in cameras {
        let still = run(&case, &camera);
        for factor in [2.0, 2f64.powi(-30), 2f64.powi(40)] {
            let scaled = Case { mesh: case.mesh.scaled(factor), ..case.clone() };
            let projection = match camera.projection {
                Projection::Orthographic { height } => Projection::Orthographic { height: height * factor },
                same => same,
            };
            let by = |p: [f64; 3]| p.map(|x| x * factor);
            let camera = CameraInput { projection, eye: by(camera.eye), target: by(camera.target), ..camera };
            let outcome = run(&scaled, &camera);
            identical("scale", &still, &outcome);
            for (a, b) in still.sides.iter().zip(&outcome.sides) {
                assert_eq!(a.area * factor * factor, b.area, "areas are the caller's");
            }
        }
    }
}

#[test]
fn a_rounded_translation_stays_within_the_estimate() {
    // these coordinates are not exact at 6.4e6: vertices move by up to 2^-31, and so does the picture
    let (case, cameras) = scene();
    let case = Case { mesh: case.mesh.rotated([1.0, 2.0, 3.0], 0.4), ..case };
    let offset = [6.4e6, 6.4e6 / 3.0, -1e5 / 7.0];
    for camera in cameras {
        let far = Case { mesh: case.mesh.translated(offset), ..case.clone() };
        let there =
            CameraInput { eye: moved(camera.eye, offset), target: moved(camera.target, offset), ..camera };
        let (a, b) = (run(&case, &camera), run(&far, &there));
        let difference = rms(&a.image.pixels, &b.image.pixels);
        println!("rounded translation: differ by {difference:.1e}");
        assert!(a.facet_bits() != b.facet_bits(), "vertices have moved");
        // 2^-31 over a pixel of 2/24 is 6e-9 of it: a ray in a million that meets an edge goes the other way
        assert!(difference < 0.05 * TOLERANCE, "{difference:.2e}");
    }
}

#[test]
fn rotations_stay_within_the_estimate() {
    for (axis, angle) in [([0.0, 0.0, 1.0], 0.5), ([1.0, 2.0, -0.5], 2.2)] {
        let turn = DQuat::from_axis_angle(Vec3::from_array(axis).normalize(), angle);
        let by = |p: [f64; 3]| (turn * Vec3::from_array(p)).to_array();
        for case in two_scenes() {
            let mut turned = Case { mesh: case.mesh.rotated(axis, angle), ..case.clone() };
            turned.sky.as_mut().unwrap().up = by([0.0, 0.0, 1.0]);
            turned.sun.iter_mut().for_each(|sun| sun.direction = by(sun.direction));
            for camera in scene().1 {
                let there = CameraInput {
                    eye: by(camera.eye),
                    target: by(camera.target),
                    up: by(camera.up),
                    ..camera
                };
                agree("rotation", &run(&case, &camera), &run(&turned, &there));
            }
        }
    }
}

#[test]
fn the_order_of_facets_stays_within_the_estimate() {
    for case in two_scenes() {
        let facets = case.mesh.facets.len();
        // 7 and 36 have no common factor
        let order: Vec<usize> = (0..facets).map(|i| (7 * i + 3) % facets).collect();
        let permuted = Case { mesh: case.mesh.permuted(&order), ..case.clone() };
        for camera in scene().1 {
            let (a, b) = (run(&case, &camera), run(&permuted, &camera));
            agree("permutation", &a, &b);
            let (mut square, mut count) = (0.0, 0.0);
            for (new, &old) in b.sides.iter().zip(&order) {
                assert_eq!(new.area, a.sides[old].area);
                for (x, y) in new.radiance.iter().zip(&a.sides[old].radiance) {
                    (square, count) = (square + (x - y) * (x - y), count + 1.0);
                }
            }
            let difference = f64::sqrt(square / count);
            // a facet's diffuse radiance is held to the tolerance, relative to a reference radiance of about 1
            assert!(difference <= TOLERANCE, "facets differ by {difference:.1e}");
        }
    }
}
