//! Light and reflectances at the ends of their ranges.

use crate::budget::{LIGHT_SCALE, PIXEL, SLOPE};
use crate::case::{Case, SkyOf, SunOf, orthographic, outcome, within};
use crate::support::scenes;
use crate::support::twin::Material;
use blik_kernel::Error;
use blik_kernel::camera::CameraInput;
use blik_kernel::host::{GeometryMemory, Host};
use blik_kernel::sky::SkyModel;

fn view() -> CameraInput {
    orthographic([2.6, 1.9, 1.4], [0.4, 0.4, 0.4], 2.0, 8)
}

/// A corner of diffuse and mirror facets in sky and sun of a multiple of ordinary light.
fn corner(factor: f64) -> Case {
    let materials =
        [(0.6, 0.1), (0.2, 0.7), (0.5, 0.0)].map(|(d, s)| Material::new(d, s).emitting(0.1 * factor));
    Case::new(scenes::corner(1), &materials)
        .sky(SkyOf::new(SkyModel::Overcast, &[factor], &[0.2 * factor]))
        .sun(SunOf::new([0.4, 0.3, 0.8], &[2.0 * factor], 0.0))
}

#[test]
fn light_of_any_strength_is_the_same_image() {
    let ordinary = corner(1.0).run(2, &within(1e-2), &view()).image;
    let relative = |factor: f64| {
        let image = corner(factor).run(2, &within(1e-2), &view()).image;
        let pairs = image.pixels.iter().zip(&ordinary.pixels);
        pairs.map(|(a, b)| (f64::from(*a) / factor - f64::from(*b)).abs()).fold(0.0, f64::max)
    };
    for power in [-100, -30, 30, 100] {
        assert_eq!(relative(2f64.powi(power)), LIGHT_SCALE.error, "2^{power}");
    }
    for factor in [1e-30, 1e-9, 1e9, 1e30] {
        let off = relative(factor);
        println!("radiometry | light times {factor:.0e} | {off:.1e} | light of 1");
        assert!(off <= SLOPE.error, "{factor:e}: {off:.1e}");
    }
}

#[test]
fn bands_of_very_different_scale_do_not_touch() {
    let bands = 64;
    let factors: Vec<f64> = (0..bands).map(|b| 2f64.powi(3 * (b - 32))).collect();
    let all = |value: f64| vec![value; bands as usize];
    let material = Material::spectral(&all(0.6), &all(0.2));
    let one = [Material::new(0.6, 0.2)];
    let sky = |radiance: &[f64]| SkyOf::new(SkyModel::Hemisphere, radiance, &vec![0.0; radiance.len()]);
    let mesh = scenes::corner(1).of_material(0);
    let alone = Case::new(mesh.clone(), &one).sky(sky(&[1.0])).run(2, &within(1e-2), &view()).image.pixels;
    let image = Case::new(mesh, &[material]).sky(sky(&factors)).run(2, &within(1e-2), &view()).image.pixels;
    for (pixel, alone) in image.chunks(bands as usize).zip(&alone) {
        for (value, factor) in pixel.iter().zip(&factors) {
            assert_eq!(f64::from(*value) / factor, f64::from(*alone), "factor {factor:e}");
        }
    }
}

#[test]
fn darkness_is_dark_and_one_lit_facet_lights_all() {
    let mut materials = [Material::new(0.5, 0.2), Material::new(0.5, 0.0), Material::new(0.5, 0.0)];
    let dark = Case::new(scenes::corner(1), &materials).run(2, &within(1e-2), &view());
    let brightest = dark.image.pixels.iter().fold(0f32, |a, p| a.max(*p));
    assert_eq!(brightest, 0.0);
    // every estimate has the rounding of f32 pixels in it
    assert!(dark.image.report.error_estimate <= 2.0 * PIXEL.error);
    materials[0] = Material::new(0.5, 0.2).emitting(1.0);
    let lit = Case::new(scenes::corner(1), &materials).run(2, &within(1e-2), &view());
    assert!(lit.sides.iter().all(|s| s.facet < 2 || s.irradiance[0] > 0.0));
}

#[test]
fn white_rooms_are_solved_or_refused_with_the_reason() {
    let white = |d: f64, s: f64| Material::new(d, s).emitting(1.0);
    for (d, s) in [(1.0, 0.0), (0.5, 0.5), (0.1, 0.9)] {
        let case = Case::new(scenes::cube_inside(), &[white(d, s)]);
        let (host, mut memory) = (Host::new(2).unwrap(), GeometryMemory::default());
        case.with_input(|input| {
            let geometry = host.geometry(&mut memory, input, &within(1e-2)).unwrap();
            let error = host.light(&geometry, None, None).expect_err("a closed white room");
            assert!(matches!(error, Error::Diverges { .. }), "{d} {s}: {error}");
        });
    }
    // a wall that absorbs a little less than it could: rows of the others add up to 1
    let mesh = scenes::cube_inside().with_materials(&[0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    for absorbed in [0.5, 1e-2, 1e-4] {
        let ceiling = Material::new(1.0 - absorbed, 0.0).emitting(absorbed);
        let case = Case::new(mesh.clone(), &[Material::new(1.0, 0.0), ceiling]);
        let camera = crate::case::perspective([0.3, 0.4, 0.6], [0.9, 0.7, 0.35], 100.0, 8);
        case.with_lit(2, &within(1e-2), |host, lit| {
            let outcome = outcome(host, lit, &camera);
            let report = &outcome.image.report;
            let off = outcome.image.pixels.iter().map(|p| (f64::from(*p) - 1.0).abs()).fold(0.0, f64::max);
            println!(
                "radiometry | white room, {absorbed:.0e} absorbed | {off:.1e} | furnace, estimate {:.1e}, {} sweeps",
                report.error_estimate, report.sweeps
            );
            // relative to the emission, which is that much less than the radiance of 1
            assert!(off / absorbed <= report.error_estimate + SLOPE.error / absorbed, "{absorbed}: {off:.1e}");
            assert!(off <= 1e-5 && report.sweeps <= 2000, "{absorbed}: {off:.1e}, {} sweeps", report.sweeps);
        });
    }
}
