//! The white furnace: where everything reflects all light and the sky is 1, nothing can be told from the sky.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::camera::{CameraInput, Sampling};
use case::{Case, SkyOf, orthographic, perspective, within};
use std::f64::consts::PI;
use support::scenes;
use support::twin::Material;

/// Diffuse, mirror, mixed, and mostly mirror: each reflects all light.
fn white() -> [Material; 4] {
    [(1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.1, 0.9)].map(|(d, s)| Material::new(d, s))
}

/// Every pixel of the case is `truth`, and so is every side's irradiance over pi.
///
/// Beside what chains and couplings may be `cut` by, the f32 pixel and the gradients in f32 add 2e-6.
#[track_caller]
fn all_is(what: &str, case: &Case, (tolerance, cut): (f64, f64), camera: &CameraInput, truth: f64) {
    let outcome = case.run(2, &within(tolerance), camera);
    let slack = cut * tolerance + 2e-6 * truth;
    let worst = outcome.image.pixels.iter().map(|p| (f64::from(*p) - truth).abs()).fold(0.0, f64::max);
    println!("{what}: pixels off by {worst:.1e}, allowed {slack:.1e}");
    assert!(worst <= slack, "{what}: a pixel is off by {worst:.2e}, allowed {slack:.2e}");
    let sides = 1 + usize::from(case.two_sided);
    for (place, side) in outcome.sides.iter().enumerate() {
        let material = case.mesh.materials.get(side.facet).copied().unwrap_or(0);
        // sides that reflect nothing diffusely have no row; the backs of a room without a sky are in the dark
        let has_row = case.materials[material as usize].diffuse[0] > 0.0;
        let is_lit = place % sides == 0 || case.sky.is_some();
        let expected = if has_row && is_lit { truth } else { 0.0 };
        let off = (side.irradiance[0] / PI - expected).abs();
        assert!(off <= slack, "{what}: facet {} is off by {off:.2e}", side.facet);
    }
    assert!(outcome.image.report.signature.projected_area > 0.0, "{what}: something is seen");
}

/// A tolerance, and the share of it that may be cut: chains below 0.05, which rays beside an element's linear function
/// meet up to a fifth more often; couplings and sweeps below 0.001 each, both magnified by the bounces that follow.
const SAMPLED: (f64, f64) = (1e-2, 0.06);

/// Nothing is cut and nothing is sampled: each facet sees the sky alone.
const EXACT: (f64, f64) = (5e-3, 0.0);

/// Both cameras and both samplings upon the origin's neighbourhood.
fn views(eye: [f64; 3], target: [f64; 3]) -> [CameraInput; 3] {
    let first = orthographic(eye, target, 3.0, 8);
    [first, perspective(eye, target, 40.0, 8), CameraInput { sampling: Sampling::Area, ..first }]
}

#[test]
fn a_convex_white_body_vanishes_in_the_sky() {
    for (name, mesh) in [("cube", scenes::cube_outside()), ("sphere", scenes::sphere(2))] {
        for material in white() {
            let case = Case::new(mesh.clone(), &[material]).sky(SkyOf::uniform(1));
            for camera in views([3.0, 2.0, 2.5], [0.1, 0.2, 0.3]) {
                all_is(name, &case, EXACT, &camera, 1.0);
            }
        }
    }
}

#[test]
fn a_white_corner_vanishes_in_the_sky() {
    // all three materials of the corner the same, then three different ones; from within no back is seen
    for two_sided in [false, true] {
        for materials in white().map(|m| [m.clone(), m.clone(), m]).into_iter().chain([
            [white()[0].clone(), white()[1].clone(), white()[2].clone()],
            [white()[3].clone(), white()[1].clone(), white()[2].clone()],
        ]) {
            let mut case = Case::new(scenes::corner(2), &materials).sky(SkyOf::uniform(1));
            case.two_sided = two_sided;
            for camera in views([2.6, 1.9, 1.4], [0.4, 0.4, 0.4]) {
                all_is("corner", &case, SAMPLED, &camera, 1.0);
            }
        }
    }
}

#[test]
fn a_white_corner_of_two_sides_vanishes_from_behind() {
    let [diffuse, mirror, mixed, _] = white();
    let case = Case::new(scenes::corner(2), &[mixed, mirror, diffuse]).sky(SkyOf::uniform(1)).two_sided();
    for camera in views([-2.6, -1.9, 1.4], [0.4, 0.4, 0.4]) {
        all_is("corner from behind", &case, SAMPLED, &camera, 1.0);
    }
}

#[test]
fn a_closed_room_that_makes_up_for_its_losses_is_uniform() {
    // every facet emits 1 - rho: the radiance is 1 everywhere
    for rho in [0.3, 0.8] {
        for share in [0.0, 0.3, 1.0] {
            for two_sided in [false, true] {
                let material = Material::new(rho * (1.0 - share), rho * share).emitting(1.0 - rho);
                let mut case = Case::new(scenes::cube_inside().subdivided(1), &[material]);
                case.two_sided = two_sided;
                let camera = perspective([0.3, 0.4, 0.6], [0.9, 0.7, 0.35], 100.0, 10);
                // relative to the reference radiance, the emission, which is below the truth
                all_is(&format!("room {rho} {share}"), &case, SAMPLED, &camera, 1.0);
            }
        }
    }
}

#[test]
fn a_room_of_different_materials_is_uniform_too() {
    let pairs = [(0.7, 0.0), (0.0, 0.6), (0.4, 0.3)];
    let materials = pairs.map(|(d, s)| Material::new(d, s).emitting(1.0 - d - s));
    let case = Case::new(scenes::plates_in_pipe(), &materials);
    let camera = perspective([0.3, 0.4, 0.6], [0.9, 0.7, 0.35], 100.0, 10);
    all_is("room of three materials", &case, SAMPLED, &camera, 1.0);
}

#[test]
fn interpolated_normals_keep_the_furnace() {
    // a convex body: the mirror direction, kept above the facet, always meets the sky
    for material in white() {
        let mesh = scenes::sphere(1);
        let mut case = Case::new(mesh.clone(), std::slice::from_ref(&material)).sky(SkyOf::uniform(1));
        case.normals = mesh.vertices;
        for camera in views([3.0, 2.0, 2.5], [0.0; 3]) {
            all_is("smooth sphere", &case, EXACT, &camera, 1.0);
        }
        // and within: mirror chains of bent directions still end on a facet that shines with 1
        let mesh = scenes::sphere(1).flipped();
        let shares = (0.8 * material.diffuse[0], 0.8 * material.specular[0]);
        let mut case = Case::new(mesh.clone(), &[Material::new(shares.0, shares.1).emitting(0.2)]);
        case.normals = mesh.vertices.iter().map(|v| v.map(|x| -x)).collect();
        let camera = perspective([0.1, 0.2, 0.3], [0.8, -0.4, 0.1], 90.0, 8);
        all_is("smooth cavity", &case, SAMPLED, &camera, 1.0);
    }
}

/// A(theta)/rho_0 of the lobe of axis ratio `t`, by PHYSICS: the mean over its energy shares of the part of each
/// cone that lies above the facet. Error below 1e-6: 20000 midpoints of a function with a kink.
fn albedo(t: f64, cos_theta: f64) -> f64 {
    let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
    let steps = 20000;
    let above = |k: usize| {
        let u = (k as f64 + 0.5) / f64::from(steps);
        let sine = ((t.powf(2.0 * u) - 1.0) / (t * t - 1.0)).sqrt();
        let (high, wide) = ((1.0 - sine * sine).sqrt() * cos_theta, sine * sin_theta);
        if high >= wide { 1.0 } else { (-high / wide).acos() / PI }
    };
    (0..steps as usize).map(above).sum::<f64>() / f64::from(steps)
}

#[test]
fn an_isolated_glossy_facet_shows_the_albedo_of_its_lobe() {
    for ratio in [3.0, 10.0, 50.0] {
        for (tilt, rays) in [(0.0, Some(7)), (0.5, Some(7)), (1.2, Some(19)), (1.5, None)] {
            let glossy = Material { gloss: Some(ratio), ..Material::new(0.0, 0.8) };
            let mut case = Case::new(scenes::tilted_square(tilt), &[glossy]).sky(SkyOf::uniform(1));
            case.gloss_rays = rays;
            // from above, in the plate's middle: the view makes the angle `tilt` with the normal
            let (s, c) = tilt.sin_cos();
            let middle = [0.5 * c, 0.5, -0.5 * s];
            let mut camera = orthographic([middle[0], 0.5, 3.0], middle, 0.02, 2);
            camera.up = [0.0, 1.0, 0.0];
            let outcome = case.run(1, &within(2e-3), &camera);
            let truth = 0.8 * albedo(ratio, c);
            for pixel in &outcome.image.pixels {
                // the sum of n equal shares is exact; what is left is the test's own quadrature and f32
                let off = (f64::from(*pixel) - truth).abs();
                assert!(off < 2e-6, "ratio {ratio}, tilt {tilt}: {pixel}, not {truth}");
            }
        }
    }
}
