//! The plane model with Kholopov's lobe: closed forms, the paper's rays and better ones, against the reference solver.
//!
//! T8 to T11 are the acceptance tests of the method's study: two circles, distance 2.5, rho_0 = 0.8, at most four
//! reflections in method and truth alike.

#[path = "support/plane_kernel.rs"]
mod plane_kernel;
#[allow(dead_code)]
#[path = "support/plane_reference/mod.rs"]
mod plane_reference;

use blik_kernel::plane::Vec2;
use blik_kernel::plane::host::{self, Settings};
use blik_kernel::plane::light::{Capture, Light, PlaneSun, Sky};
use blik_kernel::plane::lobe::PlaneLobe;
use blik_kernel::plane::rows::Method;
use blik_kernel::plane::scene::{Basis, RaySet};
use plane_kernel::{SAMPLES, eps, pair, solve, uniform, view};
use plane_reference::diffuse::coupled;
use plane_reference::gloss::Gloss;
use plane_reference::scene::{Scene, Shape, Surface};
use std::f64::consts::PI;
use std::sync::OnceLock;

const RATIOS: [f64; 3] = [50.0, 10.0, 3.0];
const RHO: f64 = 0.8;

fn lobe(ratio: f64) -> PlaneLobe {
    PlaneLobe::new(ratio).unwrap()
}

/// Four reflections; nothing diffuse to solve for.
fn capped() -> Settings {
    let (basis, method) = (Basis::Constant, Method::Facets { chains: 0 });
    Settings { basis, method, max_bounces: Some(4), cutoff: 1e-12, solver: 1e-12, tolerance: 1e-3 }
}

type Image = Vec<Option<f64>>;

/// The study's truth for the lobe number `i` of [`RATIOS`]: eps 1.3e-4, 5e-5 and 2e-5 against rules of 1.6 to 2
/// times as many points.
fn truth(i: usize) -> &'static Image {
    static TRUTHS: [OnceLock<Image>; 3] = [const { OnceLock::new() }; 3];
    TRUTHS[i].get_or_init(|| {
        let scene = pair(2.5, 0.0, RHO, Some(RATIOS[i]));
        let points = [[48, 24, 16], [40, 20, 12], [24, 12, 8]][i];
        Gloss::new(&scene, (1.0, None), 4, &points, 1).symmetric_image(SAMPLES, 4)
    })
}

/// The kernel's image with a ray set, and its rays beyond the first for each sample that hits.
fn with_rays(scene: &Scene, rays: RaySet) -> (Image, f64) {
    counted(scene, rays.into(), &capped())
}

fn counted(scene: &Scene, rays: Option<RaySet>, settings: &Settings) -> (Image, f64) {
    solve(scene, 1, rays, &uniform(), settings, |solved, _, scratch| {
        let seen = host::image(solved, 0.0, SAMPLES, scratch).unwrap();
        let hits = seen.iter().filter(|s| s.object);
        let (count, traced) = hits.fold((0.0, 0.0), |(n, r), s| (n + 1.0, r + f64::from(s.rays) - 1.0));
        (view(solved, 0.0, scratch), traced / count)
    })
}

/// eps of an ideal mirror of reflectance `specular` in the lobe's place.
fn one_ray(i: usize, specular: f64) -> f64 {
    let scene = pair(2.5, 0.0, specular, None);
    eps(&with_rays(&scene, RaySet::Gauss([1; 3])).0, truth(i))
}

/// eps of a ray set.
fn of(i: usize, rays: RaySet) -> f64 {
    eps(&with_rays(&pair(2.5, 0.0, RHO, Some(RATIOS[i])), rays).0, truth(i))
}

/// eps of eq. (18) with spacing `share` times Omega_eq.
fn paper(i: usize, share: f64, renormalised: bool) -> f64 {
    of(i, RaySet::Paper { spacing: share * lobe(RATIOS[i]).equivalent_width(1.0), renormalised })
}

#[test]
fn closed_forms() {
    for (ratio, degrees, plain, cosine) in
        [(50.0, 3.555, 0.787, 0.7972), (10.0, 16.937, 0.758, 0.7865), (3.0, 49.871, 0.713, 0.7609)]
    {
        let lobe = lobe(ratio);
        // printed digits
        assert!((lobe.equivalent_width(1.0).to_degrees() - degrees).abs() < 5e-4);
        assert!((RHO * lobe.mean_albedo() - plain).abs() < 6e-4, "{}", RHO * lobe.mean_albedo());
        assert!((RHO * lobe.cosine_mean_albedo() - cosine).abs() < 1e-4);
        let n = 20000;
        let mean = |f: &dyn Fn(f64) -> f64| {
            (0..n).map(|i| f((f64::from(i) + 0.5) / f64::from(n) * PI - PI / 2.0)).sum::<f64>() / f64::from(n)
        };
        // a midpoint rule of 20,000 points, on integrands that bend within 1/50 of their ends
        assert!((mean(&|t| lobe.albedo(t.cos())) - lobe.mean_albedo()).abs() < 1e-6);
        assert!(
            (mean(&|t| lobe.albedo(t.cos()) * t.cos()) * PI / 2.0 - lobe.cosine_mean_albedo()).abs() < 1e-7
        );
        assert!((mean(&|a| lobe.value(a.sin(), a.cos())) * PI - 1.0).abs() < 1e-6);
        for degrees in [0.0f64, 30.0, 70.0, 89.0] {
            let theta = degrees.to_radians();
            let mirror = Vec2::new(theta.sin(), theta.cos());
            let visible = lobe.visible(mirror, Vec2::Y);
            assert!((visible.energy() - lobe.albedo(theta.cos())).abs() < 1e-15);
            assert!(
                (lobe.albedo(theta.cos()) - lobe.equivalent_width(theta.cos()) * lobe.value(0.0, 1.0)).abs()
                    < 1e-14
            );
            for share in [0.01, 0.3, 0.5, 0.99] {
                let w = visible.low + (visible.high - visible.low) * share;
                let d = lobe.direction(mirror, w);
                assert!((lobe.place(mirror, d, &visible) - w).abs() < 1e-12 && d.dot(Vec2::Y) > 0.0);
            }
        }
    }
    assert!((lobe(1.0).value(0.6, 0.8) - 0.4).abs() < 1e-12);
    assert!((lobe(1.0).albedo(0.3) - 0.65).abs() < 1e-12);
    assert!(PlaneLobe::new(0.9).is_err() && PlaneLobe::new(f64::NAN).is_err());
}

#[test]
fn t8_an_isolated_body_shows_the_albedo() {
    for ratio in RATIOS {
        let scene = Scene { surfaces: pair(2.5, 0.0, 1.0, Some(ratio)).surfaces[..1].to_vec() };
        let spacing = lobe(ratio).equivalent_width(1.0);
        for rays in [
            RaySet::Gauss([3, 2, 1]),
            RaySet::Equal([5, 3, 1]),
            RaySet::Split([1; 3]),
            RaySet::Paper { spacing, renormalised: true },
        ] {
            let (image, _) = with_rays(&scene, rays);
            for (i, got) in image.iter().enumerate() {
                let sine = (i as f64 + 0.5) / SAMPLES as f64 * 2.0 - 1.0;
                let want = lobe(ratio).albedo((1.0 - sine * sine).sqrt());
                // rounding alone, next to grazing
                assert!((got.unwrap() - want).abs() < 1e-9, "{ratio} {i}: {got:?} {want}");
            }
        }
    }
}

#[test]
fn t9_one_ray() {
    // figure 2: eps by rho_s
    let at = [0.0, 0.2, 0.4, 0.5, 0.6, 0.65, 0.7, 0.75, 0.8, 0.9, 1.0];
    let table = [
        [0.7690, 0.5899, 0.4048, 0.3087, 0.2095, 0.1586, 0.1069, 0.0555, 0.0230, 0.1227, 0.2461],
        [0.7572, 0.5782, 0.3938, 0.2986, 0.2010, 0.1516, 0.1031, 0.0605, 0.0501, 0.1409, 0.2611],
        [0.7318, 0.5534, 0.3707, 0.2774, 0.1842, 0.1394, 0.1002, 0.0779, 0.0893, 0.1776, 0.2937],
    ];
    for (i, row) in table.iter().enumerate() {
        for (rho, want) in at.iter().zip(row) {
            let got = one_ray(i, *rho);
            assert!((got / want - 1.0).abs() < 0.02, "{} {rho}: {got} {want}", RATIOS[i]);
        }
        let best = (700..=810).map(|r| f64::from(r) * 1e-3).map(|r| (one_ray(i, r), r));
        let (least, argmin) = best.fold((f64::MAX, 0.0), |a, b| if b.0 < a.0 { b } else { a });
        let want = [(0.7959, 0.02251), (0.7846, 0.04708), (0.7594, 0.07725)][i];
        let cosine = RHO * lobe(RATIOS[i]).cosine_mean_albedo();
        println!("T = {}: least eps {least:.4} at {argmin:.3}; cosine mean {cosine:.4}", RATIOS[i]);
        assert!((argmin - want.0).abs() < 0.003 && (least / want.1 - 1.0).abs() < 0.02);
        assert!(i == 2 || (argmin - cosine).abs() < 0.005);
    }
}

#[test]
fn t10_three_rays_of_the_paper() {
    for (i, (one, three)) in [(0.0230, 0.0144), (0.0501, 0.0304), (0.0893, 0.0438)].into_iter().enumerate() {
        let (mirror, rays) = (one_ray(i, RHO), paper(i, 1.0, false));
        println!("T = {}: one ray {mirror:.4}, three of eq. (18) {rays:.4}", RATIOS[i]);
        assert!((mirror / one - 1.0).abs() < 0.02 && (rays / three - 1.0).abs() < 0.02);
        assert!(mirror > 1.5 * rays);
        // the least eps lies next to Omega_eq, as eq. (19) has it
        assert!(paper(i, 0.5, false) > rays && paper(i, 2.0, false) > rays);
    }
}

#[test]
fn t11_better_rays() {
    for (i, goal) in [7.3e-3, 1.3e-2, 1.9e-2].into_iter().enumerate() {
        let printed = paper(i, 1.0, false);
        let renormalised = paper(i, 1.0, true);
        let gauss = of(i, RaySet::Gauss([3; 3]));
        println!("T = {}: (18) {printed:.2e}, renormalised {renormalised:.2e}, Gauss {gauss:.2e}", RATIOS[i]);
        assert!(gauss <= goal && gauss < renormalised && renormalised < printed);
        // the tree cut after the second branching costs at most a tenth
        assert!(of(i, RaySet::Gauss([3, 3, 1])) < 1.1 * gauss);
    }
}

#[test]
fn rays_by_tolerance() {
    for (i, ratio) in RATIOS.into_iter().enumerate() {
        for tolerance in [1e-2, 2e-3, 1e-3] {
            // nobody names a set: the tolerance alone chooses it
            let settings = Settings { tolerance, ..capped() };
            let (image, rays) = counted(&pair(2.5, 0.0, RHO, Some(ratio)), None, &settings);
            let got = eps(&image, truth(i));
            println!("T = {ratio} at {tolerance:.0e}: {got:.2e} with {rays:.0} rays a sample");
            assert!(got < tolerance, "{ratio} {tolerance}: {got}");
        }
    }
}

#[test]
fn coupled_and_uncoupled_samples_apart() {
    for (i, ratio) in RATIOS.into_iter().enumerate() {
        let scene = pair(2.5, 0.0, RHO, Some(ratio));
        let sees: Vec<bool> = scene.view(0.0, SAMPLES).into_iter().map(|ray| coupled(&scene, ray)).collect();
        let apart = |image: &Image, which: bool| {
            let pick = |image: &Image| -> Image {
                image.iter().zip(&sees).map(|(v, &s)| v.filter(|_| s == which)).collect()
            };
            eps(&pick(image), &pick(truth(i)))
        };
        let one =
            with_rays(&pair(2.5, 0.0, RHO * lobe(ratio).cosine_mean_albedo(), None), RaySet::Gauss([1; 3])).0;
        let spacing = lobe(ratio).equivalent_width(1.0);
        let printed = with_rays(&scene, RaySet::Paper { spacing, renormalised: false }).0;
        let gauss = with_rays(&scene, RaySet::Gauss([3; 3])).0;
        let more = with_rays(&scene, RaySet::Gauss([32, 6, 1])).0;
        let row = |which| [&one, &printed, &gauss, &more].map(|image| apart(image, which));
        let (near, far) = (row(true), row(false));
        let show = |row: [f64; 4]| row.map(|e| format!("{e:.2e}"));
        println!("T = {ratio}: coupled 1 ray, (18), 3 and 32 Gauss: {:?}", show(near));
        println!("        uncoupled {:?}", show(far));
        // the paper: more rays improve the coupled samples too
        assert!(near[1] < near[0] && near[2] < near[1] && near[3] < 0.3 * near[2]);
        // what sees only sky is exact where rays share A(theta)
        assert!(far[2] < 1e-9 && far[2] < far[0]);
    }
}

#[test]
fn gloss_with_diffuse_reflection() {
    for (ratio, points) in [(10.0, [24, 12, 8]), (3.0, [16, 10, 6])] {
        let scene = pair(2.5, 0.4, 0.5, Some(ratio));
        let truth = Gloss::new(&scene, (1.0, None), 4, &points, 8).symmetric_image(SAMPLES, 4);
        let settings = Settings {
            basis: Basis::Panels(4),
            method: Method::Split { points: 6 },
            tolerance: 2e-3,
            ..capped()
        };
        let set = None;
        let full = solve(&scene, 12, set, &uniform(), &settings, |s, _, scratch| view(s, 0.0, scratch));
        let got = eps(&full, &truth);
        // the same without light that reaches diffuse surfaces by way of glossy ones
        let dull = pair(2.5, 0.4, 0.0, None);
        let lacking = solve(&dull, 12, set, &uniform(), &settings, |partial, _, _| {
            let levels = partial.radiance.to_vec();
            solve(&scene, 12, set, &uniform(), &settings, |s, _, scratch| {
                view(&blik_kernel::plane::image::Solved { radiance: &levels, ..*s }, 0.0, scratch)
            })
        });
        let without = eps(&lacking, &truth);
        println!("T = {ratio}: {got:.2e}; without gloss in the solve {without:.2e}");
        assert!(got < 2e-3 && without > 5.0 * got, "{got} {without}");
    }
}

/// A sun at 60 degrees from the view.
fn sun(capture: Option<Capture>) -> Light<'static> {
    let direction = Vec2::new((PI / 3.0).sin(), (PI / 3.0).cos());
    Light::new(Sky::Uniform(0.0), Some(PlaneSun { direction, irradiance: 1.0, capture })).unwrap()
}

#[test]
fn sun_in_a_cone_or_in_the_lobe() {
    // figure 3 at rho_s = 0.5 and 0.8, cones of 2, 9 and 18 degrees: S1 keeps the sun's energy, S2 is E/Omega_eq
    let table = [
        [[0.0301, 0.0442], [0.0297, 0.0528]],
        [[0.0670, 0.1017], [0.0665, 0.1114]],
        [[0.1297, 0.2260], [0.1401, 0.1481]],
    ];
    let settings = Settings { max_bounces: Some(3), ..capped() };
    for (i, ratio) in RATIOS.into_iter().enumerate() {
        let scene = pair(2.5, 0.0, RHO, Some(ratio));
        let omega = lobe(ratio).equivalent_width(1.0);
        let direction = [(PI / 3.0).sin(), (PI / 3.0).cos()];
        let points = [[160, 80], [96, 48], [48, 32]][i];
        let truth =
            Gloss::new(&scene, (0.0, Some((direction, 1.0))), 3, &points, 1).image(0.0, SAMPLES, SAMPLES, 3);
        let got = |scene: &Scene, rays, light: &Light<'_>| {
            let image = solve(scene, 1, rays, light, &settings, |s, _, scratch| view(s, 0.0, scratch));
            eps(&image, &truth) * omega
        };
        let half = [2.0f64, 9.0, 18.0][i].to_radians();
        for (cone, row) in
            [Capture::conserving(1.0, half), Capture { half_angle: half, radiance: 1.0 / omega }]
                .into_iter()
                .zip(table[i])
        {
            for (rho, want) in [0.5, 0.8].into_iter().zip(row) {
                let eps = got(&pair(2.5, 0.0, rho, None), RaySet::Gauss([1; 3]), &sun(Some(cone)));
                println!("T = {ratio}, rho_s {rho}: cone {eps:.4} ({want})");
                // the study's own uncertainty is 3 %: highlights are a few samples wide
                assert!((eps / want - 1.0).abs() < 0.06, "{eps} {want}");
            }
        }
        // evaluated directly, the lobe shows the sun exactly at the first hit; no cone is added. The truth's own error
        // is 5e-5, 7e-5 and 9e-4, by rules of twice as many points
        let direct = got(&scene, RaySet::Split([24, 8, 4]), &sun(None));
        println!("T = {ratio}: lobe evaluated {direct:.2e}");
        assert!(direct < 0.2 * table[i][0][0], "{direct}");
    }
}

#[test]
fn sun_on_glossy_diffuse_bodies() {
    let scene = pair(2.5, 0.5, 0.3, Some(3.0));
    let toward = [0.3f64.sin(), 0.3f64.cos()];
    let truth =
        Gloss::new(&scene, (0.2, Some((toward, 1.0))), 3, &[24, 12, 8], 48).image(0.0, SAMPLES, SAMPLES, 3);
    let sun = PlaneSun { direction: Vec2::from(toward), irradiance: 1.0, capture: None };
    let light = Light::new(Sky::Uniform(0.2), Some(sun)).unwrap();
    let method = Method::Split { points: 8 };
    let settings = Settings { basis: Basis::Panels(4), method, max_bounces: Some(3), ..capped() };
    let set = RaySet::Split([16, 8, 4]);
    let image = solve(&scene, 16, set, &light, &settings, |s, _, scratch| view(s, 0.0, scratch));
    let got = eps(&image, &truth);
    println!("sun on diffuse and glossy circles: {got:.2e}");
    // the truth's polynomials round off shadows' edges; without sunlight bounced by neighbours eps is above 1e-2
    assert!(got < 2e-3, "{got}");
}

#[test]
fn isolated_body_in_the_sun_is_exact() {
    let scene = Scene { surfaces: pair(2.5, 0.0, 1.0, Some(10.0)).surfaces[..1].to_vec() };
    let toward = [(PI / 3.0).sin(), (PI / 3.0).cos()];
    let truth = Gloss::new(&scene, (0.3, Some((toward, 2.0))), 2, &[8], 1).image(0.0, SAMPLES, SAMPLES, 2);
    let direction = Vec2::new(3.0 * toward[0], 3.0 * toward[1]);
    let light =
        Light::new(Sky::Uniform(0.3), Some(PlaneSun { direction, irradiance: 2.0, capture: None })).unwrap();
    let image =
        solve(&scene, 1, RaySet::Gauss([3; 3]), &light, &capped(), |s, _, scratch| view(s, 0.0, scratch));
    // rounding
    assert!(eps(&image, &truth) < 1e-12);
}

#[test]
fn a_gallery_of_perfect_lobes_ends() {
    // light runs to and fro between two glossy walls that absorb nothing: chains end at 64 lobes
    let wall = |a: [f64; 2], b: [f64; 2]| Surface {
        shape: Shape::Segment { a, b },
        diffuse: 0.0,
        specular: 1.0,
        lobe: Some(5000.0),
    };
    let walls = vec![wall([-1.0, 0.0], [-1.0, 50.0]), wall([1.0, 50.0], [1.0, 0.0])];
    let ray = (Vec2::new(0.0, 25.0), Vec2::new(1.0, 0.0));
    let walls = Scene { surfaces: walls };
    let settings = Settings { max_bounces: None, cutoff: 1e-9, ..capped() };
    for set in [RaySet::Gauss([1; 3]), RaySet::Split([1; 3])] {
        let seen =
            solve(&walls, 1, set, &uniform(), &settings, |s, _, scratch| s.radiance(ray.0, ray.1, scratch));
        assert!(seen.radiance.is_finite() && seen.radiance <= 1.0 && seen.lost <= 1.0 + 1e-12, "{seen:?}");
        assert!(seen.rays >= 60, "{seen:?}");
    }
}
