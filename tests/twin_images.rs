//! The kernel's images against the brute-force twin's, on small scenes that each need another part of it.

#[path = "support/kernel.rs"]
mod kernel;
mod support;

use blik_kernel::host::Settings;
use glam::{DVec3, dvec3};
use kernel::{Soup, irradiances, solve, solve_soup, within};
use std::f64::consts::PI;
use support::scene_file::Camera;
use support::scenes::{self, Mesh};
use support::twin::{self, Dense, Effort, Material, Model, Scene, Sky, Sun};

const TOLERANCE: f64 = 2e-3;

/// A square image of `pixels` rows.
fn camera(eye: DVec3, target: DVec3, height: f64, perspective: bool, pixels: usize) -> Camera {
    let f = (target - eye).normalize();
    let r = f.cross(DVec3::Z).normalize();
    Camera { eye, axes: [f, r, r.cross(f)], height, perspective, resolution: [pixels, pixels] }
}

/// The kernel's estimate, rms and largest error against the twin's pixels, relative to the reference radiance, with the
/// twin's standard errors taken out: squared from the one, four times from the other.
fn errors(scene: &Scene, camera: &Camera, rays: usize) -> (f64, f64, f64) {
    let (image, reference, estimate) = solve(scene, &within(TOLERANCE), |host, lit| {
        let image = host.image(lit, &kernel::camera(camera), false).unwrap();
        (image.pixels, lit.reference().to_vec(), image.report.error_estimate)
    });
    let (mut squares, mut noise, mut worst) = (0.0, 0.0, 0.0f64);
    let [columns, rows] = camera.resolution;
    for (pixel, values) in image.chunks(scene.bands).enumerate() {
        let (origin, direction) = camera.ray(pixel / columns, pixel % columns);
        let effort = Effort { seed: pixel as u64, threshold: 1e-4, randomisations: 16, ..Effort::rays(rays) };
        let truth = twin::radiance(scene, origin, direction, effort);
        for band in 0..scene.bands {
            let error = (f64::from(values[band]) - truth.mean[band]).abs() / reference[band];
            let standard = truth.standard_error[band] / reference[band];
            squares += error * error;
            noise += standard * standard;
            worst = worst.max(error - 4.0 * standard);
        }
    }
    let count = (columns * rows * scene.bands) as f64;
    // the view is worth comparing: a third of it is lit
    let lit = image.chunks(scene.bands).filter(|p| p.iter().any(|&x| x > 0.0)).count();
    assert!(3 * lit > columns * rows, "{lit} pixels are lit");
    (estimate, ((squares - noise).max(0.0) / count).sqrt(), worst)
}

/// Rotated and pushed into each other: edges of one end inside faces of the other.
fn two_boxes() -> Mesh {
    let second =
        scenes::cube_outside().of_material(1).rotated([1.0, 2.0, 3.0], 0.7).translated([0.6, 0.3, 0.4]);
    scenes::cube_outside().joined(&second).subdivided(2)
}

fn table_sky() -> Sky {
    let (rows, columns) = (6, 12);
    let values = (0..rows * columns).map(|k| 0.25 * ((k * 7 + k / columns) % 9) as f64).collect();
    let model = Model::Table { rows, columns, values, azimuth_zero: dvec3(0.5, 1.0, 0.0) };
    Sky { up: dvec3(0.2, -0.1, 1.0), ..Sky::new(model, 1.0, 0.0) }
}

fn glossy(diffuse: f64, specular: f64, ratio: f64) -> Material {
    Material { gloss: Some(ratio), ..Material::new(diffuse, specular) }
}

#[test]
fn small_scenes() {
    let uniform = || Sky::new(Model::Uniform, 1.0, 1.0);
    let overcast = || Sky::new(Model::Overcast, 1.0, 0.3);
    let corner = || scenes::corner(4);
    let mirrors = [Material::new(0.4, 0.4), Material::new(0.1, 0.8), Material::new(0.6, 0.0)];
    let diffuse = |rho: f64| vec![Material::new(rho, 0.0); 3];
    let outside = camera(dvec3(3.0, 2.6, 2.2), dvec3(0.4, 0.4, 0.4), 1.7, false, 6);
    let bands = |r: f64, g: f64, b: f64| vec![r, g, b];
    let spectral = [
        Material::spectral(&[0.6, 0.3, 0.1], &[0.0, 0.3, 0.8]),
        Material::spectral(&[0.2, 0.4, 0.5], &[0.7, 0.3, 0.0]),
        Material::spectral(&[0.0, 0.5, 0.9], &[0.9, 0.2, 0.1]),
    ];
    let spectral_sky = Sky {
        radiance: bands(1.0, 0.7, 0.2),
        ground: bands(0.1, 0.0, 0.5),
        ..Sky::new(Model::Hemisphere, 1.0, 0.0)
    };
    let room = scenes::box_open(1.0, 1.3, 0.8, 8);
    let lamp = [Material::new(0.5, 0.2), Material::new(0.4, 0.0).emitting(0.7)];
    let blocker = scenes::squares_with_blocker(0.5, [0.25, 0.75, 0.2, 0.6]).subdivided(2);
    let low = camera(dvec3(3.0, -2.0, 1.4), dvec3(0.5, 0.4, 0.1), 0.8, false, 6);
    let cie = |kind| Sky::new(Model::Cie { kind, sun: dvec3(0.5, 0.2, 0.7) }, 1.0, 0.1);
    let inside = camera(dvec3(0.5, 0.2, 0.7), dvec3(0.5, 1.3, 0.2), 1.2, true, 6);
    let above = camera(dvec3(2.0, 1.6, 3.0), dvec3(0.5, 0.5, 0.0), 1.2, false, 6);
    let boxes = [Material::new(0.4, 0.3), Material::new(0.2, 0.6)];
    let sun = |half_angle_deg: f64| Sun::new(dvec3(0.4, 0.3, 0.8), PI, half_angle_deg.to_radians());
    let lobes = [glossy(0.2, 0.6, 3.0), glossy(0.3, 0.4, 10.0), Material::new(0.4, 0.0)];
    // beside a lamp light bends within single facets: light that is linear on each converges with their size there
    let cases = [
        ("corner of mirrors", 1.0, Scene::new(&corner(), &mirrors).sky(uniform()), &outside),
        ("two-sided sheets", 1.0, Scene::new(&blocker, &mirrors).sky(overcast()).two_sided(true), &low),
        ("emission", 1.5, Scene::new(&room, &lamp), &inside),
        ("spectral", 1.0, Scene::new(&corner(), &spectral).sky(spectral_sky), &outside),
        ("penumbra", 1.0, Scene::new(&blocker, &diffuse(0.4)).sky(overcast()).sun(sun(3.0)), &low),
        ("point sun", 1.0, Scene::new(&blocker, &diffuse(0.4)).sun(sun(0.0)), &low),
        ("CIE sky", 1.0, Scene::new(&corner(), &diffuse(0.5)).sky(cie(12)), &outside),
        ("CIE sky in mirrors", 1.0, Scene::new(&corner(), &mirrors).sky(cie(7)), &outside),
        ("gradient sky", 1.0, Scene::new(&room, &lamp[..]).sky(Sky::new(Model::Gradient, 1.0, 0.2)), &inside),
        ("table sky", 1.0, Scene::new(&corner(), &mirrors).sky(table_sky()), &outside),
        ("gloss", 1.0, Scene::new(&corner(), &lobes).sky(overcast()), &outside),
        ("gloss in the sun", 1.0, Scene::new(&scenes::tilted_square(0.1), &lobes).sun(sun(0.2665)), &above),
        ("boxes in each other", 1.0, Scene::new(&two_boxes(), &boxes).sky(overcast()), &outside),
    ];
    let mut failed = Vec::new();
    for (name, slack, scene, camera) in &cases {
        let (estimate, rms, worst) = errors(scene, camera, 256);
        println!(
            "{name:20} estimate {estimate:.2e}, rms {rms:.2e}, worst pixel {worst:.2e} beyond 4 standard errors"
        );
        // the project's goal at this tolerance
        if rms > 2.5 * TOLERANCE * slack || worst > 8.0 * TOLERANCE {
            failed.push(*name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// Sunlight that a mirror throws on a wall is known as a mean over each element: compared as such.
#[test]
fn the_sun_by_way_of_a_mirror_onto_a_wall() {
    let materials = [Material::new(0.5, 0.0), Material::new(0.1, 0.8)];
    let mesh = scenes::wall_on_mirror().subdivided(2);
    for (half_angle, direction) in [(0.0, dvec3(0.8, 0.3, 0.5)), (0.02, dvec3(0.6, -0.2, 0.4))] {
        let scene = Scene::new(&mesh, &materials).sun(Sun::new(direction, 1.0, half_angle));
        let settings = Settings { all_irradiances: true, ..within(TOLERANCE) };
        let mine = solve(&scene, &settings, |_, lit| irradiances(lit));
        let mut reflected = 0;
        for (facet, value) in mine.iter().enumerate() {
            let effort = Effort { seed: facet as u64, randomisations: 16, ..Effort::rays(1024) };
            let truth = twin::facet_irradiance(&scene, facet, true, effort);
            let (mean, error) = (truth.mean[0], truth.standard_error[0]);
            // 256 points of a facet partly in light or shadow: 1.6 % of the sun; the share of bounced light: 4e-3
            let bound = 2e-2 + 4.0 * error;
            assert!((value - mean).abs() < bound, "facet {facet}: {value}, not {mean} +- {error:.1e}");
            let straight = direction.normalize().dot(scene.normals[facet]);
            reflected += usize::from(mean > straight + 0.1);
        }
        assert!(reflected >= 5, "the mirror lights {reflected} facets");
    }
}

#[test]
fn bounces_in_a_furnace() {
    // all facets emit e and reflect r of a closed room: at most n reflections make e (1 + r + ... + r^n)
    let (diffuse, specular, emission) = ([0.5, 0.1, 0.0], [0.2, 0.6, 0.7], 0.5);
    let material = Material::spectral(&diffuse, &specular).emitting(emission);
    let scene = Scene::new(&scenes::cube_inside(), &[material]);
    for most in [0, 1, 2, 5] {
        let settings = Settings { max_bounces: Some(most), ..within(TOLERANCE) };
        solve(&scene, &settings, |_, lit| {
            for band in 0..3 {
                let r: f64 = diffuse[band] + specular[band];
                let truth: f64 = (0..=most).map(|k| emission * r.powi(k as i32)).sum();
                let value = kernel::radiance(lit, [0.3, 0.4, 0.6], [1.0, 2.0, -0.5], band);
                // rows close and no chain of five mirrors of 0.7 is cut; f32 gradients of nothing but noise: 1e-3
                assert!((value - truth).abs() < 2e-3, "{most} bounces, band {band}: {value}, not {truth}");
            }
        });
    }
}

#[test]
fn bounces_between_diffuse_facets() {
    let rho = 0.6;
    let scene = Scene::new(&scenes::corner(4), &vec![Material::new(rho, 0.0); 3])
        .sky(Sky::new(Model::Overcast, 1.0, 0.3))
        .sun(Sun::new(dvec3(0.4, 0.5, 0.6), 1.0, 0.0));
    let truth = twin::estimate(16, 5, |rng| {
        let dense = Dense::gather(&scene, 1024, rng);
        let mut radiances = vec![0.0; dense.unknowns];
        let mut all = Vec::new();
        for _ in 0..3 {
            let irradiances = dense.irradiances_over_pi(&radiances);
            radiances = irradiances.iter().map(|e| rho * e).collect();
            all.extend(irradiances.iter().map(|e| PI * e));
        }
        all
    });
    for most in 0..3 {
        let settings = Settings { max_bounces: Some(most), ..within(TOLERANCE) };
        let mine = solve(&scene, &settings, |_, lit| irradiances(lit));
        let range = most as usize * mine.len()..;
        let expected = truth.mean[range.clone()].iter().zip(&truth.standard_error[range]);
        for (facet, (value, (mean, error))) in mine.iter().zip(expected).enumerate() {
            // a row's rays: about 0.6 n^-2/3 of pi times the radiance at stake, 1, for n of 4096: 7e-3, here twice
            // that, in which the twin's one radiance per facet is lost, too
            let bound = 1.5e-2 + 4.0 * error;
            assert!((value - mean).abs() < bound, "{most} bounces, facet {facet}: {value}, not {mean}");
        }
        if most > 0 {
            let before = &truth.mean[(most as usize - 1) * mine.len()..];
            let gained = mine.iter().zip(before).map(|(a, b)| a - b).fold(0.0, f64::max);
            assert!(gained > 0.05, "bounce {most} brings {gained}");
        }
    }
}

/// One facet in the plane z = 0 with vertex normals, its corners and the normals.
fn smooth_facet(normals: [DVec3; 3], two_sided: bool) -> (Scene, Soup, [DVec3; 3]) {
    let corners = [DVec3::ZERO, dvec3(2.0, 0.0, 0.0), dvec3(0.5, 1.5, 0.0)];
    let mesh = Mesh {
        vertices: corners.map(|c| c.to_array()).to_vec(),
        facets: vec![[0, 1, 2]],
        materials: vec![0],
    };
    let scene = Scene::new(&mesh, &[Material::new(0.0, 0.8)]).two_sided(two_sided);
    let mut soup = Soup::new(&scene);
    soup.normals = normals.map(|n| n.to_array()).to_vec();
    (scene, soup, corners)
}

#[test]
fn interpolated_normals_turn_the_mirror_direction() {
    let normals = [dvec3(0.1, 0.0, 2.0), dvec3(-0.3, 0.2, 1.0), dvec3(0.0, 0.4, 1.0)];
    let (scene, soup, corners) = smooth_facet(normals, true);
    // L = 1 + 0.5 dir.up about a slanted up tells every direction
    let up = dvec3(0.6, -0.3, 0.5);
    let scene = scene.sky(Sky { up, ..Sky::new(Model::Gradient, 1.5, 0.5) });
    solve_soup(&soup, &scene, &within(TOLERANCE), |_, lit| {
        for (u, v) in [(0.2, 0.3), (0.6, 0.1), (0.05, 0.9)] {
            let weights = [1.0 - u - v, u, v];
            let point: DVec3 = (0..3).map(|k| corners[k] * weights[k]).sum();
            let normal: DVec3 = (0..3).map(|k| normals[k].normalize() * weights[k]).sum();
            let normal = normal.normalize();
            // onto the front, and onto the back
            for direction in [dvec3(0.3, -0.2, -1.0), dvec3(-0.4, 0.1, 0.9)] {
                let direction = direction.normalize();
                let mirrored = direction - normal * (2.0 * direction.dot(normal));
                let truth = 0.8 * (1.0 + 0.5 * mirrored.dot(up.normalize()));
                let origin = (point - direction * 3.0).to_array();
                let value = kernel::radiance(lit, origin, direction.to_array(), 0);
                // roundings of a hit at distance 3
                assert!((value - truth).abs() < 1e-12, "({u}, {v}) {direction}: {value}, not {truth}");
            }
        }
    });
}

#[test]
fn interpolated_normals_mirror_nothing_from_below() {
    // so tilted that the plain mirror direction of a slanting ray goes below the facet's plane, where L = 0
    let (scene, soup, corners) = smooth_facet([dvec3(1.0, 0.0, 0.4); 3], false);
    let scene = scene.sky(Sky::new(Model::Hemisphere, 1.0, 0.0));
    let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    let direction = dvec3(0.2, 0.1, -1.0);
    let normal = dvec3(1.0, 0.0, 0.4).normalize();
    assert!((direction - normal * (2.0 * direction.dot(normal))).z < -0.5);
    solve_soup(&soup, &scene, &within(TOLERANCE), |_, lit| {
        let value = kernel::radiance(lit, (middle - direction).to_array(), direction.to_array(), 0);
        // lifted above the plane it sees the sky's 1
        assert!((value - 0.8).abs() < 1e-12, "{value}");
    });
}
