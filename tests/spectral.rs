//! Bands share geometry and nothing else: each path by way of mirrors carries each band's own product.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::camera::CameraInput;
use blik_kernel::host::Settings;
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic, perspective, within};
use support::scenes;
use support::twin::Material;

/// A corner of a diffuse floor and two mirrors whose reflectances differ by band and from each other in each band;
/// sky and sun differ by band too. The sun is a point: of penumbrae all bands share the rays that the worst asks for.
///
/// The diffuse reflectance alone is the same in all bands: rays and elements follow from the largest.
fn scene() -> Case {
    let materials = [
        Material::spectral(&[0.5; 3], &[0.2, 0.4, 0.1]),
        Material::spectral(&[0.2; 3], &[0.7, 0.3, 0.5]),
        Material::spectral(&[0.0; 3], &[0.9, 0.6, 0.8]),
    ];
    Case::new(scenes::corner(2), &materials)
        .sky(SkyOf::new(SkyModel::Gradient, &[1.0, 0.6, 0.8], &[0.2, 0.5, 0.1]))
        .sun(SunOf::new([0.5, 0.7, 0.9], &[2.0, 0.5, 1.0], 0.0))
}

/// One band of the case.
fn band(case: &Case, band: usize) -> Case {
    let mut one = case.clone();
    for material in &mut one.materials {
        for values in [&mut material.diffuse, &mut material.specular, &mut material.emission] {
            *values = vec![values[band]];
        }
    }
    one.sky
        .iter_mut()
        .for_each(|sky| (sky.radiance, sky.ground) = (vec![sky.radiance[band]], vec![sky.ground[band]]));
    one.sun.iter_mut().for_each(|sun| sun.irradiance = vec![sun.irradiance[band]]);
    one
}

/// What rays from a point leave of a pixel's error, in tolerances: three times their rms error of 0.55.
const POINT: f64 = 3.0 * 0.55;

/// Of looks at the sky and rays from the image's points all bands share those that the worst asks for, too. Others change a pixel by up to
/// the error that they leave; three pixels in four take the same in all bands.
#[track_caller]
fn are_alike(three: impl Iterator<Item = f32>, single: &[f32], most: f64, equal: impl Fn(f32, f32) -> bool) {
    let mut same = 0;
    for (three, &single) in three.zip(single) {
        same += usize::from(equal(three, single));
        assert!(f64::from((three - single).abs()) <= most, "{three} {single}");
    }
    assert!(same * 4 >= single.len() * 3, "{same} of {} pixels take the same rays", single.len());
}

/// Centre samples: where areas are sampled, all bands share the rays that the worst asks for.
fn views() -> [CameraInput; 2] {
    [
        orthographic([3.0, 2.0, 2.5], [0.4, 0.5, 0.25], 2.0, 24),
        perspective([2.0, 3.0, 1.5], [0.4, 0.5, 0.25], 35.0, 24),
    ]
}

#[test]
fn three_bands_are_three_runs_bit_for_bit() {
    // Orders of reflection kept apart: no sweep ends early in one band. No path of a corner meets more than three
    // mirrors, so that none is cut, and each band has two mirrors, so that paths are told apart alike.
    let settings = Settings { max_bounces: Some(6), ..within(5e-3) };
    for camera in views() {
        let all = scene().run(2, &settings, &camera);
        for b in 0..3 {
            let one = band(&scene(), b).run(2, &settings, &camera);
            let reference = one.image.report.reference_radiance[0];
            let bits = |three: &[f32], single: &[f32]| {
                let three = three.iter().skip(b).step_by(3).copied();
                are_alike(three, single, POINT * 5e-3 * reference, |a, b| a.to_bits() == b.to_bits());
            };
            bits(&all.image.pixels, &one.image.pixels);
            let (three, single) =
                (all.image.components.as_ref().unwrap(), one.image.components.as_ref().unwrap());
            for (three, single) in three.iter().zip(single) {
                assert!(single.iter().any(|&x| x > 0.0), "each term is there");
                bits(three, single);
            }
            for (three, single) in all.sides.iter().zip(&one.sides) {
                assert_eq!(three.irradiance[b].to_bits(), single.irradiance[0].to_bits(), "band {b}");
                assert_eq!(three.radiance[b].to_bits(), single.radiance[0].to_bits(), "band {b}");
            }
        }
    }
}

#[test]
fn a_solution_of_all_orders_agrees_within_the_sweeps() {
    // sweeps end where the worst band is within 1e-3 of the tolerance: in the others they go on a little longer
    let tolerance = 5e-3;
    for camera in views() {
        let all = scene().run(2, &within(tolerance), &camera);
        for b in 0..3 {
            let one = band(&scene(), b).run(2, &within(tolerance), &camera);
            let reference = one.image.report.reference_radiance[0];
            let three = all.image.pixels.iter().skip(b).step_by(3).copied();
            are_alike(three, &one.image.pixels, POINT * tolerance * reference, |a, b| {
                f64::from((a - b).abs()) <= reference * (1e-3 * tolerance + 1e-6)
            });
        }
    }
}

#[test]
fn a_band_is_not_told_by_its_neighbours() {
    // the same band three times over is one band, whatever mirrors there are; and equal mirrors are one class
    let repeated = |values: &[f64]| vec![values[1]; 3];
    let mut case = scene();
    for m in &mut case.materials {
        (m.diffuse, m.specular) = (repeated(&m.diffuse), repeated(&m.specular));
    }
    let (sky, sun) = (case.sky.as_mut().unwrap(), case.sun.as_mut().unwrap());
    (sky.radiance, sky.ground, sun.irradiance) =
        (repeated(&sky.radiance), repeated(&sky.ground), repeated(&sun.irradiance));
    let all = case.run(2, &within(5e-3), &views()[0]);
    let one = band(&case, 0).run(2, &within(5e-3), &views()[0]);
    for (pixel, single) in all.image.pixels.chunks_exact(3).zip(&one.image.pixels) {
        assert_eq!(pixel, [*single; 3]);
    }
}
