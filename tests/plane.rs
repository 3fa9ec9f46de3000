//! The plane model with diffuse surfaces and ideal mirrors, against its reference solver and golden values.
//!
//! T1 to T7 are the acceptance tests of the method's study; letters name its variants: A flat facets, D true circles
//! with constant elements, G linear between centres, H with four chains a pair, and the kernel's own panels.

#[path = "support/plane_kernel.rs"]
mod plane_kernel;
#[allow(dead_code)]
#[path = "support/plane_reference/mod.rs"]
mod plane_reference;

use blik_kernel::plane::Vec2;
use blik_kernel::plane::host::Settings;
use blik_kernel::plane::light::{Light, Sky};
use blik_kernel::plane::rows::{self, Method, RowInfo, RowSettings};
use blik_kernel::plane::scene::{Basis, BodyInput, PlaneInput, PlaneMaterial, PlaneScene, RaySet, Shape};
use blik_kernel::plane::scratch::Scratch;
use blik_kernel::{Error, Field};
use plane_kernel::{SAMPLES, eps, flat, image, method, pair, solve, uniform, variants};
use plane_reference::diffuse::{Resolution, Solution};
use plane_reference::scene::{Scene, Shape as Form, Surface, V};
use std::f64::consts::PI;

fn one(_: V) -> f64 {
    1.0
}

fn truth(scene: &Scene, bounces: Option<usize>) -> Vec<Option<f64>> {
    Solution::new(scene, &one, &[], bounces, Resolution::FINE).image(0.0, SAMPLES)
}

/// Abscissae of the golden values, and the values by (rho_d, rho_s).
const AT: [f64; 4] = [-1.125, -0.875, -0.625, -0.375];
const GOLDEN: [((f64, f64), [f64; 4]); 9] = [
    ((0.4, 0.0), [0.39898607, 0.38885136, 0.35908898, 0.27863401]),
    ((0.3, 0.1), [0.39924401, 0.39178928, 0.36983465, 0.22720854]),
    ((0.2, 0.2), [0.39949887, 0.39462361, 0.38022699, 0.16847786]),
    ((0.1, 0.3), [0.39975082, 0.39735903, 0.39027821, 0.10149747]),
    ((0.0, 0.4), [0.4, 0.4, 0.4, 0.0256]),
    ((0.8, 0.0), [0.79930504, 0.79181936, 0.76752015, 0.69394557]),
    ((0.4, 0.4), [0.79966178, 0.79624929, 0.78509204, 0.57599082]),
    ((0.0, 0.8), [0.8, 0.8, 0.8, 0.4096]),
    ((0.5, 0.5), [1.0; 4]),
];
/// The last of them with at most four reflections.
const GOLDEN_FOUR: [f64; 9] =
    [0.27833949, 0.22667048, 0.16769037, 0.10072657, 0.0256, 0.68106842, 0.54382799, 0.4096, 0.88579432];

/// Settings of the kernel's own method at a tolerance, and elements of a circle of the study.
fn own(tolerance: f64) -> (Settings, u32) {
    (Settings::for_tolerance(tolerance), if tolerance > 2e-5 { 12 } else { 16 })
}

#[test]
fn the_reference_reproduces_the_golden_values() {
    for ((rho, values), four) in GOLDEN.iter().zip(GOLDEN_FOUR) {
        let scene = pair(2.5, rho.0, rho.1, None);
        let all = Solution::new(&scene, &one, &[], None, Resolution::FINE);
        for (x, want) in AT.iter().zip(values) {
            let got = all.radiance([*x, 9.0], [0.0, -1.0]).unwrap();
            // the resolution's own error; the golden values are right to 1e-7
            assert!((got - want).abs() < 4e-6, "{rho:?} {x}: {got} {want}");
        }
        let capped = Solution::new(&scene, &one, &[], Some(4), Resolution::FINE);
        let got = capped.radiance([-0.375, 9.0], [0.0, -1.0]).unwrap();
        assert!((got - four).abs() < 4e-6, "{rho:?}: {got} {four}");
        assert!(capped.radiance([-0.125, 9.0], [0.0, -1.0]).is_none());
    }
    let scene = pair(2.5, 0.2, 0.2, None);
    let solution = Solution::new(&scene, &one, &[], None, Resolution::FINE);
    let facing = [0.09977305, 0.11371150, 0.14334535, 0.17139176, 0.18920483, 0.19765758, 0.2];
    for (i, want) in facing.iter().enumerate() {
        let got = solution.diffuse(0, i as f64 * 15.0 / 360.0, 0);
        // at the ends of panels, where polynomials are worst
        assert!((got - want).abs() < 1e-5, "{} degrees: {got} {want}", i * 15);
    }
}

#[test]
fn t1_form_factor_between_circles() {
    // [sqrt(X^2 - 1) + asin(1/X) - X]/pi, X = 1.25
    let exact = ((1.25f64 * 1.25 - 1.0).sqrt() + (1.0f64 / 1.25).asin() - 1.25) / PI;
    assert!((exact - 0.136012292).abs() < 1e-9);
    for (n, tolerance) in [(64, 1e-4), (512, 2e-6)] {
        let input = |m: &[PlaneMaterial], bodies: &[BodyInput<'_>]| {
            let input = PlaneInput { bodies, materials: m };
            let mut memory = vec![0; PlaneScene::bytes(&input).unwrap()];
            let scene = PlaneScene::new(&input, Basis::Constant, 1e-3, &mut memory).unwrap();
            let mut memory = vec![0; Scratch::bytes(&scene, 0).unwrap()];
            let mut scratch = Scratch::new(&scene, 0, &mut memory).unwrap();
            let settings =
                RowSettings { method: Method::Facets { chains: 0 }, max_bounces: None, cutoff: 1e-9 };
            let count = scene.unknowns();
            let (mut matrix, mut open) = (vec![0.0; count * count], vec![0.0; count]);
            let mut info = vec![RowInfo::default(); count];
            rows::fill(&scene, &settings, 0..count, &mut matrix, &mut open, &mut info, &mut scratch).unwrap();
            // any split of the rows gives the same bits
            let (mut part, mut part_open) = (vec![0.0; 5 * count], [0.0; 5]);
            let range = 40..45;
            let infos = &mut info[range.clone()];
            rows::fill(&scene, &settings, range.clone(), &mut part, &mut part_open, infos, &mut scratch)
                .unwrap();
            assert_eq!(part[..], matrix[range.start * count..range.end * count]);
            assert_eq!(part_open[..], open[range]);
            let rows = matrix.chunks(count).map(|r| r.iter().sum::<f64>());
            for (row, open) in rows.clone().zip(&open) {
                // closure: sums of some N products
                assert!((row + open - 1.0).abs() < 1e-13);
            }
            rows.sum::<f64>() / count as f64
        };
        let m = [PlaneMaterial { diffuse: 0.5, specular: 0.0, gloss: None }];
        let circle = |x| BodyInput {
            shape: Shape::Circle { centre: [x, 0.0], radius: 1.0 },
            material: 0,
            elements: n,
        };
        let mean = input(&m, &[circle(-1.25), circle(1.25)]);
        // the midpoint rule over the circle, whose integrand has kinks where the other circle rises
        assert!((mean - exact).abs() < tolerance, "{n}: {mean} {exact}");
    }
}

#[test]
fn t2_white_furnace() {
    for rho in [(0.5, 0.5), (0.1, 0.9)] {
        let settings = |letter| Settings { cutoff: 1e-13, solver: 1e-13, ..method(letter) };
        let scene = pair(2.5, rho.0, rho.1, None);
        let own = Settings { cutoff: 1e-13, solver: 1e-13, ..Settings::for_tolerance(1e-5) };
        for image in [
            flat(64, rho, &settings('A'), false),
            flat(64, rho, &settings('F'), true),
            image(&scene, 64, &settings('G'), &uniform(), 0.0),
            image(&scene, 16, &own, &uniform(), 0.0),
        ] {
            for radiance in image.iter().flatten() {
                // the rows close by construction; the solver's goal
                assert!((radiance - 1.0).abs() < 1e-10, "{rho:?}: {radiance}");
            }
        }
    }
}

#[test]
fn t3_golden_values() {
    for (letter, tolerance) in [('D', 1.5e-3), ('G', 2e-4), ('H', 1e-4), ('P', 5e-5)] {
        let (settings, n) = if letter == 'P' { own(1e-5) } else { (method(letter), 512) };
        let mut worst = 0.0f64;
        for ((rho, values), four) in GOLDEN.iter().zip(GOLDEN_FOUR) {
            let scene = pair(2.5, rho.0, rho.1, None);
            let at = |max_bounces: Option<u32>| {
                let settings = Settings { max_bounces, ..settings };
                solve(&scene, n, RaySet::Gauss([3; 3]), &uniform(), &settings, |s, _, scratch| {
                    AT.map(|x| s.radiance(Vec2::new(x, 9.0), -Vec2::Y, scratch).radiance)
                })
            };
            let all = at(None);
            worst = all.iter().zip(values).map(|(a, b)| (a - b).abs()).fold(worst, f64::max);
            if letter == 'P' {
                // four reflections at most; the same tolerance as all
                worst = worst.max((at(Some(4))[3] - four).abs());
            }
        }
        println!("{letter}: worst of the golden values {worst:.2e}");
        assert!(worst < tolerance, "{letter}: {worst}");
    }
}

/// eps over the samples that hit both: a polygon's outline is inside the circle's.
fn inside(image: &[Option<f64>], truth: &[Option<f64>]) -> f64 {
    let both: Vec<_> = truth.iter().zip(image).map(|(t, i)| t.filter(|_| i.is_some())).collect();
    let image: Vec<_> = both.iter().zip(image).map(|(t, i)| i.filter(|_| t.is_some())).collect();
    eps(&image, &both)
}

#[test]
fn t4_order_of_convergence() {
    let scene = pair(2.5, 0.4, 0.0, None);
    let truth = truth(&scene, None);
    let mut before = f64::NAN;
    for n in [64u32, 128] {
        // the study's linear method: form factors of chords
        let chords = inside(&flat(n as usize, (0.4, 0.0), &method('F'), true), &truth) * f64::from(n * n);
        let constant = eps(&image(&scene, n, &method('D'), &uniform(), 0.0), &truth) * f64::from(n);
        let linear = eps(&image(&scene, n, &method('G'), &uniform(), 0.0), &truth) * f64::from(n * n);
        println!(
            "N = {n}: constant {constant:.3}/N, linear {chords:.3}/N^2 on chords and {linear:.3}/N^2 on arcs"
        );
        assert!((constant - 0.18).abs() < 0.018, "{constant}");
        assert!((chords - 0.95).abs() < 0.095, "{chords}");
        // form factors of the arcs themselves do better
        assert!(linear < 0.8 * chords, "{linear}");
        assert!(before.is_nan() || (linear / before - 1.0).abs() < 0.1, "{before} {linear}");
        before = linear;
    }
}

#[test]
fn t5_the_papers_accuracy() {
    for (rd, rs) in &variants()[..5] {
        let scene = pair(2.5, *rd, *rs, None);
        let (all, four) = (truth(&scene, None), truth(&scene, Some(4)));
        for letter in ['D', 'G'] {
            let image = image(&scene, 128, &method(letter), &uniform(), 0.0);
            for truth in [&all, &four] {
                assert!(eps(&image, truth) < 2e-3, "{letter} ({rd}, {rs})");
            }
        }
    }
}

#[test]
fn t6_three_against_four_reflections() {
    let table = [4.90e-4, 5.74e-4, 7.77e-4, 1.33e-3, 2.72e-3, 7.84e-3, f64::NAN, 1.24e-2, f64::NAN, 4.35e-2];
    let tail = [1.30e-4, 1.41e-4, 1.79e-4, 3.09e-4, 7.14e-4, 5.70e-3, f64::NAN, 7.39e-3, f64::NAN, 2.53e-2];
    for ((rd, rs), (want, rest)) in variants().iter().zip(table.iter().zip(tail)) {
        if want.is_nan() {
            continue;
        }
        let scene = pair(2.5, *rd, *rs, None);
        let [three, four, all] = [Some(3), Some(4), None].map(|b| truth(&scene, b));
        let (got, left) = (eps(&three, &four), eps(&four, &all));
        println!("({rd:.1}, {rs:.1}): eps(3, 4) {got:.2e}, eps(4, all) {left:.2e}");
        // where mirrors dominate eps counts samples beyond a jump
        assert!((got / want - 1.0).abs() < 0.05 && (left / rest - 1.0).abs() < 0.05, "({rd}, {rs})");
    }
}

#[test]
fn t7_light_by_way_of_mirrors_counts() {
    let scene = pair(2.5, 0.4, 0.4, None);
    let without = Settings { method: Method::Facets { chains: 0 }, ..method('G') };
    let got = eps(&image(&scene, 256, &without, &uniform(), 0.0), &truth(&scene, None));
    println!("without mirrors in the coupling: {got:.2e}");
    assert!((got / 4.3e-2 - 1.0).abs() < 0.05, "{got}");
}

#[test]
fn flat_facets_need_exact_normals() {
    // the silhouette in the mirror image moves with the facet's normal (study: 1.1e-2 and 1.8e-3 at N = 128)
    let truth = truth(&pair(2.5, 0.2, 0.2, None), None);
    let facets = inside(&flat(128, (0.2, 0.2), &method('A'), false), &truth);
    let smooth = inside(&flat(128, (0.2, 0.2), &method('F'), true), &truth);
    println!("N = 128: facet normals {facets:.2e}, interpolated normals {smooth:.2e}");
    assert!(facets > 5e-3 && smooth < 0.5 * facets, "{facets} {smooth}");
}

#[test]
fn ten_variants_at_1e_4_and_1e_5() {
    for (rd, rs) in variants() {
        let scene = pair(2.5, rd, rs, None);
        let truth = Solution::new(&scene, &one, &[], None, Resolution::FINEST).image(0.0, SAMPLES);
        for tolerance in [1e-4, 1e-5] {
            let (settings, n) = own(tolerance);
            let got = eps(&image(&scene, n, &settings, &uniform(), 0.0), &truth);
            println!("({rd:.1}, {rs:.1}) at {tolerance:.0e}: {got:.1e}");
            assert!(got < tolerance, "({rd}, {rs}): {got}");
        }
    }
}

fn circle(x: f64, y: f64, radius: f64, rho: (f64, f64)) -> Surface {
    Surface { shape: Form::Circle { centre: [x, y], radius }, diffuse: rho.0, specular: rho.1, lobe: None }
}

fn chain_of(points: &[V], rho: (f64, f64)) -> Vec<Surface> {
    let segment = |w: &[V]| Surface {
        shape: Form::Segment { a: w[0], b: w[1] },
        diffuse: rho.0,
        specular: rho.1,
        lobe: None,
    };
    points.windows(2).map(segment).collect()
}

#[test]
fn other_bodies() {
    let well = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]];
    let mut mixed = chain_of(&[[2.5, -1.2], [-2.5, -1.2]], (0.5, 0.3));
    mixed.push(circle(0.2, 0.0, 1.0, (0.2, 0.6)));
    let scenes = [
        ("gap 0.02", pair(2.02, 0.4, 0.4, None).surfaces, 96),
        ("unequal radii", vec![circle(-1.0, 0.0, 1.0, (0.3, 0.5)), circle(0.5, 0.3, 0.4, (0.6, 0.2))], 32),
        (
            "three circles",
            vec![
                circle(-1.2, 0.0, 1.0, (0.4, 0.3)),
                circle(1.1, 0.3, 0.8, (0.3, 0.4)),
                circle(0.1, 1.7, 0.6, (0.7, 0.1)),
            ],
            32,
        ),
        ("cavity", chain_of(&well, (0.4, 0.4)), 24),
        ("circle above a mirroring ground", mixed, 48),
    ];
    for (name, surfaces, n) in scenes {
        let scene = Scene { surfaces };
        let fine = Resolution { panels: 32, order: 5, points: 10, probes: 12 };
        let solution = Solution::new(&scene, &one, &[], None, fine);
        for g in [0.0, 0.3] {
            let truth = solution.image(g, SAMPLES);
            let got = eps(&image(&scene, n, &Settings::for_tolerance(2e-5), &uniform(), g), &truth);
            println!("{name}, view {g}: {got:.1e}");
            assert!(got < 1e-4, "{name}: {got}");
        }
    }
}

#[test]
fn a_sky_with_a_horizon() {
    let horizon = [[0.8, -0.6], [-0.8, 0.6]];
    let sky = |d: V| if plane_reference::scene::cross(horizon[0], d) > 0.0 { 0.9 + 0.3 * d[0] } else { 0.1 };
    let scene = pair(2.2, 0.3, 0.3, None);
    let fine = Resolution { panels: 48, ..Resolution::FINE };
    let truth = Solution::new(&scene, &sky, &horizon, None, fine).image(0.5, SAMPLES);
    let of = |d: Vec2| sky(d.to_array());
    let jumps = horizon.map(Vec2::from);
    let light = Light::new(Sky::Varying { radiance: &of, jumps: &jumps }, None).unwrap();
    let got = eps(&image(&scene, 48, &Settings::for_tolerance(1e-5), &light, 0.5), &truth);
    println!("half sky: {got:.1e}");
    assert!(got < 1e-4, "{got}");
}

#[test]
fn faults_name_the_offender() {
    let body = |shape, material| BodyInput { shape, material, elements: 4 };
    let round = |radius| Shape::Circle { centre: [0.0, 0.0], radius };
    let good = PlaneMaterial { diffuse: 0.5, specular: 0.5, gloss: None };
    let fault = |bodies: &[BodyInput<'_>], materials: &[PlaneMaterial]| {
        let input = PlaneInput { bodies, materials };
        let mut memory = vec![0; 4096];
        PlaneScene::new(&input, Basis::Linear, 1e-3, &mut memory).unwrap_err()
    };
    assert_eq!(fault(&[], &[good]), Error::NoFacets);
    assert_eq!(fault(&[body(round(1.0), 0)], &[]), Error::NoMaterials);
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            fault(&[body(round(1.0), 0), body(round(radius), 0)], &[good]),
            Error::Body { body: 1, .. }
        ));
    }
    let twice = [[0.0, 0.0], [0.0, 0.0]];
    let line = Shape::Polyline { points: &twice, closed: false, smooth: false };
    assert!(matches!(fault(&[body(line, 0)], &[good]), Error::Body { body: 0, .. }));
    assert_eq!(
        fault(&[body(round(1.0), 3)], &[good]),
        Error::MaterialOutOfRange { facet: 0, material: 3, materials: 1 }
    );
    let bright = PlaneMaterial { diffuse: 0.75, ..good };
    assert_eq!(
        fault(&[body(round(1.0), 0)], &[good, bright]),
        Error::ReflectanceSum { material: 1, band: 0, sum: 1.25 }
    );
    let negative = PlaneMaterial { diffuse: -0.5, ..good };
    assert_eq!(
        fault(&[body(round(1.0), 0)], &[negative]),
        Error::MaterialRange { material: 0, band: 0, field: Field::Diffuse, value: -0.5 }
    );
    let input = PlaneInput { bodies: &[body(round(1.0), 0)], materials: &[good] };
    let needed = PlaneScene::bytes(&input).unwrap();
    let mut memory = vec![0; needed - 1];
    assert_eq!(
        PlaneScene::new(&input, Basis::Linear, 1e-3, &mut memory).unwrap_err(),
        Error::BufferTooSmall { needed, given: needed - 1 }
    );
    assert!(Light::new(Sky::Uniform(f64::NAN), None).is_err());

    // working memory of a smaller scene
    let mut memory = vec![0; needed];
    let scene = PlaneScene::new(&input, Basis::Linear, 1e-3, &mut memory).unwrap();
    let two = PlaneInput { bodies: &[body(round(1.0), 0), body(round(2.0), 0)], materials: &[good] };
    let mut memory = vec![0; PlaneScene::bytes(&two).unwrap()];
    let larger = PlaneScene::new(&two, Basis::Linear, 1e-3, &mut memory).unwrap();
    let mut memory = vec![0; Scratch::bytes(&scene, 0).unwrap()];
    let mut scratch = Scratch::new(&scene, 0, &mut memory).unwrap();
    let settings = RowSettings { method: Method::Facets { chains: 1 }, max_bounces: None, cutoff: 1e-9 };
    let (mut matrix, mut open, mut info) = ([0.0; 8], [0.0; 1], [RowInfo::default(); 1]);
    assert_eq!(
        rows::fill(&larger, &settings, 0..1, &mut matrix, &mut open, &mut info, &mut scratch).unwrap_err(),
        Error::Mismatch { what: "plane scratch" }
    );
}

#[test]
fn elements_beyond_counting_by_ulps() {
    // positions along a circle of 2^17 elements have no digits left for a small step back
    let circle = |x, elements| BodyInput {
        shape: Shape::Circle { centre: [x, 0.0], radius: 1.0 },
        material: usize::from(elements > 8),
        elements,
    };
    let matt = PlaneMaterial { diffuse: 0.5, specular: 0.0, gloss: None };
    let black = PlaneMaterial { diffuse: 0.0, ..matt };
    let input = PlaneInput { bodies: &[circle(-1.25, 8), circle(1.25, 1 << 17)], materials: &[matt, black] };
    let mut memory = vec![0; PlaneScene::bytes(&input).unwrap()];
    let scene = PlaneScene::new(&input, Basis::Constant, 1e-3, &mut memory).unwrap();
    let mut memory = vec![0; Scratch::bytes(&scene, 0).unwrap()];
    let mut scratch = Scratch::new(&scene, 0, &mut memory).unwrap();
    let settings = RowSettings { method: Method::Facets { chains: 0 }, max_bounces: None, cutoff: 1e-9 };
    let (mut matrix, mut open, mut info) = (vec![0.0; scene.unknowns()], [0.0; 1], [RowInfo::default(); 1]);
    rows::fill(&scene, &settings, 0..1, &mut matrix, &mut open, &mut info, &mut scratch).unwrap();
    let sum: f64 = matrix.iter().sum();
    // rounding of 40,000 sines
    assert!(open[0] < 0.9 && (sum + open[0] - 1.0).abs() < 1e-10, "{sum} {}", open[0]);
}
