//! Images and facet irradiances against another program's (tests/data/references/README.md).

#[path = "support/kernel.rs"]
mod kernel;
mod support;

use blik_kernel::host::{Bytes, Settings};
use kernel::{irradiances, solve};
use std::f64::consts::PI;
use std::time::Instant;
use support::references::{self, FacetReference, Reference};
use support::{metric, scene_file, twin};

/// Images keep the default tolerance.
const GOAL: f64 = 2e-3;

/// Irradiances over pi: the tolerance is one of images, whose facets reflect a tenth to four tenths of it.
const FACETS_GOAL: f64 = 5e-3;

/// The mesh of 100,000 facets takes more than 10 s where tests run.
const LARGE: &str = "bowl_100k";

/// One line of the table.
struct Outcome {
    /// Over the pixels where the reference's own ray offset does not matter.
    eps: f64,
    facets: Option<Facets>,
    bytes: Bytes,
}

/// Rms of the irradiances over pi, the reference's noise taken out.
struct Facets {
    /// Over all facets.
    all: f64,
    /// Over the facets on which the reference's own ray offset does not matter.
    wide: f64,
    /// How many were left out of the latter.
    narrow: usize,
}

/// Runs one reference through the kernel's owning layer and prints its line.
fn run(reference: &Reference) -> Outcome {
    let (scene, camera) = scene_file::read(&reference.scene);
    let settings = Settings {
        reference_radiance: Some(vec![1.0]),
        all_irradiances: reference.facets.is_some(),
        directional: !matches!(scene.sky.as_ref().map(|s| &s.model), Some(twin::Model::Uniform)),
        ..Settings::default()
    };
    let start = Instant::now();
    solve(&scene, &settings, |host, lit| {
        let image = host.image(lit, &kernel::camera(&camera), false).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let (counted, sound) = (reference.counted(), reference.sound(&scene, &camera));
        let left_out = metric::pixels(&counted) - metric::pixels(&sound);
        // a hundredth at most: else the references show too little
        assert!(left_out * 100 <= metric::pixels(&counted), "{}: {left_out} left out", reference.id);
        let [all, eps] = [counted, sound].map(|pixels| {
            let eps = metric::eps(&image.pixels, &reference.image().values, &pixels, &[1.0]);
            metric::corrected(metric::worst(&eps).1, reference.image_standard_error)
        });
        let facets = reference.facets.as_ref().map(|f| compare_facets(&scene, &irradiances(lit), f));
        let columns = facets.as_ref().map_or(String::new(), |f| {
            format!(", facets {:.2e}, without {} narrow ones {:.2e}", f.all, f.narrow, f.wide)
        });
        let estimate = image.report.error_estimate;
        println!(
            "{:24} eps_c {all:.2e}, without {left_out} pixels led astray {eps:.2e}, estimate {estimate:.2e}, \
             {seconds:.1} s{columns}",
            reference.id
        );
        Outcome { eps, facets, bytes: image.report.bytes }
    })
}

/// The reference's renderer starts its rays 9e-5 (1 + |p|) off the surface: they jump over whatever is nearer. A
/// facet less than ten such offsets wide (width = 2 area/longest edge) is not judged.
fn is_wide(scene: &twin::Scene, facet: usize) -> bool {
    let [a, b, c] = scene.corners[facet];
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let offset = references::OFFSET * (1.0 + ((a + b + c) / 3.0).length());
    2.0 * scene.areas[facet] / longest >= 10.0 * offset
}

fn compare_facets(scene: &twin::Scene, irradiances: &[f64], reference: &FacetReference) -> Facets {
    let (truth, errors) = (reference.irradiance_over_pi(), reference.standard_errors());
    assert_eq!(truth.len(), irradiances.len());
    let rms = |chosen: &[usize]| {
        let pick = |values: &[f64], by: f64| chosen.iter().map(|&f| values[f] * by).collect::<Vec<_>>();
        let noise = metric::rms(&pick(&errors, 1.0), &vec![0.0; chosen.len()]);
        metric::corrected(metric::rms(&pick(irradiances, 1.0 / PI), &pick(&truth, 1.0)), noise)
    };
    let all: Vec<usize> = (0..truth.len()).filter(|&f| scene.areas[f] > 0.0).collect();
    let wide: Vec<usize> = all.iter().copied().filter(|&f| is_wide(scene, f)).collect();
    Facets { all: rms(&all), wide: rms(&wide), narrow: all.len() - wide.len() }
}

fn check(reference: &Reference) -> Outcome {
    let outcome = run(reference);
    assert!(outcome.eps <= GOAL, "{}: eps_c {:.2e}", reference.id, outcome.eps);
    if let Some(facets) = &outcome.facets {
        assert!(facets.wide <= FACETS_GOAL, "{}: irradiance/pi off by {:.2e} rms", reference.id, facets.wide);
    }
    outcome
}

#[test]
fn every_reference_is_met() {
    let all = references::all();
    let mut done = 0;
    for reference in all.iter().filter(|r| !r.id.starts_with(LARGE)) {
        let outcome = check(reference);
        if reference.id.starts_with("airplane") {
            let Bytes { scene, bvh, coupling, light, image } = outcome.bytes;
            let sum = scene + bvh + coupling + light + image;
            println!("{:24} {:.1} MiB", "", sum as f64 / 1048576.0);
            assert!(sum < 64 << 20, "{}: {sum} bytes", reference.id);
        }
        done += 1;
    }
    // seven are in the repository
    assert!(done >= 7, "{done} references found");
}

/// Where the airplane's reference disagrees about narrow facets, the twin, whose rays start on the facet itself, sides
/// with the kernel: that is why they may be left out.
#[test]
#[ignore = "needs the airplane's reference, which is not in the repository"]
fn the_twin_settles_what_narrow_facets_receive() {
    let airplane = references::all().into_iter().find(|r| r.id == "airplane_d0.4_s0_csun");
    let reference = airplane.expect("the airplane's reference is where the others are");
    let (scene, _) = scene_file::read(&reference.scene);
    let settings = Settings { all_irradiances: true, ..Settings::default() };
    let mine = solve(&scene, &settings, |_, lit| irradiances(lit));
    let theirs = reference.facets.as_ref().unwrap().irradiance_over_pi();
    let disputed: Vec<usize> = (0..mine.len()).filter(|&f| (mine[f] / PI - theirs[f]).abs() > 0.05).collect();
    assert!(!disputed.is_empty());
    for facet in disputed {
        let effort = twin::Effort { seed: facet as u64, ..twin::Effort::rays(512) };
        let estimate = twin::facet_irradiance(&scene, facet, true, effort);
        let (judge, error) = (estimate.mean[0] / PI, estimate.standard_error[0] / PI);
        let (mine, theirs) = (mine[facet] / PI, theirs[facet]);
        println!("facet {facet}: kernel {mine:.4}, twin {judge:.4} +- {error:.4}, reference {theirs:.4}");
        assert!(!is_wide(&scene, facet), "{facet} is no narrow facet");
        // the kernel's 256 points in a penumbra or shadow edge: 1.6 % of the sun's 1; the twin's 4 standard errors
        assert!((mine - judge).abs() < 1.6e-2 + 4.0 * error, "facet {facet}: {mine} against {judge}");
        assert!((theirs - judge).abs() > 4.0 * error, "facet {facet}: the reference is right");
    }
}

#[test]
#[ignore = "100,000 facets: more than 10 s"]
fn a_large_mesh_is_met() {
    for reference in references::all().iter().filter(|r| r.id.starts_with(LARGE)) {
        check(reference);
    }
}
