//! Couplings that are kept while materials change: what is kept, and that the light is that of a coupling from scratch.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::coupling::kept::Fates;
use blik_kernel::error::{Error, Field};
use blik_kernel::host::{Geometry, GeometryMemory, Host, Image, Settings};
use blik_kernel::light::LightInput;
use blik_kernel::math::Vec3;
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic, rms, within};
use support::scenes;
use support::twin::Material;

/// What a coupling shows of a case.
struct Shown {
    image: Image,
    /// Radiant intensity and its error, band by band.
    signature: Vec<[f64; 2]>,
}

fn shown(host: &Host, geometry: &Geometry<'_>, case: &Case) -> Shown {
    let (sky, sun) = (case.sky.as_ref().map(SkyOf::input), case.sun.as_ref().map(SunOf::input));
    let reference = vec![1.0; case.bands()];
    let input = LightInput { sky, sun, reference: Some(&reference), ..LightInput::default() };
    let lit = host.light_of(geometry, &input).unwrap();
    let camera = orthographic([3.0, 2.0, 2.5], [0.4, 0.45, 0.3], 2.0, 32);
    let image = host.image(&lit, &camera, false).unwrap();
    let (signature, _) = host.signature(&lit, Vec3::new(-3.0, -2.0, -2.5)).unwrap();
    let all = signature.radiant_intensity.iter().zip(&signature.error);
    Shown { image, signature: all.map(|(value, error)| [*value, *error]).collect() }
}

/// Updates the coupling of one case for the materials of another, and holds it against one from scratch: images and
/// signatures within the sum of both estimates. Returns what became of the rows, and the rays that took.
#[track_caller]
fn updated(name: &str, before: &Case, after: &Case, settings: &Settings) -> (Fates, u64) {
    let scratch = after.with_geometry(2, settings, |host, geometry| shown(host, geometry, after));
    before.with_geometry(2, settings, |host, kept| {
        let mut first = None;
        for threads in [1, 2] {
            let (host_now, mut memory) = (Host::new(threads).unwrap(), GeometryMemory::default());
            let geometry = after.with_input(|input| host_now.update(kept, &mut memory, input)).unwrap();
            let now = shown(host, &geometry, after);
            let known = first.get_or_insert_with(|| now.image.pixels.clone());
            assert!(known == &now.image.pixels, "{name}: {threads} threads");
            let off = rms(&now.image.pixels, &scratch.image.pixels);
            let [a, b] = [&now, &scratch].map(|shown| shown.image.report.error_estimate);
            println!("{name}: images differ by {off:.1e}, estimates {a:.1e} and {b:.1e}");
            assert!(off <= a + b, "{name}: {off:.2e} above {a:.2e} + {b:.2e}");
            for ([a, ea], [b, eb]) in now.signature.iter().zip(&scratch.signature) {
                assert!((a - b).abs() <= ea + eb, "{name}: {a} +- {ea} and {b} +- {eb}");
            }
            // only what was redone took rays
            let report = geometry.report();
            assert!(report.rows.redone > 0 || report.rays.visibility == 0, "{name}: {:?}", report.rows);
            if threads == 2 {
                let unknowns = geometry.elements().unknowns() as u64;
                assert_eq!(report.rows.kept + report.rows.rescaled + report.rows.redone, unknowns, "{name}");
                println!("{name}: {:?}, {} rays", report.rows, report.rays.visibility);
                return (report.rows, report.rays.visibility);
            }
        }
        unreachable!()
    })
}

fn lit(case: Case) -> Case {
    let bands = case.bands();
    case.sky(SkyOf::new(SkyModel::Gradient, &vec![1.0; bands], &vec![0.3; bands])).sun(SunOf::new(
        [0.5, 0.75, 1.0],
        &vec![1.5; bands],
        0.27,
    ))
}

/// The same with other materials.
fn with(case: &Case, materials: &[Material]) -> Case {
    Case { materials: materials.to_vec(), ..case.clone() }
}

fn three(diffuse: [f64; 3], specular: [f64; 3], gloss: Option<f64>) -> Vec<Material> {
    let of = |k: usize| {
        let tint = |x: f64| vec![x, 0.8 * x];
        let material = Material::spectral(&tint(diffuse[k]), &tint(specular[k]));
        if k == 2 { Material { gloss, ..material } } else { material }
    };
    (0..3).map(of).collect()
}

/// The kinds of scenes, each of three materials: a corner, sheets with both sides, a glossy wall, facets in clusters.
fn kinds(diffuse: [f64; 3], specular: [f64; 3]) -> Vec<(&'static str, Case, f64)> {
    let plain = three(diffuse, specular, None);
    let ball = scenes::sphere(1).scaled(0.25).translated([0.45, 0.5, 0.4]);
    let sheet = scenes::tilted_square(0.6).scaled(0.5).translated([0.3, 0.3, 0.5]);
    let fine = scenes::corner(4).joined(&ball).subdivided(3);
    vec![
        ("corner", lit(Case::new(scenes::corner(2), &plain)), 1e-2),
        ("sheets", lit(Case::new(scenes::corner(2).joined(&sheet), &plain).two_sided()), 1e-2),
        (
            "gloss",
            lit(Case::new(scenes::corner(2).joined(&ball), &three(diffuse, specular, Some(8.0)))),
            1e-2,
        ),
        ("clusters", lit(Case::new(fine, &plain)), 2e-2),
    ]
}

#[test]
fn new_diffuse_reflectances_trace_no_ray() {
    for (mirrors, specular) in [("", [0.0; 3]), (" with mirrors", [0.0, 0.4, 0.3])] {
        for (name, before, tolerance) in kinds([0.6, 0.3, 0.4], specular) {
            let name = format!("{name}{mirrors}");
            let gloss = before.materials[2].gloss;
            let after = with(&before, &three([0.3, 0.55, 0.2], specular, gloss));
            let (fates, rays) = updated(&name, &before, &after, &within(tolerance));
            assert!(fates.rescaled == 0 && fates.redone == 0 && rays == 0, "{name}: {fates:?}");
        }
    }
}

#[test]
fn mirrors_that_reflect_less_multiply_rows() {
    for (name, before, tolerance) in kinds([0.5, 0.3, 0.4], [0.0, 0.5, 0.3]) {
        let gloss = before.materials[2].gloss;
        let after = with(&before, &three([0.5, 0.5, 0.4], [0.0, 0.2, 0.1], gloss));
        let (fates, rays) = updated(name, &before, &after, &within(tolerance));
        assert!(fates.rescaled > 0 && fates.redone == 0 && rays == 0, "{name}: {fates:?}");
    }
}

#[test]
fn mirrors_that_reflect_more_redo_rows_whose_chains_were_cut() {
    // one mirror alone cuts no chain, and is multiplied; two cut chains between them
    for (name, before, tolerance) in kinds([0.5, 0.3, 0.4], [0.0, 0.2, 0.0]) {
        let after = with(&before, &three([0.5, 0.3, 0.4], [0.0, 0.6, 0.0], before.materials[2].gloss));
        let (fates, _) = updated(name, &before, &after, &within(tolerance));
        assert!(fates.rescaled > 0, "{name}: {fates:?}");
        assert!(name != "corner" || fates.redone == 0, "{name}: {fates:?}");
    }
    let facing = scenes::parallel_squares(0.5);
    let sides = |rho: f64| three([0.3, 0.3, 0.3], [rho; 3], None);
    let before = lit(Case::new(facing, &sides(0.3)));
    let (fates, rays) = updated("facing", &before, &with(&before, &sides(0.6)), &within(1e-2));
    assert!(fates.redone > 0 && rays > 0, "{fates:?}");
}

#[test]
fn what_sent_nothing_and_what_begins_to_mirror_is_met_anew() {
    for (name, before, tolerance) in kinds([0.5, 0.0, 0.4], [0.0, 0.0, 0.2]) {
        let gloss = before.materials[2].gloss;
        // black facets reflect: rows of their own, and of all that may have met them
        let after = with(&before, &three([0.5, 0.4, 0.4], [0.0, 0.0, 0.2], gloss));
        let (fates, rays) = updated(name, &before, &after, &within(tolerance));
        assert!(fates.redone > 0 && rays > 0, "{name}: {fates:?}");
        let after = with(&before, &three([0.5, 0.0, 0.4], [0.3, 0.0, 0.2], gloss));
        let (fates, rays) = updated(name, &before, &after, &within(tolerance));
        assert!(fates.redone > 0 && rays > 0, "{name}: {fates:?}");
    }
}

/// Materials by facet: half of the mirrors of one class change, which their paths cannot tell apart.
#[test]
fn facets_of_one_mirror_that_part_are_redone() {
    let before = lit(Case::new(scenes::corner(2), &three([0.5, 0.3, 0.4], [0.0, 0.4, 0.0], None)));
    let mut materials = before.materials.clone();
    materials.push(Material::spectral(&[0.3, 0.2], &[0.1, 0.3]));
    let mut after = with(&before, &materials);
    for (facet, material) in after.mesh.materials.iter_mut().enumerate() {
        *material = if *material == 1 && facet % 2 == 0 { 3 } else { *material };
    }
    let (fates, rays) = updated("parted", &before, &after, &within(1e-2));
    assert!(fates.redone > 0 && rays > 0 && fates.kept > 0, "{fates:?}");
    // a lobe in place of an ideal mirror
    let gloss = Material { gloss: Some(10.0), ..before.materials[1].clone() };
    let after = with(&before, &[before.materials[0].clone(), gloss, before.materials[2].clone()]);
    let (fates, _) = updated("lobe", &before, &after, &within(1e-2));
    assert!(fates.redone > 0, "{fates:?}");
    // the same materials in another order, and one for each facet: the same bits
    let mut after = with(&before, &before.materials.iter().rev().cloned().collect::<Vec<_>>());
    after.mesh.materials.iter_mut().for_each(|material| *material = 2 - *material);
    let (fates, rays) = updated("renamed", &before, &after, &within(1e-2));
    assert!(fates.rescaled == 0 && fates.redone == 0 && rays == 0, "{fates:?}");
    let each =
        before.mesh.materials.iter().map(|m| before.materials[*m as usize].clone()).collect::<Vec<_>>();
    let mut after = with(&before, &each);
    after.mesh.materials = (0..each.len() as u32).collect();
    updated("each", &before, &after, &within(1e-2));
    let bits = |case: &Case, of: &Case| {
        of.with_geometry(2, &within(1e-2), |host, kept| {
            let mut memory = GeometryMemory::default();
            let geometry = case.with_input(|input| host.update(kept, &mut memory, input)).unwrap();
            shown(host, &geometry, case).image.pixels
        })
    };
    assert!(bits(&after, &before) == bits(&before, &before));
    let scratch =
        before.with_geometry(2, &within(1e-2), |host, kept| shown(host, kept, &before).image.pixels);
    assert!(bits(&before, &before) == scratch, "nothing changed: the same bits");
}

#[test]
fn other_meshes_and_elements_of_several_materials_are_refused() {
    let (name, before, tolerance) = kinds([0.6, 0.3, 0.4], [0.0; 3]).pop().unwrap();
    assert_eq!(name, "clusters");
    before.with_geometry(2, &within(tolerance), |host, kept| {
        let refused = |case: &Case| {
            let mut memory = GeometryMemory::default();
            case.with_input(|input| host.update(kept, &mut memory, input).map(|_| ()).unwrap_err())
        };
        let mut moved = before.clone();
        moved.mesh.vertices[0][2] += 1e-3;
        assert_eq!(refused(&moved), Error::Mismatch { what: "mesh" });
        let two_sided = before.clone().two_sided();
        assert_eq!(refused(&two_sided), Error::Mismatch { what: "mesh" });
        let elements = kept.elements();
        let cluster = elements.facets_of(0);
        assert!(cluster.len() > 1);
        let facet = cluster.iter().copied().find(|f| *f as usize != elements.facet_of(0).0).unwrap() as usize;
        let mut mixed = before.clone();
        mixed.mesh.materials[facet] = (mixed.mesh.materials[facet] + 1) % 3;
        assert_eq!(refused(&mixed), Error::Uncoupled { facet, field: Field::FacetMaterials });
        let bright = with(&before, &three([1.2, 0.3, 0.4], [0.0; 3], None));
        assert!(matches!(refused(&bright), Error::MaterialRange { material: 0, .. }));
    });
}
