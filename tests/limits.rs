//! The limits of the method: without mirrors it is the radiosity system of eq. 3, without diffuse facets the chain
//! of eq. 8, bit for bit; and what a scene lacks costs nothing.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::camera::{Camera, CameraInput, Sampling};
use blik_kernel::chain::Solved;
use blik_kernel::host::{Lit, Settings};
use blik_kernel::image::{Target, rows, scratch_bytes};
use blik_kernel::light::{self, Light, TableShape, sky_rows};
use blik_kernel::math::{FRAC_1_PI, PI, Vec3};
use blik_kernel::mirror::OFFSET;
use blik_kernel::radiosity::solution::Solution;
use blik_kernel::radiosity::{System, bound};
use blik_kernel::ray::Ray;
use blik_kernel::sky::{Sky, SkyModel};
use case::{Case, SkyOf, SunOf, orthographic, perspective, within};
use support::scenes::{self, Mesh};
use support::twin::Material;

fn views() -> [CameraInput; 3] {
    let first = orthographic([3.0, 2.0, 2.5], [0.4, 0.5, 0.25], 2.0, 24);
    let area = CameraInput { sampling: Sampling::Area, ..first };
    [first, area, perspective([2.0, 3.0, 1.5], [0.4, 0.5, 0.25], 35.0, 24)]
}

fn skies(bands: usize) -> [SkyOf; 2] {
    let (low, high) = ([0.2, 0.4], [1.0, 0.8]);
    [SkyOf::uniform(bands), SkyOf::new(SkyModel::Gradient, &high[..bands], &low[..bands])]
}

/// Eq. (3) in its plain form, I_k = I0_k + rho_k sum_i phi_ik I_i over all facets i in order, swept from `radiance` until
/// what a sweep changes bounds the error by `goal`; returns the sweeps.
fn plain_radiosity(
    factors: &[Vec<f64>],
    direct: &[f64],
    diffuse: &[f64],
    goal: f64,
    radiance: &mut Vec<f64>,
) -> u32 {
    let row = |k: usize| diffuse[k] * factors[k].iter().sum::<f64>();
    let q = (0..direct.len()).map(row).fold(0.0, f64::max);
    for sweeps in 1.. {
        let of = |k: usize| {
            let bounced: f64 = factors[k].iter().zip(&*radiance).fold(0.0, |sum, (phi, i)| sum + phi * i);
            diffuse[k] * FRAC_1_PI * (direct[k] + PI * bounced)
        };
        let next: Vec<f64> = (0..direct.len()).map(of).collect();
        let change = next.iter().zip(&*radiance).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        *radiance = next;
        if bound(change, q) <= goal {
            return sweeps;
        }
    }
    unreachable!()
}

/// The kernel's image of the case for a given solution of the system.
fn image_of(lit: &Lit<'_>, system: &System<'_>, radiance: &[f64], camera: &CameraInput) -> Vec<f32> {
    let mut irradiance = vec![0.0; system.elements.unknowns() * system.shape.stride()];
    system.gather(0..system.elements.unknowns(), 0, |_| radiance, &mut irradiance).unwrap();
    let solved = lit.solved();
    let solved = Solved { solution: Solution { irradiance: &irradiance, ..solved.solution }, ..solved };
    let camera = Camera::new(camera, system.scene).unwrap();
    let mut image = vec![0.0; camera.columns() * camera.rows()];
    let mut scratch = vec![0; scratch_bytes(&camera, solved.scene, solved.elements).unwrap()];
    let mut target = Target { image: &mut image, components: [&mut [], &mut [], &mut []] };
    rows(&solved, &camera, 0..camera.rows(), &mut target, &mut scratch).unwrap();
    image
}

#[test]
fn without_mirrors_it_is_equation_3() {
    let materials = [0.7, 0.4, 0.1].map(|d| Material::new(d, 0.0));
    for sky in skies(1) {
        let case = Case::new(scenes::corner(2), &materials).sky(sky);
        case.with_lit(2, &within(1e-2), |host, lit| {
            let solved = lit.solved();
            let (scene, elements, shape) =
                (solved.scene, solved.elements, TableShape { levels: 1, bands: 1 });
            let unknowns = elements.unknowns();
            case.with_geometry(1, &within(1e-2), |_, geometry| {
                let coupling = geometry.coupling().unwrap();
                let mut factors = vec![vec![0.0; unknowns]; unknowns];
                for (k, row) in coupling.rows(0..unknowns) {
                    let scale = solved.straight.scale(k, 1, &row.row);
                    row.targets.iter().for_each(|r| factors[k][r.unknown()] += scale * r.weight);
                    assert!(
                        row.escapes.into_iter().all(|b| row.depth(b.path) == 0),
                        "no path by way of a mirror"
                    );
                }
                let light = Light::new(Some(&case.sky.as_ref().unwrap().input()), None, 1).unwrap();
                let mut table = vec![0.0; 3 * unknowns];
                let sky = light.sky.as_ref().unwrap();
                let straight = solved.straight;
                let sky = (sky, &straight);
                sky_rows(scene, elements, &coupling, sky, 5e-4, 0..unknowns, shape, &mut table).unwrap();
                let direct: Vec<f64> = table.iter().step_by(3).copied().collect();
                let diffuse: Vec<f64> =
                    (0..unknowns).map(|k| scene.diffuse(scene.material(elements.facet_of(k).0))[0]).collect();
                // solved twice: the second time from the first solution, with what its slopes add
                let goal = 1e-3 * 1e-2 * lit.reference()[0];
                let mut radiance = vec![0.0; unknowns];
                let mut sweeps = plain_radiosity(&factors, &direct, &diffuse, goal, &mut radiance);
                let dark = vec![0.0; unknowns];
                let of = |table: &[f64], radiance: &[f64]| {
                    let (direct, sun) = (table, &dark[..]);
                    let system = System {
                        scene,
                        elements,
                        coupling: &coupling,
                        light: &light,
                        direct,
                        sun,
                        straight,
                        shape,
                    };
                    let (mut gathered, mut missed) = (vec![0.0; 3 * unknowns], vec![0.0; unknowns]);
                    system.gather(0..unknowns, 0, |_| radiance, &mut gathered).unwrap();
                    system.gradient_source(0..unknowns, &gathered, &mut missed);
                    missed
                };
                let missed = of(&table, &radiance);
                assert!(missed.iter().any(|m| *m != 0.0));
                light::add(&missed, shape, &mut table);
                let direct: Vec<f64> = table.iter().step_by(3).copied().collect();
                sweeps += plain_radiosity(&factors, &direct, &diffuse, goal, &mut radiance);
                assert_eq!(lit.report().sweeps, sweeps);
                let (direct, sun) = (&table[..], &dark[..]);
                let system = System {
                    scene,
                    elements,
                    coupling: &coupling,
                    light: &light,
                    direct,
                    sun,
                    straight,
                    shape,
                };
                for camera in views() {
                    let image = host.image(lit, &camera, true).unwrap();
                    assert_eq!(image.pixels, image_of(lit, &system, &radiance, &camera), "bit for bit");
                    assert!(image.pixels.iter().any(|&p| p > 0.1 && p != 1.0), "something is seen");
                    check_terms(&image.components.unwrap(), &image.pixels, camera.sampling);
                }
            });
        });
    }
}

/// The mirrors' terms are exactly 0, but for the sky behind the object.
fn check_terms([diffuse, mirror_sky, mirror_diffuse]: &[Vec<f32>; 3], pixels: &[f32], sampling: Sampling) {
    assert!(mirror_diffuse.iter().all(|&x| x == 0.0));
    if sampling == Sampling::Centre {
        for (p, (d, s)) in pixels.iter().zip(diffuse.iter().zip(mirror_sky)) {
            assert!(p == d && *s == 0.0 || p == s && *d == 0.0, "{p} is {d} or {s}");
        }
    }
}

#[test]
fn a_lobe_that_reflects_nothing_changes_no_bit() {
    let plain = [0.7, 0.4, 0.1].map(|d| Material::new(d, 0.0));
    let lobes = plain.clone().map(|m| Material { gloss: Some(10.0), ..m });
    let [first, second] = [plain, lobes].map(|materials| {
        Case::new(scenes::corner(2), &materials).sky(skies(1)[1].clone()).run(2, &within(1e-2), &views()[1])
    });
    assert_eq!(first.pixel_bits(), second.pixel_bits());
    assert_eq!(first.image.report.rays, second.image.report.rays);
}

/// Eq. (8) along one ray, in the kernel's arithmetic: the sky where the chain leaves, times all mirrors before; and
/// how many they are.
fn mirror_chain(lit: &Lit<'_>, sky: &Sky<'_>, mut ray: Ray, bands: usize) -> (Vec<f64>, u32) {
    let solved = lit.solved();
    let (mut product, mut mirrors) = (vec![1.0; bands], 0);
    while let Some(hit) = solved.bvh.closest(&ray) {
        let facet = hit.facet as usize;
        if !hit.front {
            return (vec![0.0; bands], mirrors);
        }
        mirrors += 1;
        product
            .iter_mut()
            .zip(solved.scene.specular(solved.scene.material(facet)))
            .for_each(|(p, rho)| *p *= rho);
        let ([a, b, c], n) = (solved.scene.corners()[facet], solved.scene.normals()[facet]);
        let point: Vec3 = a + (b - a) * hit.u + (c - a) * hit.v;
        let direction = ray.direction - n * (2.0 * ray.direction.dot(n));
        ray = Ray { skip: hit.facet, ..Ray::new(point + n * OFFSET, direction) };
    }
    let mut radiance = vec![0.0; bands];
    sky.radiance(ray.direction, &mut radiance);
    (product.iter().zip(&radiance).map(|(p, l)| p * l).collect(), mirrors)
}

#[test]
fn without_diffuse_facets_it_is_equation_8() {
    let pairs = [[0.9, 0.5], [0.6, 1.0], [0.8, 0.3]];
    let materials = pairs.map(|s| Material::spectral(&[0.0; 2], &s));
    let pieces = scenes::corner(1).joined(&scenes::sphere(1).scaled(0.2).translated([0.4, 0.45, 0.5]));
    for sky in skies(2) {
        let case = Case::new(pieces.clone(), &materials).sky(sky);
        // no chain of this scene is cut: after 20 mirrors of 0.9 it may still bring 0.1
        case.with_lit(2, &within(1e-3), |host, lit| {
            let sky = Sky::new(&case.sky.as_ref().unwrap().input(), 2).unwrap();
            for input in [views()[0], views()[2]] {
                let image = host.image(lit, &input, true).unwrap();
                let camera = Camera::new(&input, lit.solved().scene).unwrap();
                let mut chained = 0;
                for (k, pixel) in image.pixels.chunks_exact(2).enumerate() {
                    let (i, j) = (k / input.columns, k % input.columns);
                    let (truth, mirrors) =
                        mirror_chain(lit, &sky, camera.ray(j as f64 + 0.5, i as f64 + 0.5), 2);
                    assert_eq!(pixel, [truth[0] as f32, truth[1] as f32], "row {i}, column {j}, bit for bit");
                    chained += usize::from(mirrors >= 2);
                }
                assert!(chained > 50, "{chained} chains of two mirrors and more");
                assert_eq!(image.report.certified.chain_tail, 0.0);
                let components = image.components.unwrap();
                assert!(components[0].iter().chain(&components[2]).all(|&x| x == 0.0), "no diffuse light");
            }
        });
    }
}

/// Skips of a name in the report.
fn skipped(lit: &Lit<'_>, name: &str) -> u64 {
    lit.report().skipped.iter().filter(|s| s.0 == name).map(|s| s.1).sum()
}

#[test]
fn no_mirrors_no_chains() {
    let case = Case::new(scenes::corner(2), &vec![Material::new(0.5, 0.0); 3]).sky(SkyOf::uniform(1));
    let report = case.run(2, &within(1e-2), &views()[0]).image.report;
    let rays = report.rays;
    assert_eq!((rays.chain, rays.sun), (0, 0), "{rays:?}");
    assert!(rays.primary >= 24 * 24 && rays.visibility > 0);
    // three walls that nothing hides: where directions are not asked for, their pairs are in closed form
    let plain = case.run(2, &Settings { directional: false, ..within(1e-2) }, &views()[0]).image.report;
    assert!(plain.rays.visibility == 0 && plain.pairs.sampled > 0);
    let lines = |name: &str| report.skipped.iter().filter(|s| s.0 == name).map(|s| s.1).sum::<u64>();
    assert_eq!(lines("facets that end every chain"), 24);
    let rows = report.elements as u64;
    for light in ["rows without a sun", "rows of a uniform sky, by closure"] {
        assert!(lines(light) >= rows, "{:?}", report.skipped);
    }
    assert!(lines("pixels beside the object") > 0, "{:?}", report.skipped);
}

#[test]
fn no_diffuse_facets_no_rows() {
    let case = Case::new(scenes::corner(2), &vec![Material::new(0.0, 0.5); 3])
        .sky(SkyOf::uniform(1))
        .sun(SunOf::new([0.5, 0.7, 0.9], &[1.0], 0.0));
    case.with_lit(2, &within(1e-2), |_, lit| {
        let report = lit.report();
        assert_eq!(skipped(lit, "black or degenerate rows"), report.elements as u64);
        assert_eq!((report.rays.visibility, report.pairs.sampled, report.elements), (0, 0, 24));
        // no facet takes up what mirrors throw: at most 256 shadow rays a facet, none of the beams
        assert!(report.rays.sun <= 24 * 256, "{} rays toward the sun", report.rays.sun);
    });
    // where irradiances are asked for, no side is skipped
    let all = Settings { all_irradiances: true, ..within(1e-2) };
    case.with_lit(2, &all, |_, lit| {
        assert_eq!(skipped(lit, "black or degenerate rows"), 0);
        assert!(lit.report().rays.visibility > 0);
        lit.facets(|facet, _, _, irradiance, _| assert!(irradiance[0] > 0.0, "facet {facet}"));
    });
}

#[test]
fn a_black_facet_among_others_needs_no_row() {
    let materials = [Material::new(0.5, 0.3), Material::new(0.0, 0.0), Material::new(0.0, 0.4)];
    let case = Case::new(scenes::corner(2), &materials).sky(SkyOf::uniform(1));
    case.with_lit(2, &within(1e-2), |_, lit| assert_eq!(skipped(lit, "black or degenerate rows"), 16));
}

#[test]
fn no_sun_no_sun_rays_and_no_sky_no_light() {
    let case = Case::new(scenes::corner(2), &vec![Material::new(0.4, 0.4); 3]);
    let dark = case.run(2, &within(1e-2), &views()[1]);
    assert!(dark.image.pixels.iter().all(|&p| p == 0.0), "neither sky nor sun nor emission");
    // what rounding to f32 may bring is always told
    assert_eq!((dark.image.report.rays.sun, dark.image.report.error_estimate), (0, 1e-7));
    // the sun on facets that all face away costs no ray
    let away = case.sun(SunOf::new([-1.0, -1.0, -1.0], &[1.0], 0.2665)).run(2, &within(1e-2), &views()[1]);
    assert_eq!(away.image.report.rays.sun, 0);
}

#[test]
fn a_convex_body_needs_no_rays() {
    let body: Mesh = scenes::sphere(1);
    let facets = body.facets.len() as u64;
    let case = Case::new(body, &[Material::new(0.5, 0.0)]).sky(SkyOf::uniform(1));
    case.with_lit(2, &within(1e-3), |_, lit| {
        assert_eq!(skipped(lit, "rows open to the sky alone"), facets);
        assert_eq!((lit.report().rays.visibility, lit.report().pairs.sampled), (0, 0));
    });
}

#[test]
fn a_uniform_sky_needs_no_directions() {
    let case = Case::new(scenes::corner(2), &vec![Material::new(0.4, 0.4); 3]).sky(SkyOf::uniform(1));
    let settings = Settings { directional: false, ..within(1e-2) };
    let (with, without) = (case.run(2, &within(1e-2), &views()[0]), case.run(2, &settings, &views()[0]));
    // all in closed form, and a tenth of the elements' error
    let fine = Settings { directional: false, ..within(1e-3) };
    let truth = case.run(2, &fine, &views()[0]);
    assert!(truth.image.report.error_estimate < 2e-3, "{}", truth.image.report.error_estimate);
    for ((a, b), exact) in with.image.pixels.iter().zip(&without.image.pixels).zip(&truth.image.pixels) {
        // rays on one side, closed forms on the other: both within the tolerance, and so is what they both leave out
        assert!((a - exact).abs() < 1e-2 && (b - exact).abs() < 1e-2, "{a} {b} {exact}");
    }
    assert!(without.lit.bytes.coupling < with.lit.bytes.coupling);
}
