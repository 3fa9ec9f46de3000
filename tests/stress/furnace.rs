//! The white furnace inside a closed box: emission 1 and reflectance rho fill it with 1/(1 - rho).

use crate::budget::{Allowed, FURNACE, PIXEL, SOLVE, SOLVE_BRIGHT, SOLVE_BRIGHTEST};
use crate::case::{Case, perspective, within};
use crate::support::scenes;
use crate::support::twin::Material;
use blik_kernel::chain::{RaySample, Terms};
use blik_kernel::ray::Ray;
use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// A closed box of reflectance `diffuse` + `specular`: the worst relative error of the facets' diffuse radiances and of
/// the pixels, the estimate relative to the radiance, and the sweeps.
fn box_of(diffuse: f64, specular: f64) -> (f64, f64, f64, u32) {
    let rho = diffuse + specular;
    let case = Case::new(scenes::cube_inside(), &[Material::new(diffuse, specular).emitting(1.0)]);
    let camera = perspective([0.3, 0.4, 0.6], [0.9, 0.7, 0.35], 100.0, 10);
    let outcome = case.run(2, &within(1e-3), &camera);
    let all = 1.0 / (1.0 - rho);
    // what arrives is uniform; a facet's own diffuse radiance is what its mirror does not add
    let own = outcome.sides.iter().map(|s| (s.irradiance[0] / PI / all - 1.0).abs());
    let pixels = outcome.image.pixels.iter().map(|p| (f64::from(*p) / all - 1.0).abs());
    let report = &outcome.image.report;
    // relative to the reference radiance: what the walls' emission lights
    let estimate = report.error_estimate * report.reference_radiance[0] / all;
    (own.fold(0.0, f64::max), pixels.fold(0.0, f64::max), estimate, report.sweeps)
}

#[test]
fn a_closed_box_is_a_white_furnace() {
    closed_boxes(&[0.0, 0.5, 0.99]);
}

#[test]
#[ignore = "half a minute: more shares of mirrors"]
fn closed_boxes_are_white_furnaces() {
    closed_boxes(&[0.01, 0.1, 0.2, 0.7, 0.9, 0.999]);
}

/// Boxes that mirror these shares of what they reflect.
fn closed_boxes(shares: &[f64]) {
    let brightness = [(0.999, SOLVE), (1.0 - 1e-6, SOLVE_BRIGHT), (1.0 - 1e-9, SOLVE_BRIGHTEST)];
    for (rho, Allowed { error: allowed, .. }) in brightness {
        for &share in shares {
            let (facets, pixels, estimate, sweeps) = box_of(rho * (1.0 - share), rho * share);
            let what = format!("1 - rho {:.0e}, of which mirror {share}", 1.0 - rho);
            println!(
                "{what}: facets {facets:.1e}, pixels {pixels:.1e}, estimate {estimate:.1e}, {sweeps} sweeps"
            );
            assert!(facets <= allowed && pixels <= allowed, "{what}: {facets:.1e} {pixels:.1e}");
            // the estimate is one of the exact pixels
            assert!(pixels <= estimate + PIXEL.error, "{what}: {pixels:.1e}, estimated {estimate:.1e}");
            assert!(sweeps <= 400, "{what}: {sweeps} sweeps");
        }
    }
}

#[test]
fn chains_that_meet_edges_and_corners_stay_within() {
    // mirrors all around: a chain that slips out between two of them comes back dark
    let rho = 0.9;
    let mesh = scenes::cube_inside().translated([-0.5; 3]).scaled(2.0);
    let case = Case::new(mesh, &[Material::new(0.05, rho - 0.05).emitting(1.0 - rho)]);
    let steps = [-1.0, -0.75, -0.5, 0.0, 0.25, 0.5, 1.0];
    case.with_lit(2, &within(1e-2), |_, lit| {
        let solved = lit.solved();
        for origin in [DVec3::ZERO, dvec3(0.25, 0.0, 0.0), dvec3(0.5, -0.25, 0.125)] {
            for (x, y, z) in
                steps.iter().flat_map(|x| steps.iter().flat_map(move |y| steps.map(|z| (*x, *y, z))))
            {
                // toward a grid on the walls: their corners, edges, diagonals
                let aim = dvec3(x, y, z) - origin;
                if aim.abs().max_element() == 0.0 {
                    continue;
                }
                let ray = Ray::new(solved.scene.to_scene(origin), aim.normalize());
                let mut terms = Terms::ZERO;
                solved.radiance(&ray, RaySample::Integrate(1), &mut terms);
                let off = (terms.sum(0) - 1.0).abs();
                assert!(off <= FURNACE.error, "from {origin} to {x} {y} {z}: off by {off:.1e}");
            }
        }
    });
}
