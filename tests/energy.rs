//! Energy: diffuse facets and flat ideal mirrors send out what they receive and do not absorb, and no more.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::host::Settings;
use blik_kernel::math::Vec3;
use case::{Case, SkyOf, SunOf, sides, within};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;
use support::scenes::{self, Mesh};
use support::twin::Material;

/// All irradiances, also those of mirrors and blacks.
fn all(tolerance: f64) -> Settings {
    Settings { all_irradiances: true, ..within(tolerance) }
}

/// Flux that arrives straight: the irradiance of a black object.
fn received(case: &Case, settings: &Settings) -> f64 {
    let black = vec![Material::new(0.0, 0.0); case.materials.len()];
    let black = Case { materials: black, ..case.clone() };
    black.with_lit(2, settings, |_, lit| sides(lit).iter().map(|s| s.area * s.irradiance[0]).sum())
}

/// Flux that the facets absorb of all that arrives, also by way of each other.
fn absorbed(case: &Case, settings: &Settings) -> f64 {
    case.with_lit(2, settings, |_, lit| {
        sides(lit)
            .iter()
            .map(|s| {
                let material = &case.materials[case.mesh.materials[s.facet] as usize];
                s.area * s.irradiance[0] * (1.0 - material.diffuse[0] - material.specular[0])
            })
            .sum()
    })
}

/// Flux that leaves: the radiant intensity over all directions, each with the light that mirrors show.
///
/// 256 directions of a Fibonacci lattice: about 256^-3/4 = 1.6 % at worst for integrands with kinks.
fn sent(case: &Case, settings: &Settings) -> f64 {
    let directions = 256;
    case.with_lit(2, settings, |host, lit| {
        let intensity = |k: usize| {
            let z = 1.0 - (2.0 * k as f64 + 1.0) / f64::from(directions);
            let (s, c) = (k as f64 * 2.399_963_229_728_653).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let (report, _) = host.signature(lit, Vec3::new(c * across, s * across, z)).unwrap();
            report.radiant_intensity[0]
        };
        (0..directions as usize).map(intensity).sum::<f64>() * 4.0 * PI / f64::from(directions)
    })
}

fn bodies() -> Vec<(&'static str, Mesh, bool)> {
    let pieces = scenes::corner(1).joined(&scenes::cube_outside().scaled(0.3).translated([0.5, 0.4, 0.35]));
    vec![
        ("corner", scenes::corner(2), true),
        ("pieces", pieces, true),
        ("box", scenes::box_open(1.0, 1.0, 0.6, 1), true),
    ]
}

/// Diffuse, mixed, mirror.
fn materials() -> [Material; 3] {
    [Material::new(0.8, 0.0), Material::new(0.3, 0.4), Material::new(0.0, 0.9)]
}

#[test]
fn what_a_uniform_sky_sends_is_absorbed_or_sent_back() {
    for (name, mesh, two_sided) in bodies() {
        let mut case = Case::new(mesh, &materials()).sky(SkyOf::uniform(1));
        case.two_sided = two_sided;
        let settings = all(1e-2);
        let (into, kept, out) =
            (received(&case, &settings), absorbed(&case, &settings), sent(&case, &settings));
        println!("{name}: in {into}, absorbed {kept}, sent {out}, balance {}", (kept + out) / into - 1.0);
        // the tolerance: errors of the fluxes are of both signs and partly cancel
        assert!((kept + out - into).abs() < 0.01 * into, "{name}");
        assert!(kept > 0.1 * into && out > 0.1 * into, "{name}: both parts count");
    }
}

#[test]
fn what_the_sun_sends_is_absorbed_or_sent_back_by_diffuse_facets() {
    for (name, mesh, two_sided) in bodies() {
        let diffuse = [Material::new(0.8, 0.0), Material::new(0.5, 0.0), Material::new(0.2, 0.0)];
        let mut case = Case::new(mesh, &diffuse).sun(SunOf::new([0.5, 0.35, 0.8], &[2.0], 0.0));
        case.two_sided = two_sided;
        let settings = all(1e-2);
        let (into, kept, out) =
            (received(&case, &settings), absorbed(&case, &settings), sent(&case, &settings));
        println!("{name}: in {into}, absorbed {kept}, sent {out}, balance {}", (kept + out) / into - 1.0);
        // as above, and as much again for elements in half shadow, whose flux is wrong by 1.6 %
        assert!((kept + out - into).abs() < 0.02 * into, "{name}");
    }
}

#[test]
fn mirrors_in_the_sun_add_no_energy() {
    // what mirrors show of the sun is no radiance of finite value, so that the flux out has no sum over
    // directions: what is absorbed is at most what arrives, and all of it where all that is mirrored stays inside
    for (name, mesh, two_sided) in bodies() {
        let mut case = Case::new(mesh, &materials()).sun(SunOf::new([0.5, 0.35, 0.8], &[2.0], 0.2665));
        case.two_sided = two_sided;
        let settings = all(1e-2);
        let (into, kept) = (received(&case, &settings), absorbed(&case, &settings));
        println!("{name}: in {into}, absorbed {kept}");
        assert!(kept <= 1.01 * into && kept > 0.1 * into, "{name}: {kept} of {into}");
    }
}

#[test]
fn no_pixel_outshines_the_sky() {
    for (name, mesh, two_sided) in bodies() {
        let mut case = Case::new(mesh, &materials()).sky(SkyOf::uniform(1));
        case.two_sided = two_sided;
        let outcome =
            case.run(2, &within(5e-3), &case::orthographic([3.0, 2.0, 2.5], [0.4, 0.4, 0.3], 2.5, 48));
        let brightest = outcome.image.pixels.iter().fold(0.0f32, |a, &b| a.max(b));
        // where gradients are noise they are damped, not gone
        assert!(brightest <= 1.0 + 5e-3, "{name}: {brightest}");
    }
}

#[test]
fn a_beam_keeps_its_flux() {
    // A mirror floor throws sunlight onto the wall at x = 0. The sun stands so that the wall catches all of it, and
    // neither shades the other: irradiance of the wall beyond the direct one, times its area, is rho_s E A cos.
    let (s, c) = (1.1f64.sin(), 1.1f64.cos());
    for (direction, specular) in [([1.0, 0.0, 0.999], 0.9), ([s, 0.0, c * 0.5], 0.35)] {
        for two_sided in [false, true] {
            let materials = [Material::new(0.5, 0.0), Material::new(0.0, specular)];
            let mut case =
                Case::new(scenes::wall_on_mirror(), &materials).sun(SunOf::new(direction, &[3.0], 0.0));
            case.two_sided = two_sided;
            let length = Vec3::from_array(direction).length();
            let (wall, floor) = (direction[0] / length, direction[2] / length);
            let flux = case.with_lit(2, &within(1e-2), |_, lit| {
                let fronts = sides(lit).into_iter().filter(|s| s.facet < 2 && s.irradiance[0] > 0.0);
                fronts.map(|s| s.area * (s.irradiance[0] - 3.0 * wall)).sum::<f64>()
            });
            let truth = specular * 3.0 * floor;
            // each ray carries its share of the flux exactly; sums of up to 2^16 of them
            assert!((flux - truth).abs() < 1e-11, "{direction:?}: {flux}, not {truth}");
        }
    }
}

#[test]
fn a_beam_by_way_of_two_mirrors_keeps_its_flux() {
    // Sunlight falls on a mirror floor at x in 0..1, goes up to a mirror ceiling at x in -2..-1 and from there down
    // to a diffuse floor at x in -4..-3, which lies in the ceiling's shadow: all its light is the beam's.
    let (x, y) = (DVec3::X, DVec3::Y);
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::ZERO, x, y, 1, 0);
    mesh.rectangle(dvec3(-2.2, -0.1, 2.0), y * 1.2, x * 1.4, 1, 1);
    mesh.rectangle(dvec3(-4.1, -0.05, 0.0), x * 1.2, y * 1.1, 2, 2);
    let materials = [Material::new(0.0, 0.6), Material::new(0.0, 0.7), Material::new(0.5, 0.0)];
    let case = Case::new(mesh, &materials).sun(SunOf::new([1.0, 0.0, 1.0], &[3.0], 0.0));
    let flux = case.with_lit(2, &within(1e-2), |_, lit| {
        sides(lit).iter().filter(|s| s.facet >= 4).map(|s| s.area * s.irradiance[0]).sum::<f64>()
    });
    let truth = 0.6 * 0.7 * 3.0 * 0.5f64.sqrt();
    // as above
    assert!((flux - truth).abs() < 1e-11, "{flux}, not {truth}");
}
