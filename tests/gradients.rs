//! Derivatives of signatures by diffuse reflectances and emissions of all facets, against central differences of converged runs;
//! shares and terms, which add up to the signature.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::Error;
use blik_kernel::arena::Memory;
use blik_kernel::host::{Geometry, Host};
use blik_kernel::light::LightInput;
use blik_kernel::math::Vec3;
use blik_kernel::scene::Scene;
use blik_kernel::settings::Settings;
use blik_kernel::signature::{self, Signature};
use blik_kernel::sky::SkyModel;
use blik_kernel::stages::Lights;
use case::{Case, SkyOf, SunOf, within};
use support::scenes;
use support::twin::Material;

const VIEW: Vec3 = Vec3::new(-0.5, -0.6, -0.7);
const CELLS: usize = 48;

/// The corner with a material of its own for each facet: diffuse ones, and mirrors with a diffuse part where `mirrors`.
fn case(mirrors: bool) -> Case {
    let mut mesh = scenes::corner(3);
    let material = |facet: usize| {
        let rho = 0.3 + 0.05 * (facet * 5 % 9) as f64;
        let specular = if mirrors && mesh.materials[facet] == 1 { 0.25 } else { 0.0 };
        Material::spectral(&[rho, 0.9 * rho], &[specular, 0.8 * specular]).emitting(0.02 * (facet % 3) as f64)
    };
    let materials: Vec<Material> = (0..mesh.facets.len()).map(material).collect();
    mesh.materials = (0..mesh.facets.len() as u32).collect();
    Case::new(mesh, &materials)
}

/// Settings by which the solver goes on to rounding.
fn converged(tolerance: f64) -> Settings {
    let mut settings = Settings::new(tolerance, None).unwrap();
    (settings.budget.solver, settings.budget.solver_accelerated) = (1e-15, 1e-17);
    settings
}

/// A geometry under other materials.
fn with_lights<R>(
    case: &Case,
    geometry: &Geometry<'_>,
    settings: &Settings,
    with: impl FnOnce(&Lights<'_>) -> R,
) -> R {
    case.with_input(|input| {
        let mut memory = Memory::new(Scene::bytes(input).unwrap());
        let scene = Scene::new(input, memory.bytes_mut()).unwrap();
        let coupling = geometry.coupling().unwrap();
        let (bvh, elements) = (geometry.bvh(), geometry.elements());
        with(&Lights { scene: &scene, bvh, elements, coupling: &coupling, settings })
    })
}

/// Radiant intensity of each band.
fn intensity(lights: &Lights<'_>, input: &LightInput<'_>) -> Vec<f64> {
    let light = input.light(lights.scene).unwrap();
    let mut memory = Memory::new(lights.bytes(&light).unwrap());
    lights.start(memory.bytes_mut()).unwrap();
    let solution = lights.solve(input, &light, None, memory.bytes_mut()).unwrap();
    let (scene, bvh, elements) = (lights.scene, lights.bvh, lights.elements);
    let settings = lights.settings.chains(0);
    let rows = blik_kernel::chain::KnownRows::new(lights.coupling);
    let solved = blik_kernel::chain::Solved { scene, bvh, elements, rows, light: &light, solution, settings };
    let view = signature::View::new(&solved, VIEW, CELLS).unwrap();
    let mut scratch = Memory::new(signature::scratch_bytes().unwrap());
    let sums = signature::whole(&solved, &view, scratch.bytes_mut()).unwrap();
    (0..scene.bands()).map(|band| Signature::new(sums, band, 1.0, 0.0).intensity).collect()
}

/// Intensities, derivatives by diffuse reflectances and by emissions.
fn derivatives(lights: &Lights<'_>, input: &LightInput<'_>) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let light = input.light(lights.scene).unwrap();
    let mut memory = Memory::new(lights.explain_bytes(&light).unwrap());
    lights.start(memory.bytes_mut()).unwrap();
    let mut all = (vec![], vec![], vec![]);
    let (chains, views) = (lights.settings.chains(0), [VIEW.to_array()]);
    let given = ((input, &light), (&views[..], CELLS));
    lights
        .explain(given.0, None, given.1, chains, memory.bytes_mut(), |_, found| {
            let bands = lights.scene.bands();
            all.0 = (0..bands).map(|band| Signature::new(found.sums, band, 1.0, 0.0).intensity).collect();
            all.1 = found.importance.diffuse.to_vec();
            all.2 = found.importance.emission.to_vec();
            Ok(())
        })
        .unwrap();
    all
}

/// Central difference quotient of a quantity.
const STEP: f64 = 1e-4;

/// Holds a derivative to a difference: to 1e-6 of it, and to 1e-9 of the largest derivative, for rounding of sums over all
/// rays beside differences of 1e-4 of them.
#[track_caller]
fn hold(what: &str, derivative: f64, difference: f64, largest: f64) {
    let off = (derivative - difference).abs();
    assert!(
        off <= 1e-6 * difference.abs() + 1e-9 * largest,
        "{what}: {derivative:e}, by differences {difference:e} ({:.1e} of it)",
        off / difference.abs()
    );
}

fn check(case: &Case, input: &LightInput<'_>) {
    let facets = case.mesh.facets.len();
    let host = Host::new(2).unwrap();
    case.with_geometry(2, &within(2e-2), |_, geometry| {
        let settings = converged(2e-2);
        let (value, by_diffuse, by_emission) =
            with_lights(case, geometry, &settings, |lights| derivatives(lights, input));
        let own = with_lights(case, geometry, &settings, |lights| intensity(lights, input));
        assert_eq!(value, own, "the signature's own bits");
        let largest = by_diffuse.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let mut checked = 0;
        for facet in 0..facets {
            let moved = |step: f64| {
                let mut case = case.clone();
                case.materials[facet].diffuse.iter_mut().for_each(|rho| *rho += step);
                with_lights(&case, geometry, &settings, |lights| intensity(lights, input))
            };
            let (more, less) = (moved(STEP), moved(-STEP));
            for band in 0..2 {
                let difference = (more[band] - less[band]) / (2.0 * STEP);
                hold(
                    &format!("facet {facet}, band {band}"),
                    by_diffuse[2 * facet + band],
                    difference,
                    largest,
                );
                checked += 1;
            }
        }
        assert!(checked >= 50, "{checked} derivatives");
        assert!(largest > 0.0);
        let largest = by_emission.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for facet in (0..facets).step_by(9) {
            let moved = |step: f64| {
                let mut case = case.clone();
                case.materials[facet].emission.iter_mut().for_each(|own| *own += step + 0.1);
                with_lights(&case, geometry, &settings, |lights| intensity(lights, input))
            };
            // emission is at least 0: both ways from 0.1 above it, where damped gradients are others
            let mut case = case.clone();
            case.materials[facet].emission.iter_mut().for_each(|own| *own += 0.1);
            let here = with_lights(&case, geometry, &settings, |lights| derivatives(lights, input)).2;
            let (more, less) = (moved(STEP), moved(-STEP));
            let sides = if case.two_sided { 2 } else { 1 };
            for band in 0..2 {
                let difference = (more[band] - less[band]) / (2.0 * STEP);
                let both = (0..sides).map(|side| here[(facet * sides + side) * 2 + band]).sum();
                hold(&format!("emission of {facet}, band {band}"), both, difference, largest);
            }
        }
    });
    drop(host);
}

#[test]
fn derivatives_are_differences_under_a_uniform_sky() {
    let sky = SkyOf::uniform(2);
    check(&case(false), &LightInput { sky: Some(sky.input()), ..LightInput::default() });
}

#[test]
fn derivatives_are_differences_with_mirrors_and_a_sun() {
    let sky =
        SkyOf::new(SkyModel::Cie { kind: 12, sun_direction: [0.4, 0.5, 0.8] }, &[1.0, 0.7], &[0.2, 0.1]);
    let sun = SunOf::new([0.4, 0.5, 0.8], &[2.0, 1.0], 0.2665);
    let light = LightInput { sky: Some(sky.input()), sun: Some(sun.input()), ..LightInput::default() };
    check(&case(true).two_sided(), &light);
}

#[test]
fn shares_and_terms_add_up_to_the_signature() {
    let sky = SkyOf::new(SkyModel::Overcast, &[1.0, 0.7], &[0.2, 0.1]);
    let sun = SunOf::new([0.4, 0.5, 0.8], &[2.0, 1.0], 0.2665);
    let lobe = Material { gloss: Some(12.0), ..Material::spectral(&[0.2, 0.4], &[0.4, 0.3]) };
    let diffuse = Material::spectral(&[0.6, 0.3], &[0.0, 0.0]);
    let mirror = Material::spectral(&[0.2, 0.1], &[0.6, 0.7]);
    let case = Case::new(scenes::corner(2), &[diffuse, mirror, lobe.emitting(0.1)]);
    let light = LightInput { sky: Some(sky.input()), sun: Some(sun.input()), ..LightInput::default() };
    case.with_geometry(2, &within(2e-2), |host, geometry| {
        let views = [VIEW, Vec3::new(-0.2, -0.1, -1.0)];
        let all = host.explain(geometry, &light, &views).unwrap();
        let lit = host.light_of(geometry, &light).unwrap();
        let own = host.signatures(&lit, &views).unwrap();
        for (found, (signature, _)) in all.iter().zip(&own) {
            assert_eq!(&found.signature, signature, "the bits of the signature alone");
            for band in 0..2 {
                let whole = signature.radiant_intensity[band];
                let every = |values: &[f64]| values.iter().skip(band).step_by(2).sum::<f64>();
                let terms: f64 = found.terms.iter().map(|term| term[band]).sum();
                // sums of the same numbers in another order
                for sum in [every(&found.facets), every(&found.materials), terms] {
                    assert!((sum - whole).abs() <= 1e-12 * whole, "{sum}, not {whole}");
                }
                assert!(found.terms[0][band] > 0.0 && found.terms[1][band] > 0.0, "diffuse and mirrored sky");
                assert!(found.materials.iter().skip(band).step_by(2).all(|share| *share > 0.0));
            }
        }
        // what is linear: its derivatives times the emissions, and the signatures of sky and sun, are all of it
        let dark = vec![0.0; case.mesh.facets.len() * 2];
        let reference = Some(lit.reference());
        let without = LightInput { emission: &dark, reference, ..light };
        let rest = &host.explain(geometry, &without, &views[..1]).unwrap()[0];
        for band in 0..2 {
            let emission = |facet: usize| if case.mesh.materials[facet] == 2 { 0.1 } else { 0.0 };
            let facets = 0..case.mesh.facets.len();
            let sent: f64 = facets.map(|facet| emission(facet) * all[0].by_emission[2 * facet + band]).sum();
            let sum = sent + rest.signature.radiant_intensity[band];
            let whole = all[0].signature.radiant_intensity[band];
            // gradients of elements are damped by noise, which is not linear: less than the tolerance
            assert!((sum - whole).abs() < 1e-2 * whole, "{sum}, not {whole}");
        }
    });
}

/// A facet that nothing else sees: I = (e + rho_d (L + E cos/pi)) A cos of the view, in closed form.
#[test]
fn one_facet_has_its_closed_form() {
    let vertices = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = scenes::Mesh { vertices, facets: vec![[0, 1, 2]], materials: vec![0] };
    let case = Case::new(mesh, &[Material::new(0.4, 0.0).emitting(0.25)]);
    let (sky, sun) = (SkyOf::uniform(1), SunOf::new([0.0, 0.6, 0.8], &[2.0], 0.0));
    let light = LightInput { sky: Some(sky.input()), sun: Some(sun.input()), ..LightInput::default() };
    case.with_geometry(1, &within(1e-2), |host, geometry| {
        let found = &host.explain(geometry, &light, &[Vec3::new(0.0, 0.0, -1.0)]).unwrap()[0];
        let arrives = 1.0 + 2.0 * 0.8 / std::f64::consts::PI;
        let area = found.signature.projected_area;
        // the outline is found on lines: its area is exact to their number
        assert!((area - 1.0).abs() < 1e-2);
        for (value, exact) in [
            (found.signature.radiant_intensity[0], 0.25 + 0.4 * arrives),
            (found.by_diffuse[0], arrives),
            (found.by_emission[0], 1.0),
            (found.facets[0], 0.25 + 0.4 * arrives),
        ] {
            assert!((value - exact * area).abs() < 1e-12, "{value}, not {exact} over {area}");
        }
    });
}

#[test]
fn counted_reflections_are_refused() {
    let sky = SkyOf::uniform(2);
    let settings = blik_kernel::host::Settings { max_bounces: Some(3), ..within(2e-2) };
    case(false).with_geometry(1, &settings, |host, geometry| {
        let light = LightInput { sky: Some(sky.input()), ..LightInput::default() };
        let refused = host.explain(geometry, &light, &[VIEW]).unwrap_err();
        assert!(matches!(refused, Error::Range { value: 3.0, .. }), "{refused:?}");
    });
}
