//! The judge that measures true errors is itself held to the readable twin and to closed forms.

#[path = "support/judge/mod.rs"]
mod judge;
mod support;

use blik_kernel::arena::Memory;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use glam::dvec3;
use judge::{Judge, ray, score};
use support::scenes::{self, Mesh};
use support::twin::{self, Effort, Material, Model, Scene, Sky, Sun};

fn camera(eye: [f64; 3], target: [f64; 3], height: f64, pixels: usize) -> CameraInput {
    let projection = Projection::Orthographic { height };
    let up = [0.0, 0.0, 1.0];
    CameraInput { projection, eye, target, up, columns: pixels, rows: pixels, sampling: Sampling::Centre }
}

/// Pixels and facets of judge and twin agree within their noise: neither single values nor all of them together are off.
fn agree(name: &str, scene: &Scene, camera: &CameraInput, rays: usize) {
    let mut memory = Memory::default();
    let judge = Judge::new(scene, &mut memory);
    let halves = judge.image(camera, 0.0, 4_000_000, 7);
    let mut differences = Vec::new();
    let bands = scene.bands;
    let mut note = |mine: [f64; 2], truth: f64, error: f64| {
        let mean = (mine[0] + mine[1]) / 2.0;
        // the twin's error is that of 16 randomisations, the judge's own of 2: taken as not larger than the twin's
        let sigma = (2.0 * error * error + 0.25 * (mine[0] - mine[1]).powi(2)).sqrt() + 2e-5;
        differences.push((mean - truth) / sigma);
    };
    for pixel in (0..halves.hit.len()).filter(|&p| halves.hit[p]) {
        let [row, column] = [pixel / camera.columns, pixel % camera.columns].map(|k| k as f64 + 0.5);
        let ray = ray(camera, column, row);
        let effort = Effort { seed: pixel as u64, threshold: 1e-5, randomisations: 16, ..Effort::rays(rays) };
        let truth = twin::radiance(scene, ray.origin, ray.direction, effort);
        for band in 0..bands {
            let mine = [0, 1].map(|h| halves.values[h][pixel * bands + band]);
            note(mine, truth.mean[band], truth.standard_error[band]);
        }
    }
    let sides: Vec<(usize, bool)> =
        (0..scene.areas.len()).step_by(scene.areas.len().div_ceil(12)).map(|f| (f, true)).collect();
    let received = judge.irradiances(&sides, 4096, 3);
    for (k, &(facet, front)) in sides.iter().enumerate() {
        let effort =
            Effort { seed: facet as u64, threshold: 1e-5, randomisations: 16, ..Effort::rays(2 * rays) };
        let truth = twin::facet_irradiance(scene, facet, front, effort);
        for band in 0..bands {
            note([0, 1].map(|h| received[h][k * bands + band]), truth.mean[band], truth.standard_error[band]);
        }
    }
    let count = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / count;
    let largest = differences.iter().fold(0.0f64, |a, d| a.max(d.abs()));
    println!("{name:24} {count} values, mean {mean:+.2}, largest {largest:.1} standard errors");
    assert!(count > 30.0, "{name}: {count} values");
    // hundreds of values of nearly normal noise; the mean of independent ones stays within 4/sqrt(count)
    assert!(largest < 6.0, "{name}: {largest}");
    assert!(mean.abs() < 4.0 / count.sqrt(), "{name}: mean {mean}");
}

fn glossy(diffuse: f64, specular: f64, ratio: f64) -> Material {
    Material { gloss: Some(ratio), ..Material::new(diffuse, specular) }
}

#[test]
fn agrees_with_the_twin() {
    agrees(256);
}

#[test]
#[ignore = "minutes: more rays of the twin"]
fn agrees_with_the_twin_of_more_rays() {
    agrees(1024);
}

/// Scenes of all kinds, `rays` rays of the twin at each reflection.
fn agrees(rays: usize) {
    let overcast = || Sky::new(Model::Overcast, 1.0, 0.3);
    let sun = |half: f64| Sun::new(dvec3(0.4, 0.3, 0.8), 2.0, half.to_radians());
    let outside = camera([3.0, 2.6, 2.2], [0.4, 0.4, 0.4], 1.7, 8);
    let mirrors = [Material::new(0.4, 0.4), Material::new(0.1, 0.8), Material::new(0.6, 0.0)];
    let lobes = [glossy(0.2, 0.6, 3.0), glossy(0.3, 0.4, 10.0), Material::new(0.4, 0.0)];
    let spectral = [
        Material::spectral(&[0.6, 0.3, 0.1], &[0.0, 0.3, 0.8]),
        Material::spectral(&[0.2, 0.4, 0.5], &[0.7, 0.3, 0.0]),
        Material::spectral(&[0.0, 0.5, 0.9], &[0.9, 0.2, 0.1]),
    ];
    let spectral_sky = Sky {
        radiance: vec![1.0, 0.7, 0.2],
        ground: vec![0.1, 0.0, 0.5],
        ..Sky::new(Model::Cie { kind: 12, sun: dvec3(0.4, 0.3, 0.8) }, 1.0, 0.0)
    };
    let corner = || scenes::corner(2);
    let above = camera([2.0, 1.6, 3.0], [0.5, 0.5, 0.3], 1.6, 8);
    let blocker = scenes::squares_with_blocker(0.5, [0.25, 0.75, 0.2, 0.6]);
    let lamp = [Material::new(0.5, 0.2), Material::new(0.4, 0.0).emitting(0.7)];
    // mirrors in many planes over a floor: the judge tries their facets one by one, the twin their directions
    let ball = scenes::sphere(0).scaled(0.4).translated([0.5, 0.5, 0.6]).of_material(1);
    let floor = Mesh { materials: vec![0; 2], ..scenes::tilted_square(0.0) };
    let over_floor = floor.joined(&ball);
    let shiny = [Material::new(0.5, 0.0), Material::new(0.1, 0.8)];
    let cases = [
        ("corner of mirrors", Scene::new(&corner(), &mirrors).sky(overcast()).sun(sun(0.0)), &outside),
        (
            "sheets, penumbra",
            Scene::new(&blocker, &mirrors).sky(overcast()).sun(sun(3.0)).two_sided(true),
            &above,
        ),
        ("three bands", Scene::new(&corner(), &spectral).sky(spectral_sky), &outside),
        ("gloss in the sun", Scene::new(&corner(), &lobes).sky(overcast()).sun(sun(0.5)), &outside),
        ("lamp", Scene::new(&scenes::box_open(1.0, 1.3, 0.8, 1), &lamp), &above),
        ("ball of mirrors, point sun", Scene::new(&over_floor, &shiny).sun(sun(0.0)), &above),
        ("ball of mirrors, disc", Scene::new(&over_floor, &shiny).sky(overcast()).sun(sun(2.0)), &above),
    ];
    // two at once: no other test here takes as long
    std::thread::scope(|scope| {
        for half in [0, 1] {
            let cases = cases.iter().skip(half).step_by(2);
            scope.spawn(move || {
                for (name, scene, camera) in cases {
                    // the twin tries a thousand images of the sun where mirrors lie in many planes
                    let rays = if name.starts_with("ball") { rays / 16 } else { rays };
                    agree(name, scene, camera, rays);
                }
            });
        }
    });
}

#[test]
fn furnace_is_uniform() {
    // rho_d + rho_s = 1 in a sky of 1: radiance 1 wherever one looks
    let scene = Scene::new(&scenes::corner(1), &vec![Material::new(0.5, 0.5); 3])
        .sky(Sky::new(Model::Uniform, 1.0, 1.0))
        .two_sided(true);
    let mut memory = Memory::default();
    let judge = Judge::new(&scene, &mut memory);
    let camera = camera([3.0, 2.6, 2.2], [0.4, 0.4, 0.4], 1.7, 8);
    let halves = judge.image(&camera, 0.0, 1_000_000, 1);
    for half in &halves.values {
        for (pixel, value) in half.iter().enumerate().filter(|(p, _)| halves.hit[*p]) {
            // chance alone ends chains that keep less than a hundredth: no noise but that
            assert!((value - 1.0).abs() < 2e-3, "pixel {pixel}: {value}");
        }
    }
}

#[test]
fn score_is_free_of_the_references_noise() {
    // an image off by d everywhere and a reference whose noise is ten times that
    let (d, noise, pixels) = (0.01, 0.1, 40_000);
    let mut rng = twin::Rng(5);
    // nearly normal: the stated error is that of Gaussian noise, which means of many samples have
    let mut normal = || (0..12).map(|_| rng.unit()).sum::<f64>() - 6.0;
    let mut half = || -> Vec<f64> { (0..pixels).map(|_| 1.0 + noise * normal()).collect() };
    let (a, b) = (half(), half());
    let image = vec![1.0 + d; pixels];
    let found = score(&image, [&a, &b], &vec![true; pixels], &[1.0]);
    // variance of eps^2: (2 d^2 v + v^2)/pixels with v = 0.01
    let error = ((2.0 * d * d * 0.01 + 1e-4) / pixels as f64).sqrt();
    let squared = found.eps * found.eps;
    assert!((squared - d * d).abs() < 4.0 * error, "{squared} +- {error}");
    let stated = found.high * found.high - squared;
    assert!((stated / error - 1.0).abs() < 0.1, "stated {stated}, expected {error}");
}

#[test]
fn same_values_in_every_run() {
    let scene = Scene::new(
        &scenes::corner(2),
        &[Material::new(0.4, 0.4), Material::new(0.1, 0.8), glossy(0.3, 0.4, 9.0)],
    )
    .sky(Sky::new(Model::Overcast, 1.0, 0.3));
    let camera = camera([3.0, 2.6, 2.2], [0.4, 0.4, 0.4], 1.7, 6);
    let run = || {
        let mut memory = Memory::default();
        Judge::new(&scene, &mut memory).image(&camera, 1e-3, 100_000, 3)
    };
    assert_eq!(run(), run());
}
