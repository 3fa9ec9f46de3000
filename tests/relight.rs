//! New light on the same geometry and a new view of the same light redo nothing, and change nothing.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::camera::{CameraInput, Sampling};
use blik_kernel::host::{Geometry, Host, Lit, Report};
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic, outcome, perspective, timeless, within};
use support::scenes;
use support::twin::Material;

fn scene() -> Case {
    let pairs = [([0.6, 0.3], [0.2, 0.4]), ([0.2, 0.5], [0.0, 0.0]), ([0.1, 0.1], [0.6, 0.3])];
    Case::new(scenes::corner(2), &pairs.map(|(d, s)| Material::spectral(&d, &s))).two_sided()
}

fn lights() -> [(Option<SkyOf>, Option<SunOf>); 4] {
    let sun = SunOf::new([0.5, 0.75, 1.0], &[2.0, 1.0], 0.2665);
    let overcast = SkyOf::new(SkyModel::Overcast, &[1.0, 0.5], &[0.2, 0.1]);
    [
        (Some(SkyOf::uniform(2)), None),
        (Some(SkyOf::new(SkyModel::Gradient, &[1.0, 0.8], &[0.2, 0.4])), Some(sun)),
        (None, Some(SunOf::new([-0.2, 0.1, 1.0], &[1.0, 1.5], 0.0))),
        (Some(overcast), None),
    ]
}

fn cameras() -> [CameraInput; 2] {
    let first = orthographic([3.0, 2.0, 2.5], [0.4, 0.5, 0.25], 2.0, 20);
    [
        CameraInput { sampling: Sampling::Area, ..first },
        perspective([2.0, 3.0, 1.5], [0.4, 0.5, 0.25], 35.0, 20),
    ]
}

fn light<'g>(host: &Host, geometry: &'g Geometry<'g>, of: &'g (Option<SkyOf>, Option<SunOf>)) -> Lit<'g> {
    let (sky, sun) = (of.0.as_ref().map(SkyOf::input), of.1.as_ref().map(SunOf::input));
    host.light(geometry, sky.as_ref(), sun.as_ref()).unwrap()
}

/// What a report says of the coupling and of the rays that found it.
fn coupling_work(report: &Report) -> (u64, usize, usize, [u64; 4], usize) {
    let pairs = &report.pairs;
    let pairs = [pairs.tested, pairs.culled, pairs.exact, pairs.sampled];
    (report.rays.visibility, report.bytes.coupling, report.bytes.bvh, pairs, report.elements)
}

#[test]
fn a_new_light_does_no_coupling_work_and_traces_no_sky_ray() {
    scene().with_geometry(2, &within(1e-2), |host, geometry| {
        let before = geometry.report().clone();
        assert!(before.rays.visibility > 0 && before.pairs.sampled > 0, "there was work to do");
        assert_eq!((before.rays.sun, before.rays.chain, before.sweeps), (0, 0, 0));
        for of in &lights() {
            let lit = light(host, geometry, of);
            assert_eq!(coupling_work(lit.report()), coupling_work(&before));
            assert_eq!(lit.report().rays.sun > 0, of.1.is_some(), "rays toward the sun alone");
            assert_eq!((lit.report().rays.chain, lit.report().rays.primary), (0, 0));
            assert!(lit.report().sweeps > 0);
        }
        assert_eq!(geometry.report(), &before, "the geometry knows of no light");
    });
}

#[test]
fn a_new_light_gives_the_bits_of_a_cold_run() {
    let camera = cameras()[0];
    scene().with_geometry(2, &within(1e-2), |host, geometry| {
        let lights = lights();
        // there and back again: what was lit before leaves no trace
        for of in lights.iter().chain(lights.iter().rev()) {
            let warm = outcome(host, &light(host, geometry, of), &camera);
            let cold =
                Case { sky: of.0.clone(), sun: of.1.clone(), ..scene() }.run(2, &within(1e-2), &camera);
            assert_eq!(warm.pixel_bits(), cold.pixel_bits());
            assert_eq!(warm.facet_bits(), cold.facet_bits());
            assert_eq!(timeless(&warm.image.report), timeless(&cold.image.report));
        }
    });
}

#[test]
fn a_new_view_solves_nothing() {
    let of = &lights()[1];
    let case = Case { sky: of.0.clone(), sun: of.1.clone(), ..scene() };
    case.with_lit(2, &within(1e-2), |host, lit| {
        let before = lit.report().clone();
        let [first, second] = cameras();
        for camera in [first, second, first] {
            let warm = outcome(host, lit, &camera);
            let report = &warm.image.report;
            assert_eq!(coupling_work(report), coupling_work(&before));
            assert_eq!((report.sweeps, report.rays.sun), (before.sweeps, before.rays.sun));
            assert!(report.rays.primary > 0 && report.rays.chain > 0, "a view is rays through pixels");
            let cold = case.run(2, &within(1e-2), &camera);
            assert_eq!(warm.pixel_bits(), cold.pixel_bits());
            assert_eq!(timeless(report), timeless(&cold.image.report));
        }
        assert_eq!(lit.report(), &before);
    });
}
