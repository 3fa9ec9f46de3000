//! One test for each mistake that methods of this kind are known to make; each fails where the mistake is built in.

#[path = "support/case.rs"]
mod case;
#[path = "support/judge/mod.rs"]
mod judge;
mod support;

use blik_kernel::Error;
use blik_kernel::arena::Memory;
use blik_kernel::camera::{CameraInput, Sampling};
use blik_kernel::form_factor::point_to_polygon;
use blik_kernel::host::Settings;
use blik_kernel::math::Vec3;
use blik_kernel::sky::{SkyModel, SkyTable};
use case::{Case, SkyOf, SunOf, orthographic, perspective, within};
use glam::{DVec3, dvec3};
use judge::Judge;
use std::f64::consts::{FRAC_PI_4, PI, TAU};
use support::scenes::{self, Mesh};
use support::twin::{Material, Scene, lobe};

const TOLERANCE: f64 = 2e-3;

/// Irradiances of the first band, by facet and side; of black facets too.
fn irradiances(case: &Case) -> Vec<f64> {
    let settings = Settings { all_irradiances: true, ..within(TOLERANCE) };
    case.with_lit(0, &settings, |_, lit| case::sides(lit).iter().map(|s| s.irradiance[0]).collect())
}

/// The image's pixels, first band.
fn pixels(case: &Case, camera: &CameraInput) -> Vec<f64> {
    case.run(0, &within(TOLERANCE), camera).image.pixels.iter().map(|&p| f64::from(p)).collect()
}

/// A floor of 2 x 3 (front up) whose edge x = 0 carries a unit wall, front toward +x; materials 0 and 1.
fn floor_and_wall() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(0.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 3.0, 4, 0);
    mesh.rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z, 1, 1);
    mesh
}

// 1: the sun counted twice

#[test]
fn rays_that_look_for_the_sky_do_not_see_the_sun_again() {
    // the wall asks for rays from the floor, and the large disc would be met by many of them
    let (e, up) = (2.0, 0.8);
    let black = [Material::new(0.5, 0.0), Material::new(0.0, 0.0)];
    let case = Case::new(floor_and_wall(), &black).sun(SunOf::new([0.6, 0.0, up], &[e], 10.0));
    for value in &irradiances(&case)[..32] {
        // nothing shades the floor: a disc above the horizon gives E cos exactly
        assert!((value - e * up).abs() < 1e-6, "{value}");
    }
}

#[test]
fn a_mirror_throws_the_sun_once() {
    let (e, rho) = (1.0, 0.8);
    let materials = [Material::new(0.0, 0.0), Material::new(0.0, rho)];
    let case = Case::new(floor_and_wall(), &materials).sun(SunOf::new([0.8, 0.0, 0.6], &[e], 2.0));
    let received: f64 = irradiances(&case)[..32].iter().map(|v| v * 6.0 / 32.0).sum();
    // straight: E sin(elevation) on 6 units of floor; by the mirror all of what falls on 1 unit of wall
    let truth = e * 0.6 * 6.0 + rho * e * 0.8;
    // a part in two hundred of the beam, which counted twice would add all of it
    assert!((received - truth).abs() < 5e-3 * rho, "{received}, not {truth}");
}

#[test]
fn a_lobe_shows_the_sun_once() {
    let (ratio, rho, e) = (1.5, 0.6, 1.0);
    let material = Material { gloss: Some(ratio), ..Material::new(0.0, rho) };
    // a wide lobe seen from some 23 degrees off the mirror direction: several of its rays would meet a disc this large
    let case =
        Case::new(scenes::tilted_square(0.0), &[material]).sun(SunOf::new([0.0, 0.0, 1.0], &[e], 10.0));
    let camera = orthographic([2.0, 0.5, 12f64.sqrt()], [0.5, 0.5, 0.0], 0.2, 2);
    let eye = dvec3(1.5, 0.0, 12f64.sqrt()).normalize();
    let truth = rho * e * lobe(ratio, eye.z);
    for value in pixels(&case, &camera) {
        // the lobe bends a little over the disc; the disc seen again would add as much again
        assert!((value / truth - 1.0).abs() < 0.05, "{value}, not {truth}");
    }
}

// 2: a facet that hides itself, and one that does not see itself in mirrors

#[test]
fn no_facet_hides_itself() {
    // far off the origin, small, narrow, in all directions, both sides alike; a speck far away asks for rays
    let mut mesh = Mesh::default();
    for k in 0..12 {
        let turn = dvec3(1.0 + k as f64, 2.3 * k as f64 - 9.0, 1.7 * k as f64 - 8.0).normalize();
        let across = turn.any_orthonormal_vector();
        mesh.rectangle(dvec3(5.0 * k as f64, 0.0, 0.0), turn * 0.3, across * 10f64.powi(-(k % 4)), 1, 0);
    }
    let mesh = mesh.mapped(|v| v + dvec3(4.1e6, -2.2e6, 4.5e6));
    let case = Case::new(mesh, &[Material::new(0.5, 0.0)]).two_sided().sky(SkyOf::uniform(1));
    for value in irradiances(&case) {
        // each sees of the others and their light less than 2 % of its hemisphere
        assert!((value / PI - 1.0).abs() < 0.02, "{}", value / PI);
    }
}

#[test]
fn a_facet_sees_itself_in_a_mirror() {
    // a facet that shines, a mirror at 45 degrees: all that arrives is the facet's own light
    let materials = [Material::new(0.5, 0.0).emitting(1.0), Material::new(0.0, 0.9)];
    let mesh = scenes::wedge(FRAC_PI_4);
    let mine = irradiances(&Case::new(mesh.clone(), &materials));
    let scene = Scene::new(&mesh, &materials);
    let mut memory = Memory::default();
    let halves = Judge::new(&scene, &mut memory).irradiances(&[(0, true), (1, true)], 1 << 14, 1);
    for facet in 0..2 {
        let truth = (halves[0][facet] + halves[1][facet]) / 2.0;
        assert!(truth > 0.3, "{truth}: the facet sees itself");
        // constant light on either half of the square costs 1 %; no light of its own would cost half
        assert!((mine[facet] / truth - 1.0).abs() < 0.02, "facet {facet}: {}, not {truth}", mine[facet]);
    }
}

// 3: facets that rise above the horizon in part

#[test]
fn factors_stop_at_the_horizon() {
    let faces: Vec<Vec<Vec3>> = (0..6).map(|face| scenes::cube_inside().corners(2 * face).to_vec()).collect();
    let quads: Vec<Vec<Vec3>> = (0..6)
        .map(|face| {
            let [a, b, c] = [faces[face][0], faces[face][1], faces[face][2]];
            vec![a, b, c, a + c - b]
        })
        .collect();
    for k in 0..200 {
        let t = |step: f64| (k as f64 * step).fract();
        let point = Vec3::new(0.1 + 0.8 * t(0.618), 0.1 + 0.8 * t(0.7549), 0.1 + 0.8 * t(0.5698));
        let normal = (Vec3::new(t(0.3247), t(0.8191), t(0.671)) - 0.5).normalize();
        // from within a closed box every direction ends on a wall, and most walls cross the horizon
        let sum: f64 = quads.iter().map(|q| point_to_polygon(point, normal, q)).sum();
        assert!((sum - 1.0).abs() < 1e-11, "{point} {normal}: {sum}");
    }
}

#[test]
fn what_lies_below_the_horizon_hides_no_sky() {
    let wall = |low: f64| {
        let mut mesh = Mesh::default();
        mesh.rectangle(dvec3(0.0, 0.0, 0.0), DVec3::X, DVec3::Y, 1, 0);
        mesh.rectangle(dvec3(1.2, -0.5, low), DVec3::Z * (1.0 - low), DVec3::Y * 2.0, 1, 1);
        mesh
    };
    let black = [Material::new(0.5, 0.0), Material::new(0.0, 0.0)];
    let mean = |mesh: Mesh| {
        let all = irradiances(&Case::new(mesh, &black).sky(SkyOf::uniform(1)));
        (all[0] + all[1]) / TAU
    };
    let (whole, upper) = (mean(wall(-3.0)), mean(wall(0.0)));
    assert!(upper < 0.93, "{upper}: the wall is in sight");
    // both to within their rays
    assert!((whole - upper).abs() < TOLERANCE, "{whole}, not {upper}");
}

// 4 and 5: shares that do not add up to 1, chains and bounces that end too soon

#[test]
fn nearly_perfect_mirrors_keep_the_furnace() {
    // seen at 10 degrees over the rim of a shaft, the sky is some 65 mirrors of 0.99 away: they leave half of it
    let mesh = scenes::box_open(1.0, 1.0, 6.0, 2);
    let case = Case::new(mesh, &vec![Material::new(0.01, 0.99); 2]).sky(SkyOf::uniform(1));
    let (sin, cos) = (PI / 18.0).sin_cos();
    let camera = orthographic([1.0 - 5.0 * cos, 0.47, 5.93 + 5.0 * sin], [1.0, 0.53, 5.93], 0.06, 8);
    for value in pixels(&case, &camera) {
        // every path of light ends in a sky of 1; three tolerances for a single pixel
        assert!((value - 1.0).abs() < 3.0 * TOLERANCE, "{value}");
    }
}

#[test]
fn no_reflection_is_the_last() {
    // a closed room that emits 1 and reflects 0.8 shines with 1/(1 - 0.8); four bounces make 3.4 of these 5
    for material in [Material::new(0.8, 0.0), Material::new(0.4, 0.4), Material::new(0.0, 0.8)] {
        let case = Case::new(scenes::cube_inside(), &[material.emitting(1.0)]);
        let camera = perspective([0.3, 0.4, 0.6], [0.8, 0.9, 0.1], 60.0, 6);
        for value in pixels(&case, &camera) {
            // three tolerances of the reference radiance, 1, for a single pixel
            assert!((value - 5.0).abs() < 3.0 * TOLERANCE, "{value}");
        }
    }
}

// 6: reflectances above 1 in one band, sweeps that stop before they converge

#[test]
fn every_band_of_every_material_reflects_at_most_all() {
    let good = Material::spectral(&[0.5, 0.5, 0.3], &[0.5, 0.5, 0.2]);
    let bad = Material::spectral(&[0.5, 0.5, 0.3], &[0.5, 0.5, 0.701]);
    for (materials, fits) in [([good.clone(), good.clone()], true), ([good, bad], false)] {
        let case = Case::new(floor_and_wall(), &materials);
        let result = case.with_input(|input| {
            let bytes = blik_kernel::scene::Scene::bytes(input)?;
            let mut memory = Memory::new(bytes);
            blik_kernel::scene::Scene::new(input, memory.bytes_mut()).map(|_| ())
        });
        // sums of exactly 1 are allowed
        assert_eq!(result.is_ok(), fits, "{result:?}");
        assert!(
            fits || matches!(result, Err(Error::ReflectanceSum { material: 1, band: 2, .. })),
            "{result:?}"
        );
    }
}

/// A share of single precision and the one nearest to 1 minus it make up more than 1 by rounding: they are a perfect
/// reflector, which in a sky of 1 has the radiance 1.
#[test]
fn reflectances_of_single_precision_make_up_one() {
    let mut rng = support::twin::Rng(8);
    let mut above = 0;
    for _ in 0..200 {
        let diffuse = rng.unit() as f32;
        let specular = 1.0 - diffuse;
        // as programs write them: to the bit, or with nine digits
        let [d, s] = if rng.unit() < 0.5 {
            [f64::from(diffuse), f64::from(specular)]
        } else {
            [diffuse, specular].map(|x| format!("{x:.7}").parse::<f64>().unwrap())
        };
        let [d, s] = [d, s].map(|x| x * (1.0 + (rng.unit() - 0.3) * 2f64.powi(-24)));
        above += u32::from(d + s > 1.0);
        let case = Case::new(floor_and_wall(), &[Material::new(d, s), Material::new(0.2, 0.0)]);
        case.with_input(|input| {
            let mut memory = Memory::new(blik_kernel::scene::Scene::bytes(input).unwrap());
            let scene = blik_kernel::scene::Scene::new(input, memory.bytes_mut()).unwrap();
            let sum = scene.diffuse(0)[0] + scene.specular(0)[0];
            // two quotients and a sum round
            assert!(sum <= 1.0 + 4.0 * f64::EPSILON, "{d} + {s}: {sum}");
            assert!(d + s > 1.0 || (scene.diffuse(0)[0], scene.specular(0)[0]) == (d, s));
        });
    }
    assert!(above > 50, "{above} make up more than 1");
}

#[test]
fn slow_convergence_is_waited_for() {
    // light decays by 0.97 a sweep: 28 sweeps, enough for outdoor scenes, would leave 43 % of it out
    let case = Case::new(scenes::cube_inside(), &[Material::new(0.97, 0.0).emitting(1.0)]);
    let truth = 1.0 / 0.03;
    case.with_lit(0, &within(TOLERANCE), |_, lit| {
        for side in case::sides(lit) {
            // the system's rows close to 1e-6 or so, magnified by 1/0.03
            assert!((side.radiance[0] / truth - 1.0).abs() < 1e-3, "{}", side.radiance[0]);
        }
    });
}

// 7 and 10: single samples at jumps

#[test]
fn a_pixel_is_the_mean_of_its_square() {
    let mesh = floor_and_wall()
        .joined(&scenes::cube_outside().scaled(0.4).translated([0.5, 0.2, 0.0]).of_material(1));
    let case = Case::new(mesh, &[Material::new(0.3, 0.0), Material::new(0.1, 0.8)])
        .sky(SkyOf::new(SkyModel::Hemisphere, &[1.0], &[0.0]))
        .sun(SunOf::new([0.5, -0.3, 0.8], &[2.0], 0.0));
    let image = |n: usize, sampling: Sampling| {
        let camera = CameraInput { sampling, ..orthographic([4.0, -3.0, 2.0], [0.7, 0.4, 0.2], 2.0, n) };
        pixels(&case, &camera)
    };
    let coarse = image(24, Sampling::Area);
    let fine = image(96, Sampling::Area);
    let mean = |p: usize| {
        let (row, column) = (p / 24, p % 24);
        let part = |k: usize| fine[(4 * row + k / 4) * 96 + 4 * column + k % 4];
        (0..16).map(part).sum::<f64>() / 16.0
    };
    let rms = |image: &[f64]| {
        (image.iter().enumerate().map(|(p, v)| (v - mean(p)).powi(2)).sum::<f64>() / 576.0).sqrt()
    };
    let (area, centre) = (rms(&coarse), rms(&image(24, Sampling::Centre)));
    // the reference radiance is 1 + 2/pi
    assert!(area < 2.0 * TOLERANCE * 1.64, "{area}");
    assert!(centre > 10.0 * area, "{centre}: edges matter in this view");
}

#[test]
fn a_strip_between_the_centres_of_pixels_is_seen() {
    // a shining strip of 0.6 pixels across the image, so little off its rows that it passes between twenty centres at a time
    let n = 40;
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-3.0, -3.0, 0.0), DVec3::X * 6.0, DVec3::Y * 6.0, 1, 0);
    let (along, across) = (dvec3(1.6, 0.04, 0.0), DVec3::Y * 0.03 / 0.8);
    mesh.rectangle(dvec3(-0.8, -0.02, 1e-4), along, across, 1, 1);
    let materials = [Material::new(0.5, 0.0), Material::new(0.0, 0.0).emitting(1.0)];
    let case = Case::new(mesh, &materials).sky(SkyOf::uniform(1));
    let camera =
        CameraInput { sampling: Sampling::Area, ..orthographic([0.0, -3.0, 4.0], [0.0, 0.0, 0.0], 2.0, n) };
    let beyond: f64 = pixels(&case, &camera).iter().map(|l| l - 0.5).sum();
    // the strip is seen at a cosine of 0.8; a pixel's side is 0.05
    let exact = 0.5 * along.cross(across).length() * 0.8 / (0.05 * 0.05);
    // each of some fifty pixels may be off by the tolerance, and those that the strip does not meet by what shades the floor
    assert!((beyond / exact - 1.0).abs() < 0.05, "{beyond} of {exact}");
}

// 8: quadratures across the horizon's step

#[test]
fn half_a_sky_gives_half_the_light() {
    // two upright squares face each other, alike above and below: a sky down to the horizon gives half of a whole one's
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(0.0, -0.5, -0.5), DVec3::Y, DVec3::Z, 1, 0);
    mesh.rectangle(dvec3(0.7, -0.5, -0.5), DVec3::Z, DVec3::Y, 1, 1);
    let black = [Material::new(0.5, 0.0), Material::new(0.0, 0.0)];
    let mean = |sky: SkyOf| {
        let all = irradiances(&Case::new(mesh.clone(), &black).sky(sky));
        (all[0] + all[1]) / TAU
    };
    let whole = mean(SkyOf::uniform(1));
    let half = mean(SkyOf::new(SkyModel::Hemisphere, &[1.0], &[0.0]));
    // a quadrature of some ten rings that does not split at the step is off by several parts in a hundred
    assert!((half - whole / 2.0).abs() < TOLERANCE, "{half}, not half of {whole}");
}

// 9: angles that wrap

#[test]
fn factors_do_not_depend_on_the_azimuth() {
    // a large square close above a point: its edges span up to 90 degrees of azimuth, its corners nearly touch the horizon
    for height in [1e-3, 0.1, 1.0] {
        let x = 0.5 / height;
        let s = f64::sqrt(1.0 + x * x);
        // a rectangle's corner above the point (Hamilton and Morgan 1952), four times
        let truth = 4.0 / TAU * 2.0 * x / s * (x / s).atan();
        for k in 0..720 {
            let (sin, cos) = (k as f64 * PI / 360.0).sin_cos();
            // front down: clockwise seen from above
            let square = [[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]]
                .map(|[a, b]| Vec3::new(a * cos - b * sin, a * sin + b * cos, height));
            let factor = point_to_polygon(Vec3::ZERO, Vec3::Z, &square);
            assert!((factor - truth).abs() < 1e-12, "{height}, {k}: {factor}, not {truth}");
        }
    }
}

#[test]
fn a_sky_table_has_no_seam() {
    // the same sky with its first column at another azimuth each time
    let (rows, columns) = (4, 6);
    let value = |row: usize, column: usize| ((row * 5 + column * column * 3) % 11) as f32 / 5.0;
    let mesh = scenes::corner(2);
    let view = orthographic([3.0, 2.6, 2.2], [0.4, 0.4, 0.4], 1.7, 16);
    let materials = [Material::new(0.4, 0.2), Material::new(0.1, 0.8), Material::new(0.6, 0.0)];
    let image = |shift: usize| {
        let samples: Vec<f32> =
            (0..rows * columns).map(|k| value(k / columns, (k % columns + shift) % columns)).collect();
        let (sin, cos) = (TAU * shift as f64 / columns as f64).sin_cos();
        let azimuth_zero = Some([cos, sin, 0.0]);
        let table = SkyTable { rows, columns, bands: 1, radiance: samples.leak(), azimuth_zero };
        pixels(
            &Case::new(mesh.clone(), &materials).sky(SkyOf::new(SkyModel::Table(table), &[1.0], &[0.0])),
            &view,
        )
    };
    let first = image(0);
    for shift in 1..columns {
        for (a, b) in image(shift).iter().zip(&first) {
            // f32 pixels
            assert!((a - b).abs() < 1e-5, "{shift}: {a}, not {b}");
        }
    }
}

// what stands under a body counted in the mean of what shows beside it

#[test]
fn only_what_shows_of_a_floor_counts() {
    let mut mesh = Mesh::default();
    mesh.rectangle(dvec3(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, 1, 0);
    // a leaning box through the floor, whose section there is a parallelogram of 0.6 x 0.49
    let lean = |p: DVec3| dvec3(-0.27 + 0.6 * p.x + 0.3 * p.z, -0.31 + 0.49 * p.y, p.z - 0.5);
    mesh = mesh.joined(&scenes::cube_outside().mapped(lean).of_material(1));
    let case = Case::new(mesh, &[Material::new(1.0, 0.0), Material::new(0.0, 0.0)]).sky(SkyOf::uniform(1));
    let shown = case.with_geometry(0, &within(3e-2), |_, geometry| {
        let (elements, coupling) = (geometry.elements(), geometry.coupling().unwrap());
        let of = |u: usize| elements.share(u) * f64::from(coupling.row(u).visible_share);
        (0..2).flat_map(|facet| elements.unknowns_of(facet, 0)).map(of).sum::<f64>() / 2.0
    });
    let truth = 1.0 - 0.6 * 0.49 / 4.0;
    // elements at the box's edge are a tenth of the floor, each off by its 64 rays' noise of 4 %; whole sixteenths of them,
    // which are taken to lie inside if most of their rays do, would bring 2 % of the floor
    assert!((shown - truth).abs() < 6e-3, "{shown}, not {truth}");
}
