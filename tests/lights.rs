//! Lights as vectors: emissions of facets in the light, many lights in one call, and what sun, sky and emission bring apart.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::Error;
use blik_kernel::error::Field;
use blik_kernel::host::{Geometry, Host, LightReport, Lit, Wanted};
use blik_kernel::light::LightInput;
use blik_kernel::math::Vec3;
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic, sides, within};
use support::scenes;
use support::twin::Material;

/// A corner of three materials in two bands: diffuse, mirror with a diffuse part, lobe.
fn scene() -> Case {
    let lobe = Material { gloss: Some(8.0), ..Material::spectral(&[0.2, 0.4], &[0.4, 0.3]) };
    let materials =
        [Material::spectral(&[0.6, 0.3], &[0.0, 0.0]), Material::spectral(&[0.2, 0.1], &[0.6, 0.7]), lobe];
    Case::new(scenes::corner(2), &materials).two_sided()
}

/// Emissions of all facets, sides and bands: most differ.
fn emissions(case: &Case) -> Vec<f64> {
    let sides = if case.two_sided { 2 } else { 1 };
    let count = case.mesh.facets.len() * sides * case.bands();
    (0..count).map(|n| 0.05 * (n * 7 % 11) as f64).collect()
}

/// Skies and suns, some of them the same twice running and again later.
fn skies_and_suns() -> Vec<(Option<SkyOf>, Option<SunOf>)> {
    let sun = |x: f64| Some(SunOf::new([x, 0.75, 1.0], &[2.0, 1.0], 0.2665));
    let (uniform, gradient) = (SkyOf::uniform(2), SkyOf::new(SkyModel::Gradient, &[1.0, 0.8], &[0.2, 0.4]));
    let brighter = SkyOf::new(SkyModel::Uniform, &[2.0, 1.0], &[0.0, 0.0]);
    vec![
        (Some(uniform.clone()), sun(0.5)),
        (Some(uniform.clone()), sun(-0.2)),
        (Some(uniform.clone()), None),
        (Some(gradient.clone()), None),
        (None, sun(0.1)),
        (Some(gradient), sun(0.3)),
        (Some(brighter), sun(0.3)),
        (Some(uniform), sun(0.5)),
        (None, None),
    ]
}

fn inputs<'a>(of: &'a [(Option<SkyOf>, Option<SunOf>)], emission: &'a [f64]) -> Vec<LightInput<'a>> {
    let light = |(number, (sky, sun)): (usize, &'a (Option<SkyOf>, Option<SunOf>))| LightInput {
        sky: sky.as_ref().map(SkyOf::input),
        sun: sun.as_ref().map(SunOf::input),
        emission: if number % 2 == 0 { emission } else { &[] },
        reference: None,
    };
    of.iter().enumerate().map(light).collect()
}

const VIEWS: [Vec3; 2] = [Vec3::new(-0.5, -0.6, -0.7), Vec3::new(0.2, 0.1, -1.0)];

/// Irradiances and radiances of all facets, as [`LightReport`] has them.
fn of_facets(lit: &Lit<'_>) -> [Vec<f64>; 2] {
    let all = sides(lit);
    [
        all.iter().flat_map(|s| s.irradiance.clone()).collect(),
        all.iter().flat_map(|s| s.radiance.clone()).collect(),
    ]
}

fn one_by_one(host: &Host, geometry: &Geometry<'_>, inputs: &[LightInput<'_>]) -> Vec<LightReport> {
    let one = |input: &LightInput<'_>| {
        let lit = host.light_of(geometry, input).unwrap();
        let [irradiance, radiance] = of_facets(&lit);
        let signatures = host.signatures(&lit, &VIEWS).unwrap();
        LightReport {
            reference_radiance: lit.reference().to_vec(),
            irradiance,
            radiance,
            rays: lit.report().rays.sun + signatures.iter().map(|s| s.1).sum::<u64>(),
            signatures: signatures.into_iter().map(|s| s.0).collect(),
            sweeps: u64::from(lit.report().sweeps),
            solver: lit.report().certified.solver,
        }
    };
    inputs.iter().map(one).collect()
}

#[test]
fn many_lights_have_the_bits_of_each_alone() {
    let case = scene();
    let (of, emission) = (skies_and_suns(), emissions(&case));
    let inputs = inputs(&of, &emission);
    let mut first = None;
    for threads in [1, 2, 3] {
        case.with_geometry(threads, &within(2e-2), |host, geometry| {
            let wanted = Wanted { facets: true, views: &VIEWS };
            let many = host.lights(geometry, &inputs, wanted).unwrap();
            // the bits: `==` of numbers, none of which is NaN
            assert!(many == one_by_one(host, geometry, &inputs), "{threads} threads");
            assert!(first.get_or_insert_with(|| many.clone()) == &many, "{threads} threads");
            let few = host.lights(geometry, &inputs[1..3], Wanted::default()).unwrap();
            assert!(few[0].irradiance.is_empty() && few[0].signatures.is_empty());
            assert_eq!(few[1].reference_radiance, many[2].reference_radiance);
            assert!(host.lights(geometry, &[], wanted).unwrap().is_empty());
        });
    }
}

/// An emission in the light is that of materials: the same rows, the same sums.
#[test]
fn an_emission_of_the_light_has_the_bits_of_the_materials() {
    let dim = Case::new(scenes::corner(1), &[0.6, 0.3, 0.5].map(|d| Material::new(d, 0.2))).two_sided();
    // each material emits: rows keep entries for all, whatever it is
    let emitting = |factor: f64| Case {
        materials: (0..3).map(|m| dim.materials[m].clone().emitting(factor * (1.0 + m as f64))).collect(),
        ..dim.clone()
    };
    let camera = orthographic([3.0, 2.0, 2.5], [0.4, 0.5, 0.25], 2.0, 16);
    let own = emitting(0.5);
    let sides = 2;
    let values: Vec<f64> =
        own.mesh.materials.iter().flat_map(|m| vec![own.materials[*m as usize].emission[0]; sides]).collect();
    // elements are cut finer beside lamps, by how much these emit: the same for both
    own.with_geometry(2, &within(1e-2), |host, geometry| {
        let told = LightInput { emission: &values, ..LightInput::default() };
        let [by_material, by_light] =
            [LightInput::default(), told].map(|input| host.light_of(geometry, &input).unwrap());
        assert!(of_facets(&by_material) == of_facets(&by_light));
        let [a, b] = [&by_material, &by_light].map(|lit| host.image(lit, &camera, true).unwrap());
        assert!(a.pixels == b.pixels && a.components == b.components);
        assert_eq!(a.report.error_estimate, b.report.error_estimate);
        assert!(a.pixels.iter().any(|p| *p > 1.0));
        // twice the emission: twice the light; a power of two keeps the bits where errors are related to twice as much
        let twice: Vec<f64> = values.iter().map(|v| 2.0 * v).collect();
        let twice = host.light_of(geometry, &LightInput { emission: &twice, ..told }).unwrap();
        let ([e, _], [once, _]) = (of_facets(&twice), of_facets(&by_light));
        assert!(e.iter().zip(&once).all(|(a, b)| *a == 2.0 * b));
        assert_eq!(twice.report().rays.sun, 0, "no ray for new temperatures");
    });
}

/// Sides and bands are told apart: only what faces a lit side receives anything, and only in its band.
#[test]
fn an_emission_is_of_one_side_and_band() {
    let plates = scenes::corner(1);
    let facets = plates.facets.len();
    let case = Case::new(plates, &[Material::spectral(&[0.5, 0.5], &[0.0, 0.0])]).two_sided();
    let case = Case { mesh: scenes::Mesh { materials: vec![0; facets], ..case.mesh.clone() }, ..case };
    case.with_geometry(1, &within(1e-2), |host, geometry| {
        let mut emission = vec![0.0; facets * 4];
        // band 1 of the front of facet 0
        emission[1] = 3.0;
        let input = LightInput { emission: &emission, ..LightInput::default() };
        let lit = host.light_of(geometry, &input).unwrap();
        let all = sides(&lit);
        assert!(all.iter().all(|side| side.irradiance[0] == 0.0 && side.radiance[0] == 0.0));
        assert_eq!((all[0].radiance[1] > 3.0, all[1].radiance[1] < 3.0), (true, true));
        assert!(all.iter().any(|side| side.facet > 0 && side.irradiance[1] > 0.0));
    });
}

/// What sun, sky and emission bring by themselves adds up to what they bring together.
#[test]
fn sun_sky_and_emission_add_up() {
    let case = scene();
    let (sky, sun, emission) =
        (SkyOf::uniform(2), SunOf::new([0.4, 0.6, 0.9], &[2.0, 1.0], 0.2665), emissions(&case));
    let dark = vec![0.0; emission.len()];
    // one reference radiance for all
    let reference = [1.5, 1.2];
    let none = LightInput { emission: &dark, reference: Some(&reference), ..LightInput::default() };
    let (sky, sun) = (Some(sky.input()), Some(sun.input()));
    let inputs = [
        LightInput { sky, sun, emission: &emission, ..none },
        LightInput { sky, ..none },
        LightInput { sun, ..none },
        LightInput { emission: &emission, ..none },
    ];
    case.with_geometry(2, &within(1e-2), |host, geometry| {
        let wanted = Wanted { facets: true, views: &VIEWS };
        let all = host.lights(geometry, &inputs, wanted).unwrap();
        assert!(all[1..].iter().all(|part| part.irradiance.iter().sum::<f64>() > 0.1), "all parts count");
        for at in 0..all[0].irradiance.len() {
            let sum: f64 = all[1..].iter().map(|part| part.irradiance[at]).sum();
            let off = (sum - all[0].irradiance[at]).abs() / std::f64::consts::PI;
            // gradients are damped by the noise of all light, or of each part: what slopes send differs by less than
            // the tolerance allows elements to be wrong by
            assert!(off < 1e-2 * reference[0], "value {at}: {sum}, not {}", all[0].irradiance[at]);
        }
        for (view, whole) in all[0].signatures.iter().enumerate() {
            for (band, reference) in reference.iter().enumerate() {
                let of = |part: &LightReport| part.signatures[view].radiant_intensity[band];
                let sum: f64 = all[1..].iter().map(of).sum();
                let off = (sum - whole.radiant_intensity[band]).abs();
                // the same rays and glints in all of them: differences are those of the elements
                assert!(off <= 1e-2 * reference * whole.projected_area, "{sum} not {whole:?}");
            }
        }
    });
}

#[test]
fn wrong_emissions_are_refused_with_their_facet() {
    let mirror = Material::spectral(&[0.0, 0.0], &[0.9, 0.9]);
    let mut case = scene();
    case.materials[1] = mirror;
    let count = emissions(&case).len();
    let mirrors = case.mesh.materials.iter().position(|m| *m == 1).unwrap();
    case.with_geometry(1, &within(2e-2), |host, geometry| {
        let refused = |emission: &[f64]| {
            let input = LightInput { emission, ..LightInput::default() };
            let alone = host.light_of(geometry, &input).map(|_| ()).unwrap_err();
            let good = LightInput::default();
            let (number, error) = host.lights(geometry, &[good, good, input], Wanted::default()).unwrap_err();
            // as words: NaN is not itself
            assert_eq!((number, error.to_string()), (2, alone.to_string()));
            alone
        };
        let expected = count;
        let field = Field::Emission;
        assert_eq!(refused(&[1.0]), Error::LightBandCount { field, expected, given: 1 });
        let one = |at: usize, value: f64| {
            let mut emission = vec![0.0; count];
            emission[at] = value;
            emission
        };
        for value in [-1e-300, 1.1e37, f64::INFINITY] {
            // band 1 of the back of facet 1
            assert_eq!(refused(&one(7, value)), Error::FacetRange { facet: 1, band: 1, field, value });
        }
        assert!(matches!(refused(&one(5, f64::NAN)), Error::FacetRange { facet: 1, band: 1, .. }));
        assert_eq!(refused(&one(4 * mirrors, 1.0)), Error::Uncoupled { facet: mirrors, field });
        let reference = LightInput { reference: Some(&[1.0]), ..LightInput::default() };
        assert!(host.light_of(geometry, &reference).is_err());
    });
}

/// An emission at the limit of its range gives an error or numbers, never NaN.
#[test]
fn extreme_emissions_stay_finite() {
    let case = scene();
    case.with_geometry(1, &within(2e-2), |host, geometry| {
        for value in [5e-324, 1e-300, 1e36, 1e37] {
            let emission = vec![value; emissions(&case).len()];
            let input = LightInput { emission: &emission, ..LightInput::default() };
            match host.lights(geometry, &[input], Wanted { facets: true, views: &VIEWS }) {
                Ok(all) => {
                    let finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
                    assert!(finite(&all[0].irradiance) && finite(&all[0].radiance), "{value}");
                    let seen = &all[0].signatures;
                    assert!(seen.iter().all(|s| finite(&s.radiant_intensity) && finite(&s.error)), "{value}");
                }
                // interreflections lift it above the limit
                Err((0, Error::Range { field: Field::Emission, .. })) => assert_eq!(value, 1e37),
                Err(error) => panic!("{error:?}"),
            }
        }
    });
}
