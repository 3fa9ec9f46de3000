//! Where a mesh lies, how large it is and how it is turned: what it receives is what its rounded corners say.

use crate::budget::PLACED;
use crate::case::{Case, SkyOf, SunOf, sides, within};
use crate::support::scenes;
use crate::support::twin::{Material, Rng};
use blik_kernel::sky::SkyModel;
use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// Sky and sun of the test: a gradient from `GROUND` to `ZENITH` along +z, and a point sun.
const ZENITH: f64 = 1.0;
const GROUND: f64 = 0.25;
const SUN: [f64; 3] = [0.3, -0.5, 0.8];
const IRRADIANCE: f64 = 2.0;

/// Irradiance of an open facet of normal `n`: of a + b d.up over the hemisphere, pi a + 2 pi b/3 n.up; and of the sun.
fn truth(n: DVec3) -> f64 {
    let (a, b) = ((ZENITH + GROUND) / 2.0, (ZENITH - GROUND) / 2.0);
    PI * a + 2.0 * PI / 3.0 * b * n.z + IRRADIANCE * n.dot(DVec3::from(SUN).normalize()).max(0.0)
}

/// The worst relative error of a convex body's facets.
fn worst(case: &Case) -> f64 {
    case.with_lit(2, &within(1e-2), |_, lit| {
        let off = |(facet, side): (usize, crate::case::Side)| {
            let [a, b, c] = case.mesh.corners(facet);
            let truth = truth((b - a).cross(c - a).normalize());
            (side.irradiance[0] / truth - 1.0).abs()
        };
        sides(lit).into_iter().enumerate().map(off).fold(0.0, f64::max)
    })
}

#[test]
fn an_open_body_receives_the_same_wherever_it_is() {
    let mut rng = Rng(5);
    let sky = || SkyOf::new(SkyModel::Gradient, &[ZENITH], &[GROUND]);
    let mut direction = || dvec3(rng.unit() - 0.5, rng.unit() - 0.5, rng.unit() - 0.5).normalize();
    let mut check = |what: &str, size: f64, offset: f64| {
        let mesh = scenes::sphere(1).rotated(direction().to_array(), 3.0 * offset.sin());
        let mesh = mesh.scaled(size).translated((direction() * (offset * size)).to_array());
        let case =
            Case::new(mesh, &[Material::new(0.5, 0.0)]).sky(sky()).sun(SunOf::new(SUN, &[IRRADIANCE], 0.0));
        let off = worst(&case);
        println!("position | {what} size {size:.0e} offset {offset:.0e} sizes | {off:.1e} | closed form");
        assert!(off <= PLACED.error, "{what}: size {size:e}, offset {offset:e}: off by {off:.1e}");
    };
    for power in (-9..=9).step_by(3) {
        check("scale", 1.7 * 10f64.powi(power), 0.3);
    }
    for power in 0..=8 {
        check("offset", 1.0, 10f64.powi(power));
        check("small and far", 1e-3, 10f64.powi(power));
    }
}
